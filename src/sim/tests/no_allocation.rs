//! A control tick, the controller's report and the judge do not allocate, for any controller and in any phase.

use crate::common::{Bench, config, push};
use standfast_core::control::Phase;
use standfast_core::robot::{Foot, Units};
use standfast_sim::episode::{Record, Referee, Tick};
use standfast_sim::{Plant, Push};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;
use std::sync::Arc;

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

/// What a tick of this controller, its report and the judge request, in an episode without noise after a push. The
/// judge may request memory only at a tick at which its record becomes longer: by a footstep, a total or a verdict.
fn phases_without_requests(bench: &Bench, push: Push) -> Vec<String> {
    let (robot, config) = (Arc::new(bench.robot.clone()), config(1.4));
    let mut command = robot.home_command();
    let mut plant = Plant::new(bench.robot.clone(), config.clock(), None, command.clone());
    let mut controller = bench.factory.start(0);
    let mut referee = Referee::new(&robot, robot.clone(), &config, &[push]);
    let omega = Units::of(&robot).omega();
    let length = |of: &Record| {
        let footsteps = (of.footsteps.count, of.footsteps.lifted.is_some());
        let causes = (of.fall_cause.is_some(), of.legs_met.is_some());
        (of.totals.0.len(), footsteps, causes)
    };
    let mut seen: Vec<String> = Vec::new();
    for k in 0..700 {
        let sensed = plant.sense();
        let before = COUNT.with(Cell::get);
        controller.tick(&sensed, &mut command).unwrap();
        let report = controller.report();
        let ticked = COUNT.with(Cell::get);
        let tick = Tick::new(&robot, omega, plant.truth(), report, &command);
        let known = length(&referee.record);
        referee.watch(&tick);
        let judged = COUNT.with(Cell::get);
        let (name, phase) = (&bench.factory.name, report.phase);
        assert_eq!(ticked - before, 0, "{name}, tick {k}, {phase}");
        if known == length(&referee.record) {
            assert_eq!(judged - ticked, 0, "the judge of {name}, tick {k}, {phase}");
        }
        if !seen.iter().any(|known| known == phase) {
            seen.push(phase.into());
        }
        plant.advance(command.clone(), &[push]);
    }
    seen
}

/// The episodes include standing, leaving the CPI sets, footsteps that are chosen, planned, followed and landed, and a
/// fall.
#[test]
fn a_tick_of_any_controller_in_any_phase_and_its_judge_do_not_allocate() {
    let stands = [Phase::Switching, Phase::OutOfSets].map(Phase::name);
    let steps = [
        &Foot::BOTH.map(|foot| Phase::Swing(foot).name())[..],
        &stands,
    ]
    .concat();
    for (name, wanted) in [
        ("hold", &["posture"][..]),
        ("fixed", &stands),
        ("switching", &stands),
        ("robust", &stands),
        ("paper", &steps),
        ("catch", &steps),
    ] {
        let bench = Bench::new(name);
        let pushes = [(3.6, 30.0), (3.6, -150.0), (9.0, 0.0)];
        let seen = pushes
            .map(|(impulse_n_s, heading_deg)| {
                phases_without_requests(&bench, push(impulse_n_s, heading_deg))
            })
            .concat();
        assert!(
            wanted
                .iter()
                .all(|&phase| seen.iter().any(|known| known == phase)),
            "{name}: only {seen:?}"
        );
    }
}
