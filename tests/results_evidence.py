"""The pages docs/results/*.md: the claims and tables behind each section of the article docs/results.md."""

import re
import textwrap

import results_challenge as challenge
import results_claims as claims
import results_flow as flow
import results_kappa as kappa
import results_tables as t
from results_tables import digits

CAMPAIGN = "yastrebov-2015"

# The tables and figures of each study that the results use.
STUDIES = {
    CAMPAIGN: (
        ["curves", "law", "least-convex", "pressure-growth", "near-full", "spectra"],
        ["area-light", "slope", "area-full", "contact-maps", "near-full-contact", "pressure-growth", "area-corrected",
         "collapse", "relative-error"],
    ),
    "nayak": (["table"], ["nayak"]),
    "heights": (["kurtosis"], ["heights"]),
    "literature": (["secants"], []),
    "mesh-convergence": ([], ["mesh-convergence"]),
    "hurst": (["curves", "spectra"], []),
    "same-nayak": (["curves"], ["collapse"]),
    "plateau": (["curves"], []),
    "limits": (["kappa-points", "kappa-limits", "gap-limits", "percolation-limits"],
               ["limits", "bandwidth"]),
    "asperities": (["beside"], []),
    "asperities-1024": (["beside", "spectra"], ["asperities"]),
    "distributions": (["mean-pressures"], ["contact-pressures", "gap-distribution", "clusters"]),
    "pressure-edges": (["mean-pressures"], []),
    "sealing": (["threshold"], ["sealing", "flow"]),
    "flow-mesh": (["over-finest"], []),
    "flow-law": (["mean-leak"], []),
    "saddle": (["flow"], ["threshold"]),
    "challenge": (["mean-areas", "mean-gaps", "adhesive-areas"], ["reference", "gap-distribution"]),
}


def figure(study, name, caption):
    return f"![{caption}](../images/results/{study}-{name}.svg)\n\n*{caption}.*\n"


def pages():
    """Returns the text of each page by its name."""
    written = "<!-- Written by tests/results.py from the tables under data/results-of-the-paper; do not edit. -->"
    texts = {"studies": studies(), "surfaces": surfaces(), "light-load": light(), "mesh": mesh(), "slope": slope(),
             "full-contact": full_contact(), "pressure-growth": growth(), "limits": limits(), "asperities": asperities(),
             "distributions": distributions(), "sealing": sealing(), "challenge": challenge.page(),
             "misprints": misprints()}
    claims.assert_all_told("\n".join(texts.values()), CAMPAIGN)
    return {name: filled_page(f"{written}\n\n{text.rstrip()}\n\n[Back to the results](../results.md)\n") for name, text in texts.items()}


def filled_page(text):
    return "\n\n".join(map(filled, text.split("\n\n")))


def filled(paragraph):
    """Fills a paragraph or a list to 110 columns; headings, tables, figures and code stay."""
    if paragraph.startswith(("#", "|", "!", "*", "<", "```")) or not paragraph.strip():
        return paragraph
    end = "\n" if paragraph.endswith("\n") else ""
    lines = [" ".join(item.split()) for item in re.split(r"\n(?=- )", paragraph)]
    return "\n".join(textwrap.fill(line, 110, subsequent_indent="  " if line.startswith("- ") else "",
                                   break_long_words=False, break_on_hyphens=False) for line in lines) + end


