//! Removal of measured points that are errors of the instrument: spikes, and isolated points inside
//! holes.
//!
//! Removed points become missing points, which [`Fill`](super::fill::Fill) may fill later. They are
//! never replaced by other heights here, so that they are counted like all missing points.

use serde::{Deserialize, Serialize};

use super::alignment::{median, middle_values};
use super::surface::Scan;
use crate::grid::Boundary;

/// Ratio of the standard deviation to the median absolute deviation of normal random numbers.
const NORMAL: f64 = 1.4826;

/// Rounding errors of a deviation, relative to the largest height.
const ROUNDING: f64 = 1e-14;

/// Minimum number of pairs of opposite neighbours with which a point is compared.
const MIN_PAIRS: usize = 2;

/// Maximum number of points along each side of the window of [`Spikes`].
pub const MAX_WINDOW: u32 = 31;

/// Spikes of a map: points far above or below their neighbours.
///
/// The neighbours of a point are the measured points in a window around it. Its deviation is the
/// smaller one of two distances: from the median of its neighbours, and from the median of the
/// means of two opposite neighbours. On a slope the second distance vanishes, beside a step the
/// first one. A median is the interval between the two middle values if their number is even.
///
/// A point is a spike if its deviation exceeds `threshold` times the scale of the map: 1.4826 × the
/// median over all points of the larger one of both distances. Spikes do not change a median, and
/// the factor makes it the standard deviation of normally distributed distances. The search is
/// repeated without the spikes until no more are found.
///
/// A point with fewer than two pairs of opposite neighbours, as at the corners of a map, is never a
/// spike.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spikes {
    /// Smallest deviation of a spike, in units of the scale of the map.
    pub threshold: f64,
    /// Odd number of points along each side of the window.
    pub window: u32,
}

impl Spikes {
    /// Returns the nodes of the spikes, in ascending order.
    pub fn find(self, scan: &Scan, is_periodic: bool) -> Vec<usize> {
        let mut left = scan.clone();
        let mut spikes = Vec::new();
        loop {
            let deviations = self.deviations(&left, is_periodic);
            let mut larger: Vec<f64> = deviations.iter().map(|(_, [_, larger])| *larger).collect();
            let scale = NORMAL * median(&mut larger).unwrap_or(0.0);
            let limit = self.threshold * scale.max(least_scale(&left, scale));
            let outside = deviations.into_iter().filter(|(_, [smaller, _])| *smaller > limit);
            let found: Vec<usize> = outside.map(|(node, _)| node).collect();
            if found.is_empty() {
                spikes.sort_unstable();
                return spikes;
            }
            left = left.without(&found);
            spikes.extend(found);
        }
    }

    /// Returns the smaller and the larger distance of each measured node with enough neighbours.
    ///
    /// The smaller distance is measured from the interval between the two middle values, so that a
    /// spike among few neighbours gives none. The larger one is measured from the middle of this
    /// interval.
    fn deviations(self, scan: &Scan, is_periodic: bool) -> Vec<(usize, [f64; 2])> {
        let (grid, boundary) = (scan.grid(), Boundary::of(is_periodic));
        // Opposite neighbours of a small periodic map must not be the same node.
        let reach = grid.nodes().map(|nodes| (self.window as usize / 2).min((nodes - 1) / 2));
        let [reach_x, reach_y] = reach.map(|reach| reach as isize);
        let offsets = (0..=reach_x).flat_map(|x| (-reach_y..=reach_y).map(move |y| [x, y]));
        let half: Vec<[isize; 2]> = offsets.filter(|[x, y]| *x > 0 || *y > 0).collect();
        let height = |node: Option<usize>| {
            node.map(|node| scan.heights()[node]).filter(|height| !height.is_nan())
        };
        let (mut near, mut means) = (Vec::new(), Vec::new());
        let mut deviations = Vec::with_capacity(scan.heights().len());
        for (node, here) in scan.measured() {
            near.clear();
            means.clear();
            for &[x, y] in &half {
                let [one, other] =
                    [[x, y], [-x, -y]].map(|offset| height(grid.moved(node, offset, boundary)));
                near.extend(one);
                near.extend(other);
                means.extend(one.zip(other).map(|(one, other)| one + (other - one) / 2.0));
            }
            if means.len() < MIN_PAIRS {
                continue;
            }
            let distances = [&mut near, &mut means].map(|values| {
                let [lower, upper] = middle_values(values).expect("there are enough pairs");
                let middle = lower + (upper - lower) / 2.0;
                [(lower - here).max(here - upper).max(0.0), (here - middle).abs()]
            });
            let [[near, from_near], [mean, from_mean]] = distances;
            deviations.push((node, [near.min(mean), from_near.max(from_mean)]));
        }
        deviations
    }
}

