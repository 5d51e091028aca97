//! Formats of probe microscopes with a text header in sections: Nanosurf, Nanonis and WSxM. The
//! constant of each format documents its layout.

use std::collections::BTreeMap;

use super::channel::{Channel, NAME_FIRST, Sides, Size, directed};
use super::input::{Cursor, Entries, after, decode_text, factor, find, finite, latin1, meaning};
use super::number;
use super::raster::{ByteOrder, Element, Raster, checked_nodes, map_bytes};
use super::unit::{Unit, ratio};
use super::{Format, FormatError, at_least_one};

/// Files of Nanosurf microscopes, NID and EZD, with a text header in sections and maps of integers.
///
/// The section `DataSet` lists the channels in groups; a section for each channel gives its nodes
/// and the ranges of x, y and the height. The sides are the ranges of x and y. The maps follow the
/// line `#!` in the order of the list. Integers of n bits cover the range of the height from its
/// minimum. Lines run along x; the first line has the largest y. The format has no marker of
/// missing points. Channels of the z axis come first, because the deflection of the cantilever may
/// be in metres, too. Profiles and spectra are skipped.
///
/// Ten files of 2016 to 2019 (firmware 3.7 and 3.8), which NSFopen 2.2.4 ships, show the layout.
pub(crate) const NID: Format = Format::new("nid", "Nanosurf NID", read_nid).changed(&[NAME_FIRST]);

const NID_SIGNATURE: &[u8] = b"[DataSet]";
/// Marker of the end of the header, at the start of a line.
const NID_DATA: &[u8] = b"\n#!";
/// Maximum number of groups, and of channels in a group. A damaged header may give any number.
const NID_MAX_LISTED: i64 = 1000;

fn read_nid(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    after(bytes, NID_SIGNATURE)?;
    let end = find(bytes, NID_DATA)?;
    let header = decode_text(&bytes[..end]);
    let sections = sections(&header, '=');
    let list = sections.get("DataSet").ok_or_else(|| FormatError::missing("DataSet"))?;
    let mut data = Cursor::at(bytes, end + NID_DATA.len());
    let mut channels = Vec::new();
    for group in 0..list.whole("GroupCount")?.min(NID_MAX_LISTED) {
        // A group without count has no channels.
        let count = list.optional_whole(&format!("Gr{group}-Count"))?.unwrap_or(0);
        for index in 0..count.min(NID_MAX_LISTED) {
            let section = list.get(&format!("Gr{group}-Ch{index}"));
            if let Some(section) = section.and_then(|name| sections.get(name)) {
                channels.extend(nid_channel(section, &mut data)?);
            }
        }
    }
    if channels.is_empty() {
        let what = "the file holds no map, only profiles or spectra";
        return Err(FormatError::unsupported(what));
    }
    let is_surface = |name: &str| name.contains("Z-Axis") || name.contains("Topography");
    channels.sort_by_key(|channel| !is_surface(channel.name()));
    Ok(channels)
}

/// Reads a channel from `data`. Returns `None` for profiles, which have a single line, and for
/// spectra, whose lines are not positions.
fn nid_channel<'a>(
    section: &Entries,
    data: &mut Cursor<'a>,
) -> Result<Option<Channel<'a>>, FormatError> {
    meaning("SaveMode", section.text("SaveMode")?, "Binary", &[("Binary", ())])?;
    let bits = section.whole("SaveBits")?;
    let is_signed = section.get("SaveSign") != Some("Unsigned");
    let element = Element::integer(bits, is_signed)
        .ok_or_else(|| FormatError::value("SaveBits", bits, "8, 16, 32 or 64"))?;
    let order = ByteOrder::new(!matches!(section.get("SaveOrder"), None | Some("Intel")));
    let nodes = checked_nodes([section.whole("Points")?, section.whole("Lines")?])?;
    let stored = data.take(map_bytes(nodes, element))?;
    let unit = |name: &str| section.get(name).unwrap_or_default();
    let y = ratio(unit("Dim1Unit"), unit("Dim0Unit")).filter(|_| nodes[1] > 1);
    let Some(y) = y else {
        return Ok(None);
    };
    let range = factor("Dim2Range", section.number("Dim2Range")?)?;
    let lowest = section.optional_number("Dim2Min")?.unwrap_or(0.0);
    let middle = if is_signed { range / 2.0 } else { 0.0 };
    let offset = finite("Dim2Min", lowest + middle)?;
    let unscaled = Raster::rows(nodes, element, order, stored)?;
    let raster = unscaled.upside_down().scaled(range / 2_f64.powi(bits as i32), offset);
    let sides = [section.number("Dim0Range")?, section.number("Dim1Range")? * y];
    let size = Sides::new(sides, &Unit::parse(unit("Dim0Unit")))?;
    let name: Vec<&str> =
        [section.get("Frame"), section.get("Dim2Name")].into_iter().flatten().collect();
    Ok(Some(Channel::new(name.join(", "), Unit::parse(unit("Dim2Unit")), size, raster)))
}

