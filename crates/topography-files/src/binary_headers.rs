//! Formats with a binary header and binary numbers, mostly of optical profilometers: FRT, MetroPro,
//! OPD, PLU and Digital Surf. The constant of each format documents its line order and sides.

use std::borrow::Cow;

use flate2::read::ZlibDecoder;

use super::channel::{Channel, NAME_FIRST, Sides, Size};
use super::input::{Cursor, after, factor, finite, inflate, meaning};
use super::raster::{ByteOrder, Element, Missing, Raster, checked_nodes, map_bytes};
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

/// FRT MicroProf format, a sequence of blocks. Each block has a number that identifies its content,
/// and a length.
///
/// The blocks 0x0B and 0x7D contain maps, and another block gives their sides in metres. Lines run
/// along x; the first line has the largest y. The number 1 marks missing points.
///
/// Two files in the tests of SurfaceTopography 1.27.1 show both kinds of blocks.
pub(crate) const FRT: Format = Format::new("frt", "FRT MicroProf", read_frt).changed(&[NAME_FIRST]);

// Numbers of the blocks. The grid block has the numbers of nodes and of bits per height. The scale
// block has the metres per unit of the stored heights.
const FRT_GRID: u16 = 0x66;
const FRT_SIDES: u16 = 0x67;
const FRT_SCALE: u16 = 0x6c;
const FRT_MAP: u16 = 0x0b;
const FRT_MAPS: u16 = 0x7d;

/// Bits of the types of maps that are heights: topography, thickness, sample thickness, force
/// microscopy.
const FRT_HEIGHTS: u32 = 0x0004 | 0x0080 | 0x0800 | 0x1000;

fn read_frt(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    after(bytes, b"FRTM_GLIDERV")?;
    let blocks = frt_blocks(bytes)?;
    let block = |wanted: u16, name: &str| {
        let block = blocks.iter().find(|(number, _)| *number == wanted);
        let bytes = block.map(|(_, bytes)| Cursor::new(bytes));
        bytes.ok_or_else(|| FormatError::missing(format!("block {wanted:#04x}, {name}")))
    };
    let mut sides = block(FRT_SIDES, "the sides")?;
    let size = Size::metres([sides.double()?, sides.double()?])?;
    let mut scale = block(FRT_SCALE, "the scale of heights")?;
    scale.skip(4)?;
    let scale = factor("scale of heights", scale.double()?)?;
    if let Ok(mut map) = block(FRT_MAP, "the map") {
        let raster = frt_raster(&mut block(FRT_GRID, "the nodes")?, &mut map)?;
        let raster = raster.scaled(scale, 0.0);
        return Ok(vec![Channel::new("heights", Unit::parse("m"), size, raster)]);
    }
    let mut maps = block(FRT_MAPS, "the maps")?;
    maps.skip(8)?;
    let mut channels = Vec::new();
    while !maps.rest().is_empty() {
        let kind = maps.u32()?;
        let mut header = maps.clone();
        maps.skip(12)?;
        let raster = frt_raster(&mut header, &mut maps)?;
        if kind & FRT_HEIGHTS != 0 {
            let name = format!("heights {}", channels.len() + 1);
            let raster = raster.scaled(scale, 0.0);
            channels.push(Ok(Channel::new(name, Unit::parse("m"), size, raster)));
        }
    }
    at_least_one(channels, "block 0x0b, the map")
}

/// Reads the numbers of nodes and of bits per height of a map from `header`, and the heights from
/// `stored`.
fn frt_raster<'a>(
    header: &mut Cursor<'_>,
    stored: &mut Cursor<'a>,
) -> Result<Raster<'a>, FormatError> {
    let nodes = header.nodes()?;
    let types = [(16, Element::U16), (32, Element::I32)];
    let element = meaning("bits per number", header.u32()?, "16 or 32", &types)?;
    let stored = stored.take(map_bytes(nodes, element))?;
    let raster = Raster::rows(nodes, element, ByteOrder::Little, stored)?;
    Ok(raster.missing(Missing::Value(1.0)).upside_down())
}

