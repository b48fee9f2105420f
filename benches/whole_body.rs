//! Cost of the whole body: what runs at every tick, beside a step of the simulation.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{DVector, Vector3};
use standfast::control::inverse_dynamics::{Grip, InverseDynamics, Wanted};
use standfast::robot::dynamics::Dynamics;
use standfast::robot::{Command, Kinematics, PerFoot, Robot};
use standfast::sim::Plant;
use standfast::sim::plant::Clock;
use std::hint::black_box;

fn whole_body(c: &mut Criterion) {
    let robot = Robot::load("ut-mu2").expect("built in");
    let (posture, velocity) = (robot.home_posture(), DVector::from_element(6 + robot.joints.len(), 0.1));
    let mut kinematics = Kinematics::new(&robot);
    let mut dynamics = Dynamics::new(&robot);
    c.bench_function("kinematics", |b| b.iter(|| kinematics.update(&robot, black_box(&posture))));
    c.bench_function("mass matrix and bias", |b| b.iter(|| dynamics.update(&robot, &kinematics, black_box(&velocity))));

    let mut body = InverseDynamics::new(&robot, Grip { friction: 0.6, sole_share: 0.95 });
    let both = PerFoot { left: true, right: true };
    for (name, standing, com_acc, vary) in [
        ("both feet", both, Vector3::new(0.5, 0.0, 0.0), 0.001),
        ("both feet, past the edge", both, Vector3::new(-4.0, 0.0, 0.0), 0.001),
        ("one foot", PerFoot { left: true, right: false }, Vector3::new(0.0, -1.5, 0.0), 0.001),
        // No help from the last answer.
        ("both feet, from edge to edge", both, Vector3::zeros(), 4.0),
    ] {
        let mut wanted = Wanted::rest(&robot, standing);
        let mut sign = 1.0;
        c.bench_function(&format!("inverse dynamics, {name}"), |b| {
            b.iter(|| {
                sign = -sign;
                wanted.com_acc = com_acc + Vector3::x() * (sign * vary);
                body.solve(&robot, &posture, black_box(&velocity), &wanted)
            })
        });
    }

    let clock = Clock { physics_step_s: 0.001, control_period_s: 0.001 };
    let zeros = vec![0.0; robot.joints.len()];
    let home = Command { q_ref: robot.home_rad.clone(), dq_ref: zeros.clone(), tau_ff: zeros };
    let mut plant = Plant::new(&robot, clock, None, home.clone());
    c.bench_function("a step of the simulation, standing", |b| b.iter(|| plant.advance(home.clone(), &[])));
}

criterion_group!(benches, whole_body);
criterion_main!(benches);
