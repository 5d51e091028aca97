//! Tests of materials that yield, against independent code, in the limits of hard and soft
//! materials, and on random surfaces.

use std::f64::consts::{PI, TAU};

use proptest::prelude::*;

use super::{HARDNESS as REFERENCE, *};
use crate::grid::Boundary;
use crate::grid::samples::rectangle;
use crate::morphology::area::ContactArea;
use crate::morphology::clusters::Clusters;
use crate::morphology::map::ContactMap;
use crate::topography::moments::Moments;

fn yielding(nodes: usize, hardness: f64, heights: &[f64]) -> Solver {
    let body = Body { hardness: Some(Hardness::new(hardness).unwrap()), ..Body::default() };
    body.solver(&on(square(nodes, 1.0), heights))
}

fn saturated(solver: &Solver, hardness: f64) -> Vec<bool> {
    solver.pressure().iter().map(|p| *p == hardness).collect()
}

#[test]
fn saturated_and_elastic_contact_is_as_independent_code_has_it() {
    for name in ["h128_hard03", "h128_hard08"] {
        let surface = REFERENCE.heights(name, [1.0; 2]);
        let grid = surface.grid();
        let slope = Moments::from_surface(&surface).rms_slope();
        assert!((slope - 0.02).abs() < 1e-14);
        let reduced: Vec<f64> = surface.heights().iter().map(|h| h / slope).collect();
        let rows = REFERENCE.solved(name);
        let hardness = rows[0].number(3) / slope;
        let mut solver = yielding(128, hardness, &reduced);
        let maps = REFERENCE.maps(name, "maps", grid);
        for (row, maps) in rows.iter().zip(maps.chunks(2)) {
            let load = row.number(4);
            let settings = Settings { tolerance: 1e-8, ..Settings::default() };
            let outcome = press(&mut solver, load, &settings);
            assert_eq!(outcome.stop, Stop::Converged, "{name} at {load}");
            let touches: Vec<bool> = solver.pressure().iter().map(|p| *p > 0.0).collect();
            assert!(touches == maps[0], "{name} at {load}");
            assert!(saturated(&solver, hardness) == maps[1], "{name} at {load}");
            assert_eq!(outcome.contact_nodes, row.count(6));
            assert_eq!(outcome.saturated_nodes, row.count(7));
            assert_eq!(outcome.peak_pressure, hardness);
            let contact = ContactMap::from_pressures(grid.nodes(), solver.pressure());
            let area = ContactArea::from_map(&contact);
            assert_eq!(area.switches_along_columns, row.count(8));
            assert_eq!(area.switches_along_rows, row.count(9));
            assert_eq!(Clusters::of_contact(&contact).count, row.count(10));
            let cells = grid.count() as f64;
            let open = cells - row.number(6);
            let gap = row.number(11) * open / cells;
            assert!((outcome.mean_gap * slope / gap - 1.0).abs() < 1e-6);
            let depth = row.number(12) * row.number(7) / cells;
            assert!((outcome.yielded_depth * slope / depth - 1.0).abs() < 1e-6);
        }
    }
}

#[test]
fn loads_below_the_hardness_keep_every_bit() {
    let heights = rough(48, 7);
    let bits = |solver: &Solver| Vec::from_iter(solver.pressure().iter().map(|p| p.to_bits()));
    for boundary in [Boundary::Periodic, Boundary::Free] {
        let solver = |hardness| {
            let hardness = Some(Hardness::new(hardness).unwrap());
            Body { elastic: boundary.into(), hardness }.solver(&on(square(48, 1.0), &heights))
        };
        let elastic = || {
            let hardness = None;
            Body { elastic: boundary.into(), hardness }.solver(&on(square(48, 1.0), &heights))
        };
        let peak = |load| solved(&mut elastic(), load).peak_pressure;
        // The second surface yields under the last load.
        let between = 0.5 * (peak(0.1) + peak(0.4));
        let [mut elastic, mut hard, mut softer] = [elastic(), solver(1e9), solver(between)];
        for load in [0.01, 0.03, 0.1, 0.4] {
            let expected = press(&mut elastic, load, &Settings::default());
            let found = press(&mut hard, load, &Settings::default());
            assert_eq!(found, expected);
            assert_eq!(bits(&hard), bits(&elastic));
            let found = press(&mut softer, load, &Settings::default());
            assert_eq!(bits(&softer) == bits(&elastic), load < 0.2);
            assert_eq!(found.saturated_nodes > 0, load > 0.2);
        }
    }
}

