//! A number of a controller that a search may change, and its range.

use serde::{Deserialize, Serialize};

/// A number of a controller that a search may change, and the range of its search. If the key is that of a list, the
/// number is a factor by which all numbers of the list are multiplied.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Tunable {
    /// The dotted key, as for [variants](super::variant).
    pub key: String,
    /// The present value.
    pub now: f64,
    pub range: [f64; 2],
}

/// Ratio of the ends of a range from which on the range is searched on a logarithmic scale.
const BY_RATIOS: f64 = 3.0;
/// Significant digits of the values that a search tries, so that a file can state exactly these values.
const DIGITS: i32 = 4;

impl Tunable {
    pub fn new(key: impl Into<String>, now: f64, range: [f64; 2]) -> Self {
        Self {
            key: key.into(),
            now,
            range,
        }
    }

    /// The reason, in words, why a range cannot be searched. It is None if the range can.
    pub fn problem(range: [f64; 2]) -> Option<&'static str> {
        let [from, to] = range;
        if !(from.is_finite() && to.is_finite()) {
            return Some("its ends are no finite numbers");
        }
        // Shares of the range are computed from the difference or the ratio of its ends, which must be finite.
        let is_too_wide = !(to - from).is_finite() || (from > 0.0 && !(to / from).is_finite());
        match from < to {
            false => Some("its range has no extent"),
            true => is_too_wide.then_some("its range is too wide"),
        }
    }

    fn is_by_ratios(&self) -> bool {
        self.range[0] > 0.0 && self.range[1] >= BY_RATIOS * self.range[0]
    }

    /// The value at a share of the range (0 to 1), rounded by [`rounded`].
    pub fn at(&self, share: f64) -> f64 {
        let [from, to] = self.range;
        let value = if self.is_by_ratios() {
            from * (to / from).powf(share)
        } else {
            from + (to - from) * share
        };
        rounded(value.clamp(from, to), to - from)
    }

    /// The share of the range at which a value lies, clamped to 0 to 1.
    pub fn share_of(&self, value: f64) -> f64 {
        let [from, to] = self.range;
        let share = match self.is_by_ratios() {
            true => (value.max(f64::MIN_POSITIVE) / from).ln() / (to / from).ln(),
            false => (value - from) / (to - from),
        };
        share.clamp(0.0, 1.0)
    }
}

/// Rounds a value to four significant digits. A value smaller than a hundredth of its range gets no more decimals than
/// a hundredth of the range would have.
pub fn rounded(value: f64, range: f64) -> f64 {
    let size = value.abs().max(1e-2 * range);
    if size == 0.0 || !size.is_finite() {
        return value;
    }
    let decimals = (DIGITS - 1 - size.log10().floor() as i32).clamp(0, 300) as usize;
    // The value goes through text, so that it equals the number that the file will state.
    format!("{value:.decimals$}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_is_refused_that_has_no_shares() {
        let (none, endless, wide) = ("has no extent", "no finite numbers", "too wide");
        for (range, expected) in [
            ([2.0, 2.0], none),
            ([2.0, 1.0], none),
            ([f64::NAN, 1.0], endless),
            ([1.0, f64::NAN], endless),
            ([f64::INFINITY, f64::INFINITY], endless),
            ([0.0, f64::INFINITY], endless),
            ([-1e308, 1e308], wide),
            ([1e-300, 1e300], wide),
        ] {
            assert!(
                Tunable::problem(range).is_some_and(|problem| problem.contains(expected)),
                "{range:?}"
            );
        }
        assert!(
            [[0.0, 1.0], [-1.0, 1.0], [1e-9, 1e9]]
                .into_iter()
                .all(|range| Tunable::problem(range).is_none())
        );
    }

    #[test]
    fn a_share_of_a_range_is_a_value_that_can_be_written_down() {
        let even = Tunable::new("k", 0.0, [-1.0, 1.0]);
        assert_eq!(
            [0.0, 0.5, 0.12345, 1.0].map(|share| even.at(share)),
            [-1.0, 0.0, -0.7531, 1.0]
        );
        let by_ratios = Tunable::new("k", 1.0, [0.1, 10.0]);
        assert_eq!(
            [0.0, 0.25, 0.5, 1.0].map(|share| by_ratios.at(share)),
            [0.1, 0.3162, 1.0, 10.0]
        );
        for tunable in [even, by_ratios] {
            for share in [0.0, 0.2, 0.7, 1.0] {
                let value = tunable.at(share);
                assert!((tunable.share_of(value) - share).abs() < 1e-3);
                assert_eq!(tunable.at(tunable.share_of(value)), value);
            }
            assert_eq!(tunable.share_of(-5.0), 0.0);
        }
    }
}
