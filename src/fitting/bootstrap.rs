//! Intervals of fitted parameters, by resampling whole surfaces.
//!
//! The areas of one surface under neighbouring loads are strongly correlated, so loads are never
//! drawn one by one: a replicate takes each surface a number of times, and all its loads with it.
//! Percentile intervals are known to be short for few surfaces, by about √(1 − 1/n).

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};

use super::FitError;

/// Share of the replicates that must give a fit: intervals of the fortunate rest would mislead.
const LEAST_SUCCESS: f64 = 0.9;

/// How to resample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bootstrap {
    /// Number of resamples; none for no intervals.
    pub replicates: usize,
    /// Seed of the draws.
    pub seed: u64,
    /// Probability that an interval should cover the truth, between 0 and 1.
    pub level: f64,
}

/// What resampling says of one parameter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Percentile (1 − level)/2 of the replicates.
    pub lower: f64,
    /// Percentile (1 + level)/2 of the replicates.
    pub upper: f64,
    /// Standard deviation of the replicates.
    pub standard_error: f64,
}

/// Intervals of all parameters of a fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Intervals {
    /// In the order of the parameters; `None` for a single surface, without replicates, or if
    /// more than a tenth of them failed.
    pub intervals: Option<Vec<Interval>>,
    /// Replicates drawn.
    pub replicates: usize,
    /// Replicates whose fit failed.
    pub failed: usize,
}

impl Bootstrap {
    /// Refits every replicate; `refit` maps the multiplicities of the surfaces to parameters.
    ///
    /// Two calls with as many surfaces draw the same replicates, so the differences of paired
    /// curves (the same realizations under other cutoffs) may be taken inside one `refit`.
    pub fn intervals(
        &self,
        surfaces: usize,
        mut refit: impl FnMut(&[u32]) -> Result<Vec<f64>, FitError>,
    ) -> Intervals {
        if surfaces < 2 || self.replicates == 0 {
            return Intervals {
                intervals: None,
                replicates: 0,
                failed: 0,
            };
        }
        let mut multiplicities = vec![0; surfaces];
        let mut successes = Vec::with_capacity(self.replicates);
        for replicate in 0..self.replicates {
            self.draw(replicate, &mut multiplicities);
            successes.extend(refit(&multiplicities));
        }
        let enough = successes.len() as f64 >= LEAST_SUCCESS * self.replicates as f64;
        Intervals {
            intervals: enough.then(|| self.percentiles(&successes)),
            replicates: self.replicates,
            failed: self.replicates - successes.len(),
        }
    }

    /// Draws how many times each surface appears in a replicate, as a function of the seed, the
    /// replicate and the number of surfaces alone: more replicates keep the earlier ones.
    pub fn draw(&self, replicate: usize, multiplicities: &mut [u32]) {
        let surfaces = multiplicities.len() as u64;
        let mut key = [0; 32];
        key[..8].copy_from_slice(&self.seed.to_le_bytes());
        key[8..16].copy_from_slice(&surfaces.to_le_bytes());
        let mut random = ChaCha8Rng::from_seed(key);
        random.set_stream(replicate as u64);
        multiplicities.fill(0);
        for _ in 0..surfaces {
            // High word of the product: uniform to 2⁻⁶⁴ n, and the same in every release of rand.
            let drawn = (u128::from(random.next_u64()) * u128::from(surfaces)) >> 64;
            multiplicities[drawn as usize] += 1;
        }
    }

    fn percentiles(&self, replicates: &[Vec<f64>]) -> Vec<Interval> {
        let tail = 0.5 * (1.0 - self.level);
        (0..replicates[0].len())
            .map(|parameter| {
                let mut values: Vec<f64> = replicates.iter().map(|fit| fit[parameter]).collect();
                values.sort_by(f64::total_cmp);
                Interval {
                    lower: quantile(&values, tail),
                    upper: quantile(&values, 1.0 - tail),
                    standard_error: standard_deviation(&values),
                }
            })
            .collect()
    }
}

/// Quantile of ascending values, linear between the order statistics.
fn quantile(ascending: &[f64], probability: f64) -> f64 {
    let last = ascending.len() - 1;
    let place = probability.clamp(0.0, 1.0) * last as f64;
    let below = (place.floor() as usize).min(last);
    let above = (below + 1).min(last);
    ascending[below] + (place - below as f64) * (ascending[above] - ascending[below])
}

