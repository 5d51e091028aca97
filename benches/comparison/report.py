"""Prints the table of results and writes it as CSV, with a second file for all loads."""

import csv
import os
import platform
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from .runs import Run


@dataclass
class Line:
    """Runs of one code on one set of loads, all at the same tolerance."""

    title: str
    version: str
    runs: list[Run]
    # The line of asperity on the same loads, if this line is about a peer.
    against: "Line | None" = None

    @property
    def sample(self) -> Run:
        """The run that finished most loads."""
        return max(self.runs, key=lambda run: len(run.rows))

    @property
    def cpu_seconds(self) -> float:
        loads = len(self.sample.rows)
        return median(run.cpu_seconds for run in self.runs if len(run.rows) == loads)

    @property
    def ratio(self) -> float | None:
        """CPU seconds over asperity's on the loads that this code finished."""
        if self.against is None or not self.sample.rows:
            return None
        own = self.against.sample.rows
        if not own or self.against.cpu_seconds == 0.0:
            return None
        # asperity is timed for whole sweeps. The time of a part is estimated from its pairs.
        done = {row["load"] for row in self.sample.rows}
        share = sum(row["pairs"] for row in own if row["load"] in done) / sum(
            row["pairs"] for row in own
        )
        return self.cpu_seconds / (share * self.against.cpu_seconds)

    def cells(self) -> dict[str, object]:
        run = self.sample
        done = len(run.rows)
        errors = run.differing
        return {
            "code": self.title,
            "version": self.version,
            "tolerance": f"{run.tolerance:g}",
            "loads": f"{done}/{len(run.problem.loads)}",
            "cpu_seconds": f"{self.cpu_seconds:.2f}" if done else "",
            "seconds_per_load": f"{self.cpu_seconds / done:.4f}" if done else "",
            "ratio": f"{self.ratio:.1f}" if self.ratio else "",
            "iterations": whole(run.total("iterations") if done else None),
            "pairs": whole(run.total("pairs") if done else None),
            "wrong_nodes_mean": f"{run.mean_error:.2f}" if errors else "",
            "wrong_nodes_max": whole(max(errors, default=None)),
            "peak_mebibytes": f"{max(run.peak_mebibytes for run in self.runs):.0f}",
            "runs": len(self.runs),
            "note": run.failure,
        }


def whole(number: int | None) -> str:
    return "" if number is None else str(number)


# Printed columns with their short names, a selection of the columns of the CSV file.
SHOWN = {
    "code": "code",
    "version": "version",
    "tolerance": "tolerance",
    "loads": "loads",
    "cpu_seconds": "CPU s",
    "seconds_per_load": "s/load",
    "ratio": "ratio",
    "iterations": "iterations",
    "pairs": "pairs",
    "wrong_nodes_mean": "wrong nodes",
    "wrong_nodes_max": "worst",
    "peak_mebibytes": "MiB",
    "note": "note",
}


def print_table(lines: list[Line]) -> None:
    rows = [SHOWN, *(line.cells() for line in lines)]
    columns = [[str(row[name]) for row in rows] for name in SHOWN]
    for column, name in zip(columns, SHOWN, strict=True):
        width = max(map(len, column))
        words = name in ("code", "version", "note")
        column[:] = [cell.ljust(width) if words else cell.rjust(width) for cell in column]
    for row in zip(*columns, strict=True):
        print("  ".join(row).rstrip())


def write_csv(folder: Path, stem: str, lines: list[Line]) -> list[Path]:
    """Writes `STEM.csv` with a row per code and `STEM-loads.csv` with a row per code and load."""
    folder.mkdir(parents=True, exist_ok=True)
    codes, loads = folder / f"{stem}.csv", folder / f"{stem}-loads.csv"
    problem = lines[0].sample.problem
    shared = {
        "nodes": problem.nodes,
        "k_lower": problem.k_lower,
        "k_upper": problem.k_upper,
        "hurst": problem.hurst,
        "seed": problem.seed,
        "machine": machine(),
    }
    write(codes, [line.cells() | shared for line in lines])
    write(
        loads,
        [
            {"code": line.title, "tolerance": line.sample.tolerance} | row | {"wrong_nodes": wrong}
            for line in lines
            for row, wrong in zip(line.sample.rows, line.sample.differing, strict=True)
        ],
    )
    return [codes, loads]


def write(path: Path, rows: list[dict]) -> None:
    with open(path, "w", newline="") as file:
        writer = csv.DictWriter(file, fieldnames=list(rows[0]) if rows else [])
        writer.writeheader()
        writer.writerows(rows)


def machine() -> str:
    """Describes the processor and the number of cores, as the system reports them."""
    known = {}
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text().splitlines():
            name, _, value = line.partition(":")
            known.setdefault(name.strip(), value.strip())
    model = known.get("model name") or platform.processor() or platform.machine()
    numbers = [f"{name} {known[name]}" for name in ("cpu family", "model") if name in known]
    widest = "AVX-512" if "avx512f" in known.get("flags", "") else ""
    return ", ".join([model, *numbers, *filter(None, [widest]), f"{os.cpu_count()} cores"])
