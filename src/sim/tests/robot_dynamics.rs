//! The equations of motion of UT-mu2 are compared with sums over its links, with rates of change along a motion, with
//! the laws of Newton, Euler and Lagrange, and with the simulation.

use crate::common::{config, push};
use nalgebra::{
    DVector, Isometry3, Matrix6xX, Point3, UnitQuaternion, UnitVector3, Vector3, point, vector,
};
use standfast_core::robot::dynamics::{Dynamics, load_torques};
use standfast_core::robot::{Foot, GRAVITY, Kinematics, PerFoot, Posture, Robot};
use standfast_sim::episode::{self, Disturbance, EpisodeConfig, Until};
use std::sync::LazyLock;

static ROBOT: LazyLock<Robot> = LazyLock::new(|| standfast_robots::load("ut-mu2").unwrap());

/// The quantities at one time of a motion in which every coordinate moves: `x = amplitude sin(rate t + phase)` for each
/// joint and for the base's position, and two such rotations of the base, one about an axis that the other one turns.
struct At {
    posture: Posture,
    velocity: DVector<f64>,
    acceleration: DVector<f64>,
    kinematics: Kinematics,
    dynamics: Dynamics,
}

fn at(time: f64) -> At {
    let n = ROBOT.joints.len();
    // Value, first and second derivative.
    let wave = |k: usize| {
        let (amplitude, rate) = (0.3 + 0.05 * (k % 7) as f64, 2.0 + 0.37 * (k % 11) as f64);
        let phase = rate * time + 0.7 * k as f64;
        [
            amplitude * phase.sin(),
            amplitude * rate * phase.cos(),
            -amplitude * rate * rate * phase.sin(),
        ]
    };
    let (first, second) = (
        UnitVector3::new_normalize(vector![0.3, -0.5, 0.8]),
        UnitVector3::new_normalize(vector![-0.7, 0.2, 0.4]),
    );
    let ([a, da, dda], [b, db, ddb]) = (wave(3), wave(4));
    let outer = UnitQuaternion::from_axis_angle(&first, a);
    let carried = outer * second.into_inner();
    let rotation = outer * UnitQuaternion::from_axis_angle(&second, b);
    let angular = first.into_inner() * da + carried * db;
    let angular_acc =
        first.into_inner() * dda + carried * ddb + (first.into_inner() * da).cross(&(carried * db));
    let place = Vector3::from_fn(|k, _| wave(k)[0]);
    let (mut velocity, mut acceleration) = (DVector::zeros(6 + n), DVector::zeros(6 + n));
    for k in 0..3 {
        (velocity[k], acceleration[k]) = (wave(k)[1], wave(k)[2]);
        (velocity[3 + k], acceleration[3 + k]) = (angular[k], angular_acc[k]);
    }
    for j in 0..n {
        (velocity[6 + j], acceleration[6 + j]) = (wave(5 + j)[1], wave(5 + j)[2]);
    }
    let q = (0..n).map(|j| wave(5 + j)[0]).collect();
    let posture = Posture {
        base: Isometry3::from_parts(place.into(), rotation),
        q,
    };
    let (kinematics, dynamics) = of(&posture, &velocity);
    At {
        posture,
        velocity,
        acceleration,
        kinematics,
        dynamics,
    }
}

impl At {
    /// Linear momentum (N s), and angular momentum about the COM (N m s), by the rows of the mass matrix.
    fn momentum(&self) -> [Vector3<f64>; 2] {
        let row = |i: usize| self.dynamics.mass_matrix().column(i).dot(&self.velocity);
        let (linear, about_base) = (
            Vector3::from_fn(|i, _| row(i)),
            Vector3::from_fn(|i, _| row(3 + i)),
        );
        let lever = self.kinematics.com().coords - self.posture.base.translation.vector;
        [linear, about_base - lever.cross(&linear)]
    }
}

fn of(posture: &Posture, velocity: &DVector<f64>) -> (Kinematics, Dynamics) {
    let kinematics = Kinematics::at(&ROBOT, posture);
    let mut dynamics = Dynamics::new(&ROBOT);
    dynamics.update(&ROBOT, &kinematics, velocity);
    (kinematics, dynamics)
}

/// Velocity of a point of a link, and angular velocity of the link.
fn point_velocity(at: &At, link: usize, point: &Point3<f64>) -> [Vector3<f64>; 2] {
    let mut jacobian = Matrix6xX::zeros(at.velocity.len());
    at.kinematics
        .point_jacobian(&ROBOT, link, point, &mut jacobian);
    let velocity = jacobian * &at.velocity;
    [
        velocity.fixed_rows::<3>(0).into(),
        velocity.fixed_rows::<3>(3).into(),
    ]
}

