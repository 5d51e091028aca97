"""Tests the examples in docstrings and pages, and the types of a user script."""

import doctest
import importlib
import inspect
import os
import pkgutil
import re
import subprocess
import sys

import pytest

import asperity

FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE
MODULES = [
    f"asperity.{module.name}"
    for module in pkgutil.iter_modules(asperity.__path__)
    if module.name not in ("__main__", "_asperity")
]


@pytest.mark.parametrize("name", ["asperity", *MODULES])
def test_examples_of_docstrings_run(name, repository, monkeypatch):
    monkeypatch.chdir(repository)
    failed, tried = doctest.testmod(importlib.import_module(name), optionflags=FLAGS)
    assert failed == 0
    assert tried > 0 or name.rsplit(".", 1)[-1] in WITHOUT_EXAMPLES


# Names without functions that users call.
WITHOUT_EXAMPLES = {"errors", "_contact", "_plan", "_arrays", "_command", "_picture", "_progress"}


@pytest.mark.parametrize("name", [name for name in asperity.__all__ if name != "__version__"])
def test_everything_public_is_explained(name):
    thing = getattr(asperity, name)
    assert inspect.getdoc(thing)
    if inspect.isclass(thing) and not issubclass(thing, (Exception, tuple)):
        for method, value in vars(thing).items():
            if not method.startswith("_") and (callable(value) or isinstance(value, (property, classmethod))):
                assert inspect.getdoc(getattr(thing, method)), f"{name}.{method}"


def test_the_page_runs_block_by_block(repository, tmp_path):
    page = (repository / "docs/how-to/python.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```", page, re.M | re.S)
    assert len(blocks) > 5
    for shared in ["data/topography", "manifests"]:
        (tmp_path / shared).parent.mkdir(exist_ok=True)
        (tmp_path / shared).symlink_to(repository / shared)
    environment = {**os.environ, "MPLBACKEND": "agg"}
    subprocess.run([sys.executable, "-c", "\n".join(blocks)], cwd=tmp_path, env=environment, check=True)


def test_a_script_of_a_user_has_types(repository):
    pytest.importorskip("mypy")
    checked = subprocess.run([sys.executable, "-m", "mypy"], cwd=repository, capture_output=True, text=True)
    assert checked.returncode == 0, checked.stdout


def test_types_are_those_of_the_extension(repository, tmp_path):
    pytest.importorskip("mypy")
    words = ["-m", "mypy.stubtest", "asperity", "--mypy-config-file", repository / "pyproject.toml"]
    checked = subprocess.run([sys.executable, *words], cwd=tmp_path, capture_output=True, text=True)
    assert checked.returncode == 0, checked.stdout


def test_a_script_of_a_user_runs(repository):
    subprocess.run([sys.executable, repository / "python/tests/user_script.py"], check=True)
