//! Formats of optical profilers whose two public readers disagree, NanoFocus NMS and TrueMap TMD,
//! and on which they agree, Sensofar PLUX and Keyence VK. The constant of each format documents the
//! evidence.

use super::archive::Archive;
use super::channel::{Channel, NAME_FIRST, Sides};
use super::input::{Cursor, after, decode_text, factor, find, finite, meaning};
use super::raster::{ByteOrder, Element, Missing, Raster, checked_nodes, map_bytes};
use super::unit::Unit;
use super::xml::{self, child};
use super::{Format, FormatError, at_least_one};

/// NanoFocus NMS format (µsurf), a header of 3468 bytes and integers of 16 bits.
///
/// The header has the lowest and highest height in micrometres, the nodes along x and y, and the
/// steps in nanometres. The numbers 0 to 65534 span the heights. Lines run along x; the first line
/// has y = 0. surfalize 0.19.2 and SurfaceTopography 1.27.1 agree on the places; surfalize counts
/// the heights from the highest one, which would put them above it, and SurfaceTopography takes the
/// steps for millimetres, which makes a field of 160 µm one of 160 m.
///
/// Not known: whether 0 or 65535 marks points that were not measured. 65535 lies above the highest
/// height and is taken for a missing point. The format has no signature: a file is recognized by
/// its length, which fits nodes with one number and at most further images for each.
pub(crate) const NMS: Format = Format::new("nms", "NanoFocus", read_nms).without_signature();

// Offsets in bytes of the range of heights, the nodes and steps, and the numbers.
const NMS_RANGE: usize = 16;
const NMS_NODES: usize = 1368;
const NMS_DATA: usize = 3468;
/// Largest plausible step in nanometres.
const NMS_MAX_STEP: f64 = 1e6;

fn read_nms(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    if bytes.len() <= NMS_DATA {
        return Err(FormatError::Signature);
    }
    let mut range = Cursor::at(bytes, NMS_RANGE);
    let [lowest, highest] = [range.double()?, range.double()?];
    let mut grid = Cursor::at(bytes, NMS_NODES);
    let nodes = grid.nodes();
    let steps = [grid.double()?, grid.double()?];
    let Ok(nodes) = nodes else { return Err(FormatError::Signature) };
    let is_step = |step: &f64| *step > 0.0 && *step < NMS_MAX_STEP;
    let data = &bytes[NMS_DATA..];
    let needed = map_bytes(nodes, Element::U16);
    let fits = needed <= data.len() && data.len() <= needed.saturating_mul(4);
    let is_range = lowest < highest && highest - lowest < 1e6;
    if !(fits && is_range && steps.iter().all(is_step)) {
        return Err(FormatError::Signature);
    }
    let stored = Raster::rows(nodes, Element::U16, ByteOrder::Little, data)?;
    let scale = (highest - lowest) / 65534.0;
    let raster = stored.missing(Missing::Value(65535.0)).scaled(scale, lowest);
    let size = Sides::of_steps(nodes, steps, &Unit::parse("nm"))?;
    Ok(vec![Channel::new("heights", Unit::parse("µm"), size, raster)])
}

/// TrueMap data format (TMD) of GelSight and TrueGage, a short header and `f32` numbers.
///
/// The header has a signature of 32 bytes, a comment that ends with a zero byte, the nodes, the
/// sides and the offsets. Lines run along x; the first line has y = 0. Sides and heights are in
/// millimetres: so reads SurfaceTopography 1.27.1, and so writes `writetmd` of GelSight, whose
/// argument is millimetres per pixel. surfalize 0.19.2 reads and writes micrometres; its files have
/// lengths 1000 times too large here. NaN marks missing points.
pub(crate) const TMD: Format = Format::new("tmd", "TrueMap", read_tmd);

