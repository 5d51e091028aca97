//! Multilevel means over the meshes of equal surfaces.
//!
//! Each row is the mean on one mesh: the mean on the coarsest mesh of the same parameter point,
//! plus the mean differences of neighbouring meshes up to this one. Beside it are the mean of the
//! surfaces on this mesh alone, and the difference to the next coarser mesh.

use std::cmp::Reverse;
use std::collections::BTreeMap;
use std::sync::Arc;

use arrow::array::{Array, ArrayRef, Int64Array};
use arrow::datatypes::{DataType, Field, Schema};
use serde::Serialize;

use super::groups::{self, GroupNames, inherited};
use super::{Groups, Statistic, statistics};
use crate::columns::{NODES, NODES_X, NODES_Y};
use crate::version::Version;
use crate::{StageError, ensemble};
use asperity_manifest::diagnostics::listed;
use asperity_statistics::multilevel::MultilevelMean;
use asperity_tables::column::optional_reals;
use asperity_tables::table::{Table, TableError};

/// Version of the numbers of multilevel means, part of the key of every stored result.
pub const VERSION: Version = Version::new(
    1,
    &["covariances are correlations of the common surfaces times the deviations of all"],
);

/// Columns that identify the mesh of a surface.
pub const MESH: [&str; 3] = [NODES.name, NODES_X.name, NODES_Y.name];

/// Ends of the names of the columns that describe how a multilevel mean came about, with their
/// meanings.
const TERMS: [(&str, &str); 4] = [
    ("freedom", "degrees of freedom of the standard error"),
    ("difference_mean", "mean difference to the next coarser mesh, over the surfaces on both"),
    ("difference_sem", "standard error of the mean difference to the next coarser mesh"),
    ("share", "share of the surfaces of this mesh in the variance of the mean on the finest mesh"),
];

/// Multilevel means of columns.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Multilevel {
    /// Columns whose means are computed.
    pub over: Vec<String>,
    /// Mean, standard error and confidence intervals.
    pub statistics: Vec<Statistic>,
    /// Version of the computed numbers.
    pub version: u32,
}

impl Multilevel {
    /// Returns the statistics of the surfaces on each mesh alone.
    fn plain(&self) -> Groups {
        Groups {
            group_by: None,
            over: self.over.clone(),
            statistics: self.statistics.clone(),
            models: Vec::new(),
        }
    }

    /// Returns the ends of the names of the columns of the statistics.
    fn suffixes(&self) -> Vec<String> {
        self.statistics.iter().flat_map(|statistic| statistic.suffixes()).collect()
    }
}

/// Returns whether a statistic of multilevel means exists.
pub fn has(statistic: Statistic) -> bool {
    matches!(statistic, Statistic::Mean | Statistic::Sem | Statistic::Confidence(_))
}

/// Computes the means on each mesh, in ascending order of the columns that identify rows.
///
/// A mean is null if a surface of one of its meshes has no value: the mean of the others would
/// belong to another ensemble.
///
/// # Errors
/// Returns an error if a column is missing or holds no numbers, or if a mesh has surfaces that the
/// next coarser mesh lacks.
pub fn reduce(table: &Table, multilevel: &Multilevel) -> Result<Table, StageError> {
    let plain = groups::reduce(table, &multilevel.plain())?;
    let rows = ensemble::without_repeated_rows(table)?;
    let names = GroupNames::new(&rows, &multilevel.plain());
    let ladders = ladders(&rows, &plain, &names)?;
    let suffixes = multilevel.suffixes();
    let statistics: Vec<String> = multilevel
        .over
        .iter()
        .flat_map(|name| suffixes.iter().map(move |suffix| format!("{name}_{suffix}")))
        .collect();
    let mut result = plain.without(&statistics.iter().map(String::as_str).collect::<Vec<_>>());
    for name in &multilevel.over {
        let values = numbers(&rows, name)?;
        let mut means = vec![None; plain.rows()];
        for ladder in &ladders {
            ladder.means(&values, &mut means);
        }
        let schema = rows.batch().schema();
        let source = schema.field_with_name(name).expect("the column exists");
        result = result.beside(&columns(source, &means, multilevel, &plain)?);
    }
    Ok(result)
}

