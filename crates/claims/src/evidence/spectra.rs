//! Spectra on meshes, as tables have them.

use arrow::array::Array;

use asperity_contact::topography::spectrum;
use asperity_stages::columns::*;
use asperity_stages::grids::Meshes;
use asperity_tables::table::{Table, TableError};

/// A spectrum on a mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectrum {
    /// Hurst exponent.
    pub hurst: f64,
    /// Lower cutoff.
    pub k_lower: i64,
    /// End of the plateau.
    pub k_rolloff: i64,
    /// Upper cutoff.
    pub k_upper: i64,
    /// Nodes per side.
    pub nodes: i64,
}

impl Spectrum {
    /// Whether it has no plateau.
    pub fn is_plain(&self) -> bool {
        self.k_lower == self.k_rolloff
    }

    /// Whether the paper's words are about such spectra.
    pub fn is_of_the_paper(&self) -> bool {
        self.hurst == 0.8 && self.is_plain()
    }

    /// Nayak's parameter α over the modes of the cell.
    pub fn nayak(&self) -> Option<f64> {
        let whole = |k: i64| u32::try_from(k).ok();
        let spectrum = spectrum::Spectrum {
            hurst: self.hurst,
            k_lower: whole(self.k_lower)?,
            k_rolloff: whole(self.k_rolloff)?,
            k_upper: whole(self.k_upper)?,
            anisotropy: None,
        };
        spectrum.nayak_on_a_square()
    }
}

/// The columns of a table's spectra; none of surfaces that were not drawn from one.
pub fn spectrum(table: &Table, row: usize) -> Result<Option<Spectrum>, TableError> {
    if !table.has(HURST.name) || table.reals(HURST.name)?.is_null(row) {
        return Ok(None);
    }
    let whole = |name: &str| Ok::<_, TableError>(table.integers(name)?.value(row));
    // The paper has no rectangles.
    let Some(nodes) = Meshes::of(table)?.of_square(row) else {
        return Ok(None);
    };
    Ok(Some(Spectrum {
        hurst: table.reals(HURST.name)?.value(row),
        k_lower: whole(K_LOWER.name)?,
        k_rolloff: whole(K_ROLLOFF.name)?,
        k_upper: whole(K_UPPER.name)?,
        nodes,
    }))
}

/// What tells spectra from each other.
pub fn key(spectrum: &Spectrum) -> (u64, i64, i64, i64, i64) {
    let Spectrum { hurst, k_lower, k_rolloff, k_upper, nodes } = *spectrum;
    (hurst.to_bits(), k_lower, k_rolloff, k_upper, nodes)
}

/// What tells spectra from each other, besides their cutoffs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Varied {
    hurst: bool,
    nodes: bool,
}

impl Varied {
    /// What differs among some spectra.
    pub fn among<'a>(spectra: impl Iterator<Item = &'a Spectrum> + Clone) -> Varied {
        let first = spectra.clone().next();
        let differs = |differ: fn(&Spectrum, &Spectrum) -> bool| {
            let mut spectra = spectra.clone();
            first.is_some_and(|first| spectra.any(|other| differ(first, other)))
        };
        Varied {
            hurst: differs(|one, other| one.hurst != other.hurst),
            nodes: differs(|one, other| one.nodes != other.nodes),
        }
    }

    /// A spectrum among others: `k_lower 4, k_upper 32`, and what else varies.
    pub fn name(&self, spectrum: &Spectrum) -> String {
        let mut name = format!("k_lower {}, k_upper {}", spectrum.k_lower, spectrum.k_upper);
        if !spectrum.is_plain() {
            name += &format!(", k_rolloff {}", spectrum.k_rolloff);
        }
        if self.hurst {
            name += &format!(", H {}", spectrum.hurst);
        }
        if self.nodes {
            name += &format!(", {} nodes", spectrum.nodes);
        }
        name
    }
}
