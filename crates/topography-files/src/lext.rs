//! LEXT files of the Olympus OLS microscopes: TIFF files with a description in XML.
//!
//! The first image has the description: the picometres per pixel along x and y, and per digit of a
//! height. A factor of calibration for each axis may stand among the Exif entries, in millionths.
//! The sides are nodes × picometres per pixel × calibration. The image with the description
//! `HEIGHT` has the heights; points that are set in the image `INVALID` are missing, which
//! SurfaceTopography and Gwyddion ignore. Lines run along x; the first line has y = 0.
//!
//! The layout is that of SurfaceTopography 1.27.1 and Gwyddion 2.62; no file of an
//! instrument could be compared.

use roxmltree::Document;

use super::channel::{Channel, Sides};
use super::input::factor;
use super::tiff::{self, Directory};
use super::unit::Unit;
use super::xml;
use super::{Format, FormatError};

pub(crate) const FORMAT: Format = Format::new("lext", "Olympus LEXT", read);

// Tags of TIFF and Exif.
const DESCRIPTION: u16 = 270;
const EXIF: u16 = 0x8769;
const SETTINGS: u16 = 0xa40b;
// Root elements of the descriptions.
const ROOT: &str = "TiffTagDescData";
const SETTINGS_ROOT: &str = "ExifTagDescData";
/// Maximum number of images; files have about five.
const MAX_IMAGES: usize = 64;
/// Maximum number of XML nodes of a description.
const MAX_XML_ELEMENTS: u32 = 1 << 16;

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let first = tiff::first_directory(bytes).map_err(|_| FormatError::Signature)?;
    let description = first.text(DESCRIPTION).unwrap_or_default();
    let Some(description) = xml_text(&description, ROOT) else {
        return Err(FormatError::Signature);
    };
    let document = document(description)?;
    let images = tiff::directories(bytes)?;
    let named = |wanted: &str| {
        let is_named = |image: &&Directory<'_>| {
            image.text(DESCRIPTION).is_some_and(|name| name.eq_ignore_ascii_case(wanted))
        };
        images.iter().take(MAX_IMAGES).find(is_named)
    };
    let heights = named("HEIGHT").ok_or_else(|| FormatError::missing("image HEIGHT"))?;
    let calibration = calibration(&first)?;
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
fn calibration(image: &Directory<'_>) -> Result<[f64; 3], FormatError> {
    let exif = image.directory(EXIF)?;
    let settings = exif.and_then(|exif| exif.text(SETTINGS)).unwrap_or_default();
    let Some(settings) = xml_text(&settings, SETTINGS_ROOT) else {
        return Ok([1.0; 3]);
    };
    let document = document(settings)?;
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
fn xml_text<'a>(text: &'a str, root: &str) -> Option<&'a str> {
    text.find(&format!("<{root}")).map(|start| &text[start..])
}

fn document(text: &str) -> Result<Document<'_>, FormatError> {
    xml::document("the description in XML", text, MAX_XML_ELEMENTS)
}
