//! Footsteps in physics, after pushes that standing cannot take (paper, Sect. V and VI). Sensors are ideal.
//!
//! How far a controller steps is a matter of tuning, so these tests have their own rules.

use crate::common::mirror::symmetric_robot;
use crate::common::{Bench, account, push};
use nalgebra::{Point2, Vector2};
use rayon::prelude::*;
use standfast_core::control::FootworkRules;
use standfast_core::lipm::stepping::{LandingRange, RelaxationWeights, Stepping};
use standfast_core::robot::{Foot, Robot};
use standfast_sim::episode::{Footstep, Outcome, Record, Until};

const RULES: Stepping = Stepping {
    patience_s: 0.02,
    alpha: 60.0,
    range: LandingRange {
        forward_m: 0.13,
        outward_m: 0.18,
        least_m: 0.075,
    },
    swing_time_s: 0.18,
    lift_m: 0.02,
    lambda: 5.0,
    weights: RelaxationWeights {
        dcm: 1.0,
        com: 1.0,
        zmp: 0.01,
    },
    late_s: 0.12,
    pause_s: 0.03,
    same_foot_pause_s: 0.3,
};

/// The controller `paper` with the rules of these tests.
fn stepping(robot: Robot) -> Bench {
    with_rules(robot, RULES)
}

fn with_rules(robot: Robot, rules: Stepping) -> Bench {
    let mut design = Bench::with(robot.clone(), "paper").design().clone();
    design.footwork = Some(FootworkRules::Stepping(rules));
    Bench::with_design(robot, design)
}

fn ut_mu2() -> Robot {
    standfast_robots::load("ut-mu2").unwrap()
}

/// Horizontal displacement of a foot.
fn way(footstep: &Footstep) -> Vector2<f64> {
    let [[x0, y0, _], [x1, y1, _]] = [footstep.from_m, footstep.to_m];
    Vector2::new(x1 - x0, y1 - y0)
}

/// The first footstep after a push goes where the robot is driven; sideways, with the foot of that side.
#[test]
fn the_first_footstep_goes_where_the_robot_is_driven() {
    let bench = stepping(ut_mu2());
    let cases = [
        (3.0, 0.0, None),
        (3.0, 180.0, None),
        (4.0, 45.0, Some(Foot::Left)),
        (4.0, -45.0, Some(Foot::Right)),
        (3.7, 135.0, Some(Foot::Left)),
        // Pushed from diagonally forward left (Sect. VI), the right foot goes diagonally back to the right.
        (3.7, -135.0, Some(Foot::Right)),
        (4.4, 90.0, Some(Foot::Left)),
        (4.4, -90.0, Some(Foot::Right)),
    ];
    cases.par_iter().for_each(|&(impulse, heading, foot)| {
        let record = bench.push(push(impulse, heading));
        let first = record
            .footsteps
            .taken
            .first()
            .unwrap_or_else(|| panic!("no footstep at {heading} degrees: {record:?}"));
        let (driven, way, error) = (
            push(1.0, heading).direction().xy(),
            way(first),
            first.zmp_error_m.unwrap(),
        );
        let shown = format!(
            "at {heading} degrees: {} foot by {:.3?} for {error:.4?}",
            first.foot.name(),
            way.as_slice()
        );
        println!("{shown}");
        assert!(foot.is_none_or(|foot| foot == first.foot), "{shown}");
        for axis in 0..2 {
            if driven[axis].abs() < 0.2 {
                assert!(way[axis].abs() < 0.02, "{shown}");
            } else {
                assert!(
                    way[axis] * driven[axis] > 0.01 && error[axis] * driven[axis] > 0.0,
                    "{shown}"
                );
            }
        }
    });
}

