//! The body: where COM and soles are wanted becomes joint angles ([`InverseKinematics`]), and what the ground is to give
//! becomes joint torques: those of a body at rest ([`load`]) or of one that moves ([`inverse_dynamics`]).

pub mod inverse_dynamics;
pub mod inverse_kinematics;
pub mod load;
pub mod nnls;
mod tasks;

use crate::control::estimate::{Estimate, control_frame};
use crate::lipm::Pendulum;
use crate::robot::dynamics::load_torques;
use crate::robot::{Command, GRAVITY, PerFoot, Pose, Posture, Robot};
pub use inverse_dynamics::{ContactModel, DesiredAcceleration, InverseDynamics, PredictedContact};
pub use inverse_kinematics::{BodyTargets, InverseKinematics};
use nalgebra::{Point2, Point3, UnitQuaternion, Vector2, Vector3};

/// Rate at which the COM reference comes back to the estimate (1/s). Between switches the joints' stiffness pulls the
/// COM to a reference that does not know of pushes: with 0 that spring outlasts the push, tips the feet and rings. From
/// 7 to 20 the toppling impulses are the same to 0.06 N s; small pushes settle sooner with more, large ones with less.
const FORGETTING_RATE: f64 = 10.0;
/// Rate at which the COM reference is moved to make up for sag (1/s).
const SHAPING_RATE: f64 = 1.0;
/// Sag is some millimetres; what asks for more is not sag (m).
const MOST_SHAPING_M: f64 = 0.02;
/// The COM goes back up to its height at home no faster than this (m/s).
const RISING_M_S: f64 = 0.03;

/// Where the COM is to be: world. Over the ground it is integrated from eq. 1 and 2, started from the estimate at every switch
/// and, other than in the paper, drawn back to it in between.
#[derive(Debug, Clone)]
pub struct ComReference {
    /// Over the ground (m).
    pub place: Point2<f64>,
    /// (m/s)
    pub vel: Vector2<f64>,
    /// Height, its rate and its acceleration (m, m/s, m/s^2).
    pub height: [f64; 3],
    /// Added to `place`: makes up for sag (paper, "COG reference shaping") (m).
    shaping: Vector2<f64>,
}

impl ComReference {
    /// Starts it over the ground from the estimate.
    pub fn start(&mut self, estimate: &Estimate) {
        (self.place, self.vel) = (estimate.com_xy(), estimate.com_vel_xy());
    }

    /// Moves it over the ground by a period under a ZMP (eq. 1 and 2); returns the acceleration (m/s^2).
    pub fn advance(&mut self, pendulum: &Pendulum, estimate: &Estimate, zmp: Point2<f64>) -> Vector2<f64> {
        let (com, com_vel, dt) = (estimate.com_xy(), estimate.com_vel_xy(), pendulum.dt);
        let acceleration = pendulum.com_acc(com, zmp);
        self.place += self.vel * dt + acceleration * (0.5 * dt * dt);
        self.vel += acceleration * dt;
        self.place += (com - self.place) * (FORGETTING_RATE * dt);
        self.vel += (com_vel - self.vel) * (FORGETTING_RATE * dt);
        acceleration
    }

    /// Moves it, over a period `dt` (s), against what the COM lags behind.
    pub fn make_up_for_sag(&mut self, com: Point2<f64>, dt: f64) {
        self.shaping += (self.place - com) * (SHAPING_RATE * dt);
        self.shaping = self.shaping.cap_magnitude(MOST_SHAPING_M);
    }
}

/// Where soles are to be, and how they move.
#[derive(Debug, Clone)]
pub struct SoleReference {
    pub poses: PerFoot<Pose>,
    /// Of their centres (m/s).
    pub velocities: PerFoot<Vector3<f64>>,
}

/// The body's reference: COM, and the posture that carries it.
#[derive(Debug)]
pub struct Body {
    pub com: ComReference,
    kinematics: InverseKinematics,
}

impl Body {
    /// At the posture and COM of an estimate, the height that of home.
    pub fn new(robot: &Robot, estimate: &Estimate, height_m: f64) -> Self {
        let com = ComReference {
            place: estimate.com_xy(),
            vel: Vector2::zeros(),
            height: [height_m, 0.0, 0.0],
            shaping: Vector2::zeros(),
        };
        Self { com, kinematics: InverseKinematics::at(robot, estimate.posture.clone()) }
    }

    /// Where the joints are sent.
    pub fn posture(&self) -> &Posture {
        &self.kinematics.posture
    }

    /// Of the reference: base linear, base angular, joints.
    pub fn velocity(&self) -> &nalgebra::DVector<f64> {
        &self.kinematics.velocity
    }

    /// Moves the reference posture by a period after the COM reference and the soles; writes joint angles and velocities.
    pub fn follow(
        &mut self,
        robot: &Robot,
        pendulum: &Pendulum,
        estimate: &Estimate,
        soles: SoleReference,
        command: &mut Command,
    ) {
        let (com, kinematics) = (&self.com, &mut self.kinematics);
        let shaped = com.place + com.shaping;
        kinematics.follow(
            robot,
            &BodyTargets {
                com: Point3::new(shaped.x, shaped.y, com.height[0]),
                rise: RISING_M_S * pendulum.dt,
                com_vel: Vector3::new(com.vel.x, com.vel.y, com.height[1]),
                soles: soles.poses,
                sole_vel: soles.velocities,
                trunk: upright(estimate),
            },
        );
        command.q_ref.copy_from_slice(&kinematics.posture.q);
        command.dq_ref.copy_from_slice(&kinematics.velocity.as_slice()[6..]);
    }
}

/// Orientation of an upright trunk that faces as the feet do.
pub fn upright(estimate: &Estimate) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&Vector3::z_axis(), control_frame(&estimate.footholds).rotation.angle())
}

/// Joint torques (N m) of a body that stands on `standing` feet, presses at `zmp` and whose COM accelerates over the ground
/// (m/s^2), limbs at rest.
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
    let wrenches = load::share(robot, &estimate.footholds, standing, zmp, force);
    load_torques(estimate.kinematics(), robot, effective, &wrenches, tau);
}
