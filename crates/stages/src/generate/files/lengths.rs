//! Checks of the unit and of the sides of the map in a file.

use std::ops::RangeBounds;

use super::{FileKeys, FileTable, is_profile};
use crate::map_file::MapFile;
use crate::per_axis::PerAxis;
use asperity_manifest::decimal;
use asperity_manifest::diagnostics::Problem;
use asperity_manifest::keys::bounds::QUANTITY;
use asperity_manifest::keys::checks::Checks;
use asperity_manifest::keys::{OnAxes, Spanned};
use asperity_mechanics::grid::Cell;
use asperity_topography_files::{Quantity, Size, is_metre};

/// Relative tolerance between the sides in the manifest and the sides in the file.
const SAME: f64 = 1e-6;

/// The unit and the sides of a map in its file.
pub struct Lengths {
    /// Name of the unit of length.
    pub unit: String,
    /// Sides along x and y that the manifest gives, if it gives them.
    pub side: Option<PerAxis<f64>>,
    /// Cell of the map in the file, with the sides of the manifest or of the file.
    pub cell: Cell,
}

/// Returns the sides that the manifest gives along x and y, if it gives them. A profile of known
/// `nodes` has the side that is written along x, and one step across.
pub fn written_side(
    table: &FileTable,
    nodes: Option<[u32; 2]>,
    checks: &mut Checks,
) -> Option<Option<PerAxis<f64>>> {
    let Some(written) = checks.optional("side", &table.side)? else {
        return Some(None);
    };
    let sides = written.value.pair().map(decimal::nearest);
    let Some([nodes, _]) = nodes.filter(|_| is_profile(table)) else {
        return Some(Some(PerAxis(sides)));
    };
    if let OnAxes::Each(_) = written.value {
        let message = "a profile has one length, but `side` is a pair";
        return checks.refuse("side", message, &written.span, "must be one number");
    }
    Some(Some(PerAxis([sides[0], decimal::nearest(sides[0] / f64::from(nodes))])))
}

/// Returns the unit and the sides of a map. Reports contradictions between manifest and file.
pub fn lengths(keys: &FileKeys, map: &MapFile, checks: &mut Checks) -> Option<Lengths> {
    let nodes = map.nodes.map(|nodes| u32::try_from(nodes).unwrap_or(u32::MAX));
    let written = written_side(keys.table, Some(nodes), checks);
    let unit = unit(keys, map, checks)?;
    let known = sides_of_file(keys, map, checks)?;
    let side = written?;
    let sides = match (keys.table.side.written(), side, known) {
        (Some(written), Some(PerAxis(sides)), Some(known)) => {
            check_same(keys, written, sides, known, &unit, checks)?;
            sides
        }
        (Some(written), Some(PerAxis(sides)), None) => {
            check_both(keys.path, written, map.nodes, checks)?;
            sides
        }
        (_, _, Some(known)) => known,
        _ => return missing_side(keys, map, checks),
    };
    if let Some(side) = sides.into_iter().find(|side| !QUANTITY.contains(side)) {
        let message = format!("{:?} has a side of {side:?}", keys.path.value);
        let label = "sides must be from 1e-30 to 1e30";
        return checks.reject(Problem::new(message, keys.path.span.clone(), label));
    }
    let cell = Cell::new(sides).expect("sides were checked");
    Some(Lengths { unit, side, cell })
}

/// Returns whether the lengths of a map are read in metres. They are if the heights have a unit of
/// length, or if the heights have no unit and the sides have one.
pub fn is_in_metres(map: &MapFile) -> bool {
    match map.quantity {
        Quantity::Height => true,
        Quantity::Unitless => matches!(map.size, Size::Metres(_)),
        Quantity::Other(_) => false,
    }
}

fn overrides(table: &FileTable) -> bool {
    table.overrides.value() == Some(true)
}

/// Returns whether the manifest replaces the unit of the file by a unit other than the metre.
fn has_other_unit(table: &FileTable) -> bool {
    let unit = table.unit.written();
    overrides(table) && unit.is_some_and(|unit| !is_metre(&unit.value))
}

/// Returns whether the file alone gives the side of a map, as a number without a unit.
fn is_side_of_file(table: &FileTable, map: &MapFile) -> bool {
    matches!(map.size, Size::Unitless(_)) && table.side.written().is_none()
}

