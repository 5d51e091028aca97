//! Checks of the tables `[figure.NAME]` of a manifest.

use std::collections::{BTreeMap, BTreeSet};

use super::{ErrorBars, FigureSize, FigureSpec, MEAN, NoQuantity, Quantity, REPORT_FIGURES};
use super::{THIS_STUDY, Value, is_number};
use crate::manifest::figure::{FigureTable, SelectedValue, WrittenFigure};
use crate::study::graph::check_name;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Problems, Span, did_you_mean, listed};
use asperity_manifest::keys::Spanned;
use asperity_manifest::keys::checks::Checks;
use asperity_stages::aggregate::{Model, SPECTRUM_COLUMNS};
use asperity_stages::columns::{
    AREA_CORRECTED, AREA_FRACTION, ASPERITY_AREA_FRACTION, LOAD, needed_key,
};
use asperity_tables::column::{Role, Value as Known};
use asperity_tables::table::Table;

/// Columns of area fractions, which theories predict.
const AREAS: [&str; 3] = [AREA_FRACTION.name, AREA_CORRECTED.name, ASPERITY_AREA_FRACTION.name];

/// Returns the columns whose values distinguish the points of a figure: parameters and loads or, in
/// the result of a query, all columns.
fn coordinates(table: &Table) -> Vec<&str> {
    let fields = table.batch().schema_ref().fields().iter();
    let is_coordinate = |role: Role| role.is_coordinate() && role != Role::Surface;
    let marked = fields.clone().filter(|field| Role::from_field(field).is_some_and(is_coordinate));
    let known: Vec<&str> = marked.map(|field| field.name().as_str()).collect();
    if known.is_empty() { fields.map(|field| field.name().as_str()).collect() } else { known }
}

/// Stages of a study, as far as the checks of its figures need them.
pub struct FigureContext<'a, T, V> {
    /// Names of the stages.
    pub stages: &'a [&'a str],
    /// Function that returns the table of a stage without rows, if the stage exists and its columns
    /// are known.
    pub table: T,
    /// Function that returns the values of a coordinate in the table of a stage, if they are known
    /// before the study runs.
    pub values: V,
}

/// A figure that draws nothing of what its key `where` selects.
#[derive(Debug, Clone)]
pub struct EmptySelection {
    /// Name of the stage whose table is drawn.
    pub stage: String,
    pub problem: Problem,
}

/// Checks the figures of a manifest. Values in `where` that no point has are no errors, because
/// variants of a study can have other values; they are added to `empty`.
pub fn check<'t, T, V>(
    figures: &[WrittenFigure],
    context: &FigureContext<T, V>,
    problems: &mut Problems,
    empty: &mut Vec<EmptySelection>,
) -> Option<Vec<FigureSpec>>
where
    T: Fn(&str) -> Option<&'t Table>,
    V: Fn(&str, &str) -> Option<BTreeSet<Known>>,
{
    let mut specs = Vec::new();
    let mut folded = BTreeMap::new();
    let mut complete = true;
    for WrittenFigure { name, keys } in figures {
        let Spanned { value, span } = name;
        check_name("figure", value, span.clone(), problems);
        if let Some(before) = folded.insert(value.to_lowercase(), span) {
            let message = format!("figure name `{value}` differs from another one only in case");
            let problem = Problem::new(message, span.clone(), "the same name in another case");
            problems.push(problem.and(before.clone(), "first name"));
        }
        if REPORT_FIGURES.contains(&value.to_lowercase().as_str()) {
            let message = format!("the report has a figure `{value}` of its own");
            let problem = Problem::new(message, span.clone(), "choose another name");
            problems
                .push(problem.help(format!("its figures are {}", listed(REPORT_FIGURES, "and"))));
        }
        let spec = keys.points.first().and_then(|point| {
            let mut checks = Checks::new(keys, point, problems);
            check_figure(value, &point.table, context, &mut checks, empty)
        });
        complete &= spec.is_some();
        specs.extend(spec);
    }
    complete.then_some(specs)
}

