//! OPDx files of Vision64, which Bruker's Dektak and Contour profilometers write.
//!
//! A file is a tree of named items. A container `2D_Data/NAME` has a matrix of `f32`, the extents
//! of both dimensions and the unit of the numbers. An extent is the distance between the first and
//! the last point, so that the side is extent × N / (N − 1). SurfaceTopography found this by the
//! pixel size in the files; Gwyddion takes the extent as the side. Lines run along x (dimension
//! 2); the first line has y = 0. NaN marks missing points.
//!
//! The layout is that of SurfaceTopography 1.27.1 and Gwyddion 2.62; no file of Vision64 could
//! be compared.

use std::collections::BTreeMap;

use super::channel::{Channel, NAME_FIRST, Sides};
use super::input::{Cursor, decode_text, factor};
use super::raster::{ByteOrder, Element, Raster, checked_nodes};
use super::unit::{Unit, y_ratio};
use super::{Format, FormatError, at_least_one};

pub(crate) const FORMAT: Format =
    Format::new("opdx", "Bruker Vision64 OPDx", read).changed(&[NAME_FIRST]);

const SIGNATURE: &[u8] = b"VCA DATA\x01\x00\x00\x55";
/// Maximum depth of containers. It keeps a damaged file from exhausting the stack.
const MAX_DEPTH: usize = 32;
/// Maximum length of a name. It keeps the paths of a damaged file from exhausting the memory.
const MAX_NAME: usize = 256;
/// Path of the name of the map that the software shows.
const PRIMARY: &str = "/MetaData/PrimaryData2D";

/// Items of maps and the name of the primary map, by their path such as `/2D_Data/Raw/Matrix`.
type Items<'a> = BTreeMap<String, Item<'a>>;

enum Item<'a> {
    Text(String),
    /// Number with the symbol of its unit.
    Quantity(f64, String),
    /// Numbers of nodes along x and y, and the heights.
    Matrix([u32; 2], &'a [u8]),
    /// Container of profiles, or an item of another type.
    Other,
}

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let Some(content) = bytes.strip_prefix(SIGNATURE) else {
        return Err(FormatError::Signature);
    };
    let mut items = Items::new();
    read_items(content, "", 0, &mut items)?;
    let mut names: Vec<&str> = items
        .iter()
        .filter(|(_, item)| matches!(item, Item::Matrix(..)))
        .filter_map(|(path, _)| path.strip_prefix("/2D_Data/")?.strip_suffix("/Matrix"))
        .collect();
    if names.is_empty() && items.contains_key("/1D_Data") {
        return Err(FormatError::unsupported("the file holds a profile, not a map"));
    }
    // The map that the software shows comes first.
    if let Some(Item::Text(primary)) = items.get(PRIMARY) {
        names.sort_by_key(|name| name != primary);
    }
    at_least_one(names.into_iter().map(|name| channel(&items, name)), "2D_Data")
}

fn channel<'a>(items: &Items<'a>, name: &str) -> Result<Channel<'a>, FormatError> {
    let path = |entry: &str| format!("/2D_Data/{name}/{entry}");
    let Some(Item::Matrix(nodes, stored)) = items.get(&path("Matrix")) else {
        return Err(FormatError::missing(path("Matrix")));
    };
    let quantity = |entry: &str| match items.get(&path(entry)) {
        Some(Item::Quantity(value, unit)) => Ok((*value, unit.as_str())),
        _ => Err(FormatError::missing(path(entry))),
    };
    let nodes = checked_nodes(*nodes)?;
    let unscaled = Raster::rows(nodes, Element::F32, ByteOrder::Little, *stored)?;
    let (x, unit_x) = quantity("Dimension2Extent")?;
    let (y, unit_y) = quantity("Dimension1Extent")?;
    let (scale, unit) = quantity("DataScale")?;
    let y = y * y_ratio(unit_y, unit_x)?;
    let side = |extent: f64, nodes: usize| {
        let steps = (nodes - 1).max(1) as f64;
        extent * nodes as f64 / steps
    };
    let size = Sides::new([side(x, nodes[0]), side(y, nodes[1])], &Unit::parse(unit_x))?;
    let raster = unscaled.scaled(factor("DataScale", scale)?, 0.0);
    Ok(Channel::new(name, Unit::of_heights(unit), size, raster))
}

