//! Surface topography as instruments and programs write it.
//!
//! [`read`] finds out from the content of a file, not from its name, which format it has, and lists
//! its channels. A [`Channel`] decodes its [`HeightMap`] when it is asked to, and [`Statistics`]
//! say what that is like.
//!
//! Whatever the file does: heights are `[x, y]` with x along the first axis, lengths are metres
//! where the file has a unit, points that were not measured are missing and never a number, and
//! nothing is allocated before its size has been held against that of the file. The source of each
//! format says how its lines lie and what its size is: nodes × step for all of them, or what the
//! file gives as the size of the whole map.
//!
//! | module | holds |
//! |---|---|
//! | `lib` | [`TopographyFile`], [`Format`] and the errors |
//! | `channel` | [`Channel`], [`HeightMap`], [`Quantity`], [`Size`], [`Statistics`] |
//! | `raster` | stored numbers, and how they become a map: byte order, direction of lines, marks of missing points |
//! | `unit` | units as files write them |
//! | `input` | what headers are read with: numbers and texts at a place, named values, compressed parts |
//! | `text_headers` | a text header and numbers behind it: `al3d`, `bcrf`, `gsf`, `mi`, `sdf` |
//! | `binary_headers` | a binary header and numbers: `frt`, `metropro`, `opd`, `plu`, `sur` |
//! | `text` | numbers as text: a matrix, or triplets of x, y and height |
//! | `gwy`, `igor`, `nanoscope`, `netcdf`, `npy`, `x3p` | a format each |
//!
//! ```
//! use asperity_topography_files::{Quantity, Size, Statistics, read};
//!
//! let file = "# Width: 3 µm\n# Height: 2 µm\n# Value units: µm\n1 2 4\n3 nan 6\n";
//! let file = read(file.as_bytes())?;
//! assert_eq!(file.format().name(), "text");
//! let channel = &file.channels()[0];
//! assert_eq!(channel.nodes(), [3, 2]);
//! assert_eq!(channel.quantity(), &Quantity::Height);
//! let map = channel.map();
//! assert_eq!(map.get(0, 1), Some(3e-6));
//! assert_eq!(map.get(1, 1), None);
//! assert_eq!(Statistics::of(&map).missing, 1);
//! # Ok::<(), asperity_topography_files::TopographyFileError>(())
//! ```

#![warn(missing_docs)]

mod binary_headers;
mod channel;
mod gwy;
mod igor;
mod input;
mod nanoscope;
mod netcdf;
mod npy;
mod raster;
mod text;
mod text_headers;
mod unit;
mod x3p;

use thiserror::Error;

pub use self::channel::{
    Channel, Corners, HeightMap, HeightStatistics, Quantity, Size, Statistics,
};
pub use self::npy::{NpyError, npy_array};
pub use self::unit::{is_metre, length_ratio};

/// All that are read: those that are known by their first bytes, then those that are not.
static FORMATS: [Format; 17] = [
    x3p::FORMAT,
    binary_headers::SUR,
    gwy::FORMAT,
    text_headers::GSF,
    text_headers::SDF,
    binary_headers::OPD,
    text_headers::AL3D,
    nanoscope::FORMAT,
    igor::FORMAT,
    binary_headers::METROPRO,
    netcdf::FORMAT,
    text_headers::MI,
    binary_headers::FRT,
    text_headers::BCR,
    npy::FORMAT,
    binary_headers::PLU,
    text::FORMAT,
];

/// A file of one or more maps.
#[derive(Debug)]
pub struct TopographyFile<'a> {
    format: &'static Format,
    channels: Vec<Channel<'a>>,
}

/// Why a file cannot be read.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum TopographyFileError {
    #[error("the file is empty")]
    Empty,
    #[error("not a sound file of {title} ({name})")]
    Damaged { name: &'static str, title: &'static str, source: FormatError },
    #[error(
        "no reader knows this file, which starts with {start}: {}; those of {} look for other \
         first bytes",
        attempts(tried), others.join(", ")
    )]
    Unknown {
        start: String,
        /// Readers that know their files by more than the first bytes, and what they met.
        tried: Vec<(&'static str, FormatError)>,
        /// The readers whose files start with other bytes.
        others: Vec<&'static str>,
    },
}

