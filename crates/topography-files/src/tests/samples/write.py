"""Writes the small Gwyddion, HDF5 and netCDF files that `samples.rs` includes.

    python3 write.py         in this folder, with gwyfile 0.3, h5py 3.16 and netCDF4 1.7

All files contain the map of `samples.rs`: heights [x, y] at three nodes along x and two along y.
Some have the earliest layout, which has no checksums, so that damage reaches the readers of all its
parts.
"""

import h5py
import netCDF4
import numpy as np
from gwyfile.objects import GwyContainer, GwyDataField, GwySIUnit

HEIGHTS = np.array([[1.0, 4.0], [2.0, 5.0], [3.0, 6.0]])
TEXT = h5py.string_dtype()


def plain():
    """A map in chunks, compressed, with the newest layout of the file."""
    with h5py.File("chunks.h5", "w", libver="latest") as file:
        file["profile"] = np.arange(3.0)
        filters = {"compression": "gzip", "shuffle": True, "fletcher32": True}
        file.create_dataset("surface", data=HEIGHTS.astype(">i8"), chunks=(2, 1), **filters)
    with h5py.File("nested.h5", "w", libver="earliest") as file:
        chunks = {"chunks": (3, 2), "compression": "lzf"}
        file.create_dataset("scan/heights", data=HEIGHTS.astype("i8"), **chunks)


def topostats():
    """An image as TopoStats stores it, in lines along x."""
    with h5py.File("topostats.h5", "w", libver="latest") as file:
        file["image"] = HEIGHTS.T
        file["pixel_to_nm_scaling"] = 1000.0


def datx():
    """The layout of Zygo's Mx. Converters are those of a test of SurfaceTopography."""
    numbers = h5py.vlen_dtype("f8")
    converter = np.dtype([("Category", TEXT), ("BaseUnit", TEXT), ("Parameters", numbers)])

    def write(name, surface, unit, scale, layout):
        with h5py.File(name, "w", libver=layout) as file:
            rows = HEIGHTS.T / scale
            rows[1, 2] = np.finfo("f8").max
            file[surface] = rows
            attributes = file[surface].attrs
            for axis, step in (("X", 1e-6), ("Y", 2e-6)):
                value = np.empty(1, converter)
                value[0] = ("LateralCat", "Pixels", np.array([0, step, 0, 0]))
                attributes[f"{axis} Converter"] = value
            attributes.create("Unit", [unit], dtype=TEXT)
            attributes["No Data"] = [np.finfo("f8").max]
            attributes["Wavelength"] = [600e-9]
            attributes["Interferometric Scale Factor"] = [0.5]
            attributes["Obliquity Factor"] = [1.0]

    measured = "Data/Surface/{01234567-89AB-CDEF-0123-456789ABCDEF}"
    write("nanometers.datx", measured, "NanoMeters", 1.0, "latest")
    write("fringes.datx", "Measurement/Surface", "Fringes", 300.0, "earliest")


def jpk():
    """Two frames of a fast scan, the second of zeros. The first line has the largest y."""
    with h5py.File("frames.h5-jpk", "w", libver="earliest") as file:
        scan = file.create_group("Measurement_000")
        for name, value in (("ilength", 3), ("jlength", 2), ("ulength", 3e-6), ("vlength", 4e-6)):
            scan.attrs[f"position-pattern.grid.{name}"] = value
        channel = scan.create_group("Channel_000")
        heights = (100 * HEIGHTS.T[::-1].ravel() - 50).astype("i4")
        channel["Height"] = np.stack([heights, np.zeros_like(heights)], axis=1)
        channel["thumbnail"] = np.zeros((1, 1), "i4")
        channel.attrs["channel.fancy-name"] = np.bytes_("Height (measured)")
        channel.attrs["retrace"] = np.bytes_("true")
        channel.attrs["net-encoder.scaling.multiplier"] = 1e-11
        channel.attrs["net-encoder.scaling.offset"] = 5e-10
        channel.attrs["net-encoder.scaling.unit.unit"] = np.bytes_("m")


def netcdf4():
    """The variables of `to_netcdf` of SurfaceTopography, and a packed map in lines along x."""
    for name, layout in (("surface.nc", "NETCDF4"), ("classic.nc", "NETCDF3_64BIT_OFFSET")):
        with netCDF4.Dataset(name, "w", format=layout) as file:
            for axis, nodes, side in (("x", 3, 3e3), ("y", 2, 4e3)):
                file.createDimension(axis, nodes)
                variable = file.createVariable(axis, "f8", (axis,))
                variable.length = side
                variable.periodic = 0
                variable.unit = "nm"
                variable[...] = np.arange(nodes) / nodes * side
            heights = file.createVariable("heights", "f8", ("x", "y"))
            heights[...] = HEIGHTS
            heights.unit = "nm"
            mask = file.createVariable("mask", "b", ("x", "y"))
            mask[...] = np.isin(HEIGHTS, 6.0)
    with h5py.File("transposed.nc", "w", libver="earliest") as file:
        for axis, nodes, side in (("x", 3, 3e3), ("y", 2, 4e3)):
            file[axis] = np.arange(nodes) / nodes * side
            file[axis].make_scale(axis)
            file[axis].attrs["length"] = side
            file[axis].attrs.create("unit", "nm", dtype=TEXT)
        packed = np.where(HEIGHTS.T == 6.0, -1, 2 * HEIGHTS.T - 2)
        heights = file.create_dataset("heights", data=packed.astype("i2"))
        for index, axis in enumerate("yx"):
            heights.dims[index].attach_scale(file[axis])
        attributes = {"scale_factor": 0.5, "add_offset": 1.0, "_FillValue": np.int16(-1)}
        heights.attrs.update(attributes)


def nhf():
    """A scan of Nanosurf Studio, version 2, whose last point was not measured."""
    with h5py.File("scan.nhf", "w", libver="earliest") as file:
        file.attrs["nsf_file_version_major"] = np.uint32(2)
        file.attrs["nsf_file_version_minor"] = np.uint32(0)
        scan = file.create_group("group_0000")
        scan.attrs["rect_axis_size"] = np.array([2, 3], "u4")
        scan.attrs["rect_axis_range"] = np.array([4e-6, 3e-6])
        forward = scan.create_group("subgroup_0000")
        forward.attrs["name"] = "Forward"
        heights = np.array([1, 2, 3, 4, 5, -32768], "i2")
        channel = forward.create_dataset("dataset_0000", data=heights)
        channel.attrs["signal_name"] = "Topography"
        channel.attrs["signal_calibration_min"] = -32767e-9
        channel.attrs["signal_calibration_max"] = 32767e-9
        channel.attrs["signal_calibration_unit"] = "Meter (m)"


def gwyddion():
    """A map of Gwyddion with a mask. The sign of a side does not count."""

    def field(rows):
        unit = GwySIUnit(unitstr="m")
        return GwyDataField(rows, xreal=3e-6, yreal=-4e-6, si_unit_xy=unit, si_unit_z=unit)

    container = GwyContainer({"/filename": "a", "/5/data/title": "Height", "/5/show": True})
    container["/5/select"] = np.array([1], "i4")
    container["/5/data"] = field(1e-9 * HEIGHTS.T)
    container["/5/mask"] = field(np.isin(HEIGHTS.T, 6.0).astype("f8"))
    container.tofile("masked.gwy")


plain()
topostats()
datx()
jpk()
netcdf4()
nhf()
gwyddion()
