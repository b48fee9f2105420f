//! Cost of the whole body: what runs at every tick, and a whole tick of `catch`, compared with a step of the
//! simulation.

use criterion::{Criterion, criterion_group, criterion_main};
use nalgebra::{DVector, Vector3};
use standfast::control::body::{ContactModel, DesiredAcceleration, InverseDynamics};
use standfast::control::{Controller, Design};
use standfast::lipm::GainSet;
use standfast::robot::dynamics::Dynamics;
use standfast::robot::{Command, Kinematics, PerFoot, Robot, Sensed};
use standfast::sim::plant::Clock;
use standfast::sim::{Plant, Push};
use std::hint::black_box;
use std::time::{Duration, Instant};

fn whole_body(c: &mut Criterion) {
    let robot = Robot::load("ut-mu2").expect("built in");
    let (posture, velocity) = (robot.home_posture(), DVector::from_element(6 + robot.joints.len(), 0.1));
    let mut kinematics = Kinematics::new(&robot);
    let mut dynamics = Dynamics::new(&robot);
    c.bench_function("kinematics", |b| b.iter(|| kinematics.update(&robot, black_box(&posture))));
    c.bench_function("mass matrix and bias", |b| b.iter(|| dynamics.update(&robot, &kinematics, black_box(&velocity))));

    let mut body = InverseDynamics::new(&robot, ContactModel { friction: 0.6, sole_share: 0.95 });
    let both = PerFoot { left: true, right: true };
    for (name, standing, com_acc, vary) in [
        ("both feet", both, Vector3::new(0.5, 0.0, 0.0), 0.001),
        ("both feet, past the edge", both, Vector3::new(-4.0, 0.0, 0.0), 0.001),
        ("one foot", PerFoot { left: true, right: false }, Vector3::new(0.0, -1.5, 0.0), 0.001),
        // The last solution does not help here.
        ("both feet, from edge to edge", both, Vector3::zeros(), 4.0),
    ] {
        let mut wanted = DesiredAcceleration::rest(&robot, standing);
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
    let home = Command::hold(&robot.home_rad);
    let mut plant = Plant::new(&robot, clock, None, home.clone());
    c.bench_function("a step of the simulation, standing", |b| b.iter(|| plant.advance(home.clone(), &[])));
}

/// Ticks of an episode with footsteps, by whether a foot is in the air. The readings of the episode are played back to
/// the controller, so it is in the states of the episode, and the physics takes no time.
fn catching(c: &mut Criterion) {
    let clock = Clock { physics_step_s: 0.001, control_period_s: 0.002 };
    let robot = Robot::load("ut-mu2").expect("built in");
    let gains = GainSet::load("catch").expect("built in");
    let design = Design::new(&robot, &gains, clock.control_period_s).expect("built in");
    let push = Push { impulse_n_s: 3.6, start_s: 0.2, ..Push::default() };
    let mut plant = Plant::new(&robot, clock, None, design.home_command().clone());
    let mut controller = Controller::new(design.clone());
    let mut command = design.home_command().clone();
    let sensed: Vec<Sensed> = (0..400)
        .map(|_| {
            let sensed = plant.sense();
            controller.tick(&sensed, &mut command).expect("readings");
            plant.advance(command.clone(), &[push]);
            sensed
        })
        .collect();

    for (name, in_air) in [("both feet on the ground", false), ("a foot in the air", true)] {
        let ticks = |count: u64| {
            let mut command = Command::hold(&robot.home_rad);
            let (mut spent, mut left) = (Duration::ZERO, count);
            while left > 0 {
                let (mut controller, before) = (Controller::new(design.clone()), left);
                for sensed in &sensed {
                    let start = Instant::now();
                    black_box(controller.tick(black_box(sensed), &mut command)).expect("readings");
                    let took = start.elapsed();
                    if left > 0 && controller.account().stands() != in_air {
                        (spent, left) = (spent + took, left - 1);
                    }
                }
                assert!(left < before, "no tick with {name}");
            }
            spent
        };
        c.bench_function(&format!("a tick of catch, {name}"), |b| b.iter_custom(ticks));
    }
}

criterion_group!(benches, whole_body, catching);
criterion_main!(benches);
