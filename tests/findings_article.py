"""The article docs/findings.md. The claims and tables behind its sections are on the pages of findings_evidence.py."""

import findings_claims as claims
import findings_kappa as kappa
import findings_tables as t
from findings_evidence import filled_page
from findings_tables import BGT, CAMPAIGN, digits, ranging

# The page with the evidence for each claim that the article names, by study.
PAGES = {
    "heights-are-gaussian-from-k-lower-4": "surfaces",
    "heights-are-not-gaussian-for-k-lower-1": "surfaces",
    "modes-come-from-k-lower": "surfaces",
    "table-of-alpha": "surfaces",
    "table-of-summit-density": "surfaces",
    "tabulated-density-of-summits": "surfaces",
    "area-at-0.06": "light-load",
    "area-above-persson": "light-load",
    "widest-k-lower-is-close-to-bgt-asymptote": "light-load",
    "area-grows-with-k-lower": "light-load",
    "area-groups-by-k-lower": "light-load",
    "area-falls-with-alpha": "light-load",
    "alpha-alone-does-not-decide": "light-load",
    "alpha-in-asperity-models": "light-load",
    "scatter-falls-with-cutoffs": "light-load",
    "error-is-smaller-than-estimated": "mesh",
    "correction-of-2017-is-right": "mesh",
    "largest-estimated-error": "mesh",
    "estimated-error-halves-at-30-percent": "mesh",
    "corrected-area-groups-by-k-upper": "mesh",
    "no-trend-within-corrected-groups": "mesh",
    "corrected-secant-grows": "mesh",
    "corrected-area-depends-on-bandwidth-alone": "mesh",
    "corrected-area-collapses-on-bandwidth-rather-than-alpha": "mesh",
    "corrected-area-falls-logarithmically-with-bandwidth": "mesh",
    "slope-decreases": "slope",
    "slope-is-convex": "slope",
    "least-convex-kappa-depends-on-k-lower": "slope",
    "law-fits-below-a-fifth": "slope",
    "full-contact-at-1.7": "full-contact",
    "exponent-near-full-contact": "full-contact",
    "faster-than-persson": "full-contact",
    "cracks-near-full-contact": "full-contact",
    "scaled-erf-fits": "full-contact",
    "groups-by-k-upper-near-full-contact": "full-contact",
    "faster-to-full-contact-for-smaller-k-lower": "full-contact",
    "kappa-falls-logarithmically-with-bandwidth": "limits",
    "eight-nodes-to-the-wavelength-are-enough-once-corrected": "limits",
    "middle-pressures-are-as-in-persson": "distributions",
    "high-pressures-are-rarer-than-in-persson": "distributions",
    "pressures-near-full-contact-are-as-in-persson": "distributions",
    "pressure-density-is-linear-at-zero": "distributions",
    "interface-is-sealed-below-one-half-of-the-area": "sealing",
    "sealing-area-scatters-less-in-greater-cells": "sealing",
}

# What a reader of the paper should believe about each statement of the paper that does not hold or is undecided.
CONCLUSIONS = {
    "table-of-alpha": "The printed table is right within its statistical errors, as far as we can see. For k_l = 1 the "
                      "scatter between surfaces is so large that 200 surfaces give α to 2 to 3 % only.",
    "table-of-summit-density": "The printed numbers are right, in waves per side.",
    "tabulated-density-of-summits": "Multiply the printed densities by (2π)²: the distance between summits is shorter by 2π "
                                    "than the paper says.",
    "area-falls-with-alpha": "The order holds for k_l = 1 and 4. For k_l = 16 the counted areas are too close to each other, "
                             "because the error of the mesh grows with k_s. The corrected areas show the order everywhere.",
    "alpha-alone-does-not-decide": "Counted areas of equal ζ differ by 2 to 8 %. Nearly all of this is the error of the mesh: "
                                   "corrected areas of equal ζ agree within their errors.",
    "alpha-in-asperity-models": "The models predict an area for α = 10 that is 20 % lower than for α = 2, not 30 %.",
    "scatter-falls-with-cutoffs": "The scatter falls with k_l and k_s. For the narrowest spectra more surfaces are needed to "
                                  "show it.",
    "estimated-error-halves-at-30-percent": "The estimated relative error halves earlier, at about 21 % of the area.",
    "no-trend-within-corrected-groups": "The groups are an effect of the coefficient π/8. Do not use them.",
    "corrected-secant-grows": "The secant does not grow for the narrowest of the three spectra. Where it grows, the "
                              "coefficient π/8 is the reason.",
    "slope-is-convex": "The slopes are convex for eight of nine spectra, and probably for all.",
    "least-convex-kappa-depends-on-k-lower": "The smallest κ grows by 7 to 10 % for each factor of four in k_l.",
    "law-fits-below-a-fifth": "The law fits to 0.4 % for k_l = 4 and 16. For k_l = 1 its three parameters cannot be "
                              "determined from areas below 20 %.",
    "full-contact-at-1.7": "Some nodes are still open at 1.7. Full contact needs loads of 2 and more.",
    "scaled-erf-fits": "No single factor describes the approach to full contact: the local factor falls as the area grows.",
    "groups-by-k-upper-near-full-contact": "There are no such groups.",
    "faster-to-full-contact-for-smaller-k-lower": "The open areas show no such order.",
}


