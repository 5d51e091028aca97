"""Statistics of random surfaces, which are computed again from their heights by their definitions.

Part of `differential.py`. A case is a map, periodic or not, on a random mesh. This module computes with NumPy
alone, by sums over pairs of nodes and over all modes: the autocorrelation along the axes and by distance, slopes
and curvatures by scale, power spectra, roughness parameters, moments, and the wavelength below which the
tip of the instrument has rounded the peaks.
"""

import math
import tempfile
import warnings
from pathlib import Path

import numpy as np
import polars

import asperity
from differential import draw_mesh, heights, wavenumbers
from differential_measures import Checks, rms_slope, rounded, stage

MEASURES = ["autocorrelation", "scales", "spectrum", "roughness"]


def draw(seed, index):
    rng = np.random.default_rng([seed, index, 2])
    nodes, side = draw_mesh(rng, smallest=4)
    side = [rounded(s) for s in side]
    _, h = heights(rng, nodes, side)
    case = {"heights": h, "size": side, "periodic": bool(rng.random() < 0.6), "along": str(rng.choice(["x", "y"]))}
    # Close to the curvature of the peaks, from finer than the mesh to longer than the side.
    n, s = (nodes[0], side[0]) if case["along"] == "x" else (nodes[1], side[1])
    scale = s / n * rng.uniform(1, n / 2)
    case["radius"] = rounded(0.5 / max(sharpest(case, scale), 1e-9) * 10 ** rng.uniform(-0.2, 0.2))
    return case


def manifest(case, index, folder):
    np.save(folder / f"a{index}.npy", case["heights"])
    text = stage(
        f"a{index}", kind="generate", method="file", path=f"a{index}.npy", periodic=case["periodic"],
        side=list(case["size"]), tip_radius=case["radius"], align="median", align_along=case["along"],
    )
    for name in MEASURES:
        text += stage(f"{name}{index}", kind="measure", **{"from": f"a{index}"}, what=name)
    return text


def aligned(case):
    """Returns the heights after `align = "median"`: each line minus its median, with the same mean."""
    h = case["heights"]
    lines = np.median(h, axis=0 if case["along"] == "x" else 1, keepdims=True)
    return h - lines + lines.mean()


def sharpest(case, distance):
    """Returns the largest curvature of a peak along the lines at a distance, between nodes by linear interpolation."""
    h = aligned(case)
    axis = 0 if case["along"] == "x" else 1
    h, n = (h, h.shape[0]) if axis == 0 else (h.T, h.shape[1])
    steps = distance / (case["size"][axis] / n)
    low, part = math.floor(steps + 1e-12), steps - math.floor(steps + 1e-12)
    x = np.arange(n)

    def at(index):
        inside = case["periodic"] | ((index >= 0) & (index < n))
        return np.where(inside[:, None], h[index % n], np.nan)

    def between(sign):
        near, far = at(x + sign * low), at(x + sign * (low + 1)) if part > 0 else 0.0
        return near + part * (far - near) if part > 0 else near

    second = between(1) + between(-1) - 2 * h
    return 0.0 if np.isnan(second).all() else -np.nanmin(second) / distance**2


def check_tip(checks, case, told):
    checks.row("tip")
    axis = 0 if case["along"] == "x" else 1
    n, side = case["heights"].shape[axis], case["size"][axis]
    step, limit = side / n, 0.5 / case["radius"]
    longest = n / 2 if case["periodic"] else (n - 1) // 2
    if longest < 1 or sharpest(case, step) < limit * (1 - 1e-9):
        checks.that(told is None, f"no peak is too sharp, told {told}")
    elif sharpest(case, longest * step) > limit * (1 + 1e-9):
        checks.equal("the tip wavelength", side, told, 1e-9 * side)
    elif told is None:
        checks.that(sharpest(case, step) < limit * (1 + 1e-9), "no tip wavelength")
    elif told < side * (1 - 1e-9):
        # The curvature passes the limit there, to the accuracy of the search.
        close = 3e-7 * told / 2
        around = [sharpest(case, told / 2 + by) / limit for by in (-close, close)]
        checks.that(min(around) < 1 + 1e-5 and max(around) > 1 - 1e-5, f"at {told} the curvatures are {around} of the limit")


