//! Significant peaks of a surface: the feature parameters Spd and Spc of ISO 25178-2.
//!
//! A hill is the set of nodes from which the steepest ascent leads to the same peak. Two hills meet
//! at a saddle. The local height of a hill is the height of its peak above its highest saddle.
//! Wolf pruning merges the hill of the smallest local height with its neighbour beyond that saddle,
//! until all local heights reach a fraction of Sz (ISO 25178-2:2021, 5.4). The smallest hill always
//! has a higher neighbour, so the remaining peaks are those of a merge tree: nodes are visited from
//! the highest to the lowest, and where two hills meet, the one with the lower peak ends.
//!
//! Every node has eight neighbours. Hills at the edges of a map that is not periodic count like all
//! others.

use super::surface::Surface;
use crate::grid::Boundary;

/// Significant peaks of a surface.
///
/// ```
/// use std::f64::consts::PI;
///
/// use asperity_mechanics::grid::{Boundary, Grid};
/// use asperity_mechanics::topography::peaks::Peaks;
/// use asperity_mechanics::topography::shapes::Shape;
///
/// // Δ cos(2πnx) cos(2πny) has 2n² peaks of the curvature Δ (2πn)².
/// let waves = Shape::WaveProduct { amplitude: 0.01, waves: 2 }.draw(Grid::square(128, 1.0)?);
/// let found = Peaks::from_surface(&waves, Boundary::Periodic, 0.05);
/// assert_eq!(found.density, 8.0);
/// // Second differences of the heights are 0.1 % smaller.
/// assert!((found.curvature.unwrap() / (0.01 * 16.0 * PI * PI) - 1.0).abs() < 1e-3);
/// # Ok::<(), asperity_mechanics::grid::GridError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peaks {
    /// Density of peaks Spd, in 1/length².
    pub density: f64,
    /// Arithmetic mean peak curvature Spc, the mean of −(h_xx + h_yy)/2 over the peaks, in
    /// 1/length. `None` if no peak has neighbours on all sides.
    ///
    /// Derivatives are second differences between the peak and its neighbours along x and y.
    pub curvature: Option<f64>,
}

impl Peaks {
    /// Finds the peaks of hills with a local height of at least `pruning` × Sz.
    ///
    /// A flat surface has no peaks.
    pub fn from_surface(surface: &Surface, boundary: Boundary, pruning: f64) -> Self {
        let peaks = significant(surface, boundary, pruning);
        let curvatures = peaks.iter().filter_map(|peak| curvature(surface, boundary, *peak));
        let (count, sum) =
            curvatures.fold((0.0, 0.0), |(count, sum), one| (count + 1.0, sum + one));
        Self {
            density: peaks.len() as f64 / surface.grid().cell().area(),
            curvature: (count > 0.0).then(|| sum / count),
        }
    }
}

/// Returns the mean curvature of a peak, or `None` at a free edge.
fn curvature(surface: &Surface, boundary: Boundary, node: usize) -> Option<f64> {
    let (grid, heights) = (surface.grid(), surface.heights());
    let along = |steps: [isize; 2], spacing: f64| {
        let before = grid.moved(node, steps.map(|step| -step), boundary)?;
        let after = grid.moved(node, steps, boundary)?;
        let [before, after] = [before, after].map(|other| heights[other] - heights[node]);
        Some(-(before + after) / (spacing * spacing))
    };
    let [spacing_x, spacing_y] = grid.spacing();
    Some((along([1, 0], spacing_x)? + along([0, 1], spacing_y)?) / 2.0)
}

