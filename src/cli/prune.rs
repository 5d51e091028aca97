//! `asperity prune`: delete what no named manifest needs.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use indicatif::DecimalBytes;
use serde_json::json;

use super::terminal::stdout;
use super::{Failure, counted};
use asperity_pipeline::adaptive_sampling;
use asperity_pipeline::data_folder;
use asperity_pipeline::data_folder::DataFolder;
use asperity_tables::parquet;
use asperity_tables::store::listing::{Found, What};
use asperity_tables::store::lock::Lock;
use asperity_tables::store::provenance::Provenance;
use asperity_tables::store::writer::Moment;

#[derive(clap::Args)]
pub struct Arguments {
    /// Manifests whose tables are kept. Without any, all tables are, and only damaged and
    /// unfinished files go.
    manifests: Vec<PathBuf>,

    /// Delete what would otherwise only be shown.
    #[arg(long)]
    yes: bool,

    /// Delete even while elements may be at work on other machines, as their receipts say: no lock
    /// tells of them.
    #[arg(long, requires = "yes")]
    force: bool,

    /// Print JSON: `{"deleted", "files", "bytes", "kinds": [{"name", "files", "bytes"}, …]}`.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let mut plans = Vec::new();
    for manifest in &arguments.manifests {
        let session = super::session(manifest, data);
        plans.push(session.sampled()?.plan);
        // Surfaces that were drawn are needed, even where a table that asked for them is missing.
        plans.push(adaptive_sampling::at_most(session.study()?));
    }
    // Who has the store alone looks at it without sharing it: nothing changes until the end.
    let alone = match arguments.yes {
        true => {
            let alone = alone(data)?;
            refuse_beside_elements(arguments, data)?;
            Some(alone)
        }
        false => None,
    };
    let unneeded = data_folder::unneeded(&plans, data, &Moment::here())?;
    let shares = Shares::of(&unneeded);
    if let Some(alone) = &alone {
        data_folder::delete(&unneeded, alone)?;
    }
    let mut out = stdout();
    match arguments.json {
        true => writeln!(out, "{:#}", shares.json(arguments.yes))?,
        false => write!(out, "{}", shares.text(arguments))?,
    }
    Ok(ExitCode::SUCCESS)
}

fn alone(data: &DataFolder) -> Result<Lock, Failure> {
    let store = data.store();
    let in_use =
        || format!("`{}` is in use by another process; prune it afterwards", store.display());
    Ok(Lock::alone(&store)?.ok_or_else(in_use)?)
}

/// Locks may hold on one machine only: of other machines nothing is known but receipts.
fn refuse_beside_elements(arguments: &Arguments, data: &DataFolder) -> Result<(), Failure> {
    let at_work = data_folder::at_work(data)?;
    let Some(receipt) = at_work.first().filter(|_| !arguments.force) else {
        return Ok(());
    };
    let several = counted(at_work.len(), "element");
    Err(format!(
        "{several} may be at work on other machines, shard {} of `{}` on {} among them, and no lock \
         tells of those; prune afterwards, or with `--force` if you know that they have ended",
        receipt.shard, receipt.study, receipt.machine
    )
    .into())
}

/// Files and bytes, by what the files are.
struct Shares(BTreeMap<String, (usize, u64)>);

impl Shares {
    fn of(files: &[Found]) -> Shares {
        let mut shares = BTreeMap::new();
        for file in files {
            let (count, bytes) = shares.entry(name(file)).or_default();
            *count += 1;
            *bytes += file.bytes;
        }
        Shares(shares)
    }

    fn total(&self) -> (usize, u64) {
        let shares = self.0.values();
        shares.fold((0, 0), |(files, bytes), share| (files + share.0, bytes + share.1))
    }

    fn json(&self, deleted: bool) -> serde_json::Value {
        let kinds = self.0.iter();
        let kinds = kinds
            .map(|(name, (files, bytes))| json!({ "name": name, "files": files, "bytes": bytes }));
        let (files, bytes) = self.total();
        let kinds: Vec<_> = kinds.collect();
        json!({ "deleted": deleted, "files": files, "bytes": bytes, "kinds": kinds })
    }

    fn text(&self, arguments: &Arguments) -> String {
        let (files, bytes) = self.total();
        if files == 0 {
            return "nothing to delete\n".to_owned();
        }
        let lines = self.0.iter().map(|(name, (files, bytes))| {
            format!("{name:12}{files:>8}  {}\n", DecimalBytes(*bytes))
        });
        let total = format!("{}, {}", counted(files, "file"), DecimalBytes(bytes));
        let closing = match (arguments.yes, arguments.manifests.is_empty()) {
            (true, _) => format!("{total} deleted\n"),
            (false, true) => format!("{total} that are of no use; `--yes` deletes them\n"),
            (false, false) => {
                format!("{total} that no named manifest needs; `--yes` deletes them\n")
            }
        };
        lines.collect::<String>() + &closing
    }
}

/// What a file is, in a word or two; the table of a task tells its stage's kind itself.
fn name(file: &Found) -> String {
    let kind = || {
        let metadata = parquet::verify(File::open(&file.path).ok()?).ok()?;
        Some(Provenance::of(&metadata)?.stage)
    };
    match file.what {
        What::Task(_) => kind().unwrap_or_else(|| "unreadable".to_owned()),
        What::Stage { .. } | What::Owner { .. } => "results".to_owned(),
        What::Checkpoint(_) => "checkpoints".to_owned(),
        What::Record { .. } => "plans".to_owned(),
        What::Cluster { .. } => "cluster".to_owned(),
        What::Quarantined => "set aside".to_owned(),
        What::Unfinished => "unfinished".to_owned(),
    }
}
