//! From the tables of a case file to a design problem.

use super::document::Document;
use super::error::{CaseError, nearest};
use super::flow::{OperatingPoints, flow_analysis, operating_points};
use super::pressures::set_pressure_target;
use super::quantities::Quantities;
use super::schema::{
    BoxTable, CaseTable, KulfanTable, MirrorName, PinEntry, PlacementName, Rules, SectionTable, TrailingEdgeName,
    VariablesTable,
};
use crate::design::{
    Axis, Bounds, BoxMotion, Deformation, DesignError, DesignProblem, Geometry, Instruments, MotionRules, Quantity,
    Selection, ShapeError, ShapeNorm, Tie, Variable, VariableKind,
};
use crate::ffd::{FfdBox, FfdError, FoldPenalty, LinearMap, Placement};
use crate::section::{Coordinates, Kulfan, Section, SectionDefinition, SectionError, TrailingEdge};
use std::path::Path;

/// Far beyond any use; a slip of the keyboard must not fill the memory.
const MOST_BOX_POINTS: usize = 10_000;

/// Builds the problem of a case, and says what was mended in its files; every error names the key it comes from.
pub(super) fn design_problem(
    document: &Document,
    table: &CaseTable,
    folder: &Path,
) -> Result<(DesignProblem, Vec<String>), CaseError> {
    let points = operating_points(document, table)?;
    let geometry = geometry(document, table, folder, &points)?;
    let mut repairs = repairs(geometry.definition(), &table.section);
    let target = match &table.target {
        Some(target) => {
            let definition = definition(document, target, "target", folder)?;
            repairs.extend(self::repairs(&definition, target));
            Some(definition.section().map_err(|e| document.error(&["target"], e.to_string()))?)
        }
        None => None,
    };
    let mut instruments = instruments(document, table, &geometry, target.as_ref(), &points)?;
    let pressure_section = match table.pressure_target.as_ref().and_then(|wanted| wanted.section.as_ref()) {
        Some(section) => {
            let definition = definition(document, section, "pressure_target", folder)?;
            repairs.extend(self::repairs(&definition, section));
            Some(definition.section().map_err(|e| document.error(&["pressure_target", "section"], e.to_string()))?)
        }
        None => None,
    };
    set_pressure_target(document, table, folder, geometry.section(), &mut instruments.flow, pressure_section)?;
    let quantities = Quantities { document, geometry: &geometry, instruments: &instruments };
    let mut objective = objective(document, table, &quantities)?;
    let soft = quantities.soft_limits(&table.constraints.0)?;
    let mut report: Vec<Quantity> = soft.iter().filter_map(|(term, _)| limited(term)).collect();
    objective.extend(soft);
    for name in &table.report.values {
        report.extend(quantities.each(name, &["report", "values"])?);
    }
    let constraints = quantities.constraints(&table.constraints.0)?;
    let problem = DesignProblem::new(geometry, target, instruments, &objective, &constraints, &report)
        .map_err(|e| document.error(&["variables"], e.to_string()))?;
    check_start(document, table, &problem)?;
    Ok((problem, repairs))
}

/// The quantity that a soft limit limits.
fn limited(term: &Quantity) -> Option<Quantity> {
    match term {
        Quantity::Soft { quantity, .. } => Some((**quantity).clone()),
        _ => None,
    }
}

/// Refuses a case whose start has no value, at the key that asks for it; whether it has a flow the run tells.
fn check_start(document: &Document, table: &CaseTable, problem: &DesignProblem) -> Result<(), CaseError> {
    let shapeless = |error: DesignError| {
        let key = if matches!(error, DesignError::Ffd(_)) { "box" } else { "section" };
        document.error(&[key], format!("at the start: {error}"))
    };
    let Some((q, error)) = problem.lacking_at_start().map_err(shapeless)? else { return Ok(()) };
    let quantity = &problem.quantities()[q];
    // a name may be written in more than one way
    let asks = |name: &str| name == quantity.name() || Quantity::parse(name).is_ok_and(|other| other == *quantity);
    let named = |entries: &[(String, f64)]| entries.iter().map(|(name, _)| name.clone()).find(|name| asks(name));
    let minimized = named(&table.objective.minimize.0);
    let maximized = named(&table.objective.maximize.0);
    let constraint = table.constraints.0.iter().map(|(name, _)| name).find(|name| asks(name));
    let path = match (&minimized, &maximized, constraint) {
        (Some(name), ..) => vec!["objective", "minimize", name],
        (None, Some(name), _) => vec!["objective", "maximize", name],
        (None, None, Some(name)) => vec!["constraints", name],
        (None, None, None) => vec!["objective"],
    };
    Err(document.error(&path, format!("{} at the start: {error}", quantity.name())))
}

