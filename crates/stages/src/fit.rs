//! Stages that fit laws to single parameter points, and limits of observables to all points.

pub mod contact_evolution;
pub mod fitted_point;
pub mod keys;
pub mod laws;
pub mod limits;
pub mod meshes;
pub mod percolation;
pub mod rows;
mod spectra;
pub mod status;

use std::borrow::Cow;

use arrow::array::Float64Array;
use serde::Serialize;

use crate::columns::{AREA_CORRECTED, AREA_FRACTION, CORRECTION, MEAN_GAP, STOP};
use crate::ensemble::{Ensemble, Member, ensembles};
use crate::fit::contact_evolution::{EvolutionChoices, Kappa};
use crate::fit::fitted_point::{FitParameter, FittedPoint};
use crate::fit::laws::{FitOfCurves, Fits, Law};
use crate::fit::status::STATUS;
use crate::solve::is_unconverged;
use crate::stage::{number, range};
use crate::version::Version;
use crate::{
    Context, Definition, Effort, Extent, Input, InputScope, Kind, Reads, RowKind, Stage,
    StageError, stacked,
};
use asperity_manifest::diagnostics::counted;
use asperity_statistics::FitError;
use asperity_statistics::bootstrap::Bootstrap;
use asperity_statistics::curves::{Curves, Window};
use asperity_tables::column::{Column, Role, absolute_column};
use asperity_tables::source::TableSource;
use asperity_tables::table::{Table, TableError};

pub use status::FITTED;

/// Version of the computed numbers, part of the key of every stored result. Raise it whenever the
/// numbers change.
pub const VERSION: Version = Version::new(8, &[]);

/// Definition of the kind of stage `fit`.
pub const STAGE: Definition = Definition {
    name: "fit",
    version: VERSION,
    reads: Reads {
        rows: &[RowKind::Contacts, RowKind::Corrections],
        from: Cow::Borrowed("either `measure` stages that read `solve` stages or `correct` stages"),
    },
    row_kind: |_| Some(RowKind::Fits),
    columns,
    summary: |source, _| Ok(summary(source)?.into_iter().flatten().collect()),
};

/// Law and data of one fit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Params {
    #[serde(flatten)]
    pub law: Law,
    /// Smallest and largest load of the fitted data, in units of E* × rms slope.
    pub window: [f64; 2],
    /// Number of bootstrap resamplings of surfaces; 0 for no intervals.
    pub bootstrap: u32,
    /// Confidence level of the intervals.
    pub level: f64,
    pub seed: u64,
}

impl Params {
    /// Returns the settings of the bootstrap.
    pub fn bootstrap(&self) -> Bootstrap {
        Bootstrap { replicates: self.bootstrap as usize, seed: self.seed, level: self.level }
    }

    /// Returns the range of the loads of the fitted data.
    pub fn window(&self) -> Window {
        let [from, to] = self.window;
        Window { from, to }
    }
}

/// Returns the columns that fits may add to the parameter columns of the fitted points.
pub fn columns() -> Vec<Column> {
    let plain = rows::columns(laws::parameters()).into_iter();
    plain.chain(meshes::COLUMNS).chain(limits::columns::columns()).collect()
}

impl Stage for Params {
    fn kind(&self) -> Kind {
        Kind::Fit
    }

    /// Fits every parameter point in the inputs. The row of a failed fit gives the reason.
    fn run(&self, inputs: &[Input], _: &Context) -> Result<Table, StageError> {
        let tables: Vec<Table> = inputs.iter().map(|input| input.table.clone()).collect();
        Ok(fitted(self, &Table::stack(&tables)?)?)
    }

    fn empty_table(&self, inputs: &[(String, Table)]) -> Result<Table, StageError> {
        Ok(fitted(self, &stacked(inputs)?)?)
    }

    fn columns_depend_on_params(&self) -> bool {
        true
    }

    fn input_scope(&self) -> InputScope {
        let law = match &self.law {
            Law::ContactEvolution(law) => return law.input_scope(),
            Law::Limits(_) => return InputScope::All,
            Law::Plain(law) => law.definition(),
        };
        match law.fits {
            Fits::Areas(_) | Fits::Gaps(_) | Fits::Percolation | Fits::Spectra => {
                InputScope::ParameterPoint
            }
            Fits::Meshes => InputScope::All,
        }
    }

