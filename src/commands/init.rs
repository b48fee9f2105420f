//! `standfast init`: writes the settings of a robot, inferred from its URDF, or the file of a policy, from what its
//! training left.

use super::arguments::{is_file_of, number};
use super::terminal::{note, print, tell};
use standfast_controllers::PolicyFile;
use standfast_core::error::{Error, Result};
use standfast_core::robot::{Robot, Units};
use standfast_files::assets::{self, InputKind, Source};
use standfast_files::{
    folder_of, is_no_file, is_same_file, is_same_folder, shell_word, write_atomic,
};
use standfast_report::{text::layout::entry, text::model};
use standfast_robots::urdf;
use standfast_sim::episode::unpushed::UnpushedEpisode;
use standfast_sim::episode::{CONTROL_PERIOD_S, Disturbance, EpisodeConfig};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

#[derive(Debug, clap::Args)]
#[command(
    override_usage = "standfast init [OPTIONS] <ROBOT.urdf>\n       standfast init [OPTIONS] --robot <ROBOT.urdf> <POLICY.onnx>",
    after_help = "Of a robot are inferred the feet, the trunk, the soles, the home posture, the servos,
sensor noise and delay, and where a foot can land. Each figure of the file says
whether it was read, solved or assumed; edit what you know better. An SRDF beside
the URDF gives the home posture. A robot without such a file runs with the same
settings. Macros (xacro) are expanded by the program `xacro`.

Of a policy are read joints, gains and what it observes: from the deploy.yaml of
unitree_rl_lab, a configuration of unitree_rl_gym, or the metadata that holosoma
and mjlab write into the network. The file is called as the policy, and lies
beside it."
)]
pub struct InitArgs {
    /// URDF file of a humanoid, or ONNX file of a policy
    #[arg(value_name = "ROBOT.urdf|POLICY.onnx")]
    pub file: String,
    /// The robot of a policy, by name or URDF file
    #[arg(long, value_name = "NAME|FILE")]
    pub robot: Option<String>,
    /// The description of a policy, if it does not lie where its trainer puts it
    #[arg(long, value_name = "FILE.yaml", requires = "robot")]
    pub from: Option<PathBuf>,
    /// Range of the robot's joints that have none in the URDF, to both sides (rad); otherwise they are locked
    #[arg(long, value_name = "RAD", value_parser = number)]
    pub range: Option<f64>,
    /// Where to write; by default a .toml file of the same name beside the URDF or the policy
    #[arg(short, long, value_name = "FILE", conflicts_with = "print")]
    pub out: Option<PathBuf>,
    /// Print the file instead of writing it
    #[arg(long)]
    pub print: bool,
    /// Replace a file that is there
    #[arg(long, conflicts_with = "print")]
    pub force: bool,
    /// Print what was understood as one JSON object; of a robot, as `standfast model` does
    #[arg(long, conflicts_with = "print")]
    pub json: bool,
}

pub fn run(args: &InitArgs) -> Result<ExitCode> {
    if is_file_of(&args.file, "onnx") {
        return policy(args);
    }
    assets::refuse_other_kind(InputKind::Robot, &args.file)?;
    if let Some(robot) = &args.robot {
        let (problem, accepted) = ("is for the robot of a policy", "none with a URDF");
        return Err(Error::option("--robot", robot, problem, accepted));
    }
    // The URDF is read first of all, since a file of another kind has no settings.
    let urdf = urdf::opened(&args.file)?;
    let usual = urdf::settings_path(&args.file);
    args.check_place(&urdf, &usual)?;
    // The stated soles alone are kept, and the other settings are inferred.
    let kept = usual
        .is_file()
        .then(|| assets::text(&usual).ok())
        .flatten()
        .filter(urdf::states_soles_alone);
    let path = if kept.is_some() && args.out.is_none() {
        usual
    } else {
        args.path(usual)?
    };
    let settings = urdf::completed(&urdf, args.range, kept.as_ref())?;
    let robot = standfast_robots::parse(&urdf, &settings)?;
    if args.print {
        return print(&settings.text);
    }
    let stands = stands(&robot).unwrap_or_else(|error| Err(error.to_string()));
    write_atomic(&path, settings.text.as_bytes())?;
    print(&match args.json {
        true => standfast_report::json(&model::kinematics_json(&robot, &robot.zero_posture().q)),
        false => model::description(&robot),
    })?;
    note("");
    match stands {
        Ok([left, right]) => tell(
            "",
            &format!(
                "It stands: with stiff joints its left sole carries {left:.0} % of the weight, and its right one {right:.0} %."
            ),
        ),
        Err(problem) => log::warn!("{problem}"),
    }
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
            path.display()
        ),
    );
    if !is_same_folder(folder_of(&path), folder_of(Path::new(&args.file))) {
        tell(
            "",
            &format!("It is read once it lies beside {}.", args.file),
        );
    }
    Ok(ExitCode::SUCCESS)
}

