//! Checks of the preparation of the map in a file.

use std::ops::{RangeBounds, RangeInclusive};

use schemars::JsonSchema;
use serde::Deserialize;

use crate::generate::files::{FileKeys, FileTable, WrittenLowPass, is_profile};
use crate::generate::mesh::{MAX_NODES, MIN_NODES};
use crate::generate::plausibility::slope_and_span;
use crate::map_file::MapFile;
use crate::per_axis::PerAxis;
use crate::surface::origin::InspectedMap;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::keys::bounds::QUANTITY;
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::declare::length;
use asperity_mechanics::grid::{Cell, Grid};
use asperity_mechanics::topography::alignment::{Alignment, LineFit};
use asperity_mechanics::topography::differences::edge_step_ratio;
use asperity_mechanics::topography::fill::Fill;
use asperity_mechanics::topography::level::{Level, ThreePoints};
use asperity_mechanics::topography::outliers::Spikes;
use asperity_mechanics::topography::periodic::Edges;
use asperity_mechanics::topography::preparation::{
    Crop, FoundCutoff, Levelled, LowPass, Preparation, PreparationError, spread,
};
use asperity_mechanics::topography::surface::{Axis, Scan};

/// Numbers of points of profiles.
const PROFILE_POINTS: RangeInclusive<usize> = 16..=1 << 22;

/// Returns the preparation of the map, after the checks that need no map.
pub fn preparation(table: &FileTable, checks: &mut Checks) -> Option<Preparation> {
    let crop = crop(table, checks);
    let spikes = spikes(table, checks);
    let islands = checks.optional("islands", &table.islands);
    let align = alignment(table, checks);
    let level_through = level_through(table, checks);
    let resample = resample(table, checks);
    let high_pass = checks.optional_number("high_pass", &table.high_pass);
    let low_pass = low_pass(table, checks);
    let tip_radius = checks.optional_number("tip_radius", &table.tip_radius);
    let noise_floor = checks.value("noise_floor", &table.noise_floor)?;
    let (high_pass, low_pass) = (high_pass?, low_pass?);
    check_band(table, [wavelength(low_pass), high_pass], checks)?;
    let (level, fill) = (table.level.value(), table.fill.value());
    let (align, tip_radius) = (align?, tip_radius?);
    let lines = align.map(|align| align.along).filter(|along| *along != Axis::X);
    Some(Preparation {
        crop: crop?,
        spikes: spikes?,
        islands: islands?.map(|islands| islands.value),
        align,
        level,
        level_through: level_through?,
        fill,
        high_pass,
        low_pass,
        resample: resample?,
        tip_radius,
        tip_along: lines.filter(|_| tip_radius.is_some()),
        noise_floor,
    })
}

/// Returns the cutoff of the low-pass filter. Refuses `"reliable"` without a key that determines
/// the reliable wavelength.
fn low_pass(table: &FileTable, checks: &mut Checks) -> Option<Option<LowPass>> {
    let Some(written) = checks.optional("low_pass", &table.low_pass)? else {
        return Some(None);
    };
    if let WrittenLowPass::Wavelength(cutoff) = written.value {
        return Some(Some(LowPass::Wavelength(decimal::nearest(cutoff))));
    }
    if table.tip_radius.written().is_some() || table.noise_floor.value() == Some(true) {
        return Some(Some(LowPass::Found(FoundCutoff::Reliable)));
    }
    let message = "`low_pass = \"reliable\"` needs the limits of the instrument";
    let label = "needs `tip_radius` or `noise_floor = true`";
    checks.reject(Problem::new(message, written.span.clone(), label).help(
        "give the radius of the tip, such as `tip_radius = \"10 nm\"`, or search for noise by \
         `noise_floor = true`",
    ))
}

/// Returns the wavelength of a low-pass filter, if the manifest gives it.
fn wavelength(low_pass: Option<LowPass>) -> Option<f64> {
    match low_pass {
        Some(LowPass::Wavelength(wavelength)) => Some(wavelength),
        Some(LowPass::Found(FoundCutoff::Reliable)) | None => None,
    }
}

fn crop(table: &FileTable, checks: &mut Checks) -> Option<Option<Crop>> {
    let Some(written) = checks.optional("crop", &table.crop)? else {
        return Some(None);
    };
    if let Some(periodic) = table.periodic.written().filter(|periodic| periodic.value) {
        let message = "a part of a map is not periodic, and `periodic` is true";
        let problem =
            Problem::new(message, written.span.clone(), "`crop` needs `periodic = false`");
        return checks.reject(problem.and(periodic.span.clone(), "must be `false` with `crop`"));
    }
    let [from, size] =
        [written.value.from, written.value.size].map(|pair| pair.map(decimal::nearest));
    Some(Some(Crop { from, size }))
}

