//! Conductances of layered bodies against an integral equation, closed forms and dense algebra.

use std::f64::consts::{LN_2, PI};

use super::*;
use crate::grid::samples::square;
use crate::solver::Stop;
use crate::solver::tests::{rough, solver};

const USUAL: Settings = Settings { tolerance: 5e-5, pair_limit: 2000 };
const FINE: Settings = Settings { tolerance: 1e-9, pair_limit: 2000 };

fn layer(thickness: f64, to_substrate: f64, to_counter_body: f64) -> LayeredConductor {
    LayeredConductor::new(thickness, to_substrate, to_counter_body).unwrap()
}

fn conductance(
    grid: Grid,
    layer: LayeredConductor,
    pressure: &[f64],
    settings: &Settings,
) -> ContactStiffness {
    let conductor = Conductor::new(&Threads::one(), grid, layer);
    let found = conductor.conductance(Threads::one(), pressure, settings, &|| false);
    assert_eq!(found.stop, Stop::Converged);
    found
}

/// Returns the pressures of a rough contact on a half-space.
fn rough_contact(nodes: usize, load: f64) -> Vec<f64> {
    let mut solver = solver(nodes, &rough(nodes, 9));
    let outcome = solver.press(load, &USUAL, &|| false);
    assert_eq!(outcome.stop, Stop::Converged);
    solver.pressure().to_vec()
}

/// Returns a map with unit pressure on a disc in the centre, with `cells` nodes to the radius.
fn disc(nodes: usize, cells: f64) -> Vec<f64> {
    let from_centre = |index: usize| index as f64 + 0.5 - nodes as f64 / 2.0;
    let is_inside = |node| from_centre(node / nodes).hypot(from_centre(node % nodes)) < cells;
    (0..nodes * nodes).map(|node| f64::from(u8::from(is_inside(node)))).collect()
}

#[test]
fn a_layer_of_the_material_of_its_substrate_conducts_as_stiffly_as_a_half_space() {
    for load in [0.01, 0.1, 0.5] {
        let pressure = rough_contact(128, load);
        let mut half_space = solver(128, &rough(128, 9));
        for settings in [USUAL, FINE] {
            let stiffness = half_space.contact_stiffness(&pressure, &settings, &|| false);
            let found = conductance(square(128, 1.0), layer(0.03, 1.0, 0.7), &pressure, &settings);
            assert!((found.stiffness / stiffness.stiffness - 1.0).abs() < 1e-9, "{found:?}");
            assert_eq!(found.pairs, stiffness.pairs);
        }
    }
}

#[test]
fn thin_and_thick_layers_conduct_as_half_spaces_of_their_substrate_and_of_themselves() {
    let pressure = rough_contact(64, 0.1);
    let grid = square(64, 1.0);
    let half_space = conductance(grid, layer(1.0, 1.0, 1.0), &pressure, &FINE).stiffness;
    for (to_substrate, to_counter_body) in [(0.1, 0.5), (20.0, 3.0)] {
        let thick = conductance(grid, layer(8.0, to_substrate, to_counter_body), &pressure, &FINE);
        assert!((thick.stiffness / half_space - 1.0).abs() < 1e-9);
        let thin = layer(1e-9, to_substrate, to_counter_body);
        let thin = conductance(grid, thin, &pressure, &FINE);
        // In units of k₁: k_s = 2/(1 + c), and 2/(r + c) with the substrate in place of the layer.
        let expected = half_space * (1.0 + to_counter_body) / (to_substrate + to_counter_body);
        assert!((thin.stiffness / expected - 1.0).abs() < 1e-5, "{thin:?}, {expected}");
    }
}

