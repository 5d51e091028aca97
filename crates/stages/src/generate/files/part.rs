//! Checks of what is done to a measured map, and of what is left of it.

use std::ops::{Bound, RangeBounds};

use super::Asked;
use super::keys::{self, FileTable};
use crate::generate::map_file::MapFile;
use crate::generate::mesh::NODES;
use crate::generate::{PerAxis, SeenMap};
use asperity_contact::grid::{Cell, Grid};
use asperity_contact::topography::fill::Fill;
use asperity_contact::topography::level::Level;
use asperity_contact::topography::periodic::Edges;
use asperity_contact::topography::preparation::{Crop, Preparation, spread};
use asperity_contact::topography::surface::Scan;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::written::checks::{Checks, QUANTITY};
use asperity_manifest::written::{Key, OnAxes, Written};

/// What is asked for, as far as it can be judged without the map.
pub fn preparation(table: &FileTable, checks: &mut Checks) -> Option<Preparation> {
    let crop = crop(table, checks);
    let resample = resample(table, checks);
    let high_pass = cutoff("high_pass", &table.high_pass, checks);
    let low_pass = cutoff("low_pass", &table.low_pass, checks);
    let (high_pass, low_pass) = (high_pass?, low_pass?);
    check_band(table, [low_pass, high_pass], checks)?;
    let level = table.level.written().map(|level| match level.value {
        keys::Level::None => Level::None,
        keys::Level::Mean => Level::Mean,
        keys::Level::Plane => Level::Plane,
        keys::Level::Quadric => Level::Quadric,
    });
    let fill = table.fill.written().map(|fill| match fill.value {
        keys::Fill::Error => Fill::Error,
        keys::Fill::Harmonic => Fill::Harmonic,
        keys::Fill::Nearest => Fill::Nearest,
        keys::Fill::Lowest => Fill::Lowest,
    });
    Some(Preparation { crop: crop?, level, fill, high_pass, low_pass, resample: resample? })
}

fn crop(table: &FileTable, checks: &mut Checks) -> Option<Option<Crop>> {
    let Some(written) = table.crop.written() else {
        return (!checks.is_excused("crop")).then_some(None);
    };
    if let Some(periodic) = table.periodic.written().filter(|periodic| periodic.value) {
        let message = "a part of a map does not repeat itself, `periodic` says that it does";
        let problem = Problem::new(message, written.span.clone(), "cuts out a part")
            .and(periodic.span.clone(), "must be `false` beside it");
        checks.problems.push(problem);
        return None;
    }
    let of = |lengths: [f64; 2]| lengths.map(|value| Written { value, span: written.span.clone() });
    let mut held = |name: &str, lengths: [f64; 2], bounds| {
        let [x, y] = of(lengths);
        let x = checks.holds(name, &x, bounds)?;
        Some([x, checks.holds(name, &y, bounds)?])
    };
    let anything = (Bound::Unbounded, Bound::Unbounded);
    let from = held("crop", written.value.from, anything);
    let size = held("crop", written.value.size, QUANTITY);
    Some(Some(Crop { from: from?, size: size? }))
}

fn cutoff(name: &str, key: &Key<f64>, checks: &mut Checks) -> Option<Option<f64>> {
    match key.written() {
        Some(written) => checks.is_in(name, written, QUANTITY).map(Some),
        None => (!checks.is_excused(name)).then_some(None),
    }
}

/// What passes both filters has wavelengths from the low pass to the high pass.
fn check_band(table: &FileTable, cutoffs: [Option<f64>; 2], checks: &mut Checks) -> Option<()> {
    let [Some(low), Some(high)] = cutoffs else {
        return Some(());
    };
    if low < high {
        return Some(());
    }
    let message = format!("`low_pass = {low}` and `high_pass = {high}` leave no waves");
    let [low, high] = [&table.low_pass, &table.high_pass].map(Key::written);
    let problem = Problem::new(message, low?.span.clone(), "removes shorter waves")
        .and(high?.span.clone(), "removes longer ones");
    checks.problems.push(problem.help(
        "these are wavelengths: what is left lies between `low_pass` and a longer `high_pass`",
    ));
    None
}

