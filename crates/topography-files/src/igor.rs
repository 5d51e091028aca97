//! Igor binary waves, version 5, as written by microscopes of Asylum Research. A wave has a stack
//! of maps and a note with lines `name: value`.
//!
//! The sides are nodes × step. Lines run along x; the first line has the largest y. A wave has one
//! unit for all channels, which Asylum Research sets to metres even for phases. If the wave has a
//! note, the name of a channel therefore decides its unit.
//!
//! Files of Asylum Research in the tests of SurfaceTopography 1.27.1 and AFMReader 0.0.7 show this;
//! the layout is that of Technical Note 003 of WaveMetrics (Igor Pro 6).

use super::channel::{Channel, NAME_FIRST, Sides};
use super::input::{Cursor, Entries, latin1, meaning, zero_ended};
use super::raster::{ByteOrder, Element, Raster, checked_nodes, map_bytes};
use super::unit::Unit;
use super::{Format, FormatError};

pub(crate) const FORMAT: Format =
    Format::new("ibw", "Igor binary wave", read).changed(&[NAME_FIRST]);

/// Length of the file header, in bytes.
const FILE: usize = 64;
/// Length of the header of a data set (an Igor "wave"), in bytes.
const WAVE: usize = 320;
/// Length of a label, in bytes.
const LABEL: usize = 32;

/// Units of the channels of Asylum Research, by the beginning of the channel's name. Other channels
/// are in volts.
const UNITS: [(&str, &str); 11] = [
    ("Height", "m"),
    ("ZSensor", "m"),
    ("Deflection", "m"),
    ("Amplitude", "m"),
    ("Phase", "deg"),
    ("Current", "A"),
    ("Frequency", "Hz"),
    ("Capacitance", "F"),
    ("Potential", "V"),
    ("Count", "1"),
    ("QFactor", "1"),
];

/// Types of the numbers.
const TYPES: [(i16, Element); 8] = [
    (0x02, Element::F32),
    (0x04, Element::F64),
    (0x08, Element::I8),
    (0x10, Element::I16),
    (0x20, Element::I32),
    (0x48, Element::U8),
    (0x50, Element::U16),
    (0x60, Element::U32),
];

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let (order, version) = match bytes {
        [version @ (2 | 5), 0, ..] => (ByteOrder::Little, version),
        [0, version @ (2 | 5), ..] => (ByteOrder::Big, version),
        _ => return Err(FormatError::Signature),
    };
    // The headers of version 2 have 16 and 110 bytes. The integers in them add up to zero.
    let length = if *version == 2 { 126 } else { FILE + WAVE };
    let header = bytes.get(..length).ok_or(FormatError::Signature)?;
    if Element::I16.numbers(order, header).iter().sum::<f64>() % 65536.0 != 0.0 {
        return Err(FormatError::Signature);
    }
    if *version == 2 {
        let what = "a wave of version 2 is a curve, not a map; maps have version 5";
        return Err(FormatError::unsupported(what));
    }
    let at = |offset| Cursor::at(bytes, offset).ordered(order);
    let [x, y, layers, further] = [0, 1, 2, 3].map(|axis| at(FILE + 68 + 4 * axis).i32());
    if further? > 0 {
        return Err(FormatError::unsupported("a wave of four dimensions is not a stack of maps"));
    }
    let (x, y, layers) = (x?, y?, layers?);
    // The numbers are followed by the formula, the note, the units of the numbers and of each
    // dimension, and the labels of each dimension. The header has their lengths.
    let mut trailer = Cursor::at(bytes, FILE);
    let mut part = |length: usize| {
        let length = at(length).i32()?;
        let allowed = "a number that is not negative";
        let wrong = |_| FormatError::value("length of a part", length, allowed);
        trailer.take(usize::try_from(length).map_err(wrong)?)
    };
    part(4)?;
    part(8)?;
    let note = Entries::from_lines(latin1(part(12)?).split(['\r', '\n']), ':');
    let [unit, lateral] = [part(16)?, part(20)?].map(zero_ended);
    for further in [24, 28, 32, 36] {
        part(further)?;
    }
    // The first label of a dimension belongs to the dimension itself.
    let mut labels = |length: usize| -> Result<Vec<String>, FormatError> {
        let (each, _) = part(length)?.as_chunks::<LABEL>();
        Ok(each.iter().skip(1).map(|label| zero_ended(label)).collect())
    };
    let has_lines = !labels(40)?.is_empty();
    let labels = labels(44)?;
    part(48)?;
    if y < 1 || (layers < 1 && has_lines) {
        return Err(FormatError::unsupported("the wave holds curves, not a map"));
    }
    let nodes = checked_nodes([x, y])?;
    let real = "a type of real numbers";
    let element = meaning("type of the wave", at(FILE + 16).i16()?, real, &TYPES)?;
    let steps = [at(FILE + 84).double()?.abs(), at(FILE + 92).double()?.abs()];
    let or = |long: String, short: String| if long.is_empty() { short } else { long };
    let unit = or(unit, at(FILE + 148).text(4)?);
    let lateral = or(lateral, at(FILE + 152).text(4)?);
    let size = Sides::of_steps(nodes, steps, &Unit::parse(&lateral))?;
    let mut data = Cursor::at(bytes, FILE + WAVE);
    let channels = (0..layers.max(1) as usize).map(|index| {
        let stored = data.take(map_bytes(nodes, element))?;
        let raster = Raster::rows(nodes, element, order, stored)?.upside_down();
        let label = labels.get(index).filter(|label| !label.is_empty());
        let unit = match label.filter(|_| !note.is_empty()) {
            Some(label) => asylum_unit(label, &note),
            None => &unit,
        };
        let name = label.map_or("heights", String::as_str);
        Ok(Channel::new(name, Unit::parse(unit), size.clone(), raster))
    });
    channels.collect()
}

/// Returns the unit of a channel of Asylum Research, from the entry `NAMEUnit` of the note if there
/// is one, otherwise from [`UNITS`]. Suffixes of the name for the direction and the modulation, as
/// in `HeightTraceMod0`, are ignored.
fn asylum_unit<'a>(label: &str, note: &'a Entries) -> &'a str {
    let label = match label.rsplit_once("Mod") {
        Some((base, digits)) if digits.bytes().all(|byte| byte.is_ascii_digit()) => base,
        _ => label,
    };
    let base = label.strip_suffix("Retrace").or(label.strip_suffix("Trace")).unwrap_or(label);
    if let Some(unit) = note.get(&format!("{base}Unit")) {
        return unit;
    }
    let quantity = base.strip_prefix("DAC").or(base.strip_prefix("Nap")).unwrap_or(base);
    let known = UNITS.iter().find(|(start, _)| quantity.starts_with(start));
    known.map_or("V", |(_, unit)| unit)
}
