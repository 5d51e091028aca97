//! Images of Park Systems (formerly PSIA), which are TIFF files whose image is a coloured preview.
//!
//! The heights and their header are entries of the only directory. Lines run along x; the first
//! line is the lowest of the image and has the largest y. The sides are in micrometres. A height is
//! gain × (scale × number + offset) in the unit of the header, micrometres if it names none; a
//! scale of 0 means 1. The first version has integers of 16 bits; the second states the type.
//!
//! The layout is that of Gwyddion 2.62 (`psia.c`) and SurfaceTopography 1.27.1, which agree.

use encoding_rs::UTF_16LE;

use super::channel::{Channel, Sides};
use super::input::{Cursor, factor, finite, meaning};
use super::raster::{ByteOrder, Element, Raster};
use super::tiff::first_directory;
use super::unit::Unit;
use super::{Format, FormatError};

pub(crate) const FORMAT: Format = Format::new("park", "Park Systems TIFF", read);

// Entries of the directory.
const MAGIC: u16 = 50432;
const VERSION: u16 = 50433;
const DATA: u16 = 50434;
const HEADER: u16 = 50435;
const MAGIC_NUMBER: i64 = 0x0e03_1301;
const SECOND_VERSION: i64 = 0x0100_0002;
/// Type of a profile.
const PROFILE: u32 = 1;

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let directory = first_directory(bytes).map_err(|_| FormatError::Signature)?;
    if directory.whole(MAGIC) != Some(MAGIC_NUMBER) {
        return Err(FormatError::Signature);
    }
    let entry = |tag: u16| {
        let missing = || FormatError::missing(format!("TIFF tag {tag}"));
        directory.entry(tag).map(|entry| entry.bytes()).ok_or_else(missing)
    };
    let mut header = Cursor::new(entry(HEADER)?);
    if header.u32()? == PROFILE {
        return Err(FormatError::unsupported("the file holds a profile, not a map"));
    }
    let name = wide_text(&mut header, 32)?;
    // Mode, filter, flattening and tracking.
    header.skip(16 + 8 + 4 + 4)?;
    let nodes = header.nodes()?;
    // Angle, sine scan, overscan, forward, scan up and exchange of axes.
    header.skip(8 + 4 + 8 + 3 * 4)?;
    let sides = [header.double()?, header.double()?];
    // Offsets, rate, set point and its unit, and biases.
    header.skip(4 * 8 + 16 + 2 * 8)?;
    let gain = factor("data gain", header.double()?)?;
    let scale = match header.double()? {
        0.0 => 1.0,
        scale => finite("scale factor", scale)?,
    };
    let offset = finite("data offset", header.double()?)?;
    let unit = wide_text(&mut header, 8)?;
    let unit = if unit.is_empty() { "µm".to_owned() } else { unit };
    let element = if directory.whole(VERSION) == Some(SECOND_VERSION) {
        // Extremes, mean, compression, logarithm, square, servo gain, range and three modes.
        header.skip(6 * 4 + 2 * 8 + 3 * 16)?;
        let types = [(0, Element::I16), (1, Element::I32), (2, Element::F32)];
        meaning("type of the data", header.u32()?, "0, 1 or 2", &types)?
    } else {
        Element::I16
    };
    let stored = Raster::rows(nodes, element, ByteOrder::Little, entry(DATA)?)?;
    let raster = stored.upside_down().scaled(gain * scale, gain * offset);
    let size = Sides::new(sides, &Unit::parse("µm"))?;
    let name = if name.is_empty() { "heights".to_owned() } else { name };
    Ok(vec![Channel::new(name, Unit::parse(&unit), size, raster)])
}

/// Reads text of `letters` letters of two bytes up to the first zero.
fn wide_text(cursor: &mut Cursor<'_>, letters: usize) -> Result<String, FormatError> {
    let (text, _) = UTF_16LE.decode_without_bom_handling(cursor.take(2 * letters)?);
    Ok(text.split('\0').next().unwrap_or_default().trim().to_owned())
}
