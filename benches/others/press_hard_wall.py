"""Presses the surface with `ce_hard_wall`, the command of ContactMechanics, in units of E*."""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from common import EFFECTIVE_MODULUS, MESH_STEP, PRESSURE, SIDE
from common import Quantity, edges, heights, report


def main() -> None:
    program = Path(sys.executable).with_name("ce_hard_wall")
    with TemporaryDirectory() as folder:
        np.savetxt(Path(folder, "heights.txt"), heights())
        options = {
            "physical_sizes": f"{SIDE},{SIDE}",
            "physical_sizes-unit": "m",
            "pressure": f"{PRESSURE / EFFECTIVE_MODULUS:.17g}",
            "pentol": "1e-16",
            "pressure-fn": "pressure.txt",
            "gap-fn": "gap.txt",
        }
        words = [word for key, value in options.items() for word in (f"--{key}", value)]
        command = [program, "heights.txt", *words]
        subprocess.run(command, cwd=folder, check=True, capture_output=True)
        pressure = np.loadtxt(Path(folder, "pressure.txt"))
        gap = np.loadtxt(Path(folder, "gap.txt"))
    # The maps are the transpose of the text that was read, which these four numbers do not show.
    contact = pressure > 0
    report(
        "ce_hard_wall",
        [
            Quantity("contact area", contact.sum(), "nodes", "÷ N²", contact.mean()),
            Quantity("mean gap", gap.mean(), "m", "none", gap.mean()),
            Quantity(
                "perimeter", edges(contact), "–, from map", "× Δx", edges(contact) * MESH_STEP
            ),
            Quantity(
                "peak pressure",
                pressure.max(),
                "E*",
                "× E*",
                pressure.max() * EFFECTIVE_MODULUS,
            ),
        ],
    )


if __name__ == "__main__":
    main()
