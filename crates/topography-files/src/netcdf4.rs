//! NetCDF-4 files as `to_netcdf` of SurfaceTopography writes them. The container is HDF5; variables
//! and attributes are those of the classic format (see [`netcdf`](super::netcdf)).
//!
//! The attribute `DIMENSION_LIST` of a variable refers to the datasets that stand for its
//! dimensions. A file without `heights` whose dimensions are `x` and `y` is read as plain HDF5.

use hdf5_reader::group::Group;
use hdf5_reader::{Attribute, Dataset};

use super::channel::Channel;
use super::hdf5::{Container, Lines, attribute, number, text};
use super::netcdf::{Axis, Surface, unpacked};
use super::raster::{Missing, Raster};
use super::{Format, FormatError};

pub const FORMAT: Format = Format {
    name: "netcdf4",
    title: "netCDF-4 of SurfaceTopography",
    version: 1,
    has_signature: true,
    read,
};

/// Numbers that netCDF-4 stores where none were written, unless the variable names another.
const UNWRITTEN: f64 = 9.969_209_968_386_869e36;

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let container = Container::of_format(bytes)?;
    let root = container.root().map_err(|_| FormatError::Signature)?;
    let dataset = |name| root.dataset(name).ok();
    let variable = dataset("heights").ok_or(FormatError::Signature)?;
    let attributes = variable.attributes();
    let lines = lines(&root, &variable).ok_or(FormatError::Signature)?;
    let heights = container.raster(&variable, lines)?.missing(Missing::Value(UNWRITTEN));
    let mask = dataset("mask").map(|mask| self::mask(&container, &root, &mask)).transpose()?;
    let surface = Surface {
        heights: unpacked(heights, |name| number(&attributes, name))?,
        unit: text(&attributes, "unit"),
        mask,
        axes: ["x", "y"]
            .map(|name| dataset(name).map(|axis| self::axis(&axis)).unwrap_or_default()),
    };
    Ok(vec![surface.channel()?])
}

fn mask(
    container: &Container,
    root: &Group,
    mask: &Dataset,
) -> Result<Raster<'static>, FormatError> {
    let lines = lines(root, mask);
    let lines = lines.ok_or_else(|| FormatError::missing("dimensions x and y of mask"))?;
    container.raster(mask, lines)
}

fn axis(axis: &Dataset) -> Axis {
    let attributes = axis.attributes();
    Axis { length: number(&attributes, "length"), unit: text(&attributes, "unit") }
}

/// Returns the direction of the lines of a variable, or `None` unless its dimensions are x and y.
fn lines(root: &Group, variable: &Dataset) -> Option<Lines> {
    let attributes = variable.attributes();
    let list = attribute(&attributes, "DIMENSION_LIST")?;
    let [first, second] = [0, 1].map(|index| dimension(variable, list, index));
    let (first, second) = (first?, second?);
    let [x, y] = ["x", "y"].map(|name| root.dataset(name).ok().map(|axis| axis.address()));
    let (x, y) = (x?, y?);
    if (first, second) == (x, y) {
        Some(Lines::AlongY)
    } else if (first, second) == (y, x) {
        Some(Lines::AlongX)
    } else {
        None
    }
}

/// Returns the address of the dataset of a dimension. The list has one reference of variable length
/// for each dimension, which points to the address.
fn dimension(variable: &Dataset, list: &Attribute, index: usize) -> Option<u64> {
    let size = variable.vlen_reference_size();
    let reference = list.raw_data.get(index * size..(index + 1) * size)?;
    let address = variable.resolve_vlen_reference_bytes(reference, size_of::<u64>()).ok()?;
    address.first_chunk().map(|bytes| u64::from_le_bytes(*bytes))
}
