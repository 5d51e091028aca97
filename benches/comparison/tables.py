"""Reads the tables of asperity, and compares contact maps.

`tables.py read DATA LOADS.json FOLDER` converts the results of asperity to the files of solve.py.
`tables.py compare NODES REFERENCE FOLDER…` prints, for each folder and load, the number of nodes
whose contact differs from the reference.
"""

import json
import sys
from pathlib import Path

import numpy as np
import pyarrow.parquet as parquet


def read(data: Path, loads: list[float], folder: Path) -> None:
    table = parquet.read_table(data / "results/peers/contact.parquet").to_pylist()
    rows = {row["load"]: row for row in table}
    key = table[0]["task"]
    maps = {}
    for file in (data / f"store/{key[:2]}").glob(f"{key}-{16 * '?'}.parquet"):
        stored = parquet.read_table(file, columns=["load", "contact"])
        maps |= {row["load"]: row["contact"] for row in stored.to_pylist()}
    with open(folder / "rows.jsonl", "w") as lines, open(folder / "maps.bin", "wb") as bits:
        for load in loads:
            # asperity rounds the numbers of a manifest to twelve digits.
            rounded = float(f"{load:.12g}")
            row = rows[rounded]
            bits.write(maps[rounded])
            line = {
                "load": load,
                "cpu_seconds": None,
                "iterations": None,
                "pairs": row["pairs"],
                "contact_nodes": row["contact_nodes"],
                "converged": row["stop"] != "pair-limit",
            }
            print(json.dumps(line), file=lines)


def contact_maps(nodes: int, folder: Path) -> dict[float, np.ndarray]:
    size = (nodes**2 + 7) // 8
    bits = np.fromfile(folder / "maps.bin", dtype=np.uint8)
    # A stopped process may have written a map without its row. Only rows count.
    with open(folder / "rows.jsonl") as rows:
        loads = [json.loads(row)["load"] for row in rows]
    return {load: bits[i * size : (i + 1) * size] for i, load in enumerate(loads)}


def compare(nodes: int, reference: Path, folders: list[Path]) -> list[list[int]]:
    truth = contact_maps(nodes, reference)
    found = [contact_maps(nodes, folder) for folder in folders]
    return [
        [int(np.bitwise_count(bits ^ truth[load]).sum()) for load, bits in maps.items()]
        for maps in found
    ]


if __name__ == "__main__":
    command, *arguments = sys.argv[1:]
    if command == "read":
        data, loads, folder = arguments
        read(Path(data), json.loads(Path(loads).read_text()), Path(folder))
    else:
        nodes, reference, *folders = arguments
        print(json.dumps(compare(int(nodes), Path(reference), [Path(f) for f in folders])))
