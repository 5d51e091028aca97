//! Checks of the tables `[figure.NAME]` of a manifest.

use std::collections::{BTreeMap, BTreeSet};

use super::{AREAS, Curve, ErrorBars, FigureSize, FigureSpec, Law, PanelSpec, Quantity, Scales};
use super::{has_surfaces, is_number};
use crate::manifest::figure::{
    CurveTable, FigureTable, PanelTable, RangeTable, Selected, SelectedValue, Words, WrittenFigure,
};
use crate::study::columns::{ColumnChecks, Selection, StageTables, all, part_of};
use crate::study::graph::check_names;
use asperity_manifest::diagnostics::{Problem, Problems, Span, listed};
use asperity_manifest::expression::Expression;
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::{Key, Spanned, quantity};
use asperity_stages::Kind;
use asperity_stages::aggregate::{Model, SPECTRUM_COLUMNS, Statistic};
use asperity_stages::columns::LOAD;
use asperity_stages::units::TableUnits;
use asperity_tables::column::Role;
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

/// Checks the figures of a manifest.
pub fn check(
    figures: &[WrittenFigure],
    tables: StageTables,
    problems: &mut Problems,
) -> Option<Vec<FigureSpec>> {
    check_names("figure", figures.iter().map(|figure| &figure.name), problems);
    all(figures.iter().map(|figure| check_figure(figure, tables, problems)))
}

/// Checks a figure, and returns it if it has no problems.
fn check_figure(
    WrittenFigure { name, keys: section }: &WrittenFigure,
    tables: StageTables,
    problems: &mut Problems,
) -> Option<FigureSpec> {
    let point = section.points.first()?;
    let keys = &point.table;
    let checks = &mut Checks::new(section, point, problems);
    let from = checks.required("from", &keys.from);
    if keys.panels.written().is_none() && !checks.is_reported("panels") {
        let (x, y) = (checks.required("x", &keys.x), checks.required("y", &keys.y));
        x.and(y)?;
    }
    let from = from?;
    let mut columns = ColumnChecks { tables, checks };
    columns.stage(from)?;
    let table = columns.table(&from.value)?;
    let mut figure = FigureChecks { stage: &from.value, table, columns };
    let panels = figure.panels(keys);
    let mut coordinate = |key: &str, written: Option<&Spanned<String>>| {
        written.map_or(Some(None), |written| figure.coordinate(key, written).map(Some))
    };
    let colour = coordinate("colour", keys.colour.written());
    let dash = coordinate("dash", keys.dash.written());
    let facets = keys.facet.written().into_iter().flat_map(|facet| &facet.value);
    let facet: Option<Vec<String>> = all(facets.map(|facet| figure.coordinate("facet", facet)));
    let selection = figure.selection(&keys.selection);
    let label = |_: &mut FigureChecks, _: &str, label: &Spanned<String>| Some(label.value.clone());
    let labels = figure.by_axes(&keys.labels, "label", panels.as_deref(), label);
    let limits = figure.limits(keys, panels.as_deref());
    let ticks = figure.by_axes(&keys.ticks, "ticks", panels.as_deref(), |figure, axis, written| {
        figure.on_axis(axis, &written.value, &written.span, panels.as_deref()?)
    });
    let checks = figure.columns.checks;
    let size = FigureSize {
        width: checks.optional_number("width", &keys.width)?,
        height: checks.optional_number("height", &keys.height)?,
        font: checks.optional_number("font_size", &keys.font_size)?,
    };
    let legend = keys.legend.written().into_iter().flat_map(|legend| &legend.value);
    let order = keys.legend_order.written().into_iter().flat_map(|order| &order.value);
    let text = |name: &str, key: &Key<String>| {
        Some(checks.optional(name, key)?.map(|text| text.value.clone()))
    };
    Some(FigureSpec {
        name: name.value.clone(),
        from: from.value.clone(),
        title: text("title", &keys.title)?,
        caption: text("caption", &keys.caption)?,
        font_family: text("font_family", &keys.font_family)?,
        panels: panels?,
        colour: colour?,
        facet: facet?,
        facet_in: checks.value("facet_in", &keys.facet_in)?,
        dash: dash?,
        is_apart: !checks.value("lines", &keys.lines)?,
        selection: selection?,
        size,
        legend: legend.map(|(entry, name)| (entry.clone(), name.value.clone())).collect(),
        legend_order: order.map(|entry| entry.value.clone()).collect(),
        labels: labels?,
        limits: limits?,
        ticks: ticks?,
    })
}