/// A format of files.
#[derive(Debug)]
pub struct Format {
    name: &'static str,
    title: &'static str,
    /// Raised whenever the reader finds other numbers in a file: what rests on it is computed
    /// again.
    version: u32,
    /// Whether files of no other format start like those of this one.
    has_signature: bool,
    read: for<'a> fn(&'a [u8]) -> Result<Vec<Channel<'a>>, FormatError>,
}

/// Why bytes are not a file of one format.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum FormatError {
    #[error("it does not start as such files do")]
    Signature,
    #[error("the file ends after {found} bytes, {needed} are needed")]
    CutOff { needed: usize, found: usize },
    #[error("`{entry}` is missing")]
    Missing { entry: String },
    #[error("`{entry}` is {value}, it must be {allowed}")]
    Value { entry: String, value: String, allowed: String },
    #[error(
        "{} × {} heights of {element} bytes need {needed} bytes, {found} are there",
        nodes[0], nodes[1]
    )]
    Heights { nodes: [usize; 2], element: usize, needed: u128, found: usize },
    #[error("{} × {} nodes are more than the 2^30 that are read", nodes[0], nodes[1])]
    TooMany { nodes: [i64; 2] },
    #[error("line {line}: {problem}")]
    Line { line: usize, problem: String },
    #[error("{part} is damaged: {reason}")]
    Damaged { part: String, reason: String },
    #[error("{0}")]
    Unsupported(String),
}

/// Why a channel of a file cannot be told.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[expect(missing_docs, reason = "the message of each says it")]
pub enum ChannelError {
    #[error("the file has no channel `{wanted}`")]
    Unknown {
        wanted: String,
        /// What its channels are called.
        names: Vec<String>,
    },
    #[error("channels of the file have numbers from 1 to {count}, {number} is none of them")]
    Beyond { number: usize, count: usize },
    #[error(
        "the channels {} of the file are all called `{wanted}`: choose by number",
        numbers.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
    )]
    Ambiguous {
        wanted: String,
        /// From 1 on.
        numbers: Vec<usize>,
    },
}

/// The formats that are read.
pub fn formats() -> &'static [Format] {
    &FORMATS
}

/// Reads a file of any of the [`formats`]. Its maps are decoded when they are asked for.
///
/// # Errors
/// When no format fits, or the file of one that does is damaged, cut off or of a kind that is not
/// read. The error says which readers were tried and what each met.
pub fn read(bytes: &[u8]) -> Result<TopographyFile<'_>, TopographyFileError> {
    if bytes.is_empty() {
        return Err(TopographyFileError::Empty);
    }
    let mut tried = Vec::new();
    let mut others = Vec::new();
    for format in &FORMATS {
        match (format.read)(bytes) {
            Ok(channels) => return Ok(TopographyFile { format, channels }),
            Err(FormatError::Signature) => others.push(format.name),
            Err(source) if format.has_signature => {
                return Err(TopographyFileError::Damaged {
                    name: format.name,
                    title: format.title,
                    source,
                });
            }
            Err(error) => tried.push((format.name, error)),
        }
    }
    Err(TopographyFileError::Unknown { start: start(bytes), tried, others })
}

