//! Nanoscope files of Digital Instruments, Veeco and Bruker, with a text header in sections and
//! maps of integers.
//!
//! Lines run along x; the first line has the largest y. A height is number × hard scale /
//! 256^(bytes per number) × soft scale. The entry `@2:Z scale` of the image gives the hard scale
//! and the name of the scanner entry with the soft scale, such as `@Sens. Zsens`. If the soft scale
//! does not lead to a length, the channel has another unit. For such channels, SurfaceTopography
//! returns the stored numbers instead. Nanoscope 4.2 and older (before 1999) write one entry
//! `Z scale: 3000 nm (65536)`: the height of that many steps.
//!
//! An image has the lines that its data length and `Valid data len Y` state. `Number of lines` and
//! the `Lines` of the scan list may be larger (a scan that was stopped) or smaller: in
//! `bruker_data_header.001` of pySPM (Nanoscope 5.15, 16:1), the scan list says 16 lines, but the
//! image has 32.
//!
//! Side along y: if `Scan Size` has two different numbers, they are the sides of the `Number of
//! lines`. Otherwise it states the side along x. With an `Aspect Ratio` other than 1:1, the pixels
//! are square (pySPM issue 22: 2:1, `Scan Size: 10 10 ~m`, 256 × 128 nodes are 10 × 5 µm). With
//! 1:1, the scan list covers a square, of which a stopped scan (`bruker_data_header.002` of pySPM,
//! Nanoscope 9.7) has a part. Pixels of a complete 1:1 scan need not be square.

use super::channel::{Channel, Sides};
use super::input::{Cursor, Entries, factor, latin1, quantity};
use super::raster::{ByteOrder, Element, Raster, checked_nodes, map_bytes};
use super::unit::{Unit, ratio};
use super::{Format, FormatError, at_least_one};

pub(crate) const FORMAT: Format =
    Format::new("nanoscope", "Nanoscope of Digital Instruments, Veeco and Bruker", read).changed(
        &["`Aspect Ratio`, stopped scans and `Valid data len` give the lines and the side along y"],
    );

/// First version of Nanoscope whose numbers may have four bytes although the header says two.
const FOUR_BYTES: i64 = 0x0920_0000;

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let starts = [&b"\\*File list"[..], b"\\*EC File list", b"?*File list"];
    if !starts.iter().any(|start| bytes.starts_with(start)) {
        return Err(FormatError::Signature);
    }
    if bytes.starts_with(b"?") {
        let what = "the numbers of this Nanoscope file are text; save it with binary numbers";
        return Err(FormatError::unsupported(what));
    }
    let sections = Section::all(bytes);
    let file = File::from_sections(&sections)?;
    let images: Vec<&Section> = sections.iter().filter(|section| section.is_image()).collect();
    let (read, errors): (Vec<_>, Vec<_>) =
        images.iter().map(|image| file.channel(bytes, image)).partition(Result::is_ok);
    // An image that is cut off, or whose entries are incomplete, does not hide the others.
    if read.is_empty() {
        return at_least_one(errors, "*Ciao image list");
    }
    let note = |error| format!("another image of the file cannot be read: {error}");
    let notes: Vec<String> = errors.into_iter().filter_map(Result::err).map(note).collect();
    Ok(read.into_iter().flatten().map(|channel| channel.noted(&notes)).collect())
}

/// Properties of a file that all its images share.
struct File<'a> {
    version: i64,
    scanner: Vec<&'a Section>,
    /// Numbers of nodes of the whole scan along x and y.
    scan: Option<[i64; 2]>,
    /// True if the scan list has an aspect ratio other than 1:1.
    is_strip: bool,
    /// Side along y and its unit, from the entry `Slow Axis Size`. If present, it replaces the side
    /// along y in the scan size of an image.
    slow_side: Option<(f64, String)>,
}

