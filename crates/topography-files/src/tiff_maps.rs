//! TIFF files of 16 or more bits per pixel: elevation models (GeoTIFF), images of microscopes
//! (OME-TIFF, ImageJ), and plain TIFF files.
//!
//! - **GeoTIFF** (OGC 19-008r4; GDAL 3.10 writes it): the entry 33550 has the steps. Lines run from
//!   west to east, the first line is the northernmost, so that it has the largest y. In its place,
//!   the matrix 34264 may have steps of either sign; a grid that it turns is refused. The keys 1024
//!   and 3076 say whether the steps are degrees or lengths. The text of entry 42113 is the number
//!   of missing points, and the metadata of GDAL in 42112 scale and offset.
//! - **OME-TIFF** (schema 2016-06): `PhysicalSizeX` and `PhysicalSizeY` of the description, in
//!   micrometres unless their units differ.
//! - **ImageJ** 1.5: the description starts with `ImageJ=`; the resolution is in pixels per `unit`,
//!   and a linear calibration `c0` + `c1` × number gives values in `vunit`.
//!
//! Other files have neither size nor unit: the resolution of a picture is that of its print. In
//! these three, the first line has y = 0. Pictures of eight bits or of several colours are refused;
//! images of reduced resolution are skipped.

use roxmltree::Document;

use super::channel::{Channel, Size};
use super::raster::{Missing, Raster};
use super::tiff::{Directory, directories};
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

pub const FORMAT: Format =
    Format { name: "tiff", title: "TIFF", version: 2, has_signature: true, read };

// Entries of directories.
const SUBFILE: u16 = 254;
const BITS: u16 = 258;
const DESCRIPTION: u16 = 270;
const SAMPLES: u16 = 277;
const RESOLUTIONS: [u16; 2] = [282, 283];
const PIXEL_SCALE: u16 = 33550;
const TRANSFORMATION: u16 = 34264;
const GEO_KEYS: u16 = 34735;
const GDAL_METADATA: u16 = 42112;
const GDAL_NODATA: u16 = 42113;
// Geographic keys and their values.
const MODEL_TYPE: i64 = 1024;
const GEOGRAPHIC: i64 = 2;
const LINEAR_UNITS: i64 = 3076;
/// Units of length with their metres, by their number.
const LINEAR: [(i64, f64); 3] = [(9001, 1.0), (9002, 0.3048), (9003, 1200.0 / 3937.0)];

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let images = directories(bytes)?;
    let is_full = |image: &&Directory<'_>| image.whole(SUBFILE).unwrap_or(0) & 5 == 0;
    let full: Vec<&Directory<'_>> = images.iter().filter(is_full).collect();
    // Images that share their pixels would need memory without limit.
    let pixels: usize = full.iter().map(|image| image.nodes().map_or(0, |[x, y]| x * y)).sum();
    if pixels > bytes.len().saturating_mul(1 << 12) {
        return Err(FormatError::damaged("the TIFF file", "it is too short for its images"));
    }
    let count = full.len();
    let channels = full.into_iter().enumerate().map(|(index, image)| {
        let name = if count == 1 { "heights".to_owned() } else { format!("page {}", index + 1) };
        channel(image, &images[0], name)
    });
    at_least_one(channels, "image of full resolution")
}

fn channel<'a>(
    image: &Directory<'a>,
    first: &Directory<'a>,
    name: String,
) -> Result<Channel<'a>, FormatError> {
    if image.whole(SAMPLES).unwrap_or(1) != 1 || image.whole(BITS).unwrap_or(1) < 16 {
        return Err(FormatError::unsupported(
            "the TIFF file holds a picture, not heights: it has several colours or fewer than 16 \
             bits per pixel",
        ));
    }
    let raster = image.image()?;
    let description = first.text(DESCRIPTION).unwrap_or_default();
    let of_gdal = [PIXEL_SCALE, TRANSFORMATION, GDAL_NODATA];
    if of_gdal.iter().any(|tag| image.entry(*tag).is_some()) {
        elevation(image, raster, name)
    } else if description.starts_with("ImageJ=") {
        imagej(first, &description, raster, name)
    } else if description.contains("<OME") {
        let size = ome_size(&description, raster.nodes())?;
        Ok(Channel::new(name, Unit::None, size, raster))
    } else {
        Ok(Channel::new(name, Unit::None, Size::Unknown, raster))
    }
}

