"""The claims in docs/results.md, from the output of `asperity claims --json` for each study."""

import json

from results_tables import CAMPAIGN, TABLES, digits, rows


def of(study):
    return {one["name"]: one for one in
            json.loads((TABLES / study / "claims.json").read_text(encoding="utf-8"))["claims"]}


def values(name, study=CAMPAIGN):
    """Returns the values of the quantities of a claim."""
    return [one["value"] for one in of(study)[name]["quantities"]]


def cell(text):
    return text.replace("|", "\\|").replace("\n", " ")


def table(study, names):
    """Returns a table of these claims: the statement, and the quantity closest to its bounds or farthest beyond."""
    claims = of(study)
    lines = []
    for name in names:
        claim = claims[name]
        assert claim["verdict"] != "not computed", f"{study} does not decide {name}"
        lines.append([f"**{claim['verdict']}**", f"{cell(claim['says'])} ({cell(claim['where'])}; `{name}`)",
                      cell(f"{claim['quantity']}; expected {claim['expected']}".replace(" -", " −")), cell(found(claim))])
    return rows(["verdict", "claim", "quantity", "result"], lines)


def found(claim):
    quantities = claim["quantities"]
    deciding = next((one for one in quantities if one["label"] == claim["deciding"]), quantities[0])
    ends = ("least", "most") if claim["verdict"] == "holds" else ("lower", "upper")
    lower, upper = (deciding[end] for end in ends)
    text = f"**{digits(deciding['value'])}**"
    if lower is not None and lower != upper:
        text += f" [{digits(lower)}, {digits(upper)}]"
    text += f" for {deciding['label']}"
    if len(quantities) == 1 and claim["verdict"] != "cannot say":
        return text
    if claim["verdict"] == "does not hold":
        return text + (f"; of {len(quantities)} quantities {claim['contradicting']} contradict and "
                       f"{claim['undecided']} are undecided")
    if claim["verdict"] == "cannot say":
        without = "".join(f"; {one} has no value" for one in claim["without_value"])
        undecided = f"; {claim['undecided']} of {len(quantities)} quantities are undecided" if len(quantities) > 1 else ""
        return text + undecided + without + samples(claim, deciding)
    least, most = (digits(end(one["value"] for one in quantities)) for end in (min, max))
    return text + f"; of {len(quantities)} quantities from {least} to {most}, it has the smallest margin in standard errors"


def samples(claim, deciding):
    """Returns how many surfaces an undecided claim has, and how many more would decide it."""
    more = claim["more_surfaces"]
    would = "; no number would decide" if claim["undecided"] else ""
    if more:
        would = f"; {more} more would decide" if more <= 1000 else "; more than 1000 more would be necessary"
    return f"; n = {deciding['n']} surfaces{would}"


def quoted(text):
    """Returns a text in quotation marks, unless it contains quotations."""
    return text if "“" in text else f"“{text}”"


def misprints(study):
    lines = [[cell(quoted(claim["says"])), cell(claim["where"]), f"{cell(claim['because'])} (`{name}`)"]
             for name, claim in of(study).items() if claim["kind"] == "misprint"]
    return rows(["printed", "where", "correction"], lines)


def assert_all_told(text, study):
    """Checks that the page contains each claim of the paper that a study has computed."""
    for name, claim in of(study).items():
        if claim["kind"] != "ours" and claim["verdict"] != "not computed":
            assert f"`{name}`" in text, f"the page does not contain {name}"


def counted(study):
    """Returns a table with the number of claims of each verdict."""
    verdicts = ["holds", "does not hold", "cannot say"]
    lines = []
    for kind, named in (("paper", "of the paper"), ("ours", "of asperity")):
        all_of = [claim["verdict"] for claim in of(study).values() if claim["kind"] == kind]
        counts = [all_of.count(verdict) for verdict in verdicts]
        lines.append([named, *(str(count) for count in counts)])
    return rows([f"claims on `{study}.toml`", *verdicts], lines)
