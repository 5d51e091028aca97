"""Numbers of the article docs/results.md that no claim computes, from the tables in data/results-of-the-paper/."""

import math
import statistics

import polars as pl

from results_claims import of, values
from results_flow import OF_2017
from results_tables import CAMPAIGN, digits, edge_exponent, least_squares, ranging, table


def near(study, name, load):
    """Returns the rows of a table at the load nearest to `load`."""
    found = table(study, name)
    nearest = min(found["load"].unique(), key=lambda one: abs(one - load))
    return found.filter(pl.col("load") == nearest)


def campaign_areas(load, correction):
    at = near(CAMPAIGN, "curves", load).filter(pl.col("correction") == correction)
    return at["load"][0], at["area_corrected_mean"].to_list()


def error_function_scales(load):
    """Returns the range over spectra of β in A = erf(β √2 y), from the counted areas at a load."""
    y, areas = campaign_areas(load, "none")
    inverse = [statistics.NormalDist().inv_cdf((1 + area) / 2) / math.sqrt(2) for area in areas]
    return ranging([x / (math.sqrt(2) * y) for x in inverse])


def crack_factors(load, correction="2017"):
    """Returns the range over spectra of the open area over the area that would be in tension at full contact."""
    y, areas = campaign_areas(load, correction)
    return ranging([2 * (1 - area) / math.erfc(math.sqrt(2) * y) for area in areas])


def open_at(load):
    """Returns the range over spectra of the counted open area, in per cent."""
    _, areas = campaign_areas(load, "none")
    return ranging([100 * (1 - area) for area in areas], 1)


def hurst_effect(least, most):
    """Returns the range, over loads, of the relative difference of the areas for the largest and the smallest H."""
    found = table("hurst", "curves").filter((pl.col("correction") == "2017") & pl.col("load").is_between(least, most))
    told = []
    for _, at in found.group_by("load"):
        areas = at["area_corrected_mean"]
        told.append(100 * (areas.max() / areas.min() - 1))
    return ranging(told, 1)


def pressure_ratios(low, high, load=0.01):
    """Returns the range over spectra of the area under pressures from `low` to `high`, over Persson's."""
    found = near("distributions", "mean-pressures", load).filter(pl.col("contact_pressure").is_between(low, high))
    sums = found.group_by("k_lower").agg(pl.col("pressure_density_mean", "pressure_density_persson_mean").sum())
    return ranging(sums["pressure_density_mean"] / sums["pressure_density_persson_mean"], 2)


def low_pressures_on_meshes(load=0.02, below=0.2):
    """Returns the area under low pressures over Persson's, on the coarsest and on the finest mesh."""
    found = near("pressure-edges", "mean-pressures", load).filter(pl.col("contact_pressure") < below)
    sums = found.group_by("nodes").agg(pl.col("pressure_density_mean", "pressure_density_persson_mean").sum()).sort("nodes")
    ratios = (sums["pressure_density_mean"] / sums["pressure_density_persson_mean"]).to_list()
    return digits(ratios[0], 2), digits(ratios[-1], 2)


def edge_exponents():
    """Returns the range over loads of the exponent of the density of pressures from 0.1 to 0.2 on the finest mesh."""
    found = table("pressure-edges", "mean-pressures")
    finest = found.filter(pl.col("nodes") == found["nodes"].max())
    return ranging([edge_exponent(at) for _, at in finest.group_by("load")], 2)


def plateau_effect(load=0.05):
    """Returns by how many per cent the area grows from no plateau to the longest one, its end, and the load."""
    at = near("plateau", "curves", load).filter(pl.col("correction") == "2017").sort("k_rolloff")
    assert at["k_rolloff"].min() == at["k_lower"].unique().item() == 4 and at["k_upper"].unique().item() == 64
    areas = at["area_corrected_mean"].to_list()
    return digits(100 * (areas[-1] / areas[0] - 1), 1), at["k_rolloff"].max(), digits(at["load"][0], 1)


