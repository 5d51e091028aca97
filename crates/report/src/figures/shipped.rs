//! Figures that every study can have, declared in a file that the program contains.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use serde::Deserialize;

use asperity_pipeline::manifest::figure::WrittenFigure;
use asperity_pipeline::study::figures::{FigureSpec, on_table, read};
use asperity_stages::Kind;
use asperity_stages::columns::{EFFECTIVE_MODULUS, LAYER_THICKNESS, LOAD, WORK_OF_ADHESION};
use asperity_stages::surface::coordinates;
use asperity_stages::units::TableUnits;
use asperity_tables::table::Table;

use crate::ReportError;
use crate::charts::Panel;
use crate::ensembles::{Bars, Point};
use crate::figure_data::FigureData;
use crate::figures::{Drawn, declared};
use crate::finished::FinishedStage;
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
    needed: BTreeMap<String, Needed>,
}

/// Data that a figure needs, and the keys of a manifest that would add them.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Needed {
    /// Description of the data. Reduced loads in braces are shown in the unit of the study.
    data: String,
    /// Load beyond which the study must reach.
    #[serde(default)]
    reaches: f64,
    /// Whether only bodies with a modulus are drawn.
    #[serde(default)]
    modulus: bool,
    /// Loads of a `solve` stage that would add the data.
    loads: Option<String>,
    /// Whether a `correct` stage would add the data.
    #[serde(default)]
    corrections: bool,
    /// Cutoff whose sweep would add the data.
    spectra: Option<String>,
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

/// Draws a figure from all stages of its kind that have its columns.
pub fn draw(data: &FigureData, figure: &WrittenFigure) -> Result<Drawn, ReportError> {
    let needed = PAGE.needed.get(&figure.name.value);
    let drawn = match found(data, figure, needed)? {
        Some((stage, mut spec)) => {
            set_bars(&mut spec, data.bars);
            let own = own_styles(data, &stage, &spec);
            let styles = own.as_ref().unwrap_or(&data.styles);
            declared::draw_from(data, &spec, &stage, Some(styles))?
        }
        None => Drawn::NotAsked,
    };
    let shows_a_course = |panel: &Panel| match panel {
        Panel::Chart(chart) => chart.shows_a_course(),
        Panel::Map(_) => true,
    };
    let is_shown = match &drawn {
        Drawn::Figure { figure, .. } => figure.rows.iter().flatten().any(shows_a_course),
        _ => false,
    };
    Ok(match needed {
        Some(needed) if !is_shown => needed.missing(data),
        _ => drawn,
    })
}

/// Returns the styles of fits, whose rows differ in parameters that surfaces do not have.
fn own_styles(data: &FigureData, stage: &FinishedStage, spec: &FigureSpec) -> Option<Styles> {
    let rows = 0..stage.table.rows();
    let points: Vec<Point> = rows.map(|row| declared::point(&stage.table, row, spec)).collect();
    (stage.kind == Kind::Fit).then(|| Styles::new(&points, &data.files))
}

/// Returns the rows of all stages that the figure shows, as those of one stage.
fn found(
    data: &FigureData,
    figure: &WrittenFigure,
    needed: Option<&Needed>,
) -> Result<Option<(FinishedStage, FigureSpec)>, ReportError> {
    let mut tables = Vec::new();
    let (mut first, mut units) = (None, Vec::new());
    for stage in &data.finished.stages {
        let table = shown_rows(stage, needed.is_some_and(|needed| needed.modulus))?;
        let spec = on_table(figure, stage.kind.name(), &table).filter(|_| table.rows() > 0);
        if let Some(spec) = spec {
            first.get_or_insert((spec, stage));
            units.push(&stage.units);
            tables.push(table);
        }
    }
    let Some((spec, stage)) = first else { return Ok(None) };
    let table = Table::stack(&tables)?;
    let reaches = needed.map_or(0.0, |needed| needed.reaches);
    let heaviest = match table.reals(LOAD.name) {
        Ok(loads) => loads.iter().flatten().fold(0.0, f64::max),
        Err(_) => f64::INFINITY,
    };
    let stage = FinishedStage {
        name: stage.name.clone(),
        kind: stage.kind,
        table,
        units: TableUnits::common(units),
        path: None,
    };
    Ok((heaviest > reaches * (1.0 + 1e-9)).then_some((stage, spec)))
}

/// Returns the rows of a stage that figures of the paper show: without adhesion and layers, and
/// surfaces as they are drawn from a spectrum.
fn shown_rows(stage: &FinishedStage, with_modulus: bool) -> Result<Table, ReportError> {
    let table = &stage.table;
    let is_other = [WORK_OF_ADHESION, LAYER_THICKNESS].iter().any(|column| table.has(column.name));
    let moduli = match table.has(EFFECTIVE_MODULUS.name) && with_modulus {
        true => Some(table.reals(EFFECTIVE_MODULUS.name)?),
        false => None,
    };
    // Without a modulus, pressures are in units of E*, as in the other figures.
    let is_shown = |&row: &usize| {
        let is_altered = stage.kind == Kind::Generate && coordinates::is_altered(table, row);
        !is_other && !is_altered && moduli.is_none_or(|moduli| moduli.value(row) != 1.0)
    };
    Ok(table.pick(&(0..table.rows()).filter(is_shown).collect::<Vec<_>>()))
}

impl Needed {
    fn missing(&self, data: &FigureData) -> Drawn {
        let mut text = String::new();
        for (index, part) in self.data.split(['{', '}']).enumerate() {
            let load = part.parse::<f64>().ok().filter(|_| index % 2 == 1);
            text += &load.map_or(part.to_owned(), |load| data.loads.text_of_reduced(load));
        }
        let lines = match (&self.loads, &self.spectra) {
            (Some(loads), _) => data.lines_of_loads(loads),
            (None, Some(cutoff)) => data.lines_of_spectra(cutoff),
            (None, None) if self.corrections => data.lines_of_corrections(),
            (None, None) => return Drawn::NotAsked,
        };
        Drawn::missing(text, lines)
    }
}

/// Gives means over surfaces the error bars of the page.
fn set_bars(spec: &mut FigureSpec, bars: Bars) {
    use asperity_pipeline::study::figures::{BarSource, ErrorBars};
    let kind = match bars {
        Bars::Sem => ErrorBars::Sem,
        Bars::Sd => ErrorBars::Sd,
    };
    for quantity in spec.panels.iter_mut().flat_map(|panel| &mut panel.y) {
        if let BarSource::Surfaces(own) = &mut quantity.bars {
            *own = kind;
        }
    }
}
