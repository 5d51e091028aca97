//! Contact area against load for all realizations of one parameter point, and windows of loads.

use std::fmt;

use super::FitError;

/// Relative tolerance at the ends of a window. It allows for rounding of loads that are multiples
/// of a step.
const WINDOW_SLACK: f64 = 1e-9;

/// Ratio of variance to squared mean below which a variance is only rounding error.
const LEAST_RELATIVE_VARIANCE: f64 = 1e-24;

/// Closed range of loads, in units of E* h′.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Lightest load of the window.
    pub from: f64,
    /// Heaviest load of the window.
    pub to: f64,
}

impl Window {
    /// Window that contains all loads.
    pub const ALL: Self = Self { from: 0.0, to: f64::INFINITY };

    /// Returns `true` if a load is in the window, including its ends.
    pub fn contains(self, load: f64) -> bool {
        load >= self.from * (1.0 - WINDOW_SLACK) && load <= self.to * (1.0 + WINDOW_SLACK)
    }
}

impl fmt::Display for Window {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "[{}, {}]", self.from, self.to)
    }
}

/// Area fractions of all realizations of one parameter point, under the same loads.
///
/// There is at least one surface and one load. Loads are positive and ascending, and all values are
/// finite. Create curves with all computed loads, and select loads with a [`Window`]: differences
/// at the ends of the window then also use the neighbouring loads outside it.
#[derive(Debug, Clone, PartialEq)]
pub struct Curves {
    loads: Vec<f64>,
    areas: Vec<Vec<f64>>,
}

impl Curves {
    /// Creates curves from loads and areas, indexed as `areas[surface][load]`.
    ///
    /// # Errors
    /// Fails if lengths differ or are zero, if loads are not positive and ascending, or if an area
    /// is not finite.
    pub fn new(loads: Vec<f64>, areas: Vec<Vec<f64>>) -> Result<Self, FitError> {
        let misshapen = areas.iter().map(Vec::len).find(|&length| length != loads.len());
        if areas.is_empty() || loads.is_empty() || misshapen.is_some() {
            let (surfaces, areas) = (areas.len(), misshapen.unwrap_or(0));
            return Err(FitError::Shape { surfaces, areas, loads: loads.len() });
        }
        let mut below = 0.0;
        for (position, &load) in loads.iter().enumerate() {
            if !(load > below && load.is_finite()) {
                return Err(FitError::Loads { position, load });
            }
            below = load;
        }
        for (surface, row) in areas.iter().enumerate() {
            if let Some(at) = row.iter().position(|area| !area.is_finite()) {
                return Err(FitError::Area { surface, load: loads[at], area: row[at] });
            }
        }
        Ok(Self { loads, areas })
    }

    /// Returns the loads in ascending order.
    pub fn loads(&self) -> &[f64] {
        &self.loads
    }

    /// Returns the number of realizations.
    pub fn surfaces(&self) -> usize {
        self.areas.len()
    }

    /// Returns the area fractions at the loads inside a window.
    pub fn area_data(&self, window: Window) -> Data {
        self.data(window, self.loads.iter().enumerate().map(|(i, &load)| (load, i)), |row, i| {
            row[i]
        })
    }

    /// Returns the difference quotients Δa/Δy between neighbouring loads with midpoints inside a
    /// window.
    ///
    /// The first interval of the curves begins at the origin, with zero area. The quotient of the
    /// mean curve is the mean of the quotients of the surfaces.
    pub fn slope_data(&self, window: Window) -> Data {
        let loads = &self.loads;
        let below = |i: usize| if i == 0 { 0.0 } else { loads[i - 1] };
        self.data(window, (0..loads.len()).map(|i| (0.5 * (below(i) + loads[i]), i)), |row, i| {
            let area_below = if i == 0 { 0.0 } else { row[i - 1] };
            (row[i] - area_below) / (loads[i] - below(i))
        })
    }

    fn data(
        &self,
        window: Window,
        located: impl Iterator<Item = (f64, usize)>,
        value: impl Fn(&[f64], usize) -> f64,
    ) -> Data {
        let (loads, at): (Vec<f64>, Vec<usize>) =
            located.filter(|&(load, _)| window.contains(load)).unzip();
        let rows =
            self.areas.iter().map(|row| at.iter().map(|&i| value(row, i)).collect()).collect();
        Data { window, loads, rows }
    }
}

/// Values of one quantity for each surface at the loads inside a window.
#[derive(Debug, Clone, PartialEq)]
pub struct Data {
    /// Window that selected the loads.
    pub window: Window,
    /// Load of each datum, in units of E* h′.
    pub loads: Vec<f64>,
    /// Values, indexed as `rows[surface][datum]`.
    rows: Vec<Vec<f64>>,
}

impl Data {
    /// Returns the number of realizations.
    pub fn surfaces(&self) -> usize {
        self.rows.len()
    }

    /// Returns the mean over the surfaces at each load, in the order of the loads.
    pub fn mean(&self) -> Vec<f64> {
        self.weighted_mean(|_| 1.0)
    }

    /// Returns the mean over the surfaces at each load, where surface i counts `multiplicities[i]`
    /// times.
    pub fn resampled_mean(&self, multiplicities: &[u32]) -> Vec<f64> {
        self.weighted_mean(|surface| f64::from(multiplicities[surface]))
    }

