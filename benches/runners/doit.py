"""doit runs three Python actions per chain in its own process."""

from pathlib import Path

PACKAGE = "doit==0.37.0"

DODO = """\
from pathlib import Path


def write(text, targets):
    path = Path(targets[0])
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text)


def copy(dependencies, targets):
    Path(targets[0]).write_text(Path(dependencies[0]).read_text())


def chained(name, before):
    for chain in range({chains}):
        inputs = [f"out/{{chain}}/{{before}}.txt"] if before else []
        action = copy if before else (write, [str(chain)])
        yield {{
            "name": str(chain),
            "actions": [action],
            "file_dep": inputs,
            "targets": [f"out/{{chain}}/{{name}}.txt"],
            "uptodate": [True],
        }}


def task_surface():
    yield from chained("surface", None)


def task_contact():
    yield from chained("contact", "surface")


def task_area():
    yield from chained("area", "contact")
"""


class Tool:
    def __init__(self, program: Path):
        self.program = str(program)
        self.name = PACKAGE.replace("==", " ")
        self.environment: dict[str, str] = {}

    def write(self, folder: Path, chains: int) -> None:
        (folder / "dodo.py").write_text(DODO.format(chains=chains))

    def commands(self, tasks: int) -> list[list[str]]:
        return [[self.program]]

    def check(self, folder: Path, chains: int) -> None:
        files = len(list(folder.glob("out/*/*.txt")))
        assert files == 3 * chains, files
