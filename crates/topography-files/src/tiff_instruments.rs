//! Formats of instruments that are TIFF files: JPK, LEXT of Olympus and Park Systems. The constant
//! of each format documents its layout.

use encoding_rs::UTF_16LE;
use roxmltree::Document;

use super::channel::{Channel, NAME_FIRST, Sides, Size, directed};
use super::input::{Cursor, factor, finite, meaning};
use super::raster::{ByteOrder, Element, Raster};
use super::tiff::{Directory, directories, first_directory};
use super::unit::Unit;
use super::{Format, FormatError, at_least_one, xml};

/// Images of JPK instruments (now Bruker), which are TIFF files with the extension `jpk`.
///
/// Each image after the thumbnail is a channel. Lines run along x; the first line has the largest y
/// unless the image has a tag that the grid is reflected. The tags of the first image give the
/// sides of the grid in metres. A channel has several slots, each
/// with a calibration from the stored integers to a unit. The default slot is read, as in
/// SurfaceTopography. The images of a force map (`jpk-qi-image`) have the same layout. Files with
/// force curves (`jpk-force`, `jpk-qi-data`) are not read.
///
/// Six public files of 2017 and 2025, in the tests of AFMReader 0.0.7, show the layout.
pub(crate) const JPK: Format = Format::new("jpk", "JPK image", read_jpk).changed(&[NAME_FIRST]);

// Tags of the first image.
const JPK_VERSION: u16 = 0x8000;
const JPK_SIDES: [u16; 2] = [0x8042, 0x8043];
// Tags of each image.
const JPK_CHANNEL: u16 = 0x8050;
const JPK_IS_RETRACE: u16 = 0x8051;
const JPK_TITLE: u16 = 0x8052;
const JPK_IS_REFLECTED: u16 = 0x8045;
const JPK_SLOTS: u16 = 0x8080;
const JPK_DEFAULT_SLOT: u16 = 0x8081;
// Tags of the first slot, followed by those of the next slots.
const JPK_SLOT_NAME: u16 = 0x8090;
const JPK_SLOT_UNIT: u16 = 0x80a2;
const JPK_SLOT_SCALING: u16 = 0x80a3;
const JPK_SLOT_FACTOR: u16 = 0x80a4;
const JPK_SLOT_OFFSET: u16 = 0x80a5;
const JPK_SLOT_TAGS: u16 = 0x30;
/// Maximum number of pixels for each byte of the file. JPK does not compress its pixels, which have
/// two or four bytes.
const JPK_MAX_PIXELS_PER_BYTE: usize = 8;
/// Maximum number of slots whose tags have 16 bits.
const JPK_MAX_SLOTS: i64 = 600;

fn read_jpk(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    // Other TIFF files, also damaged ones, are not files of this format.
    let first = first_directory(bytes).map_err(|_| FormatError::Signature)?;
    if first.entry(JPK_VERSION).is_none() || first.entry(JPK_SIDES[0]).is_none() {
        return Err(FormatError::Signature);
    }
    let sides = JPK_SIDES.map(|tag| {
        let side = first.number(tag);
        side.ok_or_else(|| FormatError::missing(format!("side of the grid, tag {tag:#x}")))
    });
    let [x, y] = sides;
    let size = Size::metres([x?, y?])?;
    let all = directories(bytes)?;
    let is_channel = |image: &&Directory<'_>| {
        image.text(JPK_CHANNEL).is_some_and(|name| !name.is_empty() && name != "thumbnail")
    };
    let images: Vec<&Directory<'_>> = all.iter().filter(is_channel).collect();
    let pixels = images.iter().map(|image| image.nodes().map_or(0, |[x, y]| x * y));
    // Images that share their pixels would need memory without limit.
    if pixels.sum::<usize>() > bytes.len().saturating_mul(JPK_MAX_PIXELS_PER_BYTE) {
        return Err(FormatError::damaged("the TIFF file", "it is too short for its images"));
    }
    let channels = images.into_iter().map(|image| jpk_channel(image, size));
    at_least_one(channels, "image other than the thumbnail")
}

fn jpk_channel<'a>(image: &Directory<'a>, size: Size) -> Result<Channel<'a>, FormatError> {
    let (unit, mut raster) = jpk_calibrated(image)?;
    if matches!(image.whole(JPK_IS_REFLECTED), None | Some(0)) {
        raster = raster.upside_down();
    }
    Ok(Channel::new(jpk_name(image), unit, size, raster))
}

fn jpk_name(image: &Directory<'_>) -> String {
    let title = image.text(JPK_TITLE).filter(|title| !title.is_empty());
    let name = title.or_else(|| image.text(JPK_CHANNEL)).unwrap_or_default();
    directed(name, image.whole(JPK_IS_RETRACE).is_some_and(|flag| flag != 0))
}

