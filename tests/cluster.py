"""Runs studies by `asperity submit` on a Slurm cluster of two nodes, both on this machine.

`python3 tests/cluster.py PROGRAM [WHAT …]` starts the cluster, which needs root, `slurm-wlm` and `munge`. It
compares the tables of each study with those of a plain run: undisturbed, with variables of Slurm in the user's
environment, with a node that fails, with a cancelled element, and with a full disk. One of the nodes uses AVX2.
"""

import json
import os
import shutil
import socket
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
PATIENCE = 120


def output(*command, **options):
    """Returns the output of a command, which must succeed."""
    done = subprocess.run(command, capture_output=True, text=True, check=False, **options)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(map(str, command))}: {done.returncode}\n{done.stdout}{done.stderr}")
    return done.stdout


def wait_until(what, is_so):
    """Waits until a condition is true."""
    until = time.monotonic() + PATIENCE
    while not is_so():
        if time.monotonic() > until:
            raise SystemExit(f"{what}: not within {PATIENCE} s\n{output('squeue', '--array')}{output('sinfo', '-N')}")
        time.sleep(0.2)


def free_ports(count):
    """Returns unused ports."""
    sockets = [socket.socket() for _ in range(count)]
    for one in sockets:
        one.bind(("127.0.0.1", 0))
    ports = [one.getsockname()[1] for one in sockets]
    for one in sockets:
        one.close()
    return ports


class Cluster:
    """A Slurm controller and two nodes, with their files in a folder."""

    def __init__(self, folder):
        self.folder = folder
        controller, first, second = free_ports(3)
        names = {
            "HOST": socket.gethostname().split(".")[0],
            "FOLDER": str(folder),
            "CONTROLLER": str(controller),
            "FIRST": str(first),
            "SECOND": str(second),
        }
        text = (HERE / "cluster/slurm.conf").read_text()
        lines = [line for line in text.splitlines() if not line.startswith("#")]
        for name, value in names.items():
            lines = [line.replace(name, value) for line in lines]
        (folder / "slurm.conf").write_text("\n".join(lines) + "\n")
        for inner in ("controller", "n1", "n2"):
            (folder / inner).mkdir()
        os.environ["SLURM_CONF"] = str(folder / "slurm.conf")
        munge()
        output("slurmctld")
        for node in ("n1", "n2"):
            self.start(node)

    def start(self, node):
        """Starts a node and waits until it is available."""
        output("slurmd", "-N", node)
        wait_until(f"{node} is idle", lambda: self.state(node) == "idle")

    @staticmethod
    def state(node):
        """Returns the state of a node from Slurm."""
        told = subprocess.run(["sinfo", "-h", "-n", node, "-o", "%T"], capture_output=True, text=True, check=False)
        return told.stdout.strip()

    def kill(self, node):
        """Kills a node and all its processes, like a power failure."""
        daemon = int((self.folder / f"{node}.pid").read_text())
        stop(daemon)
        for process in steps_of(node):
            stop(process)

    def stop(self):
        """Stops the cluster."""
        for name in ("n1", "n2", "controller"):
            try:
                daemon = int((self.folder / f"{name}.pid").read_text())
                os.kill(daemon, signal.SIGTERM)
                wait_until(f"{name} has ended", lambda: not Path(f"/proc/{daemon}").exists())
            except (OSError, ValueError):
                pass


def munge():
    """Starts the daemon that authenticates users for Slurm, with its own key."""
    if subprocess.run(["pgrep", "-x", "munged"], capture_output=True, check=False).returncode == 0:
        return
    os.makedirs("/run/munge", exist_ok=True)
    shutil.chown("/run/munge", "munge", "munge")
    key = Path("/etc/munge/munge.key")
    if not key.exists():
        key.write_bytes(os.urandom(1024))
    shutil.chown(key, "munge", "munge")
    key.chmod(0o400)
    output("su", "-s", "/bin/sh", "munge", "-c", "munged")


def steps_of(node):
    """Returns the processes of a node of this cluster, found by its name and the configuration."""
    found = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        try:
            known = (entry / "environ").read_bytes().split(b"\0")
            name = (entry / "comm").read_text().strip()
        except OSError:
            continue
        own = f"SLURM_CONF={os.environ['SLURM_CONF']}".encode() in known
        if own and (f"SLURMD_NODENAME={node}".encode() in known or name == "slurmstepd"):
            if name != "slurmstepd" or node_of_step(entry.name) == node:
                found.append(int(entry.name))
    return found


def node_of_step(process):
    """Returns the node of a `slurmstepd`, from a process that it has started."""
    try:
        children = Path(f"/proc/{process}/task/{process}/children").read_text().split()
    except OSError:
        return None
    for child in children:
        try:
            for word in Path(f"/proc/{child}/environ").read_bytes().split(b"\0"):
                if word.startswith(b"SLURMD_NODENAME="):
                    return word.split(b"=")[1].decode()
        except OSError:
            continue
    return None


