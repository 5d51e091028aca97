//! Digital Surf's surfaces, which MountainsMap and several instruments write: a header of 512
//! bytes, a comment, a private zone, whole numbers of two or four bytes.
//!
//! Size is nodes × spacing. Lines run along x and the first has y = 0, unless the header says that
//! the map was turned over. The number `zmin` − 2 marks points that were not measured. Files that
//! start with `DSCOMPRESSED` hold the numbers as zlib streams behind a directory of their lengths.
//! Of several objects in a file the first is read.

use std::borrow::Cow;

use flate2::read::ZlibDecoder;

use super::channel::{Channel, Size};
use super::cursor::Cursor;
use super::error::{FormatError, factor};
use super::format::Format;
use super::inflate::inflate;
use super::raster::{ByteOrder, Element, Missing, Raster, bytes_of, checked_nodes};
use super::unit::{Unit, ratio};

pub const FORMAT: Format =
    Format { name: "sur", title: "Digital Surf", version: 1, has_signature: true, read };

/// Bytes before the comment.
const HEADER: usize = 512;

/// Kinds of objects that are maps of heights, alone or first: a surface, a series or layers of
/// them, a surface with its image.
const SURFACES: [u16; 6] = [2, 5, 8, 11, 13, 16];

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let is_compressed = match bytes.get(..12) {
        Some(b"DIGITAL SURF") => false,
        Some(b"DSCOMPRESSED") => true,
        _ => return Err(FormatError::Signature),
    };
    let header = Header::read(&mut Cursor::at(bytes, 12))?;
    let mut cursor = Cursor::at(bytes, HEADER);
    cursor.skip(header.behind)?;
    let stored = match is_compressed {
        true => Cow::Owned(decompressed(&mut cursor, header.bytes())?),
        false => Cow::Borrowed(cursor.rest()),
    };
    Ok(vec![header.channel(stored)?])
}

struct Header {
    nodes: [usize; 2],
    element: Element,
    has_missing: bool,
    lowest: i32,
    spacing: [f64; 3],
    units: [String; 3],
    inversion: u16,
    /// Bytes of comment and private zone.
    behind: usize,
}

impl Header {
    /// What follows the signature.
    fn read(cursor: &mut Cursor<'_>) -> Result<Header, FormatError> {
        cursor.skip(6)?;
        let kind = u16::from_le_bytes(cursor.array()?);
        if !SURFACES.contains(&kind) {
            let allowed = "that of a surface (2, 5, 8, 11, 13 or 16)";
            return Err(FormatError::value("type of the object", kind, allowed));
        }
        cursor.skip(66)?;
        let special = u16::from_le_bytes(cursor.array()?);
        cursor.skip(10)?;
        let bits = u16::from_le_bytes(cursor.array()?);
        let element = match bits {
            16 => Element::I16,
            32 => Element::I32,
            _ => return Err(FormatError::value("bits of a point", bits, "16 or 32")),
        };
        let lowest = i32::from_le_bytes(cursor.array()?);
        cursor.skip(4)?;
        let mut whole = || Ok(i32::from_le_bytes(cursor.array()?).into());
        let nodes = checked_nodes([whole()?, whole()?])?;
        cursor.skip(4)?;
        let mut single = || Ok(f32::from_le_bytes(cursor.array()?).into());
        let spacing = [single()?, single()?, single()?];
        cursor.skip(3 * 16)?;
        let units = [cursor.text(16)?, cursor.text(16)?, cursor.text(16)?];
        cursor.skip(3 * 16 + 3 * 4 + 2)?;
        let inversion = u16::from_le_bytes(cursor.array()?);
        cursor.skip(42)?;
        let mut length = || Ok(usize::from(u16::from_le_bytes(cursor.array()?)));
        let behind = length()? + length()?;
        Ok(Header {
            nodes,
            element,
            has_missing: special == 1,
            lowest,
            spacing,
            units,
            inversion,
            behind,
        })
    }

    fn bytes(&self) -> usize {
        bytes_of(self.nodes, self.element)
    }

    fn channel<'a>(&self, stored: Cow<'a, [u8]>) -> Result<Channel<'a>, FormatError> {
        let nodes = self.nodes;
        let raster = Raster::rows(nodes, self.element, ByteOrder::Little, stored)?;
        let raster = match self.has_missing {
            true => raster.missing(Missing::Value(f64::from(self.lowest) - 2.0)),
            false => raster,
        };
        // As in Gwyddion: turned over, and mirrored along one of the axes with it.
        let raster = match self.inversion {
            2 => raster.mirrored(),
            3 => raster.upside_down(),
            _ => raster,
        };
        let sign = if (1..=3).contains(&self.inversion) { -1.0 } else { 1.0 };
        let scale = factor("spacing of z", self.spacing[2])?;
        let [unit_x, unit_y, unit_z] = &self.units;
        // Both sides in the unit of the first.
        let y = ratio(unit_y, unit_x).ok_or_else(|| {
            FormatError::value("unit of y", unit_y, &format!("as that of x, `{unit_x}`"))
        })?;
        let sides = [nodes[0] as f64 * self.spacing[0], nodes[1] as f64 * self.spacing[1] * y];
        let size = Size::of(sides, &Unit::of(unit_x))?;
        let raster = raster.scaled(sign * scale, 0.0);
        Ok(Channel::new("heights", Unit::of(unit_z), size, raster))
    }
}

/// The bytes of all streams, one after another.
fn decompressed(cursor: &mut Cursor<'_>, needed: usize) -> Result<Vec<u8>, FormatError> {
    let streams = u32::from_le_bytes(cursor.array()?);
    let mut directory = Cursor::new(cursor.take((streams as usize).saturating_mul(8))?);
    let mut bytes = Vec::new();
    for number in 1..=streams {
        let raw = u32::from_le_bytes(directory.array()?) as usize;
        let compressed = cursor.take(u32::from_le_bytes(directory.array()?) as usize)?;
        // Streams may hold more objects than the first.
        let expected = raw.min(needed - bytes.len());
        let part = format!("stream {number} of {streams}");
        let reader = ZlibDecoder::new(compressed);
        bytes.extend(inflate(&part, reader, compressed.len(), expected)?);
    }
    Ok(bytes)
}
