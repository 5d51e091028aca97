//! Writing a study's tables, for the manifest that they belong to.

use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};

use bytesize::ByteSize;

use super::archive::Archive;
use super::owner::Owner;
use super::pieces::{Frame, Part, Pieces};
use super::published::{KIND, LACKING, Lacking};
use super::{ResultsError, digest, file};
use crate::adaptive_sampling::SampledStudy;
use crate::plan::{Plan, PlannedStage};
use asperity_tables::column::Description;
use asperity_tables::parquet;
use asperity_tables::parquet::Metadata;
use asperity_tables::source::TableSource;
use asperity_tables::store::files::{
    Existing, flush_folder, lock_to_write, make_folder, quarantine, write_with,
};
use asperity_tables::store::key::{Digest, TaskKey};
use asperity_tables::store::{Store, StoreError, TaskTables};
use asperity_tables::table::Table;

/// A stage's table and how much of it is there.
#[derive(Debug)]
pub struct PublishedTable {
    /// The stage's name.
    pub stage: String,
    /// Where its table is.
    pub path: PathBuf,
    /// How many of its tasks are finished.
    pub finished: usize,
    /// Where a file is now that was in its place and not as any run had written it.
    pub quarantined: Option<PathBuf>,
}

impl PublishedTable {
    /// Opens the table without reading its rows.
    ///
    /// # Errors
    /// When the file is missing, or its footer damaged.
    pub fn open(&self) -> Result<TableSource, StoreError> {
        Ok(TableSource::open(&self.path)?.0)
    }

    /// Its rows.
    ///
    /// # Errors
    /// When the file is missing or damaged.
    pub fn read(&self) -> Result<Table, StoreError> {
        self.open()?.table()
    }
}

/// Writes the table of every stage that has a finished task, unless it is there already, for the
/// manifest in a file. Rows of tasks that the store has lost stay. Of large tables no more is in
/// memory at once than half of `room`.
///
/// # Errors
/// When tables cannot be read, or the folder not be written.
pub fn publish(
    sampled: &SampledStudy,
    store: &Store,
    manifest: &Path,
    folder: &Path,
    room: ByteSize,
) -> Result<Vec<PublishedTable>, ResultsError> {
    let folder = folder.join(&sampled.plan.study);
    let desk = Desk {
        sampled,
        archive: Archive::of(store.clone(), &folder),
        manifest,
        folder,
        room: usize::try_from(room.0 / 2).unwrap_or(usize::MAX),
    };
    let mut damaged = Vec::new();
    let mut published = Vec::new();
    for stage in &sampled.plan.stages {
        match desk.publish(stage) {
            Ok(table) => published.push(table),
            Err(ResultsError::Damaged { tables }) => damaged.extend(tables),
            Err(error) => return Err(error),
        }
    }
    if published.iter().any(|table| table.finished > 0) {
        // Tables that are all there need no folder that can be written.
        let _ = desk.own();
    }
    match damaged.is_empty() {
        true => Ok(published),
        false => Err(ResultsError::Damaged { tables: damaged }),
    }
}

/// A study whose tables are being published.
struct Desk<'a> {
    sampled: &'a SampledStudy,
    archive: Archive,
    manifest: &'a Path,
    folder: PathBuf,
    /// Bytes of tables that may be held in memory.
    room: usize,
}