def check_autocorrelation(checks, case, h, table):
    nodes, periodic = h.shape, case["periodic"]
    d = h - h.mean()
    scale = (d**2).mean()
    steps = [s / n for s, n in zip(case["size"], nodes)]

    def product(i, j):
        if periodic:
            return (d * np.roll(d, (-i, -j), (0, 1))).mean()
        one = d[max(-i, 0) : nodes[0] - max(i, 0), max(-j, 0) : nodes[1] - max(j, 0)]
        other = d[max(i, 0) : nodes[0] + min(i, 0), max(j, 0) : nodes[1] + min(j, 0)]
        return (one * other).mean()

    half = [n // 2 for n in nodes]
    expected = [("x", i * steps[0], product(i, 0)) for i in range(half[0] + 1)]
    expected += [("y", j * steps[1], product(0, j)) for j in range(half[1] + 1)]
    longer = max(steps)
    rings = {0: [product(0, 0)]}
    for i in range(-half[0], half[0] + 1):
        for j in range(-half[1], half[1] + 1):
            ring = math.hypot(i * steps[0], j * steps[1]) / longer
            if abs(ring % 1 - 0.5) < 1e-9:
                return  # Rounding errors decide to which ring the lag belongs.
            if round(ring) > 0:
                rings.setdefault(round(ring), []).append(product(i, j))
    last = min(half[0] * steps[0], half[1] * steps[1]) / longer
    expected += [("radial", k * longer, np.mean(rings[k])) for k in sorted(rings) if k <= last + 1e-9]
    checks.where = "autocorrelation"
    checks.equal("rows", len(expected), len(table), 0)
    for (along, lag, value), told in zip(expected, table.rows(named=True)):
        checks.row(f"autocorrelation along {along} at {lag:.6g}")
        checks.that(told["along"] == along, f"the direction is {told['along']}")
        checks.equal("the lag", lag, told["lag"], 1e-12 * max(case["size"]))
        checks.equal("the product", value, told["autocorrelation"], 1e-11 * scale)


def check_scales(checks, case, h, table):
    for told in table.rows(named=True):
        axis = 0 if told["along"] == "x" else 1
        line = h if axis == 0 else h.T
        n = line.shape[0]
        spacing = case["size"][axis] / n
        steps = round(told["distance"] / spacing)
        checks.row(f"scale {steps} along {told['along']}")
        checks.equal("the distance", steps * spacing, told["distance"], 1e-12 * told["distance"])
        if case["periodic"]:
            first = np.roll(line, -steps, 0) - line
            second = np.roll(line, -steps, 0) + np.roll(line, steps, 0) - 2 * line
        else:
            first = line[steps:] - line[:-steps]
            second = line[2 * steps :] + line[: -2 * steps] - 2 * line[steps:-steps]
        for what, values, power in [("slope", first, 1), ("curvature", second, 2)]:
            value = math.sqrt((values**2).mean()) / told["distance"] ** power
            checks.equal(f"the {what}", value, told[f"{what}_at_scale"], 1e-11 * np.ptp(h) / told["distance"] ** power)


def check_spectrum(checks, case, h, table):
    nodes, side = h.shape, case["size"]
    d = h - h.mean()
    square = 1.0
    if not case["periodic"]:
        window = np.outer(*[np.sin(np.pi * (np.arange(n) + 0.5) / n) ** 2 for n in nodes])
        d, square = d * window, (window**2).mean()
    power = np.abs(np.fft.fft2(d) / h.size) ** 2 * side[0] * side[1] / square
    ring = wavenumbers(nodes, side) * max(side) / (2 * np.pi)
    if (np.abs(ring % 1 - 0.5) < 1e-9).any():
        return
    ring = np.round(ring).astype(int)
    ring[0, 0] = -1
    expected = [(k, power[ring == k]) for k in np.unique(ring[ring >= 0])]
    checks.where = "spectrum"
    checks.equal("rings", len(expected), len(table), 0)
    for (k, values), told in zip(expected, table.rows(named=True)):
        checks.row(f"ring {k}")
        checks.equal("the wavenumber", 2 * np.pi * k / max(side), told["wavenumber"], 1e-11 * told["wavenumber"])
        checks.equal("modes", values.size, told["modes"], 0)
        checks.equal("the density", values.mean(), told["spectral_density"], 1e-12 * power.max() + 1e-9 * values.mean())


def check_roughness(checks, case, h, told, surface):
    checks.row("roughness")
    d = h - h.mean()
    sq, reach = math.sqrt((d**2).mean()), np.ptp(h)
    slope = rms_slope(h, case["size"], case["periodic"])
    expected = {
        "Sq": (sq, reach), "Sa": (np.abs(d).mean(), reach), "Sz": (reach, reach),
        "Ssk": ((d**3).mean() / sq**3, 1), "Sku": ((d**4).mean() / sq**4, 10), "Sdq": (slope, slope),
    }
    for name, (value, scale) in expected.items():
        checks.equal(name, value, told[name], 1e-9 * scale)
    checks.equal("the rms slope", slope, surface["rms_slope"], 1e-9 * slope)
    checks.equal("the rms height", sq, surface["rms_height"], 1e-9 * sq)


def check_many(seed, indices, verbose=False):
    """Returns the number of rows of some cases, and the errors found in them."""
    cases = {index: draw(seed, index) for index in indices}
    # A line that is removed may leave a flat map, which is refused.
    cases = {index: case for index, case in cases.items() if np.ptp(aligned(case)) > 1e-6 * np.ptp(case["heights"])}
    total = {"rows": 0, "wrong": []}
    if not cases:
        return total
    with tempfile.TemporaryDirectory() as name, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        folder = Path(name)
        text = '[study]\nname = "cases"\n' + "".join(manifest(case, index, folder) for index, case in cases.items())
        study = asperity.Study.parse(text, folder / "data", folder / "cases.toml")
        run = study.run(jobs=1, progress=False)
        if run.failed:
            total["wrong"].append(f"cases {min(indices)} to {max(indices)}: {run.failed} tasks failed")
        for index, case in cases.items():
            checks = Checks(index)
            read = lambda stage: polars.read_parquet(folder / f"data/results/cases/{stage}{index}.parquet")
            try:
                h, surface = aligned(case), read("a").row(0, named=True)
                check_tip(checks, case, surface["tip_wavelength"])
                check_autocorrelation(checks, case, h, read("autocorrelation"))
                check_scales(checks, case, h, read("scales"))
                check_spectrum(checks, case, h, read("spectrum"))
                check_roughness(checks, case, h, read("roughness").row(0, named=True), surface)
            except Exception as error:  # The number of the case allows to repeat it.
                if verbose:
                    raise
                checks.wrong.append(f"case {index}: {type(error).__name__}: {error}")
            total["rows"] += checks.rows
            total["wrong"] += checks.wrong
            if verbose:
                print({key: value for key, value in case.items() if key != "heights"}, checks.rows, "rows")
    return total
