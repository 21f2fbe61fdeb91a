//! Quantities by name, and constraints on them.

use super::document::Document;
use super::error::{CaseError, nearest};
use super::schema::{ConstraintTable, Limit};
use crate::design::{
    Bounds, Constraint, DesignError, FlowOutput, FlowQuantity, Geometry, Instruments, OperatingPoint, Quantity,
    SoftLimit,
};

/// Which operating points a name means.
enum At<'a> {
    /// All of them, as the place of the name has it: `cd`.
    Unsaid,
    /// The weighted mean: `mean(cd)`.
    Mean,
    /// One of them: `cd at cruise` or `cd_at(cruise)`.
    Point(&'a str),
}

/// Output and operating points of a name.
fn flow_name(name: &str) -> Option<(FlowOutput, At<'_>)> {
    let name = name.trim();
    if let Some(output) = FlowOutput::from_name(name) {
        return Some((output, At::Unsaid));
    }
    if let Some(inner) = name.strip_prefix("mean(").and_then(|rest| rest.strip_suffix(')')) {
        return Some((FlowOutput::from_name(inner.trim())?, At::Mean));
    }
    let (output, label) = match name.split_once("_at(") {
        Some((output, rest)) => (output, rest.strip_suffix(')')?),
        None => name.split_once(" at ")?,
    };
    Some((FlowOutput::from_name(output.trim())?, At::Point(label.trim())))
}

fn flow_quantity(output: FlowOutput, point: Option<usize>, points: &[OperatingPoint]) -> Quantity {
    let label = point.filter(|_| points.len() > 1).map(|k| points[k].name.clone()).unwrap_or_default();
    Quantity::Flow(FlowQuantity { output, point, label })
}

/// The meaning of names of quantities in a case.
pub(super) struct Quantities<'a> {
    pub document: &'a Document,
    pub geometry: &'a Geometry,
    pub instruments: &'a Instruments,
}

