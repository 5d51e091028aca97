//! Expected cost of solving a series of loads.

use std::f64::consts::TAU;
use std::time::{Duration, Instant};

use super::{Body, DEFAULT_TOLERANCE, Elastic};
use crate::elasticity::{self, Factor, PeriodicHalfSpace};
use crate::fft::Transform;
use crate::grid::{Boundary, Cell, Grid};
use crate::threads::Threads;

/// Ratio of the time of an iteration to the time of its transforms: 2.3 on processors with AVX2,
/// and 3.1 on one with AVX-512, whose transforms wait less for memory.
const OVERHEAD: f64 = 2.7;

/// Expected number of transform pairs for a load at the default tolerance.
///
/// 13.5 to 15.5 were counted per load on meshes from 64² to 1024² nodes, and 16.5 on meshes that
/// cannot be halved.
const PAIRS: f64 = 14.5;

/// Expected number of additional pairs each time the tolerance is reduced tenfold, down to 1e-10.
const PAIRS_PER_DECADE: f64 = 2.9;

/// Time for repeated measurements of one pair.
const MEASURING_TIME: Duration = Duration::from_millis(20);

/// Ratio of the solution time with a free boundary to the time with a periodic boundary.
///
/// Loads take 1.2 times as many pairs. Every second pair is on a mesh of twice the nodes along
/// both axes, mostly filled with zeros. The other pairs are on a mesh of 1.25 times the nodes along
/// both axes.
const FREE: f64 = 2.5;

/// Time to read heights and to prepare the solver of a periodic body, in seconds per node. Half of
/// it is the system that provides the memory.
const PREPARATION: f64 = 6.5e-8;

/// Time to compute the kernels of a free half-space and of its coarser meshes, in seconds per node.
const FREE_KERNEL: f64 = 2.7e-7;

/// Ratio of the solution time for a material that yields to the time for an elastic material.
///
/// Under hardnesses of 0.3 and 1 E* × rms slope the number of pairs is 1.1 to 1.3 times as large on
/// 128² nodes, for any tolerance, and 1 to 1.3 times on 1024². Because many iterations take one
/// pair instead of two, the other work of an iteration makes each pair 1.3 times as long.
const YIELDING: f64 = 1.45;

/// Longest side of a mesh whose speed is measured. A larger mesh would take up to seconds and
/// gigabytes, so a part of it is measured.
const LARGEST_MEASURED: usize = 2048;

/// Returns the time to prepare the contact of a surface with a body, in core-seconds.
pub fn preparation_seconds(body: &Body, [nodes_x, nodes_y]: [usize; 2]) -> f64 {
    let of_kernel = match body.elastic.boundary() {
        Boundary::Periodic => 0.0,
        Boundary::Free => FREE_KERNEL,
    };
    (PREPARATION + of_kernel) * nodes_x as f64 * nodes_y as f64
}

/// Returns the expected number of transform pairs for one load. It is the same for all loads and
/// meshes.
///
/// Other work is converted to pairs of the same duration on the mesh of the map.
pub fn pairs_per_load(body: &Body, tolerance: f64) -> f64 {
    let elastic = elastic_pairs(tolerance) * coating_ratio(body.elastic);
    let pairs = elastic * body.hardness.map_or(1.0, |_| YIELDING);
    match body.elastic.boundary() {
        Boundary::Periodic => pairs,
        Boundary::Free => FREE * pairs,
    }
}

/// Returns the ratio of the number of pairs to that on a half-space.
///
/// On a stiff coating it grows with the compliance of the longest wave. On other layers it is taken
/// as one, although thin incompressible ones take up to 1.4 times the pairs.
fn coating_ratio(elastic: Elastic) -> f64 {
    let Elastic::Layer(layer) = elastic else {
        return 1.0;
    };
    let softness = layer.factor(TAU * layer.thickness()) - 1.0;
    1.0 + 0.08 * libm::pow(softness.max(0.0), 0.85)
}

/// Returns the expected number of pairs for one load on an elastic, periodic body.
///
/// Mean numbers over several surfaces differ from it by at most a sixth, on any mesh.
fn elastic_pairs(tolerance: f64) -> f64 {
    let decades = libm::log10(DEFAULT_TOLERANCE / tolerance);
    (PAIRS + PAIRS_PER_DECADE * decades).max(PAIRS_PER_DECADE)
}

