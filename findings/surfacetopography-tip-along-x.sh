#!/usr/bin/env bash
# SurfaceTopography 1.27.1 looks for artefacts of the tip along x only: the same scan, turned, is reliable.
#
# Guess: scanning_probe_reliability_cutoff of a map considers both directions.
# Seen on 2026-11-29 (a rough profile with H = 0.8, scanned by a sphere and repeated into grooves): with
# radii of 2, 5 and 10 thousandths of the side, the cutoffs are 5.8, 11.8 and 20.7 thousandths if the
# heights vary along x, as for the profile. If they vary along y, there is none, and with the tip in the
# metadata, short_reliability_cutoff, by which spectra are cut, is none, too.
# Ground, honed and polished surfaces are scanned along or across their grooves, and maps get
# turned. The blunted flanks count as measured, and their slopes set loads and contact areas.
#
# asperity compares peaks along the scan lines, whose direction is set
# by `align_along`.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check SurfaceTopography==1.27.1 numpy==2.4.6
seen=$("$folder/python/bin/python" - <<'PYTHON'
import numpy
from SurfaceTopography import Topography, UniformLineScan

n = 512
k = numpy.fft.rfftfreq(n, 1 / n)
amplitude = numpy.where((k >= 4) & (k <= 200), numpy.maximum(k, 1.0) ** -1.3, 0.0)
phases = numpy.exp(2j * numpy.pi * numpy.random.default_rng(1).random(k.size))
heights = numpy.fft.irfft(amplitude * phases, n)
slopes = numpy.fft.irfft(amplitude * phases * 2j * numpy.pi * k, n)
profile = UniformLineScan(0.3 * heights / slopes.std(), 1.0, periodic=True)


def thousandths(cutoff):
    return "none" if cutoff is None else f"{1000 * cutoff:.1f}"


for radius in (0.002, 0.005, 0.010):
    scanned = profile.scan_with_rigid_sphere(radius)
    along_x = numpy.repeat(scanned.heights()[:, None], 64, axis=1)
    tip = {"instrument": {"name": "AFM", "type": "contact-based", "parameters": {
        "tip_radius": {"value": radius, "unit": "um"}}}}
    maps = [
        Topography(along_x, (1.0, 64 / n), periodic=True, unit="um", info=tip),
        Topography(along_x.T, (64 / n, 1.0), periodic=True, unit="um", info=tip),
    ]
    cutoffs = [scanned.scanning_probe_reliability_cutoff(radius)]
    cutoffs += [each.scanning_probe_reliability_cutoff(radius) for each in maps]
    cutoffs += [each.short_reliability_cutoff() for each in maps]
    print(f"{radius:.3f}", *map(thousandths, cutoffs))
PYTHON
)
echo "$seen"
test "$seen" = "0.002 5.8 5.8 none 5.8 none
0.005 11.8 11.8 none 11.8 none
0.010 20.7 20.7 none 20.7 none"
