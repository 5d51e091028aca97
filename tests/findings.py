"""What studies have found, as a page: docs/findings.md is written from the tables under data/findings/.

    python3 tests/findings.py                     whether the page says what the tables do
    python3 tests/findings.py --write             write it
    python3 tests/findings.py --collect DATA      take tables, claims and figures of finished studies from DATA,
                                                  with the program on the PATH, or what ASPERITY names

Needs polars. Words are in findings_page.py, tables in findings_tables.py.
"""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import findings_page
from findings_tables import ROOT, TABLES

FIGURES = ROOT / "docs/images/findings"
PAGE = ROOT / "docs/findings.md"


def collect(data):
    program = os.environ.get("ASPERITY") or shutil.which("asperity")
    assert program, "no asperity on the PATH"

    def told(study, command, *arguments, may_be=(0,)):
        manifest = ROOT / "manifests" / f"{study}.toml"
        ran = subprocess.run([program, command, manifest, "--data", data, *arguments], stdout=subprocess.PIPE)
        assert ran.returncode in may_be, f"{command} of {study}"
        return ran.stdout

    plans = {study: json.loads(told(study, "plan", "--json")) for study in findings_page.STUDIES}
    for study, plan in plans.items():
        assert not any(stage["to_run"] for stage in plan["stages"]), f"{study} has not been run to its end"
    for folder in (TABLES, FIGURES):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
    for study, plan in plans.items():
        take(told, data, study, plan)


def take(told, data, study, plan):
    tables, figures = findings_page.STUDIES[study]
    about = {"tasks": {stage["name"]: stage["cached"] for stage in plan["stages"]}}
    told(study, "report")
    results = Path(data) / "results" / study
    to = TABLES / study
    to.mkdir()
    for table in tables:
        shutil.copy(results / f"{table}.parquet", to)
    for figure in figures:
        shutil.copy(results / "figures" / f"{figure}.svg", FIGURES / f"{study}-{figure}.svg")
    # It exits with 1 where a claim does not hold, which is a finding.
    claims = json.loads(told(study, "claims", "--json", may_be=(0, 1)), object_hook=without_estimates)
    for name, what in (("about", about), ("claims", claims)):
        (to / f"{name}.json").write_text(json.dumps(what, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def without_estimates(of_json):
    """What more surfaces would cost depends on how fast the machine was."""
    return {key: value for key, value in of_json.items() if key != "core_hours"}


def main(arguments):
    if arguments[:1] == ["--collect"] and len(arguments) == 2:
        collect(arguments[1])
    elif arguments == ["--write"]:
        PAGE.write_text(findings_page.page(), encoding="utf-8")
    elif not arguments:
        assert PAGE.read_text(encoding="utf-8") == findings_page.page(), (
            "docs/findings.md does not say what data/findings has: python3 tests/findings.py --write")
        print("docs/findings.md says what its tables do")
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main(sys.argv[1:])
