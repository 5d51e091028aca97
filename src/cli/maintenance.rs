//! Commands that check files for damage (`verify`) and delete unused files (`prune`).

use std::path::PathBuf;
use std::process::ExitCode;

use indicatif::{DecimalBytes, ProgressBar};

use super::{Failure, SetArguments, print_answer, print_notice};
use crate::session::formatting::{chain, counted};
use crate::session::maintenance::{self, DamagedFile, PruneOptions, Pruned, Verification};
use crate::session::{DataFolder, StoreError};

#[derive(clap::Args)]
pub(crate) struct VerifyArguments {
    /// Check only the tables of this manifest (default: all tables).
    manifest: Option<PathBuf>,

    #[command(flatten)]
    set: SetArguments,

    /// Also check the tables in the read-only stores that `asperity.toml` lists. Damaged files
    /// there are reported and left in place.
    #[arg(long)]
    stores: bool,

    /// Print the result as JSON.
    ///
    /// Form: `{"checked", "damaged": [{"cause", "aside"}, …]}`.
    #[arg(long)]
    json: bool,
}

pub(crate) fn verify(arguments: &VerifyArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let VerifyArguments { manifest, set, .. } = arguments;
    if manifest.is_none() {
        set.refuse()?;
    }
    let session = manifest.as_deref().map(|manifest| super::session(manifest, set, data));
    // The bar is hidden unless stderr is a terminal.
    let bar = ProgressBar::new(0);
    let checked = |tables| {
        bar.set_length(tables as u64);
        bar.inc(1);
    };
    let (session, stores) = (session.as_ref(), arguments.stores);
    let verification = maintenance::verify(data, session, stores, &print_notice, &checked)?;
    bar.finish_and_clear();

    print_answer(arguments.json, &verification, || verify_text(&verification))?;
    Ok(ExitCode::from(u8::from(!verification.damaged.is_empty())))
}

fn verify_text(verification: &Verification) -> String {
    let lines = verification.damaged.iter().map(|DamagedFile { cause, quarantined }| {
        let fate = match quarantined {
            Some(quarantined) => format!("set aside as `{}`", quarantined.display()),
            None => "left in place".to_owned(),
        };
        format!("{}; {fate}\n", chain(cause))
    });
    lines.collect::<String>() + &closing(verification) + "\n"
}

fn closing(verification: &Verification) -> String {
    let checked = counted(verification.checked, "table");
    let [mut damaged, mut edited, mut unread] = [0; 3];
    for DamagedFile { cause, .. } in &verification.damaged {
        *match cause {
            StoreError::Changed { .. } => &mut edited,
            cause if cause.is_recomputable() => &mut damaged,
            _ => &mut unread,
        } += 1;
    }
    let advice = "`asperity run` recomputes missing tables";
    let mut text = match damaged {
        0 => format!("{checked} checked, none damaged"),
        _ => format!("{checked} checked, {damaged} damaged; {advice}"),
    };
    for (count, what, advice) in [
        (unread, "files that cannot be read", "they were not checked"),
        (edited, "edited pages and figures", "`asperity report` rewrites them"),
    ] {
        if count > 0 {
            text += &format!("\n{what}: {count}; {advice}");
        }
    }
    text
}

#[derive(clap::Args)]
pub(crate) struct PruneArguments {
    /// Manifests whose tables to keep (default: keep all tables, and delete only damaged and
    /// unfinished files).
    manifests: Vec<PathBuf>,

    #[command(flatten)]
    set: SetArguments,

    #[command(flatten)]
    options: PruneOptions,

    /// Print the result as JSON.
    ///
    /// Form: `{"deleted", "files", "bytes", "kinds": [{"name", "files", "bytes"}, …]}`.
    #[arg(long)]
    json: bool,
}

pub(crate) fn prune(arguments: &PruneArguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let PruneArguments { manifests, set, .. } = arguments;
    if manifests.is_empty() {
        set.refuse()?;
    }
    let sessions = manifests.iter().map(|manifest| super::session(manifest, set, data));
    let pruned = maintenance::prune(data, &sessions.collect::<Vec<_>>(), arguments.options)?;
    print_answer(arguments.json, &pruned, || prune_text(&pruned, arguments.manifests.is_empty()))
}

fn prune_text(pruned: &Pruned, has_no_manifests: bool) -> String {
    if pruned.files == 0 {
        return "nothing to delete\n".to_owned();
    }
    let lines = pruned
        .kinds
        .iter()
        .map(|kind| format!("{:12}{:>8}  {}\n", kind.name, kind.files, DecimalBytes(kind.bytes)));
    let total = format!("{}, {}", counted(pruned.files, "file"), DecimalBytes(pruned.bytes));
    let closing = match (pruned.deleted, has_no_manifests) {
        (true, _) => format!("{total} deleted\n"),
        (false, true) => format!("{total} damaged or unfinished; `--yes` deletes them\n"),
        (false, false) => {
            format!("{total} not needed by the given manifests; `--yes` deletes them\n")
        }
    };
    lines.collect::<String>() + &closing
}
