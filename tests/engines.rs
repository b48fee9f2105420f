//! The same physics in both engines: laws that have a solution in closed form, each engine against the law, and the
//! push that topples a stiff robot, the engines against each other. (The other tests of physics run in either engine,
//! which STANDFAST_ENGINE names.)

use crate::common::program::{Run, SEVERAL_PARTS, files, folder, standfast, stderr, stdout};
use crate::common::{Bench, angular_momentum, config, push};
use nalgebra::{DVector, UnitQuaternion, Vector3};
use rayon::prelude::*;
use standfast::core::robot::dynamics::Dynamics;
use standfast::core::robot::{GRAVITY, Kinematics, Robot};
use standfast::sim::episode::{self, Disturbance, EpisodeConfig, Outcome, Until};
use standfast::sim::{Engine, Ground, Plant, Pull, Variation, plant::Clock};
use std::f64::consts::TAU;

fn clock(engine: Engine) -> Clock {
    EpisodeConfig {
        engine,
        ..config(6.0)
    }
    .clock()
}

/// The robot under the command that holds its home posture, for `duration_s`. `see` is called after each tick.
fn hold(
    bench: &Bench,
    robot: &Robot,
    ground: Ground,
    clock: Clock,
    duration_s: f64,
    mut see: impl FnMut(&mut Plant),
) {
    let home = bench.robot.home_command();
    let mut plant = Plant::on(ground, robot.clone(), clock, None, home.clone());
    for _ in 0..(duration_s / clock.control_period_s).round() as usize {
        plant.advance(home.clone(), &[]);
        see(&mut plant);
    }
}

/// A robot that is thrown up falls with g, and keeps its horizontal and its angular momentum, although its servos work.
#[test]
fn a_robot_in_flight_falls_freely() {
    standfast::leaves::add();
    let bench = Bench::new("hold");
    let robot = &bench.robot;
    for engine in Engine::ALL {
        let throw = Pull {
            link: robot.trunk,
            point: robot.links[robot.trunk].com_m,
            force: Vector3::new(5.0, 3.0, 4.0 * robot.mass() * GRAVITY),
        };
        let (mut start, mut worst) = (None, [0.0_f64; 3]);
        hold(
            &bench,
            robot,
            Ground::default(),
            clock(engine),
            0.5,
            |plant| {
                plant.pull = (plant.truth().time_s < 0.1).then_some(throw);
                let truth = plant.truth();
                if truth.time_s < 0.15 {
                    return;
                }
                assert!(
                    truth.zmp.is_none(),
                    "{engine:?}: it touches the ground at {} s",
                    truth.time_s
                );
                let now = (truth.time_s, truth.com_vel, angular_momentum(robot, truth));
                let (time_s, velocity, spin) = start.get_or_insert(now);
                let fallen =
                    truth.com_vel - *velocity + Vector3::z() * GRAVITY * (truth.time_s - *time_s);
                worst[0] = worst[0].max(fallen.norm());
                worst[1] = worst[1].max((now.2 - *spin).norm());
                worst[2] = worst[2].max(spin.norm());
            },
        );
        println!(
            "{engine:?}: {:.1e} m/s off free fall, {:.1e} of {:.3} N m s",
            worst[0], worst[1], worst[2]
        );
        assert!(worst[2] > 0.01, "it does not turn");
        assert!(
            worst[0] < 1e-3 && worst[1] < 0.01 * worst[2] + 2e-4,
            "{engine:?}: {worst:?}"
        );
    }
}

