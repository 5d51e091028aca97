//! Figures that a study declares, with the columns that they draw.
//!
//! The report draws each [`FigureSpec`]; it also makes specifications of its own for results that
//! no declared figure shows.

mod check;

use std::collections::BTreeMap;

use asperity_manifest::expression::Expression;
use asperity_stages::aggregate::{Model, Statistic};
use asperity_stages::columns::{
    AREA_CORRECTED, AREA_FRACTION, ASPERITY_AREA_FRACTION, LOAD, SURFACE,
};
use asperity_tables::table::Table;

pub use crate::manifest::figure::{ErrorBars, FacetPlace, Scales, SelectedValue as Value};
pub use crate::manifest::read_figures_of as read;
pub use crate::study::columns::is_number;
pub use check::{check, on_table};

/// A figure of the table of a stage.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FigureSpec {
    /// Name of the files of the figure.
    pub name: String,
    /// Name of the stage whose table is drawn.
    pub from: String,
    pub panels: Vec<PanelSpec>,
    pub colour: Option<String>,
    /// Columns of which each combination of values has its own panel.
    pub facet: Vec<String>,
    pub facet_in: FacetPlace,
    /// Column that the lines distinguish.
    pub dash: Option<String>,
    /// Whether no line joins the points of a series.
    pub is_apart: bool,
    /// Columns that select rows, each with the values of which a row has one.
    pub selection: BTreeMap<String, Vec<Value>>,
    pub title: Option<String>,
    pub caption: Option<String>,
    pub size: FigureSize,
    /// Family of the letters in the SVG file, before that of the other files.
    pub font_family: Option<String>,
    /// Names of entries of the legend, by values of parameters, columns in `y`, theories, or
    /// [`THIS_STUDY`].
    pub legend: BTreeMap<String, String>,
    /// Entries of the legend in their order, named as in `legend`.
    pub legend_order: Vec<String>,
    /// Labels of axes by columns, or expressions in canonical notation.
    pub labels: BTreeMap<String, String>,
    /// Ends of axes, by the same names, in the unit of the column.
    pub limits: BTreeMap<String, [Option<f64>; 2]>,
    /// Ticks of axes, by the same names, in the unit of the column.
    pub ticks: BTreeMap<String, Vec<f64>>,
}

/// The axes of a figure, or of some of its panels. Quantities with different labels are drawn in
/// panels of their own.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct PanelSpec {
    /// Column, or expression in columns, on the horizontal axis.
    pub x: String,
    pub y: Vec<Quantity>,
    pub scales: Scales,
    /// Columns that select rows, in addition to those of the figure.
    pub selection: BTreeMap<String, Vec<Value>>,
    pub curves: Vec<Curve>,
}

/// A curve beside the data, or one for each series.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    pub law: Law,
    /// Name in the legend, if it is not that of the theory.
    pub label: Option<String>,
    /// Stage whose table has a row for each curve.
    pub from: Option<String>,
    /// Columns that select the rows of `from` or, without it, the series beside which the curve is
    /// drawn.
    pub selection: BTreeMap<String, Vec<Value>>,
    /// Ends of the curve along x.
    pub range: Option<[Expression; 2]>,
}

impl Curve {
    /// Returns whether the curve is a law along x with parameters of another stage, not a level.
    pub fn is_fit_along(&self, x: &str) -> bool {
        self.from.is_some()
            && match &self.law {
                Law::Value(law) | Law::Area(law) => law.columns().contains(x),
                Law::Theory { .. } => true,
            }
    }
}

#[derive(Debug, Clone, PartialEq)]
pub enum Law {
    /// Quantity on the vertical axis, in x and parameters.
    Value(Expression),
    /// Area fraction, in the load and parameters.
    Area(Expression),
    /// Area fraction of a theory, with a given Nayak's parameter or that of each series.
    Theory { model: Model, nayak: Option<f64> },
}

/// Size of the files of a figure. A size that is not given follows from the number of panels.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct FigureSize {
    /// Width in millimetres.
    pub width: Option<f64>,
    /// Height in millimetres.
    pub height: Option<f64>,
    /// Size of the letters in points.
    pub font: Option<f64>,
}

/// Columns of area fractions, which theories predict.
pub const AREAS: [&str; 3] = [AREA_FRACTION.name, AREA_CORRECTED.name, ASPERITY_AREA_FRACTION.name];

/// Legend entry of the data beside theories.
pub const THIS_STUDY: &str = "this study";

/// Quantity on the vertical axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Quantity {
    /// Column of the values, or of their means, or the canonical notation of the expression.
    pub column: String,
    pub expression: Option<Expression>,
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

