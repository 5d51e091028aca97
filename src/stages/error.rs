//! Why a task has no table.

use super::aggregate::sql::QueryError;
use super::generate::map_file::MapFileError;
use crate::contact::morphology::map::MapError;
use crate::contact::topography::preparation::PreparationError;
use crate::contact::topography::surface::SurfaceError;
use crate::store::StoreError;
use crate::store::table::TableError;
use crate::surface_files::SurfaceFileError;

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
    /// A stored contact map does not fit its mesh.
    #[error("a stored contact map does not fit its mesh")]
    Map(#[source] MapError),
    /// The file of a measured surface is no map of heights.
    #[error("`{path}` is no usable surface")]
    Measured {
        /// The file.
        path: String,
        /// What is wrong with it.
        source: Box<MapFileError>,
    },
    /// A measured surface cannot be prepared as asked.
    #[error("`{path}` cannot be prepared as asked")]
    Preparation {
        /// The file.
        path: String,
        /// What is wrong with it.
        source: PreparationError,
    },
    /// A table that a query reads is damaged.
    #[error(transparent)]
    Store(StoreError),
    /// A query has no answer.
    #[error("cannot answer the query")]
    Query(#[from] QueryError),
    /// An aggregation cannot be carried out.
    #[error("cannot aggregate: {reason}")]
    Aggregate {
        /// What polars, or a check before it, says.
        reason: String,
    },
}
