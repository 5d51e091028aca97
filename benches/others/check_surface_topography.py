"""Checks what the guide says about SurfaceTopography."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import SurfaceTopography
from SurfaceTopography import Topography, open_topography
from SurfaceTopography.Generation import fourier_synthesis

from common import Checks, amplitudes, gradient, heights

SIDES = (1.0, 1.0)


def parameters(check: Checks, h: np.ndarray) -> None:
    periodic = Topography(h, SIDES, periodic=True)
    open_map = Topography(h, SIDES)
    along_x = np.sqrt((((np.roll(h, -1, 0) - h) * len(h)) ** 2).mean())
    q2, squares = amplitudes(h, SIDES)
    curvature = np.sqrt((q2**2 * squares).sum()) / 2
    check(
        "rms_gradient over exact rms gradient",
        periodic.rms_gradient() / gradient(h, SIDES),
        0.97,
        1,
    )
    check(
        "rms_slope_from_profile over rms difference along x",
        periodic.rms_slope_from_profile() / along_x,
        1.0,
    )
    check(
        "rms_slope_from_profile × √2 over rms_gradient",
        np.sqrt(2) * periodic.rms_slope_from_profile() / periodic.rms_gradient(),
        0.9,
        1.1,
    )
    check(
        "rms_curvature_from_area over half the exact rms Laplacian",
        periodic.rms_curvature_from_area() / curvature,
        0.9,
        1,
    )
    check(
        "moment_power_spectrum(2) over exact rms gradient²",
        periodic.moment_power_spectrum(2) / gradient(h, SIDES) ** 2,
        1.0,
    )
    check(
        "points of a derivative of an open map, per line", open_map.derivative(1)[0].shape[0], 127
    )
    check("pixel of an open map × points over side", open_map.pixel_size[0] * 128, 1.0)


def spectra(check: Checks, h: np.ndarray) -> None:
    periodic, open_map = Topography(h, SIDES, periodic=True), Topography(h, SIDES)
    q, density = periodic.power_spectrum_from_profile(resampling_method=None)
    lines = (h**2).mean() - (h.mean(axis=0) ** 2).mean()
    total = density[1:].sum() * (q[1] - q[0])
    check("first wavevector of power_spectrum_from_profile, in waves", q[0] / (2 * np.pi), 0.0)
    check("its integral without q = 0, over π ⟨h²⟩ of the lines", total / np.pi / lines, 1.0)
    for name, topography in (("periodic", periodic), ("open", open_map)):
        default = topography.power_spectrum_from_profile(resampling_method=None)[1]
        hann = topography.power_spectrum_from_profile(window="hann", resampling_method=None)[1]
        check(
            f"default spectrum of a map that is {name} is that with window='hann'",
            float(np.allclose(default, hann)),
            float(name == "open"),
        )
    lifted = Topography(h + 100 * h.std(), SIDES).power_spectrum_from_area()[1]
    check(
        "largest areal density of an open map, lifted by 100 rms heights, over that of the map",
        np.ma.max(lifted) / np.ma.max(open_map.power_spectrum_from_area()[1]),
        100,
        np.inf,
    )
    q, density = periodic.power_spectrum_from_area(collocation="linear", nb_points=200)
    valid = np.isfinite(np.ma.filled(density, np.nan))
    q, density = np.asarray(q)[valid], np.asarray(density)[valid]
    check(
        "integral of q C(q) of power_spectrum_from_area over 2π ⟨h²⟩",
        np.trapezoid(q * density, q) / (2 * np.pi) / h.var(),
        0.9,
        1.1,
    )
    _, correlation = periodic.autocorrelation_from_profile(resampling_method=None)
    difference = ((np.roll(h, -8, 0) - h) ** 2).mean() / 2
    check("autocorrelation at distance 0", correlation[0] / h.var(), -1e-9, 1e-9)
    check(
        "autocorrelation at 8 points over ⟨(h(x + 8) − h(x))²⟩/2", correlation[8] / difference, 1.0
    )


def synthesis(check: Checks) -> None:
    """Draws twenty surfaces; the generator is NumPy's global one."""
    for first in (4, 1):
        slopes, rms = [], []
        for seed in range(20):
            np.random.seed(seed)
            keys = {"short_cutoff": 1 / 32, "long_cutoff": 1 / first}
            surface = fourier_synthesis((128, 128), SIDES, 0.8, rms_slope=0.1, **keys)
            slopes.append(gradient(surface.heights(), SIDES) / 0.1)
            np.random.seed(seed)
            surface = fourier_synthesis((128, 128), SIDES, 0.8, rms_height=0.1, **keys)
            rms.append(surface.heights().std() / 0.1)
        label = f"fourier_synthesis, first wave {first}:"
        check(f"{label} mean of rms gradient over rms_slope", np.mean(slopes), 0.9, 1.1)
        check(f"{label} scatter of the rms gradient", np.std(slopes, ddof=1), 0, 0.2)
        check(f"{label} mean of rms height over rms_height", np.mean(rms), 0.8, 1.3)
        check(f"{label} scatter of the rms height", np.std(rms, ddof=1), 0, 0.4)


def files(check: Checks, h: np.ndarray) -> None:
    with TemporaryDirectory() as folder:
        text, binary = Path(folder, "h.txt"), Path(folder, "h.npy")
        np.savetxt(text, h[:, :64])
        np.save(binary, h[:, :64])
        shapes = [
            open_topography(str(path)).topography(physical_sizes=SIDES).nb_grid_pts
            for path in (text, binary)
        ]
    check("points along x of a text map of 128 lines × 64 numbers", shapes[0][0], 64)
    check("points along x of the same array as .npy", shapes[1][0], 128)
    holes = np.ma.masked_invalid(np.where(h > h.max() - 1e-12, np.nan, h))
    check(
        "undefined points of a map with one NaN", Topography(holes, SIDES).heights().mask.sum(), 1
    )


def main() -> None:
    check = Checks(f"SurfaceTopography {SurfaceTopography.__version__}")
    h = (heights() - heights().mean()) / 100e-6
    parameters(check, h)
    spectra(check, h)
    synthesis(check)
    files(check, h)
    check.finish()


if __name__ == "__main__":
    main()
