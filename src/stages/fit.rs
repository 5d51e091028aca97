//! Fits laws to the pooled surfaces of one parameter point.

use serde::Serialize;

use super::columns::MEAN_GAP;
use super::summary::range;
use super::{
    Context, Definition, Effort, Extent, Input, Kind, Reach, Reads, Rows, Stage, StageError,
    stacked,
};
use crate::diagnostics::counted;
use crate::fitting::FitError;
use crate::fitting::bootstrap::{Bootstrap, Interval, Intervals};
use crate::fitting::convexity::CommonKappa;
use crate::fitting::curves::{Curves, Window};
use crate::fitting::evolution::{self, EvolutionFit, EvolutionProblem, Quantity};
use crate::fitting::load_separation::LoadSeparationProblem;
use crate::fitting::pressure_growth::PressureGrowthProblem;
use crate::fitting::scaled_erf::ScaledErfProblem;
use crate::store::column::Column;
use crate::store::table::{Table, TableError};

pub mod meshes;
pub mod points;
pub mod rows;

use points::Point;
use rows::{FITTED, Row, STATUS};

/// Raise it when the numbers change, or what columns say of themselves.
pub const VERSION: u32 = 3;

/// Fits laws to the pooled surfaces of one parameter point.
pub const STAGE: Definition = Definition {
    name: "fit",
    version: VERSION,
    reads: Reads {
        rows: &[Rows::Contacts, Rows::Corrections],
        from: "either `measure` stages that read contacts or `correct` stages",
    },
    makes: |_| Some(Rows::Fits),
    columns,
    summary: |table| Ok(summary(table)?.into_iter().flatten().collect()),
};

/// One fit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Params {
    /// Which law.
    #[serde(flatten)]
    pub law: Law,
    /// Smallest and largest load that count, in units of E* × rms slope.
    pub window: [f64; 2],
    /// Resamplings of whole surfaces; 0 for no intervals.
    pub bootstrap: u32,
    /// Probability that an interval covers its parameter.
    pub level: f64,
    /// Seed of the resampling.
    pub seed: u64,
}

/// A law and what is free in it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "law", rename_all = "kebab-case")]
pub enum Law {
    /// The contact evolution law of Yastrebov, Anciaux & Molinari (2015).
    ContactEvolution {
        /// What the residuals are taken of.
        to: Datum,
        /// What is known of κ.
        kappa: Kappa,
    },
    /// dp̄/dp₀ = β a^(μ − 1).
    MeanPressure,
    /// a = erf(β √2 y), near full contact.
    ScaledErf,
    /// p₀ = p_c exp(−ū/u₀), of the mean gap ū.
    LoadSeparation,
    /// A_N = A* + c S_d Δx, over meshes of the same surfaces.
    MeshConvergence,
}

/// What a fit compares.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Datum {
    /// The slope of the mean curve, by differences.
    Slope,
    /// The mean curve.
    Area,
}

/// What is known of κ.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kappa {
    /// Its value.
    Given(f64),
    /// Nothing: it is fitted too.
    Free,
    /// The smallest one for which the slopes of all curves of the stage are convex.
    MinimalConvex,
}

impl Params {
    /// Whether one task needs every parameter point at once.
    fn pools_all_points(&self) -> bool {
        matches!(
            self.law,
            Law::MeshConvergence
                | Law::ContactEvolution {
                    kappa: Kappa::MinimalConvex,
                    ..
                }
        )
    }

    fn bootstrap(&self) -> Bootstrap {
        Bootstrap {
            replicates: self.bootstrap as usize,
            seed: self.seed,
            level: self.level,
        }
    }

    fn window(&self) -> Window {
        let [from, to] = self.window;
        Window { from, to }
    }
}

impl From<Datum> for Quantity {
    fn from(datum: Datum) -> Quantity {
        match datum {
            Datum::Slope => Quantity::Slope,
            Datum::Area => Quantity::Area,
        }
    }
}

/// Every column that a fit may add to the coordinates of its points.
pub fn columns() -> Vec<Column> {
    rows::columns().into_iter().chain(meshes::COLUMNS).collect()
}

impl Stage for Params {
    fn kind(&self) -> Kind {
        Kind::Fit
    }

    /// Fits every parameter point among the inputs' rows; a fit that fails is a row that says why.
    fn run(&self, inputs: &[Input], _: &Context) -> Result<Table, StageError> {
        let tables: Vec<Table> = inputs.iter().map(|input| input.table.clone()).collect();
        Ok(fitted(self, &Table::stack(&tables)?)?)
    }

    fn empty_table(&self, inputs: &[(String, Table)]) -> Result<Table, StageError> {
        Ok(fitted(self, &stacked(inputs)?)?)
    }

    fn has_columns_of_its_own(&self) -> bool {
        true
    }

    fn reach(&self) -> Reach {
        match self.pools_all_points() {
            true => Reach::All,
            false => Reach::Point,
        }
    }

