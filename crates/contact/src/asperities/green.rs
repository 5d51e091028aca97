//! What point forces at the nodes of a periodic cell do to each other's nodes.
//!
//! A force displaces the surface of a half-space by F/(π E* r) (Boussinesq; Johnson 1985, section 3.2).
//! Repeated with the cell, and counted from its mean over the cell as displacements of periodic
//! half-spaces are, it is Ewald's sum in two dimensions of periodicity, whose two parts are computed where
//! each is short,
//!
//! ```text
//! π G(r) = Σ erfc(α |r + n|)/|r + n|  +  (2π/A) Σ erfc(q/2α)/q cos q·r  −  2√π/(α A)
//! ```
//!
//! the first on the nodes around the force, the second as a factor of each wave that the mesh carries.
//! α is such that waves beyond, and nodes more than 19 steps away, have less than 1e-13 of it: at nodes the
//! sum is exact. What a force does to itself is Hertz' contact, so that 1/r is left out at r = 0; what
//! remains there are the force's own images.

use std::f64::consts::PI;

use crate::fft::{Kernel, Scratch, Transform};
use crate::grid::Grid;

/// erfc of this is 2e-14.
const NEGLIGIBLE: f64 = 5.4;

/// An elastic half-space under forces at nodes.
pub struct Body {
    transform: Transform<f64>,
    kernel: Kernel<f64>,
    scratch: Scratch<f64>,
    forces: Vec<f64>,
    displacements: Vec<f64>,
}

impl Body {
    /// Below the nodes of a grid.
    pub fn new(grid: Grid) -> Body {
        let nodes = grid.nodes();
        let [step_x, step_y] = super::steps(grid);
        let transform = Transform::new(nodes);
        let mut scratch = transform.scratch();
        // The larger step carries the fewest waves.
        let alpha = PI / step_x.max(step_y) / (2.0 * NEGLIGIBLE);
        let near = near(grid, alpha);
        let columns = transform.spectrum_columns();
        let mut spectrum = vec![Default::default(); transform.spectrum_len()];
        transform.forward(&near, &mut spectrum, &mut scratch);
        let per_area = grid.count() as f64 / super::nominal_area(grid);
        let kernel = Kernel::new(nodes, |k_x, k_y| {
            let q = 2.0 * PI * grid.cell().wavenumber([k_x as f64, k_y as f64]);
            let far = match q > 0.0 {
                true => 2.0 * libm::erfc(q / (2.0 * alpha)) / q,
                false => -2.0 / (PI.sqrt() * alpha),
            };
            // The near part is even along both axes: its transform is real.
            spectrum[k_x * columns + k_y].re + per_area * far
        });
        Body {
            forces: vec![0.0; grid.count()],
            displacements: vec![0.0; grid.count()],
            transform,
            kernel,
            scratch,
        }
    }

    /// The displacements at some nodes by the other forces at them.
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

/// erfc(α r)/(π r) around a force at node 0, without 1/(π r) at the force itself.
fn near(grid: Grid, alpha: f64) -> Vec<f64> {
    let [nodes_x, nodes_y] = grid.nodes();
    let steps = super::steps(grid);
    let reach = steps.map(|step| (NEGLIGIBLE / (alpha * step)).ceil() as isize);
    let mut values = vec![0.0; grid.count()];
    for i in -reach[0]..=reach[0] {
        for j in -reach[1]..=reach[1] {
            let r = (i as f64 * steps[0]).hypot(j as f64 * steps[1]);
            let value = match r > 0.0 {
                true => libm::erfc(alpha * r) / (PI * r),
                false => -2.0 * alpha / PI.powf(1.5),
            };
            let [i, j] = [(i, nodes_x), (j, nodes_y)]
                .map(|(by, nodes)| by.rem_euclid(nodes as isize) as usize);
            values[i * nodes_y + j] += value;
        }
    }
    values
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::grid::samples::{rectangle, square};

    /// The same sum with another α, directly.
    fn ewald(size: [f64; 2], place: [f64; 2]) -> f64 {
        let alpha = 1.7 / size[0].min(size[1]);
        let area = size[0] * size[1];
        let mut sum = -2.0 * PI.sqrt() / (alpha * area);
        for m in -12..=12 {
            for n in -12..=12 {
                let (m, n) = (f64::from(m), f64::from(n));
                let r = (place[0] + m * size[0]).hypot(place[1] + n * size[1]);
                sum += match r > 0.0 {
                    true => libm::erfc(alpha * r) / r,
                    false => -2.0 * alpha / PI.sqrt(),
                };
                let (q_x, q_y) = (2.0 * PI * m / size[0], 2.0 * PI * n / size[1]);
                let q = q_x.hypot(q_y);
                if q > 0.0 {
                    let wave = (q_x * place[0] + q_y * place[1]).cos();
                    sum += 2.0 * PI / area * libm::erfc(q / (2.0 * alpha)) / q * wave;
                }
            }
        }
        sum / PI
    }

    #[test]
    fn displacements_are_the_lattice_sum_at_every_node() {
        for (grid, size) in [
            (square(16, 3.0), [1.0, 1.0]),
            (square(64, 1.0), [1.0, 1.0]),
            (rectangle([24, 40], [0.5, 1.0]), [0.5, 1.0]),
        ] {
            let mut body = Body::new(grid);
            let [step_x, step_y] = super::super::steps(grid);
            let nodes: Vec<usize> = (0..grid.count()).collect();
            let mut forces = vec![0.0; grid.count()];
            forces[0] = 1.0;
            let found = body.displace(nodes.iter().copied(), &forces);
            for (node, found) in found.iter().enumerate() {
                let [i, j] = grid.place(node);
                let known = ewald(size, [i as f64 * step_x, j as f64 * step_y]);
                assert!((found - known).abs() < 1e-11, "{:?}: {found} {known}", [i, j]);
            }
        }
    }

    #[test]
    fn images_of_a_force_in_a_square_cell_raise_it_by_madelungs_constant() {
        // Of the square lattice in a neutralizing background: −3.900264920… over the side.
        let own = Body::new(square(32, 1.0)).displace([5].into_iter(), &[1.0])[0];
        assert!((own + 3.900_264_920_001_956 / PI).abs() < 1e-11, "{own}");
    }

    #[test]
    fn near_a_force_the_body_is_boussinesqs() {
        // What images add is even and starts with r².
        let found = Body::new(square(512, 1.0)).displace([0, 3].into_iter(), &[1.0, 0.0]);
        let (own, near, r) = (found[0], found[1], 3.0 / 512.0);
        assert!(((near - own) * PI * r - 1.0).abs() < 5.0 * r * r * r);
    }
}
