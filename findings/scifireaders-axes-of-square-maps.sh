#!/usr/bin/env bash
# SciFiReaders 0.12.7: in a square Gwyddion file (.gwy) the axes x and y have each other's names, in
# a rectangular one they do not. The step is that of n - 1 pixels along a side of n.
#
# Guess: the fast axis of the file is x, whatever the shape.
# Seen on 2026-11-29: a wave of 16 µm along x, 64 µm x 64 µm with steps of 1 µm: the rms slope is
# 0.00000 along the axis named x and 0.02673 along y. With 64 x 32 points of the same map it is
# 0.02673 along x. The true slope is 0.02716, since the step is 1.016 µm in place of 1 µm.
#
# The direction of a ground surface, of sliding and of leakage is turned by 90 degrees by the choice
# of a square scan, the usual one, and back again by a crop.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check \
    SciFiReaders==0.12.7 sidpy==0.12.9 gwyfile==0.3.0 numpy==2.4.6
cat > "$folder/slopes.py" <<'PYTHON'
import sys
import warnings

warnings.simplefilter("ignore")

import numpy as np
from gwyfile.objects import GwyContainer, GwyDataField, GwySIUnit
from SciFiReaders import GwyddionReader

for lines in 64, 32:
    heights = np.tile(1e-7 * np.cos(2 * np.pi * (np.arange(64) + 0.5) / 16), (lines, 1))
    metre = GwySIUnit(unitstr="m")
    container = GwyContainer()
    container["/0/data/title"] = "Height"
    container["/0/data"] = GwyDataField(
        heights, xreal=64e-6, yreal=lines * 1e-6, si_unit_xy=metre, si_unit_z=metre
    )
    container.tofile(sys.argv[1])
    dataset = GwyddionReader(sys.argv[1]).read()[0]
    for index, axis in dataset._axes.items():
        slope = np.std(np.gradient(np.array(dataset), axis.values, axis=index))
        print("slope", lines, axis.name, f"{slope:.5f}")
PYTHON
seen=$("$folder/python/bin/python" "$folder/slopes.py" "$folder/map.gwy" 2> "$folder/warnings" |
    grep ^slope)
echo "$seen"
test "$seen" = "slope 64 x 0.00000
slope 64 y 0.02673
slope 32 y 0.00000
slope 32 x 0.02673"
