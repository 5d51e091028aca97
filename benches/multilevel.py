"""Cost and coverage of multilevel means.

    python3 benches/multilevel.py PROGRAM cost [--finest 2048]
    python3 benches/multilevel.py PROGRAM coverage [--studies 400]

`cost` computes the mean corrected area and the mean gap with a relative standard error of 0.5
%, once from surfaces on the finest mesh alone and once with multilevel means, on one core, and
prints the ratios of the CPU times and of the counted nodes × pairs. `coverage` repeats a study
of 20, 6 and 3 surfaces with other seeds, and prints how often its 95 % intervals cover the mean
of the finest mesh. Needs polars.
"""

import argparse
import os
import resource
import subprocess
import tempfile
from pathlib import Path

import polars as pl

STUDY = """
[study]
name = "{name}"
seed = 2015

[stage.surfaces]
kind = "generate"
hurst = 0.8
k_lower = {k_lower}
k_upper = {k_upper}
heights = "redraw"
{surfaces}

[stage.contact]
kind = "solve"
from = "surfaces"
loads = {loads}

[stage.area]
kind = "measure"
from = "contact"

[stage.corrected]
kind = "correct"
from = "area"

[stage.mean-area]
kind = "aggregate"
from = "corrected"
over = ["area_corrected"]
{means}

[stage.mean-gap]
kind = "aggregate"
from = "area"
over = ["mean_gap"]
{means}
"""
PLAIN = 'statistics = ["mean", "sem", "ci95"]'
MULTILEVEL = 'estimator = "multilevel"'
MEANS = {"mean-area": "area_corrected", "mean-gap": "mean_gap"}


class Study:
    """A study in a folder of its own."""

    def __init__(self, program: str, folder: str, name: str, **keys: object) -> None:
        self.program, self.folder, self.name = program, Path(folder) / name, name
        self.folder.mkdir()
        self.manifest = self.folder / "study.toml"
        self.manifest.write_text(STUDY.format(name=name, **keys))

    def run(self, *options: str) -> float:
        """Runs the study on one core and returns its CPU time in seconds."""
        command = [self.program, "run", str(self.manifest), "--jobs", "1", *options]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        environment = {**os.environ, "ASPERITY_DATA": str(self.folder / "data")}
        subprocess.run(command, check=True, capture_output=True, env=environment)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    def table(self, stage: str) -> pl.DataFrame:
        return pl.read_parquet(self.folder / "data" / "results" / self.name / f"{stage}.parquet")

    def means(self, stage: str) -> pl.DataFrame:
        """The means on the finest mesh."""
        table = self.table(stage)
        return table.filter(pl.col("nodes") == table["nodes"].max()).sort("load")

    def cost(self) -> float:
        """Nodes × pairs of transforms of all loads, and six pairs to draw each surface."""
        contact, surfaces = self.table("contact"), self.table("surfaces")
        nodes = contact["nodes"].cast(pl.Float64)
        drawn = surfaces["nodes"].cast(pl.Float64)
        return (contact["pairs"] * nodes**2).sum() + 6 * (drawn**2).sum()


def cost(program: str, finest: int, folder: str) -> None:
    keys = {"k_lower": 4, "k_upper": 64, "loads": [0.02, 0.1]}
    until = 'realizations = {{ at_least = {}, at_most = 2000, until = "{}" }}'
    meshes = [nodes for nodes in (256, 512, 1024, 2048, 4096) if nodes <= finest]
    plain = f"nodes = {finest}\n" + until.format(10, "sem(area.mean_gap) < 0.5 %")
    levels = f"nodes = {meshes}\n" + until.format(3, "sem(mean-gap.mean_gap) < 0.5 %")
    studies = [
        Study(program, folder, "plain", surfaces=plain, means=PLAIN, **keys),
        Study(program, folder, "levels", surfaces=levels, means=MULTILEVEL, **keys),
    ]
    seconds = [study.run() for study in studies]
    for study, time in zip(studies, seconds):
        counts = study.table("surfaces").group_by("nodes").len().sort("nodes").rows()
        print(f"{study.name}: {time:.2f} s, nodes × pairs {study.cost():.3e}, surfaces {counts}")
        for stage, column in MEANS.items():
            for row in study.means(stage).iter_rows(named=True):
                mean, sem = row[f"{column}_mean"], row[f"{column}_sem"]
                print(f"  {column} at {row['load']}: {mean:.6g}, sem {100 * sem / mean:.3f} %")
    costs = [study.cost() for study in studies]
    print(f"plain over levels: CPU {seconds[0] / seconds[1]:.1f}, counted {costs[0] / costs[1]:.1f}")


def coverage(program: str, repeats: int, folder: str) -> None:
    keys = {"k_lower": 2, "k_upper": 8, "loads": [0.05, 0.1], "means": MULTILEVEL}

    def nested(*numbers: int) -> str:
        meshes = zip((32, 64, 128), numbers)
        cases = [f"{{ nodes = {nodes}, realizations = {number} }}" for nodes, number in meshes]
        return f"cases = [{', '.join(cases)}]"

    truth = Study(program, folder, "truth", surfaces=nested(8000, 2000, 800), **keys)
    truth.run("--set", "study.seed=999999")
    study = Study(program, folder, "small", surfaces=nested(20, 6, 3), **keys)
    covered = {(stage, load): 0 for stage in MEANS for load in keys["loads"]}
    for seed in range(repeats):
        study.run("--set", f"study.seed={seed}")
        for stage, column in MEANS.items():
            expected = truth.means(stage)[f"{column}_mean"]
            for mean, row in zip(expected, study.means(stage).iter_rows(named=True)):
                ends = row[f"{column}_ci95_lower"], row[f"{column}_ci95_upper"]
                covered[stage, row["load"]] += ends[0] <= mean <= ends[1]
    for (stage, load), count in covered.items():
        print(f"{MEANS[stage]} at {load}: {100 * count / repeats:.1f} % covered")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("what", choices=["cost", "coverage"])
    parser.add_argument("--finest", type=int, default=2048)
    parser.add_argument("--studies", type=int, default=400)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        if given.what == "cost":
            cost(given.program, given.finest, folder)
        else:
            coverage(given.program, given.studies, folder)


if __name__ == "__main__":
    main()
