//! A study's tables as figures need them: curves of ensembles, and how their points look.

use super::ensembles::{self, Ensemble, Mean, Point};
use super::looks::Looks;
use super::tables::Finished;
use crate::figures::chart::{Point as Place, Series, Style};
use crate::stages::Kind;
use crate::stages::columns::{AREA_CORRECTED, AREA_FRACTION, LOAD, METHOD, SURFACE};
use crate::store::table::{Table, TableError};

/// The heaviest load that the paper calls light.
pub const LIGHT: f64 = 0.06;
/// Says what the load is measured in.
pub const LOAD_LABEL: &str = "load p₀/(E* h′)";
/// The share of the nominal area that touches.
pub const AREA_LABEL: &str = "contact area A/A₀";
/// What `measure` counts.
pub const COUNTED: &str = AREA_FRACTION.name;

/// What figures are drawn from.
pub struct Evidence<'a> {
    /// The tables.
    pub finished: &'a Finished<'a>,
    /// Measured contacts.
    pub measured: Vec<Ensemble<'a>>,
    /// Corrected areas.
    pub corrected: Vec<Ensemble<'a>>,
    /// Colours, markers and labels of the study's points.
    pub looks: Looks,
}

impl<'a> Evidence<'a> {
    /// Sorts the rows of a study by ensembles.
    ///
    /// # Errors
    /// When a table lacks a column that its kind of stage writes.
    pub fn of(finished: &'a Finished<'a>) -> Result<Evidence<'a>, TableError> {
        let measured = curves(finished, Kind::Measure, AREA_FRACTION.name)?;
        let corrected = curves(finished, Kind::Correct, AREA_CORRECTED.name)?;
        let looks = match measured.is_empty() {
            false => Looks::of(measured.iter().map(|ensemble| &ensemble.point)),
            true => Looks::of(&points_of_surfaces(finished)),
        };
        Ok(Evidence {
            finished,
            measured,
            corrected,
            looks,
        })
    }

    /// The corrections of the study that change the counted area, in order of appearance.
    pub fn corrections(&self) -> Vec<&str> {
        let mut found: Vec<&str> = Vec::new();
        for name in self
            .corrected
            .iter()
            .filter_map(|one| one.correction.as_deref())
        {
            if name != "none" && !found.contains(&name) {
                found.push(name);
            }
        }
        found
    }

    /// The ensembles under one correction.
    pub fn under(&self, correction: &str) -> impl Iterator<Item = &Ensemble<'a>> {
        let wanted = move |one: &&Ensemble| one.correction.as_deref() == Some(correction);
        self.corrected.iter().filter(wanted)
    }

    /// A mean curve with standard errors, as separate points under the ensemble's name.
    pub fn points(&self, ensemble: &Ensemble, means: &[Mean]) -> Series {
        series(means, self.looks.markers(&ensemble.point)).named(self.looks.label(&ensemble.point))
    }

    /// How many surfaces each of the measured ensembles has.
    pub fn sample(&self) -> Vec<usize> {
        self.measured
            .iter()
            .map(|ensemble| ensemble.surfaces)
            .collect()
    }
}

/// A mean curve with standard errors.
pub fn series(means: &[Mean], style: Style) -> Series {
    let points = means.iter().map(|mean| Place {
        x: mean.load,
        y: mean.mean,
        bar: mean.bar(),
    });
    Series {
        points: points.collect(),
        style,
        label: None,
    }
}

/// The means up to a load.
pub fn up_to(load: f64, means: Vec<Mean>) -> Vec<Mean> {
    // Loads are read from decimals and computed in steps: the last one may miss by rounding.
    let is_light = |mean: &Mean| mean.load <= load * (1.0 + 1e-9);
    means.into_iter().filter(is_light).collect()
}

fn curves<'a>(
    finished: &'a Finished<'a>,
    kind: Kind,
    area: &str,
) -> Result<Vec<Ensemble<'a>>, TableError> {
    let is_curve = |table: &Table| {
        [SURFACE.name, LOAD.name, area]
            .iter()
            .all(|name| table.has(name))
    };
    let stages = finished.stages.iter();
    let curves = stages.filter(|stage| stage.kind == kind && is_curve(&stage.table));
    let mut ensembles = Vec::new();
    for stage in curves {
        ensembles.extend(ensembles::of(&stage.table)?);
    }
    Ok(ensembles)
}

/// The distinct points of the study's surfaces, in order of appearance.
fn points_of_surfaces(finished: &Finished) -> Vec<Point> {
    let mut points: Vec<Point> = Vec::new();
    for stage in finished
        .stages
        .iter()
        .filter(|stage| stage.table.has(METHOD.name))
    {
        for row in 0..stage.table.rows() {
            let point = ensembles::point(&stage.table, row);
            if points.last() != Some(&point) && !points.contains(&point) {
                points.push(point);
            }
        }
    }
    points
}
