"""The problem that every code solves: a surface, and mean pressures in units of E* × rms slope."""

from dataclasses import dataclass, replace

# Number of neighbouring loads that a shorter schedule keeps together, for realistic warm starts.
RUN = 4


@dataclass(frozen=True)
class Problem:
    """A self-affine surface of unit rms slope on a unit cell, E* = 1, and its loads."""

    nodes: int
    k_lower: int
    k_upper: int
    hurst: float
    seed: int
    loads: tuple[float, ...]

    def describe(self) -> str:
        return (
            f"{self.nodes}² ({self.k_lower}, {self.k_upper}) H = {self.hurst} seed {self.seed}, "
            f"{len(self.loads)} loads {self.loads[0]:.4g} … {self.loads[-1]:.4g}"
        )

    def half(self) -> "Problem":
        """Returns a smaller cell with the same mesh step, on which tolerances are calibrated.

        The cutoffs shrink with the cell, so that the roughness in mesh steps does not change.
        """
        return replace(
            self,
            nodes=self.nodes // 2,
            k_lower=max(1, self.k_lower // 2),
            k_upper=max(2, self.k_upper // 2),
            loads=thinned(schedule(), 24),
        )

    def with_loads(self, count: int) -> "Problem":
        return replace(self, loads=thinned(self.loads, count))


def schedule() -> tuple[float, ...]:
    """Returns the 90 loads of the 2015 campaign, 50 linear to 0.06 and 40 geometric to 1.7."""
    light = [0.06 * (step + 1) / 50 for step in range(50)]
    heavy = [0.06 * (1.7 / 0.06) ** ((step + 1) / 40) for step in range(40)]
    return tuple(light + heavy)


def thinned(loads: tuple[float, ...], count: int) -> tuple[float, ...]:
    """Returns `count` of the loads as evenly spread runs of four neighbours."""
    if count >= len(loads):
        return loads
    runs = max(1, round(count / RUN))
    kept: list[float] = []
    for run in range(runs):
        length = (run + 1) * count // runs - run * count // runs
        middle = (2 * run + 1) * len(loads) // (2 * runs)
        start = min(max(0, middle - length // 2), len(loads) - length)
        kept.extend(loads[start : start + length])
    return tuple(kept)
