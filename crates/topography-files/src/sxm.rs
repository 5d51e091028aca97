//! Nanonis scans (`sxm`) of SPECS: a text header, and maps of big-endian `f32`.
//!
//! The header has entries `:NAME:` with the lines of their values, and ends with `:SCANIT_END:`,
//! two line ends and the bytes 1A 04. `SCAN_PIXELS` and `SCAN_RANGE` are nodes and sides in metres
//! along x and y. `DATA_INFO` is a table of the channels with name, unit and direction; a channel
//! with the direction `both` has a forward map and a backward map, whose first number has the
//! largest x. Lines run along x; with `SCAN_DIR` down, the first line has the largest y, and with
//! up y = 0. NaN marks points that were not measured, as in scans that were stopped.
//!
//! The layout is that of the readers nanonispy 1.1.0, spym 0.9.2 and Gwyddion 2.62 (`nanonis.c`).

use super::channel::{Channel, Size};
use super::input::{Cursor, after, find, latin1, meaning};
use super::jpk::directed;
use super::raster::{ByteOrder, Element, Raster, checked_nodes, map_bytes};
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

pub(crate) const FORMAT: Format = Format::new("sxm", "Nanonis scan", read);

const SIGNATURE: &[u8] = b":NANONIS_VERSION:";
const END: &[u8] = b":SCANIT_END:";
/// Bytes before the numbers.
const START: &[u8] = b"\x1a\x04";

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    after(bytes, SIGNATURE)?;
    let end = find(bytes, END)?;
    let start = find(&bytes[end..], START)?;
    let header = Header::new(&latin1(&bytes[..end]));
    let nodes = header.pair("SCAN_PIXELS")?.map(|count| count as i64);
    let nodes = checked_nodes(nodes)?;
    let size = Size::metres(header.pair("SCAN_RANGE")?)?;
    let is_down = header.text("SCAN_DIR")?.eq_ignore_ascii_case("down");
    let mut cursor = Cursor::at(bytes, end + start + START.len());
    let mut channels = Vec::new();
    for (name, unit, directions) in header.channels()? {
        let known: [(&str, &[bool]); 3] =
            [("both", &[false, true]), ("forward", &[false]), ("backward", &[true])];
        let allowed = "both, forward or backward";
        for &is_back in meaning("Direction", &*directions, allowed, &known)? {
            let stored = cursor.take(map_bytes(nodes, Element::F32))?;
            let raster = Raster::rows(nodes, Element::F32, ByteOrder::Big, stored)?;
            let raster = if is_down { raster.upside_down() } else { raster };
            let raster = if is_back { raster.mirrored() } else { raster };
            let name = directed(name.clone(), is_back);
            channels.push(Ok(Channel::new(name, Unit::parse(&unit), size, raster)));
        }
    }
    at_least_one(channels, "DATA_INFO")
}

/// Entries of the header with the lines of their values.
struct Header(Vec<(String, Vec<String>)>);

impl Header {
    fn new(text: &str) -> Header {
        let mut entries: Vec<(String, Vec<String>)> = Vec::new();
        for line in text.lines().map(str::trim) {
            let name = line.strip_prefix(':').and_then(|line| line.strip_suffix(':'));
            match (name, entries.last_mut()) {
                (Some(name), _) if !name.is_empty() => entries.push((name.to_owned(), vec![])),
                (_, Some((_, lines))) if !line.is_empty() => lines.push(line.to_owned()),
                _ => {}
            }
        }
        Header(entries)
    }

    fn lines(&self, name: &str) -> Result<&[String], FormatError> {
        let entry = self.0.iter().find(|(known, _)| known == name);
        entry.map(|(_, lines)| lines.as_slice()).ok_or_else(|| FormatError::missing(name))
    }

    fn text(&self, name: &str) -> Result<&str, FormatError> {
        self.lines(name)?.first().map(String::as_str).ok_or_else(|| FormatError::missing(name))
    }

    fn pair(&self, name: &str) -> Result<[f64; 2], FormatError> {
        let text = self.text(name)?;
        let numbers: Vec<f64> = text.split_whitespace().filter_map(|n| n.parse().ok()).collect();
        <[f64; 2]>::try_from(numbers).map_err(|_| FormatError::value(name, text, "two numbers"))
    }

    /// Returns name, unit and direction of the channels. The first line of the table has titles.
    fn channels(&self) -> Result<Vec<(String, String, String)>, FormatError> {
        let rows = self.lines("DATA_INFO")?.iter().skip(1).map(|line| {
            let cells: Vec<&str> = line.split_whitespace().collect();
            match *cells.as_slice() {
                // Names have underscores in place of spaces.
                [_, name, unit, direction, ..] => {
                    Ok((name.replace('_', " "), unit.to_owned(), direction.to_lowercase()))
                }
                _ => Err(FormatError::value("DATA_INFO", line, "number, name, unit, direction")),
            }
        });
        rows.collect()
    }
}