const TMD_SIGNATURE: &[u8] = b"Binary TrueMap Data File v2.0";
const TMD_COMMENT: usize = 32;
/// Length of nodes, sides and offsets in bytes.
const TMD_HEADER: usize = 24;

fn read_tmd(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    after(bytes, TMD_SIGNATURE)?;
    let comment = bytes.get(TMD_COMMENT..).unwrap_or_default();
    let end = find(comment, b"\0")? + 1;
    // The comment may be padded to 24 bytes.
    let [at_end, padded] = [end, 24].map(|length| tmd_map(bytes, TMD_COMMENT + length));
    at_end.or(padded).map(|channel| vec![channel])
}

/// Reads the map whose header starts at `start`. Its numbers fill the rest of the file.
fn tmd_map(bytes: &[u8], start: usize) -> Result<Channel<'_>, FormatError> {
    let mut cursor = Cursor::at(bytes, start);
    let nodes = cursor.nodes()?;
    let sides = [cursor.single()?, cursor.single()?];
    let stored = Cursor::at(bytes, start + TMD_HEADER).rest();
    let needed = map_bytes(nodes, Element::F32);
    if stored.len() != needed {
        let (element, found) = (Element::F32.size(), stored.len());
        return Err(FormatError::Heights { nodes, element, needed: needed as u128, found });
    }
    let raster = Raster::rows(nodes, Element::F32, ByteOrder::Little, stored)?;
    let millimetre = Unit::parse("mm");
    let size = Sides::new(sides, &millimetre)?;
    Ok(Channel::new("heights", millimetre, size, raster))
}

/// Sensofar PLUX format, a zip archive with `index.xml` and a file of `f32` numbers per layer.
///
/// `GENERAL` of the index has the nodes and the steps, `FOV_X` and `FOV_Y`, in micrometres, and
/// `LAYER_0`, `LAYER_1`, … name the files of the heights in micrometres. Lines run along x; the
/// first line has y = 0. NaN and, as in PLU files, 1000001 mark missing points. So read surfalize
/// 0.19.2 and SurfaceTopography 1.27.1.
pub(crate) const PLUX: Format = Format::new("plux", "Sensofar PLUX", read_plux);

/// Maximum length of the index in bytes.
const PLUX_MAX_INDEX: usize = 1 << 24;
/// Maximum number of XML nodes of the index.
const PLUX_MAX_NODES: u32 = 1 << 16;
/// Maximum number of layers.
const PLUX_MAX_LAYERS: usize = 64;

fn read_plux(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let mut archive = Archive::of_format(bytes)?;
    let index = archive.file("index.xml", PLUX_MAX_INDEX).map_err(|_| FormatError::Signature)?;
    let index = decode_text(&index);
    let parsed = xml::document("index.xml", &index, PLUX_MAX_NODES);
    let document = parsed.map_err(|_| FormatError::Signature)?;
    let root = document.root_element();
    let entry = |name: &str| child(root, &["GENERAL", name]);
    if entry("IMAGE_SIZE_X").is_none() {
        return Err(FormatError::Signature);
    }
    let number =
        |name: &str| xml::number(name, entry(name))?.ok_or_else(|| FormatError::missing(name));
    let nodes = [number("IMAGE_SIZE_X")?, number("IMAGE_SIZE_Y")?].map(|count| count as i64);
    let nodes = checked_nodes(nodes)?;
    let steps = [finite("FOV_X", number("FOV_X")?)?, finite("FOV_Y", number("FOV_Y")?)?];
    let micrometre = Unit::parse("µm");
    let size = Sides::of_steps(nodes, steps, &micrometre)?;
    let layers = (0..PLUX_MAX_LAYERS).map_while(|layer| child(root, &[&format!("LAYER_{layer}")]));
    let files = layers.filter_map(|layer| xml::text(child(layer, &["FILENAME_Z"])));
    let channels = files.enumerate().map(|(layer, file)| {
        let path = file.trim_start_matches("./");
        let stored = archive.exactly(path, map_bytes(nodes, Element::F32))?;
        let raster = Raster::rows(nodes, Element::F32, ByteOrder::Little, stored)?
            .missing(Missing::Value(1000001.0));
        Ok(Channel::new(format!("layer{layer}"), micrometre.clone(), size.clone(), raster))
    });
    at_least_one(channels, "LAYER_0")
}

