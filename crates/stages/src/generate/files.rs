//! Checks of the stages that read measured surfaces, and of their files.

use std::collections::BTreeMap;
use std::ops::Bound;

use self::keys::{Channel, FileTable};
use self::lengths::{Lengths, lengths};
use self::part::{part, preparation};
use self::reading::{Found, Reading};
use super::checks::{single, surfaces};
use super::growth::PlannedSurfaces;
use super::map_file::{ChannelChoice, Reader};
use super::{MeasuredSurface, Origin, Params, PerAxis, SeenMap};
use crate::Given;
use crate::surface_files::{ContentHash, Recalled};
use asperity_contact::topography::level::Level;
use asperity_contact::topography::periodic::Edges;
use asperity_contact::topography::preparation::Preparation;
use asperity_manifest::diagnostics::{Problem, Problems, Span};
use asperity_manifest::written::checks::{Checks, QUANTITY};
use asperity_manifest::written::{Key, Point, Section, Written};

pub mod keys;
mod lengths;
mod part;
mod reading;

/// Measured surfaces.
pub fn files(section: &Section<FileTable>, given: &mut Given) -> Option<Vec<PlannedSurfaces>> {
    let mut reading = Reading::new(given.sources);
    let mut resolved = Vec::new();
    let planned = surfaces(section, given.problems, |table, checks| {
        let path = checks.required("path", &table.path);
        let height_scale = checks.number_or("height_scale", &table.height_scale, QUANTITY, 1.0);
        let edges = edges(table, checks);
        let preparation = preparation(table, checks);
        let path = path?;
        let channel = channel(table, checks);
        let found = reading.map(path, table, channel.as_ref()?.as_ref());
        let found = found.map_err(|problem| checks.problems.push(problem)).ok()?;
        let asked = Asked {
            path,
            table,
            height_scale: height_scale.unwrap_or(1.0),
            edges: edges.unwrap_or(Edges::Open),
            preparation: preparation.clone().unwrap_or_default(),
        };
        let surface = |content, reader, unit: String, seen| MeasuredSurface {
            content,
            unit,
            height_scale: asked.height_scale,
            edges: asked.edges,
            reader,
            channel: channel.clone().flatten(),
            preparation: asked.preparation.clone(),
            seen,
        };
        let (surface, side) = match &found {
            Found::Map(content, map) => {
                let Lengths { unit, side, cell } = lengths(&asked, map, checks)?;
                let seen = part(&asked, map, cell, checks)?;
                reading.check_distinct(*content, path, checks)?;
                (surface(*content, map.reader.clone(), unit, seen), side)
            }
            Found::Recalled(recalled) => {
                let side = lengths::written_side(table, checks)?;
                (of_recalled(recalled, table, surface), side)
            }
        };
        // What is wrong with other keys has been reported.
        let (_, _, _) = (height_scale?, edges?, preparation?);
        let planned = single(&table.heights, side, Origin::File(Box::new(surface)));
        resolved.push(without_synonyms(&planned.params));
        Some(planned)
    })?;
    report_synonyms(section, &resolved, given.problems);
    Some(planned)
}

/// What a point asks of a file.
struct Asked<'a> {
    path: &'a Written<String>,
    table: &'a FileTable,
    height_scale: f64,
    edges: Edges,
    preparation: Preparation,
}

/// Reports points that come to the same in other words: they would count one surface twice.
fn report_synonyms(section: &Section<FileTable>, resolved: &[Params], problems: &mut Problems) {
    let mut seen: BTreeMap<String, &Point<FileTable>> = BTreeMap::new();
    for (point, params) in section.points.iter().zip(resolved) {
        let text = serde_json::to_string(params).expect("parameters are plain data");
        let Some(before) = seen.insert(text, point) else {
            continue;
        };
        let [one, other] = [before, point].map(|point| spans(&point.table));
        let mut both = one.iter().zip(&other);
        let differing = both.find(|(one, other)| one != other);
        problems.push(match differing {
            // Points that agree in every word have been reported.
            None => continue,
            Some(((name, Some(first)), (_, Some(again)))) => {
                let message = format!("two values of `{name}` come to the same surface");
                Problem::new(message, again.clone(), "here again").and(first.clone(), "first here")
            }
            Some(_) => {
                let place = point.place.clone();
                Problem::new("two cases come to the same", place, "this case")
                    .and(before.place.clone(), "is equal to this one")
            }
        });
    }
}

