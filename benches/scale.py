#!/usr/bin/env python3
"""Measures the overhead of a task in asperity, Snakemake, doit and row.

All programs run one study of trivial tasks, 450 chains of three: from nothing, again with nothing
to do, and with nine more chains. asperity alone then runs a study of 13,200 surfaces of 66 spectra
with a table of their means. It adds one surface of each spectrum (also in an empty store, for
comparison), adds a statistic, restores a deleted table, and runs `verify`. With `--large` it runs
45,000 chains: from nothing, with nothing to do, with 450 more, and a report. The peers are
installed once into `target/scale`, in the versions that `runners/` pins.

    cargo build --release
    python3 benches/scale.py
"""

import argparse
import csv
import os
import platform
import shutil
import subprocess
import sys
import venv
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

from runners import asperity, doit, row, snakemake

ROOT = Path(__file__).resolve().parent.parent
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve()
CHAINS = 450
MORE = 459
LARGE = 45_000
SURFACES = 200


@dataclass
class Cost:
    """Cost of a command, including all processes that it started."""

    wall: float
    cpu: float
    memory_mb: float


def measured(command: list[str], folder: Path, environment: dict[str, str]) -> Cost:
    """Runs a command, which must succeed, and returns its cost."""
    log = folder / "log.txt"
    start = perf_counter()
    with log.open("w") as out:
        child = subprocess.Popen(
            command, cwd=folder, env=os.environ | environment, stdout=out, stderr=out
        )
        _, status, usage = os.wait4(child.pid, 0)
    wall = perf_counter() - start
    if status != 0:
        sys.exit(f"error: {' '.join(command)} failed:\n{log.read_text()[-2000:]}")
    return Cost(wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024)


def summed(costs: list[Cost]) -> Cost:
    return Cost(
        sum(cost.wall for cost in costs),
        sum(cost.cpu for cost in costs),
        max(cost.memory_mb for cost in costs),
    )


def cases(tool, chains: int, more: int) -> list[dict]:
    """Runs the same three cases for every tool and returns a row for each."""
    rows = []
    with TemporaryDirectory(prefix="scale-") as name:
        folder = Path(name)

        def case(label: str, chains: int, tasks: int) -> None:
            tool.write(folder, chains)
            commands = tool.commands(tasks)
            cost = summed([measured(command, folder, tool.environment) for command in commands])
            rows.append(line(tool, label, tasks, cost))

        case("from nothing", chains, 3 * chains)
        tool.check(folder, chains)
        case("nothing to do", chains, 0)
        case("27 more tasks", more, 3 * (more - chains))
        tool.check(folder, more)
    return rows


def plan(tool, chains: int) -> list[dict]:
    """Times the plan of a study without any results."""
    with TemporaryDirectory(prefix="scale-") as name:
        folder = Path(name)
        tool.write(folder, chains)
        cost = measured(tool.command("plan"), folder, tool.environment)
    return [line(tool, f"plan {3 * chains} tasks", 0, cost)]


def extended(tool, surfaces: int) -> list[dict]:
    """Times extensions of an existing study, and the same tasks in an empty store."""
    rows = []
    with TemporaryDirectory(prefix="scale-") as name:
        folder = Path(name)

        def case(label: str, tasks: int, *command: str, **study) -> None:
            tool.write_spectra(folder, **study)
            cost = measured(tool.command(*command), folder, tool.environment)
            rows.append(line(tool, label, tasks, cost))

        spectra = tool.SPECTRA
        many, more = {"surfaces": surfaces}, {"surfaces": surfaces + 1}
        case(f"{spectra * surfaces + 1} tasks", spectra * surfaces + 1, "run", **many)
        case("nothing to do", 0, "run", **many)
        case(f"{spectra + 1} more tasks", spectra + 1, "run", **more)
        case("one more statistic", 1, "run", **more, statistics=["mean", "sd", "max"])
        tool.results(folder).unlink()
        case("one deleted table", 0, "run", **more, statistics=["mean", "sd", "max"])
        case("verify", 0, "verify", **more)
    with TemporaryDirectory(prefix="scale-") as name:
        folder = Path(name)
        case(f"{spectra + 1} tasks alone", spectra + 1, "run", surfaces=1)
    return rows


