//! Nodes and sides along x and y: as recipes hold them, and checks of those that a manifest gives.

use std::ops::RangeInclusive;

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use asperity_contact::grid::Cell;
use asperity_manifest::diagnostics::{Problem, Span};
use asperity_manifest::written::checks::{Checks, QUANTITY};
use asperity_manifest::written::{Key, OnAxes, Written};

/// The fewest nodes per side of a mesh.
pub const FEWEST_NODES: u32 = 4;
/// The most nodes per side of a mesh.
pub const MOST_NODES: u32 = 16384;
/// Nodes per side of a mesh.
pub const NODES: RangeInclusive<u32> = FEWEST_NODES..=MOST_NODES;
/// The most waves along a side.
pub const MOST_WAVES: u32 = MOST_NODES / 2;
/// Cutoffs, in waves along the longer side.
pub const WAVENUMBERS: RangeInclusive<u32> = 1..=MOST_WAVES;

/// One number along x and one along y.
///
/// Written as one number where both are equal: the recipe of a square, and so its key, is what it was
/// before there were rectangles.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PerAxis<T>(pub [T; 2]);

impl<T: Copy> PerAxis<T> {
    /// The same number along both.
    pub fn same(value: T) -> Self {
        Self([value; 2])
    }
}

impl<T: Serialize + PartialEq> Serialize for PerAxis<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match &self.0 {
            [x, y] if x == y => x.serialize(serializer),
            both => both.serialize(serializer),
        }
    }
}

#[derive(Deserialize)]
#[serde(untagged)]
enum OneOrTwo<T> {
    One(T),
    Two([T; 2]),
}

impl<'de, T: Deserialize<'de> + Copy> Deserialize<'de> for PerAxis<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(match OneOrTwo::deserialize(deserializer)? {
            OneOrTwo::One(value) => Self::same(value),
            OneOrTwo::Two(both) => Self(both),
        })
    }
}

/// Nodes and sides along x and y, each within its bounds.
#[derive(Debug, Clone, Copy)]
pub struct Mesh {
    pub nodes: PerAxis<u32>,
    pub side: PerAxis<f64>,
}

impl Mesh {
    /// The cell that it fills.
    pub fn cell(&self) -> Cell {
        Cell::new(self.side.0).expect("sides were checked")
    }
}

/// A wave that a mesh is to show.
pub struct Wave<'a> {
    /// As it is written: `k_upper = 32`.
    pub written: String,
    pub span: &'a Span,
    /// The most waves along x and y.
    pub waves: [u32; 2],
}

/// Nodes and sides; of a pair beside a single number nobody can tell what cells it is to have.
pub fn mesh(
    nodes: &Key<OnAxes<i64>>,
    side: &Key<OnAxes<f64>>,
    checks: &mut Checks,
) -> Option<Mesh> {
    let nodes = checks.required("nodes", nodes);
    let counts = nodes.and_then(|nodes| nodes_within(nodes, checks));
    let sides = side.written();
    let lengths = match sides {
        Some(sides) => sides_within(sides, checks),
        None => Some([1.0; 2]),
    };
    let (nodes, counts, lengths) = (nodes?, counts?, lengths?);
    let problem = match (nodes.value, sides.map(|sides| sides.value)) {
        (OnAxes::Both(_), None | Some(OnAxes::Both(_)))
        | (OnAxes::Each(_), Some(OnAxes::Each(_))) => {
            return Some(Mesh { nodes: PerAxis(counts), side: PerAxis(lengths) });
        }
        (OnAxes::Each(_), _) => lacks_sides(nodes, sides, counts, lengths[0]),
        (OnAxes::Both(_), Some(_)) => lacks_nodes(nodes, sides?, counts[0], lengths),
    };
    checks.reject(problem)
}

fn nodes_within(written: &Written<OnAxes<i64>>, checks: &mut Checks) -> Option<[u32; 2]> {
    let [x, y] = written.on_either();
    let along_x = checks.is_whole_in("nodes", &x, &NODES)?;
    Some([along_x, checks.is_whole_in("nodes", &y, &NODES)?])
}

