"""Presses the surface with ASPHER, in SI units."""

import aspher
import numpy as np

from common import EFFECTIVE_MODULUS, MESH_STEP, NODES, PRESSURE, SIDE
from common import Quantity, edges, heights, report


def main() -> None:
    h = heights()
    solver = aspher.ContactSolver(NODES, SIDE, EFFECTIVE_MODULUS, backend="periodic")
    # Gaps are positive where the bodies are apart, so that summits are the smallest numbers.
    result = solver.solve(-h.ravel(), p_nominal=PRESSURE, tol=1e-12)
    assert result.converged
    pressure = np.asarray(result.pressure).reshape(h.shape)
    contact = pressure > 0
    area = result.contact_area
    report(
        "ASPHER",
        [
            Quantity("contact area", area, "1", "none", area),
            Quantity("mean gap", np.mean(result.gap), "m", "none", np.mean(result.gap)),
            Quantity(
                "perimeter", edges(contact), "–, from map", "× Δx", edges(contact) * MESH_STEP
            ),
            Quantity("peak pressure", pressure.max(), "Pa", "none", pressure.max()),
        ],
    )


if __name__ == "__main__":
    main()
