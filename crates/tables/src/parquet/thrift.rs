//! A walk over the compact protocol of Thrift, in which Parquet writes its footer and the headers of
//! its pages. The walk keeps nothing of what it passes, and each of its steps takes at least a byte.
//!
//! The `parquet` crate (version 60) has no such bound. It skips the elements of lists and maps of
//! truth values without taking a byte for each, and in the header of a page it skips doubles and
//! texts beyond the end of the file. A list of 2³¹ elements fits into eight bytes and takes the crate
//! seventeen seconds, and a list may hold many such lists.
//!
//! The walk must see the fields that the crate sees. The crate reads a field that it knows without
//! comparing the type that the bytes state; so the type of every known field is compared with its
//! [`Shape`] here.
//!
//! See the [specification](https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md).

use thiserror::Error;

/// How deep lists and structures, or groups of columns, are within each other at most: the `parquet`
/// crate skips as many, and its stack holds them.
pub const MAX_DEPTH: usize = 64;

/// Why bytes are not read any further.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum Claim {
    #[error("more bytes than it has")]
    Bytes,
    #[error("a list of {0} truth values, which Parquet has none of")]
    Booleans(usize),
    #[error("a list of {0} elements, more than it has bytes")]
    Elements(usize),
    #[error("lists and structures more than {MAX_DEPTH} deep within each other")]
    TooDeep,
    #[error("a value of type {0}, which Thrift has not")]
    UnknownType(u8),
    #[error("a value of type {found:?} where Parquet has one of type {known:?}")]
    WrongType { found: Kind, known: Kind },
    #[error("a number of more than 64 bits")]
    Number,
    #[error("a group of {0} columns, which it has not")]
    Columns(i64),
    #[error("columns whose names take more than {0} bytes with those of their groups")]
    Names(usize),
    #[error("{0} bytes once it is unpacked, for which its column has too few rows")]
    Unpacked(i64),
    #[error("a dictionary of {0} values, for which it has too few bytes")]
    Values(i64),
}

/// What the bytes say that a value is.
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
    /// The type that has this number, of a field and of elements of a list.
    fn from_code(word: u8) -> Result<Kind, Claim> {
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
            _ => return Err(Claim::UnknownType(word)),
        })
    }
}