/// Returns all blocks of a file, each as its number and its content.
fn frt_blocks(bytes: &[u8]) -> Result<Vec<(u16, &[u8])>, FormatError> {
    let mut cursor = Cursor::at(bytes, 12);
    let version = cursor.text(4)?;
    let count = cursor.u16()?;
    let mut blocks = Vec::new();
    for _ in 0..count {
        let number = cursor.u16()?;
        let length = match version.as_str() {
            "1.00" => cursor.u32()?.into(),
            "1.01" => u64::from_le_bytes(cursor.array()?),
            _ => return Err(FormatError::value("version", version, "1.00 or 1.01")),
        };
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        blocks.push((number, cursor.take(length)?));
    }
    Ok(blocks)
}

/// Zygo MetroPro format, with a header of 834 or 4096 bytes, intensities, and phases as `i32`.
///
/// All numbers are big-endian. The sides are nodes × lateral resolution, in metres; they are
/// unknown if the resolution is zero. A height is phase × S W O / R (MetroPro Reference Guide).
/// Here S is the scale factor of the interferometer, W the wavelength, O the obliquity factor and R
/// the number of phase steps per wavelength. Lines run along x; the first line has y = 0. Phases of
/// at least 2147483640 mark missing points.
///
/// Files in the tests of SurfaceTopography 1.27.1 and surfalize 0.19.2 show this.
pub(crate) const METROPRO: Format = Format::new("metropro", "Zygo MetroPro", read_metropro);

fn read_metropro(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let header = match bytes.get(..4) {
        Some(b"\x88\x1b\x03\x6f" | b"\x88\x1b\x03\x70") => 834,
        Some(b"\x88\x1b\x03\x71") => 4096,
        _ => return Err(FormatError::Signature),
    };
    let at = |offset| Cursor::at(bytes, offset).ordered(ByteOrder::Big);
    let intensities = at(60).u32()? as usize;
    let nodes = checked_nodes([at(68).u16()?, at(70).u16()?])?;
    let steps = phase_steps(at(218).i16()?.into())?;
    let sign = if at(232).i16()? == 0 { 1.0 } else { -1.0 };
    let interferometer = factor("scale factor of the interferometer", at(164).single()?)?;
    let wavelength = factor("wavelength", at(168).single()?)?;
    let obliquity = factor("obliquity factor", at(176).single()?)?;
    let step = at(184).single()?;
    let sides = nodes.map(|count| count as f64 * step);
    let size = Sides::given((step != 0.0).then_some(sides), &Unit::Length(1.0))?;
    let stored = at(header + intensities).rest();
    let raster = Raster::rows(nodes, Element::I32, ByteOrder::Big, stored)?
        .missing(NO_PHASE)
        .scaled(sign * interferometer * obliquity * wavelength / steps, 0.0);
    Ok(vec![Channel::new("heights", Unit::parse("m"), size, raster)])
}

/// Phases from this on mark missing points.
pub(crate) const NO_PHASE: Missing = Missing::From(2147483640.0);

/// Returns the number of phase steps per wavelength, of which MetroPro stores a code.
pub(crate) fn phase_steps(code: f64) -> Result<f64, FormatError> {
    let steps = [(0.0, 4096.0), (1.0, 32768.0), (2.0, 131072.0)];
    meaning("phase resolution", code, "0, 1 or 2", &steps)
}

/// Wyko OPD format, a directory and blocks that each contain a map or a single number.
///
/// The sides are nodes × `Pixel_size`, along y also × `Aspect`. The unit of the stored heights is
/// `Wavelength` / `Mult` in nanometres. Lines run along y; the first number of a line has the
/// largest y. Floats of at least 1e10, and two-byte integers of at least 32766, mark missing
/// points.
///
/// Three files in the tests of SurfaceTopography 1.27.1 and surfalize 0.19.2 show this.
pub(crate) const OPD: Format = Format::new("opd", "Wyko", read_opd).changed(&[NAME_FIRST]);

/// Length of an entry of the directory, in bytes.
const OPD_ENTRY: usize = 24;
// Types of blocks.
const OPD_ARRAY: i16 = 3;
const OPD_SHORT: i16 = 6;
const OPD_FLOAT: i16 = 7;
const OPD_DOUBLE: i16 = 8;
const OPD_LONG: i16 = 12;
/// Names of the blocks with heights. Arrays with other names are intensities.
pub(crate) const OPD_HEIGHTS: [&str; 5] = ["Raw", "RAW_DATA", "RAW DATA", "OPD", "SAMPLE_DATA"];

