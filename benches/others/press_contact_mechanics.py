"""Presses the surface with ContactMechanics from Python, in SI units."""

import numpy as np
from ContactMechanics import PeriodicFFTElasticHalfSpace, make_system
from SurfaceTopography import Topography
from SurfaceTopography.Uniform.GeometryAnalysis import coordination

from common import EFFECTIVE_MODULUS, MESH_STEP, NODES, PRESSURE, SIDE
from common import Quantity, heights, report


def main() -> None:
    sides = (SIDE, SIDE)
    surface = Topography(heights(), sides, periodic=True)
    # Without a layer, `young` is the effective modulus.
    substrate = PeriodicFFTElasticHalfSpace((NODES, NODES), EFFECTIVE_MODULUS, sides)
    system = make_system(substrate=substrate, surface=surface)
    # The tolerance is a length: the largest penetration.
    result = system.minimize_proxy(external_force=PRESSURE * SIDE**2, pentol=1e-16)
    assert result.success, result.message
    forces = np.asarray(result.jac)
    area = system.compute_contact_area()
    mean_displacement = np.mean(result.x)
    contact = forces > 0
    neighbours = coordination(contact, periodic=True)
    edges = int((4 - neighbours)[contact].sum())
    report(
        "ContactMechanics",
        [
            Quantity("contact area", area, "m²", "÷ L²", area / SIDE**2),
            Quantity(
                "mean gap",
                mean_displacement,
                "m, displacement",
                "− offset − mean height",
                mean_displacement - result.offset - surface.heights().mean(),
            ),
            Quantity("perimeter", edges, "cell edges", "× Δx", edges * MESH_STEP),
            Quantity(
                "peak pressure", forces.max(), "N per node", "÷ Δx²", forces.max() / MESH_STEP**2
            ),
        ],
    )


if __name__ == "__main__":
    main()
