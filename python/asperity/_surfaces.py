"""Functions that read and generate surfaces."""

from __future__ import annotations

import os
import warnings
from typing import Any, Dict, Mapping, Optional, Sequence, Union

import numpy as np

from asperity import _asperity
from asperity._arrays import Size
from asperity._table import Table
from asperity._topography import Topography
from asperity.errors import StudyWarning, SurfaceError


def read(
    path: Union[str, "os.PathLike[str]"],
    channel: Union[str, int, None] = None,
    *,
    size: Optional[Size] = None,
    unit: Optional[str] = None,
    height_scale: float = 1.0,
    is_periodic: bool = False,
    missing: Optional[float] = None,
    mask: bool = True,
) -> Topography:
    """Reads a height map from a topography file.

    The content of the file determines its format: X3P, SUR, GWY, GSF, SDF, OPD, OPDx, AL3D, VK, LEXT,
    NanoScope, Igor, MetroPro, netCDF, HDF5, DATX, JPK, NID, NMM, WSxM, MI, FRT, BCR, NumPy, PLU, ESRI and
    Surfer grids, ISO 28600, NRRD, text and the text exports of Wyko, Zygo and Keyence.

    Parameters
    ----------
    path : str or path
        Path of the file.
    channel : str or int, optional
        Name of a channel, or its number from 1; by default, a channel of heights is chosen by name and unit.
    size : float or str, or a pair of them, optional
        Sides along x and y, in the unit of the heights or as texts such as ``"100 um"``; default: the sides in
        the file.
    unit : str, optional
        Unit of the heights, if the file has none; default: the unit of `size`, if that is a text. Lengths of
        files with a unit are in metres.
    height_scale : float
        Factor by which the numbers of the file are multiplied.
    is_periodic : bool
        True if the surface is periodic; measured maps are not.
    missing : float, optional
        Number in the file that marks points without a height, such as -9999, before any conversion.
    mask : bool
        False to keep the heights of points under a mask that a user drew in Gwyddion; otherwise they are missing.

    Returns
    -------
    Topography
        The height map.

    Raises
    ------
    ArgumentError
        If the file has no such channel, or no channel of heights.
    SurfaceError
        If the format is not supported, the file is damaged, or neither the file nor `size` gives the sides.
    OSError
        If the file cannot be read.

    Warns
    -----
    StudyWarning
        If the heights or sides are probably in another unit: an rms slope above 1, sides or pixels that the
        instrument cannot have, or given sides in the wrong order. If the reader guessed what the file does not
        say, or a number stands far from all others.

    Examples
    --------
    >>> scan = read("data/topography/di-3.di", channel="ZSensor")
    >>> scan.nodes, scan.size, scan.unit
    ((256, 256), (1e-05, 1e-05), 'm')

    A file of Gwyddion with two points under a mask:

    >>> read("data/topography/field/gwy_mask.gwy", mask=False).missing
    0
    """
    name = None if channel is None else str(channel)
    with open(path, "rb"):
        pass  # Python's own exception names the file.
    heights, found, own_unit, name, names, format, notes = _asperity.read(
        os.fspath(path), name, missing, mask
    )
    for note in notes:
        warnings.warn(f"`{path}`: {note}", StudyWarning, stacklevel=2)
    if size is None and found is None:
        raise SurfaceError(f"`{path}` does not contain the sides of the map; give them as `size`")
    if unit is not None and own_unit is not None and unit != own_unit:
        raise SurfaceError(f'the heights of `{path}` are in "{own_unit}", but `unit` is "{unit}"; omit `unit`')
    if height_scale != 1.0:
        heights = heights * height_scale
    sides = size if size is not None else found
    assert sides is not None
    read = Topography._of(heights, sides, own_unit or unit, is_periodic)
    read._warn(has_given_sides=size is not None)
    return read


