//! Checks of the tables `[claim.NAME]` and `[data.NAME]` of a manifest or a file of claims.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    AskedLoad, ClaimSpec, DataSpec, Loads, ReferenceValues, Regression, SPECTRUM, Source, Test,
};
use crate::manifest::claim::{
    ClaimTable, DataTable, LoadKey, Origin, QuantityKey, RangeKey, Statistic, WrittenClaims,
};
use crate::manifest::figure::{Selected, WrittenTable};
use crate::study::columns::{ColumnChecks, StageTables, all, is_number, part_of};
use asperity_manifest::diagnostics::{Problem, Problems, listed, suggestion};
use asperity_manifest::expression::Expression;
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::quantity::{self, Unit};
use asperity_manifest::keys::{Key, KeyTable, Spanned};
use asperity_manifest::names::MAX_LENGTH;
use asperity_stages::aggregate::Model;
use asperity_stages::columns::{LOAD, PRESSURE};
use asperity_stages::ensemble::load_column;
use asperity_statistics::expectation::Expectation;
use asperity_tables::column::Role;
use asperity_tables::table::Table;

/// Origin of claims, and the tables that they can name.
#[derive(Clone, Copy)]
pub struct ClaimContext<'a, 't> {
    /// File of the claims, or `None` for those of the manifest.
    pub file: Option<&'a str>,
    pub tables: StageTables<'a, 't>,
    /// Function that reads a table of reference values.
    pub reference: &'a dyn Fn(&str) -> Result<String, String>,
}

/// Checks claims. Returns `None` after reporting the problems of one of them.
pub fn check(
    written: &WrittenClaims,
    context: ClaimContext,
    problems: &mut Problems,
) -> Option<Vec<ClaimSpec>> {
    let mut data: BTreeMap<String, Option<DataSpec>> = BTreeMap::new();
    // Data that others use come first.
    let mut sorted: Vec<&WrittenTable<DataTable>> = written.data.iter().collect();
    sorted.sort_by_key(|table| {
        let point = table.keys.points.first();
        point.is_some_and(|point| point.table.otherwise.written().is_some())
    });
    for table in sorted {
        let spec = checked(table, "data", context, &data, problems, |checker, name, keys| {
            checker.data(name, keys)
        });
        data.insert(table.name.value.clone(), spec);
    }
    let claims = written.claims.iter();
    let claims: Option<_> = all(claims.map(|table| {
        checked(table, "claim", context, &data, problems, |checker, name, keys| {
            checker.claim(name, keys)
        })
    }));
    claims.filter(|_| data.values().all(Option::is_some))
}

fn checked<'a, T: KeyTable, S>(
    table: &'a WrittenTable<T>,
    what: &str,
    context: ClaimContext<'a, '_>,
    data: &'a BTreeMap<String, Option<DataSpec>>,
    problems: &mut Problems,
    check: impl FnOnce(&mut Checker<'_, '_, '_>, &Spanned<String>, &T) -> Option<S>,
) -> Option<S> {
    check_name(what, &table.name, problems);
    let point = table.keys.points.first()?;
    let checks = &mut Checks::new(&table.keys, point, problems);
    let columns = ColumnChecks { tables: context.tables, checks };
    check(&mut Checker { context, columns, data }, &table.name, &point.table)
}

/// Reports a name that conditions on claims or expressions could not contain.
fn check_name(what: &str, name: &Spanned<String>, problems: &mut Problems) {
    let Spanned { value, span } = name;
    let is_part = |letter: char| letter.is_ascii_alphanumeric() || "_-.".contains(letter);
    let starts = value.starts_with(|letter: char| letter.is_ascii_alphabetic());
    let (message, help) = if !starts || !value.chars().all(is_part) || value.len() > MAX_LENGTH {
        let help = format!(
            "a name starts with a letter, continues with letters, digits, `_`, `-` or `.`, and has \
             at most {MAX_LENGTH} characters"
        );
        (format!("{value:?} is not a valid name of a {what}"), help)
    } else if what == "data" && (value.contains(['-', '.']) || VALUES.contains(&value.as_str())) {
        let help = "expressions name data: write letters, digits and `_`, and no name that \
                    expressions already have";
        (format!("data cannot be called `{value}`"), help.to_owned())
    } else {
        return;
    };
    problems.push(Problem::new(message, span.clone(), "choose another").help(help));
}