/// Mean of a column on the finest mesh of a parameter point.
#[derive(Debug, Clone)]
pub struct FinestMean {
    /// Numbers of nodes of the meshes, from the coarsest to the finest.
    pub meshes: Vec<i64>,
    pub mean: MultilevelMean,
}

/// Returns the means of a column on the finest meshes. Means without a standard error are left out.
///
/// # Errors
/// As [`reduce`].
pub fn finest_means(table: &Table, column: &str) -> Result<Vec<FinestMean>, StageError> {
    let groups = Groups {
        group_by: None,
        over: vec![column.to_owned()],
        statistics: vec![Statistic::Mean],
        models: Vec::new(),
    };
    let plain = groups::reduce(table, &groups)?;
    let rows = ensemble::without_repeated_rows(table)?;
    let values = numbers(&rows, column)?;
    let ladders = ladders(&rows, &plain, &GroupNames::new(&rows, &groups))?;
    let means = ladders.iter().filter_map(|ladder| {
        let levels = ladder.levels(&values);
        let mean = MultilevelMean::new(&levels).filter(|_| levels.len() == ladder.meshes.len())?;
        Some(FinestMean { meshes: ladder.meshes.clone(), mean })
    });
    Ok(means.collect())
}

/// Mean of a column on one mesh.
#[derive(Debug, Clone)]
struct MeanOnMesh {
    mean: MultilevelMean,
    /// Share in the variance of the mean on the finest mesh.
    share: Option<f64>,
}

/// Meshes of equal surfaces, from the coarsest to the finest.
struct Ladder {
    /// Number of nodes of each mesh.
    meshes: Vec<i64>,
    /// Row of each mesh in the table of means.
    means: Vec<usize>,
    /// Rows of the surfaces of each mesh. The surfaces of a mesh are the first ones of the next
    /// coarser mesh, in the same order.
    surfaces: Vec<Vec<usize>>,
}

impl Ladder {
    /// Returns the values of the surfaces of each mesh, up to the first mesh on which a surface has
    /// no value.
    fn levels(&self, values: &[Option<f64>]) -> Vec<Vec<f64>> {
        let known = |rows: &Vec<usize>| rows.iter().map(|&row| values[row]).collect();
        self.surfaces.iter().map_while(known).collect()
    }

    /// Computes the means on all meshes from the values of the rows.
    fn means(&self, values: &[Option<f64>], means: &mut [Option<MeanOnMesh>]) {
        let levels = self.levels(values);
        let is_whole = levels.len() == self.surfaces.len();
        let finest = MultilevelMean::new(&levels).filter(|_| is_whole);
        let shares = finest.as_ref().map(MultilevelMean::shares);
        for level in 0..levels.len() {
            let mean = MultilevelMean::new(&levels[..=level]);
            let share = shares.as_ref().map(|shares| shares[level]);
            means[self.means[level]] = mean.map(|mean| MeanOnMesh { mean, share });
        }
    }
}

