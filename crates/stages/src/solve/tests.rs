//! Tests of the rows of loads: they are independent of each other, of threads, and of the time at
//! which their parts are computed.

use std::f64::consts::PI;
use std::num::NonZeroUsize;
use std::path::Path;
use std::sync::Mutex;

use bytesize::ByteSize;

use super::*;
use crate::FinishedRows;
use crate::grids;
use crate::surface_files::SurfaceFiles;
use asperity_mechanics::elasticity::Support;
use asperity_mechanics::grid::Grid;
use asperity_mechanics::solver::{DEFAULT_PAIR_LIMIT, DEFAULT_TOLERANCE};
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::shapes::Shape;
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::store::StoreError;

/// Receiver that records the rows that a task keeps.
pub struct KeptRows {
    are_due: bool,
    rows: Mutex<Vec<(Vec<f64>, Table)>>,
}

impl KeptRows {
    pub fn never_due() -> KeptRows {
        KeptRows { are_due: false, rows: Mutex::default() }
    }

    pub fn always_due() -> KeptRows {
        KeptRows { are_due: true, ..KeptRows::never_due() }
    }

    pub fn rows(self) -> Vec<(Vec<f64>, Table)> {
        self.rows.into_inner().unwrap()
    }
}

impl FinishedRows for KeptRows {
    fn are_due(&self) -> bool {
        self.are_due
    }

    fn keep(&self, values: &[f64], rows: &Table) -> Result<(), StoreError> {
        self.rows.lock().unwrap().push((values.to_vec(), rows.clone()));
        Ok(())
    }
}

/// Returns the parameters of three elastic loads without parts.
pub fn params() -> Params {
    Params {
        effective_modulus: 3.0,
        control: Control::Load,
        load_unit: PressureUnit::Relative,
        newtons: None,
        loads: vec![0.02, 0.1, 0.3],
        tolerance: DEFAULT_TOLERANCE,
        max_pairs: DEFAULT_PAIR_LIMIT,
        pressures: Pressures::None,
        boundary: Boundary::Periodic,
        hardness: None,
        branch: None,
        pressure_bins: None,
        gap_bins: None,
        flow: false,
        stiffness: Stiffness::None,
        layer_conduction: None,
        layer: None,
        asperities: None,
        shift: None,
        pressure_unit: None,
        listed: ListedLoads::default(),
        bodies: Bodies::default(),
    }
}

fn params_with_parts() -> Params {
    Params {
        pressures: Pressures::All,
        pressure_bins: Some(EqualBins { count: 8, to: 2.5 }),
        gap_bins: Some(EqualBins { count: 6, to: 3.0 }),
        flow: true,
        stiffness: Stiffness::Loading,
        ..params()
    }
}

fn grid() -> Grid {
    Grid::square(32, 2.0).unwrap()
}

/// Returns the sum of waves in several directions.
pub fn surface() -> Surface {
    let grid = grid();
    let height = |node: usize| {
        let [x, y] = grid.indices(node).map(|index| 2.0 * PI * index as f64 / 32.0);
        0.1 * x.cos() + 0.07 * (2.0 * y + 1.0).cos() + 0.03 * (3.0 * x + 5.0 * y + 2.0).cos()
    };
    Surface::new(grid, (0..grid.count()).map(height).collect()).unwrap()
}

/// Returns the row of a surface with an rms slope of 0.7.
fn row() -> Table {
    let mut row = grids::coordinates(grid().nodes(), grid().cell().size());
    row.push((RMS_SLOPE, Value::Real(0.7)));
    Table::row(&row)
}

/// Solves the loads of `params` on `surface`.
pub fn solved_on(
    surface: Surface,
    params: &Params,
    threads: &Threads,
    stored: Option<&Table>,
) -> Table {
    let row = row();
    let context = Context {
        sources: &SurfaceFiles::new(Path::new("")),
        memory: ByteSize::gib(1),
        threads,
        interrupted: &|| false,
        finished: &KeptRows::never_due(),
        stored,
        reserve: &|_| true,
        advance: &|_| (),
    };
    let table = match params.asperities {
        Some(interaction) => asperities::solve(params, interaction, surface, &row, &context),
        None => contact::solve(params, surface, &row, &context),
    };
    table.unwrap()
}

