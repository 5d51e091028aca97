//! Contact maps of single surfaces: at five loads, with one map per surface that combines the loads
//! (figs. 7 and 8), and along a path with adhesion, with pulled and pushed nodes and maps of the
//! pressures if they are stored. On the page, a slider shows more loads or states of each surface.

use arrow::array::{Array, AsArray};
use arrow::datatypes::Float64Type;
use base64::prelude::{BASE64_STANDARD, Engine};
use minijinja::{Value, context};

use crate::ReportError;
use crate::charts::map_panel::MapPanel;
use crate::charts::raster::{Raster, Scale};
use crate::charts::{Figure, Panel, in_rows, panel_of_map};
use crate::figure_data::FigureData;
use crate::figures::{Definition, Drawn};
use crate::finished::FinishedStages;
use crate::loads::Loads;
use crate::map_pictures::{NodeValues, Quantity};
use crate::points::{self, Point};
use crate::samples::{self, Sample, spread};
use crate::units::{digits, length_in_words, scale_bar};
use asperity_mechanics::grid::Grid;
use asperity_mechanics::morphology::area::ContactArea;
use asperity_mechanics::morphology::map::ContactMap;
use asperity_stages::columns::{
    BRANCH, CONTACT, EFFECTIVE_MODULUS, LOAD, MEAN_GAP, PRESSURE, PRESSURES, REPULSIVE,
};
use asperity_stages::ensemble::{ParameterPoint, load_column};
use asperity_stages::grids::Grids;
use asperity_stages::units::pressure_unit;
use asperity_stages::{Recipe, Stage as _, StageError};
use asperity_tables::column::Column;
use asperity_tables::store::TaskTables;
use asperity_tables::table::{Table, TableError};

pub const CONTACT_MAPS: Definition =
    Definition { name: "contact-maps", title: "Contact maps", draw: draw_contacts };
pub const ADHESION_MAPS: Definition =
    Definition { name: "adhesion-maps", title: "Contact maps along the path", draw: draw_paths };

/// Loads at which maps are drawn. If a study does not have one of these loads, the nearest load is
/// used.
const SHOWN_LOADS: [f64; 5] = [0.012, 0.06, 0.14, 0.32, 0.74];
/// Largest number of states before and after the state with the smallest mean gap.
const BEFORE: usize = 2;
const AFTER: usize = 3;
/// Pixels per side of a map.
const PIXELS: usize = 256;
/// Largest number of maps of one slider; each takes a few kilobytes of the page.
const MOST: usize = 16;

fn draw_contacts(data: &FigureData) -> Result<Drawn, ReportError> {
    let samples = extremes(samples::first_surfaces(data.finished)?);
    let lower = |sample: &Sample| Some(sample.random()?.spectrum.k_lower);
    let of_points = match samples.as_slice() {
        [] | [_] => "",
        [one, other] if lower(one) != lower(other) => {
            " of the parameter points with the smallest and the largest lower cutoff"
        }
        _ => " of the first and the last parameter point",
    };
    let (mut by_sample, mut sliders) = (Vec::new(), Vec::new());
    for sample in &samples {
        let contacts = match Contacts::read(data, sample, false)? {
            Stored::Lost => return Ok(lost()),
            Stored::None => continue,
            Stored::Contacts(contacts) => contacts,
        };
        let label = data.styles.label(&contacts.point);
        let rows = contacts.by_load()?;
        by_sample.push(contacts.panels(data, label.as_deref(), &rows)?);
        let step = |row: usize| {
            let picture = Raster::from_contact(&contacts.set(CONTACT, row)?);
            Ok((contacts.load(data, row)?, picture))
        };
        sliders.extend(contacts.slider(data, label, "load", &rows, step)?);
    }
    let has_overlay = by_sample.iter().any(|panels| panels.len() > 1);
    let mut caption =
        format!("Contact (dark) on the first surface{of_points}, as counted on the mesh.");
    if has_overlay {
        caption += " The last map of each surface shows all loads: the darkest nodes are in \
                    contact from the lightest load on, the brightest nodes only at the heaviest \
                    load.";
    }
    let rows: Vec<Vec<Panel>> = if has_overlay {
        by_sample.into_iter().flat_map(|panels| in_rows(3, panels)).collect()
    } else {
        in_rows(3, by_sample.concat())
    };
    Ok(drawn(rows, caption, sliders))
}

