//! How heights are distributed, in units of their own root mean square.

use super::descriptors::from_first_node;
use super::surface::Surface;

mod pool;

pub use pool::{Pool, PooledBin};

/// Density of the heights about their mean, scaled by the rms height of the surface.
#[derive(Debug, Clone, PartialEq)]
pub struct Histogram {
    /// From the lowest to the highest.
    pub bins: Vec<Bin>,
    /// Width of a bin, in rms heights.
    pub width: f64,
    /// The root mean square height about the mean that heights are scaled by; a length.
    pub rms_height: f64,
    /// Nodes beyond the range.
    pub outside: usize,
}

/// One interval of scaled heights, closed below; the last one is closed above too.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bin {
    /// Middle of the interval, in rms heights.
    pub center: f64,
    /// Nodes in it.
    pub count: usize,
    /// `count` per node of the surface and per width: a probability density, whose integral is the
    /// share of the nodes within the range.
    pub density: f64,
}

impl Histogram {
    /// Counts heights into `bins` equal intervals from −`range` to +`range` rms heights; at least
    /// one bin and a positive range. All heights of a flat surface are zero.
    pub fn of(surface: &Surface, bins: usize, range: f64) -> Self {
        let heights = from_first_node(surface.heights());
        let nodes = heights.len() as f64;
        let mean = heights.iter().sum::<f64>() / nodes;
        let deviations = heights.iter().map(|height| height - mean);
        let variance = deviations.clone().map(|d| d * d).sum::<f64>() / nodes;
        let scale = if variance > 0.0 { 1.0 / variance.sqrt() } else { 0.0 };
        let width = 2.0 * range / bins as f64;
        let mut counts = vec![0; bins];
        let mut outside = 0;
        for height in deviations.map(|deviation| scale * deviation) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::square;
    use crate::topography::random::{Amplitude, RandomSurface};
    use crate::topography::shapes::Shape;
    use crate::topography::spectrum::Spectrum;

    fn counts(histogram: &Histogram) -> Vec<usize> {
        histogram.bins.iter().map(|bin| bin.count).collect()
    }

    #[test]
    fn two_equal_levels_lie_one_rms_height_from_the_mean() {
        let heights = vec![3.0, 7.0, 3.0, 7.0];
        let surface = Surface::new(square(2, 1.0), heights).unwrap();
        let histogram = Histogram::of(&surface, 3, 1.5);
        assert_eq!(counts(&histogram), [2, 0, 2]);
        let centers: Vec<f64> = histogram.bins.iter().map(|bin| bin.center).collect();
        assert_eq!(centers, [-1.0, 0.0, 1.0]);
        assert_eq!(histogram.bins[0].density, 0.5);
    }

    #[test]
    fn ends_of_the_range_are_within_and_the_rest_is_outside() {
        let surface = Surface::new(square(2, 1.0), vec![-1.0, 1.0, -1.0, 1.0]).unwrap();
        assert_eq!(counts(&Histogram::of(&surface, 4, 1.0)), [2, 0, 0, 2]);
        let narrow = Histogram::of(&surface, 4, 0.5);
        assert_eq!((counts(&narrow), narrow.outside), (vec![0; 4], 4));
    }

    #[test]
    fn density_integrates_to_the_share_of_nodes_in_range() {
        let surface = Shape::Paraboloid { radius: 1.0 }.draw(square(50, 1.0));
        let histogram = Histogram::of(&surface, 100, 1.2);
        let inside: usize = counts(&histogram).iter().sum();
        assert_eq!(inside + histogram.outside, 2500);
        assert!(histogram.outside > 0);
        let integral: f64 = histogram.bins.iter().map(|bin| bin.density * 0.024).sum();
        assert!((integral - inside as f64 / 2500.0).abs() < 1e-14);
    }

    #[test]
    fn many_modes_are_nearly_normally_distributed() {
        let random = RandomSurface {
            spectrum: Spectrum {
                hurst: 0.8,
                k_lower: 16,
                k_rolloff: 16,
                k_upper: 32,
                anisotropy: None,
            },
            amplitude: Amplitude::Gaussian,
            rms_slope: 1.0,
            seed: 3,
            realization: 0,
        };
        for bin in Histogram::of(&random.draw(square(256, 1.0)), 20, 5.0).bins {
            let normal = libm::erf((bin.center + 0.25) / 2_f64.sqrt())
                - libm::erf((bin.center - 0.25) / 2_f64.sqrt());
            // Nodes of one wave are not independent: some thousand heights decide, of 0.4 at most.
            assert!((bin.density - normal).abs() < 0.02, "{bin:?}");
        }
    }

    #[test]
    fn a_flat_surface_is_all_mean() {
        let flat = Surface::new(square(3, 1.0), vec![0.1; 9]).unwrap();
        assert_eq!(counts(&Histogram::of(&flat, 5, 2.0)), [0, 0, 9, 0, 0]);
    }
}
