//! `standfast push`: simulates one push, and tells what happened and why.

use super::arguments::{
    CampaignArgs, CheckArgs, ENGINES, JUDGES, MOST_SEED, MOST_TRIAL, count, fine, number, one_of,
};
use super::episode::{self, OutputArgs, Setting, command_line};
use super::terminal::print;
use nalgebra::Vector3;
use standfast_core::error::{Error, Result};
use standfast_core::robot::{Kinematics, Robot, Units};
use standfast_sim::episode::{Counts, Disturbance, EpisodeConfig, EpisodeRun};
use standfast_sim::{Engine, Profile, Push, Variation};
use standfast_study::ask::bounds::in_range;
use standfast_study::ask::trial;
use standfast_study::{Campaign, Overrides, PushBounds};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(allow_negative_numbers = true)]
#[command(after_help = "Examples:
  standfast push                                    5 N s from behind
  standfast push --impulse 3 --heading -135 --controller hold
  standfast push --impulse 3.6 --controller paper   more than standing can take, so that it steps
  standfast push --impulse 2 --plot push.svg        COM, ZMP and feet over time, as a picture
  standfast push --impulse 2 --trace push.csv       every tick, as numbers
  standfast push --impulse 5 --replay push.html     a page to watch in 3D, in any browser
  standfast push --controller hold --controller catch@mujoco --replay push.html   two robots
  standfast push --campaign standard --trial 17     trial 17 of that campaign

A campaign gives sensor noise and thresholds, and its trial the pushes, the robot and
the ground; its values are the defaults then. Without a campaign the sensors are ideal,
and without a trial robot and ground are as designed. The defaults are the same push for
robots of every size, in their own units, and are printed. Exit code 1: the controller
failed, or the simulation diverged.")]
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
    /// Duration (s) [default: 0.05, scaled to the robot]
    #[arg(long, value_name = "S", value_parser = number)]
    pub duration: Option<f64>,
    /// Start (s) [default: 0.5, scaled to the robot]
    #[arg(long, value_name = "S", value_parser = number)]
    pub start: Option<f64>,
    /// Course of the force over time [default: rectangular]
    #[arg(long, value_parser = one_of::<Profile, 2>(["rectangular", "half-sine"]))]
    pub profile: Option<Profile>,
    /// Controller by name or file, with an engine of its own as in catch@mujoco; a second one is a ghost beside the first
    #[arg(
        long = "controller",
        visible_alias = "gains",
        value_name = "NAME|FILE",
        default_value = "catch"
    )]
    pub gains: Vec<String>,
    /// Robot by name or URDF file [default: that of the campaign, or ut-mu2]
    #[arg(long, value_name = "NAME|FILE")]
    pub robot: Option<String>,
    /// Physics engine [default: that of the campaign, or rapier]
    #[arg(long, value_name = "ENGINE", value_parser = one_of::<Engine, 2>(ENGINES))]
    pub engine: Option<Engine>,
    #[command(flatten)]
    pub campaign: CampaignArgs,
    /// Trial of the campaign: its pushes, robot, ground and noise
    #[arg(long, value_name = "I", requires = "of_campaign", value_parser = count::<u64>(0..=MOST_TRIAL))]
    pub trial: Option<u64>,
    /// In place of --trial, a trial of a search by `limit`, which prints its number
    #[arg(long, value_name = "I", requires = "of_campaign", conflicts_with = "trial", value_parser = count::<u64>(0..=MOST_TRIAL))]
    pub limit_trial: Option<u64>,
    /// Seed of the campaign, for its noise and trials [default: that of the campaign]
    #[arg(long, value_name = "S", value_parser = count::<u64>(0..=MOST_SEED))]
    pub seed: Option<u64>,
    /// Which episodes count: recovered, or survived [default: that of the campaign, or recovered]
    #[arg(long, value_name = "WHICH", value_parser = one_of::<Counts, 2>(JUDGES))]
    pub judge: Option<Counts>,
    /// Change a value of the campaign, such as sensors.noise_scale=2
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Length of the episode (s) [default: that of the campaign, or 6, scaled to the robot]
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
    args.check_campaign()?;
    let overrides = Overrides {
        set: args.set.clone(),
        seed: args.seed,
        judge: args.judge,
        engines: Vec::from_iter(args.engine),
        robot: args.robot.clone(),
        ..Overrides::default()
    };
    let setting = Setting::of(args.campaign.name(), &overrides, args.horizon)?;
    let Setting {
        campaign,
        robot,
        config,
    } = &setting;
    let pushes = the_pushes(args, campaign.as_ref(), config, robot)?;
    let entrants = setting.entrants(&args.gains)?;
    args.check_beside()?;
    args.outputs.check()?;
    args.outputs.check_length(config)?;
    if args.check.check {
        return fine(&format!(
            "a push of {} N s, controller {}",
            pushes[0].impulse_n_s, entrants[0].0.name
        ));
    }
    let disturbance = || {
        let of_trial = match campaign {
            Some(campaign) => trial::disturbance(campaign, args.any_trial().unwrap_or(0)),
            None => Disturbance::default(),
        };
        // Robot and ground vary only if a trial is named, since they belong to the trial.
        let variation = if args.any_trial().is_some() {
            of_trial.variation
        } else {
            Variation::default()
        };
        Disturbance {
            pushes: pushes.clone(),
            variation,
            ..of_trial
        }
    };
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