def studies():
    return f"""\
# Studies, terms and verdicts

`asperity run`, `asperity claims` and `asperity report` computed all results of the [results](../results.md), from the
manifests in the following table. The tables of results are in `data/results-of-the-paper/`, which has a folder for each study. You can
open them in polars, pandas or DuckDB.

{t.provenance(STUDIES)}
The first study repeats the whole *campaign* of the paper: nine spectra with the Hurst exponent H = 0.8,
{t.surfaces_per_spectrum()} surfaces of each on 1024 × 1024 nodes, and ninety loads from light contact to full contact.

The results use these terms and symbols; the [glossary](../glossary.md) has more:

- The *load* y is p₀/(E\\* h′), with the nominal pressure p₀, the effective modulus E\\* and the rms slope h′.
- The *area* is the fraction A/A₀ of the nominal area that is in contact. The *counted* area is the fraction of nodes in
  contact. A *corrected* area is the counted area minus an [estimate of the error of the
  mesh](../theory/corrections.md), with the coefficient of 2015 or of 2017.
- The *secant* is area over load.
- k_l and k_s are the lower and the upper cutoff wavenumber in waves per side of the cell (`k_lower` and `k_upper` in the
  tables). ζ = k_s/k_l is the *bandwidth*.
- α is Nayak's parameter. “α of the modes of the cell” is the closed form with sums over the wavevectors of the periodic
  cell.
- A number after ± is the standard error of the mean over surfaces.

{claims.counted(CAMPAIGN)}
The article counts five statements from other studies: `nayak.toml` has more surfaces for the two tables of the paper,
`mesh-convergence.toml` tests two statements on the error of the mesh, and `asperities-1024.toml` one on asperity models.

Each claim is tested by one or more quantities, each with an expected range. A claim **holds** if every quantity is in its
range with a one-sided confidence of 95 %. It **does not hold** if at least one quantity is outside its range, according to
intervals that cover all quantities of the claim together with 95 % confidence. Otherwise the study **cannot say**
([more](../how-to/claims.md)). The numbers in brackets after a result are one-sided bounds if the claim holds; otherwise
they are the joint interval. Where the paper has words and no numbers, the expected range is our interpretation. “Cannot
say” means that the study has too few surfaces to decide by this range, or that a quantity has no value.
"""


def surfaces():
    return f"""\
# Surfaces (section 3, appendices A and B)

{claims.table(CAMPAIGN, ["heights-are-gaussian-from-k-lower-4", "heights-are-not-gaussian-for-k-lower-1",
                         "modes-come-from-k-lower", "tabulated-density-of-summits", "asymptote-of-alpha"])}
The paper tabulates Nayak's parameter α and the density of summits D, computed as means over 200 surfaces of 1024 × 1024
nodes. `nayak.toml` computes both for 1000 other surfaces:

{claims.table("nayak", ["table-of-alpha", "table-of-summit-density"])}
The next table gives Nayak's parameter α as printed (table 2), as found, and in closed form. The closed form uses sums over
the wavevectors of the periodic cell. The mean over surfaces approaches it as the number of modes grows.

{t.tabulated("nayak_mean", "nayak_sem", "nayak_lattice", "yastrebov-2015-nayak")}
The next table gives the density of summits D as printed (table 3) and as found, in integer wavenumbers. The number of
summits per area L² of the cell is (2π)² D (misprint [T5](../theory/misprints.md)).

{t.tabulated("summit_density_integer_mean", "summit_density_integer_sem", None, "yastrebov-2015-summit-density")}
{figure("nayak", "nayak", "Nayak's parameter against the cutoffs (fig. 14)")}
The nine spectra of the campaign have these means over surfaces. The number of *effective modes* is 1/Σ P_j², where P_j is
the fraction of the power in a pair of modes. The full-contact load is the exact load at which every node is in contact:

{t.spectra()}"""


def light():
    return f"""\
# Contact under light load (section 5, figs. 5, 7 and 8)

{claims.table(CAMPAIGN, ["area-at-0.06", "area-above-persson", "widest-k-lower-is-close-to-bgt-asymptote",
                         "area-grows-with-k-lower", "area-groups-by-k-lower", "no-convergence-in-k-lower",
                         "area-falls-with-alpha", "alpha-alone-does-not-decide",
                         "effect-of-alpha-is-weaker-than-in-asperity-models", "alpha-in-asperity-models",
                         "greenwood-2006-far-from-its-asymptote", "scatter-falls-with-cutoffs"])}
The next table compares the areas of the nine spectra near three loads with two theories. At the largest load the area is
far beyond the range of the asperity model; the column only shows how it fails:

{t.areas()}
`literature.toml` uses the cutoffs of earlier studies (table 1, fig. 1), with eight surfaces each on 512 × 512 nodes. The
table gives the secant at a load of 0.06, divided by √(2π). At vanishing load this ratio is 0.64 in Persson's theory and 1
in the asperity model of Bush, Gibson & Thomas (BGT):

{t.literature()}"""


