//! Comparison of two studies: their parameters, their rows, and the means of their columns.
//!
//! Stages correspond by name and kind. Rows correspond by parameter point, surface and load, in
//! `rows`; means of corresponding rows are compared surface by surface, in `columns`.

pub(crate) mod columns;
mod output;
pub(crate) mod rows;
pub(crate) mod studies;

use std::collections::BTreeSet;
use std::path::PathBuf;

use serde::Serialize;

use super::{Session, SessionError, UnknownName};
use asperity_pipeline::plan::reasons::differences::{differences, stage_pairs};
use asperity_stages::columns::PRESSURE;
use asperity_stages::output_units::Conversion;
use asperity_stages::units::TableUnits;
use asperity_statistics::differences::holm;
use asperity_statistics::intervals::LEVEL;
use asperity_tables::table::Table;
use rows::MatchedRows;

pub use asperity_pipeline::plan::reasons::differences::{Difference, StageDifference};
pub use columns::{ColumnComparison, MeanComparison, Test};
pub use output::table;
pub use rows::{Lacking, RowMatches, UnmatchedRows};

pub(crate) use output::write;
pub(crate) use studies::{ComparedStudy, Studies};

/// Comparison of the studies of two folders, or of single studies.
#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct Comparison {
    pub equal: bool,
    pub studies: Vec<StudyComparison>,
    /// Names of the studies that only one of two data folders has.
    pub only_in_a: Vec<String>,
    pub only_in_b: Vec<String>,
}

/// Comparison of two studies.
#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct StudyComparison {
    pub equal: bool,
    pub a: StudyName,
    pub b: StudyName,
    /// Differences of the parameters; `None` if one study does not record its parameters.
    pub parameters: Option<Vec<StageDifference>>,
    pub stages: Vec<StageComparison>,
    pub noise: Noise,
}

/// Name and origin of a compared study.
#[derive(Debug, Clone, Serialize)]
#[non_exhaustive]
pub struct StudyName {
    pub path: PathBuf,
    /// Settings that override keys of the manifest, as options of the command line.
    #[serde(skip_serializing_if = "String::is_empty")]
    pub settings: String,
    pub study: String,
    /// True if the path is a manifest, and not a folder or archive of tables.
    pub is_manifest: bool,
    /// Versions of the program that published the tables.
    pub programs: BTreeSet<String>,
}

/// Comparison of the tables of a stage that both studies have.
#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct StageComparison {
    /// Name of the stage in A.
    pub stage: String,
    /// Name of the stage in B, if it differs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage_in_b: Option<String>,
    /// Rows of A and of B; `None` if the stage has no results.
    pub rows_a: Option<StageSize>,
    pub rows_b: Option<StageSize>,
    /// Comparison of the tables, if both have results.
    #[serde(flatten)]
    pub tables: Option<TableComparison>,
}

/// Size of the table of a stage.
#[derive(Debug, Clone, Copy, Serialize)]
#[non_exhaustive]
pub struct StageSize {
    pub rows: usize,
    pub finished: usize,
    pub tasks: usize,
}

#[derive(Debug, Serialize)]
#[non_exhaustive]
pub struct TableComparison {
    pub equal: bool,
    /// True if the tables have the same rows in the same order, with the same bits.
    pub identical: bool,
    #[serde(flatten)]
    pub rows: RowMatches,
    /// Units of the loads of A and of B, if their manifests name units.
    #[serde(skip)]
    pub load_units: [Option<String>; 2],
    pub columns_only_in_a: Vec<String>,
    pub columns_only_in_b: Vec<String>,
    pub columns: Vec<ColumnComparison>,
}

/// Numbers of differences that do and do not exceed the scatter of the surfaces.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
#[non_exhaustive]
pub struct Noise {
    /// Number of means that differ and have an interval.
    pub comparisons: usize,
    /// Number of intervals that exclude zero.
    pub excluding_zero: usize,
    /// Expected number of intervals that exclude zero if all means were equal.
    pub expected_by_chance: f64,
    /// Number of differences that are more than noise after Holm's correction.
    pub more_than_noise: usize,
}

impl Session<'_> {
    /// Compares the study with another one: parameters, rows, and means of all columns.
    ///
    /// # Errors
    /// Returns an error if a manifest is invalid or a table is damaged.
    pub fn diff(&self, other: &Session<'_>) -> Result<Comparison, SessionError> {
        Comparison::new(&self.compared()?, &other.compared()?, None)
    }
}

impl Comparison {
    /// Compares the studies of two sides.
    ///
    /// Two single studies are compared whatever their names are. The studies of data folders are
    /// compared by name. `name` selects one study of each data folder.
    ///
    /// # Errors
    /// Returns an error if a side has no study with the requested name, or if a table is damaged.
    pub(crate) fn new(
        a: &Studies,
        b: &Studies,
        name: Option<&str>,
    ) -> Result<Comparison, SessionError> {
        let single = |side: &Studies| match &side.studies[..] {
            [one] => Some(one.origin.study.clone()),
            _ => None,
        };
        let wanted = name.map(str::to_owned).or(single(a)).or(single(b));
        let chosen = |side| Studies::chosen(side, wanted.as_deref());
        let (from_a, from_b) = (chosen(a)?, chosen(b)?);
        let are_single = from_a.len() == 1 && from_b.len() == 1;
        let is_pair = |one: &ComparedStudy, other: &ComparedStudy| {
            are_single || one.origin.study == other.origin.study
        };
        let lacking = |of: &[&ComparedStudy], others: &[&ComparedStudy]| -> Vec<String> {
            let alone = |one: &&&ComparedStudy| !others.iter().any(|other| is_pair(one, other));
            of.iter().filter(alone).map(|study| study.origin.study.clone()).collect()
        };
        let mut studies = Vec::new();
        for one in &from_a {
            for other in from_b.iter().filter(|other| is_pair(one, other)) {
                studies.push(StudyComparison::new(one, other)?);
            }
        }
        let [only_in_a, only_in_b] = [lacking(&from_a, &from_b), lacking(&from_b, &from_a)];
        let equal =
            only_in_a.is_empty() && only_in_b.is_empty() && studies.iter().all(|study| study.equal);
        Ok(Comparison { equal, studies, only_in_a, only_in_b })
    }