struct OpdBlock<'a> {
    name: String,
    kind: i16,
    bytes: &'a [u8],
}

fn read_opd(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    if bytes.get(2..11) != Some(b"Directory") {
        return Err(FormatError::Signature);
    }
    let blocks = opd_blocks(bytes)?;
    let number = |name: &str| {
        let block = blocks.iter().find(|block| block.name == name);
        block.and_then(OpdBlock::number)
    };
    let wavelength = number("Wavelength").ok_or_else(|| FormatError::missing("Wavelength"))?;
    let multiplier = factor("Mult", number("Mult").unwrap_or(1.0))?;
    let nanometres = factor("Wavelength", wavelength)? / multiplier;
    let is_map =
        |block: &&OpdBlock<'_>| block.kind == OPD_ARRAY && OPD_HEIGHTS.contains(&&*block.name);
    let channels = blocks.iter().filter(is_map).map(|block| {
        let raster = opd_raster(block.bytes)?.scaled(nanometres, 0.0);
        let size = opd_size(raster.nodes(), number("Pixel_size"), number("Aspect"))?;
        Ok(Channel::new(&*block.name, Unit::parse("nm"), size, raster))
    });
    at_least_one(channels, "Raw")
}

/// Returns the size of a map with these nodes, `Pixel_size` and `Aspect`.
pub(crate) fn opd_size(
    nodes: [usize; 2],
    step: Option<f64>,
    aspect: Option<f64>,
) -> Result<Sides, FormatError> {
    let [x, y] = nodes.map(|count| count as f64);
    let sides = step.map(|step| [x * step, y * step * aspect.unwrap_or(1.0)]);
    Sides::given(sides, &Unit::parse("mm"))
}

/// Reads all blocks except the first, which is the directory. The others are in the order in which
/// the directory lists them.
fn opd_blocks(bytes: &[u8]) -> Result<Vec<OpdBlock<'_>>, FormatError> {
    let mut directory = Cursor::at(bytes, 2);
    let (_, _, length) = opd_entry(&mut directory)?;
    let entries = (length / OPD_ENTRY).saturating_sub(1);
    let mut data = Cursor::at(bytes, 2);
    data.skip(length)?;
    let blocks = (0..entries).map(|_| {
        let (name, kind, length) = opd_entry(&mut directory)?;
        Ok(OpdBlock { name, kind, bytes: data.take(length)? })
    });
    blocks.collect()
}

/// Reads an entry of the directory: the name, the type and the length in bytes of a block.
fn opd_entry(cursor: &mut Cursor<'_>) -> Result<(String, i16, usize), FormatError> {
    let name = cursor.text(16)?;
    let kind = cursor.i16()?;
    let length = cursor.i32()?;
    cursor.skip(2)?;
    Ok((name, kind, usize::try_from(length).unwrap_or(0)))
}

impl OpdBlock<'_> {
    /// Returns the number in the block, or `None` if the block has another type. Some programs
    /// declare a two-byte integer as a float; it is read as an integer.
    fn number(&self) -> Option<f64> {
        let mut cursor = Cursor::new(self.bytes);
        match (self.kind, self.bytes.len()) {
            (OPD_SHORT | OPD_FLOAT, 2) => cursor.i16().ok().map(f64::from),
            (OPD_SHORT | OPD_LONG, _) => cursor.i32().ok().map(f64::from),
            (OPD_FLOAT, _) => cursor.single().ok(),
            (OPD_DOUBLE, _) => cursor.double().ok(),
            _ => None,
        }
    }
}

fn opd_raster(bytes: &[u8]) -> Result<Raster<'_>, FormatError> {
    let mut cursor = Cursor::new(bytes);
    let nodes = checked_nodes([cursor.u16()?, cursor.u16()?])?;
    let types = [
        (1, (Element::U8, Missing::None)),
        (2, (Element::I16, Missing::From(32766.0))),
        (4, (Element::F32, Missing::From(1e10))),
    ];
    let (element, missing) = meaning("bytes per number", cursor.u16()?, "1, 2 or 4", &types)?;
    let raster = Raster::columns(nodes, element, ByteOrder::Little, cursor.rest())?;
    Ok(raster.missing(missing).upside_down())
}

