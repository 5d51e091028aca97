//! The map of heights that a file holds, before anything is done to it.
//!
//! NumPy arrays are read as they always were: no unit, no size, and a recipe that names no reader.
//! Recipes of all other formats name format and version of the reader, so that what a corrected one
//! reads is computed again.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use asperity_contact::grid::{Cell, Grid};
use asperity_contact::topography::surface::{Scan, SurfaceError};
use asperity_topography_files::{
    ChannelError, NpyError, Quantity, Size, TopographyFileError, formats, npy_array, read,
};

/// What has read a file.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Reader {
    /// The format's name.
    pub format: String,
    /// The version of its reader.
    pub version: u32,
}

/// Which map of a file, as a manifest says it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum ChannelChoice {
    /// By its place, from 1 on.
    Number(u32),
    /// By its name.
    Name(String),
}

/// A map of a file.
#[derive(Debug, Clone)]
pub struct MapFile {
    /// What has read it; none of a NumPy array.
    pub reader: Option<Reader>,
    /// The map that was read.
    pub channel: ChannelRead,
    /// What its numbers are.
    pub quantity: Quantity,
    /// Sides that the file gives.
    pub size: Size,
    /// Nodes along x and y.
    pub nodes: [usize; 2],
    /// A number for each, row-major; what is not finite is missing.
    pub heights: Vec<f64>,
}

/// Which map of a file was read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ChannelRead {
    /// Its place, from 1 on.
    pub number: usize,
    /// What the file calls it.
    pub name: String,
    /// How many the file has.
    pub of: usize,
}

/// Why a file holds no such map.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum MapFileError {
    #[error(transparent)]
    Npy(NpyError),
    #[error(transparent)]
    Format(Box<TopographyFileError>),
    #[error(transparent)]
    Channel(ChannelError),
    #[error("none of its channels holds heights: {}", channels.join(", "))]
    NoHeights {
        /// Each with its unit.
        channels: Vec<String>,
    },
    #[error("it does not say how large its map is")]
    NoSize,
    #[error(transparent)]
    Surface(#[from] SurfaceError),
}

impl Reader {
    /// The reader of a format, by the name of that; one that is no longer there has version zero.
    pub fn of_format(name: &str) -> Reader {
        let format = formats().iter().find(|format| format.name() == name);
        Reader { format: name.to_owned(), version: format.map_or(0, |format| format.version()) }
    }
}

/// As a manifest has it.
impl std::fmt::Display for ChannelChoice {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ChannelChoice::Number(number) => write!(formatter, "{number}"),
            ChannelChoice::Name(name) => formatter.write_str(name),
        }
    }
}

impl MapFile {
    /// Reads the map that is asked for, or else the first that holds heights.
    ///
    /// # Errors
    /// When the bytes are no file of any format, or of a damaged one, or have no such map.
    pub fn read(bytes: &[u8], choice: Option<&ChannelChoice>) -> Result<MapFile, MapFileError> {
        if bytes.starts_with(b"\x93NUMPY") {
            return MapFile::of_npy(bytes, choice);
        }
        let file = read(bytes).map_err(|error| MapFileError::Format(Box::new(error)))?;
        let channels = file.channels();
        let place = match choice {
            Some(choice) => place_of(choice, channels.len(), |name| file.find(name))?,
            None => file.first_heights().ok_or_else(|| {
                let told = channels
                    .iter()
                    .map(|one| format!("`{}` in {}", one.name(), one.unit().unwrap_or("no unit")));
                MapFileError::NoHeights { channels: told.collect() }
            })?,
        };
        let channel = &channels[place];
        let (heights, _) = channel.map().into_parts();
        Ok(MapFile {
            reader: Some(Reader::of_format(file.format().name())),
            channel: ChannelRead {
                number: place + 1,
                name: channel.name().to_owned(),
                of: channels.len(),
            },
            quantity: channel.quantity().clone(),
            size: channel.size(),
            nodes: channel.nodes(),
            heights,
        })
    }

    fn of_npy(bytes: &[u8], choice: Option<&ChannelChoice>) -> Result<MapFile, MapFileError> {
        let (nodes, heights) = npy_array(bytes).map_err(MapFileError::Npy)?;
        if let Some(choice) = choice {
            let names = || vec!["heights".to_owned()];
            place_of(choice, 1, |name| match name {
                "heights" | "1" => Ok(0),
                _ => Err(ChannelError::Unknown { wanted: name.to_owned(), names: names() }),
            })?;
        }
        // As before there were holes: an array without nodes is none.
        Grid::new(nodes, Cell::square(1.0).expect("a side of one")).map_err(SurfaceError::from)?;
        Ok(MapFile {
            reader: None,
            channel: ChannelRead { number: 1, name: "heights".to_owned(), of: 1 },
            quantity: Quantity::Unitless,
            size: Size::Unknown,
            nodes,
            heights,
        })
    }

    /// The map on a cell of the given sides, or else of those that the file gives.
    ///
    /// # Errors
    /// When nobody knows the sides, or a height leaves the range of floating-point numbers.
    pub fn scan(self, side: Option<[f64; 2]>, height_scale: f64) -> Result<Scan, MapFileError> {
        let side = side.or(self.size.sides()).ok_or(MapFileError::NoSize)?;
        let cell = Cell::new(side).map_err(SurfaceError::from)?;
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
        Ok(Scan::new(grid, heights)?)
    }
}

/// The place of a channel among so many.
fn place_of(
    choice: &ChannelChoice,
    count: usize,
    find: impl Fn(&str) -> Result<usize, ChannelError>,
) -> Result<usize, MapFileError> {
    match choice {
        ChannelChoice::Name(name) => find(name).map_err(MapFileError::Channel),
        ChannelChoice::Number(number) => match *number as usize {
            number @ 1.. if number <= count => Ok(number - 1),
            // Names count first where a channel is called by a number; here none is asked for.
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
        let file = MapFile::read(TEXT.as_bytes(), None).unwrap();
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
        let read = |choice: &ChannelChoice| MapFile::read(TEXT.as_bytes(), Some(choice));
        assert_eq!(read(&number).unwrap().channel.number, 1);
        assert_eq!(
            read(&other).unwrap_err().to_string(),
            "the file has no channel 2; its channels have the numbers 1 to 1"
        );
        let named = ChannelChoice::Name("height".to_owned());
        assert!(matches!(read(&named), Err(MapFileError::Channel(ChannelError::Unknown { .. }))));
    }

    #[test]
    fn heights_beyond_all_numbers_are_refused() {
        let file = MapFile::read(TEXT.as_bytes(), None).unwrap();
        assert!(file.scan(Some([1.0, 1.0]), f64::MAX).is_ok());
        let large = "1e308 1 1 1\n1 1 1 1\n1 1 1 1\n1 1 1 1\n";
        let file = MapFile::read(large.as_bytes(), None).unwrap();
        assert!(file.clone().scan(Some([1.0, 1.0]), 100.0).is_err());
        assert_eq!(file.scan(None, 1.0).unwrap_err(), MapFileError::NoSize);
    }
}
