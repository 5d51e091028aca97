//! Sensofar's PLU: a header of 500 bytes and layers of floats of single precision.
//!
//! Lengths are micrometres, size is nodes × size of a pixel. Lines run along x and the first has
//! y = 0. The number 1000001 marks missing points. Such files have no signature: they are known by
//! a date in words, a kind of measurement, and layers that fill the file.

use super::channel::{Channel, Size};
use super::cursor::Cursor;
use super::error::FormatError;
use super::format::Format;
use super::raster::{ByteOrder, Element, Missing, Raster, bytes_of, checked_nodes};
use super::unit::Unit;

pub const FORMAT: Format =
    Format { name: "plu", title: "Sensofar", version: 1, has_signature: false, read };

/// Bytes before the calibration, the kind of measurement, the number of layers, the layers.
const CALIBRATION: usize = 128 + 4 + 256;
const KIND: usize = CALIBRATION + 40;
const LAYERS: usize = KIND + 20 + 40;
const DATA: usize = LAYERS + 12;

/// Kinds of measurements.
const PROFILE: u32 = 1;
const TOPOGRAPHY: u32 = 3;

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let date = Cursor::new(bytes).take(128).unwrap_or_default();
    let length = date.iter().position(|&byte| byte == 0).unwrap_or(0);
    let is_printable = |byte: &u8| (b' '..=b'~').contains(byte);
    if !(10..100).contains(&length) || !date[..length].iter().all(is_printable) {
        return Err(FormatError::Signature);
    }
    let whole = |place| Ok::<_, FormatError>(u32::from_le_bytes(Cursor::at(bytes, place).array()?));
    match whole(KIND)? {
        TOPOGRAPHY => {}
        PROFILE => return Err(FormatError::unsupported("a profile and no map")),
        _ => return Err(FormatError::Signature),
    }
    let single = |place| {
        let bytes = Cursor::at(bytes, place).array()?;
        Ok::<_, FormatError>(f64::from(f32::from_le_bytes(bytes)))
    };
    let steps = [single(CALIBRATION + 16)?, single(CALIBRATION + 20)?];
    let [layers] = Cursor::at(bytes, LAYERS + 1).array()?;
    let [images] = Cursor::at(bytes, LAYERS + 4).array()?;
    if layers == 0 {
        return Err(FormatError::value("number of layers", layers, "positive"));
    }
    let mut cursor = Cursor::at(bytes, DATA);
    let layers = (0..layers).map(|number| layer(&mut cursor, number, images.into(), steps));
    layers.collect()
}

/// A layer: lines, columns, heights, the lowest and the highest, and pictures of three bytes a node.
fn layer<'a>(
    cursor: &mut Cursor<'a>,
    number: u8,
    images: usize,
    steps: [f64; 2],
) -> Result<Channel<'a>, FormatError> {
    let mut whole = || Ok::<_, FormatError>(u32::from_le_bytes(cursor.array()?).into());
    let [y, x] = [whole()?, whole()?];
    let nodes = checked_nodes([x, y])?;
    let stored = cursor.take(bytes_of(nodes, Element::F32))?;
    cursor.skip(8 + 3 * images * nodes[0] * nodes[1])?;
    let raster = Raster::rows(nodes, Element::F32, ByteOrder::Little, stored)?;
    let raster = raster.missing(Missing::Value(1000001.0));
    let sides = [0, 1].map(|axis| nodes[axis] as f64 * steps[axis]);
    let size = Size::of(sides, &Unit::of("µm"))?;
    let name = format!("layer{number}");
    Ok(Channel::new(name, Unit::of("µm"), size, raster))
}
