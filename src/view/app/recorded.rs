//! A trial of a result, simulated again, to be watched moment by moment.

use super::plots::{Plotted, Trail};
use crate::campaign::StoredTrial;
use crate::episode::{Film, Snapshot};
use crate::error::{Error, Result};
use crate::robot::Kinematics;
use crate::view::Options;
use std::path::Path;

/// A recorded trial, and the moment that is shown.
pub struct Recorded {
    pub film: Film,
    pub trial: u64,
    /// A sentence on how it differs from the trial in the result, if it does.
    pub difference: Option<String>,
    pub trail: Trail,
    pub kinematics: Kinematics,
    /// Index into the film's snapshots.
    frame: usize,
}

impl Recorded {
    /// Simulates the trial. Fails like [`StoredTrial::open`], and for more than one gain set.
    pub fn new(folder: &Path, trial: u64, args: &Options) -> Result<Self> {
        if let [_, second, ..] = &args.gains[..] {
            let problem = "a trial of a result is shown with one gain set";
            return Err(Error::value("command line", "--gains", second, problem, "one gain set"));
        }
        let replayed = StoredTrial::open(folder, trial, args.gains.first().map(String::as_str))?;
        let disturbance = replayed.disturbance();
        let how_long = (replayed.config().until(), Film::AFTERMATH_S);
        let film = Film::take(&replayed.robot, &replayed.design, replayed.config(), disturbance, how_long, &mut |_| {});
        let difference = replayed.difference(&film.record);
        difference.iter().for_each(|difference| log::warn!("{difference}"));
        let trail = film.snapshots.iter().map(Plotted::of).collect();
        let kinematics = Kinematics::new(&film.robot);
        let mut recorded = Self { film, trial, difference, trail, kinematics, frame: 0 };
        recorded.show(0);
        Ok(recorded)
    }

    pub fn now(&self) -> &Snapshot {
        &self.film.snapshots[self.frame]
    }

    /// Time of the last snapshot (s).
    pub fn end_s(&self) -> f64 {
        self.film.snapshots[self.film.snapshots.len() - 1].time_s
    }

    /// Shows the snapshot with this index, or the last one.
    fn show(&mut self, frame: usize) {
        self.frame = frame.min(self.film.snapshots.len() - 1);
        self.kinematics.update(&self.film.robot, &self.film.snapshots[self.frame].posture);
    }

    /// Goes to the snapshot nearest to a time (s).
    pub fn seek(&mut self, time_s: f64) {
        self.show((time_s.max(0.0) / self.film.control_period_s).round() as usize);
    }

    /// Goes on by a number of ticks, or back if negative. False if this changes nothing.
    pub fn go(&mut self, ticks: i64) -> bool {
        let before = self.frame;
        self.show(usize::try_from(self.frame as i64 + ticks).unwrap_or(0));
        self.frame != before
    }

    pub fn is_at_end(&self) -> bool {
        self.frame + 1 == self.film.snapshots.len()
    }
}
