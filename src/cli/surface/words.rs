//! The channels of a file, in words.

use std::io::{self, Write};
use std::path::Path;

use comfy_table::{CellAlignment, Table as Grid, presets};

use super::Described;
use crate::cli::show::short;
use asperity_manifest::diagnostics::wrapped;
use asperity_topography_files::{Quantity, Size, TopographyFile};

/// Columns of words; those of numbers are in line on the right.
const WORDS: usize = 4;

/// Prints the format, a line for each channel, and what should be known.
pub fn write_summary(
    out: &mut impl Write,
    file: &TopographyFile<'_>,
    path: &Path,
    described: &[Described<'_>],
    chosen: usize,
) -> io::Result<()> {
    let format = file.format();
    writeln!(out, "file     {}", path.display())?;
    writeln!(out, "format   {}: {}", format.name(), format.title())?;
    writeln!(out, "{}", grid(described))?;
    for one in described.iter().filter(|one| one.statistics.missing > 0) {
        let [x, y] = one.channel.nodes();
        let share = 100.0 * one.statistics.missing as f64 / (x * y) as f64;
        let missing = one.statistics.missing;
        let number = one.number;
        writeln!(out, "missing  {missing} points of channel {number}, {share:.3} %")?;
    }
    writeln!(out, "{}", wrapped(&heights(file, chosen, described.len())))
}

/// Which channel counts, and why.
fn heights(file: &TopographyFile<'_>, chosen: usize, listed: usize) -> String {
    let Some(channel) = file.channels().get(chosen) else {
        return String::new();
    };
    let (name, number) = (channel.name(), chosen + 1);
    let count = file.channels().len();
    let why = match (channel.quantity(), count, listed) {
        (Quantity::Height, 1, _) => "",
        (Quantity::Height, _, 1) => ", as asked",
        (Quantity::Height, ..) => ", the first that holds heights",
        (Quantity::Unitless, ..) => ", in no unit",
        (Quantity::Other(_), ..) => return format!("heights  none; channel {number} is `{name}`"),
    };
    format!("heights  channel {number}, `{name}`{why}")
}

fn grid(described: &[Described<'_>]) -> Grid {
    let mut grid = Grid::new();
    grid.load_preset(presets::NOTHING);
    grid.set_header([
        "channel",
        "nodes",
        "size",
        "unit",
        "missing",
        "rms height",
        "rms slope",
        "lowest",
        "highest",
    ]);
    for one in described {
        grid.add_row(row(one));
    }
    let numbers = grid.column_iter_mut().skip(WORDS);
    numbers.for_each(|column| column.set_cell_alignment(CellAlignment::Right));
    grid
}

fn row(one: &Described<'_>) -> [String; 9] {
    let number = |number: Option<f64>| number.map_or_else(|| "–".to_owned(), short);
    let heights = one.statistics.heights.as_ref();
    let [x, y] = one.channel.nodes();
    let size = match one.channel.size() {
        Size::Metres([x, y]) => format!("{} × {} m", short(x), short(y)),
        Size::Unitless([x, y]) => format!("{} × {}", short(x), short(y)),
        Size::Unknown => "–".to_owned(),
    };
    [
        format!("{} {}", one.number, one.channel.name()),
        format!("{x} × {y}"),
        size,
        one.channel.unit().unwrap_or("–").to_owned(),
        one.statistics.missing.to_string(),
        number(heights.map(|heights| heights.rms_height)),
        number(heights.and_then(|heights| heights.rms_slope)),
        number(heights.map(|heights| heights.lowest)),
        number(heights.map(|heights| heights.highest)),
    ]
}
