#!/usr/bin/env python3
"""Measures what is added to a contact: flow, coatings, adhesion, free boundaries, a mesh of 4096², threads.

    python3 benches/costs.py target/release/asperity [--before PROGRAM]

Each row is a study of one surface. Its surface is made first, and the stage of the row is then run alone,
with one thread. The table has the CPU seconds of this stage and its pairs of transforms per load. With
`--before`, another program runs each row right after. The script needs `pip install polars`.
"""

import argparse
import os
import resource
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import polars

SIX_LOADS = "loads = [0.01, 0.02, 0.05, 0.1, 0.2, 0.4]"
THREE_LOADS = "loads = [0.01, 0.05, 0.2]"
CYCLE = """adhesion = { work = 0.004, range = 0.01 }
control = "gap"
gaps = { from = 0.05, to = 0.012, steps = 20 }
path = "there-and-back"
tolerance = 1e-6"""


@dataclass
class Row:
    """A study of one surface and one `solve` stage, or of the surface alone."""

    name: str
    nodes: int
    solve: str | None = None
    k_upper: int = 64
    rms_slope: float = 1.0
    threads: int = 1

    def surface(self) -> str:
        return f"""[study]
name = "row"
seed = 3
[stage.surfaces]
kind = "generate"
nodes = {self.nodes}
hurst = 0.8
k_lower = 4
k_upper = {self.k_upper}
rms_slope = {self.rms_slope}
"""

    def manifest(self) -> str:
        return f'{self.surface()}[stage.contact]\nkind = "solve"\nfrom = "surfaces"\n{self.solve}\n'


def coatings() -> list[Row]:
    layer = "{ thickness = %s, poisson_ratio = 0.3, modulus_ratio = %s }\nsubstrate = { poisson_ratio = 0.3 }"
    rigid = '{ thickness = %s, poisson_ratio = 0.5, base = "bonded" }'
    thicknesses = (0.005, 0.02, 0.1, 0.2)
    rows = [
        Row(f"coating, {ratio} times as stiff, t = {t}", 512, f"layer = {layer % (t, ratio)}\n{THREE_LOADS}")
        for ratio in (4, 20, 100)
        for t in thicknesses
    ]
    incompressible = "incompressible layer, rigid base, t = "
    return rows + [Row(f"{incompressible}{t}", 512, f"layer = {rigid % t}\n{THREE_LOADS}") for t in thicknesses]


ROWS = [
    Row("contact", 1024, SIX_LOADS),
    Row("flow", 1024, f"{SIX_LOADS}\nflow = true"),
    Row("contact, free boundary", 1024, f'{SIX_LOADS}\nboundary = "free"'),
    Row("contact", 512, THREE_LOADS),
    *coatings(),
    Row("adhesive cycle", 1024, CYCLE, rms_slope=0.5),
    Row("surface", 4096),
    Row("surface", 4096, k_upper=1024),
    Row("contact", 4096, "loads = [0.05]"),
    Row("contact, ten loads", 2048, "loads = { from = 0.0, to = 0.2, steps = 10 }"),
    Row("contact, ten loads", 2048, "loads = { from = 0.0, to = 0.2, steps = 10 }", threads=2),
]


def run(program: Path, row: Row) -> str:
    """Runs a row and returns its cells: CPU and wall seconds, and pairs per load."""
    with TemporaryDirectory(prefix="costs-") as name:
        folder = Path(name)

        def stage(text: str) -> tuple[float, float]:
            (folder / "row.toml").write_text(text)
            command = [program, "run", "row.toml", "--data", "data", "--jobs", str(row.threads)]
            before, start = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
            if done.returncode != 0:
                sys.exit(f"error: {row.name}: {done.stderr}")
            after = resource.getrusage(resource.RUSAGE_CHILDREN)
            cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
            return cpu, time.perf_counter() - start

        cpu, wall = stage(row.surface())
        if row.solve is None:
            return f"{cpu:8.2f} {wall:8.2f}         "
        cpu, wall = stage(row.manifest())
        table = polars.read_parquet(folder / "data/results/row/contact.parquet")
        pairs = f"{table['pairs'].mean():7.1f} {table['pairs'].max():7}"
        return f"{cpu:8.2f} {wall:8.2f}  {pairs}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=Path)
    parser.add_argument("--before", type=Path)
    parser.add_argument("--only", default="", help="rows whose names contain this text")
    options = parser.parse_args()
    programs = [path.resolve() for path in (options.program, options.before) if path]
    print(f"load of the machine {os.getloadavg()[0]:.1f}")
    heads = " | ".join("   CPU s   wall s    pairs   worst" for _ in programs)
    print(f"{'row':42} {'nodes':>6} threads  {heads}")
    for row in ROWS:
        if options.only in row.name:
            cells = " | ".join(run(program, row) for program in programs)
            name = row.name if row.k_upper == 64 else f"{row.name}, k_upper {row.k_upper}"
            print(f"{name:42} {row.nodes:>5}² {row.threads:>7}  {cells}", flush=True)


if __name__ == "__main__":
    main()