/// Where what can be said in several ways is written.
fn spans(table: &FileTable) -> [(&'static str, Option<Span>); 5] {
    fn span<T>(key: &Key<T>) -> Option<Span> {
        key.written().map(|written| written.span.clone())
    }
    [
        ("channel", span(&table.channel)),
        ("side", span(&table.side)),
        ("crop", span(&table.crop)),
        ("level", span(&table.level)),
        ("fill", span(&table.fill)),
    ]
}

/// A surface as its recipe would be if everything in it were written out: the map by its number, the
/// part by its nodes, and nothing that does nothing. Two points that come to the same have one such
/// recipe, in whichever words.
fn without_synonyms(params: &Params) -> Params {
    let mut params = params.clone();
    if let Origin::File(file) = &mut params.origin {
        if let Some(read) = &file.seen.channel {
            let number = u32::try_from(read.number).unwrap_or(u32::MAX);
            file.channel = Some(ChannelChoice::Number(number));
        }
        if let (Some(grid), Some(crop)) = (file.seen.file, &mut file.preparation.crop) {
            let [x, y] = grid.spacing();
            let rounded = |[a, b]: [f64; 2]| [(a / x).round() + 0.0, (b / y).round()];
            (crop.from, crop.size) = (rounded(crop.from), rounded(crop.size));
        }
        params.side = file.seen.file.map(|grid| PerAxis(grid.cell().size()));
        let level = file.preparation.level.take();
        file.preparation.level = level.filter(|level| *level != Level::None);
        let fill = file.preparation.fill.take();
        file.preparation.fill = fill.filter(|_| file.seen.missing > 0);
    }
    params
}

fn of_recalled(
    recalled: &Recalled,
    table: &FileTable,
    surface: impl Fn(ContentHash, Option<Reader>, String, SeenMap) -> MeasuredSurface,
) -> MeasuredSurface {
    let written = table.unit.written().map(|unit| unit.value.clone());
    let seen = SeenMap {
        nodes: PerAxis(recalled.nodes),
        side: PerAxis(recalled.side),
        ..SeenMap::default()
    };
    surface(
        recalled.content,
        recalled.format.as_deref().map(Reader::of_format),
        written.unwrap_or_else(|| recalled.unit.clone()),
        seen,
    )
}

fn edges(table: &FileTable, checks: &mut Checks) -> Option<Edges> {
    let fraction = (Bound::Excluded(0.0), Bound::Included(0.5));
    let fraction = checks.number_or("taper_fraction", &table.taper_fraction, fraction, 0.1);
    let is_periodic = checks.required("periodic", &table.periodic)?.value;
    let written = table.edges.written();
    let untapered = "only with `edges = \"taper\"`";
    match (is_periodic, written.map(|edges| edges.value)) {
        (true, _) => {
            let why = "the map is periodic: its edges meet already";
            let edges = checks.forbidden("edges", &table.edges, why);
            checks.forbidden("taper_fraction", &table.taper_fraction, untapered)?;
            edges.map(|()| Edges::Periodic)
        }
        (false, Some(keys::Edges::Mirror)) => {
            checks.forbidden("taper_fraction", &table.taper_fraction, untapered)?;
            Some(Edges::Mirror)
        }
        (false, Some(keys::Edges::Taper)) => Some(Edges::Taper { taper_fraction: fraction? }),
        (false, None) => {
            checks.forbidden("taper_fraction", &table.taper_fraction, untapered)?;
            Some(Edges::Open)
        }
    }
}

/// The channel that is asked for, if any.
fn channel(table: &FileTable, checks: &mut Checks) -> Option<Option<ChannelChoice>> {
    let Some(written) = table.channel.written() else {
        return (!checks.is_excused("channel")).then_some(None);
    };
    Some(Some(match &written.value {
        Channel::Name(name) => ChannelChoice::Name(name.clone()),
        Channel::Number(number) => {
            let number = Written { value: *number, span: written.span.clone() };
            let number = checks.is_whole_in("channel", &number, &(1..=65535_u32))?;
            ChannelChoice::Number(number)
        }
    }))
}
