//! Archives of NumPy arrays (`.npz`), as `numpy.savez` and `asperity export` write them.
//!
//! Each two-dimensional array is a channel with x along the first axis. Arrays whose names say that
//! they are heights come first. An array `side` with the sides along x and y, or with the side of a
//! square, and a text `unit` with their unit and that of the heights, as in exports of asperity,
//! give the size. Without `side`, the coordinates `x` and `y` (lists, or arrays as `meshgrid` of
//! NumPy 2.4 makes them) give the sides and the order of the axes.

use super::archive::Archive;
use super::channel::Channel;
use super::direction::Direction;
use super::input::{decode_text, decoded_limit, finite};
use super::labelled::{Array, Attributes, Axis, Coordinates};
use super::npy::{npy_array, npy_numbers};
use super::raster::{ByteOrder, Element};
use super::unit::Unit;
use super::{Format, FormatError};

pub(crate) const FORMAT: Format = Format::new("npz", "archive of NumPy arrays", read).changed(&[
    "`side` may have any type of numbers",
    "arrays x and y give sides and order of the axes",
]);

/// Names of arrays of heights, the most likely first.
const HEIGHTS: [&str; 6] = ["height", "heights", "z", "topography", "surface", "h"];

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let mut archive = Archive::of_format(bytes)?;
    let names: Vec<String> = archive.names().map(String::from).collect();
    if !is_npz(&names) {
        return Err(FormatError::Signature);
    }
    let text = text(&mut archive, "unit.npy");
    let unit = text.as_deref().map_or(Unit::None, Unit::parse);
    let sides = sides(&mut archive)?;
    let limit = decoded_limit(bytes.len());
    let coordinates = match sides {
        Some(_) => None,
        None => coordinates(&mut archive, &names, limit)?,
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
                let known_rank = HEIGHTS.iter().position(|known| name.eq_ignore_ascii_case(known));
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
                let bytes = bytes.into_flattened();
                let array = Array::new(name, &shape, Element::F64, ByteOrder::Little, bytes);
                let axes = axes.unwrap_or_else(|| array.axes.clone());
                let array = Array { axes, unit: known_rank.map(|_| unit.clone()), ..array };
                let rank = known_rank.unwrap_or(HEIGHTS.len());
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
fn coordinates(
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

/// Returns true if an archive has only NumPy arrays.
pub(crate) fn is_npz(names: &[String]) -> bool {
    !names.is_empty() && names.iter().all(|name| name.ends_with(".npy"))
}

/// Returns the sides along x and y: an array of two numbers, or of one for a square.
fn sides(archive: &mut Archive<'_>) -> Result<Option<[f64; 2]>, FormatError> {
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
fn text(archive: &mut Archive<'_>, name: &str) -> Option<String> {
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
