//! `generate` stages, which draw or read surfaces and describe them.

pub mod files;
pub mod mesh;
pub mod method;
pub mod plausibility;
mod random;
pub mod spectrum;
pub mod yielded;

use std::borrow::Cow;

use arrow::array::{Array, Float64Array};

use crate::columns::*;
use crate::map_file::Reader;
use crate::reduced_units::{FREE_BOUNDARY_VERSION, HARDNESS_VERSION};
use crate::stage::{ContactLoads, distinct, range};
use crate::surface::description::{self, Description};
use crate::surface::labels::of_samples;
use crate::surface::method::Method;
use crate::surface::origin::{MUCH_UNRELIABLE, PERIODIC_TIP_VERSION};
use crate::surface::spectrum::{Source, SpectrumSurface};
use crate::surface::{Heights, Origin, Params, coordinates};
use crate::surface_files::SurfaceFiles;
use crate::version::{PartVersion, Version};
use crate::{
    Context, Definition, Effort, Extent, Footprint, Input, Kind, Reads, Recipe, RowKind, Stage,
    StageError, departures, solve,
};
use asperity_manifest::diagnostics::{counted, listed};
use asperity_manifest::keys::quantity;
use asperity_mechanics::threads::Threads;
use asperity_mechanics::topography::prescribed_heights::{HeightDistribution, ITERATIONS};
use asperity_mechanics::topography::surface::Surface;
use asperity_tables::column::{self, Column, lists};
use asperity_tables::parquet::Columns;
use asperity_tables::source::TableSource;
use asperity_tables::table::Table;

/// Version of the results, which is part of every key. It is raised whenever numbers change.
pub const VERSION: Version = Version::new(3, &[]);

/// Rms deviation of the heights from their prescribed distribution, in rms heights, above which
/// users are warned. Surfaces with a hundred modes or more stay below a fifth of it.
const MUCH_DEVIATION: f64 = 0.05;

/// Cost of adjusting phases to a height distribution, in pairs of transforms of the mesh of the
/// iterations, measured with 768² nodes. The heights are also sorted in each iteration.
const PAIRS_OF_ITERATIONS: f64 = 1.5 * ITERATIONS;

/// The kind of stage that draws surfaces or reads measured ones.
pub const STAGE: Definition = Definition {
    name: "generate",
    version: VERSION,
    reads: Reads { rows: &[], from: Cow::Borrowed("nothing") },
    row_kind: |_| Some(RowKind::Surfaces),
    columns: || {
        let lists: [&[Column]; 15] = [
            &[SURFACE, METHOD, NODES, SIDE],
            &[NODES_X, NODES_Y, SIDE_X, SIDE_Y, RMS_SLOPE],
            &RANDOM_SURFACE_COORDINATES,
            &[ANISOTROPY_RATIO, ANISOTROPY_ANGLE, SPECTRUM_OF],
            &HEIGHT_DISTRIBUTION_COORDINATES,
            &MEASURED_SURFACE_COORDINATES,
            &SHAPE_COORDINATES,
            &description::descriptors().all(),
            &description::height_columns().all(),
            &FILE_COLUMNS,
            &RELIABILITY,
            &description::spectrum_descriptors().all(),
            &PAIR_COORDINATES,
            &YIELDED_COORDINATES,
            &[HEIGHTS],
        ];
        lists.concat()
    },
    summary,
};

/// Returns the parameter columns of the method that makes the surface, such as `hurst` and `seed`,
/// without those that all surfaces have.
pub fn own_columns(origin: &Origin) -> Vec<Column> {
    let mut origin = origin.clone();
    if let Origin::Spectrum { surface, .. } = &mut origin
        && surface.source.is_unread()
    {
        surface.source = Source::Stage { spectrum_of: Some(String::new()) };
    }
    let coordinates = coordinates::own_coordinates(&origin).into_iter();
    coordinates.map(|(column, _)| column).collect()
}

/// Returns one row with the columns [`own_columns`] and their values.
pub fn own_row(origin: &Origin) -> Table {
    Table::row(&coordinates::own_coordinates(origin))
}

