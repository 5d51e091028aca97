//! Tests against closed forms and against contacts solved by independent code: on squares, on
//! rectangles with square and other cells, and with free boundaries.

use std::f64::consts::{PI, TAU};

use super::{RECTANGULAR_AND_FREE as REFERENCE, *};
use crate::elasticity::FreeHalfSpace;
use crate::grid::samples::rectangle;
use crate::morphology::area::ContactArea;
use crate::morphology::clusters::Clusters;
use crate::morphology::map::ContactMap;
use crate::topography::moments::Moments;

/// Returns heights of unit rms slope: a sum of cosines of wavenumbers 2 to 8, with phases from
/// irrational numbers.
fn golden(nodes: usize) -> Vec<f64> {
    let mut heights = vec![0.0; nodes * nodes];
    let mut square_slope = 0.0;
    let modes = (-8..=8).flat_map(|k_x| (0..=8).map(move |k_y| (k_x, k_y)));
    for (k_x, k_y) in modes.filter(|(k_x, k_y)| *k_y > 0 || *k_x > 0) {
        let square = f64::from(k_x * k_x + k_y * k_y);
        if !(4.0..=64.0).contains(&square) {
            continue;
        }
        let (k_x, k_y) = (f64::from(k_x), f64::from(k_y));
        let turns = 0.6180339887498949 * k_x * k_x
            + 0.4142135623730951 * k_y
            + 0.7320508075688772 * k_x * k_y;
        let phase = TAU * (turns - turns.floor());
        let amplitude = square.powf(-0.9);
        let wave = map(nodes, |x, y| amplitude * (TAU * (k_x * x + k_y * y) + phase).cos());
        heights.iter_mut().zip(wave).for_each(|(height, wave)| *height += wave);
        square_slope += 0.5 * amplitude * amplitude * TAU * TAU * square;
    }
    heights.iter().map(|height| height / square_slope.sqrt()).collect()
}

#[test]
fn golden_surface_is_the_one_described() {
    let heights = golden(64);
    assert!((heights[0] - -0.009119742340787058).abs() < 1e-15);
    for (nodes, load) in [(64, 1.3257859146181756), (128, 1.3326186670460385)] {
        let solver = super::solver(nodes, &golden(nodes));
        assert!((solver.full_contact_load().unwrap() - load).abs() < 1e-13);
    }
}

#[test]
fn golden_surface_touches_as_independent_code_has_it() {
    // Load, contact nodes, peak pressure, energy and mean gap by a Polonsky–Keer code in NumPy.
    const SOLVED: [(f64, usize, f64, f64, f64); 6] = [
        (0.005, 51, 9.275987339141e-01, 7.555533864426e-05, 1.062850730015e-01),
        (0.02, 176, 1.221057218635, 4.558053163728e-04, 7.226002921518e-02),
        (0.06, 514, 1.448837739833, 1.471685269181e-03, 4.418856282747e-02),
        (0.2, 1566, 1.742314905217, 4.582004565347e-03, 1.708722265938e-02),
        (0.5, 3060, 2.109921636697, 8.886780653971e-03, 3.094235421066e-03),
        (1.0, 4000, 2.621722028565, 1.084556926678e-02, 6.340986960082e-05),
    ];
    let mut solver = super::solver(64, &golden(64));
    for (load, nodes, peak, energy, gap) in SOLVED {
        let outcome = solved(&mut solver, load);
        assert_eq!(outcome.contact_nodes, nodes);
        assert!((outcome.peak_pressure / peak - 1.0).abs() < 1e-9);
        assert!((outcome.energy / energy - 1.0).abs() < 1e-9);
        assert!((outcome.mean_gap - gap).abs() < 1e-11);
    }
}

#[test]
fn full_contact_adds_the_load_to_the_pressure_that_flattens() {
    let (nodes, heights) = (64, golden(64));
    let mut solver = super::solver(nodes, &heights);
    let load = 1.5;
    let outcome = press(&mut solver, load, &TIGHT);
    assert_eq!((outcome.stop, outcome.contact_nodes), (Stop::FullContact, nodes * nodes));
    assert_eq!(outcome.mean_gap, 0.0);
    assert!(outcome.residual < 1e-12);
    // Parseval: the variance is a quarter of the mean square slope.
    let variance = mean(&solver.pressure().iter().map(|p| (p - load).powi(2)).collect::<Vec<_>>());
    assert!((variance - 0.25).abs() < 1e-13);
    // The energy, a quarter of Σ |q| |ĥ|², is half the work on the heights.
    let work = solver.pressure().iter().zip(&heights).map(|(p, h)| (p - load) * h).sum::<f64>();
    assert!((outcome.energy / (0.5 * work / (nodes * nodes) as f64) - 1.0).abs() < 1e-12);
}

