//! Keys of measured surfaces, and the checks of their values and files.
//!
//! Editors show the doc comments of keys, and messages quote them.

pub mod labels;
mod lengths;
mod preparation;
pub mod samples;

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;
use std::rc::Rc;

use schemars::JsonSchema;
use serde::Deserialize;

use crate::check_context::exclude;
use crate::generate::files::labels::{LabelledFiles, WrittenLabels, check_names};
use crate::generate::files::lengths::{Lengths, lengths};
use crate::generate::files::preparation::{
    WrittenAlignment, WrittenPoints, inspected, preparation,
};
use crate::generate::mesh::{MAX_NODES, MIN_NODES};
use crate::map_file::{ChannelChoice, MapChoice, MapFile, MapFileError, Reader};
use crate::per_axis::PerAxis;
use crate::stage_points::{StagePoints, Work};
use crate::surface::labels::Labels;
use crate::surface::origin::{InspectedMap, MeasuredSurface};
use crate::surface::planned::{Growing, PlannedSurfaces, Realizations, growing, single, surfaces};
use crate::surface::{Heights, Origin, Params};
use crate::surface_files::{ContentHash, RecordedFile, SurfaceFileError, SurfaceFiles};
use crate::{CheckContext, RowKind};
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::{Problem, Problems, Span, chain, did_you_mean, shell_word};
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::declare::{
    always_pair, length, positive_items, required, swept, unit_of_lengths,
};
use asperity_manifest::keys::quantity::Unit;
use asperity_manifest::keys::{GridPoint, Key, KeyTable, OnAxes, Section, Spanned, table};
use asperity_mechanics::topography::alignment::MAX_DEGREE;
use asperity_mechanics::topography::fill::Fill;
use asperity_mechanics::topography::level::{Level, ThreePoints};
use asperity_mechanics::topography::outliers::MAX_WINDOW;
use asperity_mechanics::topography::periodic::Edges;
use asperity_mechanics::topography::preparation::Preparation;
use asperity_mechanics::topography::surface::Axis;
use asperity_topography_files::{ChannelError, is_metre};

