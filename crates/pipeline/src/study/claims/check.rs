//! Checks of the tables `[claim.NAME]` and `[data.NAME]` of a manifest or a file of claims.

use std::collections::{BTreeMap, BTreeSet};

use super::{
    AskedLoad, ClaimSpec, DataSpec, Loads, ReferenceValues, Regression, SPECTRUM, Source, Test,
};
use crate::manifest::claim::{
    ClaimTable, DataTable, LoadKey, Origin, QuantityKey, RangeKey, SourceKind, Statistic,
    WrittenClaims,
};
use crate::manifest::figure::{Holds, Selected, WrittenTable};
use crate::study::figures::{holds, is_number};
use asperity_manifest::diagnostics::{Problem, Problems, Span, listed, suggestion};
use asperity_manifest::expression::Expression;
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::quantity::{self, Unit};
use asperity_manifest::keys::{Key, KeyTable, Spanned};
use asperity_manifest::names::MAX_LENGTH;
use asperity_stages::Kind;
use asperity_stages::aggregate::Model;
use asperity_stages::columns::{LOAD, PRESSURE, needed_key};
use asperity_stages::ensemble::load_column;
use asperity_stages::units::TableUnits;
use asperity_statistics::expectation::Expectation;
use asperity_tables::column::Role;
use asperity_tables::table::Table;

/// Stages of a study and files, as far as the checks of claims need them.
#[derive(Clone, Copy)]
pub struct ClaimContext<'a, 't> {
    /// File of the claims, or `None` for those of the manifest.
    pub file: Option<&'a str>,
    /// Names of the stages.
    pub stages: &'a [&'a str],
    /// Function that returns the table of a stage without rows, if its columns are known.
    pub table: &'a dyn Fn(&str) -> Option<&'t Table>,
    /// Function that returns the units of the table of a stage, if they are known.
    pub units: &'a dyn Fn(&str) -> Option<TableUnits>,
    /// Function that reads a table of reference values.
    pub reference: &'a dyn Fn(&str) -> Result<String, String>,
}

impl ClaimContext<'_, '_> {
    /// Returns the context of claims in a file, without a study.
    pub fn without_study() -> ClaimContext<'static, 'static> {
        let reference = &|_: &str| Err("there is no study".to_owned());
        ClaimContext { file: None, stages: &[], table: &|_| None, units: &|_| None, reference }
    }
}

/// Checks claims. Returns `None` after reporting the problems of one of them.
pub fn check(
    written: &WrittenClaims,
    context: &ClaimContext,
    problems: &mut Problems,
) -> Option<Vec<ClaimSpec>> {
    let mut data: BTreeMap<String, Option<DataSpec>> = BTreeMap::new();
    // Data that others use come first.
    let mut sorted: Vec<&WrittenTable<DataTable>> = written.data.iter().collect();
    sorted.sort_by_key(|table| point(table).is_some_and(|keys| keys.otherwise.written().is_some()));
    for table in sorted {
        check_name("data", &table.name, problems);
        let spec = table.keys.points.first().and_then(|point| {
            let mut checks = Checks::new(&table.keys, point, problems);
            Checker { context, checks: &mut checks, data: &data }.data(&table.name, &point.table)
        });
        data.insert(table.name.value.clone(), spec);
    }
    let mut claims = Vec::new();
    let mut complete = data.values().all(Option::is_some);
    for table in &written.claims {
        check_name("claim", &table.name, problems);
        let spec = table.keys.points.first().and_then(|point| {
            let mut checks = Checks::new(&table.keys, point, problems);
            Checker { context, checks: &mut checks, data: &data }.claim(&table.name, &point.table)
        });
        complete &= spec.is_some();
        claims.extend(spec);
    }
    complete.then_some(claims)
}

fn point<T: KeyTable>(table: &WrittenTable<T>) -> Option<&T> {
    table.keys.points.first().map(|point| &point.table)
}

