//! Runs one episode for `push` and `replay`, tells what happened, and writes the files that were asked for: a trace, a
//! plot over time, a page to watch, snapshots.

use super::arguments::check_output;
use super::terminal::note;
use serde_json::json;
use standfast_core::error::{Error, Result};
use standfast_core::robot::{PreparedController, Robot, Units};
use standfast_files::assets::DEFAULT_ROBOT;
use standfast_files::columns;
use standfast_files::{folder_of, is_same_folder, shell_word, write_atomic};
use standfast_pictures::FramesOptions;
use standfast_report::figure::motion::MotionPlot;
use standfast_report::mcap::McapTrace;
use standfast_report::replay::{self, Head};
use standfast_report::text::ghost::names;
use standfast_report::text::story::{EpisodeReport, Witness};
use standfast_report::trace::Trace;
use standfast_sim::episode::{ClosedLoop, Disturbance, EpisodeConfig, Film, Outcome, Record, Tick};
use standfast_sim::push::three_digits;
use standfast_study::{Campaign, Overrides, check_episode, check_steps};
use std::path::{Path, PathBuf};

/// How long plots, films and pictures go on after the robot has come to stand still (s).
const REST_S: f64 = 0.5;

/// Most control ticks of an episode that is written or drawn.
const MOST_TICKS: f64 = 200_000.0;

/// Files to make of an episode.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct OutputArgs {
    /// Write every control tick up to the horizon: .csv, .parquet, .mcap (Foxglove)
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// Draw COM, ZMP and feet over time to this file
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// Write a page that shows the episode in 3D, in any browser
    #[arg(long, value_name = "FILE.html")]
    pub replay: Option<PathBuf>,
    /// Draw snapshots and an animated picture to this folder
    #[arg(long, value_name = "DIR")]
    pub frames: Option<PathBuf>,
}

impl OutputArgs {
    /// Checks before the episode that its files can be written. Fails for a file of an unknown kind, in a folder that
    /// does not exist or in the folder of `--frames`, and if the folder of `--frames` holds other files.
    pub fn check(&self) -> Result<()> {
        let files = [
            ("--trace", &self.trace),
            ("--plot", &self.plot),
            ("--replay", &self.replay),
        ];
        let kinds: [&[&str]; 3] = [&["csv", "parquet", "mcap"], &["svg"], &["html"]];
        for ((option, path), kinds) in files.into_iter().zip(kinds) {
            path.iter()
                .try_for_each(|path| check_output(option, path, kinds))?;
        }
        let Some(frames) = &self.frames else {
            return Ok(());
        };
        standfast_pictures::check_folder(frames)?;
        // The folder of `--frames` may hold nothing else: a second run would refuse to write to it.
        for (option, path) in files {
            let problem = match path {
                Some(path) if path == frames => "it is the folder of --frames",
                Some(path) if is_same_folder(folder_of(path), frames) => {
                    "it is in the folder of --frames"
                }
                _ => continue,
            };
            let path = path.as_deref().unwrap_or(frames);
            return Err(Error::option(
                option,
                path.display(),
                problem,
                "a file in another folder",
            ));
        }
        Ok(())
    }

    /// Fails if a file is asked for, and the episode can become so long that its ticks fill the memory.
    pub fn check_length(&self, config: &EpisodeConfig) -> Result<()> {
        if self.is_empty() {
            Ok(())
        } else {
            check_length(config)
        }
    }

    /// Whether no file is asked for.
    pub fn is_empty(&self) -> bool {
        [&self.trace, &self.plot, &self.replay, &self.frames]
            .into_iter()
            .all(Option::is_none)
    }

    /// Draws the snapshots of a film if they are asked for, with the snapshots of a second film of the same trial.
    pub fn draw_frames(&self, film: &Film, second: Option<&Film>) -> Result<()> {
        let draw = |folder: &PathBuf| {
            standfast_pictures::write_frames(film, second, folder, &FramesOptions::default())
                .map(|_| ())
        };
        self.frames.as_ref().map_or(Ok(()), draw)
    }

    /// Writes the page and the snapshots that are asked for. `command` is the command line that the page states.
    fn show(
        &self,
        shown: &FilmedEpisode,
        second: Option<&FilmedEpisode>,
        command: String,
    ) -> Result<()> {
        if let Some(path) = &self.replay {
            write_replay(
                shown,
                second,
                path,
                Origin {
                    command,
                    ..Origin::default()
                },
            )?;
        }
        self.draw_frames(&shown.1, second.map(|(_, film)| film))
    }