/// A robot at rest bears half of its weight on each sole, and its gears bear what its motors give. A robot that falls is
/// stopped by its soles: while their force is largest, which is for 6 ms, they take at most its momentum.
#[test]
fn soles_and_gears_bear_what_the_robot_is_and_does() {
    standfast::leaves::add();
    let bench = Bench::new("hold");
    let robot = &bench.robot;
    let weight_n = robot.mass() * GRAVITY;
    let mut peaks = Vec::new();
    for engine in Engine::ALL {
        let lift = Pull {
            link: robot.trunk,
            point: robot.links[robot.trunk].com_m,
            force: Vector3::new(0.0, 0.0, 2.0 * weight_n),
        };
        let (mut highest_m, mut peak_n, mut ticks) = (0.0_f64, 0.0_f64, [0.0; 3]);
        hold(
            &bench,
            robot,
            Ground::default(),
            clock(engine),
            1.5,
            |plant| {
                plant.pull = ((1.0 - 1e-9)..1.1)
                    .contains(&plant.truth().time_s)
                    .then_some(lift);
                let truth = plant.truth();
                let loads = &truth.loads;
                if (0.9..1.0).contains(&truth.time_s) {
                    let sum = loads.soles_n.left + loads.soles_n.right;
                    assert!((sum / weight_n - 1.0).abs() < 0.01, "{engine:?}: {loads:?}");
                    assert!((loads.soles_n.left / sum - 0.5).abs() < 0.05, "{loads:?}");
                    let servos = robot.servos.iter();
                    let motor = truth
                        .tau
                        .iter()
                        .zip(servos)
                        .map(|(tau, servo)| tau.abs() / servo.torque_n_m);
                    let most = motor.fold(0.0, f64::max);
                    assert!(
                        (loads.gear_ratio / most - 1.0).abs() < 0.02,
                        "{engine:?}: {most}, {loads:?}"
                    );
                }
                ticks.rotate_left(1);
                ticks[2] = truth.sole_wrenches.left.force.z;
                let mean_n = ticks.iter().sum::<f64>() / 3.0;
                assert!(
                    (loads.soles_n.left - mean_n).abs() < 1e-6 * weight_n || truth.time_s < 0.006
                );
                highest_m = highest_m.max(truth.com.z);
                peak_n = peak_n.max(loads.soles_n.left + loads.soles_n.right);
            },
        );
        let fall_m = highest_m - robot.home_com_height();
        let momentum = robot.mass() * (2.0 * GRAVITY * fall_m).sqrt();
        println!(
            "{engine:?}: falls by {fall_m:.3} m, {momentum:.2} N s; at most {:.2} weights",
            peak_n / weight_n
        );
        assert!(
            peak_n > 2.0 * weight_n && peak_n * 0.006 < momentum + weight_n * 0.006,
            "{engine:?}: {peak_n} N"
        );
        peaks.push(peak_n);
    }
    assert!((peaks[0] / peaks[1] - 1.0).abs() < 0.1, "{peaks:?}");
}

/// On a slope of angle a the robot slides like a block: with g (sin a - mu cos a), and not at all if mu > tan a.
#[test]
fn on_a_slope_a_robot_slides_like_a_block() {
    standfast::leaves::add();
    let bench = Bench::new("hold");
    let angle = 5f64.to_radians();
    for engine in Engine::ALL {
        for friction in [0.03, 0.06, 0.12] {
            let slope = Variation {
                slope_deg: Some(5.0),
                slope_heading_deg: Some(0.0),
                friction: Some(friction),
                ..Variation::default()
            };
            let ground = Ground::new(&bench.robot, &slope);
            let down = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), -angle) * -Vector3::x();
            let mut speeds = Vec::new();
            hold(
                &bench,
                &slope.robot(&bench.robot),
                ground,
                clock(engine),
                2.5,
                |plant| {
                    let truth = plant.truth();
                    // The ground has tilted after 0.8 s, and the robot has stopped to sway after 2 s.
                    if truth.time_s > 2.0 - 1e-9 {
                        speeds.push(truth.com_vel.dot(&down));
                    }
                },
            );
            let gained = (speeds.last().unwrap() - speeds[0]) / 0.5;
            let law = GRAVITY * (angle.sin() - friction * angle.cos()).max(0.0);
            println!(
                "{engine:?}, mu {friction}: {gained:.4} m/s^2, law {law:.4}; {:.2e} m/s at the end",
                speeds.last().unwrap()
            );
            assert!(
                (gained - law).abs() < 0.02 * GRAVITY * angle.sin(),
                "{engine:?}, mu {friction}: {gained}"
            );
            if law == 0.0 {
                let fastest = speeds
                    .iter()
                    .fold(0.0_f64, |most, speed| most.max(speed.abs()));
                assert!(fastest < 2e-3, "{engine:?}, mu {friction}: {fastest} m/s");
            }
        }
    }
}

