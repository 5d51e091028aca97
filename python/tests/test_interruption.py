"""Tests that Ctrl-C ends work within two seconds, and that other threads run during the work."""

import subprocess
import sys
import threading
import time

import pytest

import asperity

# A study that takes minutes.
LONG = """\
import asperity
study = asperity.Study.parse({
    "study": {"name": "long"},
    "stage": {
        "surfaces": {"kind": "generate", "nodes": 1024, "hurst": 0.8, "k_lower": 4, "k_upper": 256,
                     "realizations": 8},
        "contact": {"kind": "solve", "from": "surfaces", "loads": {"to": 1.0, "steps": 500}},
    },
}, data=DATA)
"""


def store_is_sound(data):
    """Checks that no stored table is damaged and that a run continues."""
    verify = [sys.executable, "-m", "asperity", "--data", data, "verify"]
    subprocess.run(verify, check=True, capture_output=True)
    assert not list(data.glob("**/*.damaged"))


def test_a_signal_ends_a_run_in_a_process(tmp_path):
    data = tmp_path / "data"
    code = LONG.replace("DATA", repr(str(data))) + "print('begun', flush=True)\nstudy.run(progress=False)\n"
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout.readline() == b"begun\n"
    time.sleep(3)
    process.send_signal(2)
    asked = time.monotonic()
    _, errors = process.communicate(timeout=20)
    assert time.monotonic() - asked < 2.5
    assert b"KeyboardInterrupt" in errors
    store_is_sound(data)


def test_the_button_of_a_notebook_ends_a_run(tmp_path):
    jupyter_client = pytest.importorskip("jupyter_client")
    pytest.importorskip("ipykernel")
    data = tmp_path / "data"
    manager, client = jupyter_client.manager.start_new_kernel()
    try:
        client.execute_interactive(LONG.replace("DATA", repr(str(data))), timeout=60)
        # Without this, the kernel drops requests right after an error.
        request = client.execute("study.run()", stop_on_error=False)
        time.sleep(4)
        manager.interrupt_kernel()
        asked = time.monotonic()
        reply = client.get_shell_msg(timeout=20)
        while reply["parent_header"].get("msg_id") != request:
            reply = client.get_shell_msg(timeout=20)
        assert time.monotonic() - asked < 2.0
        assert reply["content"]["ename"] == "KeyboardInterrupt"
        # The kernel and the study are still usable.
        after = client.execute_interactive("print(study.plan().to_run)", timeout=60)
        assert after["content"]["status"] == "ok"
    finally:
        client.stop_channels()
        manager.shutdown_kernel(now=True)
    store_is_sound(data)


def test_a_signal_ends_pressing(tmp_path):
    code = """\
import asperity
rough = asperity.surface(nodes=1024, hurst=0.8, k_lower=4, k_upper=256)
print("begun", flush=True)
asperity.press(rough, loads={"to": 1.0, "steps": 1000}, fields=False)
"""
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert process.stdout.readline() == b"begun\n"
    time.sleep(2)
    process.send_signal(2)
    asked = time.monotonic()
    _, errors = process.communicate(timeout=20)
    assert time.monotonic() - asked < 2.0
    assert b"KeyboardInterrupt" in errors


def test_another_thread_runs_while_one_presses():
    rough = asperity.surface(nodes=512, hurst=0.8, k_lower=4, k_upper=128)
    done = threading.Event()

    def press():
        asperity.press(rough, loads={"to": 0.1, "steps": 10})
        done.set()

    thread = threading.Thread(target=press)
    thread.start()
    longest, last = 0.0, time.perf_counter()
    while not done.is_set():
        time.sleep(0.001)
        now = time.perf_counter()
        longest, last = max(longest, now - last), now
    thread.join()
    # Pressing takes seconds; a thread that waits for the interpreter lock waits for one thread switch.
    assert longest < 0.5


def test_a_progress_callback_can_end_a_run(study):
    class Enough(Exception):
        pass

    def enough(_):
        raise Enough

    study.path.write_text(study.path.read_text().replace("nodes = 64", "nodes = 512")
                          .replace("loads = [0.01, 0.1, 0.5]", "loads = { to = 1.0, steps = 200 }"))
    with pytest.raises(Enough):
        study.run(progress=enough)