/// Groups the rows of surfaces and the rows of means on each mesh by what they have in common.
fn ladders(rows: &Table, means: &Table, names: &GroupNames) -> Result<Vec<Ladder>, StageError> {
    let keys: Vec<&str> = names.keys().filter(|name| !MESH.contains(name)).collect();
    let units = ensemble::sampling_units(rows)?;
    let [meshes, mean_meshes] = [nodes(rows)?, nodes(means)?];
    let count = rows.rows();
    let both = Table::stack(&[rows.only(&keys), means.only(&keys)])?;
    let groups = ensemble::grouped(&both).into_iter();
    let ladder = |group: Vec<usize>| {
        let (own, of_means): (Vec<usize>, Vec<usize>) =
            group.into_iter().partition(|&row| row < count);
        let mut by_mesh: BTreeMap<i64, (usize, BTreeMap<i64, usize>)> = BTreeMap::new();
        for row in of_means.into_iter().map(|row| row - count) {
            by_mesh.insert(mean_meshes[row], (row, BTreeMap::new()));
        }
        for row in own {
            // A mesh on which a surface lacks this row has no mean.
            let Some((_, surfaces)) = by_mesh.get_mut(&meshes[row]) else { continue };
            if surfaces.insert(units[row], row).is_some() {
                let reason = "a surface has several rows with equal parameters on one mesh";
                return Err(StageError::Aggregate { reason: reason.to_owned() });
            }
        }
        nested(by_mesh)
    };
    groups.map(ladder).collect()
}

/// Sorts the surfaces of each mesh such that those of a mesh are the first ones of the coarser
/// mesh. `by_mesh` has the row of the mean and the rows of the surfaces of each mesh.
fn nested(by_mesh: BTreeMap<i64, (usize, BTreeMap<i64, usize>)>) -> Result<Ladder, StageError> {
    let (means, surfaces): (Vec<usize>, Vec<BTreeMap<i64, usize>>) =
        by_mesh.values().cloned().unzip();
    for (coarse, fine) in surfaces.iter().zip(surfaces.iter().skip(1)) {
        if !fine.keys().all(|unit| coarse.contains_key(unit)) {
            let meshes: Vec<String> = by_mesh.keys().map(i64::to_string).collect();
            let reason = format!(
                "the meshes of {} nodes do not have the same surfaces: each needs all surfaces of \
                 the next finer one",
                listed(meshes.iter().map(String::as_str), "and")
            );
            return Err(StageError::Aggregate { reason });
        }
    }
    let meshes_of = |unit: &i64| surfaces.iter().filter(|rows| rows.contains_key(unit)).count();
    let mut units: Vec<i64> =
        surfaces.first().into_iter().flat_map(|rows| rows.keys().copied()).collect();
    units.sort_by_key(|unit| (Reverse(meshes_of(unit)), *unit));
    let sorted = |rows: &BTreeMap<i64, usize>| {
        units.iter().map_while(|unit| rows.get(unit).copied()).collect()
    };
    let meshes = by_mesh.keys().copied().collect();
    Ok(Ladder { meshes, means, surfaces: surfaces.iter().map(sorted).collect() })
}

/// Returns the number of nodes of the mesh of each row.
fn nodes(table: &Table) -> Result<Vec<i64>, TableError> {
    let column = |name| table.optional(name, Table::integers);
    let [square, along_x, along_y] = [column(MESH[0])?, column(MESH[1])?, column(MESH[2])?];
    let value = |column: Option<&Int64Array>, row: usize| {
        column.filter(|column| column.is_valid(row)).map(|column| column.value(row))
    };
    let nodes = |row| {
        let side = value(square, row);
        let [x, y] = [value(along_x, row), value(along_y, row)].map(|own| own.or(side));
        x.unwrap_or(0) * y.unwrap_or(0)
    };
    Ok((0..table.rows()).map(nodes).collect())
}

/// Returns the values of a column of numbers or flags.
pub(crate) fn numbers(table: &Table, name: &str) -> Result<Vec<Option<f64>>, TableError> {
    if let Ok(integers) = table.integers(name) {
        return Ok(integers.iter().map(|value| value.map(|value| value as f64)).collect());
    }
    if let Ok(flags) = table.flags(name) {
        return Ok(flags.iter().map(|value| value.map(f64::from)).collect());
    }
    Ok(table.reals(name)?.iter().collect())
}

