//! The robot as plain data.

use super::shape::Shape;
use crate::arrays::exactly;
use nalgebra::{Isometry3, Matrix3, Point3, Unit, Vector3};
use std::path::PathBuf;

/// Acceleration of gravity (m/s^2).
pub const GRAVITY: f64 = 9.81;

/// A humanoid: its links and joints, and the settings beside its URDF.
#[derive(Debug, Clone)]
pub struct Robot {
    pub name: String,
    /// Path of the URDF. It is None if the URDF is compiled in, or came as text.
    pub urdf: Option<PathBuf>,
    /// Rigid bodies after merging. `links[0]` is the floating base, and `joints[i]` carries `links[i + 1]`. A parent
    /// always stands before its children.
    pub links: Vec<Link>,
    /// Revolute joints, in the order of the URDF (except that a parent stands before its children).
    pub joints: Vec<Joint>,
    /// Every URDF link by name, including those that are merged into others.
    pub frames: Vec<Frame>,
    /// Index into `links` of the trunk, where the IMU is.
    pub trunk: usize,
    pub pushed: PushPoint,
    pub soles: PerFoot<Sole>,
    /// Joint angles of the home posture (rad), one per joint.
    pub home_rad: Vec<f64>,
    /// The servos, one per joint.
    pub servos: Vec<Servo>,
    /// The origins of the motors' figures, one per joint.
    pub motor_origins: Vec<MotorOrigin>,
    pub noise: SensorNoise,
    /// Delay from sensing to torque (s).
    pub delay_s: f64,
    /// Friction coefficient between soles and ground.
    pub friction: f64,
    /// Where a foot can land, and how soon. It is empty if the settings do not state it. The first region contains the
    /// stance at home.
    pub reach: Vec<LandingRegion>,
    /// The assumptions about this robot, in words, for figures that are not published.
    pub assumptions: Vec<String>,
    /// The changes and omissions when its URDF was read, in words.
    pub notes: Vec<String>,
}

/// Where pushes act: the trunk level with the COM, unless a campaign states another link or point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PushPoint {
    /// Index into `links`.
    pub link: usize,
    /// The point in the frame of the link (m); None for the COM of the home posture.
    pub point_m: Option<Point3<f64>>,
}

impl PushPoint {
    /// A link, level with the COM of the home posture.
    pub fn on(link: usize) -> Self {
        Self {
            link,
            point_m: None,
        }
    }
}

/// A rigid body. Its frame is the frame of the URDF link after which it is named.
#[derive(Debug, Clone)]
pub struct Link {
    pub name: String,
    pub mass_kg: f64,
    /// Centre of mass in the link's frame.
    pub com_m: Point3<f64>,
    /// Inertia about the centre of mass, in the axes of the link's frame (kg m^2).
    pub inertia_kg_m2: Matrix3<f64>,
    /// Collision geometry, including the soles.
    pub collisions: Vec<Solid>,
    pub visuals: Vec<Solid>,
}

impl Link {
    /// The solids to draw: the visual geometry, or the collision geometry if there is no visual one.
    pub fn drawn(&self) -> &[Solid] {
        if self.visuals.is_empty() {
            &self.collisions
        } else {
            &self.visuals
        }
    }
}

/// A shape on a link.
#[derive(Debug, Clone)]
pub struct Solid {
    /// The URDF link to which this solid belongs; it may be merged into another.
    pub frame: usize,
    /// Pose in the frame of the [`Link`] that carries it.
    pub pose: Isometry3<f64>,
    pub shape: Shape,
    /// Red, green, blue and opacity, from 0 to 1.
    pub color: [f64; 4],
}

impl Solid {
    /// Points in the frame of the [`Link`], whose convex hull is the solid as it collides: the corners of a box, the
    /// points of a mesh, and for round shapes as in [`Shape::points`].
    pub fn points(&self) -> impl Iterator<Item = Point3<f64>> + '_ {
        self.shape
            .points()
            .into_iter()
            .map(|point| self.pose * point)
    }

    /// Reach of the solid from the origin of the [`Link`]'s frame along a direction of that frame (m, for a direction
    /// of length 1).
    pub fn reach_m(&self, direction: &Vector3<f64>) -> f64 {
        let own = self.pose.rotation.inverse_transform_vector(direction);
        self.pose.translation.vector.dot(direction) + self.shape.reach_m(&own)
    }
}

/// A revolute joint: `parent link frame -> origin -> rotation by q about axis -> child link frame`.
#[derive(Debug, Clone)]
pub struct Joint {
    pub name: String,
    /// Index into `links` of the parent.
    pub parent: usize,
    /// Pose of the child's frame at q = 0, in the parent's frame.
    pub origin: Isometry3<f64>,
    /// Axis in the child's frame.
    pub axis: Unit<Vector3<f64>>,
    /// Least and largest angle; infinite for a joint without limits.
    pub lower_rad: f64,
    pub upper_rad: f64,
}

