//! Nodes and sides along x and y, in recipes and in manifests.

use crate::per_axis::PerAxis;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Span};
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::{Key, OnAxes};
use asperity_mechanics::grid::Cell;

/// Minimum number of nodes per side of a cell.
pub const MIN_NODES: u32 = 4;
/// Maximum number of nodes per side of a cell.
pub const MAX_NODES: u32 = 16384;
/// Maximum number of waves along a side, with two nodes per wave. It also bounds cutoff
/// wavenumbers.
pub const MAX_WAVES: u32 = MAX_NODES / 2;

/// Nodes and sides of a cell along x and y.
#[derive(Debug, Clone, Copy)]
pub struct Mesh {
    pub nodes: PerAxis<u32>,
    pub side: PerAxis<f64>,
}

impl Mesh {
    /// Returns the rectangle with the sides of the mesh.
    pub fn cell(&self) -> Cell {
        Cell::new(self.side.0).expect("sides were checked")
    }
}

/// Highest wavenumbers that the mesh must resolve, with the manifest key that sets them.
/// [`check_waves`] checks them.
pub struct Wave<'a> {
    /// The key and its value as in the manifest: `k_upper = 32`.
    pub written: String,
    pub span: &'a Span,
    /// Highest wavenumbers along x and y, in waves per side.
    pub waves: [u32; 2],
}

/// Returns the nodes and sides of the cell. Refuses a pair for one key and a single number for the
/// other, because the shape of the cells is then unknown.
pub fn mesh(
    nodes: &Key<OnAxes<u32>>,
    side: &Key<OnAxes<f64>>,
    checks: &mut Checks,
) -> Option<Mesh> {
    let (counts, lengths) = (checks.value("nodes", nodes), checks.value("side", side));
    let (counts, lengths) = (counts?, lengths?);
    let mesh =
        Mesh { nodes: PerAxis(counts.pair()), side: PerAxis(lengths.pair().map(decimal::nearest)) };
    let nodes_span = &nodes.written()?.span;
    let side_span = side.written().map(|side| &side.span);
    match (counts, lengths) {
        (OnAxes::Both(_), OnAxes::Both(_)) | (OnAxes::Each(_), OnAxes::Each(_)) => Some(mesh),
        (OnAxes::Each(_), OnAxes::Both(length)) => {
            checks.reject(single_side(counts, nodes_span, decimal::nearest(length), side_span))
        }
        (OnAxes::Both(count), OnAxes::Each(_)) => {
            checks.reject(single_nodes(count, nodes_span, mesh.side.0, side_span?))
        }
    }
}

/// Returns the name of the unit of length of a surface; empty if the manifest names none. A known
/// unit is named by its symbol. Refuses a unit without `side`, whose default has no unit.
pub fn unit(unit: &Key<String>, side: &Key<OnAxes<f64>>, checks: &mut Checks) -> Option<String> {
    let named = checks.units.length.as_ref();
    let label = match (named, unit.written()) {
        (Some(named), _) => named.unit.symbol.to_owned(),
        (None, Some(unit)) => unit.value.clone(),
        (None, None) => return Some(String::new()),
    };
    if side.written().is_none() && !checks.is_reported("side") {
        let span = named.map(|named| &named.span).or(unit.written().map(|unit| &unit.span))?;
        let message = "lengths have a unit, but `side` is not given";
        let problem = Problem::new(message, span.clone(), "has a unit");
        return checks.reject(problem.help(format!("write `side = \"100 {label}\"`, for example")));
    }
    Some(label)
}

/// Returns the problem of a pair of nodes that is combined with a single side.
fn single_side(
    nodes: OnAxes<u32>,
    nodes_span: &Span,
    longer_side: f64,
    side_span: Option<&Span>,
) -> Problem {
    let message = format!("`nodes = {nodes}` is a pair, but `side` is one number");
    let problem = Problem::new(message, nodes_span.clone(), "numbers of nodes along x and y");
    let problem = match side_span {
        Some(span) => problem.and(span.clone(), "a square cell"),
        None => problem,
    };
    let square = square_cells(nodes.pair(), longer_side);
    problem.help(format!("give both sides; `side = {square}` makes cells square"))
}

/// Returns the sides along x and y with which these nodes have square cells.
pub fn square_cells(counts: [u32; 2], longer_side: f64) -> OnAxes<f64> {
    let most = f64::from(counts[0].max(counts[1]));
    OnAxes::Each(counts.map(|nodes| longer_side * (f64::from(nodes) / most)))
}

/// Returns the problem of a pair of sides that is combined with a single number of nodes.
fn single_nodes(most: u32, nodes_span: &Span, lengths: [f64; 2], side_span: &Span) -> Problem {
    let side = OnAxes::Each(lengths);
    let message = format!("`side = {side}` is a pair, but `nodes` is one number");
    let problem = Problem::new(message, side_span.clone(), "sides along x and y")
        .and(nodes_span.clone(), "a square mesh");
    let longer_side = lengths[0].max(lengths[1]);
    let square = lengths.map(|length| f64::from(most) * (length / longer_side));
    let are_whole = square.iter().all(|nodes| nodes.fract() == 0.0);
    problem.help(if are_whole {
        let square = OnAxes::Each(square);
        format!("give the nodes along both axes; `nodes = {square}` makes cells square")
    } else {
        "give the nodes along both axes: `nodes = [along x, along y]`".to_owned()
    })
}

/// Refuses wavenumbers with fewer than two nodes per wave, which the mesh does not resolve. If
/// `phases_matter`, also refuses exactly two nodes per wave, because the extrema may then fall
/// between the nodes.
pub fn check_waves(
    wave: &Wave,
    key: &Key<OnAxes<u32>>,
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
                "`{}` needs at least {} nodes per side, but `nodes` is {}",
                wave.written, needed[0], nodes[0]
            ),
            format!("resolves wavenumbers up to {}", carried[0]),
        ),
        OnAxes::Each(_) => (
            format!(
                "`{}` needs at least {} × {} nodes, but `nodes` is {}",
                wave.written, needed[0], needed[1], written.value
            ),
            format!("resolves up to {} waves along x and {} along y", carried[0], carried[1]),
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
