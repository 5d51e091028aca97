//! Student's t distribution: how far a mean of few values may lie from the truth.

use std::f64::consts::{FRAC_PI_2, PI};

/// Halvings of the interval that holds a quantile: as many as a double has digits, and some.
const HALVINGS: u32 = 64;

/// The t with |T| ≤ t at the given probability (between 0 and 1), for one or more degrees of
/// freedom.
pub fn two_sided_quantile(probability: f64, freedom: u32) -> f64 {
    let (mut below, mut above) = (0.0, FRAC_PI_2);
    for _ in 0..HALVINGS {
        let middle = 0.5 * (below + above);
        match within(middle, freedom) < probability {
            true => below = middle,
            false => above = middle,
        }
    }
    f64::from(freedom).sqrt() * (0.5 * (below + above)).tan()
}

/// P(|T| ≤ √ν tan θ) for ν degrees of freedom: the finite sums 26.7.3 and 26.7.4 of Abramowitz &
/// Stegun, *Handbook of Mathematical Functions* (1964).
fn within(angle: f64, freedom: u32) -> f64 {
    let (sine, cosine) = angle.sin_cos();
    // The terms rise by two powers of the cosine; the first one is 1 or, where ν is odd, cos θ.
    let is_odd = freedom % 2 == 1;
    let mut term = if is_odd { cosine } else { 1.0 };
    let mut sum = 0.0;
    for power in (u32::from(is_odd)..freedom.saturating_sub(1)).step_by(2) {
        sum += term;
        term *= cosine * cosine * f64::from(power + 1) / f64::from(power + 2);
    }
    match is_odd {
        true => (angle + sine * sum) * 2.0 / PI,
        false => sine * sum,
    }
}

#[cfg(test)]
mod tests {
    use super::super::examples::normal;
    use super::*;

    #[test]
    fn quantiles_are_those_of_the_tables() {
        // Two-sided 90, 95 and 99 %, as printed to four digits.
        let printed = [
            (1, [6.314, 12.706, 63.657]),
            (2, [2.920, 4.303, 9.925]),
            (4, [2.132, 2.776, 4.604]),
            (9, [1.833, 2.262, 3.250]),
            (49, [1.677, 2.010, 2.680]),
        ];
        for (freedom, quantiles) in printed {
            for (probability, quantile) in [0.9, 0.95, 0.99].into_iter().zip(quantiles) {
                let found = two_sided_quantile(probability, freedom);
                assert!((found - quantile).abs() < 5.1e-4, "{freedom}: {found}");
            }
        }
    }

    #[test]
    fn one_and_two_degrees_of_freedom_have_closed_forms() {
        for probability in [0.1, 0.5, 0.95, 0.999] {
            let cauchy = (FRAC_PI_2 * probability).tan();
            let found = two_sided_quantile(probability, 1);
            assert!((found / cauchy - 1.0).abs() < 1e-12, "{found}");
            let two: f64 = probability * (2.0 / (1.0 - probability * probability)).sqrt();
            let found = two_sided_quantile(probability, 2);
            assert!((found / two - 1.0).abs() < 1e-12, "{found}");
        }
    }

    #[test]
    fn many_degrees_of_freedom_are_normal() {
        // Cornish & Fisher: t = z + (z³ + z)/(4ν) + O(ν⁻²).
        let normal = 1.959_963_984_540_054_f64;
        let correction = (normal.powi(3) + normal) / 4.0;
        for freedom in [10_000, 10_001] {
            let found = two_sided_quantile(0.95, freedom);
            let expected = normal + correction / f64::from(freedom);
            assert!((found - expected).abs() < 1e-7, "{found}");
        }
    }

    #[test]
    fn intervals_of_the_mean_cover_it_at_the_nominal_rate_however_few_the_values() {
        for count in [3, 5, 10] {
            let experiments = 2000;
            let covered = (0..experiments).filter(|&experiment| {
                let values = normal(experiment, count);
                let mean = values.iter().sum::<f64>() / count as f64;
                let square = values.iter().map(|value| (value - mean).powi(2));
                let freedom = count as f64 - 1.0;
                let error = (square.sum::<f64>() / freedom / count as f64).sqrt();
                mean.abs() <= two_sided_quantile(0.95, count as u32 - 1) * error
            });
            // Binomial: 0.005 over 2000 experiments. Percentiles of resamples cover 0.84 at five.
            let rate = covered.count() as f64 / experiments as f64;
            assert!((rate - 0.95).abs() < 0.02, "{count}: {rate}");
        }
    }
}