#[test]
fn energy_of_a_flattened_wave_is_a_quarter_of_wavenumber_times_squared_amplitude_spectrum() {
    // ĥ(±k) = Δ/2 each, so U = ¼ · 2 · |q| Δ²/4 = |q| Δ²/8.
    let (amplitude, wavenumber) = (0.01, TAU * 5.0);
    let heights = map(32, |x, y| amplitude * (TAU * (3.0 * x + 4.0 * y)).cos());
    let mut solver = super::solver(32, &heights);
    let outcome = press(&mut solver, 2.0, &TIGHT);
    let energy = wavenumber * amplitude * amplitude / 8.0;
    assert!((outcome.energy / energy - 1.0).abs() < 1e-12);
}

#[test]
fn a_wave_touches_along_strips_of_the_width_of_westergaard() {
    let (nodes, amplitude) = (256, 0.05);
    let heights = map(nodes, |x, _| amplitude * (TAU * x).cos());
    let mut solver = super::solver(nodes, &heights);
    let full = PI * amplitude;
    assert!((solver.full_contact_load().unwrap() / full - 1.0).abs() < 1e-12);
    for part in [0.05, 0.3, 0.6, 0.9] {
        let outcome = solved(&mut solver, part * full);
        let half_width = f64::sqrt(part).asin() / PI;
        let area = outcome.contact_nodes as f64 / (nodes * nodes) as f64;
        // Each edge may be off by one node.
        assert!((area - 2.0 * half_width).abs() < 2.0 / nodes as f64);

        let pressure = |x: f64| {
            let inside = part - (PI * x).sin().powi(2);
            2.0 * full * (PI * x).cos() * inside.max(0.0).sqrt()
        };
        let error: Vec<f64> = (0..nodes)
            .map(|i| (i as f64 / nodes as f64).min(1.0 - i as f64 / nodes as f64))
            .enumerate()
            .map(|(i, x)| (solver.pressure()[i * nodes] - pressure(x)).abs())
            .collect();
        // The error is of order 3/2 in the mesh, from the last nodes inside the edge.
        assert!(mean(&error) < 5e-4 * full, "{part}: {}", mean(&error) / full);
    }
}

#[test]
fn crossed_waves_touch_in_discs_at_first_and_part_in_discs_at_last() {
    let (nodes, amplitude) = (256, 0.05);
    let heights = map(nodes, |x, y| amplitude * (TAU * x).cos() * (TAU * y).cos());
    let mut solver = super::solver(nodes, &heights);
    let full = 2_f64.sqrt() * PI * amplitude;
    assert!((solver.full_contact_load().unwrap() / full - 1.0).abs() < 1e-12);
    let mut area = |part: f64| {
        let nodes_in_contact = solved(&mut solver, part * full).contact_nodes;
        nodes_in_contact as f64 / (nodes * nodes) as f64
    };
    // Discs of 15 nodes across; the mesh enlarges their area by a few per cent.
    let light = PI * (3.0 * 0.005 / (8.0 * PI)).powf(2.0 / 3.0);
    assert!((area(0.005) / light - 1.0).abs() < 0.12);
    // Gaps of 12 nodes across, whose area the mesh reduces by as much; the expansion itself is of
    // first order.
    let gap = 1.5 / PI * 0.01;
    assert!(((1.0 - area(0.99)) / gap - 1.0).abs() < 0.2);
}

