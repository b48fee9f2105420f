//! `standfast init`: writes the settings of a robot, inferred from its URDF or MJCF, or the file of a policy, from what its
//! training left.

use super::arguments::{MotorsArgs, is_file_of, number};
use super::terminal::{note, print, tell};
use standfast_controllers::PolicyFile;
use standfast_core::error::{Error, Result};
use standfast_core::robot::{Robot, Units};
use standfast_files::assets::{self, InputKind, Source};
use standfast_files::{is_no_file, is_same_file, shell_word, write_atomic};
use standfast_report::{text::layout::entry, text::model};
use standfast_robots::urdf;
use standfast_sim::episode::unpushed::UnpushedEpisode;
use standfast_sim::episode::{CONTROL_PERIOD_S, Disturbance, EpisodeConfig};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(
    override_usage = "standfast init [OPTIONS] <ROBOT.urdf>\n       standfast init [OPTIONS] --robot <ROBOT.urdf> <POLICY> [FILE.yaml]",
    after_help = "Of a robot are inferred the feet, the trunk, the soles, the home posture, the
servos, sensor noise and delay, and where a foot can land. Each figure of the
file says whether it was read, solved or assumed; edit what you know better. An
SRDF beside the URDF, or a keyframe of the MJCF, gives the home posture. Macros
are expanded by the program `xacro`. The robot has to stand with these settings.
A robot without a file of settings runs with the same ones.

Of a policy, as ONNX or TorchScript, are read joints, gains and what it observes:
from the metadata that holosoma and mjlab write into the network, or from a file
of unitree_rl_lab, unitree_rl_gym, booster_gym, HumanoidVerse (ASAP, FALCON),
rl_sar, LEAPP or Isaac Lab (IO_descriptors).

The file lies beside that of the robot or the policy, and is called as it is. With
--dry-run it is printed, and nothing is written. --range is for joints that have
no range in the file, to both sides; without it they are locked."
)]
pub struct InitArgs {
    /// URDF or MJCF file of a humanoid, or ONNX or TorchScript file of a policy
    #[arg(value_name = "ROBOT.urdf|POLICY.onnx|.pt")]
    pub file: String,
    /// Description of a policy [default: where its trainer puts it]
    #[arg(value_name = "FILE.yaml", requires = "robot")]
    pub description: Option<PathBuf>,
    /// The robot of a policy, by name, or URDF or MJCF file
    #[arg(long, value_name = "NAME|FILE")]
    pub robot: Option<String>,
    /// Range of joints that have none in the robot's file (rad)
    #[arg(long, value_name = "RAD", value_parser = number)]
    pub range: Option<f64>,
    #[command(flatten)]
    pub motors: MotorsArgs,
    /// Print the file instead of writing it
    #[arg(long)]
    pub dry_run: bool,
    /// Replace a file that is there
    #[arg(long, conflicts_with = "dry_run")]
    pub force: bool,
    /// Print what was understood as one JSON object
    #[arg(long, conflicts_with = "dry_run")]
    pub json: bool,
}