    /// Prints which files were written.
    pub fn say_what_was_written(&self) {
        for path in [&self.trace, &self.plot, &self.replay]
            .into_iter()
            .flatten()
        {
            note(&format!("written: {}", path.display()));
        }
        if let Some(folder) = &self.frames {
            note(&format!(
                "written: {}: frame-*.png, strip.png, motion.gif",
                folder.display()
            ));
        }
    }

    /// For how long (s) the episode is simulated after it is decided, if nothing else needs more than `aftermath_s`. A
    /// trace and a plot show it up to its horizon.
    fn aftermath_s(&self, aftermath_s: f64) -> f64 {
        if self.trace.is_some() || self.plot.is_some() {
            f64::INFINITY
        } else {
            aftermath_s
        }
    }
}

/// Fails if an episode can become so long that its ticks fill the memory.
fn check_length(config: &EpisodeConfig) -> Result<()> {
    let most_s = MOST_TICKS * config.control_period_s;
    if config.horizon_s <= most_s {
        return Ok(());
    }
    let problem = "is too long to be kept tick by tick, for a trace, plot, film or replay";
    Err(Error::value(
        "episode",
        "horizon_s",
        config.horizon_s,
        problem,
        format!("up to {most_s}"),
    ))
}

/// What happened in an episode, and its film.
pub type FilmedEpisode<'a> = (EpisodeReport<'a>, Film);

/// Where an episode takes place.
pub struct Setting {
    /// The campaign, if one is named.
    pub campaign: Option<Campaign>,
    pub robot: Robot,
    pub config: EpisodeConfig,
}

impl Setting {
    /// The setting of a campaign, or the usual one. `overrides` have the robot and the engine, and change the campaign,
    /// too; `horizon_s` is the length of the episode (s). Fails if these do not fit together.
    pub fn of(
        campaign: Option<&str>,
        overrides: &Overrides,
        horizon_s: Option<f64>,
    ) -> Result<Self> {
        let campaign = campaign
            .map(|name| Campaign::load(name, overrides))
            .transpose()?;
        let robot_name = overrides
            .robot
            .as_ref()
            .or(campaign.as_ref().map(|c| &c.robot));
        let robot = standfast_robots::load(robot_name.map_or(DEFAULT_ROBOT, String::as_str))?;
        let mut config = campaign
            .as_ref()
            .map_or_else(|| EpisodeConfig::of(&Units::of(&robot)), |c| c.episode);
        if campaign.is_none() {
            config.horizon_s = three_digits(config.horizon_s);
        }
        config.engine = overrides.engine.unwrap_or(config.engine);
        config.judge.counts = overrides.judge.unwrap_or(config.judge.counts);
        config.horizon_s = horizon_s.unwrap_or(config.horizon_s);
        let standing_s = config.judge.standing_time_s;
        if let Some(horizon_s) = horizon_s.filter(|horizon_s| *horizon_s < standing_s) {
            let problem = format!(
                "is too short to judge: a robot recovers by standing still for {} s",
                three_digits(standing_s)
            );
            return Err(Error::option(
                "--horizon",
                horizon_s,
                problem,
                format!("{} or more", three_digits(standing_s)),
            ));
        }
        check_episode("command line", &config)?;
        config.engine.check(&robot)?;
        check_steps("command line", &config, &robot)?;
        Ok(Self {
            campaign,
            robot,
            config,
        })
    }
}

/// Robot, controller and settings of an episode.
#[derive(Clone, Copy)]
pub struct EpisodeRun<'a> {
    pub robot: &'a Robot,
    pub factory: &'a PreparedController,
    pub config: &'a EpisodeConfig,
}

