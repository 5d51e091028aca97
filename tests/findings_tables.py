"""The tables of docs/findings.md, from those under data/findings/: each function gives one as Markdown, or the numbers
of a sentence."""

import json
import math
from pathlib import Path

import polars as pl

ROOT = Path(__file__).resolve().parent.parent
TABLES = ROOT / "data/findings"
CAMPAIGN = "yastrebov-2015"
BGT = math.sqrt(2 * math.pi)


def table(study, name):
    return pl.read_parquet(TABLES / study / f"{name}.parquet")


def digits(value, count=4):
    """So many significant digits, without an exponent where people would write none."""
    if value is None or not math.isfinite(value):
        return "–"
    if value == 0:
        return "0"
    places = count - 1 - math.floor(math.log10(abs(value)))
    text = f"{value:.{max(places, 0)}f}" if -3 < places < 12 else f"{value:.{count - 1}e}"
    return text.replace("-", "−")


def with_interval(row, name, count=4):
    value, lower, upper = (row.get(name + ending) for ending in ("", "_lower", "_upper"))
    if value is None or lower is None:
        return digits(value, count)
    return f"{digits(value, count)} [{digits(lower, count)}, {digits(upper, count)}]"


def with_error(value, error):
    """A value to the second digit of its standard error, and this."""
    places = max(1 - math.floor(math.log10(error)), 0)
    return f"{value:.{places}f} ± {error:.{places}f}"


def between(values, count=3):
    return f"{digits(min(values), count)} … {digits(max(values), count)}"


def rows(heads, lines):
    text = "| " + " | ".join(heads) + " |\n|" + "---|" * len(heads) + "\n"
    return text + "".join("| " + " | ".join(line) + " |\n" for line in lines)


def provenance(studies):
    lines = []
    for study in studies:
        about = json.loads((TABLES / study / "about.json").read_text(encoding="utf-8"))
        told = ", ".join(f"{stage} {tasks}" for stage, tasks in about["tasks"].items())
        lines.append([f"`manifests/{study}.toml`", told])
    return rows(["study", "tasks of each stage"], lines)


def curves(load, correction):
    near = table(CAMPAIGN, "curves").filter((pl.col("load") - load).abs() < 1e-3 * load)
    return near.filter(pl.col("correction") == correction).sort("k_lower", "k_upper")


def area_at(load):
    return between(curves(load, "none")["area_corrected_mean"]) + " as counted"


def persson_at(load):
    return digits(curves(load, "none")["area_persson"][0], 3)


def full_contact_range():
    return between(table(CAMPAIGN, "spectra")["full_contact_load_mean"])


def sealing_limit():
    """The likeliest fit of the area at which the gap stops percolating."""
    fits = table("limits", "percolation-limits").filter(pl.col("quantity") == "percolation_area_corrected")
    return fits.sort("akaike").to_dicts()[0]


def sealing_words():
    return (f"The gap stops percolating where {with_interval(sealing_limit(), 'limit', 3)} of the area are in contact, in the "
            "limits of great cells, wide spectra and fine meshes; Wang & Müser (2020) have 0.415.")


def narrow_sealing():
    fit = sealing_limit()
    octave = fit["limit"] + fit["coefficient_2"] * 0.5 ** fit["exponent_2"]
    return (f"Spectra of an octave, k_s = 2 k_l, seal earlier than wide ones: {digits(octave, 2)} by the fit above, which is where "
            "the first claim fails.")


def asperity_words():
    """Area of the models over that of the solution, on the paper's mesh."""
    at = table("asperities-1024", "beside").filter((pl.col("load") - 0.0057).abs() < 1e-4)
    told = {interaction: at.filter(pl.col("interaction") == interaction)["ratio"] for interaction in ("none", "explicit")}
    none, explicit = (f"{digits(ratio.median(), 2)} ({between(ratio, 2)})" for ratio in told.values())
    return (f"Asperity models have less area than the solution on the same surfaces: at a load of 0.0057 {none} of it "
            f"without interaction, {explicit} where each asperity is displaced by all others.")


