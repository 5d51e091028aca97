//! Molecular Imaging's and Agilent's files: a text header whose names fill 14 columns, and maps of
//! whole numbers, one behind the other.
//!
//! Sides are those of the whole map, in metres. Lines run along x, and the first has the largest y.
//! A number is a share of `bufferRange`, in units of 2^15 or 2^31.

use super::channel::{Channel, Size};
use super::cursor::{Cursor, latin1};
use super::entries::Entries;
use super::error::FormatError;
use super::format::Format;
use super::raster::{ByteOrder, Element, Raster, bytes_of, checked_nodes};
use super::unit::Unit;

pub const FORMAT: Format =
    Format { name: "mi", title: "Molecular Imaging", version: 1, has_signature: true, read };

/// Columns of a name.
const NAME: usize = 14;

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    if !bytes.starts_with(b"fileType      ") {
        return Err(FormatError::Signature);
    }
    let (header, buffers, data) = header(bytes)?;
    let kind = header.text("fileType")?;
    if kind != "Image" {
        return Err(FormatError::value("fileType", kind, "Image"));
    }
    let (element, range) = match header.text("data")? {
        "BINARY" | "" => (Element::I16, 32768.0),
        "BINARY_32" => (Element::I32, 2147483648.0),
        other => {
            let allowed = "BINARY or BINARY_32";
            return Err(FormatError::value("data", other, allowed));
        }
    };
    let nodes = checked_nodes([header.whole("xPixels")?, header.whole("yPixels")?])?;
    let size = Size::metres([header.number("xLength")?, header.number("yLength")?])?;
    let mut cursor = Cursor::at(bytes, data);
    let channels = buffers.iter().map(|buffer| {
        let stored = cursor.take(bytes_of(nodes, element))?;
        let raster = Raster::rows(nodes, element, ByteOrder::Little, stored)?;
        let raster = raster.upside_down().scaled(buffer.number("bufferRange")? / range, 0.0);
        let name = buffer.text("bufferLabel")?;
        let unit = Unit::of(buffer.get("bufferUnit").unwrap_or_default());
        Ok(Channel::new(name, unit, size, raster))
    });
    let channels: Vec<Channel<'_>> = channels.collect::<Result<_, FormatError>>()?;
    match channels.is_empty() {
        true => Err(FormatError::missing("bufferLabel")),
        false => Ok(channels),
    }
}

/// What is said of all maps, of each map, and where the maps start.
fn header(bytes: &[u8]) -> Result<(Entries, Vec<Entries>, usize), FormatError> {
    let mut header = Entries::default();
    let mut buffers: Vec<Entries> = Vec::new();
    let mut place = 0;
    for line in bytes.split_inclusive(|&byte| byte == b'\n') {
        place += line.len();
        // Lines that start with a space go on with the one above.
        if line.first() == Some(&b' ') {
            continue;
        }
        let line = str::from_utf8(line).map_or_else(|_| latin1(line), str::to_owned);
        let (name, value) = line.split_at_checked(NAME).unwrap_or((&line, ""));
        if name.trim() == "bufferLabel" {
            buffers.push(Entries::default());
        }
        match name.trim() == "data" {
            true => {
                header.insert(name, value);
                return Ok((header, buffers, place));
            }
            false => buffers.last_mut().unwrap_or(&mut header).insert(name, value),
        }
    }
    Err(FormatError::missing("data"))
}
