//! Checks of the map in a file: its unit and sides, what is done to it, and what is left of it.

use std::ops::{Bound, RangeBounds};

use super::{Asked, FileTable};
use crate::generate::map_file::MapFile;
use crate::generate::mesh::{NODES, sides_within, square_cells};
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
use asperity_topography_files::{Quantity, Size, is_metre};

/// How far sides that a person has written may be from those of the file, as a share of these.
const SAME: f64 = 1e-6;

/// What lengths of a map are.
pub struct Lengths {
    /// Their unit.
    pub unit: String,
    /// Sides as the manifest has them, if it does.
    pub side: Option<PerAxis<f64>>,
    /// The cell that the map in the file fills.
    pub cell: Cell,
}

/// The sides that the manifest gives, if it does.
pub fn written_side(table: &FileTable, checks: &mut Checks) -> Option<Option<PerAxis<f64>>> {
    match table.side.written() {
        Some(sides) => Some(Some(PerAxis(sides_within(sides, checks)?))),
        None => (!checks.is_excused("side")).then_some(None),
    }
}

/// Unit and sides of a map; contradictions are reported.
pub fn lengths(asked: &Asked, map: &MapFile, checks: &mut Checks) -> Option<Lengths> {
    let written = written_side(asked.table, checks);
    let unit = unit(asked, map, checks)?;
    let known = sides_of_file(asked, map, checks)?;
    let side = written?;
    let sides = match (asked.table.side.written(), side, known) {
        (Some(written), Some(PerAxis(sides)), Some(known)) => {
            check_same(asked, written, sides, known, &unit, checks)?;
            sides
        }
        (Some(written), Some(PerAxis(sides)), None) => {
            check_both(asked.path, written, map.nodes, checks)?;
            sides
        }
        (_, _, Some(known)) => known,
        _ => return lacks_side(asked, map, checks),
    };
    if let Some(side) = sides.into_iter().find(|side| !QUANTITY.contains(side)) {
        let message = format!("{:?} has a side of {side:?}", asked.path.value);
        let label = "must be from 1e-30 to 1e30";
        return checks.reject(Problem::new(message, asked.path.span.clone(), label));
    }
    let cell = Cell::new(sides).expect("sides were checked");
    Some(Lengths { unit, side, cell })
}

/// Whether lengths are those of the file in metres: its heights are, or its sides beside heights of
/// no unit.
fn is_in_metres(map: &MapFile) -> bool {
    match map.quantity {
        Quantity::Height => true,
        Quantity::Unitless => matches!(map.size, Size::Metres(_)),
        Quantity::Other(_) => false,
    }
}

fn overrides(table: &FileTable) -> bool {
    table.overrides.value() == Some(true)
}

/// Whether the manifest gives a unit in place of the file's.
fn has_other_unit(table: &FileTable) -> bool {
    let unit = table.unit.written();
    overrides(table) && unit.is_some_and(|unit| !is_metre(&unit.value))
}

fn unit(asked: &Asked, map: &MapFile, checks: &mut Checks) -> Option<String> {
    let Asked { path, table, .. } = asked;
    let written = table.unit.written();
    if let Quantity::Other(unit) = &map.quantity
        && !(overrides(table) && written.is_some())
    {
        let channel = &map.channel;
        let message = format!(
            "channel {}, `{}`, of {:?} is in `{unit}` and holds no heights",
            channel.number, channel.name, path.value
        );
        let place = table.channel.written().map_or(&path.span, |channel| &channel.span);
        let problem = Problem::new(message, place.clone(), "this channel");
        return checks.reject(problem.help(
            "choose another; where these are heights all the same, `override = true` with `unit` and \
             `height_scale` says so",
        ));
    }
    let Some(written) = written else {
        return Some(if is_in_metres(map) { "m".to_owned() } else { String::new() });
    };
    if !is_in_metres(map) || overrides(table) {
        return Some(written.value.clone());
    }
    if is_metre(&written.value) {
        return Some("m".to_owned());
    }
    let message = format!(
        "`unit = {:?}` contradicts {:?}, whose lengths are read in \"m\"",
        written.value, path.value
    );
    let problem = Problem::new(message, written.span.clone(), "this unit")
        .and(path.span.clone(), "has a unit of its own");
    checks.reject(problem.help(
        "leave `unit` out: lengths of a file that names any unit become metres; if it names a wrong \
         one, `override = true` makes this the unit of `side` and of heights × `height_scale`",
    ))
}

/// The sides that the file gives in the unit of the map, if it does.
fn sides_of_file(asked: &Asked, map: &MapFile, checks: &mut Checks) -> Option<Option<[f64; 2]>> {
    if has_other_unit(asked.table) && matches!(map.size, Size::Metres(_)) {
        return Some(None);
    }
    Some(match (&map.quantity, map.size) {
        (Quantity::Height | Quantity::Other(_), Size::Metres(sides)) => Some(sides),
        (Quantity::Unitless, Size::Unitless(sides)) => Some(sides),
        (Quantity::Unitless, Size::Metres(sides)) => {
            let is_said = asked.table.height_scale.written().is_some() || overrides(asked.table);
            if !is_said {
                let message =
                    format!("{:?} has sides in metres, and heights in no unit", asked.path.value);
                let problem = Problem::new(message, asked.path.span.clone(), "this file");
                return checks.reject(problem.help(
                    "say what its heights are multiplied by to be metres: `height_scale = 1e-6` of \
                     micrometres, `height_scale = 1` of metres",
                ));
            }
            Some(sides)
        }
        (_, Size::Unitless(_) | Size::Unknown) => None,
    })
}

