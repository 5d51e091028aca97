"""Tests that the module computes the same bits as a study stores."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import asperity

polars = pytest.importorskip("polars")

KEYS = dict(nodes=64, side=2.0, hurst=0.8, k_lower=1, k_upper=4, rms_slope=0.1, seed=2015)
LOADS = [0.01, 0.1, 0.5]


def stored(study, stage, column):
    """Reads a column of maps from the store, by the name of the surface. A file name begins with the key."""
    rows = study.table(stage).to_polars()
    surfaces = dict(zip(rows["task"], rows["surface"], strict=True))
    tables = {
        path.stem.split("-")[0]: polars.read_parquet(path)
        for path in study.data.glob("store/**/*.parquet")
        if column in polars.read_parquet_schema(path)
    }
    return {surfaces[key]: table[column].to_list() for key, table in tables.items()}


def test_surfaces_are_those_that_a_study_draws(finished):
    heights = stored(finished, "surfaces", "heights")
    for realization in range(2):
        drawn = asperity.surface(**KEYS, realization=realization)
        (name,) = drawn.description["surface"]
        assert np.array_equal(np.array(heights[name][0]), drawn.heights.filled().reshape(-1))


def test_contacts_are_those_that_a_study_solves(finished):
    pressures = stored(finished, "contact", "pressures")
    rows = finished.table("contact").to_polars()
    for realization in range(2):
        drawn = asperity.surface(**KEYS, realization=realization)
        (name,) = drawn.description["surface"]
        contact = asperity.press(drawn, loads=LOADS, effective_modulus=3.0)
        own = rows.filter(polars.col("surface") == name)
        for column in ["load", "pressure", "contact_nodes", "mean_gap", "energy", "peak_pressure", "pairs",
                       "residual", "stop", "rms_slope", "effective_modulus", "tolerance"]:
            assert list(contact.table[column]) == own[column].to_list(), column
        for load in range(3):
            solved = [value or 0.0 for value in pressures[name][load]]
            assert np.array_equal(contact.pressure(load).reshape(-1), solved)


def test_the_flow_through_the_gap_is_that_of_a_study(tmp_path):
    study = asperity.Study.parse({
        "study": {"name": "flow"},
        "stage": {
            "surfaces": {"kind": "generate", **KEYS},
            "contact": {"kind": "solve", "from": "surfaces", "loads": LOADS, "flow": True},
            "leak": {"kind": "measure", "from": "contact"},
        },
    }, data=tmp_path)
    study.run(progress=False)
    contact, leak = asperity.press(asperity.surface(**KEYS), loads=LOADS, flow=True), study.table("leak")
    for column in ["flow_conductivity_x", "flow_conductivity_y", "flow_factor_x", "flow_factor_y"]:
        assert np.array_equal(contact.table[column], leak[column], equal_nan=True), column
    assert contact.table["flow_conductivity_x"][0] > contact.table["flow_conductivity_x"][2] == 0.0


def test_the_command_is_the_same_program(study, finished):
    command = [sys.executable, "-m", "asperity", "--data", study.data, "table", study.path, "contact"]
    printed = subprocess.run([*command, "--csv"], capture_output=True, text=True, check=True).stdout
    loads = polars.read_csv(printed.encode())["load"].to_list()
    assert loads == list(finished.table("contact")["load"])


def test_load_after_load_is_the_whole_block():
    rough = asperity.surface(**KEYS)
    at_once = asperity.press(rough, loads=LOADS)
    for state in asperity.press_each(rough, loads=LOADS):
        assert np.array_equal(state.pressure(), at_once.pressure(state.index))
        assert state.row["mean_gap"] == at_once.mean_gap[state.index]
    assert state.index == 2


def test_cores_change_no_number():
    rough = asperity.surface(**{**KEYS, "nodes": 512})
    alone, together = (asperity.press(rough, loads=[0.01, 0.02], jobs=jobs) for jobs in (1, 3))
    for load in range(2):
        assert np.array_equal(alone.pressure(load), together.pressure(load))
    assert list(alone.table["energy"]) == list(together.table["energy"])


def test_no_core_presses_nothing():
    with pytest.raises(asperity.errors.ArgumentError, match="`jobs` is 0, but must be from 1 to 1024"):
        asperity.press(asperity.surface(**KEYS), loads=LOADS, jobs=0)


def test_loads_and_pressures_are_one_contact():
    rough = asperity.surface(**KEYS)
    relative = asperity.press(rough, loads=[0.1], effective_modulus=3.0)
    absolute = asperity.press(rough, pressures=[0.1 * 0.1 * 3.0], effective_modulus=3.0)
    assert np.array_equal(relative.pressure(0), absolute.pressure(0))
    assert abs(absolute.pressure(0).mean() - 0.03) < 1e-12


def test_loads_with_units_need_a_modulus():
    surface = asperity.surface(nodes=32, k_lower=1, k_upper=8, hurst=0.8, seed=1)
    with pytest.raises(asperity.ArgumentError, match="pressures have a unit, but the stage has no modulus"):
        asperity.press(surface, pressures=["10 MPa"])
    assert repr(asperity.press(surface, loads=[0.1])).startswith("<asperity.Contact: 1 load 0.1, area 0.")


def test_fields_satisfy_the_conditions_of_contact():
    rough = asperity.surface(**KEYS)
    contact = asperity.press(rough, loads=[0.1], effective_modulus=3.0)
    gap, pressure = contact.gap(0), contact.pressure(0)
    assert (pressure >= 0).all() and (gap * pressure == 0).all()
    assert gap.min() > -1e-4 * 0.1 * rough.spacing[0]
    assert abs(gap.mean() - contact.mean_gap[0]) < 1e-5 * contact.mean_gap[0]
    # The gap is displacement − heights − rigid offset.
    offset = (contact.displacement(0) - rough.heights.filled() - gap)[gap > 0]
    assert np.ptp(offset) < 1e-12


def test_arrays_of_any_layout_and_type_are_the_same_surface():
    rough = asperity.surface(**KEYS).heights.filled()
    contact = asperity.press(rough, size=2.0, boundary="periodic", loads=0.1)
    turned = asperity.press(np.asfortranarray(rough), size=(2.0, 2.0), boundary="periodic", loads=np.float64(0.1))
    assert np.array_equal(contact.pressure(0), turned.pressure(0))
    integers = asperity.Topography(np.arange(16).reshape(4, 4), size=1.0)
    assert integers.heights.dtype == np.float64


def test_heights_are_not_copied_where_their_layout_allows():
    heights = np.zeros((8, 8))
    assert np.shares_memory(asperity.Topography(heights, size=1.0).heights, heights)


def test_what_cannot_be_read_is_named():
    scan = Path(__file__).resolve().parents[2] / "data/topography/di-3.di"
    with pytest.raises(FileNotFoundError, match="nosuch.x3p"):
        asperity.read("nosuch.x3p")
    with pytest.raises(asperity.SurfaceError, match="`/dev/zero`: it is not a regular file"):
        asperity.read("/dev/zero")
    with pytest.raises(asperity.ArgumentError, match="`Heigth`; available channels: .*`ZSensor`"):
        asperity.read(scan, channel="Heigth")
    with pytest.raises(asperity.SurfaceError, match="complex"):
        asperity.press(np.ones((8, 8)) * 1j, size=1.0, boundary="free", loads=[0.1])


def test_sums_of_surfaces_are_sums_of_their_heights():
    upper, lower = (asperity.surface(**{**KEYS, "seed": seed}, unit="µm") for seed in (1, 2))
    both = upper + lower.mirror()
    assert np.array_equal(both, upper.heights + lower.heights[::-1])
    assert (both.size, both.unit, both.is_periodic) == (upper.size, "µm", True)
    assert np.array_equal((both - upper).mirror(), both.heights[::-1] - upper.heights[::-1])
    assert np.array_equal(np.float64(0.5) * -upper, upper.heights / -2) and np.array_equal(upper / -2, upper * -0.5)
    patch = asperity.Topography(upper.values, size=2.0, unit="µm")
    assert not (upper + patch).is_periodic


def test_twice_the_surface_is_pressed_to_twice_the_pressure():
    rough = asperity.surface(**KEYS)
    once, twice = (asperity.press(map, loads=[0.1]) for map in (rough, rough + rough))
    assert np.allclose(twice.pressure(0), 2.0 * once.pressure(0), rtol=1e-9, atol=0.0)


@pytest.mark.parametrize("changed, named", [
    (dict(nodes=32), r"numbers of nodes differ: \(64, 64\) and \(32, 32\)"),
    (dict(side=1.0), r"sizes differ: \(2.0, 2.0\) and \(1.0, 1.0\)"),
    (dict(unit="m"), "units differ: 'µm' and 'm'"),
])
def test_surfaces_that_do_not_match_are_not_added(changed, named):
    upper, lower = (asperity.surface(**{**KEYS, "unit": "µm", **keys}) for keys in ({}, changed))
    with pytest.raises(ValueError, match=named):
        upper + lower
    with pytest.raises(ValueError, match="cannot be subtracted"):
        upper - lower


def test_arrays_have_no_size_and_are_not_added_to_a_surface():
    rough = asperity.surface(**KEYS)
    for add in (lambda: rough + rough.values, lambda: rough.values + rough, lambda: rough * rough, lambda: rough + 1.0):
        with pytest.raises(TypeError):
            add()
    assert np.max(rough) == rough.heights.max()
