//! Random surfaces with a given spectrum, as recipes hold them.

use serde::{Deserialize, Serialize};

use crate::StageError;
use crate::columns::{SPECTRAL_DENSITY, WAVENUMBER};
use crate::grids::Grids;
use crate::spectrum_files;
use crate::surface_files::{ContentHash, SurfaceFiles};
use asperity_contact::grid::Grid;
use asperity_contact::threads::Threads;
use asperity_contact::topography::spectral_density::{GivenSpectrum, SpectralDensity, occupies};
use asperity_contact::topography::surface::Surface;
use asperity_tables::table::Table;

/// A random surface with a given power spectral density.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename = "spectrum")]
pub struct SpectrumSurface {
    /// Where the density comes from.
    #[serde(flatten)]
    pub source: Source,
    /// √⟨|∇h|²⟩ that each surface is scaled to; where it is none, the density decides.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rms_slope: Option<f64>,
    /// Names a family of draws.
    pub seed: u64,
    /// Names one member of the family.
    pub realization: u32,
}

/// Where a power spectral density comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Source {
    /// A table of wavenumbers and densities.
    File {
        /// Hash of the file's content; its path decides nothing.
        content: ContentHash,
        /// Unit of length of the surface; empty, where it is that of the table.
        unit: String,
    },
    /// The measured spectrum that the task reads.
    Stage {
        /// Name of the surface that it was measured of, once it has been read.
        spectrum_of: Option<String>,
    },
}

impl Source {
    /// Whether a task must read it from another's table.
    pub fn is_stage(&self) -> bool {
        matches!(self, Source::Stage { .. })
    }

    /// Whether no table has told yet whose spectrum it is.
    pub fn is_unread(&self) -> bool {
        matches!(self, Source::Stage { spectrum_of: None })
    }
}

impl SpectrumSurface {
    /// Draws the surface on a grid.
    ///
    /// # Errors
    /// When no mode of the grid has a density.
    pub fn draw(
        &self,
        density: &SpectralDensity,
        grid: Grid,
        threads: &Threads,
    ) -> Result<Surface, StageError> {
        if !occupies(density, grid) {
            let [from, to] = density.range();
            return Err(StageError::NoModes { from, to });
        }
        let surface = GivenSpectrum {
            density,
            rms_slope: self.rms_slope,
            seed: self.seed,
            realization: self.realization,
        };
        Ok(surface.draw_on(threads, grid))
    }

    /// The density that a file holds.
    ///
    /// # Errors
    /// When the file is gone, has changed, or holds none; and where the density is another task's.
    pub fn density_of_file(&self, sources: &SurfaceFiles) -> Result<SpectralDensity, StageError> {
        let Source::File { content, unit } = &self.source else {
            return Err(StageError::NotKept);
        };
        let unusable = |reason: String| {
            let path = sources.path_of(content);
            let path = path.map(|path| path.display().to_string());
            let path = path.unwrap_or_default();
            StageError::SpectrumFile { path, reason }
        };
        let bytes = sources.read(content)?;
        let table = spectrum_files::read(&bytes).map_err(|error| unusable(error.to_string()))?;
        let Some(factor) = table.length_scale(unit) else {
            return Err(unusable(format!("cannot be had in {unit:?}")));
        };
        let density = SpectralDensity::through(table.points);
        let density = density.map_err(|error| unusable(error.to_string()))?;
        Ok(density.in_unit(factor))
    }

    /// The density of a measured spectrum, ring by ring.
    ///
    /// # Errors
    /// When the table holds none, or that of a flat surface.
    pub fn density_measured(table: &Table) -> Result<SpectralDensity, StageError> {
        let longer_side = Grids::of(table)?.grid(0)?.cell().longer_side();
        let step = std::f64::consts::TAU / longer_side;
        let wavenumbers = table.reals(WAVENUMBER.name)?.values().iter();
        let densities = table.reals(SPECTRAL_DENSITY.name)?.values().iter();
        let rings = wavenumbers.map(|wavenumber| (wavenumber / step).round() as u32);
        let density = SpectralDensity::of_rings(step, rings.zip(densities.copied()));
        density.map_err(StageError::SpectralDensity)
    }
}
