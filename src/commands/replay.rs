//! `standfast replay`: simulates a trial of a result again and writes a page that shows it in 3D. `run` and `merge`
//! write such pages for the telling trials of a result.

use super::arguments::check_output;
use super::episode::{Case, Origin, OutputArgs, write_replay};
use super::terminal::{note, print, tell};
use crate::campaign::{Folder, StoredTrial, Summary};
use crate::episode::Film;
use crate::error::{Error, Result};
use crate::files::shell_word;
use crate::render::text::story::Told;
use crate::render::trial_page::replay_file;
use crate::render::{self, with_fields_of};
use rayon::prelude::*;
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  standfast replay standfast-results/standard --trial 17
  standfast replay results --trial 17 --gains hold -o hold.html
  standfast replay results --trial 17 --frames pictures     snapshots and a GIF")]
pub struct ReplayArgs {
    /// Result folder of `run`
    pub dir: PathBuf,
    /// Number of the trial
    #[arg(long, value_name = "I")]
    pub trial: u64,
    /// Gain set by its name in the result [default: the first that lost the trial, or else the first]
    #[arg(long, value_name = "NAME")]
    pub gains: Option<String>,
    /// The page to write [default: DIR/replays/trial-I-SET.html]
    #[arg(short, long, value_name = "FILE.html")]
    pub output: Option<PathBuf>,
    /// Draw snapshots (PNG), a strip of them and an animated picture (GIF) to this folder
    #[arg(long, value_name = "DIR")]
    pub frames: Option<PathBuf>,
    /// Write every control tick to this file
    #[arg(long, value_name = "FILE.csv|.parquet")]
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
        frames: args.frames.clone(),
        // The page has another option here, `--output`, which is checked below.
        replay: None,
    };
    args.output.iter().try_for_each(|path| check_output("--output", path, &["html"]))?;
    outputs.check()?;
    let replayed = StoredTrial::open(&args.dir, args.trial, args.gains.as_deref())?;
    let path = match args.output.clone() {
        Some(path) => path,
        None => page_in(&args.dir, args.trial, &replayed.set)?,
    };
    outputs.replay = Some(path.clone());
    if args.gains.is_none() && replayed.sets.len() > 1 {
        tell(
            "",
            &format!(
                "This shows gain set {}; --gains NAME shows another of: {}.",
                replayed.set,
                replayed.sets.join(", ")
            ),
        );
    }
    if replayed.row.is_none() {
        note("This trial is not in the result yet, so there is nothing to compare it with.");
    }
    let (told, film) = case(&replayed).tell(replayed.disturbance(), &outputs)?;
    let folder = args.output.is_some().then_some(args.dir.as_path());
    write(&replayed, &told, film.as_ref(), &path, folder)?;
    outputs.finish(film.as_ref())?;
    print(&if args.json {
        let head = json!({ "trial": args.trial, "set": replayed.set, "page": path.display().to_string() });
        render::json(&with_fields_of(head, &told.as_json()))
    } else {
        told.text()
    })?;
    Ok(ExitCode::SUCCESS)
}

/// Writes the page of a trial, and warns if the trial does not end as it did in the result. The page states the command
/// that makes it again: for the result in `folder` or, for a page that lies in the result folder (None), in this
/// folder.
fn write(replayed: &StoredTrial, told: &Told, film: Option<&Film>, path: &Path, folder: Option<&Path>) -> Result<()> {
    let warning = replayed.difference(&told.record);
    warning.iter().for_each(|warning| log::warn!("{warning}"));
    let of_result = folder.is_none();
    let folder = folder.unwrap_or(Path::new(".")).display().to_string();
    let [folder, set] = [&folder, &replayed.set].map(|word| shell_word(word));
    let command = format!("standfast replay {folder} --trial {} --gains {set}", replayed.trial);
    let title = Some(format!("Trial {} of {}", replayed.trial, replayed.campaign.name));
    film.map_or(Ok(()), |film| write_replay(told, film, path, Origin { title, command, of_result, warning }))
}

fn case(replayed: &StoredTrial) -> Case<'_> {
    Case { robot: &replayed.robot, design: &replayed.design, config: replayed.config() }
}

/// Writes the missing pages of the first `for_each_set` telling trials of each gain set, and returns the number of new
/// pages. It asks `stop` before each page, and writes no more once this is true. A page that cannot be written is left
/// out with a warning.
pub fn write_telling(
    folder: &Folder,
    summary: &Summary,
    for_each_set: usize,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<usize> {
    let mut wanted: Vec<(u64, &str)> = Vec::new();
    for set in &summary.sets {
        wanted.extend(set.telling.iter().take(for_each_set).map(|telling| (telling.trial, set.name.as_str())));
    }
    wanted.retain(|(trial, set)| !folder.path.join(replay_file(*trial, set)).is_file());
    let is_written = |&&(trial, set): &&(u64, &str)| {
        let written = if stop() { return false } else { write_page(&folder.path, trial, set) };
        written.inspect_err(|error| log::warn!("no replay of trial {trial} of {set}: {error}")).is_ok()
    };
    Ok(wanted.par_iter().filter(is_written).count())
}

/// Simulates a trial of the result in `folder` again, and writes its page into this folder.
fn write_page(folder: &Path, trial: u64, set: &str) -> Result<()> {
    let (replayed, path) = (StoredTrial::open(folder, trial, Some(set))?, page_in(folder, trial, set)?);
    let outputs = OutputArgs { replay: Some(path.clone()), ..OutputArgs::default() };
    let (told, film) = case(&replayed).tell(replayed.disturbance(), &outputs)?;
    write(&replayed, &told, film.as_ref(), &path, None)
}

/// The path of the page of a trial in a result folder. Creates the folder of the pages.
fn page_in(result: &Path, trial: u64, set: &str) -> Result<PathBuf> {
    let path = result.join(replay_file(trial, set));
    let folder = path.parent().unwrap_or(result);
    std::fs::create_dir_all(folder).map_err(|source| Error::Write { path: folder.into(), source })?;
    Ok(path)
}
