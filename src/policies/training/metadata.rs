//! Reads the metadata that holosoma and mjlab write to an ONNX file.

use super::known::{Figure, Training, inertias_of_gains, plain, quantity, scaled};
use crate::ActionClip;
use crate::terms::{Gait, Quantity, Scale, Stack, Term};
use standfast_core::error::{Error, Result};
use standfast_core::robot::Robot;
use std::collections::HashMap;
use std::f64::consts::PI;

/// The usual time between two actions (s), which neither trainer states.
const USUAL_PERIOD_S: f64 = 0.02;

/// The training that these metadata describe. It is None if they are not from a known trainer.
pub fn training(
    file: &str,
    metadata: &HashMap<String, String>,
    robot: &Robot,
) -> Result<Option<Training>> {
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
        let text = self.metadata.get(key).map(String::as_str);
        text.ok_or_else(|| self.bad(key, "(none)", "is missing", "a list".into()))
    }

    /// A list, in JSON or separated by commas.
    fn words(&self, key: &str) -> Result<Vec<String>> {
        let inner = self
            .text(key)?
            .trim()
            .trim_start_matches('[')
            .trim_end_matches(']');
        Ok(inner
            .split(',')
            .map(|word| word.trim().trim_matches(['"', '\'']).to_string())
            .collect())
    }

    fn numbers(&self, key: &str) -> Result<Vec<f64>> {
        let mut numbers = Vec::new();
        for word in self.words(key)? {
            let number = word.parse();
            numbers
                .push(number.map_err(|_| self.bad(key, &word, "is no number", "numbers".into()))?);
        }
        Ok(numbers)
    }

    fn mjlab(&self) -> Result<Training> {
        let joints = self.words("joint_names")?;
        let terms = self.mjlab_terms()?;
        let (stiffness, damping) = (
            self.numbers("joint_stiffness")?,
            self.numbers("joint_damping")?,
        );
        let (scale, torques) = match self.numbers("action_scale")?[..] {
            [one] => (vec![one; joints.len()], None),
            ref each => {
                let torques = each
                    .iter()
                    .zip(&stiffness)
                    .map(|(scale, kp)| 4.0 * scale * kp)
                    .collect();
                let usual = "mjlab's usual action_scale is a quarter of them over the stiffness";
                (each.to_vec(), Some(Figure::assumed(torques, usual)))
            }
        };
        Ok(Training {
            by: format!("mjlab, the metadata of {}", self.file),
            period_s: Figure::assumed(USUAL_PERIOD_S, "mjlab's usual one"),
            default_rad: Figure::read(self.numbers("default_joint_pos")?),
            action_scale: Figure::read(scale),
            torque_n_m: torques,
            rotor_inertia_kg_m2: inertias_of_gains(&stiffness, &damping),
            stiffness: Figure::read(stiffness),
            damping: Figure::read(damping),
            joints: Figure::read(joints),
            observation: match self.metadata.contains_key("observation_terms_scale") {
                true => Figure::read(terms),
                false => Figure::inferred(
                    terms,
                    "its observation_names; scale, clip and history are mjlab's usual ones, none",
                ),
            },
            ..Training::default()
        })
    }

    /// The terms, with the scale, clip (`LEAST;MOST`, before scaling) and history that newer versions write for each.
    fn mjlab_terms(&self) -> Result<Vec<Term>> {
        let names = self.words("observation_names")?;
        let each = |key: &'static str| -> Result<Vec<String>> {
            if !self.metadata.contains_key(key) {
                return Ok(Vec::new());
            }
            let words = self.words(key)?;
            match words.len() == names.len() {
                true => Ok(words),
                false => {
                    let accepted = format!("one for each of its {} terms", names.len());
                    let value = format!("{} values", words.len());
                    Err(self.bad(
                        key,
                        &value,
                        "has another length than observation_names",
                        accepted,
                    ))
                }
            }
        };
        if let Some(flat) = each("observation_terms_flatten_history_dim")?
            .iter()
            .find(|flat| !["1", "true"].contains(&flat.to_lowercase().as_str()))
        {
            let key = "observation_terms_flatten_history_dim";
            return Err(self.bad(
                key,
                flat,
                "is not taken: the frames of a term follow each other",
                "1".into(),
            ));
        }
        let (scales, clips, histories) = (
            each("observation_terms_scale")?,
            each("observation_terms_clip")?,
            each("observation_terms_history_length")?,
        );
        let number = |key: &str, word: &str| {
            word.trim()
                .parse::<f64>()
                .map_err(|_| self.bad(key, word, "is no number", "numbers".into()))
        };
        let mut terms = Vec::new();
        for (i, name) in names.iter().enumerate() {
            let mut term = plain(quantity(self.file, "metadata.observation_names", name)?);
            let scale = match scales.get(i) {
                Some(word) => number("observation_terms_scale", word)?,
                None => 1.0,
            };
            term.scale = Scale::All(scale);
            if let Some(clip) = clips.get(i) {
                let ends: Vec<&str> = clip.split(';').collect();
                let [least, most] = ends[..] else {
                    return Err(self.bad(
                        "observation_terms_clip",
                        clip,
                        "is no pair of numbers",
                        "LEAST;MOST".into(),
                    ));
                };
                let most = number("observation_terms_clip", most)?;
                if number("observation_terms_clip", least)? != -most {
                    let problem = "is not the same on both sides";
                    return Err(self.bad("observation_terms_clip", clip, problem, "-A;A".into()));
                }
                term.clip = (most.is_finite()).then_some(most * scale.abs());
            }
            if let Some(word) = histories.get(i) {
                let key = "observation_terms_history_length";
                let count: usize = word
                    .parse()
                    .map_err(|_| self.bad(key, word, "is no whole number", "numbers".into()))?;
                term.history = Stack::of(count.max(1));
            }
            terms.push(term);
        }
        Ok(terms)
    }

    fn bad(&self, key: &str, value: &str, problem: &str, accepted: String) -> Error {
        Error::value(
            self.file,
            format!("metadata.{key}"),
            value,
            problem,
            accepted,
        )
    }

    fn holosoma(&self, robot: &Robot) -> Result<Training> {
        let joints = self.words("dof_names")?;
        // The program of holosoma sorts the terms by name.
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
        let (stiffness, damping, known) = (
            self.numbers("kp")?,
            self.numbers("kd")?,
            holosoma_robot(&joints),
        );
        let of_known = |list: fn(&Holosoma) -> Parts| {
            known.as_ref().map(|known| {
                Figure::assumed(
                    by_parts(&joints, list(known)),
                    format!("those of holosoma's {}", known.name),
                )
            })
        };
        let at_home = || {
            let angles = joints.iter().map(|name| {
                let joint = robot.joints.iter().position(|joint| joint.name == *name);
                joint.map_or(0.0, |joint| robot.home_rad[joint])
            });
            Figure::assumed(
                angles.collect(),
                "those of the robot's home, as none are stated",
            )
        };
        Ok(Training {
            by: format!("holosoma, the metadata of {}", self.file),
            period_s: Figure::assumed(USUAL_PERIOD_S, usual),
            default_rad: of_known(|known| known.default_rad).unwrap_or_else(at_home),
            action_scale: match self.metadata.contains_key("action_scale") {
                true => Figure::read(match self.numbers("action_scale")?[..] {
                    [one] => vec![one; joints.len()],
                    ref each => each.to_vec(),
                }),
                false => Figure::assumed(vec![0.25; joints.len()], usual),
            },
            action_clip: Some(Figure::assumed(ActionClip::Magnitude(100.0), usual)),
            torque_n_m: of_known(|known| known.torque_n_m),
            rotor_inertia_kg_m2: inertias_of_gains(&stiffness, &damping)
                .or_else(|| of_known(|known| known.rotor_inertia_kg_m2)),
            stiffness: Figure::read(stiffness),
            damping: Figure::read(damping),
            gait: Some(Figure::assumed(
                Gait {
                    hz: 1.0,
                    start_rad: [0.0, PI],
                    standing_rad: Some([PI; 2]),
                    standing_zero: false,
                },
                "that of holosoma's locomotion: a period of 1 s, and both feet at pi while it stands",
            )),
            observation: Figure::assumed(terms, "the terms of holosoma's locomotion"),
            joints: Figure::read(joints),
            ..Training::default()
        })
    }
}

