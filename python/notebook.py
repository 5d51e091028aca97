"""Writes and runs the notebooks of the documentation: `python python/notebook.py`. With `--check` it only runs
the existing notebooks.
"""

import ast
import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient

REPOSITORY = Path(__file__).resolve().parent.parent
NOTEBOOKS = REPOSITORY / "docs/notebooks"
EXAMPLES = ["press", "measured", "adhesion", "layer", "flow", "ensemble"]

MEASURED_CONTACT = [
    """# From a measured file to a contact curve

This notebook reads a scan of 10 µm × 10 µm from an atomic force microscope, levels and describes it, and presses
it as an isolated patch into an elastic half-space. It then compares the contact area with theories.""",
    """import matplotlib.pyplot as plt
import numpy as np

import asperity

scan = asperity.read("data/topography/di-3.di", channel="ZSensor")
scan""",
    """## The surface

The scanner bends its maps, so the mean quadric does not belong to the roughness and is subtracted. The edges of
the scan are cropped.""",
    """rough = scan.crop((1e-6, 1e-6), 7.5e-6).detrend("quadric")
statistics = rough.statistics()
statistics""",
    """spectrum = rough.power_spectrum()
figure, axes = plt.subplots(figsize=(5, 3.5))
axes.loglog(spectrum.wavenumber, spectrum.density)
axes.set_xlabel("wavenumber (1/m)")
axes.set_ylabel("C(q) (m⁴)")
plt.show()""",
    """## Its contact

Steel is pressed on fused silica, from a light load to a tenth of E* × rms slope. A scan is not periodic, hence
`boundary="free"`.""",
    """bodies = [
    {"youngs_modulus": 210e9, "poisson_ratio": 0.30},
    {"youngs_modulus": 72e9, "poisson_ratio": 0.17},
]
loads = np.geomspace(0.003, 0.1, 8)
contact = asperity.press(rough, loads=loads, bodies=bodies, boundary="free")
contact""",
    """## Comparison with theories

The counted area is too large, because each node on the edge of the contact counts as a whole. The correction of
2017 removes this excess. Asperity models use Nayak's parameter of the map, and Persson's theory uses only the
load.""",
    """corrected = [asperity.corrected_area(state.contact(), boundary="free").corrected for state in contact]
model = asperity.models.bush_gibson_thomas(statistics["nayak"])
theory = np.geomspace(loads[0], loads[-1], 100)

figure, axes = plt.subplots(figsize=(6, 4))
axes.plot(contact.load, contact.area, "o", mfc="none", label="counted")
axes.plot(contact.load, corrected, "o", label="corrected for the mesh")
axes.plot(theory, asperity.persson.area(theory), label="Persson 2001")
axes.plot(theory, model.at_load(theory).area, label="Bush, Gibson & Thomas 1975")
axes.set_xscale("log")
axes.set_yscale("log")
axes.set_xlabel("mean pressure / (E* × rms slope)")
axes.set_ylabel("contact area / apparent area")
axes.legend()
plt.show()""",
    """The theories assume Gaussian roughness and a mesh that resolves all waves. The heights of this scan are not
Gaussian, as `skewness` and `excess_kurtosis` show, and its shortest waves are as short as its mesh. The area above
both theories is therefore a property of this scan.""",
]


def six_contacts() -> list[str]:
    """Returns the examples as cells: the docstring of each, and its program."""
    cells = ["# Six contacts\n\nThe programs of `python/examples`, whose twins in Rust print the same numbers."]
    for name in EXAMPLES:
        text = (REPOSITORY / f"python/examples/{name}.py").read_text()
        says = ast.get_docstring(ast.parse(text))
        cells += [f"## {name.capitalize()}\n\n{says}", text.split('"""', 2)[2].strip()]
    return cells


def notebook(texts: list[str]) -> nbformat.NotebookNode:
    cells = []
    for number, text in enumerate(texts):
        is_code = not text.startswith(("#", "The "))
        new = nbformat.v4.new_code_cell if is_code else nbformat.v4.new_markdown_cell
        # Equal text gives equal bytes.
        cells.append(new(text, id=f"cell-{number}"))
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return nbformat.v4.new_notebook(cells=cells, metadata={"kernelspec": kernel})


def run(node: nbformat.NotebookNode) -> nbformat.NotebookNode:
    client = NotebookClient(node, timeout=300, record_timing=False)
    return client.execute(cwd=str(REPOSITORY))


def main() -> None:
    for name, texts in {"measured-contact": MEASURED_CONTACT, "six-contacts": six_contacts()}.items():
        path = NOTEBOOKS / f"{name}.ipynb"
        if "--check" in sys.argv:
            sources = [cell.source for cell in nbformat.read(path, as_version=4).cells]
            assert sources == texts, f"{name} differs from this script: run the script without --check"
            run(notebook(texts))
            print(f"{path.relative_to(REPOSITORY)} runs")
        else:
            nbformat.write(run(notebook(texts)), path)


if __name__ == "__main__":
    main()
