//! The tables of a study in the form that claims use: area–load curves by spectrum and correction.

mod per_load;

use std::collections::BTreeMap;

use arrow::array::{Array, Float64Array};

pub use crate::evidence::per_load::{KappaPoints, LimitsFit, PerLoad, Pressures};
use crate::evidence::per_load::{kappa_points, nearest};
use crate::quantities::under;
pub use crate::setting::Spectrum;
use crate::setting::{Setting, Varied, key, of_asperities, spectrum};
use asperity_pipeline::plan::Plan;
use asperity_pipeline::study::Study;
use asperity_stages::columns::*;
use asperity_stages::correct::AS_COUNTED;
use asperity_stages::ensemble::{self, Load, Member, Members, ensembles, load_column};
use asperity_stages::fit::laws::Law;
use asperity_stages::fit::meshes::refinements;
use asperity_stages::{Kind, Recipe};
use asperity_statistics::intervals::Weights;
use asperity_statistics::{Curves, Window};
use asperity_tables::column::Role;
use asperity_tables::table::{Table, TableError};

/// Nodes per shortest wavelength on the coarsest meshes of the paper.
const COARSEST: i64 = 8;

/// Contact area against load for the surfaces of one spectrum, with one correction.
#[derive(Debug, Clone, PartialEq)]
pub struct AreaCurves {
    pub spectrum: Spectrum,
    /// Name of the correction of the area.
    pub correction: String,
    /// Ascending loads, in units of E* × rms slope, at which each surface has a row or is beyond
    /// full contact.
    pub loads: Vec<f64>,
    /// The same loads in the unit of the manifest: reduced, or pressures in the unit of the
    /// modulus.
    pub given: Vec<f64>,
    /// Area fractions, `[load][surface]`. They are 1 at loads above full contact.
    pub areas: Vec<Vec<f64>>,
}

/// One number per surface of a spectrum.
#[derive(Debug, Clone, PartialEq)]
pub struct PerSurface {
    pub spectrum: Spectrum,
    /// Values in the order of seed and realization.
    pub values: Vec<f64>,
}

/// One number per surface of a spectrum at a load.
#[derive(Debug, Clone, PartialEq)]
pub struct AtLoad {
    pub spectrum: Spectrum,
    pub load: f64,
    /// Values in the order of seed and realization.
    pub values: Vec<f64>,
}

/// Moments of the counted area A_N and the edge S_d Δx over several meshes, for the surfaces of one
/// spectrum. They give the coefficient c of the mesh error in A_N = A* + c S_d Δx.
#[derive(Debug, Clone, PartialEq)]
pub struct OverMeshes {
    pub name: String,
    /// [Cov(A_N, S_d Δx), Var(S_d Δx)] over meshes, summed over loads, each with one value per
    /// surface.
    pub moments: [Vec<f64>; 2],
}

/// Table of the finished tasks of a stage.
#[derive(Debug, Clone)]
pub struct KindTable {
    pub kind: Kind,
    pub table: Table,
}

/// Results of a study that claims use.
#[derive(Debug, Clone)]
pub struct Evidence {
    pub ensembles: Vec<AreaCurves>,
    surfaces: Table,
    /// Table of all measured contacts.
    contacts: Table,
    /// Table of all asperity models on the surfaces.
    asperities: Table,
    /// Table of all distributions of contact pressures.
    pressures: Table,
    /// Values of κ = A/(A₀ y) for the fits of the limits of κ, one item for each load.
    pub kappa: Vec<KappaPoints>,
    varied: Varied,
    /// Setting that all rows share, and the rows left out.
    pub setting: Setting,
}

impl Evidence {
    /// Creates the evidence from the tables of a study, one for each stage of the plan, or `None`
    /// for a stage without finished tasks. For each fit of the limits of κ, adds the values of κ of
    /// single surfaces.
    pub fn from_study(
        study: &Study,
        plan: &Plan,
        tables: &[Option<Table>],
    ) -> Result<Evidence, TableError> {
        let stages = plan.stages.iter().zip(tables);
        let finished = stages.filter_map(|(stage, table)| {
            Some(KindTable { kind: stage.kind, table: table.clone()? })
        });
        let finished: Vec<KindTable> = finished.collect();
        Evidence::from_tables(&finished)?.with_limits(&limits(study, plan, tables)?)
    }

