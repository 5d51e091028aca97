//! Moments of maps that are not periodic, from finite differences.
//!
//! Opposite edges of a measured map do not match. The steps between them do not belong to the
//! surface, but would dominate the slopes of a trigonometric interpolant. Finite differences inside
//! the map do not depend on these steps. They are defined as in the package SurfaceTopography:
//! forward differences at nodes with a next node along both axes, and second differences at inner
//! nodes. With the grid step Δ, they multiply the slope of a wave of length λ by sinc(Δ/λ). The
//! loss is half a per cent at 18 nodes per wave.
//!
//! [`along`] computes differences over larger distances, the scale-dependent roughness parameters
//! of Sanner et al. 2022, doi:10.1016/j.apsadv.2021.100190.

use super::moments::Moments;
use super::surface::{Axis, Scan, Surface, for_each_line};
use crate::grid::Boundary;

/// Computes the moments of a map from the mean squares of finite differences.
///
/// [`Moments::squared_pair_power`] is zero, because the map has no modes.
///
/// ```
/// use asperity_mechanics::grid::{Cell, Grid};
/// use asperity_mechanics::topography::differences;
/// use asperity_mechanics::topography::surface::Surface;
///
/// // An inclined plane, whose edges do not meet: h = 3x + 4y.
/// let grid = Grid::new([4, 5], Cell::new([2.0, 5.0])?)?;
/// let height = |node: usize| {
///     let [i, j] = grid.indices(node);
///     3.0 * 0.5 * i as f64 + 4.0 * j as f64
/// };
/// let plane = Surface::new(grid, (0..20).map(height).collect())?;
/// let moments = differences::moments(&plane);
/// assert_eq!([moments.m20, moments.m02, moments.rms_slope()], [9.0, 16.0, 5.0]);
/// assert_eq!([moments.m40, moments.m22, moments.m04], [0.0; 3]);
/// # Ok::<(), asperity_mechanics::topography::surface::SurfaceError>(())
/// ```
pub fn moments(surface: &Surface) -> Moments {
    let grid = surface.grid();
    let [nodes_x, nodes_y] = grid.nodes();
    let [step_x, step_y] = grid.spacing();
    let at = |i: usize, j: usize| surface.heights()[i * nodes_y + j];
    let along_x = |i: usize, j: usize| (at(i + 1, j) - at(i, j)) / step_x;
    let along_y = |i: usize, j: usize| (at(i, j + 1) - at(i, j)) / step_y;
    let mixed = |i: usize, j: usize| (along_x(i, j + 1) - along_x(i, j)) / step_y;
    let twice_x = |i: usize, j: usize| (along_x(i + 1, j + 1) - along_x(i, j + 1)) / step_x;
    let twice_y = |i: usize, j: usize| (along_y(i + 1, j + 1) - along_y(i + 1, j)) / step_y;
    let first = [nodes_x - 1, nodes_y - 1];
    let second = first.map(|nodes| nodes.saturating_sub(1));
    let first_height = at(0, 0);
    let above_first = |i: usize, j: usize| at(i, j) - first_height;
    let mean = mean_over(grid.nodes(), above_first);
    Moments {
        m00: mean_over(grid.nodes(), |i, j| (above_first(i, j) - mean).powi(2)),
        m20: mean_over(first, |i, j| along_x(i, j).powi(2)),
        m02: mean_over(first, |i, j| along_y(i, j).powi(2)),
        m22: mean_over(first, |i, j| mixed(i, j).powi(2)),
        m40: mean_over(second, |i, j| twice_x(i, j).powi(2)),
        m04: mean_over(second, |i, j| twice_y(i, j).powi(2)),
        squared_pair_power: 0.0,
    }
}

/// Returns the moments of a periodic map from its modes, and of another map from differences.
pub fn moments_within(surface: &Surface, boundary: Boundary) -> Moments {
    match boundary {
        Boundary::Periodic => Moments::from_surface(surface),
        Boundary::Free => moments(surface),
    }
}

