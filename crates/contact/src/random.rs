//! Random self-affine surfaces.

use std::ops::RangeInclusive;

use asperity_mechanics::topography::random as mechanics;
use asperity_mechanics::topography::random::Amplitude;
use asperity_mechanics::topography::spectrum::{self, Anisotropy};
use asperity_mechanics::topography::surface::HIGHEST;
use thiserror::Error;

use crate::{Grid, Length, Surface};

/// Power spectral density of a self-affine surface.
///
/// The density is constant from k_lower to the roll-off, proportional to |k|^(−2(1 + H)) from there
/// to k_upper, and zero elsewhere. Wavenumbers k = L/λ count waves along the longer side L.
///
/// ```
/// use asperity_contact::Spectrum;
///
/// let spectrum = Spectrum::new(0.8, 2..=64)?.rolloff(8)?.anisotropy(3.0, 30.0)?;
/// assert!(Spectrum::new(0.8, 64..=2).is_err());
/// assert!(spectrum.rolloff(65).is_err());
/// # Ok::<(), asperity_contact::SpectrumError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spectrum(spectrum::Spectrum);

/// Reason why a spectrum is invalid.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum SpectrumError {
    /// The Hurst exponent is not above zero and at most one.
    #[error("the Hurst exponent is {0}; it must be above 0 and at most 1")]
    Hurst(f64),
    /// The wavenumbers are not in ascending order from one.
    #[error(
        "the wavenumbers are {k_lower}, {k_rolloff} (roll-off) and {k_upper}; they must be at least 1 and ascend: \
         k_lower ≤ roll-off ≤ k_upper"
    )]
    #[non_exhaustive]
    Wavenumbers {
        /// Lower cutoff.
        k_lower: u32,
        /// Wavenumber at which the constant density ends.
        k_rolloff: u32,
        /// Upper cutoff.
        k_upper: u32,
    },
    /// The anisotropy is not positive and finite, or its angle is not finite.
    #[error(
        "an anisotropy of {ratio} along {degrees}°; the ratio must be positive, and both finite"
    )]
    #[non_exhaustive]
    Anisotropy {
        /// Ratio of the correlation lengths along and across the grain.
        ratio: f64,
        /// Angle of the grain to the x axis.
        degrees: f64,
    },
}

impl Spectrum {
    /// Creates an isotropic spectrum from the Hurst exponent H and the wavenumbers from k_lower to
    /// k_upper.
    ///
    /// # Errors
    /// Fails unless 0 < H ≤ 1 and 1 ≤ k_lower ≤ k_upper.
    pub fn new(hurst: f64, wavenumbers: RangeInclusive<u32>) -> Result<Self, SpectrumError> {
        if !(hurst > 0.0 && hurst <= 1.0) {
            return Err(SpectrumError::Hurst(hurst));
        }
        let (k_lower, k_upper) = wavenumbers.into_inner();
        let spectrum =
            spectrum::Spectrum { hurst, k_lower, k_rolloff: k_lower, k_upper, anisotropy: None };
        Self(spectrum).rolloff(k_lower)
    }

    /// Makes the density constant up to the wavenumber `k_rolloff`.
    ///
    /// # Errors
    /// Fails unless k_lower ≤ k_rolloff ≤ k_upper.
    pub fn rolloff(self, k_rolloff: u32) -> Result<Self, SpectrumError> {
        let spectrum::Spectrum { k_lower, k_upper, .. } = self.0;
        if 1 <= k_lower && k_lower <= k_rolloff && k_rolloff <= k_upper {
            Ok(Self(spectrum::Spectrum { k_rolloff, ..self.0 }))
        } else {
            Err(SpectrumError::Wavenumbers { k_lower, k_rolloff, k_upper })
        }
    }

    /// Stretches the surface by `ratio` along a grain at an angle of `degrees` to the x axis. The
    /// wavenumbers are then those across the grain.
    ///
    /// # Errors
    /// Fails unless the ratio is positive and both numbers are finite.
    pub fn anisotropy(self, ratio: f64, degrees: f64) -> Result<Self, SpectrumError> {
        if ratio > 0.0 && ratio.is_finite() && degrees.is_finite() {
            let anisotropy = Anisotropy::new(ratio, degrees);
            Ok(Self(spectrum::Spectrum { anisotropy, ..self.0 }))
        } else {
            Err(SpectrumError::Anisotropy { ratio, degrees })
        }
    }
}

