//! Parameters of profiles, ISO 21920-2:2021, with the older names and averages of ISO 4287:1997.
//!
//! A profile is a map with one line along x. It is evaluated on whole section lengths (sampling
//! lengths of ISO 4287), in the middle of the profile; the mean line is the mean height of this
//! part. The heights are those of the profile as it is: the filters λc and λs of ISO 16610-21 are
//! applied before.

use super::material_ratio::{MaterialRatioCurve, Stratified};
use super::surface::Surface;
use crate::grid::{Cell, Grid};

/// Smallest height of a hill and depth of a dale that count for RSm, as a fraction of Rp and Rv.
pub const DISCRIMINATION: f64 = 0.1;

/// Default number of sections of a profile whose section length is not given.
pub const DEFAULT_SECTIONS: usize = 5;

/// Coefficients of the local slope in ISO 4287 and ISO 21920-2, of z(i + 1), z(i + 2) and z(i + 3);
/// those of the points before have the opposite sign.
const SLOPE: [f64; 3] = [45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0];

/// Parameters of the heights of a profile. Lengths are in the unit of the profile.
#[derive(Debug, Clone, PartialEq)]
pub struct ProfileParameters {
    /// Number of whole sections in the profile.
    pub sections: usize,
    /// Section length, rounded to whole steps.
    pub section_length: f64,
    /// Arithmetic mean height Ra over the evaluation length.
    pub ra: f64,
    /// Root mean square height Rq over the evaluation length.
    pub rq: f64,
    /// Skewness Rsk over the evaluation length; `None` for a flat profile.
    pub rsk: Option<f64>,
    /// Kurtosis Rku over the evaluation length; `None` for a flat profile.
    pub rku: Option<f64>,
    /// Mean over the sections of the height of the highest point, Rp.
    pub rp: f64,
    /// Mean over the sections of the depth of the lowest point, Rv.
    pub rv: f64,
    /// Mean over the sections of the maximum height, Rz = Rp + Rv.
    pub rz: f64,
    /// Height between the lowest and the highest point of the evaluation length, Rt.
    pub rt: f64,
    /// Root mean square slope RΔq; `None` for fewer than seven points.
    pub rdq: Option<f64>,
    /// Mean spacing RSm of profile elements; `None` without a whole element.
    pub rsm: Option<f64>,
    /// Mean over the sections of their root mean square heights: Rq of ISO 4287.
    pub rq_of_sections: f64,
    /// Rk, Rpk, Rvk, and the material ratios Rmrk1 and Rmrk2 (Mr1 and Mr2 of ISO 13565-2).
    pub stratified: Stratified,
}

/// Whole sections of a profile, with heights above their mean line.
pub struct Evaluation {
    heights: Vec<f64>,
    step: f64,
    /// Number of points of a section.
    points: usize,
    /// Material ratio curve of the evaluated heights.
    pub curve: MaterialRatioCurve,
}

impl Evaluation {
    /// Takes the whole sections in the middle of a profile. Without a length, the profile has
    /// [`DEFAULT_SECTIONS`] of them. Returns `None` if the profile is shorter than a section, or a
    /// section has fewer than two points.
    pub fn new(profile: &Surface, section_length: Option<f64>) -> Option<Evaluation> {
        let step = profile.grid().spacing()[0];
        let all = profile.heights();
        let points = match section_length {
            // A section length may be written with a few digits.
            Some(length) => (length / step).round() as usize,
            None => all.len() / DEFAULT_SECTIONS,
        };
        if points < 2 || points > all.len() {
            return None;
        }
        let count = all.len() / points * points;
        let first = (all.len() - count) / 2;
        let kept = &all[first..first + count];
        let mean = kept.iter().map(|height| height - kept[0]).sum::<f64>() / count as f64 + kept[0];
        let heights: Vec<f64> = kept.iter().map(|height| height - mean).collect();
        let cell = Cell::new([step * count as f64, step]).ok()?;
        let line = Surface::new(Grid::new([count, 1], cell).ok()?, heights.clone()).ok()?;
        let curve = MaterialRatioCurve::from_surface(&line);
        Some(Evaluation { heights, step, points, curve })
    }

