//! A look at corrections in a sample of rows, or in all.

use pulp::Simd;

use super::super::active_groups::ActiveGroups;
use super::super::extension::{Extension, GivenRows};
use super::super::flags::{FREE, has};
use super::super::in_order::{Found, InOrder};
use super::super::lanes::{LANES, Pass, sum_over_groups, weight};
use super::super::shift::Nodes;
use super::base::Base;
use super::sample::Sample;
use crate::fft::Row;

/// Free nodes of which a sample must show so many, or else all rows are looked at.
pub const FEWEST_NODES: f64 = 64.0;

/// Means over free nodes; nothing, where none were seen.
#[derive(Debug, Default, Clone, Copy)]
pub struct Means {
    pub correction: f64,
    /// The last move, before it was scaled.
    pub last_move: f64,
    /// Correction, in the sample alone,
    pub sampled_correction: f64,
    /// and times the displacement under the last move.
    pub correction_on_image: f64,
}

/// Sums for them.
pub struct Peek<'a> {
    /// Last moves, marked where nodes are free.
    carry: &'a [f32],
    /// Where they may be.
    groups: &'a ActiveGroups,
    /// Displacements under the last move.
    sample: &'a Sample,
    /// What is to be given to corrections.
    given: GivenRows<'a>,
    sums: InOrder<PeekSums>,
    /// Where the material yields, free nodes and what they ask for.
    asking: Option<Asking<'a>>,
}

/// What a row comes to, of free nodes: their number, and sums for [`Means`].
#[derive(Clone, Copy)]
struct PeekSums {
    free_nodes: f64,
    sampled_nodes: f64,
    sums: Means,
}

impl Found for PeekSums {
    const NOTHING: Self = Self {
        free_nodes: 0.0,
        sampled_nodes: 0.0,
        sums: Means {
            correction: 0.0,
            last_move: 0.0,
            sampled_correction: 0.0,
            correction_on_image: 0.0,
        },
    };

    fn add(&mut self, later: Self) {
        self.free_nodes += later.free_nodes;
        self.sampled_nodes += later.sampled_nodes;
        let (sums, later) = (&mut self.sums, later.sums);
        sums.correction += later.correction;
        sums.last_move += later.last_move;
        sums.sampled_correction += later.sampled_correction;
        sums.correction_on_image += later.correction_on_image;
    }
}

/// Free nodes, gathered for the balance of a direction.
pub struct Asking<'a> {
    pub base: &'a Base,
    pub increment: &'a [f32],
    /// How much of the last move is still to be added to pressures.
    pub of_move: f32,
    /// Their pressures and what corrections take from them,
    pub nodes: Nodes,
    /// and their last moves.
    pub last_moves: Vec<f32>,
    /// Rows that were looked at.
    pub rows: usize,
}

impl Asking<'_> {
    #[inline(always)]
    fn gather(&mut self, row: Row, corrections: &[f32], carry: &[f32], free: &[bool]) {
        let (corrections, last_corrections) = corrections.as_chunks::<LANES>();
        let (carry, last_carry) = carry.as_chunks::<LANES>();
        let (base, last_base) = self.base.row(row).as_chunks::<LANES>();
        let (increment, last_increment) = row.of(self.increment).as_chunks::<LANES>();
        let pressure = base.iter().zip(increment);
        let groups = corrections.iter().zip(carry).zip(pressure).zip(free);
        for (((corrections, carry), (base, increment)), free) in groups {
            if *free {
                self.gather_nodes(corrections, carry, base, increment);
            }
        }
        self.gather_nodes(last_corrections, last_carry, last_base, last_increment);
        self.rows += 1;
    }

    /// Gathers from no more than [`LANES`] nodes, without a jump at each.
    #[inline(always)]
    fn gather_nodes(
        &mut self,
        corrections: &[f32],
        carry: &[f32],
        base: &[f32],
        increment: &[f32],
    ) {
        let mut gathered = [[0.0; LANES]; 3];
        let mut count = 0;
        let pressure = base.iter().zip(increment);
        for ((correction, carry), (base, increment)) in corrections.iter().zip(carry).zip(pressure)
        {
            gathered[0][count] = base + (increment + self.of_move * carry);
            gathered[1][count] = -correction;
            gathered[2][count] = *carry;
            count += usize::from(has(*carry, FREE));
        }
        let [pressures, changes, moves] = &gathered;
        self.nodes.extend(pressures, changes, count);
        self.last_moves.extend_from_slice(moves);
        self.last_moves.truncate(self.nodes.len());
    }

    fn split_off(&mut self) -> Self {
        Self { nodes: Nodes::default(), last_moves: Vec::new(), rows: 0, ..*self }
    }

    fn append(&mut self, mut later: Self) {
        self.nodes.append(later.nodes);
        self.last_moves.append(&mut later.last_moves);
        self.rows += later.rows;
    }
}

