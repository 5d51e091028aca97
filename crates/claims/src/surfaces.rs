//! Claims on the distribution of heights, and on the tables of Nayak's parameter and of the density
//! of summits (section 3, appendices A and B).

use crate::evidence::{Evidence, PerSurface};
use crate::quantities::Quantities;
use crate::{Claim, Expectation, Origin, Statement};

const GAUSSIAN: Statement = Statement {
    name: "heights-are-gaussian-from-k-lower-4",
    origin: Origin::Paper,
    text: "“When we increase the lower cutoff to k_l = 4, 16, an accurate Gaussian distribution is \
           obtained even for individual surfaces.”",
    source: "section 3, fig. 3; appendix B, fig. 16",
    quantity: "root mean square over surfaces of the excess kurtosis of their heights, k_lower ≥ 4",
    expected: Expectation::Within(f64::NEG_INFINITY, 0.25),
    reason: "an excess kurtosis of 0.25 changes the maximum of the density by 3 %, which is hardly \
             visible in a figure; surfaces with k_lower = 1 have about twice that; the skewness is \
             not tested",
    figure: Some("heights"),
};

const NOT_GAUSSIAN: Statement = Statement {
    name: "heights-are-not-gaussian-for-k-lower-1",
    origin: Origin::Paper,
    text: "“For k_l = 1 … each particular distribution is strictly non-Gaussian”",
    source: "section 3, fig. 3; appendix B, fig. 16",
    quantity: "root mean square over surfaces of the excess kurtosis of their heights, k_lower = 1",
    expected: Expectation::Within(0.25, f64::INFINITY),
    reason: "0.25 is the limit of heights-are-gaussian-from-k-lower-4; “each … strictly” claims \
             more than a root mean square over surfaces can show",
    figure: Some("heights"),
};

const K_UPPER_DOES_NOT_HELP: Statement = Statement {
    name: "modes-come-from-k-lower",
    origin: Origin::Paper,
    text: "for k_l = 1 “increasing k_s does not solve the problem; it practically has no effect on \
           the distribution”, and “an increase in k_s does not result in approaching a normal \
           distribution”",
    source: "section 3; appendix B, fig. 16",
    quantity: "ratio of the mean effective numbers of modes for neighbouring k_upper (larger over \
               smaller) at equal k_lower, k_upper ≥ 8 k_lower; the mean excess kurtosis of the \
               heights is −3/2 divided by this number",
    expected: Expectation::Within(0.9, 1.1),
    reason: "“practically no effect” is read as less than 10 %",
    figure: Some("heights"),
};

const TABLE_OF_ALPHA: Statement = Statement {
    name: "table-of-alpha",
    origin: Origin::Paper,
    text: "Nayak's parameter for different cutoffs, computed from 200 surfaces of 1024 × 1024 \
           nodes",
    source: "table 2, numerical",
    quantity: "mean α of the surfaces minus the printed α, divided by the sum of 3.5 standard \
               errors of a mean over 200 such surfaces and half a unit of the last printed digit",
    expected: Expectation::Within(-1.0, 1.0),
    reason: "the printed means scatter, too: all 66 of them lie within 3.5 standard errors with a \
             probability of 97 %",
    figure: Some("nayak"),
};

const TABLE_OF_DENSITY: Statement = Statement {
    name: "table-of-summit-density",
    text: "the density of asperities for different cutoffs, computed from 200 surfaces of 1024 × \
           1024 nodes",
    source: "table 3, numerical; in integer wavenumbers",
    quantity: "mean D of the surfaces minus the printed D, divided by the sum of 3.5 standard \
               errors of a mean over 200 such surfaces and half a unit of the last printed digit",
    figure: Some("summit-density"),
    ..TABLE_OF_ALPHA
};

pub fn claims(evidence: &Evidence) -> Vec<Claim> {
    let alpha = include_str!("../data/yastrebov-2015-nayak.csv");
    let density = include_str!("../data/yastrebov-2015-summit-density.csv");
    vec![
        kurtosis(evidence, GAUSSIAN, "`k_lower` of at least 4", |k_lower| k_lower >= 4),
        kurtosis(evidence, NOT_GAUSSIAN, "`k_lower = 1`", |k_lower| k_lower == 1),
        modes(evidence),
        table(evidence, TABLE_OF_ALPHA, "nayak", alpha),
        table(evidence, TABLE_OF_DENSITY, "summit_density_integer", density),
    ]
}

