//! The looks at a campaign that ends when decided. They come after fixed numbers of trials, so that neither the number of
//! threads nor an interruption has a part in what is seen.
//!
//! An interval of such a campaign contains the truth at all looks together, with its confidence. So does what all looks
//! have left of it, the intersection of their intervals. The verdicts go by that one: what is decided at a look stays
//! decided, also if more trials are run because something else is still open.

use crate::campaign::ask::spec::LOOK_TRIALS;
use crate::stats::sequential::next_look;

/// The numbers of trials at which a campaign of so many `trials` was looked at; the last one is `trials`.
pub fn looks(trials: u64) -> Vec<u64> {
    let mut looks = vec![next_look(0, LOOK_TRIALS, trials)];
    while let Some(&last) = looks.last().filter(|last| **last < trials) {
        looks.push(next_look(last, LOOK_TRIALS, trials));
    }
    looks
}

/// The intersection of the intervals of all looks, in their order. An interval that has nothing in common with those
/// before it is passed over: one of them misses the truth, and which one cannot be known.
pub fn narrowed(intervals: impl IntoIterator<Item = [f64; 2]>) -> [f64; 2] {
    intervals.into_iter().fold([f64::NEG_INFINITY, f64::INFINITY], |[low, high], [least, most]| {
        let common = [low.max(least), high.min(most)];
        if common[0] <= common[1] { common } else { [low, high] }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn looks_are_at_the_same_trials_however_long_a_campaign_is() {
        assert_eq!(looks(0), [0]);
        assert_eq!(looks(30), [25, 30]);
        assert_eq!(looks(225), [25, 50, 75, 100, 125, 175, 225]);
        assert_eq!(looks(1000)[..7], looks(225));
    }

    #[test]
    fn what_a_look_has_left_out_stays_out() {
        assert_eq!(narrowed([[-0.2, 0.4], [0.1, 0.5], [-0.1, 0.3]]), [0.1, 0.3]);
        assert_eq!(narrowed([[0.1, 0.5], [-0.2, 0.0], [0.2, 0.6]]), [0.2, 0.5]);
    }
}