impl Quantities<'_> {
    /// The quantity of a name; of the flow at several operating points, its weighted mean.
    pub fn one(&self, name: &str, path: &[&str]) -> Result<Quantity, CaseError> {
        if let Some((output, at)) = flow_name(name) {
            let points = self.points(path)?;
            let point = match at {
                At::Point(label) => Some(self.point(label, path)?),
                At::Unsaid | At::Mean if points.len() == 1 => Some(0),
                At::Unsaid | At::Mean => None,
            };
            return Ok(flow_quantity(output, point, points));
        }
        let quantity = Quantity::parse(name).map_err(|error| {
            let mut message = error.to_string();
            if let Some(near) = nearest(name, FlowOutput::names()) {
                message += &format!("; did you mean {near}?");
            }
            self.document.error(path, message)
        })?;
        let lacking = match quantity {
            Quantity::FoldPenalty => self.instruments.penalty().err(),
            Quantity::PressureError => self.instruments.pressures().err(),
            _ => None,
        };
        match lacking {
            Some(error) => Err(self.document.error(path, error.to_string())),
            None => Ok(quantity),
        }
    }

    /// The quantities of a name: of the flow, one for each operating point; of the fold indicator, one for each
    /// control point of the box.
    pub fn each(&self, name: &str, path: &[&str]) -> Result<Vec<Quantity>, CaseError> {
        if let Some((output, At::Unsaid)) = flow_name(name) {
            let points = self.points(path)?;
            return Ok((0..points.len()).map(|k| flow_quantity(output, Some(k), points)).collect());
        }
        if name != "fold_indicator" {
            return Ok(vec![self.one(name, path)?]);
        }
        let lattice = self.geometry.lattice().ok_or(DesignError::NoBox);
        let lattice = lattice.map_err(|e| self.document.error(path, e.to_string()))?;
        let [columns, rows] = lattice.counts();
        let point = |index: usize| Quantity::FoldIndicator { column: index % columns, row: index / columns, index };
        Ok((0..columns * rows).map(point).collect())
    }

    fn points(&self, path: &[&str]) -> Result<&[OperatingPoint], CaseError> {
        let flow = self.instruments.flow().map_err(|e| self.document.error(path, e.to_string()))?;
        Ok(flow.points())
    }

    fn point(&self, label: &str, path: &[&str]) -> Result<usize, CaseError> {
        let points = self.points(path)?;
        points.iter().position(|p| p.name == label).ok_or_else(|| {
            let known: Vec<&str> = points.iter().map(|p| p.name.as_str()).collect();
            let message = format!("there is no operating point {label:?}; there are: {}", known.join(", "));
            self.document.error(path, message)
        })
    }

    /// The constraints of all entries of the table, each quantity once.
    pub fn constraints(&self, table: &[(String, ConstraintTable)]) -> Result<Vec<Constraint>, CaseError> {
        let mut constraints: Vec<Constraint> = Vec::new();
        let mut names: Vec<&str> = Vec::new();
        for (name, entry) in table.iter().filter(|(_, entry)| entry.weight.is_none()) {
            let path = ["constraints", name];
            for quantity in self.each(name, &path)? {
                if let Some(other) = constraints.iter().position(|c| c.quantity == quantity) {
                    return Err(self.twice(&quantity, [name, names[other]]));
                }
                constraints.push(self.constraint(name, quantity, entry)?);
                names.push(name);
            }
        }
        Ok(constraints)
    }

    /// The entries of the table that have a weight, as terms of the objective.
    pub fn soft_limits(&self, table: &[(String, ConstraintTable)]) -> Result<Vec<(Quantity, f64)>, CaseError> {
        let mut terms: Vec<(Quantity, f64)> = Vec::new();
        for (name, entry) in table {
            let Some(weight) = entry.weight else { continue };
            let path = ["constraints", name];
            if !(weight.is_finite() && weight > 0.0) {
                return Err(self.document.error(&[path[0], name, "weight"], format!("{weight} must be positive")));
            }
            for quantity in self.each(name, &path)? {
                let Constraint { quantity, bounds } = self.constraint(name, quantity, entry)?;
                let limit = SoftLimit { bounds };
                terms.push((Quantity::Soft { quantity: Box::new(quantity), limit }, weight));
            }
        }
        Ok(terms)
    }

    /// Two entries for one quantity: an error at the one that stands later in the file.
    fn twice(&self, quantity: &Quantity, names: [&str; 2]) -> CaseError {
        let error = |here: &str, there: &str| {
            let message = format!("{} is constrained by {there:?} already; give all its limits there", quantity.name());
            self.document.error(&["constraints", here], message)
        };
        let [a, b] = [error(names[0], names[1]), error(names[1], names[0])];
        if a.line >= b.line { a } else { b }
    }

    fn constraint(&self, name: &str, quantity: Quantity, table: &ConstraintTable) -> Result<Constraint, CaseError> {
        let path = ["constraints", name];
        let limit = |key: &str, limit: &Option<Limit>, missing: f64| -> Result<f64, CaseError> {
            let value = match limit {
                None => return Ok(missing),
                Some(Limit::Absolute(value)) => *value,
                Some(Limit::TimesInitial(factor)) => factor * self.value(&quantity, &path)?,
            };
            if value.is_finite() {
                Ok(value)
            } else {
                Err(self.document.error(&[path[0], name, key], format!("{value} is not finite")))
            }
        };
        let bounds = match (&table.equal, &table.min, &table.max) {
            (Some(_), None, None) => {
                let value = limit("equal", &table.equal, 0.0)?;
                Bounds { lower: value, upper: value }
            }
            (None, None, None) => return Err(self.document.error(&path, "give `min`, `max` or `equal`")),
            (None, min, max) => {
                Bounds { lower: limit("min", min, f64::NEG_INFINITY)?, upper: limit("max", max, f64::INFINITY)? }
            }
            _ => return Err(self.document.error(&path, "`equal` goes with neither `min` nor `max`")),
        };
        if bounds.lower > bounds.upper {
            return Err(self.document.error(&path, format!("min {} is above max {}", bounds.lower, bounds.upper)));
        }
        Ok(Constraint { quantity, bounds })
    }

    fn value(&self, quantity: &Quantity, path: &[&str]) -> Result<f64, CaseError> {
        let start: Vec<f64> = self.geometry.variables().iter().map(|v| v.start).collect();
        let value = self.geometry.shape(&start).and_then(|shape| self.instruments.value(quantity, &shape));
        value.map_err(|error| self.document.error(path, error.to_string()))
    }
}
