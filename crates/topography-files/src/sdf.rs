//! Surface data files of ISO 25178-71 and of its predecessor BCR, either text or binary.
//!
//! A text file has a header of lines `name = value`, heights and a trailer, separated by `*`. A
//! binary file has a header of 81 bytes (85 in ISO-2.0), numbers of one of eight types, and a
//! trailer of text. Lengths are in metres; the sides are points × scale. Profiles run along x.
//!
//! | first line | markers of missing points | first profile | shown by |
//! |---|---|---|---|
//! | `ISO-1.0` | lowest number of the type; `BAD` in text | y = 0 | ISO 25178-71, sdfio |
//! | `ISO-2.0`, the edition of 2026 | the same | y = 0 | sdfio 2.0.0, surfalize 0.19.2 |
//! | `BCR-1.0` | highest number of the type; `BAD` in text | largest y | sdfio 2.0.0 |
//! | `BCR-0.0` | the same | y = 0 | Gwyddion 2.62 |
//!
//! BCR-1.0 is the proposal of report EUR 15178 EN (1993). That the highest number marks missing
//! points has a second witness: the reader of itom (`loadNistSDF`) says that Zygo writes it so. The
//! converters of BEV (Nmm2Bcr, 2020) write `BAD`. The direction of y is not known: sdfio follows
//! MountainsMap, the converters of BEV start at y = 0, and the report fixes none. A wrong choice
//! mirrors the map.
//!
//! ISO has no unsigned integers. In a file of ISO that has them, their highest number marks missing
//! points, as in BCR, where they come from.

use super::channel::{Channel, Sides};
use super::input::{Cursor, Entries, factor, latin1, lines, meaning};
use super::number;
use super::raster::{ByteOrder, Element, Missing, Raster, checked_nodes, map_bytes};
use super::unit::Unit;
use super::{Format, FormatError};

pub(crate) const FORMAT: Format = Format::new("sdf", "surface data file, ISO 25178-71", 2, read);

/// Edition of the format, which the first eight characters of a file name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Edition {
    Iso1,
    Iso2,
    Bcr1,
    /// Written by Gwyddion.
    Bcr0,
}

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let (start, name) = match bytes.first_chunk::<8>() {
        Some([start, name @ ..]) => (start.to_ascii_lowercase(), name),
        None => return Err(FormatError::Signature),
    };
    let edition = match name {
        b"ISO-1.0" => Edition::Iso1,
        b"ISO-2.0" => Edition::Iso2,
        b"BCR-1.0" => Edition::Bcr1,
        b"BCR-0.0" => Edition::Bcr0,
        _ => return Err(FormatError::Signature),
    };
    let channel = match start {
        b'a' => text(edition, &bytes[8..])?,
        b'b' => binary(edition, bytes)?,
        _ => return Err(FormatError::Signature),
    };
    Ok(vec![channel])
}

fn binary(edition: Edition, bytes: &[u8]) -> Result<Channel<'_>, FormatError> {
    // Signature, manufacturer, dates of creation and modification.
    let mut cursor = Cursor::at(bytes, 8 + 10 + 12 + 12);
    let nodes = match edition {
        Edition::Iso2 => [cursor.u32()?.into(), cursor.u32()?.into()],
        _ => [cursor.u16()?.into(), cursor.u16()?.into()],
    };
    let scales = [cursor.double()?, cursor.double()?, cursor.double()?];
    cursor.skip(8)?;
    let [compression, kind, _] = cursor.array()?;
    let header = Header::new(edition, nodes, scales, compression.into(), kind.into())?;
    let stored = cursor.rest();
    let raster = Raster::rows(header.nodes, header.element, ByteOrder::Little, stored)?;
    let channel = header.channel(raster)?;
    let trailer = &stored[map_bytes(header.nodes, header.element)..];
    if trailer.is_ascii() {
        Ok(channel)
    } else {
        let count = trailer.len();
        Ok(channel.noted(format!("{count} bytes after the heights are no text and are not used")))
    }
}

fn text(edition: Edition, bytes: &[u8]) -> Result<Channel<'_>, FormatError> {
    let text = latin1(bytes);
    // BCR has comments, which may contain the separator.
    let comment = if edition.is_bcr() { ';' } else { '\0' };
    let mut lines = lines(&text).map(|line| line.split(comment).next().unwrap_or_default());
    let named: Vec<&str> = lines.by_ref().take_while(|line| line.trim() != "*").collect();
    let matrix = lines.collect::<Vec<_>>().join("\n");
    let matrix = matrix.split('*').next().unwrap_or_default();
    // Names are not case-sensitive.
    let header = named.into_iter().map(|line| match line.split_once('=') {
        Some((name, value)) => format!("{}={value}", name.to_ascii_lowercase()),
        None => line.to_owned(),
    });
    let header: Vec<String> = header.collect();
    let entries = Entries::from_lines(header.iter().map(String::as_str), '=');
    let code = |name: &str, names: &[&str]| {
        let text = entries.text(name)?;
        let known = names.iter().position(|name| name.eq_ignore_ascii_case(text));
        known.map_or_else(|| entries.whole(name), |code| Ok(code as i64))
    };
    let stated = entries.get("compression").filter(|text| !text.eq_ignore_ascii_case("none"));
    let compression = stated.map_or(Ok(0), |_| code("compression", &["NULL", "RLL"]))?;
    let scale = |name| entries.number(name);
    let header = Header::new(
        edition,
        [entries.whole("numpoints")?, entries.whole("numprofiles")?],
        [scale("xscale")?, scale("yscale")?, scale("zscale")?],
        compression,
        code("datatype", &TYPES.map(|(name, _)| name))?,
    )?;
    let words = matrix.split_ascii_whitespace();
    let height = |word: &str| {
        number::parse_or_missing(word)
            .ok_or_else(|| FormatError::value("height", word, "a number or BAD"))
    };
    let heights: Vec<f64> = words.map(height).collect::<Result<_, _>>()?;
    header.channel(Raster::from_words(header.nodes, heights)?)
}

