//! Claims on artificial tables, on which they must hold, fail, or remain undecided.

use std::sync::LazyLock;

use super::evidence::StageTable;
use super::*;
use asperity_mechanics::grid::Cell;
use asperity_mechanics::theory::persson;
use asperity_mechanics::topography::spectrum;
use asperity_pipeline::study::claims::shipped;
use asperity_stages::Kind;
use asperity_stages::columns::*;
use asperity_stages::correct::{AS_COUNTED, OF_2015, OF_2017};
use asperity_statistics::random::normal;
use asperity_tables::column::{integers, reals, texts};
use asperity_tables::table::Table;

mod open_questions;

static CLAIMS: LazyLock<Vec<ClaimSpec>> = LazyLock::new(shipped);

/// Tests the shipped claims with these tables.
fn judged(stages: Vec<StageTable>) -> Vec<Claim> {
    all(&CLAIMS, &Evidence::from_tables(stages).unwrap()).unwrap()
}

/// Artificial areas for all combinations of cutoffs, with scatter between surfaces.
struct Campaign {
    surfaces: u64,
    /// Relative scatter of a realization, the same in all spectra.
    shared: f64,
    /// Independent relative scatter of each surface.
    own: f64,
    area: fn(k_lower: i64, k_upper: i64, load: f64) -> f64,
    correction: &'static str,
}

impl Campaign {
    fn table(&self) -> Table {
        let loads: Vec<f64> = (1..=50).map(|i| 0.0012 * f64::from(i)).collect();
        let mut rows: Vec<(i64, i64, i64, f64, f64)> = Vec::new();
        for k_lower in [2, 4, 8] {
            for k_upper in [16, 32, 64] {
                let shared = normal(0, self.surfaces as usize);
                let own = normal((100 * k_lower + k_upper) as u64, self.surfaces as usize);
                for (surface, (shared, own)) in shared.iter().zip(&own).enumerate() {
                    let factor = (self.shared * shared + self.own * own).exp();
                    rows.extend(loads.iter().map(|&load| {
                        let area = factor * (self.area)(k_lower, k_upper, load);
                        (k_lower, k_upper, surface as i64, load, area)
                    }));
                }
            }
        }
        let count = rows.len();
        Table::new(
            count,
            vec![
                (NODES, integers(vec![512; count])),
                (HURST, reals(vec![0.8; count])),
                (K_LOWER, integers(rows.iter().map(|row| row.0))),
                (K_ROLLOFF, integers(rows.iter().map(|row| row.0))),
                (K_UPPER, integers(rows.iter().map(|row| row.1))),
                (REALIZATION, integers(rows.iter().map(|row| row.2))),
                (CORRECTION, texts(vec![self.correction; count])),
                (LOAD, reals(rows.iter().map(|row| row.3))),
                (AREA_CORRECTED, reals(rows.iter().map(|row| row.4))),
            ],
        )
    }

    fn claims(&self) -> Vec<Claim> {
        judged(vec![finished(Kind::Correct, self.table())])
    }
}

/// Returns an area that grows by 6 % for each doubling of k_lower and falls by 1 % for each
/// doubling of k_upper.
fn as_the_paper_says(k_lower: i64, k_upper: i64, load: f64) -> f64 {
    let doublings = |cutoff: i64| (cutoff as f64).log2();
    let factor = 1.0 + 0.06 * doublings(k_lower) - 0.01 * doublings(k_upper);
    // The slope 2.3 e^(−4y) falls and is convex.
    factor * 2.3 * (1.0 - (-4.0 * load).exp()) / 4.0
}

const CAMPAIGN: Campaign = Campaign {
    surfaces: 20,
    shared: 0.05,
    own: 0.001,
    area: as_the_paper_says,
    correction: AS_COUNTED,
};

fn finished(kind: Kind, table: Table) -> StageTable {
    StageTable { name: kind.name().to_owned(), kind, table }
}

#[track_caller]
fn named<'a>(claims: &'a [Claim], name: &str) -> &'a Claim {
    claims.iter().find(|claim| claim.statement.name == name).expect(name)
}

#[track_caller]
fn judgement<'a>(claims: &'a [Claim], name: &str) -> &'a Judgement {
    match &named(claims, name).outcome {
        ClaimOutcome::Judged(judgement) => judgement,
        other => panic!("{name}: {other:?}"),
    }
}

/// Returns the unmet requirement of the claim with this name. Panics if the claim was computed.
#[track_caller]
fn lacking<'a>(claims: &'a [Claim], name: &str) -> &'a str {
    match &named(claims, name).outcome {
        ClaimOutcome::NotComputed(needs) => needs,
        other => panic!("{name}: {other:?}"),
    }
}

