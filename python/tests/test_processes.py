"""Tests forked processes and the number of threads."""

import multiprocessing
import subprocess
import sys

import numpy as np
import pytest

import asperity


def threads():
    """Returns the number of threads of this process."""
    with open("/proc/self/status", encoding="ascii") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("Threads:"))


def forked(work):
    """Runs work in a forked process and returns its result; fails after 20 seconds."""
    context = multiprocessing.get_context("fork")
    answers = context.Queue()
    child = context.Process(target=lambda: answers.put(work()), daemon=True)
    child.start()
    try:
        return answers.get(timeout=20)
    finally:
        child.kill()
        child.join()


def test_a_forked_process_reads_what_its_parent_has_read(finished):
    area = "select max(load) as load from contact"
    before = finished.sql(area)["load"].tolist()
    assert forked(lambda: finished.sql(area)["load"].tolist()) == before
    assert forked(lambda: len(finished.table("contact"))) == len(finished.table("contact"))
    finished.report()
    assert forked(lambda: finished.report().page.exists())
    finished.claims()
    assert forked(lambda: len(finished.claims())) == len(finished.claims())
    assert forked(lambda: finished.run(progress=False).computed) == 0


def test_a_forked_process_goes_on_with_a_contact():
    # This mesh is large enough for threads to share the work.
    rough = asperity.surface(nodes=512, hurst=0.8, k_lower=4, k_upper=64)
    idle = threads()
    contact = asperity.press(rough, loads=[0.01], jobs=3)
    gap = contact.gap(0)
    assert np.array_equal(forked(lambda: contact.gap(0)), gap)
    forked(lambda: asperity.press(rough, loads=[0.01], jobs=3).area[0])
    assert threads() <= idle + 1, "no thread outlives its call"


@pytest.mark.parametrize("jobs", [0, 1025, 100_000])
def test_jobs_are_bounded_as_on_the_command_line(study, jobs):
    with pytest.raises(asperity.ArgumentError, match=f"`jobs` is {jobs}, but must be from 1 to 1024"):
        study.run(jobs=jobs, progress=False)
    rough = asperity.surface(nodes=32, hurst=0.8, k_lower=1, k_upper=8)
    with pytest.raises(asperity.ArgumentError, match="from 1 to 1024"):
        asperity.press(rough, loads=[0.1], jobs=jobs)


def test_a_panic_of_polars_is_an_error_in_plain_words_without_a_trace(finished):
    code = f"""\
import asperity
study = asperity.Study({str(finished.path)!r}, data={str(finished.data)!r})
try:
    study.sql("select greatest() as g from contact")
except asperity.errors.QueryError as error:
    print(error)
"""
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.startswith("polars cannot answer this query"), result
    assert result.stderr == ""
