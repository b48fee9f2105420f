//! Dry friction and viscous damping in the joints obey Coulomb's law and the law of damping, and take nothing from the
//! motors.

use crate::common::engine;
use standfast_core::robot::dynamics::Dynamics;
use standfast_core::robot::{Kinematics, Robot};
use standfast_sim::{Ground, Plant, plant::Clock};
use std::sync::LazyLock;

/// A joint that bends an elbow.
static ELBOW: LazyLock<usize> = LazyLock::new(|| {
    let robot = standfast_robots::load("ut-mu2").unwrap();
    let name = "left_elbow_flexion";
    robot
        .joints
        .iter()
        .position(|joint| joint.name == name)
        .unwrap()
});

/// UT-mu2 without delay, with friction (N m) and damping (N m s/rad) in one elbow.
fn robot(friction_n_m: f64, damping_n_m_s_rad: f64) -> Robot {
    let mut robot = standfast_robots::load("ut-mu2").unwrap();
    robot.delay_s = 0.0;
    robot.servos[*ELBOW].friction_n_m = friction_n_m;
    robot.servos[*ELBOW].damping_n_m_s_rad = damping_n_m_s_rad;
    robot
}

/// What is seen of the elbow after a step.
struct Seen {
    /// Angle (rad) and speed (rad/s).
    angle: f64,
    speed: f64,
    /// Torque of the motor beyond what carries the forearm (N m).
    added: f64,
    /// Inertia about its axis (kg m^2).
    inertia: f64,
}

/// The elbow after each step (s), from home on. Its motor carries the forearm, and adds a torque (N m) that is a function of
/// time (s); the other servos hold home.
fn course(robot: &Robot, step_s: f64, duration_s: f64, torque: impl Fn(f64) -> f64) -> Vec<Seen> {
    let clock = Clock {
        engine: engine(),
        physics_step_s: step_s,
        control_period_s: step_s,
    };
    let home = robot.home_command();
    let mut plant = Plant::on(Ground::default(), robot.clone(), clock, None, home.clone());
    let mut dynamics = Dynamics::new(robot);
    let mut course = Vec::new();
    for tick in 0..(duration_s / step_s).round() as usize {
        let truth = plant.truth();
        let kinematics = Kinematics::at(robot, &truth.posture);
        dynamics.update(robot, &kinematics, &truth.velocity);
        let mut command = home.clone();
        let mut gains: Vec<[f64; 2]> = robot.servos.iter().map(|s| [s.kp, s.kd]).collect();
        gains[*ELBOW] = [0.0; 2];
        command.gains = Some(gains);
        let carries = dynamics.bias()[6 + *ELBOW];
        command.tau_ff[*ELBOW] = carries + torque(tick as f64 * step_s);
        plant.advance(command, &[]);
        let truth = plant.truth();
        course.push(Seen {
            angle: truth.posture.q[*ELBOW],
            speed: truth.velocity[6 + *ELBOW],
            added: truth.tau[*ELBOW] - carries,
            inertia: dynamics.mass_matrix()[(6 + *ELBOW, 6 + *ELBOW)],
        });
    }
    course
}

#[test]
fn friction_holds_a_joint_up_to_its_torque() {
    const FRICTION_N_M: f64 = 0.2;
    const DURATION_S: f64 = 0.1;
    let robot = robot(FRICTION_N_M, 0.0);
    for share in [0.9, 1.1, 1.5, -0.9, -1.1] {
        let asked = share * FRICTION_N_M;
        let seen = course(&robot, 0.002, DURATION_S, |_| asked);
        let (first, last) = (&seen[0], &seen[seen.len() - 1]);
        let moved_rad = last.angle - robot.home_rad[*ELBOW];
        println!("{share}: {moved_rad} rad, {} rad/s", last.speed);
        // The motor gives what it is asked for, whether the joint moves or not.
        assert!((last.added - asked).abs() < 1e-4, "{}", last.added);
        if share.abs() < 1.0 {
            assert!(moved_rad.abs() < 1e-5, "{share}: {moved_rad} rad");
        } else {
            let rest = asked - FRICTION_N_M.copysign(asked);
            let expected = rest / first.inertia * DURATION_S;
            assert!(
                (last.speed / expected - 1.0).abs() < 0.005,
                "{share}: {} rad/s, not {expected}",
                last.speed
            );
        }
    }
}

#[test]
fn damping_slows_a_joint_exponentially() {
    const PUSHED_S: f64 = 0.1;
    for damping in [0.0, 0.01, 0.02] {
        let robot = robot(0.0, damping);
        let pushed = |time: f64| if time < PUSHED_S - 1e-9 { 0.03 } else { 0.0 };
        let seen = course(&robot, 0.0005, 2.0 * PUSHED_S, pushed);
        let (released, last) = (&seen[seen.len() / 2 - 1], &seen[seen.len() - 1]);
        let (ratio, expected) = (
            last.speed / released.speed,
            (-damping / last.inertia * PUSHED_S).exp(),
        );
        println!("{damping} N m s/rad: {ratio}, expected {expected}");
        assert!(
            (ratio / expected - 1.0).abs() < 0.01,
            "{damping}: {ratio}, not {expected}"
        );
    }
}
