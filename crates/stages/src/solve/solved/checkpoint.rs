//! A block of loads that is half done, as bytes: its rows so far, and the solver between two loads.

use std::io::{self, Read, Write};

use arrow::array::Array;

use super::Solved;
use asperity_contact::solver::{Outcome, Solver, Stop};

/// What these bytes are; another number for another order of them.
const FORMAT: &[u8; 8] = b"solve\0\0\x01";

const STOPS: [Stop; 4] = [Stop::Converged, Stop::FullContact, Stop::PairLimit, Stop::Interrupted];

impl Solved {
    /// Writes the rows so far, and the solver that goes on from them.
    ///
    /// # Errors
    /// When nothing can be written.
    pub fn save(&self, solver: &Solver, out: &mut dyn Write) -> io::Result<()> {
        out.write_all(FORMAT)?;
        whole(out, self.loads.len())?;
        for (row, outcome) in self.outcomes.iter().enumerate() {
            real(out, self.loads[row])?;
            save_outcome(out, outcome)?;
            whole(out, self.maps[row].len())?;
            out.write_all(&self.maps[row])?;
            whole(out, self.kept[row])?;
        }
        whole(out, self.displacements.len())?;
        self.displacements.iter().try_for_each(|value| real(out, *value))?;
        let pressures = self.pressures.finish_cloned();
        whole(out, pressures.len())?;
        for place in 0..pressures.len() {
            // Where nothing touches there is none, and no pressure is below zero.
            let value = pressures.is_valid(place).then(|| pressures.value(place));
            real(out, value.unwrap_or(-1.0))?;
        }
        self.distributions.save(out)?;
        if let Some(flows) = &self.flows {
            flows.save(out)?;
        }
        solver.save(out)
    }

    /// Makes a new solver and rows that are none yet what they were.
    ///
    /// # Errors
    /// When these are not bytes of [`Solved::save`]; solver and rows are of no use then.
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
            self.kept.push(read_whole(from)?);
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

    /// How many loads are done.
    pub fn count(&self) -> usize {
        self.loads.len()
    }
}

fn save_outcome(out: &mut dyn Write, outcome: &Outcome) -> io::Result<()> {
    let stop = STOPS.iter().position(|stop| *stop == outcome.stop);
    whole(out, stop.expect("all are there"))?;
    whole(out, outcome.pairs as usize)?;
    whole(out, outcome.contact_nodes)?;
    whole(out, outcome.saturated_nodes)?;
    real(out, outcome.residual)?;
    real(out, outcome.mean_gap)?;
    real(out, outcome.yielded_depth)?;
    real(out, outcome.energy)?;
    real(out, outcome.peak_pressure)
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

pub fn whole(out: &mut dyn Write, number: usize) -> io::Result<()> {
    out.write_all(&(number as u64).to_le_bytes())
}

pub fn real(out: &mut dyn Write, number: f64) -> io::Result<()> {
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
