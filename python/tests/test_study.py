"""Tests the class Study."""

import subprocess
import sys
import warnings

import numpy as np
import pytest

import asperity


def test_a_study_runs_once(study):
    assert study.plan().to_run == 4
    assert "small" in study.check()
    advances = []
    assert study.run(progress=advances.append).computed == 4
    assert repr(study.run(progress=False)) == "<asperity.Run of small: nothing to do>"
    assert study.plan().to_run == 0
    assert all(0 <= advance["share"] <= 1 for advance in advances) and advances


def test_tables_can_be_asked(finished):
    assert len(finished.table("contact")) == 6
    assert list(finished.sql("select count(*) as n from contact")["n"]) == [6]
    assert {column.name for column in finished.columns("contact")} == set(finished.table("contact").names)
    assert set(finished.columns()) == {"surfaces", "contact"}
    assert len(finished.failures()) == 0
    assert {claim["verdict"] for claim in finished.claims()} >= {"noted", "not computed"}
    assert finished.report().page.is_file()
    assert "finished" in finished.explain()


def test_errors_of_means_have_intervals(finished):
    (mean,) = finished.errors("contact", "mean_gap")["means"]
    assert len(mean["loads"]) == 3 and mean["unknown"] == ["mesh", "cell", "solver"]
    for load in mean["loads"]:
        (sampling,) = load["terms"]
        lower, upper = sampling["interval"]
        assert sampling["term"] == "sampling" and lower == -upper < 0
    with pytest.raises(asperity.UnknownNameError):
        finished.errors("nothing")


def test_a_study_equals_itself(finished):
    comparison = finished.diff(finished)
    assert comparison.equal and repr(comparison).endswith("A and B are equal")
    assert [stage["equal"] for stage in comparison.details["studies"][0]["stages"]] == [True, True]
    assert not np.any(comparison.means["difference"])


def test_differences_are_those_of_the_means(finished, tmp_path):
    text = finished.path.read_text().replace("[stage.contact]", "[stage.contact]\ntolerance = 0.01")
    loose = asperity.Study.parse(text, data=tmp_path / "loose")
    loose.run(progress=False)
    comparison = finished.diff(loose)
    assert not comparison.equal and "tolerance" in repr(comparison)
    means = comparison.means
    is_gap = [(stage, column) == ("contact", "mean_gap") for stage, column in zip(means["stage"], means["column"])]
    average = "select load, avg(mean_gap) as gap from contact group by load order by load"
    before, after = (study.sql(average) for study in (finished, loose))
    assert np.array_equal(means["load"][is_gap], before["load"])
    differences = after["gap"] - before["gap"]
    assert np.any(differences) and np.allclose(means["difference"][is_gap], differences, rtol=1e-6, atol=1e-15)


def test_a_mistake_has_file_line_and_column(study):
    study.path.write_text(study.path.read_text().replace("hurst = 0.8", "hurst = 1.8"))
    with pytest.raises(asperity.ManifestError) as caught:
        study.check()
    error = caught.value
    assert (error.file, error.line, error.column) == (str(study.path), 10, 9)
    assert "1.8" in error.problems[0].message and "small.toml:10:9" in str(error)
    assert isinstance(error, asperity.Error) and isinstance(error, ValueError)
    assert "<pre>" in study._repr_html_()


@pytest.mark.parametrize("wrong, error", [
    (lambda study: study.table("contacts"), asperity.UnknownNameError),
    (lambda study: study.table("contact"), asperity.NotComputedError),
    (lambda study: study.sql("select load, from contact where"), asperity.QueryError),
    (lambda study: study.sql("select load from contacts"), asperity.UnknownNameError),
    (lambda study: study.run(jobs=0, progress=False), asperity.ArgumentError),
    (lambda study: study.run(memory="much", progress=False), asperity.ArgumentError),
    (lambda study: study.run(memory="1KB", progress=False), asperity.Error),
])
def test_what_cannot_be_done_has_an_exception_of_its_own(study, wrong, error):
    with pytest.raises(error):
        wrong(study)


