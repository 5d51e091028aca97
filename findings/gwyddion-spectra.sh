#!/usr/bin/env bash
# The spectra of Gwyddion 2.62 have two norms: half of the mean square height for lines, all of it for rings.
#
# Guess: both spectra, which stand in one list and have one axis from the first wave up, add up to the mean
# square height (of lines, and of the map). Without a window, a periodic map has the waves that it has.
# Seen on 2026-11-29 (128 × 128 points, isotropic waves of 32 to 4 points, libgwyprocess 2.62, no window):
# sum times step of the angular wavenumber is 0.50 for psdf, as it belongs to both directions of a
# wave, and 0.99 for rpsdf, which is the power in a ring: 2πk/(2π)² times the density per wave vector.
# psdf subtracts a straight line from each line of the map and scales the rest back to its mean square: to
# rounding, it is the spectrum of that. 3 % of its mean square slope lies beyond the shortest wave of the map.
# Surfaces drawn from the 1D PSDF have 0.71 of the height and slope if it is taken for one-sided. A
# power law fitted to the radial PSDF has an exponent that differs by 1 from that of a density (H by 1/2).
# The tail flattens the end of a steep spectrum.
#
# The script needs the packages of Debian 12.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check numpy==2.4.6
(cd "$folder" && apt-get download -qq libgwyddion2-0=2.62-1 libfftw3-double3 libgomp1 libglib2.0-0)
for package in "$folder"/*.deb; do dpkg -x "$package" "$folder/debian"; done
export LD_LIBRARY_PATH=$folder/debian/usr/lib/x86_64-linux-gnu
seen=$("$folder/python/bin/python" - <<'PYTHON'
import ctypes
from ctypes import POINTER, c_double, c_int, c_void_p

import numpy

ctypes.CDLL("libgwyddion2.so.0", mode=ctypes.RTLD_GLOBAL)
gwyddion = ctypes.CDLL("libgwyprocess2.so.0")
gwyddion.gwy_process_type_init()


def call(name, result, *arguments):
    function = getattr(gwyddion, name)
    function.restype = result
    return function(*arguments)


def spectrum(name, field, *arguments):
    """Returns wavenumbers, values and their step."""
    line = c_void_p(call("gwy_data_line_new", c_void_p, 1, c_double(1), 0))
    call(name, None, field, line, *arguments)
    count = call("gwy_data_line_get_res", c_int, line)
    step = call("gwy_data_line_get_real", c_double, line) / count
    first = call("gwy_data_line_get_offset", c_double, line)
    values = call("gwy_data_line_get_data", POINTER(c_double), line)[:count]
    return first + step * numpy.arange(count), numpy.array(values), step


n = 128
k = numpy.fft.fftfreq(n, 1 / n)
k = numpy.hypot(k[:, None], k[None, :])
amplitude = numpy.where((k >= 4) & (k <= 32), numpy.maximum(k, 1.0) ** -1.8, 0.0)
noise = numpy.fft.fft2(numpy.random.default_rng(1).standard_normal((n, n)))
heights = numpy.fft.ifft2(noise * amplitude).real
field = c_void_p(call("gwy_data_field_new", c_void_p, n, n, c_double(1), c_double(1), 0))
data = call("gwy_data_field_get_data", POINTER(c_double), field)
numpy.ctypeslib.as_array(data, shape=(n, n))[:] = heights
HORIZONTAL, LINEAR, NO_WINDOW = 0, 1, 0
rows = heights - heights.mean(axis=1, keepdims=True)
x = numpy.arange(n) - (n - 1) / 2
level = rows - (rows @ x / (x @ x))[:, None] * x
level *= (rows.std(axis=1) / level.std(axis=1))[:, None]
modes = (abs(numpy.fft.fft(level, axis=1) / n) ** 2).mean(axis=0)
k, values, step = spectrum("gwy_data_field_psdf", field, HORIZONTAL, LINEAR, NO_WINDOW, 0)
_, ring, ring_step = spectrum("gwy_data_field_rpsdf", field, LINEAR, NO_WINDOW, 0)
print(f"psdf {values.sum() * step / rows.var():.2f}, rpsdf {ring.sum() * ring_step / heights.var():.2f}")
print("without trends", numpy.allclose(values * step, modes[1 : len(values) + 1]), end=", ")
slopes = values * k**2
print(f"tail {slopes[k > 2 * numpy.pi * 32.5].sum() / slopes.sum():.2f} of the slope")
PYTHON
)
echo "$seen"
test "$seen" = "psdf 0.50, rpsdf 0.99
without trends True, tail 0.03 of the slope"