/// A measured surface, read from the file of an instrument. Its keys are applied in this order:
/// channel, `missing` and `mask`, unit and side, `crop`, `spikes`, `islands`, `align`, `level` or
/// `level_through`, `fill`, `tip_radius` and `noise_floor`, `high_pass`, `low_pass`, `resample`,
/// `edges`.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct FileTable {
    /// File of a height map, relative to the manifest. The format is recognised by content: x3p,
    /// sur, gwy, gsf, sdf, opd, al3d, Nanoscope, Igor, MetroPro, netCDF, text and more, or a NumPy
    /// array with x along its first axis. `asperity surface FILE` describes a file. A pattern such
    /// as `"scans/{specimen}_*.x3p"` names several: `*` stands for any text, `?` for one character,
    /// and `{specimen}` for text that becomes a label.
    #[schemars(transform = swept, transform = required)]
    pub path: Key<String>,
    /// `true` makes the files, and the regions of a list of `crop`, samples of one ensemble: means
    /// are over them, and they have errors and intervals. Samples differ in what is read; all other
    /// keys and the labels are parameters. With `false`, each file is a parameter point.
    #[schemars(extend("default" = false))]
    pub samples: Key<bool>,
    /// Number of samples at each parameter point, or a condition that decides it, for
    /// `samples = true`. Files are used in the order of the list or of their paths. By default all
    /// are used.
    pub realizations: Key<Realizations>,
    /// Labels of the file, such as `{ specimen = "A", state = "worn" }`, which become parameter
    /// columns of all tables. They may also be keys of a case. A path of a CSV file stands for the
    /// line whose column `path` or `file` has the path or the name of the file. Labels change no
    /// surface and no contact.
    #[schemars(transform = swept)]
    pub labels: Key<WrittenLabels>,
    /// Name, or number starting at 1, of the map to read from a file with several maps. By default
    /// the heights are chosen by the names and units of the maps; `asperity surface FILE` prints
    /// the choice.
    #[schemars(transform = swept)]
    pub channel: Key<ChannelChoice>,
    /// Number in the file that marks points without a height, such as `-9999`, before any
    /// conversion. Points that the format itself marks are always missing. `asperity surface` names
    /// a number that stands far from all others. By default no number is missing.
    #[schemars(transform = swept)]
    pub missing: Key<f64>,
    /// `true` reads a profile: one line of heights along x, from a file that holds one, from text
    /// with one column of heights or two columns x and height, or from a NumPy array with one axis.
    /// Profiles cannot be pressed; `what = "spectrum-from-profiles"` of a `measure` stage computes
    /// the spectrum of the surface. `side` is the length of the profile, and `high_pass` and
    /// `low_pass` are the cutoffs λc and λs of ISO 16610-21.
    #[schemars(extend("default" = false))]
    pub profile: Key<bool>,
    /// Number of a line along x of the map, counted from 1 at y = 0, that is read as a profile. By
    /// default the map is read.
    #[schemars(range(min = 1, max = MAX_NODES), transform = swept)]
    pub line: Key<u32>,
    /// `false` keeps the heights of points under a mask that a user drew in Gwyddion. With `true`
    /// they are missing. Points that the format itself marks are always missing.
    #[schemars(extend("default" = true), transform = swept)]
    pub mask: Key<bool>,
    /// Side length of the map in the file (nodes × step), for files that do not contain it: in
    /// metres if the file has a unit, otherwise in any unit of length. For a rectangle it is a pair
    /// along x and y, such as `[2.0, 1.0]`; a list of two numbers is always a pair and not swept.
    #[schemars(extend("exclusiveMinimum" = 0))]
    #[schemars(transform = always_pair, transform = swept, transform = length)]
    pub side: Key<OnAxes<f64>>,
    /// Name of the unit of length, for files without a unit. It is a label and converts nothing.
    /// Lengths of a file with a unit are in `"m"`. The default for other files is the unit that is
    /// written at `side`.
    #[schemars(extend("default" = ""), transform = swept, transform = unit_of_lengths)]
    pub unit: Key<String>,
    /// Factor that converts the heights of the file to the unit of `side`.
    #[schemars(extend("exclusiveMinimum" = 0, "default" = 1.0), transform = swept)]
    pub height_scale: Key<f64>,
    /// Rectangle of the map to keep, `{ from = [x, y], size = [a, b] }` in the unit of `side`,
    /// rounded to nodes. It needs `periodic = false`. The default is the whole map.
    #[schemars(transform = swept)]
    pub crop: Key<CropRectangle>,
    /// Threshold above which a point is a spike and becomes a missing point: its distance from the
    /// median of its neighbours, in standard deviations of such distances over the map. Values from
    /// 6 to 10 remove only clear spikes. By default no spikes are removed.
    #[schemars(range(min = 3), transform = swept)]
    pub spikes: Key<f64>,
    /// Odd number of points along each side of the window of neighbours for `spikes`. It must be
    /// at least twice as wide as a spike.
    #[schemars(range(min = 3, max = MAX_WINDOW), extend("default" = 5), transform = swept)]
    pub spike_window: Key<u32>,
    /// Maximum number of points of an island, a group of measured points that missing points
    /// surround. Its points become missing points. By default no islands are removed.
    #[schemars(range(min = 1, max = i32::MAX), transform = swept)]
    pub islands: Key<u32>,
    /// Function that is subtracted from each scan line, to remove the offsets between lines:
    /// `"median"`, `"differences"` for the medians of the differences of neighbouring lines, or
    /// `"polynomial"`. It also removes a tilt and waves across the lines. By default lines are not
    /// aligned.
    #[schemars(transform = swept)]
    pub align: Key<WrittenAlignment>,
    /// Direction of the scan lines for `align`, the fast axis of the scan.
    #[schemars(extend("default" = "x"), transform = swept)]
    pub align_along: Key<Axis>,
    /// Degree of the polynomial that `align = "polynomial"` fits to each line by least squares.
    #[schemars(range(min = 0, max = MAX_DEGREE), extend("default" = 1), transform = swept)]
    pub align_degree: Key<u32>,
    /// Form that is fitted to the measured points by least squares and subtracted: `"mean"`,
    /// `"plane"` or `"quadric"`, the F-operation of ISO 25178-2. The default `"none"` subtracts
    /// nothing.
    #[schemars(transform = swept)]
    pub level: Key<Level>,
    /// Three positions `{ a = [x, y], b = [x, y], c = [x, y] }` on a plane that is subtracted
    /// instead of `level`, in the unit of `side` and relative to the corner of the map in the file.
    /// The heights at the nodes nearest to them become zero.
    #[schemars(transform = swept)]
    pub level_through: Key<WrittenPoints>,
    /// Method to fill points that were not measured: `"harmonic"` solves Laplace's equation in the
    /// holes, `"nearest"` takes the height of the nearest measured point, `"lowest"` the lowest
    /// height of the map. The default `"error"` refuses a map with such points.
    #[schemars(transform = swept)]
    pub fill: Key<Fill>,
    /// Radius of the tip of the scanning probe, in the unit of `side`. The table then has the
    /// wavelength below which the peaks of the map are sharper than the tip could follow, and the
    /// rms slope of the longer waves. Peaks are compared along the scan lines: along `align_along`,
    /// or along x without `align`. By default the tip is not considered.
    #[schemars(extend("exclusiveMinimum" = 0), transform = swept, transform = length)]
    pub tip_radius: Key<f64>,
    /// `true` searches the spectrum of the map for white noise. The table then has the rms height
    /// of the noise, the wavelength below which it has more power than the surface, and the rms
    /// slope of the longer waves.
    #[schemars(extend("default" = false))]
    pub noise_floor: Key<bool>,
    /// Cutoff wavelength above which waves are removed, in the unit of `side`, by the areal
    /// Gaussian filter of ISO 16610-61. ISO 25178-2 calls it the L-filter, and the cutoff its
    /// nesting index. A wave of exactly this length keeps half of its amplitude. By default no long
    /// waves are removed.
    #[schemars(extend("exclusiveMinimum" = 0), transform = swept, transform = length)]
    pub high_pass: Key<f64>,
    /// Cutoff wavelength below which waves are removed, in the unit of `side`, by the filter of
    /// `high_pass`: the S-filter of ISO 25178-2. It must be at least two steps of the map and below
    /// `high_pass`. `"reliable"` is the shortest wavelength that the instrument resolved, according
    /// to `tip_radius` and `noise_floor`. By default no short waves are removed.
    #[schemars(transform = swept, transform = length)]
    pub low_pass: Key<WrittenLowPass>,
    /// Number of nodes per side to which a periodic map is interpolated by its Fourier modes. For a
    /// rectangle it is a pair along x and y, such as `[512, 256]`; a list of two numbers is always
    /// a pair and not swept. The default keeps the nodes of the map.
    #[schemars(range(min = MIN_NODES, max = MAX_NODES), transform = always_pair, transform = swept)]
    pub resample: Key<OnAxes<u32>>,
    /// Method that makes a map periodic, after its mean plane has been subtracted. Without this
    /// key, a map that is not periodic needs `boundary = "free"` in `solve` stages.
    #[schemars(transform = swept)]
    pub edges: Key<WrittenEdges>,
    /// Fraction of the side over which `edges = "taper"` fades the heights to zero at each edge.
    #[schemars(range(max = 0.5), extend("exclusiveMinimum" = 0, "default" = 0.1))]
    #[schemars(transform = swept)]
    pub taper_fraction: Key<f64>,
    /// `true` replaces the side and the unit of the file by `side` and `unit`. With `false`, a
    /// contradiction between the file and the manifest is an error.
    #[serde(rename = "override")]
    #[schemars(extend("default" = false))]
    pub overrides: Key<bool>,
    /// `true` for a map that is periodic after `level` has subtracted the form, `false` for other
    /// maps.
    #[schemars(transform = required)]
    pub periodic: Key<bool>,
    /// Storage of the heights: `"keep"` stores them in the table, `"redraw"` reads the file again
    /// when needed.
    #[schemars(extend("default" = "keep"), transform = Heights::not_none)]
    pub heights: Key<Heights>,
}

