//! Distributions and flows, which are computed from the maps of pressures and gaps under each load.
//! The solver holds these maps only until the next load.
//!
//! The maps are not stored: pressures and gaps are counted in bins, and the flow through the gap is
//! computed. The flow is a key of `solve` and not of `measure`, because the gaps of 56 loads at
//! 512² would take 0.1 GB per surface. Stored pressures would take as much memory, and the gap
//! would still take a pair of transforms per load.

use std::io::{self, Write};

use arrow::array::{ArrayRef, Float64Array};

use super::solved::{read_real, read_whole, write_real, write_whole};
use crate::columns::*;
use asperity_contact::distribution::EqualBins;
use asperity_contact::flow::{Flow, Unconverged, flow_through_interruptible};
use asperity_contact::grid::Grid;
use asperity_contact::solver::Watch;
use asperity_tables::column::{Column, lists, optional_reals, reals, texts};

/// Counts of pressures and gaps in bins. Each of the two is counted only if requested.
#[derive(Default)]
pub struct Distributions {
    pressures: Option<Counted>,
    gaps: Option<Counted>,
    /// Root mean square height in the unit of the solver's gaps.
    rms_height: f64,
}

/// Bins with their counts under each load.
struct Counted {
    bins: EqualBins,
    /// Concatenated counts of all loads: for each load the counts of all bins, then the count above
    /// all bins.
    counts: Vec<f64>,
}

impl Distributions {
    /// Creates empty counts for a surface with these heights in the solver's unit.
    pub fn new(
        pressures: Option<EqualBins>,
        gaps: Option<EqualBins>,
        heights: &[f64],
    ) -> Distributions {
        let counted = |bins| Counted { bins, counts: Vec::new() };
        Distributions {
            pressures: pressures.map(counted),
            gaps: gaps.map(counted),
            rms_height: gaps.map_or(1.0, |_| rms(heights)),
        }
    }

    /// Counts the pressures of a load, if they are requested.
    pub fn count_pressures(&mut self, pressures: &[f64]) {
        if let Some(counted) = &mut self.pressures {
            let in_contact = pressures.iter().filter(|pressure| **pressure > 0.0);
            counted.add(in_contact.copied());
        }
    }

    /// Returns whether gaps are counted.
    pub fn counts_gaps(&self) -> bool {
        self.gaps.is_some()
    }

    /// Counts the gaps of a load, if they are requested.
    pub fn count_gaps(&mut self, gap: &[f64], pressures: &[f64]) {
        if let Some(gaps) = &mut self.gaps {
            let apart = gap.iter().zip(pressures).filter(|(_, p)| **p == 0.0);
            gaps.add(apart.map(|(gap, _)| gap.max(0.0) / self.rms_height));
        }
    }

    /// Moves the counts into columns.
    pub fn columns(&mut self) -> Vec<(Column, ArrayRef)> {
        let pressures = self.pressures.take().map(|counted| (PRESSURE_COUNTS, counted));
        let gaps = self.gaps.take().map(|counted| (GAP_COUNTS, counted));
        let columns = pressures.into_iter().chain(gaps);
        columns.map(|(column, counted)| (column, counted.lists())).collect()
    }

    /// Writes the counts to a checkpoint.
    pub fn save(&self, out: &mut dyn Write) -> io::Result<()> {
        for counted in self.pressures.iter().chain(&self.gaps) {
            write_whole(out, counted.counts.len())?;
            counted.counts.iter().try_for_each(|count| write_real(out, *count))?;
        }
        Ok(())
    }

    /// Reads counts that [`Distributions::save`] has written for the same bins.
    pub fn restore(&mut self, from: &mut &[u8]) -> io::Result<()> {
        for counted in self.pressures.iter_mut().chain(&mut self.gaps) {
            for _ in 0..read_whole(from)? {
                counted.counts.push(read_real(from)?);
            }
        }
        Ok(())
    }
}

impl Counted {
    fn add(&mut self, values: impl Iterator<Item = f64>) {
        let counts = self.bins.counts(values);
        let each = counts.bins.into_iter().chain([counts.beyond]);
        self.counts.extend(each.map(|count| count as f64));
    }

