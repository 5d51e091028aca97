//! Histograms of pressures or gaps over the nodes of a map, with bins of equal width.

use serde::Serialize;

/// Bins of equal width from zero to an upper end.
///
/// ```
/// use asperity_mechanics::distribution::EqualBins;
///
/// let bins = EqualBins { count: 4, to: 2.0 };
/// let counts = bins.counts([0.0, 0.4, 0.5, 2.0, 2.5].into_iter());
/// assert_eq!(counts.bins, [2, 1, 0, 1]);
/// assert_eq!(counts.beyond, 1);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct EqualBins {
    /// Number of bins, at least one.
    pub count: u32,
    /// Upper end of the last bin, positive.
    pub to: f64,
}

/// Numbers of values in each bin and above the last bin, from [`EqualBins::counts`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Counts {
    /// Number of values in each bin, from the lowest bin to the highest.
    pub bins: Vec<u64>,
    /// Number of values above the last bin.
    pub beyond: u64,
}

impl EqualBins {
    /// Returns the width of a bin, `to`/`count`.
    #[inline]
    pub fn width(&self) -> f64 {
        self.to / f64::from(self.count)
    }

    /// Returns the lower end of bin `bin`. For `bin == count`, it is the upper end of the last bin.
    #[inline]
    pub fn edge(&self, bin: u32) -> f64 {
        if bin == self.count { self.to } else { f64::from(bin) * self.width() }
    }

    /// Counts non-negative values in the bins.
    ///
    /// A bin contains its lower end. The last bin also contains its upper end, as in
    /// `numpy.histogram`.
    pub fn counts(&self, values: impl Iterator<Item = f64>) -> Counts {
        let mut counts = Counts { bins: vec![0; self.count as usize], beyond: 0 };
        let per_value = 1.0 / self.width();
        for value in values {
            if value > self.to {
                counts.beyond += 1;
            } else {
                counts.bins[self.bin(value, per_value) as usize] += 1;
            }
        }
        counts
    }

    /// Returns the index of the bin that contains `value`.
    // Inlined because the generic `counts`, compiled in the calling crate, calls it for every node.
    #[inline]
    fn bin(&self, value: f64, per_value: f64) -> u32 {
        let last = self.count - 1;
        // Rounding of the product can give a neighbouring bin.
        let bin = ((value * per_value) as u32).min(last);
        if value < self.edge(bin) {
            bin - 1
        } else if bin < last && value >= self.edge(bin + 1) {
            bin + 1
        } else {
            bin
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_edge_lies_in_the_bin_above_it_but_for_the_last() {
        for count in [1, 3, 7, 10, 49, 1000] {
            let bins = EqualBins { count, to: 0.7 };
            let edges = (0..=count).map(|bin| bins.edge(bin));
            let mut expected = vec![1; count as usize];
            expected[count as usize - 1] += 1;
            assert_eq!(bins.counts(edges).bins, expected);
        }
    }

    #[test]
    fn values_next_to_an_edge_lie_on_their_side_of_it() {
        let bins = EqualBins { count: 30, to: 3.0 };
        for bin in 1..30 {
            let below = bins.counts([bins.edge(bin).next_down()].into_iter());
            assert_eq!(below.bins[bin as usize - 1], 1);
        }
        let beyond = bins.counts([3.0_f64.next_up()].into_iter());
        assert_eq!((beyond.bins.iter().sum::<u64>(), beyond.beyond), (0, 1));
    }
}
