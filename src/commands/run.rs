//! `standfast run`: a campaign, from its file to its verdict.

use super::arguments::{ChangeArgs, CheckArgs, GateArgs, ReplaysArgs, fine};
use super::interrupt::{STOP, stop_on_ctrl_c};
use super::progress::Progress;
use super::result::{conclude, gates_of};
use super::status::print_status;
use super::terminal::note;
use crate::campaign::run::{RunOptions, Watch, Work};
use crate::campaign::verdict::gates::Gates;
use crate::campaign::{Campaign, Folder, Overrides, Plan, Shard, TrialRow};
use crate::error::{Error, Result};
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, Default, clap::Args)]
#[command(after_help = "Examples:
  standfast run                                    the standard campaign, all cores
  standfast run smoke                              a small one, seconds
  standfast run my.toml --trials 200 --gains switching --gains mine.toml
  standfast run --set push.impulse_n_s=2.5 --set 'push.heading_deg={uniform=[-45, 45]}'
  standfast run --vary paper:stepping.alpha=2,5,15,60   a sweep
  standfast run --vary 'fixed:gains.0.x=[0.15, 1, 5],[1, 1, 5]' --gains fixed
  standfast run --shard 1/4 --out results          a quarter of it, on this machine
  standfast merge results                          ... joined when all four are there
  standfast run --gains hold --gains catch --until-resolved      as few pushes as it takes
  standfast run --gate 'catch >= 0.80' --gate 'catch >= hold + 0.10'
  standfast run --gate 'catch >= baseline - 0.01' --baseline results-of-main
  standfast run my.toml --check                    is all of it fine? Nothing runs

Interrupted, the same command goes on where it stopped.")]
pub struct RunArgs {
    /// A campaign that is compiled in (smoke, nominal, standard, harsh) or a TOML file
    #[arg(default_value = "standard")]
    pub campaign: String,
    #[command(flatten)]
    pub change: ChangeArgs,
    /// Count of pushes
    #[arg(long, value_name = "N")]
    pub trials: Option<u64>,
    /// Stop as soon as every gate is decided or, without gates, every pair of gain sets.
    ///
    /// It looks at the result after 25 trials, 50, 75, and so on, each time after about a quarter more. Its intervals are
    /// valid however often one looks (betting confidence sequences): of its gates, or of its pairs, all together are
    /// decided wrongly in at most 5 % of runs. It may be taken up again with more trials.
    #[arg(long)]
    pub until_resolved: bool,
    /// Two gain sets that differ by less than this share are the same, and their pair is resolved [default: 0.02]
    #[arg(long, value_name = "SHARE")]
    pub margin: Option<f64>,
    /// Most pushes with --until-resolved, in whole parts of 25 [default: those of the campaign]
    #[arg(long, value_name = "N", conflicts_with = "trials")]
    pub max_trials: Option<u64>,
    #[command(flatten)]
    pub gates: GateArgs,
    /// Threads; 0: one per core. The result is the same for any
    #[arg(long, value_name = "T", default_value_t = 0)]
    pub threads: usize,
    /// Run only share k of n (1/n to n/n) and leave parts for `merge`
    #[arg(long, value_name = "K/N")]
    pub shard: Option<Shard>,
    #[command(flatten)]
    pub replays: ReplaysArgs,
    #[command(flatten)]
    pub check: CheckArgs,
    /// Result folder [default: standfast-results/NAME]
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Print the summary as one JSON object
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &RunArgs) -> Result<ExitCode> {
    let campaign = Campaign::load(&args.campaign, &args.overrides())?;
    args.check_against(&campaign)?;
    let plan = Plan::new(&campaign)?;
    let folder = plan.folder(args.out.as_deref())?;
    // Before anything runs: what cannot be judged in the end must not cost the time. A shard is judged by `merge`.
    let gates = match args.shard {
        Some(_) => None,
        None => Some(gates_of(&folder, &args.gates)?),
    };
    let undecided = |rows: &[TrialRow]| gates.as_ref().map_or(Vec::new(), |gates| gates.open(rows));
    let options = RunOptions { threads: args.threads, shard: args.shard };
    stop_on_ctrl_c();
    let work = plan.work(&folder, options, &|rows| undecided(rows).is_empty())?;
    if args.check.check {
        let (sets, episodes) = (folder.manifest.sets.join(", "), work.episodes());
        return fine(&format!("campaign {}, gain sets {sets}, {episodes} episodes to run", campaign.name));
    }
    say_what_is_there(&folder, &work);
    let progress =
        (!work.is_done()).then(|| Progress::start(work.episodes(), "episodes", campaign.stopping.until_resolved));
    let is_decided = |rows: &[TrialRow]| {
        let open = undecided(rows);
        progress.iter().for_each(|bar| bar.say(&look(rows, &open, gates.as_ref(), &folder)));
        open.is_empty()
    };
    let on_episode = || progress.iter().for_each(Progress::tick);
    let done = work.run(&Watch { stop: &STOP, on_episode: &on_episode, is_decided: &is_decided });
    progress.iter().for_each(Progress::finish);
    if let Err(Error::Interrupted) = done {
        note(&format!("finished parts are kept; to go on: {}", folder.resume_command()));
    }
    done?;
    match &gates {
        None => print_status(&folder, args.json).map(|_| ExitCode::SUCCESS),
        Some(gates) => conclude(&folder, gates, &args.replays, args.json),
    }
}

