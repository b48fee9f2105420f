//! Whether trials have shown what a gate asks for.
//!
//! A gate has three answers. It passes if the whole interval of what was observed lies at or above what is required,
//! fails if the whole interval lies below, and is unresolved else: more trials may tell. To hold the observed value itself
//! against the requirement raises alarms by chance: between two results of 1000 trials, of a set that recovers in 97 %
//! in both, "half a point lower" is seen in every fourth. At a confidence of 95 % at most 2.5 % of campaigns pass wrongly,
//! and at most 2.5 % fail wrongly: of a rate never more, of a difference about: its interval is approximate. It errs in up
//! to 5.6 % on the side away from zero where next to all trials that differ are of one kind and these are few (see
//! [`mcnemar`](crate::stats::mcnemar)): `catch >= baseline - 0.01` with a true loss of one point and no gains, 400 trials,
//! fails in 5.3 %. Intervals that hold at every look err in 5 % at most, on both sides together.

use crate::campaign::ask::gate::{Gate, OnUnresolved};
use crate::stats::mcnemar::PairedCounts;
use crate::stats::rate::clopper_pearson;
use crate::stats::sequential;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

/// Standard normal at 80 %: the chance that `more_trials` resolve.
const Z80: f64 = 0.841_621_233_572_914_3;
/// An interval that holds at every look is wider, at the same confidence, than one for a fixed number of trials: about
/// so much (1000 to 10,000 trials at 95 %).
const WIDER: f64 = 1.7;
/// Distances to a requirement below this are of rounding.
const ROUNDING: f64 = 1e-9;

/// What was seen of a rate, or of a difference of two on the same trials (shares).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    pub observed: f64,
    pub interval: [f64; 2],
    pub trials: u64,
    /// Whether the interval holds at every look, as one of [`sequential`] does, or for a fixed number of trials only.
    pub sequential: bool,
}

impl Evidence {
    /// Of a rate, with an interval of this `confidence` (a share): for a fixed number of trials that of Clopper and
    /// Pearson, which errs at most as often as it says.
    pub fn rate(recovered: u64, trials: u64, confidence: f64, sequential: bool) -> Self {
        let interval = if sequential { sequential::rate_interval } else { clopper_pearson };
        let observed = recovered as f64 / trials.max(1) as f64;
        Self { observed, interval: interval(recovered, trials, confidence), trials, sequential }
    }

    /// Of the difference of two rates, with an interval of this `confidence` (a share).
    pub fn difference(counts: &PairedCounts, confidence: f64, sequential: bool) -> Self {
        let interval = counts.interval(confidence, sequential);
        Self { observed: counts.difference(), interval, trials: counts.trials(), sequential }
    }

    /// The answer to a gate, of which this is the rate, or the difference (rate of the set less that of what it is held
    /// against); the interval is of this `confidence` (a share), two-sided.
    pub fn answer(&self, gate: &Gate, confidence: f64) -> GateAnswer {
        let &Self { observed, interval: [least, most], trials, sequential } = self;
        let status = match gate.offset {
            required if least >= required => Status::Passed,
            required if most < required => Status::Failed,
            _ => Status::Unresolved,
        };
        // A campaign with a fixed count of trials cannot be taken up again: a new one has to have them all.
        let again = if sequential { 0 } else { trials };
        let more_trials = self.more_trials(gate.offset, confidence).filter(|_| status == Status::Unresolved);
        GateAnswer {
            name: gate.text.clone(),
            status,
            observed,
            interval: self.interval,
            required: gate.offset,
            confidence,
            trials,
            more_trials: more_trials.map(|more| again + more),
            sequential,
        }
    }

    /// How many more trials, about, resolve with a chance of 80 % whether what is `required` holds, if the truth is as
    /// observed; None if that is just what is required, for then no number does. By the normal approximation: the
    /// interval narrows with the root of the trials.
    pub fn more_trials(&self, required: f64, confidence: f64) -> Option<u64> {
        let distance = (self.observed - required).abs();
        if self.trials == 0 || distance < ROUNDING {
            return None;
        }
        let [least, most] = self.interval;
        // The side towards the requirement is the shorter one where the rate is near 0 or 1, but will not stay so.
        let towards = if self.observed > required { self.observed - least } else { most - self.observed };
        let half_width = towards.max((most - least) / 2.0);
        // Half the interval's width in standard errors; it takes the requirement to be so many and 0.84 away.
        let z = Normal::standard().inverse_cdf(0.5 + confidence / 2.0) * if self.sequential { WIDER } else { 1.0 };
        let times = (half_width * (1.0 + Z80 / z) / distance).powi(2);
        Some((self.trials as f64 * (times - 1.0)).ceil().max(1.0) as u64)
    }
}

/// Whether a gate's requirement holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Status {
    Passed,
    Failed,
    Unresolved,
}

impl Status {
    /// Whether it counts as a failure.
    pub fn fails(self, unresolved: OnUnresolved) -> bool {
        self == Status::Failed || (self == Status::Unresolved && unresolved == OnUnresolved::Fail)
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GateAnswer {
    /// The gate as it was written.
    pub name: String,
    pub status: Status,
    /// Rate, or difference of two (shares), its interval, and what is required of it.
    pub observed: f64,
    pub interval: [f64; 2],
    pub required: f64,
    /// Of the interval, two-sided (a share).
    pub confidence: f64,
    pub trials: u64,
    /// How many trials that are still to be run, about, would resolve it: of this campaign if intervals hold at every look,
    /// else of a new one with another seed. None if it is resolved, or if no number would.
    pub more_trials: Option<u64>,
    /// Whether the interval holds at every look.
    pub sequential: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_whole_interval_has_to_lie_on_one_side_and_the_campaign_says_what_is_a_failure() {
        let gate = Gate::parse("catch >= hold + 0.10", &["catch", "hold"].map(String::from)).unwrap();
        // Whether it fails where what is unresolved passes, and where it fails.
        for (interval, status, fails) in [
            ([0.1, 0.2], Status::Passed, [false, false]),
            ([0.0, 0.0999], Status::Failed, [true, true]),
            ([0.0, 0.1], Status::Unresolved, [false, true]),
        ] {
            let found = Evidence { observed: 0.1, interval, trials: 100, sequential: false }.answer(&gate, 0.95);
            assert_eq!((found.status, found.more_trials, &found.name[..]), (status, None, "catch >= hold + 0.10"));
            assert_eq!([OnUnresolved::Pass, OnUnresolved::Fail].map(|unresolved| status.fails(unresolved)), fails);
        }
    }
}