/// Names of values of a group in expressions, besides its parameters and theories.
const VALUES: [&str; 10] = [
    "this",
    "load",
    "deviation",
    "error",
    "surfaces",
    "reference",
    "persson_load",
    "next",
    "previous",
    "first",
];
/// Names of results of a regression in expressions.
const REGRESSION: [&str; 12] = [
    "slope1",
    "slope2",
    "step1",
    "step2",
    "step3",
    "range1",
    "range2",
    "range3",
    "residual1",
    "residual2",
    "residual3",
    "spread",
];

/// Names that an expression of a claim can have.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Level {
    /// Parameters of a group.
    Parameters,
    /// Values of a group, and of those that it is compared with.
    Values,
}

/// Checks of one table.
struct Checker<'a, 'c, 't> {
    context: ClaimContext<'a, 't>,
    columns: ColumnChecks<'a, 'c, 't>,
    /// Checked data by name; `None` for data with problems.
    data: &'a BTreeMap<String, Option<DataSpec>>,
}

type Ranges = Key<BTreeMap<String, Spanned<RangeKey>>>;

fn text(key: &Key<String>) -> Option<String> {
    key.written().map(|text| text.value.clone())
}

impl Checker<'_, '_, '_> {
    fn data(&mut self, name: &Spanned<String>, keys: &DataTable) -> Option<DataSpec> {
        let source = match (keys.from.written(), keys.kind.written()) {
            (Some(from), None) => self.stage(from)?,
            (None, Some(kind)) => Source::Spectra(kind.value.kind()),
            _ => {
                let message = format!("`[data.{}]` needs either `from` or `kind`", name.value);
                return self.columns.refuse(message, &name.span, "in this table");
            }
        };
        let otherwise = match keys.otherwise.written() {
            Some(other) => Some(Box::new(self.named_data(other)?)),
            None => None,
        };
        let spec = self.values(&name.value, source, &keys.value, &keys.selection, &keys.within)?;
        Some(DataSpec {
            label: text(&keys.label).unwrap_or_else(|| spec.label.clone()),
            otherwise,
            needs: text(&keys.needs),
            needs_groups: text(&keys.needs_groups),
            ..spec
        })
    }

    fn stage(&mut self, from: &Spanned<String>) -> Option<Source> {
        self.columns.stage(from)?;
        Some(Source::Stage(from.value.clone()))
    }

    fn named_data(&mut self, name: &Spanned<String>) -> Option<DataSpec> {
        if let Some(spec) = self.data.get(name.value.as_str()) {
            return spec.clone();
        }
        let known = || self.data.keys().map(String::as_str);
        let message = format!("there is no table `[data.{}]`", name.value);
        let label = suggestion('"', &name.value, known(), "unknown data");
        let problem = Problem::new(message, name.span.clone(), label);
        self.columns.checks.reject(match self.data.is_empty() {
            true => problem.help("for a single stage, write `from` and `value` in the claim"),
            false => problem.help(format!("the tables of data are {}", listed(known(), "and"))),
        })
    }

    /// Checks the columns of values, with the keys that tables of claims and of data share.
    fn values(
        &mut self,
        name: &str,
        source: Source,
        value: &Key<String>,
        selection: &Key<BTreeMap<String, Spanned<Selected>>>,
        within: &Ranges,
    ) -> Option<DataSpec> {
        let stage = match &source {
            Source::Stage(stage) => Some(stage.as_str()),
            Source::Spectra(_) => None,
        };
        let table = match stage {
            Some(stage) => Some(self.columns.table(stage)?),
            None => None,
        };
        let written = self.columns.checks.required("value", value)?;
        let value = self.columns.expression(written)?;
        for column in value.columns().into_iter().filter(|_| stage.is_some()) {
            self.columns.number(stage?, &part_of(written, column))?;
        }
        Some(DataSpec {
            name: name.to_owned(),
            label: match stage {
                Some(stage) => format!("`{}` of `{stage}`", written.value),
                None => format!("`{}`", written.value),
            },
            within: self.ranges(within, &[], Level::Parameters, table)?,
            selection: self.columns.selection(stage, selection)?,
            source,
            value,
            otherwise: None,
            needs: None,
            needs_groups: None,
        })
    }

    /// Parses an expression and checks the names in it.
    fn expression(
        &mut self,
        text: &Spanned<String>,
        data: &[DataSpec],
        level: Level,
        table: Option<&Table>,
    ) -> Option<Expression> {
        let expression = self.columns.expression(text)?;
        let known = known_names(data, level, table);
        let Some(unknown) = expression.columns().into_iter().find(|name| !is_known(name, &known))
        else {
            return Some(expression);
        };
        let known = || known.iter().map(String::as_str);
        let label = suggestion('`', unknown, known(), "unknown name");
        let message = format!("`{}` uses `{unknown}`", text.value);
        let problem = Problem::new(message, part_of(text, unknown).span, label);
        let help = format!("names are {}", listed(known(), "and"));
        self.columns.checks.reject(problem.help(help))
    }

    fn expressions(
        &mut self,
        key: &Key<Vec<Spanned<String>>>,
        data: &[DataSpec],
        table: Option<&Table>,
    ) -> Option<Option<Vec<Expression>>> {
        let Some(written) = key.written() else { return Some(None) };
        let texts = written.value.iter();
        let expressions = texts.map(|text| self.expression(text, data, Level::Parameters, table));
        expressions.collect::<Option<_>>().map(Some)
    }

    fn ranges(
        &mut self,
        key: &Ranges,
        data: &[DataSpec],
        level: Level,
        table: Option<&Table>,
    ) -> Option<Vec<(Expression, Expectation)>> {
        let ranges = key.written().into_iter().flat_map(|all| &all.value);
        let checked = ranges.map(|(text, range)| {
            let text = Spanned { value: text.clone(), span: range.span.clone() };
            Some((self.expression(&text, data, level, table)?, self.range(range, None)?))
        });
        checked.collect()
    }

    /// Checks a range. A bound with a unit is converted to the unit `of` of the quantity.
    fn range(&mut self, range: &Spanned<RangeKey>, of: Option<&Unit>) -> Option<Expectation> {
        let text = match &range.value {
            RangeKey::Number(number) => return Some(Expectation::within(*number, *number)),
            RangeKey::List([low, high]) if low <= high => {
                return Some(Expectation::within(*low, *high));
            }
            RangeKey::List(_) => {
                let message = "the range ends below its beginning";
                return self.columns.refuse(message, &range.span, "swap the numbers");
            }
            RangeKey::Word(text) => text.trim(),
        };
        let Some(rest) = text.strip_prefix(['<', '>']) else {
            let message = format!("{text:?} is not a range");
            let label = "write `\"> 0\"`, `\">= 0.1\"`, `\"< 1\"`, `\"<= 1\"` or `[0.9, 1.1]`";
            return self.columns.refuse(message, &range.span, label);
        };
        let bound = rest.strip_prefix('=').unwrap_or(rest).trim();
        let number = self.columns.checks.accept(quantity::in_unit(bound, of), &range.span)?;
        let ends = if text.starts_with('>') {
            [number, f64::INFINITY]
        } else {
            [f64::NEG_INFINITY, number]
        };
        Some(Expectation { range: ends, is_strict: !rest.starts_with('=') })
    }

    fn claim(&mut self, name: &Spanned<String>, keys: &ClaimTable) -> Option<ClaimSpec> {
        self.columns.checks.required("text", &keys.text)?;
        let origin = keys.origin.value().unwrap_or(Origin::Study);
        let (test, unit, expected) = match origin {
            Origin::Misprint => (None, None, Expectation::within(f64::NEG_INFINITY, f64::INFINITY)),
            _ => {
                let test = self.test(keys)?;
                let unit = self.unit_of(&test);
                let expected = self.columns.checks.required("expected", &keys.expected)?;
                let range = self.range(expected, unit.as_deref().and_then(Unit::find))?;
                (Some(test), unit, range)
            }
        };
        let quantity = text(&keys.description).unwrap_or_else(|| {
            let quantities = test.iter().flat_map(|test| &test.quantities);
            let expressions = quantities.map(|(_, expression)| expression.to_string());
            expressions.collect::<Vec<_>>().join("; ")
        });
        Some(ClaimSpec {
            name: name.value.clone(),
            file: self.context.file.map(str::to_owned),
            origin,
            text: text(&keys.text)?,
            source: text(&keys.source).unwrap_or_default(),
            quantity: match unit {
                Some(unit) => format!("{quantity} in {unit}"),
                None => quantity,
            },
            expected,
            reason: text(&keys.reason).unwrap_or_default(),
            figure: text(&keys.figure),
            test,
        })
    }

    /// Returns the unit of the quantity of a claim, if the quantity is a sum or difference of
    /// values of one column with a unit.
    fn unit_of(&self, test: &Test) -> Option<String> {
        let [data] = test.data.as_slice() else { return None };
        let (Source::Stage(stage), Expression::Column(column)) = (&data.source, &data.value) else {
            return None;
        };
        let is_linear = |(_, expression): &(_, Expression)| {
            let text = expression.to_string();
            ["this", "next - this", "this - first", "error", "deviation"].contains(&text.as_str())
        };
        test.quantities.iter().all(is_linear).then(|| self.unit_of_column(stage, column))?
    }

    /// Returns the unit of a column of a stage, if it is known.
    fn unit_of_column(&self, stage: &str, column: &str) -> Option<String> {
        let table = self.columns.table(stage)?;
        let field = table.batch().schema_ref().field_with_name(column).ok()?;
        (self.context.tables.units)(stage).shown_of(field)
    }

    fn test(&mut self, keys: &ClaimTable) -> Option<Test> {
        let data = self.data_of(keys)?;
        let table = match data.first().map(|data| &data.source) {
            Some(Source::Stage(stage)) => Some(self.columns.table(stage)?),
            _ => None,
        };
        let along = keys.along.written().into_iter().flat_map(|along| &along.value);
        for parameter in along.clone().filter(|parameter| parameter.value != "load") {
            self.expression(parameter, &data, Level::Parameters, table)?;
        }
        let regression = match (keys.regress.written(), keys.on.written()) {
            (None, None) => None,
            (Some(of), Some(_)) => Some(Regression {
                of: self.expression(of, &data, Level::Values, table)?,
                on: self.expressions(&keys.on, &data, table)??,
            }),
            (regress, on) => {
                let span = regress.map(|key| &key.span).or(on.map(|key| &key.span))?;
                let message = "`regress` and `on` are used together";
                return self.columns.refuse(message, span, "the other key is missing");
            }
        };
        let order = self.expressions(&keys.order, &data, table)?.unwrap_or_default();
        let quantities = self.quantities(keys, &data, table)?;
        for (key, is_written, names) in [
            ("along", keys.along.0.is_some(), &["next", "previous"][..]),
            ("order", !order.is_empty(), &["first"][..]),
            ("regress", regression.is_some(), &REGRESSION[..]),
            ("reference", keys.reference.0.is_some(), &["reference"][..]),
        ] {
            let used = quantities.iter().flat_map(|(_, expression)| expression.columns());
            let mut used = used.filter(|used| names.contains(&prefix(used, names)));
            if let (Some(used), false) = (used.next(), is_written) {
                let message = format!("the quantity uses `{used}`, but the claim has no `{key}`");
                let quantity = keys.quantity.written().map(|quantity| &quantity.span);
                let span = quantity.or(keys.text.written().map(|text| &text.span))?;
                let label = format!("`{key}` says what `{used}` is");
                return self.columns.refuse(message, span, label);
            }
        }
        let areas = keys.areas.written().into_iter().flat_map(|areas| &areas.value);
        Some(Test {
            loads: self.loads(keys, &data, table)?,
            areas: areas.map(|area| area.value).collect(),
            between: keys.between.written().map_or_else(Vec::new, |all| all.value.clone()),
            statistic: keys.statistic.value(),
            from_zero: keys.from_zero.value().unwrap_or(false),
            reduce: keys.reduce.value(),
            reference: self.reference(keys)?,
            reference_file: text(&keys.reference),
            needs: text(&keys.needs),
            along: along.map(|parameter| parameter.value.clone()).collect(),
            equal: self.expressions(&keys.equal, &data, table)?,
            per: self.expressions(&keys.per, &data, table)?,
            tested: self.ranges(&keys.tested, &data, Level::Values, table)?,
            data,
            regression,
            order,
            quantities,
        })
    }

    fn data_of(&mut self, keys: &ClaimTable) -> Option<Vec<DataSpec>> {
        let checks = &mut *self.columns.checks;
        if let Some(names) = keys.data.written() {
            let why = "`data` names tables that have this key";
            checks.forbidden("from", &keys.from, why)?;
            checks.forbidden("value", &keys.value, why)?;
            checks.forbidden("where", &keys.selection, why)?;
            let named = names.value.iter().map(|name| self.named_data(name));
            let mut data: Vec<DataSpec> = named.collect::<Option<_>>()?;
            let within = self.ranges(&keys.within, &[], Level::Parameters, None)?;
            data[0].within.extend(within);
            return Some(data);
        }
        if keys.statistic.value().is_some_and(Statistic::is_closed_form) {
            return Some(Vec::new());
        }
        let from = checks.required("from", &keys.from)?;
        let source = self.stage(from)?;
        let data = self.values("this", source, &keys.value, &keys.selection, &keys.within)?;
        Some(vec![data])
    }

    fn quantities(
        &mut self,
        keys: &ClaimTable,
        data: &[DataSpec],
        table: Option<&Table>,
    ) -> Option<Vec<(Option<String>, Expression)>> {
        let Some(written) = keys.quantity.written() else {
            return Some(vec![(None, Expression::Column("this".to_owned()))]);
        };
        let mut expression = |text| self.expression(text, data, Level::Values, table);
        match &written.value {
            QuantityKey::Word(text) => {
                let text = Spanned { value: text.clone(), span: written.span.clone() };
                Some(vec![(None, expression(&text)?)])
            }
            QuantityKey::Table(named) => {
                let texts = named.iter();
                texts.map(|(label, text)| Some((Some(label.clone()), expression(text)?))).collect()
            }
        }
    }

    fn loads(
        &mut self,
        keys: &ClaimTable,
        data: &[DataSpec],
        table: Option<&Table>,
    ) -> Option<Loads> {
        let Some(written) = keys.loads.written() else { return Some(Loads::All) };
        let mut loads = Vec::new();
        for load in &written.value {
            let (value, is_pressure) = match &load.value {
                LoadKey::Number(value) => (*value, false),
                LoadKey::Word(text) => match text.trim() {
                    "lightest" => return Some(Loads::Lightest),
                    "heaviest" => return Some(Loads::Heaviest),
                    text => {
                        let unit = match data.first().map(|data| &data.source) {
                            Some(Source::Stage(stage)) => self.unit_of_column(stage, PRESSURE.name),
                            _ => None,
                        };
                        let unit = unit.as_deref().and_then(Unit::find);
                        let value = quantity::in_unit(text, unit);
                        (self.columns.checks.accept(value, &load.span)?, true)
                    }
                },
            };
            loads.push(AskedLoad { value, is_pressure });
        }
        if table.is_some_and(|table| !table.has(load_column(table))) {
            let message = "the table has no loads";
            return self.columns.refuse(message, &written.span, "leave `loads` out");
        }
        Some(Loads::At(loads))
    }

    fn reference(&mut self, keys: &ClaimTable) -> Option<ReferenceValues> {
        let Some(written) = keys.reference.written() else { return Some(Vec::new()) };
        let text = (self.context.reference)(&written.value);
        match text.and_then(|text| reference_values(&text)) {
            Ok(values) => Some(values),
            Err(reason) => {
                let message = format!("cannot read the table `{}`: {reason}", written.value);
                self.columns.refuse(message, &written.span, "named here")
            }
        }
    }
}

