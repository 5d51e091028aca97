//! Grids of geographic programs: ESRI ASCII grids and Surfer grids. The constant of each format
//! documents its line order and sides.

use std::collections::BTreeMap;

use super::channel::{Channel, Sides};
use super::input::{Cursor, lines};
use super::number;
use super::raster::{ByteOrder, Element, Missing, Raster, checked_nodes};
use super::text::decoded;
use super::unit::Unit;
use super::{Format, FormatError};

/// ESRI ASCII grid (`.asc`), as written by ArcGIS, GDAL 3.10 (AAIGrid) and many others, and the
/// ASCII grid of GRASS 8 (`r.out.ascii`).
///
/// Lines `name value` precede the heights: `ncols`, `nrows`, the position of a corner or of the
/// centre of a cell, `cellsize`, or `dx` and `dy` of GDAL, and `NODATA_value`, which marks missing
/// points and is −9999 if it is not given. The sides are numbers of cells × size of a cell, without
/// a unit. GRASS writes `cols`, `rows`, the four edges of the grid and `null` in their place. The
/// first line of heights is the northernmost, with the largest y.
pub(crate) const ESRI: Format = Format::new("esri-asc", "ESRI ASCII grid", read_esri)
    .changed(&["grids of GRASS, `xdim`, `nodata` and other spellings"]);

/// Names of entries, each followed by its other spellings.
const ESRI_NAMES: [&[&str]; 13] = [
    &["ncols", "cols"],
    &["nrows", "rows"],
    &["xllcorner", "xllcenter", "xllcentre"],
    &["yllcorner", "yllcenter", "yllcentre"],
    &["cellsize"],
    &["dx", "xdim", "xcellsize"],
    &["dy", "ydim", "ycellsize"],
    &["nodata_value", "nodata", "null"],
    &["north"],
    &["south"],
    &["east"],
    &["west"],
    &["type"],
];
/// Number that marks missing points if the file does not name one.
const ESRI_MISSING: f64 = -9999.0;

fn read_esri(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let start = bytes.trim_ascii_start().first_chunk::<6>().map(|start| start.to_ascii_lowercase());
    let starts = [&b"ncols"[..], b"nrows", b"north:"];
    if !start.is_some_and(|start| starts.iter().any(|known| start.starts_with(known))) {
        return Err(FormatError::Signature);
    }
    let text = decoded(bytes)?;
    let mut entries: BTreeMap<&str, f64> = BTreeMap::new();
    let mut heights = Vec::new();
    for (index, line) in lines(&text).enumerate() {
        let mut words = line.split_whitespace().filter(|word| *word != "=");
        let first = words.clone().next().unwrap_or_default().to_ascii_lowercase();
        let first = first.trim_end_matches([':', '=']);
        let is_named = |names: &&&[&str]| heights.is_empty() && names.contains(&first);
        if let Some([name, ..]) = ESRI_NAMES.iter().find(is_named) {
            let text = words.nth(1).unwrap_or_default();
            let wrong = || FormatError::value(name, text, "a number");
            // The type of the numbers is a word.
            if *name != "type" {
                entries.insert(name, esri_number(text).ok_or_else(wrong)?);
            }
            continue;
        }
        for word in words {
            let wrong = || FormatError::Line {
                line: index + 1,
                problem: format!("`{word}` is neither a number nor an entry of the header"),
            };
            heights.push(esri_number(word).ok_or_else(wrong)?);
        }
    }
    let entry = |name: &str| entries.get(name).copied();
    let needed = |name: &str| entry(name).ok_or_else(|| FormatError::missing(name));
    let nodes = checked_nodes([needed("ncols")? as i64, needed("nrows")? as i64])?;
    let sides = match (entry("cellsize"), entry("east")) {
        (Some(step), _) => nodes.map(|count| count as f64 * step),
        (None, Some(east)) => [east - needed("west")?, needed("north")? - needed("south")?],
        (None, None) => [nodes[0] as f64 * needed("dx")?, nodes[1] as f64 * needed("dy")?],
    };
    let size = Sides::new(sides, &Unit::None)?;
    let missing = entry("nodata_value");
    let marker = missing.unwrap_or(ESRI_MISSING);
    let by_default =
        heights.iter().filter(|height| missing.is_none() && **height == marker).count();
    let raster = Raster::from_words(nodes, heights)?.upside_down().missing(Missing::Around(marker));
    let channel = Channel::new("heights", Unit::None, size, raster);
    let note = format!(
        "{by_default} points of {marker} count as missing, because the file has no `NODATA_value` \
         and this is its default"
    );
    Ok(vec![channel.noted((by_default > 0).then_some(note))])
}

/// Parses a number with a decimal point or comma; words for missing points are NaN.
fn esri_number(word: &str) -> Option<f64> {
    let with_point = || number::parse(&word.replacen(',', ".", 1));
    number::parse(word).or_else(with_point).or_else(|| number::is_missing(word).then_some(f64::NAN))
}

/// Grid of Golden Software Surfer (`.grd`): text (`DSAA`), Surfer 6 (`DSBB`) or Surfer 7 (`DSRB`).
///
/// The file gives the first and the last coordinate along each axis, or the steps (Surfer 7). The
/// sides are nodes × step, without a unit. Lines run along x; the first line has the smallest y.
/// Numbers from 1.70141e38 on mark missing points; Surfer 7 names its own marker. GDAL 3.10 writes
/// files of all three kinds.
pub(crate) const SURFER: Format = Format::new("surfer", "Surfer grid", read_surfer);

fn read_surfer(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let channel = match bytes.first_chunk::<4>() {
        Some(b"DSAA") => surfer_text(bytes)?,
        Some(b"DSBB") => surfer_6(bytes)?,
        Some(b"DSRB") => surfer_7(bytes)?,
        _ => return Err(FormatError::Signature),
    };
    Ok(vec![channel])
}

