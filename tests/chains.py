#!/usr/bin/env python3
"""Counts `let` statements that bind the name with which their value begins, outside of tests.

`let rows = rows.filter(…)` does not tell what the new rows are. One expression does, or a name for the step.
Usage: python3 tests/chains.py [--list]
"""

import pathlib
import re
import sys

# Greatest number of such statements. Lower it when you remove some.
MOST = 136
CHAIN = re.compile(r"\blet (?:mut )?(\w+)(?:: [^=;]+)? =\s+&?\1\b\s*[.?]")
TESTS = {"tests", "benches", "testutils", "fixtures"}

root = pathlib.Path(__file__).parent.parent
found = []
for path in sorted(path for folder in ["src", "crates", "python/src"] for path in (root / folder).rglob("*.rs")):
    place = path.relative_to(root)
    if not TESTS.intersection(place.parts) and not path.name.startswith("test"):
        text = path.read_text().split("\n#[cfg(test)]\nmod ")[0]
        lines = [text[: chain.start()].count("\n") + 1 for chain in CHAIN.finditer(text)]
        found += [f"{place}:{line}" for line in lines]
if "--list" in sys.argv:
    print("\n".join(found))
if len(found) > MOST:
    sys.exit(
        f"{len(found)} `let` statements bind the name with which their value begins, but at most {MOST} may: give "
        "these steps names, or write one expression (`--list` prints where they are)"
    )
