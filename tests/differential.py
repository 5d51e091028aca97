#!/usr/bin/env python3
"""Checks random contacts against an independent solver in NumPy.

    python3 tests/differential.py                        all kinds of cases, as CI runs them
    python3 tests/differential.py --kind contacts --cases 200000 --jobs 2
    python3 tests/differential.py --kind contacts --seed 1 --only 4711
                                                         one case, with all its numbers

Each kind of cases has a function that computes tables again from stored maps:

- `contacts`, in this file, the contact of a surface under random loads;
- `measures`, in `differential_measures.py`, layers, pairs of surfaces, unloading, stiffness and conductance,
  histograms, and partial slip, in studies with all stages;
- `surfaces`, in `differential_surfaces.py`, statistics of surfaces;
- `adhesion`, in `differential_adhesion.py`, states of paths with adhesion.

A case of `contacts` is a random surface (rough maps, white noise, shapes, steps, spikes) on a random mesh (squares,
rectangles, cells up to 200 times as long as wide). Random loads press it on an elastic or yielding, periodic
or free half-space. The script uses only the results of the program and checks that

- the stored pressures are within their bounds, have the required mean, and satisfy the contact conditions
  within the tolerance, with displacements from the closed forms of the half-space (2/(E* |q|) for waves,
  Love's coefficients for squares of pressure);
- the residual, energy, mean gap, yielded depth, mean displacement, counts and contact map of the table are
  those of the stored pressures;
- in one small case of four, an active-set method with dense matrices gives the same contact node by node,
  except for nodes whose pressure or gap is below the tolerance.

It needs NumPy, polars and the Python module of asperity.
"""

import argparse
import importlib
import sys
import warnings
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np

import asperity

# Random maps are steep and uneven.
warnings.simplefilter("ignore", asperity.StudyWarning)

DEFAULT_TOLERANCE = 5e-5
TIGHT_TOLERANCE = 1e-9
# Largest number of nodes for which dense matrices are solved.
DENSE_NODES = 150
# Module of each kind of cases, the number of its cases in CI, and the number that share a process or a study.
KINDS = {
    "contacts": ("differential", 2000, 250),
    "measures": ("differential_measures", 40, 20),
    "surfaces": ("differential_surfaces", 80, 40),
    "adhesion": ("differential_adhesion", 200, 50),
}


# Surfaces


def draw_mesh(rng, smallest):
    """Returns numbers of nodes and sides: squares, rectangles, and cells up to 200 times as long as wide."""
    nodes = tuple(int(n) for n in rng.integers(smallest, rng.choice([smallest + 4, 13, 33]), 2))
    side = [1.0, 1.0]
    if rng.random() < 0.4:
        side[int(rng.integers(2))] = 10 ** rng.uniform(0, 2.3)
    else:
        side = [n / max(nodes) for n in nodes]
    return nodes, side


def heights(rng, nodes, side):
    x, y = (np.arange(n) / n for n in nodes)
    x, y = np.meshgrid(x, y, indexing="ij")
    kind = rng.choice(["white", "rough", "paraboloid", "wave", "product", "punch", "steps", "spikes"])
    if kind == "white":
        h = rng.standard_normal(nodes)
    elif kind == "rough":
        q = wavenumbers(nodes, side)
        with np.errstate(divide="ignore"):
            amplitude = np.where(q > 0, q ** -rng.uniform(0.8, 2.2), 0.0)
        h = np.fft.ifft2(np.fft.fft2(rng.standard_normal(nodes)) * amplitude).real
    elif kind == "paraboloid":
        centre = rng.uniform(0, 1, 2) if rng.random() < 0.5 else (0.5, 0.5)
        h = -(((x - centre[0]) * side[0]) ** 2 + ((y - centre[1]) * side[1]) ** 2)
    elif kind == "wave":
        h = np.cos(2 * np.pi * rng.integers(1, 3) * x)
    elif kind == "product":
        h = np.cos(2 * np.pi * x) * np.cos(2 * np.pi * y)
    elif kind == "punch":
        h = np.where(np.hypot(x - 0.5, y - 0.5) < rng.uniform(0.1, 0.5), 0.0, -rng.uniform(1e-3, 1.0))
    elif kind == "steps":
        h = rng.integers(0, rng.integers(2, 5), nodes).astype(float)
    else:
        h = np.where(rng.random(nodes) < 0.1, rng.uniform(0.5, 1.0, nodes), 0.0)
    if np.ptp(h) == 0:
        h[0, 0] += 1.0
    return kind, 10 ** rng.uniform(-4, 1) * (h - h.mean()) / np.ptp(h)


