//! Conversion between the pressures of a contact and the reduced pressures of the solver.

use asperity_mechanics::reduced::{Units, nearest};

use crate::{Force, Pressure, ReducedPressure};

/// Type of the pressures of a contact: [`Pressure`] or [`ReducedPressure`].
pub trait ContactPressure: sealed::OfContact {}

impl ContactPressure for Pressure {}
impl ContactPressure for ReducedPressure {}

/// Load of a contact whose pressures are `P`.
///
/// A contact in pascals is pressed by a mean [`Pressure`], by a [`Force`] on its nominal area, or
/// by a [`ReducedPressure`]; a reduced contact by a [`ReducedPressure`] alone.
#[diagnostic::on_unimplemented(
    message = "`{Self}` is no load of a contact whose pressures are `{P}`",
    note = "a contact of `Material::reduced()` takes `ReducedPressure::new(0.05)`; for pascals and newtons \
            give the material a modulus with `Material::elastic`"
)]
pub trait LoadOf<P>: sealed::Resolve<P> {}

impl LoadOf<Pressure> for Pressure {}
impl LoadOf<Pressure> for Force {}
impl LoadOf<Pressure> for ReducedPressure {}
impl LoadOf<ReducedPressure> for ReducedPressure {}

/// Units of pressure and of force of a contact.
#[derive(Debug, Clone, Copy)]
pub struct Scale {
    pub units: Units,
    /// Nominal area in square metres.
    pub area: f64,
}

pub mod sealed {
    use super::*;

    pub trait OfContact: Copy + std::fmt::Debug + Send + Sync + 'static {
        /// Converts a reduced pressure.
        fn of(reduced: f64, scale: &Scale) -> Self;

        /// Converts a reduced load, rounded to twelve digits as in studies.
        fn of_load(reduced: f64, scale: &Scale) -> Self;

        /// Returns the number without its unit.
        fn number(self) -> f64;

        /// Returns the pressure in units of E* h′.
        fn reduced(self, scale: &Scale) -> f64;
    }

    impl OfContact for Pressure {
        fn of(reduced: f64, scale: &Scale) -> Self {
            Pressure::pascals(reduced * scale.units.pressure())
        }

        fn of_load(reduced: f64, scale: &Scale) -> Self {
            Pressure::pascals(scale.units.mean_pressure(reduced))
        }

        fn number(self) -> f64 {
            self.in_pascals()
        }

        fn reduced(self, scale: &Scale) -> f64 {
            scale.units.reduced_pressure(self.in_pascals())
        }
    }

    impl OfContact for ReducedPressure {
        fn of(reduced: f64, _: &Scale) -> Self {
            ReducedPressure::new(reduced)
        }

        fn of_load(reduced: f64, _: &Scale) -> Self {
            ReducedPressure::new(reduced)
        }

        fn number(self) -> f64 {
            self.value()
        }

        fn reduced(self, _: &Scale) -> f64 {
            self.value()
        }
    }

    pub trait Resolve<P> {
        /// Returns the load in units of E* h′, and the mean pressure.
        fn resolve(self, scale: &Scale) -> (f64, P);
    }

    impl Resolve<Pressure> for Pressure {
        fn resolve(self, scale: &Scale) -> (f64, Pressure) {
            (self.reduced(scale), self)
        }
    }

    impl Resolve<Pressure> for Force {
        fn resolve(self, scale: &Scale) -> (f64, Pressure) {
            Pressure::pascals(nearest(self.in_newtons() / nearest(scale.area))).resolve(scale)
        }
    }

    impl<P: OfContact> Resolve<P> for ReducedPressure {
        fn resolve(self, scale: &Scale) -> (f64, P) {
            (self.value(), P::of_load(self.value(), scale))
        }
    }
}
