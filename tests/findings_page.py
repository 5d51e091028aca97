"""The text of docs/findings.md, with the tables of findings_tables.py."""

import textwrap

import findings_claims as claims
import findings_kappa as kappa
import findings_tables as t

CAMPAIGN = "yastrebov-2015"

# The tables and figures of each study that the page uses.
STUDIES = {
    CAMPAIGN: (
        ["curves", "law", "least-convex", "pressure-growth", "near-full", "errors", "spectra"],
        ["area-light", "slope", "area-full", "contact-maps", "near-full-contact", "pressure-growth", "area-corrected",
         "collapse", "relative-error"],
    ),
    "nayak": (["table"], ["nayak"]),
    "heights": (["kurtosis"], ["heights"]),
    "literature": (["secants"], []),
    "mesh-convergence": (["regression", "curves"], ["mesh-convergence"]),
    "hurst": (["curves", "law", "spectra"], []),
    "same-nayak": (["curves", "spectra"], ["collapse"]),
    "plateau": (["curves", "spectra"], []),
    "limits": (["kappa-points", "gap-points", "threshold", "kappa-limits", "gap-limits", "percolation-limits"], ["limits"]),
    "asperities": (["beside", "spectra"], []),
    "asperities-1024": (["beside", "spectra"], ["asperities"]),
    "distributions": (["mean-pressures"], ["contact-pressures", "gap-distribution", "clusters"]),
    "pressure-edges": (["mean-pressures"], []),
    "sealing": (["threshold", "mean-leak"], ["sealing", "flow"]),
    "flow-mesh": (["mean-flow", "over-finest"], []),
}


def figure(study, name, caption):
    return f"![{caption}](images/findings/{study}-{name}.svg)\n\n*{caption}.*\n"


def page():
    text = "\n".join([introduction(), surfaces(), light(), mesh(), slope(), full_contact(), growth(), limits(),
                      asperities(), distributions(), sealing(), misprints()])
    claims.assert_all_told(text, CAMPAIGN)
    return "\n\n".join(map(filled, text.split("\n\n")))


def filled(paragraph):
    """Fills a paragraph or a list to 110 columns; headings, tables and figures stay."""
    if paragraph.startswith(("#", "|", "!", "*", "<")) or not paragraph.strip():
        return paragraph
    end = "\n" if paragraph.endswith("\n") else ""
    lines = paragraph.splitlines() if paragraph.startswith("- ") else [" ".join(paragraph.split())]
    return "\n".join(textwrap.fill(line, 110, subsequent_indent="  " if line.startswith("- ") else "",
                                   break_long_words=False, break_on_hyphens=False) for line in lines) + end


def introduction():
    return f"""\
# Findings

<!-- Written by tests/findings.py from the tables under data/findings; do not edit. -->

This page compares the paper (Yastrebov, Anciaux & Molinari 2015) with the results of the shipped manifests: its claims,
tables and figures, and the questions that it leaves open. `asperity run`, `asperity claims` and `asperity report` computed
all results. The page is generated from their tables, which are in `data/findings/`, one folder for each study. You can
open these tables in polars, pandas or DuckDB.

{t.provenance(STUDIES)}
The first study repeats the whole campaign of the paper: nine spectra of H = 0.8, fifty surfaces of each on 1024 × 1024
nodes, and ninety loads from first touch to full contact. The *load* is p₀/(E\\* h′) with the rms slope h′. The *area* is a
fraction of the nominal area. A number after ± is a standard error between surfaces.

## Summary

{claims.counted(CAMPAIGN)}
A claim **holds** if each of its quantities is as expected at one-sided 95 %. It **does not hold** if one quantity is not,
in intervals that cover all quantities at 95 %. Otherwise the study **cannot say** ([more](how-to/claims.md)). Brackets after
a result are the one-sided bounds if the claim holds, and the joint intervals if it does not. The expected ranges are our
reading of sentences in words. “Cannot say” only means that fifty surfaces do not decide on this reading.

- The counted area at a load of 0.06 is {t.area_at(0.06)}. It exceeds Persson's {t.persson_at(0.06)} for all spectra.
- Counted areas form groups by k_l. {claims.collapse(CAMPAIGN)}
- {kappa.words()}
- Full contact is reached at loads of {t.full_contact_range()}, not at 1.7.
- {t.asperity_words()}
- {t.sealing_words()}
"""