fn check_figure<'t, T, V>(
    name: &str,
    keys: &FigureTable,
    context: &FigureContext<T, V>,
    checks: &mut Checks,
    empty: &mut Vec<EmptySelection>,
) -> Option<FigureSpec>
where
    T: Fn(&str) -> Option<&'t Table>,
    V: Fn(&str, &str) -> Option<BTreeSet<Known>>,
{
    let stages = context.stages;
    let from = checks.required("from", &keys.from);
    let x = checks.required("x", &keys.x);
    let y = checks.required("y", &keys.y);
    let (from, x, y) = (from?, x?, y?);
    if !stages.contains(&from.value.as_str()) {
        let known = || stages.iter().copied();
        let message = format!("there is no stage {:?}", from.value);
        let help = format!("the stages are {}", listed(known(), "and"));
        return checks.reject(unknown(message, from, known(), "unknown stage").help(help));
    }
    // If the stage has problems of its own, its columns are unknown.
    let table = (context.table)(&from.value)?;
    let values = |column: &str| (context.values)(&from.value, column);
    let is_known = |column: &str| {
        let mut tables = stages.iter().filter_map(|stage| (context.table)(stage));
        tables.any(|table| table.has(column))
    };
    let mut columns = Columns { stage: &from.value, table, is_known: &is_known, checks };
    let x_column = columns.number(x);
    let error = keys.error.value();
    let quantities = columns.quantities(y, error, keys.error.written().map(|error| &error.span));
    let colour = keys.colour.written().map(|written| columns.coordinate("colour", written));
    let facet = keys.facet.written().map(|written| columns.coordinate("facet", written));
    let selection = columns.selection(keys);
    let theories = columns.theories(keys, quantities.as_deref());
    let legend = columns.legend(keys, quantities.as_deref(), values);
    if selection.is_some() {
        empty.extend(empty_selections(name, &from.value, keys, values));
    }
    let scales = checks.value("scale", &keys.scale);
    let size = FigureSize {
        width: checks.optional_number("width", &keys.width)?,
        height: checks.optional_number("height", &keys.height)?,
        font: checks.optional_number("font_size", &keys.font_size)?,
    };
    Some(FigureSpec {
        name: name.to_owned(),
        from: from.value.clone(),
        x: x_column?,
        y: quantities?,
        colour: colour.map_or(Some(None), |colour| colour.map(Some))?,
        facet: facet.map_or(Some(None), |facet| facet.map(Some))?,
        scales: scales?,
        theories: theories?,
        selection: selection?,
        title: checks.optional("title", &keys.title)?.map(|title| title.value.clone()),
        caption: checks.optional("caption", &keys.caption)?.map(|text| text.value.clone()),
        size,
        legend: legend?,
    })
}

/// Checks of the columns that a figure names.
struct Columns<'a, 'c> {
    stage: &'a str,
    table: &'a Table,
    /// Function that tells whether a stage of the study has a column.
    is_known: &'a dyn Fn(&str) -> bool,
    checks: &'a mut Checks<'c>,
}

