"""A study in µm, MPa and GPa: every number that users see has a unit of the study, or says that it is reduced (as in
`E* × rms slope`) or a pure number. Every reduced pressure and stiffness has a column in the units of the study,
whose numbers are computed again here.

    tests/units.py PROGRAM
"""

import csv
import html
import json
import math
import re
import subprocess
import sys
import tempfile
from pathlib import Path

import pyarrow.parquet as pq

PROGRAM = Path(sys.argv[1]).resolve()

#: Every kind of stage, measure and law whose table has numbers with a unit.
MANIFEST = """\
[study]
name = "units"
seed = 1

[stage.surfaces]
kind = "generate"
nodes = [32, 64]
side = "100 um"
hurst = 0.8
k_lower = 2
k_upper = [4, 8]
rms_slope = 0.1
realizations = 2
heights = "redraw"

[stage.scan]
kind = "generate"
method = "file"
path = "scan.txt"
side = "80 um"
periodic = false

[stage.contact]
kind = "solve"
from = "surfaces"
effective_modulus = "100 GPa"
loads = ["0.2 GPa", "400 MPa", "700 MPa", "1 GPa", "2 GPa", "3 GPa", "4 GPa", "5 GPa", "6 GPa"]
stiffness = true
flow = true
pressure_bins = { count = 4, to = "60 GPa" }
gap_bins = { count = 4, to = 3 }

[stage.metal]
kind = "generate"
nodes = 32
side = "100 um"
hurst = 0.8
k_lower = 2
k_upper = 4
rms_slope = 0.1

[stage.yielding]
kind = "solve"
from = "metal"
bodies = [
    { youngs_modulus = "120 GPa", poisson_ratio = 0.34, resistivity = "17 nohm m", conductivity = "390 W/(m K)" },
    { youngs_modulus = "120 GPa", poisson_ratio = 0.34, resistivity = "17 nohm m", conductivity = "390 W/(m K)" },
]
hardness = "9 GPa"
loads = ["200 MPa", "400 MPa", "700 MPa"]
path = "there-and-back"
stiffness = true

[stage.face]
kind = "generate"
nodes = 32
side = "100 um"
hurst = 0.8
k_lower = 2
k_upper = 4
rms_slope = 0.1

[stage.coated]
kind = "solve"
from = "face"
layer = { thickness = "2 um", youngs_modulus = "50 GPa", poisson_ratio = 0.36, resistivity = "115 nohm m" }
substrate = { youngs_modulus = "120 GPa", poisson_ratio = 0.34, resistivity = "17 nohm m" }
counter_body = { resistivity = "17 nohm m" }
loads = ["200 MPa", "400 MPa"]
stiffness = true

[stage.on-base]
kind = "solve"
from = "face"
layer = { thickness = "20 um", youngs_modulus = "50 GPa", poisson_ratio = 0.36, conductivity = "66 W/(m K)" }
loads = ["200 MPa", "400 MPa"]
stiffness = true

[stage.soft]
kind = "generate"
nodes = 64
side = "100 um"
hurst = 0.8
k_lower = 2
k_upper = 4
rms_slope = 0.05
realizations = 2

[stage.adhesive]
kind = "solve"
from = "soft"
effective_modulus = "100 MPa"
adhesion = { work = "10 J/m^2", range = "1 um" }
loads = ["5 MPa", "0 MPa", "-20 MPa"]
path = "there-and-back"

[stage.scanned]
kind = "solve"
from = "scan"
effective_modulus = "70 GPa"
loads = ["10 MPa", "20 MPa"]
boundary = "free"
stiffness = true

[stage.asperities]
kind = "solve"
from = "surfaces"
effective_modulus = "100 GPa"
loads = ["0.2 GPa", "400 MPa"]
method = "asperities"
interaction = "none"

[stage.area]
kind = "measure"
from = "contact"

[stage.corrected]
kind = "correct"
from = "area"
correction = "2017"

[stage.yielded-area]
kind = "measure"
from = "yielding"

[stage.coated-area]
kind = "measure"
from = "coated"

[stage.on-base-area]
kind = "measure"
from = "on-base"

[stage.adhesive-area]
kind = "measure"
from = "adhesive"

[stage.scanned-area]
kind = "measure"
from = "scanned"

[stage.pressures]
kind = "measure"
from = "contact"
what = "pressures"

[stage.gaps]
kind = "measure"
from = "contact"
what = "gaps"

[stage.clusters]
kind = "measure"
from = "contact"
what = "clusters"

[stage.slip]
kind = "measure"
from = "contact"
friction = { coefficient = 0.5, loads = [0.5], poisson_ratio = 0.3 }

[stage.heights]
kind = "measure"
from = "scan"
what = "heights"

[stage.spectrum]
kind = "measure"
from = "scan"
what = "spectrum"

[stage.profile-spectrum]
kind = "measure"
from = "scan"
what = "profile-spectrum"

[stage.autocorrelation]
kind = "measure"
from = "scan"
what = "autocorrelation"

[stage.scales]
kind = "measure"
from = "scan"
what = "scales"

[stage.bearing]
kind = "measure"
from = "scan"
what = "bearing"

[stage.roughness]
kind = "measure"
from = "scan"
what = "roughness"

[stage.fit-contact-evolution]
kind = "fit"
from = "corrected"
law = "contact-evolution"
bootstrap = 10
kappa = 2.5

[stage.fit-self-affine]
kind = "fit"
from = "spectrum"
law = "self-affine"

[stage.fit-limits]
kind = "fit"
from = "area"
law = "limits"
of = "stiffness"
terms = [{ of = "k_upper / nodes", exponent = 1 }]
loads = [0.02]
bootstrap = 10

[stage.means]
kind = "aggregate"
from = "area"
over = ["area_fraction", "mean_gap", "energy", "stiffness", "flow_conductivity_x"]
statistics = ["mean", "sd", "ci95"]

[stage.slopes]
kind = "aggregate"
from = "area"
over = ["area_fraction", "mean_gap"]
statistics = ["slope", "secant"]

[stage.thresholds]
kind = "aggregate"
from = "fit-gap-percolation"
over = ["percolation_load_x", "percolation_load_y"]
statistics = ["mean"]

[stage.asked]
kind = "aggregate"
from = "area"
sql = "select nodes, k_upper, pressure, avg(mean_gap) as gap from area group by nodes, k_upper, pressure"
columns = { gap = { unit = "length", meaning = "mean gap" } }
"""
MANIFEST += "".join(
    f'\n[stage.fit-{law}]\nkind = "fit"\nfrom = "{read}"\nlaw = "{law}"\nbootstrap = 10\n'
    for read, laws in {
        "corrected": ["mean-pressure", "scaled-erf"],
        "area": ["load-separation", "gap-percolation", "mesh-convergence"],
    }.items()
    for law in laws
)

