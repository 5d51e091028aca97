//! Rows of the solved loads of a block, as a table and as a checkpoint.

use std::io::{self, Read, Write};

use arrow::array::{ArrayRef, Float64Builder};

use super::maps::{Distributions, Flows};
use super::units::{PressureUnit, Scales, SurfaceHardness};
use super::{PAIR_LIMIT, Params, Pressures};
use crate::StageError;
use crate::columns::*;
use asperity_contact::grid::Boundary;
use asperity_contact::morphology::map::ContactMap;
use asperity_contact::solver::{Outcome, Solver, Stop, Watch};
use asperity_contact::threads::Threads;
use asperity_tables::column::{Column, bytes, integers, lists, reals, texts};
use asperity_tables::table::Table;

/// Rows of the solved loads of a block.
#[derive(Default)]
pub struct Solved {
    hardness: Option<SurfaceHardness>,
    /// Displacement of each node under unit pressure, if displacements are absolute.
    under_unit_pressure: Option<Vec<f64>>,
    /// Mean displacement over the map under each load.
    displacements: Vec<f64>,
    loads: Vec<f64>,
    outcomes: Vec<Outcome>,
    /// Contact map of each load.
    maps: Vec<Vec<u8>>,
    /// Stored pressure fields, concatenated.
    pressures: Float64Builder,
    /// Number of stored pressures of each load: the number of nodes, or 0.
    stored_pressures: Vec<usize>,
    distributions: Distributions,
    flows: Option<Flows>,
    /// Columns that only asperity models have.
    of_asperities: Vec<(Column, ArrayRef)>,
}

/// Choice of the columns that only some tables of solved loads have.
#[derive(Debug, Clone, Copy)]
pub struct OptionalColumns {
    pub boundary: Boundary,
    pub asperities: bool,
    pub flow: bool,
    /// Unit in which loads are given.
    pub load_unit: PressureUnit,
    /// Unit in which the hardness is given, if the material yields.
    pub hardness: Option<PressureUnit>,
}

/// Returns the columns of solved loads, without the parameter columns of surfaces.
pub fn columns(optional: OptionalColumns) -> Vec<Column> {
    let OptionalColumns { boundary, asperities, flow, load_unit, hardness } = optional;
    let mut columns = SOLVED.to_vec();
    let mut insert_after = |column: Column, new: &[Column]| {
        let index = columns.iter().position(|other| *other == column);
        let index = 1 + index.expect("all tables have the column");
        columns.splice(index..index, new.iter().copied());
    };
    if flow {
        insert_after(MEAN_GAP, &FLOW);
    }
    if let Some(unit) = hardness {
        insert_after(MEAN_GAP, &[MEAN_YIELDED_DEPTH]);
        insert_after(CONTACT_NODES, &[SATURATED_NODES, SATURATED_FRACTION]);
        insert_after(MAX_PAIRS, &unit.hardness_columns());
    }
    if asperities {
        insert_after(CONTACT_NODES, &ASPERITY_COLUMNS);
        insert_after(MAX_PAIRS, &[INTERACTION]);
    }
    if boundary == Boundary::Free {
        insert_after(MEAN_GAP, &[MEAN_DISPLACEMENT]);
        insert_after(MAX_PAIRS, &[BOUNDARY]);
    }
    for own in load_unit.load_columns() {
        let listed = columns.iter_mut().find(|column| column.name == own.name);
        *listed.expect("all tables have both columns") = own;
    }
    columns
}

impl Solved {
    /// Creates an empty list of rows. `under_unit_pressure` is the displacement of each node under
    /// unit pressure, if displacements are absolute.
    pub fn new(
        hardness: Option<SurfaceHardness>,
        under_unit_pressure: Option<Vec<f64>>,
        distributions: Distributions,
        flows: Option<Flows>,
    ) -> Solved {
        Solved { hardness, under_unit_pressure, distributions, flows, ..Solved::default() }
    }

    /// Adds the columns of an asperity model.
    pub fn with_columns(self, of_asperities: Vec<(Column, ArrayRef)>) -> Solved {
        Solved { of_asperities, ..self }
    }

    /// Counts the pressures and gaps of the next load and computes its flow, if requested. Call
    /// this before [`Solved::push`].
    pub fn evaluate_maps(
        &mut self,
        solver: &mut Solver,
        watch: &dyn Watch,
    ) -> Result<(), StageError> {
        self.distributions.count_pressures(solver.pressure());
        if !self.distributions.counts_gaps() && self.flows.is_none() {
            return Ok(());
        }
        let pressures = solver.pressure().to_vec();
        let gap = solver.gap_under(&pressures);
        self.distributions.count_gaps(&gap, &pressures);
        if let Some(flows) = &mut self.flows {
            let computed = flows.compute(&gap, &pressures, watch);
            computed.ok_or(StageError::Interrupted)?;
        }
        Ok(())
    }

