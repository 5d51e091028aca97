//! Checks of the tables `[figure.NAME]` of a manifest.

use std::collections::{BTreeMap, BTreeSet};

use super::{AREAS, Curve, ErrorBars, FigureSize, FigureSpec, Law, NoQuantity, PanelSpec};
use super::{Quantity, Scales, THIS_STUDY, Value, has_surfaces, holds, is_number};
use crate::manifest::figure::{
    CurveTable, FigureTable, Holds, PanelTable, RangeTable, Selected, SelectedValue, Words,
    WrittenFigure,
};
use crate::study::graph::check_name;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Problems, Span, did_you_mean, listed, suggestion};
use asperity_manifest::expression::Expression;
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::{Key, Spanned, quantity};
use asperity_stages::Kind;
use asperity_stages::aggregate::{Model, SPECTRUM_COLUMNS, Statistic};
use asperity_stages::columns::{LOAD, needed_key};
use asperity_stages::units::TableUnits;
use asperity_tables::column::{Role, Value as Known};
use asperity_tables::table::Table;

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
    /// Function that returns the units of the table of a stage, if they are known.
    pub units: &'a dyn Fn(&str) -> Option<TableUnits>,
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
        let spec = keys.points.first().and_then(|point| {
            let mut checks = Checks::new(keys, point, problems);
            check_figure(value, &point.table, context, &mut checks, empty)
        });
        complete &= spec.is_some();
        specs.extend(spec);
    }
    complete.then_some(specs)
}

/// Checks a figure, and returns it if it has no problems.
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
    let has_panels = keys.panels.written().is_some() || checks.is_reported("panels");
    if !has_panels {
        let (x, y) = (checks.required("x", &keys.x), checks.required("y", &keys.y));
        x?;
        y?;
    }
    let from = from?;
    if !stages.contains(&from.value.as_str()) {
        let known = || stages.iter().copied();
        let message = format!("there is no stage {:?}", from.value);
        let help = format!("the stages are {}", listed(known(), "and"));
        let label = suggestion('"', &from.value, known(), "unknown stage");
        return checks.reject(Problem::new(message, from.span.clone(), label).help(help));
    }
    // If the stage has problems of its own, its columns are unknown.
    let table = (context.table)(&from.value)?;
    let values = |column: &str| (context.values)(&from.value, column);
    let is_known = |column: &str| {
        let mut tables = stages.iter().filter_map(|stage| (context.table)(stage));
        tables.any(|table| table.has(column))
    };
    let units = (context.units)(&from.value).unwrap_or_default();
    let holds_in = |stage: &str, column: &str| match (context.table)(stage) {
        Some(table) => holds(table, &(context.units)(stage).unwrap_or_default(), column),
        None => Holds::Others,
    };
    let mut columns = Columns {
        stage: &from.value,
        table,
        units,
        holds_in: &holds_in,
        is_known: &is_known,
        checks,
    };
    let panels = columns.panels(keys, stages);
    let colour = keys.colour.written().map(|written| columns.coordinate("colour", written));
    let dash = keys.dash.written().map(|written| columns.coordinate("dash", written));
    let facets = keys.facet.written().into_iter().flat_map(|facet| &facet.value);
    let facet: Vec<Option<String>> =
        facets.map(|written| columns.coordinate("facet", written)).collect();
    let selection = columns.selection(&keys.selection);
    let legend = columns.legend(keys, panels.as_deref(), values);
    let labels = columns.labels(keys, panels.as_deref());
    let limits = columns.limits(keys, panels.as_deref());
    let ticks = columns.ticks(keys, panels.as_deref());
    if let Some(selection) = &selection {
        empty.extend(empty_selections(name, &from.value, keys, selection, values));
    }
    let size = FigureSize {
        width: checks.optional_number("width", &keys.width)?,
        height: checks.optional_number("height", &keys.height)?,
        font: checks.optional_number("font_size", &keys.font_size)?,
    };
    let (legend, legend_order) = legend?;
    Some(FigureSpec {
        name: name.to_owned(),
        from: from.value.clone(),
        panels: panels?,
        colour: colour.map_or(Some(None), |colour| colour.map(Some))?,
        facet: facet.into_iter().collect::<Option<_>>()?,
        facet_in: checks.value("facet_in", &keys.facet_in)?,
        dash: dash.map_or(Some(None), |dash| dash.map(Some))?,
        is_apart: !checks.value("lines", &keys.lines)?,
        selection: selection?,
        title: checks.optional("title", &keys.title)?.map(|title| title.value.clone()),
        caption: checks.optional("caption", &keys.caption)?.map(|text| text.value.clone()),
        size,
        font_family: checks.optional("font_family", &keys.font_family)?.map(|of| of.value.clone()),
        legend,
        legend_order,
        labels: labels?,
        limits: limits?,
        ticks: ticks?,
    })
}

