//! Contact maps of one surface along a path with adhesion, with pulled and pushed nodes, and maps
//! of the pressures if they are stored. The paper does not show these maps.

use arrow::array::{Array, AsArray};
use arrow::datatypes::Float64Type;

use crate::ReportError;
use crate::charts::map_panel::MapPanel;
use crate::charts::raster::Scale;
use crate::charts::{Figure, Panel, in_rows, panel_of_map};
use crate::figure_data::FigureData;
use crate::figures::contact_maps::{LoadSlider, Step, spread};
use crate::figures::{Definition, Drawn};
use crate::finished::FinishedStages;
use crate::map_pictures::{NodeValues, Quantity};
use crate::points::{self, Point};
use crate::samples::{self, Sample};
use crate::units::length_in_words;
use asperity_mechanics::grid::Grid;
use asperity_mechanics::morphology::area::ContactArea;
use asperity_mechanics::morphology::map::ContactMap;
use asperity_stages::columns::{
    BRANCH, CONTACT, EFFECTIVE_MODULUS, LOAD, MEAN_GAP, PRESSURE, PRESSURES, REPULSIVE,
};
use asperity_stages::ensemble::load_column;
use asperity_stages::grids::Grids;
use asperity_stages::units::pressure_unit;
use asperity_stages::{Recipe, StageError};
use asperity_tables::store::TaskTables;
use asperity_tables::table::Table;

pub const MAPS: Definition =
    Definition { name: "adhesion-maps", title: "Contact maps along the path", draw: draw_maps };

/// Largest number of states before and after the state with the smallest mean gap.
const BEFORE: usize = 2;
const AFTER: usize = 3;
/// Pixels per side of a map.
const PIXELS: usize = 256;