impl<'a> File<'a> {
    fn from_sections(sections: &'a [Section]) -> Result<File<'a>, FormatError> {
        let named = |names: &'static [&'static str]| {
            let of_name = move |section: &&Section| names.contains(&&*section.name);
            sections.iter().filter(of_name)
        };
        let entry = |names, key| named(names).find_map(|section| section.entries.get(key));
        let any = |key| sections.iter().rev().find_map(|section| section.entries.get(key));
        if any("operating mode") == Some("Force") || any("start context") == Some("FOL") {
            return Err(FormatError::unsupported("the file holds force curves, not a map"));
        }
        let version = entry(&["file list", "ec file list"], "version").unwrap_or("0");
        let version = i64::from_str_radix(version.trim_start_matches("0x"), 16);
        let scan_list: &[&str] = &["ciao scan list", "afm list", "stm list", "nc afm list"];
        let nodes = |key| entry(scan_list, key)?.parse().ok();
        let scanner = named(&["scanner list", "microscope list"]);
        Ok(File {
            version: version.unwrap_or(0),
            scanner: scanner.chain(named(scan_list)).collect(),
            scan: nodes("samps/line").zip(nodes("lines")).map(|(x, y)| [x, y]),
            is_strip: entry(scan_list, "aspect ratio").is_some_and(is_strip),
            slow_side: entry(scan_list, "slow axis size")
                .map(|size| quantity("slow axis size", size))
                .transpose()?,
        })
    }