#[test]
fn a_guess_that_exceeds_the_hardness_needlessly_changes_no_bit() {
    let heights = map(64, |x, y| {
        let is_face = (x - 0.5).hypot(y - 0.5) < 0.3;
        if is_face { 0.0 } else { -0.001 }
    });
    let bits = |solver: &Solver| Vec::from_iter(solver.pressure().iter().map(|p| p.to_bits()));
    let mut in_vain = 0;
    for load in [3e-4, 1e-3, 2e-3] {
        let mut elastic = super::solver(64, &heights);
        let expected = press(&mut elastic, load, &Settings::default());
        let mut hard = yielding(64, 1.001 * expected.peak_pressure, &heights);
        let found = press(&mut hard, load, &Settings::default());
        assert_eq!(bits(&hard), bits(&elastic));
        assert_eq!(found.saturated_nodes, 0);
        in_vain += usize::from(found.pairs > expected.pairs);
    }
    assert!(in_vain > 0);
}

#[test]
fn a_hardness_that_single_precision_rounds_costs_no_more_than_one_that_it_holds() {
    let heights = rough(128, 4);
    let pairs = |hardness: f64| -> u32 {
        let mut solver = yielding(128, hardness, &heights);
        let loads = (1..=10).map(|step| 0.02 * f64::from(step));
        let outcomes = loads.map(|load| press(&mut solver, load, &Settings::default()));
        outcomes.map(|outcome| outcome.pairs).sum()
    };
    let [rounded, held] = [pairs(0.3), pairs(f64::from(0.3_f32))];
    assert!(20 * rounded <= 21 * held, "{rounded} and {held}");
}

#[test]
fn the_softest_material_yields_under_its_highest_nodes_until_they_bear_the_load() {
    // Nothing bends: u is 1e-9 of the heights.
    let (nodes, hardness) = (64, 1e-9);
    let heights = noise(nodes, 8);
    let mut sorted = heights.clone();
    sorted.sort_by(|a, b| b.total_cmp(a));
    let mut solver = yielding(nodes, hardness, &heights);
    for saturated in [1, 10, 300, 2000, 4000] {
        let load = (saturated as f64 + 0.4) / (nodes * nodes) as f64 * hardness;
        let outcome = solved(&mut solver, load);
        assert_eq!(outcome.saturated_nodes, saturated);
        assert_eq!(outcome.contact_nodes, saturated + 1);
        let lowest_in_contact = sorted[saturated];
        for (p, height) in solver.pressure().iter().zip(&heights) {
            assert_eq!(*p > 0.0, *height >= lowest_in_contact);
        }
        let depths = sorted[..saturated].iter().map(|h| h - lowest_in_contact);
        let depth = depths.sum::<f64>() / (nodes * nodes) as f64;
        assert!((outcome.yielded_depth - depth).abs() < 1e-7 * sorted[0]);
    }
}

