//! `asperity surface`: what a file of surface topography holds, and a picture of it.

mod words;

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use serde_json::{Value, json};

use self::words::write_summary;
use super::terminal::stdout;
use super::{Failure, Misused, picture_file, unknown};
use asperity_report::charts::raster::Raster;
use asperity_stages::surface_files::{LARGEST, SurfaceFileError, read_regular};
use asperity_topography_files::{
    Channel, ChannelError, HeightMap, Size, Statistics, TopographyFile, TopographyFileError, read,
};

/// Pixels along the longer side of a picture.
const PICTURE: usize = 1024;

#[derive(clap::Args)]
pub struct Arguments {
    /// A file of surface topography; its content says which format it has.
    #[arg(value_name = "FILE")]
    file: PathBuf,

    /// Only this channel, by its name, or by its number from 1 on; when left out, all are listed.
    #[arg(long)]
    channel: Option<String>,

    /// Draw the channel, or the first that holds heights; missing points are red.
    #[arg(long, short, value_name = "FILE.png")]
    output: Option<PathBuf>,

    /// Overwrite another picture. Files other than PNG are never overwritten.
    #[arg(long, requires = "output")]
    replace: bool,

    /// Print JSON: `{"format", "channels": [{"name", "nodes", "size", "unit", "missing",
    /// "rms_height", "rms_slope", "lowest", "highest", "corners"}]}`, sizes as `[x, y]`, and lengths
    /// in metres where the file has a unit.
    #[arg(long)]
    json: bool,
}

/// A file that is there is none that can be read.
#[derive(Debug, thiserror::Error)]
#[error("cannot read surface file `{}`", path.display())]
struct Unreadable {
    path: PathBuf,
    source: TopographyFileError,
}

/// A channel and what its map is like.
struct Described<'a> {
    /// From 1 on, in the order of the file.
    number: usize,
    channel: &'a Channel<'a>,
    statistics: Statistics,
}

pub fn run(arguments: &Arguments) -> Result<ExitCode, Failure> {
    let path = &arguments.file;
    let bytes = read_regular(path, LARGEST)
        .map_err(|source| SurfaceFileError::Read { path: path.clone(), source })?;
    let file = read(&bytes).map_err(|source| Unreadable { path: path.clone(), source })?;
    let chosen = chosen(&file, arguments.channel.as_deref())?;
    let listed: Vec<usize> = match arguments.channel {
        Some(_) => vec![chosen],
        None => (0..file.channels().len()).collect(),
    };
    let mut described = Vec::new();
    for index in listed {
        let channel = &file.channels()[index];
        // One map at a time: files may have many.
        let map = channel.map();
        if let Some(output) = arguments.output.as_ref().filter(|_| index == chosen) {
            picture_file::write(output, &draw(&map), arguments.replace)?;
        }
        described.push(Described { number: index + 1, channel, statistics: Statistics::of(&map) });
    }
    let mut out = stdout();
    match arguments.json {
        true => writeln!(out, "{:#}", as_json(&file, &described))?,
        false => {
            write_summary(&mut out, &file, path, &described, chosen)?;
            if let Some(output) = &arguments.output {
                writeln!(out, "picture  {}", output.display())?;
            }
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The channel that is asked for, or the first that holds heights.
fn chosen(file: &TopographyFile<'_>, wanted: Option<&str>) -> Result<usize, Failure> {
    let Some(wanted) = wanted else {
        return Ok(file.first_heights().unwrap_or_default());
    };
    file.find(wanted).map_err(|error| match &error {
        ChannelError::Unknown { names, .. } => {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            unknown(error.to_string(), wanted, &names)
        }
        ChannelError::Beyond { .. } | ChannelError::Ambiguous { .. } => {
            Misused(error.to_string()).into()
        }
    })
}

fn draw(map: &HeightMap) -> Vec<u8> {
    let picture = Raster::of_heights(map.nodes(), map.heights());
    picture.at_most(PICTURE).to_png()
}

fn as_json(file: &TopographyFile<'_>, described: &[Described<'_>]) -> Value {
    let channels = described.iter().map(|one| {
        let channel = one.channel;
        let heights = one.statistics.heights.as_ref();
        let corners = &one.statistics.corners;
        json!({
            "name": channel.name(),
            "nodes": channel.nodes(),
            "size": channel.size().sides(),
            "size_unit": matches!(channel.size(), Size::Metres(_)).then_some("m"),
            "unit": channel.unit(),
            "missing": one.statistics.missing,
            "rms_height": heights.map(|heights| heights.rms_height),
            "rms_slope": heights.and_then(|heights| heights.rms_slope),
            "lowest": heights.map(|heights| heights.lowest),
            "highest": heights.map(|heights| heights.highest),
            "corners": {
                "first": corners.first,
                "x_end": corners.x_end,
                "y_end": corners.y_end,
                "last": corners.last,
            },
        })
    });
    json!({
        "format": file.format().name(),
        "channels": channels.collect::<Value>(),
    })
}
