#!/usr/bin/env python3
"""Compares isolated patches (free boundaries) in asperity, aspher and Tamaas, one thread each.

    python3 benches/free.py target/release/asperity [nodes]

All codes press one self-affine map that is not periodic under ten loads, from light contact to a
fifth of the area. Their contact maps are compared with those of asperity at a tolerance of 1e-10.
Each peer runs with the loosest power of ten as tolerance at which it has no more wrong nodes at any
load than asperity at its default. The script needs `pip install numpy polars aspher tamaas`.
"""

import os
import subprocess
import sys
import time
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ["OMP_NUM_THREADS"] = "1"

import numpy
import polars

LOADS = numpy.geomspace(0.002, 0.12, 10)  # p₀/(E* h′)
TOLERANCES = [1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8]


def rough(nodes: int) -> numpy.ndarray:
    """Returns heights [x, y] with rms slope 1 on a unit square, a quarter of a periodic map."""
    waves = numpy.fft.fftfreq(2 * nodes, 1 / (2 * nodes))
    wavenumber = numpy.hypot(*numpy.meshgrid(waves, waves, indexing="ij"))
    spectrum = numpy.where((8 <= wavenumber) & (wavenumber <= nodes / 4), numpy.maximum(wavenumber, 1) ** -1.8, 0)
    noise = numpy.random.default_rng(7).normal(size=2 * [2 * nodes])
    heights = numpy.fft.ifft2(spectrum * numpy.fft.fft2(noise)).real[:nodes, :nodes]
    slopes = [numpy.diff(heights, axis=axis) * nodes for axis in (0, 1)]
    return heights / numpy.sqrt(sum((slope**2).mean() for slope in slopes))


def of_asperity(program, heights, tolerance):
    """Returns the contact maps and the time of the solve stage alone."""
    with TemporaryDirectory() as folder:
        folder = Path(folder)
        numpy.save(folder / "map.npy", heights)
        (folder / "free.toml").write_text(f"""
[study]
name = "free"
[stage.map]
kind = "generate"
method = "file"
path = "map.npy"
side = 1.0
periodic = false
[stage.contact]
kind = "solve"
from = "map"
boundary = "free"
effective_modulus = 1.0
load_unit = "absolute"
loads = {[float(f"{load:.9g}") for load in LOADS]}
{tolerance}
""")
        run = lambda: subprocess.run(
            [program, "run", folder / "free.toml", "--data", folder / "data", "--jobs", "1"],
            check=True, capture_output=True)
        # Run everything but the solve stage first, so that it is not timed.
        whole = (folder / "free.toml").read_text()
        (folder / "free.toml").write_text(whole.split("[stage.contact]")[0])
        run()
        (folder / "free.toml").write_text(whole)
        start = time.perf_counter()
        run()
        seconds = time.perf_counter() - start
        stored = [path for path in folder.glob("data/store/**/*.parquet")
                  if "contact" in polars.read_parquet_schema(path)]
        table = polars.concat([polars.read_parquet(path) for path in stored], how="vertical").sort("load")
        bits = [numpy.frombuffer(row, numpy.uint8) for row in table["contact"]]
        maps = [numpy.unpackbits(row, bitorder="little")[: heights.size].astype(bool) for row in bits]
        return maps, seconds


def of_aspher(backend):
    def solve(heights, tolerance):
        import aspher

        solver = aspher.ContactSolver(grid_size=len(heights), backend=backend)
        maps, pressure = [], None
        start = time.perf_counter()
        for load in LOADS:
            start_from = {} if pressure is None else {"p_init": pressure * (load / before)}
            result = solver.solve(-heights.ravel(), p_nominal=load, tol=tolerance, precond="fourier-fft", **start_from)
            pressure, before = result.pressure, load
            maps.append(pressure.ravel() > 0)
        return maps, time.perf_counter() - start

    return solve


def of_tamaas(heights, tolerance):
    import tamaas

    tamaas.initialize(1)
    tamaas.set_log_level(tamaas.LogLevel.error)
    model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_2d, [1.0, 1.0], heights.shape)
    model.E, model.nu = 1.0, 0.0
    tamaas.ModelFactory.registerNonPeriodic(model, "dcfft")
    solver = tamaas.PolonskyKeerRey(model, heights, tolerance)
    solver.setIntegralOperator("dcfft")
    solver.max_iter = 20000
    maps = []
    start = time.perf_counter()
    for load in LOADS:
        solver.solve(load)
        maps.append(numpy.array(model.traction).ravel() > 0)
    return maps, time.perf_counter() - start


def misses(maps, reference):
    return max(int((one ^ other).sum()) for one, other in zip(maps, reference))


def main():
    program = sys.argv[1]
    nodes = int(sys.argv[2]) if len(sys.argv) > 2 else 512
    heights = rough(nodes)
    reference, _ = of_asperity(program, heights, "tolerance = 1e-10")
    shares = [one.mean() for one in reference]
    print(f"{nodes}², {len(LOADS)} loads, area {shares[0]:.4f} to {shares[-1]:.3f}, one thread")
    own, seconds = of_asperity(program, heights, "")
    allowed = misses(own, reference)
    print(f"asperity         default   {seconds:8.2f} s   at most {allowed} nodes wrong", flush=True)
    peers = {"aspher fft": of_aspher("fft"), "aspher h2": of_aspher("h2"), "tamaas dcfft": of_tamaas}
    for name, solve in peers.items():
        if len(sys.argv) > 3 and not name.startswith(sys.argv[3]):
            continue
        for tolerance in TOLERANCES:
            maps, taken = solve(heights, tolerance)
            wrong = misses(maps, reference)
            print(f"{name:16} {tolerance:7.0e} {taken:10.2f} s   at most {wrong} nodes wrong, "
                  f"{taken / seconds:.1f} times as long", flush=True)
            if wrong <= allowed:
                break


if __name__ == "__main__":
    main()
