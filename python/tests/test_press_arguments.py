"""Tests arguments of `press` against closed forms and against studies with the same keys."""

import numpy as np
import pytest

import asperity

KEYS = dict(nodes=64, hurst=0.8, k_lower=1, k_upper=4, rms_slope=0.1, seed=2015)

STUDY = """\
[study]
name = "arguments"
seed = 2015

[stage.surfaces]
kind = "generate"
nodes = 64
hurst = 0.8
k_lower = 1
k_upper = 4
rms_slope = 0.1

[stage.contact]
kind = "solve"
from = "surfaces"
"""

LOWER = """\
[stage.lower]
kind = "generate"
nodes = 64
hurst = 0.5
k_lower = 1
k_upper = 6
rms_slope = 0.05
seed = 7
"""


@pytest.fixture(scope="module")
def rough():
    return asperity.surface(**KEYS)


def assert_is_study(table, tmp_path, keys, stage="contact", exactly=True):
    """Asserts that a table has the columns and numbers of a stage of a study."""
    manifest = tmp_path / "arguments.toml"
    manifest.write_text(STUDY + keys)
    study = asperity.Study(manifest, data=tmp_path / "data")
    study.run(progress=False)
    stored = study.table(stage)
    names = [name for name in table.names if name in stored.names]
    assert len(names) > 10
    for name in names:
        if exactly or table[name].dtype.kind not in "f":
            np.testing.assert_array_equal(table[name], stored[name], name)
        else:
            np.testing.assert_allclose(table[name], stored[name], rtol=1e-9, atol=1e-9, err_msg=name)
    return stored


def test_the_stiffness_is_the_derivative_of_the_pressure(rough, tmp_path):
    loads = [0.0499, 0.05, 0.0501]
    contact = asperity.press(rough, loads=loads, stiffness=True, tolerance=1e-9)
    pressure, gap = contact.mean_pressure, contact.mean_gap
    secant = (pressure[2] - pressure[0]) / (gap[0] - gap[2])
    assert abs(contact.table["stiffness"][1] / secant - 1) < 0.01
    assert_is_study(contact.table, tmp_path, f"loads = {loads}\nstiffness = true\ntolerance = 1e-9\n")
    assert "stiffness" not in asperity.press(rough, loads=loads).table.names


def test_a_path_with_a_hardness_keeps_the_plastic_depth(rough, tmp_path):
    path = dict(hardness=0.6, hardness_unit="relative", tolerance=1e-9)
    loads = [0.05, 0.2, 0.1, 0.02]
    contact = asperity.press(rough, loads=loads, path="as-given", **path)
    assert contact.load.tolist() == [0.05, 0.2, 0.02, 0.1]
    assert contact.table["branch"] == ["loading", "loading", "unloading", "unloading"]
    # The elastic contact of the surface that has lost its plastic depth is that of unloading.
    depth = np.maximum(-contact.gap(1), 0)
    assert abs(depth.mean() / contact.table["residual_depth"][3] - 1) < 1e-12
    worn = asperity.Topography(rough.values - depth, 1.0, is_periodic=True)
    again = asperity.press(worn, pressures=contact.mean_pressure[2:], tolerance=1e-9)
    for load in range(2):
        np.testing.assert_array_equal(again.contact(load), contact.contact(load + 2))
        np.testing.assert_allclose(again.pressure(load), contact.pressure(load + 2), atol=1e-8)
        np.testing.assert_allclose(again.gap(load), contact.gap(load + 2), atol=1e-9)
    for state in asperity.press_each(rough, loads=loads, path="as-given", **path):
        assert np.array_equal(state.displacement(), contact.displacement(state.index))
    keys = "hardness = 0.6\nhardness_unit = \"relative\"\ntolerance = 1e-9\npath = \"as-given\"\n"
    assert_is_study(contact.table, tmp_path, f"loads = {loads}\n{keys}")