/// A named URDF link frame.
#[derive(Debug, Clone)]
pub struct Frame {
    pub name: String,
    /// Index into `links` of the body that carries this frame.
    pub link: usize,
    /// Pose in the frame of that body.
    pub pose: Isometry3<f64>,
}

impl Frame {
    /// Whether a frame of this name is that of an IMU.
    pub fn names_imu(name: &str) -> bool {
        name.to_lowercase().contains("imu")
    }
}

/// The ankle above a sole, at home.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ankle {
    /// Where the axes of pitch (x) and roll (y) pass over the sole, from its centre (m).
    pub above_m: [f64; 2],
    /// Torque limits in pitch and in roll (N m); infinite where the ankle has no such joint, and the leg is rigid.
    pub torque_n_m: [f64; 2],
}

impl Ankle {
    /// An ankle that never gives way.
    pub const RIGID: Ankle = Ankle {
        above_m: [0.0; 2],
        torque_n_m: [f64::INFINITY; 2],
    };

    /// Whether the ankle has a joint for roll. Without one, the sole rolls with the leg.
    pub fn rolls(&self) -> bool {
        self.torque_n_m[1].is_finite()
    }
}

/// The rectangle on which a foot stands.
#[derive(Debug, Clone, Copy)]
pub struct Sole {
    /// Index into `frames` of the sole.
    pub frame: usize,
    /// Index into `links` of the body that carries the sole.
    pub link: usize,
    /// Pose of the centre of the contact face in the link's frame, x forward and z up into the foot.
    pub center: Isometry3<f64>,
    /// Half length (x) and half width (y) of the contact face.
    pub half_m: [f64; 2],
    /// Height of the colliding geometry above the contact face.
    pub thickness_m: f64,
    pub ankle: Ankle,
}

/// Least share of the sole within which an ankle is taken to hold the ZMP, however weak it is.
const LEAST: f64 = 0.05;

impl Sole {
    /// Corners of the contact face in the frame of its centre, in order around it.
    pub fn corners(&self) -> [Point3<f64>; 4] {
        let [x, y] = self.half_m;
        corners([[-x, x], [-y, y]])
    }

    /// Smallest and largest x and y of the centre of pressure (m, from the sole's centre) that the ankle can hold under
    /// a load (N).
    pub fn pressable_m(&self, load_n: f64) -> [[f64; 2]; 2] {
        [0, 1].map(|k| {
            let half = self.half_m[k];
            let lever = (self.ankle.torque_n_m[k] / load_n).max(LEAST * half);
            [-lever, lever].map(|side| (self.ankle.above_m[k] + side).clamp(-half, half))
        })
    }

    /// Corners of the part of the contact face on which the ankle can hold a load (N).
    pub fn pressable_corners(&self, load_n: f64) -> [Point3<f64>; 4] {
        corners(self.pressable_m(load_n))
    }
}

fn corners([[x0, x1], [y0, y1]]: [[f64; 2]; 2]) -> [Point3<f64>; 4] {
    [
        Point3::new(x1, y1, 0.0),
        Point3::new(x0, y1, 0.0),
        Point3::new(x0, y0, 0.0),
        Point3::new(x1, y0, 0.0),
    ]
}

/// Position servo of a joint: `tau = kp (q_ref - q) + kd (dq_ref - dq) + tau_ff`, limited.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Servo {
    /// Stiffness (N m/rad).
    #[serde(rename = "kp_n_m_rad")]
    pub kp: f64,
    /// Damping (N m s/rad).
    #[serde(rename = "kd_n_m_s_rad")]
    pub kd: f64,
    /// Torque limit at low speed (N m).
    pub torque_n_m: f64,
    /// Largest speed with the full torque (rad/s).
    pub full_torque_speed_rad_s: f64,
    /// Speed at which the available torque reaches zero (rad/s). The torque decreases linearly between the two speeds.
    pub no_torque_speed_rad_s: f64,
    /// Rotor inertia seen at the joint (kg m^2).
    pub rotor_inertia_kg_m2: f64,
    /// Dry friction of the joint (N m): the largest torque that it withstands at rest, and what it loses in motion.
    pub friction_n_m: f64,
    /// Viscous damping of the joint (N m s/rad), which unlike `kd` is no work of the motor.
    pub damping_n_m_s_rad: f64,
}

impl Servo {
    /// Largest torque (N m) in the direction of motion at `speed` (rad/s).
    pub fn available_torque(&self, speed: f64) -> f64 {
        let span = self.no_torque_speed_rad_s - self.full_torque_speed_rad_s;
        self.torque_n_m * ((self.no_torque_speed_rad_s - speed.abs()) / span).clamp(0.0, 1.0)
    }

