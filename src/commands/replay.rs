//! `standfast replay`: simulates a trial of a result again and writes a page that shows it in 3D. `run` and `merge`
//! write such pages for the telling trials of a result.

use super::arguments::{MOST_TRIAL, count};
use super::episode::{FilmedEpisode, Origin, OutputArgs, film, film_both, parting, write_replay};
use super::progress::Progress;
use super::terminal::{note, print, tell};
use rayon::prelude::*;
use serde_json::json;
use standfast_controllers::turns::in_turn;
use standfast_core::error::{Error, Result};
use standfast_files::{shell_word, write_atomic};
use standfast_report::figure::skeleton;
use standfast_report::text::next_command;
use standfast_report::trial_page::replay_file;
use standfast_report::with_fields_of;
use standfast_sim::episode::parting::Parting;
use standfast_study::{Folder, StoredTrial, Summary};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(mut_arg("replay", |arg| arg.help("The page to write [default: DIR/replays/trial-I-NAME.html]")))]
#[command(after_help = "Examples:
  standfast replay standfast-results/standard --trial 17
  standfast replay results --trial 17 --controller hold --replay hold.html
  standfast replay results --trial 17 --controller hold --controller catch
  standfast replay results --trial 17 --controller catch@mujoco   another engine

A second controller is a ghost beside the first; trace and plot are those of the
first. A name with @ENGINE may also be of a controller that the result has in
another engine.

A controller that is a program is started out of the result's folder. If this
machine has not made its files, you are asked first; where there is no terminal,
--run-inputs allows it.")]
pub struct ReplayArgs {
    /// Result folder of `run`
    pub dir: PathBuf,
    /// Number of the trial
    #[arg(long, value_name = "I", value_parser = count::<u64>(0..=MOST_TRIAL))]
    pub trial: u64,
    /// Controller in the result, or two [default: the first that lost]
    #[arg(long = "controller", alias = "gains", value_name = "NAME")]
    pub gains: Vec<String>,
    #[command(flatten)]
    pub outputs: OutputArgs,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
}

/// Simulates the trial again, writes its page and the other files that were asked for, and prints what happened.
pub fn run(args: &ReplayArgs) -> Result<ExitCode> {
    let mut outputs = args.outputs.clone();
    outputs.check()?;
    if args.gains.len() > 2 {
        return Err(Error::option(
            "--controller",
            args.gains.join(", "),
            "are too many",
            "one or two",
        ));
    }
    let replayed = StoredTrial::open(
        &args.dir,
        args.trial,
        args.gains.first().map(String::as_str),
    )?;
    let ghost = match args.gains.get(1) {
        Some(name) => Some(StoredTrial::open(&args.dir, args.trial, Some(name))?),
        None => None,
    };
    let shown: Vec<&StoredTrial> = std::iter::once(&replayed).chain(&ghost).collect();
    let names: Vec<&str> = shown.iter().map(|shown| &shown.controller[..]).collect();
    let path = match outputs.replay.clone() {
        Some(path) => path,
        None => page_in(&args.dir, args.trial, &names.join("-"))?,
    };
    outputs.replay = Some(path.clone());
    if args.gains.is_empty() && replayed.controllers.len() > 1 {
        tell(
            "",
            &format!(
                "This shows controller {}; --controller NAME shows another of: {}.",
                replayed.controller,
                replayed.controllers.join(", ")
            ),
        );
    }
    for shown in shown.iter().filter(|shown| shown.row.is_none()) {
        note(&format!(
            "This trial of {} is not in the result, so there is nothing to compare it with.",
            shown.controller
        ));
    }
    let (shown, ghost_shown) = match &ghost {
        Some(ghost) => {
            let both = [replayed.episode(), ghost.episode()];
            let [shown, ghost] = film_both(both, || replayed.disturbance(), &outputs)?;
            (shown, Some(ghost))
        }
        None => (
            film(replayed.episode(), replayed.disturbance(), &outputs)?,
            None,
        ),
    };
    let page = Page {
        replayed: &replayed,
        ghost: ghost.as_ref(),
        folder: args.outputs.replay.is_some().then_some(args.dir.as_path()),
    };
    page.write(&shown, ghost_shown.as_ref(), &path)?;
    let (report, film) = &shown;
    outputs.say_what_was_written();
    print(&if args.json {
        let mut head = json!({
            "trial": args.trial,
            "controller": replayed.controller,
            "engine": replayed.config.engine,
            "page": path.display().to_string(),
        });
        if let (Some(of), Some((report, ghost))) = (&ghost, &ghost_shown) {
            let names = json!({ "controller": of.controller, "engine": ghost.engine });
            head["ghost"] = with_fields_of(names, &report.as_json());
            head["parting"] = json!(Parting::of_films(film, ghost));
        }
        standfast_report::json(&with_fields_of(head, &report.as_json()))
    } else {
        let beside = ghost_shown.map(|(_, ghost)| parting(film, &ghost) + "\n");
        beside.unwrap_or_default() + &report.text()
    })?;
    Ok(ExitCode::SUCCESS)
}

