//! The summits of a surface: nodes above their eight neighbours, with place, height and principal
//! curvatures of the paraboloid there.
//!
//! Derivatives are central differences of fourth order, exact on a paraboloid; of a wave of n nodes the
//! curvature is too small by the share (2π/n)⁴/90, 0.4 % at eight nodes and 7 % at four.

use std::f64::consts::PI;

use crate::grid::Grid;
use crate::theory::models::hertz::Ellipse;

/// The least ratio of the principal curvatures. On a coarse mesh a node above its neighbours may have a
/// paraboloid that is a saddle; its contact is taken for one that is a hundred times as bent across.
const LEAST_RATIO: f64 = 0.01;

/// A summit, in the units of [`Asperities`](super::Asperities).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summit {
    /// Its node.
    pub node: usize,
    /// Where it is, in longer sides along x and y.
    pub place: [f64; 2],
    /// Its height.
    pub height: f64,
    /// C in F = C d^(3/2).
    pub stiffness: f64,
    /// B in area = B d.
    pub spread: f64,
    /// Minor over major axis of the ellipse.
    pub axis_ratio: f64,
    /// Direction of the major axis, that of the smaller curvature, as an angle from x.
    pub angle: f64,
}

/// The summits, in the order of their nodes.
pub fn of(grid: Grid, heights: &[f64]) -> Vec<Summit> {
    let map = Map { grid, heights };
    let nodes = 0..grid.count();
    nodes.filter(|&node| map.is_summit(node)).map(|node| map.summit(node)).collect()
}

struct Map<'a> {
    grid: Grid,
    heights: &'a [f64],
}

/// First derivative, times 12.
const FIRST: [(isize, f64); 4] = [(-2, 1.0), (-1, -8.0), (1, 8.0), (2, -1.0)];
/// Second derivative, times 12.
const SECOND: [(isize, f64); 5] = [(-2, -1.0), (-1, 16.0), (0, -30.0), (1, 16.0), (2, -1.0)];

impl Map<'_> {
    /// The height of a neighbour, around the cell.
    fn at(&self, node: usize, [right, up]: [isize; 2]) -> f64 {
        let [nodes_x, nodes_y] = self.grid.nodes();
        let [i, j] = self.grid.place(node);
        let wrapped = |index: usize, by: isize, nodes: usize| {
            (index as isize + by).rem_euclid(nodes as isize) as usize
        };
        self.heights[wrapped(i, right, nodes_x) * nodes_y + wrapped(j, up, nodes_y)]
    }

    fn is_summit(&self, node: usize) -> bool {
        let height = self.heights[node];
        let sides = [-1, 0, 1];
        let mut around = sides.iter().flat_map(|&i| sides.map(|j| [i, j]));
        around.all(|by| by == [0, 0] || self.at(node, by) < height)
    }

    fn summit(&self, node: usize) -> Summit {
        let [step_x, step_y] = super::steps(self.grid);
        let along = |stencil: &[(isize, f64)], axis: usize| {
            let terms = stencil.iter().map(|&(by, weight)| {
                let by = if axis == 0 { [by, 0] } else { [0, by] };
                weight * self.at(node, by)
            });
            terms.sum::<f64>() / 12.0
        };
        let twist = FIRST
            .iter()
            .flat_map(|&(i, one)| FIRST.map(|(j, other)| one * other * self.at(node, [i, j])));
        let slopes = [along(&FIRST, 0) / step_x, along(&FIRST, 1) / step_y];
        let bends =
            [-along(&SECOND, 0) / (step_x * step_x), -along(&SECOND, 1) / (step_y * step_y)];
        let twist = -twist.sum::<f64>() / (144.0 * step_x * step_y);
        let curvatures = Curvatures::of(bends, twist);
        let top = top(slopes, bends, twist, [step_x, step_y]);
        let [i, j] = self.grid.place(node);
        let ellipse = Ellipse::of_curvature_ratio(curvatures.ratio);
        Summit {
            node,
            place: [i as f64 * step_x + top[0], j as f64 * step_y + top[1]],
            height: self.heights[node] + 0.5 * (slopes[0] * top[0] + slopes[1] * top[1]),
            stiffness: 4.0 / 3.0 * ellipse.load_factor / curvatures.mean.sqrt(),
            spread: PI * ellipse.area_factor / curvatures.mean,
            axis_ratio: ellipse.axis_ratio,
            angle: curvatures.angle,
        }
    }
}

