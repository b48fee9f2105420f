//! The least time in which the motors of a leg can swing a foot to a landing place.
//!
//! The swing sole starts at home, keeps its orientation, and goes to its place beside the stance sole on a path of
//! least jerk, lifted by [`LIFT`]. During the swing the pelvis moves at constant speed, without turning, from above the
//! middle of the feet at home to above their middle at the landing. (A robot that steps falls towards the landing
//! place. With a pelvis that stays behind, the far places are out of reach.) The pelvis sinks smoothly, by the value of
//! [`SINKS`] with which the swing is quickest: a leg that is nearly straight needs fast joints. To a place on the other
//! side of the stance leg, the foot goes around the stance leg: see [`Around`].
//!
//! All of this scales with the time T of the swing: the joint angles q(u) are a function of the share u = t/T alone. So
//! the torques of the leg are `A(u)/T^2 + g(u)`, with the torques g against gravity, and the speeds are `q'(u)/T`. T is
//! long enough if every torque is within its servo's torque-speed curve all the way.
//!
//! Two things are left out: the load that the foot still carries at the lift, and the delay. So a controller needs more
//! time. The path is smooth. A motion that switches the motors from full torque to full torque could be quicker, but it
//! would land hard.

use super::dynamics::Dynamics;
use super::kinematics::{Kinematics, Pose, Posture};
use super::model::{Around, Foot, LandingRegion, PerFoot, Robot, Servo};
use super::size::Units;
use super::swing_shape::{bump, least_jerk};
use nalgebra::{DMatrix, DVector, Matrix6, Matrix6xX, Vector2, Vector3, Vector6};

/// Height of the sole in the middle of the swing, in COM heights.
pub const LIFT: f64 = 0.04;
/// Distances by which the pelvis may sink until the landing, in COM heights.
pub const SINKS: [f64; 5] = [0.0, 0.025, 0.05, 0.075, 0.1];
/// Number of intervals into which a swing is divided.
const PARTS: usize = 50;
/// Shortest and longest time that is considered, and accuracy of the result, in 1/omega.
const TIMES: [f64; 2] = [0.05, 50.0];
const ACCURACY: f64 = 5e-5;
/// Largest number of Newton steps for one posture, and the error of a sole's place below which the posture is found, in
/// COM heights.
const NEWTON_STEPS: usize = 60;
const FOUND: f64 = 3e-4;

/// A swing of `foot` from home to a landing place.
#[derive(Debug, Clone)]
pub struct SwingMotion<'a> {
    robot: &'a Robot,
    units: Units,
    foot: Foot,
    around: Around,
    /// Displacement of the sole over the ground (m), world axes.
    way: Vector2<f64>,
    lift_m: f64,
    /// Distance by which the pelvis sinks (m).
    sink_m: f64,
    least_time_s: f64,
    soles: PerFoot<Pose>,
    home: Posture,
    /// The last posture that was found, from which the search for the next one starts.
    posture: Posture,
    kinematics: Kinematics,
    jacobian: Matrix6xX<f64>,
}

impl<'a> SwingMotion<'a> {
    /// A swing to `to`: the offset from the centre of the stance sole (m), x forward and y to the side of `foot`. None
    /// if a leg cannot reach its sole's places within the limits of its joints, or if the motors cannot hold it there.
    pub fn new(robot: &'a Robot, foot: Foot, to: [f64; 2], around: Around) -> Option<Self> {
        let mut swing = Self::at_home(robot, foot);
        let from =
            swing.soles[foot].translation.vector - swing.soles[foot.other()].translation.vector;
        swing.way = Vector2::new(to[0], to[1] * foot.side()) - from.xy();
        swing.around = around;
        let com_height_m = swing.units.length_m;
        swing.lift_m = LIFT * com_height_m;
        let mut best: Option<Self> = None;
        for sink in SINKS {
            (swing.sink_m, swing.posture) = (sink * com_height_m, swing.home.clone());
            if let Some(time_s) = swing.time_s()
                && best.as_ref().is_none_or(|best| time_s < best.least_time_s)
            {
                best = Some(Self {
                    least_time_s: time_s,
                    ..swing.clone()
                });
            }
        }
        best
    }