impl Params {
    /// Draws or reads the surface, and returns it with its recipe. If the spectrum is in the table
    /// of another task, the returned recipe contains the name of the measured surface. `heights` is
    /// the prescribed height distribution.
    fn draw_with_inputs(
        &self,
        inputs: &[Input],
        heights: Option<&HeightDistribution>,
        sources: &SurfaceFiles,
        threads: &Threads,
    ) -> Result<(Params, Surface), StageError> {
        let mut params = self.clone();
        let (Origin::Spectrum { surface, .. }, [measured]) = (&mut params.origin, inputs) else {
            let surface = self.origin.draw_with(heights, self.sides(), sources, threads)?;
            return Ok((params, surface));
        };
        let name = measured.table.texts(SURFACE.name)?.value(0).to_owned();
        let spectrum_of = Some(name);
        surface.source = Source::Stage { spectrum_of };
        let density = SpectrumSurface::density_from_spectrum(&measured.table)?;
        let drawn = surface.draw(&density, heights, self.grid()?, threads)?;
        Ok((params, drawn))
    }
}

impl Stage for Params {
    fn kind(&self) -> Kind {
        Kind::Generate
    }

    fn part_versions(&self) -> Vec<PartVersion> {
        match &self.origin {
            Origin::File(file) => {
                let tip = PartVersion::new("tip_version", "tip", PERIODIC_TIP_VERSION);
                let reader = file.reader.as_ref().and_then(Reader::part_version);
                reader.into_iter().chain([tip]).collect()
            }
            Origin::Yielded(_) => vec![
                PartVersion::new("solve_version", "`solve`", solve::VERSION),
                PartVersion::new("boundary", "free boundary", FREE_BOUNDARY_VERSION),
                PartVersion::new("hardness", "hardness", HARDNESS_VERSION),
            ],
            _ => Vec::new(),
        }
    }

    /// Draws one surface and describes it in one row.
    fn run(&self, inputs: &[Input], context: &Context) -> Result<Table, StageError> {
        if let (Origin::Random { .. }, Heights::None) = (&self.origin, self.heights) {
            let grid = self.grid()?;
            let surface = self.origin.random_surface(grid.cell()).expect("the origin is random");
            let description = Description::from_modes(&surface, grid.cell());
            let columns = description.row(self, grid);
            return Ok(Table::new(1, columns));
        }
        let (params, surface, found) = match &self.origin {
            Origin::File(file) => {
                let read = file.read(self.sides(), context.sources)?;
                let found = description::file_columns().filled(file, &[(file, &read)]);
                (self.clone(), read.prepared.surface, found)
            }
            Origin::Yielded(yielded) => {
                let is_interrupted = || (context.interrupted)();
                let surface = yielded.draw(context.sources, context.threads, &is_interrupted)?;
                (self.clone(), surface, vec![])
            }
            _ => {
                let (sources, threads) = (context.sources, context.threads);
                let heights = self.origin.height_distribution(sources, threads)?;
                let (params, surface) =
                    self.draw_with_inputs(inputs, heights.as_ref(), sources, threads)?;
                let deviation = heights.and_then(|heights| heights.deviation(&surface));
                let found = description::height_columns().filled(&params.origin, &[deviation]);
                (params, surface, found)
            }
        };
        let description = Description::from_surface(&params.origin, &surface, context.threads);
        let mut columns = description.row(&params, surface.grid());
        columns.extend(found);
        if self.heights == Heights::Keep {
            let heights = Float64Array::from(surface.into_heights());
            let length = heights.len();
            columns.push((HEIGHTS, lists(heights, [length])));
        }
        Ok(Table::new(1, columns))
    }

    fn empty_table(&self, _: &[(String, Table)]) -> Result<Table, StageError> {
        Ok(empty_table([self]))
    }

    fn columns_read(&self) -> Columns {
        Columns::All
    }

    fn coordinates(&self) -> Vec<(Column, column::Value)> {
        coordinates::coordinates(self)
    }

    /// Returns the effort of drawing and describing the surface: six pairs of transforms, or none
    /// for a description by modes.
    fn effort(&self, _: Extent) -> Effort {
        match (&self.origin, self.heights) {
            (Origin::Random { surface, .. }, Heights::None) => {
                let modes = 1.6 * f64::from(surface.spectrum.k_upper).powi(2);
                Effort::seconds(5e-8 * modes)
            }
            // Both surfaces are drawn, and one of them is shifted.
            (Origin::Pair(_), _) => Effort::pairs(12.0),
            (Origin::Yielded(yielded), _) => Effort::pairs(12.0 + yielded.pairs()),
            _ => Effort::pairs(6.0 + PAIRS_OF_ITERATIONS * self.nodes_of_iterations()),
        }
    }

    fn footprint(&self) -> Footprint {
        Footprint {
            work: self.bytes_per_node(),
            table: match self.heights {
                Heights::Keep => 8.0,
                Heights::Redraw | Heights::None => 0.0,
            },
        }
    }

    fn rows(&self, _: usize) -> usize {
        1
    }

    fn mesh(&self) -> Option<([usize; 2], f64)> {
        let [size_x, size_y] = self.size();
        Some((self.nodes(), size_x.max(size_y)))
    }

