"""Compares `asperity surface --json` with the values that other programs read from the same files.

`python3 tests/topography_truth.py PROGRAM FOLDER` compares every row of `FOLDER/truth.csv` with the
file of this name in the folder. Nodes and missing points must be equal, heights at the corners and
extremes must agree to 1e-12 of the highest magnitude, and sides and rms heights to 1e-9. An empty
corner is a missing point. A row without the name of a channel is the first channel.
"""

import csv
import json
import subprocess
import sys
from collections import Counter
from pathlib import Path

CORNERS = ("first", "x_end", "y_end", "last")
UNNAMED = ("", "Default", "default")


def read(program, file):
    run = subprocess.run([program, "surface", file, "--json"], capture_output=True, text=True)
    if run.returncode != 0:
        raise ValueError(run.stderr.strip())
    return json.loads(run.stdout)["channels"]


def find(channels, name, before):
    """Returns the channel of this name, after those of the same name that were compared before."""
    named = [channel for channel in channels if channel["name"] == name]
    if not named and name in UNNAMED:
        return channels[0]
    return named[before]


def differences(row, channel):
    def compare(what, expected, found, tolerance):
        if (expected == "") != (found is None):
            yield f"{what} is {found}, expected {expected or 'none'}"
        elif expected != "" and abs(found - float(expected)) > tolerance * abs(float(expected)):
            yield f"{what} is {found!r}, expected {expected}"

    sides = channel["size"] or [None, None]
    for axis, (nodes, side) in enumerate(zip(channel["nodes"], sides)):
        letter = "xy"[axis]
        yield from compare(f"nodes_{letter}", row[f"nodes_{letter}"], nodes, 0)
        yield from compare(f"side_{letter}", row[f"side_{letter}"], side, 1e-9)
    yield from compare("missing", row["missing"], channel["missing"], 0)
    yield from compare("rms_height", row["rms_height"], channel["rms_height"], 1e-9)
    for name in ("lowest", "highest"):
        yield from compare(name, row[name], channel[name], 1e-12)
    for name in CORNERS:
        yield from compare(name, row[name], channel["corners"][name], 1e-12)


def main():
    program, folder = sys.argv[1], Path(sys.argv[2])
    with open(folder / "truth.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    compared, by, wrong = Counter(), Counter(), 0
    for row in rows:
        # A file that two programs have read is compared with both.
        reader = (row["file"], row["by"], row["channel"])
        try:
            channel = find(read(program, folder / row["file"]), row["channel"], by[reader])
            found = list(differences(row, channel))
        except (ValueError, IndexError) as error:
            found = [f"{type(error).__name__}: {error}"]
        by[reader] += 1
        compared[row["file"]] += 1
        for difference in found:
            wrong += 1
            print(f"{row['file']}, {row['channel'] or 'the channel'}: {difference}")
    print(f"{len(rows)} channels of {len(compared)} files, {wrong} differences")
    sys.exit(wrong > 0)


main()