pub fn run(args: &InitArgs) -> Result<ExitCode> {
    if is_file_of(&args.file, "onnx") || is_file_of(&args.file, "pt") {
        return policy(args);
    }
    assets::refuse_other_kind(InputKind::Robot, &args.file)?;
    if let Some(robot) = &args.robot {
        let (problem, accepted) = ("is for the robot of a policy", "none with a robot");
        return Err(Error::option("--robot", robot, problem, accepted));
    }
    // The URDF is read first of all, since a file of another kind has no settings.
    let urdf = urdf::opened(&args.file)?;
    let usual = urdf::settings_path(&args.file);
    if urdf.is_builtin() && !args.dry_run {
        let (problem, accepted) = ("has its settings within it", "a URDF or MJCF, or --dry-run");
        return Err(Error::value("init", "robot", &args.file, problem, accepted));
    }
    // The stated soles alone are kept, and the other settings are inferred.
    let kept = usual
        .is_file()
        .then(|| assets::text(&usual).ok())
        .flatten()
        .filter(urdf::states_soles_alone);
    if kept.is_none() {
        args.check_place(&usual)?;
    }
    let settings = urdf::completed(
        &urdf,
        args.range,
        kept.as_ref(),
        args.motors.file.as_deref(),
    )?;
    let robot = standfast_robots::parse(&urdf, &settings)?;
    if args.dry_run {
        return print(&settings.text);
    }
    let [left, right] = stands(&robot)
        .unwrap_or_else(|error| Err(error.to_string()))
        .map_err(|problem| {
            let accepted = "a robot that stands; --dry-run prints the settings as they were found, to be corrected by hand";
            Error::value(&args.file, "settings", "(inferred)", problem, accepted)
        })?;
    write_atomic(&usual, settings.text.as_bytes())?;
    print(&match args.json {
        true => standfast_report::json(&model::kinematics_json(&robot, &robot.zero_posture().q)),
        false => model::description(&robot),
    })?;
    note("");
    tell(
        "",
        &format!(
            "It stands: with stiff joints its left sole carries {left:.0} % of the weight, and its right one {right:.0} %."
        ),
    );
    if let Some((joint, share)) = robot
        .hardest_on_one_leg()
        .filter(|(_, share)| *share > MOST_ON_ONE_LEG)
    {
        let (name, percent) = (&robot.joints[joint].name, 100.0 * share);
        log::warn!(
            "On one leg, {name} needs {percent:.0} % of its torque to carry the robot. What is left may be too little \
             for footsteps: the body sinks, and the foot lands too soon. Look at [home_rad] (straighter knees need less), \
             and at the torques of [[servos]]"
        );
    }
    let soles = if kept.is_some() {
        " Its soles are those that were stated there."
    } else {
        ""
    };
    tell(
        "",
        &format!(
            "Written: {}.{soles} Look at what is marked as assumed, and edit it.",
            usual.display()
        ),
    );
    Ok(ExitCode::SUCCESS)
}

/// Largest share of a joint's torque limit that carrying the robot on one leg may take without a word about the joint
/// ([`Robot::hardest_on_one_leg`]).
const MOST_ON_ONE_LEG: f64 = 0.6;

/// What the left and the right sole carry (% of the weight) of a robot that stands for some seconds with stiff joints; if
/// it does not, how it falls, and the likely cause.
fn stands(robot: &Robot) -> Result<Result<[f64; 2], String>> {
    /// Time that the robot has to stand, in units of the robot's time: 3 s for UT-mu2. One on its toes falls later than after
    /// a second.
    const STANDS: f64 = 17.0;
    let units = Units::of(robot);
    let config = EpisodeConfig {
        horizon_s: STANDS * units.time_s(),
        ..EpisodeConfig::of(&units)
    };
    let stiff = standfast_controllers::load("hold")?.prepare(robot, config.control_period_s)?;
    let alone = UnpushedEpisode::run(robot, &stiff, &config, Disturbance::default())?;
    if !alone.is_lost() {
        return Ok(Ok(alone.carried.map(|share| 100.0 * share)));
    }
    let touches = alone
        .record
        .fall_cause
        .as_deref()
        .is_some_and(|cause| cause.ends_with("touched the ground"));
    let cause = match touches && alone.record.end_s < units.time_s() {
        true => {
            "that link reaches below the soles as they were found: state [soles], or mend its collision geometry"
        }
        false => "look at the soles, at [home_rad], and at the stiffness and torques of [[servos]]",
    };
    Ok(Err(format!(
        "with stiff joints it {}. Likely {cause}",
        alone.how_lost(robot)
    )))
}

