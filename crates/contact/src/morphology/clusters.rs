//! Connected clusters of contact, or of the gap, on a torus, or on a map that ends at its edges.
//!
//! A cluster is a set of nodes joined through their 4 nearest neighbours. Rows are cut into runs of
//! joined nodes, and a union-find joins the runs. Each link remembers how often it crosses the
//! boundary of the cell; a closed chain of links whose crossings do not cancel goes around. Where
//! there is nothing beyond the edges no link crosses them, and a cluster goes through that meets
//! both.

mod each;

use std::collections::BTreeSet;
use std::ops::Range;

use super::map::{ContactMap, mask_tail};
use crate::grid::Boundary;

pub use each::Cluster;

/// Clusters of one kind on a map.
///
/// ```
/// use asperity_contact::morphology::clusters::Clusters;
/// use asperity_contact::morphology::map::ContactMap;
///
/// // A row of contact along y: nothing leaks across it, along x.
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
    /// Number of clusters.
    pub count: usize,
    /// Nodes of the largest one.
    pub largest: usize,
    /// Some cluster holds a closed path that goes around the cell along x, across the rows; or,
    /// where there is nothing beyond the edges, reaches from the first row to the last.
    pub around_x: bool,
    /// Some cluster holds a closed path that goes around the cell along y, along the rows; or
    /// reaches from their first nodes to their last.
    pub around_y: bool,
}

impl Clusters {
    /// Clusters of nodes in contact.
    pub fn of_contact(map: &ContactMap) -> Self {
        Self::of_rows(map, |_| ())
    }

    /// Clusters of nodes not in contact; where one goes around, a fluid leaks that way.
    pub fn of_gap(map: &ContactMap) -> Self {
        Self::of_rows(map, |row| {
            row.iter_mut().for_each(|word| *word = !*word);
            mask_tail(row, map.nodes()[1]);
        })
    }

    fn of_rows(map: &ContactMap, change: impl Fn(&mut [u64])) -> Self {
        Joined::of(map, change).forest.clusters()
    }
}

/// The runs of a map, row after row, and which of them are joined.
struct Joined {
    runs: Vec<Run>,
    /// Where the runs of each row end among them.
    row_ends: Vec<usize>,
    forest: Forest,
}

impl Joined {
    fn of(map: &ContactMap, change: impl Fn(&mut [u64])) -> Self {
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
        let mut forest = Forest::of(&runs);
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
                    forest.meet(rows(0), rows(count - 1)),
                    forest.meet(all.clone().filter(first), all.filter(last)),
                ];
            }
        }
        Joined { runs, row_ends, forest }
    }

    /// The runs of a row.
    fn row(&self, row: usize) -> Range<usize> {
        let start = if row == 0 { 0 } else { self.row_ends[row - 1] };
        start..self.row_ends[row]
    }
}

/// Nodes start..end of one row, all of the kind that is clustered.
struct Run {
    start: u32,
    end: u32,
}

impl Run {
    fn len(&self) -> usize {
        (self.end - self.start) as usize
    }
}

/// Cuts a row into its runs.
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

/// Joins the last run of a row to the first across the boundary of the cell.
fn close_row(forest: &mut Forest, runs: &[Run], row: Range<usize>, nodes: usize) {
    if let (Some(first), Some(last)) = (row.clone().next(), row.last())
        && runs[first].start == 0
        && runs[last].end as usize == nodes
    {
        forest.join(last, first, [0, 1]);
    }
}

/// Joins the runs of a row to those of the next that share a column with them.
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

/// A union-find over runs that knows in which copy of the cell each run lies.
struct Forest {
    parent: Vec<u32>,
    /// Copies of the cell from the parent to the run, along x and y; zero for a root.
    shift: Vec<[i32; 2]>,
    /// Nodes of the cluster; up to date for a root.
    size: Vec<usize>,
    around: [bool; 2],
}

