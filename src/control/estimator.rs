//! Where the robot is, from encoders, IMU and sole wrenches: posture, COM and its velocity, measured ZMP, contact.
//!
//! The base is found from the feet that carry: the point of a sole under its centre of pressure rests on the ground
//! where the foot was put down, also while the foot rocks on an edge. The trunk's orientation comes from the IMU. The
//! COM of that posture goes through the [`Kalman`] filter.

use super::kalman::{Kalman, Trust};
use crate::lipm::pendulum::Pendulum;
use crate::robot::{Foot, GRAVITY, Kinematics, PerFoot, Pose, Posture, Robot, Sensed, Sole};
use nalgebra::{Isometry2, Isometry3, Point2, Point3, UnitQuaternion, Vector2, Vector3};

/// A sole that carries more than this is in contact (N); it may carry less than the second before it counts as lifted.
const CONTACT_FORCE_N: [f64; 2] = [5.0, 3.0];
/// A sole that is less than this above the ground is in contact too: it can carry at once (m). Likewise.
const CONTACT_HEIGHT_M: [f64; 2] = [0.004, 0.007];
/// What the Kalman filter trusts: the COM by the sensors' noise on the way from foot to COM; disturbances that come and
/// go as a push of 1 to 3 N s does.
pub(super) const TRUST: Trust = Trust {
    com_m: 0.0008,
    acceleration_m_s2: 1.0,
    swing_acceleration_m_s2: 3.0,
    model_m_s2: 1.0,
    disturbance_m_s2: 0.5,
};

/// What the controller believes, world frame.
#[derive(Debug, Clone)]
pub struct Estimate {
    pub posture: Posture,
    pub com: Point3<f64>,
    pub com_vel: Vector3<f64>,
    /// From the sole wrenches; the last one while nothing presses.
    pub zmp: Point2<f64>,
    /// Centre of each sole's contact face.
    pub soles: PerFoot<Pose>,
    /// Where each foot stands, flat on the ground; where it stood last while it is in the air.
    pub footholds: PerFoot<Pose>,
    pub in_contact: PerFoot<bool>,
    /// Vertical force on each sole (N).
    pub load_n: PerFoot<f64>,
}

impl Estimate {
    /// COM over the ground.
    pub fn com_xy(&self) -> Point2<f64> {
        self.com.xy()
    }

    /// Horizontal velocity of the COM.
    pub fn com_vel_xy(&self) -> Vector2<f64> {
        self.com_vel.xy()
    }
}

/// The estimator. Starts at home, at rest.
#[derive(Debug)]
pub struct Estimator {
    mass: f64,
    kinematics: Kinematics,
    filters: [Kalman; 3],
    /// The foot that is being moved: it tells nothing of where the robot is.
    swing: Option<Foot>,
    /// The last estimate.
    pub now: Estimate,
}

impl Estimator {
    /// At home, at rest.
    pub fn new(robot: &Robot, pendulum: &Pendulum) -> Self {
        let posture = robot.home_posture();
        let mut kinematics = Kinematics::new(robot);
        kinematics.update(robot, &posture);
        let com = kinematics.com();
        let soles = PerFoot::from_fn(|foot| kinematics.sole_pose(robot, foot));
        let filter = Kalman::new(pendulum.dt, TRUST);
        let mut filters = [filter.clone(), filter.clone(), filter];
        for (filter, com) in filters.iter_mut().zip(com.coords.iter()) {
            filter.state[0] = *com;
        }
        let now = Estimate {
            posture,
            com,
            com_vel: Vector3::zeros(),
            zmp: com.xy(),
            soles,
            footholds: soles,
            in_contact: PerFoot { left: true, right: true },
            load_n: PerFoot::from_fn(|_| 0.5 * robot.mass() * GRAVITY),
        };
        Self { mass: robot.mass(), kinematics, filters, swing: None, now }
    }

    /// Kinematics of the estimated posture.
    pub fn kinematics(&self) -> &Kinematics {
        &self.kinematics
    }

    /// The controller lifts a foot: until it lands it is no foothold.
    pub fn lift(&mut self, foot: Foot) {
        self.swing = Some(foot);
        self.now.in_contact[foot] = false;
    }

