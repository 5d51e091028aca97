//! Warning about meshes that are too coarse for the contact area.

use crate::study::{Stage, Study, multilevel};
use asperity_mechanics::topography::shapes::Shape;
use asperity_stages::fit::laws::{Law, PlainLaw};
use asperity_stages::surface::planned::PlannedSurfaces;
use asperity_stages::surface::{Origin, Params};
use asperity_stages::{Recipe, measure};

/// Minimum number of nodes per shortest wavelength without a warning about the contact area.
///
/// The table lists the relative mesh error of the contact area in per cent, for surfaces with
/// H = 0.8 on 64² … 2048² nodes. The error is the difference from the area extrapolated to an
/// infinitely fine mesh, averaged over 16 surfaces. It is given for counted areas at two cutoff
/// ranges, and (k = 4 … 32/k = 8 … 32) for areas corrected with the coefficient of 2017.
///
/// | nodes per shortest wavelength | | 2 | 3 | 4 | 6 | 8 | 16 | 32 |
/// |---|---|---|---|---|---|---|---|---|
/// | load 0.06 | k = 4 … 32 | 29 | 18 | 13 | 8.5 | 6.4 | 3.2 | 1.6 |
/// | | k = 8 … 32 | 41 | 25 | 18 | 12 | 8.8 | 4.3 | 2.2 |
/// | | corrected | 0.4/1.6 |−1.2/−1.9|−1.5/−2.3|−1.4/−1.7|−1.0/−1.3|−0.5/−0.7|−0.2/−0.3|
/// | load 0.01 | k = 4 … 32 | 45 | 27 | 19 | 13 | 9.2 | 4.5 | 2.3 |
/// | | k = 8 … 32 | 73 | 42 | 29 | 19 | 14 | 6.8 | 3.4 |
/// | | corrected | 2.4/8.1 |−1.8/−1.0|−2.6/−2.6|−1.6/−2.6|−1.4/−1.9|−0.7/−1.0|−0.3/−0.5|
///
/// With fewer than 8 nodes, the error is 10 % or more under small loads. Contact areas of different
/// spectra differ by as much.
const ENOUGH: f64 = 8.0;
/// Minimum number of nodes per shortest wavelength without a warning about corrected areas. Their
/// mesh error is at most 3 % with this number or more, and up to 12 % with fewer nodes.
const ENOUGH_CORRECTED: f64 = 3.0;
/// Minimum number of nodes per shortest wavelength on the coarsest mesh of multilevel means without
/// a warning. The variance of the difference of corrected areas to a mesh of twice the nodes, over
/// the variance between surfaces, was 0.46 and 0.55 at 2 nodes per wavelength, and 0.17 and 0.07 at
/// 4 nodes (H = 0.8, k = 4 … 16, loads 0.02 and 0.1). A mesh pays if it is below about 1/4.
const ENOUGH_FOR_LEVELS: f64 = 3.0;
/// Lower and upper estimate of the mesh error of the contact area at load 0.06, in per cent × nodes
/// per shortest wavelength. Divide by the nodes per wavelength to get per cent.
const MESH_ERROR_RANGE: [f64; 2] = [50.0, 80.0];

/// Shortest wavelength of a surface, and its resolution by the mesh.
#[derive(Debug, Clone, Copy)]
struct ShortestWave {
    nodes: [usize; 2],
    key: &'static str,
    wavenumber: u32,
    /// Number of nodes per wavelength, along the axis on which it is smaller.
    resolution: f64,
    /// True if the cells are square, so that counted areas can be corrected.
    has_square_cells: bool,
}

impl ShortestWave {
    /// Returns the shortest wavelength of a generated surface. Returns `None` for measured
    /// surfaces, for shapes without waves, and for surfaces that have yielded, whose mesh is that
    /// of the surfaces before.
    fn from_params(params: &Params) -> Option<ShortestWave> {
        let grid = params.grid().ok()?;
        let steps = grid.larger_steps();
        let [along_x, along_y] = params.nodes().map(|nodes| nodes as f64);
        let (nodes, key, wavenumber) = match &params.origin {
            Origin::Random { surface, .. } => (steps, "k_upper", surface.spectrum.k_upper),
            Origin::Shape { shape, .. } => match *shape {
                Shape::Wave { waves, .. } => (along_x, "waves", waves),
                Shape::WaveProduct { waves, .. } | Shape::WaveSum { waves, .. } => {
                    (along_x.min(along_y), "waves", waves)
                }
                Shape::Paraboloid { .. } | Shape::Punch { .. } => return None,
            },
            Origin::Pair(pair) => {
                let bodies = [&pair.body, &pair.against];
                let waves =
                    bodies.into_iter().filter_map(|params| ShortestWave::from_params(params));
                return waves.min_by(|one, other| one.resolution.total_cmp(&other.resolution));
            }
            Origin::Spectrum { .. } | Origin::File(_) | Origin::Yielded(_) => return None,
        };
        Some(ShortestWave {
            nodes: params.nodes(),
            key,
            wavenumber,
            resolution: nodes / f64::from(wavenumber),
            has_square_cells: grid.has_square_cells(),
        })
    }

    /// Formats the value of `nodes` for a mesh that is finer by the factor `finer` along both axes.
    fn mesh(&self, finer: f64) -> String {
        let [x, y] = self.nodes.map(|nodes| (nodes as f64 * finer - 1e-6).ceil());
        if x == y { format!("{x}") } else { format!("[{x}, {y}]") }
    }
}

