"""Claims of docs/findings.md, from what `asperity claims --json` said of each study."""

import json

from findings_tables import TABLES, digits, rows


def of(study):
    return {one["name"]: one for one in
            json.loads((TABLES / study / "claims.json").read_text(encoding="utf-8"))["claims"]}


def cell(text):
    return text.replace("|", "\\|").replace("\n", " ")


def table(study, names):
    """These claims: what is said, and what was found where it is nearest to its bounds, or farthest beyond them."""
    claims = of(study)
    lines = []
    for name in names:
        claim = claims[name]
        assert claim["verdict"] != "not computed", f"{name} is not known from {study}"
        lines.append([f"**{claim['verdict']}**", f"{cell(claim['says'])} ({cell(claim['where'])}; `{name}`)",
                      cell(found(claim))])
    return rows(["", "what is said", "what was found"], lines)


def found(claim):
    quantities = claim["quantities"]
    deciding = next((one for one in quantities if one["label"] == claim["deciding"]), quantities[0])
    ends = ("least", "most") if claim["verdict"] == "holds" else ("lower", "upper")
    lower, upper = (deciding[end] for end in ends)
    text = f"{claim['quantity']}: expected {claim['expected']}; found **{digits(deciding['value'])}**"
    if lower is not None and lower != upper:
        text += f" [{digits(lower)}, {digits(upper)}]"
    text += f" for {deciding['label']}"
    if len(quantities) == 1 and claim["verdict"] != "cannot say":
        return text
    if claim["verdict"] == "does not hold":
        return text + f"; {claim['contradicting']} of {len(quantities)} contradict, {claim['undecided']} are undecided"
    if claim["verdict"] == "cannot say":
        without = "".join(f"; {one} has no value" for one in claim["without_value"])
        undecided = f"; {claim['undecided']} of {len(quantities)} are undecided" if len(quantities) > 1 else ""
        return text + undecided + without + samples(claim, deciding)
    return text + f", where it is nearest to its bounds, of {len(quantities)}"


def samples(claim, deciding):
    """How many surfaces a claim rests on that cannot be told, and how many more would tell it."""
    more = claim["more_surfaces"]
    would = f", {more} more would decide" if more else ", and no number would decide" if claim["undecided"] else ""
    return f"; n = {deciding['n']} surfaces{would}"


def misprints(study):
    lines = [[cell(f"“{claim['says'].strip('“”')}”"), cell(claim["where"]), f"{cell(claim['because'])} (`{name}`)"]
             for name, claim in of(study).items() if claim["kind"] == "misprint"]
    return rows(["as printed", "where", "but"], lines)


def assert_all_told(text, study):
    """Nothing of the paper is left out, but what nothing computed."""
    for name, claim in of(study).items():
        if claim["kind"] != "ours" and claim["verdict"] != "not computed":
            assert f"`{name}`" in text, f"{name} is told nowhere"


def counted(study):
    """How many claims have which verdict."""
    verdicts = ["holds", "does not hold", "cannot say"]
    lines = []
    for kind, named in (("paper", "of the paper"), ("ours", "beside the paper")):
        all_of = [claim["verdict"] for claim in of(study).values() if claim["kind"] == kind]
        counts = [all_of.count(verdict) for verdict in verdicts]
        lines.append([named, *(str(count) for count in counts)])
    return rows([f"claims on `{study}.toml`", *verdicts], lines)


def collapse(study):
    """Whether the groups are gone in the corrected area."""
    claim = of(study)["corrected-area-depends-on-bandwidth-alone"]
    worst = max(claim["quantities"], key=lambda one: abs(one["value"]))
    lower, upper = digits(worst["lower"], 2), digits(worst["upper"], 2)
    return (f"corrected as in 2017 they depend on k_s/k_l, and what k_l adds to ln A for each factor e is at most "
            f"{digits(abs(worst['value']), 2)} in size ({worst['label']}: {digits(worst['value'], 2)} [{lower}, {upper}]).")
