//! Lists the channels of a file and prints the statistics of each channel.
//!
//! ```sh
//! cargo run -p asperity-topography-files --example channels -- data/topography/di-3.di
//! ```

#![allow(clippy::print_stdout, clippy::print_stderr)]

use std::error::Error;
use std::{env, fs};

use asperity_topography_files::{Size, Statistics, read};

fn main() -> Result<(), Box<dyn Error>> {
    let path = env::args_os().nth(1).ok_or("usage: channels FILE")?;
    let bytes = fs::read(&path)?;
    let file = read(&bytes)?;
    println!("{}: {}", path.display(), file.format().title());
    for (index, channel) in file.channels().iter().enumerate() {
        let unit = channel.unit().unwrap_or("without unit");
        let [x, y] = channel.nodes();
        println!("{}. {}: {x} × {y} nodes", index + 1, channel.name());
        match channel.size() {
            Size::Metres([x, y]) => println!("   sides       {x:e} m × {y:e} m"),
            Size::Unitless([x, y]) => println!("   sides       {x} × {y}, without unit"),
            Size::Unknown => println!("   sides       unknown"),
        }
        let statistics = Statistics::new(&channel.map());
        println!("   missing     {} points", statistics.missing);
        if let Some(heights) = statistics.heights {
            println!("   rms height  {:e} {unit}", heights.rms_height);
            println!("   from        {:e} {unit}", heights.lowest);
            println!("   to          {:e} {unit}", heights.highest);
            if let Some(slope) = heights.rms_slope {
                println!("   rms slope   {slope}");
            }
        }
    }
    Ok(())
}
