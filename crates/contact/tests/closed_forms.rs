//! Contacts in metres and pascals against closed forms, and against the lower layer to the last
//! bit.

#![allow(clippy::disallowed_methods, reason = "tests compare with tolerances")]

use std::f64::consts::{PI, SQRT_2, TAU};

use asperity_contact::{
    Adhesion, AdhesiveContact, Contact, EnergyPerArea, Force, Grid, Layer, Length, Material,
    Pressure, RandomSurface, ReducedPressure, Spectrum, Surface,
};
use asperity_mechanics::elasticity::PeriodicHalfSpace;
use asperity_mechanics::reduced::Units;
use asperity_mechanics::solver::{Settings, Solver};
use asperity_mechanics::topography::random::{self, Amplitude};
use asperity_mechanics::topography::spectrum;
use asperity_mechanics::{grid, theory};

fn elastic() -> Material {
    Material::elastic(Pressure::gigapascals(100.0)).unwrap()
}

fn rough(nodes: usize, k_lower: u32, k_upper: u32) -> Surface {
    let grid = Grid::square(nodes, Length::micrometres(100.0)).unwrap();
    let spectrum = Spectrum::new(0.8, k_lower..=k_upper).unwrap();
    RandomSurface::with_rms_slope(spectrum, 0.1).seed(7).draw(grid).unwrap()
}

/// Returns a wave of 10 nm on 10 µm along x.
fn wave() -> Surface {
    let sides = [Length::micrometres(10.0), Length::micrometres(1.25)];
    let grid = Grid::new([256, 32], sides).unwrap();
    let height = |node: usize| 10.0 * (TAU * (node / 32) as f64 / 256.0).cos();
    let heights = (0..256 * 32).map(height).collect();
    Surface::from_heights(grid, heights, Length::nanometres(1.0)).unwrap().assume_periodic()
}

#[test]
fn a_wave_touches_in_westergaards_strip() {
    let contact = Contact::periodic(&wave(), elastic()).unwrap();
    let full = PI * 100e9 * 10e-9 / 10e-6;
    let found = contact.full_contact_pressure().unwrap().in_pascals();
    assert!((found / full - 1.0).abs() < 1e-9, "{found}");
    for share in [0.1_f64, 0.5, 0.9] {
        let pressed = contact.press(Pressure::pascals(share * full)).unwrap();
        let expected = 2.0 / PI * share.sqrt().asin();
        // A node at each edge of the strip.
        assert!((pressed.area_fraction() - expected).abs() < 2.0 / 256.0);
        assert!(pressed.gaps().iter().zip(pressed.contact_map()).all(|(gap, touches)| {
            if touches { gap.in_metres() == 0.0 } else { gap.in_metres() > -1e-12 }
        }));
    }
    assert!(contact.press(Pressure::pascals(1.001 * full)).unwrap().is_full_contact());
    let slope = SQRT_2 * PI * 10e-9 / 10e-6;
    assert!((wave().rms_slope() / slope - 1.0).abs() < 1e-12);
    assert!((wave().rms_height().in_nanometres() - 50_f64.sqrt()).abs() < 1e-9);
}

