"""Maps that other programs read, and maps of other programs. The conventions are measured, not assumed."""

import numpy as np
import pytest

import asperity

NODES = (6, 4)
# Sides in micrometres; the steps along x and y differ.
SIZE = (3.0, 8.0)


@pytest.fixture
def heights():
    """Returns heights in micrometres that differ at all nodes, with a missing point."""
    x, y = np.indices(NODES, dtype=float)
    heights = 0.01 * x + 0.1 * y + 0.003 * x * y
    heights[4, 1] = np.nan
    return heights


@pytest.fixture
def topography(heights):
    return asperity.Topography(heights, SIZE, unit="µm")


@pytest.fixture
def contact(tmp_path):
    """Returns a study in µm and MPa, and a file with the maps of its contact at 20 MPa."""
    path = tmp_path / "steel.toml"
    path.write_text(
        """\
[study]
name = "steel"

[stage.surfaces]
kind = "generate"
nodes = [[32, 16]]
side = [["20 um", "10 um"]]
hurst = 0.8
k_lower = 2
k_upper = 4
rms_slope = 0.01

[stage.contact]
kind = "solve"
from = "surfaces"
bodies = [{ youngs_modulus = "1 GPa", poisson_ratio = 0.3 }]
loads = ["1 MPa"]
"""
    )
    study = asperity.Study(path, data=tmp_path / "data")
    study.run(progress=False)
    file = tmp_path / "contact.gwy"
    arguments = ["export", str(path), "contact", "--data", str(tmp_path / "data"), "--output", str(file)]
    assert asperity.main(arguments) == 0
    return study, file


def test_surfacetopography_gets_the_map_as_it_is(topography, heights):
    pytest.importorskip("SurfaceTopography")
    converted = topography.to_surfacetopography()
    assert converted.physical_sizes == SIZE and converted.unit == "µm" and not converted.is_periodic
    np.testing.assert_array_equal(np.ma.filled(converted.heights(), np.nan), heights)
    # Its sides are nodes × spacing, too.
    np.testing.assert_allclose(converted.pixel_size, topography.spacing)
    back = asperity.from_surfacetopography(converted)
    assert (back.size, back.unit, back.is_periodic) == (SIZE, "µm", False)
    np.testing.assert_array_equal(back.values, heights)


def test_slopes_of_a_periodic_map_agree_with_surfacetopography():
    pytest.importorskip("SurfaceTopography")
    rough = asperity.surface([128, 64], hurst=0.8, k_lower=2, k_upper=4, rms_slope=0.05, side=(2.0, 1.0))
    converted = rough.to_surfacetopography()
    assert converted.is_periodic
    # Differences of neighbours, with 16 nodes or more in each wave.
    assert converted.rms_gradient() == pytest.approx(0.05, rel=0.01)
    back = asperity.from_surfacetopography(converted)
    assert back.is_periodic and back.statistics()["rms_slope"] == pytest.approx(0.05, rel=1e-9)


def test_views_of_surfacetopography_have_their_heights_and_unit(topography):
    pytest.importorskip("SurfaceTopography")
    view = topography.fill().to_surfacetopography().detrend("height").to_unit("nm")
    converted = asperity.from_surfacetopography(view)
    assert converted.unit == "nm" and converted.size == pytest.approx((3000.0, 8000.0))
    np.testing.assert_allclose(converted.values, 1e3 * topography.fill().detrend("plane").values, atol=1e-9)


def test_line_scans_of_surfacetopography_are_refused():
    package = pytest.importorskip("SurfaceTopography")
    line = package.UniformLineScan(np.zeros(8), 1.0)
    with pytest.raises(asperity.SurfaceError, match="line scan"):
        asperity.from_surfacetopography(line)


def test_a_file_of_gwyddion_is_read_as_the_same_map(topography, heights, tmp_path):
    path = tmp_path / "map.gwy"
    topography.to_gwy(path)
    back = asperity.read(path)
    assert back.unit == "m" and back.size == pytest.approx((3e-6, 8e-6))
    np.testing.assert_allclose(back.values, 1e-6 * heights, rtol=1e-15)
    topography.fill().to_gwy(path)
    assert asperity.read(path).missing == 0
    other = tmp_path / "notes.gwy"
    other.write_text("no map")
    with pytest.raises(asperity.ArgumentError, match="will not be overwritten"):
        topography.to_gwy(other)


