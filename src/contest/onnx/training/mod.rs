//! What the training of a policy left, read into its file: `standfast init POLICY.onnx`. Each figure says whether it was read,
//! inferred, or assumed as its trainer usually does it.

mod metadata;
mod text;
mod yaml;

use super::observation::{Gait, Quantity, Scale, Term};
use super::{Written, net};
use crate::contest::beside;
use crate::error::{Error, Result};
use crate::robot::Robot;
use std::path::{Path, PathBuf};

/// Longest description that is read (bytes).
const MOST_BYTES: u64 = 10_000_000;

/// A figure of a policy, and where it is from, in words.
pub(super) struct Figure<T> {
    value: T,
    origin: String,
}

impl<T> Figure<T> {
    fn read(value: T) -> Self {
        Self { value, origin: "read".into() }
    }

    fn inferred(value: T, why: impl Into<String>) -> Self {
        Self { value, origin: format!("inferred: {}", why.into()) }
    }

    fn assumed(value: T, why: impl Into<String>) -> Self {
        Self { value, origin: format!("assumed: {}", why.into()) }
    }
}

/// What is known of a policy. Lists of joints are in its own order.
pub(super) struct Training {
    /// Who trained it, and in which file that stands.
    by: String,
    period_s: Figure<f64>,
    joints: Figure<Vec<String>>,
    default_rad: Figure<Vec<f64>>,
    action_scale: Figure<Vec<f64>>,
    action_clip: Option<Figure<f64>>,
    stiffness: Figure<Vec<f64>>,
    damping: Figure<Vec<f64>>,
    gait: Option<Figure<Gait>>,
    observation: Figure<Vec<Term>>,
}

impl Training {
    /// The figures that are assumed, each with the reason.
    fn assumed(&self) -> Vec<String> {
        let Self {
            by: _,
            period_s,
            joints,
            default_rad,
            action_scale,
            action_clip,
            stiffness,
            damping,
            gait,
            observation,
        } = self;
        let mut origins = vec![
            ("period_s", &period_s.origin),
            ("joints", &joints.origin),
            ("default_rad", &default_rad.origin),
            ("action_scale", &action_scale.origin),
            ("stiffness", &stiffness.origin),
            ("damping", &damping.origin),
            ("observation", &observation.origin),
        ];
        origins.extend(action_clip.iter().map(|figure| ("action_clip", &figure.origin)));
        origins.extend(gait.iter().map(|figure| ("gait", &figure.origin)));
        let why = |(key, origin): (&str, &String)| origin.strip_prefix("assumed: ").map(|why| format!("{key}: {why}"));
        origins.into_iter().filter_map(why).collect()
    }
}

/// The file of the policy in `model` for a robot. It is read from the file `from`, or from one that lies where its trainer
/// puts it, or from the network's own metadata. Errors: none of these says what the policy observes, or what one says does
/// not fit the robot.
pub fn written(model: &Path, from: Option<&Path>, robot: &Robot) -> Result<Written> {
    let file = model.to_string_lossy();
    let bad = |problem: String, accepted: &str| Error::value(&file, "model", file.clone(), problem, accepted);
    let bytes = crate::assets::read(model, beside::MOST_FILE_BYTES)?;
    let metadata = net::metadata(&bytes).map_err(|problem| bad(problem, "an ONNX file"))?;
    let training = match from.map(PathBuf::from).or_else(|| description(model)) {
        Some(path) => {
            let text = String::from_utf8_lossy(&crate::assets::read(&path, MOST_BYTES)?).into_owned();
            yaml::training(&path.to_string_lossy(), &text, robot)?
        }
        None => metadata::training(&file, &metadata, robot)?.ok_or_else(|| {
            let accepted = "the metadata of holosoma or mjlab in it, or --from with a deploy.yaml of unitree_rl_lab or the \
                            configuration of unitree_rl_gym. The guide's chapter onnx.md has the file to write by hand";
            bad("says nothing of its joints and of what it observes".into(), accepted)
        })?,
    };
    Ok(Written { text: text::toml(model, &training), assumed: training.assumed(), by: training.by })
}

/// The description of a policy where its trainer puts it.
fn description(model: &Path) -> Option<PathBuf> {
    let folder = model.parent().unwrap_or(Path::new(""));
    let of_stem = |end: &str| model.with_extension(end);
    let exported =
        [folder.join("deploy.yaml"), folder.join("params/deploy.yaml"), folder.join("../params/deploy.yaml")];
    [of_stem("deploy.yaml"), of_stem("yaml")].into_iter().chain(exported).find(|path| path.is_file())
}

/// The quantity that Isaac Lab and mjlab call by this name, with their usual terms. Errors name `file` and `field`.
fn quantity(file: &str, field: &str, name: &str) -> Result<Quantity> {
    const KNOWN: [(&str, Quantity); 13] = [
        ("base_lin_vel", Quantity::BaseLinearVelocity),
        ("base_ang_vel", Quantity::BaseAngularVelocity),
        ("projected_gravity", Quantity::ProjectedGravity),
        ("velocity_commands", Quantity::Command),
        ("generated_commands", Quantity::Command),
        ("command", Quantity::Command),
        ("joint_pos_rel", Quantity::JointPositions),
        ("joint_pos", Quantity::JointPositions),
        ("joint_vel_rel", Quantity::JointVelocities),
        ("joint_vel", Quantity::JointVelocities),
        ("last_action", Quantity::LastAction),
        ("actions", Quantity::LastAction),
        ("gait_phase", Quantity::Phase),
    ];
    let found = KNOWN.into_iter().find(|(known, _)| *known == name).map(|(_, quantity)| quantity);
    found.ok_or_else(|| {
        let accepted = KNOWN.map(|(known, _)| known).join(", ");
        Error::value(file, field, name, "is no term that is known here", accepted)
    })
}

/// A term as it is, once.
fn plain(term: Quantity) -> Term {
    scaled(term, Scale::default())
}

fn scaled(term: Quantity, scale: Scale) -> Term {
    Term { term, scale, clip: None, history: 1 }
}

/// The clock of a gait with one phase, which has gone on by `period_s` (s) at the first observation.
fn one_phase(gait_period_s: f64, period_s: f64) -> Gait {
    let first_rad = std::f64::consts::TAU * period_s / gait_period_s;
    Gait { hz: 1.0 / gait_period_s, start_rad: [first_rad, first_rad + std::f64::consts::PI], standing_rad: None }
}
