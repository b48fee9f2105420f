//! Counts how trials were lost: when the robot fell, where each fall counts once, and what happened together with the
//! fall.
//!
//! What happens together with a fall need not be its cause. The thresholds are chosen so that survivors hardly ever
//! pass them: of the 259 survivors among the first 100 pushes of the standard campaign none slid by more than 9 mm, and
//! 3 were at a torque limit for longer than 0.1 s; of the 141 that fell or timed out, 5 slid by more than 10 mm, and 32
//! were longer at a limit. Among the first 300 pushes the legs of `catch` met in 18 of its 42 falls, and in none of its
//! 258 recoveries.

use crate::store::row::TrialRow;
use serde::Serialize;
use standfast_sim::episode::Outcome;
use std::cmp::Reverse;

/// A sole that slid farther than this has slipped.
pub const SLIPPED_M: f64 = 0.01;
/// A robot is limited by torque if one of its joints was at its torque limit for longer than this in all.
pub const TORQUE_LIMITED_S: f64 = 0.1;

/// Numbers of trials from which the robot did not recover. The first seven numbers together count each such trial once.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Failures {
    /// Falls before any foot was lifted.
    pub fell_before_any_footstep: u64,
    /// Falls with a foot in the air.
    pub fell_in_swing: u64,
    /// Falls after the last foot had landed.
    pub fell_after_landing: u64,
    /// Trials in which the robot neither fell nor stood at the horizon.
    pub timed_out: u64,
    /// Trials in which a sole bore more than the judge's limit.
    pub broke: u64,
    pub diverged: u64,
    /// Trials in which the controller failed.
    pub failed: u64,
    /// Falls in which a sole slid by more than [`SLIPPED_M`] while the trunk was upright. A fall may also be among the
    /// next two counts.
    pub fell_slipped: u64,
    /// Falls in which a joint was at its torque limit for longer than [`TORQUE_LIMITED_S`] while the trunk was upright.
    pub fell_torque_limited: u64,
    /// Falls in which the legs met.
    pub fell_legs_met: u64,
    /// Falls that are in none of the three counts above: no slip, no torque limit, no legs that met.
    pub fell_otherwise: u64,
}

impl Failures {
    /// Counts one more trial.
    pub fn add(&mut self, row: &TrialRow) {
        match row.record.outcome {
            Outcome::Recovered | Outcome::Survived => {}
            Outcome::TimedOut => self.timed_out += 1,
            Outcome::Broke => self.broke += 1,
            Outcome::Diverged => self.diverged += 1,
            Outcome::Failed => self.failed += 1,
            Outcome::Fell => self.count_fall(row),
        }
    }

    fn count_fall(&mut self, row: &TrialRow) {
        *match (
            row.record.footsteps.unfinished_footstep,
            row.record.footsteps.count,
        ) {
            (Some(_), _) => &mut self.fell_in_swing,
            (None, 0) => &mut self.fell_before_any_footstep,
            (None, _) => &mut self.fell_after_landing,
        } += 1;
        let slipped = row.record.peak_slip_m > SLIPPED_M;
        let torque_limited = row.record.torque_limited_s > TORQUE_LIMITED_S;
        self.fell_slipped += u64::from(slipped);
        self.fell_torque_limited += u64::from(torque_limited);
        let legs_met = row.record.legs_met_at_s.is_some();
        self.fell_legs_met += u64::from(legs_met);
        self.fell_otherwise += u64::from(!slipped && !torque_limited && !legs_met);
    }
}

/// Number of trials of a controller that ended by one cause of a fall or of a divergence.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FallCause {
    /// The cause, in the words of [`standfast_sim::episode::Record::fall_cause`].
    pub cause: String,
    pub trials: u64,
}

