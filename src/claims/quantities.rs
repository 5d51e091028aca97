//! The quantities of a claim, gathered one by one.

use super::evidence::{COUNTED, Ensemble, OF_2015, OF_2017, Spectrum};
use super::intervals::{Bound, FEWEST_SURFACES, Weights, simultaneous};
use super::{Claim, Expectation, Judgement, Outcome};

/// What a quantity is under given weights of the surfaces.
type Quantity<'a> = Box<dyn Fn(&Weights) -> Option<f64> + 'a>;

/// Quantities that one claim is about, all to be known together.
#[derive(Default)]
pub struct Quantities<'a> {
    labels: Vec<String>,
    values: Vec<Quantity<'a>>,
    surfaces: Vec<usize>,
}

impl<'a> Quantities<'a> {
    /// Adds one that rests on ensembles of these numbers of surfaces.
    pub fn add(
        &mut self,
        label: String,
        surfaces: &[usize],
        value: impl Fn(&Weights) -> Option<f64> + 'a,
    ) {
        self.labels.push(label);
        self.surfaces.extend(surfaces);
        self.values.push(Box::new(value));
    }

    /// The claim that all of them are as expected; `needs` says what a study without any lacks.
    pub fn claim(
        self,
        name: &'static str,
        says: &'static str,
        data: &str,
        expected: Expectation,
        needs: &str,
    ) -> Claim {
        let outcome = if self.labels.is_empty() {
            Outcome::NotComputed(needs.to_owned())
        } else {
            let together = |weights: &Weights| self.values.iter().map(|of| of(weights)).collect();
            let bounds = simultaneous(&self.labels, &self.surfaces, together);
            judged(expected, bounds.as_deref())
        };
        Claim {
            name,
            says,
            data: data.to_owned(),
            outcome,
        }
    }
}

/// What intervals amount to; without them, what they would take.
pub fn judged(expected: Expectation, bounds: Option<&[Bound]>) -> Outcome {
    let judgement = bounds.and_then(|bounds| Judgement::of(expected, bounds));
    judgement.map_or_else(
        || {
            Outcome::NotComputed(format!(
                "{FEWEST_SURFACES} surfaces or more of each spectrum: fewer have no interval"
            ))
        },
        Outcome::Judged,
    )
}

/// Words for the area under a correction.
pub fn data(correction: &str) -> &'static str {
    match correction {
        COUNTED => "counted area",
        OF_2015 => "area corrected by π/8",
        OF_2017 => "area corrected by 2017",
        _ => "corrected area",
    }
}

/// `a correct stage with correction "pi/8", over loads up to 0.06`.
pub fn needs(correction: &str, loads: &str) -> String {
    match correction {
        COUNTED => format!("a `measure` stage over {loads}"),
        _ => format!("a `correct` stage with `correction = \"{correction}\"` over {loads}"),
    }
}

/// `k_lower 4, k_upper 32`.
pub fn cutoffs(spectrum: &Spectrum) -> String {
    format!("k_lower {}, k_upper {}", spectrum.k_lower, spectrum.k_upper)
}

/// `load 0.06`, in as many digits as a reader needs.
pub fn under(load: f64) -> String {
    format!("load {:.3}", load)
}

/// Pairs of ensembles that differ in one cutoff alone, neighbours in it: the lesser one first.
pub fn neighbours<'a>(
    ensembles: &[&'a Ensemble],
    varied: fn(&Spectrum) -> i64,
    fixed: fn(&Spectrum) -> i64,
) -> Vec<[&'a Ensemble; 2]> {
    let alike = |one: &Spectrum, other: &Spectrum| {
        let plain = |spectrum: &Spectrum| spectrum.k_lower == spectrum.k_rolloff;
        fixed(one) == fixed(other)
            && (one.hurst, one.nodes) == (other.hurst, other.nodes)
            && plain(one)
            && plain(other)
    };
    let next = |one: &&'a Ensemble| {
        let beyond = ensembles.iter().filter(|other| {
            alike(&one.spectrum, &other.spectrum) && varied(&other.spectrum) > varied(&one.spectrum)
        });
        let nearest = beyond.min_by_key(|other| varied(&other.spectrum));
        nearest.map(|other| [*one, *other])
    };
    ensembles.iter().filter_map(next).collect()
}

/// Ensembles of every combination of two cutoffs or more each, by k_lower and then k_upper; `None`
/// where a combination is missing, or other parameters differ.
pub fn grid<'a>(ensembles: &[&'a Ensemble]) -> Option<Vec<Vec<&'a Ensemble>>> {
    let first = &ensembles.first()?.spectrum;
    let same = |other: &&&Ensemble| {
        (other.spectrum.hurst, other.spectrum.nodes) == (first.hurst, first.nodes)
            && other.spectrum.k_lower == other.spectrum.k_rolloff
    };
    if ensembles.iter().filter(same).count() != ensembles.len() {
        return None;
    }
    let mut rows: Vec<Vec<&Ensemble>> = Vec::new();
    for &ensemble in ensembles {
        let k_lower = ensemble.spectrum.k_lower;
        match rows.last_mut() {
            Some(row) if row[0].spectrum.k_lower == k_lower => row.push(ensemble),
            _ => rows.push(vec![ensemble]),
        }
    }
    let columns = |row: &[&Ensemble]| {
        let uppers = row.iter().map(|ensemble| ensemble.spectrum.k_upper);
        uppers.collect::<Vec<_>>()
    };
    let whole = rows.iter().all(|row| columns(row) == columns(&rows[0]));
    (whole && rows.len() > 1 && rows[0].len() > 1).then_some(rows)
}

/// How much more the area differs between k_lower than between k_upper: the difference of the
/// standard deviations of both sets of marginal means, relative to the mean of all.
pub fn grouping(rows: &[Vec<&Ensemble>], load: f64, weights: &Weights) -> Option<f64> {
    let mean = |ensemble: &&Ensemble| Some(weights.mean(&ensemble.areas[ensemble.at(load)?]));
    let areas: Option<Vec<Vec<f64>>> = rows
        .iter()
        .map(|row| row.iter().map(mean).collect())
        .collect();
    let areas = areas?;
    let by_lower: Vec<f64> = areas.iter().map(|row| average(row)).collect();
    let by_upper: Vec<f64> = (0..areas[0].len())
        .map(|column| average(&areas.iter().map(|row| row[column]).collect::<Vec<_>>()))
        .collect();
    Some((deviation(&by_lower) - deviation(&by_upper)) / average(&by_lower))
}

fn average(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn deviation(values: &[f64]) -> f64 {
    let mean = average(values);
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / (values.len() - 1) as f64).sqrt()
}
