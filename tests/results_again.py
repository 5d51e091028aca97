"""Recomputes the numbers of claims from the tables in data/results-of-the-paper, by other means than the program.

    python3 tests/results_again.py

Needs polars. The script computes every quantity of the claims below from means over surfaces, and compares it with the
output of `asperity claims` to nine digits. The program computes these quantities from the single surfaces.
"""

import json
import math
import re

import polars as pl

import results_flow
from results_tables import CAMPAIGN, TABLES, table

CURVES = table(CAMPAIGN, "curves")
SPECTRA = {(row["k_lower"], row["k_upper"]): row for row in table(CAMPAIGN, "spectra").to_dicts()}
CUTOFFS = {"k_lower": (1, 4, 16), "k_upper": (32, 64, 128)}
LOADS = {row["load"] for row in CURVES.select("load").unique().to_dicts()}
ALPHA = {}
AREAS = {(row["k_lower"], row["k_upper"], row["correction"], row["load"]): row for row in CURVES.to_dicts()}


def quantities(study, name):
    claims = json.loads((TABLES / study / "claims.json").read_text(encoding="utf-8"))["claims"]
    return next(claim for claim in claims if claim["name"] == name)["quantities"]


def spectrum(label):
    """Returns the first spectrum in a label such as `k_lower 1, k_upper 32`."""
    return tuple(int(re.search(rf"{name} (\d+)", label)[1]) for name in ("k_lower", "k_upper"))


def load(label):
    written = float(re.search(r"load ([0-9.]+)", label)[1])
    return min(LOADS, key=lambda load: abs(load - written))


def neighbour(label):
    """Returns the spectra after and before that of a label such as `k_lower 1, k_upper 32 → k_lower 4`."""
    axis, greater = re.search(r"→ (k_lower|k_upper) (\d+)", label).groups()
    at = dict(zip(("k_lower", "k_upper"), spectrum(label), strict=True))
    place = CUTOFFS[axis].index(at[axis])
    before = {**at, axis: CUTOFFS[axis][place - 1]}
    return tuple({**at, axis: int(greater)}.values()), tuple(before.values())


def mean(spectrum, at, correction="none"):
    return AREAS[*spectrum, correction, at]["area_corrected_mean"]


def ln_ratio(label, correction="none"):
    greater, _ = neighbour(label)
    return math.log(mean(greater, load(label), correction) / mean(spectrum(label), load(label), correction))


def area(label, correction="none"):
    return mean(spectrum(label), 0.06 if "load" not in label else load(label), correction)


def over_persson(label, correction="none"):
    return math.log(area(label, correction) / math.erf(math.sqrt(2) * load(label)))


def acceleration(label):
    greater, before = neighbour(label)
    here, at = spectrum(label), load(label)
    areas = [math.log(mean(one, at)) for one in (before, here, greater)]
    return (areas[2] - areas[1]) - (areas[1] - areas[0]) / 2


def scatter(label):
    greater, _ = neighbour(label)
    sd = [AREAS[*one, "none", load(label)]["area_corrected_sd"] for one in (spectrum(label), greater)]
    return math.log(sd[0] / sd[1])


def equal_bandwidth(label, correction="none"):
    (lower, of_lower), (upper, of_upper) = [
        (int(one), int(other)) for one, other in re.findall(r"k_lower (\d+), k_upper (\d+)", label)]
    return math.log(mean((upper, of_upper), load(label), correction) / mean((lower, of_lower), load(label), correction))


def least_squares_in_cutoffs(label, correction, variable):
    """Returns the coefficient of ln k_lower in a fit of ln A over the nine spectra, by the normal equations.

    The other coefficients are a constant and that of the logarithm of `variable(k_lower, k_upper)`.
    """
    points = [((1.0, math.log(variable(lower, upper)), math.log(lower)), math.log(mean((lower, upper), load(label), correction)))
              for lower in CUTOFFS["k_lower"] for upper in CUTOFFS["k_upper"]]
    matrix = [[sum(x[i] * x[j] for x, _ in points) for j in range(3)] + [sum(x[i] * y for x, y in points)]
              for i in range(3)]
    for i in range(3):
        for j in set(range(3)) - {i}:
            factor = matrix[j][i] / matrix[i][i]
            matrix[j] = [a - factor * b for a, b in zip(matrix[j], matrix[i], strict=True)]
    return matrix[2][3] / matrix[2][2]


def third_difference(label):
    """Returns the third divided difference of the mean area by Lagrange's form, from the loads nearest to the named ones."""
    loads = [0.0, *(min(LOADS, key=lambda one: abs(one - named)) for named in (0.005, 0.02, 0.06))]
    areas = [0.0, *(mean(spectrum(label), one) for one in loads[1:])]
    return sum(area / math.prod(one - other for other in loads if other != one) for one, area in zip(loads, areas, strict=True))