    /// Adds the row of a load. Stores its pressure field if `keep` is true.
    pub fn push(
        &mut self,
        load: f64,
        outcome: Outcome,
        pressures: &[f64],
        keep: bool,
        scales: &Scales,
        threads: &Threads,
    ) {
        if let Some(displacement) = &self.under_unit_pressure {
            // By reciprocity, ⟨u⟩ = ⟨u₁ p⟩, where u₁ is the displacement under unit pressure.
            let sum: f64 = displacement.iter().zip(pressures).map(|(u, p)| u * p).sum();
            self.displacements.push(sum / pressures.len() as f64);
        }
        self.loads.push(load);
        self.outcomes.push(outcome);
        let contact = ContactMap::from_pressures_on(threads, scales.nodes, pressures);
        self.maps.push(contact.to_bytes());
        self.stored_pressures.push(if keep { pressures.len() } else { 0 });
        if keep {
            for &pressure in pressures {
                let touches = pressure > 0.0;
                self.pressures.append_option(touches.then_some(pressure * scales.pressure()));
            }
        }
    }

    /// Returns the contact map of the load with this index, in the format of the column `contact`.
    pub fn contact(&self, load: usize) -> Option<&[u8]> {
        self.maps.get(load).map(Vec::as_slice)
    }

    /// Returns the rows as a table. Stored pressure fields are moved into the table.
    pub fn table(&mut self, params: &Params, surface: &Table, scales: &Scales) -> Table {
        let count = self.loads.len();
        let column = |value: fn(&Outcome) -> f64, unit: f64| {
            reals(self.outcomes.iter().map(|outcome| value(outcome) * unit))
        };
        let whole = |value: fn(&Outcome) -> i64| integers(self.outcomes.iter().map(value));
        let hardness = self.hardness.iter();
        let hardness = hardness.flat_map(SurfaceHardness::coordinates);
        let coordinates = params.setting().into_iter().chain(hardness);
        let mut columns: Vec<(Column, ArrayRef)> =
            coordinates.map(|(column, value)| (column, value.repeated(count))).collect();
        let pressures = match params.load_unit {
            PressureUnit::Relative => {
                let of_loads = self.loads.iter();
                reals(of_loads.map(|&load| scales.mean_pressure(load)))
            }
            PressureUnit::Absolute => reals(params.loads[..count].iter().copied()),
        };
        let [load, pressure] = params.load_unit.load_columns();
        columns.extend([
            (load, reals(self.loads.iter().copied())),
            (pressure, pressures),
            (CONTACT_NODES, whole(|outcome| outcome.contact_nodes as i64)),
        ]);
        columns.append(&mut self.of_asperities);
        if self.hardness.is_some() {
            let saturated = self.outcomes.iter().map(|outcome| outcome.saturated_nodes);
            let all = (scales.nodes[0] * scales.nodes[1]) as f64;
            let shares = saturated.clone().map(|nodes| nodes as f64 / all);
            columns.extend([
                (SATURATED_NODES, integers(saturated.map(|nodes| nodes as i64))),
                (SATURATED_FRACTION, reals(shares)),
            ]);
        }
        columns.push((MEAN_GAP, column(|outcome| outcome.mean_gap, scales.length())));
        if self.under_unit_pressure.is_some() {
            let displacements = self.displacements.iter();
            let absolute = reals(displacements.map(|value| value * scales.length()));
            columns.push((MEAN_DISPLACEMENT, absolute));
        }
        if self.hardness.is_some() {
            let depth = column(|outcome| outcome.yielded_depth, scales.length());
            columns.push((MEAN_YIELDED_DEPTH, depth));
        }
        if let Some(flows) = &self.flows {
            let gaps: Vec<f64> = self.outcomes.iter().map(|load| load.mean_gap).collect();
            columns.extend(flows.columns(&gaps, scales.length()));
        }
        columns.extend([
            (ENERGY, column(|outcome| outcome.energy, scales.pressure() * scales.length())),
            (PEAK_PRESSURE, column(|outcome| outcome.peak_pressure, scales.pressure())),
            (PAIRS, whole(|outcome| i64::from(outcome.pairs))),
            (RESIDUAL, column(|outcome| outcome.residual, 1.0)),
            (STOP, texts(self.outcomes.iter().map(|outcome| stop_name(outcome.stop)))),
            (CONTACT, bytes(&self.maps)),
        ]);
        if params.pressures != Pressures::None {
            let values = self.pressures.finish();
            columns.push((PRESSURES, lists(values, self.stored_pressures.iter().copied())));
        }
        columns.extend(self.distributions.columns());
        surface.coordinates().pick(&vec![0; count]).with(columns)
    }
}

/// Returns the code of a load in the column `stop`.
fn stop_name(stop: Stop) -> &'static str {
    match stop {
        Stop::Converged => "converged",
        Stop::FullContact => "full-contact",
        Stop::PairLimit => PAIR_LIMIT,
        Stop::Interrupted => "interrupted",
    }
}