table!(FileTable);

/// The rectangle that `crop` keeps of a map.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CropRectangle {
    /// Corner of the rectangle with the smallest x and y, as `[x, y]`.
    #[schemars(transform = length)]
    pub from: [f64; 2],
    /// Side lengths of the rectangle along x and y.
    #[schemars(transform = positive_items, transform = length)]
    pub size: [f64; 2],
}

/// The value of the key `low_pass`.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum WrittenLowPass {
    /// A wavelength in the unit of `side`.
    Wavelength(#[schemars(extend("exclusiveMinimum" = 0))] f64),
    /// A wavelength that follows from the map.
    Found(FoundLowPass),
}

/// A cutoff wavelength that follows from the map.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum FoundLowPass {
    /// Shortest wavelength that the instrument resolved.
    Reliable,
}

/// A method that makes a map periodic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum WrittenEdges {
    /// The map is mirrored along both axes, which doubles its sides.
    Mirror,
    /// The heights fade to zero near the edges.
    Taper,
}

impl StagePoints for Section<FileTable> {
    fn work(&self, context: &mut CheckContext) -> Option<Work> {
        let surfaces = files(self, context)?;
        check_names(self, &surfaces, context.problems)?;
        Some(Work::Generate(surfaces))
    }

    fn row_kind(&self) -> Option<RowKind> {
        self.points.iter().any(|point| is_profile(&point.table)).then_some(RowKind::Profiles)
    }