/// Returns the unit of length of a map. Refuses a channel without heights, a unit that contradicts
/// the file, and lengths with a unit beside a side without one.
fn unit(keys: &FileKeys, map: &MapFile, checks: &mut Checks) -> Option<String> {
    let FileKeys { path, table, .. } = keys;
    let written = table.unit.written();
    if let Quantity::Other(unit) = &map.quantity
        && !(overrides(table) && written.is_some())
    {
        let channel = &map.channel;
        let message = format!(
            "channel {}, `{}`, of {:?} has the unit `{unit}` and holds no heights",
            channel.number, channel.name, path.value
        );
        let span = table.channel.written().map_or(&path.span, |channel| &channel.span);
        let problem = Problem::new(message, span.clone(), "channel without heights");
        return checks.reject(problem.help(
            "choose another channel; if these are heights, set `override = true`, `unit` and \
             `height_scale`",
        ));
    }
    let Some(written) = written else {
        return match &checks.units.length {
            _ if is_in_metres(map) => Some("m".to_owned()),
            None => Some(String::new()),
            Some(named) if is_side_of_file(table, map) => {
                let (symbol, span) = (named.unit.symbol, named.span.clone());
                let message = format!("the lengths of {:?} have no unit", path.value);
                let help = format!(
                    "write `unit = {symbol:?}` if this is the unit of the file, or a number \
                     without a unit"
                );
                checks.reject(
                    Problem::new(message, span, "length with a unit")
                        .and(path.span.clone(), "lengths without a unit")
                        .help(help),
                )
            }
            Some(named) => Some(named.unit.symbol.to_owned()),
        };
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
    let problem = Problem::new(message, written.span.clone(), "contradicts the unit of the file")
        .and(path.span.clone(), "has lengths in \"m\"");
    checks.reject(problem.help(
        "remove `unit`: lengths of a file with a unit are converted to metres; if the unit of the file is \
         wrong, `override = true` makes this the unit of `side` and of heights × `height_scale`",
    ))
}

/// Returns the sides of the map in the file, or `Some(None)` if the file does not contain them in
/// the unit of length of the map. Refuses a file with sides in metres and heights without a unit,
/// unless the manifest gives `height_scale` or overrides the file.
fn sides_of_file(keys: &FileKeys, map: &MapFile, checks: &mut Checks) -> Option<Option<[f64; 2]>> {
    if has_other_unit(keys.table) && matches!(map.size, Size::Metres(_)) {
        return Some(None);
    }
    Some(match (&map.quantity, map.size) {
        (Quantity::Height | Quantity::Other(_), Size::Metres(sides)) => Some(sides),
        (Quantity::Unitless, Size::Unitless(sides)) => Some(sides),
        (Quantity::Unitless, Size::Metres(sides)) => {
            let is_said = keys.table.height_scale.written().is_some() || overrides(keys.table);
            if !is_said {
                let message =
                    format!("{:?} has sides in metres and heights without a unit", keys.path.value);
                let problem = Problem::new(message, keys.path.span.clone(), "needs `height_scale`");
                return checks.reject(problem.help(
                    "set the factor that converts its heights to metres: `height_scale = 1e-6` for \
                     micrometres, `height_scale = 1` for metres",
                ));
            }
            Some(sides)
        }
        (_, Size::Unitless(_) | Size::Unknown) => None,
    })
}

/// Refuses sides in the manifest that differ from those of the file, unless the manifest overrides
/// the file.
fn check_same(
    keys: &FileKeys,
    written: &Spanned<OnAxes<f64>>,
    sides: [f64; 2],
    known: [f64; 2],
    unit: &str,
    checks: &mut Checks,
) -> Option<()> {
    let is_same = |axis: usize| (sides[axis] - known[axis]).abs() <= SAME * known[axis];
    if overrides(keys.table) || (is_same(0) && is_same(1)) {
        return Some(());
    }
    let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
    let said = match known.map(decimal::nearest) {
        [x, y] if x == y => format!("{x:?}"),
        [x, y] => format!("[{x:?}, {y:?}]"),
    };
    let message = format!(
        "`side = {}` contradicts {:?}, whose side is {said}{unit}",
        written.value, keys.path.value
    );
    let problem = Problem::new(message, written.span.clone(), "contradicts the sides of the file")
        .and(keys.path.span.clone(), "the file gives a different side");
    checks.reject(problem.help("remove `side`, or set `override = true` if the file is wrong"))
}

/// Refuses one side for a map with different numbers of nodes along x and y, because the shape of
/// its cells is then unknown.
fn check_both(
    path: &Spanned<String>,
    sides: &Spanned<OnAxes<f64>>,
    [nodes_x, nodes_y]: [usize; 2],
    checks: &mut Checks,
) -> Option<()> {
    if matches!(sides.value, OnAxes::Each(_)) || nodes_x == nodes_y || nodes_y == 1 {
        return Some(());
    }
    let message = format!(
        "{:?} has different numbers of nodes along x and y, but `side` is one number",
        path.value
    );
    let problem = Problem::new(message, sides.span.clone(), "one number")
        .and(path.span.clone(), "rectangular map");
    checks.reject(problem.help("give the sides along the first and the second axis of the array"))
}

/// Reports that neither the manifest nor the file gives the side of the map.
fn missing_side(keys: &FileKeys, map: &MapFile, checks: &mut Checks) -> Option<Lengths> {
    let says = match map.size {
        Size::Unknown if map.unknown_side_unit.is_some() => {
            let unit = map.unknown_side_unit.as_deref().unwrap_or_default();
            format!("gives it in `{unit}`, which is no known unit of length")
        }
        Size::Unitless([x, y]) => format!("has {x} × {y} without a unit"),
        Size::Metres([x, y]) => format!("has {x:?} × {y:?} m, not in the unit of the manifest"),
        Size::Unknown => "does not contain it".to_owned(),
    };
    let message = format!("`side` is not given, and {:?} {says}", keys.path.value);
    checks.refuse("side", message, &keys.path.span, "needs `side`")
}
