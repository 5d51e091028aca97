//! What a reader of one format is.

use super::channel::Channel;
use super::error::FormatError;

/// A format of files.
#[derive(Debug)]
pub struct Format {
    pub(super) name: &'static str,
    pub(super) title: &'static str,
    /// Raised whenever the reader finds other numbers in a file: what rests on it is computed again.
    pub(super) version: u32,
    /// Whether files of no other format start like those of this one.
    pub(super) has_signature: bool,
    pub(super) read: for<'a> fn(&'a [u8]) -> Result<Vec<Channel<'a>>, FormatError>,
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
