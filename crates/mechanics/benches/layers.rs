//! Transform pairs for coatings, incompressible layers and free boundaries, beside a half-space,
//! and the nodes in which contact sets differ from those at a tolerance of 1e-10.
//!
//! ```sh
//! cargo bench -p asperity-mechanics --bench layers -- [NODES]
//! ```

#![allow(clippy::print_stdout)]

use std::time::Instant;

use asperity_mechanics::elasticity::{Base, Layer, Support};
use asperity_mechanics::grid::{Boundary, Grid};
use asperity_mechanics::reduced::ReducedHeights;
use asperity_mechanics::solver::{Body, Elastic, Settings, Stop};
use asperity_mechanics::topography::random::{Amplitude, RandomSurface};
use asperity_mechanics::topography::spectrum::Spectrum;

const THICKNESSES: [f64; 4] = [0.005, 0.02, 0.1, 0.2];
const MODULUS_RATIOS: [f64; 3] = [4.0, 20.0, 100.0];
const LOADS: [f64; 3] = [0.01, 0.05, 0.2];

fn main() {
    // `cargo bench` passes `--bench`; a number sets the nodes per side.
    let nodes = std::env::args().find_map(|argument| argument.parse().ok());
    let nodes: usize = nodes.unwrap_or(512);
    let grid = Grid::square(nodes, 1.0).expect("a mesh has nodes");
    let surface = RandomSurface {
        spectrum: Spectrum {
            hurst: 0.8,
            k_lower: 4,
            k_rolloff: 4,
            k_upper: nodes as u32 / 8,
            anisotropy: None,
        },
        amplitude: Amplitude::Gaussian,
        rms_slope: 1.0,
        seed: 1,
        realization: 0,
    };
    let heights = ReducedHeights::reduced(grid, surface.draw(grid).into_heights())
        .expect("one height per node");
    println!("{nodes}² nodes, H = 0.8, k from 4 to {}, loads {LOADS:?}", nodes / 8);
    println!("   pairs  seconds  body; pairs of each load, and nodes unlike those at 1e-10");
    for (name, elastic) in bodies() {
        let body = Body { elastic, hardness: None };
        let mut solver = body.solver(&heights);
        let begun = Instant::now();
        let solved = LOADS.map(|load| {
            let outcome = solver.press(load, &Settings::default(), &|| false);
            let contact: Vec<bool> = solver.pressure().iter().map(|p| *p > 0.0).collect();
            (outcome, contact)
        });
        let seconds = begun.elapsed().as_secs_f64() / LOADS.len() as f64;
        let pairs: u32 = solved.iter().map(|(outcome, _)| outcome.pairs).sum();
        print!("{:8.1} {seconds:8.3}  {name};", f64::from(pairs) / LOADS.len() as f64);
        for ((outcome, contact), load) in solved.iter().zip(LOADS) {
            let exact = Settings { tolerance: 1e-10, ..Settings::default() };
            solver.press(load, &exact, &|| false);
            let nodes = contact.iter().zip(solver.pressure());
            let wrong = nodes.filter(|(contact, p)| **contact != (**p > 0.0)).count();
            let failed = if outcome.stop == Stop::PairLimit { " (not converged)" } else { "" };
            print!("  {}{failed}, {wrong}", outcome.pairs);
        }
        println!();
    }
}

fn bodies() -> Vec<(String, Elastic)> {
    let mut bodies = vec![
        ("half-space".to_owned(), Elastic::default()),
        ("free boundary".to_owned(), Boundary::Free.into()),
    ];
    for thickness in THICKNESSES {
        let layer = |poisson_ratio, support| {
            Elastic::Layer(Layer::new(thickness, poisson_ratio, support).expect("a valid layer"))
        };
        bodies.push((
            format!("ν = ½ on a rigid base, thickness {thickness}"),
            layer(0.5, Support::Rigid(Base::Bonded)),
        ));
        for modulus_ratio in MODULUS_RATIOS {
            let support = Support::HalfSpace { poisson_ratio: 0.3, modulus_ratio };
            bodies.push((
                format!("coating, modulus ratio {modulus_ratio}, thickness {thickness}"),
                layer(0.3, support),
            ));
        }
    }
    bodies
}
