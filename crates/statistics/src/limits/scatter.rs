//! How an observable scatters between surfaces: a power law of the small numbers, ln s = a₀ + Σ aⱼ ln xⱼ, by
//! least squares to the standard deviations of all points.

use nalgebra::{DMatrix, DVector};

use super::LimitPoint;
use super::linear::Design;

/// The law of the scatter between surfaces.
#[derive(Debug, Clone)]
pub struct Scatter {
    /// a₀, and aⱼ of each small number.
    coefficients: Vec<f64>,
}

impl Scatter {
    /// Of points that scatter, as few as there may be: what they do not tell apart is taken for
    /// constant.
    pub fn of(points: &[LimitPoint]) -> Scatter {
        let terms = points.first().map_or(0, |point| point.small.len());
        let logarithms = points.iter().map(|point| {
            let surfaces = point.observed.surfaces() as f64;
            let deviation = point.observed.standard_error() * surfaces.sqrt();
            libm::log(deviation) - bias(surfaces - 1.0)
        });
        let logarithms: Vec<f64> = logarithms.collect();
        let row = |point: usize, column: usize| match column {
            0 => 1.0,
            _ => libm::log(points[point].small[column - 1]),
        };
        let columns = DMatrix::from_fn(points.len(), 1 + terms, row);
        let design = (points.len() > 1 + terms).then(|| Design::new(columns));
        let coefficients = match design.flatten() {
            Some(design) => design.solve(&DVector::from_vec(logarithms)).as_slice().to_vec(),
            None => vec![logarithms.iter().sum::<f64>() / logarithms.len().max(1) as f64],
        };
        Scatter { coefficients }
    }

    /// Standard error of the mean over so many surfaces.
    pub fn standard_error(&self, small: &[f64], surfaces: usize) -> f64 {
        let slopes = self.coefficients.iter().skip(1).zip(small);
        let slopes = slopes.map(|(slope, small)| slope * libm::log(*small));
        let logarithm = self.coefficients[0] + slopes.sum::<f64>();
        libm::exp(logarithm) / (surfaces as f64).sqrt()
    }
}

/// Mean of ln(s/σ) of normal numbers with ν degrees of freedom, [ψ(ν/2) − ln(ν/2)]/2; what its expansion
/// leaves out is 0.035 at ν = 1 and below 0.001 from ν = 3 on.
fn bias(freedom: f64) -> f64 {
    -0.5 / freedom - 1.0 / (6.0 * freedom * freedom)
}

#[cfg(test)]
mod tests {
    use super::super::Observed;
    use super::*;
    use crate::examples::normal;

    #[test]
    fn scatter_that_is_a_power_of_small_numbers_is_found_without_bias() {
        let sigma = |small: f64| 0.3 * small.powf(1.5);
        let point = |place: usize| {
            let small = 0.9_f64.powi(place as i32 % 20);
            let draws = normal(place as u64, 4);
            let values = draws.iter().map(|z| 1.0 + sigma(small) * z).collect();
            LimitPoint { small: vec![small], observed: Observed::of_realizations(values) }
        };
        let points: Vec<LimitPoint> = (0..4000).map(point).collect();
        let scatter = Scatter::of(&points);
        for small in [0.15, 0.5, 1.0] {
            // ln s of four surfaces scatters by 0.5: 0.01 over 4000 points.
            let found = scatter.standard_error(&[small], 9) * 3.0 / sigma(small);
            assert!((found - 1.0).abs() < 0.04, "{small}: {found}");
        }
    }

    #[test]
    fn few_points_scatter_alike() {
        let point = |small: f64| LimitPoint {
            small: vec![small],
            observed: Observed::of_realizations(vec![1.0, 1.0 + 2.0_f64.sqrt()]),
        };
        let scatter = Scatter::of(&[point(1.0), point(0.5)]);
        let known = libm::exp(-bias(1.0));
        assert!((scatter.standard_error(&[0.1], 1) - known).abs() < 1e-14);
    }
}