/// Reports a name that conditions on claims or expressions could not contain.
fn check_name(what: &str, name: &Spanned<String>, problems: &mut Problems) {
    let is_part = |letter: char| letter.is_ascii_alphanumeric() || "_-.".contains(letter);
    let starts = name.value.starts_with(|letter: char| letter.is_ascii_alphabetic());
    let is_data = what == "data";
    let has_dash = name.value.contains(['-', '.']);
    if starts && name.value.chars().all(is_part) && name.value.len() <= MAX_LENGTH {
        if is_data && (has_dash || VALUES.contains(&name.value.as_str())) {
            let message = format!("data cannot be called `{}`", name.value);
            let help = "expressions name data: write letters, digits and `_`, and no name that \
                        expressions already have";
            problems.push(Problem::new(message, name.span.clone(), "choose another").help(help));
        }
        return;
    }
    let message = format!("{:?} is not a valid name of a {what}", name.value);
    let help = format!(
        "a name starts with a letter, continues with letters, digits, `_`, `-` or `.`, and has at \
         most {MAX_LENGTH} characters"
    );
    problems.push(Problem::new(message, name.span.clone(), "invalid name").help(help));
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
    context: &'a ClaimContext<'a, 't>,
    checks: &'a mut Checks<'c>,
    /// Checked data by name; `None` for data with problems.
    data: &'a BTreeMap<String, Option<DataSpec>>,
}

/// Keys that tables of claims and of data share.
struct DataKeys<'k> {
    name: &'k str,
    source: Source,
    value: &'k Key<String>,
    selection: &'k Key<BTreeMap<String, Spanned<Selected>>>,
    within: &'k Key<BTreeMap<String, Spanned<RangeKey>>>,
}

impl<'t> Checker<'_, '_, 't> {
    fn data(&mut self, name: &Spanned<String>, keys: &DataTable) -> Option<DataSpec> {
        let source = match (keys.from.written(), keys.kind.written()) {
            (Some(from), None) => self.stage(from)?,
            (None, Some(kind)) => Source::Spectra(match kind.value {
                SourceKind::Generate => Kind::Generate,
                SourceKind::Solve => Kind::Solve,
                SourceKind::Measure => Kind::Measure,
                SourceKind::Correct => Kind::Correct,
                SourceKind::Fit => Kind::Fit,
            }),
            _ => {
                let message = format!("`[data.{}]` needs either `from` or `kind`", name.value);
                return self.checks.reject(Problem::new(
                    message,
                    name.span.clone(),
                    "in this table",
                ));
            }
        };
        let otherwise = match keys.otherwise.written() {
            Some(other) => Some(Box::new(self.named_data(other)?)),
            None => None,
        };
        let shared = DataKeys {
            name: &name.value,
            source,
            value: &keys.value,
            selection: &keys.selection,
            within: &keys.within,
        };
        let spec = self.values(shared)?;
        let text = |key: &Key<String>| key.written().map(|text| text.value.clone());
        Some(DataSpec {
            label: text(&keys.label).unwrap_or_else(|| spec.label.clone()),
            otherwise,
            needs: text(&keys.needs),
            needs_groups: text(&keys.needs_groups),
            ..spec
        })
    }

    fn stage(&mut self, from: &Spanned<String>) -> Option<Source> {
        let stages = || self.context.stages.iter().copied();
        if stages().any(|stage| stage == from.value) {
            return Some(Source::Stage(from.value.clone()));
        }
        let message = format!("there is no stage {:?}", from.value);
        let label = suggestion('"', &from.value, stages(), "unknown stage");
        let help = format!("the stages are {}", listed(stages(), "and"));
        self.checks.reject(Problem::new(message, from.span.clone(), label).help(help))
    }

    fn named_data(&mut self, name: &Spanned<String>) -> Option<DataSpec> {
        if let Some(spec) = self.data.get(name.value.as_str()) {
            return spec.clone();
        }
        let known = || self.data.keys().map(String::as_str);
        let message = format!("there is no table `[data.{}]`", name.value);
        let label = suggestion('"', &name.value, known(), "unknown data");
        let problem = Problem::new(message, name.span.clone(), label);
        self.checks.reject(match self.data.is_empty() {
            true => problem.help("for a single stage, write `from` and `value` in the claim"),
            false => problem.help(format!("the tables of data are {}", listed(known(), "and"))),
        })
    }

