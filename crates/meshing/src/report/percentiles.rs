//! Distribution of a quantity over an area.

use serde::Serialize;

/// Least, 5 %, half, 95 % and largest of a quantity, and its mean, by weight.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Percentiles {
    /// The least value.
    pub least: f64,
    /// 5 % of the weight is at or below this.
    pub p5: f64,
    /// Half of the weight is at or below this.
    pub median: f64,
    /// 95 % of the weight is at or below this.
    pub p95: f64,
    /// The largest value.
    pub most: f64,
    /// The mean.
    pub mean: f64,
}

impl Percentiles {
    /// Returns the percentiles of values with weights; `None` without any weight.
    pub fn weighted(mut values: Vec<(f64, f64)>) -> Option<Self> {
        values.retain(|(value, weight)| value.is_finite() && *weight > 0.0);
        values.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let total: f64 = values.iter().map(|(_, weight)| weight).sum();
        let (least, most) = (values.first()?.0, values.last()?.0);
        let at = |part: f64| {
            let mut sum = 0.0;
            let reached = values.iter().find(|(_, weight)| {
                sum += weight;
                sum >= part * total
            });
            reached.map_or(most, |(value, _)| *value)
        };
        let mean = values.iter().map(|(value, weight)| value * weight).sum::<f64>() / total;
        Some(Self { least, p5: at(0.05), median: at(0.5), p95: at(0.95), most, mean })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn weights_count() {
        let found = Percentiles::weighted(vec![(3.0, 1.0), (1.0, 8.0), (2.0, 1.0), (9.0, 0.0)]).unwrap();
        assert_eq!((found.least, found.p5, found.median, found.p95, found.most), (1.0, 1.0, 1.0, 3.0, 3.0));
        assert_eq!(found.mean, 1.3);
        assert_eq!(Percentiles::weighted(vec![(f64::NAN, 1.0)]), None);
    }
}
