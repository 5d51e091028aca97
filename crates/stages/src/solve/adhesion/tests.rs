//! Tests of paths: they continue from their stored beginnings and do not depend on threads.

use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use bytesize::ByteSize;

use super::*;
use crate::grids;
use crate::solve;
use crate::solve::tests::{KeptRows, params as elastic_params, solved_on, surface};
use crate::surface_files::SurfaceFiles;
use arrow::array::{Array, AsArray};
use arrow::datatypes::Float64Type;
use asperity_mechanics::threads::Threads;
use asperity_tables::column::integers;

/// Returns the parameters of an approach and a separation under prescribed loads, with pull-off.
pub(super) fn params() -> Params {
    Params {
        version: VERSION.number(),
        effective_modulus: 3.0,
        load_unit: PressureUnit::Relative,
        newtons: None,
        pressure_unit: None,
        work: 0.03,
        range: 0.05,
        control: Control::Load,
        targets: vec![0.0, 0.02, 0.01, -1.0],
        tolerance: 1e-8,
        max_pairs: 2000,
        keeps_maps: false,
        pressure_bins: None,
        gap_bins: None,
        boundary: Boundary::Periodic,
        shift: None,
        loads_lack_unit: false,
    }
}

pub(super) fn at_gaps(targets: &[f64]) -> Params {
    Params { control: Control::Gap, targets: targets.to_vec(), ..params() }
}

/// Solves a path on a surface with an rms slope of 0.7.
fn solved(
    params: &Params,
    threads: &Threads,
    stored: Option<&Table>,
    interrupted: &(dyn Fn() -> bool + Sync),
    kept: &KeptRows,
) -> Result<Table, StageError> {
    let surface = surface();
    let grid = surface.grid();
    let mut row = grids::coordinates(grid.nodes(), grid.cell().size());
    row.push((RMS_SLOPE, Value::Real(0.7)));
    let context = Context {
        sources: &SurfaceFiles::new(Path::new("")),
        memory: ByteSize::gib(1),
        threads,
        interrupted,
        finished: kept,
        stored,
        reserve: &|_| true,
        advance: &|_| (),
    };
    path::solve(params, surface, &Table::row(&row), &context)
}

pub(super) fn whole(params: &Params) -> Table {
    solved(params, &Threads::one(), None, &|| false, &KeptRows::never_due()).unwrap()
}

fn from(params: &Params, stored: &Table) -> Table {
    solved(params, &Threads::one(), Some(stored), &|| false, &KeptRows::never_due()).unwrap()
}

fn values(table: &Table, column: Column) -> Vec<Option<f64>> {
    table.reals(column.name).unwrap().iter().collect()
}

#[test]
fn a_longer_path_continues_from_every_stored_beginning_with_the_same_bytes() {
    let periodic = at_gaps(&[0.3, 0.2, 0.1, 0.2]);
    let free = Params { boundary: Boundary::Free, ..at_gaps(&[0.3, 0.2]) };
    for params in [params(), periodic, free] {
        let all = whole(&params);
        let beginnings = (1..).map_while(|states| params.beginning(states));
        for (states, beginning) in (1..).zip(beginnings) {
            assert!(states < params.targets.len());
            let Recipe::Adhesion(shorter) = &beginning else { panic!("{beginning:?}") };
            assert_eq!(from(&params, &whole(shorter)), all, "{shorter:?}");
        }
    }
}

#[test]
fn stored_rows_are_taken_over_and_not_computed_again() {
    let longer = at_gaps(&[0.3, 0.2, 0.1]);
    let stored = whole(&at_gaps(&[0.3, 0.2]));
    let marked = stored.replacing(PAIRS.name, integers([-1, -2]));
    let pairs = from(&longer, &marked);
    let pairs: Vec<_> = pairs.integers(PAIRS.name).unwrap().iter().flatten().collect();
    assert_eq!(pairs[..2], [-1, -2]);
    assert!(pairs[2] > 0);
}

#[test]
fn an_interrupted_path_keeps_its_finished_states() {
    let params = at_gaps(&[0.3, 0.2, 0.1]);
    let all = whole(&params);
    let calls = AtomicUsize::new(0);
    let most = AtomicUsize::new(usize::MAX);
    let counting = || calls.fetch_add(1, Ordering::Relaxed) >= most.load(Ordering::Relaxed);
    let run = |kept: &KeptRows| solved(&params, &Threads::one(), None, &counting, kept);
    run(&KeptRows::never_due()).unwrap();
    // The interruption comes during one of the last iterations, in the last state.
    most.store(calls.swap(0, Ordering::Relaxed) - 1, Ordering::Relaxed);
    let kept = KeptRows::never_due();
    assert!(matches!(run(&kept), Err(StageError::Interrupted)));
    let kept = kept.rows();
    let [(targets, rows)] = &kept[..] else { panic!("{} tables", kept.len()) };
    assert_eq!(targets[..], params.targets[..2]);
    assert_eq!(from(&params, rows), all);
}

