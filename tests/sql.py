"""Writes the answers of DuckDB to the queries with which the SQL of asperity is tested.

    pip install duckdb==2.0.1
    python3 tests/sql.py

reads `queries.sql` in tests/study/sql, and writes `duckdb.json` beside it: the tables, and for each query the
names and the rows of its answer. The test `duckdb_answers_alike` in tests/study/sql.rs compares.
"""

import json
import math
import pathlib
from decimal import Decimal

import duckdb

FOLDER = pathlib.Path(__file__).parent.parent / "tests/study/sql"
LOADS = [0.1, 0.2, 0.1, 0.4, 0.2, 1.0]
NAMES = ["alpha", "beta", None, "Gamma", "été", "", "beta"]


def rows_of_t():
    """Rows with nulls, ties in `load`, negative integers and groups of different sizes."""
    for row in range(24):
        key = [1, 2, 1, 3, None, 2, 1][row % 7]
        x = None if row % 5 == 3 or key == 3 else ((37 * row + 11) % 100) / 100
        n = None if row % 9 == 4 else (5 * row) % 17 - 8
        flag = [True, False, None][(row * row) % 3 if row % 4 else 2]
        yield [row + 1, key, LOADS[row * 5 % 6], x, n, flag, NAMES[row % 7]]


TABLES = {
    "t": (
        ["id bigint", "k bigint", "load double", "x double", "n bigint", "flag boolean", "name varchar"],
        list(rows_of_t()),
    ),
    "u": (
        ["k bigint", "load double", "y double"],
        [[1, 0.1, 1.5], [1, 0.2, 2.5], [2, 0.4, None], [2, 0.4, 3.5], [4, 0.1, 4.5], [None, 0.2, 5.5]],
    ),
}


def plain(value):
    if isinstance(value, Decimal):
        return float(value)
    if isinstance(value, float) and not math.isfinite(value):
        raise ValueError(f"{value} is no value of a table")
    return value


def main():
    database = duckdb.connect()
    # Nulls are larger than all values, as in PostgreSQL and in asperity.
    database.execute("set default_null_order = 'nulls_last_on_asc_first_on_desc'")
    for name, (columns, rows) in TABLES.items():
        database.execute(f"create table {name} ({', '.join(columns)})")
        database.executemany(f"insert into {name} values ({', '.join('?' * len(columns))})", rows)
    answers = []
    for query in (FOLDER / "queries.sql").read_text().splitlines():
        if query.startswith("--"):
            continue
        try:
            answer = database.execute(query)
        except duckdb.Error as error:
            raise SystemExit(f"{query}\n{error}") from error
        columns = [column[0] for column in answer.description]
        rows = [[plain(value) for value in row] for row in answer.fetchall()]
        answers.append({"query": query, "columns": columns, "rows": rows})
    tables = {name: {"columns": columns, "rows": rows} for name, (columns, rows) in TABLES.items()}
    lines = ",\n".join(json.dumps(answer, ensure_ascii=False) for answer in answers)
    text = f'{{"duckdb": "{duckdb.__version__}",\n"tables": {json.dumps(tables, ensure_ascii=False)},\n'
    (FOLDER / "duckdb.json").write_text(f'{text}"answers": [\n{lines}\n]}}\n')


if __name__ == "__main__":
    main()
