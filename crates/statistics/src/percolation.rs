//! Percolation threshold of the gap: load and contact area at which the interface seals.
//!
//! Along each direction, the gap of a surface changes from open to sealed once, because the contact
//! only grows. The threshold is midway between the last open and the first sealed load. A surface
//! has one threshold along x and one along y. On isotropic roughness, both have the same
//! distribution, and their mean is used as well. Anisotropic roughness seals much earlier across
//! the grain than along it, and the mean of both directions is not meaningful. Wang & Müser (2020)
//! find an area fraction of 0.415 for isotropic surfaces whose longest waves are much shorter than
//! the cell.
//!
//! The spacing of the loads causes an additional error, which resampling does not detect: if all
//! surfaces seal between the same two loads, their thresholds do not scatter. Let the true
//! thresholds be normally distributed with the standard deviation σ. The measured ones are rounded
//! to the middles of intervals of width w. The error of the mean is a periodic function of the
//! position of the intervals. It is a sawtooth whose kth harmonic is multiplied by
//! exp(−2π²k²σ²/w²) because of the scatter. Its root mean square
//!
//! ```text
//! w/(π√2) · √(Σ_k exp(−4π²k²σ²/w²)/k²)
//! ```
//!
//! decreases from w/√12 without scatter to nearly zero at σ = w/2. It is added to the standard
//! error in quadrature. σ² is the variance of the middles minus w²/12 (Sheppard's correction).

use std::f64::consts::{PI, SQRT_2};

use super::bootstrap::{Bootstrap, Estimate, Interval, Intervals};
use super::intervals::two_sided_quantile;
use super::{FitError, Window};

/// Directions along which the channels through the gap must be sealed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channels {
    /// Channels along x only.
    AlongX,
    /// Channels along y only.
    AlongY,
    /// Channels along x and along y. The threshold of a surface is the mean of both thresholds.
    AlongBoth,
}

/// Contact of one surface under one load: its area, and the directions along which the gap
/// percolates.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interface {
    /// Load, in units of E* h′.
    pub load: f64,
    /// Fraction of the nodes in contact.
    pub area: f64,
    /// Area fraction, corrected for the mesh; NaN if no correction is known.
    pub area_corrected: f64,
    /// `true` if the gap percolates: one entry for x and one for y.
    pub is_open: [bool; 2],
}

/// Percolation threshold of a surface, or the mean of several: contact area and load at which the
/// gap seals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Threshold {
    /// Fraction of the nodes in contact.
    pub area: f64,
    /// Area fraction, corrected for the mesh.
    pub area_corrected: f64,
    /// Load, in units of E* h′.
    pub load: f64,
}

/// Index of the load among the values of a [`Threshold`].
const LOAD: usize = 2;

/// Transition of a surface from open to sealed along one direction.
#[derive(Debug, Clone, Copy)]
struct Sealing {
    /// Mean of the area, corrected area and load in the last open and the first sealed state.
    middle: [f64; 3],
    /// Increase of the area, corrected area and load from the last open to the first sealed state.
    width: [f64; 3],
}

/// Percolation thresholds of the surfaces of one parameter point.
#[derive(Debug, Clone)]
pub struct PercolationProblem {
    /// Sealing transitions, indexed as `[surface][direction]`.
    sealings: Vec<Vec<Sealing>>,
    thresholds: Vec<Threshold>,
}

impl PercolationProblem {
    /// Finds the thresholds of surfaces from their states, which must be in ascending order of the
    /// load.
    ///
    /// Loads outside the window are ignored.
    ///
    /// # Errors
    /// Fails if there is no surface, or if a surface is sealed under its lightest load or open
    /// under its heaviest load in the window. To omit such a surface would bias the mean.
    pub fn new(
        surfaces: &[Vec<Interface>],
        window: Window,
        channels: Channels,
    ) -> Result<Self, FitError> {
        let sealings: Vec<Vec<Sealing>> = surfaces
            .iter()
            .filter_map(|interfaces| Sealing::of_surface(interfaces, window, channels))
            .collect();
        if sealings.len() < surfaces.len() || sealings.is_empty() {
            return Err(FitError::NotSealed { channels });
        }
        let of_surface = |all: &Vec<Sealing>| {
            Threshold::from_values(mean_of(all.iter().map(|sealing| sealing.middle)))
        };
        Ok(Self { thresholds: sealings.iter().map(of_surface).collect(), sealings })
    }