    /// An iteration of least squares takes a microsecond for each row, and a fit of all curves at
    /// once, with a root to find in each, thirty times as long as that of one. With κ free there are
    /// dozens of iterations to a fit, or hundreds where the data hardly bend; the plan cannot know how
    /// many.
    fn effort(&self, extent: Extent) -> Effort {
        let has_free_kappa = matches!(
            self.law,
            Law::ContactEvolution {
                kappa: Kappa::Free,
                ..
            }
        );
        let replicate = match has_free_kappa {
            _ if self.pools_all_points() => 3e-3,
            true => 1e-4 * extent.rows as f64,
            false => 1e-4 + 3e-6 * extent.rows as f64,
        };
        Effort::seconds(replicate * f64::from(self.bootstrap))
    }
}

fn summary(table: &Table) -> Result<Vec<Option<String>>, TableError> {
    let status = table.texts(STATUS.name)?;
    let among = |word: &str| status.iter().filter(|status| *status == Some(word)).count();
    let astray = among(&FitError::NotConverged.to_string());
    let failed = table.rows() - among(FITTED) - astray;
    let mut parts = vec![
        Some(counted(table.rows(), "fit")),
        (astray > 0).then(|| format!("{astray} did not converge")),
        (failed > 0).then(|| format!("{failed} failed, see `status`")),
    ];
    for (name, label) in [
        ("kappa", "κ"),
        ("beta", "β"),
        ("mu", "μ"),
        ("exponent", "exponent"),
        ("erf_scale", "scale"),
        ("decay_length", "u₀"),
        ("closing_load", "p_c"),
        ("mesh_coefficient", "c"),
    ] {
        parts.push(range(table, name, label)?);
    }
    Ok(parts)
}

/// Fits every parameter point among the rows.
///
/// # Errors
/// When they are no measured contacts.
pub fn fitted(params: &Params, table: &Table) -> Result<Table, TableError> {
    if params.law == Law::MeshConvergence {
        return meshes::run(table, params);
    }
    let points = match params.law {
        Law::LoadSeparation => Point::all_of(table, MEAN_GAP.name)?,
        _ => Point::all(table)?,
    };
    let mut rows = match params.law {
        Law::ContactEvolution {
            to,
            kappa: Kappa::MinimalConvex,
        } => with_common_kappa(&points, to, params),
        _ => points.iter().map(|point| alone(point, params)).collect(),
    };
    for (row, point) in rows.iter_mut().zip(&points) {
        row.unconverged = point.unconverged;
    }
    Ok(rows::table(table, &points, params, &rows))
}

/// The fit of one point by itself.
fn alone(point: &Point, params: &Params) -> Row {
    let fitted = point
        .curves
        .as_ref()
        .map_err(Clone::clone)
        .and_then(|curves| match params.law {
            Law::ContactEvolution {
                to,
                kappa: Kappa::Given(kappa),
            } => evolution(curves, to, evolution::Kappa::Given(kappa), params),
            Law::ContactEvolution { to, .. } => {
                evolution(curves, to, evolution::Kappa::Free, params)
            }
            Law::MeanPressure => pressure_growth(curves, params),
            Law::ScaledErf => scaled_erf(curves, params),
            Law::LoadSeparation => load_separation(curves, params),
            Law::MeshConvergence => unreachable!("regressed over meshes, not point by point"),
        });
    fitted.unwrap_or_else(|error| Row::failed(&error))
}

fn evolution(
    curves: &Curves,
    to: Datum,
    kappa: evolution::Kappa,
    params: &Params,
) -> Result<Row, FitError> {
    let problem = EvolutionProblem::new(curves, to.into(), params.window())?;
    let fit = problem.fit(kappa)?;
    let mut intervals = problem.bootstrap(kappa, &fit, &params.bootstrap());
    if matches!(kappa, evolution::Kappa::Given(_)) {
        forget_first(&mut intervals);
    }
    Ok(evolution_row(&fit, intervals))
}

fn evolution_row(fit: &EvolutionFit, intervals: Intervals) -> Row {
    Row {
        values: vec![fit.law.kappa, fit.law.beta, fit.law.mu],
        rms_residual: Some(fit.rms_residual),
        r_squared: Some(fit.r_squared),
        reduced_chi_square: fit.reduced_chi_square,
        data: fit.data,
        convex: Some(fit.convex),
        ..Row::with(intervals)
    }
}

fn pressure_growth(curves: &Curves, params: &Params) -> Result<Row, FitError> {
    let problem = PressureGrowthProblem::new(curves, params.window());
    let fit = problem.fit()?;
    Ok(Row {
        values: vec![fit.exponent, fit.prefactor],
        rms_residual: Some(fit.rms_residual),
        r_squared: Some(fit.r_squared),
        data: fit.data,
        masked: Some(fit.masked),
        ..Row::with(problem.bootstrap(&fit, &params.bootstrap()))
    }
    .unless_masked())
}

fn scaled_erf(curves: &Curves, params: &Params) -> Result<Row, FitError> {
    let problem = ScaledErfProblem::new(curves, params.window());
    let fit = problem.fit()?;
    Ok(Row {
        values: vec![fit.beta],
        rms_residual: Some(fit.rms_residual),
        r_squared: Some(fit.r_squared),
        data: fit.data,
        masked: Some(fit.masked),
        ..Row::with(problem.bootstrap(&fit, &params.bootstrap()))
    }
    .unless_masked())
}