    fn lists(self) -> ArrayRef {
        let length = self.bins.count as usize + 1;
        let loads = self.counts.len() / length;
        lists(Float64Array::from(self.counts), std::iter::repeat_n(length, loads))
    }
}

/// Returns the root mean square of the heights about their mean, or 1 for a flat surface.
fn rms(heights: &[f64]) -> f64 {
    let nodes = heights.len() as f64;
    let mean = heights.iter().sum::<f64>() / nodes;
    let squares: f64 = heights.iter().map(|height| (height - mean).powi(2)).sum();
    if squares > 0.0 { (squares / nodes).sqrt() } else { 1.0 }
}

/// Flows along x and y under each load, in the solver's unit of length.
pub struct Flows {
    grid: Grid,
    found: Vec<[Result<Flow, Unconverged>; 2]>,
}

impl Flows {
    /// Creates an empty list of flows on a grid.
    pub fn new(grid: Grid) -> Flows {
        Flows { grid, found: Vec::new() }
    }

    /// Computes the flows of the next load, or returns `None` on interruption. Nodes in contact are
    /// closed, even if their gap is positive within the tolerance.
    pub fn compute(&mut self, gap: &[f64], pressures: &[f64], watch: &dyn Watch) -> Option<()> {
        let open = gap.iter().zip(pressures);
        let open = open.map(|(gap, pressure)| if *pressure > 0.0 { 0.0 } else { *gap });
        let open: Vec<f64> = open.collect();
        let found = flow_through_interruptible(self.grid, &open, &|| watch.is_interrupted())?;
        self.found.push(found);
        Some(())
    }

    /// Returns the columns of the flows. `mean_gaps` are in the solver's unit of length, which is
    /// `length` in the user's unit.
    pub fn columns(&self, mean_gaps: &[f64], length: f64) -> Vec<(Column, ArrayRef)> {
        let value = |axis: usize, unit: &dyn Fn(usize) -> f64| {
            let loads = self.found.iter().enumerate();
            optional_reals(loads.map(|(load, flows)| {
                let flow = flows[axis].ok()?;
                Some(if flow.conductivity > 0.0 { flow.conductivity * unit(load) } else { 0.0 })
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

    /// Writes the flows to a checkpoint. The number of flows is omitted, because it equals the
    /// number of loads.
    pub fn save(&self, out: &mut dyn Write) -> io::Result<()> {
        for flow in self.found.iter().flatten() {
            write_real(out, flow.map_or(-1.0, |flow| flow.conductivity))?;
            write_real(out, residual(flow))?;
        }
        Ok(())
    }

    /// Reads flows that [`Flows::save`] has written for this number of loads.
    pub fn restore(&mut self, loads: usize, from: &mut &[u8]) -> io::Result<()> {
        let mut read = || -> io::Result<Result<Flow, Unconverged>> {
            let (conductivity, residual) = (read_real(from)?, read_real(from)?);
            Ok(if conductivity >= 0.0 {
                Ok(Flow { conductivity, residual })
            } else {
                Err(Unconverged { residual })
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

/// Returns the code of a load in the column `flow_stop`.
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

    /// Returns the flows of three loads: with channels along x, sealed, and not converged.
    fn flows() -> Flows {
        let mut flows = Flows::new(Grid::square(8, 1.0).unwrap());
        let channels: Vec<f64> = (0..64).map(|node| f64::from(node % 2)).collect();
        let walls: Vec<f64> = channels.iter().map(|gap| 1.0 - gap).collect();
        for (gap, pressures) in [(&channels, &walls), (&vec![0.5; 64], &vec![1.0; 64])] {
            flows.compute(gap, pressures, &|| false).unwrap();
        }
        flows.found.push([Err(Unconverged { residual: 0.1 }); 2]);
        flows
    }

    #[test]
    fn flows_are_restored_from_a_checkpoint() {
        let flows = flows();
        let mut bytes = Vec::new();
        flows.save(&mut bytes).unwrap();
        let mut again = Flows::new(flows.grid);
        again.restore(3, &mut bytes.as_slice()).unwrap();
        assert_eq!(flows.found, again.found);
        assert!(Flows::new(flows.grid).restore(4, &mut bytes.as_slice()).is_err());
    }

    #[test]
    fn flows_are_null_without_convergence_and_zero_without_a_channel() {
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
