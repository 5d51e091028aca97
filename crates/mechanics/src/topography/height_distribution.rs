//! Histograms of the heights of one or several surfaces, and the bearing area curve.
//!
//! [`Histogram`] counts the heights of a surface in units of its rms height. [`HistogramPool`]
//! computes the mean and the standard deviation of the density over several surfaces.
//! [`bearing_curve`] returns the bearing area curve (Abbott–Firestone curve): the fraction of the
//! surface at or above each height.

use std::f64::consts::SQRT_2;

use super::descriptors::deviations;
use super::surface::Surface;

/// Histogram of the heights of a surface about their mean, in units of the rms height.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// Bins in ascending order of height.
    pub bins: Vec<Bin>,
    /// Width of a bin, in units of the rms height.
    pub width: f64,
    /// Rms height of the surface about its mean, in the unit of the heights.
    pub rms_height: f64,
    /// Number of nodes with heights outside the range of the bins.
    pub outside: usize,
}

/// Bin of a [`Histogram`]. It contains its lower end; the last bin also contains its upper end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bin {
    /// Centre of the bin, in units of the rms height.
    pub center: f64,
    /// Number of nodes in the bin.
    pub count: usize,
    /// Probability density: `count`/(number of all nodes × width of a bin).
    pub density: f64,
}

impl Histogram {
    /// Counts the heights in `bins` bins of equal width, from −`range` to +`range` times the rms
    /// height about the mean.
    ///
    /// `bins` must be at least one and `range` positive. The heights of a flat surface count as
    /// zero.
    pub fn from_surface(surface: &Surface, bins: usize, range: f64) -> Self {
        let deviations = deviations(surface.heights());
        let nodes = deviations.len() as f64;
        let variance = deviations.iter().map(|d| d * d).sum::<f64>() / nodes;
        let scale = if variance > 0.0 { 1.0 / variance.sqrt() } else { 0.0 };
        let width = 2.0 * range / bins as f64;
        let mut counts = vec![0; bins];
        let mut outside = 0;
        for height in deviations.into_iter().map(|deviation| scale * deviation) {
            if height.abs() <= range {
                // The upper end of the range belongs to the last bin.
                let bin = ((height + range) / width) as usize;
                counts[bin.min(bins - 1)] += 1;
            } else {
                outside += 1;
            }
        }
        let bin = |(index, count): (usize, usize)| Bin {
            center: -range + (index as f64 + 0.5) * width,
            count,
            density: count as f64 / (nodes * width),
        };
        let bins = counts.into_iter().enumerate().map(bin).collect();
        Self { bins, width, rms_height: variance.sqrt(), outside }
    }
}

/// Sum of the histograms of several surfaces on equal grids.
///
/// The sums are integers, so the result does not depend on the order of the surfaces.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct HistogramPool {
    /// Number of surfaces.
    pub surfaces: u32,
    /// Total number of nodes of all surfaces, inside and outside the range of the bins.
    nodes: u64,
    width: f64,
    bins: Vec<Sums>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Sums {
    center: f64,
    count: u64,
    square: u128,
}

/// Bin of a [`HistogramPool`]. Heights are in units of the rms height of the same surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PooledBin {
    /// Centre of the bin, in units of the rms height.
    pub center: f64,
    /// Mean over the surfaces of the probability density in the bin.
    pub mean: f64,
    /// Sample standard deviation of the probability density between surfaces, or `None` for one
    /// surface.
    pub sd: Option<f64>,
    /// Mean of the standard normal density over the bin.
    pub normal: f64,
}

impl HistogramPool {
    /// Creates a pool from the histogram of one surface.
    pub fn from_histogram(histogram: &Histogram) -> Self {
        let sums = |bin: &Bin| Sums {
            center: bin.center,
            count: bin.count as u64,
            square: (bin.count as u128).pow(2),
        };
        let inside: usize = histogram.bins.iter().map(|bin| bin.count).sum();
        Self {
            surfaces: 1,
            nodes: (inside + histogram.outside) as u64,
            width: histogram.width,
            bins: histogram.bins.iter().map(sums).collect(),
        }
    }

    /// Returns the pool of the surfaces of both pools, which must have the same bins.
    pub fn and(mut self, other: HistogramPool) -> Self {
        if self.surfaces == 0 {
            return other;
        }
        for (sums, more) in self.bins.iter_mut().zip(other.bins) {
            sums.count += more.count;
            sums.square += more.square;
        }
        self.surfaces += other.surfaces;
        self.nodes += other.nodes;
        self
    }

    /// Returns the bins in ascending order.
    pub fn bins(&self) -> Vec<PooledBin> {
        let surfaces = f64::from(self.surfaces);
        // Probability density of a bin that contains a single node, for one surface.
        let density = surfaces / (self.nodes as f64 * self.width);
        let bin = |sums: &Sums| PooledBin {
            center: sums.center,
            mean: density * sums.count as f64 / surfaces,
            sd: self.variance(sums).map(|variance| density * variance.sqrt()),
            normal: self.normal(sums.center),
        };
        self.bins.iter().map(bin).collect()
    }

