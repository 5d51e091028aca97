//! Descent of the energy by projected, preconditioned conjugate gradients.
//!
//! The unknowns are the gaps g of all nodes of the mesh. The *force* at a node is
//!
//! λ = S(g + h) + a + p₀, with the attraction a = (w/ρ) exp(−g/ρ).
//!
//! It vanishes at open nodes, where g > 0. At closed nodes it is the pressure of the hard wall, and
//! must not be negative. If the mean gap is prescribed, p₀ is the number for which λ vanishes in
//! the mean of the open nodes. One iteration is
//!
//! ```text
//! F ← nodes that are open, or whose wall would pull (λ < 0)        the free nodes
//! s ← shape of the displacement that changes the mean gap: 1 − X 1 on F
//! r ← λ on F, 0 elsewhere; less the number for which Σ s r = 0, if the mean gap is prescribed
//! z ← M r on F, with the preconditioner M                          first transform pair
//! β ← Σ z y / Σ d y, with the change y of r by the last step d     not below zero
//! t ← −z + β d on F; less the multiple of s for which Σ t = 0, if the mean gap is prescribed
//! d ← max(g + τ t, 0) − g, with the mean zero if it is prescribed
//! q ← S d                                                          second transform pair
//! α ← the lowest energy along d
//! g ← g + α d
//! ```
//!
//! M is the compliance of the free nodes while the wall holds the others (`preconditioner`). The
//! shape s rises from zero at the edges of contact as displacements do. A mean that is subtracted
//! as a constant would jump there, and add short waves to each direction.
//!
//! A pair of transforms is saved by choosing the length τ of the clipped step from the last
//! iteration. A wrong choice does no harm, because α corrects it, unless further nodes close. Then
//! α is at most 1, and τ grows to the length at which the derivative along d would vanish. The
//! energy of a contact that forms or breaks is almost level, and steps along it must become long.
//!
//! If the load is prescribed, the uniform wave belongs to the unknowns. A has no entry for it, and
//! the compliance to displacements of the shape s takes its place. Nodes of the wall that t would
//! push into it do not move (`direction`).
//!
//! Where many nodes are about to close, the clipped step may lead uphill, or be so nearly level
//! that the line search hardly moves. A step therefore counts only if it lowers the energy by a
//! fraction of what the clipped step down the plain gradient would, d = max(g − α λ, 0) − g with
//! the least compliance α of all waves. After three steps that do not count, that step is taken. It
//! lowers the energy unless the state is in balance, so that the descent ends in a state of balance
//! (Bertsekas, *SIAM J. Control Optim.* 20, 1982, 221).

use super::body::Body;
use super::exponential::exponential;
use super::line_search::Line;
use super::passes::{Domain, visit};
use super::preconditioner::Continuation;
use super::{Adhesion, AdhesivePath, Settings, Stop};
use crate::solver::Watch;
use crate::threads::Threads;

mod direction;

/// Gap, in units of the range, beyond which the attraction does not change the energy of a step.
const FAR: f64 = 30.0;

/// Bounds of the predicted length τ.
const LENGTHS: [f64; 2] = [0.2, 5.0];

/// Largest factor by which a step may be extended if no node closes.
const LONGEST_EXTENSION: f64 = 4.0;

/// Number of iterations after which the compliance to a uniform displacement is computed anew.
const UNIFORM_EVERY: u32 = 10;

/// Least decrease of energy of a step, as a fraction of that of a step down the gradient.
const LEAST_GAIN: f64 = 1e-3;

/// Number of consecutive steps that do not lower the energy after which the solver gives up.
const FAILURES: u32 = 20;

/// Number of consecutive steps that do not lower the energy after which the compliance is not used
/// for the next one.
const FAILURES_WITH_COMPLIANCE: u32 = 3;

/// Number of consecutive iterations without movement and without a smaller residual after which the
/// solver gives up.
const IDLE_ITERATIONS: u32 = 200;

/// Largest step, in units of the range, that is no movement.
const IDLE_STEP: f64 = 1e-6;

/// Tolerance after a symmetric state was shaken, as a fraction of the largest attraction. A coarser
/// one would accept the first slow growth of an instability.
const SHAKEN_TOLERANCE: f64 = 1e-6;

/// Bodies are apart if no node is in contact, and if attraction is this fraction of the tension.
const APART: f64 = 0.01;

/// Quantity that is prescribed for the nodes of the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Control {
    /// The mean gap keeps its value.
    MeanGap,
    /// The mean pressure over the mesh has this value.
    Load(f64),
}

