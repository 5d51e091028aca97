//! NetCDF files in versions 1 and 2 of the classic format, as `to_netcdf` of SurfaceTopography
//! writes them.
//!
//! The variable `heights` has the dimensions `x` and `y`. The variables `x` and `y` have the
//! attributes `length`, which is the side of the map, and `unit`. An optional variable `mask` is
//! nonzero at missing points. Lines run along y if the first dimension is x, as in files of
//! SurfaceTopography.

use super::channel::{Channel, Size};
use super::input::{Cursor, factor, finite, utf8_or_latin1};
use super::raster::{ByteOrder, Element, Missing, Raster, checked_nodes};
use super::unit::Unit;
use super::{Format, FormatError};

pub const FORMAT: Format = Format {
    name: "netcdf",
    title: "netCDF of SurfaceTopography",
    version: 1,
    has_signature: true,
    read,
};

/// Surface of a file of SurfaceTopography, in the classic format or in netCDF-4.
pub struct Surface<'a> {
    pub heights: Raster<'a>,
    pub unit: Option<String>,
    /// Numbers that are nonzero at missing points.
    pub mask: Option<Raster<'a>>,
    /// Attributes of the variables `x` and `y`.
    pub axes: [Axis; 2],
}

/// Attributes of the variable of an axis.
#[derive(Default)]
pub struct Axis {
    pub length: Option<f64>,
    pub unit: Option<String>,
}

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let dataset = Dataset::read(bytes)?;
    let heights = dataset.variable("heights")?;
    let mask = dataset.variable("mask").ok();
    let axis = |name| {
        let axis = dataset.variable(name).ok()?;
        Some(Axis { length: axis.number("length"), unit: axis.text("unit") })
    };
    let surface = Surface {
        heights: raster(&dataset, heights, bytes)?,
        unit: heights.text("unit"),
        mask: mask.map(|mask| raster(&dataset, mask, bytes)).transpose()?,
        axes: ["x", "y"].map(|name| axis(name).unwrap_or_default()),
    };
    Ok(vec![surface.channel()?])
}

impl<'a> Surface<'a> {
    /// Converts the surface to a channel.
    pub fn channel(self) -> Result<Channel<'a>, FormatError> {
        let mut raster = self.heights;
        if let Some(mask) = self.mask {
            if mask.nodes() != raster.nodes() {
                let found = format!("{:?}", mask.nodes());
                return Err(FormatError::value("size of `mask`", found, "the size of `heights`"));
            }
            raster = raster.masked(mask);
        }
        let [x, y] = self.axes;
        if let (Some(x), Some(y)) = (&x.unit, &y.unit)
            && x != y
        {
            return Err(FormatError::value("unit of `y`", y, &format!("the unit of `x`, {x}")));
        }
        let size = match (x.length, y.length) {
            (Some(x_length), Some(y_length)) => {
                let unit = Unit::parse(x.unit.as_deref().unwrap_or_default());
                Size::new([x_length, y_length], &unit)?
            }
            _ => Size::Unknown,
        };
        let unit = self.unit.or(x.unit).unwrap_or_default();
        Ok(Channel::new("heights", Unit::parse(&unit), size, raster))
    }
}

/// Applies the attributes of a variable that mark missing points and scale numbers.
pub fn unpacked<'a>(
    raster: Raster<'a>,
    number: impl Fn(&str) -> Option<f64>,
) -> Result<Raster<'a>, FormatError> {
    let missing = number("_FillValue").or_else(|| number("missing_value"));
    let scale = factor("scale_factor", number("scale_factor").unwrap_or(1.0))?;
    let offset = finite("add_offset", number("add_offset").unwrap_or(0.0))?;
    let raster = raster.scaled(scale, offset);
    Ok(match missing {
        Some(missing) => raster.missing(Missing::Value(missing)),
        None => raster,
    })
}

fn raster<'a>(
    dataset: &Dataset<'a>,
    variable: &Variable<'a>,
    bytes: &'a [u8],
) -> Result<Raster<'a>, FormatError> {
    let stored = bytes.get(variable.begin..).unwrap_or_default();
    let (element, order) = (variable.element()?, ByteOrder::Big);
    let dimensions = dataset.dimensions(variable)?;
    let raster = match dimensions[..] {
        [("x", x), ("y", y)] => Raster::columns(checked_nodes([x, y])?, element, order, stored),
        [("y", y), ("x", x)] => Raster::rows(checked_nodes([x, y])?, element, order, stored),
        _ => {
            let names: Vec<&str> = dimensions.iter().map(|(name, _)| *name).collect();
            let allowed = "x and y";
            return Err(FormatError::value("dimensions", names.join(", "), allowed));
        }
    }?;
    unpacked(raster, |name| variable.number(name))
}

