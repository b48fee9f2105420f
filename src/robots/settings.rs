//! The TOML file beside a URDF or MJCF, with what that cannot state.

use super::facing::Forward;
use super::tree::Tree;
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, MapAccess, Visitor};
use serde::{Deserialize, Serialize};
use standfast_core::arrays::exactly;
use standfast_core::error::{Error, Result};
use standfast_core::robot::model::{
    Ankle, Frame, Joint, LandingRegion, MotorOrigin, PerFoot, SensorNoise, Servo, Sole,
};
use standfast_core::robot::shape::Shape;
use standfast_files::assets::{self, Source};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::path::{Path, PathBuf};

/// Accepted lengths and widths of a sole (m).
const LEAST_SOLE_M: f64 = 1e-5;
const MOST_SOLE_M: f64 = 100.0;

/// The settings file as it is written.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RobotSettings {
    trunk: String,
    pub friction: f64,
    pub delay_s: f64,
    soles: PerFoot<SoleFace>,
    pub noise: SensorNoise,
    #[serde(default)]
    pub reach: Vec<LandingRegion>,
    #[serde(default)]
    pub assumptions: Vec<String>,
    pub servos: Vec<ServoGroup>,
    home_rad: BTreeMap<String, f64>,
    /// The range of joints whose limits in the URDF leave no range, from this angle to both sides (rad). If it is not
    /// stated, such joints are locked.
    #[serde(default)]
    pub range_rad: Option<f64>,
    /// The axis of the URDF's base that points forward.
    #[serde(default)]
    pub forward: Forward,
}

/// How a sole is stated: by the name of a link with one collision box, or by its face.
#[derive(Debug, Clone)]
enum SoleFace {
    Box(String),
    Stated(StatedFace),
}

/// The rectangle on which a foot stands, in the frame of a link.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
struct StatedFace {
    link: String,
    #[serde(deserialize_with = "exactly")]
    center_m: [f64; 3],
    /// Length (x) and width (y).
    #[serde(deserialize_with = "exactly")]
    size_m: [f64; 2],
    /// Roll, pitch and yaw of the face, whose z axis points up into the foot.
    #[serde(default, deserialize_with = "exactly")]
    rpy_rad: [f64; 3],
}

impl<'de> Deserialize<'de> for SoleFace {
    fn deserialize<D: Deserializer<'de>>(from: D) -> std::result::Result<Self, D::Error> {
        struct SoleFaceVisitor;
        impl<'de> Visitor<'de> for SoleFaceVisitor {
            type Value = SoleFace;

            fn expecting(&self, f: &mut fmt::Formatter) -> fmt::Result {
                f.write_str(
                    "the name of a link with one collision box, or a table with link, center_m = [x, y, z], \
                     size_m = [length, width] and, if the axes of the link are not those of the sole, rpy_rad",
                )
            }

            fn visit_str<E: serde::de::Error>(
                self,
                name: &str,
            ) -> std::result::Result<Self::Value, E> {
                Ok(SoleFace::Box(name.into()))
            }

            fn visit_map<A: MapAccess<'de>>(
                self,
                map: A,
            ) -> std::result::Result<Self::Value, A::Error> {
                StatedFace::deserialize(MapAccessDeserializer::new(map)).map(SoleFace::Stated)
            }
        }
        from.deserialize_any(SoleFaceVisitor)
    }
}

/// The joints with the same servo.
#[derive(Debug, Clone, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub(super) struct ServoGroup {
    pub joints: Vec<String>,
    kp_n_m_rad: f64,
    kd_n_m_s_rad: f64,
    pub torque_n_m: f64,
    pub full_torque_speed_rad_s: f64,
    pub no_torque_speed_rad_s: f64,
    pub rotor_inertia_kg_m2: f64,
    /// Dry friction of the joint; none if it is not stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub friction_n_m: Option<f64>,
    /// Viscous damping of the joint; none if it is not stated.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping_n_m_s_rad: Option<f64>,
    /// Where the figures of the motor are from.
    #[serde(default)]
    pub origin: MotorOrigin,
}

