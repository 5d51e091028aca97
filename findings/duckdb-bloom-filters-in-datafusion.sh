#!/usr/bin/env bash
# DataFusion 55.0.0 finds no row with `pressure = 0` in a Parquet file of DuckDB 2.0.1 whose zeros
# are -0.0.
#
# Guess: 0 = -0, so both programs find the 4000 rows, as they do in files of PyArrow and Polars.
# Seen on 2026-11-29: DuckDB finds 4000 of 10000 rows, DataFusion none. DuckDB writes a Bloom filter
# for a column of few values, and the filter knows the bytes of -0.0 only. DataFusion asks it for
# the bytes of 0.0 and skips the row groups. It finds all 4000 with
# `datafusion.execution.parquet.bloom_filter_on_read` off.
#
# A pressure that changes its sign between two conventions, or a small negative number that is
# rounded, is -0.0. The nodes out of contact are then missing in counts, while `pressure <= 0` finds
# them.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check \
    duckdb==2.0.1 datafusion==55.0.0 pyarrow==26.0.1 numpy==2.4.6
seen=$("$folder/python/bin/python" - "$folder/nodes.parquet" <<'PYTHON'
import sys

import datafusion
import duckdb
import numpy as np
import pyarrow as pa

tension = np.where(np.arange(10000) < 4000, 0.0, -1.0)
nodes = pa.table({"pressure": -tension})
duckdb.sql(f"copy (select * from nodes) to '{sys.argv[1]}' (format parquet)")

context = datafusion.SessionContext()
context.register_parquet("nodes", sys.argv[1])
for where in "pressure = 0.0", "pressure <= 0.0":
    count = "select count(*) as n from"
    found = duckdb.sql(f"{count} '{sys.argv[1]}' where {where}").fetchall()[0][0]
    print(where, found, context.sql(f"{count} nodes where {where}").to_pydict()["n"][0])
context.sql("set datafusion.execution.parquet.bloom_filter_on_read = false").collect()
context.register_parquet("again", sys.argv[1])
without = context.sql(f"{count} again where pressure = 0.0")
print("without the filter", without.to_pydict()["n"][0])
PYTHON
)
echo "$seen"
test "$seen" = "pressure = 0.0 4000 0
pressure <= 0.0 4000 4000
without the filter 4000"
