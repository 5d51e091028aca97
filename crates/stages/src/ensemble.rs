//! Grouping of rows by parameter point, surface and load.
//!
//! The [`Role`] of each column decides how it groups rows. Rows that agree in every **parameter**
//! belong to one ensemble. Within an ensemble, seed and realization identify the **surface**, and
//! the load identifies the state of a surface. A manifest gives loads either in units of E* × rms
//! slope or in pascals. The column in the unit of the manifest identifies loads; the column in the
//! other unit is derived for each surface. Loads that differ only by rounding are equal. If two
//! stages give rows for the same surface at the same load, only the first row counts. The others
//! are listed in [`Ensemble::repeated`].

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::fmt;

use arrow::array::{Array, Float64Array, Int64Array};
use arrow::row::{RowConverter, SortField};
use serde::Serialize;

use crate::columns::{
    CHANNEL, CONTENT, CROP_FROM_X, CROP_FROM_Y, CROP_SIZE_X, CROP_SIZE_Y, LOAD, MEAN_GAP,
    PRESCRIBED_DISPLACEMENT, PRESCRIBED_GAP, PRESSURE, REALIZATION, SEED, SURFACE,
};
use asperity_manifest::decimal;
use asperity_tables::column::{Column, Role, Value, reals};
use asperity_tables::table::{Table, TableError};

/// Parameters that all surfaces of an ensemble share, by name. Parameters that are null are left
/// out.
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct ParameterPoint(BTreeMap<Cow<'static, str>, Value>);

/// Identity of a surface within its ensemble, independent of the mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Member {
    /// The only surface of its ensemble: a shape or a measured surface.
    Sole,
    /// Random surface, identified by its random numbers.
    Drawn { seed: i64, realization: i64 },
    /// Measured surface that is a sample of its ensemble, identified by a hash of its region of a
    /// file, and of the random numbers of a surface that it is pressed against.
    Sample(u64),
}

impl Member {
    pub fn seed(self) -> Option<i64> {
        match self {
            Member::Sole | Member::Sample(_) => None,
            Member::Drawn { seed, .. } => Some(seed),
        }
    }

    pub fn realization(self) -> Option<i64> {
        match self {
            Member::Sole | Member::Sample(_) => None,
            Member::Drawn { realization, .. } => Some(realization),
        }
    }
}

/// Load on the surfaces of an ensemble.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// Load in the unit of the manifest: E* × rms slope or pascals. It is the same for all
    /// surfaces.
    pub given: f64,
    /// Reduced load p₀/(E* h′), averaged over the surfaces with a row at this load, because one
    /// pressure in pascals gives different reduced loads for surfaces of unequal rms slope.
    pub reduced: f64,
}

/// Rows of loads that agree in every parameter, sorted by surface and load.
#[derive(Debug, Clone, PartialEq)]
pub struct Ensemble {
    pub point: ParameterPoint,
    /// Surfaces, in ascending order of seed and realization.
    pub members: Vec<Member>,
    /// Loads at which at least one surface has a row, in ascending order. Prescribed mean gaps
    /// descend, except along a path.
    pub loads: Vec<Load>,
    /// Indices of table rows with the same surface and load as an earlier row.
    pub repeated: Vec<usize>,
    /// Index of the first table row of the ensemble.
    pub first: usize,
    /// Index of the table row of each surface at each load, `[member][load]`; `None` without a row.
    rows: Vec<Vec<Option<usize>>>,
}

impl ParameterPoint {
    /// Collects the cells whose column has the role [`Role::Parameter`].
    pub fn from_cells(cells: impl IntoIterator<Item = (Column, Value)>) -> ParameterPoint {
        let own = cells.into_iter().filter(|(column, _)| column.role == Role::Parameter);
        ParameterPoint(own.map(|(column, value)| (Cow::from(column.name), value)).collect())
    }

    /// Reads the parameters of a row of a table.
    pub fn from_row(table: &Table, row: usize) -> ParameterPoint {
        let parameters = table.in_role(Role::Parameter);
        let columns = parameters.names().into_iter().zip(parameters.batch().columns());
        let known = columns.filter_map(|(name, column)| {
            Some((Cow::from(name.to_owned()), Value::from_array(column, row)?))
        });
        ParameterPoint(known.collect())
    }

