//! Height maps in files, before their preparation.
//!
//! NumPy arrays have no unit and no sides, and their recipes name no reader. The recipes of all
//! other formats contain the format and the version of its reader. A map is therefore read again
//! after its reader has been corrected.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::version::{PartVersion, Version};
use asperity_mechanics::grid::{Cell, Grid};
use asperity_mechanics::topography::surface::{Scan, SurfaceError, check_range};
use asperity_topography_files::{
    ChannelError, NpyError, Quantity, Size, SuspectNumber, TopographyFileError, formats, is_marker,
    npy_array, npy_line, read, read_profile,
};

/// The reader of a file format, as recipes name it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reader {
    /// Name of the file format.
    pub format: String,
    /// Version of the reader of this format.
    pub version: u32,
}

/// Number or name of the map to read from a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum ChannelChoice {
    /// The number of the map in the file, starting at 1.
    Number(#[schemars(range(min = 1, max = u16::MAX))] u32),
    /// The name of the map in the file.
    Name(String),
}

/// Which map of a file is read, and which of its points are missing.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct MapChoice {
    /// Number or name of the map; `None` for the default map of heights.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub channel: Option<ChannelChoice>,
    /// Number in the file that marks missing points, beside the marker of the format.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub missing: Option<f64>,
    /// True if points under a mask that a user of the file drew keep their heights. Omitted from
    /// recipes if false, so that existing keys stay valid.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub ignores_mask: bool,
    /// True if the file is read as a profile. Omitted from recipes of maps, so that existing keys
    /// stay valid.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub profile: bool,
    /// Number of the line of a map that is read as a profile, from 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub line: Option<u32>,
}

/// A height map as read from a file.
#[derive(Debug, Clone)]
pub struct MapFile {
    /// Reader of the file format; `None` for a NumPy array.
    pub reader: Option<Reader>,
    /// Name and number of this map in the file.
    pub channel: ChannelRead,
    /// Physical quantity of the values of the map.
    pub quantity: Quantity,
    /// Sides of the map; `Size::Unknown` if the file gives none.
    pub size: Size,
    /// Unit that the file gives for the sides, if it is no known unit of length.
    pub unknown_side_unit: Option<String>,
    /// Number in the file that probably marks missing points.
    pub suspect: Option<SuspectNumber>,
    /// Number of nodes along x and y.
    pub nodes: [usize; 2],
    /// What the reader guessed, and which parts of the file it did not use.
    pub notes: Vec<String>,
    /// Heights of the nodes, row-major. Points that were not measured are not finite.
    pub heights: Vec<f64>,
}

/// Name and number of the map that was read from a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChannelRead {
    /// Number of the map in the file, starting at 1.
    pub number: usize,
    /// Name of the map in the file.
    pub name: String,
    /// Number of maps in the file.
    pub of: usize,
    /// Reason for this map if none was chosen.
    pub reason: Option<String>,
}

/// An error of reading a height map from a file. The message is shown after the path.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum MapFileError {
    #[error(transparent)]
    Npy(NpyError),
    #[error(transparent)]
    Format(Box<TopographyFileError>),
    #[error(transparent)]
    Channel(ChannelError),
    #[error("the file has no channel of heights; its channels are {}", channels.join(", "))]
    NoHeights {
        /// Names and units of the channels.
        channels: Vec<String>,
    },
    #[error("the file does not contain the sides of its map; set `side`")]
    NoSize,
    #[error("the file holds a profile, not a map; set `profile = true`")]
    Profile,
    #[error(
        "the file holds a map of {} × {} points, not a profile; choose one of its lines by `line`",
        nodes[0], nodes[1]
    )]
    NoProfile {
        /// Numbers of points along x and y.
        nodes: [usize; 2],
    },
    #[error("the map has {lines} lines, but `line` is {line}")]
    NoLine {
        /// Number of the line that was requested.
        line: u32,
        /// Number of lines of the map.
        lines: usize,
    },
    #[error(transparent)]
    Surface(#[from] SurfaceError),
}

