"""Checks random contacts with adhesion against their own maps, in NumPy: a kind of cases of `differential.py`.

Each case is a random surface on a random mesh, with an attraction that the mesh resolves well or badly, and a
path of random loads or mean gaps. From the stored maps of gaps and pressures, the script computes

- the balance of each state: attraction outside contact, no pull of the wall inside, and the displacements of
  the half-space under the pressures;
- whether the state is a minimum of the energy, by the eigenvalues of a dense matrix (small periodic maps);
- mean gap, load, energies, counts, contact maps, mean pressures and dissipated energy;
- the pull-off load again, with forty loads before it in place of one. Where the bodies jump to another state
  on the way, the path with more loads may end elsewhere; such cases are counted.

A row that did not converge must say so, and its numbers must be those of its maps.
"""

import warnings

import numpy as np

import asperity
from differential import HalfSpace, heights, wavenumbers

# Coarse meshes are meant.
warnings.simplefilter("ignore")

#: Largest number of nodes for which dense matrices are solved.
DENSE_NODES = 150
#: Accuracy of the pull-off load as a fraction of the largest attraction w/ρ.
PULL_OFF_ACCURACY = 1e-5
#: Columns `stop` of rows that are no state at their load or gap.
UNCONVERGED = ("pair-limit", "stalled", "gap-not-reached")
COUNTED = ("rows", "unconverged", "apart", "minima", "pulled", "jumps")


def draw(seed, index):
    rng = np.random.default_rng([seed, index])
    nodes = tuple(int(n) for n in rng.integers(3, rng.choice([8, 17, 33]), 2))
    side = np.array([n / max(nodes) for n in nodes])
    if rng.random() < 0.3:
        side[int(rng.integers(2))] *= rng.uniform(0.3, 1.0)
    side /= side.max()
    kind, h = heights(rng, nodes, side)
    h *= 10 ** rng.uniform(-2, 0) / np.ptp(h)
    # Δx w/(E* ρ²) from well resolved to bistable.
    mesh_number = 10 ** rng.uniform(-1.5, 0.19)
    work_range = 10 ** rng.uniform(-2.5, -0.3) * np.ptp(h)
    work = mesh_number * work_range**2 / max(s / n for s, n in zip(side, nodes))
    case = {
        "kind": kind,
        "heights": h,
        "size": tuple(float(s) for s in side),
        "boundary": str(rng.choice(["periodic", "free"], p=[0.7, 0.3])),
        # Manifests round numbers to twelve digits.
        "adhesion": {"work": float(f"{work:.6e}"), "range": float(f"{work_range:.6e}"), "override": True},
        "tolerance": float(10 ** rng.uniform(-9, -4.3)),
        "mesh_number": mesh_number,
    }
    count = int(rng.integers(1, 6))
    if rng.random() < 0.4:
        values = (h.max() - h.mean()) * 10 ** rng.uniform(-2, 0.3, count)
        case["gaps"] = [float(f"{gap:.6e}") for gap in values]
    else:
        values = work / work_range * 10 ** rng.uniform(-3, 0, count) * rng.choice([1, 1, -1], count)
        case["pressures"] = [float(f"{load:.6e}") for load in np.append(abs(values[0]), values[1:])]
        if rng.random() < 0.3:
            case["pressures"].append(float(f"{-1.001 * work / work_range:.6e}"))
    if rng.random() < 0.4:
        case["path"] = "there-and-back"
    return case


def press(case, **changed):
    keys = ("size", "boundary", "adhesion", "tolerance", "gaps", "pressures", "path")
    given = {key: case[key] for key in keys if key in case} | changed
    return asperity.press(case["heights"], **given)


class Energy:
    """Second derivatives of the energy of a periodic contact."""

    def __init__(self, nodes, side):
        count = nodes[0] * nodes[1]
        stiffness = wavenumbers(nodes, side) / 2
        units = np.eye(count).reshape(count, *nodes)
        waves = np.fft.ifft2(stiffness * np.fft.fft2(units)).real
        self.matrix = waves.reshape(count, count)

    def least_curvature(self, gap, attraction, work_range, keeps_mean):
        free = np.flatnonzero(gap.ravel() > 0)
        if free.size < 2:
            return 0.0
        matrix = self.matrix[np.ix_(free, free)] - np.diag(attraction.ravel()[free] / work_range)
        if keeps_mean:
            basis = np.linalg.qr(np.column_stack([np.ones(free.size), np.eye(free.size)[:, 1:]]))[0][:, 1:]
            matrix = basis.T @ matrix @ basis
        return np.linalg.eigvalsh(matrix)[0]