def test_gwyfile_reads_the_map(topography, heights, tmp_path):
    gwyfile = pytest.importorskip("gwyfile")
    topography.to_gwy(tmp_path / "map.gwy")
    container = gwyfile.load(str(tmp_path / "map.gwy"))
    field, mask = container["/0/data"], container["/0/mask"]
    # Its arrays are [y, x].
    assert field.data.shape == NODES[::-1]
    assert (field.xreal, field.yreal) == pytest.approx((3e-6, 8e-6))
    assert field["si_unit_z"]["unitstr"] == field["si_unit_xy"]["unitstr"] == "m"
    np.testing.assert_array_equal(mask.data.T, np.isnan(heights))
    np.testing.assert_allclose(field.data.T[mask.data.T == 0], 1e-6 * heights[~np.isnan(heights)])


def test_surfacetopography_reads_the_file(topography, heights, tmp_path):
    package = pytest.importorskip("SurfaceTopography")
    topography.to_gwy(tmp_path / "map.gwy")
    read = package.read_topography(str(tmp_path / "map.gwy"))
    assert read.unit == "m" and read.physical_sizes == pytest.approx((3e-6, 8e-6))
    np.testing.assert_allclose(np.ma.filled(read.heights(), np.nan), 1e-6 * heights, rtol=1e-15)


def test_surfalize_reads_the_file(topography, heights, tmp_path):
    surfalize = pytest.importorskip("surfalize")
    topography.to_gwy(tmp_path / "map.gwy")
    read = surfalize.Surface.load(tmp_path / "map.gwy")
    # Its arrays are [y, x] in micrometres.
    np.testing.assert_allclose(read.data.T, heights, rtol=1e-12)
    assert (read.step_x, read.step_y) == pytest.approx(topography.spacing)


def test_gwyfile_reads_the_maps_of_a_contact(contact):
    gwyfile = pytest.importorskip("gwyfile")
    study, path = contact
    container = gwyfile.load(str(path))
    titles = {container[f"/{number}/data/title"]: number for number in range(4)}
    assert titles == {"height": 0, "pressure": 1, "gap": 2, "displacement": 3}
    units = {}
    for title, number in titles.items():
        field = container[f"/{number}/data"]
        assert field.data.shape == (16, 32)
        assert (field.xreal, field.yreal) == pytest.approx((20e-6, 10e-6))
        assert field["si_unit_xy"]["unitstr"] == "m"
        units[title] = field["si_unit_z"]["unitstr"]
    assert units == {"height": "m", "pressure": "Pa", "gap": "m", "displacement": "m"}
    pressure, gap = container["/1/data"].data, container["/2/data"].data
    assert pressure.mean() == pytest.approx(1e6, rel=1e-9)
    np.testing.assert_array_equal(container["/0/mask"].data, pressure > 0)
    assert not np.any((pressure > 0) & (gap > 0))
    of_study = study.pressure("contact", load="1 MPa")
    np.testing.assert_allclose(pressure.T, 1e6 * np.asarray(of_study), rtol=1e-12)


def test_other_programs_take_nodes_in_contact_for_missing_heights(contact):
    package, surfalize = pytest.importorskip("SurfaceTopography"), pytest.importorskip("surfalize")
    study, path = contact
    area = float(np.mean(np.asarray(study.pressure("contact", load="1 MPa")) > 0))
    channels = {channel.name: channel for channel in package.open_topography(str(path)).channels}
    assert list(channels) == ["height", "gap", "displacement"]
    heights, gap = channels["height"].topography(), channels["gap"].topography()
    assert heights.physical_sizes == pytest.approx((20e-6, 10e-6))
    assert np.ma.getmaskarray(heights.heights()).mean() == pytest.approx(area)
    assert not gap.has_undefined_data
    assert np.mean(gap.heights() == 0) == pytest.approx(area, abs=0.02)
    assert np.isnan(surfalize.Surface.load(path).data).mean() == pytest.approx(area)
    # Without the mask all heights are there.
    assert asperity.read(path, mask=False).missing == 0
