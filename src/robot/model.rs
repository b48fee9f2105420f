//! The robot as plain data.

use nalgebra::{Isometry3, Matrix3, Point3, Unit, Vector3};

/// Acceleration of gravity (m/s^2).
pub const GRAVITY: f64 = 9.81;

/// A humanoid: links, joints, and the settings beside its URDF.
#[derive(Debug, Clone)]
pub struct Robot {
    /// URDF robot name.
    pub name: String,
    /// Rigid bodies that move by themselves; `links[0]` is the floating base, `links[i + 1]` is carried by `joints[i]`.
    /// A parent always stands before its children.
    pub links: Vec<Link>,
    /// Revolute joints, in the order of the URDF (except that a parent stands before its children).
    pub joints: Vec<Joint>,
    /// Every URDF link, by name, those merged into others included.
    pub frames: Vec<Frame>,
    /// Index into `links` of the trunk: where the IMU sits and pushes act.
    pub trunk: usize,
    pub soles: PerFoot<Sole>,
    /// Home posture (rad), one per joint.
    pub home_rad: Vec<f64>,
    /// One per joint.
    pub servos: Vec<Servo>,
    pub noise: SensorNoise,
    /// From sensing to torque (s).
    pub delay_s: f64,
    /// Coulomb friction between soles and ground.
    pub friction: f64,
    /// Where a foot can land, and how soon; None if the robot's file does not say.
    pub reach: Option<Reach>,
    /// What is assumed of this robot rather than published, in words.
    pub assumptions: Vec<String>,
}

/// A rigid body. Frame: the URDF link frame (of the link that gives it its name).
#[derive(Debug, Clone)]
pub struct Link {
    pub name: String,
    pub mass_kg: f64,
    /// Centre of mass in the link frame.
    pub com_m: Point3<f64>,
    /// About the centre of mass, axes parallel to the link frame (kg m^2).
    pub inertia_kg_m2: Matrix3<f64>,
    /// Collision geometry, soles included.
    pub collisions: Vec<Solid>,
    pub visuals: Vec<Solid>,
}

impl Link {
    /// What is drawn of it: its visual geometry; its collision geometry if it has none that is a primitive.
    pub fn drawn(&self) -> &[Solid] {
        if self.visuals.is_empty() { &self.collisions } else { &self.visuals }
    }
}

/// A primitive placed on a link.
#[derive(Debug, Clone)]
pub struct Solid {
    /// URDF link that this solid belongs to (it may be one merged into another).
    pub frame: usize,
    /// Pose in the frame of the [`Link`] that carries it.
    pub pose: Isometry3<f64>,
    pub shape: Shape,
    /// RGBA, 0 to 1.
    pub color: [f64; 4],
}

/// Primitive shapes of URDF (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// By its half extents.
    Box {
        half: Vector3<f64>,
    },
    /// Axis z, centred.
    Cylinder {
        radius: f64,
        length: f64,
    },
    Sphere {
        radius: f64,
    },
}

/// A revolute joint: `parent link frame -> origin -> rotation by q about axis -> child link frame`.
#[derive(Debug, Clone)]
pub struct Joint {
    pub name: String,
    /// Index into `links`.
    pub parent: usize,
    /// Child frame at q = 0, in the parent link frame.
    pub origin: Isometry3<f64>,
    /// In the child frame.
    pub axis: Unit<Vector3<f64>>,
    pub lower_rad: f64,
    pub upper_rad: f64,
}

/// A named URDF link frame.
#[derive(Debug, Clone)]
pub struct Frame {
    pub name: String,
    /// Index into `links` of the body that carries it.
    pub link: usize,
    /// Pose in that body's frame.
    pub pose: Isometry3<f64>,
}

/// A box sole. Its contact face is the lower face (along z of the sole's URDF frame) of the box.
#[derive(Debug, Clone, Copy)]
pub struct Sole {
    /// Index into `frames`.
    pub frame: usize,
    /// Index into `links` of the body that carries it.
    pub link: usize,
    /// Centre of the contact face, in the link frame, axes as the sole's URDF frame.
    pub center: Isometry3<f64>,
    /// Half length (x) and half width (y) of the contact face.
    pub half_m: [f64; 2],
    /// Thickness of the box above its contact face.
    pub thickness_m: f64,
}

impl Sole {
    /// Corners of the contact face, in the frame of its centre.
    pub fn corners(&self) -> [Point3<f64>; 4] {
        let [x, y] = self.half_m;
        [Point3::new(x, y, 0.0), Point3::new(-x, y, 0.0), Point3::new(-x, -y, 0.0), Point3::new(x, -y, 0.0)]
    }
}

/// Position servo of one joint: `tau = kp (q_ref - q) + kd (dq_ref - dq) + tau_ff`, limited.
#[derive(Debug, Clone, Copy)]
pub struct Servo {
    /// (N m/rad)
    pub kp: f64,
    /// (N m s/rad)
    pub kd: f64,
    /// Torque limit at low speed (N m).
    pub torque_n_m: f64,
    /// Up to this speed the full torque is available (rad/s).
    pub full_torque_speed_rad_s: f64,
    /// At this speed no torque is left; linear between (rad/s).
    pub no_torque_speed_rad_s: f64,
    /// Inertia of the rotor as felt at the joint (kg m^2).
    pub rotor_inertia_kg_m2: f64,
}

impl Servo {
    /// Largest torque that the motor gives in the direction of motion at `speed` (rad/s).
    pub fn available_torque(&self, speed: f64) -> f64 {
        let span = self.no_torque_speed_rad_s - self.full_torque_speed_rad_s;
        self.torque_n_m * ((self.no_torque_speed_rad_s - speed.abs()) / span).clamp(0.0, 1.0)
    }
}

/// Standard deviations of white noise, one sample a control tick.
#[derive(Debug, Clone, Copy, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct SensorNoise {
    pub joint_angle_rad: f64,
    pub gyro_rad_s: f64,
    pub orientation_rad: f64,
    pub accelerometer_m_s2: f64,
    pub sole_force_n: f64,
    pub sole_moment_n_m: f64,
}

/// Where a foot can land, seen from the centre of the sole that stands to that of the one that lands, at home's height;
/// axes of the stance sole. What its legs can do under their limits, whatever controls them.
#[derive(Debug, Clone, Copy, PartialEq, serde::Deserialize, serde::Serialize)]
#[serde(deny_unknown_fields)]
pub struct Reach {
    /// Fore and aft (m).
    pub forward_m: f64,
    /// Sideways, at most (m),
    pub outward_m: f64,
    /// and at least, so that the legs do not touch (m).
    pub inward_m: f64,
    /// From the wish to step to the landing at any of these places, for the bounds of the pendulum (s). A controller may
    /// be quicker.
    pub min_step_time_s: f64,
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

    /// Sign of y on its side: 1 for the left foot, -1 for the right.
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

/// One of a thing for each foot.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct PerFoot<T> {
    pub left: T,
    pub right: T,
}

impl<T> PerFoot<T> {
    pub fn from_fn(mut f: impl FnMut(Foot) -> T) -> Self {
        Self { left: f(Foot::Left), right: f(Foot::Right) }
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
