//! The tables of a study in the form that figures use: curves of ensembles, styles, notes for
//! captions, and lines of a manifest that would add a figure.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use arrow::array::{Array, Float64Array};

use crate::ReportError;
use crate::charts::chart::{DataPoint, Series};
use crate::charts::style::Style;
use crate::ensembles::{self, Bars, EnsembleCurves, Mean, Point};
use crate::finished::{FinishedStage, FinishedStages};
use crate::loads::Loads;
use crate::samples::MeasuredMaps;
use crate::styles::{Lengths, Styles};
use crate::symbols::Files;
use crate::units::{LengthUnit, Units};
use asperity_contact::grid::Grid;
use asperity_contact::morphology::area::YASTREBOV_2017;
use asperity_contact::topography::spectrum::Spectrum;
use asperity_pipeline::plan::Plan;
use asperity_stages::columns::{
    AREA_CORRECTED, AREA_FRACTION, CONTENT, HARDNESS, K_ROLLOFF, K_UPPER, LAYER_THICKNESS, LOAD,
    PERIMETER_MANHATTAN, REALIZATION, SURFACE, WORK_OF_ADHESION,
};
use asperity_stages::correct::AS_COUNTED;
use asperity_stages::surface::Origin;
use asperity_stages::{Kind, Recipe, departures, generate};
use asperity_tables::column::Role;
use asperity_tables::table::{Table, TableError};

/// Largest load that the paper calls light, in units of E* × rms slope.
pub const LIGHT: f64 = 0.06;
/// Column of the area that `measure` counts.
pub const COUNTED_AREA: &str = AREA_FRACTION.name;

/// Data from which all figures are drawn.
pub struct FigureData<'a> {
    pub finished: &'a FinishedStages<'a>,
    pub units: Units,
    pub loads: Loads,
    pub maps: MeasuredMaps,
    pub measured: Vec<EnsembleCurves<'a>>,
    pub corrected: Vec<EnsembleCurves<'a>>,
    /// Colours, markers and labels of the parameter points.
    pub styles: Styles,
    /// Names of the files of measured surfaces.
    pub files: Files,
    /// Sentences on assumptions of the theories that the study does not satisfy, or an empty text.
    pub caveat: String,
    pub bars: Bars,
    /// Keys that the manifest computes from other keys.
    pub derived: BTreeSet<String>,
}

