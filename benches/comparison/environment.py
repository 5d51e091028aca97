"""Creates a virtual environment with the peers in pinned versions."""

import importlib.util
import os
import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path

BUILD = ["scikit-build-core==1.1.2", "pybind11==3.1.0"]
WHEELS = [
    "numpy==2.4.6",
    "scipy==1.17.1",
    "pyarrow==26.0.1",
    "rfgen==0.2.3",
    "tamaas==2.9.0",
    "ContactMechanics==1.8.3",
    "SurfaceTopography==1.27.1",
    "Adhesion==0.93",
    "surfalize==0.19.2",
    "gwyfile==0.3.0",
    "polars==2.1.0",
    "muGrid==1.6.1",
]
ASPHER = "aspher==0.1.3.post1"

# aspher is compiled from source. This makes it use all vector instructions of this machine.
ASPHER_BUILD = {"CMAKE_ARGS": "-DASPHER_NATIVE=ON"}

# Every code runs on one thread.
ONE_THREAD = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
}


def prepare(folder: Path) -> Path:
    """Returns the interpreter of the environment; builds it first if its packages differ."""
    python = folder / "bin" / "python"
    stamp = folder / "packages.txt"
    wanted = "\n".join([sys.version, *BUILD, *WHEELS, ASPHER, str(ASPHER_BUILD)])
    if stamp.exists() and stamp.read_text() == wanted:
        return python
    require_tools()
    print(f"environment  {folder} (a few minutes, once)", file=sys.stderr, flush=True)
    venv.create(folder, clear=True, with_pip=True)
    install(python, BUILD + WHEELS, {})
    install(python, ["--no-build-isolation", "--no-deps", ASPHER], ASPHER_BUILD)
    stamp.write_text(wanted)
    return python


def install(python: Path, packages: list[str], variables: dict[str, str]) -> None:
    command = [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    done = subprocess.run(command + packages, env=os.environ | variables)
    if done.returncode != 0:
        sys.exit(f"error: pip cannot install {' '.join(packages)}; see its message above")


def require_tools() -> None:
    """Checks for missing tools before pip and CMake fail minutes later."""
    if sys.version_info < (3, 11):
        sys.exit(f"error: Python {sys.version.split()[0]} is too old; use Python 3.11 or later")
    includes = [Path("/usr/include"), Path("/usr/local/include")]
    there = {
        "python3-venv": importlib.util.find_spec("ensurepip"),
        "python3-dev": Path(sysconfig.get_path("include"), "Python.h").exists(),
        "cmake": shutil.which("cmake"),
        "g++": shutil.which(os.environ.get("CXX", "c++")),
        "libeigen3-dev": any((path / "eigen3/Eigen/Core").exists() for path in includes),
    }
    missing = " ".join(name for name, found in there.items() if not found)
    if missing:
        sys.exit(
            f"error: cannot compile aspher, one of the peers; "
            f"install the missing packages (Debian names): {missing}"
        )
