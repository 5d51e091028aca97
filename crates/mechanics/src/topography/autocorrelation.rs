//! Autocorrelation function of a map (ISO 25178-2).

use super::descriptors::deviations;
use super::surface::{Axis, Surface};
use crate::fft::Transform;
use crate::grid::{Boundary, Grid};

/// Autocorrelation function A(r) = ⟨h(x) h(x + r)⟩ of heights about their mean, in length².
///
/// Lags r are at most half of each side. Means are over all pairs of nodes with the lag r. On a
/// periodic map, pairs continue across the edges. On other maps, large lags have few pairs.
///
/// ```
/// use asperity_mechanics::grid::{Boundary, Grid};
/// use asperity_mechanics::topography::autocorrelation::Autocorrelation;
/// use asperity_mechanics::topography::surface::Axis;
/// use asperity_mechanics::topography::shapes::Shape;
///
/// // A(r) of a wave of amplitude Δ is a wave of amplitude Δ²/2.
/// let wave = Shape::Wave { amplitude: 0.2, waves: 1 }.draw(Grid::square(8, 1.0)?);
/// let along_x = Autocorrelation::from_surface(&wave, Boundary::Periodic).along(Axis::X);
/// for (found, exact) in along_x.iter().zip([0.02, 0.02 * 0.5_f64.sqrt(), 0.0]) {
///     assert!((found - exact).abs() < 1e-16);
/// }
/// # Ok::<(), asperity_mechanics::grid::GridError>(())
/// ```
pub struct Autocorrelation {
    grid: Grid,
    /// Numbers of rows and columns of `values`. If the map is not periodic, they include its zero
    /// padding.
    nodes: [usize; 2],
    values: Vec<f64>,
}

/// Mean of A(r) over a ring of lags r of about the same length.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LagRing {
    /// Length |r| of the lags, rounded, in units of max(Δx, Δy).
    pub steps: u32,
    /// Mean of A(r) over all directions, in length².
    pub value: f64,
}

/// Distances over which the autocorrelation function decays, in the unit of the sides.
///
/// In each direction, the decay length is the first distance at which A(r) falls to the threshold s
/// times A(0). ISO 25178-2 uses s = 0.2.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DecayLengths {
    /// Autocorrelation length Sal (ISO 25178-2:2021, 4.3.2): the shortest decay length of all
    /// directions. `None` if A(r) decays in no direction.
    pub shortest: Option<f64>,
    /// Longest decay length of all directions. `None` if A(r) does not decay in some direction.
    pub longest: Option<f64>,
}

impl DecayLengths {
    /// Returns the texture aspect ratio Str (4.3.3): shortest over longest decay length.
    ///
    /// It is 1 for an isotropic surface, and `None` for a grating, which does not decay along its
    /// ridges.
    pub fn aspect_ratio(&self) -> Option<f64> {
        Some(self.shortest? / self.longest?)
    }
}

impl Autocorrelation {
    /// Computes the autocorrelation of a map from its power spectrum (Wiener–Khinchin theorem).
    ///
    /// A map that is not periodic is padded with zeros to twice its numbers of nodes.
    pub fn from_surface(surface: &Surface, boundary: Boundary) -> Self {
        let grid = surface.grid();
        let map = grid.nodes();
        let nodes = match boundary {
            Boundary::Periodic => map,
            Boundary::Free => map.map(|nodes| 2 * nodes),
        };
        let mut padded = vec![0.0; nodes[0] * nodes[1]];
        let rows = padded.chunks_exact_mut(nodes[1]);
        for (row, heights) in rows.zip(deviations(surface.heights()).chunks_exact(map[1])) {
            row[..map[1]].copy_from_slice(heights);
        }
        let transform = Transform::new(nodes);
        let mut spectrum = transform.spectrum(&padded);
        for value in &mut spectrum {
            *value = value.norm_sqr().into();
        }
        let values = transform.field(spectrum);
        let mut correlation = Self { grid, nodes, values };
        correlation.normalize(boundary);
        correlation
    }