    /// Returns the threshold of each surface, averaged over the directions of [`Channels`].
    pub fn thresholds(&self) -> &[Threshold] {
        &self.thresholds
    }

    /// Returns the mean threshold of the surfaces.
    pub fn mean(&self) -> Threshold {
        self.resampled(&vec![1; self.thresholds.len()])
    }

    /// Returns the standard error of the mean threshold due to the spacing of the loads, which
    /// resampling does not detect.
    pub fn resolution_error(&self) -> Threshold {
        let width = mean_of(self.sealings.iter().flatten().map(|sealing| sealing.width));
        let factor = rounding_of_the_mean(self.scatter() / width[LOAD]);
        Threshold::from_values(width.map(|width| factor * width))
    }

    /// Returns whether the loads are close enough to resolve the scatter of the thresholds: the
    /// variance of the threshold loads is larger than w²/12 for the load steps w.
    pub fn resolves_scatter(&self) -> bool {
        self.scatter() > 0.0
    }

    /// Returns the standard deviation σ of the threshold loads over surfaces and directions.
    ///
    /// σ² is the variance of the midpoints minus the mean of w²/12 over the load steps w, or zero
    /// if this is negative.
    fn scatter(&self) -> f64 {
        let all = || self.sealings.iter().flatten();
        let count = all().count() as f64;
        let mean = all().map(|sealing| sealing.middle[LOAD]).sum::<f64>() / count;
        let squares = all().map(|sealing| (sealing.middle[LOAD] - mean).powi(2));
        let of_rounding = all().map(|sealing| sealing.width[LOAD].powi(2) / 12.0);
        let variance = squares.sum::<f64>() / (count - 1.0) - of_rounding.sum::<f64>() / count;
        variance.max(0.0).sqrt()
    }

    /// Computes confidence intervals of mean area, corrected area and load at the threshold, in
    /// this order. They include [`resolution_error`](Self::resolution_error).
    pub fn bootstrap(&self, bootstrap: &Bootstrap) -> Intervals {
        let surfaces = self.thresholds.len();
        let means = self.mean().values();
        let found = bootstrap.intervals(surfaces, &means.map(Estimate::Real), |multiplicities| {
            Ok(self.resampled(multiplicities).values().to_vec())
        });
        let quantile = two_sided_quantile(bootstrap.level, surfaces.max(2) as u32 - 1);
        let rounding = self.resolution_error().values();
        let widened = |intervals: Vec<Interval>| {
            let all = means.into_iter().zip(rounding).zip(intervals);
            let widen = |((mean, rounding), interval): ((f64, f64), Interval)| {
                Estimate::Real(mean)
                    .interval(libm::hypot(interval.standard_error, rounding), quantile)
            };
            all.map(widen).collect()
        };
        Intervals { intervals: found.intervals.map(widened), ..found }
    }

    fn resampled(&self, multiplicities: &[u32]) -> Threshold {
        let times = multiplicities.iter().map(|times| f64::from(*times));
        let values = self.thresholds.iter().map(Threshold::values);
        Threshold::from_values(weighted_mean(values.zip(times)))
    }
}

impl Channels {
    fn axes(self) -> &'static [usize] {
        match self {
            Channels::AlongX => &[0],
            Channels::AlongY => &[1],
            Channels::AlongBoth => &[0, 1],
        }
    }
}

impl Threshold {
    /// Returns area, corrected area and load as an array, in this order.
    pub fn values(&self) -> [f64; 3] {
        [self.area, self.area_corrected, self.load]
    }

