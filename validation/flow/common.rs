//! Nodes as the command makes them, and work shared out over the cores.

use crate::Failure;
use aeroform::flow::{PanelledSection, Solution, panel_parameters};
use aeroform::section::{Section, SectionDefinition};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Panels of the command, unless told.
pub const PANELS: usize = 160;

/// The section that `text` names (a definition or a coordinate file), on unit chord.
pub fn section(text: &str) -> Result<Section, Failure> {
    let mut definition = SectionDefinition::parse(text)?;
    if let SectionDefinition::Coordinates(coordinates) = &definition {
        definition = SectionDefinition::Coordinates(coordinates.normalized()?);
    }
    Ok(definition.section()?)
}

/// Nodes on a section where the command puts them.
pub fn nodes(section: &Section, panels: usize) -> Vec<[f64; 2]> {
    panel_parameters(section, panels + 1).iter().map(|&u| section.curve().point_at(u)).collect()
}

/// The panels that `aeroform analyze` would use.
pub fn panelled(text: &str, panels: usize) -> Result<PanelledSection, Failure> {
    let section = section(text)?;
    Ok(PanelledSection::new(&nodes(&section, panels), section.trailing_edge())?)
}

/// Number of cores.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// `work` on every item, on `jobs` threads; results in the order of the items. A panic in one is a panic here.
pub fn in_parallel<T: Sync, R: Send>(jobs: usize, items: &[T], work: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let results = Mutex::new(Vec::with_capacity(items.len()));
    std::thread::scope(|scope| {
        for _ in 0..jobs.clamp(1, items.len().max(1)) {
            scope.spawn(|| {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(index) else { return };
                    let result = work(item);
                    // only a panic poisons, and that ends the scope anyway
                    results.lock().unwrap_or_else(|e| e.into_inner()).push((index, result));
                }
            });
        }
    });
    let mut results = results.into_inner().unwrap_or_else(|e| e.into_inner());
    results.sort_by_key(|(index, _)| *index);
    results.into_iter().map(|(_, result)| result).collect()
}

/// Whether the laminar layer separates before transition, upper and lower side.
pub fn bubbles(solution: &Solution) -> [bool; 2] {
    let distributions = solution.distributions();
    [&distributions.upper, &distributions.lower].map(|side| {
        // turbulent stations have a shear stress
        side.iter().any(|station| station.shear_stress == 0.0 && station.skin_friction < 0.0)
    })
}
