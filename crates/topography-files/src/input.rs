//! Helpers for reading headers: a cursor over bytes, named values, decompression.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::io::Read;
use std::str::FromStr;

use encoding_rs::{GBK, SHIFT_JIS, WINDOWS_1252};

use super::raster::{ByteOrder, checked_nodes};
use super::{FormatError, number};

/// Reader of the bytes of a file from a current position. Reading beyond the end is an error.
#[derive(Debug, Clone)]
pub(crate) struct Cursor<'a> {
    bytes: &'a [u8],
    position: usize,
    order: ByteOrder,
}

/// Named values of a header. If a name is repeated, its last value counts.
#[derive(Debug, Clone, Default)]
pub(crate) struct Entries {
    values: BTreeMap<String, String>,
}

/// Maximum number of bytes to which one deflated byte can expand.
pub(crate) const MAX_INFLATION: usize = 1032;

/// Returns the number of bytes that a file with `bytes` bytes may have after decompression. Heights
/// compress by far less than a hundred times; a megabyte that becomes a gigabyte has none.
pub(crate) fn decoded_limit(bytes: usize) -> usize {
    const MAX_DENSITY: usize = 100;
    const ALWAYS_ALLOWED: usize = 512 << 20;
    let plausible = bytes.saturating_mul(MAX_DENSITY).max(ALWAYS_ALLOWED);
    bytes.saturating_mul(MAX_INFLATION).min(plausible)
}

impl<'a> Cursor<'a> {
    pub(crate) fn new(bytes: &'a [u8]) -> Cursor<'a> {
        Cursor::at(bytes, 0)
    }

    /// Creates a cursor at a position. A position beyond the end is an error only when bytes are
    /// read.
    pub(crate) fn at(bytes: &'a [u8], position: usize) -> Cursor<'a> {
        Cursor { bytes, position, order: ByteOrder::Little }
    }

    /// Sets the byte order of the numbers, which is little-endian otherwise.
    pub(crate) fn ordered(self, order: ByteOrder) -> Cursor<'a> {
        Cursor { order, ..self }
    }

    /// Returns the next `count` bytes.
    pub(crate) fn take(&mut self, count: usize) -> Result<&'a [u8], FormatError> {
        let end = self.position.saturating_add(count);
        let stored = self.bytes.get(self.position..end);
        let taken = stored.ok_or(FormatError::CutOff { needed: end, found: self.bytes.len() })?;
        self.position = end;
        Ok(taken)
    }

    pub(crate) fn skip(&mut self, count: usize) -> Result<(), FormatError> {
        self.take(count).map(|_| ())
    }

    /// Returns the next `N` bytes as an array.
    pub(crate) fn array<const N: usize>(&mut self) -> Result<[u8; N], FormatError> {
        Ok(self.take(N)?.try_into().expect("take returns N bytes"))
    }

    /// Returns the next `N` bytes in little-endian order.
    fn ordered_array<const N: usize>(&mut self) -> Result<[u8; N], FormatError> {
        let mut bytes = self.array()?;
        if self.order == ByteOrder::Big {
            bytes.reverse();
        }
        Ok(bytes)
    }

    pub(crate) fn u16(&mut self) -> Result<u16, FormatError> {
        self.ordered_array().map(u16::from_le_bytes)
    }

    pub(crate) fn i16(&mut self) -> Result<i16, FormatError> {
        self.ordered_array().map(i16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self) -> Result<u32, FormatError> {
        self.ordered_array().map(u32::from_le_bytes)
    }

    pub(crate) fn i32(&mut self) -> Result<i32, FormatError> {
        self.ordered_array().map(i32::from_le_bytes)
    }

    /// Reads an `f32` and converts it to `f64`.
    pub(crate) fn single(&mut self) -> Result<f64, FormatError> {
        self.ordered_array().map(|bytes| f32::from_le_bytes(bytes).into())
    }

    pub(crate) fn double(&mut self) -> Result<f64, FormatError> {
        self.ordered_array().map(f64::from_le_bytes)
    }

    /// Reads two integers of 32 bits and checks that they are numbers of nodes along x and y.
    pub(crate) fn nodes(&mut self) -> Result<[usize; 2], FormatError> {
        checked_nodes([self.u32()?, self.u32()?])
    }

    /// Reads `count` bytes as ISO-8859-1 text up to the first zero byte, without outer spaces.
    pub(crate) fn text(&mut self, count: usize) -> Result<String, FormatError> {
        self.take(count).map(zero_ended)
    }

    /// Returns all bytes from the current position to the end.
    pub(crate) fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.position..).unwrap_or_default()
    }
}

