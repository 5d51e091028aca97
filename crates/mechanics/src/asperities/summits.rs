//! Summits of a surface, and their contact ellipses.
//!
//! A summit is a node above its eight neighbours. Its position, height and principal curvatures are
//! those of the osculating paraboloid. Derivatives are central differences of fourth order, which
//! are exact on a paraboloid. For a wave of n nodes, the curvature is too small by the fraction
//! (2π/n)⁴/90: 0.4 % for eight nodes and 7 % for four.

use std::f64::consts::PI;

use crate::grid::{Boundary, Grid};
use crate::theory::models::hertz::Ellipse;

/// Minimum ratio of the smaller to the larger principal curvature of a summit.
///
/// On a coarse grid, the osculating paraboloid of a summit can be a saddle. Its smaller curvature
/// is then replaced by this fraction of the larger one.
const LEAST_RATIO: f64 = 0.01;

/// Position and contact parameters of a summit, in the units of [`Asperities`](super::Asperities).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summit {
    pub node: usize,
    /// Position along x and y, in units of L.
    pub position: [f64; 2],
    pub height: f64,
    /// Factor C of the force F = C d^(3/2) at the approach d.
    pub stiffness: f64,
    /// Factor B of the contact area B d at the approach d.
    pub area_factor: f64,
    /// Ratio of the minor to the major axis of the ellipse.
    pub axis_ratio: f64,
    /// Angle of the major axis (the direction of the smaller curvature) to the x axis, in radians.
    pub angle: f64,
}

/// Finds the summits of a surface, in the order of their nodes.
pub fn find(grid: Grid, heights: &[f64]) -> Vec<Summit> {
    let map = Map { grid, heights };
    let nodes = 0..grid.count();
    nodes.filter(|&node| map.is_summit(node)).map(|node| map.summit(node)).collect()
}

struct Map<'a> {
    grid: Grid,
    heights: &'a [f64],
}

/// Offsets and weights of the stencil of the first derivative, multiplied by 12.
const FIRST: [(isize, f64); 4] = [(-2, 1.0), (-1, -8.0), (1, 8.0), (2, -1.0)];

/// Offsets and weights of the stencil of the second derivative, multiplied by 12.
const SECOND: [(isize, f64); 5] = [(-2, -1.0), (-1, 16.0), (0, -30.0), (1, 16.0), (2, -1.0)];

impl Map<'_> {
    /// Returns the height at the node that is `right` nodes from `node` along x and `up` nodes
    /// along y, continued periodically.
    fn at(&self, node: usize, steps: [isize; 2]) -> f64 {
        let moved = self.grid.moved(node, steps, Boundary::Periodic);
        self.heights[moved.expect("a periodic map has no edge")]
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
        let curvatures = Curvatures::new(bends, twist);
        let top = paraboloid_top(slopes, bends, twist, [step_x, step_y]);
        let [i, j] = self.grid.indices(node);
        let ellipse = Ellipse::from_curvature_ratio(curvatures.ratio);
        Summit {
            node,
            position: [i as f64 * step_x + top[0], j as f64 * step_y + top[1]],
            height: self.heights[node] + 0.5 * (slopes[0] * top[0] + slopes[1] * top[1]),
            stiffness: 4.0 / 3.0 * ellipse.load_factor / curvatures.mean.sqrt(),
            area_factor: PI * ellipse.area_factor / curvatures.mean,
            axis_ratio: ellipse.axis_ratio,
            angle: curvatures.angle,
        }
    }
}

/// Returns the offset of the top of the osculating paraboloid from its node.
///
/// The offset is zero if the paraboloid has no maximum within one grid spacing of the node.
fn paraboloid_top(slopes: [f64; 2], bends: [f64; 2], twist: f64, steps: [f64; 2]) -> [f64; 2] {
    let determinant = bends[0] * bends[1] - twist * twist;
    let top = [
        (bends[1] * slopes[0] - twist * slopes[1]) / determinant,
        (bends[0] * slopes[1] - twist * slopes[0]) / determinant,
    ];
    let is_near = (0..2).all(|axis| top[axis].abs() < steps[axis]);
    if determinant > 0.0 && is_near { top } else { [0.0; 2] }
}

