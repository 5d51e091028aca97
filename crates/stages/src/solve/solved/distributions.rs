//! How many nodes bear which pressure and how many stand how far apart, counted while the solver has
//! both as maps, so that none has to be kept.

use std::io::{self, Write};

use arrow::array::{ArrayRef, Float64Array};

use super::checkpoint::{read_real, read_whole, real, whole};
use crate::columns::{GAP_COUNTS, PRESSURE_COUNTS};
use asperity_contact::distribution::EqualBins;
use asperity_tables::column::{Column, lists};

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
    ///
    /// # Errors
    /// When nothing can be written.
    pub fn save(&self, out: &mut dyn Write) -> io::Result<()> {
        for counted in self.pressures.iter().chain(&self.gaps) {
            whole(out, counted.counts.len())?;
            counted.counts.iter().try_for_each(|count| real(out, *count))?;
        }
        Ok(())
    }

    /// Reads what [`Distributions::save`] wrote of the same bins.
    ///
    /// # Errors
    /// When these are not such bytes.
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