    fn growing(&self) -> Option<&Growing> {
        growing(&self.points.first()?.table.realizations)
    }
}

/// Returns the measured surfaces of a stage, or `None` after reporting problems.
fn files(section: &Section<FileTable>, context: &mut CheckContext) -> Option<Vec<PlannedSurfaces>> {
    let LabelledFiles { section, labels } =
        &LabelledFiles::new(section, context.sources, context.problems)?;
    let mut of_points = labels.iter();
    let mut samples = None;
    let mut resolved = Vec::new();
    let mut reading = FileCache { sources: context.sources, last: None };
    let mut planned = surfaces(section, context.problems, |table, checks| {
        let values = of_points.next().expect("each point has labels").clone();
        let is_sample = checks.value("samples", &table.samples)?;
        let labels = Labels { values, is_sample };
        let number = samples::number(table, is_sample, checks)?;
        samples = Some(number).filter(|_| is_sample);
        let path = checks.required("path", &table.path);
        let channel = checks.optional("channel", &table.channel)?;
        let choice = MapChoice {
            channel: channel.map(|channel| channel.value.clone()),
            missing: checks.optional("missing", &table.missing)?.map(|missing| missing.value),
            ignores_mask: checks.optional("mask", &table.mask)?.is_some_and(|mask| !mask.value),
            profile: is_profile(table),
            line: checks.optional("line", &table.line)?.map(|line| line.value),
        };
        check_same_kind(section, table, checks)?;
        let found = path.and_then(|path| {
            let found = reading.map(path, table, &choice);
            found.map_err(|problem| checks.problems.push(problem)).ok()
        });
        let converted = found.as_ref().map(|found| in_unit_of(found, table, checks));
        let table = converted.as_ref().unwrap_or(table);
        let height_scale = checks.number("height_scale", &table.height_scale);
        let clear = refuse_excluded(table, checks);
        let edges = edges(table, checks);
        let preparation = preparation(table, checks);
        let heights = checks.value("heights", &table.heights);
        let (path, found) = (path?, found?);
        let keys = FileKeys {
            path,
            table,
            height_scale: height_scale.unwrap_or(1.0),
            edges: edges.unwrap_or(Edges::Open),
            preparation: preparation.clone().unwrap_or_default(),
        };
        let (content, reader, unit, side, seen) = match found {
            FoundMap::Map(content, map) => {
                let Lengths { unit, side, cell } = lengths(&keys, &map, checks)?;
                let seen = inspected(&keys, &map, cell, checks)?;
                (content, map.reader.clone(), unit, side, seen)
            }
            FoundMap::RecordedFile(recalled) => {
                let side = lengths::written_side(table, Some(recalled.nodes), checks)?;
                let written = table.unit.written().map(|unit| unit.value.clone());
                let seen = InspectedMap {
                    nodes: PerAxis(recalled.nodes),
                    side: PerAxis(recalled.side),
                    is_filled: recalled.is_filled,
                    ..InspectedMap::default()
                };
                let reader = recalled.format.as_deref().map(Reader::of_format);
                (recalled.content, reader, written.unwrap_or(recalled.unit), side, seen)
            }
        };
        // Problems with other keys have been reported.
        clear?;
        let (edges, preparation) = (edges?, preparation?);
        let surface = MeasuredSurface {
            content,
            unit,
            height_scale: height_scale?,
            edges,
            reader,
            choice,
            tip_version: MeasuredSurface::version_of_tip(edges, &preparation),
            preparation,
            seen,
            labels,
        };
        let planned = single(heights?, side, Origin::File(Box::new(surface)));
        resolved.push(canonical(&planned.params));
        Some(planned)
    })?;
    report_same_surfaces(section, &resolved, context.problems);
    if let Some(number) = samples {
        samples::numbered(section, &mut planned, number, context.problems)?;
    }
    Some(planned)
}

