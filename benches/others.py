#!/usr/bin/env python3
"""Presses one surface with asperity and other programs, and checks their conventions.

    python3 benches/others.py             the table of one contact, then all checks: half a minute
    python3 benches/others.py --contact   only the contact
    python3 benches/others.py --checks    only the checks

`others/press_PROGRAM.py` presses the surface with one program, in its own units, and states how its
numbers are converted. `others/check_PROGRAM.py` shows each line of
docs/how-to/from-other-programs.md with a number. Both are short, and can be run alone with the
interpreter of the environment. The peers are installed once, in pinned versions, into a virtual
environment under the target folder; the checks of Gwyddion need the Debian package libgwyddion2-0.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

from comparison.environment import ONE_THREAD, prepare

REPOSITORY = Path(__file__).resolve().parent.parent
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", REPOSITORY / "target")).resolve()
SCRIPTS = Path(__file__).resolve().parent / "others"
PRESSES = ["asperity", "tamaas", "contact_mechanics", "hard_wall", "aspher"]
CHECKS = ["asperity", "tamaas", "contact_mechanics", "surface_topography", "aspher", "surfalize"]
CHECKS += ["gwyddion"]
# Solvers stop at about 1e-10 of the pressures.
AGREEMENT = 1e-8


def main() -> None:
    options = parse()
    python = prepare(options.environment)
    failed = []
    if not options.checks:
        contacts = [press(python, name, options.asperity) for name in PRESSES]
        failed += print_contacts(contacts)
    if not options.contact:
        for name in CHECKS:
            print(flush=True)
            arguments = [options.asperity.resolve()] if name == "asperity" else []
            if run(python, f"check_{name}.py", *arguments, stdout=None).returncode != 0:
                failed.append(name)
    if failed:
        sys.exit(f"error: different or wrong: {', '.join(failed)}")


def run(python: Path, script: str, *arguments, stdout=subprocess.PIPE):
    command = [python, "-W", "ignore", SCRIPTS / script, *arguments]
    return subprocess.run(command, stdout=stdout, text=True, env=os.environ | ONE_THREAD)


def press(python: Path, name: str, asperity: Path) -> dict:
    arguments = [asperity.resolve()] if name == "asperity" else []
    done = run(python, f"press_{name}.py", *arguments)
    if done.returncode != 0:
        sys.exit(f"error: press_{name}.py failed; see its message above")
    return json.loads(done.stdout)


def print_contacts(contacts: list[dict]) -> list[str]:
    """Prints a row for each quantity and program, and returns what differs from asperity."""
    print("| quantity | program | as it is given | unit | conversion | in SI units |")
    print("|---|---|---|---|---|---|")
    different = []
    for index, reference in enumerate(contacts[0]["quantities"]):
        for contact in contacts:
            quantity = contact["quantities"][index]
            cells = [
                quantity["name"],
                contact["program"],
                f"{quantity['value']:.9g}",
                quantity["unit"],
                quantity["conversion"],
                f"{quantity['converted']:.9g}",
            ]
            print(f"| {' | '.join(cells)} |")
            if abs(quantity["converted"] / reference["converted"] - 1) > AGREEMENT:
                different.append(f"{quantity['name']} of {contact['program']}")
    return different


def parse() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--contact", action="store_true", help="press the surface only")
    parser.add_argument("--checks", action="store_true", help="check the conventions only")
    parser.add_argument("--asperity", type=Path, default=TARGET / "release" / "asperity")
    parser.add_argument("--environment", type=Path, default=TARGET / "peers")
    return parser.parse_args()


if __name__ == "__main__":
    main()
