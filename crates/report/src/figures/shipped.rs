//! Figures that every study can have, declared in a file that the program contains.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use arrow::datatypes::Schema;
use serde::Deserialize;

use asperity_manifest::decimal;
use asperity_pipeline::manifest::figure::WrittenFigure;
use asperity_pipeline::study::figures::{BarSource, FigureSpec, on_table, read};
use asperity_stages::Kind;
use asperity_stages::columns::{
    COEFFICIENT, CORRECTION, EFFECTIVE_MODULUS, K_UPPER, LAYER_THICKNESS, LOAD, WORK_OF_ADHESION,
};
use asperity_stages::ensemble::{grouped, load_column};
use asperity_stages::output_units::Conversion;
use asperity_stages::surface::coordinates;
use asperity_stages::units::TableUnits;
use asperity_tables::column::{Role, Value};
use asperity_tables::table::{Table, TableError};

use crate::ReportError;
use crate::charts::Panel;
use crate::figure_data::FigureData;
use crate::figures::Drawn;
use crate::figures::declared::{self, Looks};
use crate::finished::FinishedStage;
use crate::points::{self, Point};
use crate::styles::Styles;

const TEXT: &str = include_str!("../../figures/yastrebov-2015.toml");

/// The figures of the file.
static FIGURES: LazyLock<Vec<WrittenFigure>> = LazyLock::new(|| read(TEXT));
static PAGE: LazyLock<Page> = LazyLock::new(|| {
    toml::from_str(TEXT).unwrap_or_else(|error| unreachable!("a test reads this file: {error}"))
});

/// Tables of the file besides figures.
#[derive(Deserialize)]
struct Page {
    /// Names of all figures in the order of the page.
    order: Vec<String>,
    rows: BTreeMap<String, Rows>,
    needed: BTreeMap<String, Needed>,
    /// Lines of manifests by name.
    lines: BTreeMap<String, String>,
}

/// Rows that a figure shows, and columns beside them.
#[derive(Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Rows {
    /// Load beyond which the study must reach.
    reaches: f64,
    /// Whether only bodies with a modulus are drawn.
    modulus: bool,
    /// Whether contacts with adhesion or a layer are drawn, too.
    all_contacts: bool,
    /// Loads of which only the nearest ones of the study are drawn.
    near: Vec<f64>,
    /// Smallest number of parameter points, apart from corrections of the area.
    points: usize,
    /// Parameters along which the points of a series lie.
    along: Vec<String>,
    /// Whether each panel has axes of its own, because densities differ by orders of magnitude.
    own_axes: bool,
    /// Further columns of panels, in studies that have them.
    facet: Vec<String>,
    /// Results of other stages; the first that the study has are taken.
    beside: Vec<Beside>,
}

/// Results of other stages, which are added to the rows that agree in all coordinates.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Beside {
    /// Kind of the stages.
    from: String,
    /// Texts that select their rows, by column. An empty text selects rows without a value.
    #[serde(default, rename = "where")]
    selection: BTreeMap<String, String>,
    /// Columns that get the names of others.
    #[serde(default)]
    names: BTreeMap<String, String>,
}

/// Data that a figure needs, and the lines of a manifest that would add them.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Needed {
    /// Description of the data. Reduced loads in braces are shown in the unit of the study.
    data: String,
    /// Name of the lines.
    lines: String,
    /// Loads in the lines.
    #[serde(default)]
    loads: String,
    /// Key of the stage of random surfaces that would add the data, if the study has such a stage.
    sweep: Option<String>,
}

/// Returns the names of all figures in the order of the page.
pub fn names() -> impl Iterator<Item = &'static str> {
    PAGE.order.iter().map(String::as_str)
}

/// Returns the figure of this name.
pub fn find(name: &str) -> Option<&'static WrittenFigure> {
    FIGURES.iter().find(|figure| figure.name.value == name)
}

