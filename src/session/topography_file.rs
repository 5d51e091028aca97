//! Description of topography files and their channels.

use std::path::Path;

use serde::{Serialize, Serializer};

use super::{SessionError, UnknownName};
use asperity_mechanics::grid::{Boundary, Cell, Grid};
use asperity_mechanics::topography::surface::Scan;
use asperity_report::Raster;
use asperity_stages::generate::plausibility::DescribedMap;
use asperity_stages::generate::plausibility::EnteredMap;
use asperity_stages::surface_files::{MAX_BYTES, SurfaceFileError};
use asperity_tables::store::regular::read_regular;
use asperity_topography_files::{
    Channel, ChannelError, Corners, HeightMap, Size, Statistics, SuspectNumber, TopographyFile,
    read, read_profile,
};

pub(crate) use asperity_topography_files::Quantity;

/// Maximum number of pixels along the longer side of a picture.
const MAX_PIXELS: usize = 1024;

/// Description of a topography file.
#[derive(Debug, Serialize)]
pub(crate) struct DescribedFile {
    pub(crate) format: &'static str,
    /// Full name of the format.
    #[serde(skip)]
    pub(crate) title: &'static str,
    /// All channels, or only the requested one.
    pub(crate) channels: Vec<DescribedChannel>,
    /// Number of channels in the file.
    #[serde(skip)]
    pub(crate) count: usize,
    /// The requested channel, or the one that is read if none is chosen.
    #[serde(skip)]
    pub(crate) chosen: Option<ChosenChannel>,
    /// The map of the chosen channel in words, if its sides are known and it has heights.
    #[serde(skip)]
    pub(crate) map: Option<String>,
    /// Warnings if the chosen channel was probably read in a wrong unit, or if its slope comes from
    /// noise.
    #[serde(skip)]
    pub(crate) warnings: Vec<String>,
    /// PNG file of the chosen channel, if requested; missing points are red.
    #[serde(skip)]
    pub(crate) picture: Option<Vec<u8>>,
}

/// Description of one channel with statistics of its map.
#[derive(Debug, Serialize)]
pub(crate) struct DescribedChannel {
    /// Position in the file, from 1.
    #[serde(skip)]
    pub(crate) number: usize,
    pub(crate) name: String,
    /// Number of nodes along x and y.
    pub(crate) nodes: [usize; 2],
    /// Side lengths along x and y, if known.
    pub(crate) size: Option<[f64; 2]>,
    /// Unit of the size: `m`, or `None` if the unit is unknown.
    pub(crate) size_unit: Option<&'static str>,
    /// Unit of the values of the map.
    pub(crate) unit: Option<String>,
    /// Number of points without a value.
    pub(crate) missing: usize,
    pub(crate) rms_height: Option<f64>,
    pub(crate) rms_slope: Option<f64>,
    pub(crate) lowest: Option<f64>,
    pub(crate) highest: Option<f64>,
    #[serde(serialize_with = "corners")]
    pub(crate) corners: Corners,
    /// What the reader guessed, and which parts of the file it did not use.
    pub(crate) notes: Vec<String>,
}

/// Channel that is used for heights.
#[derive(Debug)]
pub(crate) struct ChosenChannel {
    /// Position in the file, from 1.
    pub(crate) number: usize,
    pub(crate) name: String,
    pub(crate) quantity: Quantity,
    /// Reason if the channel was not requested and is one of several.
    pub(crate) reason: Option<String>,
}

/// Describes all channels of a file, or only the one with this name or number, and optionally draws
/// the chosen channel.
///
/// # Errors
/// Returns an error if the file cannot be read or has no such channel.
pub(crate) fn describe(
    path: &Path,
    channel: Option<&str>,
    is_drawn: bool,
) -> Result<DescribedFile, SessionError> {
    let bytes = read_regular(path, MAX_BYTES)
        .map_err(|source| SurfaceFileError::Read { path: path.to_owned(), source })?;
    // Text with two columns is a profile only if the user says so; here nothing depends on it.
    let file = read(&bytes).or_else(|source| {
        read_profile(&bytes).map_err(|_| SessionError::Topography {
            path: path.to_owned(),
            source: Box::new(source),
        })
    })?;
    let chosen = chosen(&file, channel)?;
    let mut described = Vec::new();
    let mut warnings = Vec::new();
    let (mut picture, mut in_words) = (None, None);
    for (index, one) in file.channels().iter().enumerate() {
        if channel.is_some() && index != chosen {
            continue;
        }
        // Keep only one map in memory, because files may have many.
        let map = one.map();
        if is_drawn && index == chosen {
            let raster = Raster::from_heights(map.nodes(), map.heights());
            picture = Some(raster.at_most(MAX_PIXELS).to_png());
        }
        let one = DescribedChannel::new(index + 1, one, &map);
        if index == chosen {
            warnings.extend(one.warnings(path));
            if let Some(map) = in_one_line(&file.channels()[index], &map) {
                warnings.extend(map.warning(&format!("`{}`", path.display())));
                in_words = Some(map.to_string());
            }
        }
        described.push(one);
    }
    let format = file.format();
    let default = file.default_channel().filter(|_| channel.is_none());
    Ok(DescribedFile {
        format: format.name(),
        title: format.title(),
        channels: described,
        count: file.channels().len(),
        chosen: file.channels().get(chosen).map(|channel| ChosenChannel {
            number: chosen + 1,
            name: channel.name().to_owned(),
            quantity: channel.quantity().clone(),
            reason: default.filter(|_| file.channels().len() > 1).map(|default| default.reason),
        }),
        map: in_words,
        warnings,
        picture,
    })
}