impl Forest {
    fn of(runs: &[Run]) -> Self {
        Self {
            parent: (0..runs.len() as u32).collect(),
            shift: vec![[0; 2]; runs.len()],
            size: runs.iter().map(Run::len).collect(),
            around: [false; 2],
        }
    }

    /// Root of a run's cluster, and copies of the cell from there to the run.
    fn root(&mut self, mut run: usize) -> (usize, [i32; 2]) {
        let mut total = [0; 2];
        while self.parent[run] as usize != run {
            let parent = self.parent[run] as usize;
            // Halves the path for the next search; a root's own parent and shift change nothing.
            self.shift[run] = add(self.shift[run], self.shift[parent]);
            self.parent[run] = self.parent[parent];
            total = add(total, self.shift[run]);
            run = self.parent[run] as usize;
        }
        (run, total)
    }

    /// Whether some cluster has a run among these and one among those.
    fn meet(
        &mut self,
        these: impl Iterator<Item = usize>,
        mut those: impl Iterator<Item = usize>,
    ) -> bool {
        let roots: BTreeSet<usize> = these.map(|run| self.root(run).0).collect();
        those.any(|run| roots.contains(&self.root(run).0))
    }

    /// Joins two runs; from `a` to `b` the boundary of the cell is crossed `crossing` times.
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

    /// Node by node: floods each cluster over the copies of the cell, where a node that is met
    /// again in another copy closes a path around; or over the one map that there is.
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
            let wrap = |place: i64, nodes: usize| place.rem_euclid(nodes as i64) as usize;
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
    fn runs_join_what_a_flood_reaches() {
        for nodes in MESHES {
            // Around the threshold of percolation, 0.593, clusters are as tangled as they get.
            for share in [0.2, 0.5, 0.6, 0.65, 0.8, 1.0] {
                for boundary in [Boundary::Periodic, Boundary::Free] {
                    let map = random(nodes, share).within(boundary);
                    let found = [Clusters::of_contact(&map), Clusters::of_gap(&map)];
                    let flooded = [flood(&map, true), flood(&map, false)];
                    assert_eq!(found, flooded, "{nodes:?} {share} {boundary:?}");
                }
            }
        }
    }

    #[test]
    fn without_anything_beyond_the_edges_clusters_end_there() {
        // Four corners of one disc.
        let from_corner = |index: usize| index.min(64 - index) as f64;
        let disc = |i: usize, j: usize| from_corner(i).hypot(from_corner(j)) < 20.0;
        let bounded = |map: ContactMap| {
            let map = map.within(Boundary::Free);
            [Clusters::of_contact(&map), Clusters::of_gap(&map)]
        };
        let [contact, gap] = bounded(square(64, disc));
        assert_eq!((contact.count, gap.count), (4, 1));
        assert!(!contact.around_x && gap.around_x && gap.around_y);
        // A strip from edge to edge, and one that ends before.
        let [strip, beside] = bounded(map([9, 12], |_, j| j == 3));
        assert!(strip.around_x && !strip.around_y && beside.around_x && !beside.around_y);
        let [stub, around] = bounded(map([9, 12], |i, j| j == 3 && i < 8));
        assert!(!stub.around_x && around.around_x && around.around_y);
    }

    #[test]
    fn full_and_empty_maps_are_each_others_gap() {
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
    fn a_disc_across_the_corners_is_one_cluster_and_goes_nowhere() {
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
    fn stripes_go_around_along_themselves_and_seal_across() {
        let along_y = of(5, 2 * 100, false, true);
        assert_eq!(clusters(100, |i, _| i % 20 < 2)[0], along_y);
        assert_eq!(clusters(100, |i, _| i % 20 < 2)[1], of(5, 18 * 100, false, true));
        assert_eq!(clusters(100, |_, j| j % 20 < 2)[0], of(5, 2 * 100, true, false));
    }

    #[test]
    fn a_staircase_goes_around_both_ways() {
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
    fn a_ring_encloses_a_gap_of_its_own() {
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
