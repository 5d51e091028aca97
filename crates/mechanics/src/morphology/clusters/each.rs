//! Size, perimeter and centre of each cluster of contact.

use std::f64::consts::PI;
use std::ops::Range;

use super::{JoinedRuns, Run};
use crate::grid::{Boundary, Grid};
use crate::morphology::map::ContactMap;

/// Cluster of nodes in contact, connected through their 4 nearest neighbours.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Cluster {
    /// Number of nodes in the cluster.
    pub nodes: usize,
    /// Number of cell edges between contact and gap nodes of adjacent rows, at the boundary of the
    /// cluster.
    pub switches_x: usize,
    /// Number of cell edges between contact and gap nodes within rows, at the boundary of the
    /// cluster.
    pub switches_y: usize,
}

impl Cluster {
    /// Returns all contact clusters of a map, in the order of their first nodes.
    pub fn all(map: &ContactMap) -> Vec<Cluster> {
        let mut joined = JoinedRuns::new(map, |_| ());
        let mut edges = vec![[0; 2]; joined.runs.len()];
        across_rows(map, &joined, &mut edges);
        along_rows(map, &joined, &mut edges);
        joined.clusters(|cluster: &mut Cluster, _, index, run| {
            let [switches_x, switches_y] = edges[index];
            cluster.nodes += run.len();
            cluster.switches_x += switches_x;
            cluster.switches_y += switches_y;
        })
    }

    /// Returns the Manhattan perimeter Δy × `switches_x` + Δx × `switches_y`, in the unit of the
    /// grid's sides.
    ///
    /// The boundary of an isolated map does not count.
    pub fn manhattan_perimeter(&self, grid: Grid) -> f64 {
        let [step_x, step_y] = grid.spacing();
        step_y * self.switches_x as f64 + step_x * self.switches_y as f64
    }

    /// Returns π/4 of [`manhattan_perimeter`](Self::manhattan_perimeter). It is unbiased if all
    /// directions of edges are equally frequent.
    pub fn euclidean_perimeter(&self, grid: Grid) -> f64 {
        PI / 4.0 * self.manhattan_perimeter(grid)
    }
}

/// Contact cluster as a spot with a centre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// Number of nodes in the spot.
    pub nodes: usize,
    /// Mean indices along x and y of the nodes. On a periodic map they are circular means, from 0
    /// to the number of nodes along the axis. A spot that lies evenly around the cell has no
    /// circular mean along that axis; its index is 0.
    pub centre: [f64; 2],
}

impl Spot {
    /// Returns all contact clusters of a map, in the order of their first nodes.
    pub fn all(map: &ContactMap) -> Vec<Spot> {
        let means = map.nodes().map(|nodes| Means::new(map.boundary(), nodes));
        let add = |sums: &mut (usize, [[f64; 2]; 2]), row: usize, _, run: &Run| {
            let (nodes, [along_x, along_y]) = sums;
            *nodes += run.len();
            for column in run.start..run.end {
                means[0].add(row, along_x);
                means[1].add(column as usize, along_y);
            }
        };
        let sums = JoinedRuns::new(map, |_| ()).clusters(add);
        let spot = |(nodes, sums): (usize, [[f64; 2]; 2])| Spot {
            nodes,
            centre: [0, 1].map(|axis| means[axis].of(sums[axis], nodes)),
        };
        sums.into_iter().map(spot).collect()
    }
}

/// Length of the mean of unit vectors below which it is only their rounding errors.
const EVEN: f64 = 1e-9;

/// Mean of indices along an axis: the usual mean, or a circular one.
struct Means {
    nodes: usize,
    /// Cosine and sine of the angle of each index; empty for the usual mean.
    angles: Vec<[f64; 2]>,
}

impl Means {
    fn new(boundary: Boundary, nodes: usize) -> Self {
        let angle = |index: usize| {
            let (sine, cosine) = libm::sincos(2.0 * PI * index as f64 / nodes as f64);
            [cosine, sine]
        };
        let circular = if boundary.is_periodic() { nodes } else { 0 };
        Self { nodes, angles: (0..circular).map(angle).collect() }
    }

    /// Adds an index to the sums of a spot.
    fn add(&self, index: usize, sums: &mut [f64; 2]) {
        let [x, y] = self.angles.get(index).copied().unwrap_or([index as f64, 0.0]);
        sums[0] += x;
        sums[1] += y;
    }

    /// Returns the mean of `count` indices from their sums.
    fn of(&self, [x, y]: [f64; 2], count: usize) -> f64 {
        if self.angles.is_empty() {
            return x / count as f64;
        }
        if libm::hypot(x, y) <= EVEN * count as f64 {
            return 0.0;
        }
        let turns = libm::atan2(y, x) / (2.0 * PI);
        self.nodes as f64 * (turns - turns.floor())
    }
}

