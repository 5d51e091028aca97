//! Statistics of columns within groups of rows.

use std::collections::HashMap;

use arrow::array::ArrayRef;
use arrow::datatypes::{Field, Metadata, Schema};
use polars::prelude::{
    DataFrame, Expr, IntoLazy, NamedFrom, QuantileMethod, Series, SortMultipleOptions, col, len,
    lit, when,
};

use crate::aggregate::statistics::{
    self, COUNT, GROUP_COLUMNS, LOAD_MIDPOINT, LOAD_OF_GROUP, SAMPLING_UNIT, SURFACES, UNCONVERGED,
    UNFITTED, mean_of,
};
use crate::aggregate::{Groups, Statistic, theory};
use crate::columns::{
    AREA_CORRECTED, AREA_FRACTION, CONTACT_NODES, ENERGY, FORCE, HARDNESS, HARDNESS_REDUCED, LOAD,
    PRESSURE, STOP,
};
use crate::fit::status::{FITTED, STATUS};
use crate::solve::UNCONVERGED as STOPS_UNCONVERGED;
use crate::{StageError, ensemble};
use asperity_manifest::decimal;
use asperity_queries::engine;
use asperity_queries::frame::{self, polars_error};
use asperity_tables::column::{Column, Role};
use asperity_tables::table::Table;

/// Quantities that vanish at zero load. The slope at the first load is taken from the origin.
const FROM_ZERO: [Column; 4] = [AREA_FRACTION, AREA_CORRECTED, CONTACT_NODES, ENERGY];

/// Computes the statistics of each group, in ascending order of the columns that define groups.
///
/// # Errors
/// Returns an error if a column is missing or holds no numbers, or if a column that should define
/// groups differs within a group.
pub fn reduce(table: &Table, groups: &Groups) -> Result<Table, StageError> {
    let names = GroupNames::new(table, groups);
    let table = &ensemble::without_repeated_rows(table)?;
    let mut frame = frame::from_table(table)?;
    for name in names.shown.iter().chain(&groups.over) {
        require(&frame, name)?;
    }
    let units = ensemble::sampling_units(table)?;
    let units = Series::new(SAMPLING_UNIT.into(), units).into();
    frame.with_column(units).map_err(polars_error)?;
    let keys: Vec<Expr> = names.keys.iter().map(|name| col(name.as_str())).collect();
    let mut rows = frame.lazy();
    if groups.needs_errors() {
        rows = statistics::with_sums(rows, &keys, &groups.over)?;
    }
    let mut reduced = rows
        .group_by_stable(keys.clone())
        .agg(aggregations(table, &names, groups))
        .sort_by_exprs(keys, SortMultipleOptions::default().with_maintain_order(true));
    if names.load.is_some() {
        reduced = reduced.filter(is_complete(&names)?);
    }
    if groups.statistics.iter().any(|s| matches!(s, Statistic::Slope | Statistic::Secant)) {
        reduced = reduced.with_columns(against_load(&names, groups)?);
    }
    for level in groups.levels() {
        let ends = groups.over.iter().flat_map(|name| statistics::ends(name, level));
        reduced = reduced.with_columns(ends.collect::<Vec<_>>());
    }
    let reduced = engine::on_query_thread(|| reduced.collect().map_err(polars_error))?;
    names.check_stand_ins(&reduced)?;
    let chosen = output(table, &names, groups);
    let selected = reduced.select(chosen).map_err(polars_error)?;
    let columns = frame::columns(&selected)?;
    let reduced = with_meanings(table, columns, selected.height());
    theory::with_theories(&reduced, groups)
}

/// Returns the expression that selects groups with as many rows as the largest group of the same
/// curve. A curve consists of the groups that differ only in the load.
///
/// At a load at which some surfaces have no row, because it failed or was not requested for them,
/// the mean over the others belongs to another ensemble. A mean curve leaves such loads out.
fn is_complete(names: &GroupNames) -> Result<Expr, StageError> {
    let count = || col(COUNT.name);
    Ok(count().eq(names.over_curves(count().max())?))
}

