//! What is one parameter point, one surface, one load: said once, for all that compares rows.
//!
//! The role of a column decides (see [`Role`]). Rows that agree in every **parameter** are of one
//! ensemble; within it, seed and realization tell **surfaces** apart, and loads tell the states of
//! a surface apart. A load is what the manifest gives, be it reduced or in pascals; the other unit
//! is derived from it, surface by surface, and decides nothing. Loads that differ by rounding are
//! one load. Where two blocks of loads, or two stages, tell the same of a surface, the first of
//! them stands and the other rows are named as repeated: no surface counts twice.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::fmt;

use arrow::array::{Array, Float64Array, Int64Array};
use arrow::row::{RowConverter, SortField};
use serde::Serialize;

use crate::columns::{
    CHANNEL, CONTENT, CROP_FROM_X, CROP_FROM_Y, CROP_SIZE_X, CROP_SIZE_Y, LOAD, PRESSURE,
    REALIZATION, SEED, SURFACE,
};
use asperity_manifest::decimal;
use asperity_tables::column::{Column, Role, Value, reals};
use asperity_tables::table::{Table, TableError};

/// The parameters that all surfaces of an ensemble share, by name; those that are null have none.
#[derive(Debug, Clone, Default, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Point(BTreeMap<Cow<'static, str>, Value>);

/// Which of the surfaces of an ensemble, whatever the mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Member {
    /// A shape, or a measured surface: there is but one.
    Sole,
    /// A random one.
    Drawn { seed: i64, realization: i64 },
}

impl Member {
    /// The seed of its draws.
    pub fn seed(self) -> Option<i64> {
        match self {
            Member::Sole => None,
            Member::Drawn { seed, .. } => Some(seed),
        }
    }

    /// Its number among the draws of one seed.
    pub fn realization(self) -> Option<i64> {
        match self {
            Member::Sole => None,
            Member::Drawn { realization, .. } => Some(realization),
        }
    }
}

/// One load of an ensemble.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// The load in the unit of the manifest, reduced or in pascals. It is the same for all
    /// surfaces.
    pub given: f64,
    /// Reduced pressure p₀/(E* h′), averaged over the surfaces that have the load: under one
    /// pressure in pascals it differs between surfaces of unequal rms slope.
    pub reduced: f64,
}

/// Rows of loads that agree in every parameter, sorted by surface and load.
#[derive(Debug, Clone, PartialEq)]
pub struct Ensemble {
    pub point: Point,
    /// Its surfaces, by seed and realization.
    pub members: Vec<Member>,
    /// The loads of any of its surfaces, ascending.
    pub loads: Vec<Load>,
    /// Rows that tell of a surface and a load what an earlier one tells.
    pub repeated: Vec<usize>,
    /// The first of its rows.
    pub first: usize,
    rows: Vec<Vec<Option<usize>>>,
}

impl Point {
    /// The parameters among the cells of a row.
    pub fn of(cells: impl IntoIterator<Item = (Column, Value)>) -> Point {
        let parameters = cells.into_iter();
        let parameters = parameters.filter(|(column, _)| column.role == Role::Parameter);
        Point(parameters.map(|(column, value)| (Cow::from(column.name), value)).collect())
    }

    /// The parameters of a row of a table.
    pub fn of_row(table: &Table, row: usize) -> Point {
        let parameters = table.in_role(Role::Parameter);
        let columns = parameters.names().into_iter().zip(parameters.batch().columns());
        let known = columns.filter_map(|(name, column)| {
            Some((Cow::from(name.to_owned()), Value::of(column, row)?))
        });
        Point(known.collect())
    }

