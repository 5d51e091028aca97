"""Checks what the guide says about ContactMechanics and Adhesion."""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import ContactMechanics
import numpy as np
from Adhesion.Interactions import Exponential
from ContactMechanics import FreeFFTElasticHalfSpace, PeriodicFFTElasticHalfSpace, make_system
from SurfaceTopography import Topography
from SurfaceTopography.Uniform.GeometryAnalysis import inner_perimeter_area, outer_perimeter_area

from common import Checks, edges, heights

SIDES = (1.0, 1.0)
PRESSURE = 0.002


def press(h: np.ndarray, substrate, periodic: bool):
    surface = Topography(h, SIDES, periodic=periodic)
    system = make_system(substrate=substrate, surface=surface)
    return system.minimize_proxy(external_force=PRESSURE, pentol=1e-12)


def contacts(check: Checks, h: np.ndarray) -> None:
    result = press(h, PeriodicFFTElasticHalfSpace(h.shape, 1.0, SIDES), True)
    forces = np.asarray(result.jac)
    check("sum of `jac` over the force", forces.sum() / PRESSURE, 1.0)
    gap = result.x - result.offset - h
    check("smallest gap x − offset − heights, in rms heights", abs(gap.min()) / h.std(), 0, 1e-6)
    check("mean of x over pressure × side/(π E*)", result.x.mean() / (PRESSURE / np.pi), 1.0)
    contact = forces > 0
    inner = inner_perimeter_area(contact, True).sum() / edges(contact)
    outer = outer_perimeter_area(contact, True).sum() / edges(contact)
    check("nodes of inner_perimeter_area over cell edges", inner, 0.5, 0.9)
    check("nodes of outer_perimeter_area over cell edges", outer, 0.5, 0.9)
    system = make_system(
        substrate=PeriodicFFTElasticHalfSpace(h.shape, 1.0, SIDES),
        surface=Topography(h, SIDES, periodic=True),
    )
    stopped = system.minimize_proxy(external_force=PRESSURE, pentol=1e-12, maxiter=3)
    check("`success` after three iterations, without an error", float(stopped.success), 0.0)
    free = press(h, FreeFFTElasticHalfSpace(h.shape, 1.0, SIDES), False)
    check(
        "nodes of the displacements of a free patch over nodes of the map",
        free.x.size / h.size,
        4.0,
    )


def moduli(check: Checks) -> None:
    """Applies a wave of pressure; its displacement is λ/(π E*) times the pressure, on any mesh."""
    x = np.arange(64) / 64
    forces = np.cos(2 * np.pi * x)[:, None] * np.ones(64) / 64**2

    def effective(**keys) -> float:
        substrate = PeriodicFFTElasticHalfSpace((64, 64), 1.0, SIDES, **keys)
        return 1 / np.asarray(substrate.evaluate_disp(forces)).max()

    check(
        "E* for young=1, poisson=0.3 over that for young=1 alone",
        effective(poisson=0.3) / effective(),
        1 / 0.91,
    )
    check(
        "the same with a layer of 100 sides",
        effective(poisson=0.3, thickness=100.0) / effective(),
        1 / 0.91,
    )


def command(check: Checks, h: np.ndarray) -> None:
    """Presses a text map with ce_hard_wall; only the pressures as written can be wrong."""
    program = Path(sys.executable).with_name("ce_hard_wall")
    with TemporaryDirectory() as folder:
        np.savetxt(Path(folder, "heights.txt"), h)
        words = ["--physical_sizes", "1,1", "--pressure", str(PRESSURE), "--pressure-fn", "p.txt"]
        subprocess.run(
            [program, "heights.txt", *words], cwd=folder, check=True, capture_output=True
        )
        contact = np.loadtxt(Path(folder, "p.txt")) > 0
    summit = h >= np.sort(h.ravel())[-100]
    check(
        "share of the 100 highest nodes in contact, map as written", contact[summit].mean(), 0, 0.8
    )
    check("share of the 100 highest nodes in contact, transposed", contact.T[summit].mean(), 0.9, 1)


def adhesion(check: Checks) -> None:
    potential = Exponential(0.3, 0.1)
    energy, slope, _ = potential.evaluate(np.array([0.0, 0.1]), True, True, True)
    check("Exponential(w, ρ): energy at gap 0 over −w", energy[0] / -0.3, 1.0)
    check("the same at gap ρ over −w/e", energy[1] / (-0.3 / np.e), 1.0)
    check("derivative at gap 0 over w/ρ: positive, it is no pressure", slope[0] / 3.0, 1.0)


def main() -> None:
    check = Checks(f"ContactMechanics {ContactMechanics.__version__}")
    h = (heights() - heights().mean()) / 100e-6
    contacts(check, h)
    moduli(check)
    command(check, h)
    adhesion(check)
    check.finish()


if __name__ == "__main__":
    main()
