//! Statistics with a name: numbers from the curve of a group over its loads that no expression
//! gives.

use crate::evidence::{Group, nearest};
use asperity_mechanics::theory::persson;
use asperity_pipeline::study::claims::Statistic;
use asperity_statistics::evolution::{EvolutionProblem, Kappa, Quantity};
use asperity_statistics::intervals::Weights;
use asperity_statistics::pressure_growth::PressureGrowthProblem;
use asperity_statistics::{Curves, Window};

/// Range of the loads that count as light.
const LIGHT: Window = Window { from: 0.0, to: 0.06 };
/// Smallest number of light loads for a fit of the evolution law.
const ENOUGH_LOADS: usize = 10;
/// Range of the area fractions near full contact to which the exponent η is fitted.
const NEAR_FULL: std::ops::Range<f64> = 0.9..0.998;
/// Smallest mean number of open nodes at a load that enters the fit of η.
const ENOUGH_OPEN_NODES: f64 = 50.0;
/// Smallest and largest value of η in the fit.
const EXPONENTS: [f64; 2] = [0.5, 4.0];
/// Loads between which the exponent of the stiffness is computed.
const STIFFNESS: [f64; 2] = [0.01, 0.05];
/// Largest load at which a curve starts near first contact. The lightest of the paper's fifty loads
/// is 0.0012.
const FIRST_CONTACT: f64 = 0.005;

/// The curve of a group, with that of the second data of the claim, and the loads of the claim.
pub struct Curve<'a> {
    pub group: &'a Group,
    pub other: Option<&'a Group>,
    /// Indices of the loads at which the claim is tested.
    pub indices: Vec<usize>,
    /// Area of the statistic `at-area`.
    pub area: f64,
}

