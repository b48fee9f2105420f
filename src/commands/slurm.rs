//! `standfast slurm`: a campaign as an array of jobs on a Slurm cluster, and a merge that waits for them.
//!
//! Each task runs one shard into a folder that all nodes share. Execution is at least once: a task may be killed,
//! requeued, or submitted again with another number of shards, since a part is the same whichever task writes it.

use super::arguments::{count, fine};
use super::mujoco;
use super::result::gates_of;
use super::run::RunArgs;
use super::terminal::{alert, print};
use standfast_core::error::{Error, Result};
use standfast_files::shell_word;
use standfast_study::PreparedCampaign;
use std::ffi::OsString;
use std::path::Path;
use std::process::{Command, ExitCode};

/// Time between the request to stop and the end of a task by force (s).
const NOTICE_S: u32 = 60;
/// Largest number of times that a task is requeued.
const REQUEUES: u32 = 20;

#[derive(Debug, clap::Args)]
#[command(mut_arg("shard", |arg| arg.hide(true)), mut_arg("check", |arg| arg.hide(true)))]
#[command(after_help = "Examples:
  standfast slurm standard --trials 100000 --shards 64 --out /shared/a > jobs.sh   then: sh jobs.sh
  sh jobs.sh \"$(standfast status /shared/a --missing --shards 64)\"      again, what is missing
  standfast slurm my.toml --cpus 4 --sbatch=--partition=short --submit

The folder of --out must be one that all nodes share. The options of `run` are taken, but for
--shard and --check. A task has as many threads as --cpus. The options for gates,
replays and output go to the merge. The guide's chapter is clusters.md.")]
pub struct SlurmArgs {
    /// Number of shards, each a task of the array [default: what --minutes asks for]
    #[arg(long, value_name = "N", value_parser = count::<u64>(1..=100_000))]
    pub shards: Option<u64>,
    /// Length of a task in minutes, by a few trials that are timed
    #[arg(long, value_name = "MIN", default_value_t = 20, value_parser = count::<u64>(1..=10_000))]
    pub minutes: u64,
    /// Cores of a task
    #[arg(long, value_name = "C", default_value_t = 1, value_parser = count::<u64>(1..=1024))]
    pub cpus: u64,
    /// Option for `sbatch`, such as --sbatch=--partition=short; may be given several times
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    pub sbatch: Vec<String>,
    /// Submit the jobs, and print their numbers: array, merge
    #[arg(long)]
    pub submit: bool,
    #[command(flatten)]
    pub run: RunArgs,
}

/// Options of `slurm` alone; `true` where a value follows. The second list has the options of `run` that only the merge
/// gets.
const OWN: [(&str, bool); 5] = [
    ("--shards", true),
    ("--minutes", true),
    ("--cpus", true),
    ("--sbatch", true),
    ("--submit", false),
];
const OF_MERGE: [(&str, bool); 7] = [
    ("--gate", true),
    ("--unresolved", true),
    ("--baseline", true),
    ("--replays", true),
    ("--full", false),
    ("--json", false),
    ("--run-inputs", false),
];
/// Options of `run` that each task chooses itself.
const OF_TASK: [(&str, bool); 2] = [("--threads", true), ("--out", true)];

pub fn run(args: &SlurmArgs) -> Result<ExitCode> {
    if args.run.shard.is_some() || args.run.check.check {
        return Err(Error::option(
            "--shard, --check",
            "given",
            "each task has its own shard",
            "--shards",
        ));
    }
    let (plan, folder) = args.run.plan()?;
    gates_of(&folder, &args.run.gates)?;
    let typed = std::env::args_os()
        .skip(1)
        .skip_while(|arg| arg != "slurm")
        .skip(1)
        .map(line)
        .collect::<Result<_>>()?;
    let script = args.script(&plan, &folder.path, typed)?;
    if !args.submit {
        print(&script)?;
        return Ok(ExitCode::SUCCESS);
    }
    let submitted = Command::new("sh")
        .arg("-c")
        .arg(&script)
        .output()
        .map_err(|source| Error::Read {
            path: "sh".into(),
            source,
        })?;
    alert(String::from_utf8_lossy(&submitted.stderr).trim_end());
    print(&String::from_utf8_lossy(&submitted.stdout))?;
    match submitted.status.success() {
        true => fine("submitted"),
        false => Ok(ExitCode::FAILURE),
    }
}

