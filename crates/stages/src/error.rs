//! Why a task has no table.

use super::aggregate::sql::QueryError;
use super::generate::map_file::MapFileError;
use crate::surface_files::SurfaceFileError;
use asperity_contact::asperities::NoSummits;
use asperity_contact::morphology::map::MapError;
use asperity_contact::solver::HardnessError;
use asperity_contact::topography::preparation::PreparationError;
use asperity_contact::topography::spectral_density::SpectralDensityError;
use asperity_contact::topography::surface::SurfaceError;
use asperity_tables::store::StoreError;
use asperity_tables::table::TableError;

/// Why a task has no table.
#[derive(Debug, thiserror::Error)]
pub enum StageError {
    /// The user asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// An input table is not what the stage reads.
    #[error("cannot use an input table")]
    Table(#[from] TableError),
    /// The file of a measured surface is gone or has changed.
    #[error("cannot read a measured surface")]
    Source(#[from] SurfaceFileError),
    /// Heights, stored or scaled, are no surface.
    #[error("these heights are no surface")]
    Heights(#[source] SurfaceError),
    /// The material is pressed by more than it bears.
    #[error("the material does not bear the load, both in units of E* × rms slope")]
    Hardness(#[from] HardnessError),
    /// A surface has no asperities.
    #[error("asperities cannot be pressed")]
    NoSummits(#[from] NoSummits),
    /// A stored contact map does not fit its mesh.
    #[error("a stored contact map does not fit its mesh")]
    Map(#[source] MapError),
    /// The file of a measured surface is no map of heights.
    #[error("`{path}` is no usable surface")]
    Measured { path: String, source: Box<MapFileError> },
    /// A measured surface cannot be prepared as asked.
    #[error("`{path}` cannot be prepared as asked")]
    Preparation { path: String, source: PreparationError },
    /// A file holds no power spectral density.
    #[error("`{path}` {reason}")]
    SpectrumFile { path: String, reason: String },
    /// A measured spectrum is no power spectral density.
    #[error("a measured spectrum is no power spectral density")]
    SpectralDensity(#[source] SpectralDensityError),
    /// A mesh has no waves in the range of a spectrum.
    #[error(
        "no wave of the mesh has a density: the spectrum goes from wavenumber {from:.4e} to {to:.4e}"
    )]
    NoModes {
        /// The smallest wavenumber with a density.
        from: f64,
        /// The largest.
        to: f64,
    },
    /// Heights were to be drawn again whose spectrum is in another task's table.
    #[error("heights with the spectrum of another stage were not kept")]
    NotKept,
    /// A table that a query reads is damaged.
    #[error(transparent)]
    Store(StoreError),
    /// A query has no answer.
    #[error("cannot answer the query")]
    Query(#[from] QueryError),
    /// An aggregation cannot be carried out.
    #[error("cannot aggregate: {reason}")]
    Aggregate { reason: String },
}
