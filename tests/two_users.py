"""Two users of one group share a data folder, and one of them reads the store of the other without changing it.

`python3 tests/two_users.py PROGRAM` creates a group with the users `asperity-alice` and `asperity-bob` and removes
them at the end. It needs root and `useradd`; without root it says so and tests nothing.
"""

import grp
import json
import os
import pwd
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

GROUP, ALICE, BOB = "asperity-rough", "asperity-alice", "asperity-bob"
STUDY = """
[study]
name = "small"

[stage.surfaces]
kind = "generate"
nodes = 32
hurst = 0.8
k_lower = 2
k_upper = 8
realizations = {realizations}

[stage.contact]
kind = "solve"
from = "surfaces"
loads = {loads}

[stage.area]
kind = "measure"
from = "contact"

[stage.mean]
kind = "aggregate"
from = "area"
over = ["area_fraction"]
statistics = ["mean"]
"""


def system(*command):
    subprocess.run(command, check=True, capture_output=True)


class Laboratory:
    """A folder with manifests and data folders, in which commands run as one of the users."""

    def __init__(self, folder, program):
        self.folder = folder
        # The users may not be able to enter the folder of the program.
        self.program = folder / "asperity"
        shutil.copy(program, self.program)
        self.program.chmod(0o755)

    def manifest(self, realizations, loads):
        path = self.folder / "small.toml"
        path.write_text(STUDY.format(realizations=realizations, loads=loads))
        path.chmod(0o644)

    def ask(self, user, *words, umask="002", status=0):
        """Runs the program as a user and returns standard output and standard error."""
        environment = {"PATH": os.environ["PATH"], "NO_COLOR": "1", "HOME": "/nonexistent"}
        command = ["setpriv", "--reuid", user, "--regid", GROUP, "--clear-groups", str(self.program), *map(str, words)]
        done = subprocess.run(
            command, cwd=self.folder, env=environment, umask=int(umask, 8), capture_output=True, text=True, check=False
        )
        where = f"{user}: {' '.join(map(str, words))}: {done.returncode}, expected {status}"
        assert done.returncode == status, f"{where}\n{done.stdout}{done.stderr}"
        return done.stdout, done.stderr

    def run(self, user, data, **options):
        """Runs the study and returns the numbers of computed tasks by stage, and the stores that were read."""
        out, _ = self.ask(user, "--data", data, "run", "small.toml", "--json", **options)
        summary = json.loads(out)
        return {stage["name"]: stage["computed"] for stage in summary["stages"]}, summary.get("stores", [])

    def data_folder(self, name, user, mode):
        path = self.folder / name
        path.mkdir()
        shutil.chown(path, user, GROUP)
        path.chmod(mode)
        return path


def listing(folder):
    """Returns owner, mode, size and time of the last change of everything in a folder."""
    paths = [folder, *sorted(folder.rglob("*"))]
    status = ((path, path.lstat()) for path in paths)
    return {str(path): (of.st_uid, oct(of.st_mode), of.st_size, of.st_mtime_ns) for path, of in status}


def tables(data):
    return {path.name: path.read_bytes() for path in sorted((data / "results/small").glob("*.parquet"))}