/// Writes the file of a policy.
fn policy(args: &InitArgs) -> Result<ExitCode> {
    let model = Path::new(&args.file);
    if let Some(motors) = &args.motors.file {
        let (problem, accepted) = ("belong to the robot", "none with a policy");
        return Err(Error::option("--motors", motors, problem, accepted));
    }
    let Some(name) = args.robot.as_deref() else {
        return Err(Error::option(
            "--robot",
            "(none)",
            "is needed with a policy",
            "its robot, by name, or URDF or MJCF file",
        ));
    };
    let path = model.with_extension("toml");
    // Nothing that is read here may be replaced, even with --force.
    let settings = urdf::settings_path(name);
    let mut read = std::iter::once(&settings).chain(&args.description);
    if read.any(|file| is_same_file(file, &path)) {
        let problem = "is a file of the policy or of its robot";
        let accepted = "a policy of another name";
        return Err(Error::value(
            "init",
            "file",
            path.display(),
            problem,
            accepted,
        ));
    }
    args.check_place(&path)?;
    let robot = standfast_robots::load(name)?;
    let PolicyFile { text, by, assumed } =
        crate::leaves::policy_file(model, args.description.as_deref(), &robot)?;
    // A network with other sizes, or joints that the robot lacks, are found here.
    let settings = standfast_controllers::read(&Source {
        file: path.to_string_lossy().into(),
        text: text.clone(),
    })?;
    settings.prepare(&robot, CONTROL_PERIOD_S)?;
    if args.dry_run {
        return print(&text);
    }
    write_atomic(&path, text.as_bytes())?;
    let tree = settings.tree();
    let list = |key: &str| {
        tree.get(key)
            .and_then(toml::Value::as_array)
            .cloned()
            .unwrap_or_default()
    };
    let mut observed = Vec::new();
    for term in list("observation") {
        let name = term
            .get("term")
            .and_then(toml::Value::as_str)
            .unwrap_or_default();
        observed.push(
            match term.get("history").and_then(toml::Value::as_integer) {
                Some(history) if history > 1 => format!("{name} x {history}"),
                _ => name.to_string(),
            },
        );
    }
    let mut entries = vec![
        (
            "policy",
            format!(
                "{} drives {} of the {} joints of {}",
                settings.name(),
                list("joints").len(),
                robot.joints.len(),
                robot.name
            ),
        ),
        ("trained", format!("by {by}")),
        ("observes", observed.join(", ")),
    ];
    let difference = settings.trained_otherwise(&robot);
    let on_motors = match &difference {
        Some(difference) => format!("trained with other {difference}"),
        None if tree
            .get("training")
            .and_then(toml::Value::as_table)
            .is_some_and(|training| !training.is_empty()) =>
        {
            "as it was trained".into()
        }
        None => "it is not known with which it was trained".into(),
    };
    entries.push(("motors", on_motors));
    entries.extend(assumed.into_iter().map(|assumed| ("assumed", assumed)));
    print(&match args.json {
        true => standfast_report::json(&tree),
        false => entries
            .iter()
            .map(|(label, what)| entry(label, what))
            .collect(),
    })?;
    note("");
    let [file, robot] = [&path.to_string_lossy()[..], name].map(shell_word);
    tell("", &format!("Written: {}. Try it:", path.display()));
    note(&format!("  standfast check {file} --robot {robot}"));
    if difference.is_some() {
        note(&format!(
            "  standfast check {file} --robot {robot} --motors {file}"
        ));
    }
    Ok(ExitCode::SUCCESS)
}

impl InitArgs {
    /// Fails if a file is there already that is not to be replaced.
    fn check_place(&self, path: &Path) -> Result<()> {
        let fail = |problem, accepted| {
            Err(Error::value(
                "init",
                "file",
                path.display(),
                problem,
                accepted,
            ))
        };
        if self.dry_run {
            Ok(())
        } else if is_no_file(path) {
            let problem = "it is no file, but a folder, pipe or device";
            fail(problem, "a file, or --dry-run")
        } else if path.exists() && !self.force {
            let accepted = "none there yet, --force to replace it, or --dry-run, which prints it";
            fail("this file is there already", accepted)
        } else {
            Ok(())
        }
    }
}