impl<'a> Peek<'a> {
    pub fn new(
        carry: &'a [f32],
        groups: &'a ActiveGroups,
        sample: &'a Sample,
        extension: &'a Extension,
        asking: Option<Asking<'a>>,
    ) -> Self {
        Self { carry, groups, sample, given: extension.given_rows(), sums: InOrder::new(), asking }
    }

    /// Whether too little was seen to go by: a direction that does not keep the mean pressure may
    /// shed all of it.
    pub fn saw_too_little(&self) -> bool {
        self.sums.total().free_nodes < FEWEST_NODES
    }

    /// What was gathered, if it was to be.
    pub fn asking(&mut self) -> Option<Asking<'a>> {
        self.asking.take()
    }

    pub fn means(&self) -> Means {
        let seen = self.sums.total();
        let nodes = seen.free_nodes.max(1.0);
        let sampled = seen.sampled_nodes.max(1.0);
        Means {
            correction: seen.sums.correction / nodes,
            last_move: seen.sums.last_move / nodes,
            sampled_correction: seen.sums.sampled_correction / sampled,
            correction_on_image: seen.sums.correction_on_image / sampled,
        }
    }
}

impl Pass<f32> for Peek<'_> {
    #[inline(always)]
    fn row<S: Simd, const R: usize>(&mut self, _: S, row: Row, values: &mut [f32]) {
        let carry = row.of(self.carry);
        let groups = self.groups.free_row(row);
        self.given.give_row(row, values, groups);
        if let Some(asking) = &mut self.asking {
            asking.gather(row, values, carry, groups);
        }
        let free = |carry| weight::<f32>(has(carry, FREE));
        let nodes = sum_over_groups(groups, carry, carry, |carry, _| free(carry));
        let correction = sum_over_groups(groups, values, carry, |value, carry| value * free(carry));
        let mut seen = PeekSums {
            free_nodes: nodes,
            sampled_nodes: 0.0,
            sums: Means {
                correction,
                last_move: sum_over_groups(groups, carry, carry, |carry, _| free(carry) * carry),
                ..Means::default()
            },
        };
        if let Some(image) = self.sample.row(row) {
            seen.sampled_nodes = nodes;
            seen.sums.sampled_correction = correction;
            for (value, carry) in values.iter_mut().zip(carry) {
                *value *= free(*carry);
            }
            seen.sums.correction_on_image =
                sum_over_groups(groups, values, image, |z, image| z * image);
        }
        self.sums.push(seen);
    }

    fn split_off(&mut self, _: Row) -> Self {
        Self {
            given: self.given.split_off(),
            sums: InOrder::new(),
            asking: self.asking.as_mut().map(Asking::split_off),
            ..*self
        }
    }

    fn append(&mut self, later: Self) {
        self.sums.append(later.sums);
        if let (Some(asking), Some(later)) = (&mut self.asking, later.asking) {
            asking.append(later);
        }
    }
}
