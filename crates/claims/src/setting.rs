//! The setting in which claims are tested, and the spectrum and mesh of each surface.
//!
//! Claims compare spectra, meshes and corrections. If a study also varies the tolerance, modulus,
//! slope or method, its rows repeat surfaces or mix two curves. Therefore claims use the rows with
//! one combination of these parameters, the *setting*, and report the other rows as left out.

use std::cmp::Reverse;
use std::fmt;

use arrow::array::Array;

use asperity_stages::aggregate::nayak_parameters;
use asperity_stages::columns::*;
use asperity_stages::ensemble::{ParameterPoint, grouped};
use asperity_stages::grids::Meshes;
use asperity_stages::solve::is_unconverged;
use asperity_stages::surface::coordinates;
use asperity_tables::column::{Column, ColumnKind, Role, Value};
use asperity_tables::table::{Table, TableError};

/// Names of the parameters that claims compare.
const COMPARED: [&str; 9] = [
    HURST.name,
    K_LOWER.name,
    K_ROLLOFF.name,
    K_UPPER.name,
    NODES.name,
    NODES_X.name,
    NODES_Y.name,
    CORRECTION.name,
    COEFFICIENT.name,
];

/// Parameters of anisotropic surfaces. Null or a ratio of 1 means an isotropic surface.
const ANISOTROPY_PARAMETERS: [&str; 2] = [ANISOTROPY_RATIO.name, ANISOTROPY_ANGLE.name];

/// Parameters that describe rows whose surfaces, asperity models, adhesion, layers, second body or
/// former contact no claim uses.
pub const NOT_COMPARED: [&str; 26] = [
    METHOD.name,
    ANISOTROPY_RATIO.name,
    ANISOTROPY_ANGLE.name,
    TARGET_SKEWNESS.name,
    TARGET_KURTOSIS.name,
    HEIGHTS_OF.name,
    INTERACTION.name,
    WORK_OF_ADHESION.name,
    INTERACTION_RANGE.name,
    CONTROL.name,
    BRANCH.name,
    NODE_SET.name,
    LAYER_THICKNESS.name,
    LAYER_POISSON_RATIO.name,
    LAYER_BASE.name,
    LAYER_MODULUS_RATIO.name,
    SUBSTRATE_POISSON_RATIO.name,
    AGAINST.name,
    SHIFT_X.name,
    SHIFT_Y.name,
    MIRROR.name,
    FROM_RMS_SLOPE.name,
    YIELDED_LOAD.name,
    YIELDED_PRESSURE.name,
    YIELDED_HARDNESS.name,
    YIELDED_HARDNESS_REDUCED.name,
];

/// Columns that exclude a row from claims on areas: anisotropy, heights that are not Gaussian,
/// asperity models, adhesion, layers, pairs of surfaces, and surfaces that have yielded. Null or an
/// anisotropy ratio of 1 does not exclude it.
const EXCLUDING_COLUMNS: [&str; 9] = [
    ANISOTROPY_RATIO.name,
    TARGET_KURTOSIS.name,
    HEIGHTS_OF.name,
    INTERACTION.name,
    WORK_OF_ADHESION.name,
    LAYER_THICKNESS.name,
    AGAINST.name,
    YIELDED_LOAD.name,
    YIELDED_PRESSURE.name,
];

/// Parameters that all rows used by claims share, and the rows left out.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Setting {
    pub point: ParameterPoint,
    /// Rows with other values of these parameters.
    pub left_out: Vec<LeftOut>,
}

/// Rows that no claim uses.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOut {
    /// Parameters in which the rows differ from the setting.
    pub differs: ParameterPoint,
    pub rows: usize,
}