/// Returns the title of a figure.
pub fn title(figure: &WrittenFigure) -> String {
    let point = figure.keys.points.first();
    let title = point.and_then(|point| point.table.title.written());
    title.map_or_else(|| figure.name.value.clone(), |title| title.value.clone())
}

/// Returns the description of the data that a figure needs and the lines of a manifest that would
/// add them, if the study can have such data.
pub fn missing(data: &FigureData, name: &str) -> Drawn {
    let Some(needed) = PAGE.needed.get(name) else { return Drawn::NotAsked };
    let mut text = String::new();
    for (index, part) in needed.data.split(['{', '}']).enumerate() {
        let load = part.parse::<f64>().ok().filter(|_| index % 2 == 1);
        text += &load.map_or(part.to_owned(), |load| data.loads.text_of_reduced(load));
    }
    Drawn::Missing { needs: text.into(), lines: Some(needed.lines(data)) }
}

/// Draws a figure from all stages of its kind that have its columns.
pub fn draw(data: &FigureData, figure: &WrittenFigure) -> Result<Drawn, ReportError> {
    let all_rows = Rows::default();
    let rows = PAGE.rows.get(&figure.name.value).unwrap_or(&all_rows);
    let Some((stage, mut spec)) = found(data, figure, rows)? else { return Ok(Drawn::NotAsked) };
    for quantity in spec.panels.iter_mut().flat_map(|panel| &mut panel.y) {
        if let BarSource::Surfaces(bars) = &mut quantity.bars {
            *bars = data.bars;
        }
    }
    let hidden: Vec<&str> =
        spec.facet.iter().chain(&rows.along).chain(&spec.dash).map(String::as_str).collect();
    let own = own_styles(data, &stage, &hidden);
    let styles = own.as_ref().unwrap_or(&data.styles);
    let looks = Looks { styles, hidden: &hidden, has_own_axes: rows.own_axes };
    let drawn = declared::draw_from(data, &spec, &stage, Some(looks))?;
    let shows_a_course = |panel: &Panel| match panel {
        Panel::Chart(chart) => chart.shows_a_course(),
        Panel::Map(_) | Panel::Blank => true,
    };
    let is_shown = match &drawn {
        Drawn::Figure { figure, .. } => figure.rows.iter().flatten().any(shows_a_course),
        _ => false,
    };
    // Without a text of its own, a missing figure needs a second place along its axis.
    let has_text = PAGE.needed.contains_key(&figure.name.value);
    Ok(if is_shown || !has_text { drawn } else { Drawn::NotAsked })
}

/// Returns styles for the rows of one figure, if those of the page do not tell their parameter
/// points apart, as those of fits.
fn own_styles(data: &FigureData, stage: &FinishedStage, hidden: &[&str]) -> Option<Styles> {
    let unnamed = [CORRECTION.name, COEFFICIENT.name];
    let parameters = stage.table.in_role(Role::Parameter).without(hidden).without(&unnamed);
    let first_rows = grouped(&parameters).into_iter().map(|rows| rows[0]);
    let points: Vec<Point> =
        first_rows.map(|row| points::at_row(&parameters, row).without(hidden)).collect();
    let looks = points.iter().map(|point| (data.styles.label(point), data.styles.markers(point)));
    let are_apart = looks
        .clone()
        .enumerate()
        .all(|(at, look)| !looks.clone().take(at).any(|other| other == look));
    (stage.kind == Kind::Fit || !are_apart).then(|| data.styles_of(&points))
}

