//! Equilibrium of the forces of asperities under a load, with elastic interaction.
//!
//! For given displacements u, the sum of the forces is a convex decreasing function of the height
//! z_ref of the reference plane. Newton's method finds the plane at which the sum equals the load;
//! from a start with a larger sum, it converges without overshoot. The forces displace the body:
//! u = G F(u). Plain iteration diverges if the contacts are stiffer than the body. The fixed point
//! is therefore found by Anderson mixing (type II; Walker & Ni, SIAM J. Numer. Anal. 49, 1715
//! (2011)).
//!
//! A force displaces the surface of a half-space by F/(π E* r) (Boussinesq; Johnson 1985, section
//! 3.2). The displacement of the periodic body, relative to its mean over the cell, is an Ewald sum
//! in two dimensions:
//!
//! ```text
//! π G(r) = Σ erfc(α |r + n|)/|r + n|  +  (2π/A) Σ erfc(q/2α)/q cos q·r  −  2√π/(α A)
//! ```
//!
//! The first sum is over the nodes around the force, the second over the waves that the grid
//! resolves. With the chosen α, omitted waves, and nodes more than 19 steps away, contribute less
//! than 1e-13. Hertz's solution already includes the displacement of a contact by its own force.
//! The term 1/r is therefore omitted at r = 0, where only the periodic images of the force remain.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};

use super::summits::Summit;
use super::{Asperities, nominal_area, steps};
use crate::fft::{Kernel, Scratch, Transform};
use crate::grid::Grid;
use crate::solver::{Settings, Stop};

/// Maximum number of earlier iterates that the Anderson mixing uses.
const DEPTH: usize = 6;

/// Maximum number of iterations in which the residual does not decrease by 10 %.
///
/// After more iterations, the mixing restarts with half the damping factor. Without the restart,
/// contacts that alternately open and close would prevent convergence.
const PATIENCE: u32 = 25;

/// Maximum number of Newton steps for the reference plane; about twelve are usual.
const MAX_STEPS: usize = 100;

/// Tolerance of |Σ Fᵢ − p₀ A₀|, relative to the load p₀ A₀.
const BALANCE: f64 = 1e-14;

/// Forces of the asperities in equilibrium with a load.
pub struct Equilibrium {
    /// Height z_ref of the reference plane.
    pub reference: f64,
    /// Approach dᵢ of each summit, which is zero or negative outside contact.
    pub overlaps: Vec<f64>,
    /// Elastic energy Σ (2/5) Fᵢ dᵢ + ½ Σ Fᵢ uᵢ.
    pub energy: f64,
    /// Largest change of a displacement uᵢ in one more iteration, in units of h′ min(Δx, Δy).
    pub residual: f64,
    /// Number of pairs of a forward and an inverse Fourier transform.
    pub pairs: u32,
    /// Reason why the iteration stopped.
    pub stop: Stop,
}

/// Height of the reference plane, approaches and forces under a load, for given displacements.
struct Balance {
    reference: f64,
    overlaps: Vec<f64>,
    forces: Vec<f64>,
}

impl Asperities {
    /// Solves for the equilibrium under a load y = p₀/(E* h′).
    pub(super) fn equilibrium(&mut self, load: f64, settings: &Settings) -> Equilibrium {
        let total = load * nominal_area(self.grid);
        let Some(body) = &mut self.body else {
            let zero = vec![0.0; self.summits.len()];
            let balance = balance(&self.summits, &zero, total);
            return equilibrium(balance, &zero, 0.0, 0, Stop::Converged);
        };
        let [step_x, step_y] = steps(self.grid);
        let step = step_x.min(step_y);
        let mut displacements = vec![0.0; self.summits.len()];
        let mut mixing = Mixing::default();
        let mut pairs = 0;
        loop {
            let balance = balance(&self.summits, &displacements, total);
            let nodes = self.summits.iter().map(|summit| summit.node);
            let answer = body.displace(nodes, &balance.forces);
            pairs += 1;
            let changes: Vec<f64> = answer.iter().zip(&displacements).map(|(a, u)| a - u).collect();
            // Summits far below the plane carry no force, so that errors of their displacements do
            // not matter.
            let all = changes.iter().zip(&balance.overlaps);
            let relevant = all.filter(|(change, overlap)| **overlap > -2.0 * change.abs());
            let largest = relevant.map(|(change, _)| change.abs()).fold(0.0, f64::max);
            let residual = largest / step;
            let stop = if residual <= settings.tolerance {
                Some(Stop::Converged)
            } else {
                (pairs >= settings.pair_limit).then_some(Stop::PairLimit)
            };
            if let Some(stop) = stop {
                return equilibrium(balance, &displacements, residual, pairs, stop);
            }
            mixing.monitor(residual);
            displacements = mixing.next(displacements, changes);
        }
    }
}

