"""Mean contact area over sixteen random surfaces, which are pressed in parallel."""

import math
from concurrent.futures import ThreadPoolExecutor

import asperity

SURFACES = 16


def area(realization):
    surface = asperity.surface(
        nodes=128, side=100e-6, unit="m", hurst=0.8, k_lower=4, k_upper=16, rms_slope=0.1, seed=1,
        realization=realization,
    )
    return float(asperity.press(surface, loads=0.05).area[0])


with ThreadPoolExecutor() as threads:
    areas = list(threads.map(area, range(SURFACES)))
mean = math.fsum(areas) / SURFACES
variance = math.fsum((area - mean) * (area - mean) for area in areas) / (SURFACES - 1)
print("mean_area_fraction", mean, "1")
print("standard_error", math.sqrt(variance / SURFACES), "1")
