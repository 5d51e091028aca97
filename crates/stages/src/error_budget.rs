//! Budgets of the errors of means over surfaces: sampling, mesh, cell and solver.
//!
//! The mean on a mesh is an estimate of the mean over infinitely many surfaces, on an infinitely
//! fine mesh, in an infinitely large cell, with an exact solver. Each difference is a term with an
//! interval of its own. Sampling scatters around zero. The other terms are biases, which more
//! surfaces do not reduce, so there is no sum.

use std::collections::{BTreeMap, BTreeSet};

use arrow::datatypes::DataType;

use crate::aggregate::numbers;
use crate::columns::{
    AREA_CORRECTED, AREA_FRACTION, COEFFICIENT, K_LOWER, K_ROLLOFF, K_UPPER, NODES, NODES_X,
    NODES_Y, PERIMETER_EUCLIDEAN, PERIMETER_MANHATTAN, SIDE, SIDE_X, SIDE_Y, STOP, TOLERANCE,
    WORK_OF_ADHESION,
};
use crate::ensemble::{
    Ensemble, Load, Member, ParameterPoint, ensembles, load_column, prescribed_length,
};
use crate::solve::is_unconverged;
use asperity_manifest::decimal;
use asperity_mechanics::solver::DEFAULT_TOLERANCE;
use asperity_statistics::differences::MeanDifference;
use asperity_statistics::discretization::{DiscretizationError, Sampling};
use asperity_statistics::intervals::LEVEL;
use asperity_statistics::multilevel::MultilevelMean;
use asperity_tables::column::{Description, Role, Value};
use asperity_tables::table::{Table, TableError};

/// Columns that identify the mesh of a surface.
pub const MESH: [&str; 3] = [NODES.name, NODES_X.name, NODES_Y.name];
/// Columns that count waves or nodes along the side of the cell.
const PER_SIDE: [&str; 6] =
    [K_LOWER.name, K_ROLLOFF.name, K_UPPER.name, NODES.name, NODES_X.name, NODES_Y.name];
const SIDES: [&str; 3] = [SIDE.name, SIDE_X.name, SIDE_Y.name];
/// Greatest number of meshes or cells beside that of the mean.
const MOST_SIZES: usize = 3;
/// Largest share of the nodes by which contacts at [`DEFAULT_TOLERANCE`] differ from converged
/// ones.
const WRONG_NODES: f64 = 2e-6;

/// Errors of the means of a column at one parameter point.
#[derive(Debug, Clone)]
pub struct ErrorBudget {
    /// Parameters of the surfaces of the means.
    pub point: ParameterPoint,
    /// Surfaces of the means. A multilevel mean has those of all its meshes, the finest last.
    pub ensembles: Vec<Ensemble>,
    pub loads: Vec<LoadBudget>,
}

/// Errors of the mean at one load.
#[derive(Debug, Clone)]
pub struct LoadBudget {
    pub load: Load,
    /// Number of surfaces on the mesh of the mean.
    pub surfaces: usize,
    /// The mean, with the standard error of sampling.
    pub mean: MeanDifference,
    /// Error of the mesh; `None` if there is no other mesh with two of the surfaces.
    pub mesh: Option<SizeError>,
    /// Error of the cell; `None` if there is no other cell with as many waves and nodes per length.
    pub cell: Option<SizeError>,
    /// Error of the solver; `None` if it is not known.
    pub solver: Option<SolverError>,
}

/// Error of the mesh or of the cell.
#[derive(Debug, Clone)]
pub struct SizeError {
    pub found: DiscretizationError,
    /// Numbers of nodes per side, or smallest wavenumbers, from which the error is computed.
    pub sizes: Vec<f64>,
    /// Number of surfaces of each size.
    pub surfaces: Vec<usize>,
    /// Number of nodes per side of the mesh on which the error of the cell is computed, if it is
    /// not that of the mean.
    pub on_mesh: Option<f64>,
}

/// Error of the solver.
#[derive(Debug, Clone, Copy)]
pub enum SolverError {
    /// Mean minus that with a smaller tolerance.
    Difference { error: MeanDifference, tolerance: f64 },
    /// Bound of the magnitude.
    Bound(f64),
}

/// Term of a budget.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Term {
    Sampling,
    Mesh,
    Cell,
    Solver,
}

impl Term {
    pub const ALL: [Term; 4] = [Term::Sampling, Term::Mesh, Term::Cell, Term::Solver];