def mesh():
    return f"""\
# Error of the mesh (section 8, figs. 11 to 13)

For a given shape, the nodes inside count the right area on average. The contact that is solved on a mesh, however, extends
too far along its edge, so the counted area is too large ([more](../theory/corrections.md)). As a correction the paper subtracts (π/8) S_d Δx. Here Δx is the mesh step, and S_d is Δx times the number of *switches*,
the changes between contact and gap along all rows and columns. In 2017 its authors derived the coefficient
(π − 1 + ln 2)/24 in place of π/8. `mesh-convergence.toml` has the same surfaces on meshes from 128² to 2048²:

{claims.table("mesh-convergence", ["true-area-lies-within-the-bounds", "error-is-smaller-than-estimated",
                                   "correction-of-2017-is-right"])}
The campaign tests these claims on the error of the mesh:

{claims.table(CAMPAIGN, ["largest-estimated-error", "estimated-error-halves-at-30-percent",
                         "edge-nodes-are-pi-over-4-of-the-switches", "corrected-area-between-asymptotes",
                         "corrected-area-groups-by-k-upper", "no-trend-within-corrected-groups",
                         "corrected-secant-grows"])}
{figure(CAMPAIGN, "relative-error", "Correction of 2015 over the counted area (fig. 12)")}
{figure(CAMPAIGN, "area-corrected", "Area corrected as in 2015 and in 2017 (fig. 13)")}
The coefficient π/8 subtracts three to four times too much. The excess is largest for the largest k_s, and causes the
groups of corrected areas by k_s. Areas that are corrected with the coefficient of 2017 give these results:

{claims.table(CAMPAIGN, ["corrected-area-above-persson", "corrected-area-grows-with-k-lower",
                         "corrected-area-falls-with-alpha", "corrected-area-depends-on-bandwidth-alone",
                         "corrected-area-falls-logarithmically-with-bandwidth", "alpha-alone-decides-corrected",
                         "corrected-area-collapses-on-bandwidth-rather-than-alpha"])}
{t.collapse_words()}

At given cutoffs, the area varies by about one per cent as the Hurst exponent H goes from 0.1 to 1 (`hurst.toml`). This is
too little to show on which parameter of the spectrum the area depends. The table has secants of areas corrected as in 2017:

{t.hurst()}
In `same-nayak.toml`, α is from 1.76 to 33.9, and spectra with different Hurst exponents have nearly equal α. In
`plateau.toml` the spectra are constant up to a roll-off wavenumber. These studies give the following two results:

{claims.table("same-nayak", ["corrected-area-collapses-on-alpha"])}
{claims.table("plateau", ["corrected-area-collapses-on-alpha"])}
{figure("same-nayak", "collapse", "Corrected area against Nayak's parameter of the modes of the cell, for several Hurst exponents")}"""


def slope():
    return f"""\
# Slope of the area and the contact evolution law (sections 5.2 and 9, fig. 6)

{claims.table(CAMPAIGN, ["slope-decreases", "slope-is-convex", "corrected-slope-decreases",
                         "corrected-slope-is-convex", "persson-slope-is-concave", "slope-crosses-perssons-near-half",
                         "least-convex-kappa", "least-convex-kappa-depends-on-k-lower", "law-fits-below-a-fifth"])}
The next table gives the parameters β and μ of the [contact evolution law](../theory/laws.md), eq. (9). As in the
paper, the law is fitted to slopes up to a load of 0.06 with κ = 1.1 √(2π). The intervals come from 1000 resamples of whole
surfaces.

{t.laws("law", {"none": "counted", "2017": "corrected"}, [("beta", "β"), ("mu", "μ")])}
The next table gives, for each spectrum, the smallest κ for which the fitted slopes are convex. For comparison, √(2π) is
2.5066.

{t.laws("least-convex", {"none": "counted", "2017": "corrected"}, [("kappa_convex", "κ")])}"""


def full_contact():
    return f"""\
# Up to full contact (sections 6 and 7, figs. 9 and 10)

{claims.table(CAMPAIGN, ["full-contact-at-1.7", "faster-than-persson", "exponent-near-full-contact",
                         "scaled-erf-fits", "groups-by-k-upper-near-full-contact",
                         "faster-to-full-contact-for-smaller-k-lower", "cracks-near-full-contact"])}
The *full-contact load*, at which every node touches, follows exactly from the heights alone. Its mean over the surfaces of
a spectrum is {t.full_contact_range()}, as in the last column of the table of the nine spectra. At 1.7, the last load of the
paper, some nodes are still open. The next table gives the scale β of erf(β √2 y), fitted to areas at loads from 0.3 to 1.7.
A single scale that is fitted in this way does not describe
areas of 0.9 and more. The claim on cracks uses areas corrected as in 2017, the other claims of this page use counted areas:

{t.laws("near-full", {"none": "counted", "2017": "corrected"}, [("erf_scale", "β")])}"""