impl ServoGroup {
    /// The group of one joint.
    pub fn new(joint: &str, servo: &Servo, origin: MotorOrigin) -> Self {
        let stated = |figure: f64| (figure != 0.0).then_some(figure);
        Self {
            joints: vec![joint.into()],
            kp_n_m_rad: servo.kp,
            kd_n_m_s_rad: servo.kd,
            torque_n_m: servo.torque_n_m,
            full_torque_speed_rad_s: servo.full_torque_speed_rad_s,
            no_torque_speed_rad_s: servo.no_torque_speed_rad_s,
            rotor_inertia_kg_m2: servo.rotor_inertia_kg_m2,
            friction_n_m: stated(servo.friction_n_m),
            damping_n_m_s_rad: stated(servo.damping_n_m_s_rad),
            origin,
        }
    }

    /// The servo of each of its joints.
    pub fn servo(&self) -> Servo {
        Servo {
            kp: self.kp_n_m_rad,
            kd: self.kd_n_m_s_rad,
            torque_n_m: self.torque_n_m,
            full_torque_speed_rad_s: self.full_torque_speed_rad_s,
            no_torque_speed_rad_s: self.no_torque_speed_rad_s,
            rotor_inertia_kg_m2: self.rotor_inertia_kg_m2,
            friction_n_m: self.friction_n_m.unwrap_or(0.0),
            damping_n_m_s_rad: self.damping_n_m_s_rad.unwrap_or(0.0),
        }
    }
}

/// Checks a range for joints without one (rad).
pub(super) fn check_range(file: &str, range_rad: f64) -> Result<()> {
    Error::check_ranges(
        file,
        "",
        &[("range_rad", range_rad, 1e-3, std::f64::consts::PI)],
    )
}

/// A file that states the soles alone.
#[derive(Debug, Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct SolesAlone {
    soles: PerFoot<SoleFace>,
}

impl SolesAlone {
    /// Parses the file.
    pub fn parse(source: &Source) -> Result<Self> {
        assets::parse_toml(source)
    }

    /// The soles.
    pub fn soles(&self, file: &str, tree: &Tree) -> Result<PerFoot<Sole>> {
        soles(&self.soles, file, tree)
    }

    /// For each foot, whether only the name of a link with one box is stated.
    pub fn are_boxes(&self) -> PerFoot<bool> {
        PerFoot::from_fn(|foot| matches!(self.soles[foot], SoleFace::Box(_)))
    }
}

/// Where the settings of a robot's file are: `robot.toml` for `robot.urdf`, `robot.xml`, `robot.xacro` and
/// `robot.urdf.xacro`.
pub fn settings_path(urdf: &str) -> PathBuf {
    let path = Path::new(urdf).with_extension("");
    let is_urdf = path
        .extension()
        .is_some_and(|extension| extension == "urdf");
    if is_urdf {
        path.with_extension("toml")
    } else {
        Path::new(urdf).with_extension("toml")
    }
}

/// Whether a file states the soles and nothing else.
pub fn states_soles_alone(source: &Source) -> bool {
    toml::from_str::<toml::Table>(&source.text).is_ok_and(|table| table.keys().eq(["soles"]))
}

