//! `standfast push`: simulates one push, and tells what happened and why.

use super::arguments::{
    CampaignArgs, DryRunArgs, ENGINES, MOST_SEED, MOST_TRIAL, MotorsArgs, PendulumArgs, count,
    fine, number, one_of,
};
use super::episode::{self, OutputArgs, Setting, command_line};
use super::terminal::{note, print};
use standfast_core::error::{Error, Result};
use standfast_sim::Engine;
use standfast_sim::episode::EpisodeRun;
use standfast_study::Overrides;
use standfast_study::ask::trial;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(allow_negative_numbers = true)]
#[command(after_help = "Examples:
  standfast push                                   5 N s from behind
  standfast push --impulse 3 --heading -135 --controller hold
  standfast push --impulse 3.6 --controller paper  it has to step
  standfast push --set push.height_m=0.1           above the COM
  standfast push --pendulum 3kg,1.75m --draw 0.3   by a bob on a rope
  standfast push --impulse 2 --plot push.svg       COM, ZMP and feet over time
  standfast push --impulse 2 --trace push.csv      every tick, as numbers
  standfast push --replay push.html                to watch in 3D in any browser
  standfast push --controller hold --controller catch@mujoco --replay push.html
  standfast push --campaign standard --trial 17    trial 17 of that campaign

A campaign gives sensor noise, thresholds, and height, duration and start of the
push (their means where they are drawn), and its trial the pushes, the robot and
the ground. Without a campaign the sensors are ideal, and the push is the same
for robots of every size, in their own units: 0.5 s after the start, for 0.05 s,
level with the COM, on the trunk. Without a trial robot and ground are as
designed; --set changes any of it. Exit code 1: the controller
failed, or the simulation diverged.")]
pub struct PushArgs {
    /// Impulse (N s) [default: 5, scaled to the robot]
    #[arg(long, value_name = "N_S", value_parser = number)]
    pub impulse: Option<f64>,
    #[command(flatten)]
    pub pendulum: PendulumArgs,
    /// Distance (m) by which the bob of a pendulum is drawn back
    #[arg(long, value_name = "M", value_parser = number, conflicts_with = "impulse")]
    pub draw: Option<f64>,
    /// Heading (degrees): 0 is forward, 90 to the left [default: 0]
    #[arg(long, value_name = "DEG", value_parser = number)]
    pub heading: Option<f64>,
    /// Controller by name or file; a second one is a ghost
    #[arg(
        long = "controller",
        alias = "gains",
        value_name = "NAME|FILE",
        default_value = "catch"
    )]
    pub gains: Vec<String>,
    /// Robot by name, or URDF or MJCF file
    #[arg(long, value_name = "NAME|FILE")]
    pub robot: Option<String>,
    #[command(flatten)]
    pub motors: MotorsArgs,
    /// Physics engine: rapier or mujoco
    #[arg(long, value_parser = one_of::<Engine, 2>(ENGINES), hide_possible_values = true)]
    pub engine: Option<Engine>,
    #[command(flatten)]
    pub campaign: CampaignArgs,
    /// Trial of the campaign, or of a search by `limit`
    #[arg(long, value_name = "I", requires = "of_campaign", value_parser = count::<u64>(0..=MOST_TRIAL))]
    pub trial: Option<u64>,
    /// Seed of noise and trials
    #[arg(long, value_name = "S", value_parser = count::<u64>(0..=MOST_SEED))]
    pub seed: Option<u64>,
    /// Change a value, such as push.height_m=0.05
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    #[command(flatten)]
    pub outputs: OutputArgs,
    #[command(flatten)]
    pub dry_run: DryRunArgs,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &PushArgs) -> Result<ExitCode> {
    let stated = [
        ("push.impulse_n_s", args.impulse),
        ("push.heading_deg", args.heading),
    ];
    let mut set = args.set.clone();
    for (key, value) in stated {
        set.extend(value.map(|value| format!("{key}={value:?}")));
    }
    set.extend(args.pendulum.change(args.draw));
    let overrides = Overrides {
        set,
        seed: args.seed,
        engines: Vec::from_iter(args.engine),
        robot: args.robot.clone(),
        motors: args.motors.file.clone(),
        ..Overrides::default()
    };
    let setting = Setting::of(args.campaign.name(), overrides, args.trial.is_some())?;
    let Setting { campaign, robot } = &setting;
    let config = &campaign.episode;
    if let Some(trial) = args.trial.filter(|trial| *trial >= campaign.trials) {
        let trials = campaign.trials;
        note(&format!(
            "trial {trial} is none of the campaign's {trials}, but may be of a search"
        ));
    }
    let entrants = setting.entrants(&args.gains)?;
    args.check_beside()?;
    args.outputs.check()?;
    args.outputs.check_length(config)?;
    let disturbance = || trial::disturbance(campaign, args.trial.unwrap_or(0));
    if args.dry_run.dry_run {
        return fine(&format!(
            "a push of {} N s, controller {}",
            disturbance().pushes[0].impulse_n_s,
            entrants[0].0.name
        ));
    }
    let runs = entrants.iter().map(|(factory, config)| EpisodeRun {
        robot,
        factory,
        config,
    });
    let (outputs, command) = (&args.outputs, command_line("standfast"));
    let (text, is_broken) = match runs.collect::<Vec<_>>()[..] {
        [shown, ghost] => {
            episode::run_beside([shown, ghost], disturbance, outputs, args.json, command)?
        }
        ref shown => episode::run(shown[0], disturbance(), outputs, args.json, command)?,
    };
    print(&text)?;
    Ok(if is_broken {
        ExitCode::FAILURE
    } else {
        ExitCode::SUCCESS
    })
}

impl PushArgs {
    /// Fails for a file that would show only one of two controllers.
    fn check_beside(&self) -> Result<()> {
        let OutputArgs { trace, plot, .. } = &self.outputs;
        let asked = [("--trace", trace), ("--plot", plot)]
            .into_iter()
            .find_map(|(option, path)| Some((option, path.as_ref()?)));
        if let (true, Some((option, path))) = (self.gains.len() > 1, asked) {
            let accepted = "--replay, which shows both; or a push for each controller";
            return Err(Error::option(
                option,
                path.display(),
                "shows one controller, and two are asked for",
                accepted,
            ));
        }
        Ok(())
    }
}
