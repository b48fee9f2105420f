//! `standfast slurm`: a campaign as an array of jobs on a Slurm cluster, and a merge that waits for them.
//!
//! Each task runs one shard into a folder that all nodes share. Execution is at least once: a task may be killed,
//! requeued, or submitted again with another number of shards, since a part is the same whichever task writes it.

use super::arguments::count;
use super::mujoco;
use super::result::gates_of;
use super::run::RunArgs;
use super::terminal::print;
use minijinja::{Environment, UndefinedBehavior, context};
use standfast_core::error::{Error, Result};
use standfast_files::shell_word;
use standfast_study::PreparedCampaign;
use std::ffi::OsString;
use std::path::Path;
use std::process::ExitCode;

/// Time between the request to stop and the end of a task by force (s).
const NOTICE_S: u32 = 60;
/// Largest number of times that a task is requeued.
const REQUEUES: u32 = 20;
/// Length of a task (s) on one core, unless the number of shards is given.
const TASK_S: f64 = 1200.0;

/// The script.
const SCRIPT: &str = include_str!("slurm.sh.jinja");

#[derive(Debug, clap::Args)]
#[command(mut_arg("shard", |arg| arg.hide(true)), mut_arg("dry_run", |arg| arg.hide(true)))]
#[command(after_help = "Examples:
  standfast slurm --trials 100000 --shards 64 --out /shared/a > jobs.sh
  sh jobs.sh                            array and merge: it prints their numbers
  sh jobs.sh \"$(standfast status /shared/a --shards 64)\"      what is missing
  standfast slurm my.toml --sbatch=--cpus-per-task=4 --sbatch=-pshort | sh

The folder of --out must be one that all nodes share. The options of `run` are
taken, but for --shard and --dry-run. A task has as many threads as cores: one,
unless --sbatch asks for more. The options for gates, replays and output go to
the merge. The guide's chapter is clusters.md.")]
pub struct SlurmArgs {
    /// Number of shards, each a task [default: for 20 minutes each on a core]
    #[arg(long, value_name = "N", value_parser = count::<u64>(1..=100_000))]
    pub shards: Option<u64>,
    /// Option for `sbatch`, such as --sbatch=-pshort; may be repeated
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    pub sbatch: Vec<String>,
    #[command(flatten)]
    pub run: RunArgs,
}

/// Options of `slurm` alone; `true` where a value follows. The second list has the options of `run` that only the merge
/// gets.
const OWN: [(&str, bool); 2] = [("--shards", true), ("--sbatch", true)];
const OF_MERGE: [(&str, bool); 6] = [
    ("--gate", true),
    ("--baseline", true),
    ("--replays", true),
    ("--full", false),
    ("--json", false),
    ("--run-inputs", false),
];
/// Options of `run` that each task chooses itself.
const OF_TASK: [(&str, bool); 2] = [("--threads", true), ("--out", true)];

pub fn run(args: &SlurmArgs) -> Result<ExitCode> {
    if args.run.shard.is_some() || args.run.dry_run.dry_run {
        return Err(Error::option(
            "--shard, --dry-run",
            "given",
            "each task has its own shard",
            "--shards",
        ));
    }
    let (plan, folder, baseline) = args.run.plan()?;
    gates_of(&folder, &args.run.gates)?;
    let typed = std::env::args_os()
        .skip(1)
        .skip_while(|arg| arg != "slurm")
        .skip(1)
        .map(line)
        .collect::<Result<_>>()?;
    print(&args.script(&plan, &folder.path, baseline.is_some(), typed)?)
}