#[test]
fn a_ball_yields_first_where_hertz_has_the_peak() {
    let (nodes, radius, a) = (128, 4.0, 0.2_f64);
    let heights = map(nodes, |x, y| {
        let step = 0.5 / nodes as f64;
        -((x + step - 0.5).powi(2) + (y + step - 0.5).powi(2)) / (2.0 * radius)
    });
    let load = 4.0 / 3.0 * a.powi(3) / radius;
    let hertz = 2.0 * a / (PI * radius);
    let half_space = |hardness| Body {
        elastic: Boundary::Free.into(),
        hardness: Some(Hardness::new(hardness).unwrap()),
    };
    let pressed = |hardness| {
        let mut solver = half_space(hardness).solver(&on(square(nodes, 1.0), &heights));
        (solved(&mut solver, load), solver)
    };
    // 0.5 per cent allow for the error of the mesh at the peak.
    assert_eq!(pressed(1.005 * hertz).0.saturated_nodes, 0);
    let (outcome, solver) = pressed(0.95 * hertz);
    // Hertz' pressure is above 0.95 of its peak for r² < (1 − 0.95²) a²; the load that this disc
    // does not bear widens the disc.
    let disc = PI * (1.0 - 0.95_f64.powi(2)) * a * a * (nodes * nodes) as f64;
    let ratio = outcome.saturated_nodes as f64 / disc;
    assert!((1.0..2.0).contains(&ratio), "{ratio}");
    assert_complementary(&solver, &heights, load, 2e-12);
}

#[test]
fn saturation_is_complementary_on_rectangles_and_with_free_boundaries() {
    for (nodes, size) in [([64, 32], [1.0, 1.0]), ([9, 50], [0.2, 1.0]), ([1, 64], [0.1, 3.0])] {
        let grid = rectangle(nodes, size);
        let heights: Vec<f64> = noise(64, 7)[..grid.count()].to_vec();
        for boundary in [Boundary::Periodic, Boundary::Free] {
            for hardness in [0.003, 0.1, 0.7] {
                let body = Body {
                    elastic: boundary.into(),
                    hardness: Some(Hardness::new(hardness).unwrap()),
                };
                let mut solver = body.solver(&on(grid, &heights));
                for part in [1e-6, 0.01, 0.3, 0.9, 1.0 - 1e-5] {
                    let load = part * hardness;
                    solved(&mut solver, load);
                    assert_complementary(&solver, &heights, load, 2e-12);
                }
            }
        }
    }
}

#[test]
fn a_search_that_sees_a_sample_of_rows_finds_what_one_that_sees_all_does() {
    // Every fourth pair of rows is sampled.
    let nodes = 256;
    let heights = rough(nodes, 9);
    let hardness = 0.2 * solved(&mut super::solver(nodes, &heights), 1e-3).peak_pressure;
    let mut solver = yielding(nodes, hardness, &heights);
    for load in [1e-5, 0.05, 0.3, 0.8, 0.9999].map(|part| part * hardness) {
        let outcome = press(&mut solver, load, &Settings::default());
        assert_eq!(outcome.stop, Stop::Converged, "{load}: {outcome:?}");
        assert!(outcome.pairs < 250, "{load}: {outcome:?}");
        let tolerance = Settings::default().tolerance;
        // Releasing nodes and restoring the mean change gaps by a part of the residual.
        assert_complementary(&solver, &heights, load, 1.5 * tolerance);
    }
}

#[test]
fn full_contact_has_a_formula_only_as_long_as_nothing_yields() {
    let (nodes, amplitude) = (64, 0.05);
    let heights = map(nodes, |x, _| amplitude * (TAU * x).cos());
    let full = PI * amplitude;
    // Full contact under p* has the peak 2p*.
    let mut soft = yielding(nodes, 1.9 * full, &heights);
    assert_eq!(soft.full_contact_load(), None);
    let outcome = solved(&mut soft, 1.2 * full);
    assert!(outcome.saturated_nodes > 0);
    assert_complementary(&soft, &heights, 1.2 * full, 2e-12);

    let mut hard = yielding(nodes, 2.5 * full, &heights);
    assert!((hard.full_contact_load().unwrap() / full - 1.0).abs() < 1e-12);
    let outcome = press(&mut hard, 1.4 * full, &TIGHT);
    assert_eq!((outcome.stop, outcome.saturated_nodes), (Stop::FullContact, 0));
    // Beyond 1.5 p* the crests yield, but the contact is still full.
    let outcome = solved(&mut hard, 1.8 * full);
    assert_eq!(outcome.contact_nodes, nodes * nodes);
    assert!(outcome.saturated_nodes > 0 && outcome.yielded_depth > 0.0);
    assert_complementary(&hard, &heights, 1.8 * full, 2e-12);
}