fn kinetic_energy(at: &At) -> f64 {
    0.5 * at.velocity.dot(&(at.dynamics.mass_matrix() * &at.velocity))
}

fn potential_energy(at: &At) -> f64 {
    ROBOT.weight_n() * at.kinematics.com().z
}

/// Central difference along the motion.
fn rate<const N: usize>(time: f64, value: impl Fn(&At) -> [f64; N]) -> [f64; N] {
    const STEP: f64 = 1e-5;
    let (after, before) = (value(&at(time + STEP)), value(&at(time - STEP)));
    std::array::from_fn(|i| (after[i] - before[i]) / (2.0 * STEP))
}

const TIMES: [f64; 4] = [0.0, 0.4, 1.3, 2.9];

/// The rotors are no links, and have their own kinetic energy.
#[test]
fn the_mass_matrix_gives_the_kinetic_energy_of_the_links() {
    for time in TIMES {
        let at = at(time);
        let mut sum = 0.0;
        for (i, link) in ROBOT.links.iter().enumerate() {
            let [linear, angular] = point_velocity(&at, i, &at.kinematics.link_com(i));
            let spin = at.kinematics.link_pose(i).rotation.inverse() * angular;
            sum += 0.5
                * (link.mass_kg * linear.norm_squared() + spin.dot(&(link.inertia_kg_m2 * spin)));
        }
        for (j, servo) in ROBOT.servos.iter().enumerate() {
            sum += 0.5 * servo.rotor_inertia_kg_m2 * at.velocity[6 + j].powi(2);
        }
        assert!(
            (kinetic_energy(&at) - sum).abs() < 1e-12 * sum,
            "{time} s: {} {sum}",
            kinetic_energy(&at)
        );
    }
}

#[test]
fn the_mass_matrix_is_symmetric_positive_definite_and_begins_with_the_mass() {
    for time in TIMES {
        let at = at(time);
        let matrix = at.dynamics.mass_matrix();
        assert!((matrix - matrix.transpose()).amax() < 1e-15);
        let mass = ROBOT.mass();
        assert!(
            (matrix.fixed_view::<3, 3>(0, 0) - nalgebra::Matrix3::identity() * mass).amax() < 1e-14
        );
        assert!(matrix.clone().cholesky().is_some(), "{time} s");
        // The first rows belong to the momentum along each axis, m times the COM Jacobian.
        let mut jacobian = nalgebra::Matrix3xX::zeros(at.velocity.len());
        at.kinematics.com_jacobian(&ROBOT, &mut jacobian);
        assert!((matrix.rows(0, 3) - jacobian * mass).amax() < 1e-13);
    }
}

#[test]
fn at_rest_the_bias_is_the_load_of_gravity() {
    for time in TIMES {
        let At {
            posture, velocity, ..
        } = at(time);
        let (kinematics, dynamics) = of(&posture, &(velocity * 0.0));
        let mut tau = vec![0.0; ROBOT.joints.len()];
        let gravity = vector![0.0, 0.0, -GRAVITY];
        let [force, moment] =
            load_torques(&kinematics, &ROBOT, gravity, &PerFoot::default(), &mut tau);
        let bias = dynamics.bias();
        assert!((bias.fixed_rows::<3>(0) + force).norm() < 1e-12);
        assert!((bias.fixed_rows::<3>(3) + moment).norm() < 1e-12);
        for (j, tau) in tau.iter().enumerate() {
            assert!(
                (bias[6 + j] - tau).abs() < 1e-12,
                "{}: {} {tau}",
                ROBOT.joints[j].name,
                bias[6 + j]
            );
        }
        assert!(dynamics.com_bias_acc().norm() < 1e-12);
    }
}

