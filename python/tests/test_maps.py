"""Tests maps of a finished study against closed forms, stored rows and contacts without a study."""

import numpy as np
import pytest

import asperity

LOADS = [0.01, 0.1, 0.5]
#: E* × rms slope of the study of the fixtures.
PRESSURE = 3.0 * 0.1


@pytest.fixture(params=["stored", "computed again"])
def finished(study, request):
    """Returns a study after a run, with and without stored pressures."""
    if request.param == "computed again":
        study.path.write_text(study.path.read_text().replace('pressures = "all"', ""))
    study.run(progress=False)
    return study


def test_maps_are_those_of_a_contact_without_a_study(finished):
    for realization in range(2):
        heights = finished.heights("surfaces", realization=realization)
        drawn = asperity.surface(
            nodes=64, side=2.0, hurst=0.8, k_lower=1, k_upper=4, rms_slope=0.1, seed=2015, realization=realization
        )
        assert np.array_equal(heights, drawn) and (heights.size, heights.is_periodic) == (drawn.size, True)
        contact = asperity.press(heights, loads=LOADS, effective_modulus=3.0)
        for index, load in enumerate(LOADS):
            for quantity in ("pressure", "gap", "displacement", "contact"):
                map = getattr(finished, quantity)("contact", load=load, realization=realization)
                direct = getattr(contact, quantity)(index)
                # Stored pressures are in the unit of the modulus, and gaps follow from them after a division.
                accuracy = 0 if quantity in ("pressure", "contact") else 1e-15
                assert np.allclose(map, direct, rtol=0, atol=accuracy), quantity
                assert (map.quantity, map.load, map.size) == (quantity, load, (2.0, 2.0))


def test_maps_fulfil_the_conditions_of_contact(finished):
    heights = finished.heights("surfaces", realization=1)
    areas = finished.sql("select load, contact_nodes from contact where realization = 1")
    for load, nodes in zip(areas["load"], areas["contact_nodes"], strict=True):
        pressure, gap, displacement, contact = (
            getattr(finished, quantity)("contact", load=load, realization=1)
            for quantity in ("pressure", "gap", "displacement", "contact")
        )
        assert pressure.values.min() == 0 and (pressure * gap == 0).all()
        assert abs(pressure.values.mean() / (load * PRESSURE) - 1) < 1e-12
        assert np.array_equal(contact, pressure > 0) and contact.values.sum() == nodes
        assert contact.values.dtype == bool
        assert gap.values.min() > -1e-4 * 0.1 * gap.spacing[0]
        assert abs(displacement.values.mean()) < 1e-12
        # The gap is displacement − heights − rigid offset.
        offset = (displacement - heights.values - gap)[gap > 0]
        assert np.ptp(offset) < 1e-12


def test_maps_have_units(finished):
    pressure, contact = (getattr(finished, name)("contact", realization=0) for name in ("pressure", "contact"))
    assert (pressure.load, pressure.load_unit) == (0.5, "E* × rms slope"), "the largest load is the default"
    assert contact.unit is None and pressure.unit is None, "the manifest gives no unit"


STEEL_ON_GLASS = {
    "study": {"name": "steel"},
    "stage": {
        "surfaces": {"kind": "generate", "nodes": 64, "side": "100 um", "rms_height": "200 nm", "hurst": 0.8,
                     "k_lower": 2, "k_upper": 8},
        "contact": {"kind": "solve", "from": "surfaces", "loads": ["10 MPa", "0.02 GPa"], "load_unit": "MPa",
                    "bodies": [{"youngs_modulus": "210 GPa", "poisson_ratio": 0.3},
                               {"youngs_modulus": "70 GPa", "poisson_ratio": 0.2}]},
    },
}


