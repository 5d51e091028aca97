//! Contacts at a prescribed mean gap or approach: those of the loads that they find, Hertz's
//! contact, and the ends of contact.

use super::*;
use crate::elasticity::{Base, Layer, Support};
use crate::grid::Boundary;
use crate::topography::random::{Amplitude, RandomSurface};
use crate::topography::spectrum::Spectrum;

const LAYER_ON_BASE: (f64, f64) = (0.2, 0.3);

/// Returns a half-space with either boundary, layers and materials that yield.
fn bodies() -> Vec<Body> {
    let (thickness, poisson_ratio) = LAYER_ON_BASE;
    let layer = |support| Elastic::Layer(Layer::new(thickness, poisson_ratio, support).unwrap());
    let coating = Support::HalfSpace { poisson_ratio: 0.3, modulus_ratio: 4.0 };
    let elastic = |elastic| Body { elastic, hardness: None };
    let yielding = |boundary: Boundary, hardness: f64| Body {
        elastic: boundary.into(),
        hardness: Some(Hardness::new(hardness).unwrap()),
    };
    vec![
        elastic(Boundary::Periodic.into()),
        elastic(Boundary::Free.into()),
        elastic(layer(Support::Rigid(Base::Bonded))),
        elastic(layer(coating)),
        yielding(Boundary::Periodic, 0.6),
        yielding(Boundary::Free, 0.8),
    ]
}

fn compliance(body: &Body) -> f64 {
    match body.elastic {
        Elastic::Layer(layer) => layer.uniform_compliance().unwrap_or(0.0),
        Elastic::HalfSpace(_) => 0.0,
    }
}

/// Returns the approach since first touch under the last load, from the pressures.
fn approach(solver: &mut Solver, load: f64, outcome: &Outcome, uniform_compliance: f64) -> f64 {
    let pressure = solver.pressure().to_vec();
    let displacement = mean(&solver.displacement_under(&pressure));
    let highest = solver.problem.highest;
    let rigid = highest - outcome.mean_gap + outcome.yielded_depth + displacement;
    rigid + uniform_compliance * load
}

/// Solves a load, and then its mean gap and its approach. Returns the largest relative difference
/// of the loads, and the largest difference in contact nodes.
fn found_again(body: &Body, heights: &[f64], nodes: usize, load: f64) -> (f64, usize) {
    let mut solver = body.solver(&on(square(nodes, 1.0), heights));
    let settings = Settings::default();
    let pressed = press(&mut solver, load, &settings);
    let uniform_compliance = compliance(body);
    let approach = approach(&mut solver, load, &pressed, uniform_compliance);
    let mut fresh = body.solver(&on(square(nodes, 1.0), heights));
    let (mut difference, mut differing) = (0.0_f64, 0);
    let all = [
        Prescribed::MeanGap(pressed.mean_gap),
        Prescribed::Approach { approach, uniform_compliance },
    ];
    for prescribed in all {
        let (found, outcome) = fresh.press_to(prescribed, &settings, &|| false);
        assert_eq!(outcome.stop, Stop::Converged, "{body:?}, {load}: {prescribed:?}, {outcome:?}");
        difference = difference.max((found / load - 1.0).abs());
        differing = differing.max(outcome.contact_nodes.abs_diff(pressed.contact_nodes));
        let in_steps = |error: f64| fresh.inner.residual(error.abs());
        if let Prescribed::MeanGap(gap) = prescribed {
            assert!(in_steps(outcome.mean_gap - gap) <= settings.tolerance);
        }
        // The solution is that of the load, started afresh.
        let pressed = press(&mut body.solver(&on(square(nodes, 1.0), heights)), found, &settings);
        let shared = outcome.contact_nodes.abs_diff(pressed.contact_nodes);
        differing = differing.max(shared);
        assert!(in_steps(outcome.mean_gap - pressed.mean_gap) <= 2.0 * settings.tolerance);
    }
    (difference, differing)
}

