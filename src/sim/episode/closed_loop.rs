//! The one closed loop of plant and controllers. At every tick the controllers read the sensors and decide; servos and
//! physics then run until the next tick. Observers, such as films and traces, see every tick.
//!
//! Several controllers can go through a trial at once. All their episodes start with the same robot, sensors and
//! ground. As long as two controllers give the same commands, their robots are the same to the bit, so they are
//! simulated once: `switching` and `paper`, for example, differ only from the first footstep on. This holds for the
//! controllers in one engine; each engine has robots of its own. When commands differ,
//! the simulated robot is copied. Trials that differ in their pushes alone are the same until the first push, so their
//! beginning is run once and copied, too. The episode of a single controller is a loop with one. In all these cases the
//! records are the same to the bit.

use super::config::{Disturbance, EpisodeConfig, Until};
use super::record::Record;
use super::referee::Referee;
use super::tick::{Failure, Tick};
use crate::{Engine, Ground, Plant, Pull, Push, Truth};
use standfast_core::error::{Error, Result};
use standfast_core::robot::{Robot, Units};
use standfast_core::socket::{Command, Controller, PreparedController, Sensed, TickError};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;

/// One trial with some controllers, up to some tick.
pub struct ClosedLoop<'a> {
    config: &'a EpisodeConfig,
    until: Until,
    /// Time for which an episode continues after it is decided (s), for observers.
    aftermath_s: f64,
    pushes: Vec<Push>,
    branches: Vec<Branch<'a>>,
    /// The records of the episodes that have ended, in the order of the controllers.
    records: Vec<Option<Record>>,
    /// Why an episode has no outcome.
    no_outcome: Option<TickError>,
    /// The next tick to run.
    tick: u64,
}

/// A simulated robot, with the controllers that have given it the same commands so far.
struct Branch<'a> {
    plant: Plant,
    episodes: Vec<Episode<'a>>,
}

/// One controller in the trial.
struct Episode<'a> {
    /// Index of the controller.
    index: usize,
    pilot: Pilot<'a>,
    referee: Referee,
    decided_at_s: Option<f64>,
}

/// A controller with its last command.
struct Pilot<'a> {
    robot: &'a Robot,
    /// Natural frequency of the robot's pendulum (rad/s).
    omega: f64,
    controller: Box<dyn Controller>,
    command: Command,
    /// The failure that ended the episode, if there was one.
    failure: Option<Failure>,
    /// An error that says nothing about the controller, so that the episode has no outcome.
    no_outcome: Option<TickError>,
}

/// Runs one episode of `robot`, for which the controller is made, with the variation and the pushes of `disturbance`.
/// The same arguments give the same record, to the bit. Errors are those of [`ClosedLoop::finish`].
pub fn run(
    robot: &Robot,
    factory: &PreparedController,
    config: &EpisodeConfig,
    disturbance: Disturbance,
    until: Until,
    observe: &mut dyn FnMut(&Tick),
) -> Result<Record> {
    let closed_loop = ClosedLoop::new(robot, [factory], config, disturbance);
    Ok(closed_loop
        .until(until, 0.0)
        .watched(&mut |_, tick| observe(tick))?
        .remove(0))
}