/// Returns the smallest scale of the deviations of a map.
///
/// Where most points agree with their neighbours, `scale` vanishes up to rounding, as on a plane or
/// on a map with few different heights. The scale is then the resolution of the heights: the
/// smallest difference of two different ones.
fn least_scale(scan: &Scan, scale: f64) -> f64 {
    let largest = scan.measured().map(|(_, height)| height.abs()).fold(0.0, f64::max);
    let rounding = ROUNDING * largest;
    if scale > rounding {
        return rounding;
    }
    let mut heights: Vec<f64> = scan.measured().map(|(_, height)| height).collect();
    heights.sort_unstable_by(f64::total_cmp);
    let steps = heights.windows(2).map(|two| two[1] - two[0]).filter(|step| *step > rounding);
    steps.reduce(f64::min).unwrap_or(rounding)
}

/// Returns the nodes of the islands of at most `limit` points, in ascending order.
///
/// An island is a group of measured points that missing points surround. Points belong to one group
/// if they are neighbours along x, y or a diagonal. The largest group is the map itself and no
/// island.
///
/// ```
/// use asperity_mechanics::grid::{Cell, Grid};
/// use asperity_mechanics::topography::outliers::islands;
/// use asperity_mechanics::topography::surface::Scan;
///
/// let grid = Grid::new([1, 6], Cell::new([1.0, 6.0])?)?;
/// let scan = Scan::new(grid, vec![1.0, 2.0, 3.0, f64::NAN, 9.0, f64::NAN])?;
/// assert_eq!(islands(&scan, 1, false), [4]);
/// # Ok::<(), asperity_mechanics::topography::surface::SurfaceError>(())
/// ```
pub fn islands(scan: &Scan, limit: usize, is_periodic: bool) -> Vec<usize> {
    if scan.missing() == 0 {
        return Vec::new();
    }
    let mut groups = groups(scan, is_periodic);
    let sizes = groups.iter().map(Vec::len).enumerate();
    let largest = sizes.reduce(|most, next| if next.1 > most.1 { next } else { most });
    if let Some((largest, _)) = largest {
        groups.swap_remove(largest);
    }
    groups.retain(|group| group.len() <= limit);
    let mut nodes = groups.concat();
    nodes.sort_unstable();
    nodes
}