/// Sides of a cell, as they are written.
pub fn sides_within(written: &Written<OnAxes<f64>>, checks: &mut Checks) -> Option<[f64; 2]> {
    let [x, y] = written.on_either();
    let along_x = checks.is_in("side", &x, QUANTITY)?;
    Some([along_x, checks.is_in("side", &y, QUANTITY)?])
}

fn lacks_sides(
    nodes: &Written<OnAxes<i64>>,
    sides: Option<&Written<OnAxes<f64>>>,
    counts: [u32; 2],
    longer_side: f64,
) -> Problem {
    let message = format!("`nodes = {}` is a rectangle, and `side` is not", nodes.value);
    let problem = Problem::new(message, nodes.span.clone(), "along x and along y");
    let problem = match sides {
        Some(sides) => problem.and(sides.span.clone(), "one number"),
        None => problem,
    };
    let square = square_cells(counts, longer_side);
    problem.help(format!("give both sides; with `side = {square}` cells are square"))
}

/// The sides on which so many nodes have square cells.
pub fn square_cells(counts: [u32; 2], longer_side: f64) -> OnAxes<f64> {
    let most = f64::from(counts[0].max(counts[1]));
    OnAxes::Each(counts.map(|nodes| longer_side * (f64::from(nodes) / most)))
}

fn lacks_nodes(
    nodes: &Written<OnAxes<i64>>,
    sides: &Written<OnAxes<f64>>,
    most: u32,
    lengths: [f64; 2],
) -> Problem {
    let message = format!("`side = {}` is a rectangle, and `nodes` is not", sides.value);
    let problem = Problem::new(message, sides.span.clone(), "along x and along y")
        .and(nodes.span.clone(), "one number");
    let longer_side = lengths[0].max(lengths[1]);
    let square = lengths.map(|length| f64::from(most) * (length / longer_side));
    let are_whole = square.iter().all(|nodes| nodes.fract() == 0.0);
    problem.help(match are_whole {
        true => format!(
            "give the nodes along both; with `nodes = {}` cells are square",
            OnAxes::Each(square)
        ),
        false => "give the nodes along both: `nodes = [along x, along y]`".to_owned(),
    })
}

/// A mesh shows waves of two nodes or more. Where phases matter, one of two nodes is not enough:
/// its other half falls between them.
pub fn check_waves(
    wave: &Wave,
    key: &Key<OnAxes<i64>>,
    mesh: &Mesh,
    phases_matter: bool,
    checks: &mut Checks,
) -> Option<()> {
    let extra = u32::from(phases_matter);
    let needed = wave.waves.map(|waves| 2 * waves + extra);
    let PerAxis(nodes) = mesh.nodes;
    if needed[0] <= nodes[0] && needed[1] <= nodes[1] {
        return Some(());
    }
    let written = key.written()?;
    let carried = nodes.map(|nodes| (nodes - extra) / 2);
    let (message, label) = match written.value {
        OnAxes::Both(_) => (
            format!(
                "`{}` needs at least {} nodes per side, `nodes` is {}",
                wave.written, needed[0], nodes[0]
            ),
            format!("carries wavenumbers up to {}", carried[0]),
        ),
        OnAxes::Each(_) => (
            format!(
                "`{}` needs at least {} × {} nodes, `nodes` is {}",
                wave.written, needed[0], needed[1], written.value
            ),
            format!("carries up to {} waves along x and {} along y", carried[0], carried[1]),
        ),
    };
    let problem = Problem::new(message, wave.span.clone(), "too fine for the mesh");
    checks.reject(problem.and(written.span.clone(), label))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_numbers_are_written_as_one_and_different_ones_as_two() {
        for (numbers, text) in [([64, 64], "64"), ([64, 32], "[64,32]")] {
            let written = serde_json::to_string(&PerAxis(numbers)).unwrap();
            assert_eq!(written, text);
            assert_eq!(serde_json::from_str::<PerAxis<u32>>(text).unwrap().0, numbers);
        }
        assert_eq!(serde_json::to_string(&PerAxis([1.0, 1.0])).unwrap(), "1.0");
    }
}
