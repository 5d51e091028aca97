//! Measured surfaces: the keys of the stages that read them, and checks of these and of the files.
//!
//! The comments of the keys are what editors show and what messages quote.

mod map_checks;

use std::collections::BTreeMap;
use std::fmt;
use std::ops::Bound;
use std::path::Path;
use std::rc::Rc;

use schemars::JsonSchema;
use serde::de::{Error, Visitor};
use serde::{Deserialize, Deserializer};

use self::map_checks::{Lengths, lengths, part, preparation};
use super::growth::PlannedSurfaces;
use super::map_file::{ChannelChoice, MapFile, MapFileError, Reader};
use super::mesh::{FEWEST_NODES, MOST_NODES};
use super::method::{KeptHeights, single, surfaces};
use super::{MeasuredSurface, Origin, Params, PerAxis, SeenMap};
use crate::Given;
use crate::surface_files::{ContentHash, Recalled, SurfaceFileError, SurfaceFiles};
use asperity_contact::topography::fill::Fill;
use asperity_contact::topography::level::Level;
use asperity_contact::topography::periodic::Edges;
use asperity_contact::topography::preparation::Preparation;
use asperity_manifest::diagnostics::{Problem, Problems, Span, chain, did_you_mean};
use asperity_manifest::written::checks::{Checks, QUANTITY};
use asperity_manifest::written::on_axes::{OnAxes, or_a_pair};
use asperity_manifest::written::{Key, Point, Section, Table, Written, deserialize_either, table};
use asperity_topography_files::ChannelError;

/// A measured surface, of the file that the instrument wrote. What is asked for is done in this
/// order: channel, unit and side, `crop`, `level`, `fill`, `high_pass`, `low_pass`, `resample`,
/// `edges`.
#[derive(Debug, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FileTable {
    /// A file of surface topography, relative to the manifest: x3p, sur, gwy, gsf, sdf, opd, al3d,
    /// Nanoscope, Igor, MetroPro, netCDF, text and more, known by its content (`asperity surface` says
    /// what it holds), or a NumPy array with x along its first axis.
    #[schemars(required)]
    pub path: Key<String>,
    /// Which map of a file that has several, by its name, or by its number from 1 on; when left out the
    /// first that holds heights.
    pub channel: Key<Channel>,
    /// Side of the map in the file, where that does not say it: nodes × step, in any unit of length; of
    /// a rectangle those along x and along y, `[2.0, 1.0]`. In metres where the file has a unit.
    #[schemars(extend("exclusiveMinimum" = 0), transform = or_a_pair)]
    pub side: Key<OnAxes<f64>>,
    /// Name of the unit of length, where the file has none; a label, it converts nothing. Lengths of a
    /// file with a unit are in `"m"`.
    #[schemars(extend("default" = ""))]
    pub unit: Key<String>,
    /// What heights are multiplied by to be in the unit of `side`.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0))]
    pub height_scale: Key<f64>,
    /// Whether `side` and `unit` hold where the file says otherwise. Without it that is an error.
    #[serde(rename = "override")]
    #[schemars(extend("default" = false))]
    pub overrides: Key<bool>,
    /// Whether the map, without the form that `level` takes away, repeats itself beyond its edges.
    #[schemars(required)]
    pub periodic: Key<bool>,
    /// A part of a map that is not periodic, rounded to its nodes: `{ from = [x, y], size = [a, b] }` in
    /// the unit of `side`.
    pub crop: Key<Part>,
    /// Which form is taken away, fitted to the measured points by least squares: `"mean"`, `"plane"` or
    /// `"quadric"`; none when left out or `"none"`.
    pub level: Key<Level>,
    /// What becomes of points that were not measured: `"harmonic"` solves Laplace's equation in the
    /// holes, `"nearest"` takes the height of the nearest measured point, `"lowest"` the lowest of the
    /// map; when left out, or `"error"`, a map that lacks points is refused.
    pub fill: Key<Fill>,
    /// Wavelength above which waves are removed, in the unit of `side`, by the areal Gaussian filter of
    /// ISO 16610-61: half of a wave of that length is left.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub high_pass: Key<f64>,
    /// Wavelength below which waves are removed, by the same filter; two steps or more, and below
    /// `high_pass`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub low_pass: Key<f64>,
    /// Nodes per side that a periodic map is interpolated on, by its Fourier modes; along x and along
    /// y, `[512, 256]`, of a rectangle. A list of two numbers is a pair and not swept.
    #[schemars(range(min = FEWEST_NODES, max = MOST_NODES), transform = or_a_pair)]
    pub resample: Key<OnAxes<i64>>,
    /// How the edges of a map that is not periodic are made to meet, its mean plane removed. When
    /// left out it stays as it is, and can be pressed with `boundary = "free"` alone.
    pub edges: Key<WrittenEdges>,
    /// Share of the side over which `edges = "taper"` lets the heights fade, at each edge.
    #[schemars(range(max = 0.5), extend("exclusiveMinimum" = 0, "default" = 0.1))]
    pub taper_fraction: Key<f64>,
    /// Whether heights are stored or read again when needed.
    #[schemars(extend("default" = "keep"))]
    pub heights: Key<KeptHeights>,
}