/// Decodes an image by the calibration of its default slot.
fn jpk_calibrated<'a>(image: &Directory<'a>) -> Result<(Unit, Raster<'a>), FormatError> {
    let slot = image.text(JPK_DEFAULT_SLOT);
    let default = slot.ok_or_else(|| FormatError::missing("name of the default slot"))?;
    let slots = image.whole(JPK_SLOTS).unwrap_or(0).clamp(0, JPK_MAX_SLOTS) as u16;
    let mut shifts = (0..slots).map(|slot| slot * JPK_SLOT_TAGS);
    let found = shifts.find(|shift| image.text(JPK_SLOT_NAME + shift).as_ref() == Some(&default));
    let shift = found.ok_or_else(|| FormatError::missing(format!("slot {default}")))?;
    let unit = Unit::parse(&image.text(JPK_SLOT_UNIT + shift).unwrap_or_default());
    let required = |tag: u16| {
        let entry = format!("calibration of slot {default}, tag {:#x}", tag + shift);
        let number = image.number(tag + shift).ok_or_else(|| FormatError::missing(&*entry))?;
        finite(&entry, number)
    };
    match image.text(JPK_SLOT_SCALING + shift).as_deref() {
        Some("NullScaling") => Ok((unit, image.image()?)),
        Some("LinearScaling") => {
            let (factor, offset) = (required(JPK_SLOT_FACTOR)?, required(JPK_SLOT_OFFSET)?);
            Ok((unit, image.image()?.scaled(factor, offset)))
        }
        other => {
            let entry = format!("scaling of slot {default}");
            let allowed = "LinearScaling or NullScaling";
            Err(FormatError::value(&entry, other.unwrap_or("missing"), allowed))
        }
    }
}

/// LEXT files of the Olympus OLS microscopes: TIFF files with a description in XML.
///
/// The first image has the description: the picometres per pixel along x and y, and per digit of a
/// height. A factor of calibration for each axis may stand among the Exif entries, in millionths.
/// The sides are nodes × picometres per pixel × calibration. The image with the description
/// `HEIGHT` has the heights; points that are set in the image `INVALID` are missing, which
/// SurfaceTopography and Gwyddion ignore. Lines run along x; the first line has y = 0.
///
/// The layout is that of SurfaceTopography 1.27.1 and Gwyddion 2.62; no file of an
/// instrument could be compared.
pub(crate) const LEXT: Format = Format::new("lext", "Olympus LEXT", read_lext);

// Tags of TIFF and Exif.
const LEXT_DESCRIPTION: u16 = 270;
const LEXT_EXIF: u16 = 0x8769;
const LEXT_SETTINGS: u16 = 0xa40b;
// Root elements of the descriptions.
const LEXT_ROOT: &str = "TiffTagDescData";
const LEXT_SETTINGS_ROOT: &str = "ExifTagDescData";
/// Maximum number of images; files have about five.
const LEXT_MAX_IMAGES: usize = 64;
/// Maximum number of XML nodes of a description.
const LEXT_MAX_XML_ELEMENTS: u32 = 1 << 16;

fn read_lext(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let first = first_directory(bytes).map_err(|_| FormatError::Signature)?;
    let description = first.text(LEXT_DESCRIPTION).unwrap_or_default();
    let Some(description) = lext_text(&description, LEXT_ROOT) else {
        return Err(FormatError::Signature);
    };
    let document = lext_document(description)?;
    let images = directories(bytes)?;
    let named = |wanted: &str| {
        let is_named = |image: &&Directory<'_>| {
            image.text(LEXT_DESCRIPTION).is_some_and(|name| name.eq_ignore_ascii_case(wanted))
        };
        images.iter().take(LEXT_MAX_IMAGES).find(is_named)
    };
    let heights = named("HEIGHT").ok_or_else(|| FormatError::missing("image HEIGHT"))?;
    let calibration = lext_calibration(&first)?;
    let scale = |axis: usize| {
        let name = ["HeightDataPerPixelX", "HeightDataPerPixelY", "HeightDataPerPixelZ"][axis];
        let number = xml::number(name, xml::first(&document, name))?;
        factor(name, number.ok_or_else(|| FormatError::missing(name))? * calibration[axis])
    };
    let raster = heights.image()?.scaled(scale(2)?, 0.0);
    let nodes = raster.nodes();
    let picometre = Unit::parse("pm");
    let size = Sides::new([nodes[0] as f64 * scale(0)?, nodes[1] as f64 * scale(1)?], &picometre)?;
    let mask = match named("INVALID") {
        Some(mask) if mask.nodes()? == nodes => Some(mask.bitmap()?),
        _ => None,
    };
    Ok(vec![Channel::new("Height", picometre, size, raster.masked(mask))])
}

