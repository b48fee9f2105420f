//! Estimates the state of the robot from encoders, IMU and sole wrenches: posture, COM, COM velocity, ZMP, contact.
//!
//! The trunk is followed by its IMU (`trunk.rs`), as is usual for legged robots (Bloesch et al. 2012, "State estimation
//! for legged robots"): the accelerometer measures pushes, contacts and flight alike. The feet on the ground correct
//! the trunk's position. The point of a sole under its centre of pressure is taken to rest on the ground where the foot
//! was put down, even while the foot rocks on an edge. In flight nothing corrects the position, and a foot that comes
//! down is taken to stand where it comes down. The orientation comes from the IMU. Encoders and gyro give the motion of
//! the COM relative to the trunk.
//!
//! The ground may slope, and the feet may stand at different heights. A foot that stands flat tells how its ground is
//! inclined, and two such feet tell which of them is higher. If the footholds were taken as level, the body would lean
//! against the slope with the whole stiffness of its joints.
//!
//! The paper estimates the COM with a Kalman filter on the pendulum (Sect. VI.A), which models neither pushes nor
//! flight.

mod trunk;

use crate::lipm::pendulum::State;
pub use crate::robot::kinematics::{heading, on_ground};
use crate::robot::{Foot, GRAVITY, Kinematics, PerFoot, Pose, Posture, Robot, Sole, Units};
use crate::socket::{Imu, Sensed};
use nalgebra::{Isometry2, Isometry3, Point2, Point3, UnitQuaternion, Vector2, Vector3};
use trunk::TrunkFilter;

/// Load from which a sole comes into contact, and load below which it loses contact: a share of the weight plus a
/// number of standard deviations of the force sensor.
const CONTACT_LOAD: [(f64, f64); 2] = [(0.03, 5.0), (0.02, 3.0)];
/// Height of a sole's lowest corner above the ground below which the sole comes into contact, since it can carry load
/// at once; and the same height for a sole that is already in contact. Both are in COM heights.
const CONTACT_HEIGHT: [f64; 2] = [0.013, 0.0225];
/// Time constant with which the velocity of the COM follows its measurement, in 1/omega. The measurement, from the
/// encoders, is noisy. Within the time constant the velocity follows the forces under the soles, which do not include
/// pushes.
const VELOCITY_LAG: f64 = 0.0125;
/// Rate at which footholds follow the inclination and the difference in height of soles that stand flat, in omega.
const GROUND_RATE: f64 = 1.8;
/// Rate at which the mean height of the footholds is drawn to zero, from which the home height of the COM is measured;
/// in omega.
const LEVEL_RATE: f64 = 0.18;
/// Share of a sole within which the centre of pressure of a flat foot lies. On an edge the foot may rock.
const FLAT_SHARE: f64 = 0.8;

/// The state as the controller estimates it, world frame.
#[derive(Debug, Clone)]
pub struct Estimate {
    pub posture: Posture,
    kinematics: Kinematics,
    pub com: Point3<f64>,
    pub com_vel: Vector3<f64>,
    /// ZMP from the sole wrenches (m); it keeps its last value while no foot is loaded.
    pub zmp: Point2<f64>,
    /// Pose of each sole, at the centre of its contact face.
    pub soles: PerFoot<Pose>,
    /// Velocity of each sole's centre (m/s).
    pub sole_vel: PerFoot<Vector3<f64>>,
    /// Pose of each foot where it stands, with the ground's inclination. For a foot in the air, it is where the foot
    /// stood last.
    pub footholds: PerFoot<Pose>,
    pub in_contact: PerFoot<bool>,
    /// Vertical force on each sole (N).
    pub load_n: PerFoot<f64>,
    /// Load from which a sole comes into contact, and load below which it loses contact (N).
    pub contact_load_n: [f64; 2],
}

impl Estimate {
    /// At home and at rest, with the weight shared equally by both feet.
    pub fn at_home(robot: &Robot) -> Self {
        let posture = robot.home_posture();
        let kinematics = Kinematics::at(robot, &posture);
        let (com, soles) = (kinematics.com(), kinematics.sole_poses(robot));
        Self {
            posture,
            kinematics,
            com,
            com_vel: Vector3::zeros(),
            zmp: com.xy(),
            soles,
            sole_vel: PerFoot::default(),
            footholds: soles,
            in_contact: PerFoot {
                left: true,
                right: true,
            },
            load_n: PerFoot::from_fn(|_| 0.5 * robot.weight_n()),
            contact_load_n: CONTACT_LOAD.map(|(share, deviations)| {
                share * robot.mass() * GRAVITY + deviations * robot.noise.sole_force_n
            }),
        }
    }

    /// Kinematics of the estimated posture.
    pub fn kinematics(&self) -> &Kinematics {
        &self.kinematics
    }

