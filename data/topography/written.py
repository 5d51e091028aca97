"""Writes the HDF5 files of this folder and their rows of `truth.csv`.

    python3 written.py >> truth.csv

in this folder. Needs SurfaceTopography 1.27.1, h5py 3.16 and netCDF4 1.7.5. Maps are parts of other
files of the folder.
"""

import csv
import pathlib
import sys
import tempfile

import h5py
import netCDF4
import numpy as np
from SurfaceTopography import Topography, open_topography
from SurfaceTopography.IO import DATXReader

TEXT = h5py.string_dtype()


def row(file, channel, heights, sides, by):
    """Writes a row of `truth.csv`; heights and sides are in metres, or have no unit."""
    heights = np.ma.filled(np.ma.asarray(heights, "f8"), np.nan)
    missing = np.isnan(heights).sum()
    corners = [heights[0, 0], heights[-1, 0], heights[0, -1], heights[-1, -1]]
    cells = [*sides, missing, np.nanstd(heights), np.nanmin(heights), np.nanmax(heights), *corners]
    cells = ["" if np.isnan(cell) else float(cell) for cell in cells]
    cells[2] = int(missing)
    csv.writer(sys.stdout).writerow([file, channel, *heights.shape, *cells, by])


def hdf5():
    """Two maps without unit and size, one in chunks and compressed, the other in one piece."""
    first = open_topography("di-3.di").topography().heights()[:64, :48]
    second = open_topography("matrix-4.txt").topography().heights()[:80, :60]
    with h5py.File("h5-1.h5", "w") as file:
        filters = {"compression": "gzip", "shuffle": True, "fletcher32": True}
        file.create_dataset("dataset1", data=first, chunks=(30, 20), **filters)
        file["dataset2"] = second.astype(">f4")
    reader = open_topography("h5-1.h5")
    for index, channel in enumerate(reader.channels):
        heights = reader.topography(channel_index=index, physical_sizes=(1, 1)).heights()
        row("h5-1.h5", channel.name, heights, [np.nan, np.nan], "SurfaceTopography 1.27.1")


def copy(classic, path):
    """Copies a netCDF file to netCDF-4, with compressed variables."""
    with netCDF4.Dataset(classic) as old, netCDF4.Dataset(path, "w", format="NETCDF4") as new:
        old.set_auto_maskandscale(False)
        new.setncatts({name: old.getncattr(name) for name in old.ncattrs()})
        for name, dimension in old.dimensions.items():
            new.createDimension(name, dimension.size)
        for name, variable in old.variables.items():
            copied = new.createVariable(name, variable.dtype, variable.dimensions, zlib=True)
            copied.set_auto_maskandscale(False)
            # SciPy writes an empty fill value, which netCDF-4 does not allow.
            names = [name for name in variable.ncattrs() if name != "_FillValue"]
            copied.setncatts({name: variable.getncattr(name) for name in names})
            copied[...] = variable[...]


def netcdf4():
    """A map with missing points that `to_netcdf` wrote, converted to netCDF-4 as `nccopy` does."""
    whole = open_topography("frt-2.frt").topography()
    part = Topography(whole.heights()[40:100, 60:140], (0.012, 0.016), unit="m", periodic=False)
    with tempfile.TemporaryDirectory() as folder:
        classic = pathlib.Path(folder) / "classic.nc"
        part.to_netcdf(classic)
        copy(classic, "netcdf4-1.nc")
    with netCDF4.Dataset("netcdf4-1.nc") as file:
        heights = np.ma.masked_where(file["mask"][...] != 0, file["heights"][...])
        sides = [file[axis].length for axis in "xy"]
    row("netcdf4-1.nc", "heights", heights, sides, "netCDF4 1.7.5")


def datx():
    """A map in the layout of Zygo's Mx; the attributes are those of a test of SurfaceTopography."""
    heights = open_topography("matrix-4.txt").topography().to_unit("nm").heights()
    heights = heights[:60, :80].astype("f4")
    heights[[0, 7], [79, 20]] = marker = np.finfo("f4").max
    numbers = h5py.vlen_dtype("f8")
    converter = np.dtype([("Category", TEXT), ("BaseUnit", TEXT), ("Parameters", numbers)])
    path = "Data/Surface/{5C0B1F7A-3C5E-4E0B-9D0B-6E4C1C5A7B11}"
    with h5py.File("datx-1.datx", "w") as file:
        links = [("Root", "Measurement", "{M}"), ("{M}", "Surface", "{S}")]
        links.append(("{S}", "Path", f"/{path}"))
        columns = [("Source", TEXT), ("Link", TEXT), ("Destination", TEXT)]
        file["MetaData"] = np.array(links, columns)
        surface = file.create_dataset(path, data=heights.T, chunks=(32, 32), compression="gzip")
        converters = {
            "X": ("LateralCat", "Pixels", [0, 3e-7, 0, 0]),
            "Y": ("LateralCat", "Pixels", [0, 4e-7, 0, 0]),
            "Z": ("HeightCat", "NanoMeters", [0, 6e-7, 0.5, 1]),
        }
        for axis, (category, unit, parameters) in converters.items():
            value = np.empty(1, converter)
            value[0] = (category, unit, np.array(parameters))
            surface.attrs[f"{axis} Converter"] = value
        surface.attrs.create("Unit", ["NanoMeters"], dtype=TEXT)
        surface.attrs["No Data"] = [np.float64(marker)]
    surface = DATXReader("datx-1.datx").topography()
    sides = [1e-9 * side for side in surface.physical_sizes]
    row("datx-1.datx", "surface", surface.heights() / 1e9, sides, "SurfaceTopography 1.27.1")


hdf5()
netcdf4()
datx()