def test_maps_and_tables_have_the_units_of_the_manifest(tmp_path):
    study = asperity.Study.parse(STEEL_ON_GLASS, data=tmp_path)
    study.run(progress=False)
    pressure, gap = (getattr(study, quantity)("contact", load=20) for quantity in ("pressure", "gap"))
    assert abs(pressure.values.mean() / 20 - 1) < 1e-12
    assert (pressure.unit, pressure.load, pressure.load_unit) == ("MPa", 20.0, "MPa")
    for chosen in ({"load": "0.02 GPa"}, {"pressure": "20 MPa"}, {"load": 20, "side": "0.1 mm"}):
        assert (study.pressure("contact", **chosen).values == pressure.values).all(), chosen
    with pytest.raises(asperity.ArgumentError, match="unknown unit `kg`"):
        study.pressure("contact", load="20 kg")
    assert (gap.unit, gap.size, gap.length_unit) == ("µm", (100.0, 100.0), "µm")
    heights = study.heights("surfaces")
    assert heights.unit == "µm" and abs(heights.statistics()["rms_height"] - 0.2) < 1e-12
    units = study.table("contact").to_pandas().attrs["units"]
    assert (units["pressure"], units["mean_gap"], units["side"]) == ("MPa", "µm", "µm")
    assert study.table("contact").column("energy").unit == "J/m²"
    shown = {**STEEL_ON_GLASS, "study": {"name": "steel", "output_units": {"length": "nm", "pressure": "GPa"}}}
    study = asperity.Study.parse(shown, data=tmp_path)
    assert study.run(progress=False).computed == 0
    in_gigapascals = study.pressure("contact", load="20 MPa")
    assert (in_gigapascals.unit, in_gigapascals.load, in_gigapascals.length_unit) == ("GPa", 0.02, "nm")
    assert np.allclose(in_gigapascals.values, pressure.values / 1000, rtol=1e-14)
    assert np.allclose(np.asarray(study.heights("surfaces")), 1000 * np.asarray(heights), rtol=1e-14)
    assert study.table("contact").column("mean_gap").unit == "nm"


def test_what_can_be_chosen_is_listed(finished):
    with pytest.raises(ValueError, match="2 tasks of `contact` match; choose one by\n  realization=0 | 1"):
        finished.pressure("contact", load=0.1)
    with pytest.raises(asperity.ArgumentError, match="no row has `realization` = 7; available: 0, 1"):
        finished.heights("surfaces", realization=7)
    with pytest.raises(asperity.ArgumentError, match="the study has no unit of pressure"):
        finished.pressure("contact", load="10 MPa", realization=0)
    with pytest.raises(asperity.ArgumentError, match="no row has `load` = 0.2; the nearest are 0.1 and 0.5"):
        finished.gap("contact", load=0.2, realization=0)
    with pytest.raises(asperity.ArgumentError, match="the nearest is 0.5"):
        finished.gap("contact", load=0.7, realization=0)
    with pytest.raises(asperity.UnknownNameError, match="no coordinate `hurts`.*`hurst`"):
        finished.heights("surfaces", hurts=0.8)
    with pytest.raises(asperity.UnknownNameError, match="contacts"):
        finished.contact("contacts")
    with pytest.raises(asperity.ArgumentError, match="pressures"):
        finished.pressure("surfaces", realization=0)
    with pytest.raises(asperity.UnknownNameError, match="no coordinate `pressure`"):
        finished.heights("surfaces", realization=0, pressure=0.1)


def test_a_study_without_results_has_no_maps(study):
    with pytest.raises(asperity.NotComputedError, match="asperity run"):
        study.pressure("contact", load=0.1, realization=0)


def test_points_of_a_sweep_are_chosen_by_their_parameters(study):
    study.path.write_text(study.path.read_text().replace("hurst = 0.8", "hurst = [0.5, 0.8]"))
    study.run(progress=False)
    maps = [study.pressure("contact", load=0.1, realization=1, hurst=np.float64(hurst)) for hurst in (0.5, 0.8)]
    assert not np.array_equal(*maps)
    with pytest.raises(asperity.ArgumentError, match="hurst=0.5 | 0.8"):
        study.pressure("contact", load=0.1, realization=1)


def test_maps_are_arrays_for_numpy(finished):
    gap = finished.gap("contact", load=0.1, realization=0)
    assert np.array_equal(gap / 2.0, gap.values / 2.0) and np.max(gap) == gap.values.max()
    assert gap[3].shape == (64,) and len(gap) == 64 and np.asarray(gap) is gap.values
    assert np.array_equal(np.hypot(gap, gap), np.hypot(gap.values, gap.values))
    assert "gap" in repr(gap) and "0.1 E* × rms slope" in repr(gap)


def test_maps_are_drawn(finished):
    pytest.importorskip("matplotlib").use("agg")
    for quantity in ("pressure", "contact"):
        map = getattr(finished, quantity)("contact", load=0.1, realization=0)
        assert map.plot().get_xlabel() == "x (length)"
        assert "data:image/png" in map._repr_html_()
