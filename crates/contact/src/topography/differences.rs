//! Moments of a map that is not periodic, from differences between its nodes.
//!
//! A measured map is a window: its opposite edges do not meet, and the steps between them, which are
//! none of the surface, would dominate the slopes of a trigonometric interpolant. Differences inside
//! the map know nothing of them. They are those of SurfaceTopography: the gradient from one node to
//! the next, where there is a next one along both axes, and second differences about inner nodes.
//! Waves of λ, on steps of Δ, lose sinc(Δ/λ) of their slope to them, half a per cent at 18 nodes a
//! wave.

use super::moments::Moments;
use super::surface::Surface;

/// Mean squares of differences of the heights: [`Moments`] as far as a map that is not periodic has
/// them. Of modes it has none.
///
/// ```
/// use asperity_contact::grid::{Cell, Grid};
/// use asperity_contact::topography::differences;
/// use asperity_contact::topography::surface::Surface;
///
/// // An inclined plane, whose edges do not meet: h = 3x + 4y.
/// let grid = Grid::new([4, 5], Cell::new([2.0, 5.0])?)?;
/// let height = |node: usize| {
///     let [i, j] = grid.place(node);
///     3.0 * 0.5 * i as f64 + 4.0 * j as f64
/// };
/// let plane = Surface::new(grid, (0..20).map(height).collect())?;
/// let moments = differences::moments(&plane);
/// assert_eq!([moments.m20, moments.m02, moments.rms_slope()], [9.0, 16.0, 5.0]);
/// assert_eq!([moments.m40, moments.m22, moments.m04], [0.0; 3]);
/// # Ok::<(), asperity_contact::topography::surface::SurfaceError>(())
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

/// Mean of a value over so many nodes; zero over none.
fn mean_over([nodes_x, nodes_y]: [usize; 2], value: impl Fn(usize, usize) -> f64) -> f64 {
    let nodes = (0..nodes_x).flat_map(|i| (0..nodes_y).map(move |j| (i, j)));
    let sum = nodes.fold(0.0, |sum, (i, j)| sum + value(i, j));
    sum / (nodes_x * nodes_y).max(1) as f64
}

#[cfg(test)]
mod tests {
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
            let [i, j] = grid.place(node);
            3.0 * (0.25 * i as f64) * (0.5 * j as f64)
        });
        let moments = moments(&Surface::new(grid, heights.collect()).unwrap());
        assert!((moments.m22 - 9.0).abs() < 1e-12);
        assert!(moments.m40.max(moments.m04) < 1e-24);
    }

    #[test]
    fn a_long_wave_has_the_moments_of_its_modes() {
        // 200 nodes a wave: 1 − (π/200)²/3 of the square slope, and at either edge one node in 400 that
        // has no neighbour, twice the mean of its curvature.
        let (amplitude, waves) = (0.1, 2);
        let surface =
            Shape::WaveProduct { amplitude, waves }.draw(rectangle([400, 400], [1.0, 2.0]));
        let (found, exact) = (moments(&surface), Moments::of(&surface));
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
}
