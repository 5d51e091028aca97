#!/usr/bin/env python3
"""Times queries on a table of a million rows in asperity, polars and DuckDB.

A study of 11,112 surfaces under 90 loads is run once, in `target/queries`. Its table of areas has a
million rows. asperity starts for every query, reads the manifest, plans the study and looks for its
tasks. polars is timed in a new Python process and in a running one, DuckDB in a running one. The
script compares the answers and prints the best of several rounds.

    cargo build --profile dist
    python3 benches/queries.py --asperity target/dist/asperity

It needs `pip install polars duckdb`.
"""

import argparse
import csv
import io
import os
import platform
import subprocess
import sys
from pathlib import Path
from time import perf_counter

import duckdb
import polars

ROOT = Path(__file__).resolve().parent.parent
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")).resolve()

MANIFEST = """\
[study]
name = "queries"
seed = 1

[stage.surfaces]
kind = "generate"
nodes = 8
heights = "redraw"
hurst = [0.3, 0.5, 0.8]
k_lower = 1
k_upper = [2, 3, 4]
realizations = 1235

[stage.contact]
kind = "solve"
from = "surfaces"
loads = { to = 0.9, steps = 90 }

[stage.area]
kind = "measure"
from = "contact"
"""

QUESTIONS = {
    "group by": """select k_upper, hurst, load, avg(area_fraction) as mean, count(*) as n
        from area group by k_upper, hurst, load order by k_upper, hurst, load""",
    "join": """select a.k_upper, avg(a.area_fraction * s.nayak) as mean
        from area a join surfaces s using (surface) group by a.k_upper order by a.k_upper""",
    "filter": """select surface, load, area_fraction from area
        where load < 0.03 and hurst = 0.8 order by load, surface""",
    "median": """select hurst, median(area_fraction) as middle from area
        group by hurst order by hurst""",
    "sort, limit": """select surface, load, perimeter_manhattan from area
        order by perimeter_manhattan desc, surface, load limit 10""",
    "count": "select count(*) as n from area",
}


IN_A_NEW_PYTHON = """
import sys, polars
names = zip(sys.argv[2::2], sys.argv[3::2])
scans = {name: polars.scan_parquet(path) for name, path in names}
print(polars.SQLContext(scans, eager=True).execute(sys.argv[1]).write_csv())
"""


def best(work, rounds: int):
    """Returns the shortest time of several calls and the result of the last."""
    times = []
    for _ in range(rounds):
        start = perf_counter()
        answer = work()
        times.append(perf_counter() - start)
    return min(times), answer


class Asperity:
    def __init__(self, program: Path, folder: Path):
        self.command = [str(program), "--data", str(folder / "data")]
        self.manifest = str(folder / "study.toml")

    def run(self, *arguments: str, **options) -> bytes:
        done = subprocess.run([*self.command, *arguments], capture_output=True, **options)
        if done.returncode != 0:
            sys.exit(f"error: {' '.join(arguments)}: {done.stderr.decode()}")
        return done.stdout

    def ask(self, question: str) -> list[tuple]:
        text = self.run("table", self.manifest, "--csv", "--sql", question).decode()
        return [tuple(row.values()) for row in csv.DictReader(io.StringIO(text))]


def rows_agree(ours: list[tuple], theirs: list[tuple]) -> bool:
    def equal(own: str, other) -> bool:
        if isinstance(other, float):
            return abs(float(own) - other) <= 1e-12 * max(1.0, abs(other))
        return own == str(other)

    return len(ours) == len(theirs) and all(
        all(map(equal, own, other)) for own, other in zip(ours, theirs)
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--asperity", type=Path, default=TARGET / "release" / "asperity")
    parser.add_argument("--rounds", type=int, default=5)
    arguments = parser.parse_args()
    folder = TARGET / "queries"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "study.toml").write_text(MANIFEST)
    ours = Asperity(arguments.asperity.resolve(), folder)
    ours.run("run", ours.manifest)
    results = folder / "data" / "results" / "queries"
    tables = {name: str(results / f"{name}.parquet") for name in ["area", "surfaces"]}
    frame = polars.scan_parquet(tables["area"])
    columns = len(frame.collect_schema())
    count = frame.select(polars.len()).collect().item()
    size = os.path.getsize(tables["area"]) / 1e6
    print(f"{count} rows, {columns} columns, {size:.0f} MB; {platform.machine()}, "
          f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}")
    database = duckdb.connect()
    for name, path in tables.items():
        database.execute(f"create view {name} as select * from read_parquet('{path}')")

    def in_polars(question: str) -> list[tuple]:
        scans = {name: polars.scan_parquet(path) for name, path in tables.items()}
        return polars.SQLContext(scans, eager=True).execute(question).rows()

    def in_a_new_python(question: str) -> None:
        named = [word for table in tables.items() for word in table]
        command = [sys.executable, "-c", IN_A_NEW_PYTHON, question, *named]
        subprocess.run(command, stdout=subprocess.DEVNULL, check=True)

    rounds = arguments.rounds
    print(f"{'':14}{'asperity':>10}{'polars, new':>13}{'over it':>9}{'polars':>9}{'DuckDB':>9}")
    out = []
    for name, question in QUESTIONS.items():
        own, answer = best(lambda: ours.ask(question), rounds)
        by_polars, expected = best(lambda: in_polars(question), rounds)
        by_duckdb, _ = best(lambda: database.execute(question).fetchall(), rounds)
        new, _ = best(lambda: in_a_new_python(question), rounds)
        agree = "" if rows_agree(answer, expected) else "  ANSWERS DIFFER"
        print(f"{name:14}{own:10.3f}{new:13.3f}{own / new:9.2f}{by_polars:9.3f}{by_duckdb:9.3f}{agree}")
        out.append([name, own, new, by_polars, by_duckdb])
    few, _ = best(lambda: ours.run("table", ours.manifest, "area", "--rows", "5"), rounds)
    print(f"{'--rows 5':14}{few:10.3f}")
    target = folder / "copy.csv"
    copy = f"copy area to '{target}' (header, delimiter ',')"
    by_duckdb, _ = best(lambda: database.execute(copy), 2)

    def our_copy() -> None:
        with target.open("wb") as file:
            command = [*ours.command, "table", ours.manifest, "area", "--csv"]
            subprocess.run(command, stdout=file, check=True)

    own, _ = best(our_copy, 2)
    target.unlink()
    print(f"{'--csv':14}{own:10.3f}{'':31}{by_duckdb:9.3f}, {own / by_duckdb:.2f} over DuckDB")
    out += [["--rows 5", few, *3 * [None]], ["--csv", own, None, None, by_duckdb]]
    written = ROOT / "benches" / "results"
    written.mkdir(exist_ok=True)
    with (written / "queries.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(["question", "asperity_s", "polars_in_a_new_python_s", "polars_s", "duckdb_s"])
        writer.writerows(out)


if __name__ == "__main__":
    main()
