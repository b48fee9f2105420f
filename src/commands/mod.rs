//! The commands around campaigns: what each does and prints.

pub mod cli;
pub mod paper;

use self::cli::{Cli, CompareArgs, FolderArgs, GateArgs, MergeArgs, ReplaysArgs, RunArgs};
use crate::assets::DEFAULT_ROBOT;
use crate::campaign::verdict::compare::{Comparison, is_same_folder};
use crate::campaign::verdict::gates::Gates;
use crate::campaign::{Campaign, Folder, Plan, Summary, limit, run::RunOptions};
use crate::control::home_polygon;
use crate::episode::EpisodeConfig;
use crate::files::shell_word;
use crate::lipm::pendulum::Pendulum;
use crate::render::cpi::{CpiArgs, CpiDefaults};
use crate::render::limit::LimitArgs;
use crate::render::model::Args as ModelArgs;
use crate::render::push::PushArgs;
use crate::render::replays::ReplayArgs;
use crate::render::response::ResponseArgs;
use crate::render::scenario::ScenarioArgs;
use crate::render::{self, progress, progress::Progress, progress::note, table};
use crate::robot::Robot;
use crate::view::ViewArgs;
use crate::{Error, Result};
use clap::CommandFactory;
use clap_complete::Shell;
use std::path::Path;
use std::process::ExitCode;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

/// Exit code of `status` when something is missing.
const INCOMPLETE: u8 = 3;

/// Exit code if a gate did not pass.
const GATE_FAILED: u8 = 100;

static STOP: AtomicBool = AtomicBool::new(false);

pub fn run(args: &RunArgs) -> Result<ExitCode> {
    let campaign = Campaign::load(&args.campaign, &args.overrides())?;
    if args.max_trials.is_some() && !campaign.stopping.until_resolved {
        let problem = "the campaign has a fixed count of trials";
        return Err(Error::value("arguments", "--max-trials", "given", problem, "--trials, or --until-resolved too"));
    }
    if args.shard.is_some() && (!args.gates.gate.is_empty() || args.gates.baseline.is_some()) {
        let problem = "a shard has a part of the trials only, which no gate can judge";
        return Err(Error::value("arguments", "--gate, --baseline", "given", problem, "these options of `merge`"));
    }
    let plan = Plan::new(&campaign)?;
    let folder = plan.folder(args.out.as_deref())?;
    // Before anything runs: what cannot be judged in the end must not cost the time. A shard is judged by `merge`.
    let gates = match args.shard {
        Some(_) => None,
        None => Some(gates_of(&folder, &args.gates)?),
    };
    let there = folder.blocks() - folder.missing().len() as u64;
    if there > 0 && folder.is_of_another_build() {
        let path = folder.path.display();
        note(&format!("{path}: what is there was made by another build of standfast, and is kept;"));
        note("to see what this build makes of it, give another --out");
    }
    stop_on_ctrl_c();
    let progress = OnceLock::new();
    let result = plan.run(
        &folder,
        &RunOptions {
            threads: args.threads,
            shard: args.shard,
            stop: &STOP,
            on_start: &|total| {
                if there > 0 {
                    let (path, blocks) = (folder.path.display(), folder.blocks());
                    note(&format!("{path}: goes on, {there} of {blocks} parts are there"));
                }
                _ = progress.set(Progress::start(total, "episodes", campaign.stopping.until_resolved));
            },
            on_episode: &|| progress.get().into_iter().for_each(Progress::tick),
            is_decided: &|rows| {
                let open = gates.iter().flat_map(|gates| gates.open(rows)).collect::<Vec<_>>();
                let trials = rows.len() / plan.manifest.sets.len();
                let outlasts = gates.iter().any(|gates| gates.outlasts_baseline(rows));
                let line = progress::open(trials, &open, outlasts);
                progress.get().into_iter().for_each(|bar: &Progress| bar.say(&line));
                open.is_empty()
            },
        },
    );
    progress.get().into_iter().for_each(Progress::finish);
    if let Err(Error::Interrupted) = result {
        note(&format!("finished parts are kept; to go on: {}", folder.resume_command()));
    }
    result?;
    if progress.get().is_none() {
        note(&format!("{}: complete, nothing is computed again", folder.path.display()));
    }
    match &gates {
        None => print_status(&folder, args.json).map(|_| ExitCode::SUCCESS),
        Some(gates) => join(&folder, gates, &args.replays, args.json),
    }
}

