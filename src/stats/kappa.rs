//! How far two yes-or-no findings on the same trials agree: Cohen's kappa (1960, "A coefficient of agreement for
//! nominal scales").

use crate::mcnemar::PairedCounts;

/// Of a share `p` of trials on which both agree, and a share `c` on which they would agree if each kept its own rate but
/// knew nothing of the other, kappa is `(p - c) / (1 - c)`: 1 if they always agree, 0 if no more often than by chance.
/// It is None if every trial has the same outcome in both, and always the same one: then chance would agree as often.
pub fn kappa(counts: &PairedCounts) -> Option<f64> {
    let PairedCounts {
        both,
        only_a,
        only_b,
        neither,
    } = *counts;
    let share = |part: u64| part as f64 / counts.trials().max(1) as f64;
    let (a, b) = (share(both + only_a), share(both + only_b));
    let by_chance = a * b + (1.0 - a) * (1.0 - b);
    (counts.trials() > 0 && by_chance < 1.0)
        .then(|| (share(both + neither) - by_chance) / (1.0 - by_chance))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kappa_is_what_is_agreed_beyond_chance() {
        for (both, only_a, only_b, neither, expected) in [
            // The usual example: 35 of 50 agree, by chance half of them would, so kappa is 0.2 / 0.5.
            (20, 5, 10, 15, Some(0.4)),
            // By chance 54 of 100 would agree: 0.6 * 0.7 + 0.4 * 0.3.
            (45, 15, 25, 15, Some(0.06 / 0.46)),
            (25, 25, 25, 25, Some(0.0)),
            (0, 10, 10, 0, Some(-1.0)),
            (60, 0, 0, 40, Some(1.0)),
            (100, 0, 0, 0, None),
            (0, 0, 0, 9, None),
            (0, 0, 0, 0, None),
        ] {
            let found = kappa(&PairedCounts {
                both,
                only_a,
                only_b,
                neither,
            });
            assert_eq!(found.is_some(), expected.is_some());
            let error = found.unwrap_or_default() - expected.unwrap_or_default();
            assert!(error.abs() < 1e-12, "{found:?}");
        }
    }
}