/// Draws the maps of the first and the last surface on which a path is computed.
fn draw_paths(data: &FigureData) -> Result<Drawn, ReportError> {
    let is_path = |recipe: &Recipe| matches!(recipe, Recipe::Adhesion(_));
    if !data.finished.plan.tasks.iter().any(|task| is_path(&task.recipe)) {
        return Ok(Drawn::NotAsked);
    }
    let mut samples = samples::first_surfaces(data.finished)?;
    if samples.len() > 2 {
        samples.drain(1..samples.len() - 1);
    }
    let (mut rows, mut sliders) = (Vec::new(), Vec::new());
    let mut has_pressures = false;
    for sample in &samples {
        let path = match Contacts::read(data, sample, true)? {
            Stored::Lost => return Ok(lost()),
            Stored::None => continue,
            Stored::Contacts(path) => path,
        };
        let label = data.styles.label(&path.point).filter(|_| samples.len() > 1);
        let states = path.shown_states()?;
        let contacts: Vec<Vec<f64>> =
            states.iter().map(|&row| path.states_of_nodes(row)).collect::<Result<_, _>>()?;
        let contact = path.state_panels(data, label.as_deref(), &states, |index| {
            path.values(Quantity::AdhesiveContact, &contacts[index], None)
        });
        rows.extend(in_rows(3, contact?));
        let all: Option<Vec<_>> = states.iter().map(|&row| path.pressures(row)).collect();
        let stored = all.unwrap_or_default();
        has_pressures |= !stored.is_empty();
        let unit = pressure_unit(&path.table);
        let shown = &states[..stored.len()];
        let pressures = path.state_panels(data, label.as_deref(), shown, |index| {
            path.values(Quantity::Pressure, &stored[index], unit.as_deref())
        });
        rows.extend(in_rows(3, pressures?));
        let gaps = path.table.reals(MEAN_GAP.name)?;
        let bound: Vec<usize> = (0..path.table.rows()).filter(|&row| gaps.is_valid(row)).collect();
        let step = |row: usize| {
            let contact = path.states_of_nodes(row)?;
            let values = path.values(Quantity::AdhesiveContact, &contact, None);
            let [_, branch] = path.state(data, row)?;
            Ok((format!("{}, {branch}", path.load(data, row)?), values.raster(&values.scale())))
        };
        sliders.extend(path.slider(data, label, "state", &bound, step)?);
    }
    let pressures = if has_pressures {
        "In the maps of pressures, blue nodes are pulled and red nodes are pushed."
    } else {
        "With `pressures = \"all\"` in the stage, maps of the pressures follow."
    };
    let of_points =
        if samples.len() > 1 { " of the first and the last parameter point" } else { "" };
    let caption = format!(
        "Contact on the first surface{of_points} before, at and after the smallest mean gap, as \
         counted on the mesh. Red nodes have positive pressure (pushed). Blue nodes are in contact \
         and are pulled. {pressures}"
    );
    Ok(drawn(rows, caption, sliders))
}

fn lost() -> Drawn {
    Drawn::gone(
        "contact maps, which are no longer in the store; run the study to compute them again",
    )
}

fn drawn(rows: Vec<Vec<Panel>>, caption: String, sliders: Vec<Value>) -> Drawn {
    if rows.is_empty() {
        return Drawn::NotAsked;
    }
    let panel = panel_of_map(rows.iter().flatten(), 265.0);
    let figure = Box::new(Figure::from_panels(rows, panel));
    Drawn::Figure { figure, caption, sliders }
}