impl Entries {
    /// Reads lines `name = value` after the signature of a Gwyddion field, up to the zeros that
    /// fill the header to a multiple of `multiple` bytes. Returns also the bytes after them.
    pub(crate) fn of_gwyddion<'a>(
        bytes: &'a [u8],
        signature: &[u8],
        multiple: usize,
    ) -> Result<(Entries, &'a [u8]), FormatError> {
        let header = after(bytes, signature)?;
        let missing = || FormatError::missing("zeros after the header");
        let length = header.iter().position(|&byte| byte == 0).ok_or_else(missing)?;
        let entries = Entries::from_lines(decode_text(&header[..length]).lines(), '=');
        // At least one zero ends the header.
        let end = (signature.len() + length + 1).next_multiple_of(multiple);
        Ok((entries, bytes.get(end..).unwrap_or_default()))
    }

    /// Parses lines of a name and a value, separated by `between`. Ignores other lines.
    pub(crate) fn from_lines<'a>(
        lines: impl IntoIterator<Item = &'a str>,
        between: char,
    ) -> Entries {
        let mut entries = Entries::default();
        for (name, value) in lines.into_iter().filter_map(|line| line.split_once(between)) {
            entries.insert(name, value);
        }
        entries
    }

    /// Sets the value of a name, replacing an earlier value.
    pub(crate) fn insert(&mut self, name: &str, value: &str) {
        let value = value.trim().to_owned();
        self.values.insert(name.trim().to_owned(), value);
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.values.is_empty()
    }

    pub(crate) fn get(&self, name: &str) -> Option<&str> {
        self.values.get(name).map(String::as_str)
    }

    /// Returns the value of a name, or an error if the name is missing.
    pub(crate) fn text(&self, name: &str) -> Result<&str, FormatError> {
        self.get(name).ok_or_else(|| FormatError::missing(name))
    }

    pub(crate) fn whole(&self, name: &str) -> Result<i64, FormatError> {
        parsed(name, self.text(name)?, "an integer")
    }

    /// Returns the value of a name as a number, which may be infinite or NaN.
    pub(crate) fn number(&self, name: &str) -> Result<f64, FormatError> {
        parsed(name, self.text(name)?, "a number")
    }

    /// Returns the value of a name as a number and its unit.
    pub(crate) fn quantity(&self, name: &str) -> Result<(f64, String), FormatError> {
        quantity(name, self.text(name)?)
    }

    pub(crate) fn optional_whole(&self, name: &str) -> Result<Option<i64>, FormatError> {
        self.get(name).map(|_| self.whole(name)).transpose()
    }

    pub(crate) fn optional_number(&self, name: &str) -> Result<Option<f64>, FormatError> {
        self.get(name).map(|_| self.number(name)).transpose()
    }
}

/// Returns the bytes after the signature of a format, or an error if the file has another one.
pub(crate) fn after<'a>(bytes: &'a [u8], signature: &[u8]) -> Result<&'a [u8], FormatError> {
    bytes.strip_prefix(signature).ok_or(FormatError::Signature)
}

/// Returns the position of `wanted` in the bytes, or an error that it is missing.
pub(crate) fn find(bytes: &[u8], wanted: &[u8]) -> Result<usize, FormatError> {
    let position = bytes.windows(wanted.len()).position(|window| window == wanted);
    position.ok_or_else(|| FormatError::missing(latin1(wanted).trim_start()))
}

/// Parses a number of the entry `entry`, whose form `allowed` describes.
pub(crate) fn parsed<T: FromStr>(entry: &str, text: &str, allowed: &str) -> Result<T, FormatError> {
    text.parse().map_err(|_| FormatError::value(entry, text, allowed))
}

/// Parses a number with a decimal point or comma and its unit after a space, such as `600 nm`.
pub(crate) fn quantity(name: &str, text: &str) -> Result<(f64, String), FormatError> {
    let (digits, unit) = text.trim().split_once(' ').unwrap_or((text.trim(), ""));
    let parsed = number::parse(&digits.replacen(',', ".", 1));
    let number = parsed.ok_or_else(|| FormatError::value(name, text, "a number and its unit"))?;
    Ok((number, unit.trim().to_owned()))
}

/// Splits a text into lines, which end in LF, CR LF or CR.
pub(crate) fn lines(text: &str) -> impl Iterator<Item = &str> {
    text.split('\n').flat_map(|line| line.strip_suffix('\r').unwrap_or(line).split('\r'))
}

/// Decodes ISO-8859-1 text up to the first zero byte, without outer spaces.
pub(crate) fn zero_ended(bytes: &[u8]) -> String {
    latin1(bytes.split(|&byte| byte == 0).next().unwrap_or_default()).trim().to_owned()
}

/// Decodes ISO-8859-1 text, which has one byte per character.
pub(crate) fn latin1(bytes: &[u8]) -> String {
    bytes.iter().map(|&byte| char::from(byte)).collect()
}

