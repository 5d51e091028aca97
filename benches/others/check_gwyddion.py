"""Checks what the guide says about Gwyddion: its library, and its files in Python.

It needs the Debian package libgwyddion2-0.
"""

import ctypes
from ctypes import POINTER, c_double, c_int, c_void_p
from pathlib import Path
from tempfile import TemporaryDirectory

import gwyfile
import numpy as np
import scipy
from gwyfile.objects import GwyContainer, GwyDataField, GwySIUnit
from SurfaceTopography import open_topography
from surfalize import Surface

from common import NODES, SIDE, Checks, gradient, heights

HORIZONTAL, LINEAR, NO_WINDOW = 0, 1, 0


class Library:
    """Functions of libgwyprocess, called on one map [line, column] in metres."""

    def __init__(self, h: np.ndarray, side: float):
        ctypes.CDLL("libgwyddion2.so.0", mode=ctypes.RTLD_GLOBAL)
        self.library = ctypes.CDLL("libgwyprocess2.so.0")
        self.library.gwy_process_type_init()
        sides = c_double(side), c_double(side)
        self.field = c_void_p(self.call("gwy_data_field_new", c_void_p, *h.shape[::-1], *sides, 0))
        data = self.call("gwy_data_field_get_data", POINTER(c_double), self.field)
        np.ctypeslib.as_array(data, shape=h.shape)[:] = h

    def call(self, name: str, result, *arguments):
        function = getattr(self.library, name)
        function.restype = result
        return function(*arguments)

    def number(self, name: str) -> float:
        return self.call(f"gwy_data_field_{name}", c_double, self.field)

    def line(self, name: str, *arguments) -> tuple[np.ndarray, float, float]:
        """Returns the values of a function, the first abscissa and the step."""
        line = c_void_p(self.call("gwy_data_line_new", c_void_p, 1, c_double(1), 0))
        self.call(f"gwy_data_field_{name}", None, self.field, line, *arguments)
        count = self.call("gwy_data_line_get_res", c_int, line)
        step = self.call("gwy_data_line_get_real", c_double, line) / count
        first = self.call("gwy_data_line_get_offset", c_double, line)
        values = self.call("gwy_data_line_get_data", POINTER(c_double), line)[:count]
        return np.array(values), first, step


def statistics(check: Checks, h: np.ndarray) -> None:
    gwyddion = Library(h, SIDE)
    check("rms over rms height about the mean", gwyddion.number("get_rms") / h.std(), 1.0)
    along = [np.diff(h, axis=axis) * NODES / SIDE for axis in (0, 1)]
    forward = np.sqrt(sum((difference**2).mean() for difference in along))
    check(
        "Sdq over rms of the differences to the next point",
        gwyddion.number("get_surface_slope") / forward,
        1.0,
    )
    check(
        "Sdq over exact rms gradient",
        gwyddion.number("get_surface_slope") / gradient(h, (SIDE, SIDE)),
        0.97,
        1,
    )
    lines = (h - h.mean(axis=1, keepdims=True)).var()
    values, first, step = gwyddion.line("psdf", HORIZONTAL, LINEAR, NO_WINDOW, 0)
    check("first wavenumber of the 1D PSDF, in waves", first * SIDE / (2 * np.pi), 1.0)
    check(
        "sum of the 1D PSDF × step over ⟨h²⟩ of the lines", values.sum() * step / lines, 0.49, 0.51
    )
    levelled = scipy.signal.detrend(h, axis=1)
    levelled *= (h.std(axis=1) / levelled.std(axis=1))[:, None]
    modes = (np.abs(np.fft.fft(levelled, axis=1) / NODES) ** 2).mean(axis=0)
    check(
        "1D PSDF at one wave over |ĥ|² of lines without trend, scaled back to their mean square",
        values[0] * step / modes[1],
        1.0,
    )
    modes = (np.abs(np.fft.fft(h, axis=1) / NODES) ** 2).mean(axis=0)
    check("the same over |ĥ|² of the lines", values[0] * step / modes[1], 0.7, 0.8)
    check("the same at 15 waves", values[14] * step / modes[15], 1.1, 1.2)
    values, _, step = gwyddion.line("rpsdf", LINEAR, NO_WINDOW, 0)
    check("sum of the radial PSDF × step over ⟨h²⟩", values.sum() * step / h.var(), 0.97, 1.01)
    values, _, _ = gwyddion.line("acf", HORIZONTAL, LINEAR, 0)
    check("ACF at distance 0 over ⟨h²⟩ of the lines, each about its mean", values[0] / lines, 1.0)


def files(check: Checks, h: np.ndarray) -> None:
    """Writes lines × columns of a strip, with a mask of Gwyddion on the highest points."""
    strip = h[:64]
    unit = {"si_unit_xy": GwySIUnit(unitstr="m"), "si_unit_z": GwySIUnit(unitstr="m")}
    channels = GwyContainer()
    channels["/0/data/title"] = "Height"
    channels["/0/data"] = GwyDataField(strip, xreal=SIDE, yreal=SIDE / 2, **unit)
    mask = (strip > np.quantile(strip, 0.9)).astype(float)
    channels["/0/mask"] = GwyDataField(mask, xreal=SIDE, yreal=SIDE / 2, **unit)
    with TemporaryDirectory() as folder:
        path = Path(folder, "map.gwy")
        channels.tofile(str(path))
        data = gwyfile.load(str(path))["/0/data"].data
        read = open_topography(str(path)).topography()
        surface = Surface.load(path)
    check("lines of the array of gwyfile", data.shape[0], 64)
    check("points along x in SurfaceTopography", read.nb_grid_pts[0], 128)
    check(
        "its heights[x, y] equal data[line, column] transposed",
        float(
            np.allclose(
                np.ma.getdata(read.heights())[np.ma.getmaskarray(read.heights()) == 0],
                data.T[mask.T == 0],
            )
        ),
        1.0,
    )
    check(
        "share of the points that are missing for SurfaceTopography",
        np.ma.getmaskarray(read.heights()).mean(),
        0.09,
        0.11,
    )
    check("the same for surfalize", np.isnan(surface.data).mean(), 0.09, 0.11)
    check("the same for gwyfile", np.isnan(data).mean(), 0.0)


def main() -> None:
    check = Checks("Gwyddion 2.62, gwyfile 0.3.0")
    h = heights() - heights().mean()
    statistics(check, h)
    files(check, h)
    check.finish()


if __name__ == "__main__":
    main()
