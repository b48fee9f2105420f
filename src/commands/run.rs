//! `standfast run`: a campaign, from its file to its verdict.

use super::arguments::{
    CampaignArgs, ChangeArgs, DryRunArgs, GateArgs, MOST_THREADS, ReplaysArgs, check_output, count,
    fine,
};
use super::interrupt::{STOP, stop_on_ctrl_c};
use super::progress::{Progress, duration};
use super::result::{Printing, Told, conclude, exit_code, gates_of};
use super::status::print_status;
use super::terminal::{alert, note, tell, warn};
use standfast_core::error::{Error, Result};
use standfast_files::{columns, shell_word};
use standfast_report::text::next_command;
use standfast_study::ask::spec::MOST_TRIALS;
use standfast_study::run::{CampaignRun, RunEvents, RunOptions};
use standfast_study::until_resolved::Look;
use standfast_study::verdict::gates::Gates;
use standfast_study::verdict::so_far::{SoFar, SuccessTally};
use standfast_study::{Campaign, Folder, Overrides, PreparedCampaign, Shard};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::{Mutex, PoisonError};

#[derive(Debug, Default, clap::Args)]
#[command(mut_arg("first", |arg| arg.default_value("standard")))]
#[command(after_help = "Examples:
  standfast run                      the standard campaign, on all cores
  standfast run smoke                a small campaign that takes seconds
  standfast run my.toml --controller switching --controller mine.toml
  standfast run --set push.impulse_n_s=2.5 --set push.height_m=0.05
  standfast run --set 'push.heading_deg={uniform=[-45, 45]}'
  standfast run --set episode.judge.counts=survived        for robots that march
  standfast run --vary paper:stepping.alpha=2,5,15,60      `paper`, four variants
  standfast run --vary 'fixed:gains.0.x=[0.15, 1, 5],[1, 1, 5]'
  standfast run --shard 1/4 --out results   a quarter; `merge results` joins all
  standfast run --controller hold --controller catch --until-resolved
  standfast run --gate 'catch >= 0.80' --gate 'catch >= hold + 0.10'
  standfast run --gate 'catch >= baseline - 0.01' --baseline results-of-main
  standfast run --controller catch@rapier --controller catch@mujoco
  standfast run my.toml --dry-run    checks everything, and says how long it takes

What is not given is that of the campaign. An entrant is a controller in an
engine: catch@mujoco; --engine is that of controllers which name none. A run
that was interrupted goes on where it stopped when the same command is given
again. The guide has more in its chapters campaigns.md (--until-resolved,
--replays), gates.md (--gate), gains.md (--vary), clusters.md (--shard) and
engines.md (@ENGINE, --engine both).")]
pub struct RunArgs {
    #[command(flatten)]
    pub campaign: CampaignArgs,
    #[command(flatten)]
    pub change: ChangeArgs,
    /// Number of trials; with --until-resolved, the most
    #[arg(long, value_name = "N", value_parser = count::<u64>(1..=MOST_TRIALS))]
    pub trials: Option<u64>,
    /// Stop once every gate, or every pair, is decided
    #[arg(long)]
    pub until_resolved: bool,
    #[command(flatten)]
    pub gates: GateArgs,
    /// Number of threads; 0 is one on each core
    #[arg(long, value_name = "T", default_value_t = 0, value_parser = count::<usize>(0..=MOST_THREADS))]
    pub threads: usize,
    /// Make outcomes up instead of simulating them, to try very large campaigns
    #[arg(long, hide = true)]
    pub synthetic: bool,
    /// Run only part K of N (1/N to N/N) of the trials; `merge` joins the parts
    #[arg(long, value_name = "K/N")]
    pub shard: Option<Shard>,
    /// Do not try first whether the robot stands without a push
    #[arg(long)]
    pub untried: bool,
    #[command(flatten)]
    pub replays: ReplaysArgs,
    #[command(flatten)]
    pub dry_run: DryRunArgs,
    /// Folder [default: standfast-results/NAME]
    #[arg(short, long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Write the trials as a table, too, for who cannot read trials.parquet
    #[arg(long, value_name = "FILE.csv", hide = true)]
    pub table: Option<PathBuf>,
    #[command(flatten)]
    pub printing: Printing,
    /// Whether the program was called without any argument, as somebody does who does not know it yet.
    #[arg(skip)]
    pub bare: bool,
}

