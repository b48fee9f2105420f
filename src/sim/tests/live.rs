//! A closed loop that is changed while it runs: pulls at a link, and switches of the controller.

use crate::common::{Bench, account, config, push, ticked};
use nalgebra::{Point3, Vector3};
use rayon::prelude::*;
use standfast_core::geometry::SupportPolygon;
use standfast_sim::episode::{ClosedLoop, Disturbance, EpisodeConfig, Film, Tick, Until};
use standfast_sim::{Pull, Variation};
use std::sync::LazyLock;

static CONFIG: LazyLock<EpisodeConfig> = LazyLock::new(|| config(6.0));

fn closed_loop(bench: &Bench) -> ClosedLoop<'_> {
    let closed_loop = ClosedLoop::new(
        &bench.robot,
        [&bench.factory],
        &CONFIG,
        Disturbance::default(),
    );
    closed_loop.until(Until::Horizon, 0.0)
}

fn switch(live: &mut ClosedLoop, to: &Bench) {
    for controller in live.controllers() {
        standfast_controllers::replace(controller, &to.factory, 0);
    }
}

/// A pull at the trunk where a push acts, with the same force and duration, has the same effect.
#[test]
fn a_pull_is_a_push_by_hand() {
    let bench = Bench::new("hold");
    let (trunk, home) = (bench.robot.trunk, bench.robot.home_posture());
    let kinematics = standfast_core::robot::Kinematics::at(&bench.robot, &home);
    let point = kinematics.link_pose(trunk).inverse() * kinematics.com();
    let (mut pushed, mut pulled) = (closed_loop(&bench), closed_loop(&bench));
    pushed.push(push(2.0, 30.0));
    let force = push(2.0, 30.0).direction() * 2.0 / 0.05;
    let mut farthest = 0.0_f64;
    for k in 0..500 {
        let [a, b] = [&mut pushed, &mut pulled].map(|live| ticked(live, |tick| tick.truth.clone()));
        assert!(
            (a.com - b.com).norm() < 1e-4,
            "tick {k}: {} {}",
            a.com,
            b.com
        );
        let was_on = (251..=275).contains(&k);
        let [f, g] = [a.push_force, b.push_force];
        assert!(
            (f - g).norm() < 1e-9 && (f.norm() > 0.0) == was_on,
            "tick {k}: {f} {g}"
        );
        farthest = farthest.max(a.com.x);
        let is_on = (250..275).contains(&k);
        pulled.pull(is_on.then_some(Pull {
            link: trunk,
            point,
            force,
        }));
        pushed.advance();
        pulled.advance();
    }
    assert!(farthest > 0.01, "the COM moved by {farthest} m");
}

/// A pull acts at its link and point: at a hand it turns the robot, and at the trunk it does not.
#[test]
fn a_pull_acts_at_its_link_and_point() {
    let bench = Bench::new("hold");
    let yaw = |link: &str| {
        let index = bench
            .robot
            .links
            .iter()
            .position(|named| named.name.contains(link))
            .unwrap();
        let mut live = closed_loop(&bench);
        for _ in 0..150 {
            ticked(&mut live, |_| ());
            live.pull(Some(Pull {
                link: index,
                point: Point3::origin(),
                force: Vector3::new(8.0, 0.0, 0.0),
            }));
            live.advance();
        }
        ticked(&mut live, |tick| tick.truth.trunk.rotation.euler_angles().2)
    };
    let [left, right] = [yaw("left_elbow"), yaw("right_elbow")];
    assert!(left < -1e-4 && right > 1e-4, "{left} {right}");
}

/// Another controller can take over in any phase, and a robot that was safe stays safe.
#[test]
fn gain_sets_can_be_switched_at_any_time() {
    let benches = ["hold", "switching", "paper", "catch"].map(Bench::new);
    let pairs: Vec<(&Bench, &Bench)> = benches
        .iter()
        .flat_map(|from| benches.iter().map(move |to| (from, to)))
        .collect();
    pairs
        .into_par_iter()
        .filter(|(from, to)| !std::ptr::eq(*from, *to))
        .for_each(|(from, to)| {
            for switch_at in [100, 262, 330] {
                let mut live = closed_loop(from);
                // The robot survives this push with each controller.
                live.push(push(1.5, 150.0));
                for k in 0..1000 {
                    if k == switch_at {
                        switch(&mut live, to);
                    }
                    assert!(ticked(&mut live, |tick| tick.truth.is_finite()));
                    live.advance();
                }
                let (name, to) = (&from.factory.name, &to.factory.name);
                assert!(ticked(&mut live, stands), "{name} to {to} at {switch_at}");
            }
        });
}

/// The rule that lifted a foot leads it to its landing, even if a gain set without footsteps takes over.
#[test]
fn a_footstep_is_finished_by_the_rule_that_began_it() {
    let [catch, switching] = ["catch", "switching"].map(Bench::new);
    let mut live = closed_loop(&catch);
    live.push(push(5.0, 0.0));
    let mut lifted_at = None;
    for k in 0..400 {
        let (footstep, in_contact, is_finite) = ticked(&mut live, |tick| {
            (
                tick.report.footstep,
                account(tick).estimate.in_contact,
                tick.truth.is_finite(),
            )
        });
        assert!(is_finite);
        match (footstep, lifted_at) {
            (Some(_), None) => {
                switch(&mut live, &switching);
                lifted_at = Some(k);
            }
            // A footstep of `catch` takes 0.14 s, 70 ticks.
            (None, Some(at)) => {
                assert!(
                    k > at + 35 && in_contact.left && in_contact.right,
                    "{k} {at} {in_contact:?}"
                );
                return;
            }
            _ => {}
        }
        live.advance();
    }
    panic!("no foot was lifted, or none landed");
}

