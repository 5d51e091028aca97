//! Height distributions of random surfaces that are not Gaussian.

use serde::{Deserialize, Serialize};

use super::Params;
use crate::StageError;
use crate::surface_files::SurfaceFiles;
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::prescribed_heights::HeightDistribution;

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
                HeightDistribution::from_surface(&surface).ok_or(StageError::FlatHeights)
            }
        }
    }
}
