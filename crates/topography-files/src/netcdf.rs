//! NetCDF files in the classic format (versions 1, 2 and 5, CDF-5), as netCDF4, SciPy, GMT, GDAL,
//! and `to_netcdf` of SurfaceTopography and xarray write them.
//!
//! All variables with two long dimensions are channels; the module [`labelled`](super::labelled)
//! documents their conventions. SurfaceTopography 1.27.1 writes the variable `heights[x, y]`, whose
//! axes have the attributes `length` and `unit`, and an optional variable `mask`, which is nonzero
//! at missing points. The heights have the unit of x unless they have an own one. Variables along
//! the unlimited dimension are stored in records.
//!
//! GMT 3, and GMT 6 in its formats `cb` to `cd`, write one dimension instead: `z[xysize]` has
//! the lines from the greatest y, and `dimension`, `spacing` and `x_range` describe the grid. The
//! attributes `units` of `x_range` and `y_range` are labels, `x` and `y` by default.

use std::borrow::Cow;

use super::channel::Channel;
use super::input::{Cursor, decode_text};
use super::labelled::{Array, Attributes, Axis, Value};
use super::raster::{ByteOrder, Element, checked_nodes};
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

pub(crate) const FORMAT: Format = Format::new("netcdf", "netCDF", 4, read);

/// Number that netCDF stores where no number of a type was written. Bytes have none: every byte may
/// be a number.
pub(crate) fn default_fill(element: Element) -> Option<f64> {
    match element {
        Element::I8 | Element::U8 | Element::F16 => None,
        Element::I16 => Some(-32767.0),
        Element::U16 => Some(65535.0),
        Element::I32 => Some(-2147483647.0),
        Element::U32 => Some(4294967295.0),
        Element::I64 => Some(-9223372036854775806.0),
        Element::U64 => Some(18446744073709551614.0),
        Element::F32 | Element::F64 => Some(9.969_209_968_386_869e36),
    }
}

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let dataset = Dataset::read(bytes)?;
    let is_map = |variable: &&Variable<'_>| {
        let is_mask = variable.name == "mask" && dataset.is_surface();
        let shape = variable.dimensions.iter().map(|&number| dataset.length(number));
        let is_map = Array::is_map_of(&shape.collect::<Vec<_>>());
        is_map && !is_mask && variable.element().is_some() && !dataset.is_bounds(variable.name)
    };
    let maps: Vec<&Variable<'_>> = dataset.variables.iter().filter(is_map).collect();
    let mut channels = Vec::new();
    for variable in maps {
        channels.extend(dataset.array(variable)?.channels()?);
    }
    if channels.is_empty()
        && let Some(grid) = dataset.grid_of_gmt3()?
    {
        channels = grid.channels()?;
    }
    at_least_one(channels.into_iter().map(Ok), "variable of numbers with two dimensions")
}

/// Completes the array `heights` of a file of SurfaceTopography: its unit may be that of x, and
/// `mask` marks missing points. SurfaceTopography 1.27.1 spells the ångström `A`.
pub(crate) fn complete_heights<'a>(
    heights: &mut Array<'a>,
    mask: Option<Array<'a>>,
) -> Result<(), FormatError> {
    let angstrom = |unit: Unit| if unit == Unit::parse("A") { Unit::parse("Å") } else { unit };
    for axis in &mut heights.axes {
        axis.unit = axis.unit.take().map(angstrom);
    }
    let of_axis = heights.axes.iter().find_map(|axis| axis.unit.clone());
    heights.unit = heights.attributes.unit()?.map(angstrom).or(of_axis);
    heights.attributes.0.retain(|(name, _)| name != "unit" && name != "units");
    heights.mask = mask.map(Box::new);
    Ok(())
}

/// File with its dimensions, each with name and length, and its variables.
struct Dataset<'a> {
    bytes: &'a [u8],
    dimensions: Vec<(&'a str, u64)>,
    /// Number of records along the unlimited dimension, whose length is 0 in the header.
    records: u64,
    variables: Vec<Variable<'a>>,
}