impl Curve<'_> {
    /// Returns whether the loads of the curve suffice for a statistic.
    pub fn has(&self, statistic: Statistic) -> bool {
        let Curve { group, other, indices, .. } = self;
        let loads = &group.loads;
        match statistic {
            Statistic::ThirdDifference => {
                indices.len() == 3 && indices.is_sorted_by(|one, other| one < other)
            }
            Statistic::CrossingOfPersson => loads.iter().any(|load| *load >= 0.5),
            Statistic::LeastConvexKappa
            | Statistic::PressureGrowth
            | Statistic::EvolutionResidual => {
                loads.iter().filter(|load| LIGHT.contains(**load)).count() >= ENOUGH_LOADS
            }
            Statistic::FullContactExponent => self.near_full_contact().len() >= 3,
            Statistic::AreaOfHalfError => {
                other.is_some_and(|other| other.loads == *loads)
                    && loads.first().is_some_and(|load| *load < FIRST_CONTACT)
            }
            Statistic::StiffnessExponent => self.stiffness_exponent(&Weights::ALL).is_some(),
            Statistic::LoadOfAgreement => self.common_loads().len() >= 2,
            _ => true,
        }
    }

    /// Returns the statistic, or `None` if the surfaces that `weights` selects do not determine it.
    pub fn value(&self, statistic: Statistic, weights: &Weights) -> Option<f64> {
        match statistic {
            Statistic::ThirdDifference => {
                let points = self.indices.iter().map(|&index| self.point(index, weights));
                Some(third_difference(&[(0.0, 0.0)].into_iter().chain(points).collect::<Vec<_>>()))
            }
            Statistic::CrossingOfPersson => self.crossing(weights),
            Statistic::LeastConvexKappa => {
                let curves = self.curves(weights)?;
                let problem = EvolutionProblem::new(&curves, Quantity::Slope, LIGHT).ok()?;
                Some(problem.fit(Kappa::LeastConvex).ok()?.law.kappa)
            }
            Statistic::PressureGrowth => {
                let fit = PressureGrowthProblem::new(&self.curves(weights)?, LIGHT).fit().ok()?;
                // Steps in which p̄ decreases have no logarithm. Without them the exponent is
                // biased.
                (fit.goodness.masked == 0).then_some(fit.exponent)
            }
            Statistic::EvolutionResidual => self.evolution_residual(weights),
            Statistic::FullContactExponent => self.full_contact_exponent(weights),
            Statistic::AreaOfHalfError => {
                let indices = 0..self.group.loads.len();
                let points = indices.map(|index| {
                    let (_, area) = self.point(index, weights);
                    let corrected = weights.mean(&self.other?.values[index]);
                    Some((area, 1.0 - corrected / area))
                });
                halved(&points.collect::<Option<Vec<_>>>()?)
            }
            Statistic::StiffnessExponent => self.stiffness_exponent(weights),
            Statistic::LoadOfAgreement => {
                let points = self.common_loads().into_iter().map(|(index, other)| {
                    let (load, value) = self.point(index, weights);
                    let other = weights.mean(&self.other?.values[other]);
                    Some((load, libm::log(value / other).abs()))
                });
                Some(first_beyond(&points.collect::<Option<Vec<_>>>()?, libm::log(1.1)))
            }
            Statistic::AtArea => self.ln_at_area(weights),
            _ => None,
        }
    }

    /// Returns a load and the mean of the values at this load.
    fn point(&self, index: usize, weights: &Weights) -> (f64, f64) {
        (self.group.loads[index], weights.mean(&self.group.values[index]))
    }

    /// Returns the area–load curves of the selected surfaces, up to the first load at which all
    /// surfaces are in full contact.
    fn curves(&self, weights: &Weights) -> Option<Curves> {
        let Group { loads, values, .. } = self.group;
        let is_open = |index: &usize| self.point(*index, &Weights::ALL).1 < 1.0;
        let open = (0..loads.len()).take_while(is_open);
        let by_load: Vec<Vec<f64>> =
            open.map(|index| weights.values(&values[index]).collect()).collect();
        let surfaces = 0..by_load.first()?.len();
        let areas = surfaces.map(|surface| by_load.iter().map(|areas| areas[surface]).collect());
        Curves::new(loads[..by_load.len()].to_vec(), areas.collect()).ok()
    }

    /// Returns the mean area at which the slope falls below Persson's. Slopes are difference
    /// quotients between neighbouring loads. The slope minus Persson's slope is interpolated
    /// linearly over the area.
    fn crossing(&self, weights: &Weights) -> Option<f64> {
        let mut before: Option<(f64, f64)> = None;
        for index in 1..self.group.loads.len() {
            let [from, to] = [index - 1, index].map(|index| self.point(index, weights));
            let area = 0.5 * (from.1 + to.1);
            // At light load the slopes of few surfaces scatter too much.
            if area < 0.2 {
                continue;
            }
            let excess = (to.1 - from.1) - (persson::area(to.0) - persson::area(from.0));
            let excess = excess / (to.0 - from.0);
            if let Some((area_before, excess_before)) = before
                && excess <= 0.0
                && excess_before > 0.0
            {
                let share = excess_before / (excess_before - excess);
                return Some(area_before + share * (area - area_before));
            }
            before = Some((area, excess));
        }
        None
    }

    fn evolution_residual(&self, weights: &Weights) -> Option<f64> {
        let below = |index: &usize| self.point(*index, &Weights::ALL).1 < 0.2;
        let last = (0..self.group.loads.len()).rfind(below)?;
        let window = Window { from: 0.0, to: self.group.loads[last] };
        let curves = self.curves(weights)?;
        let problem = EvolutionProblem::new(&curves, Quantity::Area, window).ok()?;
        let fit = problem.fit(Kappa::Free).ok()?;
        let rests = (0..=last).map(|index| {
            let (load, area) = self.point(index, weights);
            (fit.law.area(load) / area - 1.0).powi(2)
        });
        Some((rests.sum::<f64>() / (last + 1) as f64).sqrt())
    }

    /// Returns the indices of the loads for the exponent of the approach to full contact.
    fn near_full_contact(&self) -> Vec<usize> {
        let nodes = self.group.number("nodes").unwrap_or(f64::INFINITY).powi(2);
        let is_near = |index: &usize| {
            let (_, area) = self.point(*index, &Weights::ALL);
            NEAR_FULL.contains(&area) && (1.0 - area) * nodes > ENOUGH_OPEN_NODES
        };
        (0..self.group.loads.len()).filter(is_near).collect()
    }

    /// Fits c and η of F(y) − [F_P(y) − 2y²] = c + (√2 y)^η by least squares, and returns η. F is
    /// the approach to full contact −ln[(1 − a) y √(2π)], and F_P is F in Persson's theory.
    fn full_contact_exponent(&self, weights: &Weights) -> Option<f64> {
        let point = |index: usize| {
            let (load, area) = self.point(index, weights);
            let approach = persson::approach_to_full_contact(load, 1.0 - area)?;
            let rest = persson::approach(load) - 2.0 * load * load;
            Some((std::f64::consts::SQRT_2 * load, approach - rest))
        };
        let points: Vec<(f64, f64)> =
            self.near_full_contact().into_iter().map(point).collect::<Option<_>>()?;
        let residual = |exponent: f64| {
            let rests = points.iter().map(|(x, f)| f - libm::pow(*x, exponent));
            let mean = rests.clone().sum::<f64>() / points.len() as f64;
            rests.map(|rest| (rest - mean).powi(2)).sum::<f64>()
        };
        Some(least(residual, EXPONENTS))
    }

    /// Returns the exponent d ln K/d ln y of the stiffness K between two loads.
    fn stiffness_exponent(&self, weights: &Weights) -> Option<f64> {
        let [light, heavy] = STIFFNESS.map(|load| self.stiffness(load, weights));
        let ((load, stiffness), (other_load, other)) = (light?, heavy?);
        let is_rising = stiffness > 0.0 && other > 0.0 && other_load > load;
        is_rising.then(|| libm::log(other / stiffness) / libm::log(other_load / load))
    }

    /// Returns (logarithmic mean of the two loads next to `load`, stiffness K between these loads).
    /// For an exponential law of the gap, K = (y₂ − y₁)/(ū₁ − ū₂) is the exact stiffness at the
    /// logarithmic mean of the loads, for any spacing of the loads.
    fn stiffness(&self, load: f64, weights: &Weights) -> Option<(f64, f64)> {
        let index = nearest(&self.group.loads, load)?;
        let (before, after) = (index.checked_sub(1)?, index + 1);
        self.group.loads.get(after)?;
        let [(one, gap), (other, next)] = [before, after].map(|index| self.point(index, weights));
        Some(((other - one) / libm::log(other / one), (other - one) / (gap - next)))
    }

    /// Returns the indices of the loads that both data have.
    fn common_loads(&self) -> Vec<(usize, usize)> {
        let Some(other) = self.other else { return Vec::new() };
        let indices = 0..self.group.loads.len();
        let common = |index: usize| Some((index, same_load(other, self.group.loads[index])?));
        indices.filter_map(common).collect()
    }

    /// Returns the logarithm of the value at an area between those of two loads.
    fn ln_at_area(&self, weights: &Weights) -> Option<f64> {
        let common = self.common_loads();
        let mean = |index: usize| weights.mean(&self.other.expect("it has loads").values[index]);
        let after = common.iter().position(|(_, area)| mean(*area) >= self.area)?;
        let (before, after) = (common[after.checked_sub(1)?], common[after]);
        let [low, high] = [before, after].map(|(_, area)| mean(area));
        let [of_low, of_high] =
            [before, after].map(|(index, _)| libm::log(self.point(index, weights).1));
        let share = (self.area - low) / (high - low);
        Some(of_low + share * (of_high - of_low)).filter(|value| value.is_finite())
    }
}