/// Tables of a campaign of which an episode takes something only as drawn for a trial.
const OF_TRIAL: [&str; 3] = ["push", "second_push", "variations"];

impl PushArgs {
    /// The trial of the episode: one of the campaign, or one of a search in it.
    fn any_trial(&self) -> Option<u64> {
        self.trial.or(self.limit_trial)
    }

    /// Fails for an option that would change nothing, since no campaign or no trial is named.
    fn check_campaign(&self) -> Result<()> {
        if self.campaign.name().is_none() {
            let accepted = "a campaign beside it, such as `standfast push nominal`";
            if let Some(seed) = self.seed {
                let problem = "changes nothing without a campaign: the sensors are ideal";
                return Err(Error::option("--seed", seed, problem, accepted));
            }
            if let Some(assignment) = self.set.first() {
                return Err(Error::option(
                    "--set",
                    assignment,
                    "changes a campaign, and none is named",
                    accepted,
                ));
            }
        }
        for assignment in &self.set {
            let key = assignment.split(['=', '.']).next().unwrap_or_default();
            if self.any_trial().is_none() && OF_TRIAL.contains(&key.trim()) {
                let (problem, accepted) = (
                    "changes nothing without a trial",
                    "--trial beside it, or --impulse, --heading and the like",
                );
                return Err(Error::option("--set", assignment, problem, accepted));
            }
        }
        Ok(())
    }

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

/// The pushes of the episode: the pushes of the named trial or, if no trial is named, one push from behind. The options
/// change the first push. Fails for a value out of range, or if a push does not end within the horizon.
fn the_pushes(
    args: &PushArgs,
    campaign: Option<&Campaign>,
    config: &EpisodeConfig,
    robot: &Robot,
) -> Result<Vec<Push>> {
    if let (Some(campaign), Some(index)) = (campaign, args.trial) {
        campaign.check_trial(index)?;
    }
    let mut pushes = match (campaign, args.any_trial()) {
        (Some(campaign), Some(index)) => trial::pushes(campaign, index),
        _ => vec![Push::first(&Units::of(robot))],
    };
    let base = pushes[0];
    // The time, height and duration of the second push follow from the first push.
    let moves_second = args.start.is_some()
        || args.duration.is_some()
        || args.height.is_some()
        || args.profile.is_some();
    if pushes.len() > 1 && moves_second {
        let accepted = "--impulse and --heading, or --set on the campaign in a file";
        return Err(Error::option(
            "--trial",
            args.any_trial().unwrap_or(0),
            "has a second push",
            accepted,
        ));
    }
    let bounds = PushBounds::new(config.horizon_s);
    // Where a trial has a slope, no push may start before the ground has tilted.
    let earliest_s = campaign
        .filter(|_| args.any_trial().is_some())
        .map_or(0.0, |campaign| campaign.push_bounds().start_s[0]);
    let within = |name: &str, value: f64, range: [f64; 2]| {
        in_range("command line", name, value, range).map(|()| value)
    };
    pushes[0] = Push {
        impulse_n_s: within(
            "--impulse",
            args.impulse.unwrap_or(base.impulse_n_s),
            bounds.impulse_n_s,
        )?,
        heading_deg: within(
            "--heading",
            args.heading.unwrap_or(base.heading_deg),
            bounds.heading_deg,
        )?,
        height_m: match args.height {
            Some(height_m) => at_robot(height_m, robot)?,
            None => base.height_m,
        },
        duration_s: within(
            "--duration",
            args.duration.unwrap_or(base.duration_s),
            [1e-3, config.horizon_s],
        )?,
        start_s: within(
            "--start",
            args.start.unwrap_or(base.start_s),
            [earliest_s, config.horizon_s],
        )?,
        profile: args.profile.unwrap_or(base.profile),
    };
    let end_s = pushes.iter().map(Push::end_s).fold(0.0, f64::max);
    if end_s > config.horizon_s {
        let (problem, accepted) = (
            "the push does not end in time",
            format!("more than {end_s}, the end of the push"),
        );
        return Err(Error::option(
            "--horizon",
            config.horizon_s,
            problem,
            accepted,
        ));
    }
    Ok(pushes)
}

/// Checks that a height above the COM at home (m) is one of the robot, from its soles to its top, to a centimetre
/// outwards.
fn at_robot(height_m: f64, robot: &Robot) -> Result<f64> {
    let at_home = Kinematics::at_home(robot);
    let com_m = at_home.com().z;
    let mut top_m = com_m;
    for (i, link) in robot.links.iter().enumerate() {
        let pose = at_home.link_pose(i);
        let up = pose.rotation.inverse() * Vector3::z();
        top_m = top_m.max(pose.translation.z);
        for solid in link.drawn() {
            top_m = top_m.max(pose.translation.z + solid.reach_m(&up));
        }
    }
    let (least, most) = (
        (-robot.home_com_height() * 100.0).floor() / 100.0,
        ((top_m - com_m) * 100.0).ceil() / 100.0,
    );
    if (least..=most).contains(&height_m) {
        return Ok(height_m);
    }
    let accepted = format!("{least} to {most} m, from its soles to its top");
    Err(Error::option(
        "--height",
        height_m,
        "is above or below the robot",
        accepted,
    ))
}
