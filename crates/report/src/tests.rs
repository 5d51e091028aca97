//! Tests that code that groups rows into ensembles uses each row exactly once. Each test table has
//! two values of one coordinate (a column that identifies rows), and each coordinate is tested.

use std::collections::BTreeMap;

use crate::plotted::Points;
use asperity_claims::{Evidence, NOT_COMPARED, StageTable};
use asperity_manifest::expression::Expression;
use asperity_pipeline::study::claims::{DataSpec, Source};
use asperity_pipeline::study::figures::{FigureSpec, PanelSpec, Quantity};
use asperity_stages::aggregate::{self, Groups, Statistic};
use asperity_stages::columns::*;
use asperity_stages::ensemble::*;
use asperity_stages::fit::laws::{Law, PlainLaw};
use asperity_stages::{Kind, columns_of, fit};
use asperity_tables::column::{Column, ColumnKind, Role, Value, integers, reals, texts};
use asperity_tables::table::Table;

const TASK: Column = Column::result("task", ColumnKind::Text, "", "task");

/// Coordinates that rows of measured or corrected contacts do not have.
const ELSEWHERE: [&str; 7] =
    [BIN.name, ALONG.name, WAVENUMBER.name, LAG.name, DISTANCE.name, BEARING_LEVEL.name, "pooled"];

/// Returns all coordinates of measured or corrected contacts.
fn coordinates() -> Vec<Column> {
    let kinds = [Kind::Generate, Kind::Solve, Kind::Measure, Kind::Correct];
    let all = kinds.into_iter().flat_map(columns_of);
    all.filter(|column| column.role.is_coordinate() && !ELSEWHERE.contains(&column.name)).collect()
}

/// Returns one of two values of a coordinate: the first for `which` = 0, the second for 1.
fn value(column: &Column, which: usize) -> Value {
    let number = which as f64 + 1.0;
    match column.kind {
        ColumnKind::Real => Value::Real(0.25 * number),
        ColumnKind::Integer => Value::Integer(1 << which),
        _ => Value::Text(format!("{}-{which}", column.name)),
    }
}

/// Returns the cells of one row of a table with two surfaces and two loads, for either value of the
/// swept coordinate.
fn cells(swept: &Column, which: usize, surface: usize, load: usize) -> Vec<(Column, Value)> {
    let of = |column: &Column| {
        let which_value = match column.name {
            name if name == swept.name => which,
            "realization" => surface,
            "load" | "pressure" => load,
            _ => 0,
        };
        (*column, value(column, which_value))
    };
    coordinates().iter().map(of).collect()
}

/// Returns a table of measured and corrected contacts in which one coordinate has two values.
fn swept(column: &Column) -> Table {
    let states = [(0, 0), (0, 1), (1, 0), (1, 1)];
    let rows = [0, 1].map(|which| states.map(|(surface, load)| (which, surface, load))).concat();
    let tables = rows.iter().enumerate().map(|(row, &(which, surface, load))| {
        let coordinates = Table::row(&cells(column, which, surface, load));
        let area = 0.1 * (load + 1) as f64 + 0.01 * row as f64;
        coordinates.with(vec![
            (AREA_FRACTION, reals([area])),
            (AREA_CORRECTED, reals([area])),
            (SWITCHES, integers([10])),
            (STOP, texts(["converged"])),
            (TASK, texts([format!("{which}-{surface}")])),
        ])
    });
    Table::stack(&tables.collect::<Vec<_>>()).unwrap()
}

/// Returns the number of distinct combinations of surface, load and swept value among the eight
/// rows. If the realization or the load is swept, some rows are equal.
fn states(column: &Column) -> usize {
    match column.name {
        "realization" | "load" => 4,
        // The names of surfaces and coordinates in another unit follow from other coordinates.
        "surface" | "from_surface" | "against_surface" | "original_surface" => 4,
        _ if column.role == Role::Derived => 4,
        _ => 8,
    }
}

#[test]
fn every_coordinate_makes_ensembles_surfaces_or_loads_as_its_role_says() {
    for column in coordinates() {
        let table = swept(&column);
        let ensembles = ensembles(&table).unwrap();
        let standing: usize = ensembles.iter().map(|ensemble| ensemble.states().count()).sum();
        let repeated: usize = ensembles.iter().map(|ensemble| ensemble.repeated.len()).sum();
        assert_eq!(standing + repeated, table.rows(), "{}", column.name);
        assert_eq!(standing, states(&column), "{}", column.name);
        let expected = if column.role == Role::Parameter { 2 } else { 1 };
        assert_eq!(ensembles.len(), expected, "{}", column.name);
    }
}

#[test]
fn fits_take_every_row_once() {
    for column in coordinates() {
        let points = fit::CurvesOfPoint::areas(&swept(&column)).unwrap();
        let taken = points.iter().map(|point| {
            let curves = point.curves.as_ref().unwrap();
            curves.surfaces() * curves.loads().len()
        });
        assert_eq!(taken.sum::<usize>(), states(&column), "{}", column.name);
    }
}

