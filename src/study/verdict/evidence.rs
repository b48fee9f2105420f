//! Whether trials have shown what a gate asks for.
//!
//! A gate has three answers. It passes if the whole interval of the observed value lies at or above the requirement. It
//! fails if the whole interval lies below. Otherwise it is unresolved, and more trials may decide. If the observed
//! value itself were compared with the requirement, chance would raise alarms: of two results with 1000 trials each, of
//! a controller that recovers from 97 % in both, every fourth pair differs by half a point to the worse.
//!
//! At a confidence of 95 % at most 2.5 % of campaigns pass wrongly, and at most 2.5 % fail wrongly. This is exact for a
//! rate. It is approximate for a difference: if nearly all trials that differ are of one kind, and these are few, up to
//! 5.6 % err on the side away from zero (see [`mcnemar`](standfast_stats::mcnemar)). For example,
//! `catch >= baseline - 0.01` fails in 5.3 % of campaigns of 400 trials with a true loss of one point and no gains.
//! Intervals that hold at every look err in at most 5 % of campaigns, on both sides together.

use crate::ask::gate::{Gate, OnUnresolved};
use serde::Serialize;
use standfast_stats::mcnemar::PairedCounts;
use standfast_stats::rate::clopper_pearson;
use standfast_stats::sequential;
use statrs::distribution::{ContinuousCDF, Normal};

/// Chance with which `more_trials` resolve a gate, and the quantile of the standard normal distribution at this chance.
const POWER: f64 = 0.8;
const Z80: f64 = 0.841_621_233_572_914_3;
/// Width of an interval that holds at every look, over the width of an interval for a fixed number of trials at the
/// same confidence. It is an approximation for 1000 to 10,000 trials at 95 %.
const WIDER: f64 = 1.7;
/// Distance to a requirement below which it is a rounding error.
const ROUNDING: f64 = 1e-9;

/// What trials show of a rate, or of the difference of two rates on the same trials (shares).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Evidence {
    pub observed: f64,
    pub interval: [f64; 2],
    pub trials: u64,
    /// Whether the interval holds at every look, as one of [`sequential`] does, or for a fixed number of trials only.
    pub sequential: bool,
    /// For a difference, the number of trials in which each of the two recovered. It is None for a rate.
    pub counts: Option<PairedCounts>,
}

impl Evidence {
    /// Evidence of a rate, with an interval of this `confidence` (a share). For a fixed number of trials it is the
    /// interval of Clopper and Pearson, whose error is never larger than stated.
    pub fn rate(recovered: u64, trials: u64, confidence: f64, sequential: bool) -> Self {
        let interval = if sequential {
            sequential::rate_interval
        } else {
            clopper_pearson
        };
        let observed = recovered as f64 / trials.max(1) as f64;
        Self {
            observed,
            interval: interval(recovered, trials, confidence),
            trials,
            sequential,
            counts: None,
        }
    }

    /// Evidence of the difference of two rates, with an interval of this `confidence` (a share).
    pub fn difference(counts: &PairedCounts, confidence: f64, sequential: bool) -> Self {
        let interval = counts.interval(confidence, sequential);
        Self {
            observed: counts.difference(),
            interval,
            trials: counts.trials(),
            sequential,
            counts: Some(*counts),
        }
    }

    /// The answer to a gate. `self` is the evidence of the rate that the gate requires, or of the difference of two
    /// rates. It has an interval with this `confidence` (a two-sided share).
    pub fn answer(&self, gate: &Gate, confidence: f64) -> GateAnswer {
        let &Self {
            observed,
            interval: [least, most],
            trials,
            sequential,
            ..
        } = self;
        let status = match gate.offset {
            required if least >= required => Status::Passed,
            required if most < required => Status::Failed,
            _ => Status::Unresolved,
        };
        let more_trials = if status == Status::Unresolved {
            self.more_trials(gate.offset, confidence)
        } else {
            None
        };
        GateAnswer {
            name: gate.text.clone(),
            status,
            observed,
            interval: self.interval,
            required: gate.offset,
            confidence,
            trials,
            more_trials,
            sequential,
        }
    }