fn resample(table: &FileTable, checks: &mut Checks) -> Option<Option<[u32; 2]>> {
    let Some(written) = table.resample.written() else {
        return (!checks.is_excused("resample")).then_some(None);
    };
    let [x, y] = written.on_either();
    let along_x = checks.is_whole_in("resample", &x, &NODES)?;
    let along_y = checks.is_whole_in("resample", &y, &NODES)?;
    let open = table.periodic.written().filter(|periodic| !periodic.value);
    if let Some(open) = open {
        let message = format!("`resample = {}` needs a periodic map", written.value);
        let problem = Problem::new(message, written.span.clone(), "interpolates Fourier modes")
            .and(open.span.clone(), "says that it is none");
        checks.problems.push(problem.help(
            "leave it out; with `low_pass` a map that is not periodic loses its short waves and keeps \
             its nodes",
        ));
        return None;
    }
    Some(Some([along_x, along_y]))
}

/// What is left of the map once it is prepared; whatever leaves nothing is reported.
pub fn part(asked: &Asked, map: &MapFile, cell: Cell, checks: &mut Checks) -> Option<SeenMap> {
    let grid = Grid::new(map.nodes, cell).expect("the file has as many numbers");
    let scan = match map.clone().scan(Some(cell.size()), asked.height_scale) {
        Ok(scan) => scan,
        Err(error) => return refuse(asked, format!("is no map of heights: {error}"), checks),
    };
    let before = spread(scan.heights());
    let crop = asked.table.crop.written();
    let levelled = match asked.preparation.levelled(scan) {
        Ok(levelled) => levelled,
        Err(error) => {
            let message = format!("`crop` is no part of {:?}: {error}", asked.path.value);
            let place = crop.map_or(&asked.path.span, |crop| &crop.span).clone();
            let [x, y] = cell.size().map(decimal::nearest);
            let problem = Problem::new(message, place, "must lie within the map");
            checks.problems.push(problem.help(format!("the map has sides of {x:?} and {y:?}")));
            return None;
        }
    };
    check_nodes(asked, levelled.grid(), checks)?;
    check_holes(asked, &levelled, checks)?;
    check_heights(asked, &levelled, before, checks)?;
    check_cutoffs(asked, levelled.grid(), checks)?;
    check_resampled(asked, levelled.grid(), checks)?;
    let (nodes, side) = prepared(asked, levelled.grid());
    Some(SeenMap {
        nodes: PerAxis(nodes),
        side: PerAxis(side),
        channel: Some(map.channel.clone()),
        missing: levelled.missing(),
        points: levelled.grid().count(),
        file: Some(grid),
    })
}

/// Refuses a file, and says what would be one.
fn refuse<T>(asked: &Asked, reason: String, checks: &mut Checks) -> Option<T> {
    let message = format!("{:?} {reason}", asked.path.value);
    let problem = Problem::new(message, asked.path.span.clone(), "this file");
    checks.report("path", problem);
    None
}

/// Nodes along either axis so many times over where the map is mirrored.
fn copies(asked: &Asked) -> u32 {
    if asked.edges == Edges::Mirror { 2 } else { 1 }
}

fn check_nodes(asked: &Asked, grid: Grid, checks: &mut Checks) -> Option<()> {
    let most = NODES.end() / copies(asked);
    let can_be = *NODES.start() as usize..=most as usize;
    let nodes = grid.nodes();
    if nodes.iter().all(|nodes| can_be.contains(nodes)) {
        return Some(());
    }
    let found = match nodes {
        [x, y] if x == y => format!("{x} nodes per side"),
        [x, y] => format!("{x} × {y} nodes"),
    };
    let found = match asked.table.crop.written() {
        Some(_) => format!("has {found} in the part that is cut out"),
        None => format!("has {found}"),
    };
    let least = NODES.start();
    refuse(asked, format!("{found}, here it must be from {least} to {most}"), checks)
}

