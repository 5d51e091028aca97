//! Regression of the contact area over several meshes of the same surfaces.
//!
//! The table has three kinds of rows: for one surface under one load, for all surfaces of a
//! parameter point under one load, and for all surfaces under all loads. The mesh is not part of
//! the parameter point.

use std::collections::BTreeMap;
use std::sync::Arc;

use arrow::array::{ArrayRef, Int64Array};

use super::fitted_point::FittedPoint;
use super::{Params, rows};
use crate::columns::{
    AREA_FRACTION, COEFFICIENT, CORRECTION, LOAD, NODES, NODES_X, NODES_Y, REALIZATION, SEED,
    SWITCHES, codes, columns, parameter_text, real,
};
use crate::ensemble::{self, Member, ensembles};
use crate::grids;
use asperity_mechanics::morphology::area::{PI_OVER_EIGHT, YASTREBOV_2017, edge_fraction};
use asperity_statistics::mesh_convergence::{MeshProblem, Refinement};
use asperity_statistics::{FitError, Window};
use asperity_tables::column::{Column, Role, optional_reals, texts};
use asperity_tables::table::{Table, TableError};

/// Parameters in which the rows of a point may differ: the mesh, and the correction of areas. The
/// regression uses the counted areas, which do not depend on the correction.
const VARIED: [&str; 5] =
    [NODES.name, NODES_X.name, NODES_Y.name, CORRECTION.name, COEFFICIENT.name];

const ALONE: &str = "nothing";
const OVER_SURFACES: &str = "surfaces";
const OVER_SURFACES_AND_LOADS: &str = "surfaces and loads";

columns! {
    /// rows that share the coefficient
    const POOLED: Column = parameter_text("pooled").with_codes(codes![
        /// one surface under one load has its own coefficient
        ALONE,
        /// all surfaces of the parameter point under one load share a coefficient
        OVER_SURFACES,
        /// all surfaces of the parameter point under all loads share a coefficient
        OVER_SURFACES_AND_LOADS,
    ]);
    /// A*: area fraction on an infinitely fine mesh; for pooled rows its mean over surfaces and
    /// loads
    const AREA_LIMIT: Column = real("area_limit", "1");
    /// root mean square error of the area fraction without correction, relative to A*
    const ERROR_NONE: Column = real("error_none", "1");
    /// root mean square error of the area fraction after the correction by π/8, relative to A*
    const ERROR_PI_8: Column = real("error_pi_8", "1");
    /// root mean square error of the area fraction after the correction `2017`, relative to A*
    const ERROR_2017: Column = real("error_2017", "1");
    /// root mean square error of the area fraction after the fitted correction, relative to A*
    const ERROR_FITTED: Column = real("error_fitted", "1");
}

/// Columns that only this law has.
pub const COLUMNS: [Column; 6] =
    [POOLED, AREA_LIMIT, ERROR_NONE, ERROR_PI_8, ERROR_2017, ERROR_FITTED];

/// Area and edge fractions of one surface under one load, by number of nodes along x and y.
type Meshes = BTreeMap<[usize; 2], (f64, f64)>;

/// Surface, and the bits of the load in the unit of the manifest. The bits of positive numbers have
/// the same order as the numbers.
type State = (Member, u64);

/// Areas of one parameter point on several meshes, by surface and load.
pub struct RefinementsOfPoint {
    /// Index of the table row from which the parameters of the point are copied.
    pub row: usize,
    refinements: BTreeMap<State, Result<Refinement, FitError>>,
    /// Reduced loads, by the bits of the load in the unit of the manifest.
    reduced: BTreeMap<u64, f64>,
}

/// Row of the table of fits.
struct MeshRow {
    point: usize,
    member: Option<Member>,
    load: Option<f64>,
    pooled: &'static str,
    limit: Option<f64>,
    errors: [Option<f64>; 4],
    surfaces: usize,
    fit: FittedPoint,
}