impl Setting {
    /// Selects the setting with the most rows of random isotropic surfaces in these tables. If
    /// several settings have as many rows, it selects the tightest tolerance, then the first
    /// setting.
    pub fn most_frequent<'a>(tables: impl IntoIterator<Item = &'a Table>) -> Setting {
        let mut settings = Counts::default();
        let mut not_drawn = Counts::default();
        for table in tables {
            let parameters = table.in_role(Role::Parameter);
            for rows in grouped(&parameters) {
                let point = ParameterPoint::from_row(&parameters, rows[0]);
                let is_meant =
                    EXCLUDING_COLUMNS.iter().all(|name| is_without(name, point.get(name)));
                match point.get(HURST.name).filter(|_| is_meant) {
                    Some(_) => {
                        let setting = point.without(&COMPARED).without(&ANISOTROPY_PARAMETERS);
                        settings.add(setting, rows.len());
                    }
                    None => not_drawn.add(point.only(&NOT_COMPARED), rows.len()),
                }
            }
        }
        let most_frequent = settings.0.iter().min_by_key(|(point, rows)| {
            let tolerance = point.get(TOLERANCE.name).cloned();
            (Reverse(*rows), tolerance)
        });
        let chosen = most_frequent.map(|(point, _)| point.clone()).unwrap_or_default();
        let all = settings.0.into_iter().chain(not_drawn.0);
        let left_out = all
            .filter(|(point, _)| *point != chosen)
            .map(|(point, rows)| LeftOut { differs: point.beyond(&chosen), rows });
        Setting { left_out: left_out.collect(), point: chosen }
    }

    /// Returns the rows of a table that agree with the setting in the columns that the table has.
    /// Anisotropic surfaces and asperity models are omitted; `of_asperities` returns the latter.
    pub fn rows(&self, table: &Table) -> Table {
        self.rows_of_any(table, &EXCLUDING_COLUMNS)
    }

    /// Returns the rows in the setting that no column of `without` excludes (see [`is_without`]).
    fn rows_of_any(&self, table: &Table, without: &[&str]) -> Table {
        let batch = table.batch();
        let column_of = |(name, value)| Some((batch.column_by_name(name)?, value));
        let mut rows: Vec<usize> = (0..table.rows()).collect();
        for name in without {
            if let Some(column) = batch.column_by_name(name) {
                rows.retain(|&row| is_without(name, Value::from_array(column, row).as_ref()));
            }
        }
        for (column, value) in self.point.iter().filter_map(column_of) {
            rows.retain(|&row| Value::from_array(column, row).as_ref() == Some(value));
        }
        table.pick(&rows)
    }
}

/// Returns true if a value is null, missing, or an anisotropy ratio of 1.
fn is_without(name: &str, value: Option<&Value>) -> bool {
    value.is_none_or(|value| name == ANISOTROPY_RATIO.name && *value == Value::Real(1.0))
}

/// Returns the rows of asperity models on surfaces in the setting, with any tolerance and any limit
/// of transform pairs. Loads at which the solver gave up are omitted, because their forces are not
/// balanced.
pub fn of_asperities(table: &Table, setting: &Setting) -> Table {
    let Some(interactions) = table.batch().column_by_name(INTERACTION.name) else {
        return table.pick(&[]);
    };
    let stops = table.texts(STOP.name).ok();
    let is_given_up = |row| stops.is_some_and(|stops| is_unconverged(stops.value(row)));
    let rows: Vec<usize> =
        (0..table.rows()).filter(|&row| interactions.is_valid(row) && !is_given_up(row)).collect();
    let of_surfaces = Setting {
        point: setting.point.clone().without(&[TOLERANCE.name, MAX_PAIRS.name]),
        left_out: Vec::new(),
    };
    of_surfaces.rows_of_any(&table.pick(&rows), &[ANISOTROPY_RATIO.name])
}

/// Parameter points in order of appearance, with their numbers of rows.
#[derive(Default)]
struct Counts(Vec<(ParameterPoint, usize)>);

impl Counts {
    fn add(&mut self, point: ParameterPoint, rows: usize) {
        match self.0.iter_mut().find(|(known, _)| *known == point) {
            Some((_, count)) => *count += rows,
            None => self.0.push((point, rows)),
        }
    }
}

