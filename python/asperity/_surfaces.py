"""Surfaces from files of instruments, and surfaces that are drawn."""

from __future__ import annotations

import os
from typing import Any, Dict, Mapping, Optional, Sequence, Union

from asperity import _asperity
from asperity._arrays import Size
from asperity._table import Table
from asperity._topography import Topography
from asperity.errors import SurfaceError


def read(
    path: Union[str, "os.PathLike[str]"],
    channel: Union[str, int, None] = None,
    *,
    size: Optional[Size] = None,
    unit: Optional[str] = None,
    height_scale: float = 1.0,
    is_periodic: bool = False,
) -> Topography:
    """Reads a map of heights in the file of an instrument.

    The format is found out from the content of the file: X3P, SUR, GWY, GSF, SDF, OPD, AL3D, NanoScope, Igor,
    MetroPro, netCDF, MI, FRT, BCR, NumPy, PLU and text.

    Parameters
    ----------
    path : str or path
        The file.
    channel : str or int, optional
        Name of a channel, or its number from 1 on; the first one of heights when left out.
    size : float or (float, float), optional
        Sides along x and y, in the unit of the heights; those in the file when left out.
    unit : str, optional
        Unit of the heights, a label, where the file has none. Lengths of files with a unit are metres.
    height_scale : float
        Factor that turns the numbers of the file into heights.
    is_periodic : bool
        Whether the map repeats itself: measured maps do not.

    Raises
    ------
    SurfaceError
        If the file has no format that is read, is damaged, has no such channel, or no `size`.
    OSError
        If it cannot be read at all.

    Examples
    --------
    >>> scan = read("data/topography/di-3.di", channel="ZSensor")
    >>> scan.nodes, scan.size, scan.unit
    ((256, 256), (1e-05, 1e-05), 'm')
    """
    name = None if channel is None else str(channel)
    with open(path, "rb"):
        pass  # Python's own error names the file.
    heights, found, own_unit, name, names, format = _asperity.read(os.fspath(path), name)
    if size is None and found is None:
        raise SurfaceError(f"`{path}` does not say how large the map is: give its `size`")
    if unit is not None and own_unit is not None and unit != own_unit:
        raise SurfaceError(f'`{path}` has its heights in "{own_unit}", `unit` is "{unit}"')
    if height_scale != 1.0:
        heights = heights * height_scale
    sides = size if size is not None else found
    assert sides is not None
    return Topography(heights, sides, unit=own_unit or unit, is_periodic=is_periodic)


def surface(
    nodes: Union[int, Sequence[int]],
    *,
    hurst: Optional[float] = None,
    k_lower: Optional[int] = None,
    k_upper: Optional[int] = None,
    k_rolloff: Optional[int] = None,
    rms_slope: Optional[float] = None,
    side: Optional[Size] = None,
    seed: Optional[int] = None,
    realization: int = 0,
    method: Optional[str] = None,
    anisotropy: Optional[Mapping[str, float]] = None,
    unit: Optional[str] = None,
    **keys: Any,
) -> Topography:
    """Draws a random self-affine surface, or a simple shape: heights that a `generate` stage makes.

    The arguments are the keys of such a stage, and are checked as in a manifest.

    Parameters
    ----------
    nodes : int or (int, int)
        Nodes along each side, at least two to the shortest wave.
    hurst : float
        Hurst exponent, above 0 and at most 1.
    k_lower, k_upper : int
        Cutoff wavenumbers, in units of 2π over the longer side, both included.
    k_rolloff : int, optional
        Up to where the spectrum is flat; no plateau when left out.
    rms_slope : float, optional
        √⟨|∇h|²⟩ of this very surface; 1 when left out.
    side : float or (float, float), optional
        Sides of the cell, in any unit of length; 1 when left out.
    seed : int, optional
        Names a family of draws.
    realization : int
        Names one of them.
    method : str, optional
        ``"filter"`` when left out, ``"random-phase"``, ``"paraboloid"``, ``"wave"``, ``"wave-product"``,
        ``"wave-sum"``, ``"flat-punch"``, or ``"spectrum"``.
    anisotropy : mapping, optional
        A grain, ``{"ratio": 2.0, "angle": 30}``.
    unit : str, optional
        Unit of length, a label.
    **keys
        Other keys of the method, as ``radius`` of a paraboloid or ``amplitude`` of a wave.

    Returns
    -------
    Topography
        Periodic, with the description of its stage.

    Raises
    ------
    ArgumentError
        If an argument makes no sense.

    Notes
    -----
    The spectrum is that of Yastrebov, Anciaux & Molinari, *Int. J. Solids Struct.* 52 (2015) 83. Equal
    arguments give equal bytes, and finer meshes the same surface.

    Examples
    --------
    >>> rough = surface(nodes=128, hurst=0.8, k_lower=2, k_upper=32, rms_slope=0.1, seed=7)
    >>> round(rough.statistics()["rms_slope"], 12)
    0.1
    >>> surface(nodes=128, hurst=0.8, k_lower=2, k_upper=100)
    Traceback (most recent call last):
    ...
    asperity.errors.ArgumentError: `k_upper = 100` needs at least 200 nodes per side, ...
    """
    written: Dict[str, Any] = {
        "nodes": nodes,
        "hurst": hurst,
        "k_lower": k_lower,
        "k_upper": k_upper,
        "k_rolloff": k_rolloff,
        "rms_slope": rms_slope,
        "side": side,
        "seed": seed,
        "method": method,
        "anisotropy": None if anisotropy is None else dict(anisotropy),
        **keys,
    }
    heights, sides, slope, is_periodic, row = _asperity.draw(written, realization)
    drawn = Topography(heights, sides, unit=unit, is_periodic=is_periodic)
    drawn._rms_slope = slope
    drawn._description = Table(row)
    return drawn
