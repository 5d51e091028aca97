"""Contacts at prescribed mean gaps and displacements, and under forces."""

import asperity
import numpy as np


def test_the_mean_gap_of_a_load_bears_this_load():
    surface = asperity.surface(nodes=64, hurst=0.8, k_lower=2, k_upper=16)
    pressed = asperity.press(surface, loads=[0.02, 0.2])
    found = asperity.press(surface, gaps=pressed.mean_gap)
    # Rows ascend with the gap, which falls with the load.
    assert np.allclose(found.load[::-1], pressed.load, rtol=1e-3)
    assert found.converged
    gaps = [found.gap(load).mean() for load in range(2)]
    assert np.allclose(gaps, found.table["prescribed_gap"], rtol=1e-3)


def test_surfaces_that_do_not_touch_are_apart_by_the_gap():
    surface = asperity.surface(nodes=64, hurst=0.8, k_lower=2, k_upper=16)
    gap = 2 * surface.values.max() - surface.values.mean()
    apart = asperity.press(surface, gaps=[gap])
    assert (apart.load[0], apart.area[0]) == (0.0, 0.0)
    assert np.isclose(apart.gap(0).mean(), gap) and apart.gap(0).min() > 0


def test_a_force_is_borne_by_the_area_of_the_surface():
    ball = asperity.surface(method="paraboloid", nodes=64, side="1 mm", radius="5 mm")
    pressed = asperity.press(ball, boundary="free", effective_modulus="58 GPa", loads=["10 N"])
    assert np.isclose(pressed.mean_pressure[0], 0.01)  # GPa on 1 mm²
    assert pressed.table["force"][0] == 10.0
    pushed = asperity.press(ball, boundary="free", effective_modulus="58 GPa", displacements=["2 um"])
    assert np.isclose(pushed.table["force"][0], 4 / 3 * 58e3 * np.sqrt(5) * 0.002**1.5, rtol=0.02)
