//! Files of Nanosurf microscopes, NID and EZD, with a text header in sections and maps of integers.
//!
//! The section `DataSet` lists the channels in groups; a section for each channel gives its nodes
//! and the ranges of x, y and the height. The sides are the ranges of x and y. The maps follow the
//! line `#!` in the order of the list. Integers of n bits cover the range of the height from its
//! minimum. Lines run along x; the first line has the largest y. The format has no marker of
//! missing points. Channels of the z axis come first, because the deflection of the cantilever may
//! be in metres, too. Profiles and spectra are skipped.
//!
//! Ten files of 2016 to 2019 (firmware 3.7 and 3.8), which NSFopen 2.2.4 ships, show the layout.

use std::collections::BTreeMap;

use super::channel::{Channel, NAME_FIRST, Sides};
use super::input::{Cursor, Entries, after, decode_text, factor, find, finite};
use super::raster::{ByteOrder, Element, Raster, checked_nodes, map_bytes};
use super::unit::{Unit, ratio};
use super::{Format, FormatError};

pub(crate) const FORMAT: Format = Format::new("nid", "Nanosurf NID", read).changed(&[NAME_FIRST]);

const SIGNATURE: &[u8] = b"[DataSet]";
/// Marker of the end of the header, at the start of a line.
const DATA: &[u8] = b"\n#!";
/// Maximum number of groups, and of channels in a group. A damaged header may give any number.
const MAX_LISTED: i64 = 1000;

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    after(bytes, SIGNATURE)?;
    let end = find(bytes, DATA)?;
    let sections = sections(&decode_text(&bytes[..end]));
    let list = &sections["DataSet"];
    let mut data = Cursor::at(bytes, end + DATA.len());
    let mut channels = Vec::new();
    for group in 0..list.whole("GroupCount")?.min(MAX_LISTED) {
        // A group without count has no channels.
        let count = list.optional_whole(&format!("Gr{group}-Count"))?.unwrap_or(0);
        for index in 0..count.min(MAX_LISTED) {
            let section = list.get(&format!("Gr{group}-Ch{index}"));
            if let Some(section) = section.and_then(|name| sections.get(name)) {
                channels.extend(channel(section, &mut data)?);
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

/// Splits the header into its sections, by their names. There is always a section `DataSet`.
fn sections(header: &str) -> BTreeMap<String, Entries> {
    let mut sections = BTreeMap::from([("DataSet".to_owned(), Entries::default())]);
    let mut current = "DataSet".to_owned();
    for line in header.lines().map(str::trim) {
        if let Some(name) = line.strip_prefix('[').and_then(|line| line.strip_suffix(']')) {
            current = name.to_owned();
        } else if let Some((name, value)) = line.split_once('=') {
            sections.entry(current.clone()).or_default().insert(name, value);
        }
    }
    sections
}

/// Reads a channel from `data`. Returns `None` for profiles, which have a single line, and for
/// spectra, whose lines are not positions.
fn channel<'a>(
    section: &Entries,
    data: &mut Cursor<'a>,
) -> Result<Option<Channel<'a>>, FormatError> {
    let mode = section.text("SaveMode")?;
    if mode != "Binary" {
        return Err(FormatError::value("SaveMode", mode, "Binary"));
    }
    let bits = section.whole("SaveBits")?;
    let is_signed = section.get("SaveSign") != Some("Unsigned");
    let element = Element::integer(bits, is_signed)
        .ok_or_else(|| FormatError::value("SaveBits", bits, "8, 16, 32 or 64"))?;
    let order = match section.get("SaveOrder") {
        None | Some("Intel") => ByteOrder::Little,
        Some(_) => ByteOrder::Big,
    };
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_of_spectra_holds_no_map() {
        let file = "[DataSet]\nGroupCount=1\nGr0-Count=1\nGr0-Ch0=DataSet-0:0\n[DataSet-0:0]\n\
                    Points=2\nLines=2\nDim0Unit=m\nDim1Unit=\nSaveMode=Binary\nSaveBits=8\n#!1234";
        let error = read(file.as_bytes()).unwrap_err();
        assert_eq!(error.to_string(), "the file holds no map, only profiles or spectra");
    }
}