/// Random periodic surface with a [`Spectrum`], defined by its modes and not by a mesh: finer
/// meshes show the same surface.
///
/// ```
/// use asperity_contact::{Grid, Length, RandomSurface, Spectrum};
///
/// let spectrum = Spectrum::new(0.8, 2..=16)?;
/// let grid = Grid::square(64, Length::micrometres(100.0))?;
/// let surface = RandomSurface::with_rms_slope(spectrum, 0.1).seed(1).draw(grid)?;
/// assert_eq!(surface.rms_slope(), 0.1);
/// let too_coarse = Grid::square(31, Length::micrometres(100.0))?;
/// assert!(RandomSurface::with_rms_slope(spectrum, 0.1).draw(too_coarse).is_err());
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RandomSurface {
    spectrum: Spectrum,
    roughness: Roughness,
    amplitude: Amplitude,
    seed: u64,
    realization: u32,
}

/// Quantity to which the heights are scaled.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Roughness {
    Slope(f64),
    Height(Length),
}

/// Reason why a random surface cannot be drawn on a grid.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum DrawError {
    /// The mesh has fewer than two nodes in the shortest wave.
    #[error(
        "{nodes} nodes along a side cannot resolve {waves} waves; use at least {} nodes, or a lower k_upper",
        2 * u64::from(*waves)
    )]
    #[non_exhaustive]
    TooCoarse {
        /// Number of nodes along the side.
        nodes: usize,
        /// Number of the shortest waves along the side.
        waves: u32,
    },
    /// The rms slope or the rms height is not positive and finite, or beyond all surfaces.
    #[error(
        "the rms slope or rms height (in m) is {0}; it must be positive, between 1e-100 and 1e100"
    )]
    Roughness(f64),
    /// No wave of the cell is in the range of the spectrum.
    #[error("the spectrum has no wave in this cell; widen the range of its wavenumbers")]
    NoWaves,
}

impl RandomSurface {
    /// Creates a surface whose heights are scaled to an rms slope √⟨|∇h|²⟩.
    pub fn with_rms_slope(spectrum: Spectrum, rms_slope: f64) -> Self {
        Self::new(spectrum, Roughness::Slope(rms_slope))
    }

    /// Creates a surface whose heights are scaled to a root mean square about their mean.
    pub fn with_rms_height(spectrum: Spectrum, rms_height: Length) -> Self {
        Self::new(spectrum, Roughness::Height(rms_height))
    }

    fn new(spectrum: Spectrum, roughness: Roughness) -> Self {
        Self { spectrum, roughness, amplitude: Amplitude::Gaussian, seed: 0, realization: 0 }
    }

    /// Sets the seed of the random numbers; 0 by default.
    pub fn seed(self, seed: u64) -> Self {
        Self { seed, ..self }
    }

    /// Sets the index of the realization; 0 by default. Realizations are statistically independent.
    pub fn realization(self, realization: u32) -> Self {
        Self { realization, ..self }
    }

    /// Gives each mode exactly its expected power and a random phase. By default, the modes are
    /// those of filtered white noise.
    pub fn random_phases(self) -> Self {
        Self { amplitude: Amplitude::Deterministic, ..self }
    }

    /// Draws the surface on a grid.
    ///
    /// # Errors
    /// Fails if the mesh has fewer than two nodes in the shortest wave, if the cell has no wave of
    /// the spectrum, or if the rms slope or height is not positive and finite.
    pub fn draw(&self, grid: Grid) -> Result<Surface, DrawError> {
        let (grid, spectrum) = (grid.inner(), self.spectrum.0);
        let waves = spectrum.max_waves(grid.cell()).into_iter().zip(grid.nodes());
        for (waves, nodes) in waves {
            if 2 * u64::from(waves) > nodes as u64 {
                return Err(DrawError::TooCoarse { nodes, waves });
            }
        }
        let Self { amplitude, seed, realization, .. } = *self;
        let unscaled =
            mechanics::RandomSurface { spectrum, amplitude, rms_slope: 1.0, seed, realization };
        let (given, rms_slope) = match self.roughness {
            Roughness::Slope(slope) => (slope, slope),
            Roughness::Height(height) => {
                let metres = height.in_metres();
                (metres, metres / unscaled.moments(grid.cell()).rms_height())
            }
        };
        // Squares of these numbers are finite.
        if !(1.0 / HIGHEST..=HIGHEST).contains(&given) {
            return Err(DrawError::Roughness(given));
        }
        if !(rms_slope > 0.0 && rms_slope.is_finite()) {
            return Err(DrawError::NoWaves);
        }
        let surface = mechanics::RandomSurface { rms_slope, ..unscaled }.draw(grid);
        let highest = surface.heights().iter().fold(0.0, |highest: f64, h| highest.max(h.abs()));
        match highest {
            0.0 => Err(DrawError::NoWaves),
            highest if highest > HIGHEST => Err(DrawError::Roughness(given)),
            _ => Ok(Surface::periodic(surface, rms_slope)),
        }
    }
}