    /// Returns the value of a parameter.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.0.get(name)
    }

    /// Iterates over the parameters in alphabetical order.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Value)> {
        self.0.iter().map(|(name, value)| (name.as_ref(), value))
    }

    /// Adds the parameters of another point.
    pub fn and(mut self, more: ParameterPoint) -> ParameterPoint {
        self.0.extend(more.0);
        self
    }

    /// Returns the same parameters with other values.
    pub fn map(&self, value: impl Fn(&str, &Value) -> Value) -> ParameterPoint {
        let parameters = self.0.iter();
        ParameterPoint(parameters.map(|(name, own)| (name.clone(), value(name, own))).collect())
    }

    /// Removes all parameters except those with these names.
    pub fn only(mut self, names: &[&str]) -> ParameterPoint {
        self.0.retain(|name, _| names.contains(&name.as_ref()));
        self
    }

    /// Removes the parameters that have the same value in another point.
    pub fn beyond(mut self, other: &ParameterPoint) -> ParameterPoint {
        self.0.retain(|name, value| other.get(name) != Some(value));
        self
    }

    /// Removes the parameters with these names.
    pub fn without(mut self, names: &[&str]) -> ParameterPoint {
        self.0.retain(|name, _| !names.contains(&name.as_ref()));
        self
    }
}

/// Formats the point like `hurst 0.8, k_lower 4`.
impl fmt::Display for ParameterPoint {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let parameters = self.iter().map(|(name, value)| format!("{name} {value}"));
        formatter.write_str(&parameters.collect::<Vec<_>>().join(", "))
    }
}

/// Returns the name of the column that identifies loads: `pressure` if the manifest gives loads in
/// pascals, `mean_gap`, `prescribed_gap` or `prescribed_displacement` if it prescribes these, and
/// `load` if loads are reduced or if tables of several kinds are stacked.
pub fn load_column(table: &Table) -> &'static str {
    let loads = table.in_role(Role::Load);
    let [only] = loads.names()[..] else { return LOAD.name };
    let given = [PRESSURE.name].into_iter().chain(LENGTHS.map(|(column, _)| column));
    given.into_iter().find(|given| *given == only).unwrap_or(LOAD.name)
}

/// Columns that identify loads where a manifest prescribes lengths, with their names in texts.
const LENGTHS: [(&str, &str); 3] = [
    (MEAN_GAP.name, "mean gap"),
    (PRESCRIBED_GAP.name, "mean gap"),
    (PRESCRIBED_DISPLACEMENT.name, "displacement"),
];

/// Returns what a column that identifies loads is in texts, if the manifest prescribes lengths:
/// `mean gap` or `displacement`. Returns `None` for loads.
pub fn prescribed_length(load_column: &str) -> Option<&'static str> {
    let known = LENGTHS.into_iter().find(|(column, _)| *column == load_column);
    known.map(|(_, words)| words)
}

/// Groups the rows of a table of loads into ensembles, in the order of the first row of each
/// ensemble.
///
/// # Errors
/// Returns an error if the table has no loads.
pub fn ensembles(table: &Table) -> Result<Vec<Ensemble>, TableError> {
    let given = load_column(table);
    let reduced = (given != LOAD.name).then(|| table.reals(LOAD.name));
    let are_gaps = given == PRESCRIBED_GAP.name;
    let loads = Loads { given: table.reals(given)?, reduced: reduced.transpose()?, are_gaps };
    let members = Members::new(table)?;
    let parameters = table.in_role(Role::Parameter);
    let groups = grouped(&parameters).into_iter();
    Ok(groups
        .map(|rows| {
            Ensemble::new(ParameterPoint::from_row(&parameters, rows[0]), &rows, &members, &loads)
        })
        .collect())
}

/// Columns of a table that hold loads.
struct Loads<'a> {
    given: &'a Float64Array,
    /// Column of reduced loads, or `None` if the given loads are reduced.
    reduced: Option<&'a Float64Array>,
    /// True if the given loads are mean gaps, which fall with the load.
    are_gaps: bool,
}

impl Loads<'_> {
    /// Returns the load of rows that agree in the given load `given`. If the reduced loads of
    /// `rows` differ, their mean is used.
    fn common(&self, given: f64, rows: impl Iterator<Item = usize> + Clone) -> Load {
        let Some(of_rows) = self.reduced else {
            let reduced = given;
            return Load { given, reduced };
        };
        let reduced = rows.map(|row| of_rows.value(row));
        let first = reduced.clone().next().unwrap_or(given);
        let is_same = reduced.clone().all(|reduced| reduced == first);
        let mean = || reduced.clone().sum::<f64>() / reduced.clone().count() as f64;
        Load { given, reduced: if is_same { first } else { mean() } }
    }
}

