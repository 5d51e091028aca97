//! Commands that draw (`view`) and export (`export`) the maps of a task, and describe topography
//! files (`surface`).

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::AtomicBool;

use super::terminal::in_columns;
use super::{Failure, SetArguments, misused, print_answer};
use crate::session::export::{Export, ExportFormat, Exported};
use crate::session::formatting::{counted, listed, short, wrapped};
use crate::session::output_files::write_png;
use crate::session::topography_file::{self, DescribedChannel, DescribedFile, Quantity};
use crate::session::view::{Picture, PictureFormat, ViewOptions};
use crate::session::{
    ChosenLoad, Coordinate, DataFolder, InvalidCoordinate, MapKind, PerAxis, TaskMaps, maps,
};

/// Choice of a task and of one of its loads or states.
#[derive(clap::Args)]
pub(crate) struct TaskArguments {
    /// Key of a finished task (at least its first 4 digits), as in the `task` column of tables; or
    /// the manifest of a study.
    #[arg(value_name = "KEY|MANIFEST")]
    what: PathBuf,

    #[command(flatten)]
    set: SetArguments,

    /// Stage of the task, if a manifest is given.
    stage: Option<String>,

    /// Column values that select the task within the stage, such as `k_upper=32 realization=1`,
    /// loads, such as `pressure="10 MPa"`, and states of a path, such as `branch=separation`.
    #[arg(value_name = "COLUMN=VALUE")]
    coordinates: Vec<Coordinate>,

    /// Load: a number in the unit of the study, a pressure such as `10 MPa`, or a force such as
    /// `10 N` if the manifest gives forces.
    ///
    /// By default, `export` writes the maps at all loads. `view` overlays the contacts at all
    /// loads, from dark (smallest load) to light (largest load), or of one branch of a path, and
    /// draws other maps at the largest load, or along a path at the smallest mean gap.
    #[arg(long, value_name = "LOAD", allow_negative_numbers = true)]
    load: Option<ChosenLoad>,

    /// Mean gap or displacement, if the manifest prescribes these: a number in the unit of the
    /// study, or a length such as `20 nm`.
    #[arg(long, value_name = "GAP", conflicts_with = "load", value_parser = ChosenLoad::mean_gap)]
    gap: Option<ChosenLoad>,
}

#[derive(clap::Args)]
pub(crate) struct ViewArguments {
    #[command(flatten)]
    task: TaskArguments,

    #[command(flatten)]
    options: ViewOptions,

    /// Draw the map alone, one pixel for each node, without title and bars (PNG only).
    #[arg(long, conflicts_with = "animate")]
    bare: bool,

    /// File to write, whose suffix names the format: `.png`, `.svg` or `.pdf`, and for animations
    /// `.gif`, `.apng` or `.png` (default: a PNG file named after the task, the map and the load).
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,

    /// Overwrite an existing file of the same format (other files are never overwritten).
    #[arg(long)]
    replace: bool,

    /// Print the result as JSON.
    ///
    /// Form: `{"file", "task", "map", "nodes", "load", "load_column", "load_unit", "pictures",
    /// "lowest", "highest", "unit"}`.
    ///
    /// `load` is in the column `load_column`, in the unit `load_unit`. For rectangles, `nodes` is
    /// `[x, y]`. For a state of a path, `branch` and `step` are its position along the path.
    #[arg(long)]
    json: bool,
}

pub(crate) fn view(arguments: &ViewArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let ViewArguments { task, output, replace, .. } = arguments;
    let mut options = arguments.options;
    let format = output.as_deref().map(PictureFormat::from_path).transpose()?;
    options.animate |= format.is_some_and(PictureFormat::is_animation);
    if options.frame_time.is_some() && !options.animate {
        return Err(misused("`--frame-time` is for animations; add `--animate`"));
    }
    let mut maps = task.maps(data)?;
    // Ctrl-C ends the process, because nothing is written before the picture is drawn.
    let mut picture = Picture::draw(&mut maps, options, task.load(), &AtomicBool::new(false))?;
    picture.file = output.clone().unwrap_or_else(|| picture.file_name().into());
    if arguments.bare {
        picture.write_bare(*replace)?;
    } else {
        picture.write(options.frame_time, *replace)?;
    }
    print_answer(arguments.json, &picture, || {
        format!("{}: {}\n", picture.file.display(), picture.caption())
    })
}

