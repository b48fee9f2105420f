//! A control tick of each gain set, by phase: from the readings of the sensors to the command to the servos.

use crate::played::{Phase, Played};
use criterion::Criterion;
use standfast::core::control::CpiController;
use standfast::core::socket::{Command, Controller};
use standfast::sim::Engine;
use std::hint::black_box;
use std::time::{Duration, Instant};

pub fn ticks(c: &mut Criterion) {
    use Phase::{Standing, Swing, Switching};
    // The push on `switching` is too weak to topple it; the pushes on `paper` and `catch` are strong enough to make
    // them step.
    for (gains, impulse_n_s, phases) in [
        ("switching", 2.0, &[Standing, Switching][..]),
        ("paper", 3.6, &[Standing, Switching, Swing]),
        ("catch", 3.6, &[Standing, Switching, Swing]),
    ] {
        let played = Played::new(gains, impulse_n_s, Engine::Rapier);
        for &phase in phases {
            c.bench_function(&format!("tick/{gains}/{}", phase.name()), |b| {
                b.iter_custom(|count| ticks_in(phase, &played, count))
            });
        }
    }
}

/// Time of `count` ticks in `phase`; the episode is repeated until `count` ticks in `phase` have run.
fn ticks_in(phase: Phase, played: &Played, count: u64) -> Duration {
    let mut command = Command::hold(&played.robot.home_rad);
    let (mut spent, mut left) = (Duration::ZERO, count);
    while left > 0 {
        let (mut controller, before) = (CpiController::new(played.design.clone()), left);
        for tick in &played.ticks {
            let start = Instant::now();
            black_box(controller.tick(black_box(&tick.sensed), &mut command)).expect("readings");
            let took = start.elapsed();
            if left > 0 && tick.phase == phase {
                (spent, left) = (spent + took, left - 1);
            }
        }
        assert!(left < before, "no tick is {}", phase.name());
    }
    spent
}
