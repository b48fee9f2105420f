//! The variations of a campaign have the effect in the simulation that physics predicts, and no other.

use crate::common::{Bench, config, engine, push};
use nalgebra::Vector3;
use standfast_core::robot::{Foot, GRAVITY, Robot};
use standfast_core::socket::Command;
use standfast_sim::episode::{self, Disturbance, Record, Tick, Until};
use standfast_sim::{Ground, Plant, Push, Variation, plant::Clock};

const NONE: Push = Push {
    impulse_n_s: 0.0,
    heading_deg: 0.0,
    height_m: 0.0,
    duration_s: 0.05,
    start_s: 0.0,
    profile: standfast_sim::Profile::Rectangular,
    bob: None,
};

fn run(
    bench: &Bench,
    variation: Variation,
    push: Push,
    horizon_s: f64,
    mut see: impl FnMut(&Tick),
) -> Record {
    let disturbance = Disturbance {
        pushes: vec![push],
        variation,
        ..Disturbance::default()
    };
    episode::run(
        &bench.robot,
        &bench.factory,
        &config(horizon_s),
        disturbance,
        Until::Horizon,
        &mut see,
    )
    .unwrap()
}

/// Averages over the last 0.2 s of an episode without a push: force of the ground, and ZMP.
fn at_rest(bench: &Bench, variation: Variation) -> (Vector3<f64>, [f64; 2]) {
    let (mut force, mut zmp, mut ticks) = (Vector3::zeros(), [0.0; 2], 0.0);
    run(bench, variation, NONE, 2.0, |tick| {
        if tick.truth.time_s > 1.8 {
            force += tick.truth.contact_force;
            let now = tick.truth.zmp.unwrap();
            (zmp[0], zmp[1]) = (zmp[0] + now[0], zmp[1] + now[1]);
            ticks += 1.0;
        }
    });
    (force / ticks, zmp.map(|sum| sum / ticks))
}

/// Setting a quantity to its nominal value changes no bit.
#[test]
fn nominal_values_change_nothing() {
    let bench = Bench::new("paper");
    let (robot, one) = (&bench.robot, Some(1.0));
    let explicit = Variation {
        mass_scale: one,
        trunk_com_x_m: Some(0.0),
        trunk_com_y_m: Some(0.0),
        friction: Some(robot.friction),
        slope_deg: Some(0.0),
        slope_heading_deg: Some(30.0),
        ground_step_m: Some(0.0),
        kp_scale: one,
        kd_scale: one,
        torque_scale: one,
        speed_scale: one,
        rotor_scale: one,
        joint_friction_share: Some(0.0),
        joint_damping_share: Some(0.0),
        delay_s: Some(robot.delay_s),
    };
    let course = |variation| {
        let mut course = Vec::new();
        let record = run(&bench, variation, push(3.6, 20.0), 1.5, |tick| {
            course.extend(
                tick.truth
                    .posture
                    .q
                    .iter()
                    .chain(&tick.truth.tau)
                    .map(|v| v.to_bits()),
            );
        });
        (format!("{record:?}"), course)
    };
    assert!(course(explicit) == course(Variation::default()));
}

/// At rest the ground carries exactly m g.
#[test]
fn the_ground_carries_the_scaled_mass() {
    let bench = Bench::new("hold");
    for scale in [0.9, 1.0, 1.1] {
        let (force, _) = at_rest(
            &bench,
            Variation {
                mass_scale: Some(scale),
                ..Variation::default()
            },
        );
        let weight = scale * bench.robot.weight_n();
        assert!(
            (force - Vector3::z() * weight).norm() < 0.01 * weight,
            "{scale}: {force}"
        );
    }
    let scaled = Variation {
        mass_scale: Some(1.1),
        ..Variation::default()
    }
    .robot(&bench.robot);
    for (link, nominal) in scaled.links.iter().zip(&bench.robot.links) {
        assert!((link.inertia_kg_m2 - 1.1 * nominal.inertia_kg_m2).amax() < 1e-12);
    }
}

