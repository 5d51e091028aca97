//! Igor's binary waves, version 5, which Asylum Research's microscopes write: a stack of maps, all
//! x of one y behind each other, and a note of lines `name: value`.
//!
//! Size is nodes × step. The first number has the largest y. The wave has one unit for all
//! channels; where there is a note, the unit of a channel follows from its name, since Asylum
//! Research gives metres for phases, too.

use super::channel::{Channel, Size};
use super::input::{Cursor, Entries, latin1};
use super::raster::{ByteOrder, Element, Raster, bytes_of, checked_nodes};
use super::unit::Unit;
use super::{Format, FormatError};

pub const FORMAT: Format =
    Format { name: "ibw", title: "Igor binary wave", version: 1, has_signature: true, read };

/// Bytes of the file's header, of the wave's header.
const FILE: usize = 64;
const WAVE: usize = 320;
/// Bytes of a label.
const LABEL: usize = 32;

/// Units of Asylum Research's channels, by what their names start with; others are volts.
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
        [5, 0, ..] if checks(bytes, FILE + WAVE, i16::from_le_bytes) => ByteOrder::Little,
        [0, 5, ..] if checks(bytes, FILE + WAVE, i16::from_be_bytes) => ByteOrder::Big,
        // Their headers have 16 and 110 bytes.
        [2, 0, ..] if checks(bytes, 126, i16::from_le_bytes) => return Err(version_2()),
        [0, 2, ..] if checks(bytes, 126, i16::from_be_bytes) => return Err(version_2()),
        _ => return Err(FormatError::Signature),
    };
    Wave::read(bytes, order)?.channels(bytes)
}

/// The numbers of two bytes in the header of a sound file add up to zero.
fn checks(bytes: &[u8], header: usize, number: fn([u8; 2]) -> i16) -> bool {
    let Some(header) = bytes.get(..header) else {
        return false;
    };
    let (numbers, _) = header.as_chunks::<2>();
    let numbers = numbers.iter().map(|bytes| number(*bytes));
    numbers.fold(0, i16::wrapping_add) == 0
}

fn version_2() -> FormatError {
    FormatError::unsupported("a wave of version 2: a curve and no map; version 5 is read")
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

/// Numbers of either order.
struct Header<'a> {
    bytes: &'a [u8],
    order: ByteOrder,
}

impl Header<'_> {
    fn number<const N: usize>(&self, place: usize) -> Result<[u8; N], FormatError> {
        let mut number = Cursor::at(self.bytes, place).array()?;
        if self.order == ByteOrder::Big {
            number.reverse();
        }
        Ok(number)
    }

    fn whole(&self, place: usize) -> Result<i64, FormatError> {
        Ok(i32::from_le_bytes(self.number(place)?).into())
    }

    /// A number of bytes.
    fn length(&self, place: usize) -> Result<usize, FormatError> {
        let length = self.whole(place)?;
        let allowed = "not negative";
        usize::try_from(length).map_err(|_| FormatError::value("length of a part", length, allowed))
    }

    fn real(&self, place: usize) -> Result<f64, FormatError> {
        Ok(f64::from_le_bytes(self.number(place)?))
    }
}

impl Wave {
    fn read(bytes: &[u8], order: ByteOrder) -> Result<Wave, FormatError> {
        let header = Header { bytes, order };
        let dimension = |axis: usize| header.whole(FILE + 68 + 4 * axis);
        if dimension(3)? > 0 {
            return Err(FormatError::unsupported("a wave of four dimensions"));
        }
        // What lies behind the numbers: formula, note, units of the numbers and of each dimension,
        // labels of each dimension.
        let mut behind = Cursor::at(bytes, FILE);
        behind.skip(header.length(4)?)?;
        behind.skip(header.length(8)?)?;
        let note = latin1(behind.take(header.length(12)?)?);
        let long_unit = behind.text(header.length(16)?)?;
        let mut long_lateral = String::new();
        for axis in 0..4 {
            let unit = behind.text(header.length(20 + 4 * axis)?)?;
            if axis == 0 {
                long_lateral = unit;
            }
        }
        let mut labels: Vec<Vec<String>> = Vec::new();
        for axis in 0..4 {
            let bytes = behind.take(header.length(36 + 4 * axis)?)?;
            let (each, _) = bytes.as_chunks::<LABEL>();
            // The first one is that of the dimension itself.
            let names = each.iter().skip(1).map(|bytes| Cursor::new(bytes).text(LABEL));
            labels.push(names.collect::<Result<_, _>>()?);
        }
        if dimension(1)? < 1 || (dimension(2)? < 1 && !labels[1].is_empty()) {
            return Err(FormatError::unsupported("a wave of curves and no map"));
        }
        let nodes = checked_nodes([dimension(0)?, dimension(1)?])?;
        let short = |place| Cursor::at(bytes, FILE + place).text(4);
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
            note: Entries::of_lines(note.split(['\r', '\n']), ':'),
        })
    }

    fn channels<'a>(&self, bytes: &'a [u8]) -> Result<Vec<Channel<'a>>, FormatError> {
        let nodes = self.nodes;
        let mut cursor = Cursor::at(bytes, FILE + WAVE);
        let sides = [0, 1].map(|axis| nodes[axis] as f64 * self.steps[axis].abs());
        let size = Size::of(sides, &Unit::of(&self.lateral))?;
        let channels = (0..self.channels).map(|index| {
            let stored = cursor.take(bytes_of(nodes, self.element))?;
            let raster = Raster::rows(nodes, self.element, self.order, stored)?;
            let label = self.labels.get(index).filter(|label| !label.is_empty());
            let name = label.map_or_else(|| "heights".to_owned(), String::clone);
            let unit = match label.filter(|_| !self.note.is_empty()) {
                Some(label) => of_asylum(label, &self.note),
                None => &self.unit,
            };
            Ok(Channel::new(name, Unit::of(unit), size, raster.upside_down()))
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
            let allowed = "that of real numbers";
            Err(FormatError::value("type of the wave", code, allowed))
        }
    }
}

/// The unit of a channel of Asylum Research, without what tells its direction and modulation.
fn of_asylum<'a>(label: &str, note: &'a Entries) -> &'a str {
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
    let quantity = passes.iter().find_map(|pass| base.strip_prefix(pass));
    let quantity = quantity.unwrap_or(&base);
    let known = UNITS.iter().find(|(start, _)| quantity.starts_with(start));
    known.map_or("V", |(_, unit)| unit)
}