def page():
    text = "\n".join([abstract(), computations(), surfaces(), light(), mesh(), spectrum(), proportionality(), full_contact(),
                      asperities(), pressures(), sealing(), conclusions(), evidence()])
    return filled_page(text)


def figure(study, name, caption):
    return f"![{caption}](images/findings/{study}-{name}.svg)\n\n*{caption}*\n"


def claim(name, verdict, study=CAMPAIGN):
    """Links a verdict to its evidence, and checks that the claim still has the verdict that the text assumes."""
    found = claims.of(study)[name]["verdict"]
    assert found == verdict, f"the article says that {name} {verdict}, but the verdict is: {found}"
    return f"[{verdict}](findings/{PAGES[name]}.md)"


def values(name, study=CAMPAIGN, only=""):
    """Returns the values of the quantities of a claim whose labels contain a text."""
    return [one["value"] for one in claims.of(study)[name]["quantities"] if only in one["label"]]


def deciding(name, study=CAMPAIGN):
    of = claims.of(study)[name]
    return next(one for one in of["quantities"] if one["label"] == of["deciding"])["value"]


def verdicts(kind):
    of = [one["verdict"] for one in claims.of(CAMPAIGN).values() if one["kind"] == kind]
    return {verdict: of.count(verdict) for verdict in ("holds", "does not hold", "cannot say")}


def abstract():
    count = verdicts("paper")
    narrow, wide = kappa.about(0.05)
    overestimate = [1 / value for value in values("error-is-smaller-than-estimated", "mesh-convergence")]
    return f"""\
<!-- Written by tests/findings.py from the tables under data/findings; do not edit. -->

# Findings: the contact area of rough surfaces, from first touch to full contact

Yastrebov, Anciaux & Molinari (*J. Mech. Phys. Solids*, 2015) computed how the contact area of rough elastic surfaces
grows with the load, from first touch to full contact. We repeated their computations with an independent program, with
{t.surfaces_per_spectrum()} surfaces for each of their nine spectra, and tested every statement of the paper that has a
testable meaning. Further studies vary what the paper keeps constant: the mesh, the size of the cell, the bandwidth of the
roughness, the Hurst exponent and the form of the spectrum.

- **Most of the paper stands.** Of its {sum(count.values())} testable statements {count["holds"]} hold,
  {count["does not hold"]} do not, and {count["cannot say"]} are still undecided.
- **The area under light load** is as printed. At a load of 0.06 it is {t.area_at(0.06)} of the nominal area, more than in
  Persson's theory and less than the asymptote of Bush, Gibson & Thomas.
- **The correction for the mesh** that the paper proposes is {ranging(overestimate, 2)} times too large. The coefficient that its authors derived in 2017 is right within 15 %.
- **The bandwidth decides the area.** With the correction of 2017, the areas of all spectra nearly follow one function of
  k_s/k_l. The ratio of area to load falls with the logarithm of the bandwidth: at a load of 0.05, from about {narrow} at
  k_s/k_l = 2 to about {wide} at 128, in units of √(2π). No universal factor between area and load exists in this range.
- **Full contact** needs loads of {t.full_contact_range()}, not 1.7. The area approaches it with the exponent of Persson's
  theory.
- **Asperity models** have too small an area, the more so the wider the spectrum.
- **Seals** close when about {digits(t.sealing_limit()["limit"], 2)} of the nominal area is in contact.
"""