    /// A swing that does not move, of a robot at home.
    fn at_home(robot: &'a Robot, foot: Foot) -> Self {
        let home = robot.home_posture();
        let kinematics = Kinematics::at(robot, &home);
        Self {
            robot,
            units: Units::of(robot),
            foot,
            around: Around::default(),
            way: Vector2::zeros(),
            lift_m: 0.0,
            sink_m: 0.0,
            least_time_s: f64::INFINITY,
            soles: kinematics.sole_poses(robot),
            posture: home.clone(),
            home,
            kinematics,
            jacobian: Matrix6xX::zeros(6 + robot.joints.len()),
        }
    }

    /// The least time (s) in which the motors can make this swing.
    pub fn least_time_s(&self) -> f64 {
        self.least_time_s
    }

    /// The posture at the share `u` of the swing, with the stance sole at its place at home. None if no posture is
    /// found.
    pub fn posture(&mut self, u: f64) -> Option<&Posture> {
        let lasts = 1.0 - self.around.sideways_from;
        let above = |height_m: f64| bump(height_m, u)[0];
        let place = Vector3::new(
            self.way.x * least_jerk(u / lasts) + above(self.around.arc_m),
            self.way.y * least_jerk((u - self.around.sideways_from) / lasts),
            above(self.lift_m),
        );
        self.posture.base = self.home.base;
        self.posture.base.translation.vector +=
            (0.5 * u * self.way).push(-self.sink_m * least_jerk(u));
        for foot in Foot::BOTH {
            let mut wanted = self.soles[foot];
            if foot == self.foot {
                wanted.translation.vector += place;
            }
            self.bring(foot, &wanted)?;
        }
        Some(&self.posture)
    }

    /// Moves the joints of a leg so that its sole is at the pose `wanted`, by Newton steps. A leg with fewer than six
    /// joints keeps the place of the sole, and not quite its orientation.
    fn bring(&mut self, foot: Foot, wanted: &Pose) -> Option<()> {
        let (robot, link, height_m) =
            (self.robot, self.robot.soles[foot].link, self.units.length_m);
        let leg: Vec<usize> = robot.leg(foot).collect();
        for _ in 0..NEWTON_STEPS {
            self.kinematics.update(robot, &self.posture);
            let sole = self.kinematics.sole_pose(robot, foot);
            // Lengths are in COM heights.
            let linear = (wanted.translation.vector - sole.translation.vector) / height_m;
            let angular = (wanted.rotation * sole.rotation.inverse()).scaled_axis();
            let error = Vector6::from_iterator(linear.iter().chain(angular.iter()).copied());
            if error.norm() < 1e-12 {
                break;
            }
            self.kinematics.point_jacobian(
                robot,
                link,
                &sole.translation.vector.into(),
                &mut self.jacobian,
            );
            // The orientation has little weight, since a leg may not reach place and orientation together.
            let weight = Vector6::new(1.0, 1.0, 1.0, 0.03, 0.03, 0.03);
            let columns = DMatrix::from_fn(6, leg.len(), |row, k| {
                let unit = if row < 3 { height_m } else { 1.0 };
                weight[row] * self.jacobian[(row, 6 + leg[k])] / unit
            });
            let normal = &columns * columns.transpose() + Matrix6::from_diagonal_element(1e-11);
            let step =
                columns.transpose() * normal.cholesky()?.solve(&error.component_mul(&weight));
            if step.amax() < 1e-12 {
                break;
            }
            let short = (0.3 / step.amax()).min(1.0);
            for (&j, step) in leg.iter().zip(step.iter()) {
                self.posture.q[j] += short * step;
            }
        }
        let sole = self.kinematics.sole_pose(robot, foot).translation.vector;
        let is_within = leg.iter().all(|&j| {
            (robot.joints[j].lower_rad..=robot.joints[j].upper_rad).contains(&self.posture.q[j])
        });
        ((sole - wanted.translation.vector).norm() < FOUND * height_m && is_within).then_some(())
    }