/// Reads the items of a container, and of the containers in it, into `items`. `path` is the path of
/// the container.
fn read_items<'a>(
    content: &'a [u8],
    path: &str,
    depth: usize,
    items: &mut Items<'a>,
) -> Result<(), FormatError> {
    if depth > MAX_DEPTH {
        return Err(FormatError::damaged(
            "the tree of items",
            "its containers are nested too deep",
        ));
    }
    let mut cursor = Cursor::new(content);
    loop {
        let path = format!("{path}/{}", name(&mut cursor)?);
        let [kind] = cursor.array()?;
        let item = match kind {
            // Containers; the last two kinds wrap the data of profiles and of maps.
            0x7d | 0x46 | 0x47 => {
                read_items(structured(&mut cursor)?, &path, depth + 1, items)?;
                Item::Other
            }
            // The last item of a container and of the file.
            0x7f => return Ok(()),
            0x00 => {
                // The name of the type, a number and another name.
                name(&mut cursor)?;
                cursor.skip(4)?;
                name(&mut cursor)?;
                matrix(structured(&mut cursor)?)?
            }
            0x45 => {
                name(&mut cursor)?;
                matrix(structured(&mut cursor)?)?
            }
            0x12 => Item::Text(decode_text(structured(&mut cursor)?)),
            0x13 => {
                let mut content = Cursor::new(structured(&mut cursor)?);
                let value = content.double()?;
                // The name of the unit precedes its symbol.
                name(&mut content)?;
                Item::Quantity(value, name(&mut content)?)
            }
            // Structures with the name of their type: identifiers, arrays, lists and positions.
            0x0e | 0x40 | 0x42 | 0x7c => {
                name(&mut cursor)?;
                structured(&mut cursor)?;
                Item::Other
            }
            // A unit.
            0x18 => {
                structured(&mut cursor)?;
                Item::Other
            }
            _ => {
                let length = match kind {
                    0x01 => 1,
                    0x04 | 0x05 => 2,
                    0x06 | 0x07 | 0x0c => 4,
                    0x0a | 0x0b | 0x0d => 8,
                    // A time.
                    0x15 => 9,
                    _ => {
                        let entry = format!("type of the item `{path}`");
                        return Err(FormatError::value(&entry, kind, "a known type"));
                    }
                };
                cursor.skip(length)?;
                Item::Other
            }
        };
        let is_of_map = path.starts_with("/2D_Data/") && path.matches('/').count() == 3;
        if is_of_map || path == PRIMARY || path == "/1D_Data" {
            items.insert(path, item);
        }
    }
}

/// Reads a matrix: its numbers of lines and columns, and the heights.
fn matrix(content: &[u8]) -> Result<Item<'_>, FormatError> {
    let mut cursor = Cursor::new(content);
    let [y, x] = [cursor.u32()?, cursor.u32()?];
    Ok(Item::Matrix([x, y], cursor.rest()))
}

/// Reads a name, whose length is a number of four bytes.
fn name(cursor: &mut Cursor<'_>) -> Result<String, FormatError> {
    let length = cursor.u32()? as usize;
    if length > MAX_NAME {
        let allowed = format!("at most {MAX_NAME}");
        return Err(FormatError::value("length of a name", length, &allowed));
    }
    Ok(decode_text(cursor.take(length)?))
}

/// Reads content whose length is a number of one, two or four bytes, as the first byte says.
fn structured<'a>(cursor: &mut Cursor<'a>) -> Result<&'a [u8], FormatError> {
    let [bytes] = cursor.array()?;
    let length = match bytes {
        1 => cursor.array::<1>()?[0].into(),
        2 => cursor.u16()?.into(),
        4 => cursor.u32()? as usize,
        _ => return Err(FormatError::value("bytes of a length", bytes, "1, 2 or 4")),
    };
    cursor.take(length)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn item(name: &str, kind: u8, content: &[u8]) -> Vec<u8> {
        let length = (name.len() as u32).to_le_bytes();
        [&length[..], name.as_bytes(), &[kind, 1, content.len() as u8], content].concat()
    }

    #[test]
    fn a_profile_is_refused() {
        let end = [0, 0, 0, 0, 0x7f, 0xff, 0xff];
        let file = [SIGNATURE, &item("1D_Data", 0x7d, &end), &end].concat();
        let error = read(&file).unwrap_err();
        assert_eq!(error.to_string(), "the file holds a profile, not a map");
    }

    #[test]
    fn deep_containers_are_refused() {
        let nested = (0..=MAX_DEPTH).fold(vec![], |inner, _| item("", 0x7d, &inner));
        let error = read(&[SIGNATURE, &nested].concat()).unwrap_err();
        assert!(error.to_string().contains("nested too deep"), "{error}");
    }
}