/// An arm whose shoulder is free swings like a pendulum with the rotor's inertia: period 2 pi sqrt(M / (dG/dq)).
#[test]
fn a_free_arm_swings_with_the_period_of_its_inertia() {
    standfast::leaves::add();
    let mut robot = standfast::robots::load("ut-mu2").unwrap();
    let shoulder = robot
        .joints
        .iter()
        .position(|joint| joint.name == "left_shoulder_flexion")
        .unwrap();
    // All other joints are stiff, so that the rest of the robot stands still.
    for (joint, servo) in robot.servos.iter_mut().enumerate() {
        let factor = if joint == shoulder { 0.0 } else { 10.0 };
        (servo.kp, servo.kd, servo.torque_n_m) = (factor * servo.kp, factor * servo.kd, 100.0);
    }
    robot.home_rad[shoulder] += 0.15;
    let bench = Bench::with(robot.clone(), "hold");
    // Gravity's torque on the joint, and its inertia, with the rest of the robot standing still.
    let at = |q: f64| {
        let mut posture = robot.home_posture();
        posture.q[shoulder] = q;
        let kinematics = Kinematics::at(&robot, &posture);
        let mut dynamics = Dynamics::new(&robot);
        dynamics.update(&robot, &kinematics, &DVector::zeros(6 + robot.joints.len()));
        (
            dynamics.bias()[6 + shoulder],
            dynamics.mass_matrix()[(6 + shoulder, 6 + shoulder)],
        )
    };
    let mut rest = robot.home_rad[shoulder];
    for _ in 0..20 {
        rest -= at(rest).0 / ((at(rest + 1e-4).0 - at(rest - 1e-4).0) / 2e-4);
    }
    let stiffness = (at(rest + 1e-4).0 - at(rest - 1e-4).0) / 2e-4;
    let amplitude = (robot.home_rad[shoulder] - rest).abs();
    // A swing of this amplitude takes longer by a sixteenth of its square.
    let law = TAU * (at(rest).1 / stiffness).sqrt() * (1.0 + amplitude * amplitude / 16.0);
    for engine in Engine::ALL {
        let mut home = bench.robot.home_command();
        home.tau_ff[shoulder] = 0.0;
        let mut plant = Plant::new(robot.clone(), clock(engine), None, home.clone());
        let (mut turns, mut before) = (Vec::new(), 0.0);
        while turns.len() < 5 {
            plant.advance(home.clone(), &[]);
            let (now, time_s) = (plant.truth().velocity[6 + shoulder], plant.truth().time_s);
            assert!(time_s < 20.0, "{engine:?}: it does not swing");
            if before * now < 0.0 {
                turns.push(time_s - 0.002 * now / (now - before));
            }
            before = now;
        }
        let period = (turns[4] - turns[0]) / 2.0;
        println!("{engine:?}: {period:.4} s, law {law:.4} s, amplitude {amplitude:.3} rad");
        assert!(
            (period / law - 1.0).abs() < 0.01,
            "{engine:?}: {period} s, law {law} s"
        );
    }
}

/// Impulse between recovery and fall, to 0.02 N s, by bisection between 1.5 and 5.5 N s.
fn toppling_impulse(bench: &Bench, engine: Engine, heading_deg: f64) -> f64 {
    let config = EpisodeConfig {
        engine,
        ..config(6.0)
    };
    let (mut stands, mut falls) = (1.5, 5.5);
    while falls - stands > 0.02 {
        let middle = 0.5 * (stands + falls);
        let disturbance = Disturbance {
            pushes: vec![push(middle, heading_deg)],
            ..Disturbance::default()
        };
        let record = episode::run(
            &bench.robot,
            &bench.factory,
            &config,
            disturbance,
            Until::Decided,
            &mut |_| {},
        )
        .unwrap();
        if record.outcome == Outcome::Recovered {
            stands = middle
        } else {
            falls = middle
        }
    }
    0.5 * (stands + falls)
}

#[test]
fn a_stiff_robot_topples_at_the_same_pushes() {
    standfast::leaves::add();
    let bench = Bench::new("hold");
    (0..16).into_par_iter().for_each(|k| {
        let heading_deg = 22.5 * f64::from(k);
        let [rapier, mujoco] =
            Engine::ALL.map(|engine| toppling_impulse(&bench, engine, heading_deg));
        println!("{heading_deg} degrees: {rapier:.2} and {mujoco:.2} N s");
        assert!(
            (mujoco / rapier - 1.0).abs() < 0.04,
            "{heading_deg} degrees: {rapier} and {mujoco} N s"
        );
    });
}

