//! Text files with a header of their own that the software of instruments exports: Wyko ASCII, Zygo
//! ASCII and XYZ, Keyence CSV. The constant of each format documents its line order and sides.

use super::binary_headers::{NO_PHASE, OPD_HEIGHTS, opd_size, phase_steps};
use super::channel::{Channel, Sides};
use super::input::{Entries, factor, parsed};
use super::number;
use super::raster::{Raster, checked_nodes};
use super::text::decoded;
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

/// Text export of Wyko and Vision (`.asc`): the entries and maps of an OPD file.
///
/// The line of an entry has its name, type, length and value. A map follows the line with its
/// name. The sides are nodes × `Pixel_size`, along y also × `Aspect`, in millimetres. Heights are
/// in nanometres if the second number of the first line is 1, otherwise in `Wavelength` / `Mult`
/// nanometres. As in the binary format, lines run along y, and the first number of a line has the
/// largest y. `Bad` marks missing points.
///
/// SurfaceTopography takes a line of the file as a line along x, so that its maps have x and y
/// exchanged.
///
/// The layout is that of these two readers: SurfaceTopography 1.27.1 and Gwyddion 2.62.
pub(crate) const WYKO: Format = Format::new("wyko-asc", "Wyko ASCII", read_wyko);

fn read_wyko(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let text = signed_text(bytes, |start| start.starts_with("Wyko ASCII Data File Format"))?;
    let mut lines = text.lines().enumerate();
    let flags = lines.next().map(|(_, line)| line.split_whitespace().skip(5));
    let in_nanometres = flags.and_then(|mut flags| flags.nth(1)) == Some("1");
    let mut entries = Entries::default();
    let mut maps = Vec::new();
    while let Some((_, line)) = lines.next() {
        let mut cells = line.split('\t').map(str::trim);
        let name = cells.next().unwrap_or_default();
        let kind = cells.next().unwrap_or_default();
        // The type of maps is 3.
        if kind == "3" && cells.next().is_some() {
            let nodes = checked_nodes([entries.whole("X Size")?, entries.whole("Y Size")?])?;
            let rows = lines.by_ref().take(nodes[0]);
            let words = rows.map(|(index, line)| (index + 1, line.split_whitespace()));
            let numbers = number::lines(words, nodes[1], number::parse_or_missing)?;
            if OPD_HEIGHTS.contains(&name) {
                maps.push((name.to_owned(), Raster::from_words([nodes[1], nodes[0]], numbers)?));
            }
        } else if matches!(name, "X Size" | "Y Size") {
            entries.insert(name, kind);
        } else if let Some(value) = cells.nth(1) {
            entries.insert(name, value);
        }
    }
    let scale = if in_nanometres {
        1.0
    } else {
        let multiplier = entries.optional_number("Mult")?.unwrap_or(1.0);
        factor("Wavelength", entries.number("Wavelength")?)? / factor("Mult", multiplier)?
    };
    let step = entries.optional_number("Pixel_size")?;
    let aspect = entries.optional_number("Aspect")?;
    let channels = maps.into_iter().map(|(name, turned)| {
        let raster = turned.turned().upside_down().scaled(scale, 0.0);
        let size = opd_size(raster.nodes(), step, aspect)?;
        Ok(Channel::new(name, Unit::parse("nm"), size, raster))
    });
    at_least_one(channels, "RAW_DATA")
}

/// Text exports of Zygo MetroPro and Mx: ASCII (`.asc`) and XYZ (`.xyz`).
///
/// Both have the same header, in which the fourth line gives the origin and the nodes of the map in
/// pixels, and the eighth the pixel size in metres. The sides are nodes × pixel size; they are
/// unknown if the pixel size is zero. In an XYZ file, lines with the pixel along x and y and the
/// height in micrometres follow; `No Data` marks missing points. In an ASCII file, intensities and
/// then phases follow, converted to heights as in the binary format of MetroPro. Its lines run
/// along x; the first pixel has y = 0.
///
/// The rule of the phases is that of the MetroPro Reference Guide; prysm 0.21.1 writes such files,
/// with heights divided by the square of the wavelength in micrometres.
pub(crate) const ZYGO: Format = Format::new("zygo-asc", "Zygo ASCII or XYZ", read_zygo);

