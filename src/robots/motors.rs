//! Motors from elsewhere: torque limits, speeds, rotor inertias, friction and damping of a file, which take the place of those of a robot's
//! settings. They belong to the robot, so all controllers have them.

use super::settings::{self, RobotSettings, ServoGroup};
use super::tree::{self, Tree};
use serde::Deserialize;
use standfast_core::error::{Error, Result};
use standfast_core::robot::{MotorOrigin, Robot, Servo};
use standfast_files::assets::{self, Source};
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::OnceLock;
use toml::{Table, Value};

/// The figures of a motor. None leaves the robot's own.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Motor {
    /// Torque limit at low speed (N m).
    pub torque_n_m: Option<f64>,
    /// Largest speed with the full torque, and speed without torque (rad/s).
    pub speeds_rad_s: Option<[f64; 2]>,
    /// Rotor inertia seen at the joint (kg m^2).
    pub rotor_inertia_kg_m2: Option<f64>,
    /// Dry friction of the joint (N m).
    pub friction_n_m: Option<f64>,
    /// Viscous damping of the joint (N m s/rad).
    pub damping_n_m_s_rad: Option<f64>,
}

impl Motor {
    /// Gives a servo these figures, whose origin is `from`.
    pub(super) fn replace(&self, servo: &mut Servo, origin: &mut MotorOrigin, from: &str) {
        if let Some(torque_n_m) = self.torque_n_m {
            servo.torque_n_m = torque_n_m;
            origin.torque = from.into();
        }
        if let Some([full, none]) = self.speeds_rad_s {
            servo.full_torque_speed_rad_s = full;
            servo.no_torque_speed_rad_s = none;
            origin.speed = from.into();
        }
        if let Some(rotor_inertia_kg_m2) = self.rotor_inertia_kg_m2 {
            servo.rotor_inertia_kg_m2 = rotor_inertia_kg_m2;
            origin.rotor_inertia = from.into();
        }
        if let Some(friction_n_m) = self.friction_n_m {
            servo.friction_n_m = friction_n_m;
            origin.friction = from.into();
        }
        if let Some(damping_n_m_s_rad) = self.damping_n_m_s_rad {
            servo.damping_n_m_s_rad = damping_n_m_s_rad;
            origin.damping = from.into();
        }
    }
}

/// The motors that a file states, by joint.
#[derive(Debug, Clone)]
pub struct Motors {
    /// Name of the file, without its folder.
    pub file: String,
    pub by_joint: BTreeMap<String, Motor>,
}

/// Reads what a training left of a policy, for a robot. See [`add`].
type Reader = fn(&Path, &Robot) -> Result<Motors>;

static OF_TRAINING: OnceLock<Reader> = OnceLock::new();

/// Adds the reader of networks (`.onnx`, `.pt`) and of descriptions of policies (`.yaml`), which a program with ONNX has.
pub fn add(reader: Reader) {
    OF_TRAINING.get_or_init(|| reader);
}

/// The keys of a policy's file that matter here.
#[derive(Deserialize)]
struct PolicyFile {
    joints: Vec<String>,
    training: TrainingMotors,
}

#[derive(Deserialize)]
struct TrainingMotors {
    torque_n_m: Option<Vec<f64>>,
    rotor_inertia_kg_m2: Option<Vec<f64>>,
}

const ACCEPTED: &str = "settings of a robot with [[servos]], an MJCF (.xml), the file of a policy with [training], or, in a \
                        program with ONNX, a policy (.onnx, .pt) or its description (.yaml)";

impl Motors {
    /// The motors of these joints, of which a training says these figures, in this order.
    pub fn of_training(
        file: &Path,
        joints: &[String],
        torque_n_m: Option<&[f64]>,
        rotor_inertia_kg_m2: Option<&[f64]>,
    ) -> Self {
        let figure = |list: Option<&[f64]>, i: usize| list.and_then(|list| list.get(i).copied());
        let motors = joints.iter().enumerate().map(|(i, joint)| {
            let motor = Motor {
                torque_n_m: figure(torque_n_m, i),
                rotor_inertia_kg_m2: figure(rotor_inertia_kg_m2, i),
                ..Motor::default()
            };
            (joint.clone(), motor)
        });
        Self {
            file: file_name(file),
            by_joint: motors.collect(),
        }
    }

    /// Reads the motors of a file.
    ///
    /// # Errors
    /// The file cannot be read, or states no motor of a joint of this robot.
    pub fn open(path: &str, robot: &Robot) -> Result<Self> {
        let motors = Self::read(Path::new(path), robot)?;
        let is_of_robot = |joint: &String| robot.joints.iter().any(|known| known.name == *joint);
        let states_one = |motor: &Motor| *motor != Motor::default();
        if motors
            .by_joint
            .iter()
            .any(|(joint, motor)| is_of_robot(joint) && states_one(motor))
        {
            return Ok(motors);
        }
        let problem = format!("states no motor of a joint of {}", robot.name);
        Err(Error::option("--motors", path, &problem, ACCEPTED))
    }