def growth():
    return f"""\
# Growth of the mean contact pressure (appendix C, fig. 17)

{claims.table(CAMPAIGN, ["exponent-of-pressure-growth"])}
The mean contact pressure p̄ = p₀/a, with the area a, grows as dp̄/dp₀ = β a^m. A line through the logarithms of Δp̄/Δp₀ and
of a gives m and β. A spectrum has no value if p̄ falls in more than a fifth of the steps of the load:

{t.laws("pressure-growth", {"none": "counted", "2017": "corrected"}, [("exponent", "m"), ("prefactor", "β")])}
{figure(CAMPAIGN, "pressure-growth", "dp̄/dp₀ against the area (fig. 17)")}"""


def limits():
    return f"""\
# Limits of large cells, wide spectra and fine meshes

A spectrum on a mesh of N nodes per side has three small numbers: 1/k_l, k_l/k_s and k_s/N. Each quantity Q is fitted by a
constant Q₀ plus one term for each of these numbers ([method](../theory/limits.md)). The data are 104 combinations of spectrum
and mesh in `limits.toml`. Each term is a power or a logarithm of its number. The tables list the combinations of forms with
an Akaike weight of at least a tenth. A logarithmic term has no limit: Q₀ is then the value at k_s = k_l, an extrapolation from k_s = 2 k_l. If χ² per degree of
freedom is far above one, the forms do not describe the data within their errors. The intervals are then too narrow, because
they contain only the scatter between surfaces.

The secant of areas corrected as in 2017 depends on the logarithm of the bandwidth. Where the table has a power, its exponent
is so small that the power hardly differs from a logarithm within the bandwidths of the study; its limit Q₀ is then an
extrapolation by many orders of magnitude of the bandwidth.

{t.limits("kappa-limits")}
The next table shows how the result depends on the selection of points; a *point* is a combination of spectrum and mesh.
Ranges cover both powers of 1/k_l, 1 and 2. The values are from least-squares fits to the 104 means, corrected as in 2017, in
`data/results-of-the-paper/limits/kappa-points.parquet`. They apply to large cells and fine meshes. For comparison, on the finest mesh of
the widest spectra, secant/√(2π) at a load of 0.01 is {kappa.measured()}.

{kappa.selections()}
{figure("limits", "limits", "Secant, stiffness and sealing threshold, extrapolated to large cells and fine meshes")}
The next table has two quantities: the mean gap ū divided by the rms height of the same surface, and the dimensionless
stiffness −(dy/dū) ū/y of the interface:

{t.limits("gap-limits")}
The last two quantities are the corrected area and the load at which the gap stops percolating:

{t.limits("percolation-limits")}
{claims.table("limits", ["kappa-falls-logarithmically-with-bandwidth", "kappa-lies-between-theories-on-fine-meshes",
                         "sixteen-wavelengths-to-the-cell-are-enough",
                         "eight-nodes-to-the-wavelength-are-enough-once-corrected",
                         "stiffness-is-proportional-to-load", "sublinear-stiffness-is-of-the-finite-cell"])}"""


def asperities():
    return f"""\
# Asperity models compared with the solution

Asperity models place a Hertz contact on each summit of a surface. The contacts do not interact (“no interaction”), or the
mean pressure displaces all summits equally (“mean field”), or each force displaces all other summits (“explicit
interaction”; [formulas](../theory/asperities.md)). *The solution* is the boundary-element solution for the same surfaces. The
tables give the area of the model divided by the corrected area of the solution, as median and range over nine spectra. Area
that two contact ellipses share counts twice in the models; otherwise the ratios would be even smaller. The last column is
the fraction of the area of the model without interaction in ellipses that intersect another one. The first table is for the
nine spectra of the paper, with {t.surfaces_per_spectrum('asperities-1024')} surfaces each on 1024² nodes:

{t.asperities("asperities-1024")}
At each k_l the ratio falls as α (of the modes of the cell) grows. The second table is for the same surfaces at a load
of 0.0057:

{t.asperities_over_alpha()}
The third table is for 256² nodes and a quarter of all wavenumbers:

{t.asperities("asperities")}
{claims.table("asperities-1024", ["non-interacting-asperities-have-less-area", "interaction-adds-area-to-asperities",
                                  "asperities-without-interaction-have-too-much-area",
                                  "interaction-brings-asperities-to-the-solution",
                                  "interacting-asperities-agree-up-to-0.01",
                                  "interaction-of-asperities-is-in-the-gap",
                                  "asperities-stay-apart-under-light-loads"])}"""