/// As in Rapier, the result is the same for any number of threads, even if all that a campaign can draw is varied.
#[test]
fn a_campaign_in_mujoco_is_the_same_bytes_for_any_number_of_threads() {
    let result = |threads: &str| {
        let dir = folder();
        let short = [
            "--set=episode.horizon_s=2.4",
            "--set=second_push.after_s={uniform=[0.1, 0.25]}",
        ];
        let run = [
            "run",
            "harsh",
            "--engine=mujoco",
            "--controller=catch",
            SEVERAL_PARTS,
            "--out=out",
            threads,
        ];
        standfast(dir.path(), &[&run[..], &short].concat()).success();
        files(&dir.path().join("out"))
    };
    let one = result("--threads=1");
    let manifest = String::from_utf8(one["parts/campaign.json"].clone()).unwrap();
    assert!(manifest.contains("MuJoCo 3."), "{manifest}");
    assert!(
        one == result("--threads=2"),
        "two threads wrote something else"
    );
}

/// The limits that one search finds in both engines equal those that each engine has alone.
#[test]
fn limits_stand_side_by_side() {
    let dir = folder();
    let limit = |engine: &str| {
        let options = [
            "limit",
            "--campaign=nominal",
            "--controller=hold",
            "--headings=2",
            "--precision=0.4",
            "--json",
        ];
        let rest = [format!("--engine={engine}"), format!("--out={engine}")];
        let arguments: Vec<&str> = options
            .into_iter()
            .chain(rest.iter().map(String::as_str))
            .collect();
        standfast(dir.path(), &arguments).success()
    };
    let read = |run: &Run| serde_json::from_str::<serde_json::Value>(&stdout(run)).unwrap();
    let first = limit("both");
    let both = read(&first);
    for (entrant, engine, name) in [(0, "rapier", "Rapier "), (1, "mujoco", "MuJoCo ")] {
        let alone = read(&limit(engine));
        assert_eq!(both["engines"][entrant], alone["engines"][0]);
        assert!(
            alone["engines"][0]["engine"]
                .as_str()
                .unwrap()
                .starts_with(name),
            "{alone}"
        );
        for heading in 0..2 {
            let mut expected = alone["headings"][heading]["controllers"][0].clone();
            expected["name"] = format!("hold@{engine}").into();
            let limits = &both["headings"][heading]["controllers"][entrant];
            assert_eq!(*limits, expected);
            let impulse_n_s = limits["impulse50_n_s"].as_f64().unwrap();
            assert!((2.2..3.1).contains(&impulse_n_s), "{name}: {impulse_n_s}");
        }
    }
    let written = files(&dir.path().join("both"));
    assert_eq!(written["limit.json"], stdout(&first).as_bytes());
    let picture = String::from_utf8(written["limit.svg"].clone()).unwrap();
    assert!(
        picture.contains("hold@rapier") && picture.contains("hold@mujoco"),
        "{picture}"
    );
    let again = limit("both");
    assert!(stdout(&again) == stdout(&first));
    assert!(stderr(&again).contains("nothing is computed again"));
}

/// A robot that only one engine takes is an error of the other engine, which the error names.
#[test]
fn a_robot_that_one_engine_refuses_is_an_error_that_names_the_engine() {
    let dir = folder();
    let assets = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/robots");
    let urdf = std::fs::read_to_string(assets.join("ut-mu2.urdf")).unwrap();
    // MuJoCo refuses a link with hardly any inertia. Rapier takes the link, since the rotor of its joint has an
    // inertia.
    let of_elbow = urdf.find("<link name=\"left_elbow_rotation\"").unwrap();
    let light = ["mass value", "ixx", "ixy", "ixz", "iyy", "iyz", "izz"]
        .into_iter()
        .fold(urdf.clone(), |urdf, name| {
            let first =
                of_elbow + urdf[of_elbow..].find(&format!("{name}=\"")).unwrap() + name.len() + 2;
            let end = first + urdf[first..].find('"').unwrap();
            let value = match name {
                "mass value" => "1e-9",
                "ixx" | "iyy" | "izz" => "3e-16",
                _ => "0",
            };
            format!("{}{value}{}", &urdf[..first], &urdf[end..])
        });
    std::fs::write(dir.path().join("odd.urdf"), light).unwrap();
    std::fs::copy(assets.join("ut-mu2.toml"), dir.path().join("odd.toml")).unwrap();
    let push = |engine: &str| {
        standfast(
            dir.path(),
            &[
                "push",
                "--robot=odd.urdf",
                "--controller=hold",
                "--set=episode.horizon_s=1",
                engine,
            ],
        )
    };
    push("--engine=rapier").success();
    let error = stderr(&push("--engine=mujoco").code(2));
    assert!(
        error.contains("MuJoCo does not take") && error.contains("--engine rapier"),
        "{error}"
    );
}
