//! `standfast push`: simulates one push, and tells what happened and why.

use super::arguments::{CampaignArgs, CheckArgs, ENGINES, fine, number, one_of};
use super::episode::{Case, OutputArgs, Setting, command_line};
use super::terminal::print;
use crate::campaign::ask::bounds::in_range;
use crate::campaign::ask::trial;
use crate::campaign::{Campaign, Overrides, PushBounds};
use crate::contest;
use crate::episode::{Disturbance, EpisodeConfig};
use crate::error::{Error, Result};
use crate::render::scene::scale::first_push;
use crate::robot::{Kinematics, Link, Robot};
use crate::sim::{Engine, Profile, Push, Variation};
use nalgebra::Vector3;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(allow_negative_numbers = true)]
#[command(after_help = "Examples:
  standfast push                                    5 N s from behind
  standfast push --impulse 3 --heading -135 --gains hold
  standfast push --impulse 3.6 --gains paper        more than standing can take, so that it steps
  standfast push --impulse 2 --plot push.svg        COM, ZMP and feet over time, as a picture
  standfast push --impulse 2 --trace push.csv       every tick, as numbers
  standfast push --impulse 5 --replay push.html     a page to watch in 3D, in any browser
  standfast push --impulse 5 --frames pictures      snapshots and an animated picture
  standfast push --beside hold --frames pictures    two robots beside each other
  standfast push --campaign standard --trial 17     trial 17 of that campaign

A campaign gives sensor noise and thresholds, and its trial the pushes, the robot and
the ground; its values are the defaults then. Without a campaign the sensors are ideal,
and without a trial robot and ground are as designed.")]
pub struct PushArgs {
    /// Impulse (N s) [default: 5, scaled to the robot]
    #[arg(long, value_name = "N_S", value_parser = number)]
    pub impulse: Option<f64>,
    /// Heading (degrees): 0 is forward, 90 to the left [default: 0]
    #[arg(long, value_name = "DEG", value_parser = number)]
    pub heading: Option<f64>,
    /// Height above the COM at home (m) [default: 0]
    #[arg(long, value_name = "M", value_parser = number)]
    pub height: Option<f64>,
    /// Duration (s) [default: 0.05]
    #[arg(long, value_name = "S", value_parser = number)]
    pub duration: Option<f64>,
    /// Start (s) [default: 0.5]
    #[arg(long, value_name = "S", value_parser = number)]
    pub start: Option<f64>,
    /// Course of the force over time [default: rectangular]
    #[arg(long, value_parser = one_of::<Profile, 2>(["rectangular", "half-sine"]))]
    pub profile: Option<Profile>,
    /// Controller by name or file
    #[arg(long = "controller", visible_alias = "gains", value_name = "NAME|FILE", default_value = "catch")]
    pub gains: String,
    /// A second controller under the same push: beside the first in the pictures, a ghost in the replay
    #[arg(long, value_name = "NAME|FILE")]
    pub beside: Option<String>,
    /// Robot by name or URDF file [default: ut-mu2]
    #[arg(long, value_name = "NAME|FILE")]
    pub robot: Option<String>,
    /// Physics engine
    #[arg(long, value_name = "ENGINE", value_parser = one_of::<Engine, 2>(ENGINES))]
    pub engine: Option<Engine>,
    #[command(flatten)]
    pub campaign: CampaignArgs,
    /// Trial of the campaign: its pushes, robot, ground and noise
    #[arg(long, value_name = "I", requires = "of_campaign")]
    pub trial: Option<u64>,
    /// Seed of the campaign's noise
    #[arg(long, value_name = "S")]
    pub seed: Option<u64>,
    /// Length of the episode (s) [default: 6]
    #[arg(long, value_name = "S", value_parser = number)]
    pub horizon: Option<f64>,
    #[command(flatten)]
    pub outputs: OutputArgs,
    #[command(flatten)]
    pub check: CheckArgs,
    /// Print one JSON object instead of text
    #[arg(long)]
    pub json: bool,
}

