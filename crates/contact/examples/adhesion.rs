//! Adhesive contact: approach to a pressure, tension, and pull-off.

#![allow(clippy::print_stdout)]

use asperity_contact::{Adhesion, AdhesiveContact, EnergyPerArea, Grid, Length, Material};
use asperity_contact::{Pressure, RandomSurface, Spectrum};

pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let grid = Grid::square(64, Length::nanometres(400.0))?;
    let spectrum = Spectrum::new(0.8, 1..=4)?;
    let surface = RandomSurface::with_rms_slope(spectrum, 0.05).seed(3).draw(grid)?;
    let material = Material::elastic(Pressure::gigapascals(10.0))?;
    let work = EnergyPerArea::joules_per_square_metre(0.05);
    let adhesion = Adhesion::new(work, Length::nanometres(2.0))?;
    let mut contact = AdhesiveContact::periodic(&surface, material, adhesion)?;
    for megapascals in [0.0, 10.0, 20.0, 10.0, 0.0, -5.0] {
        let state = contact.press(Pressure::megapascals(megapascals))?;
        println!("contact_fraction {:?} 1", state.contact_fraction());
        println!("repulsive_fraction {:?} 1", state.repulsive_fraction());
        if let Some(gap) = state.mean_gap() {
            println!("mean_gap {:?} m", gap.in_metres());
        }
        if let Some(pressure) = state.pull_off_pressure() {
            println!("pull_off_pressure {:?} Pa", pressure.in_pascals());
        }
    }
    Ok(())
}
