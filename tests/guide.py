"""Tests the guide: runs its blocks, checks its manifests and links, and compares the generated pages.

    python3 tests/guide.py run README.md          run the blocks of one page, in the root of the checkout
    python3 tests/guide.py run                    run all blocks of the guide and check its manifests
    python3 tests/guide.py links                  check links, anchors and the table of contents
    python3 tests/guide.py reference              compare the generated pages with the program
    python3 tests/guide.py reference --write      write the generated pages

The program is `asperity` on the PATH, or what ASPERITY names.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

import python_reference
import reference

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
# tests/cluster.py runs the commands of cluster.md, which need a scheduler. python/tests runs the blocks of
# python.md in one interpreter.
NOT_RUN = {DOCS / "cluster.md", DOCS / "how-to/python.md"}
# Their `text` blocks show what no block of the page prints, such as listings of folders and texts of others.
NOT_OUTPUTS = {DOCS / "how-to/group-store.md", DOCS / "how-to/install.md"}


def program():
    named = os.environ.get("ASPERITY") or shutil.which("asperity")
    assert named, "no asperity on the PATH"
    return str(Path(named).resolve())


def pages():
    """Returns the pages of the guide in the order of its table of contents."""
    names = re.findall(r"\]\(([^)]+\.md)\)", (DOCS / "SUMMARY.md").read_text(encoding="utf-8"))
    return [DOCS / name for name in names]


def blocks(page, *languages):
    words = "|".join(languages)
    return re.findall(rf"^```({words})\n(.*?)^```", page.read_text(encoding="utf-8"), re.M | re.S)


def run_blocks(page, folder, environment):
    """Runs all blocks of a page in one shell, so that an `export` holds in later blocks."""
    shell = "set -euo pipefail\n"
    for language, text in blocks(page, "sh", "python"):
        if language == "python":
            text = f"python3 - <<'END_OF_BLOCK'\n{text}END_OF_BLOCK\n"
        shown = text.strip().replace("'", "'\\''")
        shell += f"printf '%s\\n' '--- {language}' '{shown}' '---'\n{text}"
    print(f"\n=== {page.relative_to(ROOT)}", flush=True)
    command = ["bash", "-c", shell]
    said = []
    with subprocess.Popen(
        command, cwd=folder, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True
    ) as process:
        for line in process.stdout:
            print(line, end="", flush=True)
            said.append(line.strip())
    assert process.returncode == 0, f"{page.relative_to(ROOT)}: a block ended with {process.returncode}"
    return said


def check_outputs(page, said):
    """Checks that the blocks of a page print each line of its `text` blocks, except forecasts."""
    for _, text in blocks(page, "text"):
        for line in text.splitlines():
            is_there = not line.strip() or line.strip() in said or "core-hours" in line
            assert is_there, f"{page.relative_to(ROOT)}: no block prints `{line}`"


def check_manifests(page, asperity):
    """Checks the manifests on a page, as files in `manifests/`. A part whose `from` names a stage that the part
    does not define is appended to the last manifest before it that defines the stage. That manifest may also be
    one that a shell block writes."""

    def stages(manifest):
        return set(re.findall(r"^\[stage\.([\w-]+)\]", manifest, re.M))

    with tempfile.TemporaryDirectory() as folder:
        os.symlink(ROOT / "data", Path(folder) / "data")
        before = []
        for language, text in blocks(page, "sh", "toml"):
            if language == "sh":
                before += re.findall(r"<<'END'\n(\[study\]\n.*?)^END$", text, re.M | re.S)
                continue
            if text.startswith("[cluster]"):
                continue
            read = re.findall(r'"([^"]+)"', " ".join(re.findall(r"^from = .*$", text, re.M)))
            lacks = set(read) - stages(text)
            whole = text if "[study]" in text else f'[study]\nname = "part"\n\n{text}'
            if lacks:
                base = [manifest for manifest in before if lacks <= stages(manifest)]
                whole = f"{(base or before or [''])[-1]}\n{text}"
            before.append(whole)
            path = Path(folder) / "manifests" / f"{page.stem}-{len(before)}.toml"
            path.parent.mkdir(exist_ok=True)
            path.write_text(whole, encoding="utf-8")
            subprocess.run([asperity, "check", path], check=True)


def run_guide():
    asperity = program()
    environment = os.environ | {"PATH": f"{Path(asperity).parent}:{os.environ['PATH']}"}
    with tempfile.TemporaryDirectory() as empty:
        for page in pages():
            check_manifests(page, asperity)
            if page in NOT_RUN or not blocks(page, "sh", "python"):
                continue
            # All pages of the tutorial run in one folder, which is empty at first.
            is_tutorial = page.parent.name == "tutorial"
            said = run_blocks(page, empty if is_tutorial else ROOT, environment)
            if page not in NOT_OUTPUTS:
                check_outputs(page, said)


def anchors(text):
    """Returns the anchors that GitHub and mdBook make of the headings."""
    found = set()
    for heading in re.findall(r"^#+ (.+)$", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S), re.M):
        heading = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
        heading = re.sub(r"[^\w\- ]", "", heading)
        found.add(heading.replace(" ", "-"))
    return found


def check_links():
    listed = pages()
    unlisted = {page for page in DOCS.rglob("*.md")} - set(listed) - {DOCS / "SUMMARY.md"}
    problems = [f"docs/SUMMARY.md lacks {page.relative_to(DOCS)}" for page in sorted(unlisted)]
    outside = [*sorted(ROOT.glob("*.md")), ROOT / "benches/README.md", ROOT / "paper/README.md", DOCS / "SUMMARY.md"]
    count = 0
    for page in listed + outside:
        text = page.read_text(encoding="utf-8") if page.is_file() else None
        if text is None:
            problems.append(f"{page.relative_to(ROOT)} is not there")
            continue
        prose = re.sub(r"^```.*?^```|`[^`\n]*`", "", text, flags=re.M | re.S)
        for target in re.findall(r"\]\(([^)\s]+)\)|<img[^>]*\ssrc=\"([^\"]+)\"", prose):
            target = target[0] or target[1]
            if re.match(r"https?:|mailto:", target):
                continue
            count += 1
            path, _, anchor = target.partition("#")
            goal = (page.parent / path).resolve() if path else page
            if DOCS in page.parents and DOCS not in goal.parents:
                problems.append(f"{page.relative_to(ROOT)}: {target} leads out of the book")
            elif not goal.exists():
                problems.append(f"{page.relative_to(ROOT)}: {target} leads nowhere")
            elif anchor and goal.suffix == ".md" and anchor not in anchors(goal.read_text(encoding="utf-8")):
                problems.append(f"{page.relative_to(ROOT)}: {target} has no such heading")
    assert not problems, "\n".join(problems)
    print(f"{len(listed)} pages, {count} links")


def formats_page():
    """Returns the page of formats that other programs read in another way."""
    text = (
        "# Formats that readers disagree about\n\n"
        "<!-- Written by `tests/guide.py reference --write` from\n"
        "`crates/topography-files/tests/disagreements.toml`. -->\n\n"
        "Each section is a [format](../how-to/measured-surface.md#formats). A row says what goes wrong elsewhere with a\n"
        "kind of file, what asperity does, and the evidence. Tests read the files that are named, which are in\n"
        "`data/topography/field`.\n"
    )
    tables = tomllib.loads((ROOT / "crates/topography-files/tests/disagreements.toml").read_text(encoding="utf-8"))
    rows = tables["row"]
    for name in sorted({row["format"] for row in rows}):
        text += f"\n## {name}\n\n| kind of file | elsewhere | asperity | evidence |\n|---|---|---|---|\n"
        for row in rows:
            if row["format"] == name:
                files = "".join(f"; `{file}`" for file in row.get("files", []))
                text += f"| {row['kind']} | {row['others']} | {row['asperity']} | {row['evidence']}{files} |\n"
    text += "\n## What is not read\n\n| kind of file | why | what to do |\n|---|---|---|\n"
    for row in tables["unread"]:
        text += f"| {row['kind']} | {row['reason']} | {row['advice']} |\n"
    return text


def check_reference(write):
    pages = {
        "keys.md": reference.keys_page(program()),
        "columns.md": reference.columns_page(program()),
        "commands.md": reference.commands_page(program()),
        "formats.md": formats_page(),
        "python.md": python_reference.page(),
    }
    for name, text in pages.items():
        path = DOCS / "reference" / name
        if write:
            path.write_text(text, encoding="utf-8")
        assert path.read_text(encoding="utf-8") == text, (
            f"docs/reference/{name} is not as the program has it: python3 tests/guide.py reference --write"
        )
    print(f"{len(pages)} pages are as the program has them")


def main(command=None, *arguments):
    match command:
        case "run" if arguments:
            page = (ROOT / arguments[0]).resolve()
            check_outputs(page, run_blocks(page, ROOT, os.environ))
        case "run":
            run_guide()
        case "links":
            check_links()
        case "reference":
            check_reference(write="--write" in arguments)
        case _:
            sys.exit(__doc__)


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except (AssertionError, subprocess.CalledProcessError) as error:
        sys.exit(f"error: {error}")