fn read_zygo(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let is_zygo = |start: &str| {
        start.starts_with("Zygo ASCII Data File") || start.starts_with("Zygo XYZ Data File")
    };
    let text = signed_text(bytes, is_zygo)?;
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    // The words of quoted text do not count: no number follows a text in these lines.
    let number = |line: usize, index: usize| {
        let word = lines.get(line).and_then(|text| text.split_whitespace().nth(index));
        let number = word.and_then(|word| word.parse::<f64>().ok());
        let entry = format!("number {} in line {}", index + 1, line + 1);
        number.ok_or_else(|| FormatError::missing(entry))
    };
    let [x, y] = [number(3, 0)?, number(3, 1)?];
    let nodes = checked_nodes([number(3, 2)? as i64, number(3, 3)? as i64])?;
    let step = number(7, 6)?;
    let sides = nodes.map(|count| count as f64 * step);
    let size = Sides::given((step != 0.0).then_some(sides), &Unit::Length(1.0))?;
    // Lines with `#` separate the header, the intensities of an ASCII file, and the map.
    let mut parts = lines.split(|line| *line == "#").skip(1);
    let is_xyz = text.starts_with("Zygo XYZ");
    let part = if is_xyz { parts.next() } else { parts.nth(1) };
    let map = part.ok_or_else(|| FormatError::missing("# before the map"))?;
    let (raster, unit) = if is_xyz {
        (zygo_points(map, [x, y], nodes)?, "µm")
    } else {
        let steps = phase_steps(number(10, 0)?)?;
        let sign = if number(10, 7)? == 0.0 { 1.0 } else { -1.0 };
        let [interferometer, wavelength] = [number(7, 1)?, number(7, 2)?];
        let scale = sign * interferometer * wavelength * number(7, 4)? / steps;
        let words = map.iter().flat_map(|line| line.split_whitespace());
        let phases =
            words.map(|word| parsed("phase", word, "an integer")).collect::<Result<_, _>>();
        let scale = factor("scale of the phases", scale)?;
        let raster = Raster::from_words(nodes, phases?)?;
        (raster.missing(NO_PHASE).scaled(scale, 0.0), "m")
    };
    Ok(vec![Channel::new("heights", Unit::parse(unit), size, raster)])
}

/// Reads the map of an XYZ file from lines with a pixel and its height. `origin` is the first
/// pixel.
fn zygo_points<'a>(
    lines: &[&str],
    origin: [f64; 2],
    nodes: [usize; 2],
) -> Result<Raster<'a>, FormatError> {
    let count = nodes[0] * nodes[1];
    let listed = lines.iter().filter(|line| !line.is_empty()).count();
    if listed != count {
        let allowed = format!("{count}, one for each of {} × {} pixels", nodes[0], nodes[1]);
        return Err(FormatError::value("number of points", listed, &allowed));
    }
    let mut heights = vec![f64::NAN; count];
    for line in lines.iter().filter(|line| !line.is_empty()) {
        let wrong = || {
            let allowed = "a pixel of the map with its height or `No Data`";
            FormatError::value("point", line, allowed)
        };
        let mut words = line.split_whitespace();
        let mut pixel = |axis: usize| {
            let index = words.next()?.parse::<f64>().ok()? - origin[axis];
            (index >= 0.0 && index < nodes[axis] as f64).then_some(index as usize)
        };
        let (x, y) = pixel(0).zip(pixel(1)).ok_or_else(wrong)?;
        let word = words.next().ok_or_else(wrong)?;
        if word != "No" {
            heights[y * nodes[0] + x] = word.parse().map_err(|_| wrong())?;
        }
    }
    Ok(Raster::from_rows(nodes, heights))
}

/// Export of the Keyence MultiFileAnalyzer as CSV, with quoted cells.
///
/// The header gives the nodes, the pixel size and the unit of the heights, in English or German.
/// The sides are nodes × pixel size. Lines run along x; the first line has y = 0. Empty cells are
/// missing points.
///
/// SurfaceTopography 1.27.1, surfalize 0.19.2 and Gwyddion 2.62 do not read such files, so that no
/// other reader confirms the layout.
pub(crate) const KEYENCE: Format = Format::new("keyence-csv", "Keyence CSV", read_keyence);

// Names of the entries in English and German.
const KEYENCE_STEP: [&str; 2] = ["XY Calibration", "XY-Justierung"];
const KEYENCE_X: [&str; 2] = ["Horizontal", "Horizont."];
const KEYENCE_Y: [&str; 2] = ["Vertical", "Vertikal"];
const KEYENCE_UNIT: [&str; 2] = ["Unit", "Einheit"];
/// Maximum number of lines of the header; files have about 20.
const KEYENCE_HEADER: usize = 200;

