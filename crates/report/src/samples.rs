//! One surface of each parameter point, and the data of measured surfaces for figures.
//!
//! A page has a map, a spectrum and a distribution of heights for every measured surface that it
//! shows, even without `measure` stages. Computing them takes about a second for a map of 4096²
//! nodes. It is done for one surface at a time, and the data are reduced to the size of the
//! drawing, so a page needs the memory of one map. If a `measure` stage has computed such data,
//! they are drawn from its table.

use crate::ReportError;
use crate::charts::raster::HeightMap;
use crate::finished::FinishedStages;
use crate::points::{self, Point};
use crate::surface_curves::CurvePoint;
use crate::units::Units;
use asperity_mechanics::grid::Boundary;
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::height_distribution::Histogram;
use asperity_mechanics::topography::random::RandomSurface;
use asperity_mechanics::topography::surface::{Axis, Scan, Surface};
use asperity_mechanics::topography::{differences, power_spectrum};
use asperity_pipeline::plan::Task;
use asperity_stages::output_units::Conversion;
use asperity_stages::surface::origin::MeasuredSurface;
use asperity_stages::surface::{Heights, Origin};
use asperity_stages::units::TableUnits;
use asperity_stages::{Kind, Recipe, Stage as _, StageError, ensemble, grids, surface};
use asperity_tables::key::TaskKey;
use asperity_tables::parquet::Columns;
use asperity_tables::store::TaskTables;

/// Largest number of parameter points in one figure.
pub const MOST: usize = 9;
/// Number of nodes along the longer side of the drawing of a random surface, unless the shortest
/// wavelength needs more.
const NODES: usize = 512;

/// First surface of a parameter point.
pub struct Sample<'a> {
    pub task: usize,
    pub params: &'a surface::Params,
    pub point: Point,
}

impl Sample<'_> {
    /// Returns the factor that converts the lengths of the surface to the unit of its point.
    fn length_factor(&self, finished: &FinishedStages) -> f64 {
        let conversion = Conversion {
            from: TableUnits {
                length: Some(self.params.origin.unit().to_owned()),
                ..TableUnits::default()
            },
            to: finished.output_units.clone(),
        };
        conversion.number(1.0, "length", false)
    }

    /// Returns the description of the surface if it is measured.
    pub fn file(&self) -> Option<&MeasuredSurface> {
        match &self.params.origin {
            Origin::File(file) => Some(file),
            _ => None,
        }
    }

    /// Returns the spectrum and the realization if the surface is random.
    pub fn random(&self) -> Option<RandomSurface> {
        self.params.origin.random_surface(self.params.grid().ok()?.cell())
    }

    /// Returns the stored heights, or `None` if the store does not have them.
    pub fn kept(&self, finished: &FinishedStages) -> Result<Option<Surface>, StageError> {
        let (store, table) = (finished.archive.store(), &finished.plan.tasks[self.task].table);
        if self.params.heights != Heights::Keep || !store.has(table) {
            return Ok(None);
        }
        let table = store.read(table, Columns::All).map_err(StageError::Store)?;
        let sources = finished.sources;
        self.params.surface(&table, sources, &Threads::one()).map(Some)
    }

    /// Returns the heights. A random surface is computed on a mesh just fine enough for a picture;
    /// the modes of a surface are the same on all meshes.
    pub fn draw(&self, finished: &FinishedStages) -> Result<Surface, StageError> {
        scaled(self.drawn(finished)?, self.length_factor(finished))
    }

    fn drawn(&self, finished: &FinishedStages) -> Result<Surface, StageError> {
        match &self.params.origin {
            Origin::Random { .. } => {
                let grid = self.params.grid()?;
                let of_origin = self.params.origin.random_surface(grid.cell());
                let surface = of_origin.expect("the origin is random");
                let aspect = grid.cell().aspect();
                let waves = surface.spectrum.max_waves(grid.cell());
                let shown = [0, 1].map(|axis| {
                    let enough = (NODES as f64 / aspect[axis]).ceil() as usize;
                    grid.nodes()[axis].min(enough.max(2 * waves[axis] as usize))
                });
                let shown = grids::grid(shown, grid.cell().size())?;
                let threads = &Threads::one();
                let heights = self.params.origin.height_distribution(finished.sources, threads)?;
                Ok(surface.draw_on(threads, shown, heights.as_ref()))
            }
            _ => match self.kept(finished)? {
                Some(surface) => Ok(surface),
                None => self.params.draw(finished.sources, &Threads::one()),
            },
        }
    }
}

