"""Which file of `src` uses which, and whether any of them use each other in a circle.

`python3 tests/imports.py` fails and names the files of each circle; with `--dot` it prints the picture
for Graphviz. Tests inside files and files of tests may use whatever they like.
"""

import re
import sys
from pathlib import Path

SOURCE = Path(__file__).resolve().parent.parent / "src"


def modules():
    """The path of every module that is a file: `store::parquet::digest`."""
    found = {}
    for file in sorted(SOURCE.rglob("*.rs")):
        parts = file.relative_to(SOURCE).with_suffix("").parts
        if file.name not in ("lib.rs", "main.rs") and "tests" not in parts:
            found["::".join(parts)] = file
    return found


def code(file):
    """The text of a file without comments, strings, and what only tests see."""
    # In one go: an address in a string is no comment, a quotation mark in a comment no string.
    parts = r"""r#".*?"#|"(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])'|//[^\n]*"""
    text = re.sub(parts, lambda part: "" if part[0].startswith("//") else '""', file.read_text(encoding="utf-8"), flags=re.S)
    text = re.split(r"#\[cfg\(test\)\]\s*mod \w+ \{", text)[0]
    return re.sub(r"#\[cfg\(test\)\]\s*[^;{]*;", "", text)


def spread(tree):
    """The paths of a tree of imports: `a::{b, c::{d}}` are `a::b` and `a::c::d`."""
    head, brace, rest = tree.partition("{")
    if not brace:
        return [re.split(r"\s+as\s+", tree.strip())[0]]
    depth, start, branches = 0, 0, []
    rest = rest[: rest.rindex("}")]
    for place, letter in enumerate(rest + ","):
        depth += {"{": 1, "}": -1}.get(letter, 0)
        if letter == "," and depth == 0:
            branches.append(rest[start:place].strip())
            start = place + 1
    return [head.strip() + path for branch in branches if branch for path in spread(branch)]


def absolute(path, module):
    """A path as seen from the crate; none if it is another crate's."""
    parts = path.split("::")
    here = module.split("::")
    if parts[0] == "crate":
        return parts[1:]
    if parts[0] == "self":
        return here + parts[1:]
    ups = 0
    while ups < len(parts) and parts[ups] == "super":
        ups += 1
    if ups:
        return here[: len(here) - ups] + parts[ups:]
    return None


def uses(module, file, known):
    text = code(file)
    paths = []
    names = {}
    for tree in re.findall(r"\buse\s+([^;]+);", text):
        for path in spread(re.sub(r"\s+", " ", tree)):
            paths.append(path)
    text = re.sub(r"\buse\s+[^;]+;", "", text)
    paths += re.findall(r"\b(?:crate|self|super)(?:::\w+)+", text)
    children = re.findall(r"\bmod\s+(\w+)\s*;", text)
    paths += [f"self::{path}" for path in re.findall(r"(?<![:\w])(\w+(?:::\w+)+)", text) if path.split("::")[0] in children]
    found = set()
    for path in paths:
        if path.split("::")[0] in children:
            path = "self::" + path
        parts = absolute(path.replace(" ", ""), module)
        while parts and "::".join(parts) not in known:
            parts = parts[:-1]
        target = "::".join(parts or [])
        # What stands in the file above is the module's own.
        if target and target != module and not module.startswith(target + "::"):
            found.add(target)
    return found


def circles(graph):
    """The strongly connected components of more than one file (Tarjan 1972)."""
    index, low, stack, found = {}, {}, [], []

    def visit(node):
        index[node] = low[node] = len(index)
        stack.append(node)
        for other in sorted(graph[node]):
            if other not in index:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], index[other])
        if low[node] == index[node]:
            component = []
            while not component or component[-1] != node:
                component.append(stack.pop())
            if len(component) > 1:
                found.append(sorted(component))

    sys.setrecursionlimit(10_000)
    for node in sorted(graph):
        if node not in index:
            visit(node)
    return found


def main():
    known = modules()
    graph = {module: uses(module, file, known) for module, file in known.items()}
    if "--dot" in sys.argv[1:]:
        lines = [f'  "{one}" -> "{other}";' for one in sorted(graph) for other in sorted(graph[one])]
        print("digraph imports {", *lines, "}", sep="\n")
        return
    found = circles(graph)
    for circle in found:
        print("these files use each other:")
        for module in circle:
            print(f"  {module} uses {', '.join(sorted(graph[module] & set(circle)))}")
    if found:
        sys.exit(1)
    print(f"{len(graph)} files, {sum(map(len, graph.values()))} arrows between them, no circle")


main()