def surfaces():
    return f"""\
## Surfaces (section 3, appendices A and B)

{claims.table(CAMPAIGN, ["heights-are-gaussian-from-k-lower-4", "heights-are-not-gaussian-for-k-lower-1",
                         "modes-come-from-k-lower", "tabulated-density-of-summits", "asymptote-of-alpha"])}
{figure("heights", "heights", "Density of heights for a thousand surfaces of each spectrum (figs. 3 and 16)")}
The numerical tables of α and D in the paper are means over 200 surfaces of 1024 × 1024 nodes. `nayak.toml` computes them
for 200 other surfaces:

{claims.table("nayak", ["table-of-alpha", "table-of-summit-density"])}
Nayak's parameter α (table 2): printed, found, and in closed form. The closed form is the sum over the wavenumbers of the
cell, to which the means converge.

{t.tabulated("nayak_mean", "nayak_sem", "nayak_lattice", "yastrebov-2015-nayak")}
Density of summits D in integer wavenumbers (table 3). Per L² the density is (2π)² times as large (T5).

{t.tabulated("summit_density_integer_mean", "summit_density_integer_sem", None, "yastrebov-2015-summit-density")}
{figure("nayak", "nayak", "Nayak's parameter against the cutoffs (fig. 14)")}
The nine spectra of the campaign:

{t.spectra()}"""


def light():
    return f"""\
## Contact under light load (section 5, figs. 5, 7 and 8)

{claims.table(CAMPAIGN, ["area-at-0.06", "area-above-persson", "widest-k-lower-is-close-to-bgt-asymptote",
                         "area-grows-with-k-lower", "area-groups-by-k-lower", "no-convergence-in-k-lower",
                         "area-falls-with-alpha", "alpha-alone-does-not-decide",
                         "effect-of-alpha-is-weaker-than-in-asperity-models", "alpha-in-asperity-models",
                         "greenwood-2006-far-from-its-asymptote", "scatter-falls-with-cutoffs"])}
The areas of the nine spectra near three loads, compared with two theories:

{t.areas()}
{figure(CAMPAIGN, "area-light", "Counted contact area and its secant (fig. 5)")}
{figure(CAMPAIGN, "contact-maps", "Contact of one surface for each of two spectra (figs. 7 and 8)")}
`literature.toml` uses the cutoffs of earlier studies (table 1, fig. 1), with eight surfaces each on 512 × 512 nodes. The table
gives the secant, area over load, in units of √(2π) at the load 0.06. It is 0.64 in Persson's theory and 1 in asperity
models without interaction.

{t.literature()}"""


def mesh():
    return f"""\
## Error of the mesh (section 8, figs. 11 to 13)

The counted area consists of whole nodes, but nodes on the edge of contact are only partly in contact. The paper
subtracts π/8 of the switches between contact and gap, times the mesh step. Its authors derived the coefficient
(π − 1 + ln 2)/24 in 2017. `mesh-convergence.toml` has the same surfaces on meshes from 128² to 2048²:

{claims.table("mesh-convergence", ["true-area-lies-within-the-bounds", "error-is-smaller-than-estimated",
                                   "correction-of-2017-is-right"])}
{figure("mesh-convergence", "mesh-convergence", "Area of the same surfaces on finer meshes")}
The campaign gives:

{claims.table(CAMPAIGN, ["largest-estimated-error", "estimated-error-halves-at-30-percent",
                         "edge-nodes-are-pi-over-4-of-the-switches", "corrected-area-between-asymptotes",
                         "corrected-area-groups-by-k-upper", "no-trend-within-corrected-groups",
                         "corrected-secant-grows"])}
{figure(CAMPAIGN, "relative-error", "Correction of 2015 over the counted area (fig. 12)")}
{figure(CAMPAIGN, "area-corrected", "Area corrected as in 2015 and in 2017 (fig. 13)")}
The coefficient π/8 subtracts three to four times too much, and most for the largest k_s. It causes the groups by k_s. With
the correction of 2017 the results are:

{claims.table(CAMPAIGN, ["corrected-area-above-persson", "corrected-area-grows-with-k-lower",
                         "corrected-area-falls-with-alpha", "corrected-area-depends-on-bandwidth-alone",
                         "corrected-area-falls-logarithmically-with-bandwidth", "alpha-alone-decides-corrected",
                         "corrected-area-collapses-on-bandwidth-rather-than-alpha"])}
{t.collapse_words()}

{figure(CAMPAIGN, "collapse", "Corrected area under three loads against the bandwidth")}
At given cutoffs, Hurst exponents from 0.1 to 1 (`hurst.toml`) change the area by about one per cent. This is too little to
show on which parameter the area depends:

{t.hurst()}
`same-nayak.toml` has spectra of several Hurst exponents with α from 1.76 to 33.9, and `plateau.toml` has spectra with
plateaus:

{claims.table("same-nayak", ["corrected-area-collapses-on-alpha"])}
{claims.table("plateau", ["corrected-area-collapses-on-alpha"])}
{figure("same-nayak", "collapse", "Corrected area against Nayak's parameter of the modes of the cell, for several Hurst exponents")}"""


