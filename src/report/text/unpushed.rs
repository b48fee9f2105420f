//! The result of a controller in episodes without pushes, as text and JSON: `standfast check`.

use super::layout::{entry, signed};
use crate::table::{Table, headings, number, texts, words};
use serde_json::{Value, json};
use standfast_core::robot::Robot;
use standfast_core::socket::PreparedController;
use standfast_sim::episode::unpushed::UnpushedEpisode;
use standfast_sim::episode::{EpisodeConfig, Outcome};

/// A gain with some four digits.
fn short(gain: f64) -> String {
    let decimals = (3.0 - gain.abs().max(1e-3).log10().floor()).clamp(0.0, 6.0) as i32;
    let factor = 10f64.powi(decimals);
    format!("{}", (gain * factor).round() / factor)
}

/// The result of giving recorded observations to a policy.
pub struct Contract {
    pub pairs: u64,
    /// Number of values in an action.
    pub actions: usize,
    /// Largest difference of an action.
    pub largest: f64,
    /// The first difference: line, index in the action, and the value now and as recorded.
    pub first_apart: Option<(usize, usize, [f64; 2])>,
}

impl Contract {
    /// Difference up to which actions are the same: other programs for networks add numbers in another order.
    const SAME: f64 = 1e-3;

    /// Takes the pair of a line, with the action now and as recorded.
    pub fn add(&mut self, line: usize, now: &[f64], recorded: &[f64]) {
        (self.pairs, self.actions) = (self.pairs + 1, now.len());
        for (i, (&now, &then)) in now.iter().zip(recorded).enumerate() {
            // A difference that is not finite counts as a difference.
            let apart = (now - then).abs();
            self.largest = if apart > self.largest || apart.is_nan() {
                apart
            } else {
                self.largest
            };
            if (apart.is_nan() || apart > Self::SAME) && self.first_apart.is_none() {
                self.first_apart = Some((line, i, [now, then]));
            }
        }
    }

    fn told(&self) -> String {
        let Self {
            pairs,
            actions,
            largest,
            first_apart,
        } = self;
        match first_apart {
            None => format!(
                "{pairs} recorded actions of {actions} numbers are repeated, to {largest:.1e}"
            ),
            Some((line, i, [now, then])) => format!(
                "WARNING: recorded actions are not repeated: in line {line}, action {i} is {now:.4}, and {then:.4} was recorded. \
                 The network or the order of its terms is another one"
            ),
        }
    }
}

