//! Keys of the stages that draw surfaces with a given spectrum.
//!
//! The comments of the keys are what editors show and what messages quote.

use schemars::JsonSchema;
use serde::Deserialize;

use super::keys::{Heights, Realizations};
use asperity_manifest::written::on_axes::{OnAxes, or_a_pair};
use asperity_manifest::written::{Key, table};

/// Gaussian random surfaces with a given isotropic power spectral density C(q), normalised so that
/// ∫ C d²q/(2π)² is their mean square height: an ensemble for one measurement.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct SpectrumTable {
    /// A CSV or Parquet file with columns `wavenumber` (angular, 2π/λ) and `density` or
    /// `spectral_density`, relative to the manifest; between them the density is a power law from each
    /// to the next, beyond them zero. Headers of a CSV file may name units: `wavenumber [1/µm]`,
    /// `density [µm^4]`. Where the spectrum has been measured, `from` names the stage instead, and
    /// modes have the densities of their rings.
    pub path: Key<String>,
    /// Name of the unit of length of `side`; when left out that of the file, which is converted where
    /// it names another.
    #[schemars(extend("default" = ""))]
    pub unit: Key<String>,
    /// Nodes per side of the mesh; of a rectangle those along x and along y, `[1024, 512]`, beside
    /// a pair for `side`. Waves of fewer than two nodes are left out.
    #[schemars(required, range(min = 4, max = 16384), transform = or_a_pair)]
    pub nodes: Key<OnAxes<i64>>,
    /// Side of the periodic cell, in `unit` or, with `from`, in that of the measured surface; of a
    /// rectangle those along x and along y. Waves that are longer are left out.
    #[schemars(required, extend("exclusiveMinimum" = 0), transform = or_a_pair)]
    pub side: Key<OnAxes<f64>>,
    /// Root mean square slope that each surface is scaled to; when left out nothing is scaled, and
    /// height and slope follow from the spectrum.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub rms_slope: Key<f64>,
    /// Seed of the draws; that of the study when left out.
    #[schemars(range(min = 0))]
    pub seed: Key<i64>,
    /// Number of surfaces drawn for each point of the grid, or until when more are drawn:
    /// `{ at_least, at_most, until }`. More of them change none before.
    #[schemars(extend("default" = 1))]
    pub realizations: Key<Realizations>,
    /// Whether heights are stored or drawn again when needed; with `from` they are stored.
    #[schemars(extend("default" = "keep"))]
    pub heights: Key<Heights>,
}

table!(
    SpectrumTable,
    swept: ["path", "nodes", "side", "rms_slope", "seed"],
    lists: [],
    pairs: ["nodes", "side"]
);