/// Parses the file, and checks all that does not need the tree of links.
pub(super) fn parse(source: &Source) -> Result<RobotSettings> {
    if states_soles_alone(source) {
        let (problem, accepted) = (
            "are all that it states",
            "a whole file: `standfast init` with the robot's file adds the rest",
        );
        return Err(Error::value(
            &source.file,
            "keys",
            "soles",
            problem,
            accepted,
        ));
    }
    let settings: RobotSettings = assets::parse_toml(source)?;
    let (file, noise) = (source.file.as_str(), &settings.noise);
    // The ranges are generous: from a robot of a millimetre and a milligram to one of a hundred metres and a thousand
    // tonnes.
    let own = [
        ("friction", settings.friction, 0.0, 100.0),
        ("delay_s", settings.delay_s, 0.0, 1.0),
    ];
    Error::check_ranges(file, "", &own)?;
    let noises = [
        ("joint_angle_rad", noise.joint_angle_rad, 0.0, 10.0),
        ("joint_speed_rad_s", noise.joint_speed_rad_s, 0.0, 1e4),
        ("gyro_rad_s", noise.gyro_rad_s, 0.0, 1e4),
        ("orientation_rad", noise.orientation_rad, 0.0, 10.0),
        ("accelerometer_m_s2", noise.accelerometer_m_s2, 0.0, 1e4),
        ("sole_force_n", noise.sole_force_n, 0.0, 1e8),
        ("sole_moment_n_m", noise.sole_moment_n_m, 0.0, 1e10),
    ];
    Error::check_ranges(file, "noise", &noises)?;
    for (i, group) in settings.servos.iter().enumerate() {
        let full = group.full_torque_speed_rad_s;
        let ranges = [
            ("kp_n_m_rad", group.kp_n_m_rad, 0.0, 1e12),
            ("kd_n_m_s_rad", group.kd_n_m_s_rad, 0.0, 1e12),
            ("torque_n_m", group.torque_n_m, 1e-12, 1e12),
            ("full_torque_speed_rad_s", full, 0.0, 1e6),
            (
                "no_torque_speed_rad_s",
                group.no_torque_speed_rad_s,
                full + 1e-6,
                1e7,
            ),
            ("rotor_inertia_kg_m2", group.rotor_inertia_kg_m2, 0.0, 1e10),
            ("friction_n_m", group.friction_n_m.unwrap_or(0.0), 0.0, 1e12),
            (
                "damping_n_m_s_rad",
                group.damping_n_m_s_rad.unwrap_or(0.0),
                0.0,
                1e12,
            ),
        ];
        Error::check_ranges(file, &format!("servos[{i}]"), &ranges)?;
    }
    if let Some(range_rad) = settings.range_rad {
        check_range(file, range_rad)?;
    }
    check_reach(file, &settings.reach)?;
    Ok(settings)
}

fn check_reach(file: &str, regions: &[LandingRegion]) -> Result<()> {
    let mut names = BTreeSet::new();
    for (i, region) in regions.iter().enumerate() {
        let ([x0, x1], [y0, y1]) = (region.x_m, region.y_m);
        let ranges = [
            ("x_m[0]", x0, -100.0, 100.0),
            ("x_m[1]", x1, x0, 100.0),
            ("y_m[0]", y0, -100.0, 100.0),
            ("y_m[1]", y1, y0, 100.0),
            ("swing_time_s", region.swing_time_s, 1e-3, 100.0),
            ("sideways_from", region.sideways_from, 0.0, 0.8),
            ("arc_m", region.arc_m, 0.0, 100.0),
        ];
        Error::check_ranges(file, &format!("reach[{i}]"), &ranges)?;
        if region.name.is_empty() || !names.insert(&region.name) {
            return Err(Error::value(
                file,
                format!("reach[{i}].name"),
                &region.name,
                "is empty or taken",
                "a name of its own for each region",
            ));
        }
    }
    Ok(())
}

impl RobotSettings {
    /// Index of the link that carries the trunk's frame.
    pub fn trunk(&self, file: &str, frames: &[Frame]) -> Result<usize> {
        Ok(frames[frame_index(file, "trunk", &self.trunk, frames)?].link)
    }

    /// The servos, one per joint.
    pub fn servos(&self, file: &str, joints: &[Joint]) -> Result<Vec<Servo>> {
        let mut servos: Vec<Option<Servo>> = vec![None; joints.len()];
        for (i, group) in self.servos.iter().enumerate() {
            let field = format!("servos[{i}].joints");
            for name in &group.joints {
                let slot = &mut servos[joint_index(file, &field, name, joints)?];
                if slot.is_some() {
                    return Err(Error::value(
                        file,
                        field,
                        name,
                        "this joint already has a servo",
                        "each joint once",
                    ));
                }
                *slot = Some(group.servo());
            }
        }
        let servos = servos.into_iter().zip(joints).map(|(servo, joint)| {
            servo.ok_or_else(|| {
                Error::value(
                    file,
                    "servos",
                    &joint.name,
                    "this joint has no servo",
                    "each joint in one group's `joints`",
                )
            })
        });
        servos.collect()
    }

