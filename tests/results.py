"""Writes docs/results.md and docs/results/ from the tables of the shipped studies in data/results-of-the-paper/.

    python3 tests/results.py                     check that the pages agree with the tables
    python3 tests/results.py --write             write the pages
    python3 tests/results.py --collect DATA [STUDY ...]
                                                  copy tables, claims and figures of finished studies from the data
                                                  folder DATA, of all studies unless some are named
    python3 tests/results.py --reword            update the texts of claims in data/results-of-the-paper/ after a change of
                                                  wording; numbers stay

The last two use the `asperity` on the PATH, or the program in ASPERITY. Needs polars. The text of the
article is in results_article.py, the pages with its evidence are in results_evidence.py, and their tables are in
results_tables.py.
"""

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import results_article
import results_evidence
from results_tables import CAMPAIGN, ROOT, TABLES

FIGURES = ROOT / "docs/images/results"
DOCS = ROOT / "docs"


# The texts of a claim, which are the same for nearly all studies.
TEXTS = ["says", "where", "because", "quantity", "expected"]


def program():
    named = os.environ.get("ASPERITY") or shutil.which("asperity")
    assert named, "no asperity on the PATH"
    return named


def collect(data, studies):
    def told(study, command, *arguments, may_be=(0,)):
        manifest = ROOT / "manifests" / f"{study}.toml"
        ran = subprocess.run([program(), command, manifest, "--data", data, *arguments], stdout=subprocess.PIPE)
        assert ran.returncode in may_be, f"{command} of {study}"
        return ran.stdout

    plans = {study: json.loads(told(study, "plan", "--json")) for study in studies}
    for study, plan in plans.items():
        assert not any(stage["to_run"] for stage in plan["stages"]), f"{study} is not finished"
    FIGURES.mkdir(parents=True, exist_ok=True)
    for study, plan in plans.items():
        take(told, data, study, plan)


def take(told, data, study, plan):
    tables, figures = results_evidence.STUDIES[study]
    about = {"tasks": {stage["name"]: stage["cached"] for stage in plan["stages"]}}
    told(study, "report")
    results = Path(data) / "results" / study
    to = TABLES / study
    shutil.rmtree(to, ignore_errors=True)
    to.mkdir(parents=True)
    for table in tables:
        shutil.copy(results / f"{table}.parquet", to)
    for figure in figures:
        shutil.copy(results / "figures" / f"{figure}.svg", FIGURES / f"{study}-{figure}.svg")
    # The command exits with 1 if a claim does not hold.
    claims = json.loads(told(study, "claims", "--json", may_be=(0, 1)), object_hook=without_estimates)
    for name, what in (("about", about), ("claims", claims)):
        (to / f"{name}.json").write_text(json.dumps(what, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def without_estimates(of_json):
    """Removes the costs of more surfaces, which depend on the speed of the machine."""
    return {key: value for key, value in of_json.items() if key != "core_hours"}


def reword():
    manifest = ROOT / "manifests/quickstart.toml"
    with tempfile.TemporaryDirectory() as empty:
        told = subprocess.run([program(), "claims", manifest, "--data", empty, "--json"], stdout=subprocess.PIPE, check=True)
    texts = texts_of(json.loads(told.stdout))
    before = texts_of(json.loads((TABLES / CAMPAIGN / "claims.json").read_text(encoding="utf-8")))
    for path in TABLES.glob("*/claims.json"):
        found = json.loads(path.read_text(encoding="utf-8"))
        for claim in found["claims"]:
            name = claim["name"]
            # A text that depends on the study differs from that of the campaign; change it by hand.
            if all(claim[key] == before[name][key] for key in TEXTS):
                claim |= texts[name]
            else:
                print(f"{path.parent.name}: {name} keeps its text")
        path.write_text(json.dumps(found, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def texts_of(claims):
    return {claim["name"]: {key: claim[key] for key in TEXTS} for claim in claims["claims"]}


def pages():
    evidence = {DOCS / "results" / f"{name}.md": text for name, text in results_evidence.pages().items()}
    return {DOCS / "results.md": results_article.page(), **evidence}


def main(arguments):
    if arguments[:1] == ["--collect"] and len(arguments) > 1:
        collect(arguments[1], arguments[2:] or list(results_evidence.STUDIES))
    elif arguments == ["--reword"]:
        reword()
    elif arguments == ["--write"]:
        (DOCS / "results").mkdir(exist_ok=True)
        for path, text in pages().items():
            path.write_text(text, encoding="utf-8")
    elif not arguments:
        for path, text in pages().items():
            assert path.read_text(encoding="utf-8") == text, (
                f"{path.relative_to(ROOT)} does not agree with data/results-of-the-paper: run python3 tests/results.py --write")
        print("the results agree with their tables")
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main(sys.argv[1:])
