//! What all figures of a study share: styles, units, and notes for captions.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use arrow::array::Array;

use crate::ReportError;
use crate::finished::{FinishedStage, FinishedStages};
use crate::loads::Loads;
use crate::points::{self, Point, as_named};
use crate::samples::{MeasuredMap, measured_maps};
use crate::styles::{Lengths, Styles};
use crate::symbols::Files;
use crate::units::{Unit, Units};
use asperity_mechanics::morphology::area::YASTREBOV_2017;
use asperity_mechanics::topography::spectrum::Spectrum;
use asperity_pipeline::study::figures::ErrorBars;
use asperity_stages::columns::{
    AREA_FRACTION, CONTENT, HARDNESS, K_ROLLOFF, LAYER_THICKNESS, LOAD, PERIMETER_MANHATTAN,
    REALIZATION, SURFACE, WORK_OF_ADHESION,
};
use asperity_stages::ensemble::{Ensemble, ensembles};
use asperity_stages::grids::Grids;
use asperity_stages::surface::Origin;
use asperity_stages::{Kind, Recipe, departures, generate};
use asperity_tables::column::{Column, Role};
use asperity_tables::table::{Table, TableError};

/// Largest load that the paper calls light, in units of E* × rms slope.
pub const LIGHT: f64 = 0.06;

/// Data from which all figures are drawn.
pub struct FigureData<'a> {
    pub finished: &'a FinishedStages<'a>,
    pub units: Units,
    pub loads: Loads,
    /// Measured surfaces, or `None` if a file is missing.
    pub maps: Option<Vec<MeasuredMap>>,
    /// Colours, markers and labels of the parameter points.
    pub styles: Styles,
    /// Names of the files of measured surfaces.
    pub files: Files,
    /// Sentences on assumptions of the theories that the study does not satisfy, or an empty text.
    pub caveat: String,
    /// Sentence on the mesh error of the counted areas, or an empty text.
    pub mesh_error: String,
    pub bars: ErrorBars,
    /// Keys that the manifest computes from other keys.
    pub derived: BTreeSet<String>,
}

impl<'a> FigureData<'a> {
    /// Reads the data from the tables of a study.
    pub fn new(
        finished: &'a FinishedStages<'a>,
        bars: ErrorBars,
        derived: BTreeSet<String>,
    ) -> Result<FigureData<'a>, ReportError> {
        let files = files(finished)?;
        let units = Units::from_stages(finished)?;
        let loads = Loads::from_stages(finished, &units)?;
        let measured = measured(finished)?;
        let mut points: Vec<Point> = match measured.is_empty() {
            true => points_of_surfaces(finished)?,
            false => measured.iter().map(|(_, ensemble)| as_named(&ensemble.point)).collect(),
        };
        // Include planned points, so later results do not change the styles of existing ones.
        if let Some(like) = points.first().cloned() {
            points.extend(planned_points(finished, &like));
        }
        let styles = Styles::new(&points, &files).with_lengths(lengths(finished, &units, &points));
        Ok(FigureData {
            finished,
            maps: measured_maps(finished, &units)?,
            mesh_error: mesh_error(&measured, &loads)?,
            loads,
            units,
            caveat: caveat(finished, &styles)?,
            styles,
            files,
            bars,
            derived,
        })
    }

    /// Returns the styles of parameter points that are not those of the page.
    pub fn styles_of(&self, points: &[Point]) -> Styles {
        let lengths = lengths(self.finished, &self.units, points);
        Styles::new(points, &self.files).with_lengths(lengths)
    }
}

