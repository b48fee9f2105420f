//! The simulated robot. One control tick is a call of `sense` and then a call of `advance` with a command.

use super::contact::{ContactPart, WorldWrench};
use super::loads::{Loads, PeakLoads};
use super::meeting::{Meeting, Pairs};
use super::pendulum::{Strike, Struck, pushed_point};
use super::physics::Physics;
use super::push::Push;
use super::sensors::Sensors;
use super::servo::{self, Target};
use super::similar;
use super::{Engine, Ground, SensorErrors};
use nalgebra::{
    DVector, Isometry3, Matrix3xX, Matrix6xX, Point3, UnitQuaternion, Vector3, Vector6,
};
use standfast_core::robot::{Foot, Kinematics, PerFoot, Posture, Robot};
use standfast_core::socket::{Command, Imu, Sensed, Wrench};
use std::collections::VecDeque;
use std::sync::Arc;

/// Engine and time steps of the simulation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    pub engine: Engine,
    pub physics_step_s: f64,
    /// A whole number of physics steps (s).
    pub control_period_s: f64,
}

/// A force on a point of a link that acts as long as it is set.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pull {
    /// Index into `Robot::links`. An index out of range panics.
    pub link: usize,
    /// Point in the link's frame (m). Its position in the world is updated once per control period.
    pub point: Point3<f64>,
    /// Force in the world frame (N).
    pub force: Vector3<f64>,
}

/// A simulated robot. A copy continues from the present state to the same bits.
#[derive(Clone)]
pub struct Plant {
    robot: Arc<Robot>,
    /// The ground on its final slope.
    ground: Ground,
    clock: Clock,
    pairs: Pairs,
    physics: Box<dyn Physics>,
    sensors: Sensors,
    kinematics: Kinematics,
    /// Delayed commands, each with the number of the physics step at which it reaches the servos.
    in_flight: VecDeque<(u64, Command)>,
    acting: Command,
    drives: Vec<servo::Drive>,
    /// Excess of the past torques of each servo over its limit (N m).
    owed: Vec<f64>,
    loads: Loads,
    /// Number of physics steps done.
    steps: u64,
    delay_steps: u64,
    /// A force on a link that acts until it is removed.
    pub pull: Option<Pull>,
    /// The point on which pushes act in the frame of its link's [body](Physics::body), with the orientation of the body
    /// at home.
    push_origin: Isometry3<f64>,
    com_jacobian: Matrix3xX<f64>,
    trunk_jacobian: Matrix6xX<f64>,
    /// Velocity of the trunk's origin one tick ago, for the accelerometer.
    trunk_vel_before: Vector3<f64>,
    truth: Truth,
}

/// The true state of the simulation in the world frame, for referee, trace and view. The controller never sees it.
#[derive(Debug, Clone)]
pub struct Truth {
    pub time_s: f64,
    /// The ground at this time.
    pub ground: Ground,
    pub posture: Posture,
    /// Generalised velocity: velocity of the base's origin, angular velocity of the base (world axes), joint rates.
    pub velocity: DVector<f64>,
    pub com: Point3<f64>,
    /// Velocity of the COM (m/s).
    pub com_vel: Vector3<f64>,
    /// Pose of the trunk in the world; velocity of its origin (m/s) and angular velocity (rad/s) in world axes.
    pub trunk: Isometry3<f64>,
    pub trunk_velocity: Vector6<f64>,
    /// Pose of each sole, at the centre of its contact face.
    pub soles: PerFoot<Isometry3<f64>>,
    // Averages over the past tick:
    /// Wrench of the ground on each sole about its centre, world axes.
    pub sole_wrenches: PerFoot<Wrench>,
    /// Sum of all forces of the ground on the robot (N).
    pub contact_force: Vector3<f64>,
    /// ZMP of all contacts on the plane z = 0 (m). It is None in flight.
    pub zmp: Option<[f64; 2]>,
    /// Sum of pushes and pull (N), and the point where the last one acts.
    pub push_force: Vector3<f64>,
    pub push_point: Point3<f64>,
    /// Joint torques (N m).
    pub tau: Vec<f64>,
    /// Index into `Robot::links` of the first link that touched the ground in the past tick, other than by its sole.
    pub touching: Option<usize>,
    /// The pair of links that pressed on each other hardest in the past tick. Pairs of links of both legs go before
    /// others.
    pub meeting: Option<Meeting>,
    /// The largest loads in the past tick.
    pub loads: PeakLoads,
    /// The bob of the last push by a pendulum.
    pub strike: Option<Strike>,
}