    pub fn name(self) -> &'static str {
        match self {
            Term::Sampling => "sampling",
            Term::Mesh => "mesh",
            Term::Cell => "cell",
            Term::Solver => "solver",
        }
    }
}

impl LoadBudget {
    /// Returns the error of the mean with its 95 % interval. The error of sampling is zero within
    /// its interval. Returns `None` if the term is unknown.
    pub fn error(&self, term: Term) -> Option<(f64, [f64; 2])> {
        let with_interval = |error: &MeanDifference| (error.value, error.interval(LEVEL));
        let of_size = |size: &SizeError| (size.found.error.value, size.found.interval(LEVEL));
        match term {
            Term::Sampling => Some(with_interval(&MeanDifference { value: 0.0, ..self.mean }))
                .filter(|_| self.surfaces > 1),
            Term::Mesh => Some(of_size(self.mesh.as_ref()?)),
            Term::Cell => Some(of_size(self.cell.as_ref()?)),
            Term::Solver => Some(match self.solver.as_ref()? {
                SolverError::Difference { error, .. } => with_interval(error),
                SolverError::Bound(bound) => (0.0, [-bound, *bound]),
            }),
        }
    }

    /// Returns the largest term: sampling with half of its interval, a bias whose interval excludes
    /// zero with its magnitude, or a bound. Other biases are not known to exist.
    pub fn largest(&self) -> Option<Term> {
        let size = |term: Term| {
            let (value, [lower, upper]) = self.error(term)?;
            let is_known = lower > 0.0 || upper < 0.0;
            Some(if is_known { value.abs() } else { upper }).filter(|_| is_known || value == 0.0)
        };
        let known = Term::ALL.into_iter().filter_map(|term| Some((term, size(term)?)));
        known.max_by(|(_, one), (_, other)| one.total_cmp(other)).map(|(term, _)| term)
    }
}

/// Computes the budgets of the means of a column, whose rows are surfaces under loads.
///
/// Of the meshes of a parameter point, the one with most surfaces has the mean, and of several the
/// finest. A multilevel mean is that of the finest mesh.
///
/// # Errors
/// Returns an error if the column does not hold numbers.
pub fn budgets(
    table: &Table,
    column: &str,
    is_multilevel: bool,
) -> Result<Vec<ErrorBudget>, TableError> {
    let study = Ensembles::new(table, column)?;
    let mut by_point: BTreeMap<ParameterPoint, Vec<usize>> = BTreeMap::new();
    for (index, ensemble) in study.all.iter().enumerate() {
        let common = ensemble.point.clone().without(&MESH).without(&[TOLERANCE.name]);
        by_point.entry(common.without(&[COEFFICIENT.name])).or_default().push(index);
    }
    let budgets = by_point.into_values().map(|group| study.budget(&group, is_multilevel));
    Ok(budgets.filter(|budget| !budget.loads.is_empty()).collect())
}

/// Ensembles of a table with the values of a column.
struct Ensembles {
    all: Vec<Ensemble>,
    values: Vec<Option<f64>>,
    /// Parameters in units of the longest wavelength, without the size of the cell.
    in_wavelengths: Vec<Option<ParameterPoint>>,
    /// Factors that convert values to units of the longest wavelength; `None` if the unit of the
    /// column is unknown.
    to_wavelengths: Vec<Option<f64>>,
    /// True if the column is a fraction of the nodes.
    counts_nodes: bool,
    /// True if the column is a number or a length of all that is in the cell, which grows with the
    /// cell, and a number of nodes also with the mesh.
    is_sum_over_cell: bool,
    /// Whether the load of each row did not converge.
    unconverged: Vec<bool>,
}

impl Ensembles {
    fn new(table: &Table, column: &str) -> Result<Ensembles, TableError> {
        let all = ensembles(table)?;
        let lengths = lengths(table);
        let has_gaps = prescribed_length(load_column(table)).is_some();
        let in_wavelengths = all.iter().map(|ensemble| {
            (!has_gaps).then(|| in_wavelengths(&ensemble.point, &lengths)).flatten()
        });
        let schema = table.batch().schema();
        let field = schema.field_with_name(column).ok();
        let unit = field.map(|field| Description::from(field).unit).unwrap_or_default();
        let to_wavelengths = all.iter().map(|ensemble| to_wavelengths(&ensemble.point, &unit));
        Ok(Ensembles {
            to_wavelengths: to_wavelengths.collect(),
            in_wavelengths: in_wavelengths.collect(),
            values: numbers(table, column)?,
            counts_nodes: [AREA_FRACTION.name, AREA_CORRECTED.name].contains(&column),
            is_sum_over_cell: field.is_some_and(|field| *field.data_type() == DataType::Int64)
                || [PERIMETER_EUCLIDEAN.name, PERIMETER_MANHATTAN.name].contains(&column),
            unconverged: match table.has(STOP.name) {
                true => {
                    let stops = table.texts(STOP.name)?;
                    stops.iter().map(|stop| stop.is_some_and(is_unconverged)).collect()
                }
                false => vec![false; table.rows()],
            },
            all,
        })
    }