/// Returns the keys with their lengths in metres if the lengths of the file are in metres. Lengths
/// that the manifest writes without a unit already are.
fn in_unit_of(found: &FoundMap, table: &FileTable, checks: &Checks) -> FileTable {
    let is_in_metres = match found {
        FoundMap::Map(_, map) => lengths::is_in_metres(map),
        FoundMap::RecordedFile(recalled) => is_metre(&recalled.unit),
    };
    let mut table = table.clone();
    let (Some(named), true) = (&checks.units.length, is_in_metres) else {
        return table;
    };
    if named.by_key {
        return table;
    }
    let metre = Unit::find("m").expect("the metre is a unit");
    let factor = named.unit.factor_to(metre);
    let convert = |length: &mut f64| *length = decimal::nearest(*length * factor);
    if let Some(side) = &mut table.side.0 {
        side.value = match side.value {
            OnAxes::Both(mut side) => {
                convert(&mut side);
                OnAxes::Both(side)
            }
            OnAxes::Each(mut sides) => {
                sides.iter_mut().for_each(convert);
                OnAxes::Each(sides)
            }
        };
    }
    if let Some(crop) = &mut table.crop.0 {
        crop.value.from.iter_mut().chain(&mut crop.value.size).for_each(convert);
    }
    if let Some(points) = &mut table.level_through.0 {
        let WrittenPoints { a, b, c } = &mut points.value;
        [a, b, c].into_iter().flatten().for_each(convert);
    }
    let lengths = [&mut table.high_pass.0, &mut table.tip_radius.0];
    lengths.into_iter().flatten().for_each(|length| convert(&mut length.value));
    if let Some(written) = &mut table.low_pass.0
        && let WrittenLowPass::Wavelength(cutoff) = &mut written.value
    {
        convert(cutoff);
    }
    table
}

/// Keys of one parameter point that concern the map in the file.
struct FileKeys<'a> {
    path: &'a Spanned<String>,
    table: &'a FileTable,
    height_scale: f64,
    edges: Edges,
    preparation: Preparation,
}

/// Reports parameter points that describe the same surface by different keys, because the results
/// of this surface would count twice.
fn report_same_surfaces(
    section: &Section<FileTable>,
    resolved: &[Params],
    problems: &mut Problems,
) {
    let mut seen: BTreeMap<String, &GridPoint<FileTable>> = BTreeMap::new();
    for (point, params) in section.points.iter().zip(resolved) {
        let text = serde_json::to_string(params).expect("parameters are plain data");
        let Some(before) = seen.insert(text, point) else {
            continue;
        };
        let [one, other] = [before, point].map(|point| spans(&point.table));
        let mut both = one.iter().zip(&other);
        let differing = both.find(|(one, other)| one != other);
        problems.push(match differing {
            // Points with equal keys have been reported.
            None => continue,
            Some(((name, Some(first)), (_, Some(again)))) => {
                let message = format!("two values of `{name}` give the same surface");
                Problem::new(message, again.clone(), "here again").and(first.clone(), "first here")
            }
            Some(_) => Problem::new(
                "two cases are identical",
                point.span.clone(),
                "the same as the first case, after defaults are applied",
            )
            .and(before.span.clone(), "first case"),
        });
    }
}