impl<'a> FigureData<'a> {
    /// Sorts the rows of a study into ensembles.
    pub fn new(
        finished: &'a FinishedStages<'a>,
        bars: Bars,
        derived: BTreeSet<String>,
    ) -> Result<FigureData<'a>, ReportError> {
        let files = files(finished)?;
        let units = Units::from_stages(finished)?;
        let measured = curves(finished, Kind::Measure, AREA_FRACTION.name, bars)?;
        let corrected = curves(finished, Kind::Correct, AREA_CORRECTED.name, bars)?;
        let mut points: Vec<Point> = if measured.is_empty() {
            points_of_surfaces(finished)?
        } else {
            measured.iter().map(|one| one.point.clone()).collect()
        };
        // Include planned points, so later results do not change the styles of existing ones.
        if let Some(like) = points.first().cloned() {
            points.extend(planned_points(finished.plan, &like));
        }
        let styles = Styles::new(&points, &files).with_lengths(lengths(finished, &units, &points));
        Ok(FigureData {
            finished,
            maps: MeasuredMaps::read(finished, &units)?,
            loads: Loads::from_stages(finished, &units)?,
            units,
            measured,
            corrected,
            caveat: caveat(finished, &styles)?,
            styles,
            files,
            bars,
            derived,
        })
    }

    /// Returns the corrections of the study other than `none`, in order of appearance.
    pub fn corrections(&self) -> Vec<&str> {
        let mut found: Vec<&str> = Vec::new();
        for name in self.corrected.iter().filter_map(|one| one.correction.as_deref()) {
            if name != AS_COUNTED && !found.contains(&name) {
                found.push(name);
            }
        }
        found
    }

    /// Returns the ensembles with one correction.
    pub fn under(&self, correction: &str) -> impl Iterator<Item = &EnsembleCurves<'a>> {
        let wanted = move |one: &&EnsembleCurves| one.correction.as_deref() == Some(correction);
        self.corrected.iter().filter(wanted)
    }

    /// Returns the label of an ensemble in legends.
    pub fn label(&self, ensemble: &EnsembleCurves) -> String {
        let alone = if ensemble.surfaces == 1 { "the surface" } else { "mean of the surfaces" };
        self.styles.name(&ensemble.point, alone)
    }

    /// Returns the number of surfaces of each parameter point with measured contacts.
    pub fn sample(&self) -> Vec<usize> {
        let mut counts: BTreeMap<&Point, usize> = BTreeMap::new();
        for ensemble in &self.measured {
            let count = counts.entry(&ensemble.point).or_default();
            *count = ensemble.surfaces.max(*count);
        }
        counts.into_values().collect()
    }

    /// Returns a sentence with the mesh error of the counted areas, estimated from the perimeter
    /// with the correction `2017`. Returns an empty text if there are no counted areas.
    pub fn share_of_mesh(&self) -> Result<String, TableError> {
        let mut shares = Vec::new();
        for ensemble in &self.measured {
            let (areas, perimeters) =
                (ensemble.mean(COUNTED_AREA)?, ensemble.mean(PERIMETER_MANHATTAN.name)?);
            let pairs = areas.iter().zip(&perimeters);
            let distance = |mean: &Mean| (mean.load / LIGHT).ln().abs();
            let nearest = pairs.min_by(|one, other| distance(one.0).total_cmp(&distance(other.0)));
            let grid = ensembles::grid(&ensemble.point).filter(Grid::has_square_cells);
            if let (Some((area, perimeter)), Some(grid)) = (nearest, grid) {
                // S_d Δx/(L_x L_y).
                let edge = perimeter.mean / (grid.cell().size()[0] * grid.nodes()[1] as f64);
                shares.push(100.0 * YASTREBOV_2017 * edge / area.mean);
            }
        }
        let ends = [f64::min, f64::max].map(|end| shares.iter().copied().reduce(end));
        let [Some(least), Some(most)] = ends.map(|end| end.map(|end| format!("{end:.1}"))) else {
            return Ok(String::new());
        };
        let range = if least == most { least } else { format!("{least} to {most}") };
        Ok(format!(
            "According to the correction of 2017, {range} % of the counted area at the load \
             nearest to {} is an error of the mesh.",
            self.loads.text_of_reduced(self.heaviest_light_load()?),
        ))
    }

    /// Returns the largest load of the measured contacts up to [`LIGHT`]: the end of the axes of
    /// figures of light loads.
    pub fn heaviest_light_load(&self) -> Result<f64, TableError> {
        let mut heaviest = 0.0_f64;
        for ensemble in &self.measured {
            let light = up_to(LIGHT, ensemble.mean(COUNTED_AREA)?);
            heaviest = light.iter().fold(heaviest, |most, mean| most.max(mean.load));
        }
        Ok(if heaviest > 0.0 { heaviest } else { LIGHT })
    }

    /// Returns the lines of a manifest that define a stage: its header and `lines`. If the study
    /// has a stage with this name, the name is changed.
    fn stage(&self, name: &str, lines: &str) -> String {
        let stages = &self.finished.plan.stages;
        let is_taken = |name: &str| stages.iter().any(|stage| stage.name == name);
        let mut free = name.to_owned();
        while is_taken(&free) {
            free += "-2";
        }
        format!("[stage.{free}]\n{lines}")
    }

    /// Returns the name of the first stage of this kind, or `otherwise`.
    fn source(&self, kind: Kind, otherwise: &str) -> String {
        self.finished.name_of(kind).unwrap_or(otherwise).to_owned()
    }

    pub fn lines_of_loads(&self, loads: &str) -> String {
        let surfaces = self.source(Kind::Generate, "surfaces");
        let solve = format!("kind = \"solve\"\nfrom = \"{surfaces}\"\nloads = {loads}\n\n");
        let measure = "kind = \"measure\"\nfrom = \"loads\"";
        self.stage("loads", &solve) + &self.stage("contacts", measure)
    }

    pub fn lines_of_corrections(&self) -> String {
        let measured = self.source(Kind::Measure, "area");
        let lines = format!(
            "kind = \"correct\"\nfrom = \"{measured}\"\ncorrection = [\"none\", \"pi/8\", \"2017\"]"
        );
        self.stage("corrected", &lines)
    }

    /// Returns lines that give several spectra: a sweep of a cutoff in the stage that draws
    /// surfaces or, without such a stage, a new stage.
    pub fn lines_of_spectra(&self, cutoff: &str) -> String {
        let mut stages = self.finished.stages.iter();
        let drawn =
            stages.find(|stage| stage.kind == Kind::Generate && stage.table.has(K_UPPER.name));
        match drawn {
            Some(stage) => {
                let values = if cutoff == K_UPPER.name { "[8, 16, 32]" } else { "[1, 2, 4]" };
                format!("{cutoff} = {values}  # in the stage `{}`", stage.name)
            }
            None => self.lines_of_surfaces(),
        }
    }

    pub fn lines_of_heights(&self) -> String {
        let surfaces = self.source(Kind::Generate, "surfaces");
        let lines = format!(
            "kind = \"measure\"\nfrom = \"{surfaces}\"\nbins = 1000\nrange = 5.0\npool = true"
        );
        self.stage("density", &lines)
    }

    pub fn lines_of_scales(&self) -> String {
        let surfaces = self.source(Kind::Generate, "surfaces");
        let lines = format!("kind = \"measure\"\nfrom = \"{surfaces}\"\nwhat = \"scales\"");
        self.stage("slopes", &lines)
    }

    pub fn lines_of_surfaces(&self) -> String {
        let lines = "kind = \"generate\"\nnodes = 256\nhurst = 0.8\nk_lower = [1, 2, 4]\n\
                     k_upper = [8, 16, 32]\nrealizations = 50";
        self.stage("random-surfaces", lines)
    }

    /// Returns lines of a manifest that fit the error of the mesh to the same surfaces on several
    /// meshes.
    pub fn lines_of_meshes(&self) -> String {
        let measured = self.source(Kind::Measure, "area");
        let lines = format!(
            "kind = \"fit\"            # with `nodes = [128, 256, 512]` in the stage of surfaces\n\
             from = \"{measured}\"\nlaw = \"mesh-convergence\""
        );
        self.stage("regression", &lines)
    }
}