/// The COM moves by the trunk's share of the mass, and so does the ZMP at rest (sag adds to this).
#[test]
fn an_offset_of_the_trunk_moves_the_zmp_by_its_share() {
    let bench = Bench::new("hold");
    let share = bench.robot.links[bench.robot.trunk].mass_kg / bench.robot.mass();
    let (_, before) = at_rest(&bench, Variation::default());
    for offset in [-0.01, 0.01] {
        let (_, x) = at_rest(
            &bench,
            Variation {
                trunk_com_x_m: Some(offset),
                ..Variation::default()
            },
        );
        let (_, y) = at_rest(
            &bench,
            Variation {
                trunk_com_y_m: Some(offset),
                ..Variation::default()
            },
        );
        for (moved, other) in [
            (x[0] - before[0], x[1] - before[1]),
            (y[1] - before[1], y[0] - before[0]),
        ] {
            let ratio = moved / (share * offset);
            println!(
                "trunk {share:.3} of the mass, {offset} m: ZMP by {ratio:.3} of its share, {other:.5} m across"
            );
            assert!(
                (0.98..1.5).contains(&ratio) && other.abs() < 2e-4,
                "{ratio} {other}"
            );
        }
    }
}

/// Feet slip if they need more than mu times the load, and the ground never supplies more.
#[test]
fn feet_slip_beyond_the_friction() {
    let bench = Bench::new("hold");
    let slipped = |friction: f64| {
        let (mut far, mut most): (f64, f64) = (0.0, 0.0);
        let mut from = None;
        run(
            &bench,
            Variation {
                friction: Some(friction),
                ..Variation::default()
            },
            push(2.0, 0.0),
            1.0,
            |tick| {
                let truth = tick.truth;
                let sole = truth.soles[Foot::Left].translation.vector;
                far = far.max((sole - *from.get_or_insert(sole)).xy().norm());
                if truth.contact_force.z > 10.0 {
                    most = most.max(truth.contact_force.xy().norm() / truth.contact_force.z);
                }
            },
        );
        (far, most)
    };
    let ((slippery, used), (firm, needed)) = (slipped(0.1), slipped(0.8));
    println!("mu 0.1: {slippery:.4} m, {used:.3}; mu 0.8: {firm:.4} m, {needed:.3}");
    assert!(
        slippery > 0.01 && used < 0.105 && used > 0.09,
        "{slippery} m, {used}"
    );
    assert!(firm < 0.005 && needed > 0.2, "{firm} m, {needed}");
}

/// On a slope a part of the weight acts along the slope. The soles lie flat on it, and the robot stands still.
#[test]
fn a_slope_pulls_along_it_and_soles_lie_on_it() {
    for (gains, slope_deg) in [
        ("hold", 3.0),
        ("hold", -1.0),
        ("switching", 1.0),
        ("switching", -2.0),
    ] {
        let bench = Bench::new(gains);
        for heading_deg in [0.0_f64, 90.0] {
            let variation = Variation {
                slope_deg: Some(slope_deg),
                slope_heading_deg: Some(heading_deg),
                ..Variation::default()
            };
            let weight = bench.robot.weight_n();
            let (sin, cos) = heading_deg.to_radians().sin_cos();
            let mut seen = 0;
            let tilted_s = Ground::new(&bench.robot, &variation).tilting_s;
            let record = run(
                &bench,
                variation,
                Push {
                    start_s: tilted_s + 0.3,
                    ..NONE
                },
                2.0,
                |tick| {
                    let truth = tick.truth;
                    // The robot is at rest when a push may come, and then in balance.
                    let speed_m_s = truth.com_vel.norm();
                    assert!(
                        truth.time_s < tilted_s + 0.3 || speed_m_s < 0.02,
                        "{gains}, {slope_deg}: {speed_m_s} m/s"
                    );
                    if truth.time_s < tilted_s + 0.6 {
                        return;
                    }
                    seen += 1;
                    let slope = truth.ground.slope;
                    let along = (slope.inverse() * truth.contact_force)
                        .xy()
                        .dot(&nalgebra::Vector2::new(cos, sin));
                    let expected = weight * f64::to_radians(slope_deg).sin();
                    assert!(
                        (along - expected).abs() < 0.01 * weight,
                        "{gains}, {slope_deg}: {along} N, not {expected}"
                    );
                    for foot in Foot::BOTH {
                        let sole = &truth.soles[foot];
                        let apart = (sole.rotation * Vector3::z())
                            .angle(&(slope * Vector3::z()))
                            .to_degrees();
                        let above = sole.translation.z
                            - truth.ground.height_m(sole.translation.vector.xy().into());
                        assert!(
                            apart < 0.2 && above.abs() < 5e-4,
                            "{gains}, {slope_deg}: {apart} degrees, {above} m"
                        );
                    }
                },
            );
            assert!(
                seen > 300 && record.settled_at_s.is_some_and(|at| at < tilted_s + 0.4),
                "{gains} {slope_deg} {record:?}"
            );
        }
    }
}

