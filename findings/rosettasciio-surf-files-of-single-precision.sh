#!/usr/bin/env bash
# RosettaSciIO 0.15.0 (HyperSpy 2.5.0): in a Digital Surf file (.sur) written from heights in single
# precision, the highest summit is the deepest pit.
#
# Guess: heights are rounded to the 32-bit integers of the format, whether they had 32 or 64 bits
# before.
# Seen on 2026-11-29 (x86-64): a map of 48 x 32 points from -3.90 µm to 3.07 µm. From 32-bit floats
# the point at 3.07 µm comes back at -3.90 µm, all others within 1e-5 µm; from 64-bit floats all do.
# NumPy warns of an "invalid value encountered in cast". RosettaSciIO's own reader and surfalize
# 0.19.2 read the same heights.
#
# Microscopes and most programs give 32-bit floats. The summit that is lost is the first one that
# touches, and the range of the heights stays almost what it was.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check \
    hyperspy==2.5.0 rosettasciio==0.15.0 surfalize==0.19.2 numpy==2.4.6
seen=$("$folder/python/bin/python" - "$folder" <<'PYTHON'
import logging
import sys
import warnings

logging.disable(logging.CRITICAL)
warnings.simplefilter("ignore")

import hyperspy.api as hs
import numpy as np
from surfalize import Surface

heights = np.random.default_rng(0).normal(size=(32, 48))
for precision in "float64", "float32":
    signal = hs.signals.Signal2D(heights.astype(precision))
    for axis, name in zip(signal.axes_manager.signal_axes, "xy"):
        axis.name, axis.scale, axis.units = name, 0.5, "µm"
    signal.metadata.set_item("Signal.quantity", "Height (µm)")
    path = f"{sys.argv[1]}/{precision}.sur"
    signal.save(path)
    summit = np.unravel_index(heights.argmax(), heights.shape)
    for back in hs.load(path).data, Surface.load(path).data:
        offset = np.median(back - heights)
        wrong = np.sum(abs(back - heights - offset) > 1e-5)
        print(precision, wrong, f"{heights.max():.2f} {back[summit] - offset:.2f}")
PYTHON
)
echo "$seen"
test "$seen" = "float64 0 3.07 3.07
float64 0 3.07 3.07
float32 1 3.07 -3.90
float32 1 3.07 -3.90"
