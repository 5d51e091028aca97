#!/usr/bin/env bash
# KLA Zeta files (.zmg): surfalize 0.19.2 reads the heights as signed 16-bit integers,
# SurfaceTopography 1.27.1 as unsigned ones: heights above count 32767 differ by 65536 counts.
#
# Guess: one file, one map; both know the header, its steps and its scale.
# Seen on 2026-11-29: heights of 31.0 µm to 33.5 µm are -32.5 µm to 32.5 µm in surfalize, an rms
# height of 30 µm in place of 0.9 µm. SurfaceTopography follows Gwyddion, as a comment in its source
# says.
#
# Both agree in the lower half of the range. Above it the highest summits become the deepest pits,
# which looks like a scan with holes, and a contact has lost the points that carry.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check \
    surfalize==0.19.2 SurfaceTopography==1.27.1 numpy==2.4.6
seen=$("$folder/python/bin/python" - "$folder/map.zmg" <<'PYTHON'
import struct
import sys

import numpy as np
from surfalize import Surface
from SurfaceTopography import open_topography

counts = np.array([[31000, 32000, 33000], [31500, 32500, 33500]], "<u2")
header = b"Zeta-Instruments" + bytes(69)
header += struct.pack("<II4xfff8xI84x", 3, 2, 0.5, 0.5, 0.001, 0)
with open(sys.argv[1], "wb") as file:
    file.write(header + counts.tobytes())

for heights in (
    Surface.load(sys.argv[1]).data,
    open_topography(sys.argv[1]).topography().heights(),
):
    print(heights.size, f"{heights.min():.2f} {heights.max():.2f} {heights.std():.2f}")
PYTHON
)
echo "$seen"
test "$seen" = "6 -32.54 32.50 30.19
6 31.00 33.50 0.85"