/// Pushes that topple the robot without a footstep. (At 2.6 N s forward and backward, `fixed` and `switching` are
/// lost.)
#[test]
fn a_footstep_takes_pushes_that_standing_cannot() {
    let (steps, fixed, switching) = (
        stepping(ut_mu2()),
        Bench::new("fixed"),
        Bench::new("switching"),
    );
    let pushes = [
        (2.8, 0.0),
        (3.2, 0.0),
        (3.6, 0.0),
        (2.8, 180.0),
        (3.2, 180.0),
        (3.6, 180.0),
    ];
    pushes.par_iter().for_each(|&(impulse, heading)| {
        let record = steps.push(push(impulse, heading));
        assert_eq!(
            record.outcome,
            Outcome::Recovered,
            "{impulse} N s at {heading}: {record:?}"
        );
        assert!(!record.footsteps.taken.is_empty() && record.footsteps.lifted.is_none());
        assert!(
            record
                .footsteps
                .taken
                .last()
                .unwrap()
                .in_set_at_landing
                .unwrap(),
            "{record:?}"
        );
        for standing in [&fixed, &switching] {
            let record = standing.push(push(impulse, heading));
            assert_eq!(
                record.outcome,
                Outcome::Fell,
                "{impulse} N s at {heading}, standing"
            );
            assert!(record.footsteps.taken.is_empty() && record.footsteps.lifted.is_none());
        }
    });
}

#[test]
fn where_standing_suffices_there_is_no_footstep() {
    let bench = stepping(ut_mu2());
    [
        (2.0, 0.0),
        (2.0, 180.0),
        (3.0, 90.0),
        (2.5, -45.0),
        (0.0, 0.0),
    ]
    .par_iter()
    .for_each(|&(impulse, heading)| {
        let record = bench.push(push(impulse, heading));
        assert_eq!(record.outcome, Outcome::Recovered);
        assert!(
            record.footsteps.taken.is_empty(),
            "{impulse} N s at {heading}: {record:?}"
        );
    });
}

/// Left and right are alike: the first footstep starts within 0.03 mm of the mirrored footstep, at the same tick, and
/// lands within 0.3 mm of it. (The rest is due to f32 in Rapier and to the order in which Rapier visits contacts.)
#[test]
fn mirrored_pushes_have_mirrored_footsteps() {
    let bench = stepping(symmetric_robot());
    [(3.9, 45.0), (3.6, 150.0), (3.7, 135.0), (4.4, 90.0)]
        .par_iter()
        .for_each(|&(impulse, heading)| {
            let [one, other] =
                [heading, -heading].map(|heading| bench.push(push(impulse, heading)));
            let (a, b) = (&one.footsteps.taken[0], &other.footsteps.taken[0]);
            let apart = |p: [f64; 3], q: [f64; 3]| (p[0] - q[0]).hypot(p[1] + q[1]);
            let (from, to) = (apart(a.from_m, b.from_m), apart(a.to_m, b.to_m));
            let land = (a.land_s - b.land_s).abs();
            println!(
                "{heading} degrees: {from:.1e} m, {to:.1e} m, {land:.1e} s; {} footsteps",
                one.footsteps.taken.len()
            );
            assert_eq!(a.foot, b.foot.other());
            assert_eq!(a.lift_s, b.lift_s);
            assert!(
                from < 1e-4 && to < 1e-3 && land < 0.005,
                "{heading} degrees: {a:?} {b:?}"
            );
            assert_eq!(one.outcome, other.outcome, "{heading} degrees");
            // After a fall the courses are no longer alike.
            if one.outcome == Outcome::Recovered {
                assert_eq!(
                    one.footsteps.taken.len(),
                    other.footsteps.taken.len(),
                    "{heading} degrees"
                );
            }
        });
}

/// A foot is lifted, to the tick, when the state has been in no CPI set for the time that the controller waits.
#[test]
fn a_footstep_waits_for_as_long_as_it_is_told_to() {
    for patience_s in [0.0, 0.01, 0.02] {
        let bench = with_rules(
            ut_mu2(),
            Stepping {
                patience_s,
                ..RULES
            },
        );
        let record = bench.push(push(3.4, 0.0));
        let waited = record.footsteps.taken[0].lift_s - record.totals.0["left_sets_at_s"];
        assert!(
            (waited - patience_s).abs() < 1e-9,
            "{waited} s for {patience_s} s"
        );
    }
}

#[test]
fn an_episode_with_footsteps_repeats_to_the_bit() {
    let bench = stepping(ut_mu2());
    let records: Vec<Record> = (0..4)
        .into_par_iter()
        .map(|_| bench.run(vec![push(3.4, 170.0)], None, 2.0, Until::Horizon, |_| {}))
        .collect();
    assert!(!records[0].footsteps.taken.is_empty());
    // Compared as text, in which NaN equals NaN.
    let texts: Vec<String> = records.iter().map(|record| format!("{record:?}")).collect();
    assert!(texts.iter().all(|text| *text == texts[0]), "{texts:#?}");
}