def check(seed, index, verbose=False):
    """Returns the counts of a case, and the errors found in its rows."""
    case = draw(seed, index)
    h, nodes, side = case["heights"], case["heights"].shape, case["size"]
    work, work_range = case["adhesion"]["work"], case["adhesion"]["range"]
    strongest, is_free, by_gap = work / work_range, case["boundary"] == "free", "gaps" in case
    contact = press(case)
    maps = ("contact", "repulsive", "pressures", "gaps")
    table = {name: list(contact.table[name]) for name in contact.table.names if name not in maps}
    body = HalfSpace(nodes, side, is_free)
    slope = float(table["rms_slope"][0]) or 1.0
    found = dict.fromkeys(COUNTED, 0) | {"wrong": []}
    is_dense = not is_free and h.size <= DENSE_NODES and case["tolerance"] < 1e-6
    energy = Energy(nodes, side) if is_dense else None
    targets = case["gaps"] if by_gap else case["pressures"]
    if case.get("path"):
        targets = targets + targets[-2::-1]
    before = None
    for row, stop in enumerate(table["stop"]):

        def wrong(text):
            found["wrong"].append(f"case {index}, state {row} ({stop}): {text}")

        def expect(what, value, within):
            told = table[what][row]
            if told is None or not abs(value - told) <= within:
                wrong(f"{what} is {value:.9g}, told {told}")

        found["rows"] += 1
        found["unconverged"] += stop in UNCONVERGED
        if verbose:
            print({name: values[row] for name, values in table.items()})
        if table["mean_gap"][row] is None or not np.isfinite(table["mean_gap"][row]):
            found["apart"] += 1
            before = None
            if table["contact_nodes"][row] or np.asarray(contact.contact(row)).any():
                wrong("surfaces that are apart have nodes in contact")
            if row and stop == "pulled-off" and table["pull_off_load"][row] is not None:
                found["pulled"] += 1
                again(case, targets, row, table["pull_off_load"][row] * slope, found, wrong)
            continue
        g, p = np.asarray(contact.gap(row)), np.asarray(contact.pressure(row))
        u, attraction = body.displacement(p), strongest * np.exp(-g / work_range)
        closed, scale = g == 0, np.abs(p).mean() + strongest * 1e-12
        tolerance = case["tolerance"] * slope
        if g.min() < 0:
            wrong(f"a gap is {g.min()}")
        if np.abs(p + attraction)[~closed].max(initial=0) > 1e-12 * strongest:
            wrong("pressures outside contact are not the attraction")
        # The compliance of a body that bears pressures on twice the side.
        balance = u - g - h
        error = np.ptp(balance - balance.mean())
        if stop not in ("pair-limit", "stalled"):
            if error > 3 * tolerance + 1e-11 * np.ptp(h):
                wrong(f"displacements are {error:.3g} from gap and height, with a tolerance of {tolerance:.3g}")
            if (p + attraction)[closed].min(initial=0) < -tolerance - 1e-12 * strongest:
                wrong("the wall pulls")
            if table["residual"][row] > case["tolerance"]:
                wrong(f"the residual is {table['residual'][row]}")
            if by_gap:
                missed = abs(g.mean() / targets[row] - 1) > 1e-9
                if missed != (stop == "gap-not-reached"):
                    wrong(f"the mean gap is {g.mean()}, and {targets[row]} is prescribed")
        expect("mean_gap", g.mean(), 1e-9 * g.mean() + 1e-13 * np.ptp(h))
        # Nodes around an isolated patch, three times as many, have residuals as well.
        within = 1e-9 * scale + 1e-13 * np.ptp(h) + (0 if by_gap else 4 * tolerance)
        if stop not in ("pair-limit", "stalled"):
            expect("pressure", p.mean(), within)
        if not by_gap and abs(table["pressure"][row] / targets[row] - 1) > 1e-12:
            wrong("the load is not the prescribed one")
        stored = 0.5 * (p * u).mean()
        interaction = -work * np.exp(-g / work_range).mean()
        expect("elastic_energy", stored, 1e-9 * np.abs(p * u).mean())
        expect("adhesion_energy", interaction, 1e-9 * abs(interaction))
        expect("contact_nodes", closed.sum(), 0)
        expect("repulsive_nodes", (p > 0).sum(), 0)
        expect("contact_fraction", closed.mean(), 1e-12)
        expect("repulsive_fraction", (p > 0).mean(), 1e-12)
        expect("attractive_pressure", np.maximum(-p, 0).mean(), 1e-10 * scale)
        expect("repulsive_pressure", np.maximum(p, 0).mean(), 1e-10 * scale)
        expect("pressure_in_contact", np.where(closed, p, 0).mean(), 1e-10 * scale)
        expect("peak_pressure", p.max(), 1e-10 * scale)
        if not (np.asarray(contact.contact(row)) == closed).all():
            wrong("the contact map is not where the gap is zero")
        if not (np.asarray(contact.repulsive(row)) == (p > 0)).all():
            wrong("the repulsive map is not where the pressure is positive")
        moved = u.mean() if is_free else 0.0
        if is_free:
            expect("mean_displacement", moved, 1e-9 * np.abs(u).max())
        lost = 0.0
        if before:
            approach = (moved - before["moved"]) - (g.mean() - before["gap"])
            work_done = 0.5 * (table["pressure"][row] + before["pressure"]) * approach
            lost = before["lost"] + work_done - (stored + interaction - before["energy"])
        size = abs(stored) + abs(interaction) + abs(table["pressure"][row]) * (g.mean() + abs(moved))
        expect("dissipated_energy", lost, 1e-8 * (size + (before or {}).get("size", 0)))
        before = {
            "gap": g.mean(), "moved": moved, "lost": lost, "energy": stored + interaction,
            "pressure": table["pressure"][row], "size": size + (before or {}).get("size", 0),
        }
        if energy is not None and stop == "converged":
            found["minima"] += 1
            curvature = energy.least_curvature(g, attraction, work_range, by_gap)
            if curvature < -1e-3 * (1 + work / work_range**2):
                wrong(f"a saddle point of the energy, with the curvature {curvature:.3g}")
    return found


