//! Images of JPK instruments (now Bruker), which are TIFF files with the extension `jpk`.
//!
//! Each image after the thumbnail is a channel. Lines run along x; the first line has the largest y
//! unless the image has a tag that the grid is reflected. The tags of the first image give the
//! sides of the grid in metres. A channel has several slots, each
//! with a calibration from the stored integers to a unit. The default slot is read, as in
//! SurfaceTopography. The images of a force map (`jpk-qi-image`) have the same layout. Files with
//! force curves (`jpk-force`, `jpk-qi-data`) are not read.
//!
//! Six public files of 2017 and 2025, in the tests of AFMReader 0.0.7, show the layout.

use super::channel::{Channel, NAME_FIRST, Size};
use super::input::finite;
use super::raster::Raster;
use super::tiff::{Directory, directories, first_directory};
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

pub(crate) const FORMAT: Format = Format::new("jpk", "JPK image", read).changed(&[NAME_FIRST]);

// Tags of the first image.
const VERSION: u16 = 0x8000;
const GRID_SIDES: [u16; 2] = [0x8042, 0x8043];
// Tags of each image.
const CHANNEL: u16 = 0x8050;
const IS_RETRACE: u16 = 0x8051;
const TITLE: u16 = 0x8052;
const IS_REFLECTED: u16 = 0x8045;
const SLOTS: u16 = 0x8080;
const DEFAULT_SLOT: u16 = 0x8081;
// Tags of the first slot, followed by those of the next slots.
const SLOT_NAME: u16 = 0x8090;
const SLOT_UNIT: u16 = 0x80a2;
const SLOT_SCALING: u16 = 0x80a3;
const SLOT_FACTOR: u16 = 0x80a4;
const SLOT_OFFSET: u16 = 0x80a5;
const SLOT_TAGS: u16 = 0x30;
/// Maximum number of pixels for each byte of the file. JPK does not compress its pixels, which have
/// two or four bytes.
const MAX_PIXELS_PER_BYTE: usize = 8;
/// Maximum number of slots whose tags have 16 bits.
const MAX_SLOTS: i64 = 600;

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    // Other TIFF files, also damaged ones, are not files of this format.
    let first = first_directory(bytes).map_err(|_| FormatError::Signature)?;
    if first.entry(VERSION).is_none() || first.entry(GRID_SIDES[0]).is_none() {
        return Err(FormatError::Signature);
    }
    let sides = GRID_SIDES.map(|tag| {
        let side = first.number(tag);
        side.ok_or_else(|| FormatError::missing(format!("side of the grid, tag {tag:#x}")))
    });
    let [x, y] = sides;
    let size = Size::metres([x?, y?])?;
    let all = directories(bytes)?;
    let is_channel = |image: &&Directory<'_>| {
        image.text(CHANNEL).is_some_and(|name| !name.is_empty() && name != "thumbnail")
    };
    let images: Vec<&Directory<'_>> = all.iter().filter(is_channel).collect();
    let pixels = images.iter().map(|image| image.nodes().map_or(0, |[x, y]| x * y));
    // Images that share their pixels would need memory without limit.
    if pixels.sum::<usize>() > bytes.len().saturating_mul(MAX_PIXELS_PER_BYTE) {
        return Err(FormatError::damaged("the TIFF file", "it is too short for its images"));
    }
    let channels = images.into_iter().map(|image| channel(image, size));
    at_least_one(channels, "image other than the thumbnail")
}

fn channel<'a>(image: &Directory<'a>, size: Size) -> Result<Channel<'a>, FormatError> {
    let (unit, mut raster) = calibrated(image)?;
    if matches!(image.whole(IS_REFLECTED), None | Some(0)) {
        raster = raster.upside_down();
    }
    Ok(Channel::new(name(image), unit, size, raster))
}

fn name(image: &Directory<'_>) -> String {
    let title = image.text(TITLE).filter(|title| !title.is_empty());
    let name = title.or_else(|| image.text(CHANNEL)).unwrap_or_default();
    directed(name, image.whole(IS_RETRACE).is_some_and(|flag| flag != 0))
}

/// Returns the name of a channel with its scan direction, as SurfaceTopography writes it.
pub(crate) fn directed(name: String, is_retrace: bool) -> String {
    match name.strip_suffix(')') {
        _ if !is_retrace => name,
        Some(start) => format!("{start}, retrace)"),
        None => format!("{name} (retrace)"),
    }
}

/// Decodes an image by the calibration of its default slot.
fn calibrated<'a>(image: &Directory<'a>) -> Result<(Unit, Raster<'a>), FormatError> {
    let slot = image.text(DEFAULT_SLOT);
    let default = slot.ok_or_else(|| FormatError::missing("name of the default slot"))?;
    let slots = image.whole(SLOTS).unwrap_or(0).clamp(0, MAX_SLOTS) as u16;
    let mut shifts = (0..slots).map(|slot| slot * SLOT_TAGS);
    let found = shifts.find(|shift| image.text(SLOT_NAME + shift).as_ref() == Some(&default));
    let shift = found.ok_or_else(|| FormatError::missing(format!("slot {default}")))?;
    let unit = Unit::parse(&image.text(SLOT_UNIT + shift).unwrap_or_default());
    let required = |tag: u16| {
        let entry = format!("calibration of slot {default}, tag {:#x}", tag + shift);
        let number = image.number(tag + shift).ok_or_else(|| FormatError::missing(&*entry))?;
        finite(&entry, number)
    };
    match image.text(SLOT_SCALING + shift).as_deref() {
        Some("NullScaling") => Ok((unit, image.image()?)),
        Some("LinearScaling") => {
            let (factor, offset) = (required(SLOT_FACTOR)?, required(SLOT_OFFSET)?);
            Ok((unit, image.image()?.scaled(factor, offset)))
        }
        other => {
            let entry = format!("scaling of slot {default}");
            let allowed = "LinearScaling or NullScaling";
            Err(FormatError::value(&entry, other.unwrap_or("missing"), allowed))
        }
    }
}
