#!/usr/bin/env bash
# SurfaceTopography 1.27.1 gives moments of a container that are not those of the one map in it.
#
# Guess: ciso_moment(order=0) and (order=2) of a container with one isotropic map are its mean square height
# and mean square gradient, as moment_power_spectrum of the map is.
# Seen on 2026-11-29 (512 × 512 points, waves of 64 to 8 points, H = 0.2, 0.5, 0.8): 1.47 to 1.50 times the
# mean square height, 0.79 to 0.80 times the mean square gradient, and 0.59 for order 4, whatever H is. Order
# 1 is right. A container has spectra of profiles; times π/q they stand in for the areal one, which the help
# says to be off by π/2, π/4 and 3π/16.
# Moments of containers exist to join scans of several sizes. The rms slope comes out 11 % too
# small, so that loads in E* × rms slope are 12 % too large, and Nayak's m0 m4/m2² is 1.4 times too large.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check SurfaceTopography==1.27.1 numpy==2.4.6
seen=$("$folder/python/bin/python" - <<'PYTHON'
import numpy
from SurfaceTopography import Topography
from SurfaceTopography.Container.SurfaceContainer import InMemorySurfaceContainer

n = 512
k = numpy.fft.fftfreq(n, 1 / n)
k = numpy.hypot(k[:, None], k[None, :])
noise = numpy.fft.fft2(numpy.random.default_rng(1).standard_normal((n, n)))
for hurst in (0.2, 0.5, 0.8):
    amplitude = numpy.where((k >= 8) & (k <= 64), numpy.maximum(k, 1.0) ** -(1 + hurst), 0.0)
    heights = numpy.fft.ifft2(noise * amplitude).real
    topography = Topography(heights, (1.0, 1.0), periodic=True, unit="um")
    container = InMemorySurfaceContainer([topography])
    ratios = []
    for order in (0, 1, 2, 4):
        joined = container.ciso_moment(order=order, unit="um", nb_points_per_decade=100)
        ratios.append(joined / topography.moment_power_spectrum(order))
    print(*(f"{ratio:.2f}" for ratio in ratios))
PYTHON
)
echo "$seen"
test "$seen" = "1.50 1.01 0.79 0.59
1.49 1.02 0.79 0.59
1.47 1.02 0.80 0.59"