def kappa_words():
    """κ of three loads at the widest and the narrowest bandwidth that the paper has."""
    fits = table("limits", "kappa-limits").filter(
        (pl.col("status") == "fitted") & (pl.col("correction") == "2017") & (pl.col("form_1") == "power 1"))
    told = []
    for row in fits.sort("load").to_dicts():
        kappa = [(row["limit"] + row["coefficient_2"] * math.log(ratio)) / BGT for ratio in (1 / 2, 1 / 128)]
        told.append(f"from {digits(kappa[0], 3)} to {digits(kappa[1], 3)} at a load of {digits(row['load'], 1)}")
    return ("In the limits of great cells and fine meshes κ = area/load falls with the logarithm of the bandwidth, from "
            f"k_s/k_l = 2 to 128, in units of √(2π): {'; '.join(told)}. Persson's theory has 0.637 at light loads.")


def spectra():
    """Nayak's parameter, density of summits, effective modes and full contact of the campaign's spectra."""
    lines = []
    for row in table(CAMPAIGN, "spectra").sort("k_lower", "k_upper").to_dicts():
        error = row["nayak_sd"] / math.sqrt(row["count"])
        lines.append([str(row["k_lower"]), str(row["k_upper"]), str(row["count"]),
                      with_error(row["nayak_mean"], error), digits(row["summit_density_integer_mean"]),
                      digits(row["effective_modes_mean"], 3),
                      f"{digits(row['full_contact_load_mean'], 3)} ({digits(row['full_contact_load_min'], 3)} … "
                      f"{digits(row['full_contact_load_max'], 3)})"])
    return rows(["k_l", "k_s", "surfaces", "α", "D", "effective modes", "load at full contact"], lines)


def tabulated(name, error, closed, printed):
    """A table of the paper, as printed and as found, for both Hurst exponents."""
    paper = pl.read_csv(ROOT / "data/literature" / f"{printed}.csv")
    found = table("nayak", "table").join(paper, on=["hurst", "k_lower", "k_upper"], how="left")
    of = {(row["k_lower"], row["k_upper"], row["hurst"]): row for row in found.to_dicts()}
    lines = []
    for k_lower, k_upper in sorted({key[:2] for key in of}):
        line = [str(k_lower), str(k_upper)]
        for hurst in (0.8, 0.3):
            row = of[k_lower, k_upper, hurst]
            line += [digits(row["numerical"]) if row["numerical"] is not None else "–", with_error(row[name], row[error])]
            line += [digits(row[closed])] if closed else []
        lines.append(line)
    heads = ["printed", "found", *(["closed form"] if closed else [])]
    return rows(["k_l", "k_s", *(f"H = {hurst}, {head}" for hurst in (0.8, 0.3) for head in heads)], lines)


def laws(name, corrections, parameters):
    """The parameters of a fitted law, with intervals, for each spectrum."""
    found = table(CAMPAIGN, name)
    of = {(row["k_lower"], row["k_upper"], row["correction"]): row for row in found.to_dicts()}
    lines = []
    for k_lower, k_upper in sorted({key[:2] for key in of}):
        at = [of[k_lower, k_upper, correction] for correction in corrections]
        told = [with_interval(row, parameter) if row["status"] == "fitted" else row["status"]
                for parameter, _ in parameters for row in at]
        lines.append([str(k_lower), str(k_upper), *told])
    heads = [f"{symbol}, {words}" for _, symbol in parameters for words in corrections.values()]
    return rows(["k_l", "k_s", *heads], lines)


def areas():
    """Counted and corrected area near three loads, beside two theories."""
    lines = []
    for load in (0.012, 0.06, 0.3194):
        of = zip(*(curves(load, word).to_dicts() for word in ("none", "2017")), strict=True)
        for counted, corrected in of:
            told = [with_error(row["area_corrected_mean"], row["area_corrected_sem"]) for row in (counted, corrected)]
            lines.append([digits(counted["load"]), str(counted["k_lower"]), str(counted["k_upper"]), *told,
                          digits(counted["area_persson"]), digits(counted["area_bush_gibson_thomas"])])
    return rows(["load", "k_l", "k_s", "area, counted", "area, corrected as in 2017", "Persson",
                 "Bush, Gibson & Thomas"], lines)


