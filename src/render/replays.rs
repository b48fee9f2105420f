//! `standfast replay`: a trial of a result, to watch in 3D; and the pages for the telling trials of a result.

use crate::campaign::store::folder::REPLAYS;
use crate::campaign::{Folder, StoredTrial, Summary};
use crate::error::{Error, Result};
use crate::files::shell_word;
use crate::render::outputs::{Case, Origin, Outputs, Told, write_replay};
use crate::render::progress::note;
use crate::render::{self, check_output, with_fields_of};
use rayon::prelude::*;
use serde_json::json;
use std::path::{Path, PathBuf};

/// What the command is asked.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "Examples:
  standfast replay standfast-results/standard --trial 17
  standfast replay results --trial 17 --gains hold -o hold.html
  standfast replay results --trial 17 --frames pictures     snapshots and an animated picture, too")]
pub struct ReplayArgs {
    /// Result folder of `run`
    pub dir: PathBuf,
    /// Number of the trial
    #[arg(long, value_name = "I")]
    pub trial: u64,
    /// Gain set by its name in the results [default: the first that did not recover, else the first]
    #[arg(long, value_name = "NAME")]
    pub gains: Option<String>,
    /// The page to write [default: DIR/replays/trial-I-SET.html]
    #[arg(short, long, value_name = "FILE.html")]
    pub output: Option<PathBuf>,
    /// Draw snapshots to this folder, a strip of them and an animated picture (PNG, GIF)
    #[arg(long, value_name = "DIR")]
    pub frames: Option<PathBuf>,
    /// Write every tick here
    #[arg(long, value_name = "FILE.csv|.parquet")]
    pub trace: Option<PathBuf>,
    /// Draw COM, ZMP and feet over time until all is over
    #[arg(long, value_name = "FILE.svg")]
    pub plot: Option<PathBuf>,
    /// One JSON object on stdout
    #[arg(long)]
    pub json: bool,
}

/// Runs the trial again, writes its page, and returns what to print.
pub fn run(args: &ReplayArgs) -> Result<String> {
    let ReplayArgs { frames, trace, plot, .. } = args.clone();
    let mut outputs = Outputs { frames, trace, plot, replay: None };
    args.output.iter().try_for_each(|path| check_output("--output", path, &["html"]))?;
    outputs.check()?;
    let replayed = StoredTrial::open(&args.dir, args.trial, args.gains.as_deref())?;
    let path = match args.output.clone() {
        Some(path) => path,
        None => create_folder(&args.dir)?.join(file_name(&replayed)),
    };
    let folder = args.output.is_some().then_some(args.dir.as_path());
    outputs.replay = Some(path.clone());
    if args.gains.is_none() && replayed.sets.len() > 1 {
        note(&format!("gain set {} of {}; --gains NAME for another", replayed.set, replayed.sets.join(", ")));
    }
    if replayed.row.is_none() {
        note("the result has no such trial yet: there is nothing to compare it with");
    }
    let told = case(&replayed).tell(replayed.disturbance(), &outputs)?;
    write(&replayed, &told, &path, folder)?;
    outputs.write_frames(&told)?;
    outputs.say_written();
    if !args.json {
        return Ok(told.story);
    }
    let head = json!({ "trial": args.trial, "set": replayed.set, "page": path.display().to_string() });
    Ok(render::json(&with_fields_of(head, &case(&replayed).as_json(&told))))
}

/// Writes a page, of the result in `folder` or, if there is none, among the pages of that result; says so if the trial is
/// not as it was.
fn write(replayed: &StoredTrial, told: &Told, path: &Path, folder: Option<&Path>) -> Result<()> {
    let warning = replayed.difference(&told.record);
    warning.iter().for_each(|warning| log::warn!("{warning}"));
    let of_result = folder.is_none();
    let folder = folder.unwrap_or(Path::new(".")).display().to_string();
    let [folder, set] = [&folder, &replayed.set].map(|word| shell_word(word));
    let command = format!("standfast replay {folder} --trial {} --gains {set}", replayed.trial);
    let title = format!("Trial {} of {}", replayed.trial, replayed.campaign.name);
    write_replay(told, path, Origin { title: Some(title), command, of_result, warning })
}

fn case(replayed: &StoredTrial) -> Case<'_> {
    Case { robot: &replayed.robot, design: &replayed.design, config: replayed.config() }
}

/// Writes the pages of telling trials that are not there yet, of the first so many of each set. Returns how many are new;
/// when `stop`, asked before each, says so, there are fewer. One that cannot be written is warned of and left out.
pub fn write_telling(
    folder: &Folder,
    summary: &Summary,
    for_each_set: usize,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<usize> {
    let path = |trial: u64, set: &str| folder.path.join(REPLAYS).join(name(trial, set));
    let mut wanted: Vec<(u64, &str)> = Vec::new();
    for set in &summary.sets {
        wanted.extend(set.telling.iter().take(for_each_set).map(|telling| (telling.trial, set.name.as_str())));
    }
    wanted.retain(|(trial, set)| !path(*trial, set).is_file());
    if !wanted.is_empty() {
        create_folder(&folder.path)?;
    }
    let page = |trial: u64, set: &str| {
        let (replayed, path) = (StoredTrial::open(&folder.path, trial, Some(set))?, path(trial, set));
        let outputs = Outputs { replay: Some(path.clone()), ..Outputs::default() };
        let told = case(&replayed).tell(replayed.disturbance(), &outputs)?;
        write(&replayed, &told, &path, None)
    };
    let is_written = |&&(trial, set): &&(u64, &str)| {
        let written = if stop() { return false } else { page(trial, set) };
        written.inspect_err(|error| log::warn!("no replay of trial {trial} of {set}: {error}")).is_ok()
    };
    Ok(wanted.par_iter().filter(is_written).count())
}

/// The page of a trial, if it is there: its path as seen from a report in `folder`, for a set whose campaign is the file
/// `campaign` as seen from there.
pub fn found(folder: &Path, campaign: &str, trial: u64, set: &str) -> Option<String> {
    let path = Path::new(campaign).with_file_name(REPLAYS).join(name(trial, set));
    folder.join(&path).is_file().then(|| path.display().to_string())
}

fn file_name(replayed: &StoredTrial) -> String {
    name(replayed.trial, &replayed.set)
}

/// Names of variants hold signs that not every file system takes, nor every CI service.
fn name(trial: u64, set: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.=".contains(c);
    let plain: String = set.chars().map(|c| if is_plain(c) { c } else { '-' }).collect();
    if plain == set {
        return format!("trial-{trial}-{set}.html");
    }
    let digest = crate::files::sha256_hex(set.as_bytes());
    format!("trial-{trial}-{plain}-{}.html", &digest[..8])
}

fn create_folder(result: &Path) -> Result<PathBuf> {
    let folder = result.join(REPLAYS);
    std::fs::create_dir_all(&folder).map_err(|source| Error::Write { path: folder.clone(), source })?;
    Ok(folder)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_set_has_a_file_of_its_own_that_any_system_takes() {
        let names = ["catch", "paper:stepping.alpha=2", "paper-stepping.alpha=2", "a b", "a/b"].map(|set| name(7, set));
        assert_eq!(names[0], "trial-7-catch.html");
        for (i, name) in names.iter().enumerate() {
            assert!(!name.contains([':', ' ', '/', '\\', '"', '<', '>', '|', '*', '?']), "{name}");
            assert!(!names[..i].contains(name), "{name} twice");
        }
    }
}
