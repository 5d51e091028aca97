//! Claims on the error that the mesh makes, and on the spectra themselves.

use super::evidence::{COUNTED, Ensemble, Evidence, OF_2015};
use super::quantities::{Quantities, cutoffs, needs, under};
use super::{Claim, Expectation};
use crate::stages::columns::{EDGE_NODES_4, EDGE_NODES_8, SWITCHES};

/// The claims, in the order of the paper.
pub fn claims(evidence: &Evidence) -> Vec<Claim> {
    vec![
        largest_error(evidence),
        error_halves(evidence, false),
        error_halves(evidence, true),
        edge_nodes(evidence, EDGE_NODES_4.name),
        edge_nodes(evidence, EDGE_NODES_8.name),
        modes(evidence),
    ]
}

/// Counted and corrected curves of the same spectrum, on the same loads.
fn with_error(evidence: &Evidence) -> Vec<[&Ensemble; 2]> {
    let corrected = evidence.under(OF_2015);
    let pairs = evidence.under(COUNTED).into_iter().filter_map(|counted| {
        let own = |other: &&&Ensemble| {
            other.spectrum == counted.spectrum
                && other.loads == counted.loads
                && other.surfaces() == counted.surfaces()
        };
        corrected.iter().find(own).map(|other| [counted, *other])
    });
    pairs.collect()
}

fn largest_error(evidence: &Evidence) -> Claim {
    let mut quantities = Quantities::default();
    let error = |[counted, corrected]: &[&Ensemble; 2]| 1.0 - corrected.mean(0) / counted.mean(0);
    let pairs = with_error(evidence);
    let largest = pairs.iter().max_by(|a, b| error(a).total_cmp(&error(b)));
    if let Some(&[counted, corrected]) = largest {
        let label = format!(
            "{}, {}",
            cutoffs(&counted.spectrum),
            under(counted.loads[0])
        );
        quantities.add(label, &[counted.surfaces()], move |weights| {
            Some(1.0 - weights.mean(&corrected.areas[0]) / weights.mean(&counted.areas[0]))
        });
    }
    quantities.claim(
        "largest-estimated-error",
        "The error estimated as (π/8) S_d Δx is as high as 45 % of the area, at the lightest load.",
        "counted area and its correction by π/8",
        Expectation::Within(0.4, 0.5),
        &needs(OF_2015, "loads from first touch on, and \"none\""),
    )
}

fn error_halves(evidence: &Evidence, as_printed: bool) -> Claim {
    let mut quantities = Quantities::default();
    for [counted, corrected] in with_error(evidence) {
        let third = (0..counted.loads.len()).min_by(|&one, &other| {
            let distance = |place: usize| (counted.mean(place) - 0.3).abs();
            distance(one).total_cmp(&distance(other))
        });
        let Some(third) = third.filter(|&place| (counted.mean(place) - 0.3).abs() < 0.05) else {
            continue;
        };
        let label = cutoffs(&counted.spectrum);
        quantities.add(label, &[counted.surfaces()], move |weights| {
            let error = |place: usize| {
                let area = weights.mean(&counted.areas[place]);
                let error = area - weights.mean(&corrected.areas[place]);
                if as_printed { error } else { error / area }
            };
            Some(error(third) / error(0))
        });
    }
    let (name, says) = if as_printed {
        (
            "estimated-error-halves-as-printed",
            "The error as printed, (π/8) S_d Δx over the nominal area, is halved at 30 % of contact \
             (ratio to that at the lightest load).",
        )
    } else {
        (
            "estimated-error-halves",
            "The estimated error, relative to the area of contact, is halved at 30 % of contact \
             (ratio to that at the lightest load).",
        )
    };
    quantities.claim(
        name,
        says,
        "counted area and its correction by π/8",
        Expectation::Within(0.4, 0.6),
        &needs(
            OF_2015,
            "loads from first touch to 30 % of contact, and \"none\"",
        ),
    )
}

fn edge_nodes(evidence: &Evidence, column: &'static str) -> Claim {
    let ratios = evidence.of_contacts(0.06, |table, row| {
        let edge = table.integers(column)?.value(row) as f64;
        Ok(edge / table.integers(SWITCHES.name)?.value(row) as f64)
    });
    let ratios = ratios.unwrap_or_default();
    let mut quantities = Quantities::default();
    for ensemble in &ratios {
        let label = cutoffs(&ensemble.spectrum);
        quantities.add(label, &[ensemble.values.len()], move |weights| {
            Some(weights.mean(&ensemble.values))
        });
    }
    let name = if column == EDGE_NODES_4.name {
        "edge-nodes-by-4-neighbours"
    } else {
        "edge-nodes-by-8-neighbours"
    };
    quantities.claim(
        name,
        "Contact nodes with a gap beside them number π/4 of the switches between contact and gap, \
         to two per cent.",
        "measured contacts near a load of 0.06",
        Expectation::Within(0.77, 0.80),
        "a `measure` stage over contacts",
    )
}

fn modes(evidence: &Evidence) -> Claim {
    let modes = evidence.of_surfaces("effective_modes");
    let modes = modes.unwrap_or_default();
    let mut quantities = Quantities::default();
    for narrow in &modes {
        let wider = modes.iter().filter(|wide| {
            let (one, other) = (&narrow.spectrum, &wide.spectrum);
            (one.hurst.to_bits(), one.nodes, one.k_lower, one.k_rolloff)
                == (
                    other.hurst.to_bits(),
                    other.nodes,
                    other.k_lower,
                    other.k_rolloff,
                )
                && other.k_upper >= 2 * one.k_upper
                && one.k_upper >= 8 * one.k_lower
        });
        if let Some(wide) = wider.min_by_key(|wide| wide.spectrum.k_upper) {
            let label = format!(
                "{}, k_upper {} over it",
                cutoffs(&narrow.spectrum),
                wide.spectrum.k_upper
            );
            let surfaces = [narrow.values.len(), wide.values.len()];
            quantities.add(label, &surfaces, move |weights| {
                Some(weights.mean(&wide.values) / weights.mean(&narrow.values))
            });
        }
    }
    quantities.claim(
        "modes-come-from-k-lower",
        "A greater k_upper does not make a surface more Gaussian: the effective number of modes \
         stays, to a tenth (ratio between neighbouring k_upper, from a decade of wavelengths on).",
        "surfaces",
        Expectation::Within(0.9, 1.1),
        "a `generate` stage of spectra with `k_upper` from 8 `k_lower` on, and twice that",
    )
}