    /// The value of a parameter.
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.0.get(name)
    }

    /// All parameters, by name.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &Value)> {
        self.0.iter().map(|(name, value)| (name.as_ref(), value))
    }

    /// The same point with more parameters.
    pub fn and(mut self, more: Point) -> Point {
        self.0.extend(more.0);
        self
    }

    /// The same parameters with other values.
    pub fn map(&self, value: impl Fn(&str, &Value) -> Value) -> Point {
        let parameters = self.0.iter();
        Point(parameters.map(|(name, own)| (name.clone(), value(name, own))).collect())
    }

    /// Of the same point, some parameters alone.
    pub fn only(mut self, names: &[&str]) -> Point {
        self.0.retain(|name, _| names.contains(&name.as_ref()));
        self
    }

    /// What it has that another point has not, or has otherwise.
    pub fn beyond(mut self, other: &Point) -> Point {
        self.0.retain(|name, value| other.get(name) != Some(value));
        self
    }

    /// The same point but for some parameters.
    pub fn without(mut self, names: &[&str]) -> Point {
        self.0.retain(|name, _| !names.contains(&name.as_ref()));
        self
    }
}

/// `hurst 0.8, k_lower 4`.
impl fmt::Display for Point {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let told = self.iter().map(|(name, value)| format!("{name} {value}"));
        formatter.write_str(&told.collect::<Vec<_>>().join(", "))
    }
}

/// Returns the name of the column that holds loads as the manifest gives them: `load`, or
/// `pressure` where loads are in pascals. It is `load` for stacked tables of both kinds.
pub fn load_column(table: &Table) -> &'static str {
    match table.in_role(Role::Load).names()[..] {
        [only] if only == PRESSURE.name => PRESSURE.name,
        _ => LOAD.name,
    }
}

/// The ensembles of a table of loads, in the order of their first rows.
///
/// # Errors
/// When the table has no loads.
pub fn ensembles(table: &Table) -> Result<Vec<Ensemble>, TableError> {
    let given = load_column(table);
    let reduced = (given != LOAD.name).then(|| table.reals(LOAD.name));
    let loads = Loads { given: table.reals(given)?, reduced: reduced.transpose()? };
    let members = Members::of(table)?;
    let parameters = table.in_role(Role::Parameter);
    let groups = grouped(&parameters).into_iter();
    Ok(groups
        .map(|rows| Ensemble::of(Point::of_row(&parameters, rows[0]), &rows, &members, &loads))
        .collect())
}

/// The loads of the rows of a table.
struct Loads<'a> {
    given: &'a Float64Array,
    /// `None` where the manifest gives reduced loads.
    reduced: Option<&'a Float64Array>,
}

impl Loads<'_> {
    /// Returns the load that these rows have in common.
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
    fn of(point: Point, rows: &[usize], members: &Members, loads: &Loads) -> Ensemble {
        let known = rows.iter().filter(|&&row| loads.given.is_valid(row));
        let distinct = distinct(known.clone().map(|&row| loads.given.value(row)).collect());
        let mut of_member: BTreeMap<Member, Vec<Option<usize>>> = BTreeMap::new();
        let mut repeated = Vec::new();
        for &row in known {
            let states = of_member.entry(members.of_row(row));
            let states = states.or_insert_with(|| vec![None; distinct.len()]);
            match &mut states[place(&distinct, loads.given.value(row))] {
                Some(_) => repeated.push(row),
                state => *state = Some(row),
            }
        }
        let (members, states): (Vec<_>, Vec<Vec<_>>) = of_member.into_iter().unzip();
        let own = |place: usize| states.iter().filter_map(move |states| states[place]);
        let distinct = distinct.into_iter().enumerate();
        let distinct = distinct.map(|(place, given)| loads.common(given, own(place)));
        Ensemble {
            point,
            members,
            loads: distinct.collect(),
            repeated,
            first: rows[0],
            rows: states,
        }
    }

    /// The row of a surface under a load, both by their places; none if the surface has no such
    /// load.
    pub fn row(&self, member: usize, load: usize) -> Option<usize> {
        self.rows[member][load]
    }

    /// The rows of all surfaces under a load; none if one of them lacks it. A surface has no rows
    /// beyond its first load in full contact, and a mean over those that are left would fall.
    pub fn complete(&self, load: usize) -> Option<Vec<usize>> {
        self.rows.iter().map(|states| states[load]).collect()
    }

    /// Every surface under every load that it has, and the row that stands for it.
    pub fn states(&self) -> impl Iterator<Item = (Member, Load, usize)> {
        let members = self.members.iter().zip(&self.rows);
        members.flat_map(|(&member, states)| {
            let states = self.loads.iter().zip(states);
            states.filter_map(move |(&load, row)| Some((member, load, (*row)?)))
        })
    }
}