def stop(process):
    """Kills a process if it is running."""
    try:
        os.kill(process, signal.SIGKILL)
    except OSError:
        pass


class Study:
    """A study with its own data folder."""

    def __init__(self, program, folder, *options, variables=None):
        self.program, self.data = program, folder / "data"
        self.environment = os.environ | (variables or {})
        folder.mkdir()
        self.manifest = folder / "study.toml"
        shutil.copy(HERE / "cluster/study.toml", self.manifest)
        # The second node uses other vector instructions, like another processor.
        (folder / "asperity.toml").write_text(
            "[cluster]\n"
            "per_element = 0.0005\n"
            "at_most = 6\n"
            'before = "case $SLURMD_NODENAME in n2) export ASPERITY_SIMD=avx2 ;; esac"\n'
        )
        print(self.asperity("submit", *options), end="")

    def asperity(self, command, *options):
        """Returns the output of the program."""
        command = (self.program, "--data", self.data, command, self.manifest, *options)
        return output(*command, env=self.environment)

    def status(self):
        """Returns the status of the study."""
        return json.loads(self.asperity("status", "--json"))

    def wait_until_running(self):
        """Waits until an element is running."""
        wait_until("an element computes", lambda: self.status()["cores"] > 0)

    def wait(self):
        """Waits until all jobs have ended."""
        def is_over():
            queue = self.status()["queue"]
            return queue["running"] + queue["waiting"] == 0 and queue["finish"] is None
        wait_until("the last job has ended", is_over)

    def jobs(self):
        """Returns the submitted arrays."""
        kept = json.loads((self.data / "cluster/shared/submission.json").read_text())
        return [turn["array"] for turn in kept["submitted"]]

    def compare(self, expected):
        """Checks that every table equals that of the plain run."""
        tables = sorted(expected.glob("*.parquet"))
        assert len(tables) == 6, tables
        for table in tables:
            own = self.data / "results/shared" / table.name
            if not own.exists() or own.read_bytes() != table.read_bytes():
                logs = sorted((self.data / "cluster/shared/logs").iterdir())
                told = "\n".join(f"{log.name}:\n{log.read_text()}" for log in logs)
                raise SystemExit(f"{own} is not that of a plain run\n{told}")


def undisturbed(program, folder, _cluster):
    """Tests an array and the last job without disturbance."""
    study = Study(program, folder, "--report")
    study.wait_until_running()
    print(study.asperity("status"), end="")
    study.wait()
    status = study.status()
    assert all(stage["waiting"] + stage["failed"] == 0 for stage in status["stages"]), status
    assert status["core_hours_spent"] > 0, status
    receipts = sorted((study.data / "cluster/shared/receipts").glob("*.json"))
    nodes = {json.loads(receipt.read_text())["job"] for receipt in receipts}
    assert len(nodes) == len(receipts), "a receipt of each element"
    assert (study.data / "results/shared/report.html").exists()
    return study


# Variables that hide jobs from `squeue`, protect them from `scancel`, or beat the options in a batch script.
VARIABLES = {
    "SQUEUE_STATES": "COMPLETED",
    "SQUEUE_PARTITION": "other",
    "SQUEUE_ACCOUNT": "other",
    "SQUEUE_QOS": "other",
    "SQUEUE_LICENSES": "other",
    "SQUEUE_USERS": "nobody",
    "SCANCEL_STATE": "SUSPENDED",
    "SCANCEL_PARTITION": "other",
    "SBATCH_TIMELIMIT": "3",
    "SBATCH_MEM_PER_NODE": "77",
    "SBATCH_MEM_PER_CPU": "33",
    "SBATCH_JOB_NAME": "other",
    "SBATCH_ARRAY_INX": "1-3",
    "SBATCH_OUTPUT": "/dev/null",
    "SBATCH_OPEN_MODE": "truncate",
    "SBATCH_WAIT": "1",
}


