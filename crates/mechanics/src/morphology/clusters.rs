//! Connected clusters of contact or of gap, on periodic and on isolated maps.
//!
//! A cluster is a set of nodes that are connected through their 4 nearest neighbours. Rows are cut
//! into runs of adjacent nodes, and a union-find joins the runs. Each link stores how often it
//! crosses the boundary of the periodic cell. A cluster percolates (wraps around the cell) if it
//! has a closed chain of links whose crossings do not cancel. On an isolated map, a cluster
//! percolates if it touches two opposite edges.

mod each;

use std::collections::BTreeSet;
use std::ops::Range;

use super::map::{ContactMap, mask_tail};
use crate::grid::Boundary;

pub use each::{Cluster, Spot};

/// Number, largest size and percolation of the clusters of contact or of gap.
///
/// ```
/// use asperity_mechanics::morphology::clusters::Clusters;
/// use asperity_mechanics::morphology::map::ContactMap;
///
/// // A line of contact along y blocks leakage along x.
/// let map = ContactMap::from_pressures([3, 3], &[
///     1.0, 1.0, 1.0, //
///     0.0, 0.0, 0.0, //
///     0.0, 0.0, 0.0,
/// ]);
/// let contact = Clusters::of_contact(&map);
/// assert_eq!([contact.count, contact.largest], [1, 3]);
/// assert!(contact.around_y && !contact.around_x);
/// let gap = Clusters::of_gap(&map);
/// assert!(gap.around_y && !gap.around_x);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Clusters {
    /// Number of clusters on the map.
    pub count: usize,
    /// Number of nodes of the largest cluster.
    pub largest: usize,
    /// `true` if a cluster percolates along x, across the rows.
    ///
    /// On an isolated map, such a cluster connects the first and the last row.
    pub around_x: bool,
    /// `true` if a cluster percolates along y, along the rows.
    ///
    /// On an isolated map, such a cluster connects the first and the last column.
    pub around_y: bool,
}

impl Clusters {
    /// Finds the clusters of nodes in contact.
    pub fn of_contact(map: &ContactMap) -> Self {
        Self::of_rows(map, |_| ())
    }

    /// Finds the clusters of nodes that are not in contact.
    ///
    /// A fluid can leak along an axis if one of these clusters percolates along it.
    pub fn of_gap(map: &ContactMap) -> Self {
        Self::of_rows(map, |row| {
            row.iter_mut().for_each(|word| *word = !*word);
            mask_tail(row, map.nodes()[1]);
        })
    }

    fn of_rows(map: &ContactMap, change: impl Fn(&mut [u64])) -> Self {
        JoinedRuns::new(map, change).forest.clusters()
    }
}

/// Runs of adjacent nodes in each row of a map, joined into clusters.
struct JoinedRuns {
    runs: Vec<Run>,
    /// For each row, the index in `runs` after the last run of the row.
    row_ends: Vec<usize>,
    forest: Forest,
}

impl JoinedRuns {
    fn new(map: &ContactMap, change: impl Fn(&mut [u64])) -> Self {
        let [count, row_nodes] = map.nodes();
        let mut row = vec![0; map.row_words()];
        let mut runs = Vec::new();
        let mut row_ends = Vec::with_capacity(count);
        for i in 0..count {
            map.copy_row(i, &mut row);
            change(&mut row);
            push_runs(&row, row_nodes, &mut runs);
            row_ends.push(runs.len());
        }
        let rows = |i: usize| if i == 0 { 0 } else { row_ends[i - 1] }..row_ends[i];
        let mut forest = Forest::new(&runs);
        for i in 0..count - 1 {
            join_rows(&mut forest, &runs, rows(i), rows(i + 1), 0);
        }
        match map.boundary() {
            Boundary::Periodic => {
                for i in 0..count {
                    close_row(&mut forest, &runs, rows(i), row_nodes);
                }
                join_rows(&mut forest, &runs, rows(count - 1), rows(0), 1);
            }
            Boundary::Free => {
                let first = |run: &usize| runs[*run].start == 0;
                let last = |run: &usize| runs[*run].end as usize == row_nodes;
                let all = 0..runs.len();
                forest.around = [
                    forest.connects(rows(0), rows(count - 1)),
                    forest.connects(all.clone().filter(first), all.filter(last)),
                ];
            }
        }
        JoinedRuns { runs, row_ends, forest }
    }

