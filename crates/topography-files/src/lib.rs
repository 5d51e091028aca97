//! Reader for the surface topography files of instruments and analysis programs.
//!
//! [`read`] recognizes the format of a file by its content, not by its name, and lists the channels
//! of the file. [`Channel::map`] decodes a channel into a [`HeightMap`], which [`Statistics`]
//! summarizes.
//!
//! All formats follow the same conventions:
//!
//! - Heights are indexed `[x, y]` with x along the first axis.
//! - Lengths are in metres if the file gives a unit of length.
//! - Points that were not measured are missing. The marker of a missing point is never returned as
//!   a height.
//! - The sides of a map are the sides given in the file, otherwise nodes × step.
//! - The size in a header is compared with the length of the file before memory is allocated.
//!
//! The source of each format documents its line order and whether it stores sides or steps.
//!
//! | module | contents |
//! |---|---|
//! | `lib` | [`TopographyFile`], [`Format`] and the errors |
//! | `channel` | [`Channel`], [`HeightMap`], [`Quantity`], [`Size`], [`Statistics`] |
//! | `raster` | conversion of stored numbers to a map: byte order, line order, missing points |
//! | `unit` | units and their spellings |
//! | `input` | helpers for headers: a cursor over bytes, named values, decompression |
//! | `text_headers` | formats with a text header: `al3d`, `bcrf`, `gsf`, `gxyzf`, `mi` |
//! | `binary_headers` | formats with a binary header: `frt`, `metropro`, `opd`, `plu`, `sur` |
//! | `probe_microscopes` | formats with sections in a text header: `nid`, `sxm`, `wsxm` |
//! | `text_exports` | text exports with an own header: `wyko-asc`, `zygo-asc`, `keyence-csv` |
//! | `text` | text files with a matrix, or with triplets of x, y and height |
//! | `hdf5` | maps in HDF5 files |
//! | `hdf5_formats` | formats that are built on HDF5: `datx`, `h5-jpk`, `netcdf4`, `nhf` |
//! | `labelled` | arrays with named axes, of netCDF and HDF5 files |
//! | `direction` | names of axes and of coordinates |
//! | `tiff`, `tiff_maps` | images of TIFF files, and their maps |
//! | `tiff_instruments` | formats of instruments that are TIFF files: `jpk`, `lext`, `park` |
//! | `more_optical` | `nms`, `plux`, `tmd` and `vk` |
//! | `archive` | zip archives, files in a gzip file or a zip archive, names of other containers |
//! | `grid` | maps assembled from points x, y and height |
//! | `grids` | `esri-asc` and `surfer` |
//! | `gwy`, `igor`, `iso28600`, `nanoscope`, `netcdf` | one format each |
//! | `npy` | `npy` and `npz` |
//! | `nrrd`, `opdx`, `sdf` | one format each |
//! | `number` | numbers in texts, and words for missing points |
//! | `xml` | elements of XML documents |
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
//! assert_eq!(Statistics::new(&map).missing, 1);
//! # Ok::<(), asperity_topography_files::TopographyFileError>(())
//! ```

#![warn(missing_docs, unreachable_pub)]

mod archive;
mod binary_headers;
mod channel;
mod direction;
mod grid;
mod grids;
mod gwy;
mod hdf5;
mod hdf5_formats;
mod igor;
mod input;
mod iso28600;
mod labelled;
mod more_optical;
mod nanoscope;
mod netcdf;
mod nmm;
mod npy;
mod nrrd;
mod number;
mod opdx;
mod probe_microscopes;
mod raster;
mod sdf;
mod text;
mod text_exports;
mod text_headers;
mod tiff;
mod tiff_instruments;
mod tiff_maps;
mod unit;
mod x3p;
mod xml;

use thiserror::Error;

pub use self::channel::{
    Channel, Corners, HeightMap, HeightStatistics, Quantity, Size, Statistics, SuspectNumber,
};
pub use self::npy::{NpyError, npy_array};

// For the other crates of asperity only.
#[doc(hidden)]
pub use self::{
    npy::npy_line,
    raster::is_marker,
    unit::{is_metre, length_ratio},
};