/// Types of the numbers by their codes, with their names in text files of BCR.
const TYPES: [(&str, Element); 8] = [
    ("UCHAR", Element::U8),
    ("UINTEGER", Element::U16),
    ("ULONGINT", Element::U32),
    ("FLOAT", Element::F32),
    ("CHAR", Element::I8),
    ("INTEGER", Element::I16),
    ("LONGINT", Element::I32),
    ("DOUBLE", Element::F64),
];

impl Edition {
    fn is_bcr(self) -> bool {
        matches!(self, Edition::Bcr0 | Edition::Bcr1)
    }

    /// Returns the marker of missing points among numbers of a type.
    ///
    /// Texts round the limits of floats; no height is as large as the numbers near them.
    fn missing(self, element: Element) -> Missing {
        match (element.limits(), self.is_bcr()) {
            (Some([lowest, _]), false) if lowest < 0.0 => Missing::Value(lowest),
            (Some([_, highest]), _) => Missing::Value(highest),
            (None, false) if element == Element::F32 => Missing::UpTo(-3.4e38),
            (None, false) => Missing::UpTo(-1.7e308),
            (None, true) if element == Element::F32 => Missing::From(3.4e38),
            (None, true) => Missing::From(1.7e308),
        }
    }
}

struct Header {
    edition: Edition,
    nodes: [usize; 2],
    scales: [f64; 3],
    element: Element,
}

impl Header {
    fn new(
        edition: Edition,
        nodes: [i64; 2],
        scales: [f64; 3],
        compression: i64,
        kind: i64,
    ) -> Result<Header, FormatError> {
        meaning("Compression", compression, "0, no compression", &[(0, ())])?;
        if nodes[1] == 1 {
            let what = "the file has one profile (`NumProfiles`), not a map";
            return Err(FormatError::unsupported(what));
        }
        let known = usize::try_from(kind).ok().and_then(|kind| TYPES.get(kind));
        let wrong = || FormatError::value("DataType", kind, "0 to 7");
        let (_, element) = *known.ok_or_else(wrong)?;
        Ok(Header { edition, nodes: checked_nodes(nodes)?, scales, element })
    }

    fn channel<'a>(&self, stored: Raster<'a>) -> Result<Channel<'a>, FormatError> {
        let [x, y, z] = self.scales;
        let size = Sides::of_steps(self.nodes, [x, y], &Unit::Length(1.0))?;
        let scale = factor("Zscale", z)?;
        let raster = stored.missing(self.edition.missing(self.element)).scaled(scale, 0.0);
        if !self.edition.is_bcr() {
            return Ok(Channel::new("heights", Unit::Length(1.0), size, raster));
        }
        let missing = raster.decode().iter().filter(|height| height.is_nan()).count();
        let raster = if self.edition == Edition::Bcr1 { raster.upside_down() } else { raster };
        let mut channel = Channel::new("heights", Unit::Length(1.0), size, raster);
        if missing > 0 {
            channel = channel.noted(format!(
                "{missing} points have the highest number of their type, or none, and count as \
                 missing, as files of Zygo and MountainsMap mark them"
            ));
        }
        Ok(match self.edition {
            Edition::Bcr1 => channel.noted(
                "the first profile is taken for the one with the largest y, as MountainsMap does; \
                 the format fixes no direction",
            ),
            _ => channel,
        })
    }
}

#[cfg(test)]
mod tests {
    use crate::{HeightMap, read};

    /// Writes a binary file of 3 × 2 numbers of a type, of which `numbers` are the bytes.
    fn binary(version: &str, kind: u8, numbers: &[u8]) -> Vec<u8> {
        let mut bytes = format!("b{version}{:34}", "").into_bytes();
        if version == "ISO-2.0" {
            bytes.extend([3, 0, 0, 0, 2, 0, 0, 0]);
        } else {
            bytes.extend([3, 0, 2, 0]);
        }
        for scale in [1e-6_f64, 2e-6, 1e-9, -1.0] {
            bytes.extend(scale.to_le_bytes());
        }
        bytes.extend([0, kind, 0]);
        bytes.extend(numbers);
        bytes
    }

