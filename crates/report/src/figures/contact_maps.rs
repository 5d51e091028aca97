//! Contact maps of two surfaces at five loads, and one map per surface that combines the loads
//! (figs. 7 and 8). On the page, a slider shows more loads of each surface.

use std::collections::{BTreeMap, BTreeSet};

use base64::prelude::{BASE64_STANDARD, Engine};
use serde::Serialize;

use crate::ReportError;
use crate::charts::map_panel::MapPanel;
use crate::charts::raster::Raster;
use crate::charts::{Figure, Panel, in_rows, panel_of_map};
use crate::figure_data::FigureData;
use crate::figures::{Definition, Drawn};
use crate::finished::FinishedStages;
use crate::loads::Loads;
use crate::points::{self, Point};
use crate::samples::{self, Sample};
use crate::units::{digits, length_in_words, scale_bar};
use asperity_mechanics::morphology::area::ContactArea;
use asperity_mechanics::morphology::map::ContactMap;
use asperity_stages::columns::{CONTACT, LOAD, MEAN_GAP, PRESSURE};
use asperity_stages::grids::Grids;
use asperity_stages::{Recipe, Stage as _, StageError, ensemble};
use asperity_tables::store::TaskTables;
use asperity_tables::table::Table;

pub const CONTACT_MAPS: Definition =
    Definition { name: "contact-maps", title: "Contact maps", draw: draw_maps };

/// Loads at which maps are drawn. If a study does not have one of these loads, the nearest load is
/// used.
pub const SHOWN_LOADS: [f64; 5] = [0.012, 0.06, 0.14, 0.32, 0.74];
/// Pixels per side of a map.
const PIXELS: usize = 256;