    /// If the heights are stored, returns the recipe with redrawn heights, which describes the same
    /// surface. Otherwise returns `None`.
    fn identity_recipe(&self) -> Option<Recipe> {
        let keeps_heights = self.heights == Heights::Keep;
        keeps_heights.then(|| Recipe::Generate(self.with(Heights::Redraw)))
    }
}

/// Returns a table without rows that has all columns of these surfaces.
pub fn empty_table<'f>(surfaces: impl IntoIterator<Item = &'f Params>) -> Table {
    let mut columns = Vec::new();
    let mut add = |more: Vec<Column>| {
        let new = more.into_iter().filter(|column| !columns.contains(column));
        columns.extend(new.collect::<Vec<_>>());
    };
    add(vec![SURFACE, METHOD]);
    let surfaces: Vec<&Params> = surfaces.into_iter().collect();
    for surface in &surfaces {
        add(coordinates::columns_of_grid(surface));
    }
    for surface in &surfaces {
        add(vec![coordinates::column_of_slope(&surface.origin)]);
    }
    for surface in &surfaces {
        add(own_columns(&surface.origin));
    }
    let labels = || surfaces.iter().filter_map(|surface| surface.origin.labels());
    for labels in labels() {
        add(labels.cells().map(|(column, _)| column).collect());
    }
    let scaled = surfaces.iter().find(|surface| surface.origin.given_rms_height().is_some());
    if let Some(surface) = scaled.or(surfaces.first()) {
        let origin = &surface.origin;
        let descriptors = description::descriptors().of(origin).into_iter();
        add(descriptors.map(|column| coordinates::descriptor(origin, column)).collect());
    }
    for surface in &surfaces {
        add(description::height_columns().of(&surface.origin));
        if let Origin::File(file) = &surface.origin {
            add(description::file_columns().of(file));
        }
    }
    let mut origins = surfaces.iter().map(|surface| &surface.origin);
    if origins.any(|origin| matches!(origin, Origin::Random { .. })) {
        columns.extend(description::spectrum_descriptors().all());
    }
    let table = Table::empty(&columns);
    if labels().any(|labels| labels.is_sample) { of_samples(&table) } else { table }
}

/// Returns the phrases that summarise a table of surfaces for users.
///
/// # Errors
/// If the table is not one of a `generate` stage.
fn summary(source: &TableSource, loads: &ContactLoads) -> Result<Vec<String>, StageError> {
    let table = source.table().map_err(StageError::Store)?;
    let methods = distinct(source, METHOD.name)?;
    let shapes: Vec<&str> =
        Method::all().filter(|method| method.is_shape()).map(Method::word).collect();
    let is_rough = !methods.iter().all(|method| shapes.contains(&method.as_str()));
    if !table.has(M02.name) {
        let parts = [
            Some(counted(table.rows(), "profile")),
            read_from_files(&table, source)?,
            range(source, RMS_HEIGHT.name, "Rq")?,
            range(source, RMS_SLOPE.name, "rms slope")?,
        ];
        return Ok(parts.into_iter().flatten().collect());
    }
    let parts = [
        Some(counted(table.rows(), "surface")),
        read_from_files(&table, source)?,
        range(source, RELIABLE_WAVELENGTH.name, "reliable above")?,
        unreliable_slopes(&table)?,
        unreached_heights(&table)?,
        if is_rough { range(source, "nayak", "Nayak α")? } else { None },
        match *loads {
            ContactLoads::Reduced => range(source, "full_contact_load", "full contact at")?,
            ContactLoads::Absolute { effective_modulus, unit } => {
                full_contact(&table, effective_modulus, unit)?
            }
            ContactLoads::NotHalfSpace => None,
        },
        if is_rough { caveat(&table)? } else { None },
    ];
    Ok(parts.into_iter().flatten().collect())
}

/// Returns the range of the mean pressures of full contact of half-spaces.
fn full_contact(
    table: &Table,
    effective_modulus: f64,
    unit: Option<&str>,
) -> Result<Option<String>, StageError> {
    if !table.has("full_contact_load") {
        return Ok(None);
    }
    let (reduced, slopes) = (table.reals("full_contact_load")?, table.reals(RMS_SLOPE.name)?);
    let pairs = reduced.iter().zip(slopes).filter_map(|(load, slope)| load.zip(slope));
    let pressures = pairs.map(|(load, slope)| load * slope * effective_modulus);
    let range = quantity::range(pressures, unit);
    Ok(range.map(|range| format!("full contact at {range}")))
}

