//! NetCDF files in the classic format (versions 1, 2 and 5, CDF-5), as netCDF4, SciPy, GMT, GDAL,
//! and `to_netcdf` of SurfaceTopography and xarray write them. The crate `netcdf-reader` decodes
//! the container.
//!
//! All variables with two long dimensions are channels; the module [`labelled`](super::labelled)
//! documents their conventions. SurfaceTopography 1.27.1 writes the variable `heights[x, y]`, whose
//! axes have the attributes `length` and `unit`, and an optional variable `mask`, which is nonzero
//! at missing points. The heights have the unit of x unless they have an own one.
//!
//! GMT 3, and GMT 6 in its formats `cb` to `cd`, write one dimension instead: `z[xysize]` has
//! the lines from the greatest y, and `dimension`, `spacing` and `x_range` describe the grid. The
//! attributes `units` of `x_range` and `y_range` are labels, `x` and `y` by default.

use netcdf_reader::{NcAttribute, NcDimension, NcFile, NcReadable, NcType, NcVariable};

use super::channel::Channel;
use super::labelled::{AXES, Array, Attributes, Axis, CONVENTIONS, DEGREES, Value};
use super::raster::{ByteOrder, Element, checked_nodes};
use super::unit::Unit;
use super::{Format, FormatError, at_least_one};

pub(crate) const FORMAT: Format =
    Format::new("netcdf", "netCDF", read).changed(&[CONVENTIONS, DEGREES, AXES]);

/// Number that netCDF stores where no number of a type was written. Bytes have none: every byte may
/// be a number.
pub(crate) fn default_fill(element: Element) -> Option<f64> {
    match (element, element.limits()) {
        (Element::F32 | Element::F64, _) => Some(9.969_209_968_386_869e36),
        (Element::I8 | Element::U8, _) | (_, None) => None,
        (_, Some([0.0, highest])) => Some(highest),
        (_, Some([lowest, _])) => Some(lowest + 1.0),
    }
}

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    if !matches!(bytes, [b'C', b'D', b'F', 1 | 2 | 5, ..]) {
        return Err(FormatError::Signature);
    }
    let file = NcFile::from_bytes(bytes).map_err(damaged)?;
    let dataset = Dataset { variables: file.variables().map_err(damaged)?, file: &file };
    let is_map = |variable: &&NcVariable| {
        let is_mask = variable.name == "mask" && dataset.is_surface();
        let is_number = variable.dtype != NcType::Char;
        let is_map = Array::is_map_of(&variable.shape()) && is_number;
        is_map && !is_mask && !dataset.is_bounds(&variable.name)
    };
    let mut channels = Vec::new();
    for variable in dataset.variables.iter().filter(is_map) {
        channels.extend(dataset.array(variable)?.channels()?);
    }
    if channels.is_empty()
        && let Some(grid) = dataset.grid_of_gmt3()?
    {
        channels = grid.channels()?;
    }
    at_least_one(channels.into_iter().map(Ok), "variable of numbers with two dimensions")
}

fn damaged(error: netcdf_reader::Error) -> FormatError {
    FormatError::damaged("the netCDF file", error)
}

/// Completes the array `heights` of a file of SurfaceTopography: its unit may be that of x, and
/// `mask` marks missing points. SurfaceTopography 1.27.1 spells the ångström `A`.
pub(crate) fn complete_heights(
    heights: &mut Array,
    mask: Option<Array>,
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

/// Opened file with its variables.
struct Dataset<'f> {
    file: &'f NcFile,
    variables: &'f [NcVariable],
}