/// First bytes of a checkpoint. Raise the number at the end whenever the format changes.
const FORMAT: &[u8; 8] = b"solve\0\0\x01";

const STOPS: [Stop; 4] = [Stop::Converged, Stop::FullContact, Stop::PairLimit, Stop::Interrupted];

impl Solved {
    /// Writes a checkpoint of the rows and the solver.
    pub fn save(&self, solver: &Solver, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(FORMAT)?;
        write_whole(out, self.loads.len())?;
        for (row, outcome) in self.outcomes.iter().enumerate() {
            write_real(out, self.loads[row])?;
            save_outcome(out, outcome)?;
            write_whole(out, self.maps[row].len())?;
            out.write_all(&self.maps[row])?;
            write_whole(out, self.stored_pressures[row])?;
        }
        write_whole(out, self.displacements.len())?;
        self.displacements.iter().try_for_each(|value| write_real(out, *value))?;
        let pressures = self.pressures.finish_cloned();
        write_whole(out, pressures.len())?;
        for pressure in &pressures {
            // Pressures are not negative, so −1 marks a null outside contact.
            write_real(out, pressure.unwrap_or(-1.0))?;
        }
        self.distributions.save(out)?;
        if let Some(flows) = &self.flows {
            flows.save(out)?;
        }
        solver.save(out)
    }

    /// Restores a new solver and an empty list of rows from a checkpoint.
    ///
    /// # Errors
    /// Returns an error if the bytes are not a checkpoint of [`Solved::save`]. After an
    /// error, neither the solver nor the rows may be used.
    pub fn restore(&mut self, solver: &mut Solver, mut from: &[u8]) -> io::Result<()> {
        let from = &mut from;
        let mut format = [0; FORMAT.len()];
        from.read_exact(&mut format)?;
        if format != *FORMAT {
            return Err(io::ErrorKind::InvalidData.into());
        }
        for _ in 0..read_whole(from)? {
            self.loads.push(read_real(from)?);
            self.outcomes.push(read_outcome(from)?);
            let mut map = vec![0; read_whole(from)?.min(from.len())];
            from.read_exact(&mut map)?;
            self.maps.push(map);
            self.stored_pressures.push(read_whole(from)?);
        }
        for _ in 0..read_whole(from)? {
            self.displacements.push(read_real(from)?);
        }
        for _ in 0..read_whole(from)? {
            let value = read_real(from)?;
            self.pressures.append_option((value >= 0.0).then_some(value));
        }
        self.distributions.restore(from)?;
        if let Some(flows) = &mut self.flows {
            flows.restore(self.loads.len(), from)?;
        }
        solver.restore(from)
    }

    /// Returns the number of finished loads.
    pub fn count(&self) -> usize {
        self.loads.len()
    }
}

fn save_outcome(out: &mut dyn Write, outcome: &Outcome) -> io::Result<()> {
    let stop = STOPS.iter().position(|stop| *stop == outcome.stop);
    write_whole(out, stop.expect("the list has all values"))?;
    write_whole(out, outcome.pairs as usize)?;
    write_whole(out, outcome.contact_nodes)?;
    write_whole(out, outcome.saturated_nodes)?;
    write_real(out, outcome.residual)?;
    write_real(out, outcome.mean_gap)?;
    write_real(out, outcome.yielded_depth)?;
    write_real(out, outcome.energy)?;
    write_real(out, outcome.peak_pressure)
}

fn read_outcome(from: &mut &[u8]) -> io::Result<Outcome> {
    let stop = STOPS.get(read_whole(from)?).copied();
    Ok(Outcome {
        stop: stop.ok_or(io::ErrorKind::InvalidData)?,
        pairs: read_whole(from)? as u32,
        contact_nodes: read_whole(from)?,
        saturated_nodes: read_whole(from)?,
        residual: read_real(from)?,
        mean_gap: read_real(from)?,
        yielded_depth: read_real(from)?,
        energy: read_real(from)?,
        peak_pressure: read_real(from)?,
    })
}

pub fn write_whole(out: &mut dyn Write, number: usize) -> io::Result<()> {
    out.write_all(&(number as u64).to_le_bytes())
}

pub fn write_real(out: &mut dyn Write, number: f64) -> io::Result<()> {
    out.write_all(&number.to_le_bytes())
}

pub fn read_whole(from: &mut &[u8]) -> io::Result<usize> {
    let mut bytes = [0; 8];
    from.read_exact(&mut bytes)?;
    Ok(u64::from_le_bytes(bytes) as usize)
}

pub fn read_real(from: &mut &[u8]) -> io::Result<f64> {
    let mut bytes = [0; 8];
    from.read_exact(&mut bytes)?;
    Ok(f64::from_le_bytes(bytes))
}