/// Sides that are given twice agree, unless the manifest overrides the file.
fn check_same(
    asked: &Asked,
    written: &Written<OnAxes<f64>>,
    sides: [f64; 2],
    known: [f64; 2],
    unit: &str,
    checks: &mut Checks,
) -> Option<()> {
    let is_same = |axis: usize| (sides[axis] - known[axis]).abs() <= SAME * known[axis];
    if overrides(asked.table) || (is_same(0) && is_same(1)) {
        return Some(());
    }
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    let said = match known.map(decimal::nearest) {
        [x, y] if x == y => format!("{x:?}"),
        [x, y] => format!("[{x:?}, {y:?}]"),
    };
    let message = format!(
        "`side = {}` contradicts {:?}, which says {said}{unit}",
        written.value, asked.path.value
    );
    let problem = Problem::new(message, written.span.clone(), "this side")
        .and(asked.path.span.clone(), "has sides of its own");
    checks.reject(problem.help("leave `side` out, or say `override = true` if the file is wrong"))
}

/// A map of more nodes along one axis has two sides, and only its owner knows them.
fn check_both(
    path: &Written<String>,
    sides: &Written<OnAxes<f64>>,
    [nodes_x, nodes_y]: [usize; 2],
    checks: &mut Checks,
) -> Option<()> {
    let OnAxes::Both(side) = sides.value else {
        return Some(());
    };
    if nodes_x == nodes_y {
        return Some(());
    }
    let message = format!("{:?} is a rectangle, and `side` is not", path.value);
    let problem = Problem::new(message, sides.span.clone(), "one number")
        .and(path.span.clone(), "has more nodes along one axis");
    let counts = [nodes_x, nodes_y].map(|nodes| u32::try_from(nodes).unwrap_or(u32::MAX));
    checks.reject(problem.help(format!(
        "give both sides, along the first axis of the array and along the second; with \
         `side = {}` cells are square",
        square_cells(counts, side)
    )))
}

fn lacks_side(asked: &Asked, map: &MapFile, checks: &mut Checks) -> Option<Lengths> {
    let says = match map.size {
        Size::Unitless([x, y]) => format!("says {x} × {y} in no unit"),
        Size::Metres([x, y]) => format!("says {x:?} × {y:?} m, not in the unit of the manifest"),
        Size::Unknown => "does not say it".to_owned(),
    };
    let message = format!("`side` is not given, and {:?} {says}", asked.path.value);
    checks.refuse("side", message, &asked.path.span, "how large is its map?")
}

/// What is asked for, as far as it can be judged without the map.
pub fn preparation(table: &FileTable, checks: &mut Checks) -> Option<Preparation> {
    let crop = crop(table, checks);
    let resample = resample(table, checks);
    let high_pass = cutoff("high_pass", &table.high_pass, checks);
    let low_pass = cutoff("low_pass", &table.low_pass, checks);
    let (high_pass, low_pass) = (high_pass?, low_pass?);
    check_band(table, [low_pass, high_pass], checks)?;
    let (level, fill) = (table.level.value(), table.fill.value());
    Some(Preparation { crop: crop?, level, fill, high_pass, low_pass, resample: resample? })
}

fn crop(table: &FileTable, checks: &mut Checks) -> Option<Option<Crop>> {
    let Some(written) = table.crop.written() else {
        return (!checks.is_excused("crop")).then_some(None);
    };
    if let Some(periodic) = table.periodic.written().filter(|periodic| periodic.value) {
        let message = "a part of a map does not repeat itself, `periodic` says that it does";
        let problem = Problem::new(message, written.span.clone(), "cuts out a part");
        return checks.reject(problem.and(periodic.span.clone(), "must be `false` beside it"));
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
    checks.reject(problem.help(
        "these are wavelengths: what is left lies between `low_pass` and a longer `high_pass`",
    ))
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
        return checks.reject(problem.help(
            "leave it out; with `low_pass` a map that is not periodic loses its short waves and keeps \
             its nodes",
        ));
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
            let sides = format!("the map has sides of {x:?} and {y:?}");
            return checks.reject(problem.help(sides));
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
    checks.refuse("path", message, &asked.path.span, "this file")
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
    let place = fill.unwrap_or(&asked.path.span);
    checks.refuse("fill", message, place, "not all of it was measured")
}

fn check_heights(asked: &Asked, levelled: &Scan, before: f64, checks: &mut Checks) -> Option<()> {
    if before != 0.0 && !QUANTITY.contains(&before) {
        let message = format!("{:?} has heights that spread over {before:?}", asked.path.value);
        let label = "must be from 1e-30 to 1e30; another unit may help";
        return checks.refuse("path", message, &asked.path.span, label);
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
    checks.reject(problem.help(format!(
        "give the nodes along x and along y; with `resample = {}` cells are square, or nearly so",
        OnAxes::Each(square)
    )))
}

/// Nodes and sides once edges meet.
fn prepared(asked: &Asked, grid: Grid) -> ([u32; 2], [f64; 2]) {
    let nodes = grid.nodes().map(|nodes| nodes as u32);
    let nodes = asked.preparation.resample.unwrap_or(nodes);
    let copies = copies(asked);
    let side = grid.cell().size().map(|side| f64::from(copies) * side);
    (nodes.map(|nodes| copies * nodes), side)
}