/// What a value that the `parquet` crate reads is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// The crate skips the value by its type alone.
    Unknown,
    Plain(Kind),
    List(&'static Shape),
    /// A structure whose fields have the numbers 1, 2, 3, …
    Struct(&'static [Shape]),
}

impl Shape {
    /// Refuses another type than that of the shape.
    fn check(self, found: Kind) -> Result<(), Claim> {
        let known = match self {
            Shape::Unknown => return Ok(()),
            Shape::Plain(kind) => kind,
            Shape::List(_) => Kind::List,
            Shape::Struct(_) => Kind::Struct,
        };
        if found == known { Ok(()) } else { Err(Claim::WrongType { found, known }) }
    }
}

/// Bytes that are walked over, and the position in them.
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

    /// How many bytes it has passed.
    pub fn position(&self) -> usize {
        self.position
    }

    /// Passes a structure: `visit` passes each of its fields.
    pub fn fields(
        &mut self,
        known: &'static [Shape],
        mut visit: impl FnMut(&mut Self, i16, Kind, Shape) -> Result<(), Claim>,
    ) -> Result<(), Claim> {
        self.deeper(|walk| {
            let mut last: i16 = 0;
            while let Some((kind, field)) = walk.field(last)? {
                let index = usize::try_from(field).ok().and_then(|field| field.checked_sub(1));
                let shape = index.and_then(|index| known.get(index)).copied();
                let shape = shape.unwrap_or(Shape::Unknown);
                shape.check(kind)?;
                visit(walk, field, kind, shape)?;
                last = field;
            }
            Ok(())
        })
    }

    /// Passes a list: `visit` passes each of its elements.
    pub fn elements(
        &mut self,
        known: Shape,
        mut visit: impl FnMut(&mut Self, Kind) -> Result<(), Claim>,
    ) -> Result<(), Claim> {
        let (size, kind) = self.list()?;
        if size > 0 {
            known.check(kind)?;
        }
        self.deeper(|walk| (0..size).try_for_each(|_| visit(walk, kind)))
    }

    /// Passes a value of this type and shape.
    pub fn pass(&mut self, kind: Kind, shape: Shape) -> Result<(), Claim> {
        match kind {
            // A field of this kind is true or false by its type.
            Kind::Bool => Ok(()),
            Kind::Byte => self.take(1).map(drop),
            Kind::Short | Kind::Int | Kind::Long => self.varint().map(drop),
            Kind::Double => self.take(8).map(drop),
            Kind::Uuid => self.take(16).map(drop),
            Kind::Bytes => self.bytes().map(drop),
            Kind::List | Kind::Set => {
                let element =
                    if let Shape::List(element) = shape { *element } else { Shape::Unknown };
                self.elements(element, |walk, kind| walk.pass(kind, element))
            }
            Kind::Map => self.map(),
            Kind::Struct => {
                let known = if let Shape::Struct(known) = shape { known } else { &[] };
                self.fields(known, |walk, _, kind, shape| walk.pass(kind, shape))
            }
        }
    }

    /// A whole number.
    pub fn number(&mut self) -> Result<i64, Claim> {
        let value = self.varint()?;
        Ok((value >> 1).cast_signed() ^ -((value & 1).cast_signed()))
    }

    /// Bytes that have their number before them.
    pub fn bytes(&mut self) -> Result<&'a [u8], Claim> {
        let length = usize::try_from(self.varint()?).map_err(|_| Claim::Bytes)?;
        self.take(length)
    }

    fn map(&mut self) -> Result<(), Claim> {
        let size = usize::try_from(self.varint()?).map_err(|_| Claim::Number)?;
        if size == 0 {
            return Ok(());
        }
        let kinds = self.take(1)?[0];
        let [key, value] = [Kind::from_code(kinds >> 4)?, Kind::from_code(kinds & 0xf)?];
        self.bounded(size, key)?;
        self.bounded(size, value)?;
        self.deeper(|walk| {
            (0..size).try_for_each(|_| {
                walk.pass(key, Shape::Unknown)?;
                walk.pass(value, Shape::Unknown)
            })
        })
    }

    /// The number of elements of a list or a set, and what they are.
    fn list(&mut self) -> Result<(usize, Kind), Claim> {
        let header = self.take(1)?[0];
        if header == 0 {
            // Some write so of an empty list.
            return Ok((0, Kind::Byte));
        }
        let kind = Kind::from_code(header & 0xf)?;
        let size = match header >> 4 {
            15 => usize::try_from(self.varint()?).map_err(|_| Claim::Number)?,
            size => usize::from(size),
        };
        self.bounded(size, kind)?;
        Ok((size, kind))
    }

    /// Every element takes a byte, but the reader of Parquet gives truth values none.
    fn bounded(&self, size: usize, kind: Kind) -> Result<(), Claim> {
        match kind {
            Kind::Bool if size > 0 => Err(Claim::Booleans(size)),
            _ if size > self.bytes.len() - self.position => Err(Claim::Elements(size)),
            _ => Ok(()),
        }
    }

    /// The kind and the number of the next field; none at the end of a structure.
    fn field(&mut self, last: i16) -> Result<Option<(Kind, i16)>, Claim> {
        let header = self.take(1)?[0];
        if header & 0xf == 0 {
            return Ok(None);
        }
        let kind = Kind::from_code(header & 0xf)?;
        let number = match header >> 4 {
            #[expect(clippy::cast_possible_truncation, reason = "as the reader has it")]
            0 => self.number()? as i16,
            step => last.checked_add(step.into()).ok_or(Claim::Number)?,
        };
        Ok(Some((kind, number)))
    }

    fn varint(&mut self) -> Result<u64, Claim> {
        let mut value = 0;
        for shift in (0..64).step_by(7) {
            let byte = self.take(1)?[0];
            value |= u64::from(byte & 0x7f) << shift;
            if byte & 0x80 == 0 {
                return Ok(value);
            }
        }
        Err(Claim::Number)
    }

    fn take(&mut self, length: usize) -> Result<&'a [u8], Claim> {
        let rest = &self.bytes[self.position..];
        let taken = rest.get(..length).ok_or(Claim::Bytes)?;
        self.position += length;
        Ok(taken)
    }

    fn deeper(&mut self, pass: impl FnOnce(&mut Self) -> Result<(), Claim>) -> Result<(), Claim> {
        if self.depth == MAX_DEPTH {
            return Err(Claim::TooDeep);
        }
        self.depth += 1;
        pass(self)?;
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

    fn passed(bytes: &[u8]) -> Result<usize, Claim> {
        let mut walk = Walk::new(bytes);
        walk.pass(Kind::Struct, KNOWN)?;
        Ok(walk.position())
    }

    #[test]
    fn a_structure_is_passed_to_its_end_and_no_further() {
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
    fn numbers_are_zigzag_of_seven_bits_a_byte() {
        let number = |bytes: &[u8]| Walk::new(bytes).number();
        assert_eq!(number(&[0x01]), Ok(-1));
        assert_eq!(number(&[0xd8, 0x04]), Ok(300));
        let least = [&[0xff; 9][..], &[0x01]].concat();
        assert_eq!(number(&least), Ok(i64::MIN));
        assert_eq!(number(&[0xff; 11]), Err(Claim::Number));
    }

    /// 2³¹ − 1 as a list has its size.
    const MANY: [u8; 5] = [0xff, 0xff, 0xff, 0xff, 0x07];
    const SIZE: usize = 0x7fff_ffff;

    #[test]
    fn lists_without_a_byte_for_each_element_are_refused_at_once() {
        let list = |header: u8| [&[0x39, header][..], &MANY, &[0, 0]].concat();
        // Of an unknown field 3: truth values by both of their types, and structures.
        assert_eq!(passed(&list(0xf1)), Err(Claim::Booleans(SIZE)));
        assert_eq!(passed(&list(0xf2)), Err(Claim::Booleans(SIZE)));
        assert_eq!(passed(&list(0xfc)), Err(Claim::Elements(SIZE)));
        // Few of them would shift what comes after, as the reader sees it.
        assert_eq!(passed(&[0x39, 0x21, 1, 1, 0]), Err(Claim::Booleans(2)));
        assert_eq!(passed(&[0x39, 0x01, 0]), Ok(3));
        let map = [&[0x3b][..], &MANY, &[0x12, 0]].concat();
        assert_eq!(passed(&map), Err(Claim::Booleans(SIZE)));
    }

    #[test]
    fn a_known_field_of_another_type_is_refused() {
        let refused = Claim::WrongType { found: Kind::Bytes, known: Kind::Int };
        assert_eq!(passed(&[0x18, 1, b'a', 0]), Err(refused));
        let refused = Claim::WrongType { found: Kind::Int, known: Kind::Struct };
        assert_eq!(passed(&[0x29, 0x15, 0, 0]), Err(refused));
    }

    #[test]
    fn structures_within_each_other_end_where_the_reader_would() {
        // Field 3 of each holds the next.
        let nested = |levels: usize| [vec![0x3c; levels], vec![0; levels + 1]].concat();
        assert_eq!(passed(&nested(63)), Ok(127));
        assert_eq!(passed(&nested(64)), Err(Claim::TooDeep));
        assert_eq!(passed(&nested(1 << 20)), Err(Claim::TooDeep));
    }
}
