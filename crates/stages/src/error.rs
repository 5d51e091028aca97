//! Reasons why a task cannot compute its table.

use crate::map_file::MapFileError;
use crate::surface_files::SurfaceFileError;
use asperity_mechanics::adhesion::AdhesionError;
use asperity_mechanics::asperities::NoSummits;
use asperity_mechanics::conduction::ConductorError;
use asperity_mechanics::elasticity::LayerError;
use asperity_mechanics::morphology::map::MapError;
use asperity_mechanics::reduced::UnitsError;
use asperity_mechanics::solver::HardnessError;
use asperity_mechanics::topography::johnson::MomentsError;
use asperity_mechanics::topography::preparation::PreparationError;
use asperity_mechanics::topography::spectral_density::SpectralDensityError;
use asperity_mechanics::topography::surface::SurfaceError;
use asperity_queries::FrameError;
pub use asperity_queries::QueryError;
use asperity_tables::store::StoreError;
use asperity_tables::table::TableError;

/// Reason why a task could not compute its table.
#[derive(Debug, thiserror::Error)]
pub enum StageError {
    /// The user asked to stop.
    #[error("interrupted")]
    Interrupted,
    #[error("cannot use an input table")]
    Table(#[from] TableError),
    /// The columns of a stage cannot be derived from the columns of the stages that it reads.
    #[error("cannot use the table of input {stages}")]
    Inputs { stages: String, source: TableError },
    #[error("cannot use the file of a measured surface")]
    Source(#[from] SurfaceFileError),
    /// Stored or scaled heights, or the grid, are invalid.
    #[error("the heights do not form a valid surface")]
    Heights(#[source] SurfaceError),
    #[error("cannot solve the contact of this surface")]
    Units(#[from] UnitsError),
    #[error(
        "cannot solve the contact with this hardness (loads and hardness in units of E* × rms slope)"
    )]
    Hardness(#[from] HardnessError),
    #[error("cannot solve the contact with this layer (thickness over the longer side)")]
    Layer(#[from] LayerError),
    #[error("cannot solve the conduction through the layer")]
    Conductor(#[from] ConductorError),
    #[error("cannot solve the contact with adhesion")]
    Adhesion(#[from] AdhesionError),
    #[error("cannot solve the contact of the asperities")]
    NoSummits(#[from] NoSummits),
    #[error("a stored contact map does not fit its mesh")]
    Map(#[source] MapError),
    #[error("cannot use `{path}` as a surface")]
    Measured { path: String, source: Box<MapFileError> },
    #[error("cannot prepare the surface `{path}`")]
    Preparation { path: String, source: PreparationError },
    /// The file of a spectrum is invalid; the reason continues the sentence.
    #[error("`{path}` {reason}")]
    SpectrumFile { path: String, reason: String },
    #[error("a measured spectrum is not a valid power spectral density")]
    SpectralDensity(#[source] SpectralDensityError),
    #[error("cannot draw surfaces with this height distribution")]
    HeightMoments(#[from] MomentsError),
    /// A table that a query reads is damaged, or finished rows cannot be stored.
    #[error(transparent)]
    Store(StoreError),
    #[error("cannot answer the query")]
    Query(#[from] QueryError),
    /// The data do not have what the keys of the stage ask for. The text says what to change.
    #[error("{0}")]
    Unsuitable(String),

    #[error("cannot aggregate: {reason}")]
    Aggregate { reason: String },
}

impl From<FrameError> for StageError {
    fn from(error: FrameError) -> StageError {
        match error {
            FrameError::Query(error) => StageError::Query(error),
            FrameError::Store(error) => StageError::Store(error),
            FrameError::Aggregate { reason } => StageError::Aggregate { reason },
        }
    }
}