/// Returns the rows of all stages that the figure shows, as those of one stage.
fn found(
    data: &FigureData,
    figure: &WrittenFigure,
    rows: &Rows,
) -> Result<Option<(FinishedStage, FigureSpec)>, ReportError> {
    let mut tables = Vec::new();
    let (mut first, mut units) = (None, Vec::new());
    let kind = figure.keys.points.first().and_then(|point| point.table.from.written());
    let is_meant =
        |stage: &&FinishedStage| kind.is_some_and(|kind| stage.kind.name() == kind.value);
    for stage in data.finished.stages.iter().filter(is_meant) {
        let shown = shown_rows(stage, rows)?;
        let mut found = rows.beside.is_empty().then(|| shown.clone());
        for other in &rows.beside {
            found = if found.is_some() { found } else { beside(data, &shown, other)? };
        }
        let Some(table) = found else { continue };
        let spec = on_table(figure, stage.kind.name(), &table).filter(|_| table.rows() > 0);
        let Some(spec) = spec else { continue };
        // Rows of surfaces and means over surfaces are not stacked.
        let (shown, first_stage) = first.get_or_insert_with(|| (spec.clone(), stage));
        if *shown == spec {
            let (from, to) = (stage.units.clone(), first_stage.units.clone());
            units.push(from.clone().in_output(&to));
            tables.push(Conversion { from, to }.table(&table));
        }
    }
    let Some((mut spec, stage)) = first else { return Ok(None) };
    let table = Table::stack(&tables)?;
    let heaviest = match table.reals(LOAD.name) {
        Ok(loads) => loads.iter().flatten().fold(0.0, f64::max),
        Err(_) => f64::INFINITY,
    };
    spec.facet.extend(rows.facet.iter().filter(|name| table.has(name)).cloned());
    for name in spec.facet.iter_mut().chain(&mut spec.dash).filter(|name| **name == LOAD.name) {
        *name = load_column(&table).to_owned();
    }
    let points = table.in_role(Role::Parameter).without(&[CORRECTION.name, COEFFICIENT.name]);
    let is_asked = heaviest > rows.reaches * (1.0 + 1e-9) && grouped(&points).len() >= rows.points;
    let stage = FinishedStage {
        name: stage.name.clone(),
        kind: stage.kind,
        table: nearest_loads(&table, &rows.near)?,
        units: TableUnits::common(&units),
        path: None,
    };
    Ok(is_asked.then_some((stage, spec)))
}

/// Returns the rows of a stage that a figure shows: by default without adhesion and layers, and
/// surfaces as they are drawn from a spectrum.
fn shown_rows(stage: &FinishedStage, rows: &Rows) -> Result<Table, ReportError> {
    let table = &stage.table;
    let is_other = [WORK_OF_ADHESION, LAYER_THICKNESS].iter().any(|column| table.has(column.name));
    let moduli = match table.has(EFFECTIVE_MODULUS.name) && rows.modulus {
        true => Some(table.reals(EFFECTIVE_MODULUS.name)?),
        false => None,
    };
    // Without a modulus, pressures are in units of E*, as in the other figures.
    let is_shown = |&row: &usize| {
        let is_altered = stage.kind == Kind::Generate && coordinates::is_altered(table, row);
        (rows.all_contacts || !is_other)
            && !is_altered
            && moduli.is_none_or(|moduli| moduli.value(row) != 1.0)
    };
    Ok(table.pick(&(0..table.rows()).filter(is_shown).collect::<Vec<_>>()))
}

