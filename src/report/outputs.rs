//! One episode, and what is made of it: its story, a trace, a picture over time, a replay to watch, snapshots.

use crate::columns;
use crate::control::Design;
use crate::episode::{Disturbance, EpisodeConfig, Film, Record, Until};
use crate::error::Result;
use crate::files::write_atomic;
use crate::report::motion_plot::MotionPlot;
use crate::report::picture::{self, FramesOptions};
use crate::report::replay::{self, Head};
use crate::report::story::{Witness, headline, story};
use crate::report::trace::Trace;
use crate::report::{self, check_output, with_fields_of};
use crate::robot::Robot;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Files to make of an episode.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct Outputs {
    /// Write every tick here; the episode then runs to its horizon
    #[arg(long, value_name = "FILE.csv|.parquet")]
    pub trace: Option<PathBuf>,
    /// Draw COM, ZMP and feet over time until all is over; the episode then runs to its horizon
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// Write a page that shows it in 3D: one file, for any browser, offline
    #[arg(long, value_name = "FILE.html")]
    pub replay: Option<PathBuf>,
    /// Draw snapshots to this folder, a strip of them and an animated picture (PNG, GIF)
    #[arg(long, value_name = "DIR")]
    pub frames: Option<PathBuf>,
}

impl Outputs {
    /// Errors: a file that could not be written in the end.
    pub fn check(&self) -> Result<()> {
        let kinds: [(&str, &Option<PathBuf>, &[&str]); 3] = [
            ("--trace", &self.trace, &["csv", "parquet"]),
            ("--plot", &self.plot, &["svg"]),
            ("--replay", &self.replay, &["html"]),
        ];
        for (option, path, kinds) in kinds {
            path.iter().try_for_each(|path| check_output(option, path, kinds))?;
        }
        self.frames.iter().try_for_each(|folder| picture::check_folder(folder).map(|_| ()))
    }

    /// Whether any is asked for.
    pub fn is_empty(&self) -> bool {
        [&self.trace, &self.plot, &self.replay, &self.frames].into_iter().all(Option::is_none)
    }

    /// Draws the snapshots if they are asked for.
    pub fn write_frames(&self, told: &Told) -> Result<()> {
        let Some(folder) = &self.frames else { return Ok(()) };
        picture::write_frames(&told.film, folder, &FramesOptions::default())?;
        Ok(())
    }

    /// Whether some show more than the episode up to its decision.
    fn until(&self, config: &EpisodeConfig) -> Until {
        if self.trace.is_some() || self.plot.is_some() { Until::Horizon } else { config.until() }
    }
}

/// What an episode is of.
#[derive(Clone, Copy)]
pub struct Case<'a> {
    pub robot: &'a Robot,
    pub design: &'a Design,
    pub config: &'a EpisodeConfig,
}

/// What an episode came to.
pub struct Told {
    pub film: Film,
    /// In a few lines.
    pub story: String,
}

impl Case<'_> {
    /// Runs one episode, writes what is asked for and returns what to print.
    pub fn run(&self, disturbance: Disturbance, outputs: &Outputs, as_json: bool) -> Result<String> {
        outputs.check()?;
        let told = self.tell(disturbance, outputs)?;
        if let Some(path) = &outputs.replay {
            write_replay(&told, path, None, None)?;
        }
        outputs.write_frames(&told)?;
        Ok(if as_json { self.as_json(&told) } else { told.story })
    }

    /// Runs one episode, writes trace and plot if they are asked for, and tells what happened.
    pub fn tell(&self, disturbance: Disturbance, outputs: &Outputs) -> Result<Told> {
        let Self { robot, design, config } = *self;
        let mut trace = outputs.trace.as_ref().map(|_| Trace::new(robot));
        let simulated = disturbance.variation.robot(robot);
        let spans = disturbance.pushes.iter().map(|push| [push.start_s, push.end_s()]).collect();
        let mut plot = outputs.plot.as_ref().map(|_| MotionPlot { pushes: spans, ..MotionPlot::default() });
        let mut witness = Witness::default();
        let how_long = (outputs.until(config), AFTERMATH_S);
        let mut film = Film::take(robot, design, config, disturbance, how_long, &mut |tick| {
            witness.watch(&simulated, tick);
            trace.iter_mut().for_each(|t| t.push(tick));
            plot.iter_mut().for_each(|p| p.push(robot, tick));
        });
        let Film { pushes, variation, record, .. } = &film;
        if let (Some(path), Some(trace)) = (&outputs.trace, trace) {
            columns::write(path, &trace.columns())?;
        }
        if let (Some(path), Some(mut plot)) = (&outputs.plot, plot) {
            plot.end_at(end_of_interest_s(record));
            plot.write(path, &headline(pushes, &design.family.name, record))?;
        }
        let story = story(pushes, variation, design, config, record, &witness);
        // After a fall a plot has nothing to tell: COM and ZMP are those of a body on the ground. But a film has.
        film.cut_at(end_of_interest_s(&film.record) + if film.record.fell_at_s.is_some() { AFTERMATH_S } else { 0.0 });
        Ok(Told { film, story })
    }

    /// One JSON object.
    pub fn as_json(&self, told: &Told) -> String {
        let Film { pushes, variation, record, .. } = &told.film;
        let mut head = json!({ "gains": self.design.family.name, "push": pushes[0], "judge": self.config.judge });
        if let Some(second) = pushes.get(1) {
            head["second_push"] = json!(second);
        }
        let varied = variation.varied().into_iter();
        head["variation"] = varied.map(|(name, value)| (name.to_string(), json!(value))).collect();
        report::json(&with_fields_of(head, record))
    }
}

/// Writes the page that shows an episode in 3D, with the command that makes it, and the page to go back to.
pub fn write_replay(told: &Told, path: &Path, command: Option<String>, back: Option<String>) -> Result<()> {
    let Film { pushes, gain_set, record, .. } = &told.film;
    let title = headline(pushes, gain_set, record);
    let lines = told.story.lines().map(String::from).collect();
    let head = Head { title, lines, command, back, ..Head::default() };
    write_atomic(path, replay::page(&told.film, &head)?.as_bytes())
}

/// How long a film goes on after the episode is decided (s).
const AFTERMATH_S: f64 = 1.0;

/// What a picture of the episode shows after the robot stands still (s).
const REST_S: f64 = 0.5;

/// When nothing more of interest happens (s): some time after the robot stands still, and is home if it gets there.
fn end_of_interest_s(record: &Record) -> f64 {
    let settled_s = record.settled_at_s.map(|at| at.max(record.home_at_s.unwrap_or(at)) + REST_S);
    record.fell_at_s.or(settled_s).unwrap_or(record.end_s)
}