    /// Creates the evidence from the tables of stages, which are sorted by kind of stage.
    ///
    /// # Errors
    /// If a table lacks a column that its kind of stage writes.
    pub fn from_tables(stages: &[KindTable]) -> Result<Evidence, TableError> {
        let of_kind = |kind: Kind| {
            let own = stages.iter().filter(move |stage| stage.kind == kind);
            own.map(|stage| &stage.table)
        };
        let is_contacts = |table: &&Table| table.has(CONTACT_NODES.name);
        let contacts: Vec<&Table> = of_kind(Kind::Measure).filter(is_contacts).collect();
        let corrected: Vec<&Table> = of_kind(Kind::Correct).collect();
        let setting = match (contacts.is_empty(), corrected.is_empty()) {
            (false, _) => Setting::most_frequent(contacts.iter().copied()),
            (true, false) => Setting::most_frequent(corrected.iter().copied()),
            (true, true) => Setting::most_frequent(of_kind(Kind::Generate)),
        };
        let within = |table: &Table| setting.rows(table);
        let stacked = |tables: Vec<&Table>| {
            let tables: Vec<Table> = tables.into_iter().map(within).collect();
            Table::stack(&tables)
        };
        // Several stages may measure the same surfaces under different loads.
        let contacts = stacked(contacts)?;
        let mut ensembles = curves(&contacts)?;
        for ensemble in curves(&stacked(corrected)?)? {
            let is_counted = ensembles.iter().any(|known| known.is_of(&ensemble));
            if !is_counted {
                ensembles.push(ensemble);
            }
        }
        let surfaces = stacked(of_kind(Kind::Generate).collect())?;
        let is_pressures = |table: &&Table| table.has(PRESSURE_DENSITY.name);
        let pressures = stacked(of_kind(Kind::Measure).filter(is_pressures).collect())?;
        let asperities = of_kind(Kind::Solve).map(|table| of_asperities(table, &setting));
        let asperities = Table::stack(&asperities.collect::<Vec<_>>())?;
        Ok(Evidence {
            varied: varied(&ensembles, &pressures)?,
            ensembles,
            surfaces,
            contacts,
            asperities,
            pressures,
            kappa: Vec::new(),
            setting,
        })
    }

    /// Adds the values of κ of single surfaces for each fit of the limits of κ.
    ///
    /// # Errors
    /// If a table lacks a column that a fit reads.
    pub fn with_limits(mut self, fits: &[LimitsFit]) -> Result<Evidence, TableError> {
        self.kappa = kappa_points(fits, &self.setting)?;
        Ok(self)
    }

    /// Returns the ensembles with one correction to which the paper's claims apply, ordered by
    /// spectrum: H = 0.8, no plateau, and meshes at least as fine as the paper's.
    pub fn of_the_paper(&self, correction: &str) -> Vec<&AreaCurves> {
        let mut found = self.under(correction);
        found.retain(|AreaCurves { spectrum, .. }| {
            spectrum.is_of_the_paper() && spectrum.nodes >= COARSEST * spectrum.k_upper
        });
        found
    }

    /// Returns the name of a spectrum: `k_lower 4, k_upper 32`, followed by the other parameters
    /// that vary.
    pub fn name(&self, spectrum: &Spectrum) -> String {
        self.varied.name(spectrum)
    }

    /// Returns the name of a spectrum under a load: `k_lower 4, k_upper 32, load 0.060`.
    pub fn name_under(&self, spectrum: &Spectrum, load: f64) -> String {
        format!("{}, {}", self.name(spectrum), under(load))
    }

    /// Returns the ensembles with one correction, ordered by spectrum.
    pub fn under(&self, correction: &str) -> Vec<&AreaCurves> {
        let mut found: Vec<&AreaCurves> =
            self.ensembles.iter().filter(|ensemble| ensemble.correction == correction).collect();
        found.sort_by_key(|ensemble| (ensemble.spectrum.k_lower, ensemble.spectrum.k_upper));
        found
    }