/// The gates of a result. Errors: those of [`Gates::new`], or the baseline is the result itself.
fn gates_of(folder: &Folder, args: &GateArgs) -> Result<Gates> {
    if let Some(baseline) = args.baseline.as_deref().filter(|baseline| is_same_folder(baseline, &folder.path)) {
        let problem = "is the result folder itself; an earlier result is wanted (and another --out for this one)";
        return Err(Error::Parts { path: baseline.into(), problem: problem.into() });
    }
    Gates::new(&folder.manifest, args.baseline.as_deref())
}

pub fn merge(MergeArgs { folder: FolderArgs { dir, json }, gates, replays }: &MergeArgs) -> Result<ExitCode> {
    let mut folder = Folder::existing(dir)?;
    folder.manifest.campaign.gates.add(&gates.gate);
    let gates = gates_of(&folder, gates)?;
    folder.create()?;
    stop_on_ctrl_c();
    join(&folder, &gates, replays, *json)
}

pub fn compare(args: &CompareArgs) -> Result<ExitCode> {
    if let Some(out) = args.out.as_deref().filter(|out| !render::result::may_be_written_to(out)) {
        let problem = "holds something else than a comparison; give a new or empty folder";
        return Err(Error::Parts { path: out.into(), problem: problem.into() });
    }
    let comparison = Comparison::new(&Folder::existing(&args.dir_a)?, &Folder::existing(&args.dir_b)?, &args.gate)?;
    let summary = &comparison.summary;
    render::print(&if args.json { render::json(summary) } else { table::campaign(summary, Path::new("")) })?;
    if let Some(out) = &args.out {
        render::result::write(&comparison.write(out)?, &comparison.rows, out)?;
        note(&render::result::written(out, &["summary.json", "trials.parquet"]));
    }
    Ok(exit_code(summary, Path::new("")))
}

pub fn status(args: &FolderArgs) -> Result<ExitCode> {
    let complete = print_status(&Folder::existing(&args.dir)?, args.json)?;
    Ok(if complete { ExitCode::SUCCESS } else { ExitCode::from(INCOMPLETE) })
}

pub fn push(args: &PushArgs) -> Result<ExitCode> {
    render::print(&render::push::run(args, command_line())?)?;
    Ok(ExitCode::SUCCESS)
}

pub fn replay(args: &ReplayArgs) -> Result<ExitCode> {
    render::print(&render::replays::run(args)?)?;
    Ok(ExitCode::SUCCESS)
}

/// Nothing of an interrupted run is kept.
pub fn limit(args: &LimitArgs) -> Result<ExitCode> {
    args.check_outputs()?;
    let campaign = Campaign::load(&args.campaign, &args.change.overrides(None))?;
    stop_on_ctrl_c();
    let progress = OnceLock::new();
    let result = limit::measure(
        &campaign,
        &limit::LimitOptions {
            headings: args.headings,
            precision_n_s: args.precision,
            max_trials: args.max_trials,
            threads: args.threads,
            stop: &STOP,
            on_start: &|total| _ = progress.set(Progress::start(total, "searches", false)),
            on_search: &|| progress.get().into_iter().for_each(Progress::tick),
        },
    );
    progress.get().into_iter().for_each(Progress::finish);
    let limits = result?;
    // First what the user waited for: a folder that cannot be written must not cost it.
    render::print(&if args.json { render::json(&limits) } else { render::limit::text(&limits) })?;
    for path in args.write(&limits)? {
        note(&format!("written: {}", path.display()));
    }
    Ok(ExitCode::SUCCESS)
}

pub fn scenario(args: &ScenarioArgs) -> Result<ExitCode> {
    render::print(&render::scenario::run(args, command_line())?)?;
    Ok(ExitCode::SUCCESS)
}

/// The sets for UT-mu2 unless pendulum or support are given.
pub fn cpi(args: &CpiArgs) -> Result<ExitCode> {
    let robot = Robot::load(DEFAULT_ROBOT)?;
    let pendulum = Pendulum { omega: robot.omega(), dt: EpisodeConfig::default().control_period_s };
    let defaults = CpiDefaults { pendulum, support: home_polygon(&robot) };
    let mut text = Vec::new();
    render::cpi::run(args, &defaults, &mut text)?;
    render::print(&String::from_utf8_lossy(&text))?;
    Ok(ExitCode::SUCCESS)
}

