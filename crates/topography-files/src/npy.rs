//! NumPy files with one two-dimensional array `[x, y]` of integers or floats of any size and byte
//! order, in C or Fortran order, as NumPy 1 and 2 write them. If the array has more dimensions,
//! those of length one are dropped.
//!
//! The format has neither size nor unit. Numbers that are not finite are missing points. The header
//! is a Python dictionary with three entries in a fixed notation. The shape in the header is
//! compared with the length of the file, because a damaged header could exhaust memory.

use thiserror::Error;

use super::archive::{Archive, is_npz};
use super::channel::{Channel, Size};
use super::direction::Direction;
use super::input::{decode_text, decoded_limit, finite};
use super::labelled::{Array, Attributes, Axis, Coordinates};
use super::raster::{ByteOrder, Element, Raster, checked_nodes};
use super::unit::Unit;
use super::{Format, FormatError};

pub(crate) const FORMAT: Format = Format::new("npy", "NumPy array", read);

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let (nodes, heights) = match npy_array(bytes) {
        Ok(array) => array,
        Err(NpyError::Magic) => return Err(FormatError::Signature),
        Err(error) => return Err(FormatError::unsupported(error.to_string())),
    };
    let raster = Raster::from_columns(checked_nodes(nodes)?, heights);
    Ok(vec![Channel::new("heights", Unit::None, Size::Unknown, raster)])
}

/// Error of [`npy_array`]. It does not contain the path of the file, which the function does not
/// know.
#[derive(Debug, Clone, PartialEq, Error)]
#[expect(missing_docs, reason = "the messages document the variants")]
#[non_exhaustive]
pub enum NpyError {
    #[error("not a NumPy file: it does not start with `\\x93NUMPY`")]
    Magic,
    #[error("unsupported NumPy format version {0}; supported versions: 1 to 3")]
    Version(u8),
    #[error("the file ends within its header")]
    CutOff,
    #[error("the header `{header}` has no valid `{entry}`")]
    Entry { entry: &'static str, header: String },
    #[error("the elements have the type `{found}`; convert the array to `<f8`")]
    Type { found: String },
    #[error("the array has shape {found:?}; a height map has two dimensions, such as [256, 256]")]
    Shape { found: Vec<u64> },
    #[error(
        "an array of shape {shape:?} and type `{element}` needs {needed} bytes of data, but the \
         file has {found}"
    )]
    Length { shape: Vec<u64>, element: String, needed: u128, found: usize },
}

/// Decodes a `.npy` file. Returns the numbers of rows and columns of the array, and its elements.
///
/// The elements are in row-major order and may be infinite or NaN.
///
/// # Errors
/// Returns an error if the bytes are not a NumPy file or do not hold one two-dimensional array of
/// integers or floats.
///
/// ```
/// use asperity_topography_files::{NpyError, npy_array};
///
/// // As `numpy.save` writes `[[0, 1, 2], [3, 4, 5]]`.
/// let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 3), }\n";
/// let mut file = b"\x93NUMPY\x01\x00".to_vec();
/// file.extend((header.len() as u16).to_le_bytes());
/// file.extend(header.bytes());
/// file.extend((0..6).flat_map(|height| f64::from(height).to_le_bytes()));
///
/// let (nodes, heights) = npy_array(&file)?;
/// assert_eq!(nodes, [2, 3]);
/// assert_eq!(heights, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]);
/// assert_eq!(npy_array(b"GIF89a"), Err(NpyError::Magic));
/// # Ok::<(), NpyError>(())
/// ```
pub fn npy_array(bytes: &[u8]) -> Result<([usize; 2], Vec<f64>), NpyError> {
    let (header, data) = split(bytes)?;
    let (element, order) = element(header)?;
    let columns_first = fortran_order(header)?;
    let shape = shape(header)?;
    let long: Vec<u64> = shape.iter().copied().filter(|&length| length != 1).collect();
    let [rows, columns] = match (&shape[..], &long[..]) {
        (&[rows, columns], _) | (&[_, _, _, ..], &[rows, columns]) => [rows, columns],
        _ => return Err(NpyError::Shape { found: shape }),
    };
    let needed = u128::from(rows)
        .checked_mul(u128::from(columns))
        .and_then(|count| count.checked_mul(element.size() as u128));
    if needed != Some(data.len() as u128) {
        return Err(NpyError::Length {
            shape,
            element: descr(header)?,
            needed: needed.unwrap_or(u128::MAX),
            found: data.len(),
        });
    }
    let nodes = [rows as usize, columns as usize];
    let heights = element.numbers(order, data);
    // An array without columns may claim so many rows that a loop over them would not end.
    if columns_first && !heights.is_empty() {
        Ok((nodes, transposed(&heights, nodes)))
    } else {
        Ok((nodes, heights))
    }
}