    /// Returns the range of the runs of row `row` in `runs`.
    fn row(&self, row: usize) -> Range<usize> {
        let start = if row == 0 { 0 } else { self.row_ends[row - 1] };
        start..self.row_ends[row]
    }

    /// Returns one item for each cluster, in the order of their first nodes. `add` adds to an item
    /// the run of a row with this index.
    fn clusters<C: Default>(&mut self, mut add: impl FnMut(&mut C, usize, usize, &Run)) -> Vec<C> {
        let mut index_of_root = vec![None; self.runs.len()];
        let mut clusters = Vec::new();
        for row in 0..self.row_ends.len() {
            for index in self.row(row) {
                let root = self.forest.root(index).0;
                let cluster = *index_of_root[root].get_or_insert_with(|| {
                    clusters.push(C::default());
                    clusters.len() - 1
                });
                add(&mut clusters[cluster], row, index, &self.runs[index]);
            }
        }
        clusters
    }
}

/// Maximal range `start..end` of adjacent nodes of one row that are all in contact, or all in the
/// gap.
struct Run {
    start: u32,
    end: u32,
}

impl Run {
    fn len(&self) -> usize {
        (self.end - self.start) as usize
    }
}

/// Appends the runs of a row of `nodes` nodes to `runs`. Bit j of `row` is set if node j belongs to
/// a run.
fn push_runs(row: &[u64], nodes: usize, runs: &mut Vec<Run>) {
    let (mut previous, mut open) = (0, None);
    for (index, &word) in row.iter().enumerate() {
        let mut changes = word ^ (word << 1 | previous);
        previous = word >> 63;
        while changes != 0 {
            let column = 64 * index as u32 + changes.trailing_zeros();
            changes &= changes - 1;
            match open.take() {
                None => open = Some(column),
                Some(start) => runs.push(Run { start, end: column }),
            }
        }
    }
    if let Some(start) = open {
        let end = nodes as u32;
        runs.push(Run { start, end });
    }
}

/// Joins the last and the first run of a periodic row if they are neighbours across the boundary of
/// the cell.
fn close_row(forest: &mut Forest, runs: &[Run], row: Range<usize>, nodes: usize) {
    if let (Some(first), Some(last)) = (row.clone().next(), row.last())
        && runs[first].start == 0
        && runs[last].end as usize == nodes
    {
        forest.join(last, first, [0, 1]);
    }
}

/// Joins the runs of two adjacent rows that share a column. Each link between two runs crosses the
/// boundary of the cell `crossing` times along x.
fn join_rows(
    forest: &mut Forest,
    runs: &[Run],
    mut here: Range<usize>,
    mut below: Range<usize>,
    crossing: i32,
) {
    while !here.is_empty() && !below.is_empty() {
        let (upper, lower) = (&runs[here.start], &runs[below.start]);
        if upper.start < lower.end && lower.start < upper.end {
            forest.join(here.start, below.start, [crossing, 0]);
        }
        if upper.end < lower.end {
            here.start += 1;
        } else {
            below.start += 1;
        }
    }
}

/// Union-find over runs. It stores the periodic image of the cell in which each run lies.
struct Forest {
    parent: Vec<u32>,
    /// Periodic image of each run relative to the image of its parent, in cells along x and y.
    ///
    /// For a root, it is zero.
    shift: Vec<[i32; 2]>,
    /// Number of nodes of each cluster, stored at the index of the root of the cluster; other
    /// entries are not valid.
    size: Vec<usize>,
    /// `true` if a cluster percolates: one entry for x and one for y.
    around: [bool; 2],
}

impl Forest {
    fn new(runs: &[Run]) -> Self {
        Self {
            parent: (0..runs.len() as u32).collect(),
            shift: vec![[0; 2]; runs.len()],
            size: runs.iter().map(Run::len).collect(),
            around: [false; 2],
        }
    }

    /// Returns the root of the cluster of `run`, and the periodic image of `run` relative to that
    /// of the root, in cells along x and y.
    fn root(&mut self, mut run: usize) -> (usize, [i32; 2]) {
        let mut total = [0; 2];
        while self.parent[run] as usize != run {
            let parent = self.parent[run] as usize;
            // Path halving also works at a root, which is its own parent with zero offset.
            self.shift[run] = add(self.shift[run], self.shift[parent]);
            self.parent[run] = self.parent[parent];
            total = add(total, self.shift[run]);
            run = self.parent[run] as usize;
        }
        (run, total)
    }