fn surfer_text<'a>(bytes: &[u8]) -> Result<Channel<'a>, FormatError> {
    let text = decoded(bytes)?;
    let mut words = text.split_whitespace().skip(1);
    let mut number = |entry: &str| {
        let word = words.next().ok_or_else(|| FormatError::missing(entry))?;
        number::parse(word).ok_or_else(|| FormatError::value(entry, word, "a number"))
    };
    let nodes = checked_nodes([number("nx")? as i64, number("ny")? as i64])?;
    let limits = [number("xlo")?, number("xhi")?, number("ylo")?, number("yhi")?];
    number("zlo")?;
    number("zhi")?;
    let heights = (0..nodes[0] * nodes[1]).map(|_| number("height"));
    let raster = Raster::from_rows(nodes, heights.collect::<Result<_, _>>()?);
    surfer_channel(nodes, limits, raster)
}

fn surfer_6(bytes: &[u8]) -> Result<Channel<'_>, FormatError> {
    let mut cursor = Cursor::at(bytes, 4);
    let nodes = checked_nodes([cursor.u16()?, cursor.u16()?])?;
    let limits = [cursor.double()?, cursor.double()?, cursor.double()?, cursor.double()?];
    cursor.skip(16)?;
    let raster = Raster::rows(nodes, Element::F32, ByteOrder::Little, cursor.rest())?;
    surfer_channel(nodes, limits, raster)
}

fn surfer_channel<'a>(
    nodes: [usize; 2],
    [xlo, xhi, ylo, yhi]: [f64; 4],
    raster: Raster<'a>,
) -> Result<Channel<'a>, FormatError> {
    let side = |axis: usize, range: f64| range / (nodes[axis] - 1) as f64 * nodes[axis] as f64;
    let size = Sides::new([side(0, xhi - xlo), side(1, yhi - ylo)], &Unit::None)?;
    // The marker is in single precision.
    Ok(Channel::new("heights", Unit::None, size, raster.missing(Missing::From(1.7014e38))))
}

/// Reads a file of sections, each with a tag of four bytes and its length.
fn surfer_7(bytes: &[u8]) -> Result<Channel<'_>, FormatError> {
    let mut cursor = Cursor::new(bytes);
    let mut grid = None;
    loop {
        let [tag, length] = [cursor.array()?, cursor.array()?];
        let section = cursor.take(u32::from_le_bytes(length) as usize)?;
        match &tag {
            b"GRID" => grid = Some(section),
            b"DATA" => {
                let mut header = Cursor::new(grid.ok_or_else(|| FormatError::missing("GRID"))?);
                let [lines, columns] = [header.i32()?, header.i32()?];
                let nodes = checked_nodes([columns, lines])?;
                header.skip(16)?;
                let steps = [header.double()?, header.double()?];
                header.skip(24)?;
                let marker = header.double()?;
                let unscaled = Raster::rows(nodes, Element::F64, ByteOrder::Little, section)?;
                let size = Sides::of_steps(nodes, steps, &Unit::None)?;
                let raster = unscaled.missing(Missing::Around(marker));
                return Ok(Channel::new("heights", Unit::None, size, raster));
            }
            // `DSRB` with the version, and fault lines.
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{Size, read};

    const ESRI: &str = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\n";

    #[test]
    fn the_first_line_of_an_esri_grid_has_the_largest_y() {
        let text = format!("{ESRI}cellsize 0.5\nNODATA_value -9999\n1 2 3\n4 5 -9999\n");
        let file = read(text.as_bytes()).unwrap();
        let map = file.channels()[0].map();
        assert_eq!((map.get(0, 1), map.get(0, 0), map.get(2, 0)), (Some(1.0), Some(4.0), None));
        assert_eq!(map.size(), Size::Unitless([1.5, 1.0]));
        assert!(file.channels()[0].notes().is_empty());
    }

    #[test]
    fn cells_of_gdal_may_be_rectangles_and_lines_may_be_broken() {
        let text = format!("{ESRI}dx 2\ndy 3\nnodata_value nan\n1 2\n3 nan\n5,5 6\n");
        let map = read(text.as_bytes()).unwrap().channels()[0].map();
        assert_eq!((map.get(0, 0), map.get(1, 0)), (None, Some(5.5)));
        assert_eq!(map.size(), Size::Unitless([6.0, 6.0]));
    }

    #[test]
    fn a_grid_of_grass_has_edges() {
        let text =
            "north: 10\nsouth: 4\neast: 9\nwest: 0\nrows: 2\ncols: 3\nnull: *\n1 2 3\n4 5 *\n";
        let file = read(text.as_bytes()).unwrap();
        let map = file.channels()[0].map();
        assert_eq!((map.get(0, 1), map.get(0, 0), map.get(2, 0)), (Some(1.0), Some(4.0), None));
        assert_eq!(map.size(), Size::Unitless([9.0, 6.0]));
    }

    #[test]
    fn a_marker_that_is_not_named_is_a_note() {
        let text = format!("{ESRI}cellsize 1\n1 2 3\n4 5 -9999\n");
        let file = read(text.as_bytes()).unwrap();
        assert!(file.channels()[0].notes()[0].starts_with("1 points of -9999 count as missing"));
        let text = format!("{ESRI}cellsize 1\ncolour 5\n1 2 3\n4 5 6\n");
        let error = read(text.as_bytes()).unwrap_err();
        let source = std::error::Error::source(&error).unwrap().to_string();
        assert_eq!(source, "line 6: `colour` is neither a number nor an entry of the header");
    }
}