impl<'a> ClosedLoop<'a> {
    /// Starts at home and at rest, in the engine of the settings. The controllers are made for `robot`; the simulated
    /// robot has the variation of this trial. Episodes end as the settings say.
    pub fn new<'f>(
        robot: &'a Robot,
        factories: impl IntoIterator<Item = &'f PreparedController>,
        config: &'a EpisodeConfig,
        disturbance: Disturbance,
    ) -> Self {
        let entrants = factories
            .into_iter()
            .map(|factory| (factory, config.engine));
        Self::of_entrants(robot, entrants, config, disturbance)
    }

    /// As [`new`](Self::new), with an engine for each controller, which must [take](Engine::check) the robot.
    pub fn of_entrants<'f>(
        robot: &'a Robot,
        entrants: impl IntoIterator<Item = (&'f PreparedController, Engine)>,
        config: &'a EpisodeConfig,
        disturbance: Disturbance,
    ) -> Self {
        let Disturbance {
            pushes,
            sensor_errors,
            variation,
            seed,
        } = disturbance;
        let (omega, home) = (Units::of(robot).omega(), robot.home_command());
        let (ground, entrants) = (
            Ground::new(robot, &variation),
            entrants.into_iter().collect::<Vec<_>>(),
        );
        let mut branches: Vec<Branch> = Vec::new();
        for (index, &(factory, engine)) in entrants.iter().enumerate() {
            let alike = branches.iter().position(|branch| {
                let (_, other) = entrants[branch.episodes[0].index];
                other == engine
            });
            let branch = alike.unwrap_or_else(|| {
                let simulated = variation.robot(robot);
                let mut plant = Plant::on(
                    ground,
                    simulated,
                    EpisodeConfig { engine, ..*config }.clock(),
                    sensor_errors.clone(),
                    home.clone(),
                );
                // A bob hangs drawn back from the start on.
                pushes.iter().for_each(|push| plant.hang(push));
                branches.push(Branch {
                    plant,
                    episodes: Vec::new(),
                });
                branches.len() - 1
            });
            let Branch { plant, episodes } = &mut branches[branch];
            episodes.push(Episode {
                index,
                pilot: Pilot {
                    robot,
                    omega,
                    controller: factory.start(seed),
                    command: home.clone(),
                    failure: None,
                    no_outcome: None,
                },
                referee: Referee::new(robot, plant.robot(), config, &pushes),
                decided_at_s: None,
            });
        }
        let records = vec![None; entrants.len()];
        Self {
            config,
            until: config.until(),
            aftermath_s: 0.0,
            pushes,
            branches,
            records,
            no_outcome: None,
            tick: 0,
        }
    }

    /// Changes when episodes end: they are decided as `until` says, and continue for `aftermath_s` (s) after that, but
    /// not beyond the horizon. Records do not depend on the time after the decision.
    pub fn until(self, until: Until, aftermath_s: f64) -> Self {
        Self {
            until,
            aftermath_s,
            ..self
        }
    }

    /// Runs the ticks that cannot be affected by a push that starts at `push_s` (s) or later.
    pub fn before(mut self, push_s: f64) -> Self {
        // One tick to spare, for the rounding of times.
        let last = (push_s / self.config.control_period_s).floor() as u64;
        while self.tick + 1 < last && self.decide(&mut |_, _| {}) {
            self.advance();
        }
        self
    }

    /// A copy with some of the controllers, given by their numbers in ascending order, and with `pushes`. No push may
    /// start before the time to which this loop has been run. It is None if a controller cannot be copied.
    pub fn with(&self, controllers: &[usize], pushes: Vec<Push>) -> Option<Self> {
        let mut branches = Vec::new();
        for branch in &self.branches {
            let wanted = branch
                .episodes
                .iter()
                .filter(|episode| controllers.contains(&episode.index));
            let episodes = wanted
                .map(|episode| episode.fork(&pushes))
                .collect::<Option<Vec<_>>>()?;
            if !episodes.is_empty() {
                branches.push(Branch {
                    plant: branch.plant.clone(),
                    episodes,
                });
            }
        }
        let mut records = self.records.clone();
        for (index, record) in records.iter_mut().enumerate() {
            record.take_if(|_| !controllers.contains(&index));
        }
        let Self {
            config,
            until,
            aftermath_s,
            tick,
            ..
        } = *self;
        let no_outcome = self.no_outcome.clone();
        Some(Self {
            config,
            until,
            aftermath_s,
            pushes,
            branches,
            records,
            no_outcome,
            tick,
        })
    }

    /// Runs all episodes to their ends, and returns their records in the order of the controllers. It fails if the
    /// machine lacks something that a controller needs, if the program that it depends on has ended, or if somebody asked
    /// to stop while an answer was waited for. Then no episode has an outcome.
    pub fn finish(self) -> Result<Vec<Record>> {
        self.watched(&mut |_, _| {})
    }

    /// Runs as [`finish`](Self::finish) does, and shows every tick of every controller, given by its number, to
    /// `observe`.
    pub fn watched(mut self, observe: &mut dyn FnMut(usize, &Tick)) -> Result<Vec<Record>> {
        let ticks = (self.config.horizon_s / self.config.control_period_s).round() as u64;
        while self.decide(observe) && self.tick < ticks {
            self.advance();
        }
        self.has_outcomes()?;
        for episode in self.branches.into_iter().flat_map(|branch| branch.episodes) {
            self.records[episode.index] = Some(episode.referee.finish());
        }
        Ok(self.records.into_iter().flatten().collect())
    }

    /// Fails if an episode ended without an outcome, as [`finish`](Self::finish) does.
    pub fn has_outcomes(&self) -> Result<()> {
        match &self.no_outcome {
            None => Ok(()),
            Some(TickError::Interrupted) => Err(Error::Interrupted),
            Some(TickError::Ended(problem)) => Err(Error::Ended(problem.clone())),
            Some(error) => Err(Error::Machine(error.to_string())),
        }
    }

    /// Runs the controllers for the present tick. Episodes that are over end, and controllers with different commands
    /// get robots of their own. Returns false if no episode is left, or if one has ended without an outcome. It must be
    /// called once per control period, before [`advance`](Self::advance).
    pub fn decide(&mut self, observe: &mut dyn FnMut(usize, &Tick)) -> bool {
        for Branch {
            mut plant,
            episodes,
        } in std::mem::take(&mut self.branches)
        {
            let sensed = plant.sense();
            let mut parted: Vec<Vec<Episode>> = Vec::new();
            for mut episode in episodes {
                let mut tick = episode.pilot.tick(&sensed, plant.truth());
                tick.is_after = episode.decided_at_s.is_some();
                observe(episode.index, &tick);
                if !tick.is_after {
                    episode.referee.watch(&tick);
                    episode.decided_at_s = episode
                        .referee
                        .is_over(self.until)
                        .then_some(tick.truth.time_s);
                }
                let ends_s = episode.decided_at_s.map(|at_s| at_s + self.aftermath_s);
                if tick.is_broken() || ends_s.is_some_and(|ends_s| tick.truth.time_s >= ends_s) {
                    self.records[episode.index] = Some(episode.referee.finish());
                    self.no_outcome = self.no_outcome.take().or(episode.pilot.no_outcome);
                    continue;
                }
                match parted
                    .iter_mut()
                    .find(|others| others[0].pilot.command.is_same(&episode.pilot.command))
                {
                    Some(others) => others.push(episode),
                    None => parted.push(vec![episode]),
                }
            }
            let last = parted.pop();
            for episodes in parted {
                self.branches.push(Branch {
                    plant: plant.clone(),
                    episodes,
                });
            }
            if let Some(episodes) = last {
                self.branches.push(Branch { plant, episodes });
            }
        }
        !self.branches.is_empty() && self.no_outcome.is_none()
    }

    /// Simulates the control period that follows.
    pub fn advance(&mut self) {
        for Branch { plant, episodes } in &mut self.branches {
            if let Err(panic) =
                caught(|| plant.advance(episodes[0].pilot.command.clone(), &self.pushes))
            {
                let failure = Failure::OfSimulation(panic);
                for episode in episodes {
                    episode.pilot.failure = Some(failure.clone());
                }
            }
        }
        self.tick += 1;
    }

    /// Adds a push, which may start now or later.
    pub fn push(&mut self, push: Push) {
        self.pushes.push(push);
    }

    /// Pulls at a link of every robot from the next physics step on. None ends the pull.
    pub fn pull(&mut self, pull: Option<Pull>) {
        for branch in &mut self.branches {
            branch.plant.pull = pull;
        }
    }

    /// Judges anew from now on, for example after a push that was not planned.
    pub fn judge_anew(&mut self) {
        let (config, pushes) = (self.config, &self.pushes);
        for branch in &mut self.branches {
            for episode in &mut branch.episodes {
                let simulated = Arc::clone(&episode.referee.robot);
                episode.referee = Referee::new(episode.pilot.robot, simulated, config, pushes);
                episode.decided_at_s = None;
            }
        }
    }

    /// The controllers of the episodes that have not ended, to be measured or replaced.
    pub fn controllers(&mut self) -> impl Iterator<Item = &mut Box<dyn Controller>> {
        self.branches
            .iter_mut()
            .flat_map(|branch| &mut branch.episodes)
            .map(|episode| &mut episode.pilot.controller)
    }

    /// The record of a controller up to now.
    pub fn record(&self, index: usize) -> &Record {
        let mut going_on = self.branches.iter().flat_map(|branch| &branch.episodes);
        let record = going_on
            .find(|episode| episode.index == index)
            .map(|episode| &episode.referee.record);
        record
            .or(self.records[index].as_ref())
            .expect("an episode goes on or has ended")
    }
}

