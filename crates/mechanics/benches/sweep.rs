//! Benchmark of loads that are solved alone: transform pairs of each load, and seconds, compared
//! with bare transform pairs. It also solves ten loads on other bodies, and on several threads.

#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::num::NonZeroUsize;
use std::time::Instant;

use asperity_mechanics::elasticity::{Factor, PeriodicHalfSpace, kernel};
use asperity_mechanics::fft::Transform;
use asperity_mechanics::grid::{Boundary, Grid};
use asperity_mechanics::reduced::ReducedHeights;
use asperity_mechanics::solver::{Body, Hardness, Settings, Solver};
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::random::{Amplitude, RandomSurface};
use asperity_mechanics::topography::spectrum::Spectrum;

/// Cutoffs of the spectra, k_lower and k_upper.
const SPECTRA: [(u32, u32); 4] = [(1, 32), (4, 64), (16, 128), (4, 32)];

fn main() {
    // `cargo bench` passes `--bench`; a number sets the nodes per side.
    let nodes = std::env::args().find_map(|argument| argument.parse().ok());
    let nodes: usize = nodes.unwrap_or(1024);
    println!("{nodes}² nodes, H = 0.8, every sixth of 90 loads to 1.7 E* × rms slope");
    println!("k_lower  k_upper   pairs  seconds  ms a pair  of bare pairs  pairs of each load");
    for (k_lower, k_upper) in SPECTRA {
        let grid = Grid::square(nodes, 1.0).expect("a mesh has nodes");
        let heights = heights(grid, k_lower, k_upper);
        let mut solver = Solver::new(PeriodicHalfSpace::new(grid), &heights);
        let before = bare_pair(grid);
        let (pairs, seconds) = press(&mut solver, loads().step_by(6));
        let bare = 0.5 * (before + bare_pair(grid));
        let total: u32 = pairs.iter().sum();
        let pair = seconds / f64::from(total);
        println!(
            "{k_lower:7} {k_upper:8} {total:7} {seconds:8.2} {:10.2} {:14.2}  {pairs:?}",
            1e3 * pair,
            pair / bare
        );
    }
    println!("\nten loads to 0.1 E* × rms slope, spectrum 4 to {}", nodes / 16);
    println!("   pairs  seconds  ratio");
    let mut elastic = None;
    for (name, body) in bodies() {
        let (pairs, seconds) = ten_loads(nodes, body, Threads::one());
        let ratio = seconds / *elastic.get_or_insert(seconds);
        println!("{pairs:8} {seconds:8.2} {ratio:6.2}  {name}");
    }
    println!("\nthe same on several threads\n threads  seconds  speed");
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut alone = None;
    for count in (1..=cores).filter(|count| count.is_power_of_two() || *count == cores) {
        let threads = NonZeroUsize::new(count).expect("one or more");
        let threads = Threads::new(threads);
        let (_, seconds) = ten_loads(nodes, Body::default(), threads);
        let speed = *alone.get_or_insert(seconds) / seconds;
        println!("{count:8} {seconds:8.2} {speed:6.2}");
    }
}

fn bodies() -> [(&'static str, Body); 5] {
    let body = |boundary: Boundary, hardness: Option<f64>| Body {
        elastic: boundary.into(),
        hardness: hardness.map(|pressure| Hardness::new(pressure).expect("a pressure")),
    };
    [
        ("periodic", body(Boundary::Periodic, None)),
        ("hardness 1", body(Boundary::Periodic, Some(1.0))),
        ("hardness 0.3", body(Boundary::Periodic, Some(0.3))),
        ("free", body(Boundary::Free, None)),
        ("free, hardness 0.3", body(Boundary::Free, Some(0.3))),
    ]
}

/// Returns the transform pairs and the seconds that ten loads took.
fn ten_loads(nodes: usize, body: Body, threads: Threads) -> (u32, f64) {
    let grid = Grid::square(nodes, 1.0).expect("a mesh has nodes");
    let mut solver = body.solver(&heights(grid, 4, nodes as u32 / 16));
    solver.set_threads(threads);
    let (pairs, seconds) = press(&mut solver, (1..=10).map(|i| 0.01 * f64::from(i)));
    (pairs.iter().sum(), seconds)
}

/// Returns the transform pairs of each load, and the seconds that all loads took.
fn press(solver: &mut Solver, loads: impl Iterator<Item = f64>) -> (Vec<u32>, f64) {
    let begun = Instant::now();
    let outcomes = loads.map(|load| solver.press(load, &Settings::default(), &|| false));
    let pairs = outcomes.map(|outcome| outcome.pairs).collect();
    (pairs, begun.elapsed().as_secs_f64())
}

/// Returns the loads of the 2015 campaign: fifty linear, forty geometric.
fn loads() -> impl Iterator<Item = f64> {
    let light = (1..=50).map(|i| 0.06 * f64::from(i) / 50.0);
    let heavy = (1..=40).map(|i| 0.06 * libm::pow(1.7 / 0.06, f64::from(i) / 40.0));
    light.chain(heavy)
}

fn heights(grid: Grid, k_lower: u32, k_upper: u32) -> ReducedHeights {
    let surface = RandomSurface {
        spectrum: Spectrum { hurst: 0.8, k_lower, k_rolloff: k_lower, k_upper, anisotropy: None },
        amplitude: Amplitude::Gaussian,
        rms_slope: 1.0,
        seed: 2015,
        realization: 0,
    };
    ReducedHeights::reduced(grid, surface.draw(grid).into_heights()).expect("one height per node")
}

/// Returns the median seconds of a single-precision pair of transforms.
fn bare_pair(grid: Grid) -> f64 {
    let transform = Transform::<f32>::new(grid.nodes());
    let kernel = kernel(&Threads::one(), &PeriodicHalfSpace::new(grid), Factor::Displacement);
    let field = vec![1.0; grid.count()];
    let mut out = field.clone();
    let mut scratch = transform.scratch();
    let mut seconds: Vec<f64> = (0..101)
        .map(|_| {
            let begun = Instant::now();
            transform.convolve(&kernel, &field, &mut out, &mut scratch);
            begun.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    seconds[50]
}