def computations():
    return f"""\
## How the results were computed

The surfaces are periodic, Gaussian and self-affine, with a Hurst exponent of 0.8 unless we say otherwise. The power
spectrum is constant in direction and follows a power law between the cutoffs k_l and k_s, which count waves per side of the
cell. The campaign of the paper has k_l = 1, 4, 16 and k_s = 32, 64, 128 on 1024 × 1024 nodes. Each surface is pressed
against a rigid plane under ninety loads. The contact problem is [solved](theory/contact.md) at each load without an
approximation other than the mesh; the sets of contact nodes agree with those of independent programs to the node.

The *load* y is the mean pressure over E\\* h′, where E\\* is the effective modulus and h′ the rms slope of the surface. The
*area* is the fraction of the nominal area that is in contact, and the *secant* is area over load. The *bandwidth* is
k_s/k_l.

Each statement is translated into quantities with an expected range. A claim *holds* if all its quantities lie in their
ranges with 95 % confidence. It *does not hold* if at least one lies outside with 95 % confidence. Otherwise its verdict is
*cannot say*. The evidence for each verdict, with confidence intervals, is on the pages that the sections link. A page
lists the [studies, terms and rules](findings/studies.md).
"""


def surfaces():
    return f"""\
## Which of the surfaces are Gaussian?

A cell that contains a single longest wavelength (k_l = 1) is not Gaussian: its heights have an excess kurtosis of
{digits(deciding("heights-are-not-gaussian-for-k-lower-1"), 2)} (rms over surfaces;
{claim("heights-are-not-gaussian-for-k-lower-1", "holds")}). For k_l = 4 and 16 the
excess kurtosis is at most {digits(deciding("heights-are-gaussian-from-k-lower-4"), 2)} ({claim("heights-are-gaussian-from-k-lower-4", "holds")}). The
reason is the number of modes that matter. For H = 0.8 nearly all power is in the longest waves, and for k_l = 1 only four to
five pairs of modes contribute. A larger k_s adds modes without power ({claim("modes-come-from-k-lower", "holds")}).

{figure("heights", "heights", "Density of heights of single surfaces and of a thousand surfaces of each spectrum, with a Gaussian.")}
Results for k_l = 1 therefore describe a cell with few waves, not a large surface. They also scatter most: Nayak's
parameter of a single surface with k_l = 1 has a standard deviation of {t.nayak_scatter(1)}.

The printed table of Nayak's parameter agrees with ours within the statistical errors, where the errors allow a verdict
({claim("table-of-alpha", "cannot say", "nayak")}). The printed densities of summits are right in waves per side, but the
distance between summits that the paper computes from them lacks a factor of 2π
({claim("tabulated-density-of-summits", "does not hold")}). Tables: [surfaces](findings/surfaces.md).
"""


def light():
    return f"""\
## How large is the contact area under a light load?

At a load of 0.06 the counted area is {t.area_at(0.06)}, as the paper says ({claim("area-at-0.06", "holds")}). Persson's
theory gives {t.persson_at(0.06)}, less than every spectrum ({claim("area-above-persson", "holds")}). For k_l = 16 the area is
within 10 % of the asymptote of Bush, Gibson & Thomas, √(2π) y
({claim("widest-k-lower-is-close-to-bgt-asymptote", "holds")}).

The counted area grows with k_l at all loads ({claim("area-grows-with-k-lower", "holds")}), and its curves form groups by k_l
({claim("area-groups-by-k-lower", "holds")}). Within a group the area falls as k_s grows, although for k_l = 16 the
differences are as small as the errors ({claim("area-falls-with-alpha", "cannot say")}). The next two sections show that
the error of the mesh explains much of this pattern.

{figure(CAMPAIGN, "area-light", "Counted contact area, and its ratio to the load, for the nine spectra (fig. 5 of the paper).")}
{figure(CAMPAIGN, "contact-maps", "Contact spots of one surface for each of two spectra (figs. 7 and 8). A wide spectrum has many small spots.")}
Tables: [contact under light load](findings/light-load.md).
"""


