//! Picture of the stages of a study: a box for each stage, with its kind and its numbers of tasks
//! and rows, and an arrow from each stage to the stages that read it.

use std::fmt::Write;

/// A box of the picture.
#[derive(Debug, Clone, PartialEq)]
pub struct StageBox<'a> {
    pub name: &'a str,
    pub kind: &'static str,
    /// Indices of the stages that this stage reads. They are smaller than its own index.
    pub inputs: &'a [usize],
    pub finished: usize,
    pub planned: usize,
    pub rows: usize,
}

const WIDTH: f64 = 164.0;
const HEIGHT: f64 = 58.0;
/// Space between boxes, horizontally and vertically.
const GAP: [f64; 2] = [14.0, 34.0];
/// Largest number of boxes in a row, so that texts stay legible on a narrow screen.
const IN_A_ROW: usize = 2;
/// Largest number of letters of a name.
const LETTERS: usize = 20;

/// Returns the picture as SVG. Its colours come from the style sheet of the page.
pub fn svg(stages: &[StageBox]) -> String {
    let rows = rows(stages);
    let widest = rows.iter().map(Vec::len).max().unwrap_or(0) as f64;
    let (width, height) = (
        widest * (WIDTH + GAP[0]) - GAP[0] + 2.0,
        rows.len() as f64 * (HEIGHT + GAP[1]) - GAP[1] + 2.0,
    );
    let mut corners = vec![[0.0; 2]; stages.len()];
    for (row, members) in rows.iter().enumerate() {
        let taken = members.len() as f64 * (WIDTH + GAP[0]) - GAP[0];
        for (column, &stage) in members.iter().enumerate() {
            let x = (width - taken) / 2.0 + column as f64 * (WIDTH + GAP[0]);
            corners[stage] = [x, 1.0 + row as f64 * (HEIGHT + GAP[1])];
        }
    }
    let mut arrows = String::new();
    let mut boxes = String::new();
    for (stage, &[x, y]) in stages.iter().zip(&corners) {
        for &input in stage.inputs {
            let [from_x, from_y] = corners[input];
            let (from, to) = ([from_x + WIDTH / 2.0, from_y + HEIGHT], [x + WIDTH / 2.0, y - 6.0]);
            let middle = f64::midpoint(from[1], to[1]);
            let _ = write!(
                arrows,
                "<path d=\"M{:.1} {:.1}C{:.1} {middle:.1} {:.1} {middle:.1} {:.1} {:.1}\" \
                 marker-end=\"url(#arrow)\"/>",
                from[0], from[1], from[0], to[0], to[0], to[1],
            );
        }
        let class = if stage.finished < stage.planned { " class=\"unfinished\"" } else { "" };
        let middle = x + WIDTH / 2.0;
        let _ = write!(
            boxes,
            "<g{class}><rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{WIDTH}\" height=\"{HEIGHT}\" \
             rx=\"5\"/><text class=\"name\" x=\"{middle:.1}\" y=\"{:.1}\">{}</text>\
             <text class=\"count\" x=\"{middle:.1}\" y=\"{:.1}\">{}</text>\
             <text class=\"count\" x=\"{middle:.1}\" y=\"{:.1}\">{}</text></g>",
            y + 18.0,
            shortened(stage.name),
            y + 34.0,
            stage.kind,
            y + 50.0,
            counts(stage),
        );
    }
    format!(
        "<svg class=\"stages\" role=\"img\" aria-label=\"Stages of the study\" \
         viewBox=\"0 0 {width:.0} {height:.0}\" width=\"{width:.0}\">\
         <defs><marker id=\"arrow\" viewBox=\"0 0 8 8\" refX=\"2\" refY=\"4\" markerWidth=\"6\" \
         markerHeight=\"6\" orient=\"auto\"><path d=\"M0 0L8 4L0 8z\"/></marker></defs>\
         {arrows}{boxes}</svg>"
    )
}

/// Arranges stages in rows: each stage is below all stages that it reads.
fn rows(stages: &[StageBox]) -> Vec<Vec<usize>> {
    let mut depths: Vec<usize> = Vec::new();
    for stage in stages {
        let depth = stage.inputs.iter().map(|&input| depths[input] + 1).max();
        depths.push(depth.unwrap_or(0));
    }
    let deepest = depths.iter().max().map_or(0, |depth| depth + 1);
    let level = |depth| (0..stages.len()).filter(|&stage| depths[stage] == depth).collect();
    let levels = (0..deepest).map(level);
    levels
        .flat_map(|level: Vec<usize>| {
            level.chunks(IN_A_ROW).map(<[usize]>::to_vec).collect::<Vec<_>>()
        })
        .collect()
}

fn counts(stage: &StageBox) -> String {
    let counted =
        |count: usize, thing| format!("{count} {thing}{}", if count == 1 { "" } else { "s" });
    let rows = counted(stage.rows, "row");
    if stage.finished < stage.planned {
        format!("{} of {} · {rows}", stage.finished, counted(stage.planned, "task"))
    } else {
        format!("{} · {rows}", counted(stage.planned, "task"))
    }
}

/// Shortens a name that is too long for its box. Names of stages need no escaping.
fn shortened(name: &str) -> String {
    if name.chars().count() <= LETTERS {
        return name.to_owned();
    }
    name.chars().take(LETTERS - 1).chain(['…']).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stage<'a>(name: &'a str, inputs: &'a [usize]) -> StageBox<'a> {
        StageBox { name, kind: "measure", inputs, finished: 1, planned: 2, rows: 1 }
    }

    #[test]
    fn every_stage_is_below_the_stages_that_it_reads() {
        let inputs: [&[usize]; 6] = [&[], &[0], &[0], &[0], &[1, 2], &[]];
        let stages: Vec<StageBox> = inputs.iter().map(|inputs| stage("a", inputs)).collect();
        let rows = rows(&stages);
        let row = |stage: usize| rows.iter().position(|row| row.contains(&stage)).unwrap();
        for (index, stage) in stages.iter().enumerate() {
            assert!(stage.inputs.iter().all(|&input| row(input) < row(index)), "{rows:?}");
        }
        assert_eq!(rows.concat().len(), 6);
        assert!(rows.iter().all(|row| row.len() <= IN_A_ROW));
    }

    #[test]
    fn a_box_tells_how_much_is_done() {
        let svg = svg(&[stage("surfaces", &[]), stage("contact", &[0])]);
        assert_eq!(svg.matches("1 of 2 tasks · 1 row<").count(), 2);
        assert_eq!(svg.matches("<g class=\"unfinished\"").count(), 2);
        assert_eq!(svg.matches("marker-end").count(), 1);
        let done = StageBox { finished: 2, rows: 40, ..stage("surfaces", &[]) };
        assert!(super::svg(&[done]).contains(">2 tasks · 40 rows<"));
    }
}
