//! How a distribution of heights varies between surfaces: sums over their histograms.

use std::f64::consts::SQRT_2;

use super::{Bin, Histogram};

/// Histograms of several surfaces on equal meshes, added up bin by bin.
///
/// The sums are whole numbers: surfaces may be added in any order.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Pool {
    surfaces: u32,
    /// Nodes of all surfaces, within the range and beyond.
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

/// One interval of the heights of several surfaces, each scaled by its own rms height.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PooledBin {
    /// Middle of the interval, in rms heights.
    pub center: f64,
    /// Mean over the surfaces of their densities.
    pub mean: f64,
    /// Standard deviation of the density between surfaces; one surface has none.
    pub sd: Option<f64>,
    /// Mean over the interval of the density of a standard normal variable.
    pub normal: f64,
}

impl Pool {
    /// One surface.
    pub fn of(histogram: &Histogram) -> Self {
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

    /// These surfaces and others, counted into the same bins.
    pub fn and(mut self, other: Pool) -> Self {
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

    /// How many surfaces there are.
    pub fn surfaces(&self) -> u32 {
        self.surfaces
    }

    /// The distribution, bin by bin.
    pub fn bins(&self) -> Vec<PooledBin> {
        let surfaces = f64::from(self.surfaces);
        // Of one node of one surface.
        let density = surfaces / (self.nodes as f64 * self.width);
        let bin = |sums: &Sums| PooledBin {
            center: sums.center,
            mean: density * sums.count as f64 / surfaces,
            sd: self.variance(sums).map(|variance| density * variance.sqrt()),
            normal: self.normal(sums.center),
        };
        self.bins.iter().map(bin).collect()
    }

    /// Sample variance of a bin's count; the difference of whole numbers cancels nothing.
    fn variance(&self, sums: &Sums) -> Option<f64> {
        let surfaces = u128::from(self.surfaces);
        let pairs = surfaces * surfaces.saturating_sub(1);
        let excess = surfaces * sums.square - u128::from(sums.count).pow(2);
        (pairs > 0).then(|| excess as f64 / pairs as f64)
    }

    fn normal(&self, center: f64) -> f64 {
        let [low, high] = [center - self.width / 2.0, center + self.width / 2.0];
        // Both ends on one side of the mean: tails, so that nothing cancels far from it.
        let (near, far) = (low.abs().min(high.abs()), low.abs().max(high.abs()));
        let share = if low < 0.0 && high > 0.0 {
            libm::erf(near / SQRT_2) + libm::erf(far / SQRT_2)
        } else {
            libm::erfc(near / SQRT_2) - libm::erfc(far / SQRT_2)
        };
        share / (2.0 * self.width)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::square;
    use crate::topography::surface::Surface;

    /// Four nodes at −1 and +1 rms heights from the mean, or at √3 and −1/√3.
    fn histograms() -> [Histogram; 2] {
        [[0.0, 0.0, 1.0, 1.0], [0.0, 0.0, 0.0, 1.0]].map(|heights| {
            let surface = Surface::new(square(2, 1.0), heights.to_vec()).unwrap();
            Histogram::of(&surface, 4, 1.8)
        })
    }

    #[test]
    fn mean_and_deviation_are_those_of_the_densities_of_each_surface() {
        let [even, uneven] = histograms();
        let pool = Pool::of(&even).and(Pool::of(&uneven));
        assert_eq!(pool.surfaces(), 2);
        for (index, bin) in pool.bins().into_iter().enumerate() {
            let (a, b) = (even.bins[index].density, uneven.bins[index].density);
            assert_eq!(bin.center, even.bins[index].center);
            assert!((bin.mean - (a + b) / 2.0).abs() < 1e-15);
            // The sample deviation of two values is their distance over √2.
            assert!((bin.sd.unwrap() - (a - b).abs() / SQRT_2).abs() < 1e-15);
        }
    }

    #[test]
    fn order_and_grouping_change_no_bit() {
        let [a, b] = histograms().map(|histogram| Pool::of(&histogram));
        let left = Pool::default().and(a.clone()).and(b.clone()).and(a.clone());
        let right = b.and(a.clone().and(Pool::default().and(a)));
        assert_eq!(left, right);
    }

    #[test]
    fn one_surface_has_no_deviation() {
        let [even, _] = histograms();
        assert!(Pool::of(&even).bins().iter().all(|bin| bin.sd.is_none()));
    }

    #[test]
    fn normal_densities_integrate_to_one_and_are_symmetric() {
        let surface = Surface::new(square(2, 1.0), vec![0.0, 0.0, 1.0, 1.0]).unwrap();
        for bins in [7, 100] {
            let bins = Pool::of(&Histogram::of(&surface, bins, 9.0)).bins();
            let integral: f64 = bins.iter().map(|bin| bin.normal).sum::<f64>();
            let width = 18.0 / bins.len() as f64;
            assert!((integral * width - 1.0).abs() < 1e-14);
            for (left, right) in bins.iter().zip(bins.iter().rev()) {
                assert!((left.normal / right.normal - 1.0).abs() < 1e-12);
            }
        }
    }
}
