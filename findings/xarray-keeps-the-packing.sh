#!/usr/bin/env bash
# xarray 2026.9.0: a packed map that is lifted in place and saved has its highest points as deep
# pits.
#
# Guess: after a change the map is saved as floating-point numbers, or a height that no longer fits
# into the 16-bit integers of the source is refused.
# Seen on 2026-11-29: six heights of -2 to 3 µm, packed with a step of 0.1 nm as an instrument does.
# After `dataset["h"] += 1` and `to_netcdf`, the point at 4 µm is read back as -2.55 µm, without a
# warning. With `dataset["h"] = dataset["h"] + 1` it is 4 µm. The engines netCDF4 and h5netcdf
# write the same wrong integer.
#
# Whether the packing of the source is kept depends on how the line is written. The operations are
# those of every evaluation: another zero, another unit, the form added back. The first points to
# touch are lost.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check \
    xarray==2026.9.0 netCDF4==1.7.5.1.post1 h5netcdf==1.8.1 h5py==3.16.0 numpy==2.4.6
seen=$("$folder/python/bin/python" -W error - "$folder" <<'PYTHON'
import sys

import netCDF4
import xarray as xr

source, target = f"{sys.argv[1]}/source.nc", f"{sys.argv[1]}/target.nc"
with netCDF4.Dataset(source, "w") as file:
    file.createDimension("x", 6)
    packed = file.createVariable("h", "i2", ("x",), fill_value=-32768)
    packed.scale_factor = 1e-4
    packed[:] = [-2.0, -1.0, 0.0, 1.0, 2.0, 3.0]

for engine in "netcdf4", "h5netcdf":
    dataset = xr.load_dataset(source)
    dataset["h"] += 1
    dataset.to_netcdf(target, engine=engine)
    print("in place", xr.load_dataset(target)["h"].values.round(4).tolist())
dataset = xr.load_dataset(source)
dataset["h"] = dataset["h"] + 1
dataset.to_netcdf(target)
print("as a new array", xr.load_dataset(target)["h"].values.round(4).tolist())
PYTHON
)
echo "$seen"
test "$seen" = "in place [-1.0, 0.0, 1.0, 2.0, 3.0, -2.5536]
in place [-1.0, 0.0, 1.0, 2.0, 3.0, -2.5536]
as a new array [-1.0, 0.0, 1.0, 2.0, 3.0, 4.0]"