impl<'a> Episode<'a> {
    /// A copy with other pushes. It is None if the controller cannot be copied.
    fn fork(&self, pushes: &[Push]) -> Option<Self> {
        let Self {
            index,
            pilot,
            referee,
            decided_at_s,
        } = self;
        let mut referee = referee.clone();
        referee.expect(pushes);
        let Pilot {
            robot,
            omega,
            controller,
            command,
            failure,
            no_outcome,
        } = pilot;
        let (command, failure, no_outcome) = (command.clone(), failure.clone(), no_outcome.clone());
        let pilot = Pilot {
            robot,
            omega: *omega,
            controller: controller.fork()?,
            command,
            failure,
            no_outcome,
        };
        Some(Self {
            index: *index,
            pilot,
            referee,
            decided_at_s: *decided_at_s,
        })
    }
}

impl Pilot<'_> {
    /// Computes the command from the readings of this tick. `truth` is the state at which they were taken.
    fn tick<'t>(&'t mut self, sensed: &Sensed, truth: &'t Truth) -> Tick<'t> {
        let Self {
            robot,
            omega,
            controller,
            command,
            failure,
            no_outcome,
        } = self;
        // If the controller refuses its readings, the last command holds. A state with a NaN ends the episode as
        // diverged.
        if failure.is_none() {
            let joints = robot.joints.len();
            let ticked = caught(|| {
                controller
                    .tick(sensed, command)
                    .and_then(|()| Ok(command.check(joints)?))
            });
            match ticked {
                Ok(Ok(())) => {}
                Ok(Err(error)) if error.is_final() => {
                    *failure = Some(Failure::OfController(error.to_string()));
                    *no_outcome = Some(error).filter(TickError::is_no_outcome);
                }
                Ok(Err(error)) => log::debug!("{:.3} s: {error}", truth.time_s),
                Err(panic) => *failure = Some(Failure::OfController(panic)),
            }
        }
        let failure = failure.as_ref();
        let tick = Tick::new(robot, *omega, truth, controller.report(), command);
        Tick {
            failure,
            controller: Some(&**controller),
            ..tick
        }
    }
}