    fn from_values([area, area_corrected, load]: [f64; 3]) -> Threshold {
        Threshold { area, area_corrected, load }
    }
}

impl Sealing {
    /// Returns the sealing transition along each direction: its midpoint and width.
    ///
    /// Returns `None` if a direction has no transition from open to sealed in the window.
    fn of_surface(
        interfaces: &[Interface],
        window: Window,
        channels: Channels,
    ) -> Option<Vec<Sealing>> {
        let inside: Vec<&Interface> =
            interfaces.iter().filter(|interface| window.contains(interface.load)).collect();
        let along = |axis: usize| {
            let first_sealed = inside.iter().position(|interface| !interface.is_open[axis]);
            let sealed = first_sealed.filter(|&sealed| sealed > 0)?;
            let [open, closed] = [inside[sealed - 1], inside[sealed]]
                .map(|interface| [interface.area, interface.area_corrected, interface.load]);
            let width = [0, 1, 2].map(|value| closed[value] - open[value]);
            Some(Sealing { middle: mean_of([open, closed]), width })
        };
        channels.axes().iter().map(|&axis| along(axis)).collect()
    }
}

/// Returns the rms error of the mean of normally distributed numbers after rounding to the middles
/// of unit intervals.
///
/// `scatter` is the standard deviation of the numbers. The squared error is averaged over all
/// positions of the intervals.
fn rounding_of_the_mean(scatter: f64) -> f64 {
    if scatter == 0.0 {
        return 1.0 / 12.0_f64.sqrt();
    }
    let wave = |k: f64| libm::exp(-4.0 * (PI * k * scatter).powi(2)) / (k * k);
    let waves = (1..).map(|k| wave(f64::from(k)));
    // The relative truncation error is at most 1e-6.
    let sum: f64 = waves.take_while(|&wave| wave > 1e-12).sum();
    sum.sqrt() / (PI * SQRT_2)
}

fn mean_of(values: impl IntoIterator<Item = [f64; 3]>) -> [f64; 3] {
    weighted_mean(values.into_iter().map(|values| (values, 1.0)))
}

fn weighted_mean(weighted: impl Iterator<Item = ([f64; 3], f64)>) -> [f64; 3] {
    let (mut sums, mut weights) = ([0.0; 3], 0.0);
    for (values, weight) in weighted {
        for (sum, value) in sums.iter_mut().zip(values) {
            *sum += weight * value;
        }
        weights += weight;
    }
    sums.map(|sum| sum / weights)
}

#[cfg(test)]
mod tests {
    use super::Channels::{AlongBoth, AlongX, AlongY};
    use super::*;

    const WINDOW: Window = Window { from: 0.0, to: 10.0 };

    /// Returns ten states with loads up to one. They are sealed along x from the load `from[0]` on,
    /// along y from `from[1]` on.
    fn surface(from: [f64; 2]) -> Vec<Interface> {
        let loads = (1..=10).map(|load| f64::from(load) / 10.0);
        let interface = |load: f64| Interface {
            load,
            area: 0.5 * load,
            area_corrected: 0.4 * load,
            is_open: from.map(|from| load < from),
        };
        loads.map(interface).collect()
    }

    fn problem(
        surfaces: &[Vec<Interface>],
        channels: Channels,
    ) -> Result<PercolationProblem, FitError> {
        PercolationProblem::new(surfaces, WINDOW, channels)
    }

    #[test]
    fn the_threshold_lies_between_the_last_open_and_the_first_sealed_load() {
        let problem = problem(&[surface([0.5, 0.8])], AlongBoth).unwrap();
        let threshold = problem.mean();
        // The middles are 0.45 and 0.75.
        assert!((threshold.load - 0.6).abs() < 1e-15);
        assert!((threshold.area - 0.3).abs() < 1e-15);
        assert!((threshold.area_corrected - 0.24).abs() < 1e-15);
    }