impl<'a> EpisodeRun<'a> {
    /// Runs one episode, writes the files that are asked for, and returns what to print, and whether the controller
    /// failed or the simulation diverged. `command` is the command line that the page of a replay states.
    pub fn run(
        &self,
        disturbance: Disturbance,
        outputs: &OutputArgs,
        as_json: bool,
        command: String,
    ) -> Result<(String, bool)> {
        let Self {
            robot,
            factory,
            config,
        } = *self;
        let told = if outputs.replay.is_some() || outputs.frames.is_some() {
            let shown = self.film(disturbance, outputs)?;
            outputs.show(&shown, None, command)?;
            shown.0
        } else {
            let run = |disturbance: Disturbance, aftermath_s, observe: &mut dyn FnMut(&Tick)| {
                let closed_loop = ClosedLoop::new(robot, [factory], config, disturbance);
                closed_loop
                    .until(config.until(), aftermath_s)
                    .watched(&mut |_, tick| observe(tick))
                    .map(|mut records| records.remove(0))
            };
            self.watched(disturbance, outputs, 0.0, run, Record::clone)?
                .0
        };
        outputs.say_what_was_written();
        let text = if as_json {
            standfast_report::json(&told.as_json())
        } else {
            told.text()
        };
        Ok((text, is_broken(&told)))
    }

    /// Runs the same episode with another controller, too, and shows both beside each other.
    pub fn run_beside(
        &self,
        other: &'a PreparedController,
        disturbance: impl Fn() -> Disturbance,
        outputs: &OutputArgs,
        as_json: bool,
        command: String,
    ) -> Result<(String, bool)> {
        let [shown, beside] = self.film_both(
            &Self {
                factory: other,
                ..*self
            },
            disturbance,
            outputs,
        )?;
        outputs.show(&shown, Some(&beside), command)?;
        outputs.say_what_was_written();
        let (told, other) = (&shown.0, &beside.0);
        let text = match as_json {
            true => {
                standfast_report::json(&json!({ "controllers": [told.as_json(), other.as_json()] }))
            }
            false => format!("{}\n{}", told.story(), other.text()),
        };
        Ok((text, is_broken(told) || is_broken(other)))
    }

    /// Runs and films one episode, and writes trace and plot if they are asked for.
    pub fn film(
        &self,
        disturbance: Disturbance,
        outputs: &OutputArgs,
    ) -> Result<FilmedEpisode<'a>> {
        let (told, film) = self.film_for(Film::AFTERMATH_S, disturbance, outputs)?;
        let end_s = film_end_s(&told.record);
        Ok((told, film.cut_at(end_s)))
    }

    /// Films the episode as [`Self::film`] does, and films it with the engine or controller of `other`, too. Both films
    /// end at the same time.
    pub fn film_both(
        &self,
        other: &Self,
        disturbance: impl Fn() -> Disturbance,
        outputs: &OutputArgs,
    ) -> Result<[FilmedEpisode<'a>; 2]> {
        let both = [
            self.film_for(f64::INFINITY, disturbance(), outputs)?,
            other.film_for(f64::INFINITY, disturbance(), &OutputArgs::default())?,
        ];
        let end_s = both
            .iter()
            .map(|(told, _)| film_end_s(&told.record))
            .fold(0.0, f64::max);
        Ok(both.map(|(told, film)| (told, film.cut_at(end_s))))
    }

    /// Films one episode and the time (s) after it, but not beyond its horizon.
    fn film_for(
        &self,
        aftermath_s: f64,
        disturbance: Disturbance,
        outputs: &OutputArgs,
    ) -> Result<FilmedEpisode<'a>> {
        let Self {
            robot,
            factory,
            config,
        } = *self;
        check_length(config)?;
        let take = |disturbance, aftermath_s, observe: &mut dyn FnMut(&Tick)| {
            Film::take(
                robot,
                factory,
                config,
                disturbance,
                (config.until(), aftermath_s),
                observe,
            )
        };
        self.watched(disturbance, outputs, aftermath_s, take, |film| {
            film.record.clone()
        })
    }

    /// Runs one episode and at least `aftermath_s` (s) after it by `run`, which shows every tick to the observer, and
    /// writes trace and plot if they are asked for. Returns what happened and what `run` returns, which holds the
    /// record.
    fn watched<T>(
        &self,
        disturbance: Disturbance,
        outputs: &OutputArgs,
        aftermath_s: f64,
        run: impl FnOnce(Disturbance, f64, &mut dyn FnMut(&Tick)) -> Result<T>,
        record_of: impl Fn(&T) -> Record,
    ) -> Result<(EpisodeReport<'a>, T)> {
        let Self {
            robot,
            factory,
            config,
        } = *self;
        let (pushes, variation) = (disturbance.pushes.clone(), disturbance.variation);
        let simulated = variation.robot(robot);
        let (mcap, table): (Option<&PathBuf>, _) = match &outputs.trace {
            Some(path) if path.extension().is_some_and(|ending| ending == "mcap") => {
                (Some(path), None)
            }
            table => (None, table.as_ref()),
        };
        let mut mcap = mcap
            .map(|path| McapTrace::create(path, robot))
            .transpose()?;
        let mut table = table.map(|path| (path, Trace::new(robot)));
        let mut plot = outputs
            .plot
            .as_ref()
            .map(|_| MotionPlot::of_pushes(&pushes));
        let mut witness = Witness::default();
        let mut observe = |tick: &Tick| {
            witness.watch(&simulated, tick);
            mcap.iter_mut().for_each(|mcap| mcap.push(tick));
            table.iter_mut().for_each(|(_, trace)| trace.push(tick));
            plot.iter_mut().for_each(|plot| plot.push(robot, tick));
        };
        let ran = run(disturbance, outputs.aftermath_s(aftermath_s), &mut observe)?;
        let units = Units::of(robot);
        let told = EpisodeReport {
            factory,
            config,
            units,
            pushes,
            variation,
            record: record_of(&ran),
            witness,
        };
        mcap.map_or(Ok(()), McapTrace::finish)?;
        if let Some((path, trace)) = table {
            columns::write(path, &trace.columns())?;
        }
        if let (Some(path), Some(mut plot)) = (&outputs.plot, plot) {
            plot.end_at(end_of_interest_s(&told.record));
            plot.write(path, &told.headline())?;
        }
        Ok((told, ran))
    }
}