/// Refuses a high-pass and a low-pass filter that leave no wavelengths between them.
fn check_band(table: &FileTable, cutoffs: [Option<f64>; 2], checks: &mut Checks) -> Option<()> {
    let [Some(low), Some(high)] = cutoffs else {
        return Some(());
    };
    if low < high {
        return Some(());
    }
    let message = format!("`low_pass = {low}` and `high_pass = {high}` leave no waves");
    let (low, high) = (table.low_pass.written()?, table.high_pass.written()?);
    let problem =
        Problem::new(message, low.span.clone(), "removes waves that are shorter than this")
            .and(high.span.clone(), "removes waves that are longer than this");
    checks.reject(
        problem.help("set `high_pass` above `low_pass`; the wavelengths between them remain"),
    )
}

fn resample(table: &FileTable, checks: &mut Checks) -> Option<Option<[u32; 2]>> {
    let Some(written) = checks.optional("resample", &table.resample)? else {
        return Some(None);
    };
    let open = table.periodic.written().filter(|periodic| !periodic.value);
    if let Some(open) = open {
        let message = format!("`resample = {}` needs a periodic map", written.value);
        let problem = Problem::new(
            message,
            written.span.clone(),
            "interpolates Fourier modes of a periodic map",
        )
        .and(open.span.clone(), "the map is not periodic");
        return checks.reject(problem.help(
            "remove `resample`; `low_pass` removes the short waves of a map that is not periodic and keeps its \
             nodes",
        ));
    }
    Some(Some(written.value.pair()))
}

/// Applies the steps up to `level` to a map, checks the result, determines the reliable wavelength
/// if the manifest asks for it, and returns the properties of the prepared map.
pub fn inspected(
    keys: &FileKeys,
    map: &MapFile,
    cell: Cell,
    checks: &mut Checks,
) -> Option<InspectedMap> {
    let of_file = Grid::new(map.nodes, cell).expect("the file has as many numbers");
    let scan = match map.clone().scan(Some(cell.size()), keys.height_scale) {
        Ok(scan) => scan,
        Err(error) => {
            let help = "export the map again, and check `side` and `height_scale`";
            return refuse(keys, &format!("cannot be read: {error}"), help, checks);
        }
    };
    let before = spread(scan.heights());
    let levelled = match keys.preparation.levelled(scan, keys.edges) {
        Ok(levelled) => levelled,
        Err(error) => return checks.reject(not_levelled(keys, cell, &error)),
    };
    let (scan, grid) = (&levelled.scan, levelled.scan.grid());
    check_nodes(keys, grid, checks)?;
    check_holes(keys, &levelled, checks)?;
    check_heights(keys, scan, before, checks)?;
    check_cutoffs(keys, grid, checks)?;
    let (nodes, side) = prepared(keys, grid);
    let edge_step_ratio = if keys.edges == Edges::Periodic { edge_step_ratio(scan) } else { 0.0 };
    let (points, missing, removed) = (grid.count(), scan.missing(), levelled.removed);
    let (rms_slope, height_span) = slope_and_span(grid, scan.heights());
    let reliability = if keys.preparation.tests_reliability() {
        let filled = keys.preparation.filled(levelled.scan, keys.edges);
        filled.expect("missing points were checked").1
    } else {
        None
    };
    Some(InspectedMap {
        nodes: PerAxis(nodes),
        side: PerAxis(side),
        channel: Some(map.channel.clone()),
        suspect: map.suspect,
        notes: map.notes.clone(),
        missing,
        removed,
        is_filled: missing > 0,
        points,
        file: Some(of_file),
        reliability,
        edge_step_ratio,
        rms_slope: Some(rms_slope),
        height_span,
    })
}

/// Creates the problem of a crop, or of three points, that do not fit the map.
fn not_levelled(keys: &FileKeys, cell: Cell, error: &PreparationError) -> Problem {
    let [x, y] = cell.size().map(decimal::nearest);
    let sides = format!("the map has sides of {x:?} and {y:?}");
    let table = keys.table;
    let (message, span, label) = match error {
        PreparationError::Crop(error) => (
            format!("`crop` is not a part of {:?}: {error}", keys.path.value),
            table.crop.written().map(|crop| &crop.span),
            "must lie within the map",
        ),
        PreparationError::ThreePoints(error) => (
            format!("`level_through` gives no plane in {:?}: {error}", keys.path.value),
            table.level_through.written().map(|points| &points.span),
            "must be three measured points of the map, not on one line",
        ),
        other => (format!("cannot prepare {:?}: {other}", keys.path.value), None, "unusable map"),
    };
    Problem::new(message, span.unwrap_or(&keys.path.span).clone(), label).help(sides)
}

