//! Error of the contact area due to the mesh, from one surface under one load on several meshes.
//!
//! On a mesh of N nodes, the solved contact area A_N is too large in proportion to its edge S_d Δx,
//! with the Manhattan perimeter S_d and the mesh step Δx: A_N = A* + c S_d Δx. A line through A_N
//! against S_d Δx extrapolates to the area A* on an infinitely fine mesh. Its slope c is the
//! coefficient of the area correction.

use super::FitError;
use super::bootstrap::{Bootstrap, Estimate, Intervals};
use super::least_squares::line;

/// Minimum number of meshes. A line through two points would have no residuals.
const LEAST_MESHES: usize = 3;

/// Contact areas and edges S_d Δx of one surface under one load on several meshes.
#[derive(Debug, Clone, PartialEq)]
pub struct Refinement {
    /// S_d Δx on each mesh, divided by the nominal area.
    edges: Vec<f64>,
    /// Area fraction on each mesh, without correction.
    areas: Vec<f64>,
}

/// Line A_N = A* + c S_d Δx fitted to one surface under one load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MeshLimit {
    /// Area fraction A* extrapolated to an infinitely fine mesh.
    pub area: f64,
    /// Coefficient c of the edge S_d Δx.
    pub coefficient: f64,
}

impl Refinement {
    /// Creates a refinement from S_d Δx (as a fraction of the nominal area) and the area fraction
    /// on each mesh.
    ///
    /// # Errors
    /// Fails if there are fewer than three meshes, if there is no contact on one of them, or if S_d
    /// Δx is the same on all.
    pub fn new(edges: Vec<f64>, areas: Vec<f64>) -> Result<Self, FitError> {
        if areas.len() < LEAST_MESHES {
            return Err(FitError::TooFewMeshes);
        }
        let equal = edges.iter().all(|&edge| edge == edges[0]);
        if equal || areas.iter().any(|&area| area <= 0.0) {
            return Err(FitError::NoEdges);
        }
        Ok(Self { edges, areas })
    }

    /// Returns the number of meshes of this refinement.
    pub fn meshes(&self) -> usize {
        self.areas.len()
    }

    /// Fits the line A_N = A* + c S_d Δx by least squares.
    pub fn fit(&self) -> MeshLimit {
        let (coefficient, area) =
            line(&self.edges, &self.areas).expect("the edges of a refinement differ");
        MeshLimit { area, coefficient }
    }

    /// Returns the least-squares limit A* for a given coefficient c: mean(A_N) − c mean(S_d Δx).
    fn limit(&self, coefficient: f64) -> f64 {
        mean(&self.areas) - coefficient * mean(&self.edges)
    }

    /// Iterates over the relative errors (A_N − c S_d Δx)/A* − 1 of the corrected areas, with
    /// c = `coefficient` and A* = `limit`.
    fn errors(&self, coefficient: f64, limit: f64) -> impl Iterator<Item = f64> {
        let corrected = self.areas.iter().zip(&self.edges);
        corrected.map(move |(area, edge)| (area - coefficient * edge) / limit - 1.0)
    }

    /// Returns Σ (e − ē)(A − Ā)/Ā² and Σ (e − ē)²/Ā² over the meshes, with the area A = A_N and the
    /// edge e = S_d Δx.
    ///
    /// The division by Ā² gives light and heavy loads equal weights.
    fn moments(&self) -> (f64, f64) {
        let (edge, area) = (mean(&self.edges), mean(&self.areas));
        let pairs = self.edges.iter().zip(&self.areas);
        let sums = pairs.fold((0.0, 0.0), |(covariance, variance), (e, a)| {
            (covariance + (e - edge) * (a - area), variance + (e - edge).powi(2))
        });
        (sums.0 / (area * area), sums.1 / (area * area))
    }
}

/// Refinements of several surfaces, each under one or several loads, to which a common coefficient
/// c is fitted.
#[derive(Debug, Clone)]
pub struct MeshProblem<'a> {
    surfaces: Vec<Vec<&'a Refinement>>,
}

impl<'a> MeshProblem<'a> {
    /// Creates a problem from the refinements of each surface; there is at least one surface.
    pub fn new(surfaces: Vec<Vec<&'a Refinement>>) -> Self {
        Self { surfaces }
    }

    /// Returns the common coefficient c, fitted with a separate limit A* for each surface and load.
    pub fn coefficient(&self) -> f64 {
        self.pooled(&vec![1; self.surfaces.len()])
    }

    /// Returns the mean over surfaces and loads of the limits A* for a given coefficient c.
    pub fn mean_limit(&self, coefficient: f64) -> f64 {
        let limits: Vec<f64> = self.all().map(|one| one.limit(coefficient)).collect();
        mean(&limits)
    }

    /// Returns the rms relative error of the areas corrected with the coefficient `correction`.
    ///
    /// The reference of each surface and load is its limit A* with the [fitted
    /// coefficient](Self::coefficient).
    pub fn rms_error(&self, correction: f64) -> f64 {
        let fitted = self.coefficient();
        let errors = self.all().flat_map(|one| one.errors(correction, one.limit(fitted)));
        let squares: Vec<f64> = errors.map(|error| error * error).collect();
        mean(&squares).sqrt()
    }

    /// Returns the number of data points: one area for each surface, load and mesh.
    pub fn data(&self) -> usize {
        self.all().map(Refinement::meshes).sum()
    }

