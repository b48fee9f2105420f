//! A controller without pushes: whether the robot stands, and whether a second episode is the same. A robot that falls
//! without a push has a mistake in what its controller reads or commands, and trials with pushes would say nothing.

use super::closed_loop::run;
use super::config::{Disturbance, EpisodeConfig, Until};
use super::record::{Outcome, Record};
use standfast_core::error::Result;
use standfast_core::robot::{Foot, Robot, Units};
use standfast_core::socket::{Command, PreparedController};
use std::time::Instant;

/// Distance from its angle at the start at which a joint has left that angle (rad).
pub const LEAVES_RAD: f64 = 0.1;

/// The result of an episode without a push.
pub struct UnpushedEpisode {
    pub record: Record,
    /// The joint that was the first to leave its angle at the start by [`LEAVES_RAD`], and the time (s).
    pub left_first: Option<(usize, f64)>,
    /// Largest speed of the COM (m/s) in the second half of the episode.
    pub late_com_speed_m_s: f64,
    /// Loads of the left and the right sole at the end, as shares of the weight.
    pub carried: [f64; 2],
    /// The first observation of the controller, if it reports one.
    pub observed: Vec<(String, Vec<f64>)>,
    /// Mean wall-clock time of a tick, with its simulation (s).
    pub tick_s: f64,
    ticks: Vec<Ticked>,
}

/// The part of a tick that is compared: joint angles (rad) and command.
struct Ticked {
    time_s: f64,
    q: Vec<f64>,
    command: Command,
}

impl UnpushedEpisode {
    /// Runs an episode without pushes, up to a fall or the horizon. Errors are those of
    /// [`ClosedLoop::finish`](super::ClosedLoop::finish).
    pub fn run(
        robot: &Robot,
        factory: &PreparedController,
        config: &EpisodeConfig,
        disturbance: Disturbance,
    ) -> Result<Self> {
        let quiet = Disturbance {
            pushes: Vec::new(),
            ..disturbance
        };
        let (mut ticks, mut late_com_speed_m_s, began) = (Vec::new(), 0.0_f64, Instant::now());
        let (mut observed, mut carried) = (Vec::new(), [0.0; 2]);
        let weight_n = Units::of(robot).weight_n();
        let record = run(robot, factory, config, quiet, Until::Fallen, &mut |tick| {
            if tick.truth.time_s > config.horizon_s / 2.0 {
                late_com_speed_m_s = late_com_speed_m_s.max(tick.truth.com_vel.norm());
            }
            if ticks.is_empty() {
                observed = tick
                    .controller
                    .map_or_else(Vec::new, |controller| controller.observed());
            }
            carried = Foot::BOTH.map(|foot| tick.truth.sole_wrenches[foot].force.z / weight_n);
            // A command that failed may have any length.
            if !tick.is_broken() {
                let (time_s, q, command) = (
                    tick.truth.time_s,
                    tick.truth.posture.q.clone(),
                    tick.command.clone(),
                );
                ticks.push(Ticked { time_s, q, command });
            }
        })?;
        let tick_s = began.elapsed().as_secs_f64() / ticks.len().max(1) as f64;
        let left_first = ticks.iter().find_map(|Ticked { time_s, q, .. }| {
            let mut angles = q.iter().zip(&robot.home_rad);
            let joint = angles.position(|(angle, home)| (angle - home).abs() > LEAVES_RAD)?;
            Some((joint, *time_s))
        });
        Ok(Self {
            record,
            left_first,
            late_com_speed_m_s,
            carried,
            observed,
            tick_s,
            ticks,
        })
    }

    /// Whether the robot fell or broke, or the controller failed.
    pub fn is_lost(&self) -> bool {
        let outcome = self.record.outcome;
        outcome.is_lost() || matches!(outcome, Outcome::Diverged | Outcome::Failed)
    }

    /// When and why the episode was lost, and which joint of `robot` left first, in words.
    pub fn how_lost(&self, robot: &Robot) -> String {
        let Record {
            outcome,
            fell_at_s,
            end_s,
            fall_cause,
            ..
        } = &self.record;
        let what = if *outcome == Outcome::Fell {
            "falls"
        } else {
            "fails"
        };
        let (at_s, cause) = (
            fell_at_s.unwrap_or(*end_s),
            fall_cause.as_deref().unwrap_or("no cause is known"),
        );
        format!(
            "{what} without a push, at {at_s:.3} s: {cause}{}",
            self.leaver(robot)
        )
    }

    /// The joint of `robot` that left first, as a part of a sentence. It is empty if none did.
    pub fn leaver(&self, robot: &Robot) -> String {
        self.left_first.map_or_else(String::new, |(joint, time_s)| {
            let joint = &robot.joints[joint].name;
            format!("; the first joint to be {LEAVES_RAD} rad from its angle of the start is {joint}, at {time_s:.3} s")
        })
    }

    /// The first command. It is None if the first tick failed.
    pub fn first(&self) -> Option<&Command> {
        self.ticks.first().map(|tick| &tick.command)
    }

    /// The time (s) of the first tick that differs from `other` by a bit, and what differs. It is None if nothing does.
    pub fn differs(&self, other: &Self) -> Option<(f64, &'static str)> {
        for (a, b) in self.ticks.iter().zip(&other.ticks) {
            if a.command != b.command {
                return Some((a.time_s, "its command"));
            }
            if a.q != b.q {
                return Some((a.time_s, "the robot's joints"));
            }
        }
        let ends_s = self.record.end_s.min(other.record.end_s);
        (self.ticks.len() != other.ticks.len()).then_some((ends_s, "its end"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use standfast_core::socket::{Controller, Report, Sensed, TickError};
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU64, Ordering};

    /// A controller that counts the ticks of all its episodes.
    struct Forgetful(Arc<AtomicU64>);

    impl Controller for Forgetful {
        fn tick(&mut self, _: &Sensed, command: &mut Command) -> Result<(), TickError> {
            if self.0.fetch_add(1, Ordering::Relaxed) == 60 {
                command.tau_ff[0] += 1e-9;
            }
            Ok(())
        }

        fn report(&self) -> Report<'_> {
            Report::of_phase("forgetful")
        }

        fn fork(&self) -> Option<Box<dyn Controller>> {
            None
        }
    }

    #[test]
    fn what_is_remembered_from_an_earlier_episode_is_found() {
        let robot = standfast_robots::load("ut-mu2").unwrap();
        let config = EpisodeConfig {
            horizon_s: 0.1,
            ..EpisodeConfig::of(&Units::of(&robot))
        };
        let ticks = Arc::new(AtomicU64::new(0));
        let factory = PreparedController::new("forgetful", "remembers", move |_seed| {
            Forgetful(Arc::clone(&ticks))
        });
        // Each episode has some 51 ticks, so the tick with another command is in the second episode alone.
        let [first, second, third] = [(); 3].map(|()| {
            UnpushedEpisode::run(&robot, &factory, &config, Disturbance::default()).unwrap()
        });
        let (at_s, what) = first.differs(&second).unwrap();
        assert!(
            at_s > 0.0 && at_s < 0.1 && what == "its command",
            "{at_s} s: {what}"
        );
        assert_eq!(first.differs(&third), None);
    }
}