/// Reports that a file cannot be used, and how to change the file or the manifest.
fn refuse<T>(keys: &FileKeys, reason: &str, help: &str, checks: &mut Checks) -> Option<T> {
    let message = format!("{:?} {reason}", keys.path.value);
    checks.reject(Problem::new(message, keys.path.span.clone(), "unusable map").help(help))
}

/// Returns the number of copies of the map along each axis of the prepared map.
fn copies(keys: &FileKeys) -> u32 {
    if keys.edges == Edges::Mirror { 2 } else { 1 }
}

/// Refuses a map with too few or too many nodes.
fn check_nodes(keys: &FileKeys, grid: Grid, checks: &mut Checks) -> Option<()> {
    if is_profile(keys.table) {
        return check_points(keys, grid, checks);
    }
    let max = MAX_NODES / copies(keys);
    let can_be = MIN_NODES as usize..=max as usize;
    let nodes = grid.nodes();
    if nodes.iter().all(|nodes| can_be.contains(nodes)) {
        return Some(());
    }
    let found = match nodes {
        [x, y] if x == y => format!("{x} nodes per side"),
        [x, y] => format!("{x} × {y} nodes"),
    };
    let found = match keys.table.crop.written() {
        Some(_) => format!("has {found} in the cropped part"),
        None => format!("has {found}"),
    };
    let help = "choose another part of the map with `crop`, or another file";
    let reason = format!("{found}; it must have from {MIN_NODES} to {max} per side");
    refuse(keys, &reason, help, checks)
}

/// Refuses a profile with too few or too many points.
fn check_points(keys: &FileKeys, grid: Grid, checks: &mut Checks) -> Option<()> {
    let [points, _] = grid.nodes();
    if PROFILE_POINTS.contains(&points) {
        return Some(());
    }
    let [least, most] = [PROFILE_POINTS.start(), PROFILE_POINTS.end()];
    let reason = format!("has {points} points; a profile must have from {least} to {most}");
    refuse(keys, &reason, "choose another file", checks)
}

/// Refuses a map with points that were not measured or were removed, unless `fill` names a method
/// for them.
fn check_holes(keys: &FileKeys, levelled: &Levelled, checks: &mut Checks) -> Option<()> {
    let Levelled { scan, removed } = levelled;
    let (missing, points) = (scan.missing(), scan.grid().count());
    if missing == 0 {
        return Some(());
    }
    if missing == points {
        let help = "choose another file or another `channel`";
        return refuse(keys, "has no measured point", help, checks);
    }
    if keys.preparation.fill.unwrap_or_default() != Fill::Error {
        return Some(());
    }
    let percentage = 100.0 * missing as f64 / points as f64;
    let path = &keys.path.value;
    let mut message = format!("{path:?} lacks {missing} of {points} points, {percentage:.3} %");
    let mut label = "some points were not measured";
    if removed.points() > 0 {
        let counts = [(removed.spikes, "`spikes`"), (removed.islands, "`islands`")];
        let some = counts.into_iter().filter(|(count, _)| *count > 0);
        let of: Vec<String> = some.map(|(count, key)| format!("{key} removed {count}")).collect();
        message.push_str(&format!("; {} of them", of.join(" and ")));
        label = "removed points are missing points";
    }
    let fill = keys.table.fill.written().map(|fill| &fill.span);
    let span = fill.unwrap_or(&keys.path.span);
    checks.refuse("fill", message, span, label)
}

/// Refuses a map whose heights are flat, or spread over a range that is too small or too large.
fn check_heights(keys: &FileKeys, levelled: &Scan, before: f64, checks: &mut Checks) -> Option<()> {
    if before != 0.0 && !QUANTITY.contains(&before) {
        let message = format!("{:?} has heights that spread over {before:?}", keys.path.value);
        let label = "must be from 1e-30 to 1e30; another unit may help";
        return checks.refuse("path", message, &keys.path.span, label);
    }
    // The mean plane is subtracted before edges are made periodic: an inclined plane has no
    // roughness.
    let left = match keys.edges {
        Edges::Mirror | Edges::Taper { .. } => Level::Plane.level(levelled.clone()),
        Edges::Periodic | Edges::Open => levelled.clone(),
    };
    if spread(left.heights()) > 1e-12 * before {
        return Some(());
    }
    let when = match (keys.preparation.level, keys.edges) {
        (Some(Level::Plane | Level::Quadric), _) => "after levelling",
        _ => "after its edges are made periodic",
    };
    let reason = format!("is flat: it has no roughness {when}");
    refuse(keys, &reason, "choose another file, another `channel` or a lower `level`", checks)
}