impl Truth {
    /// A robot at rest in a posture, with no force yet. The poses of trunk and soles are still to be set.
    pub fn at_rest(posture: Posture, com: Point3<f64>, ground: Ground) -> Self {
        let joints = posture.q.len();
        Self {
            time_s: 0.0,
            ground,
            posture,
            velocity: DVector::zeros(6 + joints),
            com,
            com_vel: Vector3::zeros(),
            trunk: Isometry3::identity(),
            trunk_velocity: Vector6::zeros(),
            soles: PerFoot::from_fn(|_| Isometry3::identity()),
            sole_wrenches: PerFoot::default(),
            contact_force: Vector3::zeros(),
            zmp: None,
            push_force: Vector3::zeros(),
            push_point: com,
            tau: vec![0.0; joints],
            touching: None,
            meeting: None,
            loads: PeakLoads::default(),
            strike: None,
        }
    }

    /// Whether every number is finite and below 1e6 (m, m/s, rad/s), which no robot on Earth reaches. Rapier freezes a
    /// body whose numbers overflow, so such a robot would otherwise seem to stand still, perhaps upright.
    pub fn is_finite(&self) -> bool {
        const LARGEST: f64 = 1e6;
        let numbers = self
            .com
            .coords
            .iter()
            .chain(self.com_vel.iter())
            .chain(self.velocity.iter());
        numbers.into_iter().all(|v| v.abs() < LARGEST)
    }

    /// Pivot of the rope of a push by a pendulum, and centre of its bob (m), until the bob is caught.
    pub fn rope(&self) -> Option<[Point3<f64>; 2]> {
        self.strike.as_ref()?.rope_at(self.time_s)
    }

    /// Angle of the trunk's z axis from the vertical (rad).
    pub fn tilt_rad(&self) -> f64 {
        (self.trunk.rotation * Vector3::z()).angle(&Vector3::z())
    }
}

impl Plant {
    /// The robot at rest in its home posture on level ground, with servos that hold `initial`.
    pub fn new(
        robot: impl Into<Arc<Robot>>,
        clock: Clock,
        errors: Option<SensorErrors>,
        initial: Command,
    ) -> Self {
        Self::on(Ground::default(), robot, clock, errors, initial)
    }

    /// The robot at rest in its home posture on `ground`, which is level at first and then tilts to its slope. The
    /// engine must [take](Engine::check) the robot.
    pub fn on(
        ground: Ground,
        robot: impl Into<Arc<Robot>>,
        clock: Clock,
        errors: Option<SensorErrors>,
        initial: Command,
    ) -> Self {
        let robot = &robot.into();
        let posture = robot.home_posture();
        let pairs = Pairs::new(robot);
        let physics = similar::start(
            clock.engine,
            robot,
            &ground,
            &pairs,
            &posture,
            clock.physics_step_s,
        );
        let joints = robot.joints.len();
        let kinematics = Kinematics::at(robot, &posture);
        let com = kinematics.com();
        let pushed = robot.pushed;
        let pushed_body = physics.body(pushed.link);
        let push_point = pushed_point(robot, &kinematics);
        let truth = Truth::at_rest(posture, com, ground.at(0.0));
        let mut plant = Self {
            robot: Arc::clone(robot),
            ground,
            clock,
            pairs,
            physics,
            sensors: Sensors::new(joints, robot.noise, errors),
            kinematics,
            in_flight: VecDeque::new(),
            acting: initial,
            drives: vec![
                servo::Drive {
                    constant: 0.0,
                    damping: 0.0
                };
                joints
            ],
            owed: vec![0.0; joints],
            loads: Loads::new(joints, clock.physics_step_s),
            steps: 0,
            // The delay is rounded to whole physics steps.
            delay_steps: (robot.delay_s / clock.physics_step_s).round() as u64,
            pull: None,
            push_origin: pushed_body.inverse()
                * Isometry3::from_parts(push_point.coords.into(), UnitQuaternion::identity()),
            com_jacobian: Matrix3xX::zeros(6 + joints),
            trunk_jacobian: Matrix6xX::zeros(6 + joints),
            trunk_vel_before: Vector3::zeros(),
            truth,
        };
        plant.read_state();
        plant.pretend_contact();
        plant
    }