pub fn run(args: &RunArgs) -> Result<ExitCode> {
    // All input is checked before anything runs, so that no time is lost on a campaign that cannot be judged in the
    // end.
    let (plan, folder, baseline) = args.plan()?;
    if let Some(table) = &args.table {
        check_output("--table", table, &["csv"])?;
    }
    // A shard judges nothing, but it may have to know when every question is decided; `merge` judges the whole.
    let gates = match args.shard {
        Some(_) if !folder.manifest.campaign.stopping.until_resolved => None,
        _ => Some(gates_of(&folder, &args.gates)?),
    };
    for warning in folder.manifest.warnings() {
        tell("warning: ", &warning);
    }
    if let Some(baseline) = &baseline {
        say_what_is_compared(&plan, baseline)?;
    }
    stop_on_ctrl_c();
    let options = RunOptions {
        threads: args.threads,
        shard: args.shard,
        untried: args.untried,
    };
    let mut work = CampaignRun::new(&plan, &folder, options, gates.as_ref())?;
    if args.dry_run.dry_run {
        return say_what_is_to_run(&work);
    }
    let is_new = !say_what_is_there(&folder, &work);
    if args.bare && is_new {
        announce(&work);
    }
    simulate(&mut work, gates.as_ref(), args.bare && is_new)?;
    let Some(gates) = gates.as_ref().filter(|_| args.shard.is_none()) else {
        print_status(&folder, args.gates.baseline.as_deref(), args.printing)?;
        return Ok(ExitCode::SUCCESS);
    };
    let told = Told {
        printing: args.printing,
        baseline: baseline.as_ref(),
    };
    let (summary, _) =
        work.within_threads(|| conclude(&folder, gates, &args.replays, Some(told), false))?;
    if let Some(table) = &args.table {
        write_table(&folder, table)?;
    }
    Ok(exit_code(&[summary]))
}

/// Writes the trials of a finished result as a table.
fn write_table(folder: &Folder, table: &Path) -> Result<()> {
    let path = folder.path.join("trials.parquet");
    let read = std::fs::read(&path).map(columns::read_parquet);
    match read {
        Ok(Ok((columns, _))) => columns::write(table, &columns),
        Ok(Err(e)) => Err(Error::Parts {
            path,
            problem: e.to_string(),
        }),
        Err(source) => Err(Error::Read { path, source }),
    }
}

impl RunArgs {
    /// The arguments with which the program runs if it is called without any: the standard campaign, unchanged.
    pub fn standard() -> Self {
        Self {
            bare: true,
            ..Self::default()
        }
    }

    /// The plan that these arguments ask for, the folder for its result, and the baseline, if it is packed. The trials are
    /// those of such a baseline if its campaign has the name of the one that is asked for. Nothing is written.
    pub(super) fn plan(&self) -> Result<(PreparedCampaign, Folder, Option<Folder>)> {
        let (name, mut overrides) = (self.campaign.or_standard(), self.overrides());
        let baseline = self.gates.packed_baseline()?;
        if let Some(baseline) = &baseline
            && baseline.manifest.campaign.name == name
        {
            overrides.file = Some(baseline.trials_asked()?);
        }
        let files = Campaign::robot_files(name, &overrides)?;
        let campaign = Campaign::load_for(&files.robot()?, name, &overrides)?;
        self.check_against(&campaign, baseline.is_some())?;
        let plan = PreparedCampaign::with(&campaign, files)?;
        let folder = plan.folder(self.out.as_deref())?;
        Ok((plan, folder, baseline))
    }

    /// The changes of the campaign that these arguments ask for.
    fn overrides(&self) -> Overrides {
        Overrides {
            trials: self.trials,
            gates: self.gates.gate.clone(),
            until_resolved: self.until_resolved,
            synthetic: self.synthetic,
            ..self.change.overrides()
        }
    }