    /// Returns whether a run of `first` and a run of `second` belong to the same cluster.
    fn connects(
        &mut self,
        first: impl Iterator<Item = usize>,
        mut second: impl Iterator<Item = usize>,
    ) -> bool {
        let roots: BTreeSet<usize> = first.map(|run| self.root(run).0).collect();
        second.any(|run| roots.contains(&self.root(run).0))
    }

    /// Joins runs `a` and `b` by a link from `a` to `b` that crosses the boundary of the cell
    /// `crossing[0]` times along x and `crossing[1]` times along y.
    ///
    /// If both already belong to one cluster, this may show that the cluster percolates.
    fn join(&mut self, a: usize, b: usize, crossing: [i32; 2]) {
        let (root_a, shift_a) = self.root(a);
        let (root_b, shift_b) = self.root(b);
        let between = subtract(add(shift_a, crossing), shift_b);
        if root_a == root_b {
            self.around[0] |= between[0] != 0;
            self.around[1] |= between[1] != 0;
        } else if self.size[root_a] >= self.size[root_b] {
            self.attach(root_b, root_a, between);
        } else {
            self.attach(root_a, root_b, subtract([0; 2], between));
        }
    }

    fn attach(&mut self, root: usize, parent: usize, shift: [i32; 2]) {
        self.parent[root] = parent as u32;
        self.shift[root] = shift;
        self.size[parent] += self.size[root];
    }

    fn clusters(&self) -> Clusters {
        let is_root = |&run: &usize| self.parent[run] as usize == run;
        let sizes = (0..self.parent.len()).filter(is_root).map(|run| self.size[run]);
        Clusters {
            count: sizes.clone().count(),
            largest: sizes.max().unwrap_or(0),
            around_x: self.around[0],
            around_y: self.around[1],
        }
    }
}

fn add(a: [i32; 2], b: [i32; 2]) -> [i32; 2] {
    [a[0] + b[0], a[1] + b[1]]
}