    /// Checks the columns of values.
    fn values(&mut self, keys: DataKeys<'_>) -> Option<DataSpec> {
        let table = match &keys.source {
            Source::Stage(stage) => Some((self.context.table)(stage)?),
            Source::Spectra(_) => None,
        };
        let value = self.checks.required("value", keys.value)?;
        let expression = self.parsed(value)?;
        if let (Some(table), Source::Stage(stage)) = (table, &keys.source) {
            for column in expression.columns() {
                self.number(table, stage, column, &value.span)?;
            }
        }
        let within = self.ranges(keys.within, &[], Level::Parameters, table)?;
        let mut selection = BTreeMap::new();
        for (column, selected) in keys.selection.written().iter().flat_map(|all| &all.value) {
            if let (Some(table), Source::Stage(stage)) = (table, &keys.source)
                && !table.has(column)
            {
                return self.unknown_column(table, stage, column, &selected.span);
            }
            let held = match (table, &keys.source) {
                (Some(table), Source::Stage(stage)) => {
                    let units = (self.context.units)(stage).unwrap_or_default();
                    holds(table, &units, column)
                }
                _ => Holds::Others,
            };
            let values = selected.value.values(held);
            let values = self.checks.accept(values, &selected.span)?;
            selection.insert(column.clone(), values);
        }
        let label = match &keys.source {
            Source::Stage(stage) => format!("`{}` of `{stage}`", value.value),
            Source::Spectra(_) => format!("`{}`", value.value),
        };
        Some(DataSpec {
            name: keys.name.to_owned(),
            label,
            source: keys.source,
            value: expression,
            selection,
            within,
            otherwise: None,
            needs: None,
            needs_groups: None,
        })
    }

    fn number(&mut self, table: &Table, stage: &str, column: &str, span: &Span) -> Option<()> {
        if !table.has(column) {
            return self.unknown_column(table, stage, column, span);
        }
        if is_number(table, column) {
            return Some(());
        }
        let message = format!("the column {column:?} holds no numbers");
        self.checks.reject(Problem::new(message, span.clone(), "must be a column of numbers"))
    }

    fn unknown_column<T>(
        &mut self,
        table: &Table,
        stage: &str,
        column: &str,
        span: &Span,
    ) -> Option<T> {
        let message = format!("`{stage}` has no column {column:?}");
        let names = table.names();
        let is_known = |name: &str| table.has(name);
        if let Some(label) = needed_key(column, is_known) {
            return self.checks.reject(Problem::new(message, span.clone(), label));
        }
        let label = suggestion('"', column, names.iter().copied(), "unknown column");
        let help = format!("its columns are {}", listed(names, "and"));
        self.checks.reject(Problem::new(message, span.clone(), label).help(help))
    }

    fn parsed(&mut self, text: &Spanned<String>) -> Option<Expression> {
        match Expression::parse(&text.value) {
            Ok(expression) => Some(expression),
            Err(error) => {
                let span = error.span_in(&text.value, &text.span);
                let message = format!("`{}` is not an expression", text.value);
                self.checks.reject(Problem::new(message, span, error.reason))
            }
        }
    }

    /// Parses an expression and checks the names in it.
    fn expression(
        &mut self,
        text: &Spanned<String>,
        data: &[DataSpec],
        level: Level,
        table: Option<&Table>,
    ) -> Option<Expression> {
        let expression = self.parsed(text)?;
        let known = known_names(data, level, table);
        if let Some(unknown) = expression.columns().into_iter().find(|name| !is_known(name, &known))
        {
            let start = text.value.find(unknown).unwrap_or(0);
            let span = text.span.start + 1 + start..text.span.start + 1 + start + unknown.len();
            let is_inside = span.end < text.span.end;
            let span = if is_inside { span } else { text.span.clone() };
            let label = suggestion('`', unknown, known.iter().map(String::as_str), "unknown name");
            let help = format!("names are {}", listed(known.iter().map(String::as_str), "and"));
            let message = format!("`{}` uses `{unknown}`", text.value);
            return self.checks.reject(Problem::new(message, span, label).help(help));
        }
        Some(expression)
    }