    /// Returns the values of a column of the surfaces, by spectrum. The result is empty if no
    /// surface has the column.
    pub fn of_surfaces(&self, name: &str) -> Vec<PerSurface> {
        per_surface(&self.surfaces, |_, row| number(&self.surfaces, name, row))
    }

    /// Returns the ratio of edge nodes to switches on each surface, for spectra of the paper at the
    /// load nearest to `load`. Edge nodes are contact nodes with a gap among their four neighbours.
    /// Switches are pairs of neighbouring nodes with contact at one and a gap at the other. Spectra
    /// without a load within 10 % are omitted.
    pub fn edge_nodes_over_switches(&self, load: f64) -> Vec<AtLoad> {
        let loads = self.of_the_paper(AS_COUNTED).into_iter().filter_map(|ensemble| {
            let index = ensemble.at(load)?;
            let load = (ensemble.given[index], ensemble.loads[index]);
            Some((key(&ensemble.spectrum), load))
        });
        let loads: BTreeMap<_, (f64, f64)> = loads.collect();
        let given = load_column(&self.contacts);
        let found = per_surface(&self.contacts, |spectrum, row| {
            let of = |name: &str| number(&self.contacts, name, row);
            let is_asked = of(given)? == loads.get(&key(spectrum))?.0;
            let ratio = of(EDGE_NODES_4.name)? / of(SWITCHES.name)?;
            is_asked.then_some(ratio)
        });
        let found = found.into_iter().map(|PerSurface { spectrum, values }| AtLoad {
            load: loads[&key(&spectrum)].1,
            spectrum,
            values,
        });
        found.collect()
    }

    /// Returns the moments of each spectrum for which the contact of the same surfaces was solved
    /// on several meshes.
    pub fn of_several_meshes(&self) -> Vec<OverMeshes> {
        let points = refinements(&self.contacts, Window::ALL).unwrap_or_default();
        let found = points.into_iter().filter_map(|point| {
            let spectrum = spectrum(&self.contacts, point.row).ok()??;
            let moments = point.moments()?;
            let name = format!("k_lower {}, k_upper {}", spectrum.k_lower, spectrum.k_upper);
            spectrum.is_of_the_paper().then_some(OverMeshes { name, moments })
        });
        found.collect()
    }
}

/// Finds the parameters that differ between the spectra of the ensembles or, if there are no
/// ensembles, between the spectra of the table of pressures.
fn varied(ensembles: &[AreaCurves], pressures: &Table) -> Result<Varied, TableError> {
    let mut spectra: Vec<Spectrum> = ensembles.iter().map(|one| one.spectrum.clone()).collect();
    if spectra.is_empty() {
        let parameters = pressures.in_role(Role::Parameter);
        for rows in ensemble::grouped(&parameters) {
            spectra.extend(spectrum(pressures, rows[0])?);
        }
    }
    Ok(Varied::among(spectra.iter()))
}

impl AreaCurves {
    /// Returns true if both have the same spectrum and correction. Both can come from different
    /// stages, because a `correct` stage with the correction `none` repeats counted areas.
    fn is_of(&self, other: &AreaCurves) -> bool {
        (&self.spectrum, &self.correction) == (&other.spectrum, &other.correction)
    }

    pub fn surfaces(&self) -> usize {
        self.areas.first().map_or(0, Vec::len)
    }

    /// Returns the index of the load nearest to `load`, if it is within 10 %.
    pub fn at(&self, load: f64) -> Option<usize> {
        nearest(&self.loads, load)
    }

    /// Returns the area–load curves of the surfaces that `weights` selects, up to the first load at
    /// which all surfaces are in full contact. Returns `None` if no load remains.
    pub fn curves(&self, weights: &Weights) -> Option<Curves> {
        let open = (0..self.loads.len()).take_while(|&index| self.mean(index) < 1.0);
        let by_load: Vec<Vec<f64>> =
            open.map(|index| weights.values(&self.areas[index]).collect()).collect();
        let loads = self.loads[..by_load.len()].to_vec();
        let surfaces = 0..by_load.first()?.len();
        let areas = surfaces.map(|surface| by_load.iter().map(|areas| areas[surface]).collect());
        Curves::new(loads, areas.collect()).ok()
    }

