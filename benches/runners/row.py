"""row runs three actions per chain, a shell command each, in one folder per chain.

`row submit` submits only the actions that are eligible at that time. Three stages therefore take
three commands; with nothing to do, one command is enough.
"""

from pathlib import Path

VERSION = "1.1.0"
PACKAGE = ["row", "--version", VERSION]

WORKFLOW = """\
[[action]]
name = "surface"
command = "echo {directory} > workspace/{directory}/surface.txt"
products = ["surface.txt"]

[[action]]
name = "contact"
previous_actions = ["surface"]
command = "cp workspace/{directory}/surface.txt workspace/{directory}/contact.txt"
products = ["contact.txt"]

[[action]]
name = "area"
previous_actions = ["contact"]
command = "cp workspace/{directory}/contact.txt workspace/{directory}/area.txt"
products = ["area.txt"]
"""


class Tool:
    def __init__(self, program: Path):
        self.program = str(program)
        self.name = f"row {VERSION}"
        self.environment: dict[str, str] = {"ROW_CLUSTER": "none"}

    def write(self, folder: Path, chains: int) -> None:
        (folder / "workflow.toml").write_text(WORKFLOW)
        for chain in range(chains):
            (folder / "workspace" / str(chain)).mkdir(parents=True, exist_ok=True)

    def commands(self, tasks: int) -> list[list[str]]:
        submit = [self.program, "--cluster", "none", "submit", "--yes"]
        return [submit] * (3 if tasks else 1)

    def check(self, folder: Path, chains: int) -> None:
        files = len(list(folder.glob("workspace/*/*.txt")))
        assert files == 3 * chains, files