/// Returns the mean of `value(i, j)` over N_x × N_y nodes, or zero if there are no nodes.
fn mean_over([nodes_x, nodes_y]: [usize; 2], value: impl Fn(usize, usize) -> f64) -> f64 {
    let nodes = (0..nodes_x).flat_map(|i| (0..nodes_y).map(move |j| (i, j)));
    let sum = nodes.fold(0.0, |sum, (i, j)| sum + value(i, j));
    sum / (nodes_x * nodes_y).max(1) as f64
}

/// Rms slope and curvature of a map at one distance along an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scale {
    /// Distance ℓ, in grid spacings along the axis.
    pub steps: usize,
    /// Rms slope √⟨((h(x + ℓ) − h(x))/ℓ)²⟩ along the axis.
    pub slope: f64,
    /// Rms curvature √⟨((h(x + ℓ) − 2 h(x) + h(x − ℓ))/ℓ²)²⟩ along the axis, in 1/length.
    pub curvature: f64,
}

/// Computes the rms slope and curvature of a map along `axis` at distances of 1, 2, 3, 4, 6, 8, 12,
/// … grid spacings.
///
/// Distances are at most half the side. Means are over all pairs and triples of nodes along the
/// axis. With [`Boundary::Periodic`], they continue across the edges.
///
/// ```
/// use asperity_mechanics::grid::{Boundary, Grid};
/// use asperity_mechanics::topography::surface::Axis;
/// use asperity_mechanics::topography::differences::along;
/// use asperity_mechanics::topography::shapes::Shape;
///
/// // The curvature of a paraboloid is 1/R at every scale.
/// let dome = Shape::Paraboloid { radius: 0.25 }.draw(Grid::square(16, 1.0)?);
/// for scale in along(&dome, Axis::X, Boundary::Free) {
///     assert!((scale.curvature - 4.0).abs() < 1e-11);
/// }
/// # Ok::<(), asperity_mechanics::grid::GridError>(())
/// ```
pub fn along(surface: &Surface, axis: Axis, boundary: Boundary) -> Vec<Scale> {
    let nodes = axis.select(surface.grid().nodes());
    let spacing = axis.select(surface.grid().spacing());
    let longest = match boundary {
        Boundary::Periodic => nodes / 2,
        Boundary::Free => nodes.saturating_sub(1) / 2,
    };
    let distances: Vec<usize> = distances(longest).collect();
    let mut sums = vec![Sums::default(); distances.len()];
    for_each_line(surface, axis, |line| {
        for (sums, &steps) in sums.iter_mut().zip(&distances) {
            sums.add(line, steps, boundary);
        }
    });
    let scale = |(&steps, sums): (&usize, Sums)| {
        let length = steps as f64 * spacing;
        Scale {
            steps,
            slope: sums.first.root_mean() / length,
            curvature: sums.second.root_mean() / (length * length),
        }
    };
    distances.iter().zip(sums).map(scale).collect()
}

/// Returns the numbers 2ⁿ and 1.5 × 2ⁿ that are integers and at most `longest`, in ascending order.
fn distances(longest: usize) -> impl Iterator<Item = usize> {
    let powers = (0..usize::BITS).map(|power| 1_usize << power);
    let both = powers.flat_map(|power| [power, power + power / 2]);
    let mut before = 0;
    both.take_while(move |steps| *steps <= longest)
        .filter(move |steps| std::mem::replace(&mut before, *steps) < *steps)
}