    /// The least time (s) with the present `sink_m`. It is None if there is none.
    fn time_s(&mut self) -> Option<f64> {
        let robot = self.robot;
        let leg: Vec<usize> = robot.leg(self.foot).collect();
        let (mut angles, mut heights) = (Vec::new(), Vec::new());
        for i in 0..=PARTS {
            let posture = self.posture(i as f64 / PARTS as f64)?;
            angles.push(leg.iter().map(|&j| posture.q[j]).collect::<Vec<f64>>());
            heights.push(posture.base.translation.z);
        }
        let curve =
            |[before, now, after]: [f64; 3]| (after - 2.0 * now + before) * (PARTS * PARTS) as f64;
        let mut dynamics = Dynamics::new(robot);
        let mut loads = Vec::new();
        let size = 6 + robot.joints.len();
        for i in 1..PARTS {
            let mut posture = self.home.clone();
            let (mut rates, mut accelerations) = (DVector::zeros(size), DVector::zeros(size));
            accelerations[2] = curve([i - 1, i, i + 1].map(|i| heights[i]));
            for (k, &j) in leg.iter().enumerate() {
                let [before, now, after] = [i - 1, i, i + 1].map(|i| angles[i][k]);
                posture.q[j] = now;
                rates[6 + j] = (after - before) * 0.5 * PARTS as f64;
                accelerations[6 + j] = curve([before, now, after]);
            }
            self.kinematics.update(robot, &posture);
            dynamics.update(robot, &self.kinematics, &DVector::zeros(size));
            let gravity = dynamics.bias().clone();
            dynamics.update(robot, &self.kinematics, &rates);
            let motion = dynamics.mass_matrix() * &accelerations + dynamics.bias() - &gravity;
            loads.extend(leg.iter().map(|&j| JointLoad {
                servo: robot.servos[j],
                motion: motion[6 + j],
                gravity: gravity[6 + j],
                rate: rates[6 + j],
            }));
        }
        let suffices = |time_s: f64| loads.iter().all(|load| load.is_within(time_s));
        let unit_s = self.units.time_s();
        let [mut short, mut long] = TIMES.map(|time| time * unit_s);
        if !suffices(long) {
            return None;
        }
        while long - short > ACCURACY * unit_s {
            let middle = 0.5 * (short + long);
            if suffices(middle) {
                long = middle;
            } else {
                short = middle;
            }
        }
        Some(long)
    }
}

/// Torque and speed of one joint at one place of the path, for a swing that lasts 1 s.
struct JointLoad {
    servo: Servo,
    /// Torque for the motion (N m s^2), and to carry the leg (N m).
    motion: f64,
    gravity: f64,
    /// Speed of the joint (rad).
    rate: f64,
}

impl JointLoad {
    /// Whether the servo suffices for a swing of this duration. Against the motion, it has its full torque.
    fn is_within(&self, time_s: f64) -> bool {
        let speed = self.rate / time_s;
        let moved = self.motion / (time_s * time_s) + self.gravity;
        let torque = moved + self.servo.lost_torque(speed);
        let drives = torque * speed > 0.0;
        let most = if drives {
            self.servo.available_torque(speed)
        } else {
            self.servo.torque_n_m
        };
        torque.abs() <= most && speed.abs() <= self.servo.no_torque_speed_rad_s
    }
}

/// The least time (s) in which either foot can swing from home to any corner of a region; None if a corner is out of
/// reach.
pub fn least_swing_time_s(robot: &Robot, region: &LandingRegion) -> Option<f64> {
    let mut most = 0.0_f64;
    for foot in Foot::BOTH {
        for to in region.corners() {
            most = most.max(SwingMotion::new(robot, foot, to, region.around())?.least_time_s());
        }
    }
    Some(most)
}
