"""Finds the loosest tolerance at which a peer is as accurate as asperity."""

import sys

from .problem import Problem
from .runs import Bench, Run

# Tolerances of asperity: the default, and that of the reference.
TOLERANCE = 5e-5
TIGHT = 1e-10

# Tolerances of the peers, loosest first, each in the code's own measure. aspher uses the larger of
# duality gap and penetration over the range of heights, tamaas an energy, and asperity and
# ContactMechanics a length over rms slope × mesh step.
LADDERS = {
    "aspher-nested": [1e-4, 3e-5, 1e-5, 7e-6, 5e-6, 3e-6, 2e-6, 1e-6, 1e-8],
    "aspher-warm": [1e-4, 3e-5, 1e-5, 7e-6, 5e-6, 3e-6, 2e-6, 1e-6, 1e-8],
    "contact-mechanics": [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7],
    "tamaas": [1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 1e-6, 1e-8],
}
TAMAAS_TIGHT = 1e-12


def calibrate(
    bench: Bench, problem: Problem, peers: list[str], check: bool
) -> dict[str, float]:
    """Compares contact maps on `problem` and returns a tolerance for each peer.

    With `check`, also compares the reference with tamaas, which takes longer than everything else.
    """
    say(f"calibration  {problem.describe()}")
    surface = bench.draw(problem)
    reference = required(bench.run("asperity", TIGHT, problem, surface))
    own = required(bench.run("asperity", TOLERANCE, problem, surface))
    bench.compare(reference, [own])
    report(own)
    if check:
        other = bench.run("tamaas", TAMAAS_TIGHT, problem, surface)
        bench.compare(reference, [other])
        report(other, f"compared with the reference, asperity at {TIGHT:g}")

    chosen = {}
    for peer in peers:
        for tolerance in LADDERS[peer]:
            run = bench.run(peer, tolerance, problem, surface)
            bench.compare(reference, [run])
            report(run)
            chosen[peer] = tolerance
            if not is_too_loose(run, own):
                break
    return chosen


def is_too_loose(run: Run, own: Run) -> bool:
    """Returns whether `run` has more wrong nodes than asperity, False for an incomplete sweep."""
    return len(run.rows) == len(own.rows) and sum(run.differing) > sum(own.differing)


def tighter(peer: str, tolerance: float) -> float | None:
    """Returns the next tighter tolerance of the peer's ladder."""
    return next((rung for rung in LADDERS[peer] if rung < tolerance), None)


def required(run: Run) -> Run:
    if not run.is_complete:
        sys.exit(f"error: asperity at {run.tolerance:g}: {run.failure}")
    return run


def report(run: Run, remark: str = "") -> None:
    wrong = "no loads finished"
    if run.differing:
        wrong = f"{run.mean_error:.2f} nodes wrong, {max(run.differing)} at worst"
    parts = [f"{run.cpu_seconds:.2f} s", wrong, run.failure, remark]
    say(f"  {run.code:14} {run.tolerance:<6g} {' · '.join(part for part in parts if part)}")


def say(line: str) -> None:
    print(line, file=sys.stderr, flush=True)