# The elastic half-space, E* = 1


def wavenumbers(nodes, side):
    qx, qy = (2 * np.pi * np.fft.fftfreq(n, 1 / n) / s for n, s in zip(nodes, side))
    return np.hypot(qx[:, None], qy[None, :])


def love(x, y, a, b):
    """Returns the displacement at (x, y) under unit pressure on a rectangle of half sides a and b around the origin."""

    def term(u, v):
        """Returns u ln(v + r) without cancellation for negative v."""
        r = np.hypot(u, v)
        with np.errstate(divide="ignore", invalid="ignore"):
            value = np.where(v > 0, np.log(v + r), 2 * np.log(np.abs(u)) - np.log(r - v))
        return np.where(u == 0, 0.0, u * value)

    total = 0.0
    for i in (1, -1):
        for j in (1, -1):
            total = total + i * j * (term(x + i * a, y + j * b) + term(y + j * b, x + i * a))
    return total / np.pi


class HalfSpace:
    def __init__(self, nodes, side, free):
        self.nodes, self.free = nodes, free
        if free:
            steps = [s / n for s, n in zip(side, nodes)]
            padded = [2 * n for n in nodes]
            x, y = (step * np.fft.fftfreq(n, 1 / n) for step, n in zip(steps, padded))
            influence = love(np.abs(x)[:, None], np.abs(y)[None, :], steps[0] / 2, steps[1] / 2)
            self.kernel, self.padded = np.fft.fft2(influence), padded
        else:
            q = wavenumbers(nodes, side)
            with np.errstate(divide="ignore"):
                self.kernel, self.padded = np.where(q > 0, 2 / q, 0.0), nodes

    def displacement(self, pressure):
        u = np.fft.ifft2(self.kernel * np.fft.fft2(pressure, self.padded)).real
        return u[: self.nodes[0], : self.nodes[1]]

    def matrix(self):
        count = self.nodes[0] * self.nodes[1]
        columns = [self.displacement(unit.reshape(self.nodes)).ravel() for unit in np.eye(count)]
        return np.array(columns).T


def relative_gap(p, g, full):
    """Returns the gap `g`, whose zero is arbitrary, relative to its mean over the nodes in elastic contact.

    `full` are the nodes whose pressure is the hardness.
    """
    elastic = (p > 0) & ~full
    if elastic.any():
        return g - g[elastic].mean()
    if not full.any():
        return g
    # Any offset between the highest saturated node and the lowest open node solves the contact.
    open_nodes = g[~full]
    top = g[full].max()
    return g - (top if open_nodes.size == 0 else 0.5 * (top + open_nodes.min()))


def active_set(matrix, h, load, hardness):
    """Returns the pressures of the contact by exchanging nodes between three sets, or None if they cycle."""
    count = h.size
    free, full = np.ones(count, bool), np.zeros(count, bool)
    for _ in range(200):
        fixed = hardness * full if np.isfinite(hardness) else np.zeros(count)
        inner = np.flatnonzero(free)
        system = np.zeros((inner.size + 1, inner.size + 1))
        system[:-1, :-1] = matrix[np.ix_(inner, inner)]
        system[:-1, -1], system[-1, :-1] = -1.0, 1.0
        right = np.append((h - matrix @ fixed)[inner], load * count - fixed.sum())
        try:
            solution = np.linalg.solve(system, right)
        except np.linalg.LinAlgError:
            return None
        p = fixed.copy()
        p[inner] = solution[:-1]
        g = matrix @ p - h - solution[-1]
        small = 1e-13 * (np.abs(h).max() + np.abs(matrix @ p).max())
        below, above = free & (p < 0), free & (p > hardness)
        into = ~free & ~full & (g < -small)
        back = full & (g > small)
        if not (below.any() or above.any() or into.any() or back.any()):
            return p, g
        free = (free & ~below & ~above) | into | back
        full = (full & ~back) | above
        if not free.any():
            return None
    return None


# One case