    /// The robot that is simulated.
    pub fn robot(&self) -> Arc<Robot> {
        Arc::clone(&self.robot)
    }

    /// The true state now, with averages over the past tick.
    pub fn truth(&self) -> &Truth {
        &self.truth
    }

    /// The readings of the sensors now.
    pub fn sense(&mut self) -> Sensed {
        let truth = &self.truth;
        let [linear, angular] =
            [0, 3].map(|first| truth.trunk_velocity.fixed_rows::<3>(first).into_owned());
        let velocities = [self.trunk_vel_before, linear];
        let mut sensed = Sensed {
            time_s: truth.time_s,
            q: truth.posture.q.clone(),
            dq: truth.velocity.rows_range(6..).iter().copied().collect(),
            imu: Imu::over(
                self.clock.control_period_s,
                truth.trunk.rotation,
                velocities,
                angular,
            ),
            soles: PerFoot::from_fn(|foot| {
                let to_sole = truth.soles[foot].rotation.inverse();
                let wrench = truth.sole_wrenches[foot];
                Wrench {
                    force: to_sole * wrench.force,
                    moment: to_sole * wrench.moment,
                }
            }),
        };
        self.sensors
            .corrupt(&mut sensed, self.steps / self.substeps());
        sensed
    }

    /// Physics steps in a control period.
    fn substeps(&self) -> u64 {
        (self.clock.control_period_s / self.clock.physics_step_s).round() as u64
    }

    /// Simulates one control period with `pushes` and with `command`, which reaches the servos after the robot's delay.
    pub fn advance(&mut self, command: Command, pushes: &[Push]) {
        self.in_flight
            .push_back((self.steps + self.delay_steps, command));
        self.trunk_vel_before = self.truth.trunk_velocity.fixed_rows::<3>(0).into();
        self.truth.tau.fill(0.0);
        self.truth.touching = None;
        self.truth.meeting = None;
        self.truth.loads = PeakLoads::default();
        let substeps = self.substeps();
        let share = 1.0 / substeps as f64;
        let mut soles = PerFoot::<WorldWrench>::default();
        let mut total = WorldWrench::default();
        let mut push_force = Vector3::zeros();
        for _ in 0..substeps {
            while self
                .in_flight
                .front()
                .is_some_and(|(due, _)| *due <= self.steps)
            {
                self.acting = self.in_flight.pop_front().expect("front exists").1;
            }
            push_force += self.apply_pushes(pushes) * share;
            self.drive_joints();
            self.tilt_ground();
            self.physics.step();
            self.steps += 1;
            self.add_torques(share);
            self.add_contacts(share, &mut soles, &mut total);
        }
        self.read_state();
        let truth = &mut self.truth;
        truth.push_force = push_force;
        truth.contact_force = total.force;
        truth.zmp = total.zmp();
        for foot in Foot::BOTH {
            truth.sole_wrenches[foot] =
                soles[foot].about(&truth.soles[foot].translation.vector.into());
        }
    }

