#!/usr/bin/env bash
# SurfaceTopography 1.27.1 leaves out the lines of a text map that contain `NA`, and stretches the
# others over the sides of the whole map.
#
# Guess: the point is missing, or the file is refused, as `nan` is a missing point.
# Seen on 2026-11-29: a map of 7 × 5 points with `NA` in two lines has 7 × 3 points and no missing
# one, on the sides 3 µm × 2 µm of the header. The steps along y grow from 0.4 µm to 0.67 µm, and so
# all slopes fall.
#
# asperity reads 7 × 5 points, two of them missing.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check SurfaceTopography==1.27.1
cat > "$folder/map.txt" <<'MAP'
# Channel: Height
# Width: 3 µm
# Height: 2 µm
# Value units: nm
34.6 82.2 33 -130.3 90.5 44.6 -53.7
58.1 36.5 NA 2.8 54.7 -73.6 -16.3
-48.2 59.9 4 -29.2 -78.2 -25.7 0.8
-27.6 129.4 100.7 NA -188.9 -17.5 -42.2
21.4 21.7 211.8 -111.2 -37.8 204.3 64.7
MAP
seen=$("$folder/python/bin/python" - "$folder/map.txt" <<'PYTHON'
import sys

from SurfaceTopography import open_topography

topography = open_topography(sys.argv[1]).topography()
sides = [round(float(side), 6) for side in topography.physical_sizes]
print(tuple(topography.nb_grid_pts), sides, topography.unit, topography.has_undefined_data)
PYTHON
)
echo "$seen"
test "$seen" = "(7, 3) [3000.0, 2000.0] nm False"
