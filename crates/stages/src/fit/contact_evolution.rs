//! Fits of the contact evolution law of Yastrebov, Anciaux & Molinari (2015).

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::InputScope;
use crate::columns::columns;
use crate::ensemble::Member;
use crate::fit::fitted_point::{FitParameter, FittedPoint, names};
use crate::fit::{CurvesOfPoint, Params};
use asperity_statistics::FitError;
use asperity_statistics::bootstrap::{Interval, Intervals};
use asperity_statistics::convexity::CommonKappa;
use asperity_statistics::curves::Curves;
use asperity_statistics::evolution::{self, EvolutionFit, EvolutionProblem, Quantity};

/// Name of the law in manifests and tables.
pub const WORD: &str = "contact-evolution";

/// Default window of loads, for which the law was proposed.
pub const WINDOW: [f64; 2] = [0.0, 0.06];

/// Parameters of the law, in the order of their values.
pub const PARAMETERS: [FitParameter; 3] = [KAPPA, BETA, MU];

columns! {
    /// κ of the contact evolution law: slope of the area fraction against the load at first contact
    const KAPPA: FitParameter = FitParameter::number(names!("kappa")).with_label("κ");
    /// β of the contact evolution law
    const BETA: FitParameter = FitParameter::number(names!("beta")).with_label("β");
    /// μ of the contact evolution law; the slope of the area against the load is convex for μ ≤ 1
    const MU: FitParameter = FitParameter::number(names!("mu")).with_label("μ");
}

/// Choices for a fit of the contact evolution law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "law", rename = "contact-evolution")]
pub struct EvolutionChoices {
    /// Quantity whose residuals are minimised.
    pub to: Datum,
    /// Method that determines κ.
    pub kappa: Kappa,
}

/// The data that the law is fitted to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Datum {
    /// The slope of the mean curve, from finite differences.
    Slope,
    /// The area of the mean curve.
    Area,
}

/// Method that determines κ in a fit.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Kappa {
    /// Value of κ, which a manifest gives as a number.
    #[serde(skip_deserializing)]
    Given(f64),
    /// κ is fitted like the other parameters.
    Free,
    /// κ is the smallest value for which the slopes of all curves of the stage are convex.
    MinimalConvex,
}

impl Datum {
    /// Returns the word in manifests and tables.
    pub fn name(self) -> &'static str {
        match self {
            Datum::Slope => "slope",
            Datum::Area => "area",
        }
    }

    fn quantity(self) -> Quantity {
        match self {
            Datum::Slope => Quantity::Slope,
            Datum::Area => Quantity::Area,
        }
    }
}

impl Kappa {
    /// Returns the value of κ, if the manifest gives one.
    pub fn given(self) -> Option<f64> {
        match self {
            Kappa::Given(kappa) => Some(kappa),
            Kappa::Free | Kappa::MinimalConvex => None,
        }
    }

    /// Returns the word of the method in tables.
    pub fn name(self) -> &'static str {
        match self {
            Kappa::Given(_) => "given",
            Kappa::Free => "free",
            Kappa::MinimalConvex => "minimal-convex",
        }
    }
}

impl EvolutionChoices {
    /// Fits all points and returns a row for each: together if the points share κ, otherwise
    /// separately.
    pub fn fits(self, points: &[CurvesOfPoint], params: &Params) -> Vec<FittedPoint> {
        let alone = |kappa| {
            points.iter().map(|point| point.fit(|curves| self.fit(curves, kappa, params))).collect()
        };
        match self.kappa {
            Kappa::Given(kappa) => alone(evolution::Kappa::Given(kappa)),
            Kappa::Free => alone(evolution::Kappa::Free),
            Kappa::MinimalConvex => with_common_kappa(points, self.to, params),
        }
    }

    /// Returns the scope of the tables that one task reads. It is one parameter point, or all
    /// points for the smallest κ that makes the slopes of all points convex.
    pub fn input_scope(self) -> InputScope {
        match self.kappa {
            Kappa::Given(_) | Kappa::Free => InputScope::ParameterPoint,
            Kappa::MinimalConvex => InputScope::All,
        }
    }

