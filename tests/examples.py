#!/usr/bin/env python3
"""Checks that the examples of `crates/contact/examples` and their twins in `python/examples` print equal numbers.

Each line is a name, a number and its unit, and equal means to the last bit. Usage: python3 tests/examples.py, in an
environment with the Python module and SciPy.
"""

import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parent.parent


def printed(command):
    """Returns the name, the number and the unit of each line that a command prints."""
    output = subprocess.run(command, cwd=REPOSITORY, stdout=subprocess.PIPE, text=True, check=True).stdout
    lines = [line.split(" ", 2) for line in output.splitlines()]
    return [(name, float(number), unit) for name, number, unit in lines]


def main():
    cargo = ["cargo", "run", "--release", "--quiet", "--example"]
    names = sorted(path.stem for path in (REPOSITORY / "crates/contact/examples").glob("*.rs"))
    twins = sorted(path.stem for path in (REPOSITORY / "python/examples").glob("*.py"))
    assert names == twins, f"each example needs a twin: {names} in Rust, {twins} in Python"
    for name in names:
        in_rust, in_python = printed([*cargo, name]), printed([sys.executable, f"python/examples/{name}.py"])
        assert len(in_rust) == len(in_python), f"{name}: {len(in_rust)} lines in Rust, {len(in_python)} in Python"
        for ours, theirs in zip(in_rust, in_python):
            assert ours == theirs, f"{name}: {ours} in Rust, {theirs} in Python"
        print(f"{name}: {len(in_rust)} equal numbers")


main()
