"""Checks what the guide says about surfalize."""

from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from SurfaceTopography import open_topography
from surfalize import Surface

from common import Checks, gradient, heights

STEP = 0.78125


def grid(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Returns x along the second axis and y, which points up, against the order of the lines."""
    x, down = np.meshgrid(np.arange(n), np.arange(n))
    return x, -down


def parameters(check: Checks, surface: Surface, h: np.ndarray) -> None:
    n = len(h)
    check("side of the map over points × step", surface.width_um / (n * STEP), (n - 1) / n)
    exact = gradient(h, (n * STEP, n * STEP))
    along = [np.diff(h, axis=axis) / STEP for axis in (0, 1)]
    forward = np.sqrt(sum((difference**2).mean() for difference in along))
    check("Sdq over rms of the differences to the next point", surface.Sdq() / forward, 1.0)
    check("Sdq over exact rms gradient", surface.Sdq() / exact, 0.97, 1)
    check(
        "Sdr of a plane of slope 1 in per cent",
        Surface(grid(64)[0] * 1.0, 1, 1).Sdr(),
        100 * (np.sqrt(2) - 1),
    )
    lifted = Surface(h + 100, STEP, STEP)
    check("Smr(0) in per cent", surface.Smr(0.0), 40, 60)
    check("Smr(0) of the map that is lifted by 100 µm", lifted.Smr(0.0), 100.0)
    check(
        "Sk of heights of equal frequency from 0 to 1",
        Surface(np.arange(256**2).reshape(256, 256) / 256**2, 1, 1).Sk(),
        0.999,
        1.001,
    )


def directions(check: Checks) -> None:
    """Draws ridges whose lay is 120° from the x axis, anticlockwise."""
    x, y = grid(256)
    lay = np.deg2rad(120)
    ridges = Surface(np.sin(2 * np.pi / 16 * (np.cos(lay) * y - np.sin(lay) * x)), 1, 1)
    check("Std of a lay of 120°: the direction across it", ridges.Std(), 29, 31)
    check("orientation() of a lay of 120°: from the y axis", ridges.orientation(), 29.9, 30.1)
    waves = sum(np.sin(2 * np.pi * grid(256)[0] / length) for length in (8, 32, 128))
    smooth = Surface(waves, 1, 1).filter("lowpass", 32).data[:, 64:192]
    share = abs(np.fft.rfft(smooth, axis=1)).mean(0)[4] / 64
    check("amplitude of a wave at the cutoff of the filter", share, 0.47, 0.56)


def points(check: Checks, h: np.ndarray) -> None:
    holed = h.copy()
    holed[3, 4] = np.nan
    surface = Surface(holed, STEP, STEP)
    check("Sq of a map with one NaN is refused", float(refuses(surface.Sq)), 1.0)
    check(
        "Sq of the map after fill_nonmeasured() over that of the whole map",
        surface.fill_nonmeasured().Sq() / h.std(),
        0.99,
        1.01,
    )
    mask = np.zeros(h.shape, bool)
    mask[:, :64] = True
    masked = Surface(h, STEP, STEP, mask=mask)
    check(
        "Sq of a map with a mask over rms of the points outside", masked.Sq() / h[~mask].std(), 1.0
    )
    check("Sdq of a map with a mask is refused", float(refuses(masked.Sdq)), 1.0)


def refuses(parameter) -> bool:
    try:
        parameter()
    except ValueError:
        return True
    return False


def files(check: Checks, surface: Surface) -> None:
    with TemporaryDirectory() as folder:
        for ending, factor in (("tmd", 1000.0), ("sdf", 1.0)):
            path = Path(folder, f"map.{ending}")
            surface.save(path)
            read = open_topography(str(path)).topography().to_unit("um")
            equal = np.allclose(read.heights(), factor * surface.data.T)
            check(
                f".{ending} to SurfaceTopography: heights[x, y] are data[y, x]", float(equal), 1.0
            )
            check(
                f".{ending} from surfalize to SurfaceTopography: rms height",
                read.rms_height_from_area() / surface.Sq(),
                factor * 0.999,
                factor * 1.001,
            )


def main() -> None:
    check = Checks(f"surfalize {version('surfalize')}")
    h = 1e6 * (heights() - heights().mean())
    surface = Surface(h, STEP, STEP)
    parameters(check, surface, h)
    directions(check)
    points(check, h)
    files(check, surface)
    check.finish()


if __name__ == "__main__":
    main()