def slope():
    return f"""\
## Slope of the area and the contact evolution law (sections 5.2 and 9, fig. 6)

{claims.table(CAMPAIGN, ["slope-decreases", "slope-is-convex", "corrected-slope-decreases",
                         "corrected-slope-is-convex", "persson-slope-is-concave", "slope-crosses-perssons-near-half",
                         "least-convex-kappa", "least-convex-kappa-depends-on-k-lower", "law-fits-below-a-fifth"])}
{figure(CAMPAIGN, "slope", "Slope of the contact area (fig. 6)")}
The contact evolution law, eq. (cel_derivative), is fitted to slopes up to a load of 0.06 with κ = 1.1 √(2π), as in the
paper. The intervals come from 1000 resamplings of whole surfaces.

{t.laws("law", {"none": "counted", "2017": "corrected"}, [("beta", "β"), ("mu", "μ")])}
This table gives the smallest κ for which the fitted slopes are convex; √(2π) = 2.5066.

{t.laws("least-convex", {"none": "counted", "2017": "corrected"}, [("kappa_convex", "κ")])}"""


def full_contact():
    return f"""\
## Up to full contact (sections 6 and 7, figs. 9 and 10)

{claims.table(CAMPAIGN, ["full-contact-at-1.7", "faster-than-persson", "exponent-near-full-contact",
                         "scaled-erf-fits", "groups-by-k-upper-near-full-contact",
                         "faster-to-full-contact-for-smaller-k-lower", "cracks-near-full-contact"])}
{figure(CAMPAIGN, "area-full", "Contact area and its slope under all loads (fig. 9)")}
{figure(CAMPAIGN, "near-full-contact", "Approach to full contact (fig. 10)")}
Every node touches at the load that flattens the surface. The heights alone determine this load. Its mean over the
surfaces of a spectrum is {t.full_contact_range()} (last column of the table of spectra). At 1.7, the last load of the paper,
some nodes are still open. A single scale β of erf(β √2 y), fitted to loads from 0.3 to 1.7, does not describe areas from
0.9 on:

{t.laws("near-full", {"none": "counted", "2017": "corrected"}, [("erf_scale", "β")])}"""


def growth():
    return f"""\
## Growth of the mean contact pressure (appendix C, fig. 17)

{claims.table(CAMPAIGN, ["exponent-of-pressure-growth"])}
The mean contact pressure p̄ grows as dp̄/dp₀ = β a^m, with these parameters:

{t.laws("pressure-growth", {"none": "counted", "2017": "corrected"}, [("exponent", "m"), ("prefactor", "β")])}
{figure(CAMPAIGN, "pressure-growth", "dp̄/dp₀ against the area (fig. 17)")}"""


def limits():
    return f"""\
## Limits of large cells, wide spectra and fine meshes

Every spectrum on a mesh has three small numbers: 1/k_l, k_l/k_s and k_s/N. Each quantity Q is fitted by Q₀ and one term
for each of these numbers, on the 104 spectra and meshes of `limits.toml` ([method](theory/limits.md)). The tables list the
forms with an Akaike weight of at least a tenth. A logarithmic term has no limit: Q₀ is then the value at k_s = k_l. If χ²
per degree of freedom is far above one, the forms do not describe the data exactly. The interval is then too narrow,
because it contains only the scatter between surfaces.

The secant, corrected as in 2017, follows a logarithm of the bandwidth; no power of the bandwidth could be fitted.

{t.limits("kappa-limits")}
The next table shows how the result depends on the selection of points and on the power of 1/k_l (1 or 2). It gives
least-squares fits to the 104 means in `data/findings/limits/kappa-points.parquet`, corrected as in 2017. For comparison, the
secants of the widest spectra at a load of 0.01 are {kappa.measured()}.

{kappa.selections()}
The next quantities are the mean gap over the rms height of the same surface, and the stiffness −dy/dū of the interface
times the mean gap ū over the load y:

{t.limits("gap-limits")}
The last quantities are the area and the load at which the gap stops percolating:

{t.limits("percolation-limits")}
{claims.table("limits", ["kappa-falls-logarithmically-with-bandwidth", "kappa-lies-between-theories-on-fine-meshes",
                         "sixteen-wavelengths-to-the-cell-are-enough",
                         "eight-nodes-to-the-wavelength-are-enough-once-corrected",
                         "stiffness-is-proportional-to-load", "sublinear-stiffness-is-of-the-finite-cell"])}
{figure("limits", "limits", "Fitted limits against the load")}"""