/// Fits the mesh error at every parameter point: for each surface and load, for all surfaces at
/// each load, and for all surfaces and loads together.
///
/// # Errors
/// Returns an error if the input lacks the columns of measured contacts.
pub fn run(table: &Table, params: &Params) -> Result<Table, TableError> {
    let mut lines = Vec::new();
    for point in refinements(table, params.window())? {
        let keys = || point.refinements.keys();
        for &(member, load) in keys() {
            let line = point.line(|state| state == (member, load), ALONE, params);
            lines.push(MeshRow { member: Some(member), load: Some(point.reduced[&load]), ..line });
        }
        let mut loads: Vec<u64> = keys().map(|&(_, load)| load).collect();
        loads.sort_unstable();
        loads.dedup();
        for load in loads {
            lines.push(MeshRow {
                load: Some(point.reduced[&load]),
                ..point.line(|state| state.1 == load, OVER_SURFACES, params)
            });
        }
        lines.push(point.line(|_| true, OVER_SURFACES_AND_LOADS, params));
    }
    Ok(as_table(table, params, &lines))
}

/// Groups measured contacts by parameter point, surface and load, and compares the meshes of each
/// group. Loads outside the window are left out.
///
/// # Errors
/// Returns an error if the table lacks the columns of measured contacts.
pub fn refinements(table: &Table, window: Window) -> Result<Vec<RefinementsOfPoint>, TableError> {
    let areas = table.reals(AREA_FRACTION.name)?;
    let (grids, switches) = (grids::Meshes::new(table)?, table.integers(SWITCHES.name)?);
    let mut order: Vec<ensemble::ParameterPoint> = Vec::new();
    let mut points: Vec<(RefinementsOfPoint, BTreeMap<State, Meshes>)> = Vec::new();
    for ensemble in ensembles(table)? {
        let point = ensemble.point.clone().without(&VARIED);
        let known = order.iter().position(|other| *other == point);
        let index = known.unwrap_or(order.len());
        if known.is_none() {
            order.push(point);
            let (refinements, reduced) = (BTreeMap::new(), BTreeMap::new());
            let found = RefinementsOfPoint { row: ensemble.first, refinements, reduced };
            points.push((found, BTreeMap::new()));
        }
        let (found, states) = &mut points[index];
        for (member, load, row) in ensemble.states() {
            if window.contains(load.reduced) {
                let given = load.given.to_bits();
                found.reduced.entry(given).or_insert(load.reduced);
                let nodes = grids.nodes(row);
                let edge = edge_fraction(switches.value(row).unsigned_abs() as usize, nodes);
                // Rows with different corrections have the same counted area.
                let mesh = states.entry((member, given)).or_default().entry(nodes);
                mesh.or_insert((areas.value(row), edge));
            }
        }
    }
    let refined = |(found, states): (RefinementsOfPoint, BTreeMap<State, Meshes>)| {
        let refinements = states.into_iter().map(|(state, meshes)| {
            let (areas, edges) = meshes.into_values().unzip();
            (state, Refinement::new(edges, areas))
        });
        RefinementsOfPoint { refinements: refinements.collect(), ..found }
    };
    Ok(points.into_iter().map(refined).collect())
}

impl RefinementsOfPoint {
    /// Returns [Cov(A, S_d Δx), Var(S_d Δx)], each with one entry per surface. These moments
    /// determine the common coefficient c of A_N = A* + c S_d Δx. Returns `None` if the point has
    /// no valid refinement.
    pub fn moments(&self) -> Option<[Vec<f64>; 2]> {
        let mut surfaces: BTreeMap<Member, Vec<&Refinement>> = BTreeMap::new();
        for (&(member, _), refinement) in &self.refinements {
            surfaces.entry(member).or_default().extend(refinement);
        }
        surfaces.retain(|_, refinements| !refinements.is_empty());
        let problem = MeshProblem::new(surfaces.into_values().collect());
        let (covariances, variances): (Vec<f64>, Vec<f64>) = problem.moments().into_iter().unzip();
        (!variances.is_empty()).then_some([covariances, variances])
    }