/// Decodes text whose encoding is not known: UTF-8 if it is valid.
///
/// Otherwise, bytes from 0x80 to 0x9f, which are control characters in ISO-8859-1, are letters of
/// Shift-JIS (Japanese), GBK (Chinese) or Windows-1252. The first of these three that decodes all
/// bytes is taken. Text without such bytes is ISO-8859-1. The unit µm is understood in any of these
/// encodings, also if the guess is wrong.
pub(crate) fn decode_text(bytes: &[u8]) -> String {
    if let Ok(text) = str::from_utf8(bytes) {
        return text.to_owned();
    }
    let has_controls = bytes.iter().any(|byte| (0x80..0xa0).contains(byte));
    let encodings = [SHIFT_JIS, GBK, WINDOWS_1252].into_iter().filter(|_| has_controls);
    encodings
        .filter_map(|one| one.decode_without_bom_handling_and_without_replacement(bytes))
        .next()
        .map_or_else(|| latin1(bytes), Cow::into_owned)
}

/// Returns the meaning of a code in the header, or an error about the entry `entry`. `allowed`
/// lists the known codes in words.
pub(crate) fn meaning<C: PartialEq + ToString, T: Copy>(
    entry: &str,
    code: C,
    allowed: &str,
    meanings: &[(C, T)],
) -> Result<T, FormatError> {
    let known = meanings.iter().find(|(known, _)| *known == code);
    known.map(|(_, meaning)| *meaning).ok_or_else(|| FormatError::value(entry, code, allowed))
}

/// Returns the value, or an error about the entry `entry` if the value is not finite.
pub(crate) fn finite(entry: &str, value: f64) -> Result<f64, FormatError> {
    let is_valid = value.is_finite();
    is_valid.then_some(value).ok_or_else(|| FormatError::value(entry, value, "a finite number"))
}

/// Returns the value, or an error about the entry `entry` if the value is zero or not finite and
/// therefore cannot be a scale factor.
pub(crate) fn factor(entry: &str, value: f64) -> Result<f64, FormatError> {
    let allowed = "a finite number other than zero";
    let is_valid = value.is_finite() && value != 0.0;
    is_valid.then_some(value).ok_or_else(|| FormatError::value(entry, value, allowed))
}

/// Reads exactly `expected` bytes from a decompressing `reader`.
///
/// `compressed` is the compressed length in the file; `part` names the data in errors.
pub(crate) fn inflate(
    part: &str,
    reader: impl Read,
    compressed: usize,
    expected: usize,
) -> Result<Vec<u8>, FormatError> {
    // Do not allocate a huge size that a damaged header gives.
    if expected > compressed.saturating_mul(MAX_INFLATION) {
        let reason = format!("{compressed} bytes cannot expand to the {expected} that are needed");
        return Err(FormatError::damaged(part, reason));
    }
    let mut bytes = Vec::with_capacity(expected);
    let read = reader.take(expected as u64).read_to_end(&mut bytes);
    read.map_err(|error| FormatError::damaged(part, error))?;
    if bytes.len() == expected {
        return Ok(bytes);
    }
    let reason = format!("it has {} bytes, {expected} are needed", bytes.len());
    Err(FormatError::damaged(part, reason))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn reading_beyond_the_end_is_an_error() {
        let mut cursor = Cursor::new(&[1, 0, 0xe9]);
        assert_eq!(cursor.u16(), Ok(1));
        let beyond = FormatError::CutOff { needed: 4, found: 3 };
        assert_eq!(cursor.take(2), Err(beyond));
        assert_eq!(cursor.text(1).unwrap(), "é");
        assert!(cursor.take(usize::MAX).is_err());
        assert!(Cursor::at(&[], 7).rest().is_empty());
    }

    #[test]
    fn encodings_of_instruments_are_told_from_each_other() {
        assert_eq!(decode_text("5 µm, größe".as_bytes()), "5 µm, größe");
        assert_eq!(decode_text(b"5 \xb5m, gr\xf6\xdfe"), "5 µm, größe");
        assert_eq!(decode_text(b"\x95\x9d: 3 \x83\xcam"), "幅: 3 μm");
        assert_eq!(decode_text(b"5 \x96 10 \xb5m"), "5 – 10 µm");
    }

    #[test]
    fn text_ends_at_the_first_zero_byte() {
        assert_eq!(Cursor::new(b" mm\0\0x").text(6).unwrap(), "mm");
    }

    #[test]
    fn a_huge_expected_length_allocates_nothing() {
        let error = inflate("data", [0; 4].as_slice(), 4, usize::MAX).unwrap_err();
        assert!(error.to_string().contains("4 bytes cannot expand"), "{error}");
    }

    #[test]
    fn a_megabyte_does_not_become_a_gigabyte() {
        assert_eq!(decoded_limit(1000), 1_032_000);
        assert_eq!(decoded_limit(1 << 20), 512 << 20);
        assert_eq!(decoded_limit(100 << 20), 10_000 << 20);
    }

    #[test]
    fn too_few_bytes_are_an_error() {
        let read = |expected| inflate("data", [7; 4].as_slice(), 4, expected);
        assert_eq!(read(3), Ok(vec![7; 3]));
        assert!(read(5).is_err());
    }
}