def halving(_):
    """Returns the mean over spectra of the area at which the estimated relative error is half of its first value."""
    return sum(map(halving_of, SPECTRA)) / len(SPECTRA)


def halving_of(one):
    curve = [(mean(one, at), 1 - mean(one, at, "pi/8") / mean(one, at)) for at in sorted(LOADS)]
    half = curve[0][1] / 2
    after = next(i for i, (_, error) in enumerate(curve) if error <= half)
    (area, error), (next_area, next_error) = curve[after - 1:after + 1]
    return ((half - next_error) * area + (error - half) * next_area) / (error - next_error)


def growth_of_kappa(label):
    """Returns ln of the ratio of the smallest κ, from the table of the `fit` stage."""
    greater, _ = neighbour(label)
    kappa = {(row["k_lower"], row["k_upper"]): row["kappa_convex"]
             for row in table(CAMPAIGN, "least-convex").filter(pl.col("correction") == "none").to_dicts()}
    return math.log(kappa[greater] / kappa[spectrum(label)])


def pressure_growth(label):
    """Returns the exponent of a line through ln(Δp̄/Δp₀) against ln A, from the mean areas at neighbouring loads."""
    at = [one for one in sorted(LOADS) if one <= 0.06 + 1e-9]
    area = [mean(spectrum(label), one) for one in at]
    steps = range(1, len(at))
    growths = [(at[i] / area[i] - at[i - 1] / area[i - 1]) / (at[i] - at[i - 1]) for i in steps]
    x = [math.log((area[i] + area[i - 1]) / 2) for i in steps]
    y = [math.log(growth) for growth in growths]
    middle = sum(x) / len(x)
    return sum((a - middle) * b for a, b in zip(x, y, strict=True)) / sum((a - middle) ** 2 for a in x)


def left_by_line(x, y):
    slope = (sum(a * b for a, b in zip(x, y, strict=True)) - sum(x) * sum(y) / len(x)) / (
        sum(a * a for a in x) - sum(x) ** 2 / len(x))
    offset = sum(y) / len(y) - slope * sum(x) / len(x)
    return math.sqrt(sum((b - offset - slope * a) ** 2 for a, b in zip(x, y, strict=True)) / len(x))


def alpha_of_modes(lower, upper, hurst=0.8):
    """Returns Nayak's parameter by a sum over all modes of the cell."""
    moments = [0.0] * 3
    for x in range(-upper, upper + 1):
        for y in range(-upper, upper + 1):
            square = x * x + y * y
            if lower**2 <= square <= upper**2:
                power = square ** -(1 + hurst)
                for order, of in enumerate((1, square / 2, (x**4 + y**4) / 2)):
                    moments[order] += power * of
    return moments[0] * moments[2] / moments[1] ** 2


def on_alpha_over_bandwidth(label):
    spectra = [(lower, upper) for lower in CUTOFFS["k_lower"] for upper in CUTOFFS["k_upper"]]
    areas = [math.log(mean(one, load(label), "2017")) for one in spectra]
    on_alpha = left_by_line([math.log(ALPHA[one]) for one in spectra], areas)
    return math.log(on_alpha / left_by_line([math.log(upper / lower) for lower, upper in spectra], areas))


def asperities(label, interaction):
    lower, upper = spectrum(label)
    at = float(re.search(r"load ([0-9.]+)", label)[1])
    rows = table("asperities-1024", "beside").filter(
        (pl.col("k_lower") == lower) & (pl.col("k_upper") == upper) & (pl.col("interaction") == interaction)
        & ((pl.col("load") / at - 1).abs() < 0.02))
    return rows.to_dicts()[0]


def less_without_interaction(label):
    row = asperities(label, "none")
    return math.log(row["solved_area"] / row["model_area"])


def added_by_interaction(label):
    return math.log(asperities(label, "explicit")["model_area"] / asperities(label, "none")["model_area"])


def lightest_pressures(label):
    nodes, at = int(re.search(r"(\d+) nodes", label)[1]), float(re.search(r"load ([0-9.]+)", label)[1])
    least = [table("pressure-edges", "mean-pressures").filter(
        (pl.col("nodes") == one) & ((pl.col("load") - at).abs() < 1e-6)).sort("contact_pressure")
        ["pressure_density_mean"][0] for one in (nodes, 2 * nodes)]
    return math.log2(least[0] / least[1])


def secant_growth(label):
    at = spectrum(label)
    return math.log(mean(at, 0.06, "pi/8") / 0.06 / (mean(at, 0.012, "pi/8") / 0.012))