#[test]
fn a_sphere_touches_as_hertz_has_it() {
    let (nodes, radius) = (128, 1.0_f64);
    let heights = map(nodes, |x, y| {
        let (x, y) = (x - 0.5, y - 0.5);
        -(x * x + y * y) / (2.0 * radius)
    });
    let mut solver = super::solver(nodes, &heights);
    let contact_radius = 10.0 / nodes as f64;
    let load = 4.0 / 3.0 * contact_radius.powi(3) / radius;
    let outcome = solved(&mut solver, load);
    // The error is of first order in the ratio of the mesh step to the radius of ten nodes;
    // periodic images contribute 1e-3.
    let peak = 2.0 * contact_radius / (PI * radius);
    assert!((outcome.peak_pressure / peak - 1.0).abs() < 0.01);
    let area = outcome.contact_nodes as f64 / (nodes * nodes) as f64;
    assert!((area / (PI * contact_radius * contact_radius) - 1.0).abs() < 0.06);
}

#[test]
fn a_flat_punch_presses_hardest_at_its_rim() {
    let (nodes, radius) = (128, 24.5 / 256.0);
    let distance = |x: f64, y: f64| (x - 0.5).hypot(y - 0.5);
    let heights = map(nodes, |x, y| if distance(x, y) < radius { 1.0 } else { 0.0 });
    let mut solver = super::solver(nodes, &heights);
    let load = 1e-3;
    let outcome = solved(&mut solver, load);
    let inside = heights.iter().filter(|height| **height > 0.0).count();
    assert_eq!(outcome.contact_nodes, inside);
    let mean_pressure = load / (PI * radius * radius);
    for node in [0, 3, 6] {
        let r = node as f64 / nodes as f64 / radius;
        let pressure = solver.pressure()[(nodes / 2 + node) * nodes + nodes / 2];
        let punch = mean_pressure / 2.0 / (1.0 - r * r).sqrt();
        // The error of the radius is half a node in twelve, and the pressure depends on its square.
        assert!((pressure / punch - 1.0).abs() < 0.08, "{r}: {pressure} against {punch}");
    }
}

fn free(nodes: usize, heights: &[f64]) -> Solver {
    Solver::new(FreeHalfSpace::new(square(nodes, 1.0)), &on(square(nodes, 1.0), heights))
}

#[test]
fn a_free_surface_touches_as_independent_code_has_it() {
    let surface = REFERENCE.heights("f128x192", [0.8, 1.2]);
    let grid = surface.grid();
    let slope = Moments::from_surface(&surface).rms_slope();
    let unit = slope * grid.cell().longer_side();
    let mut solver = Solver::new(FreeHalfSpace::new(grid), &on(grid, &reduced(&surface)));
    assert_eq!(solver.full_contact_load(), None);
    let solved_by_others = REFERENCE.solved("f128x192");
    let maps = REFERENCE.maps("f128x192", "contact", grid);
    for (row, map) in solved_by_others.iter().zip(maps) {
        let load = row.number(7);
        let outcome = solved(&mut solver, load);
        let touches: Vec<bool> = solver.pressure().iter().map(|p| *p > 0.0).collect();
        assert!(touches == map[..grid.count()], "at {load}");
        assert_eq!(outcome.contact_nodes, row.count(9));
        let close = |found: f64, exact: f64| (found / exact - 1.0).abs() < 1e-8;
        assert!(close(outcome.mean_gap * unit, row.number(14)), "{outcome:?}");
        assert!(close(outcome.energy * slope * unit, row.number(15)));
        assert!(close(outcome.peak_pressure * slope, row.number(16)));
    }
}

#[test]
fn a_ball_sinks_as_hertz_has_it() {
    // F = 4/3 E* √R δ^(3/2), with radii and forces in units of the side and E*; a is 0.2.
    let (nodes, radius, a) = (256, 4.0, 0.2_f64);
    let heights = map(nodes, |x, y| -((x - 0.5).powi(2) + (y - 0.5).powi(2)) / (2.0 * radius));
    let force = 4.0 / 3.0 * a.powi(3) / radius;
    let mut solver = free(nodes, &heights);
    let outcome = solved(&mut solver, force);
    let area = outcome.contact_nodes as f64 / (nodes * nodes) as f64;
    assert!((area / (PI * a * a) - 1.0).abs() < 0.01, "{area}");
    let peak = 2.0 * a / (PI * radius);
    assert!((outcome.peak_pressure / peak - 1.0).abs() < 2e-3);
    // ½⟨p u⟩ = 2/5 F δ, δ = a²/R.
    let energy = 0.4 * force * a * a / radius;
    assert!((outcome.energy / energy - 1.0).abs() < 2e-3);
}

