"""Writes and runs the notebook of the documentation: `python python/notebook.py`; with `--check`, it runs
what is there and writes nothing.
"""

import sys
from pathlib import Path

import nbformat
from nbclient import NotebookClient

REPOSITORY = Path(__file__).resolve().parent.parent
NOTEBOOK = REPOSITORY / "docs/notebooks/measured-contact.ipynb"

CELLS = [
    """# From a measured file to a contact curve

An atomic force microscope has written a scan of 10 µm × 10 µm. It is read, levelled and described, pressed into
an elastic half-space with nothing around it, and its contact area stands beside what theories make of its
roughness.""",
    """import matplotlib.pyplot as plt
import numpy as np

import asperity

scan = asperity.read("data/topography/di-3.di", channel="ZSensor")
scan""",
    """## The surface

The scanner bows, and so do the maps that it writes: the mean quadric is no roughness. A rectangle without the
edges of the scan is left.""",
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

Steel on fused silica, from a light touch to a tenth of E* × rms slope. `boundary="free"`: a scan does not repeat
itself.""",
    """bodies = [
    {"youngs_modulus": 210e9, "poisson_ratio": 0.30},
    {"youngs_modulus": 72e9, "poisson_ratio": 0.17},
]
loads = np.geomspace(0.003, 0.1, 8)
contact = asperity.press(rough, loads=loads, bodies=bodies, boundary="free")
contact""",
    """## Beside theory

The counted area is too large, because each node on the edge of the contact counts as a whole; the correction of
2017 takes that away. Nayak's parameter of the map is all that asperity models know of it, and Persson's theory
needs nothing but the load.""",
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
    """The theories are about Gaussian roughness, all of whose waves the mesh resolves. The heights of this scan are
not Gaussian, as `skewness` and `excess_kurtosis` say, and its shortest waves are as short as its mesh: how far the
area lies above both is what the scan has to say, not the theories.""",
]


def notebook() -> nbformat.NotebookNode:
    cells = []
    for number, text in enumerate(CELLS):
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
    if "--check" in sys.argv:
        written = nbformat.read(NOTEBOOK, as_version=4)
        sources = [cell.source for cell in written.cells]
        assert sources == CELLS, "the notebook is not the one of this file: run it without --check"
        run(notebook())
        print(f"{NOTEBOOK.relative_to(REPOSITORY)} runs")
        return
    NOTEBOOK.parent.mkdir(parents=True, exist_ok=True)
    nbformat.write(run(notebook()), NOTEBOOK)


if __name__ == "__main__":
    main()