fn equilibrium(
    balance: Balance,
    displacements: &[f64],
    residual: f64,
    pairs: u32,
    stop: Stop,
) -> Equilibrium {
    let forces = balance.forces.iter().zip(&balance.overlaps).zip(displacements);
    let energies = forces.map(|((force, overlap), u)| force * (0.4 * overlap.max(0.0) + 0.5 * u));
    Equilibrium {
        reference: balance.reference,
        energy: energies.sum(),
        overlaps: balance.overlaps,
        residual,
        pairs,
        stop,
    }
}

/// Finds the height of the reference plane at which Σ Fᵢ = `total` (positive), for given
/// displacements uᵢ.
fn balance(summits: &[Summit], displacements: &[f64], total: f64) -> Balance {
    let levels: Vec<f64> =
        summits.iter().zip(displacements).map(|(summit, u)| summit.height - u).collect();
    // The start is the highest plane at which a single summit carries the whole load. All forces
    // together are at least the load there.
    let pairs = summits.iter().zip(&levels);
    let alone = pairs.map(|(summit, level)| {
        let overlap = libm::cbrt(total / summit.stiffness);
        level - overlap * overlap
    });
    let mut reference = alone.fold(f64::NEG_INFINITY, f64::max);
    for _ in 0..MAX_STEPS {
        let (mut sum, mut slope) = (0.0, 0.0);
        for (summit, level) in summits.iter().zip(&levels) {
            let overlap = level - reference;
            if overlap > 0.0 {
                let root = overlap.sqrt();
                sum += summit.stiffness * overlap * root;
                slope += 1.5 * summit.stiffness * root;
            }
        }
        let step = (sum - total) / slope;
        // Only rounding errors can make a step negative.
        if step.is_nan() || step <= 0.0 || sum - total <= BALANCE * total {
            break;
        }
        reference += step;
    }
    let overlaps: Vec<f64> = levels.iter().map(|level| level - reference).collect();
    let forces = summits.iter().zip(&overlaps).map(|(summit, &overlap)| {
        let depth = overlap.max(0.0);
        summit.stiffness * depth * depth.sqrt()
    });
    Balance { reference, forces: forces.collect(), overlaps }
}

/// State of the Anderson mixing for the fixed point u = G F(u), with iterates u and changes r = G
/// F(u) − u.
struct Mixing {
    /// Factor of the changes r.
    damping: f64,
    /// Smallest residual since the last restart, and the number of iterations since it was reached.
    least: (f64, u32),
    /// Last iterate u and its change r.
    last: Option<(Vec<f64>, Vec<f64>)>,
    /// Differences Δu of successive iterates and Δr of their changes, most recent first.
    differences: Vec<(Vec<f64>, Vec<f64>)>,
}

impl Default for Mixing {
    fn default() -> Mixing {
        Mixing { damping: 1.0, least: (f64::INFINITY, 0), last: None, differences: Vec::new() }
    }
}

impl Mixing {
    /// Records the residual of the last iterate. Restarts the mixing with half the damping factor
    /// if the residual has not decreased by 10 % within [`PATIENCE`] iterations.
    fn monitor(&mut self, residual: f64) {
        let (least, age) = self.least;
        if residual < 0.9 * least {
            self.least = (residual, 0);
        } else if age < PATIENCE {
            self.least = (least, age + 1);
        } else {
            self.least = (residual, 0);
            self.damping *= 0.5;
            self.last = None;
            self.differences.clear();
        }
    }