/// Sensofar PLU format, with a header of 500 bytes and layers of `f32` numbers.
///
/// Lengths are in micrometres; the sides are nodes × pixel size. Lines run along x; the first line
/// has y = 0. The number 1000001 marks missing points. The format has no signature: a file is
/// recognized by a date as text, a known type of measurement, and layers that fit into the file.
///
/// Files in the tests of SurfaceTopography 1.27.1 and surfalize 0.19.2 show this.
pub(crate) const PLU: Format = Format::new("plu", "Sensofar", read_plu).without_signature();

// Offsets in bytes of the calibration, the type of measurement, the number of layers, and the
// layers.
const PLU_CALIBRATION: usize = 128 + 4 + 256;
const PLU_KIND: usize = PLU_CALIBRATION + 40;
const PLU_LAYERS: usize = PLU_KIND + 20 + 40;
const PLU_DATA: usize = PLU_LAYERS + 12;

fn read_plu(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let date = Cursor::new(bytes).take(128).unwrap_or_default();
    let length = date.iter().position(|&byte| byte == 0).unwrap_or(0);
    let is_printable = |byte: &u8| (b' '..=b'~').contains(byte);
    if !(10..100).contains(&length) || !date[..length].iter().all(is_printable) {
        return Err(FormatError::Signature);
    }
    match Cursor::at(bytes, PLU_KIND).u32()? {
        3 => {}
        1 => return Err(FormatError::unsupported("the file holds a profile, not a map")),
        _ => return Err(FormatError::Signature),
    }
    let mut calibration = Cursor::at(bytes, PLU_CALIBRATION + 16);
    let steps = [calibration.single()?, calibration.single()?];
    let [layers] = Cursor::at(bytes, PLU_LAYERS + 1).array()?;
    let [images] = Cursor::at(bytes, PLU_LAYERS + 4).array()?;
    if layers == 0 {
        return Err(FormatError::value("number of layers", layers, "a positive number"));
    }
    let mut cursor = Cursor::at(bytes, PLU_DATA);
    let layers = (0..layers).map(|number| plu_layer(&mut cursor, number, images.into(), steps));
    layers.collect()
}

/// Reads a layer: its numbers of nodes, heights, extreme heights, and `images` images of three
/// bytes per node. `number` is the number of the layer in its name, and `steps` are the pixel sizes
/// in µm.
fn plu_layer<'a>(
    cursor: &mut Cursor<'a>,
    number: u8,
    images: usize,
    steps: [f64; 2],
) -> Result<Channel<'a>, FormatError> {
    let [y, x] = [cursor.u32()?, cursor.u32()?];
    let nodes = checked_nodes([x, y])?;
    let stored = cursor.take(map_bytes(nodes, Element::F32))?;
    cursor.skip(8 + 3 * images * nodes[0] * nodes[1])?;
    let raster = Raster::rows(nodes, Element::F32, ByteOrder::Little, stored)?
        .missing(Missing::Value(1000001.0));
    let micrometre = Unit::parse("µm");
    let size = Sides::of_steps(nodes, steps, &micrometre)?;
    Ok(Channel::new(format!("layer{number}"), micrometre, size, raster))
}

/// Digital Surf format, which MountainsMap and several instruments write.
///
/// A file has a header of 512 bytes, a comment, a private zone, and integers of two or four bytes.
/// A height is number × spacing + offset, both in the unit of the step of z, as in Gwyddion 2.62,
/// which writes the lowest height as the offset; MountainsMap writes numbers centred on zero with
/// the middle of the range as the offset. (rosettasciio 0.15.0 subtracts `zmin` first,
/// SurfaceTopography 1.27.1 ignores the offset.) The sides are nodes × spacing. Lines run along x;
/// the first line has y = 0 unless the header declares an inversion. The number `zmin` − 2 marks
/// missing points. In files that start with `DSCOMPRESSED`, the integers are compressed as zlib
/// streams, preceded by a list of their lengths. If a file has several objects, the first one is
/// read; the bytes after its numbers, such as photos, are not used.
///
/// Object type 1 is a profile if it has one line, whose side along y is then one step. Gwyddion
/// 2.62 writes maps with this type.
///
/// Not known: what an inversion means. Four programs treat it in three ways, and no public file
/// uses it. As in Gwyddion, it negates the heights here, and 2 and 3 mirror the map, too.
pub(crate) const SUR: Format = Format::new("sur", "Digital Surf", read_sur)
    .changed(&["heights include the offset of the file"]);