#[test]
fn a_ball_in_the_middle_of_a_large_periodic_cell_is_nearly_alone() {
    let (nodes, radius) = (256, 4.0);
    let heights = map(nodes, |x, y| -((x - 0.5).powi(2) + (y - 0.5).powi(2)) / (2.0 * radius));
    let force = 4.0 / 3.0 * 0.02_f64.powi(3) / radius;
    let alone = solved(&mut free(nodes, &heights), force);
    let repeated = solved(&mut solver(nodes, &heights), force);
    assert_eq!(alone.contact_nodes, repeated.contact_nodes);
    assert!((alone.peak_pressure / repeated.peak_pressure - 1.0).abs() < 1e-3);
}

#[test]
fn nothing_leaks_over_an_edge() {
    // A bump at one edge, in contact up to the edge, must not affect the opposite edge.
    let (nodes, radius) = (64, 0.5);
    let heights = map(nodes, |x, y| -(x * x + (y - 0.5).powi(2)) / (2.0 * radius));
    let mut at_edge = free(nodes, &heights);
    solved(&mut at_edge, 1e-3);
    let touches = |i: usize, j: usize| at_edge.pressure()[i * nodes + j] > 0.0;
    assert!(touches(0, nodes / 2) && !touches(nodes - 1, nodes / 2));
    // On a map of twice the length, the additional part is not touched, and nothing else changes.
    let twice = rectangle([2 * nodes, nodes], [2.0, 1.0]);
    let longer: Vec<f64> = (0..twice.count())
        .map(|node| {
            let [i, j] = twice.indices(node);
            let [x, y] = [i, j].map(|index| index as f64 / nodes as f64);
            -(x * x + (y - 0.5).powi(2)) / (2.0 * radius) / 2.0
        })
        .collect();
    let mut on_longer = Solver::new(FreeHalfSpace::new(twice), &on(twice, &longer));
    solved(&mut on_longer, 0.5e-3);
    for (node, pressure) in at_edge.pressure().iter().enumerate() {
        let found = on_longer.pressure()[node];
        assert!((pressure - found).abs() < 1e-8, "node {node}");
    }
}

#[test]
fn heavy_loads_bring_all_nodes_into_contact() {
    let heights = map(32, |x, y| 1e-3 * (6.0 * x).sin() * (5.0 * y).cos());
    let mut solver = free(32, &heights);
    let outcome = solved(&mut solver, 1.0);
    assert_eq!(outcome.contact_nodes, 32 * 32);
    assert!(outcome.mean_gap.abs() < 1e-12, "{outcome:?}");
    // A uniform displacement requires more pressure at the edges.
    assert!(outcome.peak_pressure > 2.0);
}

#[test]
fn edges_take_hardly_more_pairs_than_a_map_that_repeats() {
    let loads = [0.02, 0.04, 0.06, 0.08, 0.1, 0.2, 0.4, 0.6];
    let mut pairs = [0; 2];
    for seed in 1..=3 {
        let heights = rough(128, seed);
        let bodies = [solver(128, &heights), free(128, &heights)];
        for (mut body, pairs) in bodies.into_iter().zip(&mut pairs) {
            let spent = loads.map(|load| solved(&mut body, load).pairs);
            *pairs += spent.iter().sum::<u32>();
        }
    }
    // On 1024² nodes the free body takes 158 pairs and the periodic one 135. Without a margin
    // around the map the free body would take 312.
    let [periodic, free] = pairs;
    assert!(4 * free < 5 * periodic, "{free} for {periodic}");
}

