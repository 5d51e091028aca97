"""Snakemake runs three rules per chain, a shell command each."""

from pathlib import Path

PACKAGE = "snakemake==9.27.1"

SNAKEFILE = """\
rule all:
    input: expand("out/{{chain}}/area.txt", chain=range({chains}))

rule surface:
    output: "out/{{chain}}/surface.txt"
    shell: "echo {{wildcards.chain}} > {{output}}"

rule contact:
    input: "out/{{chain}}/surface.txt"
    output: "out/{{chain}}/contact.txt"
    shell: "cp {{input}} {{output}}"

rule area:
    input: "out/{{chain}}/contact.txt"
    output: "out/{{chain}}/area.txt"
    shell: "cp {{input}} {{output}}"
"""


class Tool:
    def __init__(self, program: Path):
        self.program = str(program)
        self.name = PACKAGE.replace("==", " ")
        # Leave the user's cache alone.
        self.environment = {"XDG_CACHE_HOME": ".cache"}

    def write(self, folder: Path, chains: int) -> None:
        (folder / "Snakefile").write_text(SNAKEFILE.format(chains=chains))

    def commands(self, tasks: int) -> list[list[str]]:
        return [[self.program, "--cores", "2", "--quiet", "all", "--", "all"]]

    def check(self, folder: Path, chains: int) -> None:
        files = len(list(folder.glob("out/*/*.txt")))
        assert files == 3 * chains, files