fn read_keyence(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let is_keyence = |start: &str| {
        let has = |names: [&str; 2]| names.iter().any(|name| start.contains(&format!("{name}\"")));
        start.starts_with('"') && has(KEYENCE_STEP) && has(KEYENCE_X)
    };
    let text = signed_text(bytes, is_keyence)?;
    let mut lines = text.lines().enumerate();
    let mut entries: Vec<Vec<&str>> = Vec::new();
    let entry = |entries: &[Vec<&str>], names: [&str; 2], index: usize| {
        let entry = entries.iter().find(|cells| names.contains(&cells[0]));
        let cell = entry.and_then(|cells| cells.get(index)).copied();
        cell.map(str::to_owned).ok_or_else(|| FormatError::missing(names[0]))
    };
    // A line with a single cell, the name of the image, follows the header.
    for (_, line) in lines.by_ref().take(KEYENCE_HEADER) {
        let cells: Vec<&str> = cells(line).collect();
        let is_title = cells.len() == 1 && entry(&entries, KEYENCE_UNIT, 1).is_ok();
        if is_title {
            break;
        } else if !cells.is_empty() {
            entries.push(cells);
        }
    }
    let count =
        |names: [&str; 2]| parsed::<i64>(names[0], &entry(&entries, names, 1)?, "an integer");
    let nodes = checked_nodes([count(KEYENCE_X)?, count(KEYENCE_Y)?])?;
    let step = entry(&entries, KEYENCE_STEP, 1)?;
    let step = keyence_number(&step)
        .ok_or_else(|| FormatError::value(KEYENCE_STEP[0], &step, "a number"))?;
    let unit = Unit::parse(&entry(&entries, KEYENCE_STEP, 2)?);
    let size = Sides::new(nodes.map(|count| count as f64 * step), &unit)?;
    let rows = lines.map(|(index, line)| (index + 1, cells(line).take(nodes[0]))).take(nodes[1]);
    let raster = Raster::from_words(nodes, number::lines(rows, nodes[0], keyence_number)?)?;
    let unit = Unit::parse(&entry(&entries, KEYENCE_UNIT, 1)?);
    Ok(vec![Channel::new("Height", unit, size, raster)])
}

/// Returns the cells of a line, which are enclosed in quotes.
fn cells(line: &str) -> impl Iterator<Item = &str> {
    line.split('"').skip(1).step_by(2).map(str::trim)
}

/// Parses a number with a decimal point or comma; an empty cell is a missing point.
fn keyence_number(cell: &str) -> Option<f64> {
    if cell.is_empty() { Some(f64::NAN) } else { cell.replacen(',', ".", 1).parse().ok() }
}

/// Decodes a text if `is_format` accepts its first 4096 bytes.
fn signed_text(bytes: &[u8], is_format: impl Fn(&str) -> bool) -> Result<String, FormatError> {
    let start = decoded(&bytes[..bytes.len().min(4096)]).map_err(|_| FormatError::Signature)?;
    if is_format(&start) { decoded(bytes) } else { Err(FormatError::Signature) }
}

#[cfg(test)]
mod tests {
    use crate::tests::samples::vendors::{KEYENCE, WYKO, zygo_ascii, zygo_xyz};

    #[track_caller]
    fn refused(file: &str, from: &str, to: &str, message: &str) {
        assert!(file.contains(from), "{from}");
        let file = file.replacen(from, to, 1);
        let error = crate::read(file.as_bytes()).unwrap_err();
        let source = std::error::Error::source(&error).unwrap().to_string();
        assert_eq!(source, message);
    }

    #[test]
    fn heights_of_wyko_may_be_in_nanometres() {
        let file = WYKO.replacen("Format 0\t0", "Format 0\t1", 1).replacen("500", "700", 1);
        let file = crate::read(file.as_bytes()).unwrap();
        assert_eq!(file.channels()[0].map().get(1, 0), Some(2e-9));
        let file = WYKO.replacen("500", "1000", 1);
        let file = crate::read(file.as_bytes()).unwrap();
        assert_eq!(file.channels()[0].map().get(1, 0), Some(4e-9));
    }

    #[test]
    fn errors_of_wyko_name_the_line() {
        refused(WYKO, "Bad\t3", "Bad\t", "line 16: it has 1 numbers in place of 2");
        refused(WYKO, "Bad\t3", "Bad\tx", "line 16: `x` is not a number");
        refused(WYKO, "Bad\t3\r\n", "", "`number of heights` is 4; expected 2 × 3");
        refused(WYKO, "RAW_DATA", "Image", "`RAW_DATA` is missing");
    }

    #[test]
    fn a_zygo_file_without_pixel_size_has_no_size() {
        let file = zygo_xyz().replacen("1e-06", "0", 1);
        let file = crate::read(file.as_bytes()).unwrap();
        assert_eq!(file.channels()[0].size(), crate::Size::Unknown);
    }

    #[test]
    fn errors_of_zygo_name_the_point() {
        let xyz = zygo_xyz();
        let allowed = "expected a pixel of the map with its height or `No Data`";
        refused(&xyz, "9 6 No", "10 6 No", &format!("`point` is 10 6 No Data; {allowed}"));
        let count = "`number of points` is 5; expected 6, one for each of 3 × 2 pixels";
        refused(&xyz, "9 6 No Data\n", "", count);
        let count = "`number of heights` is 5; expected 3 × 2";
        refused(&zygo_ascii(), " 2147483640", "", count);
    }

    #[test]
    fn errors_of_keyence_name_the_entry() {
        refused(KEYENCE, "\"Vertical\",\"2\"\r\n", "", "`Vertical` is missing");
        refused(KEYENCE, "\"0.002\",", "", "line 13: it has 2 numbers in place of 3");
        let count = "`number of heights` is 6; expected 3 × 7";
        refused(KEYENCE, "\"Vertical\",\"2\"", "\"Vertical\",\"7\"", count);
    }
}
