"""Checks that all files name the address, the version and the Rust version of Cargo.toml.

    python3 tests/metadata.py              compare
    python3 tests/metadata.py --write      copy the address, the version and the Rust version to all files

`[workspace.package]` of Cargo.toml is the place where a person changes them.
"""

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

cargo = (ROOT / "Cargo.toml").read_text(encoding="utf-8")


def of_workspace(key):
    package = cargo.split("[workspace.package]")[1]
    return re.search(rf'^{key} = "(.*)"', package, re.M)[1]


ADDRESS = of_workspace("repository")
VERSION = of_workspace("version")
RUST = of_workspace("rust-version")
NAME = ADDRESS.rsplit("/", 1)[1]
# The address that the files name so far: that of CITATION.cff.
NAMED = re.search(r'^repository-code: "?([^"\n]+)', (ROOT / "CITATION.cff").read_text(encoding="utf-8"), re.M)[1]
# Addresses of this project: the one so far, and those of other owners.
ADDRESSES = (
    rf"()(?:{re.escape(NAMED)}|https://(?:github|gitlab|codeberg)\.(?:com|org)/[\w.-]+/{NAME})(?![\w-])",
    ADDRESS,
)
# Files, a pattern whose group is the text before the stated value, and the value.
STATED = [
    (["CITATION.cff"], (r'(^version: "?)\d[\d.]*\d', VERSION)),
    (["codemeta.json"], (r'("(?:version|softwareVersion)": "v?)\d[\d.]*\d', VERSION)),
    (["packaging/conda-forge/recipe.yaml"], (r'(^  version: ")\d[\d.]*\d', VERSION)),
    (["packaging/spack/package.py"], (r'(version\(")\d[\d.]*\d', VERSION)),
    (["packaging/spack/package.py"], (r"(/tags/v)\d[\d.]*\d", VERSION)),
    (["Cargo.toml"], (r'(^asperity-.* version = ")\d[\d.]*\d', VERSION)),
    (["packaging/spack/package.py"], (r"(rust@)\d[\d.]*\d", RUST)),
    (["packaging/Dockerfile", "packaging/asperity.def", ".github/workflows/ci.yml"], (r"(rust:)\d[\d.]*\d", RUST)),
    ([".github/workflows/release.yml"], (r"(rustup (?:toolchain install|default) )\d[\d.]*\d", RUST)),
    (["README.md", "docs/how-to/install.md"], (r"(Rust )\d[\d.]*\d", RUST)),
]


def tracked(*patterns):
    names = subprocess.check_output(["git", "ls-files", "-z", *patterns], cwd=ROOT, text=True)
    return [name for name in names.split("\0") if name and (ROOT / name).is_file()]


def main():
    texts = tracked("*.md", "*.toml", "*.cff", "*.json", "*.yml", "*.yaml", "*.py", "*.def", "*Dockerfile")
    wrong = []
    for names, (pattern, value) in [(texts, ADDRESSES), *STATED]:
        for name in tracked(*names):
            path = ROOT / name
            text = path.read_text(encoding="utf-8")
            stated, count = re.subn(pattern, lambda found: found[1] + value, text, flags=re.M)
            if count == 0 and names is not texts:
                wrong.append(f"{name}: nothing matches `{pattern}`")
            elif stated != text and "--write" in sys.argv:
                path.write_text(stated, encoding="utf-8")
            elif stated != text:
                lines = zip(text.splitlines(), stated.splitlines())
                pairs = [(old.strip(), new.strip()) for old, new in lines if old != new]
                wrong += [f"{name}: `{old}` should be `{new}`" for old, new in pairs]
    if wrong:
        sys.exit("\n".join([*wrong, "run `python3 tests/metadata.py --write`"]))
    print(f"all files name {ADDRESS}, version {VERSION} and Rust {RUST}")


if __name__ == "__main__":
    main()