/// Returns the first finished surface of each parameter point, and all samples of measured ones. If
/// there are more than [`MOST`], it returns [`MOST`] evenly spread ones.
pub fn first_surfaces<'a>(finished: &FinishedStages<'a>) -> Result<Vec<Sample<'a>>, ReportError> {
    let (plan, archive) = (finished.plan, finished.archive);
    let tasks = plan.tasks.iter().enumerate();
    let of_surface = |(at, task): (usize, &'a Task)| match &task.recipe {
        // Figures of surfaces are maps; profiles have none.
        Recipe::Generate(params) => (!params.origin.is_profile()).then_some((at, params)),
        _ => None,
    };
    let surfaces: Vec<_> = tasks.filter_map(of_surface).collect();
    let tables = surfaces.iter().map(|(task, _)| &plan.tasks[*task].table);
    let have = archive.have(&tables.collect::<Vec<_>>());
    let mut seen: Vec<(ensemble::ParameterPoint, Option<TaskKey>)> = Vec::new();
    let mut first = Vec::new();
    for ((task, params), _) in surfaces.into_iter().zip(have).filter(|(_, is_there)| *is_there) {
        let is_sample = params.origin.labels().is_some_and(|labels| labels.is_sample);
        let sample = is_sample.then(|| params.surface_key());
        let point = (ensemble::ParameterPoint::from_cells(params.coordinates()), sample);
        if seen.last() != Some(&point) && !seen.contains(&point) {
            seen.push(point);
            first.push((task, params));
        }
    }
    let samples = spread(first.len(), MOST).map(|index| {
        let (task, params) = first[index];
        let table = finished.shown(archive.light(&plan.tasks[task].table)?, Kind::Generate);
        Ok(Sample { task, params, point: points::at_row(&table, 0) })
    });
    samples.collect()
}

/// Returns at most `most` of `count` indices, evenly spread, with the first and the last.
pub fn spread(count: usize, most: usize) -> impl Iterator<Item = usize> {
    let shown = count.min(most);
    (0..shown).map(move |index| index * (count - 1) / (shown - 1).max(1))
}

/// Requirement of figures of measured surfaces whose file is lost.
pub const FILE_IS_GONE: &str =
    "the file of a measured surface, which is missing or has changed; restore it";

/// Largest distance from the mean height in the height distribution, in rms heights.
pub const RANGE: f64 = 5.0;
/// Smallest and largest number of intervals of the distribution.
const BINS: [f64; 2] = [30.0, 200.0];
/// Pixels along the longer side of a map, if few maps are shown and if many are.
const PIXELS: [usize; 2] = [512, 256];
/// Largest number of maps that counts as few.
const FEW: usize = 3;

/// Data of a measured surface for figures.
#[derive(Debug)]
pub struct MeasuredMap {
    pub point: Point,
    pub unit: Option<String>,
    /// Map as measured. It is `None` if it is identical to the map for which the contact is solved,
    /// or if the file is lost and only that map was stored.
    pub as_measured: Option<AsMeasured>,
    pub pressed: HeightMap,
    /// Distribution of heights relative to their mean, in units of the rms height.
    pub histogram: Histogram,
    /// Power spectral density C(q) over rings of wavenumbers, weighted by the number of modes.
    pub spectrum: Vec<CurvePoint>,
    /// Rms slope against distance, along x and along y.
    pub slopes: [Vec<CurvePoint>; 2],
}

/// A measured map that is cropped, repaired and levelled, before missing points are filled and
/// wavelengths are filtered out.
#[derive(Debug, PartialEq)]
pub struct AsMeasured {
    pub map: HeightMap,
    /// Fraction of nodes without a measurement.
    pub missing: f64,
}

/// Returns the measured surfaces that a page shows, or `None` if a file is missing or has changed
/// and the store has no heights.
pub fn measured_maps(
    finished: &FinishedStages,
    units: &Units,
) -> Result<Option<Vec<MeasuredMap>>, ReportError> {
    let mut samples = first_surfaces(finished)?;
    samples.retain(|sample| sample.file().is_some());
    let pixels = PIXELS[usize::from(samples.len() > FEW)];
    let mut maps: Vec<MeasuredMap> = Vec::new();
    for sample in &samples {
        let Some(file) = sample.file() else { continue };
        let mut map = match MeasuredMap::read(sample, file, finished, units, pixels) {
            Ok(map) => map,
            Err(StageError::Source(_)) => return Ok(None),
            Err(error) => return Err(ReportError::Surface(error)),
        };
        // Surfaces that differ only in later steps of the preparation share the measured map.
        if maps.iter().any(|known| known.as_measured == map.as_measured) {
            map.as_measured = None;
        }
        maps.push(map);
    }
    Ok(Some(maps))
}