    fn expressions(
        &mut self,
        key: &Key<Vec<Spanned<String>>>,
        data: &[DataSpec],
        table: Option<&Table>,
    ) -> Option<Option<Vec<Expression>>> {
        let Some(written) = key.written() else { return Some(None) };
        let texts = written.value.iter();
        let all = texts.map(|text| self.expression(text, data, Level::Parameters, table));
        Some(Some(all.collect::<Option<Vec<_>>>()?))
    }

    fn ranges(
        &mut self,
        key: &Key<BTreeMap<String, Spanned<RangeKey>>>,
        data: &[DataSpec],
        level: Level,
        table: Option<&Table>,
    ) -> Option<Vec<(Expression, Expectation)>> {
        let mut ranges = Vec::new();
        for (text, range) in key.written().iter().flat_map(|all| &all.value) {
            let text = Spanned { value: text.clone(), span: range.span.clone() };
            let expression = self.expression(&text, data, level, table)?;
            ranges.push((expression, self.range(range, None)?));
        }
        Some(ranges)
    }

    /// Checks a range. A bound with a unit is converted to the unit `of` of the quantity.
    fn range(&mut self, range: &Spanned<RangeKey>, of: Option<&Unit>) -> Option<Expectation> {
        let infinite = f64::INFINITY;
        let text = match &range.value {
            RangeKey::Number(number) => return Some(Expectation::within(*number, *number)),
            RangeKey::List([low, high]) if low <= high => {
                return Some(Expectation::within(*low, *high));
            }
            RangeKey::List(_) => {
                let message = "the range ends below its beginning";
                let problem = Problem::new(message, range.span.clone(), "swap the numbers");
                return self.checks.reject(problem);
            }
            RangeKey::Word(text) => text.trim(),
        };
        let signs = [(">=", false), ("<=", false), (">", true), ("<", true)];
        let found = signs.iter().find_map(|(sign, is_strict)| {
            Some((*sign, *is_strict, text.strip_prefix(*sign)?.trim()))
        });
        let Some((sign, is_strict, rest)) = found else {
            let message = format!("{text:?} is not a range");
            let label = "write `\"> 0\"`, `\">= 0.1\"`, `\"< 1\"`, `\"<= 1\"` or `[0.9, 1.1]`";
            return self.checks.reject(Problem::new(message, range.span.clone(), label));
        };
        let number = self.bound(rest, of, &range.span)?;
        let ends = if sign.starts_with('>') { [number, infinite] } else { [-infinite, number] };
        Some(Expectation { range: ends, is_strict })
    }

    fn bound(&mut self, text: &str, of: Option<&Unit>, span: &Span) -> Option<f64> {
        self.checks.accept(quantity::in_unit(text, of), span)
    }