def test_a_damaged_table_is_an_error_of_the_store_and_computed_again(finished):
    (path,) = finished.data.glob("results/small/contact.parquet")
    for stored in finished.data.glob("store/**/*.parquet"):
        stored.unlink()
    damaged = bytearray(path.read_bytes())
    damaged[len(damaged) // 3] ^= 1
    path.write_bytes(damaged)
    with pytest.raises(asperity.StoreError):
        finished.table("contact")
    with pytest.warns(asperity.StudyWarning):
        finished.run(progress=False)
    assert len(finished.table("contact")) == 6


def test_tables_of_a_manifest_are_one(tmp_path, study):
    text = study.path.read_text()
    parsed = asperity.Study.parse(text, data=tmp_path / "other")
    assert parsed.path == tmp_path / "other" / "small.toml"
    tables = {
        "study": {"name": "small"},
        "stage": {"surfaces": {"kind": "generate", "nodes": 32, "hurst": 0.8, "k_lower": 1, "k_upper": 2}},
    }
    assert asperity.Study.parse(tables, data=tmp_path / "other").plan().to_run == 1
    with pytest.raises(asperity.ManifestError, match="hurst"):
        asperity.Study.parse(text.replace("0.8", "'rough'"), data=tmp_path)
    with pytest.raises(FileExistsError):
        asperity.Study.parse(text + "# new", data=tmp_path, path=study.path)


def test_what_should_be_known_is_a_warning(study):
    study.path.write_text(study.path.read_text().replace("loads = [0.01, 0.1, 0.5]", "loads = [0.01]"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        study.run(progress=False)
    study.path.write_text(study.path.read_text().replace("realizations = 2", "realizations = 3"))
    with pytest.warns(asperity.StudyWarning, match="incomplete"):
        study.table("contact")


@pytest.mark.parametrize("keys, named", [
    (dict(nodes=64, hurst=1.5, k_lower=2, k_upper=16), "hurst"),
    (dict(nodes=64, hurst=float("nan"), k_lower=2, k_upper=16), "hurst"),
    (dict(nodes=16, hurst=0.5, k_lower=2, k_upper=16), "k_upper"),
    (dict(nodes=64, hurst=0.5, k_lower=2, k_upper=16, rms_slop=1.0), "rms_slop"),
    (dict(nodes=64, hurst=[0.5, 0.6], k_lower=2, k_upper=16), "2 surfaces"),
])
def test_arguments_of_surfaces_are_checked_as_keys_are(keys, named):
    with pytest.raises(asperity.ArgumentError, match=named):
        asperity.surface(**keys)


def test_arguments_of_contacts_are_checked_as_keys_are():
    rough = asperity.surface(nodes=32, hurst=0.8, k_lower=1, k_upper=8)
    for wrong in [dict(loads=[0.1, -0.2]), dict(loads=-1.0), dict(loads=[]), dict(),
                  dict(loads=0.1, pressures=0.1), dict(loads=0.1, tolerance=2.0), dict(loads=0.1, size=2.0),
                  dict(loads=0.1, boundary="open"), dict(loads=0.1, hardness=0.05)]:
        with pytest.raises(asperity.Error):
            asperity.press(rough, **wrong)


@pytest.mark.parametrize("press", [asperity.press, asperity.press_each])
def test_an_array_is_pressed_with_its_size_and_boundary(press):
    heights = asperity.surface(nodes=32, hurst=0.8, k_lower=1, k_upper=8).heights.filled()
    with pytest.raises(TypeError, match="write `size=1.0`"):
        press(heights, loads=0.1, boundary="periodic")
    with pytest.raises(TypeError, match='write `boundary="periodic"`'):
        press(heights, loads=0.1, size=1.0)
    with pytest.raises(TypeError, match="give either `loads`"):
        press(heights, size=1.0, boundary="free")
    assert issubclass(asperity.MissingArgumentError, asperity.ArgumentError)
    assert list(press(heights, loads=0.1, size=1.0, boundary="free"))


def test_a_map_that_is_not_periodic_is_pressed_free_alone(repository):
    scan = asperity.read(repository / "data/topography/testing.x3p")
    with pytest.raises(asperity.SurfaceError, match="not periodic"):
        asperity.press(scan, loads=0.1)


def test_missing_points_are_named_and_filled():
    heights = asperity.surface(nodes=32, hurst=0.8, k_lower=1, k_upper=8).heights.copy()
    heights[3:6, 4] = float("nan")
    holey = asperity.Topography(heights, size=1.0)
    assert holey.missing == 3 and holey.heights.mask.sum() == 3
    with pytest.raises(asperity.SurfaceError, match="3 points are missing"):
        asperity.press(holey, loads=0.1, boundary="free")
    assert holey.fill("nearest").missing == 0


def test_errors_of_an_instrument_are_repaired():
    clean = asperity.surface(nodes=64, hurst=0.8, k_lower=1, k_upper=8)
    heights = clean.values + np.sin(7.0 * np.arange(64) ** 2)
    aligned = asperity.Topography(heights, size=1.0).align("differences")
    expected = asperity.Topography(clean.values, size=1.0).align("differences")
    # The mean height stays, so that the maps differ by a constant.
    assert np.ptp((aligned - expected).values) < 1e-12
    heights = clean.values.copy()
    heights[10, 20] += 1.0
    heights[30:40, 30:40] = float("nan")
    heights[35, 35] = 1.0
    damaged = asperity.Topography(heights, size=1.0)
    left = damaged.remove_spikes(10.0).remove_islands(1)
    assert left.missing == damaged.missing + 2 and left.heights.mask[10, 20] and left.heights.mask[35, 35]
    through = clean.level_through((0, 0), (0.5, 0), (0, 0.5)).values
    assert max(abs(through[0, 0]), abs(through[32, 0]), abs(through[0, 32])) < 1e-15
    for repair, wrong in [("align", {"by": "mean"}), ("align", {"degree": 9}), ("remove_spikes", {"window": 4})]:
        with pytest.raises(asperity.ArgumentError):
            getattr(damaged, repair)(**wrong)
    with pytest.raises(asperity.SurfaceError, match="`b` was not measured"):
        damaged.level_through((0, 0), (0.5, 0.5), (0, 0.5))


def test_files_that_are_none_are_named(tmp_path):
    (tmp_path / "text.x3p").write_text("no heights")
    with pytest.raises(asperity.SurfaceError):
        asperity.read(tmp_path / "text.x3p")
    with pytest.raises(FileNotFoundError):
        asperity.read(tmp_path / "gone.x3p")


def run_in_a_process(study, arguments=""):
    """Runs a study in a process whose standard error is a pipe, and returns the lines of standard error."""
    code = f"import asperity; asperity.Study({str(study.path)!r}, data={str(study.data)!r}).run({arguments})"
    finished = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert finished.stdout == ""
    return finished.stderr.splitlines()


def test_progress_is_lines_of_the_command_if_standard_error_is_no_terminal(study, tmp_path):
    lines = run_in_a_process(study)
    assert lines == ["small: 4 tasks to run, 0 finished"]
    command = [sys.executable, "-m", "asperity", "--data", tmp_path / "other", "run", study.path]
    printed = subprocess.run(command, capture_output=True, text=True, check=True).stderr
    assert printed.splitlines() == lines
    assert run_in_a_process(study) == []


def test_progress_can_be_hidden(study):
    assert run_in_a_process(study, "progress=False") == []


def test_the_last_state_of_a_run_is_its_end(study):
    advances = []
    study.run(progress=advances.append)
    assert advances[-1]["tasks_done"] == advances[-1]["tasks"] == 4
    assert advances[-1]["text"] == "4 of 4 tasks, 0 s left"
    assert {advance["batch"] for advance in advances} == {"small: 4 tasks to run, 0 finished"}


def test_settings_override_keys_and_leave_the_file(study):
    text = study.path.read_text()
    more = asperity.Study(
        study.path, data=study.data, set={"stage.surfaces.realizations": 3, "stage.contact.loads": np.array([0.1, 0.2])}
    )
    assert study.run(progress=False).computed == 4
    assert more.run(progress=False).computed == 4, "two surfaces are stored, and their loads of 0.2 are not"
    assert sorted(more.table("contact")["load"]) == [0.1] * 3 + [0.2] * 3
    assert study.path.read_text() == text and "realizations" in repr(more)
    with pytest.raises(asperity.ArgumentError, match="is not a key"):
        asperity.Study(study.path, set={"stage surfaces": 3})
    with pytest.raises(asperity.ManifestError, match="realisations"):
        asperity.Study(study.path, set={"stage.surfaces.realisations": 3}).check()


def test_tables_of_a_listed_store_are_not_computed_again(finished, tmp_path):
    own = tmp_path / "own"
    own.mkdir()
    (own / "asperity.toml").write_text('stores = ["../data"]\n')
    above = asperity.Study(finished.path, data=own)
    assert above.plan().to_run == 0
    assert above.run(progress=False).computed == 0
    assert above.table("contact").to_pandas().equals(finished.table("contact").to_pandas())
