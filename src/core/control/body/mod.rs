//! The body: turns desired positions of COM and soles into joint angles ([`InverseKinematics`]), and desired ground
//! reaction forces into joint torques. The body is taken to be at rest ([`crate::robot::sole_wrenches`]) or to move
//! ([`inverse_dynamics`]).

pub mod inverse_dynamics;
pub mod inverse_kinematics;
pub mod nnls;
mod tasks;

use crate::control::estimate::{Estimate, control_frame};
use crate::lipm::Pendulum;
use crate::robot::dynamics::load_torques;
use crate::robot::sole_wrenches;
use crate::robot::{GRAVITY, PerFoot, Pose, Posture, Robot, Units};
use crate::socket::Command;
pub use inverse_dynamics::{ContactModel, DesiredAcceleration, InverseDynamics, PredictedContact};
pub use inverse_kinematics::{BodyTargets, InverseKinematics};
use nalgebra::{Point2, Point3, UnitQuaternion, Vector2, Vector3};

/// Rate at which the COM reference is drawn back to the estimate, in omega. Between switches, the stiff joints pull the
/// COM to a reference that does not know of pushes. With a rate of 0 this pull outlasts the push, tips the feet and
/// makes the body oscillate. From 1.2 to 3.5 the toppling impulses of UT-mu2 differ by at most 0.06 N s. A higher rate
/// settles small pushes sooner, and large ones later.
const FORGETTING_RATE: f64 = 1.4;
/// Rate at which the COM reference is shifted to compensate for sag, in omega.
const SHAPING_RATE: f64 = 0.18;
/// Largest shift for sag, in COM heights. Sag is about a hundredth; a larger error has another cause.
const MOST_SHAPING: f64 = 0.065;
/// Largest speed at which the COM rises back to its home height, in COM heights times omega. At a higher speed the
/// robot would leave the ground.
pub const RISING: f64 = 0.017;

/// The COM reference, world frame. Its horizontal part is integrated from eq. 1 and 2 and starts from the estimate at
/// every switch. Unlike in the paper, it is drawn back to the estimate in between.
#[derive(Debug, Clone)]
pub struct ComReference {
    /// Horizontal position (m).
    pub place: Point2<f64>,
    /// Horizontal velocity (m/s).
    pub vel: Vector2<f64>,
    /// Height, its rate and its acceleration (m, m/s, m/s^2).
    pub height: [f64; 3],
    /// Shift added to `place` to compensate for sag (m); the paper calls it "COG reference shaping".
    shaping: Vector2<f64>,
}

impl ComReference {
    /// Starts the horizontal part from the estimate.
    pub fn start(&mut self, estimate: &Estimate) {
        (self.place, self.vel) = (estimate.com_xy(), estimate.com_vel_xy());
    }

    /// Integrates the horizontal part over a period with the given ZMP (eq. 1, 2), and returns its acceleration
    /// (m/s^2).
    pub fn advance(
        &mut self,
        pendulum: &Pendulum,
        estimate: &Estimate,
        zmp: Point2<f64>,
    ) -> Vector2<f64> {
        let (com, com_vel, dt) = (estimate.com_xy(), estimate.com_vel_xy(), pendulum.dt);
        let (acceleration, forgotten) = (
            pendulum.com_acc(com, zmp),
            FORGETTING_RATE * pendulum.phase(),
        );
        self.place += self.vel * dt + acceleration * (0.5 * dt * dt);
        self.vel += acceleration * dt;
        self.place += (com - self.place) * forgotten;
        self.vel += (com_vel - self.vel) * forgotten;
        acceleration
    }

    /// Shifts the reference, over a period, against the lag of the COM behind it. `com_height` is the COM height at
    /// home (m).
    pub fn make_up_for_sag(&mut self, pendulum: &Pendulum, com_height: f64, com: Point2<f64>) {
        self.shaping += (self.place - com) * (SHAPING_RATE * pendulum.phase());
        self.shaping = self.shaping.cap_magnitude(MOST_SHAPING * com_height);
    }
}

