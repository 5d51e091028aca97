//! The tables of a study as the claims need them: curves of surfaces, by spectrum and correction.

use std::collections::BTreeMap;

use arrow::array::{Array, Float64Array};

use super::intervals::Weights;
use super::setting::Setting;
use crate::contact::topography::nayak::Continuum;
use crate::ensemble::{self, Member, Members, ensembles};
use crate::fitting::{Curves, Window};
use crate::stages::Kind;
use crate::stages::columns::*;
use crate::stages::correct::AS_COUNTED;
use crate::stages::fit::meshes::refinements;
use crate::stages::grids::Meshes;
use crate::store::table::{Table, TableError};

/// Nodes to the shortest wavelength of the paper's coarsest meshes.
const COARSEST: i64 = 8;

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

impl Spectrum {
    /// Whether it has no plateau.
    pub fn is_plain(&self) -> bool {
        self.k_lower == self.k_rolloff
    }

    /// Whether the paper's words are about such spectra.
    pub fn is_of_the_paper(&self) -> bool {
        self.hurst == 0.8 && self.is_plain()
    }

    /// The same over continuous wavenumbers.
    pub fn continuum(&self) -> Continuum {
        Continuum {
            hurst: self.hurst,
            plateau: self.k_lower as f64 / self.k_rolloff as f64,
            magnification: self.k_upper as f64 / self.k_rolloff as f64,
        }
    }
}

/// The area curves of the surfaces of one spectrum, under one correction.
#[derive(Debug, Clone, PartialEq)]
pub struct AreaCurves {
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

/// One number per surface of a spectrum, under a load.
#[derive(Debug, Clone, PartialEq)]
pub struct AtLoad {
    /// The spectrum.
    pub spectrum: Spectrum,
    /// The load.
    pub load: f64,
    /// The numbers, by seed and realization.
    pub values: Vec<f64>,
}

/// What several meshes say of the error of the area, for one spectrum: per surface, covariance of
/// area and edge and variance of the edge, summed over loads.
#[derive(Debug, Clone, PartialEq)]
pub struct OverMeshes {
    /// The spectrum, in words.
    pub name: String,
    /// Covariances and variances, by surface.
    pub moments: [Vec<f64>; 2],
}

/// What a stage has finished.
#[derive(Debug, Clone)]
pub struct KindTable {
    /// What the stage does.
    pub kind: Kind,
    /// Its table.
    pub table: Table,
}

/// Everything that a study has computed, as far as claims ask for it.
#[derive(Debug, Clone)]
pub struct Evidence {
    /// Area curves.
    pub ensembles: Vec<AreaCurves>,
    /// All surfaces.
    surfaces: Table,
    /// All measured contacts.
    contacts: Table,
    /// What tells spectra from each other, and belongs into their names.
    varied: Varied,
    /// What all of them have in common, and what is left out.
    pub setting: Setting,
}

impl Evidence {
    /// Sorts the tables of a study's stages.
    ///
    /// # Errors
    /// When a table lacks a column that its kind of stage writes.
    pub fn of(stages: &[KindTable]) -> Result<Evidence, TableError> {
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
        let stacked = |tables: Vec<&Table>| {
            let tables: Vec<Table> = tables.into_iter().map(within).collect();
            Table::stack(&tables)
        };
        // Several stages may measure the same surfaces under other loads.
        let contacts = stacked(contacts)?;
        let mut ensembles = curves(&contacts)?;
        for ensemble in curves(&stacked(corrected)?)? {
            let is_counted = ensembles.iter().any(|known| known.is_of(&ensemble));
            if !is_counted {
                ensembles.push(ensemble);
            }
        }
        let surfaces = stacked(of_kind(Kind::Generate).collect())?;
        Ok(Evidence {
            varied: Varied::among(ensembles.iter().map(|ensemble| &ensemble.spectrum)),
            ensembles,
            surfaces,
            contacts,
            setting,
        })
    }

    /// The ensembles that the paper's words are about, under one correction, by spectrum: on meshes
    /// no coarser than its own.
    pub fn of_the_paper(&self, correction: &str) -> Vec<&AreaCurves> {
        let mut found = self.under(correction);
        found.retain(|AreaCurves { spectrum, .. }| {
            spectrum.is_of_the_paper() && spectrum.nodes >= COARSEST * spectrum.k_upper
        });
        found
    }

    /// A spectrum among others: `k_lower 4, k_upper 32`, and what else varies.
    pub fn name(&self, spectrum: &Spectrum) -> String {
        let mut name = format!("k_lower {}, k_upper {}", spectrum.k_lower, spectrum.k_upper);
        if !spectrum.is_plain() {
            name += &format!(", k_rolloff {}", spectrum.k_rolloff);
        }
        if self.varied.hurst {
            name += &format!(", H {}", spectrum.hurst);
        }
        if self.varied.nodes {
            name += &format!(", {} nodes", spectrum.nodes);
        }
        name
    }

    /// The ensembles under one correction, by spectrum.
    pub fn under(&self, correction: &str) -> Vec<&AreaCurves> {
        let mut found: Vec<&AreaCurves> = self
            .ensembles
            .iter()
            .filter(|ensemble| ensemble.correction == correction)
            .collect();
        found.sort_by_key(|ensemble| (ensemble.spectrum.k_lower, ensemble.spectrum.k_upper));
        found
    }

    /// A column of the surfaces' tables, by spectrum; none that no surface has.
    pub fn of_surfaces(&self, name: &str) -> Vec<PerSurface> {
        per_surface(&self.surfaces, |_, row| number(&self.surfaces, name, row))
    }

