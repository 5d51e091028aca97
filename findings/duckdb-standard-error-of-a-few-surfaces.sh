#!/usr/bin/env bash
# DuckDB 2.0.1: `sem(x)`, the standard error of the mean, divides by n instead of n - 1.
#
# Guess: `stddev(x) / sqrt(count(x))`, as in SciPy and pandas; `stddev` of DuckDB is that of a
# sample.
# Seen on 2026-11-29: five contact areas have a standard error of 0.00194 in place of 0.00217, two
# areas 0.00071 in place of 0.00100, and a single area an error of exactly 0 in place of none.
#
# A study averages over few surfaces, since each is a long computation. Error bars of two surfaces
# are 29 % too short, and in a weighted fit a single surface counts as known exactly.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check duckdb==2.0.1
seen=$("$folder/python/bin/python" - <<'PYTHON'
import duckdb

areas = [0.048, 0.050, 0.055, 0.058, 0.0465]
for count in 5, 2, 1:
    rows = ", ".join(f"({area})" for area in areas[:count])
    select = "sem(area::double), stddev(area::double) / sqrt(count(*))"
    error, right = duckdb.sql(f"select {select} from (values {rows}) t(area)").fetchall()[0]
    print(count, f"{error:.5f}", right if right is None else f"{right:.5f}")
PYTHON
)
echo "$seen"
test "$seen" = "5 0.00194 0.00217
2 0.00071 0.00100
1 0.00000 None"