    /// For each foot, whether a rectangle states its sole.
    pub fn states_faces(&self) -> PerFoot<bool> {
        PerFoot::from_fn(|foot| matches!(self.soles[foot], SoleFace::Stated(_)))
    }

    /// Where the figures of the motors are from, one per joint.
    pub fn motor_origins(&self, joints: &[Joint]) -> Vec<MotorOrigin> {
        let of = |joint: &Joint| {
            let mut groups = self.servos.iter();
            groups.find(|group| group.joints.contains(&joint.name))
        };
        let origins = joints
            .iter()
            .map(|joint| of(joint).map(|group| group.origin.clone()));
        origins.map(Option::unwrap_or_default).collect()
    }

    /// Home posture (rad), one angle per joint, checked against the joint limits.
    pub fn home(&self, file: &str, joints: &[Joint]) -> Result<Vec<f64>> {
        let mut home = vec![0.0; joints.len()];
        for (name, &angle) in &self.home_rad {
            home[joint_index(file, "home_rad", name, joints)?] = angle;
        }
        for (joint, &angle) in joints.iter().zip(&home) {
            if !(joint.lower_rad..=joint.upper_rad).contains(&angle) {
                let accepted = format!("{} to {}", joint.lower_rad, joint.upper_rad);
                let field = format!("home_rad.{}", joint.name);
                return Err(Error::value(
                    file,
                    field,
                    angle,
                    "is outside of the joint's limits",
                    accepted,
                ));
            }
        }
        Ok(home)
    }

    /// The soles, as they are stated or from the collision box of each named link.
    pub fn soles(&self, file: &str, tree: &Tree) -> Result<PerFoot<Sole>> {
        soles(&self.soles, file, tree)
    }
}

fn soles(faces: &PerFoot<SoleFace>, file: &str, tree: &Tree) -> Result<PerFoot<Sole>> {
    let left = sole(file, "soles.left", &faces.left, tree)?;
    let right = sole(file, "soles.right", &faces.right, tree)?;
    if left.link == right.link {
        let problem = "is carried by the same body as the left sole";
        let name = &tree.frames[right.frame].name;
        return Err(Error::value(
            file,
            "soles.right",
            name,
            problem,
            "soles on two bodies",
        ));
    }
    Ok(PerFoot { left, right })
}

impl StatedFace {
    /// The pose of the face's centre in the frame of the link.
    fn pose(&self) -> Isometry3<f64> {
        let ([x, y, z], [roll, pitch, yaw]) = (self.center_m, self.rpy_rad);
        Isometry3::from_parts(
            Translation3::new(x, y, z),
            UnitQuaternion::from_euler_angles(roll, pitch, yaw),
        )
    }
}

fn sole(file: &str, field: &str, face: &SoleFace, tree: &Tree) -> Result<Sole> {
    match face {
        SoleFace::Box(link) => sole_of_box(file, field, link, tree),
        SoleFace::Stated(face) => stated_sole(file, field, face, tree),
    }
}