    /// Returns the sample variance, between surfaces, of the number of nodes in a bin. Integer sums
    /// avoid cancellation.
    fn variance(&self, sums: &Sums) -> Option<f64> {
        let surfaces = u128::from(self.surfaces);
        let pairs = surfaces * surfaces.saturating_sub(1);
        let excess = surfaces * sums.square - u128::from(sums.count).pow(2);
        (pairs > 0).then(|| excess as f64 / pairs as f64)
    }

    fn normal(&self, center: f64) -> f64 {
        let [low, high] = [center - self.width / 2.0, center + self.width / 2.0];
        // If both ends are on one side of the mean, erfc avoids cancellation in the tails.
        let (near, far) = (low.abs().min(high.abs()), low.abs().max(high.abs()));
        let probability = if low < 0.0 && high > 0.0 {
            libm::erf(near / SQRT_2) + libm::erf(far / SQRT_2)
        } else {
            libm::erfc(near / SQRT_2) - libm::erfc(far / SQRT_2)
        };
        probability / (2.0 * self.width)
    }
}

/// Point of the bearing area curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BearingPoint {
    /// Height above the mean, in units of the rms height.
    pub level: f64,
    /// Height above the mean, in the unit of the heights.
    pub height: f64,
    /// Fraction of the nodes at or above the height: areal material ratio Smr of ISO 25178-2.
    pub material_ratio: f64,
}

/// Computes the bearing area curve at `steps` + 1 equidistant heights, in descending order.
///
/// The heights range from `range` times the rms height above the mean to `range` times below it.
/// All nodes of a flat surface are at its mean.
///
/// ```
/// use asperity_mechanics::grid::Grid;
/// use asperity_mechanics::topography::height_distribution::bearing_curve;
/// use asperity_mechanics::topography::shapes::Shape;
///
/// // Half of a wave lies above its mean, and nothing above √2 rms heights.
/// let wave = Shape::Wave { amplitude: 0.1, waves: 3 }.draw(Grid::square(32, 1.0)?);
/// let curve = bearing_curve(&wave, 2, 1.5);
/// let [top, mean, bottom] = [0, 1, 2].map(|index| curve[index].material_ratio);
/// assert_eq!((top, bottom), (0.0, 1.0));
/// assert!((mean - 0.5).abs() < 0.1);
/// # Ok::<(), asperity_mechanics::grid::GridError>(())
/// ```
pub fn bearing_curve(surface: &Surface, steps: usize, range: f64) -> Vec<BearingPoint> {
    let mut heights = deviations(surface.heights());
    let count = heights.len() as f64;
    let rms = (heights.iter().map(|height| height * height).sum::<f64>() / count).sqrt();
    heights.sort_unstable_by(|one, other| other.total_cmp(one));
    let level = |step: usize| {
        let level = range - 2.0 * range * step as f64 / steps as f64;
        let height = level * rms;
        let above = heights.partition_point(|other| *other >= height);
        BearingPoint { level, height, material_ratio: above as f64 / count }
    };
    (0..=steps).map(level).collect()
}

#[cfg(test)]
mod tests {
    use super::{Histogram, *};
    use crate::grid::samples::square;
    use crate::topography::random::samples;
    use crate::topography::shapes::Shape;
    use crate::topography::surface::Surface;

    fn counts(histogram: &Histogram) -> Vec<usize> {
        histogram.bins.iter().map(|bin| bin.count).collect()
    }

    #[test]
    fn two_equal_levels_lie_one_rms_height_from_the_mean() {
        let heights = vec![3.0, 7.0, 3.0, 7.0];
        let surface = Surface::new(square(2, 1.0), heights).unwrap();
        let histogram = Histogram::from_surface(&surface, 3, 1.5);
        assert_eq!(counts(&histogram), [2, 0, 2]);
        let centers: Vec<f64> = histogram.bins.iter().map(|bin| bin.center).collect();
        assert_eq!(centers, [-1.0, 0.0, 1.0]);
        assert_eq!(histogram.bins[0].density, 0.5);
    }

    #[test]
    fn ends_of_the_range_are_within_and_the_rest_is_outside() {
        let surface = Surface::new(square(2, 1.0), vec![-1.0, 1.0, -1.0, 1.0]).unwrap();
        assert_eq!(counts(&Histogram::from_surface(&surface, 4, 1.0)), [2, 0, 0, 2]);
        let narrow = Histogram::from_surface(&surface, 4, 0.5);
        assert_eq!((counts(&narrow), narrow.outside), (vec![0; 4], 4));
    }

    #[test]
    fn density_integrates_to_the_fraction_of_nodes_in_range() {
        let surface = Shape::Paraboloid { radius: 1.0 }.draw(square(50, 1.0));
        let histogram = Histogram::from_surface(&surface, 100, 1.2);
        let inside: usize = counts(&histogram).iter().sum();
        assert_eq!(inside + histogram.outside, 2500);
        assert!(histogram.outside > 0);
        let integral: f64 = histogram.bins.iter().map(|bin| bin.density * 0.024).sum();
        assert!((integral - inside as f64 / 2500.0).abs() < 1e-14);
    }