    /// Divides each value of the unnormalised inverse transform by the number of transformed values
    /// and by the number of pairs of nodes with its lag.
    fn normalize(&mut self, boundary: Boundary) {
        let (map, nodes) = (self.grid.nodes(), self.nodes);
        let count = (nodes[0] * nodes[1]) as f64;
        for (index, value) in self.values.iter_mut().enumerate() {
            let lag = [index / nodes[1], index % nodes[1]];
            let pairs = |axis: usize| match boundary {
                Boundary::Periodic => map[axis],
                // Lags without pairs are unused; the lower bound of one avoids a division by zero.
                Boundary::Free => {
                    let lag = lag[axis].min(nodes[axis] - lag[axis]);
                    (map[axis] - lag).max(1)
                }
            };
            *value /= count * pairs(0) as f64 * pairs(1) as f64;
        }
    }

    /// Returns A(r) at lags r of 0, 1, 2, … grid spacings along an axis, up to half the side.
    pub fn along(&self, axis: Axis) -> Vec<f64> {
        let step = axis.select([self.nodes[1], 1]);
        let lags = 0..=axis.select(self.grid.nodes()) / 2;
        lags.map(|lag| self.values[lag * step]).collect()
    }

    /// Returns the means of A(r) over rings of lags r, up to half the shorter side.
    ///
    /// A ring contains the lags with lengths |r| that round to the same multiple of max(Δx, Δy).
    /// Lag zero is a ring of its own. Other lags shorter than max(Δx, Δy)/2 are along one axis only
    /// and in no ring.
    pub fn rings(&self) -> Vec<LagRing> {
        let spacing = self.grid.spacing();
        let step = spacing[0].max(spacing[1]);
        let [half_x, half_y] = self.grid.nodes().map(|nodes| nodes / 2);
        let longest = (half_x as f64 * spacing[0]).min(half_y as f64 * spacing[1]) / step;
        // The margin keeps the last ring if rounding makes `longest` too small.
        let mut sums = vec![(0.0, 0.0); (longest + 1e-9) as usize + 1];
        for i in 0..=half_x {
            for (j, weight) in self.weighted_lags(i) {
                let [x, y] = [i as f64 * spacing[0], j as f64 * spacing[1]];
                let ring = ((x * x + y * y).sqrt() / step).round() as usize;
                if ring == 0 && (i, j) != (0, 0) {
                    continue;
                }
                let value = self.value(i, j);
                if let Some((count, sum)) = sums.get_mut(ring) {
                    *count += weight;
                    *sum += weight * value;
                }
            }
        }
        let means = sums.into_iter().zip(0..);
        let ring =
            |((count, sum), steps)| (count > 0.0).then(|| LagRing { steps, value: sum / count });
        means.filter_map(ring).collect()
    }

    /// Finds the shortest and the longest distance over which A(r) decays to `threshold` × A(0).
    ///
    /// Lags are at most half of each side. There is one direction for each lag at the edge of this
    /// range, so that neighbouring directions are at most one lag apart. Between lags, A(r) is
    /// interpolated linearly. Flat surfaces and single rows of nodes have no decay lengths.
    pub fn decay_lengths(&self, threshold: f64) -> DecayLengths {
        let [half_x, half_y] = self.grid.nodes().map(|nodes| (nodes / 2) as isize);
        if self.values[0] <= 0.0 || half_x == 0 || half_y == 0 {
            return DecayLengths::default();
        }
        let ends_along_y = (-half_y..=half_y).map(|j| [half_x, j]);
        let ends_along_x = (0..half_x).flat_map(|i| [[i, -half_y], [i, half_y]]);
        let lengths = ends_along_y.chain(ends_along_x).map(|end| self.decay_length(end, threshold));
        let mut found = DecayLengths { shortest: None, longest: Some(0.0) };
        for length in lengths {
            if let Some(length) = length {
                found.shortest = Some(found.shortest.map_or(length, |other| length.min(other)));
            }
            found.longest = found.longest.zip(length).map(|(one, other)| one.max(other));
        }
        found
    }

