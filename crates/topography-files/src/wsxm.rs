//! Image files of WSxM, such as `.top` and `.stp`, with a text header in sections and a map.
//!
//! The header gives the sides of the map, `X Amplitude` and `Y Amplitude`. Floats are in the unit
//! of the `Z Amplitude`. Integers are multiplied by the Z amplitude over their range, `Maximum` −
//! `Minimum`, or over the range of the numbers if the header has no such entries, as in files of
//! Gwyddion 2.62. Numbers in the header may have a decimal comma: Gwyddion writes them as the
//! desktop does. The map is turned by 180°: lines run along x, and the first number has the largest
//! x and the largest y. The format has no marker of missing points.
//!
//! Twelve files in the tests of AFMReader 0.0.7 and the exports of Gwyddion 2.62 show the layout.

use super::channel::{Channel, Sides};
use super::input::{Entries, factor, find, latin1};
use super::number;
use super::raster::{ByteOrder, Element, Raster, checked_nodes};
use super::unit::Unit;
use super::{Format, FormatError};

pub(crate) const FORMAT: Format = Format::new("wsxm", "WSxM image", read)
    .changed(&["decimal commas, and files without `Maximum` and `Minimum`"]);

const END: &[u8] = b"[Header end]";

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let start = latin1(&bytes[..bytes.len().min(400)]);
    let mut lines = start.lines();
    // The text exports of WSxM have the same first line; the reader of text files reads them.
    let is_image = lines.next().is_some_and(|line| line.starts_with("WSxM file copyright"))
        && lines.next() == Some("SxM Image file");
    if !is_image {
        return Err(FormatError::Signature);
    }
    // The numbers start after the line that ends the header.
    let end = find(bytes, END)?;
    let line_end = find(&bytes[end..], b"\n")?;
    let entries = entries(&latin1(&bytes[..end]));
    let nodes = checked_nodes([
        entries.whole("General Info/Number of columns")?,
        entries.whole("General Info/Number of rows")?,
    ])?;
    let stored = &bytes[end + line_end + 1..];
    let (amplitude, unit) = entries.quantity("General Info/Z Amplitude")?;
    let (element, scale) = match entries.get("General Info/Image Data Type") {
        None | Some("short" | "integer") => {
            let limit = |name: &str| entries.get(&format!("Miscellaneous/{name}")).map(number);
            let range = match (limit("Maximum"), limit("Minimum")) {
                (Some(highest), Some(lowest)) => {
                    let wrong = || FormatError::missing("Miscellaneous/Maximum and Minimum");
                    highest.ok_or_else(wrong)? - lowest.ok_or_else(wrong)?
                }
                _ => range(&Raster::rows(nodes, Element::I16, ByteOrder::Little, stored)?),
            };
            // Any scale is right for a flat map, whose range is zero.
            (Element::I16, if range == 0.0 { 1.0 } else { amplitude / range })
        }
        Some("float") => (Element::F32, 1.0),
        Some("double") => (Element::F64, 1.0),
        Some(other) => {
            let allowed = "short, integer, float or double";
            return Err(FormatError::value("Image Data Type", other, allowed));
        }
    };
    let (x, unit_x) = entries.quantity("Control/X Amplitude")?;
    let (y, unit_y) = match entries.get("Control/Y Amplitude") {
        // The scan is a square.
        None => (x, unit_x.clone()),
        Some(_) => entries.quantity("Control/Y Amplitude")?,
    };
    let size = Sides::in_units([x, y], [&unit_x, &unit_y])?;
    let unscaled = Raster::rows(nodes, element, ByteOrder::Little, stored)?;
    let raster = unscaled.upside_down().mirrored().scaled(factor("Z Amplitude", scale)?, 0.0);
    let name = entries.get("General Info/Acquisition channel").unwrap_or("heights");
    let channel = Channel::new(name, Unit::parse(&unit), size, raster);
    Ok(vec![channel])
}

/// Parses the header. The names of the entries are `section/name`.
fn entries(header: &str) -> Entries {
    let mut entries = Entries::default();
    let mut section = "";
    for line in header.lines().map(str::trim) {
        if let Some(name) = line.strip_prefix('[').and_then(|line| line.strip_suffix(']')) {
            section = name;
        } else if let Some((name, value)) = line.split_once(':') {
            entries.insert(&format!("{section}/{name}"), value);
        }
    }
    entries
}

/// Parses a number with a decimal point or comma.
fn number(text: &str) -> Option<f64> {
    number::parse(&text.replacen(',', ".", 1))
}

/// Returns the difference of the highest and the lowest number of a map.
fn range(raster: &Raster<'_>) -> f64 {
    let numbers = raster.decode();
    let [lowest, highest] =
        numbers.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &number| {
            [low.min(number), high.max(number)]
        });
    highest - lowest
}
