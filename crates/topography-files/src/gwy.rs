//! Gwyddion files. A Gwyddion file is a tree of named and typed values, with maps in `/N/data`,
//! their names in `/N/data/title` and their masks in `/N/mask`.
//!
//! The file gives the sides of the map. Lines run along x; the first line, at the top of the image,
//! has y = 0. Masked points are missing.
//!
//! Gwyddion 2.62 and gwyfile 0.3.0 write such files; `sample_0.gwy` of AFMReader 0.0.7 is one.

use std::borrow::Cow;
use std::collections::BTreeSet;

use super::channel::{Channel, NAME_FIRST, Sides};
use super::input::{Cursor, latin1};
use super::raster::{ByteOrder, Element, Raster, checked_nodes};
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

pub(crate) const FORMAT: Format = Format::new("gwy", "Gwyddion", read).changed(&[NAME_FIRST]);

/// Maximum depth of nested objects.
const MAX_DEPTH: usize = 16;

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    if bytes.starts_with(b"GWYO") {
        let what = "files of Gwyddion 1 are not supported; open it in Gwyddion 2 and save it again";
        return Err(FormatError::unsupported(what));
    }
    if !bytes.starts_with(b"GWYP") {
        return Err(FormatError::Signature);
    }
    let container = Object::read(&mut Cursor::at(bytes, 4), 0)?;
    let names = container.components.iter().map(|(name, _)| name);
    let numbers: BTreeSet<u32> = names
        .filter_map(|name| name.strip_prefix('/')?.strip_suffix("/data")?.parse().ok())
        .collect();
    let channels = numbers.into_iter().map(|number| {
        let path = |rest: &str| format!("/{number}/{rest}");
        let field = container.object(&path("data"))?;
        let title = container.find(&path("data/title")).and_then(Value::text);
        let mask = container.object(&path("mask")).ok();
        channel(title.unwrap_or("heights"), field, mask)
    });
    at_least_one(channels, "/0/data")
}

fn channel<'a>(
    title: &str,
    field: &Object<'a>,
    mask: Option<&Object<'a>>,
) -> Result<Channel<'a>, FormatError> {
    let raster = raster(field)?;
    let nodes = raster.nodes();
    let unit = |name| {
        let unit = field.object(name).ok();
        let text = unit.and_then(|unit| unit.find("unitstr")?.text());
        Unit::parse(text.unwrap_or_default())
    };
    // Gwyddion uses the magnitude of a negative side.
    let sides = [field.number("xreal")?.abs(), field.number("yreal")?.abs()];
    let lateral = unit("si_unit_xy");
    let size = Sides::given(Some(sides).filter(|sides| !sides.contains(&0.0)), &lateral)?;
    let channel = Channel::new(title, unit("si_unit_z"), size, raster);
    let Some(mask) = mask else { return Ok(channel) };
    let mask = self::raster(mask)?;
    if mask.nodes() != nodes {
        let [x, y] = mask.nodes();
        let allowed = "the size of the map";
        return Err(FormatError::value("size of a mask", format!("{x} × {y}"), allowed));
    }
    Ok(channel.under_mask(mask))
}

fn raster<'a>(field: &Object<'a>) -> Result<Raster<'a>, FormatError> {
    let nodes = checked_nodes([field.number("xres")? as i64, field.number("yres")? as i64])?;
    match field.find("data") {
        Some(Value::Doubles(bytes)) => Raster::rows(nodes, Element::F64, ByteOrder::Little, *bytes),
        _ => Err(FormatError::missing("data")),
    }
}

/// Object of a Gwyddion file: named values in the order of the file.
struct Object<'a> {
    components: Vec<(Cow<'a, str>, Value<'a>)>,
}

enum Value<'a> {
    Number(f64),
    Text(Cow<'a, str>),
    Doubles(&'a [u8]),
    Object(Object<'a>),
    /// Value of a type that no map uses. It is skipped.
    Other,
}

impl<'a> Value<'a> {
    fn text(&self) -> Option<&str> {
        match self {
            Value::Text(text) => Some(text),
            _ => None,
        }
    }
}

impl<'a> Object<'a> {
    /// Reads an object, which consists of a name, a length in bytes and components.
    fn read(cursor: &mut Cursor<'a>, depth: usize) -> Result<Object<'a>, FormatError> {
        if depth > MAX_DEPTH {
            let what = format!("objects are nested more than {MAX_DEPTH} levels deep");
            return Err(FormatError::unsupported(what));
        }
        text(cursor)?;
        let length = cursor.u32()? as usize;
        let mut inside = Cursor::new(cursor.take(length)?);
        let mut components = Vec::new();
        while !inside.rest().is_empty() {
            let name = text(&mut inside)?;
            let [kind] = inside.array()?;
            components.push((name, value(&mut inside, kind, depth)?));
        }
        Ok(Object { components })
    }

    fn find(&self, name: &str) -> Option<&Value<'a>> {
        let mut components = self.components.iter();
        components.find(|(known, _)| *known == name).map(|(_, value)| value)
    }

    fn object(&self, name: &str) -> Result<&Object<'a>, FormatError> {
        match self.find(name) {
            Some(Value::Object(object)) => Ok(object),
            _ => Err(FormatError::missing(name)),
        }
    }

    fn number(&self, name: &str) -> Result<f64, FormatError> {
        match self.find(name) {
            Some(Value::Number(number)) => Ok(*number),
            _ => Err(FormatError::missing(name)),
        }
    }
}

fn value<'a>(cursor: &mut Cursor<'a>, kind: u8, depth: usize) -> Result<Value<'a>, FormatError> {
    match kind {
        b'b' | b'c' => cursor.skip(1)?,
        b'i' => return Ok(Value::Number(cursor.i32()?.into())),
        b'q' => return Ok(Value::Number(i64::from_le_bytes(cursor.array()?) as f64)),
        b'd' => return cursor.double().map(Value::Number),
        b's' => return text(cursor).map(Value::Text),
        b'o' => return Object::read(cursor, depth + 1).map(Value::Object),
        b'D' => return array(cursor, 8).map(Value::Doubles),
        b'C' => array(cursor, 1).map(drop)?,
        b'I' => array(cursor, 4).map(drop)?,
        b'Q' => array(cursor, 8).map(drop)?,
        b'S' => (0..cursor.u32()?).try_for_each(|_| text(cursor).map(drop))?,
        b'O' => (0..cursor.u32()?).try_for_each(|_| Object::read(cursor, depth + 1).map(drop))?,
        _ => {
            let found = char::from(kind).escape_default();
            let allowed = "one of bciqdsoCIQDSO";
            return Err(FormatError::value("type of a value", found, allowed));
        }
    }
    Ok(Value::Other)
}

fn array<'a>(cursor: &mut Cursor<'a>, size: usize) -> Result<&'a [u8], FormatError> {
    let count = cursor.u32()? as usize;
    cursor.take(count.saturating_mul(size))
}

/// Reads text up to the next zero byte. Text is UTF-8, but instruments and scripts also put
/// ISO-8859-1 into metadata (TopoStats issue 832, 2024).
fn text<'a>(cursor: &mut Cursor<'a>) -> Result<Cow<'a, str>, FormatError> {
    let rest = cursor.rest();
    let length = rest.iter().position(|&byte| byte == 0);
    let bytes = cursor.take(length.unwrap_or(rest.len()))?;
    cursor.skip(1)?;
    Ok(str::from_utf8(bytes).map_or_else(|_| latin1(bytes).into(), Cow::Borrowed))
}