    /// Returns the decay length in the direction of the lag `end`, or `None` if A(r) does not decay
    /// before this lag.
    fn decay_length(&self, end: [isize; 2], threshold: f64) -> Option<f64> {
        let steps = end[0].unsigned_abs().max(end[1].unsigned_abs());
        let mut before = 1.0;
        for step in 1..=steps {
            let share = step as f64 / steps as f64;
            let value = self.between(end.map(|lag| share * lag as f64)) / self.values[0];
            if value <= threshold {
                let fraction = (before - threshold) / (before - value);
                let steps_to_threshold = (step - 1) as f64 + fraction;
                let spacing = self.grid.spacing();
                let [x, y] = [0, 1].map(|axis| end[axis] as f64 * spacing[axis]);
                return Some(steps_to_threshold / steps as f64 * (x * x + y * y).sqrt());
            }
            before = value;
        }
        None
    }

    /// Interpolates A(r) between the four lags around (i, j), where i ≥ 0.
    fn between(&self, [i, j]: [f64; 2]) -> f64 {
        let [low_i, low_j] = [i.floor(), j.floor()];
        let [x, y] = [i - low_i, j - low_j];
        let along_y = |i: usize| {
            let value = self.value(i, low_j as isize);
            // The lag beyond the end of a direction is not read.
            if y > 0.0 { value + y * (self.value(i, low_j as isize + 1) - value) } else { value }
        };
        let value = along_y(low_i as usize);
        if x > 0.0 { value + x * (along_y(low_i as usize + 1) - value) } else { value }
    }

    /// Iterates over the lags (i, j) with the given i, as pairs of j and the weight of the lag in
    /// means.
    ///
    /// A lag also represents its opposite (−i, −j). For i = 0, both are in the list, so their
    /// weight is one half.
    fn weighted_lags(&self, i: usize) -> impl Iterator<Item = (isize, f64)> + use<> {
        let half = self.grid.nodes()[1] / 2;
        let half = half as isize;
        let weight = if i == 0 { 0.5 } else { 1.0 };
        (-half..=half).map(move |j| (j, weight))
    }