/// A sentence for everything a user must know of the reading of a coordinate file, beginning with its name.
fn repairs(definition: &SectionDefinition, table: &SectionTable) -> Vec<String> {
    let name = table.file.as_deref().unwrap_or(definition.name());
    definition.repairs().iter().map(|repair| format!("{name}: {repair}")).collect()
}

fn definition(
    document: &Document,
    table: &SectionTable,
    key: &str,
    folder: &Path,
) -> Result<SectionDefinition, CaseError> {
    let wrong = |kind: &str, e: SectionError| document.error(&[key, kind], e.to_string());
    let edge = table.trailing_edge.map(|name| match name {
        TrailingEdgeName::Sharp => TrailingEdge::Sharp,
        TrailingEdgeName::Blunt => TrailingEdge::Blunt,
    });
    let mut definition = match (&table.naca, &table.kulfan, &table.file) {
        (Some(digits), None, None) => {
            SectionDefinition::naca(digits, edge.unwrap_or(TrailingEdge::Blunt)).map_err(|e| wrong("naca", e))?
        }
        (None, Some(table), None) => SectionDefinition::Kulfan(kulfan(table).map_err(|e| wrong("kulfan", e))?),
        (None, None, Some(file)) => Coordinates::read_element(folder.join(file), table.element)
            .map(SectionDefinition::Coordinates)
            .map_err(|e| wrong(if table.element.is_some() { "element" } else { "file" }, e))?,
        _ => return Err(document.error(&[key], "give exactly one of `naca`, `kulfan` and `file`")),
    };
    if table.element.is_some() && table.file.is_none() {
        return Err(wrong("element", SectionError::NotCoordinates { option: "element" }));
    }
    if edge.is_some_and(|edge| edge != definition.trailing_edge()) {
        let message = "contradicts the section: its coordinates (or the gap of its Kulfan definition) say otherwise";
        return Err(document.error(&[key, "trailing_edge"], message));
    }
    if table.fit_tolerance.is_some() && table.control_points.is_some() && table.file.is_some() {
        return Err(document.error(&[key, "fit_tolerance"], "give either `fit_tolerance` or `control_points`"));
    }
    if let Some(tolerance) = table.fit_tolerance {
        definition = definition.with_fit_tolerance(tolerance).map_err(|e| wrong("fit_tolerance", e))?;
    }
    if let Some(control_points) = table.control_points {
        definition = definition.with_control_points(control_points).map_err(|e| wrong("control_points", e))?;
    }
    if table.normalize == Some(true) {
        definition = definition.normalized().map_err(|e| wrong("normalize", e))?;
    }
    Ok(definition)
}

fn kulfan(table: &KulfanTable) -> Result<Kulfan, SectionError> {
    let mut kulfan = Kulfan::new(table.upper.clone(), table.lower.clone())?;
    if let Some(gap) = table.gap {
        kulfan = kulfan.with_gap(gap)?;
    }
    if let Some(class) = table.class {
        kulfan = kulfan.with_class(class)?;
    }
    Ok(kulfan)
}

fn lattice(document: &Document, table: &BoxTable) -> Result<FfdBox<f64>, CaseError> {
    let (counts, degrees) = (table.control_points, table.degree);
    if counts[0].saturating_mul(counts[1]) > MOST_BOX_POINTS {
        let message = format!("{} × {} control points; at most {MOST_BOX_POINTS} in all", counts[0], counts[1]);
        return Err(document.error(&["box", "control_points"], message));
    }
    let placement = match table.placement {
        Some(PlacementName::Greville) => Placement::Greville,
        Some(PlacementName::Even) | None => Placement::Even,
    };
    let (shape, result) = match (&table.x, &table.y, &table.corners, &table.points) {
        (Some(x), Some(y), None, None) => ("x", FfdBox::rectangular([*x, *y], counts, degrees, placement)),
        (None, None, Some(corners), None) => ("corners", FfdBox::from_corners(corners, counts, degrees, placement)),
        (None, None, None, Some(points)) => ("points", FfdBox::from_control_points(points.clone(), counts, degrees)),
        _ => return Err(document.error(&["box"], "give either `x` and `y`, or `corners`, or `points`")),
    };
    result.map_err(|error| {
        let key = match &error {
            FfdError::Range { axis: 0, .. } => "x",
            FfdError::Range { .. } => "y",
            FfdError::Direction { .. } | FfdError::Degree { .. } => "degree",
            _ => shape,
        };
        document.error(&["box", key], error.to_string())
    })
}

