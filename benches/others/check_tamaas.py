"""Checks what the guide says about Tamaas."""

import numpy as np
import tamaas

from common import Checks, edges, gradient, heights

TOLERANCE = 1e-12
LOAD = 0.002


def unit_cell() -> np.ndarray:
    """Returns the surface of `others.py` with a side of 1 and without its mean height."""
    h = heights()
    return (h - h.mean()) / 100e-6


def model(h: np.ndarray, kind=tamaas.model_type.basic_2d, poisson_ratio: float = 0.0):
    made = tamaas.ModelFactory.createModel(kind, [1.0, 1.0], list(h.shape))
    made.E, made.nu = 1.0, poisson_ratio
    return made


def press(h: np.ndarray):
    body = model(h)
    solver = tamaas.PolonskyKeerRey(body, h, TOLERANCE)
    solver.solve(LOAD)
    return np.array(body.traction), np.array(body.displacement)


def displacements(check: Checks, h: np.ndarray) -> None:
    pressure, displacement = press(h)
    lifted = press(h + 0.3)[1]
    check(
        "smallest gap, displacement − heights, in units of the rms height",
        abs((displacement - h).min()) / h.std(),
        0,
        1e-9,
    )
    check(
        "displacement grows with the mean height of the map, by",
        (lifted - displacement).mean(),
        0.3,
    )
    check("mean of the tractions over the load", pressure.mean() / LOAD, 1.0)


def tolerance(check: Checks, h: np.ndarray) -> None:
    solver = tamaas.PolonskyKeerRey(model(h), h, TOLERANCE)
    solver.max_iter = 3
    check(
        "error that solve() returns, without raising, after three iterations",
        solver.solve(LOAD),
        1e-3,
        1.0,
    )


def areas(check: Checks, h: np.ndarray) -> None:
    pressure, _ = press(h)
    contact = pressure > 0
    body = model(h)
    gap = tamaas.PolonskyKeerRey.gap
    solver = tamaas.PolonskyKeerRey(body, h, TOLERANCE, gap, gap)
    solver.max_iter = 20000
    solver.solve((press(h)[1] - h).mean())
    everywhere = (np.array(body.traction) > 0).mean()
    opening = np.array(body.displacement) - h
    check("share of nodes in contact by positive tractions", contact.mean(), 0.08, 0.12)
    check("the same with the gap as unknown", everywhere, 0.9, 1.0)
    check(
        "the same with the gap as unknown, by zero gaps, over the first",
        (opening <= opening.min() + 1e-15).mean() / contact.mean(),
        0.99,
        1.01,
    )
    clusters = tamaas.FloodFill.getClusters(contact, False)
    perimeter = sum(cluster.perimeter for cluster in clusters)
    check(
        "perimeter of the clusters over the number of cell edges", perimeter / edges(contact), 1.0
    )
    corrected = tamaas.Statistics2D.contact(pressure, perimeter)
    coefficient = (np.pi - 1 + np.log(2)) / 24
    check(
        "(area − contact(tractions, perimeter)) × nodes/perimeter",
        (contact.mean() - corrected) * contact.size / perimeter,
        coefficient,
    )


def statistics(check: Checks, h: np.ndarray) -> None:
    q, size = tamaas.Statistics2D, h.size
    slope = gradient(h, (1, 1))
    check("computeSpectralRMSSlope over rms gradient", q.computeSpectralRMSSlope(h) / slope, 1.0)
    check("computeFDRMSSlope over rms gradient", q.computeFDRMSSlope(h) / slope, 0.9, 1.0)
    check(
        "computeRMSHeights over rms height, N − 1",
        q.computeRMSHeights(h) / h.std(),
        np.sqrt(size / (size - 1)),
    )
    check("rms gradient² / m2 over 8 π²", slope**2 / q.computeMoments(h)[1] / (8 * np.pi**2), 1.0)
    lifted = h + 5 * h.std()
    check(
        "m0 of a map that is lifted by 5 rms heights", q.computeMoments(lifted)[0] / h.var(), 26.0
    )
    check(
        "largest of computePowerSpectrum over largest |ĥ|²",
        q.computePowerSpectrum(h).real.max() / abs(np.fft.fft2(h) / size).max() ** 2,
        1.0,
    )
    check(
        "computeAutocorrelation at 0 over mean square height",
        q.computeAutocorrelation(h).real[0, 0] / h.var(),
        1.0,
    )


def generators(check: Checks) -> None:
    """Averages ten surfaces; seeds that follow each other would not be independent."""
    seeds = np.random.default_rng(1).integers(1, 2**31 - 2, 10)
    for name, first in (("RandomPhase", 1), ("RandomPhase", 4), ("Filter", 4)):
        generator = getattr(tamaas, f"SurfaceGenerator{name}2D")([128, 128])
        spectrum = tamaas.Isopowerlaw2D()
        spectrum.q0, spectrum.q1, spectrum.q2, spectrum.hurst = first, first, 32, 0.8
        generator.spectrum = spectrum
        rms, slopes = [], []
        for seed in seeds:
            generator.random_seed = int(seed)
            surface = generator.buildSurface().copy()
            rms.append(surface.std() / spectrum.rmsHeights())
            slopes.append(gradient(surface, (1, 1)) / spectrum.rmsSlopes())
        label = f"SurfaceGenerator{name}2D, first wave {first}:"
        check(f"{label} rms height over that of the spectrum", np.mean(rms), 0.95, 1.3)
        check(f"{label} rms gradient over that of the spectrum", np.mean(slopes), 0.95, 1.05)
        check(f"{label} scatter of the rms gradient", np.std(slopes, ddof=1), 0.0, 0.1)


def friction(check: Checks) -> None:
    """Presses a sphere by a normal load alone, with a coefficient of friction of 0.3."""
    x = np.linspace(-0.5, 0.5, 32, endpoint=False)
    sphere = -(x[:, None] ** 2 + x[None, :] ** 2) / 2
    for poisson_ratio, low, high in ((0.3, 1.05, 1.1), (0.499999, 0.999, 1.001)):
        smooth = model(sphere, poisson_ratio=poisson_ratio)
        tamaas.PolonskyKeerRey(smooth, sphere, TOLERANCE).solve(0.02)
        rough = model(sphere, tamaas.model_type.surface_2d, poisson_ratio)
        solver = tamaas.Condat(rough, sphere, 1e-8, 0.3)
        solver.max_iter, solver.dump_freq = 3000, 10**6
        solver.solve([0.0, 0.0, 0.02])
        ratio = np.array(rough.traction)[..., 2].max() / np.array(smooth.traction).max()
        check(f"peak pressure with friction over without, ν = {poisson_ratio:g}", ratio, low, high)


def main() -> None:
    tamaas.set_log_level(tamaas.LogLevel.error)
    check = Checks(f"Tamaas {tamaas.__version__}")
    h = unit_cell()
    displacements(check, h)
    tolerance(check, h)
    areas(check, h)
    statistics(check, h)
    generators(check)
    friction(check)
    check.finish()


if __name__ == "__main__":
    main()
