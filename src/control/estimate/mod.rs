//! Estimates the state of the robot from encoders, IMU and sole wrenches: posture, COM, COM velocity, ZMP, contact.
//!
//! The position of the base follows from the loaded feet. The point of a sole under its centre of pressure is taken to
//! rest on the ground where the foot was put down, even while the foot rocks on an edge. The trunk's orientation comes
//! from the IMU. The COM of that posture goes through the [`Kalman`] filter.

pub mod kalman;

use crate::robot::{Foot, GRAVITY, Kinematics, PerFoot, Pose, Posture, Robot, Sensed, Sole};
use kalman::{Kalman, Trust};
use nalgebra::{Isometry2, Isometry3, Point2, Point3, UnitQuaternion, Vector2, Vector3};

/// A sole comes into contact when its load exceeds the first value, and stays so until its load is below the second
/// (N).
const CONTACT_FORCE_N: [f64; 2] = [5.0, 3.0];
/// A sole whose lowest corner is nearer to the ground than this is in contact too, since it can carry load at once (m).
/// The second value again applies to a sole that is already in contact.
const CONTACT_HEIGHT_M: [f64; 2] = [0.004, 0.007];
/// Noise that the Kalman filter assumes. For the COM it is the sensor noise along the chain from foot to COM; for the
/// disturbance, it suits pushes of 1 to 3 N s.
const TRUST: Trust = Trust {
    com_m: 0.0008,
    acceleration_m_s2: 1.0,
    swing_acceleration_m_s2: 3.0,
    model_m_s2: 1.0,
    disturbance_m_s2: 0.5,
};

/// The state as the controller estimates it, world frame.
#[derive(Debug, Clone)]
pub struct Estimate {
    pub posture: Posture,
    /// Kinematics of `posture`.
    kinematics: Kinematics,
    pub com: Point3<f64>,
    pub com_vel: Vector3<f64>,
    /// ZMP from the sole wrenches (m); it keeps its last value while no foot is loaded.
    pub zmp: Point2<f64>,
    /// Pose of each sole, at the centre of its contact face.
    pub soles: PerFoot<Pose>,
    /// Where each foot stands, flat on the ground. For a foot in the air, where it stood last.
    pub footholds: PerFoot<Pose>,
    pub in_contact: PerFoot<bool>,
    /// Vertical force on each sole (N).
    pub load_n: PerFoot<f64>,
}

impl Estimate {
    /// At home and at rest, with the weight shared equally by both feet.
    pub fn at_home(robot: &Robot) -> Self {
        let posture = robot.home_posture();
        let mut kinematics = Kinematics::new(robot);
        kinematics.update(robot, &posture);
        let (com, soles) = (kinematics.com(), soles_of(&kinematics, robot));
        Self {
            posture,
            kinematics,
            com,
            com_vel: Vector3::zeros(),
            zmp: com.xy(),
            soles,
            footholds: soles,
            in_contact: PerFoot { left: true, right: true },
            load_n: PerFoot::from_fn(|_| 0.5 * robot.mass() * GRAVITY),
        }
    }

    /// Kinematics of the estimated posture.
    pub fn kinematics(&self) -> &Kinematics {
        &self.kinematics
    }

    /// Notes that a foot is lifted. It counts as no contact until it lands.
    pub fn lift(&mut self, foot: Foot) {
        self.in_contact[foot] = false;
    }

    /// Ends the flight of a foot: its foothold is where the foot is now. If it is not `on_ground`, the foot waits for
    /// its contact to be detected.
    pub fn land(&mut self, foot: Foot, on_ground: bool) {
        self.footholds[foot] = flat(&self.soles[foot]);
        self.in_contact[foot] = on_ground;
    }

    /// Sets a known posture. COM and COM velocity stay as they are.
    pub fn place(&mut self, robot: &Robot, posture: &Posture) {
        self.posture.q.copy_from_slice(&posture.q);
        self.place_base(robot, posture.base.translation.vector, posture.base.rotation);
    }

    /// Sets the joint angles to the encoder readings, with the base at the origin. Returns its orientation by the IMU.
    fn read_posture(&mut self, robot: &Robot, sensed: &Sensed) -> UnitQuaternion<f64> {
        self.posture.q.copy_from_slice(&sensed.q);
        self.posture.base = Isometry3::identity();
        self.kinematics.update(robot, &self.posture);
        let trunk_in_base = self.kinematics.link_pose(robot.trunk).rotation;
        sensed.imu.orientation * trunk_in_base.inverse()
    }