/// Reads CSV with a header of parameters; the first other column has the values, and further ones
/// are ignored.
fn reference_values(text: &str) -> Result<ReferenceValues, String> {
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text.as_bytes());
    let names = reader.headers().map_err(|error| error.to_string())?.clone();
    let Some(value) = names.iter().position(|name| !SPECTRUM.contains(&name)) else {
        return Err("its first line has no column besides parameters".to_owned());
    };
    let rows = reader.deserialize().map(|cells| {
        let cells: Vec<f64> = cells?;
        let own = names.iter().zip(&cells).filter(|(name, _)| SPECTRUM.contains(name));
        let parameters = own.map(|(name, cell)| (name.to_owned(), *cell));
        Ok((parameters.collect(), cells[value]))
    });
    rows.collect::<Result<_, csv::Error>>().map_err(|error| error.to_string())
}

/// Returns the name before the first underscore if it is one of `names`, or the whole name.
fn prefix<'n>(name: &'n str, names: &[&str]) -> &'n str {
    match name.split_once('_') {
        Some((prefix, _)) if names.contains(&prefix) => prefix,
        _ => name,
    }
}

/// Returns the names that expressions of a claim can have, without those of other groups.
fn known_names(data: &[DataSpec], level: Level, table: Option<&Table>) -> BTreeSet<String> {
    let mut names: BTreeSet<String> = match table {
        Some(table) => {
            let fields = table.batch().schema_ref().fields().iter();
            let parameters = fields.filter(|field| {
                Role::from_field(field) == Some(Role::Parameter) && is_number(table, field.name())
            });
            parameters.map(|field| field.name().clone()).collect()
        }
        None => SPECTRUM.map(str::to_owned).into(),
    };
    if level == Level::Values {
        names.extend(data.iter().map(|data| data.name.clone()));
        names.extend(VALUES.map(str::to_owned));
        names.extend(REGRESSION.map(str::to_owned));
        names.extend(Model::ALL.map(|model| model.word().replace('-', "_")));
        if table.is_some_and(|table| !table.has(LOAD.name)) {
            names.remove("persson_load");
        }
    }
    names
}

/// Returns whether a name, or the rest of the name of a property of another group, is known.
fn is_known(name: &str, known: &BTreeSet<String>) -> bool {
    let others = ["next_", "previous_", "first_"];
    let rest = others.iter().find_map(|prefix| name.strip_prefix(prefix));
    known.contains(name)
        || (known.contains("next") && rest.is_some_and(|rest| known.contains(rest)))
}
