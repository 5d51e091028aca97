//! What an archive says of itself to people.

use super::archive::CHECKSUMS;
use super::research_object;
use asperity_manifest::diagnostics::counted;
use asperity_pipeline::results::reading::Reading;
use asperity_stages::Kind;

/// What computed the tables.
pub const VERSIONS: &str = "versions.json";

/// What its page for people is about.
pub struct Facts<'a> {
    /// The study's name.
    pub study: &'a str,
    /// What the study is, in a sentence or two.
    pub about: &'a str,
    /// Where the manifest is in the archive.
    pub manifest: &'a str,
    /// How many tasks' tables go along, and how many tasks the study has; none without the store.
    pub stored: Option<(usize, usize)>,
    /// Stages of which not all tasks are finished: how many are, and how many there are.
    pub incomplete: &'a [(String, usize, usize)],
}

/// The page for people.
pub fn readme(facts: &Facts) -> String {
    let Facts { study, manifest, .. } = facts;
    let runs = match facts.stored {
        Some((there, all)) if there == all => {
            "has nothing to do: all tables of its tasks are in data/store/"
        }
        Some(_) => "computes what data/store/ lacks, to the same bytes",
        None => "computes all of it anew, to the same bytes",
    };
    let incomplete = facts.incomplete.iter().map(|(stage, some, all)| {
        let all = counted(*all, "task");
        format!("\nNot complete: of {stage}, {some} of {all} are computed.\n")
    });
    format!(
        "{study}: {about}\n\
         \n\
         data/results/{study}/*.parquet   a table for each stage; fields say unit and meaning\n\
         {manifest}   what was asked for\n\
         data/plans/{study}.json   the same, with all defaults, as JSON\n\
         {VERSIONS}   what computed it\n\
         {metadata}   what each file is (RO-Crate 1.1)\n\
         \n\
         Whether all is as it was: sha256sum --check {CHECKSUMS}\n\
         In this folder, with asperity {version}:\n\
         \n    asperity columns {manifest}          what the columns mean\
         \n    asperity table {manifest} STAGE      a table\
         \n    asperity run {manifest}              {runs}\n\
         {incomplete}",
        about = facts.about,
        metadata = research_object::FILE,
        version = env!("CARGO_PKG_VERSION"),
        incomplete = incomplete.collect::<String>(),
    )
}

/// `A statistical study of rough contact: 8 surfaces, 6 stages, 35 tasks.`
pub fn about(reading: &Reading) -> String {
    format!(
        "A statistical study of rough contact: {}, {}, {}. Surfaces are generated or measured, \
         pressed by an FFT boundary-element solver, measured, corrected, fitted and aggregated.",
        counted(reading.study.surfaces() as usize, "surface"),
        counted(reading.plan.stages.len(), "stage"),
        counted(reading.plan.tasks.len(), "task"),
    )
}

/// What the rows of a kind of stage are, in a phrase.
pub fn does(kind: Kind) -> &'static str {
    match kind {
        Kind::Generate => "surfaces and their spectral moments",
        Kind::Solve => "loads, gaps and energies",
        Kind::Measure => "what was measured of contacts or surfaces",
        Kind::Correct => "corrected contact areas",
        Kind::Fit => "parameters of fitted laws",
        Kind::Aggregate => "statistics over surfaces, or the answer to a query",
    }
}
