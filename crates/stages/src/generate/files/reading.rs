//! The files of a stage, as they are when its keys are checked.

use std::collections::BTreeMap;
use std::path::Path;
use std::rc::Rc;

use super::keys::FileTable;
use crate::generate::map_file::{ChannelChoice, MapFile, MapFileError};
use crate::surface_files::{ContentHash, Recalled, SurfaceFileError, SurfaceFiles};
use asperity_manifest::diagnostics::{Problem, Span, chain, did_you_mean};
use asperity_manifest::written::checks::Checks;
use asperity_manifest::written::{Table, Written};
use asperity_topography_files::ChannelError;

/// What is known of a file's map.
pub enum Found {
    /// It can be read.
    Map(ContentHash, Rc<MapFile>),
    /// It cannot be read now.
    Recalled(Recalled),
}

/// The files of a stage, each read once however many points of the grid it is prepared for.
pub struct Reading<'a> {
    sources: &'a mut SurfaceFiles,
    /// The map that was read last: paths and channels change slower than what is done to maps.
    last: Option<(String, Option<ChannelChoice>, ContentHash, Rc<MapFile>)>,
    seen: BTreeMap<ContentHash, (String, Span)>,
}

impl Reading<'_> {
    /// No file yet.
    pub fn new(sources: &mut SurfaceFiles) -> Reading<'_> {
        Reading { sources, last: None, seen: BTreeMap::new() }
    }

    /// Reads a map, to find now what would otherwise be found in the middle of a run.
    pub fn map(
        &mut self,
        path: &Written<String>,
        table: &FileTable,
        channel: Option<&ChannelChoice>,
    ) -> Result<Found, Problem> {
        if let Some((last, choice, content, map)) = &self.last
            && *last == path.value
            && choice.as_ref() == channel
        {
            return Ok(Found::Map(*content, Rc::clone(map)));
        }
        let refuse = |reason: String, label: &str| {
            let message = format!("{:?} {reason}", path.value);
            let problem = Problem::new(message, path.span.clone(), label);
            Err(match FileTable::layout().doc("path") {
                Some(doc) => problem.help(doc),
                None => problem,
            })
        };
        let (content, bytes) = match self.sources.add(Path::new(&path.value)) {
            Ok(found) => found,
            Err(SurfaceFileError::Read { source, .. }) => {
                if let Some(recalled) = self.sources.recall(Path::new(&path.value)) {
                    return Ok(Found::Recalled(recalled));
                }
                return refuse(format!("cannot be read: {source}"), "relative to the manifest");
            }
            Err(error) => return refuse(format!("cannot be read: {error}"), "this file"),
        };
        match MapFile::read(&bytes, channel) {
            Ok(map) => {
                let map = Rc::new(map);
                let last = (path.value.clone(), channel.cloned(), content, Rc::clone(&map));
                self.last = Some(last);
                Ok(Found::Map(content, map))
            }
            Err(MapFileError::Channel(error)) => Err(no_channel(path, table, &error)),
            Err(error) => refuse(format!("is no map of heights: {}", chain(&error)), "this file"),
        }
    }

    /// Two paths to one content would count one surface as two.
    pub fn check_distinct(
        &mut self,
        content: ContentHash,
        path: &Written<String>,
        checks: &mut Checks,
    ) -> Option<()> {
        let here = (path.value.clone(), path.span.clone());
        let Some((other, span)) = self.seen.insert(content, here) else {
            return Some(());
        };
        if span == path.span {
            return Some(());
        }
        let message = format!("{:?} and {other:?} are the same surface, byte for byte", path.value);
        let problem =
            Problem::new(message, path.span.clone(), "this file").and(span, "and this one");
        checks.problems.push(problem);
        None
    }
}

fn no_channel(path: &Written<String>, table: &FileTable, error: &ChannelError) -> Problem {
    let message = format!("{:?}: {error}", path.value);
    let channel = table.channel.written().map(|channel| &channel.span);
    let place = channel.unwrap_or(&path.span).clone();
    let problem =
        Problem::new(message, place, "this channel").and(path.span.clone(), "of this file");
    match error {
        ChannelError::Unknown { wanted, names } => {
            let names = names.iter().map(String::as_str);
            let meant = did_you_mean(wanted, names.clone());
            let meant = meant.map_or_else(String::new, |meant| format!("did you mean `{meant}`? "));
            let numbered = names.enumerate().map(|(at, name)| format!("{} `{name}`", at + 1));
            let all: Vec<_> = numbered.collect();
            problem.help(format!("{meant}its channels are {}", all.join(", ")))
        }
        ChannelError::Beyond { .. } | ChannelError::Ambiguous { .. } => {
            problem.help(format!("`asperity surface {}` lists them", path.value))
        }
    }
}
