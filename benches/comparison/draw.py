"""Draws a surface and saves it: `draw.py NODES K_LOWER K_UPPER HURST SEED FILE.npy`."""

import sys

import numpy as np


def self_affine(nodes: int, k_lower: int, k_upper: int, hurst: float, seed: int) -> np.ndarray:
    """Returns heights of unit rms slope on a unit cell, with peaks upward.

    Random numbers are drawn for the modes of the band only, so that a finer mesh shows the same
    surface.
    """
    band = np.arange(-k_upper, k_upper + 1)
    wavenumber = np.hypot(band[:, None], band[None, :])
    inside = (wavenumber >= k_lower) & (wavenumber <= k_upper)
    amplitude = np.zeros_like(wavenumber)
    amplitude[inside] = wavenumber[inside] ** -(hurst + 1.0)

    generator = np.random.default_rng(seed)
    modes = generator.normal(size=(*wavenumber.shape, 2)).view(np.complex128)[..., 0]
    modes = amplitude * (modes + np.conj(modes[::-1, ::-1]))
    modes /= 2.0 * np.pi * np.sqrt(np.sum((wavenumber * np.abs(modes)) ** 2))

    spectrum = np.zeros((nodes, nodes), dtype=np.complex128)
    # Add instead of assigning: at k_upper = nodes/2 the two ends of the band share a mode.
    np.add.at(spectrum, (band[:, None] % nodes, band[None, :] % nodes), modes)
    return np.fft.ifft2(spectrum).real * nodes**2


if __name__ == "__main__":
    nodes, k_lower, k_upper = map(int, sys.argv[1:4])
    heights = self_affine(nodes, k_lower, k_upper, float(sys.argv[4]), int(sys.argv[5]))
    np.save(sys.argv[6], heights)