def literature():
    found = table("literature", "secants").filter((pl.col("load") - 0.06).abs() < 1e-6)
    of = {(row["k_lower"], row["k_upper"], row["correction"]): row for row in found.to_dicts()}
    lines = []
    for k_lower, k_upper in sorted({key[:2] for key in of}):
        kappa = [with_error(*(of[k_lower, k_upper, word][f"area_corrected_{end}"] / 0.06 / BGT for end in ("mean", "sem")))
                 for word in ("none", "2017")]
        lines.append([str(k_lower), digits(512 / k_upper, 2), *kappa])
    return rows(["k_l", "nodes to the shortest wavelength", "κ/√(2π), counted", "corrected as in 2017"], lines)


def limits(name):
    """Fitted limits of each quantity, under each load, of the forms that the data prefer."""
    fits = table("limits", name).filter((pl.col("status") == "fitted") & (pl.col("akaike_weight") >= 0.1))
    if "correction" in fits.columns:
        fits = fits.filter(pl.col("correction") == "2017")
    if "load" not in fits.columns:
        fits = fits.with_columns(load=pl.lit(None, pl.Float64))
    lines = []
    for row in fits.sort("quantity", "load", "akaike").to_dicts():
        forms = [row[f"form_{term}"] for term in range(1, 4)]
        if row["exponent_2"] is not None and forms[1] != "logarithm":
            forms[1] = f"power {with_interval(row, 'exponent_2', 3)}"
        lines.append([f"`{row['quantity']}`", digits(row["load"], 2), *forms, with_interval(row, "limit"),
                      with_interval(row, "coefficient_2", 3), digits(row["akaike_weight"], 2),
                      digits(row["reduced_chi_square"], 2), digits(row["leave_one_out_error"], 2)])
    return rows(["Q", "load", "in 1/k_l", "in k_l/k_s", "in k_s/N", "Q₀", "coefficient of k_l/k_s", "weight",
                 "χ² per degree of freedom", "error, one point left out"], lines)


def asperities(study):
    """Area of the models over that of the solution, the median over spectra and its range."""
    lines = []
    for (load,), at in sorted(table(study, "beside").group_by("load")):
        told = [digits(load, 2)]
        for interaction in ("none", "mean-field", "explicit"):
            ratio = at.filter(pl.col("interaction") == interaction)["ratio"]
            told.append(f"{digits(ratio.median(), 3)} ({between(ratio)})")
        overlap = at.filter(pl.col("interaction") == "none")["overlapping_share"]
        lines.append([*told, digits(100 * overlap.median(), 2) + " %"])
    return rows(["load", "no interaction", "mean field", "each by all others", "area in contacts that overlap"],
                lines[::3])


def pressures():
    """Pressures beside Persson's: area fraction, and the share of nodes in contact below a fifth of E* h′."""
    found = table("distributions", "mean-pressures").with_columns(
        width=2 * pl.col("contact_pressure").min().over("k_lower", "load"))
    lines = []
    for (k_lower, load), at in sorted(found.group_by("k_lower", "load")):
        told = []
        for density in ("pressure_density_mean", "pressure_density_persson_mean"):
            area = (at[density] * at["width"]).sum()
            low = at.filter(pl.col("contact_pressure") < 0.2)
            told += [digits(area), digits((low[density] * low["width"]).sum() / area, 3)]
        lines.append([str(k_lower), digits(load, 2), *told])
    return rows(["k_l", "load", "area", "share of it below 0.2 E\\* h′", "Persson's area", "Persson's share"], lines)


def sealing():
    parameters = [("percolation_area_corrected", "area, corrected"), ("percolation_area", "area, counted"),
                  ("percolation_load", "load")]
    lines = [[str(row["k_lower"]), str(row["k_upper"]), str(row["surfaces"]),
              *(with_interval(row, name) for name, _ in parameters)]
             for row in table("sealing", "threshold").sort("k_lower").to_dicts()]
    return rows(["k_l", "k_s", "surfaces", *(words for _, words in parameters)], lines)