fn load_separation(gaps: &Curves, params: &Params) -> Result<Row, FitError> {
    let problem = LoadSeparationProblem::new(gaps, params.window());
    let fit = problem.fit()?;
    Ok(Row {
        values: vec![fit.decay_length, fit.closing_load],
        rms_residual: Some(fit.rms_residual),
        r_squared: Some(fit.r_squared),
        data: fit.data,
        masked: Some(fit.masked),
        ..Row::with(problem.bootstrap(&fit, &params.bootstrap()))
    })
}

/// All points at the smallest κ for which all their fitted slopes are convex.
///
/// κ itself is common to the points, but only curves under one correction are compared: the
/// corrections are rival readings of the same data.
fn with_common_kappa(points: &[Point], to: Datum, params: &Params) -> Vec<Row> {
    let mut rows: Vec<Option<Row>> = points.iter().map(|_| None).collect();
    for correction in points::corrections(points) {
        let members: Vec<usize> = (0..points.len())
            .filter(|&i| points[i].correction == correction)
            .collect();
        let fitted = common_kappa(points, &members, to, params);
        for (slot, row) in members.iter().zip(fitted) {
            rows[*slot] = Some(row);
        }
    }
    rows.into_iter().flatten().collect()
}

fn common_kappa(points: &[Point], members: &[usize], to: Datum, params: &Params) -> Vec<Row> {
    let problem = |&member: &usize| {
        let curves = points[member].curves.as_ref().map_err(Clone::clone)?;
        EvolutionProblem::new(curves, to.into(), params.window())
    };
    let all_failed = |error: FitError| members.iter().map(|_| Row::failed(&error)).collect();
    let problems = match members.iter().map(problem).collect::<Result<Vec<_>, _>>() {
        Ok(problems) => problems,
        Err(error) => return all_failed(error),
    };
    let common = match CommonKappa::fit(&problems) {
        Ok(common) => common,
        Err(error) => return all_failed(error),
    };
    let of_kappa = common.bootstrap(&problems, &params.bootstrap());
    let rows = problems
        .iter()
        .zip(&common.fits)
        .zip(&common.own)
        .map(|((problem, fit), own)| {
            let fit = match fit {
                Ok(fit) => fit,
                Err(error) => return Row::failed(error),
            };
            let given = evolution::Kappa::Given(common.kappa);
            let mut intervals = problem.bootstrap(given, fit, &params.bootstrap());
            replace_first(&mut intervals, of_kappa.as_ref());
            Row {
                own_kappa: own.as_ref().ok().copied(),
                ..evolution_row(fit, intervals)
            }
        });
    rows.collect()
}

/// A given κ has no interval, only rounding.
fn forget_first(intervals: &mut Intervals) {
    if let Some(kappa) = intervals.intervals.as_mut().and_then(|all| all.first_mut()) {
        *kappa = Interval {
            lower: f64::NAN,
            upper: f64::NAN,
            standard_error: f64::NAN,
        };
    }
}

/// κ was given to the single fits; its own interval comes from resampling all points together.
fn replace_first(intervals: &mut Intervals, of_kappa: Option<&Intervals>) {
    let kappa: Option<Interval> = of_kappa
        .and_then(|all| all.intervals.as_ref())
        .and_then(|all| all.first().copied());
    match (&mut intervals.intervals, kappa) {
        (Some(own), Some(kappa)) if !own.is_empty() => own[0] = kappa,
        (own, _) => *own = None,
    }
}

#[cfg(test)]
mod tests {
    use arrow::array::Array;

    use super::*;
    use crate::contact::theory::law::ContactEvolution;
    use crate::stages::columns::{AREA_FRACTION, LOAD, STOP, SURFACE};
    use crate::store::column::{Column, ColumnKind, reals, texts};

    const HURST: Column = Column::parameter("hurst", ColumnKind::Real, "1", "Hurst exponent");

    #[test]
    fn a_fit_that_did_not_converge_is_counted_and_enters_no_range() {
        let loads: Vec<f64> = (1..=20).map(|i| 0.003 * f64::from(i)).collect();
        let law = ContactEvolution {
            kappa: 2.75,
            beta: 1.2,
            mu: 0.6,
        };
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
            law: Law::ContactEvolution {
                to: Datum::Area,
                kappa: Kappa::Free,
            },
            window: [0.0, 1.0],
            bootstrap: 0,
            level: 0.95,
            seed: 0,
        };
        let table = fitted(&free, &measured).unwrap();
        for name in ["kappa", "beta", "mu", "rms_residual", "r_squared"] {
            assert_eq!(table.reals(name).unwrap().null_count(), 1, "{name}");
        }
        let parts: Vec<String> = summary(&table).unwrap().into_iter().flatten().collect();
        let told = [
            "2 fits",
            "1 did not converge",
            "κ 2.7500",
            "β 1.2000",
            "μ 0.6000",
        ];
        assert_eq!(parts, told);
    }
}