fn require(frame: &DataFrame, name: &str) -> Result<(), StageError> {
    frame
        .column(name)
        .map(drop)
        .map_err(|_| StageError::Aggregate { reason: format!("the input has no column `{name}`") })
}

fn aggregations(table: &Table, names: &GroupNames, groups: &Groups) -> Vec<Expr> {
    let mut expressions = names.within_groups();
    expressions.extend(counts(table).into_iter().map(|(column, count)| count.alias(column.name)));
    for name in &groups.over {
        // Slopes and secants need the mean, even if it is not requested.
        expressions.push(col(name.as_str()).mean().alias(mean_of(name)));
        for &statistic in &groups.statistics {
            if let Some(expression) = within_group(col(name.as_str()), statistic) {
                expressions.push(expression.alias(statistic.column_of(name)));
            }
        }
        if groups.needs_errors() {
            expressions.extend(statistics::of_group(name));
            let error = statistics::standard_error(name);
            expressions.push(error.alias(Statistic::Sem.column_of(name)));
        }
    }
    expressions
}

/// Returns the columns that count the rows of a group, with their expressions.
fn counts(table: &Table) -> Vec<(Column, Expr)> {
    let mut counts = vec![(COUNT, len())];
    if !table.in_role(Role::Surface).names().is_empty() {
        counts.push((SURFACES, col(SAMPLING_UNIT).n_unique()));
    }
    if table.has(STOP.name) {
        let unconverged = STOPS_UNCONVERGED.map(|stop| col(STOP.name).eq(lit(stop)));
        let any = unconverged.into_iter().reduce(|one, other| one.or(other));
        counts.push((UNCONVERGED, any.expect("there are such codes").sum()));
    }
    // Failed fits have nulls instead of values.
    if table.texts(STATUS.name).is_ok() {
        counts.push((UNFITTED, col(STATUS.name).neq(lit(FITTED.word)).sum()));
    }
    counts
}

fn within_group(values: Expr, statistic: Statistic) -> Option<Expr> {
    Some(match statistic {
        Statistic::Mean => values.mean(),
        Statistic::Sd => values.std(1),
        Statistic::Min => values.min(),
        Statistic::Max => values.max(),
        Statistic::Quantile(share) => values.quantile(lit(share), QuantileMethod::Linear),
        Statistic::RegressionSlope => statistics::slope(&values),
        Statistic::RegressionIntercept => statistics::intercept(&values),
        Statistic::Sem | Statistic::Confidence(_) => return None,
        Statistic::Slope | Statistic::Secant | Statistic::Approach => return None,
    })
}

/// Returns the expressions of secants and of slopes by finite differences of the mean curve. The
/// load must ascend within each curve.
fn against_load(names: &GroupNames, groups: &Groups) -> Result<Vec<Expr>, StageError> {
    let before = |values: Expr| names.over_curves(values.shift(lit(1)));
    let load = || col(LOAD_OF_GROUP);
    let load_before = before(load())?.fill_null(lit(0.0));
    let midpoint = (load() + load_before.clone()) / lit(2.0);
    let mut expressions = vec![midpoint.alias(LOAD_MIDPOINT.name)];
    for name in &groups.over {
        let mean = || col(mean_of(name));
        let starts_at_zero = FROM_ZERO.iter().any(|column| column.name == name);
        let mean_before =
            if starts_at_zero { before(mean())?.fill_null(lit(0.0)) } else { before(mean())? };
        for &statistic in &groups.statistics {
            let expression = match statistic {
                Statistic::Slope => (mean() - mean_before.clone()) / (load() - load_before.clone()),
                Statistic::Secant => mean() / load(),
                _ => continue,
            };
            expressions.push(expression.alias(statistic.column_of(name)));
        }
    }
    Ok(expressions)
}

