//! Validation of Thrift's compact protocol, in which Parquet writes its footer and page headers.
//!
//! A [`Walk`] passes over the bytes without storing anything, and each of its steps consumes at
//! least one byte. Its time is therefore proportional to the number of bytes. This is not true of
//! the `parquet` crate (version 60). The crate skips elements of lists and maps of booleans without
//! consuming bytes. In page headers it also skips doubles and texts beyond the end of the file. A
//! list of 2³¹ elements can be declared in eight bytes and takes the crate seventeen seconds, and a
//! list may contain many such lists.
//!
//! The walk must interpret the bytes as the crate does. The crate reads known fields without
//! checking the type in the bytes. The walk therefore compares the type of every known field with
//! its [`Shape`].
//!
//! The protocol has a [specification][spec].
//!
//! [spec]: https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md

use thiserror::Error;

/// Maximum nesting depth of lists and structures, and of column groups.
///
/// The `parquet` crate skips values with at most this depth, and the stack suffices for it.
pub const MAX_DEPTH: usize = 64;

/// Reason why a footer or page header is refused. The text completes a message "invalid …: ".
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum InvalidThrift {
    #[error("a length or offset beyond the end of the data")]
    Bytes,
    #[error("a list of {0} booleans")]
    Booleans(usize),
    #[error("a list that declares {0} elements, more than the remaining bytes can hold")]
    Elements(usize),
    #[error("more than {MAX_DEPTH} levels of nesting")]
    TooDeep,
    #[error("unknown Thrift type {0}")]
    UnknownType(u8),
    #[error("a value of type {found:?}, expected {known:?}")]
    WrongType { found: Kind, known: Kind },
    #[error("an integer of more than 64 bits")]
    Number,
    #[error("a group that declares {0} columns, which the schema does not contain")]
    Columns(i64),
    #[error("column paths of more than {0} bytes in total")]
    Names(usize),
    #[error("an uncompressed size of {0} bytes, too large for the number of rows")]
    Unpacked(i64),
    #[error("a dictionary page that declares {0} values, impossible for its size")]
    Values(i64),
}

/// Type of a value according to its bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Bool,
    Byte,
    Short,
    Int,
    Long,
    Double,
    Bytes,
    List,
    Set,
    Map,
    Struct,
    Uuid,
}

impl Kind {
    /// Decodes the type code of a field or of the elements of a list.
    fn from_code(word: u8) -> Result<Kind, InvalidThrift> {
        Ok(match word {
            1 | 2 => Kind::Bool,
            3 => Kind::Byte,
            4 => Kind::Short,
            5 => Kind::Int,
            6 => Kind::Long,
            7 => Kind::Double,
            8 => Kind::Bytes,
            9 => Kind::List,
            10 => Kind::Set,
            11 => Kind::Map,
            12 => Kind::Struct,
            13 => Kind::Uuid,
            _ => return Err(InvalidThrift::UnknownType(word)),
        })
    }
}

/// Expected structure of a value that the `parquet` crate reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// The crate skips the value according to the type in the bytes.
    Unknown,
    Plain(Kind),
    List(&'static Shape),
    /// A structure whose fields have the numbers 1, 2, 3, …
    Struct(&'static [Shape]),
}

impl Shape {
    /// Checks that a value of the type `found` can have this shape.
    fn check(self, found: Kind) -> Result<(), InvalidThrift> {
        let known = match self {
            Shape::Unknown => return Ok(()),
            Shape::Plain(kind) => kind,
            Shape::List(_) => Kind::List,
            Shape::Struct(_) => Kind::Struct,
        };
        if found == known { Ok(()) } else { Err(InvalidThrift::WrongType { found, known }) }
    }
}

/// Cursor over bytes in Thrift's compact protocol. It validates values and skips them without
/// storing them.
#[derive(Debug, Clone)]
pub struct Walk<'a> {
    bytes: &'a [u8],
    position: usize,
    depth: usize,
}