    fn channel<'b>(&self, bytes: &'b [u8], image: &Section) -> Result<Channel<'b>, FormatError> {
        let bytes_per_pixel = image.entries.optional_whole("bytes/pixel")?.unwrap_or(2);
        let length = image.entries.whole("data length")?;
        let [x, y] = ["samps/line", "number of lines"].map(|key| image.entries.whole(key));
        let own = checked_nodes([x?, y?])?;
        let stated = map_bytes(image.valid_nodes(own).unwrap_or(own), Element::I32);
        let element = match bytes_per_pixel {
            2 if self.version >= FOUR_BYTES && length >= stated as i64 => Element::I32,
            2 => Element::I16,
            4 => Element::I32,
            _ => return Err(FormatError::value("Bytes/pixel", bytes_per_pixel, "2 or 4")),
        };
        let (nodes, skipped) = self.nodes(image, own, element, length)?;
        let offset = image.entries.whole("data offset")?;
        let offset = usize::try_from(offset)
            .map_err(|_| FormatError::value("Data offset", offset, "a positive number"))?;
        let start = offset.saturating_add(map_bytes([nodes[0], 1], element) * skipped);
        let stored = Cursor::at(bytes, start).take(map_bytes(nodes, element))?;
        let unscaled = Raster::rows(nodes, element, ByteOrder::Little, stored)?.upside_down();
        let (scale, unit) = self.scale(image, bytes_per_pixel)?;
        let size = self.size(image, own, nodes)?;
        let raster = unscaled.scaled(scale, 0.0);
        let channel = Channel::new(image.image_name(), Unit::of_heights(&unit), size, raster);
        let unused = (length as u64).saturating_sub(map_bytes(nodes, element) as u64);
        let note = format!("{unused} of {length} bytes of the image were not used");
        Ok(channel.noted((unused > 0).then_some(note)))
    }

    /// Returns the numbers of nodes of an image along x and y, and the number of stored lines
    /// before them.
    ///
    /// `own` are the numbers that the image gives and `length` is its length in bytes.
    fn nodes(
        &self,
        image: &Section,
        own: [usize; 2],
        element: Element,
        length: i64,
    ) -> Result<([usize; 2], usize), FormatError> {
        let length = usize::try_from(length).unwrap_or(0);
        let fits = |[x, y]: [usize; 2]| map_bytes([x, y], element) <= length;
        if let Some(valid) = image.valid_nodes(own)
            && fits(valid)
        {
            let first = image.entries.whole("valid data start y").unwrap_or(0);
            let first = usize::try_from(first).unwrap_or(0);
            let skipped = if fits([valid[0], valid[1].saturating_add(first)]) { first } else { 0 };
            return Ok((valid, skipped));
        }
        let line = map_bytes([own[0], 1], element);
        let checked = self.scan.and_then(|scan| checked_nodes(scan).ok());
        let scan = checked.filter(|scan| map_bytes(*scan, element) == length);
        let nodes = match scan {
            _ if map_bytes(own, element) == length => own,
            Some(scan) => scan,
            None if !fits(own) && length >= line => [own[0], length / line],
            None => own,
        };
        Ok((nodes, 0))
    }

    /// Returns the size of a map of `nodes` nodes; `own` are the numbers of nodes that the image
    /// gives. The module documents the rule.
    ///
    /// If the file also gives the size along the slow axis, x is the `Scan Size`, and y is the size
    /// along the slow axis, reduced if the scan was stopped early.
    fn size(
        &self,
        image: &Section,
        own: [usize; 2],
        nodes: [usize; 2],
    ) -> Result<Sides, FormatError> {
        let (x, y, unit) = image.scan_size()?;
        let is_strip = image.entries.get("aspect ratio").is_some_and(is_strip);
        // A scan that was stopped early has fewer lines than the scan list.
        let full = self.scan.map_or(nodes[1] as f64, |scan| scan[1] as f64);
        let share = (nodes[1] as f64 / full).min(1.0);
        if let Some((slow, slow_unit)) = &self.slow_side {
            let ratio = ratio(slow_unit, &unit).ok_or_else(|| {
                FormatError::value("unit of Slow Axis Size", slow_unit, "a unit of length")
            })?;
            let share = if image.has_ratio_one() { 1.0 } else { share };
            return Sides::new([x, slow * ratio * share], &Unit::parse(&unit));
        }
        let [along, lines] = [0, 1].map(|axis| nodes[axis] as f64);
        let x_side = x * along / own[0] as f64;
        let y_side = if x != y {
            // Of a stopped scan, the sides may be those of all lines: then the pixels are square.
            let aspect = |of: f64| y / of * along / x_side;
            let squareness = |of: f64| aspect(of).max(aspect(of).recip());
            let of = own[1] as f64;
            let of = if lines < full && squareness(full) < squareness(of) { full } else { of };
            y * lines / of
        } else if is_strip || self.is_strip {
            x_side * lines / along
        } else if nodes == own {
            y * share
        } else {
            y * lines / own[1] as f64
        };
        Sides::new([x_side, y_side], &Unit::parse(&unit))
    }

    /// Returns the factor that converts stored numbers to heights, and the unit of the heights.
    fn scale(&self, image: &Section, bytes_per_pixel: i64) -> Result<(f64, String), FormatError> {
        let scale = image.entries.get("@4:z scale").or_else(|| image.entries.get("@2:z scale"));
        let Some(scale) = scale else {
            return image.old_scale();
        };
        let scale = Scale::parse("@2:Z scale", scale)?;
        let steps = if bytes_per_pixel == 4 { 4294967296.0 } else { 65536.0 };
        let (hard, hard_unit) = quantity("@2:Z scale", &scale.value)?;
        let hard = factor("@2:Z scale", hard)? / steps;
        let soft = scale.soft.as_ref().and_then(|name| {
            let key = format!("@{}", name.to_lowercase());
            self.scanner.iter().find_map(|section| section.entries.get(&key))
        });
        let Some(soft) = soft else {
            return Ok((hard, hard_unit));
        };
        let soft = Scale::parse("soft scale", soft)?;
        let (soft, soft_unit) = quantity("soft scale", &soft.value)?;
        let soft = factor("soft scale", soft)?;
        match soft_unit.split_once('/') {
            None if soft_unit.is_empty() => Ok((hard * soft, hard_unit)),
            None => Ok((hard * soft, soft_unit)),
            Some((unit, per)) => {
                let ratio = ratio(&hard_unit, per).ok_or_else(|| {
                    let allowed = format!("a unit like that of the soft scale, `{per}`");
                    FormatError::value("unit of @2:Z scale", &hard_unit, &allowed)
                })?;
                Ok((hard * ratio * soft, unit.to_owned()))
            }
        }
    }
}

/// Section of the header. All names are in lower case.
struct Section {
    name: String,
    entries: Entries,
}

/// Parsed value of an entry, such as `V [Sens. Zsens] (0.006713867 V/LSB) 2.910461 V`.
struct Scale {
    /// Text in square brackets, which is the name of the entry with the soft scale.
    soft: Option<String>,
    /// Text after the brackets, which is a number and its unit.
    value: String,
}

