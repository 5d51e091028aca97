//! Tests of asperities against closed forms, against each other and against the solver.

use std::f64::consts::PI;

use super::*;
use crate::grid::samples::square;
use crate::reduced::samples::on;
use crate::solver::{Body, Stop};
use crate::topography::random::samples;

const SETTINGS: Settings = Settings { tolerance: 1e-12, pair_limit: 500 };

/// Returns the maximum over paraboloids of curvature `bend` with the given tops, at each node.
fn spheres(grid: Grid, bend: f64, tops: &[[f64; 2]]) -> Vec<f64> {
    let around = |by: f64| by - by.round();
    let height = |node: usize| {
        let [i, j] = grid.indices(node);
        let [nodes_x, nodes_y] = grid.nodes();
        let position = [i as f64 / nodes_x as f64, j as f64 / nodes_y as f64];
        let below = tops.iter().map(|top| {
            let by = [0, 1].map(|axis| around(position[axis] - top[axis]));
            -0.5 * bend * (by[0] * by[0] + by[1] * by[1])
        });
        below.fold(f64::NEG_INFINITY, f64::max)
    };
    (0..grid.count()).map(height).collect()
}

fn press(grid: Grid, heights: &[f64], interaction: Interaction, load: f64) -> AsperityOutcome {
    let mut asperities = Asperities::new(&on(grid, heights), interaction).unwrap();
    let outcome = asperities.press(load, &SETTINGS);
    assert_eq!(outcome.outcome.stop, Stop::Converged);
    outcome
}

/// Returns the height of the reference plane above the tops of the asperities, which are at zero.
fn plane(outcome: &AsperityOutcome, heights: &[f64]) -> f64 {
    outcome.outcome.mean_gap + heights.iter().sum::<f64>() / heights.len() as f64
}

#[test]
fn one_asperity_is_hertz() {
    let grid = square(32, 1.0);
    let (bend, load) = (3.0_f64, 1e-4);
    let heights = spheres(grid, bend, &[[0.5, 0.5]]);
    let found = press(grid, &heights, Interaction::None, load);
    // F = (4/3) √R d^(3/2), area πRd, p = 3F/(2πRd), energy (2/5) F d.
    let depth = (0.75 * load * bend.sqrt()).powf(2.0 / 3.0);
    let area = PI * depth / bend;
    for (found, known) in [
        (-plane(&found, &heights), depth),
        (found.area_fraction, area),
        (found.outcome.peak_pressure, 1.5 * load / area),
        (found.outcome.energy, 0.4 * load * depth),
    ] {
        assert!((found / known - 1.0).abs() < 1e-10, "{found} {known}");
    }
    assert_eq!((found.contacts, found.overlapping), (1, 0));
}

#[test]
fn two_asperities_displace_each_other_as_two_forces_do() {
    let grid = square(256, 1.0);
    let (bend, load) = (40.0_f64, 1e-6);
    let apart = 16.0 / 256.0;
    let tops = [[0.5, 0.5], [0.5 + apart, 0.5]];
    let heights = spheres(grid, bend, &tops);
    let found = press(grid, &heights, Interaction::Explicit, load);
    assert_eq!(found.contacts, 2);
    let depth = (0.375 * load * bend.sqrt()).powf(2.0 / 3.0);
    // Each asperity is displaced by F/(π r) due to the other, and by the periodic images of both.
    let images = 2.0 * 3.900_264_920_001_956 / PI;
    let displaced = 0.5 * load * (1.0 / (PI * apart) - images);
    // The contribution of images is even in r.
    let tolerance = 0.5 * load * 3.0 * apart * apart;
    assert!((plane(&found, &heights) + depth + displaced).abs() < tolerance);
    let alone = press(grid, &heights, Interaction::None, load);
    assert!((plane(&alone, &heights) + depth).abs() < 1e-10 * depth);
}

#[test]
fn a_lattice_of_spheres_is_what_the_solver_finds_at_light_load() {
    let grid = square(512, 1.0);
    let (bend, load) = (4.0_f64, 2e-4);
    let heights = spheres(grid, bend, &[[0.5, 0.5]]);
    let model = press(grid, &heights, Interaction::Explicit, load);
    let mut solver = Body::default().solver(&on(grid, &heights));
    let solved = solver.press(load, &Settings::default(), &|| false);
    let solved_plane = solved.mean_gap + heights.iter().sum::<f64>() / heights.len() as f64;
    let plane = plane(&model, &heights);
    // The contact is 21 nodes wide. The error of the mesh is of second order.
    assert!((plane / solved_plane - 1.0).abs() < 4e-3, "{plane} {solved_plane}");
    // Without periodic images, the difference would be ten times as large.
    let images = 3.900_264_920_001_956 / PI * load;
    assert!(images > 0.02 * plane.abs(), "{images} {plane}");
    // The solver counts the area in nodes, with an error of a tenth of the edge nodes.
    let area = solved.contact_nodes as f64 / grid.count() as f64;
    assert!((model.area_fraction / area - 1.0).abs() < 0.05, "{} {area}", model.area_fraction);
    let traced = model.outcome.contact_nodes as f64 / grid.count() as f64;
    assert!((traced / model.area_fraction - 1.0).abs() < 0.05);
}

fn rough(nodes: usize, k_lower: u32, k_upper: u32) -> (Grid, Vec<f64>) {
    let grid = square(nodes, 1.0);
    let surface = samples::random(k_lower, k_upper, 3);
    (grid, surface.draw(grid).into_heights())
}

#[test]
fn many_weak_contacts_feel_the_mean_field_alone() {
    let (grid, heights) = rough(256, 32, 64);
    let mean_field = press(grid, &heights, Interaction::MeanField, 1e-3);
    let explicit = press(grid, &heights, Interaction::Explicit, 1e-3);
    assert!(explicit.contacts > 100);
    let ratio = explicit.area_fraction / mean_field.area_fraction;
    assert!((ratio - 1.0).abs() < 0.01, "{ratio}");
    let gap = explicit.outcome.mean_gap / mean_field.outcome.mean_gap;
    assert!((gap - 1.0).abs() < 0.01, "{gap}");
    assert_eq!(mean_field.nominal_displacement, explicit.nominal_displacement);
}

#[test]
fn a_uniform_displacement_moves_the_plane_and_nothing_else() {
    let (grid, heights) = rough(64, 4, 16);
    let none = press(grid, &heights, Interaction::None, 0.02);
    let mean_field = press(grid, &heights, Interaction::MeanField, 0.02);
    assert_eq!(none.nominal_displacement, 0.0);
    assert_eq!(none.outcome, mean_field.outcome);
    let known = 4.0 / PI * ((1.0 + 2.0_f64.sqrt()).ln() - (2.0_f64.sqrt() - 1.0) / 3.0);
    assert!((mean_field.nominal_displacement / 0.02 - known).abs() < 1e-9);
}

#[test]
fn a_load_does_not_depend_on_loads_before_it() {
    let (grid, heights) = rough(128, 4, 16);
    let explicit = press(grid, &heights, Interaction::Explicit, 0.02);
    let mut pressed = Asperities::new(&on(grid, &heights), Interaction::Explicit).unwrap();
    for load in [0.005, 0.1, 0.015] {
        pressed.press(load, &SETTINGS);
    }
    assert_eq!(pressed.press(0.02, &SETTINGS), explicit);
}

#[test]
fn a_flat_surface_has_nothing_to_press() {
    let grid = square(16, 1.0);
    let none = Asperities::new(&on(grid, &vec![1.0; grid.count()]), Interaction::None);
    assert_eq!(none.err(), Some(NoSummits));
}
