//! How the control points of a box may move: groups, free and fixed components, pinned points.

use super::DesignError;
use crate::ffd::LinearMap;
use crate::scalar::Scalar;

/// One of the two coordinates of a control point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Axis {
    /// Along the chord.
    X,
    /// Normal to the chord.
    Y,
}

impl Axis {
    /// 0 for x, 1 for y.
    pub fn index(self) -> usize {
        match self {
            Self::X => 0,
            Self::Y => 1,
        }
    }
}

/// A selection of components of box control points; what is `None` selects all.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Selection {
    /// Columns (along x) from 0; negative ones count from the last.
    pub columns: Option<Vec<i64>>,
    /// Rows (along y) from 0, the lowest; negative ones count from the last.
    pub rows: Option<Vec<i64>>,
    /// One coordinate only.
    pub axis: Option<Axis>,
}

/// Control points that move together along one axis, with coefficients.
#[derive(Debug, Clone, PartialEq)]
pub struct Tie {
    /// Column and row of each control point.
    pub control_points: Vec<[usize; 2]>,
    /// The coordinate tied.
    pub axis: Axis,
    /// Movement of each control point per unit of the variable; none of them zero.
    pub coefficients: Vec<f64>,
}

/// Rules for the movement of a box, as the designer gives them.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MotionRules {
    /// Components that are design variables; a group is free when one of its components is selected.
    pub free: Vec<Selection>,
    /// Components that are not, whatever `free` says.
    pub fixed: Vec<Selection>,
    /// The lower half mirrors the upper: x moves with, y against, the middle row only along x.
    pub mirror: bool,
    /// Groups that move together.
    pub ties: Vec<Tie>,
}

/// A set of components that move in fixed proportion: the smallest unit of motion.
#[derive(Debug, Clone, PartialEq)]
struct Group {
    /// Component (2 × control point + axis) and its movement per unit of the group.
    components: Vec<(usize, f64)>,
    free: bool,
}

/// The linear motion of a box: which groups are variables, and which make up for them at pinned points.
#[derive(Debug, Clone, PartialEq)]
pub struct BoxMotion {
    counts: [usize; 2],
    groups: Vec<Group>,
    /// Groups that are design variables.
    variables: Vec<usize>,
    /// Groups that keep the pinned points still, and the equation (2 × pin + axis) each answers.
    compensators: Vec<(usize, usize)>,
}

impl BoxMotion {
    /// The motion of an `n × m` net under the rules, with points pinned.
    ///
    /// `pins` maps displacements of the net to the displacement of each pinned point. A pinned point holds still
    /// exactly: for each of its coordinates the group with the strongest hold on it (whether or not it would be
    /// free) answers for the others, and is no design variable.
    ///
    /// # Errors
    /// Selections beyond the net, contradicting ties, or a pin that nothing can hold.
    pub fn new(counts: [usize; 2], rules: &MotionRules, pins: &LinearMap) -> Result<Self, DesignError> {
        let mut groups = group(counts, rules)?;
        let selected = |list: &[Selection]| -> Result<Vec<bool>, DesignError> {
            let mut marks = vec![false; 2 * counts[0] * counts[1]];
            for selection in list {
                selection.mark(counts, &mut marks)?;
            }
            Ok(marks)
        };
        let (free, fixed) = (selected(&rules.free)?, selected(&rules.fixed)?);
        for group in &mut groups {
            let any = |marks: &[bool]| group.components.iter().any(|(c, _)| marks[*c]);
            group.free = any(&free) && !any(&fixed);
        }
        let mut motion = Self { counts, groups, variables: Vec::new(), compensators: Vec::new() };
        motion.choose_compensators(pins);
        motion.variables = (0..motion.groups.len())
            .filter(|g| motion.groups[*g].free && motion.compensators.iter().all(|(c, _)| c != g))
            .collect();
        Ok(motion)
    }

    /// Movement of pinned coordinate `equation` per unit of a group.
    fn response<S: Scalar>(&self, pins: &LinearMap<S>, equation: usize, group: usize) -> S {
        let (pin, axis) = (equation / 2, equation % 2);
        let mut sum = S::from(0.0);
        for (control_point, weight) in pins.row(pin) {
            for (component, coefficient) in &self.groups[group].components {
                if *component == 2 * control_point + axis {
                    sum += weight * *coefficient;
                }
            }
        }
        sum
    }

