//! Intervals of many quantities at once, from surfaces left out one by one.
//!
//! A quantity is a function of means over surfaces. Its standard error is the delete-one jackknife's:
//! the same realization is left out of every spectrum, so that differences between spectra are
//! paired. With n surfaces, (θ̂ − θ)/error follows Student's t of n − 1 degrees of freedom: exactly for
//! means of normal numbers, nearly for smooth functions of them. Bonferroni's inequality makes
//! intervals of many quantities cover together. Nothing is drawn, so no verdict hangs on a seed.
//!
//! Resampling whole surfaces, with the largest deviation among the quantities (a max-t band),
//! covers far less with few surfaces: it knows neither Student's tail nor √(n/(n − 1)). The tests
//! simulate both.

use crate::student::two_sided_quantile;

/// Probability with which intervals cover: all of a claim together, or one end of a single one.
pub const LEVEL: f64 = 0.95;

/// Surfaces below which nothing is judged: the t quantile of four quantities at four surfaces is
/// eight standard errors, and a scatter of three numbers is hardly known at all.
pub const FEWEST_SURFACES: usize = 5;

/// A quantity and how well it is known.
#[derive(Debug, Clone, PartialEq)]
pub struct Bound {
    /// Which one it is: `k_upper 8, k_lower 2 over 1, load 0.02`.
    pub label: String,
    /// Its value.
    pub value: f64,
    /// Its standard error; zero for a number known to rounding.
    pub error: f64,
    /// A standard error besides, which more surfaces leave as it is.
    pub systematic: f64,
    /// The fewest surfaces that an ensemble behind it has; none of a closed form.
    pub surfaces: Option<usize>,
}

impl Bound {
    /// A number known to rounding.
    pub fn exact(label: impl Into<String>, value: f64) -> Bound {
        Bound { label: label.into(), value, error: 0.0, systematic: 0.0, surfaces: None }
    }

    /// Whether it is known to rounding.
    pub fn is_exact(&self) -> bool {
        self.error == 0.0 && self.systematic == 0.0
    }

    /// Both ends of the interval that covers together with those of `quantities` in all.
    pub fn together(&self, quantities: usize) -> [f64; 2] {
        self.interval(1.0 - (1.0 - LEVEL) / quantities.max(1) as f64, self.surfaces)
    }

    /// Two ends that each hold by themselves.
    pub fn single(&self) -> [f64; 2] {
        self.single_of(1)
    }

    /// The same at each of so many looks, so that all of them together are as sure.
    pub fn single_of(&self, looks: usize) -> [f64; 2] {
        let beyond = 1.0 - (2.0 * LEVEL - 1.0);
        self.interval(1.0 - beyond / looks as f64, self.surfaces)
    }

    /// The same with another number of surfaces and the present scatter.
    pub fn with_surfaces(&self, surfaces: usize) -> Bound {
        let now = self.surfaces.unwrap_or(surfaces) as f64;
        Bound {
            error: self.error * (now / surfaces as f64).sqrt(),
            surfaces: self.surfaces.map(|_| surfaces),
            ..self.clone()
        }
    }

    fn interval(&self, probability: f64, surfaces: Option<usize>) -> [f64; 2] {
        let freedom = surfaces.map(|surfaces| surfaces.saturating_sub(1).max(1) as u32);
        let factor = freedom.map_or(0.0, |freedom| two_sided_quantile(probability, freedom));
        let half = factor * self.error.hypot(self.systematic);
        [self.value - half, self.value + half]
    }
}

/// Which surfaces count: all of them, or all but one.
///
/// Ensembles of as many surfaces leave out the same one: their realizations share the draws of the
/// modes.
#[derive(Debug, Clone, Copy)]
pub struct Weights {
    left_out: Option<LeftOut>,
}

#[derive(Debug, Clone, Copy)]
struct LeftOut {
    surface: usize,
    of: usize,
}

impl Weights {
    /// Every surface counts.
    pub const ALL: Weights = Weights { left_out: None };

    /// The values of the surfaces that count.
    pub fn values<'a>(&self, values: &'a [f64]) -> impl Iterator<Item = f64> + Clone + 'a {
        let left_out = self.left_out.filter(|out| out.of == values.len());
        let left_out = left_out.map(|out| out.surface);
        let counting = values.iter().enumerate();
        let counting = counting.filter(move |(surface, _)| Some(*surface) != left_out);
        counting.map(|(_, value)| *value)
    }

    /// The mean of one value per surface.
    pub fn mean(&self, values: &[f64]) -> f64 {
        mean(self.values(values))
    }

    /// The standard deviation of one value per surface.
    pub fn deviation(&self, values: &[f64]) -> f64 {
        deviation(self.values(values))
    }
}

/// A quantity that rests on ensembles of these numbers of surfaces; `None` without a value, or with
/// fewer than [`FEWEST_SURFACES`].
pub fn jackknife(
    label: String,
    surfaces: &[usize],
    quantity: impl Fn(&Weights) -> Option<f64>,
) -> Option<Bound> {
    let fewest = surfaces.iter().copied().min()?;
    if fewest < FEWEST_SURFACES {
        return None;
    }
    let value = quantity(&Weights::ALL)?;
    let mut counts = surfaces.to_vec();
    counts.sort_unstable();
    counts.dedup();
    let mut variance = 0.0;
    for of in counts {
        let left_out = |surface| Weights { left_out: Some(LeftOut { surface, of }) };
        let replicates = (0..of).map(|surface| quantity(&left_out(surface)));
        let replicates: Vec<f64> = replicates.collect::<Option<_>>()?;
        // (n − 1)/n Σ (θ̂₍ᵢ₎ − θ̄)²
        let inflation = (of - 1) as f64 * (of - 1) as f64 / of as f64;
        variance += inflation * deviation(replicates.iter().copied()).powi(2);
    }
    Some(Bound { label, value, error: variance.sqrt(), systematic: 0.0, surfaces: Some(fewest) })
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0), |(sum, count), value| (sum + value, count + 1));
    sum / f64::from(count)
}

fn deviation(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let mean = mean(values.clone());
    let count = values.clone().count() as f64;
    let squares: f64 = values.map(|value| (value - mean).powi(2)).sum();
    // A constant differs from its mean by rounding alone.
    let deviation = (squares / (count - 1.0)).sqrt();
    if deviation > 1e-13 * mean.abs() { deviation } else { 0.0 }
}

#[cfg(test)]
mod tests;
