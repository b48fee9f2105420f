//! Ticks a second of controllers in Python, with no simulation: objects that answer to many episodes in one call, beside a
//! child that is asked by lines of JSON. `cargo bench -p standfast-controllers`; `PYTHON` names another Python than `python3`,
//! such as one with numpy.
//!
//! The bench starts Python, and Python starts the bench again, in place of the program.

use standfast_controllers::turns::{Turns, in_turn, take_part};
use standfast_core::robot::{PerFoot, Robot};
use standfast_core::socket::{Command, Imu, PreparedController, Sensed, Wrench};
use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;
use std::time::{Duration, Instant};

const ASSETS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets");
/// Rows of a frame, threads that compute, rounds, time of each measurement, and ticks of an episode.
const BATCH: usize = 64;
const THREADS: usize = 2;
const ROUNDS: usize = 5;
const MEASURED: Duration = Duration::from_secs(2);
const TICKS: u64 = 500;

/// All three hold the posture, with a gain on the joints' speeds.
const SCRIPT: &str = "
import sys
sys.path.insert(0, sys.argv[1])
import standfast
from standfast._exchange import numpy
from standfast._program import _Program

class Batched:
    def __init__(self, hello):
        self.home = hello['robot']['home']['q_ref']
        if numpy:
            self.home = numpy.array(self.home)
    def tick_batch(self, rows):
        if numpy:
            return self.home - 0.01 * rows.dq
        return [[home - 0.01 * dq for home, dq in zip(self.home, row)] for row in rows.dq]

class Each(standfast.Controller):
    def tick(self, sensed):
        return {'q_ref': [home - 0.01 * dq for home, dq in zip(self.home, sensed['dq'])]}

of = {'batched': Batched, 'each': Each}[sys.argv[2]]
with _Program({'mine': of}, None, int(sys.argv[3]), 60.0, True) as program:
    print(program.run(program.controllers, [0]), 'with numpy' if numpy else 'without numpy')
";

fn main() {
    let robot = standfast_robots::load("ut-mu2").expect("it is built in");
    let file =
        std::env::args().find_map(|arg| Some(arg.strip_prefix("--controller=")?.to_string()));
    if let (Some(file), true) = (file, std::env::var_os("STANDFAST_PYTHON").is_some()) {
        println!("{}", ticks_a_second(&robot, &file));
        return;
    }
    // As other benches: a word chooses, and `--test` runs it once.
    let mut words = std::env::args().skip(1).filter(|arg| !arg.starts_with('-'));
    if words.any(|word| !"exchange".contains(&word)) {
        return;
    }
    let is_test = std::env::args().any(|arg| arg == "--test");
    let json = format!("{ASSETS}/controllers/python/hold.toml");
    for _ in 0..if is_test { 1 } else { ROUNDS } {
        let by_json = ticks_a_second(&robot, &json);
        println!("lines of JSON, a child for each of {THREADS} threads: {by_json:.0} ticks/s");
        for (of, batch) in [("batched", BATCH), ("batched", 1), ("each", BATCH)] {
            let told = in_python(of, batch);
            let (ticks, with) = told.trim().split_once(' ').expect("a number and words");
            let ticks: f64 = ticks.parse().expect("a number");
            let times = ticks / by_json;
            println!("{of}, {batch} rows: {ticks:.0} ticks/s {with}, {times:.1} times as many");
        }
    }
}

/// What the script prints.
fn in_python(of: &str, batch: usize) -> String {
    let python = std::env::var("PYTHON").unwrap_or("python3".into());
    let program = std::env::current_exe().expect("it runs");
    let output = process::Command::new(python)
        .args([
            "-c",
            SCRIPT,
            &format!("{ASSETS}/python"),
            of,
            &batch.to_string(),
        ])
        .env("STANDFAST_PROGRAM", program)
        .stderr(process::Stdio::inherit())
        .output()
        .expect("Python starts");
    assert!(output.status.success(), "Python fails");
    String::from_utf8_lossy(&output.stdout)
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
}

/// Episodes that only tick, on as many threads as the controller asks for.
fn ticks_a_second(robot: &Robot, file: &str) -> f64 {
    let spec = standfast_controllers::load(file).expect("its file is good");
    let prepared = spec.prepare(robot, 0.002).expect("it can be prepared");
    let (turns, ticks) = (Arc::new(Turns::new(THREADS)), AtomicU64::new(0));
    let began = Instant::now();
    thread::scope(|scope| {
        for _ in 0..spec.open_episodes().max(THREADS) {
            scope.spawn(|| {
                take_part(Arc::clone(&turns));
                while began.elapsed() < MEASURED {
                    in_turn(|| episode(robot, &prepared));
                    ticks.fetch_add(TICKS, Ordering::Relaxed);
                }
            });
        }
    });
    ticks.into_inner() as f64 / began.elapsed().as_secs_f64()
}

fn episode(robot: &Robot, prepared: &PreparedController) {
    let mut controller = prepared.start(1);
    let mut command = Command::hold(&robot.home_rad);
    let half_weight = Wrench {
        force: [0.0, 0.0, 0.5 * robot.weight_n()].into(),
        ..Wrench::default()
    };
    let mut sensed = Sensed {
        time_s: 0.0,
        q: robot.home_rad.clone(),
        dq: vec![0.0; robot.joints.len()],
        imu: Imu {
            orientation: Default::default(),
            gyro: Default::default(),
            accelerometer: [0.0, 0.0, 9.81].into(),
        },
        soles: PerFoot::from_fn(|_| half_weight),
    };
    for tick in 0..TICKS {
        sensed.time_s = 0.002 * tick as f64;
        controller.tick(&sensed, &mut command).expect("it answers");
        command.check(robot.joints.len()).expect("it commands");
    }
}