fn geometry(
    document: &Document,
    table: &CaseTable,
    folder: &Path,
    points: &OperatingPoints,
) -> Result<Geometry, CaseError> {
    let definition = definition(document, &table.section, "section", folder)?;
    let parameters: Vec<f64> = definition.parameters().into_iter().map(|(_, value)| value).collect();
    let deformation = match (&table.lattice, &table.direct) {
        (Some(_), Some(_)) => return Err(document.error(&["direct"], "give either [box] or [direct]")),
        (Some(lattice_table), None) => Deformation::Box(lattice(document, lattice_table)?),
        (None, Some(_)) => Deformation::Direct,
        (None, None) => Deformation::None,
    };
    let rules = &table.variables;
    check_rules(document, rules)?;
    let pins = |section: &Section<f64>| Ok(pin_parameters(&rules.pin, section));
    let for_motion = deformation.clone();
    let motion = |section: &Section<f64>, rows: &LinearMap| match &for_motion {
        Deformation::None => BoxMotion::new([0, 0], &MotionRules::default(), rows),
        Deformation::Box(lattice) => {
            let motion_rules = motion_rules(rules);
            if motion_rules.mirror {
                check_symmetry(lattice)?;
            }
            BoxMotion::new(lattice.counts(), &motion_rules, rows)
        }
        Deformation::Direct => {
            let count = section.curve().control_points().len();
            let mut motion_rules = motion_rules(rules);
            if section.trailing_edge() == TrailingEdge::Sharp {
                // both ends of the curve are one point
                motion_rules.ties.extend([Axis::X, Axis::Y].map(|axis| Tie {
                    control_points: vec![[0, 0], [count - 1, 0]],
                    axis,
                    coefficients: vec![1.0, 1.0],
                }));
            }
            BoxMotion::new([count, 1], &motion_rules, rows)
        }
    };
    let mut geometry = Geometry::new(definition, parameters, deformation, pins, motion).map_err(|error| {
        let key: &[&str] = match &error {
            DesignError::Ffd(_) => &["box"],
            DesignError::Section(_) => &["section"],
            _ => &["variables"],
        };
        document.error(key, error.to_string())
    })?;
    let variables = variables(document, rules, &geometry, &points.angles)?;
    geometry.set_variables(variables);
    Ok(geometry)
}

fn check_rules(document: &Document, rules: &VariablesTable) -> Result<(), CaseError> {
    for pin in &rules.pin {
        if let PinEntry::Parameter(u) = pin
            && !(0.0..=1.0).contains(u)
        {
            return Err(document.error(&["variables", "pin"], format!("parameter {u} is not between 0 and 1")));
        }
    }
    for tie in &rules.tied {
        let (points, coefficients) = (tie.control_points.len(), tie.coefficients.as_ref().map(Vec::len));
        if points < 2 || coefficients.is_some_and(|n| n != points) {
            let message = "a tie needs two control points or more, and as many coefficients (or none)";
            return Err(document.error(&["variables", "tied"], message));
        }
    }
    Ok(())
}

fn pin_parameters(pins: &[PinEntry], section: &Section<f64>) -> Vec<f64> {
    let (first, last) = section.curve().domain();
    let mut parameters = Vec::new();
    for pin in pins {
        match pin {
            PinEntry::Nose => parameters.push(section.nose_parameter()),
            PinEntry::Tail if section.trailing_edge() == TrailingEdge::Sharp => parameters.push(first),
            PinEntry::Tail => parameters.extend([first, last]),
            PinEntry::Parameter(u) => parameters.push(*u),
        }
    }
    parameters
}

fn motion_rules(table: &VariablesTable) -> MotionRules {
    let list = |rules: &Option<Rules>, axis: Option<Axis>| -> Vec<Selection> {
        let selections = match rules {
            None | Some(Rules::None) => Vec::new(),
            Some(Rules::All) => vec![Selection::default()],
            Some(Rules::List(list)) => list.iter().cloned().map(Selection::from).collect(),
        };
        let along = |selection: Selection| Selection { axis: axis.or(selection.axis), ..selection };
        selections.into_iter().map(along).collect()
    };
    let mut fixed = list(&table.fixed, None);
    fixed.extend(list(&table.x_fixed, Some(Axis::X)));
    fixed.extend(list(&table.y_fixed, Some(Axis::Y)));
    let ties = table.tied.iter().map(|tie| Tie {
        control_points: tie.control_points.clone(),
        axis: tie.axis.into(),
        coefficients: tie.coefficients.clone().unwrap_or_else(|| vec![1.0; tie.control_points.len()]),
    });
    MotionRules {
        free: list(&table.free, None),
        fixed,
        mirror: table.mirror == Some(MirrorName::ChordLine),
        ties: ties.collect(),
    }
}

