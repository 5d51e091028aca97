//! Where the gap stops percolating: the load, and the area of contact, from which on no channel leads
//! through the interface.
//!
//! Along one direction a surface passes from open to sealed once, between two of its loads, for contact
//! only grows; what is between them is the middle of both. A surface has one threshold along each of
//! its two directions, which are equally likely to be the earlier one on isotropic roughness: its own
//! threshold is the mean of both. Wang & Müser (2020) find 0.415 of the area on isotropic surfaces whose
//! longest waves are short beside the cell; smaller cells scatter about it.

use super::bootstrap::{Bootstrap, Estimate, Intervals};
use super::{FitError, Window};

/// One surface under one load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interface {
    /// In units of E* × rms slope.
    pub load: f64,
    /// Share of the nodes in contact.
    pub area: f64,
    /// The same, corrected for the mesh.
    pub area_corrected: f64,
    /// Whether the gap percolates along x, and along y.
    pub is_open: [bool; 2],
}

/// Where interfaces are sealed, mean of surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Threshold {
    /// Share of the nodes in contact.
    pub area: f64,
    /// The same, corrected for the mesh.
    pub area_corrected: f64,
    /// In units of E* × rms slope.
    pub load: f64,
}

/// Thresholds of surfaces.
#[derive(Debug, Clone)]
pub struct PercolationProblem {
    thresholds: Vec<Threshold>,
}

impl PercolationProblem {
    /// Takes the loads of each surface inside a window, ascending.
    ///
    /// # Errors
    /// When there is no surface, or one that is sealed under its lightest load, or still open under
    /// its heaviest: a mean over the others would be biased.
    pub fn new(surfaces: &[Vec<Interface>], window: Window) -> Result<Self, FitError> {
        let found: Vec<Option<Threshold>> = surfaces
            .iter()
            .map(|interfaces| Threshold::of_surface(interfaces, window))
            .collect();
        let without = found.iter().filter(|found| found.is_none()).count();
        if without > 0 || found.is_empty() {
            return Err(FitError::NotSealed {
                without,
                surfaces: surfaces.len(),
                window,
            });
        }
        Ok(Self {
            thresholds: found.into_iter().flatten().collect(),
        })
    }

    /// The mean over the surfaces.
    pub fn mean(&self) -> Threshold {
        self.resampled(&vec![1; self.thresholds.len()])
    }

    /// Intervals of the area, the corrected area and the load, in this order.
    pub fn bootstrap(&self, bootstrap: &Bootstrap) -> Intervals {
        let values = |threshold: Threshold| threshold.values().to_vec();
        let estimates: Vec<Estimate> = values(self.mean())
            .into_iter()
            .map(Estimate::Real)
            .collect();
        bootstrap.intervals(self.thresholds.len(), &estimates, |multiplicities| {
            Ok(values(self.resampled(multiplicities)))
        })
    }

    fn resampled(&self, multiplicities: &[u32]) -> Threshold {
        let weighted = self.thresholds.iter().zip(multiplicities);
        let weighted = weighted.map(|(threshold, times)| (*threshold, f64::from(*times)));
        Threshold::mean_of(weighted)
    }
}

impl Threshold {
    /// Area, corrected area and load.
    pub fn values(&self) -> [f64; 3] {
        [self.area, self.area_corrected, self.load]
    }

    fn of_surface(interfaces: &[Interface], window: Window) -> Option<Threshold> {
        let inside: Vec<&Interface> = interfaces
            .iter()
            .filter(|interface| window.contains(interface.load))
            .collect();
        let along = |axis: usize| {
            let sealed = inside.iter().position(|interface| !interface.is_open[axis]);
            let sealed = sealed.filter(|&sealed| sealed > 0)?;
            let around = [inside[sealed - 1], inside[sealed]];
            Some(Threshold::mean_of(around.into_iter().map(|interface| {
                let &Interface {
                    load,
                    area,
                    area_corrected,
                    ..
                } = interface;
                let threshold = Threshold {
                    area,
                    area_corrected,
                    load,
                };
                (threshold, 1.0)
            })))
        };
        let [along_x, along_y] = [along(0)?, along(1)?];
        Some(Threshold::mean_of(
            [(along_x, 1.0), (along_y, 1.0)].into_iter(),
        ))
    }

    fn mean_of(weighted: impl Iterator<Item = (Threshold, f64)>) -> Threshold {
        let (mut sums, mut weights) = ([0.0; 3], 0.0);
        for (threshold, weight) in weighted {
            for (sum, value) in sums.iter_mut().zip(threshold.values()) {
                *sum += weight * value;
            }
            weights += weight;
        }
        let [area, area_corrected, load] = sums.map(|sum| sum / weights);
        Threshold {
            area,
            area_corrected,
            load,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WINDOW: Window = Window {
        from: 0.0,
        to: 10.0,
    };

    /// Ten loads up to one, as much area, sealed along x and y from these loads on.
    fn surface(from: [f64; 2]) -> Vec<Interface> {
        let loads = (1..=10).map(|load| f64::from(load) / 10.0);
        let interface = |load: f64| Interface {
            load,
            area: 0.5 * load,
            area_corrected: 0.4 * load,
            is_open: from.map(|from| load < from),
        };
        loads.map(interface).collect()
    }

    #[test]
    fn the_threshold_lies_between_the_last_open_and_the_first_sealed_load() {
        let problem = PercolationProblem::new(&[surface([0.5, 0.8])], WINDOW).unwrap();
        let threshold = problem.mean();
        // Middles at 0.45 and 0.75.
        assert!((threshold.load - 0.6).abs() < 1e-15);
        assert!((threshold.area - 0.3).abs() < 1e-15);
        assert!((threshold.area_corrected - 0.24).abs() < 1e-15);
    }

    #[test]
    fn surfaces_weigh_the_same_and_equal_ones_have_no_interval_to_speak_of() {
        let surfaces = [[0.3, 0.3], [0.5, 0.5]].map(surface);
        let mean = PercolationProblem::new(&surfaces, WINDOW).unwrap().mean();
        assert!((mean.load - 0.35).abs() < 1e-15);
        let equal = [[0.3, 0.3]; 4].map(surface);
        let problem = PercolationProblem::new(&equal, WINDOW).unwrap();
        let bootstrap = Bootstrap {
            replicates: 50,
            seed: 1,
            level: 0.95,
        };
        for interval in problem.bootstrap(&bootstrap).intervals.unwrap() {
            assert!(interval.upper - interval.lower < 1e-12);
        }
    }

    #[test]
    fn a_surface_without_a_threshold_leaves_no_mean() {
        let open = PercolationProblem::new(&[surface([0.5, 0.8]), surface([0.5, 2.0])], WINDOW);
        let sealed = PercolationProblem::new(&[surface([0.5, 0.05])], WINDOW);
        let expected = |without, surfaces| FitError::NotSealed {
            without,
            surfaces,
            window: WINDOW,
        };
        assert_eq!(open.unwrap_err(), expected(1, 2));
        assert_eq!(sealed.unwrap_err(), expected(1, 1));
        let outside = Window { from: 0.0, to: 0.6 };
        assert!(PercolationProblem::new(&[surface([0.5, 0.8])], outside).is_err());
    }
}
