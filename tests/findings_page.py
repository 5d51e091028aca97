"""The words of docs/findings.md, around the tables of findings_tables.py."""

import findings_claims as claims
import findings_kappa as kappa
import findings_tables as t

CAMPAIGN = "yastrebov-2015"

# Of each study, the tables and figures that the page rests on.
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
    return text


def introduction():
    return f"""\
# Findings

<!-- Written by tests/findings.py from the tables under data/findings; do not edit. -->

What the manifests that come along find: every claim of the paper (Yastrebov, Anciaux & Molinari 2015), its tables and
figures, and what it left open. `asperity run`, `asperity claims` and `asperity report` have made all of it; this page is
written from their tables, which are in `data/findings/`, a folder for each study, and open in polars, pandas or DuckDB.

{t.provenance(STUDIES)}
The first is the campaign of the paper, whole: nine spectra of H = 0.8, fifty surfaces of each on 1024 × 1024 nodes,
ninety loads from first touch to full contact. *Load* is p₀/(E\\* h′) with h′ the rms slope, *area* a fraction of
the nominal area; a number after ± is a standard error between surfaces.

## In short

{claims.counted(CAMPAIGN)}
A claim **holds** if each of its quantities is as expected at one-sided 95 %, and **does not hold** if one is not, in
intervals that cover all of them at 95 %; else the study **cannot say** ([more](how-to/claims.md)). Below, brackets behind
what was found are the former bounds where a claim holds and the latter intervals where it does not. What is expected
is our reading of a sentence in words; a “cannot say” is no more than that fifty surfaces do not decide on that reading.

- The area at a load of 0.06 is {t.area_at(0.06)}: above Persson's {t.persson_at(0.06)}, for all spectra.
- Counted areas form groups by k_l; {claims.collapse(CAMPAIGN)}
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
{figure("heights", "heights", "Density of heights of a thousand surfaces of each spectrum; fig. 3 and fig. 16")}
The tables of α and D, numerical, were printed from 200 surfaces of 1024 × 1024 nodes. Ours are of 200 others, `nayak.toml`:

{claims.table("nayak", ["table-of-alpha", "table-of-summit-density"])}
Nayak's parameter α (table 2), as printed and as found, and in closed form on the lattice of wavenumbers, to which
the means converge:

{t.tabulated("nayak_mean", "nayak_sem", "nayak_lattice", "yastrebov-2015-nayak")}
Density of summits D in integer wavenumbers (table 3; per L² it is (2π)² of this, T5):

{t.tabulated("summit_density_integer_mean", "summit_density_integer_sem", None, "yastrebov-2015-summit-density")}
{figure("nayak", "nayak", "Nayak's parameter over the cutoffs; fig. 14")}
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
{t.areas()}
{figure(CAMPAIGN, "area-light", "Contact area as counted, and its secant; fig. 5")}
{figure(CAMPAIGN, "contact-maps", "Contact of one surface of two spectra; figs. 7 and 8")}
The cutoffs of earlier studies (table 1, fig. 1), eight surfaces each on 512 × 512 nodes, `literature.toml`: the secant, area
over load, in units of √(2π), at the load 0.06. Persson's theory has 0.64, asperity models without interaction 1:

{t.literature()}"""


def mesh():
    return f"""\
## What the mesh adds (section 8, figs. 11 to 13)

What is counted is whole nodes, of which those on the edge of contact are in it in part. The paper takes off π/8 of the
switches between contact and gap times the mesh step; its authors derived (π − 1 + ln 2)/24 in 2017. Over meshes from 128² to 2048² of the same
surfaces, `mesh-convergence.toml`:

{claims.table("mesh-convergence", ["true-area-lies-within-the-bounds", "error-is-smaller-than-estimated",
                                   "correction-of-2017-is-right"])}
{figure("mesh-convergence", "mesh-convergence", "Area on finer and finer meshes of the same surfaces")}
On the campaign:

{claims.table(CAMPAIGN, ["largest-estimated-error", "estimated-error-halves-at-30-percent",
                         "edge-nodes-are-pi-over-4-of-the-switches", "corrected-area-between-asymptotes",
                         "corrected-area-groups-by-k-upper", "no-trend-within-corrected-groups",
                         "corrected-secant-grows"])}
{figure(CAMPAIGN, "relative-error", "What the correction of 2015 takes away, over the counted area; fig. 12")}
{figure(CAMPAIGN, "area-corrected", "Area corrected as in 2015 and in 2017; fig. 13")}
π/8 takes off three to four times too much, most where k_s is greatest: the groups by k_s are made by it. With the correction
of 2017:

{claims.table(CAMPAIGN, ["corrected-area-above-persson", "corrected-area-grows-with-k-lower",
                         "corrected-area-falls-with-alpha", "corrected-area-depends-on-bandwidth-alone",
                         "corrected-area-falls-logarithmically-with-bandwidth", "alpha-alone-decides-corrected",
                         "corrected-area-collapses-on-bandwidth-rather-than-alpha"])}
{t.collapse_words()}

{figure(CAMPAIGN, "collapse", "Corrected area under three loads over the bandwidth")}
The Hurst exponent, from 0.1 to 1 at given cutoffs (`hurst.toml`), changes areas by about one per cent, too little to
tell what they depend on:

{t.hurst()}
Spectra of several Hurst exponents whose α goes from 1.76 to 33.9, `same-nayak.toml`, and spectra with plateaus, `plateau.toml`:

{claims.table("same-nayak", ["corrected-area-collapses-on-alpha"])}
{claims.table("plateau", ["corrected-area-collapses-on-alpha"])}
{figure("same-nayak", "collapse", "Corrected area over Nayak's parameter of the modes of the cell, several Hurst exponents")}"""