/// Adds the results of other stages to the rows that agree with one of theirs in all coordinates
/// that both have. Rows without results are left out. Returns `None` if there are none.
fn beside(
    data: &FigureData,
    table: &Table,
    Beside { from, selection, names: renamed }: &Beside,
) -> Result<Option<Table>, TableError> {
    let mut others = Vec::new();
    for stage in data.finished.stages.iter().filter(|stage| stage.kind.name() == from) {
        let is_wanted = |row: &usize| {
            selection.iter().all(|(name, text)| {
                let column = stage.table.batch().column_by_name(name);
                let value = column.and_then(|column| Value::from_array(column.as_ref(), *row));
                value.map_or(text.is_empty(), |value| value == Value::Text(text.clone()))
            })
        };
        let wanted: Vec<usize> = (0..stage.table.rows()).filter(is_wanted).collect();
        others.extend((!wanted.is_empty()).then(|| stage.table.pick(&wanted)));
    }
    let other = Table::stack(&others)?;
    let coordinates = other.coordinates().keep(|name, _| table.has(name));
    let known = coordinates.batch().columns().iter().zip(coordinates.names());
    let names: Vec<&str> = known
        .filter(|(column, _)| column.null_count() < column.len())
        .map(|(_, name)| name)
        .collect();
    if names.is_empty() {
        return Ok(None);
    }
    let key = |of: &Table, row: usize| -> Vec<Option<Value>> {
        let columns = names.iter().filter_map(|name| of.batch().column_by_name(name));
        columns.map(|column| Value::from_array(column.as_ref(), row)).collect()
    };
    let by_key: BTreeMap<_, usize> =
        (0..other.rows()).rev().map(|row| (key(&other, row), row)).collect();
    let pairs = (0..table.rows()).filter_map(|row| Some((row, *by_key.get(&key(table, row))?)));
    let (own, theirs): (Vec<usize>, Vec<usize>) = pairs.unzip();
    let is_new = |name: &str, role: Option<Role>| {
        !table.has(name) && role.is_none_or(|role| !role.is_coordinate())
    };
    let results = other.keep(is_new).pick(&theirs);
    let fields = results.batch().schema_ref().fields().iter().map(|field| {
        let name = renamed.get(field.name()).unwrap_or(field.name());
        field.as_ref().clone().with_name(name)
    });
    let schema = Schema::new(fields.collect::<Vec<_>>());
    let named = Table::from_arrays(theirs.len(), schema, results.batch().columns().to_vec());
    Ok((!own.is_empty()).then(|| table.pick(&own).beside(&named)))
}

/// Returns the rows whose load is the nearest to one of these loads and within a tenth of it, or
/// all rows if no loads are given.
fn nearest_loads(table: &Table, near: &[f64]) -> Result<Table, TableError> {
    const WITHIN: f64 = 0.1;
    if near.is_empty() {
        return Ok(table.clone());
    }
    let loads = table.reals(LOAD.name)?;
    let nearest = |wanted: &f64| {
        let distance = |load: &f64| (load / wanted - 1.0).abs();
        let all = loads.iter().flatten();
        let found = all.min_by(|one, other| distance(one).total_cmp(&distance(other)))?;
        (distance(&found) < WITHIN).then_some(found)
    };
    let nearest: Vec<f64> = near.iter().filter_map(nearest).collect();
    let is_near =
        |row: &usize| nearest.iter().any(|load| decimal::is_same(*load, loads.value(*row)));
    Ok(table.pick(&(0..table.rows()).filter(is_near).collect::<Vec<_>>()))
}

impl Needed {
    /// Returns the lines of a manifest with the names of the stages of the study.
    fn lines(&self, data: &FigureData) -> String {
        let mut stages = data.finished.stages.iter();
        let is_random =
            |stage: &&FinishedStage| stage.kind == Kind::Generate && stage.table.has(K_UPPER.name);
        if let (Some(sweep), Some(stage)) = (&self.sweep, stages.find(is_random)) {
            return format!("{sweep}  # in the stage `{}`", stage.name);
        }
        let name = |kind: Kind, otherwise: &str| {
            data.finished.name_of(kind).unwrap_or(otherwise).to_owned()
        };
        let mut text = PAGE.lines[&self.lines].trim().replace("{loads}", &self.loads);
        text = text.replace("{surfaces}", &name(Kind::Generate, "surfaces"));
        text = text.replace("{area}", &name(Kind::Measure, "area"));
        // A name that the study has is changed.
        for stage in &data.finished.plan.stages {
            let [taken, free] = ["", "-2"].map(|end| format!("[stage.{}{end}]", stage.name));
            text = text.replace(&taken, &free);
        }
        text
    }
}
