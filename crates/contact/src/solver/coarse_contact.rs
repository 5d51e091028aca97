//! What was found of a contact on a coarser mesh, as the next finer one takes it up.

use super::lanes::over_rows;
use super::passes::{CoarseMap, LastMoveDone, PendingUpdate, PressureLessGap};
use super::search::Search;
use super::{Outcome, Solver};
use crate::elasticity::ElasticOperator;

/// Nodes of a mesh over those of the next coarser one.
pub const RATIO: f64 = 4.0;

/// s over the displacement of one node of the finer mesh under unit pressure. With 1 or 2 as many pairs.
const COMPLIANCES: f64 = 1.5;

/// A contact on a coarser mesh.
pub struct CoarseContact {
    /// s p − g
    pressure_less_gap: Vec<f32>,
    nodes: [usize; 2],
    /// From which gaps count.
    pub reference: f64,
    pub peak_pressure: f64,
    /// Transform pairs, those of coarser meshes by their nodes.
    pub pairs: f64,
}

impl CoarseContact {
    /// Of a body that was not pressed.
    pub fn nothing(body: &dyn ElasticOperator) -> Self {
        let nodes = body.grid().nodes();
        Self {
            pressure_less_gap: Vec::new(),
            nodes,
            reference: 0.0,
            peak_pressure: 0.0,
            pairs: 0.0,
        }
    }

    /// The map s p − g.
    pub fn map(&self) -> CoarseMap<'_> {
        CoarseMap { values: &self.pressure_less_gap, nodes: self.nodes }
    }

    /// Transform pairs in those of the next finer mesh.
    pub fn finer_pairs(&self) -> u32 {
        (self.pairs / RATIO).round() as u32
    }

    /// Has no pressure anywhere.
    pub fn lose(&mut self) {
        self.pressure_less_gap.clear();
        self.pressure_less_gap.resize(self.nodes[0] * self.nodes[1], 0.0);
        self.peak_pressure = 0.0;
    }

    /// Takes over what a search has led to, with this still to be done to pressures, and gaps in contact about as high
    /// as the offset.
    pub fn take_search(
        &mut self,
        search: &Search,
        pending: PendingUpdate,
        offset: f64,
        compliance: f64,
    ) {
        self.pressure_less_gap.resize(search.cells(), 0.0);
        let mut pass = PressureLessGap {
            compliance: compliance as f32,
            offset: offset as f32,
            done: LastMoveDone::new(pending, search.ceiling()),
            increment: &search.increment,
            carry: &search.carry,
            gap: &search.gap,
            peak_pressure: 0.0,
        };
        let map = &mut self.pressure_less_gap;
        over_rows(&search.threads, map, self.nodes[1], &mut pass);
        self.peak_pressure = f64::from(pass.peak_pressure);
        self.reference = search.reference + offset;
    }

    /// Takes over the last solution of a solver, whose outcome this was.
    pub fn take_solution(&mut self, solver: &Solver, outcome: &Outcome, compliance: f64) {
        let (gap, offset) = (&solver.search.gap, solver.offset);
        let nodes = solver.pressure.iter().zip(gap);
        let less_gap = nodes.map(|(p, gap)| (compliance * p - (f64::from(*gap) - offset)) as f32);
        self.pressure_less_gap.clear();
        self.pressure_less_gap.extend(less_gap);
        self.reference = solver.search.reference + offset;
        self.peak_pressure = outcome.peak_pressure;
        self.pairs = f64::from(outcome.pairs);
    }
}

impl Search {
    /// s, for a map to begin from.
    pub fn compliance(&self) -> f64 {
        COMPLIANCES * self.nodal_compliance
    }
}