    /// Returns the area at a load, averaged over all surfaces.
    pub fn mean(&self, load: usize) -> f64 {
        self.areas[load].iter().sum::<f64>() / self.surfaces() as f64
    }
}

fn curves(table: &Table) -> Result<Vec<AreaCurves>, TableError> {
    if table.rows() == 0 {
        return Ok(Vec::new());
    }
    let is_corrected = table.has(CORRECTION.name);
    let area = if is_corrected { AREA_CORRECTED } else { AREA_FRACTION };
    let areas = table.reals(area.name)?;
    let mut curves = Vec::new();
    for rows in ensembles(table)? {
        let Some(spectrum) = spectrum(table, rows.first)? else {
            continue;
        };
        let correction = if is_corrected {
            table.texts(CORRECTION.name)?.value(rows.first).to_owned()
        } else {
            AS_COUNTED.to_owned()
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
            rows.row(member, last).filter(|&row| areas.value(row) == 1.0)
        };
        let row = rows.row(member, load).or_else(left_behind)?;
        Some(areas.value(row))
    };
    let common = rows.loads.iter().enumerate().filter_map(|(index, &load)| {
        let areas: Option<Vec<f64>> = members.clone().map(|member| area(member, index)).collect();
        Some((load, areas?))
    });
    let (loads, areas): (Vec<Load>, _) = common.unzip();
    AreaCurves {
        spectrum,
        correction,
        given: loads.iter().map(|load| load.given).collect(),
        loads: loads.iter().map(|load| load.reduced).collect(),
        areas,
    }
}

/// Collects one value per surface, by spectrum. Rows without a value, and further rows of the same
/// surface, are skipped.
fn per_surface(table: &Table, value: impl Fn(&Spectrum, usize) -> Option<f64>) -> Vec<PerSurface> {
    let mut known: BTreeMap<_, (Spectrum, BTreeMap<Member, f64>)> = BTreeMap::new();
    let Ok(members) = Members::new(table) else {
        return Vec::new();
    };
    for row in 0..table.rows() {
        let Ok(Some(spectrum)) = spectrum(table, row) else {
            continue;
        };
        let Some(value) = value(&spectrum, row) else {
            continue;
        };
        let (_, values) = known.entry(key(&spectrum)).or_insert((spectrum, BTreeMap::new()));
        values.entry(members.of_row(row)).or_insert(value);
    }
    let found = known
        .into_values()
        .map(|(spectrum, values)| PerSurface { spectrum, values: values.into_values().collect() });
    found.collect()
}

/// Returns a number of a row, from a column of reals or integers. Returns `None` if it is null or
/// the column is missing.
fn number(table: &Table, name: &str, row: usize) -> Option<f64> {
    if let Ok(reals) = table.reals(name) {
        return reals.is_valid(row).then(|| reals.value(row));
    }
    let integers = table.integers(name).ok()?;
    integers.is_valid(row).then(|| integers.value(row) as f64)
}

/// Returns the fits of the law `limits` in a study, each with the rows that it reads.
fn limits(
    study: &Study,
    plan: &Plan,
    tables: &[Option<Table>],
) -> Result<Vec<LimitsFit>, TableError> {
    let mut fits = Vec::new();
    for (stage, planned) in study.stages.iter().zip(&plan.stages) {
        for &task in &planned.tasks {
            let Recipe::Fit(params) = &plan.tasks[task].recipe else {
                continue;
            };
            let Law::Limits(choices) = &params.law else {
                continue;
            };
            let inputs = stage.inputs.iter();
            let inputs: Vec<Table> = inputs.filter_map(|&input| tables[input].clone()).collect();
            if !inputs.is_empty() {
                fits.push(LimitsFit {
                    choices: choices.as_ref().clone(),
                    window: params.window(),
                    table: Table::stack(&inputs)?,
                });
            }
        }
    }
    Ok(fits)
}