/// Header of a file: dimensions, each with name and length, and variables.
struct Dataset<'a> {
    dimensions: Vec<(&'a str, i64)>,
    variables: Vec<Variable<'a>>,
}

/// Array of a file, with its dimensions and attributes.
struct Variable<'a> {
    name: &'a str,
    dimensions: Vec<usize>,
    attributes: Vec<Attribute<'a>>,
    kind: u32,
    /// Offset of the numbers in the file.
    begin: usize,
}

struct Attribute<'a> {
    name: &'a str,
    kind: u32,
    bytes: &'a [u8],
}

// Codes of the types of numbers.
const BYTE: u32 = 1;
const CHARACTER: u32 = 2;
const SHORT: u32 = 3;
const INTEGER: u32 = 4;
const FLOAT: u32 = 5;
const DOUBLE: u32 = 6;

impl<'a> Dataset<'a> {
    fn read(bytes: &'a [u8]) -> Result<Dataset<'a>, FormatError> {
        let wide = match bytes {
            [b'C', b'D', b'F', 1, ..] => false,
            [b'C', b'D', b'F', 2, ..] => true,
            [b'C', b'D', b'F', 5, ..] => {
                let what = "netCDF with 64-bit data is not supported; save the classic format";
                return Err(FormatError::unsupported(what));
            }
            _ => return Err(FormatError::Signature),
        };
        let mut cursor = Cursor::at(bytes, 4);
        // The number of records is ignored, because maps have no record dimension.
        whole(&mut cursor)?;
        let dimensions = list(&mut cursor, |cursor| Ok((name(cursor)?, whole(cursor)?.into())))?;
        list(&mut cursor, attribute)?;
        let variables = list(&mut cursor, |cursor| variable(cursor, wide))?;
        Ok(Dataset { dimensions, variables })
    }

    fn variable(&self, name: &str) -> Result<&Variable<'a>, FormatError> {
        let mut variables = self.variables.iter();
        let variable = variables.find(|variable| variable.name == name);
        variable.ok_or_else(|| FormatError::missing(format!("variable {name}")))
    }

    /// Returns the names and lengths of the dimensions of a variable.
    fn dimensions(&self, variable: &Variable<'a>) -> Result<Vec<(&'a str, i64)>, FormatError> {
        let dimensions = variable.dimensions.iter().map(|&number| {
            let dimension = self.dimensions.get(number).copied();
            dimension.ok_or_else(|| FormatError::missing(format!("dimension {number}")))
        });
        dimensions.collect()
    }
}

impl<'a> Variable<'a> {
    fn element(&self) -> Result<Element, FormatError> {
        match self.kind {
            BYTE => Ok(Element::I8),
            SHORT => Ok(Element::I16),
            INTEGER => Ok(Element::I32),
            FLOAT => Ok(Element::F32),
            DOUBLE => Ok(Element::F64),
            kind => {
                let entry = format!("type of {}", self.name);
                Err(FormatError::value(&entry, kind, "a type of numbers: 1, 3, 4, 5 or 6"))
            }
        }
    }

    fn attribute(&self, name: &str) -> Option<&Attribute<'a>> {
        self.attributes.iter().find(|attribute| attribute.name == name)
    }

    /// Returns the value of a text attribute.
    fn text(&self, name: &str) -> Option<String> {
        let attribute = self.attribute(name).filter(|found| found.kind == CHARACTER)?;
        Some(utf8_or_latin1(attribute.bytes))
    }

    /// Returns the first number of a numeric attribute.
    fn number(&self, name: &str) -> Option<f64> {
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

/// Reads a list, which consists of a tag, the number of elements and the elements.
fn list<'a, T>(
    cursor: &mut Cursor<'a>,
    element: impl Fn(&mut Cursor<'a>) -> Result<T, FormatError>,
) -> Result<Vec<T>, FormatError> {
    whole(cursor)?;
    // The vector grows as elements are read, so that a damaged number allocates no memory.
    (0..whole(cursor)?).map(|_| element(cursor)).collect()
}

/// Reads `length` bytes and skips their padding to a multiple of four.
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
    // The length in bytes is ignored: it follows from the dimensions.
    whole(cursor)?;
    let begin = if wide {
        usize::try_from(u64::from_be_bytes(cursor.array()?)).unwrap_or(usize::MAX)
    } else {
        whole(cursor)? as usize
    };
    Ok(Variable { name, dimensions, attributes, kind, begin })
}
