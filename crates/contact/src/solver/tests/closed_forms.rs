//! Closed forms, and one surface solved by independent code.

use std::f64::consts::{PI, TAU};

use super::*;

/// Cosines of wavenumbers 2 to 8 with phases from irrational numbers, of unit rms slope.
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
    // Load, contact nodes, peak pressure, energy, mean gap, by a Polonsky–Keer code in NumPy.
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
    // And the energy, a quarter of Σ |q| |ĥ|², is half the work on the heights.
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
        // Either edge may fall one node off.
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
        // Of order 3/2 in the mesh: the last nodes inside the edge are off by their half power.
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
    // Discs of 15 nodes across, dilated by the mesh by a few per cent of their area.
    let light = PI * (3.0 * 0.005 / (8.0 * PI)).powf(2.0 / 3.0);
    assert!((area(0.005) / light - 1.0).abs() < 0.12);
    // Gaps of 12 nodes across, shrunk by as much; the expansion itself is first order.
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
    // First order in the mesh over the radius of ten nodes; images are at 1e-3.
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
        // First order in the mesh: half a node out of a radius of twelve, squared.
        assert!((pressure / punch - 1.0).abs() < 0.08, "{r}: {pressure} against {punch}");
    }
}
