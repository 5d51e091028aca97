#!/usr/bin/env python3
"""Makes the report of a measured surface from the file of an instrument, by one manifest.

    python3 tests/measured_page.py target/release/asperity FOLDER

Writes an X3P of a tilted rough surface with holes on cells that are not square. The manifest fills and
levels it and presses it with free boundaries. The last line of the output is the path of the page, for
`tests/report.py`. The script needs numpy.
"""

import subprocess
import sys
import zipfile
from pathlib import Path

import numpy

NODES = (192, 120)
STEPS = (0.5e-6, 0.8e-6)

DESCRIPTION = f"""\
<?xml version="1.0" encoding="UTF-8"?>
<p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2"><Record1>
<Revision>ISO5436 - 2000</Revision><FeatureType>SUR</FeatureType><Axes>
<CX><AxisType>I</AxisType><Increment>{STEPS[0]}</Increment></CX>
<CY><AxisType>I</AxisType><Increment>{STEPS[1]}</Increment></CY>
<CZ><AxisType>A</AxisType><DataType>F</DataType></CZ></Axes></Record1>
<Record3><MatrixDimension><SizeX>{NODES[0]}</SizeX><SizeY>{NODES[1]}</SizeY><SizeZ>1</SizeZ></MatrixDimension>
<DataLink><PointDataLink>bindata/data.bin</PointDataLink></DataLink></Record3></p:ISO5436_2>
"""

MANIFEST = """\
[study]
name = "scan"

[stage.scan]
kind = "generate"
method = "file"
path = "scan.x3p"
periodic = false
fill = "harmonic"
level = "plane"

[stage.spectrum]
kind = "measure"
from = "scan"
what = "spectrum"

[stage.law]
kind = "fit"
from = "spectrum"
law = "self-affine"
window = [4e5, 2e6]

[stage.contact]
kind = "solve"
from = "scan"
boundary = "free"
bodies = [
    { youngs_modulus = 210e9, poisson_ratio = 0.30 },
    { youngs_modulus = 72e9, poisson_ratio = 0.17 },
]
loads = { from = 2e7, to = 2e9, steps = 8, spacing = "geometric" }
load_unit = "absolute"

[stage.area]
kind = "measure"
from = "contact"
"""


def heights() -> numpy.ndarray:
    """Returns heights [y, x] in metres: an rms roughness of 60 nm on a slope of 2 µm, with scratches and holes."""
    random = numpy.random.default_rng(36)
    waves = [numpy.fft.fftfreq(nodes, step) for nodes, step in zip(NODES[::-1], STEPS[::-1])]
    wavenumber = numpy.hypot(*numpy.meshgrid(*waves, indexing="ij"))
    falling = numpy.maximum(wavenumber, 5e4) ** -1.8
    falling[wavenumber > 5e5] = 0
    falling[0, 0] = 0
    rough = numpy.fft.ifft2(falling * numpy.fft.fft2(random.normal(size=NODES[::-1]))).real
    y, x = [numpy.arange(nodes) * step for nodes, step in zip(NODES[::-1], STEPS[::-1])]
    y, x = numpy.meshgrid(y, x, indexing="ij")
    surface = 60e-9 * rough / rough.std() + 2e-6 * x / x.max() - 1e-6 * y / y.max()
    surface[numpy.abs(y - 0.4 * x - 3e-5) < 1e-6] -= 150e-9
    for at_x, at_y, radius in [(3e-5, 6e-5, 6e-6), (7e-5, 2e-5, 3e-6), (0, 9e-5, 8e-6)]:
        surface[numpy.hypot(x - at_x, y - at_y) < radius] = numpy.nan
    surface[random.random(surface.shape) < 0.002] = numpy.nan
    return surface


def main():
    program, folder = sys.argv[1], Path(sys.argv[2])
    folder.mkdir(parents=True, exist_ok=True)
    with zipfile.ZipFile(folder / "scan.x3p", "w") as archive:
        archive.writestr("main.xml", DESCRIPTION)
        archive.writestr("bindata/data.bin", heights().astype("<f4").tobytes())
    manifest = folder / "scan.toml"
    manifest.write_text(MANIFEST)
    run = lambda *words: subprocess.run([program, *words, "--data", folder / "data"], check=True)
    run("run", manifest)
    run("report", manifest)
    print(folder / "data/results/scan/report.html")


if __name__ == "__main__":
    main()