/// Maps on the mesh that the iteration changes.
pub struct Fields {
    pub gap: Vec<f64>,
    /// Elastic pressure S(g + h), of zero mean.
    pub pressure: Vec<f64>,
    /// Attraction a, zero outside the map.
    pub pull: Vec<f64>,
    residual: Vec<f64>,
    last_residual: Vec<f64>,
    /// Shape s of the displacements that change the mean gap: positive at free nodes, zero at
    /// others.
    shape: Vec<f64>,
    /// Correction z, then the direction t.
    direction: Vec<f64>,
    /// Last step d. Between descents, a buffer.
    pub step: Vec<f64>,
    step_pressure: Vec<f64>,
    continuation: Continuation,
}

impl Fields {
    pub fn new(domain: Domain) -> Self {
        let zeros = || vec![0.0; domain.mesh_nodes()];
        Self {
            gap: zeros(),
            pressure: zeros(),
            pull: zeros(),
            residual: zeros(),
            last_residual: zeros(),
            shape: zeros(),
            direction: zeros(),
            step: zeros(),
            step_pressure: zeros(),
            continuation: Continuation::new(domain),
        }
    }
}

/// End of a descent.
#[derive(Debug, Clone, Copy)]
pub struct End {
    pub stop: Stop,
    /// Largest |λ| at open nodes, or −λ at closed ones.
    pub residual: f64,
    /// Mean pressure p₀ over the mesh.
    pub mean_pressure: f64,
}

/// State of balance of the present gaps.
struct Balance {
    error: f64,
    mean_pressure: f64,
    is_apart: bool,
}

impl AdhesivePath {
    /// Iterates until the largest error of a force is at most the tolerance.
    pub(super) fn descend(
        &mut self,
        control: Control,
        settings: &Settings,
        watch: &dyn Watch,
    ) -> End {
        self.control = control;
        self.refresh();
        let (mut is_fresh, mut has_step) = (true, false);
        let (mut length, mut failures, mut iterations) = (1.0, 0, 0);
        let (mut uniform, mut idle, mut least_error) = (0.0, 0, f64::INFINITY);
        let mut tolerance = settings.tolerance;
        let mut is_to_be_shaken = self.body.may_be_symmetric && self.adhesion.work > 0.0;
        loop {
            let balance = self.balance();
            let end = |stop| End {
                stop,
                residual: balance.error.max(0.0),
                mean_pressure: balance.mean_pressure,
            };
            watch.spent(self.pairs);
            if balance.error <= tolerance {
                if is_fresh && !is_to_be_shaken {
                    return end(Stop::Converged);
                }
                if is_fresh {
                    let largest = self.adhesion.largest_attraction();
                    tolerance = tolerance.min(SHAKEN_TOLERANCE * largest);
                    (is_to_be_shaken, length) = (false, 1.0);
                    self.shake();
                }
                self.refresh();
                (is_fresh, has_step) = (true, false);
                continue;
            }
            if balance.is_apart {
                return end(Stop::PulledOff);
            }
            if balance.error < least_error {
                (least_error, idle) = (balance.error, 0);
            }
            let is_stalled = failures >= FAILURES || idle >= IDLE_ITERATIONS;
            if is_stalled || self.pairs >= settings.pair_limit {
                return end(if balance.error <= settings.tolerance {
                    Stop::Converged
                } else if is_stalled {
                    Stop::Stalled
                } else {
                    Stop::PairLimit
                });
            }
            if watch.is_interrupted() {
                return end(Stop::Interrupted);
            }
            let with_compliance = failures < FAILURES_WITH_COMPLIANCE;
            let force = self.precondition(with_compliance);
            if self.control != Control::MeanGap && iterations % UNIFORM_EVERY == 0 {
                uniform = self.uniform_compliance();
            }
            iterations += 1;
            let shift = if with_compliance { uniform * force } else { 0.0 };
            self.find_direction(has_step, shift);
            length = self.limited(length);
            self.clip(length);
            self.body.stiffness(
                &self.fields.step,
                &mut self.fields.step_pressure,
                &mut self.scratch,
            );
            self.pairs += 1;
            let line = self.line(balance.mean_pressure);
            is_fresh = false;
            let [best, wanted] = if line.slope < 0.0 { self.best(&line) } else { [0.0; 2] };
            idle = if best * line.reach > IDLE_STEP { 0 } else { idle + 1 };
            let least_gain = if with_compliance { LEAST_GAIN * line.gradient_gain } else { 0.0 };
            if best > 0.0 && -line.slope * best >= least_gain {
                self.take(best);
                length = (length * wanted).clamp(LENGTHS[0], LENGTHS[1]);
                (has_step, failures) = (true, 0);
            } else {
                // Clipping turned the step uphill. A shorter step along −z alone is clipped less.
                length *= if has_step { 1.0 } else { 0.3 };
                (has_step, failures) = (false, failures + 1);
                if failures == FAILURES_WITH_COMPLIANCE {
                    length = 1.0;
                }
            }
        }
    }

