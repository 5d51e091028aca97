//! The contact evolution law of Yastrebov, Anciaux & Molinari (2015), as fitted to tables.

use std::collections::BTreeSet;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::rows::{Parameter, Row, names};
use super::{CurvesOfPoint, Params};
use crate::Reach;
use crate::ensemble::Member;
use asperity_statistics::FitError;
use asperity_statistics::bootstrap::{Interval, Intervals};
use asperity_statistics::convexity::CommonKappa;
use asperity_statistics::curves::Curves;
use asperity_statistics::evolution;
use asperity_statistics::evolution::{EvolutionFit, EvolutionProblem, Quantity};

/// The word in manifests and tables.
pub const WORD: &str = "contact-evolution";

/// Small loads: where the law was found.
pub const WINDOW: [f64; 2] = [0.0, 0.06];

/// Its parameters, in the order of their values.
pub const PARAMETERS: [Parameter; 3] = [KAPPA, BETA, MU];

const KAPPA: Parameter =
    Parameter::number(names!("kappa"), "κ: slope of area against load at first touch").called("κ");
const BETA: Parameter =
    Parameter::number(names!("beta"), "β of the contact evolution law").called("β");
const MU: Parameter =
    Parameter::number(names!("mu"), "μ of the contact evolution law; slopes are convex for μ ≤ 1")
        .called("μ");

/// What is free in the law.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
#[serde(tag = "law", rename = "contact-evolution")]
pub struct EvolutionChoices {
    /// What the residuals are taken of.
    pub to: Datum,
    /// What is known of κ.
    pub kappa: Kappa,
}

/// What a fit compares.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
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
    Given(f64),
    /// Nothing: it is fitted too.
    Free,
    /// The smallest one for which the slopes of all curves of the stage are convex.
    MinimalConvex,
}

impl Datum {
    fn quantity(self) -> Quantity {
        match self {
            Datum::Slope => Quantity::Slope,
            Datum::Area => Quantity::Area,
        }
    }
}

impl EvolutionChoices {
    /// The fits of all points, each by itself unless they share κ.
    pub fn fits(self, points: &[CurvesOfPoint], params: &Params) -> Vec<Row> {
        let alone = |kappa| {
            let points = points.iter();
            let fits = points.map(|point| point.fit(|curves| self.fit(curves, kappa, params)));
            fits.collect()
        };
        match self.kappa {
            Kappa::Given(kappa) => alone(evolution::Kappa::Given(kappa)),
            Kappa::Free => alone(evolution::Kappa::Free),
            Kappa::MinimalConvex => with_common_kappa(points, self.to, params),
        }
    }

    /// How much one task reads: what is convex at all points depends on them all.
    pub fn reach(self) -> Reach {
        match self.kappa {
            Kappa::Given(_) | Kappa::Free => Reach::Point,
            Kappa::MinimalConvex => Reach::All,
        }
    }

    /// The fit of one point by itself.
    fn fit(
        self,
        curves: &Curves,
        kappa: evolution::Kappa,
        params: &Params,
    ) -> Result<Row, FitError> {
        let problem = EvolutionProblem::new(curves, self.to.quantity(), params.window())?;
        let fit = problem.fit(kappa)?;
        let mut intervals = problem.bootstrap(kappa, &fit, &params.bootstrap());
        if matches!(kappa, evolution::Kappa::Given(_)) {
            forget_first(&mut intervals);
        }
        Ok(evolution_row(&fit, intervals))
    }
}

fn evolution_row(fit: &EvolutionFit, intervals: Intervals) -> Row {
    Row {
        values: vec![fit.law.kappa, fit.law.beta, fit.law.mu],
        rms_residual: Some(fit.rms_residual),
        r_squared: fit.r_squared,
        reduced_chi_square: fit.reduced_chi_square,
        data: fit.data,
        convex: Some(fit.convex),
        ..Row::with(intervals)
    }
}

/// All points at the smallest κ for which all their fitted slopes are convex.
///
/// κ itself is common to the points, but only curves under one correction are compared: the
/// corrections are rival readings of the same data.
fn with_common_kappa(points: &[CurvesOfPoint], to: Datum, params: &Params) -> Vec<Row> {
    let mut rows: Vec<Option<Row>> = points.iter().map(|_| None).collect();
    for correction in corrections(points) {
        let members: Vec<usize> =
            (0..points.len()).filter(|&i| points[i].correction == correction).collect();
        let fitted = common_kappa(points, &members, to, params);
        for (slot, row) in members.iter().zip(fitted) {
            rows[*slot] = Some(row);
        }
    }
    rows.into_iter().flatten().collect()
}

fn common_kappa(
    points: &[CurvesOfPoint],
    members: &[usize],
    to: Datum,
    params: &Params,
) -> Vec<Row> {
    let problem = |&member: &usize| {
        let curves = points[member].curves.as_ref().map_err(Clone::clone)?;
        EvolutionProblem::new(curves, to.quantity(), params.window())
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
    let units = units(members.iter().map(|&member| &points[member].members[..]));
    let of_kappa = common.bootstrap(&problems, &units, &params.bootstrap());
    let rows = problems.iter().zip(&common.fits).zip(&common.own).map(|((problem, fit), own)| {
        let fit = match fit {
            Ok(fit) => fit,
            Err(error) => return Row::failed(error),
        };
        let given = evolution::Kappa::Given(common.kappa);
        let mut intervals = problem.bootstrap(given, fit, &params.bootstrap());
        replace_first(&mut intervals, &of_kappa);
        Row { own_kappa: own.as_ref().ok().copied(), ..evolution_row(fit, intervals) }
    });
    rows.collect()
}

/// A given κ has no interval, only rounding.
fn forget_first(intervals: &mut Intervals) {
    if let Some(kappa) = intervals.intervals.as_mut().and_then(|all| all.first_mut()) {
        *kappa = Interval { lower: f64::NAN, upper: f64::NAN, standard_error: f64::NAN };
    }
}

/// κ was given to the single fits; its own interval comes from resampling all points together.
fn replace_first(intervals: &mut Intervals, of_kappa: &Intervals) {
    let of_all = of_kappa.intervals.as_ref();
    let kappa: Option<Interval> = of_all.and_then(|all| all.first().copied());
    match (&mut intervals.intervals, kappa) {
        (Some(own), Some(kappa)) if !own.is_empty() => own[0] = kappa,
        (own, _) => *own = None,
    }
}

/// The corrections among the points, each once.
fn corrections(points: &[CurvesOfPoint]) -> Vec<Option<String>> {
    let mut found = Vec::new();
    for point in points {
        if !found.contains(&point.correction) {
            found.push(point.correction.clone());
        }
    }
    found
}

/// Numbers the surfaces of several points from 0. A surface has the same number at all points.
fn units<'a>(points: impl Iterator<Item = &'a [Member]> + Clone) -> Vec<Vec<usize>> {
    let all: BTreeSet<Member> = points.clone().flatten().copied().collect();
    let all: Vec<Member> = all.into_iter().collect();
    let number = |member| all.partition_point(|other| other < member);
    points.map(|members| members.iter().map(number).collect()).collect()
}
