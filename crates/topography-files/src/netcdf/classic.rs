//! The header of the classic format: dimensions, attributes, variables.

use crate::cursor::{Cursor, latin1};
use crate::error::FormatError;
use crate::raster::Element;

/// What a file declares.
pub struct Dataset<'a> {
    dimensions: Vec<(&'a str, i64)>,
    variables: Vec<Variable<'a>>,
}

/// Numbers over dimensions.
pub struct Variable<'a> {
    name: &'a str,
    dimensions: Vec<usize>,
    attributes: Vec<Attribute<'a>>,
    kind: u32,
    begin: usize,
}

struct Attribute<'a> {
    name: &'a str,
    kind: u32,
    bytes: &'a [u8],
}

/// Codes of types.
const BYTE: u32 = 1;
const CHARACTER: u32 = 2;
const SHORT: u32 = 3;
const INTEGER: u32 = 4;
const FLOAT: u32 = 5;
const DOUBLE: u32 = 6;

impl<'a> Dataset<'a> {
    pub fn read(bytes: &'a [u8]) -> Result<Dataset<'a>, FormatError> {
        let wide = match bytes {
            [b'C', b'D', b'F', 1, ..] => false,
            [b'C', b'D', b'F', 2, ..] => true,
            [b'C', b'D', b'F', 5, ..] => {
                let what = "netCDF in its format of 64-bit data; the classic format is read";
                return Err(FormatError::unsupported(what));
            }
            _ => return Err(FormatError::Signature),
        };
        let mut cursor = Cursor::at(bytes, 4);
        // The number of records, which no map is made of.
        whole(&mut cursor)?;
        let dimensions = list(&mut cursor, |cursor| Ok((name(cursor)?, whole(cursor)?.into())))?;
        list(&mut cursor, attribute)?;
        let variables = list(&mut cursor, |cursor| variable(cursor, wide))?;
        Ok(Dataset { dimensions, variables })
    }

    pub fn variable(&self, name: &str) -> Result<&Variable<'a>, FormatError> {
        let mut variables = self.variables.iter();
        let variable = variables.find(|variable| variable.name == name);
        variable.ok_or_else(|| FormatError::missing(format!("variable {name}")))
    }

    /// Names and lengths of a variable's dimensions.
    pub fn dimensions(&self, variable: &Variable<'a>) -> Result<Vec<(&'a str, i64)>, FormatError> {
        let dimensions = variable.dimensions.iter().map(|&number| {
            let dimension = self.dimensions.get(number).copied();
            dimension.ok_or_else(|| FormatError::missing(format!("dimension {number}")))
        });
        dimensions.collect()
    }
}

impl<'a> Variable<'a> {
    /// Where its numbers start.
    pub fn begin(&self) -> usize {
        self.begin
    }

    pub fn element(&self) -> Result<Element, FormatError> {
        match self.kind {
            BYTE => Ok(Element::I8),
            SHORT => Ok(Element::I16),
            INTEGER => Ok(Element::I32),
            FLOAT => Ok(Element::F32),
            DOUBLE => Ok(Element::F64),
            kind => {
                let entry = format!("type of {}", self.name);
                Err(FormatError::value(&entry, kind, "that of numbers"))
            }
        }
    }

    fn attribute(&self, name: &str) -> Option<&Attribute<'a>> {
        self.attributes.iter().find(|attribute| attribute.name == name)
    }

    /// An attribute of text.
    pub fn text(&self, name: &str) -> Option<String> {
        let attribute = self.attribute(name).filter(|found| found.kind == CHARACTER)?;
        let text = str::from_utf8(attribute.bytes);
        Some(text.map_or_else(|_| latin1(attribute.bytes), str::to_owned))
    }

    /// The first number of an attribute.
    pub fn number(&self, name: &str) -> Option<f64> {
        let attribute = self.attribute(name)?;
        let mut cursor = Cursor::new(attribute.bytes);
        match attribute.kind {
            BYTE => cursor.array().ok().map(|b| i8::from_be_bytes(b).into()),
            SHORT => cursor.array().ok().map(|b| i16::from_be_bytes(b).into()),
            INTEGER => cursor.array().ok().map(|b| i32::from_be_bytes(b).into()),
            FLOAT => cursor.array().ok().map(|b| f32::from_be_bytes(b).into()),
            DOUBLE => cursor.array().ok().map(f64::from_be_bytes),
            _ => None,
        }
    }
}

fn whole(cursor: &mut Cursor<'_>) -> Result<u32, FormatError> {
    Ok(u32::from_be_bytes(cursor.array()?))
}

/// A list: what it is of, or nothing, and how many there are.
fn list<'a, T>(
    cursor: &mut Cursor<'a>,
    element: impl Fn(&mut Cursor<'a>) -> Result<T, FormatError>,
) -> Result<Vec<T>, FormatError> {
    whole(cursor)?;
    // It grows as its elements are read: a count costs nothing.
    (0..whole(cursor)?).map(|_| element(cursor)).collect()
}

/// Bytes, padded to a multiple of four.
fn padded<'a>(cursor: &mut Cursor<'a>, length: usize) -> Result<&'a [u8], FormatError> {
    let bytes = cursor.take(length)?;
    cursor.skip(length.next_multiple_of(4) - length)?;
    Ok(bytes)
}

fn name<'a>(cursor: &mut Cursor<'a>) -> Result<&'a str, FormatError> {
    let length = whole(cursor)? as usize;
    let bytes = padded(cursor, length)?;
    str::from_utf8(bytes).map_err(|error| FormatError::damaged("a name", error))
}

fn attribute<'a>(cursor: &mut Cursor<'a>) -> Result<Attribute<'a>, FormatError> {
    let name = name(cursor)?;
    let kind = whole(cursor)?;
    let size = match kind {
        BYTE | CHARACTER => 1,
        SHORT => 2,
        INTEGER | FLOAT => 4,
        DOUBLE => 8,
        _ => {
            let allowed = "1 to 6";
            return Err(FormatError::value("type of an attribute", kind, allowed));
        }
    };
    let length = (whole(cursor)? as usize).saturating_mul(size);
    let bytes = padded(cursor, length)?;
    Ok(Attribute { name, kind, bytes })
}

fn variable<'a>(cursor: &mut Cursor<'a>, wide: bool) -> Result<Variable<'a>, FormatError> {
    let name = name(cursor)?;
    let rank = whole(cursor)?;
    let dimensions = (0..rank).map(|_| Ok(whole(cursor)? as usize));
    let dimensions = dimensions.collect::<Result<_, FormatError>>()?;
    let attributes = list(cursor, attribute)?;
    let kind = whole(cursor)?;
    // Its bytes, which follow from its dimensions.
    whole(cursor)?;
    let begin = match wide {
        true => usize::try_from(u64::from_be_bytes(cursor.array()?)).unwrap_or(usize::MAX),
        false => whole(cursor)? as usize,
    };
    Ok(Variable { name, dimensions, attributes, kind, begin })
}
