//! Where the gap stops percolating: the load, and the area of contact, from which on no channel
//! leads through the interface.
//!
//! Along one direction a surface passes from open to sealed once, between two of its loads, for
//! contact only grows; its threshold is the middle of both. A surface has one threshold along each
//! of its two directions. Isotropic roughness is equally likely to seal first along x or along y,
//! so that a surface has the mean of both as a third threshold. Roughness with a grain seals much
//! earlier across the grain than along it, and a mean of both directions is the threshold of
//! neither. Wang & Müser (2020) find 0.415 of the area on isotropic surfaces whose longest waves
//! are short beside the cell; smaller cells scatter about it.
//!
//! What lies between two loads is not seen, and resampling surfaces does not know it: where all
//! surfaces are sealed between the same two loads, their middles do not scatter at all. Thresholds
//! that scatter by σ and are rounded to the middles of steps of w have a mean that is wrong by a
//! function of where the steps begin, of period w, whose Fourier series is known (rounding is a
//! saw-tooth, and a normal distribution takes exp(−2π²k²σ²/w²) off its kth wave). Its root mean
//! square,
//!
//!   w/(π√2) · √(Σ_k exp(−4π²k²σ²/w²)/k²),
//!
//! goes from w/√12 without scatter to next to nothing at σ = w/2, and is added to the standard
//! error. σ is that of the middles less w²/12 (Sheppard's correction).

use std::f64::consts::{PI, SQRT_2};
use std::fmt;

use super::bootstrap::{Bootstrap, Estimate, Interval, Intervals};
use super::intervals::two_sided_quantile;
use super::{FitError, Window};

/// Directions of the channels that must be closed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Channels {
    /// Along x.
    AlongX,
    /// Along y.
    AlongY,
    /// Along both directions; a surface's threshold is the mean of both.
    AlongBoth,
}

/// One surface under one load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interface {
    /// In units of E* × rms slope.
    pub load: f64,
    /// Share of the nodes in contact.
    pub area: f64,
    /// The same, corrected for the mesh.
    pub area_corrected: f64,
    /// Whether the gap percolates along x, and along y.
    pub is_open: [bool; 2],
}

/// Where interfaces are sealed, mean of surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Threshold {
    /// Share of the nodes in contact.
    pub area: f64,
    /// The same, corrected for the mesh.
    pub area_corrected: f64,
    /// In units of E* × rms slope.
    pub load: f64,
}

/// Where a surface is sealed along one direction.
#[derive(Debug, Clone, Copy)]
struct Passage {
    /// The middle of the last open and the first sealed load.
    middle: Threshold,
    /// How far both are apart.
    width: Threshold,
}

/// Thresholds of surfaces.
#[derive(Debug, Clone)]
pub struct PercolationProblem {
    /// Passages of each surface, one for each direction.
    passages: Vec<Vec<Passage>>,
    thresholds: Vec<Threshold>,
}

impl PercolationProblem {
    /// Takes the loads of each surface inside a window, ascending.
    ///
    /// # Errors
    /// When there is no surface, or one that is sealed under its lightest load, or still open under
    /// its heaviest: a mean over the others would be biased.
    pub fn new(
        surfaces: &[Vec<Interface>],
        window: Window,
        channels: Channels,
    ) -> Result<Self, FitError> {
        let passages: Vec<Vec<Passage>> = surfaces
            .iter()
            .filter_map(|interfaces| Passage::of_surface(interfaces, window, channels))
            .collect();
        let without = surfaces.len() - passages.len();
        if without > 0 || passages.is_empty() {
            return Err(FitError::NotSealed {
                without,
                surfaces: surfaces.len(),
                channels,
                window,
            });
        }
        let of_surface = |all: &Vec<Passage>| mean_of(all.iter().map(|passage| passage.middle));
        Ok(Self { thresholds: passages.iter().map(of_surface).collect(), passages })
    }

    /// Thresholds of the surfaces, each averaged over the directions.
    pub fn thresholds(&self) -> &[Threshold] {
        &self.thresholds
    }

    /// The mean over the surfaces.
    pub fn mean(&self) -> Threshold {
        self.resampled(&vec![1; self.thresholds.len()])
    }

    /// The standard error that the distance of the loads adds to that of the surfaces.
    pub fn rounding(&self) -> Threshold {
        let width = mean_of(self.passages.iter().flatten().map(|passage| passage.width));
        let share = rounding_of_the_mean(self.scatter() / width.load);
        Threshold::from_values(width.values().map(|width| share * width))
    }

