//! What a file of surface topography holds.

use std::path::Path;

use serde::{Serialize, Serializer};

use super::{SessionError, UnknownName};
use asperity_report::Raster;
use asperity_stages::surface_files::{LARGEST, SurfaceFileError, read_regular};
use asperity_topography_files::{
    Channel, ChannelError, Corners, HeightMap, Size, Statistics, TopographyFile, read,
};

pub use asperity_topography_files::{HeightStatistics, Quantity};

/// Pixels along the longer side of a picture.
const PICTURE: usize = 1024;

/// A file of surface topography.
#[derive(Debug, Serialize)]
pub struct DescribedFile {
    pub format: &'static str,
    /// What that is.
    #[serde(skip)]
    pub title: &'static str,
    /// Its channels, or the one that was asked for.
    pub channels: Vec<DescribedChannel>,
    /// How many channels it has.
    #[serde(skip)]
    pub count: usize,
    /// The channel that was asked for, or the first that holds heights.
    #[serde(skip)]
    pub chosen: Option<ChosenChannel>,
    /// That channel as a PNG file, if it was to be drawn; missing points are red.
    #[serde(skip)]
    pub picture: Option<Vec<u8>>,
}

/// A channel and what its map is like.
#[derive(Debug, Serialize)]
pub struct DescribedChannel {
    /// From 1 on, in the order of the file.
    #[serde(skip)]
    pub number: usize,
    pub name: String,
    /// Along x and y.
    pub nodes: [usize; 2],
    /// Along x and y, if it is known.
    pub size: Option<[f64; 2]>,
    /// The unit of the size: `m`, or none.
    pub size_unit: Option<&'static str>,
    /// The unit of what it holds.
    pub unit: Option<String>,
    /// Points that are missing.
    pub missing: usize,
    pub rms_height: Option<f64>,
    pub rms_slope: Option<f64>,
    pub lowest: Option<f64>,
    pub highest: Option<f64>,
    #[serde(serialize_with = "corners")]
    pub corners: Corners,
}

/// The channel that counts.
#[derive(Debug)]
pub struct ChosenChannel {
    /// From 1 on, in the order of the file.
    pub number: usize,
    pub name: String,
    pub quantity: Quantity,
}

/// Describes a file and its channels, or the one of this name or number; draws one if that is
/// wanted.
///
/// # Errors
/// When the file cannot be read, or has no such channel.
pub fn describe(
    path: &Path,
    channel: Option<&str>,
    is_drawn: bool,
) -> Result<DescribedFile, SessionError> {
    let bytes = read_regular(path, LARGEST)
        .map_err(|source| SurfaceFileError::Read { path: path.to_owned(), source })?;
    let file = read(&bytes).map_err(|source| SessionError::Topography {
        path: path.to_owned(),
        source: Box::new(source),
    })?;
    let chosen = chosen(&file, channel)?;
    let mut described = Vec::new();
    let mut picture = None;
    for (index, one) in file.channels().iter().enumerate() {
        if channel.is_some() && index != chosen {
            continue;
        }
        // One map at a time: files may have many.
        let map = one.map();
        if is_drawn && index == chosen {
            let raster = Raster::of_heights(map.nodes(), map.heights());
            picture = Some(raster.at_most(PICTURE).to_png());
        }
        described.push(DescribedChannel::of(index + 1, one, &map));
    }
    let format = file.format();
    Ok(DescribedFile {
        format: format.name(),
        title: format.title(),
        channels: described,
        count: file.channels().len(),
        chosen: file.channels().get(chosen).map(|channel| ChosenChannel {
            number: chosen + 1,
            name: channel.name().to_owned(),
            quantity: channel.quantity().clone(),
        }),
        picture,
    })
}

impl DescribedChannel {
    fn of(number: usize, channel: &Channel<'_>, map: &HeightMap) -> DescribedChannel {
        let statistics = Statistics::new(map);
        let heights = statistics.heights.as_ref();
        DescribedChannel {
            number,
            name: channel.name().to_owned(),
            nodes: channel.nodes(),
            size: channel.size().sides(),
            size_unit: matches!(channel.size(), Size::Metres(_)).then_some("m"),
            unit: channel.unit().map(str::to_owned),
            missing: statistics.missing,
            rms_height: heights.map(|heights| heights.rms_height),
            rms_slope: heights.and_then(|heights| heights.rms_slope),
            lowest: heights.map(|heights| heights.lowest),
            highest: heights.map(|heights| heights.highest),
            corners: statistics.corners,
        }
    }
}

/// The channel that is asked for, or the first that holds heights.
fn chosen(file: &TopographyFile<'_>, wanted: Option<&str>) -> Result<usize, SessionError> {
    let Some(wanted) = wanted else {
        return Ok(file.first_heights().unwrap_or_default());
    };
    file.find(wanted).map_err(|error| match &error {
        ChannelError::Unknown { names, .. } => {
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            UnknownName::new(error.to_string(), wanted, &names).into()
        }
        ChannelError::OutOfRange { .. } | ChannelError::Ambiguous { .. } => {
            SessionError::Refused(error.to_string())
        }
    })
}

/// The crate of instruments' formats has no dependency on serde.
fn corners<S: Serializer>(corners: &Corners, serializer: S) -> Result<S::Ok, S::Error> {
    let Corners { first, x_end, y_end, last } = corners;
    let named = [("first", first), ("x_end", x_end), ("y_end", y_end), ("last", last)];
    serializer.collect_map(named)
}
