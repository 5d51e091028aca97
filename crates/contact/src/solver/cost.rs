//! Expected cost of solving a series of loads.

use std::time::{Duration, Instant};

use super::HalfSpace;
use super::nested::is_nested;
use crate::elasticity;
use crate::elasticity::PeriodicHalfSpace;
use crate::fft::Transform;
use crate::grid::{Boundary, Cell, Grid};

/// Ratio of the time of an iteration to the time of its transforms: 2.4 at 512² and 2.3 at 1024².
const OVERHEAD: f64 = 2.3;

/// Expected number of transform pairs for a load that is first solved on coarser meshes: 12 to 15
/// were counted for any load on 512² to 4096² nodes.
const NESTED: f64 = 13.5;

const NESTED_PER_DECADE: f64 = 3.0;

/// Expected number of transform pairs for a load on 256² nodes, without coarser meshes.
const ALONE: f64 = 20.0;

/// Time for repeated measurements of one pair.
const MEASURING_TIME: Duration = Duration::from_millis(20);

/// Relative increase of the number of pairs each time the tolerance is reduced tenfold, down to
/// 1e-10.
const PER_DECADE: f64 = 0.18;

/// Ratio of the time of a transform pair with a free boundary to the time with a periodic boundary.
///
/// Every second pair is on a mesh of twice the nodes along both axes, mostly filled with zeros. The
/// other pairs are on a mesh of 1.25 times the nodes along both axes.
const FREE: f64 = 2.3;

/// Time to compute the kernels of a free half-space, in seconds per node.
const FREE_KERNEL: f64 = 2e-7;

/// Ratio of the solution time for a material that yields to the time for an elastic material.
///
/// Under hardnesses of 0.3 and 1 E* × rms slope the number of pairs is 1.1 to 1.3 times as large on
/// 128² nodes, for any tolerance, and 1 to 1.3 times on 1024². Because many iterations take one
/// pair instead of two, the other work of an iteration makes each pair 1.3 times as long.
const YIELDING: f64 = 1.45;

/// Longest side of a mesh whose speed is measured. A larger mesh would take seconds and gigabytes,
/// so a part of it is measured.
const LARGEST_MEASURED: usize = 2048;

/// Returns the time to prepare a body, in core-seconds; it is negligible for a periodic body.
pub fn preparation_seconds(body: &HalfSpace, [nodes_x, nodes_y]: [usize; 2]) -> f64 {
    match body.boundary {
        Boundary::Periodic => 0.0,
        Boundary::Free => FREE_KERNEL * nodes_x as f64 * nodes_y as f64,
    }
}

/// Returns the expected number of transform pairs for these loads, in units of E* × rms slope.
///
/// Other work is converted to pairs of the same duration on the mesh of the map.
pub fn expected_pairs(body: &HalfSpace, nodes: [usize; 2], loads: &[f64], tolerance: f64) -> f64 {
    let elastic = elastic_pairs(nodes, loads, tolerance);
    let pairs = elastic * body.hardness.map_or(1.0, |_| YIELDING);
    match body.boundary {
        Boundary::Periodic => pairs,
        Boundary::Free => FREE * pairs,
    }
}

/// Tolerance at which the numbers of pairs were measured.
const COUNTED_AT: f64 = 6e-5;

/// Returns the number of decades from [`COUNTED_AT`] down to `tolerance`.
fn decades(tolerance: f64) -> f64 {
    (COUNTED_AT / tolerance).log10()
}

