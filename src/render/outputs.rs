//! One episode, and what is made of it: its story, a trace, a picture over time, a replay to watch, snapshots.

use crate::columns;
use crate::control::Design;
use crate::episode::{self, Disturbance, EpisodeConfig, Film, Record, Tick, Until};
use crate::error::{Error, Result};
use crate::files::write_atomic;
use crate::render::motion_plot::MotionPlot;
use crate::render::picture::{self, FramesOptions};
use crate::render::progress::note;
use crate::render::replay::{self, Head};
use crate::render::story::{Witness, headline, story};
use crate::render::trace::Trace;
use crate::render::{self, check_output, with_fields_of};
use crate::robot::Robot;
use crate::sim::{Push, Variation};
use serde_json::{Value, json};
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
        let Some(frames) = &self.frames else { return Ok(()) };
        picture::check_folder(frames)?;
        // A folder of frames holds nothing else.
        for (option, path, _) in kinds {
            if let Some(path) = path.as_ref().filter(|path| is_in(path, frames) || *path == frames) {
                let accepted = "a file in another folder";
                return Err(Error::value(
                    "arguments",
                    option,
                    path.display(),
                    if path == frames { "it is the folder of --frames" } else { "it is in the folder of --frames" },
                    accepted,
                ));
            }
        }
        Ok(())
    }

    /// Whether any is asked for.
    pub fn is_empty(&self) -> bool {
        [&self.trace, &self.plot, &self.replay, &self.frames].into_iter().all(Option::is_none)
    }

    /// Draws the snapshots if they are asked for.
    pub fn write_frames(&self, told: &Told) -> Result<()> {
        if let (Some(folder), Some(film)) = (&self.frames, &told.film) {
            picture::write_frames(film, folder, &FramesOptions::default())?;
        }
        Ok(())
    }

    /// Says what is written.
    pub fn say_written(&self) {
        for path in [&self.trace, &self.plot, &self.replay].into_iter().flatten() {
            note(&format!("written: {}", path.display()));
        }
        if let Some(folder) = &self.frames {
            note(&format!("written: {}: frame-*.png, strip.png, motion.gif", folder.display()));
        }
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
    pub pushes: Vec<Push>,
    pub variation: Variation,
    pub record: Record,
    /// In a few lines.
    pub story: String,
    /// If there is something to show.
    pub film: Option<Film>,
}

impl Case<'_> {
    /// Runs one episode, writes what is asked for and returns what to print. `command`: what made it, for the replay.
    pub fn run(&self, disturbance: Disturbance, outputs: &Outputs, as_json: bool, command: String) -> Result<String> {
        outputs.check()?;
        let told = self.tell(disturbance, outputs)?;
        if let Some(path) = &outputs.replay {
            write_replay(&told, path, Origin { command, ..Origin::default() })?;
        }
        outputs.write_frames(&told)?;
        outputs.say_written();
        Ok(if as_json { render::json(&self.as_json(&told)) } else { told.story })
    }

    /// Runs one episode, writes trace and plot if they are asked for, and tells what happened.
    pub fn tell(&self, disturbance: Disturbance, outputs: &Outputs) -> Result<Told> {
        let Self { robot, design, config } = *self;
        let (pushes, variation) = (disturbance.pushes.clone(), disturbance.variation);
        let mut trace = outputs.trace.as_ref().map(|_| Trace::new(robot));
        let simulated = variation.robot(robot);
        let spans = pushes.iter().map(|push| [push.start_s, push.end_s()]).collect();
        let mut plot = outputs.plot.as_ref().map(|_| MotionPlot { pushes: spans, ..MotionPlot::default() });
        let mut witness = Witness::default();
        let mut observe = |tick: &Tick| {
            witness.watch(&simulated, tick);
            trace.iter_mut().for_each(|t| t.push(tick));
            plot.iter_mut().for_each(|p| p.push(robot, tick));
        };
        let until = outputs.until(config);
        let (record, film) = if outputs.replay.is_some() || outputs.frames.is_some() {
            let film = Film::take(robot, design, config, disturbance, (until, AFTERMATH_S), &mut observe);
            (film.record.clone(), Some(film))
        } else {
            (episode::run(robot, design, config, disturbance, until, &mut observe), None)
        };
        if let (Some(path), Some(trace)) = (&outputs.trace, trace) {
            columns::write(path, &trace.columns())?;
        }
        let end_s = end_of_interest_s(&record);
        if let (Some(path), Some(mut plot)) = (&outputs.plot, plot) {
            plot.end_at(end_s);
            plot.write(path, &headline(&pushes, &design.family.name, &record))?;
        }
        let story = story(&pushes, &variation, design, config, &record, &witness);
        // After a fall a plot has nothing to tell: COM and ZMP are those of a body on the ground. But a film has.
        let aftermath_s = if record.fell_at_s.is_some() { AFTERMATH_S } else { 0.0 };
        let film = film.map(|film| film.cut_at(end_s + aftermath_s));
        Ok(Told { pushes, variation, record, story, film })
    }

    /// What happened, as JSON.
    pub fn as_json(&self, told: &Told) -> Value {
        let Told { pushes, variation, record, .. } = told;
        let mut head = json!({ "gains": self.design.family.name, "push": pushes[0], "judge": self.config.judge });
        if let Some(second) = pushes.get(1) {
            head["second_push"] = json!(second);
        }
        let varied = variation.varied().into_iter();
        head["variation"] = varied.map(|(name, value)| (name.to_string(), json!(value))).collect();
        with_fields_of(head, record)
    }
}

/// Where a replay comes from.
#[derive(Debug, Default)]
pub struct Origin {
    /// What it is of, before the headline.
    pub title: Option<String>,
    /// The command that makes it.
    pub command: String,
    /// As in [`Head`].
    pub of_result: bool,
    /// What is not as it should be.
    pub warning: Option<String>,
}

/// Writes the page that shows an episode in 3D.
pub fn write_replay(told: &Told, path: &Path, origin: Origin) -> Result<()> {
    let Some(film) = &told.film else { return Ok(()) };
    let Origin { title, command, of_result, warning } = origin;
    let headline = headline(&told.pushes, &film.gain_set, &told.record);
    let title = title.map_or_else(|| headline.clone(), |title| format!("{title}: {headline}"));
    let lines = told.story.lines().map(String::from).collect();
    let head = Head { title, warning, lines, command, of_result };
    write_atomic(path, replay::page(film, &head)?.as_bytes())
}

/// Whether a file would be in a folder; both may be new.
fn is_in(file: &Path, folder: &Path) -> bool {
    let parent = file.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    matches!((parent.canonicalize(), folder.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// How long a film goes on after the episode is decided (s): a fall takes a while.
pub const AFTERMATH_S: f64 = 1.0;

/// What a picture of the episode shows after the robot stands still (s).
const REST_S: f64 = 0.5;

/// When nothing more of interest happens (s): some time after the robot stands still, and is home if it gets there.
fn end_of_interest_s(record: &Record) -> f64 {
    let settled_s = record.settled_at_s.map(|at| at.max(record.home_at_s.unwrap_or(at)) + REST_S);
    record.fell_at_s.or(settled_s).unwrap_or(record.end_s)
}