impl<'a> TopographyFile<'a> {
    /// The format of the file.
    pub fn format(&self) -> &'static Format {
        self.format
    }

    /// Its maps, in the order of the file; at least one.
    pub fn channels(&self) -> &[Channel<'a>] {
        &self.channels
    }

    /// The place of the channel that is called so, or, if none is, has this number, from 1 on.
    ///
    /// # Errors
    /// When there is no such channel, or several are called so.
    pub fn find(&self, wanted: &str) -> Result<usize, ChannelError> {
        let numbered = self.channels.iter().enumerate();
        let named = numbered.filter(|(_, channel)| channel.name() == wanted);
        let named: Vec<usize> = named.map(|(place, _)| place).collect();
        let number = wanted.parse::<usize>().ok();
        let by_number = number.filter(|number| (1..=self.channels.len()).contains(number));
        match (named.as_slice(), by_number) {
            (&[place], _) => Ok(place),
            ([], Some(number)) => Ok(number - 1),
            ([], None) => Err(ChannelError::Unknown {
                wanted: wanted.to_owned(),
                names: self.channels.iter().map(|one| one.name().to_owned()).collect(),
            }),
            _ => Err(ChannelError::Ambiguous {
                wanted: wanted.to_owned(),
                numbers: named.iter().map(|place| place + 1).collect(),
            }),
        }
    }

    /// The place of the first channel of heights in metres, or else of the first that may hold
    /// heights.
    pub fn first_heights(&self) -> Option<usize> {
        let heights = |channel: &Channel<'_>| *channel.quantity() == Quantity::Height;
        let heights = self.channels.iter().position(heights);
        heights.or_else(|| self.channels.iter().position(Channel::may_be_heights))
    }
}

impl Format {
    /// A short name: the usual ending of such files.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// The version of the numbers that are read.
    pub fn version(&self) -> u32 {
        self.version
    }

    /// Whose format it is.
    pub fn title(&self) -> &'static str {
        self.title
    }
}

impl PartialEq for Format {
    fn eq(&self, other: &Format) -> bool {
        self.name == other.name
    }
}

impl FormatError {
    /// An entry that has to be there is not.
    fn missing(entry: impl Into<String>) -> FormatError {
        FormatError::Missing { entry: entry.into() }
    }

    /// An entry has a value that it cannot have.
    fn value(entry: &str, value: impl ToString, allowed: &str) -> FormatError {
        // What a file holds in place of a number may be anything, and of any length.
        let value: String = value.to_string().chars().take(60).collect();
        FormatError::Value { entry: entry.to_owned(), value, allowed: allowed.to_owned() }
    }

    /// A part of the file cannot be decoded.
    fn damaged(part: &str, reason: impl ToString) -> FormatError {
        FormatError::Damaged { part: part.to_owned(), reason: reason.to_string() }
    }

    /// The file is sound, but nothing that can be read.
    fn unsupported(what: impl Into<String>) -> FormatError {
        FormatError::Unsupported(what.into())
    }
}

/// The channels of a file that has at least one.
///
/// # Errors
/// When one cannot be read, or there is none: the entry that describes them is then missing.
fn at_least_one<'a>(
    channels: impl IntoIterator<Item = Result<Channel<'a>, FormatError>>,
    entry: &str,
) -> Result<Vec<Channel<'a>>, FormatError> {
    let channels: Vec<Channel<'a>> = channels.into_iter().collect::<Result<_, _>>()?;
    match channels.is_empty() {
        true => Err(FormatError::missing(entry)),
        false => Ok(channels),
    }
}

/// What readers met, each with its name.
fn attempts(tried: &[(&'static str, FormatError)]) -> String {
    let each = tried.iter().map(|(name, error)| format!("{name}: {error}"));
    each.collect::<Vec<_>>().join("; ")
}

/// The first bytes, as text where they are such.
fn start(bytes: &[u8]) -> String {
    let is_letter = |byte: &&u8| (b' '..=b'~').contains(byte);
    let text: Vec<u8> = bytes.iter().take_while(is_letter).take(24).copied().collect();
    if text.len() >= 4 || text.len() == bytes.len() {
        return format!("`{}`", String::from_utf8_lossy(&text));
    }
    let hexadecimal = bytes.iter().take(12).map(|byte| format!("{byte:02x}"));
    hexadecimal.collect::<Vec<_>>().join(" ")
}

/// The example of the README, which is compiled and run.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(test)]
mod samples;
#[cfg(test)]
mod tests;