/// Keeps the samples with the smallest and the largest lower cutoff, each with its smallest upper
/// cutoff. If the lower cutoff does not vary, keeps the first and the last sample.
fn extremes(mut samples: Vec<Sample>) -> Vec<Sample> {
    let cutoffs = |sample: &Sample| {
        let spectrum = sample.random().map(|surface| surface.spectrum);
        spectrum.map(|spectrum| (spectrum.k_lower, spectrum.k_upper))
    };
    samples.sort_by_key(cutoffs);
    let lower = |sample: &Sample| cutoffs(sample).map(|(k_lower, _)| k_lower);
    let [smallest, largest] = [samples.first(), samples.last()].map(|one| one.and_then(lower));
    let is_last = |sample: &Sample| smallest != largest && lower(sample) == largest;
    let last = samples.iter().position(is_last).unwrap_or(samples.len().saturating_sub(1));
    samples.truncate(last + 1);
    if samples.len() > 2 {
        samples.drain(1..samples.len() - 1);
    }
    samples
}

/// Contacts on a surface in the store.
enum Stored {
    Contacts(Box<Contacts>),
    /// The store has lost the maps.
    Lost,
    /// The study has not computed a contact on the surface.
    None,
}

/// Contacts on a surface at its first parameter point: one row for each load or state.
struct Contacts {
    point: Point,
    table: Table,
    grid: Grid,
    /// Unit of lengths, if known.
    unit: Option<String>,
}

impl Contacts {
    /// Reads the contacts of a surface: those of a path with adhesion, or those at all loads.
    fn read(data: &FigureData, sample: &Sample, is_path: bool) -> Result<Stored, ReportError> {
        let FinishedStages { plan, archive, .. } = data.finished;
        let mut first = None;
        let mut tables = Vec::new();
        for task in &plan.tasks {
            let point = match &task.recipe {
                Recipe::Solve(params) if !is_path => {
                    ParameterPoint::from_cells(params.coordinates())
                }
                Recipe::Adhesion(_) if is_path && tables.is_empty() => ParameterPoint::default(),
                _ => continue,
            };
            if task.inputs != [sample.task] || archive.have(&[&task.table]) == [false] {
                continue;
            }
            if *first.get_or_insert_with(|| point.clone()) != point {
                continue;
            }
            if !archive.store().has(&task.table) {
                return Ok(Stored::Lost);
            }
            tables.push(data.finished.stored(task)?);
        }
        let table = Table::stack(&tables)?;
        if table.rows() == 0 {
            return Ok(Stored::None);
        }
        let point = points::at_row(&table, 0);
        Ok(Stored::Contacts(Box::new(Contacts {
            grid: Grids::new(&table)?.grid(0).map_err(ReportError::Surface)?,
            unit: data.units.at(&point).map(str::to_owned),
            point,
            table,
        })))
    }

    fn set(&self, column: Column, row: usize) -> Result<ContactMap, ReportError> {
        let bytes = self.table.bytes(column.name)?.value(row);
        let map = ContactMap::from_bytes(self.grid.nodes(), bytes);
        map.map_err(|error| ReportError::Surface(StageError::Map(error)))
    }

    fn number(&self, column: Column, row: usize) -> Result<f64, TableError> {
        Ok(self.table.reals(column.name)?.value(row))
    }

    fn load(&self, data: &FigureData, row: usize) -> Result<String, TableError> {
        Ok(data.loads.text(self.number(LOAD, row)?, self.number(PRESSURE, row)?))
    }

    /// Returns the rows with different loads, by their loads.
    fn by_load(&self) -> Result<Vec<usize>, TableError> {
        let loads = self.table.reals(LOAD.name)?;
        let mut rows: Vec<usize> = (0..self.table.rows()).collect();
        rows.sort_by(|&one, &other| loads.value(one).total_cmp(&loads.value(other)));
        rows.dedup_by_key(|row| loads.value(*row));
        Ok(rows)
    }

