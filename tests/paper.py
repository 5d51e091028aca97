"""Checks the paper of the Journal of Open Source Software: its sections, its length and its references.

    python3 tests/paper.py

With `pandoc` on the PATH, it also compiles the paper to HTML, with all citations resolved.
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent.parent / "paper"
# https://joss.readthedocs.io/en/latest/paper.html
SECTIONS = [
    "Summary",
    "Statement of need",
    "State of the field",
    "Software design",
    "Research impact statement",
    "AI usage disclosure",
    "Acknowledgements",
    "References",
]
WORDS = range(750, 1751)


def main():
    text = (FOLDER / "paper.md").read_text(encoding="utf-8")
    text = text.split("\n---\n", 1)[1]
    entries = re.findall(r"^@\w+\{(\w+),", (FOLDER / "paper.bib").read_text(encoding="utf-8"), re.M)
    cited = set(re.findall(r"@(\w+)", text))
    sections = re.findall(r"^# (.+)$", text, re.M)
    prose = re.sub(r"^(\||: |!\[).*$", "", text, flags=re.M)
    count = len(prose.split())

    problems = []
    if sections != SECTIONS:
        problems.append(f"the sections are {sections}, and JOSS asks for {SECTIONS}")
    if count not in WORDS:
        problems.append(f"the paper has {count} words, and JOSS asks for {WORDS.start} to {WORDS.stop - 1}")
    problems += [f"paper.bib lacks `{key}`" for key in sorted(cited - set(entries))]
    problems += [f"`{key}` of paper.bib is not cited" for key in entries if key not in cited]
    if not problems and shutil.which("pandoc"):
        command = ["pandoc", "--citeproc", "--fail-if-warnings", "--standalone", "paper.md", "--output", "-"]
        done = subprocess.run(command, cwd=FOLDER, capture_output=True, text=True)
        if done.returncode != 0:
            problems.append(done.stderr.strip())
    if problems:
        sys.exit("\n".join(problems))
    print(f"{count} words, {len(entries)} references")


if __name__ == "__main__":
    main()
