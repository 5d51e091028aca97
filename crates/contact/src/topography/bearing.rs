//! The bearing curve of a map (Abbott and Firestone): how much of the surface lies at or above a
//! height.

use super::descriptors::from_first_node;
use super::surface::Surface;

/// A plane that cuts the surface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    /// Its height above the mean, in rms heights.
    pub level: f64,
    /// The same as a length.
    pub height: f64,
    /// Share of the nodes at or above it, the areal material ratio Smr of ISO 25178-2.
    pub share: f64,
}

/// The share of the nodes at or above `steps` + 1 evenly spaced planes, from `range` rms heights
/// above the mean down to as many below. All nodes of a flat surface lie at its mean.
///
/// ```
/// use asperity_contact::grid::Grid;
/// use asperity_contact::topography::bearing::levels;
/// use asperity_contact::topography::shapes::Shape;
///
/// // Half of a wave lies above its mean, and nothing above √2 rms heights.
/// let wave = Shape::Wave { amplitude: 0.1, waves: 3 }.draw(Grid::square(32, 1.0)?);
/// let shares: Vec<f64> = levels(&wave, 2, 1.5).iter().map(|level| level.share).collect();
/// assert_eq!((shares[0], shares[2]), (0.0, 1.0));
/// assert!((shares[1] - 0.5).abs() < 0.1);
/// # Ok::<(), asperity_contact::grid::GridError>(())
/// ```
pub fn levels(surface: &Surface, steps: usize, range: f64) -> Vec<Level> {
    let mut heights = from_first_node(surface.heights());
    let count = heights.len() as f64;
    let mean = heights.iter().sum::<f64>() / count;
    heights.iter_mut().for_each(|height| *height -= mean);
    let rms = (heights.iter().map(|height| height * height).sum::<f64>() / count).sqrt();
    heights.sort_unstable_by(|one, other| other.total_cmp(one));
    let level = |step: usize| {
        let level = range - 2.0 * range * step as f64 / steps as f64;
        let height = level * rms;
        let above = heights.partition_point(|other| *other >= height);
        Level { level, height, share: above as f64 / count }
    };
    (0..=steps).map(level).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::square;
    use crate::topography::histogram::Histogram;
    use crate::topography::shapes::Shape;

    #[test]
    fn the_share_grows_by_what_the_histogram_counts() {
        let surface = Shape::Paraboloid { radius: 0.3 }.draw(square(41, 1.0));
        let levels = levels(&surface, 10, 3.0);
        let histogram = Histogram::of(&surface, 10, 3.0);
        for (pair, bin) in levels.windows(2).zip(histogram.bins.iter().rev()) {
            let gained = (pair[1].share - pair[0].share) * 41.0 * 41.0;
            // A height on the plane between two bins may round into either.
            assert!((gained - bin.count as f64).abs() < 4.5, "{gained} {bin:?}");
        }
    }

    #[test]
    fn a_punch_bears_on_its_top() {
        let punch = Shape::Punch { radius: 0.3, depth: 1.0 };
        let surface = punch.draw(square(32, 1.0));
        let top = surface.heights().iter().filter(|&&h| h == 0.0).count() as f64 / 1024.0;
        let shares: Vec<f64> = levels(&surface, 100, 5.0).iter().map(|l| l.share).collect();
        let distinct: std::collections::BTreeSet<u64> =
            shares.iter().map(|share| share.to_bits()).collect();
        let expected = [0.0, top, 1.0].map(f64::to_bits);
        assert_eq!(distinct, expected.into());
    }

    #[test]
    fn a_flat_surface_lies_at_its_mean() {
        let surface = Surface::new(square(4, 1.0), vec![7.1; 16]).unwrap();
        let shares = levels(&surface, 2, 1.0);
        assert!(shares.iter().all(|level| level.share == 1.0));
    }
}