/// The foot in the air lands first, and then the new gain set acts.
#[test]
fn gain_sets_can_be_switched_with_a_foot_in_the_air() {
    let benches = ["hold", "switching", "paper", "catch"].map(Bench::new);
    for from in &benches[2..] {
        for to in &benches {
            let mut live = closed_loop(from);
            live.push(push(3.6, -20.0));
            let (mut switched_at, mut has_landed) = (None, false);
            for k in 0..600 {
                let (in_air, is_finite) = ticked(&mut live, |tick| {
                    (tick.report.footstep.is_some(), tick.truth.is_finite())
                });
                assert!(is_finite);
                has_landed |= switched_at.is_some() && !in_air;
                if in_air && switched_at.is_none() {
                    switched_at = Some(k);
                    switch(&mut live, to);
                }
                live.advance();
            }
            let (name, new) = (&from.factory.name, &to.factory.name);
            assert!(switched_at.is_some(), "{name} has lifted no foot");
            let (phase, stands) = ticked(&mut live, |tick| {
                (tick.report.phase.to_string(), stands(tick))
            });
            match new.as_str() {
                // A controller of another kind does not know that a foot is in the air.
                "hold" => assert_eq!(phase, "posture", "{name} to {new}"),
                "switching" => assert!(!phase.starts_with("swing"), "{name} to {new}: {phase:?}"),
                // Finishing the footstep of another gain set is not always enough to stand; with catching it is.
                "catch" => assert!(
                    !phase.starts_with("swing") && stands,
                    "{name} to {new}: {phase:?}"
                ),
                _ => assert!(has_landed, "{name} to {new}: the foot is in the air"),
            }
        }
    }
}

fn stands(tick: &Tick) -> bool {
    tick.truth.tilt_rad() < 0.05 && tick.dcm_outside_m < 0.0
}

/// The controller's intentions are shown at the true place of the robot, even after its feet have slipped unnoticed.
#[test]
fn a_snapshot_is_all_in_one_world() {
    let bench = Bench::new("catch");
    // On slippery ground the feet slide, which no sensor measures.
    let variation = Variation {
        friction: Some(0.15),
        ..Variation::default()
    };
    let disturbance = Disturbance {
        pushes: vec![push(4.0, 0.0)],
        variation,
        ..Disturbance::default()
    };
    let how_long = (Until::Decided, 0.0);
    let mut drift_m = 0.0_f64;
    let film = Film::take(
        &bench.robot,
        &bench.factory,
        &config(6.0),
        disturbance,
        how_long,
        &mut |tick| drift_m = (tick.truth.com - tick.report.com.unwrap()).xy().norm(),
    )
    .unwrap();
    let last = film.snapshots.last().unwrap();
    assert!(
        drift_m > 0.008,
        "the estimate is only {drift_m} m off: the test has nothing to see"
    );
    let zmp = last.zmp.unwrap();
    assert!(
        (zmp - last.zmp_ref.unwrap()).norm() < 0.004,
        "at rest the ZMP is at {zmp}, and wanted at {:?}",
        last.zmp_ref
    );
    // The COM lies inside of the slice of the acting gain's CPI set, as its margin says.
    assert!(last.margin.unwrap() > 0.8);
    let acting = last
        .regions
        .iter()
        .find(|region| Some(&region.name) == last.gain.as_ref())
        .unwrap();
    let slice = SupportPolygon::hull(&acting.corners).unwrap();
    assert!(
        slice.signed_distance(last.com.xy()) < -0.01,
        "{slice:?} {}",
        last.com
    );
}

/// A film continues after the end of the episode, and its record does not.
#[test]
fn a_film_shows_the_fall_and_its_record_ends_with_the_episode() {
    let bench = Bench::new("hold");
    let record = bench.push(push(4.0, 180.0));
    let disturbance = Disturbance {
        pushes: vec![push(4.0, 180.0)],
        ..Disturbance::default()
    };
    let mut seen = 0;
    let how_long = (Until::Decided, 0.5);
    let film = Film::take(
        &bench.robot,
        &bench.factory,
        &config(6.0),
        disturbance,
        how_long,
        &mut |tick| seen += usize::from(!tick.is_after),
    )
    .unwrap();
    assert_eq!(format!("{:?}", film.record), format!("{record:?}"));
    let fell_at_s = record.fell_at_s.unwrap();
    assert_eq!(seen, (fell_at_s / 0.002).round() as usize + 1);
    let last = film.snapshots.last().unwrap();
    assert!(
        (last.time_s - fell_at_s - 0.5).abs() < 0.0021,
        "{} {fell_at_s}",
        last.time_s
    );
    assert!(
        last.com.z < 0.6 * film.snapshots[0].com.z,
        "it lies on the ground"
    );
    let pushed: Vec<f64> = film
        .snapshots
        .iter()
        .filter(|s| s.push.is_some())
        .map(|s| s.time_s)
        .collect();
    assert_eq!(pushed.len(), 25, "{pushed:?}");
    assert_eq!(film.cut_at(1.0).snapshots.len(), 501);
}
