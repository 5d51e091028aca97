//! FRT's MicroProf: blocks, each with a number and a length, of which 0x0B and 0x7D hold maps.
//!
//! Sides are those of the whole map, in metres. Lines run along x, and the first has the largest y.
//! The number 1 marks missing points.

use super::channel::{Channel, Size};
use super::cursor::Cursor;
use super::error::{FormatError, factor};
use super::format::Format;
use super::raster::{ByteOrder, Element, Missing, Raster, bytes_of, checked_nodes};
use super::unit::Unit;

pub const FORMAT: Format =
    Format { name: "frt", title: "FRT MicroProf", version: 1, has_signature: true, read };

/// Blocks: nodes and bits of a number, sides, metres of a number, the map, several maps.
const GRID: u16 = 0x66;
const SIDES: u16 = 0x67;
const SCALE: u16 = 0x6c;
const MAP: u16 = 0x0b;
const MAPS: u16 = 0x7d;

/// Kinds of maps that are heights: topography, thickness, thickness of the sample, force microscopy.
const HEIGHTS: u32 = 0x0004 | 0x0080 | 0x0800 | 0x1000;

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    if !bytes.starts_with(b"FRTM_GLIDERV") {
        return Err(FormatError::Signature);
    }
    let blocks = blocks(bytes)?;
    let block = |wanted: u16, name: &str| {
        let block = blocks.iter().find(|(number, _)| *number == wanted);
        let bytes = block.map(|(_, bytes)| Cursor::new(bytes));
        bytes.ok_or_else(|| FormatError::missing(format!("block {wanted:#04x}, {name}")))
    };
    let mut sides = block(SIDES, "the sides")?;
    let mut real = || Ok::<_, FormatError>(f64::from_le_bytes(sides.array()?));
    let size = Size::metres([real()?, real()?])?;
    let mut scale = block(SCALE, "the scale of heights")?;
    scale.skip(4)?;
    let scale = factor("scale of heights", f64::from_le_bytes(scale.array()?))?;
    if let Ok(mut map) = block(MAP, "the map") {
        let raster = raster(&mut block(GRID, "the nodes")?, &mut map)?;
        return Ok(vec![Channel::new("heights", Unit::of("m"), size, raster.scaled(scale, 0.0))]);
    }
    let mut maps = block(MAPS, "the maps")?;
    maps.skip(8)?;
    let mut channels = Vec::new();
    while !maps.rest().is_empty() {
        let kind = u32::from_le_bytes(maps.array()?);
        let mut header = maps.clone();
        maps.skip(12)?;
        let raster = raster(&mut header, &mut maps)?;
        if kind & HEIGHTS != 0 {
            let name = format!("heights {}", channels.len() + 1);
            let raster = raster.scaled(scale, 0.0);
            channels.push(Channel::new(name, Unit::of("m"), size, raster));
        }
    }
    match channels.is_empty() {
        true => Err(FormatError::missing("block 0x0b, the map")),
        false => Ok(channels),
    }
}

/// A map whose nodes and bits of a number are read from one place and its numbers from another.
fn raster<'a>(header: &mut Cursor<'_>, stored: &mut Cursor<'a>) -> Result<Raster<'a>, FormatError> {
    let mut whole = || Ok::<_, FormatError>(u32::from_le_bytes(header.array()?));
    let nodes = checked_nodes([whole()?.into(), whole()?.into()])?;
    let element = match whole()? {
        16 => Element::U16,
        32 => Element::I32,
        bits => {
            let allowed = "16 or 32";
            return Err(FormatError::value("bits of a number", bits, allowed));
        }
    };
    let stored = stored.take(bytes_of(nodes, element))?;
    let raster = Raster::rows(nodes, element, ByteOrder::Little, stored)?;
    Ok(raster.missing(Missing::Value(1.0)).upside_down())
}

/// Numbers and contents of all blocks.
fn blocks(bytes: &[u8]) -> Result<Vec<(u16, &[u8])>, FormatError> {
    let mut cursor = Cursor::at(bytes, 12);
    let version = cursor.text(4)?;
    let count = u16::from_le_bytes(cursor.array()?);
    let mut blocks = Vec::new();
    for _ in 0..count {
        let number = u16::from_le_bytes(cursor.array()?);
        let length = match version.as_str() {
            "1.00" => u32::from_le_bytes(cursor.array()?).into(),
            "1.01" => u64::from_le_bytes(cursor.array()?),
            _ => {
                let allowed = "1.00 or 1.01";
                return Err(FormatError::value("version", version, allowed));
            }
        };
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        blocks.push((number, cursor.take(length)?));
    }
    Ok(blocks)
}
