"""asperity: a surface of 8 × 8 nodes is drawn, pressed once and measured."""

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


class Tool:
    def __init__(self, program: Path):
        self.program = str(program)
        self.name = "asperity"
        self.environment = {"ASPERITY_DATA": "data"}

    def write(self, folder: Path, chains: int) -> None:
        text = MANIFEST.format(realizations=chains // 3)
        (folder / "study.toml").write_text(text)

    def commands(self, tasks: int) -> list[list[str]]:
        return [[self.program, "run", "study.toml"]]

    def plan(self) -> list[str]:
        return [self.program, "plan", "study.toml"]

    def check(self, folder: Path, chains: int) -> None:
        tables = len(list((folder / "data" / "store").glob("??/*.parquet")))
        assert tables == 3 * chains, tables
