//! Random surfaces with a given power spectral density.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use crate::columns::{PROFILES, SCANS, SPECTRAL_DENSITY, WAVENUMBER};
use crate::grids::Grids;
use crate::surface::Params;
use crate::surface_files::{ContentHash, SurfaceFiles};
use crate::{StageError, spectrum_files};
use asperity_mechanics::grid::Grid;
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::prescribed_heights::HeightDistribution;
use asperity_mechanics::topography::spectral_density::{
    SpectralDensity, TabulatedSurface, occupies,
};
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::table::Table;

/// A random surface with a given power spectral density.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "method", rename = "spectrum")]
pub struct SpectrumSurface {
    /// Source of the spectral density.
    #[serde(flatten)]
    pub source: Source,
    /// √⟨|∇h|²⟩ to which the surface is scaled. If it is `None`, the density determines the slope.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rms_slope: Option<f64>,
    /// √⟨h²⟩ about the mean to which the surface is scaled, instead of a rms slope.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rms_height: Option<f64>,
    /// Seed of the random numbers.
    pub seed: u64,
    /// Number of the realization among the surfaces with the same parameters.
    pub realization: u32,
}

/// The source of a power spectral density: a file or another stage.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Source {
    /// A file with a table of wavenumbers and densities.
    File {
        /// Hash of the content of the file; the path is not part of the recipe.
        content: ContentHash,
        /// Unit of length of the surface; empty for the unit of the table.
        unit: String,
    },
    /// A measured spectrum, which is in the table of another task.
    Stage {
        /// Name of the measured surface; `None` until the table has been read.
        spectrum_of: Option<String>,
    },
}

impl Source {
    /// Returns whether the density is in the table of another task.
    pub fn is_stage(&self) -> bool {
        matches!(self, Source::Stage { .. })
    }

    /// Returns whether the density is in a table that has not been read yet.
    pub fn is_unread(&self) -> bool {
        matches!(self, Source::Stage { spectrum_of: None })
    }
}

impl SpectrumSurface {
    /// Returns the rms height and the rms slope of the expected spectrum of unscaled surfaces on a
    /// grid: C(q)/(L_x L_y) summed over the modes of the grid.
    pub fn expected_roughness(density: &SpectralDensity, grid: Grid) -> [f64; 2] {
        let cell = grid.cell();
        let step = TAU / cell.longer_side();
        // Wavenumbers of one quadrant, with the number of modes ±k along each axis.
        let along = |axis: usize| {
            let nodes = grid.nodes()[axis];
            let is_single = move |waves: usize| waves == 0 || 2 * waves == nodes;
            (0..=nodes / 2).map(move |waves| (waves, if is_single(waves) { 1.0 } else { 2.0 }))
        };
        let [mut square_height, mut square_slope] = [0.0; 2];
        for (waves_x, modes_x) in along(0) {
            for (waves_y, modes_y) in along(1) {
                let q = step * cell.wavenumber([waves_x as f64, waves_y as f64]);
                if q > 0.0 {
                    let power = modes_x * modes_y * density.at(q) / cell.area();
                    square_height += power;
                    square_slope += q * q * power;
                }
            }
        }
        [square_height, square_slope].map(f64::sqrt)
    }

    /// Draws the surface on a grid. `heights` is the prescribed height distribution.
    ///
    /// # Errors
    /// If no mode of the grid has a density.
    pub fn draw(
        &self,
        density: &SpectralDensity,
        heights: Option<&HeightDistribution>,
        grid: Grid,
        threads: &Threads,
    ) -> Result<Surface, StageError> {
        if !occupies(density, grid) {
            let [from, to] = density.range();
            return Err(StageError::Unsuitable(format!(
                "no mode of the mesh lies in the range of the spectrum, from wavenumber {from:.4e} \
                 to {to:.4e}; change `side` or `nodes`"
            )));
        }
        let surface = TabulatedSurface {
            density,
            rms_slope: self.rms_slope,
            seed: self.seed,
            realization: self.realization,
        };
        let drawn = surface.draw_on(threads, grid, heights);
        Ok(match self.rms_height {
            Some(rms_height) => scaled_to(rms_height, drawn),
            None => drawn,
        })
    }

