//! The metadata in an ONNX file: what holosoma and mjlab write there.

use super::known::{Figure, Training, plain, quantity, scaled};
use crate::contest::onnx::observation::{Gait, Quantity, Scale};
use crate::error::{Error, Result};
use crate::robot::Robot;
use std::collections::HashMap;
use std::f64::consts::PI;

/// The usual time between two actions (s), which neither states.
const USUAL_PERIOD_S: f64 = 0.02;

/// The training that these metadata tell of. None if they are of no known trainer.
pub fn training(file: &str, metadata: &HashMap<String, String>, robot: &Robot) -> Result<Option<Training>> {
    let read = Metadata { file, metadata };
    if metadata.contains_key("dof_names") {
        read.holosoma(robot).map(Some)
    } else if metadata.contains_key("observation_names") {
        read.mjlab().map(Some)
    } else {
        Ok(None)
    }
}

struct Metadata<'a> {
    file: &'a str,
    metadata: &'a HashMap<String, String>,
}

impl Metadata<'_> {
    fn text(&self, key: &str) -> Result<&str> {
        let missing = || Error::value(self.file, format!("metadata.{key}"), "(none)", "is missing", "a list");
        self.metadata.get(key).map(String::as_str).ok_or_else(missing)
    }

    /// A list, in JSON or separated by commas.
    fn words(&self, key: &str) -> Result<Vec<String>> {
        let inner = self.text(key)?.trim().trim_start_matches('[').trim_end_matches(']');
        Ok(inner.split(',').map(|word| word.trim().trim_matches(['"', '\'']).to_string()).collect())
    }

    fn numbers(&self, key: &str) -> Result<Vec<f64>> {
        let number = |word: String| {
            let bad = |_| Error::value(self.file, format!("metadata.{key}"), &word, "is no number", "numbers");
            word.parse().map_err(bad)
        };
        self.words(key)?.into_iter().map(number).collect()
    }

    fn mjlab(&self) -> Result<Training> {
        let joints = self.words("joint_names")?;
        let term = |name: &String| quantity(self.file, "metadata.observation_names", name).map(plain);
        let terms = self.words("observation_names")?.iter().map(term).collect::<Result<_>>()?;
        let scale = match self.numbers("action_scale")?[..] {
            [one] => vec![one; joints.len()],
            ref each => each.to_vec(),
        };
        Ok(Training {
            by: format!("mjlab, the metadata of {}", self.file),
            period_s: Figure::assumed(USUAL_PERIOD_S, "mjlab's usual one"),
            default_rad: Figure::read(self.numbers("default_joint_pos")?),
            action_scale: Figure::read(scale),
            action_clip: None,
            stiffness: Figure::read(self.numbers("joint_stiffness")?),
            damping: Figure::read(self.numbers("joint_damping")?),
            joints: Figure::read(joints),
            gait: None,
            observation: Figure::inferred(
                terms,
                "its observation_names; scale, clip and history are mjlab's usual ones, none",
            ),
        })
    }

    fn holosoma(&self, robot: &Robot) -> Result<Training> {
        let joints = self.words("dof_names")?;
        // Its program sorts the terms by name.
        let terms = vec![
            plain(Quantity::LastAction),
            scaled(Quantity::BaseAngularVelocity, Scale::All(0.25)),
            plain(Quantity::CommandTurn),
            plain(Quantity::CommandWalk),
            plain(Quantity::PhaseCos),
            plain(Quantity::JointPositions),
            scaled(Quantity::JointVelocities, Scale::All(0.05)),
            plain(Quantity::ProjectedGravity),
            plain(Quantity::PhaseSin),
        ];
        let usual = "that of holosoma's locomotion";
        Ok(Training {
            by: format!("holosoma, the metadata of {}", self.file),
            period_s: Figure::assumed(USUAL_PERIOD_S, usual),
            default_rad: holosoma_posture(&joints, robot),
            action_scale: Figure::assumed(vec![0.25; joints.len()], usual),
            action_clip: Some(Figure::assumed(100.0, usual)),
            stiffness: Figure::read(self.numbers("kp")?),
            damping: Figure::read(self.numbers("kd")?),
            gait: Some(Figure::assumed(
                Gait { hz: 1.0, start_rad: [0.0, PI], standing_rad: Some([PI; 2]) },
                "that of holosoma's locomotion: a period of 1 s, and both feet at pi while it stands",
            )),
            observation: Figure::assumed(terms, "the terms of holosoma's locomotion"),
            joints: Figure::read(joints),
        })
    }
}

/// The angles at the action 0 (rad), which holosoma has in its program and not in its files: those of the robot that has
/// these joints. Of an unknown robot, those of its home.
fn holosoma_posture(joints: &[String], robot: &Robot) -> Figure<Vec<f64>> {
    // By robot: a joint that tells it, and the angles that are not 0, by parts of names.
    type Angles = &'static [(&'static str, f64)];
    const G1: Angles = &[
        ("hip_pitch", -0.312),
        ("knee", 0.669),
        ("ankle_pitch", -0.363),
        ("shoulder_pitch", 0.2),
        ("left_shoulder_roll", 0.2),
        ("right_shoulder_roll", -0.2),
        ("elbow", 0.6),
    ];
    const T1: Angles = &[
        ("Shoulder_Pitch", 0.2),
        ("Left_Shoulder_Roll", -1.35),
        ("Right_Shoulder_Roll", 1.35),
        ("Left_Elbow_Yaw", -0.5),
        ("Right_Elbow_Yaw", 0.5),
        ("Hip_Pitch", -0.2),
        ("Knee_Pitch", 0.4),
        ("Ankle_Pitch", -0.25),
    ];
    let robots = [("left_wrist_yaw_joint", G1, "G1"), ("AAHead_yaw", T1, "T1")];
    let Some((_, angles, name)) = robots.into_iter().find(|(tells, ..)| joints.iter().any(|joint| joint == tells))
    else {
        let at_home = |name: &String| {
            let joint = robot.joints.iter().position(|joint| joint.name == *name);
            joint.map_or(0.0, |joint| robot.home_rad[joint])
        };
        return Figure::assumed(joints.iter().map(at_home).collect(), "those of the robot's home, as none are stated");
    };
    let angle = |joint: &String| angles.iter().find(|(part, _)| joint.contains(part)).map_or(0.0, |(_, angle)| *angle);
    Figure::assumed(joints.iter().map(angle).collect(), format!("those of holosoma's {name}"))
}
