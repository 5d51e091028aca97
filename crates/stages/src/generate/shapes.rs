//! Shapes with a closed-form solution: their keys and the checks of these.
//!
//! The comments of the keys are what editors show and what messages quote.

use std::ops::Bound;

use schemars::JsonSchema;
use serde::Deserialize;

use super::growth::PlannedSurfaces;
use super::mesh::{
    self, FEWEST_NODES, MOST_NODES, MOST_WAVES, Mesh, WAVENUMBERS, Wave, check_waves,
};
use super::method::{KeptHeights, single, surfaces};
use super::{Origin, PerAxis};
use asperity_contact::topography::shapes::Shape;
use asperity_manifest::diagnostics::Problems;
use asperity_manifest::written::checks::QUANTITY;
use asperity_manifest::written::on_axes::{OnAxes, or_a_pair};
use asperity_manifest::written::{Key, Section, table};

/// A paraboloid, for the contact of Hertz.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ParaboloidTable {
    /// Nodes per side of the mesh; of a rectangle those along x and along y, `[1024, 512]`, beside
    /// a pair for `side`.
    #[schemars(required, range(min = FEWEST_NODES, max = MOST_NODES), transform = or_a_pair)]
    pub nodes: Key<OnAxes<i64>>,
    /// Side of the periodic cell, in any unit of length; of a rectangle those along x and along y.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0), transform = or_a_pair)]
    pub side: Key<OnAxes<f64>>,
    /// Radius of curvature of the summit, in the unit of `side`.
    #[schemars(required, extend("exclusiveMinimum" = 0))]
    pub radius: Key<f64>,
    /// Whether heights are stored or drawn again when needed.
    #[schemars(extend("default" = "keep"))]
    pub heights: Key<KeptHeights>,
}

table!(
    ParaboloidTable,
    swept: ["nodes", "side", "radius"],
    lists: [],
    pairs: ["nodes", "side"]
);

/// A wave along one direction or two.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct WaveTable {
    /// Nodes per side of the mesh, more than twice `waves`; of a rectangle those along x and along
    /// y, `[1024, 512]`, beside a pair for `side`.
    #[schemars(required, range(min = FEWEST_NODES, max = MOST_NODES), transform = or_a_pair)]
    pub nodes: Key<OnAxes<i64>>,
    /// Side of the periodic cell, in any unit of length; of a rectangle those along x and along y.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0), transform = or_a_pair)]
    pub side: Key<OnAxes<f64>>,
    /// Amplitude of the wave, or of each wave, in the unit of `side`.
    #[schemars(required, extend("exclusiveMinimum" = 0))]
    pub amplitude: Key<f64>,
    /// Wavelengths per side, along either axis.
    #[schemars(range(min = 1, max = MOST_WAVES), extend("default" = 1))]
    pub waves: Key<i64>,
    /// Whether heights are stored or drawn again when needed.
    #[schemars(extend("default" = "keep"))]
    pub heights: Key<KeptHeights>,
}

table!(
    WaveTable,
    swept: ["nodes", "side", "amplitude", "waves"],
    lists: [],
    pairs: ["nodes", "side"]
);

/// A flat disc in the middle of the cell.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PunchTable {
    /// Nodes per side of the mesh; of a rectangle those along x and along y, `[1024, 512]`, beside
    /// a pair for `side`.
    #[schemars(required, range(min = FEWEST_NODES, max = MOST_NODES), transform = or_a_pair)]
    pub nodes: Key<OnAxes<i64>>,
    /// Side of the periodic cell, in any unit of length; of a rectangle those along x and along y.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0), transform = or_a_pair)]
    pub side: Key<OnAxes<f64>>,
    /// Radius of the disc, less than half of `side`, of a rectangle the shorter one.
    #[schemars(required, extend("exclusiveMinimum" = 0))]
    pub radius: Key<f64>,
    /// How far the surface lies below the disc outside it, in the unit of `side`.
    #[schemars(required, extend("exclusiveMinimum" = 0))]
    pub depth: Key<f64>,
    /// Whether heights are stored or drawn again when needed.
    #[schemars(extend("default" = "keep"))]
    pub heights: Key<KeptHeights>,
}

table!(
    PunchTable,
    swept: ["nodes", "side", "radius", "depth"],
    lists: [],
    pairs: ["nodes", "side"]
);

pub fn paraboloid(
    section: &Section<ParaboloidTable>,
    problems: &mut Problems,
) -> Option<Vec<PlannedSurfaces>> {
    surfaces(section, problems, |table, checks| {
        let mesh = mesh::mesh(&table.nodes, &table.side, checks);
        let radius = checks.number("radius", &table.radius, QUANTITY);
        let shape = Shape::Paraboloid { radius: radius? };
        Some(on_mesh(mesh?, shape, &table.heights, section.may_be_swept))
    })
}

/// How waves along two directions go together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WaveShape {
    /// There is but one.
    Single,
    /// Their product.
    Product,
    /// Their sum.
    Sum,
}

pub fn wave(
    shape: WaveShape,
    section: &Section<WaveTable>,
    problems: &mut Problems,
) -> Option<Vec<PlannedSurfaces>> {
    surfaces(section, problems, |table, checks| {
        let mesh = mesh::mesh(&table.nodes, &table.side, checks);
        let amplitude = checks.number("amplitude", &table.amplitude, QUANTITY);
        let waves = checks.whole_or("waves", &table.waves, WAVENUMBERS, 1);
        let (mesh, amplitude, waves) = (mesh?, amplitude?, waves?);
        if let Some(written) = table.waves.written() {
            let along_y = if shape == WaveShape::Single { 0 } else { waves };
            let wave = Wave {
                written: format!("waves = {waves}"),
                span: &written.span,
                waves: [waves, along_y],
            };
            check_waves(&wave, &table.nodes, &mesh, true, checks)?;
        }
        let shape = match shape {
            WaveShape::Single => Shape::Wave { amplitude, waves },
            WaveShape::Product => Shape::WaveProduct { amplitude, waves },
            WaveShape::Sum => Shape::WaveSum { amplitude, waves },
        };
        Some(on_mesh(mesh, shape, &table.heights, section.may_be_swept))
    })
}

pub fn punch(
    section: &Section<PunchTable>,
    problems: &mut Problems,
) -> Option<Vec<PlannedSurfaces>> {
    surfaces(section, problems, |table, checks| {
        let mesh = mesh::mesh(&table.nodes, &table.side, checks);
        let half = mesh.map_or(Bound::Unbounded, |mesh| {
            let PerAxis([side_x, side_y]) = mesh.side;
            Bound::Excluded(side_x.min(side_y) / 2.0)
        });
        let radius = checks.number("radius", &table.radius, (Bound::Excluded(0.0), half));
        let depth = checks.number("depth", &table.depth, QUANTITY);
        let (radius, depth) = (radius?, depth?);
        let shape = Shape::Punch { radius, depth };
        Some(on_mesh(mesh?, shape, &table.heights, section.may_be_swept))
    })
}

fn on_mesh(
    mesh: Mesh,
    shape: Shape,
    heights: &Key<KeptHeights>,
    may_be_swept: bool,
) -> PlannedSurfaces {
    let nodes = mesh.nodes;
    PlannedSurfaces {
        may_be_swept,
        ..single(heights, Some(mesh.side), Origin::Shape { nodes, shape })
    }
}