struct Page<'a> {
    replayed: &'a StoredTrial,
    /// The second entrant.
    ghost: Option<&'a StoredTrial>,
    /// The result folder as its command names it; None if the page lies in there.
    folder: Option<&'a Path>,
}

impl Page<'_> {
    /// Writes the page, with a ghost of the second entrant, and warns if the trial does not end as it did in the result.
    /// Returns that warning.
    fn write(
        &self,
        shown: &FilmedEpisode,
        ghost: Option<&FilmedEpisode>,
        path: &Path,
    ) -> Result<Option<String>> {
        let (replayed, of_result) = (self.replayed, self.folder.is_none());
        let warning = replayed.difference(&shown.0.record);
        if let Some(warning) = &warning {
            log::warn!("{warning}");
        }
        let folder = self.folder.unwrap_or(Path::new(".")).display().to_string();
        let mut command = format!(
            "standfast replay {} --trial {}",
            shell_word(&folder),
            replayed.trial
        );
        for entrant in std::iter::once(replayed).chain(self.ghost) {
            command += &format!(" --controller {}", shell_word(&entrant.controller));
        }
        let mut title = format!("Trial {} of {}", replayed.trial, replayed.campaign.name);
        if ghost.is_some() {
            title += &format!(" with {}", replayed.controller);
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
    for controller in &summary.controllers {
        for telling in controller.telling.iter().take(for_each_set) {
            let page = folder
                .path
                .join(replay_file(telling.trial, &controller.name));
            if afresh || !page.is_file() {
                wanted.push((telling.trial, &controller.name));
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
        .filter_map(|(trial, controller)| {
            if stop() {
                return None;
            }
            let written = in_turn(|| write_page(&folder.path, trial, controller))
                .map_err(|error| (trial, controller, error));
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
            Err((trial, controller, error)) => {
                let problem = next_command::told(&error);
                log::warn!("no replay of trial {trial} of {controller}: {problem}");
            }
        }
    }
    replays
}

/// Simulates a trial of the result in `folder` again, and writes its page and a small picture into this folder. Returns
/// how the trial differs if it does not end as it did in the result.
fn write_page(folder: &Path, trial: u64, controller: &str) -> Result<Option<String>> {
    let (replayed, path) = (
        StoredTrial::open(folder, trial, Some(controller))?,
        page_in(folder, trial, controller)?,
    );
    let outputs = OutputArgs {
        replay: Some(path.clone()),
        ..OutputArgs::default()
    };
    let shown = film(replayed.episode(), replayed.disturbance(), &outputs)?;
    let differs = Page {
        replayed: &replayed,
        ghost: None,
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
fn page_in(result: &Path, trial: u64, controller: &str) -> Result<PathBuf> {
    let path = result.join(replay_file(trial, controller));
    let folder = path.parent().unwrap_or(result);
    std::fs::create_dir_all(folder).map_err(|source| Error::Write {
        path: folder.into(),
        source,
    })?;
    Ok(path)
}
