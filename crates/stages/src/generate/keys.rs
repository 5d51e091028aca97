//! Keys of the stages that make surfaces.
//!
//! The comments of the keys are what editors show and what messages quote.

use std::fmt;

use schemars::JsonSchema;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Error, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};

use asperity_manifest::written::on_axes::{OnAxes, or_a_pair};
use asperity_manifest::written::{Key, deserialize_either, table};

/// Random self-affine surfaces: a plateau up to `k_rolloff`, then a power law up to `k_upper`.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RandomTable {
    /// Nodes per side of the mesh, at least two to the shortest wave; of a rectangle those along x
    /// and along y, `[1024, 512]`, beside a pair for `side`. The mesh samples the surface and does
    /// not change it.
    #[schemars(required, range(min = 4, max = 16384), transform = or_a_pair)]
    pub nodes: Key<OnAxes<i64>>,
    /// Side of the periodic cell, in any unit of length; of a rectangle those along x and along y,
    /// `[2.0, 1.0]`, beside a pair for `nodes`. Rectangles are swept as lists of pairs.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0), transform = or_a_pair)]
    pub side: Key<OnAxes<f64>>,
    /// Hurst exponent, above 0 and at most 1.
    #[schemars(required, range(max = 1), extend("exclusiveMinimum" = 0))]
    pub hurst: Key<f64>,
    /// Lower cutoff wavenumber, in units of 2π / side, of a rectangle the longer one; included.
    /// `longest_wavelength` may stand instead.
    #[schemars(range(min = 1, max = 8192))]
    pub k_lower: Key<i64>,
    /// The longest wavelength, in the unit of `side`, which it fits a whole number of times, of a
    /// rectangle the longer one; instead of `k_lower`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub longest_wavelength: Key<f64>,
    /// Wavenumber up to which the spectrum is flat, from `k_lower` to `k_upper`; `k_lower`, that
    /// is no plateau, when left out.
    #[schemars(range(min = 1, max = 8192))]
    pub k_rolloff: Key<i64>,
    /// Upper cutoff wavenumber, in units of 2π / side, of a rectangle the longer one; included, at
    /// most half of `nodes`. `shortest_wavelength` may stand instead.
    #[schemars(range(min = 1, max = 8192))]
    pub k_upper: Key<i64>,
    /// The shortest wavelength, in the unit of `side`, which it fits a whole number of times, of a
    /// rectangle the longer one; instead of `k_upper`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub shortest_wavelength: Key<f64>,
    /// A grain, `{ ratio = 2.0, angle = 30 }`: wavelengths and correlation lengths along it, at the
    /// angle in degrees from x, are `ratio` times those across. The density at (k∥, k⊥) is the
    /// isotropic one at √((ratio k∥)² + k⊥²), with k∥ = k_x cos angle + k_y sin angle; cutoffs are
    /// those across. A ratio of 1 is isotropic.
    pub anisotropy: Key<AnisotropyTable>,
    /// Root mean square slope that each surface is scaled to.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0))]
    pub rms_slope: Key<f64>,
    /// Seed of the draws; that of the study when left out.
    #[schemars(range(min = 0))]
    pub seed: Key<i64>,
    /// Number of surfaces drawn for each point of the grid, or until when more are drawn:
    /// `{ at_least, at_most, until }`. More of them change none before.
    #[schemars(extend("default" = 1))]
    pub realizations: Key<Realizations>,
    /// Whether heights are stored, drawn again when needed, or left out: `"none"` describes
    /// surfaces by their modes alone, many times faster, for statistics and not for contact.
    #[schemars(extend("default" = "keep"))]
    pub heights: Key<RandomHeights>,
}

table!(
    RandomTable,
    swept: [
        "nodes", "side", "hurst", "k_lower", "longest_wavelength", "k_rolloff", "k_upper",
        "shortest_wavelength", "anisotropy", "rms_slope", "seed"
    ],
    lists: [],
    pairs: ["nodes", "side"]
);