/// Reads a raster of GDAL with or without geographic entries.
fn elevation<'a>(
    image: &Directory<'a>,
    raster: Raster<'a>,
    name: String,
) -> Result<Channel<'a>, FormatError> {
    let metadata = image.text(GDAL_METADATA).unwrap_or_default();
    let item = |role: &str| gdal_item(&metadata, role);
    let number =
        |role: &str, default: f64| item(role).and_then(|text| text.parse().ok()).unwrap_or(default);
    let marker = image.text(GDAL_NODATA).and_then(|text| text.parse::<f64>().ok());
    let raster = match marker {
        Some(marker) => raster.missing(Missing::Around(marker)),
        None => raster,
    };
    let raster = raster.scaled(number("scale", 1.0), number("offset", 0.0));
    let steps = steps(image)?;
    let is_north_first = steps.is_none_or(|[_, y]| y < 0.0);
    let raster = if is_north_first { raster.upside_down() } else { raster };
    let raster = if steps.is_some_and(|[x, _]| x < 0.0) { raster.mirrored() } else { raster };
    let unit = item("unittype").map_or(Unit::None, |text| Unit::parse(&text));
    let nodes = raster.nodes();
    let Some(steps) = steps else {
        return Ok(Channel::new(name, unit, Size::Unknown, raster));
    };
    let sides = [0, 1].map(|axis| nodes[axis] as f64 * steps[axis].abs());
    let keys: Vec<i64> =
        image.entry(GEO_KEYS).and_then(|entry| entry.wholes()).into_iter().flatten().collect();
    // Each key has its number, the entry of its value (0: the key itself), a count and the value.
    let key = |wanted: i64| {
        let mut keys = keys.as_chunks::<4>().0.iter().skip(1);
        keys.find(|[number, ..]| *number == wanted).map(|[.., value]| *value)
    };
    if key(MODEL_TYPE) == Some(GEOGRAPHIC) {
        let channel = Channel::new(name, unit, Size::Unknown, raster);
        let note = "the steps are degrees of longitude and latitude, not lengths; project the map";
        return Ok(channel.noted(note));
    }
    let metres = key(LINEAR_UNITS).and_then(|unit| LINEAR.iter().find(|(known, _)| *known == unit));
    let size = match metres {
        Some((_, metres)) => Size::metres(sides.map(|side| side * metres))?,
        None => Size::new(sides, &Unit::None)?,
    };
    Ok(Channel::new(name, unit, size, raster))
}

/// Returns the steps to the east and to the north from one column and one line to the next.
fn steps(image: &Directory<'_>) -> Result<Option<[f64; 2]>, FormatError> {
    let numbers = |tag: u16| -> Vec<f64> {
        image.entry(tag).and_then(|entry| entry.numbers()).into_iter().flatten().collect()
    };
    if let [x, y, ..] = *numbers(PIXEL_SCALE) {
        return Ok(Some([x, -y]));
    }
    match *numbers(TRANSFORMATION) {
        [x, x_of_line, _, _, y_of_column, y, ..] if x_of_line == 0.0 && y_of_column == 0.0 => {
            Ok(Some([x, y]))
        }
        [] => Ok(None),
        _ => Err(FormatError::unsupported(
            "the grid is turned against north (TIFF tag 34264); align it with `gdalwarp`",
        )),
    }
}

/// Returns the text of the item with a role in the metadata of GDAL.
fn gdal_item(metadata: &str, role: &str) -> Option<String> {
    let document = Document::parse(metadata).ok()?;
    let mut items = document.descendants();
    let item = items.find(|item| item.attribute("role") == Some(role))?;
    item.text().map(|text| text.trim().to_owned())
}

