//! Tests of paths: they continue from their stored beginnings and do not depend on threads.

use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use bytesize::ByteSize;

use super::*;
use crate::grids;
use crate::solve::tests::{KeptRows, surface};
use crate::surface_files::SurfaceFiles;
use asperity_contact::threads::Threads;
use asperity_tables::column::integers;

/// Returns the parameters of an approach and a separation under prescribed loads, with pull-off.
fn params() -> Params {
    Params {
        version: VERSION,
        effective_modulus: 3.0,
        load_unit: PressureUnit::Relative,
        pressure_unit: None,
        work: 0.03,
        range: 0.05,
        control: Control::Load,
        targets: vec![0.0, 0.02, 0.01, -1.0],
        tolerance: 1e-8,
        max_pairs: 2000,
        keeps_maps: false,
        boundary: Boundary::Periodic,
        shift: None,
    }
}

fn at_gaps(targets: &[f64]) -> Params {
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

fn whole(params: &Params) -> Table {
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
        for beginning in params.beginnings() {
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