def test_a_path_without_memory_is_refused(rough):
    with pytest.raises(asperity.ArgumentError, match="needs `adhesion` or a `hardness`"):
        asperity.press(rough, loads=[0.1, 0.05], path="as-given")


def test_the_stick_area_is_the_area_under_the_lower_load(rough, tmp_path):
    loads, friction = [0.02, 0.05, 0.1], dict(coefficient=0.3, loads=[0.5, 0.8], poisson_ratio=0.3)
    contact = asperity.press(rough, loads=loads, friction=friction)
    slip = contact.partial_slip
    # Only the load 0.1 has both shares, 0.05 and 0.02.
    assert slip["load"].tolist() == [0.1, 0.1] and slip["tangential_load"].tolist() == [0.5, 0.8]
    np.testing.assert_array_equal(slip["stick_fraction"], contact.area[[1, 0]])
    keys = "[stage.slip]\nkind = \"measure\"\nfrom = \"contact\"\n"
    keys += "friction = { coefficient = 0.3, loads = [0.5, 0.8], poisson_ratio = 0.3 }\n"
    assert_is_study(slip, tmp_path, f"loads = {loads}\n{keys}", "slip")
    assert asperity.press(rough, loads=loads).partial_slip is None
    with pytest.raises(asperity.ArgumentError, match="loads"):
        asperity.press(rough, loads=[0.1], friction=friction)
    with pytest.raises(asperity.ArgumentError, match="hardness"):
        asperity.press(rough, loads=loads, friction=friction, hardness=1.0)


def test_two_surfaces_are_pressed_as_the_sum_of_their_heights(rough, tmp_path):
    lower = asperity.surface(nodes=64, hurst=0.5, k_lower=1, k_upper=6, rms_slope=0.05, seed=7)
    whole = asperity.press(rough, against=lower, shift=(0.25, 0), mirror="y", loads=[0.1])
    moved = np.roll(lower.values[:, ::-1], 16, axis=0)
    np.testing.assert_allclose(whole.topography.values, rough.values + moved, atol=1e-15)
    same = asperity.press(rough.values, size=1.0, boundary="periodic", against=moved, loads=[0.1])
    np.testing.assert_allclose(same.pressure(0), whole.pressure(0), rtol=0, atol=1e-6)
    keys = "against = \"lower\"\nshift = [0.13, 0.2]\nmirror = \"x\"\nloads = [0.1]\n" + LOWER
    contact = asperity.press(rough, against=lower, shift=(0.13, 0.2), mirror="x", loads=[0.1])
    assert_is_study(contact.table, tmp_path, keys)
    (state,) = asperity.press_each(rough, against=lower, shift=(0.13, 0.2), mirror="x", loads=[0.1])
    assert np.array_equal(state.pressure(), contact.pressure(0))


def test_surfaces_that_do_not_match_are_refused(rough):
    small = asperity.surface(**{**KEYS, "nodes": 32})
    with pytest.raises(asperity.SurfaceError, match="numbers of nodes differ"):
        asperity.press(rough, against=small, loads=[0.1])
    with pytest.raises(asperity.ArgumentError, match="`shift` needs `against`"):
        asperity.press(rough, shift=(0.1, 0), loads=[0.1])
    with pytest.raises(asperity.ArgumentError, match="`shift`"):
        asperity.press(rough, against=rough, shift=(2, 0), loads=[0.1])
    with pytest.raises(asperity.ArgumentError, match="cannot be shifted"):
        asperity.press(rough, against=rough, shift=(0.5, 0), boundary="free", loads=[0.1])


STEEL = [{"youngs_modulus": "210 GPa", "poisson_ratio": 0.3}]


@pytest.fixture(scope="module")
def scan():
    return asperity.surface(**KEYS, side="100 um")


