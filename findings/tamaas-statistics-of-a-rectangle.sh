#!/usr/bin/env bash
# Tamaas 2.9.0 takes every map for one of 1 × 1: slopes of a rectangular map have no single correction.
#
# Guess: Statistics2D has no argument for the sides, so that slope, full-contact pressure and energy are
# those of a unit cell, and dividing by the side makes them right.
# Seen on 2026-11-29 (128 × 64 square cells, sides 2 and 1, isotropic with an rms slope of 0.5): the slope
# is 0.789, and the pressure for full contact 1.71 times the true one. Each side is taken for 1, so
# that slopes along the long side are twice as steep. Right are maps with equal sides, after division.
# Loads are stated in E* × rms slope. On strips, which are usual for measured maps, the reduced
# load is then 37 % too small, and the grain of an isotropic surface is 2:1.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check tamaas==2.9.0 numpy==2.4.6
seen=$("$folder/python/bin/python" - <<'PYTHON'
import numpy
from tamaas import Statistics2D

shape, sides = (128, 64), (2.0, 1.0)
kx, ky = (numpy.fft.fftfreq(n, side / n) for n, side in zip(shape, sides))
q = 2 * numpy.pi * numpy.hypot(kx[:, None], ky[None, :])
band = (q > 2 * numpy.pi * 3.9) & (q < 2 * numpy.pi * 16.1)
amplitude = numpy.where(band, numpy.where(band, q, 1.0) ** -1.8, 0.0)
noise = numpy.random.default_rng(1).standard_normal(shape)
spectrum = numpy.fft.fft2(noise) * amplitude
spectrum *= 0.5 / numpy.sqrt((q**2 * abs(spectrum / noise.size) ** 2).sum())
heights = numpy.ascontiguousarray(numpy.fft.ifft2(spectrum).real)
# In full contact, E* = 1, the pressure of a wave is q h/2. It is mean + p, and nowhere negative.
full = -numpy.fft.ifft2(spectrum * q / 2).real.min()
slope = Statistics2D.computeSpectralRMSSlope(heights)
pressure = Statistics2D.computeFullContactPressure(heights)
print(f"slope {slope:.3f} for 0.500, full contact {pressure / full:.2f}")
PYTHON
)
echo "$seen"
test "$seen" = "slope 0.789 for 0.500, full contact 1.71"