    fn value(&self, i: usize, j: isize) -> f64 {
        let wrapped = j.rem_euclid(self.nodes[1] as isize) as usize;
        self.values[i * self.nodes[1] + wrapped]
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::grid::samples::{rectangle, square};
    use crate::topography::moments::Moments;
    use crate::topography::shapes::Shape;

    fn rough(nodes: [usize; 2]) -> Surface {
        let grid = rectangle(nodes, [nodes[0] as f64, nodes[1] as f64]);
        let height = |node: usize| 3.0 + libm::sin(7.0 + (node * node) as f64);
        Surface::new(grid, (0..grid.count()).map(height).collect()).unwrap()
    }

    fn directly(surface: &Surface, [lag_x, lag_y]: [usize; 2], wraps: bool) -> f64 {
        let [nodes_x, nodes_y] = surface.grid().nodes();
        let heights = surface.heights();
        let mean = heights.iter().sum::<f64>() / heights.len() as f64;
        let (mut sum, mut pairs) = (0.0, 0.0);
        for (node, height) in heights.iter().enumerate() {
            let [i, j] = surface.grid().indices(node);
            let (i, j) = (i + lag_x, j + lag_y);
            if wraps || (i < nodes_x && j < nodes_y) {
                let other = heights[i % nodes_x * nodes_y + j % nodes_y];
                sum += (height - mean) * (other - mean);
                pairs += 1.0;
            }
        }
        sum / pairs
    }

    #[test]
    fn products_are_those_of_the_pairs_that_there_are() {
        for nodes in [[8, 6], [5, 7], [4, 9]] {
            let surface = rough(nodes);
            for (boundary, wraps) in [(Boundary::Periodic, true), (Boundary::Free, false)] {
                let found = Autocorrelation::from_surface(&surface, boundary);
                let [along_x, along_y] = Axis::BOTH.map(|axis| found.along(axis));
                assert_eq!(along_x.len(), nodes[0] / 2 + 1);
                for (lag, value) in along_x.iter().enumerate() {
                    let exact = directly(&surface, [lag, 0], wraps);
                    assert!((value - exact).abs() < 1e-14, "{lag}: {value} {exact}");
                }
                for (lag, value) in along_y.iter().enumerate() {
                    let exact = directly(&surface, [0, lag], wraps);
                    assert!((value - exact).abs() < 1e-14);
                }
            }
        }
    }

    #[test]
    fn without_lag_it_is_the_variance() {
        let nodes = [12, 10];
        for side in [0.5, 5.0, 9.5, 25.0, 2000.0] {
            let grid = rectangle(nodes, [side, 10.0]);
            let surface = Surface::new(grid, rough(nodes).into_heights()).unwrap();
            for boundary in [Boundary::Periodic, Boundary::Free] {
                let found = Autocorrelation::from_surface(&surface, boundary);
                let variance = Moments::from_surface(&surface).m00;
                assert!((found.along(Axis::X)[0] - variance).abs() < 1e-14);
                let first = found.rings()[0];
                assert_eq!(first.steps, 0);
                assert!((first.value - variance).abs() < 1e-14, "{side}: {first:?}");
            }
        }
    }

    #[test]
    fn rings_take_the_mean_over_directions() {
        let surface = rough([9, 9]);
        let found = Autocorrelation::from_surface(&surface, Boundary::Free);
        let rings = found.rings();
        assert_eq!(rings.len(), 5);
        // Lengths of 1 and √2 round to one; each has four directions.
        let opposite = |surface: &Surface| {
            let grid = surface.grid();
            let turned = (0..81).map(|node| {
                let [i, j] = grid.indices(node);
                surface.heights()[i * 9 + 8 - j]
            });
            Surface::new(grid, turned.collect()).unwrap()
        };
        let lags = [[1, 0], [0, 1], [1, 1]].map(|lag| directly(&surface, lag, false));
        let other = directly(&opposite(&surface), [1, 1], false);
        let mean = (lags.iter().sum::<f64>() + other) / 4.0;
        assert!((rings[1].value - mean).abs() < 1e-14);
    }

    #[test]
    fn a_product_of_waves_decays_like_a_product_of_cosines() {
        // A(r)/A(0) = cos(2πx/λ_x) cos(2πy/λ_y) falls to s along the axes at arccos(s) λ/2π. The
        // lobe in between is convex, and with λ_y = 3 λ_x, these are the extreme decay lengths.
        let product = Shape::WaveProduct { amplitude: 0.1, waves: 2 };
        let surface = product.draw(rectangle([256, 256], [1.0, 3.0]));
        let correlation = Autocorrelation::from_surface(&surface, Boundary::Periodic);
        for threshold in [0.2, 0.5] {
            let found = correlation.decay_lengths(threshold);
            let exact = libm::acos(threshold) / TAU / 2.0;
            // With n = 128 lags per wave, linear interpolation changes them by less than (2π/n)²/8.
            assert!((found.shortest.unwrap() / exact - 1.0).abs() < 3e-4);
            assert!((found.aspect_ratio().unwrap() - 1.0 / 3.0).abs() < 3e-4);
        }
        // With equal wavelengths the diagonals are longest, where cos²(2πx/λ) = s.
        let surface = product.draw(square(256, 1.0));
        let found = Autocorrelation::from_surface(&surface, Boundary::Periodic).decay_lengths(0.2);
        let exact = libm::acos(0.2) / (libm::acos(0.2_f64.sqrt()) * 2.0_f64.sqrt());
        assert!((found.aspect_ratio().unwrap() - exact).abs() < 1e-3);
    }

    #[test]
    fn a_grating_does_not_decay_along_its_ridges() {
        let grating = Shape::Wave { amplitude: 0.1, waves: 4 }.draw(square(256, 2.0));
        // Inside a map of four periods, the products of pairs have the mean cos(qr)/2 only to 2 %.
        for (boundary, tolerance) in [(Boundary::Periodic, 1e-3), (Boundary::Free, 0.05)] {
            let found = Autocorrelation::from_surface(&grating, boundary).decay_lengths(0.2);
            let exact = libm::acos(0.2) / TAU / 2.0;
            assert!((found.shortest.unwrap() / exact - 1.0).abs() < tolerance);
            assert_eq!((found.longest, found.aspect_ratio()), (None, None));
        }
    }

    #[test]
    fn flat_surfaces_and_single_rows_have_no_decay_length() {
        let flat = Surface::new(square(4, 1.0), vec![0.1; 16]).unwrap();
        let row = rough([1, 12]);
        for surface in [flat, row] {
            let correlation = Autocorrelation::from_surface(&surface, Boundary::Free);
            assert_eq!(correlation.decay_lengths(0.2), DecayLengths::default());
        }
    }
}
