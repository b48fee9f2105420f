//! A control period of the plant in each physics engine that this program has: servos, physics, contacts, and what is
//! read once per period.

use crate::played::{Phase, Played, clock};
use criterion::Criterion;
use standfast::robot::{Command, Robot};
use standfast::sim::{Engine, Ground, Plant, Push};
use std::time::{Duration, Instant};

pub fn control_period(c: &mut Criterion) {
    let robot = Robot::load("ut-mu2").expect("built in");
    for engine in Engine::ALL.into_iter().filter(|engine| engine.check(&robot).is_ok()) {
        in_engine(c, &robot, engine);
    }
}

fn in_engine(c: &mut Criterion, robot: &Robot, engine: Engine) {
    let home = Command::hold(&robot.home_rad);
    let mut group = c.benchmark_group(format!("control period in {}", engine.name()));
    // Many samples, so that short ones are among them, which other work on the machine does not disturb.
    group.sample_size(50);
    let start = || Plant::on(Ground::default(), robot.clone(), clock(engine), None, home.clone());
    let mut plant = start();
    group.bench_function("standing", |b| b.iter_custom(|count| advance(&mut plant, &home, count)));

    // With commands of `catch`, which are known: a foot is in the air, and lands.
    let played = Played::new("catch", 3.6, engine);
    group.bench_function("swing", |b| b.iter_custom(|count| swing(&played, count)));

    let mut plant = start();
    let push = Push { impulse_n_s: 6.0, start_s: 0.0, ..Push::default() };
    while plant.truth().time_s < 3.0 {
        plant.advance(home.clone(), &[push]);
    }
    assert!(plant.truth().com.z < 0.15, "the COM is {} m high", plant.truth().com.z);
    group.bench_function("fallen", |b| b.iter_custom(|count| advance(&mut plant, &home, count)));
}

/// Time of `count` control periods.
fn advance(plant: &mut Plant, command: &Command, count: u64) -> Duration {
    let start = Instant::now();
    for _ in 0..count {
        plant.advance(command.clone(), &[]);
    }
    start.elapsed()
}

/// Time of `count` control periods with a foot in the air, over as many repetitions of the episode as it takes.
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
