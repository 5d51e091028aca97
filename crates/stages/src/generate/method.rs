//! The methods of `generate` stages, each with its table of keys.

use toml::de::DeTable;

use crate::check_context::FromKey;
use crate::generate::files::labels::{WrittenLabels, with_labels_of_cases};
use crate::generate::files::{self, FileTable};
use crate::generate::mesh::{self, ParaboloidTable, PunchTable, WaveTable};
use crate::generate::random::{self, RandomTable};
use crate::generate::realizations::{Growing, Realizations};
use crate::generate::spectrum::{self, SpectrumTable};
use crate::generate::yielded::{self, YieldedTable};
use crate::surface::Heights;
use crate::surface::method::{Method, WaveShape};
use crate::surface::planned::PlannedSurfaces;
use crate::{CheckContext, Reads, RowKind};
use asperity_manifest::diagnostics::{Problems, Span};
use asperity_manifest::keys::expected_keys::ExpectedKeys;
use asperity_manifest::keys::{KeyTable, Layout, Section, Spanned, reader};
use asperity_mechanics::topography::random::Amplitude;

/// Parameter points of a `generate` stage, by method.
#[derive(Debug)]
pub enum SurfacePoints {
    Random(Amplitude, Section<RandomTable>),
    Spectrum(Section<SpectrumTable>),
    File(Section<FileTable>),
    Yielded(Section<YieldedTable>),
    Paraboloid(Section<ParaboloidTable>),
    Wave(WaveShape, Section<WaveTable>),
    FlatPunch(Section<PunchTable>),
}

impl Method {
    /// Returns whether stages with this method have a key `from`.
    pub fn from_key(self) -> FromKey {
        match self {
            Method::Spectrum => FromKey::Optional,
            Method::Yielded => FromKey::Required,
            _ => FromKey::Absent,
        }
    }

    /// Returns the declarations of the keys of this method.
    pub fn layout(self) -> &'static Layout {
        match self {
            Method::Random(_) => RandomTable::layout(),
            Method::Spectrum => SpectrumTable::layout(),
            Method::File => FileTable::layout(),
            Method::Yielded => YieldedTable::layout(),
            Method::Paraboloid => ParaboloidTable::layout(),
            Method::Wave(_) => WaveTable::layout(),
            Method::FlatPunch => PunchTable::layout(),
        }
    }

    /// Reads the table of a stage with this method.
    pub fn read(
        self,
        table: DeTable,
        span: Span,
        expected: &ExpectedKeys<'_>,
        problems: &mut Problems,
    ) -> SurfacePoints {
        use SurfacePoints as Points;
        match self {
            Method::Random(amplitude) => {
                Points::Random(amplitude, reader::read(table, span, expected, problems))
            }
            Method::Spectrum => Points::Spectrum(reader::read(table, span, expected, problems)),
            Method::File => {
                let labelled = with_labels_of_cases(table);
                Points::File(reader::read(labelled, span, expected, problems))
            }
            Method::Yielded => Points::Yielded(reader::read(table, span, expected, problems)),
            Method::Paraboloid => Points::Paraboloid(reader::read(table, span, expected, problems)),
            Method::Wave(shape) => {
                Points::Wave(shape, reader::read(table, span, expected, problems))
            }
            Method::FlatPunch => Points::FlatPunch(reader::read(table, span, expected, problems)),
        }
    }
}

impl SurfacePoints {
    /// Returns the surfaces of each parameter point, or `None` after reporting problems.
    pub fn surfaces(&self, context: &mut CheckContext) -> Option<Vec<PlannedSurfaces>> {
        match self {
            SurfacePoints::Random(amplitude, section) => {
                random::random(*amplitude, section, context)
            }
            SurfacePoints::Spectrum(section) => spectrum::spectra(section, context),
            SurfacePoints::File(section) => files::files(section, context),
            SurfacePoints::Yielded(section) => yielded::surfaces(section, context),
            SurfacePoints::Paraboloid(section) => mesh::paraboloid(section, context.problems),
            SurfacePoints::Wave(shape, section) => mesh::wave(*shape, section, context.problems),
            SurfacePoints::FlatPunch(section) => mesh::punch(section, context.problems),
        }
    }

    /// Returns whether surfaces of the stage are described by their modes alone and have no
    /// heights.
    pub fn lack_heights(&self) -> bool {
        let SurfacePoints::Random(_, section) = self else {
            return false;
        };
        section.points.iter().any(|point| point.table.heights.value() == Some(Heights::None))
    }

    /// Returns whether the stage reads profiles.
    pub fn are_profiles(&self) -> bool {
        let SurfacePoints::File(section) = self else {
            return false;
        };
        section.points.iter().any(|point| files::is_profile(&point.table))
    }

    /// Returns the kinds of rows that the method reads from other stages, or `None` if it reads no
    /// stage.
    pub fn reads(&self) -> Option<Reads> {
        match self {
            SurfacePoints::Spectrum(_) => Some(Reads {
                rows: &[RowKind::PowerSpectra],
                from: "`measure` stages with `what = \"spectrum\"`, `\"stitched-spectrum\"` or \
                       `\"spectrum-from-profiles\"`, where its method is `spectrum`"
                    .into(),
            }),
            SurfacePoints::Yielded(_) => Some(Reads {
                rows: &[RowKind::Loads],
                from: "`solve` stages, where its method is `yielded`".into(),
            }),
            _ => None,
        }
    }

    /// Returns the name of the stage whose height distribution the surfaces have, if there is one.
    pub fn heights_of(&self) -> Option<&Spanned<String>> {
        let key = match self {
            SurfacePoints::Random(_, section) => &section.points.first()?.table.height_distribution,
            SurfacePoints::Spectrum(section) => &section.points.first()?.table.height_distribution,
            _ => return None,
        };
        key.written()
    }

    /// Returns where the manifest gives a label: its value, or the list or the path that has it.
    pub fn span_of_label(&self, name: &str) -> Option<&Span> {
        let SurfacePoints::File(section) = self else {
            return None;
        };
        let written = section.points.iter().filter_map(|point| point.table.labels.written());
        let of_name = written.clone().find_map(|labels| match &labels.value {
            WrittenLabels::Table(values) => values.get(name).map(|value| &value.span),
            WrittenLabels::File(_) => None,
        });
        let mut lists = written.filter(|labels| matches!(labels.value, WrittenLabels::File(_)));
        let path = || section.points.first()?.table.path.written().map(|path| &path.span);
        of_name.or_else(|| lists.next().map(|list| &list.span)).or_else(path)
    }

    /// Returns the keys of adaptive sampling, or `None` for a fixed number of surfaces. All
    /// parameter points of the stage share these keys.
    pub fn growing(&self) -> Option<&Growing> {
        let realizations = match self {
            SurfacePoints::Random(_, section) => &section.points.first()?.table.realizations,
            SurfacePoints::Spectrum(section) => &section.points.first()?.table.realizations,
            SurfacePoints::File(section) => &section.points.first()?.table.realizations,
            _ => return None,
        };
        match &realizations.written()?.value {
            Realizations::Until(growing) => Some(growing),
            Realizations::Number(_) => None,
        }
    }
}
