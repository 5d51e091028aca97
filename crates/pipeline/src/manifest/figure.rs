//! Keys of the tables `[figure.NAME]`, with which a study declares figures of its results.

use std::collections::BTreeMap;
use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_spanned::Spanned as TomlSpanned;
use toml::de::{DeString, DeTable};

use asperity_manifest::decimal;
use asperity_manifest::keys::declare::{list, required};
use asperity_manifest::keys::quantity::{self, Unit};
use asperity_manifest::keys::{Key, Section, Spanned, deserialize_either, table};
use asperity_stages::aggregate::Model;
use asperity_tables::column::Value;

/// A figure of the results of a stage, drawn by `asperity report`. Figures do not influence results
/// or their keys.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FigureTable {
    /// Name of the stage whose table is drawn.
    #[schemars(transform = required)]
    pub from: Key<String>,
    /// Column on the horizontal axis, such as `"hurst"` or `"load"`, or an expression in columns,
    /// such as `"k_upper / k_lower"`.
    pub x: Key<String>,
    /// Column on the vertical axis, or a list of columns; columns of different quantities are drawn
    /// in panels side by side. If the table has a row for each surface, points are means over the
    /// surfaces. For the table of an `aggregate` stage, `"area_fraction"` stands for
    /// `"area_fraction_mean"` with its interval. An expression, such as `"area_fraction / load"` or
    /// `"slope(area_fraction)"`, is evaluated with the means over the surfaces; its bars are
    /// computed by the delete-one jackknife.
    #[schemars(length(min = 1), transform = list)]
    pub y: Key<Vec<Spanned<String>>>,
    /// Panels with keys of their own: `[{ y = "area_fraction" }, { y = "mean_gap", scale = "log-x"
    /// }]`. A key that a panel does not have is that of the figure; selections and curves are added
    /// to those of the figure.
    #[schemars(length(min = 1))]
    pub panels: Key<Vec<Spanned<PanelTable>>>,
    /// Labels of the axes, by columns or expressions: `{ "area_fraction / load" = "secant" }`.
    pub labels: Key<BTreeMap<String, Spanned<String>>>,
    /// Ends of the axes, by columns or expressions: `{ pressure = { from = 0, to = "100 MPa" } }`.
    /// Numbers are in the unit of the column. By default the axes hold the data.
    pub limits: Key<BTreeMap<String, Spanned<RangeTable>>>,
    /// Ticks of the axes, by columns or expressions: `{ pressure = ["10 MPa", "20 MPa", "50 MPa"]
    /// }`. By default they are round numbers.
    pub ticks: Key<BTreeMap<String, Spanned<Vec<SelectedValue>>>>,
    /// Parameter, or the load, that the colours distinguish. `color` is the same key. By default it
    /// is the first parameter, or the load, that differs between points with the same x.
    pub colour: Key<String>,
    /// Parameter, or the load, of which each value has its own panel, or a list of them, of which
    /// each combination has one. Panels of numbers ascend; others are in the order of the table.
    #[schemars(length(min = 1), transform = list)]
    pub facet: Key<Vec<Spanned<String>>>,
    /// Place of the panels of one value of `facet`.
    #[schemars(extend("default" = "row"))]
    pub facet_in: Key<FacetPlace>,
    /// Parameter, or the load, that the lines distinguish: the first value has a wide line, the
    /// others dashed ones in the same colour. Along a path, such as that of contacts with adhesion,
    /// a line begins where the one before ends.
    pub dash: Key<String>,
    /// Whether lines join the points of a series. With `false`, the series of a panel are shifted
    /// sideways by some per cent of the axis, so that their error bars stand beside each other.
    #[schemars(extend("default" = true))]
    pub lines: Key<bool>,
    /// Meaning of the error bars. By default they are 95 % confidence intervals or, for fits, the
    /// intervals of the fits.
    pub error: Key<ErrorBars>,
    /// Scales of the axes.
    #[schemars(extend("default" = "linear"))]
    pub scale: Key<Scales>,
    /// Theories whose areas are drawn as curves, named as in `models` of `aggregate`. They need
    /// area fractions on the vertical axis, and a column `load`. By default there are none.
    #[schemars(length(min = 1), transform = list)]
    pub theories: Key<Vec<Spanned<Model>>>,
    /// Selection of the rows by columns: `{ load = 0.05, hurst = [0.3, 0.8] }` draws the rows with
    /// this load and with one of these Hurst exponents, and `{ load = { from = 0.01, to = 0.06 } }`
    /// the rows with a load in this range. Numbers may have a unit, as in `{ pressure = "100 MPa"
    /// }`. By default all rows are drawn.
    #[serde(rename = "where")]
    pub selection: Key<BTreeMap<String, Spanned<Selected>>>,
    /// Curves beside the data: `[{ area = "erf(sqrt(2) * load)", label = "Persson" }]`.
    #[schemars(length(min = 1))]
    pub curves: Key<Vec<Spanned<CurveTable>>>,
    /// Title of the figure, on the page and in the files. By default the page has a title with the
    /// quantities, and the files have none.
    pub title: Key<String>,
    /// Text below the figure on the page, before the sentence on surfaces and error bars.
    pub caption: Key<String>,
    /// Width of the SVG, PNG and PDF files, in millimetres: 86 for a column of many journals. By
    /// default it follows from the number of panels.
    #[schemars(range(min = 40, max = 1200))]
    pub width: Key<f64>,
    /// Height of the files, in millimetres, with title and legend. By default it follows from the
    /// width.
    #[schemars(range(min = 40, max = 1200))]
    pub height: Key<f64>,
    /// Size of the letters in the files, in points. Lines and markers have a size in proportion.
    #[schemars(range(min = 4, max = 72), extend("default" = 9.75))]
    pub font_size: Key<f64>,
    /// Family of the letters in the SVG file: `"Arial"`. Programs that lack it take DejaVu Sans,
    /// which PNG and PDF files contain.
    pub font_family: Key<String>,
    /// Other names for entries of the legend and for panels: `{ "0.3" = "rough", persson =
    /// "theory" }`. An entry is given by the value of its parameter, in quotes if it contains a
    /// point, by its theory, or by its column in `y`. `"this study"` stands for the data beside
    /// theories.
    pub legend: Key<BTreeMap<String, Spanned<String>>>,
    /// Order of the entries of the legend, which are given as in `legend`: `["0.8", "0.3",
    /// "persson"]`. Other entries follow in their order. By default numbers ascend.
    #[schemars(length(min = 1))]
    pub legend_order: Key<Vec<Spanned<String>>>,
}