/// Newton and Euler: force and moment on the base equal the rates of change of the momenta, less gravity.
#[test]
fn momentum_changes_by_the_wrench_on_the_base() {
    let momentum = |at: &At| {
        let [p, l] = at.momentum();
        [p.x, p.y, p.z, l.x, l.y, l.z]
    };
    for time in TIMES {
        let now = at(time);
        let wanted = rate(time, momentum);
        let wrench = now.dynamics.mass_matrix() * &now.acceleration + now.dynamics.bias();
        let force: Vector3<f64> = wrench.fixed_rows::<3>(0).into();
        let about_base: Vector3<f64> = wrench.fixed_rows::<3>(3).into();
        let lever = now.kinematics.com().coords - now.posture.base.translation.vector;
        let (change, moment) = (
            force - Vector3::z() * ROBOT.weight_n(),
            about_base - lever.cross(&force),
        );
        for k in 0..3 {
            assert!(
                (change[k] - wanted[k]).abs() < 1e-5,
                "{time} s, linear {k}: {} {}",
                change[k],
                wanted[k]
            );
            assert!(
                (moment[k] - wanted[3 + k]).abs() < 1e-5,
                "{time} s, angular {k}: {} {}",
                moment[k],
                wanted[3 + k]
            );
        }
        // The angular momentum equals the angular momentum of the links.
        let mut sum = Vector3::zeros();
        for (i, link) in ROBOT.links.iter().enumerate() {
            let com = now.kinematics.link_com(i);
            let [linear, angular] = point_velocity(&now, i, &com);
            let turn = now.kinematics.link_pose(i).rotation;
            sum += (com - now.kinematics.com()).cross(&(linear * link.mass_kg));
            sum += turn * (link.inertia_kg_m2 * (turn.inverse() * angular));
        }
        let [_, angular] = now.momentum();
        assert!((angular - sum).norm() < 1e-12, "{time} s: {angular} {sum}");
    }
}

/// Lagrange: `d/dt (dT/d dq) - d(T - V)/dq` for every joint.
#[test]
fn joint_torques_obey_lagrange() {
    for time in TIMES {
        let now = at(time);
        let torque = now.dynamics.mass_matrix() * &now.acceleration + now.dynamics.bias();
        for (j, joint) in ROBOT.joints.iter().enumerate() {
            let [momentum_rate] = rate(time, |at| {
                [at.dynamics.mass_matrix().column(6 + j).dot(&at.velocity)]
            });
            let lagrangian = |amount: f64| {
                let mut posture = now.posture.clone();
                posture.q[j] += amount;
                let (kinematics, dynamics) = of(&posture, &now.velocity);
                let (velocity, acceleration) = (now.velocity.clone(), now.acceleration.clone());
                let moved = At {
                    posture,
                    velocity,
                    acceleration,
                    kinematics,
                    dynamics,
                };
                kinetic_energy(&moved) - potential_energy(&moved)
            };
            let wanted = momentum_rate - (lagrangian(1e-5) - lagrangian(-1e-5)) / 2e-5;
            assert!(
                (torque[6 + j] - wanted).abs() < 1e-5,
                "{time} s, {}: {} {wanted}",
                joint.name,
                torque[6 + j]
            );
        }
    }
}

#[test]
fn power_is_what_the_energy_changes_by() {
    for time in TIMES {
        let now = at(time);
        let force = now.dynamics.mass_matrix() * &now.acceleration + now.dynamics.bias();
        let [wanted] = rate(time, |at| [kinetic_energy(at) + potential_energy(at)]);
        assert!(
            (force.dot(&now.velocity) - wanted).abs() < 1e-5 * wanted.abs().max(1.0),
            "{time} s"
        );
    }
}

#[test]
fn bias_accelerations_are_what_the_jacobians_leave_over() {
    let local = point![0.03, -0.02, 0.05];
    for time in TIMES {
        let now = at(time);
        for link in 0..ROBOT.links.len() {
            let place = |at: &At| at.kinematics.link_pose(link) * local;
            let wanted = rate(time, |at| {
                let [linear, angular] = point_velocity(at, link, &place(at));
                [
                    linear.x, linear.y, linear.z, angular.x, angular.y, angular.z,
                ]
            });
            let mut jacobian = Matrix6xX::zeros(now.velocity.len());
            now.kinematics
                .point_jacobian(&ROBOT, link, &place(&now), &mut jacobian);
            let by_joints = jacobian * &now.acceleration;
            let [linear, angular] =
                now.dynamics
                    .point_bias_acc(&now.kinematics, link, &place(&now));
            for k in 0..3 {
                assert!(
                    (by_joints[k] + linear[k] - wanted[k]).abs() < 1e-6,
                    "{time} s, link {link}"
                );
                assert!(
                    (by_joints[3 + k] + angular[k] - wanted[3 + k]).abs() < 1e-6,
                    "{time} s, link {link}"
                );
            }
        }
        let mut jacobian = nalgebra::Matrix3xX::zeros(now.velocity.len());
        now.kinematics.com_jacobian(&ROBOT, &mut jacobian);
        let [x, y, z] = rate(time, |at| {
            let [p, _] = at.momentum();
            (p / ROBOT.mass()).into()
        });
        let com_acc = jacobian * &now.acceleration + now.dynamics.com_bias_acc();
        assert!((com_acc - vector![x, y, z]).norm() < 1e-6, "{time} s");
    }
}