/// Summarises the files of measured surfaces: formats, unit, channels, removed and filled points.
fn read_from_files(table: &Table, source: &TableSource) -> Result<Option<String>, StageError> {
    if !FILE_COLUMNS.iter().any(|column| table.has(column.name)) {
        return Ok(None);
    }
    let mut parts = Vec::new();
    if table.has(FORMAT.name) {
        let units = distinct(source, UNIT.name)?;
        let named = units.iter().find(|unit| !unit.is_empty());
        let unit = named.map_or_else(|| "no unit".to_owned(), |unit| format!("lengths in {unit}"));
        parts.push(format!("{}, {unit}", distinct(source, FORMAT.name)?.join(", ")));
        let most = table.integers(CHANNELS.name)?.iter().flatten().max();
        if most > Some(1) {
            let read = distinct(source, CHANNEL_READ.name)?;
            parts.push(format!("channel {}", listed(read.iter().map(String::as_str), "and")));
        }
    }
    let most = |column: Column| {
        let counts = table.optional(column.name, Table::integers)?;
        Ok::<_, StageError>(counts.map(|counts| counts.iter().flatten().max().unwrap_or(0)))
    };
    let spikes =
        most(REMOVED_SPIKES)?.map(|most| format!("{} removed", counted(most as usize, "spike")));
    let islands = most(REMOVED_ISLANDS)?
        .map(|most| format!("{} of islands removed", counted(most as usize, "point")));
    let filled = most(FILLED_NODES)?
        .filter(|most| *most > 0)
        .map(|most| format!("{most} missing nodes filled"));
    parts.extend([spikes, islands, filled].into_iter().flatten());
    Ok(Some(parts.join(", ")))
}

/// Returns a warning about measured surfaces whose slope comes mainly from waves that the
/// instrument did not resolve, and that no filter removed. Returns `None` if there are no such
/// surfaces.
fn unreliable_slopes(table: &Table) -> Result<Option<String>, StageError> {
    if !table.has(UNRELIABLE_SHARE.name) {
        return Ok(None);
    }
    let shares = table.reals(UNRELIABLE_SHARE.name)?;
    let cutoffs = table.reals(RELIABLE_WAVELENGTH.name)?;
    let filters = table.optional(LOW_PASS.name, Table::reals)?;
    let words = table.optional(LOW_PASS_AT.name, Table::texts)?;
    let is_filtered = |row: usize| {
        words.is_some_and(|words| words.is_valid(row))
            || filters.is_some_and(|filters| {
                filters.is_valid(row) && filters.value(row) >= cutoffs.value(row)
            })
    };
    let kept = (0..table.rows()).filter(|&row| shares.is_valid(row) && !is_filtered(row));
    let most = kept.map(|row| shares.value(row)).fold(0.0, f64::max);
    Ok((most > MUCH_UNRELIABLE).then(|| {
        format!(
            "{:.0} % of the mean square slope comes from waves shorter than `reliable_wavelength`",
            100.0 * most
        )
    }))
}

/// Returns a warning about surfaces that do not follow their prescribed height distribution, which
/// their spectrum does not allow. Returns `None` if there are no such surfaces.
fn unreached_heights(table: &Table) -> Result<Option<String>, StageError> {
    if !table.has(HEIGHT_DEVIATION.name) {
        return Ok(None);
    }
    let deviations = table.reals(HEIGHT_DEVIATION.name)?.iter().flatten();
    let beyond: Vec<f64> = deviations.filter(|one| *one > MUCH_DEVIATION).collect();
    let most = beyond.iter().copied().reduce(f64::max);
    Ok(most.map(|most| {
        format!(
            "the spectrum keeps {} from the prescribed height distribution: `height_deviation` up \
             to {most:.2}",
            counted(beyond.len(), "surface")
        )
    }))
}

/// Returns a warning about parameter points to which the theories of rough contact do not apply,
/// because the surfaces are not isotropic Gaussian roughness. The warning gives the number of these
/// points and the reason for the first one. Returns `None` if there are no such points.
fn caveat(surfaces: &Table) -> Result<Option<String>, StageError> {
    let points = departures::points(surfaces)?;
    let others: Vec<_> = points.iter().filter(|point| !point.departures.is_empty()).collect();
    Ok(others.first().map(|first| {
        let number = match points.len() {
            1 => String::new(),
            all => format!("{} of {all} points are ", others.len()),
        };
        let why = first.departures.join(", ");
        let such_as = if others.len() > 1 { "for example " } else { "" };
        format!("{number}not isotropic Gaussian roughness: {such_as}{why}")
    }))
}

#[cfg(test)]
mod tests;
