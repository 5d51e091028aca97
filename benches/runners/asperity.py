"""asperity draws, presses and measures surfaces of 8² nodes, or only draws surfaces of 128²."""

from pathlib import Path

MANIFEST = """\
[study]
name = "scale"
seed = 1

[stage.surfaces]
kind = "generate"
nodes = 8
heights = "redraw"
hurst = 0.8
k_lower = 1
k_upper = [2, 3, 4]
realizations = {realizations}

[stage.contact]
kind = "solve"
from = "surfaces"
loads = [0.1]

[stage.area]
kind = "measure"
from = "contact"
"""

MOMENTS = """\
[study]
name = "scale"
seed = 1

[stage.surfaces]
kind = "generate"
nodes = 128
heights = "redraw"
hurst = {hurst}
k_lower = 1
k_upper = [8, 16, 32]
realizations = {surfaces}

[stage.moments]
kind = "aggregate"
from = "surfaces"
over = ["nayak"]
statistics = {statistics}
"""


class Tool:
    SPECTRA = 66

    def __init__(self, program: Path):
        self.program = str(program)
        self.name = "asperity"
        self.environment = {"ASPERITY_DATA": "data"}

    def write(self, folder: Path, chains: int) -> None:
        text = MANIFEST.format(realizations=chains // 3)
        (folder / "study.toml").write_text(text)

    def commands(self, tasks: int) -> list[list[str]]:
        return [[self.program, "run", "study.toml"]]

    def write_spectra(self, folder: Path, surfaces: int, statistics=("mean", "sd")) -> None:
        hurst = [round(0.1 + 0.04 * number, 2) for number in range(self.SPECTRA // 3)]
        text = MOMENTS.format(hurst=hurst, surfaces=surfaces, statistics=list(statistics))
        (folder / "study.toml").write_text(text.replace("'", '"'))

    def command(self, word: str) -> list[str]:
        study = [] if word == "verify" else ["study.toml"]
        return [self.program, word, *study]

    def results(self, folder: Path) -> Path:
        return folder / "data" / "results" / "scale" / "surfaces.parquet"

    def check(self, folder: Path, chains: int) -> None:
        tables = len(list((folder / "data" / "store").glob("??/*.parquet")))
        assert tables == 3 * chains, tables