impl<'a> Columns<'a, '_> {
    fn number(&mut self, written: &Spanned<String>) -> Option<String> {
        let name = &written.value;
        if !self.table.has(name) {
            let known = self.numbers();
            return self.unknown_column(written, &known);
        }
        if !is_number(self.table, name) {
            let message = format!("the column {name:?} holds no numbers");
            let label = "must be a column of numbers";
            let help = "text can distinguish colours or panels: `colour` and `facet`";
            let problem = Problem::new(message, written.span.clone(), label).help(help);
            return self.checks.reject(problem);
        }
        Some(name.clone())
    }

    /// Returns the names of columns of numbers. Means are also called by their quantity.
    fn numbers(&self) -> Vec<&'a str> {
        let table = self.table;
        let names = table.names().into_iter().filter(|name| is_number(table, name));
        names.flat_map(|name| [Some(name), name.strip_suffix(MEAN)]).flatten().collect()
    }

    fn unknown_column<T>(&mut self, written: &Spanned<String>, known: &[&str]) -> Option<T> {
        let message = format!("`{}` has no column {:?}", self.stage, written.value);
        let known = || known.iter().copied();
        let base = written.value.strip_suffix(MEAN).unwrap_or(&written.value);
        if let Some(label) = needed_key(base, self.is_known) {
            return self.checks.reject(Problem::new(message, written.span.clone(), label));
        }
        let problem = unknown(message, written, known(), "unknown column");
        let problem = match did_you_mean(&written.value, known()) {
            Some(_) => problem,
            None => problem.help(format!("its columns are {}", listed(known(), "and"))),
        };
        self.checks.reject(problem)
    }

    fn quantities(
        &mut self,
        written: &Spanned<Vec<Spanned<String>>>,
        error: Option<ErrorBars>,
        error_span: Option<&Span>,
    ) -> Option<Vec<Quantity>> {
        let mut quantities: Vec<Quantity> = Vec::new();
        let mut clear = Some(());
        for name in &written.value {
            let span = name.span.clone();
            match Quantity::find(self.table, &name.value, error) {
                Ok(quantity) if quantities.contains(&quantity) => {
                    let message = format!("`y` names {:?} twice", name.value);
                    clear = self.checks.reject(Problem::new(message, span, "here again"));
                }
                Ok(quantity) => quantities.push(quantity),
                Err(NoQuantity::Unknown) => {
                    let known = self.numbers();
                    clear = self.unknown_column(name, &known);
                }
                Err(NoQuantity::NoNumbers) => {
                    let message = format!("the column {:?} holds no numbers", name.value);
                    let label = "must be a column of numbers";
                    clear = self.checks.reject(Problem::new(message, span, label));
                }
                Err(NoQuantity::NoBars(kind)) => {
                    let problem = self.no_bars(&name.value, kind);
                    let span = error_span.cloned().unwrap_or(span);
                    clear = self.checks.reject(Problem::new(problem.0, span, problem.1));
                }
            }
        }
        clear.map(|()| quantities)
    }

    /// Returns message and label of the problem that a table has no columns for error bars.
    fn no_bars(&self, name: &str, kind: ErrorBars) -> (String, &'static str) {
        let (word, label) = match kind {
            ErrorBars::Ci95 => ("ci95", "add \"ci95\" or \"sem\" to `statistics` of this stage"),
            ErrorBars::Sem => ("sem", "add \"sem\" to `statistics` of this stage"),
            ErrorBars::Sd => ("sd", "add \"sd\" to `statistics` of this stage"),
            ErrorBars::None => ("none", "not needed"),
        };
        let is_fit = self.table.has(&format!("{name}_lower"));
        let label =
            if is_fit { "leave `error` out to draw the intervals of the fits" } else { label };
        (format!("the table of `{}` has no {word:?} error bars for {name:?}", self.stage), label)
    }

    fn coordinate(&mut self, key: &str, written: &Spanned<String>) -> Option<String> {
        let known = coordinates(self.table);
        if known.contains(&written.value.as_str()) {
            return Some(written.value.clone());
        }
        if !self.table.has(&written.value) {
            return self.unknown_column(written, &known);
        }
        let message = format!("`{key}` cannot be {:?}", written.value);
        let problem = Problem::new(message, written.span.clone(), "neither a parameter nor a load");
        self.checks.reject(problem.help(format!("it can be {}", listed(known, "or"))))
    }

    fn selection(&mut self, keys: &FigureTable) -> Option<BTreeMap<String, Vec<Value>>> {
        let mut selection = BTreeMap::new();
        let mut clear = Some(());
        let written = keys.selection.written();
        for (name, selected) in written.iter().flat_map(|selection| &selection.value) {
            let column = Spanned { value: name.clone(), span: selected.span.clone() };
            if self.coordinate("where", &column).is_none() {
                clear = None;
                continue;
            }
            let values = selected.value.values();
            let is_text = |value: &SelectedValue| matches!(value, SelectedValue::Word(_));
            if values.iter().any(|value| is_text(value) == is_number(self.table, name)) {
                let message = format!("`where` compares {name:?} with a value of the wrong type");
                let label = match is_number(self.table, name) {
                    true => "the column holds numbers",
                    false => "the column holds texts, which need quotes",
                };
                clear = self.checks.reject(Problem::new(message, selected.span.clone(), label));
            }
            selection.insert(name.clone(), values);
        }
        clear.map(|()| selection)
    }

    /// Returns the names of entries of the legend. Refuses an entry that the legend cannot have.
    ///
    /// Before the study runs, the values of some coordinates are unknown. If those of a numeric
    /// coordinate are unknown, all numbers are accepted, and if those of a text coordinate are
    /// unknown, all words.
    fn legend(
        &mut self,
        keys: &FigureTable,
        quantities: Option<&[Quantity]>,
        values: impl Fn(&str) -> Option<BTreeSet<Known>>,
    ) -> Option<BTreeMap<String, String>> {
        let Some(written) = keys.legend.written() else { return Some(BTreeMap::new()) };
        let mut entries: BTreeSet<String> = [THIS_STUDY.to_owned()].into();
        entries.extend(quantities?.iter().map(|quantity| quantity.base().to_owned()));
        let theories = keys.theories.written().into_iter().flat_map(|theories| &theories.value);
        entries.extend(theories.map(|theory| theory.value.word().to_owned()));
        // Whether all coordinates with words, and all with numbers, are known.
        let mut are_known = [true; 2];
        for column in coordinates(self.table) {
            match values(column) {
                Some(known) => entries.extend(known.iter().map(Known::to_string)),
                None => are_known[usize::from(is_number(self.table, column))] = false,
            }
        }
        let mut clear = Some(());
        for (entry, name) in &written.value {
            let number = entry.parse::<f64>().ok();
            let is_same = |known: &String| {
                let value = known.parse::<f64>().ok();
                number.zip(value).is_some_and(|(one, other)| decimal::is_same(one, other))
            };
            if are_known[usize::from(number.is_some())]
                && !entries.contains(entry)
                && !entries.iter().any(is_same)
            {
                let message =
                    format!("`legend` renames {entry:?}, but the figure has no such entry");
                let label = "must be the name of a value, of a theory or of a column in `y`";
                let problem = Problem::new(message, name.span.clone(), label);
                let known = listed(entries.iter().map(String::as_str), "and");
                clear = self.checks.reject(problem.help(format!("entries are {known}")));
            }
        }
        let names = written.value.iter().map(|(entry, name)| (entry.clone(), name.value.clone()));
        clear.map(|()| names.collect())
    }

    /// Returns the theories. Each predicts the area fraction under a load, and asperity models need
    /// the moments of the spectrum.
    fn theories(
        &mut self,
        keys: &FigureTable,
        quantities: Option<&[Quantity]>,
    ) -> Option<Vec<Model>> {
        let mut models = Vec::new();
        let mut clear = Some(());
        let written = keys.theories.written();
        for Spanned { value: model, span } in written.iter().flat_map(|theories| &theories.value) {
            let mut report = |message: String, label: &str| {
                let problem = Problem::new(message, span.clone(), label);
                clear = self.checks.reject(problem);
            };
            if models.contains(model) {
                report("`theories` has the same theory twice".to_owned(), "here again");
            }
            let is_area = |quantity: &Quantity| AREAS.contains(&quantity.base());
            if quantities.is_some_and(|quantities| !quantities.iter().any(is_area)) {
                let message = format!("theories predict {}", listed(AREAS, "or"));
                report(message, "none of these columns is in `y`");
            }
            let spectrum: &[&str] =
                if model.asperities().is_some() { &SPECTRUM_COLUMNS } else { &[] };
            let needed = spectrum.iter().copied().chain([LOAD.name]);
            let missing: Vec<&str> = needed.filter(|name| !self.table.has(name)).collect();
            if !missing.is_empty() {
                let missing = listed(missing, "and");
                let message = format!("the theory needs {missing}, which the table does not have");
                report(message, "needs loads on surfaces drawn from a spectrum");
            }
            models.push(*model);
        }
        clear.map(|()| models)
    }
}

