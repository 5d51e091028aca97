//! Presses a random rough surface: contact area, mean gap and peak pressure under three loads.

#![allow(clippy::print_stdout)]

use asperity_contact::{Contact, Grid, Length, Material, Pressure, RandomSurface, Spectrum};

pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let grid = Grid::square(128, Length::micrometres(100.0))?;
    let spectrum = Spectrum::new(0.8, 2..=16)?;
    let surface = RandomSurface::with_rms_slope(spectrum, 0.1).seed(1).draw(grid)?;
    let contact = Contact::periodic(&surface, Material::elastic(Pressure::gigapascals(100.0))?)?;
    for megapascals in [100.0, 500.0, 1000.0] {
        let pressed = contact.press(Pressure::megapascals(megapascals))?;
        println!("mean_pressure {:?} Pa", pressed.mean_pressure().in_pascals());
        println!("load {:?} E* × rms slope", pressed.load().value());
        println!("area_fraction {:?} 1", pressed.area_fraction());
        println!("mean_gap {:?} m", pressed.mean_gap().in_metres());
        println!("peak_pressure {:?} Pa", pressed.peak_pressure().in_pascals());
        println!("elastic_energy {:?} J/m²", pressed.elastic_energy().in_joules_per_square_metre());
    }
    Ok(())
}