    #[test]
    fn thresholds_along_one_direction_ignore_the_other() {
        let surfaces = [[0.3, 0.8], [0.5, 1.0]].map(surface);
        for (channels, load) in [(AlongX, 0.35), (AlongY, 0.85), (AlongBoth, 0.6)] {
            let found = problem(&surfaces, channels).unwrap();
            assert!((found.mean().load - load).abs() < 1e-15, "{channels:?}");
            // The thresholds along each direction differ by 0.2, neighbouring loads by 0.1.
            let variance = if channels == AlongBoth { 0.29 / 3.0 } else { 0.02 };
            let expected = (variance - 0.01 / 12.0_f64).sqrt();
            assert!((found.scatter() - expected).abs() < 1e-12, "{channels:?}");
        }
    }

    #[test]
    fn surfaces_have_equal_weights() {
        let surfaces = [[0.3, 0.3], [0.5, 0.5]].map(surface);
        let mean = problem(&surfaces, AlongBoth).unwrap().mean();
        assert!((mean.load - 0.35).abs() < 1e-15);
    }

    #[test]
    fn surfaces_sealed_between_the_same_loads_have_the_error_of_the_resolution() {
        let equal = [[0.3, 0.3]; 4].map(surface);
        let problem = problem(&equal, AlongBoth).unwrap();
        assert!(!problem.resolves_scatter());
        let bootstrap = Bootstrap { replicates: 50, seed: 1, level: 0.95 };
        let intervals = problem.bootstrap(&bootstrap).intervals.unwrap();
        // Neighbouring loads differ by 0.1, their areas by 0.05 and 0.04.
        for (interval, width) in intervals.iter().zip([0.05, 0.04, 0.1]) {
            assert!((interval.standard_error - width / 12.0_f64.sqrt()).abs() < 1e-12);
        }
    }

    #[test]
    fn the_mean_of_rounded_numbers_has_the_error_of_the_series() {
        for scatter in [0.02, 0.1, 0.2, 0.35, 0.5] {
            let bias = |begin: f64| -> f64 {
                // The sums integrate rounded minus exact numbers over a normal distribution.
                let steps = (-4000..=4000).map(|i| f64::from(i) / 500.0);
                let (mut sum, mut weights) = (0.0, 0.0);
                for deviate in steps {
                    let (value, weight) =
                        (begin + scatter * deviate, (-0.5 * deviate * deviate).exp());
                    sum += weight * (value.floor() + 0.5 - value);
                    weights += weight;
                }
                sum / weights
            };
            let positions = 200;
            let squares: f64 = (0..positions)
                .map(|index| bias((f64::from(index) + 0.5) / f64::from(positions)).powi(2))
                .sum();
            let found = (squares / f64::from(positions)).sqrt();
            let expected = rounding_of_the_mean(scatter);
            // The step of the integration is 0.002 standard deviations.
            assert!(
                (found - expected).abs() < 1e-3 * expected + 1e-4,
                "{scatter}: {found} {expected}"
            );
        }
        assert!((rounding_of_the_mean(1e-3) - rounding_of_the_mean(0.0)).abs() < 1e-3);
    }

    #[test]
    fn a_surface_without_a_threshold_is_an_error() {
        let open = [surface([0.5, 0.8]), surface([0.5, 2.0])];
        let sealed = [surface([0.5, 0.05])];
        for channels in [AlongY, AlongBoth] {
            let error = problem(&open, channels).unwrap_err();
            assert_eq!(error, FitError::NotSealed { channels });
            let error = problem(&sealed, channels).unwrap_err();
            assert_eq!(error, FitError::NotSealed { channels });
        }
        // Along x, all surfaces seal in the window.
        assert!((problem(&open, AlongX).unwrap().mean().load - 0.45).abs() < 1e-15);
        let outside = Window { from: 0.0, to: 0.6 };
        assert!(PercolationProblem::new(&[surface([0.5, 0.8])], outside, AlongBoth).is_err());
    }
}