def again(case, targets, row, told, found, wrong):
    """Pulls off the bodies of a row once more, with forty loads in place of the last one."""
    strongest = case["adhesion"]["work"] / case["adhesion"]["range"]
    last, end = targets[row - 1], min(targets[row], 1.001 * told)
    loads = targets[:row] + [float(load) for load in last + (end - last) * np.arange(1, 41) / 40]
    table = press(case, pressures=loads, path="as-given").table
    pulled = [load for load in table["pull_off_load"][row:] if load is not None]
    slope = float(table["rms_slope"][0]) or 1.0
    if not pulled or any(stop in UNCONVERGED for stop in table["stop"][row:]):
        wrong("the path with forty loads does not pull off")
    elif abs(pulled[0] * slope - told) > 3 * PULL_OFF_ACCURACY * strongest:
        nodes = np.array(table["contact_nodes"][row - 1 :], float)
        nodes = nodes[: int(np.argmax(nodes == 0)) or None]
        has_jumped = np.abs(np.diff(nodes)).max(initial=0) > 0.25 * nodes.max(initial=1)
        found["jumps"] += 1
        if not has_jumped:
            wrong(f"forty loads give a pull-off load of {pulled[0] * slope:.7g}, told {told:.7g} (w/ρ = {strongest:.3g})")


def check_many(seed, indices, verbose=False):
    """Returns the sums of rows and errors of some cases."""
    total = dict.fromkeys(COUNTED, 0) | {"wrong": []}
    for index in indices:
        try:
            found = check(seed, index, verbose)
        except Exception as error:  # The number of the case allows to repeat it.
            found = {"wrong": [f"case {index}: {type(error).__name__}: {error}"]}
        for key, value in found.items():
            total[key] += value
    return total
