//! Two ensembles beside each other that differ in one cutoff alone.

use super::evidence::{AreaCurves, Evidence, Spectrum};
use super::quantities::{neighbours, under};
use asperity_statistics::intervals::Weights;

/// One of the cutoffs of a spectrum.
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
    /// Every step between neighbours.
    pub fn all(ensembles: &[&'a AreaCurves], cutoff: Cutoff) -> Vec<Step<'a>> {
        let [varied, fixed]: [fn(&Spectrum) -> i64; 2] = match cutoff {
            Cutoff::Lower => [|s| s.k_lower, |s| s.k_upper],
            Cutoff::Upper => [|s| s.k_upper, |s| s.k_lower],
        };
        let pairs = neighbours(ensembles, varied, fixed).into_iter();
        pairs.map(|[lesser, greater]| Step { lesser, greater, cutoff }).collect()
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

    /// How many surfaces both have.
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
