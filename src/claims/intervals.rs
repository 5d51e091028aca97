//! Intervals of many quantities at once, by resampling whole surfaces.

use std::collections::BTreeMap;
use std::f64::consts::SQRT_2;

use crate::contact::persson::error_function::erf_inverse;
use crate::fitting::bootstrap::Bootstrap;

/// How to resample: enough for the far tail of the largest deviation among some hundred.
pub const RESAMPLING: Bootstrap = Bootstrap {
    replicates: 999,
    seed: 2015,
    level: 0.95,
};

/// Surfaces below which resampling says little: two of them have but three resamplings, whose
/// spread is far below that of other surfaces.
pub const FEWEST_SURFACES: usize = 5;

/// Share of the replicates that must have a value.
const LEAST_SUCCESS: f64 = 0.9;

/// A quantity and its interval.
#[derive(Debug, Clone, PartialEq)]
pub struct Bound {
    /// Which one it is: `k_upper 8, k_lower 2 over 1, load 0.02`.
    pub label: String,
    /// Its value.
    pub value: f64,
    /// Lower end of its interval.
    pub lower: f64,
    /// Upper end of its interval.
    pub upper: f64,
}

impl Bound {
    /// A number known to rounding.
    pub fn exact(label: impl Into<String>, value: f64) -> Bound {
        Bound {
            label: label.into(),
            value,
            lower: value,
            upper: value,
        }
    }
}

/// How many times each surface counts, by the number of surfaces of an ensemble.
///
/// Two ensembles of as many surfaces get the same weights: their realizations share the draws of
/// the modes, so their differences are paired.
pub struct Weights {
    replicate: Option<usize>,
    known: BTreeMap<usize, Vec<u32>>,
}

impl Weights {
    fn new(replicate: Option<usize>, counts: &[usize]) -> Weights {
        let weights = |&surfaces: &usize| {
            let mut times = vec![1; surfaces];
            if let Some(replicate) = replicate {
                RESAMPLING.draw(replicate, &mut times);
            }
            (surfaces, times)
        };
        let known = counts.iter().map(weights).collect();
        Weights { replicate, known }
    }

    /// Weights that count every surface once.
    pub fn once(counts: &[usize]) -> Weights {
        Weights::new(None, counts)
    }

    /// The mean of one value per surface.
    pub fn mean(&self, values: &[f64]) -> f64 {
        let Some(times) = self.known.get(&values.len()) else {
            debug_assert!(self.replicate.is_none(), "an ensemble was not announced");
            return values.iter().sum::<f64>() / values.len() as f64;
        };
        let sum: f64 = values
            .iter()
            .zip(times)
            .map(|(value, &times)| value * f64::from(times))
            .sum();
        sum / values.len() as f64
    }
}

/// Quantities of ensembles with these numbers of surfaces, and intervals that cover all of them
/// together at the level of [`RESAMPLING`]; `None` for fewer than [`FEWEST_SURFACES`], or without
/// values.
///
/// The half widths are one multiple of the bootstrap's standard errors: the quantile of the largest
/// deviation among the quantities (the max-t band of Romano & Wolf 2005).
pub fn simultaneous(
    labels: &[String],
    surfaces: &[usize],
    quantities: impl Fn(&Weights) -> Option<Vec<f64>>,
) -> Option<Vec<Bound>> {
    let too_few = surfaces.iter().any(|&count| count < FEWEST_SURFACES);
    if labels.is_empty() || surfaces.is_empty() || too_few {
        return None;
    }
    let values = quantities(&Weights::once(surfaces))?;
    let replicates: Vec<Vec<f64>> = (0..RESAMPLING.replicates)
        .filter_map(|replicate| quantities(&Weights::new(Some(replicate), surfaces)))
        .collect();
    if (replicates.len() as f64) < LEAST_SUCCESS * RESAMPLING.replicates as f64 {
        return None;
    }
    let errors: Vec<f64> = (0..values.len())
        .map(|index| standard_deviation(replicates.iter().map(|replicate| replicate[index])))
        .collect();
    let deviation = |replicate: &Vec<f64>| {
        let of = |index: usize| (replicate[index] - values[index]).abs() / errors[index];
        let scattered = (0..values.len()).filter(|&index| errors[index] > 0.0);
        scattered.map(of).fold(0.0, f64::max)
    };
    let mut deviations: Vec<f64> = replicates.iter().map(deviation).collect();
    deviations.sort_by(f64::total_cmp);
    let rank = (RESAMPLING.level * deviations.len() as f64).ceil() as usize;
    let factor = deviations[rank.min(deviations.len()) - 1];
    let bound = |((label, &value), &error): ((&String, &f64), &f64)| Bound {
        label: label.clone(),
        value,
        lower: value - factor * error,
        upper: value + factor * error,
    };
    let bounds = labels.iter().zip(&values).zip(&errors).map(bound);
    Some(bounds.collect())
}

/// Widens intervals that each cover at a level of its own until all cover together at that of
/// [`RESAMPLING`], as if they were normal (Bonferroni).
pub fn widened(bounds: Vec<(Bound, f64)>) -> Vec<Bound> {
    let together = 1.0 - (1.0 - RESAMPLING.level) / bounds.len().max(1) as f64;
    let widen = |(bound, level): (Bound, f64)| {
        let factor = normal_quantile(together) / normal_quantile(level);
        Bound {
            lower: bound.value + factor * (bound.lower - bound.value),
            upper: bound.value + factor * (bound.upper - bound.value),
            ..bound
        }
    };
    bounds.into_iter().map(widen).collect()
}

/// The z for which a normal number lies in ±z with this probability.
fn normal_quantile(probability: f64) -> f64 {
    SQRT_2 * erf_inverse(probability).expect("a share between zero and one")
}

fn standard_deviation(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    let squares: f64 = values.map(|value| (value - mean).powi(2)).sum();
    // A constant differs from its mean by rounding alone.
    let deviation = (squares / (count - 1.0)).sqrt();
    if deviation > 1e-13 * mean.abs() {
        deviation
    } else {
        0.0
    }
}