/// Types of objects that begin with a height map: a profile or a map that Gwyddion wrote, a
/// surface, a series or layers of surfaces, and a surface with its image.
const SUR_KINDS: [u16; 7] = [1, 2, 5, 8, 11, 13, 16];

fn read_sur(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let is_compressed = match bytes.get(..12) {
        Some(b"DIGITAL SURF") => false,
        Some(b"DSCOMPRESSED") => true,
        _ => return Err(FormatError::Signature),
    };
    let at = |offset| Cursor::at(bytes, offset);
    let kind = at(18).u16()?;
    if !SUR_KINDS.contains(&kind) {
        let allowed = "the type of a surface (1, 2, 5, 8, 11, 13 or 16)";
        return Err(FormatError::value("type of the object", kind, allowed));
    }
    let has_missing = at(86).u16()? == 1;
    let types = [(16, Element::I16), (32, Element::I32)];
    let element = meaning("bits per point", at(98).u16()?, "16 or 32", &types)?;
    let lowest = at(100).i32()?;
    let nodes = checked_nodes([at(108).i32()?, at(112).i32()?])?;
    let steps = [at(120).single()?, at(124).single()?];
    let scale = factor("spacing of z", at(128).single()?)?;
    let [unit_x, unit_y, unit_z] = [at(180).text(16)?, at(196).text(16)?, at(212).text(16)?];
    let inversion = at(290).u16()?;
    // The lengths of the comment and of the private zone.
    let extra = usize::from(at(334).u16()?) + usize::from(at(336).u16()?);
    let offset = finite("offset of z", at(474).single()?)?;

    let mut data = at(512 + extra);
    let stored = if is_compressed {
        Cow::Owned(sur_decompressed(&mut data, map_bytes(nodes, element))?)
    } else {
        Cow::Borrowed(data.rest())
    };
    let raster = Raster::rows(nodes, element, ByteOrder::Little, stored)?;
    // As in Gwyddion, an inversion negates the heights and may mirror the map along one axis.
    let unscaled = match inversion {
        2 => raster.mirrored(),
        3 => raster.upside_down(),
        _ => raster,
    };
    let sign = if (1..=3).contains(&inversion) { -1.0 } else { 1.0 };
    let marker = f64::from(lowest) - 2.0;
    let raster = unscaled
        .missing(if has_missing { Missing::Value(marker) } else { Missing::None })
        .scaled(sign * scale, sign * offset);
    let size = if nodes[1] == 1 {
        // Profiles give no step along y.
        Sides::new([nodes[0] as f64, 1.0].map(|count| count * steps[0]), &Unit::parse(&unit_x))?
    } else {
        let sides = [0, 1].map(|axis| nodes[axis] as f64 * steps[axis]);
        Sides::in_units(sides, [&unit_x, &unit_y])?
    };
    Ok(vec![Channel::new("heights", Unit::parse(&unit_z), size, raster)])
}

/// Decompresses all streams and concatenates their bytes, up to `needed` bytes.
fn sur_decompressed(cursor: &mut Cursor<'_>, needed: usize) -> Result<Vec<u8>, FormatError> {
    let streams = cursor.u32()?;
    let mut directory = Cursor::new(cursor.take((streams as usize).saturating_mul(8))?);
    let mut bytes = Vec::new();
    for number in 1..=streams {
        let raw = directory.u32()? as usize;
        let compressed = cursor.take(directory.u32()? as usize)?;
        // The streams may contain further objects, which are not needed.
        let expected = raw.min(needed - bytes.len());
        let part = format!("stream {number} of {streams}");
        let reader = ZlibDecoder::new(compressed);
        bytes.extend(inflate(&part, reader, compressed.len(), expected)?);
    }
    Ok(bytes)
}