#[test]
fn a_sphere_on_an_isolated_patch_is_hertz_in_newtons_and_metres() {
    // 10 mm on a patch of 0.2 mm.
    let (radius, side, nodes) = (0.01, 2e-4, 128);
    let grid = Grid::square(nodes, Length::metres(side)).unwrap();
    let at = |index: usize| ((index as f64 + 0.5) / nodes as f64 - 0.5) * side;
    let height = |node: usize| {
        let (x, y) = (at(node / nodes), at(node % nodes));
        -(x * x + y * y) / (2.0 * radius)
    };
    let heights = (0..nodes * nodes).map(height).collect();
    let surface = Surface::from_heights(grid, heights, Length::metres(1.0)).unwrap();
    let contact = Contact::isolated(&surface, elastic()).unwrap();
    assert!(contact.full_contact_pressure().is_none());
    let pressed = contact.press(Force::newtons(1.0)).unwrap();
    let contact_radius = (0.75 * radius / 100e9_f64).cbrt();
    let peak = 1.5 / (PI * contact_radius.powi(2));
    assert!((pressed.peak_pressure().in_pascals() / peak - 1.0).abs() < 0.01);
    let area = PI * contact_radius.powi(2) / (side * side);
    assert!((pressed.corrected_area_fraction().unwrap() / area - 1.0).abs() < 0.03);
    let approach = contact_radius.powi(2) / radius;
    let deepest = pressed.displacements()[nodes / 2 * nodes + nodes / 2].in_metres();
    assert!((deepest / approach - 1.0).abs() < 0.01, "{deepest} {approach}");
    let mean = pressed.mean_pressure().in_pascals() * side * side;
    assert!((mean - 1.0).abs() < 1e-11, "{mean}");
    let [spot] = pressed.spots()[..] else { panic!("one spot") };
    assert!((spot.centre()[0].in_metres() - 0.5 * side).abs() < side / nodes as f64);
}

#[test]
fn light_contacts_grow_linearly_between_persson_and_the_asperity_models() {
    let contact = Contact::periodic(&rough(256, 4, 32), Material::reduced()).unwrap();
    for load in [0.02, 0.04] {
        let pressed = contact.press(ReducedPressure::new(load)).unwrap();
        let area = pressed.corrected_area_fraction().unwrap();
        let persson = theory::persson::area(load);
        assert!(area > persson && area < TAU.sqrt() * load, "{load}: {area} {persson}");
    }
}

#[test]
fn results_are_those_of_the_lower_layer_to_the_last_bit() {
    let surface = rough(128, 2, 16);
    let lower_grid = grid::Grid::square(128, 1e-4).unwrap();
    let spectrum =
        spectrum::Spectrum { hurst: 0.8, k_lower: 2, k_rolloff: 2, k_upper: 16, anisotropy: None };
    let drawn = random::RandomSurface {
        spectrum,
        amplitude: Amplitude::Gaussian,
        rms_slope: 0.1,
        seed: 7,
        realization: 0,
    };
    let units = Units::new(lower_grid.cell(), 0.1, 100e9).unwrap();
    let heights = units.reduced_heights(drawn.draw(lower_grid)).unwrap();
    let mut solver = Solver::new(PeriodicHalfSpace::new(lower_grid), &heights);
    let contact = Contact::periodic(&surface, elastic()).unwrap();
    for megapascals in [100.0, 500.0, 200.0] {
        let load = units.reduced_pressure(megapascals * 1e6);
        let outcome = solver.press(load, &Settings::default(), &|| false);
        let pressed = contact.press(Pressure::megapascals(megapascals)).unwrap();
        assert_eq!(pressed.load().value(), load);
        assert_eq!(pressed.mean_pressure().in_megapascals(), megapascals);
        assert_eq!(pressed.mean_gap().in_metres(), outcome.mean_gap * units.length());
        let pressures: Vec<f64> = solver.pressure().iter().map(|p| p * units.pressure()).collect();
        let found: Vec<f64> = pressed.pressures().iter().map(|p| p.in_pascals()).collect();
        assert_eq!(found, pressures);
        let reduced = solver.pressure().to_vec();
        let gaps: Vec<f64> =
            solver.gap_under(&reduced).iter().map(|g| g * units.length()).collect();
        let found: Vec<f64> = pressed.gaps().iter().map(|gap| gap.in_metres()).collect();
        assert_eq!(found, gaps);
    }
}