fn draw_maps(data: &FigureData) -> Result<Drawn, ReportError> {
    let (mut by_sample, mut sliders) = (Vec::new(), Vec::new());
    let samples = extremes(samples::first_surfaces(data.finished)?);
    let lower = |sample: &Sample| Some(sample.random()?.spectrum.k_lower);
    let of_points = match samples.as_slice() {
        [] | [_] => "",
        [one, other] if lower(one) != lower(other) => {
            " of the parameter points with the smallest and the largest lower cutoff"
        }
        _ => " of the first and the last parameter point",
    };
    for sample in samples {
        let Some(pressed) = Pressed::read(data, &sample)? else {
            return Ok(Drawn::gone(
                "contact maps, which are no longer in the store; run the study to compute them again",
            ));
        };
        if pressed.states.is_empty() {
            continue;
        }
        let label = data.styles.label(&pressed.point);
        let panels = pressed.panels(label.as_deref(), &data.loads);
        by_sample.push(panels);
        if pressed.states.len() > 1 {
            sliders.push(pressed.slider(label.unwrap_or_default(), &data.loads));
        }
    }
    if by_sample.is_empty() {
        return Ok(Drawn::NotAsked);
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
    let panel = panel_of_map(rows.iter().flatten(), 265.0);
    Ok(Drawn::figure(Figure::from_panels(rows, panel), caption).with_sliders(sliders))
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
    let last = if smallest == largest {
        samples.len().saturating_sub(1)
    } else {
        samples.iter().position(|sample| lower(sample) == largest).unwrap_or(0)
    };
    let mut count = 0;
    samples.retain(|_| {
        count += 1;
        count == 1 || count == last + 1
    });
    samples
}

/// A surface with its contacts at one parameter point.
struct Pressed {
    point: Point,
    /// Sides of the map, in `unit`.
    size: [f64; 2],
    /// Unit of the sides and gaps, if known.
    unit: Option<String>,
    /// Contacts by load. The key has the bits of the load, which sort like positive numbers.
    states: BTreeMap<u64, State>,
}

/// Contact map and mean gap at a load.
struct State {
    map: ContactMap,
    mean_gap: f64,
    /// Mean pressure in the unit of the tables.
    pressure: f64,
}

impl Pressed {
    /// Reads the contacts of the surface at all loads of the first parameter point. Returns `None`
    /// if the store has lost maps.
    fn read(data: &FigureData, sample: &Sample) -> Result<Option<Pressed>, ReportError> {
        let FinishedStages { plan, archive, .. } = data.finished;
        let mut pressed = Pressed {
            point: sample.point.clone(),
            size: sample.params.size(),
            unit: None,
            states: BTreeMap::new(),
        };
        let mut first = None;
        for task in &plan.tasks {
            let Recipe::Solve(params) = &task.recipe else {
                continue;
            };
            if task.inputs != [sample.task] || archive.have(&[&task.table]) == [false] {
                continue;
            }
            let point = ensemble::ParameterPoint::from_cells(params.coordinates());
            if *first.get_or_insert_with(|| point.clone()) != point {
                continue;
            }
            if !archive.store().has(&task.table) {
                return Ok(None);
            }
            pressed.add(&data.finished.stored(task)?)?;
        }
        pressed.unit = data.units.at(&pressed.point).map(str::to_owned);
        Ok(Some(pressed))
    }

    fn add(&mut self, block: &Table) -> Result<(), ReportError> {
        if block.rows() == 0 {
            return Ok(());
        }
        self.point = points::at_row(block, 0);
        let (loads, gaps) = (block.reals(LOAD.name)?, block.reals(MEAN_GAP.name)?);
        let pressures = block.reals(PRESSURE.name)?;
        let bits = block.bytes(CONTACT.name)?;
        let grids = Grids::new(block)?;
        for row in 0..block.rows() {
            let grid = grids.grid(row).map_err(ReportError::Surface)?;
            self.size = grid.cell().size();
            let map = ContactMap::from_bytes(grid.nodes(), bits.value(row))
                .map_err(|error| ReportError::Surface(StageError::Map(error)))?;
            let mean_gap = gaps.value(row);
            let state = State { map, mean_gap, pressure: pressures.value(row) };
            self.states.insert(loads.value(row).to_bits(), state);
        }
        Ok(())
    }

    /// Returns the maps at the shown loads and, for several loads, one map that combines them.
    fn panels(&self, label: Option<&str>, loads: &Loads) -> Vec<Panel> {
        let before = label.map_or_else(String::new, |label| format!("{label} · "));
        let shown = self.nearest();
        let states = shown.iter().map(|load| (load, &self.states[load]));
        let mut panels: Vec<Panel> = ('a'..)
            .zip(states.clone())
            .map(|(letter, (load, state))| {
                let load = match loads {
                    Loads::Reduced => format!("load {:.3}", f64::from_bits(*load)),
                    Loads::Pressures { .. } => loads.text(f64::from_bits(*load), state.pressure),
                };
                let letter = if shown.len() > 1 { format!("({letter}) ") } else { String::new() };
                let title = format!("{before}{letter}{load}");
                self.panel(title, &Raster::from_contact(&state.map))
            })
            .collect();
        if panels.len() < 2 {
            return panels;
        }
        let maps: Vec<ContactMap> = states.map(|(_, state)| state.map.clone()).collect();
        let title = format!("{before}all loads");
        panels.push(self.panel(title, &Raster::from_contacts(&maps)));
        panels
    }

    fn panel(&self, title: String, picture: &Raster) -> Panel {
        Panel::Map(MapPanel {
            scale_bar: scale_bar(self.size[0], self.unit.as_deref()),
            ..MapPanel::new(title, picture.at_most(PIXELS), self.size)
        })
    }

    /// Returns the loads nearest to [`SHOWN_LOADS`], each once.
    fn nearest(&self) -> BTreeSet<u64> {
        let mut left: BTreeSet<u64> = self.states.keys().copied().collect();
        let mut chosen = BTreeSet::new();
        for shown in SHOWN_LOADS {
            let distance = |bits: u64| (f64::from_bits(bits) / shown).ln().abs();
            let nearest = left
                .iter()
                .copied()
                .min_by(|&one, &other| distance(one).total_cmp(&distance(other)));
            chosen.extend(nearest.and_then(|load| left.take(&load)));
        }
        chosen
    }

    /// Returns a slider with maps at up to [`MOST`] loads, evenly spread over all loads of the
    /// surface.
    fn slider(&self, label: String, loads: &Loads) -> LoadSlider {
        let states: Vec<(&u64, &State)> = self.states.iter().collect();
        let step = |index: usize| {
            let (load, State { map, mean_gap, pressure }) = states[index];
            let load = loads.text(f64::from_bits(*load), *pressure);
            let area = ContactArea::from_map(map).fraction();
            let picture = Raster::from_contact(map).at_most(PIXELS);
            let unit = self.unit.as_deref();
            Step::new(load, area, *mean_gap, unit, &picture)
        };
        let steps = spread(states.len()).map(step).collect();
        LoadSlider {
            label,
            one: "load",
            loads: states.len(),
            ..LoadSlider::new(loads.name(), self.size, self.unit.as_deref(), steps)
        }
    }
}

/// Largest number of maps of one slider; each takes a few kilobytes of the page.
const MOST: usize = 16;

#[derive(Debug, Serialize)]
pub struct LoadSlider {
    /// Label of the surface, which is empty if it is the only one.
    pub label: String,
    /// Name of the loads in the text below the slider.
    pub load_name: &'static str,
    /// Word for a step of the slider: `load`, or `state` of a path.
    pub one: &'static str,
    /// Sides of the maps along x and y, relative to the longer one.
    pub size: [f64; 2],
    /// Scale bar, if the unit of length is known.
    pub scale: Option<SliderScale>,
    /// Maps at ascending loads, spread over all loads.
    pub steps: Vec<Step>,
    pub loads: usize,
}

impl LoadSlider {
    /// Creates a slider of maps with these sides, in `unit`.
    pub fn new(
        load_name: &'static str,
        size: [f64; 2],
        unit: Option<&str>,
        steps: Vec<Step>,
    ) -> LoadSlider {
        LoadSlider {
            label: String::new(),
            load_name,
            one: "state",
            size: size.map(|side| side / size[0].max(size[1])),
            scale: scale_bar(size[0], unit)
                .map(|bar| SliderScale { percent: 100.0 * bar.length / size[0], label: bar.label }),
            loads: steps.len(),
            steps,
        }
    }
}

#[derive(Debug, Serialize)]
pub struct SliderScale {
    /// Length in per cent of the width of the maps.
    pub percent: f64,
    pub label: String,
}

/// A contact map, with its load, area and mean gap as text.
#[derive(Debug, Serialize)]
pub struct Step {
    /// Load in the unit of the manifest.
    pub load: String,
    /// Contact area in per cent.
    pub area: String,
    /// Mean gap with its unit, if known.
    pub mean_gap: String,
    /// PNG file in base 64.
    pub picture: String,
}

impl Step {
    /// Creates a step from the text of the load, the area fraction and the mean gap in the unit of
    /// the surface.
    pub fn new(
        load: String,
        area: f64,
        mean_gap: f64,
        unit: Option<&str>,
        picture: &Raster,
    ) -> Step {
        Step {
            load,
            area: format!("{} %", digits(100.0 * area, 3)),
            mean_gap: length_in_words(mean_gap, unit),
            picture: BASE64_STANDARD.encode(picture.to_png()),
        }
    }
}

/// Returns at most [`MOST`] of `count` indices, evenly spread, with the first and the last.
pub fn spread(count: usize) -> impl Iterator<Item = usize> {
    let steps = count.min(MOST);
    (0..steps).map(move |step| match steps {
        1 => 0,
        _ => step * (count - 1) / (steps - 1),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_and_the_last_load_are_shown_and_each_at_most_once() {
        for count in [1, 2, 15, 16, 17, 90] {
            let steps: Vec<usize> = spread(count).collect();
            assert_eq!(steps.len(), count.min(MOST));
            assert_eq!([steps[0], *steps.last().unwrap()], [0, count - 1]);
            assert!(steps.is_sorted_by(|one, next| one < next), "{steps:?}");
        }
        assert_eq!(spread(0).count(), 0);
    }
}