    /// Whether the loads are close enough to tell how thresholds scatter.
    pub fn resolves_scatter(&self) -> bool {
        self.scatter() > 0.0
    }

    /// The standard deviation of the load at the threshold, between surfaces and directions; zero
    /// where all scatter may be that of rounding.
    fn scatter(&self) -> f64 {
        let all = || self.passages.iter().flatten();
        let count = all().count() as f64;
        let mean = all().map(|passage| passage.middle.load).sum::<f64>() / count;
        let squares = all().map(|passage| (passage.middle.load - mean).powi(2));
        let of_rounding = all().map(|passage| passage.width.load.powi(2) / 12.0);
        let variance = squares.sum::<f64>() / (count - 1.0) - of_rounding.sum::<f64>() / count;
        variance.max(0.0).sqrt()
    }

    /// Intervals of the area, the corrected area and the load, in this order.
    pub fn bootstrap(&self, bootstrap: &Bootstrap) -> Intervals {
        let surfaces = self.thresholds.len();
        let means = self.mean().values();
        let found = bootstrap.intervals(surfaces, &means.map(Estimate::Real), |multiplicities| {
            Ok(self.resampled(multiplicities).values().to_vec())
        });
        let quantile = two_sided_quantile(bootstrap.level, surfaces.max(2) as u32 - 1);
        let rounding = self.rounding().values();
        let widened = |intervals: Vec<Interval>| {
            let all = means.into_iter().zip(rounding).zip(intervals);
            let widen = |((mean, rounding), interval): ((f64, f64), Interval)| {
                Estimate::Real(mean).interval(interval.standard_error.hypot(rounding), quantile)
            };
            all.map(widen).collect()
        };
        Intervals { intervals: found.intervals.map(widened), ..found }
    }

    fn resampled(&self, multiplicities: &[u32]) -> Threshold {
        let weighted = self.thresholds.iter().zip(multiplicities);
        let weighted = weighted.map(|(threshold, times)| (*threshold, f64::from(*times)));
        weighted_mean(weighted)
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

impl fmt::Display for Channels {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Channels::AlongX => "x",
            Channels::AlongY => "y",
            Channels::AlongBoth => "both directions",
        })
    }
}

impl Threshold {
    /// Area, corrected area and load.
    pub fn values(&self) -> [f64; 3] {
        [self.area, self.area_corrected, self.load]
    }

    fn from_values([area, area_corrected, load]: [f64; 3]) -> Threshold {
        Threshold { area, area_corrected, load }
    }
}

impl Passage {
    /// Returns the passages along the directions, or `None` if one is not seen.
    fn of_surface(
        interfaces: &[Interface],
        window: Window,
        channels: Channels,
    ) -> Option<Vec<Passage>> {
        let inside: Vec<&Interface> =
            interfaces.iter().filter(|interface| window.contains(interface.load)).collect();
        let along = |axis: usize| {
            let sealed = inside.iter().position(|interface| !interface.is_open[axis]);
            let sealed = sealed.filter(|&sealed| sealed > 0)?;
            let around = [inside[sealed - 1], inside[sealed]].map(|interface| Threshold {
                area: interface.area,
                area_corrected: interface.area_corrected,
                load: interface.load,
            });
            let [open, closed] = around.map(|one| one.values());
            let width = [0, 1, 2].map(|value| closed[value] - open[value]);
            Some(Passage { middle: mean_of(around), width: Threshold::from_values(width) })
        };
        channels.axes().iter().map(|&axis| along(axis)).collect()
    }
}

/// The root mean square, over where the steps begin, of what rounding to the middles of steps of
/// one takes a mean of numbers off that scatter so much.
fn rounding_of_the_mean(scatter: f64) -> f64 {
    if scatter == 0.0 {
        return 1.0 / 12.0_f64.sqrt();
    }
    let wave = |k: f64| (-4.0 * (PI * k * scatter).powi(2)).exp() / (k * k);
    let waves = (1..).map(|k| wave(f64::from(k)));
    // What is left out is a millionth at most.
    let sum: f64 = waves.take_while(|&wave| wave > 1e-12).sum();
    sum.sqrt() / (PI * SQRT_2)
}

fn mean_of(thresholds: impl IntoIterator<Item = Threshold>) -> Threshold {
    weighted_mean(thresholds.into_iter().map(|threshold| (threshold, 1.0)))
}