/// All formats, in the order in which [`read`] tries them.
static FORMATS: [Format; 44] = [
    nmm::FORMAT,
    more_optical::PLUX,
    npy::NPZ,
    x3p::FORMAT,
    binary_headers::SUR,
    gwy::FORMAT,
    text_headers::GSF,
    text_headers::GXYZF,
    sdf::FORMAT,
    binary_headers::OPD,
    text_headers::AL3D,
    nanoscope::FORMAT,
    igor::FORMAT,
    binary_headers::METROPRO,
    more_optical::VK,
    opdx::FORMAT,
    tiff_instruments::LEXT,
    probe_microscopes::NID,
    probe_microscopes::SXM,
    more_optical::TMD,
    probe_microscopes::WSXM,
    netcdf::FORMAT,
    hdf5_formats::DATX,
    hdf5_formats::NHF,
    hdf5_formats::NETCDF4,
    hdf5_formats::JPK,
    hdf5::FORMAT,
    tiff_instruments::JPK,
    tiff_instruments::PARK,
    tiff_maps::FORMAT,
    text_headers::MI,
    binary_headers::FRT,
    text_headers::BCR,
    npy::FORMAT,
    binary_headers::PLU,
    more_optical::NMS,
    grids::ESRI,
    grids::SURFER,
    iso28600::FORMAT,
    nrrd::FORMAT,
    text_exports::WYKO,
    text_exports::ZYGO,
    text_exports::KEYENCE,
    text::FORMAT,
];

/// Number of containers in each other that are read through, such as a zip archive of a `.gz` file.
const MAX_DEPTH: usize = 2;

/// A topography file with its format and at least one channel.
#[derive(Debug)]
pub struct TopographyFile<'a> {
    format: &'static Format,
    channels: Vec<Channel<'a>>,
}

/// Error of [`read`]. It does not contain the path of the file, which [`read`] does not know.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the messages document the variants")]
#[non_exhaustive]
pub enum TopographyFileError {
    #[error("the file is empty")]
    Empty,
    #[error("damaged or unsupported {name} file ({title})")]
    Damaged { name: &'static str, title: &'static str, source: FormatError },
    #[error("the file is {kind}; {advice}")]
    Container {
        /// What the file is, with an article.
        kind: String,
        /// What to do.
        advice: String,
    },
    #[error("no known format matches the file, which starts with {start} ({})", attempts(tried))]
    Unknown {
        start: String,
        /// Names of the formats without a signature, with the error of each reader.
        tried: Vec<(&'static str, FormatError)>,
        /// Names of the formats whose signature does not match the first bytes.
        others: Vec<&'static str>,
    },
}

/// File format with its reader; [`formats`] returns all of them.
#[derive(Debug)]
pub struct Format {
    name: &'static str,
    title: &'static str,
    /// What changed in the numbers that the reader decodes from a file, with a reason for each
    /// version of the reader from 2 on. Dependent results are computed again.
    changes: &'static [&'static str],
    /// True if the first bytes identify the format. If they do and the reader fails, no other
    /// format is tried.
    has_signature: bool,
    read: for<'a> fn(&'a [u8]) -> Result<Vec<Channel<'a>>, FormatError>,
}

/// Error of the reader of one format.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the messages document the variants")]
#[non_exhaustive]
pub enum FormatError {
    #[error("the first bytes are not the signature of the format")]
    Signature,
    #[error("the file is cut off: {needed} bytes are needed, but it has only {found}")]
    CutOff { needed: usize, found: usize },
    #[error("`{entry}` is missing")]
    Missing { entry: String },
    #[error("`{entry}` is {value}; expected {allowed}")]
    Value { entry: String, value: String, allowed: String },
    #[error(
        "the map is cut off: {} × {} heights of {element} bytes need {needed} bytes, but only \
         {found} are left",
        nodes[0], nodes[1]
    )]
    Heights { nodes: [usize; 2], element: usize, needed: u128, found: usize },
    #[error("{} × {} nodes exceed the limit of 2^30 nodes", nodes[0], nodes[1])]
    TooMany { nodes: [i64; 2] },
    #[error("line {line}: {problem}")]
    Line { line: usize, problem: String },
    #[error("{part} is damaged: {reason}")]
    Damaged { part: String, reason: String },
    #[error("{0}")]
    Unsupported(String),
}

