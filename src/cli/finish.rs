//! `asperity finish`: what the last job of `submit` runs.

use std::io::Write;
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::process::ExitCode;

use bytesize::ByteSize;

use super::console::{Console, Patience, StopSignal};
use super::run::told;
use super::terminal::stdout;
use super::{Failure, warn};
use crate::session::DataFolder;
use crate::session::submission::ranges;
use crate::session::{FinishOptions, FinishOutcome, RunOptions, Session};

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest.
    manifest: PathBuf,

    /// How often something was submitted again before.
    #[arg(long, value_name = "N", default_value_t = 0)]
    round: u32,

    /// Surfaces to work on at once.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    jobs: Option<u16>,

    /// Memory to keep to.
    #[arg(long, value_name = "SIZE")]
    memory: Option<ByteSize>,

    /// Write the page of figures, too.
    #[arg(long)]
    report: bool,

    /// Take the place of another manifest whose study has the same name.
    #[arg(long)]
    replace: bool,
}

pub fn run(arguments: &Arguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let console = Console::default();
    let session = Session::new(&arguments.manifest, data.path()).observed_by(&console);
    let stop = StopSignal::on_signal(Patience::OfANode)?;
    let options = FinishOptions {
        round: arguments.round,
        run: RunOptions {
            jobs: arguments.jobs.map(usize::from).and_then(NonZeroUsize::new),
            memory: arguments.memory,
            replace: arguments.replace,
            ..RunOptions::default()
        },
        report: arguments.report,
    };
    let finished = session.finish(&options, stop.asked())?;
    if !finished.silent.is_empty() {
        let study = session.study()?.name;
        warn(&format!(
            "warning: elements {} left no receipt: they never began, or their nodes have not got the \
             program or `{}`; what they printed is in `{}`, as far as they see it",
            ranges(finished.silent),
            data.path().display(),
            data.cluster_of(&study).join("logs").display(),
        ));
    }
    let mut out = stdout();
    match finished.outcome {
        FinishOutcome::SubmittedAgain(round) => {
            let numbers = ranges(round.elements);
            let array = round.array.map_or_else(String::new, |job| format!(" as job {job}"));
            writeln!(
                out,
                "elements {numbers} are submitted again{array}; job {} finishes",
                round.finish
            )?;
            Ok(ExitCode::SUCCESS)
        }
        FinishOutcome::Done(report, page) => {
            write!(out, "{}", told(&report, None)?)?;
            if let Some(page) = page {
                writeln!(out, "report: {}", page.page.display())?;
            }
            Ok(super::run::exit_code(&report.outcome, &stop))
        }
    }
}