    /// Fits the curves of one point separately.
    fn fit(
        self,
        curves: &Curves,
        kappa: evolution::Kappa,
        params: &Params,
    ) -> Result<FittedPoint, FitError> {
        let problem = EvolutionProblem::new(curves, self.to.quantity(), params.window())?;
        let fit = problem.fit(kappa)?;
        let mut intervals = problem.bootstrap(kappa, &fit, &params.bootstrap());
        if matches!(kappa, evolution::Kappa::Given(_)) {
            // It would contain only rounding errors.
            replace_interval_of_kappa(&mut intervals, Some(Interval::UNKNOWN));
        }
        Ok(evolution_row(&fit, intervals))
    }
}

fn evolution_row(fit: &EvolutionFit, intervals: Intervals) -> FittedPoint {
    FittedPoint {
        values: vec![fit.law.kappa, fit.law.beta, fit.law.mu],
        rms_residual: Some(fit.rms_residual),
        r_squared: fit.r_squared,
        reduced_chi_square: fit.reduced_chi_square,
        data: fit.data,
        convex: Some(fit.convex),
        ..FittedPoint::from_intervals(intervals)
    }
}

/// Fits all points with the smallest κ for which all their fitted slopes are convex.
///
/// Points with different corrections have separate values of κ, because the corrections are
/// alternative estimates from the same data.
fn with_common_kappa(points: &[CurvesOfPoint], to: Datum, params: &Params) -> Vec<FittedPoint> {
    let mut rows: Vec<Option<FittedPoint>> = points.iter().map(|_| None).collect();
    let corrections: BTreeSet<_> = points.iter().map(|point| &point.correction).collect();
    for correction in corrections {
        let members: Vec<usize> =
            (0..points.len()).filter(|&i| points[i].correction == *correction).collect();
        let fitted = common_kappa(points, &members, to, params);
        for (index, row) in members.iter().zip(fitted) {
            rows[*index] = Some(row);
        }
    }
    rows.into_iter().flatten().collect()
}

fn common_kappa(
    points: &[CurvesOfPoint],
    members: &[usize],
    to: Datum,
    params: &Params,
) -> Vec<FittedPoint> {
    let problem = |&member: &usize| {
        let curves = points[member].curves.as_ref().map_err(Clone::clone)?;
        EvolutionProblem::new(curves, to.quantity(), params.window())
    };
    let all_failed =
        |error: FitError| members.iter().map(|_| FittedPoint::failed(&error)).collect();
    let problems = match members.iter().map(problem).collect::<Result<Vec<_>, _>>() {
        Ok(problems) => problems,
        Err(error) => return all_failed(error),
    };
    let common = match CommonKappa::fit(&problems) {
        Ok(common) => common,
        Err(error) => return all_failed(error),
    };
    let units = units(members.iter().map(|&member| &points[member].members[..]));
    let of_all = common.bootstrap(&problems, &units, &params.bootstrap()).intervals;
    let of_kappa = of_all.and_then(|all| all.first().copied());
    let rows = problems.iter().zip(&common.fits).zip(&common.own).map(|((problem, fit), own)| {
        let fit = match fit {
            Ok(fit) => fit,
            Err(error) => return FittedPoint::failed(error),
        };
        let given = evolution::Kappa::Given(common.kappa);
        let mut intervals = problem.bootstrap(given, fit, &params.bootstrap());
        replace_interval_of_kappa(&mut intervals, of_kappa);
        FittedPoint { own_kappa: own.as_ref().ok().copied(), ..evolution_row(fit, intervals) }
    });
    rows.collect()
}

/// Replaces the interval of κ, which is meaningless where κ is given, or removes all intervals if
/// there is none.
fn replace_interval_of_kappa(intervals: &mut Intervals, kappa: Option<Interval>) {
    match (&mut intervals.intervals, kappa) {
        (Some(own), Some(kappa)) if !own.is_empty() => own[0] = kappa,
        (own, _) => *own = None,
    }
}

/// Numbers the surfaces of several points from 0. The same surface has the same number at all
/// points. Returns the numbers of the surfaces of each point.
fn units<'a>(points: impl Iterator<Item = &'a [Member]> + Clone) -> Vec<Vec<usize>> {
    let distinct: BTreeSet<Member> = points.clone().flatten().copied().collect();
    let all: Vec<Member> = distinct.into_iter().collect();
    let number = |member| all.partition_point(|other| other < member);
    points.map(|members| members.iter().map(number).collect()).collect()
}