/// Returns the expected number of pairs for an elastic, periodic body.
///
/// The formula is a rough fit to counts on self-affine surfaces, with an error of a tenth for means
/// over several surfaces. On meshes that are solved on coarser meshes first, all loads take the
/// same number of pairs. On smaller meshes, each doubling of the nodes per side adds a tenth.
fn elastic_pairs(nodes: [usize; 2], loads: &[f64], tolerance: f64) -> f64 {
    let cell = Cell::square(1.0).expect("a side of one");
    let nested = Grid::new(nodes, cell).is_ok_and(is_nested);
    let nodes = (nodes[0] as f64 * nodes[1] as f64).sqrt();
    let decades = decades(tolerance);
    let pairs = if nested {
        (NESTED + NESTED_PER_DECADE * decades).max(NESTED_PER_DECADE)
    } else {
        let by_tolerance = (1.0 + PER_DECADE * decades).max(PER_DECADE);
        by_tolerance * ALONE * (nodes / 256.0).powf(0.14)
    };
    pairs * loads.len() as f64
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
    let kernel = elasticity::stiffness::<f32>(&PeriodicHalfSpace::new(grid));
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
    use crate::solver::Hardness;

    fn campaign() -> Vec<f64> {
        let light = (1..=50).map(|i| 0.06 * f64::from(i) / 50.0);
        let heavy = (1..=40).map(|i| 0.06 * (1.7_f64 / 0.06).powf(f64::from(i) / 40.0));
        light.chain(heavy).collect()
    }

    #[test]
    fn the_campaign_costs_what_was_counted() {
        // Mean counts of pairs over three spectra.
        let counts = [(32, 560.0), (128, 760.0), (256, 824.0), (512, 892.0), (1024, 995.0)];
        for (nodes, counted) in counts {
            let ratio = elastic_pairs([nodes; 2], &campaign(), 6e-5) / counted;
            assert!((0.85..1.15).contains(&ratio), "{nodes}: {ratio}");
        }
        // Mean count of three series of loads at 1e-10.
        let ratio = elastic_pairs([1024; 2], &campaign(), 1e-10) / 2100.0;
        assert!((0.85..1.15).contains(&ratio), "{ratio}");
    }

    #[test]
    fn yielding_costs_what_was_counted_to_a_factor_of_two() {
        let loads: Vec<f64> = (1..=10).map(|i| 0.01 * f64::from(i)).collect();
        // Hardnesses of 1 and 0.3 on a surface of 128² nodes, k_lower = 4, k_upper = 32.
        for (boundary, tolerance, counts) in [
            (Boundary::Periodic, 6e-5, [126.0, 115.0]),
            (Boundary::Periodic, 1e-8, [219.0, 226.0]),
            (Boundary::Free, 6e-5, [124.0, 131.0]),
            (Boundary::Free, 1e-8, [232.0, 266.0]),
        ] {
            let hardness = Some(Hardness::new(0.3).unwrap());
            let body = HalfSpace { boundary, hardness };
            let doubled = match boundary {
                Boundary::Periodic => 1.0,
                Boundary::Free => FREE,
            };
            for counted in counts {
                let expected = expected_pairs(&body, [128; 2], &loads, tolerance);
                let ratio = expected / (doubled * counted);
                assert!((0.5..2.0).contains(&ratio), "{body:?}: {ratio}");
            }
        }
    }

    #[test]
    fn few_loads_far_apart_cost_more_each() {
        let light: Vec<f64> = (1..=10).map(|i| 0.006 * f64::from(i)).collect();
        let ratio = 1.7_f64 / 0.06;
        let heavy = (1..=10).map(|i| 0.06 * ratio.powf(0.1 * f64::from(i)));
        let heavy: Vec<f64> = heavy.collect();
        // Mean counts of pairs over ten surfaces with a cutoff at a quarter of the mesh.
        for (nodes, loads, counted) in [
            (32, &light, 87.0),
            (128, &light, 116.0),
            (256, &light, 129.0),
            (32, &heavy, 94.0),
            (128, &heavy, 123.0),
            (256, &heavy, 145.0),
        ] {
            let ratio = elastic_pairs([nodes; 2], loads, 6e-5) / counted;
            assert!((0.85..1.15).contains(&ratio), "{nodes}: {ratio}");
        }
    }

    #[test]
    fn loads_far_apart_cost_as_many_on_all_meshes_that_have_coarser_ones() {
        let three = [0.006, 0.012, 0.018];
        let ratio = 1.7_f64 / 0.004;
        let eight: Vec<f64> = (0..8).map(|i| 0.004 * ratio.powf(f64::from(i) / 7.0)).collect();
        // Mean counts of pairs over three spectra and several surfaces.
        for (nodes, loads, tolerance, counted) in [
            (512, &eight[..], 5e-5, 101.0),
            (1024, &eight, 5e-5, 111.0),
            (1024, &eight, 1e-10, 242.0),
            (2048, &three, 5e-5, 39.0),
            (4096, &three, 5e-5, 43.0),
        ] {
            let ratio = elastic_pairs([nodes; 2], loads, tolerance) / counted;
            assert!((0.85..1.15).contains(&ratio), "{nodes}: {ratio}");
        }
    }

    #[test]
    fn more_loads_and_finer_meshes_cost_more() {
        let loads = campaign();
        assert!(
            elastic_pairs([512; 2], &loads[..10], 6e-5) < elastic_pairs([512; 2], &loads, 6e-5)
        );
        assert!(elastic_pairs([256; 2], &loads, 6e-5) < elastic_pairs([512; 2], &loads, 6e-5));
    }
}
