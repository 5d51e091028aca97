"""Runs a code on a problem in a separate process, and records its results and cost."""

import json
import os
import resource
import shutil
import signal
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

from .environment import ONE_THREAD
from .problem import Problem

HERE = Path(__file__).parent

MANIFEST = """
[study]
name = "peers"

[stage.surface]
kind = "generate"
method = "file"
path = "{surface}"
side = 1.0
periodic = true

[stage.contact]
kind = "solve"
from = "surface"
loads = {loads}
tolerance = {tolerance}
max_pairs = 100000

[stage.area]
kind = "measure"
from = "contact"
"""


@dataclass
class Run:
    """Run of a code within its limit; `rows` are the loads that it finished."""

    code: str
    tolerance: float
    problem: Problem
    folder: Path
    rows: list[dict] = field(default_factory=list)
    cpu_seconds: float = 0.0
    peak_mebibytes: float = 0.0
    failure: str = ""
    differing: list[int] = field(default_factory=list)

    def total(self, column: str) -> int | None:
        values = [row[column] for row in self.rows]
        return None if None in values else sum(values)

    @property
    def mean_error(self) -> float:
        return sum(self.differing) / len(self.differing) if self.differing else float("inf")

    @property
    def is_complete(self) -> bool:
        return not self.failure and len(self.rows) == len(self.problem.loads)


class Bench:
    """The programs, the working folder, and the limit of a run in CPU seconds."""

    def __init__(self, python: Path, asperity: Path, folder: Path, limit: float) -> None:
        self.python = python
        self.asperity = asperity
        self.folder = folder
        self.limit = limit
        self.runs = 0

    def draw(self, problem: Problem) -> Path:
        surface = self.folder / f"surface-{problem.nodes}.npy"
        shape = [problem.nodes, problem.k_lower, problem.k_upper, problem.hurst, problem.seed]
        self.script("draw.py", *shape, surface)
        return surface

    def run(self, code: str, tolerance: float, problem: Problem, surface: Path) -> Run:
        self.runs += 1
        folder = self.folder / f"{self.runs:03}-{code}"
        folder.mkdir()
        (folder / "loads.json").write_text(json.dumps(problem.loads))
        run = Run(code, tolerance, problem, folder)
        if code == "asperity":
            self.run_asperity(run, surface)
        else:
            self.run_peer(run, surface)
        if not run.failure and not all(row["converged"] for row in run.rows):
            run.failure = "some loads did not converge"
        return run

    def run_asperity(self, run: Run, surface: Path) -> None:
        """Runs asperity and times the whole program, including start, reading and writing."""
        manifest, data = run.folder / "peers.toml", run.folder / "data"
        loads, tolerance = list(run.problem.loads), run.tolerance
        manifest.write_text(MANIFEST.format(surface=surface, loads=loads, tolerance=tolerance))
        command = [self.asperity, "--data", data, "run", manifest, "--jobs", "1"]
        run.cpu_seconds = self.measure(run, command)
        if not run.failure:
            self.script("tables.py", "read", data, run.folder / "loads.json", run.folder)
            run.rows = rows_of(run.folder)
        shutil.rmtree(data, ignore_errors=True)

    def run_peer(self, run: Run, surface: Path) -> None:
        """Runs a peer and times the solver only, as measured by the script."""
        script = [self.python, HERE / "solve.py", run.code, run.tolerance, surface]
        self.measure(run, [*script, run.folder / "loads.json", run.folder])
        run.rows = rows_of(run.folder)
        run.cpu_seconds = sum(row["cpu_seconds"] for row in run.rows)

    def measure(self, run: Run, command: list) -> float:
        """Runs a command and returns its CPU seconds; stores peak memory and failure in `run`."""
        log = run.folder / "log.txt"
        with open(log, "wb") as output:
            process = subprocess.Popen(
                [str(part) for part in command],
                stdout=output,
                stderr=output,
                env=os.environ | ONE_THREAD,
                preexec_fn=self.allow_limit,
            )
            try:
                _, status, usage = os.wait4(process.pid, 0)
            except BaseException:
                process.kill()
                raise
        process.returncode = os.waitstatus_to_exitcode(status)
        run.peak_mebibytes = usage.ru_maxrss / 1024.0
        seconds = usage.ru_utime + usage.ru_stime
        if process.returncode == -signal.SIGXCPU:
            run.failure = f"stopped after {seconds:.0f} s"
        elif process.returncode != 0:
            lines = log.read_text(errors="replace").strip().splitlines()
            reason = lines[-1].strip() if lines else "no message"
            run.failure = f"exit {process.returncode}: {reason}"
        return seconds

    def allow_limit(self) -> None:
        seconds = max(1, int(self.limit))
        resource.setrlimit(resource.RLIMIT_CPU, (seconds, seconds + 5))

    def compare(self, reference: Run, runs: list[Run]) -> None:
        """Counts the wrong nodes of each run at each load that it finished."""
        known = [run for run in runs if run.rows]
        folders = [run.folder for run in known]
        nodes = reference.problem.nodes
        output = self.script("tables.py", "compare", nodes, reference.folder, *folders)
        for run, differing in zip(known, json.loads(output), strict=True):
            run.differing = differing

    def script(self, name: str, *arguments: object) -> str:
        command = [self.python, HERE / name, *arguments]
        done = subprocess.run([str(part) for part in command], stdout=subprocess.PIPE, check=True)
        return done.stdout.decode()


def rows_of(folder: Path) -> list[dict]:
    rows = folder / "rows.jsonl"
    if not rows.exists():
        return []
    return [json.loads(line) for line in rows.read_text().splitlines() if line.endswith("}")]