def from_surfacetopography(topography: Any) -> Topography:
    """Converts a map of SurfaceTopography, with its sides, unit, periodicity and missing points.

    Heights are those of ``topography.heights()``, after all steps such as ``detrend``. Both packages store them
    as ``[x, y]``, and sides are nodes × spacing.

    Parameters
    ----------
    topography : SurfaceTopography.Topography
        Map, or a view of one.

    Returns
    -------
    Topography
        The height map; a copy of the heights.

    Raises
    ------
    SurfaceError
        If it is a line scan, a part of a map that is distributed over processes, or has no sides.

    Warns
    -----
    StudyWarning
        If the rms slope is above 1, so that heights or sides are probably in another unit.
    """
    if topography.dim != 2:
        raise SurfaceError("the topography is a line scan; a contact needs a map")
    if getattr(topography, "is_domain_decomposed", False):
        raise SurfaceError("the topography is distributed over processes; read the whole map in one process")
    if topography.physical_sizes is None:
        raise SurfaceError("the topography has no sides; give `physical_sizes` when you read it")
    heights = np.ma.filled(np.ma.array(topography.heights(), dtype=np.float64), np.nan)
    width, length = topography.physical_sizes
    unit = getattr(topography, "unit", None) or None
    return Topography(
        heights, (float(width), float(length)), unit=unit, is_periodic=bool(topography.is_periodic)
    )


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
    """Generates a random self-affine surface or a simple shape, like a `generate` stage.

    The arguments are the keys of such a stage, with the same checks as in a manifest.

    Parameters
    ----------
    nodes : int or (int, int)
        Number of nodes along each side, at least two per shortest wavelength.
    hurst : float
        Hurst exponent, 0 < H ≤ 1.
    k_lower, k_upper : int
        Lower and upper cutoff wavenumbers, inclusive, in units of 2π/(longer side).
    k_rolloff : int, optional
        Wavenumber up to which the spectrum is flat; default: no plateau.
    rms_slope : float, optional
        Rms slope √⟨|∇h|²⟩ of this surface; default: 1.
    side : float or str, or a pair of them, optional
        Sides of the cell in any unit of length, or as texts such as ``"100 um"``; default: 1.
    seed : int, optional
        Seed of the random numbers.
    realization : int
        Number that distinguishes the surfaces of one seed, from 0.
    method : str, optional
        ``"filter"`` (default), ``"random-phase"``, ``"paraboloid"``, ``"wave"``, ``"wave-product"``,
        ``"wave-sum"``, ``"flat-punch"``, or ``"spectrum"``.
    anisotropy : mapping, optional
        Anisotropy of the spectrum, such as ``{"ratio": 2.0, "angle": 30}``.
    unit : str, optional
        Unit of length, to which texts are converted; default: that of `side`, if it is a text.
    **keys
        Other keys of the method, such as ``radius`` of a paraboloid or ``amplitude`` of a wave.

    Returns
    -------
    Topography
        The surface, with its table row in ``description``.

    Raises
    ------
    ArgumentError
        If an argument is invalid.

    Warns
    -----
    StudyWarning
        If the lengths have a unit and mean an rms slope above 1.

    Notes
    -----
    The spectrum is defined in Yastrebov, Anciaux & Molinari, *Int. J. Solids Struct.* 52 (2015) 83. Equal
    arguments give equal bytes, and a finer mesh gives the same surface.

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
        # A unit without a side is that of the default side.
        "side": 1.0 if side is None and unit is not None and method not in ("file", "spectrum") else side,
        "seed": seed,
        "method": method,
        "anisotropy": None if anisotropy is None else dict(anisotropy),
        "unit": unit,
        **keys,
    }
    heights, sides, unit, slope, is_periodic, row, notices = _asperity.draw(written, realization)
    for message in notices:
        warnings.warn(message, StudyWarning, stacklevel=2)
    drawn = Topography._of(heights, sides, unit, is_periodic)
    drawn._rms_slope = slope
    drawn._description = Table(row)
    return drawn