/// Where the paraboloid is highest, from its node; the node itself where that is a mesh step away or
/// more, or nowhere.
fn top(slopes: [f64; 2], bends: [f64; 2], twist: f64, steps: [f64; 2]) -> [f64; 2] {
    let determinant = bends[0] * bends[1] - twist * twist;
    let top = [
        (bends[1] * slopes[0] - twist * slopes[1]) / determinant,
        (bends[0] * slopes[1] - twist * slopes[0]) / determinant,
    ];
    let is_near = (0..2).all(|axis| top[axis].abs() < steps[axis]);
    if determinant > 0.0 && is_near { top } else { [0.0; 2] }
}

/// Principal curvatures, positive where the surface bends down.
struct Curvatures {
    mean: f64,
    /// The smaller over the larger.
    ratio: f64,
    /// Direction of the smaller.
    angle: f64,
}

impl Curvatures {
    fn of([along_x, along_y]: [f64; 2], twist: f64) -> Curvatures {
        let middle = 0.5 * (along_x + along_y);
        let half = 0.5 * (along_x - along_y);
        let difference = (half * half + twist * twist).sqrt();
        let larger = middle + difference;
        let ratio = ((middle - difference) / larger).clamp(LEAST_RATIO, 1.0);
        Curvatures {
            mean: 0.5 * larger * (1.0 + ratio),
            ratio,
            // The larger one is along half the angle of (half, twist).
            angle: 0.5 * libm::atan2(twist, half) + 0.5 * PI,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::square;

    /// −(a x² + b y²)/2 turned by an angle, its top between nodes.
    fn paraboloid(grid: Grid, [a, b]: [f64; 2], angle: f64, top: [f64; 2]) -> Vec<f64> {
        let (sine, cosine) = angle.sin_cos();
        let height = |node: usize| {
            let [i, j] = grid.place(node);
            let [nodes_x, nodes_y] = grid.nodes();
            let (x, y) = (i as f64 / nodes_x as f64 - top[0], j as f64 / nodes_y as f64 - top[1]);
            let (u, v) = (cosine * x + sine * y, cosine * y - sine * x);
            -0.5 * (a * u * u + b * v * v)
        };
        (0..grid.count()).map(height).collect()
    }

    #[test]
    fn a_paraboloid_between_nodes_has_its_top_its_height_and_its_curvatures() {
        let grid = square(32, 1.0);
        let top = [0.5 + 0.3 / 32.0, 0.5 - 0.4 / 32.0];
        let heights = paraboloid(grid, [2.0, 5.0], 0.4, top);
        let summits = of(grid, &heights);
        assert_eq!(summits.len(), 1);
        let summit = summits[0];
        for (place, top) in summit.place.iter().zip(top) {
            assert!((place - top).abs() < 1e-13);
        }
        assert!(summit.height.abs() < 1e-14);
        let ellipse = Ellipse::of_curvature_ratio(0.4);
        assert!((summit.axis_ratio - ellipse.axis_ratio).abs() < 1e-10);
        assert!((summit.spread - PI * ellipse.area_factor / 3.5).abs() < 1e-10);
        // The smaller curvature lies along the turned x.
        assert!(((summit.angle - 0.4) / PI).fract().abs() < 1e-10);
    }

    #[test]
    fn waves_have_one_summit_each() {
        let grid = square(64, 1.0);
        let wave = |index: usize| (6.0 * PI * index as f64 / 64.0).cos();
        let heights: Vec<f64> = (0..grid.count())
            .map(|node| grid.place(node))
            .map(|[i, j]| wave(i) + wave(j))
            .collect();
        assert_eq!(of(grid, &heights).len(), 9);
        assert!(of(grid, &vec![1.0; grid.count()]).is_empty());
    }
}