def hurst_at_32(least, most):
    """Returns the range over loads of the relative difference of the areas for H = 0.3 and 0.8, both with k_s = 32 k_l."""
    found = table("same-nayak", "curves").filter((pl.col("correction") == "2017") & pl.col("load").is_between(least, most))
    rough, smooth = (found.filter((pl.col("hurst") == hurst) & (pl.col("k_lower") == lower) & (pl.col("k_upper") == 32 * lower))
                     .sort("load")["area_corrected_mean"] for hurst, lower in ((0.3, 4), (0.8, 2)))
    return ranging([100 * (one / other - 1) for one, other in zip(rough, smooth, strict=True)], 2)


def kurtosis():
    """Returns mean and standard deviation of the excess kurtosis of single surfaces with k_lower = 1."""
    of = table("heights", "kurtosis").filter(pl.col("k_lower") == 1).sort("k_upper").to_dicts()[0]
    return f"{digits(of['kurtosis_mean'], 2)} ± {digits(of['kurtosis_sd'], 2)}".replace("-", "−")


def labelled(name):
    """Returns the values of the quantities of a claim of the campaign, by their labels."""
    return {one["label"]: one["value"] for one in of(CAMPAIGN)[name]["quantities"]}


def per_cent(logarithms, count=1):
    """Returns the range of the relative changes, in per cent, of which these are the logarithms."""
    return ranging([100 * math.expm1(one) for one in logarithms], count)


def fall(name):
    """Returns by how many per cent the area falls for a factor of two in k_upper, for k_lower = 16 at a load of 0.012."""
    falls = [value for label, value in labelled(name).items() if label.startswith("k_lower 16") and label.endswith("load 0.012")]
    return ranging([-100 * math.expm1(-one) for one in falls], 1)


def differences(name, k_lower=None):
    """Returns the smallest and the largest relative difference of the areas of equal bandwidth, in per cent.

    With `k_lower`, only the pair whose smaller lower cutoff this is.
    """
    return per_cent([abs(one) for label, one in labelled(name).items()
                     if k_lower is None or label.startswith(f"k_lower {k_lower},")], 2)


def effect_of_alpha_in_models():
    """Returns the range over loads of the relative difference of the areas for α = 2 and 10 in the model, in per cent."""
    return ranging([100 * one for one in values("alpha-in-asperity-models")], 2)


def lack_of_area():
    """Returns the range of the area, in per cent, that asperity models without interaction lack."""
    return ranging([-100 * math.expm1(-one) for one in values("non-interacting-asperities-have-less-area", "asperities-1024")], 2)


def exponents_of_pressure_growth():
    """Returns the range over spectra of the exponent of dp̄/dp₀ as a power of the area."""
    exponents = values("exponent-of-pressure-growth")
    return f"−{digits(-min(exponents), 3)} to −{digits(-max(exponents), 3)}"


def mesh_share(*loads):
    """Returns the range, over loads and k_upper, of the share in per cent of the growth with k_lower that the mesh causes."""
    shares = []
    for load in loads:
        grown = []
        for correction in ("none", "2017"):
            at = near(CAMPAIGN, "curves", load).filter(pl.col("correction") == correction)
            area = {(row["k_lower"], row["k_upper"]): row["area_corrected_mean"] for row in at.to_dicts()}
            grown.append([math.log(area[16, upper] / area[1, upper]) for upper in (32, 64, 128)])
        shares += [100 * (1 - corrected / counted) for counted, corrected in zip(*grown, strict=True)]
    return ranging(shares, 2)


def power_of_the_limit(load=0.05):
    """Returns the exponent of the power of k_l/k_s in the best fit of the secant."""
    fits = table("limits", "kappa-limits").filter(
        (pl.col("status") == "fitted") & (pl.col("correction") == "2017") & ((pl.col("load") / load - 1).abs() < 1e-6))
    best = fits.sort("akaike").to_dicts()[0]
    assert best["form_2"] != "logarithm" and best["exponent_2"] > 0
    return digits(best["exponent_2"], 2)


