//! Wyko's OPD: a directory of blocks, of which one or more hold a raster and the others numbers.
//!
//! Size is nodes × `Pixel_size`, along y times `Aspect`. The numbers are in units of `Wavelength` /
//! `Mult`, which is in nanometres. Lines run along y, and the first number of a line has the largest
//! y. Missing are floats from 1e10 on, and whole numbers of two bytes from 32766 on.

use super::channel::{Channel, Size};
use super::cursor::Cursor;
use super::error::{FormatError, factor};
use super::format::Format;
use super::raster::{ByteOrder, Element, Missing, Raster, checked_nodes};
use super::unit::Unit;

pub const FORMAT: Format =
    Format { name: "opd", title: "Wyko", version: 1, has_signature: true, read };

/// Bytes of an entry of the directory.
const ENTRY: usize = 24;
/// Types of blocks.
const ARRAY: i16 = 3;
const FLOAT: i16 = 7;
const DOUBLE: i16 = 8;
const SHORT: i16 = 6;
const LONG: i16 = 12;
/// Arrays of heights; others hold intensities.
const HEIGHTS: [&str; 5] = ["Raw", "RAW_DATA", "RAW DATA", "OPD", "SAMPLE_DATA"];

struct Block<'a> {
    name: String,
    kind: i16,
    bytes: &'a [u8],
}

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    if bytes.get(2..11) != Some(b"Directory") {
        return Err(FormatError::Signature);
    }
    let blocks = blocks(bytes)?;
    let number = |name: &str| {
        let block = blocks.iter().find(|block| block.name == name);
        block.and_then(Block::number)
    };
    let missing = || FormatError::missing("Wavelength");
    let wavelength = number("Wavelength").ok_or_else(missing)?;
    let multiplier = factor("Mult", number("Mult").unwrap_or(1.0))?;
    let nanometres = factor("Wavelength", wavelength)? / multiplier;
    let rasters =
        blocks.iter().filter(|block| block.kind == ARRAY && HEIGHTS.contains(&&*block.name));
    let channels = rasters.map(|block| {
        let raster = raster(block.bytes)?.scaled(nanometres, 0.0);
        let nodes = raster.nodes().map(|count| count as f64);
        let size = match number("Pixel_size") {
            None => Size::Unknown,
            Some(step) => {
                let aspect = number("Aspect").unwrap_or(1.0);
                let sides = [nodes[0] * step, nodes[1] * step * aspect];
                Size::of(sides, &Unit::of("mm"))?
            }
        };
        Ok(Channel::new(&*block.name, Unit::of("nm"), size, raster))
    });
    let channels: Vec<Channel<'_>> = channels.collect::<Result<_, FormatError>>()?;
    match channels.is_empty() {
        true => Err(FormatError::missing("Raw")),
        false => Ok(channels),
    }
}

/// What the directory, the first block, lists; the blocks lie behind it in its order.
fn blocks(bytes: &[u8]) -> Result<Vec<Block<'_>>, FormatError> {
    let mut directory = Cursor::at(bytes, 2);
    let (_, _, length) = entry(&mut directory)?;
    let entries = (length / ENTRY).saturating_sub(1);
    let mut data = Cursor::at(bytes, 2);
    data.skip(length)?;
    let mut blocks = Vec::new();
    for _ in 0..entries {
        let (name, kind, length) = entry(&mut directory)?;
        let bytes = data.take(length)?;
        blocks.push(Block { name, kind, bytes });
    }
    Ok(blocks)
}

/// Name, type and length.
fn entry(cursor: &mut Cursor<'_>) -> Result<(String, i16, usize), FormatError> {
    let name = cursor.text(16)?;
    let kind = i16::from_le_bytes(cursor.array()?);
    let length = i32::from_le_bytes(cursor.array()?);
    cursor.skip(2)?;
    Ok((name, kind, usize::try_from(length).unwrap_or(0)))
}

impl Block<'_> {
    /// Some programs call a number of two bytes a float.
    fn number(&self) -> Option<f64> {
        let mut cursor = Cursor::new(self.bytes);
        match (self.kind, self.bytes.len()) {
            (SHORT | FLOAT, 2) => cursor.array().ok().map(|b| i16::from_le_bytes(b).into()),
            (SHORT | LONG, _) => cursor.array().ok().map(|b| i32::from_le_bytes(b).into()),
            (FLOAT, _) => cursor.array().ok().map(|b| f32::from_le_bytes(b).into()),
            (DOUBLE, _) => cursor.array().ok().map(f64::from_le_bytes),
            _ => None,
        }
    }
}

fn raster(bytes: &[u8]) -> Result<Raster<'_>, FormatError> {
    let mut cursor = Cursor::new(bytes);
    let mut whole = || Ok::<_, FormatError>(u16::from_le_bytes(cursor.array()?));
    let nodes = checked_nodes([whole()?.into(), whole()?.into()])?;
    let (element, missing) = match whole()? {
        1 => (Element::U8, Missing::None),
        2 => (Element::I16, Missing::From(32766.0)),
        4 => (Element::F32, Missing::From(1e10)),
        size => {
            let allowed = "1, 2 or 4";
            return Err(FormatError::value("bytes of a number", size, allowed));
        }
    };
    let raster = Raster::columns(nodes, element, ByteOrder::Little, cursor.rest())?;
    Ok(raster.missing(missing).upside_down())
}