impl<'a> Walk<'a> {
    pub fn new(bytes: &'a [u8]) -> Walk<'a> {
        Walk { bytes, position: 0, depth: 0 }
    }

    /// Returns the number of bytes consumed.
    pub fn position(&self) -> usize {
        self.position
    }

    /// Consumes a structure. `known` has the shapes of the fields 1, 2, 3, … Calls `visit` with the
    /// number, type and shape of each field; `visit` must consume the value of the field.
    pub fn fields(
        &mut self,
        known: &'static [Shape],
        mut visit: impl FnMut(&mut Self, i16, Kind, Shape) -> Result<(), InvalidThrift>,
    ) -> Result<(), InvalidThrift> {
        self.nested(|walk| {
            let mut last: i16 = 0;
            while let Some((kind, field)) = walk.field(last)? {
                let index = usize::try_from(field).ok().and_then(|field| field.checked_sub(1));
                let shape =
                    index.and_then(|index| known.get(index)).copied().unwrap_or(Shape::Unknown);
                shape.check(kind)?;
                visit(walk, field, kind, shape)?;
                last = field;
            }
            Ok(())
        })
    }

    /// Consumes a list whose elements have the shape `known`. Calls `visit` with the type of each
    /// element; `visit` must consume the element.
    pub fn elements(
        &mut self,
        known: Shape,
        mut visit: impl FnMut(&mut Self, Kind) -> Result<(), InvalidThrift>,
    ) -> Result<(), InvalidThrift> {
        let (size, kind) = self.list()?;
        if size > 0 {
            known.check(kind)?;
        }
        self.nested(|walk| (0..size).try_for_each(|_| visit(walk, kind)))
    }

    /// Consumes a value of the given type and shape.
    pub fn skip(&mut self, kind: Kind, shape: Shape) -> Result<(), InvalidThrift> {
        match kind {
            // The type of a boolean field includes its value.
            Kind::Bool => Ok(()),
            Kind::Byte => self.take(1).map(drop),
            Kind::Short | Kind::Int | Kind::Long => self.varint().map(drop),
            Kind::Double => self.take(8).map(drop),
            Kind::Uuid => self.take(16).map(drop),
            Kind::Bytes => self.bytes().map(drop),
            Kind::List | Kind::Set => {
                let element =
                    if let Shape::List(element) = shape { *element } else { Shape::Unknown };
                self.elements(element, |walk, kind| walk.skip(kind, element))
            }
            Kind::Map => self.map(),
            Kind::Struct => {
                let known = if let Shape::Struct(known) = shape { known } else { &[] };
                self.fields(known, |walk, _, kind, shape| walk.skip(kind, shape))
            }
        }
    }

    /// Reads an integer in zigzag encoding.
    pub fn number(&mut self) -> Result<i64, InvalidThrift> {
        let value = self.varint()?;
        Ok((value >> 1).cast_signed() ^ -((value & 1).cast_signed()))
    }

    /// Reads a byte string, which is preceded by its length.
    pub fn bytes(&mut self) -> Result<&'a [u8], InvalidThrift> {
        let length = usize::try_from(self.varint()?).map_err(|_| InvalidThrift::Bytes)?;
        self.take(length)
    }

    fn map(&mut self) -> Result<(), InvalidThrift> {
        let size = usize::try_from(self.varint()?).map_err(|_| InvalidThrift::Number)?;
        if size == 0 {
            return Ok(());
        }
        let kinds = self.take(1)?[0];
        let [key, value] = [Kind::from_code(kinds >> 4)?, Kind::from_code(kinds & 0xf)?];
        self.bounded(size, key)?;
        self.bounded(size, value)?;
        self.nested(|walk| {
            (0..size).try_for_each(|_| {
                walk.skip(key, Shape::Unknown)?;
                walk.skip(value, Shape::Unknown)
            })
        })
    }

    /// Reads the header of a list or set, and returns the number and the type of its elements.
    fn list(&mut self) -> Result<(usize, Kind), InvalidThrift> {
        let header = self.take(1)?[0];
        if header == 0 {
            // Some programs write an empty list as a single zero byte.
            return Ok((0, Kind::Byte));
        }
        let kind = Kind::from_code(header & 0xf)?;
        let size = match header >> 4 {
            15 => usize::try_from(self.varint()?).map_err(|_| InvalidThrift::Number)?,
            size => usize::from(size),
        };
        self.bounded(size, kind)?;
        Ok((size, kind))
    }

    /// Checks that a list or set of `size` elements is possible: each element needs at least one
    /// byte. Lists of booleans are refused, because the `parquet` crate consumes no bytes for them.
    fn bounded(&self, size: usize, kind: Kind) -> Result<(), InvalidThrift> {
        match kind {
            Kind::Bool if size > 0 => Err(InvalidThrift::Booleans(size)),
            _ if size > self.bytes.len() - self.position => Err(InvalidThrift::Elements(size)),
            _ => Ok(()),
        }
    }

    /// Reads the type and the number of the next field of a structure, or returns `None` at its
    /// end. `last` is the number of the previous field, 0 for the first one.
    fn field(&mut self, last: i16) -> Result<Option<(Kind, i16)>, InvalidThrift> {
        let header = self.take(1)?[0];
        if header & 0xf == 0 {
            return Ok(None);
        }
        let kind = Kind::from_code(header & 0xf)?;
        let number = match header >> 4 {
            #[expect(clippy::cast_possible_truncation, reason = "the parquet crate truncates too")]
            0 => self.number()? as i16,
            step => last.checked_add(step.into()).ok_or(InvalidThrift::Number)?,
        };
        Ok(Some((kind, number)))
    }

