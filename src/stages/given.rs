//! What a stage's keys are checked against.

use super::{Rows, Work};
use crate::diagnostics::Problems;
use crate::store::table::Table;
use crate::surface_files::SurfaceFiles;

/// What must be known of the surfaces that a stage goes back to, with the stage that made them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surfaces {
    /// Measured maps that are not periodic and have not been made so.
    pub open: Option<String>,
    /// Random surfaces that cannot be drawn again: their spectra are in tables.
    pub kept_alone: Option<String>,
    /// Surfaces whose nodes are not as far apart along x as along y, and Δx/Δy.
    pub oblong: Option<(String, f64)>,
}

impl Surfaces {
    /// Those that a stage makes.
    pub fn made_by(stage: &str, work: &Work) -> Surfaces {
        let Work::Generate(surfaces) = work else {
            return Surfaces::default();
        };
        let params = || surfaces.iter().map(|surfaces| &surfaces.params);
        let is_open = params().any(|params| params.origin.is_open());
        let mut grids = params().filter_map(|params| params.grid().ok());
        let oblong = grids.find(|grid| !grid.has_square_cells());
        Surfaces {
            open: is_open.then(|| stage.to_owned()),
            kept_alone: params()
                .any(|params| params.origin.reads_stage())
                .then(|| stage.to_owned()),
            oblong: oblong.map(|grid| {
                let [step_x, step_y] = grid.spacing();
                (stage.to_owned(), step_x / step_y)
            }),
        }
    }

    /// These and others; of each sort one stands for all.
    pub fn and(self, other: &Surfaces) -> Surfaces {
        Surfaces {
            open: self.open.or_else(|| other.open.clone()),
            kept_alone: self.kept_alone.or_else(|| other.kept_alone.clone()),
            oblong: self.oblong.or_else(|| other.oblong.clone()),
        }
    }
}

/// What is known when a stage's keys are checked.
pub struct Given<'a> {
    /// The study's seed.
    pub seed: u64,
    /// The files of measured surfaces.
    pub sources: &'a mut SurfaceFiles,
    /// Whether it names stages that it reads.
    pub reads_stages: bool,
    /// What the rows that the stage reads are about, where that can be told.
    pub read: Option<Rows>,
    /// What it reads, without rows, where that is known.
    pub input: Option<&'a Table>,
    /// What must be known of the surfaces that it goes back to.
    pub surfaces: Surfaces,
    /// Hears of whatever is wrong.
    pub problems: &'a mut Problems,
}
