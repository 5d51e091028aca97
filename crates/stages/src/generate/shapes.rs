//! Keys of shapes with a closed-form contact solution.
//!
//! Editors show the doc comments of keys, and messages quote them.

use schemars::JsonSchema;
use serde::Deserialize;

use super::mesh::{self, MAX_NODES, MAX_WAVES, MIN_NODES, Mesh, Wave, check_waves};
use crate::generate::realizations::surfaces;
use crate::per_axis::PerAxis;
use crate::surface::method::WaveShape;
use crate::surface::planned::{PlannedSurfaces, single};
use crate::surface::{Heights, Origin};
use asperity_manifest::diagnostics::Problems;
use asperity_manifest::keys::declare::{length, pair, required, swept, unit_of_lengths};
use asperity_manifest::keys::{Key, OnAxes, Section, table};
use asperity_mechanics::topography::shapes::Shape;

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

/// Returns the paraboloids of a stage, or `None` after reporting problems.
pub fn paraboloid(
    section: &Section<ParaboloidTable>,
    problems: &mut Problems,
) -> Option<Vec<PlannedSurfaces>> {
    surfaces(section, problems, |table, checks| {
        let mesh = mesh::mesh(&table.nodes, &table.side, checks);
        let unit = mesh::unit(&table.unit, &table.side, checks);
        let radius = checks.number("radius", &table.radius);
        let heights = checks.value("heights", &table.heights)?;
        let shape = Shape::Paraboloid { radius: radius? };
        Some(on_mesh(mesh?, shape, unit?, heights, section.may_be_swept))
    })
}

/// Returns the waves of a stage, or `None` after reporting problems.
pub fn wave(
    shape: WaveShape,
    section: &Section<WaveTable>,
    problems: &mut Problems,
) -> Option<Vec<PlannedSurfaces>> {
    surfaces(section, problems, |table, checks| {
        let mesh = mesh::mesh(&table.nodes, &table.side, checks);
        let unit = mesh::unit(&table.unit, &table.side, checks);
        let amplitude = checks.number("amplitude", &table.amplitude);
        let waves = checks.value("waves", &table.waves);
        let heights = checks.value("heights", &table.heights)?;
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
        Some(on_mesh(mesh, shape, unit?, heights, section.may_be_swept))
    })
}

/// Returns the flat punches of a stage, or `None` after reporting problems.
pub fn punch(
    section: &Section<PunchTable>,
    problems: &mut Problems,
) -> Option<Vec<PlannedSurfaces>> {
    surfaces(section, problems, |table, checks| {
        let mesh = mesh::mesh(&table.nodes, &table.side, checks);
        let unit = mesh::unit(&table.unit, &table.side, checks);
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
        Some(on_mesh(mesh, shape, unit?, heights, section.may_be_swept))
    })
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