/// Nanonis scans (`sxm`) of SPECS: a text header, and maps of big-endian `f32`.
///
/// The header has entries `:NAME:` with the lines of their values, and ends with `:SCANIT_END:`,
/// two line ends and the bytes 1A 04. `SCAN_PIXELS` and `SCAN_RANGE` are nodes and sides in metres
/// along x and y. `DATA_INFO` is a table of the channels with name, unit and direction; a channel
/// with the direction `both` has a forward map and a backward map, whose first number has the
/// largest x. Lines run along x; with `SCAN_DIR` down, the first line has the largest y, and with
/// up y = 0. NaN marks points that were not measured, as in scans that were stopped.
///
/// The layout is that of the readers nanonispy 1.1.0, spym 0.9.2 and Gwyddion 2.62 (`nanonis.c`).
pub(crate) const SXM: Format = Format::new("sxm", "Nanonis scan", read_sxm);

const SXM_SIGNATURE: &[u8] = b":NANONIS_VERSION:";
const SXM_END: &[u8] = b":SCANIT_END:";
/// Bytes before the numbers.
const SXM_START: &[u8] = b"\x1a\x04";

fn read_sxm(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    after(bytes, SXM_SIGNATURE)?;
    let end = find(bytes, SXM_END)?;
    let start = find(&bytes[end..], SXM_START)?;
    let header = SxmHeader::new(&latin1(&bytes[..end]));
    let nodes = header.pair("SCAN_PIXELS")?.map(|count| count as i64);
    let nodes = checked_nodes(nodes)?;
    let size = Size::metres(header.pair("SCAN_RANGE")?)?;
    let is_down = header.text("SCAN_DIR")?.eq_ignore_ascii_case("down");
    let mut cursor = Cursor::at(bytes, end + start + SXM_START.len());
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
struct SxmHeader(Vec<(String, Vec<String>)>);

impl SxmHeader {
    fn new(text: &str) -> SxmHeader {
        let mut entries: Vec<(String, Vec<String>)> = Vec::new();
        for line in text.lines().map(str::trim) {
            let name = line.strip_prefix(':').and_then(|line| line.strip_suffix(':'));
            match (name, entries.last_mut()) {
                (Some(name), _) if !name.is_empty() => entries.push((name.to_owned(), vec![])),
                (_, Some((_, lines))) if !line.is_empty() => lines.push(line.to_owned()),
                _ => {}
            }
        }
        SxmHeader(entries)
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

/// Image files of WSxM, such as `.top` and `.stp`, with a text header in sections and a map.
///
/// The header gives the sides of the map, `X Amplitude` and `Y Amplitude`. Floats are in the unit
/// of the `Z Amplitude`. Integers are multiplied by the Z amplitude over their range, `Maximum` −
/// `Minimum`, or over the range of the numbers if the header has no such entries, as in files of
/// Gwyddion 2.62. Numbers in the header may have a decimal comma: Gwyddion writes them as the
/// desktop does. The map is turned by 180°: lines run along x, and the first number has the largest
/// x and the largest y. The format has no marker of missing points.
///
/// Twelve files in the tests of AFMReader 0.0.7 and the exports of Gwyddion 2.62 show the layout.
pub(crate) const WSXM: Format = Format::new("wsxm", "WSxM image", read_wsxm)
    .changed(&["decimal commas, and files without `Maximum` and `Minimum`"]);

const WSXM_END: &[u8] = b"[Header end]";

fn read_wsxm(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let start = latin1(&bytes[..bytes.len().min(400)]);
    let mut lines = start.lines();
    // The text exports of WSxM have the same first line; the reader of text files reads them.
    let is_image = lines.next().is_some_and(|line| line.starts_with("WSxM file copyright"))
        && lines.next() == Some("SxM Image file");
    if !is_image {
        return Err(FormatError::Signature);
    }
    // The numbers start after the line that ends the header.
    let end = find(bytes, WSXM_END)?;
    let line_end = find(&bytes[end..], b"\n")?;
    let header = latin1(&bytes[..end]);
    let sections = sections(&header, ':');
    let empty = Entries::default();
    let [info, control, miscellaneous] = ["General Info", "Control", "Miscellaneous"]
        .map(|section| sections.get(section).unwrap_or(&empty));
    let nodes = checked_nodes([info.whole("Number of columns")?, info.whole("Number of rows")?])?;
    let stored = &bytes[end + line_end + 1..];
    let (amplitude, unit) = info.quantity("Z Amplitude")?;
    let (element, scale) = match info.get("Image Data Type") {
        None | Some("short" | "integer") => {
            let limit = |name: &str| miscellaneous.get(name).map(wsxm_number);
            let range = match (limit("Maximum"), limit("Minimum")) {
                (Some(highest), Some(lowest)) => {
                    let wrong = || FormatError::missing("Miscellaneous/Maximum and Minimum");
                    highest.ok_or_else(wrong)? - lowest.ok_or_else(wrong)?
                }
                _ => wsxm_range(&Raster::rows(nodes, Element::I16, ByteOrder::Little, stored)?),
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
    let (x, unit_x) = control.quantity("X Amplitude")?;
    let (y, unit_y) = match control.get("Y Amplitude") {
        // The scan is a square.
        None => (x, unit_x.clone()),
        Some(_) => control.quantity("Y Amplitude")?,
    };
    let size = Sides::in_units([x, y], [&unit_x, &unit_y])?;
    let unscaled = Raster::rows(nodes, element, ByteOrder::Little, stored)?;
    let raster = unscaled.upside_down().mirrored().scaled(factor("Z Amplitude", scale)?, 0.0);
    let name = info.get("Acquisition channel").unwrap_or("heights");
    let channel = Channel::new(name, Unit::parse(&unit), size, raster);
    Ok(vec![channel])
}

/// Parses a number with a decimal point or comma.
fn wsxm_number(text: &str) -> Option<f64> {
    number::parse(&text.replacen(',', ".", 1))
}

/// Returns the difference of the highest and the lowest number of a map.
fn wsxm_range(raster: &Raster<'_>) -> f64 {
    let numbers = raster.decode();
    numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max)
        - numbers.iter().copied().fold(f64::INFINITY, f64::min)
}

/// Splits a header into its sections `[name]` of lines with a name and a value, separated by
/// `between`.
fn sections(header: &str, between: char) -> BTreeMap<&str, Entries> {
    let mut sections: BTreeMap<&str, Entries> = BTreeMap::new();
    let mut current = "";
    for line in header.lines().map(str::trim) {
        if let Some(name) = line.strip_prefix('[').and_then(|line| line.strip_suffix(']')) {
            current = name;
        } else if let Some((name, value)) = line.split_once(between) {
            sections.entry(current).or_default().insert(name, value);
        }
    }
    sections
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_spectra_holds_no_map() {
        let file = "[DataSet]\nGroupCount=1\nGr0-Count=1\nGr0-Ch0=DataSet-0:0\n[DataSet-0:0]\n\
                    Points=2\nLines=2\nDim0Unit=m\nDim1Unit=\nSaveMode=Binary\nSaveBits=8\n#!1234";
        let error = read_nid(file.as_bytes()).unwrap_err();
        assert_eq!(error.to_string(), "the file holds no map, only profiles or spectra");
    }
}
