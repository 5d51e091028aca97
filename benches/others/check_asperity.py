"""Checks what the guide says about asperity: `check_asperity.py PROGRAM`."""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import polars

from common import Checks, edges, gradient, heights

MANIFEST = """
[study]
name = "conventions"

[stage.surface]
kind = "generate"
method = "file"
path = "heights.npy"
side = [1.0, 1.0]
periodic = {periodic}

[stage.contact]
kind = "solve"
from = "surface"
loads = [0.05]
tolerance = 1e-6
max_pairs = {pairs}
boundary = "{boundary}"

[stage.area]
kind = "measure"
from = "contact"

[stage.moments]
kind = "measure"
from = "surface"
what = "roughness"
parameters = "iso-25178"
"""
PERIODIC = MANIFEST.format(periodic="true", boundary="periodic", pairs=2000)
FREE = MANIFEST.format(periodic="false", boundary="free", pairs=2000)
STOPPED = MANIFEST.format(periodic="true", boundary="periodic", pairs=2)
RANDOM = """
[study]
name = "random"

[stage.surfaces]
kind = "generate"
nodes = 128
hurst = 0.8
k_lower = 4
k_upper = 32
rms_slope = 0.1
method = "filter"
realizations = 5
"""


SIDES = (1.0, 1.0)


class Study:
    def __init__(self, folder: str, text: str, h: np.ndarray | None = None):
        self.folder = Path(folder)
        self.manifest = self.folder / "study.toml"
        self.manifest.write_text(text)
        if h is not None:
            np.save(self.folder / "heights.npy", h)

    def run(self, *words: str) -> subprocess.CompletedProcess:
        command = [sys.argv[1], words[0], self.manifest, *words[1:], "--data", self.folder / "data"]
        return subprocess.run(command, capture_output=True, text=True)

    def table(self, stage: str) -> dict:
        found = list(self.folder.glob(f"data/results/*/{stage}.parquet"))
        return polars.read_parquet(found[0]).to_dict(as_series=False)

    def map(self, stage: str, name: str) -> np.ndarray:
        path = self.folder / f"{name}.npy"
        done = self.run("export", stage, "--map", name, "--output", str(path))
        assert done.returncode == 0, done.stderr
        # Maps of a contact have an axis of loads in front.
        return np.load(path).reshape(128, 64)


def contact(check: Checks, h: np.ndarray) -> None:
    with TemporaryDirectory() as folder, TemporaryDirectory() as other:
        study, lifted = Study(folder, PERIODIC, h), Study(other, PERIODIC, h + 0.3)
        for each in (study, lifted):
            done = each.run("run")
            assert done.returncode == 0, done.stderr
        pressure, gap = study.map("contact", "pressure"), study.map("contact", "gap")
        area, solved = study.table("area"), study.table("contact")
        roughness, moments = study.table("moments"), study.table("surface")
        lifted_gap = lifted.table("contact")["mean_gap"][0]
        lifted_moments = lifted.table("surface")
    exact = gradient(h, SIDES)
    share = np.mean(h[pressure > 0] > np.quantile(h, 0.75))
    check(
        "share of the contact, as exported, on the highest quarter of heights[x, y]", share, 0.99, 1
    )
    check("rms_slope over exact rms gradient", area["rms_slope"][0] / exact, 1.0)
    check("Sdq over exact rms gradient", roughness["Sdq"][0] / exact, 1.0)
    check("mean pressure over load × rms gradient, E* = 1", pressure.mean() / (0.05 * exact), 1.0)
    check(
        "area_fraction over share of nodes with positive pressure",
        area["area_fraction"][0] / (pressure > 0).mean(),
        1.0,
    )
    check(
        "switches over cell edges between contact and gap",
        area["switches"][0] / edges(pressure > 0),
        1.0,
    )
    check(
        "mean_gap over mean of the map of gaps",
        solved["mean_gap"][0] / gap.mean(),
        0.99999,
        1.00001,
    )
    check("residual of the row", solved["residual"][0], 0, 1e-6)
    check(
        "mean_gap of the map, lifted by 0.3, over that of the map",
        lifted_gap / solved["mean_gap"][0],
        1.0,
    )
    for name in ("rms_height", "nayak"):
        check(
            f"{name} of the map, lifted by 0.3, over that of the map",
            lifted_moments[name][0] / moments[name][0],
            1.0,
        )


def points(check: Checks, h: np.ndarray) -> None:
    holed = h.copy()
    holed[3, 4] = np.nan
    with TemporaryDirectory() as folder:
        done = Study(folder, PERIODIC, holed).run("run")
        check("a map with a NaN and without `fill` is refused", float(done.returncode != 0), 1.0)
    with TemporaryDirectory() as folder:
        study = Study(folder, STOPPED, h)
        study.run("run")
        stopped = study.table("contact")["stop"][0] == "pair-limit"
        check("`stop` after two pairs of transforms is pair-limit", float(stopped), 1.0)
    with TemporaryDirectory() as folder:
        study = Study(folder, FREE, h)
        assert study.run("run").returncode == 0
        slope = study.table("moments")["Sdq"][0]
    along = [np.diff(h, axis=axis) * h.shape[axis] for axis in (0, 1)]
    forward = np.sqrt(sum((difference**2).mean() for difference in along))
    check(
        "Sdq of a map that is not periodic over rms of the differences", slope / forward, 0.99, 1.01
    )
    with TemporaryDirectory() as folder:
        path = Path(folder, "h.txt")
        np.savetxt(path, h)
        done = subprocess.run([sys.argv[1], "surface", path], capture_output=True, text=True)
        lines_are_y = "64 × 128" in done.stdout
        check("a text of 128 lines × 64 numbers has 64 × 128 nodes", float(lines_are_y), 1.0)


def lay(check: Checks) -> None:
    """Measures ridges whose lay is 120° from the x axis, anticlockwise."""
    x = np.arange(256.0)
    angle = np.deg2rad(120)
    ridges = np.sin(2 * np.pi / 16 * (np.cos(angle) * x[None, :] - np.sin(angle) * x[:, None]))
    text = FREE[: FREE.index("[stage.contact]")] + FREE[FREE.index("[stage.moments]") :]
    with TemporaryDirectory() as folder:
        study = Study(folder, text, ridges)
        assert study.run("run").returncode == 0
        check(
            "Std of a lay of 120°: the direction across it",
            study.table("moments")["Std"][0],
            29,
            31,
        )


def random(check: Checks) -> None:
    with TemporaryDirectory() as folder:
        study = Study(folder, RANDOM)
        assert study.run("run").returncode == 0
        slopes = study.table("surfaces")["rms_slope"]
    check("largest rms_slope of random surfaces over the one asked for", max(slopes) / 0.1, 1.0)
    check("smallest rms_slope of random surfaces over the one asked for", min(slopes) / 0.1, 1.0)


def main() -> None:
    version = subprocess.run([sys.argv[1], "--version"], capture_output=True, text=True).stdout
    check = Checks(version.strip())
    # Every other node along y: cells of 1 × 2, and a map whose axes cannot be confused.
    h = (heights() - heights().mean())[:, ::2] / 100e-6
    contact(check, h)
    points(check, h)
    lay(check)
    random(check)
    check.finish()


if __name__ == "__main__":
    main()
