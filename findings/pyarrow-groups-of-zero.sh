#!/usr/bin/env bash
# PyArrow 26.0.1: 0.0 and -0.0 are two groups of `group_by`, and `join` does not match them.
#
# Guess: one group, since 0.0 == -0.0, as in pandas, Polars, DuckDB and DataFusion.
# Seen on 2026-11-29: three states at the approaches -0.04, 0.02 and 0.31, rounded to one digit, are
# three groups (-0.0, 0.0 and 0.3), and a join with a table of the approaches 0.0 and 0.3 finds two
# of the three. The filter `approach == 0` finds both zeros. chDB 4.4.0 and Daft 0.7.26 group in the
# same way.
#
# Rounding to a common grid is the usual step before two programs or two meshes are compared. A
# state just below zero becomes -0.0 and drops out of the comparison, or makes a second mean for the
# same approach.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check pyarrow==26.0.1 numpy==2.4.6
seen=$("$folder/python/bin/python" - <<'PYTHON'
import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

approach = np.round([-0.04, 0.02, 0.31], 1)
states = pa.table({"approach": approach, "area": [0.10, 0.11, 0.30]})
other = pa.table({"approach": [0.0, 0.3], "area of the other": [0.105, 0.31]})
groups = states.group_by("approach").aggregate([("area", "mean")])
print(*sorted(str(group) for group in groups["approach"].to_pylist()))
print(states.join(other, "approach", join_type="inner").num_rows)
print(states.filter(pc.field("approach") == 0).num_rows)
PYTHON
)
echo "$seen"
test "$seen" = "-0.0 0.0 0.3
2
2"