    /// Computes the parameters.
    ///
    /// ```
    /// use asperity_mechanics::grid::{Cell, Grid};
    /// use asperity_mechanics::topography::profile_parameters::Evaluation;
    /// use asperity_mechanics::topography::surface::Surface;
    ///
    /// // A sine of amplitude 1 and wavelength 100, ten waves.
    /// let wave = |i: i32| (std::f64::consts::TAU * (f64::from(i) + 0.5) / 100.0).sin();
    /// let grid = Grid::new([1000, 1], Cell::new([1000.0, 1.0])?)?;
    /// let profile = Surface::new(grid, (0..1000).map(wave).collect())?;
    /// let found = Evaluation::new(&profile, Some(200.0)).unwrap().parameters();
    /// assert_eq!(found.sections, 5);
    /// assert!((found.rq - 0.5_f64.sqrt()).abs() < 1e-12);
    /// assert!((found.ra - 2.0 / std::f64::consts::PI).abs() < 1e-3);
    /// assert!((found.rz - 2.0).abs() < 1e-3);
    /// assert!((found.rsm.unwrap() - 100.0).abs() < 1e-9);
    /// # Ok::<(), asperity_mechanics::topography::surface::SurfaceError>(())
    /// ```
    pub fn parameters(&self) -> ProfileParameters {
        let heights = &self.heights;
        let mean = |value: &dyn Fn(f64) -> f64| {
            heights.iter().map(|height| value(*height)).sum::<f64>() / heights.len() as f64
        };
        let rq = mean(&|z| z * z).sqrt();
        let moment = |power: i32| (rq > 0.0).then(|| mean(&|z| (z / rq).powi(power)));
        let highest = |part: &[f64]| part.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let lowest = |part: &[f64]| part.iter().copied().fold(f64::INFINITY, f64::min);
        let sections = heights.chunks_exact(self.points);
        let count = sections.len();
        let over_sections = |value: &dyn Fn(&[f64]) -> f64| {
            heights.chunks_exact(self.points).map(value).sum::<f64>() / count as f64
        };
        let rp = over_sections(&highest);
        let rv = -over_sections(&lowest);
        let square = |part: &[f64]| part.iter().map(|z| z * z).sum::<f64>() / part.len() as f64;
        ProfileParameters {
            sections: count,
            section_length: self.points as f64 * self.step,
            ra: mean(&f64::abs),
            rq,
            rsk: moment(3),
            rku: moment(4),
            rp,
            rv,
            rz: rp + rv,
            rt: highest(heights) - lowest(heights),
            rdq: self.slope(),
            rsm: self.element_spacing([DISCRIMINATION * rp, DISCRIMINATION * rv]),
            rq_of_sections: over_sections(&|part| square(part).sqrt()),
            stratified: self.curve.stratified(),
        }
    }

    fn slope(&self) -> Option<f64> {
        let slopes = self.heights.windows(7).map(|z| {
            let parts = SLOPE.iter().enumerate();
            parts.map(|(index, one)| one * (z[4 + index] - z[2 - index])).sum::<f64>() / self.step
        });
        let count = slopes.len();
        (count > 0).then(|| (slopes.map(|slope| slope * slope).sum::<f64>() / count as f64).sqrt())
    }