#[derive(clap::Args)]
pub(crate) struct ExportArguments {
    #[command(flatten)]
    task: TaskArguments,

    /// Maps to export, separated by commas (default: all that the task has).
    #[arg(long, value_enum, value_name = "MAPS", value_delimiter = ',')]
    map: Vec<MapKind>,

    /// File to write, whose suffix names the format.
    ///
    /// `.vti` is VTK image data of one load, `.pvd` a ParaView collection with a folder of `.vti`
    /// files, one for each load, `.npy` a NumPy array of one map, `.npz` an archive of NumPy arrays
    /// with sides, loads and units, `.gsf` a Gwyddion field of one map, and `.gwy` a Gwyddion file
    /// of one load.
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,

    /// Overwrite existing files of the same format (other files are never overwritten).
    #[arg(long)]
    replace: bool,

    /// Print the result as JSON.
    ///
    /// Form: `{"files", "task", "arrays", "nodes", "side", "unit", "pressure_unit", "loads",
    /// "load_column"}`.
    ///
    /// For rectangles, `nodes` and `side` are `[x, y]`. For a path, `branches` has the branch of
    /// each state.
    #[arg(long)]
    json: bool,
}

pub(crate) fn export(arguments: &ExportArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let ExportArguments { task, map, output, .. } = arguments;
    ExportFormat::from_path(output)?;
    let (mut maps, load) = (task.maps(data)?, task.load());
    // Ctrl-C ends the process; files appear whole.
    let stop = AtomicBool::new(false);
    let exported = Export::new(&mut maps, map, load, &stop)?.write(output, arguments.replace)?;
    print_answer(arguments.json, &exported, || {
        let Exported { arrays, nodes: PerAxis([x, y]), loads, .. } = &exported;
        let one = if exported.branches.is_empty() { "load" } else { "state" };
        let loads = match loads.len() {
            0 => String::new(),
            count => format!(" at {}", counted(count, one)),
        };
        format!(
            "{}: {}{loads} on {x} × {y} nodes\n",
            output.display(),
            listed(arrays.iter().copied(), "and")
        )
    })
}

impl TaskArguments {
    fn load(&self) -> Option<ChosenLoad> {
        self.load.or(self.gap)
    }

    /// Opens the maps of a task that is given by its key, or by manifest, stage and coordinates.
    fn maps(&self, data: &DataFolder) -> Result<TaskMaps, Failure> {
        let TaskArguments { what, set, stage, .. } = self;
        let session = super::session(what, set, data);
        let mut coordinates = self.coordinates.clone();
        match stage {
            // A key is followed by coordinates only.
            Some(word) if word.contains('=') && !what.is_file() => {
                let first =
                    word.parse().map_err(|error: InvalidCoordinate| misused(error.to_string()));
                coordinates.insert(0, first?);
            }
            Some(stage) => return Ok(session.maps(stage, &coordinates, self.load())?),
            None if what.is_file() => {
                let study = session.study()?;
                let stages: Vec<_> = study.stages.iter().map(|stage| &*stage.name).collect();
                let (path, stages) = (what.display(), listed(stages, "or"));
                let message =
                    format!("name the stage of `{path}` that contains the task: {stages}");
                return Err(misused(message));
            }
            None => {}
        }
        set.refuse()?;
        Ok(maps::finished_task(&what.to_string_lossy(), &coordinates, data, &super::print_notice)?)
    }
}

#[derive(clap::Args)]
pub(crate) struct SurfaceArguments {
    /// Topography file of any supported format, which its content determines.
    #[arg(value_name = "FILE")]
    file: PathBuf,

    /// Name or number (from 1) of the channel to describe (default: all channels).
    #[arg(long)]
    channel: Option<String>,

    /// Draw the channel (default: the one that is read as heights); missing points are red.
    #[arg(long, short, value_name = "FILE.png")]
    output: Option<PathBuf>,

    /// Overwrite an existing PNG file (other files are never overwritten).
    #[arg(long, requires = "output")]
    replace: bool,

