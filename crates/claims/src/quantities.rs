//! The quantities of a claim, gathered one by one; steps from an ensemble to the next in one
//! cutoff.

use crate::evidence::{AreaCurves, Evidence, Spectrum};
use crate::{Claim, ClaimOutcome, Judgement, Statement};
use asperity_stages::correct::{AS_COUNTED, OF_2015, OF_2017};
use asperity_statistics::intervals::{Bound, FEWEST_SURFACES, Weights, jackknife};

/// Quantities that one claim is about.
#[derive(Default)]
pub struct Quantities {
    bounds: Vec<Bound>,
    /// Whether there were some with too few surfaces to have an interval.
    lacks_surfaces: bool,
    /// Those that have no value, of all surfaces or without one of them.
    without_value: Vec<String>,
}

impl Quantities {
    /// Adds one that rests on ensembles of these numbers of surfaces.
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

    /// The same of a quantity that has a systematic error besides.
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

    /// The claim that all of them are as expected; `needs` says what a study without any lacks.
    pub fn judge(
        self,
        statement: Statement,
        data: &'static str,
        needs: impl FnOnce() -> String,
    ) -> Claim {
        let judgement = Judgement::of(statement.expected, self.bounds)
            .map(|judgement| judgement.beside(&self.without_value));
        let outcome = judgement.map_or_else(
            || {
                let few = format!(
                    "{FEWEST_SURFACES} surfaces or more of each spectrum: of fewer the scatter is \
                     not known"
                );
                ClaimOutcome::NotComputed(match (self.lacks_surfaces, self.without_value.last()) {
                    (true, _) => few,
                    (false, Some(label)) => {
                        format!("curves that tell it: it has no value for {label}")
                    }
                    (false, None) => needs(),
                })
            },
            ClaimOutcome::Judged,
        );
        Claim { statement, data, outcome }
    }
}

/// Words for the area under a correction.
pub fn data(correction: &str) -> &'static str {
    match correction {
        AS_COUNTED => "counted area",
        OF_2015 => "area corrected by π/8",
        OF_2017 => "area corrected by 2017",
        _ => "corrected area",
    }
}

/// What a study lacks for a claim about curves under a correction, at any of some loads, and about
/// spectra of some sort: the first of these that is missing.
pub fn needs(evidence: &Evidence, correction: &str, loads: &[f64], spectra: &str) -> String {
    let all = evidence.under(correction);
    if all.is_empty() {
        return match correction {
            AS_COUNTED => "a `measure` stage over contacts of random surfaces".to_owned(),
            _ => format!("a `correct` stage with `correction = \"{correction}\"`"),
        };
    }
    let own = evidence.of_the_paper(correction);
    if own.is_empty() {
        return "surfaces as the paper has them: `hurst = 0.8`, no plateau, eight nodes or more to the \
                shortest wavelength"
            .to_owned();
    }
    let has_one = |load: &&f64| own.iter().any(|ensemble| ensemble.at(**load).is_some());
    if let (Some(&first), None) = (loads.first(), loads.iter().find(has_one)) {
        let wanted: Vec<String> = loads.iter().map(f64::to_string).collect();
        let known = own.iter().flat_map(|ensemble| &ensemble.loads);
        let nearest = known.min_by(|a, b| (*a - first).abs().total_cmp(&(*b - first).abs()));
        let nearest =
            nearest.map_or_else(String::new, |load| format!("; the nearest to {first} is {load}"));
        return format!("a load at {}{nearest}", wanted.join(" or "));
    }
    spectra.to_owned()
}

/// `load 0.06`, in as many digits as a reader needs.
pub fn under(load: f64) -> String {
    format!("load {:.3}", load)
}

/// Ensembles on one mesh and of one Hurst exponent, together.
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

/// The places of a load in all of some ensembles, if less than four fifths touch there in each.
pub fn below_four_fifths(family: &[&AreaCurves], load: f64) -> Option<Vec<usize>> {
    let places: Option<Vec<usize>> = family.iter().map(|one| one.at(load)).collect();
    let mut members = family.iter().zip(places.as_ref()?);
    let are_below = members.all(|(one, &place)| one.mean(place) <= 0.8);
    places.filter(|_| are_below)
}

/// The surfaces of some ensembles.
pub fn surfaces(ensembles: &[&AreaCurves]) -> Vec<usize> {
    ensembles.iter().map(|ensemble| ensemble.surfaces()).collect()
}

/// How the logarithm of a quantity depends on two variables: c + s x₁ + t x₂ by least squares over
/// ensembles. `None` where they do not tell the variables apart.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// s and t.
    pub slopes: [f64; 2],
}

impl Plane {
    /// Fits a quantity of each ensemble at a place, over ln k_lower and ln k_upper.
    pub fn over_cutoffs(
        family: &[&AreaCurves],
        places: &[usize],
        quantity: impl Fn(&AreaCurves, usize) -> f64,
    ) -> Option<Plane> {
        let point = |(one, &place): (&&AreaCurves, &usize)| {
            let Spectrum { k_lower, k_upper, .. } = one.spectrum;
            [k_lower as f64, k_upper as f64, quantity(one, place)].map(f64::ln)
        };
        let points: Vec<[f64; 3]> = family.iter().zip(places).map(point).collect();
        Plane::through(&points)
    }

    /// Fits points (x₁, x₂, ln q).
    pub fn through(points: &[[f64; 3]]) -> Option<Plane> {
        /// Variables that are this nearly proportional are one variable.
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
    fn of(self, spectrum: &Spectrum) -> i64 {
        match self {
            Cutoff::Lower => spectrum.k_lower,
            Cutoff::Upper => spectrum.k_upper,
        }
    }

    /// Of what differs from a spectrum in this cutoff alone, the next one that is greater in it.
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
                && self.of(other) > self.of(from)
                && from.is_plain()
                && other.is_plain()
                && (from.hurst, from.nodes) == (other.hurst, other.nodes)
        };
        all.iter().filter(is_beyond).min_by_key(|other| self.of(spectrum(other)))
    }

    fn name(self) -> &'static str {
        match self {
            Cutoff::Lower => "k_lower",
            Cutoff::Upper => "k_upper",
        }
    }
}

/// Two ensembles that differ in one cutoff alone, neighbours in it.
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

    /// The places of a load in both, if less than four fifths touch there.
    pub fn at(&self, load: f64) -> Option<[usize; 2]> {
        let places = [self.lesser.at(load)?, self.greater.at(load)?];
        let most = self.lesser.mean(places[0]).max(self.greater.mean(places[1]));
        (most <= 0.8).then_some(places)
    }

    /// ln of the greater one's mean area over the lesser one's.
    pub fn ln_ratio(&self, [one, other]: [usize; 2], weights: &Weights) -> f64 {
        let greater = weights.mean(&self.greater.areas[other]);
        (greater / weights.mean(&self.lesser.areas[one])).ln()
    }

    pub fn surfaces(&self) -> [usize; 2] {
        [self.lesser.surfaces(), self.greater.surfaces()]
    }

    /// `k_lower 4, k_upper 32, k_lower 16 over it`.
    pub fn name(&self, evidence: &Evidence) -> String {
        let name = evidence.name(&self.lesser.spectrum);
        let greater = self.cutoff.of(&self.greater.spectrum);
        format!("{name}, {} {greater} over it", self.cutoff.name())
    }

    /// `k_lower 4, k_upper 32, k_lower 16 over it, load 0.060`.
    pub fn label(&self, evidence: &Evidence, place: usize) -> String {
        format!("{}, {}", self.name(evidence), under(self.lesser.loads[place]))
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