/// Error of [`TopographyFile::find`]: the channel does not exist, or several have the same name.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[expect(missing_docs, reason = "the messages document the variants")]
#[non_exhaustive]
pub enum ChannelError {
    #[error("the file has no channel `{wanted}`")]
    Unknown {
        wanted: String,
        /// Names of all channels of the file.
        names: Vec<String>,
    },
    #[error("the file has no channel {number}; its channels have the numbers 1 to {count}")]
    OutOfRange { number: usize, count: usize },
    #[error(
        "the file has several channels `{wanted}`; select one by its number: {}",
        numbers.iter().map(usize::to_string).collect::<Vec<_>>().join(", ")
    )]
    Ambiguous {
        wanted: String,
        /// Numbers of the channels with this name, counted from 1.
        numbers: Vec<usize>,
    },
}

/// Returns all supported formats, in the order in which [`read`] tries them.
pub fn formats() -> &'static [Format] {
    &FORMATS
}

/// Recognizes the format of a file, reads its header and lists its channels.
///
/// The heights are decoded only by [`Channel::map`]. A file in a gzip file, or the only file in a
/// zip archive, is read like the file itself.
///
/// # Errors
/// Returns an error if the file is empty, damaged or cut off, or if its format or its variant of
/// the format is not supported. If no format is recognized, the error lists all of them.
pub fn read(bytes: &[u8]) -> Result<TopographyFile<'_>, TopographyFileError> {
    read_through(bytes, MAX_DEPTH, read_maps)
}

/// Reads a file by `read`, or the only file of a container. `depth` is the number of containers in
/// each other that are read through.
fn read_through(
    bytes: &[u8],
    depth: usize,
    read: fn(&[u8]) -> Result<TopographyFile<'_>, TopographyFileError>,
) -> Result<TopographyFile<'_>, TopographyFileError> {
    if bytes.is_empty() {
        return Err(TopographyFileError::Empty);
    }
    if depth > 0
        && let Some(content) = archive::content(bytes)?
    {
        let TopographyFile { format, channels } = read_through(&content, depth - 1, read)?;
        let channels = channels.into_iter().map(Channel::into_owned).collect();
        return Ok(TopographyFile { format, channels });
    }
    read(bytes)
}

/// Reads a file that holds maps or says that it holds profiles.
fn read_maps(bytes: &[u8]) -> Result<TopographyFile<'_>, TopographyFileError> {
    let mut tried = Vec::new();
    let mut others = Vec::new();
    for format in &FORMATS {
        match (format.read)(bytes) {
            Ok(channels) => return Ok(TopographyFile { format, channels }),
            Err(FormatError::Signature) => others.push(format.name),
            Err(source) if format.has_signature => return Err(format.damaged(source)),
            Err(error) => tried.push((format.name, error)),
        }
    }
    Err(TopographyFileError::Unknown { start: start(bytes), tried, others })
}

/// Reads a file as [`read`], and also files that are a profile only if the user says so: text with
/// one column of heights, or with two columns x and height, and NumPy arrays with one axis.
///
/// The file may still hold maps; [`Channel::is_profile`] tells.
///
/// # Errors
/// As [`read`].
///
/// ```
/// use asperity_topography_files::{read, read_profile};
///
/// let text = b"x [mm]\tz [um]\n0.0\t1.5\n0.5\t2.5\n1.0\t2.0\n";
/// assert!(read(text).is_err());
/// let file = read_profile(text)?;
/// let channel = &file.channels()[0];
/// assert!(channel.is_profile());
/// assert_eq!(channel.nodes(), [3, 1]);
/// assert_eq!(channel.map().heights(), [1.5e-6, 2.5e-6, 2e-6]);
/// # Ok::<(), asperity_topography_files::TopographyFileError>(())
/// ```
pub fn read_profile(bytes: &[u8]) -> Result<TopographyFile<'_>, TopographyFileError> {
    read_through(bytes, MAX_DEPTH, read_maps_or_profile)
}

