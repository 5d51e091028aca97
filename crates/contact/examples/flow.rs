//! Flow of a thin fluid through the gap, until the contact seals it.

#![allow(clippy::print_stdout)]

use asperity_contact::{Contact, Grid, Length, Material, Pressure, RandomSurface, Spectrum};

pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let grid = Grid::square(128, Length::micrometres(100.0))?;
    let spectrum = Spectrum::new(0.8, 2..=16)?;
    let surface = RandomSurface::with_rms_slope(spectrum, 0.1).seed(1).draw(grid)?;
    let contact = Contact::periodic(&surface, Material::elastic(Pressure::gigapascals(100.0))?)?;
    for megapascals in [100.0, 1000.0, 3000.0] {
        let pressed = contact.press(Pressure::megapascals(megapascals))?;
        let flow = pressed.flow()?;
        println!("area_fraction {:?} 1", pressed.area_fraction());
        println!("mean_gap {:?} m", pressed.mean_gap().in_metres());
        for (axis, conductivity) in ["x", "y"].into_iter().zip(flow.conductivities()) {
            println!("conductivity_{axis} {conductivity:?} m³");
        }
        for (axis, factor) in ["x", "y"].into_iter().zip(flow.flow_factors()) {
            println!("flow_factor_{axis} {factor:?} 1");
        }
    }
    Ok(())
}