def asperities():
    return f"""\
## Asperity models compared with the solution

The models place a Hertz contact on each summit of the same surfaces that the solver pressed. Summits either do not
interact, or each is displaced by the forces of all others ([formulas](theory/asperities.md)). The tables give the area of
the model over the corrected area of the solution: the median and range of nine spectra. Area that two ellipses share counts
twice in the models; otherwise the ratios would be even smaller. On 1024² nodes, with the spectra of the paper and ten
surfaces each:

{t.asperities("asperities-1024")}
At each k_l the ratio falls as the α of the modes of the cell grows. On 1024² nodes at a load of 0.0057:

{t.asperities_over_alpha()}
On 256² nodes, with a quarter of all wavenumbers:

{t.asperities("asperities")}
{claims.table("asperities-1024", ["non-interacting-asperities-have-less-area", "interaction-adds-area-to-asperities",
                                  "asperities-without-interaction-have-too-much-area",
                                  "interaction-brings-asperities-to-the-solution",
                                  "interacting-asperities-agree-up-to-0.01",
                                  "interaction-of-asperities-is-in-the-gap",
                                  "asperities-stay-apart-under-light-loads"])}
{figure("asperities-1024", "asperities", "Area of asperity models over the area of the solution, 1024²")}"""


def distributions():
    return f"""\
## Distributions of pressures, gaps and contact spots

{claims.table("distributions", ["pressures-are-distributed-as-in-persson",
                                "middle-pressures-are-as-in-persson", "high-pressures-are-rarer-than-in-persson",
                                "pressures-near-full-contact-are-as-in-persson"])}
The contact has more low pressures than in Persson's theory:

{t.pressures()}
Meshes of eight nodes to the shortest wavelength do not show how the density begins at zero. The pressure falls as the
square root of the distance to an edge of contact, so the density rises linearly. But a mesh does not resolve pressures
below those of the first nodes inside an edge. `pressure-edges.toml` has the same surfaces on finer meshes. There the exponent
of the density between 0.1 and 0.2 grows, and the density below 0.025 falls about as the square root of the mesh step:

{t.edges()}
{claims.table("pressure-edges", ["pressure-density-is-linear-at-zero"])}
{figure("distributions", "contact-pressures", "Contact pressures compared with Persson's theory")}
{figure("distributions", "gap-distribution", "Distribution of gaps out of contact")}
{figure("distributions", "clusters", "Areas of contact spots")}"""


def sealing():
    return f"""\
## Sealing

The table gives the area and the load above which no channel of gap leads through the cell. They are means over surfaces
and both directions; the intervals include the spacing of the loads. The [previous section on
limits](#limits-of-large-cells-wide-spectra-and-fine-meshes) gives their limits.

{t.sealing()}
{t.sealing_note()}

{t.flow_mesh()}
{claims.table("sealing", ["interface-is-sealed-at-0.415-of-the-area"])}
The loads of the campaign have wider spacing. {t.narrow_sealing()}

{claims.table(CAMPAIGN, ["interface-is-sealed-at-0.415-of-the-area",
                         "interface-is-sealed-below-one-half-of-the-area",
                         "sealing-area-does-not-depend-on-k-lower",
                         "sealing-area-scatters-less-in-greater-cells", "stiffness-is-proportional-to-load"])}
{figure("sealing", "sealing", "Fraction of surfaces whose gap percolates")}
{figure("sealing", "flow", "Flow through the gap, by the cubic law on a network of resistors")}"""


def misprints():
    return f"""\
## Misprints

No study can confirm these sentences and formulas as printed. [Misprints](theory/misprints.md) is the whole list, T1 to
T20. The sections above concern T2, T5, T9 to T11, T13 and T18.

{claims.misprints(CAMPAIGN)}"""