#[test]
fn the_mean_gap_and_the_approach_of_a_load_give_this_load_again() {
    for (seed, body) in bodies().into_iter().enumerate() {
        for nodes in [48, 128] {
            let heights = rough(nodes, seed as u64);
            for load in [0.003, 0.03, 0.2, 0.4] {
                let (difference, nodes_apart) = found_again(&body, &heights, nodes, load);
                assert!(difference < 2e-3, "{body:?}, {load}: {difference}");
                let nodes = nodes * nodes;
                assert!(nodes_apart <= 1 + nodes / 1000, "{body:?}, {load}: {nodes_apart}");
            }
        }
    }
}

#[test]
fn a_prescribed_value_does_not_depend_on_the_one_before() {
    let heights = rough(128, 3);
    let fresh = || solver(128, &heights);
    let bits = |solver: &Solver| Vec::from_iter(solver.pressure().iter().map(|p| p.to_bits()));
    let to = |solver: &mut Solver, gap: f64| {
        solver.press_to(Prescribed::MeanGap(gap), &Settings::default(), &|| false)
    };
    let highest = fresh().problem.highest;
    let (mut alone, mut after) = (fresh(), fresh());
    to(&mut after, 0.7 * highest);
    press(&mut after, 0.1, &Settings::default());
    assert_eq!(to(&mut alone, 0.3 * highest), to(&mut after, 0.3 * highest));
    assert_eq!(bits(&alone), bits(&after));
}

#[test]
fn a_sphere_at_a_prescribed_approach_bears_the_load_of_hertz() {
    let (nodes, radius) = (128, 0.5);
    let from_centre = |place: f64| place + 0.5 / nodes as f64 - 0.5;
    let heights =
        map(nodes, |x, y| -0.5 * (from_centre(x).powi(2) + from_centre(y).powi(2)) / radius);
    let body = Body { elastic: Boundary::Free.into(), hardness: None };
    let mut solver = body.solver(&on(square(nodes, 1.0), &heights));
    // First touch is at the four nodes around the centre, which are a little below it.
    let below = 0.25 / (nodes * nodes) as f64 / radius;
    for contact_radius in [0.1_f64, 0.2, 0.3] {
        let depth = contact_radius.powi(2) / radius;
        let approach = Prescribed::Approach { approach: depth - below, uniform_compliance: 0.0 };
        let (load, outcome) = solver.press_to(approach, &Settings::default(), &|| false);
        // The cell has the area 1, so that the mean pressure is the force.
        let force = 4.0 / 3.0 * radius.sqrt() * depth.powf(1.5);
        assert!((load / force - 1.0).abs() < 4e-3, "{contact_radius}: {load} {force}");
        let area = std::f64::consts::PI * contact_radius.powi(2);
        let found = outcome.contact_nodes as f64 / (nodes * nodes) as f64;
        // Half a mesh step at the edge of the smallest contact is 4 % of its area.
        assert!((found / area - 1.0).abs() < 0.04, "{contact_radius}: {found} {area}");
    }
}