impl RunArgs {
    /// The standard campaign as it is.
    pub fn standard() -> Self {
        Self { campaign: "standard".into(), ..Self::default() }
    }

    /// All that these change of the campaign.
    fn overrides(&self) -> Overrides {
        Overrides {
            trials: self.max_trials.or(self.trials),
            gates: self.gates.gate.clone(),
            until_resolved: self.until_resolved,
            margin: self.margin,
            ..self.change.overrides()
        }
    }

    /// Errors: options that mean nothing for this campaign, or together.
    fn check_against(&self, campaign: &Campaign) -> Result<()> {
        if self.max_trials.is_some() && !campaign.stopping.until_resolved {
            let problem = "the campaign has a fixed count of trials";
            return Err(Error::value(
                "arguments",
                "--max-trials",
                "given",
                problem,
                "--trials, or --until-resolved too",
            ));
        }
        if self.shard.is_some() && (!self.gates.gate.is_empty() || self.gates.baseline.is_some()) {
            let problem = "a shard has a part of the trials only, which no gate can judge";
            return Err(Error::value("arguments", "--gate, --baseline", "given", problem, "these options of `merge`"));
        }
        Ok(())
    }
}

/// What of the campaign there is, and what becomes of it.
fn say_what_is_there(folder: &Folder, work: &Work) {
    let (path, blocks) = (folder.path.display(), folder.blocks());
    let there = blocks - folder.missing().len() as u64;
    if there > 0 && folder.is_of_another_build() {
        note(&format!("{path}: what is there was made by another build of standfast, and is kept;"));
        note("to see what this build makes of it, give another --out");
    }
    if work.is_done() {
        note(&format!("{path}: complete, nothing is computed again"));
    } else if there > 0 {
        note(&format!("{path}: goes on, {there} of {blocks} parts are there"));
    }
}

/// What a campaign that ends when decided has still to decide (`open`), and whether that takes more trials than its
/// baseline has.
fn look(rows: &[TrialRow], open: &[String], gates: Option<&Gates>, folder: &Folder) -> String {
    let trials = rows.len() / folder.manifest.sets.len();
    let what = match open {
        [] if gates.is_some_and(|gates| gates.outlasts_baseline(rows)) => "not decided, but the baseline has no more",
        [] => "decided",
        [first] => &format!("open {first}"),
        [first, more @ ..] => &format!("open {first}, and {} more", more.len()),
    };
    format!("{trials} trials: {what}")
}
