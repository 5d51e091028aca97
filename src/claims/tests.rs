//! Claims on made-up tables, in which they must hold, must fail, or cannot be told.

use super::evidence::{COUNTED, Finished, OF_2015, OF_2017};
use super::intervals::{simultaneous, widened};
use super::*;
use crate::contact::persson;
use crate::fitting::examples::normal;
use crate::stages::Kind;
use crate::stages::columns::*;
use crate::store::column::{Column, ColumnKind, integers, reals, texts};
use crate::store::table::Table;

/// A grid of spectra, each with surfaces that share their scatter with those of other spectra.
struct Campaign {
    surfaces: u64,
    /// Relative scatter that a realization has in all spectra.
    shared: f64,
    /// Relative scatter of each surface for itself.
    own: f64,
    area: fn(k_lower: i64, k_upper: i64, load: f64) -> f64,
    correction: &'static str,
}

impl Campaign {
    fn table(&self) -> Table {
        let loads: Vec<f64> = (1..=50).map(|i| 0.0012 * f64::from(i)).collect();
        let mut rows: Vec<(i64, i64, i64, f64, f64)> = Vec::new();
        for k_lower in [1, 2, 4] {
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
                (NODES, integers(vec![256; count])),
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
        all(&Evidence::of(&[finished(Kind::Correct, self.table())]).unwrap())
    }
}

/// Two per cent more area for every doubling of k_lower, one per cent less for k_upper.
fn as_the_paper_says(k_lower: i64, k_upper: i64, load: f64) -> f64 {
    let doublings = |cutoff: i64| (cutoff as f64).log2();
    let factor = 1.0 + 0.02 * doublings(k_lower) - 0.01 * doublings(k_upper);
    // The slope 2.3 e^(−4y) falls and is convex.
    factor * 2.3 * (1.0 - (-4.0 * load).exp()) / 4.0
}

const CAMPAIGN: Campaign = Campaign {
    surfaces: 20,
    shared: 0.05,
    own: 0.001,
    area: as_the_paper_says,
    correction: COUNTED,
};

fn finished(kind: Kind, table: Table) -> Finished {
    Finished {
        kind,
        level: None,
        table,
    }
}

#[track_caller]
fn verdict(claims: &[Claim], name: &str) -> Verdict {
    match &claims
        .iter()
        .find(|claim| claim.name == name)
        .unwrap()
        .outcome
    {
        Outcome::Judged(judgement) => judgement.verdict,
        Outcome::NotComputed(needs) => panic!("{name} needs {needs}"),
    }
}

#[test]
fn claims_hold_on_curves_that_were_made_to_agree() {
    let claims = CAMPAIGN.claims();
    for name in [
        "area-grows-with-k-lower",
        "area-falls-with-alpha",
        "effect-of-alpha-is-weaker-than-in-bgt",
        "area-above-persson",
        "area-below-bgt-asymptote",
        "slope-decreases",
        "slope-is-convex",
        "area-groups-by-k-lower",
    ] {
        assert_eq!(verdict(&claims, name), Verdict::Holds, "{name}");
    }
}

#[test]
fn claims_fail_on_curves_that_were_made_to_contradict() {
    let reversed = Campaign {
        area: |k_lower, k_upper, load| {
            persson::area(load) * 0.9 * as_the_paper_says(4 / k_lower, 64 / k_upper, 0.02)
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
    let scattered = Campaign {
        surfaces: 5,
        own: 0.05,
        ..CAMPAIGN
    };
    let claims = scattered.claims();
    for name in ["area-grows-with-k-lower", "area-falls-with-alpha"] {
        assert_eq!(verdict(&claims, name), Verdict::CannotSay, "{name}");
    }
}

#[test]
fn scatter_that_spectra_share_does_not_hide_their_differences() {
    let shared = Campaign {
        shared: 1.0,
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
    assert_eq!(
        verdict(&claims, "corrected-area-groups-by-k-upper"),
        Verdict::Holds
    );
    let by_k_lower = Campaign {
        correction: OF_2015,
        ..CAMPAIGN
    };
    let claims = by_k_lower.claims();
    let name = "corrected-area-groups-by-k-upper";
    assert_eq!(verdict(&claims, name), Verdict::DoesNotHold);
    let of_2017 = Campaign {
        correction: OF_2017,
        ..CAMPAIGN
    };
    let name = "groups-of-2015-are-of-the-correction";
    assert_eq!(verdict(&of_2017.claims(), name), Verdict::Holds);
}

/// Surfaces that approach full contact with an exponent, more or less open than Persson's.
fn approaching(exponent: f64, share: f64) -> Vec<Claim> {
    let loads: Vec<f64> = (0..12).map(|i| 0.8 + 0.06 * f64::from(i)).collect();
    let surfaces = 10;
    let scatter = normal(3, surfaces);
    let open = |load: f64| {
        let x = std::f64::consts::SQRT_2 * load;
        // e^(−x^η) in place of the e^(−x²) that Persson's theory has in it.
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
            (CORRECTION, texts(vec![COUNTED; count])),
            (LOAD, reals(rows.iter().map(|row| row.1))),
            (AREA_CORRECTED, reals(rows.iter().map(|row| row.2))),
        ],
    );
    all(&Evidence::of(&[finished(Kind::Correct, table)]).unwrap())
}

#[test]
fn the_exponent_near_full_contact_is_that_of_the_curves() {
    let cracks = approaching(2.0, 0.75);
    assert_eq!(
        verdict(&cracks, "exponent-near-full-contact"),
        Verdict::Holds
    );
    assert_eq!(verdict(&cracks, "faster-than-persson"), Verdict::Holds);
    assert_eq!(verdict(&cracks, "cracks-near-full-contact"), Verdict::Holds);
    let persson = approaching(2.0, 1.0);
    assert_eq!(
        verdict(&persson, "cracks-near-full-contact"),
        Verdict::DoesNotHold
    );
    let other = approaching(2.5, 1.0);
    assert_eq!(
        verdict(&other, "exponent-near-full-contact"),
        Verdict::DoesNotHold
    );
}

#[test]
fn what_a_study_lacks_is_named_and_not_judged() {
    let claims = all(&Evidence::default());
    let missing = claims
        .iter()
        .find(|claim| claim.name == "least-convex-kappa");
    let Outcome::NotComputed(needs) = &missing.unwrap().outcome else {
        panic!("judged without data");
    };
    assert!(needs.contains("minimal-convex"), "{needs}");
    let judged = claims
        .iter()
        .filter(|claim| matches!(claim.outcome, Outcome::Judged(_)));
    let own = ["closed form", "twenty surfaces drawn for it"];
    for claim in judged {
        assert!(own.contains(&claim.data.as_str()), "{}", claim.name);
    }
}

#[test]
fn few_surfaces_have_no_verdict() {
    for surfaces in [1, 2, 4] {
        let few = Campaign {
            surfaces,
            ..CAMPAIGN
        };
        for claim in few.claims() {
            let is_own = claim.data == "closed form" || claim.data.starts_with("twenty");
            assert!(
                is_own || matches!(claim.outcome, Outcome::NotComputed(_)),
                "{}",
                claim.name
            );
        }
    }
}

#[test]
fn the_same_tables_give_the_same_verdicts_to_the_last_bit() {
    assert_eq!(CAMPAIGN.claims(), CAMPAIGN.claims());
}

#[test]
fn names_and_data_tell_claims_apart() {
    let claims = all(&Evidence::default());
    let mut names: Vec<_> = claims
        .iter()
        .map(|claim| (claim.name, &claim.data))
        .collect();
    let count = names.len();
    names.sort();
    names.dedup();
    assert_eq!(names.len(), count);
}

fn fit(columns: Vec<(Column, arrow::array::ArrayRef)>) -> Vec<Claim> {
    let table = Table::new(1, columns);
    all(&Evidence::of(&[finished(Kind::Fit, table)]).unwrap())
}

const fn real(name: &'static str) -> Column {
    Column::result(name, ColumnKind::Real, "1", "")
}

fn mesh_fit(coefficient: f64, half_width: f64) -> Vec<Claim> {
    fit(vec![
        (
            Column::parameter("pooled", ColumnKind::Text, "", ""),
            texts(["surfaces and loads"]),
        ),
        (real("mesh_coefficient"), reals([coefficient])),
        (
            real("mesh_coefficient_lower"),
            reals([coefficient - half_width]),
        ),
        (
            real("mesh_coefficient_upper"),
            reals([coefficient + half_width]),
        ),
    ])
}

#[test]
fn corrections_are_judged_by_the_fitted_coefficient() {
    let sharp = mesh_fit(0.112, 0.005);
    assert_eq!(
        verdict(&sharp, "correction-of-2015-is-right"),
        Verdict::DoesNotHold
    );
    assert_eq!(
        verdict(&sharp, "correction-of-2015-helps"),
        Verdict::DoesNotHold
    );
    assert_eq!(
        verdict(&sharp, "correction-of-2017-is-right"),
        Verdict::Holds
    );
    let wide = mesh_fit(0.112, 0.05);
    assert_eq!(
        verdict(&wide, "correction-of-2017-is-right"),
        Verdict::CannotSay
    );
    // Near enough to π/8 = 0.393, and to nothing else.
    let large = mesh_fit(0.38, 0.01);
    assert_eq!(
        verdict(&large, "correction-of-2015-is-right"),
        Verdict::Holds
    );
    assert_eq!(
        verdict(&large, "correction-of-2017-is-right"),
        Verdict::DoesNotHold
    );
}

#[test]
fn closed_forms_decide_what_needs_no_study() {
    let claims = closed_forms::claims();
    for name in [
        "tabulated-density-of-summits",
        "asymptote-of-alpha",
        "alpha-is-linear-at-one-half",
        "persson-slope-is-concave",
        "alpha-in-bgt",
        "greenwood-2006-far-from-its-asymptote",
    ] {
        assert_eq!(verdict(&claims, name), Verdict::DoesNotHold, "{name}");
    }
}

#[test]
fn counted_summits_are_two_pi_squared_times_the_tabulated_density() {
    let claims = closed_forms::claims();
    let Outcome::Judged(judgement) = &claims[0].outcome else {
        panic!("not judged");
    };
    let (found, exact) = (&judgement.deciding, (2.0 * std::f64::consts::PI).powi(2));
    // Sixteen nodes to the shortest wave miss few summits; the interval of twenty surfaces.
    assert!(
        found.lower < exact && exact < found.upper * 1.03,
        "{found:?}"
    );
}

#[test]
fn intervals_cover_all_quantities_together_at_the_stated_rate() {
    let labels: Vec<String> = (0..8).map(|index| format!("quantity {index}")).collect();
    let experiments = 200;
    let covered = (0..experiments).filter(|&experiment| {
        let samples: Vec<Vec<f64>> = (0..8).map(|i| normal(1000 * experiment + i, 40)).collect();
        let bounds = simultaneous(&labels, &[40], |weights| {
            Some(samples.iter().map(|sample| weights.mean(sample)).collect())
        });
        let bounds = bounds.expect("surfaces enough");
        bounds
            .iter()
            .all(|bound| bound.lower <= 0.0 && 0.0 <= bound.upper)
    });
    // 40 surfaces shorten errors by 1.3 %, and Student's tails of eight quantities cost some 3 %:
    // 0.91, give or take 0.02 over 200 experiments.
    let rate = covered.count() as f64 / f64::from(experiments as u32);
    assert!((0.85..0.97).contains(&rate), "covered {rate}");
}

#[test]
fn single_intervals_are_widened_to_cover_together() {
    let bound = || Bound {
        label: String::new(),
        value: 1.0,
        lower: 0.804,
        upper: 1.196,
    };
    let one = widened(vec![(bound(), 0.95)]);
    assert!((one[0].lower - 0.804).abs() < 1e-12);
    // z of 0.975 is 1.960, of 1 − 0.05/20 it is 2.807.
    let ten = widened(vec![(bound(), 0.95); 10]);
    assert!((ten[0].upper - 1.0 - 0.196 * 2.807 / 1.960).abs() < 1e-4);
}
