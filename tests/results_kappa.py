"""The dependence of the secant on the selection of points, from the means in data/results-of-the-paper/."""

import math

import polars as pl

from results_tables import BGT, between, digits, error_of, least_squares, rows, table, with_error


def words():
    """Returns sentences on the secant at the narrowest and the widest bandwidth, over all selections and forms."""
    narrow, wide, light = ([kappa[at] for one in of_selections(load) for kappa in one["kappa"]]
                           for at, load in ((0, 0.05), (1, 0.05), (1, 0.01)))
    disagree = (f"At a load of 0.01 the selections disagree ({span(light)} at 128), partly because the effect of the finite cell "
                "depends on the bandwidth, which the fits leave out. No value is claimed there. "
                if max(light) - min(light) > 0.01 else "")
    widest = [row for row in points_under(0.05) if row["k_upper"] == 128 * row["k_lower"]]
    assert {row["k_lower"] for row in widest} == {1, 2}
    error = max(one["error"] for one in of_selections(0.05))
    return ("In the limits of large cells and fine meshes, the secant (area over load) falls with the logarithm of the "
            f"bandwidth k_s/k_l. At a load of 0.05, in units of √(2π), it falls from {span(narrow)} at a bandwidth of 2 to "
            f"{span(wide)} at 128; the ranges cover all selections of points and forms. Only {len(widest)} points have a "
            "bandwidth of 128, all with k_l = 1 or 2, so selections with k_l ≥ 4 extrapolate from 64 or 32. The standard error of "
            f"each value at 128 is at most {digits(error, 1)}. {disagree}Persson's "
            "theory has 0.637 at light loads.")


def span(values):
    return between(values).replace(" … ", "–")


def about(load):
    """Returns the secants over √(2π) at the narrowest and the widest bandwidth, in the middle of their ranges."""
    of = [[kappa[at] for one in of_selections(load) for kappa in one["kappa"]] for at in (0, 1)]
    return tuple(digits((min(values) + max(values)) / 2, 2) for values in of)


SELECTIONS = {
    "all points": lambda row: True,
    "k_l ≥ 2": lambda row: row["k_lower"] >= 2,
    "k_l ≥ 4": lambda row: row["k_lower"] >= 4,
    "k_s/k_l ≤ 32": lambda row: row["k_upper"] <= 32 * row["k_lower"],
    "k_s/k_l ≥ 4": lambda row: row["k_upper"] >= 4 * row["k_lower"],
    "8 nodes or more": lambda row: row["nodes"] >= 8 * row["k_upper"],
    "k_l ≥ 4, 8 nodes or more": lambda row: row["k_lower"] >= 4 and row["nodes"] >= 8 * row["k_upper"],
}


def points_under(load):
    points = table("limits", "kappa-points").filter((pl.col("load") / load - 1).abs() < 1e-6)
    return points.filter(pl.col("correction") == "2017").to_dicts()


def of_selections(load):
    """Returns, for every selection and either power of 1/k_l, the secant over √(2π) at k_s/k_l = 2 and 128 and the
    coefficient of the logarithm, and the larger standard error of the secant at 128.

    Fits the means of the points by least squares. The error of a mean is the root mean square over all points with the
    same k_l: the surfaces of one point give an uncertain error, and points that agree by chance would have too much weight.
    """
    points = points_under(load)
    errors = {}
    for row in points:
        errors.setdefault(row["k_lower"], []).append(row["area_corrected_sem"] ** 2)
    weights = {k_lower: len(of) / sum(of) for k_lower, of in errors.items()}
    told = []
    for name, belongs in SELECTIONS.items():
        chosen = [row for row in points if belongs(row)]
        fits, errors_at_128 = [], []
        for power in (1, 2):
            design = [[1, row["k_lower"] ** -power, math.log(row["k_lower"] / row["k_upper"]), row["k_upper"] / row["nodes"]]
                      for row in chosen]
            values = [row["area_corrected_mean"] / load / BGT for row in chosen]
            own = [weights[row["k_lower"]] for row in chosen]
            limit, _, logarithm, _ = least_squares(design, values, own)
            errors_at_128.append(error_of([1, 0, -math.log(128), 0], design, own) / load / BGT)
            fits.append((limit - logarithm * math.log(2), limit - logarithm * math.log(128), logarithm * BGT))
        told.append({"name": name, "points": len(chosen), "kappa": fits, "error": max(errors_at_128)})
    return told


def selections():
    lines = []
    for load in (0.01, 0.05):
        for one in of_selections(load):
            narrow, wide, logarithm = zip(*one["kappa"], strict=True)
            lines.append([digits(load, 1), one["name"], str(one["points"]),
                          *(between(values) for values in (narrow, wide)), between(logarithm, 2)])
    return rows(["load", "selection", "points", "secant/√(2π) at k_s/k_l = 2", "at 128",
                 "coefficient of ln(k_l/k_s) in the secant"], lines)


def measured(load=0.01):
    """Returns the secant over √(2π) of the widest spectra, with its error."""
    widest = [row for row in points_under(load) if row["k_upper"] == 128 * row["k_lower"]]
    finest = {}
    for row in sorted(widest, key=lambda row: row["nodes"]):
        finest[row["k_lower"]] = row
    told = [f"{with_error(*(row[f'area_corrected_{end}'] / load / BGT for end in ('mean', 'sem')))} for k_l = {k_lower}"
            for k_lower, row in sorted(finest.items())]
    return " and ".join(told)