fn weighted_mean(weighted: impl Iterator<Item = (Threshold, f64)>) -> Threshold {
    let (mut sums, mut weights) = ([0.0; 3], 0.0);
    for (threshold, weight) in weighted {
        for (sum, value) in sums.iter_mut().zip(threshold.values()) {
            *sum += weight * value;
        }
        weights += weight;
    }
    Threshold::from_values(sums.map(|sum| sum / weights))
}

#[cfg(test)]
mod tests {
    use super::Channels::{AlongBoth, AlongX, AlongY};
    use super::*;

    const WINDOW: Window = Window { from: 0.0, to: 10.0 };

    /// Ten loads up to one, as much area, sealed along x and y from these loads on.
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
        // Middles at 0.45 and 0.75.
        assert!((threshold.load - 0.6).abs() < 1e-15);
        assert!((threshold.area - 0.3).abs() < 1e-15);
        assert!((threshold.area_corrected - 0.24).abs() < 1e-15);
    }

    #[test]
    fn along_one_direction_the_other_one_does_not_count() {
        let surfaces = [[0.3, 0.8], [0.5, 1.0]].map(surface);
        for (channels, load) in [(AlongX, 0.35), (AlongY, 0.85), (AlongBoth, 0.6)] {
            let found = problem(&surfaces, channels).unwrap();
            assert!((found.mean().load - load).abs() < 1e-15, "{channels}");
            // The thresholds along each direction are 0.2 apart, and loads 0.1.
            let variance = if channels == AlongBoth { 0.29 / 3.0 } else { 0.02 };
            let expected = (variance - 0.01 / 12.0_f64).sqrt();
            assert!((found.scatter() - expected).abs() < 1e-12, "{channels}");
        }
    }

    #[test]
    fn surfaces_weigh_the_same() {
        let surfaces = [[0.3, 0.3], [0.5, 0.5]].map(surface);
        let mean = problem(&surfaces, AlongBoth).unwrap().mean();
        assert!((mean.load - 0.35).abs() < 1e-15);
    }

    #[test]
    fn surfaces_sealed_between_the_same_loads_are_known_to_these_and_no_better() {
        let equal = [[0.3, 0.3]; 4].map(surface);
        let problem = problem(&equal, AlongBoth).unwrap();
        assert!(!problem.resolves_scatter());
        let bootstrap = Bootstrap { replicates: 50, seed: 1, level: 0.95 };
        let intervals = problem.bootstrap(&bootstrap).intervals.unwrap();
        // Loads are 0.1 apart, areas half and two fifths of that.
        for (interval, width) in intervals.iter().zip([0.05, 0.04, 0.1]) {
            assert!((interval.standard_error - width / 12.0_f64.sqrt()).abs() < 1e-12);
        }
    }

    #[test]
    fn the_mean_of_rounded_numbers_is_wrong_by_what_the_series_says() {
        for scatter in [0.02, 0.1, 0.2, 0.35, 0.5] {
            let bias = |begin: f64| -> f64 {
                // Each step of a fine grid of normal numbers about `begin`, rounded and not.
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
            let places = 200;
            let squares: f64 = (0..places)
                .map(|place| bias((f64::from(place) + 0.5) / f64::from(places)).powi(2))
                .sum();
            let found = (squares / f64::from(places)).sqrt();
            let expected = rounding_of_the_mean(scatter);
            // The fine grid is as coarse as 0.002 scatters.
            assert!(
                (found - expected).abs() < 1e-3 * expected + 1e-4,
                "{scatter}: {found} {expected}"
            );
        }
        assert!((rounding_of_the_mean(1e-3) - rounding_of_the_mean(0.0)).abs() < 1e-3);
    }

    #[test]
    fn a_surface_without_a_threshold_leaves_no_mean() {
        let open = [surface([0.5, 0.8]), surface([0.5, 2.0])];
        let sealed = [surface([0.5, 0.05])];
        let expected = |without, surfaces, channels| FitError::NotSealed {
            without,
            surfaces,
            channels,
            window: WINDOW,
        };
        for channels in [AlongY, AlongBoth] {
            let error = problem(&open, channels).unwrap_err();
            assert_eq!(error, expected(1, 2, channels));
            let error = problem(&sealed, channels).unwrap_err();
            assert_eq!(error, expected(1, 1, channels));
        }
        // Along x all of them are seen to close.
        assert!((problem(&open, AlongX).unwrap().mean().load - 0.45).abs() < 1e-15);
        let outside = Window { from: 0.0, to: 0.6 };
        assert!(PercolationProblem::new(&[surface([0.5, 0.8])], outside, AlongBoth).is_err());
    }
}
