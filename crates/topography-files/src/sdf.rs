//! Surface data files of ISO 25178-71, and of its forerunner BCR: a header, as text or in 81 bytes,
//! and a matrix, as text or as numbers of one of eight types.
//!
//! Lengths are metres, size is points × scale. A profile runs along x and the first has y = 0.
//! Missing points are `BAD` in text, and the largest of unsigned, the lowest of signed whole numbers
//! of two and four bytes.

use super::channel::{Channel, Size};
use super::cursor::{Cursor, latin1};
use super::entries::Entries;
use super::error::{FormatError, factor};
use super::format::Format;
use super::raster::{ByteOrder, Element, Missing, Raster, checked_nodes};
use super::unit::Unit;

pub const FORMAT: Format = Format {
    name: "sdf",
    title: "surface data file, ISO 25178-71",
    version: 1,
    has_signature: true,
    read,
};

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let channel = match bytes.get(..8) {
        Some(b"aISO-1.0" | b"aBCR-1.0") => text(&bytes[8..])?,
        Some(b"bISO-1.0" | b"bBCR-1.0") => binary(bytes)?,
        _ => return Err(FormatError::Signature),
    };
    Ok(vec![channel])
}

fn binary(bytes: &[u8]) -> Result<Channel<'_>, FormatError> {
    // Signature, who and when.
    let mut cursor = Cursor::at(bytes, 8 + 10 + 12 + 12);
    let mut whole = || Ok(u16::from_le_bytes(cursor.array()?).into());
    let nodes = [whole()?, whole()?];
    let mut real = || Ok(f64::from_le_bytes(cursor.array()?));
    let scales = [real()?, real()?, real()?];
    real()?;
    let [compression, kind, _] = cursor.array()?;
    let header = Header::of(nodes, scales, compression.into(), kind.into())?;
    let raster = Raster::rows(header.nodes, header.element, ByteOrder::Little, cursor.rest())?;
    header.channel(raster)
}

fn text(bytes: &[u8]) -> Result<Channel<'_>, FormatError> {
    let text = latin1(bytes);
    let mut parts = text.splitn(3, '*');
    let header = parts.next().unwrap_or_default();
    let matrix = parts.next().ok_or_else(|| FormatError::missing("* behind the header"))?;
    let entries: Entries = header.lines().filter_map(|line| line.split_once('=')).collect();
    let scale = |name| entries.number(name);
    let header = Header::of(
        [entries.whole("NumPoints")?, entries.whole("NumProfiles")?],
        [scale("Xscale")?, scale("Yscale")?, scale("Zscale")?],
        entries.get("Compression").map_or(Ok(0), |_| entries.whole("Compression"))?,
        entries.whole("DataType")?,
    )?;
    let nodes = header.nodes;
    let count = nodes[0] * nodes[1];
    let words = matrix.split_ascii_whitespace();
    let number = |word: &str| match word.eq_ignore_ascii_case("bad") {
        true => Ok(f64::NAN),
        false => word.parse().map_err(|_| FormatError::value("height", word, "a number, or BAD")),
    };
    let heights: Vec<f64> = words.map(number).collect::<Result<_, _>>()?;
    if heights.len() != count {
        let allowed = format!("{} × {} = {count}", nodes[0], nodes[1]);
        let found = heights.len();
        return Err(FormatError::value("number of heights", found, &allowed));
    }
    header.channel(Raster::of_rows(nodes, heights))
}

struct Header {
    nodes: [usize; 2],
    scales: [f64; 3],
    element: Element,
}

impl Header {
    fn of(
        nodes: [i64; 2],
        scales: [f64; 3],
        compression: i64,
        kind: i64,
    ) -> Result<Header, FormatError> {
        if compression != 0 {
            let allowed = "0, none";
            return Err(FormatError::value("Compression", compression, allowed));
        }
        let element = match kind {
            0 => Element::U8,
            1 => Element::U16,
            2 => Element::U32,
            3 => Element::F32,
            4 => Element::I8,
            5 => Element::I16,
            6 => Element::I32,
            7 => Element::F64,
            _ => return Err(FormatError::value("DataType", kind, "0 to 7")),
        };
        Ok(Header { nodes: checked_nodes(nodes)?, scales, element })
    }

    fn channel<'a>(&self, raster: Raster<'a>) -> Result<Channel<'a>, FormatError> {
        let missing = match self.element {
            Element::U16 => Missing::Value(u16::MAX.into()),
            Element::U32 => Missing::Value(u32::MAX.into()),
            Element::I16 => Missing::Value(i16::MIN.into()),
            Element::I32 => Missing::Value(i32::MIN.into()),
            Element::U8 | Element::I8 | Element::F32 | Element::F64 => Missing::None,
        };
        let [x, y, z] = self.scales;
        let scale = factor("Zscale", z)?;
        let raster = raster.missing(missing).scaled(scale, 0.0);
        let size = Size::metres([self.nodes[0] as f64 * x, self.nodes[1] as f64 * y])?;
        Ok(Channel::new("heights", Unit::Length(1.0), size, raster))
    }
}
