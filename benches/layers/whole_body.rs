//! The whole body: kinematics, dynamics and their inverses, of which a control tick needs one each.

use criterion::Criterion;
use nalgebra::{DVector, Vector3};
use standfast::core::control::body::{
    BodyTargets, ContactModel, DesiredAcceleration, InverseDynamics, InverseKinematics,
};
use standfast::core::robot::dynamics::Dynamics;
use standfast::core::robot::{Kinematics, PerFoot};
use std::hint::black_box;

pub fn whole_body(c: &mut Criterion) {
    let robot = standfast::robots::load("ut-mu2").expect("built in");
    let (posture, velocity) = (
        robot.home_posture(),
        DVector::from_element(6 + robot.joints.len(), 0.1),
    );
    let mut kinematics = Kinematics::new(&robot);
    let mut dynamics = Dynamics::new(&robot);
    c.bench_function("body/kinematics", |b| {
        b.iter(|| kinematics.update(&robot, black_box(&posture)))
    });
    c.bench_function("body/mass matrix and bias", |b| {
        b.iter(|| dynamics.update(&robot, &kinematics, black_box(&velocity)))
    });

    let mut inverse = InverseKinematics::new(&robot);
    let com = kinematics.com();
    let mut targets = BodyTargets {
        com,
        rise: 1e-4,
        com_vel: Vector3::zeros(),
        soles: PerFoot::from_fn(|foot| kinematics.sole_pose(&robot, foot)),
        sole_vel: PerFoot::from_fn(|_| Vector3::zeros()),
        trunk: posture.base.rotation,
    };
    let mut sign = 1.0;
    c.bench_function("body/inverse kinematics", |b| {
        b.iter(|| {
            sign = -sign;
            targets.com = com + Vector3::x() * (sign * 0.001);
            inverse.follow(&robot, black_box(&targets))
        })
    });

    let mut body = InverseDynamics::new(
        &robot,
        ContactModel {
            friction: 0.6,
            sole_share: 0.95,
        },
    );
    let both = PerFoot {
        left: true,
        right: true,
    };
    for (name, standing, com_acc, vary) in [
        ("both feet", both, Vector3::new(0.5, 0.0, 0.0), 0.001),
        (
            "both feet, past the edge",
            both,
            Vector3::new(-4.0, 0.0, 0.0),
            0.001,
        ),
        (
            "one foot",
            PerFoot {
                left: true,
                right: false,
            },
            Vector3::new(0.0, -1.5, 0.0),
            0.001,
        ),
        // The last solution does not help where the desired acceleration jumps from edge to edge.
        ("both feet, from edge to edge", both, Vector3::zeros(), 4.0),
    ] {
        let mut wanted = DesiredAcceleration::rest(&robot, standing);
        let mut sign = 1.0;
        c.bench_function(&format!("body/inverse dynamics/{name}"), |b| {
            b.iter(|| {
                sign = -sign;
                wanted.com_acc = com_acc + Vector3::x() * (sign * vary);
                body.solve(&robot, &posture, black_box(&velocity), &wanted)
            })
        });
    }
}
