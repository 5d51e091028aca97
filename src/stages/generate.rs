//! Draws a surface, or reads one, and describes it.

use arrow::array::{ArrayRef, AsArray, Float64Array};
use arrow::datatypes::Float64Type;
use serde::Serialize;

use super::columns::*;
use super::{Context, Effort, Kind, Recipe, StageError};
use crate::contact::descriptors::Descriptors;
use crate::contact::measured;
use crate::contact::periodic::Edges;
use crate::contact::shapes::Shape;
use crate::contact::surface::{Amplitude, RandomSurface, Surface};
use crate::sources::{ContentHash, Sources};
use crate::store::column::{Column, integers, lists, optional_reals, reals, texts};
use crate::store::key::{Digest, TaskKey};
use crate::store::table::Table;

/// Raise it when the numbers change.
pub const VERSION: u32 = 1;

/// One surface.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Params {
    /// Whether the heights are stored, or drawn again when needed.
    pub heights: Heights,
    /// Side of the periodic cell, in the user's unit of length.
    pub side: f64,
    /// What the surface looks like.
    #[serde(flatten)]
    pub form: Form,
}

/// What becomes of the heights.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Heights {
    /// They are a column of the stored table.
    Keep,
    /// They are drawn again by whoever needs them.
    Redraw,
}

/// Where a surface comes from.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Form {
    /// A random self-affine surface.
    Random {
        /// Nodes per side.
        nodes: u32,
        /// Spectrum, draw and scale.
        #[serde(flatten)]
        surface: RandomSurface,
    },
    /// A measured surface.
    File(MeasuredSurface),
    /// A shape with a closed-form solution.
    Shape {
        /// Nodes per side.
        nodes: u32,
        /// Which one.
        #[serde(flatten)]
        shape: Shape,
    },
}

/// A map of heights in a file.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(tag = "method", rename = "file")]
pub struct MeasuredSurface {
    /// Hash of the file's content; its path decides nothing.
    pub content: ContentHash,
    /// Unit of length, a label.
    pub unit: String,
    /// Factor that turns the file's numbers into lengths.
    pub height_scale: f64,
    /// How the map's edges are made to meet.
    #[serde(flatten)]
    pub edges: Edges,
}

impl Params {
    /// The same surface of another realization; shapes and files have but one.
    pub fn realization(&self, number: u32) -> Params {
        let mut params = self.clone();
        if let Form::Random { surface, .. } = &mut params.form {
            surface.realization = number;
        }
        params
    }

    /// The same surface with its heights not kept: what later stages' keys are built on.
    pub fn without_heights(&self) -> Params {
        Params {
            heights: Heights::Redraw,
            ..self.clone()
        }
    }

    /// What all realizations share, of whatever seed, spelled out.
    pub fn point(&self) -> String {
        let mut common = self.without_heights().realization(0);
        if let Form::Random { surface, .. } = &mut common.form {
            surface.seed = 0;
        }
        serde_json::to_string(&common).expect("parameters are plain data")
    }

    /// The surface's name, the same whether its heights are kept or not.
    fn surface_key(&self) -> TaskKey {
        let recipe = Recipe::Generate(self.without_heights());
        TaskKey::of(Kind::Generate.name(), VERSION, Digest::of(&recipe), &[])
    }

    /// See [`Recipe::effort`]: drawing and describing take a few transforms.
    pub fn effort(&self) -> Effort {
        Effort::pairs(6.0)
    }

    /// Nodes per side, where that is known before a file is read.
    pub fn nodes(&self) -> usize {
        match &self.form {
            Form::Random { nodes, .. } | Form::Shape { nodes, .. } => *nodes as usize,
            Form::File(_) => 512,
        }
    }

    /// Draws the surface, or reads it.
    ///
    /// # Errors
    /// When the file is gone, has changed, or is no map of heights.
    pub fn draw(&self, sources: &Sources) -> Result<Surface, StageError> {
        match &self.form {
            Form::Random { nodes, surface } => Ok(surface.draw(*nodes as usize, self.side)),
            Form::Shape { nodes, shape } => Ok(shape.draw(*nodes as usize, self.side)),
            Form::File(file) => {
                let bytes = sources.read(&file.content)?;
                let map = measured::read_npy(&bytes, self.side).map_err(|source| {
                    let path = sources.path_of(&file.content);
                    StageError::Measured {
                        path: path
                            .map(|path| path.display().to_string())
                            .unwrap_or_default(),
                        source,
                    }
                })?;
                let map = map.scaled(file.height_scale).map_err(StageError::Heights)?;
                Ok(file.edges.close(map))
            }
        }
    }

    /// The heights that `table` kept, or else the surface drawn again.
    ///
    /// # Errors
    /// As [`Params::draw`], and when the table is not one of this stage.
    pub fn surface(&self, table: &Table, sources: &Sources) -> Result<Surface, StageError> {
        if !table.has(HEIGHTS.name) {
            return self.draw(sources);
        }
        let nodes = table.integers(NODES.name)?.value(0);
        let side = table.reals(SIDE.name)?.value(0);
        let list = table.lists(HEIGHTS.name)?.value(0);
        let heights = list.as_primitive::<Float64Type>().values().to_vec();
        let surface = Surface::new(nodes.unsigned_abs() as usize, side, heights);
        surface.map_err(StageError::Heights)
    }
}