/// Returns the spans of the keys for which different values can give the same surface.
fn spans(table: &FileTable) -> [(&'static str, Option<Span>); 9] {
    fn span<T>(key: &Key<T>) -> Option<Span> {
        key.written().map(|written| written.span.clone())
    }
    [
        ("channel", span(&table.channel)),
        ("missing", span(&table.missing)),
        ("mask", span(&table.mask)),
        ("line", span(&table.line)),
        ("side", span(&table.side)),
        ("crop", span(&table.crop)),
        ("level", span(&table.level)),
        ("level_through", span(&table.level_through)),
        ("fill", span(&table.fill)),
    ]
}

/// Returns the canonical form of a recipe, used to detect duplicate points. It contains the number
/// of the map instead of its name, the crop in nodes, and no keys without effect.
fn canonical(params: &Params) -> Params {
    let mut params = params.clone();
    if let Origin::File(file) = &mut params.origin {
        if let Some(read) = &file.seen.channel {
            let number = u32::try_from(read.number).unwrap_or(u32::MAX);
            file.choice.channel = Some(ChannelChoice::Number(number));
        }
        if let Some(grid) = file.seen.file {
            let [x, y] = grid.spacing();
            let rounded = |[a, b]: [f64; 2]| [(a / x).round() + 0.0, (b / y).round() + 0.0];
            if let Some(crop) = &mut file.preparation.crop {
                (crop.from, crop.size) = (rounded(crop.from), rounded(crop.size));
            }
            if let Some(points) = &mut file.preparation.level_through {
                let ThreePoints { a, b, c } = points;
                [a, b, c].into_iter().for_each(|point| *point = rounded(*point));
            }
        }
        params.side = file.seen.file.map(|grid| PerAxis(grid.cell().size()));
        let level = file.preparation.level.take();
        file.preparation.level = level.filter(|level| *level != Level::None);
        let fill = file.preparation.fill.take();
        file.preparation.fill = fill.filter(|_| file.seen.missing > 0);
    }
    params
}

/// Refuses keys that other keys exclude.
fn refuse_excluded(table: &FileTable, checks: &mut Checks) -> Option<()> {
    let lacks = |name: &str, is_written: bool| !is_written && !checks.is_reported(name);
    let periodic = table.periodic.value();
    let tapers = table.edges.value() == Some(WrittenEdges::Taper) && periodic == Some(false);
    let is_untapered = periodic.is_some() && lacks("edges", tapers);
    let align = table.align.value();
    let is_no_polynomial = lacks("align", align == Some(WrittenAlignment::Polynomial));
    let is_unaligned = lacks("align", align.is_some());
    let keeps_spikes = lacks("spikes", table.spikes.written().is_some());
    let profile = is_profile(table);
    exclude! { table, checks,
        profile => crop, spikes, spike_window, islands, align, align_along, align_degree,
            level_through, tip_radius, noise_floor, resample, edges, taper_fraction:
            "for maps; this is a profile";
        profile && table.low_pass.value() == Some(WrittenLowPass::Found(FoundLowPass::Reliable)) =>
            low_pass: "must be a wavelength for a profile";
        periodic == Some(true) => edges: "the map is already periodic";
        is_untapered => taper_fraction: "needs `edges = \"taper\"`";
        is_no_polynomial => align_degree: "needs `align = \"polynomial\"`";
        is_unaligned => align_along: "needs `align`";
        keeps_spikes => spike_window: "needs `spikes`";
        table.level_through.written().is_some() => level:
            "`level_through` already subtracts a plane";
    }
}

/// Returns whether a file is read as a profile.
pub fn is_profile(table: &FileTable) -> bool {
    table.profile.value() == Some(true) || table.line.written().is_some()
}

/// Refuses a stage that reads both maps and profiles.
fn check_same_kind(
    section: &Section<FileTable>,
    table: &FileTable,
    checks: &mut Checks,
) -> Option<()> {
    let first = &section.points.first()?.table;
    if is_profile(first) == is_profile(table) {
        return Some(());
    }
    let message = "a stage cannot read both maps and profiles";
    let span = table.path.written().map_or(&section.span, |path| &path.span);
    let problem = Problem::new(message, span.clone(), "another kind than the first file");
    checks.reject(problem.help("read the profiles in a stage of their own"))
}

/// Returns the treatment of the edges of the map from the keys `periodic`, `edges` and
/// `taper_fraction`.
fn edges(table: &FileTable, checks: &mut Checks) -> Option<Edges> {
    let taper_fraction = checks.number("taper_fraction", &table.taper_fraction);
    let is_periodic = checks.required("periodic", &table.periodic)?.value;
    let edges = checks.optional("edges", &table.edges)?.map(|edges| edges.value);
    if !is_periodic && edges == Some(WrittenEdges::Taper) {
        return Some(Edges::Taper { taper_fraction: taper_fraction? });
    }
    Some(match edges {
        _ if is_periodic => Edges::Periodic,
        Some(_) => Edges::Mirror,
        None => Edges::Open,
    })
}

/// A map that was read now, or the record of a map that an earlier run read.
enum FoundMap {
    /// The hash of the file, and its map.
    Map(ContentHash, Rc<MapFile>),
    /// The record of a map whose file cannot be read now.
    RecordedFile(RecordedFile),
}

/// Reader of the files of a stage. It keeps the last map, because parameter points that differ only
/// in the preparation read the same map.
struct FileCache<'a> {
    sources: &'a mut SurfaceFiles,
    /// Path, choice, content and map of the file that was read last. One is enough, because the
    /// keys that choose it vary slowest among the parameter points.
    last: Option<(String, MapChoice, ContentHash, Rc<MapFile>)>,
}