/// Returns the unit of the parameters that are lengths.
pub fn lengths(finished: &FinishedStages, units: &Units, points: &[Point]) -> Lengths {
    let tables = finished.stages.iter().map(|stage| &stage.table);
    let parameters = tables.flat_map(|table| table.in_role(Role::Parameter).descriptions());
    let columns = parameters.filter(|column| column.unit == "length").map(|column| column.name);
    let known: BTreeSet<Option<&str>> = points.iter().map(|point| units.at(point)).collect();
    let own = known.first().copied().flatten().filter(|_| known.len() == 1);
    Lengths {
        columns: columns.collect(),
        shared: Unit::of_lengths([own]),
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

/// Ensembles of measured contacts in their tables.
type Measured<'a> = Vec<(&'a Table, Ensemble)>;

/// Returns the ensembles of measured contacts without adhesion and layers.
fn measured<'a>(finished: &'a FinishedStages) -> Result<Measured<'a>, TableError> {
    let mut measured = Vec::new();
    for FinishedStage { kind, table, .. } in &finished.stages {
        let is_other = table.has(WORK_OF_ADHESION.name) || table.has(LAYER_THICKNESS.name);
        let has_areas = [SURFACE, LOAD, AREA_FRACTION].iter().all(|column| table.has(column.name));
        if *kind == Kind::Measure && has_areas && !is_other {
            measured.extend(ensembles(table)?.into_iter().map(|one| (table, one)));
        }
    }
    Ok(measured)
}

/// Returns a sentence with the mesh error of the counted areas, estimated from the perimeter with
/// the correction `2017`, or an empty text if there are no counted areas.
fn mesh_error(measured: &Measured, loads: &Loads) -> Result<String, ReportError> {
    let mut shares = Vec::new();
    for (table, ensemble) in measured {
        let complete = (0..ensemble.loads.len())
            .filter_map(|index| Some((ensemble.loads[index].reduced, ensemble.complete(index)?)));
        let distance = |load: f64| (load / LIGHT).ln().abs();
        let nearest = complete.min_by(|one, other| distance(one.0).total_cmp(&distance(other.0)));
        let Some((_, rows)) = nearest else { continue };
        let grid = Grids::new(table)?.grid(rows[0]).map_err(ReportError::Surface)?;
        let sum = |column: Column| -> Result<Option<f64>, TableError> {
            let values = table.reals(column.name)?;
            Ok(rows.iter().map(|&row| values.is_valid(row).then(|| values.value(row))).sum())
        };
        let sums = sum(AREA_FRACTION)?.zip(sum(PERIMETER_MANHATTAN)?);
        if let Some((area, perimeter)) = sums.filter(|_| grid.has_square_cells()) {
            // S_d Δx/(L_x L_y).
            let edge = perimeter / (grid.cell().size()[0] * grid.nodes()[1] as f64);
            shares.push(100.0 * YASTREBOV_2017 * edge / area);
        }
    }
    let ends = [f64::min, f64::max].map(|end| shares.iter().copied().reduce(end));
    let [Some(least), Some(most)] = ends.map(|end| end.map(|end| format!("{end:.1}"))) else {
        return Ok(String::new());
    };
    let range = if least == most { least } else { format!("{least} to {most}") };
    Ok(format!(
        "According to the correction of 2017, {range} % of the counted area at the load nearest to \
         {} is an error of the mesh.",
        loads.text_of_reduced(LIGHT),
    ))
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
            let point = points::at_row(table, row);
            if !points.contains(&point) {
                points.push(point);
            }
        }
    }
    Ok(points)
}

/// Returns the points of all planned random spectra. Parameters that do not belong to the spectrum
/// are copied from the point `like`.
fn planned_points(finished: &FinishedStages, like: &Point) -> Vec<Point> {
    let mut spectra: Vec<&Spectrum> = Vec::new();
    let mut points = Vec::new();
    for task in &finished.plan.tasks {
        let Recipe::Generate(params) = &task.recipe else {
            continue;
        };
        let Origin::Random { surface, .. } = &params.origin else {
            continue;
        };
        if !spectra.contains(&&surface.spectrum) {
            spectra.push(&surface.spectrum);
            let row = finished.shown(generate::own_row(&params.origin), Kind::Generate);
            points.push(like.clone().without(&[K_ROLLOFF.name]).and(points::at_row(&row, 0)));
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
            let label = styles.name(&points::at_row(&point.coordinates, 0), "these surfaces");
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
