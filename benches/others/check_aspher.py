"""Checks what the guide says about ASPHER and rfgen."""

from importlib.metadata import version

import aspher
import numpy as np
import rfgen

from common import Checks, gradient


def solver(check: Checks) -> None:
    """Presses a paraboloid of radius 1 on a cell of side 1 with E* = 1."""
    x = (np.arange(64) + 0.5) / 64 - 0.5
    gap = ((x[:, None] ** 2 + x[None, :] ** 2) / 2).ravel()
    peaks = {}
    for backend in ("", "periodic", "fft"):
        result = aspher.ContactSolver(64, 1.0, 1.0, backend=backend).solve(gap, p_nominal=0.02)
        peaks[backend] = np.max(result.pressure)
    check(
        "peak pressure, default backend over free patch", peaks[""] / peaks["fft"], 0.99999, 1.00001
    )
    check("peak pressure, periodic over default backend", peaks["periodic"] / peaks[""], 1.01, 1.03)
    check(
        "share of contact_area of the nodes",
        result.contact_area / (result.pressure > 0).mean(),
        1.0,
    )
    check("smallest gap of the result", abs(np.min(result.gap)), 0, 1e-6)
    raised = aspher.ContactSolver(64, 1.0, 1.0, backend="periodic").solve(-gap, p_nominal=0.02)
    check(
        "heights in place of gaps: peak pressure over that of the summit",
        np.max(raised.pressure) / peaks["periodic"],
        1.5,
        10,
    )
    stopped = aspher.ContactSolver(64, backend="periodic").solve(gap, p_nominal=0.02, max_iter=2)
    check("`converged` after two iterations, without an error", float(stopped.converged), 0.0)
    for poisson_ratio in (0.0, 0.5):
        sliding = aspher.FrictionSolver(64, 1.0, 1.0, poisson_ratio, aspher.CoulombFriction(0.3))
        sliding.set_gap(gap.reshape(64, 64))
        sliding.step(p_bar=0.02)
        normal = np.array(sliding.pressure)
        sliding.step(q_bar=(0.003, 0.0))
        check(
            f"change of the pressures by a tangential load, ν = {poisson_ratio}",
            abs(np.array(sliding.pressure) - normal).max(),
            -1e-12,
            1e-12,
        )


def fields(check: Checks) -> None:
    n = 256
    field = rfgen.selfaffine_field(2, n, 0.8, 4 / n, 32 / n, rng=np.random.default_rng(1))
    field = field - field.mean()
    wave_numbers = np.hypot(*np.meshgrid(np.fft.fftfreq(n, 1 / n), np.fft.fftfreq(n, 1 / n)))
    inside = (wave_numbers > 3.9) & (wave_numbers < 32.1)
    power = abs(np.fft.fft2(field)) ** 2
    check(
        "share of the power between waves k_low × N and k_high × N",
        power[inside].sum() / power.sum(),
        0.99,
        1,
    )
    quantities = rfgen.rms_quantities(field, 1 / n)
    check(
        "rms_slope × √2 over exact rms gradient",
        np.sqrt(2) * quantities["rms_slope"] / gradient(field, (1, 1)),
        0.98,
        1.02,
    )
    lifted = field + 5 * field.std()
    check(
        "nayak_parameter of a map that is lifted by 5 rms heights over that of the map",
        rfgen.nayak_parameter(lifted, 1 / n) / rfgen.nayak_parameter(field, 1 / n),
        26.0,
    )
    _, modes = rfgen.psd_2d(field, 1 / n)
    check("sum of psd_2d, a power per wave, over ⟨h²⟩", modes.sum() / field.var(), 1.0)
    k, lines = rfgen.psd_along_axis(field, 0, 1 / n)
    check("first frequency of psd_along_axis, in waves", k[0], 1.0)
    check("sum of psd_along_axis, over ⟨h²⟩", lines.sum() / field.var(), 0.45, 0.5)
    plateau = rfgen.selfaffine_field(
        2, n, 0.8, 4 / n, 32 / n, plateau=True, rng=np.random.default_rng(1)
    )
    check(
        "mean height of plateau=True in rms heights", abs(plateau.mean()) / plateau.std(), 0.01, 1
    )
    drawn = [
        rfgen.selfaffine_field(2, n, 0.8, 4 / n, 32 / n, rng=np.random.default_rng(seed)).std()
        for seed in range(20)
    ]
    check("scatter of the rms height over 20 surfaces", np.std(drawn) / np.mean(drawn), 0.01, 0.2)


def main() -> None:
    check = Checks(f"ASPHER {version('aspher')}, rfgen {version('rfgen')}")
    solver(check)
    fields(check)
    check.finish()


if __name__ == "__main__":
    main()