/// Whether an episode ended because the controller failed or the simulation diverged, so that it says nothing of how
/// well the robot stands.
fn is_broken(told: &EpisodeReport) -> bool {
    matches!(told.record.outcome, Outcome::Failed | Outcome::Diverged)
}

/// Where the episode of a replay comes from.
#[derive(Debug, Default)]
pub struct Origin {
    /// What the page shows, such as "Trial 17 of standard". It precedes the headline.
    pub title: Option<String>,
    /// The command that writes this page.
    pub command: String,
    /// Whether the page lies in the result folder that its trial is from, as in [`Head`].
    pub of_result: bool,
    /// How the episode differs from the one in the result.
    pub warning: Option<String>,
}

/// Writes the page that shows an episode in 3D to `path`, with the same episode in another engine or with another
/// controller as a ghost.
pub fn write_replay(
    (told, film): &FilmedEpisode,
    ghost: Option<&FilmedEpisode>,
    path: &Path,
    origin: Origin,
) -> Result<()> {
    let Origin {
        title,
        command,
        of_result,
        warning,
    } = origin;
    let headline = told.headline();
    let title = title.map_or_else(|| headline.clone(), |title| format!("{title}: {headline}"));
    let mut text = told.text();
    if let Some((other, ghost)) = ghost {
        let [first, second] = names([film, ghost]);
        text = format!("{first}\n\n{text}\n\n{second}\n\n{}", other.text());
    }
    let head = Head {
        title,
        warning,
        lines: text.lines().map(String::from).collect(),
        command,
        of_result,
    };
    write_atomic(
        path,
        replay::page(film, ghost.map(|(_, film)| film), &head)?.as_bytes(),
    )
}

/// The command line of this process, which runs `program`, quoted for a shell.
pub fn command_line(program: &str) -> String {
    let args = std::env::args_os()
        .skip(1)
        .map(|arg| shell_word(&arg.to_string_lossy()));
    std::iter::once(program.to_string())
        .chain(args)
        .collect::<Vec<_>>()
        .join(" ")
}

/// End of a film (s). A plot ends at a fall, since COM and ZMP of a body on the ground tell nothing. A film goes on,
/// and shows how the robot comes to lie.
fn film_end_s(record: &Record) -> f64 {
    end_of_interest_s(record)
        + if record.fell_at_s.is_some() {
            Film::AFTERMATH_S
        } else {
            0.0
        }
}

/// Time (s) after which nothing of interest happens: the time of the fall or, with [`REST_S`] to spare, the time at
/// which the robot stands still and, if it gets home, is home.
fn end_of_interest_s(record: &Record) -> f64 {
    let settled_s = record
        .settled_at_s
        .map(|at| at.max(record.home_at_s.unwrap_or(at)) + REST_S);
    record.fell_at_s.or(settled_s).unwrap_or(record.end_s)
}