def mesh():
    overestimate = [1 / value for value in values("error-is-smaller-than-estimated", "mesh-convergence")]
    estimated = deciding("largest-estimated-error")
    return f"""\
## How wrong is the area of a mesh?

A node in contact counts as a whole cell, although the edge of contact cuts through the cell. The counted area is therefore
too large by an amount that is proportional to the length of the edge. The paper subtracts (π/8) S_d Δx, where Δx is the
mesh step and S_d the length of the edge along rows and columns. We solved the same surfaces on meshes from 128² to 2048²
and found that the true error is {ranging(overestimate, 2)} times smaller
({claim("error-is-smaller-than-estimated", "holds", "mesh-convergence")}). The coefficient (π − 1 + ln 2)/24, derived by the
same authors in 2017, is right within 15 % ({claim("correction-of-2017-is-right", "holds", "mesh-convergence")}).

{figure("mesh-convergence", "mesh-convergence", "Area of the same surfaces on finer meshes: counted, corrected as in 2015, and corrected as in 2017.")}
At the lightest load the estimate of the paper is {digits(100 * estimated, 2)} % of the counted area for the spectrum with
the most edges ({claim("largest-estimated-error", "holds")}). The true error is about a quarter of this. With the correction of 2017, a mesh with eight nodes to the shortest wavelength gives the area of an infinitely fine
mesh to 2 % ({claim("eight-nodes-to-the-wavelength-are-enough-once-corrected", "holds", "limits")}).

The size of the correction matters for the conclusions. Areas corrected by π/8 form groups by k_s
({claim("corrected-area-groups-by-k-upper", "holds")}), because the overcorrection is largest where the mesh is coarsest.
The groups disappear with the coefficient of 2017. Tables: [error of the mesh](findings/mesh.md).
"""


def spectrum():
    worst = max(values("corrected-area-depends-on-bandwidth-alone"), key=abs)
    return f"""\
## Which property of the spectrum decides the area?

The paper discusses the cutoffs k_l and k_s and Nayak's parameter α. With areas corrected as in 2017 the answer is simpler:
at a given load the area falls with the logarithm of the bandwidth k_s/k_l
({claim("corrected-area-falls-logarithmically-with-bandwidth", "holds")}). The bandwidth describes the nine spectra
better than α does ({claim("corrected-area-collapses-on-bandwidth-rather-than-alpha", "holds")}). {t.collapse_words()}

{figure(CAMPAIGN, "collapse", "Area corrected as in 2017 under three loads, against the bandwidth. One line describes all cutoffs.")}
Is the bandwidth the only property that matters? At a given bandwidth, a factor e in k_l changes the area by at most
{digits(100 * abs(worst), 2)} % in our estimates, but the intervals are not yet narrow enough to exclude 1.5 %
({claim("corrected-area-depends-on-bandwidth-alone", "cannot say")}).

The Hurst exponent hardly matters: at given cutoffs, the area changes by about one per cent as H goes from 0.1 to 1.
Tables: [error of the mesh](findings/mesh.md).
"""


def proportionality():
    return f"""\
## Is the area proportional to the load?

No. The slope of the area decreases from the first touch on ({claim("slope-decreases", "holds")}). The *contact evolution
law* of the paper describes the decrease by the parameters κ, β and μ.

{figure(CAMPAIGN, "slope", "Slope of the contact area against the load, with fits of the contact evolution law (fig. 6).")}
Theories give the secant at vanishing load as a universal number: √(8/π) = {digits(0.6366 * BGT, 3)} for Persson, √(2π) =
{digits(BGT, 3)} for Bush, Gibson & Thomas. We extrapolated the secants of 104 combinations of spectrum and mesh. {kappa.words()} Whether the fall is exactly logarithmic is undecided
({claim("kappa-falls-logarithmically-with-bandwidth", "cannot say", "limits")}).

{figure("limits", "limits", "Secant, stiffness and sealing threshold, extrapolated to large cells and fine meshes.")}
A single number κ for all rough surfaces would require that the secant stops falling at large bandwidths. Our data, up to
k_s/k_l = 128, show no sign of this at a load of 0.05. Tables: [limits](findings/limits.md), [slope and
law](findings/slope.md), [mean contact pressure](findings/pressure-growth.md).
"""


def full_contact():
    ratios = values("cracks-near-full-contact")
    return f"""\
## How does the contact become full?

The load at which the last node closes follows exactly from the heights of a surface. Its mean is {t.full_contact_range()}
for the nine spectra, not 1.7 ({claim("full-contact-at-1.7", "does not hold")}). It grows with k_s, because a
wider spectrum has more places at which the last node can close, and the highest load of more places is higher.

{figure(CAMPAIGN, "area-full", "Contact area and its slope under all loads (fig. 9).")}
The open area vanishes as in Persson's theory, with the exponent {digits(deciding("exponent-near-full-contact"), 3)} in place
of 2 ({claim("exponent-near-full-contact", "holds")}), but it is smaller than Persson's
({claim("faster-than-persson", "holds")}). A simple picture explains both: each remaining gap is a penny-shaped crack, which
opens on 3/2 of the area that would be in tension at full contact; Persson's theory has a factor of 2. We find factors of
{ranging(ratios)} at the heaviest loads ({claim("cracks-near-full-contact", "cannot say")}).

{figure(CAMPAIGN, "near-full-contact", "Approach to full contact (fig. 10). Top right: open area over that of Persson's theory.")}
The scaled error function of the paper, erf(β √2 y), does not describe the approach with one β
({claim("scaled-erf-fits", "does not hold")}). Near full contact the curves form no groups by k_s
({claim("groups-by-k-upper-near-full-contact", "does not hold")}). Tables: [up to full
contact](findings/full-contact.md).
"""