/// Principal curvatures of a summit, positive for a convex surface.
struct Curvatures {
    mean: f64,
    /// Ratio of the smaller to the larger curvature.
    ratio: f64,
    /// Angle of the direction of the smaller curvature to the x axis, in radians.
    angle: f64,
}

impl Curvatures {
    fn new([along_x, along_y]: [f64; 2], twist: f64) -> Curvatures {
        let middle = 0.5 * (along_x + along_y);
        let half = 0.5 * (along_x - along_y);
        let difference = (half * half + twist * twist).sqrt();
        let larger = middle + difference;
        let ratio = ((middle - difference) / larger).clamp(LEAST_RATIO, 1.0);
        Curvatures {
            mean: 0.5 * larger * (1.0 + ratio),
            ratio,
            // Half the angle of the vector (half, twist) is the direction of the larger curvature.
            angle: 0.5 * libm::atan2(twist, half) + 0.5 * PI,
        }
    }
}

/// Number of golden-section steps in [`maximum`]. They locate the maximum to 0.618²⁴ = 1e-5.
const SECTIONS: usize = 24;

/// Contact ellipse of a summit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Contact {
    /// Position of the centre, in units of L.
    pub position: [f64; 2],
    /// Major and minor semi-axes, in units of L.
    pub axes: [f64; 2],
    /// Cosine and sine of the angle between the major axis and the x axis.
    pub direction: [f64; 2],
    pub area: f64,
    /// Hertz pressure in the centre, 3/2 of the mean pressure.
    pub peak_pressure: f64,
}

/// Returns the contact ellipses of the summits with a positive approach. `overlaps` contains the
/// approach of each summit.
pub fn contacts(summits: &[Summit], overlaps: &[f64]) -> Vec<Contact> {
    let touching = summits.iter().zip(overlaps).filter(|(_, overlap)| **overlap > 0.0);
    let contact = |(summit, &overlap): (&Summit, &f64)| {
        let area = summit.area_factor * overlap;
        let major = (area / (PI * summit.axis_ratio)).sqrt();
        let force = summit.stiffness * overlap * overlap.sqrt();
        Contact {
            position: summit.position,
            axes: [major, summit.axis_ratio * major],
            direction: [libm::cos(summit.angle), libm::sin(summit.angle)],
            area,
            peak_pressure: 1.5 * force / area,
        }
    };
    touching.map(contact).collect()
}

impl Contact {
    /// Returns the elements xx, xy and yy of the symmetric matrix that has the squared semi-axes as
    /// eigenvalues and the axes as eigenvectors.
    fn squares(&self) -> [f64; 3] {
        let [cosine, sine] = self.direction;
        let [major, minor] = self.axes.map(|axis| axis * axis);
        [
            major * cosine * cosine + minor * sine * sine,
            (major - minor) * cosine * sine,
            major * sine * sine + minor * cosine * cosine,
        ]
    }

    /// Returns whether this ellipse overlaps `other`. `offset` is the centre of `other` minus the
    /// centre of this ellipse.
    ///
    /// Two ellipses overlap if the contact function of Perram & Wertheim (1985) is at most one.
    fn overlaps(&self, other: &Contact, offset: [f64; 2]) -> bool {
        let distance = libm::hypot(offset[0], offset[1]);
        if distance > self.axes[0] + other.axes[0] {
            return false;
        }
        if distance <= self.axes[1] + other.axes[1] {
            return true;
        }
        let (one, two) = (self.squares(), other.squares());
        let separation = |lambda: f64| {
            let mixed: [f64; 3] =
                std::array::from_fn(|i| (1.0 - lambda) * one[i] + lambda * two[i]);
            let [xx, xy, yy] = mixed;
            let [x, y] = offset;
            let form = (yy * x * x - 2.0 * xy * x * y + xx * y * y) / (xx * yy - xy * xy);
            lambda * (1.0 - lambda) * form
        };
        maximum(separation) <= 1.0
    }
}

/// Returns the maximum of a concave function on [0, 1], by golden-section search.
fn maximum(function: impl Fn(f64) -> f64) -> f64 {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (0.0, 1.0);
    let inner = |low: f64, high: f64| (high - golden * (high - low), low + golden * (high - low));
    let (mut left, mut right) = inner(low, high);
    let (mut at_left, mut at_right) = (function(left), function(right));
    for _ in 0..SECTIONS {
        if at_left < at_right {
            low = left;
            (left, at_left) = (right, at_right);
            right = inner(low, high).1;
            at_right = function(right);
        } else {
            high = right;
            (right, at_right) = (left, at_left);
            left = inner(low, high).0;
            at_left = function(left);
        }
    }
    at_left.max(at_right)
}

