"""Studies of random contacts, whose tables are computed again from pressures and heights.

Part of `differential.py`. A case is a surface, or a pair of surfaces, on a half-space, a layer, a coating or a
material that yields and unloads. A study measures its contacts. This module computes from the heights and the
pressures of each load, with NumPy alone:

- the contact conditions, energy, mean gap and plastic depth, with layers from the equations of elasticity;
- the stiffness, from dense matrices;
- spots, their centres as circular means, and Greenwood's conductance by a direct Ewald sum;
- histograms of pressures and gaps;
- partial slip: Coulomb's law at every node, and the dissipated energy as friction traction times slip.
"""

import math
import tempfile
import warnings
from pathlib import Path

import numpy as np
import polars

import asperity
from differential import HalfSpace, draw_mesh, heights, relative_gap, wavenumbers

TOLERANCE = 1e-9
# Numbers of cases in one study.
BATCH = 20
# Largest number of nodes in contact for which dense matrices are solved.
DENSE_NODES = 250


# Cases


def rounded(value):
    return float(f"{value:.11e}")


def draw(seed, index):
    rng = np.random.default_rng([seed, index, 1])
    nodes, side = draw_mesh(rng, smallest=4)
    # Manifests have twelve digits.
    side = [rounded(s) for s in side]
    kind, h = heights(rng, nodes, side)
    physics = str(rng.choice(["half-space", "half-space", "layer", "hardness", "path"]))
    boundary = "periodic" if physics == "layer" else str(rng.choice(["periodic", "free"]))
    case = {"kind": kind, "heights": h, "size": side, "boundary": boundary, "physics": physics}
    if physics == "layer":
        case["layer"], case["substrate"] = draw_layer(rng, nodes, side)
    if rng.random() < 0.3:
        case["against"] = heights(rng, nodes, side)[1] * 10 ** rng.uniform(-1, 0)
        case["mirror"] = rng.choice(["x", "y", None])
        case["shift"] = [0.0, 0.0]
        if boundary == "periodic":
            whole = [int(rng.integers(n)) / n for n in nodes]
            case["shift"] = whole if rng.random() < 0.5 else [rounded(s) for s in rng.random(2)]
    case["bins"] = {
        "pressure": (int(rng.integers(1, 40)), rounded(10 ** rng.uniform(-1, 0.7))),
        "gap": (int(rng.integers(1, 40)), rounded(10 ** rng.uniform(-1, 0.9))),
    }
    loads = 10 ** rng.uniform(-3, 0.2, 3)
    if physics in ("hardness", "path"):
        case["hardness"] = rounded(10 ** rng.uniform(-1.5, 0.5))
        loads = case["hardness"] * 10 ** rng.uniform(-2.5, -0.05, 3)
    case["tangential"] = []
    if physics == "half-space":
        case["friction"] = rounded(rng.uniform(0.05, 1.0))
        case["poisson"] = rounded(rng.uniform(0.0, 0.5))
        case["tangential"] = [round(float(q), 2) for q in rng.uniform(-0.95, 0.95, rng.integers(1, 7))]
        case["tangential"] = [
            q for q, before in zip(case["tangential"], [0.0] + case["tangential"]) if abs(q - before) > 1e-6
        ]
    loads = {rounded(load) for load in loads}
    shares = needed_shares(case["tangential"])
    case["loads"] = distinct(sorted(loads | {float(f"{s * n:.12g}") for s in shares for n in loads}))
    return case


def distinct(loads):
    """Returns ascending loads without those that differ from the one before by rounding."""
    kept = []
    for load in loads:
        if not kept or load > kept[-1] * (1 + 1e-9):
            kept.append(load)
    return kept


def draw_layer(rng, nodes, side):
    thickness = rounded(max(side) * 10 ** rng.uniform(-1.2, 0.5))
    poisson = rounded(rng.uniform(0.0, 0.49))
    kind = rng.choice(["bonded", "frictionless", "coating"])
    layer = {"thickness": thickness, "poisson_ratio": poisson}
    if kind == "coating":
        layer["modulus_ratio"] = rounded(10 ** rng.uniform(-1, 1))
        return layer, {"poisson_ratio": rounded(rng.uniform(0.0, 0.49))}
    return layer | {"base": str(kind)}, None