/// Decodes the numbers of an array with one axis. Returns `None` if the bytes are no such array of
/// integers or floats.
pub fn npy_line(bytes: &[u8]) -> Option<Vec<f64>> {
    let (shape, numbers) = npy_numbers(bytes)?;
    (shape.len() == 1 && !numbers.is_empty()).then_some(numbers)
}

/// Reads an array with one axis as a profile.
pub(crate) fn profile(bytes: &[u8]) -> Option<Channel<'static>> {
    let heights = npy_line(bytes)?;
    let nodes = checked_nodes([heights.len(), 1]).ok()?;
    let raster = Raster::from_columns(nodes, heights);
    Some(Channel::new("heights", Unit::None, Size::Unknown, raster))
}

/// Decodes the shape and the numbers of an array of any shape. Returns `None` if the elements are
/// no numbers, if they are in Fortran order, or if the file is damaged.
pub(crate) fn npy_numbers(bytes: &[u8]) -> Option<(Vec<usize>, Vec<f64>)> {
    let (header, data) = split(bytes).ok()?;
    let (element, order) = element(header).ok()?;
    let shape: Vec<usize> = shape(header).ok()?.into_iter().map(|one| one as usize).collect();
    let needed = shape.iter().try_fold(element.size(), |size, one| size.checked_mul(*one));
    let is_plain =
        needed == Some(data.len()) && (shape.len() < 2 || !fortran_order(header).ok()?);
    is_plain.then(|| (shape, element.numbers(order, data)))
}

/// Returns the type of the elements and their byte order.
fn element(header: &str) -> Result<(Element, ByteOrder), NpyError> {
    let found = descr(header)?;
    let (order, kind) = match found.as_bytes() {
        [b'>', kind @ ..] => (ByteOrder::Big, kind),
        [b'<' | b'|', kind @ ..] => (ByteOrder::Little, kind),
        _ => return Err(NpyError::Type { found }),
    };
    let element = match *kind {
        [kind @ (b'i' | b'u'), bytes @ b'1'..=b'8'] => {
            Element::integer(i64::from(bytes - b'0') * 8, kind == b'i')
        }
        [b'f', bytes @ b'2'..=b'8'] => Element::float(i64::from(bytes - b'0') * 8),
        _ => None,
    };
    Ok((element.ok_or(NpyError::Type { found })?, order))
}

/// Returns the notation of the type, such as `<f8`.
fn descr(header: &str) -> Result<String, NpyError> {
    let text = value(header, "descr")?;
    // A structured type is a list, which may be long.
    Ok(quoted(text).map_or_else(|| text.chars().take(40).collect(), str::to_owned))
}

/// Splits a NumPy file into its header and its data.
fn split(bytes: &[u8]) -> Result<(&str, &[u8]), NpyError> {
    let rest = bytes.strip_prefix(b"\x93NUMPY").ok_or(NpyError::Magic)?;
    let (claimed, rest) = match *rest {
        [1, _, a, b, ref rest @ ..] => (u16::from_le_bytes([a, b]).into(), rest),
        [2 | 3, _, a, b, c, d, ref rest @ ..] => (u32::from_le_bytes([a, b, c, d]) as usize, rest),
        [version @ (0 | 4..), ..] => return Err(NpyError::Version(version)),
        _ => return Err(NpyError::CutOff),
    };
    let (header, data) = rest.split_at_checked(claimed).ok_or(NpyError::CutOff)?;
    let header = str::from_utf8(header)
        .map_err(|_| unreadable(&String::from_utf8_lossy(header), "dictionary"))?;
    Ok((header.trim(), data))
}

/// Returns the text after `'name':` in the header.
fn value<'a>(header: &'a str, name: &'static str) -> Result<&'a str, NpyError> {
    let missing = || unreadable(header, name);
    let (_, rest) = header.split_once(name).ok_or_else(missing)?;
    let quoted = rest.strip_prefix(['\'', '"']).ok_or_else(missing)?;
    let rest = quoted.trim_start().strip_prefix(':').ok_or_else(missing)?;
    Ok(rest.trim_start())
}

fn quoted(text: &str) -> Option<&str> {
    let quote = text.chars().next().filter(|c| matches!(c, '\'' | '"'))?;
    text[1..].split(quote).next()
}