#[test]
fn rows_are_the_same_on_any_number_of_threads() {
    let alone = whole(&params());
    for count in [2, 3] {
        let threads = Threads::new(NonZeroUsize::new(count).unwrap());
        let kept = KeptRows::never_due();
        assert_eq!(solved(&params(), &threads, None, &|| false, &kept).unwrap(), alone);
    }
}

#[test]
fn a_tension_above_the_attraction_pulls_off_and_gives_the_pull_off_load() {
    let table = whole(&params());
    let stops: Vec<_> = table.texts(STOP.name).unwrap().iter().flatten().collect();
    assert_eq!(stops, ["converged", "converged", "converged", "pulled-off"]);
    let loads = values(&table, PULL_OFF_LOAD);
    assert_eq!(loads[..3], [None; 3]);
    // The largest attraction is w/ρ, in units of E* × rms slope.
    let strongest = 0.03 / 0.05 / (3.0 * 0.7);
    let load = loads[3].unwrap();
    assert!(-strongest < load && load < 0.0, "{load}");
    assert_eq!(values(&table, MEAN_GAP)[3], None);
    let branches: Vec<_> = table.texts(BRANCH.name).unwrap().iter().flatten().collect();
    assert_eq!(branches, ["approach", "approach", "separation", "separation"]);
}

#[test]
fn a_search_for_pull_off_that_reaches_the_limit_of_pairs_has_no_state() {
    let pulled = Params { targets: vec![0.0, -1.0, 0.02], ..params() };
    let pairs = |table: &Table| table.integers(PAIRS.name).unwrap().values().to_vec();
    let max_pairs = u32::try_from(pairs(&whole(&pulled))[1] / 2).unwrap();
    let table = whole(&Params { max_pairs, ..pulled });
    let stops: Vec<_> = table.texts(STOP.name).unwrap().iter().flatten().collect();
    assert_eq!(stops, ["converged", "pair-limit", "converged"]);
    assert_eq!(values(&table, MEAN_GAP)[1], None);
    assert_eq!(values(&table, PULL_OFF_LOAD)[1], None);
    assert_eq!(table.integers(ADHESIVE_CONTACT_NODES.name).unwrap().value(1), 0);
    assert!(table.bytes(CONTACT.name).unwrap().value(1).iter().all(|byte| *byte == 0));
}

#[test]
fn results_do_not_depend_on_the_units() {
    // Lengths in another unit, which is four times as small, and pressures in one twice as small.
    let table = whole(&at_gaps(&[0.3, 0.1]));
    let pressures = values(&table, PRESSURE);
    let stiffer = Params { effective_modulus: 6.0, work: 0.06, ..at_gaps(&[0.3, 0.1]) };
    let scaled = values(&whole(&stiffer), PRESSURE);
    for (one, other) in pressures.iter().zip(scaled) {
        assert!((2.0 * one.unwrap() - other.unwrap()).abs() < 1e-12);
    }
}

#[test]
fn nothing_is_dissipated_along_a_path_that_returns_without_a_jump() {
    let gaps: Vec<f64> = (0..=8).chain((0..8).rev()).map(|i| 0.5 - 0.005 * f64::from(i)).collect();
    let table = whole(&at_gaps(&gaps));
    let lost = values(&table, DISSIPATED_ENERGY);
    let energy = values(&table, ADHESION_ENERGY)[0].unwrap();
    assert_eq!(lost[0], Some(0.0));
    assert!(lost[16].unwrap().abs() < 1e-6 * energy.abs(), "{:?} of {energy}", lost[16]);
}

fn counts(table: &Table, column: Column, row: usize) -> Vec<f64> {
    let lists = table.lists(column.name).unwrap();
    lists.value(row).as_primitive::<Float64Type>().values().to_vec()
}

#[test]
fn far_apart_the_pressures_are_the_attraction_at_the_undeformed_gaps() {
    // Far apart the surfaces are nearly rigid, so that the nodes have the gaps c - h.
    let rigid = Params { work: 1e-9, range: 0.2, ..at_gaps(&[2.0]) };
    let bins = EqualBins { count: 4, to: 1e-10 };
    let table = whole(&Params { pressure_bins: Some(bins), ..rigid.clone() });
    let heights = surface().into_heights();
    let mean = heights.iter().sum::<f64>() / heights.len() as f64;
    // The unit of pressure is E* × rms slope = 2.1.
    let pull = |height: &f64| {
        let gap = 2.0 - (height - mean);
        rigid.work / rigid.range * libm::exp(-gap / rigid.range) / 2.1
    };
    let pulls: Vec<f64> = heights.iter().map(pull).collect();
    let counted = counts(&table, PRESSURE_COUNTS, 0);
    let below = counted.len() - 5;
    let strongest = rigid.work / rigid.range / 2.1;
    assert!((below as f64 - 1.0) * bins.width() < strongest);
    assert!(below as f64 * bins.width() >= strongest);
    for (bin, count) in counted[..below].iter().rev().enumerate() {
        let [low, high] = [bin, bin + 1].map(|edge| edge as f64 * bins.width());
        let expected = pulls.iter().filter(|pull| (low..high).contains(*pull)).count();
        assert_eq!(*count, expected as f64, "bin {bin}");
    }
    assert_eq!(counted[below..], [0.0; 5], "no node is repulsive");
}