table!(FigureTable);

/// A panel of a figure.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct PanelTable {
    /// Column or expression on the horizontal axis.
    pub x: Key<String>,
    /// Column or expression on the vertical axis, or a list of them.
    pub y: Key<Words>,
    /// Scales of the axes.
    pub scale: Key<Scales>,
    /// Selection of the rows by columns, in addition to that of the figure.
    #[serde(rename = "where")]
    pub selection: Key<BTreeMap<String, Spanned<Selected>>>,
    /// Curves of this panel.
    pub curves: Key<Vec<Spanned<CurveTable>>>,
}

/// A curve beside the data of a figure. It is given by one of `value`, `area` and `theory`.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct CurveTable {
    /// Expression for the quantity on the vertical axis, in the column of the horizontal axis and
    /// in parameters: `"0.4 * load^0.9"`. If it has a parameter, each series has its own curve.
    pub value: Key<String>,
    /// Expression for the area fraction, in `load` and in parameters. In a panel of an expression,
    /// such as `"area_fraction / load"`, the curve is that expression of this area.
    pub area: Key<String>,
    /// Theory of the area fraction, for surfaces with the parameter `nayak`.
    pub theory: Key<Model>,
    /// Nayak's parameter α of the surfaces of `theory`. By default it is that of each series.
    #[schemars(range(min = 1.5))]
    pub nayak: Key<f64>,
    /// Name in the legend. By default it is that of the theory, or the curve has no entry.
    pub label: Key<String>,
    /// Stage whose table has a row for each curve, such as a `fit`; its columns are the parameters
    /// of the expression. If its rows are surfaces, a curve has their means at a parameter point.
    /// By default the parameters are those of the table of the figure.
    pub from: Key<String>,
    /// Selection of the rows of `from` or, without `from`, of the series that have the curve.
    #[serde(rename = "where")]
    pub selection: Key<BTreeMap<String, Spanned<Selected>>>,
    /// Expressions for the ends of the curve along x, in columns of `from`. The curve does not
    /// extend beyond the data.
    #[schemars(length(min = 2, max = 2))]
    pub range: Key<Vec<Spanned<String>>>,
}

/// One text or several.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum Words {
    /// A text.
    One(String),
    /// Several texts.
    Many(#[schemars(length(min = 1))] Vec<String>),
}

deserialize_either!(Words { word => One, list => Many });

/// Quantity that the error bars show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ErrorBars {
    /// 95 % confidence interval of the mean, by Student's t over the surfaces.
    Ci95,
    /// Standard error of the mean over the surfaces.
    Sem,
    /// Standard deviation over the surfaces.
    Sd,
    /// No error bars.
    None,
}

/// Place of the panels of one value of the key `facet`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FacetPlace {
    /// The quantities of a value stand beside each other, if there is room.
    #[default]
    Row,
    /// The quantities of a value stand below each other, if there are two or three values.
    Column,
}

/// Scales of the two axes.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Scales {
    /// Both axes are linear.
    #[default]
    Linear,
    /// The horizontal axis is logarithmic.
    LogX,
    /// The vertical axis is logarithmic.
    LogY,
    /// Both axes are logarithmic.
    Log,
}