/// Solves a prescribed value and checks the contact conditions at the offset that it gives: yielded
/// nodes penetrate, and no other node does. Returns whether all nodes in contact have yielded.
fn is_plateau(solver: &mut Solver, heights: &[f64], prescribed: Prescribed) -> bool {
    let settings = Settings::default();
    let (load, outcome) = solver.press_to(prescribed, &settings, &|| false);
    assert_eq!(outcome.stop, Stop::Converged, "{prescribed:?}, {load}, {outcome:?}");
    assert!(outcome.pairs < 500, "{prescribed:?}, {load}, {outcome:?}");
    let pressure = solver.pressure().to_vec();
    let displacement = solver.displacement_under(&pressure);
    let centre = mean(heights);
    let highest = solver.problem.highest;
    let tolerance = 1.1 * settings.tolerance / solver.inner.mesh.steps_per_side;
    // The offset from the mean gap: without contact, it is minus the mean gap.
    let approach = approach(solver, load, &outcome, 0.0);
    let offset = approach - highest;
    let hardness = solver.problem.hardness.unwrap().pressure();
    let (mut apart, mut yielded) = (0.0, 0.0);
    for ((u, height), p) in displacement.iter().zip(heights).zip(&pressure) {
        let gap = u - (height - centre) - offset;
        let violation = match *p {
            0.0 => -gap,
            p if p == hardness => gap,
            _ => gap.abs(),
        };
        assert!(violation <= tolerance, "{prescribed:?}: {violation} {gap} {p}, {outcome:?}");
        apart += if *p == 0.0 { gap } else { 0.0 };
        yielded += if *p == hardness { -gap } else { 0.0 };
    }
    let cells = heights.len() as f64;
    assert!((outcome.mean_gap - apart / cells).abs() <= tolerance);
    assert!((outcome.yielded_depth - yielded / cells).abs() <= tolerance);
    assert!((mean(&pressure) / load - 1.0).abs() < 1e-12);
    let (found, wanted) = match prescribed {
        Prescribed::MeanGap(gap) => (outcome.mean_gap, gap),
        Prescribed::Approach { approach: wanted, .. } => (approach, wanted),
    };
    assert!((found - wanted).abs() <= tolerance, "{prescribed:?}: {found}");
    outcome.contact_nodes == outcome.saturated_nodes
}

#[test]
fn a_value_between_two_loads_without_elastic_nodes_has_the_load_on_yielded_nodes() {
    let spectrum = Spectrum { hurst: 0.8, k_lower: 4, k_rolloff: 4, k_upper: 32, anisotropy: None };
    let amplitude = Amplitude::Gaussian;
    for boundary in [Boundary::Periodic, Boundary::Free] {
        let mut plateaus = 0;
        for (seed, nodes, hardness) in [(1, 128, 0.053), (2, 128, 0.1), (3, 64, 0.05)] {
            let surface =
                RandomSurface { spectrum, amplitude, rms_slope: 1.0, seed, realization: 0 };
            let heights = surface.draw(square(nodes, 1.0)).into_heights();
            let hardness = Some(Hardness::new(hardness).unwrap());
            let body = Body { elastic: boundary.into(), hardness };
            let mut solver = body.solver(&on(square(nodes, 1.0), &heights));
            let highest = solver.problem.highest;
            for step in 1..16 {
                let share = f64::from(step) / 50.0;
                let by_approach =
                    Prescribed::Approach { approach: share * highest, uniform_compliance: 0.0 };
                for prescribed in [Prescribed::MeanGap((1.0 - share) * highest), by_approach] {
                    plateaus += usize::from(is_plateau(&mut solver, &heights, prescribed));
                }
            }
        }
        assert!(plateaus > 10, "{boundary:?}: {plateaus}");
    }
}

#[test]
fn a_flat_punch_that_has_yielded_sinks_in_under_the_same_load() {
    let (nodes, hardness, depth) = (64, 0.05, 0.1);
    let is_inside = |x: f64, y: f64| (x - 0.5).powi(2) + (y - 0.5).powi(2) < 0.04;
    let heights = map(nodes, |x, y| if is_inside(x, y) { depth } else { 0.0 });
    let inside = heights.iter().filter(|height| **height > 0.0).count();
    for boundary in [Boundary::Periodic, Boundary::Free] {
        let hardness = Some(Hardness::new(hardness).unwrap());
        let body = Body { elastic: boundary.into(), hardness };
        let mut solver = body.solver(&on(square(nodes, 1.0), &heights));
        for approach in [0.3, 0.5, 0.8].map(|share| share * depth) {
            let prescribed = Prescribed::Approach { approach, uniform_compliance: 0.0 };
            assert!(is_plateau(&mut solver, &heights, prescribed), "{approach}");
            assert_eq!(solver.pressure().iter().filter(|p| **p > 0.0).count(), inside);
        }
    }
}

