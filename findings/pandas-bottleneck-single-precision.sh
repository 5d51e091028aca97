#!/usr/bin/env bash
# pandas 3.1.1: the standard deviation of 2048 x 2048 heights in single precision is 20.4 in place
# of 1.0 as soon as the package bottleneck 1.6.0 is installed.
#
# Guess: an optional accelerator changes the last digits at most.
# Seen on 2026-11-29: heights of 1000 +- 1 nm. `std()` is 0.99980 without bottleneck and 20.37250
# with it, as it is in `describe()` and `agg`. `mean()` is right, and so is `std()` behind
# `groupby`. bottleneck sums the squares one after the other in single precision.
#
# Instruments store 32-bit floats, with the distance to the stage in them. The same script gives two
# values of the rms height on two computers, depending on a package that xarray or another program
# brought along. Convert to 64-bit floats, or set `pandas.options.compute.use_bottleneck = False`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
cat > "$folder/heights.py" <<'PYTHON'
import numpy as np
import pandas as pd

noise = np.random.default_rng(0).normal(size=2048**2)
heights = pd.Series((1000 + noise).astype("float32"))
print(f"{heights.mean():.3f} {heights.std():.5f} {heights.groupby(heights > 0).std().iloc[0]:.5f}")
PYTHON
"$folder/python/bin/pip" install --quiet --disable-pip-version-check pandas==3.1.1 numpy==2.4.6
without=$("$folder/python/bin/python" "$folder/heights.py")
"$folder/python/bin/pip" install --quiet --disable-pip-version-check bottleneck==1.6.0
with=$("$folder/python/bin/python" "$folder/heights.py")
echo "without bottleneck: $without"
echo "with bottleneck: $with"
test "$without" = "1000.000 0.99980 0.99980"
test "$with" = "1000.000 20.37250 0.99980"
