//! NetCDF-4 files, as netCDF4, xarray and `to_netcdf` of SurfaceTopography write them. The
//! container is HDF5; variables and attributes are those of the classic format (see
//! [`netcdf`](super::netcdf)).
//!
//! A file is recognized by the attribute `_NCProperties` of its root group, which netCDF 4.4.1
//! (2016) and later write, or by the attributes of dimensions. Its maps are read as those of other
//! [`hdf5`](super::hdf5) files.

use hdf5_reader::Dataset;

use super::channel::Channel;
use super::hdf5::{Container, maps};
use super::labelled::{AXES, CONVENTIONS, DEGREES};
use super::{Format, FormatError};

pub(crate) const FORMAT: Format =
    Format::new("netcdf4", "netCDF-4", read).changed(&[CONVENTIONS, DEGREES, AXES]);

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let container = Container::of_format(bytes)?;
    let root = container.root().map_err(|_| FormatError::Signature)?;
    let attributes = container.group_attributes(&root).map_err(|_| FormatError::Signature)?;
    let members = container.members(&root, "the root group").map_err(|_| FormatError::Signature)?;
    let is_variable = |dataset: &Dataset| {
        ["_Netcdf4Dimid", "DIMENSION_LIST"].iter().any(|name| dataset.attribute(name).is_ok())
    };
    if attributes.get("_NCProperties").is_none() && !members.datasets.iter().any(is_variable) {
        return Err(FormatError::Signature);
    }
    maps(&container, &root, members)
}
