//! TIFF files of 16 or more bits per pixel: elevation models (GeoTIFF), images of microscopes
//! (OME-TIFF, ImageJ), and plain TIFF files.
//!
//! - **GeoTIFF** (OGC 19-008r4; GDAL 3.10 writes it): the entry 33550 has the steps. Lines run from
//!   west to east, the first line is the northernmost, so that it has the largest y. In its place,
//!   the matrix 34264 may have steps of either sign; a grid that it turns is refused. The keys 1024
//!   and 3076 say whether the steps are degrees or lengths. The text of entry 42113 is the number
//!   of missing points, the metadata of GDAL in 42112 scale, offset and unit. Without that unit,
//!   the key 4099 or the vertical system of the key 4096 says the unit of the heights. A mask in
//!   the file (GDAL 3.10 with `GDAL_TIFF_INTERNAL_MASK`) has the bit 0 at missing points.
//! - **OME-TIFF** (schema 2016-06): `PhysicalSizeX` and `PhysicalSizeY` of the description, in
//!   micrometres unless their units differ, and the names of its channels.
//! - **ImageJ** 1.5: the description starts with `ImageJ=`; the resolution is in pixels per `unit`,
//!   and a linear calibration `c0` + `c1` × number gives values in `vunit`.
//!
//! Other files have neither size nor unit: the resolution of a picture is that of its print. In
//! these three, the first line has y = 0. Files that hold only pictures of eight bits or of several
//! colours are refused; beside maps, pictures and images of reduced resolution are not used.

use roxmltree::Document;

use super::channel::{Channel, Sides, Size};
use super::raster::{Missing, Raster};
use super::tiff::{Directory, directories};
use super::unit::Unit;
use super::xml;
use super::{Format, FormatError, at_least_one};

pub(crate) const FORMAT: Format = Format::new("tiff", "TIFF", read).changed(&[
    "the matrix of a GeoTIFF gives steps and directions",
    "kilometres, centimetres and millimetres are units of the sides",
    "masks in the file of GDAL; units of heights from vertical systems",
]);

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
const VERTICAL_SYSTEM: i64 = 4096;
const VERTICAL_UNITS: i64 = 4099;
/// Units of length with their metres, by their number in the registry of EPSG.
const LINEAR: [(i64, f64); 6] =
    [(1025, 1e-3), (1033, 1e-2), (9001, 1.0), (9002, 0.3048), (9003, 1200.0 / 3937.0), (9036, 1e3)];
/// Returns the unit of a vertical system; both are numbers in the registry of EPSG (version 11).
fn unit_of_vertical_system(system: i64) -> Option<i64> {
    match system {
        // Sea level, the geoids of 1996 and 2008, Europe.
        5714 | 5773 | 3855 | 5621 | 5730 | 9389 => Some(9001),
        // Australia, France, Germany, Great Britain, the Netherlands and Switzerland.
        5711 | 5720 | 5783 | 7837 | 5701 | 5709 | 5728 => Some(9001),
        // North America in metres, in feet of the US survey and in feet.
        5703 => Some(9001),
        5702 | 6360 => Some(9003),
        8228 => Some(9002),
        _ => None,
    }
}

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let images = directories(bytes)?;
    let is_full = |image: &&Directory<'_>| image.whole(SUBFILE).unwrap_or(0) & 5 == 0;
    let full: Vec<&Directory<'_>> = images.iter().filter(is_full).collect();
    let is_mask = |image: &&Directory<'_>| image.whole(SUBFILE).unwrap_or(0) & 5 == 4;
    let masks: Vec<&Directory<'_>> = images.iter().filter(is_mask).collect();
    let names = ome_names(&images[0], full.len());
    // Images that share their pixels would need memory without limit.
    let pixels: usize = full.iter().map(|image| image.nodes().map_or(0, |[x, y]| x * y)).sum();
    if pixels > bytes.len().saturating_mul(1 << 12) {
        return Err(FormatError::damaged("the TIFF file", "it is too short for its images"));
    }
    let count = full.len();
    let numbered = full.into_iter().enumerate();
    let (maps, pictures): (Vec<_>, Vec<_>) = numbered.partition(|(_, image)| is_map(image));
    if maps.is_empty() && !pictures.is_empty() {
        return Err(FormatError::unsupported(
            "the TIFF file holds a picture, not heights: it has several colours or fewer than 16 \
             bits per pixel",
        ));
    }
    let channels = maps.into_iter().map(|(index, image)| {
        let name = match (count, names.get(index)) {
            (_, Some(name)) => name.clone(),
            (1, None) => "heights".to_owned(),
            (_, None) => format!("page {}", index + 1),
        };
        let raster = image.image()?;
        let of_image = masks.iter().find(|mask| mask.nodes().ok() == Some(raster.nodes()));
        let mask = of_image.map(|mask| Ok(mask.bitmap()?.scaled(-1.0, 1.0))).transpose()?;
        let channel = channel(image, raster.masked(mask), &images[0], name, count)?;
        let note = format!("{} of the pages are pictures and are not used", pictures.len());
        Ok(channel.noted((!pictures.is_empty()).then_some(note)))
    });
    at_least_one(channels, "image of full resolution")
}

