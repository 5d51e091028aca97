"""Numbers of the article docs/findings.md that no claim computes, from the tables in data/findings/."""

import math
import statistics

import polars as pl

from findings_claims import of, values
from findings_tables import CAMPAIGN, digits, edge_exponent, least_squares, ranging, table


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


def crack_factors(load):
    """Returns the range over spectra of the open area over half the area in tension, corrected as in 2017."""
    y, areas = campaign_areas(load, "2017")
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


def plateau_effect(load=0.06):
    """Returns by how many per cent the area grows from the shortest to the longest plateau."""
    at = near("plateau", "curves", load).filter(pl.col("correction") == "2017").sort("k_rolloff")
    areas = at["area_corrected_mean"].to_list()
    return digits(100 * (areas[-1] / areas[0] - 1), 1), at["k_rolloff"].min(), at["k_rolloff"].max()


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


def differences(name):
    """Returns the smallest and the largest relative difference of the areas of equal bandwidth, in per cent."""
    return per_cent([abs(one) for one in values(name)])


def growth(name):
    """Returns the range of the growth, in per cent, whose logarithms are the quantities of a claim of the campaign."""
    return per_cent(values(name), 2)


def halving():
    """Returns the area in per cent at which the estimated relative error is half of its first value."""
    return digits(100 * values("estimated-error-halves-at-30-percent")[0], 2)


def trend():
    """Returns by how many per cent the area corrected by π/8 falls at a load of 0.012, if k_lower grows by the factor e."""
    return digits(-100 * math.expm1(labelled("no-trend-within-corrected-groups")["load 0.012"]), 2)


def residuals():
    """Returns the range over spectra of the rms residuals of the law, in per cent."""
    return ranging([100 * one for one in values("law-fits-below-a-fifth")], 1)


def change_at_given_bandwidth(least, most):
    """Returns the largest change of the area, in per cent, from k_lower = 1 to 16, over loads from `least` to `most`."""
    slopes = [value for label, value in labelled("corrected-area-depends-on-bandwidth-alone").items()
              if least <= float(label.split()[-1]) <= most]
    return digits(max(100 * abs(math.expm1(math.log(16) * slope)) for slope in slopes), 1)


def open_area_words(load):
    """Returns how the open area, corrected as in 2017, changes with the cutoffs: least squares over the nine spectra."""
    at = near(CAMPAIGN, "curves", load).filter(pl.col("correction") == "2017")
    rows = at.select("k_lower", "k_upper", "area_corrected_mean").rows()
    design = [[1, math.log(lower), math.log(upper)] for lower, upper, _ in rows]
    _, by_lower, by_upper = least_squares(design, [math.log(1 - area) for *_, area in rows], [1] * len(rows))
    assert by_lower < 0 < by_upper
    return (f"grows by {digits(100 * by_upper, 2)} % for each factor e in k_s, and falls by {digits(-100 * by_lower, 2)} % for each "
            f"factor e in k_l, at a load of {digits(at['load'][0], 2)}")