    fn budget(&self, group: &[usize], is_multilevel: bool) -> ErrorBudget {
        let nodes = |ensemble: usize| nodes_per_side(&self.all[ensemble].point);
        let rank = |&&ensemble: &&usize| {
            let surfaces = if is_multilevel { 0 } else { self.all[ensemble].members.len() };
            let tolerance = number(&self.all[ensemble].point, TOLERANCE.name).unwrap_or(0.0);
            // Positive numbers have the order of their bits.
            (surfaces, nodes(ensemble).to_bits(), tolerance.to_bits())
        };
        let target = *group.iter().max_by_key(rank).expect("a group has an ensemble");
        let is_equal = |name: &str, other: usize| {
            self.all[other].point.get(name) == self.all[target].point.get(name)
        };
        let is_on_mesh = |other: usize| MESH.iter().all(|name| is_equal(name, other));
        let mut meshes: Vec<usize> =
            group.iter().copied().filter(|&other| is_equal(TOLERANCE.name, other)).collect();
        meshes.sort_by(|&one, &other| nodes(one).total_cmp(&nodes(other)));
        meshes.dedup_by_key(|ensemble| nodes(*ensemble).to_bits());
        let on_mesh = group.iter().copied().filter(|&other| other != target && is_on_mesh(other));
        let tolerance = |ensemble: usize| number(&self.all[ensemble].point, TOLERANCE.name);
        let precise = on_mesh
            .filter(|&other| tolerance(other) < tolerance(target))
            .min_by(|&one, &other| tolerance(one).partial_cmp(&tolerance(other)).expect("numbers"));
        let levels = if is_multilevel { meshes.clone() } else { vec![target] };
        let loads = self.all[target].loads.iter().filter_map(|&load| {
            let (surfaces, mean) = self.mean(&levels, load)?;
            // Each mesh shows the error of the cell; that with least scatter counts.
            let cells = meshes.iter().filter_map(|&on_mesh| self.cell_error(on_mesh, load));
            let scatter = |cell: &SizeError| cell.found.error.error;
            let cell = cells.min_by(|one, other| scatter(one).total_cmp(&scatter(other)));
            Some(LoadBudget {
                load,
                surfaces,
                mean,
                mesh: self.mesh_error(&meshes, target, load).filter(|_| !self.is_sum_over_cell),
                cell: cell.filter(|_| !self.is_sum_over_cell).map(|cell| SizeError {
                    on_mesh: cell.on_mesh.filter(|on_mesh| *on_mesh != nodes(target)),
                    ..cell
                }),
                solver: self.solver_error(target, precise, load),
            })
        });
        ErrorBudget {
            loads: loads.collect(),
            point: self.all[target].point.clone(),
            ensembles: levels.iter().map(|&level| self.all[level].clone()).collect(),
        }
    }

    /// Returns the values of the surfaces of an ensemble at a load.
    fn at(&self, ensemble: usize, load: Load) -> BTreeMap<Member, f64> {
        let ensemble = &self.all[ensemble];
        let index = ensemble.loads.iter().position(|own| decimal::is_same(own.given, load.given));
        let members = ensemble.members.iter().enumerate();
        let known = members.filter_map(|(member, &surface)| {
            Some((surface, self.values[ensemble.row(member, index?)?]?))
        });
        known.collect()
    }