fn fortran_order(header: &str) -> Result<bool, NpyError> {
    let text = value(header, "fortran_order")?;
    if text.starts_with("True") {
        Ok(true)
    } else if text.starts_with("False") {
        Ok(false)
    } else {
        Err(unreadable(header, "fortran_order"))
    }
}

fn shape(header: &str) -> Result<Vec<u64>, NpyError> {
    let numbers = value(header, "shape")?
        .strip_prefix('(')
        .and_then(|text| text.split_once(')'))
        .map(|(numbers, _)| numbers.split(',').map(str::trim).filter(|n| !n.is_empty()));
    numbers
        .and_then(|numbers| numbers.map(|n| n.parse().ok()).collect())
        .ok_or_else(|| unreadable(header, "shape"))
}

fn unreadable(header: &str, entry: &'static str) -> NpyError {
    NpyError::Entry { entry, header: header.chars().take(200).collect() }
}

/// Converts an array from column-major to row-major order.
fn transposed(heights: &[f64], [rows, columns]: [usize; 2]) -> Vec<f64> {
    let indices = (0..rows).flat_map(|i| (0..columns).map(move |j| j * rows + i));
    indices.map(|index| heights[index]).collect()
}

/// Archives of NumPy arrays (`.npz`), as `numpy.savez` and `asperity export` write them.
///
/// Each two-dimensional array is a channel with x along the first axis. Arrays whose names say that
/// they are heights come first. An array `side` with the sides along x and y, or with the side of a
/// square, and a text `unit` with their unit and that of the heights, as in exports of asperity,
/// give the size. Without `side`, the coordinates `x` and `y` (lists, or arrays as `meshgrid` of
/// NumPy 2.4 makes them) give the sides and the order of the axes.
pub(crate) const NPZ: Format = Format::new("npz", "archive of NumPy arrays", read_npz).changed(&[
    "`side` may have any type of numbers",
    "arrays x and y give sides and order of the axes",
]);

/// Names of arrays of heights, the most likely first.
const NPZ_HEIGHTS: [&str; 6] = ["height", "heights", "z", "topography", "surface", "h"];

fn read_npz(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let mut archive = Archive::of_format(bytes)?;
    let names: Vec<String> = archive.names().map(String::from).collect();
    if !is_npz(&names) {
        return Err(FormatError::Signature);
    }
    let text = npz_text(&mut archive, "unit.npy");
    let unit = text.as_deref().map_or(Unit::None, Unit::parse);
    let sides = npz_sides(&mut archive)?;
    let limit = decoded_limit(bytes.len());
    let coordinates = match sides {
        Some(_) => None,
        None => npz_coordinates(&mut archive, &names, limit)?,
    };
    let is_coordinate =
        |name: &str| coordinates.iter().flatten().any(|coordinate| coordinate.name == name);
    let mut arrays: Vec<&str> = names.iter().filter_map(|path| path.strip_suffix(".npy")).collect();
    arrays.sort_by_key(|name| is_coordinate(name));
    let mut is_located = false;
    let mut ranked = Vec::new();
    let mut unused = Vec::new();
    for name in arrays {
        if is_located && is_coordinate(name) {
            break;
        }
        match npy_array(&archive.file(&format!("{name}.npy"), limit)?) {
            Ok((nodes, numbers)) if nodes.iter().all(|count| *count > 1) => {
                let known_rank =
                    NPZ_HEIGHTS.iter().position(|known| name.eq_ignore_ascii_case(known));
                let axes = match (&coordinates, sides) {
                    (Some([x, y]), _) => Coordinates::axes(nodes, x, y)?,
                    (None, Some([x, y])) => {
                        let unit = Some(unit.clone()).filter(|unit| *unit != Unit::None);
                        Some(vec![Axis::of_side("x", x, unit.clone()), Axis::of_side("y", y, unit)])
                    }
                    (None, None) => None,
                };
                is_located |= axes.is_some() && coordinates.is_some();
                let shape = nodes.map(|count| count as u64);
                let bytes: Vec<_> = numbers.into_iter().map(f64::to_le_bytes).collect();
                let (kind, order) = (Element::F64, ByteOrder::Little);
                let mut array = Array::new(name, &shape, kind, order, bytes.into_flattened());
                array.axes = axes.unwrap_or(array.axes);
                array.unit = known_rank.map(|_| unit.clone());
                let rank = known_rank.unwrap_or(NPZ_HEIGHTS.len());
                ranked.extend(array.channels()?.into_iter().map(|channel| (rank, channel)));
            }
            _ if name == "side" && sides.is_some() || name == "unit" && text.is_some() => {}
            _ => unused.push(format!("`{name}`")),
        }
    }
    ranked.sort_by_key(|(rank, _)| *rank);
    let note = format!("the arrays {} are not used", unused.join(", "));
    let note = (!unused.is_empty()).then_some(&note);
    let channels: Vec<Channel<'static>> =
        ranked.into_iter().map(|(_, channel)| channel.noted(note)).collect();
    if channels.is_empty() {
        let what = format!("none of the arrays {} has two dimensions", unused.join(", "));
        return Err(FormatError::unsupported(what));
    }
    Ok(channels)
}