/// A grain.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct AnisotropyTable {
    /// Correlation length along the grain over that across, from 1 to 1000.
    #[schemars(required, range(min = 1, max = 1000))]
    pub ratio: Key<f64>,
    /// Direction of the grain, in degrees from the x axis, from 0 up to but not with 180.
    #[schemars(range(min = 0), extend("exclusiveMaximum" = 180, "default" = 0.0))]
    pub angle: Key<f64>,
}

/// How many surfaces are drawn for each point of the grid.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum Realizations {
    /// So many.
    Number(#[schemars(range(min = 1, max = 1_000_000))] i64),
    /// As many as it takes to know a mean, or to decide claims.
    Until(Growing),
}

/// As many surfaces as it takes to know a mean, or to decide claims.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct Growing {
    /// Surfaces to begin with.
    #[schemars(range(min = 2, max = 1_000_000), extend("default" = 10))]
    pub at_least: Key<i64>,
    /// Surfaces at which to give up.
    #[schemars(required, range(min = 2, max = 1_000_000))]
    pub at_most: Key<i64>,
    /// What must hold at each point and each load: `"sem(STAGE.COLUMN) < 0.5 %"` of the mean, or
    /// without `%` in the unit of the column. `sem` is the standard error of the mean over surfaces.
    /// Or `"claims decided"`: all claims that the study can judge are decided; or
    /// `"decided(CLAIM, …)"`, those of these names, as `asperity claims` lists them. Then `at_least` is
    /// 5 or more.
    #[schemars(required)]
    pub until: Key<String>,
}

deserialize_either! {
    'de, Realizations, "a whole number or a table `{ at_least, at_most, until }`",

    fn visit_i64<E: Error>(self, number: i64) -> Result<Realizations, E> {
        Ok(Realizations::Number(number))
    }

    fn visit_map<A: MapAccess<'de>>(self, table: A) -> Result<Realizations, A::Error> {
        Deserialize::deserialize(MapAccessDeserializer::new(table)).map(Realizations::Until)
    }
}

/// A paraboloid, for the contact of Hertz.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct ParaboloidTable {
    /// Nodes per side of the mesh; of a rectangle those along x and along y, `[1024, 512]`, beside
    /// a pair for `side`.
    #[schemars(required, range(min = 4, max = 16384), transform = or_a_pair)]
    pub nodes: Key<OnAxes<i64>>,
    /// Side of the periodic cell, in any unit of length; of a rectangle those along x and along y.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0), transform = or_a_pair)]
    pub side: Key<OnAxes<f64>>,
    /// Radius of curvature of the summit, in the unit of `side`.
    #[schemars(required, extend("exclusiveMinimum" = 0))]
    pub radius: Key<f64>,
    /// Whether heights are stored or drawn again when needed.
    #[schemars(extend("default" = "keep"))]
    pub heights: Key<Heights>,
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
    #[schemars(required, range(min = 4, max = 16384), transform = or_a_pair)]
    pub nodes: Key<OnAxes<i64>>,
    /// Side of the periodic cell, in any unit of length; of a rectangle those along x and along y.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0), transform = or_a_pair)]
    pub side: Key<OnAxes<f64>>,
    /// Amplitude of the wave, or of each wave, in the unit of `side`.
    #[schemars(required, extend("exclusiveMinimum" = 0))]
    pub amplitude: Key<f64>,
    /// Wavelengths per side, along either axis.
    #[schemars(range(min = 1, max = 8192), extend("default" = 1))]
    pub waves: Key<i64>,
    /// Whether heights are stored or drawn again when needed.
    #[schemars(extend("default" = "keep"))]
    pub heights: Key<Heights>,
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
    #[schemars(required, range(min = 4, max = 16384), transform = or_a_pair)]
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
    pub heights: Key<Heights>,
}

table!(
    PunchTable,
    swept: ["nodes", "side", "radius", "depth"],
    lists: [],
    pairs: ["nodes", "side"]
);

/// What becomes of the heights of a random surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum RandomHeights {
    /// They are stored.
    Keep,
    /// They are drawn again when needed.
    Redraw,
    /// There are none, and nothing can press the surface or count its heights.
    None,
}

/// What becomes of the heights of a surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Heights {
    /// They are stored.
    Keep,
    /// They are drawn, or read, again when needed.
    Redraw,
}