/// The rows of a table without those that tell of a surface what an earlier one tells: rows that
/// two stages share, or two blocks that share a load. Loads that differ by rounding are written as
/// one. A table that is not about single surfaces stays as it is.
///
/// # Errors
/// When loads are no numbers.
pub fn each_once(table: &Table) -> Result<Table, TableError> {
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
    let mut standing: Vec<(usize, f64)> = states.map(|(_, load, row)| (row, load.given)).collect();
    standing.sort_by_key(|(row, _)| *row);
    let (rows, loads): (Vec<usize>, Vec<f64>) = standing.into_iter().unzip();
    Ok(table.pick(&rows).replacing(load_column(table), reals(loads)))
}

/// Rows that agree in every column, together; in the order of their first rows.
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

/// Each load once, ascending; of loads that differ by rounding, the smallest.
fn distinct(mut loads: Vec<f64>) -> Vec<f64> {
    loads.sort_by(f64::total_cmp);
    loads.dedup_by(|next, kept| decimal::is_same(*next, *kept));
    loads
}

/// The place of a load among distinct ones.
fn place(distinct: &[f64], load: f64) -> usize {
    // Those that differ from it by rounding are not above it.
    distinct.partition_point(|other| *other <= load) - 1
}

/// Which surface each row of a table is about.
pub struct Members<'a> {
    seeds: Option<&'a Int64Array>,
    realizations: Option<&'a Int64Array>,
}

impl<'a> Members<'a> {
    /// Looks at its columns.
    ///
    /// # Errors
    /// When seeds or realizations are no integers.
    pub fn of(table: &'a Table) -> Result<Members<'a>, TableError> {
        let column = |name: &str| table.has(name).then(|| table.integers(name)).transpose();
        Ok(Members { seeds: column(SEED.name)?, realizations: column(REALIZATION.name)? })
    }

    /// The surface of a row.
    pub fn of_row(&self, row: usize) -> Member {
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

/// Columns that tell regions of measured surfaces apart, however these are filtered or scaled.
const REGION: [&str; 6] = [
    CONTENT.name,
    CHANNEL.name,
    CROP_FROM_X.name,
    CROP_FROM_Y.name,
    CROP_SIZE_X.name,
    CROP_SIZE_Y.name,
];

/// Returns the number of the sampling unit of each row, from 0 in the order of appearance.
///
/// The rows of one unit are not independent of each other. Points of a sweep share random numbers:
/// the surface of one seed and realization has the same phases at every parameter point, so that
/// its rows there are correlated. Together they are one sample of a population of surfaces, and not
/// several. Statistics over rows of several points therefore count sampling units.
///
/// A pair of seed and realization is one unit, and so is a region of a file. Every other surface is
/// a unit of its own, and so is every row that is not about a single surface.
///
/// # Errors
/// When seeds, realizations or names of surfaces have another type.
pub fn sampling_units(table: &Table) -> Result<Vec<i64>, TableError> {
    let members = Members::of(table)?;
    let regions = numbered(&table.only(&REGION));
    let contents = table.has(CONTENT.name).then(|| table.texts(CONTENT.name));
    let contents = contents.transpose()?;
    let names = table.has(SURFACE.name).then(|| table.texts(SURFACE.name));
    let names = names.transpose()?;
    let mut known: HashMap<Unit, i64> = HashMap::new();
    let unit = |row: usize| {
        let unit = match members.of_row(row) {
            member @ Member::Drawn { .. } => Unit::Drawn(member),
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

/// Numbers groups of equal rows and returns the number for each row.
fn numbered(table: &Table) -> Vec<usize> {
    let mut numbers = vec![0; table.rows()];
    for (number, rows) in grouped(table).into_iter().enumerate() {
        rows.into_iter().for_each(|row| numbers[row] = number);
    }
    numbers
}