    /// What numbers of measured contacts amount to, under the load nearest to one within a tenth of
    /// it, of spectra that the paper's words are about.
    pub fn of_contacts(
        &self,
        load: f64,
        columns: &[&'static str],
        value: impl Fn(&BTreeMap<&'static str, f64>) -> f64,
    ) -> Vec<AtLoad> {
        let loads = self
            .of_the_paper(AS_COUNTED)
            .into_iter()
            .filter_map(|ensemble| {
                let load = ensemble.loads[ensemble.at(load)?];
                Some((key(&ensemble.spectrum), load))
            });
        let loads: BTreeMap<_, f64> = loads.collect();
        let of = |name: &str, row: usize| number(&self.contacts, name, row);
        let found = per_surface(&self.contacts, |spectrum, row| {
            let asked = loads.get(&key(spectrum))?;
            let numbers = columns.iter().map(|&name| Some((name, of(name, row)?)));
            let is_asked = of(LOAD.name, row)? == *asked;
            Some(value(&numbers.collect::<Option<_>>().filter(|_| is_asked)?))
        });
        let found = found
            .into_iter()
            .map(|PerSurface { spectrum, values }| AtLoad {
                load: loads[&key(&spectrum)],
                spectrum,
                values,
            });
        found.collect()
    }

    /// The spectra whose surfaces were pressed on several meshes.
    pub fn of_several_meshes(&self) -> Vec<OverMeshes> {
        let points = refinements(&self.contacts, Window::ALL).unwrap_or_default();
        let found = points.into_iter().filter_map(|point| {
            let spectrum = spectrum(&self.contacts, point.row).ok()??;
            let moments = point.moments()?;
            let name = format!("k_lower {}, k_upper {}", spectrum.k_lower, spectrum.k_upper);
            spectrum
                .is_of_the_paper()
                .then_some(OverMeshes { name, moments })
        });
        found.collect()
    }
}

/// What tells spectra from each other, besides their cutoffs.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Varied {
    hurst: bool,
    nodes: bool,
}

impl Varied {
    fn among<'a>(spectra: impl Iterator<Item = &'a Spectrum> + Clone) -> Varied {
        let first = spectra.clone().next();
        let differs = |differ: fn(&Spectrum, &Spectrum) -> bool| {
            let mut spectra = spectra.clone();
            first.is_some_and(|first| spectra.any(|other| differ(first, other)))
        };
        Varied {
            hurst: differs(|one, other| one.hurst != other.hurst),
            nodes: differs(|one, other| one.nodes != other.nodes),
        }
    }
}

impl AreaCurves {
    /// Whether it tells the same areas as another: what is corrected by nothing was counted before.
    fn is_of(&self, other: &AreaCurves) -> bool {
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

    /// The curves of the surfaces that count, up to the first load at which all of them are in full
    /// contact.
    pub fn curves(&self, weights: &Weights) -> Option<Curves> {
        let open = (0..self.loads.len()).take_while(|&place| self.mean(place) < 1.0);
        let by_load: Vec<Vec<f64>> = open
            .map(|place| weights.values(&self.areas[place]).collect())
            .collect();
        let loads = self.loads[..by_load.len()].to_vec();
        let surfaces = 0..by_load.first()?.len();
        let areas = surfaces.map(|surface| by_load.iter().map(|areas| areas[surface]).collect());
        Curves::new(loads, areas.collect()).ok()
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
    // The paper has no rectangles.
    let Some(nodes) = Meshes::of(table)?.of_square(row) else {
        return Ok(None);
    };
    Ok(Some(Spectrum {
        hurst: table.reals(HURST.name)?.value(row),
        k_lower: whole(K_LOWER.name)?,
        k_rolloff: whole(K_ROLLOFF.name)?,
        k_upper: whole(K_UPPER.name)?,
        nodes,
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

fn curves(table: &Table) -> Result<Vec<AreaCurves>, TableError> {
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
            false => AS_COUNTED.to_owned(),
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
) -> AreaCurves {
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
    AreaCurves {
        spectrum,
        correction,
        loads,
        areas,
    }
}

/// A value of a row, by surface and spectrum; rows without one are left out.
fn per_surface(table: &Table, value: impl Fn(&Spectrum, usize) -> Option<f64>) -> Vec<PerSurface> {
    let mut known: BTreeMap<_, (Spectrum, BTreeMap<Member, f64>)> = BTreeMap::new();
    let Ok(members) = Members::of(table) else {
        return Vec::new();
    };
    for row in 0..table.rows() {
        let Ok(Some(spectrum)) = spectrum(table, row) else {
            continue;
        };
        let Some(value) = value(&spectrum, row) else {
            continue;
        };
        let (_, values) = known
            .entry(key(&spectrum))
            .or_insert((spectrum, BTreeMap::new()));
        values.entry(members.of_row(row)).or_insert(value);
    }
    let found = known.into_values().map(|(spectrum, values)| PerSurface {
        spectrum,
        values: values.into_values().collect(),
    });
    found.collect()
}

/// A number of a row, whatever its column's type; none where it is null, or there is no such column.
fn number(table: &Table, name: &str, row: usize) -> Option<f64> {
    if let Ok(reals) = table.reals(name) {
        return reals.is_valid(row).then(|| reals.value(row));
    }
    let integers = table.integers(name).ok()?;
    integers.is_valid(row).then(|| integers.value(row) as f64)
}
