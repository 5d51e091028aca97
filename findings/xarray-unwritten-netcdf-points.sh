#!/usr/bin/env bash
# xarray 2026.9.0: points of a netCDF file that were never written are heights of 1e37.
#
# Guess: NaN, since netCDF fills a variable with a number that stands for "not written", and
# netCDF4-python masks the points.
# Seen on 2026-11-29: a map of 4 lines, two of them measured. netCDF4-python: 6 of 12 points masked,
# mean 2. xarray: no point missing, mean 5e36. 16-bit heights become -32767 with a mean of -16382.5.
# xarray looks for a fill value in the attributes of the variable, and the standard one stands there
# only if the writer names it. In the same way it reads heights outside the attribute `valid_range`,
# which netCDF4-python masks.
#
# A scan that was stopped has such lines. With floats the mean gives it away; with integers the
# lines are a step of a few micrometres once the scale is applied. asperity reads 6 points as
# missing, in both cases.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check \
    xarray==2026.9.0 netCDF4==1.7.5.1.post1 numpy==2.4.6
seen=$("$folder/python/bin/python" - "$folder/scan.nc" <<'PYTHON'
import sys

import netCDF4
import numpy as np
import xarray as xr

lines = [[1, 2, 3], [1, 2, 3]]
with netCDF4.Dataset(sys.argv[1], "w") as file:
    file.createDimension("y", 4)
    file.createDimension("x", 3)
    for name, kind in ("float", "f8"), ("integer", "i2"):
        file.createVariable(name, kind, ("y", "x"))[:2] = lines
    ranged = file.createVariable("ranged", "f8", ("y", "x"))
    ranged.valid_range = [0.0, 2.5]
    ranged[:] = lines + lines

with netCDF4.Dataset(sys.argv[1]) as file, xr.open_dataset(sys.argv[1]) as dataset:
    for name in "float", "integer", "ranged":
        masked, heights = file[name][:], dataset[name]
        missing = int(np.isnan(heights.values.astype(float)).sum())
        mean = f"{float(heights.mean()):.6g}"
        print(name, np.ma.count_masked(masked), masked.mean(), missing, mean)
PYTHON
)
echo "$seen"
test "$seen" = "float 6 2.0 0 4.9846e+36
integer 6 2.0 0 -16382.5
ranged 4 1.5 0 2"
