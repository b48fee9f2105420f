//! Keeps what verdicts need of the rows of a campaign, in little memory. Rows are added part by part, and are not kept
//! themselves.
//!
//! A trial with a controller takes 40 bytes, and the drawn quantities of the trial take 8 bytes for each quantity that
//! varies. A million trials of two controllers are about 120 MB; as rows they were 1.5 GB.
//!
//! A campaign that ends when decided stops a controller once all questions about this controller are decided. So
//! controllers may have different numbers of trials. Each controller has all trials from the first one to its last one.

use crate::store::row::{Repeats, TrialRow};
use crate::verdict::failures::{Failures, FallCause};
use standfast_sim::episode::{EpisodeConfig, Outcome};
use standfast_stats::rate::SuccessCount;

/// The trials of a campaign by controller. The place of a trial is its number.
#[derive(Debug, Clone, PartialEq)]
pub struct TrialColumns {
    /// Names of the controllers, in the order of the campaign.
    pub names: Vec<String>,
    pub drawn: TrialConditions,
    /// Whether episodes ended as soon as the robot had settled or fallen. Then times to home are not known.
    pub end_early: bool,
    controllers: Vec<OfController>,
    /// Speed above which a COM is in motion when the push begins (m/s).
    standing_com_speed_m_s: f64,
}

/// The trials of one controller, with counts of some of their features.
#[derive(Debug, Clone, PartialEq, Default)]
struct OfController {
    ended: Vec<EpisodeEnd>,
    /// Impulses that a bob gave to the robot (N s); empty without a pendulum.
    struck_n_s: Vec<f64>,
    counted: Counted,
}

/// Numbers of trials with some feature. For these features, only the numbers are kept.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Counted {
    pub failures: Failures,
    /// The causes are in the order of their names.
    pub fall_causes: Vec<FallCause>,
    /// Trials in which the push found the COM faster than a robot that counts as standing.
    pub moving_at_push: u64,
    /// Number of trials that were run twice, and number of those trials whose two runs had different records.
    pub run_twice: u64,
    pub not_repeated: u64,
}

/// How a trial ended with one controller. Names are as in [`TrialRow`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EpisodeEnd {
    // NaN stands for None.
    impulse_over_m_omega_d: f64,
    settling_s: f64,
    homing_s: f64,
    peak_sole_force_n: f64,
    /// Number of completed footsteps.
    pub footsteps: u32,
    pub outcome: Outcome,
    /// Whether a foot was in the air at the fall or at the end.
    pub in_swing: bool,
}

/// The drawn quantities of each trial, which are the same for every controller.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct TrialConditions {
    pub impulse_n_s: Values,
    pub heading_deg: Values,
    pub duration_s: Values,
    pub height_m: Values,
    pub second_impulse_n_s: Values,
    /// The quantities of robot and ground, by the names of [`Variation`](standfast_sim::Variation); none without trials.
    pub variation: Vec<(&'static str, Values)>,
}

/// A quantity of each trial. The value is kept once as long as all trials have the same one.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Values {
    first: Option<f64>,
    trials: usize,
    /// Empty as long as all trials have the same value. NaN stands for None.
    each: Vec<f64>,
}

impl TrialColumns {
    /// Columns without trials. `names` are the controllers in the order of the campaign.
    pub fn new(names: &[String], episode: &EpisodeConfig) -> Self {
        let controllers = vec![OfController::default(); names.len()];
        let standing_com_speed_m_s = episode.judge.standing_com_speed_m_s;
        Self {
            names: names.to_vec(),
            drawn: TrialConditions::default(),
            end_early: episode.end_early,
            controllers,
            standing_com_speed_m_s,
        }
    }

    /// Adds the next rows, which are in the order of trials. Rows of controllers that are not named are left out.
    pub fn push(&mut self, rows: &[TrialRow]) {
        for row in rows {
            let Some(controller) = self.names.iter().position(|name| *name == row.controller)
            else {
                continue;
            };
            if row.trial >= self.trials() {
                self.drawn.push(row);
            }
            let OfController {
                ended,
                struck_n_s,
                counted,
            } = &mut self.controllers[controller];
            ended.push(EpisodeEnd::of(row));
            if let Some(struck) = row.record.totals.get("bob_impulse_n_s") {
                struck_n_s.resize(ended.len() - 1, f64::NAN);
                struck_n_s.push(struck);
            }
            let is_moving = row
                .record
                .com_speed_at_push_m_s
                .is_some_and(|speed| speed > self.standing_com_speed_m_s);
            counted.moving_at_push += u64::from(is_moving);
            counted.run_twice += u64::from(row.repeats.is_some());
            counted.not_repeated += u64::from(row.repeats == Some(Repeats::No));
            counted.failures.add(row);
            FallCause::add(&mut counted.fall_causes, row);
        }
    }

    /// How each trial of controller number `controller` ended, from trial 0.
    pub fn of(&self, controller: usize) -> &[EpisodeEnd] {
        &self.controllers[controller].ended
    }

    /// The impulse that the bob gave to the robot in each trial (N s), from trial 0; NaN or left out where it is not known.
    pub fn struck_n_s(&self, controller: usize) -> &[f64] {
        &self.controllers[controller].struck_n_s
    }

    pub fn counted(&self, controller: usize) -> &Counted {
        &self.controllers[controller].counted
    }

    /// How each trial ended with controllers `a` and `b`, from trial 0, as far as both have trials.
    pub fn common(&self, a: usize, b: usize) -> impl Iterator<Item = (&EpisodeEnd, &EpisodeEnd)> {
        self.of(a).iter().zip(self.of(b))
    }