pub fn series(means: &[Mean], style: Style) -> Series {
    let points = means.iter().map(|mean| DataPoint { x: mean.load, y: mean.mean, bar: mean.bar() });
    Series { points: points.collect(), style, label: None }
}

/// Returns the interval of a row, if both ends are known.
pub fn interval(lower: &Float64Array, upper: &Float64Array, row: usize) -> Option<[f64; 2]> {
    let is_known = lower.is_valid(row) && upper.is_valid(row);
    is_known.then(|| [lower.value(row), upper.value(row)])
}

/// Returns the means up to a load.
pub fn up_to(load: f64, means: Vec<Mean>) -> Vec<Mean> {
    // Loads are read as decimals or computed in steps, so the last one may deviate by rounding.
    let is_light = |mean: &Mean| mean.load <= load * (1.0 + 1e-9);
    means.into_iter().filter(is_light).collect()
}

/// Returns the unit of the parameters that are lengths.
pub fn lengths(finished: &FinishedStages, units: &Units, points: &[Point]) -> Lengths {
    let tables = finished.stages.iter().map(|stage| &stage.table);
    let columns = tables.flat_map(|table| table.in_role(Role::Parameter).descriptions());
    let columns = columns.filter(|column| column.unit == "length").map(|column| column.name);
    let known: BTreeSet<Option<&str>> = points.iter().map(|point| units.at(point)).collect();
    let own = known.first().copied().flatten().filter(|_| known.len() == 1);
    Lengths {
        columns: columns.collect(),
        shared: LengthUnit::common([own]),
        own: own.map(str::to_owned),
    }
}

/// Returns the names of the files of measured surfaces. If two files have the same name, their
/// paths are used.
fn files(finished: &FinishedStages) -> Result<Files, TableError> {
    let mut paths = BTreeMap::new();
    for stage in finished.with(&[CONTENT.name, "path"]) {
        let [contents, known] = [CONTENT.name, "path"].map(|name| stage.table.texts(name));
        for (content, path) in contents?.iter().zip(known?) {
            if let (Some(content), Some(path)) = (content, path) {
                paths.insert(content.to_owned(), path.to_owned());
            }
        }
    }
    let name = |path: &str| {
        let name = Path::new(path).file_name();
        name.map_or_else(|| path.to_owned(), |name| name.to_string_lossy().into_owned())
    };
    let is_taken =
        |path: &str| paths.values().filter(|other| name(other) == name(path)).count() > 1;
    let called = paths.iter().map(|(content, path)| {
        let called = if is_taken(path) { path.clone() } else { name(path) };
        (content.clone(), called)
    });
    Ok(called.collect())
}