    /// Returns the maps at the rows nearest to [`SHOWN_LOADS`], each once, and, for several loads,
    /// one map that combines them.
    fn panels(
        &self,
        data: &FigureData,
        label: Option<&str>,
        rows: &[usize],
    ) -> Result<Vec<Panel>, ReportError> {
        let loads = self.table.reals(LOAD.name)?;
        let mut left = rows.to_vec();
        let mut shown = Vec::new();
        for wanted in SHOWN_LOADS {
            let distance = |row: &usize| (loads.value(*row) / wanted).ln().abs();
            let order = |&one: &usize, &other: &usize| {
                distance(&left[one]).total_cmp(&distance(&left[other]))
            };
            let nearest = (0..left.len()).min_by(order);
            shown.extend(nearest.map(|index| left.remove(index)));
        }
        shown.sort_by(|&one, &other| loads.value(one).total_cmp(&loads.value(other)));
        let maps =
            shown.iter().map(|&row| self.set(CONTACT, row)).collect::<Result<Vec<_>, _>>()?;
        let before = label.map_or_else(String::new, |label| format!("{label} · "));
        let panel = |title: &str, picture: Raster| {
            let size = self.grid.cell().size();
            let title = format!("{before}{title}");
            Panel::Map(MapPanel {
                scale_bar: scale_bar(size[0], self.unit.as_deref()),
                ..MapPanel::new(title, picture.at_most(PIXELS), size)
            })
        };
        let mut panels = Vec::new();
        for ((letter, &row), map) in ('a'..).zip(&shown).zip(&maps) {
            let load = match data.loads {
                Loads::Reduced => format!("load {:.3}", loads.value(row)),
                Loads::Pressures { .. } => self.load(data, row)?,
            };
            let letter = if shown.len() > 1 { format!("({letter}) ") } else { String::new() };
            panels.push(panel(&format!("{letter}{load}"), Raster::from_contact(map)));
        }
        if maps.len() > 1 {
            panels.push(panel("all loads", Raster::from_contacts(&maps)));
        }
        Ok(panels)
    }

    /// Returns the rows of the shown states: those with contact around the smallest mean gap, and
    /// the last one with contact.
    fn shown_states(&self) -> Result<Vec<usize>, ReportError> {
        let gaps = self.table.reals(MEAN_GAP.name)?;
        let mut touching = Vec::new();
        for row in (0..self.table.rows()).filter(|&row| gaps.is_valid(row)) {
            if ContactArea::from_map(&self.set(CONTACT, row)?).contact_nodes > 0 {
                touching.push(row);
            }
        }
        let order = |&one: &usize, &other: &usize| {
            gaps.value(touching[one]).total_cmp(&gaps.value(touching[other]))
        };
        let Some(nearest) = (0..touching.len()).min_by(order) else { return Ok(Vec::new()) };
        let (before, after) = (&touching[..nearest], &touching[nearest + 1..]);
        let pick = |from: &[usize], most: usize, last: usize| -> Vec<usize> {
            let count = from.len().min(most);
            (1..=count).map(|at| from[(at * from.len()).div_ceil(count + last) - 1]).collect()
        };
        // The states before are inside of their range, and the last state after is at its end.
        let rows = [pick(before, BEFORE, 1), vec![touching[nearest]], pick(after, AFTER, 0)];
        Ok(rows.concat())
    }

    /// Returns 0 for nodes that are apart, 1 for pulled and 2 for pushed nodes.
    fn states_of_nodes(&self, row: usize) -> Result<Vec<f64>, ReportError> {
        let sets = [self.set(CONTACT, row)?, self.set(REPULSIVE, row)?];
        let value = |node| {
            let [i, j] = self.grid.indices(node);
            sets.iter().filter(|set| set.get(i, j)).count() as f64
        };
        Ok((0..self.grid.count()).map(value).collect())
    }