/// Counts, for each run, the nodes of adjacent rows next to it that are not in contact. Adds this
/// number to element 0 of the entry of the run in `edges`.
///
/// A node of the run counts once for each of the two adjacent rows.
fn across_rows(map: &ContactMap, joined: &JoinedRuns, edges: &mut [[usize; 2]]) {
    let rows = map.nodes()[0];
    for upper in 0..rows {
        let lower = match (upper + 1 < rows, map.boundary()) {
            (true, _) => upper + 1,
            (false, Boundary::Periodic) => 0,
            (false, Boundary::Free) => return,
        };
        let pair = [joined.row(upper), joined.row(lower)];
        for index in pair.iter().flat_map(Range::clone) {
            edges[index][0] += joined.runs[index].len();
        }
        for_overlaps(&joined.runs, pair, |runs, overlap| {
            for index in runs {
                edges[index][0] -= overlap;
            }
        });
    }
}

/// Counts, for each run, the ends (at most two) next to a node that is not in contact. Adds this
/// number to element 1 of the entry of the run in `edges`.
fn along_rows(map: &ContactMap, joined: &JoinedRuns, edges: &mut [[usize; 2]]) {
    let [rows, row_nodes] = map.nodes();
    for row in 0..rows {
        let runs = joined.row(row);
        let Some(last) = runs.clone().next_back() else {
            continue;
        };
        let meets_first = joined.runs[runs.start].start == 0;
        let meets_last = joined.runs[last].end as usize == row_nodes;
        for index in runs.clone() {
            edges[index][1] += 2;
        }
        let is_closed = map.boundary() == Boundary::Free || meets_first && meets_last;
        if is_closed && meets_first {
            edges[runs.start][1] -= 1;
        }
        if is_closed && meets_last {
            edges[last][1] -= 1;
        }
    }
}

/// Calls `visit` with each pair of indices of overlapping runs of two rows, and the number of
/// columns that they share.
fn for_overlaps(
    runs: &[Run],
    [mut upper, mut lower]: [Range<usize>; 2],
    mut visit: impl FnMut([usize; 2], usize),
) {
    while !upper.is_empty() && !lower.is_empty() {
        let (above, below) = (&runs[upper.start], &runs[lower.start]);
        let (start, end) = (above.start.max(below.start), above.end.min(below.end));
        if start < end {
            visit([upper.start, lower.start], (end - start) as usize);
        }
        if above.end < below.end { upper.start += 1 } else { lower.start += 1 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::rectangle;
    use crate::morphology::area::ContactArea;
    use crate::morphology::clusters::Clusters;
    use crate::morphology::map::samples::{MESHES, map, random};

    fn cluster(nodes: usize, switches_x: usize, switches_y: usize) -> Cluster {
        Cluster { nodes, switches_x, switches_y }
    }

    #[test]
    fn clusters_together_have_the_nodes_and_edges_of_the_map() {
        for nodes in MESHES {
            for share in [0.1, 0.4, 0.6, 0.9, 1.0] {
                for boundary in [Boundary::Periodic, Boundary::Free] {
                    let map = random(nodes, share).with_boundary(boundary);
                    let each = Cluster::all(&map);
                    let sum = |part: fn(&Cluster) -> usize| each.iter().map(part).sum::<usize>();
                    let (area, clusters) =
                        (ContactArea::from_map(&map), Clusters::of_contact(&map));
                    assert_eq!(each.len(), clusters.count);
                    let largest = each.iter().map(|cluster| cluster.nodes).max();
                    assert_eq!(largest.unwrap_or(0), clusters.largest);
                    assert_eq!(sum(|cluster| cluster.nodes), area.contact_nodes);
                    let across = sum(|cluster| cluster.switches_x);
                    assert_eq!(across, area.switches_along_columns, "{nodes:?} {boundary:?}");
                    assert_eq!(sum(|cluster| cluster.switches_y), area.switches_along_rows);
                }
            }
        }
    }

    #[test]
    fn the_perimeter_of_a_rectangle_does_not_depend_on_its_position() {
        for [top, left] in [[2, 3], [7, 3], [2, 10], [7, 10]] {
            let sides = |i: usize, j: usize| (i + 9 - top) % 9 < 4 && (j + 12 - left) % 12 < 5;
            assert_eq!(Cluster::all(&map([9, 12], sides)), [cluster(20, 10, 8)]);
        }
    }

    #[test]
    fn separate_clusters_are_counted_separately() {
        let two = map([8, 8], |i, j| i < 2 && j < 2 || (4..7).contains(&i) && j == 5);
        assert_eq!(Cluster::all(&two), [cluster(4, 4, 4), cluster(3, 2, 6)]);
    }

    #[test]
    fn a_strip_around_the_cell_has_no_ends() {
        let strip = map([9, 12], |i, _| (3..5).contains(&i));
        assert_eq!(Cluster::all(&strip), [cluster(24, 24, 0)]);
        let strip = map([9, 12], |_, j| j == 0).with_boundary(Boundary::Free);
        assert_eq!(Cluster::all(&strip), [cluster(9, 0, 9)]);
    }

    #[test]
    fn perimeters_are_in_the_unit_of_the_sides() {
        let grid = rectangle([10, 10], [1.0, 3.0]);
        // Four nodes along x and five along y: 0.4 × 1.5.
        let rectangle = cluster(20, 10, 8);
        assert!((rectangle.manhattan_perimeter(grid) - 2.0 * (0.4 + 1.5)).abs() < 1e-12);
    }
}
