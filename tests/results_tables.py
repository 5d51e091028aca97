"""The tables and generated sentences of the results, from the tables in data/results-of-the-paper/."""

import json
import math
from pathlib import Path

import polars as pl

ROOT = Path(__file__).resolve().parent.parent
TABLES = ROOT / "data/results-of-the-paper"
CAMPAIGN = "yastrebov-2015"
BGT = math.sqrt(2 * math.pi)


def table(study, name):
    return pl.read_parquet(TABLES / study / f"{name}.parquet")


def digits(value, count=4):
    """Returns a number with `count` significant digits, with an exponent only if it is very small or large."""
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
    """Returns a value, rounded to the second digit of its standard error, and the error."""
    places = max(1 - math.floor(math.log10(error)), 0)
    return f"{value:.{places}f} ± {error:.{places}f}"


def between(values, count=3):
    return f"{digits(min(values), count)} … {digits(max(values), count)}"


def ranging(values, count=3):
    """Returns a range in words, for sentences."""
    return f"{digits(min(values), count)} to {digits(max(values), count)}"


def rows(heads, lines):
    text = "| " + " | ".join(heads) + " |\n|" + "---|" * len(heads) + "\n"
    return text + "".join("| " + " | ".join(line) + " |\n" for line in lines)


def provenance(studies):
    lines = []
    for study in studies:
        about = json.loads((TABLES / study / "about.json").read_text(encoding="utf-8"))
        told = ", ".join(f"{stage} {tasks}" for stage, tasks in about["tasks"].items())
        lines.append([f"`manifests/{study}.toml`", told])
    return rows(["manifest", "stages and their numbers of tasks"], lines)


def curves(load, correction):
    near = table(CAMPAIGN, "curves").filter((pl.col("load") - load).abs() < 1e-3 * load)
    return near.filter(pl.col("correction") == correction).sort("k_lower", "k_upper")


def area_at(load):
    return ranging(curves(load, "none")["area_corrected_mean"])


def persson_at(load):
    return digits(curves(load, "none")["area_persson"][0], 3)


def surfaces_per_spectrum(study=CAMPAIGN):
    """Returns the number of surfaces of each spectrum of a study."""
    (count,) = set(table(study, "spectra")["count"])
    return count


def full_contact_range():
    return ranging(table(CAMPAIGN, "spectra")["full_contact_load_mean"])


def sealing_limit():
    """Returns the fit with the smallest `akaike` of the area at which the gap stops percolating."""
    fits = table("limits", "percolation-limits").filter(pl.col("quantity") == "percolation_area_corrected")
    return fits.sort("akaike").to_dicts()[0]


def sealing_words():
    return (f"In the limits of large cells, wide spectra and fine meshes, the gap stops percolating at a contact area of "
            f"{with_interval(sealing_limit(), 'limit', 3)}. Wang & Müser (2020) find an area near 0.415.")


def narrow_sealing_words():
    fit = sealing_limit()
    octave = fit["limit"] + fit["coefficient_2"] * 0.5 ** fit["exponent_2"]
    return f"Spectra of one octave, k_s = 2 k_l, seal at smaller areas than wide spectra: at {digits(octave, 2)}."


def asperities_of_alpha(load):
    """Returns, by ascending α of the modes, the ratios of model area to solved area on the mesh of the paper."""
    near = table("asperities-1024", "beside").filter((pl.col("load") / load - 1).abs() < 0.01)
    alpha = table("asperities-1024", "spectra").select("k_lower", "k_upper", alpha="nayak_lattice_mean")
    of = {}
    for row in near.join(alpha, on=["k_lower", "k_upper"]).to_dicts():
        of.setdefault((row["alpha"], row["k_lower"], row["k_upper"]), {})[row["interaction"]] = row
    return sorted(of.items())


