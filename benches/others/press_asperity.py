"""Presses the surface with asperity: `press_asperity.py PROGRAM`."""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import polars

from common import (
    POISSON_RATIO,
    PRESSURE,
    SIDE,
    YOUNGS_MODULUS,
    Quantity,
    heights,
    report,
)

MANIFEST = f"""
[study]
name = "others"

[stage.surface]
kind = "generate"
method = "file"
path = "heights.npy"
side = "{SIDE * 1e6:g} um"
unit = "m"
periodic = true

[stage.contact]
kind = "solve"
from = "surface"
bodies = [{{ youngs_modulus = "{YOUNGS_MODULUS * 1e-9:g} GPa", poisson_ratio = {POISSON_RATIO} }}]
loads = ["{PRESSURE * 1e-6:g} MPa"]
tolerance = 1e-10

[stage.area]
kind = "measure"
from = "contact"
"""


def main() -> None:
    with TemporaryDirectory() as folder:
        manifest = Path(folder, "others.toml")
        manifest.write_text(MANIFEST)
        np.save(Path(folder, "heights.npy"), heights())
        data = Path(folder, "data")
        command = [sys.argv[1], "run", manifest, "--data", data]
        subprocess.run(command, check=True, capture_output=True)
        contact = polars.read_parquet(data / "results/others/contact.parquet").row(0, named=True)
        area = polars.read_parquet(data / "results/others/area.parquet").row(0, named=True)
    report(
        "asperity",
        [
            Quantity("contact area", area["area_fraction"], "1", "none", area["area_fraction"]),
            Quantity("mean gap", contact["mean_gap"], contact["unit"], "none", contact["mean_gap"]),
            Quantity(
                "perimeter",
                area["perimeter_manhattan"],
                area["unit"],
                "none",
                area["perimeter_manhattan"],
            ),
            Quantity(
                "peak pressure",
                contact["peak_pressure"],
                contact["pressure_unit"],
                "× 10⁶",
                1e6 * contact["peak_pressure"],
            ),
        ],
    )


if __name__ == "__main__":
    main()