/// Values of a column that select rows.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum Selected {
    /// A number.
    Number(f64),
    /// A text.
    Word(String),
    /// Several values, of which a row has one.
    List(#[schemars(length(min = 1))] Vec<SelectedValue>),
    /// A range of numbers with its ends.
    Range(RangeTable),
}

deserialize_either!(Selected { number => Number, word => Word, list => List, table => Range });

/// Ends of a range of the numbers of a column. By default an end is infinite.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct RangeTable {
    /// Smallest number, in the unit of the column or with a unit.
    pub from: Key<SelectedValue>,
    /// Largest number, in the unit of the column or with a unit.
    pub to: Key<SelectedValue>,
}

/// Values of a column from which rows are selected.
#[derive(Debug, Clone, Copy)]
pub enum Holds {
    /// Numbers, in this unit if it is known.
    Numbers(Option<&'static Unit>),
    /// Texts, or what a table without known columns holds.
    Others,
}

/// Range of the numbers of a column.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SelectedRange {
    pub from: f64,
    pub to: f64,
}

impl SelectedRange {
    /// Returns whether a number is in the range, whose ends may deviate by rounding.
    fn holds(&self, number: f64) -> bool {
        let is_end = |end| decimal::is_same(number, end);
        (self.from..=self.to).contains(&number) || is_end(self.from) || is_end(self.to)
    }
}

/// One value of a column.
#[derive(Debug, Clone, PartialEq, JsonSchema)]
#[schemars(untagged)]
pub enum SelectedValue {
    Number(f64),
    Word(String),
    #[schemars(skip)]
    Range(SelectedRange),
}

deserialize_either!(SelectedValue { number => Number, word => Word });

impl SelectedValue {
    /// Returns whether a cell of a table has this value.
    pub fn is_same(&self, cell: &Value) -> bool {
        match (self, cell) {
            (SelectedValue::Number(number), Value::Real(cell)) => decimal::is_same(*number, *cell),
            (SelectedValue::Number(number), Value::Integer(cell)) => *number == *cell as f64,
            (SelectedValue::Word(word), Value::Text(cell)) => word == cell,
            (SelectedValue::Range(range), Value::Real(cell)) => range.holds(*cell),
            (SelectedValue::Range(range), Value::Integer(cell)) => range.holds(*cell as f64),
            _ => false,
        }
    }
}

impl fmt::Display for SelectedValue {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            SelectedValue::Number(number) => write!(formatter, "{number}"),
            SelectedValue::Word(word) => write!(formatter, "{word:?}"),
            SelectedValue::Range(range) => write!(formatter, "{} to {}", range.from, range.to),
        }
    }
}

impl Selected {
    /// Returns the selected values. Quantities become numbers in the unit of the column.
    ///
    /// # Errors
    /// Returns message and label of the problem of a quantity that cannot be converted.
    pub fn values(&self, column: Holds) -> Result<Vec<SelectedValue>, (String, String)> {
        let unit = match column {
            Holds::Numbers(unit) => unit,
            Holds::Others => None,
        };
        let value = |value: &SelectedValue| match (value, column) {
            (SelectedValue::Word(word), Holds::Numbers(_)) if quantity::split(word).is_some() => {
                quantity::in_unit(word, unit).map(SelectedValue::Number)
            }
            _ => Ok(value.clone()),
        };
        let end = |key: &Key<SelectedValue>, otherwise: f64| match key.written() {
            Some(Spanned { value: SelectedValue::Number(number), .. }) => Ok(*number),
            Some(Spanned { value: SelectedValue::Word(word), .. }) => quantity::in_unit(word, unit),
            _ => Ok(otherwise),
        };
        match self {
            Selected::Number(number) => Ok(vec![SelectedValue::Number(*number)]),
            Selected::Word(word) => Ok(vec![value(&SelectedValue::Word(word.clone()))?]),
            Selected::List(values) => values.iter().map(value).collect(),
            Selected::Range(range) => Ok(vec![SelectedValue::Range(SelectedRange {
                from: end(&range.from, f64::NEG_INFINITY)?,
                to: end(&range.to, f64::INFINITY)?,
            })]),
        }
    }
}

/// A named table as written, such as `[figure.NAME]`.
#[derive(Debug)]
pub struct WrittenTable<T> {
    pub name: Spanned<String>,
    pub keys: Section<T>,
}

/// One table `[figure.NAME]` as written.
pub type WrittenFigure = WrittenTable<FigureTable>;

/// Renames the key `color` to `colour`, unless the table has both.
pub fn in_british_spelling(table: &mut DeTable<'_>) {
    if table.contains_key("colour") {
        return;
    }
    if let Some((key, value)) = table.remove_entry("color") {
        table.insert(TomlSpanned::new(key.span(), DeString::Borrowed("colour")), value);
    }
}