/// Returns true if an image may be heights: pictures have several colours or fewer bits.
fn is_map(image: &Directory<'_>) -> bool {
    image.whole(SAMPLES).unwrap_or(1) == 1 && image.whole(BITS).unwrap_or(1) >= 16
}

fn channel<'a>(
    image: &Directory<'a>,
    raster: Raster<'a>,
    first: &Directory<'a>,
    name: String,
    pages: usize,
) -> Result<Channel<'a>, FormatError> {
    let description = first.text(DESCRIPTION).unwrap_or_default();
    let of_gdal = [PIXEL_SCALE, TRANSFORMATION, GDAL_NODATA];
    if of_gdal.iter().any(|tag| image.entry(*tag).is_some()) {
        elevation(image, raster, name)
    } else if description.starts_with("ImageJ=") {
        let channel = imagej(first, &description, raster, name)?;
        // Stacks of more than 4 GB have one directory for all slices.
        let slices = imagej_value(&description, "images").and_then(|text| text.parse().ok());
        let is_stack = matches!((slices, pages), (Some(2_u64..), 1));
        Ok(channel.noted(is_stack.then_some("only the first slice of the ImageJ stack is read")))
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
    let raster = raster
        .missing(marker.map_or(Missing::None, Missing::Around))
        .scaled(number("scale", 1.0), number("offset", 0.0));
    let steps = steps(image)?;
    let is_north_first = steps.is_none_or(|[_, y]| y < 0.0);
    let raster = if is_north_first { raster.upside_down() } else { raster };
    let raster = if steps.is_some_and(|[x, _]| x < 0.0) { raster.mirrored() } else { raster };
    let keys = image.wholes(GEO_KEYS);
    // Each key has its number, the entry of its value (0: the key itself), a count and the value.
    let key = |wanted: i64| {
        let mut keys = keys.as_chunks::<4>().0.iter().skip(1);
        keys.find(|[number, ..]| *number == wanted).map(|[.., value]| *value)
    };
    let metres = |unit: i64| LINEAR.iter().find(|(known, _)| *known == unit).map(|(_, one)| *one);
    let of_system = || key(VERTICAL_SYSTEM).and_then(unit_of_vertical_system);
    let vertical = key(VERTICAL_UNITS).or_else(of_system);
    let unit = match (item("unittype"), vertical.and_then(metres)) {
        (Some(text), _) => Unit::parse(&text),
        (None, Some(metres)) => Unit::Length(1.0 / metres),
        (None, None) => Unit::None,
    };
    let nodes = raster.nodes();
    let Some(steps) = steps else {
        return Ok(Channel::new(name, unit, Size::Unknown, raster));
    };
    let sides = [0, 1].map(|axis| nodes[axis] as f64 * steps[axis].abs());
    if key(MODEL_TYPE) == Some(GEOGRAPHIC) {
        let channel = Channel::new(name, unit, Size::Unknown, raster);
        let note = "the steps are degrees of longitude and latitude, not lengths; project the map";
        return Ok(channel.noted([note]));
    }
    let linear = key(LINEAR_UNITS);
    let size = match (linear.and_then(metres), linear) {
        (Some(metres), _) => Size::metres(sides.map(|side| side * metres))?.into(),
        (None, Some(code)) => Sides::new(sides, &Unit::Other(format!("unit {code} of EPSG")))?,
        (None, None) => Sides::new(sides, &Unit::None)?,
    };
    Ok(Channel::new(name, unit, size, raster))
}

/// Returns the steps to the east and to the north from one column and one line to the next.
fn steps(image: &Directory<'_>) -> Result<Option<[f64; 2]>, FormatError> {
    if let [x, y, ..] = *image.numbers(PIXEL_SCALE) {
        return Ok(Some([x, -y]));
    }
    match *image.numbers(TRANSFORMATION) {
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

/// Returns the value of an entry of the description of ImageJ.
fn imagej_value<'d>(description: &'d str, name: &str) -> Option<&'d str> {
    let mut lines = description.lines().filter_map(|line| line.split_once('='));
    lines.find(|(known, _)| *known == name).map(|(_, value)| value.trim())
}

