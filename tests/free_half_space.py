#!/usr/bin/env python3
"""Compares the free half-space with Tamaas' discrete convolution, node by node.

    python3 tests/free_half_space.py target/release/asperity

Both programs press a rough rectangle, which is not periodic, under three loads: asperity with
`boundary = "free"`, and Tamaas with PolonskyKeerRey and `dcfft`, which uses Love's coefficients, too.
The script needs `pip install numpy polars tamaas`.
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy
import polars
import tamaas

NODES = (96, 160)
SIDE = (0.6, 1.0)
PRESSURES = [2e-4, 1e-3, 3e-3]

MANIFEST = f"""\
[study]
name = "free"

[stage.map]
kind = "generate"
method = "file"
path = "map.npy"
side = {list(SIDE)}
periodic = false

[stage.contact]
kind = "solve"
from = "map"
boundary = "free"
effective_modulus = 1.0
load_unit = "absolute"
loads = {PRESSURES}
tolerance = 1e-8
pressures = "all"
"""


def rough() -> numpy.ndarray:
    """Returns heights of rms slope 0.02, self-affine up to sixteen waves, cropped from a larger map."""
    whole = (2 * NODES[0], 2 * NODES[1])
    noise = numpy.random.default_rng(16).normal(size=whole)
    waves = [numpy.fft.fftfreq(n, 1.0 / n) / (2 * side) for n, side in zip(whole, SIDE)]
    q = numpy.hypot(waves[0][:, None], waves[1][None, :])
    amplitude = numpy.where((q > 0) & (q <= 16), numpy.maximum(q, 1.5) ** -1.8, 0.0)
    heights = numpy.fft.ifft2(numpy.fft.fft2(noise) * amplitude).real[: NODES[0], : NODES[1]]
    steps = [side / n for side, n in zip(SIDE, NODES)]
    slopes = [numpy.diff(heights, axis=axis) / step for axis, step in enumerate(steps)]
    slope = numpy.sqrt(sum((along**2).mean() for along in slopes))
    return numpy.ascontiguousarray(0.02 * (heights - heights.mean()) / slope)


def by_tamaas(heights: numpy.ndarray, pressure: float) -> numpy.ndarray:
    model = tamaas.Model(tamaas.model_type.basic_2d, list(SIDE), list(NODES))
    model.E, model.nu = 1.0, 0.0
    tamaas.ModelFactory.registerNonPeriodic(model, "dcfft")
    solver = tamaas.PolonskyKeerRey(model, heights, 1e-12)
    # By default Tamaas presses a periodic half-space.
    solver.setIntegralOperator("dcfft")
    solver.max_iter = 20_000
    solver.solve(pressure)
    return numpy.array(model.traction).reshape(NODES)


def main() -> None:
    program = Path(sys.argv[1]).resolve()
    tamaas.initialize(1)
    tamaas.set_log_level(tamaas.LogLevel.error)
    heights = rough()
    with TemporaryDirectory() as folder:
        numpy.save(Path(folder) / "map.npy", heights)
        (Path(folder) / "free.toml").write_text(MANIFEST)
        subprocess.run([program, "run", "free.toml"], cwd=folder, check=True, capture_output=True)
        (table,) = Path(folder).glob("data/results/free/contact.parquet")
        (stored,) = [
            path for path in Path(folder).glob("data/store/**/*.parquet")
            if "pressures" in polars.read_parquet_schema(path)
        ]
        contacts = polars.read_parquet(table)
        ours = polars.read_parquet(stored)["pressures"]
    wrong = 0
    for row, pressure in enumerate(PRESSURES):
        own = numpy.array(ours[row].fill_null(0.0)).reshape(NODES)
        other = by_tamaas(heights, pressure)
        differ = int(((own > 0) != (other > 0)).sum())
        largest = abs(own - other).max() / own.max()
        nodes = contacts["contact_nodes"][row]
        print(f"pressure {pressure:g}: {nodes} nodes in contact, {differ} differ, "
              f"pressures within {largest:.1e} of the peak")
        wrong += differ > 0 or not largest < 1e-4
    print("Tamaas has the same contacts" if not wrong else f"{wrong} loads differ")
    sys.exit(min(wrong, 1))


if __name__ == "__main__":
    main()
