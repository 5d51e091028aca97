"""Writes the licences of all crates that the build of the program and the Python module uses.

    python3 release/licences.py FILE        write them; each text once, with the crates that it covers
    python3 release/licences.py             list the licences and the number of crates
"""

import json
import subprocess
import sys
from collections import Counter, defaultdict
from pathlib import Path

TARGET = "x86_64-unknown-linux-gnu"
NAMES = ("LICENSE", "LICENCE", "COPYING", "COPYRIGHT", "NOTICE", "UNLICENSE")
HEADING = """asperity contains the following crates of other authors. After each list of crates follow the texts of
their licences. A crate that has no such file is listed with its licence only.
"""


def used_crates():
    """Returns the packages on crates.io that the build uses, without those of tests and build scripts."""
    metadata = json.loads(
        subprocess.check_output(
            ["cargo", "metadata", "--format-version", "1", "--locked", "--filter-platform", TARGET]
        )
    )
    packages = {package["id"]: package for package in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    found, waiting = set(), list(metadata["workspace_members"])
    while waiting:
        one = waiting.pop()
        if one in found:
            continue
        found.add(one)
        for dependency in nodes[one]["deps"]:
            if any(kind["kind"] is None for kind in dependency["dep_kinds"]):
                waiting.append(dependency["pkg"])
    used = [packages[one] for one in found if packages[one]["source"]]
    return sorted(used, key=lambda package: (package["name"], package["version"]))


def texts_of(package):
    """Returns the texts of the licence files in the folder of a package."""
    folder = Path(package["manifest_path"]).parent
    files = [path for path in sorted(folder.iterdir()) if path.name.upper().startswith(NAMES) and path.is_file()]
    if package["license_file"]:
        files.append(folder / package["license_file"])
    return [path.read_text(encoding="utf-8", errors="replace").strip() for path in files]


def main():
    packages = used_crates()
    licences = Counter(package["license"] or package["license_file"] for package in packages)
    for licence, count in licences.most_common():
        print(f"{count:4}  {licence}")
    if len(sys.argv) < 2:
        return
    covered, texts = defaultdict(list), {}
    for package in packages:
        line = f"{package['name']} {package['version']}: {package['license']} ({package['repository'] or 'no address'})"
        keys = []
        for text in texts_of(package):
            # Copies differ in line breaks.
            key = " ".join(text.split())
            texts.setdefault(key, text)
            keys.append(key)
        covered[tuple(dict.fromkeys(keys))].append(line)
    parts, written = [HEADING], {}
    for keys, lines in covered.items():
        parts.append("=" * 80 + "\n" + "\n".join(lines))
        for key in keys:
            if key in written:
                parts.append(f"(text {written[key]} above)")
            else:
                written[key] = len(written) + 1
                parts.append(f"--- text {written[key]} ---\n\n{texts[key]}")
    Path(sys.argv[1]).write_text("\n\n".join(parts) + "\n", encoding="utf-8")
    missing = sum(len(lines) for keys, lines in covered.items() if not keys)
    print(f"{len(packages)} crates, {len(written)} texts, {missing} crates without a file")


if __name__ == "__main__":
    main()