impl Ensemble {
    fn new(point: ParameterPoint, rows: &[usize], members: &Members, loads: &Loads) -> Ensemble {
        let known = rows.iter().filter(|&&row| loads.given.is_valid(row));
        let distinct = distinct(known.clone().map(|&row| loads.given.value(row)).collect());
        let mut of_member: BTreeMap<Member, Vec<Option<usize>>> = BTreeMap::new();
        let mut repeated = Vec::new();
        for &row in known {
            let states =
                of_member.entry(members.of_row(row)).or_insert_with(|| vec![None; distinct.len()]);
            match &mut states[index_of_load(&distinct, loads.given.value(row))] {
                Some(_) => repeated.push(row),
                state => *state = Some(row),
            }
        }
        let (members, states): (Vec<_>, Vec<Vec<_>>) = of_member.into_iter().unzip();
        let rows_of = |load: usize| states.iter().filter_map(move |states| states[load]);
        let given = distinct.into_iter().enumerate();
        let common = given.map(|(load, given)| loads.common(given, rows_of(load)));
        let first = rows[0];
        let mut ensemble =
            Ensemble { point, members, loads: common.collect(), repeated, first, rows: states };
        if loads.are_gaps {
            ensemble.loads.reverse();
            ensemble.rows.iter_mut().for_each(|states| states.reverse());
        }
        ensemble
    }

    /// Returns the index of the table row of surface `members[member]` at load `loads[load]`, or
    /// `None` if there is no such row.
    pub fn row(&self, member: usize, load: usize) -> Option<usize> {
        self.rows[member][load]
    }

    /// Returns the rows of all surfaces at a load, or `None` if a surface has no row at this load.
    ///
    /// A surface can lack a row because the load failed or was not requested for it. A mean over
    /// the remaining surfaces would belong to another ensemble.
    pub fn complete(&self, load: usize) -> Option<Vec<usize>> {
        self.rows.iter().map(|states| states[load]).collect()
    }

    /// Iterates over all states as (surface, load, index of the table row).
    pub fn states(&self) -> impl Iterator<Item = (Member, Load, usize)> {
        let members = self.members.iter().zip(&self.rows);
        members.flat_map(|(&member, states)| {
            let states = self.loads.iter().zip(states);
            states.filter_map(move |(&load, row)| Some((member, load, (*row)?)))
        })
    }
}

/// Removes rows that repeat the surface and load of an earlier row. Such rows occur if two stages
/// share rows.
///
/// Loads that differ by rounding become equal. A table whose rows do not describe single surfaces
/// is returned unchanged.
///
/// # Errors
/// Returns an error if loads are not numbers.
pub fn without_repeated_rows(table: &Table) -> Result<Table, TableError> {
    if !table.has(SURFACE.name) {
        return Ok(table.clone());
    }
    if !table.has(LOAD.name) {
        let mut first: Vec<usize> =
            grouped(&table.coordinates()).iter().map(|rows| rows[0]).collect();
        first.sort_unstable();
        return Ok(table.pick(&first));
    }
    let ensembles = ensembles(table)?;
    let states = ensembles.iter().flat_map(Ensemble::states);
    let mut kept: Vec<(usize, f64)> = states.map(|(_, load, row)| (row, load.given)).collect();
    kept.sort_by_key(|(row, _)| *row);
    let (rows, loads): (Vec<usize>, Vec<f64>) = kept.into_iter().unzip();
    Ok(table.pick(&rows).replacing(load_column(table), reals(loads)))
}

/// Returns groups of the indices of rows that agree in every column, in the order of the first row
/// of each group.
pub fn grouped(table: &Table) -> Vec<Vec<usize>> {
    let columns = table.batch().columns();
    if columns.is_empty() {
        return Vec::from_iter((table.rows() > 0).then(|| (0..table.rows()).collect()));
    }
    let fields = columns.iter().map(|column| SortField::new(column.data_type().clone()));
    let converter = RowConverter::new(fields.collect()).expect("coordinates can be compared");
    let rows = converter.convert_columns(columns).expect("the fields are those of the columns");
    let mut known = HashMap::new();
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        let group = *known.entry(row).or_insert(groups.len());
        if group == groups.len() {
            groups.push(Vec::new());
        }
        groups[group].push(index);
    }
    groups
}

/// Sorts loads and removes repeated ones; of loads that differ by rounding, the smallest is kept.
fn distinct(mut loads: Vec<f64>) -> Vec<f64> {
    loads.sort_by(f64::total_cmp);
    loads.dedup_by(|next, kept| decimal::is_same(*next, *kept));
    loads
}

fn index_of_load(distinct: &[f64], load: f64) -> usize {
    // `distinct` keeps the smallest of loads that differ by rounding, so it is not above `load`.
    distinct.partition_point(|other| *other <= load) - 1
}

/// Lookup of the surface that a row of a table describes.
pub struct Members<'a> {
    seeds: Option<&'a Int64Array>,
    realizations: Option<&'a Int64Array>,
    /// Sample in each row; empty if the table has no samples.
    samples: Vec<Option<Member>>,
}