    /// Applies pushes and pull for the next physics step, and returns the sum of their forces (N).
    fn apply_pushes(&mut self, pushes: &[Push]) -> Vector3<f64> {
        let from_s = self.steps as f64 * self.clock.physics_step_s;
        self.physics.clear_forces();
        let link = self.robot.pushed.link;
        let mut sum = Vector3::zeros();
        for push in pushes {
            if push.bob.is_some() {
                sum += self.strike(push, from_s);
                continue;
            }
            let force = push.mean_force(from_s, from_s + self.clock.physics_step_s);
            if force != Vector3::zeros() {
                self.apply(link, force, self.aim(push));
                sum += force;
            }
        }
        if let Some(Pull { link, point, force }) = self.pull {
            self.apply(link, force, self.kinematics.link_pose(link) * point);
            sum += force;
        }
        sum
    }

    /// The point at which a push is aimed now (m).
    fn aim(&self, push: &Push) -> Point3<f64> {
        let origin = self.physics.body(self.robot.pushed.link) * self.push_origin;
        origin * Point3::new(0.0, 0.0, push.height_m)
    }

    /// Hangs up the bob of a push, if it has one that does not hang yet.
    pub fn hang(&mut self, push: &Push) {
        let aim = self.aim(push);
        let strike = &mut self.truth.strike;
        if let Some(bob) = push.bob
            && !strike.as_ref().is_some_and(|strike| strike.is_of(push))
        {
            *strike = Some(Strike::new(push, bob, &self.robot, &self.kinematics, aim));
        }
    }

    /// Moves the bob of a push through the next physics step, and returns its force on the robot (N).
    fn strike(&mut self, push: &Push, from_s: f64) -> Vector3<f64> {
        let truth = &mut self.truth;
        self.physics.read(&mut truth.posture, &mut truth.velocity);
        self.kinematics.update(&self.robot, &truth.posture);
        self.hang(push);
        let aim = self.aim(push);
        let Self {
            robot,
            clock,
            kinematics,
            truth,
            ..
        } = self;
        let Some(strike) = &mut truth.strike else {
            return Vector3::zeros();
        };
        let velocity = &truth.velocity;
        let struck =
            |link, point, normal| Struck::of(robot, kinematics, velocity, (link, point, normal));
        let step_s = [from_s, from_s + clock.physics_step_s];
        let Some(blow) = strike.advance(step_s, kinematics, aim, struck) else {
            return Vector3::zeros();
        };
        self.apply(blow.link, blow.force, blow.point);
        blow.force
    }

    /// Applies a force (N) to a link at a point in the world (m).
    fn apply(&mut self, link: usize, force: Vector3<f64>, point: Point3<f64>) {
        self.physics.add_force(link, force, point);
        self.truth.push_point = point;
    }

    /// Tilts the ground during the next physics step.
    fn tilt_ground(&mut self) {
        let at_s = |steps: u64| steps as f64 * self.clock.physics_step_s;
        if self.ground.is_level() || at_s(self.steps) > self.ground.tilting_s {
            return;
        }
        self.truth.ground = self.ground.at(at_s(self.steps + 1));
        self.physics.tilt(&self.truth.ground.slope);
    }

    /// Sets the servo of every joint for the next physics step.
    fn drive_joints(&mut self) {
        let Self {
            physics,
            robot,
            clock,
            acting,
            drives,
            owed,
            ..
        } = self;
        physics.set_drives(&mut |i, q, dq| {
            let mut servo = robot.servos[i];
            if let Some(gains) = &acting.gains {
                [servo.kp, servo.kd] = gains[i];
            }
            let target = Target {
                q_ref: acting.q_ref[i],
                dq_ref: acting.dq_ref[i],
                tau_ff: acting.tau_ff[i],
            };
            drives[i] = servo::drive(&servo, clock.physics_step_s, q, dq, target, owed[i]);
            // The damping of the joint is no torque of the motor, but the engines take both alike.
            servo::Drive {
                damping: drives[i].damping + servo.damping_n_m_s_rad,
                ..drives[i]
            }
        });
    }

