#!/usr/bin/env python3
"""Compares the flow through the gaps of one surface with pyamg, and with a direct solution.

    python3 benches/flow.py              # 1024², six loads: about five minutes
    python3 benches/flow.py 256          # small meshes are also solved directly by SciPy

The gaps and the times of asperity come from `cargo bench -p asperity-mechanics --bench flow`. pyamg
solves the same network for the flow along x, by conjugate gradients with a classical (Ruge-Stüben)
hierarchy, to a residual of 1e-8. Seconds are CPU seconds. Needs numpy, scipy and pyamg.
"""

import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
import pyamg
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import spsolve

SMALL = 256
ROW = re.compile(r"\s*([\d.]+)\s+([\d.]+)\s+([\d.]+)\s+\S+\s+\S+\s+(\S+) (\S+)  (\S+) (\S+)")


def network(gap):
    """Returns conductances, ends and pressure steps of the links, for the flow along x."""
    nodes = np.arange(gap.size).reshape(gap.shape)
    cubed = (gap / gap.max()) ** 3
    ends, conductances, steps = [], [], []
    for axis in (0, 1):
        other = np.roll(cubed, -1, axis)
        total = cubed + other
        with np.errstate(invalid="ignore"):
            conductance = np.where((cubed > 0) & (other > 0), 2 * cubed * other / total, 0)
        step = np.zeros(gap.shape)
        if axis == 0:
            step[-1] = 1
        ends.append(np.stack([nodes, np.roll(nodes, -1, axis)]).reshape(2, -1))
        conductances.append(conductance.ravel())
        steps.append(step.ravel())
    ends, conductances = np.concatenate(ends, axis=1), np.concatenate(conductances)
    is_open = conductances > 0
    return ends[:, is_open], conductances[is_open], np.concatenate(steps)[is_open]


def conductivity(gap, solve):
    """Returns the conductivity along x, and the CPU seconds of `solve` (matrix, currents)."""
    ends, conductances, steps = network(gap)
    shape = (gap.size, gap.size)
    links = coo_matrix((conductances, ends), shape=shape).tocsr()
    count, parts = connected_components(links, directed=False)
    # One node of each part is grounded; parts of one node are closed nodes.
    grounds = np.unique(parts, return_index=True)[1]
    free = np.ones(gap.size, bool)
    free[grounds] = False
    links = links + links.T
    matrix = (coo_matrix((np.asarray(links.sum(axis=1)).ravel(), (range(gap.size),) * 2)) - links).tocsr()
    currents = np.zeros(gap.size)
    np.add.at(currents, ends[0], -conductances * steps)
    np.add.at(currents, ends[1], conductances * steps)
    pressures = np.zeros(gap.size)
    start = time.process_time()
    pressures[free] = solve(matrix[free][:, free].tocsr(), currents[free])
    seconds = time.process_time() - start
    drop = pressures[ends[0]] - pressures[ends[1]] + steps
    return (conductances * drop**2).sum() * gap.max() ** 3, seconds


def multigrid(matrix, currents):
    solver = pyamg.ruge_stuben_solver(matrix)
    return solver.solve(currents, tol=1e-8, accel="cg", maxiter=500)


def main():
    size = int(sys.argv[1]) if len(sys.argv) > 1 else 1024
    with tempfile.TemporaryDirectory() as folder:
        command = ["cargo", "bench", "-p", "asperity-mechanics", "--bench", "flow", "--", str(size), folder]
        table = subprocess.run(command, check=True, capture_output=True, text=True).stdout
        print("load  seconds of both flows  bound of x  pyamg, flow along x: seconds, difference  direct: seconds, difference")
        for row in filter(None, map(ROW.match, table.splitlines())):
            load, _, seconds, along_x, bound = row.groups()[:5]
            gap = np.fromfile(next(Path(folder).glob(f"*-{load}.f64"))).reshape(size, size)
            columns = [load, seconds, bound]
            for solve in [multigrid] + [spsolve] * (size <= SMALL):
                found, took = conductivity(gap, solve)
                difference = f"{float(along_x) / found - 1:.1e}" if float(along_x) else "no channel"
                columns += [f"{took:.2f}", difference]
            print("  ".join(columns), flush=True)


main()