    /// Fits one coefficient to all refinements for which `belongs` is true. Invalid refinements are
    /// left out.
    fn line(
        &self,
        belongs: impl Fn(State) -> bool,
        pooled: &'static str,
        params: &Params,
    ) -> MeshRow {
        let mut surfaces: BTreeMap<Member, Vec<&Refinement>> = BTreeMap::new();
        let mut failure = None;
        let own = self.refinements.iter().filter(|&(&state, _)| belongs(state));
        for (&(member, _), refinement) in own {
            match refinement {
                Ok(refinement) => surfaces.entry(member).or_default().push(refinement),
                Err(error) => failure = Some(error),
            }
        }
        let empty = MeshRow {
            point: self.row,
            member: None,
            load: None,
            pooled,
            limit: None,
            errors: [None; 4],
            surfaces: surfaces.len(),
            fit: FittedPoint::default(),
        };
        if surfaces.is_empty() {
            let window = params.window();
            let nothing = FitError::TooFew { window, found: 0, needed: 2 };
            return MeshRow { fit: FittedPoint::failed(failure.unwrap_or(&nothing)), ..empty };
        }
        let problem = MeshProblem::new(surfaces.into_values().collect());
        let coefficient = problem.coefficient();
        let corrections = [0.0, PI_OVER_EIGHT, YASTREBOV_2017, coefficient];
        MeshRow {
            limit: Some(problem.mean_limit(coefficient)),
            errors: corrections.map(|correction| Some(problem.rms_error(correction))),
            fit: FittedPoint {
                values: vec![coefficient],
                data: problem.data(),
                ..FittedPoint::from_intervals(problem.bootstrap(&params.bootstrap()))
            },
            ..empty
        }
    }
}

fn as_table(input: &Table, params: &Params, lines: &[MeshRow]) -> Table {
    let of_points: Vec<usize> = lines.iter().map(|line| line.point).collect();
    let real = |column: Column, value: &dyn Fn(&MeshRow) -> Option<f64>| {
        (column, optional_reals(lines.iter().map(value)))
    };
    let whole = |value: fn(Member) -> Option<i64>| -> ArrayRef {
        let values = lines.iter().map(|line| line.member.and_then(value));
        Arc::new(values.collect::<Int64Array>())
    };
    let pooled = texts(lines.iter().map(|line| line.pooled));
    let fits: Vec<&FittedPoint> = lines.iter().map(|line| &line.fit).collect();
    let surfaces: Vec<usize> = lines.iter().map(|line| line.surfaces).collect();
    let [law, estimates, quality] = rows::columns_of_fits(params, &surfaces, &fits);
    let mut columns = law;
    columns.push((POOLED, pooled));
    if input.has(REALIZATION.name) {
        columns.push((SEED, whole(Member::seed)));
        columns.push((REALIZATION, whole(Member::realization)));
    }
    columns.push(real(LOAD, &|line| line.load));
    columns.extend(estimates);
    columns.push(real(AREA_LIMIT, &|line| line.limit));
    let errors = [ERROR_NONE, ERROR_PI_8, ERROR_2017, ERROR_FITTED];
    for (index, column) in errors.into_iter().enumerate() {
        columns.push(real(column, &|line| line.errors[index]));
    }
    // The errors above describe the quality; a coefficient of determination over meshes would not.
    columns.extend(quality);
    let coordinates = input.in_role(Role::Parameter).without(&VARIED);
    let table = coordinates.pick(&of_points).with(columns);
    table.without(&["rms_residual", "r_squared", "reduced_chi_square"])
}

#[cfg(test)]
mod tests {
    //! Fits of surfaces whose area on each mesh is known.

    use arrow::array::Array;

    use super::*;
    use crate::fit::laws::{Law, PlainLaw};
    use asperity_tables::column::{ColumnKind, integers, reals};