def large(tool, chains: int) -> list[dict]:
    """Times a study with a very large number of tasks."""
    rows = []
    with TemporaryDirectory(prefix="scale-") as name:
        folder = Path(name)

        def case(label: str, chains: int, tasks: int, *command: str) -> None:
            tool.write(folder, chains)
            cost = measured(tool.command(*command), folder, tool.environment)
            rows.append(line(tool, label, tasks, cost))

        more = chains + chains // 100
        case(f"{3 * chains} tasks", chains, 3 * chains, "run")
        case("nothing to do", chains, 0, "run")
        case(f"{3 * (more - chains)} more tasks", more, 3 * (more - chains), "run")
        case("report", more, 0, "report")
    return rows


def line(tool, label: str, tasks: int, cost: Cost) -> dict:
    per_task = 1000 * cost.cpu / tasks if tasks else None
    row = {
        "tool": tool.name,
        "case": label,
        "wall_s": round(cost.wall, 3),
        "cpu_s": round(cost.cpu, 3),
        "cpu_ms_per_task": None if per_task is None else round(per_task, 3),
        "memory_mb": round(cost.memory_mb, 1),
    }
    print(
        f"{row['tool']:24}{row['case']:20}{row['wall_s']:9.3f}{row['cpu_s']:9.3f}"
        f"{'' if per_task is None else format(per_task, '.2f'):>10}{row['memory_mb']:9.0f}",
        flush=True,
    )
    return row


def prepare(folder: Path) -> dict[str, Path | None]:
    """Installs the peers once and returns their programs, None for one that cannot be installed."""
    stamp = folder / "packages.txt"
    packages = [snakemake.PACKAGE, doit.PACKAGE]
    wanted = "\n".join([sys.version, *packages])
    if not stamp.exists() or stamp.read_text() != wanted:
        print(f"environment  {folder} (a few minutes, once)", file=sys.stderr, flush=True)
        venv.create(folder, clear=True, with_pip=True)
        pip = [folder / "bin" / "python", "-m", "pip", "install", "--quiet"]
        subprocess.run([*pip, "--disable-pip-version-check", *packages], check=True)
        stamp.write_text(wanted)
    if not (folder / "bin" / "row").exists():
        install = ["cargo", "install", "--quiet", "--locked", "--root", folder, *row.PACKAGE]
        without = {name: value for name, value in os.environ.items() if name != "CARGO_TARGET_DIR"}
        done = subprocess.run(install, env=without)
        if done.returncode != 0:
            print("cannot install row with cargo; it is left out", file=sys.stderr)
    programs = {name: folder / "bin" / name for name in ["snakemake", "doit", "row"]}
    return {name: path if path.exists() else None for name, path in programs.items()}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--asperity", type=Path, default=TARGET / "release" / "asperity")
    parser.add_argument("--chains", type=int, default=CHAINS)
    parser.add_argument("--surfaces", type=int, default=SURFACES, help="surfaces per spectrum")
    parser.add_argument("--large", action="store_true", help="also compute 135,000 tasks")
    parser.add_argument("--alone", action="store_true", help="run asperity only")
    arguments = parser.parse_args()
    if not arguments.asperity.exists():
        sys.exit(f"error: `{arguments.asperity}` does not exist; run `cargo build --release` first")
    programs = {} if arguments.alone else prepare(TARGET / "scale")
    tools = [asperity.Tool(arguments.asperity.resolve())]
    for module, name in [(snakemake, "snakemake"), (doit, "doit"), (row, "row")]:
        if programs.get(name):
            tools.append(module.Tool(programs[name]))

    cores = os.cpu_count()
    print(f"{platform.machine()}, {cores} cores, load {os.getloadavg()[0]:.1f} at the start")
    print(f"{'tool':24}{'case':20}{'wall s':>9}{'CPU s':>9}{'ms/task':>10}{'MB':>9}")
    rows = []
    for tool in tools:
        rows += cases(tool, arguments.chains, arguments.chains + MORE - CHAINS)
    rows += plan(tools[0], LARGE)
    rows += extended(tools[0], arguments.surfaces)
    if arguments.large:
        rows += large(tools[0], LARGE)
    results = ROOT / "benches" / "results"
    results.mkdir(exist_ok=True)
    with (results / "scale.csv").open("w", newline="") as file:
        writer = csv.DictWriter(file, rows[0].keys())
        writer.writeheader()
        writer.writerows(rows)
    print(f"written: {results / 'scale.csv'}")


if __name__ == "__main__":
    main()