#: Words in units that the study has named.
NAMED = re.compile(r"(?<![A-Za-z])(µm|MPa|GPa|k?J/m²|N|K/W|W/\(m|Ω)")
#: Words in units that are multiples of other numbers, which the head of a column then says.
REDUCED = re.compile(r"E\*|rms|side|k_s|f × load|as `|per load")
#: Numbers that identify rows.
IDENTIFIERS = {"seed", "realization"}
#: Columns of reduced pressures and stiffnesses whose twin is computed with them, and not when tables are published.
TWINS = {
    "load": "pressure", "hardness_reduced": "hardness", "pull_off_load": "pull_off_pressure",
    "maximum_load": "maximum_pressure",
}
#: Contacts of the surfaces, whose tables have no modulus.
CONTACTS_OF = {"surfaces": "contact", "metal": "yielding", "face": "coated", "soft": "adhesive", "scan": "scanned"}
#: Settings and errors of the solver, which only have a meaning in its own units.
OF_SOLVER = {"tolerance", "residual"}
#: Labels of axes that are pure numbers.
PURE = (
    "A/A₀", "fraction", "load p₀/(E* h′)", "slope", "secant", "Nayak", "erf scale", "flow factor", "clusters per",
    "perimeter²", "dp̄/dp₀", "L/λ", "(h′ L)²", "area of", "the mean, %",
)


def asperity(*arguments):
    return subprocess.run([PROGRAM, *arguments], check=True, capture_output=True, text=True)


def columns_of(path):
    """Returns name, unit and metadata of the columns of numbers of a table."""
    numbers = [field for field in pq.read_schema(path) if str(field.type) in ("double", "int64")]
    words = lambda field: {key.decode(): value.decode() for key, value in field.metadata.items()}
    return [(field.name, words(field)["unit"], words(field)) for field in numbers]


def head(name, unit):
    return name if unit in ("", "1") else f"{name} [{unit}]"


def check_units(path):
    """Returns the columns without a unit, and those of reduced numbers without a twin."""
    columns = columns_of(path)
    twins = {words["reduced"]: name for name, _, words in columns if "reduced" in words}
    twins |= {reduced: name for reduced, name in TWINS.items() if name in {column[0] for column in columns}}
    table = pq.read_table(path)
    found = []
    for name, unit, words in columns:
        is_known = unit == "1" or NAMED.search(unit) or REDUCED.search(unit) or "°" in unit or name in IDENTIFIERS
        if not is_known or re.search("length|pressure", unit):
            found.append(f"{path.stem}.{name}: the unit is {unit!r}")
        if "E*" not in unit or name in OF_SOLVER or "per load" in unit:
            continue
        if name not in twins:
            found.append(f"{path.stem}.{name} [{unit}] has no column in the units of the study")
        elif "rms_slope" in table.column_names and name not in ("maximum_load",):
            check_numbers(path, table, name, unit, twins[name])
    return found