impl Dataset<'_> {
    fn variable(&self, name: &str) -> Option<&NcVariable> {
        self.variables.iter().find(|variable| variable.name == name)
    }

    /// Returns true for files of SurfaceTopography, whose axes state sides.
    fn is_surface(&self) -> bool {
        let states_side = |dimension: &NcDimension| {
            self.variable(&dimension.name).is_some_and(|axis| axis.attribute("length").is_some())
        };
        self.variable("heights").is_some_and(|heights| heights.dimensions.iter().any(states_side))
    }

    /// Returns true if another variable names this one as the bounds of its cells.
    fn is_bounds(&self, name: &str) -> bool {
        let bounds = |of: &NcVariable| of.attribute("bounds")?.value.as_string();
        self.variables.iter().any(|of| bounds(of).as_deref() == Some(name))
    }

    /// Returns the type of the numbers of a variable, and their bytes in little-endian order.
    fn stored(&self, variable: &NcVariable) -> Result<(Element, Vec<u8>), FormatError> {
        Ok(match variable.dtype {
            NcType::Byte => (Element::I8, self.bytes(variable, i8::to_le_bytes)?),
            NcType::Short => (Element::I16, self.bytes(variable, i16::to_le_bytes)?),
            NcType::Int => (Element::I32, self.bytes(variable, i32::to_le_bytes)?),
            NcType::Float => (Element::F32, self.bytes(variable, f32::to_le_bytes)?),
            NcType::Double => (Element::F64, self.bytes(variable, f64::to_le_bytes)?),
            NcType::UByte => (Element::U8, self.bytes(variable, u8::to_le_bytes)?),
            NcType::UShort => (Element::U16, self.bytes(variable, u16::to_le_bytes)?),
            NcType::UInt => (Element::U32, self.bytes(variable, u32::to_le_bytes)?),
            NcType::Int64 => (Element::I64, self.bytes(variable, i64::to_le_bytes)?),
            NcType::UInt64 => (Element::U64, self.bytes(variable, u64::to_le_bytes)?),
            _ => return Err(FormatError::missing(format!("numbers of `{}`", variable.name))),
        })
    }

    fn bytes<T: NcReadable, const N: usize>(
        &self,
        variable: &NcVariable,
        bytes: fn(T) -> [u8; N],
    ) -> Result<Vec<u8>, FormatError> {
        let numbers = self.file.read_variable::<T>(&variable.name).map_err(damaged)?;
        Ok(numbers.into_iter().map(bytes).collect::<Vec<_>>().into_flattened())
    }

    fn numbers(&self, variable: &NcVariable) -> Result<Vec<f64>, FormatError> {
        let (element, bytes) = self.stored(variable)?;
        Ok(element.numbers(ByteOrder::Little, &bytes))
    }

    /// Returns the grid of a file of GMT 3.
    fn grid_of_gmt3(&self) -> Result<Option<Array>, FormatError> {
        let names = ["x_range", "y_range", "spacing", "dimension", "z"];
        let [Some(x), Some(y), Some(spacing), Some(dimension), Some(z)] =
            names.map(|name| self.variable(name))
        else {
            return Ok(None);
        };
        let pair = |variable: &NcVariable| -> Result<[f64; 2], FormatError> {
            let missing = |_| FormatError::missing(format!("two numbers of `{}`", variable.name));
            self.numbers(variable)?.try_into().map_err(missing)
        };
        let (steps, counts) = (pair(spacing)?, pair(dimension)?);
        let [nodes_x, nodes_y] = checked_nodes(counts.map(|count| count as i64))?;
        let axis = |of: &NcVariable, name: &str, step: f64| {
            let unit = attributes(of).unit()?.filter(|unit| *unit != Unit::parse(name));
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

    fn array(&self, variable: &NcVariable) -> Result<Array, FormatError> {
        let mut array = self.plain_array(variable)?;
        if variable.name == "heights" && self.is_surface() {
            let mask = self.variable("mask").map(|mask| self.plain_array(mask)).transpose()?;
            complete_heights(&mut array, mask)?;
        }
        Ok(array)
    }

    fn plain_array(&self, variable: &NcVariable) -> Result<Array, FormatError> {
        let (element, bytes) = self.stored(variable)?;
        let axes = variable.dimensions.iter().map(|dimension| {
            let is_axis = |axis: &&NcVariable| {
                axis.is_coordinate_variable_for(&dimension.name) && axis.dtype != NcType::Char
            };
            match self.variables.iter().find(is_axis) {
                Some(axis) => Axis::new(&dimension.name, &self.numbers(axis)?, &attributes(axis)),
                None => Ok(Axis::named(&dimension.name)),
            }
        });
        Ok(Array {
            axes: axes.collect::<Result<_, FormatError>>()?,
            attributes: attributes(variable),
            unwritten: default_fill(element),
            ..Array::new(&variable.name, &variable.shape(), element, ByteOrder::Little, bytes)
        })
    }
}

fn attributes(variable: &NcVariable) -> Attributes {
    let value = |attribute: &NcAttribute| match attribute.value.as_f64_vec() {
        Some(numbers) => Value::Numbers(numbers),
        None => Value::Texts(attribute.value.as_string().into_iter().collect()),
    };
    Attributes(variable.attributes.iter().map(|one| (one.name.clone(), value(one))).collect())
}
