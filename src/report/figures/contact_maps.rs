//! Contact maps of two surfaces under five loads, and all of them laid over each other (figs. 7
//! and 8).

use std::collections::BTreeMap;

use crate::contact::morphology::map::ContactMap;
use crate::figures::figure::{Figure, Panel, panel_of_map};
use crate::figures::raster::Raster;
use crate::report::ReportError;
use crate::report::figure::{Definition, Drawn};
use crate::report::figure_data::FigureData;
use crate::report::samples::{self, Sample};
use crate::report::tables::FinishedStages;
use crate::stages::columns::{CONTACT, LOAD};
use crate::stages::grids::Grids;
use crate::stages::{Recipe, StageError};
use crate::store::TaskTables;
use crate::store::parquet::Columns;

pub const FIGURE: Definition = Definition {
    name: "contact-maps",
    title: "Contact maps",
    draw,
};

/// Where maps are shown, or at the nearest loads that a study has.
pub const SHOWN_LOADS: [f64; 5] = [0.012, 0.06, 0.14, 0.32, 0.74];
/// Pixels per side of a map.
const PIXELS: usize = 256;

fn draw(data: &FigureData) -> Result<Drawn, ReportError> {
    let mut rows = Vec::new();
    let samples = extremes(samples::of(data)?);
    let which = match samples.iter().all(|sample| sample.random().is_some()) {
        true => "with the smallest and of the one with the largest lower cutoff",
        false => "and of the last parameter point",
    };
    for sample in samples {
        let Some((maps, size)) = maps(data, &sample)? else {
            let needs = "contact maps, which are in the store no more";
            return Ok(Drawn::Gone { needs });
        };
        let maps = nearest(maps);
        if maps.is_empty() {
            continue;
        }
        let label = data.styles.label(&sample.point);
        let label = label.map_or_else(String::new, |label| format!("{label} · "));
        let mut panels: Vec<Panel> = ('a'..)
            .zip(&maps)
            .map(|(letter, (load, map))| Panel::Map {
                title: format!("{label}({letter}) load {load:.3}"),
                raster: Raster::of_contact(map).at_most(PIXELS),
                size,
            })
            .collect();
        let maps: Vec<ContactMap> = maps.into_iter().map(|(_, map)| map).collect();
        panels.push(Panel::Map {
            title: format!("{label}all loads"),
            raster: Raster::of_contacts(&maps).at_most(PIXELS),
            size,
        });
        while !panels.is_empty() {
            let rest = panels.split_off(panels.len().min(3));
            rows.push(std::mem::replace(&mut panels, rest));
        }
    }
    if rows.is_empty() {
        let lines = data.lines_of_loads("[0.012, 0.06, 0.14, 0.32, 0.74]");
        return Ok(Drawn::missing("solved loads", lines));
    }
    let caption = format!(
        "Contact, dark, of the first surface {which}, as counted on the mesh. Last of each: all \
         loads together, the darkest touches under the lightest of them, the lightest under the \
         heaviest alone."
    );
    let panel = panel_of_map(rows.iter().flatten(), 265.0);
    Ok(Drawn::figure(Figure { rows, panel }, caption))
}

/// The samples with the smallest and with the largest lower cutoff, each with the smallest upper
/// one that goes with it. Where there are no cutoffs, the first and the last.
fn extremes(mut samples: Vec<Sample>) -> Vec<Sample> {
    let cutoffs = |sample: &Sample| {
        let spectrum = sample.random().map(|surface| surface.spectrum);
        spectrum.map(|spectrum| (spectrum.k_lower, spectrum.k_upper))
    };
    samples.sort_by_key(cutoffs);
    let largest = samples.last().and_then(cutoffs).map(|(k_lower, _)| k_lower);
    let has_largest = |sample: &Sample| cutoffs(sample).map(|(k_lower, _)| k_lower) == largest;
    let last = match largest {
        Some(_) => samples.iter().position(has_largest).unwrap_or(0),
        None => samples.len().saturating_sub(1),
    };
    let mut place = 0;
    samples.retain(|_| {
        place += 1;
        place == 1 || place == last + 1
    });
    samples
}

/// Contact maps by load.
type Maps = BTreeMap<u64, ContactMap>;

/// All contact maps of a surface, and its sides; nothing if the store has lost some of them.
fn maps(data: &FigureData, sample: &Sample) -> Result<Option<(Maps, [f64; 2])>, ReportError> {
    let FinishedStages { plan, archive, .. } = data.finished;
    let mut maps = BTreeMap::new();
    let mut size = sample.params.size();
    for task in &plan.tasks {
        let solves = matches!(task.recipe, Recipe::Solve(_)) && task.inputs == [sample.task];
        if !solves || archive.have(&[task.key]) == [false] {
            continue;
        }
        if !archive.store().has(task.key) {
            return Ok(None);
        }
        let table = archive.store().read(task.key, Columns::All)?;
        let (loads, bits) = (table.reals(LOAD.name)?, table.bytes(CONTACT.name)?);
        let grids = Grids::of(&table)?;
        for row in 0..table.rows() {
            let grid = grids.grid(row).map_err(ReportError::Surface)?;
            size = grid.cell().size();
            let map = ContactMap::from_bytes(grid.nodes(), bits.value(row));
            let map = map.map_err(|error| ReportError::Surface(StageError::Map(error)))?;
            maps.insert(loads.value(row).to_bits(), map);
        }
    }
    Ok(Some((maps, size)))
}

/// The maps under the loads nearest to those that are shown, each once.
fn nearest(mut maps: BTreeMap<u64, ContactMap>) -> Vec<(f64, ContactMap)> {
    let mut chosen = BTreeMap::new();
    for shown in SHOWN_LOADS {
        let distance = |bits: u64| (f64::from_bits(bits) / shown).ln().abs();
        let nearest = maps
            .keys()
            .copied()
            .min_by(|&one, &other| distance(one).total_cmp(&distance(other)));
        if let Some((bits, map)) = nearest.and_then(|bits| maps.remove_entry(&bits)) {
            chosen.insert(bits, map);
        }
    }
    let chosen = chosen.into_iter();
    chosen
        .map(|(bits, map)| (f64::from_bits(bits), map))
        .collect()
}