    /// Computes the elastic pressure and the attraction from the gaps.
    fn refresh(&mut self) {
        let Fields { gap, pressure, pull, step, .. } = &mut self.fields;
        let (threads, domain) = (&self.threads, self.body.domain);
        let heights = &self.body.heights[..];
        visit(threads, domain, [gap, heights], [step], |_, [gap, height], [_]| {
            ([gap + height], [0.0; 0], [0.0; 0])
        });
        self.body.stiffness(step, pressure, &mut self.scratch);
        self.pairs += 1;
        attract(threads, &self.body, self.adhesion, gap, pull);
    }

    /// Computes the residual, and sets the shape to 1 at free nodes: at open nodes, and at closed
    /// ones whose force, less than zero, would have to pull at them.
    fn balance(&mut self) -> Balance {
        let Fields { gap, pressure, pull, residual, shape, .. } = &mut self.fields;
        let (threads, domain) = (&self.threads, self.body.domain);
        let maps = [&gap[..], &pressure[..], &pull[..]];
        let nodes = domain.mesh_nodes() as f64;
        // p₀ ← −mean of S(g + h) + a over the open nodes, if the mean gap is prescribed
        let mean_pressure = match self.control {
            Control::Load(load) => load,
            Control::MeanGap => {
                let found = visit(threads, domain, maps, [], |site, [gap, pressure, pull], []| {
                    let open = f64::from(u8::from(gap > site.floor));
                    ([], [open * (pressure + pull), open], [-pressure - pull])
                });
                let ([sum, open], [closed]) = (found.sums, found.highest);
                // Full contact bears any load down to the one at which a node would open.
                if open > 0.0 { -sum / open } else { closed }
            }
        };
        // λ ← S(g + h) + a + p₀; r ← λ on F
        let outputs = [&mut residual[..], &mut shape[..]];
        let found = visit(threads, domain, maps, outputs, |site, x, [_, _]| {
            let [gap, pressure, pull] = x;
            let force = pressure + pull + mean_pressure;
            let is_open = gap > site.floor;
            let free = f64::from(u8::from(is_open || force < 0.0));
            let closed = f64::from(u8::from(!is_open));
            let error = if is_open { force.abs() } else { -force };
            ([free * force, free], [pull, closed], [error])
        });
        let ([pull, closed], [error]) = (found.sums, found.highest);
        let is_apart = self.control != Control::MeanGap
            && closed == 0.0
            && mean_pressure < 0.0
            && pull < -APART * mean_pressure * nodes;
        Balance { error, mean_pressure, is_apart }
    }

    /// Computes the step d of length τ, clipped where gaps would become negative. If the mean gap
    /// is prescribed, the opening nodes move less, so that the mean remains.
    fn clip(&mut self, length: f64) {
        let Fields { gap, direction, step, .. } = &mut self.fields;
        let (threads, domain) = (&self.threads, self.body.domain);
        // d ← max(g + τ t, 0) − g; sums of the opening and of the closing steps
        let maps = [&gap[..], &direction[..]];
        let found = visit(threads, domain, maps, [&mut step[..]], |site, [gap, direction], [_]| {
            let end = gap + length * direction;
            let step = if end > site.floor { length * direction } else { site.floor - gap };
            let opens = f64::from(u8::from(step > 0.0)) * step;
            ([step], [opens, opens - step], [0.0; 0])
        });
        if self.control != Control::MeanGap {
            return;
        }
        // d ← d Σ closing / Σ opening where d > 0
        let [opens, closes] = found.sums;
        let part = if opens > 0.0 { closes / opens } else { 0.0 };
        visit(threads, domain, [], [&mut step[..]], |_, [], [step]| {
            ([if step > 0.0 { part * step } else { step }], [0.0; 0], [0.0; 0])
        });
    }