/// Returns the coordinates x and y, if there is one array of each.
fn npz_coordinates(
    archive: &mut Archive<'_>,
    names: &[String],
    limit: usize,
) -> Result<Option<[Coordinates; 2]>, FormatError> {
    let mut find = |direction| {
        let stems = names.iter().filter_map(|path| path.strip_suffix(".npy"));
        let mut found = stems.filter(|name| Direction::of_name(name) == Some(direction));
        let (Some(name), None) = (found.next(), found.next()) else { return Ok(None) };
        let array = npy_numbers(&archive.file(&format!("{name}.npy"), limit)?);
        Ok(array.map(|(shape, numbers)| Coordinates {
            name: name.to_owned(),
            shape,
            numbers,
            attributes: Attributes::default(),
        }))
    };
    let (x, y) = (find(Direction::X)?, find(Direction::Y)?);
    Ok(x.zip(y).map(|(x, y)| [x, y]))
}

/// Returns the sides along x and y: an array of two numbers, or of one for a square.
fn npz_sides(archive: &mut Archive<'_>) -> Result<Option<[f64; 2]>, FormatError> {
    let array = archive.file("side.npy", 4096).ok().and_then(|bytes| npy_numbers(&bytes));
    let sides = match array.unwrap_or_default().1[..] {
        [x, y] => [x, y],
        [side] => [side, side],
        _ => return Ok(None),
    };
    Ok(Some([finite("side", sides[0])?, finite("side", sides[1])?]))
}

