//! Elastic body of an adhesive contact, on a mesh on which its stiffness is known exactly.

use super::passes::{Domain, visit};
use crate::elasticity::{Axis, ElasticOperator, Factor};
use crate::fft::{Kernel, Scratch, Transform};
use crate::threads::Threads;

/// Smallest compliance of all waves, as a fraction of that of the shortest wave along both axes. On
/// the doubled mesh of an isolated patch, other waves have 0.91 of it on long rectangles.
const LEAST_OF_SHORTEST: f64 = 0.8;

/// Stiffness and compliance of a body and the heights of the rough surface, which no state changes.
///
/// For a periodic body, the mesh is the map. For an isolated patch, it has twice the nodes along
/// both axes. The nodes outside the map bear no pressure. With these nodes as additional unknowns,
/// the stiffness is the inverse of the compliance wave by wave, also for a free boundary: pressures
/// on the map displace the map exactly as Love's integrals do.
pub struct Body {
    pub domain: Domain,
    /// Heights minus the highest, on the mesh; zero outside the map.
    pub heights: Vec<f64>,
    /// Stiffness of the uniform wave; zero for a body that a uniform pressure does not displace.
    pub uniform_stiffness: f64,
    /// Displacement per unit residual for which a step down the gradient never raises the energy:
    /// no larger than the compliance of any wave.
    pub least_compliance: f64,
    /// True if most heights occur at several nodes, as on every surface with a symmetry.
    pub may_be_symmetric: bool,
    transform: Transform<f64>,
    /// Stiffness p̂/û of all waves except the uniform one, for which the factor is zero.
    stiffness: Kernel<f64>,
    /// Compliance û/p̂ of all waves except the uniform one, for which the factor is zero.
    compliance: Kernel<f64>,
}

impl Body {
    /// Prepares a body, with one height for each node of its grid.
    pub fn new(threads: &Threads, operator: &dyn ElasticOperator, heights: &[f64]) -> Self {
        let domain = Domain { map: operator.grid().nodes(), mesh: operator.convolved_nodes() };
        let highest = heights.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let below: Vec<f64> = heights.iter().map(|height| height - highest).collect();
        let uniform = operator.displacement([0, 0]);
        let [rows, columns] = domain.mesh;
        let shortest = operator.displacement([rows / 2, columns / 2]);
        let factors = |invert: bool| {
            Kernel::from_columns(threads, domain.mesh, |k_y, factors| {
                operator.factors(Factor::Displacement, Axis::X, k_y, factors);
                if k_y == 0 {
                    factors[0] = 0.0;
                }
                if invert {
                    for factor in factors.iter_mut().filter(|factor| **factor != 0.0) {
                        *factor = 1.0 / *factor;
                    }
                }
            })
        };
        Self {
            heights: spread(domain, &below, 0.0),
            uniform_stiffness: if uniform > 0.0 { 1.0 / uniform } else { 0.0 },
            may_be_symmetric: repeats(heights),
            // A mesh of one node has no waves.
            least_compliance: if shortest > 0.0 { LEAST_OF_SHORTEST * shortest } else { 1.0 },
            transform: Transform::new(domain.mesh),
            stiffness: factors(true),
            compliance: factors(false),
            domain,
        }
    }

    /// Returns whether the mesh is larger than the map.
    pub fn is_padded(&self) -> bool {
        self.domain.map != self.domain.mesh
    }

    pub fn scratch(&self, threads: Threads) -> Scratch<f64> {
        self.transform.scratch_on(threads)
    }

    /// Computes the pressures that displace the mesh by `displacement`, except for their mean.
    pub fn stiffness(&self, displacement: &[f64], out: &mut [f64], scratch: &mut Scratch<f64>) {
        self.transform.convolve(&self.stiffness, displacement, out, scratch);
    }

    /// Computes the displacements under `pressure`, except for their mean.
    pub fn compliance(&self, pressure: &[f64], out: &mut [f64], scratch: &mut Scratch<f64>) {
        self.transform.convolve(&self.compliance, pressure, out, scratch);
    }

    /// Returns the mean of `values`, a map on the mesh, over the nodes of the map.
    pub fn mean_on_map(&self, threads: &Threads, values: &[f64]) -> f64 {
        let found = visit(threads, self.domain, [values], [], |site, [value], []| {
            ([], [site.weight * value], [0.0; 0])
        });
        found.sums[0] / self.domain.map_nodes() as f64
    }
}

/// Returns whether at least half of the heights have an equal, up to a billionth of their range.
fn repeats(heights: &[f64]) -> bool {
    let mut sorted = heights.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let small = 1e-9 * (sorted[sorted.len() - 1] - sorted[0]);
    let equal = sorted.windows(2).filter(|pair| pair[1] - pair[0] <= small).count();
    4 * equal >= heights.len()
}

/// Returns the values of a map on the mesh, with `outside` at the other nodes.
pub fn spread(domain: Domain, map: &[f64], outside: f64) -> Vec<f64> {
    let mut mesh = vec![outside; domain.mesh_nodes()];
    for (row, values) in map.chunks_exact(domain.map[1]).enumerate() {
        mesh[row * domain.mesh[1]..][..domain.map[1]].copy_from_slice(values);
    }
    mesh
}

/// Writes the values on the nodes of the map to `map`.
pub fn gather(domain: Domain, mesh: &[f64], map: &mut [f64]) {
    for (row, values) in map.chunks_exact_mut(domain.map[1]).enumerate() {
        values.copy_from_slice(&mesh[row * domain.mesh[1]..][..domain.map[1]]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elasticity::{FreeHalfSpace, PeriodicHalfSpace};
    use crate::grid::samples::{rectangle, square};

    #[test]
    fn no_wave_is_stiffer_than_the_least_compliance() {
        let grids = [square(1, 1.0), square(7, 1.0), square(32, 1.0)];
        let long = [rectangle([64, 8], [1.0, 0.2]), rectangle([16, 16], [1.0, 0.02])];
        for grid in grids.into_iter().chain(long) {
            let bodies: [&dyn ElasticOperator; 2] =
                [&FreeHalfSpace::new(grid), &PeriodicHalfSpace::new(grid)];
            for operator in bodies {
                let body = Body::new(&Threads::one(), operator, &vec![0.0; grid.count()]);
                let [rows, columns] = body.domain.mesh;
                let waves = (0..=rows / 2).flat_map(|x| (0..=columns / 2).map(move |y| [x, y]));
                for waves in waves.filter(|waves| *waves != [0, 0]) {
                    let compliance = operator.displacement(waves);
                    assert!(compliance >= body.least_compliance, "{grid:?} {waves:?}");
                }
            }
        }
    }

    #[test]
    fn every_wave_of_a_free_half_space_has_a_positive_compliance() {
        for grid in
            [square(1, 1.0), square(7, 1.0), square(64, 1.0), rectangle([64, 8], [1.0, 2.0])]
        {
            let body = FreeHalfSpace::new(grid);
            let [most_x, most_y] = grid.nodes();
            for (k_x, k_y) in (0..=most_x).flat_map(|k_x| (0..=most_y).map(move |k_y| (k_x, k_y))) {
                assert!(body.displacement([k_x, k_y]) > 0.0, "{grid:?}: {k_x}, {k_y}");
            }
        }
    }
}
