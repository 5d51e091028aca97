//! A walk over the compact protocol of Thrift, in which Parquet writes its footer and the headers of
//! its pages. Nothing is made of what it passes, and each of its steps takes at least a byte.
//!
//! The reader of Parquet has no such bound. What it does not know it passes over, in a footer without
//! a byte for each of the truth values in lists and maps, in the header of a page without an error at
//! the end of the file, where doubles and texts take no more bytes, either. Eight bytes make it count to
//! 2³¹, and a list around them again for each of its elements.
//!
//! A walk finds them only where it sees the fields that the reader sees. That reads a field that it
//! knows without a look at the type that the field is said to have; so the type of every known field is
//! compared with its [`Shape`] here.
//!
//! See the [specification](https://github.com/apache/thrift/blob/master/doc/specs/thrift-compact-protocol.md).

use super::claim::{Claim, DEEPEST};
use super::kind::Kind;

/// What a value that the reader knows is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Of nothing else.
    Plain(Kind),
    /// Of elements.
    List(&'static Shape),
    /// Of fields.
    Struct(&'static [Field]),
}

/// A field that the reader knows: its number and its shape.
pub type Field = (i16, Shape);

impl Shape {
    fn kind(self) -> Kind {
        match self {
            Shape::Plain(kind) => kind,
            Shape::List(_) => Kind::List,
            Shape::Struct(_) => Kind::Struct,
        }
    }
}

/// Bytes that are walked over, and the place in them.
#[derive(Debug, Clone)]
pub struct Walk<'a> {
    bytes: &'a [u8],
    place: usize,
    depth: usize,
}

impl<'a> Walk<'a> {
    pub fn over(bytes: &'a [u8]) -> Walk<'a> {
        Walk { bytes, place: 0, depth: 0 }
    }

    /// How many bytes it has passed.
    pub fn place(&self) -> usize {
        self.place
    }

    /// Passes a structure: `visit` passes each field that is known, all others are passed here.
    pub fn fields(
        &mut self,
        known: &'static [Field],
        mut visit: impl FnMut(&mut Self, i16, Shape) -> Result<(), Claim>,
    ) -> Result<(), Claim> {
        self.deeper(|walk| {
            let mut last: i16 = 0;
            while let Some((kind, field)) = walk.field(last)? {
                match known.iter().find(|(number, _)| *number == field) {
                    None => walk.pass(kind, None)?,
                    Some((_, shape)) => {
                        same(kind, shape.kind())?;
                        visit(walk, field, *shape)?;
                    }
                }
                last = field;
            }
            Ok(())
        })
    }

    /// Passes a list: `visit` passes each of its elements.
    pub fn elements(
        &mut self,
        known: Kind,
        mut visit: impl FnMut(&mut Self) -> Result<(), Claim>,
    ) -> Result<(), Claim> {
        let (size, found) = self.list()?;
        if size > 0 {
            same(found, known)?;
        }
        self.deeper(|walk| (0..size).try_for_each(|_| visit(walk)))
    }

    /// Passes a value of a known shape.
    pub fn known(&mut self, shape: Shape) -> Result<(), Claim> {
        self.pass(shape.kind(), Some(shape))
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

    fn pass(&mut self, kind: Kind, shape: Option<Shape>) -> Result<(), Claim> {
        match (kind, shape) {
            // A field of this kind is true or false by its type.
            (Kind::Truth, _) => Ok(()),
            (Kind::Byte, _) => self.take(1).map(drop),
            (Kind::Short | Kind::Int | Kind::Long, _) => self.varint().map(drop),
            (Kind::Double, _) => self.take(8).map(drop),
            (Kind::Uuid, _) => self.take(16).map(drop),
            (Kind::Bytes, _) => self.bytes().map(drop),
            (Kind::List, Some(Shape::List(element))) => {
                self.elements(element.kind(), |walk| walk.known(*element))
            }
            (Kind::List | Kind::Set, _) => {
                let (size, kind) = self.list()?;
                self.deeper(|walk| (0..size).try_for_each(|_| walk.pass(kind, None)))
            }
            (Kind::Map, _) => self.map(),
            (Kind::Struct, Some(Shape::Struct(known))) => self.fields(known, Self::visited),
            (Kind::Struct, _) => self.fields(&[], Self::visited),
        }
    }

    fn visited(&mut self, _: i16, shape: Shape) -> Result<(), Claim> {
        self.known(shape)
    }

    fn map(&mut self) -> Result<(), Claim> {
        let size = usize::try_from(self.varint()?).map_err(|_| Claim::Number)?;
        if size == 0 {
            return Ok(());
        }
        let kinds = self.take(1)?[0];
        let [key, value] = [kind(kinds >> 4)?, kind(kinds & 0xf)?];
        self.bounded(size, key)?;
        self.bounded(size, value)?;
        self.deeper(|walk| {
            (0..size).try_for_each(|_| {
                walk.pass(key, None)?;
                walk.pass(value, None)
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
        let kind = kind(header & 0xf)?;
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
            Kind::Truth if size > 0 => Err(Claim::Truths(size)),
            _ if size > self.bytes.len() - self.place => Err(Claim::Elements(size)),
            _ => Ok(()),
        }
    }

    /// The kind and the number of the next field; none at the end of a structure.
    fn field(&mut self, last: i16) -> Result<Option<(Kind, i16)>, Claim> {
        let header = self.take(1)?[0];
        if header & 0xf == 0 {
            return Ok(None);
        }
        let kind = kind(header & 0xf)?;
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
        let rest = &self.bytes[self.place..];
        let taken = rest.get(..length).ok_or(Claim::Bytes)?;
        self.place += length;
        Ok(taken)
    }

    fn deeper(&mut self, pass: impl FnOnce(&mut Self) -> Result<(), Claim>) -> Result<(), Claim> {
        if self.depth == DEEPEST {
            return Err(Claim::Deep);
        }
        self.depth += 1;
        pass(self)?;
        self.depth -= 1;
        Ok(())
    }
}

fn kind(word: u8) -> Result<Kind, Claim> {
    Kind::of(word).ok_or(Claim::Kind(word))
}

fn same(found: Kind, known: Kind) -> Result<(), Claim> {
    match found == known {
        true => Ok(()),
        false => Err(Claim::Another { found, known }),
    }
}

#[cfg(test)]
mod tests;