/// Returns, for each contact, whether its ellipse overlaps the ellipse of another contact in the
/// periodic cell.
pub fn overlapping(grid: Grid, contacts: &[Contact]) -> Vec<bool> {
    let size = grid.cell().aspect().map(|aspect| 1.0 / aspect);
    let largest = contacts.iter().map(|contact| contact.axes[0]).fold(0.0, f64::max);
    let boxes = Boxes::new(size, 2.0 * largest, contacts);
    let mut overlaps = vec![false; contacts.len()];
    for (one, contact) in contacts.iter().enumerate() {
        for other in boxes.around(contact.position) {
            // Each pair is visited once. Pairs of contacts that both overlap another are skipped.
            if other <= one || (overlaps[one] && overlaps[other]) {
                continue;
            }
            let offset = [0, 1].map(|axis| {
                let by = contacts[other].position[axis] - contact.position[axis];
                by - size[axis] * (by / size[axis]).round()
            });
            if contact.overlaps(&contacts[other], offset) {
                overlaps[one] = true;
                overlaps[other] = true;
            }
        }
    }
    overlaps
}

/// Boxes into which the cell is divided, each with a list of the contacts in it. Contacts can
/// overlap only if they are in the same box or in neighbouring boxes.
struct Boxes {
    size: [f64; 2],
    counts: [usize; 2],
    members: Vec<Vec<usize>>,
}

/// Maximum number of boxes along a side; with more boxes, visiting them would dominate the time.
const MAX_BOXES: f64 = 256.0;

impl Boxes {
    fn new(size: [f64; 2], least: f64, contacts: &[Contact]) -> Boxes {
        let counts = size.map(|side| (side / least).clamp(1.0, MAX_BOXES) as usize);
        let mut boxes = Boxes { size, counts, members: vec![Vec::new(); counts[0] * counts[1]] };
        for (index, contact) in contacts.iter().enumerate() {
            let [i, j] = boxes.indices(contact.position);
            boxes.members[i * counts[1] + j].push(index);
        }
        boxes
    }

    fn indices(&self, position: [f64; 2]) -> [usize; 2] {
        [0, 1].map(|axis| {
            let turns = (position[axis] / self.size[axis]).rem_euclid(1.0);
            ((turns * self.counts[axis] as f64) as usize).min(self.counts[axis] - 1)
        })
    }

    /// Iterates over the indices of the contacts in the box of a position and in the boxes around
    /// it. Each contact occurs once.
    fn around(&self, position: [f64; 2]) -> impl Iterator<Item = usize> + '_ {
        let [i, j] = self.indices(position);
        let near = |index: usize, count: usize| {
            let mut near: Vec<usize> = [count - 1, 0, 1].map(|by| (index + by) % count).to_vec();
            near.sort_unstable();
            near.dedup();
            near
        };
        let columns = near(j, self.counts[1]);
        let rows = near(i, self.counts[0]).into_iter();
        let boxes = rows.flat_map(move |i| columns.clone().into_iter().map(move |j| (i, j)));
        boxes.flat_map(|(i, j)| self.members[i * self.counts[1] + j].iter().copied())
    }
}