def asperity_words():
    """Returns sentences on the ratio of model area to solved area, for the smallest and the largest α."""
    (least, narrow), *_, (most, wide) = asperities_of_alpha(0.0057)
    told = [f"{digits(narrow[word]['ratio'], 2)} at α = {digits(least[0], 2)} and {digits(wide[word]['ratio'], 2)} at "
            f"α = {digits(most[0], 3)}" for word in ("none", "explicit")]
    return ("Asperity models have less area than the boundary-element solution for the same surfaces. At each k_l the "
            f"ratio of the two areas falls as α grows. At a load of 0.0057 it is {told[0]} without interaction. It is "
            f"{told[1]} if all asperities displace each other. Where two ellipses overlap, the "
            "common area is counted twice, so the models cover still less.")


def asperities_over_alpha():
    lines = [[digits(alpha, 3), str(k_lower), str(k_upper), *(digits(at[word]["ratio"], 3) for word in ("none", "explicit")),
              digits(100 * at["none"]["overlapping_share"], 2) + " %"]
             for (alpha, k_lower, k_upper), at in asperities_of_alpha(0.0057)]
    return rows(["α", "k_l", "k_s", "no interaction", "explicit interaction", "area in overlapping contacts"], lines)


def overlap_range():
    """Returns the range over spectra of the share of the model's area in overlapping contacts, at a load of 0.0057."""
    shares = [100 * at["none"]["overlapping_share"] for _, at in asperities_of_alpha(0.0057)]
    return f"{ranging(shares, 2)} %"


def nayak_scatter(k_lower):
    """Returns the range of the relative standard deviations of α for the spectra with this lower cutoff."""
    found = table(CAMPAIGN, "spectra").filter(pl.col("k_lower") == k_lower)
    return f"{ranging(100 * found['nayak_sd'] / found['nayak_mean'], 2)} %"


def least_squares(design, values, weights):
    """Solves weighted least squares by the normal equations."""
    right = [sum(w * x[i] * y for x, y, w in zip(design, values, weights, strict=True)) for i in range(len(design[0]))]
    return solved(design, weights, right)


def error_of(combination, design, weights):
    """Returns the standard error of a linear combination of the coefficients, if weights are inverse variances."""
    return math.sqrt(sum(a * b for a, b in zip(combination, solved(design, weights, combination), strict=True)))


def solved(design, weights, right):
    """Solves the normal equations of a design for a right-hand side."""
    count = len(design[0])
    matrix = [[sum(w * x[i] * x[j] for x, w in zip(design, weights, strict=True)) for j in range(count)] + [right[i]]
              for i in range(count)]
    for i in range(count):
        for j in set(range(count)) - {i}:
            factor = matrix[j][i] / matrix[i][i]
            matrix[j] = [a - factor * b for a, b in zip(matrix[j], matrix[i], strict=True)]
    return [matrix[i][count] / matrix[i][i] for i in range(count)]


def spectra():
    """Returns Nayak's parameter, summit density, effective modes and full-contact load of the campaign's spectra."""
    lines = []
    for row in table(CAMPAIGN, "spectra").sort("k_lower", "k_upper").to_dicts():
        error = row["nayak_sd"] / math.sqrt(row["count"])
        lines.append([str(row["k_lower"]), str(row["k_upper"]), str(row["count"]),
                      with_error(row["nayak_mean"], error), digits(row["summit_density_integer_mean"]),
                      digits(row["effective_modes_mean"], 3),
                      f"{digits(row['full_contact_load_mean'], 3)} ({digits(row['full_contact_load_min'], 3)} … "
                      f"{digits(row['full_contact_load_max'], 3)})"])
    return rows(["k_l", "k_s", "surfaces", "α", "D", "effective modes", "full-contact load (range)"], lines)