/// Measures the time of a transform pair on this machine with a few transforms.
///
/// The result is in core-seconds. It includes the other work of an iteration, as a fixed multiple
/// of the time of the transforms.
pub fn seconds_per_pair(nodes: [usize; 2]) -> f64 {
    let longer = nodes.into_iter().max().filter(|longer| *longer > LARGEST_MEASURED);
    if let Some(longer) = longer {
        let halved = nodes.map(|nodes| if nodes == longer { nodes.div_ceil(2) } else { nodes });
        let parts = nodes.iter().filter(|nodes| **nodes == longer).count();
        return f64::from(1 << parts) * seconds_per_pair(halved);
    }
    let cell = Cell::square(1.0).expect("a side of one");
    let grid = Grid::new(nodes, cell).expect("a mesh has nodes");
    let transform = Transform::<f32>::new(grid.nodes());
    let kernel = elasticity::kernel::<f32>(
        &Threads::one(),
        &PeriodicHalfSpace::new(grid),
        Factor::Stiffness,
    );
    let mut scratch = transform.scratch();
    let field = vec![1.0; grid.count()];
    let mut out = vec![0.0; grid.count()];
    let mut pair = || {
        let begun = Instant::now();
        transform.convolve(&kernel, &field, &mut out, &mut scratch);
        begun.elapsed().as_secs_f64()
    };
    // The first measurement warms the caches. The fastest of several is the least disturbed by
    // other processes.
    pair();
    let begun = Instant::now();
    let mut fastest = pair().min(pair());
    while begun.elapsed() < MEASURING_TIME {
        fastest = fastest.min(pair());
    }
    OVERHEAD * fastest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::elasticity::{Layer, Support};
    use crate::solver::Hardness;

    #[test]
    fn loads_cost_what_was_counted() {
        // Mean counts over two to four spectra, fifteen loads from 0.0012 to 1.7 each.
        for counted in [14.9, 15.3, 15.2, 14.7, 13.8, 13.9, 16.6] {
            let ratio = elastic_pairs(DEFAULT_TOLERANCE) / counted;
            assert!((0.85..1.15).contains(&ratio), "{ratio}");
        }
        // Mean count at 1e-10.
        let ratio = elastic_pairs(1e-10) / 30.3;
        assert!((0.85..1.15).contains(&ratio), "{ratio}");
    }

    #[test]
    fn coatings_cost_what_was_counted() {
        // Mean counts of three loads on 512² nodes, for modulus ratios of 4, 20 and 100.
        for (thickness, counted) in [
            (0.005, [19.7, 30.7, 57.7]),
            (0.02, [15.7, 29.3, 65.3]),
            (0.1, [15.0, 23.0, 33.7]),
            (0.2, [13.0, 15.0, 16.3]),
        ] {
            for (modulus_ratio, counted) in [4.0, 20.0, 100.0].into_iter().zip(counted) {
                let support = Support::HalfSpace { poisson_ratio: 0.3, modulus_ratio };
                let layer = Layer::new(thickness, 0.3, support).unwrap();
                let body = Body { elastic: Elastic::Layer(layer), hardness: None };
                let ratio = pairs_per_load(&body, DEFAULT_TOLERANCE) / counted;
                assert!((0.8..1.25).contains(&ratio), "{thickness}, {modulus_ratio}: {ratio}");
            }
        }
    }

    #[test]
    fn smaller_tolerances_cost_more() {
        let pairs = |tolerance| pairs_per_load(&Body::default(), tolerance);
        assert!(pairs(1e-8) > pairs(5e-5));
        assert!(pairs(1e3) > 0.0);
    }

    #[test]
    fn yielding_and_free_boundaries_cost_more() {
        let cost = |boundary: Boundary, hardness: Option<f64>| {
            let hardness = hardness.map(|pressure| Hardness::new(pressure).unwrap());
            pairs_per_load(&Body { elastic: boundary.into(), hardness }, 5e-5)
        };
        let elastic = cost(Boundary::Periodic, None);
        assert!(cost(Boundary::Periodic, Some(0.3)) > elastic);
        assert!(cost(Boundary::Free, None) > elastic);
        assert!(cost(Boundary::Free, Some(0.3)) > cost(Boundary::Free, None));
    }
}