    /// Estimates how many further trials decide with a chance of 80 % whether the `required` value is reached, if the
    /// true value is the observed one. If the interval holds at every look, these are further trials of this campaign.
    /// Otherwise they are the trials of a new campaign, since a campaign with a fixed number of trials cannot be
    /// continued. It is None if the observed value is just the required one, because then no number of trials decides.
    ///
    /// The number for a difference and a fixed number of trials follows from the score test. Otherwise the width of the
    /// interval is taken as proportional to 1 / sqrt(number of trials) (normal approximation).
    pub(super) fn more_trials(&self, required: f64, confidence: f64) -> Option<u64> {
        let distance = (self.observed - required).abs();
        if self.trials == 0 || distance < ROUNDING {
            return None;
        }
        if let (Some(counts), false) = (&self.counts, self.sequential) {
            return counts.trials_to_resolve(required, POWER, 1.0 - confidence);
        }
        let [least, most] = self.interval;
        // Near a rate of 0 or 1 the side towards the requirement may be the shorter one, but it does not stay so with
        // more trials.
        let towards = if self.observed > required {
            self.observed - least
        } else {
            most - self.observed
        };
        let half_width = towards.max((most - least) / 2.0);
        // This is half the width of the interval in standard errors. The interval decides with a chance of 80 % if the
        // requirement is 0.84 standard errors farther away.
        let z = Normal::standard().inverse_cdf(0.5 + confidence / 2.0)
            * if self.sequential { WIDER } else { 1.0 };
        let times = (half_width * (1.0 + Z80 / z) / distance).powi(2);
        let again = if self.sequential { 0 } else { self.trials };
        Some(again + (self.trials as f64 * (times - 1.0)).ceil().max(1.0) as u64)
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
    /// Whether a gate with this status counts as a failure.
    pub fn fails(self, unresolved: OnUnresolved) -> bool {
        self == Status::Failed || (self == Status::Unresolved && unresolved == OnUnresolved::Fail)
    }
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct GateAnswer {
    /// The gate as it was written.
    pub name: String,
    pub status: Status,
    /// The observed rate or difference of two rates (a share), its interval, and the least value that is required.
    pub observed: f64,
    pub interval: [f64; 2],
    pub required: f64,
    /// Confidence of the interval (a two-sided share).
    pub confidence: f64,
    pub trials: u64,
    /// About how many further trials would decide the gate. If the interval holds at every look, these are further
    /// trials of this campaign. Otherwise they are the trials of a new campaign with another seed. It is None if the
    /// gate is decided, or if no number of trials would decide it.
    pub more_trials: Option<u64>,
    /// Whether the interval holds at every look.
    pub sequential: bool,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_whole_interval_has_to_lie_on_one_side_and_the_campaign_says_what_is_a_failure() {
        let gate =
            Gate::parse("catch >= hold + 0.10", &["catch", "hold"].map(String::from)).unwrap();
        // The last column says whether it counts as a failure, first if unresolved gates pass, then if they fail.
        for (interval, status, fails) in [
            ([0.1, 0.2], Status::Passed, [false, false]),
            ([0.0, 0.0999], Status::Failed, [true, true]),
            ([0.0, 0.1], Status::Unresolved, [false, true]),
        ] {
            let found = Evidence {
                observed: 0.1,
                interval,
                trials: 100,
                sequential: false,
                counts: None,
            }
            .answer(&gate, 0.95);
            assert_eq!(
                (found.status, found.more_trials, &found.name[..]),
                (status, None, "catch >= hold + 0.10")
            );
            assert_eq!(
                [OnUnresolved::Pass, OnUnresolved::Fail].map(|unresolved| status.fails(unresolved)),
                fails
            );
        }
    }
}
