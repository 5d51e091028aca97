//! Nodes and sides along x and y, in recipes and in manifests.

use schemars::JsonSchema;
use serde::Deserialize;

use crate::CheckContext;
use crate::per_axis::PerAxis;
use crate::stage_points::{StagePoints, Work};
use crate::surface::method::WaveShape;
use crate::surface::planned::{PlannedSurfaces, single, surfaces};
use crate::surface::{Heights, Origin};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Span};
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::declare::{length, pair, required, swept, unit_of_lengths};
use asperity_manifest::keys::{Key, OnAxes, Section, table};
use asperity_mechanics::grid::Cell;
use asperity_mechanics::topography::shapes::Shape;

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
    let (message, pair) = match (counts, lengths) {
        (OnAxes::Each(_), OnAxes::Both(_)) => {
            let message = format!("`nodes = {counts}` is a pair, but `side` is one number");
            (message, &nodes.written()?.span)
        }
        (OnAxes::Both(_), OnAxes::Each(_)) => {
            let message = format!("`side = {lengths}` is a pair, but `nodes` is one number");
            (message, &side.written()?.span)
        }
        _ => return Some(mesh),
    };
    let problem = Problem::new(message, pair.clone(), "along x and y");
    checks.reject(
        problem.help("give both along both axes; cells are square in the ratio of the sides"),
    )
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

/// Paraboloid −r²/(2R), for comparison with Hertz contact.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ParaboloidTable {
    /// Number of nodes per side of the cell; for a rectangle a pair along x and y, such as
    /// `[1024, 512]`, together with a pair for `side`.
    #[schemars(range(min = MIN_NODES, max = MAX_NODES))]
    #[schemars(transform = pair, transform = swept, transform = required)]
    pub nodes: Key<OnAxes<u32>>,
    /// Side length of the periodic cell, as in `"100 um"`, or a number in any unit of length; for
    /// a rectangle a pair along x and y, such as `[2.0, 1.0]`, together with a pair for `nodes`.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0))]
    #[schemars(transform = pair, transform = swept, transform = length)]
    pub side: Key<OnAxes<f64>>,
    /// Radius of curvature R of the summit, in the unit of `side`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    #[schemars(transform = swept, transform = required, transform = length)]
    pub radius: Key<f64>,
    /// Name of the unit of length. It is a label for lengths that are plain numbers, and converts
    /// nothing. The default is the unit that is written at `side`.
    #[schemars(extend("default" = ""), transform = unit_of_lengths)]
    pub unit: Key<String>,
    /// Storage of the heights: `"keep"` stores them in the table, `"redraw"` draws them again when
    /// needed.
    #[schemars(extend("default" = "keep"), transform = Heights::not_none)]
    pub heights: Key<Heights>,
}

table!(ParaboloidTable);

/// Wave along one direction or two, for comparison with the solutions for wavy surfaces.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WaveTable {
    /// Number of nodes per side of the cell; for a rectangle a pair along x and y, such as
    /// `[1024, 512]`, together with a pair for `side`. The number of nodes must be more than twice
    /// `waves`.
    #[schemars(range(min = MIN_NODES, max = MAX_NODES))]
    #[schemars(transform = pair, transform = swept, transform = required)]
    pub nodes: Key<OnAxes<u32>>,
    /// Side length of the periodic cell, as in `"100 um"`, or a number in any unit of length; for
    /// a rectangle a pair along x and y, such as `[2.0, 1.0]`, together with a pair for `nodes`.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0))]
    #[schemars(transform = pair, transform = swept, transform = length)]
    pub side: Key<OnAxes<f64>>,
    /// Amplitude Δ in the formula of the method, in the unit of `side`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    #[schemars(transform = swept, transform = required, transform = length)]
    pub amplitude: Key<f64>,
    /// Number n of wavelengths along each side.
    #[schemars(range(min = 1, max = MAX_WAVES), extend("default" = 1), transform = swept)]
    pub waves: Key<u32>,
    /// Name of the unit of length. It is a label for lengths that are plain numbers, and converts
    /// nothing. The default is the unit that is written at `side`.
    #[schemars(extend("default" = ""), transform = unit_of_lengths)]
    pub unit: Key<String>,
    /// Storage of the heights: `"keep"` stores them in the table, `"redraw"` draws them again when
    /// needed.
    #[schemars(extend("default" = "keep"), transform = Heights::not_none)]
    pub heights: Key<Heights>,
}

table!(WaveTable);

