//! Mean contact area over sixteen random surfaces, which are pressed in parallel.

#![allow(clippy::print_stdout)]

use asperity_contact::{Contact, Grid, Length, Material, RandomSurface, ReducedPressure, Spectrum};
use rayon::prelude::*;

const SURFACES: u32 = 16;

type Failure = Box<dyn std::error::Error + Send + Sync>;

pub fn main() -> Result<(), Failure> {
    let grid = Grid::square(128, Length::micrometres(100.0))?;
    let random = RandomSurface::with_rms_slope(Spectrum::new(0.8, 4..=16)?, 0.1).seed(1);
    let area = |realization: u32| -> Result<f64, Failure> {
        let surface = random.realization(realization).draw(grid)?;
        let contact = Contact::periodic(&surface, Material::reduced())?;
        Ok(contact.press(ReducedPressure::new(0.05))?.area_fraction())
    };
    let areas = (0..SURFACES).into_par_iter().map(area).collect::<Result<Vec<f64>, _>>()?;
    let mean = areas.iter().sum::<f64>() / f64::from(SURFACES);
    let squares: f64 = areas.iter().map(|area| (area - mean) * (area - mean)).sum();
    let variance = squares / f64::from(SURFACES - 1);
    println!("mean_area_fraction {mean:?} 1");
    println!("standard_error {:?} 1", (variance / f64::from(SURFACES)).sqrt());
    Ok(())
}