fn subtract(a: [i32; 2], b: [i32; 2]) -> [i32; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::morphology::map::samples::{MESHES, map, random, square};

    fn clusters(nodes: usize, contact: impl Fn(usize, usize) -> bool) -> [Clusters; 2] {
        let map = square(nodes, contact);
        [Clusters::of_contact(&map), Clusters::of_gap(&map)]
    }

    fn of(count: usize, largest: usize, around_x: bool, around_y: bool) -> Clusters {
        Clusters { count, largest, around_x, around_y }
    }

    /// Finds the clusters of contact (`contact`) or of gap by flood fill over the periodic images
    /// of the cell.
    ///
    /// If a node is reached again in another image, a path around the cell is closed. An isolated
    /// map has one image.
    fn flood(map: &ContactMap, contact: bool) -> Clusters {
        let [rows, row_nodes] = map.nodes();
        let mut seen = vec![None; rows * row_nodes];
        let is_free = map.boundary() == Boundary::Free;
        let mut found = of(0, 0, false, false);
        for start in 0..rows * row_nodes {
            let (row, column) = (start / row_nodes, start % row_nodes);
            if seen[start].is_some() || map.get(row, column) != contact {
                continue;
            }
            let wrap = |index: i64, nodes: usize| index.rem_euclid(nodes as i64) as usize;
            let home = (row as i64, column as i64);
            seen[start] = Some(home);
            let (mut size, mut open) = (0, vec![home]);
            let mut met = [false; 4];
            while let Some((x, y)) = open.pop() {
                size += 1;
                let edges = [x == 0, x + 1 == rows as i64, y == 0, y + 1 == row_nodes as i64];
                met = [0, 1, 2, 3].map(|edge| met[edge] || edges[edge]);
                for (x, y) in [(x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)] {
                    let (i, j) = (wrap(x, rows), wrap(y, row_nodes));
                    let is_beyond = (i as i64, j as i64) != (x, y);
                    if is_free && is_beyond || map.get(i, j) != contact {
                        continue;
                    }
                    let before = &mut seen[i * row_nodes + j];
                    if let Some((before_x, before_y)) = *before {
                        found.around_x |= before_x != x;
                        found.around_y |= before_y != y;
                    } else {
                        *before = Some((x, y));
                        open.push((x, y));
                    }
                }
            }
            found.count += 1;
            found.largest = found.largest.max(size);
            found.around_x |= is_free && met[0] && met[1];
            found.around_y |= is_free && met[2] && met[3];
        }
        found
    }

    #[test]
    fn clusters_equal_those_of_a_flood_fill() {
        for nodes in MESHES {
            // Near the site percolation threshold 0.593, clusters are most complex.
            for share in [0.2, 0.5, 0.6, 0.65, 0.8, 1.0] {
                for boundary in [Boundary::Periodic, Boundary::Free] {
                    let map = random(nodes, share).with_boundary(boundary);
                    let found = [Clusters::of_contact(&map), Clusters::of_gap(&map)];
                    let flooded = [flood(&map, true), flood(&map, false)];
                    assert_eq!(found, flooded, "{nodes:?} {share} {boundary:?}");
                }
            }
        }
    }

    #[test]
    fn clusters_of_an_isolated_map_end_at_its_edges() {
        // A disc around the corner of the cell, cut into four.
        let from_corner = |index: usize| index.min(64 - index) as f64;
        let disc = |i: usize, j: usize| from_corner(i).hypot(from_corner(j)) < 20.0;
        let bounded = |map: ContactMap| {
            let map = map.with_boundary(Boundary::Free);
            [Clusters::of_contact(&map), Clusters::of_gap(&map)]
        };
        let [contact, gap] = bounded(square(64, disc));
        assert_eq!((contact.count, gap.count), (4, 1));
        assert!(!contact.around_x && gap.around_x && gap.around_y);
        // A strip from edge to edge, and one that ends before the edge.
        let [strip, beside] = bounded(map([9, 12], |_, j| j == 3));
        assert!(strip.around_x && !strip.around_y && beside.around_x && !beside.around_y);
        let [stub, around] = bounded(map([9, 12], |i, j| j == 3 && i < 8));
        assert!(!stub.around_x && around.around_x && around.around_y);
    }

    #[test]
    fn the_gap_of_a_full_map_is_empty() {
        for nodes in MESHES {
            let full = of(1, nodes[0] * nodes[1], true, true);
            let none = of(0, 0, false, false);
            let of_both = |contact: bool| {
                let map = map(nodes, |_, _| contact);
                [Clusters::of_contact(&map), Clusters::of_gap(&map)]
            };
            assert_eq!(of_both(true), [full, none]);
            assert_eq!(of_both(false), [none, full]);
        }
    }

    #[test]
    fn a_disc_across_the_corners_is_one_cluster_and_does_not_percolate() {
        let [contact, gap] = clusters(64, |i, j| {
            let from_corner = |index: usize| index.min(64 - index) as f64;
            from_corner(i).hypot(from_corner(j)) < 20.0
        });
        assert_eq!((contact.count, gap.count), (1, 1));
        assert!(!contact.around_x && !contact.around_y);
        assert!(gap.around_x && gap.around_y);
        assert_eq!(contact.largest + gap.largest, 64 * 64);
    }

    #[test]
    fn stripes_percolate_along_themselves_only() {
        let along_y = of(5, 2 * 100, false, true);
        assert_eq!(clusters(100, |i, _| i % 20 < 2)[0], along_y);
        assert_eq!(clusters(100, |i, _| i % 20 < 2)[1], of(5, 18 * 100, false, true));
        assert_eq!(clusters(100, |_, j| j % 20 < 2)[0], of(5, 2 * 100, true, false));
    }

    #[test]
    fn a_staircase_percolates_along_both_axes() {
        let staircase = |i: usize, j: usize| i == j || (i + 1) % 70 == j;
        let [contact, gap] = clusters(70, staircase);
        assert_eq!(contact, of(1, 140, true, true));
        assert_eq!(gap, of(1, 70 * 68, true, true));
    }

    #[test]
    fn corners_do_not_join() {
        let singles = of(64 * 32, 1, false, false);
        assert_eq!(clusters(64, |i, j| (i + j) % 2 == 0), [singles; 2]);
    }

    #[test]
    fn a_ring_encloses_a_gap() {
        let [contact, gap] = clusters(32, |i, j| {
            let radius = (i as f64 - 15.0).hypot(j as f64 - 15.0);
            (6.0..9.0).contains(&radius)
        });
        assert_eq!((contact.count, gap.count), (1, 2));
        assert!(!contact.around_x && gap.around_x);
    }

    #[test]
    fn a_single_node_is_a_cluster() {
        let [contact, gap] = clusters(10, |i, j| (i, j) == (9, 0));
        assert_eq!(contact, of(1, 1, false, false));
        assert_eq!(gap, of(1, 99, true, true));
    }
}
