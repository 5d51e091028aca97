//! Surface topography as instruments and programs write it.
//!
//! [`read`] finds out from the content of a file, not from its name, which format it has, and lists
//! its channels; a [`Channel`] decodes its [`HeightMap`] when it is asked to, and [`Statistics`] say
//! what that is like. Nothing here knows manifests or folders.
//!
//! Whatever the file does: heights are `[x, y]` with x along the first axis, lengths are metres where
//! the file has a unit, points that were not measured are missing and never a number, and nothing
//! is allocated before its size has been held against that of the file. The page of each format in
//! the source says how its lines lie and what its size is: nodes × step for all of them, or what the
//! file gives as the size of the whole map.
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

mod al3d;
mod bcr;
mod channel;
mod cursor;
mod entries;
mod error;
mod format;
mod frt;
mod gsf;
mod gwy;
mod igor;
mod inflate;
mod metropro;
mod mi;
mod nanoscope;
mod netcdf;
mod npy;
mod opd;
mod plu;
mod raster;
mod sdf;
mod statistics;
mod sur;
mod text;
mod unit;
mod x3p;

use thiserror::Error;

pub use self::channel::{Channel, HeightMap, Quantity, Size};
pub use self::error::{ChannelError, FormatError};
pub use self::format::Format;
pub use self::npy::{NpyError, npy_array};
pub use self::statistics::{Corners, HeightStatistics, Statistics};
pub use self::unit::{is_metre, length_ratio};

/// All that are read: those that are known by their first bytes, then those that are not.
static FORMATS: [Format; 17] = [
    x3p::FORMAT,
    sur::FORMAT,
    gwy::FORMAT,
    gsf::FORMAT,
    sdf::FORMAT,
    opd::FORMAT,
    al3d::FORMAT,
    nanoscope::FORMAT,
    igor::FORMAT,
    metropro::FORMAT,
    netcdf::FORMAT,
    mi::FORMAT,
    frt::FORMAT,
    bcr::FORMAT,
    npy::FORMAT,
    plu::FORMAT,
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

#[cfg(test)]
mod samples;
#[cfg(test)]
mod tests;