    /// Sets the joint angles to the encoder readings, with the base at the origin. Returns its orientation by the IMU.
    fn read_posture(&mut self, robot: &Robot, sensed: &Sensed) -> UnitQuaternion<f64> {
        self.posture.q.copy_from_slice(&sensed.q);
        self.posture.base = Isometry3::identity();
        self.kinematics.update(robot, &self.posture);
        let trunk_in_base = self.kinematics.link_pose(robot.trunk).rotation;
        sensed.imu.orientation * trunk_in_base.inverse()
    }

    fn place_base(
        &mut self,
        robot: &Robot,
        translation: Vector3<f64>,
        rotation: UnitQuaternion<f64>,
    ) {
        self.posture.base = Isometry3::from_parts(translation.into(), rotation);
        self.kinematics.update(robot, &self.posture);
        self.soles = self.kinematics.sole_poses(robot);
    }

    /// Pose of a foothold (world frame). If the foot is not in contact, the centre is where the sole is now.
    pub fn place(&self, foot: Foot) -> Pose {
        let mut pose = self.footholds[foot];
        if !self.in_contact[foot] {
            pose.translation = self.soles[foot].translation;
        }
        pose
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

/// The only writer of an [`Estimate`].
#[derive(Debug, Clone)]
pub struct Estimator {
    units: Units,
    dt: f64,
    /// Control period in 1/omega.
    phase: f64,
    trunk: TrunkFilter,
    /// The COM in the trunk's frame (m).
    lever: Vector3<f64>,
    /// Whether each foot carries load, so that its foothold tells where the robot is.
    stands: PerFoot<bool>,
    now: Estimate,
}

impl Estimator {
    /// An estimator for a robot at home and at rest, with a control period `dt` (s).
    pub fn new(robot: &Robot, dt: f64) -> Self {
        let units = Units::of(robot);
        let trunk = TrunkFilter::new(&robot.noise, units.length_m, dt, Vector3::zeros());
        let phase = dt * units.omega();
        let mut estimator = Self {
            units,
            dt,
            phase,
            trunk,
            lever: Vector3::zeros(),
            stands: PerFoot::from_fn(|_| true),
            now: Estimate::at_home(robot),
        };
        estimator.rest(robot);
        estimator
    }

    pub fn now(&self) -> &Estimate {
        &self.now
    }

    /// Notes that a foot is lifted. It counts as no contact until it lands.
    pub fn lift(&mut self, foot: Foot) {
        self.now.in_contact[foot] = false;
    }

    /// Ends the flight of a foot: its foothold is where the foot is now. If it is not `on_ground`, the foot waits for
    /// its contact to be detected.
    pub fn land(&mut self, foot: Foot, on_ground: bool) {
        self.put_down(foot);
        self.now.in_contact[foot] = on_ground;
    }

    /// Sets a known posture. COM and COM velocity stay as they are.
    pub fn place(&mut self, robot: &Robot, Posture { base, q }: &Posture) {
        self.now.posture.q.copy_from_slice(q);
        self.now
            .place_base(robot, base.translation.vector, base.rotation);
    }

    /// Sets a known horizontal motion of the COM, ZMP and loads (N).
    pub fn set_motion(&mut self, state: &State, load_n: PerFoot<f64>) {
        let now = &mut self.now;
        (now.com.x, now.com.y) = (state.com().x, state.com().y);
        now.com_vel = state.com_vel().push(0.0);
        (now.zmp, now.load_n) = (state.zmp(), load_n);
    }

    /// Sets the foothold of a foot that comes down, on the plane of the other foothold: the foot itself may have come
    /// down on an edge.
    fn put_down(&mut self, foot: Foot) {
        let Estimate {
            soles, footholds, ..
        } = &mut self.now;
        let (sole, other) = (&soles[foot], footholds[foot.other()]);
        let place = along(&other, sole.translation.vector.xy().into());
        footholds[foot] = Pose::from_parts(place.translation, inclined(sole, &other));
    }

    /// Sets COM and trunk to rest at the places that follow from the posture, with the ZMP below the COM.
    fn rest(&mut self, robot: &Robot) {
        let now = &mut self.now;
        now.com = now.kinematics.com();
        (now.com_vel, now.zmp) = (Vector3::zeros(), now.com.xy());
        let trunk = now.kinematics.link_pose(robot.trunk);
        self.lever = trunk.inverse_transform_point(&now.com).coords;
        (self.trunk.position, self.trunk.velocity) = (trunk.translation.vector, Vector3::zeros());
    }

    /// Starts anew, at rest in the sensed posture. The lowest corner of a sole is then on the ground, and the world's
    /// origin is midway between the feet.
    pub fn restart(&mut self, robot: &Robot, sensed: &Sensed) {
        let now = &mut self.now;
        let rotation = now.read_posture(robot, sensed);
        now.place_base(robot, Vector3::zeros(), rotation);
        let [left, right] =
            Foot::BOTH.map(|foot| lowest_corner(&robot.soles[foot], &now.soles[foot]));
        let middle = 0.5 * (now.soles.left.translation.vector + now.soles.right.translation.vector);
        now.place_base(
            robot,
            Vector3::new(-middle.x, -middle.y, -left.min(right)),
            rotation,
        );
        now.footholds = PerFoot::from_fn(|foot| flat(&now.soles[foot]));
        now.in_contact = PerFoot::default();
        self.stands = now.in_contact;
        self.rest(robot);
        self.measure_zmp(sensed);
        self.find_contact(robot, None);
    }

    /// Runs one tick. `in_air` is the foot that the controller is moving; the base is found without it.
    pub fn update(&mut self, robot: &Robot, sensed: &Sensed, in_air: Option<Foot>) {
        let gravity = Vector3::new(0.0, 0.0, GRAVITY);
        let rotation = self.now.read_posture(robot, sensed);
        let Imu {
            orientation,
            gyro,
            accelerometer,
        } = sensed.imu;
        let trunk = *self.now.kinematics.link_pose(robot.trunk);
        let lever = trunk
            .inverse_transform_point(&self.now.kinematics.com())
            .coords;
        let turning = gyro.cross(&lever) + (lever - self.lever) / self.dt;
        self.lever = lever;
        self.trunk.predict(orientation * accelerometer - gravity);
        if let Some(base) = self.base_on_feet(robot, sensed, rotation) {
            self.trunk
                .correct(base + rotation * trunk.translation.vector);
        }
        self.now.place_base(
            robot,
            self.trunk.position - rotation * trunk.translation.vector,
            rotation,
        );
        self.measure_soles(robot, &sensed.dq, orientation * gyro);
        let force = self.measure_zmp(sensed);
        self.now.com = self.now.kinematics.com();
        let com_vel = &mut self.now.com_vel;
        *com_vel += (force / self.units.mass_kg - gravity) * self.dt;
        let measured = self.trunk.velocity + orientation * turning;
        *com_vel += (measured - *com_vel) * -(-self.phase / VELOCITY_LAG).exp_m1();
        self.find_contact(robot, in_air);
        self.feel_ground(robot, sensed);
    }

    /// Sets the velocities of the soles, by the velocity of the trunk, its angular velocity `turning` (rad/s, world axes)
    /// and the speeds `dq` of the joints between trunk and soles.
    fn measure_soles(&mut self, robot: &Robot, dq: &[f64], turning: Vector3<f64>) {
        let Estimate {
            kinematics, soles, ..
        } = &self.now;
        let trunk = kinematics.link_pose(robot.trunk).translation.vector;
        self.now.sole_vel = PerFoot::from_fn(|foot| {
            let sole = Point3::from(soles[foot].translation.vector);
            let by_joints = |link| kinematics.velocity_by_joints(robot, link, &sole, dq);
            self.trunk.velocity + turning.cross(&(sole.coords - trunk)) - by_joints(robot.trunk)
                + by_joints(robot.soles[foot].link)
        });
    }

    /// Position of the base (m) by the feet that stand, averaged with their loads as weights. It is None if no foot
    /// stands.
    fn base_on_feet(
        &self,
        robot: &Robot,
        sensed: &Sensed,
        rotation: UnitQuaternion<f64>,
    ) -> Option<Vector3<f64>> {
        let (mut sum, mut carried) = (Vector3::zeros(), 0.0);
        for foot in Foot::BOTH.into_iter().filter(|&foot| self.stands[foot]) {
            let load = sensed.soles[foot].force.z;
            // A smaller load is mostly noise.
            if load < self.now.contact_load_n[0] {
                continue;
            }
            let pressed = pressure_point(&robot.soles[foot], sensed, foot);
            let in_base = self.now.kinematics.sole_pose(robot, foot) * pressed;
            let in_world = self.now.footholds[foot] * pressed;
            sum += (in_world.coords - rotation * in_base.coords) * load;
            carried += load;
        }
        (carried > 0.0).then(|| sum / carried)
    }

    /// Updates the footholds of the feet that stand flat.
    fn feel_ground(&mut self, robot: &Robot, sensed: &Sensed) {
        let Estimate {
            footholds, soles, ..
        } = &mut self.now;
        let flat = PerFoot::from_fn(|foot| {
            let [x, y] = robot.soles[foot].half_m;
            let pressed = pressure_point(&robot.soles[foot], sensed, foot);
            self.stands[foot]
                && pressed.x.abs() < FLAT_SHARE * x
                && pressed.y.abs() < FLAT_SHARE * y
        });
        for foot in Foot::BOTH.into_iter().filter(|&foot| flat[foot]) {
            let felt = inclined(&footholds[foot], &soles[foot]);
            footholds[foot].rotation = footholds[foot]
                .rotation
                .slerp(&felt, GROUND_RATE * self.phase);
        }
        let higher = |poses: &PerFoot<Pose>| poses.left.translation.z - poses.right.translation.z;
        let apart = if flat.left && flat.right {
            higher(soles) - higher(footholds)
        } else {
            0.0
        };
        let mean = 0.5 * (footholds.left.translation.z + footholds.right.translation.z);
        for foot in Foot::BOTH {
            let rate = 0.5 * foot.side() * apart * GROUND_RATE - mean * LEVEL_RATE;
            footholds[foot].translation.z += rate * self.phase;
        }
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
        if force.z > self.now.contact_load_n[0] {
            self.now.zmp = Point2::new(-moment.y / force.z, moment.x / force.z);
        }
        force
    }

    /// Notes which feet stand, and which are in contact. A sole that is about to touch the ground is in contact, since
    /// it can carry load at once. A foot that comes down stands where it is now.
    fn find_contact(&mut self, robot: &Robot, in_air: Option<Foot>) {
        for foot in Foot::BOTH {
            let now = &self.now;
            let carries =
                |already: bool| now.load_n[foot] > now.contact_load_n[usize::from(already)];
            let (stood, touched) = (self.stands[foot], now.in_contact[foot]);
            let ground = now.footholds[foot.other()].translation.z;
            let low = lowest_corner(&robot.soles[foot], &now.soles[foot]) - ground;
            let touches = carries(touched)
                || low < CONTACT_HEIGHT[usize::from(touched)] * self.units.length_m;
            let [stands, touches] = [carries(stood), touches].map(|is| is && in_air != Some(foot));
            if (stands && !stood) || (touches && !touched) {
                self.put_down(foot);
            }
            (self.stands[foot], self.now.in_contact[foot]) = (stands, touches);
        }
    }
}

/// Height of the lowest corner of a sole (m).
fn lowest_corner(sole: &Sole, pose: &Pose) -> f64 {
    sole.corners()
        .into_iter()
        .map(|corner| (pose * corner).z)
        .fold(f64::INFINITY, f64::min)
}

/// Centre of pressure of a foot, in the frame of its sole.
fn pressure_point(sole: &Sole, sensed: &Sensed, foot: Foot) -> Point3<f64> {
    let wrench = &sensed.soles[foot];
    if wrench.force.z <= 0.0 {
        return Point3::origin();
    }
    let [x, y] = [
        -wrench.moment.y / wrench.force.z,
        wrench.moment.x / wrench.force.z,
    ];
    Point3::new(
        x.clamp(-sole.half_m[0], sole.half_m[0]),
        y.clamp(-sole.half_m[1], sole.half_m[1]),
        0.0,
    )
}

/// The pose of a sole flat on the ground below `pose`, with its heading.
fn flat(pose: &Pose) -> Pose {
    let yaw = heading(pose);
    let p = pose.translation.vector;
    Isometry3::from_parts(
        Vector3::new(p.x, p.y, 0.0).into(),
        UnitQuaternion::from_axis_angle(&Vector3::z_axis(), yaw),
    )
}

/// The orientation with the heading of one pose and the inclination of another one.
fn inclined(headed: &Pose, on: &Pose) -> UnitQuaternion<f64> {
    let yaw = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading(headed));
    let normal = on.rotation * Vector3::z();
    UnitQuaternion::rotation_between(&Vector3::z(), &normal).map_or(yaw, |tilt| tilt * yaw)
}

/// A sole that is moved along its own plane to `place` (m).
pub fn along(sole: &Pose, place: Point2<f64>) -> Pose {
    let (at, normal) = (sole.translation.vector, sole.rotation * Vector3::z());
    let rise = -normal.xy().dot(&(place.coords - at.xy())) / normal.z;
    Pose::from_parts(
        Vector3::new(place.x, place.y, at.z + rise).into(),
        sole.rotation,
    )
}

/// Pose of the control frame in the world (paper, Sect. III.A): its origin is midway between the soles' centres, and
/// its x axis points along the mean heading of the feet.
pub fn control_frame(footholds: &PerFoot<Pose>) -> Isometry2<f64> {
    let middle =
        (footholds.left.translation.vector.xy() + footholds.right.translation.vector.xy()) / 2.0;
    let [left, right] = [heading(&footholds.left), heading(&footholds.right)];
    // The mean of two directions, also across the jump of the angle from pi to -pi.
    let sum = Vector2::new(left.cos() + right.cos(), left.sin() + right.sin());
    Isometry2::new(middle, sum.y.atan2(sum.x))
}
