"""Presses the surface with Tamaas, in SI units."""

import numpy as np
import tamaas

from common import MESH_STEP, NODES, POISSON_RATIO, PRESSURE, SIDE, YOUNGS_MODULUS
from common import Quantity, heights, report


def main() -> None:
    tamaas.set_log_level(tamaas.LogLevel.error)
    h = heights()
    kind = tamaas.model_type.basic_2d
    model = tamaas.ModelFactory.createModel(kind, [SIDE, SIDE], [NODES, NODES])
    model.E, model.nu = YOUNGS_MODULUS, POISSON_RATIO
    error = tamaas.PolonskyKeerRey(model, h, 1e-12).solve(PRESSURE)
    assert error <= 1e-12, "solve() does not raise if it stops before the tolerance"
    traction = np.array(model.traction)
    area = tamaas.Statistics2D.contact(traction)
    mean_displacement = np.mean(model.displacement)
    clusters = tamaas.FloodFill.getClusters(traction > 0, False)
    segments = sum(cluster.perimeter for cluster in clusters)
    report(
        "Tamaas",
        [
            Quantity("contact area", area, "1", "none", area),
            Quantity(
                "mean gap",
                mean_displacement,
                "m, displacement",
                "− mean height",
                mean_displacement - h.mean(),
            ),
            Quantity("perimeter", segments, "cell edges", "× Δx", segments * MESH_STEP),
            Quantity("peak pressure", traction.max(), "Pa", "none", traction.max()),
        ],
    )


if __name__ == "__main__":
    main()