impl DescribedChannel {
    fn new(number: usize, channel: &Channel<'_>, map: &HeightMap) -> DescribedChannel {
        let statistics = Statistics::new(map);
        let heights = statistics.heights.as_ref();
        let mut notes = channel.notes();
        notes.extend(channel.suspect_number().map(|SuspectNumber { number, count, .. }| {
            format!(
                "{count} points have the number {number:?}, far from all others; see the key \
                 `missing`"
            )
        }));
        let unknown = channel.unknown_side_unit();
        notes
            .extend(unknown.map(|unit| {
                format!("the sides are in `{unit}`, which is no known unit of length")
            }));
        if channel.is_profile() {
            let step = map.steps().map_or_else(String::new, |[step, _]| {
                let unit = channel.unit().map_or_else(String::new, |unit| format!(" {unit}"));
                format!(" with a step of {step:.4e}{unit}")
            });
            notes.push(format!(
                "a profile of {} points{step}: its rms height is Rq, its rms slope RΔq from \
                 neighbouring points; a study reads it with `profile = true`",
                channel.nodes()[0]
            ));
        }
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
            notes,
        }
    }

    /// Returns the warnings of a study with this map, if its heights and sides are in metres.
    fn warnings(&self, path: &Path) -> Vec<String> {
        let grid = self.size.and_then(|size| Grid::new(self.nodes, Cell::new(size).ok()?).ok());
        let known = (grid, self.rms_slope, self.size_unit);
        let (Some(grid), Some(rms_slope), Some(unit)) = known else { return vec![] };
        let height_span = self.highest.unwrap_or_default() - self.lowest.unwrap_or_default();
        let map = EnteredMap { grid, unit, rms_slope, height_span, has_given_sides: false };
        map.warnings(&format!("`{}`", path.display()))
    }
}

/// Describes a map of heights in one line, if its sides are known. It is taken to be not periodic.
/// A profile has a note instead.
fn in_one_line(channel: &Channel<'_>, map: &HeightMap) -> Option<DescribedMap> {
    if channel.is_profile() {
        return None;
    }
    let (size, unit) = match (channel.quantity(), channel.size()) {
        (Quantity::Height, Size::Metres(size)) => (size, "m"),
        (Quantity::Unitless, Size::Unitless(size)) => (size, ""),
        _ => return None,
    };
    let grid = Grid::new(map.nodes(), Cell::new(size).ok()?).ok()?;
    let scan = Scan::new(grid, map.heights().to_vec()).ok()?;
    Some(DescribedMap::new(scan, unit, Boundary::Free))
}

/// Returns the index of the channel `wanted`. If it is `None`, returns the index of the default
/// channel of heights, or 0 if there is none.
fn chosen(file: &TopographyFile<'_>, wanted: Option<&str>) -> Result<usize, SessionError> {
    let Some(wanted) = wanted else {
        return Ok(file.default_channel().map_or(0, |one| one.index));
    };
    file.find(wanted).map_err(|error| match &error {
        ChannelError::Unknown { names, .. } => {
            let all: Vec<&str> = names.iter().map(String::as_str).collect();
            UnknownName::new(error.to_string(), wanted, &all).into()
        }
        _ => SessionError::refused(error.to_string()),
    })
}

/// Serializes the corners of a map. The crate `topography-files` cannot do this, because it does
/// not depend on serde.
fn corners<S: Serializer>(corners: &Corners, serializer: S) -> Result<S::Ok, S::Error> {
    let Corners { first, x_end, y_end, last, .. } = corners;
    let named = [("first", first), ("x_end", x_end), ("y_end", y_end), ("last", last)];
    serializer.collect_map(named)
}
