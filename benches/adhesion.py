#!/usr/bin/env python3
"""Counts the pairs of transforms of an adhesive cycle with jumps, one thread each.

    python3 benches/adhesion.py target/release/asperity [--before PROGRAM] [--nodes 1024] [--tamaas]

A rough surface (k 4 … 64, rms slope 0.5) that attracts the body by −w exp(−g/ρ), w = 0.004, ρ = 0.01, is
brought from the mean gap 0.05 to 0.012 in 20 steps and back. `--before` runs another program on the same
cycle and compares states: mean pressures, energies and nodes in contact. `--tamaas` solves the same mean gaps
with Tamaas' PolonskyKeerRey in the gaps. It starts anew at each gap and follows no path: its states are others
where several exist, and its time is comparable, not its states. Pairs are counted by asperity; Tamaas does not
count them. The script needs `pip install numpy polars tamaas`.
"""

import argparse
import os
import resource
import subprocess
import time
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ["OMP_NUM_THREADS"] = "1"

import numpy
import polars

SURFACE = """
[study]
name = "cycle"
[stage.surfaces]
kind = "generate"
nodes = {nodes}
seed = 3
hurst = 0.8
k_lower = 4
k_upper = 64
rms_slope = 0.5
"""
CYCLE = """
[stage.contact]
kind = "solve"
from = "surfaces"
adhesion = { work = 0.004, range = 0.01 }
control = "gap"
gaps = { from = 0.05, to = 0.012, steps = 20 }
path = "there-and-back"
tolerance = 1e-6
"""


def cpu_seconds():
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def cycle(program, nodes):
    """Returns the table of states, the CPU seconds of the solve stage alone, and the heights."""
    with TemporaryDirectory() as folder:
        manifest, data, heights = (Path(folder, name) for name in ("cycle.toml", "data", "heights.npy"))

        def run(*command):
            before = cpu_seconds()
            subprocess.run([program, *command, "--data", data], check=True, capture_output=True)
            return cpu_seconds() - before

        surface = SURFACE.format(nodes=nodes)
        manifest.write_text(surface)
        run("run", manifest, "--jobs", "1")
        run("export", manifest, "surfaces", "--map", "heights", "--output", heights)
        manifest.write_text(surface + CYCLE)
        seconds = run("run", manifest, "--jobs", "1")
        table = polars.read_parquet(data / "results" / "cycle" / "contact.parquet")
        return table.sort("step"), seconds, numpy.load(heights)


def report(name, table, seconds):
    pairs = table["pairs"]
    print(f"{name:10} {pairs.mean():7.1f} pairs a state, {pairs.max():5} in the worst, {seconds:7.1f} s", flush=True)


def compare(table, other):
    energy = [states["elastic_energy"] + states["adhesion_energy"] for states in (table, other)]
    contact = (table["contact_nodes"] - other["contact_nodes"]).abs().max()
    print(f"           states differ by at most {(energy[0] - energy[1]).abs().max():.1e} in energy, "
          f"{(table['pressure'] - other['pressure']).abs().max():.1e} in mean pressure, {contact} nodes in contact")


def of_tamaas(heights, gaps):
    import tamaas

    tamaas.initialize(1)
    tamaas.set_log_level(tamaas.LogLevel.error)
    model = tamaas.Model(tamaas.model_type.basic_2d, [1.0, 1.0], list(heights.shape))
    model.E, model.nu = 1.0, 0.0
    gap = tamaas.PolonskyKeerRey.gap
    solver = tamaas.PolonskyKeerRey(model, heights, 1e-8, gap, gap)
    solver.max_iter = 3000
    attraction = tamaas.ExponentialAdhesionFunctional(heights)
    attraction.parameters = {"rho": 0.01, "surface_energy": 0.004}
    solver.addFunctionalTerm(attraction)
    failed, start = 0, time.process_time()
    for gap in gaps:
        try:
            solver.solve(gap)
        except RuntimeError:
            failed += 1
    seconds = time.process_time() - start
    print(f"Tamaas     {len(gaps)} gaps, {failed} not converged, {seconds:7.1f} s")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("--before")
    parser.add_argument("--nodes", type=int, default=1024)
    parser.add_argument("--tamaas", action="store_true")
    options = parser.parse_args()
    table, seconds, heights = cycle(options.program, options.nodes)
    print(f"{options.nodes}², {len(table)} states, one thread")
    report("asperity", table, seconds)
    if options.before:
        other, seconds, _ = cycle(options.before, options.nodes)
        report("before", other, seconds)
        compare(table, other)
    if options.tamaas:
        of_tamaas(heights, table["mean_gap"].to_list())


if __name__ == "__main__":
    main()