/// Flat circular punch in the middle of the cell.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PunchTable {
    /// Number of nodes per side of the cell; for a rectangle a pair along x and y, such as
    /// `[1024, 512]`, together with a pair for `side`.
    #[schemars(range(min = MIN_NODES, max = MAX_NODES))]
    #[schemars(transform = pair, transform = swept, transform = required)]
    pub nodes: Key<OnAxes<u32>>,
    /// Side length of the periodic cell, as in `"100 um"`, or a number in any unit of length; for
    /// a rectangle a pair along x and y, such as `[2.0, 1.0]`, together with a pair for `nodes`.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0))]
    #[schemars(transform = pair, transform = swept, transform = length)]
    pub side: Key<OnAxes<f64>>,
    /// Radius of the disc, in the unit of `side`. It must be less than half of the shorter side.
    #[schemars(extend("exclusiveMinimum" = 0))]
    #[schemars(transform = swept, transform = required, transform = length)]
    pub radius: Key<f64>,
    /// Height of the disc above the surface around it, in the unit of `side`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    #[schemars(transform = swept, transform = required, transform = length)]
    pub depth: Key<f64>,
    /// Name of the unit of length. It is a label for lengths that are plain numbers, and converts
    /// nothing. The default is the unit that is written at `side`.
    #[schemars(extend("default" = ""), transform = unit_of_lengths)]
    pub unit: Key<String>,
    /// Storage of the heights: `"keep"` stores them in the table, `"redraw"` draws them again when
    /// needed.
    #[schemars(extend("default" = "keep"), transform = Heights::not_none)]
    pub heights: Key<Heights>,
}

table!(PunchTable);

impl StagePoints for Section<ParaboloidTable> {
    fn work(&self, context: &mut CheckContext) -> Option<Work> {
        surfaces(self, context.problems, |table, checks| {
            let mesh = mesh(&table.nodes, &table.side, checks);
            let unit = unit(&table.unit, &table.side, checks);
            let radius = checks.number("radius", &table.radius);
            let heights = checks.value("heights", &table.heights)?;
            let shape = Shape::Paraboloid { radius: radius? };
            Some(on_mesh(mesh?, shape, unit?, heights, self.may_be_swept))
        })
        .map(Work::Generate)
    }
}

impl StagePoints for (WaveShape, Section<WaveTable>) {
    fn work(&self, context: &mut CheckContext) -> Option<Work> {
        surfaces(&self.1, context.problems, |table, checks| {
            let mesh = mesh(&table.nodes, &table.side, checks);
            let unit = unit(&table.unit, &table.side, checks);
            let amplitude = checks.number("amplitude", &table.amplitude);
            let waves = checks.value("waves", &table.waves);
            let heights = checks.value("heights", &table.heights)?;
            let (mesh, amplitude, waves) = (mesh?, amplitude?, waves?);
            if let Some(written) = table.waves.written() {
                let along_y = if self.0 == WaveShape::Single { 0 } else { waves };
                let wave = Wave {
                    written: format!("waves = {waves}"),
                    span: &written.span,
                    waves: [waves, along_y],
                };
                check_waves(&wave, &table.nodes, &mesh, true, checks)?;
            }
            let shape = match self.0 {
                WaveShape::Single => Shape::Wave { amplitude, waves },
                WaveShape::Product => Shape::WaveProduct { amplitude, waves },
                WaveShape::Sum => Shape::WaveSum { amplitude, waves },
            };
            Some(on_mesh(mesh, shape, unit?, heights, self.1.may_be_swept))
        })
        .map(Work::Generate)
    }
}

impl StagePoints for Section<PunchTable> {
    fn work(&self, context: &mut CheckContext) -> Option<Work> {
        surfaces(self, context.problems, |table, checks| {
            let mesh = mesh(&table.nodes, &table.side, checks);
            let unit = unit(&table.unit, &table.side, checks);
            let radius = checks.number("radius", &table.radius);
            let depth = checks.number("depth", &table.depth);
            let heights = checks.value("heights", &table.heights)?;
            let (mesh, radius) = (mesh?, radius?);
            let PerAxis([side_x, side_y]) = mesh.side;
            let half = side_x.min(side_y) / 2.0;
            if radius >= half {
                let label = format!("must be below {half}, half of the side");
                let span = &table.radius.written()?.span;
                return checks.refuse("radius", format!("`radius` is {radius}"), span, label);
            }
            let shape = Shape::Punch { radius, depth: depth? };
            Some(on_mesh(mesh, shape, unit?, heights, self.may_be_swept))
        })
        .map(Work::Generate)
    }
}

fn on_mesh(
    mesh: Mesh,
    shape: Shape,
    unit: String,
    heights: Heights,
    may_be_swept: bool,
) -> PlannedSurfaces {
    let nodes = mesh.nodes;
    PlannedSurfaces {
        may_be_swept,
        ..single(heights, Some(mesh.side), Origin::Shape { nodes, shape, unit })
    }
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
