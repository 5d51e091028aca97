//! `asperity share`: one archive of a study.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::SystemTime;

use serde_json::json;

use super::terminal::stdout;
use super::{Failure, counted};
use crate::session::{Day, ShareOptions, SharedStudy};
use asperity_pipeline::data_folder::DataFolder;

#[derive(clap::Args)]
pub struct Arguments {
    /// The manifest of a study that has been run.
    manifest: PathBuf,

    /// The archive; `STUDY.zip` in this folder when left out.
    #[arg(long, short, value_name = "FILE.zip")]
    output: Option<PathBuf>,

    /// Take the tables of the store along, with all maps: a run of what is unpacked has nothing to
    /// do. Without them it computes all of it anew, and reading the tables works all the same.
    #[arg(long)]
    store: bool,

    /// Replace an existing archive. Files of another kind are never replaced.
    #[arg(long)]
    replace: bool,

    /// The license that the archive's description gives: an identifier of SPDX, such as CC-BY-4.0,
    /// or an address.
    #[arg(long)]
    license: Option<String>,

    /// An author whom the archive's description gives; once for each.
    #[arg(long = "author", value_name = "NAME")]
    authors: Vec<String>,

    /// The day that the archive's description gives; today, in universal time, when left out. The
    /// same study and day make the same bytes.
    #[arg(long, value_name = "YYYY-MM-DD")]
    date: Option<Day>,

    /// Print JSON: `{"archive", "bytes", "tables", "stored", "tasks"}`, the last two null without
    /// the store.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let session = super::session(&arguments.manifest, data);
    let shared = session.share(&ShareOptions {
        output: arguments.output.clone(),
        store: arguments.store,
        replace: arguments.replace,
        day: arguments.date.unwrap_or_else(|| Day::of(SystemTime::now())),
        license: arguments.license.clone(),
        authors: arguments.authors.clone(),
    })?;
    let mut out = stdout();
    match arguments.json {
        true => writeln!(out, "{:#}", as_json(&shared))?,
        false => write!(out, "{}", text(&shared))?,
    }
    Ok(ExitCode::SUCCESS)
}

fn text(shared: &SharedStudy) -> String {
    let store = match shared.stored {
        Some((there, all)) => format!("tables of {there} of {}", counted(all, "task")),
        None => "left out; `--store` takes it along".to_owned(),
    };
    format!(
        "archive  {} · {:.1} MB\ntables   {}\nstore    {store}\n",
        shared.archive.display(),
        shared.size as f64 / 1e6,
        counted(shared.tables, "stage"),
    )
}

fn as_json(shared: &SharedStudy) -> serde_json::Value {
    json!({
        "archive": shared.archive,
        "bytes": shared.size,
        "tables": shared.tables,
        "stored": shared.stored.map(|(there, _)| there),
        "tasks": shared.stored.map(|(_, all)| all),
    })
}
