"""Tests tables in other libraries: rows, descriptions of columns, and shared memory."""

import pytest

import asperity

pyarrow = pytest.importorskip("pyarrow")
polars = pytest.importorskip("polars")
duckdb = pytest.importorskip("duckdb")


@pytest.fixture
def table():
    wave = asperity.surface(method="wave", nodes=32, amplitude=0.01)
    return asperity.press(wave, loads=[0.1, 0.2, 0.3]).table


def test_readers_of_arrow_have_the_same_rows(table):
    loads = [0.1, 0.2, 0.3]
    assert polars.DataFrame(table)["load"].to_list() == loads
    assert pyarrow.table(table)["load"].to_pylist() == loads
    assert table.to_pandas()["load"].tolist() == loads
    arrow = pyarrow.table(table)
    assert duckdb.sql("select load from arrow order by load").fetchall() == [(load,) for load in loads]
    assert table.to_polars()["stop"].to_list() == list(table["stop"])


def test_fields_keep_what_columns_mean(table):
    field = pyarrow.table(table).schema.field("mean_gap")
    assert field.metadata[b"unit"] == b"length"
    assert field.metadata[b"meaning"].decode() == table.column("mean_gap").meaning
    assert pyarrow.schema(table).field("load").metadata[b"role"] == b"load"


def test_units_and_meanings_are_attributes_of_a_pandas_frame(table):
    frame = table.to_pandas()
    assert frame.attrs["units"] == table.units and frame.attrs["meanings"] == table.meanings
    assert frame.attrs["units"]["load"] == "E* × rms slope"
    assert list(frame.attrs["units"]) == list(frame.columns) == table.names
    assert frame[frame["load"] > 0.1].attrs["units"]["mean_gap"] == "length"


def test_no_copy_of_ours_is_between(table):
    """Checks that readers use the memory of the table without a copy."""
    own = table._table.address("mean_gap")
    for _ in range(2):
        (chunk,) = pyarrow.table(table)["mean_gap"].chunks
        assert chunk.buffers()[1].address == own
    series = polars.DataFrame(table)["mean_gap"]
    assert series.to_numpy(allow_copy=False).ctypes.data == own


def test_a_stream_outlives_its_table(table):
    arrow = pyarrow.RecordBatchReader.from_stream(table)
    del table
    assert arrow.read_all()["load"].to_pylist() == [0.1, 0.2, 0.3]


def test_a_column_that_is_not_there_is_named(table):
    with pytest.raises(asperity.UnknownNameError, match="no column `lode`"):
        table["lode"]


def test_notebooks_show_head_and_size(table):
    shown = table._repr_html_()
    assert 'title="mean gap between the surfaces">mean_gap [length]<' in shown and "3 rows" in shown
