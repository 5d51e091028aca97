//! What a stage's keys are checked against.

use super::generate::Origin;
use super::{Recipe, Rows, Work, solve};
use crate::surface_files::SurfaceFiles;
use asperity_contact::distribution::EqualBins;
use asperity_manifest::diagnostics::Problems;
use asperity_tables::table::Table;

/// What must be known of the surfaces that a stage goes back to, with the stage that made them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surfaces {
    /// Measured maps that are not periodic and have not been made so.
    pub open: Option<String>,
    /// Random surfaces that cannot be drawn again: their spectra are in tables.
    pub kept_alone: Option<String>,
    /// Surfaces whose nodes are not as far apart along x as along y, and Δx/Δy.
    pub oblong: Option<(String, f64)>,
    /// A stage that presses them and counts no pressures.
    pub pressures_uncounted: Option<String>,
    /// A stage that presses them and counts no gaps.
    pub gaps_uncounted: Option<String>,
    /// The smallest and the largest rms slope, of surfaces that are drawn to have one.
    pub slopes: Option<[f64; 2]>,
}

impl Surfaces {
    /// Those that a stage makes, and what it finds out of them.
    pub fn made_by(stage: &str, work: &Work) -> Surfaces {
        let surfaces = match work {
            Work::Generate(surfaces) => surfaces,
            Work::Evaluate(recipes) => return Surfaces::pressed_by(stage, recipes),
        };
        let params = || surfaces.iter().map(|surfaces| &surfaces.params);
        let is_open = params().any(|params| params.origin.is_open());
        let mut grids = params().filter_map(|params| params.grid().ok());
        let oblong = grids.find(|grid| !grid.has_square_cells());
        let slopes = params().filter_map(|params| match &params.origin {
            Origin::Random { surface, .. } => Some([surface.rms_slope; 2]),
            Origin::Spectrum { surface, .. } => surface.rms_slope.map(|slope| [slope; 2]),
            Origin::File(_) | Origin::Shape { .. } => None,
        });
        Surfaces {
            slopes: slopes.reduce(spanning),
            open: is_open.then(|| stage.to_owned()),
            pressures_uncounted: None,
            gaps_uncounted: None,
            kept_alone: params()
                .any(|params| params.origin.reads_stage())
                .then(|| stage.to_owned()),
            oblong: oblong.map(|grid| {
                let [step_x, step_y] = grid.spacing();
                (stage.to_owned(), step_x / step_y)
            }),
        }
    }

    /// What a stage counts of them, if it presses them.
    fn pressed_by(stage: &str, recipes: &[Recipe]) -> Surfaces {
        let lacks = |bins: fn(&solve::Params) -> Option<EqualBins>| {
            let lacks = |recipe: &Recipe| match recipe {
                Recipe::Solve(block) => bins(block).is_none(),
                _ => false,
            };
            recipes.iter().any(lacks).then(|| stage.to_owned())
        };
        Surfaces {
            pressures_uncounted: lacks(|block| block.pressure_bins),
            gaps_uncounted: lacks(|block| block.gap_bins),
            ..Surfaces::default()
        }
    }

    /// These and others; of maps and meshes one stands for all.
    pub fn and(self, other: &Surfaces) -> Surfaces {
        let slopes = self.slopes.into_iter().chain(other.slopes);
        Surfaces {
            slopes: slopes.reduce(spanning),
            open: self.open.or_else(|| other.open.clone()),
            kept_alone: self.kept_alone.or_else(|| other.kept_alone.clone()),
            pressures_uncounted: self
                .pressures_uncounted
                .or_else(|| other.pressures_uncounted.clone()),
            gaps_uncounted: self.gaps_uncounted.or_else(|| other.gaps_uncounted.clone()),
            oblong: self.oblong.or_else(|| other.oblong.clone()),
        }
    }
}

/// The range that holds both.
fn spanning(one: [f64; 2], other: [f64; 2]) -> [f64; 2] {
    [one[0].min(other[0]), one[1].max(other[1])]
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
