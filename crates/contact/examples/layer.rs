//! Contact of a rough surface with a coating on a half-space, beside that with the coating alone.

#![allow(clippy::print_stdout)]

use asperity_contact::{Contact, Grid, Layer, Length, Material, Pressure, RandomSurface, Spectrum};

pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let grid = Grid::square(128, Length::micrometres(100.0))?;
    let spectrum = Spectrum::new(0.8, 2..=16)?;
    let surface = RandomSurface::with_rms_slope(spectrum, 0.1).seed(1).draw(grid)?;
    let coating = Material::elastic(Pressure::gigapascals(100.0))?;
    // A coating of 2 µm with four times the shear modulus of its substrate.
    let layer = Layer::on_half_space(Length::micrometres(2.0), 0.3, 4.0, 0.3)?;
    for material in [coating, coating.layer(layer)] {
        let pressed = Contact::periodic(&surface, material)?.press(Pressure::megapascals(500.0))?;
        println!("area_fraction {:?} 1", pressed.area_fraction());
        println!("mean_gap {:?} m", pressed.mean_gap().in_metres());
        println!("peak_pressure {:?} Pa", pressed.peak_pressure().in_pascals());
    }
    Ok(())
}
