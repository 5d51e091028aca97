//! `asperity verify`: whether every table, page and figure is as it was written.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use indicatif::ProgressBar;
use serde_json::json;

use super::terminal::stdout;
use super::{Failure, chain, counted};
use crate::verify::{self, Finding};
use asperity_pipeline::data_folder::DataFolder;

#[derive(clap::Args)]
pub struct Arguments {
    /// Check the tables of this manifest only.
    manifest: Option<PathBuf>,

    /// Print JSON: `{"checked", "damaged": [{"cause", "aside"}, …]}`.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments, data: &DataFolder) -> Result<ExitCode, Failure> {
    let reading = arguments.manifest.as_deref();
    let reading = reading.map(|manifest| super::session(manifest, data).reading()).transpose()?;
    let plan = reading.map(|reading| reading.plan);
    let store = data.look()?;
    let tables = verify::tables(plan.as_ref(), &data.store(), &data.results())?;
    // It draws on a terminal only.
    let bar = ProgressBar::new(tables.len() as u64);
    let mut findings = verify::check(&tables, &store, &|| bar.inc(1));
    bar.finish_and_clear();
    findings.extend(verify::pages(plan.as_ref(), &data.results())?);

    let mut out = stdout();
    if arguments.json {
        let damaged: Vec<_> = findings.iter().map(as_json).collect();
        writeln!(out, "{:#}", json!({ "checked": tables.len(), "damaged": damaged }))?;
    } else {
        for Finding { cause, quarantined } in &findings {
            let fate = match quarantined {
                Some(quarantined) => format!("set aside as `{}`", quarantined.display()),
                None => "left where it is".to_owned(),
            };
            writeln!(out, "{}; {fate}", chain(cause))?;
        }
        writeln!(out, "{}", closing(tables.len(), findings.len()))?;
    }
    Ok(ExitCode::from(u8::from(!findings.is_empty())))
}

fn as_json(finding: &Finding) -> serde_json::Value {
    json!({ "cause": chain(&finding.cause), "aside": finding.quarantined })
}

fn closing(checked: usize, damaged: usize) -> String {
    let checked = counted(checked, "table");
    match damaged {
        0 => format!("{checked} checked: all as they were written"),
        _ => {
            format!("{checked} checked: {damaged} damaged; `asperity run` computes what is missing")
        }
    }
}