impl Section {
    /// Reads all sections of a file, up to the line `\*File list end`.
    fn all(bytes: &[u8]) -> Vec<Section> {
        let mut sections: Vec<Section> = Vec::new();
        for line in bytes.split(|&byte| byte == b'\n') {
            let line = latin1(line);
            let Some(line) = line.trim().strip_prefix('\\') else {
                break;
            };
            if let Some(name) = line.strip_prefix('*') {
                let name = name.to_lowercase();
                if name == "file list end" {
                    break;
                }
                let entries = Entries::default();
                sections.push(Section { name, entries });
            } else if let (Some(section), Some((key, value))) =
                (sections.last_mut(), line.split_once(": "))
            {
                section.entries.insert(&key.to_lowercase(), value);
            }
        }
        sections
    }

    /// Returns true if the section describes a map. The names differ between program versions.
    fn is_image(&self) -> bool {
        let kind = self.name.strip_suffix("image list");
        kind.is_some_and(|kind| ["ciao ", "afm ", "stm ", "ncafm ", ""].contains(&kind))
    }

    /// Returns the numbers of nodes of the entries `Valid data len`, if the lines are complete.
    fn valid_nodes(&self, own: [usize; 2]) -> Option<[usize; 2]> {
        let valid = |axis: &str| self.entries.whole(&format!("valid data len {axis}")).ok();
        let valid = checked_nodes([valid("x")?, valid("y")?]).ok()?;
        (valid[0] == own[0]).then_some(valid)
    }

    /// Returns the name of the measured quantity, for instance `Height`.
    fn image_name(&self) -> String {
        let keys = ["@2:image data", "@3:image data", "@4:image data"];
        let entry = keys.iter().find_map(|key| self.entries.get(key));
        let scale = entry.and_then(|text| Scale::parse("image data", text).ok());
        let name = match scale {
            Some(scale) => scale.soft.unwrap_or(scale.value),
            None => self.entries.get("image data").unwrap_or("heights").to_owned(),
        };
        name.trim_matches('"').to_owned()
    }

    /// Returns the sides of the scan along x and y and their unit. Old files give only one side,
    /// because the scan is square.
    fn scan_size(&self) -> Result<(f64, f64, String), FormatError> {
        let text = self.entries.text("scan size")?;
        let (x, rest) = quantity("scan size", text)?;
        let (y, unit) = quantity("scan size", &rest).unwrap_or((x, rest));
        Ok((x, y, unit))
    }

    /// Returns true if the image has no aspect ratio, or one that starts with 1.
    fn has_ratio_one(&self) -> bool {
        let ratio = self.entries.get("aspect ratio").unwrap_or("1:1");
        let first = ratio.split(':').next().and_then(|first| first.parse().ok());
        first.is_none_or(|first: f64| first == 1.0)
    }

    /// Returns the factor that converts stored numbers to heights, and the unit of the heights, of
    /// an image of Nanoscope 4.2 or older, such as `3000 nm (65536)`.
    fn old_scale(&self) -> Result<(f64, String), FormatError> {
        let text = self.entries.text("z scale")?;
        let (range, rest) = quantity("Z scale", text)?;
        let (unit, steps) = match rest.split_once('(') {
            Some((unit, steps)) => (unit.trim(), steps.trim_end_matches(')').trim()),
            None => (rest.as_str(), "65536"),
        };
        let word = steps.split_whitespace().next().and_then(|first| first.parse::<f64>().ok());
        let number = word.ok_or_else(|| FormatError::value("Z scale", text, "3000 nm (65536)"))?;
        Ok((factor("Z scale", range)? / factor("Z scale", number)?, unit.to_owned()))
    }
}

/// Returns true for an aspect ratio such as 2:1. Stopped scans have a single number, the share of
/// the lines.
fn is_strip(ratio: &str) -> bool {
    let parts = ratio.split_once(':').map(|(x, y)| (x.trim().parse(), y.trim().parse()));
    matches!(parts, Some((Ok::<f64, _>(x), Ok::<f64, _>(y))) if x != y)
}