fn standard_deviation(values: &[f64]) -> f64 {
    let count = values.len() as f64;
    let mean = values.iter().sum::<f64>() / count;
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    (squares / (count - 1.0).max(1.0)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::super::examples::normal;
    use super::super::{Curves, Window};
    use super::*;

    const BOOTSTRAP: Bootstrap = Bootstrap {
        replicates: 400,
        seed: 7,
        level: 0.9,
    };

    fn mean_of(values: &[f64]) -> impl Fn(&[u32]) -> Result<Vec<f64>, FitError> {
        move |times| {
            let sum: f64 = values
                .iter()
                .zip(times)
                .map(|(v, &t)| v * f64::from(t))
                .sum();
            Ok(vec![sum / values.len() as f64])
        }
    }

    fn interval_of_the_mean(values: &[f64]) -> Interval {
        BOOTSTRAP
            .intervals(values.len(), mean_of(values))
            .intervals
            .expect("no failures")[0]
    }

    #[test]
    fn every_replicate_has_as_many_surfaces_as_the_sample() {
        let mut multiplicities = vec![0; 13];
        for replicate in 0..100 {
            BOOTSTRAP.draw(replicate, &mut multiplicities);
            assert_eq!(multiplicities.iter().sum::<u32>(), 13);
        }
    }

    #[test]
    fn surfaces_are_drawn_evenly() {
        let (mut multiplicities, mut total) = (vec![0; 5], vec![0; 5]);
        for replicate in 0..4000 {
            BOOTSTRAP.draw(replicate, &mut multiplicities);
            total
                .iter_mut()
                .zip(&multiplicities)
                .for_each(|(total, times)| *total += times);
        }
        // Binomial with 20000 trials of probability 1/5: a standard deviation of 57.
        assert!(
            total.iter().all(|&total| total.abs_diff(4000) < 200),
            "{total:?}"
        );
    }

    #[test]
    fn more_replicates_keep_the_earlier_ones() {
        let drawn = |replicates| {
            let mut drawn = Vec::new();
            Bootstrap {
                replicates,
                ..BOOTSTRAP
            }
            .intervals(6, |times| {
                drawn.push(times.to_vec());
                Ok(vec![0.0])
            });
            drawn
        };
        assert_eq!(drawn(200)[..50], drawn(50));
    }

    #[test]
    fn seed_changes_the_draws() {
        let drawn = |seed| {
            let mut multiplicities = vec![0; 20];
            Bootstrap { seed, ..BOOTSTRAP }.draw(0, &mut multiplicities);
            multiplicities
        };
        assert_ne!(drawn(1), drawn(2));
    }

    #[test]
    fn resampling_never_mixes_loads_of_different_surfaces() {
        // Every surface is proportional to the load, so every mean of whole surfaces is.
        let loads = vec![0.1, 0.2, 0.4];
        let areas = (1..=7)
            .map(|k| loads.iter().map(|y| f64::from(k) * y).collect())
            .collect();
        let data = Curves::new(loads, areas)
            .expect("well formed")
            .area_data(Window::ALL);
        let mut multiplicities = vec![0; 7];
        for replicate in 0..100 {
            BOOTSTRAP.draw(replicate, &mut multiplicities);
            let mean = data.resampled_mean(&multiplicities);
            assert!((mean[1] / mean[0] - 2.0).abs() < 1e-14);
            assert!((mean[2] / mean[0] - 4.0).abs() < 1e-14);
        }
    }

    #[test]
    fn intervals_of_the_mean_cover_it_at_about_the_nominal_rate() {
        let experiments = 400;
        let covered = (0..experiments)
            .filter(|&experiment| {
                let interval = interval_of_the_mean(&normal(experiment, 30));
                interval.lower <= 0.0 && 0.0 <= interval.upper
            })
            .count();
        // 30 surfaces shorten the interval by 1.7 % and Student's tails cost another 1.6 %: 0.88,
        // give or take 0.016 over 400 experiments.
        let rate = covered as f64 / experiments as f64;
        assert!((rate - 0.88).abs() < 0.045, "covered {rate}");
    }

    #[test]
    fn intervals_narrow_as_one_over_the_root_of_the_number_of_surfaces() {
        let width = |surfaces: usize| {
            let widths = (0..20).map(|experiment| {
                let interval = interval_of_the_mean(&normal(experiment, surfaces));
                interval.upper - interval.lower
            });
            widths.sum::<f64>() / 20.0
        };
        // Each mean width is known to some 2 %.
        assert!((width(25) / width(100) - 2.0).abs() < 0.15);
        // ±1.645 standard errors.
        assert!((width(100) - 0.329).abs() < 0.03);
    }

    #[test]
    fn standard_error_is_that_of_the_mean() {
        let error = interval_of_the_mean(&normal(3, 100)).standard_error;
        // 1/√100, known to 1/√200 from the sample and 1/√800 from the replicates.
        assert!((error - 0.1).abs() < 0.02);
    }

    #[test]
    fn failed_replicates_are_counted_and_too_many_leave_no_interval() {
        let failing_every = |period: usize| {
            let mut calls = 0;
            BOOTSTRAP.intervals(4, |_| {
                calls += 1;
                if calls % period == 0 {
                    Err(FitError::Kappa { kappa: 0.0 })
                } else {
                    Ok(vec![1.0])
                }
            })
        };
        let few = failing_every(20);
        assert_eq!((few.failed, few.intervals.is_some()), (20, true));
        let many = failing_every(4);
        assert_eq!((many.failed, many.intervals), (100, None));
    }

    #[test]
    fn single_surface_or_no_replicates_give_no_interval() {
        assert_eq!(BOOTSTRAP.intervals(1, |_| Ok(vec![1.0])).intervals, None);
        let none = Bootstrap {
            replicates: 0,
            ..BOOTSTRAP
        };
        assert_eq!(none.intervals(5, |_| Ok(vec![1.0])).intervals, None);
    }
}