impl FallCause {
    /// Counts one more trial among `causes`, which are in the order of their names.
    pub fn add(causes: &mut Vec<Self>, row: &TrialRow) {
        let cause = match (row.record.outcome, &row.record.fall_cause) {
            (Outcome::Fell, Some(cause)) => cause.clone(),
            (Outcome::Broke | Outcome::Diverged | Outcome::Failed, Some(cause)) => {
                format!("{}, {cause}", row.record.outcome.name())
            }
            _ => return,
        };
        match causes.binary_search_by(|other| other.cause.cmp(&cause)) {
            Ok(place) => causes[place].trials += 1,
            Err(place) => causes.insert(place, Self { cause, trials: 1 }),
        }
    }

    /// The same causes, the most frequent first. Equally frequent ones are in the order of their names.
    pub fn most_frequent_first(causes: &[Self]) -> Vec<Self> {
        let mut causes = causes.to_vec();
        causes.sort_by_key(|cause| Reverse(cause.trials));
        causes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::Changed as _;
    use crate::fixtures::row;
    use Outcome::{Broke, Diverged, Failed, Fell, Recovered, TimedOut};
    use standfast_core::robot::Foot::{Left, Right};

    #[test]
    fn each_failure_is_of_one_time_and_a_fall_may_have_several_flags() {
        let mut failures = Failures::default();
        for (outcome, count, foot, slip_mm, limited_ms, legs_met) in [
            (Recovered, 1, None, 50.0, 500.0, true),
            (Fell, 0, None, 9.0, 90.0, false),
            (Fell, 0, Some(Left), 11.0, 90.0, false),
            (Fell, 2, None, 9.0, 110.0, false),
            (Fell, 4, Some(Right), 11.0, 110.0, false),
            (Fell, 3, None, 0.0, 120.0, false),
            (Fell, 1, Some(Right), 0.0, 0.0, false),
            (TimedOut, 3, Some(Left), 50.0, 500.0, true),
            (Broke, 0, None, 50.0, 500.0, true),
            (Diverged, 0, None, 50.0, 500.0, true),
            (Failed, 1, None, 50.0, 500.0, true),
            (Fell, 1, None, 0.0, 120.0, true),
            (Fell, 1, None, 0.0, 0.0, true),
        ] {
            let mut row = row(0, "paper", 3.0, outcome);
            row.record.footsteps.count = count;
            row.record.footsteps.unfinished_footstep = foot;
            row.record.peak_slip_m = 1e-3 * slip_mm;
            row.record.torque_limited_s = 1e-3 * limited_ms;
            row.record.legs_met_at_s = legs_met.then_some(1.0);
            failures.add(&row);
        }
        let expected = Failures {
            fell_before_any_footstep: 1,
            fell_in_swing: 3,
            fell_after_landing: 4,
            timed_out: 1,
            broke: 1,
            diverged: 1,
            failed: 1,
            fell_slipped: 2,
            fell_torque_limited: 4,
            fell_legs_met: 2,
            fell_otherwise: 2,
        };
        assert_eq!(failures, expected);
    }

    #[test]
    fn causes_of_what_was_lost_are_counted_and_the_most_frequent_is_first() {
        let mut causes = Vec::new();
        for (cause, outcome) in [
            ("b", Fell),
            ("c", Fell),
            ("a", Fell),
            ("c", Fell),
            ("b", Diverged),
            ("b", Failed),
            ("b", Broke),
        ] {
            let row =
                row(0, "a", 1.0, outcome).with(|row| row.record.fall_cause = Some(cause.into()));
            FallCause::add(&mut causes, &row);
        }
        let causes = FallCause::most_frequent_first(&causes);
        let causes: Vec<_> = causes
            .iter()
            .map(|c| (c.cause.as_str(), c.trials))
            .collect();
        assert_eq!(
            causes,
            [
                ("c", 2),
                ("a", 1),
                ("b", 1),
                ("broke, b", 1),
                ("diverged, b", 1),
                ("failed, b", 1)
            ]
        );
    }
}