/// Returns the rms step between opposite edges of a map, along the axis where it is larger, over
/// the rms step between neighbouring nodes. A rough map of one period has a ratio of about 1. Steps
/// to missing points are left out.
pub fn edge_step_ratio(scan: &Scan) -> f64 {
    let ([nodes_x, nodes_y], heights) = (scan.grid().nodes(), scan.heights());
    let mut inside = MeanSquare::default();
    let edges = [(nodes_x, nodes_y), (nodes_y, 1)].map(|(nodes, stride)| {
        let mut edge = MeanSquare::default();
        for (node, height) in heights.iter().enumerate() {
            let position = node / stride % nodes;
            let is_last = position + 1 == nodes;
            let next = if is_last { node - position * stride } else { node + stride };
            let step = heights[next] - height;
            if step.is_finite() {
                if is_last { edge.add(step) } else { inside.add(step) }
            }
        }
        edge.root_mean()
    });
    // Without steps, the mean is not a number, and `max` ignores it.
    edges.map(|edge| edge / inside.root_mean()).into_iter().fold(0.0, f64::max)
}

#[derive(Clone, Copy, Default)]
struct MeanSquare {
    sum: f64,
    count: usize,
}

impl MeanSquare {
    fn add(&mut self, value: f64) {
        self.sum += value * value;
        self.count += 1;
    }

    fn root_mean(self) -> f64 {
        (self.sum / self.count as f64).sqrt()
    }
}

/// Mean squares of the first and second differences between heights at one distance.
#[derive(Clone, Copy, Default)]
struct Sums {
    first: MeanSquare,
    second: MeanSquare,
}