    /// Returns the comparison as JSON.
    pub fn json(&self) -> String {
        serde_json::to_string(self).expect("a comparison is plain data")
    }
}

impl Studies {
    /// Returns the only study of a side, the one with this name, or all.
    fn chosen(&self, name: Option<&str>) -> Result<Vec<&ComparedStudy>, SessionError> {
        let all: Vec<&ComparedStudy> = self.studies.iter().collect();
        let Some(name) = name.filter(|_| all.len() > 1) else { return Ok(all) };
        let known: Vec<&str> = all.iter().map(|study| study.origin.study.as_str()).collect();
        let found = known.iter().position(|known| *known == name).ok_or_else(|| {
            let message = format!("`{}` has no study `{name}`", self.path.display());
            UnknownName::new(message, name, &known)
        })?;
        Ok(vec![all[found]])
    }
}

impl StudyComparison {
    fn new(a: &ComparedStudy, b: &ComparedStudy) -> Result<StudyComparison, SessionError> {
        let records = a.record.as_ref().zip(b.record.as_ref());
        let pairs: Vec<(&String, &String)> = match records {
            Some((record_a, record_b)) => {
                let pairs = stage_pairs(record_a, record_b).into_iter();
                pairs.map(|(in_a, in_b)| (&a.stages[in_a], &b.stages[in_b])).collect()
            }
            None => {
                let named = |stage: &&String| b.stages.contains(stage);
                a.stages.iter().filter(named).map(|stage| (stage, stage)).collect()
            }
        };
        let compared = pairs.into_iter().map(|(in_a, in_b)| {
            let (table_a, table_b) = (a.table(in_a)?, b.table(in_b)?);
            let [rows_a, rows_b] =
                [&table_a, &table_b].map(|side| side.as_ref().map(|(_, size)| *size));
            let tables = table_a.zip(table_b).map(|((a, _), (b, _))| TableComparison::new(&a, &b));
            Ok(StageComparison {
                stage: in_a.to_owned(),
                stage_in_b: (in_a != in_b).then(|| in_b.to_owned()),
                rows_a,
                rows_b,
                tables: tables.transpose()?,
            })
        });
        let mut stages = compared.collect::<Result<Vec<_>, SessionError>>()?;
        let noise = Noise::judge(&mut stages);
        let parameters = records.map(|(a, b)| differences(a, b));
        let is_equal_stage = |stage: &StageComparison| match &stage.tables {
            Some(tables) => tables.equal,
            None => stage.rows_a.is_none() && stage.rows_b.is_none(),
        };
        Ok(StudyComparison {
            equal: parameters.as_ref().is_none_or(Vec::is_empty)
                && stages.iter().all(is_equal_stage),
            a: a.origin.clone(),
            b: b.origin.clone(),
            parameters,
            stages,
            noise,
        })
    }
}

impl TableComparison {
    /// Compares two tables in the units of A.
    fn new(a: &Table, stored_b: &Table) -> Result<TableComparison, SessionError> {
        let units = TableUnits::from_table(a);
        let b = &Conversion { from: TableUnits::from_table(stored_b), to: units }.table(stored_b);
        let matched = MatchedRows::new(a, b)?;
        let are_pressures = matched.rows.load_column == PRESSURE.name;
        let load_units =
            [a, b].map(|table| TableUnits::from_table(table).pressure.filter(|_| are_pressures));
        let columns = columns::compare(a, b, &matched);
        let [columns_only_in_a, columns_only_in_b] =
            [(a, b), (b, a)].map(|(of, other)| columns::lacking(of, other));
        let equal = matched.rows.only_in_a.rows + matched.rows.only_in_b.rows == 0
            && columns_only_in_a.is_empty()
            && columns_only_in_b.is_empty()
            && columns.iter().all(ColumnComparison::is_equal);
        Ok(TableComparison {
            equal,
            identical: equal && columns::are_identical(a, stored_b),
            rows: matched.rows,
            load_units,
            columns_only_in_a,
            columns_only_in_b,
            columns,
        })
    }
}

impl Noise {
    /// Decides which differences are more than noise, for all comparisons of a study together.
    fn judge(stages: &mut [StageComparison]) -> Noise {
        let tables = stages.iter_mut().filter_map(|stage| stage.tables.as_mut());
        let columns = tables.flat_map(|tables| &mut tables.columns);
        let all = columns.flat_map(|column| &mut column.means);
        let mut means: Vec<&mut MeanComparison> =
            all.filter(|mean| mean.p_value.is_some()).collect();
        let p_values: Vec<f64> = means.iter().filter_map(|mean| mean.p_value).collect();
        let mut noise = Noise {
            comparisons: p_values.len(),
            expected_by_chance: (1.0 - LEVEL) * p_values.len() as f64,
            ..Noise::default()
        };
        for (mean, corrected) in means.iter_mut().zip(holm(&p_values)) {
            let is_more_than_noise = corrected <= 1.0 - LEVEL;
            mean.p_corrected = Some(corrected);
            mean.is_more_than_noise = Some(is_more_than_noise);
            noise.more_than_noise += usize::from(is_more_than_noise);
            let excludes = mean.lower > Some(0.0) || mean.upper < Some(0.0);
            noise.excluding_zero += usize::from(excludes);
        }
        noise
    }
}