#[track_caller]
fn verdict(claims: &[Claim], name: &str) -> Verdict {
    judgement(claims, name).verdict
}

/// Returns the claims of a study without data.
fn without_data() -> Vec<Claim> {
    judged(Vec::new())
}

#[test]
fn claims_hold_on_curves_that_were_made_to_agree() {
    let claims = CAMPAIGN.claims();
    for name in [
        "area-grows-with-k-lower",
        "area-falls-with-alpha",
        "effect-of-alpha-is-weaker-than-in-asperity-models",
        "area-above-persson",
        "slope-decreases",
        "slope-is-convex",
        "area-groups-by-k-lower",
        "alpha-alone-does-not-decide",
        "no-convergence-in-k-lower",
    ] {
        assert_eq!(verdict(&claims, name), Verdict::Holds, "{name}");
    }
}

#[test]
fn claims_fail_on_curves_that_were_made_to_contradict() {
    let reversed = Campaign {
        area: |k_lower, k_upper, load| {
            persson::area(load) * 0.9 * as_the_paper_says(8 / k_lower, 64 / k_upper, 0.02)
                / as_the_paper_says(1, 1, 0.02)
        },
        ..CAMPAIGN
    };
    let claims = reversed.claims();
    for name in [
        "area-grows-with-k-lower",
        "area-falls-with-alpha",
        "area-above-persson",
        "slope-is-convex",
        "area-at-0.06",
    ] {
        assert_eq!(verdict(&claims, name), Verdict::DoesNotHold, "{name}");
    }
}

#[test]
fn nothing_is_said_where_scatter_hides_it() {
    let scattered = Campaign { surfaces: 5, own: 0.05, ..CAMPAIGN };
    let claims = scattered.claims();
    for name in ["area-grows-with-k-lower", "area-falls-with-alpha"] {
        assert_eq!(verdict(&claims, name), Verdict::CannotSay, "{name}");
    }
}

#[test]
fn scatter_that_spectra_share_does_not_hide_their_differences() {
    let shared = Campaign {
        shared: 1.0,
        area: |k_lower, k_upper, load| 0.6 * as_the_paper_says(k_lower, k_upper, load),
        ..CAMPAIGN
    };
    let claims = shared.claims();
    assert_eq!(verdict(&claims, "area-grows-with-k-lower"), Verdict::Holds);
    assert_eq!(verdict(&claims, "area-above-persson"), Verdict::CannotSay);
}

#[test]
fn groups_are_told_by_the_cutoff_that_spreads_them() {
    let by_k_upper = Campaign {
        correction: OF_2015,
        area: |_, k_upper, load| as_the_paper_says(1, k_upper, load),
        ..CAMPAIGN
    };
    let claims = by_k_upper.claims();
    assert_eq!(verdict(&claims, "corrected-area-groups-by-k-upper"), Verdict::Holds);
    let by_k_lower = Campaign { correction: OF_2015, ..CAMPAIGN };
    let claims = by_k_lower.claims();
    let name = "corrected-area-groups-by-k-upper";
    assert_eq!(verdict(&claims, name), Verdict::DoesNotHold);
}

#[test]
fn areas_of_the_bandwidth_alone_collapse_and_others_do_not() {
    let of_bandwidth = Campaign {
        correction: OF_2017,
        area: |k_lower, k_upper, load| {
            as_the_paper_says(1, 1, load) * (k_upper as f64 / k_lower as f64).powf(-0.04)
        },
        ..CAMPAIGN
    };
    let claims = of_bandwidth.claims();
    let name = "corrected-area-depends-on-bandwidth-alone";
    assert_eq!(verdict(&claims, name), Verdict::Holds);
    let law = judgement(&claims, "corrected-area-falls-logarithmically-with-bandwidth");
    assert_eq!(law.verdict, Verdict::Holds);
    for bound in &law.bounds {
        assert!((bound.value - 0.04).abs() < 0.002, "{bound:?}");
    }
    assert_eq!(verdict(&claims, "alpha-alone-decides-corrected"), Verdict::Holds);
    // With k_lower = 1, α of a cell is larger by half than for other k_lower with this bandwidth.
    let rather = "corrected-area-collapses-on-bandwidth-rather-than-alpha";
    assert_eq!(verdict(&claims, rather), Verdict::Holds);
    let of_both = Campaign { correction: OF_2017, ..CAMPAIGN };
    assert_eq!(verdict(&of_both.claims(), name), Verdict::DoesNotHold);
}

