//! Solves the contact of a rough surface under nine loads, and compares the contact area with
//! Persson's theory.
//!
//! ```sh
//! cargo run --release -p asperity-contact --example press
//! ```

#![allow(clippy::print_stdout, clippy::print_stderr)]

use asperity_mechanics::elasticity::PeriodicHalfSpace;
use asperity_mechanics::grid::{Grid, GridError};
use asperity_mechanics::morphology::area::ContactArea;
use asperity_mechanics::morphology::map::ContactMap;
use asperity_mechanics::solver::{Settings, Solver};
use asperity_mechanics::theory::persson;
use asperity_mechanics::topography::random::{Amplitude, RandomSurface};
use asperity_mechanics::topography::spectrum::Spectrum;

fn main() -> Result<(), GridError> {
    let grid = Grid::square(512, 1.0)?;
    let spectrum = Spectrum { hurst: 0.8, k_lower: 4, k_rolloff: 4, k_upper: 64, anisotropy: None };
    let amplitude = Amplitude::Gaussian;
    let surface = RandomSurface { spectrum, amplitude, rms_slope: 1.0, seed: 1, realization: 0 };
    let mut solver = Solver::new(PeriodicHalfSpace::new(grid), surface.draw(grid).heights());

    println!("p0/(E* h')   A/A0   Persson   mean gap/L     pairs");
    for load in [0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0] {
        let outcome = solver.press(load, &Settings::default(), &|| false);
        let map = ContactMap::from_pressures(grid.nodes(), solver.pressure());
        let area = ContactArea::from_map(&map).fraction();
        let (theory, gap) = (persson::area(load), outcome.mean_gap);
        println!("{load:10} {area:6.4} {theory:9.4} {gap:12.3e} {:9}", outcome.pairs);
    }
    Ok(())
}