/// The result of `work` or, if it panics, the message of the panic: a numerical failure ends an episode, never a
/// campaign. Data that `work` has changed must not be used after a panic.
pub fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| {
        let text = panic.downcast_ref::<&str>().map(|text| text.to_string());
        let text = text.or_else(|| panic.downcast_ref::<String>().cloned());
        let line: String = text.iter().flat_map(|text| text.lines()).take(1).collect();
        format!(
            "panic: {:.120}",
            if line.is_empty() {
                "without a message"
            } else {
                &line
            }
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::episode::Outcome;
    use standfast_core::socket::{Report, TickError};

    type Wrong = fn(&mut Command) -> Result<(), TickError>;

    /// A controller that does something wrong at one tick, and holds the posture at all others.
    struct Faulty {
        tick: u64,
        wrong: Wrong,
    }

    impl Controller for Faulty {
        fn tick(&mut self, _: &Sensed, command: &mut Command) -> Result<(), TickError> {
            self.tick += 1;
            if self.tick == 10 {
                (self.wrong)(command)
            } else {
                Ok(())
            }
        }

        fn report(&self) -> Report<'_> {
            Report::of_phase("faulty")
        }

        fn fork(&self) -> Option<Box<dyn Controller>> {
            None
        }
    }

    /// A mistake of a controller ends its episode, with the cause, and changes no other episode.
    #[test]
    fn what_fails_ends_the_episode_with_its_cause() {
        let robot = standfast_robots::load("ut-mu2").unwrap();
        let config = EpisodeConfig {
            horizon_s: 0.1,
            ..EpisodeConfig::of(&Units::of(&robot))
        };
        let cases: [(Wrong, &str); 6] = [
            (|_| panic!("no pivot"), "panic: no pivot"),
            (
                |_| Err(TickError::Failed("it lost its child".into())),
                "it lost its child",
            ),
            (
                |command| {
                    command.tau_ff[3] = f64::NAN;
                    Ok(())
                },
                "tau_ff[3] = NaN: is not a command; accepted: a finite number",
            ),
            (
                |command| {
                    command.q_ref.pop();
                    Ok(())
                },
                "q_ref has 19 values; accepted: one for each of the robot's 20 joints",
            ),
            (
                |command| {
                    command.gains = Some(vec![[1.0, -1.0]; 20]);
                    Ok(())
                },
                "gains[0] = -1: is not a command; accepted: 0 to 1e12",
            ),
            (|_| Err(TickError::Unsolvable), ""),
        ];
        for (wrong, cause) in cases {
            let faulty =
                PreparedController::new("faulty", "fails", move |_| Faulty { tick: 0, wrong });
            let record = run(
                &robot,
                &faulty,
                &config,
                Disturbance::default(),
                Until::Horizon,
                &mut |_| {},
            )
            .unwrap();
            if cause.is_empty() {
                assert_eq!(
                    (record.outcome, record.fall_cause),
                    (Outcome::TimedOut, None),
                    "the last command holds"
                );
                continue;
            }
            assert_eq!(
                (record.outcome, record.fall_cause.as_deref()),
                (Outcome::Failed, Some(cause))
            );
            assert!((record.end_s - 0.018).abs() < 1e-9, "{record:?}");
        }
    }
}
