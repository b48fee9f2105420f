//! `standfast scenario`: a disturbance with a name, those of the paper first.

use crate::campaign::ask::scenario::{Cause, Imposed, Scenario};
use crate::control::Design;
use crate::episode::imposed::{self, ImposedRecord, Start};
use crate::episode::{Disturbance, EpisodeConfig};
use crate::error::{Error, Result};
use crate::lipm::gains::GainSet;
use crate::render::motion::MotionSample;
use crate::render::motion_plot::MotionPlot;
use crate::render::outputs::{Case, Outputs};
use crate::render::{self, story};
use crate::robot::Robot;
use serde_json::{Value, json};
use std::fmt::Write;

/// What the command is asked.
#[derive(Debug, Clone, clap::Args)]
#[command(after_help = "Examples:
  standfast scenario                                    what there is
  standfast scenario push-behind --plot response.svg    the paper's push from behind, as in its Fig. 14 (a)
  standfast scenario push-behind --gains switching      ... without a footstep
  standfast scenario my.toml --json                     your own; start from one in assets/scenarios")]
pub struct ScenarioArgs {
    /// A scenario that is compiled in, or a TOML file; without it all are listed
    pub scenario: Option<String>,
    /// Gain set by name or file, instead of the scenario's
    #[arg(long, value_name = "NAME|FILE", requires = "scenario")]
    pub gains: Option<String>,
    /// Robot by name or URDF file, instead of the scenario's
    #[arg(long, value_name = "NAME|FILE", requires = "scenario")]
    pub robot: Option<String>,
    #[command(flatten)]
    pub outputs: Outputs,
    /// One JSON object on stdout
    #[arg(long)]
    pub json: bool,
}

/// Runs the scenario, or lists them, and returns what to print. `command`: as it was given, for the replay.
pub fn run(args: &ScenarioArgs, command: String) -> Result<String> {
    let Some(name) = &args.scenario else {
        if args.outputs.is_empty() {
            return list(args.json);
        }
        let problem = "there is no episode to write anything of";
        return Err(Error::value(
            "arguments",
            "SCENARIO",
            "none",
            problem,
            "one of those that `standfast scenario` lists",
        ));
    };
    let scenario = Scenario::load(name)?;
    let config = scenario.episode();
    let robot = Robot::load(args.robot.as_ref().unwrap_or(&scenario.robot))?;
    let gains = GainSet::load(args.gains.as_ref().unwrap_or(&scenario.gains))?;
    let design = Design::new(&robot, &gains, config.control_period_s)?;
    if let Some(warning) = &design.warning {
        log::warn!("{warning}");
    }
    match scenario.cause()? {
        Cause::Push(push) => {
            let disturbance = Disturbance { pushes: vec![push], ..Disturbance::default() };
            let case = Case { robot: &robot, design: &design, config: &config };
            let text = case.run(disturbance, &args.outputs, args.json, command)?;
            Ok(if args.json { text } else { format!("{}\n\n{text}", scenario.description) })
        }
        Cause::Imposed(imposed) => run_imposed(args, &scenario, &robot, &design, &config, imposed),
    }
}

fn list(json: bool) -> Result<String> {
    let all = Scenario::builtin()?;
    if json {
        return Ok(render::json(&json!({ "scenarios": all })));
    }
    let mut text = String::new();
    for scenario in all {
        let _ = writeln!(text, "{:<20} {}", scenario.name, scenario.description);
    }
    text.push_str("\nto run one: standfast scenario NAME\n");
    Ok(text)
}

fn run_imposed(
    args: &ScenarioArgs,
    scenario: &Scenario,
    robot: &Robot,
    design: &Design,
    config: &EpisodeConfig,
    imposed: Imposed,
) -> Result<String> {
    let Outputs { trace, plot: to_plot, replay, frames } = &args.outputs;
    for (option, path) in [("--trace", trace), ("--replay", replay), ("--frames", frames)] {
        if let Some(path) = path {
            let accepted = "a scenario with a push, or --plot: an imposed error has no physics";
            return Err(Error::value("arguments", option, path.display(), "nothing to show", accepted));
        }
    }
    args.outputs.check()?;
    let mut plot = MotionPlot::default();
    let error = imposed.zmp_error_m.into();
    let record = imposed::run(robot, design, config, error, imposed.start, &mut |tick| {
        plot.samples.push(MotionSample::of_imposed(tick));
    })?;
    if let Some(path) = to_plot {
        plot.write(path, &headline(design, &record))?;
    }
    Ok(if args.json {
        render::json(&as_json(scenario, design, &imposed, &record))
    } else {
        format!("{}\n\n{}", scenario.description, tell(design, &imposed, &record))
    })
}

fn headline(design: &Design, record: &ImposedRecord) -> String {
    let [x, y] = record.zmp_error_m.map(|v| 1000.0 * v);
    format!("ZMP error ({x:.1}, {y:.1}) mm imposed, gain set {}: {}", design.family.name, outcome(record))
}

fn outcome(record: &ImposedRecord) -> String {
    match (record.lost_at_s, record.home_at_s) {
        (Some(at), _) => format!("lost at {at:.2} s: the DCM is out of reach"),
        (None, Some(at)) => format!("COM home from {at:.2} s"),
        (None, None) => "COM not home".into(),
    }
}

fn as_json(scenario: &Scenario, design: &Design, imposed: &Imposed, record: &ImposedRecord) -> Value {
    let head = json!({ "scenario": scenario.name, "gains": design.family.name, "start": imposed.start });
    render::with_fields_of(head, record)
}

fn tell(design: &Design, imposed: &Imposed, record: &ImposedRecord) -> String {
    let mut text = String::new();
    let mut line = |label: &str, what: String| _ = writeln!(text, "{label:<10}{what}");
    let [x, y] = record.zmp_error_m.map(|v| 1000.0 * v);
    line("error", format!("({x:.1}, {y:.1}) mm, on the ideal pendulum; the body follows by inverse kinematics"));
    let [vx, vy] = record.com_vel_m_s;
    line(
        "start",
        match imposed.start {
            Start::AtRest => "COM at rest: the error is told to the footstep alone".into(),
            Start::Moving => format!(
                "COM at ({vx:.3}, {vy:.3}) m/s, as after {:.2} N s at once: the slowest gain asks for that error",
                record.impulse_n_s
            ),
        },
    );
    line("gains", design.family.name.clone());
    line("outcome", outcome(record));
    for footstep in story::footsteps(&record.footsteps, record.unfinished_footstep.as_ref()) {
        line("footstep", footstep);
    }
    line(
        "body",
        format!(
            "its COM at most {:.1} mm from the pendulum's, and {:.0} mm high at the lowest",
            1000.0 * record.worst_com_error_m,
            1000.0 * record.lowest_com_m
        ),
    );
    text
}