    /// Gaussian elimination with complete pivoting on the responses of all groups.
    ///
    /// Equations that no group responds to hold by themselves (a nose on the mirror line cannot move up).
    fn choose_compensators(&mut self, pins: &LinearMap) {
        let equations = 2 * pins.outputs();
        let mut matrix: Vec<Vec<f64>> =
            (0..equations).map(|e| (0..self.groups.len()).map(|g| self.response(pins, e, g)).collect()).collect();
        let mut open: Vec<usize> = (0..equations).collect();
        while !open.is_empty() {
            let mut best = (0, 0, 0.0f64);
            for &e in &open {
                for (g, value) in matrix[e].iter().enumerate() {
                    if value.abs() > best.2 {
                        best = (e, g, value.abs());
                    }
                }
            }
            let (equation, group, size) = best;
            if size < 1e-12 {
                return;
            }
            self.compensators.push((group, equation));
            open.retain(|e| *e != equation);
            let pivot_row = matrix[equation].clone();
            for &e in &open {
                let factor = matrix[e][group] / pivot_row[group];
                for (value, pivot) in matrix[e].iter_mut().zip(&pivot_row) {
                    *value -= factor * pivot;
                }
                matrix[e][group] = 0.0;
            }
        }
    }

    /// Names of the design variables: `dx[column,row]` or `dy[column,row]` of the control point that leads its group.
    pub fn names(&self) -> Vec<String> {
        let name = |group: &usize| {
            let component = self.groups[*group].components[0].0;
            let point = component / 2;
            let axis = ["dx", "dy"][component % 2];
            format!("{axis}[{},{}]", point % self.counts[0], point / self.counts[0])
        };
        self.variables.iter().map(name).collect()
    }

    /// The axis each variable moves along.
    pub fn axes(&self) -> Vec<Axis> {
        let axis = |group: &usize| [Axis::X, Axis::Y][self.groups[*group].components[0].0 % 2];
        self.variables.iter().map(axis).collect()
    }

    /// The linear map from variables to displacement components (row 2 × control point + axis).
    ///
    /// `pins` as in [`new`](Self::new), over any scalar: where the embedded points depend on parameters of the
    /// section, so does the share of the compensating groups.
    pub fn map<S: Scalar>(&self, pins: &LinearMap<S>) -> LinearMap<S> {
        let shares = self.shares(pins);
        let mut rows: Vec<Vec<(usize, S)>> = vec![Vec::new(); 2 * self.counts[0] * self.counts[1]];
        for (variable, group) in self.variables.iter().enumerate() {
            for (component, coefficient) in &self.groups[*group].components {
                rows[*component].push((variable, S::from(*coefficient)));
            }
        }
        for ((group, _), share) in self.compensators.iter().zip(&shares) {
            for (component, coefficient) in &self.groups[*group].components {
                let entries = share.iter().enumerate().filter(|(_, s)| s.re() != 0.0 || S::NDERIV > 0);
                rows[*component].extend(entries.map(|(variable, s)| (variable, *s * *coefficient)));
            }
        }
        let mut map = LinearMap::new(self.variables.len());
        for row in rows {
            for (column, weight) in row {
                map.push(column, weight);
            }
            map.end_row();
        }
        map
    }

    /// Movement of each compensator per unit of each variable: minus the inverse of the compensators' responses times
    /// the variables' responses.
    fn shares<S: Scalar>(&self, pins: &LinearMap<S>) -> Vec<Vec<S>> {
        let k = self.compensators.len();
        let n = self.variables.len();
        let mut rows: Vec<Vec<S>> = self
            .compensators
            .iter()
            .map(|(_, equation)| {
                let left = self.compensators.iter().map(|(g, _)| self.response(pins, *equation, *g));
                let right = self.variables.iter().map(|g| -self.response(pins, *equation, *g));
                left.chain(right).collect()
            })
            .collect();
        for column in 0..k {
            let pivot = (column..k).fold(column, |best, r| {
                if rows[r][column].re().abs() > rows[best][column].re().abs() { r } else { best }
            });
            rows.swap(column, pivot);
            let inverse = rows[column][column].recip();
            for entry in &mut rows[column] {
                *entry *= inverse;
            }
            let pivot_row = rows[column].clone();
            for (r, row) in rows.iter_mut().enumerate() {
                if r != column {
                    let factor = row[column];
                    for (entry, pivot) in row.iter_mut().zip(&pivot_row) {
                        *entry -= factor * *pivot;
                    }
                }
            }
        }
        rows.into_iter().map(|row| row[k..k + n].to_vec()).collect()
    }
}