fn imagej<'a>(
    image: &Directory<'a>,
    description: &str,
    raster: Raster<'a>,
    name: String,
) -> Result<Channel<'a>, FormatError> {
    let value = |name: &str| {
        let mut lines = description.lines().filter_map(|line| line.split_once('='));
        lines.find(|(known, _)| *known == name).map(|(_, value)| value.trim())
    };
    // ImageJ writes the micro sign as an escape.
    let unit = |name: &str| value(name).map(|text| Unit::parse(&text.replace("\\u00B5", "µ")));
    let nodes = raster.nodes();
    let resolutions = RESOLUTIONS.map(|tag| image.number(tag));
    let size = match (resolutions, unit("unit")) {
        ([Some(x), Some(y)], Some(unit)) if x > 0.0 && y > 0.0 => {
            Size::new([nodes[0] as f64 / x, nodes[1] as f64 / y], &unit)?
        }
        _ => Size::Unknown,
    };
    let number = |name: &str| value(name).and_then(|text| text.parse::<f64>().ok());
    let (raster, heights) = match (value("cf"), number("c0"), number("c1")) {
        (Some("0"), Some(offset), Some(scale)) => {
            (raster.scaled(scale, offset), unit("vunit").unwrap_or(Unit::None))
        }
        _ => (raster, Unit::None),
    };
    Ok(Channel::new(name, heights, size, raster))
}

/// Returns the size that the description of an OME-TIFF states.
fn ome_size(description: &str, nodes: [usize; 2]) -> Result<Size, FormatError> {
    let document = Document::parse(description);
    let document = document.map_err(|error| FormatError::damaged("the OME description", error))?;
    let mut elements = document.descendants();
    let Some(pixels) = elements.find(|element| element.tag_name().name() == "Pixels") else {
        return Ok(Size::Unknown);
    };
    let side = |axis: char, nodes: usize| {
        let step: f64 = pixels.attribute(format!("PhysicalSize{axis}").as_str())?.parse().ok()?;
        let unit = pixels.attribute(format!("PhysicalSize{axis}Unit").as_str()).unwrap_or("µm");
        Some(step * nodes as f64 / Unit::parse(unit).per_metre()?)
    };
    match (side('X', nodes[0]), side('Y', nodes[1])) {
        (Some(x), Some(y)) => Size::metres([x, y]),
        _ => Ok(Size::Unknown),
    }
}

#[cfg(test)]
mod tests {
    use crate::samples::new_formats::elevation;
    use crate::{Size, read};

    /// Returns the entry of a transformation of columns and lines to east and north.
    fn matrix([x, x_of_line, y_of_column, y]: [f64; 4]) -> (u16, u16, Vec<u8>) {
        let numbers = [[x, x_of_line, 0.0, 0.0], [y_of_column, y, 0.0, 0.0], [0.0; 4], [0.0; 4]];
        (
            super::TRANSFORMATION,
            12,
            numbers.as_flattened().iter().flat_map(|n| n.to_le_bytes()).collect(),
        )
    }

    #[test]
    fn a_matrix_gives_steps_and_directions() {
        let plain = elevation(&[]);
        let plain = read(&plain).unwrap().channels()[0].map();
        let found = |numbers| {
            let bytes = elevation(&[matrix(numbers)]);
            let map = read(&bytes).unwrap().channels()[0].map();
            assert_eq!(map.size(), Size::Unitless([6.0, 6.0]));
            map
        };
        assert_eq!(found([2.0, 0.0, 0.0, -3.0]).missing(), plain.missing());
        let south_first = found([2.0, 0.0, 0.0, 3.0]);
        assert_eq!(south_first.get(0, 0), plain.get(0, 1));
        let mirrored = found([-2.0, 0.0, 0.0, -3.0]);
        assert_eq!(mirrored.get(2, 0), plain.get(0, 0));
        let turned = read(&elevation(&[matrix([2.0, 1.0, 1.0, -3.0])])).unwrap_err();
        let source = std::error::Error::source(&turned).unwrap().to_string();
        assert!(source.starts_with("the grid is turned against north"), "{source}");
    }
}
