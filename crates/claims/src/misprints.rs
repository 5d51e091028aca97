//! Slips in the paper's print that a reader of its numbers must know; none is a claim.

use super::{Claim, ClaimOutcome, Expectation, Origin, Statement};

/// The slips, in the order of the paper.
pub fn claims() -> Vec<Claim> {
    let noted = |statement: &Statement| Claim {
        statement: *statement,
        data: "the paper's print",
        outcome: ClaimOutcome::Noted,
    };
    MISPRINTS.iter().map(noted).collect()
}

const fn misprint(
    name: &'static str,
    place: &'static str,
    says: &'static str,
    because: &'static str,
) -> Statement {
    Statement {
        name,
        origin: Origin::Misprint,
        says,
        place,
        quantity: "",
        expected: Expectation::Within(f64::NEG_INFINITY, f64::INFINITY),
        because,
        figure: None,
    }
}

const MISPRINTS: [Statement; 9] = [
    misprint(
        "cutoffs-belong-to-the-spectrum",
        "section 3, eq. of the spectrum",
        "C if k_l < |k| < k_r",
        "appendix A.1 has k_l ≤ |k|; without a plateau the second line includes k_l, so that it matters with \
         one alone",
    ),
    misprint(
        "shortest-wavelength",
        "section 7",
        "λ_s = 2π/k_s",
        "k counts waves per side: λ_s = L/k_s, as section 3 defines it",
    ),
    misprint(
        "p0-over-rms-slope",
        "section 4, twice; footnote of section 5.2.1; captions of figs. 12 and 13",
        "p₀ = 1.7 E*, p₀ ∈ [0; 0.06 E*]",
        "loads are p₀/(E* √⟨|∇h|²⟩), as in eqs. (linear_a) and (area_persson): with a slope of 0.02, \
         0.06 E* would be 3 in those units, beyond full contact",
    ),
    misprint(
        "relative-error-is-absolute",
        "section 8, E(p₀)",
        "E(p₀) = (π/8) S_d Δx/A₀, “the relative error”",
        "45 % and “divided by two at about 30 %” hold for the error over the contact area A, not over \
         A₀: see largest-estimated-error",
    ),
    misprint(
        "eq-of-eta",
        "caption of fig. 10",
        "“the exponent η = 2 in Eq. (area_persson)”",
        "η stands in eq. (full_area_approx)",
    ),
    misprint(
        "longest-wavelength-is-meant",
        "section 10",
        "“the lower cutoff wavenumber has to be high enough, i.e. the shortest wavelength has to be \
         significantly smaller than the period”",
        "the longest wavelength, L/k_l",
    ),
    misprint(
        "plateau-ratio",
        "appendix A.1",
        "“the ratios ξ = k_r/k_l”",
        "the formulas have ξ = k_l/k_r, as it is defined before them",
    ),
    misprint(
        "density-in-integer-wavenumbers",
        "appendix A.2, table 3",
        "D, with ⟨d⟩ = 1/√D",
        "the table counts waves per side, eq. (Danal) wants angular wavenumbers: a factor of (2π)² is \
         missing in D, of 2π in ⟨d⟩; an error more than a slip, see tabulated-density-of-summits",
    ),
    misprint(
        "asymptote-of-itself",
        "section 5.1",
        "the prediction (area_persson_as) “only slightly deviates from its asymptotics”",
        "eq. (area_persson) is meant; it deviates by 0.24 % at the load 0.06",
    ),
];