def distributions():
    return f"""\
# Distributions of pressures, gaps and contact spots

{claims.table("distributions", ["pressures-are-distributed-as-in-persson",
                                "middle-pressures-are-as-in-persson", "high-pressures-are-rarer-than-in-persson",
                                "pressures-near-full-contact-are-as-in-persson"])}
Low pressures are more frequent than in Persson's theory. The table gives the contact area, and the fraction of it
with contact pressures below 0.2 E\\* h′:

{t.pressures()}
Near an edge of contact, the pressure is proportional to the square root of the distance to the edge. The probability
density of the pressure therefore rises linearly from zero. A mesh of eight nodes to the shortest wavelength does not show
this, because it does not resolve pressures below those of the first nodes inside an edge. `pressure-edges.toml` has the same
surfaces on meshes of different steps; pressures are in units of E\\* h′. On finer meshes, the exponent of a power law of the
density between pressures of 0.1 and 0.2 grows towards one. The density at pressures below 0.025 falls with the mesh
step, about as its square root at the lighter loads and more slowly at the heaviest:

{t.edges()}
{claims.table("pressure-edges", ["pressure-density-is-linear-at-zero"])}
{figure("distributions", "gap-distribution", "Distribution of gaps out of contact")}
{figure("distributions", "clusters", "Areas of contact spots")}"""


def sealing():
    return f"""\
# Sealing

The table gives the sealing *threshold*: the area and the load above which no channel of gap leads through the cell. The
values are means over surfaces and over both directions; the intervals include the error of the spacing of the loads. The
page on [limits](limits.md) extrapolates these thresholds to large cells, wide
spectra and fine meshes.

{t.sealing()}
{t.sealing_note()}

{t.flow_mesh()}
{claims.table("sealing", ["interface-is-sealed-at-0.415-of-the-area"])}
The campaign has the following results on sealing and stiffness. Its loads are more widely spaced, so its thresholds are less
precise. {t.narrow_sealing_words()} This is according to the [fit of the limits](limits.md). Therefore the first claim does
not hold for the spectra of one and two octaves. The third claim fails for the same reason: at a given k_s, a spectrum with a
larger k_l is narrower.

{claims.table(CAMPAIGN, ["interface-is-sealed-at-0.415-of-the-area",
                         "interface-is-sealed-below-one-half-of-the-area",
                         "sealing-area-does-not-depend-on-k-lower",
                         "sealing-area-scatters-less-in-greater-cells", "stiffness-is-proportional-to-load"])}
{figure("sealing", "flow", "Flow through the gap, by the cubic law on a network of resistors")}
## Flow at a given contact area

Wang & Müser (arXiv 2010.13470) describe the flow by expressions that depend only on the mean gap ū and the contact area.
The flow conductivity K is a length cubed, so such an expression is ū³ times a function of the area. `flow-law.toml` has ten
surfaces for each of twelve spectra. {flow.factor_words()} Factor and
exponent of this form are fitted, and the area in the denominator is that of the percolation threshold. The last row of the
table has its values:

{flow.factor_table()}
{claims.table("flow-law", ["flow-depends-on-mean-gap-and-area-alone"])}
## Flow close to the threshold

{flow.saddle_words()}

`saddle.toml` has a product of two cosine waves, whose contact spots merge at saddle points. For each mesh and range of
loads y, the table has a least-squares fit of ln K = c + β ln(y_c − y) + c₁ (y_c − y) to the flows, with the free threshold
y_c. The last term is the first correction to the power law. Without it, the exponent of a narrow range of loads is
larger: it falls from 3.8 to 3.5 as the range approaches the threshold.

{flow.saddle_table()}
{figure("saddle", "threshold", "Flow conductivity near a saddle against the distance of the load from the threshold")}"""


def misprints():
    return f"""\
# Misprints

The following sentences and formulas are wrong as printed, so no study can confirm them. The page
[Misprints](../theory/misprints.md) has the complete list, T1 to T20. The sections above treat T2, T5, T9 to T11, T13 and T18.

{claims.misprints(CAMPAIGN)}"""
