"""Opens every table of results with polars, pandas and DuckDB. All must agree and find the meaning of each
column."""

import json
import sys
from pathlib import Path

import duckdb
import pandas as pd
import polars as pl
import pyarrow.parquet as pq

tables = sorted(Path(sys.argv[1], "results").glob("*/*.parquet"))
assert len(tables) >= 6, tables
for path in tables:
    by_polars = pl.read_parquet(path)
    by_pandas = pd.read_parquet(path)
    by_duckdb = duckdb.sql(f"select * from '{path}'")
    assert by_polars.columns == list(by_pandas.columns) == by_duckdb.columns, path
    rows = len(by_polars)
    assert rows == len(by_pandas) == len(by_duckdb) > 0, path
    assert "task" in by_polars.columns, path
    assert not {"heights", "contact", "pressures"} & set(by_polars.columns), path
    for name, kind in by_polars.schema.items():
        assert kind in (pl.Float64, pl.Int64, pl.Boolean, pl.String), (path, name, kind)
        if kind == pl.Float64:
            mean = duckdb.sql(f'select avg("{name}") from \'{path}\'').fetchall()[0][0]
            assert mean is None or abs(mean - by_pandas[name].mean()) <= 1e-9 * abs(mean) + 1e-300, (path, name)
    fields = [
        {"name": field.name} | {key.decode(): value.decode() for key, value in field.metadata.items()}
        for field in pq.read_schema(path)
    ]
    for field in fields:
        if "codes" in field:
            field["codes"] = json.loads(field["codes"])
    for field in fields:
        # The unit as it is declared, such as `pressure` beside `MPa`.
        field.pop("dimension", None)
        # The column whose reduced numbers this one has in the units of the study.
        field.pop("reduced", None)
        # The role in the tables of single surfaces, and labels, which only published tables have.
        field.pop("role_of_tasks", None)
        field.pop("added", None)
    for column in json.loads(pl.read_parquet_metadata(path)["asperity.columns"]):
        assert column.pop("type"), (path, column)
        assert column["meaning"] and column == fields.pop(0), (path, column)
    assert not fields, (path, fields)
    [(told,)] = duckdb.sql(
        f"select decode(value) from parquet_kv_metadata('{path}') where decode(key) = 'asperity.columns'"
    ).fetchall()
    assert told == pl.read_parquet_metadata(path)["asperity.columns"], path
    print(f"{path}: {rows} rows × {by_polars.width} columns")