    fn read(path: &Path, robot: &Robot) -> Result<Self> {
        let is_toml = path
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
        let is_xml = path
            .extension()
            .is_some_and(|extension| extension.eq_ignore_ascii_case("xml"));
        if is_xml {
            return Self::of_robot_file(path);
        }
        if !is_toml {
            return match OF_TRAINING.get() {
                Some(read) => read(path, robot),
                None => {
                    let problem = "is no TOML file";
                    Err(Error::option("--motors", path.display(), problem, ACCEPTED))
                }
            };
        }
        let source = assets::text(path)?;
        let table: Table = assets::parse_toml(&source)?;
        if table.contains_key("servos") {
            let mut by_joint = BTreeMap::new();
            for group in settings::parse(&source)?.servos {
                let motor = Motor {
                    torque_n_m: Some(group.torque_n_m),
                    speeds_rad_s: Some([
                        group.full_torque_speed_rad_s,
                        group.no_torque_speed_rad_s,
                    ]),
                    rotor_inertia_kg_m2: Some(group.rotor_inertia_kg_m2),
                    friction_n_m: group.friction_n_m,
                    damping_n_m_s_rad: group.damping_n_m_s_rad,
                };
                by_joint.extend(group.joints.into_iter().map(|joint| (joint, motor)));
            }
            return Ok(Self {
                file: file_name(path),
                by_joint,
            });
        }
        if !table.contains_key("training") {
            let problem = "states no motors";
            return Err(Error::option("--motors", path.display(), problem, ACCEPTED));
        }
        let PolicyFile { joints, training } = assets::parse_toml(&source)?;
        let lists = [&training.torque_n_m, &training.rotor_inertia_kg_m2];
        if let Some(list) = lists
            .into_iter()
            .flatten()
            .find(|list| list.len() != joints.len())
        {
            let accepted = format!("one for each of its {} joints", joints.len());
            return Err(Error::value(
                &source.file,
                "training",
                format!("{} numbers", list.len()),
                "has another length than joints",
                accepted,
            ));
        }
        let [torque_n_m, rotor_inertia_kg_m2] = lists.map(Option::as_deref);
        Ok(Self::of_training(
            path,
            &joints,
            torque_n_m,
            rotor_inertia_kg_m2,
        ))
    }

    /// The motors that the file of a robot states, an MJCF: torque limits, rotor inertias, friction and damping.
    fn of_robot_file(path: &Path) -> Result<Self> {
        let tree = Tree::parse(&tree::opened(&path.to_string_lossy())?, None)?;
        let motors = tree.joints.iter().zip(&tree.motors).map(|(joint, stated)| {
            let motor = Motor {
                torque_n_m: stated.effort_n_m,
                speeds_rad_s: None,
                rotor_inertia_kg_m2: stated.rotor_inertia_kg_m2,
                friction_n_m: stated.friction_n_m,
                damping_n_m_s_rad: stated.damping_n_m_s_rad,
            };
            (joint.name.clone(), motor)
        });
        Ok(Self {
            file: file_name(path),
            by_joint: motors.collect(),
        })
    }

    /// The settings with these motors, and with a sentence about them.
    pub(super) fn in_settings(&self, source: &Source) -> Result<Source> {
        let settings: RobotSettings = settings::parse(source)?;
        let from = format!("of {}", self.file);
        let mut groups: Vec<ServoGroup> = Vec::new();
        let mut replaced = 0;
        for group in &settings.servos {
            for joint in &group.joints {
                let (mut servo, mut origin) = (group.servo(), group.origin.clone());
                if let Some(motor) = self.by_joint.get(joint) {
                    motor.replace(&mut servo, &mut origin, &from);
                    replaced += 1;
                }
                let known = groups
                    .iter_mut()
                    .find(|known| known.servo() == servo && known.origin == origin);
                match known {
                    Some(known) => known.joints.push(joint.clone()),
                    None => groups.push(ServoGroup::new(joint, &servo, origin)),
                }
            }
        }
        let file = format!("{} with the motors {from}", source.file);
        let mut table: Table = assets::parse_toml(source)?;
        let groups = groups.iter().map(Value::try_from);
        let groups: std::result::Result<_, _> = groups.collect();
        let groups = groups.map_err(|e| Error::Syntax {
            file: file.clone(),
            message: e.to_string(),
        })?;
        table.insert("servos".into(), Value::Array(groups));
        let assumptions = table
            .entry("assumptions")
            .or_insert_with(|| Value::Array(Vec::new()));
        if let Value::Array(assumptions) = assumptions {
            assumptions.push(self.told(replaced).into());
        }
        Ok(Source {
            file,
            text: table.to_string(),
        })
    }

    /// A sentence on the motors of so many joints.
    pub(super) fn told(&self, joints: usize) -> String {
        let states = |figure: fn(&Motor) -> bool| self.by_joint.values().any(figure);
        let figures = [
            (states(|motor| motor.torque_n_m.is_some()), "torque limits"),
            (states(|motor| motor.speeds_rad_s.is_some()), "speeds"),
            (
                states(|motor| motor.rotor_inertia_kg_m2.is_some()),
                "rotor inertias",
            ),
            (states(|motor| motor.friction_n_m.is_some()), "friction"),
            (states(|motor| motor.damping_n_m_s_rad.is_some()), "damping"),
        ];
        let stated: Vec<&str> = figures
            .into_iter()
            .filter_map(|(is_stated, what)| is_stated.then_some(what))
            .collect();
        let others = match self.by_joint.len().saturating_sub(joints) {
            0 => String::new(),
            others => format!("; joints of that file that this robot lacks: {others}"),
        };
        format!(
            "motors: {} of {joints} joints are those of {}{others}",
            stated.join(", "),
            self.file
        )
    }
}

fn file_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str());
    name.to_string_lossy().into_owned()
}
