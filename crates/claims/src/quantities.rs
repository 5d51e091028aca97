//! The quantities of a claim, pairs of ensembles with neighbouring cutoffs, and the requirements
//! that a study does not meet.

use crate::evidence::{AreaCurves, Evidence, Spectrum};
use crate::{Claim, ClaimOutcome, Judgement, Statement};
use asperity_stages::correct::{AS_COUNTED, OF_2015, OF_2017};
use asperity_statistics::intervals::{Bound, FEWEST_SURFACES, Weights, jackknife};

/// Quantities of one claim, with standard errors.
#[derive(Default)]
pub struct Quantities {
    bounds: Vec<Bound>,
    /// True if a quantity had too few surfaces for an interval.
    lacks_surfaces: bool,
    /// Labels of quantities that cannot be computed from all surfaces, or from all surfaces but
    /// one.
    without_value: Vec<String>,
}

impl Quantities {
    /// Adds a quantity, with its standard error from a jackknife over the surfaces. `value`
    /// computes the quantity from the surfaces that the weights select. `surfaces` holds the number
    /// of surfaces of each ensemble on which the quantity depends.
    pub fn add(
        &mut self,
        label: String,
        surfaces: &[usize],
        value: impl Fn(&Weights) -> Option<f64>,
    ) {
        let too_few = surfaces.iter().any(|&count| count < FEWEST_SURFACES);
        self.lacks_surfaces |= too_few;
        match jackknife(label.clone(), surfaces, value) {
            Some(bound) => self.bounds.push(bound),
            None if !too_few => self.without_value.push(label),
            None => {}
        }
    }

    /// Adds a quantity as [`Quantities::add`] does, with the additional systematic standard error
    /// `error`.
    pub fn add_rounded(
        &mut self,
        label: String,
        surfaces: &[usize],
        error: f64,
        value: impl Fn(&Weights) -> Option<f64>,
    ) {
        let known = self.bounds.len();
        self.add(label, surfaces, value);
        for bound in &mut self.bounds[known..] {
            bound.systematic = error;
        }
    }

    /// Judges the claim that all quantities are as expected. If there is no quantity, `needs`
    /// returns the requirement that the study does not meet.
    pub fn judge(
        self,
        statement: Statement,
        data: &'static str,
        needs: impl FnOnce() -> String,
    ) -> Claim {
        let judgement = Judgement::new(statement.expected, self.bounds)
            .map(|judgement| judgement.with_missing(&self.without_value));
        let outcome = judgement.map_or_else(
            || {
                let few = format!(
                    "{FEWEST_SURFACES} or more surfaces of each spectrum, to estimate their scatter"
                );
                ClaimOutcome::NotComputed(match (self.lacks_surfaces, self.without_value.last()) {
                    (true, _) => few,
                    (false, Some(label)) => {
                        format!("{}; the quantity cannot be computed for {label}", needs())
                    }
                    (false, None) => needs(),
                })
            },
            ClaimOutcome::Judged,
        );
        Claim { statement, data, outcome }
    }
}

/// Returns the text of [`Claim::data`](crate::Claim::data) for areas with a correction.
pub fn data(correction: &str) -> &'static str {
    match correction {
        AS_COUNTED => "counted area",
        OF_2015 => "area corrected by π/8",
        OF_2017 => "area corrected as in 2017",
        _ => "corrected area",
    }
}

/// Returns the first requirement that a study does not meet. The requirements are areas with the
/// correction, then spectra like the paper's, then one of `loads`. If the study meets them, returns
/// `spectra`, the description of the spectra that the claim needs.
pub fn needs(evidence: &Evidence, correction: &str, loads: &[f64], spectra: &str) -> String {
    let all = evidence.under(correction);
    if all.is_empty() {
        return match correction {
            AS_COUNTED => "a `measure` stage on contacts of random surfaces".to_owned(),
            _ => format!("a `correct` stage with `correction = \"{correction}\"`"),
        };
    }
    let own = evidence.of_the_paper(correction);
    if own.is_empty() {
        return "surfaces like those of the paper: `hurst = 0.8`, no plateau, and at least eight \
                nodes per shortest wavelength"
            .to_owned();
    }
    let has_one = |load: &&f64| own.iter().any(|ensemble| ensemble.at(**load).is_some());
    if let (Some(&first), None) = (loads.first(), loads.iter().find(has_one)) {
        let wanted: Vec<String> = loads.iter().map(f64::to_string).collect();
        let known = own.iter().flat_map(|ensemble| &ensemble.loads);
        let nearest = known.min_by(|a, b| (*a - first).abs().total_cmp(&(*b - first).abs()));
        let nearest = nearest
            .map_or_else(String::new, |load| format!("; the load nearest to {first} is {load}"));
        return format!("a load at {}{nearest}", wanted.join(" or "));
    }
    spectra.to_owned()
}