/// Array of a file, with its dimensions and attributes.
struct Variable<'a> {
    name: &'a str,
    dimensions: Vec<usize>,
    attributes: Attributes,
    kind: u32,
    /// Offset of the numbers in the file.
    begin: usize,
}

// Codes of the types of numbers.
const CHARACTER: u32 = 2;

fn element(kind: u32) -> Option<Element> {
    match kind {
        1 => Some(Element::I8),
        3 => Some(Element::I16),
        4 => Some(Element::I32),
        5 => Some(Element::F32),
        6 => Some(Element::F64),
        7 => Some(Element::U8),
        8 => Some(Element::U16),
        9 => Some(Element::U32),
        10 => Some(Element::I64),
        11 => Some(Element::U64),
        _ => None,
    }
}

impl<'a> Dataset<'a> {
    fn read(bytes: &'a [u8]) -> Result<Dataset<'a>, FormatError> {
        let version = match bytes {
            [b'C', b'D', b'F', version @ (1 | 2 | 5), ..] => *version,
            _ => return Err(FormatError::Signature),
        };
        let mut header = Header { cursor: Cursor::at(bytes, 4), version };
        let records = header.count()?;
        let dimensions = header.list(|header| Ok((header.name()?, header.count()?)))?;
        header.list(Header::attribute)?;
        let variables = header.list(Header::variable)?;
        let mut dataset = Dataset { bytes, dimensions, records, variables };
        // All bits are set while a program still writes the file.
        if records == u64::from(u32::MAX) || records == u64::MAX {
            let of_records = dataset.variables.iter().filter(|v| dataset.is_record(v));
            let first = of_records.map(|variable| variable.begin).min().unwrap_or(bytes.len());
            let left = bytes.len().saturating_sub(first) as u64;
            dataset.records = left.checked_div(dataset.record_bytes()).unwrap_or(0);
        }
        Ok(dataset)
    }

    fn variable(&self, name: &str) -> Option<&Variable<'a>> {
        self.variables.iter().find(|variable| variable.name == name)
    }

    /// Returns true for files of SurfaceTopography, whose axes state sides.
    fn is_surface(&self) -> bool {
        let states_side = |&number: &usize| {
            let axis = self.dimensions.get(number).and_then(|(name, _)| self.variable(name));
            axis.is_some_and(|axis| axis.attributes.number("length").is_some())
        };
        self.variable("heights").is_some_and(|heights| heights.dimensions.iter().any(states_side))
    }

    fn length(&self, dimension: usize) -> u64 {
        match self.dimensions.get(dimension) {
            Some((_, 0)) => self.records,
            Some((_, length)) => *length,
            None => 0,
        }
    }

    /// Returns true if another variable names this one as the bounds of its cells.
    fn is_bounds(&self, name: &str) -> bool {
        let bounds = |of: &Variable<'a>| of.attributes.text("bounds").ok().flatten() == Some(name);
        self.variables.iter().any(bounds)
    }

    fn is_record(&self, variable: &Variable<'a>) -> bool {
        let first = variable.dimensions.first().and_then(|&first| self.dimensions.get(first));
        first.is_some_and(|(_, length)| *length == 0)
    }

    /// Returns the numbers of one record of a variable, or of a whole variable without records, in
    /// bytes.
    fn variable_bytes(&self, variable: &Variable<'a>) -> u64 {
        let skipped = usize::from(self.is_record(variable));
        let lengths = variable.dimensions.iter().skip(skipped).map(|&number| self.length(number));
        let size = element(variable.kind).map_or(1, Element::size) as u64;
        lengths.fold(size, u64::saturating_mul)
    }

