//! The pressure that a material bears before it yields.

use thiserror::Error;

/// A bound to the pressure, in units of E* × rms slope like all pressures of a solver: positive and
/// finite.
///
/// ```
/// use asperity_contact::solver::{Hardness, HardnessError};
///
/// // Steel of 2 GPa, E* = 230 GPa, on a surface of rms slope 0.2.
/// let hardness = Hardness::new(2e9 / (230e9 * 0.2))?;
/// assert!(hardness.bear(0.01).is_ok());
/// assert_eq!(
///     hardness.bear(0.06),
///     Err(HardnessError::Overloaded { load: 0.06, hardness: hardness.pressure() })
/// );
/// assert!(Hardness::new(0.0).is_err());
/// # Ok::<(), HardnessError>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct Hardness(f64);

/// Why a hardness is none, or does not bear a load.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[non_exhaustive]
pub enum HardnessError {
    /// Not a positive, finite number.
    #[error("a hardness is positive and finite, not {0}")]
    NotPositive(f64),
    /// Beyond what the material bears.
    #[error(
        "a mean pressure of {load} takes a hardness above it, and this one is {hardness}: \
         saturated all over, the surface bears no more"
    )]
    Overloaded {
        /// The mean pressure,
        load: f64,
        /// and the hardness, in the same unit.
        hardness: f64,
    },
}

impl Hardness {
    /// A hardness in units of E* × rms slope.
    pub fn new(pressure: f64) -> Result<Self, HardnessError> {
        if pressure.is_finite() && pressure > 0.0 {
            Ok(Self(pressure))
        } else {
            Err(HardnessError::NotPositive(pressure))
        }
    }

    /// In units of E* × rms slope.
    pub fn pressure(self) -> f64 {
        self.0
    }

    /// Whether a mean pressure `load`, in the same units, can be borne: one below the hardness.
    pub fn bear(self, load: f64) -> Result<(), HardnessError> {
        if load < self.0 {
            Ok(())
        } else {
            let hardness = self.0;
            Err(HardnessError::Overloaded { load, hardness })
        }
    }
}