/// Returns the text of an array of one text, whose letters have four bytes, or one if the text is
/// one of bytes.
fn npz_text(archive: &mut Archive<'_>, name: &str) -> Option<String> {
    let bytes = archive.file(name, 4096).ok()?;
    let header = String::from_utf8_lossy(&bytes[..bytes.len().min(128)]);
    if let Some((_, count)) = header.split_once("'|S") {
        let count: usize = count.split_once('\'')?.0.parse().ok()?;
        return Some(decode_text(&bytes[bytes.len().checked_sub(count)?..]));
    }
    let (_, count) = header.split_once("<U")?;
    let count: usize = count.split_once('\'')?.0.parse().ok()?;
    let wide = bytes.len().checked_sub(count.checked_mul(4)?)?;
    let (wide, _) = bytes[wide..].as_chunks::<4>();
    // Zeros follow the text.
    let letters = wide.iter().filter_map(|letter| char::from_u32(u32::from_le_bytes(*letter)));
    Some(letters.take_while(|letter| *letter != '\0').collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn npy(descr: &str, fortran_order: &str, shape: &str, data: &[u8]) -> Vec<u8> {
        let header = format!(
            "{{'descr': '{descr}', 'fortran_order': {fortran_order}, 'shape': {shape}, }}\n"
        );
        let length = (header.len() as u16).to_le_bytes();
        let parts = [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), data];
        parts.concat()
    }

    fn doubles(values: &[f64]) -> Vec<u8> {
        values.iter().flat_map(|value| value.to_le_bytes()).collect()
    }

    fn valid() -> Vec<u8> {
        npy("<f8", "False", "(2, 2)", &doubles(&[1.0, 2.0, 3.0, 4.0]))
    }

    #[test]
    fn both_orders_of_storage_show_the_same_map() {
        let rows = npy_array(&valid()).unwrap();
        assert_eq!(rows, ([2, 2], vec![1.0, 2.0, 3.0, 4.0]));
        let data = doubles(&[1.0, 3.0, 2.0, 4.0]);
        let columns = npy_array(&npy("<f8", "True", "(2, 2)", &data));
        assert_eq!(columns, Ok(rows));
    }

    #[test]
    fn a_rectangle_is_read_along_both_axes() {
        let data = doubles(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let rows = npy_array(&npy("<f8", "False", "(2, 3)", &data)).unwrap();
        assert_eq!(rows, ([2, 3], vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]));
        let data = doubles(&[1.0, 4.0, 2.0, 5.0, 3.0, 6.0]);
        let columns = npy_array(&npy("<f8", "True", "(2, 3)", &data));
        assert_eq!(columns, Ok(rows));
    }

    #[test]
    fn single_precision_and_the_second_version_are_read_too() {
        let data: Vec<u8> =
            [0.5_f32, -2.0, 0.0, 8.0].iter().flat_map(|value| value.to_le_bytes()).collect();
        let single = npy_array(&npy("<f4", "False", "(2, 2)", &data)).unwrap();
        assert_eq!(single.1, [0.5, -2.0, 0.0, 8.0]);
        let mut second = valid();
        second[6] = 2;
        second.splice(10..10, [0, 0]);
        assert_eq!(npy_array(&second), npy_array(&valid()));
    }

    #[test]
    fn every_truncation_is_an_error() {
        let bytes = valid();
        for length in 0..bytes.len() {
            assert!(npy_array(&bytes[..length]).is_err(), "{length} bytes");
        }
        let longer = [bytes, vec![0]].concat();
        assert_eq!(
            npy_array(&longer).unwrap_err().to_string(),
            "an array of shape [2, 2] and type `<f8` needs 32 bytes of data, but the file has 33"
        );
    }

    #[test]
    fn a_damaged_header_is_an_error_or_harmless() {
        let bytes = valid();
        let header = bytes.len() - 32;
        for position in 0..header {
            for damage in 0..=255 {
                let mut damaged = bytes.clone();
                damaged[position] = damage;
                if let Ok((_, heights)) = npy_array(&damaged) {
                    assert!(heights.len() <= 4);
                }
            }
        }
    }

    #[test]
    fn integers_and_both_byte_orders_are_read() {
        let read = |descr: &str, data: &[u8]| npy_array(&npy(descr, "False", "(1, 2)", data));
        let expected = Ok(([1, 2], vec![1.0, 2.0]));
        assert_eq!(read("|u1", &[1, 2]), expected);
        assert_eq!(read("<i2", &[1, 0, 2, 0]), expected);
        assert_eq!(read(">i8", &[0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 2]), expected);
        assert_eq!(read("<f2", &[0, 0x3c, 0, 0x40]), expected);
        assert_eq!(read(">f4", &[0x3f, 0x80, 0, 0, 0x40, 0, 0, 0]), expected);
    }

    #[test]
    fn axes_of_length_one_are_dropped() {
        let bytes = npy("<f8", "False", "(1, 2, 1, 2)", &doubles(&[1.0, 2.0, 3.0, 4.0]));
        assert_eq!(npy_array(&bytes), npy_array(&valid()));
    }

    #[test]
    fn other_types_are_named() {
        for descr in ["<c16", "|O", "|b1", "<f16", "=f8"] {
            let found = descr.to_owned();
            let error = npy_array(&npy(descr, "False", "(2, 2)", &[0; 32]));
            assert_eq!(error, Err(NpyError::Type { found }));
        }
    }

    #[test]
    fn arrays_of_other_dimensions_are_refused_with_their_shape() {
        let shapes = [("(4,)", vec![4]), ("()", vec![]), ("(2, 2, 2)", vec![2, 2, 2])];
        for (shape, found) in shapes {
            let error = npy_array(&npy("<f8", "False", shape, &[0; 32]));
            assert_eq!(error, Err(NpyError::Shape { found }));
        }
        for (order, shape) in [("False", "(0, 0)"), ("True", "(100000000000000001, 0)")] {
            let array = npy_array(&npy("<f8", order, shape, &[]));
            assert!(array.unwrap().1.is_empty());
        }
    }

    #[test]
    fn a_huge_claim_allocates_nothing() {
        for side in [1_u64 << 20, 1 << 32, u64::MAX] {
            let bytes = npy("<f8", "False", &format!("({side}, {side})"), &[0; 32]);
            let error = npy_array(&bytes).unwrap_err();
            assert!(matches!(error, NpyError::Length { found: 32, .. }));
        }
        let beyond = npy("<f8", "False", &format!("({0}, {0})", u128::MAX), &[]);
        let error = npy_array(&beyond).unwrap_err();
        assert!(matches!(error, NpyError::Entry { entry: "shape", .. }));
        let mut header = valid();
        header[6] = 2;
        header[8..12].fill(0xff);
        assert_eq!(npy_array(&header), Err(NpyError::CutOff));
    }
}