    /// Estimates the time of the resamplings.
    ///
    /// An iteration of least squares takes a microsecond per row. A simultaneous fit of all curves
    /// takes thirty times as long as a fit of one curve, because it finds a root for each curve.
    /// With free κ a fit needs dozens of iterations, or hundreds if the data are almost straight.
    fn effort(&self, extent: Extent) -> Effort {
        let replicate = match &self.law {
            Law::Limits(choices) => {
                let loads = choices.loads.len().max(extent.rows.min(1));
                1e-4 * (choices.combinations().len() * loads) as f64
            }
            _ if self.input_scope() == InputScope::All => 3e-3,
            Law::ContactEvolution(EvolutionChoices { kappa: Kappa::Free, .. }) => {
                1e-4 * extent.rows as f64
            }
            _ => 1e-4 + 3e-6 * extent.rows as f64,
        };
        Effort::seconds(replicate * f64::from(self.bootstrap))
    }
}

fn summary(source: &TableSource) -> Result<Vec<Option<String>>, StageError> {
    let table = source.table().map_err(StageError::Store)?;
    let status = table.texts(STATUS.name)?;
    let among = |word: &str| status.iter().filter(|status| *status == Some(word)).count();
    let mut parts = vec![Some(counted(table.rows(), "fit"))];
    parts.extend(status::CODES.iter().skip(1).map(|code| match among(code.word) {
        0 => None,
        count => Some(format!("{count} {}", code.word)),
    }));
    for parameter in laws::parameters() {
        if let Some(label) = parameter.label {
            let values = range(source, parameter.value.name, label)?;
            let interval = interval_of_only_fit(&table, parameter);
            parts.push(values.map(|values| values + &interval));
        }
    }
    Ok(parts)
}

/// Returns the interval of a parameter as ` [0.078, 0.770]`, or an empty text if the table has
/// several fits or no interval.
fn interval_of_only_fit(table: &Table, parameter: FitParameter) -> String {
    let [_, lower, upper, _] = parameter.columns();
    let schema = table.batch().schema();
    let end =
        |column: Column| table.reals(absolute_column(&schema, column.name)).ok()?.iter().next()?;
    match (end(lower), end(upper)) {
        (Some(lower), Some(upper)) if table.rows() == 1 => {
            format!(" [{}, {}]", number(lower), number(upper))
        }
        _ => String::new(),
    }
}

/// Fits every parameter point in a table.
///
/// # Errors
/// Returns an error if the table lacks the columns that the law reads.
pub fn fitted(params: &Params, table: &Table) -> Result<Table, TableError> {
    let each = |points: Vec<CurvesOfPoint>, fit: FitOfCurves| {
        let rows = points.iter().map(|point| point.fit(|curves| fit(curves, params)));
        (rows.collect::<Vec<FittedPoint>>(), points)
    };
    let (rows, points) = match &params.law {
        Law::Limits(choices) => return limits::run(table, choices, params),
        Law::ContactEvolution(law) => {
            let points = CurvesOfPoint::areas(table)?;
            (law.fits(&points, params), points)
        }
        Law::Plain(law) => match law.definition().fits {
            Fits::Areas(fit) => each(CurvesOfPoint::areas(table)?, fit),
            Fits::Gaps(fit) => each(CurvesOfPoint::from_column(table, MEAN_GAP.name)?, fit),
            Fits::Meshes => return meshes::run(table, params),
            Fits::Percolation => return percolation::run(table, params),
            Fits::Spectra => return spectra::run(table, params),
        },
    };
    let completed = rows.into_iter().zip(&points).map(|(row, point)| FittedPoint {
        unconverged: point.unconverged,
        ..row.unless_unbounded()
    });
    let rows: Vec<FittedPoint> = completed.collect();
    let fitted: Vec<(usize, usize)> =
        points.iter().map(|point| (point.row, point.members.len())).collect();
    Ok(rows::table(&table.in_role(Role::Parameter), &fitted, params, &rows))
}

/// Curves of a quantity against the load, for all surfaces of one parameter point under one
/// correction of the area.
pub struct CurvesOfPoint {
    /// Index of the table row from which the parameters of the point are copied.
    pub row: usize,
    /// Name of the correction, if areas are corrected.
    pub correction: Option<String>,
    /// Surfaces in the order of the curves.
    pub members: Vec<Member>,
    /// Number of rows whose load did not converge.
    pub unconverged: usize,
    /// Fitted quantity at the loads at which all surfaces have a row, or an error if there are no
    /// such loads.
    pub curves: Result<Curves, FitError>,
}