def variables_of_the_user(program, folder, _cluster):
    """Tests that variables of Slurm in the user's environment change nothing, and that logs are appended."""
    study = Study(program, folder, variables=VARIABLES)
    kept = json.loads((study.data / "cluster/shared/submission.json").read_text())["submitted"][0]
    script = (study.data / "cluster/shared/element.sh").read_text()
    limit = next(line.split("=")[1] for line in script.splitlines() if line.startswith("#SBATCH --time="))
    assert "#SBATCH --mem=1024M" in script, script
    for job in (kept["array"], kept["finish"]):
        told = output("scontrol", "show", "job", str(job))
        assert f"JobName={'shared' if job == kept['array'] else 'shared-finish'}" in told, told
        assert "MinMemoryNode=1G" in told, told
        assert "/cluster/shared/logs/" in told, told
        assert job == kept["array"] or "ArrayJobId" not in told, told
    hours, minutes, seconds = limit.split(":")
    told = output("scontrol", "show", "job", str(kept["array"]))
    assert f"TimeLimit={int(hours):02}:{minutes}:{seconds}" in told, told
    study.wait_until_running()
    again = subprocess.run(
        [program, "--data", study.data, "submit", study.manifest],
        env=study.environment, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert again.returncode == 2 and "already in the queue" in again.stderr, again.stderr

    def running():
        return output("squeue", "--noheader", "--states=RUNNING", "--format=%A %K", f"--jobs={kept['array']}").split()

    wait_until("an element runs", running)
    job, element = running()[:2]
    output("scontrol", "requeue", job)
    wait_until("the job waits", lambda: "BeginTime: Slurm restarts" in study.asperity("status"))
    log = study.data / f"cluster/shared/logs/{kept['array']}_{element}.txt"
    before = log.read_text()
    output("scontrol", "update", f"JobId={job}", "StartTime=now")
    wait_until("the log grows", lambda: log.read_text() != before)
    assert log.read_text().startswith(before), log.read_text()
    cancelled = study.asperity("cancel")
    assert str(kept["array"]) in cancelled and str(kept["finish"]) in cancelled, cancelled
    wait_until("nothing is in the queue", lambda: not output("squeue", "--noheader", "--name=shared,shared-finish"))
    print(study.asperity("submit"), end="")
    study.wait()
    return study


def by_hand(program, folder, expected):
    """Tests GNU parallel instead of a scheduler, as in docs/cluster.md."""
    folder.mkdir()
    run = f"{program} --data {folder}/data run {HERE}/cluster/study.toml"
    output("bash", "-c", f"parallel -j 2 {run} --jobs 1 --shard {{}}/5 ::: $(seq 5) && {run}")
    for table in sorted(expected.glob("*.parquet")):
        assert (folder / "data/results/shared" / table.name).read_bytes() == table.read_bytes(), table
    print("GNU parallel: the same bytes")


def node_dies(program, folder, cluster):
    """Tests that elements of a failed node run on another node."""
    study = Study(program, folder)
    wait_until("the second node computes", lambda: steps_of("n2"))
    study.wait_until_running()
    cluster.kill("n2")
    study.wait()
    cluster.start("n2")
    return study


def element_cancelled(program, folder, _cluster):
    """Tests that the next round does the rest of a cancelled element."""
    study = Study(program, folder)
    study.wait_until_running()
    output("scancel", f"{study.jobs()[0]}_2", f"{study.jobs()[0]}_5")
    study.wait()
    assert len(study.jobs()) > 1, "something was submitted again"
    return study


def disk_full(program, folder, _cluster):
    """Tests that an element with a full disk ends and the others continue."""
    wrapper = folder.parent / "full.sh"
    # The first process of the third element has a full disk for its tables.
    wrapper.write_text(f"""#!/bin/bash
once={folder}/once
if [ "${{SLURM_ARRAY_TASK_ID:-}}" = 3 ] && mkdir "$once" 2> /dev/null; then
    mkdir -p {folder}/data/store/unfinished
    exec unshare --mount sh -c '
        mount -t tmpfs -o size=4k full {folder}/data/store/unfinished &&
        head -c 4096 /dev/zero > {folder}/data/store/unfinished/full && exec "$0" "$@"' {program} "$@"
fi
exec {program} "$@"
""")
    wrapper.chmod(0o755)
    study = Study(program, folder, "--program", wrapper)
    study.wait()
    receipts = (study.data / "cluster/shared/receipts").glob("*.json")
    halted = [receipt for receipt in receipts if json.loads(receipt.read_text())["halted"]]
    assert len(halted) == 1, "one element found the disk full"
    return study


def may_mount():
    """Returns whether a process can mount a small private disk."""
    mount = "mount -t tmpfs -o size=4k full /mnt"
    return subprocess.run(["unshare", "--mount", "sh", "-c", mount], capture_output=True, check=False).returncode == 0


def main():
    program = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        folder = Path(folder)
        alone = folder / "alone"
        manifest = HERE / "cluster/study.toml"
        output(program, "--data", alone, "run", manifest)
        by_hand(program, folder / "by_hand", alone / "results/shared")
        slurm = folder / "slurm"
        slurm.mkdir()
        cluster = Cluster(slurm)
        try:
            for what in (undisturbed, variables_of_the_user, node_dies, element_cancelled, disk_full):
                if sys.argv[2:] and what.__name__ not in sys.argv[2:]:
                    continue
                if what is disk_full and not may_mount():
                    print("NOT TESTED, because no disk can be mounted: disk_full")
                    continue
                begun = time.monotonic()
                study = what(program, folder / what.__name__, cluster)
                study.compare(alone / "results/shared")
                took = time.monotonic() - begun
                print(f"{what.__name__}: the same bytes, {len(study.jobs())} rounds, {took:.0f} s")
        finally:
            cluster.stop()


if __name__ == "__main__":
    main()
