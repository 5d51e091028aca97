//! Formats with a text header of named values, followed by numbers: AL3D, BCR-STM, simple fields
//! and XYZ fields of Gwyddion, and Molecular Imaging. The constant of each format documents its
//! line order and sides.

use encoding_rs::{Encoding, UTF_16BE, UTF_16LE, WINDOWS_1252};

use super::channel::{Channel, NAME_FIRST, Sides, Size};
use super::grid::Grid;
use super::input::{Cursor, Entries, after, decode_text, factor, meaning};
use super::raster::{ByteOrder, Element, Missing, Raster, checked_nodes, map_bytes};
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

/// AL3D format of Alicona, with header lines of 52 bytes and `f32` numbers at `DepthImageOffset`.
///
/// A header line has a name of 20 bytes, a value of 30 bytes and a line end. Lengths are in metres;
/// the sides are nodes × pixel size. Lines of numbers run along x and are padded to a multiple of 8
/// bytes; the first line has y = 0. `InvalidPixelValue` marks missing points.
///
/// `al3d-1.al3d` in the tests of SurfaceTopography 1.27.1 shows this, and files of surfalize
/// 0.19.2.
pub(crate) const AL3D: Format = Format::new("al3d", "Alicona Imaging", read_al3d);

fn read_al3d(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let magic = b"AliconaImaging\0\r\n";
    after(bytes, magic)?;
    let mut cursor = Cursor::at(bytes, magic.len());
    let mut entries = Entries::default();
    let mut line = |entries: &mut Entries| -> Result<(), FormatError> {
        entries.insert(&cursor.text(20)?, &cursor.text(30)?);
        cursor.skip(2)
    };
    // `Version`, then `TagCount`, which is the number of header lines that follow.
    line(&mut entries)?;
    line(&mut entries)?;
    for _ in 0..entries.whole("TagCount")? {
        line(&mut entries)?;
    }
    let nodes = checked_nodes([entries.whole("Cols")?, entries.whole("Rows")?])?;
    let offset = match usize::try_from(entries.whole("DepthImageOffset")?) {
        Ok(offset) if offset > 0 => offset,
        _ => {
            let what = "the file has no depth image (`DepthImageOffset`), only a picture";
            return Err(FormatError::unsupported(what));
        }
    };
    let stored = Cursor::at(bytes, offset).rest();
    let stride = (4 * nodes[0]).next_multiple_of(8);
    let unscaled = Raster::padded_rows(nodes, Element::F32, ByteOrder::Little, stride, stored)?;
    let marker = entries.optional_number("InvalidPixelValue")?;
    let steps = [entries.number("PixelSizeXMeter")?, entries.number("PixelSizeYMeter")?];
    let size = Sides::of_steps(nodes, steps, &Unit::Length(1.0))?;
    let raster = unscaled.missing(marker.map_or(Missing::None, Missing::Around));
    Ok(vec![Channel::new("heights", Unit::parse("m"), size, raster)])
}

/// BCR-STM and BCRF formats, an exchange format of scanning probe microscopes.
///
/// The text header has `headersize` (default 2048) characters of one or two bytes. Integers or
/// floats follow. The header gives the sides of the map. Lines run along x; the first line has
/// y = 0. Heights are in `zunit`; integers are multiplied by `bit2nm`. The integer 32767 and floats
/// of at least 1.7e38 mark missing points.
///
/// Two things are not known. A public BCRF file of MountainsMap fits sides of n and of n − 1 steps;
/// n are taken. Programs may add `zmin` to the integers of BCR-STM; it is not added here.
pub(crate) const BCR: Format = Format::new("bcrf", "BCR-STM", read_bcr)
    .changed(&["1.7e38 marks a missing point also in single precision"]);

/// Default length of the header, in characters.
const BCR_LETTERS: i64 = 2048;
const BCR_MAGIC: &str = "fileformat = bcr";

/// Encodings of the header with their bytes per character.
const BCR_ENCODINGS: [(&Encoding, usize); 3] = [(WINDOWS_1252, 1), (UTF_16LE, 2), (UTF_16BE, 2)];