/// m dv equals the impulse of ground, push and gravity, for any ground and robot.
#[test]
fn momentum_closes_on_every_ground() {
    let bench = Bench::new("paper");
    let base = Variation {
        mass_scale: Some(1.1),
        slope_heading_deg: Some(40.0),
        ..Variation::default()
    };
    for (slope_deg, step_m) in [(2.0, None), (-2.0, Some(0.01)), (0.0, Some(-0.01))] {
        let variation = Variation {
            slope_deg: Some(slope_deg),
            ground_step_m: step_m,
            ..base
        };
        let mass = 1.1 * bench.robot.mass();
        let (mut sum, mut worst): (Vector3<f64>, f64) = (Vector3::zeros(), 0.0);
        run(
            &bench,
            variation,
            Push {
                start_s: 1.0,
                ..push(3.0, 160.0)
            },
            1.6,
            |tick| {
                let truth = tick.truth;
                if truth.time_s > 0.0 {
                    sum += (truth.contact_force + truth.push_force - Vector3::z() * mass * GRAVITY)
                        * 0.002;
                }
                worst = worst.max((truth.com_vel * mass - sum).amax());
            },
        );
        println!("{slope_deg} degrees, step {step_m:?}: {worst:.4} N s");
        assert!(
            worst < 0.06,
            "{slope_deg} degrees, step {step_m:?}: {worst} N s"
        );
    }
}

/// Torque of a joint in each physics step after a command, at home.
fn torques(robot: &Robot, variation: Variation, change: impl Fn(&mut Command)) -> Vec<f64> {
    let varied = variation.robot(robot);
    let clock = Clock {
        engine: engine(),
        physics_step_s: 0.001,
        control_period_s: 0.001,
    };
    let home = robot.home_command();
    let mut plant = Plant::on(Ground::default(), varied.clone(), clock, None, home.clone());
    let mut command = home;
    change(&mut command);
    (0..10)
        .map(|_| {
            plant.advance(command.clone(), &[]);
            plant.truth().tau[ARM]
        })
        .collect()
}

/// Number of a joint that carries little.
const ARM: usize = 15;