/// Refuses cutoff wavelengths shorter than two mesh steps or longer than the longer side.
fn check_cutoffs(keys: &FileKeys, grid: Grid, checks: &mut Checks) -> Option<()> {
    let [x, y] = grid.spacing();
    let least = decimal::nearest(2.0 * x.max(y));
    let most = decimal::nearest(grid.cell().longer_side());
    let (high_pass, low_pass) = (keys.table.high_pass.written(), keys.table.low_pass.written());
    let both = [
        ("high_pass", keys.preparation.high_pass.zip(high_pass.map(|key| &key.span))),
        ("low_pass", wavelength(keys.preparation.low_pass).zip(low_pass.map(|key| &key.span))),
    ];
    let mut all = Some(());
    for (name, (cutoff, span)) in both.into_iter().filter_map(|(name, key)| Some((name, key?))) {
        let rounding = 1e-6;
        if cutoff < least * (1.0 - rounding) || cutoff > most * (1.0 + rounding) {
            let message =
                format!("`{name} = {cutoff}` is not a wavelength of {:?}", keys.path.value);
            let label = format!("must be from {least:?}, two steps, to {most:?}, the longer side");
            all = checks.refuse(name, message, span, label);
        }
    }
    all
}

/// Returns the nodes and the sides of the prepared map, along x and y.
fn prepared(keys: &FileKeys, grid: Grid) -> ([u32; 2], [f64; 2]) {
    let nodes = grid.nodes().map(|nodes| nodes as u32);
    let nodes = keys.preparation.resample.unwrap_or(nodes);
    let copies = copies(keys);
    let side = grid.cell().size().map(|side| f64::from(copies) * side);
    (nodes.map(|nodes| copies * nodes), side)
}

/// Function of each scan line that `align` subtracts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum WrittenAlignment {
    /// The median of the line.
    Median,
    /// The sum of the medians of the differences of neighbouring lines.
    Differences,
    /// The least-squares polynomial of degree `align_degree`.
    Polynomial,
}

/// Three positions on the plane that `level_through` subtracts.
#[derive(Debug, Clone, Copy, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WrittenPoints {
    /// First position, as `[x, y]`.
    #[schemars(transform = length)]
    pub a: [f64; 2],
    /// Second position, as `[x, y]`.
    #[schemars(transform = length)]
    pub b: [f64; 2],
    /// Third position, as `[x, y]`.
    #[schemars(transform = length)]
    pub c: [f64; 2],
}

/// Returns the spikes to remove, or `Some(None)` if the manifest has no key `spikes`.
pub fn spikes(table: &FileTable, checks: &mut Checks) -> Option<Option<Spikes>> {
    let threshold = checks.optional_number("spikes", &table.spikes)?;
    let Some(threshold) = threshold else {
        return Some(None);
    };
    let window: u32 = checks.value("spike_window", &table.spike_window)?;
    match table.spike_window.written().filter(|_| window.is_multiple_of(2)) {
        Some(written) => {
            let message = format!("`spike_window` is {window}");
            checks.refuse("spike_window", message, &written.span, "must be an odd number")
        }
        None => Some(Some(Spikes { threshold, window })),
    }
}

/// Returns the alignment of the scan lines, or `Some(None)` if the manifest has no key `align`.
pub fn alignment(table: &FileTable, checks: &mut Checks) -> Option<Option<Alignment>> {
    let written = checks.optional("align", &table.align)?.map(|written| written.value);
    let Some(written) = written else {
        return Some(None);
    };
    let along = checks.value("align_along", &table.align_along)?;
    let by = match written {
        WrittenAlignment::Median => LineFit::Median,
        WrittenAlignment::Differences => LineFit::Differences,
        WrittenAlignment::Polynomial => {
            LineFit::Polynomial { degree: checks.value("align_degree", &table.align_degree)? }
        }
    };
    Some(Some(Alignment { along, by }))
}

/// Returns the positions on the plane to subtract, or `Some(None)` if the manifest has no key
/// `level_through`.
pub fn level_through(table: &FileTable, checks: &mut Checks) -> Option<Option<ThreePoints>> {
    let Some(written) = checks.optional("level_through", &table.level_through)? else {
        return Some(None);
    };
    let [a, b, c] = [written.value.a, written.value.b, written.value.c]
        .map(|point| point.map(decimal::nearest));
    Some(Some(ThreePoints { a, b, c }))
}
