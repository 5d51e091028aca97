//! What there is to be seen of a finished task.

use arrow::array::AsArray;
use arrow::datatypes::Float64Type;

use super::Map;
use super::loads::{ShownLoad, rows_under};
use crate::cli::{Failure, Misused, counted};
use asperity_contact::grid::Grid;
use asperity_contact::morphology::map::ContactMap;
use asperity_contact::threads::Threads;
use asperity_contact::topography::surface::Surface;
use asperity_report::charts::raster::{Raster, Scale};
use asperity_stages::columns::{CONTACT, PRESSURES, UNIT};
use asperity_stages::grids::Grids;
use asperity_stages::surface_files::SurfaceFiles;
use asperity_stages::{Kind, StageError, generate};
use asperity_tables::parquet::Columns;
use asperity_tables::store::Store;
use asperity_tables::store::key::TaskKey;
use asperity_tables::store::provenance::Provenance;
use asperity_tables::table::Table;

/// A map as a picture.
pub struct Picture {
    pub raster: Raster,
    pub map: Map,
    /// Along x and y.
    pub nodes: [usize; 2],
    /// The load; `None` for heights and for contacts at all loads.
    pub load: Option<ShownLoad>,
    /// What the ends of the colours mean; none where there are but two colours.
    pub range: Option<Range>,
}

/// The least and the largest number of a map.
pub struct Range {
    pub ends: [f64; 2],
    pub unit: String,
}

/// Draws what there is of a task, or of the one that it was computed from.
pub fn draw(
    key: TaskKey,
    map: Option<Map>,
    load: Option<f64>,
    store: &Store,
    sources: &SurfaceFiles,
) -> Result<Picture, Failure> {
    let finished = FinishedTask::read(key, store)?;
    match (finished.kind(), map) {
        (Some(Kind::Generate), None | Some(Map::Heights)) if load.is_some() => Err(Misused(
            "heights are those of the surface before it is pressed; leave out `--load`".to_owned(),
        )
        .into()),
        (Some(Kind::Generate), None | Some(Map::Heights)) => finished.heights(sources),
        (Some(Kind::Generate), Some(map)) => Err(Misused(format!(
            "task {key} made a surface and knows no {}; name one that pressed it",
            map.name()
        ))
        .into()),
        (Some(Kind::Solve), None | Some(Map::Contact)) => finished.contact(load),
        (Some(Kind::Solve), Some(Map::Pressures)) => finished.pressures(load),
        _ => match finished.provenance.inputs.as_slice() {
            [input] => draw(*input, map, load, store, sources),
            inputs => Err(Misused(format!(
                "task {key} has no map of its own, and reads {}: name one of them",
                counted(inputs.len(), "other task")
            ))
            .into()),
        },
    }
}

/// A finished task's table, and how it came about.
struct FinishedTask {
    table: Table,
    provenance: Provenance,
}

impl FinishedTask {
    fn read(key: TaskKey, store: &Store) -> Result<FinishedTask, Failure> {
        let (table, provenance) = store.read_with_provenance(key, Columns::All)?;
        Ok(FinishedTask { table, provenance })
    }

    fn kind(&self) -> Option<Kind> {
        let stage = &self.provenance.stage;
        Kind::ALL.into_iter().find(|kind| kind.name() == stage)
    }

    /// Heights that were not kept are drawn again.
    fn heights(&self, sources: &SurfaceFiles) -> Result<Picture, Failure> {
        let params: generate::Params = serde_json::from_str(&self.provenance.recipe)?;
        let surface = params.surface(&self.table, sources, &Threads::one());
        let surface = surface.map_err(|error| match error {
            StageError::Source(source) => Failure::from(format!(
                "{source}; name the manifest and its stage instead of the key"
            )),
            other => other.into(),
        })?;
        let unit = match self.table.texts(UNIT.name) {
            Ok(units) => units.value(0).to_owned(),
            Err(_) => String::new(),
        };
        Ok(of_surface(&surface, unit))
    }

    fn contact(&self, load: Option<f64>) -> Result<Picture, Failure> {
        let grid = self.grid()?;
        let maps = self.table.bytes(CONTACT.name)?;
        let map = |row: usize| ContactMap::from_bytes(grid.nodes(), maps.value(row));
        let rows: Vec<usize> = (0..self.table.rows()).collect();
        let row = load.map(|load| self.row_under(load, &rows)).transpose()?;
        let raster = match row {
            Some(row) => Raster::of_contact(&map(row)?),
            None => {
                let maps: Vec<_> = rows.into_iter().map(map).collect::<Result<_, _>>()?;
                Raster::of_contacts(&maps)
            }
        };
        Ok(Picture {
            raster: raster.in_proportion(grid.cell().size()),
            map: Map::Contact,
            nodes: grid.nodes(),
            load: row.map(|row| ShownLoad::of(&self.table, row)).transpose()?,
            range: None,
        })
    }

    fn pressures(&self, load: Option<f64>) -> Result<Picture, Failure> {
        let lists = self.table.lists(PRESSURES.name).ok();
        let kept: Vec<usize> = match lists {
            None => vec![],
            Some(lists) => {
                (0..self.table.rows()).filter(|&row| lists.value_length(row) > 0).collect()
            }
        };
        let (Some(lists), Some(&heaviest)) = (lists, kept.last()) else {
            let message = "no pressures are kept of this task; the key `pressures` of its stage \
                           keeps them";
            return Err(Misused(message.to_owned()).into());
        };
        let row = match load {
            Some(load) => self.row_under(load, &kept)?,
            None => heaviest,
        };
        let list = lists.value(row);
        let pressures = list.as_primitive::<Float64Type>().iter();
        let pressures: Vec<f64> = pressures.map(Option::unwrap_or_default).collect();
        let grid = self.grid()?;
        let raster = Raster::of_pressures(grid.nodes(), &pressures);
        Ok(Picture {
            raster: raster.in_proportion(grid.cell().size()),
            map: Map::Pressures,
            nodes: grid.nodes(),
            load: Some(ShownLoad::of(&self.table, row)?),
            range: Some(Range::of(&Scale::of_pressures(&pressures), String::new())),
        })
    }

    fn grid(&self) -> Result<Grid, Failure> {
        Ok(Grids::of(&self.table)?.grid(0)?)
    }

    /// Returns the first of these rows that has this load.
    fn row_under(&self, load: f64, rows: &[usize]) -> Result<usize, Failure> {
        let found = rows_under(&self.table, rows, load)?;
        Ok(*found.first().ok_or("the task has no load")?)
    }
}

fn of_surface(surface: &Surface, unit: String) -> Picture {
    let (grid, heights) = (surface.grid(), surface.heights());
    let raster = Raster::of_heights(grid.nodes(), heights);
    Picture {
        raster: raster.in_proportion(grid.cell().size()),
        map: Map::Heights,
        nodes: grid.nodes(),
        load: None,
        range: Some(Range::of(&Scale::of_heights(heights), unit)),
    }
}

impl Range {
    fn of(scale: &Scale, unit: String) -> Range {
        let (lowest, highest) = scale.range().into_inner();
        Range { ends: [lowest, highest], unit }
    }
}