fn stated_sole(file: &str, field: &str, face: &StatedFace, tree: &Tree) -> Result<Sole> {
    let Tree { links, frames, .. } = tree;
    let frame = frame_index(file, &format!("{field}.link"), &face.link, frames)?;
    let link = frames[frame].link;
    let ([x, y, z], [roll, pitch, yaw], [length, width]) =
        (face.center_m, face.rpy_rad, face.size_m);
    let ranges = [
        ("size_m[0]", length, LEAST_SOLE_M, MOST_SOLE_M),
        ("size_m[1]", width, LEAST_SOLE_M, MOST_SOLE_M),
        ("center_m[0]", x, -100.0, 100.0),
        ("center_m[1]", y, -100.0, 100.0),
        ("center_m[2]", z, -100.0, 100.0),
        ("rpy_rad[0]", roll, -10.0, 10.0),
        ("rpy_rad[1]", pitch, -10.0, 10.0),
        ("rpy_rad[2]", yaw, -10.0, 10.0),
    ];
    Error::check_ranges(file, field, &ranges)?;
    let center = frames[frame].pose * face.pose();
    let up = center.rotation * Vector3::z();
    // A link without a shape has no top, and stands on a plate.
    let top = links[link]
        .collisions
        .iter()
        .map(|solid| solid.reach_m(&up))
        .fold(f64::NEG_INFINITY, f64::max);
    Ok(Sole {
        frame,
        link,
        center,
        half_m: [0.5 * length, 0.5 * width],
        thickness_m: (top - center.translation.vector.dot(&up)).max(0.0),
        ankle: Ankle::RIGID,
    })
}

/// Fails if a mesh of a sole was not read.
fn check_mesh(file: &str, field: &str, frame: usize, tree: &Tree) -> Result<()> {
    match tree.missing.iter().find(|(owner, _)| *owner == frame) {
        Some((_, mesh)) => Err(Error::value(
            file,
            field,
            &tree.frames[frame].name,
            format!("the mesh of its collision is left out: {mesh}"),
            "a file that can be read",
        )),
        None => Ok(()),
    }
}

fn sole_of_box(file: &str, field: &str, name: &str, tree: &Tree) -> Result<Sole> {
    let Tree { links, frames, .. } = tree;
    let bad = |problem: &str| {
        let accepted = "a link with exactly one collision, a box parallel to the link's axes, or a table with link, center_m, \
                        size_m and rpy_rad";
        Error::value(file, field, name, problem, accepted)
    };
    let frame = frame_index(file, field, name, frames)?;
    let link = frames[frame].link;
    check_mesh(file, field, frame, tree)?;
    let mut solids = links[link].collisions.iter().filter(|s| s.frame == frame);
    let (Some(solid), None) = (solids.next(), solids.next()) else {
        return Err(bad("does not have exactly one collision"));
    };
    let Shape::Box { half } = solid.shape else {
        return Err(bad("its collision is not a box"));
    };
    let in_frame = frames[frame].pose.inv_mul(&solid.pose);
    let turn = in_frame.rotation.to_rotation_matrix().matrix().abs();
    if turn.iter().any(|&c| c > 1e-6 && c < 1.0 - 1e-6) {
        return Err(bad("its box is not parallel to the link's axes"));
    }
    let half: Vector3<f64> = turn.map(f64::round) * half;
    let sizes = [("length", 2.0 * half.x), ("width", 2.0 * half.y)]
        .map(|(of, m)| (of, m, LEAST_SOLE_M, MOST_SOLE_M));
    Error::check_ranges(file, field, &sizes)?;
    let face = in_frame.translation.vector - Vector3::z() * half.z;
    Ok(Sole {
        frame,
        link,
        center: frames[frame].pose * Isometry3::from(Translation3::from(face)),
        half_m: [half.x, half.y],
        thickness_m: 2.0 * half.z,
        ankle: Ankle::RIGID,
    })
}

fn frame_index(file: &str, field: &str, name: &str, frames: &[Frame]) -> Result<usize> {
    index(
        file,
        field,
        name,
        "no such link",
        frames.iter().map(|f| f.name.as_str()),
    )
}

fn joint_index(file: &str, field: &str, name: &str, joints: &[Joint]) -> Result<usize> {
    index(
        file,
        field,
        name,
        "no such joint",
        joints.iter().map(|j| j.name.as_str()),
    )
}

fn index<'a>(
    file: &str,
    field: &str,
    name: &str,
    problem: &str,
    names: impl Iterator<Item = &'a str> + Clone,
) -> Result<usize> {
    names.clone().position(|n| n == name).ok_or_else(|| {
        let accepted = names.collect::<Vec<_>>().join(", ");
        Error::value(file, field, name, problem, accepted)
    })
}