impl Desk<'_> {
    /// Says whose the tables in the folder are.
    fn own(&self) -> Result<(), StoreError> {
        make_folder(&self.folder)?;
        let SampledStudy { study, plan, .. } = self.sampled;
        Owner::of(self.manifest, study, plan, &self.folder).write(&self.folder)
    }

    /// Writes the table of one stage if the store has a task of it, unless it is there already.
    fn publish(&self, stage: &PlannedStage) -> Result<PublishedTable, ResultsError> {
        let SampledStudy { study, plan, .. } = self.sampled;
        let path = self.folder.join(file(&stage.name));
        let table = |finished| PublishedTable {
            stage: stage.name.clone(),
            path: path.clone(),
            finished,
            quarantined: None,
        };
        let have = self.archive.store().have(&plan.keys_of(stage));
        let stored = stage.among(&have);
        let digest_of = |tasks: &[usize]| digest(plan, tasks, &study.sources);
        let there = written_for(&path);
        let is_there = |digest: &String| there.as_ref() == Some(digest);
        for tasks in [&stage.tasks, &stored] {
            if !tasks.is_empty() && is_there(&digest_of(tasks)) {
                return Ok(table(tasks.len()));
            }
        }
        let (mut pieces, kept) = self.pieces(stage, &have)?;
        if stored.is_empty() {
            return Ok(table(kept.len()));
        }
        let tasks = pieces.tasks()?;
        let digest = match kept.is_empty() {
            true => digest_of(&tasks),
            // Once the store has all of it, it is written anew.
            false => Digest::of(&(digest_of(&tasks), &kept)).to_string(),
        };
        let mut published = table(tasks.len());
        if !tasks.is_empty() && !is_there(&digest) {
            published.quarantined = self.write(stage, &path, pieces, &kept, digest)?;
        }
        Ok(published)
    }

    /// Writes the table of a stage row group by row group. Returns the path of a quarantined file
    /// if the file in its place was not written by any run.
    fn write(
        &self,
        stage: &PlannedStage,
        path: &Path,
        mut pieces: Pieces,
        kept: &[TaskKey],
        digest: String,
    ) -> Result<Option<PathBuf>, ResultsError> {
        let SampledStudy { study, plan, .. } = self.sampled;
        let (finished, lacking, rows) = (pieces.tasks()?.len(), pieces.lacking(), pieces.rows());
        let frame = Frame { plan, stage, sources: &study.sources };
        let mut groups = pieces.groups(frame, |part| Ok(self.read_again(stage, part, kept)?));
        let Some(first) = groups.next().transpose()? else {
            return Ok(None);
        };
        let columns = first.descriptions();
        let metadata = metadata(plan, stage, &columns, &lacking, finished, digest);
        self.own()?;
        // Keep other runs of this machine from replacing tables meanwhile.
        let _alone = lock_to_write(&self.folder);
        // A user may have edited the table, but another run may also have replaced it since it was
        // checked.
        let quarantined = match written_for(path).is_none() && path.is_file() {
            true => quarantine(path)?,
            false => None,
        };
        let mut unread = None;
        let written = write_with(path, Existing::Replace, &self.folder, |file| {
            let groups = groups.map_while(|group| group.map_err(|error| unread = Some(error)).ok());
            let parts = std::iter::once(first).chain(groups);
            parquet::write_parts(file, rows, &metadata, parts)?;
            match &unread {
                None => Ok(()),
                Some(error) => Err(io::Error::other(error.to_string())),
            }
        });
        match unread {
            Some(error) => return Err(error),
            None => written?,
        }
        flush_folder(&self.folder)?;
        Ok(quarantined)
    }

    /// Reads the rows of tasks for which there was no room when they were first read.
    fn read_again(
        &self,
        stage: &PlannedStage,
        part: &Part,
        kept: &[TaskKey],
    ) -> Result<Table, StoreError> {
        let key = |&(task, _): &(usize, usize)| self.sampled.plan.tasks[task].key;
        let first = key(&part.tasks[0]);
        if kept.contains(&first) {
            return self.archive.light(first);
        }
        let keys = part.tasks.iter().map(key);
        match self.archive.published_in_a_row(&stage.name, keys) {
            Some((_, table)) => Ok(table),
            None => self.archive.store().light(first),
        }
    }

    /// The tables of a stage's tasks that the store has, and the rows that are left of others; of
    /// which others. What has been published is not read once more from the store.
    fn pieces(
        &self,
        stage: &PlannedStage,
        have: &[bool],
    ) -> Result<(Pieces, Vec<TaskKey>), StoreError> {
        let (mut pieces, mut kept) = (Pieces::within(self.room), Vec::new());
        let key = |task: usize| self.sampled.plan.tasks[task].key;
        let mut next = 0;
        while let Some(&task) = stage.tasks.get(next) {
            next += 1;
            if have[next - 1] {
                let stored = stage.tasks.iter().zip(have).skip(next - 1);
                let stored = stored.map_while(|(&task, stored)| stored.then(|| key(task)));
                if let Some((rows, table)) = self.archive.published_in_a_row(&stage.name, stored) {
                    let tasks = &stage.tasks[next - 1..][..rows.len()];
                    pieces.add_all(tasks, &rows, table);
                    next += rows.len() - 1;
                } else {
                    pieces.add(task, self.archive.store().light(key(task)))?;
                }
            } else if let Some(rows) = self.archive.rows_of(key(task)) {
                pieces.add(task, Ok(rows))?;
                kept.push(key(task));
            }
        }
        Ok((pieces, kept))
    }
}

/// What a table says of itself. Its columns are described once more in plain JSON, because not
/// every reader of Parquet hands on what Arrow says of fields.
fn metadata(
    plan: &Plan,
    stage: &PlannedStage,
    columns: &[Description],
    lacking: &Lacking,
    finished: usize,
    digest: String,
) -> Metadata {
    let entry = |name: &str, value: String| (name.to_owned(), value);
    let json = "names, words and numbers are plain data";
    let columns = serde_json::to_string(columns).expect(json);
    let lacking = serde_json::to_string(lacking).expect(json);
    Metadata {
        key: None,
        entries: vec![
            entry("study", plan.study.clone()),
            entry("stage", stage.name.clone()),
            entry(KIND, stage.kind.name().to_owned()),
            entry("tasks", stage.tasks.len().to_string()),
            entry("finished", finished.to_string()),
            entry("columns", columns),
            entry(LACKING, lacking),
            entry("digest", digest),
            entry("version", env!("CARGO_PKG_VERSION").to_owned()),
        ],
    }
}

fn written_for(path: &Path) -> Option<String> {
    let metadata = parquet::verify(File::open(path).ok()?).ok()?;
    metadata.get("digest").map(str::to_owned)
}