    fn weighted_mean(&self, times: impl Fn(usize) -> f64) -> Vec<f64> {
        let mut sum = vec![0.0; self.loads.len()];
        let mut count = 0.0;
        for (surface, row) in self.rows.iter().enumerate() {
            let times = times(surface);
            count += times;
            sum.iter_mut().zip(row).for_each(|(sum, value)| *sum += times * value);
        }
        sum.iter_mut().for_each(|sum| *sum /= count);
        sum
    }

    /// Returns the unbiased variance over the surfaces at each load, or `None` for one surface.
    fn variance(&self) -> Option<Vec<f64>> {
        let freedom = self.rows.len().checked_sub(1).filter(|&freedom| freedom > 0)? as f64;
        let mean = self.mean();
        let mut sum = vec![0.0; mean.len()];
        for row in &self.rows {
            for ((sum, value), mean) in sum.iter_mut().zip(row).zip(&mean) {
                *sum += (value - mean).powi(2);
            }
        }
        Some(sum.into_iter().map(|sum| sum / freedom).collect())
    }

    /// Returns the weight of each datum in a fit: the inverse variance of the mean over the
    /// surfaces.
    ///
    /// Returns `None` for a single surface, or if a variance vanishes; a fit then uses equal
    /// weights.
    pub fn weights(&self) -> Option<Vec<f64>> {
        let surfaces = self.surfaces() as f64;
        self.variance()?
            .into_iter()
            .zip(self.mean())
            .map(|(variance, mean)| {
                (variance > LEAST_RELATIVE_VARIANCE * mean * mean).then(|| surfaces / variance)
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn three() -> Curves {
        let areas = vec![vec![0.2, 0.3, 0.35], vec![0.1, 0.25, 0.4], vec![0.3, 0.5, 0.6]];
        Curves::new(vec![0.1, 0.2, 0.4], areas).expect("well formed")
    }

    fn assert_close(left: &[f64], right: &[f64]) {
        assert_eq!(left.len(), right.len());
        // The tolerance allows for a few rounding errors of numbers of order one.
        assert!(left.iter().zip(right).all(|(l, r)| (l - r).abs() < 1e-14), "{left:?} {right:?}");
    }

    #[test]
    fn slope_of_the_mean_curve_is_the_mean_slope() {
        let (curves, data) = (three(), three().slope_data(Window::ALL));
        assert_close(&data.loads, &[0.05, 0.15, 0.3]);
        let mean = curves.area_data(Window::ALL).mean();
        let expected = [mean[0] / 0.1, (mean[1] - mean[0]) / 0.1, (mean[2] - mean[1]) / 0.2];
        assert_close(&data.mean(), &expected);
    }

    #[test]
    fn windowed_slopes_keep_their_neighbours_outside_the_window() {
        let all = three().slope_data(Window::ALL);
        let cut = three().slope_data(Window { from: 0.12, to: 0.2 });
        assert_eq!(cut.loads, all.loads[1..2]);
        assert_eq!(cut.mean(), all.mean()[1..2]);
    }

    #[test]
    fn window_includes_its_ends_in_spite_of_rounding() {
        let window = Window { from: 0.1, to: 0.3 };
        assert!(window.contains(0.1) && window.contains(3.0 * 0.1));
        assert!(!window.contains(0.3001) && !window.contains(0.0999));
    }

    #[test]
    fn equal_multiplicities_resample_to_the_mean() {
        let data = three().area_data(Window::ALL);
        assert_close(&data.resampled_mean(&[2, 2, 2]), &data.mean());
        assert_close(&data.resampled_mean(&[0, 3, 0]), &data.rows[1]);
    }

    #[test]
    fn weights_are_inverse_variances_of_the_mean() {
        let data = three().area_data(Window { from: 0.1, to: 0.1 });
        assert_close(&data.variance().expect("three surfaces"), &[0.01]);
        assert!((data.weights().expect("scattered")[0] - 300.0).abs() < 1e-10);
    }

    #[test]
    fn data_without_scatter_have_no_weights() {
        let single = Curves::new(vec![0.1], vec![vec![0.2]]).expect("well formed");
        assert_eq!(single.area_data(Window::ALL).weights(), None);
        let third = 1.0 / 3.0;
        let equal = Curves::new(vec![0.1], vec![vec![third]; 7]).expect("well formed");
        assert_eq!(equal.area_data(Window::ALL).weights(), None);
    }

    #[test]
    fn malformed_curves_are_refused() {
        let refused = |loads: &[f64], areas: &[&[f64]]| {
            Curves::new(loads.to_vec(), areas.iter().map(|row| row.to_vec()).collect()).unwrap_err()
        };
        assert!(matches!(refused(&[0.1], &[]), FitError::Shape { surfaces: 0, .. }));
        assert!(matches!(refused(&[0.1], &[&[0.1, 0.2]]), FitError::Shape { areas: 2, .. }));
        assert!(matches!(refused(&[0.0], &[&[0.0]]), FitError::Loads { position: 0, .. }));
        assert!(matches!(refused(&[0.2, 0.1], &[&[0.1; 2]]), FitError::Loads { position: 1, .. }));
        assert!(matches!(refused(&[0.2], &[&[f64::NAN]]), FitError::Area { surface: 0, .. }));
    }
}