    /// Fails if an option means nothing for this campaign, or contradicts another option. A packed baseline states the
    /// trials, which shards have to know.
    fn check_against(&self, campaign: &Campaign, is_packed: bool) -> Result<()> {
        let GateArgs { gate, baseline } = &self.gates;
        let is_fixed = !campaign.stopping.until_resolved;
        if is_packed && !is_fixed {
            let problem = "beside a packed baseline all trials are run";
            return Err(Error::option(
                "--until-resolved",
                "given",
                problem,
                "--trials",
            ));
        }
        if is_fixed
            && self.shard.is_some()
            && !(gate.is_empty() && (baseline.is_none() || is_packed))
        {
            let (options, problem) = (
                "--gate, --baseline",
                "a shard has too few of the trials for a gate",
            );
            return Err(Error::option(
                options,
                "given",
                problem,
                "these options of `merge`",
            ));
        }
        Ok(())
    }
}

/// Says whether the robot is that of a packed baseline, by its values, and whether the baseline has all trials. It fails
/// if the robot has other joints.
fn say_what_is_compared(plan: &PreparedCampaign, baseline: &Folder) -> Result<()> {
    let name = baseline.name();
    let differences = plan.robot_values().differences(&baseline.robot_values()?);
    match differences.warning(&name)? {
        Some(warning) => tell("warning: ", &warning),
        None => note(&format!(
            "the robot is that of {name}: all its {} values are alike",
            differences.values
        )),
    }
    let (ours, theirs) = (plan.manifest.campaign.trials, baseline.trials());
    if ours > theirs {
        tell(
            "warning: ",
            &format!(
                "{name} has {theirs} trials, so that only so many of the {ours} are compared."
            ),
        );
    }
    Ok(())
}

/// Says for --dry-run how many episodes there are to run, and how long that takes here, by a few trials that are timed.
fn say_what_is_to_run(work: &CampaignRun) -> Result<ExitCode> {
    let (episodes, manifest) = (work.episodes(), &work.folder.manifest);
    let mut takes = String::new();
    if episodes > 0 {
        let trials = episodes as f64 / manifest.controllers.len() as f64;
        let time_s =
            work.plan.seconds_a_trial()? * trials / work.threads().min(episodes as usize) as f64;
        takes = format!(
            "; that takes about {} on this machine as it is now",
            duration(time_s)
        );
    }
    fine(&format!(
        "campaign {} with controllers {}: {episodes} episodes to run{takes}",
        manifest.campaign.name,
        manifest.controllers.join(", ")
    ))
}

/// Says how much of the campaign is in the folder already. Returns false, and says nothing, if nothing is there.
fn say_what_is_there(folder: &Folder, work: &CampaignRun) -> bool {
    let (path, all) = (folder.path.display(), work.all_episodes());
    let kept = all - work.episodes();
    if kept == 0 {
        return false;
    }
    let what = if work.shard.is_some() {
        "this shard"
    } else {
        "the campaign"
    };
    match work.is_done() {
        true => note(&format!(
            "{path}: {what} is complete; nothing is computed again"
        )),
        false => note(&format!(
            "{path}: goes on, {kept} of {all} episodes are there"
        )),
    }
    if folder.is_of_another_build() {
        let advice = "To run all of them with this build, give another --out.";
        warn(
            "",
            &format!(
                "The episodes that are there were made by another build of standfast, and are kept. {advice}"
            ),
        );
    }
    true
}

/// Tells a user who called the program without any argument what it is about to do, how to stop it, and what is
/// quicker.
fn announce(work: &CampaignRun) {
    let campaign = &work.plan.manifest.campaign;
    let program = std::env::args_os().next().unwrap_or("standfast".into());
    let (program, controllers, name) = (
        shell_word(&program.to_string_lossy()),
        campaign.controllers.len(),
        &campaign.name,
    );
    let what = format!(
        "This runs the campaign `{name}`: {} pushes for each of {controllers} controllers, on",
        campaign.trials
    );
    let keeps = "Ctrl-C keeps what is finished, and the same command goes on from there";
    let threads = match work.threads() {
        1 => "one thread".into(),
        threads => format!("{threads} threads"),
    };
    let quick = format!(
        "{program} push --replay push.html (one push, to watch in a browser), {program} run smoke"
    );
    tell("", &format!("{what} {threads}. {keeps}."));
    tell("", &format!("For a quick look instead: {quick} (seconds)."));
}

