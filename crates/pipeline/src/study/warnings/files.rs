//! Warnings about the files of measured surfaces.

use crate::study::{Stage, Work};
use asperity_manifest::keys::quantity;
use asperity_stages::generate::{MeasuredSurface, Origin};
use asperity_stages::surface_files::SurfaceFiles;

/// Returns the warnings about the files of measured surfaces that a stage reads, without
/// duplicates: which channel was chosen, how many points are missing, whether the edges of a
/// periodic map match, whether the instrument resolved the slope, and what the reader guessed.
pub fn file_warnings(stage: &Stage, sources: &SurfaceFiles) -> Vec<String> {
    let Work::Generate(ensembles) = &stage.work else {
        return vec![];
    };
    let mut distinct: Vec<String> = Vec::new();
    for ensemble in ensembles {
        let Origin::File(file) = &ensemble.params.origin else {
            continue;
        };
        let Some(path) = sources.path_of(&file.content) else {
            continue;
        };
        let path = path.display().to_string();
        let messages = [
            channel(file, &path),
            holes(file, &path),
            unmatched_edges(file, &path),
            unresolved(file, &path),
        ];
        let notes = file.seen.notes.iter().map(|note| format!("`{path}`: {note}"));
        for message in messages.into_iter().flatten().chain(notes) {
            if !distinct.contains(&message) {
                distinct.push(message);
            }
        }
    }
    distinct
}

fn channel(file: &MeasuredSurface, path: &str) -> Option<String> {
    let read = file.seen.channel.as_ref()?;
    let is_chosen = file.channel.is_some() || read.of == 1;
    (!is_chosen).then(|| {
        let (number, name, of) = (read.number, &read.name, read.of);
        format!(
            "`{path}` has {of} channels; number {number}, `{name}`, is read as the first one with \
             heights; set `channel = {number}` to make this explicit"
        )
    })
}

fn holes(file: &MeasuredSurface, path: &str) -> Option<String> {
    let (missing, points) = (file.seen.missing, file.seen.points);
    let fill = file.preparation.fill?;
    (missing > 0).then(|| {
        let share = 100.0 * missing as f64 / points as f64;
        let (fill, removed) = (fill.name(), file.seen.removed.points());
        let lack = match removed {
            0 => format!("{missing} of {points} points of `{path}` were not measured"),
            _ if removed == missing => {
                format!(
                    "{removed} of {points} points of `{path}` were removed as spikes or islands"
                )
            }
            _ => format!(
                "{} of {points} points of `{path}` were not measured and {removed} were removed as \
                 spikes or islands",
                missing - removed
            ),
        };
        format!("{lack} ({share:.3} %); `fill = \"{fill}\"` estimates their heights")
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