def toml(value):
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{key} = {toml(item)}" for key, item in value.items()) + " }"
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(map(toml, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return f'"{value}"' if isinstance(value, str) else repr(value)


def stage(name, **keys):
    return f"\n[stage.{name}]\n" + "".join(f"{key} = {toml(value)}\n" for key, value in keys.items())


def manifest(case, index, folder):
    """Writes the maps of a case and returns its stages."""
    text = ""
    for name, map_ in [("a", case["heights"]), ("b", case.get("against"))]:
        if map_ is not None:
            np.save(folder / f"{name}{index}.npy", map_)
            text += stage(
                f"{name}{index}", kind="generate", method="file", path=f"{name}{index}.npy",
                periodic=case["boundary"] == "periodic", side=list(case["size"]),
            )
    bins = {key: {"count": count, "to": to} for key, (count, to) in case["bins"].items()}
    keys = {
        "from": f"a{index}", "loads": case["loads"], "tolerance": TOLERANCE, "boundary": case["boundary"],
        "stiffness": True, "pressure_bins": bins["pressure"], "gap_bins": bins["gap"],
    }
    if "hardness" in case:
        keys |= {"hardness": case["hardness"], "hardness_unit": "relative"}
    if case["physics"] == "path":
        keys["path"] = "there-and-back"
    if "layer" in case:
        keys["layer"] = case["layer"]
        if case["substrate"]:
            keys["substrate"] = case["substrate"]
    if "against" in case:
        keys["against"] = f"b{index}"
        if case["mirror"]:
            keys["mirror"] = str(case["mirror"])
        if case["boundary"] == "periodic":
            keys["shift"] = case["shift"]
    text += stage(f"c{index}", kind="solve", **keys)
    measures = {"m": {}, "p": {"what": "pressures"}, "g": {"what": "gaps"}}
    if case["tangential"]:
        friction = {"coefficient": case["friction"], "loads": case["tangential"], "poisson_ratio": case["poisson"]}
        measures["f"] = {"friction": friction}
    for name, keys in measures.items():
        text += stage(f"{name}{index}", kind="measure", **{"from": f"c{index}"}, **keys)
    return text


def press(case):
    """Presses the surface of a case with the function of the Python module, which keeps the maps."""
    keys = {}
    if "hardness" in case:
        keys |= {"hardness": case["hardness"], "hardness_unit": "relative"}
    if case["physics"] == "path":
        keys["path"] = "there-and-back"
    if "layer" in case:
        keys |= {"layer": case["layer"], "substrate": case["substrate"]}
    if "against" in case:
        keys |= {"against": case["against"], "mirror": case["mirror"] and str(case["mirror"])}
        if case["boundary"] == "periodic":
            keys["shift"] = tuple(case["shift"])
    return asperity.press(
        case["heights"], size=tuple(case["size"]), loads=case["loads"], boundary=case["boundary"],
        tolerance=TOLERANCE, stiffness=True, **keys,
    )


# Surfaces


def moved(map_, shift, mirror):
    """Returns the second map where it faces the first: mirrored, then shifted by fractions of the sides."""
    map_ = map_[::-1] if mirror == "x" else map_[:, ::-1] if mirror == "y" else map_
    spectrum = np.fft.fft2(map_)
    for axis, (n, s) in enumerate(zip(map_.shape, shift)):
        k = np.fft.fftfreq(n, 1 / n)
        # The shared mode of an even number of nodes moves as the mean of its two waves.
        phase = np.where(2 * np.abs(k) == n, np.cos(np.pi * n * s), np.exp(-2j * np.pi * k * s))
        spectrum *= phase[:, None] if axis == 0 else phase[None, :]
    return np.fft.ifft2(spectrum).real


def rms_slope(h, side, periodic):
    if periodic:
        power = np.abs(np.fft.fft2(h) / h.size) ** 2
        return math.sqrt((wavenumbers(h.shape, side) ** 2 * power).sum())
    dx, dy = (s / n for s, n in zip(side, h.shape))
    along_x = np.diff(h, axis=0)[:, :-1] / dx
    along_y = np.diff(h, axis=1)[:-1, :] / dy
    return math.sqrt((along_x**2).mean() + (along_y**2).mean())


# Layers


def layer_factors(x, poisson, base=None, modulus_ratio=None, substrate_poisson=None):
    """Returns the displacement of a layer under a wave of pressure, relative to a half-space of its material.

    `x` is the wavenumber times the thickness, an array. The stress function F(z) cos x of plane strain, with z in
    units of 1/q, is a sum of e^−z, z e^−z, e^(z−x) and (z − x) e^(z−x) in the layer, and of the first two in a
    half-space below.
    """

    def basis(z):
        """Returns F, F′, F″, F‴ of the functions at z, with the shape (4, functions, wavenumbers)."""
        falling, rising = np.exp(-z), np.exp(z - x)
        one = [(-1) ** n * falling for n in range(4)]
        two = [(-1) ** n * (z - n) * falling for n in range(4)]
        three = [rising for _ in range(4)]
        four = [(z - x + n) * rising for n in range(4)]
        return np.array([one, two, three, four]).transpose(1, 0, 2)

    def sideways(F, nu):
        return (1 - nu) * F[2] + nu * F[0]

    def down(F, nu):
        return (1 - nu) * F[3] - (2 - nu) * F[1]

    top, bottom = basis(np.zeros_like(x)), basis(x)
    if modulus_ratio is None:
        rows = [top[0], top[1], down(bottom, poisson), bottom[1] if base == "frictionless" else sideways(bottom, poisson)]
        matrix = np.array(rows)
    else:
        # Below, z is measured from the interface.
        F = np.array([[1.0, 0.0], [-1.0, 1.0], [1.0, -2.0], [-1.0, 3.0]])
        below = [F[0], F[1], modulus_ratio * sideways(F, substrate_poisson), modulus_ratio * down(F, substrate_poisson)]
        above = [bottom[0], bottom[1], sideways(bottom, poisson), down(bottom, poisson)]
        nothing = np.zeros((2, x.size))
        rows = [np.vstack([top[0], nothing]), np.vstack([top[1], nothing])]
        rows += [np.vstack([one, -np.repeat(other[:, None], x.size, 1)]) for one, other in zip(above, below)]
        matrix = np.array(rows)
    matrix = matrix.transpose(2, 0, 1)
    right = np.zeros((x.size, matrix.shape[1], 1))
    right[:, 0] = 1.0
    coefficients = np.linalg.solve(matrix, right)[:, :4, 0]
    return (coefficients.T * down(top, poisson)).sum(0) / (2 * (1 - poisson))


class Body(HalfSpace):
    """Half-space, layer or coating with E* = 1, and its compliance under a uniform pressure."""

    def __init__(self, case):
        nodes, side = case["heights"].shape, case["size"]
        super().__init__(nodes, side, case["boundary"] == "free")
        self.uniform = None
        if "layer" in case:
            layer, substrate = case["layer"], case["substrate"]
            q, back = np.unique(wavenumbers(nodes, side), return_inverse=True)
            factors = np.zeros_like(q)
            nu, thickness = layer["poisson_ratio"], layer["thickness"]
            factors[1:] = layer_factors(
                q[1:] * thickness, nu, layer.get("base"), layer.get("modulus_ratio"),
                substrate and substrate["poisson_ratio"],
            )
            self.kernel = self.kernel * factors[back.reshape(nodes)]
            if substrate is None:
                # E* = E/(1 − ν²) = 1 and M = E (1 − ν)/((1 + ν)(1 − 2ν)).
                self.uniform = thickness * (1 - 2 * nu) / (1 - nu) ** 2


# Spots


def spots(contact, periodic):
    """Returns, for each 4-connected cluster, its number of nodes, and its centre in nodes."""
    labels = np.full(contact.shape, -1)
    found = []
    for start in zip(*np.nonzero(contact)):
        if labels[start] >= 0:
            continue
        labels[start] = len(found)
        stack, members = [start], []
        while stack:
            i, j = stack.pop()
            members.append((i, j))
            for k, l in ((i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)):
                if periodic:
                    k, l = k % contact.shape[0], l % contact.shape[1]
                elif not (0 <= k < contact.shape[0] and 0 <= l < contact.shape[1]):
                    continue
                if contact[k, l] and labels[k, l] < 0:
                    labels[k, l] = len(found)
                    stack.append((k, l))
        centre = []
        for axis, n in enumerate(contact.shape):
            indices = np.array([member[axis] for member in members])
            if not periodic:
                centre.append(indices.mean())
                continue
            mean = np.exp(2j * np.pi * indices / n).mean()
            # A spot that lies evenly around the cell has no centre along this axis; it counts as 0.
            centre.append(0.0 if abs(mean) < 1e-9 else np.angle(mean) / (2 * np.pi) % 1.0 * n)
        found.append((len(members), centre))
    return found


def greenwood(found, nodes, side, periodic):
    """Returns h_c L/k_s by Greenwood's formula, or None if it gives no positive conductance."""
    longer = max(side)
    area = side[0] * side[1] / longer**2
    radii = np.array([math.sqrt(count / (nodes[0] * nodes[1]) * area / math.pi) for count, _ in found])
    centres = np.array([[c / n * s / longer for c, n, s in zip(centre, nodes, side)] for _, centre in found])
    shares = radii / radii.sum()
    offsets = centres[:, None] - centres[None]
    cell = [s / longer for s in side]
    if periodic:
        offsets = offsets - cell * np.round(offsets / cell)
    weights = np.outer(shares, shares)
    kernel = ewald(offsets.reshape(-1, 2), cell).reshape(weights.shape) if periodic else boussinesq(offsets)
    resistance = 0.5 / radii.sum() + (weights * kernel).sum()
    return 1 / (resistance * area) if resistance > 0 else None


def boussinesq(offsets):
    r = np.hypot(offsets[..., 0], offsets[..., 1])
    with np.errstate(divide="ignore"):
        return np.where(r > 0, 1 / (np.pi * r), 0.0)


erfc = np.vectorize(math.erfc, otypes=[float])


def ewald(offsets, cell):
    """Returns the periodic displacement by a unit force at each offset, without 1/(π r) at r = 0."""
    area = cell[0] * cell[1]
    alpha = math.sqrt(math.pi / area)
    total = np.full(len(offsets), -2 * math.sqrt(math.pi) / (alpha * area))
    images = [range(-math.ceil(6 / (alpha * s)) - 1, math.ceil(6 / (alpha * s)) + 2) for s in cell]
    for m in images[0]:
        for n in images[1]:
            r = np.hypot(offsets[:, 0] + m * cell[0], offsets[:, 1] + n * cell[1])
            far = r > 1e-9
            total[far] += erfc(alpha * r[far]) / r[far]
            total[~far] -= 2 * alpha / math.sqrt(math.pi)
    waves = [range(-math.ceil(12 * alpha * s / (2 * math.pi)), math.ceil(12 * alpha * s / (2 * math.pi)) + 1) for s in cell]
    for m in waves[0]:
        for n in waves[1]:
            q = 2 * np.pi * np.array([m / cell[0], n / cell[1]])
            size = math.hypot(*q)
            if size > 0:
                total += 2 * np.pi / area * math.erfc(size / (2 * alpha)) / size * np.cos(offsets @ q)
    return total / np.pi


# Partial slip


def step(turns, load):
    """Moves the path of tangential loads to `load`. `turns` are the loads that the contact remembers."""
    turns = list(turns)
    if turns:
        before = turns[-2] if len(turns) > 1 else 0.0
        if (load - turns[-1]) * (turns[-1] - before) >= 0:
            turns.pop()
    while len(turns) >= 2 and abs(load - turns[-1]) >= abs(turns[-2] - turns[-1]):
        del turns[-2:]
    if len(turns) == 1 and load * turns[0] <= 0 and abs(load) >= abs(turns[0]):
        turns = []
    return turns + [load]


def branches(turns):
    """Returns the weight and the share of the normal load of each term of the traction."""
    ends = zip([0.0] + turns, turns)
    for index, (start, end) in enumerate(ends):
        weight = 1.0 if index == 0 else 2.0
        if start != end:
            yield weight * np.sign(end - start), 1.0 - abs(end - start) / weight


def needed_shares(path):
    shares, turns = set(), []
    for load in path:
        turns = step(turns, load)
        shares |= {share for _, share in branches(turns)}
    return shares


class Checks:
    """Comparisons of the rows of a case, and the errors that they found."""

    def __init__(self, index):
        self.index, self.rows, self.wrong, self.where = index, 0, [], ""

    def row(self, where):
        self.rows += 1
        self.where = where

    def that(self, holds, what):
        if not holds:
            self.wrong.append(f"case {self.index}, {self.where}: {what}")

    def equal(self, what, found, told, within):
        if told is None or found is None:
            self.that(told is None and found is None, f"{what} is {found}, told {told}")
        else:
            self.that(abs(found - told) <= within, f"{what} is {found:.9g}, told {told:.9g}")


def check_case(index, case, tables):
    checks = Checks(index)
    h = case["heights"]
    periodic = case["boundary"] == "periodic"
    if "against" in case:
        h = h + moved(case["against"], case["shift"], case["mirror"])
    contact = press(case)
    table = {name: contact.table[name] for name in contact.table.names if name not in ("contact", "pressures")}
    solved = tables["c"]
    body = Body(case)
    slope = rms_slope(h, case["size"], periodic)
    told_slope = float(table["rms_slope"][0])
    checks.where = "surface"
    checks.equal("the rms slope", slope or told_slope, told_slope, 1e-9 * told_slope)
    states = [
        State(checks, case, body, h, told_slope, contact, table, row) for row in range(len(table["load"]))
    ]
    maxima = {state.load: state for state in states if state.branch != "unloading"}
    for row, state in enumerate(states):
        checks.row(f"{state.branch} load {state.load:.6g}")
        kept = None
        if state.branch == "unloading":
            kept = maxima[float(table["maximum_load"][row])].depth()
        state.solve(kept)
        told = same_row(solved, table, row)
        for name in ("contact_nodes", "mean_gap", "energy", "residual", "stop", "stiffness"):
            checks.that(is_same(told[name], table[name][row]), f"{name} of the study is {told[name]}, of press {table[name][row]}")
        state.check_solution(told)
        checks.rows += 1
        state.check_measures(same_row(tables["m"], table, row))
        for name in ("p", "g"):
            checks.rows += 1
            state.check_histogram(name, tables[name])
    if case["tangential"]:
        check_friction(checks, case, body, states, tables["f"])
    return checks


def is_same(one, other):
    if one is None or (isinstance(other, float) and math.isnan(other)):
        return one is None and (other is None or math.isnan(other))
    return one == other


def same_row(frame, table, row):
    """Returns the row of a table of the study with the load and branch of a row of `press`."""
    keep = polars.col("load") == float(table["load"][row])
    if "branch" in frame.columns:
        keep &= polars.col("branch") == str(table["branch"][row])
    rows = frame.filter(keep)
    assert len(rows) == 1, f"{len(rows)} rows"
    return rows.row(0, named=True)


class State:
    """Contact of a case under one load."""

    def __init__(self, checks, case, body, h, slope, contact, table, row):
        self.checks, self.case, self.body, self.h, self.slope = checks, case, body, h, slope
        self.load = float(table["load"][row])
        self.branch = str(table["branch"][row]) if "branch" in table else "loading"
        self.p = np.asarray(contact.pressure(row))
        self.gap_of_press = np.asarray(contact.gap(row))
        self.stop = str(table["stop"][row])
        self.step = slope * min(s / n for s, n in zip(case["size"], h.shape))
        self.hardness, self.saturated = np.inf, np.zeros(h.shape, bool)
        if "hardness" in case:
            self.hardness = float(table["hardness_reduced"][row]) * slope
            self.saturated = self.p >= self.hardness
            if self.saturated.sum() != table["saturated_nodes"][row]:
                self.saturated = self.p > self.hardness * (1 + 1e-14)

    def depth(self):
        """Returns the plastic depth under this load, which the surface keeps."""
        g = relative_gap(self.p, self.body.displacement(self.p) - self.h, self.saturated)
        return np.where(self.saturated, np.maximum(-g, 0.0), 0.0)

    def solve(self, kept):
        """Computes the gap from the pressures. `kept` is the plastic depth from a larger load."""
        self.kept = kept
        self.u = self.body.displacement(self.p)
        surface = self.h if kept is None else self.h - kept
        self.g = relative_gap(self.p, self.u - surface, self.saturated)
        self.in_contact = self.p > 0
        elastic = self.in_contact & ~self.saturated
        worst = [np.abs(self.g[elastic]).max(initial=0), -self.g[~self.in_contact].min(initial=0), self.g[self.saturated].max(initial=0)]
        self.violation = max(worst) / self.step
        self.noise = 1e-12 * max(np.ptp(self.h), np.ptp(self.u), np.abs(self.u).max())
        # Where the table tells a gap, it is that of a solution within the tolerance.
        self.within = 2 * self.violation * self.step + 3e6 * self.noise * 1e-6 + self.noise

    def check_solution(self, told):
        checks, p, g = self.checks, self.p, self.g
        load = self.load * self.slope
        checks.that(p.min() >= 0 and p.max() <= self.hardness, f"pressures from {p.min()} to {p.max()}")
        checks.equal("the mean pressure", p.mean() / load, 1.0, 1e-10)
        if self.stop != "pair-limit":
            checks.that(
                self.violation <= TOLERANCE * (1 + 1e-3) + self.noise / self.step,
                f"{self.stop}, but the residual is {self.violation:.3g}, told {told['residual']:.3g}",
            )
        energy = 0.5 * (p * self.u).mean()
        if self.body.uniform is not None:
            energy += 0.5 * load**2 * self.body.uniform
            checks.equal("the uniform compression", load * self.body.uniform, told["uniform_compression"], 1e-11 * load * self.body.uniform + 1e-300)
            approach = load * self.body.uniform + (self.h.max() - self.h.mean()) - np.where(self.in_contact, 0.0, g).mean()
            checks.equal("the approach", approach, told["approach"], self.within + 1e-11 * abs(approach))
        checks.equal("the energy", energy, told["energy"], 1e-9 * (p * np.abs(self.u)).mean() + 1e-11 * energy + 1e-300)
        checks.equal("the mean gap", np.where(self.in_contact, 0.0, g).mean(), told["mean_gap"], self.within)
        checks.equal("contact nodes", self.in_contact.sum(), told["contact_nodes"], 0)
        if "hardness" in self.case:
            checks.equal("saturated nodes", self.saturated.sum(), told["saturated_nodes"], 0)
            depth = self.depth().mean() if self.kept is None else self.kept.mean()
            checks.equal("the yielded depth", depth, told["mean_yielded_depth"], self.within)
            if "residual_depth" in told:
                checks.equal("the residual depth", depth, told["residual_depth"], self.within)
                checks.equal("the plastic work", depth * self.hardness, told["plastic_work"], self.within * self.hardness)
        if self.body.free:
            checks.equal("the mean displacement", self.u.mean(), told["mean_displacement"], 1e-9 * np.abs(self.u).max())
        gap = np.where(self.in_contact & ~self.saturated, 0.0, g)
        apart = np.abs(np.asarray(self.gap_of_press) - g)[~self.in_contact].max(initial=0)
        checks.that(apart <= self.within, f"the gaps differ by {apart:.3g} of {np.abs(gap).max():.3g}")
        self.check_stiffness(told)

    def check_stiffness(self, told):
        longer = max(self.case["size"])
        if self.in_contact.sum() > DENSE_NODES or self.stop == "pair-limit":
            return
        if self.in_contact.all() and not self.body.free:
            return
        matrix = self.matrix()
        for name, free in [("stiffness", self.in_contact & ~self.saturated), ("unloading_stiffness", self.in_contact)]:
            if name not in told or not free.any():
                continue
            if free.all() and not self.body.free:
                continue
            nodes = np.flatnonzero(free)
            inner = matrix[np.ix_(nodes, nodes)]
            mean = np.linalg.solve(inner, np.ones(nodes.size)).sum() / self.h.size
            self.checks.equal(f"the {name}", longer * mean, told[name], 1e-6 * longer * mean)

    def matrix(self):
        if not hasattr(self.body, "dense"):
            self.body.dense = self.body.matrix()
        return self.body.dense

    def check_measures(self, told):
        checks, case = self.checks, self.case
        periodic = case["boundary"] == "periodic"
        found = spots(self.in_contact, periodic)
        checks.equal("spots", len(found), told["spots"], 0)
        checks.equal("clusters", len(found), told["clusters"], 0)
        checks.equal("the largest cluster", max((count for count, _ in found), default=0), told["largest_cluster"], 0)
        checks.equal("the area", self.in_contact.mean(), told["area_fraction"], 1e-15)
        checks.equal("the mean contact pressure", self.p[self.in_contact].mean(), told["mean_contact_pressure"], 1e-10 * self.p.max())
        side, nodes = case["size"], self.h.shape
        radii = [math.sqrt(count / self.h.size * side[0] * side[1] / math.pi) for count, _ in found]
        checks.equal("the spot radius", np.mean(radii), told["mean_spot_radius"], 1e-12 * max(radii))
        if "layer" in case:
            checks.that(told["greenwood_conductance"] is None, "a layer has no conductance")
            return
        expected = greenwood(found, nodes, side, periodic)
        told_conductance = told["greenwood_conductance"]
        if expected is not None and told_conductance is not None:
            # Close to the pole of the formula, rounding errors are larger.
            expected, told_conductance = 1 / expected, 1 / told_conductance
            scale = 0.5 / sum(r / max(side) for r in radii) / (side[0] * side[1] / max(side) ** 2) ** -1
        else:
            scale = 0.0
        checks.equal("Greenwood's resistance", expected, told_conductance, 1e-9 * scale)
        known = "unloading_stiffness" if "unloading_stiffness" in told else "stiffness"
        checks.that(is_same(told[known], told["contact_conductance"]), "the conductance is not the stiffness")

    def check_histogram(self, name, table):
        checks = self.checks
        keep = polars.col("load") == self.load
        if "branch" in table.columns:
            keep &= polars.col("branch") == self.branch
        rows = table.filter(keep)
        if name == "p":
            count, to = self.case["bins"]["pressure"]
            values, noise, prefix = self.p[self.in_contact] / self.slope, 1e-12 * self.p.max() / self.slope, "pressure"
            middle = "contact_pressure"
        else:
            count, to = self.case["bins"]["gap"]
            unit = self.h.std()
            # Gaps beyond the contact are counted, not negative ones.
            values, noise, prefix = np.maximum(self.g[~self.in_contact], 0) / unit, self.within / unit, "gap"
            middle = "gap"
        width = f"{prefix}_bin_width"
        nodes = rows[f"{prefix}_nodes"].to_numpy()
        checks.that(len(rows) == count, f"{len(rows)} bins of {prefix}s for {count}")
        if len(rows) != count:
            return
        beyond = rows[f"{prefix}_nodes_beyond"][0]
        checks.equal(f"nodes in bins of {prefix}s", values.size, nodes.sum() + beyond, 0)
        edges = np.arange(1, count + 1) * (to / count)
        checks.that(np.allclose(rows[middle], edges - 0.5 * to / count, rtol=1e-12), f"centres of bins of {prefix}s")
        below = np.cumsum(nodes)
        least = (values[None, :] < edges[:, None] - noise).sum(1)
        most = (values[None, :] <= edges[:, None] + noise).sum(1)
        checks.that(((least <= below) & (below <= most)).all(), f"{prefix}s below {edges} are {below}, between {least} and {most}")
        checks.that(np.allclose(rows[f"{prefix}_density"], nodes / (self.h.size * to / count), rtol=1e-12), f"density of {prefix}s in bins of {width}")


def check_friction(checks, case, body, states, table):
    friction = case["friction"]
    ratio = (2 - case["poisson"]) / (2 * (1 - case["poisson"]))
    loads = np.array([state.load for state in states])

    def at(load):
        near = np.flatnonzero(np.abs(loads / load - 1) < 1e-9)
        return states[near[0]] if near.size else None

    shares = needed_shares(case["tangential"])
    expected = [state for state in states if all(at(share * state.load) for share in shares)]
    checks.where = "friction"
    checks.equal("rows of partial slip", len(expected) * len(case["tangential"]), len(table), 0)
    for full in expected:
        rows = table.filter(polars.col("load") == full.load).rows(named=True)
        solved = {share: at(share * full.load) for share in shares}
        if any(state.stop == "pair-limit" for state in [full, *solved.values()]):
            continue
        check_path(checks, case, body, full, solved, rows, friction, ratio)


def check_path(checks, case, body, full, solved, rows, friction, ratio):
    p, contact = full.p, full.in_contact
    # Errors of displacements from the tolerance of the normal contacts.
    error = 20 * friction * ratio * (max(state.within for state in [full, *solved.values()]))
    approach = lambda state: (state.u.mean() if body.free else 0.0) - np.where(state.in_contact, 0.0, state.g).mean()
    turns, slipped, dissipated, loss_error = [], 0.0, 0.0, 0.0
    for number, (load, told) in enumerate(zip(case["tangential"], rows)):
        checks.row(f"load {full.load:.6g}, tangential load {load}")
        checks.equal("the tangential load", load, told["tangential_load"], 1e-12)
        turns = step(turns, load)
        terms = list(branches(turns))
        traction, displacement = np.zeros_like(p), 0.0
        for weight, share in terms:
            traction += weight * friction * (p - solved[share].p)
            displacement += weight * friction * ratio * (approach(full) - approach(solved[share]))
        stick = solved[terms[-1][1]].in_contact if terms else contact
        checks.equal("the stick fraction", stick.mean(), told["stick_fraction"], 1e-15)
        checks.equal("the slip fraction", contact.mean() - stick.mean(), told["slip_fraction"], 1e-14)
        checks.equal("the traction", friction * load * p.mean(), told["tangential_traction"], 1e-9 * friction * p.mean())
        checks.equal("the mean of tractions", traction.mean(), told["tangential_traction"], 1e-8 * friction * p.mean())
        checks.equal("the displacement", displacement, told["tangential_displacement"], error)
        # Coulomb's law on the way from the state before.
        tangential = ratio * body.displacement(traction)
        slip = np.where(contact, told["tangential_displacement"] - tangential, 0.0)
        run = slip - slipped
        force = np.abs(traction) - friction * p
        checks.that(force[contact].max() <= 1e-6 * friction * p.max(), "a traction exceeds the friction")
        moves = contact & (np.abs(run) > error)
        against = traction * run
        checks.that((force[moves] >= -1e-6 * friction * p.max()).all(), f"a point slips by {np.abs(run[moves]).max(initial=0):.3g} without the friction")
        checks.that((against[moves] > 0).all(), "a point slips against its traction")
        dissipated += friction * (p * np.abs(run)).mean()
        loss_error += error * friction * p.mean()
        checks.equal("the dissipated energy", dissipated, told["frictional_dissipation"], 2 * loss_error + 1e-8 * dissipated)
        if number == 0 and terms:
            stick = solved[terms[0][1]]
            energy = 0.5 * (full.p * full.u).mean() - 0.5 * (stick.p * stick.u).mean()
            work = friction**2 * ratio * (p.mean() * (approach(full) - approach(stick)) - energy)
            elastic = 0.5 * (traction * tangential).mean()
            checks.equal("the work minus the elastic energy", work - elastic, told["frictional_dissipation"], 2 * loss_error + 1e-9 * work)
        slipped = slip


def check_many(seed, indices, verbose=False):
    """Returns the number of rows of some cases, and the errors found in them."""
    cases = {index: draw(seed, index) for index in indices}
    total = {"rows": 0, "wrong": []}
    with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        folder = Path(name)
        text = '[study]\nname = "cases"\n' + "".join(manifest(case, index, folder) for index, case in cases.items())
        study = asperity.Study.parse(text, folder / "data", folder / "cases.toml")
        run = study.run(jobs=1, progress=False)
        if run.failed:
            total["wrong"].append(f"cases {min(indices)} to {max(indices)}: {run.failed} tasks failed")
        for index, case in cases.items():
            read = lambda stage: polars.read_parquet(folder / f"data/results/cases/{stage}{index}.parquet")
            tables = {stage: read(stage) for stage in ("cmpgf" if case["tangential"] else "cmpg")}
            try:
                checks = check_case(index, case, tables)
            except Exception as error:  # The number of the case allows to repeat it.
                if verbose:
                    raise
                total["wrong"].append(f"case {index}: {type(error).__name__}: {error}")
                continue
            total["rows"] += checks.rows
            total["wrong"] += checks.wrong
            if verbose:
                print({key: value for key, value in case.items() if key not in ("heights", "against")}, checks.rows, "rows")
    return total
