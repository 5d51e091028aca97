//! The tables of a study as the claims need them: curves of surfaces, by spectrum and correction.

use std::collections::BTreeMap;

use arrow::array::{Array, Float64Array};

use super::setting::Setting;
use crate::ensemble::{self, Member, Members, ensembles};
use crate::stages::Kind;
use crate::stages::columns::*;
use crate::store::table::{Table, TableError};

/// The correction of the counted area.
pub const COUNTED: &str = "none";
/// The correction that is right to 15 %.
pub const OF_2017: &str = "2017";
/// The correction of the 2015 paper.
pub const OF_2015: &str = "pi/8";

/// A spectrum on a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// Hurst exponent.
    pub hurst: f64,
    /// Lower cutoff.
    pub k_lower: i64,
    /// End of the plateau.
    pub k_rolloff: i64,
    /// Upper cutoff.
    pub k_upper: i64,
    /// Nodes per side.
    pub nodes: i64,
}

/// The area curves of the surfaces of one spectrum, under one correction.
#[derive(Debug, Clone, PartialEq)]
pub struct Ensemble {
    /// The spectrum.
    pub spectrum: Spectrum,
    /// The estimator of the area.
    pub correction: String,
    /// Loads that all surfaces have, or have left behind in full contact; ascending.
    pub loads: Vec<f64>,
    /// Areas, `[load][surface]`; one beyond full contact.
    pub areas: Vec<Vec<f64>>,
}

/// One number per surface of a spectrum.
#[derive(Debug, Clone, PartialEq)]
pub struct PerSurface {
    /// The spectrum.
    pub spectrum: Spectrum,
    /// The numbers, by seed and realization.
    pub values: Vec<f64>,
}

/// What a stage has finished.
#[derive(Debug, Clone)]
pub struct Finished {
    /// What the stage does.
    pub kind: Kind,
    /// The level of its intervals, of a fit.
    pub level: Option<f64>,
    /// Its table.
    pub table: Table,
}

/// Everything that a study has computed, as far as claims ask for it.
#[derive(Debug, Clone, Default)]
pub struct Evidence {
    /// Area curves.
    pub ensembles: Vec<Ensemble>,
    /// Fits.
    pub fits: Vec<Finished>,
    /// Tables of surfaces.
    surfaces: Vec<Table>,
    /// Tables of measured contacts.
    contacts: Vec<Table>,
    /// What all of them have in common, and what is left out.
    pub setting: Setting,
}

impl Evidence {
    /// Sorts the tables of a study's stages.
    ///
    /// # Errors
    /// When a table lacks a column that its kind of stage writes.
    pub fn of(stages: &[Finished]) -> Result<Evidence, TableError> {
        let of_kind = |kind: Kind| {
            let own = stages.iter().filter(move |stage| stage.kind == kind);
            own.map(|stage| &stage.table)
        };
        let is_contacts = |table: &&Table| table.has(CONTACT_NODES.name);
        let contacts: Vec<&Table> = of_kind(Kind::Measure).filter(is_contacts).collect();
        let corrected: Vec<&Table> = of_kind(Kind::Correct).collect();
        let setting = match (contacts.is_empty(), corrected.is_empty()) {
            (false, _) => Setting::of(contacts.iter().copied()),
            (true, false) => Setting::of(corrected.iter().copied()),
            (true, true) => Setting::of(of_kind(Kind::Generate)),
        };
        let within = |table: &Table| setting.rows(table);
        let contacts: Vec<Table> = contacts.into_iter().map(within).collect();
        let corrected: Vec<Table> = corrected.into_iter().map(within).collect();
        let surfaces = of_kind(Kind::Generate).map(within).collect();
        let fits = stages.iter().filter(|stage| stage.kind == Kind::Fit);
        let fits = fits.map(|stage| Finished {
            table: within(&stage.table),
            ..stage.clone()
        });
        let fits = fits.collect();
        // Several stages may measure the same surfaces under other loads.
        let mut ensembles = curves(&Table::stack(&contacts)?)?;
        for ensemble in curves(&Table::stack(&corrected)?)? {
            let is_counted = ensembles.iter().any(|known| known.is_of(&ensemble));
            if !is_counted {
                ensembles.push(ensemble);
            }
        }
        Ok(Evidence {
            ensembles,
            fits,
            surfaces,
            contacts,
            setting,
        })
    }

    /// The ensembles under one correction, by spectrum.
    pub fn under(&self, correction: &str) -> Vec<&Ensemble> {
        let mut found: Vec<&Ensemble> = self
            .ensembles
            .iter()
            .filter(|ensemble| ensemble.correction == correction)
            .collect();
        found.sort_by_key(|ensemble| (ensemble.spectrum.k_lower, ensemble.spectrum.k_upper));
        found
    }

    /// A column of the surfaces' tables, by spectrum.
    pub fn of_surfaces(&self, name: &str) -> Result<Vec<PerSurface>, TableError> {
        per_surface(&self.surfaces, |table, row| {
            let column = table.reals(name)?;
            Ok(column.is_valid(row).then(|| column.value(row)))
        })
    }

    /// What a row of measured contacts amounts to, under the load nearest to one; by spectrum.
    pub fn of_contacts(
        &self,
        load: f64,
        value: impl Fn(&Table, usize) -> Result<f64, TableError>,
    ) -> Result<Vec<PerSurface>, TableError> {
        let Some(nearest) = self.nearest_load(load)? else {
            return Ok(Vec::new());
        };
        per_surface(&self.contacts, |table, row| {
            let at_load = table.reals(LOAD.name)?.value(row) == nearest;
            at_load.then(|| value(table, row)).transpose()
        })
    }