def test_quantities_are_accepted_wherever_a_manifest_accepts_them(scan):
    assert (scan.size, scan.unit) == ((100.0, 100.0), "µm")
    modulus = 210.0 / 0.91
    same = asperity.press(scan, pressures=[0.05, 0.1], effective_modulus=modulus).area
    for states in [
        dict(pressures=["50 MPa", "0.1 GPa"]),
        dict(loads=["50 MPa", "100 MPa"]),
        dict(pressures={"to": "100 MPa", "steps": 2}),
    ]:
        np.testing.assert_array_equal(asperity.press(scan, bodies=STEEL, **states).area, same)
    one = asperity.press(scan, bodies=STEEL, pressures="50 MPa")
    np.testing.assert_array_equal(one.area, same[:1])
    soft = {"effective_modulus": "10 MPa", "adhesion": {"work": "50 mJ/m^2", "range": "500 nm"}}
    plain = {"effective_modulus": 10.0, "adhesion": {"work": 0.05, "range": 0.5}}
    np.testing.assert_array_equal(
        asperity.press(scan, gaps=["2000 nm"], **soft).mean_pressure,
        asperity.press(scan, gaps=[2.0], **plain).mean_pressure,
    )


def test_a_number_beside_quantities_is_refused_as_in_a_manifest(scan):
    for states in [dict(pressures=50), dict(pressures=[50, "50 MPa"]), dict(loads=[50, "50 MPa"])]:
        with pytest.raises(asperity.errors.ArgumentError, match="the load 50 has no unit, but another"):
            asperity.press(scan, bodies=STEEL, **states)
    with pytest.raises(asperity.errors.ArgumentError, match="`hardness` has no unit"):
        asperity.press(scan, pressures="50 MPa", bodies=STEEL, hardness=3)
    with pytest.warns(asperity.errors.StudyWarning, match="so that every node touches"):
        asperity.press(scan, pressures=["60 GPa"], bodies=STEEL)


def test_sides_with_a_unit_name_the_unit_of_the_map(scan, tmp_path):
    np.save(tmp_path / "heights.npy", scan.values)
    for map in [
        asperity.Topography(scan.values, "100 um"),
        asperity.Topography(scan.values, ("0.1 mm", "100 um"), unit="µm"),
        asperity.read(tmp_path / "heights.npy", size="100 um"),
    ]:
        assert map.unit == "µm"
        np.testing.assert_allclose(map.size, 100.0, rtol=1e-15)
    assert scan.crop(("10 um", 0.0), "0.05 mm").size == (50.0, 50.0)
    with pytest.raises(asperity.errors.ArgumentError, match="the map has no unit"):
        asperity.Topography(scan.values, 100.0).crop((0.0, 0.0), "50 um")
    with pytest.raises(asperity.errors.ArgumentError, match="`MPa` is no unit of length"):
        asperity.Topography(scan.values, "100 MPa")
    with pytest.raises(asperity.errors.ArgumentError, match="only one of the sides has a unit"):
        asperity.Topography(scan.values, ("100 um", 100))


def test_implausible_slopes_are_told_at_the_door(scan, tmp_path):
    nanometres = 980 * scan.values
    np.save(tmp_path / "heights.npy", nanometres)
    words = r"the rms slope of the map is 9.*nm in place of µm would give an rms slope of 0\.09"
    for enter in [
        lambda: asperity.Topography(nanometres, "100 um"),
        lambda: asperity.read(tmp_path / "heights.npy", size=100.0, unit="um"),
        lambda: asperity.press(nanometres, size=100.0, boundary="periodic", loads=[0.1]),
        lambda: asperity.press(asperity.Topography(nanometres, 100.0).detrend(), boundary="free", loads=[0.1]),
    ]:
        with pytest.warns(asperity.errors.StudyWarning, match=words) as told:
            enter()
        assert len(told) == 1
    with pytest.warns(asperity.errors.StudyWarning, match="`rms_height` is 200 µm on a side of 100 µm"):
        asperity.surface(nodes=64, hurst=0.8, k_lower=1, k_upper=4, side="100 um", rms_height="200 um")