impl Sums {
    fn add(&mut self, line: &[f64], steps: usize, boundary: Boundary) {
        let nodes = line.len();
        match boundary {
            Boundary::Periodic => {
                for (i, height) in line.iter().enumerate() {
                    let after = line[(i + steps) % nodes] - height;
                    let before = height - line[(i + nodes - steps) % nodes];
                    self.first.add(after);
                    self.second.add(after - before);
                }
            }
            Boundary::Free => {
                for i in 0..nodes - steps {
                    self.first.add(line[i + steps] - line[i]);
                }
                for i in steps..nodes - steps {
                    let (before, after) = (line[i] - line[i - steps], line[i + steps] - line[i]);
                    self.second.add(after - before);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;
    use crate::grid::samples::rectangle;
    use crate::topography::shapes::Shape;

    #[test]
    fn a_paraboloid_has_its_curvature_along_either_axis() {
        let surface = Shape::Paraboloid { radius: 0.25 }.draw(rectangle([9, 20], [1.0, 3.0]));
        let moments = moments(&surface);
        for found in [moments.m40, moments.m04] {
            assert!((found - 16.0).abs() < 1e-9, "{found}");
        }
        assert!(moments.m22 < 1e-20);
    }

    #[test]
    fn a_saddle_has_nothing_but_the_mixed_derivative() {
        let grid = rectangle([6, 8], [1.5, 4.0]);
        let heights = (0..grid.count()).map(|node| {
            let [i, j] = grid.indices(node);
            3.0 * (0.25 * i as f64) * (0.5 * j as f64)
        });
        let moments = moments(&Surface::new(grid, heights.collect()).unwrap());
        assert!((moments.m22 - 9.0).abs() < 1e-12);
        assert!(moments.m40.max(moments.m04) < 1e-24);
    }

    #[test]
    fn a_long_wave_has_the_moments_of_its_modes() {
        // With 200 nodes per wave, differences keep 1 − (π/200)²/3 of the square slope. At each
        // edge, one node in 400 is omitted, where the square curvature is twice the mean.
        let (amplitude, waves) = (0.1, 2);
        let surface =
            Shape::WaveProduct { amplitude, waves }.draw(rectangle([400, 400], [1.0, 2.0]));
        let (found, exact) = (moments(&surface), Moments::from_surface(&surface));
        for (found, exact) in [
            (found.m00, exact.m00),
            (found.m20, exact.m20),
            (found.m02, exact.m02),
            (found.m22, exact.m22),
            (found.m40, exact.m40),
            (found.m04, exact.m04),
        ] {
            assert!((found / exact - 1.0).abs() < 0.015, "{found} {exact}");
        }
    }

    #[test]
    fn a_row_has_no_gradient() {
        for nodes in [[1, 7], [7, 1], [1, 1], [2, 2]] {
            let grid = rectangle(nodes, [1.0, 1.0]);
            let heights = (0..grid.count()).map(|node| (node * node) as f64);
            let moments = moments(&Surface::new(grid, heights.collect()).unwrap());
            assert_eq!(moments.m40, 0.0);
            assert!(moments.rms_slope().is_finite());
        }
    }

    #[test]
    fn distances_double_in_two_steps() {
        let found: Vec<usize> = distances(20).collect();
        assert_eq!(found, [1, 2, 3, 4, 6, 8, 12, 16]);
        assert_eq!(distances(0).count(), 0);
    }

    #[test]
    fn a_wave_has_the_slope_of_its_chords() {
        let (amplitude, waves) = (0.1, 2);
        let wave = Shape::Wave { amplitude, waves }.draw(rectangle([64, 8], [3.0, 1.0]));
        for scale in along(&wave, Axis::X, Boundary::Periodic) {
            let half = PI * 2.0 * scale.steps as f64 / 64.0;
            let length = 3.0 * scale.steps as f64 / 64.0;
            // The first difference has the amplitude 2 Δ sin(qℓ/2), the second 4 Δ sin²(qℓ/2).
            let chord = 2.0 * amplitude * half.sin().abs() / 2_f64.sqrt() / length;
            let bend = 4.0 * amplitude * half.sin().powi(2) / 2_f64.sqrt() / length.powi(2);
            assert!((scale.slope - chord).abs() < 1e-13);
            assert!((scale.curvature - bend).abs() < 1e-11);
        }
    }

    #[test]
    fn one_step_gives_differences_of_neighbours() {
        // All lines are equal, so that omitting the last line does not change means.
        let grid = rectangle([12, 9], [2.0, 1.0]);
        let height = |node: usize| libm::sin((grid.indices(node)[0] as f64).powi(2));
        let surface = Surface::new(grid, (0..grid.count()).map(height).collect()).unwrap();
        let of_neighbours = moments(&surface);
        let scale = along(&surface, Axis::X, Boundary::Free)[0];
        assert!((scale.slope.powi(2) / of_neighbours.m20 - 1.0).abs() < 1e-13);
        assert!((scale.curvature.powi(2) / of_neighbours.m40 - 1.0).abs() < 1e-13);
    }

    #[test]
    fn a_line_of_two_nodes_has_no_second_difference() {
        let surface = Shape::Paraboloid { radius: 1.0 }.draw(rectangle([2, 1], [1.0, 1.0]));
        assert_eq!(along(&surface, Axis::X, Boundary::Free), []);
        assert_eq!(along(&surface, Axis::Y, Boundary::Free), []);
    }

    #[test]
    fn edges_of_a_period_match_and_those_of_a_part_of_it_do_not() {
        let grid = rectangle([32, 48], [2.0, 3.0]);
        let wave = Shape::WaveProduct { amplitude: 0.1, waves: 2 }.draw(grid);
        let whole = edge_step_ratio(&Scan::from(wave.clone()));
        assert!(whole < 2.0, "{whole}");
        for axis in [0, 1] {
            // The map gets a step of 0.3 along the axis.
            let heights = wave.heights().iter().enumerate().map(|(node, height)| {
                height + 0.3 * grid.indices(node)[axis] as f64 / grid.nodes()[axis] as f64
            });
            let heights = Vec::from_iter(heights);
            let mut holes = heights.clone();
            holes[7] = f64::NAN;
            for heights in [heights, holes] {
                let ratio = edge_step_ratio(&Scan::new(grid, heights).unwrap());
                assert!(ratio > 4.0, "{ratio} along axis {axis}");
            }
        }
        let flat = Scan::new(grid, vec![0.0; grid.count()]).unwrap();
        assert_eq!(edge_step_ratio(&flat), 0.0);
    }
}