/// A controller, tried three times.
pub struct UnpushedCheck<'a> {
    pub robot: &'a Robot,
    pub factory: &'a PreparedController,
    pub config: &'a EpisodeConfig,
    pub alone: &'a UnpushedEpisode,
    /// The first difference, time (s) and what differs: in a second episode, and in an episode of a controller that is
    /// started anew.
    pub again: Option<(f64, &'static str)>,
    pub anew: Option<(f64, &'static str)>,
    pub contract: Option<Contract>,
}

impl UnpushedCheck<'_> {
    /// Whether the controller neither falls nor fails, and repeats its commands.
    pub fn is_good(&self) -> bool {
        let is_kept = self
            .contract
            .as_ref()
            .is_none_or(|contract| contract.first_apart.is_none());
        !self.alone.is_lost() && self.again.is_none() && self.anew.is_none() && is_kept
    }

    pub fn text(&self) -> String {
        let Self {
            robot,
            factory,
            config,
            alone,
            ..
        } = self;
        let about = if factory.about.is_empty() {
            String::new()
        } else {
            format!(", {}", factory.about)
        };
        let period_ms = 1e3 * config.control_period_s;
        let mut lines = vec![
            ("controller", format!("{}{about}", factory.name)),
            (
                "robot",
                format!(
                    "{} with {} joints, a tick every {period_ms} ms",
                    robot.name,
                    robot.joints.len()
                ),
            ),
            ("alone", self.alone()),
            ("again", self.repeats()),
            (
                "time",
                format!(
                    "{:.3} ms a tick, with its simulation in {}",
                    1e3 * alone.tick_s,
                    config.engine.title()
                ),
            ),
        ];
        if let Some(contract) = &self.contract {
            lines.push(("contract", contract.told()));
        }
        let mut text = String::new();
        for (label, what) in lines {
            text += &entry(label, &what);
        }
        for table in [self.observed(), self.first()].into_iter().flatten() {
            text += &format!("\n{}", table.text());
        }
        text
    }

    /// The first observation of the controller.
    fn observed(&self) -> Option<Table> {
        /// Largest number of values of a part that are shown.
        const SHOWN: usize = 6;
        let mut table = Table::new(
            "The first observation",
            [
                words("observed"),
                number("numbers"),
                words("the first ones"),
            ],
        )
        .with_note("The first observation, in its order; standing upright, gravity is 0, 0, -1.");
        for (name, numbers) in &self.alone.observed {
            let shown: Vec<String> = numbers
                .iter()
                .take(SHOWN)
                .map(|value| signed(*value, 3))
                .collect();
            let more = if numbers.len() > SHOWN { ", ..." } else { "" };
            table.row(texts([
                name.clone(),
                numbers.len().to_string(),
                format!("{}{more}", shown.join(", ")),
            ]));
        }
        (!self.alone.observed.is_empty()).then_some(table)
    }

    /// The first command to each joint.
    fn first(&self) -> Option<Table> {
        let command = self.alone.first()?;
        let columns = ["angle [rad]", "reference [rad]", "torque [N m]", "kp", "kd"];
        let mut table = Table::new("The first command", headings("joint", columns)).with_note(
            "The first command, in the order of the joints; kp in N m/rad, kd in N m s/rad.",
        );
        for (i, joint) in self.robot.joints.iter().enumerate() {
            let [kp, kd] = self.gains(i);
            let numbers =
                [self.robot.home_rad[i], command.q_ref[i], command.tau_ff[i]].map(|x| signed(x, 4));
            let [angle, reference, torque] = numbers;
            table.row(texts([
                joint.name.clone(),
                angle,
                reference,
                torque,
                short(kp),
                short(kd),
            ]));
        }
        Some(table)
    }

    fn gains(&self, joint: usize) -> [f64; 2] {
        let servo = &self.robot.servos[joint];
        let stated = self
            .alone
            .first()
            .and_then(|command| command.gains.as_ref());
        stated.map_or([servo.kp, servo.kd], |gains| gains[joint])
    }

    fn alone(&self) -> String {
        let (record, left) = (&self.alone.record, self.alone.leaver(self.robot));
        let tilt = format!(
            "its trunk tilts by {:.1} degrees at most",
            record.peak_tilt_deg
        );
        match record.outcome {
            Outcome::Recovered => {
                format!(
                    "it stands still at the end of the episode of {:.2} s; {tilt}{left}",
                    record.end_s
                )
            }
            Outcome::TimedOut | Outcome::Survived => format!(
                "it does not fall in {:.2} s; {tilt}. It does not stand still either: its COM moves at up to {:.3} \
                 m/s in the second half, and {:.3} m/s is still. Its trials count with `episode.judge.counts=survived` alone{left}",
                record.end_s,
                self.alone.late_com_speed_m_s,
                self.config.judge.standing_com_speed_m_s
            ),
            Outcome::Fell | Outcome::Broke | Outcome::Diverged | Outcome::Failed => {
                format!("WARNING: it {}", self.alone.how_lost(self.robot))
            }
        }
    }

    fn repeats(&self) -> String {
        let (when, (at_s, what)) = match (self.again, self.anew) {
            (Some(difference), _) => ("in a second episode", difference),
            (None, Some(difference)) => ("started anew", difference),
            (None, None) => {
                return "the same to the bit in a second episode, and started anew".into();
            }
        };
        format!(
            "WARNING: {when}, {what} differs from {at_s:.3} s on. Its results depend on which trials came before, and \
             no replay of it is exact. An episode must follow from its readings and its seed alone"
        )
    }

    pub fn json(&self) -> Value {
        let Self {
            robot,
            factory,
            config,
            alone,
            ..
        } = self;
        let record = &alone.record;
        let mut commands = Vec::new();
        if let Some(command) = alone.first() {
            for (i, joint) in robot.joints.iter().enumerate() {
                let [kp, kd] = self.gains(i);
                commands.push(json!({
                    "joint": joint.name, "q_rad": robot.home_rad[i], "q_ref_rad": command.q_ref[i],
                    "dq_ref_rad_s": command.dq_ref[i], "tau_ff_n_m": command.tau_ff[i], "kp": kp, "kd": kd,
                }));
            }
        }
        let [again, anew] = [self.again, self.anew]
            .map(|difference| difference.map(|(at_s, what)| json!({ "at_s": at_s, "what": what })));
        json!({
            "controller": factory.name,
            "robot": robot.name,
            "engine": config.engine.title(),
            "control_period_s": config.control_period_s,
            "is_good": self.is_good(),
            "outcome": record.outcome.name(),
            "end_s": record.end_s,
            "fall_cause": record.fall_cause,
            "peak_tilt_deg": record.peak_tilt_deg,
            "late_com_speed_m_s": alone.late_com_speed_m_s,
            "left_first": alone.left_first.map(|(i, at_s)| json!({ "joint": robot.joints[i].name, "at_s": at_s })),
            "differs_in_a_second_episode": again,
            "differs_started_anew": anew,
            "contract": self.contract.as_ref().map(|contract| json!({
                "pairs": contract.pairs, "largest_difference": contract.largest, "is_kept": contract.first_apart.is_none(),
            })),
            "first_observation": alone.observed.iter().map(|(name, numbers)| json!({ "term": name, "numbers": numbers })).collect::<Vec<_>>(),
            "tick_s": alone.tick_s,
            "first_command": commands,
        })
    }
}