    /// Computes the confidence interval of the common coefficient c by resampling whole surfaces.
    pub fn bootstrap(&self, bootstrap: &Bootstrap) -> Intervals {
        let every = vec![1; self.surfaces.len()];
        let estimates = [Estimate::Real(self.pooled(&every))];
        bootstrap.intervals(self.surfaces.len(), &estimates, |multiplicities| {
            Ok(vec![self.pooled(multiplicities)])
        })
    }

    fn all(&self) -> impl Iterator<Item = &Refinement> {
        self.surfaces.iter().flatten().copied()
    }

    /// Returns, for each surface, Σ (e − ē)(A − Ā)/Ā² and Σ (e − ē)²/Ā² over its loads and meshes,
    /// with the area A = A_N and the edge e = S_d Δx.
    ///
    /// The common coefficient is the sum of the first numbers divided by the sum of the second
    /// ones.
    pub fn moments(&self) -> Vec<(f64, f64)> {
        let of_surface = |surface: &Vec<&Refinement>| {
            let moments = surface.iter().map(|one| one.moments());
            moments.fold((0.0, 0.0), |sum, one| (sum.0 + one.0, sum.1 + one.1))
        };
        self.surfaces.iter().map(of_surface).collect()
    }

    fn pooled(&self, multiplicities: &[u32]) -> f64 {
        let (mut covariance, mut variance) = (0.0, 0.0);
        for (surface, &times) in self.surfaces.iter().zip(multiplicities) {
            for one in surface {
                let moments = one.moments();
                covariance += f64::from(times) * moments.0;
                variance += f64::from(times) * moments.1;
            }
        }
        covariance / variance
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::normal;
    use asperity_mechanics::morphology::area::{PI_OVER_EIGHT, YASTREBOV_2017};

    const EDGES: [f64; 4] = [0.32, 0.17, 0.08, 0.04];

    /// Returns a refinement with the areas `limit` + `coefficient` × edge + `noise`.
    fn refinement(limit: f64, coefficient: f64, noise: &[f64]) -> Refinement {
        let areas = EDGES
            .iter()
            .enumerate()
            .map(|(i, edge)| limit + coefficient * edge + noise.get(i).unwrap_or(&0.0));
        Refinement::new(EDGES.to_vec(), areas.collect()).expect("well formed")
    }

    fn pooled(refinements: &[Refinement]) -> MeshProblem<'_> {
        MeshProblem::new(refinements.iter().map(|one| vec![one]).collect())
    }

    #[test]
    fn areas_on_a_line_give_their_limit_and_coefficient_exactly() {
        let fit = refinement(0.135, 0.104, &[]).fit();
        assert!((fit.area - 0.135).abs() < 1e-15);
        assert!((fit.coefficient - 0.104).abs() < 1e-14);
    }

    #[test]
    fn surfaces_share_a_coefficient_and_keep_their_limits() {
        let surfaces = [0.02, 0.135, 0.8].map(|limit| refinement(limit, 0.104, &[]));
        let problem = pooled(&surfaces);
        let found = problem.coefficient();
        assert!((found - 0.104).abs() < 1e-14);
        assert!((problem.mean_limit(found) - (0.02 + 0.135 + 0.8) / 3.0).abs() < 1e-15);
        assert_eq!(problem.data(), 12);
    }

    #[test]
    fn the_error_of_a_correction_is_proportional_to_the_edge() {
        let surfaces = [refinement(0.135, 0.104, &[])];
        let problem = pooled(&surfaces);
        let mean_square = EDGES.iter().map(|edge| edge * edge).sum::<f64>() / 4.0;
        for correction in [0.0, YASTREBOV_2017, PI_OVER_EIGHT] {
            let exact = (correction - 0.104).abs() * mean_square.sqrt() / 0.135;
            assert!((problem.rms_error(correction) - exact).abs() < 1e-13);
        }
        assert!(problem.rms_error(0.104) < 1e-13);
    }

    #[test]
    fn intervals_of_the_coefficient_cover_it_at_about_the_nominal_rate() {
        let bootstrap = Bootstrap { replicates: 300, seed: 7, level: 0.9 };
        let experiments = 200;
        let covered = (0..experiments).filter(|&experiment| {
            let noise = normal(experiment, 4 * 20);
            let surfaces: Vec<_> = noise
                .chunks(4)
                .map(|four| {
                    let four: Vec<f64> = four.iter().map(|z| 0.002 * z).collect();
                    refinement(0.135, 0.104, &four)
                })
                .collect();
            let intervals = pooled(&surfaces).bootstrap(&bootstrap).intervals;
            let interval = intervals.expect("no failures")[0];
            interval.lower <= 0.104 && 0.104 <= interval.upper
        });
        // The binomial error of 200 experiments is 0.021.
        let rate = covered.count() as f64 / f64::from(experiments as u32);
        assert!((rate - 0.9).abs() < 0.065, "covered {rate}");
    }

    #[test]
    fn two_meshes_and_equal_edges_are_no_refinement() {
        let two = Refinement::new(vec![0.2, 0.1], vec![0.14, 0.13]).unwrap_err();
        assert_eq!(two, FitError::TooFewMeshes);
        let full = Refinement::new(vec![0.0; 3], vec![1.0; 3]).unwrap_err();
        assert_eq!(full, FitError::NoEdges);
    }
}