fn kurtosis(
    evidence: &Evidence,
    statement: Statement,
    spectra: &str,
    belongs: fn(i64) -> bool,
) -> Claim {
    let mut quantities = Quantities::default();
    for ensemble in evidence.of_surfaces("excess_kurtosis") {
        if ensemble.spectrum.is_of_the_paper() && belongs(ensemble.spectrum.k_lower) {
            let squares: Vec<f64> = ensemble.values.iter().map(|value| value * value).collect();
            let label = evidence.name(&ensemble.spectrum);
            quantities.add(label, &[squares.len()], |weights| Some(weights.mean(&squares).sqrt()));
        }
    }
    quantities.judge(statement, "surfaces", || {
        format!("surfaces with heights, `hurst = 0.8`, no plateau and {spectra}")
    })
}

fn modes(evidence: &Evidence) -> Claim {
    let modes = evidence.of_surfaces("effective_modes");
    let mut quantities = Quantities::default();
    for narrow in modes.iter().filter(|one| one.spectrum.is_of_the_paper()) {
        let wider = modes.iter().filter(|wide| {
            let (one, other) = (&narrow.spectrum, &wide.spectrum);
            other.is_of_the_paper()
                && (one.nodes, one.k_lower) == (other.nodes, other.k_lower)
                && other.k_upper >= 2 * one.k_upper
                && one.k_upper >= 8 * one.k_lower
        });
        if let Some(wide) = wider.min_by_key(|wide| wide.spectrum.k_upper) {
            let k_upper = wide.spectrum.k_upper;
            let label = format!("{} → k_upper {k_upper}", evidence.name(&narrow.spectrum));
            let surfaces = [narrow.values.len(), wide.values.len()];
            quantities.add(label, &surfaces, |weights| {
                Some(weights.mean(&wide.values) / weights.mean(&narrow.values))
            });
        }
    }
    quantities.judge(K_UPPER_DOES_NOT_HELP, "surfaces", || {
        "surfaces with `hurst = 0.8`, no plateau, and two `k_upper` of at least 8 `k_lower`, one \
         at least twice the other"
            .to_owned()
    })
}

/// Number of surfaces over which the paper averages each cell of its tables.
const TABULATED: f64 = 200.0;
/// Number of standard errors by which the mean of a study may differ from the value that the paper
/// prints.
const ERRORS: f64 = 3.5;

fn table(evidence: &Evidence, statement: Statement, column: &str, printed: &str) -> Claim {
    let mut quantities = Quantities::default();
    for ensemble in evidence.of_surfaces(column) {
        let Some(printed) = cell(printed, &ensemble) else {
            continue;
        };
        let label = evidence.name(&ensemble.spectrum);
        let scatter = asperity_statistics::intervals::Weights::ALL.deviation(&ensemble.values);
        // The paper prints two decimals.
        let allowed = ERRORS * scatter / TABULATED.sqrt() + 0.005;
        quantities.add(label, &[ensemble.values.len()], |weights| {
            Some((weights.mean(&ensemble.values) - printed) / allowed)
        });
    }
    quantities.judge(statement, "surfaces", || {
        "surfaces of the tabulated spectra: `hurst` 0.3 or 0.8, `k_lower` 1 … 32, `k_upper` 16 … 512, \
         no plateau, as in `nayak.toml`"
            .to_owned()
    })
}

/// Returns the value that the paper prints for a spectrum. `printed` is CSV with the columns hurst,
/// k_lower, k_upper, numerical.
fn cell(printed: &str, ensemble: &PerSurface) -> Option<f64> {
    let spectrum = &ensemble.spectrum;
    if !spectrum.is_plain() {
        return None;
    }
    let cutoffs = format!("{},{},{},", spectrum.hurst, spectrum.k_lower, spectrum.k_upper);
    let row = printed.lines().find_map(|line| line.strip_prefix(&cutoffs))?;
    row.split(',').next()?.parse().ok()
}