/// Writes the Hertz pressure at each node to `pressure`. Where ellipses overlap, it is the sum of
/// their pressures.
///
/// The pressure of a contact is p √(1 − s²), with the peak pressure p, and s from 0 at the centre
/// to 1 at the edge of the ellipse. A contact smaller than a grid spacing may contain no node.
pub fn draw(grid: Grid, contacts: &[Contact], pressure: &mut [f64]) {
    pressure.fill(0.0);
    let [nodes_x, nodes_y] = grid.nodes();
    let steps = super::steps(grid);
    for contact in contacts {
        let [major, minor] = contact.axes;
        let [cosine, sine] = contact.direction;
        let half =
            [libm::hypot(major * cosine, minor * sine), libm::hypot(major * sine, minor * cosine)];
        let range = |axis: usize| {
            let low = ((contact.position[axis] - half[axis]) / steps[axis]).ceil() as isize;
            let high = ((contact.position[axis] + half[axis]) / steps[axis]).floor() as isize;
            low..=high
        };
        for i in range(0) {
            for j in range(1) {
                let x = i as f64 * steps[0] - contact.position[0];
                let y = j as f64 * steps[1] - contact.position[1];
                let along = (cosine * x + sine * y) / major;
                let across = (cosine * y - sine * x) / minor;
                let inside = 1.0 - along * along - across * across;
                if inside > 0.0 {
                    let [i, j] = [(i, nodes_x), (j, nodes_y)]
                        .map(|(index, nodes)| index.rem_euclid(nodes as isize) as usize);
                    pressure[i * nodes_y + j] += contact.peak_pressure * inside.sqrt();
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::square;

    /// Returns the heights −(a x² + b y²)/2 of a paraboloid with its top at `top`, rotated by
    /// `angle` about the top.
    fn paraboloid(grid: Grid, [a, b]: [f64; 2], angle: f64, top: [f64; 2]) -> Vec<f64> {
        let (sine, cosine) = angle.sin_cos();
        let height = |node: usize| {
            let [i, j] = grid.indices(node);
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
        let summits = find(grid, &heights);
        assert_eq!(summits.len(), 1);
        let summit = summits[0];
        for (position, top) in summit.position.iter().zip(top) {
            assert!((position - top).abs() < 1e-13);
        }
        assert!(summit.height.abs() < 1e-14);
        let ellipse = Ellipse::from_curvature_ratio(0.4);
        assert!((summit.axis_ratio - ellipse.axis_ratio).abs() < 1e-10);
        assert!((summit.area_factor - PI * ellipse.area_factor / 3.5).abs() < 1e-10);
        // The smaller curvature is along the rotated x axis.
        assert!(((summit.angle - 0.4) / PI).fract().abs() < 1e-10);
    }

    #[test]
    fn waves_have_one_summit_each() {
        let grid = square(64, 1.0);
        let wave = |index: usize| (6.0 * PI * index as f64 / 64.0).cos();
        let heights: Vec<f64> = (0..grid.count())
            .map(|node| grid.indices(node))
            .map(|[i, j]| wave(i) + wave(j))
            .collect();
        assert_eq!(find(grid, &heights).len(), 9);
        assert!(find(grid, &vec![1.0; grid.count()]).is_empty());
    }

    fn contact(position: [f64; 2], axes: [f64; 2], angle: f64) -> Contact {
        Contact {
            position,
            axes,
            direction: [angle.cos(), angle.sin()],
            area: PI * axes[0] * axes[1],
            peak_pressure: 1.0,
        }
    }

    fn both_overlap(one: Contact, other: Contact) -> bool {
        let found = overlapping(square(8, 1.0), &[one, other]);
        assert_eq!(found[0], found[1]);
        found[0]
    }

    #[test]
    fn circles_overlap_where_their_centres_are_closer_than_their_radii() {
        let circle = |x| contact([x, 0.5], [0.1, 0.1], 0.3);
        assert!(both_overlap(circle(0.2), circle(0.399)));
        assert!(!both_overlap(circle(0.2), circle(0.401)));
        // These two overlap across the boundary of the cell.
        assert!(both_overlap(circle(0.05), circle(0.86)));
    }

    #[test]
    fn ellipses_overlap_by_their_directions() {
        let ellipse = |x, angle| contact([x, 0.5], [0.2, 0.05], angle);
        assert!(both_overlap(ellipse(0.3, 0.0), ellipse(0.69, 0.0)));
        assert!(!both_overlap(ellipse(0.3, 0.0), ellipse(0.71, 0.0)));
        // The ellipses meet with both minor axes, then with one major and one minor axis.
        let across = 0.5 * PI;
        assert!(both_overlap(ellipse(0.3, across), ellipse(0.399, across)));
        assert!(!both_overlap(ellipse(0.3, across), ellipse(0.401, across)));
        assert!(both_overlap(ellipse(0.3, 0.0), ellipse(0.549, across)));
        assert!(!both_overlap(ellipse(0.3, 0.0), ellipse(0.551, across)));
    }
}
