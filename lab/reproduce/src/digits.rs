//! Numbers of reports, with as many digits as they deserve.

use crate::case::Row;

/// A reference as it was given.
pub(crate) fn reference(row: &Row) -> String {
    shown(row.reference, 7)
}

/// A tolerance, to three digits.
pub(crate) fn tolerance(row: &Row) -> String {
    shown(row.tolerance, 3)
}

fn shown(value: Option<f64>, digits: usize) -> String {
    let Some(value) = value else { return "–".to_owned() };
    let text = significant(value, digits);
    if text.contains('.') && !text.contains('e') {
        return text.trim_end_matches('0').trim_end_matches('.').to_owned();
    }
    text
}

/// A number with a count of significant digits, but whole up to a million; beyond, and below a thousandth,
/// with an exponent.
pub(crate) fn significant(value: f64, digits: usize) -> String {
    if value == 0.0 || !value.is_finite() {
        return value.to_string();
    }
    let rounded: f64 = format!("{value:.*e}", digits - 1).parse().unwrap_or(value);
    if (1e-3..1e6).contains(&rounded.abs()) {
        let decimals = digits as i32 - 1 - rounded.abs().log10().floor() as i32;
        format!("{value:.*}", decimals.max(0) as usize)
    } else {
        format!("{rounded:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_the_digits_they_deserve() {
        let four = [8.8109, 0.0234, 123456.7, 2.4276e-5, -34.85, 9.99996].map(|x| significant(x, 4));
        assert_eq!(four, ["8.811", "0.02340", "123457", "2.428e-5", "-34.85", "10.00"]);
        let given = [8.75, 0.1, 1e-9, 30.0, 2.12].map(|x| shown(Some(x), 7));
        assert_eq!(given, ["8.75", "0.1", "1e-9", "30", "2.12"]);
        assert_eq!(shown(Some(5.272704), 3), "5.27");
    }
}
