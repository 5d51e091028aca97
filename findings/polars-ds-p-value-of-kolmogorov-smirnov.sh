#!/usr/bin/env bash
# polars_ds 0.13.0: the field `pvalue` of `ks_2samp` is the critical distance of the test, not a p
# value.
#
# Guess: a p value, as the name says and as the t test and other tests of the package return in this
# field.
# Seen on 2026-11-29: 200 heights and the same heights 3 standard deviations higher: statistic 0.90,
# `pvalue` 0.136 (SciPy 5e-86). It depends on the numbers of values alone: 0.136 for two samples of
# the same kind, too, and 0.027 for 5000 heights each. The docstring calls it a threshold for the
# statistic.
#
# With `pvalue < 0.05`, as for any other test, no samples of fewer than 1476 heights differ,
# whatever they are, and all larger ones do: a map always differs from its copy with other noise.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/python"
"$folder/python/bin/pip" install --quiet --disable-pip-version-check \
    polars_ds==0.13.0 polars==2.1.0 numpy==2.4.6 scipy==1.17.1
seen=$("$folder/python/bin/python" - <<'PYTHON'
import numpy as np
import polars as pl
import polars_ds as pds
from scipy import stats

random = np.random.default_rng(0)
for count in 200, 1475, 1476, 5000:
    heights = random.normal(size=count)
    for name, other in ("same", random.normal(size=count)), ("higher", heights + 3):
        samples = pl.DataFrame({"a": heights, "b": other})
        test = samples.select(pds.ks_2samp("a", "b")).to_series()[0]
        right = stats.ks_2samp(heights, other).pvalue
        print(count, name, f"{test['pvalue']:.5f}", right < 0.05)
PYTHON
)
echo "$seen"
test "$seen" = "200 same 0.13581 False
200 higher 0.13581 True
1475 same 0.05001 False
1475 higher 0.05001 True
1476 same 0.04999 False
1476 higher 0.04999 True
5000 same 0.02716 False
5000 higher 0.02716 True"