pub fn run(args: &PushArgs) -> Result<ExitCode> {
    let overrides =
        Overrides { seed: args.seed, engine: args.engine, robot: args.robot.clone(), ..Overrides::default() };
    let Setting { campaign, robot, config } = Setting::of(args.campaign.name(), &overrides, args.horizon)?;
    let pushes = the_pushes(args, campaign.as_ref(), &config, &robot)?;
    let prepare = |name: &String| {
        let gains = campaign.as_ref().map_or_else(|| name.clone(), |c| c.gains_named(name));
        let factory = contest::load(&gains)?.prepare(&robot, config.control_period_s)?;
        factory.warning.iter().for_each(|warning| log::warn!("{warning}"));
        Ok(factory)
    };
    let factory = prepare(&args.gains)?;
    let beside = args.beside.as_ref().map(prepare).transpose()?;
    if let Some(beside) = beside.as_ref().filter(|beside| beside.name == factory.name) {
        return Err(Error::option("--beside", &beside.name, "is the controller itself", "another controller"));
    }
    args.outputs.check()?;
    args.outputs.check_length(&config)?;
    if args.check.check {
        return fine(&format!("a push of {} N s, controller {}", pushes[0].impulse_n_s, factory.name));
    }
    let disturbance = || {
        let of_trial = campaign.as_ref().map(|c| trial::disturbance(c, args.trial.unwrap_or(0))).unwrap_or_default();
        // Robot and ground vary only if a trial is named, since they belong to the trial.
        let variation = if args.trial.is_some() { of_trial.variation } else { Variation::default() };
        Disturbance { pushes: pushes.clone(), variation, ..of_trial }
    };
    let case = Case { robot: &robot, factory: &factory, config: &config };
    let command = command_line("standfast");
    print(&match &beside {
        Some(beside) => case.run_beside(beside, disturbance, &args.outputs, args.json, command)?,
        None => case.run(disturbance(), &args.outputs, args.json, command)?,
    })
}

/// The pushes of the episode: those of the named trial or, if there is none, one from behind. The options change the
/// first push. Fails for a value out of range, or if a push does not end within the horizon.
fn the_pushes(
    args: &PushArgs,
    campaign: Option<&Campaign>,
    config: &EpisodeConfig,
    robot: &Robot,
) -> Result<Vec<Push>> {
    let mut pushes = match (campaign, args.trial) {
        // Trials beyond those of the campaign are the ones with which `limit` searches.
        (Some(campaign), Some(index)) => trial::pushes(campaign, index),
        _ => vec![first_push(robot)],
    };
    let base = pushes[0];
    // The time, height and duration of the second push follow from those of the first.
    let moves_second =
        args.start.is_some() || args.duration.is_some() || args.height.is_some() || args.profile.is_some();
    if pushes.len() > 1 && moves_second {
        let accepted = "--impulse and --heading, or --set on the campaign in a file";
        return Err(Error::option("--trial", args.trial.unwrap_or(0), "has a second push", accepted));
    }
    let bounds = PushBounds::new(config.horizon_s);
    // Where a trial has a slope, no push may start before the ground has tilted.
    let earliest_s =
        campaign.filter(|_| args.trial.is_some()).map_or(0.0, |campaign| campaign.push_bounds().start_s[0]);
    let within = |name: &str, value: f64, [least, most]: [f64; 2]| {
        in_range("command line", name, value, [least, most]).map(|()| value)
    };
    pushes[0] = Push {
        impulse_n_s: within("--impulse", args.impulse.unwrap_or(base.impulse_n_s), bounds.impulse_n_s)?,
        heading_deg: within("--heading", args.heading.unwrap_or(base.heading_deg), bounds.heading_deg)?,
        height_m: match args.height {
            Some(height_m) => at_robot(height_m, robot)?,
            None => base.height_m,
        },
        duration_s: within("--duration", args.duration.unwrap_or(base.duration_s), [1e-3, config.horizon_s])?,
        start_s: within("--start", args.start.unwrap_or(base.start_s), [earliest_s, config.horizon_s])?,
        profile: args.profile.unwrap_or(base.profile),
    };
    let end_s = pushes.iter().map(Push::end_s).fold(0.0, f64::max);
    if end_s > config.horizon_s {
        let (problem, accepted) = ("the push does not end in time", format!("more than {end_s}, the end of the push"));
        return Err(Error::option("--horizon", config.horizon_s, problem, accepted));
    }
    Ok(pushes)
}

/// Checks that a height above the COM at home (m) is one of the robot, from its soles to its top, to a centimetre outwards.
fn at_robot(height_m: f64, robot: &Robot) -> Result<f64> {
    let at_home = Kinematics::at_home(robot);
    let top_of = |(i, link): (usize, &Link)| {
        let pose = at_home.link_pose(i);
        let up = pose.rotation.inverse() * Vector3::z();
        link.drawn().iter().map(|solid| pose.translation.z + solid.reach_m(&up)).fold(pose.translation.z, f64::max)
    };
    let com_m = at_home.com().z;
    let top_m = robot.links.iter().enumerate().map(top_of).fold(com_m, f64::max) - com_m;
    let (least, most) = ((-robot.home_com_height() * 100.0).floor() / 100.0, (top_m * 100.0).ceil() / 100.0);
    if (least..=most).contains(&height_m) {
        return Ok(height_m);
    }
    let accepted = format!("{least} to {most} m, from its soles to its top");
    Err(Error::option("--height", height_m, "is above or below the robot", accepted))
}
