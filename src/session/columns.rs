//! What the columns of tables mean, and in which units they are.

use serde::Serialize;

use super::error::{SessionError, UnknownName};
use asperity_pipeline::results;
use asperity_pipeline::study::Study;
use asperity_stages::{Kind, columns_of};
use asperity_tables::column::Description;
use asperity_tables::table::Table;

/// The columns of a stage's table, or those that a kind of stage may have.
#[derive(Debug, Clone, Serialize)]
pub struct DescribedColumns {
    /// The stage, if they are those of a study.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stage: Option<String>,
    /// What the stage does.
    pub kind: Kind,
    /// The columns, in the order of the table.
    pub columns: Vec<Description>,
}

impl DescribedColumns {
    /// All that any study may have, by kind of stage.
    pub fn of_kinds() -> Vec<DescribedColumns> {
        let of_kind = |kind| DescribedColumns {
            stage: None,
            kind,
            columns: Table::empty(&columns_of(kind)).descriptions(),
        };
        Kind::ALL.into_iter().map(of_kind).collect()
    }

    /// The stages of a study, or the one of this name.
    pub(super) fn of_study(
        study: &Study,
        wanted: Option<&str>,
    ) -> Result<Vec<DescribedColumns>, SessionError> {
        let tables = study.empty_tables()?;
        let stages = study.stages.iter().zip(tables);
        let mut described: Vec<_> = stages
            .map(|(stage, table)| DescribedColumns {
                stage: Some(stage.name.clone()),
                kind: stage.work.kind(),
                columns: results::with_own_columns(table).descriptions(),
            })
            .collect();
        if let Some(wanted) = wanted {
            let names: Vec<&str> = study.stages.iter().map(|stage| &*stage.name).collect();
            let place = names.iter().position(|name| *name == wanted);
            let place = place.ok_or_else(|| UnknownName::stage(wanted, &names))?;
            described = vec![described.swap_remove(place)];
        }
        Ok(described)
    }
}