#[test]
fn rectangles_touch_as_independent_code_has_it() {
    for (name, size) in [("p192x320", [0.6, 1.0]), ("p256x160_cells", [1.0, 1.25])] {
        let surface = REFERENCE.heights(name, size);
        let grid = surface.grid();
        let slope = Moments::from_surface(&surface).rms_slope();
        assert!((slope - 0.02).abs() < 1e-14);
        let unit = slope * grid.cell().longer_side();
        let mut solver = Solver::new(PeriodicHalfSpace::new(grid), &on(grid, &reduced(&surface)));
        let maps = REFERENCE.maps(name, "contact", grid);
        for (row, map) in REFERENCE.solved(name).iter().zip(maps) {
            let load = row.number(7);
            let outcome = solved(&mut solver, load);
            let touches: Vec<bool> = solver.pressure().iter().map(|p| *p > 0.0).collect();
            assert!(touches == map[..grid.count()], "{name} at {load}");
            assert_eq!(outcome.contact_nodes, row.count(9));
            let contact = ContactMap::from_pressures(grid.nodes(), solver.pressure());
            let area = ContactArea::from_map(&contact);
            assert_eq!(area.switches_along_columns, row.count(11));
            assert_eq!(area.switches_along_rows, row.count(12));
            assert_eq!(Clusters::of_contact(&contact).count, row.count(13));
            let close = |found: f64, exact: f64| (found / exact - 1.0).abs() < 1e-8;
            assert!(close(outcome.mean_gap * unit, row.number(14)));
            assert!(close(outcome.energy * slope * unit, row.number(15)));
            assert!(close(outcome.peak_pressure * slope, row.number(16)));
        }
    }
}

#[test]
fn a_surface_repeated_along_one_side_touches_as_it_does_alone() {
    let heights = rough(32, 3);
    let once = square(32, 1.0);
    let twice = rectangle([64, 32], [2.0, 1.0]);
    let repeated: Vec<f64> = heights.iter().chain(&heights).map(|h| h / 2.0).collect();
    let mut alone = Solver::new(PeriodicHalfSpace::new(once), &on(once, &heights));
    let mut both = Solver::new(PeriodicHalfSpace::new(twice), &on(twice, &repeated));
    let full = alone.full_contact_load().unwrap();
    assert!((both.full_contact_load().unwrap() / full - 1.0).abs() < 1e-12);
    for load in [0.003, 0.05, 0.6].map(|share| share * full) {
        let (one, two) = (solved(&mut alone, load), solved(&mut both, load));
        assert_eq!(2 * one.contact_nodes, two.contact_nodes);
        assert!((one.energy / (2.0 * two.energy) - 1.0).abs() < 1e-9);
        assert!((one.mean_gap / (2.0 * two.mean_gap) - 1.0).abs() < 1e-9);
        for (index, pressure) in both.pressure().iter().enumerate() {
            let single = alone.pressure()[index % (32 * 32)];
            assert!((pressure - single).abs() < 1e-7 * one.peak_pressure);
        }
    }
}

#[test]
fn turning_a_rectangle_turns_its_contact() {
    let lying = rectangle([24, 40], [1.0, 1.5]);
    let convergence = rectangle([40, 24], [1.5, 1.0]);
    let heights: Vec<f64> = noise(40, 5)[..lying.count()].to_vec();
    let turned: Vec<f64> = (0..convergence.count())
        .map(|node| {
            let [i, j] = convergence.indices(node);
            heights[j * 40 + i]
        })
        .collect();
    let mut one = Solver::new(PeriodicHalfSpace::new(lying), &on(lying, &heights));
    let mut other = Solver::new(PeriodicHalfSpace::new(convergence), &on(convergence, &turned));
    for load in [0.01, 0.3] {
        let (outcome, turned) = (solved(&mut one, load), solved(&mut other, load));
        assert_eq!(outcome.contact_nodes, turned.contact_nodes);
        for (node, pressure) in other.pressure().iter().enumerate() {
            let [i, j] = convergence.indices(node);
            let unturned = one.pressure()[j * 40 + i];
            assert!((pressure - unturned).abs() < 1e-8 * outcome.peak_pressure);
        }
    }
}

#[test]
fn rectangles_of_either_transform_are_pressed_however_they_lie() {
    for (nodes, size) in [([64, 32], [1.0, 1.0]), ([9, 50], [0.2, 1.0]), ([1, 64], [0.1, 3.0])] {
        let grid = rectangle(nodes, size);
        let heights: Vec<f64> = noise(64, 7)[..grid.count()].to_vec();
        let mut solver = Solver::new(PeriodicHalfSpace::new(grid), &on(grid, &heights));
        for load in [1e-12, 1e-3, 0.1, 1.0, 100.0] {
            let outcome = press(&mut solver, load, &Settings::default());
            assert!(
                [Stop::Converged, Stop::FullContact].contains(&outcome.stop),
                "{nodes:?}, {load}: {outcome:?}"
            );
            assert!((mean(solver.pressure()) / load - 1.0).abs() < 1e-12);
        }
    }
}
