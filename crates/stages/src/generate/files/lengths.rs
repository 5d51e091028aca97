//! Checks of the unit and the sides of a measured map: what its file says and what the manifest says.

use std::ops::RangeBounds;

use super::Asked;
use super::keys::FileTable;
use crate::generate::PerAxis;
use crate::generate::map_file::MapFile;
use crate::generate::mesh::{sides_within, square_cells};
use asperity_contact::grid::Cell;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::written::checks::{Checks, QUANTITY};
use asperity_manifest::written::{OnAxes, Written};
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
        checks.problems.push(Problem::new(message, asked.path.span.clone(), label));
        return None;
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
    table.overrides.written().is_some_and(|written| written.value)
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
        checks.problems.push(problem.help(
            "choose another; where these are heights all the same, `override = true` with `unit` and \
             `height_scale` says so",
        ));
        return None;
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
    checks.problems.push(problem.help(
        "leave `unit` out: lengths of a file that names any unit become metres; if it names a wrong \
         one, `override = true` makes this the unit of `side` and of heights × `height_scale`",
    ));
    None
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
                checks.problems.push(problem.help(
                    "say what its heights are multiplied by to be metres: `height_scale = 1e-6` of \
                     micrometres, `height_scale = 1` of metres",
                ));
                return None;
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
    checks
        .problems
        .push(problem.help("leave `side` out, or say `override = true` if the file is wrong"));
    None
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
    checks.problems.push(problem.help(format!(
        "give both sides, along the first axis of the array and along the second; with \
         `side = {}` cells are square",
        square_cells(counts, side)
    )));
    None
}

fn lacks_side(asked: &Asked, map: &MapFile, checks: &mut Checks) -> Option<Lengths> {
    let says = match map.size {
        Size::Unitless([x, y]) => format!("says {x} × {y} in no unit"),
        Size::Metres([x, y]) => format!("says {x:?} × {y:?} m, not in the unit of the manifest"),
        Size::Unknown => "does not say it".to_owned(),
    };
    let message = format!("`side` is not given, and {:?} {says}", asked.path.value);
    let span = asked.path.span.clone();
    checks.report("side", Problem::new(message, span, "how large is its map?"));
    None
}
