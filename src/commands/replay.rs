//! `standfast replay`: simulates a trial of a result again and writes a page that shows it in 3D. `run` and `merge`
//! write such pages for the telling trials of a result.

use super::arguments::{ENGINE_CHOICES, EngineChoice, MOST_TRIAL, check_output, count, one_of};
use super::episode::{FilmedEpisode, Origin, OutputArgs, film, film_both, write_replay};
use super::progress::Progress;
use super::terminal::{note, print, tell};
use rayon::prelude::*;
use serde_json::json;
use standfast_core::error::{Error, Result};
use standfast_files::{shell_word, write_atomic};
use standfast_report::figure::skeleton;
use standfast_report::text::ghost::{ended, parted};
use standfast_report::text::layout::entry;
use standfast_report::text::next_command;
use standfast_report::trial_page::replay_file;
use standfast_report::with_fields_of;
use standfast_sim::Engine;
use standfast_sim::episode::EpisodeRun;
use standfast_sim::episode::parting::Parting;
use standfast_study::{Folder, StoredTrial, Summary};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  standfast replay standfast-results/standard --trial 17
  standfast replay results --trial 17 --controller hold -o hold.html
  standfast replay results --trial 17 --engine both    both physics engines

A controller that is a program is started out of the result's folder. If this
machine has not made its files, you are asked first; where there is no terminal,
--run-inputs allows it.")]
pub struct ReplayArgs {
    /// Result folder of `run`
    pub dir: PathBuf,
    /// Number of the trial
    #[arg(long, value_name = "I", value_parser = count::<u64>(0..=MOST_TRIAL))]
    pub trial: u64,
    /// Controller by its name in the result [default: the first that lost the trial, or else the first]
    #[arg(long = "controller", visible_alias = "gains", value_name = "NAME")]
    pub gains: Option<String>,
    /// Physics engine that simulates the trial [default: that of the result].
    ///
    /// With `both`, the page also shows the robot in the other engine, as a ghost, and says where the two part. Trace and
    /// plot are then those of the result's engine.
    #[arg(long, value_name = "ENGINE", value_parser = one_of::<EngineChoice, 3>(ENGINE_CHOICES))]
    pub engine: Option<EngineChoice>,
    /// The page to write [default: DIR/replays/trial-I-SET.html, or trial-I-SET-ENGINE.html with another engine than the
    /// result's or both]
    #[arg(short, long, value_name = "FILE.html")]
    pub output: Option<PathBuf>,
    /// Write every control tick to this file: .csv, .parquet or .mcap (Foxglove)
    #[arg(long, value_name = "FILE")]
    pub trace: Option<PathBuf>,
    /// Draw COM, ZMP and feet over time to this file
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
}

/// Simulates the trial again, writes its page and the other files that were asked for, and prints what happened.
pub fn run(args: &ReplayArgs) -> Result<ExitCode> {
    let mut outputs = OutputArgs {
        trace: args.trace.clone(),
        plot: args.plot.clone(),
        // The page has the option `--output` in this command, which is checked below.
        replay: None,
    };
    if let Some(path) = &args.output {
        check_output("--output", path, &["html"])?;
    }
    outputs.check()?;
    let replayed = StoredTrial::open(&args.dir, args.trial, args.gains.as_deref())?;
    let own = replayed.engine();
    let engine = args.engine.and_then(EngineChoice::one).unwrap_or(own);
    let is_both = args.engine == Some(EngineChoice::Both);
    let config = replayed.config_in(engine)?;
    let other = if is_both {
        Some(replayed.config_in(engine.other())?)
    } else {
        None
    };
    let suffix = if is_both {
        Some("both")
    } else {
        (engine != own).then(|| engine.name())
    };
    let path = match args.output.clone() {
        Some(path) => path,
        None => page_in(&args.dir, args.trial, &replayed.set, suffix)?,
    };
    outputs.replay = Some(path.clone());
    if args.gains.is_none() && replayed.sets.len() > 1 {
        tell(
            "",
            &format!(
                "This shows controller {}; --controller NAME shows another of: {}.",
                replayed.set,
                replayed.sets.join(", ")
            ),
        );
    }
    if engine != own {
        let [own, engine] = [own, engine].map(Engine::title);
        tell(
            "",
            &format!("The result is of {own}, so this trial in {engine} is not compared with it."),
        );
    } else if replayed.row.is_none() {
        note("This trial is not in the result yet, so there is nothing to compare it with.");
    }
    let episode = EpisodeRun {
        robot: &replayed.robot,
        factory: &replayed.factory,
        config: &config,
    };
    let (shown, ghost) = match &other {
        Some(config) => {
            let both = [episode, EpisodeRun { config, ..episode }];
            let [shown, ghost] = film_both(both, || replayed.disturbance(), &outputs)?;
            (shown, Some(ghost))
        }
        None => (film(episode, replayed.disturbance(), &outputs)?, None),
    };
    let page = Page {
        replayed: &replayed,
        suffix,
        folder: args.output.is_some().then_some(args.dir.as_path()),
    };
    page.write(&shown, ghost.as_ref(), &path)?;
    let (report, film) = &shown;
    outputs.say_what_was_written();
    print(&if args.json {
        let mut head = json!({
            "trial": args.trial,
            "set": replayed.set,
            "engine": engine,
            "page": path.display().to_string(),
        });
        if let Some((report, ghost)) = &ghost {
            head["ghost"] = with_fields_of(json!({ "engine": ghost.engine }), &report.as_json());
            head["parting"] = json!(Parting::of_films(film, ghost));
        }
        standfast_report::json(&with_fields_of(head, &report.as_json()))
    } else {
        let beside = ghost.map(|(_, ghost)| {
            let [solid, other] = ended([film, &ghost]);
            let lines = [
                ("solid", solid),
                ("ghost", other),
                ("parting", parted(film, &ghost)),
            ];
            lines.map(|(label, what)| entry(label, &what)).concat() + "\n"
        });
        beside.unwrap_or_default() + &report.text()
    })?;
    Ok(ExitCode::SUCCESS)
}