def slope():
    return f"""\
## Slope of the area, and the evolution law (sections 5.2 and 9, fig. 6)

{claims.table(CAMPAIGN, ["slope-decreases", "slope-is-convex", "corrected-slope-decreases",
                         "corrected-slope-is-convex", "persson-slope-is-concave", "slope-crosses-perssons-near-half",
                         "least-convex-kappa", "least-convex-kappa-depends-on-k-lower", "law-fits-below-a-fifth"])}
{figure(CAMPAIGN, "slope", "Slope of the contact area; fig. 6")}
The contact evolution law, eq. (cel_derivative), fitted to slopes up to a load of 0.06 with κ = 1.1 √(2π) as in the
paper; intervals are of 1000 studies of resampled surfaces:

{t.laws("law", {"none": "counted", "2017": "corrected"}, [("beta", "β"), ("mu", "μ")])}
The smallest κ for which fitted slopes are convex; √(2π) = 2.5066:

{t.laws("least-convex", {"none": "counted", "2017": "corrected"}, [("kappa_convex", "κ")])}"""


def full_contact():
    return f"""\
## Up to full contact (sections 6 and 7, figs. 9 and 10)

{claims.table(CAMPAIGN, ["full-contact-at-1.7", "faster-than-persson", "exponent-near-full-contact",
                         "scaled-erf-fits", "groups-by-k-upper-near-full-contact",
                         "faster-to-full-contact-for-smaller-k-lower", "cracks-near-full-contact"])}
{figure(CAMPAIGN, "area-full", "Contact area under all loads, and its slope; fig. 9")}
{figure(CAMPAIGN, "near-full-contact", "Approach to full contact; fig. 10")}
Every node touches under the load that flattens the surface, which its heights alone decide: {t.full_contact_range()} in the
mean of each spectrum (last column of the table of spectra). At 1.7, the last load of the paper, some open nodes are left.
One scale β of erf(β √2 y), fitted to loads from 0.3 to 1.7, is not that of areas from 0.9 on:

{t.laws("near-full", {"none": "counted", "2017": "corrected"}, [("erf_scale", "β")])}"""


def growth():
    return f"""\
## Growth of the mean contact pressure (appendix C, fig. 17)

{claims.table(CAMPAIGN, ["exponent-of-pressure-growth"])}
{t.laws("pressure-growth", {"none": "counted", "2017": "corrected"}, [("exponent", "m"), ("prefactor", "β")])}
{figure(CAMPAIGN, "pressure-growth", "dp̄/dp₀ over the area; fig. 17")}"""


