"""Presses a surface with one of the peers, as a separate process.

`solve.py CODE TOLERANCE SURFACE.npy LOADS.json FOLDER` appends a line per load to
FOLDER/rows.jsonl and the contact map to FOLDER/maps.bin, so that finished loads survive an early
end. CPU seconds are those of the solver and its preparation, without imports and files.
"""

import json
import os
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

# Largest ratio of a step in load to the step before, up to which a guess is extrapolated.
LONGEST_REACH = 4.0

# Smallest tolerance that aspher allows for a solve in single precision.
SINGLE_FLOOR = 2e-6


@dataclass
class Solution:
    """Solution at one load, and the work on the finest mesh if the code reports it."""

    pressure: np.ndarray
    iterations: int
    pairs: int | None
    converged: bool


class Guess:
    """Linear extrapolation of the last two solutions, or the last one if the step is too long."""

    def __init__(self) -> None:
        self.solutions: list[tuple[float, np.ndarray]] = []

    def at(self, load: float) -> np.ndarray | None:
        if not self.solutions:
            return None
        last_load, last = self.solutions[-1]
        if len(self.solutions) == 2:
            earlier_load, earlier = self.solutions[0]
            reach = (load - last_load) / (last_load - earlier_load)
            if reach <= LONGEST_REACH:
                return np.maximum(last + reach * (last - earlier), 0.0)
        return last

    def add(self, load: float, pressure: np.ndarray) -> None:
        self.solutions = [*self.solutions[-1:], (load, pressure)]


def aspher_nested(heights: np.ndarray, loads: list[float], tolerance: float) -> Iterator[Solution]:
    """Solves on nested grids from 64² up, in single precision and, if necessary, then in double."""
    import aspher

    nodes = len(heights)
    gap = -heights.ravel()
    single = tolerance >= SINGLE_FLOOR
    for load in loads:
        result = aspher.solve_nested(
            grid_size=nodes,
            gap=gap,
            p_nominal=load,
            backend="periodic",
            coarsest=min(64, nodes),
            tol=tolerance,
            coarse_tol=max(tolerance, 1e-3),
            precision="float" if single else "float_then_double",
            light_result=True,
        )
        pairs = result.matvec_count + result.precond_count
        yield Solution(result.pressure, result.iterations, pairs, result.converged)


def aspher_warm(heights: np.ndarray, loads: list[float], tolerance: float) -> Iterator[Solution]:
    """Solves with the spectral preconditioner by full transforms, starting from the last two loads.

    The extrapolation is not part of aspher. It is a line of NumPy and saves 7 % of the iterations.
    """
    import aspher

    solver = aspher.ContactSolver(grid_size=len(heights), backend="periodic")
    gap = -heights.ravel()
    guess = Guess()
    for load in loads:
        result = solver.solve(
            gap, p_nominal=load, tol=tolerance, precond="fourier-fft", p_init=guess.at(load)
        )
        guess.add(load, result.pressure)
        pairs = result.matvec_count + result.precond_count
        yield Solution(result.pressure, result.iterations, pairs, result.converged)


def tamaas_warm(heights: np.ndarray, loads: list[float], tolerance: float) -> Iterator[Solution]:
    """Solves by Polonsky & Keer's iteration on the pressure, starting from the load before.

    Tamaas starts from the pressure of the model and rescales it. An extrapolated pressure takes
    40 % more iterations.
    """
    import tamaas

    tamaas.initialize(1)
    tamaas.set_log_level(tamaas.LogLevel.info)
    nodes = len(heights)
    model = tamaas.ModelFactory.createModel(tamaas.model_type.basic_2d, [1.0, 1.0], [nodes, nodes])
    model.E, model.nu = 1.0, 0.0
    solver = tamaas.PolonskyKeerRey(model, heights, tolerance)
    solver.max_iter = 20000
    # Log the first and the last iteration only.
    solver.dump_freq = 10**9
    for load in loads:
        with LastLogLine() as log:
            error = solver.solve(load)
        iterations = int(log.line.split()[0])
        yield Solution(np.asarray(model.traction), iterations, None, error <= tolerance)


def contact_mechanics(
    heights: np.ndarray, loads: list[float], tolerance: float
) -> Iterator[Solution]:
    """Solves by Polonsky & Keer's iteration on the displacement, starting from the load before.

    The tolerance is a length, the largest penetration; it is multiplied by rms slope × mesh step.
    """
    from ContactMechanics import PeriodicFFTElasticHalfSpace, make_system
    from SurfaceTopography import Topography

    nodes = len(heights)
    substrate = PeriodicFFTElasticHalfSpace((nodes, nodes), 1.0, (1.0, 1.0))
    surface = Topography(heights, (1.0, 1.0), periodic=True)
    system = make_system(substrate=substrate, surface=surface)
    start: dict[str, np.ndarray] = {}
    for load in loads:
        result = system.minimize_proxy(
            external_force=load, pentol=tolerance / nodes, thermotol=1e-3, **start
        )
        start = {"initial_displacements": result.x, "initial_forces": result.jac}
        yield Solution(np.asarray(result.jac), result.nit, None, result.success)


class LastLogLine:
    """Captures the last line on stderr, the only place where tamaas reports its iterations."""

    line = "0"

    def __enter__(self) -> "LastLogLine":
        sys.stderr.flush()
        self.file = tempfile.TemporaryFile()
        self.saved = os.dup(2)
        os.dup2(self.file.fileno(), 2)
        return self

    def __exit__(self, *_: object) -> None:
        os.dup2(self.saved, 2)
        os.close(self.saved)
        self.file.seek(0)
        lines = self.file.read().decode().split("\n")
        self.line = next((line for line in reversed(lines) if line.strip()), "0")
        self.file.close()


SWEEPS = {
    "aspher-nested": aspher_nested,
    "aspher-warm": aspher_warm,
    "contact-mechanics": contact_mechanics,
    "tamaas": tamaas_warm,
}


def main() -> None:
    code, tolerance, surface, loads_file, folder = sys.argv[1:]
    heights = np.load(surface)
    loads = json.loads(Path(loads_file).read_text())
    sweep = SWEEPS[code](heights, loads, float(tolerance))
    with open(f"{folder}/rows.jsonl", "w") as rows, open(f"{folder}/maps.bin", "wb") as maps:
        for load in loads:
            start = time.process_time()
            solution = next(sweep)
            seconds = time.process_time() - start
            contact = solution.pressure.ravel() > 0.0
            maps.write(np.packbits(contact, bitorder="little").tobytes())
            maps.flush()
            row = {
                "load": load,
                "cpu_seconds": seconds,
                "iterations": solution.iterations,
                "pairs": solution.pairs,
                "contact_nodes": int(contact.sum()),
                "converged": bool(solution.converged),
            }
            print(json.dumps(row), file=rows, flush=True)


if __name__ == "__main__":
    main()