pub fn response(args: &ResponseArgs) -> Result<ExitCode> {
    render::print(&render::response::run(args)?)?;
    Ok(ExitCode::SUCCESS)
}

pub fn model(args: &ModelArgs) -> Result<ExitCode> {
    render::print(&render::model::run(args)?)?;
    Ok(ExitCode::SUCCESS)
}

pub fn view(args: &ViewArgs) -> Result<ExitCode> {
    render::print(&crate::view::run(args)?)?;
    Ok(ExitCode::SUCCESS)
}

pub fn completions(shell: Shell) -> Result<ExitCode> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "standfast", &mut script);
    render::print(&String::from_utf8_lossy(&script))?;
    Ok(ExitCode::SUCCESS)
}

/// Writes the result files and prints the result; then the replays, which nobody should have to wait for.
fn join(folder: &Folder, gates: &Gates, args: &ReplaysArgs, json: bool) -> Result<ExitCode> {
    let (summary, rows) = Summary::of_folder(folder, gates)?;
    render::result::write(&summary, &rows, &folder.path)?;
    render::print(&if json { render::json(&summary) } else { table::campaign(&summary, &folder.path) })?;
    note(&render::result::written(&folder.path, &["summary.json", "trials.parquet", "campaign.toml"]));
    let verdict = exit_code(&summary, &folder.path);
    let stop = || STOP.load(Ordering::Relaxed);
    match render::replays::write_telling(folder, &summary, args.replays, &stop) {
        Ok(0) => {}
        Ok(replays) => {
            // Now with links to them.
            render::result::write(&summary, &rows, &folder.path)?;
            let these = if replays == 1 { "replay of a telling trial" } else { "replays of telling trials" };
            note(&format!("written: {}: {replays} {these}", folder.path.join("replays").display()));
        }
        // The result is none the worse.
        Err(error) => log::warn!("no replays: {error}"),
    }
    // The same command writes those that are missing.
    if stop() { Err(Error::Interrupted) } else { Ok(verdict) }
}

/// This command as it was given.
fn command_line() -> String {
    let args = std::env::args().skip(1).map(|arg| shell_word(&arg));
    std::iter::once("standfast".to_string()).chain(args).collect::<Vec<_>>().join(" ")
}

/// Says which gates did not pass, each with the command that replays a trial that was lost.
fn exit_code(summary: &Summary, folder: &Path) -> ExitCode {
    render::failed_gates(summary, folder).iter().for_each(|line| note(line));
    if summary.gates.iter().all(|gate| gate.passes) { ExitCode::SUCCESS } else { ExitCode::from(GATE_FAILED) }
}

/// Prints which parts are there; true if all are.
fn print_status(folder: &Folder, json: bool) -> Result<bool> {
    let (missing, blocks) = (folder.missing(), folder.blocks());
    let complete = missing.is_empty();
    let (path, there) = (folder.path.display().to_string(), blocks - missing.len() as u64);
    let next = if complete { folder.merge_command() } else { folder.resume_command() };
    if json {
        render::print(&render::json(&serde_json::json!({
            "name": folder.manifest.campaign.name,
            "config_hash": folder.manifest.config_hash,
            "complete": complete,
            "parts": blocks,
            "parts_complete": there,
            "missing_trials": folder.trials_of(&missing),
            "next_command": next,
        })))?;
    } else {
        let trials = if complete { String::new() } else { format!("\nmissing: trials {}", folder.trials_of(&missing)) };
        let verb = if complete { "to join them" } else { "to compute the rest" };
        let shards = match complete {
            true => String::new(),
            false => {
                format!("or copy the folders of other shards into this one, and then: {}\n", folder.merge_command())
            }
        };
        render::print(&format!("{path}: {there} of {blocks} parts are complete{trials}\n{verb}: {next}\n{shards}"))?;
    }
    Ok(complete)
}

/// The first Ctrl-C (or SIGTERM) lets running episodes end; the second ends at once.
fn stop_on_ctrl_c() {
    let handler = || {
        if STOP.swap(true, Ordering::Relaxed) {
            std::process::exit(130);
        }
        note("stopping; once more to end at once");
    };
    if let Err(e) = ctrlc::set_handler(handler) {
        log::warn!("no handler for Ctrl-C: {e}");
    }
}