fn read_bcr(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    // The first `count` characters of the file, or all if it has fewer.
    let letters = |(encoding, size): (&'static Encoding, usize), count: usize| {
        let end = bytes.len().min(count.saturating_mul(size));
        encoding.decode_without_bom_handling(&bytes[..end]).0
    };
    let starts = |encoding: &(&'static Encoding, usize)| {
        let start = letters(*encoding, BCR_MAGIC.len() + 1);
        start.trim_start_matches('\u{feff}').starts_with(BCR_MAGIC)
    };
    let encoding = BCR_ENCODINGS.into_iter().find(starts).ok_or(FormatError::Signature)?;
    let first = bcr_entries(&letters(encoding, BCR_LETTERS as usize));
    let stated = first.optional_whole("headersize")?.unwrap_or(BCR_LETTERS);
    let known = usize::try_from(stated).ok().filter(|size| *size <= bytes.len());
    let wrong = || FormatError::value("headersize", stated, "a position in the file");
    let count = known.ok_or_else(wrong)?;
    let header = bcr_entries(&letters(encoding, count));
    let stored = Cursor::at(bytes, count * encoding.1).rest();
    Ok(vec![bcr_channel(&header, stored)?])
}

fn bcr_channel<'a>(header: &Entries, stored: &'a [u8]) -> Result<Channel<'a>, FormatError> {
    let nodes = checked_nodes([header.whole("xpixels")?, header.whole("ypixels")?])?;
    let order = ByteOrder::new(header.get("intelmode") == Some("0"));
    let (element, missing, scale) = match header.text("fileformat")? {
        "bcrstm" | "bcrstm_unicode" => {
            let scale = header.optional_number("bit2nm")?.unwrap_or(1.0);
            (Element::I16, Missing::Value(32767.0), factor("bit2nm", scale)?)
        }
        "bcrf" | "bcrf_unicode" => (Element::F32, Missing::From(1.7e38_f32.into()), 1.0),
        other => return Err(FormatError::value("fileformat", other, "bcrstm or bcrf")),
    };
    let unit = |name| header.get(name).unwrap_or("nm");
    let sides = [header.number("xlength")?, header.number("ylength")?];
    let size = Sides::in_units(sides, ["xunit", "yunit"].map(unit))?;
    let raster = Raster::rows(nodes, element, order, stored)?.missing(missing).scaled(scale, 0.0);
    Ok(Channel::new("heights", Unit::parse(unit("zunit")), size, raster))
}

/// Parses lines `name = value` and ignores comments.
fn bcr_entries(text: &str) -> Entries {
    let lines = text.lines().filter(|line| !line.starts_with(['%', '#']));
    Entries::from_lines(lines.map(|line| line.trim_start_matches('\u{feff}')), '=')
}

/// Gwyddion simple field, with lines `Name = value`, zero padding to four bytes and `f32` numbers.
///
/// The header may give the sides of the map; otherwise they are unknown. Lines run along x; the
/// first line has y = 0. NaN marks missing points.
///
/// The user guide of Gwyddion 2.62, which reads and writes such files, defines the format.
pub(crate) const GSF: Format = Format::new("gsf", "Gwyddion simple field", read_gsf);

fn read_gsf(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let (entries, stored) = Entries::of_gwyddion(bytes, b"Gwyddion Simple Field 1.0\n", 4)?;
    let nodes = checked_nodes([entries.whole("XRes")?, entries.whole("YRes")?])?;
    let raster = Raster::rows(nodes, Element::F32, ByteOrder::Little, stored)?;
    let unit = |name| Unit::parse(entries.get(name).unwrap_or_default());
    let (x, y) = (entries.optional_number("XReal")?, entries.optional_number("YReal")?);
    let size = Sides::given(x.zip(y).map(<[f64; 2]>::from), &unit("XYUnits"))?;
    let title = entries.get("Title").unwrap_or("heights");
    let channel = Channel::new(title, unit("ZUnits"), size, raster);
    Ok(vec![channel])
}

/// Gwyddion XYZ field: lines `Name = value`, zero padding to eight bytes, and points of `f64`.
///
/// Each point has x, y and a number for each channel. The points must lie on a grid; the sides are
/// nodes × step, and grid points without a point in the file are missing. Channels are numbered
/// from 1; Gwyddion 2.62 numbers their titles from 0 and their units from 1.
pub(crate) const GXYZF: Format =
    Format::new("gxyzf", "Gwyddion XYZ field", read_gxyzf).changed(&["titles that count from 0"]);

const GXYZF_SIGNATURE: &[u8] = b"Gwyddion XYZ Field 1.0\n";