table!(
    FileTable,
    swept: [
        "path", "channel", "side", "unit", "height_scale", "crop", "level", "fill", "high_pass",
        "low_pass", "resample", "edges", "taper_fraction"
    ],
    lists: [],
    pairs: [],
    always_pairs: ["side", "resample"]
);

/// Which map of a file.
#[derive(Debug, Clone, JsonSchema)]
#[schemars(untagged)]
pub enum Channel {
    /// By its place, from 1 on.
    Number(#[schemars(range(min = 1, max = u16::MAX))] i64),
    /// By its name.
    Name(String),
}

deserialize_either! {
    'de, Channel, "the name of a channel, or its number from 1 on",

    fn visit_i64<E: Error>(self, number: i64) -> Result<Channel, E> {
        Ok(Channel::Number(number))
    }

    fn visit_str<E: Error>(self, name: &str) -> Result<Channel, E> {
        Ok(Channel::Name(name.to_owned()))
    }
}

/// A rectangle of a map.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Part {
    /// Where it begins, along x and along y.
    pub from: [f64; 2],
    /// Its sides along x and along y.
    pub size: [f64; 2],
}

/// How the edges of a map that is not periodic are made to meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum WrittenEdges {
    /// The map is mirrored along both axes: a cell of twice the side.
    Mirror,
    /// The heights fade to zero near the edges.
    Taper,
}

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
                let side = map_checks::written_side(table, checks)?;
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
    let untapered = "only with `edges = \"taper\"`";
    match (is_periodic, table.edges.value()) {
        (true, _) => {
            let why = "the map is periodic: its edges meet already";
            let edges = checks.forbidden("edges", &table.edges, why);
            checks.forbidden("taper_fraction", &table.taper_fraction, untapered)?;
            edges.map(|()| Edges::Periodic)
        }
        (false, Some(WrittenEdges::Mirror)) => {
            checks.forbidden("taper_fraction", &table.taper_fraction, untapered)?;
            Some(Edges::Mirror)
        }
        (false, Some(WrittenEdges::Taper)) => Some(Edges::Taper { taper_fraction: fraction? }),
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
            let number = checks.is_whole_in("channel", &number, &(1..=u32::from(u16::MAX)))?;
            ChannelChoice::Number(number)
        }
    }))
}

/// What is known of a file's map.
enum Found {
    /// It can be read.
    Map(ContentHash, Rc<MapFile>),
    /// It cannot be read now.
    Recalled(Recalled),
}

/// The files of a stage, each read once however many points of the grid it is prepared for.
struct Reading<'a> {
    sources: &'a mut SurfaceFiles,
    /// The map that was read last: paths and channels change slower than what is done to maps.
    last: Option<(String, Option<ChannelChoice>, ContentHash, Rc<MapFile>)>,
    seen: BTreeMap<ContentHash, (String, Span)>,
}

impl Reading<'_> {
    fn new(sources: &mut SurfaceFiles) -> Reading<'_> {
        Reading { sources, last: None, seen: BTreeMap::new() }
    }

    /// Reads a map, to find now what would otherwise be found in the middle of a run.
    fn map(
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
    fn check_distinct(
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
        let problem = Problem::new(message, path.span.clone(), "this file");
        checks.reject(problem.and(span, "and this one"))
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
        ChannelError::OutOfRange { .. } | ChannelError::Ambiguous { .. } => {
            problem.help(format!("`asperity surface {}` lists them", path.value))
        }
    }
}
