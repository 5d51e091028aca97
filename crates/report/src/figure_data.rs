//! A study's tables as figures need them: curves of ensembles, and how their points look.

use std::collections::BTreeMap;
use std::path::Path;

use arrow::array::Array;

use super::ReportError;
use super::bars::Bars;
use super::caveat::caveat;
use super::ensembles::{self, EnsembleCurves, Mean, Point};
use super::measured::MeasuredMaps;
use super::styles::{Files, Styles};
use super::tables::{FinishedStage, FinishedStages};
use super::units::Units;
use crate::charts::chart::{DataPoint, Series};
use crate::charts::style::Style;
use asperity_contact::topography::spectrum::Spectrum;
use asperity_pipeline::plan::Plan;
use asperity_stages::columns::{
    AREA_CORRECTED, AREA_FRACTION, CONTENT, K_ROLLOFF, LOAD, REALIZATION, SURFACE,
};
use asperity_stages::correct::AS_COUNTED;
use asperity_stages::generate;
use asperity_stages::generate::Origin;
use asperity_stages::{Kind, Recipe};
use asperity_tables::table::{Table, TableError};

/// The heaviest load that the paper calls light.
pub const LIGHT: f64 = 0.06;
/// Says what the load is measured in.
pub const LOAD_LABEL: &str = "load p₀/(E* h′)";
/// The share of the nominal area that touches.
pub const AREA_LABEL: &str = "contact area A/A₀";
/// What `measure` counts.
pub const COUNTED_AREA: &str = AREA_FRACTION.name;

/// What figures are drawn from.
pub struct FigureData<'a> {
    /// The tables.
    pub finished: &'a FinishedStages<'a>,
    /// Units of length.
    pub units: Units,
    /// Maps of measured surfaces.
    pub maps: MeasuredMaps,
    /// Measured contacts.
    pub measured: Vec<EnsembleCurves<'a>>,
    /// Corrected areas.
    pub corrected: Vec<EnsembleCurves<'a>>,
    /// Colours, markers and labels of the study's points.
    pub styles: Styles,
    /// What the files of measured surfaces are called.
    pub files: Files,
    /// Of which surfaces the theories do not speak: a sentence, or nothing.
    pub caveat: String,
    /// What error bars are.
    pub bars: Bars,
}

impl<'a> FigureData<'a> {
    /// Sorts the rows of a study by ensembles.
    ///
    /// # Errors
    /// When a table lacks a column that its kind of stage writes.
    pub fn of(finished: &'a FinishedStages<'a>, bars: Bars) -> Result<FigureData<'a>, ReportError> {
        let files = files(finished)?;
        let units = Units::of(finished)?;
        let measured = curves(finished, Kind::Measure, AREA_FRACTION.name, bars)?;
        let corrected = curves(finished, Kind::Correct, AREA_CORRECTED.name, bars)?;
        let mut points: Vec<Point> = match measured.is_empty() {
            false => measured.iter().map(|one| one.point.clone()).collect(),
            true => points_of_surfaces(finished)?,
        };
        // What is still to come must not change the styles of what is there.
        if let Some(like) = points.first().cloned() {
            points.extend(planned_points(finished.plan, &like));
        }
        let styles = Styles::of(&points, &files);
        Ok(FigureData {
            finished,
            maps: MeasuredMaps::of(finished, &units)?,
            units,
            measured,
            corrected,
            caveat: caveat(finished, &styles)?,
            styles,
            files,
            bars,
        })
    }

    /// The corrections of the study that change the counted area, in order of appearance.
    pub fn corrections(&self) -> Vec<&str> {
        let mut found: Vec<&str> = Vec::new();
        for name in self.corrected.iter().filter_map(|one| one.correction.as_deref()) {
            if name != AS_COUNTED && !found.contains(&name) {
                found.push(name);
            }
        }
        found
    }

    /// The ensembles under one correction.
    pub fn under(&self, correction: &str) -> impl Iterator<Item = &EnsembleCurves<'a>> {
        let wanted = move |one: &&EnsembleCurves| one.correction.as_deref() == Some(correction);
        self.corrected.iter().filter(wanted)
    }

    /// A mean curve with its error bars, as separate points under the ensemble's name.
    pub fn points(&self, ensemble: &EnsembleCurves, means: &[Mean]) -> Series {
        series(means, self.styles.markers(&ensemble.point)).named(self.label(ensemble))
    }

    /// What an ensemble is called in legends.
    pub fn label(&self, ensemble: &EnsembleCurves) -> String {
        let label = self.styles.label(&ensemble.point);
        label.unwrap_or_else(|| match ensemble.surfaces {
            1 => "the surface".to_owned(),
            _ => "mean of the surfaces".to_owned(),
        })
    }

    /// How many surfaces each of the measured ensembles has.
    pub fn sample(&self) -> Vec<usize> {
        self.measured.iter().map(|ensemble| ensemble.surfaces).collect()
    }
}

/// A mean curve with its error bars.
pub fn series(means: &[Mean], style: Style) -> Series {
    let points = means.iter().map(|mean| DataPoint { x: mean.load, y: mean.mean, bar: mean.bar() });
    Series { points: points.collect(), style, label: None }
}

/// Fewer of the means: where a line joins all of them, markers at least `step` apart do.
pub fn spaced(step: f64, means: &[Mean]) -> Vec<Mean> {
    apart(means, |last| last + step)
}

/// The same on an axis of logarithms, at least a factor apart.
pub fn spaced_by(factor: f64, means: &[Mean]) -> Vec<Mean> {
    apart(means, |last| last * factor)
}

fn apart(means: &[Mean], next: impl Fn(f64) -> f64) -> Vec<Mean> {
    let mut apart: Vec<Mean> = Vec::new();
    for mean in means {
        if apart.last().is_none_or(|last| mean.load >= next(last.load)) {
            apart.push(*mean);
        }
    }
    apart
}

/// The means up to a load.
pub fn up_to(load: f64, means: Vec<Mean>) -> Vec<Mean> {
    // Loads are read from decimals and computed in steps: the last one may miss by rounding.
    let is_light = |mean: &Mean| mean.load <= load * (1.0 + 1e-9);
    means.into_iter().filter(is_light).collect()
}

/// What the files of measured surfaces are called: by their names, or by their paths where two have
/// the same name.
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
    let stages = finished.stages.iter();
    let curves = stages.filter(|stage| stage.kind == kind && is_curve(&stage.table));
    let mut ensembles = Vec::new();
    for stage in curves {
        ensembles.extend(ensembles::of(&stage.table, bars)?);
    }
    Ok(ensembles)
}

/// The distinct points of the study's surfaces, in order of appearance; their first realizations
/// stand for all.
fn points_of_surfaces(finished: &FinishedStages) -> Result<Vec<Point>, TableError> {
    let mut points: Vec<Point> = Vec::new();
    let stages = finished.stages.iter();
    for FinishedStage { table, .. } in stages.filter(|stage| stage.kind == Kind::Generate) {
        let has_realizations = table.has(REALIZATION.name);
        let realizations = has_realizations.then(|| table.integers(REALIZATION.name));
        let realizations = realizations.transpose()?;
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

/// The spectra of all random surfaces of a study, with what else they share with a point of it.
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
