//! Slips in the paper's print that a reader of its numbers must know; none is a claim.

use super::{Claim, Expectation, Origin, Outcome, Statement};

/// The slips, in the order of the paper.
pub fn claims() -> Vec<Claim> {
    let noted = |statement: &Statement| Claim {
        statement: *statement,
        data: "the paper's print",
        outcome: Outcome::Noted,
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

const MISPRINTS: [Statement; 8] = [
    misprint(
        "cutoffs-belong-to-the-spectrum",
        "section 3, eq. of the spectrum",
        "C if k_l < |k| < k_r",
        "appendix A.1 has k_l ≤ |k|, and the tables of α and D are those of spectra with both ends",
    ),
    misprint(
        "shortest-wavelength",
        "section 7",
        "λ_s = 2π/k_s",
        "k counts waves per side: λ_s = L/k_s, as section 3 defines it",
    ),
    misprint(
        "p0-over-rms-slope",
        "section 4, three times",
        "p₀ = 1.7 E*, p₀ ∈ [0; 0.06 E*]",
        "loads are p₀/(E* √⟨|∇h|²⟩), as on the axes of all figures: with a slope of 0.02, 0.06 E* would \
         be far beyond full contact",
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
        "appendix A.2, table A.2",
        "D, with ⟨d⟩ = 1/√D",
        "the table counts wavenumbers as integers: summits in a cell of side L number (2π)² D, and \
         ⟨d⟩ is smaller by 2π; see tabulated-density-of-summits",
    ),
];
