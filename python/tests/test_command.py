"""Tests that the command of the Python package behaves like the program."""

import os
import shutil
import signal
import subprocess
import sys
import time

import pytest

import asperity

COMMAND = shutil.which("asperity", path=os.path.dirname(sys.executable))


def run(*words, **options):
    return subprocess.run([sys.executable, "-m", "asperity", *words], capture_output=True, text=True, **options)


def test_it_has_the_version_of_the_module():
    assert run("--version").stdout == f"asperity {asperity.__version__}\n"


@pytest.mark.parametrize("words, code", [
    (["--version"], 0),
    (["--help"], 0),
    (["chek"], 2),
    (["check", "nothing.toml"], 2),
    (["show", "0123456789"], 1),
])
def test_exit_codes_are_those_of_the_program(words, code, tmp_path):
    assert run(*words, cwd=tmp_path).returncode == code


def test_it_says_what_it_is_called(study):
    misspelt = run("run", str(study.path), "--jib", "3")
    assert "Usage: asperity run" in misspelt.stderr


def test_it_prints_to_the_last_line(study):
    checked = run("check", str(study.path))
    assert checked.returncode == 0 and "2 stages, 4 tasks\n" in checked.stdout
    assert checked.stdout.endswith("in units of E* × rms slope\n")


def test_a_reader_may_leave(finished):
    words = [sys.executable, "-m", "asperity", "--data", str(finished.data), "schema"]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    process.stdout.close()
    assert process.wait(timeout=20) == 0 and process.stderr.read() == b""


@pytest.mark.parametrize("number, code", [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_signals_end_it_as_they_end_the_program(study, number, code):
    study.path.write_text(study.path.read_text().replace("nodes = 64", "nodes = 512")
                          .replace("loads = [0.01, 0.1, 0.5]", "loads = { to = 1.0, steps = 200 }"))
    words = [sys.executable, "-m", "asperity", "--data", str(study.data), "run", str(study.path)]
    process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    time.sleep(3)
    process.send_signal(number)
    asked = time.monotonic()
    _, errors = process.communicate(timeout=20)
    assert time.monotonic() - asked < 2.0
    assert process.returncode == code
    assert "stopping; finished tasks are kept" in errors


@pytest.mark.skipif(COMMAND is None, reason="asperity is not installed")
def test_jobs_of_a_cluster_start_the_script_again(study):
    written = subprocess.run(
        [COMMAND, "--data", study.data, "submit", study.path, "--dry-run"], capture_output=True, text=True
    )
    assert COMMAND in written.stdout, written.stderr
