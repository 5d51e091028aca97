#!/usr/bin/env bash
# slippy 0.5.2: the low-pass filter before the search for summits is no low pass, the density of
# summits is not per area, and a flat map has a negative developed area.
#
# Guess: waves longer than the cutoff stay; Sds is in 1/area and needs the grid spacing; Sdr of a
# plane is 0.
# Seen on 2026-11-29, 64 x 64 points, spacing 1: with a cutoff frequency of 0.25 a wave of 32 points
# comes out with 0.03 of its amplitude, a wave of 4 points with 0.19. Sds is the share of points
# that are summits: 0.0061 for a spacing of 1 and of 0.5, which has four times as many summits per
# area. Sdr of a plane is -0.032, as 63 x 63 cells are compared with an area of 64 x 64; the cosine
# of this script has 0.0052 in place of 0.037.
#
# Asperity models of contact, wear and friction take the density and the curvature of the summits.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check \
    numpy==1.26.4 scipy==1.13.1 numba==0.61.2 matplotlib==3.9.4 tinydb==4.9.0 dill==0.4.1
# slippy asks for an older NumPy than Python 3.11 has.
"$folder/python/bin/pip" install --quiet --disable-pip-version-check --no-deps slippy==0.5.2
seen=$("$folder/python/bin/python" - 2> "$folder/warnings" <<'PYTHON'
import numpy as np
from slippy.surface import roughness
from slippy.surface.roughness_funcs import low_pass_filter

x = np.arange(64.0)
middle = np.s_[16:48, 16:48]
for points in 32, 4:
    wave = np.tile(np.cos(2 * np.pi * x / points), (64, 1)).T
    left = low_pass_filter(wave, 0.25, 1.0)[middle].std() / wave[middle].std()
    print("wave of", points, "points:", f"{left:.2f}")
bumps = np.outer(np.cos(2 * np.pi * x / 16), np.cos(2 * np.pi * x / 16))
print("Sds", *(f"{roughness(bumps, 'sds', grid_spacing=step):.4f}" for step in (1.0, 0.5)))
print("Sdr", *(f"{roughness(map_, 'sdr', grid_spacing=1.0):.4f}" for map_ in (0 * bumps, bumps)))
PYTHON
)
echo "$seen"
test "$seen" = "wave of 32 points: 0.03
wave of 4 points: 0.19
Sds 0.0061 0.0061
Sdr -0.0320 0.0052"
