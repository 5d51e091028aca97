//! Scans of the nanomeasuring machine of SIOS, packed into a zip archive.
//!
//! The description of the scan, `NAME.dsc`, gives the numbers of scans and of lines and the
//! distances of lines and of points. The line j of scan i has the description `NAME_i_j.dsc`, which
//! lists the columns, and the data `NAME_i_j.dat`, a text. The column `-Lz+Az` has the heights in
//! metres. The sides are nodes × distance. Lines run along x; the first line has y = 0. The format
//! has no marker of missing points.
//!
//! The layout is that of SurfaceTopography 1.27.1, whose example is a scan of December 2024.

use super::archive::Archive;
use super::channel::{Channel, Sides};
use super::input::{Entries, decode_text};
use super::raster::{Raster, checked_nodes};
use super::unit::{Unit, y_ratio};
use super::{Format, FormatError, at_least_one};

pub(crate) const FORMAT: Format = Format::new("nmm", "nanomeasuring machine of SIOS", read);

const TITLE: &str = "Scan procedure description file";
/// Name of the column of heights.
const HEIGHTS: &str = "-Lz+Az";
/// Maximum length of a description or of the data of a line.
const MAX_FILE: usize = 1 << 28;

fn read(bytes: &[u8]) -> Result<Vec<Channel<'_>>, FormatError> {
    let mut archive = Archive::of_format(bytes)?;
    let is_hidden =
        |path: &str| path.rsplit('/').next().is_some_and(|name| name.starts_with(['.', '_']));
    // The descriptions of lines have longer names than the description of the scan.
    let names = archive.names().filter(|name| name.ends_with(".dsc") && !is_hidden(name));
    let shortest = names.min_by_key(|name| (name.len(), name.to_string()));
    let description = shortest.ok_or(FormatError::Signature)?.into_owned();
    let stem = description.strip_suffix(".dsc").unwrap_or_default();
    let text = text(&mut archive, &description)?;
    if !text.contains(TITLE) {
        return Err(FormatError::Signature);
    }
    let entries = Entries::from_lines(text.lines(), ':');
    let (dx, unit_x) = entries.quantity("Distance beetween points")?;
    let (dy, unit_y) = entries.quantity("Distance beetween lines")?;
    let dy = dy * y_ratio(&unit_y, &unit_x)?;
    let lines = entries.whole("Number of lines")?;
    let scans = 1..=entries.whole("Number of scans")?;
    let channels = scans.map(|scan| {
        let mut heights = Vec::new();
        let mut points = 0;
        for line in 1..=lines {
            let before = heights.len();
            let name = format!("{stem}_{scan}_{line}");
            add_line(&mut archive, &name, &mut heights)?;
            let found = heights.len() - before;
            if line == 1 {
                points = found;
            } else if found != points {
                let allowed = format!("{points}, as in the lines before");
                return Err(FormatError::value(&format!("points of {name}"), found, &allowed));
            }
        }
        let nodes = checked_nodes([points as i64, lines])?;
        let size = Sides::of_steps(nodes, [dx, dy], &Unit::parse(&unit_x))?;
        let raster = Raster::from_rows(nodes, heights);
        Ok(Channel::new(format!("Scan {scan}"), Unit::Length(1.0), size, raster))
    });
    at_least_one(channels, "Number of scans")
}

/// Appends the heights of a line to `heights`.
fn add_line(
    archive: &mut Archive<'_>,
    name: &str,
    heights: &mut Vec<f64>,
) -> Result<(), FormatError> {
    let description = text(archive, &format!("{name}.dsc"))?;
    // Lines such as `11 : 03-Dec-2024 08:11:24 : -Lz+Az : 1501 : Surface height (-LZ+AZ)`.
    let columns = description.lines().filter_map(|line| line.split(" : ").nth(2));
    let found = columns.map(str::trim).position(|column| column == HEIGHTS);
    let column = found.ok_or_else(|| FormatError::missing(format!("{HEIGHTS} in {name}.dsc")))?;
    let data = text(archive, &format!("{name}.dat"))?;
    let rows = data.lines().enumerate().filter(|(_, row)| !row.trim().is_empty());
    for (index, row) in rows {
        let word = row.split_whitespace().nth(column);
        let number = word.and_then(|word| word.parse().ok());
        heights.push(number.ok_or_else(|| FormatError::Line {
            line: index + 1,
            problem: format!("`{name}.dat` has no number in column {}", column + 1),
        })?);
    }
    Ok(())
}

fn text(archive: &mut Archive<'_>, name: &str) -> Result<String, FormatError> {
    Ok(decode_text(&archive.file(name, MAX_FILE)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::samples::packed;

    fn scan(lines: [&str; 2]) -> Vec<u8> {
        let rule = "------------------------------------------\n";
        let description = format!(
            "{rule}{TITLE}\n{rule}Number of lines : 2\nNumber of scans : 1\n\
             Distance beetween points : 0.1 [um]\nDistance beetween lines : 0.5 [um]\n"
        );
        let columns = "0 : now : Lx : 2 : X length\n1 : now : -Lz+Az : 2 : Surface height\n";
        packed(&[
            ("scan/a.dsc", description.into_bytes()),
            ("scan/a_1_1.dsc", columns.as_bytes().to_vec()),
            ("scan/a_1_1.dat", lines[0].as_bytes().to_vec()),
            ("scan/a_1_2.dsc", columns.as_bytes().to_vec()),
            ("scan/a_1_2.dat", lines[1].as_bytes().to_vec()),
            ("__MACOSX/._a.dsc", vec![0]),
        ])
    }

    #[test]
    fn a_scan_may_lie_in_a_folder_of_the_archive() {
        let file = scan(["0 1e-9\n0 2e-9\n", "0 3e-9\n0 4e-9\n"]);
        let map = read(&file).unwrap()[0].map();
        assert_eq!(map.heights(), [1e-9, 3e-9, 2e-9, 4e-9]);
        let sides = map.size().sides().unwrap();
        assert!((sides[0] / 2e-7 - 1.0).abs() < 1e-12 && (sides[1] / 1e-6 - 1.0).abs() < 1e-12);
    }

    #[test]
    fn lines_of_different_lengths_are_refused() {
        let error = read(&scan(["0 1\n0 2\n", "0 3\n"])).unwrap_err();
        let message = "`points of scan/a_1_2` is 1; expected 2, as in the lines before";
        assert_eq!(error.to_string(), message);
        let error = read(&scan(["0 1\n0 2\n", "0 3\n4\n"])).unwrap_err();
        assert_eq!(error.to_string(), "line 2: `scan/a_1_2.dat` has no number in column 2");
    }
}