/// Returns a figure of the program for the table of a stage of this kind, or `None` if the stage is
/// of another kind than `from` or the table lacks a column.
pub fn on_table(figure: &WrittenFigure, kind: &str, table: &Table) -> Option<FigureSpec> {
    let kinds = Kind::ALL.map(Kind::name);
    let context = FigureContext {
        stages: &kinds,
        table: |name: &str| (name == kind).then_some(table),
        values: |_: &str, _: &str| None,
        units: &|_| None,
    };
    let mut problems = Problems::default();
    let point = figure.keys.points.first()?;
    let mut checks = Checks::new(&figure.keys, point, &mut problems);
    check_figure(&figure.name.value, &point.table, &context, &mut checks, &mut Vec::new())
}

/// Checks of the columns that a figure names.
struct Columns<'a, 'c> {
    stage: &'a str,
    table: &'a Table,
    units: TableUnits,
    /// Function that returns what a column of a stage holds.
    holds_in: &'a dyn Fn(&str, &str) -> Holds,
    /// Function that tells whether a stage of the study has a column.
    is_known: &'a dyn Fn(&str) -> bool,
    checks: &'a mut Checks<'c>,
}

impl<'a> Columns<'a, '_> {
    /// Returns the panels of a figure: those of its key `panels` or, without it, one with the keys
    /// of the figure.
    fn panels(&mut self, keys: &FigureTable, stages: &[&str]) -> Option<Vec<PanelSpec>> {
        if self.checks.is_reported("panels") {
            return None;
        }
        let alone = PanelTable::default();
        let written: Vec<&PanelTable> = match keys.panels.written() {
            Some(panels) => panels.value.iter().map(|panel| &panel.value).collect(),
            None => vec![&alone],
        };
        // All panels are checked, even if one has a problem.
        let checked: Vec<Option<PanelSpec>> =
            written.into_iter().map(|panel| self.panel(keys, panel, stages)).collect();
        let mut panels: Vec<PanelSpec> = checked.into_iter().collect::<Option<_>>()?;
        let theories = self.theories(keys, &panels)?;
        for panel in panels.iter_mut().filter(|panel| panel.y.iter().any(Quantity::is_of_areas)) {
            let theory = |&model: &Model| Law::Theory { model, nayak: None };
            let laws = theories.iter().map(theory);
            let curves = laws.map(|law| Curve {
                law,
                label: None,
                from: None,
                selection: BTreeMap::new(),
                range: None,
            });
            panel.curves.splice(0..0, curves);
        }
        Some(panels)
    }

    fn panel(
        &mut self,
        keys: &FigureTable,
        panel: &PanelTable,
        stages: &[&str],
    ) -> Option<PanelSpec> {
        let x = match panel.x.written() {
            Some(x) => Some(x),
            None => self.checks.required("x", &keys.x),
        };
        let own: Option<Vec<Spanned<String>>> = panel.y.written().map(|y| {
            let words = match &y.value {
                Words::One(word) => vec![word.clone()],
                Words::Many(words) => words.clone(),
            };
            words.into_iter().map(|value| Spanned { value, span: y.span.clone() }).collect()
        });
        let y = match &own {
            Some(own) => Some(own),
            None => self.checks.required("y", &keys.y).map(|y| &y.value),
        };
        let (x, y) = (x?, y?);
        let x_column = self.abscissa(x);
        let error = keys.error.written();
        let quantities = self.quantities(y, keys.error.value(), error.map(|error| &error.span));
        let scales = match panel.scale.value() {
            Some(scales) => Some(scales),
            None => self.checks.value("scale", &keys.scale),
        };
        let selection = self.selection(&panel.selection);
        let x = x_column?;
        let quantities = quantities?;
        let written = [&keys.curves, &panel.curves].map(Key::written).into_iter().flatten();
        let mut curves = Some(Vec::new());
        for Spanned { value: curve, span } in written.flat_map(|curves| &curves.value) {
            let is_of_areas = quantities.iter().any(Quantity::is_of_areas);
            let curve = self.curve(curve, span, &x, stages);
            let is_drawn = |curve: &Curve| is_of_areas || matches!(curve.law, Law::Value(_));
            match (curve, &mut curves) {
                (Some(curve), Some(curves)) => curves.extend(Some(curve).filter(is_drawn)),
                (Some(_), None) => {}
                (None, _) => curves = None,
            }
        }
        Some(PanelSpec {
            x,
            y: quantities,
            scales: scales?,
            selection: selection?,
            curves: curves?,
        })
    }

    fn curve(&mut self, keys: &CurveTable, span: &Span, x: &str, stages: &[&str]) -> Option<Curve> {
        let laws = [keys.value.0.is_some(), keys.area.0.is_some(), keys.theory.0.is_some()];
        if laws.iter().filter(|is_given| **is_given).count() != 1 {
            let message = "a curve is given by one of `value`, `area` and `theory`".to_owned();
            return self.checks.reject(Problem::new(message, span.clone(), "none or several here"));
        }
        if let Some(from) = keys.from.written().filter(|from| !stages.contains(&&*from.value)) {
            let message = format!("there is no stage {:?}", from.value);
            let label = suggestion('"', &from.value, stages.iter().copied(), "unknown stage");
            return self.checks.reject(Problem::new(message, from.span.clone(), label));
        }
        let own = keys.from.written().is_none();
        let free = if keys.area.0.is_some() { LOAD.name } else { x };
        let mut expression = |written: &Spanned<String>| -> Option<Expression> {
            let expression = self.parsed(written)?;
            if expression.has_slope() {
                let message = "a curve cannot contain `slope`".to_owned();
                let label = "give the law, of which the panel can draw the slope";
                return self.checks.reject(Problem::new(message, written.span.clone(), label));
            }
            let parameters = expression.columns().into_iter().filter(|name| own && *name != free);
            let names: Vec<String> = parameters.map(str::to_owned).collect();
            self.are_numbers(&names, written)?;
            Some(expression)
        };
        let law = match (keys.value.written(), keys.area.written(), keys.theory.value()) {
            (Some(value), ..) => Law::Value(expression(value)?),
            (_, Some(area), _) => Law::Area(expression(area)?),
            (.., Some(model)) => Law::Theory { model, nayak: keys.nayak.value() },
            _ => return None,
        };
        let range = match keys.range.written().map(|range| range.value.as_slice()) {
            Some([from, to]) => Some([expression(from)?, expression(to)?]),
            _ => None,
        };
        let label = keys.label.written().map(|label| label.value.clone());
        let from = keys.from.written().map(|from| from.value.clone());
        let selection = if own {
            self.selection(&keys.selection)?
        } else {
            // The columns of another table may be unknown before it is computed.
            let mut selection = BTreeMap::new();
            let written = keys.selection.written().into_iter().flat_map(|written| &written.value);
            for (name, selected) in written {
                let holds = (self.holds_in)(from.as_deref().unwrap_or_default(), name);
                let values = selected.value.values(holds);
                selection.insert(name.clone(), self.checks.accept(values, &selected.span)?);
            }
            selection
        };
        Some(Curve { law, label, from, selection, range })
    }

    fn parsed(&mut self, written: &Spanned<String>) -> Option<Expression> {
        Expression::parse(&written.value)
            .map_err(|error| {
                let span = error.span_in(&written.value, &written.span);
                let message = format!("{:?} is not an expression", written.value);
                self.checks.problems.push(Problem::new(message, span, error.reason));
            })
            .ok()
    }

    /// Returns the expression in columns of numbers that a text is, and `Some(None)` if the text
    /// is a name.
    fn expression(&mut self, written: &Spanned<String>) -> Option<Option<Expression>> {
        let is_part = |letter: char| letter.is_alphanumeric() || letter == '_';
        if self.table.has(&written.value) || written.value.chars().all(is_part) {
            return Some(None);
        }
        let expression = self.parsed(written)?;
        let names: Vec<String> = expression.columns().into_iter().map(str::to_owned).collect();
        self.are_numbers(&names, written)?;
        let has_loads = has_surfaces(self.table) && self.table.has(LOAD.name);
        if expression.has_slope() && !has_loads {
            let message =
                format!("`slope` needs surfaces under loads, which `{}` lacks", self.stage);
            let label = "the derivative with respect to the load";
            return self.checks.reject(Problem::new(message, written.span.clone(), label));
        }
        Some(Some(expression))
    }

    /// Reports the first of these names that is no column of numbers.
    fn are_numbers(&mut self, names: &[String], written: &Spanned<String>) -> Option<()> {
        for value in names {
            let at = written.value.find(value.as_str()).unwrap_or(0);
            let start = (written.span.start + 1 + at).min(written.span.end);
            let span = start..(start + value.len()).min(written.span.end);
            self.number(&Spanned { value: value.clone(), span })?;
        }
        Some(())
    }

    fn abscissa(&mut self, written: &Spanned<String>) -> Option<String> {
        match self.expression(written)? {
            None => self.number(written),
            Some(expression) if expression.has_slope() => {
                let message = "`x` cannot contain `slope`".to_owned();
                let label = "the derivative with respect to the load";
                self.checks.reject(Problem::new(message, written.span.clone(), label))
            }
            Some(expression) => Some(expression.to_string()),
        }
    }

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
        names.flat_map(|name| [Some(name), Statistic::Mean.base_of(name)]).flatten().collect()
    }

    fn unknown_column<T>(&mut self, written: &Spanned<String>, known: &[&str]) -> Option<T> {
        let message = format!("`{}` has no column {:?}", self.stage, written.value);
        let known = || known.iter().copied();
        let base = Statistic::Mean.base_of(&written.value).unwrap_or(&written.value);
        if let Some(label) = needed_key(base, self.is_known) {
            return self.checks.reject(Problem::new(message, written.span.clone(), label));
        }
        let label = suggestion('"', &written.value, known(), "unknown column");
        let problem = Problem::new(message, written.span.clone(), label);
        self.checks.reject(match did_you_mean(&written.value, known()) {
            Some(_) => problem,
            None => problem.help(format!("its columns are {}", listed(known(), "and"))),
        })
    }

    fn quantities(
        &mut self,
        written: &[Spanned<String>],
        error: Option<ErrorBars>,
        error_span: Option<&Span>,
    ) -> Option<Vec<Quantity>> {
        let mut quantities: Vec<Quantity> = Vec::new();
        let mut clear = Some(());
        for name in written {
            let span = name.span.clone();
            let found = match self.expression(name) {
                Some(None) => Quantity::find(self.table, &name.value, error),
                Some(Some(expression)) => {
                    Ok(Quantity::of_expression(self.table, expression, error))
                }
                None => {
                    clear = None;
                    continue;
                }
            };
            match found {
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

    fn selection(
        &mut self,
        written: &Key<BTreeMap<String, Spanned<Selected>>>,
    ) -> Option<BTreeMap<String, Vec<Value>>> {
        let mut selection = BTreeMap::new();
        let mut clear = Some(());
        let written = written.written();
        for (name, selected) in written.iter().flat_map(|selection| &selection.value) {
            let column = Spanned { value: name.clone(), span: selected.span.clone() };
            let known = match selected.value {
                Selected::Range(_) => self.number(&column),
                _ => self.coordinate("where", &column),
            };
            if known.is_none() {
                clear = None;
                continue;
            }
            let values = selected.value.values(holds(self.table, &self.units, name));
            let Some(values) = self.checks.accept(values, &selected.span) else {
                clear = None;
                continue;
            };
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

    /// Returns the names of entries of the legend, and their order. Refuses an entry that the
    /// legend cannot have.
    ///
    /// Before the study runs, the values of some coordinates are unknown. If those of a numeric
    /// coordinate are unknown, all numbers are accepted, and if those of a text coordinate are
    /// unknown, all words.
    fn legend(
        &mut self,
        keys: &FigureTable,
        panels: Option<&[PanelSpec]>,
        values: impl Fn(&str) -> Option<BTreeSet<Known>>,
    ) -> Option<(BTreeMap<String, String>, Vec<String>)> {
        let names = keys.legend.written().into_iter().flat_map(|names| &names.value);
        let order = keys.legend_order.written().into_iter().flat_map(|order| &order.value);
        let renamed = names.clone().map(|(entry, name)| ("legend", entry, &name.span));
        let sorted = order.clone().map(|entry| ("legend_order", &entry.value, &entry.span));
        let written: Vec<_> = renamed.chain(sorted).collect();
        if written.is_empty() {
            return Some(Default::default());
        }
        let mut entries: BTreeSet<String> = [THIS_STUDY.to_owned()].into();
        let quantities = panels?.iter().flat_map(|panel| &panel.y);
        entries.extend(quantities.map(|quantity| quantity.base().to_owned()));
        let theories = keys.theories.written().into_iter().flat_map(|theories| &theories.value);
        entries.extend(theories.map(|theory| theory.value.word().to_owned()));
        let curves = panels?.iter().flat_map(|panel| &panel.curves);
        let labels: BTreeSet<&String> = curves.filter_map(|curve| curve.label.as_ref()).collect();
        // Whether all coordinates with words, and all with numbers, are known.
        let mut are_known = [true; 2];
        for column in coordinates(self.table) {
            match values(column) {
                Some(known) => entries.extend(known.iter().map(Known::to_string)),
                None => are_known[usize::from(is_number(self.table, column))] = false,
            }
        }
        let mut clear = Some(());
        for (key, entry, span) in written {
            let number = entry.parse::<f64>().ok();
            let is_same = |known: &String| {
                let value = known.parse::<f64>().ok();
                number.zip(value).is_some_and(|(one, other)| decimal::is_same(one, other))
            };
            let is_label = key == "legend_order" && labels.contains(entry);
            if are_known[usize::from(number.is_some())]
                && !is_label
                && !entries.contains(entry)
                && !entries.iter().any(is_same)
            {
                let message = match key {
                    "legend" => {
                        format!("`legend` renames {entry:?}, but the figure has no such entry")
                    }
                    _ => format!("`{key}` names {entry:?}, but the figure has no such entry"),
                };
                let label = "must be the name of a value, of a theory or of a column in `y`";
                let problem = Problem::new(message, span.clone(), label);
                let known = listed(entries.iter().map(String::as_str), "and");
                clear = self.checks.reject(problem.help(format!("entries are {known}")));
            }
        }
        clear.map(|()| {
            (
                names.map(|(entry, name)| (entry.clone(), name.value.clone())).collect(),
                order.map(|entry| entry.value.clone()).collect(),
            )
        })
    }

    /// Returns the labels of axes. Refuses a label of an axis that the figure does not have.
    fn labels(
        &mut self,
        keys: &FigureTable,
        panels: Option<&[PanelSpec]>,
    ) -> Option<BTreeMap<String, String>> {
        let label = |_: &mut Self, _: &str, label: &Spanned<String>| Some(label.value.clone());
        self.by_axes(&keys.labels, "label", panels, label)
    }

    /// Returns the ends of axes. Refuses ends that do not ascend, and those that a logarithmic axis
    /// does not have.
    fn limits(
        &mut self,
        keys: &FigureTable,
        panels: Option<&[PanelSpec]>,
    ) -> Option<BTreeMap<String, [Option<f64>; 2]>> {
        self.by_axes(&keys.limits, "limits", panels, |columns, axis, written| {
            let RangeTable { from, to } = &written.value;
            let written_ends = [from, to].map(|end| end.written().map(|end| end.value.clone()));
            let values: Vec<SelectedValue> = written_ends.iter().flatten().cloned().collect();
            let mut numbers = columns.on_axis(axis, &values, &written.span, panels?)?.into_iter();
            let ends = written_ends.map(|end| end.and_then(|_| numbers.next()));
            if let [Some(from), Some(to)] = ends
                && from >= to
            {
                let message = format!("the limits of {axis:?} do not ascend");
                let label = "`to` must be above `from`";
                let problem = Problem::new(message, written.span.clone(), label);
                return columns.checks.reject(problem);
            }
            Some(ends)
        })
    }

    /// Returns the ticks of axes.
    fn ticks(
        &mut self,
        keys: &FigureTable,
        panels: Option<&[PanelSpec]>,
    ) -> Option<BTreeMap<String, Vec<f64>>> {
        self.by_axes(&keys.ticks, "ticks", panels, |columns, axis, written| {
            columns.on_axis(axis, &written.value, &written.span, panels?)
        })
    }

    /// Converts numbers on an axis to the unit of its column. Refuses numbers that a logarithmic
    /// axis does not have.
    fn on_axis(
        &mut self,
        axis: &str,
        values: &[SelectedValue],
        span: &Span,
        panels: &[PanelSpec],
    ) -> Option<Vec<f64>> {
        let mean = Statistic::Mean.column_of(axis);
        let column = if self.table.has(axis) { axis } else { &mean };
        let unit = self.units.of_column(self.table, column);
        let number = |value: &SelectedValue| match value {
            SelectedValue::Word(word) => quantity::in_unit(word, unit),
            SelectedValue::Number(number) => Ok(*number),
            SelectedValue::Range(range) => Ok(range.from),
        };
        let numbers: Result<Vec<f64>, _> = values.iter().map(number).collect();
        let numbers = self.checks.accept(numbers, span)?;
        let is_logarithmic = panels.iter().any(|panel| match panel.scales {
            Scales::Linear => false,
            Scales::LogX => panel.x == axis,
            Scales::LogY => panel.x != axis,
            Scales::Log => true,
        });
        if is_logarithmic && numbers.iter().any(|number| *number <= 0.0) {
            let message = format!("the axis of {axis:?} is logarithmic");
            let problem = Problem::new(message, span.clone(), "numbers must be above 0");
            return self.checks.reject(problem);
        }
        Some(numbers)
    }

    /// Returns values of axes, by columns or expressions in canonical notation. Refuses a value of
    /// an axis that the figure does not have.
    fn by_axes<W, R>(
        &mut self,
        written: &Key<BTreeMap<String, Spanned<W>>>,
        what: &str,
        panels: Option<&[PanelSpec]>,
        read: impl Fn(&mut Self, &str, &Spanned<W>) -> Option<R>,
    ) -> Option<BTreeMap<String, R>> {
        let Some(written) = written.written() else { return Some(BTreeMap::new()) };
        let axes = |panel: &PanelSpec| -> Vec<String> {
            let along_y = panel.y.iter().map(|one| one.base().to_owned());
            along_y.chain([panel.x.clone()]).collect()
        };
        let axes: BTreeSet<String> = panels?.iter().flat_map(axes).collect();
        let mut values = Some(BTreeMap::new());
        for (name, value) in &written.value {
            let canonical = Expression::parse(name).map_or(name.clone(), |one| one.to_string());
            if !axes.contains(&canonical) {
                let message = format!("no axis of the figure shows {name:?}");
                let known = listed(axes.iter().map(String::as_str), "and");
                let problem =
                    Problem::new(message, value.span.clone(), format!("{what} of no axis"));
                values = self.checks.reject(problem.help(format!("the axes show {known}")));
                continue;
            }
            match (read(self, &canonical, value), &mut values) {
                (Some(value), Some(values)) => {
                    values.insert(canonical, value);
                }
                (None, _) => values = None,
                (Some(_), None) => {}
            }
        }
        values
    }

    /// Returns the theories. Each predicts the area fraction under a load, and asperity models need
    /// the moments of the spectrum.
    fn theories(&mut self, keys: &FigureTable, panels: &[PanelSpec]) -> Option<Vec<Model>> {
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
            if !panels.iter().any(|panel| panel.y.iter().any(Quantity::is_of_areas)) {
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
    selection: &BTreeMap<String, Vec<Value>>,
    values: impl Fn(&str) -> Option<BTreeSet<Known>>,
) -> Vec<EmptySelection> {
    let mut empty = Vec::new();
    let written = keys.selection.written();
    for (column, selected) in written.iter().flat_map(|selection| &selection.value) {
        let Some(known) = values(column) else { continue };
        for value in selection.get(column).into_iter().flatten() {
            if matches!(value, SelectedValue::Range(_))
                || known.iter().any(|known| value.is_same(known))
            {
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