/// Tests claims on one pair of cutoffs with these Hurst exponents. The area is a function of α and
/// H.
fn of_exponents(exponents: &[f64], area: fn(alpha: f64, hurst: f64) -> f64) -> Vec<Claim> {
    let scatter = normal(5, 10);
    let mut rows = Vec::new();
    for &hurst in exponents {
        let spectrum =
            spectrum::Spectrum { hurst, k_lower: 4, k_rolloff: 4, k_upper: 32, anisotropy: None };
        let nayak = spectrum.moments(Cell::square(1.0).unwrap()).nayak().unwrap();
        for (surface, scatter) in scatter.iter().enumerate() {
            let factor = (0.02 * scatter).exp() * area(nayak, hurst);
            let of_load = |load: f64| (hurst, surface as i64, load, 2.2 * load * factor);
            rows.extend([0.012, 0.024, 0.06].map(of_load));
        }
    }
    let count = rows.len();
    let table = Table::new(
        count,
        vec![
            (NODES, integers(vec![512; count])),
            (HURST, reals(rows.iter().map(|row| row.0))),
            (K_LOWER, integers(vec![4; count])),
            (K_ROLLOFF, integers(vec![4; count])),
            (K_UPPER, integers(vec![32; count])),
            (REALIZATION, integers(rows.iter().map(|row| row.1))),
            (CORRECTION, texts(vec![OF_2017; count])),
            (LOAD, reals(rows.iter().map(|row| row.2))),
            (AREA_CORRECTED, reals(rows.iter().map(|row| row.3))),
        ],
    );
    judged(vec![finished(Kind::Correct, table)])
}

#[test]
fn areas_of_alpha_alone_collapse_whatever_the_exponent() {
    let name = "corrected-area-collapses-on-alpha";
    let exponents = [0.2, 0.4, 0.6, 0.8];
    let of_alpha = of_exponents(&exponents, |alpha, _| alpha.powf(-0.1));
    assert_eq!(verdict(&of_alpha, name), Verdict::Holds);
    let of_both = of_exponents(&exponents, |alpha, hurst| {
        let beside = if hurst == 0.4 { 1.1 } else { 1.0 };
        beside * alpha.powf(-0.1)
    });
    assert_eq!(verdict(&of_both, name), Verdict::DoesNotHold);
}

#[test]
fn areas_that_hardly_differ_tell_no_collapse_on_alpha() {
    // ln A has an rms deviation of 0.006 from its mean, so every line leaves less than 0.01.
    let alike = of_exponents(&[0.2, 0.4, 0.6, 0.8], |alpha, _| alpha.powf(-0.04));
    let name = "corrected-area-collapses-on-alpha";
    let needs = lacking(&alike, name);
    assert!(needs.contains("more than 0.01 rms"), "{needs}");
}

#[test]
fn two_spectra_do_not_tell_a_collapse_for_any_line_goes_through_both() {
    let name = "corrected-area-collapses-on-alpha";
    let of_two = of_exponents(&[0.2, 0.8], |alpha, _| alpha.powf(-0.1));
    lacking(&of_two, name);
}

/// Tests claims on surfaces that approach full contact with an exponent η. Their open area is
/// `share` times Persson's for η = 2.
fn approaching(exponent: f64, share: f64) -> Vec<Claim> {
    let loads: Vec<f64> = (0..12).map(|i| 0.8 + 0.06 * f64::from(i)).collect();
    let surfaces = 10;
    let scatter = normal(3, surfaces);
    let open = |load: f64| {
        let x = std::f64::consts::SQRT_2 * load;
        // e^(−x^η) instead of the e^(−x²) of Persson's theory.
        share * persson::noncontact(load) * (x * x - x.powf(exponent)).exp()
    };
    let rows: Vec<(i64, f64, f64)> = (0..surfaces)
        .flat_map(|surface| loads.iter().map(move |&load| (surface, load)))
        .map(|(surface, load)| {
            let factor = (0.01 * scatter[surface]).exp();
            (surface as i64, load, 1.0 - factor * open(load))
        })
        .collect();
    let count = rows.len();
    let table = Table::new(
        count,
        vec![
            (NODES, integers(vec![1024; count])),
            (HURST, reals(vec![0.8; count])),
            (K_LOWER, integers(vec![4; count])),
            (K_ROLLOFF, integers(vec![4; count])),
            (K_UPPER, integers(vec![32; count])),
            (REALIZATION, integers(rows.iter().map(|row| row.0))),
            (LOAD, reals(rows.iter().map(|row| row.1))),
            (AREA_CORRECTED, reals(rows.iter().map(|row| row.2))),
        ],
    );
    let under = |correction| {
        let table = table.with(vec![(CORRECTION, texts(vec![correction; count]))]);
        finished(Kind::Correct, table)
    };
    judged(vec![under(AS_COUNTED), under(OF_2017)])
}

