"""Fixtures: files of the repository, and a small study in a temporary folder."""

from pathlib import Path

import pytest

import asperity

REPOSITORY = Path(__file__).resolve().parents[2]

MANIFEST = """\
[study]
name = "small"
claims = "yastrebov-2015"
seed = 2015

[stage.surfaces]
kind = "generate"
nodes = 64
side = 2.0
hurst = 0.8
k_lower = 1
k_upper = 4
rms_slope = 0.1
realizations = 2

[stage.contact]
kind = "solve"
from = "surfaces"
effective_modulus = 3.0
loads = [0.01, 0.1, 0.5]
pressures = "all"
"""


@pytest.fixture
def repository():
    return REPOSITORY


@pytest.fixture
def study(tmp_path):
    """Returns a study that has not run."""
    path = tmp_path / "small.toml"
    path.write_text(MANIFEST)
    return asperity.Study(path, data=tmp_path / "data")


@pytest.fixture
def finished(study):
    """Returns the same study after a run."""
    study.run(progress=False)
    return study