/// The arm's servo shows the effect of stiffness, damping, torque limit and delay.
#[test]
fn servos_are_scaled_and_delayed() {
    let robot = standfast_robots::load("ut-mu2").unwrap();
    let servo = &robot.servos[ARM];
    let at_once = Variation {
        delay_s: Some(0.0),
        ..Variation::default()
    };
    let first = |variation, change: &dyn Fn(&mut Command)| {
        torques(&robot, variation, change)[0] - torques(&robot, variation, |_| ())[0]
    };
    for scale in [0.5, 1.0, 2.0] {
        // The rotor starts to move within the step, which reduces the torque.
        let stiff = first(
            Variation {
                kp_scale: Some(scale),
                ..at_once
            },
            &|c| c.q_ref[ARM] += 0.02,
        );
        assert!(
            (stiff / (scale * servo.kp * 0.02) - 1.0).abs() < 0.2,
            "kp x {scale}: {stiff} N m"
        );
        let damped = first(
            Variation {
                kd_scale: Some(scale),
                ..at_once
            },
            &|c| c.dq_ref[ARM] += 0.5,
        );
        assert!(
            (damped / (scale * servo.kd * 0.5) - 1.0).abs() < 0.3,
            "kd x {scale}: {damped} N m"
        );
        let most = torques(
            &robot,
            Variation {
                torque_scale: Some(scale),
                ..at_once
            },
            |c| c.q_ref[ARM] += 5.0,
        )[0];
        assert!(
            (most - scale * servo.torque_n_m).abs() < 1e-6,
            "torque x {scale}: {most} N m"
        );
    }
    for delay_s in [0.0, 0.002, 0.006] {
        let variation = Variation {
            delay_s: Some(delay_s),
            ..Variation::default()
        };
        let (asked, rest) = (
            torques(&robot, variation, |c| c.q_ref[ARM] += 0.02),
            torques(&robot, variation, |_| ()),
        );
        let arrives = (0..10).find(|&k| asked[k] != rest[k]).unwrap();
        assert_eq!(arrives, (delay_s / 0.001_f64).round() as usize);
    }
    // A motor that turns half as fast has half of its torque left at three quarters of that speed.
    let slow = Variation {
        speed_scale: Some(0.5),
        ..Variation::default()
    }
    .robot(&robot)
    .servos[ARM];
    let left =
        slow.available_torque(0.25 * (servo.full_torque_speed_rad_s + servo.no_torque_speed_rad_s));
    assert!((left - 0.5 * servo.torque_n_m).abs() < 1e-12);
}

/// Friction and damping are added to those of the robot, in shares of its motors as designed.
#[test]
fn friction_and_damping_are_shares_of_the_designed_motor() {
    let mut robot = standfast_robots::load("ut-mu2").unwrap();
    robot.servos[ARM].friction_n_m = 0.5;
    robot.servos[ARM].damping_n_m_s_rad = 0.25;
    let designed = robot.servos[ARM];
    let varied = Variation {
        joint_friction_share: Some(0.1),
        joint_damping_share: Some(0.2),
        torque_scale: Some(0.5),
        speed_scale: Some(2.0),
        ..Variation::default()
    };
    let servo = varied.robot(&robot).servos[ARM];
    let most = designed.torque_n_m;
    assert!((servo.friction_n_m - (0.5 + 0.1 * most)).abs() < 1e-12);
    // At the speed at which the motor has no torque, this damping takes a fifth of its limit.
    let taken = (servo.damping_n_m_s_rad - 0.25) * designed.no_torque_speed_rad_s;
    assert!((taken - 0.2 * most).abs() < 1e-12);
}

/// After a hard push the torques reach the limit of the weaker motors, and do not exceed it.
#[test]
fn torque_saturates_at_the_scaled_limit() {
    let bench = Bench::new("switching");
    for (scale, limited) in [(0.5, true), (3.0, false)] {
        let variation = Variation {
            torque_scale: Some(scale),
            ..Variation::default()
        };
        let record = run(&bench, variation, push(3.0, 0.0), 1.2, |_| {});
        println!(
            "{scale}: {} N m, {} of the limit",
            record.peak_torque_n_m, record.peak_torque_ratio
        );
        assert_eq!(record.peak_torque_ratio > 0.999, limited);
        assert!(record.peak_torque_n_m < 1.05 * scale * 8.0);
    }
}

/// A sole slides if the ground does not hold it, even if the sole is tilted. If the ground holds, a sole that rolls
/// over its edge or is set down at another place has not slid.
#[test]
fn soles_slip_where_the_ground_is_slippery() {
    for gains in ["hold", "catch"] {
        let bench = Bench::new(gains);
        for heading_deg in [0.0, 90.0] {
            let slip_m = |friction| {
                let variation = Variation {
                    friction: Some(friction),
                    ..Variation::default()
                };
                run(&bench, variation, push(4.0, heading_deg), 1.2, |_| {}).peak_slip_m
            };
            let (slippery, firm) = (slip_m(0.15), slip_m(1.0));
            println!("{gains}, {heading_deg}: {slippery:.4} m on friction 0.15, {firm:.4} m on 1");
            // `catch` slides less far, since it lifts a foot then, and for a short time.
            let far_m = if gains == "hold" { 0.03 } else { 0.01 };
            assert!(
                slippery > far_m && firm < 0.002,
                "{gains}, {heading_deg}: {slippery} m, {firm} m"
            );
        }
    }
}