    /// Torque (N m) that friction and damping of the joint take at `speed` (rad/s), with the sign of the speed.
    pub fn lost_torque(&self, speed: f64) -> f64 {
        let dry = if speed == 0.0 {
            0.0
        } else {
            self.friction_n_m.copysign(speed)
        };
        dry + self.damping_n_m_s_rad * speed
    }
}

/// Where the figures of a motor are from, in words such as "read" and "assumed".
#[derive(Debug, Clone, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct MotorOrigin {
    pub torque: String,
    pub speed: String,
    pub rotor_inertia: String,
    #[serde(default = "settings")]
    pub friction: String,
    #[serde(default = "settings")]
    pub damping: String,
}

/// The origin of a figure of which the settings do not say where it is from.
fn settings() -> String {
    "settings".into()
}

impl Default for MotorOrigin {
    /// That of figures of which the settings do not say where they are from.
    fn default() -> Self {
        Self {
            torque: settings(),
            speed: settings(),
            rotor_inertia: settings(),
            friction: settings(),
            damping: settings(),
        }
    }
}

/// Standard deviations of white noise, with one sample per control tick.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct SensorNoise {
    pub joint_angle_rad: f64,
    pub joint_speed_rad_s: f64,
    pub gyro_rad_s: f64,
    pub orientation_rad: f64,
    pub accelerometer_m_s2: f64,
    pub sole_force_n: f64,
    pub sole_moment_n_m: f64,
}

/// A convex region of places where a foot can land, and the time of a swing to these places. Places are offsets from
/// the centre of the stance sole to the centre of the landing sole, in the axes of the stance sole, with y to the side
/// of the swing foot and the hips at home height. The legs reach every place of a region without touching each other,
/// within their limits.
#[derive(Debug, Clone, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct LandingRegion {
    pub name: String,
    /// Smallest and largest offset forward (m).
    #[serde(deserialize_with = "exactly")]
    pub x_m: [f64; 2],
    /// Smallest and largest offset to the side of the swing foot (m).
    #[serde(deserialize_with = "exactly")]
    pub y_m: [f64; 2],
    /// Time from the lift to the landing (s), for any place in the region. A controller may take less for a short way.
    pub swing_time_s: f64,
    /// How the foot goes around the stance leg: it moves sideways only from this share of the swing on, and fore and
    /// aft only until the same share before the end. With 0, the default, it goes straight.
    #[serde(default)]
    pub sideways_from: f64,
    /// How far the foot swings out on its way, forward or backward like the region (m); 0 by default.
    #[serde(default)]
    pub arc_m: f64,
}

/// How a foot goes around the stance leg.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Around {
    /// The share of the swing of [`LandingRegion::sideways_from`].
    pub sideways_from: f64,
    /// How far the foot swings out in the middle of the swing, with the sign of x (m).
    pub arc_m: f64,
}

impl LandingRegion {
    /// How a foot goes around the stance leg to this region.
    pub fn around(&self) -> Around {
        Around {
            sideways_from: self.sideways_from,
            arc_m: self.arc_m * self.x_m[0].signum(),
        }
    }

    /// Whether the swing leg crosses the stance leg on the way to this region.
    pub fn crosses(&self) -> bool {
        self.sideways_from > 0.0
    }

    pub fn corners(&self) -> [[f64; 2]; 4] {
        let ([x0, x1], [y0, y1]) = (self.x_m, self.y_m);
        [[x0, y0], [x0, y1], [x1, y0], [x1, y1]]
    }
}

/// Left or right.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Foot {
    Left,
    Right,
}

impl Foot {
    pub const BOTH: [Foot; 2] = [Foot::Left, Foot::Right];

    pub fn other(self) -> Self {
        match self {
            Foot::Left => Foot::Right,
            Foot::Right => Foot::Left,
        }
    }

    /// Sign of y on the side of this foot: 1 for the left foot, -1 for the right.
    pub fn side(self) -> f64 {
        match self {
            Foot::Left => 1.0,
            Foot::Right => -1.0,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Foot::Left => "left",
            Foot::Right => "right",
        }
    }
}

/// One value for each foot.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct PerFoot<T> {
    pub left: T,
    pub right: T,
}

impl<T> PerFoot<T> {
    pub fn from_fn(mut f: impl FnMut(Foot) -> T) -> Self {
        Self {
            left: f(Foot::Left),
            right: f(Foot::Right),
        }
    }
}

impl<T> std::ops::Index<Foot> for PerFoot<T> {
    type Output = T;
    fn index(&self, foot: Foot) -> &T {
        match foot {
            Foot::Left => &self.left,
            Foot::Right => &self.right,
        }
    }
}

impl<T> std::ops::IndexMut<Foot> for PerFoot<T> {
    fn index_mut(&mut self, foot: Foot) -> &mut T {
        match foot {
            Foot::Left => &mut self.left,
            Foot::Right => &mut self.right,
        }
    }
}
