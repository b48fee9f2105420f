//! A control period of the plant in each physics engine that this program has: servos, physics, contacts, and what is
//! read once per period.

use crate::played::{Phase, Played, clock};
use criterion::Criterion;
use standfast::core::robot::Robot;
use standfast::core::socket::Command;
use standfast::files::assets::{self, Source};
use standfast::robots::urdf;
use standfast::sim::{Engine, Ground, Pairs, Plant, Push};
use std::path::Path;
use std::time::{Duration, Instant};

pub fn control_period(c: &mut Criterion) {
    let robot = standfast::robots::load("ut-mu2").expect("built in");
    for engine in Engine::ALL
        .into_iter()
        .filter(|engine| engine.check(&robot).is_ok())
    {
        in_engine(c, &robot, engine);
    }
}

fn in_engine(c: &mut Criterion, robot: &Robot, engine: Engine) {
    let home = Command::hold(&robot.home_rad);
    let mut group = c.benchmark_group(format!("control period in {}", engine.name()));
    // The number of samples is large, so that some short samples are not disturbed by other work on the machine.
    group.sample_size(50);
    let start = || {
        Plant::on(
            Ground::default(),
            robot.clone(),
            clock(engine),
            None,
            home.clone(),
        )
    };
    let mut plant = start();
    group.bench_function("standing", |b| {
        b.iter_custom(|count| advance(&mut plant, &home, count))
    });

    // The commands of `catch` are recorded before; a foot is in the air, and lands.
    let played = Played::new("catch", 3.6, engine);
    group.bench_function("swing", |b| b.iter_custom(|count| swing(&played, count)));

    let mut plant = start();
    let push = Push {
        impulse_n_s: 6.0,
        start_s: 0.0,
        ..Push::default()
    };
    while plant.truth().time_s < 3.0 {
        plant.advance(home.clone(), &[push]);
    }
    assert!(
        plant.truth().com.z < 0.15,
        "the COM is {} m high",
        plant.truth().com.z
    );
    group.bench_function("fallen", |b| {
        b.iter_custom(|count| advance(&mut plant, &home, count))
    });
}

/// Robots of 12 to 58 joints that stand, made from the child with fingers, with and without collisions of the fingers,
/// so that the difference is what pairs of links cost.
pub fn joints(c: &mut Criterion) {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/robots/child.urdf");
    let stated = assets::text(Path::new(file)).expect("it is there");
    for engine in [Engine::Rapier, Engine::Mujoco] {
        let mut group = c.benchmark_group(format!("standing in {}", engine.name()));
        for joints in [12, 20, 29, 40, 58] {
            // Legs alone have no fingers.
            for solid in [true, false]
                .into_iter()
                .take(if joints == 12 { 1 } else { 2 })
            {
                let urdf = Source {
                    text: with_joints(&stated.text, joints, solid),
                    ..stated.clone()
                };
                let settings = urdf::inferred(&urdf, None).expect("a humanoid");
                let robot = standfast::robots::parse(&urdf, &settings).expect("a humanoid");
                if engine.check(&robot).is_err() {
                    return;
                }
                assert_eq!(robot.joints.len(), joints);
                let home = robot.home_command();
                let pairs = Pairs::new(&robot).count();
                let mut plant =
                    Plant::on(Ground::default(), robot, clock(engine), None, home.clone());
                let fingers = if solid {
                    ""
                } else {
                    ", fingers without collisions"
                };
                let name = format!("{joints} joints, {pairs} pairs of links{fingers}");
                group.bench_function(name, |b| {
                    b.iter_custom(|count| advance(&mut plant, &home, count))
                });
            }
        }
    }
}

/// The URDF of the child with this number of joints: its legs have 12, arms and neck have 5, and the fingers of both
/// hands have the rest.
fn with_joints(child: &str, joints: usize, solid: bool) -> String {
    let upper = [
        "neck_yaw",
        "left_shoulder_pitch",
        "left_elbow",
        "right_shoulder_pitch",
        "right_elbow",
    ];
    let fixed = if joints == 12 { &upper[..] } else { &[] };
    let mut text = fixed.iter().fold(child.to_string(), |text, joint| {
        text.replace(
            &format!("\"{joint}\" type=\"revolute\""),
            &format!("\"{joint}\" type=\"fixed\""),
        )
    });
    let collision = "<collision><geometry><box size=\"0.008 0.008 0.012\"/></geometry></collision>";
    let collision = if solid { collision } else { "" };
    for finger in 0..joints.saturating_sub(17) {
        let side = ["left", "right"][finger % 2];
        let (x, z) = (
            -0.02 + 0.01 * (finger / 2 % 5) as f64,
            -0.18 - 0.02 * (finger / 10) as f64,
        );
        let added = format!(
            "<link name=\"finger{finger}\"><inertial><mass value=\"0.01\"/><inertia ixx=\"1e-6\" ixy=\"0\" ixz=\"0\" \
             iyy=\"1e-6\" iyz=\"0\" izz=\"1e-6\"/></inertial>{collision}</link><joint name=\"to_finger{finger}\" \
             type=\"revolute\"><parent link=\"{side}_forearm\"/><child link=\"finger{finger}\"/><origin xyz=\"{x} 0 {z}\"/>\
             <axis xyz=\"0 1 0\"/><limit lower=\"-0.5\" upper=\"0.5\" effort=\"1\" velocity=\"10\"/></joint></robot>"
        );
        text = text.replace("</robot>", &added);
    }
    text
}

/// Time of `count` control periods.
fn advance(plant: &mut Plant, command: &Command, count: u64) -> Duration {
    let start = Instant::now();
    for _ in 0..count {
        plant.advance(command.clone(), &[]);
    }
    start.elapsed()
}

/// Time of `count` control periods with a foot in the air; the episode is repeated until `count` such periods have run.
fn swing(played: &Played, count: u64) -> Duration {
    let (mut spent, mut left) = (Duration::ZERO, count);
    while left > 0 {
        let mut plant = played.plant();
        let before = left;
        for tick in &played.ticks {
            let start = Instant::now();
            plant.advance(tick.command.clone(), &[played.push]);
            let took = start.elapsed();
            if left > 0 && tick.phase == Phase::Swing {
                (spent, left) = (spent + took, left - 1);
            }
        }
        assert!(left < before, "no foot was in the air");
    }
    spent
}