impl Reader {
    /// Returns the current reader of a format. An unknown format has version 0.
    pub fn of_format(name: &str) -> Reader {
        let format = formats().iter().find(|format| format.name() == name);
        Reader { format: name.to_owned(), version: format.map_or(0, |format| format.version()) }
    }

    /// Returns the version of the reader with its reasons, unless the format is unknown.
    pub fn part_version(&self) -> Option<PartVersion> {
        let format = formats().iter().find(|format| format.name() == self.format)?;
        let version = Version::new(1, format.changes());
        Some(PartVersion::new("reader", format!("reader `{}`", self.format), version))
    }
}

/// Formats the number or the name as in a manifest.
impl std::fmt::Display for ChannelChoice {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ChannelChoice::Number(number) => write!(formatter, "{number}"),
            ChannelChoice::Name(name) => formatter.write_str(name),
        }
    }
}

impl MapFile {
    /// Reads a map of a file.
    ///
    /// # Errors
    /// If the format is unknown, the file is damaged, or it has no such map.
    pub fn read(bytes: &[u8], choice: &MapChoice) -> Result<MapFile, MapFileError> {
        let map = MapFile::read_any(bytes, choice)?;
        if choice.profile || choice.line.is_some() {
            return map.profile(choice.line);
        }
        // Arrays and matrices with one line were refused for their size before profiles were read.
        let is_profile = map.nodes[1] == 1 && map.nodes[0] > 1;
        if is_profile { Err(MapFileError::Profile) } else { Ok(map) }
    }

    /// Returns the map as a profile, or the profile along a line of it.
    fn profile(self, line: Option<u32>) -> Result<MapFile, MapFileError> {
        let [nodes_x, nodes_y] = self.nodes;
        let (nodes, index) = match (line, nodes_x, nodes_y) {
            (Some(line), ..) if !(1..=nodes_y).contains(&(line as usize)) => {
                return Err(MapFileError::NoLine { line, lines: nodes_y });
            }
            (Some(line), ..) => (nodes_x, line as usize - 1),
            (None, _, 1) => (nodes_x, 0),
            // A row of numbers in an array [x, y].
            (None, 1, _) => return Ok(MapFile { nodes: [nodes_y, 1], ..self }.of_steps(1)),
            (None, ..) => return Err(MapFileError::NoProfile { nodes: self.nodes }),
        };
        let heights = (0..nodes).map(|i| self.heights[i * nodes_y + index]).collect();
        Ok(MapFile { nodes: [nodes, 1], heights, ..self }.of_steps(0))
    }

    /// Returns the profile with the side of the map along an axis, and one step across.
    fn of_steps(self, axis: usize) -> MapFile {
        let along = |sides: [f64; 2]| [sides[axis], sides[axis] / self.nodes[0] as f64];
        let size = match self.size {
            Size::Metres(sides) => Size::Metres(along(sides)),
            Size::Unitless(sides) => Size::Unitless(along(sides)),
            Size::Unknown => Size::Unknown,
        };
        MapFile { size, ..self }
    }

    fn read_any(bytes: &[u8], choice: &MapChoice) -> Result<MapFile, MapFileError> {
        let &MapChoice { ref channel, missing, ignores_mask, profile, line: _ } = choice;
        if bytes.starts_with(b"\x93NUMPY") {
            return MapFile::read_npy(bytes, channel.as_ref(), missing, profile);
        }
        let read = if profile { read_profile } else { read };
        let file = read(bytes).map_err(|error| MapFileError::Format(Box::new(error)))?;
        let channels = file.channels();
        let (index, reason) = match channel {
            Some(choice) => (channel_index(choice, channels.len(), |name| file.find(name))?, None),
            None => {
                let default = file.default_channel().ok_or_else(|| {
                    let described = channels.iter().map(|one| {
                        format!("`{}` in {}", one.name(), one.unit().unwrap_or("no unit"))
                    });
                    MapFileError::NoHeights { channels: described.collect() }
                })?;
                (default.index, Some(default.reason))
            }
        };
        let masked = &channels[index];
        let channel = &if ignores_mask { masked.clone().without_mask() } else { masked.clone() };
        let map = missing.map_or_else(|| channel.map(), |marker| channel.map_without(marker));
        let (heights, _) = map.into_parts();
        let suspect = channel.suspect_number();
        Ok(MapFile {
            reader: Some(Reader::of_format(file.format().name())),
            channel: ChannelRead {
                number: index + 1,
                name: channel.name().to_owned(),
                of: channels.len(),
                reason,
            },
            quantity: channel.quantity().clone(),
            size: channel.size(),
            unknown_side_unit: channel.unknown_side_unit().map(str::to_owned),
            suspect: suspect
                .filter(|suspect| missing.is_none_or(|m| !is_marker(suspect.number, m))),
            nodes: channel.nodes(),
            notes: channel.notes(),
            heights,
        })
    }