/// Files of the Keyence VK laser microscopes: VK3, VK4, VK6 and VK7.
///
/// A VK3 or VK4 file has a table of the positions of its parts, among which are the measurement
/// conditions and up to three images of heights. A VK6 or VK7 file is a zip archive with the VK4
/// file `Vk4File`, after a preview. The conditions give the picometres per pixel along x and y and
/// per digit of a height; the sides are nodes × picometres per pixel. Lines run along x; the first
/// line has y = 0. The format has no marker of missing points.
///
/// The layout is that of SurfaceTopography 1.27.1, surfalize 0.19.2 and Gwyddion 2.62; no
/// file of an instrument could be compared.
pub(crate) const VK: Format = Format::new("vk", "Keyence VK", read_vk).changed(&[NAME_FIRST]);

/// Name of the VK4 file in the archive of a VK6 or VK7 file.
const VK_MEMBER: &str = "Vk4File";
/// Position of the table of positions, after the signature, the version and the type of the file.
const VK_TABLE: usize = 12;
/// Index of the image of heights in the table; the second and third images follow.
const VK_HEIGHTS: usize = 6;
/// Index of the picometres per pixel and per digit among the measurement conditions.
const VK_SCALES: usize = 42;
/// Length of the colour palette before the pixels of an image.
const VK_PALETTE: usize = 768;

fn read_vk(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    match bytes.get(..4) {
        Some(b"VK3_" | b"VK4_") => vk_channels(bytes),
        Some([b'V', b'K', b'6' | b'7', _]) => {
            let file = Archive::new(bytes)?.file(VK_MEMBER, u32::MAX as usize)?;
            Ok(vk_channels(&file)?.into_iter().map(Channel::into_owned).collect())
        }
        _ => Err(FormatError::Signature),
    }
}

/// Reads all images of heights of a VK3 or VK4 file.
fn vk_channels(file: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    if !(file.starts_with(b"VK3_") || file.starts_with(b"VK4_")) {
        return Err(FormatError::damaged(VK_MEMBER, "it does not start with VK4_"));
    }
    let number = |start: usize, index: usize| {
        Cursor::at(file, start.saturating_add(4 * index)).u32().map(|number| number as usize)
    };
    let conditions = number(VK_TABLE, 0)?;
    let scale = |index| number(conditions, VK_SCALES + index).map(|picometres| picometres as f64);
    let [x, y, digit] = [scale(0)?, scale(1)?, scale(2)?];
    let picometre = Unit::parse("pm");
    let mut channels = Vec::new();
    for (image, name) in ["Height", "Height 2", "Height 3"].into_iter().enumerate() {
        let start = number(VK_TABLE, VK_HEIGHTS + image)?;
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
        cursor.skip(3 * 4 + VK_PALETTE)?;
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
    use crate::tests::samples::packed;
    use crate::tests::samples::vendors::vk;

    #[test]
    fn a_compressed_image_is_refused() {
        let mut file = vk(b"VK4_");
        let image = 12 + 4 * 18 + 304;
        file[image + 12] = 1;
        let error = read_vk(&file).unwrap_err();
        assert_eq!(error.to_string(), "`compression` is 1; expected 0, no compression");
    }

    #[test]
    fn an_archive_without_its_file_is_damaged() {
        let file = [b"VK7\0".to_vec(), packed(&[("Vk4File", b"VK5_".to_vec())])].concat();
        let error = read_vk(&file).unwrap_err();
        assert_eq!(error.to_string(), "Vk4File is damaged: it does not start with VK4_");
    }
}