def limits():
    return f"""\
## Limits of great cells, wide spectra and fine meshes

Three numbers come with every mesh: 1/k_l, k_l/k_s and k_s/N. Each quantity Q is fitted by Q₀ and a term for each
of them, on 104 spectra and meshes, `limits.toml`; [how](theory/limits.md). Of the forms that were tried, those that
Akaike's weight prefers are given, down to a tenth. A term that is a logarithm has no limit: Q₀ is then the value where
k_s = k_l. Where χ² per degree of freedom is far above one, the forms are not quite those of the data, and the interval,
which is of surfaces alone, is too narrow.

Area over load, corrected as in 2017, is a logarithm of the bandwidth: no power of it could be fitted.

{t.limits("kappa-limits")}
How far this depends on which points are fitted, and on the power of 1/k_l (1 or 2): least squares to the 104 means of
the points in `data/findings/limits/kappa-points.parquet`, corrected as in 2017. At a load of 0.01 the widest spectra that
were computed have {kappa.measured()}.

{kappa.selections()}
The mean gap over the rms height of the same surface, and the stiffness −dy/dū of the interface times the mean gap ū, over
the load y:

{t.limits("gap-limits")}
Area and load at which the gap stops percolating:

{t.limits("percolation-limits")}
{claims.table("limits", ["kappa-falls-logarithmically-with-bandwidth", "kappa-lies-between-theories-on-fine-meshes",
                         "sixteen-wavelengths-to-the-cell-are-enough",
                         "eight-nodes-to-the-wavelength-are-enough-once-corrected",
                         "stiffness-is-proportional-to-load", "sublinear-stiffness-is-of-the-finite-cell"])}
{figure("limits", "limits", "Fitted limits over the load")}"""


def asperities():
    return f"""\
## Asperity models beside the solution

Hertz' contacts of the summits of the very surfaces that were solved for, without interaction and each displaced by the
forces of all others; [formulas](theory/asperities.md). Area of the model over the corrected area of the solution,
median of nine spectra and their range. Where ellipses overlap, their common area counts twice in the models: without
it the ratios would be smaller still. At 1024², the spectra of the paper, ten surfaces each:

{t.asperities("asperities-1024")}
At each k_l the ratio falls as α of the modes of the cell grows. At 1024² and a load of 0.0057:

{t.asperities_over_alpha()}
At 256², a quarter of all wavenumbers:

{t.asperities("asperities")}
{claims.table("asperities-1024", ["non-interacting-asperities-have-less-area", "interaction-adds-area-to-asperities",
                                  "asperities-without-interaction-have-too-much-area",
                                  "interaction-brings-asperities-to-the-solution",
                                  "interacting-asperities-agree-up-to-0.01",
                                  "interaction-of-asperities-is-in-the-gap",
                                  "asperities-stay-apart-under-light-loads"])}
{figure("asperities-1024", "asperities", "Area of asperity models over that of the solution, 1024²")}"""


def distributions():
    return f"""\
## Distributions of pressure, gap and clusters

{claims.table("distributions", ["pressures-are-distributed-as-in-persson",
                                "middle-pressures-are-as-in-persson", "high-pressures-are-rarer-than-in-persson",
                                "pressures-near-full-contact-are-as-in-persson"])}
{t.pressures()}
How the density begins at zero cannot be judged on these meshes of eight nodes to the shortest wavelength. Pressure falls as
the square root of the distance to an edge of contact, so that the density rises linearly; a mesh resolves no
pressures below those of its first nodes within an edge. On the same surfaces on finer and finer meshes,
`pressure-edges.toml`, the exponent of the density between 0.1 and 0.2 grows, and the density below 0.025 falls about as the
square root of the mesh step:

{t.edges()}
{claims.table("pressure-edges", ["pressure-density-is-linear-at-zero"])}
{figure("distributions", "contact-pressures", "Contact pressures beside Persson's")}
{figure("distributions", "gap-distribution", "Gaps out of contact")}
{figure("distributions", "clusters", "Clusters of contact")}"""


def sealing():
    return f"""\
## Sealing

Area and load from which on no channel of gap leads through the cell, means over surfaces and both directions, with what
the distance of the loads leaves open; their limits are [above](#limits-of-great-cells-wide-spectra-and-fine-meshes):

{t.sealing()}
{t.sealing_note()}

{t.flow_mesh()}
{claims.table("sealing", ["interface-is-sealed-at-0.415-of-the-area"])}
On the campaign, whose loads lie farther apart. {t.narrow_sealing()}

{claims.table(CAMPAIGN, ["interface-is-sealed-at-0.415-of-the-area",
                         "interface-is-sealed-below-one-half-of-the-area",
                         "sealing-area-does-not-depend-on-k-lower",
                         "sealing-area-scatters-less-in-greater-cells", "stiffness-is-proportional-to-load"])}
{figure("sealing", "sealing", "Share of surfaces whose gap percolates")}
{figure("sealing", "flow", "Flow through the gap; cubic law on a network of resistors")}"""


def misprints():
    return f"""\
## What is misprinted

Sentences and formulas that no study can confirm as they are printed. [Misprints](theory/misprints.md) has the whole list,
T1 to T20, of which T2, T5, T9 to T11, T13 and T18 are met above.

{claims.misprints(CAMPAIGN)}"""
