//! Benchmark of the flow through the gap of a contact: CPU seconds of each load beside those of the
//! contact and in pairs of transforms of the contact, conductivities and their bounds.
//!
//! ```sh
//! cargo bench -p asperity-mechanics --bench flow -- 1024 [FOLDER]
//! ```
//!
//! The gaps under each load are written to FOLDER, if it is given, as little-endian numbers of
//! double precision. `benches/flow.py` solves them with pyamg.

#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::fs;
use std::path::PathBuf;

use asperity_mechanics::elasticity::PeriodicHalfSpace;
use asperity_mechanics::flow::flow_through;
use asperity_mechanics::grid::Grid;
use asperity_mechanics::reduced::ReducedHeights;
use asperity_mechanics::solver::{Settings, Solver};
use asperity_mechanics::topography::random::{Amplitude, RandomSurface};
use asperity_mechanics::topography::spectrum::Spectrum;

const LOADS: [f64; 6] = [0.01, 0.02, 0.05, 0.1, 0.2, 0.4];

fn main() {
    let arguments: Vec<String> =
        std::env::args().skip(1).filter(|word| word != "--bench").collect();
    let nodes: usize = arguments.first().map_or(1024, |word| word.parse().expect("nodes per side"));
    let folder = arguments.get(1).map(PathBuf::from);
    println!("   load  contact     flow  ratio  pairs  conductivities along x and y, bounds");
    let grid = Grid::square(nodes, 1.0).expect("a mesh has nodes");
    let spectrum = Spectrum { hurst: 0.8, k_lower: 4, k_rolloff: 4, k_upper: 64, anisotropy: None };
    let amplitude = Amplitude::Gaussian;
    let surface = RandomSurface { spectrum, amplitude, rms_slope: 1.0, seed: 1, realization: 0 };
    let heights = ReducedHeights::reduced(grid, surface.draw(grid).into_heights())
        .expect("one height per node");
    let mut solver = Solver::new(PeriodicHalfSpace::new(grid), &heights);
    let mut total = [0.0; 2];
    for load in LOADS {
        let start = cpu_seconds();
        let pairs = solver.press(load, &Settings::default(), &|| false).pairs;
        let contact = cpu_seconds() - start;
        let pressure = solver.pressure().to_vec();
        let mut gap = solver.gap_under(&pressure);
        for (gap, pressure) in gap.iter_mut().zip(&pressure) {
            *gap = if *pressure > 0.0 { 0.0 } else { *gap };
        }
        if let Some(folder) = &folder {
            let bytes: Vec<u8> = gap.iter().flat_map(|gap| gap.to_le_bytes()).collect();
            let name = format!("gap-{nodes}-{load}.f64");
            fs::write(folder.join(name), bytes).expect("the folder exists");
        }
        let start = cpu_seconds();
        let flows = flow_through(grid, &gap);
        let flow = cpu_seconds() - start;
        let flows = flows.map(|flow| match flow {
            Ok(flow) => format!("{:.10e} {:.1e}", flow.conductivity, flow.residual),
            Err(unconverged) => format!("unconverged {:.1e}", unconverged.residual),
        });
        let ratio = flow / contact;
        let flows = flows.join("  ");
        println!(
            "{load:7} {contact:8.2} {flow:8.2} {ratio:6.1} {:6.0}  {flows}",
            ratio * f64::from(pairs)
        );
        total = [total[0] + contact, total[1] + flow];
    }
    println!("    all {:8.2} {:8.2} {:6.1}", total[0], total[1], total[1] / total[0]);
}

/// Returns the CPU time of all threads in seconds.
fn cpu_seconds() -> f64 {
    let statistics = fs::read_to_string("/proc/self/stat").expect("the system is Linux");
    let (_, fields) = statistics.rsplit_once(") ").expect("the name is in parentheses");
    let ticks = fields.split(' ').skip(11).take(2).map(|field| field.parse::<f64>());
    // User and system time, in hundredths of a second.
    ticks.map(|ticks| ticks.expect("a number of ticks")).sum::<f64>() / 100.0
}
