//! One surface for each of a few parameter points: figures that show single surfaces show these.

use super::ReportError;
use super::ensembles::{self, Point};
use super::tables::FinishedStages;
use asperity_contact::threads::Threads;
use asperity_contact::topography::random::RandomSurface;
use asperity_contact::topography::surface::Surface;
use asperity_stages::ensemble;
use asperity_stages::generate;
use asperity_stages::generate::{Heights, MeasuredSurface, Origin};
use asperity_stages::{Recipe, Stage as _, StageError, grids};
use asperity_tables::parquet::Columns;
use asperity_tables::store::TaskTables;

/// The most points that one figure shows.
pub const MOST: usize = 9;
/// Nodes to the longer side that a random surface is drawn on, if its waves allow.
const NODES: usize = 512;

/// The first surface of a parameter point.
pub struct Sample<'a> {
    /// Its task.
    pub task: usize,
    /// How it was made.
    pub params: &'a generate::Params,
    /// Where it stands.
    pub point: Point,
}

impl Sample<'_> {
    /// The file that it was measured in, if it was.
    pub fn file(&self) -> Option<&MeasuredSurface> {
        match &self.params.origin {
            Origin::File(file) => Some(file),
            Origin::Random { .. } | Origin::Spectrum { .. } | Origin::Shape { .. } => None,
        }
    }

    /// Its spectrum and draw, if it was drawn.
    pub fn random(&self) -> Option<&RandomSurface> {
        match &self.params.origin {
            Origin::Random { surface, .. } => Some(surface),
            Origin::Spectrum { .. } | Origin::File(_) | Origin::Shape { .. } => None,
        }
    }

    /// Its heights, if the store has them.
    ///
    /// # Errors
    /// When its table is damaged.
    pub fn kept(&self, finished: &FinishedStages) -> Result<Option<Surface>, StageError> {
        let (store, key) = (finished.archive.store(), finished.plan.tasks[self.task].key);
        if self.params.heights != Heights::Keep || !store.has(key) {
            return Ok(None);
        }
        let table = store.read(key, Columns::All).map_err(StageError::Store)?;
        let sources = finished.sources;
        self.params.surface(&table, sources, &Threads::one()).map(Some)
    }

    /// Its heights, on a mesh that is fine enough to be looked at: a random surface is the same on
    /// all meshes.
    ///
    /// # Errors
    /// When the file of a measured surface cannot be read, or heights that were kept.
    pub fn draw(&self, finished: &FinishedStages) -> Result<Surface, StageError> {
        match &self.params.origin {
            Origin::Random { surface, .. } => {
                let grid = self.params.grid()?;
                let aspect = grid.cell().aspect();
                let waves = surface.spectrum.most_waves(grid.cell());
                let shown = [0, 1].map(|axis| {
                    let enough = (NODES as f64 / aspect[axis]).ceil() as usize;
                    grid.nodes()[axis].min(enough.max(2 * waves[axis] as usize))
                });
                Ok(surface.draw(grids::grid(shown, grid.cell().size())?))
            }
            Origin::Spectrum { .. } if self.params.origin.reads_stage() => {
                let store = finished.archive.store();
                let table = store.read(finished.plan.tasks[self.task].key, Columns::All);
                let table = table.map_err(StageError::Store)?;
                self.params.surface(&table, finished.sources, &Threads::one())
            }
            Origin::Spectrum { .. } | Origin::File(_) | Origin::Shape { .. } => {
                self.params.draw(finished.sources, &Threads::one())
            }
        }
    }
}

/// The first finished surface of each parameter point, or of [`MOST`] spread over all of them.
///
/// # Errors
/// When a surface's table cannot be read.
pub fn of<'a>(finished: &FinishedStages<'a>) -> Result<Vec<Sample<'a>>, ReportError> {
    let (plan, archive) = (finished.plan, finished.archive);
    let tasks = plan.tasks.iter().enumerate();
    let surfaces = tasks.filter_map(|(at, task)| match &task.recipe {
        Recipe::Generate(params) => Some((at, params)),
        _ => None,
    });
    let surfaces: Vec<_> = surfaces.collect();
    let keys = surfaces.iter().map(|(task, _)| plan.tasks[*task].key);
    let have = archive.have(&keys.collect::<Vec<_>>());
    let mut seen: Vec<ensemble::Point> = Vec::new();
    let mut first = Vec::new();
    for ((task, params), _) in surfaces.into_iter().zip(have).filter(|(_, is_there)| *is_there) {
        let point = ensemble::Point::of(params.coordinates());
        if seen.last() != Some(&point) && !seen.contains(&point) {
            seen.push(point);
            first.push((task, params));
        }
    }
    let shown = first.len().min(MOST);
    let spread = |place: usize| match shown {
        0 | 1 => 0,
        _ => place * (first.len() - 1) / (shown - 1),
    };
    let samples = (0..shown).map(|place| {
        let (task, params) = first[spread(place)];
        let table = archive.light(plan.tasks[task].key)?;
        Ok(Sample { task, params, point: ensembles::point(&table, 0) })
    });
    samples.collect()
}