#[test]
fn counts_have_an_edge_at_zero_and_contain_every_node() {
    let bins = EqualBins { count: 40, to: 2.0 };
    let gap_bins = EqualBins { count: 30, to: 3.0 };
    let counting = Params { pressure_bins: Some(bins), gap_bins: Some(gap_bins), ..params() };
    let table = whole(&counting);
    let nodes = surface().heights().len() as f64;
    for row in 0..3 {
        let pressures = counts(&table, PRESSURE_COUNTS, row);
        assert_eq!(pressures.iter().sum::<f64>(), nodes);
        let below = pressures.len() - 41;
        let repulsive = table.integers(REPULSIVE_NODES.name).unwrap().value(row);
        assert_eq!(pressures[below..].iter().sum::<f64>(), repulsive as f64);
        let in_contact = table.integers(ADHESIVE_CONTACT_NODES.name).unwrap().value(row) as f64;
        assert_eq!(counts(&table, GAP_COUNTS, row).iter().sum::<f64>(), nodes - in_contact);
    }
    assert!(table.lists(PRESSURE_COUNTS.name).unwrap().is_null(3), "apart");
    let plain = whole(&params());
    let names = [PRESSURE_COUNTS.name, GAP_COUNTS.name];
    assert_eq!(table.without(&names), plain, "counting changes no other column");
}

#[test]
fn without_work_of_adhesion_the_states_are_those_without_adhesion() {
    for boundary in [Boundary::Periodic, Boundary::Free] {
        let tolerance = 1e-14;
        let elastic =
            solve::Params { loads: vec![0.05, 0.2], tolerance, boundary, ..elastic_params() };
        let elastic = solved_on(surface(), &elastic, &Threads::one(), None);
        let at_loads = Params {
            work: 0.0,
            targets: vec![-0.1, 0.0, 0.05, 0.2],
            tolerance,
            boundary,
            ..params()
        };
        let gaps = values(&elastic, MEAN_GAP).into_iter().flatten().collect();
        let at_gaps = Params { control: Control::Gap, targets: gaps, ..at_loads.clone() };
        let at_loads = whole(&at_loads);
        let stops: Vec<_> = at_loads.texts(STOP.name).unwrap().iter().flatten().collect();
        assert_eq!(stops, ["pulled-off", "pulled-off", "converged", "converged"]);
        for adhesive in [at_loads.slice(2..4), whole(&at_gaps)] {
            for (column, of_elastic) in [
                (PRESSURE, PRESSURE),
                (MEAN_GAP, MEAN_GAP),
                (PEAK_PRESSURE, PEAK_PRESSURE),
                (ELASTIC_ENERGY, ENERGY),
            ] {
                let pairs = values(&adhesive, column).into_iter().zip(values(&elastic, of_elastic));
                for (value, expected) in pairs {
                    let error = value.unwrap() / expected.unwrap() - 1.0;
                    assert!(error.abs() < 1e-12, "{boundary:?} {}: {error:e}", column.name);
                }
            }
            let nodes = [&adhesive, &elastic].map(|table| table.integers("contact_nodes").unwrap());
            assert_eq!(nodes[0], nodes[1]);
        }
    }
}

#[test]
fn a_path_with_few_pairs_of_transforms_has_finite_rows_that_say_so() {
    let targets = [vec![0.0, 0.05, -0.02, -0.5], vec![0.3, 0.1]];
    for (control, targets) in [Control::Load, Control::Gap].into_iter().zip(targets) {
        for boundary in [Boundary::Periodic, Boundary::Free] {
            let targets = targets.clone();
            let table = whole(&Params { control, targets, max_pairs: 1, boundary, ..params() });
            let stops: Vec<_> = table.texts(STOP.name).unwrap().iter().flatten().collect();
            assert!(stops.contains(&"pair-limit"), "{stops:?}");
        }
    }
}

#[test]
fn stickiness_is_proportional_to_the_work_and_independent_of_units() {
    let stickiness = |params: &Params| values(&whole(params), STICKINESS)[0].unwrap();
    let one = at_gaps(&[0.5]);
    let twice = stickiness(&Params { work: 2.0 * one.work, ..one.clone() });
    assert!((twice / stickiness(&one) - 2.0).abs() < 1e-12);
    // Criterion 10 of Pastewka & Robbins, in the form of the article, with d = 4h'/κ.
    let (slope, curvature) = (0.3, 20.0);
    let stretch = one.work / one.effective_modulus;
    let diameter = 4.0 * slope / curvature;
    let criterion = slope * one.range / (2.0 * stretch)
        * libm::pow(slope * diameter / (4.0 * one.range), 2.0 / 3.0);
    let found = one.stickiness(slope, curvature).unwrap();
    assert!((found * criterion - 1.0).abs() < 1e-12, "{found} {criterion}");
    assert_eq!(one.stickiness(0.0, 0.0), None);
}
