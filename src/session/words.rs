//! Formatting of numbers and lists for users.

pub use asperity_manifest::diagnostics::{chain, counted, listed, wrapped};
pub use asperity_tables::cells::{cells, whole_cells};

/// Formats a number with six significant digits, without trailing zeros.
pub fn short(number: f64) -> String {
    let magnitude = number.abs();
    if number == 0.0 || (1e-4..1e6).contains(&magnitude) {
        let digits = (5 - magnitude.max(1e-300).log10().floor() as i32).clamp(0, 9) as usize;
        let text = format!("{number:.*}", if number == 0.0 { 0 } else { digits });
        if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').to_owned()
        } else {
            text
        }
    } else {
        format!("{number:.5e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_shown_with_six_digits_and_no_tail() {
        let shown = [0.0, 0.5, 1234.0, 0.123456789, 1.5e-7, 2.5e9].map(short);
        assert_eq!(shown, ["0", "0.5", "1234", "0.123457", "1.50000e-7", "2.50000e9"]);
    }
}