/// What the equations of motion leave over at each tick of an episode in which `robot` is pushed, with the accelerations,
/// torques and sole forces from the engine: generalised forces (N, N m), with the velocity at the end of the tick.
fn left_over(
    robot: &Robot,
    step_s: f64,
    horizon_s: f64,
    mut see: impl FnMut(&DVector<f64>, &DVector<f64>),
) {
    let hold = standfast_controllers::load("hold").unwrap();
    let config = EpisodeConfig {
        physics_step_s: step_s,
        control_period_s: step_s,
        ..config(horizon_s)
    };
    let factory = hold.prepare(robot, step_s).unwrap();
    let mut before: Option<(Posture, DVector<f64>)> = None;
    let disturbance = Disturbance {
        pushes: vec![push(3.5, 0.0)],
        sensor_errors: None,
        ..Disturbance::default()
    };
    episode::run(
        robot,
        &factory,
        &config,
        disturbance,
        Until::Horizon,
        &mut |tick| {
            let truth = tick.truth;
            // The push acts on the trunk beside its origin, so the comparison waits until the push is over.
            if let Some((posture, velocity)) = &before
                && truth.push_force == Vector3::zeros()
                && truth.time_s > 0.5
            {
                let acceleration = (&truth.velocity - velocity) / step_s;
                let (kinematics, dynamics) = of(posture, velocity);
                let mut left_over = dynamics.mass_matrix() * acceleration + dynamics.bias();
                for foot in Foot::BOTH {
                    let link = ROBOT.soles[foot].link;
                    let sole = kinematics.sole_pose(&ROBOT, foot).translation.vector.into();
                    let mut jacobian = Matrix6xX::zeros(velocity.len());
                    kinematics.point_jacobian(&ROBOT, link, &sole, &mut jacobian);
                    let wrench = truth.sole_wrenches[foot];
                    left_over -= jacobian.rows(0, 3).transpose() * wrench.force;
                    left_over -= jacobian.rows(3, 3).transpose() * wrench.moment;
                }
                for (j, tau) in truth.tau.iter().enumerate() {
                    left_over[6 + j] -= tau;
                }
                see(&left_over, &truth.velocity);
            }
            before = Some((truth.posture.clone(), truth.velocity.clone()));
        },
    )
    .unwrap();
}

/// A pushed robot in the simulation moves according to these equations. The residual is within the error of Rapier's
/// integrator, which decreases with its step.
#[test]
fn the_simulation_obeys_them() {
    let [coarse, fine] = [0.001, 0.00025].map(|step_s| {
        let (mut sums, mut count) = ([0.0_f64; 2], 0.0);
        left_over(&ROBOT, step_s, 0.95, |force, _| {
            sums[0] += force.rows(0, 3).norm();
            sums[1] += force.rows(3, force.len() - 3).norm();
            count += 1.0;
        });
        sums.map(|sum| sum / count)
    });
    println!("mean left over (N, N m): {coarse:?} at 1 ms, {fine:?} at 0.25 ms");
    assert!(fine[0] < 0.01 && fine[1] < 0.003, "{fine:?}");
    // MuJoCo's forces have no residual, with any step.
    let nothing: f64 = 1e-9;
    assert!(
        fine[0] < nothing.max(0.5 * coarse[0]) && fine[1] < 0.5 * coarse[1],
        "{coarse:?} {fine:?}"
    );
}

/// What friction and damping take in every joint of a pushed robot is what Coulomb's law and the law of damping say: in
/// motion as much as they do, and at rest no more.
#[test]
fn joints_lose_what_the_laws_say() {
    for [friction, damping] in [[0.0, 0.5], [0.05, 0.0], [0.1, 0.5]] {
        let mut robot = ROBOT.clone();
        for servo in &mut robot.servos {
            servo.friction_n_m = friction * servo.torque_n_m;
            servo.damping_n_m_s_rad = damping * servo.torque_n_m / servo.no_torque_speed_rad_s;
        }
        let (mut worst, mut fast): (f64, usize) = (0.0, 0);
        left_over(&robot, 0.001, 1.2, |force, velocity| {
            for (j, servo) in robot.servos.iter().enumerate() {
                let (lost, speed) = (-force[6 + j], velocity[6 + j]);
                let law = servo.lost_torque(speed);
                let error = if speed.abs() > 0.05 {
                    fast += 1;
                    (lost - law).abs()
                } else {
                    lost.abs() - law.abs()
                };
                worst = worst.max(error / servo.torque_n_m);
            }
        });
        println!("{friction}, {damping}: {worst:.5} of the torque limit, {fast} in motion");
        assert!(worst < 0.0005 && fast > 100, "{worst} {fast}");
    }
}