impl SlurmArgs {
    /// A shell script that submits array and merge, and prints their numbers. An argument is the list of tasks to
    /// submit.
    fn script(&self, plan: &PreparedCampaign, out: &Path, typed: Vec<String>) -> Result<String> {
        let campaign = &plan.manifest.campaign;
        let trial_s = plan.seconds_a_trial()?;
        let whole_s = trial_s * campaign.trials as f64 / self.cpus as f64;
        let parts = campaign.trials.div_ceil(plan.manifest.part_trials.get());
        let by_time = (whole_s / (60.0 * self.minutes as f64)).ceil().max(1.0) as u64;
        let shards = self.shards.unwrap_or(by_time).min(parts);
        let (of_merge, mut rest) = split(typed, &OF_MERGE);
        // Both the tasks and the merge may start commands of a result's folder.
        rest.extend(
            of_merge
                .iter()
                .filter(|word| *word == "--run-inputs")
                .cloned(),
        );
        let (_, rest) = split(rest, &[&OWN[..], &OF_TASK].concat());
        // Whether a campaign is decided depends on its gates, so its shards have to know them.
        let (gates, _) = split(of_merge.clone(), &OF_MERGE[..3]);
        let asked = if campaign.stopping.until_resolved {
            [rest, gates].concat()
        } else {
            rest
        };
        let program = mujoco::called().map_err(|source| Error::Read {
            path: "standfast".into(),
            source,
        })?;
        let words = |words: &[String]| {
            words
                .iter()
                .map(|word| shell_word(word))
                .collect::<Vec<_>>()
                .join(" ")
        };
        let [program, out] = [&program, out].map(|path| shell_word(&path.display().to_string()));
        let (asked, of_merge, options) = (words(&asked), words(&of_merge), words(&self.sbatch));
        let (name, cpus) = (&campaign.name, self.cpus);
        let minutes = whole_s / 60.0 / shards as f64;
        let decided = match campaign.stopping.until_resolved {
            true => format!(
                "# When all is decided, nothing is left to do for the others.\n\
                 [ $code -ne 0 ] || ! {program} status -- {out} > /dev/null || scancel --state=PENDING $SLURM_ARRAY_JOB_ID\n"
            ),
            false => String::new(),
        };
        Ok(format!(
            r#"#!/bin/sh
# The campaign {name}: {trials} trials of {trial_s:.2} s each, as timed here, in {shards} shards of about {minutes:.1} minutes.
# An argument is the list of shards to run, such as 3,7-9. It prints the numbers of two jobs: the array, and the merge.
set -e
case "${{1-all}}" in
  none) echo "nothing is missing" >&2; exit 0 ;;
  '') echo "the list of shards is empty" >&2; exit 2 ;;
esac
array=$(sbatch --parsable --job-name={job} --array="${{1-1-{shards}}}" --cpus-per-task={cpus} --requeue \
  --open-mode=append --signal=B:TERM@{NOTICE_S} {options} << 'END'
#!/bin/bash
# Before it is killed, a task is told to stop. It keeps its finished parts and has itself run again.
trap 'kill -TERM $child' TERM
{program} run {asked} --out={out} --shard $SLURM_ARRAY_TASK_ID/{shards} --threads $SLURM_CPUS_PER_TASK &
child=$!
wait $child; code=$?
while kill -0 $child 2> /dev/null; do wait $child; code=$?; done
if [ $code -eq 75 ] || [ $code -eq 143 ]; then
  [ ${{SLURM_RESTART_COUNT:-0}} -ge {REQUEUES} ] || scontrol requeue $SLURM_JOB_ID
fi
{decided}exit $code
END
)
merge=$(sbatch --parsable --job-name={job}-merge --dependency=afterany:$array --requeue {options} << 'END'
#!/bin/bash
# It says what is missing, if anything is, and how to run it.
exec {program} merge {of_merge} -- {out}
END
) || {{ echo "the array is job $array; its merge could not be submitted" >&2; exit 1; }}
echo $array $merge
"#,
            trials = campaign.trials,
            job = shell_word(name),
        ))
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
        let line = "standard --shards 4 --gate=a>=0.5 --set push.height_m=0.1 --submit --gate b>=0.1 --trials 9";
        let (own, rest) = split(line.split(' ').map(String::from).collect(), &OWN);
        assert_eq!(own, ["--shards", "4", "--submit"]);
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