impl SlurmArgs {
    /// A shell script that submits array and merge, and prints their numbers. An argument is the list of tasks to
    /// submit. A packed baseline states the trials, so the tasks get it, too.
    fn script(
        &self,
        plan: &PreparedCampaign,
        out: &Path,
        has_packed_baseline: bool,
        typed: Vec<String>,
    ) -> Result<String> {
        let campaign = &plan.manifest.campaign;
        let until_resolved = campaign.stopping.until_resolved;
        let trial_s = plan.seconds_a_trial()?;
        let whole_s = trial_s * campaign.trials as f64;
        let parts = campaign.trials.div_ceil(plan.manifest.part_trials.get());
        let by_time = (whole_s / TASK_S).ceil().max(1.0) as u64;
        let shards = self.shards.unwrap_or(by_time).min(parts);
        let (of_merge, mut rest) = split(typed, &OF_MERGE);
        // Both the tasks and the merge may start commands of a result's folder.
        rest.extend(
            of_merge
                .iter()
                .filter(|word| *word == "--run-inputs")
                .cloned(),
        );
        let (_, mut asked) = split(rest, &[&OWN[..], &OF_TASK].concat());
        // Whether a campaign is decided depends on its gates, so its shards have to know them.
        if until_resolved {
            asked.extend(split(of_merge.clone(), &OF_MERGE[..2]).0);
        } else if has_packed_baseline {
            asked.extend(split(of_merge.clone(), &OF_MERGE[1..2]).0);
        }
        let program = mujoco::called().map_err(|source| Error::Read {
            path: "standfast".into(),
            source,
        })?;
        let words = |words: &[String]| {
            let quoted: Vec<String> = words.iter().map(|word| shell_word(word)).collect();
            quoted.join(" ")
        };
        let mut templates = Environment::new();
        templates.set_undefined_behavior(UndefinedBehavior::Strict);
        let written = templates.render_str(
            SCRIPT,
            context! {
                name => &campaign.name,
                job => shell_word(&campaign.name),
                trials => campaign.trials,
                trial_s => format!("{trial_s:.2}"),
                minutes => format!("{:.1}", whole_s / 60.0 / shards as f64),
                shards,
                until_resolved,
                program => shell_word(&program.display().to_string()),
                out => shell_word(&out.display().to_string()),
                asked => words(&asked),
                of_merge => words(&of_merge),
                options => words(&self.sbatch),
                notice_s => NOTICE_S,
                requeues => REQUEUES,
            },
        );
        Ok(written.expect("the template names what it is given") + "\n")
    }
}

/// A word of the command line, which has to stand in a line of the script.
fn line(word: OsString) -> Result<String> {
    match word.to_str() {
        Some(word) if !word.contains(['\n', '\r']) => Ok(word.into()),
        _ => Err(Error::option(
            "slurm",
            format!("{:?}", word.to_string_lossy()),
            "cannot be a word of a script",
            "text in UTF-8 without line breaks",
        )),
    }
}

/// Takes the options with these names, and their values, out of a command line.
fn split(line: Vec<String>, names: &[(&str, bool)]) -> (Vec<String>, Vec<String>) {
    let (mut taken, mut rest, mut words) = (Vec::new(), Vec::new(), line.into_iter());
    while let Some(word) = words.next() {
        // Words after `--` would not be read as options, but the script adds options at the end.
        if word == "--" {
            continue;
        }
        // Short options may stand together, such as -qo DIR, and their value may follow at once, as in -oDIR.
        let short_out = word
            .strip_prefix('-')
            .and_then(|flags| flags.trim_start_matches('q').strip_prefix('o'));
        let (name, value) = match short_out {
            Some(value) => ("--out", (!value.is_empty()).then_some(value)),
            None => word
                .split_once('=')
                .map_or((word.as_str(), None), |(name, value)| (name, Some(value))),
        };
        match names.iter().find(|(taken, _)| *taken == name) {
            Some(&(_, has_value)) => {
                let value = if has_value && value.is_none() {
                    words.next()
                } else {
                    None
                };
                taken.extend(std::iter::once(word).chain(value));
            }
            None => rest.push(word),
        }
    }
    (taken, rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_are_parted_with_their_values() {
        let line = "standard --shards 4 --gate=a>=0.5 --set push.height_m=0.1 --sbatch=-c4 --gate b>=0.1 --trials 9";
        let (own, rest) = split(line.split(' ').map(String::from).collect(), &OWN);
        assert_eq!(own, ["--shards", "4", "--sbatch=-c4"]);
        let (of_merge, rest) = split(rest, &OF_MERGE);
        assert_eq!(of_merge, ["--gate=a>=0.5", "--gate", "b>=0.1"]);
        assert_eq!(
            rest,
            ["standard", "--set", "push.height_m=0.1", "--trials", "9"]
        );
        for out in [
            "-o DIR",
            "-oDIR",
            "-o=DIR",
            "-qo DIR",
            "--out DIR",
            "--out=DIR",
        ] {
            let line = format!("standard {out} -q --trials 9");
            let (_, rest) = split(line.split(' ').map(String::from).collect(), &OF_TASK);
            assert_eq!(rest, ["standard", "-q", "--trials", "9"], "{out}");
        }
    }
}