/// The footsteps in the record are the footsteps that were observed.
#[test]
fn footsteps_in_the_record_follow_one_another() {
    let bench = stepping(ut_mu2());
    [
        (3.2, 0.0),
        (3.6, 180.0),
        (4.0, 45.0),
        (3.7, -135.0),
        (4.4, 180.0),
        (4.8, 0.0),
    ]
    .par_iter()
    .for_each(|&(impulse, heading)| {
        let mut in_air = Vec::new();
        let mut before = None;
        let record = bench.run(
            vec![push(impulse, heading)],
            None,
            3.0,
            Until::Fallen,
            |tick| {
                let foot = tick.report.footstep.map(|footstep| footstep.foot);
                if let (Some(foot), false) = (foot, before == foot) {
                    in_air.push((foot, tick.truth.time_s));
                }
                before = foot;
            },
        );
        let feet: Vec<_> = record
            .footsteps
            .taken
            .iter()
            .map(|f| (f.foot, f.lift_s))
            .collect();
        let seen = in_air.len().min(feet.len());
        assert!(seen > 0 && feet == in_air[..seen], "{feet:?} {in_air:?}");
        // A foot that is still in the air at the end has not landed.
        assert_eq!(
            in_air.len() - feet.len(),
            usize::from(record.footsteps.lifted.is_some()),
            "{record:?}"
        );
        let longest = RULES.swing_time_s + RULES.late_s + 0.01;
        for (k, footstep) in record.footsteps.taken.iter().enumerate() {
            let duration = footstep.land_s - footstep.lift_s;
            assert!(
                duration > 0.5 * RULES.swing_time_s && duration < longest,
                "{footstep:?}"
            );
            let stood = record.footsteps.taken[..k]
                .iter()
                .rev()
                .find(|earlier| earlier.foot == footstep.foot);
            if let Some(earlier) = stood {
                let slip = Point2::new(
                    earlier.to_m[0] - footstep.from_m[0],
                    earlier.to_m[1] - footstep.from_m[1],
                );
                println!(
                    "{impulse} N s, {heading} degrees: slipped by {:.1e} m",
                    slip.coords.norm()
                );
                let limit = if record.outcome == Outcome::Recovered {
                    0.05
                } else {
                    f64::INFINITY
                };
                assert!(slip.coords.norm() < limit, "{earlier:?} {footstep:?}");
            }
            if k > 0 {
                let pause = footstep.lift_s - record.footsteps.taken[k - 1].land_s;
                assert!(pause >= RULES.pause_s - 1e-9, "{record:?}");
            }
        }
    });
}

/// Fig. 4: "After the foot landing, the control coordinate is reset as its origin is located at the center point of
/// both feet".
#[test]
fn after_the_landing_the_control_frame_is_midway_between_the_soles() {
    let bench = stepping(ut_mu2());
    let (mut worst, mut before, mut after_landing) = (0.0_f64, false, 0);
    let record = bench.run(vec![push(3.2, 0.0)], None, 3.0, Until::Fallen, |tick| {
        let (truth, support, swings) = (
            tick.truth,
            account(tick).support(),
            tick.report.footstep.is_some(),
        );
        let middle =
            0.5 * (truth.soles.left.translation.vector + truth.soles.right.translation.vector).xy();
        let away = (support.frame.translation.vector - middle).norm();
        if before && !swings {
            after_landing += 1;
            println!(
                "at the landing the frame is {away:.1e} m from the middle, {:.3?}",
                support.frame.translation
            );
        }
        if after_landing > 0 && !swings {
            worst = worst.max(away);
        }
        before = swings;
    });
    assert_eq!(record.outcome, Outcome::Recovered);
    assert_eq!(after_landing, record.footsteps.taken.len());
    assert!(
        after_landing > 0 && worst < 0.01,
        "{worst} m from the middle"
    );
    // The middle has moved by half of the strides.
    let moved: f64 = record
        .footsteps
        .taken
        .iter()
        .map(|footstep| 0.5 * way(footstep).x)
        .sum();
    assert!(moved > 0.03, "{record:?}");
}
