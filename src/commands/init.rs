//! `standfast init`: writes the settings of a robot, inferred from its URDF.

use super::terminal::{note, print, tell};
use crate::error::{Error, Result};
use crate::files::write_atomic;
use crate::render::{self, text::model};
use crate::robot::{Robot, urdf};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(
    override_usage = "standfast init [OPTIONS] <ROBOT.urdf>",
    after_help = "Inferred are the feet, the trunk, the soles, the home posture, the servos, sensor
noise and delay, and where a foot can land. Each figure of the file says whether
it was read, solved or assumed; edit what you know better. An SRDF beside the
URDF gives the home posture. A robot without such a file runs with the same
settings. Macros (xacro) are expanded by the program `xacro`."
)]
pub struct InitArgs {
    /// URDF file of a humanoid
    #[arg(value_name = "ROBOT.urdf")]
    pub robot: String,
    /// Where to write; by default a .toml file of the same name beside the URDF
    #[arg(long, value_name = "FILE", conflicts_with = "print")]
    pub out: Option<PathBuf>,
    /// Print the settings instead of writing them
    #[arg(long)]
    pub print: bool,
    /// Replace a file that is there
    #[arg(long, conflicts_with = "print")]
    pub force: bool,
    /// Print what was understood as one JSON object, as `standfast model` does
    #[arg(long, conflicts_with = "print")]
    pub json: bool,
}

pub fn run(args: &InitArgs) -> Result<ExitCode> {
    // First of all, since a file of another kind has no settings.
    let urdf = urdf::opened(&args.robot)?;
    let path = args.out.clone().unwrap_or_else(|| urdf::settings_path(&args.robot));
    if !args.print && !args.force && path.exists() {
        let accepted = "a file that is not there yet, --force to replace it, or --print";
        return Err(Error::value("init", "--out", path.display(), "this file is there already", accepted));
    }
    if path == Path::new(&args.robot) {
        let accepted = "another file than that of the robot";
        return Err(Error::value("init", "--out", path.display(), "it is the robot's URDF", accepted));
    }
    let settings = urdf::inferred(&urdf)?;
    let robot = Robot::parse(&urdf, &settings)?;
    if args.print {
        return print(&settings.text);
    }
    write_atomic(&path, settings.text.as_bytes())?;
    print(&match args.json {
        true => render::json(&model::kinematics_json(&robot, &robot.zero_posture().q)),
        false => model::description(&robot),
    })?;
    note("");
    tell("", &format!("Written: {}. Look at what is marked as assumed, and edit it.", path.display()));
    Ok(ExitCode::SUCCESS)
}
