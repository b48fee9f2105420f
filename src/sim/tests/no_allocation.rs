//! A control tick does not allocate, for any gain set and in any phase.

use crate::common::{Bench, push};
use standfast_core::control::{CpiController, Phase};
use standfast_core::robot::Foot;
use standfast_core::socket::Controller;
use standfast_sim::{Engine, Plant, plant::Clock};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// The system's allocator, which counts the requests of this thread.
struct Counting;

thread_local! {
    static COUNT: Cell<usize> = const { Cell::new(0) };
}

unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.with(|c| c.set(c.get() + 1));
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// The episodes include standing, leaving the CPI sets, footsteps that are chosen, planned, followed and landed, and a
/// fall.
#[test]
fn a_tick_of_any_set_in_any_phase_does_not_allocate() {
    let clock = Clock {
        engine: Engine::Rapier,
        physics_step_s: 0.001,
        control_period_s: 0.002,
    };
    let swings = Foot::BOTH.map(Phase::Swing);
    for (gains, wanted) in [
        ("fixed", vec![Phase::Switching, Phase::OutOfSets]),
        ("switching", vec![Phase::Switching, Phase::OutOfSets]),
        ("robust", vec![Phase::Switching, Phase::OutOfSets]),
        (
            "paper",
            [&swings[..], &[Phase::Switching, Phase::OutOfSets]].concat(),
        ),
        (
            "catch",
            [&swings[..], &[Phase::Switching, Phase::OutOfSets]].concat(),
        ),
    ] {
        let bench = Bench::new(gains);
        let mut seen = Vec::new();
        for (impulse_n_s, heading_deg) in [(3.6, 30.0), (3.6, -150.0), (9.0, 0.0)] {
            let mut command = bench.robot.home_command();
            let mut plant = Plant::new(bench.robot.clone(), clock, None, command.clone());
            let mut controller = CpiController::new(bench.design().clone());
            for tick in 0..700 {
                let sensed = plant.sense();
                let before = COUNT.with(Cell::get);
                controller.tick(&sensed, &mut command).unwrap();
                let phase = controller.account().phase;
                assert_eq!(
                    COUNT.with(Cell::get) - before,
                    0,
                    "{gains}, tick {tick}, {phase:?}"
                );
                if !seen.contains(&phase) {
                    seen.push(phase);
                }
                plant.advance(command.clone(), &[push(impulse_n_s, heading_deg)]);
            }
        }
        assert!(
            wanted.iter().all(|phase| seen.contains(phase)),
            "{gains}: only {seen:?}"
        );
    }
}
