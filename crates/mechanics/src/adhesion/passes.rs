//! Passes over the nodes of the mesh that compute new values and sums node by node.

use std::ops::Range;

use pulp::Simd;

use crate::fft::{Band, Row};
use crate::solver::lanes::{Accumulate, InOrder, Pass, Totals, greater, over_rows};
use crate::threads::Threads;

/// Number of neighbours with a partial sum each.
const LANES: usize = 8;

/// Map in a corner of a mesh. For a periodic body, both are the same.
#[derive(Debug, Clone, Copy)]
pub struct Domain {
    pub map: [usize; 2],
    pub mesh: [usize; 2],
}

impl Domain {
    pub fn map_nodes(&self) -> usize {
        self.map[0] * self.map[1]
    }

    pub fn mesh_nodes(&self) -> usize {
        self.mesh[0] * self.mesh[1]
    }

    /// Returns the number of nodes of a row of the mesh that belong to the map.
    pub fn inside(&self, row: Row) -> usize {
        if row.index < self.map[0] { self.map[1] } else { 0 }
    }
}

/// Condition at a node.
#[derive(Debug, Clone, Copy)]
pub struct Site {
    /// Lowest gap: 0 on the map, and −∞ outside, where no rough surface is.
    pub floor: f64,
    /// 1 on the map, and 0 outside.
    pub weight: f64,
}

const ON_MAP: Site = Site { floor: 0.0, weight: 1.0 };
const OUTSIDE: Site = Site { floor: f64::NEG_INFINITY, weight: 0.0 };

/// New values of a node, and its contributions to sums and maxima.
pub type Visited<const O: usize, const K: usize, const H: usize> = ([f64; O], [f64; K], [f64; H]);

/// Visits all nodes of the mesh and returns the sums and maxima.
///
/// `term(site, x, y)` receives the values `x` of the `inputs` and `y` of the `outputs` at a node,
/// and returns the new values of the outputs, terms of the sums, and candidates for the maxima.
/// The result does not depend on the number of threads.
pub fn visit<const A: usize, const O: usize, const K: usize, const H: usize>(
    threads: &Threads,
    domain: Domain,
    inputs: [&[f64]; A],
    outputs: [&mut [f64]; O],
    term: impl Fn(Site, [f64; A], [f64; O]) -> Visited<O, K, H> + Copy + Send,
) -> Totals<K, H> {
    // The rows of a map without content only drive the pass.
    let mut rows = vec![(); domain.mesh_nodes()];
    let bands = outputs.map(Band::new);
    let mut pass = Nodes { domain, inputs, outputs: bands, term, found: InOrder::new() };
    over_rows(threads, &mut rows, domain.mesh[1], &mut pass);
    pass.found.total()
}

struct Nodes<'a, F, const A: usize, const O: usize, const K: usize, const H: usize> {
    domain: Domain,
    inputs: [&'a [f64]; A],
    outputs: [Band<'a, f64>; O],
    term: F,
    found: InOrder<Totals<K, H>>,
}

impl<F, const A: usize, const O: usize, const K: usize, const H: usize> Pass<()>
    for Nodes<'_, F, A, O, K, H>
where
    F: Fn(Site, [f64; A], [f64; O]) -> Visited<O, K, H> + Copy + Send,
{
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, _: &mut [()]) {
        let inside = self.domain.inside(row);
        let inputs = self.inputs.map(|map| row.of(map));
        let mut outputs = self.outputs.each_mut().map(|band| band.row(row));
        let mut found = Totals::default();
        if inside > 0 {
            segment(ON_MAP, 0..inside, &inputs, &mut outputs, self.term, &mut found);
        }
        if inside < self.domain.mesh[1] {
            let outside = inside..self.domain.mesh[1];
            segment(OUTSIDE, outside, &inputs, &mut outputs, self.term, &mut found);
        }
        self.found.push(found);
    }

    fn split_off(&mut self, row: Row) -> Self {
        Self {
            domain: self.domain,
            inputs: self.inputs,
            outputs: self.outputs.each_mut().map(|band| band.split_off(row)),
            term: self.term,
            found: InOrder::new(),
        }
    }

    fn append(&mut self, later: Self) {
        self.found.append(later.found);
    }
}

/// Visits the neighbouring nodes `nodes` of a row, which are of one kind, and adds their sums and
/// maxima to `found`.
///
/// Every call is compiled for each set of instructions, and plain loops over the few maps are a
/// third of the code of `map` and `from_fn`.
#[inline(always)]
fn segment<const A: usize, const O: usize, const K: usize, const H: usize>(
    site: Site,
    nodes: Range<usize>,
    inputs: &[&[f64]; A],
    outputs: &mut [&mut [f64]; O],
    term: impl Fn(Site, [f64; A], [f64; O]) -> Visited<O, K, H>,
    found: &mut Totals<K, H>,
) {
    let mut sums = [[0.0; LANES]; K];
    let mut highest = [[f64::NEG_INFINITY; LANES]; H];
    let (mut own_x, mut own_y) = ([0.0; A], [0.0; O]);
    let rest = nodes.end - nodes.len() % LANES;
    for first in (nodes.start..rest).step_by(LANES) {
        let mut x = [[0.0; LANES]; A];
        for a in 0..A {
            x[a].copy_from_slice(&inputs[a][first..first + LANES]);
        }
        let mut y = [[0.0; LANES]; O];
        for o in 0..O {
            y[o].copy_from_slice(&outputs[o][first..first + LANES]);
        }
        for lane in 0..LANES {
            for a in 0..A {
                own_x[a] = x[a][lane];
            }
            for o in 0..O {
                own_y[o] = y[o][lane];
            }
            let (new, terms, high) = term(site, own_x, own_y);
            for o in 0..O {
                y[o][lane] = new[o];
            }
            for k in 0..K {
                sums[k][lane] += terms[k];
            }
            for h in 0..H {
                highest[h][lane] = greater(high[h], highest[h][lane]);
            }
        }
        for o in 0..O {
            outputs[o][first..first + LANES].copy_from_slice(&y[o]);
        }
    }
    for node in rest..nodes.end {
        for a in 0..A {
            own_x[a] = inputs[a][node];
        }
        for o in 0..O {
            own_y[o] = outputs[o][node];
        }
        let (new, terms, high) = term(site, own_x, own_y);
        for o in 0..O {
            outputs[o][node] = new[o];
        }
        for k in 0..K {
            sums[k][node - rest] += terms[k];
        }
        for h in 0..H {
            highest[h][0] = greater(high[h], highest[h][0]);
        }
    }
    let mut in_segment = Totals::default();
    for (sum, lanes) in in_segment.sums.iter_mut().zip(sums) {
        *sum = lanes.into_iter().sum();
    }
    for (largest, lanes) in in_segment.highest.iter_mut().zip(highest) {
        *largest = lanes.into_iter().fold(f64::NEG_INFINITY, greater);
    }
    found.add(in_segment);
}