fn curves<'a>(
    finished: &'a FinishedStages<'a>,
    kind: Kind,
    area: &str,
    bars: Bars,
) -> Result<Vec<EnsembleCurves<'a>>, TableError> {
    let is_curve =
        |table: &Table| [SURFACE.name, LOAD.name, area].iter().all(|name| table.has(name));
    let is_other =
        |table: &Table| table.has(WORK_OF_ADHESION.name) || table.has(LAYER_THICKNESS.name);
    let stages = finished.stages.iter();
    let curves = stages
        .filter(|stage| stage.kind == kind && is_curve(&stage.table) && !is_other(&stage.table));
    let mut ensembles = Vec::new();
    for stage in curves {
        ensembles.extend(ensembles::from_table(&stage.table, bars)?);
    }
    Ok(ensembles)
}

/// Returns the distinct parameter points of the study's surfaces, in order of appearance, from the
/// rows of first realizations.
fn points_of_surfaces(finished: &FinishedStages) -> Result<Vec<Point>, TableError> {
    let mut points: Vec<Point> = Vec::new();
    let stages = finished.stages.iter();
    for FinishedStage { table, .. } in stages.filter(|stage| stage.kind == Kind::Generate) {
        let has_realizations = table.has(REALIZATION.name);
        let realizations =
            has_realizations.then(|| table.integers(REALIZATION.name)).transpose()?;
        let is_another =
            |row| realizations.is_some_and(|all| all.is_valid(row) && all.value(row) > 0);
        for row in (0..table.rows()).filter(|&row| row == 0 || !is_another(row)) {
            let point = ensembles::point(table, row);
            if !points.contains(&point) {
                points.push(point);
            }
        }
    }
    Ok(points)
}

/// Returns the points of all planned random spectra. Parameters that do not belong to the spectrum
/// are copied from the point `like`.
fn planned_points(plan: &Plan, like: &Point) -> Vec<Point> {
    let mut spectra: Vec<&Spectrum> = Vec::new();
    let mut points = Vec::new();
    for task in &plan.tasks {
        let Recipe::Generate(params) = &task.recipe else {
            continue;
        };
        let Origin::Random { surface, .. } = &params.origin else {
            continue;
        };
        if !spectra.contains(&&surface.spectrum) {
            spectra.push(&surface.spectrum);
            let mut point = like.clone();
            point.remove(K_ROLLOFF.name);
            point.extend(ensembles::point(&generate::own_row(&params.origin), 0));
            points.push(point);
        }
    }
    points
}

/// Largest number of parameter points that [`caveat`] names in a sentence.
const MOST_CAVEATS: usize = 4;

/// Returns sentences on assumptions of the theories that surfaces or materials do not satisfy, each
/// after a space, or an empty text.
fn caveat(finished: &FinishedStages, styles: &Styles) -> Result<String, ReportError> {
    let mut descriptions = Vec::new();
    let stages = finished.stages.iter();
    for FinishedStage { table, .. } in stages.filter(|stage| stage.kind == Kind::Generate) {
        for point in departures::points(table).map_err(ReportError::Caveats)? {
            if point.departures.is_empty() {
                continue;
            }
            let label = styles.name(&ensembles::point(&point.coordinates, 0), "these surfaces");
            let line = format!("{label} ({})", point.departures.join(", "));
            if !descriptions.contains(&line) {
                descriptions.push(line);
            }
        }
    }
    let yields = |stage: &FinishedStage| stage.table.has(HARDNESS.name);
    let of_materials = if finished.stages.iter().any(yields) {
        " The theories assume elastic contact without a hardness."
    } else {
        ""
    };
    if descriptions.is_empty() {
        return Ok(of_materials.to_owned());
    }
    let hidden = descriptions.len().saturating_sub(MOST_CAVEATS);
    descriptions.truncate(MOST_CAVEATS);
    if hidden > 0 {
        descriptions.push(format!("{hidden} more"));
    }
    Ok(format!(
        " The theories and Nayak's α assume isotropic Gaussian roughness, unlike {}.{of_materials}",
        descriptions.join("; ")
    ))
}
