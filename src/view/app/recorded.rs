//! A trial of a result, simulated again, to be watched moment by moment.

use super::plots::{Plotted, Trail};
use crate::campaign::StoredTrial;
use crate::episode::{EpisodeConfig, Film, Snapshot};
use crate::error::{Error, Result};
use crate::render::text::ghost::parted;
use crate::robot::Kinematics;
use crate::view::Options;
use std::path::Path;

/// A recorded trial, with a ghost that shows it in another engine.
pub struct Recorded {
    pub shown: Reel,
    pub ghost: Option<Reel>,
    pub trial: u64,
    /// A sentence on how it differs from the trial in the result, if it does.
    pub difference: Option<String>,
    /// A sentence on where the robot and its ghost part.
    pub parted: Option<String>,
}

/// A film, and the moment of it that is shown.
pub struct Reel {
    pub film: Film,
    pub trail: Trail,
    pub kinematics: Kinematics,
    /// Index into the film's snapshots.
    frame: usize,
}

impl Reel {
    fn new(film: Film) -> Self {
        let trail = film.snapshots.iter().map(Plotted::of).collect();
        let kinematics = Kinematics::new(&film.robot);
        let mut reel = Self { film, trail, kinematics, frame: 0 };
        reel.show(0);
        reel
    }

    pub fn now(&self) -> &Snapshot {
        &self.film.snapshots[self.frame]
    }

    fn last(&self) -> usize {
        self.film.snapshots.len() - 1
    }

    /// Shows the snapshot with this index, or the last one.
    fn show(&mut self, frame: usize) {
        self.frame = frame.min(self.last());
        self.kinematics.update(&self.film.robot, &self.film.snapshots[self.frame].posture);
    }
}

impl Recorded {
    /// Simulates the trial. Fails like [`StoredTrial::open`] and [`StoredTrial::config_in`], and for more than one gain
    /// set.
    pub fn new(folder: &Path, trial: u64, args: &Options) -> Result<Self> {
        if let [_, second, ..] = &args.gains[..] {
            let problem = "a trial of a result is shown with one gain set";
            return Err(Error::option("--gains", second, problem, "one gain set"));
        }
        let replayed = StoredTrial::open(folder, trial, args.gains.first().map(String::as_str))?;
        let engine = args.engine.unwrap_or(replayed.engine());
        let config = replayed.config_in(engine)?;
        let ghost_config = if args.ghost { Some(replayed.config_in(engine.other())?) } else { None };
        // With a ghost, both films end at the same time.
        let aftermath_s = if args.ghost { f64::INFINITY } else { Film::AFTERMATH_S };
        let take = |config: &EpisodeConfig| {
            let (disturbance, how_long) = (replayed.disturbance(), (config.until(), aftermath_s));
            Film::take(&replayed.robot, &replayed.design, config, disturbance, how_long, &mut |_| {})
        };
        let (mut film, mut ghost) = (take(&config), ghost_config.as_ref().map(take));
        if let Some(beside) = ghost {
            let end_s = film.record.end_s.max(beside.record.end_s) + Film::AFTERMATH_S;
            film = film.cut_at(end_s);
            ghost = Some(beside.cut_at(end_s));
        }
        let difference = replayed.difference(&film.record).filter(|_| engine == replayed.engine());
        difference.iter().for_each(|difference| log::warn!("{difference}"));
        let parted = ghost.as_ref().map(|ghost| parted(&film, ghost));
        Ok(Self { shown: Reel::new(film), ghost: ghost.map(Reel::new), trial, difference, parted })
    }

    pub fn now(&self) -> &Snapshot {
        self.shown.now()
    }

    /// Time of the last snapshot (s).
    pub fn end_s(&self) -> f64 {
        self.shown.film.snapshots[self.shown.last()].time_s
    }

    fn show(&mut self, frame: usize) {
        std::iter::once(&mut self.shown).chain(&mut self.ghost).for_each(|reel| reel.show(frame));
    }

    /// Goes to the snapshot nearest to a time (s).
    pub fn seek(&mut self, time_s: f64) {
        self.show((time_s.max(0.0) / self.shown.film.control_period_s).round() as usize);
    }

    /// Goes on by a number of ticks, or back if negative. False if this changes nothing.
    pub fn go(&mut self, ticks: i64) -> bool {
        let before = self.shown.frame;
        // Beyond its end, a film shows its last snapshot.
        self.show(usize::try_from(before as i64 + ticks).unwrap_or(0).min(self.shown.last()));
        self.shown.frame != before
    }

    pub fn is_at_end(&self) -> bool {
        self.shown.frame == self.shown.last()
    }
}