    /// Reads the density from its file, in the unit of length of the surface.
    ///
    /// # Errors
    /// If the file is missing, has changed or has no density, or if the density is in the table of
    /// another task.
    pub fn density_from_file(&self, sources: &SurfaceFiles) -> Result<SpectralDensity, StageError> {
        let Source::File { content, unit } = &self.source else {
            let reason = "the heights of this surface are not stored, and its spectrum is in the \
                          table of another stage; set `heights = \"keep\"`";
            return Err(StageError::Unsuitable(reason.to_owned()));
        };
        let unusable = |reason: String| {
            let known = sources.path_of(content).map(|path| path.display().to_string());
            StageError::SpectrumFile { path: known.unwrap_or_default(), reason }
        };
        let bytes = sources.read(content)?;
        let table = spectrum_files::read(&bytes).map_err(|error| unusable(error.to_string()))?;
        let Some(factor) = table.length_scale(unit) else {
            return Err(unusable(format!("cannot be converted to the unit {unit:?}")));
        };
        let density = SpectralDensity::from_points(table.points)
            .map_err(|error| unusable(error.to_string()))?;
        Ok(density.in_unit(factor))
    }

    /// Returns the density of a measured spectrum, constant on each ring of wavenumbers. The
    /// density of a spectrum from several scans or from profiles is a power law between its rows.
    ///
    /// # Errors
    /// If the table has no spectrum, or the spectrum of a flat surface.
    pub fn density_from_spectrum(table: &Table) -> Result<SpectralDensity, StageError> {
        if table.has(SCANS.name) || table.has(PROFILES.name) {
            let wavenumbers = table.reals(WAVENUMBER.name)?.values().iter();
            let densities = table.reals(SPECTRAL_DENSITY.name)?.values().iter();
            let points = wavenumbers.zip(densities).map(|(q, density)| [*q, *density]);
            let density = SpectralDensity::from_points(points.collect());
            return density.map_err(StageError::SpectralDensity);
        }
        let longer_side = Grids::new(table)?.grid(0)?.cell().longer_side();
        let step = TAU / longer_side;
        let wavenumbers = table.reals(WAVENUMBER.name)?.values().iter();
        let densities = table.reals(SPECTRAL_DENSITY.name)?.values().iter();
        let rings = wavenumbers.map(|wavenumber| (wavenumber / step).round() as u32);
        let density = SpectralDensity::from_rings(step, rings.zip(densities.copied()));
        density.map_err(StageError::SpectralDensity)
    }
}

/// Scales the heights about their mean to a root mean square. A flat surface stays flat.
fn scaled_to(rms_height: f64, surface: Surface) -> Surface {
    let grid = surface.grid();
    let mut heights = surface.into_heights();
    let nodes = heights.len() as f64;
    let mean = heights.iter().sum::<f64>() / nodes;
    let squares: f64 = heights.iter().map(|height| (height - mean).powi(2)).sum();
    let factor = if squares > 0.0 { rms_height / (squares / nodes).sqrt() } else { 1.0 };
    heights.iter_mut().for_each(|height| *height *= factor);
    Surface::new(grid, heights).expect("finite heights stay finite")
}

/// The height distribution of a random surface.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum PrescribedHeights {
    /// The distribution of Johnson's system with two given moments.
    Moments {
        /// Third standardised moment.
        skewness: f64,
        /// Fourth standardised moment, 3 for a Gaussian surface.
        kurtosis: f64,
    },
    /// The distribution of the heights of another surface, which is drawn or read again.
    Surface {
        /// Recipe of the other surface.
        from: Box<Params>,
    },
}

impl PrescribedHeights {
    /// Computes the distribution.
    ///
    /// # Errors
    /// If the other surface cannot be drawn or read, or if it is flat.
    pub fn distribution(
        &self,
        sources: &SurfaceFiles,
        threads: &Threads,
    ) -> Result<HeightDistribution, StageError> {
        match self {
            PrescribedHeights::Moments { skewness, kurtosis } => {
                Ok(HeightDistribution::from_moments(*skewness, *kurtosis)?)
            }
            PrescribedHeights::Surface { from } => {
                let surface = from.draw(sources, threads)?;
                HeightDistribution::from_surface(&surface).ok_or_else(|| {
                    let reason = "the surface in `height_distribution` is flat, so its heights \
                                  have no distribution";
                    StageError::Unsuitable(reason.to_owned())
                })
            }
        }
    }
}