    const HURST: Column = Column::parameter("hurst", ColumnKind::Real, "1", "Hurst exponent");

    /// Returns two surfaces under two loads on three meshes, with A_N = A* + 0.1 S_d Δx, A* = load
    /// × (2 + r), and S_d Δx = 10/nodes.
    fn table() -> Table {
        let rows: Vec<(i64, i64, f64)> = [64, 128, 256]
            .into_iter()
            .flat_map(|nodes| {
                [(0, 0.1), (0, 0.2), (1, 0.1), (1, 0.2)].map(|(r, load)| (nodes, r, load))
            })
            .collect();
        let area =
            |&(nodes, r, load): &(i64, i64, f64)| load * (2 + r) as f64 + 0.1 * 10.0 / nodes as f64;
        Table::new(
            rows.len(),
            vec![
                (NODES, integers(rows.iter().map(|row| row.0))),
                (HURST, reals(vec![0.8; rows.len()])),
                (REALIZATION, integers(rows.iter().map(|row| row.1))),
                (LOAD, reals(rows.iter().map(|row| row.2))),
                (AREA_FRACTION, reals(rows.iter().map(area))),
                (SWITCHES, integers(rows.iter().map(|row| 10 * row.0))),
            ],
        )
    }

    fn params() -> Params {
        Params {
            law: Law::Plain(PlainLaw::MeshConvergence),
            window: [0.0, 10.0],
            bootstrap: 20,
            level: 0.9,
            seed: 1,
        }
    }

    #[test]
    fn every_surface_and_load_is_fitted_alone_and_pooled() {
        let fitted = run(&table(), &params()).unwrap();
        let pooled: Vec<_> = fitted.texts("pooled").unwrap().iter().flatten().collect();
        let expected = [["nothing"; 4].as_slice(), &["surfaces"; 2], &["surfaces and loads"]];
        assert_eq!(pooled, expected.concat());
        let coefficients = fitted.reals("mesh_coefficient").unwrap();
        for coefficient in coefficients.iter().flatten() {
            assert!((coefficient - 0.1).abs() < 1e-13, "{coefficient}");
        }
        let limits: Vec<f64> = fitted.reals("area_limit").unwrap().iter().flatten().collect();
        for (found, exact) in limits.iter().zip([0.2, 0.4, 0.3, 0.6, 0.25, 0.5, 0.375]) {
            assert!((found - exact).abs() < 1e-14, "{found} {exact}");
        }
        assert!(!fitted.has("nodes"));
    }

    #[test]
    fn the_mesh_is_not_part_of_a_point_and_pooled_rows_have_no_realization() {
        let fitted = run(&table(), &params()).unwrap();
        assert_eq!(fitted.rows(), 7);
        let numbers = fitted.integers("realization").unwrap();
        let numbers: Vec<_> = numbers.iter().collect();
        assert_eq!(numbers[..4], [Some(0), Some(0), Some(1), Some(1)]);
        assert_eq!(numbers[4..], [None; 3]);
        assert_eq!(fitted.reals("load").unwrap().null_count(), 1);
    }

    #[test]
    fn corrections_have_the_expected_order_of_errors() {
        let fitted = run(&table(), &params()).unwrap();
        let last = |name: &str| fitted.reals(name).unwrap().value(6);
        assert!(last("error_fitted") < 1e-13);
        assert!(last("error_2017") < last("error_none") && last("error_none") < last("error_pi_8"));
    }

    #[test]
    fn a_single_mesh_gives_a_row_with_a_failure() {
        let one = table().pick(&[0, 1, 2, 3]);
        let fitted = run(&one, &params()).unwrap();
        let status = fitted.texts("status").unwrap();
        assert!(status.iter().flatten().all(|text| text == "too-few-meshes"));
        assert_eq!(fitted.reals("mesh_coefficient").unwrap().null_count(), 7);
    }
}