/// Returns a label such as `load 0.060`.
pub fn under(load: f64) -> String {
    format!("load {:.3}", load)
}

/// Groups ensembles with the same mesh and Hurst exponent.
pub fn families<'a>(ensembles: &[&'a AreaCurves]) -> Vec<Vec<&'a AreaCurves>> {
    let mut families: Vec<Vec<&AreaCurves>> = Vec::new();
    for &ensemble in ensembles {
        let of = |one: &AreaCurves| (one.spectrum.hurst, one.spectrum.nodes);
        match families.iter_mut().find(|family| of(family[0]) == of(ensemble)) {
            Some(family) => family.push(ensemble),
            None => families.push(vec![ensemble]),
        }
    }
    families
}

/// Returns the index of a load in each ensemble. Returns `None` if an ensemble does not have the
/// load, or has more than 80 % of the area in contact at this load.
pub fn below_four_fifths(family: &[&AreaCurves], load: f64) -> Option<Vec<usize>> {
    let indices: Option<Vec<usize>> = family.iter().map(|one| one.at(load)).collect();
    let mut members = family.iter().zip(indices.as_ref()?);
    let are_below = members.all(|(one, &index)| one.mean(index) <= 0.8);
    indices.filter(|_| are_below)
}

/// Returns the number of surfaces of each ensemble.
pub fn surfaces(ensembles: &[&AreaCurves]) -> Vec<usize> {
    ensembles.iter().map(|ensemble| ensemble.surfaces()).collect()
}

/// Least-squares plane ln q = c + s x₁ + t x₂ for a quantity q of several ensembles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// The slopes s and t.
    pub slopes: [f64; 2],
}

impl Plane {
    /// Fits a quantity of each ensemble against x₁ = ln k_lower and x₂ = ln k_upper. `indices`
    /// selects a load of each ensemble.
    pub fn over_cutoffs(
        family: &[&AreaCurves],
        indices: &[usize],
        quantity: impl Fn(&AreaCurves, usize) -> f64,
    ) -> Option<Plane> {
        let point = |(one, &index): (&&AreaCurves, &usize)| {
            let Spectrum { k_lower, k_upper, .. } = one.spectrum;
            [k_lower as f64, k_upper as f64, quantity(one, index)].map(libm::log)
        };
        let points: Vec<[f64; 3]> = family.iter().zip(indices).map(point).collect();
        Plane::through(&points)
    }