    fn text(version: &str, kind: &str, numbers: &str) -> Vec<u8> {
        format!(
            "a{version}\r\nManufacID = x ; comment with *\r\nNUMPOINTS = 3\r\nNumProfiles = 2\r\n\
             Xscale = 1e-6\r\nYscale = 2e-6\r\nZscale = 1e-9\r\nCompression = 0\r\nDataType = \
             {kind}\r\n*\r\n{numbers}\r\n*\r\nName = Value\r\n*\r\n"
        )
        .into_bytes()
    }

    #[track_caller]
    fn map(bytes: &[u8]) -> HeightMap {
        read(bytes).unwrap().channels()[0].map()
    }

    /// Returns the bytes of the heights 1, 2, 3, 4, 5 and of a marker.
    fn numbers<const N: usize>(number: fn(i8) -> [u8; N], marker: [u8; N]) -> Vec<u8> {
        [1, 2, 3, 4, 5].map(number).into_iter().chain([marker]).flatten().collect()
    }

    /// Returns the numbers of each signed type, with the lowest or the highest as a marker.
    fn signed_types(is_highest: bool) -> [(u8, Vec<u8>); 5] {
        macro_rules! of {
            ($type:ty) => {
                numbers(
                    |number| <$type>::from(number).to_le_bytes(),
                    if is_highest { <$type>::MAX } else { <$type>::MIN }.to_le_bytes(),
                )
            };
        }
        [(3, of!(f32)), (4, of!(i8)), (5, of!(i16)), (6, of!(i32)), (7, of!(f64))]
    }

    #[test]
    fn the_lowest_number_of_every_type_is_missing_in_files_of_iso() {
        for version in ["ISO-1.0", "ISO-2.0"] {
            for (kind, numbers) in signed_types(false) {
                let map = map(&binary(version, kind, &numbers));
                assert_eq!(map.get(2, 1), None, "{version}, type {kind}");
                assert_eq!(map.get(0, 0), Some(1e-9));
                assert_eq!(map.get(1, 1), Some(5e-9));
            }
            // The highest is a height.
            let [_, (_, bytes), ..] = signed_types(true);
            assert_eq!(map(&binary(version, 4, &bytes)).get(2, 1), Some(127.0 * 1e-9));
        }
    }

    #[test]
    fn the_highest_number_of_every_type_is_missing_in_files_of_bcr() {
        let unsigned = |bytes: usize| -> Vec<u8> {
            let number = |number: u8| [&[number], vec![0; bytes - 1].as_slice()].concat();
            [1, 2, 3, 4, 5].into_iter().flat_map(number).chain(vec![255; bytes]).collect()
        };
        let unsigned = [(0, unsigned(1)), (1, unsigned(2)), (2, unsigned(4))];
        for (kind, numbers) in signed_types(true).into_iter().chain(unsigned) {
            let bytes = binary("BCR-1.0", kind, &numbers);
            let map = map(&bytes);
            // The first profile has the largest y.
            assert_eq!(map.get(2, 0), None, "type {kind}");
            assert_eq!(map.get(0, 1), Some(1e-9));
            let file = read(&bytes).unwrap();
            assert!(file.channels()[0].notes()[0].starts_with("1 points have the highest number"));
        }
        let [_, (_, bytes), ..] = signed_types(false);
        assert_eq!(map(&binary("BCR-1.0", 4, &bytes)).get(2, 0), Some(-128.0 * 1e-9));
    }

    #[test]
    fn texts_mark_missing_points_by_words_or_numbers() {
        for word in ["BAD", "nan", "-1.797693e+308"] {
            let map = map(&text("ISO-2.0", "7", &format!("1 2 3\r\n4 5 {word}")));
            assert_eq!((map.get(2, 1), map.get(1, 1)), (None, Some(5e-9)), "{word}");
        }
        for (kind, word) in [("INTEGER", "32767"), ("FLOAT", "3.400000e+38"), ("7", "BAD")] {
            let numbers = format!("1 2 3 ; * \r\n4 5 {word}");
            let map = map(&text("BCR-1.0", kind, &numbers));
            assert_eq!((map.get(2, 0), map.get(1, 0)), (None, Some(5e-9)), "{word}");
        }
    }

    #[test]
    fn a_profile_and_bytes_after_the_heights_are_named() {
        let mut bytes = binary("ISO-2.0", 4, &[1, 2, 3, 4, 5, 6]);
        bytes.extend(b"Name = Value\r\n");
        assert!(read(&bytes).unwrap().channels()[0].notes().is_empty());
        bytes.push(0xff);
        let file = read(&bytes).unwrap();
        let notes = file.channels()[0].notes();
        assert_eq!(notes, ["15 bytes after the heights are no text and are not used"]);
        let profile = text("ISO-1.0", "7", "1 2 3");
        let profile =
            String::from_utf8(profile).unwrap().replace("NumProfiles = 2", "NumProfiles = 1");
        let error = read(profile.as_bytes()).unwrap_err();
        let source = std::error::Error::source(&error).unwrap().to_string();
        assert_eq!(source, "the file has one profile (`NumProfiles`), not a map");
    }
}
