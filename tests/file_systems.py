"""A study runs on file systems that refuse what publishing a table usually needs, as those of some clusters do.

`python3 tests/file_systems.py PROGRAM` mounts a small file system in user space over a folder, once for each
fault, and compares the tables with those of a plain run. It needs root, `/dev/fuse`, libfuse 2 and the Python
package `fusepy`; without them it says so and tests nothing. Through libfuse 2, no file system can rename a file
only to a free name (`RENAME_NOREPLACE` is answered by EINVAL), which is what BeeGFS and some NFS gateways do.
"""

import errno
import os
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

STUDY = """
[study]
name = "small"

[stage.surfaces]
kind = "generate"
nodes = 32
hurst = 0.8
k_lower = 2
k_upper = 8
realizations = 4

[stage.contact]
kind = "solve"
from = "surfaces"
loads = [0.05, 0.1]

[stage.path]
kind = "solve"
from = "surfaces"
loads = [0.01]
adhesion = { work = 0.001, range = 0.02 }

[stage.area]
kind = "measure"
from = "contact"
"""

# What each file system does with hard links and with fsync.
FAULTS = {
    "hard links": ("hard", 0),
    "no hard links": ("none", 0),
    "hard links within a folder only": ("within a folder", 0),
    "symbolic links in place of hard links": ("symbolic", 0),
    "no hard links, fsync: EINVAL": ("none", errno.EINVAL),
    "no hard links, fsync: ENOSYS": ("none", errno.ENOSYS),
}


def serve(root, mount, links, fsync):
    """Serves the folder `root` at `mount` until it is unmounted."""
    import fuse

    class Faulty(fuse.Operations):
        """A file system that passes everything on to a folder, except links and fsync."""

        def __call__(self, operation, path, *arguments):
            return super().__call__(operation, root + path, *arguments)

        def access(self, path, mode):
            if not os.access(path, mode):
                raise fuse.FuseOSError(errno.EACCES)

        chmod = staticmethod(os.chmod)
        chown = staticmethod(os.chown)
        mkdir = staticmethod(os.mkdir)
        readlink = staticmethod(os.readlink)
        rmdir = staticmethod(os.rmdir)
        unlink = staticmethod(os.unlink)
        open = staticmethod(os.open)

        def create(self, path, mode):
            return os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, mode)

        def getattr(self, path, handle=None):
            status = os.lstat(path)
            names = ("atime", "ctime", "gid", "mode", "mtime", "nlink", "size", "uid")
            return {f"st_{name}": getattr(status, f"st_{name}") for name in names}

        def readdir(self, path, handle):
            return [".", "..", *os.listdir(path)]

        def read(self, path, size, offset, handle):
            return os.pread(handle, size, offset)

        def write(self, path, data, offset, handle):
            return os.pwrite(handle, data, offset)

        def truncate(self, path, length, handle=None):
            os.truncate(path, length)

        def release(self, path, handle):
            os.close(handle)

        def statfs(self, path):
            status = os.statvfs(path)
            names = ("bavail", "bfree", "blocks", "bsize", "favail", "ffree", "files", "frsize", "namemax")
            return {f"f_{name}": getattr(status, f"f_{name}") for name in names}

        def utimens(self, path, times=None):
            os.utime(path, times)

        def rename(self, old, new):
            os.rename(old, root + new)

        def symlink(self, target, source):
            os.symlink(source, target)

        def link(self, target, source):
            source = root + source
            if links == "none":
                raise fuse.FuseOSError(errno.EPERM)
            if links == "symbolic":
                os.symlink(os.path.relpath(source, os.path.dirname(target)), target)
            elif links == "within a folder" and os.path.dirname(source) != os.path.dirname(target):
                raise fuse.FuseOSError(errno.EXDEV)
            else:
                os.link(source, target)

        def fsync(self, path, only_data, handle):
            if fsync:
                raise fuse.FuseOSError(fsync)
            os.fsync(handle)

    fuse.FUSE(Faulty(), str(mount), foreground=True, nothreads=True)


class Mount:
    """A folder on a file system with a fault."""

    def __init__(self, folder, fault):
        self.folder = folder
        root = folder.with_name(folder.name + "-served")
        for path in (folder, root):
            path.mkdir()
        links, fsync = FAULTS[fault]
        command = [sys.executable, __file__, "--serve", str(root), str(folder), links, str(fsync)]
        self.server = subprocess.Popen(command)
        until = time.monotonic() + 20
        while not os.path.ismount(folder):
            if self.server.poll() is not None or time.monotonic() > until:
                raise SystemExit("the file system was not mounted")
            time.sleep(0.05)

    def __enter__(self):
        return self.folder

    def __exit__(self, *_):
        subprocess.run(["umount", "--lazy", self.folder], check=False)
        self.server.wait(20)


def ask(program, data, *words):
    """Returns the output of a command, which must succeed."""
    done = subprocess.run([program, "--data", data, *words], capture_output=True, text=True, check=False)
    assert done.returncode == 0, f"{' '.join(map(str, words))}: {done.returncode}\n{done.stdout}{done.stderr}"
    return done.stdout + done.stderr


def tables(data):
    return {path.name: path.read_bytes() for path in sorted((data / "results/small").glob("*.parquet"))}


def left_over(data):
    """Returns links, and files that no run needs any more."""
    store = [path for path in (data / "store").rglob("*") if not path.is_dir()]
    return [path for path in store if path.is_symlink() or path.name.startswith(".unfinished")]


def check(program, data, manifest, expected):
    """Two runs at the same time, then a run with nothing to do, and all other commands."""
    runs = [
        subprocess.Popen(
            [program, "--data", data, "run", manifest], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        for _ in range(2)
    ]
    for run in runs:
        told, _ = run.communicate(timeout=120)
        assert run.returncode == 0, told
    assert tables(data) == expected and len(expected) == 4
    assert not left_over(data), left_over(data)
    assert "nothing to do" in ask(program, data, "run", manifest)
    ask(program, data, "verify")
    table = next((data / "store").glob("??/*.parquet"))
    table.write_bytes(b"damaged")
    shutil.rmtree(data / "results")
    ask(program, data, "run", manifest)
    assert tables(data) == expected


def main():
    program = Path(sys.argv[1]).resolve()
    try:
        import fuse  # noqa: F401
    except (ImportError, OSError) as error:
        print(f"NOT TESTED: {error}")
        return
    if os.geteuid() != 0 or not os.path.exists("/dev/fuse"):
        print("NOT TESTED: file systems in user space need root and /dev/fuse")
        return
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        manifest = folder / "small.toml"
        manifest.write_text(STUDY)
        ask(program, folder / "alone", "run", manifest)
        expected = tables(folder / "alone")
        for index, fault in enumerate(FAULTS):
            with Mount(folder / f"mount-{index}", fault) as mounted:
                check(program, mounted / "data", manifest, expected)
                print(f"{fault}: the same bytes")


if __name__ == "__main__":
    if sys.argv[1] == "--serve":
        serve(sys.argv[2], sys.argv[3], sys.argv[4], int(sys.argv[5]))
    else:
        main()