    fn nearest_load(&self, load: f64) -> Result<Option<f64>, TableError> {
        let mut nearest: Option<f64> = None;
        for table in &self.contacts {
            for found in table.reals(LOAD.name)?.iter().flatten() {
                if nearest.is_none_or(|best| (found - load).abs() < (best - load).abs()) {
                    nearest = Some(found);
                }
            }
        }
        Ok(nearest)
    }
}

impl Ensemble {
    /// Whether it tells the same areas as another: what is corrected by nothing was counted before.
    fn is_of(&self, other: &Ensemble) -> bool {
        (&self.spectrum, &self.correction) == (&other.spectrum, &other.correction)
    }

    /// Number of surfaces.
    pub fn surfaces(&self) -> usize {
        self.areas.first().map_or(0, Vec::len)
    }

    /// The place of the load nearest to one, if it is within a tenth of it.
    pub fn at(&self, load: f64) -> Option<usize> {
        let nearest = (0..self.loads.len()).min_by(|&one, &other| {
            let distance = |index: usize| (self.loads[index] - load).abs();
            distance(one).total_cmp(&distance(other))
        })?;
        ((self.loads[nearest] / load - 1.0).abs() < 0.1).then_some(nearest)
    }

    /// Area averaged over all surfaces alike.
    pub fn mean(&self, load: usize) -> f64 {
        self.areas[load].iter().sum::<f64>() / self.surfaces() as f64
    }
}

/// The columns of a table's spectra; none of surfaces that were not drawn from one.
fn spectrum(table: &Table, row: usize) -> Result<Option<Spectrum>, TableError> {
    if !table.has(HURST.name) || table.reals(HURST.name)?.is_null(row) {
        return Ok(None);
    }
    let whole = |name: &str| Ok::<_, TableError>(table.integers(name)?.value(row));
    Ok(Some(Spectrum {
        hurst: table.reals(HURST.name)?.value(row),
        k_lower: whole(K_LOWER.name)?,
        k_rolloff: whole(K_ROLLOFF.name)?,
        k_upper: whole(K_UPPER.name)?,
        nodes: whole(NODES.name)?,
    }))
}

fn key(spectrum: &Spectrum) -> (u64, i64, i64, i64, i64) {
    let Spectrum {
        hurst,
        k_lower,
        k_rolloff,
        k_upper,
        nodes,
    } = *spectrum;
    (hurst.to_bits(), k_lower, k_rolloff, k_upper, nodes)
}

fn curves(table: &Table) -> Result<Vec<Ensemble>, TableError> {
    if table.rows() == 0 {
        return Ok(Vec::new());
    }
    let is_corrected = table.has(CORRECTION.name);
    let area = if is_corrected {
        AREA_CORRECTED
    } else {
        AREA_FRACTION
    };
    let areas = table.reals(area.name)?;
    let mut curves = Vec::new();
    for rows in ensembles(table)? {
        let Some(spectrum) = spectrum(table, rows.first)? else {
            continue;
        };
        let correction = match is_corrected {
            true => table.texts(CORRECTION.name)?.value(rows.first).to_owned(),
            false => COUNTED.to_owned(),
        };
        curves.push(ensemble(spectrum, correction, &rows, areas));
    }
    curves.sort_by_key(|ensemble| (key(&ensemble.spectrum), ensemble.correction.clone()));
    Ok(curves)
}

fn ensemble(
    spectrum: Spectrum,
    correction: String,
    rows: &ensemble::Ensemble,
    areas: &Float64Array,
) -> Ensemble {
    let members = 0..rows.members.len();
    let last =
        |member: usize| (0..rows.loads.len()).rfind(|&load| rows.row(member, load).is_some());
    let lasts: Vec<Option<usize>> = members.clone().map(last).collect();
    let area = |member: usize, load: usize| {
        let left_behind = || {
            let last = lasts[member].filter(|&last| load > last)?;
            rows.row(member, last)
                .filter(|&row| areas.value(row) == 1.0)
        };
        let row = rows.row(member, load).or_else(left_behind)?;
        Some(areas.value(row))
    };
    let common = rows.loads.iter().enumerate().filter_map(|(place, &load)| {
        let areas: Option<Vec<f64>> = members.clone().map(|member| area(member, place)).collect();
        Some((load, areas?))
    });
    let (loads, areas) = common.unzip();
    Ensemble {
        spectrum,
        correction,
        loads,
        areas,
    }
}

fn per_surface(
    tables: &[Table],
    value: impl Fn(&Table, usize) -> Result<Option<f64>, TableError>,
) -> Result<Vec<PerSurface>, TableError> {
    let mut known: BTreeMap<_, (Spectrum, BTreeMap<Member, f64>)> = BTreeMap::new();
    for table in tables {
        let members = Members::of(table)?;
        for row in 0..table.rows() {
            let (Some(spectrum), Some(value)) = (spectrum(table, row)?, value(table, row)?) else {
                continue;
            };
            let entry = known.entry(key(&spectrum));
            let (_, values) = entry.or_insert((spectrum, BTreeMap::new()));
            values.entry(members.of_row(row)).or_insert(value);
        }
    }
    let found = known.into_values().map(|(spectrum, values)| PerSurface {
        spectrum,
        values: values.into_values().collect(),
    });
    Ok(found.collect())
}
