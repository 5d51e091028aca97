//! Alicona's AL3D: lines of 52 bytes, each a name of 20, a value of 30 and a line end, and floats of
//! single precision at `DepthImageOffset`.
//!
//! Lengths are metres, size is nodes × size of a pixel. Lines run along x, the first has y = 0, and
//! each starts at a multiple of 8 bytes from the first. `InvalidPixelValue` marks missing points.

use super::channel::{Channel, Size};
use super::cursor::Cursor;
use super::entries::Entries;
use super::error::FormatError;
use super::format::Format;
use super::raster::{ByteOrder, Element, Missing, Raster, checked_nodes};
use super::unit::Unit;

pub const FORMAT: Format =
    Format { name: "al3d", title: "Alicona Imaging", version: 1, has_signature: true, read };

const MAGIC: &[u8] = b"AliconaImaging\0\r\n";

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    if !bytes.starts_with(MAGIC) {
        return Err(FormatError::Signature);
    }
    let mut cursor = Cursor::at(bytes, MAGIC.len());
    let mut entries = Entries::default();
    // The version and the number of lines behind this one.
    line(&mut cursor, &mut entries)?;
    line(&mut cursor, &mut entries)?;
    for _ in 0..entries.whole("TagCount")? {
        line(&mut cursor, &mut entries)?;
    }
    let nodes = checked_nodes([entries.whole("Cols")?, entries.whole("Rows")?])?;
    let offset = match usize::try_from(entries.whole("DepthImageOffset")?) {
        Ok(offset) if offset > 0 => offset,
        _ => {
            let what = "a file without depth image: a picture and no map";
            return Err(FormatError::unsupported(what));
        }
    };
    let stored = Cursor::at(bytes, offset).rest();
    let stride = (4 * nodes[0]).next_multiple_of(8);
    let raster = Raster::padded_rows(nodes, Element::F32, ByteOrder::Little, stride, stored)?;
    let missing = match entries.optional_number("InvalidPixelValue")? {
        Some(marker) => Missing::Around(marker),
        None => Missing::None,
    };
    let size = Size::metres([
        nodes[0] as f64 * entries.number("PixelSizeXMeter")?,
        nodes[1] as f64 * entries.number("PixelSizeYMeter")?,
    ])?;
    let raster = raster.missing(missing);
    Ok(vec![Channel::new("heights", Unit::of("m"), size, raster)])
}

fn line(cursor: &mut Cursor<'_>, entries: &mut Entries) -> Result<(), FormatError> {
    let (name, value) = (cursor.text(20)?, cursor.text(30)?);
    cursor.skip(2)?;
    entries.insert(&name, &value);
    Ok(())
}
