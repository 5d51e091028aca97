//! Zygo's MetroPro: a header of 834 or 4096 bytes, big end first, intensities, and phases as whole
//! numbers of four bytes.
//!
//! Size is nodes × lateral resolution, in metres, and unknown where that is zero. A height is
//! phase × S W O / R of the MetroPro Reference Guide: scale factor of the interferometer, wavelength,
//! obliquity, and steps of the phase in a wavelength. Lines run along x and the first has y = 0.
//! Phases from 2147483640 on are missing.

use super::channel::{Channel, Size};
use super::cursor::Cursor;
use super::error::{FormatError, factor};
use super::format::Format;
use super::raster::{ByteOrder, Element, Missing, Raster, checked_nodes};
use super::unit::Unit;

pub const FORMAT: Format =
    Format { name: "metropro", title: "Zygo MetroPro", version: 1, has_signature: true, read };

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let header = match bytes.get(..4) {
        Some(b"\x88\x1b\x03\x6f" | b"\x88\x1b\x03\x70") => 834,
        Some(b"\x88\x1b\x03\x71") => 4096,
        _ => return Err(FormatError::Signature),
    };
    let single = |place| {
        let bytes = Cursor::at(bytes, place).array()?;
        Ok::<_, FormatError>(f64::from(f32::from_be_bytes(bytes)))
    };
    let short = |place| {
        let bytes = Cursor::at(bytes, place).array()?;
        Ok::<_, FormatError>(i16::from_be_bytes(bytes))
    };
    let intensities = u32::from_be_bytes(Cursor::at(bytes, 60).array()?) as usize;
    let nodes = [short(68)?, short(70)?].map(|count| count.cast_unsigned().into());
    let nodes = checked_nodes(nodes)?;
    let steps = match short(218)? {
        0 => 4096.0,
        1 => 32768.0,
        2 => 131072.0,
        code => return Err(FormatError::value("phase resolution", code, "0, 1 or 2")),
    };
    let sign = if short(232)? == 0 { 1.0 } else { -1.0 };
    let interferometer = factor("scale factor of the interferometer", single(164)?)?;
    let wavelength = factor("wavelength", single(168)?)?;
    let obliquity = factor("obliquity factor", single(176)?)?;
    let step = single(184)?;
    let size = match step == 0.0 {
        true => Size::Unknown,
        false => Size::metres(nodes.map(|count| count as f64 * step))?,
    };
    let stored = Cursor::at(bytes, header + intensities).rest();
    let raster = Raster::rows(nodes, Element::I32, ByteOrder::Big, stored)?;
    let raster = raster
        .missing(Missing::From(2147483640.0))
        .scaled(sign * interferometer * obliquity * wavelength / steps, 0.0);
    Ok(vec![Channel::new("heights", Unit::of("m"), size, raster)])
}