    /// The foot that was lifted stands where it is now; or, if it is not `on_ground`, is to be found by its contact.
    pub fn land(&mut self, on_ground: bool) {
        if let Some(foot) = self.swing.take() {
            self.now.footholds[foot] = flat(&self.now.soles[foot]);
            self.now.in_contact[foot] = on_ground;
        }
    }

    /// One tick.
    pub fn update(&mut self, robot: &Robot, sensed: &Sensed) {
        self.find_base(robot, sensed);
        let force = self.measure_zmp(sensed);
        let com = self.kinematics.com();
        let mut acceleration = sensed.imu.orientation * sensed.imu.accelerometer - Vector3::new(0.0, 0.0, GRAVITY);
        // That is the trunk's. A robot that is pushed leans about its soles, the faster the higher: UT-mu2's COM moves at
        // 0.77 to 0.82 of the speed of its IMU, and lies at 0.81 of its height.
        let lean = (com.z / self.kinematics.link_pose(robot.trunk).translation.z).clamp(0.0, 1.0);
        acceleration.x *= lean;
        acceleration.y *= lean;
        let force_per_mass = force / self.mass - Vector3::new(0.0, 0.0, GRAVITY);
        for (axis, filter) in self.filters.iter_mut().enumerate() {
            filter.update(force_per_mass[axis], com[axis], acceleration[axis], self.swing.is_some());
            self.now.com[axis] = filter.state[0];
            self.now.com_vel[axis] = filter.state[1];
        }
        self.find_contact(robot, sensed);
    }

    /// Posture: joint angles as read, orientation by the IMU, position by the feet that carry.
    fn find_base(&mut self, robot: &Robot, sensed: &Sensed) {
        let posture = &mut self.now.posture;
        let before = posture.base.translation.vector;
        posture.q.copy_from_slice(&sensed.q);
        posture.base = Isometry3::identity();
        self.kinematics.update(robot, posture);
        let trunk_in_base = self.kinematics.link_pose(robot.trunk).rotation;
        let rotation = sensed.imu.orientation * trunk_in_base.inverse();
        let (mut sum, mut carried) = (Vector3::zeros(), 0.0);
        for foot in Foot::BOTH.into_iter().filter(|&f| self.swing != Some(f)) {
            let load = sensed.soles[foot].force.z;
            // Below that it is mostly noise.
            if load < CONTACT_FORCE_N[0] {
                continue;
            }
            let pressed = pressure_point(&robot.soles[foot], sensed, foot);
            let in_base = self.kinematics.sole_pose(robot, foot) * pressed;
            let in_world = self.now.footholds[foot] * pressed;
            sum += (in_world.coords - rotation * in_base.coords) * load;
            carried += load;
        }
        // In flight the base stays where it was: nothing tells better, and it does not last.
        let translation = if carried > 0.0 { sum / carried } else { before };
        self.now.posture.base = Isometry3::from_parts(translation.into(), rotation);
        self.kinematics.update(robot, &self.now.posture);
        self.now.soles = PerFoot::from_fn(|foot| self.kinematics.sole_pose(robot, foot));
    }

    /// ZMP on the ground from the sole wrenches; returns their total force.
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

    fn find_contact(&mut self, robot: &Robot, sensed: &Sensed) {
        for foot in Foot::BOTH.into_iter().filter(|&f| self.swing != Some(f)) {
            let sole = &robot.soles[foot];
            let pose = &self.now.soles[foot];
            let low = sole.corners().into_iter().map(|c| (pose * c).z).fold(f64::INFINITY, f64::min);
            let threshold = usize::from(self.now.in_contact[foot]);
            let touches = sensed.soles[foot].force.z > CONTACT_FORCE_N[threshold] || low < CONTACT_HEIGHT_M[threshold];
            if touches && !self.now.in_contact[foot] {
                self.now.footholds[foot] = flat(pose);
            }
            self.now.in_contact[foot] = touches;
        }
    }
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

/// A pose (a foothold, a base) as seen from above: place and heading.
pub fn on_ground(pose: &Pose) -> Isometry2<f64> {
    Isometry2::new(pose.translation.vector.xy(), heading(pose))
}

/// Heading of a pose's x axis over the ground (rad).
pub fn heading(pose: &Pose) -> f64 {
    let x = pose.rotation * Vector3::x();
    x.y.atan2(x.x)
}