/// Returns the names of the columns of the reduced table, followed by columns that only theories
/// need.
fn output(table: &Table, names: &GroupNames, groups: &Groups) -> Vec<String> {
    let mut output = names.shown.clone();
    output.extend(counts(table).into_iter().map(|(column, _)| column.name.to_owned()));
    if groups.statistics.contains(&Statistic::Slope) {
        output.push(LOAD_MIDPOINT.name.to_owned());
    }
    for name in &groups.over {
        let within =
            groups.statistics.iter().filter(|&&statistic| statistic != Statistic::Approach);
        let ends = within.flat_map(|statistic| statistic.suffixes());
        output.extend(ends.map(|end| format!("{name}_{end}")));
    }
    output.extend(names.load.iter().map(|_| LOAD_OF_GROUP.to_owned()));
    output.extend(groups.over.iter().map(|name| mean_of(name)));
    output
}

/// Pairs of columns that hold the same quantity in two units, of which a manifest gives one.
const IN_TWO_UNITS: [[&str; 2]; 2] =
    [[LOAD.name, PRESSURE.name], [HARDNESS.name, HARDNESS_REDUCED.name]];

/// Columns that define the groups.
///
/// A derived column (see [`Role::Derived`]) repeats another column in a different unit, as the
/// force does. If loads are given in pascals, the reduced load is derived: it differs between
/// surfaces and must not split groups. Groups are then distinguished by the pressure, from which
/// the reduced load is derived.
pub(super) struct GroupNames {
    /// Columns of the reduced table that describe a group, in order.
    shown: Vec<String>,
    /// Columns whose values distinguish groups.
    keys: Vec<String>,
    /// Shown columns that are derived from a shown key. Their values may differ within a group.
    derived: Vec<String>,
    /// Pairs (shown column, key that is not shown). The shown column is derived from the key and
    /// must not differ within a group.
    stand_ins: Vec<(String, String)>,
    /// Key that is a load, if there is one.
    load: Option<String>,
}

impl GroupNames {
    /// Resolves the columns of `group_by`. The default is all columns that identify rows, except
    /// those that distinguish surfaces.
    pub(super) fn new(table: &Table, groups: &Groups) -> GroupNames {
        let given = || table.coordinates().not_in_role(Role::Surface);
        let default = || given().names().into_iter().map(str::to_owned).collect();
        let shown: Vec<String> = groups.group_by.clone().unwrap_or_else(default);
        let load = ensemble::load_column(table);
        let derived = table.in_role(Role::Derived);
        // Stacked tables of both kinds have both columns in the role of a load.
        let is_derived = |name: &str| derived.has(name) || (is_of_a_load(name) && name != load);
        let (mut keys, mut stand_ins) = (Vec::new(), Vec::new());
        for name in &shown {
            let coordinate = coordinate_of(table, name).filter(|_| is_derived(name));
            match coordinate {
                None => keys.push(name.clone()),
                Some(coordinate) if shown.iter().any(|other| other == coordinate) => {}
                Some(coordinate) => {
                    keys.push(coordinate.to_owned());
                    stand_ins.push((name.clone(), coordinate.to_owned()));
                }
            }
        }
        let derived = shown.iter().filter(|&name| !keys.contains(name)).cloned();
        let is_load = |name: &&String| IN_TWO_UNITS[0].contains(&name.as_str());
        GroupNames {
            derived: derived.collect(),
            load: keys.iter().find(is_load).cloned().filter(|_| table.has(LOAD.name)),
            shown,
            keys,
            stand_ins,
        }
    }

    /// Returns the columns whose values distinguish groups.
    pub(super) fn keys(&self) -> impl Iterator<Item = &str> {
        self.keys.iter().map(String::as_str)
    }

    /// Returns an expression within each curve: the groups that agree in all keys except the load.
    fn over_curves(&self, expression: Expr) -> Result<Expr, StageError> {
        let keys = self.keys.iter().filter(|name| !is_of_a_load(name));
        let columns: Vec<Expr> = keys.map(|name| col(name.as_str())).collect();
        if columns.is_empty() {
            return Ok(expression);
        }
        Ok(expression.over(columns).map_err(polars_error)?)
    }

