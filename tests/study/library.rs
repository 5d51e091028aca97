//! Contacts of the crate `asperity-contact` beside those of stages, to the last bit.

use asperity::contact::{
    Adhesion, AdhesiveContact, Contact, EnergyPerArea, Grid, Layer, Length, Material, Pressure,
    RandomSurface, Spectrum, Surface,
};
use asperity::direct::{Map, Pressing, draw};

use crate::bench::{Bench, real};
use crate::manifest::manifest;

/// Presses the surface of [`surface`] by the keys of a `solve` stage.
fn pressing(keys: &str) -> Pressing {
    let surface = "nodes = 64\nside = 1e-4\nhurst = 0.8\nk_lower = 2\nk_upper = 16\n\
                   rms_slope = 0.1\nseed = 1";
    let drawn = draw(&surface.parse().unwrap(), 3).unwrap();
    let map = Map {
        surface: drawn.surface,
        unit: drawn.unit,
        rms_slope: Some(drawn.rms_slope),
        is_periodic: drawn.is_periodic,
    };
    let keys = format!("effective_modulus = 1e11\nload_unit = \"absolute\"\n{keys}");
    let mut pressing = Pressing::new(map, &keys.parse().unwrap()).unwrap();
    while pressing.press(&|| false).unwrap() {}
    pressing
}

fn surface() -> Surface {
    let grid = Grid::square(64, Length::micrometres(100.0)).unwrap();
    let spectrum = Spectrum::new(0.8, 2..=16).unwrap();
    RandomSurface::with_rms_slope(spectrum, 0.1).seed(1).realization(3).draw(grid).unwrap()
}

fn elastic() -> Material {
    Material::elastic(Pressure::gigapascals(100.0)).unwrap()
}

fn metres(lengths: &[Length]) -> Vec<f64> {
    lengths.iter().map(|length| length.in_metres()).collect()
}

fn pascals(pressures: &[Pressure]) -> Vec<f64> {
    pressures.iter().map(|pressure| pressure.in_pascals()).collect()
}

#[test]
fn contacts_of_the_library_are_those_of_a_solve_stage() {
    let hard = elastic().hardness(Pressure::gigapascals(3.0)).unwrap();
    let layer = elastic().layer(Layer::bonded(Length::micrometres(2.0), 0.3).unwrap());
    let periodic = |material| Contact::periodic(&surface(), material).unwrap();
    let cases = [
        ("", periodic(elastic())),
        ("hardness = 3e9", periodic(hard)),
        ("layer = { thickness = 2e-6, poisson_ratio = 0.3, base = \"bonded\" }", periodic(layer)),
        ("boundary = \"free\"", Contact::isolated(&surface(), elastic()).unwrap()),
    ];
    for (keys, contact) in cases {
        let mut pressing = pressing(&format!("{keys}\nloads = [1e7, 3e8, 1e9]"));
        let table = pressing.table().unwrap();
        for (load, megapascals) in [10.0, 300.0, 1000.0].into_iter().enumerate() {
            let pressed = contact.press(Pressure::megapascals(megapascals)).unwrap();
            let real = |column: &str| table.reals(column).unwrap().value(load);
            assert_eq!(pressed.load().value(), real("load"), "{keys}");
            assert_eq!(pressed.mean_gap().in_metres(), real("mean_gap"), "{keys}");
            assert_eq!(pressed.peak_pressure().in_pascals(), real("peak_pressure"), "{keys}");
            let energy = pressed.elastic_energy().in_joules_per_square_metre();
            assert_eq!(energy, real("energy"), "{keys}");
            assert_eq!(pascals(&pressed.pressures()), pressing.pressure(load).unwrap(), "{keys}");
            assert_eq!(metres(&pressed.gaps()), pressing.gap(load).unwrap(), "{keys}");
            let displacements = metres(&pressed.displacements());
            assert_eq!(displacements, pressing.displacement(load).unwrap(), "{keys}");
            assert_eq!(pressed.contact_map(), pressing.contact(load).unwrap(), "{keys}");
        }
    }
}

#[test]
fn flows_of_the_library_are_those_of_a_solve_stage() {
    let bench = Bench::new();
    let study = manifest("leaking", "seed = 1")
        .generate(
            "surfaces",
            "nodes = 64; side = 1e-4; hurst = 0.8; k_lower = 2; k_upper = 16; rms_slope = 0.1; \
             realizations = 4",
        )
        .solve(
            "contact",
            "effective_modulus = 1e11; load_unit = 'absolute'; loads = [1e8, 1e9]; \
             hardness = 5e9; flow = true",
        );
    bench.run(&study.text());
    let table = bench.table("leaking", "contact");
    let material = elastic().hardness(Pressure::gigapascals(5.0)).unwrap();
    let contact = Contact::periodic(&surface(), material).unwrap();
    for (load, pascals) in [1e8, 1e9].into_iter().enumerate() {
        let flow = contact.press(Pressure::pascals(pascals)).unwrap().flow().unwrap();
        // The rows of realization 3.
        let real = |column: &str| real(&table, column, 6 + load);
        let columns = ["flow_conductivity_x", "flow_conductivity_y"].map(real);
        assert_eq!(flow.conductivities(), columns);
        assert_eq!(flow.flow_factors(), ["flow_factor_x", "flow_factor_y"].map(real));
    }
}

#[test]
fn states_of_the_library_are_those_of_a_path_with_adhesion() {
    let work = EnergyPerArea::joules_per_square_metre(0.5);
    let adhesion = Adhesion::new(work, Length::nanometres(200.0)).unwrap();
    let mut contact = AdhesiveContact::periodic(&surface(), elastic(), adhesion).unwrap();
    let keys = "adhesion = { work = 0.5, range = 2e-7 }\nloads = [1e6, 1e8, 1e6, -1e8]";
    let mut pressing = pressing(keys);
    let table = pressing.table().unwrap();
    for (state, pascals_of_state) in [1e6, 1e8, 1e6, -1e8].into_iter().enumerate() {
        let found = contact.press(Pressure::pascals(pascals_of_state)).unwrap();
        assert_eq!(pascals(found.pressures()), pressing.pressure(state).unwrap());
        let real = |column: &str| table.reals(column).unwrap().iter().nth(state).flatten();
        assert_eq!(found.mean_gap().map(Length::in_metres), real("mean_gap"));
        assert_eq!(found.gaps().map(metres), real("mean_gap").and(pressing.gap(state)));
        let energy = found.elastic_energy().map(EnergyPerArea::in_joules_per_square_metre);
        assert_eq!(energy, real("elastic_energy"));
        let pull_off = found.pull_off_pressure().map(Pressure::in_pascals);
        assert_eq!(pull_off, real("pull_off_pressure"));
        assert_eq!(Some(found.repulsive_fraction()), real("repulsive_fraction"));
        assert_eq!(found.is_apart(), state == 3);
    }
}