    fn claim(&mut self, name: &Spanned<String>, keys: &ClaimTable) -> Option<ClaimSpec> {
        let text = self.checks.required("text", &keys.text)?.value.clone();
        let words = |key: &Key<String>| key.written().map(|text| text.value.clone());
        let origin = keys.origin.value().unwrap_or(Origin::Study);
        let anything = Expectation::within(f64::NEG_INFINITY, f64::INFINITY);
        let (test, unit, expected) = match origin {
            Origin::Misprint => (None, None, anything),
            _ => {
                let test = self.test(keys)?;
                let unit = self.unit_of(&test);
                let expected = self.checks.required("expected", &keys.expected)?;
                let range = self.range(expected, unit.as_deref().and_then(Unit::find))?;
                (Some(test), unit, range)
            }
        };
        let expressions = test.iter().flat_map(|test| &test.quantities);
        let expressions: Vec<String> =
            expressions.map(|(_, expression)| expression.to_string()).collect();
        let quantity = words(&keys.description).unwrap_or_else(|| expressions.join("; "));
        Some(ClaimSpec {
            name: name.value.clone(),
            file: self.context.file.map(str::to_owned),
            origin,
            text,
            source: words(&keys.source).unwrap_or_default(),
            quantity: match unit {
                Some(unit) => format!("{quantity} in {unit}"),
                None => quantity,
            },
            expected,
            reason: words(&keys.reason).unwrap_or_default(),
            figure: words(&keys.figure),
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
        let table = (self.context.table)(stage)?;
        let field = table.batch().schema_ref().field_with_name(column).ok()?;
        (self.context.units)(stage)?.shown_of(field)
    }

    fn test(&mut self, keys: &ClaimTable) -> Option<Test> {
        let data = self.data_of(keys)?;
        let table = match data.first().map(|data| &data.source) {
            Some(Source::Stage(stage)) => Some((self.context.table)(stage)?),
            _ => None,
        };
        let mut along = Vec::new();
        for parameter in keys.along.written().iter().flat_map(|along| &along.value) {
            if parameter.value != "load" {
                self.expression(parameter, &data, Level::Parameters, table)?;
            }
            along.push(parameter.value.clone());
        }
        let regression = match (keys.regress.written(), keys.on.written()) {
            (None, None) => None,
            (Some(of), Some(_)) => Some(Regression {
                of: self.expression(of, &data, Level::Values, table)?,
                on: self.expressions(&keys.on, &data, table)??,
            }),
            (Some(one), None) => return self.both(&one.span),
            (None, Some(other)) => return self.both(&other.span),
        };
        let equal = self.expressions(&keys.equal, &data, table)?;
        let per = self.expressions(&keys.per, &data, table)?;
        let order = self.expressions(&keys.order, &data, table)?.unwrap_or_default();
        let tested = self.ranges(&keys.tested, &data, Level::Values, table)?;
        let quantities = self.quantities(keys, &data, table)?;
        for (key, written, names) in [
            ("along", !along.is_empty(), &["next", "previous"][..]),
            ("order", !order.is_empty(), &["first"][..]),
            ("regress", regression.is_some(), &REGRESSION[..]),
            ("reference", keys.reference.written().is_some(), &["reference"][..]),
        ] {
            let used = quantities.iter().flat_map(|(_, expression)| expression.columns());
            let mut used = used.filter(|used| names.contains(&prefix(used, names)));
            if let (Some(used), false) = (used.next(), written) {
                let message = format!("the quantity uses `{used}`, but the claim has no `{key}`");
                let span = match keys.quantity.written() {
                    Some(quantity) => quantity.span.clone(),
                    None => keys.text.written()?.span.clone(),
                };
                let label = format!("`{key}` says what `{used}` is");
                return self.checks.reject(Problem::new(message, span, label));
            }
        }
        Some(Test {
            loads: self.loads(keys, &data, table)?,
            areas: keys
                .areas
                .written()
                .iter()
                .flat_map(|all| &all.value)
                .map(|a| a.value)
                .collect(),
            between: keys.between.written().map_or_else(Vec::new, |all| all.value.clone()),
            statistic: keys.statistic.value(),
            from_zero: keys.from_zero.value().unwrap_or(false),
            reduce: keys.reduce.value(),
            reference: self.reference(keys)?,
            reference_file: keys.reference.written().map(|file| file.value.clone()),
            needs: keys.needs.written().map(|text| text.value.clone()),
            data,
            along,
            equal,
            per,
            regression,
            order,
            tested,
            quantities,
        })
    }

    fn both<T>(&mut self, span: &Span) -> Option<T> {
        let message = "`regress` and `on` are used together";
        self.checks.reject(Problem::new(message, span.clone(), "the other key is missing"))
    }

    fn data_of(&mut self, keys: &ClaimTable) -> Option<Vec<DataSpec>> {
        if let Some(names) = keys.data.written() {
            let why = "`data` names tables that have this key";
            self.checks.forbidden("from", &keys.from, why)?;
            self.checks.forbidden("value", &keys.value, why)?;
            self.checks.forbidden("where", &keys.selection, why)?;
            let mut data = Vec::new();
            for name in &names.value {
                data.push(self.named_data(name)?);
            }
            let within = self.ranges(&keys.within, &[], Level::Parameters, None)?;
            data[0].within.extend(within);
            return Some(data);
        }
        let closed = [
            Statistic::AsymptoteOfAlpha,
            Statistic::GreenwoodDeficit,
            Statistic::AlphaInBgt,
            Statistic::PerssonConcavity,
            Statistic::SummitDensity,
        ];
        if keys.statistic.value().is_some_and(|statistic| closed.contains(&statistic)) {
            return Some(Vec::new());
        }
        let from = self.checks.required("from", &keys.from)?;
        let shared = DataKeys {
            name: "this",
            source: self.stage(from)?,
            value: &keys.value,
            selection: &keys.selection,
            within: &keys.within,
        };
        Some(vec![self.values(shared)?])
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
        match &written.value {
            QuantityKey::Word(text) => {
                let text = Spanned { value: text.clone(), span: written.span.clone() };
                Some(vec![(None, self.expression(&text, data, Level::Values, table)?)])
            }
            QuantityKey::Table(named) => {
                let mut quantities = Vec::new();
                for (label, text) in named {
                    let expression = self.expression(text, data, Level::Values, table)?;
                    quantities.push((Some(label.clone()), expression));
                }
                Some(quantities)
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
            let text = match &load.value {
                LoadKey::Number(value) => {
                    loads.push(AskedLoad { value: *value, is_pressure: false });
                    continue;
                }
                LoadKey::Word(text) => text.trim(),
            };
            match text {
                "lightest" => return Some(Loads::Lightest),
                "heaviest" => return Some(Loads::Heaviest),
                _ => {}
            }
            let unit = match data.first().map(|data| &data.source) {
                Some(Source::Stage(stage)) => self.unit_of_column(stage, PRESSURE.name),
                _ => None,
            };
            let value = self.bound(text, unit.as_deref().and_then(Unit::find), &load.span)?;
            loads.push(AskedLoad { value, is_pressure: true });
        }
        if let Some(table) = table
            && !table.has(load_column(table))
        {
            let message = "the table has no loads";
            let label = "leave `loads` out";
            return self.checks.reject(Problem::new(message, written.span.clone(), label));
        }
        Some(Loads::At(loads))
    }

    fn reference(&mut self, keys: &ClaimTable) -> Option<ReferenceValues> {
        let Some(written) = keys.reference.written() else { return Some(Vec::new()) };
        let text = (self.context.reference)(&written.value);
        let values = text.and_then(|text| reference_values(&text));
        match values {
            Ok(values) => Some(values),
            Err(reason) => {
                let message = format!("cannot read the table `{}`: {reason}", written.value);
                self.checks.reject(Problem::new(message, written.span.clone(), "named here"))
            }
        }
    }
}

/// Reads CSV with a header of parameters; the first other column has the values, and further ones
/// are ignored.
fn reference_values(text: &str) -> Result<ReferenceValues, String> {
    let mut lines = text.lines().filter(|line| !line.trim().is_empty());
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').map(str::trim).collect();
    let Some(value) = names.iter().position(|name| !SPECTRUM.contains(name)) else {
        return Err("its first line has no column besides parameters".to_owned());
    };
    let row = |line: &str| {
        let cells: Result<Vec<f64>, String> = line
            .split(',')
            .map(|cell| cell.trim().parse().map_err(|_| format!("{cell:?} is not a number")))
            .collect();
        let cells = cells?;
        if cells.len() != names.len() {
            return Err(format!("the row {line:?} has not as many cells as the first line"));
        }
        let own = names.iter().zip(&cells).filter(|(name, _)| SPECTRUM.contains(name));
        let parameters = own.map(|(name, cell)| ((*name).to_owned(), *cell));
        Ok((parameters.collect(), cells[value]))
    };
    lines.map(row).collect()
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