/// Desired poses and velocities of the soles.
#[derive(Debug, Clone)]
pub struct SoleReference {
    pub poses: PerFoot<Pose>,
    /// Velocities of the soles' centres (m/s).
    pub velocities: PerFoot<Vector3<f64>>,
}

/// The references of the body: the COM, and the posture that follows it.
#[derive(Debug, Clone)]
pub struct Body {
    pub com: ComReference,
    /// Desired tilt of the trunk from upright about its x and y axes (rad).
    pub tilt: Vector2<f64>,
    /// Desired turn of the trunk about its z axis from the direction of the feet (rad). Like the tilt, it stays until the
    /// next footstep.
    pub turn: f64,
    kinematics: InverseKinematics,
    /// Largest speed at which the COM rises (m/s).
    rising_m_s: f64,
}

impl Body {
    /// Starts at the posture and COM of an estimate, with the COM height of the home posture.
    pub fn new(robot: &Robot, units: &Units, estimate: &Estimate) -> Self {
        let com = ComReference {
            place: estimate.com_xy(),
            vel: Vector2::zeros(),
            height: [units.length_m, 0.0, 0.0],
            shaping: Vector2::zeros(),
        };
        let kinematics = InverseKinematics::at(robot, estimate.posture.clone());
        Self {
            com,
            tilt: Vector2::zeros(),
            turn: 0.0,
            kinematics,
            rising_m_s: RISING * units.speed_m_s(),
        }
    }

    /// The reference posture, to which the joints are sent.
    pub fn posture(&self) -> &Posture {
        &self.kinematics.posture
    }

    /// Velocity of the reference posture: base linear, base angular, joints.
    pub fn velocity(&self) -> &nalgebra::DVector<f64> {
        &self.kinematics.velocity
    }

    /// Moves the reference posture by one period towards COM reference and soles, and writes `q_ref` and `dq_ref`. The
    /// trunk is led to the desired orientation at a share `as_it_is` of 0, and stays as it is at 1.
    pub fn follow(
        &mut self,
        robot: &Robot,
        pendulum: &Pendulum,
        estimate: &Estimate,
        soles: SoleReference,
        as_it_is: f64,
        command: &mut Command,
    ) {
        let is = estimate.kinematics().link_pose(robot.trunk).rotation;
        let trunk = self.trunk(estimate).slerp(&is, as_it_is);
        let (com, kinematics) = (&self.com, &mut self.kinematics);
        let shaped = com.place + com.shaping;
        kinematics.follow(
            robot,
            &BodyTargets {
                com: Point3::new(shaped.x, shaped.y, com.height[0]),
                rise: self.rising_m_s * pendulum.dt,
                com_vel: Vector3::new(com.vel.x, com.vel.y, com.height[1]),
                soles: soles.poses,
                sole_vel: soles.velocities,
                trunk,
            },
        );
        command.q_ref.copy_from_slice(&kinematics.posture.q);
        command
            .dq_ref
            .copy_from_slice(&kinematics.velocity.as_slice()[6..]);
    }

    /// The desired orientation of the trunk.
    pub fn trunk(&self, estimate: &Estimate) -> UnitQuaternion<f64> {
        upright(estimate) * UnitQuaternion::from_scaled_axis(self.tilt.push(self.turn))
    }
}

/// Orientation of an upright trunk that faces in the mean direction of the feet.
pub fn upright(estimate: &Estimate) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(
        &Vector3::z_axis(),
        control_frame(&estimate.footholds).rotation.angle(),
    )
}

/// Writes to `tau` the joint torques (N m) of a body that stands on the `standing` feet with its ZMP at `zmp` (m),
/// while its COM accelerates horizontally by `acceleration` (m/s^2) and its limbs do not move.
pub fn carry(
    robot: &Robot,
    estimate: &Estimate,
    standing: &PerFoot<bool>,
    zmp: Point2<f64>,
    acceleration: Vector2<f64>,
    tau: &mut [f64],
) {
    let effective = Vector3::new(-acceleration.x, -acceleration.y, -GRAVITY);
    let force = -effective * robot.mass();
    let wrenches = sole_wrenches::share(robot, &estimate.footholds, standing, zmp, force);
    load_torques(estimate.kinematics(), robot, effective, &wrenches, tau);
}