    /// Print the result as JSON.
    ///
    /// Form: `{"format", "channels": [{"name", "nodes", "size", "unit", "missing", "rms_height",
    /// "rms_slope", "lowest", "highest", "corners", "notes"}]}`.
    ///
    /// Sizes are `[x, y]`. Lengths are in metres if the file has a unit.
    #[arg(long)]
    json: bool,
}

pub(crate) fn surface(arguments: &SurfaceArguments) -> Result<ExitCode, Failure> {
    let (path, output) = (&arguments.file, arguments.output.as_deref());
    let file = topography_file::describe(path, arguments.channel.as_deref(), output.is_some())?;
    if let Some((output, picture)) = output.zip(file.picture.as_ref()) {
        write_png(output, picture, arguments.replace)?;
    }
    super::print_warnings(&file.warnings);
    print_answer(arguments.json, &file, || file_text(&file, path, output))
}

/// Describes the file: format, one line per channel, missing points, channel with heights.
fn file_text(file: &DescribedFile, path: &Path, output: Option<&Path>) -> String {
    let mut text = format!(
        "file     {}\nformat   {}: {}\n{}\n",
        path.display(),
        file.format,
        file.title,
        in_columns(HEADER, file.channels.iter().map(row), |index| (4..9).contains(&index))
    );
    for channel in file.channels.iter().filter(|channel| channel.missing > 0) {
        let DescribedChannel { number, nodes: [x, y], missing, .. } = channel;
        let share = 100.0 * *missing as f64 / (x * y) as f64;
        text += &format!("missing  {missing} points of channel {number}, {share:.3} %\n");
    }
    for note in notes(&file.channels) {
        text += &format!("{}\n", wrapped(&format!("note     {note}")));
    }
    text += &format!("{}\n", wrapped(&heights(file)));
    if let Some(map) = &file.map {
        text += &format!("{}\n", wrapped(&format!("map      {map}")));
    }
    if let Some(output) = output {
        text += &format!("picture  {}, x to the right and y upwards\n", output.display());
    }
    text
}

/// Returns the notes of all channels without duplicates. A note that not all channels have names
/// the first channel that has it.
fn notes(channels: &[DescribedChannel]) -> Vec<String> {
    let mut seen = BTreeSet::new();
    let mut notes = Vec::new();
    for DescribedChannel { number, notes: of_channel, .. } in channels {
        for note in of_channel.iter().filter(|note| seen.insert(note.as_str())) {
            let is_of_all = channels.iter().all(|channel| channel.notes.contains(note));
            let whose = if is_of_all { String::new() } else { format!("channel {number}: ") };
            notes.push(format!("{whose}{note}"));
        }
    }
    notes
}

/// Names the channel that is used for heights, and the reason.
fn heights(file: &DescribedFile) -> String {
    let Some(chosen) = &file.chosen else {
        return String::new();
    };
    let (name, number) = (&chosen.name, chosen.number);
    let unit = match chosen.quantity {
        Quantity::Height => "",
        Quantity::Unitless => ", without a unit",
        Quantity::Other(_) => return format!("heights  none; channel {number} is `{name}`"),
    };
    let why = match &chosen.reason {
        Some(reason) => format!(", {reason}"),
        None if file.count > 1 => ", as requested".to_owned(),
        None => String::new(),
    };
    format!("heights  channel {number}, `{name}`{unit}{why}")
}

const HEADER: [&str; 9] =
    ["channel", "nodes", "size", "unit", "missing", "rms height", "rms slope", "lowest", "highest"];

fn row(channel: &DescribedChannel) -> [String; 9] {
    let number = |number: Option<f64>| number.map_or_else(|| "–".to_owned(), short);
    let [x, y] = channel.nodes;
    let is_profile = y == 1;
    let size = channel
        .size
        .map(|[x, y]| if is_profile { short(x) } else { format!("{} × {}", short(x), short(y)) });
    let size = match (size, channel.size_unit) {
        (Some(size), Some(unit)) => format!("{size} {unit}"),
        (size, _) => size.unwrap_or_else(|| "–".to_owned()),
    };
    [
        format!("{} {}", channel.number, channel.name),
        if is_profile { x.to_string() } else { format!("{x} × {y}") },
        size,
        channel.unit.as_deref().unwrap_or("–").to_owned(),
        channel.missing.to_string(),
        number(channel.rms_height),
        number(channel.rms_slope),
        number(channel.lowest),
        number(channel.highest),
    ]
}