def asperities():
    return f"""\
## What do asperity models miss?

An asperity model places a Hertz contact on each summit. {t.asperity_words()} The contacts are not separate even under this
light load: {t.overlap_range()} of the modelled area lies in ellipses that intersect another one.

{figure("asperities-1024", "asperities", "Area of asperity models over the area of the solution for the same surfaces.")}
Tables: [asperity models](findings/asperities.md).
"""


def pressures():
    return f"""\
## How are the contact pressures distributed?

Pressures between 0.5 and 1 E\\* h′ occupy the area that Persson's theory predicts, under all loads
({claim("middle-pressures-are-as-in-persson", "holds", "distributions")}). Higher pressures are rarer
({claim("high-pressures-are-rarer-than-in-persson", "holds", "distributions")}), and low pressures more frequent: at a load
of 0.01, pressures below 0.2 E\\* h′ occupy {t.low_pressure_ratio()} times the area of the theory. Near full contact, pressures
above 0.5 E\\* h′ are distributed as in the theory
({claim("pressures-near-full-contact-are-as-in-persson", "holds", "distributions")}).

{figure("distributions", "contact-pressures", "Density of the contact pressure, compared with Persson's theory.")}
At zero the density rises linearly, as at the edge of a Hertzian contact
({claim("pressure-density-is-linear-at-zero", "holds", "pressure-edges")}). A mesh of eight nodes to the shortest
wavelength does not show this: its density is constant down to zero. Tables: [distributions](findings/distributions.md).
"""


def sealing():
    return f"""\
## When does the interface seal?

{t.sealing_words()} The threshold lies below one half for all cells
({claim("interface-is-sealed-below-one-half-of-the-area", "holds")}), and it scatters less between surfaces as the cell
grows ({claim("sealing-area-scatters-less-in-greater-cells", "holds")}). {t.narrow_sealing_words()}

{figure("sealing", "sealing", "Fraction of surfaces through whose gap a fluid can pass, against the contact area.")}
Tables: [sealing](findings/sealing.md).
"""


def conclusions():
    of = claims.of(CAMPAIGN) | {name: one for name, one in claims.of("nayak").items() if name.startswith("table-of")}
    names = [name for name, one in of.items() if one["kind"] == "paper" and one["verdict"] in ("does not hold", "cannot say")]
    assert set(names) == set(CONCLUSIONS), f"conclusions are missing or obsolete: {set(names) ^ set(CONCLUSIONS)}"
    lines = [[claims.cell(of[name]["says"]), f"[{of[name]['verdict']}](findings/{PAGES[name]}.md)", CONCLUSIONS[name]]
             for name in names]
    return f"""\
## What a reader of the paper should now believe

The {verdicts("paper")["holds"]} statements that hold can be used as printed. The others need a remark:

{t.rows(["statement of the paper", "verdict", "what to believe"], lines)}"""


def evidence():
    return """\
## Evidence

| page | content |
|---|---|
| [Studies, terms and verdicts](findings/studies.md) | manifests of all studies, symbols, rules of the verdicts |
| [Surfaces](findings/surfaces.md) | heights, Nayak's parameter, density of summits |
| [Contact under light load](findings/light-load.md) | areas of the nine spectra, with theories; cutoffs of earlier studies |
| [Error of the mesh](findings/mesh.md) | corrections of 2015 and 2017; dependence on bandwidth, α, Hurst exponent, plateau |
| [Slope and evolution law](findings/slope.md) | parameters of the law with intervals |
| [Up to full contact](findings/full-contact.md) | full-contact loads, scaled error function |
| [Mean contact pressure](findings/pressure-growth.md) | exponents of its growth |
| [Limits](findings/limits.md) | large cells, wide spectra, fine meshes |
| [Asperity models](findings/asperities.md) | area with and without interaction |
| [Distributions](findings/distributions.md) | pressures, gaps, contact spots |
| [Sealing](findings/sealing.md) | thresholds and flow |
| [Misprints](findings/misprints.md) | sentences and formulas that are wrong as printed |
"""
