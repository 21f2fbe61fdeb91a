//! The tables `[flow]` and `[[flow]]` as written.

use super::values::{items, number, refuse};
use serde::de::{self, Deserialize, Deserializer, MapAccess, SeqAccess, Visitor};
use std::fmt;
use toml::Value;

/// One operating point, or several where a key has a list of values.
#[derive(Debug, Clone, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FlowTable {
    pub name: Option<String>,
    pub weight: Option<f64>,
    pub alpha: Option<Alpha>,
    pub cl: Option<OneOrMore>,
    pub mach: Option<OneOrMore>,
    pub reynolds: Option<OneOrMore>,
    pub ncrit: Option<OneOrMore>,
    pub trip: Option<Trips>,
    pub panels: Option<usize>,
    pub stations: Option<usize>,
    pub solver: Option<String>,
}

/// Angles of attack in degrees: prescribed, or design variables.
#[derive(Debug, Clone)]
pub(crate) enum Alpha {
    Prescribed(OneOrMore),
    Free(FreeAlpha),
}

/// An angle of attack that is a design variable, or one for each of the starts.
#[derive(Debug, Clone, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct FreeAlpha {
    pub start: OneOrMore,
    pub lower: Option<f64>,
    pub upper: Option<f64>,
    pub scale: Option<f64>,
}

impl<'de> Deserialize<'de> for Alpha {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Any;
        impl<'de> Visitor<'de> for Any {
            type Value = Alpha;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("an angle in degrees, a list of them, or a table { start, lower, upper, scale }")
            }
            fn visit_f64<E: de::Error>(self, degrees: f64) -> Result<Alpha, E> {
                Ok(Alpha::Prescribed(OneOrMore(vec![degrees])))
            }
            fn visit_i64<E: de::Error>(self, degrees: i64) -> Result<Alpha, E> {
                self.visit_f64(degrees as f64)
            }
            fn visit_seq<A: SeqAccess<'de>>(self, seq: A) -> Result<Alpha, A::Error> {
                OneOrMore::deserialize(de::value::SeqAccessDeserializer::new(seq)).map(Alpha::Prescribed)
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Alpha, A::Error> {
                FreeAlpha::deserialize(de::value::MapAccessDeserializer::new(map)).map(Alpha::Free)
            }
        }
        deserializer.deserialize_any(Any)
    }
}

/// A number or a list of them.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct OneOrMore(pub Vec<f64>);

impl<'de> Deserialize<'de> for OneOrMore {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = Value::deserialize(deserializer)?;
        match items(&value).iter().map(number).collect::<Option<Vec<f64>>>() {
            Some(numbers) if !numbers.is_empty() => Ok(Self(numbers)),
            _ => refuse(&value, "a number, or a list of numbers"),
        }
    }
}

/// `[flow]`, or several `[[flow]]`.
#[derive(Debug, Clone)]
pub(crate) struct FlowTables(pub Vec<FlowTable>);

impl<'de> Deserialize<'de> for FlowTables {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Any;
        impl<'de> Visitor<'de> for Any {
            type Value = FlowTables;
            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str("a table [flow], or several [[flow]]")
            }
            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<FlowTables, A::Error> {
                let table = FlowTable::deserialize(de::value::MapAccessDeserializer::new(map))?;
                Ok(FlowTables(vec![table]))
            }
            fn visit_seq<A: SeqAccess<'de>>(self, mut seq: A) -> Result<FlowTables, A::Error> {
                let mut list = Vec::new();
                while let Some(table) = seq.next_element()? {
                    list.push(table);
                }
                Ok(FlowTables(list))
            }
        }
        deserializer.deserialize_any(Any)
    }
}

/// Positions of trip strips: one for both sides, one per side, or a list of such pairs; a position at the trailing edge
/// (1) is none.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Trips(pub Vec<[f64; 2]>);

impl<'de> Deserialize<'de> for Trips {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let value = Value::deserialize(deserializer)?;
        let pair = |value: &Value| {
            let numbers: Option<Vec<f64>> = items(value).iter().map(number).collect();
            match numbers.as_deref() {
                Some([both]) => Some([*both; 2]),
                Some([upper, lower]) => Some([*upper, *lower]),
                _ => None,
            }
        };
        let list = value.as_array().filter(|list| !list.is_empty() && list.iter().all(Value::is_array));
        let pairs: Option<Vec<[f64; 2]>> = match list {
            Some(list) => list.iter().map(pair).collect(),
            None => pair(&value).map(|pair| vec![pair]),
        };
        let expected =
            "x/c of the trip strips: a number, two for the upper and the lower side, or a list of such pairs";
        pairs.map_or_else(|| refuse(&value, expected), |pairs| Ok(Self(pairs)))
    }
}