    /// Reads a NumPy array, which has one channel: number 1, named `heights`.
    fn read_npy(
        bytes: &[u8],
        choice: Option<&ChannelChoice>,
        missing: Option<f64>,
        profile: bool,
    ) -> Result<MapFile, MapFileError> {
        let line = if profile { npy_line(bytes) } else { None };
        let (nodes, mut heights) = match line {
            Some(line) => ([line.len(), 1], line),
            None => npy_array(bytes).map_err(MapFileError::Npy)?,
        };
        if let Some(marker) = missing {
            let marked = heights.iter_mut().filter(|height| is_marker(**height, marker));
            marked.for_each(|height| *height = f64::NAN);
        }
        if let Some(choice) = choice {
            let names = || vec!["heights".to_owned()];
            channel_index(choice, 1, |name| match name {
                "heights" | "1" => Ok(0),
                _ => Err(ChannelError::Unknown { wanted: name.to_owned(), names: names() }),
            })?;
        }
        // An array without nodes cannot be a map.
        Grid::new(nodes, Cell::square(1.0).expect("a side of one")).map_err(SurfaceError::from)?;
        Ok(MapFile {
            reader: None,
            channel: ChannelRead { number: 1, name: "heights".to_owned(), of: 1, reason: None },
            quantity: Quantity::Unitless,
            size: Size::Unknown,
            unknown_side_unit: None,
            suspect: SuspectNumber::find(&heights),
            nodes,
            notes: vec![],
            heights,
        })
    }

    /// Multiplies the heights by `height_scale` and returns the map with the sides `side` or, if
    /// they are `None`, with the sides in the file.
    ///
    /// # Errors
    /// If sides are neither given nor in the file, or if a scaled height is not finite or so high
    /// that squares of it overflow.
    pub fn scan(self, side: Option<[f64; 2]>, height_scale: f64) -> Result<Scan, MapFileError> {
        let sides = side.or(self.size.sides()).ok_or(MapFileError::NoSize)?;
        let cell = Cell::new(sides).map_err(SurfaceError::from)?;
        let grid = Grid::new(self.nodes, cell).map_err(SurfaceError::from)?;
        let mut heights = self.heights;
        for (node, height) in heights.iter_mut().enumerate().filter(|(_, one)| one.is_finite()) {
            *height *= height_scale;
            if !height.is_finite() {
                let [row, column] = grid.indices(node);
                let height = *height;
                return Err(MapFileError::Surface(SurfaceError::NotFinite { row, column, height }));
            }
        }
        check_range(grid, &heights)?;
        Ok(Scan::new(grid, heights)?)
    }
}