    /// Adds the torques of the past physics step to the averages of the tick.
    fn add_torques(&mut self, share: f64) {
        let Self {
            physics,
            robot,
            truth,
            drives,
            owed,
            loads,
            ..
        } = self;
        physics.speeds(&mut |i, dq| {
            let tau = drives[i].constant - drives[i].damping * dq;
            owed[i] = servo::owed(&robot.servos[i], owed[i], tau);
            truth.tau[i] += share * tau;
            loads.turn(i, &robot.servos[i], tau, dq);
        });
    }

    /// Adds the ground's wrenches of the past physics step to the averages of the tick. Notes the largest loads, the link
    /// that touches the ground with other parts than a sole, and the links that touch each other.
    fn add_contacts(
        &mut self,
        share: f64,
        soles: &mut PerFoot<WorldWrench>,
        total: &mut WorldWrench,
    ) {
        let (slope, touching) = (self.truth.ground.slope, &mut self.truth.touching);
        let (normal, mut soles_n) = (slope * Vector3::z(), PerFoot::default());
        self.physics.touches(&slope, &mut |part, wrench| {
            if let ContactPart::Sole(foot) = part {
                soles_n[foot] += wrench.force.dot(&normal);
            }
            let wrench = wrench * share;
            *total += wrench;
            match part {
                ContactPart::Sole(foot) => soles[foot] += wrench,
                ContactPart::Link(link) if wrench.force.z > 0.0 && touching.is_none() => {
                    *touching = Some(link)
                }
                ContactPart::Link(_) => {}
            }
        });
        self.loads
            .bear(soles_n, &self.robot.servos, &mut self.truth.loads);
        let meeting = &mut self.truth.meeting;
        self.physics.meets(&mut |links, force_n| {
            let met = Meeting {
                links,
                of_legs: self.pairs.are_legs(links),
                force_n,
            };
            if meeting
                .is_none_or(|known| (met.of_legs, met.force_n) > (known.of_legs, known.force_n))
            {
                *meeting = Some(met);
            }
        });
    }

    /// Sets contact forces for the first reading, before any step: the weight is shared equally.
    fn pretend_contact(&mut self) {
        let truth = &mut self.truth;
        let half_weight = Vector3::new(0.0, 0.0, 0.5 * self.robot.weight_n());
        truth.contact_force = 2.0 * half_weight;
        truth.zmp = Some([truth.com.x, truth.com.y]);
        for foot in Foot::BOTH {
            let lever = Vector3::new(truth.com.x - truth.soles[foot].translation.x, 0.0, 0.0);
            truth.sole_wrenches[foot] = Wrench {
                force: half_weight,
                moment: lever.cross(&half_weight),
            };
        }
    }

    /// Reads posture and velocity from the engine. All other quantities are computed from these.
    fn read_state(&mut self) {
        let (robot, truth) = (&*self.robot, &mut self.truth);
        truth.time_s = self.steps as f64 * self.clock.physics_step_s;
        self.physics.read(&mut truth.posture, &mut truth.velocity);
        let kinematics = &mut self.kinematics;
        kinematics.update(robot, &truth.posture);
        truth.com = kinematics.com();
        kinematics.com_jacobian(robot, &mut self.com_jacobian);
        truth.com_vel = &self.com_jacobian * &truth.velocity;
        truth.trunk = *kinematics.link_pose(robot.trunk);
        let origin = Point3::from(truth.trunk.translation.vector);
        kinematics.point_jacobian(robot, robot.trunk, &origin, &mut self.trunk_jacobian);
        truth.trunk_velocity = &self.trunk_jacobian * &truth.velocity;
        truth.soles = kinematics.sole_poses(robot);
    }
}