/// Returns the index of a load, to the three digits to which geometrically spaced loads are
/// rounded.
pub fn same_load(group: &Group, load: f64) -> Option<usize> {
    if load.is_nan() {
        return (!group.loads.is_empty()).then_some(0);
    }
    nearest(&group.loads, load).filter(|&index| (group.loads[index] / load - 1.0).abs() < 1e-3)
}

/// Returns the third divided difference of four points.
fn third_difference(points: &[(f64, f64)]) -> f64 {
    let first =
        [0, 1, 2].map(|i| (points[i + 1].1 - points[i].1) / (points[i + 1].0 - points[i].0));
    let second = [0, 1].map(|i| (first[i + 1] - first[i]) / (points[i + 2].0 - points[i].0));
    (second[1] - second[0]) / (points[3].0 - points[0].0)
}

/// Returns the position of the minimum of a unimodal function, by golden-section search.
fn least(function: impl Fn(f64) -> f64, [mut low, mut high]: [f64; 2]) -> f64 {
    let section = 0.5 * (5_f64.sqrt() - 1.0);
    while high - low > 1e-7 {
        let (left, right) = (high - section * (high - low), low + section * (high - low));
        if function(left) < function(right) {
            high = right;
        } else {
            low = left;
        }
    }
    0.5 * (low + high)
}

