//! Warnings about surfaces: their files, and heights or sides in a wrong unit.

use crate::study::summary::rms_slope;
use crate::study::{Stage, Study};
use asperity_manifest::keys::quantity;
use asperity_stages::generate::plausibility::{EnteredMap, STEEP, reading_of};
use asperity_stages::surface::origin::MeasuredSurface;
use asperity_stages::surface::{Origin, Params};
use asperity_stages::surface_files::SurfaceFiles;

impl Study {
    /// Warns of random surfaces whose rms slope follows from lengths with a unit, and exceeds that
    /// of solid surfaces. A given `rms_slope` has no unit that could be wrong.
    pub(super) fn steep_surfaces(&self, stage: &Stage) -> Option<String> {
        stage.work.surfaces().iter().find_map(|ensemble| self.too_steep(&ensemble.params))
    }

    fn too_steep(&self, params: &Params) -> Option<String> {
        let Params { origin, .. } = params;
        let is_drawn = matches!(origin, Origin::Random { .. } | Origin::Spectrum { .. });
        if !is_drawn || origin.given_rms_slope().is_some() || origin.unit().is_empty() {
            return None;
        }
        let slope = rms_slope(params, &self.sources).filter(|slope| *slope > STEEP)?;
        let length = |length: f64| quantity::range([length].into_iter(), Some(origin.unit()));
        let given = match origin.given_rms_height() {
            Some(height) => format!("`rms_height` is {}", length(height)?),
            None => "the spectrum is given".to_owned(),
        };
        Some(format!(
            "{given} on a side of {}, which means an rms slope of about {}{}",
            length(params.size().into_iter().fold(0.0, f64::max))?,
            quantity::range([slope].into_iter(), None)?,
            reading_of(slope)
        ))
    }
}

/// Returns the warnings about the files of measured surfaces that a stage reads, without
/// duplicates: which channel was chosen, how many points are missing, whether the edges of a
/// periodic map match, whether the instrument resolved the slope, what the reader guessed, and
/// implausible slopes and sides.
pub fn file_warnings(stage: &Stage, sources: &SurfaceFiles) -> Vec<String> {
    let mut distinct: Vec<String> = Vec::new();
    for ensemble in stage.work.surfaces() {
        let Origin::File(file) = &ensemble.params.origin else {
            continue;
        };
        let Some(path) = sources.path_of(&file.content) else {
            continue;
        };
        let shown = path.display().to_string();
        let messages = [
            channel(file, &shown),
            suspect(file, &shown),
            holes(file, &shown),
            unmatched_edges(file, &shown),
            unresolved(file, &shown),
        ];
        let notes = file.seen.notes.iter().map(|note| format!("`{shown}`: {note}"));
        let implausible = implausible(file, &shown, ensemble.params.sides().is_some());
        for message in messages.into_iter().flatten().chain(notes).chain(implausible) {
            if !distinct.contains(&message) {
                distinct.push(message);
            }
        }
    }
    distinct
}

fn implausible(file: &MeasuredSurface, path: &str, has_given_sides: bool) -> Vec<String> {
    let (Some(grid), Some(rms_slope)) = (file.seen.file, file.seen.rms_slope) else {
        return vec![];
    };
    let map = EnteredMap {
        grid,
        unit: &file.unit,
        rms_slope,
        height_span: file.seen.height_span,
        has_given_sides,
    };
    map.warnings(&format!("`{path}`"))
}

fn channel(file: &MeasuredSurface, path: &str) -> Option<String> {
    let read = file.seen.channel.as_ref()?;
    let reason = read.reason.as_ref().filter(|_| read.of > 1)?;
    let (number, name, of) = (read.number, &read.name, read.of);
    Some(format!(
        "`{path}` has {of} channels; number {number}, `{name}`, is read, {reason}; set `channel = \
         {number}` to make this explicit"
    ))
}

fn suspect(file: &MeasuredSurface, path: &str) -> Option<String> {
    let suspect = file.seen.suspect?;
    let (number, count) = (suspect.number, suspect.count);
    Some(format!(
        "{count} points of `{path}` have the number {number:?}, far from all others; if it marks \
         points without a height, set `missing = {number:?}` and `fill`"
    ))
}

fn holes(file: &MeasuredSurface, path: &str) -> Option<String> {
    let (missing, points) = (file.seen.missing, file.seen.points);
    let fill = file.preparation.fill?;
    (missing > 0).then(|| {
        let share = 100.0 * missing as f64 / points as f64;
        let (fill, removed) = (fill.name(), file.seen.removed.points());
        let spikes = match removed {
            0 => String::new(),
            _ => format!(" and {removed} were removed as spikes or islands"),
        };
        format!(
            "{} of {points} points of `{path}` were not measured{spikes} ({share:.3} %); `fill = \
             \"{fill}\"` estimates their heights",
            missing - removed
        )
    })
}

/// Smallest ratio of the steps between opposite edges to those between neighbouring nodes at which
/// a map is hardly periodic. One period of a rough surface has a ratio of about 1.
const UNMATCHED: f64 = 4.0;

fn unmatched_edges(file: &MeasuredSurface, path: &str) -> Option<String> {
    let ratio = file.seen.edge_step_ratio;
    (ratio > UNMATCHED).then(|| {
        format!(
            "opposite edges of `{path}` do not match: the steps between them are {ratio:.0} times \
             those between neighbouring nodes, and increase the rms slope; if the map is not \
             periodic, set `periodic = false`, and `edges = \"mirror\"` here or `boundary = \
             \"free\"` in the `solve` stage"
        )
    })
}

fn unresolved(file: &MeasuredSurface, path: &str) -> Option<String> {
    let found = file.unreliable_slope()?;
    let share = 100.0 * found.unreliable_share;
    let wavelength = quantity::range([found.wavelength].into_iter(), Some(&file.unit))?;
    Some(format!(
        "{share:.0} % of the mean square slope of `{path}` comes from waves shorter than \
         {wavelength}, which the instrument did not resolve; the rms slope of longer waves is \
         {:.3}; `low_pass = \"reliable\"` removes the shorter ones",
        found.rms_slope
    ))
}