/// Numbers of joints by parts of the joints' names. The first part that fits counts. Joints without a part have 0.
type Parts = &'static [(&'static str, f64)];

/// The figures of a robot that holosoma has in its program and not in its files.
struct Holosoma {
    name: &'static str,
    /// Angles at the action 0 (rad).
    default_rad: Parts,
    torque_n_m: Parts,
    rotor_inertia_kg_m2: Parts,
}

/// The robot of holosoma that has these joints.
fn holosoma_robot(joints: &[String]) -> Option<Holosoma> {
    let has = |name: &str| joints.iter().any(|joint| joint == name);
    if has("left_wrist_yaw_joint") {
        return Some(Holosoma {
            name: "G1",
            default_rad: &[
                ("hip_pitch", -0.312),
                ("knee", 0.669),
                ("ankle_pitch", -0.363),
                ("shoulder_pitch", 0.2),
                ("left_shoulder_roll", 0.2),
                ("right_shoulder_roll", -0.2),
                ("elbow", 0.6),
            ],
            torque_n_m: &[
                ("hip_roll", 139.0),
                ("knee", 139.0),
                ("hip", 88.0),
                ("waist_yaw", 88.0),
                ("ankle", 50.0),
                ("waist", 50.0),
                ("wrist_pitch", 5.0),
                ("wrist_yaw", 5.0),
                ("", 25.0),
            ],
            rotor_inertia_kg_m2: &[
                ("hip_roll", 0.025101925),
                ("knee", 0.025101925),
                ("hip", 0.01017752),
                ("waist_yaw", 0.01017752),
                ("ankle", 0.00721945),
                ("waist", 0.00721945),
                ("wrist_pitch", 0.00425),
                ("wrist_yaw", 0.00425),
                ("", 0.003609725),
            ],
        });
    }
    has("AAHead_yaw").then_some(Holosoma {
        name: "T1",
        default_rad: &[
            ("Shoulder_Pitch", 0.2),
            ("Left_Shoulder_Roll", -1.35),
            ("Right_Shoulder_Roll", 1.35),
            ("Left_Elbow_Yaw", -0.5),
            ("Right_Elbow_Yaw", 0.5),
            ("Hip_Pitch", -0.2),
            ("Knee_Pitch", 0.4),
            ("Ankle_Pitch", -0.25),
        ],
        torque_n_m: &[
            ("Head", 7.0),
            ("Hip_Pitch", 45.0),
            ("Hip", 30.0),
            ("Waist", 30.0),
            ("Knee", 60.0),
            ("Ankle", 12.0),
            ("", 18.0),
        ],
        rotor_inertia_kg_m2: &[("", 0.03)],
    })
}

/// A number for each joint.
fn by_parts(joints: &[String], parts: Parts) -> Vec<f64> {
    let numbers = joints.iter().map(|joint| {
        parts
            .iter()
            .find(|(part, _)| joint.contains(part))
            .map_or(0.0, |(_, number)| *number)
    });
    numbers.collect()
}