    /// Returns the mean on the last mesh, with its number of surfaces. Returns `None` if a surface
    /// has no value, because the mean of the others would belong to another ensemble.
    fn mean(&self, levels: &[usize], load: Load) -> Option<(usize, MeanDifference)> {
        let values: Vec<BTreeMap<Member, f64>> =
            levels.iter().map(|&level| self.at(level, load)).collect();
        let is_whole = |(values, &level): (&BTreeMap<_, _>, &usize)| {
            values.len() == self.all[level].members.len()
        };
        let finest = values.last()?;
        if !values.iter().zip(levels).all(is_whole) || finest.is_empty() {
            return None;
        }
        if levels.len() == 1 {
            let values: Vec<f64> = finest.values().copied().collect();
            let single = MeanDifference { value: values[0], error: 0.0, freedom: 1 };
            return Some((values.len(), MeanDifference::paired(&values).unwrap_or(single)));
        }
        let mut members: Vec<Member> = values[0].keys().copied().collect();
        let meshes = |member: &Member| values.iter().filter(|own| own.contains_key(member)).count();
        members.sort_by_key(|member| (std::cmp::Reverse(meshes(member)), *member));
        let nested: Vec<Vec<f64>> = values
            .iter()
            .map(|own| members.iter().map_while(|member| own.get(member).copied()).collect())
            .collect();
        let mean = MultilevelMean::new(&nested)?;
        let MultilevelMean { value, error, freedom, .. } = mean;
        Some((finest.len(), MeanDifference { value, error, freedom }))
    }

    /// Computes the error of the mesh from the surfaces that the target and the finest meshes show.
    fn mesh_error(&self, meshes: &[usize], target: usize, load: Load) -> Option<SizeError> {
        let of_target = self.at(target, load);
        let is_drawn = |member: &Member| matches!(member, Member::Drawn { .. });
        let is_shared = |mesh: &&usize| {
            let shared = self.at(**mesh, load).into_keys();
            shared.filter(|member| is_drawn(member) && of_target.contains_key(member)).count() > 1
        };
        let known: Vec<usize> = meshes.iter().filter(is_shared).copied().collect();
        let (used, target) = largest(&known, target)?;
        let values: Vec<BTreeMap<Member, f64>> =
            used.iter().map(|&mesh| self.at(mesh, load)).collect();
        let on_all = values[0].keys().filter(|member| {
            is_drawn(member) && values.iter().all(|values| values.contains_key(member))
        });
        let shared: Vec<Member> = on_all.copied().collect();
        let paired = |values: &BTreeMap<Member, f64>| {
            shared.iter().map(|member| values[member]).collect::<Vec<f64>>()
        };
        let levels: Vec<Vec<f64>> = values.iter().map(paired).collect();
        let sizes: Vec<f64> =
            used.iter().map(|&mesh| nodes_per_side(&self.all[mesh].point)).collect();
        let found = DiscretizationError::new(&sizes, &levels, target, Sampling::Paired)?;
        Some(SizeError { found, surfaces: vec![shared.len(); sizes.len()], sizes, on_mesh: None })
    }

    /// Computes the error of the cell from cells with as many waves and nodes per length.
    fn cell_error(&self, target: usize, load: Load) -> Option<SizeError> {
        let own = self.in_wavelengths[target].as_ref()?;
        let own_factor = self.to_wavelengths[target]?;
        let waves = |cell: usize| number(&self.all[cell].point, K_LOWER.name).unwrap_or(0.0);
        let mut cells: Vec<usize> = (0..self.all.len())
            .filter(|&cell| self.in_wavelengths[cell].as_ref() == Some(own))
            .filter(|&cell| cell == target || waves(cell) != waves(target))
            .filter(|&cell| self.at(cell, load).len() > 1)
            .collect();
        cells.sort_by(|&one, &other| waves(one).total_cmp(&waves(other)));
        cells.dedup_by_key(|cell| waves(*cell).to_bits());
        let on_mesh = Some(nodes_per_side(&self.all[target].point));
        let (used, target) = largest(&cells, target)?;
        // Values in the unit of the target for an equal longest wavelength.
        let scaled = |cell: usize| -> Option<Vec<f64>> {
            let factor = self.to_wavelengths[cell]? / own_factor;
            Some(self.at(cell, load).into_values().map(|value| value * factor).collect())
        };
        let values = used.iter().map(|&cell| scaled(cell)).collect::<Option<Vec<Vec<f64>>>>()?;
        let sizes: Vec<f64> = used.iter().map(|&cell| waves(cell)).collect();
        let found = DiscretizationError::new(&sizes, &values, target, Sampling::Independent)?;
        Some(SizeError { found, surfaces: values.iter().map(Vec::len).collect(), sizes, on_mesh })
    }

