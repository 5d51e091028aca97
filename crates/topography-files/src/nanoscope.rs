//! Nanoscope files of Digital Instruments, Veeco and Bruker, with a text header in sections and
//! maps of integers.
//!
//! The file gives the sides of the scan. Lines run along x; the first line has the largest y. A
//! height is number × hard scale / 256^(bytes per number) × soft scale. The entry `@2:Z scale` of
//! the image gives the hard scale and the name of the scanner entry with the soft scale, such as
//! `@Sens. Zsens`. If the soft scale does not lead to a length, the channel has another unit. For
//! such channels, SurfaceTopography returns the stored numbers instead.

use super::channel::{Channel, Size};
use super::input::{Cursor, Entries, factor, latin1};
use super::raster::{ByteOrder, Element, Raster, checked_nodes, map_bytes};
use super::unit::{Unit, ratio};
use super::{Format, FormatError, at_least_one};

pub const FORMAT: Format = Format {
    name: "nanoscope",
    title: "Nanoscope of Digital Instruments, Veeco and Bruker",
    version: 1,
    has_signature: true,
    read,
};

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
    let images = sections.iter().filter(|section| section.is_image());
    let channels = images.map(|image| file.channel(bytes, image));
    at_least_one(channels, "*Ciao image list")
}

/// Properties of a file that all its images share.
struct File<'a> {
    version: i64,
    scanner: Vec<&'a Section>,
    /// Numbers of nodes of the whole scan along x and y.
    scan: Option<[i64; 2]>,
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
            slow_side: entry(scan_list, "slow axis size")
                .map(|size| quantity("slow axis size", size))
                .transpose()?,
        })
    }

    fn channel<'b>(&self, bytes: &'b [u8], image: &Section) -> Result<Channel<'b>, FormatError> {
        let bytes_per_pixel = match image.entries.get("bytes/pixel") {
            None => 2,
            Some(_) => image.entries.whole("bytes/pixel")?,
        };
        let length = image.entries.whole("data length")?;
        let own = checked_nodes([
            image.entries.whole("samps/line")?,
            image.entries.whole("number of lines")?,
        ])?;
        let element = match bytes_per_pixel {
            2 if self.version >= FOUR_BYTES && length as usize >= 4 * own[0] * own[1] => {
                Element::I32
            }
            2 => Element::I16,
            4 => Element::I32,
            _ => return Err(FormatError::value("Bytes/pixel", bytes_per_pixel, "2 or 4")),
        };
        let nodes = self.nodes(own, element, length)?;
        let offset = image.entries.whole("data offset")?;
        let offset = usize::try_from(offset)
            .map_err(|_| FormatError::value("Data offset", offset, "a positive number"))?;
        let stored = Cursor::at(bytes, offset).take(map_bytes(nodes, element))?;
        let raster = Raster::rows(nodes, element, ByteOrder::Little, stored)?.upside_down();
        let (scale, unit) = self.scale(image, bytes_per_pixel)?;
        let unit = match Unit::parse(&unit) {
            // Heights always have a unit in this format.
            Unit::None => Unit::Other("1".to_owned()),
            unit => unit,
        };
        let size = self.size(image, own, nodes)?;
        let raster = raster.scaled(scale, 0.0);
        Ok(Channel::new(image.image_name(), unit, size, raster))
    }

    /// Returns the numbers of nodes of an image along x and y: the numbers `own` that the image
    /// gives, or the numbers of the whole scan. The numbers of the scan are used if they fit the
    /// `length` of the data in bytes and `own` does not.
    fn nodes(
        &self,
        own: [usize; 2],
        element: Element,
        length: i64,
    ) -> Result<[usize; 2], FormatError> {
        let length = usize::try_from(length).unwrap_or(0);
        let needed = map_bytes(own, element);
        let Some(scan) = self.scan.filter(|_| length != needed) else {
            return Ok(own);
        };
        let scan = checked_nodes(scan)?;
        let of_scan = map_bytes(scan, element);
        if length == of_scan || (needed > length && length >= of_scan) { Ok(scan) } else { Ok(own) }
    }

    /// Returns the size of a map of `nodes` nodes.
    ///
    /// The entry `Scan Size` of the image is the size of a map of `own` nodes and is scaled to
    /// `nodes`. If the file also gives the size along the slow axis, x is the `Scan Size`, and y is
    /// the size along the slow axis, reduced if the scan was stopped early.
    fn size(
        &self,
        image: &Section,
        own: [usize; 2],
        nodes: [usize; 2],
    ) -> Result<Size, FormatError> {
        let (x, y, unit) = image.scan_size()?;
        if let Some((slow, slow_unit)) = &self.slow_side {
            let ratio = ratio(slow_unit, &unit).ok_or_else(|| {
                FormatError::value("unit of Slow Axis Size", slow_unit, "a unit of length")
            })?;
            // A scan that was stopped early has fewer lines than the slow axis size covers.
            let full = self.scan.map_or(nodes[1] as f64, |scan| scan[1] as f64);
            let share = if image.is_square() { 1.0 } else { (nodes[1] as f64 / full).min(1.0) };
            return Size::new([x, slow * ratio * share], &Unit::parse(&unit));
        }
        let grown = [0, 1].map(|axis| nodes[axis] as f64 / own[axis] as f64);
        Size::new([x * grown[0], y * grown[1]], &Unit::parse(&unit))
    }

    /// Returns the factor that converts stored numbers to heights, and the unit of the heights.
    fn scale(&self, image: &Section, bytes_per_pixel: i64) -> Result<(f64, String), FormatError> {
        let scale = image.entries.get("@4:z scale").or_else(|| image.entries.get("@2:z scale"));
        let scale = scale.ok_or_else(|| {
            FormatError::unsupported("Nanoscope 4.2 or older (no `@2:Z scale`) is not supported")
        })?;
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
        let names = [
            "ciao image list",
            "afm image list",
            "stm image list",
            "ncafm image list",
            "image list",
        ];
        names.contains(&&*self.name)
    }

    /// Returns the name of the measured quantity, for instance `Height`.
    fn image_name(&self) -> String {
        let keys = ["@2:image data", "@3:image data", "@4:image data"];
        let scale = keys.iter().find_map(|key| self.entries.get(key));
        let scale = scale.and_then(|text| Scale::parse("image data", text).ok());
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

    /// Returns true if the nodes have equal distances along x and y.
    fn is_square(&self) -> bool {
        let ratio = self.entries.get("aspect ratio").unwrap_or("1:1");
        let first = ratio.split(':').next().and_then(|first| first.parse().ok());
        first.is_none_or(|first: f64| first == 1.0)
    }
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

/// Parses a number and its unit, such as `2.910461 V`.
fn quantity(name: &str, text: &str) -> Result<(f64, String), FormatError> {
    let text = text.trim();
    let (number, unit) = text.split_once(' ').unwrap_or((text, ""));
    let number = number.parse();
    let number = number.map_err(|_| FormatError::value(name, text, "a number and its unit"))?;
    Ok((number, unit.trim().to_owned()))
}
