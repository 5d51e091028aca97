"""The surface, the half-space and the pressure of `others.py`, in SI units."""

import json
from dataclasses import asdict, dataclass

import numpy as np

NODES = 128
SIDE = 100e-6
MESH_STEP = SIDE / NODES
YOUNGS_MODULUS = 210e9
POISSON_RATIO = 0.3
EFFECTIVE_MODULUS = YOUNGS_MODULUS / (1 - POISSON_RATIO**2)
RMS_SLOPE = 0.05
PRESSURE = 500e6
# Maps of instruments are rarely centred.
MEAN_HEIGHT = 300e-9


def heights() -> np.ndarray:
    """Returns a periodic map in metres, indexed [x, y], from a formula without random numbers.

    It is a sum of waves (kx, ky) with 3 to 16 waves per side. Amplitudes fall as k^-1.8, and the
    phase of wave number i is 2π times the fractional part of i² × golden ratio.
    """
    x = np.arange(NODES) / NODES
    sum_of_waves = np.zeros((NODES, NODES))
    golden = (5**0.5 - 1) / 2
    waves = [(kx, ky) for kx in range(17) for ky in range(-16, 17) if 3 <= np.hypot(kx, ky) <= 16]
    for number, (kx, ky) in enumerate(waves):
        phase = 2 * np.pi * (number**2 * golden % 1.0)
        wave = 2 * np.pi * (kx * x[:, None] + ky * x[None, :]) + phase
        sum_of_waves += np.hypot(kx, ky) ** -1.8 * np.cos(wave)
    roughness = sum_of_waves * RMS_SLOPE / gradient(sum_of_waves, (SIDE, SIDE))
    return MEAN_HEIGHT + roughness


def amplitudes(h: np.ndarray, sides) -> tuple[np.ndarray, np.ndarray]:
    """Returns |q|² in rad²/length² and |ĥ|² of the waves of a periodic map; Σ |ĥ|² = ⟨h²⟩."""
    qx, qy = (2 * np.pi * np.fft.fftfreq(n, side / n) for n, side in zip(h.shape, sides))
    squares = np.abs(np.fft.fft2(h) / h.size) ** 2
    return qx[:, None] ** 2 + qy[None, :] ** 2, squares


def gradient(h: np.ndarray, sides) -> float:
    """Returns the rms gradient of a periodic map, √(Σ q² |ĥ|²)."""
    q2, squares = amplitudes(h, sides)
    return float(np.sqrt((q2 * squares).sum()))


def edges(contact: np.ndarray) -> int:
    """Counts the cell edges between contact and gap, also those across the edges of the map."""
    return int(sum((contact != np.roll(contact, 1, axis)).sum() for axis in (0, 1)))


@dataclass
class Quantity:
    """A number as a program states it, and the same quantity in SI units."""

    name: str
    value: float
    unit: str
    conversion: str
    converted: float


def report(program: str, quantities: list[Quantity]) -> None:
    """Prints the quantities of one program as a line of JSON for `others.py`."""
    lines = [asdict(quantity) for quantity in quantities]
    print(json.dumps({"program": program, "quantities": lines}, default=float))


class Checks:
    """Prints the claims of the guide about one program, each with the number that shows it."""

    def __init__(self, program: str):
        self.failed = False
        print(program)

    def __call__(self, claim: str, seen, low: float, high: float | None = None) -> None:
        """Compares a number with a value, to rounding, or with a range."""
        holds = np.isclose(seen, low, rtol=1e-6) if high is None else low <= seen <= high
        self.failed |= not holds
        print(f"  {'ok   ' if holds else 'WRONG'} {seen:<12.6g} {claim}")

    def finish(self) -> None:
        if self.failed:
            raise SystemExit("error: a claim of docs/how-to/from-other-programs.md does not hold")
