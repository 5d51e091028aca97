"""The flow through the gap: its factor at given contact areas, from flow-law.toml, and the exponent with which it vanishes
at a saddle, from saddle.toml."""

import math

from results_tables import digits, least_squares, ranging, rows, sealing_limit, table

AREAS = (0.05, 0.1, 0.2)
# Coefficient of the correction of 2017, for areas counted with switches.
OF_2017 = (math.pi - 1 + math.log(2)) / 24


def factors():
    """Returns {(k_lower, k_upper, hurst): flow factors at AREAS}, from means over surfaces and both directions."""
    curves = {}
    for row in table("flow-law", "mean-leak").sort("load").to_dicts():
        area = row["area_fraction"] - OF_2017 * row["switches"] / row["nodes"] ** 2
        curves.setdefault((row["k_lower"], row["k_upper"], row["hurst"]), []).append((area, math.log(row["flow_factor"])))
    return {key: [math.exp(interpolated(points, area)) for area in AREAS] for key, points in curves.items()}


def interpolated(points, at):
    (low, of_low), (high, of_high) = next((a, b) for a, b in zip(points, points[1:], strict=False) if a[0] < at <= b[0])
    return of_low + (at - low) / (high - low) * (of_high - of_low)


def closed_form():
    """Returns c and m of K/ū³ = c (1 − A/A_c)^m, from a least-squares line through ln K/ū³ for k_s/k_l ≤ 4.

    A_c is the area of the percolation threshold in the limit of large cells.
    """
    points = [(math.log(open_share(area)), math.log(value)) for (lower, upper, _), values in factors().items()
              if upper <= 4 * lower for value, area in zip(values, AREAS, strict=True)]
    constant, exponent = least_squares([[1, x] for x, _ in points], [y for _, y in points], [1] * len(points))
    return math.exp(constant), exponent


def open_share(area):
    return 1 - area / sealing_limit()["limit"]


def closed_form_values():
    """Returns the values of the closed form at AREAS."""
    constant, exponent = closed_form()
    return [constant * open_share(area) ** exponent for area in AREAS]


def closed_form_words():
    constant, exponent = closed_form()
    return f"{digits(constant, 2)} (1 − A/{digits(sealing_limit()['limit'], 3)})^{digits(exponent, 2)}"


def factor_words():
    """Returns sentences on the dependence of the flow factor on area, Hurst exponent and bandwidth."""
    found = factors()
    *lighter, at_a_fifth = zip(*([abs(math.log(one / other)) for one, other in zip(values, found[lower, upper, 0.3], strict=True)]
                                 for (lower, upper, hurst), values in found.items() if hurst == 0.8), strict=True)
    of_hurst = [difference for at_area in lighter for difference in at_area]
    wide, narrow = ([values[1] for (lower, upper, _), values in found.items() if upper == bandwidth * lower]
                    for bandwidth in (16, 2))
    form = closed_form_values()
    over_form = [value / of_form for (lower, upper, _), values in found.items() if upper <= 4 * lower
                 for value, of_form in zip(values, form, strict=True)]
    return (f"At a given contact area, the flow factor K/ū³ is the same for Hurst exponents of 0.3 and 0.8, within "
            f"{digits(100 * max(of_hurst), 1)} % at areas of 0.05 and 0.1; at 0.2 it differs by up to {digits(100 * max(at_a_fifth), 2)} %. It falls with the bandwidth: at an area of 0.1 it is "
            f"{ranging(narrow, 2)} for k_s/k_l = 2 and {ranging(wide, 2)} for 16. For bandwidths up to 4 and areas A from 0.05 to 0.2, "
            f"K/ū³ = {closed_form_words()} agrees within {digits(100 * max(abs(one - 1) for one in over_form), 1)} %.")


def factor_table():
    lines = [[str(lower), str(upper), digits(hurst, 1), *(digits(value, 3) for value in values)]
             for (lower, upper, hurst), values in sorted(factors().items())]
    form = ["", "", "", *(f"({digits(value, 3)})" for value in closed_form_values())]
    return rows(["k_l", "k_s", "H", *(f"K/ū³ at the area {area}" for area in AREAS)], [*lines, form])


# First and last loads of the fits. The channel of heavier loads is a few nodes wide on the coarser meshes.
WINDOWS = [(start, end) for start in (0.2, 0.216) for end in (0.225, 0.2265, 0.2275)]


def fits():
    """Returns (nodes, (first load, last load), β, threshold load, rms residual) for every mesh and window.

    Each fit is ln K = c + β ln(y_c − y) + c₁ (y_c − y), by least squares over the loads of the window. The last term is the
    first correction to the power law. The threshold y_c is that with the smallest residual.
    """
    found = table("saddle", "flow").sort("nodes", "load").to_dicts()
    told = []
    for nodes in sorted({row["nodes"] for row in found}):
        for start, end in WINDOWS:
            points = [(row["load"], math.log(row["flow_conductivity_x"])) for row in found
                      if row["nodes"] == nodes and start - 1e-9 < row["load"] < end + 1e-9]
            told.append((nodes, (start, end), *best(points, end)))
    return told


def best(points, end):
    """Searches the threshold y_c above the last load, by golden section in ln(y_c − end)."""
    ratio = (math.sqrt(5) - 1) / 2
    low, high = math.log(1e-5), math.log(1e-2)
    for _ in range(60):
        inner, outer = high - ratio * (high - low), low + ratio * (high - low)
        if residual(points, end + math.exp(inner)) < residual(points, end + math.exp(outer)):
            high = outer
        else:
            low = inner
    threshold = end + math.exp((low + high) / 2)
    return coefficients(points, threshold)[1], threshold, residual(points, threshold)


def coefficients(points, threshold):
    design = [[1, math.log(threshold - load), threshold - load] for load, _ in points]
    return least_squares(design, [value for _, value in points], [1] * len(points))


def residual(points, threshold):
    constant, exponent, correction = coefficients(points, threshold)
    left = [value - constant - exponent * math.log(threshold - load) - correction * (threshold - load)
            for load, value in points]
    return math.sqrt(sum(one * one for one in left) / len(left))


def saddle_words():
    """Returns sentences on the exponent, for all meshes and ranges of loads."""
    all_fits = fits()
    coarsest = min(nodes for nodes, *_ in all_fits)
    finer = [fit for fit in all_fits if fit[0] > coarsest]
    on_coarsest = [fit[2] for fit in all_fits if fit[0] == coarsest]
    exponents, thresholds = [fit[2] for fit in finer], [fit[3] for fit in finer]
    return (f"Where two spots of contact merge at a saddle, the flow vanishes as a power of the distance of the load from "
            f"the threshold. The exponent is {ranging(exponents, 3)} for all ranges of loads on the two finer meshes, and {ranging(on_coarsest, 3)} "
            f"on {coarsest}² nodes. It falls slightly as "
            "the loads approach the threshold, towards the 3.45 of Dapp & Müser (2015). The threshold load is "
            f"{digits(sum(thresholds) / len(thresholds), 4)}.")


def saddle_table():
    lines = [[str(nodes), f"{start} … {end}", digits(exponent, 3), digits(threshold, 5), digits(left, 1)]
             for nodes, (start, end), exponent, threshold, left in fits()]
    return rows(["nodes per side", "loads", "exponent β", "threshold load", "rms residual of ln K"], lines)
