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
    let order = match bytes {
        [5, 0, ..] if has_valid_checksum(bytes, FILE + WAVE, i16::from_le_bytes) => {
            ByteOrder::Little
        }
        [0, 5, ..] if has_valid_checksum(bytes, FILE + WAVE, i16::from_be_bytes) => ByteOrder::Big,
        // The headers of version 2 have 16 and 110 bytes.
        [2, 0, ..] if has_valid_checksum(bytes, 126, i16::from_le_bytes) => return Err(version_2()),
        [0, 2, ..] if has_valid_checksum(bytes, 126, i16::from_be_bytes) => return Err(version_2()),
        _ => return Err(FormatError::Signature),
    };
    Wave::read(bytes, order)?.channels(bytes)
}

/// Returns true if the two-byte integers in the first `header` bytes add up to zero, as the format
/// requires. `number` decodes an integer in the byte order of the file.
fn has_valid_checksum(bytes: &[u8], header: usize, number: fn([u8; 2]) -> i16) -> bool {
    let Some(header) = bytes.get(..header) else {
        return false;
    };
    let (pairs, _) = header.as_chunks::<2>();
    let numbers = pairs.iter().map(|bytes| number(*bytes));
    numbers.fold(0, i16::wrapping_add) == 0
}

fn version_2() -> FormatError {
    FormatError::unsupported("a wave of version 2 is a curve, not a map; maps have version 5")
}

struct Wave {
    order: ByteOrder,
    element: Element,
    nodes: [usize; 2],
    channels: usize,
    steps: [f64; 2],
    unit: String,
    lateral: String,
    labels: Vec<String>,
    note: Entries,
}

impl Wave {
    fn read(bytes: &[u8], order: ByteOrder) -> Result<Wave, FormatError> {
        let at = |offset| Cursor::at(bytes, offset).ordered(order);
        let [x, y, layers, further] = [0, 1, 2, 3].map(|axis| at(FILE + 68 + 4 * axis).i32());
        if further? > 0 {
            return Err(FormatError::unsupported(
                "a wave of four dimensions is not a stack of maps",
            ));
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
        let note = latin1(part(12)?);
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
        let short = |offset| at(FILE + offset).text(4);
        let or = |long: String, short: String| if long.is_empty() { short } else { long };
        let real = "a type of real numbers";
        Ok(Wave {
            order,
            element: meaning("type of the wave", at(FILE + 16).i16()?, real, &TYPES)?,
            nodes: checked_nodes([x, y])?,
            channels: usize::try_from(layers).unwrap_or(0).max(1),
            steps: [at(FILE + 84).double()?, at(FILE + 92).double()?],
            unit: or(unit, short(148)?),
            lateral: or(lateral, short(152)?),
            labels,
            note: Entries::from_lines(note.split(['\r', '\n']), ':'),
        })
    }

    fn channels<'a>(&self, bytes: &'a [u8]) -> Result<Vec<Channel<'a>>, FormatError> {
        let nodes = self.nodes;
        let mut cursor = Cursor::at(bytes, FILE + WAVE);
        let size = Sides::of_steps(nodes, self.steps.map(f64::abs), &Unit::parse(&self.lateral))?;
        let channels = (0..self.channels).map(|index| {
            let stored = cursor.take(map_bytes(nodes, self.element))?;
            let raster = Raster::rows(nodes, self.element, self.order, stored)?;
            let label = self.labels.get(index).filter(|label| !label.is_empty());
            let name = label.map_or_else(|| "heights".to_owned(), String::clone);
            let unit = match label.filter(|_| !self.note.is_empty()) {
                Some(label) => asylum_unit(label, &self.note),
                None => &self.unit,
            };
            Ok(Channel::new(name, Unit::parse(unit), size.clone(), raster.upside_down()))
        });
        channels.collect()
    }
}

/// Returns the unit of a channel of Asylum Research, from the entry `NAMEUnit` of the note if there
/// is one, otherwise from [`UNITS`]. Suffixes of the name for the direction and the modulation, as
/// in `HeightTraceMod0`, are ignored.
fn asylum_unit<'a>(label: &str, note: &'a Entries) -> &'a str {
    let label = match label.rsplit_once("Mod") {
        Some((base, digits)) if digits.bytes().all(|byte| byte.is_ascii_digit()) => base,
        _ => label,
    };
    let directions = ["Retrace", "Trace"];
    let without = |label: &'_ str| {
        directions.iter().find_map(|end| label.strip_suffix(end).map(str::to_owned))
    };
    let base = without(label).unwrap_or_else(|| label.to_owned());
    if let Some(unit) = note.get(&format!("{base}Unit")) {
        return unit;
    }
    let passes = ["DAC", "Nap"];
    let quantity = passes.iter().find_map(|pass| base.strip_prefix(pass)).unwrap_or(&base);
    let known = UNITS.iter().find(|(start, _)| quantity.starts_with(start));
    known.map_or("V", |(_, unit)| unit)
}