/// Returns the index of the chosen channel among `count` channels. `find` returns the index of the
/// channel with a name.
fn channel_index(
    choice: &ChannelChoice,
    count: usize,
    find: impl Fn(&str) -> Result<usize, ChannelError>,
) -> Result<usize, MapFileError> {
    match choice {
        ChannelChoice::Name(name) => find(name).map_err(MapFileError::Channel),
        ChannelChoice::Number(number) => match *number as usize {
            number @ 1.. if number <= count => Ok(number - 1),
            // A number never selects a channel by its name.
            number => Err(MapFileError::Channel(ChannelError::OutOfRange { number, count })),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# Width: 3 µm\n# Height: 2 µm\n# Value units: µm\n1 2 4\n3 nan 6\n";

    #[test]
    fn a_file_with_a_unit_is_in_metres_and_knows_its_reader() {
        let file = MapFile::read(TEXT.as_bytes(), &MapChoice::default()).unwrap();
        assert_eq!(file.reader, Some(Reader::of_format("text")));
        assert!(Reader::of_format("text").version > 0);
        let scan = file.scan(None, 2.0).unwrap();
        assert_eq!(scan.grid().nodes(), [3, 2]);
        assert!((scan.grid().cell().size()[0] - 3e-6).abs() < 1e-20);
        assert_eq!(scan.missing(), 1);
        assert!((scan.heights()[1] - 6e-6).abs() < 1e-20);
    }

    #[test]
    fn channels_are_told_by_name_or_number() {
        let [number, other] = [1, 2].map(ChannelChoice::Number);
        let read = |channel: &ChannelChoice| {
            let choice = MapChoice { channel: Some(channel.clone()), ..MapChoice::default() };
            MapFile::read(TEXT.as_bytes(), &choice)
        };
        assert_eq!(read(&number).unwrap().channel.number, 1);
        assert_eq!(
            read(&other).unwrap_err().to_string(),
            "the file has no channel 2; its channels have the numbers 1 to 1"
        );
        let named = ChannelChoice::Name("height".to_owned());
        assert!(matches!(read(&named), Err(MapFileError::Channel(ChannelError::Unknown { .. }))));
    }

    #[test]
    fn a_line_of_a_map_is_a_profile() {
        let read = |choice: &MapChoice| MapFile::read(TEXT.as_bytes(), choice);
        let choice = MapChoice { profile: true, ..MapChoice::default() };
        let no_profile = MapFileError::NoProfile { nodes: [3, 2] };
        assert_eq!(read(&choice).unwrap_err(), no_profile);
        let line = |line| MapChoice { line: Some(line), ..choice.clone() };
        let first = read(&line(1)).unwrap();
        assert_eq!(first.nodes, [3, 1]);
        let found = [&first.heights[..], &first.size.sides().unwrap()].concat();
        for (found, exact) in found.iter().zip([1e-6, 2e-6, 4e-6, 3e-6, 1e-6]) {
            assert!((found - exact).abs() < 1e-20, "{found}");
        }
        assert!(read(&line(2)).unwrap().heights[1].is_nan());
        assert_eq!(read(&line(3)).unwrap_err(), MapFileError::NoLine { line: 3, lines: 2 });
    }

    #[test]
    fn a_profile_is_read_only_as_a_profile() {
        let text = b"# heights\n1\n2\n3\n4\n";
        let choice = MapChoice { profile: true, ..MapChoice::default() };
        let read = MapFile::read(text, &choice).unwrap();
        assert_eq!((read.nodes, read.size), ([4, 1], Size::Unknown));
        assert!(MapFile::read(text, &MapChoice::default()).is_err());
        assert_eq!(serde_json::to_string(&MapChoice::default()).unwrap(), "{}");
    }

    #[test]
    fn heights_beyond_all_numbers_are_refused() {
        let file = MapFile::read(TEXT.as_bytes(), &MapChoice::default()).unwrap();
        assert!(file.clone().scan(Some([1.0, 1.0]), 1e90).is_ok());
        assert!(file.scan(Some([1.0, 1.0]), 1e110).is_err());
        let large = "1e308 1 1 1\n1 1 1 1\n1 1 1 1\n1 1 1 1\n";
        let file = MapFile::read(large.as_bytes(), &MapChoice::default()).unwrap();
        // Sums of squares of such heights overflow, although the heights do not.
        assert!(file.clone().scan(Some([1.0, 1.0]), 1.0).is_err());
        assert!(file.clone().scan(Some([1.0, 1.0]), 100.0).is_err());
        assert_eq!(file.scan(None, 1.0).unwrap_err(), MapFileError::NoSize);
    }
}
