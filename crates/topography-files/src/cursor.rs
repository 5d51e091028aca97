//! A place in the bytes of a file.

use super::error::FormatError;

/// Reads a file from a place on; nothing is read beyond its end.
#[derive(Debug, Clone)]
pub struct Cursor<'a> {
    bytes: &'a [u8],
    position: usize,
}

impl<'a> Cursor<'a> {
    /// At the start of the bytes.
    pub fn new(bytes: &'a [u8]) -> Cursor<'a> {
        Cursor { bytes, position: 0 }
    }

    /// At a place, which may lie beyond the end until something is read.
    pub fn at(bytes: &'a [u8], position: usize) -> Cursor<'a> {
        Cursor { bytes, position }
    }

    /// The next bytes.
    pub fn take(&mut self, count: usize) -> Result<&'a [u8], FormatError> {
        let end = self.position.saturating_add(count);
        let taken = self.bytes.get(self.position..end);
        let taken = taken.ok_or(FormatError::CutOff { needed: end, found: self.bytes.len() })?;
        self.position = end;
        Ok(taken)
    }

    /// Passes over bytes.
    pub fn skip(&mut self, count: usize) -> Result<(), FormatError> {
        self.take(count).map(|_| ())
    }

    /// The next `N` bytes, for one number.
    pub fn array<const N: usize>(&mut self) -> Result<[u8; N], FormatError> {
        Ok(self.take(N)?.try_into().expect("as many as were taken"))
    }

    /// The next bytes as text that ends with the first zero.
    pub fn text(&mut self, count: usize) -> Result<String, FormatError> {
        let bytes = self.take(count)?;
        let end = bytes.iter().position(|&byte| byte == 0);
        Ok(latin1(&bytes[..end.unwrap_or(count)]).trim().to_owned())
    }

    /// What is left.
    pub fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.position..).unwrap_or_default()
    }
}

/// Text of one byte a letter, ISO-8859-1.
pub fn latin1(bytes: &[u8]) -> String {
    bytes.iter().map(|&byte| char::from(byte)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_beyond_the_end_is_not_read() {
        let mut cursor = Cursor::new(&[1, 0, 0xe9]);
        assert_eq!(u16::from_le_bytes(cursor.array().unwrap()), 1);
        let beyond = FormatError::CutOff { needed: 4, found: 3 };
        assert_eq!(cursor.take(2), Err(beyond));
        assert_eq!(cursor.text(1).unwrap(), "é");
        assert!(cursor.take(usize::MAX).is_err());
        assert!(Cursor::at(&[], 7).rest().is_empty());
    }

    #[test]
    fn text_ends_with_the_first_zero() {
        assert_eq!(Cursor::new(b" mm\0\0x").text(6).unwrap(), "mm");
    }
}