/// Returns the columns of the means of one column, `source`.
fn columns(
    source: &Field,
    means: &[Option<MeanOnMesh>],
    multilevel: &Multilevel,
    plain: &Table,
) -> Result<Table, StageError> {
    let name = source.name();
    let mut fields = Vec::new();
    let mut arrays = Vec::new();
    let mut add = |suffix: &str, meaning: &str, values: ArrayRef| {
        fields.push(
            Field::new(format!("{name}_{suffix}"), DataType::Float64, true)
                .with_metadata(inherited(source, suffix, meaning)),
        );
        arrays.push(values);
    };
    let values = |value: &dyn Fn(&MeanOnMesh) -> Option<f64>| {
        optional_reals(means.iter().map(|mean| value(mean.as_ref()?)))
    };
    for &statistic in &multilevel.statistics {
        let ends = statistic.suffixes();
        for (index, suffix) in ends.iter().enumerate() {
            let meaning = statistics::meaning(suffix).unwrap_or_default();
            let own = values(&|found| {
                Some(match statistic {
                    Statistic::Confidence(level) => found.mean.interval(level)[index],
                    Statistic::Sem => found.mean.error,
                    _ => found.mean.value,
                })
            });
            add(
                suffix,
                &format!("{meaning}, from the surfaces on this and all coarser meshes,"),
                own,
            );
        }
    }
    for suffix in multilevel.suffixes() {
        let meaning = statistics::meaning(&suffix).unwrap_or_default();
        let meaning = format!("{meaning}, from the surfaces on this mesh alone,");
        let own = plain.reals(&format!("{name}_{suffix}"))?;
        add(&format!("plain_{suffix}"), &meaning, Arc::new(own.clone()));
    }
    let difference = |found: &MeanOnMesh| match &found.mean.terms[..] {
        [_, .., last] => Some(*last),
        _ => None,
    };
    type OnMesh<'a> = &'a dyn Fn(&MeanOnMesh) -> Option<f64>;
    let terms: [OnMesh; 4] = [
        &|found| Some(f64::from(found.mean.freedom)),
        &|found| Some(difference(found)?.mean),
        &|found| {
            let term = difference(found)?;
            Some((term.variance / term.surfaces as f64).sqrt())
        },
        &|found| found.share,
    ];
    for ((suffix, meaning), value) in TERMS.into_iter().zip(terms) {
        add(suffix, meaning, values(value));
    }
    Ok(Table::from_arrays(means.len(), Schema::new(fields), arrays))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::columns::{AREA_FRACTION, LOAD, REALIZATION, SEED};
    use asperity_tables::column::{integers, reals};

    /// Areas of realizations on meshes: mesh, realization and area under two loads.
    type Rows = [(i64, i64, [f64; 2])];

    /// Five surfaces on 32² nodes and three of them on 64².
    const ROWS: &Rows = &[
        (32, 0, [1.0, 10.0]),
        (32, 1, [2.0, 20.0]),
        (32, 2, [4.0, 40.0]),
        (32, 3, [7.0, 70.0]),
        (32, 4, [11.0, 110.0]),
        (64, 2, [5.0, 50.0]),
        (64, 0, [1.5, 15.0]),
        (64, 1, [2.0, 20.0]),
    ];

    fn table(rows: &Rows) -> Table {
        let each = || rows.iter().flat_map(|row| [0, 1].map(|load| (row, load)));
        Table::new(
            2 * rows.len(),
            vec![
                (NODES, integers(each().map(|(row, _)| row.0))),
                (SEED, integers(each().map(|_| 7))),
                (REALIZATION, integers(each().map(|(row, _)| row.1))),
                (LOAD, reals(each().map(|(_, load)| [0.1, 0.2][load]))),
                (AREA_FRACTION, reals(each().map(|(row, load)| row.2[load]))),
            ],
        )
    }

    fn multilevel() -> Multilevel {
        Multilevel {
            over: vec![AREA_FRACTION.name.to_owned()],
            statistics: vec![Statistic::Mean, Statistic::Sem, Statistic::Confidence(0.95)],
            version: VERSION.number(),
        }
    }

    /// Returns the values of a statistic of the area, in the order of the rows.
    fn values(found: &Table, suffix: &str) -> Vec<Option<f64>> {
        found.reals(&format!("area_fraction_{suffix}")).unwrap().iter().collect()
    }

    fn assert_close(found: &[Option<f64>], expected: &[Option<f64>]) {
        assert_eq!(found.len(), expected.len());
        for (found, expected) in found.iter().zip(expected) {
            let is_close = match (found, expected) {
                (Some(found), Some(expected)) => (found - expected).abs() <= 1e-12 * expected.abs(),
                (found, expected) => found == expected,
            };
            assert!(is_close, "{found:?} {expected:?}");
        }
    }

    #[test]
    fn each_mesh_has_a_row_with_its_mean_from_all_coarser_meshes() {
        let found = reduce(&table(ROWS), &multilevel()).unwrap();
        assert_eq!(found.integers("nodes").unwrap().values(), &[32, 32, 64, 64]);
        assert_eq!(found.reals("load").unwrap().values(), &[0.1, 0.2, 0.1, 0.2]);
        assert_eq!(found.integers("count").unwrap().values(), &[5, 5, 3, 3]);
        let finest = 5.0 + 0.5;
        assert_close(&values(&found, "mean"), &[Some(5.0), Some(50.0), Some(finest), Some(55.0)]);
        let covariance = 0.5 * (16.5 / (7.0 / 3.0_f64)).sqrt();
        let variance = (16.5 + 2.0 * covariance) / 5.0 + 0.25 / 3.0_f64;
        let coarse = (16.5 / 5.0_f64).sqrt();
        let errors = [coarse, 10.0 * coarse, variance.sqrt(), 10.0 * variance.sqrt()];
        assert_close(&values(&found, "sem"), &errors.map(Some));
        let share = 0.25 / 3.0 / variance;
        assert_close(&values(&found, "share"), &[1.0 - share, 1.0 - share, share, share].map(Some));
        assert_close(&values(&found, "difference_mean"), &[None, None, Some(0.5), Some(5.0)]);
        let alone = (1.5 + 2.0 + 5.0) / 3.0;
        assert_close(&values(&found, "plain_mean")[2..], &[Some(alone), Some(10.0 * alone)]);
        assert_eq!(values(&found, "freedom")[0], Some(4.0));
        let [lower, alone] = ["ci95_lower", "plain_ci95_lower"].map(|end| values(&found, end)[0]);
        assert!((lower.unwrap() - alone.unwrap()).abs() < 1e-13);
    }

    #[test]
    fn a_value_that_one_surface_lacks_makes_the_means_of_finer_meshes_null() {
        let mut areas: Vec<Option<f64>> =
            table(ROWS).reals(AREA_FRACTION.name).unwrap().iter().collect();
        // Surface 2 on 64² under the first load.
        areas[10] = None;
        let table = table(ROWS).replacing(AREA_FRACTION.name, optional_reals(areas));
        let found = reduce(&table, &multilevel()).unwrap();
        let known = |suffix| values(&found, suffix).iter().map(Option::is_some).collect::<Vec<_>>();
        assert_eq!(known("mean"), [true, true, false, true]);
        assert_eq!(known("share"), [false, true, false, true]);
    }

    #[test]
    fn surfaces_that_a_coarser_mesh_lacks_are_an_error() {
        let more = [ROWS, &[(64, 5, [1.0, 2.0])]].concat();
        let error = reduce(&table(&more), &multilevel()).unwrap_err().to_string();
        assert!(error.contains("do not have the same surfaces"), "{error}");
    }

    #[test]
    fn a_table_without_rows_has_all_columns() {
        let empty = reduce(&table(&[]), &multilevel()).unwrap();
        let full = reduce(&table(ROWS), &multilevel()).unwrap();
        assert_eq!(empty.names(), full.names());
    }
}