/// Runs the episodes that are missing, and shows how far the campaign is and what it has found. With `tells_time` it
/// also says how long the campaign will take here, as soon as the pace of the first episodes is known.
pub(super) fn simulate(
    work: &mut CampaignRun,
    gates: Option<&Gates>,
    tells_time: bool,
) -> Result<()> {
    let manifest = &work.folder.manifest;
    let stopping = manifest.campaign.stopping;
    let all = work.all_episodes();
    let kept = all - work.episodes();
    let progress =
        (!work.is_done()).then(|| Progress::of_episodes(all, kept, stopping.until_resolved));
    let tally = Mutex::new(SuccessTally::new(&manifest.controllers));
    let finished = || tally.lock().unwrap_or_else(PoisonError::into_inner);
    let so_far = || SoFar::new(&finished(), stopping.margin);
    let run = work.run(&RunEvents {
        stop: &STOP,
        on_episode: &|| {
            if let Some(progress) = &progress {
                progress.episode_and(|| progress.show(&so_far()));
            }
        },
        on_part: &|rows| {
            let Some(progress) = progress.as_ref().filter(|_| !rows.is_empty()) else {
                return;
            };
            if tells_time && finished().is_empty() {
                let pace = format!("by the pace of its first {} episodes", progress.done());
                note(&format!(
                    "It takes about {} here, {pace}.",
                    duration(progress.whole_s())
                ));
            }
            finished().add(rows);
            if progress.is_due() {
                progress.show(&so_far());
            }
        },
        on_look: &|look, all_episodes| {
            let Some(progress) = &progress else { return };
            progress.set_total(all_episodes);
            // A terminal always shows what is open, so it needs a line only when something ends.
            if look.open.is_empty() || !look.stopping.is_empty() || !progress.is_on_terminal() {
                note(&words_of_look(look, gates));
            }
        },
    });
    if let Some(progress) = progress {
        progress.finish();
        match run {
            Err(Error::Interrupted) => say_what_is_kept("interrupted: ", work, kept, &progress),
            Err(Error::Machine(_)) => say_what_is_kept("incomplete: ", work, kept, &progress),
            _ => {}
        }
    }
    run
}

/// What a look at a campaign that ends when decided has found: what is still to be decided, whether that takes more
/// trials than the baseline has, and which controllers stop.
fn words_of_look(look: &Look, gates: Option<&Gates>) -> String {
    let what = match look.open {
        [] if gates.is_some_and(|gates| gates.outlasts_baseline(look.rows)) => {
            "not decided, but the baseline has no more"
        }
        [] => "decided",
        [first] => &format!("not decided yet: {}", first.words),
        [first, more @ ..] => &format!("not decided yet: {}, and {} more", first.words, more.len()),
    };
    let stopping = match &look.stopping[..] {
        [] => String::new(),
        [controller] => format!("; {controller} needs no more trials"),
        several => format!("; {} need no more trials", several.join(", ")),
    };
    format!("after {} trials: {what}{stopping}", look.rows.trials())
}

/// Says how many episodes are kept of a run that ended early, and which command goes on from there. `kept_before` were
/// there before the run.
fn say_what_is_kept(ended: &str, work: &CampaignRun, kept_before: u64, progress: &Progress) {
    let all = work.all_episodes();
    let kept = all - work.episodes();
    let lost = match progress
        .done()
        .saturating_sub(kept.saturating_sub(kept_before))
    {
        0 => String::new(),
        lost => {
            let again = duration(progress.time_of_s(lost));
            format!(
                " {lost} more belong to parts that had not ended and will be run again (about {again})."
            )
        }
    };
    let goes_on = "The same command goes on from there, and so does:";
    warn(
        ended,
        &format!("{kept} of {all} episodes are kept.{lost} {goes_on}"),
    );
    let shard = work
        .shard
        .map_or(String::new(), |shard| format!(" --shard {shard}"));
    alert(&format!("  {}{shard}", next_command::resume(work.folder)));
}
