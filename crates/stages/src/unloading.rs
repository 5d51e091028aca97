//! Unloading of a material that has yielded, and loading up to the former maximum again.
//!
//! Where the pressure reached the hardness under the largest load so far, the surface keeps the
//! plastic depth d = −g, with the gap g of the elastic solution under this load. Under smaller
//! loads the surface h − d is pressed, and no node yields again. The contact under a load therefore
//! depends on the largest load before it, and on nothing else of the path. Loading again up to this
//! maximum returns along the curve of unloading.
//!
//! A path is thus solved as one block of loads that were never exceeded before, and one block for
//! each maximum from which it turns back. The rows of all blocks are solved, stored and extended as
//! the rows of any other loads.

use serde::Serialize;

use crate::StageError;
use crate::columns::*;
use crate::reduced_units::PressureUnit;
use asperity_manifest::decimal;
use asperity_mechanics::solver::{Hardness, Settings, Solver, Stop, Watch};
use asperity_tables::column::{Column, Value};

/// The part of a path to which a load belongs.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Branch {
    /// No load before it was larger.
    Loading,
    /// The largest load before it, in the unit of the manifest.
    Unloading(f64),
}

impl Branch {
    /// Returns the word in tables.
    pub fn name(self) -> &'static str {
        match self {
            Branch::Loading => "loading",
            Branch::Unloading(_) => "unloading",
        }
    }

    /// Returns the parameter columns of the branch with their values.
    pub fn setting(self, unit: PressureUnit) -> Vec<(Column, Value)> {
        let branch = (LOADING_BRANCH, Value::Text(self.name().to_owned()));
        match self {
            Branch::Loading => vec![branch],
            Branch::Unloading(load) => vec![branch, (maximum_load(unit), Value::Real(load))],
        }
    }
}

/// Returns the column of the largest load before a load, in the unit of the loads.
fn maximum_load(unit: PressureUnit) -> Column {
    match unit {
        PressureUnit::Relative => MAXIMUM_LOAD,
        PressureUnit::Absolute => MAXIMUM_PRESSURE,
    }
}

/// Divides a path of loads into its branches, each with its loads in ascending order.
pub fn branches(path: &[f64]) -> Vec<(Branch, Vec<f64>)> {
    let mut blocks = vec![(Branch::Loading, Vec::new())];
    let mut largest = 0.0;
    for &load in path {
        let branch = if load >= largest { Branch::Loading } else { Branch::Unloading(largest) };
        largest = load.max(largest);
        match blocks.iter_mut().find(|(other, _)| *other == branch) {
            Some((_, loads)) => loads.push(load),
            None => blocks.push((branch, vec![load])),
        }
    }
    for (_, loads) in &mut blocks {
        loads.sort_by(f64::total_cmp);
        loads.dedup_by(|one, other| decimal::is_same(*one, *other));
    }
    blocks
}

/// Plastic depth of a surface under its largest load.
pub struct PlasticDepth {
    /// Depth d of each node.
    pub depths: Vec<f64>,
    /// True if the largest load converged.
    pub is_solved: bool,
}

impl PlasticDepth {
    /// Returns the mean depth.
    pub fn mean(&self) -> f64 {
        self.depths.iter().sum::<f64>() / self.depths.len() as f64
    }
}

/// Presses a surface under its largest load `load`, and returns the plastic depth that it keeps.
/// All numbers are in the units of the solver.
///
/// # Errors
/// Returns an error on interruption.
pub fn plastic_depth(
    solver: &mut Solver,
    hardness: Hardness,
    load: f64,
    settings: &Settings,
    watch: &dyn Watch,
) -> Result<PlasticDepth, StageError> {
    let outcome = solver.press(load, settings, watch);
    if outcome.stop == Stop::Interrupted {
        return Err(StageError::Interrupted);
    }
    let pressures = solver.pressure().to_vec();
    let gaps = solver.gap_under(&pressures);
    let depth = |(gap, pressure): (f64, f64)| {
        if pressure >= hardness.pressure() { (-gap).max(0.0) } else { 0.0 }
    };
    let depths = gaps.into_iter().zip(pressures).map(depth).collect();
    Ok(PlasticDepth { depths, is_solved: outcome.stop != Stop::PairLimit })
}

/// Returns the branch of each state of a path, given the direction in which the state is reached. A
/// direction that the path takes again after a turn has a number: `loading`, `unloading`,
/// `loading-2`.
pub fn numbered(directions: impl Iterator<Item = &'static str>) -> Vec<String> {
    let mut branches: Vec<&'static str> = Vec::new();
    let name = |direction: &'static str| {
        if branches.last() != Some(&direction) {
            branches.push(direction);
        }
        match branches.iter().filter(|branch| **branch == direction).count() {
            1 => direction.to_owned(),
            turn => format!("{direction}-{turn}"),
        }
    };
    directions.map(name).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_path_has_one_branch_for_each_maximum_from_which_it_turns_back() {
        let path = [0.02, 0.05, 0.15, 0.1, 0.02, 0.1, 0.15, 0.2, 0.05];
        let expected = [
            (Branch::Loading, vec![0.02, 0.05, 0.15, 0.2]),
            (Branch::Unloading(0.15), vec![0.02, 0.1]),
            (Branch::Unloading(0.2), vec![0.05]),
        ];
        assert_eq!(branches(&path), expected);
    }
}