    /// Sums up the energy along the step.
    fn line(&self, mean_pressure: f64) -> Line {
        let Fields { gap, pressure, pull, step, step_pressure, .. } = &self.fields;
        let range = self.adhesion.range;
        let inputs = [&gap[..], &pressure[..], &pull[..], &step[..], &step_pressure[..]];
        let (far, compliance) = (FAR * range, self.body.least_compliance);
        let found = visit(&self.threads, self.body.domain, inputs, [], |site, x, []| {
            let [gap, pressure, pull, step, step_pressure] = x;
            let force = pressure + pull + mean_pressure;
            let part = step / range;
            let second = pull * step * part;
            let (third, fourth) = (second * part, second * part * part);
            let closing = if step < 0.0 && site.weight > 0.0 { -step / gap } else { 0.0 };
            let is_near = gap < far || gap + step < far;
            let reach = f64::from(u8::from(is_near)) * site.weight * part.abs();
            let (down, room) = (compliance * force, gap - site.floor);
            let gain = force * if down < room { down } else { room };
            let sums = [step * force, step * step_pressure, second, third, fourth, gain];
            ([], sums, [closing, reach])
        });
        let [slope, stiffness, second, third, fourth, gradient_gain] = found.sums;
        let [closing, reach] = found.highest;
        let longest = if closing > 0.0 { 1.0 / closing } else { LONGEST_EXTENSION };
        Line {
            slope,
            stiffness,
            attraction: [second, third, fourth],
            gradient_gain,
            reach,
            longest: longest.clamp(1.0, LONGEST_EXTENSION),
        }
    }

    /// Adds `part` of the step to the gaps.
    fn take(&mut self, part: f64) {
        let Fields { gap, pressure, pull, step, step_pressure, .. } = &mut self.fields;
        // d ← α d; g ← max(g + d, 0); S(g + h) ← S(g + h) + α q
        let outputs = [&mut gap[..], &mut pressure[..], &mut step[..]];
        let (threads, domain) = (&self.threads, self.body.domain);
        visit(threads, domain, [step_pressure], outputs, |site, [added], [gap, pressure, step]| {
            let step = part * step;
            let moved = gap + step;
            let gap = if moved > site.floor { moved } else { site.floor };
            ([gap, pressure + part * added, step], [0.0; 0], [0.0; 0])
        });
        attract(threads, &self.body, self.adhesion, gap, pull);
    }
}

/// Computes the attraction (w/ρ) exp(−g/ρ) on the map.
fn attract(threads: &Threads, body: &Body, adhesion: Adhesion, gap: &[f64], pull: &mut [f64]) {
    let (largest, range) = (adhesion.largest_attraction(), adhesion.range);
    visit(threads, body.domain, [gap], [pull], |site, [gap], [_]| {
        ([site.weight * largest * exponential(-gap / range)], [0.0; 0], [0.0; 0])
    });
}

/// Amplitude of the displacements, as a fraction of the range, or of the gap if it is smaller.
const AMPLITUDE: f64 = 0.01;

impl AdhesivePath {
    /// Displaces the open nodes of the map at random, and keeps the mean gap. No node closes.
    ///
    /// A descent keeps every symmetry of surface and gaps, and thus ends at a saddle point of the
    /// energy if the state is unstable only against displacements without the symmetry. Small
    /// displacements without any symmetry, followed by a second descent, return to a minimum and
    /// leave a saddle point.
    fn shake(&mut self) {
        let Fields { gap, step, .. } = &mut self.fields;
        let (threads, domain) = (&self.threads, self.body.domain);
        for (node, noise) in step.iter_mut().enumerate() {
            *noise = noise_at(node / domain.mesh[1], node % domain.mesh[1], domain.mesh);
        }
        let range = self.adhesion.range;
        let amplitude =
            move |weight: f64, gap: f64| weight * AMPLITUDE * if gap < range { gap } else { range };
        let inputs = [&gap[..], &step[..]];
        let found = visit(threads, domain, inputs, [], |site, [gap, noise], []| {
            let amplitude = amplitude(site.weight, gap);
            ([], [amplitude * noise, amplitude], [0.0; 0])
        });
        let [sum, amplitudes] = found.sums;
        let mean = if amplitudes > 0.0 { sum / amplitudes } else { 0.0 };
        visit(threads, domain, [&step[..]], [&mut gap[..]], |site, [noise], [gap]| {
            let moved = if site.weight > 0.0 { amplitude(1.0, gap) * (noise - mean) } else { 0.0 };
            ([gap + moved], [0.0; 0], [0.0; 0])
        });
    }
}

/// Returns a number from −1 to 1 that depends on the node only. Blocks of all sizes contribute
/// equally, so that it contains all wavelengths.
fn noise_at(row: usize, column: usize, mesh: [usize; 2]) -> f64 {
    let levels = usize::BITS - mesh[0].max(mesh[1]).leading_zeros();
    let of_block = |level: u32| {
        let [row, column] = [row, column].map(|index| (index >> level) as u64);
        scattered(u64::from(level) << 58 ^ row << 29 ^ column)
    };
    (0..levels).map(of_block).sum::<f64>() / f64::from(levels)
}

/// Returns a number from −1 to 1 that looks random: the output function of SplitMix64.
fn scattered(seed: u64) -> f64 {
    let mut bits = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    bits = (bits ^ bits >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    bits = (bits ^ bits >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    (bits ^ bits >> 31) as f64 / 2f64.powi(63) - 1.0
}
