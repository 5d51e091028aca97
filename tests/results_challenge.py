"""The contact-mechanics challenge: areas without and with adhesion, from the tables of challenge.toml."""

import math

import polars as pl

from results_tables import digits, least_squares, ranging, rows, table

# Range of interaction of the challenge, in nm.
RANGE = 2.071


def per_cent(row, name, count=3):
    return digits(100 * row[f"{name}_mean"], count)


def elastic():
    areas = table("challenge", "mean-areas").sort("load").to_dicts()
    gaps = table("challenge", "mean-gaps").sort("load").to_dicts()
    lines = [[digits(area["pressure"], 3), digits(area["load"], 2), per_cent(area, "area_fraction"),
              per_cent(area, "area_corrected"), digits(1e3 * gap["mean_gap_mean"], 3), digits(gap["stiffness_mean"], 3)]
             for area, gap in zip(areas, gaps, strict=True)]
    return rows(["pressure, kPa", "load", "area counted, %", "area corrected as in 2017, %", "mean gap, µm",
                 "stiffness (L/E\\*) dp₀/dδ"], lines)


def with_adhesion():
    lines = [[digits(1e6 * row["interaction_range"], 4), per_cent(row, "contact_fraction"),
              per_cent(row, "repulsive_fraction"), digits(1e3 * row["mean_gap_mean"], 4)] for row in ranges()]
    gap = at_reference("mean-gaps")["mean_gap_mean"]
    counted = per_cent(at_reference("mean-areas"), "area_fraction")
    lines.append(["no adhesion", counted, counted, digits(1e3 * gap, 4)])
    return rows(["range, nm", "area in contact, %", "repulsive area, %", "mean gap, µm"], lines)


def ranges():
    return table("challenge", "adhesive-areas").sort("interaction_range").to_dicts()


def at_reference(name):
    return table("challenge", name).filter((pl.col("pressure") - 250).abs() < 1e-6).to_dicts()[0]


def extrapolated():
    """Returns the contact fraction at the range of the challenge, from three forms of its dependence on the range ρ.

    The forms are a parabola through all three points, and lines in √ρ and in ln ρ through the two shortest ranges.
    """
    points = [(1e6 * row["interaction_range"] / RANGE, row["contact_fraction_mean"]) for row in ranges()]
    constant, linear, square = least_squares([[1, x, x * x] for x, _ in points], [y for _, y in points], [1] * len(points))
    told = [constant + linear + square]
    for form in (math.sqrt, math.log):
        (x, y), (other_x, other_y) = ((form(x), y) for x, y in points[:2])
        told.append(y + (form(1) - x) / (other_x - x) * (other_y - y))
    return told


def correction():
    """Returns the corrected over the counted area without adhesion, under the load of the challenge."""
    row = at_reference("mean-areas")
    return row["area_corrected_mean"] / row["area_fraction_mean"]


def words():
    """Returns sentences on the areas under the load of the challenge."""
    without = at_reference("mean-areas")
    shortest, *_, longest = (100 * row["contact_fraction_mean"] for row in ranges())
    limit = [100 * value for value in extrapolated()]
    return (f"Under the load of the challenge, 250 kPa, {per_cent(without, 'area_fraction', 3)} % of the nodes are in contact "
            f"without adhesion. With its work of adhesion, {digits(longest, 3)} to {digits(shortest, 3)} % are, for ranges of "
            f"interaction from six to three times that of the challenge. Extrapolated to its range, the fraction is "
            f"{ranging(limit, 2)} %. The mesh has four nodes to the shortest wavelength only. The correction for the mesh of 2017 "
            f"reduces the area without adhesion to {per_cent(without, 'area_corrected', 3)} %.")


def page():
    return f"""\
# The contact-mechanics challenge

The contact-mechanics challenge (Müser et al., *Tribol. Lett.* 65, 2017, 118; definition in arXiv 1512.02403) asked for
predictions on one rough surface with short-ranged adhesion: a square of 0.1 mm, H = 0.8, waves from 20 µm (roll-off) to
0.1 µm, rms slope 1, E\\* = 25 MPa, work of adhesion 50 mJ/m², range of interaction 2.071 nm. The reference load is 250 kPa. The
organisers solved it on 65536 × 65536 points.

`challenge.toml` solves two random surfaces with this spectrum on 4096 × 4096 nodes. {words()}

## Without adhesion

The definition of the challenge covers contact areas between 0.1 and 15 %:

{elastic()}
## With adhesion

A mesh resolves an interaction if Δx w/(E\\* ρ²) is at most π/2 ([theory](../theory/adhesion.md)). On 4096 × 4096 nodes this
holds for ranges ρ of at least 2.7 times 2.071 nm; the range of the challenge needs 32768 × 32768 nodes, about 260 GB of
memory. The study therefore has three longer ranges with the same work of adhesion, under 250 kPa on approach:

{with_adhesion()}
The area grows as the range becomes shorter. At 2.071 nm a parabola in the range gives
{digits(100 * extrapolated()[0], 3)} %, and straight lines through the two shortest ranges give
{digits(100 * extrapolated()[1], 3)} % in the square root of the range and {digits(100 * extrapolated()[2], 3)} % in its
logarithm. All these areas are counted on the mesh of four nodes to the shortest wavelength. If its error is relatively as
large as without adhesion, the areas of a fine mesh are {digits(correction(), 2)} times as large. The mean gap hardly depends on
adhesion.

![Density of the pressure under 250 kPa, without adhesion and for three ranges of interaction.](../images/results/challenge-reference.svg)

*Density of the pressure under 250 kPa, without adhesion and for three ranges of interaction. Negative pressures are
attractive.*

![Distribution of the gap under three of the loads.](../images/results/challenge-gap-distribution.svg)

*Distribution of the gap under three of the loads.*

The published areas and distributions are in figures, so we compare no numbers with them.

## The surface of the challenge

The organisers publish their surface as a file. To use it, replace the stage `surface` of the manifest by one that reads the
file; HDF5, text and [other formats](../how-to/measured-surface.md) are recognised by their content. With another file in
its place:

```toml
[stage.surface]
kind = "generate"
method = "file"
path = "../data/topography/nc-1.nc"
periodic = true
heights = "redraw"
```

The key `side` is necessary if the file does not state it. `height_scale` converts heights that are in another unit."""
