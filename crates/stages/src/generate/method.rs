//! The methods of `generate` stages, each with its keys.

use crate::Kind;
use crate::check_context::FromKey;
use crate::generate::files::FileTable;
use crate::generate::files::labels::with_labels_of_cases;
use crate::generate::mesh::{ParaboloidTable, PunchTable, WaveTable};
use crate::generate::random::RandomTable;
use crate::generate::spectrum::SpectrumTable;
use crate::generate::yielded::YieldedTable;
use crate::stage_points::StageVariant;
use crate::surface::method::{METHODS, Method};
use asperity_manifest::keys::Section;

/// Returns the variants of `generate` stages, the default first.
pub fn variants() -> Vec<StageVariant> {
    let kind = Kind::Generate;
    let variant = |(method, word, about)| {
        let own = match method {
            Method::Random(amplitude) => {
                StageVariant::new(kind, move |keys: Section<RandomTable>| (amplitude, keys))
            }
            Method::Spectrum => StageVariant {
                from_key: FromKey::Optional,
                ..StageVariant::new(kind, |keys: Section<SpectrumTable>| keys)
            },
            Method::File => StageVariant {
                prepare: with_labels_of_cases,
                ..StageVariant::new(kind, |keys: Section<FileTable>| keys)
            },
            Method::Yielded => StageVariant {
                from_key: FromKey::Required,
                ..StageVariant::new(kind, |keys: Section<YieldedTable>| keys)
            },
            Method::Paraboloid => StageVariant::new(kind, |keys: Section<ParaboloidTable>| keys),
            Method::Wave(shape) => {
                StageVariant::new(kind, move |keys: Section<WaveTable>| (shape, keys))
            }
            Method::FlatPunch => StageVariant::new(kind, |keys: Section<PunchTable>| keys),
        };
        own.selected_by("method", word, about)
    };
    METHODS.into_iter().map(variant).collect()
}
