//! What `push` and `replay` tell of one episode, and the files of it that they write: a trace, a plot over time, a page
//! to watch.

use super::arguments::check_output;
use super::terminal::note;
use serde_json::json;
use standfast_core::error::{Error, Result};
use standfast_core::robot::{Robot, Units};
use standfast_core::socket::PreparedController;
use standfast_files::{shell_word, write_atomic};
use standfast_report::observer::EpisodeObserver;
use standfast_report::replay::{self, Head};
use standfast_report::text::ghost::{ended, parted};
use standfast_report::text::layout::entry;
use standfast_report::text::story::EpisodeReport;
use standfast_sim::episode::parting::Parting;
use standfast_sim::episode::{Disturbance, EpisodeConfig, EpisodeRun, Film, Outcome};
use standfast_sim::push::three_digits;
use standfast_sim::{Engine, Push};
use standfast_study::ask::entrant::Entrant;
use standfast_study::{Campaign, Overrides, check_episode, check_steps};
use std::path::{Path, PathBuf};

/// Files to make of an episode.
#[derive(Debug, Clone, Default, clap::Args)]
pub struct OutputArgs {
    /// Write every tick: .csv, .parquet, .mcap (Foxglove)
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// Draw COM, ZMP and feet over time
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// Write a page that shows it in 3D in any browser
    #[arg(long, value_name = "FILE.html")]
    pub replay: Option<PathBuf>,
}

impl OutputArgs {
    /// Checks before the episode that its files can be written. Fails for a file of an unknown kind, or in a folder that
    /// does not exist.
    pub fn check(&self) -> Result<()> {
        let files: [(_, _, &[&str]); 3] = [
            ("--trace", &self.trace, &["csv", "parquet", "mcap"]),
            ("--plot", &self.plot, &["svg"]),
            ("--replay", &self.replay, &["html"]),
        ];
        for (option, path, kinds) in files {
            if let Some(path) = path {
                check_output(option, path, kinds)?;
            }
        }
        Ok(())
    }

    /// Fails if a file is asked for, and the episode can become so long that its ticks fill the memory.
    pub fn check_length(&self, config: &EpisodeConfig) -> Result<()> {
        if self.is_empty() {
            Ok(())
        } else {
            config.check_length()
        }
    }

    /// Whether no file is asked for.
    pub fn is_empty(&self) -> bool {
        [&self.trace, &self.plot, &self.replay]
            .into_iter()
            .all(Option::is_none)
    }

    /// Writes the page that is asked for. `command` is the command line that the page states.
    fn show(
        &self,
        shown: &FilmedEpisode,
        second: Option<&FilmedEpisode>,
        command: String,
    ) -> Result<()> {
        let origin = Origin {
            command,
            ..Origin::default()
        };
        match &self.replay {
            Some(path) => write_replay(shown, second, path, origin),
            None => Ok(()),
        }
    }

    /// Prints which files were written.
    pub fn say_what_was_written(&self) {
        for path in [&self.trace, &self.plot, &self.replay]
            .into_iter()
            .flatten()
        {
            note(&format!("written: {}", path.display()));
        }
    }

    /// An observer of the episode that writes the trace and the plot that are asked for.
    fn observer<'a>(
        &self,
        episode: EpisodeRun<'a>,
        disturbance: &Disturbance,
    ) -> Result<EpisodeObserver<'a>> {
        let [trace, plot] = [&self.trace, &self.plot].map(Option::as_deref);
        EpisodeObserver::new(episode, disturbance, trace, plot)
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

/// What happened in an episode, and its film.
pub type FilmedEpisode<'a> = (EpisodeReport<'a>, Film);

/// Where an episode takes place.
pub struct Setting {
    pub campaign: Campaign,
    pub robot: Robot,
}