#[test]
fn contact_begins_at_first_touch_and_ends_in_full_contact() {
    let heights = rough(64, 5);
    let settings = Settings::default();
    let to = |solver: &mut Solver, prescribed| solver.press_to(prescribed, &settings, &|| false);
    let mut half_space = solver(64, &heights);
    let (highest, full) =
        (half_space.problem.highest, half_space.full_contact_load().expect("a formula gives it"));
    let (load, outcome) = to(&mut half_space, Prescribed::MeanGap(1.01 * highest));
    assert_eq!((load, outcome.stop), (0.0, Stop::NoContact));
    assert_eq!(outcome.mean_gap, 1.01 * highest);
    assert!(half_space.pressure().iter().all(|pressure| *pressure == 0.0));
    // A single node: its displacement is its compliance times its pressure.
    let (load, outcome) = to(&mut half_space, Prescribed::MeanGap((1.0 - 1e-6) * highest));
    assert_eq!((outcome.stop, outcome.contact_nodes), (Stop::Converged, 1));
    let nodal = half_space.inner.mesh.nodal_compliance;
    let depth = load * heights.len() as f64 * nodal;
    assert!((depth / (1e-6 * highest) - 1.0).abs() < 2e-3);
    let (load, outcome) = to(&mut half_space, Prescribed::MeanGap(1e-4 * highest));
    assert_eq!(outcome.stop, Stop::Converged);
    assert!(load > 0.7 * full && load < full, "{load}, {full}");
    let beyond = Prescribed::Approach { approach: 1.5 * highest, uniform_compliance: 0.0 };
    let (load, outcome) = to(&mut half_space, beyond);
    assert_eq!((load, outcome.stop), (full, Stop::NotReached));

    // A layer on a rigid base is compressed in full contact, too.
    let (thickness, poisson_ratio) = LAYER_ON_BASE;
    let layer = Layer::new(thickness, poisson_ratio, Support::Rigid(Base::Bonded)).unwrap();
    let body = Body { elastic: Elastic::Layer(layer), hardness: None };
    let mut on_base = body.solver(&on(square(64, 1.0), &heights));
    let full = on_base.full_contact_load().expect("a formula gives it");
    let uniform_compliance = compliance(&body);
    let approach = highest + 1.5 * uniform_compliance * full;
    let (load, outcome) = to(&mut on_base, Prescribed::Approach { approach, uniform_compliance });
    assert_eq!(outcome.stop, Stop::FullContact);
    assert!((load / full / 1.5 - 1.0).abs() < 1e-12);
}

#[test]
fn interruptions_and_too_few_pairs_end_the_search() {
    let heights = rough(64, 2);
    let mut solver = solver(64, &heights);
    let gap = Prescribed::MeanGap(0.4 * solver.problem.highest);
    let few = Settings { pair_limit: 20, ..Settings::default() };
    let (_, outcome) = solver.press_to(gap, &few, &|| false);
    assert_eq!(outcome.stop, Stop::PairLimit);
    let (_, outcome) = solver.press_to(gap, &Settings::default(), &|| true);
    assert_eq!(outcome.stop, Stop::Interrupted);
}

/// 500 random cases: surfaces, bodies and loads.
#[test]
fn random_mean_gaps_and_approaches_are_those_of_the_loads_that_they_find() {
    let mut state = 7_u64;
    let mut draw = || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    let bodies = bodies();
    let mut cases = 0;
    for case in 0..500 {
        let nodes = [16, 24, 32, 48][(4.0 * draw()) as usize];
        let body = &bodies[case % bodies.len()];
        let heights =
            if draw() < 0.2 { noise(nodes, case as u64) } else { rough(nodes, case as u64) };
        let load = 0.5 * libm::pow(10.0, -4.0 * draw());
        let reached = body.solver(&on(square(nodes, 1.0), &heights)).reaches_full_contact(load);
        if reached {
            continue;
        }
        let (difference, nodes_apart) = found_again(body, &heights, nodes, load);
        assert!(difference < 5e-3, "case {case}: {body:?}, {load}: {difference}");
        assert!(nodes_apart <= 1 + nodes * nodes / 500, "case {case}: {nodes_apart}");
        cases += 1;
    }
    assert!(cases > 400);
}
