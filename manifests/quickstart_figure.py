"""Draws the mean area against the pressure, with error bars and two theories, from the tables of the quickstart.

    asperity run manifests/quickstart.toml
    python3 manifests/quickstart_figure.py

Editors that support `# %%` run the script cell by cell, like a notebook.
"""

# %% The tables: one row per surface, load and correction; one row per spectrum, load and correction.
import math
import os
from pathlib import Path

import matplotlib.pyplot as plt
import polars as pl

data = Path(os.environ.get("ASPERITY_DATA", "data"))
results = data / "results" / "quickstart"
surfaces = pl.read_parquet(results / "corrected.parquet").filter(pl.col("correction") == "2017")
curves = pl.read_parquet(results / "curves.parquet").filter(pl.col("correction") == "2017")

# %% Means over the surfaces and their standard errors, as in the `aggregate` stage.
spectrum = ["k_lower", "k_upper"]
area = pl.col("area_corrected")
means = (
    surfaces.group_by(*spectrum, "load")
    .agg(mean=area.mean(), sem=area.std() / area.count().sqrt(), count=area.count())
    # Where a load failed on some surface, the mean would belong to another ensemble.
    .filter(pl.col("count") == pl.col("count").max().over(spectrum))
    .sort(*spectrum, "load")
)
both = means.join(curves, on=[*spectrum, "load"])
assert len(both) == len(means) == len(curves)
for ours, theirs in [("mean", "area_corrected_mean"), ("sem", "area_corrected_sem")]:
    difference = (both[ours] - both[theirs]).abs().max()
    assert difference < 1e-12, f"{theirs} differs by {difference}"

# %% Persson's area in closed form, compared with the table.
persson = pl.Series([math.erf(math.sqrt(2) * load) for load in curves["load"]])
assert (persson - curves["area_persson"]).abs().max() < 1e-12

# %% The figure.
figure, axes = plt.subplots(figsize=(5, 4), layout="constrained")
for (k_lower, k_upper), curve in curves.partition_by(*spectrum, as_dict=True).items():
    points = axes.errorbar(
        curve["load"],
        curve["area_corrected_mean"],
        yerr=curve["area_corrected_sem"],
        fmt="o",
        markersize=3,
        capsize=2,
        label=f"wavenumbers {k_lower} … {k_upper}, {curve['count'].max()} surfaces",
    )
    bgt = curve.filter(pl.col("area_bush_gibson_thomas") < 1)
    axes.plot(
        bgt["load"],
        bgt["area_bush_gibson_thomas"],
        linestyle="--",
        color=points[0].get_color(),
        label=f"Bush, Gibson & Thomas, {k_lower} … {k_upper}",
    )
theory = curves.unique("load").sort("load")
axes.plot(theory["load"], theory["area_persson"], color="black", label="Persson")
axes.set_xscale("log")
axes.set_xlabel("mean pressure / (E* × rms slope)")
axes.set_ylabel("share of the area in contact")
axes.legend(frameon=False, fontsize="small")
path = data / "quickstart_area.png"
figure.savefig(path, dpi=200)
print(f"{path}: {len(curves)} means over {len(surfaces)} rows")