    /// Returns the distance of records in bytes. The parts of several variables are padded.
    fn record_bytes(&self) -> u64 {
        let records = self.variables.iter().filter(|variable| self.is_record(variable));
        let lengths: Vec<u64> = records.map(|variable| self.variable_bytes(variable)).collect();
        match lengths.as_slice() {
            [only] => *only,
            several => several
                .iter()
                .fold(0, |sum, length| sum.saturating_add(length.saturating_add(3) / 4 * 4)),
        }
    }

    /// Returns the numbers of a variable.
    fn stored(&self, variable: &Variable<'a>) -> Result<Cow<'a, [u8]>, FormatError> {
        let whole = |length: u64| usize::try_from(length).unwrap_or(usize::MAX);
        let length = whole(self.variable_bytes(variable));
        if !self.is_record(variable) {
            return Ok(Cursor::at(self.bytes, variable.begin).take(length)?.into());
        }
        let distance = whole(self.record_bytes());
        // The file has all records, so that the number of records is bounded by its length.
        let needed = whole(self.records).saturating_sub(1).saturating_mul(distance);
        Cursor::at(self.bytes, variable.begin.saturating_add(needed)).take(length)?;
        let starts = (0..whole(self.records)).map(|record| variable.begin + record * distance);
        Ok(starts.flat_map(|start| &self.bytes[start..start + length]).copied().collect())
    }

    /// Returns the grid of a file of GMT 3.
    fn grid_of_gmt3(&self) -> Result<Option<Array<'a>>, FormatError> {
        let names = ["x_range", "y_range", "spacing", "dimension", "z"];
        let [Some(x), Some(y), Some(spacing), Some(dimension), Some(z)] =
            names.map(|name| self.variable(name))
        else {
            return Ok(None);
        };
        let pair = |variable: &Variable<'a>| -> Result<[f64; 2], FormatError> {
            let missing = || FormatError::missing(format!("two numbers of `{}`", variable.name));
            let element = variable.element().ok_or_else(missing)?;
            let numbers = element.numbers(ByteOrder::Big, &self.stored(variable)?);
            numbers.try_into().map_err(|_| missing())
        };
        let (steps, counts) = (pair(spacing)?, pair(dimension)?);
        let [nodes_x, nodes_y] = checked_nodes(counts.map(|count| count as i64))?;
        let axis = |of: &Variable<'a>, name: &str, step: f64| {
            let unit = of.attributes.unit()?.filter(|unit| *unit != Unit::parse(name));
            Ok(Axis { step: Some(step), unit, ..Axis::named(name) })
        };
        let mut array = self.plain_array(z)?;
        if array.shape != [nodes_x * nodes_y] {
            let (found, allowed) = (format!("{:?}", array.shape), format!("{nodes_x} × {nodes_y}"));
            return Err(FormatError::value("size of `z`", found, &allowed));
        }
        array.shape = vec![nodes_y, nodes_x];
        // The first line has the greatest y.
        array.axes = vec![axis(y, "y", -steps[1])?, axis(x, "x", steps[0])?];
        Ok(Some(array))
    }

    fn array(&self, variable: &Variable<'a>) -> Result<Array<'a>, FormatError> {
        let mut array = self.plain_array(variable)?;
        if variable.name == "heights" && self.is_surface() {
            let mask = self.variable("mask").map(|mask| self.plain_array(mask)).transpose()?;
            complete_heights(&mut array, mask)?;
        }
        Ok(array)
    }

    fn plain_array(&self, variable: &Variable<'a>) -> Result<Array<'a>, FormatError> {
        let missing = || FormatError::missing(format!("type of numbers of {}", variable.name));
        let element = variable.element().ok_or_else(missing)?;
        let axes = variable.dimensions.iter().map(|&number| {
            let missing = || FormatError::missing(format!("dimension {number}"));
            let (name, _) = *self.dimensions.get(number).ok_or_else(missing)?;
            let coordinates = self.variable(name).filter(|axis| axis.dimensions == [number]);
            match coordinates.and_then(|axis| Some((axis, axis.element()?))) {
                Some((axis, element)) => {
                    let numbers = element.numbers(ByteOrder::Big, &self.stored(axis)?);
                    Axis::new(name, &numbers, &axis.attributes)
                }
                None => Ok(Axis::named(name)),
            }
        });
        let lengths = variable.dimensions.iter().map(|&number| self.length(number));
        Ok(Array {
            name: variable.name.to_owned(),
            shape: lengths.map(|length| usize::try_from(length).unwrap_or(usize::MAX)).collect(),
            axes: axes.collect::<Result<_, FormatError>>()?,
            attributes: variable.attributes.clone(),
            element,
            order: ByteOrder::Big,
            bytes: self.stored(variable)?,
            unit: None,
            unwritten: default_fill(element),
            last_is_x: false,
            mask: None,
        })
    }
}

impl Variable<'_> {
    fn element(&self) -> Option<Element> {
        element(self.kind)
    }
}