    fn place_base(&mut self, robot: &Robot, translation: Vector3<f64>, rotation: UnitQuaternion<f64>) {
        self.posture.base = Isometry3::from_parts(translation.into(), rotation);
        self.kinematics.update(robot, &self.posture);
        self.soles = soles_of(&self.kinematics, robot);
    }

    /// Horizontal position of the COM (m).
    pub fn com_xy(&self) -> Point2<f64> {
        self.com.xy()
    }

    /// Horizontal velocity of the COM (m/s).
    pub fn com_vel_xy(&self) -> Vector2<f64> {
        self.com_vel.xy()
    }
}

/// The state estimator.
#[derive(Debug, Clone)]
pub struct Estimator {
    mass: f64,
    filters: [Kalman; 3],
    /// The last estimate.
    pub now: Estimate,
}

impl Estimator {
    /// For a robot at rest in the state of `start`, with a control period `dt` (s).
    pub fn new(robot: &Robot, dt: f64, start: Estimate) -> Self {
        let filter = Kalman::new(dt, TRUST);
        let mut filters = [filter.clone(), filter.clone(), filter];
        for (filter, com) in filters.iter_mut().zip(start.com.coords.iter()) {
            filter.state[0] = *com;
        }
        Self { mass: robot.mass(), filters, now: start }
    }

    /// Starts anew, at rest in the sensed posture. The lowest corner of a sole is then on the ground, and the world's
    /// origin is midway between the feet.
    pub fn restart(&mut self, robot: &Robot, sensed: &Sensed) {
        let now = &mut self.now;
        let rotation = now.read_posture(robot, sensed);
        now.place_base(robot, Vector3::zeros(), rotation);
        let [left, right] = Foot::BOTH.map(|foot| lowest_corner(&robot.soles[foot], &now.soles[foot]));
        let middle = 0.5 * (now.soles.left.translation.vector + now.soles.right.translation.vector);
        now.place_base(robot, Vector3::new(-middle.x, -middle.y, -left.min(right)), rotation);
        now.footholds = PerFoot::from_fn(|foot| flat(&now.soles[foot]));
        now.in_contact = PerFoot { left: false, right: false };
        (now.com, now.com_vel, now.zmp) = (now.kinematics.com(), Vector3::zeros(), now.kinematics.com().xy());
        for (filter, com) in self.filters.iter_mut().zip(self.now.com.coords.iter()) {
            filter.state = Vector3::new(*com, 0.0, 0.0);
        }
        self.measure_zmp(sensed);
        self.find_contact(robot, sensed, None);
    }

    /// Runs one tick. `in_air` is the foot that the controller is moving; it is not used to find the base.
    pub fn update(&mut self, robot: &Robot, sensed: &Sensed, in_air: Option<Foot>) {
        self.find_base(robot, sensed, in_air);
        let force = self.measure_zmp(sensed);
        let com = self.now.kinematics.com();
        let mut acceleration = sensed.imu.orientation * sensed.imu.accelerometer - Vector3::new(0.0, 0.0, GRAVITY);
        // The IMU measures the trunk. A pushed robot leans about its soles, so its speed grows with height: UT-mu2's
        // COM moves at 0.77 to 0.82 of the speed of its IMU, and lies at 0.81 of the IMU's height.
        let lean = (com.z / self.now.kinematics.link_pose(robot.trunk).translation.z).clamp(0.0, 1.0);
        acceleration.x *= lean;
        acceleration.y *= lean;
        let force_per_mass = force / self.mass - Vector3::new(0.0, 0.0, GRAVITY);
        for (axis, filter) in self.filters.iter_mut().enumerate() {
            filter.update(force_per_mass[axis], com[axis], acceleration[axis], in_air.is_some());
            self.now.com[axis] = filter.state[0];
            self.now.com_vel[axis] = filter.state[1];
        }
        self.find_contact(robot, sensed, in_air);
    }