struct Page<'a> {
    replayed: &'a StoredTrial,
    /// What its command and its default name say about engines: another one than the result's, or both.
    suffix: Option<&'a str>,
    /// The result folder as its command names it; None if the page lies in there.
    folder: Option<&'a Path>,
}

impl Page<'_> {
    /// Writes the page, with a ghost from another engine, and warns if the trial does not end as it did in the result.
    /// Returns that warning.
    fn write(
        &self,
        shown: &FilmedEpisode,
        ghost: Option<&FilmedEpisode>,
        path: &Path,
    ) -> Result<Option<String>> {
        let (
            Self {
                replayed,
                suffix,
                folder,
            },
            (report, film),
        ) = (self, shown);
        let is_same_engine = film.engine == replayed.engine();
        let warning = replayed
            .difference(&report.record)
            .filter(|_| is_same_engine);
        if let Some(warning) = &warning {
            log::warn!("{warning}");
        }
        let of_result = folder.is_none();
        let folder = folder.unwrap_or(Path::new(".")).display().to_string();
        let [folder, set] = [&folder, &replayed.set].map(|word| shell_word(word));
        let mut command = format!(
            "standfast replay {folder} --trial {} --controller {set}",
            replayed.trial
        );
        let mut title = format!("Trial {} of {}", replayed.trial, replayed.campaign.name);
        if let Some(engine) = suffix {
            command += &format!(" --engine {engine}");
        }
        if ghost.is_some() || !is_same_engine {
            title += &format!(" in {}", film.engine.title());
        }
        let origin = Origin {
            title: Some(title),
            command,
            of_result,
            warning: warning.clone(),
        };
        write_replay(shown, ghost, path, origin)?;
        Ok(warning)
    }
}

/// The pages of telling trials that were to be written.
pub struct Replays {
    pub wanted: usize,
    pub written: usize,
    /// How each of these trials differs that did not end as it did in the result.
    pub differ: Vec<String>,
    /// The first error about a command that may not be started.
    pub refused: Option<Error>,
}

/// Writes the pages of the first `for_each_set` telling trials of each controller, only those that are missing or, with
/// `afresh`, all. It asks `stop` before each page, and writes no more once this is true. A page that cannot be written
/// is left out with a warning.
pub fn write_telling(
    folder: &Folder,
    summary: &Summary,
    for_each_set: usize,
    afresh: bool,
    stop: &(dyn Fn() -> bool + Sync),
) -> Replays {
    let mut wanted: Vec<(u64, &str)> = Vec::new();
    for set in &summary.sets {
        for telling in set.telling.iter().take(for_each_set) {
            let page = folder
                .path
                .join(replay_file(telling.trial, &set.name, None));
            if afresh || !page.is_file() {
                wanted.push((telling.trial, &set.name));
            }
        }
    }
    let mut replays = Replays {
        wanted: wanted.len(),
        written: 0,
        differ: Vec::new(),
        refused: None,
    };
    if wanted.is_empty() {
        return replays;
    }
    let progress = Progress::of_each(wanted.len() as u64, "replays");
    let pages: Vec<_> = wanted
        .into_par_iter()
        .filter_map(|(trial, set)| {
            if stop() {
                return None;
            }
            let written = write_page(&folder.path, trial, set).map_err(|error| (trial, set, error));
            progress.episode();
            Some(written)
        })
        .collect();
    progress.finish();
    for page in pages {
        match page {
            Ok(differs) => {
                replays.written += 1;
                replays.differ.extend(differs);
            }
            Err((.., error @ Error::NotStarted { .. })) => _ = replays.refused.get_or_insert(error),
            Err((trial, set, error)) => {
                let problem = next_command::told(&error);
                log::warn!("no replay of trial {trial} of {set}: {problem}");
            }
        }
    }
    replays
}

/// Simulates a trial of the result in `folder` again, and writes its page and a small picture into this folder. Returns
/// how the trial differs if it does not end as it did in the result.
fn write_page(folder: &Path, trial: u64, set: &str) -> Result<Option<String>> {
    let (replayed, path) = (
        StoredTrial::open(folder, trial, Some(set))?,
        page_in(folder, trial, set, None)?,
    );
    let config = replayed.config_in(replayed.engine())?;
    let episode = EpisodeRun {
        robot: &replayed.robot,
        factory: &replayed.factory,
        config: &config,
    };
    let outputs = OutputArgs {
        replay: Some(path.clone()),
        ..OutputArgs::default()
    };
    let shown = film(episode, replayed.disturbance(), &outputs)?;
    let differs = Page {
        replayed: &replayed,
        suffix: None,
        folder: None,
    }
    .write(&shown, None, &path)?;
    write_atomic(
        &path.with_extension("svg"),
        skeleton::of_film(&shown.1).as_bytes(),
    )?;
    Ok(differs)
}

/// The path of the page of a trial in a result folder. Creates the folder of the pages.
fn page_in(result: &Path, trial: u64, set: &str, engine: Option<&str>) -> Result<PathBuf> {
    let path = result.join(replay_file(trial, set, engine));
    let folder = path.parent().unwrap_or(result);
    std::fs::create_dir_all(folder).map_err(|source| Error::Write {
        path: folder.into(),
        source,
    })?;
    Ok(path)
}