impl Study {
    /// Warns of the coarsest mesh of a `generate` stage if this mesh causes a large error of the
    /// contact area.
    pub(super) fn coarse_mesh(&self, index: usize, stage: &Stage) -> Option<String> {
        let measured = self.measured_meshes(index, stage.work.surfaces());
        let enough = if self.is_corrected(index)? { ENOUGH_CORRECTED } else { ENOUGH };
        let shortest = measured.iter().filter_map(|one| ShortestWave::from_params(&one.params));
        let mut waves: Vec<ShortestWave> =
            shortest.filter(|wave| wave.resolution < enough).collect();
        waves.sort_by(|one, other| one.resolution.total_cmp(&other.resolution));
        let (coarsest, others) = waves.split_first()?;
        let ShortestWave { key, wavenumber, .. } = *coarsest;
        let others = match others.len() {
            0 => String::new(),
            1 => format!(" (1 other parameter point also has fewer than {enough})"),
            more => format!(" ({more} other parameter points also have fewer than {enough})"),
        };
        let [least, most] = MESH_ERROR_RANGE.map(|added| added / coarsest.resolution);
        let nodes = coarsest.mesh(1.0);
        let finer = coarsest.mesh(enough / coarsest.resolution);
        let remedy = match (enough == ENOUGH, coarsest.has_square_cells) {
            (true, true) => format!(
                "add a `correct` stage to remove most of this error, or set `nodes = {finer}` to \
                 reduce it to 6 to 10 %"
            ),
            (true, false) => {
                format!("set `nodes = {finer}` to reduce this error to 6 to 10 %")
            }
            (false, _) => format!(
                "corrected areas keep an error of up to 12 %; with `nodes = {finer}` at most 3 % \
                 remain"
            ),
        };
        let resolution = (10.0 * coarsest.resolution).round() / 10.0;
        Some(format!(
            "`nodes = {nodes}` with `{key} = {wavenumber}` resolves the shortest wavelength with \
             only {resolution} nodes{others}; under a load of 0.06 this adds about {least:.0} to \
             {most:.0} % to the counted contact area, and more under lighter loads; {remedy}"
        ))
    }

    /// Warns of the coarsest mesh of multilevel means if it hardly resolves the surfaces.
    pub(super) fn coarse_levels(&self, index: usize, stage: &Stage) -> Option<String> {
        let surfaces = stage.work.surfaces().iter().filter(|_| self.is_of_levels(index));
        let shortest = surfaces.filter_map(|one| ShortestWave::from_params(&one.params));
        let wave = shortest.min_by(|one, other| one.resolution.total_cmp(&other.resolution))?;
        (wave.resolution < ENOUGH_FOR_LEVELS).then(|| {
            format!(
                "`nodes = {}` with `{} = {}` resolves the shortest wavelength with only {} nodes; \
                 differences of areas to the next finer mesh then vary about half as much as areas \
                 of surfaces, so that multilevel means of areas gain little from this mesh; begin \
                 with `nodes = {}`",
                wave.mesh(1.0),
                wave.key,
                wave.wavenumber,
                (10.0 * wave.resolution).round() / 10.0,
                wave.mesh(ENOUGH_FOR_LEVELS / wave.resolution),
            )
        })
    }

    /// Returns the surfaces of a stage on which quantities are measured: those on the finest mesh
    /// of each point if coarser meshes only serve multilevel means, and otherwise all.
    fn measured_meshes<'a>(
        &self,
        index: usize,
        ensembles: &'a [PlannedSurfaces],
    ) -> Vec<&'a PlannedSurfaces> {
        let ladders = self.is_of_levels(index).then(|| multilevel::ladders(ensembles.iter()));
        match ladders.flatten() {
            Some(ladders) => ladders.iter().filter_map(|ladder| Some(ladder.last()?.1)).collect(),
            None => ensembles.iter().collect(),
        }
    }

    /// Returns whether a stage with multilevel means depends on a stage.
    fn is_of_levels(&self, index: usize) -> bool {
        // Stages follow the stages that they read.
        let mut depends = vec![false; self.stages.len()];
        depends[index] = true;
        for (reader, stage) in self.stages.iter().enumerate().skip(index + 1) {
            depends[reader] = stage.inputs.iter().any(|&input| depends[input]);
        }
        let stages = self.stages.iter().zip(depends);
        stages.into_iter().any(|(stage, depends)| depends && multilevel::is_multilevel(&stage.work))
    }

    /// Returns whether all contact areas of the surfaces of a stage are corrected for the mesh or
    /// compared between meshes. Returns `None` if no contact of these surfaces is solved.
    fn is_corrected(&self, surfaces: usize) -> Option<bool> {
        let solved = self.readers(surfaces, |recipe| matches!(recipe, Recipe::Solve(_)));
        let counts =
            |recipe: &Recipe| matches!(recipe, Recipe::Measure(measure::Params::Contacts { .. }));
        let corrects = |recipe: &Recipe| match recipe {
            Recipe::Correct(params) => params.corrections.iter().any(|one| one.coefficient > 0.0),
            Recipe::Fit(fit) => fit.law == Law::Plain(PlainLaw::MeshConvergence),
            _ => false,
        };
        (!solved.is_empty()).then(|| {
            solved.iter().all(|&solved| {
                let counted = self.readers(solved, counts);
                let is_corrected = |&index: &usize| !self.readers(index, corrects).is_empty();
                !counted.is_empty() && counted.iter().all(is_corrected)
            })
        })
    }

    /// Returns the indices of the stages that read the stage `read` and have a recipe for which
    /// `does` is true.
    fn readers(&self, read: usize, does: impl Fn(&Recipe) -> bool) -> Vec<usize> {
        let stages = self.stages.iter().enumerate();
        let readers = stages.filter(|(_, stage)| {
            stage.inputs.contains(&read) && stage.work.recipes().iter().any(&does)
        });
        readers.map(|(index, _)| index).collect()
    }
}
