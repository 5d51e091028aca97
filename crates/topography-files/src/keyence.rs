//! Files of the Keyence VK laser microscopes: VK3, VK4, VK6 and VK7.
//!
//! A VK3 or VK4 file has a table of the positions of its parts, among which are the measurement
//! conditions and up to three images of heights. A VK6 or VK7 file is a zip archive with the VK4
//! file `Vk4File`, after a preview. The conditions give the picometres per pixel along x and y and
//! per digit of a height; the sides are nodes × picometres per pixel. Lines run along x; the first
//! line has y = 0. The format has no marker of missing points.
//!
//! The layout is that of SurfaceTopography 1.27.1, surfalize 0.19.2 and Gwyddion 2.62; no
//! file of an instrument could be compared.

use super::archive::Archive;
use super::channel::{Channel, NAME_FIRST, Sides};
use super::input::{Cursor, factor, meaning};
use super::raster::{ByteOrder, Element, Raster, map_bytes};
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

pub(crate) const FORMAT: Format = Format::new("vk", "Keyence VK", read).changed(&[NAME_FIRST]);

/// Name of the VK4 file in the archive of a VK6 or VK7 file.
const MEMBER: &str = "Vk4File";
/// Maximum length of the VK4 file in an archive.
const MAX_MEMBER: usize = u32::MAX as usize;
/// Position of the table of positions, after the signature, the version and the type of the file.
const TABLE: usize = 12;
/// Index of the image of heights in the table; the second and third images follow.
const HEIGHTS: usize = 6;
/// Index of the picometres per pixel and per digit among the measurement conditions.
const SCALES: usize = 42;
/// Length of the colour palette before the pixels of an image.
const PALETTE: usize = 768;

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    match bytes.get(..4) {
        Some(b"VK3_" | b"VK4_") => channels(bytes),
        Some([b'V', b'K', b'6' | b'7', _]) => {
            let file = Archive::new(bytes)?.file(MEMBER, MAX_MEMBER)?;
            Ok(channels(&file)?.into_iter().map(Channel::into_owned).collect())
        }
        _ => Err(FormatError::Signature),
    }
}

/// Reads all images of heights of a VK3 or VK4 file.
fn channels(file: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    if !(file.starts_with(b"VK3_") || file.starts_with(b"VK4_")) {
        return Err(FormatError::damaged(MEMBER, "it does not start with VK4_"));
    }
    let number = |start: usize, index: usize| {
        Cursor::at(file, start.saturating_add(4 * index)).u32().map(|number| number as usize)
    };
    let conditions = number(TABLE, 0)?;
    let scale = |index| number(conditions, SCALES + index).map(|picometres| picometres as f64);
    let [x, y, digit] = [scale(0)?, scale(1)?, scale(2)?];
    let picometre = Unit::parse("pm");
    let mut channels = Vec::new();
    for (image, name) in ["Height", "Height 2", "Height 3"].into_iter().enumerate() {
        let start = number(TABLE, HEIGHTS + image)?;
        if start == 0 {
            continue;
        }
        let mut cursor = Cursor::at(file, start);
        let nodes = cursor.nodes()?;
        let bits = cursor.u32()?;
        let element = Element::integer(bits.into(), false)
            .ok_or_else(|| FormatError::value("bits per height", bits, "8, 16, 32 or 64"))?;
        meaning("compression", cursor.u32()?, "0, no compression", &[(0, ())])?;
        // The length of the pixels, and the range of the palette.
        cursor.skip(3 * 4 + PALETTE)?;
        let stored = cursor.take(map_bytes(nodes, element))?;
        let raster = Raster::rows(nodes, element, ByteOrder::Little, stored)?
            .scaled(factor("picometres per digit", digit)?, 0.0);
        let size = Sides::of_steps(nodes, [x, y], &picometre)?;
        channels.push(Ok(Channel::new(name, picometre.clone(), size, raster)));
    }
    at_least_one(channels, "image of heights")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::samples::packed;
    use crate::samples::vendors::vk;

    #[test]
    fn a_compressed_image_is_refused() {
        let mut file = vk(b"VK4_");
        let image = 12 + 4 * 18 + 304;
        file[image + 12] = 1;
        let error = read(&file).unwrap_err();
        assert_eq!(error.to_string(), "`compression` is 1; expected 0, no compression");
    }

    #[test]
    fn an_archive_without_its_file_is_damaged() {
        let file = [b"VK7\0".to_vec(), packed(&[("Vk4File", b"VK5_".to_vec())])].concat();
        let error = read(&file).unwrap_err();
        assert_eq!(error.to_string(), "Vk4File is damaged: it does not start with VK4_");
    }
}
