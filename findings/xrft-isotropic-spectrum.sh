#!/usr/bin/env bash
# xrft 1.0.1: `isotropic_power_spectrum` is the mean of the spectrum over the directions times the
# frequency.
#
# Guess: the mean over the directions, with the exponent -2 - 2 H of the areal spectrum, or 2 pi f
# times it, whose integral is the variance.
# Seen on 2026-11-29: a self-affine map with H = 0.8 and variance 1. The exponent is -2.63 in place
# of -3.6, and the integral over the frequencies 0.187: 1/(2 pi), but for wide bins at long waves.
# `power_spectrum`, without directions, adds up to 1. The docstring has the factor in its formula,
# the name of the function has not.
#
# Spectra are read for H, for slopes and to generate surfaces. Taken as the areal density, the curve
# gives H = 0.32 and far too much slope; taken as variance per frequency, it gives an rms height of
# 0.43.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check \
    xrft==1.0.1 xarray==2026.9.0 numpy==2.4.6 scipy==1.17.1 numpy_groupies==0.16.0
seen=$("$folder/python/bin/python" - <<'PYTHON'
import warnings

warnings.simplefilter("ignore")

import numpy as np
import xarray as xr
import xrft

nodes = 512
frequency = np.fft.fftfreq(nodes, 1 / nodes)
radius = np.hypot(frequency[:, None], frequency[None])
radius[0, 0] = np.inf
noise = np.fft.fft2(np.random.default_rng(1).normal(size=(nodes, nodes)))
heights = np.fft.ifft2(noise * radius**-1.8).real
heights /= heights.std()
position = np.arange(nodes) / nodes
surface = xr.DataArray(heights, dims=("y", "x"), coords={"y": position, "x": position})

total = xrft.power_spectrum(surface, dim=["y", "x"])
print("sum over waves", f"{float(total.sum()):.3f}")
radial = xrft.isotropic_power_spectrum(surface, dim=["y", "x"], truncate=False)
step = float(radial.freq_r[1] - radial.freq_r[0])
print("integral", f"{float(radial.sum()) * step:.3f}")
window = radial.sel(freq_r=slice(16, 128))
slope = np.polyfit(np.log(window.freq_r), np.log(window), 1)[0]
print("exponent", f"{slope:.2f}", "H of an areal spectrum", f"{-slope / 2 - 1:.2f}")
PYTHON
)
echo "$seen"
test "$seen" = "sum over waves 1.000
integral 0.187
exponent -2.63 H of an areal spectrum 0.32"