/// Weak motors are at their limit for longer under a push that both catch, and a gentle push leaves them below it. Their
/// torques after the robot has tilted over belong to the fall.
#[test]
fn time_at_the_torque_limit_counts_while_upright() {
    let bench = Bench::new("catch");
    let mut limited = Vec::new();
    // Which of two falls takes longer is nearly chance.
    for (scale, impulse_n_s, falls) in [
        (1.0, 1.0, false),
        (1.0, 3.5, false),
        (0.6, 3.5, false),
        (1.0, 12.0, true),
    ] {
        let variation = Variation {
            torque_scale: Some(scale),
            ..Variation::default()
        };
        let servos = variation.robot(&bench.robot).servos;
        let mut at_limit = Vec::new();
        let record = run(&bench, variation, push(impulse_n_s, 90.0), 1.6, |tick| {
            let truth = tick.truth;
            if truth
                .tau
                .iter()
                .zip(&servos)
                .any(|(tau, servo)| tau.abs() >= 0.999 * servo.torque_n_m)
            {
                at_limit.push((truth.time_s, truth.tilt_rad().to_degrees()));
            }
        });
        at_limit.retain(|(time_s, _)| {
            record
                .fell_at_s
                .is_none_or(|fell_at_s| *time_s <= fell_at_s)
        });
        let upright = at_limit
            .iter()
            .filter(|(_, tilt_deg)| *tilt_deg <= 10.0)
            .count();
        let (upright_s, tilted_s) = (
            0.002 * upright as f64,
            0.002 * (at_limit.len() - upright) as f64,
        );
        let limited_s = record.torque_limited_s;
        println!(
            "x {scale}, {impulse_n_s} N s: {limited_s:.3} s; tilted {tilted_s:.3} s; {:?}",
            record.outcome
        );
        assert!(
            (limited_s - upright_s).abs() < 1e-9,
            "{limited_s} s, seen {upright_s} s"
        );
        // A few ticks count. In Rapier it is 40 ms and more, in MuJoCo it may be less.
        assert!(
            record.fell_at_s.is_some() == falls && (tilted_s > 0.002) == falls,
            "{tilted_s} s"
        );
        limited.push(limited_s);
    }
    assert!(
        limited[0] == 0.0 && limited[2] > limited[1] + 0.01 && limited[3] > 0.02,
        "{limited:?}"
    );
}

/// A foot lands earlier if the ground is higher, and later if it is lower.
#[test]
fn a_step_of_the_ground_makes_a_foot_land_early_or_late() {
    let bench = Bench::new("paper");
    let lands_s = |ground_step_m| {
        let variation = Variation {
            ground_step_m,
            ..Variation::default()
        };
        let record = run(&bench, variation, push(3.6, 0.0), 1.5, |_| {});
        let first = record.footsteps.taken[0];
        println!("{ground_step_m:?}: {first:?}");
        first.land_s - first.lift_s
    };
    let (higher, level, lower) = (lands_s(Some(0.01)), lands_s(None), lands_s(Some(-0.01)));
    assert!(
        higher < level - 0.003 && lower > level + 0.003,
        "{higher} {level} {lower}"
    );
}

/// A second push is added to the first, and the referee waits for it.
#[test]
fn the_judge_waits_for_the_last_push() {
    let bench = Bench::new("switching");
    let later = Push {
        start_s: 2.5,
        ..push(1.0, 90.0)
    };
    let mut sum = Vector3::zeros();
    let record = bench.run(
        vec![push(1.0, 0.0), later],
        None,
        6.0,
        Until::Decided,
        |tick| {
            sum += tick.truth.push_force * 0.002;
        },
    );
    assert!((sum - Vector3::new(1.0, 1.0, 0.0)).norm() < 1e-6, "{sum}");
    assert!(
        record.settled_at_s.is_some_and(|at| at >= later.end_s()),
        "{record:?}"
    );
}
