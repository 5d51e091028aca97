//! One surface, drawn.

use std::path::Path;

use toml::Table as Keys;

use super::{DirectError, keys};
use asperity_contact::threads::Threads;
use asperity_contact::topography::surface::Surface;
use asperity_stages::StageError;
use asperity_stages::columns::RMS_SLOPE;
use asperity_stages::surface_files::SurfaceFiles;
use asperity_tables::table::{Table, TableError};

/// A surface, and what a `generate` stage says of it.
#[derive(Debug, Clone)]
pub struct Drawn {
    /// Its heights, in the unit of its sides.
    pub surface: Surface,
    /// √⟨|∇h|²⟩, as the stage takes it: of a random surface the slope that it was scaled to.
    pub rms_slope: f64,
    /// Whether it repeats itself: a map of a file may not.
    pub is_periodic: bool,
    /// The row of its stage, but for the heights.
    pub row: Table,
}

/// Draws the surface that the keys of a `generate` stage describe, with a number of its realization:
/// the heights that such a stage stores, to the last bit. Paths are relative to the working directory.
///
/// # Errors
/// When a key makes no sense, several surfaces are described, or a file cannot be read.
pub fn draw(keys: &Keys, realization: u32) -> Result<Drawn, DirectError> {
    let params = keys::surface(keys)?.params.realization(realization);
    let surface = params.draw(&SurfaceFiles::new(Path::new("")), &Threads::one())?;
    let row = params.described(&surface);
    let rms_slope = row.reals(RMS_SLOPE.name).map_err(of_table)?.value(0);
    Ok(Drawn { surface, rms_slope, is_periodic: !params.origin.is_open(), row })
}

fn of_table(error: TableError) -> DirectError {
    StageError::from(error).into()
}
