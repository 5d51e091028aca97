"""Example of a user script, for Python and for mypy --strict."""

from typing import List

import numpy as np
from numpy.typing import NDArray

import asperity


def areas(loads: List[float], surfaces: int) -> NDArray[np.float64]:
    rows = []
    for number in range(surfaces):
        rough = asperity.surface(
            nodes=64, hurst=0.8, k_lower=2, k_upper=16, seed=1, realization=number
        )
        rows.append(asperity.press(rough, loads=loads).area)
    return np.array(rows)


def main() -> None:
    loads = [0.01, 0.02, 0.05]
    mean = areas(loads, 3).mean(axis=0)
    theory: NDArray[np.float64] = asperity.persson.area(loads)
    law = asperity.EvolutionLaw(kappa=2.5, beta=1.0, mu=0.6)
    print(mean, theory, law.area(loads))
    flat = np.zeros((8, 8))
    for state in asperity.press_each(flat, size=1.0, boundary="periodic", loads=0.1):
        gap: NDArray[np.float64] = state.gap()
        print(state.load, gap.max())
    try:
        asperity.Study("nothing.toml").plan()
    except asperity.ManifestError as error:
        print(error.file, error.line, [problem.message for problem in error.problems])


if __name__ == "__main__":
    main()