    /// Finds the posture: joint angles from the encoders, orientation from the IMU, position from the loaded feet.
    fn find_base(&mut self, robot: &Robot, sensed: &Sensed, in_air: Option<Foot>) {
        let now = &mut self.now;
        let before = now.posture.base.translation.vector;
        let rotation = now.read_posture(robot, sensed);
        let (mut sum, mut carried) = (Vector3::zeros(), 0.0);
        for foot in Foot::BOTH.into_iter().filter(|&f| in_air != Some(f)) {
            let load = sensed.soles[foot].force.z;
            // A smaller load is mostly noise.
            if load < CONTACT_FORCE_N[0] {
                continue;
            }
            let pressed = pressure_point(&robot.soles[foot], sensed, foot);
            let in_base = now.kinematics.sole_pose(robot, foot) * pressed;
            let in_world = now.footholds[foot] * pressed;
            sum += (in_world.coords - rotation * in_base.coords) * load;
            carried += load;
        }
        // In flight the base stays where it was: no sensor tells more, and flights are short.
        now.place_base(robot, if carried > 0.0 { sum / carried } else { before }, rotation);
    }

    /// Computes the ZMP on the ground from the sole wrenches, and returns their total force (N).
    fn measure_zmp(&mut self, sensed: &Sensed) -> Vector3<f64> {
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for foot in Foot::BOTH {
            let sole = &self.now.soles[foot];
            let f = sole.rotation * sensed.soles[foot].force;
            self.now.load_n[foot] = f.z;
            force += f;
            moment += sole.rotation * sensed.soles[foot].moment + sole.translation.vector.cross(&f);
        }
        if force.z > CONTACT_FORCE_N[0] {
            self.now.zmp = Point2::new(-moment.y / force.z, moment.x / force.z);
        }
        force
    }

    fn find_contact(&mut self, robot: &Robot, sensed: &Sensed, in_air: Option<Foot>) {
        for foot in Foot::BOTH.into_iter().filter(|&f| in_air != Some(f)) {
            let pose = &self.now.soles[foot];
            let low = lowest_corner(&robot.soles[foot], pose);
            let threshold = usize::from(self.now.in_contact[foot]);
            let touches = sensed.soles[foot].force.z > CONTACT_FORCE_N[threshold] || low < CONTACT_HEIGHT_M[threshold];
            if touches && !self.now.in_contact[foot] {
                self.now.footholds[foot] = flat(pose);
            }
            self.now.in_contact[foot] = touches;
        }
    }
}

/// Pose of each sole, at the centre of its contact face.
fn soles_of(kinematics: &Kinematics, robot: &Robot) -> PerFoot<Pose> {
    PerFoot::from_fn(|foot| kinematics.sole_pose(robot, foot))
}

/// Height of the lowest corner of a sole (m).
fn lowest_corner(sole: &Sole, pose: &Pose) -> f64 {
    sole.corners().into_iter().map(|corner| (pose * corner).z).fold(f64::INFINITY, f64::min)
}

/// Centre of pressure of a foot, in the frame of its sole.
fn pressure_point(sole: &Sole, sensed: &Sensed, foot: Foot) -> Point3<f64> {
    let wrench = &sensed.soles[foot];
    if wrench.force.z <= 1e-3 {
        return Point3::origin();
    }
    let [x, y] = [-wrench.moment.y / wrench.force.z, wrench.moment.x / wrench.force.z];
    Point3::new(x.clamp(-sole.half_m[0], sole.half_m[0]), y.clamp(-sole.half_m[1], sole.half_m[1]), 0.0)
}

/// The pose of a sole flat on the ground below `pose`, with its heading.
fn flat(pose: &Pose) -> Pose {
    let yaw = heading(pose);
    let p = pose.translation.vector;
    Isometry3::from_parts(Vector3::new(p.x, p.y, 0.0).into(), UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw))
}

/// A pose (of a foothold or a base) seen from above: horizontal position and heading.
pub fn on_ground(pose: &Pose) -> Isometry2<f64> {
    Isometry2::new(pose.translation.vector.xy(), heading(pose))
}

/// Heading of a pose's x axis, seen from above (rad).
pub fn heading(pose: &Pose) -> f64 {
    let x = pose.rotation * Vector3::x();
    x.y.atan2(x.x)
}

/// Pose of the control frame in the world (paper, Sect. III.A): its origin is midway between the soles' centres, and
/// its x axis points along the mean heading of the feet.
pub fn control_frame(footholds: &PerFoot<Pose>) -> Isometry2<f64> {
    let middle = (footholds.left.translation.vector.xy() + footholds.right.translation.vector.xy()) / 2.0;
    let [left, right] = [heading(&footholds.left), heading(&footholds.right)];
    // The mean of two directions, also across the jump of the angle from pi to -pi.
    let sum = Vector2::new(left.cos() + right.cos(), left.sin() + right.sin());
    Isometry2::new(middle, sum.y.atan2(sum.x))
}