    /// Returns the expressions for the derived columns of a group: the common value of the rows or,
    /// if they differ, the mean.
    fn within_groups(&self) -> Vec<Expr> {
        let mut expressions: Vec<Expr> = self.derived.iter().map(|name| common(name)).collect();
        let differs = self.stand_ins.iter();
        expressions.extend(differs.map(|(name, _)| is_mixed(name).alias(mixed(name))));
        if self.load.is_some() {
            expressions.push(common(LOAD.name).alias(LOAD_OF_GROUP));
        }
        expressions
    }

    /// Returns an error if a column that replaces a key differs within a group.
    fn check_stand_ins(&self, reduced: &DataFrame) -> Result<(), StageError> {
        for (name, coordinate) in &self.stand_ins {
            let flags = reduced.column(&mixed(name)).map_err(polars_error)?;
            if flags.bool().map_err(polars_error)?.any() {
                let reason = format!(
                    "cannot group by `{name}`, which is derived from `{coordinate}` and differs \
                     between surfaces: group by `{coordinate}`"
                );
                return Err(StageError::Aggregate { reason });
            }
        }
        Ok(())
    }
}

/// Returns the column from which a derived column is computed.
fn coordinate_of(table: &Table, derived: &str) -> Option<&'static str> {
    if derived == FORCE.name {
        return Some(ensemble::load_column(table));
    }
    let pair = IN_TWO_UNITS.iter().find(|pair| pair.contains(&derived))?;
    pair.iter().copied().find(|&name| name != derived && table.has(name))
}

fn is_of_a_load(name: &str) -> bool {
    IN_TWO_UNITS[0].contains(&name) || name == FORCE.name
}

/// Returns the common value of the rows of a group, or their mean if they differ by more than
/// rounding.
fn common(name: &str) -> Expr {
    when(is_mixed(name))
        .then(col(name).mean())
        .otherwise(col(name).drop_nulls().first())
        .alias(name)
}

fn is_mixed(name: &str) -> Expr {
    let (least, most) = (col(name).min(), col(name).max());
    let spread = most.clone() - least;
    spread.gt(most * lit(decimal::RESOLUTION))
}

/// Returns the name of the intermediate column that flags groups in which a column differs. Names
/// of users' columns have no spaces.
fn mixed(name: &str) -> String {
    format!("{name} differs")
}

/// Creates the reduced table. Each statistic inherits unit and meaning from the input column.
fn with_meanings(table: &Table, columns: Vec<(String, ArrayRef)>, rows: usize) -> Table {
    let schema = table.batch().schema();
    let own: HashMap<&str, Column> = GROUP_COLUMNS.map(|column| (column.name, column)).into();
    let field = |name: &str, array: &ArrayRef| {
        if let Some(column) = own.get(name) {
            return column.field();
        }
        if let Ok(field) = schema.field_with_name(name) {
            return field.clone();
        }
        let sources =
            schema.fields().iter().filter(|f| name.starts_with(&format!("{}_", f.name())));
        let source = sources.max_by_key(|field| field.name().len());
        let metadata = source.map(|field| {
            let suffix = &name[field.name().len() + 1..];
            let statistic = statistics::meaning(suffix).unwrap_or_else(|| suffix.to_owned());
            inherited(field, suffix, &statistic)
        });
        Field::new(name, array.data_type().clone(), true)
            .with_metadata(metadata.unwrap_or_default())
    };
    let fields: Vec<Field> = columns.iter().map(|(name, array)| field(name, array)).collect();
    let arrays = columns.into_iter().map(|(_, array)| array).collect();
    Table::from_arrays(rows, Schema::new(fields), arrays)
}

/// Returns the metadata of the column with a statistic of a column. The name of the statistic is
/// `suffix`, and its meaning is `statistic`.
pub(super) fn inherited(source: &Field, suffix: &str, statistic: &str) -> Metadata {
    let of = |entry: &str| source.metadata().get(entry).cloned().unwrap_or_default();
    let unit = match suffix {
        "freedom" | "share" => "1".to_owned(),
        "slope" | "secant" | "regr_slope" => format!("{} per load", of("unit")),
        _ => of("unit"),
    };
    Metadata::new()
        .with("role", "result")
        .with("unit", unit)
        .with("meaning", format!("{statistic} of: {}", of("meaning")))
}

#[cfg(test)]
mod tests;