#[test]
fn the_exponent_near_full_contact_is_that_of_the_curves() {
    let cracks = approaching(2.0, 0.75);
    assert_eq!(verdict(&cracks, "exponent-near-full-contact"), Verdict::Holds);
    assert_eq!(verdict(&cracks, "faster-than-persson"), Verdict::Holds);
    assert_eq!(verdict(&cracks, "cracks-near-full-contact"), Verdict::Holds);
    let persson = approaching(2.0, 1.0);
    assert_eq!(verdict(&persson, "cracks-near-full-contact"), Verdict::DoesNotHold);
    let other = approaching(2.5, 1.0);
    assert_eq!(verdict(&other, "exponent-near-full-contact"), Verdict::DoesNotHold);
}

#[test]
fn what_a_study_lacks_is_named_and_not_judged() {
    for claim in without_data() {
        match &claim.outcome {
            ClaimOutcome::NotComputed(needs) => {
                assert!(needs.len() > 10, "{}", claim.statement.name)
            }
            ClaimOutcome::Noted => assert_eq!(claim.statement.origin, Origin::Misprint),
            ClaimOutcome::Judged(_) => {
                let is_own = claim.data.ends_with("independent of the study");
                assert!(is_own, "{}", claim.statement.name);
            }
        }
    }
}

/// Returns the unmet requirement of a claim, tested on the rows of a campaign that `keep` selects.
fn needs(campaign: &Campaign, keep: impl Fn(&Table, usize) -> bool, name: &str) -> String {
    let table = campaign.table();
    let rows: Vec<usize> = (0..table.rows()).filter(|&row| keep(&table, row)).collect();
    let claims = judged(vec![finished(Kind::Correct, table.pick(&rows))]);
    lacking(&claims, name).to_owned()
}

#[test]
fn a_missing_load_is_named_before_spectra_that_are_there() {
    let up_to =
        |most: f64| move |table: &Table, row| table.reals("load").unwrap().value(row) <= most;
    let lacks = needs(&CAMPAIGN, up_to(0.02), "area-at-0.06");
    assert!(lacks.contains("a load at 0.06") && lacks.contains("0.0192"), "{lacks}");
    let lacks = needs(&CAMPAIGN, up_to(0.006), "area-falls-with-alpha");
    assert!(lacks.contains("a load at 0.012 or 0.024 or 0.06"), "{lacks}");
    let one = |table: &Table, row| table.integers("k_upper").unwrap().value(row) == 32;
    let lacks = needs(&CAMPAIGN, one, "area-falls-with-alpha");
    assert!(lacks.contains("differ only in `k_upper`"), "{lacks}");
}

#[test]
fn spectra_that_the_paper_does_not_speak_of_are_not_put_to_its_words() {
    let table = CAMPAIGN.table();
    let count = table.rows();
    let claims = |table: Table| judged(vec![finished(Kind::Correct, table)]);
    let other = claims(table.replacing("hurst", reals(vec![0.3; count])));
    let coarse = claims(table.replacing("nodes", integers(vec![64; count])));
    for claims in [other, coarse] {
        let papers = claims.iter().filter(|claim| claim.statement.origin == Origin::Paper);
        for claim in papers.filter(|claim| claim.data.contains("area")) {
            let ClaimOutcome::NotComputed(needs) = &claim.outcome else {
                panic!("{}", claim.statement.name);
            };
            assert!(!needs.is_empty());
        }
    }
}

#[test]
fn few_surfaces_have_no_verdict() {
    for surfaces in [1, 2, 4] {
        let few = Campaign { surfaces, ..CAMPAIGN };
        for claim in few.claims() {
            let is_own = claim.data.ends_with("independent of the study");
            let is_judged = matches!(claim.outcome, ClaimOutcome::Judged(_));
            assert!(is_own || !is_judged, "{}", claim.statement.name);
        }
    }
}