/// Groups the components of the net by mirror and ties.
fn group(counts: [usize; 2], rules: &MotionRules) -> Result<Vec<Group>, DesignError> {
    let [n, m] = counts;
    // the group of each component, and its movement per unit of the group; None: cannot move
    let mut member: Vec<Option<(usize, f64)>> = (0..2 * n * m).map(|c| Some((c, 1.0))).collect();
    if rules.mirror {
        for j in 0..m / 2 {
            for i in 0..n {
                for (axis, sign) in [(0, 1.0), (1, -1.0)] {
                    member[2 * (i + n * j) + axis] = Some((2 * (i + n * (m - 1 - j)) + axis, sign));
                }
            }
        }
        if m % 2 == 1 {
            for i in 0..n {
                member[2 * (i + n * (m / 2)) + 1] = None;
            }
        }
    }
    for tie in &rules.ties {
        merge(counts, tie, &mut member)?;
    }
    // numbered by the component that leads, upper rows of a mirrored net first in their own place
    let mut groups: Vec<Group> = Vec::new();
    let mut number = vec![None; member.len()];
    for (component, entry) in member.iter().enumerate() {
        let Some((lead, coefficient)) = *entry else { continue };
        let index = *number[lead].get_or_insert_with(|| {
            groups.push(Group { components: Vec::new(), free: false });
            groups.len() - 1
        });
        // the leading component stands first: it names the group
        if component == lead {
            groups[index].components.insert(0, (component, coefficient));
        } else {
            groups[index].components.push((component, coefficient));
        }
    }
    Ok(groups)
}

fn merge(counts: [usize; 2], tie: &Tie, member: &mut [Option<(usize, f64)>]) -> Result<(), DesignError> {
    let mut lead: Option<(usize, f64)> = None;
    for (&[column, row], &coefficient) in tie.control_points.iter().zip(&tie.coefficients) {
        if column >= counts[0] || row >= counts[1] {
            return Err(DesignError::NoControlPoint { column: column as i64, row: row as i64, counts });
        }
        if !(coefficient.is_finite() && coefficient != 0.0) {
            return Err(DesignError::TieCoefficient { value: coefficient });
        }
        let component = 2 * (column + counts[0] * row) + tie.axis.index();
        let contradiction = DesignError::Tie { column, row };
        let Some((group, own)) = member[component] else { return Err(contradiction) };
        match lead {
            // movement of the whole tie per unit of the leading group
            None => lead = Some((group, own / coefficient)),
            Some((first, per_unit)) => {
                // this component must move by coefficient × per_unit
                let factor = coefficient * per_unit / own;
                if group == first {
                    if (factor - 1.0).abs() > 1e-12 {
                        return Err(contradiction);
                    }
                } else {
                    for entry in member.iter_mut().flatten().filter(|(g, _)| *g == group) {
                        *entry = (first, entry.1 * factor);
                    }
                }
            }
        }
    }
    Ok(())
}

impl Selection {
    fn mark(&self, counts: [usize; 2], marks: &mut [bool]) -> Result<(), DesignError> {
        let resolve = |list: &Option<Vec<i64>>, axis: usize| -> Result<Vec<usize>, DesignError> {
            let count = counts[axis] as i64;
            let Some(list) = list else { return Ok((0..counts[axis]).collect()) };
            list.iter()
                .map(|&i| {
                    let from_start = if i < 0 { i + count } else { i };
                    let (column, row) = if axis == 0 { (i, 0) } else { (0, i) };
                    if (0..count).contains(&from_start) {
                        Ok(from_start as usize)
                    } else {
                        Err(DesignError::NoControlPoint { column, row, counts })
                    }
                })
                .collect()
        };
        for &row in &resolve(&self.rows, 1)? {
            for &column in &resolve(&self.columns, 0)? {
                for axis in [Axis::X, Axis::Y] {
                    if self.axis.is_none_or(|a| a == axis) {
                        marks[2 * (column + counts[0] * row) + axis.index()] = true;
                    }
                }
            }
        }
        Ok(())
    }
}

#[cfg(test)]
#[path = "motion_tests.rs"]
mod tests;
