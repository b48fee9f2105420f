//! `standfast check`: tries a controller before anybody pushes it.

use super::arguments::{ControllerArgs, ENGINES, MotorsArgs, one_of};
use super::contract;
use super::episode::Setting;
use super::result::exit_code_of_gates;
use super::terminal::print;
use standfast_core::error::Result;
use standfast_report::text::unpushed::UnpushedCheck;
use standfast_sim::Engine;
use standfast_sim::episode::unpushed::UnpushedEpisode;
use standfast_study::Overrides;
use standfast_study::ask::entrant::Entrant;
use standfast_study::ask::trial;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(allow_negative_numbers = true)]
#[command(mut_group("of_controller", |group| group.required(true)))]
#[command(after_help = "Examples:
  standfast check mine.toml               does it stand, and do the same again?
  standfast check controllers/ankles.toml --campaign standard
  standfast check catch --robot my.urdf --json
  standfast check policy.toml --contract pairs.npz

The controller drives the robot three times, and nothing pushes it: twice one
after the other, and once started anew, which for a program is another process.
What is told: whether the robot stands, which joint left its angle first,
whether all three are the same to the bit, how long a tick takes, and what the
first command wants of each joint.

With a campaign, the sensors have the noise of its first trial; robot and ground
are as designed. Exit code 100: it falls, fails, does not repeat, or does not
keep a --contract: observations and actions that were recorded of a policy, a
pair in each line of a .csv, or two arrays in an .npz.")]
pub struct CheckControllerArgs {
    #[command(flatten)]
    pub controller: ControllerArgs,
    /// A campaign for noise, time steps and thresholds [default: nominal]
    #[arg(long, value_name = "NAME|FILE")]
    pub campaign: Option<String>,
    /// Robot by name, or URDF or MJCF file
    #[arg(long, value_name = "NAME|FILE")]
    pub robot: Option<String>,
    #[command(flatten)]
    pub motors: MotorsArgs,
    /// Physics engine: rapier or mujoco
    #[arg(long, value_parser = one_of::<Engine, 2>(ENGINES), hide_possible_values = true)]
    pub engine: Option<Engine>,
    /// Change a value, such as episode.horizon_s=10
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Observations and actions that it has to repeat
    #[arg(long, value_name = "FILE")]
    pub contract: Option<PathBuf>,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &CheckControllerArgs) -> Result<ExitCode> {
    let entrant = Entrant::split(args.controller.name());
    // No push comes, so the episode may be as short as is asked.
    let mut set = vec!["push.start_s=0".to_string()];
    set.extend(args.set.iter().cloned());
    let overrides = Overrides {
        set,
        engines: Vec::from_iter(entrant.engine.or(args.engine)),
        robot: args.robot.clone(),
        motors: args.motors.file.clone(),
        ..Overrides::default()
    };
    let Setting { campaign, robot } = Setting::of(args.campaign.as_deref(), overrides, false)?;
    let config = campaign.episode;

    let settings = standfast_controllers::load(entrant.controller)?;
    if let Some(difference) = settings.trained_otherwise(&robot) {
        log::warn!("it was trained on other motors: {difference}");
    }
    let prepare = || settings.prepare(&robot, config.control_period_s);
    let factory = prepare()?;
    if let Some(warning) = &factory.warning {
        log::warn!("{warning}");
    }
    let contract = args
        .contract
        .as_ref()
        .map(|path| contract::repeated(path, &mut *factory.start(0)))
        .transpose()?;
    let alone = |factory: &_| {
        UnpushedEpisode::run(&robot, factory, &config, trial::disturbance(&campaign, 0))
    };
    let (first, second, third) = (alone(&factory)?, alone(&factory)?, alone(&prepare()?)?);
    let (again, anew) = (first.differs(&second), first.differs(&third));
    let check = UnpushedCheck {
        robot: &robot,
        factory: &factory,
        config: &config,
        alone: &first,
        again,
        anew,
        contract,
    };
    print(&if args.json {
        standfast_report::json(&check.json())
    } else {
        check.text()
    })?;
    Ok(exit_code_of_gates(check.is_good()))
}