impl FileCache<'_> {
    /// Reads a map when the manifest is checked, so that problems with the file are reported before
    /// a run.
    fn map(
        &mut self,
        path: &Spanned<String>,
        table: &FileTable,
        choice: &MapChoice,
    ) -> Result<FoundMap, Problem> {
        if let Some((last, chosen, content, map)) = &self.last
            && (last, chosen) == (&path.value, choice)
        {
            return Ok(FoundMap::Map(*content, Rc::clone(map)));
        }
        let file = Path::new(&path.value);
        let (content, bytes) = match self.sources.add(file) {
            Ok(found) => found,
            Err(SurfaceFileError::Read { source, .. }) => {
                return match self.sources.recall(file) {
                    Some(recalled) => Ok(FoundMap::RecordedFile(recalled)),
                    None => Err(unreadable(path, &source, "the path is relative to the manifest")),
                };
            }
            Err(error) => return Err(unreadable(path, &error, "unreadable file")),
        };
        let read = MapFile::read(&bytes, choice);
        let map = Rc::new(read.map_err(|error| no_map(path, table, choice, &bytes, &error))?);
        self.last = Some((path.value.clone(), choice.clone(), content, Rc::clone(&map)));
        Ok(FoundMap::Map(content, map))
    }
}

/// Creates the problem of a file that cannot be read.
fn unreadable(path: &Spanned<String>, error: &(dyn Error + 'static), label: &str) -> Problem {
    let message = format!("cannot read {:?}: {}", path.value, chain(error));
    let problem = Problem::new(message, path.span.clone(), label);
    match FileTable::layout().doc("path") {
        Some(doc) => problem.help(doc),
        None => problem,
    }
}

/// Creates the problem of a file without the map that its keys choose.
fn no_map(
    path: &Spanned<String>,
    table: &FileTable,
    choice: &MapChoice,
    bytes: &[u8],
    error: &MapFileError,
) -> Problem {
    let problem = |span: Option<&Span>, label: &str| {
        let message = format!("{:?}: {error}", path.value);
        Problem::new(message, span.unwrap_or(&path.span).clone(), label)
    };
    let missing = match error {
        MapFileError::Channel(missing) => missing,
        MapFileError::NoLine { .. } => {
            let line = table.line.written().map(|line| &line.span);
            return problem(line, "lines are counted from 1, at y = 0");
        }
        MapFileError::Profile | MapFileError::NoProfile { .. } => {
            return problem(None, "file to read");
        }
        _ => {
            let as_profile = MapChoice { profile: true, ..choice.clone() };
            if choice.profile || MapFile::read(bytes, &as_profile).is_err() {
                return unreadable(path, error, "unreadable file");
            }
            let message = format!("{:?} holds a profile, not a map", path.value);
            return Problem::new(message, path.span.clone(), "one line of heights").help(
                "set `profile = true` to read one column of heights, or two columns x and height",
            );
        }
    };
    let channel = table.channel.written().map(|channel| &channel.span);
    let help = match missing {
        ChannelError::Unknown { wanted, names } => {
            let words = names.iter().map(String::as_str);
            let meant = did_you_mean(wanted, words.clone())
                .map_or_else(String::new, |meant| format!("did you mean `{meant}`? "));
            let numbered = words.enumerate().map(|(index, name)| format!("{} `{name}`", index + 1));
            let all: Vec<_> = numbered.collect();
            format!("{meant}the channels of the file are {}", all.join(", "))
        }
        _ => {
            let path = shell_word(Path::new(&path.value));
            format!("list the channels with `asperity surface {path}`")
        }
    };
    problem(channel, "selected channel").and(path.span.clone(), "file to read").help(help)
}