/// Returns the peaks of the hills that remain after Wolf pruning.
fn significant(surface: &Surface, boundary: Boundary, pruning: f64) -> Vec<usize> {
    let (grid, heights) = (surface.grid(), surface.heights());
    // Equal heights are visited in the order of their nodes, which makes all heights distinct.
    let mut order: Vec<usize> = (0..heights.len()).collect();
    order.sort_unstable_by(|one, other| {
        heights[*other].total_cmp(&heights[*one]).then(one.cmp(other))
    });
    let (Some(&highest), Some(&lowest)) = (order.first(), order.last()) else {
        return Vec::new();
    };
    let range = heights[highest] - heights[lowest];
    if range == 0.0 {
        return Vec::new();
    }
    let mut rank = vec![0; heights.len()];
    for (index, node) in order.iter().enumerate() {
        rank[*node] = index;
    }
    let mut hills = Hills { parents: (0..heights.len()).collect() };
    let mut peaks = vec![highest];
    for &node in &order {
        let steps = (-1..=1).flat_map(|x| (-1..=1).map(move |y| [x, y]));
        for other in steps.filter_map(|steps| grid.moved(node, steps, boundary)) {
            if rank[other] >= rank[node] {
                continue;
            }
            let [one, other] = [hills.peak(node), hills.peak(other)];
            let (higher, lower) = if rank[one] < rank[other] { (one, other) } else { (other, one) };
            if higher == lower {
                continue;
            }
            // A node that has just been visited is not a hill that ends: its height is zero.
            let height = heights[lower] - heights[node];
            if lower != node && height >= pruning * range {
                peaks.push(lower);
            }
            hills.parents[lower] = higher;
        }
    }
    peaks
}

/// Hills as a forest of nodes, whose roots are the peaks (union–find).
struct Hills {
    parents: Vec<usize>,
}

impl Hills {
    /// Returns the peak of the hill of a node, and halves the path to it.
    fn peak(&mut self, mut node: usize) -> usize {
        while self.parents[node] != node {
            self.parents[node] = self.parents[self.parents[node]];
            node = self.parents[node];
        }
        node
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::{rectangle, square};
    use crate::topography::shapes::Shape;

    fn peaks(heights: &[f64], boundary: Boundary, pruning: f64) -> Vec<usize> {
        let grid = rectangle([heights.len(), 1], [1.0, 1.0]);
        let surface = Surface::new(grid, heights.to_vec()).unwrap();
        let mut peaks = significant(&surface, boundary, pruning);
        peaks.sort_unstable();
        peaks
    }

    #[test]
    fn hills_below_the_pruning_height_are_merged() {
        // Local heights: node 1 none (the highest), node 3 is 2 above node 2, node 5 is 4 above
        // node 4, and node 7 is 1 above node 6. Sz is 10.
        let heights = [0.0, 10.0, 6.0, 8.0, 3.0, 7.0, 2.0, 3.0];
        assert_eq!(peaks(&heights, Boundary::Free, 0.0), [1, 3, 5, 7]);
        assert_eq!(peaks(&heights, Boundary::Free, 0.15), [1, 3, 5]);
        assert_eq!(peaks(&heights, Boundary::Free, 0.4), [1, 5]);
        assert_eq!(peaks(&heights, Boundary::Free, 0.5), [1]);
    }

    #[test]
    fn a_hill_continues_across_the_edge_of_a_periodic_map() {
        let heights = [5.0, 1.0, 4.0, 1.0, 4.9];
        assert_eq!(peaks(&heights, Boundary::Free, 0.1), [0, 2, 4]);
        assert_eq!(peaks(&heights, Boundary::Periodic, 0.1), [0, 2]);
    }

    #[test]
    fn a_plateau_is_one_peak_and_a_flat_map_has_none() {
        let punch = Shape::Punch { radius: 0.2, depth: 1.0 }.draw(square(20, 2.0));
        let found = Peaks::from_surface(&punch, Boundary::Periodic, 0.05);
        assert_eq!(found.density, 0.25);
        let flat = Surface::new(square(8, 1.0), vec![0.3; 64]).unwrap();
        let none = Peaks { density: 0.0, curvature: None };
        assert_eq!(Peaks::from_surface(&flat, Boundary::Free, 0.05), none);
    }

    #[test]
    fn a_paraboloid_has_one_peak_with_its_curvature() {
        let dome = Shape::Paraboloid { radius: 0.25 }.draw(rectangle([16, 24], [1.0, 2.0]));
        let found = Peaks::from_surface(&dome, Boundary::Free, 0.05);
        assert_eq!(found.density, 0.5);
        assert!((found.curvature.unwrap() - 4.0).abs() < 1e-12);
    }

    #[test]
    fn a_peak_at_an_edge_counts_without_a_curvature() {
        let grid = square(5, 1.0);
        let ramp = (0..25).map(|node| grid.indices(node)[0] as f64).collect();
        let ramp = Surface::new(grid, ramp).unwrap();
        let found = Peaks::from_surface(&ramp, Boundary::Free, 0.05);
        assert_eq!(found, Peaks { density: 1.0, curvature: None });
    }
}
