#!/usr/bin/env python3
"""Compares contacts with adhesion with Tamaas, node by node.

    python3 tests/adhesion.py

Both programs bring a rough periodic surface, which attracts the elastic body by −w exp(−g/ρ), to a sequence of
mean gaps. Tamaas minimises the energy in the gaps by PolonskyKeerRey. It starts anew at every mean gap, so the
adhesion is so weak that there is one state at each. Gaps are compared node by node, with the tolerance of
Tamaas, and the sets of nodes in contact and with positive pressure.

The script needs the Python module of asperity and `pip install numpy tamaas`.
"""

import sys

import numpy
import tamaas

import asperity

NODES = 96
WORK, RANGE = 0.002, 0.01
# The first state is in tension on average.
GAPS = [0.16, 0.10, 0.06, 0.04, 0.02]
# Tamaas stalls near 1e-11.
TOLERANCE = 1e-10
#: Largest difference of a gap and of the mean pressure, with side and modulus 1.
ACCURACY = 1e-8


def by_tamaas(heights, gap):
    """Returns the gaps and pressures of a state."""
    model = tamaas.Model(tamaas.model_type.basic_2d, [1.0, 1.0], list(heights.shape))
    model.E, model.nu = 1.0, 0.0
    kind = tamaas.PolonskyKeerRey.gap
    solver = tamaas.PolonskyKeerRey(model, heights, TOLERANCE, kind, kind)
    solver.max_iter = 50_000
    attraction = tamaas.ExponentialAdhesionFunctional(heights)
    attraction.parameters = {"rho": RANGE, "surface_energy": WORK}
    solver.addFunctionalTerm(attraction)
    solver.solve(gap)
    displacement = numpy.array(model.displacement).reshape(heights.shape)
    gaps = displacement - heights
    # The offset between the surfaces: the gap is zero in contact.
    gaps -= gaps.min()
    return gaps, numpy.array(model.traction).reshape(heights.shape)


def main():
    tamaas.initialize(1)
    tamaas.set_log_level(tamaas.LogLevel.error)
    rough = asperity.surface(nodes=NODES, hurst=0.7, k_lower=2, k_upper=12, rms_slope=1.0, seed=42)
    heights = numpy.ascontiguousarray(rough.values)
    path = asperity.press(rough, adhesion={"work": WORK, "range": RANGE}, gaps=GAPS, tolerance=1e-10)
    wrong = 0
    for state, gap in zip(path, GAPS, strict=True):
        gaps, pressures = by_tamaas(heights, gap)
        difference = abs(state.gap() - gaps).max()
        contact = int((state.contact() != (gaps < ACCURACY)).sum())
        # Far from contact, the attraction is below the rounding of the pressures of Tamaas.
        repulsive = int((state.repulsive() != (pressures > ACCURACY)).sum())
        load = abs(pressures.mean() - state.row["pressure"])
        print(f"mean gap {gap:g}: mean pressure {state.row['pressure']:+.6f} (within {load:.1e}), "
              f"{state.row['contact_nodes']} nodes in contact, {contact} differ, {repulsive} differ in the sign of "
              f"the pressure, gaps within {difference:.1e}")
        wrong += contact > 0 or repulsive > 0 or not (difference < ACCURACY and load < ACCURACY)
    print("Tamaas has the same states" if not wrong else f"{wrong} states differ")
    sys.exit(min(wrong, 1))


if __name__ == "__main__":
    main()