    /// Returns the mean spacing of profile elements, a hill and the next dale or a dale and the
    /// next hill. A hill rises at least to `above`, and a dale falls at least to −`below`. Elements
    /// begin where the profile crosses the mean line for the last time before the next hill or
    /// dale.
    fn element_spacing(&self, [above, below]: [f64; 2]) -> Option<f64> {
        let mut crossings: Vec<f64> = Vec::new();
        let mut is_hill: Option<bool> = None;
        let mut crossing = None;
        for (index, pair) in self.heights.windows(2).enumerate() {
            let [before, after] = [pair[0], pair[1]];
            if (before < 0.0) != (after < 0.0) {
                crossing = Some(index as f64 + before / (before - after));
            }
            let found = match () {
                () if after > 0.0 && after >= above => true,
                () if after < 0.0 && -after >= below => false,
                () => continue,
            };
            if is_hill.is_some_and(|is_hill| is_hill != found) {
                crossings.extend(crossing);
            }
            is_hill = Some(found);
        }
        let elements = crossings.windows(3).map(|three| three[2] - three[0]);
        let count = elements.len();
        (count > 0).then(|| elements.sum::<f64>() / count as f64 * self.step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn profile(heights: Vec<f64>, step: f64) -> Surface {
        let cell = Cell::new([step * heights.len() as f64, step]).unwrap();
        Surface::new(Grid::new([heights.len(), 1], cell).unwrap(), heights).unwrap()
    }

    fn parameters(heights: Vec<f64>, step: f64, section: Option<f64>) -> ProfileParameters {
        Evaluation::new(&profile(heights, step), section).unwrap().parameters()
    }

    fn assert_close(found: f64, exact: f64, tolerance: f64) {
        assert!((found - exact).abs() <= tolerance, "{found} should be {exact}");
    }

    /// A triangle wave between −1 and 1 with 400 points per wave, which straddle its tips.
    fn triangle(index: usize) -> f64 {
        let phase = (index as f64 + 0.5) / 400.0;
        1.0 - 4.0 * ((phase + 0.25).fract() - 0.5).abs() * 1.0
    }

    #[test]
    fn a_triangle_wave_has_its_closed_forms() {
        let found = parameters((0..4000).map(triangle).collect(), 0.01, Some(8.0));
        assert_eq!(found.sections, 5);
        assert_close(found.section_length, 8.0, 1e-12);
        assert_close(found.ra, 0.5, 1e-4);
        assert_close(found.rq, 1.0 / 3_f64.sqrt(), 1e-4);
        assert_close(found.rq_of_sections, found.rq, 1e-12);
        assert_close(found.rsk.unwrap(), 0.0, 1e-12);
        assert_close(found.rku.unwrap(), 9.0 / 5.0, 1e-3);
        assert_close(found.rt, 2.0, 0.02);
        assert_close(found.rz, found.rt, 1e-12);
        assert_close(found.rsm.unwrap(), 4.0, 1e-9);
        // The slope is 1 but for the tips, whose seven points see both flanks.
        assert_close(found.rdq.unwrap(), 1.0, 0.02);
        // The whole wave is core.
        assert_close(found.stratified.sk, 2.0, 0.01);
        assert_close(found.stratified.spk + found.stratified.svk, 0.0, 0.01);
    }

    #[test]
    fn sections_average_the_extremes() {
        // Peaks of height 1 and 3 over sections of 50 points.
        let mut heights = vec![0.0; 100];
        (heights[10], heights[60]) = (1.0, 3.0);
        let found = parameters(heights, 1.0, Some(50.0));
        assert_close(found.rp, 2.0 - 0.04, 1e-12);
        assert_close(found.rv, 0.04, 1e-12);
        assert_close(found.rt, 3.0, 1e-12);
        assert!(found.rq_of_sections < found.rq);
    }

    #[test]
    fn ripples_below_the_discrimination_are_no_elements() {
        let wave = |index: usize| libm::sin(std::f64::consts::TAU * index as f64 / 200.0 + 0.1);
        let ripple = |index: usize| if index.is_multiple_of(2) { 0.05 } else { -0.05 };
        let heights = (0..2000).map(|index| wave(index) + ripple(index)).collect();
        assert_close(parameters(heights, 1.0, Some(400.0)).rsm.unwrap(), 200.0, 1.0);
    }

    #[test]
    fn whole_sections_are_in_the_middle() {
        let heights: Vec<f64> = (0..11).map(|index| f64::from(index * index)).collect();
        let evaluation = Evaluation::new(&profile(heights.clone(), 1.0), Some(3.0)).unwrap();
        assert_eq!(evaluation.heights.len(), 9);
        assert_close(evaluation.heights[1] - evaluation.heights[0], 3.0, 1e-12);
        assert!(Evaluation::new(&profile(heights.clone(), 1.0), Some(12.0)).is_none());
        assert!(Evaluation::new(&profile(heights, 1.0), Some(1.0)).is_none());
    }
}