def draw(seed, index):
    rng = np.random.default_rng([seed, index])
    nodes, side = draw_mesh(rng, smallest=2)
    kind, h = heights(rng, nodes, side)
    case = {
        "kind": kind,
        "heights": h,
        "size": tuple(side),
        "boundary": str(rng.choice(["periodic", "free"])),
        "hardness": float(10 ** rng.uniform(-4, 1)) if rng.random() < 0.5 else None,
        "tolerance": TIGHT_TOLERANCE if rng.random() < 0.3 else DEFAULT_TOLERANCE,
    }
    loads = 10 ** rng.uniform(-6, 0.5, rng.integers(1, 13))
    if case["hardness"] is not None:
        loads = case["hardness"] * 10 ** rng.uniform(-5, -1e-3, loads.size)
        if rng.random() < 0.5:
            # A load close to a whole number of saturated nodes, which then bear all of it.
            whole = rng.integers(1, h.size, loads.size) / h.size
            loads = case["hardness"] * whole * (1 + rng.choice([-1, 1], loads.size) * 10 ** rng.uniform(-12, -3, loads.size))
    case["loads"] = []
    for load in sorted(float(f"{load:.11e}") for load in loads):
        is_borne = case["hardness"] is None or load < 0.999999 * case["hardness"]
        # Loads that differ by less count as one load.
        if is_borne and (not case["loads"] or load > case["loads"][-1] * (1 + 1e-8)):
            case["loads"].append(load)
    return case


def check(seed, index, verbose=False):
    """Returns the rows of a case, and the errors found in them."""
    case = draw(seed, index)
    if not case["loads"]:
        return {"rows": 0, "limit": 0, "dense": 0, "wrong": []}
    h, nodes = case["heights"], case["heights"].shape
    contact = asperity.press(
        h, size=case["size"], loads=case["loads"], boundary=case["boundary"], hardness=case["hardness"],
        hardness_unit=None if case["hardness"] is None else "relative", tolerance=case["tolerance"],
    )
    table = {name: np.array(contact.table[name]) for name in contact.table.names if name not in ("contact", "pressures")}
    body = HalfSpace(nodes, case["size"], case["boundary"] == "free")
    # A flat map counts as a map of slope 1.
    slope = float(table["rms_slope"][0]) or 1.0
    step = slope * min(s / n for s, n in zip(case["size"], nodes))
    # The column `hardness` is this product rounded to twelve digits.
    hardness = float(table["hardness_reduced"][0]) * slope if case["hardness"] is not None else np.inf
    wrong, limit, dense = [], 0, 0
    matrix = body.matrix() if index % 4 == 0 and h.size <= DENSE_NODES else None
    for row in range(len(table["load"])):

        def expect(what, found, told, within):
            if not abs(found - told) <= within:
                wrong.append(f"case {index}, load {row}: {what} is {found:.6g}, told {told:.6g}")

        p = np.asarray(contact.pressure(row))
        u = body.displacement(p)
        stop = str(table["stop"][row])
        limit += stop == "pair-limit"
        load = case["loads"][row] * slope
        scale = max(np.ptp(h), np.ptp(u), abs(u).max())
        full = p >= hardness
        if np.isfinite(hardness) and full.sum() != table["saturated_nodes"][row]:
            # Up to the last bits, a node bears the hardness or slightly less.
            full = p > hardness * (1 + 1e-14)
        elastic = (p > 0) & ~full
        g = relative_gap(p, u - h, full)
        violation = max(np.abs(g[elastic]).max(initial=0), -g[p == 0].min(initial=0), g[full].max(initial=0)) / step
        rounding = 1e-13 * scale / step
        single = 2.4e-7 * scale / step
        if not (p.min() >= 0 and p.max() <= hardness):
            wrong.append(f"case {index}, load {row}: pressures from {p.min()} to {p.max()}")
        expect("the mean pressure", p.mean() / load, 1.0, 1e-10)
        if stop != "pair-limit" and violation > case["tolerance"] * (1 + 1e-3) + rounding:
            wrong.append(f"case {index}, load {row}: {stop}, but the residual is {violation:.3g}, told {table['residual'][row]:.3g}")
        expect("the residual", violation, table["residual"][row], 1e-3 * violation + single)
        expect("the energy", 0.5 * (p * u).mean(), table["energy"][row], 1e-9 * (np.abs(p) * np.abs(u)).mean() + 1e-300)
        # The gap is zero in contact.
        gaps = np.where(p > 0, 0.0, g)
        expect("the mean gap", gaps.mean(), table["mean_gap"][row], (2 * violation + single) * step)
        expect("contact nodes", (p > 0).sum(), table["contact_nodes"][row], 0)
        if not (np.asarray(contact.contact(row)) == (p > 0)).all():
            wrong.append(f"case {index}, load {row}: the contact map is not where pressures are")
        if np.isfinite(hardness):
            expect("saturated nodes", full.sum(), table["saturated_nodes"][row], 0)
            depth = np.where(full, -g, 0.0).mean()
            expect("the yielded depth", depth, table["mean_yielded_depth"][row], (2 * violation + single) * step)
        if body.free:
            expect("the mean displacement", u.mean(), table["mean_displacement"][row], 1e-9 * abs(u).max())
        if verbose:
            print({name: values[row] for name, values in table.items()}, f"violation {violation:.3g}")
        if matrix is not None and case["tolerance"] == TIGHT_TOLERANCE and stop == "converged":
            exact = active_set(matrix, h.ravel(), load, hardness)
            if exact is not None:
                dense += 1
                q, gap = exact
                differ = (p.ravel() > 0) != (q > 0)
                # A node at the edge of contact: its pressure and its gap are both below the tolerance.
                edge = np.maximum(np.abs(q), p.ravel()) * np.abs(np.diag(matrix)) + np.abs(gap)
                if (edge[differ] > 1e3 * TIGHT_TOLERANCE * step + 1e-11 * scale).any():
                    wrong.append(f"case {index}, load {row}: {differ.sum()} nodes differ from the active-set solution")
    return {"rows": len(table["load"]), "limit": limit, "dense": dense, "wrong": wrong}


