//! What is known of the files of measured surfaces and stands in no manifest: which of several maps is
//! read, and how much of a map was not measured.

use crate::study::{Stage, Work};
use asperity_stages::generate::{MeasuredSurface, Origin};
use asperity_stages::surface_files::SurfaceFiles;

/// What should be known of the files that a stage reads, each thing once.
pub fn told(stage: &Stage, sources: &SurfaceFiles) -> Vec<String> {
    let Work::Generate(ensembles) = &stage.work else {
        return vec![];
    };
    let mut told: Vec<String> = Vec::new();
    for ensemble in ensembles {
        let Origin::File(file) = &ensemble.params.origin else {
            continue;
        };
        let Some(path) = sources.path_of(&file.content) else {
            continue;
        };
        let path = path.display().to_string();
        let messages = [channel(file, &path), holes(file, &path)];
        for message in messages.into_iter().flatten() {
            if !told.contains(&message) {
                told.push(message);
            }
        }
    }
    told
}

fn channel(file: &MeasuredSurface, path: &str) -> Option<String> {
    let read = file.seen.channel.as_ref()?;
    let is_chosen = file.channel.is_some() || read.of == 1;
    (!is_chosen).then(|| {
        let (number, name, of) = (read.number, &read.name, read.of);
        format!(
            "`{path}` has {of} channels; number {number}, `{name}`, is the first that holds heights, \
             and is read; `channel = {number}` says so outright"
        )
    })
}

fn holes(file: &MeasuredSurface, path: &str) -> Option<String> {
    let (missing, points) = (file.seen.missing, file.seen.points);
    let fill = file.preparation.fill?;
    (missing > 0).then(|| {
        let share = 100.0 * missing as f64 / points as f64;
        let fill = fill.name();
        format!(
            "{missing} of {points} points of `{path}` were not measured, {share:.3} %; `fill = \
             \"{fill}\"` gives them heights"
        )
    })
}