fn read_maps_or_profile(bytes: &[u8]) -> Result<TopographyFile<'_>, TopographyFileError> {
    let error = match read_maps(bytes) {
        Ok(file) => return Ok(file),
        Err(error) => error,
    };
    let (name, channel) = if let Some(channel) = npy::profile(bytes) {
        (npy::FORMAT.name, Ok(channel))
    } else if matches!(error, TopographyFileError::Unknown { .. })
        && let Ok(text) = text::decoded(bytes)
    {
        (text::FORMAT.name, text::profile(&text))
    } else {
        return Err(error);
    };
    let format = FORMATS.iter().find(|known| known.name == name).expect("both are listed");
    match channel {
        Ok(channel) => Ok(TopographyFile { format, channels: vec![channel] }),
        Err(source) => Err(format.damaged(source)),
    }
}

impl<'a> TopographyFile<'a> {
    /// Returns the format of the file.
    pub fn format(&self) -> &'static Format {
        self.format
    }

    /// Returns the channels in the order of the file; there is at least one.
    pub fn channels(&self) -> &[Channel<'a>] {
        &self.channels
    }

    /// Returns the index of the channel with the given name or, if no name matches, of the channel
    /// with this number.
    ///
    /// Numbers start at 1; the returned index starts at 0.
    ///
    /// # Errors
    /// Returns an error if no channel matches, or if several channels have this name.
    pub fn find(&self, wanted: &str) -> Result<usize, ChannelError> {
        let numbered = self.channels.iter().enumerate();
        let matching = numbered.filter(|(_, channel)| channel.name() == wanted);
        let named: Vec<usize> = matching.map(|(index, _)| index).collect();
        let number = wanted.parse::<usize>().ok();
        let by_number = number.filter(|number| (1..=self.channels.len()).contains(number));
        match (named.as_slice(), by_number) {
            (&[index], _) => Ok(index),
            ([], Some(number)) => Ok(number - 1),
            ([], None) => Err(ChannelError::Unknown {
                wanted: wanted.to_owned(),
                names: self.channels.iter().map(|one| one.name().to_owned()).collect(),
            }),
            _ => Err(ChannelError::Ambiguous {
                wanted: wanted.to_owned(),
                numbers: named.iter().map(|index| index + 1).collect(),
            }),
        }
    }

    /// Returns the channel of heights to read if none is chosen, or `None` if no channel may be
    /// heights.
    ///
    /// Channels with names such as height, z and topography come before those with other names, and
    /// these before error, deflection, amplitude, phase, friction, pressure and others, whatever
    /// their unit. Among them, heights in metres come before numbers without a unit, and trace
    /// before retrace. If several channels remain, the first of the file is taken.
    pub fn default_channel(&self) -> Option<DefaultChannel> {
        let channels = self.channels.iter().enumerate();
        let heights = channels.filter(|(_, channel)| channel.may_be_heights());
        let mut ranked: Vec<_> = heights.map(|(index, one)| (one.rank(), index)).collect();
        ranked.sort_unstable();
        let &(rank, index) = ranked.first()?;
        let others = ranked[1..].iter().filter(|(other, _)| *other == rank);
        let equals: Vec<usize> = others.map(|(_, index)| *index).collect();
        let reason = match ranked.get(1).map(|(other, _)| other) {
            None => "the only one that may be heights".to_owned(),
            Some(other) if *other == rank => self.equals_in_words(&equals),
            Some((class, ..)) if *class != rank.0 => "because of its name".to_owned(),
            Some((_, has_other_unit, _)) if *has_other_unit != rank.1 => {
                "because of its unit".to_owned()
            }
            Some(_) => "because it was recorded forwards".to_owned(),
        };
        Some(DefaultChannel { index, reason, is_ambiguous: !equals.is_empty() })
    }

    /// Lists the channels that may be the heights as well as the first one.
    fn equals_in_words(&self, equals: &[usize]) -> String {
        const NAMED: usize = 4;
        let matching = equals.iter().take(NAMED);
        let texts: Vec<String> = matching
            .map(|&index| format!("{} (`{}`)", index + 1, self.channels[index].name()))
            .collect();
        let channels = if equals.len() == 1 { "channel" } else { "channels" };
        let more = match equals.len().saturating_sub(NAMED) {
            0 => String::new(),
            count => format!(" and {count} more"),
        };
        let named = texts.join(", ");
        format!("the first of the file; {channels} {named}{more} may be the heights as well")
    }
}