/// A mirrored net must be its own mirror image.
fn check_symmetry(lattice: &FfdBox<f64>) -> Result<(), DesignError> {
    let [n, m] = lattice.counts();
    let points = lattice.control_points();
    for row in 0..m {
        for column in 0..n {
            let (a, b) = (points[column + n * row], points[column + n * (m - 1 - row)]);
            if (a[0] - b[0]).abs() > 1e-12 || (a[1] + b[1]).abs() > 1e-12 {
                return Err(DesignError::NotSymmetric { column, row });
            }
        }
    }
    Ok(())
}

fn variables(
    document: &Document,
    table: &VariablesTable,
    geometry: &Geometry,
    angles: &[Variable],
) -> Result<Vec<Variable>, CaseError> {
    let available = geometry.definition().parameters();
    let mut list = Vec::new();
    for (name, settings) in &table.parameters.0 {
        let Some(index) = available.iter().position(|(n, _)| n == name) else {
            let available = available.iter().map(|(n, _)| n.clone()).collect();
            let error = DesignError::NoParameter { name: name.clone(), available };
            return Err(document.error(&["variables", "parameters"], error.to_string()));
        };
        let start = geometry.parameters()[index];
        let step = start.abs().max(0.01);
        list.push(Variable {
            name: name.clone(),
            start,
            scale: settings.scale.unwrap_or(step),
            bounds: Bounds {
                lower: settings.lower.unwrap_or(f64::NEG_INFINITY),
                upper: settings.upper.unwrap_or(f64::INFINITY),
            },
            step,
            kind: VariableKind::Parameter(index),
        });
    }
    let steps = natural_steps(geometry);
    for (index, (name, axis)) in geometry.motion_variables().into_iter().enumerate() {
        let step = steps[axis.index()];
        let kind = VariableKind::Motion(index);
        list.push(Variable { name, start: 0.0, scale: step, bounds: Bounds::FREE, step, kind });
    }
    list.extend_from_slice(angles);
    apply_settings(document, table, geometry, &mut list)?;
    for variable in &list {
        let Variable { name, start, scale, bounds, .. } = variable;
        // written so that NaN fails
        if !(bounds.lower <= *start && *start <= bounds.upper) {
            let (name, start) = (name.clone(), *start);
            let error = DesignError::Bounds { name, lower: bounds.lower, start, upper: bounds.upper };
            return Err(document.error(&["variables", "bounds"], error.to_string()));
        }
        if !(scale.is_finite() && *scale > 0.0) {
            let error = DesignError::Scale { name: name.clone(), scale: *scale };
            return Err(document.error(&["variables", "scale"], error.to_string()));
        }
    }
    Ok(list)
}

/// The mean distance between neighbouring control points along each axis.
fn natural_steps(geometry: &Geometry) -> [f64; 2] {
    let net = geometry.initial_net();
    let counts = geometry.lattice().map_or([net.len(), net.len()], FfdBox::counts);
    std::array::from_fn(|axis| {
        let low = net.iter().fold(f64::INFINITY, |m, p| m.min(p[axis]));
        let high = net.iter().fold(f64::NEG_INFINITY, |m, p| m.max(p[axis]));
        if high > low { (high - low) / (counts[axis].max(2) - 1) as f64 } else { 0.01 }
    })
}

/// Entries by name: those of whole axes before those of single variables, which hold beside them.
fn axes_first<T>(entries: &[(String, T)]) -> impl Iterator<Item = (&String, &T)> {
    let of_axis = |name: &str| matches!(name, "x" | "y");
    let (axes, single): (Vec<_>, Vec<_>) =
        entries.iter().map(|(name, value)| (name, value)).partition(|e| of_axis(e.0));
    axes.into_iter().chain(single)
}