def tabulated(name, error, closed, printed):
    """Returns a table of the paper, printed and found, for both Hurst exponents."""
    paper = pl.read_csv(ROOT / "manifests/claims" / f"{printed}.csv")
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
    """Returns the parameters of a fitted law, with intervals, for each spectrum."""
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
    """Returns counted and corrected areas near three loads, with two theories."""
    lines = []
    for load in (0.012, 0.06, 0.3194):
        of = zip(*(curves(load, word).to_dicts() for word in ("none", "2017")), strict=True)
        for counted, corrected in of:
            told = [with_error(row["area_corrected_mean"], row["area_corrected_sem"]) for row in (counted, corrected)]
            lines.append([digits(counted["load"]), str(counted["k_lower"]), str(counted["k_upper"]), *told,
                          digits(counted["area_persson"]), digits(counted["area_bush_gibson_thomas"])])
    return rows(["load", "k_l", "k_s", "counted area", "area corrected as in 2017", "Persson",
                 "Bush, Gibson & Thomas, α of the modes"], lines)


def literature():
    found = table("literature", "secants").filter((pl.col("load") - 0.06).abs() < 1e-6)
    of = {(row["k_lower"], row["k_upper"], row["correction"]): row for row in found.to_dicts()}
    lines = []
    for k_lower, k_upper in sorted({key[:2] for key in of}):
        kappa = [with_error(*(of[k_lower, k_upper, word][f"area_corrected_{end}"] / 0.06 / BGT for end in ("mean", "sem")))
                 for word in ("none", "2017")]
        lines.append([str(k_lower), digits(512 / k_upper, 2), *kappa])
    return rows(["k_l", "nodes to the shortest wavelength", "secant/√(2π), counted", "corrected as in 2017"], lines)


def limits(name):
    """Returns the fitted limits of each quantity under each load, for forms with a weight of 0.1 or more."""
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
                 "χ² per degree of freedom", "leave-one-out error"], lines)


def asperities(study):
    """Returns the area of the models over the area of the solution: median and range over spectra."""
    lines = []
    for (load,), at in sorted(table(study, "beside").group_by("load")):
        told = [digits(load, 2)]
        for interaction in ("none", "mean-field", "explicit"):
            ratio = at.filter(pl.col("interaction") == interaction)["ratio"]
            told.append(f"{digits(ratio.median(), 3)} ({between(ratio)})")
        overlap = at.filter(pl.col("interaction") == "none")["overlapping_share"]
        lines.append([*told, digits(100 * overlap.median(), 2) + " %"])
    return rows(["load", "no interaction", "mean field", "explicit interaction", "area in overlapping contacts"],
                lines[::3])


def pressures():
    """Returns the area, and its fraction with pressures below 0.2 E* h′, found and in Persson's theory."""
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
    return rows(["k_l", "load", "area", "fraction of it below 0.2 E\\* h′", "Persson's area", "Persson's fraction"], lines)


def sealing():
    parameters = [("percolation_area_corrected", "corrected area"), ("percolation_area", "counted area"),
                  ("percolation_load", "load")]
    lines = [[str(row["k_lower"]), str(row["k_upper"]), str(row["surfaces"]),
              *(with_interval(row, name) for name, _ in parameters)]
             for row in table("sealing", "threshold").sort("k_lower").to_dicts()]
    return rows(["k_l", "k_s", "surfaces", *(words for _, words in parameters)], lines)


def sealing_note():
    """Returns sentences on the errors of threshold and flow with eight nodes to the shortest wavelength."""
    shift = sealing_limit()["coefficient_3"] / 8
    flows = table("flow-mesh", "over-finest").filter(pl.col("nodes") == pl.col("nodes").min())
    low = [100 * (1 - ratio) for ratio in flows["flow_ratio"]]
    direction = "lower" if shift < 0 else "raise"
    return ("These meshes have eight nodes to the shortest wavelength. According to the [fit of the limits](limits.md), such a "
            f"mesh {direction}s the corrected area at the threshold by {digits(abs(shift), 1)}. This is nearly as much as the "
            f"claim below allows. The flow with eight nodes is {digits(min(low), 1)} to {digits(max(low), 1)} % smaller than "
            "with 64 (`flow-mesh.toml`):")


