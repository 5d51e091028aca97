//! Measured surfaces that are samples of one ensemble: files, and regions of files.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::ensemble::ParameterPoint;
use crate::generate::files::FileTable;
use crate::surface::Origin;
use crate::surface::coordinates::coordinates;
use crate::surface::origin::MeasuredSurface;
use crate::surface::planned::{Growth, PlannedSurfaces, Realizations, realizations};
use asperity_manifest::diagnostics::{Problem, Problems, counted};
use asperity_manifest::keys::Section;
use asperity_manifest::keys::checks::Checks;
use asperity_mechanics::topography::preparation::Crop;

/// Number of samples of each parameter point: all, a fixed number, or adaptive.
pub struct Number(Option<(u32, Option<Arc<Growth>>)>);

/// Returns the number of samples that the manifest asks for. Refuses `realizations` for surfaces
/// that are no samples.
pub fn number(table: &FileTable, is_sample: bool, checks: &mut Checks) -> Option<Number> {
    if !is_sample {
        let why = "needs `samples = true`: then it is the number of files to use";
        return checks.forbidden("realizations", &table.realizations, why).map(|()| Number(None));
    }
    if table.realizations.written().is_none() {
        return Some(Number(None));
    }
    realizations(&table.realizations, checks).map(|number| Number(Some(number)))
}

/// Numbers the samples of each parameter point, and plans as many as `number` says. Refuses samples
/// of the same place. Returns `None` after reporting problems.
pub fn numbered(
    section: &Section<FileTable>,
    planned: &mut [PlannedSurfaces],
    number: Number,
    problems: &mut Problems,
) -> Option<()> {
    let mut of_points: BTreeMap<ParameterPoint, Vec<usize>> = BTreeMap::new();
    for (index, surfaces) in planned.iter().enumerate() {
        let point = ParameterPoint::from_cells(coordinates(&surfaces.params));
        of_points.entry(point).or_default().push(index);
    }
    let most = of_points.values().map(Vec::len).max().unwrap_or(0) as u32;
    let (start, growth) = match number.0 {
        None => (most, None),
        Some((start, None)) => (start, None),
        Some((start, Some(growth))) => {
            let at_most = growth.at_most.min(most);
            let at_least = start.min(at_most);
            (at_least, Some(Arc::new(Growth { at_most, at_least, ..(*growth).clone() })))
        }
    };
    let written = section.points.first().and_then(|point| point.table.realizations.written());
    if let Some(written) = written
        && let Realizations::Number(number) = written.value
        && number > most
    {
        let message = format!("`realizations = {number}`, but there are {most} samples");
        problems.push(Problem::new(message, written.span.clone(), "at most the number of files"));
        return None;
    }
    for samples in of_points.values() {
        check_places(section, planned, samples, problems)?;
        for (sample, &index) in (0..).zip(samples) {
            let surfaces = &mut planned[index];
            surfaces.growth.clone_from(&growth);
            surfaces.sample = Some(sample);
            *surfaces = surfaces.with_surfaces(start);
        }
    }
    Some(())
}

/// Refuses two samples of one parameter point that are maps of the same place.
fn check_places(
    section: &Section<FileTable>,
    planned: &[PlannedSurfaces],
    samples: &[usize],
    problems: &mut Problems,
) -> Option<()> {
    let mut before: BTreeMap<String, Vec<(usize, &MeasuredSurface)>> = BTreeMap::new();
    for &index in samples {
        let Origin::File(file) = &planned[index].params.origin else { continue };
        let same_file = before.entry(file.content.to_string()).or_default();
        if let Some((other, _)) = same_file.iter().find(|(_, other)| overlap(file, other)) {
            let path = section.points[index].table.path.written()?;
            let spans = [index, *other].map(|index| {
                let table = &section.points[index].table;
                table.crop.written().map_or(path.span.clone(), |crop| crop.span.clone())
            });
            let message = format!("two samples are maps of the same place in {:?}", path.value);
            let [here, there] = spans;
            let problem = Problem::new(message, here.clone(), "overlaps with another sample");
            let problem = if here == there { problem } else { problem.and(there, "other sample") };
            problems.push(problem.help(
                "samples are different files, or regions of a file that do not overlap; compare \
                 preparations of one map without `samples`",
            ));
            return None;
        }
        same_file.push((index, file));
    }
    Some(())
}

/// Largest overlap of two regions that counts as rounding, in units of their sides.
const ROUNDING: f64 = 1e-9;

/// Returns whether the regions of two surfaces in the same file overlap.
fn overlap(one: &MeasuredSurface, other: &MeasuredSurface) -> bool {
    let (Some(one), Some(other)) = (&one.preparation.crop, &other.preparation.crop) else {
        return true;
    };
    (0..2).all(|axis| {
        let ends = |crop: &Crop| [crop.from[axis], crop.from[axis] + crop.size[axis]];
        let ([start, end], [from, to]) = (ends(one), ends(other));
        end.min(to) - start.max(from) > ROUNDING * (end - start)
    })
}

/// Returns what `check` says about samples: `2 parameter points with 3 samples each`.
pub fn summary(planned: &[PlannedSurfaces]) -> Option<String> {
    let mut of_points: BTreeMap<ParameterPoint, usize> = BTreeMap::new();
    for surfaces in planned.iter().filter(|surfaces| surfaces.sample.is_some()) {
        let point = ParameterPoint::from_cells(coordinates(&surfaces.params));
        *of_points.entry(point).or_default() += 1;
    }
    let (least, most) = (*of_points.values().min()?, *of_points.values().max()?);
    let samples = match least == most {
        true => counted(most, "sample"),
        false => format!("{least} to {most} samples"),
    };
    Some(match of_points.len() {
        1 => format!("{samples} of one parameter point"),
        points if most == 1 => format!(
            "{points} parameter points with 1 sample each, because the labels of all files differ"
        ),
        points => format!("{points} parameter points with {samples} each"),
    })
}