fn solved(params: &Params) -> Table {
    solved_on(surface(), params, &Threads::one(), None)
}

fn columns_of_parts(params: &Params) -> Vec<&'static str> {
    let parts = params.series(None).unwrap().rows.parts;
    parts.into_iter().flat_map(|of| of.part.columns).collect()
}

/// Returns the parameters of contacts with all kinds of body and model.
fn all_models() -> [Params; 4] {
    let hardness = GivenHardness { pressure: 0.8, unit: PressureUnit::Relative };
    [
        params_with_parts(),
        Params {
            hardness: Some(hardness),
            stiffness: Stiffness::LoadingAndUnloading,
            ..params_with_parts()
        },
        Params { boundary: Boundary::Free, flow: false, ..params_with_parts() },
        Params { asperities: Some(Interaction::Explicit), pressures: Pressures::All, ..params() },
    ]
}

fn restricted(params: &Params, values: &[f64], wanted: impl Fn(&Part) -> bool) -> Params {
    match params.restricted(values, &wanted) {
        Some(Recipe::Solve(params)) => params.as_ref().clone(),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_load_solved_with_others_has_the_bytes_of_a_load_alone() {
    for params in all_models() {
        let together = solved(&params);
        for (row, load) in params.loads.iter().enumerate() {
            let alone = solved(&restricted(&params, &[*load], |_| true));
            assert_eq!(alone, together.pick(&[row]), "{params:?}");
        }
    }
}

#[test]
fn rows_are_the_same_on_any_number_of_threads() {
    for params in all_models() {
        let alone = solved(&params);
        for count in [2, 3] {
            let threads = Threads::new(NonZeroUsize::new(count).unwrap());
            assert_eq!(solved_on(surface(), &params, &threads, None), alone);
        }
    }
}

#[test]
fn a_sibling_needs_memory_and_none_is_needed_on_one_thread() {
    let params = params();
    let requests = |count: usize| {
        let threads = Threads::new(NonZeroUsize::new(count).unwrap());
        let requested = Mutex::new(Vec::new());
        let reserve = |bytes: u64| {
            requested.lock().unwrap().push(bytes);
            false
        };
        let context = Context {
            sources: &SurfaceFiles::new(Path::new("")),
            memory: ByteSize::gib(1),
            threads: &threads,
            interrupted: &|| false,
            finished: &KeptRows::never_due(),
            stored: None,
            reserve: &reserve,
            advance: &|_| (),
        };
        let table = contact::solve(&params, surface(), &row(), &context).unwrap();
        assert_eq!(table, solved(&params));
        requested.into_inner().unwrap()
    };
    assert!(requests(1).is_empty());
    // The calling thread asks before each load but the last one.
    let requested = requests(2);
    assert_eq!(requested.len(), 2);
    let nodes = grid().count() as f64;
    let solver = params.body(1.0).bytes_per_node(params.tolerance) * nodes;
    assert!(requested.iter().all(|bytes| *bytes > 0 && (*bytes as f64) < solver));
}

#[test]
fn a_stiff_coating_is_expected_to_take_more_pairs_on_a_larger_cell() {
    let support = Support::HalfSpace { poisson_ratio: 0.3, modulus_ratio: 20.0 };
    let layer = GivenLayer { thickness: 0.1, poisson_ratio: 0.3, support };
    let coated = Params { layer: Some(layer), ..params() };
    let pairs = |longer_side| {
        coated.effort(Extent { nodes: [512; 2], longer_side, rows: 3, tables: 1 }).pairs
            / coated.loads.len() as f64
    };
    // 15.7 and 33 pairs a load were counted for thicknesses of 0.2 and 0.005 sides.
    assert!((12.0..19.0).contains(&pairs(0.5)), "{}", pairs(0.5));
    assert!((26.0..41.0).contains(&pairs(20.0)), "{}", pairs(20.0));
}

#[test]
fn parts_from_stored_pressures_have_the_bytes_of_parts_computed_with_the_load() {
    let models = all_models().into_iter().filter(|params| params.asperities.is_none());
    for params in models {
        let whole = solved(&params);
        let computed = [&FLOW[..], &[PRESSURE_COUNTS, GAP_COUNTS]].concat();
        let computed: Vec<&str> = computed.iter().map(|column| column.name).collect();
        let stored = whole.without(&computed);
        let missing = restricted(&params, &params.loads, |part| *part != parts::pressures());
        let added = solved_on(surface(), &missing, &Threads::one(), Some(&stored));
        let names = [vec![LOAD.name], columns_of_parts(&missing)].concat();
        assert_eq!(added.names(), names);
        assert_eq!(added, whole.only(&names), "{params:?}");
    }
}

#[test]
fn every_load_in_full_contact_has_a_row() {
    let params = Params { loads: vec![20.0, 30.0], flow: true, ..params() };
    let wave = Shape::Wave { amplitude: 0.1, waves: 1 }.draw(grid());
    let table = solved_on(wave, &params, &Threads::one(), None);
    assert_eq!(table.integers(CONTACT_NODES.name).unwrap().values(), &[32 * 32; 2]);
    assert_eq!(table.reals(MEAN_GAP.name).unwrap().values(), &[0.0; 2]);
    assert_eq!(table.reals(FLOW_FACTOR_X.name).unwrap().values(), &[0.0; 2]);
    let stops: Vec<_> = table.texts(STOP.name).unwrap().iter().flatten().collect();
    assert_eq!(stops, ["full-contact"; 2]);
}

#[test]
fn the_table_without_rows_has_the_light_columns_in_the_order_of_the_table() {
    for params in all_models() {
        let surface = Table::empty(&[SURFACE]);
        let empty = params.empty_table(&[("surfaces".to_owned(), surface)]).unwrap();
        let table = solved(&params);
        let names: Vec<&str> =
            empty.names().into_iter().filter(|name| *name != SURFACE.name).collect();
        let own = table.only(&names);
        assert_eq!(own.names(), names);
        assert!(table.names().ends_with(&columns_of_parts(&params)));
    }
}

#[test]
fn a_series_names_its_loads_and_parts() {
    let params = Params {
        pressures: Pressures::At(vec![0.1]),
        load_unit: PressureUnit::Absolute,
        ..params_with_parts()
    };
    let Series { recipe, rows } = params.series(None).unwrap();
    assert_eq!((rows.column, &rows.values), ("pressure", &params.loads));
    let parts: Vec<_> = rows.parts.iter().map(|of| (&of.part.name[..], &of.values[..])).collect();
    let all = &params.loads[..];
    assert_eq!(
        parts,
        [
            ("flow_2", all),
            ("stiffness", all),
            ("pressures", &[0.1]),
            ("pressure_counts_8_2.5", all),
            ("gap_counts_6_3", all),
        ]
    );
    let keys = serde_json::to_value(&recipe).unwrap();
    for absent in ["loads", "flow", "stiffness", "pressure_bins", "gap_bins"] {
        assert!(keys.get(absent).is_none(), "{absent}");
    }
    let other = Params { loads: vec![0.5], ..super::tests::params() };
    let other = Params { load_unit: PressureUnit::Absolute, ..other };
    assert_eq!(other.series(None).unwrap().recipe, recipe);
}

#[test]
fn a_restricted_recipe_has_only_the_wanted_loads_and_parts() {
    let params = Params { pressures: Pressures::At(vec![0.1]), ..params_with_parts() };
    let wanted = restricted(&params, &[0.3], |part| part.name != "flow_2");
    assert_eq!(wanted.loads, [0.3]);
    assert_eq!(wanted.pressures, Pressures::None, "the pressures under this load are not stored");
    assert!(!wanted.flow && wanted.gap_bins.is_some() && wanted.pressure_bins.is_some());
    let none = restricted(&params, &params.loads, |_| false);
    assert_eq!(none, super::tests::params());
    assert!(none.identity_recipe().is_none());
    let identity = params.identity_recipe().unwrap();
    assert_eq!(identity, Recipe::Solve(Arc::new(none)));
}
