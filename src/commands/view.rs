//! `standfast view`: shows the robot in a 3D window, live.

use super::arguments::{
    CampaignArgs, ENGINES, MOST_TRIAL, MotorsArgs, check_output, count, number, one_of,
};
use super::terminal::print;
use standfast_core::error::Result;
use standfast_sim::Engine;
use std::path::PathBuf;
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(allow_negative_numbers = true)]
#[command(after_help = "Examples:
  standfast view                               catch; keys 2 to 4: other controllers
  standfast view --controller hold --controller catch@mujoco     two robots
  standfast view harsh --trial 17              with a trial's pushes

Drag the robot with the mouse, or push it with Enter. With a campaign and
--trial, robot and ground are also those of the trial. A second controller is a
ghost beside the first, which gets the same pushes and pulls. The window lists
its keys. To see a trial of a result as it was: `standfast replay DIR --trial I`.

The window needs a display, a Vulkan driver, and a program that was built with
the feature `view`, which takes some twenty minutes on two cores. Without a
window, `standfast push --replay push.html` writes a page that shows a
push in a browser.")]
pub struct ViewArgs {
    /// Trial of the campaign: its robot, ground, noise and pushes
    #[arg(long, value_name = "I", requires = "of_campaign", value_parser = count::<u64>(0..=MOST_TRIAL))]
    pub trial: Option<u64>,
    /// Controller by name or file; a second one is a ghost [default: catch]
    #[arg(long = "controller", alias = "gains", value_name = "NAME|FILE")]
    pub gains: Vec<String>,
    /// Physics engine: rapier or mujoco
    #[arg(long, value_parser = one_of::<Engine, 2>(ENGINES), hide_possible_values = true)]
    pub engine: Option<Engine>,
    /// Robot by name, or URDF or MJCF file
    #[arg(long, value_name = "NAME|FILE")]
    pub robot: Option<String>,
    #[command(flatten)]
    pub motors: MotorsArgs,
    #[command(flatten)]
    pub campaign: CampaignArgs,
    /// Impulse of the push that Enter gives (N s) [default: 5, scaled to the robot]
    #[arg(long, value_name = "N_S", value_parser = number)]
    pub impulse: Option<f64>,
    /// Heading of that push (degrees): 0 is forward, 90 to the left
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = number)]
    pub heading: f64,
    /// Simulated seconds per second at the start
    #[arg(long, value_name = "RATIO", default_value_t = 1.0, value_parser = number)]
    pub speed: f64,
    /// Close the window after so many seconds
    #[arg(long, value_name = "S", value_parser = number)]
    pub seconds: Option<f64>,
    /// Write the window's last picture here
    #[arg(long, value_name = "FILE.png")]
    pub screenshot: Option<PathBuf>,
}

pub fn run(args: ViewArgs) -> Result<ExitCode> {
    if let Some(path) = &args.screenshot {
        check_output("--screenshot", path, &["png"])?;
    }
    print(&shown(args)?)
}

/// Shows the window until it is closed, and tells what came of it.
#[cfg(feature = "view")]
fn shown(args: ViewArgs) -> Result<String> {
    let overrides = standfast_study::Overrides {
        engines: Vec::from_iter(args.engine),
        robot: args.robot,
        motors: args.motors.file,
        ..Default::default()
    };
    let setting =
        super::episode::Setting::of(args.campaign.name(), overrides, args.trial.is_some())?;
    let (mut controllers, mut configs): (Vec<_>, Vec<_>) =
        setting.entrants(&args.gains)?.into_iter().unzip();
    if controllers.is_empty() {
        controllers = ["catch", "paper", "switching", "hold"]
            .into_iter()
            .map(|name| setting.controller(name))
            .collect::<Result<_>>()?;
        configs = vec![setting.campaign.episode];
    }
    if let Some(index) = args.trial {
        setting.campaign.check_trial(index)?;
    }
    // Without a campaign the sensors are ideal.
    let campaign = args.campaign.name().map(|_| setting.campaign);
    let world =
        standfast_window::LiveSetup::new(setting.robot, controllers, configs, campaign, args.trial);
    let options = standfast_window::Options {
        impulse: args.impulse,
        heading: args.heading,
        speed: args.speed,
        seconds: args.seconds,
        screenshot: args.screenshot,
    };
    standfast_window::run(&world, &options)
}

/// This build has no window. The error names the alternatives and the command that builds a window.
#[cfg(not(feature = "view"))]
fn shown(_: ViewArgs) -> Result<String> {
    Err(standfast_core::error::Error::NoWindow {
        missing: "this build of standfast has no window".into(),
        remedy:
            "to watch in a browser instead: `standfast push --replay push.html`, or `standfast replay DIR --trial I` \
                 for a trial of a result; to build standfast with a window: `cargo build --release --features view`, \
                 which takes some twenty minutes on two cores"
                .into(),
    })
}
