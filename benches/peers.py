#!/usr/bin/env python3
"""Compares asperity with other contact solvers on one surface and the same loads, one thread each.

    python3 benches/peers.py            512², 12 loads: minutes
    python3 benches/peers.py --full     1024², 90 loads: most of an hour, or see --peer-loads

Needs Python 3.11 or later and a release build of asperity. The peers are installed once, in pinned
versions, into a virtual environment under the target folder.
"""

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from comparison import calibration
from comparison.calibration import TIGHT, TOLERANCE, calibrate, report, required, say
from comparison.environment import prepare
from comparison.problem import Problem, schedule, thinned
from comparison.report import Line, machine, print_table, write_csv
from comparison.runs import Bench, Run

REPOSITORY = Path(__file__).resolve().parent.parent
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", REPOSITORY / "target")).resolve()

# For each peer, its printed name and its package.
PEERS = {
    "aspher-nested": ("aspher nested", "aspher"),
    "aspher-warm": ("aspher warm", "aspher"),
    "contact-mechanics": ("ContactMechanics warm", "ContactMechanics"),
    "tamaas": ("tamaas warm", "tamaas"),
}


def main() -> None:
    options = parse()
    if not options.asperity.exists():
        sys.exit(
            f"error: `{options.asperity}` does not exist; "
            "run `cargo build --release`, or name the program with `--asperity PATH`"
        )
    python = prepare(options.environment)
    problem = Problem(
        nodes=options.nodes or (1024 if options.full else 512),
        k_lower=options.case[0],
        k_upper=options.case[1],
        hurst=0.8,
        seed=options.seed,
        loads=thinned(schedule(), options.loads or (90 if options.full else 12)),
    )
    with tempfile.TemporaryDirectory(prefix="peers-") as folder:
        bench = Bench(python, options.asperity.resolve(), Path(folder), options.limit)
        tolerances = calibrate(bench, problem.half(), options.only, options.check_reference)
        lines = compete(bench, problem, options, tolerances)
    print(f"\n{problem.describe()}\n{machine()}\n")
    print_table(lines)
    stem = f"peers-{problem.nodes}-{problem.k_lower}-{problem.k_upper}-{len(problem.loads)}"
    written = write_csv(options.out, stem, lines)
    print("\n" + "\n".join(f"written: {path}" for path in written))


def compete(
    bench: Bench, problem: Problem, options: argparse.Namespace, tolerances: dict[str, float]
) -> list[Line]:
    """Runs the codes in turn, asperity before each of the others and after the last."""
    shared = problem.with_loads(options.peer_loads or len(problem.loads))
    say(f"comparison   {problem.describe()}")
    if shared != problem:
        loads = ", ".join(f"{load:.4g}" for load in shared.loads)
        say(f"  all codes run {len(shared.loads)} of these loads: {loads}")
    surface = bench.draw(problem)
    # The tight reference takes several times as long, so that its limit is larger.
    patient = Bench(bench.python, bench.asperity, bench.folder / "reference", 10 * bench.limit)
    patient.folder.mkdir()
    reference = required(patient.run("asperity", TIGHT, problem, surface))

    def attempt(code: str, loads: Problem) -> Run:
        tolerance = TOLERANCE if code == "asperity" else tolerances[code]
        run = bench.run(code, tolerance, loads, surface)
        bench.compare(reference, [run])
        report(run)
        return run

    runs: dict[str, list[Run]] = {code: [] for code in ["whole", "asperity", *options.only]}
    for turn in range(options.rounds):
        if shared != problem:
            runs["whole"].append(attempt("asperity", problem))
        order = options.only if turn % 2 == 0 else options.only[::-1]
        for peer in order:
            runs["asperity"].append(attempt("asperity", shared))
            run = attempt(peer, shared)
            # The tolerance that sufficed on the smaller surface may be too loose here.
            while calibration.is_too_loose(run, runs["asperity"][0]):
                tighter = calibration.tighter(peer, tolerances[peer])
                if tighter is None:
                    break
                tolerances[peer] = tighter
                runs[peer].clear()
                run = attempt(peer, shared)
            runs[peer].append(run)
        runs["asperity"].append(attempt("asperity", shared))

    versions = installed(bench)
    asperity = Line("asperity", versions["asperity"], runs["asperity"])
    lines = [
        Line(PEERS[peer][0], versions[PEERS[peer][1]], runs[peer], asperity)
        for peer in options.only
    ]
    if runs["whole"]:
        return [Line("asperity, all loads", versions["asperity"], runs["whole"]), asperity, *lines]
    return [asperity, *lines]


def installed(bench: Bench) -> dict[str, str]:
    said = subprocess.check_output([bench.asperity, "--version"], text=True)
    freeze = [str(bench.python), "-m", "pip", "list", "--format=freeze"]
    packages = subprocess.check_output(freeze, text=True, stderr=subprocess.DEVNULL)
    versions = dict(line.split("==", 1) for line in packages.splitlines() if "==" in line)
    return versions | {"asperity": said.split()[-1]}


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    size = parser.add_mutually_exclusive_group()
    size.add_argument("--quick", action="store_true", help="512², 12 loads; the default")
    size.add_argument("--full", action="store_true", help="1024², 90 loads")
    parser.add_argument("--nodes", type=int, help="nodes per side, in place of 512 or 1024")
    parser.add_argument("--case", type=case, default=(4, 64), metavar="K_LOWER,K_UPPER")
    parser.add_argument("--seed", type=int, default=2015)
    parser.add_argument("--loads", type=int, help="number of loads, at most the schedule's 90")
    parser.add_argument("--peer-loads", type=int, help="number of these loads that all codes run")
    parser.add_argument("--rounds", type=int, default=1, help="number of rounds; prints medians")
    parser.add_argument(
        "--check-reference", action="store_true", help="compare the reference with tamaas at 1e-12"
    )
    names = ", ".join(PEERS)
    parser.add_argument("--only", type=peers, default=list(PEERS), metavar="PEER,…", help=names)
    parser.add_argument("--limit", type=float, default=3600.0, help="limit of a run in CPU seconds")
    parser.add_argument("--asperity", type=Path, default=TARGET / "release/asperity")
    parser.add_argument("--environment", type=Path, default=TARGET / "peers")
    parser.add_argument("--out", type=Path, default=REPOSITORY / "benches" / "results")
    return parser.parse_args()


def case(text: str) -> tuple[int, int]:
    try:
        lower, upper = (int(part) for part in text.split(","))
    except ValueError:
        lower, upper = 0, 0
    if not 1 <= lower <= upper <= 256:
        raise argparse.ArgumentTypeError("expected 1 ≤ K_LOWER ≤ K_UPPER ≤ 256, like 4,64")
    return lower, upper


def peers(text: str) -> list[str]:
    names = text.split(",")
    unknown = [name for name in names if name not in PEERS]
    if unknown:
        known = ", ".join(PEERS)
        raise argparse.ArgumentTypeError(f"unknown: {', '.join(unknown)}; known: {known}")
    return names


if __name__ == "__main__":
    main()