#[test]
fn loads_in_any_unit_threads_and_order_have_the_same_bits() {
    let surface = rough(128, 2, 16);
    let contact = Contact::periodic(&surface, elastic()).unwrap();
    let first = contact.press(Pressure::megapascals(300.0)).unwrap();
    let same = |pressures: Vec<Pressure>| assert_eq!(pressures, first.pressures());
    let heavy = contact.press(Pressure::gigapascals(1.0)).unwrap();
    assert!(heavy.area_fraction() > first.area_fraction());
    same(contact.press(ReducedPressure::new(0.03)).unwrap().pressures());
    same(contact.press(Force::newtons(3.0)).unwrap().pressures());
    let threads = Contact::periodic(&surface, elastic()).unwrap().threads(2);
    same(threads.press(Pressure::megapascals(300.0)).unwrap().pressures());
    let at_once = std::thread::scope(|scope| {
        let all = [0; 3].map(|_| scope.spawn(|| contact.press(Pressure::megapascals(300.0))));
        all.map(|one| one.join().unwrap().unwrap())
    });
    at_once.into_iter().for_each(|pressed| same(pressed.pressures()));
    let reduced = Contact::periodic(&surface, Material::reduced()).unwrap();
    let reduced = reduced.press(ReducedPressure::new(0.03)).unwrap();
    assert_eq!(reduced.area_fraction(), first.area_fraction());
    assert_eq!(reduced.gaps(), first.gaps());
    let to_gap = contact.press_to_gap(first.mean_gap()).unwrap();
    assert!((to_gap.mean_pressure().in_megapascals() / 300.0 - 1.0).abs() < 1e-3);
}

#[test]
fn a_hardness_bounds_the_pressure_and_a_coating_stiffens() {
    let surface = rough(128, 2, 16);
    let load = Pressure::megapascals(500.0);
    let soft = elastic().hardness(Pressure::gigapascals(3.0)).unwrap();
    let pressed = Contact::periodic(&surface, soft).unwrap().press(load).unwrap();
    assert!((pressed.peak_pressure().in_gigapascals() - 3.0).abs() < 1e-9);
    assert!(pressed.saturated_fraction() > 0.0);
    let elastic_area =
        Contact::periodic(&surface, elastic()).unwrap().press(load).unwrap().area_fraction();
    assert!(pressed.area_fraction() > elastic_area);
    let layer = Layer::bonded(Length::micrometres(2.0), 0.3).unwrap();
    let on_base = Contact::periodic(&surface, elastic().layer(layer)).unwrap();
    assert!(on_base.press(load).unwrap().area_fraction() < elastic_area);
}

#[test]
fn flat_walls_pull_each_other_by_the_attraction_of_their_gap() {
    // Waves of 0.01 nm are nearly flat: p = −(w/ρ) exp(−g/ρ).
    let grid = Grid::square(32, Length::micrometres(1.0)).unwrap();
    let spectrum = Spectrum::new(0.8, 1..=2).unwrap();
    let height = Length::nanometres(0.01);
    let surface = RandomSurface::with_rms_height(spectrum, height).draw(grid).unwrap();
    assert!((surface.rms_height().in_nanometres() / 0.01 - 1.0).abs() < 1e-9);
    let work = EnergyPerArea::millijoules_per_square_metre(50.0);
    let adhesion = Adhesion::new(work, Length::nanometres(5.0)).unwrap();
    let mut contact = AdhesiveContact::periodic(&surface, elastic(), adhesion).unwrap();
    let state = contact.press_to_gap(Length::nanometres(10.0)).unwrap();
    let expected = -0.05 / 5e-9 * (-2.0_f64).exp();
    assert!((state.mean_pressure().in_pascals() / expected - 1.0).abs() < 1e-3);
    assert_eq!((state.contact_fraction(), state.repulsive_fraction()), (0.0, 0.0));
    // The strongest attraction is w/ρ = 10 MPa.
    contact.press(Pressure::megapascals(1.0)).unwrap();
    let apart = contact.press(Pressure::megapascals(-11.0)).unwrap();
    assert!(apart.is_apart() && apart.mean_gap().is_none());
    let pull_off = apart.pull_off_pressure().unwrap().in_megapascals();
    assert!((pull_off + 10.0).abs() < 0.1, "{pull_off}");
}
