//! The case file as written: one struct per table, unknown keys refused.
//!
//! Every key is documented for users in `validation/cases/README.md`.

mod flow;
mod values;

pub(super) use flow::{Alpha, FlowTable, FlowTables, FreeAlpha, OneOrMore};

use crate::design::{Axis, Selection};
use serde::de::{self, Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use std::fmt;
use toml::Value;
use values::{items, number, refuse};

/// A whole case file.
#[derive(Debug, Clone, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct CaseTable {
    pub name: String,
    pub description: Option<String>,
    pub section: SectionTable,
    pub target: Option<SectionTable>,
    #[serde(rename = "box")]
    pub lattice: Option<BoxTable>,
    pub direct: Option<DirectTable>,
    #[serde(default)]
    pub variables: VariablesTable,
    #[serde(default)]
    pub fold_penalty: FoldTable,
    #[serde(default)]
    pub shape_error: ShapeErrorTable,
    pub flow: Option<FlowTables>,
    pub pressure_target: Option<PressureTargetTable>,
    pub objective: ObjectiveTable,
    #[serde(default)]
    pub constraints: Entries<ConstraintTable>,
    #[serde(default)]
    pub report: ReportTable,
    #[serde(default)]
    pub optimizer: OptimizerTable,
}

#[derive(Debug, Clone, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SectionTable {
    pub naca: Option<String>,
    pub kulfan: Option<KulfanTable>,
    pub file: Option<String>,
    pub trailing_edge: Option<TrailingEdgeName>,
    pub control_points: Option<usize>,
    pub fit_tolerance: Option<f64>,
    pub element: Option<usize>,
    pub normalize: Option<bool>,
}

#[derive(Debug, Clone, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct KulfanTable {
    pub upper: Vec<f64>,
    pub lower: Vec<f64>,
    pub class: Option<[f64; 2]>,
    pub gap: Option<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum TrailingEdgeName {
    Sharp,
    Blunt,
}

#[derive(Debug, Clone, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct BoxTable {
    pub x: Option<[f64; 2]>,
    pub y: Option<[f64; 2]>,
    pub corners: Option<Vec<[f64; 2]>>,
    pub points: Option<Vec<[f64; 2]>>,
    pub control_points: [usize; 2],
    pub degree: [usize; 2],
    pub placement: Option<PlacementName>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum PlacementName {
    Even,
    Greville,
}

/// The control points of the section are moved themselves; no keys.
#[derive(Debug, Clone, Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct DirectTable {}

#[derive(Debug, Clone, Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct VariablesTable {
    pub free: Option<Rules>,
    pub fixed: Option<Rules>,
    pub x_fixed: Option<Rules>,
    pub y_fixed: Option<Rules>,
    pub mirror: Option<MirrorName>,
    #[serde(default)]
    pub pin: Vec<PinEntry>,
    #[serde(default)]
    pub tied: Vec<TieTable>,
    #[serde(default)]
    pub parameters: Parameters,
    #[serde(default)]
    pub bounds: Entries<[f64; 2]>,
    #[serde(default)]
    pub scale: Entries<f64>,
    #[serde(default)]
    pub start: Entries<f64>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize)]
pub(crate) enum MirrorName {
    #[serde(rename = "chord line")]
    ChordLine,
}

#[derive(Debug, Clone, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TieTable {
    pub control_points: Vec<[usize; 2]>,
    pub axis: AxisName,
    pub coefficients: Option<Vec<f64>>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum AxisName {
    X,
    Y,
}

impl From<AxisName> for Axis {
    fn from(name: AxisName) -> Self {
        match name {
            AxisName::X => Self::X,
            AxisName::Y => Self::Y,
        }
    }
}

#[derive(Debug, Clone, Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FoldTable {
    pub alpha: Option<f64>,
    pub epsilon: Option<f64>,
    pub normalised: Option<bool>,
}

#[derive(Debug, Clone, Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ShapeErrorTable {
    pub norm: Option<String>,
}

/// Wanted pressures.
#[derive(Debug, Clone, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PressureTargetTable {
    pub file: Option<String>,
    pub upper: Option<Vec<[f64; 2]>>,
    pub lower: Option<Vec<[f64; 2]>>,
    pub section: Option<SectionTable>,
    pub flow: Option<FlowTable>,
    pub point: Option<String>,
}

#[derive(Debug, Clone, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ObjectiveTable {
    #[serde(default)]
    pub minimize: Entries<f64>,
    #[serde(default)]
    pub maximize: Entries<f64>,
}

#[derive(Debug, Clone, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ConstraintTable {
    pub min: Option<Limit>,
    pub max: Option<Limit>,
    pub equal: Option<Limit>,
    pub weight: Option<f64>,
}

#[derive(Debug, Clone, Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ReportTable {
    #[serde(default)]
    pub values: Vec<String>,
}

#[derive(Debug, Clone, Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct OptimizerTable {
    pub method: Option<String>,
    pub max_evaluations: Option<usize>,
    pub max_iterations: Option<usize>,
    pub tolerance: Option<f64>,
    pub feasibility: Option<f64>,
    pub memory: Option<usize>,
}

