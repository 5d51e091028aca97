"""Tests paths of contacts with adhesion against closed forms and stored studies."""

import numpy as np
import pytest

import asperity

WORK, RANGE = 3e-3, 0.02
ADHESION = {"work": WORK, "range": RANGE}
GAPS = [0.06, 0.03, 0.01, 0.03]

MANIFEST = """\
[study]
name = "sticky"
seed = 2015

[stage.surfaces]
kind = "generate"
nodes = 64
hurst = 0.8
k_lower = 1
k_upper = 4
rms_slope = 0.3

[stage.contact]
kind = "solve"
from = "surfaces"
adhesion = { work = 3e-3, range = 0.02 }
control = "gap"
gaps = [0.06, 0.03, 0.01, 0.03]
tolerance = 1e-9
"""


@pytest.fixture(scope="module")
def rough():
    return asperity.surface(nodes=64, hurst=0.8, k_lower=1, k_upper=4, rms_slope=0.3, seed=2015)


@pytest.fixture(scope="module")
def path(rough):
    return asperity.press(rough, adhesion=ADHESION, gaps=GAPS, tolerance=1e-9)


def test_a_path_is_that_of_a_study(path, tmp_path):
    manifest = tmp_path / "sticky.toml"
    manifest.write_text(MANIFEST)
    study = asperity.Study(manifest, data=tmp_path / "data")
    study.run(progress=False)
    stored = study.table("contact")
    names = [name for name in path.table.names if name in stored.names]
    assert len(names) > 25
    for name in names:
        np.testing.assert_array_equal(path.table[name], stored[name], name)


def test_maps_fulfil_the_laws_of_wall_and_attraction(rough, path):
    for state, gap_asked in zip(path, GAPS, strict=True):
        gap, pressure = state.gap(), state.pressure()
        assert abs(gap.mean() / gap_asked - 1) < 1e-12 and gap.min() >= 0
        attraction = WORK / RANGE * np.exp(-gap / RANGE)
        touches = gap == 0
        assert np.array_equal(state.contact(), touches)
        assert np.array_equal(state.repulsive(), pressure > 0) and (touches | ~state.repulsive()).all()
        assert (pressure[touches] > -attraction[touches] - 1e-9).all()
        assert np.allclose(pressure[~touches], -attraction[~touches], rtol=0, atol=1e-9)
        assert abs(pressure.mean() - path.mean_pressure[state.index]) < 1e-9
        offset = state.displacement() - rough.values - gap
        assert np.ptp(offset) < 1e-14 and abs(state.displacement().mean()) < 1e-15
    assert path.pressure(0).min() < 0 < path.pressure(2).max()
    assert (path.repulsive_area < path.area).all()


def test_states_follow_the_order_of_the_path(rough, path):
    assert path.mean_gap.tolist() == GAPS
    assert path.table["branch"] == ["approach", "approach", "approach", "separation"]
    assert path.table["step"].tolist() == [1, 2, 3, 4]
    returned = asperity.press(rough, adhesion=ADHESION, gaps=GAPS[:3], path="there-and-back", tolerance=1e-9)
    assert returned.mean_gap.tolist() == [0.06, 0.03, 0.01, 0.03, 0.06]
    assert np.array_equal(returned.pressure(3), path.pressure(3))
    spaced = asperity.press(rough, adhesion=ADHESION, gaps={"from": 0.06, "to": 0.02, "steps": 3})
    assert spaced.mean_gap.tolist() == [0.06, 0.04, 0.02]


def test_state_after_state_is_the_whole_path(rough, path):
    for state in asperity.press_each(rough, adhesion=ADHESION, gaps=GAPS, tolerance=1e-9):
        assert np.array_equal(state.pressure(), path.pressure(state.index))
        if state.index == 1:
            break
    maps_only = asperity.press(rough, adhesion=ADHESION, gaps=GAPS, tolerance=1e-9, fields=False)
    assert np.array_equal(maps_only.repulsive(2), path.repulsive(2))
    with pytest.raises(IndexError, match="fields=False"):
        maps_only.gap(2)