    /// Returns the stored pressures of a state.
    fn pressures(&self, row: usize) -> Option<Vec<f64>> {
        let lists = self.table.lists(PRESSURES.name).ok()?;
        let list = lists.is_valid(row).then(|| lists.value(row))?;
        Some(list.as_primitive::<Float64Type>().values().to_vec()).filter(|list| !list.is_empty())
    }

    /// Returns the load or the mean gap that identifies a state, with its name, and its branch:
    /// `mean gap 20 nm`.
    fn state(&self, data: &FigureData, row: usize) -> Result<[String; 2], ReportError> {
        let given = if load_column(&self.table) == MEAN_GAP.name {
            let gap = length_in_words(self.number(MEAN_GAP, row)?, self.unit.as_deref());
            format!("mean gap {gap}")
        } else {
            format!("{} {}", data.loads.name(), self.load(data, row)?)
        };
        Ok([given, self.table.texts(BRANCH.name)?.value(row).to_owned()])
    }

    fn values<'v>(
        &'v self,
        quantity: Quantity,
        values: &'v [f64],
        unit: Option<&'v str>,
    ) -> NodeValues<'v> {
        let effective_modulus = self.number(EFFECTIVE_MODULUS, 0).unwrap_or(1.0);
        let length_unit = self.unit.as_deref();
        NodeValues { quantity, values, grid: self.grid, unit, length_unit, effective_modulus }
    }

    /// Returns panels with the letters of their states on one scale, with few pixels.
    fn state_panels<'v>(
        &self,
        data: &FigureData,
        label: Option<&str>,
        rows: &[usize],
        values: impl Fn(usize) -> NodeValues<'v>,
    ) -> Result<Vec<Panel>, ReportError> {
        let scales = (0..rows.len()).map(|index| values(index).scale());
        let Some(scale) = scales.reduce(Scale::covering) else { return Ok(Vec::new()) };
        let before = label.map_or_else(String::new, |label| format!("{label} · "));
        let panel = |(index, (letter, &row)): (usize, (char, &usize))| {
            let [given, branch] = self.state(data, row)?;
            let title = format!("{before}({letter}) {given} · {branch}");
            let panel = values(index).panel(title, &scale);
            Ok(Panel::Map(MapPanel { raster: panel.raster.at_most(PIXELS), ..panel }))
        };
        ('a'..).zip(rows).enumerate().map(panel).collect()
    }

    /// Returns a slider with maps of up to [`MOST`] of these rows, or `None` for a single row.
    /// `one` is the word for a row: `load`, or `state` of a path. `step` returns the text and the
    /// picture of a row.
    fn slider(
        &self,
        data: &FigureData,
        label: Option<String>,
        one: &'static str,
        rows: &[usize],
        step: impl Fn(usize) -> Result<(String, Raster), ReportError>,
    ) -> Result<Option<Value>, ReportError> {
        let unit = self.unit.as_deref();
        let step = |index: usize| {
            let row = rows[index];
            let (load, picture) = step(row)?;
            let area = ContactArea::from_map(&self.set(CONTACT, row)?).fraction();
            Ok::<_, ReportError>(context! {
                load,
                area => format!("{} %", digits(100.0 * area, 3)),
                mean_gap => length_in_words(self.number(MEAN_GAP, row)?, unit),
                picture => BASE64_STANDARD.encode(picture.at_most(PIXELS).to_png()),
            })
        };
        if rows.len() < 2 {
            return Ok(None);
        }
        let size = self.grid.cell().size();
        let relative = size.map(|side| side / size[0].max(size[1]));
        let scale = scale_bar(size[0], unit).map(|bar| {
            // The length in per cent of the width of the maps.
            context! { percent => 100.0 * bar.length / size[0], label => bar.label }
        });
        let steps = spread(rows.len(), MOST).map(step).collect::<Result<Vec<_>, _>>()?;
        Ok(Some(context! {
            label => label.unwrap_or_default(),
            load_name => data.loads.name(),
            one,
            size => relative.to_vec(),
            scale,
            steps,
            loads => rows.len(),
        }))
    }
}