def modes(label):
    greater, _ = neighbour(label)
    return SPECTRA[greater]["effective_modes_mean"] / SPECTRA[spectrum(label)]["effective_modes_mean"]


def middle_pressures(label):
    """Returns the nominal area in bins of pressure from 0.5 to 1, over that of Persson's theory."""
    lower, _ = spectrum(label)
    at = float(re.search(r"load ([0-9.]+)", label)[1])
    bins = table("distributions", "mean-pressures").filter(
        (pl.col("k_lower") == lower) & ((pl.col("load") - at).abs() < 1e-6)
        & pl.col("contact_pressure").is_between(0.5, 1.0))
    return bins["pressure_density_mean"].sum() / bins["pressure_density_persson_mean"].sum()


def flow_over_narrowest(label):
    """Returns ln of the flow factor over that of the narrowest spectrum in the largest cell with the smallest H."""
    lower, upper = spectrum(label)
    hurst, area = (float(re.search(rf"{name} ([0-9.]+)", label)[1]) for name in ("H", "area"))
    factors = results_flow.factors()
    narrowest = min(factors, key=lambda key: (key[1] / key[0], -key[0], key[2]))
    at = results_flow.AREAS.index(area)
    return math.log(factors[lower, upper, hurst][at] / factors[narrowest][at])


CLAIMS = {
    (CAMPAIGN, "area-at-0.06"): area,
    (CAMPAIGN, "area-above-persson"): over_persson,
    (CAMPAIGN, "corrected-area-above-persson"): lambda label: over_persson(label, "2017"),
    (CAMPAIGN, "widest-k-lower-is-close-to-bgt-asymptote"):
        lambda label: area(label) / (math.sqrt(2 * math.pi) * load(label)),
    (CAMPAIGN, "area-grows-with-k-lower"): ln_ratio,
    (CAMPAIGN, "corrected-area-grows-with-k-lower"): lambda label: ln_ratio(label, "2017"),
    (CAMPAIGN, "area-falls-with-alpha"): lambda label: -ln_ratio(label),
    (CAMPAIGN, "corrected-area-falls-with-alpha"): lambda label: -ln_ratio(label, "2017"),
    (CAMPAIGN, "no-convergence-in-k-lower"): acceleration,
    (CAMPAIGN, "scatter-falls-with-cutoffs"): scatter,
    (CAMPAIGN, "alpha-alone-does-not-decide"): equal_bandwidth,
    (CAMPAIGN, "alpha-alone-decides-corrected"): lambda label: equal_bandwidth(label, "2017"),
    (CAMPAIGN, "corrected-area-depends-on-bandwidth-alone"):
        lambda label: least_squares_in_cutoffs(label, "2017", lambda lower, upper: upper / lower),
    (CAMPAIGN, "no-trend-within-corrected-groups"):
        lambda label: least_squares_in_cutoffs(label, "pi/8", lambda _, upper: upper),
    (CAMPAIGN, "slope-is-convex"): third_difference,
    (CAMPAIGN, "least-convex-kappa-depends-on-k-lower"): growth_of_kappa,
    (CAMPAIGN, "estimated-error-halves-at-30-percent"): halving,
    (CAMPAIGN, "exponent-of-pressure-growth"): pressure_growth,
    (CAMPAIGN, "corrected-area-collapses-on-bandwidth-rather-than-alpha"): on_alpha_over_bandwidth,
    ("asperities-1024", "non-interacting-asperities-have-less-area"): less_without_interaction,
    ("asperities-1024", "interaction-adds-area-to-asperities"): added_by_interaction,
    ("pressure-edges", "pressure-density-is-linear-at-zero"): lightest_pressures,
    (CAMPAIGN, "corrected-secant-grows"): secant_growth,
    (CAMPAIGN, "full-contact-at-1.7"): lambda label: SPECTRA[spectrum(label)]["full_contact_load_mean"],
    (CAMPAIGN, "modes-come-from-k-lower"): modes,
    ("distributions", "middle-pressures-are-as-in-persson"): middle_pressures,
    ("flow-law", "flow-depends-on-mean-gap-and-area-alone"): flow_over_narrowest,
}


def main():
    ALPHA.update({one: alpha_of_modes(*one) for one in SPECTRA})
    for (study, name), again in CLAIMS.items():
        said = quantities(study, name)
        worst = max(abs(again(one["label"]) / one["value"] - 1) for one in said)
        assert worst < 1e-9, f"{name}: {worst}"
        print(f"{name}: {len(said)} numbers, alike to {worst:.0e}")


if __name__ == "__main__":
    main()
