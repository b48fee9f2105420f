//! A physics step of the plant: servos, Rapier, contacts, and its share of what is read once per control tick.

use crate::played::{Phase, Played, clock};
use criterion::Criterion;
use standfast::robot::{Command, Robot};
use standfast::sim::{Plant, Push};
use std::time::{Duration, Instant};

pub fn physics_step(c: &mut Criterion) {
    let (robot, clock) = (Robot::load("ut-mu2").expect("built in"), clock());
    let steps = (clock.control_period_s / clock.physics_step_s).round() as u32;
    let home = Command::hold(&robot.home_rad);
    let mut group = c.benchmark_group("physics step");
    // Many samples, so that short ones are among them, which other work on the machine does not disturb.
    group.sample_size(50);
    let mut plant = Plant::new(&robot, clock, None, home.clone());
    group.bench_function("standing", |b| b.iter_custom(|count| advance(&mut plant, &home, count) / steps));

    // With commands of `catch`, which are known: a foot is in the air, and lands.
    let played = Played::new("catch", 3.6);
    group.bench_function("swing", |b| b.iter_custom(|count| swing(&played, count) / steps));

    let mut plant = Plant::new(&robot, clock, None, home.clone());
    let push = Push { impulse_n_s: 6.0, start_s: 0.0, ..Push::default() };
    while plant.truth().time_s < 3.0 {
        plant.advance(home.clone(), &[push]);
    }
    assert!(plant.truth().com.z < 0.15, "the COM is {} m high", plant.truth().com.z);
    group.bench_function("fallen", |b| b.iter_custom(|count| advance(&mut plant, &home, count) / steps));
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
        let mut plant = Plant::new(&played.robot, played.clock, None, played.design.home_command().clone());
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