/// Reader of a header. In CDF-5, counts have 64 bits.
struct Header<'a> {
    cursor: Cursor<'a>,
    version: u8,
}

impl<'a> Header<'a> {
    fn whole(&mut self) -> Result<u32, FormatError> {
        Ok(u32::from_be_bytes(self.cursor.array()?))
    }

    fn count(&mut self) -> Result<u64, FormatError> {
        match self.version {
            5 => Ok(u64::from_be_bytes(self.cursor.array()?)),
            _ => self.whole().map(u64::from),
        }
    }

    fn size(&mut self) -> Result<usize, FormatError> {
        Ok(usize::try_from(self.count()?).unwrap_or(usize::MAX))
    }

    /// Reads a list, which consists of a tag, the number of elements and the elements.
    fn list<T>(
        &mut self,
        element: impl Fn(&mut Header<'a>) -> Result<T, FormatError>,
    ) -> Result<Vec<T>, FormatError> {
        self.whole()?;
        // The vector grows as elements are read, so that a damaged number allocates no memory.
        (0..self.count()?).map(|_| element(self)).collect()
    }

    /// Reads `length` bytes and skips their padding to a multiple of four.
    fn padded(&mut self, length: usize) -> Result<&'a [u8], FormatError> {
        let bytes = self.cursor.take(length)?;
        self.cursor.skip(length.next_multiple_of(4) - length)?;
        Ok(bytes)
    }

    fn name(&mut self) -> Result<&'a str, FormatError> {
        let length = self.size()?;
        let bytes = self.padded(length)?;
        str::from_utf8(bytes).map_err(|error| FormatError::damaged("a name", error))
    }

    fn attribute(&mut self) -> Result<(String, Value), FormatError> {
        let name = self.name()?.to_owned();
        let kind = self.whole()?;
        let count = self.size()?;
        if kind == CHARACTER {
            let text = decode_text(self.padded(count)?);
            return Ok((name, Value::Texts(vec![text.trim_end_matches('\0').to_owned()])));
        }
        let wrong = || FormatError::value("type of an attribute", kind, "1 to 11");
        let element = element(kind).ok_or_else(wrong)?;
        let bytes = self.padded(count.saturating_mul(element.size()))?;
        Ok((name, Value::Numbers(element.numbers(ByteOrder::Big, bytes))))
    }

    fn variable(&mut self) -> Result<Variable<'a>, FormatError> {
        let name = self.name()?;
        let dimensions =
            (0..self.count()?).map(|_| self.size()).collect::<Result<_, FormatError>>()?;
        let attributes = Attributes(self.list(Header::attribute)?);
        let kind = self.whole()?;
        // The length in bytes is ignored: it follows from the dimensions.
        self.count()?;
        let begin = match self.version {
            1 => self.whole()? as usize,
            _ => usize::try_from(u64::from_be_bytes(self.cursor.array()?)).unwrap_or(usize::MAX),
        };
        Ok(Variable { name, dimensions, attributes, kind, begin })
    }
}