impl Scale {
    /// Parses the value of an entry.
    ///
    /// # Errors
    /// Returns an error if a bracket is not closed.
    fn parse(name: &str, text: &str) -> Result<Scale, FormatError> {
        let open = || FormatError::value(name, text, "a value whose brackets are closed");
        // The first letter is the type of the entry: value, scale or choice.
        let mut rest = text.trim();
        rest = rest.strip_prefix(char::is_alphabetic).unwrap_or(rest);
        let mut soft = None;
        rest = rest.trim_start();
        if let Some(inside) = rest.strip_prefix('[') {
            let (name, behind) = inside.split_once(']').ok_or_else(open)?;
            soft = Some(name.trim().to_owned()).filter(|name| !name.is_empty());
            rest = behind.trim_start();
        }
        if rest.starts_with('(') {
            // Units such as log(Arb) contain parentheses.
            let mut depth = 0;
            let end = rest.char_indices().find_map(|(index, letter)| {
                depth += i32::from(letter == '(') - i32::from(letter == ')');
                (depth == 0).then_some(index)
            });
            rest = &rest[end.ok_or_else(open)? + 1..];
        }
        let value = rest.trim().to_owned();
        Ok(Scale { soft, value })
    }
}

#[cfg(test)]
mod tests {
    use crate::{Size, TopographyFile, read};

    /// Length of the header in bytes.
    const HEADER: usize = 600;

    /// Writes a file of images of 3 × 2 points, whose numbers are 1 to 6 and 7 to 12.
    fn file(version: &str, images: &[&str]) -> Vec<u8> {
        let mut header = format!("\\*File list\n\\Version: {version}\n");
        for (index, entries) in images.iter().enumerate() {
            let offset = HEADER + 12 * index;
            header += &format!(
                "\\*Ciao image list\n\\Data offset: {offset}\n\\Data length: 12\n\\Bytes/pixel: \
                 2\n\\Samps/line: 3\n\\Number of lines: 2\n\\Scan Size: 3 2 nm\n{entries}"
            );
        }
        let mut bytes = format!("{header}\\*File list end\n").into_bytes();
        assert!(bytes.len() < HEADER);
        bytes.resize(HEADER, 0);
        let count = 6 * images.len() as i16;
        bytes.extend((1..=count).flat_map(i16::to_le_bytes));
        bytes
    }

    #[track_caller]
    fn has_one_image(file: &TopographyFile<'_>, name: &str, last: f64) {
        let [channel] = file.channels() else { panic!("{} channels", file.channels().len()) };
        assert_eq!((channel.name(), channel.unit()), (name, Some("m")));
        assert_eq!((channel.nodes(), channel.size()), ([3, 2], Size::Metres([3e-9, 2e-9])));
        // The last number has the largest x, and y = 0.
        let height = channel.map().get(2, 0).unwrap();
        assert!((height / last - 1.0).abs() < 1e-12, "{height}");
    }

    #[test]
    fn nanoscope_4_states_the_height_of_all_steps() {
        let image = "\\Image data: Height\n\\Z scale: 3000 nm (65536)\n";
        let bytes = file("0x04220200", &[image]);
        has_one_image(&read(&bytes).unwrap(), "Height", 6.0 * 3000e-9 / 65536.0);
        // Without the number of steps, there are 65536.
        let bytes = file("0x04220200", &["\\Image data: Height\n\\Z scale: 3 ~m\n"]);
        has_one_image(&read(&bytes).unwrap(), "Height", 6.0 * 3e-6 / 65536.0);
    }

    #[test]
    fn an_image_that_is_cut_off_does_not_hide_the_others() {
        let height =
            "\\@2:Image Data: S [Height] \"Height\"\n\\@2:Z scale: V (1 nm/LSB) 65536 nm\n";
        let phase = "\\@2:Image Data: S [Phase] \"Phase\"\n\\@2:Z scale: V (1 V/LSB) 65536 V\n";
        let bytes = file("0x07200000", &[height, phase]);
        assert_eq!(read(&bytes).unwrap().channels().len(), 2);
        let cut = read(&bytes[..bytes.len() - 1]).unwrap();
        has_one_image(&cut, "Height", 6e-9);
        let found = cut.channels()[0].notes();
        let note = "another image of the file cannot be read: the file is cut off: 624 bytes are \
                    needed, but it has only 623";
        assert_eq!(found, [note]);
    }
}
