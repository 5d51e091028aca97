//! Figures that a study declares, with the columns that they draw.
//!
//! The report draws each [`FigureSpec`]; it also makes specifications of its own for results that
//! no declared figure shows.

use std::collections::BTreeMap;

use arrow::datatypes::DataType;

use crate::manifest::figure::{FigureTable, SelectedValue, WrittenFigure};
use crate::study::graph::check_name;
use asperity_manifest::diagnostics::{Problem, Problems, Span, did_you_mean, listed};
use asperity_manifest::keys::Spanned;
use asperity_manifest::keys::checks::Checks;
use asperity_stages::aggregate::{Model, SPECTRUM_COLUMNS};
use asperity_stages::columns::{
    AREA_CORRECTED, AREA_FRACTION, ASPERITY_AREA_FRACTION, LOAD, SURFACE,
};
use asperity_tables::column::Role;
use asperity_tables::table::Table;

pub use crate::manifest::figure::{ErrorBars, Scales, SelectedValue as Value};

/// A figure of the table of a stage.
#[derive(Debug, Clone, PartialEq)]
pub struct FigureSpec {
    /// Name of the files of the figure.
    pub name: String,
    /// Name of the stage whose table is drawn.
    pub from: String,
    /// Column on the horizontal axis.
    pub x: String,
    pub y: Vec<Quantity>,
    pub colour: Option<String>,
    pub facet: Option<String>,
    pub scales: Scales,
    pub theories: Vec<Model>,
    /// Columns that select rows, each with the values of which a row has one.
    pub selection: BTreeMap<String, Vec<Value>>,
    pub title: Option<String>,
    pub caption: Option<String>,
}

/// Quantity on the vertical axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// Column of the values, or of their means.
    pub column: String,
    pub bars: BarSource,
}

/// Source of the error bars of a quantity.
#[derive(Debug, Clone, PartialEq)]
pub enum BarSource {
    None,
    /// The rows of the surfaces, of which the report computes mean and error.
    Surfaces(ErrorBars),
    /// Columns of the lower and the upper end, of a 95 % interval or of the interval of a fit.
    Ends {
        ends: [String; 2],
        meaning: EndsMeaning,
    },
    /// Column of half the length of a bar.
    Half {
        column: String,
        meaning: ErrorBars,
    },
    /// Columns of the standard error and of the number of surfaces, from which Student's t gives a
    /// 95 % interval.
    Student {
        error: String,
        surfaces: String,
    },
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EndsMeaning {
    Ci95,
    OfFit,
}

/// Statistic that is the value of a quantity of an `aggregate` stage.
const MEAN: &str = "_mean";
/// Column with the number of surfaces of a group.
const SURFACES: &str = "surfaces";
/// Columns of area fractions, which theories predict.
const AREAS: [&str; 3] = [AREA_FRACTION.name, AREA_CORRECTED.name, ASPERITY_AREA_FRACTION.name];

/// Reason why a table has no such quantity.
#[derive(Debug)]
pub enum NoQuantity {
    /// The table has no column of this name.
    Unknown,
    /// The column holds texts, flags or maps.
    NoNumbers,
    /// The table has no columns for these error bars.
    NoBars(ErrorBars),
}

impl Quantity {
    /// Finds the column of a quantity and the source of its error bars in a table, which may be
    /// empty. Without `error`, the bars are the best that the table has.
    ///
    /// # Errors
    /// If the table does not have the column or the error bars.
    pub fn find(
        table: &Table,
        name: &str,
        error: Option<ErrorBars>,
    ) -> Result<Quantity, NoQuantity> {
        let mean = format!("{name}{MEAN}");
        let column = if !table.has(name) && table.has(&mean) { mean } else { name.to_owned() };
        if !table.has(&column) {
            return Err(NoQuantity::Unknown);
        }
        if !is_number(table, &column) {
            return Err(NoQuantity::NoNumbers);
        }
        let bars = if has_surfaces(table) {
            let bars = error.unwrap_or(ErrorBars::Ci95);
            if bars == ErrorBars::None { BarSource::None } else { BarSource::Surfaces(bars) }
        } else {
            bars_of_columns(table, &column, error).map_err(NoQuantity::NoBars)?
        };
        Ok(Quantity { column, bars })
    }