    /// Fits points (x₁, x₂, ln q). Returns `None` for fewer than four points or nearly collinear
    /// (x₁, x₂).
    pub fn through(points: &[[f64; 3]]) -> Option<Plane> {
        /// Smallest 1 − r² at which a plane is fitted, where r is the correlation of x₁ and x₂.
        const LEAST_DETERMINANT: f64 = 1e-6;
        let count = points.len() as f64;
        let mean = |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / count;
        let centre = [0, 1, 2].map(mean);
        let product = |a: usize, b: usize| {
            let terms = points.iter();
            let terms = terms.map(|point| (point[a] - centre[a]) * (point[b] - centre[b]));
            terms.sum::<f64>() / count
        };
        let (xx, xy, yy) = (product(0, 0), product(0, 1), product(1, 1));
        let (xz, yz) = (product(0, 2), product(1, 2));
        let determinant = xx * yy - xy * xy;
        if points.len() < 4 || determinant <= LEAST_DETERMINANT * xx * yy {
            return None;
        }
        let slopes = [(xz * yy - yz * xy) / determinant, (yz * xx - xz * xy) / determinant];
        Some(Plane { slopes })
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cutoff {
    Lower,
    Upper,
}

impl Cutoff {
    fn value(self, spectrum: &Spectrum) -> i64 {
        match self {
            Cutoff::Lower => spectrum.k_lower,
            Cutoff::Upper => spectrum.k_upper,
        }
    }

    /// Returns the item whose spectrum differs from `from` only by the next larger value of this
    /// cutoff. Spectra with a plateau are not compared.
    pub fn next<'a, T>(
        self,
        from: &Spectrum,
        all: &'a [T],
        spectrum: fn(&T) -> &Spectrum,
    ) -> Option<&'a T> {
        let fixed = |spectrum: &Spectrum| match self {
            Cutoff::Lower => spectrum.k_upper,
            Cutoff::Upper => spectrum.k_lower,
        };
        let is_beyond = |other: &&T| {
            let other = spectrum(other);
            fixed(from) == fixed(other)
                && self.value(other) > self.value(from)
                && from.is_plain()
                && other.is_plain()
                && (from.hurst, from.nodes) == (other.hurst, other.nodes)
        };
        all.iter().filter(is_beyond).min_by_key(|other| self.value(spectrum(other)))
    }

    fn name(self) -> &'static str {
        match self {
            Cutoff::Lower => "k_lower",
            Cutoff::Upper => "k_upper",
        }
    }
}

/// Two ensembles whose spectra differ only in one cutoff, with neighbouring values of this cutoff.
pub struct Step<'a> {
    pub lesser: &'a AreaCurves,
    pub greater: &'a AreaCurves,
    cutoff: Cutoff,
}

impl<'a> Step<'a> {
    pub fn all(ensembles: &[&'a AreaCurves], cutoff: Cutoff) -> Vec<Step<'a>> {
        let step = |&lesser: &&'a AreaCurves| {
            let greater = *cutoff.next(&lesser.spectrum, ensembles, |one| &one.spectrum)?;
            Some(Step { lesser, greater, cutoff })
        };
        ensembles.iter().filter_map(step).collect()
    }

    /// Returns the indices of a load in `lesser` and `greater`. Returns `None` if an ensemble does
    /// not have the load, or has more than 80 % of the area in contact at this load.
    pub fn at(&self, load: f64) -> Option<[usize; 2]> {
        let indices = [self.lesser.at(load)?, self.greater.at(load)?];
        let most = self.lesser.mean(indices[0]).max(self.greater.mean(indices[1]));
        (most <= 0.8).then_some(indices)
    }

    /// Returns ln(mean area of `greater` / mean area of `lesser`).
    pub fn ln_ratio(&self, [one, other]: [usize; 2], weights: &Weights) -> f64 {
        let greater = weights.mean(&self.greater.areas[other]);
        libm::log(greater / weights.mean(&self.lesser.areas[one]))
    }

    pub fn surfaces(&self) -> [usize; 2] {
        [self.lesser.surfaces(), self.greater.surfaces()]
    }

    /// Returns a label such as `k_lower 4, k_upper 32 → k_lower 16`.
    pub fn name(&self, evidence: &Evidence) -> String {
        let name = evidence.name(&self.lesser.spectrum);
        let greater = self.cutoff.value(&self.greater.spectrum);
        format!("{name} → {} {greater}", self.cutoff.name())
    }

    /// Returns a label such as `k_lower 4, k_upper 32 → k_lower 16, load 0.060`.
    pub fn label(&self, evidence: &Evidence, index: usize) -> String {
        format!("{}, {}", self.name(evidence), under(self.lesser.loads[index]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_is_found_and_two_proportional_variables_are_none() {
        let grid =
            [1.0, 2.0, 3.0].map(|x| [0.0, 1.0].map(|y: f64| [x, y, 0.3 - 0.04 * x + 0.02 * y]));
        let plane = Plane::through(&grid.concat()).unwrap();
        assert!((plane.slopes[0] + 0.04).abs() < 1e-15 && (plane.slopes[1] - 0.02).abs() < 1e-15);
        let line = [1.0, 2.0, 3.0, 4.0].map(|x| [x, 2.0 * x, x]);
        assert_eq!(Plane::through(&line), None);
    }
}
