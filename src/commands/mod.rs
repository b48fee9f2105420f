//! The command line: one file for each command, with its arguments and its steps in the order in which they happen.
//!
//! Several commands share arguments (`arguments`), printing (`terminal`), the progress bar (`progress`), Ctrl-C
//! (`interrupt`), the end of a campaign (`result`), searches of many jobs (`batch`), and the simulation of one episode
//! (`episode`).

pub mod arguments;
mod batch;
mod card;
mod ceiling;
mod check;
mod compare;
mod contract;
mod cpi;
mod docs;
pub mod episode;
mod init;
mod interrupt;
mod limit;
mod list;
mod merge;
mod model;
mod mujoco;
mod new;
mod open;
pub mod progress;
mod push;
mod replay;
mod result;
mod run;
mod slurm;
mod status;
pub mod terminal;
mod tune;
mod view;

pub use interrupt::exit_code;
pub use terminal::note;

use crate::leaves;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use log::Level;
use standfast_controllers::permission;
use standfast_core::error::{Error, Result};
use standfast_files::assets::nearest;
use standfast_report::text::next_command;
use std::io::{IsTerminal, Write};
use std::process::ExitCode;

/// The command line of the program.
#[derive(Debug, Parser)]
#[command(
    version,
    about = "How hard can a humanoid be pushed before it falls, and which controller makes it
stand better?

`standfast COMMAND -h` lists what a command is mostly used with; `--help` lists
all, with examples.",
    after_help = "Without a command, the standard campaign runs: 1000 pushes for each of four
controllers. What a command computes goes to the standard output, and everything
else to the standard error. The paper is that of K. Yamamoto and Y. Nakamura on
switching control and quick stepping with maximal CPI sets (constraint
positively invariant sets).

Exit codes: 0 done, 1 error, 2 wrong input, 3 a result that is missing,
incomplete or does not belong here, 75 try again (terminated, disk full, folder
in use, no more open files), 100 a gate failed, 130 interrupted"
)]
struct Cli {
    /// Print no progress and no notes
    #[arg(short, long, global = true)]
    quiet: bool,
    #[command(subcommand)]
    command: Option<Chosen>,
    /// Start the commands of controllers out of a result's folder, though this machine has not made its files
    #[arg(long, global = true, hide = true)]
    run_inputs: bool,
}

#[derive(Debug, Subcommand)]
enum Chosen {
    /// Run a campaign, and count how often each controller recovers
    Run(run::RunArgs),
    /// Join the parts of a campaign that was run in shards
    Merge(merge::MergeArgs),
    /// Run a campaign as a job array on a Slurm cluster
    Slurm(slurm::SlurmArgs),
    /// Compare two campaigns of the same pushes, or hardware with its card
    Compare(compare::CompareArgs),
    /// Say which trials are missing (exit code 3 if any are)
    Status(status::StatusArgs),
    /// Show the report of a result in the browser
    Open(open::OpenArgs),
    /// Simulate one push and tell what happened and why
    Push(push::PushArgs),
    /// Simulate a trial of a result again, and show it in 3D
    Replay(replay::ReplayArgs),
    /// Try a controller unpushed: does it stand, and do the same again?
    Check(check::CheckControllerArgs),
    /// Find the largest recoverable impulse by heading
    Limit(limit::LimitArgs),
    /// Find how many of the pushes that a controller loses can be caught
    Ceiling(ceiling::CeilingArgs),
    /// Make a page for a lab: limits, what costs most, and what to try on hardware
    Card(card::CardArgs),
    /// Search better numbers for a controller, and judge them by unseen trials
    Tune(tune::TuneArgs),
    /// Compute the maximal CPI sets of a gain set
    Cpi(cpi::CpiArgs),
    /// Show a robot as it was read, and its kinematics
    Model(model::ModelArgs),
    /// Write the file of a campaign or a controller, to begin with
    New(new::NewArgs),
    /// Write the settings of a robot, inferred from its URDF
    Init(init::InitArgs),
    /// Show the robot, or a trial of a result, in a 3D window
    View(view::ViewArgs),
    /// List robots, controllers, campaigns, and what is compiled in
    List(list::ListArgs),
    /// Explain columns, write manual pages, or complete words in a shell
    #[command(subcommand)]
    Docs(docs::DocsArgs),
}

/// Words on a terminal where the program is called without any argument, before it goes on.
const FIRST_WORDS: &str = "\
How hard can a humanoid be pushed before it falls, and which controller makes it
stand better?

  standfast push                     one push, told as a story (a second)
  standfast push --replay push.html  the same as a film for the browser
  standfast run smoke                a campaign of 15 pushes
  standfast limit --controller hold  how hard, from which side
  standfast init my.urdf             a robot of your own
  standfast --help                   all of it

Now the standard campaign runs: 1000 pushes for each of four controllers, which
takes minutes. Ctrl-C ends it; the same command then goes on where it ended.
";

/// The program: runs the command with which it is called, and turns an error into an exit code.
pub fn main() -> ExitCode {
    leaves::add();
    let mut logger =
        env_logger::Builder::from_env(env_logger::Env::default().default_filter_or("warn"));
    logger.format(|out, record| match record.level() {
        // Warnings have the form that they have in results.
        Level::Warn => writeln!(out, "warning: {}", record.args()),
        level => writeln!(out, "[{level} {}] {}", record.target(), record.args()),
    });
    let logger = logger.build();
    log::set_max_level(logger.filter());
    log::set_boxed_logger(Box::new(terminal::Once::new(logger))).expect("there is no logger yet");
    let done = run().or_else(|error| {
        if matches!(error, Error::NoMujoco) {
            mujoco::go_on()
        } else {
            Err(error)
        }
    });
    done.unwrap_or_else(|error| {
        // An interrupted command has already said what is left of its work.
        if !matches!(error, Error::Interrupted) {
            terminal::alert(&format!("error: {}", next_command::told(&error)));
        }
        ExitCode::from(exit_code(&error))
    })
}