#[test]
fn fits_over_meshes_take_every_row_once() {
    let params = fit::Params {
        law: Law::Plain(PlainLaw::MeshConvergence),
        window: [0.0, 10.0],
        bootstrap: 0,
        level: 0.9,
        seed: 1,
    };
    for column in coordinates() {
        let fitted = fit::fitted(&params, &swept(&column)).unwrap();
        let pooled = fitted.texts("pooled").unwrap();
        let single = pooled.iter().filter(|what| *what == Some("nothing")).count();
        // All meshes and corrections of a surface at a load enter one line.
        let varied = ["nodes", "nodes_x", "nodes_y", "correction", "coefficient"];
        let is_varied = varied.contains(&column.name);
        let expected = if is_varied { 4 } else { states(&column) };
        assert_eq!(single, expected, "{}", column.name);
    }
}

#[test]
fn aggregates_count_every_row_once() {
    let groups = Groups {
        group_by: None,
        over: vec![AREA_FRACTION.name.to_owned()],
        statistics: vec![Statistic::Mean],
        models: vec![],
    };
    for column in coordinates() {
        let reduced = aggregate::grouped(&swept(&column), &groups).unwrap();
        let counted: i64 = reduced.integers("count").unwrap().values().iter().sum();
        assert_eq!(counted as usize, states(&column), "{}", column.name);
    }
}

#[test]
fn figures_show_every_row_once() {
    for column in coordinates() {
        let table = swept(&column);
        let quantity = Quantity::find(&table, AREA_FRACTION.name, None).unwrap();
        let panel = PanelSpec { x: LOAD.name.to_owned(), ..PanelSpec::default() };
        let found = Points::from_table(&table, &FigureSpec::default(), &panel, &quantity).unwrap();
        let shown = found.points.iter().map(|point| point.surfaces.unwrap());
        assert_eq!(shown.sum::<usize>(), states(&column), "{}", column.name);
    }
}

#[test]
fn claims_take_every_row_once_or_name_it_as_left_out() {
    // All random surfaces have a method, by which claims leave nothing out.
    let left_out_of_claims: Vec<&str> =
        NOT_COMPARED.into_iter().filter(|name| *name != METHOD.name).collect();
    for column in coordinates() {
        // Coordinates of measured surfaces or shapes do not belong to spectra, so claims leave them
        // out, too.
        let [taken, left_out] = claimed(swept(&column).without(&left_out_of_claims));
        let expected = match column.name {
            "correction" | "coefficient" => 4,
            // Claims take squares, which have one number of nodes for both axes.
            "nodes_x" | "nodes_y" => 4,
            name if left_out_of_claims.contains(&name) => 4,
            _ => states(&column),
        };
        assert_eq!(taken + left_out, expected, "{}", column.name);
        assert_eq!(claimed(swept(&column)), [0, 8], "{}", column.name);
    }
}

/// Returns the numbers of rows that claims use and leave out.
fn claimed(contacts: Table) -> [usize; 2] {
    let contacts = contacts.without(&["correction", "coefficient"]);
    let finished = StageTable {
        name: "contacts".to_owned(),
        kind: Kind::Measure,
        table: contacts.with(vec![(CONTACT_NODES, integers(vec![1; 8]))]),
    };
    let evidence = Evidence::from_tables(vec![finished]).unwrap();
    let data = DataSpec {
        name: "area".to_owned(),
        label: String::new(),
        source: Source::Spectra(Kind::Measure),
        value: Expression::Column(AREA_FRACTION.name.to_owned()),
        selection: BTreeMap::new(),
        within: Vec::new(),
        otherwise: None,
        needs: None,
        needs_groups: None,
    };
    let groups = evidence.groups(&data).unwrap();
    let taken = groups.iter().map(|one| one.surfaces() * one.loads.len());
    let left_out = evidence.setting.left_out.iter().map(|left| left.rows);
    [taken.sum(), left_out.sum()]
}

#[test]
fn loads_that_differ_by_rounding_are_one_and_the_first_row_stands() {
    let computed = 0.06 * (2.0 / 6.0);
    let rows = [(0.02, 0.5), (0.04, 0.7), (computed, 0.6)];
    let table = Table::new(
        3,
        vec![
            (SURFACE, texts(["a"; 3])),
            (HURST, reals([0.8; 3])),
            (SEED, integers([1; 3])),
            (REALIZATION, integers([0; 3])),
            (LOAD, reals(rows.map(|row| row.0))),
            (AREA_FRACTION, reals(rows.map(|row| row.1))),
        ],
    );
    let [ensemble] = ensembles(&table).unwrap().try_into().unwrap();
    let loads = [computed, 0.04];
    assert_eq!(ensemble.loads, loads.map(|load| Load { given: load, reduced: load }));
    assert_eq!(ensemble.repeated, [2]);
    let once = without_repeated_rows(&table).unwrap();
    assert_eq!(once.reals("area_fraction").unwrap().values(), &[0.5, 0.7]);
}

#[test]
fn surfaces_of_two_seeds_are_of_one_ensemble() {
    let seed = coordinates().into_iter().find(|column| column.name == "seed").unwrap();
    let [ensemble] = ensembles(&swept(&seed)).unwrap().try_into().unwrap();
    assert_eq!(ensemble.members.len(), 4);
}
