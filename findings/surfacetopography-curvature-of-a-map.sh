#!/usr/bin/env bash
# SurfaceTopography 1.27.1 finds too small a scale-dependent curvature on maps, or none if they are smooth.
#
# Guess: on an isotropic periodic map, scale_dependent_curvature_from_area agrees with the function of the
# same name for profiles, as the two slopes do. Smoother maps give better values.
# Seen on 2026-11-29 (256 × 256 points, H = 0.8, waves of 64 points down to 16, 8 and 2): the map with waves
# down to 16 points has no result. Down to 8 points, the curvatures over 2, 2.8 and 4.3 points are 0.63, 0.80
# and 0.99 of those of profiles, and down to 2 points 1.00, 0.94 and 0.97. They are small differences of an
# autocorrelation that is averaged in wide bins and interpolated by straight lines; the first negative one
# ends the list.
# This curvature sets the radii of summits and whether a scan resolved them. Well sampled and
# low-pass filtered maps seem to have blunter summits, or have no result.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check SurfaceTopography==1.27.1 numpy==2.4.6
seen=$("$folder/python/bin/python" - <<'PYTHON'
import numpy
from SurfaceTopography import Topography

n = 256
k = numpy.fft.fftfreq(n, 1 / n)
k = numpy.hypot(k[:, None], k[None, :])
noise = numpy.fft.fft2(numpy.random.default_rng(1).standard_normal((n, n)))
for shortest in (16, 32, 128):
    amplitude = numpy.where((k >= 4) & (k <= shortest), numpy.maximum(k, 1.0) ** -1.8, 0.0)
    heights = numpy.fft.ifft2(noise * amplitude).real
    topography = Topography(heights, (1.0, 1.0), periodic=True)
    scale, area = topography.scale_dependent_curvature_from_area()
    exact_scale, exact = topography.scale_dependent_curvature_from_profile(resampling_method=None)
    ratio = area / numpy.interp(scale, exact_scale, exact)
    print(n // shortest, len(area), *(f"{value:.2f}" for value in ratio[:3]))
PYTHON
)
echo "$seen"
test "$seen" = "16 0
8 12 0.63 0.80 0.99
2 12 1.00 0.94 0.97"