fn imagej<'a>(
    image: &Directory<'a>,
    description: &str,
    raster: Raster<'a>,
    name: String,
) -> Result<Channel<'a>, FormatError> {
    let value = |name: &str| imagej_value(description, name);
    // ImageJ writes the micro sign as an escape.
    let unit = |name: &str| value(name).map(|text| Unit::parse(&text.replace("\\u00B5", "µ")));
    let nodes = raster.nodes();
    let resolutions = RESOLUTIONS.map(|tag| image.number(tag));
    let size = match (resolutions, unit("unit")) {
        ([Some(x), Some(y)], Some(unit)) if x > 0.0 && y > 0.0 => {
            Sides::new([nodes[0] as f64 / x, nodes[1] as f64 / y], &unit)?
        }
        _ => Sides::UNKNOWN,
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

/// Returns the names of the channels of an OME-TIFF, one for each page, or no names.
fn ome_names(first: &Directory<'_>, pages: usize) -> Vec<String> {
    let description = first.text(DESCRIPTION).unwrap_or_default();
    let document = Document::parse(&description).ok().filter(|_| description.contains("<OME"));
    let Some(pixels) = document.as_ref().and_then(|document| xml::first(document, "Pixels")) else {
        return vec![];
    };
    let channels = pixels.children().filter(|child| child.tag_name().name() == "Channel");
    let names: Vec<&str> = channels.filter_map(|channel| channel.attribute("Name")).collect();
    let length = |axis: char| -> usize {
        let text = pixels.attribute(format!("Size{axis}").as_str());
        text.and_then(|text| text.parse().ok()).unwrap_or(1)
    };
    let order = pixels.attribute("DimensionOrder").unwrap_or("XYCZT");
    // Pages between neighbouring channels.
    let faster = order.chars().skip(2).take_while(|axis| *axis != 'C');
    let between = faster.map(length).fold(1, usize::saturating_mul);
    let is_named = !names.is_empty() && !names.iter().any(|name| name.is_empty());
    if !is_named || names.len() != length('C') || between == 0 {
        return vec![];
    }
    let is_one_each = pages == names.len();
    let name = |page: usize| match names[page / between % names.len()] {
        name if is_one_each => name.to_owned(),
        name => format!("{name}, page {}", page + 1),
    };
    (0..pages).map(name).collect()
}

/// Returns the size that the description of an OME-TIFF states.
fn ome_size(description: &str, nodes: [usize; 2]) -> Result<Sides, FormatError> {
    let document = Document::parse(description)
        .map_err(|error| FormatError::damaged("the OME description", error))?;
    let Some(pixels) = xml::first(&document, "Pixels") else { return Ok(Sides::UNKNOWN) };
    let side = |axis: char, nodes: usize| {
        let step: f64 = pixels.attribute(format!("PhysicalSize{axis}").as_str())?.parse().ok()?;
        Some(step * nodes as f64)
    };
    let unit = |axis: char| pixels.attribute(format!("PhysicalSize{axis}Unit").as_str());
    let [unit_x, unit_y] = ['X', 'Y'].map(|axis| unit(axis).unwrap_or("µm"));
    let (Some(x), Some(y)) = (side('X', nodes[0]), side('Y', nodes[1])) else {
        return Ok(Sides::UNKNOWN);
    };
    Sides::in_units([x, y], [unit_x, unit_y])
}

#[cfg(test)]
mod tests {
    use crate::tests::samples::tiff_files::elevation;
    use crate::{Size, read};

    /// Returns the entry of a transformation of columns and lines to east and north.
    fn matrix([x, x_of_line, y_of_column, y]: [f64; 4]) -> (u16, u16, Vec<u8>) {
        let numbers = [[x, x_of_line, 0.0, 0.0], [y_of_column, y, 0.0, 0.0], [0.0; 4], [0.0; 4]];
        (
            super::TRANSFORMATION,
            12,
            numbers.as_flattened().iter().flat_map(|n| n.to_be_bytes()).collect(),
        )
    }

    #[test]
    fn an_unknown_unit_of_the_sides_is_named() {
        let steps: Vec<u8> = [2.0_f64, 3.0, 0.0].iter().flat_map(|n| n.to_be_bytes()).collect();
        let keys = |unit: u16| {
            let keys = [1, 1, 0, 2, super::MODEL_TYPE as u16, 0, 1, 1, 3076, 0, 1, unit];
            (super::GEO_KEYS, 3, keys.iter().flat_map(|key| key.to_be_bytes()).collect())
        };
        let grid = |unit| elevation(&[(super::PIXEL_SCALE, 12, steps.clone()), keys(unit)]);
        let kilometres = grid(9036);
        assert_eq!(read(&kilometres).unwrap().channels()[0].size(), Size::Metres([6e3, 6e3]));
        let unknown = grid(9030);
        let unknown = read(&unknown).unwrap();
        assert_eq!(unknown.channels()[0].unknown_side_unit(), Some("unit 9030 of EPSG"));
        let ome = |unit: &str| {
            let text = format!(
                "<OME><Image><Pixels PhysicalSizeX=\"2\" PhysicalSizeY=\"3\" \
                 PhysicalSizeXUnit=\"{unit}\" PhysicalSizeYUnit=\"{unit}\"/></Image></OME>\0"
            );
            super::ome_size(text.trim_end_matches('\0'), [3, 2]).unwrap()
        };
        assert_eq!(ome("nm"), Size::metres([6e-9, 6e-9]).unwrap().into());
        assert_ne!(ome("furlong"), crate::channel::Sides::UNKNOWN);
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
