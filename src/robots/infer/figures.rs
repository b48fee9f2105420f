//! Rounding of figures that are written for people.

/// `value` with this many significant digits.
pub fn rounded(value: f64, digits: i32) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return value;
    }
    let decimals = digits - 1 - value.abs().log10().floor() as i32;
    to_decimals(value, decimals)
}

/// `value` with this many decimals.
pub fn to_decimals(value: f64, decimals: i32) -> f64 {
    // The shortest text of a rounded number belongs to the float nearest to the quotient, not to the product.
    if decimals >= 0 {
        let unit = 10_f64.powi(decimals);
        (value * unit).round() / unit
    } else {
        let unit = 10_f64.powi(-decimals);
        (value / unit).round() * unit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_short_as_they_are_read() {
        for (value, digits, text) in [
            (80.183, 3, "80.2"),
            (0.000512, 2, "0.00051"),
            (1716.4, 3, "1720"),
            (-0.25799, 3, "-0.258"),
            (0.0, 3, "0"),
        ] {
            assert_eq!(rounded(value, digits).to_string(), text);
        }
        assert_eq!(to_decimals(0.2579654321, 6).to_string(), "0.257965");
    }
}