/// Draws one surface and describes it in one row.
///
/// # Errors
/// When the file of a measured surface is gone, has changed, or is no map of heights.
pub fn run(params: &Params, context: &Context) -> Result<Table, StageError> {
    let surface = params.draw(context.sources)?;
    let descriptors = Descriptors::of(&surface);
    let rms_slope = match &params.form {
        // The scale is set so that this holds to rounding; rows of one spectrum must agree.
        Form::Random { surface, .. } => surface.rms_slope,
        _ => descriptors.rms_slope,
    };
    let mut columns = vec![
        (SURFACE, texts([params.surface_key().to_string()])),
        (METHOD, texts([params.method()])),
        (NODES, integers([surface.nodes() as i64])),
        (SIDE, reals([surface.side()])),
        (RMS_SLOPE, reals([rms_slope])),
    ];
    columns.extend(own_coordinates(&params.form));
    columns.extend(description(params, &surface, &descriptors, rms_slope));
    if params.heights == Heights::Keep {
        let heights = Float64Array::from(surface.into_heights());
        let length = heights.len();
        columns.push((HEIGHTS, lists(heights, [length])));
    }
    Ok(Table::new(1, columns))
}

impl Params {
    fn method(&self) -> &'static str {
        match &self.form {
            Form::Random { surface, .. } => match surface.amplitude {
                Amplitude::Gaussian => "filter",
                Amplitude::Deterministic => "random-phase",
            },
            Form::File(_) => "file",
            Form::Shape { shape, .. } => match shape {
                Shape::Paraboloid { .. } => "paraboloid",
                Shape::Wave { .. } => "wave",
                Shape::WaveProduct { .. } => "wave-product",
                Shape::WaveSum { .. } => "wave-sum",
                Shape::Punch { .. } => "flat-punch",
            },
        }
    }
}

/// What places a surface among others of its method.
fn own_coordinates(form: &Form) -> Vec<(Column, ArrayRef)> {
    let whole = |column: Column, value: u32| (column, integers([i64::from(value)]));
    let real = |column: Column, value: f64| (column, reals([value]));
    match form {
        Form::Random { surface, .. } => vec![
            real(HURST, surface.spectrum.hurst),
            whole(K_LOWER, surface.spectrum.k_lower),
            whole(K_ROLLOFF, surface.spectrum.k_rolloff),
            whole(K_UPPER, surface.spectrum.k_upper),
            (SEED, integers([surface.seed.cast_signed()])),
            whole(REALIZATION, surface.realization),
        ],
        Form::File(file) => {
            let mut columns = vec![
                (CONTENT, texts([file.content.to_string()])),
                (UNIT, texts([&file.unit])),
                real(HEIGHT_SCALE, file.height_scale),
                (EDGES, texts([file.edges.name()])),
            ];
            if let Edges::Taper { taper_fraction } = file.edges {
                columns.push(real(TAPER_FRACTION, taper_fraction));
            }
            columns
        }
        Form::Shape { shape, .. } => match *shape {
            Shape::Paraboloid { radius } => vec![real(RADIUS, radius)],
            Shape::Wave { amplitude, waves }
            | Shape::WaveProduct { amplitude, waves }
            | Shape::WaveSum { amplitude, waves } => {
                vec![real(AMPLITUDE, amplitude), whole(WAVES, waves)]
            }
            Shape::Punch { radius, depth } => vec![real(RADIUS, radius), real(DEPTH, depth)],
        },
    }
}

fn description(
    params: &Params,
    surface: &Surface,
    of: &Descriptors,
    rms_slope: f64,
) -> impl Iterator<Item = (Column, ArrayRef)> {
    let side = surface.side();
    // A random surface knows its modes, on any mesh; of others there is but the mesh.
    let moments = match &params.form {
        Form::Random { surface, .. } => surface.moments(side),
        _ => of.moments,
    };
    // The descriptors' unit of load is the slope that the mesh sees.
    let unit = if rms_slope > 0.0 {
        of.rms_slope / rms_slope
    } else {
        1.0
    };
    let values = [
        Some(moments.m00),
        Some(moments.m20),
        Some(moments.m02),
        Some(moments.m22),
        Some(moments.m40),
        Some(moments.m04),
        moments.nayak(),
        Some(moments.summit_density()),
        Some(moments.summit_density_integer(side)),
        Some(moments.rms_height()),
        of.skewness,
        of.excess_kurtosis,
        Some(moments.effective_modes()),
        Some(of.full_contact_load * unit),
    ];
    DESCRIPTORS
        .into_iter()
        .zip(values)
        .map(|(column, value)| (column, optional_reals([value])))
}
