//! Which nodes of an accepted solution are in contact.

use super::Solver;
use super::lanes::total;

/// A node is let go if it carries less than this part of the pressure that its gap alone asks to
/// be taken off it. Whoever carries more than the whole stays in contact for certain; near one half
/// as many nodes are let go too early as too late, in sweeps from 256² to 1024².
const UNDECIDED: f64 = 0.5;

impl Solver {
    /// Lets nodes go whose pressure is no more than what is left of the residual: nodes that were
    /// in contact at an earlier load or in an earlier iteration, and whose pressure fades away.
    ///
    /// Taking the pressure off such a node lowers its own gap by less than its height, so that it
    /// stays open.
    pub(super) fn release(&mut self) {
        let asked = UNDECIDED * self.nodal_stiffness;
        for (p, gap) in self.pressure.iter_mut().zip(&self.gap) {
            *p = if *p < asked * f64::from(*gap) {
                0.0
            } else {
                *p
            };
        }
        let scale = self.load * self.pressure.len() as f64 / total(&self.pressure);
        for p in &mut self.pressure {
            *p *= scale;
        }
    }
}