    #[test]
    fn many_modes_are_nearly_normally_distributed() {
        let random = samples::random(16, 32, 3);
        for bin in Histogram::from_surface(&random.draw(square(256, 1.0)), 20, 5.0).bins {
            let normal = libm::erf((bin.center + 0.25) / 2_f64.sqrt())
                - libm::erf((bin.center - 0.25) / 2_f64.sqrt());
            // The density is at most 0.4. Neighbouring nodes are correlated, so that the effective
            // sample is a few thousand heights.
            assert!((bin.density - normal).abs() < 0.02, "{bin:?}");
        }
    }

    #[test]
    fn a_flat_surface_is_all_mean() {
        let flat = Surface::new(square(3, 1.0), vec![0.1; 9]).unwrap();
        assert_eq!(counts(&Histogram::from_surface(&flat, 5, 2.0)), [0, 0, 9, 0, 0]);
    }

    /// Returns the histograms of two surfaces of four nodes.
    ///
    /// The heights of the first are ±1 times its rms height, those of the second are √3 and −1/√3
    /// times.
    fn histograms() -> [Histogram; 2] {
        [[0.0, 0.0, 1.0, 1.0], [0.0, 0.0, 0.0, 1.0]].map(|heights| {
            let surface = Surface::new(square(2, 1.0), heights.to_vec()).unwrap();
            Histogram::from_surface(&surface, 4, 1.8)
        })
    }

    #[test]
    fn mean_and_deviation_are_those_of_the_densities_of_each_surface() {
        let [even, uneven] = histograms();
        let pool = HistogramPool::from_histogram(&even).and(HistogramPool::from_histogram(&uneven));
        assert_eq!(pool.surfaces, 2);
        for (index, bin) in pool.bins().into_iter().enumerate() {
            let (a, b) = (even.bins[index].density, uneven.bins[index].density);
            assert_eq!(bin.center, even.bins[index].center);
            assert!((bin.mean - (a + b) / 2.0).abs() < 1e-15);
            // The sample standard deviation of two values is their distance divided by √2.
            assert!((bin.sd.unwrap() - (a - b).abs() / SQRT_2).abs() < 1e-15);
        }
    }

    #[test]
    fn order_and_grouping_change_no_bit() {
        let [a, b] = histograms().map(|histogram| HistogramPool::from_histogram(&histogram));
        let left = HistogramPool::default().and(a.clone()).and(b.clone()).and(a.clone());
        let right = b.and(a.clone().and(HistogramPool::default().and(a)));
        assert_eq!(left, right);
    }

    #[test]
    fn one_surface_has_no_deviation() {
        let [even, _] = histograms();
        assert!(HistogramPool::from_histogram(&even).bins().iter().all(|bin| bin.sd.is_none()));
    }

    #[test]
    fn normal_densities_integrate_to_one_and_are_symmetric() {
        let surface = Surface::new(square(2, 1.0), vec![0.0, 0.0, 1.0, 1.0]).unwrap();
        for bins in [7, 100] {
            let bins =
                HistogramPool::from_histogram(&Histogram::from_surface(&surface, bins, 9.0)).bins();
            let integral: f64 = bins.iter().map(|bin| bin.normal).sum::<f64>();
            let width = 18.0 / bins.len() as f64;
            assert!((integral * width - 1.0).abs() < 1e-14);
            for (left, right) in bins.iter().zip(bins.iter().rev()) {
                assert!((left.normal / right.normal - 1.0).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn differences_of_the_bearing_curve_are_the_counts_of_the_histogram() {
        let surface = Shape::Paraboloid { radius: 0.3 }.draw(square(41, 1.0));
        let levels = bearing_curve(&surface, 10, 3.0);
        let histogram = Histogram::from_surface(&surface, 10, 3.0);
        for (pair, bin) in levels.windows(2).zip(histogram.bins.iter().rev()) {
            let gained = (pair[1].material_ratio - pair[0].material_ratio) * 41.0 * 41.0;
            // A height on the boundary of two bins may round into either.
            assert!((gained - bin.count as f64).abs() < 4.5, "{gained} {bin:?}");
        }
    }

    #[test]
    fn the_material_ratio_of_a_punch_is_that_of_its_top() {
        let punch = Shape::Punch { radius: 0.3, depth: 1.0 };
        let surface = punch.draw(square(32, 1.0));
        let top = surface.heights().iter().filter(|&&h| h == 0.0).count() as f64 / 1024.0;
        let ratios: Vec<f64> =
            bearing_curve(&surface, 100, 5.0).iter().map(|l| l.material_ratio).collect();
        let distinct: std::collections::BTreeSet<u64> =
            ratios.iter().map(|share| share.to_bits()).collect();
        let expected = [0.0, top, 1.0].map(f64::to_bits);
        assert_eq!(distinct, expected.into());
    }

    #[test]
    fn a_flat_surface_lies_at_its_mean() {
        let surface = Surface::new(square(4, 1.0), vec![7.1; 16]).unwrap();
        let ratios = bearing_curve(&surface, 2, 1.0);
        assert!(ratios.iter().all(|level| level.material_ratio == 1.0));
    }
}
