//! What flows through the gap under each load, found while the solver has the gap as a map.
//!
//! A key of `solve` asks for it and not one of `measure`: gaps are kept nowhere, those of 56 loads at 512²
//! are 0.1 GB for each surface, and pressures that were kept for it would take as much and the same
//! pair of transforms.

use std::io::{self, Write};

use arrow::array::ArrayRef;

use super::checkpoint::{read_real, real};
use crate::columns::*;
use asperity_contact::flow::{Flow, Unconverged, flow_unless};
use asperity_contact::grid::Grid;
use asperity_contact::solver::Watch;
use asperity_tables::column::{Column, optional_reals, reals, texts};

/// The flows along x and y, load after load, in the solver's unit of length.
pub struct Flows {
    grid: Grid,
    found: Vec<[Result<Flow, Unconverged>; 2]>,
}

impl Flows {
    /// None yet.
    pub fn on(grid: Grid) -> Flows {
        Flows { grid, found: Vec::new() }
    }

    /// Finds those of the next load, unless it is told to stop. What is in contact is closed, whatever the
    /// gap there.
    pub fn find(&mut self, gap: &[f64], pressures: &[f64], watch: &dyn Watch) -> Option<()> {
        let open = gap.iter().zip(pressures);
        let open = open.map(|(gap, pressure)| if *pressure > 0.0 { 0.0 } else { *gap });
        let open: Vec<f64> = open.collect();
        let found = flow_unless(self.grid, &open, &|| watch.is_interrupted())?;
        self.found.push(found);
        Some(())
    }

    /// The columns of these flows, beside the mean gaps, in units of so much.
    pub fn columns(&self, mean_gaps: &[f64], length: f64) -> Vec<(Column, ArrayRef)> {
        let value = |axis: usize, unit: &dyn Fn(usize) -> f64| {
            let loads = self.found.iter().enumerate();
            optional_reals(loads.map(|(load, flows)| {
                let flow = flows[axis].ok()?;
                Some(match flow.conductivity > 0.0 {
                    true => flow.conductivity * unit(load),
                    false => 0.0,
                })
            }))
        };
        let factor = |load: usize| mean_gaps[load].powi(-3);
        let cubed = |_| length.powi(3);
        vec![
            (FLOW_FACTOR_X, value(0, &factor)),
            (FLOW_FACTOR_Y, value(1, &factor)),
            (FLOW_CONDUCTIVITY_X, value(0, &cubed)),
            (FLOW_CONDUCTIVITY_Y, value(1, &cubed)),
            (FLOW_RESIDUAL, reals(self.found.iter().map(larger_residual))),
            (FLOW_STOP, texts(self.found.iter().map(stop_name))),
        ]
    }

    /// Writes the flows so far.
    ///
    /// # Errors
    /// When nothing can be written.
    pub fn save(&self, out: &mut dyn Write) -> io::Result<()> {
        // As many as there are loads.
        for flow in self.found.iter().flatten() {
            real(out, flow.map_or(-1.0, |flow| flow.conductivity))?;
            real(out, residual(flow))?;
        }
        Ok(())
    }

    /// Reads what [`Flows::save`] wrote of so many loads.
    ///
    /// # Errors
    /// When these are not such bytes.
    pub fn restore(&mut self, loads: usize, from: &mut &[u8]) -> io::Result<()> {
        let mut read = || -> io::Result<Result<Flow, Unconverged>> {
            let (conductivity, residual) = (read_real(from)?, read_real(from)?);
            Ok(match conductivity >= 0.0 {
                true => Ok(Flow { conductivity, residual }),
                false => Err(Unconverged { residual }),
            })
        };
        for _ in 0..loads {
            let flows = [read()?, read()?];
            self.found.push(flows);
        }
        Ok(())
    }
}

fn residual(flow: &Result<Flow, Unconverged>) -> f64 {
    match flow {
        Ok(flow) => flow.residual,
        Err(unconverged) => unconverged.residual,
    }
}

fn larger_residual(flows: &[Result<Flow, Unconverged>; 2]) -> f64 {
    residual(&flows[0]).max(residual(&flows[1]))
}

/// The word in the `flow_stop` column.
fn stop_name(flows: &[Result<Flow, Unconverged>; 2]) -> &'static str {
    let is_closed =
        |flow: &Result<Flow, Unconverged>| flow.is_ok_and(|flow| flow.conductivity == 0.0);
    match flows {
        flows if flows.iter().any(Result::is_err) => "iteration-limit",
        flows if flows.iter().all(is_closed) => "no-channel",
        _ => "converged",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A load with channels along x, one with none, and one that was not found.
    fn flows() -> Flows {
        let mut flows = Flows::on(Grid::square(8, 1.0).unwrap());
        let channels: Vec<f64> = (0..64).map(|node| f64::from(node % 2)).collect();
        let walls: Vec<f64> = channels.iter().map(|gap| 1.0 - gap).collect();
        for (gap, pressures) in [(&channels, &walls), (&vec![0.5; 64], &vec![1.0; 64])] {
            flows.find(gap, pressures, &|| false).unwrap();
        }
        flows.found.push([Err(Unconverged { residual: 0.1 }); 2]);
        flows
    }

    #[test]
    fn flows_go_through_a_checkpoint() {
        let flows = flows();
        let mut bytes = Vec::new();
        flows.save(&mut bytes).unwrap();
        let mut again = Flows::on(flows.grid);
        again.restore(3, &mut bytes.as_slice()).unwrap();
        assert_eq!(flows.found, again.found);
        assert!(Flows::on(flows.grid).restore(4, &mut bytes.as_slice()).is_err());
    }

    #[test]
    fn what_was_not_found_is_null_and_what_is_closed_is_zero() {
        use arrow::array::{Array, AsArray};
        use arrow::datatypes::Float64Type;
        let columns = flows().columns(&[0.5, 0.0, 0.1], 2.0);
        let named = |column: Column| {
            let found = columns.iter().find(|(other, _)| *other == column);
            found.unwrap().1.clone()
        };
        let along_x = named(FLOW_CONDUCTIVITY_X);
        let along_x = along_x.as_primitive::<Float64Type>();
        assert!((along_x.value(0) - 0.5 * 8.0).abs() < 1e-7);
        assert_eq!(along_x.value(1), 0.0);
        assert!(along_x.is_null(2));
        let factor = named(FLOW_FACTOR_X);
        assert!((factor.as_primitive::<Float64Type>().value(0) - 4.0).abs() < 1e-7);
        let stops = named(FLOW_STOP);
        let stops: Vec<_> = stops.as_string::<i32>().iter().flatten().collect();
        assert_eq!(stops, ["converged", "no-channel", "iteration-limit"]);
    }
}