#[test]
fn two_elastic_nodes_far_from_where_gaps_were_counted_from_are_found_to_their_last_digit() {
    // 42 nodes yield together. The property test below found this example.
    let (nodes, hardness) = (7, 10_f64.powf(-3.7070496578738408));
    let heights = noise(nodes, 18270964029254293781);
    let mut solver = yielding(nodes, hardness, &heights);
    let load = 0.8772725409657233 * hardness;
    let outcome = solved(&mut solver, load);
    assert_eq!((outcome.contact_nodes, outcome.saturated_nodes), (44, 42));
    assert!(outcome.pairs < 40, "{outcome:?}");
    assert_complementary(&solver, &heights, load, 2e-12);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn a_node_is_open_elastic_or_saturated(
        nodes in 2_usize..=40, seed: u64, white: bool, free: bool,
        hardness in -6.0..0.5_f64, part in 1e-4..0.9999_f64,
    ) {
        let heights = if white { noise(nodes, seed) } else { rough(nodes, seed) };
        let hardness = 10_f64.powf(hardness);
        let body = Body {
            elastic: if free { Boundary::Free } else { Boundary::Periodic }.into(),
            hardness: Some(Hardness::new(hardness).unwrap()),
        };
        let mut solver = body.solver(&on(square(nodes, 1.0), &heights));
        let load = part * hardness;
        let outcome = press(&mut solver, load, &Settings { tolerance: 1e-10, pair_limit: 4000 });
        prop_assert!(
            [Stop::Converged, Stop::FullContact].contains(&outcome.stop), "{:?}", outcome
        );
        prop_assert!(outcome.saturated_nodes as f64 * hardness <= load * (nodes * nodes) as f64 * (1.0 + 1e-12));
        prop_assert!(outcome.contact_nodes as f64 >= part * (nodes * nodes) as f64 * (1.0 - 1e-12));
        let count = saturated(&solver, hardness).into_iter().filter(|is| *is).count();
        prop_assert_eq!(count, outcome.saturated_nodes);
        assert_complementary(&solver, &heights, load, 1.1e-10);
    }

    // The contact area is not compared: two nodes that yield may lower a third one out of contact.
    #[test]
    fn yielded_depth_is_the_slope_of_the_energy_on_the_hardness_and_grows_as_materials_soften(
        nodes in 8_usize..=32, seed: u64, part in 0.01..0.9_f64,
    ) {
        let heights = rough(nodes, seed);
        let load = 0.05 * super::solver(nodes, &heights).full_contact_load().unwrap();
        let mut harder: Option<(f64, Outcome, f64)> = None;
        for hardness in [1e3, 3.0, 1.0, 0.5, 0.2].map(|times| load / part * times) {
            if hardness <= load {
                continue;
            }
            let mut solver = yielding(nodes, hardness, &heights);
            let outcome = solved(&mut solver, load);
            let works = solver.pressure().iter().zip(&heights).map(|(p, height)| p * height);
            let energy = outcome.energy - works.sum::<f64>() / (nodes * nodes) as f64;
            if let Some((hard, before, lower)) = harder {
                prop_assert!(outcome.yielded_depth >= before.yielded_depth - 1e-12);
                // The least energy under a load is a convex function of the bound.
                let (change, rounding) = (hard - hardness, 1e-12 * lower.abs());
                prop_assert!(energy - lower >= before.yielded_depth * change - rounding);
                prop_assert!(energy - lower <= outcome.yielded_depth * change + rounding);
            }
            harder = Some((hardness, outcome, energy));
        }
    }
}