/// Returns rows of the resistances of one round spot in an infinite plane, over that of the
/// half-space: the thickness over the radius, k₁/k₂, k₁/k₃ and the resistance.
fn spots() -> Vec<[f64; 4]> {
    let path = format!("{}/tests/data/conductance/layered_spot.csv", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    let row = |line: &str| -> Vec<f64> {
        line.split(',').map(|number| number.parse().unwrap()).collect()
    };
    text.lines().skip(1).map(|line| row(line).try_into().unwrap()).collect()
}

/// Returns the resistance 1/(2 a) of a half-space and that of a layered body without the images of
/// a spot of radius a = `cells`/`nodes`, which far from the spot is a point source.
fn of_one_spot(
    nodes: usize,
    cells: f64,
    conductor: LayeredConductor,
    ratios: [f64; 2],
) -> [f64; 2] {
    const LATTICE: f64 = 3.900_264_920_001_956;
    let (pressure, grid) = (disc(nodes, cells), square(nodes, 1.0));
    let resistance = |layer| 1.0 / conductance(grid, layer, &pressure, &USUAL).stiffness;
    let half_space = resistance(layer(1.0, 1.0, 1.0)) + LATTICE / PI;
    // f = f₀ + f₁ x + …: the images are sources on the substrate, and the mean over the cell of
    // what the layer adds around the spot is missing.
    let [to_substrate, to_counter_body] = ratios;
    let far = (to_substrate + to_counter_body) / (1.0 + to_counter_body);
    let near = (1.0 - to_substrate * to_substrate) / (1.0 + to_counter_body);
    let mean = 2.0 * near * conductor.thickness();
    [half_space, resistance(conductor) + LATTICE / PI * far + mean]
}

#[test]
fn one_round_spot_on_a_layer_has_the_resistance_of_its_integral_equation() {
    let cells = 8.0;
    let mut compared = 0;
    for [thickness, to_substrate, to_counter_body, expected] in spots() {
        // The expansion needs a layer that is thin beside the cell, also times k₁/k₂.
        let spread = thickness * to_substrate / (1.0 + to_counter_body);
        let nodes = if thickness * to_substrate.max(1.0) < 1.5 { 256 } else { 768 };
        if spread > 12.0 {
            continue;
        }
        let of_cell = layer(thickness * cells / nodes as f64, to_substrate, to_counter_body);
        let ratios = [to_substrate, to_counter_body];
        let [half_space, found] = of_one_spot(nodes, cells, of_cell, ratios);
        let error = found / half_space / expected - 1.0;
        // The thinnest layer has 0.8 nodes to its thickness.
        let tolerance = if to_substrate < 10.0 { 4e-3 } else { 1e-2 };
        assert!(error.abs() < tolerance, "{thickness}, {ratios:?}: {error}");
        compared += 1;
    }
    assert!(compared > 30, "{compared}");
}

#[test]
fn round_spots_have_the_resistances_that_were_published() {
    for [thickness, ratio, to_counter_body, found] in spots() {
        if to_counter_body > 0.0 {
            continue;
        }
        if thickness >= 2.0 && ratio > 0.0 {
            // Dryden, J. Heat Transfer 105 (1983) 408: thick coatings.
            let expected = 1.0 - 2.0 * (2.0 / (1.0 + ratio)).ln() / (PI * thickness);
            assert!((found / expected - 1.0).abs() < 0.12 / thickness.powi(3), "{ratio}: {found}");
        }
        if thickness == 0.1 && ratio == 0.0 {
            // A thin layer on a perfect conductor conducts below a disc of radius a + 2 ln 2 t/π.
            let radius = 1.0 + 2.0 * LN_2 * thickness / PI;
            let expected = 4.0 * thickness / (PI * radius * radius);
            assert!((found / expected - 1.0).abs() < 1e-3, "{found}, {expected}");
        }
    }
}

#[test]
fn a_conductance_is_that_of_dense_algebra() {
    let nodes = 16;
    let grid = square(nodes, 1.0);
    let pressure = rough_contact(nodes, 0.1);
    let contact: Vec<usize> = (0..nodes * nodes).filter(|node| pressure[*node] > 0.0).collect();
    let (thickness, ratio, counter) = (0.04, 7.0, 0.3);
    let gamma = (ratio - 1.0) / (ratio + 1.0);
    // The potential at [x, y] of a unit flux at one node, as a sum over all waves.
    let waves = |index: usize| if index > nodes / 2 { nodes - index } else { index } as f64;
    let kernel = |x: usize, y: usize| -> f64 {
        let mut sum = 0.0;
        for k in (0..nodes * nodes).skip(1).map(|wave| [wave / nodes, wave % nodes]) {
            let q = 2.0 * PI * waves(k[0]).hypot(waves(k[1]));
            let image = gamma * (-2.0 * q * thickness).exp();
            let drop = ((1.0 + image) / (1.0 - image) + counter) * 2.0 / (q * (1.0 + counter));
            let turns = (k[0] * x + k[1] * y) as f64 / nodes as f64;
            sum += drop * (2.0 * PI * turns).cos();
        }
        sum / (nodes * nodes) as f64
    };
    let row = |one: &usize| -> Vec<f64> {
        let between = |other: &usize| {
            let [x, y] = [one / nodes + nodes - other / nodes, one % nodes + nodes - other % nodes];
            kernel(x % nodes, y % nodes)
        };
        contact.iter().map(between).chain([1.0]).collect()
    };
    let mut rows: Vec<Vec<f64>> = contact.iter().map(row).collect();
    let flux = eliminated(&mut rows);
    let expected = flux.iter().sum::<f64>() / (nodes * nodes) as f64;
    let found = conductance(grid, layer(thickness, ratio, counter), &pressure, &FINE);
    assert!(contact.len() > 20);
    assert!((found.stiffness / expected - 1.0).abs() < 1e-8, "{found:?}, {expected}");
}

/// Solves a positive definite system by elimination; the last element of a row is its right side.
fn eliminated(rows: &mut [Vec<f64>]) -> Vec<f64> {
    let count = rows.len();
    for pivot in 0..count {
        let (above, below) = rows.split_at_mut(pivot + 1);
        let own = &above[pivot];
        for row in below {
            let factor = row[pivot] / own[pivot];
            for (value, own) in row.iter_mut().zip(own).skip(pivot) {
                *value -= factor * own;
            }
        }
    }
    let mut solution = vec![0.0; count];
    for index in (0..count).rev() {
        let known: f64 = (index + 1..count).map(|of| rows[index][of] * solution[of]).sum();
        solution[index] = (rows[index][count] - known) / rows[index][index];
    }
    solution
}

#[test]
fn few_pairs_of_transforms_suffice_for_all_layers() {
    let grid = square(256, 1.0);
    for load in [0.02, 0.2] {
        let pressure = rough_contact(256, load);
        for thickness in [0.002, 0.01, 0.1] {
            for (ratio, counter) in [(0.0, 0.0), (0.01, 1.0), (10.0, 0.0), (1e4, 0.0), (1e4, 1e4)] {
                let layer = layer(thickness, ratio, counter);
                let usual = conductance(grid, layer, &pressure, &USUAL);
                let fine = conductance(grid, layer, &pressure, &FINE);
                assert!(usual.pairs <= 19 && fine.pairs <= 27, "{layer:?}: {usual:?}, {fine:?}");
                let error = usual.stiffness / fine.stiffness - 1.0;
                assert!(error.abs() < 1e-6, "{layer:?}: {error}");
            }
        }
    }
}

#[test]
fn full_contact_does_not_constrict_a_current() {
    let conductor = Conductor::new(&Threads::one(), square(16, 1.0), layer(0.1, 3.0, 0.0));
    let pressure = vec![1.0; 256];
    let found = conductor.conductance(Threads::one(), &pressure, &USUAL, &|| false);
    assert_eq!((found.stiffness, found.stop), (f64::INFINITY, Stop::FullContact));
}