#[test]
fn no_verdict_depends_on_the_order_of_the_surfaces() {
    let table = CAMPAIGN.table();
    let claims = |table: Table| judged(vec![finished(Kind::Correct, table)]);
    let before = claims(table.clone());
    let verdicts = |claims: &[Claim]| -> Vec<Option<Verdict>> {
        let verdict = |claim: &Claim| match &claim.outcome {
            ClaimOutcome::Judged(judgement) => Some(judgement.verdict),
            _ => None,
        };
        claims.iter().map(verdict).collect()
    };
    for turn in 1..=10 {
        let numbers = table.integers("realization").unwrap().values();
        let turned = numbers.iter().map(|number| (7 * number + turn) % 20);
        let turned = table.replacing("realization", integers(turned.collect::<Vec<_>>()));
        assert_eq!(verdicts(&claims(turned)), verdicts(&before));
    }
}

#[test]
fn names_tell_claims_apart() {
    let claims = without_data();
    let mut names: Vec<_> = claims.iter().map(|claim| &claim.statement.name).collect();
    let count = names.len();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), count);
}

/// Tests claims on one spectrum on four meshes: A_N = A* + c S_d Δx, where c scatters between
/// surfaces.
fn on_meshes(coefficient: f64, scatter: f64) -> Vec<Claim> {
    let surfaces = 10;
    let noise = normal(5, surfaces);
    let mut rows = Vec::new();
    for nodes in [128, 256, 512, 1024] {
        for (surface, noise) in noise.iter().enumerate() {
            // The perimeter has 10 N edges, so S_d Δx is 10/N of the cell.
            let edge = 10.0 / nodes as f64;
            let area = 0.13 + (coefficient + scatter * noise) * edge;
            rows.push((nodes, surface as i64, area));
        }
    }
    let count = rows.len();
    let table = Table::new(
        count,
        vec![
            (NODES, integers(rows.iter().map(|row| row.0))),
            (HURST, reals(vec![0.8; count])),
            (K_LOWER, integers(vec![4; count])),
            (K_ROLLOFF, integers(vec![4; count])),
            (K_UPPER, integers(vec![16; count])),
            (SEED, integers(vec![1; count])),
            (REALIZATION, integers(rows.iter().map(|row| row.1))),
            (LOAD, reals(vec![0.06; count])),
            (AREA_FRACTION, reals(rows.iter().map(|row| row.2))),
            (CONTACT_NODES, integers(vec![1; count])),
            (SWITCHES, integers(rows.iter().map(|row| 10 * row.0))),
        ],
    );
    judged(vec![finished(Kind::Measure, table)])
}

#[test]
fn corrections_are_judged_by_what_meshes_add() {
    let sharp = on_meshes(0.112, 0.001);
    assert_eq!(verdict(&sharp, "true-area-lies-within-the-bounds"), Verdict::Holds);
    assert_eq!(verdict(&sharp, "error-is-smaller-than-estimated"), Verdict::Holds);
    assert_eq!(verdict(&sharp, "correction-of-2017-is-right"), Verdict::Holds);
    let found = &judgement(&sharp, "correction-of-2017-is-right").bounds[0];
    assert!((found.value - 0.112 / 0.1181).abs() < 0.01, "{found:?}");
    let wide = on_meshes(0.112, 0.1);
    assert_eq!(verdict(&wide, "correction-of-2017-is-right"), Verdict::CannotSay);
    // Near π/8 = 0.393.
    let large = on_meshes(0.38, 0.001);
    assert_eq!(verdict(&large, "error-is-smaller-than-estimated"), Verdict::DoesNotHold);
    assert_eq!(verdict(&large, "correction-of-2017-is-right"), Verdict::DoesNotHold);
}

#[test]
fn closed_forms_decide_what_needs_no_study() {
    let claims = without_data();
    for (name, expected) in [
        ("asymptote-of-alpha", Verdict::Holds),
        ("greenwood-2006-far-from-its-asymptote", Verdict::Holds),
        ("persson-slope-is-concave", Verdict::Holds),
        ("alpha-in-asperity-models", Verdict::DoesNotHold),
        ("tabulated-density-of-summits", Verdict::DoesNotHold),
    ] {
        assert_eq!(verdict(&claims, name), expected, "{name}");
    }
}

#[test]
fn counted_summits_are_two_pi_squared_times_the_tabulated_density() {
    let claims = without_data();
    let found = &judgement(&claims, "tabulated-density-of-summits").bounds[0];
    let exact = (2.0 * std::f64::consts::PI).powi(2);
    // A mesh of sixteen nodes per shortest wavelength misses 3 % of the summits.
    let [lower, upper] = found.simultaneous(1);
    assert!(lower < exact && exact < upper * 1.03, "{found:?}");
}
