//! Runs one trial with several gain sets at once, and trials that begin alike from a shared beginning.
//!
//! All episodes of a trial start with the same robot, sensors and ground. As long as two controllers give the same
//! commands, their robots are the same to the bit, so they are simulated once: `switching` and `paper`, for example,
//! differ only from the first footstep on. When commands differ, the simulated robot is copied. Trials that differ in
//! their pushes alone are the same until the first push, so their beginning is run once and copied, too. Each record
//! is, to the bit, that of [`super::run()`].

use super::closed_loop::{Pilot, caught};
use super::config::{Disturbance, EpisodeConfig};
use super::record::Record;
use super::referee::Referee;
use crate::control::Design;
use crate::robot::{Command, Robot};
use crate::sim::{Ground, Plant, Push};

/// The episodes of one trial, one for each gain set, up to some tick.
#[derive(Clone)]
pub struct Episodes<'a> {
    config: &'a EpisodeConfig,
    pushes: Vec<Push>,
    branches: Vec<Branch<'a>>,
    /// The records of the episodes that have ended, in the order of the gain sets.
    records: Vec<Option<Record>>,
    /// The next tick to run.
    tick: u64,
}

/// A simulated robot, with the gain sets that have given it the same commands so far.
#[derive(Clone)]
struct Branch<'a> {
    plant: Plant<'a>,
    runs: Vec<Run<'a>>,
}

/// One gain set in one trial.
#[derive(Clone)]
struct Run<'a> {
    /// Index of the gain set.
    set: usize,
    pilot: Pilot<'a>,
    referee: Referee<'a>,
}

impl<'a> Episodes<'a> {
    /// Starts at home and at rest. The designs are made for `robot`; `simulated` is its variation in this trial.
    pub fn new(
        robot: &'a Robot,
        simulated: &'a Robot,
        designs: impl IntoIterator<Item = &'a Design>,
        config: &'a EpisodeConfig,
        disturbance: Disturbance,
    ) -> Self {
        let Disturbance { pushes, sensor_errors, variation } = disturbance;
        let run = |(set, design): (usize, &'a Design)| Run {
            set,
            pilot: Pilot::new(robot, design),
            referee: Referee::new(simulated, config, &pushes),
        };
        let runs: Vec<Run> = designs.into_iter().enumerate().map(run).collect();
        let records = vec![None; runs.len()];
        let plant = |home: &Command| {
            Plant::on(Ground::new(robot, &variation), simulated, config.clock(), sensor_errors, home.clone())
        };
        // The home posture and its torques are those of the robot, whatever the gains.
        let plant = runs.first().map(|run| plant(&run.pilot.command));
        let branches = plant.map(|plant| Branch { plant, runs }).into_iter().collect();
        Self { config, pushes, branches, records, tick: 0 }
    }

    /// Runs the ticks that no push from `push_s` (s) on can affect.
    pub fn before(mut self, push_s: f64) -> Self {
        // One tick to spare, for the rounding of times.
        let last = (push_s / self.config.control_period_s).floor() as u64;
        while self.tick + 1 < last && self.decide() {
            self.advance();
        }
        self
    }

    /// A copy that goes on with some of the gain sets, given by their numbers in ascending order, and with `pushes`.
    /// None of these may start before the time to which this one has been run.
    pub fn with(&self, sets: &[usize], pushes: Vec<Push>) -> Self {
        let mut copy = self.clone();
        for branch in &mut copy.branches {
            branch.runs.retain(|run| sets.contains(&run.set));
            branch.runs.iter_mut().for_each(|run| run.referee.expect(&pushes));
        }
        copy.branches.retain(|branch| !branch.runs.is_empty());
        for (set, record) in copy.records.iter_mut().enumerate() {
            record.take_if(|_| !sets.contains(&set));
        }
        copy.pushes = pushes;
        copy
    }

    /// Runs all episodes to their ends, and returns their records in the order of the designs.
    pub fn finish(mut self) -> Vec<Record> {
        let ticks = (self.config.horizon_s / self.config.control_period_s).round() as u64;
        while self.decide() && self.tick < ticks {
            self.advance();
        }
        for run in self.branches.into_iter().flat_map(|branch| branch.runs) {
            self.records[run.set] = Some(run.referee.finish());
        }
        self.records.into_iter().flatten().collect()
    }

    /// Runs the controllers for the present tick. Episodes that are over end, and gain sets part whose commands differ.
    /// Returns false if no episode is left.
    fn decide(&mut self) -> bool {
        let until = self.config.until();
        for Branch { mut plant, runs } in std::mem::take(&mut self.branches) {
            let sensed = plant.sense();
            let mut parted: Vec<Vec<Run>> = Vec::new();
            for mut run in runs {
                let tick = run.pilot.tick(&sensed, plant.truth());
                run.referee.watch(&tick);
                if tick.is_broken() || run.referee.is_over(until) {
                    self.records[run.set] = Some(run.referee.finish());
                    continue;
                }
                match parted.iter_mut().find(|others| others[0].pilot.command.is_same(&run.pilot.command)) {
                    Some(others) => others.push(run),
                    None => parted.push(vec![run]),
                }
            }
            let last = parted.pop();
            self.branches.extend(parted.into_iter().map(|runs| Branch { plant: plant.clone(), runs }));
            self.branches.extend(last.map(|runs| Branch { plant, runs }));
        }
        !self.branches.is_empty()
    }

    /// Simulates the control period that follows.
    fn advance(&mut self) {
        for Branch { plant, runs } in &mut self.branches {
            if let Err(panic) = caught(|| plant.advance(runs[0].pilot.command.clone(), &self.pushes)) {
                runs.iter_mut().for_each(|run| run.pilot.failure = Some(panic.clone()));
            }
        }
        self.tick += 1;
    }
}
