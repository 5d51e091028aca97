//! What is found of the maps of pressures and gaps under each load, while the solver has them.
//!
//! None has to be kept: pressures and gaps are counted in bins, and the flow through the gap is solved
//! for. A key of `solve` asks for the flow and not one of `measure`: gaps of 56 loads at 512² are
//! 0.1 GB for each surface, and pressures that were kept for it would take as much and the same pair of
//! transforms.

use std::io::{self, Write};

use arrow::array::{ArrayRef, Float64Array};

use super::solved::{read_real, read_whole, real, whole};
use crate::columns::*;
use asperity_contact::distribution::EqualBins;
use asperity_contact::flow::{Flow, Unconverged, flow_unless};
use asperity_contact::grid::Grid;
use asperity_contact::solver::Watch;
use asperity_tables::column::{Column, lists, optional_reals, reals, texts};

/// Counts of pressures and of gaps, as far as they are asked for.
#[derive(Default)]
pub struct Distributions {
    pressures: Option<Counted>,
    gaps: Option<Counted>,
    /// In the unit of the solver's gaps.
    rms_height: f64,
}

/// Load after load, those in each bin and those beyond.
struct Counted {
    bins: EqualBins,
    counts: Vec<f64>,
}

impl Distributions {
    /// None counted yet, of a surface of these heights in the solver's unit.
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

    /// Counts the pressures that the solver has found under a load.
    pub fn count_pressures(&mut self, pressures: &[f64]) {
        if let Some(counted) = &mut self.pressures {
            let in_contact = pressures.iter().filter(|pressure| **pressure > 0.0);
            counted.add(in_contact.copied());
        }
    }

    /// Whether gaps are counted.
    pub fn counts_gaps(&self) -> bool {
        self.gaps.is_some()
    }

    /// Counts the gaps of a load, if they are counted.
    pub fn count_gaps(&mut self, gap: &[f64], pressures: &[f64]) {
        if let Some(gaps) = &mut self.gaps {
            let apart = gap.iter().zip(pressures).filter(|(_, p)| **p == 0.0);
            gaps.add(apart.map(|(gap, _)| gap.max(0.0) / self.rms_height));
        }
    }

    /// The columns of these counts.
    pub fn columns(&mut self) -> Vec<(Column, ArrayRef)> {
        let pressures = self.pressures.take().map(|counted| (PRESSURE_COUNTS, counted));
        let gaps = self.gaps.take().map(|counted| (GAP_COUNTS, counted));
        let columns = pressures.into_iter().chain(gaps);
        columns.map(|(column, counted)| (column, counted.lists())).collect()
    }

    /// Writes the counts so far.
    pub fn save(&self, out: &mut dyn Write) -> io::Result<()> {
        for counted in self.pressures.iter().chain(&self.gaps) {
            whole(out, counted.counts.len())?;
            counted.counts.iter().try_for_each(|count| real(out, *count))?;
        }
        Ok(())
    }

    /// Reads what [`Distributions::save`] wrote of the same bins.
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

/// Root mean square of heights about their mean; a flat surface counts as one of height 1.
fn rms(heights: &[f64]) -> f64 {
    let nodes = heights.len() as f64;
    let mean = heights.iter().sum::<f64>() / nodes;
    let squares: f64 = heights.iter().map(|height| (height - mean).powi(2)).sum();
    match squares > 0.0 {
        true => (squares / nodes).sqrt(),
        false => 1.0,
    }
}

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
    pub fn save(&self, out: &mut dyn Write) -> io::Result<()> {
        // As many as there are loads.
        for flow in self.found.iter().flatten() {
            real(out, flow.map_or(-1.0, |flow| flow.conductivity))?;
            real(out, residual(flow))?;
        }
        Ok(())
    }

    /// Reads what [`Flows::save`] wrote of so many loads.
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