    /// Returns the next iterate after `iterate` = u with `change` = r, and stores both.
    fn next(&mut self, iterate: Vec<f64>, change: Vec<f64>) -> Vec<f64> {
        if let Some((iterate_before, change_before)) = &self.last {
            let difference = |now: &[f64], before: &[f64]| -> Vec<f64> {
                now.iter().zip(before).map(|(now, before)| now - before).collect()
            };
            let both = (difference(&iterate, iterate_before), difference(&change, change_before));
            self.differences.insert(0, both);
            self.differences.truncate(DEPTH);
        }
        let damping = self.damping;
        let mut next: Vec<f64> =
            iterate.iter().zip(&change).map(|(u, r)| u + damping * r).collect();
        let weights = self.weights(&change);
        for ((moved, answered), weight) in self.differences.iter().zip(&weights) {
            for (next, (moved, answered)) in next.iter_mut().zip(moved.iter().zip(answered)) {
                *next -= weight * (moved + damping * answered);
            }
        }
        self.last = Some((iterate, change));
        next
    }

    /// Returns the weights γ that minimise ‖r − Σ γₖ Δrₖ‖ for `change` = r and the stored
    /// differences Δrₖ.
    fn weights(&self, change: &[f64]) -> Vec<f64> {
        let count = self.differences.len();
        let dot = |one: &[f64], other: &[f64]| -> f64 {
            one.iter().zip(other).map(|(one, other)| one * other).sum()
        };
        let answered = |index: usize| &self.differences[index].1;
        let mut gram = DMatrix::from_fn(count, count, |i, j| dot(answered(i), answered(j)));
        let right = DVector::from_fn(count, |i, _| dot(answered(i), change));
        for i in 0..count {
            // The factor regularises the matrix if differences are linearly dependent.
            gram[(i, i)] *= 1.0 + 1e-12;
        }
        match gram.cholesky() {
            Some(factors) => factors.solve(&right).iter().copied().collect(),
            None => vec![0.0; count],
        }
    }
}

/// Argument above which erfc is neglected, because it is below 2e-14.
const NEGLIGIBLE: f64 = 5.4;

/// Periodic elastic half-space under point forces at nodes.
pub struct Body {
    transform: Transform<f64>,
    kernel: Kernel<f64>,
    scratch: Scratch<f64>,
    forces: Vec<f64>,
    displacements: Vec<f64>,
}

impl Body {
    pub fn new(grid: Grid) -> Body {
        let nodes = grid.nodes();
        let [step_x, step_y] = super::steps(grid);
        let transform = Transform::new(nodes);
        // The grid resolves the fewest waves along the axis of the larger step.
        let alpha = PI / step_x.max(step_y) / (2.0 * NEGLIGIBLE);
        let near = near(grid, alpha);
        let columns = transform.spectrum_columns();
        let spectrum = transform.spectrum(&near);
        let per_area = grid.count() as f64 / super::nominal_area(grid);
        let kernel = Kernel::new(nodes, |k_x, k_y| {
            let q = 2.0 * PI * grid.cell().wavenumber([k_x as f64, k_y as f64]);
            let far = if q > 0.0 {
                2.0 * libm::erfc(q / (2.0 * alpha)) / q
            } else {
                -2.0 / (PI.sqrt() * alpha)
            };
            // The near part is even along both axes, so its transform is real.
            spectrum[k_x * columns + k_y].re + per_area * far
        });
        Body {
            forces: vec![0.0; grid.count()],
            displacements: vec![0.0; grid.count()],
            scratch: transform.scratch(),
            transform,
            kernel,
        }
    }

    /// Returns the displacement of each of `nodes` by the forces at the other nodes and by the
    /// periodic images of all forces.
    pub fn displace(
        &mut self,
        nodes: impl Iterator<Item = usize> + Clone,
        forces: &[f64],
    ) -> Vec<f64> {
        self.forces.fill(0.0);
        for (node, force) in nodes.clone().zip(forces) {
            self.forces[node] += force;
        }
        let (transform, kernel) = (&self.transform, &self.kernel);
        transform.convolve(kernel, &self.forces, &mut self.displacements, &mut self.scratch);
        nodes.map(|node| self.displacements[node]).collect()
    }
}