    fn solver_error(
        &self,
        target: usize,
        precise: Option<usize>,
        load: Load,
    ) -> Option<SolverError> {
        if let Some(precise) = precise {
            let (own, precise_values) = (self.at(target, load), self.at(precise, load));
            let differences: Vec<f64> = own
                .iter()
                .filter_map(|(member, value)| Some(value - precise_values.get(member)?))
                .collect();
            let tolerance = number(&self.all[precise].point, TOLERANCE.name)?;
            let error = MeanDifference::paired(&differences)?;
            return Some(SolverError::Difference { error, tolerance });
        }
        let point = &self.all[target].point;
        let tolerance = number(point, TOLERANCE.name)?;
        let is_elastic = point.get(WORK_OF_ADHESION.name).is_none();
        let coefficient = number(point, COEFFICIENT.name).unwrap_or(0.0);
        // A node has four edges, which the correction subtracts.
        let bound = WRONG_NODES * (1.0 + 4.0 * coefficient);
        let is_known = self.counts_nodes && is_elastic && tolerance <= DEFAULT_TOLERANCE;
        let ensemble = &self.all[target];
        let index =
            ensemble.loads.iter().position(|own| decimal::is_same(own.given, load.given))?;
        let mut rows = (0..ensemble.members.len()).filter_map(|member| ensemble.row(member, index));
        let are_converged = !rows.any(|row| self.unconverged[row]);
        (is_known && are_converged).then_some(SolverError::Bound(bound))
    }
}

/// Returns the largest of the sizes and that of the target, in their order, and the index of the
/// target among them. Returns `None` if there is no other size, or if the target is missing.
fn largest(sizes: &[usize], target: usize) -> Option<(Vec<usize>, usize)> {
    let index = sizes.iter().position(|&size| size == target)?;
    let first = sizes.len().saturating_sub(MOST_SIZES);
    let used: Vec<usize> =
        (0..sizes.len()).filter(|&at| at >= first || at == index).map(|at| sizes[at]).collect();
    let index = used.iter().position(|&size| size == target)?;
    (used.len() > 1).then_some((used, index))
}

/// Returns the square root of the number of nodes of the mesh of a point.
fn nodes_per_side(point: &ParameterPoint) -> f64 {
    let along = |axis: usize| number(point, MESH[axis]);
    let nodes = along(0).or_else(|| Some((along(1)? * along(2)?).sqrt()));
    nodes.unwrap_or(0.0)
}

/// Returns the value of a parameter that is a number.
pub fn number(point: &ParameterPoint, name: &str) -> Option<f64> {
    point.get(name)?.number()
}

/// Returns the parameters of a table that are proportional to a length.
pub fn lengths(table: &Table) -> BTreeSet<String> {
    let parameters = table.in_role(Role::Parameter);
    let schema = parameters.batch().schema();
    let is_length = |unit: &str| ["length", "pressure × length"].contains(&unit);
    let lengths =
        schema.fields().iter().filter(|field| is_length(&Description::from(field.as_ref()).unit));
    lengths.map(|field| field.name().clone()).collect()
}

/// Returns parameters in units of the longest wavelength, which are equal in cells of any size.
/// Returns `None` if the surfaces have no longest wavelength.
pub fn in_wavelengths(
    point: &ParameterPoint,
    lengths: &BTreeSet<String>,
) -> Option<ParameterPoint> {
    let waves = number(point, K_LOWER.name)?;
    let side = longer_side(point);
    let scaled = point.map(|name, value| {
        let factor = match name {
            _ if PER_SIDE.contains(&name) => 1.0 / waves,
            _ if SIDES.contains(&name) => 1.0 / side,
            _ if lengths.contains(name) => waves / side,
            _ => return value.clone(),
        };
        let number = value.number().map(|number| Value::Real(decimal::nearest(number * factor)));
        number.unwrap_or_else(|| value.clone())
    });
    Some(scaled.without(&[COEFFICIENT.name]))
}

fn longer_side(point: &ParameterPoint) -> f64 {
    let sides = SIDES.iter().filter_map(|side| number(point, side));
    sides.reduce(f64::max).unwrap_or(1.0)
}

/// Returns the factor that converts values with this unit to units of the longest wavelength.
fn to_wavelengths(point: &ParameterPoint, unit: &str) -> Option<f64> {
    let waves = number(point, K_LOWER.name)?;
    let per_length = waves / longer_side(point);
    Some(match unit {
        ""
        | "1"
        | "°"
        | "pressure"
        | "E* × rms slope"
        | "1/(E* × rms slope)"
        | "rms height"
        | "1/rms height" => 1.0,
        "length" | "pressure × length" => per_length,
        "length²" => per_length.powi(2),
        "length³" => per_length.powi(3),
        "1/length" => 1.0 / per_length,
        "1/length²" => per_length.powi(-2),
        "E*/side" => 1.0 / waves,
        _ => return None,
    })
}