/// Returns the area at which the error falls to half of its first value, by linear interpolation.
/// `curve` has points (area, error).
fn halved(curve: &[(f64, f64)]) -> Option<f64> {
    let half = 0.5 * curve.first()?.1;
    let crossing = curve.windows(2).find(|pair| pair[1].1 <= half)?;
    let [(area, error), (next_area, next_error)] = [crossing[0], crossing[1]];
    let share = (error - half) / (error - next_error);
    Some(area + share * (next_area - area))
}

/// Returns the smallest load at which the deviation exceeds `limit`, interpolated linearly in the
/// logarithm of the load. `points` are pairs (load, deviation). Returns the first load if the
/// deviation exceeds `limit` there, and the last load if the deviation never exceeds `limit`.
fn first_beyond(points: &[(f64, f64)], limit: f64) -> f64 {
    match points.iter().position(|(_, deviation)| *deviation > limit) {
        Some(0) => points[0].0,
        None => points[points.len() - 1].0,
        Some(index) => {
            let [(load, within), (next, beyond)] = [points[index - 1], points[index]];
            let share = (limit - within) / (beyond - within);
            load * libm::pow(next / load, share)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use asperity_stages::ensemble::ParameterPoint;

    #[test]
    fn the_third_divided_difference_of_a_cubic_is_its_coefficient() {
        let cubic = |x: f64| (x, 2.0 * x - 3.0 * x * x + 5.0 * x.powi(3));
        let points = [0.0, 0.005, 0.02, 0.06].map(cubic);
        assert!((third_difference(&points) - 5.0).abs() < 1e-9);
    }

    #[test]
    fn an_error_that_falls_linearly_is_halved_half_way() {
        let curve = [(0.0, 0.4), (0.1, 0.36), (0.6, 0.16), (1.0, 0.0)];
        assert!((halved(&curve).unwrap() - 0.5).abs() < 1e-15);
        assert_eq!(halved(&curve[..2]), None);
    }

    #[test]
    fn a_deviation_passes_its_limit_between_two_loads() {
        let points = [(0.001, 0.0), (0.01, 0.1), (0.1, 0.2)];
        assert!((first_beyond(&points, 0.15) - 0.1_f64.powf(1.5)).abs() < 1e-15);
        assert_eq!(first_beyond(&points, -0.1), 0.001);
        assert_eq!(first_beyond(&points, 0.3), 0.1);
    }

    /// Returns a group with the values of its surfaces at each load.
    fn group(loads: Vec<f64>, values: Vec<Vec<f64>>) -> Group {
        Group {
            point: ParameterPoint::default(),
            name: String::new(),
            values,
            given: loads.clone(),
            loads,
            systematic: 0.0,
            has_scatter: true,
            estimate: None,
        }
    }

    #[test]
    fn the_areas_of_a_curve_end_where_all_surfaces_are_in_full_contact() {
        let loads = vec![0.5, 1.0, 1.5, 2.0];
        let values = vec![vec![0.6, 0.7], vec![0.9, 1.0], vec![1.0, 1.0], vec![1.0, 1.0]];
        let group = group(loads, values);
        let curve = Curve { group: &group, other: None, indices: Vec::new(), area: 0.0 };
        let curves = curve.curves(&Weights::ALL).unwrap();
        assert_eq!((curves.surfaces(), curves.loads().len()), (2, 2));
    }

    #[test]
    fn of_an_exponential_the_stiffness_is_proportional_however_loads_are_spaced() {
        for loads in
            [vec![0.009, 0.01, 0.011, 0.045, 0.05, 0.055], vec![0.003, 0.01, 0.02, 0.05, 0.4]]
        {
            let values = loads.iter().map(|load: &f64| vec![-0.4 * load.ln()]).collect();
            let group = group(loads, values);
            let curve = Curve { group: &group, other: None, indices: Vec::new(), area: 0.0 };
            let found = curve.value(Statistic::StiffnessExponent, &Weights::ALL).unwrap();
            assert!((found - 1.0).abs() < 1e-12, "{found}");
        }
    }
}