/// Returns the problems of values in `where` that no point of the stage has.
fn empty_selections(
    figure: &str,
    stage: &str,
    keys: &FigureTable,
    values: impl Fn(&str) -> Option<BTreeSet<Known>>,
) -> Vec<EmptySelection> {
    let mut empty = Vec::new();
    let written = keys.selection.written();
    for (column, selected) in written.iter().flat_map(|selection| &selection.value) {
        let Some(known) = values(column) else { continue };
        for value in selected.value.values() {
            if known.iter().any(|known| value.is_same(known)) {
                continue;
            }
            let words: Vec<String> = known.iter().map(Known::to_string).collect();
            let message = format!(
                "`[figure.{figure}]` selects `{column} = {value}`, which no row of the stage has; \
                 its values are {}",
                listed(words.iter().map(String::as_str), "and"),
            );
            let problem = Problem::new(message, selected.span.clone(), "no row has this value");
            empty.push(EmptySelection { stage: stage.to_owned(), problem });
        }
    }
    empty
}

/// Creates the problem of an unknown name, with a suggestion.
fn unknown<'k>(
    message: String,
    written: &Spanned<String>,
    known: impl Iterator<Item = &'k str>,
    otherwise: &str,
) -> Problem {
    let label = match did_you_mean(&written.value, known) {
        Some(meant) => format!("did you mean \"{meant}\"?"),
        None => otherwise.to_owned(),
    };
    Problem::new(message, written.span.clone(), label)
}