/// Bounds, scales and starts: for an axis of the box ("x", "y") or a variable by name.
fn apply_settings(
    document: &Document,
    table: &VariablesTable,
    geometry: &Geometry,
    list: &mut [Variable],
) -> Result<(), CaseError> {
    let axes = geometry.motion().axes();
    let selected = |name: &str, key: &str, list: &[Variable]| -> Result<Vec<usize>, CaseError> {
        let axis = match name {
            "x" => Some(Axis::X),
            "y" => Some(Axis::Y),
            _ => None,
        };
        let of_axis = |v: &Variable| match v.kind {
            VariableKind::Motion(index) => axis == Some(axes[index]),
            VariableKind::Parameter(_) | VariableKind::Angle => false,
        };
        let found: Vec<usize> = (0..list.len()).filter(|&i| list[i].name == name || of_axis(&list[i])).collect();
        if found.is_empty() && axis.is_none() {
            let suggestion = nearest(name, list.iter().map(|v| v.name.as_str()));
            let error = DesignError::NoVariable { name: name.into(), suggestion };
            return Err(document.error(&["variables", key, name], error.to_string()));
        }
        Ok(found)
    };
    for (name, [lower, upper]) in axes_first(&table.bounds.0) {
        for index in selected(name, "bounds", list)? {
            list[index].bounds = Bounds { lower: *lower, upper: *upper };
        }
    }
    // a variable that is fixed by its bounds is fixed there
    for variable in list.iter_mut().filter(|v| v.bounds.lower == v.bounds.upper) {
        variable.start = variable.bounds.lower;
    }
    for (name, scale) in axes_first(&table.scale.0) {
        for index in selected(name, "scale", list)? {
            list[index].scale = *scale;
        }
    }
    for (name, start) in axes_first(&table.start.0) {
        for index in selected(name, "start", list)? {
            list[index].start = *start;
        }
    }
    Ok(())
}

fn instruments(
    document: &Document,
    table: &CaseTable,
    geometry: &Geometry,
    target: Option<&Section<f64>>,
    points: &OperatingPoints,
) -> Result<Instruments, CaseError> {
    let norm = match &table.shape_error.norm {
        // parameters of measured points mean nothing
        None if table.target.as_ref().is_some_and(|target| target.file.is_some()) => ShapeNorm::Closest,
        None => ShapeNorm::default(),
        Some(name) => ShapeNorm::NAMES.iter().find(|(n, _)| n == name).map(|(_, norm)| *norm).ok_or_else(|| {
            let known: Vec<&str> = ShapeNorm::NAMES.iter().map(|(n, _)| *n).collect();
            document.error(&["shape_error", "norm"], format!("unknown norm {name:?}; known: {}", known.join(", ")))
        })?,
    };
    let shape_error = match target {
        None => None,
        Some(target) => Some(
            ShapeError::new(norm, target.curve(), geometry.section().curve())
                .map_err(|e| document.error(&["target"], e.to_string()))?,
        ),
    };
    let defaults = FoldPenalty::default();
    let settings = FoldPenalty {
        sharpness: table.fold_penalty.alpha.unwrap_or(defaults.sharpness),
        epsilon: table.fold_penalty.epsilon.unwrap_or(defaults.epsilon),
        normalised: table.fold_penalty.normalised.unwrap_or(defaults.normalised),
    };
    let penalty = match geometry.lattice() {
        None => None,
        Some(lattice) => Some(settings.on(lattice).map_err(|error| {
            let key = if let FfdError::Setting { name, .. } = error { name } else { "alpha" };
            document.error(&["fold_penalty", key], error.to_string())
        })?),
    };
    let flow = flow_analysis(document, table, geometry.section(), &points.points)?;
    Ok(Instruments { shape_error, penalty, flow })
}

fn objective(
    document: &Document,
    table: &CaseTable,
    quantities: &Quantities<'_>,
) -> Result<Vec<(Quantity, f64)>, CaseError> {
    let mut terms = Vec::new();
    let minimize = table.objective.minimize.0.iter().map(|(name, weight)| ("minimize", 1.0, name, weight));
    let maximize = table.objective.maximize.0.iter().map(|(name, weight)| ("maximize", -1.0, name, weight));
    for (key, sign, name, weight) in minimize.chain(maximize) {
        let path = ["objective", key, name];
        if !weight.is_finite() {
            return Err(document.error(&path, format!("weight {weight} is not finite")));
        }
        let quantity = quantities.one(name, &path)?;
        if quantity == Quantity::ShapeError && table.target.is_none() {
            return Err(document.error(&path, DesignError::NoTarget.to_string()));
        }
        terms.push((quantity, sign * weight));
    }
    if terms.iter().all(|(_, weight)| *weight == 0.0) {
        let key = if table.objective.minimize.0.is_empty() { "maximize" } else { "minimize" };
        return Err(document.error(&["objective", key], "nothing to minimise: name a quantity and its weight"));
    }
    Ok(terms)
}