fn draw_maps(data: &FigureData) -> Result<Drawn, ReportError> {
    let is_path = |recipe: &Recipe| matches!(recipe, Recipe::Adhesion(_));
    if !data.finished.plan.tasks.iter().any(|task| is_path(&task.recipe)) {
        return Ok(Drawn::NotAsked);
    }
    let mut samples = samples::first_surfaces(data.finished)?;
    if samples.len() > 2 {
        samples.drain(1..samples.len() - 1);
    }
    let (mut rows, mut sliders) = (Vec::new(), Vec::new());
    let (mut has_maps, mut has_pressures) = (false, false);
    for sample in &samples {
        let path = match Path::read(data.finished, sample)? {
            Stored::Path(path) => path,
            Stored::Lost => {
                return Ok(Drawn::gone(
                    "contact maps, which are no longer in the store; run the study to compute them \
                     again",
                ));
            }
            Stored::None => continue,
        };
        let own_label = data.styles.label(&path.point).filter(|_| samples.len() > 1);
        let label = own_label.unwrap_or_default();
        let shown = path.shown_states()?;
        has_maps |= !shown.is_empty();
        rows.extend(in_rows(3, path.contact_panels(data, &label, &shown)?));
        let pressures = path.pressure_panels(data, &label, &shown)?;
        has_pressures |= !pressures.is_empty();
        rows.extend(in_rows(3, pressures));
        sliders.extend(path.slider(data, label)?);
    }
    if !has_maps {
        return Ok(Drawn::NotAsked);
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
    let panel = panel_of_map(rows.iter().flatten(), 265.0);
    Ok(Drawn::figure(Figure::from_panels(rows, panel), caption).with_sliders(sliders))
}

/// Path of a surface in the store.
enum Stored {
    Path(Box<Path>),
    /// The store has lost the maps.
    Lost,
    /// The study has not computed a path on the surface.
    None,
}

/// Path of a surface at its first parameter point.
struct Path {
    point: Point,
    table: Table,
    grid: Grid,
    length_unit: Option<String>,
}

impl Path {
    fn read(finished: &FinishedStages, sample: &Sample) -> Result<Stored, ReportError> {
        let FinishedStages { plan, archive, .. } = finished;
        let task = plan.tasks.iter().find(|task| {
            matches!(task.recipe, Recipe::Adhesion(_))
                && task.inputs == [sample.task]
                && archive.have(&[&task.table]) == [true]
        });
        let Some(task) = task else { return Ok(Stored::None) };
        if !archive.store().has(&task.table) {
            return Ok(Stored::Lost);
        }
        let table = finished.stored(task)?;
        let grid = Grids::new(&table)?.grid(0);
        Ok(Stored::Path(Box::new(Path {
            point: points::at_row(&table, 0),
            grid: grid.map_err(ReportError::Surface)?,
            length_unit: asperity_stages::units::length_unit(&table),
            table,
        })))
    }

    /// Returns the rows of the shown states: those with contact around the smallest mean gap, and
    /// the last one with contact.
    fn shown_states(&self) -> Result<Vec<usize>, ReportError> {
        let gaps = self.table.reals(MEAN_GAP.name)?;
        let mut touching = Vec::new();
        for row in 0..self.table.rows() {
            if gaps.is_valid(row)
                && ContactArea::from_map(&self.set(CONTACT.name, row)?).contact_nodes > 0
            {
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

    fn set(&self, column: &str, row: usize) -> Result<ContactMap, ReportError> {
        let map = ContactMap::from_bytes(self.grid.nodes(), self.table.bytes(column)?.value(row));
        map.map_err(|error| ReportError::Surface(StageError::Map(error)))
    }

    /// Returns 0 for nodes that are apart, 1 for pulled and 2 for pushed nodes.
    fn contact(&self, row: usize) -> Result<Vec<f64>, ReportError> {
        let sets = [self.set(CONTACT.name, row)?, self.set(REPULSIVE.name, row)?];
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

    /// Returns the load or the mean gap that identifies a state, and its branch: `mean gap 20 nm`.
    fn state(&self, data: &FigureData, row: usize) -> Result<[String; 2], ReportError> {
        let number = |column: &str| self.table.reals(column).map(|values| values.value(row));
        let given = if load_column(&self.table) == MEAN_GAP.name {
            length_in_words(number(MEAN_GAP.name)?, self.length_unit.as_deref())
        } else {
            data.loads.text(number(LOAD.name)?, number(PRESSURE.name)?)
        };
        Ok([given, self.table.texts(BRANCH.name)?.value(row).to_owned()])
    }

    /// Names the quantity that the path prescribes.
    fn prescribed(&self, data: &FigureData) -> &'static str {
        if load_column(&self.table) == MEAN_GAP.name { "mean gap" } else { data.loads.name() }
    }

    fn values<'v>(
        &'v self,
        quantity: Quantity,
        values: &'v [f64],
        unit: Option<&'v str>,
    ) -> NodeValues<'v> {
        let modulus = self.table.reals(EFFECTIVE_MODULUS.name);
        NodeValues {
            quantity,
            values,
            grid: self.grid,
            unit,
            length_unit: self.length_unit.as_deref(),
            effective_modulus: modulus.map_or(1.0, |modulus| modulus.value(0)),
        }
    }

    /// Returns a panel with the letter of its state, with few pixels.
    fn panel(
        &self,
        data: &FigureData,
        label: &str,
        (letter, row): (char, usize),
        values: NodeValues,
        scale: &Scale,
    ) -> Result<Panel, ReportError> {
        let [given, branch] = self.state(data, row)?;
        let label = if label.is_empty() { String::new() } else { format!("{label} · ") };
        let title = format!("{label}({letter}) {} {given} · {branch}", self.prescribed(data));
        let panel = values.panel(title, scale);
        let raster = panel.raster.at_most(PIXELS);
        Ok(Panel::Map(MapPanel { raster, ..panel }))
    }

    fn contact_panels(
        &self,
        data: &FigureData,
        label: &str,
        rows: &[usize],
    ) -> Result<Vec<Panel>, ReportError> {
        let panel = |state: (char, &usize)| {
            let contact = self.contact(*state.1)?;
            let values = self.values(Quantity::AdhesiveContact, &contact, None);
            self.panel(data, label, (state.0, *state.1), values, &values.scale())
        };
        ('a'..).zip(rows).map(panel).collect()
    }

    /// Returns the pressures of the states on one scale, or nothing if a state has none.
    fn pressure_panels(
        &self,
        data: &FigureData,
        label: &str,
        rows: &[usize],
    ) -> Result<Vec<Panel>, ReportError> {
        let stored: Option<Vec<Vec<f64>>> = rows.iter().map(|&row| self.pressures(row)).collect();
        let Some(stored) = stored else { return Ok(Vec::new()) };
        let unit = pressure_unit(&self.table);
        let of = |pressures| self.values(Quantity::Pressure, pressures, unit.as_deref());
        let scales = stored.iter().map(|pressures| of(pressures).scale());
        let Some(scale) = scales.reduce(Scale::covering) else { return Ok(Vec::new()) };
        let states = ('a'..).zip(rows).zip(&stored);
        states
            .map(|((letter, &row), stored)| {
                self.panel(data, label, (letter, row), of(stored), &scale)
            })
            .collect()
    }

    /// Returns a slider with contact maps of states along the whole path; `None` for one state.
    fn slider(&self, data: &FigureData, label: String) -> Result<Option<LoadSlider>, ReportError> {
        let of = |column: &str| self.table.reals(column);
        let (gaps, loads, pressures) = (of(MEAN_GAP.name)?, of(LOAD.name)?, of(PRESSURE.name)?);
        let bound: Vec<usize> = (0..self.table.rows()).filter(|&row| gaps.is_valid(row)).collect();
        if bound.len() < 2 {
            return Ok(None);
        }
        let unit = self.length_unit.as_deref();
        let step = |index: usize| {
            let row = bound[index];
            let contact = self.contact(row)?;
            let values = self.values(Quantity::AdhesiveContact, &contact, None);
            let picture = values.raster(&values.scale()).at_most(PIXELS);
            let area = ContactArea::from_map(&self.set(CONTACT.name, row)?).fraction();
            let [_, branch] = self.state(data, row)?;
            let load = data.loads.text(loads.value(row), pressures.value(row));
            Ok(Step::new(format!("{load}, {branch}"), area, gaps.value(row), unit, &picture))
        };
        let steps = spread(bound.len()).map(step).collect::<Result<_, ReportError>>()?;
        let size = self.grid.cell().size();
        Ok(Some(LoadSlider {
            label,
            loads: bound.len(),
            ..LoadSlider::new(data.loads.name(), size, unit, steps)
        }))
    }
}