def flow_mesh():
    found = table("flow-mesh", "over-finest")
    of = {(row["nodes"], row["load"]): row for row in found.to_dicts()}
    loads = sorted({load for _, load in of})
    lines = []
    for nodes in sorted({nodes for nodes, _ in of}):
        at = [of[nodes, load] for load in loads]
        errors = [row["flow_ratio_sd"] / math.sqrt(row["surfaces"]) for row in at]
        told = [with_error(row["flow_ratio"], error) if error > 0 else digits(row["flow_ratio"], 3)
                for row, error in zip(at, errors, strict=True)]
        lines.append([str(nodes // 8), *told])
    return rows(["nodes to the shortest wavelength", *(f"flow over flow with 64 nodes, load {digits(load, 1)}" for load in loads)],
                lines)


def edge_exponent(bins):
    """Returns the exponent of a power law of the pressure density from 0.1 to 0.2, for bins of one mesh and load."""
    half, whole = (bins.filter(pl.col("contact_pressure") < end)["pressure_density_mean"].sum() for end in (0.1, 0.2))
    return math.log2(whole / half) - 1


def edges():
    """Returns, for each mesh, the exponent of the pressure density from 0.1 to 0.2 and the density below 0.025."""
    found = table("pressure-edges", "mean-pressures").with_columns(
        width=2 * pl.col("contact_pressure").min().over("nodes", "load"))
    lines = {}
    for (nodes, load), at in sorted(found.group_by("nodes", "load")):
        least = at.sort("contact_pressure")["pressure_density_mean"][0]
        line = lines.setdefault(nodes, [str(nodes // 8)])
        line += [digits(edge_exponent(at), 2), digits(least, 3)]
    loads = sorted(found["load"].unique())
    heads = [head for load in loads for head in (f"exponent, load {digits(load, 1)}", "density below 0.025")]
    return rows(["nodes to the shortest wavelength", *heads], list(lines.values()))


def collapse_words():
    """Returns the residuals of a line in ln ζ and of a line in ln α for the corrected areas of the campaign."""
    alpha = {(row["k_lower"], row["k_upper"]): row["nayak_lattice"] for row in
             table("nayak", "table").filter(pl.col("hurst") == 0.8).to_dicts()}
    told = []
    for load in (0.012, 0.06):
        found = curves(load, "2017").to_dicts()
        area = [math.log(row["area_corrected_mean"]) for row in found]
        measures = ([math.log(row["k_upper"] / row["k_lower"]) for row in found],
                    [math.log(alpha[row["k_lower"], row["k_upper"]]) for row in found])
        left = []
        for x in measures:
            offset, slope = least_squares([[1, one] for one in x], area, [1] * len(x))
            rest = [(y - offset - slope * one) ** 2 for one, y in zip(x, area, strict=True)]
            left.append(digits(math.sqrt(sum(rest) / len(rest)), 2))
        told.append(f"{left[0]} and {left[1]} at a load of {load}")
    return (f"As functions of ln(k_s/k_l) and of ln α, straight lines fit ln A with root mean square residuals of "
            f"{', and of '.join(told)}. Here α is that of the modes of the cell.")


def hurst():
    """Returns the corrected secants and α of every Hurst exponent."""
    alpha = {row["hurst"]: row["nayak_lattice_mean"] for row in table("hurst", "spectra").to_dicts()}
    found = table("hurst", "curves").filter(pl.col("correction") == "2017")
    loads = [min(found["load"].unique(), key=lambda load, near=near: abs(load / near - 1)) for near in (0.01, 0.06, 0.2)]
    lines = []
    for exponent in sorted(alpha):
        own = {row["load"]: row for row in found.filter(pl.col("hurst") == exponent).to_dicts()}
        kappa = [with_error(*(own[load][f"area_corrected_{end}"] / load / BGT for end in ("mean", "sem"))) for load in loads]
        lines.append([digits(exponent, 1), digits(alpha[exponent], 3), *kappa])
    return rows(["H", "α", *(f"secant/√(2π), load {digits(load, 2)}" for load in loads)], lines)
