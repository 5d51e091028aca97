//! From the file of an instrument to the contact area of an isolated patch.

#![allow(clippy::print_stdout)]

use asperity_contact::{Contact, Fill, Form, Grid, Length, Material, MeasuredMap, Pressure};
use asperity_topography_files::read;

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/topography/datx-1.datx");

pub fn main() -> Result<(), Box<dyn std::error::Error>> {
    let bytes = std::fs::read(FILE)?;
    let file = read(&bytes)?;
    let chosen = file.default_channel().ok_or("the file has no channel of heights")?;
    let map = file.channels()[chosen.index].map();
    let sides = map.size().sides().ok_or("the file gives no sides")?;
    let grid = Grid::new(map.nodes(), sides.map(Length::metres))?;
    let (heights, _) = map.into_parts();
    let map = MeasuredMap::new(grid, heights, Length::metres(1.0))?;
    let surface = map.level(Form::Plane).fill(Fill::Harmonic).surface()?;
    println!("rms_slope {:?} 1", surface.rms_slope());

    let contact = Contact::isolated(&surface, Material::elastic(Pressure::gigapascals(100.0))?)?;
    let pressed = contact.press(Pressure::megapascals(20.0))?;
    println!("area_fraction {:?} 1", pressed.area_fraction());
    println!("mean_gap {:?} m", pressed.mean_gap().in_metres());
    println!("peak_pressure {:?} Pa", pressed.peak_pressure().in_pascals());
    println!("spots {:?} 1", pressed.spots().len());
    Ok(())
}