/// Returns a figure of the program for the table of a stage of this kind, or `None` if the stage is
/// of another kind than `from` or the table lacks a column.
pub fn on_table(figure: &WrittenFigure, kind: &str, table: &Table) -> Option<FigureSpec> {
    let tables = StageTables {
        stages: &Kind::ALL.map(Kind::name),
        table: &|name| (name == kind).then_some(table),
        units: &|_| TableUnits::default(),
    };
    check_figure(figure, tables, &mut Problems::default())
}

/// Checks of the columns that a figure names.
struct FigureChecks<'a, 'c, 't> {
    stage: &'a str,
    table: &'t Table,
    columns: ColumnChecks<'a, 'c, 't>,
}

impl FigureChecks<'_, '_, '_> {
    /// Returns the panels of a figure: those of its key `panels` or, without it, one with the keys
    /// of the figure.
    fn panels(&mut self, keys: &FigureTable) -> Option<Vec<PanelSpec>> {
        let alone = PanelTable::default();
        let written: Vec<&PanelTable> =
            match self.columns.checks.optional("panels", &keys.panels)? {
                Some(panels) => panels.value.iter().map(|panel| &panel.value).collect(),
                None => vec![&alone],
            };
        let panels = written.into_iter().map(|panel| self.panel(keys, panel));
        let mut panels: Vec<PanelSpec> = all(panels)?;
        let theories = self.theories(keys, &panels)?;
        for panel in panels.iter_mut().filter(|panel| panel.y.iter().any(Quantity::is_of_areas)) {
            let curves = theories.iter().map(|&model| Curve {
                law: Law::Theory { model, nayak: None },
                label: None,
                from: None,
                selection: BTreeMap::new(),
                range: None,
            });
            panel.curves.splice(0..0, curves);
        }
        Some(panels)
    }

    fn panel(&mut self, keys: &FigureTable, panel: &PanelTable) -> Option<PanelSpec> {
        let checks = &mut *self.columns.checks;
        let x = panel.x.written().or_else(|| checks.required("x", &keys.x));
        let own: Option<Vec<Spanned<String>>> = panel.y.written().map(|y| {
            let words = match &y.value {
                Words::One(word) => std::slice::from_ref(word),
                Words::Many(words) => words,
            };
            words.iter().map(|word| Spanned { value: word.clone(), span: y.span.clone() }).collect()
        });
        let y = own.as_ref().or_else(|| checks.required("y", &keys.y).map(|y| &y.value));
        let (x, y) = (x?, y?);
        let x_column = self.abscissa(x);
        let quantities = self.quantities(y, keys);
        let scale = &keys.scale;
        let scales = panel.scale.value().or_else(|| self.columns.checks.value("scale", scale));
        let selection = self.selection(&panel.selection);
        let (x, y) = (x_column?, quantities?);
        let lists = [&keys.curves, &panel.curves].map(Key::written).into_iter().flatten();
        let written = lists.flat_map(|curves| &curves.value);
        let mut curves: Vec<Curve> = all(written.map(|curve| self.curve(curve, &x)))?;
        let is_of_areas = y.iter().any(Quantity::is_of_areas);
        curves.retain(|curve| is_of_areas || matches!(curve.law, Law::Value(_)));
        Some(PanelSpec { x, y, scales: scales?, selection: selection?, curves })
    }

    fn curve(&mut self, written: &Spanned<CurveTable>, x: &str) -> Option<Curve> {
        let Spanned { value: keys, span } = written;
        let from = keys.from.written();
        if let Some(from) = from {
            self.columns.stage(from)?;
        }
        let free = if keys.area.0.is_some() { LOAD.name } else { x };
        let mut expression = |written: &Spanned<String>| -> Option<Expression> {
            let expression = self.columns.expression(written)?;
            if expression.has_slope() {
                let label = "give the law, of which the panel can draw the slope";
                let message = "a curve cannot contain `slope`";
                return self.columns.refuse(message, &written.span, label);
            }
            let parameters = expression.columns().into_iter().filter(|name| *name != free);
            for name in parameters.filter(|_| from.is_none()) {
                self.columns.number(self.stage, &part_of(written, name))?;
            }
            Some(expression)
        };
        let law = match (keys.value.written(), keys.area.written(), keys.theory.value()) {
            (Some(value), None, None) => Law::Value(expression(value)?),
            (None, Some(area), None) => Law::Area(expression(area)?),
            (None, None, Some(model)) => Law::Theory { model, nayak: keys.nayak.value() },
            _ => {
                let message = "a curve is given by one of `value`, `area` and `theory`";
                return self.columns.refuse(message, span, "none or several here");
            }
        };
        let range = match keys.range.written().map(|range| range.value.as_slice()) {
            Some([from, to]) => Some([expression(from)?, expression(to)?]),
            _ => None,
        };
        let selection = match from {
            Some(from) => self.columns.selection(Some(&from.value), &keys.selection)?,
            None => self.selection(&keys.selection)?,
        };
        let text = |key: &Key<String>| key.written().map(|text| text.value.clone());
        Some(Curve { law, label: text(&keys.label), from: text(&keys.from), selection, range })
    }

    /// Returns the expression in columns of numbers that a text is, and `Some(None)` if the text
    /// is a name.
    fn expression(&mut self, written: &Spanned<String>) -> Option<Option<Expression>> {
        let is_part = |letter: char| letter.is_alphanumeric() || letter == '_';
        if self.table.has(&written.value) || written.value.chars().all(is_part) {
            return Some(None);
        }
        let expression = self.columns.expression(written)?;
        for name in expression.columns() {
            self.columns.number(self.stage, &part_of(written, name))?;
        }
        let has_loads = has_surfaces(self.table) && self.table.has(LOAD.name);
        if expression.has_slope() && !has_loads {
            let message =
                format!("`slope` needs surfaces under loads, which `{}` lacks", self.stage);
            let label = "the derivative with respect to the load";
            return self.columns.refuse(message, &written.span, label);
        }
        Some(Some(expression))
    }

    fn abscissa(&mut self, written: &Spanned<String>) -> Option<String> {
        match self.expression(written)? {
            None => {
                self.columns.number(self.stage, written)?;
                Some(written.value.clone())
            }
            Some(expression) if expression.has_slope() => {
                let label = "the derivative with respect to the load";
                self.columns.refuse("`x` cannot contain `slope`", &written.span, label)
            }
            Some(expression) => Some(expression.to_string()),
        }
    }

    fn quantities(&mut self, y: &[Spanned<String>], keys: &FigureTable) -> Option<Vec<Quantity>> {
        let error = keys.error.written();
        let quantities: Vec<Quantity> = all(y.iter().map(|name| {
            let bars = error.map(|error| error.value);
            if let Some(expression) = self.expression(name)? {
                return Some(Quantity::of_expression(self.table, expression, bars));
            }
            let span = error.map_or(&name.span, |error| &error.span);
            match Quantity::find(self.table, &name.value, bars) {
                Ok(quantity) => Some(quantity),
                Err(Some(kind)) => self.no_bars(&name.value, kind, span),
                Err(None) => self.columns.number(self.stage, name).and(None),
            }
        }))?;
        let is_repeated =
            |(index, quantity): (usize, &Quantity)| quantities[..index].contains(quantity);
        match quantities.iter().enumerate().position(is_repeated) {
            Some(index) => {
                let message = format!("`y` names {:?} twice", y[index].value);
                self.columns.refuse(message, &y[index].span, "here again")
            }
            None => Some(quantities),
        }
    }

    /// Reports that a table has no columns for error bars.
    fn no_bars<T>(&mut self, name: &str, kind: ErrorBars, span: &Span) -> Option<T> {
        let word = match kind {
            ErrorBars::Ci95 | ErrorBars::None => "ci95",
            ErrorBars::Sem => "sem",
            ErrorBars::Sd => "sd",
        };
        let label = if self.table.has(&format!("{name}_lower")) {
            "leave `error` out to draw the intervals of the fits".to_owned()
        } else {
            format!("add {word:?} to `statistics` of this stage")
        };
        let stage = self.stage;
        let message = format!("the table of `{stage}` has no {word:?} error bars for {name:?}");
        self.columns.refuse(message, span, label)
    }

    fn coordinate(&mut self, key: &str, written: &Spanned<String>) -> Option<String> {
        let known = coordinates(self.table);
        if known.contains(&written.value.as_str()) {
            return Some(written.value.clone());
        }
        if !self.table.has(&written.value) {
            return self.columns.unknown_column(self.stage, written, &known);
        }
        let message = format!("`{key}` cannot be {:?}", written.value);
        let problem = Problem::new(message, written.span.clone(), "neither a parameter nor a load");
        let help = format!("it can be {}", listed(known, "or"));
        self.columns.checks.reject(problem.help(help))
    }

    /// Returns the selected values of coordinates, and of ranges of columns of numbers.
    fn selection(
        &mut self,
        written: &Key<BTreeMap<String, Spanned<Selected>>>,
    ) -> Option<Selection> {
        let columns = written.written().into_iter().flat_map(|written| &written.value);
        let known: Option<Vec<()>> = all(columns.clone().map(|(name, selected)| {
            let column = Spanned { value: name.clone(), span: selected.span.clone() };
            match selected.value {
                Selected::Range(_) => self.columns.number(self.stage, &column),
                _ => self.coordinate("where", &column).map(drop),
            }
        }));
        known?;
        let selection = self.columns.selection(Some(self.stage), written)?;
        for (name, selected) in columns {
            let is_number = is_number(self.table, name);
            let is_text = |value: &SelectedValue| matches!(value, SelectedValue::Word(_));
            if selection[name].iter().any(|value| is_text(value) == is_number) {
                let message = format!("`where` compares {name:?} with a value of the wrong type");
                let label = if is_number {
                    "the column holds numbers"
                } else {
                    "the column holds texts, which need quotes"
                };
                return self.columns.refuse(message, &selected.span, label);
            }
        }
        Some(selection)
    }

    /// Returns the ends of axes. Refuses ends that do not ascend, and those that a logarithmic axis
    /// does not have.
    fn limits(
        &mut self,
        keys: &FigureTable,
        panels: Option<&[PanelSpec]>,
    ) -> Option<BTreeMap<String, [Option<f64>; 2]>> {
        self.by_axes(&keys.limits, "limits", panels, |figure, axis, written| {
            let RangeTable { from, to } = &written.value;
            let mut end = |key: &Key<SelectedValue>| match key.written() {
                Some(end) => {
                    let ends = std::slice::from_ref(&end.value);
                    Some(Some(figure.on_axis(axis, ends, &written.span, panels?)?[0]))
                }
                None => Some(None),
            };
            let ends = [end(from)?, end(to)?];
            if let [Some(from), Some(to)] = ends
                && from >= to
            {
                let message = format!("the limits of {axis:?} do not ascend");
                return figure.columns.refuse(message, &written.span, "`to` must be above `from`");
            }
            Some(ends)
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
        let units = (self.columns.tables.units)(self.stage);
        let unit = units.of_column(self.table, column);
        let number = |value: &SelectedValue| match value {
            SelectedValue::Word(word) => quantity::in_unit(word, unit),
            SelectedValue::Number(number) => Ok(*number),
            SelectedValue::Range(range) => Ok(range.from),
        };
        let numbers: Result<Vec<f64>, _> = values.iter().map(number).collect();
        let numbers = self.columns.checks.accept(numbers, span)?;
        let is_logarithmic = panels.iter().any(|panel| match panel.scales {
            Scales::Linear => false,
            Scales::LogX => panel.x == axis,
            Scales::LogY => panel.x != axis,
            Scales::Log => true,
        });
        if is_logarithmic && numbers.iter().any(|number| *number <= 0.0) {
            let message = format!("the axis of {axis:?} is logarithmic");
            return self.columns.refuse(message, span, "numbers must be above 0");
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
        let axes = panels?.iter().flat_map(|panel| {
            let along_y = panel.y.iter().map(|one| one.base().to_owned());
            along_y.chain([panel.x.clone()])
        });
        let axes: BTreeSet<String> = axes.collect();
        all(written.written().into_iter().flat_map(|written| &written.value).map(
            |(name, value)| {
                let canonical = Expression::parse(name).map_or(name.clone(), |one| one.to_string());
                if axes.contains(&canonical) {
                    let value = read(self, &canonical, value)?;
                    return Some((canonical, value));
                }
                let message = format!("no axis of the figure shows {name:?}");
                let problem =
                    Problem::new(message, value.span.clone(), format!("{what} of no axis"));
                let known = listed(axes.iter().map(String::as_str), "and");
                self.columns.checks.reject(problem.help(format!("the axes show {known}")))
            },
        ))
    }

    /// Returns the theories. Each predicts the area fraction under a load, and asperity models need
    /// the moments of the spectrum.
    fn theories(&mut self, keys: &FigureTable, panels: &[PanelSpec]) -> Option<Vec<Model>> {
        let written = keys.theories.written().map_or(&[][..], |theories| &theories.value);
        all(written.iter().enumerate().map(|(index, Spanned { value: model, span })| {
            if written[..index].iter().any(|before| before.value == *model) {
                let message = "`theories` has the same theory twice";
                return self.columns.refuse(message, span, "here again");
            }
            if !panels.iter().any(|panel| panel.y.iter().any(Quantity::is_of_areas)) {
                let message = format!("theories predict {}", listed(AREAS, "or"));
                return self.columns.refuse(message, span, "none of these columns is in `y`");
            }
            let spectrum: &[&str] =
                if model.asperities().is_some() { &SPECTRUM_COLUMNS } else { &[] };
            let needed = spectrum.iter().copied().chain([LOAD.name]);
            let missing: Vec<&str> = needed.filter(|name| !self.table.has(name)).collect();
            if !missing.is_empty() {
                let missing = listed(missing, "and");
                let message = format!("the theory needs {missing}, which the table does not have");
                let label = "needs loads on surfaces drawn from a spectrum";
                return self.columns.refuse(message, span, label);
            }
            Some(*model)
        }))
    }
}
