//! `standfast replay`: a trial of a result, to watch in 3D; and the pages for the telling trials of a result.

use crate::campaign::parts::REPLAYS;
use crate::campaign::{Folder, Replayed, Summary};
use crate::error::{Error, Result};
use crate::files::shell_word;
use crate::report::outputs::{Case, Outputs, Told, write_replay};
use crate::report::progress::note;
use rayon::prelude::*;
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
    #[arg(short, long, value_name = "FILE.html", conflicts_with = "replay")]
    pub output: Option<PathBuf>,
    #[command(flatten)]
    pub outputs: Outputs,
    /// One JSON object on stdout
    #[arg(long)]
    pub json: bool,
}

/// Runs the trial again, writes its page, and returns what to print.
pub fn run(args: &ReplayArgs) -> Result<String> {
    let mut outputs = args.outputs.clone();
    let asked = args.output.clone().or(outputs.replay.take());
    outputs.replay.clone_from(&asked);
    outputs.check()?;
    let replayed = Replayed::open(&args.dir, args.trial, args.gains.as_deref())?;
    let path = match asked {
        Some(path) => path,
        None => create_folder(&args.dir)?.join(file_name(&replayed)),
    };
    let told = tell(&replayed, &outputs)?;
    write_replay(&told, &path, Some(command(&args.dir, &replayed)), None)?;
    outputs.write_frames(&told)?;
    note(&format!("written: {}", path.display()));
    Ok(if args.json { case(&replayed).as_json(&told) } else { told.story })
}

/// Runs a trial again; says so if it is not as it was.
fn tell(replayed: &Replayed, outputs: &Outputs) -> Result<Told> {
    let told = case(replayed).tell(replayed.disturbance(), outputs)?;
    if let Some(difference) = replayed.difference(&told.film.record) {
        log::warn!("{difference}");
    }
    Ok(told)
}

fn case(replayed: &Replayed) -> Case<'_> {
    Case { robot: &replayed.robot, design: &replayed.design, config: replayed.config() }
}

fn command(folder: &Path, replayed: &Replayed) -> String {
    let [folder, set] = [&folder.display().to_string(), &replayed.set].map(|word| shell_word(word));
    format!("standfast replay {folder} --trial {} --gains {set}", replayed.trial)
}

/// Writes the pages of telling trials that are not there yet, at most so many for each set: first what it lost nearest to
/// its limit, then the hardest that it survived, then what else is telling. Returns how many are new.
///
/// `stop` is asked before each.
pub fn write_telling(
    folder: &Folder,
    summary: &Summary,
    for_each_set: usize,
    stop: &(dyn Fn() -> bool + Sync),
) -> Result<usize> {
    let path = |trial: u64, set: &str| folder.path.join(REPLAYS).join(name(trial, set));
    let mut wanted: Vec<(u64, &str)> = Vec::new();
    for set in &summary.sets {
        let mut trials: Vec<u64> = set.telling.iter().map(|telling| telling.trial).collect();
        // The hardest that it survived stands last.
        if let Some(hardest) = trials.pop() {
            trials.insert(trials.len().min(1), hardest);
        }
        wanted.extend(trials.into_iter().take(for_each_set).map(|trial| (trial, set.name.as_str())));
    }
    wanted.retain(|(trial, set)| !path(*trial, set).is_file());
    if !wanted.is_empty() {
        create_folder(&folder.path)?;
    }
    let written = wanted.par_iter().map(|&(trial, set)| {
        if stop() {
            return Ok(0);
        }
        let replayed = Replayed::open(&folder.path, trial, Some(set))?;
        let told = tell(&replayed, &Outputs::default())?;
        // As seen from the folder of the result.
        let command = command(Path::new("."), &replayed);
        write_replay(&told, &path(trial, set), Some(command), Some("../report.html#telling".into()))?;
        Ok(1)
    });
    written.sum()
}

/// The page of a trial, if it is there: its path as seen from a report in `folder`, for a set whose campaign is the file
/// `campaign` as seen from there.
pub fn found(folder: &Path, campaign: &str, trial: u64, set: &str) -> Option<String> {
    let path = Path::new(campaign).with_file_name(REPLAYS).join(name(trial, set));
    folder.join(&path).is_file().then(|| path.display().to_string())
}

fn file_name(replayed: &Replayed) -> String {
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