    /// Returns the name of the quantity without the statistic `mean`.
    pub fn base(&self) -> &str {
        self.column.strip_suffix(MEAN).unwrap_or(&self.column)
    }
}

/// Finds the columns of error bars in a table of statistics or fits. Returns the requested kind if
/// the table does not have it.
fn bars_of_columns(
    table: &Table,
    column: &str,
    error: Option<ErrorBars>,
) -> Result<BarSource, ErrorBars> {
    let base = column.strip_suffix(MEAN);
    let of_mean = |suffix: &str| {
        let name = format!("{}_{suffix}", base?);
        table.has(&name).then_some(name)
    };
    let of_fit = |suffix: &str| {
        let name = format!("{column}_{suffix}");
        table.has(&name).then_some(name)
    };
    let both = |lower: Option<String>, upper: Option<String>| Some([lower?, upper?]);
    let ends_95 = || {
        let ends = both(of_mean("ci95_lower"), of_mean("ci95_upper"))?;
        Some(BarSource::Ends { ends, meaning: EndsMeaning::Ci95 })
    };
    let student = || {
        let surfaces = table.has(SURFACES).then(|| SURFACES.to_owned())?;
        Some(BarSource::Student { error: of_mean("sem")?, surfaces })
    };
    let fitted = || {
        let ends = both(of_fit("lower"), of_fit("upper"))?;
        Some(BarSource::Ends { ends, meaning: EndsMeaning::OfFit })
    };
    let half = |column: Option<String>, meaning| Some(BarSource::Half { column: column?, meaning });
    match error {
        None => Ok(ends_95().or_else(student).or_else(fitted).unwrap_or(BarSource::None)),
        Some(ErrorBars::None) => Ok(BarSource::None),
        Some(wanted @ ErrorBars::Ci95) => ends_95().or_else(student).ok_or(wanted),
        Some(wanted @ ErrorBars::Sem) => {
            half(of_mean("sem").or_else(|| of_fit("standard_error")), wanted).ok_or(wanted)
        }
        Some(wanted @ ErrorBars::Sd) => half(of_mean("sd"), wanted).ok_or(wanted),
    }
}

/// Returns whether the rows of a table describe single surfaces.
pub fn has_surfaces(table: &Table) -> bool {
    table.has(SURFACE.name)
}

/// Returns whether a column holds numbers.
pub fn is_number(table: &Table, column: &str) -> bool {
    let schema = table.batch().schema_ref();
    let field = schema.field_with_name(column);
    field.is_ok_and(|field| matches!(field.data_type(), DataType::Float64 | DataType::Int64))
}

/// Returns the columns whose values distinguish the points of a figure: parameters and loads or, in
/// the result of a query, all columns.
fn coordinates(table: &Table) -> Vec<&str> {
    let fields = table.batch().schema_ref().fields().iter();
    let is_coordinate = |role: Role| role.is_coordinate() && role != Role::Surface;
    let known = fields.clone().filter(|field| Role::from_field(field).is_some_and(is_coordinate));
    let known: Vec<&str> = known.map(|field| field.name().as_str()).collect();
    if known.is_empty() { fields.map(|field| field.name().as_str()).collect() } else { known }
}

/// Checks the figures of a manifest. `table` returns the table of a stage without rows, if the
/// stage exists and its columns are known.
pub fn check<'t>(
    figures: &[WrittenFigure],
    stages: &[&str],
    table: impl Fn(&str) -> Option<&'t Table>,
    problems: &mut Problems,
) -> Option<Vec<FigureSpec>> {
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
        let spec = keys.points.first().and_then(|point| {
            let mut checks = Checks::new(keys, point, problems);
            check_figure(value, &point.table, stages, &table, &mut checks)
        });
        complete &= spec.is_some();
        specs.extend(spec);
    }
    complete.then_some(specs)
}

fn check_figure<'t>(
    name: &str,
    keys: &FigureTable,
    stages: &[&str],
    table: impl Fn(&str) -> Option<&'t Table>,
    checks: &mut Checks,
) -> Option<FigureSpec> {
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
    let table = table(&from.value)?;
    let mut columns = Columns { stage: &from.value, table, checks };
    let x_column = columns.number(x);
    let error = keys.error.value();
    let quantities = columns.quantities(y, error, keys.error.written().map(|error| &error.span));
    let colour = keys.colour.written().map(|written| columns.coordinate("colour", written));
    let facet = keys.facet.written().map(|written| columns.coordinate("facet", written));
    let selection = columns.selection(keys);
    let theories = columns.theories(keys, quantities.as_deref());
    let scales = checks.value("scale", &keys.scale);
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
    })
}

/// Checks of the columns that a figure names.
struct Columns<'a, 'c> {
    stage: &'a str,
    table: &'a Table,
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
        (format!("`{}` has no columns for {word:?} of {name:?}", self.stage), label)
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
                let message = format!("`where` selects {name:?} by the wrong type of value");
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
