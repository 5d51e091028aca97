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
use super::raster::{ByteOrder, Element, Missing, Raster, checked_nodes};
use super::unit::Unit;
use super::{Format, FormatError};

pub(crate) const FORMAT: Format = Format::new("sdf", "surface data file, ISO 25178-71", read)
    .changed(&[
        "the lowest number marks missing points of all types, in BCR-1.0 the highest; the first \
     profile of BCR-1.0 has the largest y",
    ]);

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
    channel(edition, nodes, scales, [compression, kind].map(i64::from), |nodes, element| {
        Raster::rows(nodes, element, ByteOrder::Little, cursor.rest())
    })
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
    let nodes = [entries.whole("numpoints")?, entries.whole("numprofiles")?];
    let scales = [scale("xscale")?, scale("yscale")?, scale("zscale")?];
    let kind = code("datatype", &TYPES.map(|(name, _)| name))?;
    channel(edition, nodes, scales, [compression, kind], |nodes, _| {
        let heights = matrix.split_ascii_whitespace().map(number::height);
        Raster::from_words(nodes, heights.collect::<Result<_, _>>()?)
    })
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

/// Returns the map of a file with these entries of its header. `stored` reads the numbers.
fn channel<'a>(
    edition: Edition,
    nodes: [i64; 2],
    [x, y, z]: [f64; 3],
    [compression, kind]: [i64; 2],
    stored: impl FnOnce([usize; 2], Element) -> Result<Raster<'a>, FormatError>,
) -> Result<Channel<'a>, FormatError> {
    meaning("Compression", compression, "0, no compression", &[(0, ())])?;
    if nodes[1] == 1 {
        let what = "the file has one profile (`NumProfiles`), not a map";
        return Err(FormatError::unsupported(what));
    }
    let known = usize::try_from(kind).ok().and_then(|kind| TYPES.get(kind));
    let (_, element) = *known.ok_or_else(|| FormatError::value("DataType", kind, "0 to 7"))?;
    let nodes = checked_nodes(nodes)?;
    let numbers = stored(nodes, element)?.missing(edition.missing(element));
    let raster = numbers.scaled(factor("Zscale", z)?, 0.0);
    let metre = Unit::Length(1.0);
    let size = Sides::of_steps(nodes, [x, y], &metre)?;
    if !edition.is_bcr() {
        return Ok(Channel::new("heights", metre, size, raster));
    }
    let missing = raster.decode().iter().filter(|height| height.is_nan()).count();
    let of_marker = format!(
        "{missing} points have the highest number of their type, or none, and count as missing, as \
         files of Zygo and MountainsMap mark them"
    );
    let of_direction = "the first profile is taken for the one with the largest y, as MountainsMap \
                        does; the format fixes no direction";
    let is_reversed = edition == Edition::Bcr1;
    let raster = if is_reversed { raster.upside_down() } else { raster };
    Ok(Channel::new("heights", metre, size, raster)
        .noted((missing > 0).then_some(of_marker))
        .noted(is_reversed.then_some(of_direction)))
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
    fn a_profile_is_named() {
        let profile = text("ISO-1.0", "7", "1 2 3");
        let profile =
            String::from_utf8(profile).unwrap().replace("NumProfiles = 2", "NumProfiles = 1");
        let error = read(profile.as_bytes()).unwrap_err();
        let source = std::error::Error::source(&error).unwrap().to_string();
        assert_eq!(source, "the file has one profile (`NumProfiles`), not a map");
    }
}