/// Channel that is read if none is chosen.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub struct DefaultChannel {
    /// Index of the channel, from 0.
    pub index: usize,
    /// Reason for the choice, such as `because of its name`. It lists the other channels between
    /// which and this one only their order in the file decided.
    pub reason: String,
    /// True if only the order of the channels decided.
    pub is_ambiguous: bool,
}

impl Format {
    /// Creates a format whose first bytes identify it.
    const fn new(
        name: &'static str,
        title: &'static str,
        read: for<'a> fn(&'a [u8]) -> Result<Vec<Channel<'a>>, FormatError>,
    ) -> Format {
        Format { name, title, changes: &[], has_signature: true, read }
    }

    /// Sets the reasons of the versions of the reader from 2 on.
    const fn changed(self, changes: &'static [&'static str]) -> Format {
        Format { changes, ..self }
    }

    /// Declares that other files may start with the same bytes.
    const fn without_signature(self) -> Format {
        Format { has_signature: false, ..self }
    }

    /// Returns the error about a file of this format that its reader refuses.
    fn damaged(&self, source: FormatError) -> TopographyFileError {
        TopographyFileError::Damaged { name: self.name, title: self.title, source }
    }

    /// Returns the short name of the format, in most cases the usual file extension.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// Returns the version of the reader, which increases when the decoded numbers change.
    pub fn version(&self) -> u32 {
        1 + self.changes.len() as u32
    }

    /// Returns what changed in the numbers that the reader decodes: the reason of each version from
    /// 2 to [`Format::version`].
    #[doc(hidden)]
    pub fn changes(&self) -> &'static [&'static str] {
        self.changes
    }

    /// Returns the full name of the format, for messages.
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
    fn missing(entry: impl Into<String>) -> FormatError {
        FormatError::Missing { entry: entry.into() }
    }

    fn value(entry: &str, value: impl ToString, allowed: &str) -> FormatError {
        // The value is cut off, because it may have any length in a damaged file.
        let start = value.to_string().chars().take(60).collect();
        FormatError::Value { entry: entry.to_owned(), value: start, allowed: allowed.to_owned() }
    }

    fn damaged(part: &str, reason: impl ToString) -> FormatError {
        FormatError::Damaged { part: part.to_owned(), reason: reason.to_string() }
    }

    fn unsupported(what: impl Into<String>) -> FormatError {
        FormatError::Unsupported(what.into())
    }
}

/// Collects the channels of a file. If there are none, the error says that `entry` is missing.
fn at_least_one<'a>(
    channels: impl IntoIterator<Item = Result<Channel<'a>, FormatError>>,
    entry: &str,
) -> Result<Vec<Channel<'a>>, FormatError> {
    let channels: Vec<Channel<'a>> = channels.into_iter().collect::<Result<_, _>>()?;
    if channels.is_empty() { Err(FormatError::missing(entry)) } else { Ok(channels) }
}

fn attempts(tried: &[(&'static str, FormatError)]) -> String {
    let each = tried.iter().map(|(name, error)| format!("as {name}: {error}"));
    each.collect::<Vec<_>>().join("; ")
}

/// Formats the first bytes as text if they are printable, otherwise as hexadecimal numbers.
fn start(bytes: &[u8]) -> String {
    let is_letter = |byte: &&u8| (b' '..=b'~').contains(byte);
    let text: Vec<u8> = bytes.iter().take_while(is_letter).take(24).copied().collect();
    if text.len() >= 4 || text.len() == bytes.len() {
        return format!("`{}`", String::from_utf8_lossy(&text));
    }
    let hexadecimal = bytes.iter().take(12).map(|byte| format!("{byte:02x}"));
    hexadecimal.collect::<Vec<_>>().join(" ")
}

/// Compiles and runs the example of the README as a doc test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;

#[cfg(test)]
mod tests;