impl CurvesOfPoint {
    /// Reads the curves of the corrected area, or of the counted area if areas are not corrected.
    /// Points come in the order of their first rows.
    ///
    /// # Errors
    /// Returns an error if a column is missing.
    pub fn areas(table: &Table) -> Result<Vec<CurvesOfPoint>, TableError> {
        let area = if table.has(CORRECTION.name) { AREA_CORRECTED } else { AREA_FRACTION };
        CurvesOfPoint::from_column(table, area.name)
    }

    /// Reads the curves of a column of numbers. Points come in the order of their first rows.
    ///
    /// # Errors
    /// Returns an error if a column is missing.
    pub fn from_column(table: &Table, column: &str) -> Result<Vec<CurvesOfPoint>, TableError> {
        let corrections = table.optional(CORRECTION.name, Table::texts)?;
        let values = table.reals(column)?;
        let stops = table.texts(STOP.name)?;
        let points = ensembles(table)?.into_iter().map(|ensemble| CurvesOfPoint {
            row: ensemble.first,
            correction: corrections.map(|names| names.value(ensemble.first).to_owned()),
            members: ensemble.members.clone(),
            unconverged: ensemble
                .states()
                .filter(|&(_, _, row)| is_unconverged(stops.value(row)))
                .count(),
            curves: curves(&ensemble, values),
        });
        Ok(points.collect())
    }

    /// Fits a law to the curves. If there are no curves or the fit fails, the `failure` gives
    /// the reason.
    pub fn fit(&self, law: impl FnOnce(&Curves) -> Result<FittedPoint, FitError>) -> FittedPoint {
        let curves = self.curves.as_ref().map_err(Clone::clone);
        let fitted = curves.and_then(law);
        fitted.unwrap_or_else(|error| FittedPoint::failed(&error))
    }
}

/// Returns the curves at the loads at which all surfaces have a row. A mean over some surfaces
/// would belong to another ensemble.
fn curves(ensemble: &Ensemble, values: &Float64Array) -> Result<Curves, FitError> {
    let indexed = ensemble.loads.iter().enumerate();
    let complete =
        indexed.filter_map(|(index, load)| Some((load.reduced, ensemble.complete(index)?)));
    let (loads, rows): (Vec<f64>, Vec<Vec<usize>>) = complete.unzip();
    let curve = |member: usize| rows.iter().map(|rows| values.value(rows[member])).collect();
    Curves::new(loads, (0..ensemble.members.len()).map(curve).collect())
}

#[cfg(test)]
mod tests {
    use arrow::array::Array;

    use super::contact_evolution::Datum;
    use super::*;
    use crate::columns::{AREA_FRACTION, LOAD, STOP, SURFACE};
    use asperity_mechanics::theory::law::ContactEvolution;
    use asperity_tables::column::{Column, ColumnKind, reals, texts};

    const HURST: Column = Column::parameter("hurst", ColumnKind::Real, "1", "Hurst exponent");

    #[test]
    fn a_fit_that_did_not_converge_is_counted_and_has_no_values() {
        let loads: Vec<f64> = (1..=20).map(|i| 0.003 * f64::from(i)).collect();
        let law = ContactEvolution { kappa: 2.75, beta: 1.2, mu: 0.6 };
        let of_a_law = loads.iter().map(|&load| law.area(load));
        // Its slope at first touch is infinite.
        let of_a_power = loads.iter().map(|load| 2.0 * load.powf(0.9));
        let measured = Table::new(
            40,
            vec![
                (SURFACE, texts([["one"; 20], ["two"; 20]].concat())),
                (HURST, reals([[0.3; 20], [0.8; 20]].concat())),
                (LOAD, reals([loads.clone(), loads.clone()].concat())),
                (AREA_FRACTION, reals(of_a_law.chain(of_a_power))),
                (STOP, texts(["converged"; 40])),
            ],
        );
        let free = Params {
            law: Law::ContactEvolution(EvolutionChoices { to: Datum::Area, kappa: Kappa::Free }),
            window: [0.0, 1.0],
            bootstrap: 0,
            level: 0.95,
            seed: 0,
        };
        let table = fitted(&free, &measured).unwrap();
        for name in ["kappa", "beta", "mu", "rms_residual", "r_squared"] {
            assert_eq!(table.reals(name).unwrap().null_count(), 1, "{name}");
        }
        let parts: Vec<String> = summary(&table.into()).unwrap().into_iter().flatten().collect();
        let expected = ["2 fits", "1 not-converged", "κ 2.7500", "β 1.2000", "μ 0.6000"];
        assert_eq!(parts, expected);
    }
}