impl MeasuredMap {
    fn read(
        sample: &Sample,
        file: &MeasuredSurface,
        finished: &FinishedStages,
        units: &Units,
        pixels: usize,
    ) -> Result<MeasuredMap, StageError> {
        let sources = finished.sources;
        let kept = sample.kept(finished)?;
        let scan = match file.scan(sample.params.sides(), sources) {
            Err(StageError::Source(_)) if kept.is_some() => None,
            read => Some(read?.0),
        };
        let levelled = scan.clone().map(|scan| file.preparation.levelled(scan, file.edges));
        let surface = match (kept, scan) {
            (Some(surface), _) => surface,
            (None, Some(scan)) => file.prepare(scan, sources)?.surface,
            (None, None) => unreachable!("without kept heights an unread file is an error"),
        };
        let as_measured = levelled
            .and_then(Result::ok)
            .map(|levelled| levelled.scan)
            .filter(|scan| is_other(scan, &surface));
        let factor = sample.length_factor(finished);
        let surface = scaled(surface, factor)?;
        let boundary =
            if sample.params.origin.is_open() { Boundary::Free } else { Boundary::Periodic };
        let longer_side = surface.grid().cell().longer_side();
        let rings = power_spectrum::rings(&surface, boundary).into_iter();
        Ok(MeasuredMap {
            point: sample.point.clone(),
            unit: units.at(&sample.point).map(str::to_owned),
            as_measured: as_measured.map(|scan| AsMeasured {
                map: shown(&scan, pixels, factor),
                missing: scan.missing() as f64 / scan.grid().count() as f64,
            }),
            pressed: shown(&surface.clone().into(), pixels, 1.0),
            histogram: Histogram::from_surface(&surface, bins(surface.grid().count()), RANGE),
            spectrum: rings
                .map(|ring| CurvePoint {
                    x: ring.wavenumber(longer_side),
                    y: ring.density,
                    weight: f64::from(ring.modes),
                })
                .collect(),
            slopes: Axis::BOTH.map(|axis| slopes(&surface, axis, boundary)),
        })
    }
}

/// Returns a map of at most `pixels` pixels, with lengths that are multiplied by `factor`.
fn shown(scan: &Scan, pixels: usize, factor: f64) -> HeightMap {
    let grid = scan.grid();
    let heights: Vec<f64> = scan.heights().iter().map(|height| factor * height).collect();
    let size = grid.cell().size().map(|side| factor * side);
    HeightMap::new(grid.nodes(), size, &heights, pixels)
}

/// Returns a surface whose lengths are multiplied by a factor.
fn scaled(surface: Surface, factor: f64) -> Result<Surface, StageError> {
    if factor == 1.0 {
        return Ok(surface);
    }
    let grid = surface.grid();
    let grid = grids::grid(grid.nodes(), grid.cell().size().map(|side| factor * side))?;
    let mut heights = surface.into_heights();
    heights.iter_mut().for_each(|height| *height *= factor);
    Surface::new(grid, heights).map_err(StageError::Heights)
}

/// Returns true if a map has other heights than the surface, or missing points.
fn is_other(scan: &Scan, surface: &Surface) -> bool {
    scan.heights() != surface.heights()
}

/// Returns the number of intervals of the distribution for the heights of `nodes` nodes. Their
/// width, 3.49 rms heights divided by the cube root of `nodes`, minimises the error of the density
/// of a Gaussian (Scott 1979, doi:10.1093/biomet/66.3.605).
fn bins(nodes: usize) -> usize {
    let width = 3.49 / (nodes as f64).cbrt();
    (2.0 * RANGE / width).round().clamp(BINS[0], BINS[1]) as usize
}

fn slopes(surface: &Surface, axis: Axis, boundary: Boundary) -> Vec<CurvePoint> {
    let step = axis.select(surface.grid().spacing());
    let scales = differences::along(surface, axis, boundary).into_iter();
    let slopes = scales.map(|scale| CurvePoint {
        x: step * scale.steps as f64,
        y: scale.slope,
        weight: 1.0,
    });
    slopes.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_and_the_last_are_shown_and_each_at_most_once() {
        for count in [1, 2, 8, 9, 10, 90] {
            let steps: Vec<usize> = spread(count, MOST).collect();
            assert_eq!(steps.len(), count.min(MOST));
            assert_eq!([steps[0], *steps.last().unwrap()], [0, count - 1]);
            assert!(steps.is_sorted_by(|one, next| one < next), "{steps:?}");
        }
        assert_eq!(spread(0, MOST).count(), 0);
    }
}