impl Setting {
    /// The setting of a campaign; that of `nominal`, with ideal sensors, if none is named. Unless the pushes, the robot and
    /// the ground are to be those of a trial, there is one push from behind, and robot and ground are as designed, but for
    /// what `overrides` change. The push has the height, the duration, the start and the course of the campaign that is
    /// named, and their means where they are drawn.
    pub fn of(named: Option<&str>, overrides: Overrides, is_trial: bool) -> Result<Self> {
        let name = named.unwrap_or("nominal");
        let mut robot = Campaign::robot_files(name, &overrides)?.load()?;
        let units = Units::of(&robot);
        let mut set = Vec::new();
        if !is_trial {
            let mut push = Push::first(&units);
            let mut pendulum = None;
            if named.is_some() {
                let stated = Campaign::load_for(&robot, name, &Overrides::default())?.push;
                push.height_m = stated.height_m.mean();
                push.duration_s = stated.duration_s.mean();
                push.start_s = stated.start_s.mean();
                push.profile = stated.profile;
                pendulum = stated.pendulum;
            }
            set = match pendulum {
                Some(pendulum) => {
                    vec![format!("push.pendulum.draw_m={:?}", pendulum.draw_m.mean())]
                }
                None => vec![
                    format!("push.impulse_n_s={:?}", push.impulse_n_s),
                    format!("push.duration_s={:?}", push.duration_s),
                    format!("push.profile={}", push.profile.name()),
                ],
            };
            set.extend([
                format!("push.heading_deg={:?}", push.heading_deg),
                format!("push.height_m={:?}", push.height_m),
                format!("push.start_s={:?}", push.start_s),
                "second_push.impulse_n_s=0".into(),
                "variations={}".into(),
            ]);
        }
        if named.is_none() {
            let horizon_s = three_digits(EpisodeConfig::of(&units).horizon_s);
            set.push(format!("episode.horizon_s={horizon_s:?}"));
        }
        set.extend(overrides.set);
        let overrides = Overrides { set, ..overrides };
        let campaign = Campaign::load_for(&robot, name, &overrides)?;
        robot.pushed = campaign.push.on(&robot, &campaign.name)?;
        let setting = Self { campaign, robot };
        setting.config_in(setting.campaign.episode.engine)?;
        Ok(setting)
    }

    /// The entrants that are listed, one or two, each with its settings.
    pub fn entrants(&self, listed: &[String]) -> Result<Vec<(PreparedController, EpisodeConfig)>> {
        let mut entrants: Vec<(PreparedController, EpisodeConfig)> = Vec::new();
        for listed in listed {
            let entrant = Entrant::split(listed);
            let config = self.config_in(entrant.engine.unwrap_or(self.campaign.episode.engine))?;
            let mut factory = self.controller(entrant.controller)?;
            factory.name = entrant.of(&factory.name);
            if entrants.len() > 1 || entrants.iter().any(|(other, _)| other.name == factory.name) {
                let (problem, accepted) = (
                    "cannot be shown beside the others",
                    "one or two that differ",
                );
                return Err(Error::option("--controller", listed, problem, accepted));
            }
            entrants.push((factory, config));
        }
        Ok(entrants)
    }

    /// A controller by its name in the campaign, or by name or file.
    pub fn controller(&self, name: &str) -> Result<PreparedController> {
        let settings = standfast_controllers::load(&self.campaign.gains_named(name))?;
        if let Some(difference) = settings.trained_otherwise(&self.robot) {
            log::warn!("{name} was trained on other motors: {difference}");
        }
        let factory = settings.prepare(&self.robot, self.campaign.episode.control_period_s)?;
        if let Some(warning) = &factory.warning {
            log::warn!("{warning}");
        }
        Ok(factory)
    }

    /// The settings of an episode in an engine. Fails if the engine does not take them or the robot.
    fn config_in(&self, engine: Engine) -> Result<EpisodeConfig> {
        let config = EpisodeConfig {
            engine,
            ..self.campaign.episode
        };
        check_episode("command line", &config)?;
        engine.check(&self.robot)?;
        check_steps("command line", &config, &self.robot)?;
        Ok(config)
    }
}

/// Runs one episode, writes the files that are asked for, and returns what to print, and whether the controller failed
/// or the simulation diverged. `command` is the command line that the page of a replay states.
pub fn run(
    episode: EpisodeRun,
    disturbance: Disturbance,
    outputs: &OutputArgs,
    as_json: bool,
    command: String,
) -> Result<(String, bool)> {
    let report = if outputs.replay.is_some() {
        let shown = film(episode, disturbance, outputs)?;
        outputs.show(&shown, None, command)?;
        shown.0
    } else {
        let mut observer = outputs.observer(episode, &disturbance)?;
        let aftermath_s = outputs.aftermath_s(0.0);
        let record =
            episode.record(disturbance, aftermath_s, &mut |tick| observer.observe(tick))?;
        observer.finish(record)?
    };
    outputs.say_what_was_written();
    let text = if as_json {
        standfast_report::json(&report.as_json())
    } else {
        report.text()
    };
    Ok((text, is_broken(&report)))
}

