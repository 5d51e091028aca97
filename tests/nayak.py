"""Compares the table of `manifests/nayak.toml` with the tables printed in the paper.

    asperity run manifests/nayak.toml
    python3 tests/nayak.py data

Analytic cells must agree to the printed digit. Numerical cells are means over 200 surfaces in
the paper and over 1000 here: z is their difference in units of its standard error. The part of the
paper is estimated by the scatter found here, and rounding adds a variance of step² / 12. Cells that
share surfaces are correlated, so each z is tested alone.
"""

import math
import sys
from pathlib import Path

import polars as pl

SURFACES = 200
ROUNDING = 0.01**2 / 12

root = Path(__file__).parents[1]
found = pl.read_parquet(Path(sys.argv[1], "results/nayak/table.parquet"))
failures = 0
for printed, drawn, exact in [
    ("nayak", "nayak", "nayak_continuum"),
    ("summit-density", "summit_density_integer", "summit_density_continuum"),
]:
    paper = pl.read_csv(root / f"manifests/claims/yastrebov-2015-{printed}.csv")
    both = paper.join(found, on=["hurst", "k_lower", "k_upper"])
    assert len(both) == len(paper) == 66, printed
    # Half a unit of the last digit, and the rounding error of this comparison.
    analytic = both.filter((pl.col(exact) - pl.col("analytic")).abs() > 0.005 + 1e-9)
    variance = pl.col(f"{drawn}_sd") ** 2 / SURFACES + pl.col(f"{drawn}_sem") ** 2 + ROUNDING
    z = both.with_columns(z=(pl.col(f"{drawn}_mean") - pl.col("numerical")) / variance.sqrt())
    worst = z.sort(pl.col("z").abs(), descending=True).row(0, named=True)
    rms = math.sqrt((z["z"] ** 2).mean())
    print(
        f"{printed}: {len(both) - len(analytic)} of {len(both)} analytic cells as printed; "
        f"z of {len(z)} numerical cells: rms {rms:.2f}, mean {z['z'].mean():.2f}, largest "
        f"{worst['z']:.2f} at H = {worst['hurst']}, k from {worst['k_lower']} to {worst['k_upper']}"
    )
    failures += len(analytic) + len(z.filter(pl.col("z").abs() > 3.5))
sys.exit(1 if failures else 0)