def shared_folder(lab):
    """Both users write to one data folder, whose group may write and whose new files inherit the group."""
    data = lab.data_folder("shared", ALICE, 0o2775)
    lab.manifest(2, [0.05, 0.1])
    computed, _ = lab.run(ALICE, data)
    assert computed == {"surfaces": 2, "contact": 2, "area": 2, "mean": 1}, computed
    modes = {oct(path.lstat().st_mode & 0o7777) for path in data.rglob("*")}
    assert modes == {"0o664", "0o2775"}, modes
    assert all(path.group() == GROUP for path in data.rglob("*"))

    lab.manifest(3, [0.05, 0.1, 0.15])
    computed, _ = lab.run(BOB, data)
    assert computed == {"surfaces": 1, "contact": 3, "area": 3, "mean": 1}, computed
    owners = {path.owner() for path in (data / "store").rglob("*.parquet")}
    assert owners == {ALICE, BOB}, owners
    # Files with one name that both write: tables of stages, record, owner, report.
    for user in (ALICE, BOB):
        lab.ask(user, "--data", data, "report", "small.toml", "--replace")
        lab.ask(user, "--data", data, "verify")
    damaged = next(path for path in (data / "store").rglob("*.parquet") if path.owner() == ALICE)
    whole = damaged.read_bytes()
    damaged.write_bytes(whole[: len(whole) // 2])
    out, _ = lab.ask(BOB, "--data", data, "verify", status=1)
    assert "1 damaged" in out and "set aside" in out, out
    lab.run(ALICE, data)
    lab.manifest(1, [0.05])
    out, _ = lab.ask(BOB, "--data", data, "prune", "small.toml", "--yes")
    assert "deleted" in out, out
    assert not list((data / "store").rglob("*.damaged"))
    lab.ask(ALICE, "--data", data, "verify")
    print("shared data folder: run, extended, verified, repaired and pruned by two users")


def layered_store(lab):
    """Bob computes into his own data folder above the store of Alice, which he may only read."""
    group = lab.data_folder("group", ALICE, 0o755)
    own = lab.data_folder("own", BOB, 0o755)
    alone = lab.data_folder("alone", BOB, 0o755)
    lab.manifest(2, [0.05, 0.1])
    lab.run(ALICE, group, umask="022")
    before = listing(group)

    (own / "asperity.toml").write_text(f'stores = ["{group}"]\n')
    plan, _ = lab.ask(BOB, "--data", own, "plan", "small.toml")
    assert f"finished in `{group}/store`: 2 surfaces, 2 contact, 2 area, 1 mean" in plan, plan
    computed, stores = lab.run(BOB, own)
    assert not any(computed.values()), computed
    assert stores == [{"store": f"{group}/store", "tasks": 7}], stores
    assert not list((own / "store").rglob("*.parquet"))
    lab.run(BOB, alone)
    assert tables(own) == tables(alone) and len(tables(own)) == 4

    # Further loads and surfaces: rows of Alice and of Bob together are the rows of a study without layers.
    lab.manifest(3, [0.05, 0.1, 0.15])
    computed, _ = lab.run(BOB, own)
    assert computed == {"surfaces": 1, "contact": 3, "area": 3, "mean": 1}, computed
    lab.run(BOB, alone)
    assert tables(own) == tables(alone)
    for command in (["verify", "--stores"], ["verify"], ["prune", "small.toml", "--yes"], ["explain", "small.toml"]):
        lab.ask(BOB, "--data", own, *command)
    lab.ask(BOB, "--data", own, "report", "small.toml", "--replace")
    lab.ask(BOB, "--data", own, "share", "small.toml", "--store", "--output", own / "small.zip")
    assert listing(group) == before, "the store of Alice was changed"
    print("layered store: nothing was computed again, nothing was written, the same bytes")

    # Without the layer, Bob is told who owns the folder.
    lab.manifest(4, [0.05])
    _, errors = lab.ask(BOB, "--data", group, "run", "small.toml", status=1)
    owner = f"belongs to user {pwd.getpwnam(ALICE).pw_uid} and group {grp.getgrnam(GROUP).gr_gid}"
    assert owner in errors, f"`{owner}` is missing in:\n{errors}"
    _, errors = lab.ask(BOB, "--data", group, "report", "--index", status=1)
    assert owner in errors, f"`{owner}` is missing in:\n{errors}"
    assert listing(group) == before
    print("denied access: the message names owner and group")


def main():
    if os.geteuid() != 0 or not shutil.which("useradd"):
        print("NOT TESTED: two users need root and useradd")
        return
    program = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        folder.chmod(0o755)
        system("groupadd", "--force", GROUP)
        try:
            for user in (ALICE, BOB):
                system("useradd", "--no-create-home", "--gid", GROUP, user)
            lab = Laboratory(folder, program)
            shared_folder(lab)
            layered_store(lab)
        finally:
            for user in (ALICE, BOB):
                subprocess.run(["userdel", user], check=False, capture_output=True)
            subprocess.run(["groupdel", GROUP], check=False, capture_output=True)


main()
