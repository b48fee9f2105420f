//! `standfast-paper scenario`: simulates a disturbance that has a name, such as a push of the paper, or lists the
//! names.

use crate::imposed;
use crate::render::imposed::ImposedStory;
use crate::scenario::{Cause, Imposed, Scenario};
use serde_json::json;
use standfast::commands::arguments::{DryRunArgs, ENGINES, fine, one_of};
use standfast::commands::episode::{self, OutputArgs, command_line};
use standfast::commands::terminal::print;
use standfast::controllers;
use standfast::core::control::Design;
use standfast::core::error::{Error, Result};
use standfast::report;
use standfast::report::figure::motion::MotionPlot;
use standfast::report::text::layout::wrapped;
use standfast::sim::Engine;
use standfast::sim::episode::{Disturbance, EpisodeRun};
use standfast::study::ask::pendulum::check_strike;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  standfast-paper scenario                                lists the scenarios
  standfast-paper scenario push-behind --plot push.svg    the push of Fig. 14 (a)
  standfast-paper scenario push-behind --controller switching  without a footstep
  standfast-paper scenario gauge-behind --trace strike.csv  the gauge of Fig. 10
  standfast-paper scenario my-scenario.toml               one of your own

The figure is one of the paper's. To write a scenario of your own, start from a
file in benches/paper/scenarios.")]
pub struct ScenarioArgs {
    /// Scenario by its built-in name or TOML file; without it, all built-in scenarios are listed
    pub scenario: Option<String>,
    /// Gain set by name or file, in place of the scenario's
    #[arg(
        long = "controller",
        visible_alias = "gains",
        value_name = "NAME|FILE",
        requires = "scenario"
    )]
    pub gains: Option<String>,
    /// Robot by name or URDF file, in place of the scenario's
    #[arg(long, value_name = "NAME|FILE", requires = "scenario")]
    pub robot: Option<String>,
    /// Physics engine that simulates the robot [default: rapier]
    #[arg(long, value_name = "ENGINE", value_parser = one_of::<Engine, 2>(ENGINES), requires = "scenario")]
    pub engine: Option<Engine>,
    #[command(flatten)]
    pub outputs: OutputArgs,
    #[command(flatten)]
    pub dry_run: DryRunArgs,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &ScenarioArgs) -> Result<ExitCode> {
    let Some(name) = &args.scenario else {
        return list(args);
    };
    let scenario = Scenario::load(name)?;
    let robot = standfast::robots::load(args.robot.as_ref().unwrap_or(&scenario.robot))?;
    let (cause, mut config) = (scenario.cause()?, scenario.episode(&robot));
    config.engine = args.engine.unwrap_or(config.engine);
    let gains = args.gains.as_ref().unwrap_or(&scenario.gains);
    let factory = controllers::load(gains)?.prepare(&robot, config.control_period_s)?;
    if let Some(warning) = &factory.warning {
        log::warn!("{warning}");
    }
    if matches!(cause, Cause::Imposed(_)) {
        check_without_physics(args)?;
    }
    if let Cause::Push(push) = &cause
        && let Some(bob) = &push.bob
    {
        check_strike(&scenario.name, &robot, push, bob)?;
    }
    config.engine.check(&robot)?;
    args.outputs.check()?;
    args.outputs.check_length(&config)?;
    if args.dry_run.dry_run {
        return fine(&format!(
            "scenario {}, gain set {}",
            scenario.name, factory.name
        ));
    }
    let case = EpisodeRun {
        robot: &robot,
        factory: &factory,
        config: &config,
    };
    let answer = match cause {
        Cause::Push(push) => {
            let disturbance = Disturbance {
                pushes: vec![push],
                ..Disturbance::default()
            };
            let command = command_line("standfast-paper");
            episode::run(case, disturbance, &args.outputs, args.json, command)?.0
        }
        Cause::Imposed(error) => {
            let design = Design::new(&robot, &crate::gain_set(gains)?, config.control_period_s)?;
            impose(args, &scenario, &case, &design, &error)?
        }
    };
    print(&if args.json {
        answer
    } else {
        format!("{}\n{answer}", wrapped("", &scenario.description))
    })
}

fn list(args: &ScenarioArgs) -> Result<ExitCode> {
    if !args.outputs.is_empty() {
        let (problem, accepted) = (
            "no scenario is named, so there is nothing to write",
            "a scenario that `standfast-paper scenario` lists",
        );
        return Err(Error::option("SCENARIO", "none", problem, accepted));
    }
    let all = Scenario::builtin()?;
    if args.dry_run.dry_run {
        return fine(&format!("{} scenarios to list", all.len()));
    }
    print(&if args.json {
        report::json(&json!({ "scenarios": all }))
    } else {
        let lines = all
            .iter()
            .map(|scenario| wrapped(&format!("{:<20} ", scenario.name), &scenario.description));
        lines.collect::<String>() + "\nTo run one: standfast-paper scenario NAME\n"
    })?;
    Ok(ExitCode::SUCCESS)
}

/// Fails if an engine is asked for, or a file that only an episode with physics can fill.
fn check_without_physics(args: &ScenarioArgs) -> Result<()> {
    let OutputArgs {
        trace,
        plot: _,
        replay,
    } = &args.outputs;
    let files = [("--trace", trace), ("--replay", replay)];
    let files =
        files.map(|(option, path)| (option, path.as_ref().map(|path| path.display().to_string())));
    let engine = (
        "--engine",
        args.engine.map(|engine| engine.name().to_string()),
    );
    for (option, value) in files.into_iter().chain([engine]) {
        if let Some(value) = value {
            let accepted = "a scenario with a push; an imposed error has no physics, and can only be drawn with --plot";
            return Err(Error::option(
                option,
                value,
                "nothing to simulate",
                accepted,
            ));
        }
    }
    Ok(())
}

/// Imposes a ZMP error on the pendulum, draws what follows if `--plot` asks for it, and returns what to print.
fn impose(
    args: &ScenarioArgs,
    scenario: &Scenario,
    case: &EpisodeRun,
    design: &Design,
    error: &Imposed,
) -> Result<String> {
    let EpisodeRun { robot, config, .. } = *case;
    let mut plot = MotionPlot::default();
    let record = imposed::run(
        robot,
        design,
        config,
        error.zmp_error_m.into(),
        error.start,
        &mut |tick| {
            plot.push(robot, tick);
        },
    )?;
    let story = ImposedStory {
        scenario: &scenario.name,
        gain_set: &design.family.name,
        start: error.start,
        record,
    };
    if let Some(path) = &args.outputs.plot {
        plot.write(path, &story.headline())?;
    }
    Ok(if args.json {
        report::json(&story.as_json())
    } else {
        story.text()
    })
}