def loads_without_groups():
    """Returns the range of the loads near full contact at which the curves certainly form no groups by k_upper."""
    quantities = of(CAMPAIGN)["groups-by-k-upper-near-full-contact"]["quantities"]
    against = [float(one["label"].split()[-1]) for one in quantities if one["upper"] < 0]
    heavier = [float(one["label"].split()[-1]) for one in quantities if one["upper"] >= 0]
    assert max(against) < min(heavier)
    return f"from {digits(min(against), 2)} to {digits(max(against), 3)}"


def growth(name):
    """Returns the range of the growth, in per cent, whose logarithms are the quantities of a claim of the campaign."""
    return per_cent(values(name), 2)


def fall_of_kappa():
    """Returns the range over spectra of the fall of the smallest κ, in per cent, if areas are corrected by π/8."""
    counted, corrected = ({(row["k_lower"], row["k_upper"]): row["kappa_convex"] for row in
                           table(CAMPAIGN, "least-convex").filter(pl.col("correction") == correction).to_dicts()}
                          for correction in ("none", "pi/8"))
    assert [one for one in counted if corrected[one] is None] == [(16, 128)]
    return ranging([100 * (1 - corrected[one] / counted[one]) for one in counted if corrected[one] is not None], 2)


def halving():
    """Returns the area in per cent at which the estimated relative error is half of its first value."""
    return digits(100 * values("estimated-error-halves-at-30-percent")[0], 2)


def trend():
    """Returns by how many per cent the area corrected by π/8 falls at a load of 0.012, if k_lower grows by the factor e."""
    return digits(-100 * math.expm1(labelled("no-trend-within-corrected-groups")["load 0.012"]), 2)


def residuals():
    """Returns the range over spectra of the rms residuals of the law, in per cent."""
    return ranging([100 * one for one in values("law-fits-below-a-fifth")], 1)


def change_at_given_bandwidth(least, most, own=False):
    """Returns the largest change of the area, in per cent, from k_lower = 1 to 16, over loads from `least` to `most`.

    Areas are corrected as in 2017 or, with `own`, with the mean coefficient of the mesh study.
    """
    slopes = [own_slope(label) if own else value
              for label, value in labelled("corrected-area-depends-on-bandwidth-alone").items()
              if least <= float(label.split()[-1]) <= most]
    return digits(max(100 * abs(math.expm1(math.log(16) * slope)) for slope in slopes), 2)


def measured_over_2017():
    """Returns the mean, over the spectra of the mesh study, of the coefficient of the correction over that of 2017."""
    return statistics.fmean(values("correction-of-2017-is-right", "mesh-convergence"))


def own_coefficient():
    """Returns the mean, over the spectra of the mesh study, of the coefficient of the correction."""
    return digits(measured_over_2017() * OF_2017, 3)


def own_slope(label):
    """Returns t of ln A = c + s ln ζ + t ln k_lower, for areas corrected with the coefficient of the mesh study."""
    areas = {correction: near(CAMPAIGN, "curves", float(label.split()[-1])).filter(pl.col("correction") == correction)
             .sort("k_lower", "k_upper") for correction in ("none", "2017")}
    design = [[1, math.log(upper / lower), math.log(lower)] for lower, upper in areas["none"].select("k_lower", "k_upper").rows()]
    both = zip(*(at["area_corrected_mean"] for at in areas.values()), strict=True)
    corrected = [math.log(counted - measured_over_2017() * (counted - of_2017)) for counted, of_2017 in both]
    return least_squares(design, corrected, [1] * len(corrected))[2]


def open_area_words(load):
    """Returns how the open area, corrected as in 2017, changes with the cutoffs at a load: least squares over the spectra."""
    at = near(CAMPAIGN, "curves", load).filter(pl.col("correction") == "2017")
    rows = at.select("k_lower", "k_upper", "area_corrected_mean").rows()
    design = [[1, math.log(lower), math.log(upper)] for lower, upper, _ in rows]
    _, by_lower, by_upper = least_squares(design, [math.log(1 - area) for *_, area in rows], [1] * len(rows))
    assert by_lower < 0 < by_upper
    return (f"at a load of {digits(at['load'][0], 3)}, the open area grows by {digits(100 * by_upper, 2)} % for each factor e in k_s "
            f"and falls by {digits(-100 * by_lower, 2)} % for each factor e in k_l")