/// Returns the groups of measured points, in the order of their first nodes.
fn groups(scan: &Scan, is_periodic: bool) -> Vec<Vec<usize>> {
    let (grid, boundary) = (scan.grid(), Boundary::of(is_periodic));
    let offsets = (-1..=1).flat_map(|x| (-1..=1).map(move |y| [x, y]));
    let around: Vec<[isize; 2]> = offsets.filter(|offset| *offset != [0, 0]).collect();
    let mut is_in_group: Vec<bool> = scan.heights().iter().map(|height| height.is_nan()).collect();
    let mut groups = Vec::new();
    for (first, _) in scan.measured() {
        if is_in_group[first] {
            continue;
        }
        is_in_group[first] = true;
        let mut group = vec![first];
        let mut next = 0;
        while let Some(&node) = group.get(next) {
            next += 1;
            for &offset in &around {
                let beside = grid.moved(node, offset, boundary);
                if let Some(beside) = beside.filter(|beside| !is_in_group[*beside]) {
                    is_in_group[beside] = true;
                    group.push(beside);
                }
            }
        }
        groups.push(group);
    }
    groups
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::topography::surface::samples::scan;

    const SPIKES: Spikes = Spikes { threshold: 6.0, window: 5 };
    const NODES: [usize; 2] = [40, 32];

    fn node(i: usize, j: usize) -> usize {
        i * NODES[1] + j
    }

    /// Returns a map with additional heights at some nodes.
    fn map(height: impl Fn(f64, f64) -> f64, spikes: &[(usize, f64)]) -> Scan {
        let map = scan(NODES, [1.0, 0.8], height, |_, _| false);
        let spikes = spikes.iter().map(|(node, more)| (*node, map.heights()[*node] + more));
        map.clone().with(spikes.collect::<Vec<_>>())
    }

    fn wave(x: f64, y: f64) -> f64 {
        libm::sin(TAU * x) * libm::cos(TAU * y / 0.8) + 3.0 * x - 2.0 * y
    }

    fn plane(x: f64, y: f64) -> f64 {
        5.0 + 3.0 * x - 2.0 * y
    }

    #[test]
    fn spikes_of_a_smooth_map_are_found_and_nothing_else() {
        // In the interior, at an edge, and three in a group.
        let group = [node(30, 20), node(30, 21), node(31, 20)];
        let nodes = [node(10, 11), node(20, 0), node(39, 7), group[0], group[1], group[2]];
        let signs = [1.0, -1.0, 1.0, 1.0, 1.0, 1.0];
        let spikes: Vec<_> = nodes.into_iter().zip(signs.map(|sign| 0.8 * sign)).collect();
        let mut expected = nodes;
        expected.sort_unstable();
        for height in [wave, plane] {
            assert_eq!(SPIKES.find(&map(height, &spikes), false), expected);
            assert!(SPIKES.find(&map(height, &[]), false).is_empty());
        }
        assert!(SPIKES.find(&map(|_, _| 2.0, &[]), false).is_empty());
    }

    #[test]
    fn the_edge_of_a_step_has_no_spikes() {
        let step = |x: f64, y: f64| 0.01 * libm::sin(37.0 * x + 71.0 * y) + f64::from(x > 0.5);
        assert!(SPIKES.find(&map(step, &[]), false).is_empty());
        let spike = node(12, 12);
        assert_eq!(SPIKES.find(&map(step, &[(spike, 0.7)]), false), [spike]);
    }

    #[test]
    fn one_step_of_the_resolution_is_no_spike() {
        // Most heights equal those of their neighbours, so that the median deviation vanishes.
        let coarse = |x: f64, y: f64| wave(x, y).round();
        assert!(SPIKES.find(&map(coarse, &[]), false).is_empty());
        let spike = node(12, 12);
        assert_eq!(SPIKES.find(&map(coarse, &[(spike, 9.0)]), false), [spike]);
    }

    #[test]
    fn spikes_do_not_depend_on_a_constant_and_are_not_found_twice() {
        let spikes = [(node(10, 11), 0.8), (node(20, 0), -0.9)];
        let map = map(wave, &spikes);
        let found = SPIKES.find(&map, false);
        let raised = map.map_measured(|_, height| height + 1e3);
        assert_eq!(SPIKES.find(&raised, false), found);
        assert!(SPIKES.find(&map.without(&found), false).is_empty());
    }

    #[test]
    fn spikes_at_the_corner_of_a_periodic_map_are_found() {
        let wave = |x: f64, y: f64| libm::sin(TAU * x) * libm::cos(TAU * y / 0.8);
        let map = map(wave, &[(node(0, 0), 0.8)]);
        assert_eq!(SPIKES.find(&map, true), [0]);
        assert!(SPIKES.find(&map, false).is_empty());
    }

    /// Returns a map with a hole in which there is an island of `count` points.
    fn with_island(count: usize) -> Scan {
        scan(
            [12, 12],
            [1.0, 1.0],
            |x, y| x + y,
            |i, j| {
                let is_in_hole = (2..10).contains(&i) && (2..10).contains(&j);
                let island = [(4, 4), (4, 5), (5, 6), (6, 6), (6, 5)];
                is_in_hole && !island[..count].contains(&(i, j))
            },
        )
    }

    #[test]
    fn an_island_is_removed_up_to_the_limit() {
        for count in 1..=5 {
            let map = with_island(count);
            for limit in 0..=6 {
                let removed = islands(&map, limit, false);
                assert_eq!(removed.len(), if count <= limit { count } else { 0 });
                let left = map.clone().without(&removed);
                assert_eq!(left.missing(), map.missing() + removed.len());
                assert!(islands(&left, limit, false).is_empty());
            }
        }
    }

    #[test]
    fn the_map_itself_is_no_island() {
        let whole = scan([5, 4], [1.0, 1.0], |x, _| x, |_, _| false);
        let halves = scan([5, 4], [1.0, 1.0], |x, _| x, |i, _| i == 2);
        assert!(islands(&whole, 100, false).is_empty());
        // Of two groups of the same size, the first one stays. They are one group if periodic.
        assert_eq!(islands(&halves, 100, false), [12, 13, 14, 15, 16, 17, 18, 19]);
        assert!(islands(&halves, 100, true).is_empty());
        let nothing = scan([5, 4], [1.0, 1.0], |x, _| x, |_, _| true);
        assert!(islands(&nothing, 100, false).is_empty());
    }

    #[test]
    fn points_on_a_diagonal_belong_together() {
        let diagonal = scan([6, 6], [1.0, 1.0], |x, _| x, |i, j| i != j);
        assert!(islands(&diagonal, 100, false).is_empty());
    }
}
