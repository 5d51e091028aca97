//! Gwyddion's simple field: text lines `Name = value`, zeros up to a multiple of four bytes, floats
//! of single precision.
//!
//! Sides are those of the whole map, and unknown where they are not given. Lines run along x and the
//! first has y = 0. NaN marks missing points.

use super::channel::{Channel, Size};
use super::cursor::{Cursor, latin1};
use super::entries::Entries;
use super::error::FormatError;
use super::format::Format;
use super::raster::{ByteOrder, Element, Raster, checked_nodes};
use super::unit::Unit;

pub const FORMAT: Format =
    Format { name: "gsf", title: "Gwyddion simple field", version: 1, has_signature: true, read };

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let magic = b"Gwyddion Simple Field 1.0\n";
    if !bytes.starts_with(magic) {
        return Err(FormatError::Signature);
    }
    let end = bytes.iter().position(|&byte| byte == 0);
    let end = end.ok_or_else(|| FormatError::missing("zeros behind the header"))?;
    let header = &bytes[magic.len()..end];
    let header = str::from_utf8(header).map_or_else(|_| latin1(header), str::to_owned);
    let lines = header.lines().filter_map(|line| line.split_once('='));
    let entries: Entries = lines.collect();
    let nodes = checked_nodes([entries.whole("XRes")?, entries.whole("YRes")?])?;
    // At least one zero, and as many as make a multiple of four.
    let mut cursor = Cursor::at(bytes, (end + 1).next_multiple_of(4));
    let stored = cursor.take(nodes[0] * nodes[1] * 4)?;
    let raster = Raster::rows(nodes, Element::F32, ByteOrder::Little, stored)?;
    let unit = |name| Unit::of(entries.get(name).unwrap_or_default());
    let sides = [entries.optional_number("XReal")?, entries.optional_number("YReal")?];
    let size = match sides {
        [Some(x), Some(y)] => Size::of([x, y], &unit("XYUnits"))?,
        _ => Size::Unknown,
    };
    let title = entries.get("Title").unwrap_or("heights");
    Ok(vec![Channel::new(title, unit("ZUnits"), size, raster)])
}