/// Points that were not measured need a word.
fn check_holes(asked: &Asked, scan: &Scan, checks: &mut Checks) -> Option<()> {
    let (missing, points) = (scan.missing(), scan.grid().count());
    if missing == 0 {
        return Some(());
    }
    if missing == points {
        return refuse(asked, "holds no measured point".to_owned(), checks);
    }
    if asked.preparation.fill.unwrap_or_default() != Fill::Error {
        return Some(());
    }
    let share = 100.0 * missing as f64 / points as f64;
    let message =
        format!("{:?} lacks {missing} of {points} points, {share:.3} %", asked.path.value);
    let fill = asked.table.fill.written().map(|fill| &fill.span);
    let place = fill.unwrap_or(&asked.path.span).clone();
    checks.report("fill", Problem::new(message, place, "not all of it was measured"));
    None
}

fn check_heights(asked: &Asked, levelled: &Scan, before: f64, checks: &mut Checks) -> Option<()> {
    if before != 0.0 && !QUANTITY.contains(&before) {
        let message = format!("{:?} has heights that spread over {before:?}", asked.path.value);
        let label = "must be from 1e-30 to 1e30; another unit may help";
        checks.report("path", Problem::new(message, asked.path.span.clone(), label));
        return None;
    }
    // Edges are made to meet without the mean plane: an inclined plane has no roughness.
    let left = match asked.edges {
        Edges::Mirror | Edges::Taper { .. } => Level::Plane.level(levelled.clone()),
        Edges::Periodic | Edges::Open => levelled.clone(),
    };
    if spread(left.heights()) > 1e-12 * before {
        return Some(());
    }
    let when = match (asked.preparation.level, asked.edges) {
        (Some(Level::Plane | Level::Quadric), _) => "once it is levelled",
        _ => "once its edges meet",
    };
    refuse(asked, format!("is flat: no roughness is left {when}"), checks)
}

/// Waves that are cut off lie between two steps and the longer side.
fn check_cutoffs(asked: &Asked, grid: Grid, checks: &mut Checks) -> Option<()> {
    let [x, y] = grid.spacing();
    let least = decimal::nearest(2.0 * x.max(y));
    let most = decimal::nearest(grid.cell().longer_side());
    let table = asked.table;
    let both = [
        ("high_pass", asked.preparation.high_pass, &table.high_pass),
        ("low_pass", asked.preparation.low_pass, &table.low_pass),
    ];
    let mut all = Some(());
    for (name, cutoff, key) in both {
        let Some((cutoff, written)) = cutoff.zip(key.written()) else {
            continue;
        };
        // Two steps, or a side, that a person has written with a few digits.
        let rounding = 1e-6;
        if cutoff >= least * (1.0 - rounding) && cutoff <= most * (1.0 + rounding) {
            continue;
        }
        let message = format!("`{name} = {cutoff}` is no wavelength of {:?}", asked.path.value);
        let label = format!("must be from {least:?}, two steps, to {most:?}, the longer side");
        checks.report(name, Problem::new(message, written.span.clone(), label));
        all = None;
    }
    all
}

/// Of a rectangle nobody can tell what cells one number of nodes is to make.
fn check_resampled(asked: &Asked, grid: Grid, checks: &mut Checks) -> Option<()> {
    let Some(written) = asked.table.resample.written() else {
        return Some(());
    };
    let [side_x, side_y] = grid.cell().size();
    let OnAxes::Both(nodes) = written.value else {
        return Some(());
    };
    if (side_x - side_y).abs() <= 1e-9 * side_x {
        return Some(());
    }
    let message = format!("{:?} is a rectangle, and `resample` is not", asked.path.value);
    let longer = side_x.max(side_y);
    let square = [side_x, side_y].map(|side| (nodes as f64 * side / longer).round());
    let problem = Problem::new(message, written.span.clone(), "one number");
    checks.problems.push(problem.help(format!(
        "give the nodes along x and along y; with `resample = {}` cells are square, or nearly so",
        OnAxes::Each(square)
    )));
    None
}

/// Nodes and sides once edges meet.
fn prepared(asked: &Asked, grid: Grid) -> ([u32; 2], [f64; 2]) {
    let nodes = grid.nodes().map(|nodes| nodes as u32);
    let nodes = asked.preparation.resample.unwrap_or(nodes);
    let copies = copies(asked);
    let side = grid.cell().size().map(|side| f64::from(copies) * side);
    (nodes.map(|nodes| copies * nodes), side)
}