/// The entries of a table whose keys are names, sorted by key as the TOML parser hands them out.
#[derive(Debug, Clone)]
pub(crate) struct Entries<T>(pub Vec<(String, T)>);

impl<T> Default for Entries<T> {
    fn default() -> Self {
        Self(Vec::new())
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Entries<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Pairs<T>(std::marker::PhantomData<T>);
        impl<'de, T: Deserialize<'de>> Visitor<'de> for Pairs<T> {
            type Value = Entries<T>;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a table")
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut pairs = Vec::new();
                while let Some(pair) = map.next_entry()? {
                    pairs.push(pair);
                }
                Ok(Entries(pairs))
            }
        }
        deserializer.deserialize_map(Pairs(std::marker::PhantomData))
    }
}

/// `"all"`, `true`, `"none"`, `false`, or a list of selections.
#[derive(Debug, Clone)]
pub(crate) enum Rules {
    All,
    None,
    List(Vec<SelectionTable>),
}

#[derive(Debug, Clone, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct SelectionTable {
    pub columns: Option<Indices>,
    pub rows: Option<Indices>,
    pub axis: Option<AxisName>,
}

impl From<SelectionTable> for Selection {
    fn from(table: SelectionTable) -> Self {
        Self { columns: table.columns.map(|i| i.0), rows: table.rows.map(|i| i.0), axis: table.axis.map(Axis::from) }
    }
}

impl<'de> Deserialize<'de> for Rules {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Any;
        impl<'de> Visitor<'de> for Any {
            type Value = Rules;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("\"all\", \"none\", or a list of selections like [{ columns = [0, -1], axis = \"y\" }]")
            }
            fn visit_str<E: de::Error>(self, text: &str) -> Result<Rules, E> {
                match text {
                    "all" => Ok(Rules::All),
                    "none" => Ok(Rules::None),
                    _ => Err(E::invalid_value(de::Unexpected::Str(text), &self)),
                }
            }
            fn visit_bool<E: de::Error>(self, value: bool) -> Result<Rules, E> {
                Ok(if value { Rules::All } else { Rules::None })
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Rules, A::Error> {
                let mut list = Vec::new();
                while let Some(selection) = seq.next_element()? {
                    list.push(selection);
                }
                Ok(Rules::List(list))
            }
        }
        deserializer.deserialize_any(Any)
    }
}

/// One index or a list of them.
#[derive(Debug, Clone)]
pub(crate) struct Indices(pub Vec<i64>);

impl<'de> Deserialize<'de> for Indices {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = Value::deserialize(deserializer)?;
        match items(&value).iter().map(Value::as_integer).collect() {
            Some(indices) => Ok(Self(indices)),
            None => refuse(&value, "an index or a list of indices (from 0; negative ones count from the last)"),
        }
    }
}

/// `"nose"`, `"tail"`, or a curve parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum PinEntry {
    Nose,
    Tail,
    Parameter(f64),
}

impl<'de> Deserialize<'de> for PinEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = Value::deserialize(deserializer)?;
        match (value.as_str(), number(&value)) {
            (Some("nose"), _) => Ok(Self::Nose),
            (Some("tail"), _) => Ok(Self::Tail),
            (_, Some(parameter)) => Ok(Self::Parameter(parameter)),
            _ => refuse(&value, "\"nose\", \"tail\" or a curve parameter from 0 to 1"),
        }
    }
}

/// `["thickness", …]`, or `{ thickness = { lower = 0.1, upper = 0.2, scale = 0.01 }, … }`.
#[derive(Debug, Clone, Default)]
pub(crate) struct Parameters(pub Vec<(String, ParameterTable)>);

#[derive(Debug, Clone, Default, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct ParameterTable {
    pub lower: Option<f64>,
    pub upper: Option<f64>,
    pub scale: Option<f64>,
}

impl<'de> Deserialize<'de> for Parameters {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Any;
        impl<'de> Visitor<'de> for Any {
            type Value = Parameters;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a list of section parameters, or a table { name = { lower, upper, scale } }")
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<Parameters, A::Error> {
                let mut list = Vec::new();
                while let Some(name) = seq.next_element()? {
                    list.push((name, ParameterTable::default()));
                }
                Ok(Parameters(list))
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Parameters, A::Error> {
                let mut list = Vec::new();
                while let Some(pair) = map.next_entry()? {
                    list.push(pair);
                }
                Ok(Parameters(list))
            }
        }
        deserializer.deserialize_any(Any)
    }
}

/// A number, or a multiple of the value at the start: `"0.5 * initial"`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Limit {
    Absolute(f64),
    TimesInitial(f64),
}

impl<'de> Deserialize<'de> for Limit {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = Value::deserialize(deserializer)?;
        let factor = value.as_str().and_then(|text| {
            let factors: Vec<&str> = text.split('*').map(str::trim).collect();
            match factors[..] {
                ["initial"] => Some(1.0),
                [number, "initial"] | ["initial", number] => number.parse().ok(),
                _ => None,
            }
        });
        match (number(&value), factor) {
            (Some(limit), _) => Ok(Self::Absolute(limit)),
            (None, Some(factor)) => Ok(Self::TimesInitial(factor)),
            (None, None) => refuse(&value, "a number, or a multiple of the start like \"0.5 * initial\""),
        }
    }
}