/// Returns the calibration factors of x, y and the height, which are 1 if the file has none.
fn lext_calibration(image: &Directory<'_>) -> Result<[f64; 3], FormatError> {
    let exif = image.directory(LEXT_EXIF)?;
    let settings = exif.and_then(|exif| exif.text(LEXT_SETTINGS)).unwrap_or_default();
    let Some(settings) = lext_text(&settings, LEXT_SETTINGS_ROOT) else {
        return Ok([1.0; 3]);
    };
    let document = lext_document(settings)?;
    let mut factors = [1.0; 3];
    for (axis, value) in factors.iter_mut().enumerate() {
        let name = format!("MakerCalibrationValue{}", ["X", "Y", "Z"][axis]);
        if let Some(millionths) = xml::number(&name, xml::first(&document, &name))? {
            *value = millionths / 1e6;
        }
    }
    Ok(factors)
}

/// Returns the part of a text from the start of the XML element `root`, if there is one.
fn lext_text<'a>(text: &'a str, root: &str) -> Option<&'a str> {
    text.find(&format!("<{root}")).map(|start| &text[start..])
}

fn lext_document(text: &str) -> Result<Document<'_>, FormatError> {
    xml::document("the description in XML", text, LEXT_MAX_XML_ELEMENTS)
}

/// Images of Park Systems (formerly PSIA), which are TIFF files whose image is a coloured preview.
///
/// The heights and their header are entries of the only directory. Lines run along x; the first
/// line is the lowest of the image and has the largest y. The sides are in micrometres. A height is
/// gain × (scale × number + offset) in the unit of the header, micrometres if it names none; a
/// scale of 0 means 1. The first version has integers of 16 bits; the second states the type.
///
/// The layout is that of Gwyddion 2.62 (`psia.c`) and SurfaceTopography 1.27.1, which agree.
pub(crate) const PARK: Format = Format::new("park", "Park Systems TIFF", read_park);

// Entries of the directory.
const PARK_MAGIC: u16 = 50432;
const PARK_VERSION: u16 = 50433;
const PARK_DATA: u16 = 50434;
const PARK_HEADER: u16 = 50435;
const PARK_MAGIC_NUMBER: i64 = 0x0e03_1301;
const PARK_SECOND_VERSION: i64 = 0x0100_0002;
/// Type of a profile.
const PARK_PROFILE: u32 = 1;

fn read_park(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let directory = first_directory(bytes).map_err(|_| FormatError::Signature)?;
    if directory.whole(PARK_MAGIC) != Some(PARK_MAGIC_NUMBER) {
        return Err(FormatError::Signature);
    }
    let entry = |tag: u16| {
        let missing = || FormatError::missing(format!("TIFF tag {tag}"));
        directory.entry(tag).map(|entry| entry.bytes()).ok_or_else(missing)
    };
    let mut header = Cursor::new(entry(PARK_HEADER)?);
    if header.u32()? == PARK_PROFILE {
        return Err(FormatError::unsupported("the file holds a profile, not a map"));
    }
    let name = wide_text(&mut header, 32)?;
    // Mode, filter, flattening and tracking.
    header.skip(16 + 8 + 4 + 4)?;
    let nodes = header.nodes()?;
    // Angle, sine scan, overscan, forward, scan up and exchange of axes.
    header.skip(8 + 4 + 8 + 3 * 4)?;
    let sides = [header.double()?, header.double()?];
    // Offsets, rate, set point and its unit, and biases.
    header.skip(4 * 8 + 16 + 2 * 8)?;
    let gain = factor("data gain", header.double()?)?;
    let scale = match header.double()? {
        0.0 => 1.0,
        scale => finite("scale factor", scale)?,
    };
    let offset = finite("data offset", header.double()?)?;
    let unit = wide_text(&mut header, 8)?;
    let unit = if unit.is_empty() { "µm".to_owned() } else { unit };
    let element = if directory.whole(PARK_VERSION) == Some(PARK_SECOND_VERSION) {
        // Extremes, mean, compression, logarithm, square, servo gain, range and three modes.
        header.skip(6 * 4 + 2 * 8 + 3 * 16)?;
        let types = [(0, Element::I16), (1, Element::I32), (2, Element::F32)];
        meaning("type of the data", header.u32()?, "0, 1 or 2", &types)?
    } else {
        Element::I16
    };
    let stored = Raster::rows(nodes, element, ByteOrder::Little, entry(PARK_DATA)?)?;
    let raster = stored.upside_down().scaled(gain * scale, gain * offset);
    let size = Sides::new(sides, &Unit::parse("µm"))?;
    let name = if name.is_empty() { "heights".to_owned() } else { name };
    Ok(vec![Channel::new(name, Unit::parse(&unit), size, raster)])
}

/// Reads text of `letters` letters of two bytes up to the first zero.
fn wide_text(cursor: &mut Cursor<'_>, letters: usize) -> Result<String, FormatError> {
    let (text, _) = UTF_16LE.decode_without_bom_handling(cursor.take(2 * letters)?);
    Ok(text.split('\0').next().unwrap_or_default().trim().to_owned())
}
