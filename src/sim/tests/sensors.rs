//! The readings of ideal sensors agree with physics.

use crate::common::{Bench, engine, push};
use nalgebra::{UnitQuaternion, Vector3};
use standfast_core::robot::{Foot, GRAVITY};
use standfast_core::socket::Sensed;
use standfast_sim::{Plant, Truth, plant::Clock};

const PERIOD_S: f64 = 0.002;

/// Runs the loop and passes the readings and the true state of every tick to `see`.
fn watch(impulse: f64, heading: f64, horizon_s: f64, mut see: impl FnMut(&Sensed, &Truth)) {
    let bench = Bench::new("switching");
    let clock = Clock {
        engine: engine(),
        physics_step_s: 0.001,
        control_period_s: PERIOD_S,
    };
    let mut plant = Plant::new(bench.robot.clone(), clock, None, bench.robot.home_command());
    let mut controller = bench.factory.start(0);
    let mut command = bench.robot.home_command();
    for _ in 0..(horizon_s / PERIOD_S) as usize {
        let sensed = plant.sense();
        see(&sensed, plant.truth());
        controller.tick(&sensed, &mut command).unwrap();
        plant.advance(command.clone(), &[push(impulse, heading)]);
    }
}

/// An accelerometer measures specific force: at rest it is g upward, and its integral less gravity is the velocity.
#[test]
fn the_accelerometer_reads_specific_force() {
    let mut speed = Vector3::zeros();
    let mut worst: f64 = 0.0;
    watch(3.0, 45.0, 1.0, |sensed, truth| {
        let felt = sensed.imu.orientation * sensed.imu.accelerometer;
        if truth.time_s > 0.2 && truth.time_s < 0.5 {
            assert!(
                (felt - Vector3::z() * GRAVITY).norm() < 0.05,
                "{felt} at {} s",
                truth.time_s
            );
        }
        speed += (felt - Vector3::z() * GRAVITY) * PERIOD_S;
        worst = worst.max((truth.trunk_velocity.fixed_rows::<3>(0) - speed).norm());
    });
    assert!(worst < 1e-6, "{worst} m/s");
}

/// A gyro measures the angular velocity in its own frame. Integrated over every tick it gives the orientation, even in
/// a fall.
#[test]
fn the_gyro_integrates_to_the_orientation() {
    let mut turned = UnitQuaternion::identity();
    let (mut worst, mut most): (f64, f64) = (0.0, 0.0);
    watch(7.0, 45.0, 1.6, |sensed, _| {
        turned *= UnitQuaternion::from_scaled_axis(sensed.imu.gyro * PERIOD_S);
        worst = worst.max(turned.angle_to(&sensed.imu.orientation));
        most = most.max(sensed.imu.orientation.angle());
    });
    println!("off by at most {worst:.5} rad in turns of {most:.3} rad");
    assert!(
        most > 0.5 && worst < 0.02 * most,
        "{worst} rad in {most} rad"
    );
}

/// The wrenches of the soles, each in its own frame and about its own centre, add up to the force and ZMP of the
/// ground.
#[test]
fn sole_wrenches_add_up_to_force_and_zmp() {
    watch(2.5, 30.0, 1.5, |sensed, truth| {
        if truth.time_s == 0.0 || truth.touching.is_some() {
            return;
        }
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        for foot in Foot::BOTH {
            let (pose, wrench) = (&truth.soles[foot], &sensed.soles[foot]);
            let f = pose.rotation * wrench.force;
            force += f;
            moment += pose.rotation * wrench.moment + pose.translation.vector.cross(&f);
        }
        assert!(
            (force - truth.contact_force).norm() < 1e-9,
            "{force} at {} s",
            truth.time_s
        );
        if let Some([x, y]) = truth.zmp {
            let off = (-moment.y / force.z - x).hypot(moment.x / force.z - y);
            assert!(off < 1e-9, "{off} m at {} s", truth.time_s);
        }
    });
}
