//! Igor binary waves, version 5, as written by microscopes of Asylum Research. A wave has a stack
//! of maps and a note with lines `name: value`.
//!
//! The sides are nodes × step. Lines run along x; the first line has the largest y. A wave has one
//! unit for all channels, which Asylum Research sets to metres even for phases. If the wave has a
//! note, the name of a channel therefore decides its unit.
//!
//! Files of Asylum Research in the tests of SurfaceTopography 1.27.1 and AFMReader 0.0.7 show this;
//! the layout is that of Technical Note 003 of WaveMetrics (Igor Pro 6).

use super::channel::{Channel, Sides};
use super::input::{Cursor, Entries, latin1};
use super::raster::{ByteOrder, Element, Raster, checked_nodes, map_bytes};
use super::unit::Unit;
use super::{Format, FormatError};

pub(crate) const FORMAT: Format = Format::new("ibw", "Igor binary wave", 2, read);

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

/// Headers of the file and of its data set, with the byte order of the numbers.
struct Header<'a> {
    bytes: &'a [u8],
    order: ByteOrder,
}

impl Header<'_> {
    fn number<const N: usize>(&self, offset: usize) -> Result<[u8; N], FormatError> {
        let mut number = Cursor::at(self.bytes, offset).array()?;
        if self.order == ByteOrder::Big {
            number.reverse();
        }
        Ok(number)
    }

    fn whole(&self, offset: usize) -> Result<i64, FormatError> {
        Ok(i32::from_le_bytes(self.number(offset)?).into())
    }

    fn length(&self, offset: usize) -> Result<usize, FormatError> {
        let length = self.whole(offset)?;
        let allowed = "a number that is not negative";
        usize::try_from(length).map_err(|_| FormatError::value("length of a part", length, allowed))
    }

    fn real(&self, offset: usize) -> Result<f64, FormatError> {
        Ok(f64::from_le_bytes(self.number(offset)?))
    }
}

impl Wave {
    fn read(bytes: &[u8], order: ByteOrder) -> Result<Wave, FormatError> {
        let header = Header { bytes, order };
        let dimension = |axis: usize| header.whole(FILE + 68 + 4 * axis);
        if dimension(3)? > 0 {
            return Err(FormatError::unsupported(
                "a wave of four dimensions is not a stack of maps",
            ));
        }
        // The numbers are followed by the formula, the note, the units of the numbers and of each
        // dimension, and the labels of each dimension.
        let mut trailer = Cursor::at(bytes, FILE);
        trailer.skip(header.length(4)?)?;
        trailer.skip(header.length(8)?)?;
        let note = latin1(trailer.take(header.length(12)?)?);
        let long_unit = trailer.text(header.length(16)?)?;
        let mut long_lateral = String::new();
        for axis in 0..4 {
            let unit = trailer.text(header.length(20 + 4 * axis)?)?;
            if axis == 0 {
                long_lateral = unit;
            }
        }
        let mut labels: Vec<Vec<String>> = Vec::new();
        for axis in 0..4 {
            let bytes = trailer.take(header.length(36 + 4 * axis)?)?;
            let (each, _) = bytes.as_chunks::<LABEL>();
            // The first label belongs to the dimension itself.
            let names = each.iter().skip(1).map(|bytes| Cursor::new(bytes).text(LABEL));
            labels.push(names.collect::<Result<_, _>>()?);
        }
        if dimension(1)? < 1 || (dimension(2)? < 1 && !labels[1].is_empty()) {
            return Err(FormatError::unsupported("the wave holds curves, not a map"));
        }
        let nodes = checked_nodes([dimension(0)?, dimension(1)?])?;
        let short = |offset| Cursor::at(bytes, FILE + offset).text(4);
        let or = |long: String, short: String| if long.is_empty() { short } else { long };
        Ok(Wave {
            order,
            element: element(i16::from_le_bytes(header.number(FILE + 16)?))?,
            nodes,
            channels: usize::try_from(dimension(2)?).unwrap_or(0).max(1),
            steps: [header.real(FILE + 84)?, header.real(FILE + 92)?],
            unit: or(long_unit, short(148)?),
            lateral: or(long_lateral, short(152)?),
            labels: labels.swap_remove(2),
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

fn element(code: i16) -> Result<Element, FormatError> {
    match code {
        0x02 => Ok(Element::F32),
        0x04 => Ok(Element::F64),
        0x08 => Ok(Element::I8),
        0x10 => Ok(Element::I16),
        0x20 => Ok(Element::I32),
        0x48 => Ok(Element::U8),
        0x50 => Ok(Element::U16),
        0x60 => Ok(Element::U32),
        _ => {
            let allowed = "a type of real numbers";
            Err(FormatError::value("type of the wave", code, allowed))
        }
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