impl<'a> Members<'a> {
    /// Finds the columns that identify surfaces in a table.
    ///
    /// # Errors
    /// Returns an error if seeds or realizations are not integers.
    pub fn new(table: &'a Table) -> Result<Members<'a>, TableError> {
        let column = |name: &str| table.optional(name, Table::integers);
        let (seeds, realizations) = (column(SEED.name)?, column(REALIZATION.name)?);
        Ok(Members { seeds, realizations, samples: samples(table) })
    }

    /// Returns the surface of a row.
    pub fn of_row(&self, row: usize) -> Member {
        if let Some(Some(sample)) = self.samples.get(row) {
            return *sample;
        }
        let value = |column: Option<&Int64Array>| {
            column.filter(|column| column.is_valid(row)).map(|column| column.value(row))
        };
        match (value(self.seeds), value(self.realizations)) {
            (None, None) => Member::Sole,
            (seed, realization) => {
                Member::Drawn { seed: seed.unwrap_or(0), realization: realization.unwrap_or(0) }
            }
        }
    }
}

/// Returns the sample in each row of a table. Returns an empty list if the contents of files are
/// parameters in this table, because its surfaces are then no samples.
fn samples(table: &Table) -> Vec<Option<Member>> {
    let regions = table.only(&REGION).in_role(Role::Surface);
    if !regions.has(CONTENT.name) {
        return Vec::new();
    }
    let drawn = table.only(&[SEED.name, REALIZATION.name]);
    let identity = regions.beside(&drawn);
    let contents = regions.batch().column_by_name(CONTENT.name).expect("the column was found");
    let names = identity.names();
    let sample = |row: usize| {
        let mut hasher = blake3::Hasher::new();
        for (name, column) in names.iter().zip(identity.batch().columns()) {
            if let Some(value) = Value::from_array(column, row) {
                hasher.update(format!("{name}={value}\n").as_bytes());
            }
        }
        let hash = hasher.finalize();
        let first = hash.as_bytes().first_chunk().expect("a hash has 32 bytes");
        Member::Sample(u64::from_le_bytes(*first))
    };
    (0..table.rows()).map(|row| contents.is_valid(row).then(|| sample(row))).collect()
}

/// Columns that identify a region of a measured surface, independent of filters and height scale.
const REGION: [&str; 6] = [
    CONTENT.name,
    CHANNEL.name,
    CROP_FROM_X.name,
    CROP_FROM_Y.name,
    CROP_SIZE_X.name,
    CROP_SIZE_Y.name,
];

/// Returns the number of the sampling unit of each row. Sampling units are numbered from 0, in the
/// order of appearance.
///
/// Rows of one sampling unit are not independent. The parameter points of a sweep share random
/// numbers: the surface of one seed and realization has the same phases at every point. The rows of
/// this surface are therefore correlated and count as one sample. Statistics over rows of several
/// points therefore count sampling units.
///
/// All rows with the same seed and realization are one unit, and so are all rows of one region of a
/// file. Every other surface, and every row that does not describe a single surface, is a separate
/// unit.
///
/// # Errors
/// Returns an error if seeds, realizations or names of surfaces have another type.
pub fn sampling_units(table: &Table) -> Result<Vec<i64>, TableError> {
    let members = Members::new(table)?;
    let regions = numbered(&table.only(&REGION));
    let contents = table.optional(CONTENT.name, Table::texts)?;
    let names = table.optional(SURFACE.name, Table::texts)?;
    let mut known: HashMap<Unit, i64> = HashMap::new();
    let unit = |row: usize| {
        let unit = match members.of_row(row) {
            member @ Member::Drawn { .. } => Unit::Drawn(member),
            // Another preparation of the same region is not another sample.
            Member::Sample(_) => Unit::Region(regions[row]),
            Member::Sole if contents.is_some_and(|contents| contents.is_valid(row)) => {
                Unit::Region(regions[row])
            }
            Member::Sole => match names {
                Some(names) => Unit::Surface(names.value(row)),
                None => Unit::Row(row),
            },
        };
        let next = known.len() as i64;
        *known.entry(unit).or_insert(next)
    };
    Ok((0..table.rows()).map(unit).collect())
}

/// Identity of a sampling unit.
#[derive(PartialEq, Eq, Hash)]
enum Unit<'a> {
    Drawn(Member),
    Region(usize),
    Surface(&'a str),
    Row(usize),
}

/// Returns a number for each row, which is the same for rows that agree in every column.
fn numbered(table: &Table) -> Vec<usize> {
    let mut numbers = vec![0; table.rows()];
    for (number, rows) in grouped(table).into_iter().enumerate() {
        rows.into_iter().for_each(|row| numbers[row] = number);
    }
    numbers
}
