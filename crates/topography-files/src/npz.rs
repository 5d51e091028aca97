//! Archives of NumPy arrays (`.npz`), as `numpy.savez` and `asperity export` write them.
//!
//! Each two-dimensional array is a channel with x along the first axis. Arrays whose names say that
//! they are heights come first. An array `side` with the sides along x and y, and a text `unit`
//! with their unit and that of the heights, as in exports of asperity, give the size.

use super::archive::{self, Archive};
use super::channel::{Channel, Size};
use super::input::finite;
use super::npy::npy_array;
use super::raster::Raster;
use super::unit::Unit;
use super::{Format, FormatError};

pub const FORMAT: Format =
    Format { name: "npz", title: "archive of NumPy arrays", version: 1, has_signature: true, read };

/// Names of arrays of heights, the most likely first.
const HEIGHTS: [&str; 6] = ["height", "heights", "z", "topography", "surface", "h"];
/// Maximum number of bytes of an array that are read.
const MAX_ARRAY: usize = 16 << 30;

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    if !bytes.starts_with(archive::SIGNATURE) {
        return Err(FormatError::Signature);
    }
    let mut archive = Archive::new(bytes).map_err(|_| FormatError::Signature)?;
    let names: Vec<String> = archive.names().map(String::from).collect();
    if !is_npz(&names) {
        return Err(FormatError::Signature);
    }
    let unit = text(&mut archive, "unit.npy").map_or(Unit::None, |text| Unit::parse(&text));
    let size = match sides(&mut archive)? {
        Some(sides) => Size::new(sides, &unit)?,
        None => Size::Unknown,
    };
    let mut channels = Vec::new();
    let mut unused = Vec::new();
    for path in &names {
        let name = path.strip_suffix(".npy").unwrap_or(path);
        match npy_array(&archive.file(path, MAX_ARRAY)?) {
            Ok((nodes, numbers)) if nodes.iter().all(|count| *count > 1) => {
                let rank = HEIGHTS.iter().position(|known| name.eq_ignore_ascii_case(known));
                let unit = rank.map_or(Unit::None, |_| unit.clone());
                let raster = Raster::from_columns(nodes, numbers);
                let rank = rank.unwrap_or(HEIGHTS.len());
                channels.push((rank, Channel::new(name, unit, size, raster)));
            }
            _ => unused.push(format!("`{name}`")),
        }
    }
    channels.sort_by_key(|(rank, _)| *rank);
    let note = format!("the arrays {} are no maps and are not used", unused.join(", "));
    let is_used = |name: &str| matches!(name, "`side`" | "`unit`");
    let has_unused = unused.iter().any(|name| !is_used(name));
    let noted = |channel: Channel<'static>| if has_unused { channel.noted(&note) } else { channel };
    let channels: Vec<Channel<'static>> =
        channels.into_iter().map(|(_, channel)| noted(channel)).collect();
    if channels.is_empty() {
        let what = format!("none of the arrays {} has two dimensions", unused.join(", "));
        return Err(FormatError::unsupported(what));
    }
    Ok(channels)
}

/// Returns true if an archive has only NumPy arrays.
pub fn is_npz(names: &[String]) -> bool {
    !names.is_empty() && names.iter().all(|name| name.ends_with(".npy"))
}

/// Returns the sides along x and y, an array of two floats.
fn sides(archive: &mut Archive<'_>) -> Result<Option<[f64; 2]>, FormatError> {
    let Ok(bytes) = archive.file("side.npy", 4096) else {
        return Ok(None);
    };
    let header = String::from_utf8_lossy(&bytes[..bytes.len().min(128)]);
    if !(header.contains("<f8") && header.contains("(2,)")) {
        return Ok(None);
    }
    let (numbers, _) = bytes[bytes.len().saturating_sub(16)..].as_chunks::<8>();
    match numbers {
        [x, y] => {
            let [x, y] = [x, y].map(|number| finite("side", f64::from_le_bytes(*number)));
            Ok(Some([x?, y?]))
        }
        _ => Ok(None),
    }
}

/// Returns the text of an array of one text, whose letters have four bytes.
fn text(archive: &mut Archive<'_>, name: &str) -> Option<String> {
    let bytes = archive.file(name, 4096).ok()?;
    let header = String::from_utf8_lossy(&bytes[..bytes.len().min(128)]);
    let (_, count) = header.split_once("<U")?;
    let count: usize = count.split_once('\'')?.0.parse().ok()?;
    let letters = bytes.len().checked_sub(count.checked_mul(4)?)?;
    let (letters, _) = bytes[letters..].as_chunks::<4>();
    // Zeros follow the text.
    let letters = letters.iter().filter_map(|letter| char::from_u32(u32::from_le_bytes(*letter)));
    Some(letters.take_while(|letter| *letter != '\0').collect())
}
