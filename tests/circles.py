#!/usr/bin/env python3
"""Finds circles among sibling modules: modules of one parent that use each other, directly or through others.

A module that uses another one is above it, so that it can be read, tested and changed without the modules above.
What two modules share belongs into a module below both. The file of a parent may use its children and be used by
them. Tests do not count. Usage: python3 tests/circles.py
"""

import graphlib
import pathlib
import re
import sys

PATH = re.compile(r"\b(crate|super|self)((?:::\w+)+)")
GROUP = re.compile(r"([\w:]+)::\{([^{}]*)\}")
TESTS = re.compile(r"\n#\[cfg\(test\)\]\s*mod \w+ \{")


def module_of(file):
    """Returns the names of the modules that lead to a file, from the root of its crate."""
    names = file.with_suffix("").parts
    return names[:-1] if names[-1] in ("lib", "main", "mod") else names


def used_in(text):
    """Returns the paths in a file that start with `crate`, `super` or `self`, with groups written out."""
    text = re.sub(r"//[^\n]*", "", TESTS.split(text)[0])
    while group := GROUP.search(text):
        parts = [f"{group[1]}::{part.strip()}" for part in group[2].split(",")]
        text = text[: group.start()] + ", ".join(parts) + text[group.end() :]
    return [match[0].split("::") for match in PATH.finditer(text)]


def target(path, module, modules):
    """Returns the innermost module that a path leads to, seen from a module."""
    place = () if path[0] == "crate" else module
    for name in path:
        if name == "super":
            place = place[:-1]
        elif name not in ("crate", "self"):
            if (*place, name) not in modules:
                break
            place = (*place, name)
    return place


def arrows(source):
    """Returns the modules that each module of a source folder uses among its siblings."""
    files = (file.relative_to(source) for file in sorted(source.rglob("*.rs")))
    files = [file for file in files if "tests" not in file.parts and not file.name.startswith("test")]
    modules = {module_of(file): source / file for file in files}
    used = {}
    for module, file in modules.items():
        for path in used_in(file.read_text()):
            other = target(path, module, modules)
            depth = next((i for i, (own, its) in enumerate(zip(module, other)) if own != its), None)
            if depth is not None:
                used.setdefault(module[: depth + 1], set()).add(other[: depth + 1])
    return used


def main():
    root = pathlib.Path(__file__).parent.parent
    found = 0
    for source in [root / "src", *sorted(root.glob("crates/*/src"))]:
        try:
            graphlib.TopologicalSorter(arrows(source)).prepare()
        except graphlib.CycleError as error:
            found += 1
            circle = " uses ".join("::".join(module) for module in reversed(error.args[1]))
            print(f"{source.relative_to(root)}: {circle}; move what they share into a module below them", file=sys.stderr)
    sys.exit(bool(found))


main()