impl fmt::Display for LeftOut {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} rows with {}", self.rows, self.differs)
    }
}

/// Returns the parameters of the spectrum and the mesh of a row, with Nayak's parameter over the
/// modes of the cell. Returns `None` if the surface is on a rectangle, a pair of surfaces, has
/// yielded, or is not drawn from a spectrum.
pub fn spectrum(table: &Table, row: usize) -> Result<Option<ParameterPoint>, TableError> {
    if !table.has(HURST.name) || coordinates::is_altered(table, row) {
        return Ok(None);
    }
    let own = table.pick(&[row]);
    let cutoffs = [HURST.name, K_LOWER.name, K_ROLLOFF.name, K_UPPER.name];
    let point = ParameterPoint::from_row(&own, 0).only(&cutoffs);
    // The paper only has squares.
    let Some(nodes) = Meshes::new(&own)?.of_square(0).filter(|_| point.get(HURST.name).is_some())
    else {
        return Ok(None);
    };
    let nayak = nayak_parameters(&own)?[0].map(|nayak| (NAYAK_OF_MODES, Value::Real(nayak)));
    let further = [(NODES, Value::Integer(nodes))].into_iter().chain(nayak);
    Ok(Some(point.and(ParameterPoint::from_cells(further))))
}

/// Column of Nayak's parameter α over the modes of the cell, as a parameter of a group.
const NAYAK_OF_MODES: Column = Column {
    name: "nayak",
    role: Role::Parameter,
    kind: ColumnKind::Real,
    unit: "1",
    meaning: "Nayak's parameter over the modes of the cell",
    codes: &[],
};

/// Parameters that names of spectra contain in addition to the cutoffs, because they vary.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Varied {
    hurst: bool,
    nodes: bool,
}

impl Varied {
    /// Finds the parameters that differ among these spectra.
    pub fn among(spectra: &[ParameterPoint]) -> Varied {
        let varies =
            |name: &str| spectra.iter().any(|spectrum| spectrum.get(name) != spectra[0].get(name));
        Varied { hurst: varies(HURST.name), nodes: varies(NODES.name) }
    }

    /// Returns the name of a spectrum: `k_lower 4, k_upper 32`, followed by the roll-off of a
    /// plateau and the other parameters that vary.
    pub fn name(&self, spectrum: &ParameterPoint) -> String {
        let mut name = spectrum.clone().only(&[K_LOWER.name, K_UPPER.name]).to_string();
        let rolloff = spectrum.get(K_ROLLOFF.name);
        let plateau = rolloff.filter(|rolloff| spectrum.get(K_LOWER.name) != Some(*rolloff));
        if let Some(rolloff) = plateau {
            name += &format!(", k_rolloff {rolloff}");
        }
        if let Some(hurst) = spectrum.get(HURST.name).filter(|_| self.hurst) {
            name += &format!(", H {hurst}");
        }
        if let Some(nodes) = spectrum.get(NODES.name).filter(|_| self.nodes) {
            name += &format!(", {nodes} nodes");
        }
        name
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_with_a_ratio_of_one_are_isotropic() {
        let surface = |grain: Option<[f64; 2]>| {
            let mut columns = vec![(HURST, Value::Real(0.8))];
            let grain = grain.map(|grain| grain.map(Value::Real)).into_iter();
            columns.extend(
                grain.flat_map(|grain| [ANISOTROPY_RATIO, ANISOTROPY_ANGLE].into_iter().zip(grain)),
            );
            Table::row(&columns)
        };
        let tables = [None, Some([1.0, 0.0]), Some([6.0, 0.0])].map(surface);
        let setting = Setting::most_frequent(&tables);
        assert_eq!(tables.each_ref().map(|table| setting.rows(table).rows()), [1, 1, 0]);
        let [left_out] = &setting.left_out[..] else { panic!("{:?}", setting.left_out) };
        assert_eq!(left_out.rows, 1);
    }
}