def check_many(seed, indices, verbose=False):
    """Returns the sums of rows and errors of some cases."""
    total = {"rows": 0, "limit": 0, "dense": 0, "wrong": []}
    for index in indices:
        try:
            found = check(seed, index, verbose)
        except Exception as error:  # The number of the case allows to repeat it.
            found = {"wrong": [f"case {index}: {type(error).__name__}: {error}"]}
        for key, value in found.items():
            total[key] += value
    return total


def some(kind, seed, indices):
    return importlib.import_module(KINDS[kind][0]).check_many(seed, indices)


def run(kind, cases, seed, jobs):
    """Checks the cases of a kind in several processes, and returns whether all their rows are right."""
    _, default, chunk = KINDS[kind]
    cases = cases or default
    chunks = [range(start, min(start + chunk, cases)) for start in range(0, cases, chunk)]
    total = {}
    # The module has its own threads, which a fork would not copy.
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        for found in pool.map(some, [kind] * len(chunks), [seed] * len(chunks), chunks):
            for key, value in found.items():
                total[key] = total[key] + value if key in total else value
            for line in found["wrong"]:
                print(f"{kind}: {line}", flush=True)
    wrong = len(total.pop("wrong"))
    words = {
        "limit": "gave up at the limit of pairs", "dense": "compared with the active-set solution",
        "unconverged": "did not converge", "apart": "apart", "minima": "compared with the curvature of the energy",
        "pulled": "pulled off again", "jumps": "of them from other states",
    }
    further = "".join(f"; {total[key]} {text}" for key, text in words.items() if key in total)
    print(f"{kind}: {total['rows']} rows of {cases} cases (seed {seed}): {wrong} wrong{further}", flush=True)
    return wrong == 0


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--kind", choices=KINDS, action="append", help="kind of cases; all by default")
    parser.add_argument("--cases", type=int, help="number of cases of each kind")
    parser.add_argument("--seed", type=int, default=2026)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--only", type=int, help="number of a single case")
    arguments = parser.parse_args()
    kinds = arguments.kind or list(KINDS)
    if arguments.only is None:
        return not all([run(kind, arguments.cases, arguments.seed, arguments.jobs) for kind in kinds])
    wrong = []
    for kind in kinds:
        module = importlib.import_module(KINDS[kind][0])
        wrong += module.check_many(arguments.seed, [arguments.only], verbose=True)["wrong"]
    print("\n".join(wrong) or "nothing is wrong")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