def check_numbers(path, table, name, unit, twin):
    """Computes the numbers of a twin again."""
    column = lambda name: table[name].to_pylist()
    contacts = table
    if "effective_modulus" not in table.column_names:
        contacts = pq.read_table(path.with_stem(CONTACTS_OF[path.stem]))
    moduli = contacts["effective_modulus"].to_pylist()[:1] * len(table)
    sides = column("side")
    for row, (reduced, absolute) in enumerate(zip(column(name), column(twin))):
        slope = column("rms_slope")[row]
        scale = {
            "E* × rms slope": lambda: moduli[row] * slope,
            "1/(E* × rms slope)": lambda: 1 / (moduli[row] * slope),
            "E*/side": lambda: moduli[row] / sides[row],
        }[unit]()
        assert (reduced is None) == (absolute is None), (path, name, row)
        # Loads are rounded to twelve digits.
        is_equal = reduced is None or math.isclose(absolute, reduced * scale, rel_tol=2e-11, abs_tol=1e-300)
        assert is_equal, (path, name, row, reduced, absolute, scale)


def check_heads(manifest, path):
    """Checks that all outputs of a table have the units of its file."""
    stage = path.stem
    columns = columns_of(path)
    names = ",".join(name for name, _, _ in columns)
    heads = [head(name, unit) for name, unit, _ in columns]
    printed = asperity("table", manifest, stage, "--columns", names, "--rows", "1").stdout
    missing = [text for text in heads if text not in printed]
    assert not missing, (stage, "table", missing, printed)
    of_csv = asperity("table", manifest, stage, "--columns", names, "--csv", "--units")
    titles = next(csv.reader(of_csv.stdout.splitlines()))
    assert titles == heads and not of_csv.stderr, (stage, titles, heads)
    plain = asperity("table", manifest, stage, "--columns", names, "--csv")
    assert next(csv.reader(plain.stdout.splitlines())) == names.split(","), (stage, plain.stdout)
    of_json = asperity("table", manifest, stage, "--columns", names, "--json")
    with_unit = [text for text in heads if text.endswith("]")]
    for answer in (plain, of_json):
        expected = f"units: {', '.join(with_unit)}" if with_unit else ""
        assert answer.stderr.strip().splitlines()[-1:] == ([expected] if expected else []), (stage, answer.stderr)
    return heads


def check_page(folder, heads):
    page = html.unescape((folder / "report.html").read_text())
    shown = [
        [re.sub("<[^>]*>", "", cell) for cell in re.findall(r"<button type=\"button\" title=\".*?\">(.*?)</button>", row)]
        for row in re.findall(r"<thead>(.*?)</thead>", page, re.S)
    ]
    for stage, names in heads.items():
        assert any(set(names) <= set(row) for row in shown), (stage, names)


def check_figures(folder):
    """Returns the axes and the titles of maps without a unit."""
    found = []
    for path in sorted((folder / "figures").glob("*.svg")):
        texts = re.findall(r"<text([^>]*)>(.*?)</text>", html.unescape(path.read_text()), re.S)
        texts = [(style, re.sub("<[^>]*>", "", text)) for style, text in texts]
        for (_, x), (style, y) in zip(texts, texts[1:]):
            for label in (x, y) if "rotate(-90" in style else ():
                if not (NAMED.search(label) or REDUCED.search(label) or any(word in label for word in PURE)):
                    found.append(f"{path.name}: axis `{label}`")
            if re.search(r"\([a-z]\)[^·]* -?[0-9.]+( ·|$)", y):
                found.append(f"{path.name}: map `{y}`")
    return found


def main():
    with tempfile.TemporaryDirectory() as scratch:
        manifest, data = Path(scratch, "units.toml"), Path(scratch, "data")
        manifest.write_text(MANIFEST)
        height = lambda i, j: 0.5 * math.sin(6 * math.pi * i / 32) * math.cos(4 * math.pi * j / 32) + 0.1 * math.sin(7 * i * j)
        rows = [" ".join(f"{height(i, j):.6f}" for j in range(32)) for i in range(32)]
        Path(scratch, "scan.txt").write_text("\n".join(rows) + "\n")
        global asperity
        run = asperity
        asperity = lambda *arguments: run(*arguments, "--data", data)
        asperity("run", manifest)
        folder = data / "results" / "units"
        found, heads = [], {}
        for path in sorted(folder.glob("*.parquet")):
            found += check_units(path)
            heads[path.stem] = check_heads(manifest, path)
        described = json.loads(asperity("columns", manifest, "--json").stdout)
        for stage in described:
            of_file = [column[:2] for column in columns_of(folder / f"{stage['stage']}.parquet")]
            numbers = [c for c in stage["columns"] if c["type"] in ("real", "integer")]
            assert {column["name"]: column["unit"] for column in numbers} == dict(of_file), stage["stage"]
        asperity("report", manifest)
        check_page(folder, heads)
        found += check_figures(folder)
        # Figures show pressures of all stages in the unit of the first one.
        maps = (folder / "figures/contact-maps.svg").read_text()
        assert "scan.txt · (a) 0.01 GPa" in maps and "(a) 0.2 GPa" in maps
        assert not found, "\n".join(["numbers without a unit:", *found])
        print(f"{sum(map(len, heads.values()))} columns of numbers in {len(heads)} tables have units")


main()
