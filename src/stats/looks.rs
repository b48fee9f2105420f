//! The looks at a campaign that may end when it is decided: after how many trials they come, and how much of the error
//! that the test of a pair may make ([`sign_test`](crate::sign_test)) is spent by each.
//!
//! The count of trials that is planned first fixes both. Up to it the error is spent in proportion to the 3/4th power
//! of the trials, 90 % in all. A campaign that is still open then may be given more trials: looks further on share the
//! rest, so that the whole is never passed, however long it goes on. Nothing that happens in the campaign moves a look,
//! nor does a change of its greatest count of trials: a look at a moment that somebody chose by what he saw would void
//! the test.

/// Number of trials between the first looks. All looks before the planned number are at multiples of it.
pub const LOOK_TRIALS: u64 = 25;
/// Share of the error that is spent at the planned number of trials. Up to there it grows with the 3/4th power of the
/// trials. If it grew in proportion, 1 to 9 % more trials were needed (differences of 3 to 27 points, 200 to 4000
/// planned trials). If it grew with the square root, 0 to 6 % fewer were needed, but a difference that takes nearly all
/// trials would be found in up to 3 % fewer campaigns.
const SPENT_AS_PLANNED: f64 = 0.9;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Looks {
    planned: u64,
}

impl Looks {
    /// The looks of a campaign for which `planned` trials were planned first, at least one.
    pub fn up_to(planned: u64) -> Self {
        Self {
            planned: planned.max(1),
        }
    }

    /// Number of trials at the first look after `trials`: about a quarter more, at least [`LOOK_TRIALS`] more, and a
    /// multiple of [`LOOK_TRIALS`]. The planned number is a look, too.
    pub fn after(self, trials: u64) -> u64 {
        let next = (trials + (trials / 4).max(LOOK_TRIALS)).next_multiple_of(LOOK_TRIALS);
        if trials < self.planned {
            next.min(self.planned)
        } else {
            next
        }
    }

    /// The looks up to `trials` trials, in order.
    pub fn until(self, trials: u64) -> impl Iterator<Item = u64> {
        std::iter::successors(Some(self.after(0)), move |look| Some(self.after(*look)))
            .take_while(move |look| *look <= trials)
    }

    /// Share of the error that may be spent at all looks together up to the look after `trials` trials.
    pub fn spent(self, trials: u64) -> f64 {
        let of_planned = trials as f64 / self.planned as f64;
        match of_planned <= 1.0 {
            true => SPENT_AS_PLANNED * (of_planned * of_planned.sqrt()).sqrt(),
            false => 1.0 - (1.0 - SPENT_AS_PLANNED) / of_planned,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn up_to(looks: Looks, most: u64) -> Vec<u64> {
        std::iter::once(0).chain(looks.until(most)).collect()
    }

    #[test]
    fn looks_are_a_quarter_apart_and_the_planned_count_is_one() {
        let found = up_to(Looks::up_to(1010), 2000);
        assert_eq!(
            found,
            [
                0, 25, 50, 75, 100, 125, 175, 225, 300, 375, 475, 600, 750, 950, 1010, 1275, 1600,
                2000
            ]
        );
        assert_eq!(up_to(Looks::up_to(30), 100), [0, 25, 30, 55 + 20, 100]);
    }

    #[test]
    fn nine_tenths_of_the_error_are_spent_as_planned_and_never_all_of_it() {
        let looks = Looks::up_to(1600);
        assert_eq!(
            [0, 100, 1600, 3200].map(|trials| looks.spent(trials)),
            [0.0, 0.1125, 0.9, 0.95]
        );
        let spent: Vec<f64> = up_to(looks, 1_000_000_000)
            .into_iter()
            .map(|trials| looks.spent(trials))
            .collect();
        assert!(
            spent.is_sorted() && spent.last().is_some_and(|&last| last < 1.0),
            "{spent:?}"
        );
    }
}
