//! Lengths, pressures, forces and energies, each a number with its unit.

use std::fmt;

/// Declares a quantity: a number in its SI unit, and constructors and accessors for its units. A
/// unit is `$factor / $divisor` SI units; one of both is 1, so that `micrometres(100.0)` is exactly
/// `metres(1e-4)`.
macro_rules! quantity {
    ($(#[$doc:meta])* $name:ident $symbol:literal { $($new:ident $get:ident $unit:literal $factor:literal / $divisor:literal;)* }) => {
        $(#[$doc])*
        #[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
        pub struct $name(f64);

        impl $name {
            $(
                #[doc = concat!("Creates the quantity from a number of ", $unit, ".")]
                pub fn $new(number: f64) -> Self {
                    Self(number * $factor / $divisor)
                }

                #[doc = concat!("Returns the number of ", $unit, ".")]
                pub fn $get(self) -> f64 {
                    self.0 * $divisor / $factor
                }
            )*
        }

        impl fmt::Display for $name {
            fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(formatter, "{:e} {}", self.0, $symbol)
            }
        }
    };
}

quantity! {
    /// Length: a side, a height or a gap.
    ///
    /// ```
    /// use asperity_contact::Length;
    ///
    /// assert_eq!(Length::micrometres(100.0), Length::metres(1e-4));
    /// assert_eq!(Length::metres(2e-9).in_nanometres(), 2.0);
    /// assert_eq!(Length::millimetres(2.5).to_string(), "2.5e-3 m");
    /// ```
    Length "m" {
        metres in_metres "metres" 1.0 / 1.0;
        millimetres in_millimetres "millimetres" 1.0 / 1e3;
        micrometres in_micrometres "micrometres" 1.0 / 1e6;
        nanometres in_nanometres "nanometres" 1.0 / 1e9;
    }
}

quantity! {
    /// Pressure or elastic modulus; negative under tension.
    Pressure "Pa" {
        pascals in_pascals "pascals" 1.0 / 1.0;
        kilopascals in_kilopascals "kilopascals" 1e3 / 1.0;
        megapascals in_megapascals "megapascals" 1e6 / 1.0;
        gigapascals in_gigapascals "gigapascals" 1e9 / 1.0;
    }
}

quantity! {
    /// Force on the nominal area of a surface.
    Force "N" {
        newtons in_newtons "newtons" 1.0 / 1.0;
        millinewtons in_millinewtons "millinewtons" 1.0 / 1e3;
    }
}

quantity! {
    /// Energy per area, such as a work of adhesion.
    EnergyPerArea "J/m²" {
        joules_per_square_metre in_joules_per_square_metre "joules per square metre" 1.0 / 1.0;
        millijoules_per_square_metre in_millijoules_per_square_metre
            "millijoules per square metre" 1.0 / 1e3;
    }
}

/// Pressure in units of E* h′, with the effective modulus E* and the rms slope h′ of the surface.
///
/// As a load p₀/(E* h′) it alone decides the contact area of an elastic material.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
pub struct ReducedPressure(f64);

impl ReducedPressure {
    /// Creates the pressure from a number of E* h′.
    pub fn new(number: f64) -> Self {
        Self(number)
    }

    /// Returns the number of E* h′.
    pub fn value(self) -> f64 {
        self.0
    }
}

impl fmt::Display for ReducedPressure {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{} E* × rms slope", self.0)
    }
}