def test_a_tension_that_no_state_bears_pulls_the_surfaces_off(rough):
    path = asperity.press(rough, adhesion=ADHESION, pressures=[0.0, 0.02, 0.0, -1.0])
    assert path.table["stop"] == ["converged", "converged", "converged", "pulled-off"]
    assert path.converged and np.isnan(path.mean_gap[3]) and path.area[0] > 0 == path.area[3]
    assert set(path.table["max_pairs"]) == {20_000}
    pull_off = path.table["pull_off_load"]
    assert np.isnan(pull_off[:3]).all() and -WORK / RANGE / 0.3 < pull_off[3] < 0
    assert np.isinf(path.gap(3)).all() and not path.pressure(3).any() and not path.displacement(3).any()


def test_flat_surfaces_attract_each_other_by_the_closed_form():
    gaps = np.array([0.2, 0.1, 0.05])
    flat = asperity.press(np.zeros((8, 12)), size=(1.0, 1.5), boundary="periodic", effective_modulus=5.0,
                          adhesion={"work": 0.01, "range": 0.1}, gaps=gaps)
    assert np.allclose(flat.mean_pressure, -0.1 * np.exp(-gaps / 0.1), rtol=1e-12, atol=0)


def test_without_work_of_adhesion_the_contact_is_that_without_adhesion(rough):
    loads = [0.01, 0.1, 0.5]
    plain = asperity.press(rough, loads=loads, tolerance=1e-9)
    path = asperity.press(rough, loads=loads, tolerance=1e-12, adhesion={"work": 0, "range": 0.02})
    assert np.array_equal(plain.table["contact_nodes"], path.table["contact_nodes"])
    for load in range(3):
        assert np.allclose(plain.pressure(load), path.pressure(load), rtol=0, atol=1e-8)


def test_an_isolated_patch_has_an_absolute_displacement():
    ball = asperity.surface(method="paraboloid", nodes=32, radius=1.0)
    path = asperity.press(ball, boundary="free", adhesion={"work": 0.01, "range": 0.1}, pressures=[0.0])
    column = path.table["mean_displacement"][0]
    assert abs(path.displacement(0).mean() - column) < 1e-12


@pytest.mark.parametrize("arguments, message", [
    (dict(gaps=[0.1], loads=[0.1], adhesion=ADHESION), "not both `loads` and `gaps`"),
    (dict(adhesion=ADHESION), "`gaps` or `displacements`$"),
    (dict(gaps=["far"], adhesion=ADHESION), "`gaps` must be a number or an expression"),
    (dict(gaps=[0.1], adhesion=0.01), "`adhesion` is 0.01, but must be"),
    (dict(gaps=[0.1, 0.0], adhesion=ADHESION), "`gaps`.*0.0"),
    (dict(gaps=[0.1, 0.1], adhesion=ADHESION), "same state twice"),
    (dict(gaps=[0.1], adhesion={"work": -1.0, "range": 0.1}), "`adhesion.work` is -1.0"),
    (dict(gaps=[0.1], adhesion={"work": 1.0, "range": 0.0}), "`adhesion.range` is 0.0"),
    (dict(gaps=[0.1], adhesion={"work": 1.0, "rnage": 0.1}), "rnage"),
    (dict(gaps=[0.1], adhesion={"work": 0.1, "range": 0.01}), "too coarse for the adhesion"),
    (dict(loads=[0.1], path="there-and-back"), "`path`.*`adhesion`"),
    (dict(loads=[0.1], adhesion=ADHESION, hardness=1.0), "hardness"),
])
def test_what_is_wrong_is_told(rough, arguments, message):
    with pytest.raises(asperity.ArgumentError, match=message):
        asperity.press(rough, **arguments)


def test_a_coarse_mesh_is_a_warning():
    coarse = asperity.surface(nodes=32, hurst=0.8, k_lower=1, k_upper=4, rms_slope=0.3, seed=1)
    with pytest.warns(asperity.StudyWarning, match="expect errors of about 1.2 % of the pressure"):
        asperity.press(coarse, adhesion={"work": 0.002, "range": 0.01}, gaps=[0.1])