/// Returns the map of Σ erfc(α r)/(π r) over the periodic images of a force at node 0, at the
/// distance r from each image. At r = 0, it returns the limit without the term 1/(π r).
fn near(grid: Grid, alpha: f64) -> Vec<f64> {
    let [nodes_x, nodes_y] = grid.nodes();
    let steps = super::steps(grid);
    let reach = steps.map(|step| (NEGLIGIBLE / (alpha * step)).ceil() as isize);
    let mut values = vec![0.0; grid.count()];
    for i in -reach[0]..=reach[0] {
        for j in -reach[1]..=reach[1] {
            let r = libm::hypot(i as f64 * steps[0], j as f64 * steps[1]);
            let value = if r > 0.0 {
                libm::erfc(alpha * r) / (PI * r)
            } else {
                -2.0 * alpha / libm::pow(PI, 1.5)
            };
            let [i, j] = [(i, nodes_x), (j, nodes_y)]
                .map(|(by, nodes)| by.rem_euclid(nodes as isize) as usize);
            values[i * nodes_y + j] += value;
        }
    }
    values
}

#[cfg(test)]
pub(crate) mod samples {
    use super::*;

    /// Returns G(r) at r = `position` by direct summation of the Ewald sum, with another α.
    pub fn ewald(size: [f64; 2], position: [f64; 2]) -> f64 {
        let alpha = 1.7 / size[0].min(size[1]);
        let area = size[0] * size[1];
        let mut sum = -2.0 * PI.sqrt() / (alpha * area);
        for m in -12..=12 {
            for n in -12..=12 {
                let (m, n) = (f64::from(m), f64::from(n));
                let r = (position[0] + m * size[0]).hypot(position[1] + n * size[1]);
                sum += if r > 0.0 { libm::erfc(alpha * r) / r } else { -2.0 * alpha / PI.sqrt() };
                let (q_x, q_y) = (2.0 * PI * m / size[0], 2.0 * PI * n / size[1]);
                let q = q_x.hypot(q_y);
                if q > 0.0 {
                    let wave = (q_x * position[0] + q_y * position[1]).cos();
                    sum += 2.0 * PI / area * libm::erfc(q / (2.0 * alpha)) / q * wave;
                }
            }
        }
        sum / PI
    }
}

#[cfg(test)]
mod tests {
    use super::samples::ewald;
    use super::*;
    use crate::grid::samples::{rectangle, square};

    #[test]
    fn displacements_are_the_lattice_sum_at_every_node() {
        for (grid, size) in [
            (square(16, 3.0), [1.0, 1.0]),
            (square(64, 1.0), [1.0, 1.0]),
            (rectangle([24, 40], [0.5, 1.0]), [0.5, 1.0]),
        ] {
            let mut body = Body::new(grid);
            let [step_x, step_y] = crate::asperities::steps(grid);
            let nodes: Vec<usize> = (0..grid.count()).collect();
            let mut forces = vec![0.0; grid.count()];
            forces[0] = 1.0;
            let found = body.displace(nodes.iter().copied(), &forces);
            for (node, found) in found.iter().enumerate() {
                let [i, j] = grid.indices(node);
                let known = ewald(size, [i as f64 * step_x, j as f64 * step_y]);
                assert!((found - known).abs() < 1e-11, "{:?}: {found} {known}", [i, j]);
            }
        }
    }

    #[test]
    fn images_of_a_force_in_a_square_cell_raise_it_by_madelungs_constant() {
        // The potential of a square lattice of unit charges in a neutralising background is
        // −3.900264920… divided by the side.
        let own = Body::new(square(32, 1.0)).displace([5].into_iter(), &[1.0])[0];
        assert!((own + 3.900_264_920_001_956 / PI).abs() < 1e-11, "{own}");
    }

    #[test]
    fn near_a_force_the_body_is_boussinesqs() {
        // The contribution of images is even and starts with r².
        let found = Body::new(square(512, 1.0)).displace([0, 3].into_iter(), &[1.0, 0.0]);
        let (own, near, r) = (found[0], found[1], 3.0 / 512.0);
        assert!(((near - own) * PI * r - 1.0).abs() < 5.0 * r * r * r);
    }
}
