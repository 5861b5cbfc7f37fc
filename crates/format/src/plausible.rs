//! Possible and likely values of a quantity, by its unit. An unlikely value gives a warning. An impossible
//! value of a property that has to be positive is a mistake.

use std::ops::RangeInclusive;

/// Likely and possible values in a unit.
pub(crate) struct Quantity {
    unit: &'static str,
    /// Values that tissue, tools and scenes have.
    likely: RangeInclusive<f64>,
    /// Values that can be computed with.
    possible: RangeInclusive<f64>,
    /// Factors from other units.
    units: &'static str,
}

/// Sizes of values. Positions are not checked: a box may well reach to 1e9 m.
const QUANTITIES: [Quantity; 9] = [
    Quantity {
        unit: "Pa",
        likely: 1e-2..=1e13,
        possible: 1e-20..=1e20,
        units: "1 kPa is 1e3 Pa, 1 MPa is 1e6 Pa",
    },
    Quantity { unit: "kg/m³", likely: 0.1..=1e5, possible: 1e-15..=1e15, units: "1 g/cm³ is 1000 kg/m³" },
    Quantity { unit: "m", likely: 1e-7..=1e3, possible: 1e-20..=1e12, units: "1 mm is 0.001 m" },
    Quantity { unit: "s", likely: 1e-9..=1e7, possible: 1e-20..=1e15, units: "1 ms is 0.001 s" },
    Quantity { unit: "N", likely: 1e-9..=1e9, possible: 1e-20..=1e20, units: "1 kN is 1000 N" },
    Quantity { unit: "m/s", likely: 1e-9..=1e4, possible: 1e-20..=1e9, units: "1 mm/s is 0.001 m/s" },
    Quantity { unit: "m/s²", likely: 1e-9..=1e7, possible: 1e-20..=1e12, units: "gravity is 9.81 m/s²" },
    Quantity {
        unit: "1",
        likely: 1e-9..=1e3,
        possible: 1e-20..=1e20,
        units: "tissue on steel or tissue has about 0.05 to 0.5",
    },
    Quantity { unit: "1/s", likely: 1e-9..=1e7, possible: 1e-20..=1e15, units: "1/ms is 1000 1/s" },
];

/// Remark about a value.
pub(crate) struct Remark {
    pub is_mistake: bool,
    /// Text that follows the name of the value.
    pub message: String,
    pub label: &'static str,
    pub help: String,
}

/// Returns a remark about a value in a unit; `None` if it is likely. A value that need not be `positive`,
/// such as a load, may be arbitrarily small, and an impossible size of it is no mistake.
pub(crate) fn remark(value: f64, unit: &str, positive: bool, shown: &str) -> Option<Remark> {
    let quantity = QUANTITIES.iter().find(|quantity| quantity.unit == unit)?;
    let outside = |range: &RangeInclusive<f64>| {
        let size = value.abs();
        size > *range.end() || (positive && size < *range.start())
    };
    let help = match unit {
        "1" => quantity.units.to_owned(),
        _ => format!("values are in SI units: {}", quantity.units),
    };
    let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
    let range = |range: &RangeInclusive<f64>| format!("{:e} to {:e}{unit}", range.start(), range.end());
    if positive && outside(&quantity.possible) {
        let message =
            format!("is {shown}{unit}; values from {} can be computed with", range(&quantity.possible));
        return Some(Remark { is_mistake: true, message, label: "beyond all sense", help });
    }
    outside(&quantity.likely).then(|| {
        let usual = match positive {
            true => format!("usual are {}", range(&quantity.likely)),
            false => format!("usual is less than {:e}{unit}", quantity.likely.end()),
        };
        let message = format!("is {shown}{unit}, and {usual}: is that so?");
        Remark { is_mistake: false, message, label: "unusual", help }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_without_a_unit_are_told_without_one() {
        let of = |friction| remark(friction, "1", false, "5000");
        let Some(Remark { is_mistake, message, .. }) = of(5000.0) else {
            panic!("5000 is no usual friction")
        };
        assert!(!is_mistake && message == "is 5000, and usual is less than 1e3: is that so?", "{message}");
        assert!(of(0.0).is_none() && of(2.0).is_none());
    }
}