/// Largest share of a joint's torque limit that carrying the robot on one leg may take without a word about the joint
/// ([`Robot::hardest_on_one_leg`]).
const MOST_ON_ONE_LEG: f64 = 0.6;

/// What the left and the right sole carry (% of the weight) of a robot that stands for a moment with stiff joints; if
/// it does not, how it falls, and the likely cause.
fn stands(robot: &Robot) -> Result<Result<[f64; 2], String>> {
    /// Time that the robot has to stand, in units of the robot's time: about a second for UT-mu2.
    const MOMENT: f64 = 6.0;
    let units = Units::of(robot);
    let config = EpisodeConfig {
        horizon_s: MOMENT * units.time_s(),
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
    let Some(name) = args.robot.as_deref() else {
        return Err(Error::option(
            "--robot",
            "(none)",
            "is needed with a policy",
            "its robot, by name or URDF file",
        ));
    };
    let usual = model.with_extension("toml");
    // Nothing that is read here may be replaced, even with --force.
    let taken = [
        model.to_path_buf(),
        PathBuf::from(name),
        urdf::settings_path(name),
    ];
    let out = args.out.as_ref().unwrap_or(&usual);
    if taken
        .iter()
        .chain(&args.from)
        .any(|taken| is_same_file(taken, out))
    {
        let accepted = "another file beside the policy";
        return Err(Error::option(
            "--out",
            out.display(),
            "is a file of the policy or of its robot",
            accepted,
        ));
    }
    let path = args.path(usual)?;
    if !is_same_folder(folder_of(&path), folder_of(model)) {
        let accepted = "a file in the folder of the policy";
        return Err(Error::option(
            "--out",
            path.display(),
            "does not lie beside the policy",
            accepted,
        ));
    }
    let robot = standfast_robots::load(name)?;
    let PolicyFile { text, by, assumed } =
        crate::leaves::policy_file(model, args.from.as_deref(), &robot)?;
    // A network with other sizes, or joints that the robot lacks, are found here.
    let settings = standfast_controllers::read(&Source {
        file: path.to_string_lossy().into(),
        text: text.clone(),
    })?;
    settings.prepare(&robot, CONTROL_PERIOD_S)?;
    if args.print {
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
    Ok(ExitCode::SUCCESS)
}

impl InitArgs {
    /// Fails if the settings of a robot would be written where no command reads them.
    fn check_place(&self, urdf: &Source, usual: &Path) -> Result<()> {
        let out = self.out.as_deref().unwrap_or(usual);
        let fail = |problem, accepted: &str| {
            Err(Error::value(
                "init",
                "--out",
                out.display(),
                problem,
                accepted,
            ))
        };
        if self.print {
            return Ok(());
        }
        if urdf.is_builtin() {
            return fail(
                "is read by no command, since this robot has its settings within it",
                "--print",
            );
        }
        if is_same_file(out, Path::new(&self.file)) {
            return fail(
                "it is the robot's URDF",
                "another file than that of the robot",
            );
        }
        if out.file_name() != usual.file_name() {
            let problem = "is read by no command, since the settings of a robot lie beside its URDF and are called as it is";
            return fail(problem, &format!("{}, or --print", usual.display()));
        }
        Ok(())
    }

    /// Where to write. Fails if a file is there already that is not to be replaced.
    fn path(&self, usual: PathBuf) -> Result<PathBuf> {
        let path = self.out.clone().unwrap_or(usual);
        if !self.print && is_no_file(&path) {
            let problem = "it is no file, but a folder, pipe or device";
            return Err(Error::value(
                "init",
                "--out",
                path.display(),
                problem,
                "a file, or --print",
            ));
        }
        if self.print || self.force || !path.exists() {
            return Ok(path);
        }
        let accepted = "a file that is not there yet, --force to replace it, or --print";
        Err(Error::value(
            "init",
            "--out",
            path.display(),
            "this file is there already",
            accepted,
        ))
    }
}