fn read_gxyzf(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let (entries, stored) = Entries::of_gwyddion(bytes, GXYZF_SIGNATURE, 8)?;
    let count = entries.whole("NChannels")?;
    let stated = usize::try_from(count).ok().filter(|count| (1..=1024).contains(count));
    let count = stated.ok_or_else(|| {
        FormatError::value("NChannels", entries.get("NChannels").unwrap_or_default(), "1 to 1024")
    })?;
    let point = 8 * (count + 2);
    if let Some(points) = entries.get("NPoints") {
        let found = stored.len() / point;
        if points.parse() != Ok(found) || !stored.len().is_multiple_of(point) {
            let allowed = format!("{found}, the number of points in the file");
            return Err(FormatError::value("NPoints", points, &allowed));
        }
    }
    let number = |point: &[u8], index: usize| {
        let number = point[8 * index..].first_chunk();
        f64::from_le_bytes(*number.expect("a point has all its numbers"))
    };
    let unit = |name: &str| Unit::parse(entries.get(name).unwrap_or_default());
    let numbered = |name: &str, channel: usize| {
        let from = usize::from(entries.get(&format!("{name}0")).is_none());
        format!("{name}{}", channel - 1 + from)
    };
    let channels = (1..=count).map(|channel| {
        let points = stored.chunks_exact(point);
        let triplets =
            points.flat_map(|at| [number(at, 0), number(at, 1), number(at, channel + 1)]);
        let grid = Grid::from_triplets(&triplets.collect::<Vec<f64>>())?;
        let size = Sides::new(grid.sides, &unit("XYUnits"))?;
        // `ZUnits` without a number is the unit of all channels.
        let own = numbered("ZUnits", channel);
        let z = unit(if entries.get("ZUnits").is_some() { "ZUnits" } else { &own });
        let name = entries.get(&numbered("Title", channel)).unwrap_or("heights");
        let raster = Raster::from_columns(grid.nodes, grid.heights);
        Ok(Channel::new(name, z, size, raster))
    });
    at_least_one(channels, "NChannels")
}

/// Format of Molecular Imaging and Agilent, with a text header followed by maps of integers.
///
/// Names fill 14 columns of the header, which gives the sides of the map in metres. Lines run along
/// x; the first line has the largest y. A height is number / 2^15 × `bufferRange` for
/// integers of 16 bits, and number / 2^31 × `bufferRange` for integers of 32 bits.
///
/// A file of PicoView (version 0x10c04) in the tests of SurfaceTopography 1.27.1 shows this.
pub(crate) const MI: Format =
    Format::new("mi", "Molecular Imaging", read_mi).changed(&[NAME_FIRST]);

/// Number of columns that a name fills.
const MI_NAME: usize = 14;

fn read_mi(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    after(bytes, b"fileType      ")?;
    let (header, buffers, data) = mi_header(bytes)?;
    meaning("fileType", header.text("fileType")?, "Image", &[("Image", ())])?;
    let (int_16, int_32) = ((Element::I16, 32768.0), (Element::I32, 2147483648.0));
    let types = [("BINARY", int_16), ("", int_16), ("BINARY_32", int_32)];
    let (element, range) = meaning("data", header.text("data")?, "BINARY or BINARY_32", &types)?;
    let nodes = checked_nodes([header.whole("xPixels")?, header.whole("yPixels")?])?;
    let size = Size::metres([header.number("xLength")?, header.number("yLength")?])?;
    let mut cursor = Cursor::at(bytes, data);
    let channels = buffers.iter().map(|buffer| {
        let stored = cursor.take(map_bytes(nodes, element))?;
        let unscaled = Raster::rows(nodes, element, ByteOrder::Little, stored)?;
        let raster = unscaled.upside_down().scaled(buffer.number("bufferRange")? / range, 0.0);
        let name = buffer.text("bufferLabel")?;
        let unit = Unit::parse(buffer.get("bufferUnit").unwrap_or_default());
        Ok(Channel::new(name, unit, size, raster))
    });
    at_least_one(channels, "bufferLabel")
}

/// Returns the entries that apply to the whole file, the entries of each map, and the offset of the
/// first map in bytes.
fn mi_header(bytes: &[u8]) -> Result<(Entries, Vec<Entries>, usize), FormatError> {
    let mut header = Entries::default();
    let mut buffers: Vec<Entries> = Vec::new();
    let mut offset = 0;
    for line in bytes.split_inclusive(|&byte| byte == b'\n') {
        offset += line.len();
        // A line that starts with a space continues the line above.
        if line.first() == Some(&b' ') {
            continue;
        }
        let line = decode_text(line);
        let (name, value) = line.split_at_checked(MI_NAME).unwrap_or((&line, ""));
        if name.trim() == "bufferLabel" {
            buffers.push(Entries::default());
        }
        if name.trim() == "data" {
            header.insert(name, value);
            return Ok((header, buffers, offset));
        }
        buffers.last_mut().unwrap_or(&mut header).insert(name, value);
    }
    Err(FormatError::missing("data"))
}
