//! Images of WSxM (`top`, `stp`), a program for scanning probe microscopes.
//!
//! A text header with sections precedes the numbers. Lines run along x; the first number has the
//! largest x and the largest y. The sides are `X Amplitude` and `Y Amplitude`. Floats are in the
//! unit of `Z Amplitude`. For integers, `Z Amplitude` is the difference of the largest and the
//! smallest height, and the header gives the two integers that are stored for them.

use std::collections::BTreeMap;

use super::channel::{Channel, Size};
use super::input::{factor, finite, latin1};
use super::raster::{ByteOrder, Element, Raster, checked_nodes};
use super::unit::Unit;
use super::{Format, FormatError};

pub const FORMAT: Format =
    Format { name: "wsxm", title: "WSxM image", version: 1, has_signature: true, read };

const SIGNATURE: &[u8] = b"WSxM file copyright";
const HEADER_END: &[u8] = b"[Header end]";

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    if !bytes.starts_with(SIGNATURE) {
        return Err(FormatError::Signature);
    }
    let missing = || FormatError::missing("[Header end]");
    let end = bytes.windows(HEADER_END.len()).position(|window| window == HEADER_END);
    let (header, rest) = bytes.split_at(end.ok_or_else(missing)?);
    // The numbers start after the line end.
    let start = rest.iter().position(|&byte| byte == b'\n').ok_or_else(missing)? + 1;
    let header = Header::new(&latin1(header))?;
    let count = |name| header.number("General Info", name).map(|count| count as i64);
    let nodes = checked_nodes([count("Number of columns")?, count("Number of rows")?])?;
    let element = match header.text("General Info", "Image Data Type").unwrap_or("short") {
        "short" | "integer" => Element::I16,
        "float" => Element::F32,
        "double" => Element::F64,
        other => {
            let allowed = "short, integer, float or double";
            return Err(FormatError::value("Image Data Type", other, allowed));
        }
    };
    let raster = Raster::rows(nodes, element, ByteOrder::Little, &rest[start..])?;
    let raster = raster.upside_down().mirrored();
    let (amplitude, unit) = header.quantity("General Info", "Z Amplitude")?;
    let raster = if element == Element::I16 {
        let stored = |name| header.number("Miscellaneous", name);
        let range = factor("Maximum − Minimum", stored("Maximum")? - stored("Minimum")?)?;
        raster.scaled(finite("Z Amplitude", amplitude)? / range, 0.0)
    } else {
        raster
    };
    let (x, x_unit) = header.quantity("Control", "X Amplitude")?;
    // A scan without an amplitude along y is square.
    let (y, y_unit) = match header.text("Control", "Y Amplitude") {
        Some(_) => header.quantity("Control", "Y Amplitude")?,
        None => (x, x_unit.clone()),
    };
    let size = match (x_unit.per_metre(), y_unit.per_metre()) {
        (Some(per_x), Some(per_y)) => Size::metres([x / per_x, y / per_y])?,
        _ => Size::Unknown,
    };
    let name = header.text("General Info", "Acquisition channel").unwrap_or("heights");
    Ok(vec![Channel::new(name, unit, size, raster)])
}

/// Entries of the header by section and name.
struct Header(BTreeMap<(String, String), String>);

impl Header {
    fn new(text: &str) -> Result<Header, FormatError> {
        let mut lines = text.lines().map(str::trim).skip(1);
        let kind = lines.next().unwrap_or_default();
        if kind != "SxM Image file" {
            return Err(FormatError::value("kind of file", kind, "SxM Image file"));
        }
        let mut entries = BTreeMap::new();
        let mut section = String::new();
        for line in lines {
            if let Some(name) = line.strip_prefix('[').and_then(|name| name.strip_suffix(']')) {
                section = name.to_owned();
            } else if let Some((name, value)) = line.split_once(':') {
                entries.insert((section.clone(), name.trim().to_owned()), value.trim().to_owned());
            }
        }
        Ok(Header(entries))
    }

    fn text(&self, section: &str, name: &str) -> Option<&str> {
        let value = self.0.get(&(section.to_owned(), name.to_owned()))?;
        Some(value.as_str()).filter(|value| !value.is_empty())
    }

    fn number(&self, section: &str, name: &str) -> Result<f64, FormatError> {
        let text = self.text(section, name).ok_or_else(|| FormatError::missing(name))?;
        text.parse().map_err(|_| FormatError::value(name, text, "a number"))
    }

    /// Returns a number and its unit.
    fn quantity(&self, section: &str, name: &str) -> Result<(f64, Unit), FormatError> {
        let text = self.text(section, name).ok_or_else(|| FormatError::missing(name))?;
        let (number, unit) = text.split_once(' ').unwrap_or((text, ""));
        let parsed = number.parse();
        let number = parsed.map_err(|_| FormatError::value(name, text, "a number with a unit"))?;
        Ok((number, Unit::parse(unit)))
    }
}