/// Column with the number of surfaces of a group.
const SURFACES: &str = "surfaces";

impl Quantity {
    /// Finds the column of a quantity and the source of its error bars in a table, which may be
    /// empty. Without `error`, the bars are the best that the table has.
    ///
    /// # Errors
    /// Returns the error bars that the table does not have, or `None` if it has no such column of
    /// numbers.
    pub fn find(
        table: &Table,
        name: &str,
        error: Option<ErrorBars>,
    ) -> Result<Quantity, Option<ErrorBars>> {
        let mean = Statistic::Mean.column_of(name);
        let column = if !table.has(name) && table.has(&mean) { mean } else { name.to_owned() };
        if !is_number(table, &column) {
            return Err(None);
        }
        let bars = if has_surfaces(table) {
            let bars = error.unwrap_or(ErrorBars::Ci95);
            if bars == ErrorBars::None { BarSource::None } else { BarSource::Surfaces(bars) }
        } else {
            bars_of_columns(table, &column, error)?
        };
        Ok(Quantity { column, expression: None, bars })
    }

    /// Creates the quantity of an expression. It has error bars if the rows of the table are
    /// surfaces.
    pub fn of_expression(
        table: &Table,
        expression: Expression,
        error: Option<ErrorBars>,
    ) -> Quantity {
        let bars = error.unwrap_or(ErrorBars::Ci95);
        let has_bars = has_surfaces(table) && bars != ErrorBars::None;
        Quantity {
            column: expression.to_string(),
            expression: Some(expression),
            bars: if has_bars { BarSource::Surfaces(bars) } else { BarSource::None },
        }
    }

    /// Returns whether the quantity is an area fraction, or follows from one and the load.
    pub fn is_of_areas(&self) -> bool {
        let is_area = |name: &str| AREAS.contains(&name);
        match &self.expression {
            None => is_area(self.base()),
            Some(expression) => {
                let columns = expression.columns();
                columns.iter().any(|name| is_area(name))
                    && columns.iter().all(|name| is_area(name) || *name == LOAD.name)
            }
        }
    }

    /// Returns the columns of the ends of its interval.
    pub fn ends(&self) -> Option<&[String; 2]> {
        match &self.bars {
            BarSource::Ends { ends, .. } => Some(ends),
            _ => None,
        }
    }

    /// Returns the name of the quantity without the statistic `mean`.
    pub fn base(&self) -> &str {
        Statistic::Mean.base_of(&self.column).unwrap_or(&self.column)
    }
}

/// Finds the columns of error bars in a table of statistics or fits. Returns the requested kind if
/// the table does not have it.
fn bars_of_columns(
    table: &Table,
    column: &str,
    error: Option<ErrorBars>,
) -> Result<BarSource, Option<ErrorBars>> {
    let base = Statistic::Mean.base_of(column);
    let known = |names: Vec<String>| names.iter().all(|name| table.has(name)).then_some(names);
    let of_mean = |statistic: Statistic| known(statistic.columns_of(base?));
    let of_fit = |suffixes: &[&str]| {
        known(suffixes.iter().map(|suffix| format!("{column}_{suffix}")).collect())
    };
    let ends = |names: Option<Vec<String>>, meaning| {
        Some(BarSource::Ends { ends: names?.try_into().ok()?, meaning })
    };
    let ends_95 = || ends(of_mean(Statistic::Confidence(0.95)), EndsMeaning::Ci95);
    let sem = || of_mean(Statistic::Sem)?.pop();
    let student = || {
        let surfaces = table.has(SURFACES).then(|| SURFACES.to_owned())?;
        Some(BarSource::Student { error: sem()?, surfaces })
    };
    let fitted = || ends(of_fit(&["lower", "upper"]), EndsMeaning::OfFit);
    let half = |column: Option<String>, meaning| Some(BarSource::Half { column: column?, meaning });
    let bars = match error {
        None => Some(ends_95().or_else(student).or_else(fitted).unwrap_or(BarSource::None)),
        Some(ErrorBars::None) => Some(BarSource::None),
        Some(ErrorBars::Ci95) => ends_95().or_else(student),
        Some(ErrorBars::Sem) => {
            half(sem().or_else(|| of_fit(&["standard_error"])?.pop()), ErrorBars::Sem)
        }
        Some(ErrorBars::Sd) => {
            half(of_mean(Statistic::Sd).and_then(|mut names| names.pop()), ErrorBars::Sd)
        }
    };
    bars.ok_or(error)
}

/// Returns whether the rows of a table describe single surfaces.
pub fn has_surfaces(table: &Table) -> bool {
    table.has(SURFACE.name)
}