/// Runs the same episode with two entrants, shows both, and says when they part.
pub fn run_beside(
    episodes: [EpisodeRun; 2],
    disturbance: impl Fn() -> Disturbance,
    outputs: &OutputArgs,
    as_json: bool,
    command: String,
) -> Result<(String, bool)> {
    let [shown, beside] = film_both(episodes, disturbance, outputs)?;
    outputs.show(&shown, Some(&beside), command)?;
    outputs.say_what_was_written();
    let (first, second) = (&shown.0, &beside.0);
    let text = match as_json {
        true => {
            let both = [first.as_json(), second.as_json()];
            let parting = Parting::of_films(&shown.1, &beside.1);
            standfast_report::json(&json!({ "controllers": both, "parting": parting }))
        }
        false => format!(
            "{}\n{}\n{}",
            parting(&shown.1, &beside.1),
            first.story(),
            second.text()
        ),
    };
    Ok((text, is_broken(first) || is_broken(second)))
}

/// How two films of a trial end, and when they part, in lines.
pub fn parting(solid: &Film, ghost: &Film) -> String {
    let [of_solid, of_ghost] = ended([solid, ghost]);
    let lines = [
        ("solid", of_solid),
        ("ghost", of_ghost),
        ("parting", parted(solid, ghost)),
    ];
    lines.map(|(label, what)| entry(label, &what)).concat()
}

/// Runs and films one episode, and writes trace and plot if they are asked for.
pub fn film<'a>(
    episode: EpisodeRun<'a>,
    disturbance: Disturbance,
    outputs: &OutputArgs,
) -> Result<FilmedEpisode<'a>> {
    let (report, film) = film_for(Film::AFTERMATH_S, episode, disturbance, outputs)?;
    let end_s = film.end_of_interest_s();
    Ok((report, film.cut_at(end_s)))
}

/// Films the same episode with two entrants. Both films end at the same time. Trace and plot are
/// those of the first.
pub fn film_both<'a>(
    [first, second]: [EpisodeRun<'a>; 2],
    disturbance: impl Fn() -> Disturbance,
    outputs: &OutputArgs,
) -> Result<[FilmedEpisode<'a>; 2]> {
    let first = film_for(f64::INFINITY, first, disturbance(), outputs)?;
    let second = film_for(f64::INFINITY, second, disturbance(), &OutputArgs::default())?;
    let end_s = first
        .1
        .end_of_interest_s()
        .max(second.1.end_of_interest_s());
    Ok([first, second].map(|(report, film)| (report, film.cut_at(end_s))))
}

/// Films one episode and the time (s) after it, but not beyond its horizon, and writes trace and plot.
fn film_for<'a>(
    aftermath_s: f64,
    episode: EpisodeRun<'a>,
    disturbance: Disturbance,
    outputs: &OutputArgs,
) -> Result<FilmedEpisode<'a>> {
    episode.config.check_length()?;
    let mut observer = outputs.observer(episode, &disturbance)?;
    let aftermath_s = outputs.aftermath_s(aftermath_s);
    let film = episode.film(disturbance, aftermath_s, &mut |tick| observer.observe(tick))?;
    Ok((observer.finish(film.record.clone())?, film))
}

/// Whether an episode ended because the controller failed or the simulation diverged, so that it says nothing of how
/// well the robot stands.
fn is_broken(report: &EpisodeReport) -> bool {
    matches!(report.record.outcome, Outcome::Failed | Outcome::Diverged)
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

/// Writes the page that shows an episode in 3D to `path`, with the same episode of another entrant as a ghost.
pub fn write_replay(
    (report, film): &FilmedEpisode,
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
    let headline = report.headline();
    let title = title.map_or_else(|| headline.clone(), |title| format!("{title}: {headline}"));
    let mut text = report.text();
    if let Some((other, ghost)) = ghost {
        let [first, second] = [film, ghost].map(|film| &film.controller);
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
