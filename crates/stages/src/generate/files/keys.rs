//! Keys of the stages that read measured surfaces.
//!
//! The comments of the keys are what editors show and what messages quote.

use std::fmt;

use schemars::JsonSchema;
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer};

use crate::generate::keys::Heights;
use asperity_manifest::written::on_axes::{OnAxes, or_a_pair};
use asperity_manifest::written::{Key, deserialize_either, table};

/// A measured surface, of the file that the instrument wrote. What is asked for is done in this
/// order: channel, unit and side, `crop`, `level`, `fill`, `high_pass`, `low_pass`, `resample`,
/// `edges`.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FileTable {
    /// A file of surface topography, relative to the manifest: x3p, sur, gwy, gsf, sdf, opd, al3d,
    /// Nanoscope, Igor, MetroPro, netCDF, text and more, known by its content (`asperity surface` says
    /// what it holds), or a NumPy array with x along its first axis.
    #[schemars(required)]
    pub path: Key<String>,
    /// Which map of a file that has several, by its name, or by its number from 1 on; when left out the
    /// first that holds heights.
    pub channel: Key<Channel>,
    /// Side of the map in the file, where that does not say it: nodes × step, in any unit of length; of
    /// a rectangle those along x and along y, `[2.0, 1.0]`. In metres where the file has a unit.
    #[schemars(extend("exclusiveMinimum" = 0), transform = or_a_pair)]
    pub side: Key<OnAxes<f64>>,
    /// Name of the unit of length, where the file has none; a label, it converts nothing. Lengths of a
    /// file with a unit are in `"m"`.
    #[schemars(extend("default" = ""))]
    pub unit: Key<String>,
    /// What heights are multiplied by to be in the unit of `side`.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0))]
    pub height_scale: Key<f64>,
    /// Whether `side` and `unit` hold where the file says otherwise. Without it that is an error.
    #[serde(rename = "override")]
    #[schemars(extend("default" = false))]
    pub overrides: Key<bool>,
    /// Whether the map, without the form that `level` takes away, repeats itself beyond its edges.
    #[schemars(required)]
    pub periodic: Key<bool>,
    /// A part of a map that is not periodic, rounded to its nodes: `{ from = [x, y], size = [a, b] }` in
    /// the unit of `side`.
    pub crop: Key<Part>,
    /// Which form is taken away, fitted to the measured points by least squares: `"mean"`, `"plane"` or
    /// `"quadric"`; none when left out or `"none"`.
    pub level: Key<Level>,
    /// What becomes of points that were not measured: `"harmonic"` solves Laplace's equation in the
    /// holes, `"nearest"` takes the height of the nearest measured point, `"lowest"` the lowest of the
    /// map; when left out, or `"error"`, a map that lacks points is refused.
    pub fill: Key<Fill>,
    /// Wavelength above which waves are removed, in the unit of `side`, by the areal Gaussian filter of
    /// ISO 16610-61: half of a wave of that length is left.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub high_pass: Key<f64>,
    /// Wavelength below which waves are removed, by the same filter; two steps or more, and below
    /// `high_pass`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub low_pass: Key<f64>,
    /// Nodes per side that a periodic map is interpolated on, by its Fourier modes; along x and along
    /// y, `[512, 256]`, of a rectangle. A list of two numbers is a pair and not swept.
    #[schemars(range(min = 4, max = 16384), transform = or_a_pair)]
    pub resample: Key<OnAxes<i64>>,
    /// How the edges of a map that is not periodic are made to meet, its mean plane removed. When
    /// left out it stays as it is, and can be pressed with `boundary = "free"` alone.
    pub edges: Key<Edges>,
    /// Share of the side over which `edges = "taper"` lets the heights fade, at each edge.
    #[schemars(range(max = 0.5), extend("exclusiveMinimum" = 0, "default" = 0.1))]
    pub taper_fraction: Key<f64>,
    /// Whether heights are stored or read again when needed.
    #[schemars(extend("default" = "keep"))]
    pub heights: Key<Heights>,
}

table!(
    FileTable,
    swept: [
        "path", "channel", "side", "unit", "height_scale", "crop", "level", "fill", "high_pass",
        "low_pass", "resample", "edges", "taper_fraction"
    ],
    lists: [],
    pairs: [],
    always_pairs: ["side", "resample"]
);

/// Which map of a file.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum Channel {
    /// By its place, from 1 on.
    Number(#[schemars(range(min = 1, max = 65535))] i64),
    /// By its name.
    Name(String),
}

deserialize_either! {
    'de, Channel, "the name of a channel, or its number from 1 on",

    fn visit_i64<E: Error>(self, number: i64) -> Result<Channel, E> {
        Ok(Channel::Number(number))
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Channel, E> {
        Ok(Channel::Name(name.to_owned()))
    }
}

/// A rectangle of a map.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// Where it begins, along x and along y.
    pub from: [f64; 2],
    /// Its sides along x and along y.
    pub size: [f64; 2],
}

/// Which form is taken away.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Level {
    /// None.
    None,
    /// The mean height.
    Mean,
    /// The mean plane.
    Plane,
    /// The mean quadric.
    Quadric,
}

/// What becomes of points that were not measured.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Fill {
    /// The map is refused.
    Error,
    /// Laplace's equation is solved in the holes.
    Harmonic,
    /// They get the height of the nearest measured point.
    Nearest,
    /// They get the lowest height of the map.
    Lowest,
}

/// How the edges of a map that is not periodic are made to meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Edges {
    /// The map is mirrored along both axes: a cell of twice the side.
    Mirror,
    /// The heights fade to zero near the edges.
    Taper,
}