/// Runs the command that the program was called with. A command line that cannot be read ends the program here, with
/// what is wrong and exit code 2.
fn run() -> Result<ExitCode> {
    let matches = command_line().try_get_matches();
    let chosen = matches.and_then(|matches| Cli::from_arg_matches(&matches));
    let Cli {
        quiet,
        command: chosen,
        run_inputs,
    } = chosen.unwrap_or_else(|error| suggesting(error).exit());
    if quiet {
        terminal::be_quiet();
    }
    permission::ask_by(move |kept| terminal::may_start(kept, run_inputs));
    let chosen = chosen.unwrap_or_else(|| {
        if std::io::stderr().is_terminal() {
            note(FIRST_WORDS);
        }
        Chosen::Run(run::RunArgs::standard())
    });
    arguments::check_environment()?;
    interrupt::survive_large_files();
    match chosen {
        Chosen::Run(args) => run::run(&args),
        Chosen::Merge(args) => merge::run(&args),
        Chosen::Slurm(args) => slurm::run(&args),
        Chosen::Compare(args) => compare::run(&args),
        Chosen::Status(args) => status::run(&args),
        Chosen::Open(args) => open::run(&args),
        Chosen::Push(args) => push::run(&args),
        Chosen::Replay(args) => replay::run(&args),
        Chosen::Check(args) => check::run(&args),
        Chosen::Limit(args) => limit::run(&args),
        Chosen::Ceiling(args) => ceiling::run(&args),
        Chosen::Card(args) => card::run(&args),
        Chosen::Tune(args) => tune::run(&args),
        Chosen::Cpi(args) => cpi::run(&args),
        Chosen::Model(args) => model::run(&args),
        Chosen::New(args) => new::run(&args),
        Chosen::Init(args) => init::run(&args),
        Chosen::View(args) => view::run(args),
        Chosen::List(args) => list::run(&args),
        Chosen::Docs(args) => docs::run(&args, Cli::command()),
    }
}

/// Options that `-h` leaves out.
const RARE: [&str; 10] = [
    "vary", "baseline", "threads", "shard", "replays", "replicas", "sbatch", "untried", "speed",
    "seconds",
];

/// Most columns of a help text.
const MOST_COLUMNS: usize = 80;

/// The command line. With `-h` in place of `--help`, it has neither rare options nor examples.
fn command_line() -> clap::Command {
    // A negative number is refused by the option that takes it.
    let all = Cli::command()
        .max_term_width(MOST_COLUMNS)
        .mut_subcommands(|command| command.allow_negative_numbers(true));
    if !std::env::args_os().any(|arg| arg == "-h") {
        return all;
    }
    all.mut_subcommands(|command| {
        let command = command.after_help("More options and examples: --help");
        command.mut_args(|arg| {
            if RARE.contains(&arg.get_id().as_str()) {
                arg.hide(true)
            } else {
                arg
            }
        })
    })
}

/// What former versions called otherwise, and what does the same now.
const FORMER: [(&str, &str); 27] = [
    ("columns", "docs columns"),
    ("man", "docs man"),
    ("completions", "docs completions"),
    ("--check", "--dry-run"),
    ("--print", "--dry-run"),
    ("--output", "--replay"),
    ("--export", "--out"),
    ("--judge", "--set episode.judge.counts=survived"),
    ("--horizon", "--set episode.horizon_s=6"),
    ("--height", "--set push.height_m=0.05"),
    ("--duration", "--set push.duration_s=0.05"),
    ("--start", "--set push.start_s=0.5"),
    ("--profile", "--set push.profile=half-sine"),
    ("--limit-trial", "--trial"),
    ("--margin", "--set stopping.margin=0.02"),
    ("--max-trials", "--trials"),
    ("--unresolved", "--set gates.unresolved=fail"),
    ("--missing", "--shards"),
    ("--format", "--shards"),
    ("--cpus", "--sbatch=--cpus-per-task=4"),
    ("--minutes", "--shards"),
    ("--submit", "| sh"),
    ("--omega", "--set omega_rad_s=5.6"),
    ("--dt", "--set period_s=0.002"),
    ("--support", "--set support_m=[-0.05,0.05,-0.1,0.1]"),
    ("--q", "--set JOINT=RAD"),
    ("--from", "POLICY.onnx FILE.yaml"),
];

/// Adds to an error about a command or an option which one was probably meant, or what does the same now.
fn suggesting(mut error: clap::Error) -> clap::Error {
    let cli = Cli::command();
    let wrong = [ContextKind::InvalidSubcommand, ContextKind::InvalidArg]
        .into_iter()
        .find_map(|kind| match error.get(kind) {
            Some(ContextValue::String(wrong)) => Some(wrong.clone()),
            _ => None,
        });
    let Some(wrong) = wrong else { return error };
    if let Some((_, now)) = FORMER.iter().find(|(former, _)| *former == wrong) {
        let told = format!("in place of '{wrong}' there is now: {now}");
        error.insert(
            ContextKind::Suggested,
            ContextValue::StyledStrs(vec![told.into()]),
        );
    } else if error.kind() == ErrorKind::InvalidSubcommand
        && let Some(meant) = nearest(&wrong, cli.get_subcommands().map(clap::Command::get_name))
    {
        let meant = ContextValue::Strings(vec![meant.into()]);
        error.insert(ContextKind::SuggestedSubcommand, meant);
    }
    error
}