    /// Number of trials of the controller that has most.
    pub fn trials(&self) -> u64 {
        self.drawn.trials() as u64
    }

    /// Impulse of the first push divided by m omega d. If there is no d, it is the impulse (N s).
    pub fn hardness(&self, controller: usize, trial: usize) -> f64 {
        self.of(controller)[trial]
            .impulse_over_m_omega_d()
            .unwrap_or_else(|| self.impulse_n_s(trial))
    }

    /// Impulse of the first push.
    pub fn impulse_n_s(&self, trial: usize) -> f64 {
        self.drawn.impulse_n_s.at(trial).unwrap_or(f64::NAN)
    }

    /// Heading of the first push.
    pub fn heading_deg(&self, trial: usize) -> f64 {
        self.drawn.heading_deg.at(trial).unwrap_or(f64::NAN)
    }
}

impl EpisodeEnd {
    pub fn of(row: &TrialRow) -> Self {
        Self {
            impulse_over_m_omega_d: or_nan(row.impulse_over_m_omega_d),
            settling_s: or_nan(row.settling_s()),
            homing_s: or_nan(row.homing_s()),
            peak_sole_force_n: or_nan(row.record.peak_sole_force_n),
            footsteps: row.record.footsteps.count,
            outcome: row.record.outcome,
            in_swing: row.record.footsteps.unfinished_footstep.is_some(),
        }
    }

    pub fn has_recovered(&self) -> bool {
        self.outcome.is_success()
    }

    pub fn impulse_over_m_omega_d(&self) -> Option<f64> {
        some(self.impulse_over_m_omega_d)
    }

    /// Settling time, as in [`TrialRow::settling_s`].
    pub fn settling_s(&self) -> Option<f64> {
        some(self.settling_s)
    }

    /// Homing time, as in [`TrialRow::homing_s`].
    pub fn homing_s(&self) -> Option<f64> {
        some(self.homing_s)
    }

    /// Largest force on a sole (N); None in the results of earlier versions.
    pub fn peak_sole_force_n(&self) -> Option<f64> {
        some(self.peak_sole_force_n)
    }
}

impl TrialConditions {
    pub fn trials(&self) -> usize {
        self.impulse_n_s.trials
    }

    fn push(&mut self, row: &TrialRow) {
        self.impulse_n_s.push(Some(row.push.impulse_n_s));
        self.heading_deg.push(Some(row.push.heading_deg));
        self.duration_s.push(Some(row.push.duration_s));
        self.height_m.push(Some(row.push.height_m));
        self.second_impulse_n_s.push(row.second.second_impulse_n_s);
        let varied = row.variation.list();
        if self.variation.is_empty() {
            self.variation = varied
                .iter()
                .map(|(name, _)| (*name, Values::default()))
                .collect();
        }
        for ((_, values), (_, value)) in self.variation.iter_mut().zip(varied) {
            values.push(value);
        }
    }

    /// A quantity of robot and ground.
    pub fn varied(&self, name: &str) -> Option<&Values> {
        self.variation
            .iter()
            .find(|(found, _)| *found == name)
            .map(|(_, values)| values)
    }
}

impl Values {
    fn push(&mut self, value: Option<f64>) {
        if self.trials == 0 {
            self.first = value;
        }
        if self.each.is_empty() && value.map(f64::to_bits) != self.first.map(f64::to_bits) {
            self.each = vec![or_nan(self.first); self.trials];
        }
        if !self.each.is_empty() {
            self.each.push(or_nan(value));
        }
        self.trials += 1;
    }

    /// The value of trial number `trial`.
    pub fn at(&self, trial: usize) -> Option<f64> {
        if self.each.is_empty() {
            self.first
        } else {
            some(self.each[trial])
        }
    }

    /// The values of all trials, in order.
    pub fn iter(&self) -> impl Iterator<Item = Option<f64>> + Clone {
        (0..self.trials).map(|trial| self.at(trial))
    }
}

/// Counts these trials, and those from which the robot recovered.
pub fn success_count<'a>(ended: impl IntoIterator<Item = &'a EpisodeEnd>) -> SuccessCount {
    let (mut trials, mut recovered) = (0, 0);
    for ended in ended {
        trials += 1;
        recovered += u64::from(ended.has_recovered());
    }
    SuccessCount::new(recovered, trials)
}

/// Counts the trials for which `such` holds, and those of them from which the robot recovered.
pub fn success_count_of(ended: &[EpisodeEnd], such: impl Fn(&EpisodeEnd) -> bool) -> SuccessCount {
    success_count(ended.iter().filter(|ended| such(ended)))
}

fn or_nan(value: Option<f64>) -> f64 {
    value.unwrap_or(f64::NAN)
}

fn some(value: f64) -> Option<f64> {
    (!value.is_nan()).then_some(value)
}

#[cfg(test)]
mod tests {
    use super::*;

    use crate::fixtures::row;

    /// A million trials with two controllers have to fit in memory.
    #[test]
    fn a_trial_takes_few_bytes() {
        assert_eq!(size_of::<EpisodeEnd>(), 40);
        let rows: Vec<TrialRow> = (0..20)
            .map(|trial| row(trial, "a", trial as f64, Outcome::Fell))
            .collect();
        let TrialConditions {
            impulse_n_s,
            heading_deg,
            ..
        } = crate::fixtures::columns_of_rows(&rows, &["a"]).drawn;
        assert_eq!(
            (
                impulse_n_s.each.len(),
                heading_deg.each.len(),
                heading_deg.at(19)
            ),
            (20, 0, Some(0.0))
        );
    }
}