    fn varint(&mut self) -> Result<u64, InvalidThrift> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.take(1)?[0];
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(InvalidThrift::Number)
    }

    fn take(&mut self, length: usize) -> Result<&'a [u8], InvalidThrift> {
        let rest = &self.bytes[self.position..];
        let taken = rest.get(..length).ok_or(InvalidThrift::Bytes)?;
        self.position += length;
        Ok(taken)
    }

    fn nested(
        &mut self,
        inner: impl FnOnce(&mut Self) -> Result<(), InvalidThrift>,
    ) -> Result<(), InvalidThrift> {
        if self.depth == MAX_DEPTH {
            return Err(InvalidThrift::TooDeep);
        }
        self.depth += 1;
        inner(self)?;
        self.depth -= 1;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const KNOWN: Shape = Shape::Struct(&[
        Shape::Plain(Kind::Int),
        Shape::List(&Shape::Struct(&[Shape::Plain(Kind::Bytes)])),
    ]);

    fn passed(bytes: &[u8]) -> Result<usize, InvalidThrift> {
        let mut walk = Walk::new(bytes);
        walk.skip(Kind::Struct, KNOWN)?;
        Ok(walk.position())
    }

    #[test]
    fn a_structure_is_consumed_exactly_to_its_end() {
        // 1: 300; 2: [{1: "ab"}, {}]; 9, unknown: 1.5; the end; more.
        let bytes = [
            0x15, 0xd8, 0x04, 0x19, 0x2c, 0x18, 2, b'a', b'b', 0, 0, 0x77, 0, 0, 0, 0, 0, 0, 0xf8,
            0x3f, 0, 0xff,
        ];
        assert_eq!(passed(&bytes), Ok(bytes.len() - 1));
        for length in 0..bytes.len() - 1 {
            assert!(passed(&bytes[..length]).is_err(), "{length}");
        }
    }

    #[test]
    fn integers_are_zigzag_varints() {
        let number = |bytes: &[u8]| Walk::new(bytes).number();
        assert_eq!(number(&[0x01]), Ok(-1));
        assert_eq!(number(&[0xd8, 0x04]), Ok(300));
        let least = [&[0xff; 9][..], &[0x01]].concat();
        assert_eq!(number(&least), Ok(i64::MIN));
        assert_eq!(number(&[0xff; 11]), Err(InvalidThrift::Number));
    }

    /// 2³¹ − 1 as the encoded size of a list.
    const MANY: [u8; 5] = [0xff, 0xff, 0xff, 0xff, 0x07];
    const SIZE: usize = 0x7fff_ffff;

    #[test]
    fn lists_longer_than_their_bytes_are_refused() {
        let list = |header: u8| [&[0x39, header][..], &MANY, &[0, 0]].concat();
        // The unknown field 3 with booleans, of both types, and with structures.
        assert_eq!(passed(&list(0xf1)), Err(InvalidThrift::Booleans(SIZE)));
        assert_eq!(passed(&list(0xf2)), Err(InvalidThrift::Booleans(SIZE)));
        assert_eq!(passed(&list(0xfc)), Err(InvalidThrift::Elements(SIZE)));
        // Even short lists are refused: the `parquet` crate would misread the bytes after them.
        assert_eq!(passed(&[0x39, 0x21, 1, 1, 0]), Err(InvalidThrift::Booleans(2)));
        assert_eq!(passed(&[0x39, 0x01, 0]), Ok(3));
        let map = [&[0x3b][..], &MANY, &[0x12, 0]].concat();
        assert_eq!(passed(&map), Err(InvalidThrift::Booleans(SIZE)));
    }

    #[test]
    fn a_known_field_of_another_type_is_refused() {
        let refused = InvalidThrift::WrongType { found: Kind::Bytes, known: Kind::Int };
        assert_eq!(passed(&[0x18, 1, b'a', 0]), Err(refused));
        let refused = InvalidThrift::WrongType { found: Kind::Int, known: Kind::Struct };
        assert_eq!(passed(&[0x29, 0x15, 0, 0]), Err(refused));
    }

    #[test]
    fn deeply_nested_structures_are_refused() {
        // Field 3 of each structure is the next structure.
        let nested = |levels: usize| [vec![0x3c; levels], vec![0; levels + 1]].concat();
        assert_eq!(passed(&nested(63)), Ok(127));
        assert_eq!(passed(&nested(64)), Err(InvalidThrift::TooDeep));
        assert_eq!(passed(&nested(1 << 20)), Err(InvalidThrift::TooDeep));
    }
}
