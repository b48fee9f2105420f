//! `catch` in physics: footsteps that are planned anew while the foot is in the air. Sensors are ideal.

use crate::common::mirror::symmetric_robot;
use crate::common::{Bench, push};
use nalgebra::{Isometry2, Point2, Vector2};
use rayon::prelude::*;
use standfast_core::control::estimate::heading;
use standfast_core::robot::{Foot, LandingRegion, Pose};
use standfast_sim::Push;
use standfast_sim::episode::{Footstep, Outcome, Record, Tick, Until};
use standfast_study::limit::PendulumBounds;
use standfast_study::{Campaign, Overrides};
use std::sync::LazyLock;

/// Largest distance between the planned and the actual landing place of a foot (m).
const OFF_M: f64 = 0.005;
/// Load from which on the ground carries the robot (N).
const CARRIES_N: f64 = 5.0;
const HEADINGS: [f64; 8] = [0.0, 45.0, 90.0, 135.0, 180.0, 225.0, 270.0, 315.0];

/// Observations in an episode with footsteps.
#[derive(Debug, Default)]
struct Course {
    /// Offset at every landing from the centre of the stance sole to the centre of the landing sole, with y to the side
    /// of the swing foot (m).
    landings: Vec<Vector2<f64>>,
    /// Error of the estimated horizontal COM velocity (m/s) at every tick from the first lift on.
    wrong_m_s: Vec<f64>,
    flies: bool,
    in_air: Option<Foot>,
}

impl Course {
    fn watch(&mut self, tick: &Tick) {
        let now = tick.report.footstep.map(|footstep| footstep.foot);
        let from_stance = |foot: Foot| {
            let [swing, stance]: [&Pose; 2] = [foot, foot.other()].map(|f| &tick.truth.soles[f]);
            let frame = Isometry2::new(stance.translation.vector.xy(), heading(stance));
            let place = frame.inverse_transform_point(&swing.translation.vector.xy().into());
            Vector2::new(place.x, place.y * foot.side())
        };
        if now.is_some() || !self.landings.is_empty() {
            self.flies |= tick.truth.contact_force.z < CARRIES_N;
            self.wrong_m_s.push(
                (tick.report.com_vel.unwrap() - tick.truth.com_vel)
                    .xy()
                    .norm(),
            );
        }
        if let (Some(foot), true) = (self.in_air, self.in_air != now) {
            self.landings.push(from_stance(foot));
        }
        self.in_air = now;
    }

    /// Runs an episode until it is decided.
    fn of(bench: &Bench, push: Push) -> (Record, Self) {
        let mut course = Self::default();
        let record = bench.run(vec![push], None, 6.0, Until::Decided, |tick| {
            course.watch(tick)
        });
        (record, course)
    }
}

/// An episode with a push of 0.9 times the bound with one footstep.
struct Hard {
    push: Push,
    /// Whether the pendulum can take more with a footstep than without.
    steps: bool,
    record: Record,
    course: Course,
}

/// One hard push for each heading. They are simulated once for all tests of this file.
static HARD: LazyLock<Vec<Hard>> = LazyLock::new(|| {
    let bench = Bench::new("catch");
    // The bounds are for footsteps that do not cross, since `catch` takes no others.
    let mut robot = bench.robot.clone();
    robot.reach.truncate(1);
    let pendulum_bounds = PendulumBounds::new(
        &robot,
        &Campaign::load("nominal", &Overrides::default()).unwrap(),
    );
    assert!(
        (pendulum_bounds.push_duration_s - 0.05).abs() < 1e-5
            && pendulum_bounds.push_height_m == 0.0
    );
    let of = |heading_deg: &f64| {
        let bounds = pendulum_bounds.heading(*heading_deg);
        let push = push(0.9 * bounds.with_one_step_n_s(), *heading_deg);
        let (record, course) = Course::of(&bench, push);
        Hard {
            push,
            steps: bounds.with_one_step_n_s() > 1.01 * bounds.bound_no_step_n_s,
            record,
            course,
        }
    };
    HEADINGS.par_iter().with_max_len(1).map(of).collect()
});

#[test]
fn nine_tenths_of_what_the_pendulum_takes_with_one_footstep_is_caught_at_every_heading() {
    for Hard {
        push: Push {
            impulse_n_s,
            heading_deg,
            ..
        },
        record,
        ..
    } in HARD.iter()
    {
        let steps = record.footsteps.taken.len();
        println!(
            "{impulse_n_s:.2} N s at {heading_deg}: {:?}, {steps} footsteps",
            record.outcome
        );
    }
    for Hard {
        push,
        steps,
        record,
        ..
    } in HARD.iter()
    {
        assert_eq!(record.outcome, Outcome::Recovered, "{push:?}: {record:?}");
        assert!(record.footsteps.lifted.is_none(), "{push:?}: {record:?}");
        // Sideways the feet are apart, so the robot can take this push standing.
        assert_eq!(
            record.footsteps.taken.is_empty(),
            !steps,
            "{push:?}: {record:?}"
        );
    }
}

/// A foot that goes straight is aimed at up to these multiples of the reach of its landing region: forward and backward, and
/// to the side from home.
const BEYOND: [f64; 2] = [1.25, 3.0];
/// Distance of the feet at home (m).
const HOME_Y_M: f64 = 0.097;

/// After a push from the side and behind, the foot behind crosses the stance leg. Without a footstep, the robot would recover
/// from 4.4 N s at most.
#[test]
fn feet_land_in_their_regions_and_cross_where_that_helps() {
    let bench = Bench::new("catch");
    let mut regions = bench.robot.reach.clone();
    for region in regions.iter_mut().filter(|region| !region.crosses()) {
        region.x_m = region.x_m.map(|x| BEYOND[0] * x);
        region.y_m[1] = HOME_Y_M + BEYOND[1] * (region.y_m[1] - HOME_Y_M);
    }
    for heading in [120.0, -120.0] {
        let (record, course) = Course::of(&bench, push(5.0, heading));
        assert_eq!(
            record.outcome,
            Outcome::Recovered,
            "at {heading}: {record:?}"
        );
        assert!(
            course.landings[0].y < regions[0].y_m[0] - OFF_M,
            "at {heading} it crosses: {:?}",
            course.landings
        );
    }
    for Hard {
        push: Push { heading_deg, .. },
        record,
        course,
        ..
    } in HARD.iter()
    {
        println!(
            "at {heading_deg}: {:.4?}, met {:?}",
            course.landings, record.legs_met
        );
        assert!(
            record.legs_met.is_none(),
            "at {heading_deg}: {:?}",
            record.legs_met
        );
        // Planned places lie in a region. A foot that comes down early or late is off by a little more.
        if let Some(place) = course.landings.first() {
            let within =
                |[least, most]: [f64; 2], at: f64| (least - OFF_M..=most + OFF_M).contains(&at);
            let in_region =
                |region: &LandingRegion| within(region.x_m, place.x) && within(region.y_m, place.y);
            assert!(regions.iter().any(in_region), "at {heading_deg}: {place}");
        }
    }
}

/// The trunk's accelerometer gives the velocity also while a leg swings, in flight, and when a foot strikes the ground.
#[test]
fn the_velocity_of_the_com_is_known_in_the_swing_in_flight_and_at_landing() {
    let seen = HARD
        .iter()
        .filter(|hard| hard.steps)
        .map(|Hard { push, course, .. }| {
            let wrong = &course.wrong_m_s;
            let rms = (wrong.iter().map(|v| v * v).sum::<f64>() / wrong.len() as f64).sqrt();
            let worst = wrong.iter().copied().fold(0.0, f64::max);
            println!(
                "at {}: rms {rms:.4} m/s, worst {worst:.4} m/s, {} ticks",
                push.heading_deg,
                wrong.len()
            );
            (push.heading_deg, rms, worst, course.flies)
        });
    let seen = seen.collect::<Vec<_>>();
    assert!(seen.iter().any(|(.., flies)| *flies), "no flight is tested");
    for (heading, rms, worst, _) in seen {
        assert!(
            rms < 0.01 && worst < 0.06,
            "at {heading}: {rms}, at most {worst} m/s"
        );
    }
}

/// Standing, the robot recovers from at most 4.5 N s at these headings. A footstep with the swing time of its whole region
/// comes too late, and so does a foot that its leg is to bring back to its path at any price. With soles that stay flat where
/// an ankle is at its limit, the body is thrown up. With a swing leg whose joints are sent to an upright trunk, the foot lands
/// short (180 degrees), and with the reach of flat soles, too (22.5 and 180). From the side, feet have to land far out, or the
/// legs cross and meet (67.5 to 112.5). If a straight leg that is lifted raises the COM, the robot leaves the ground (20 and 30).
/// If a swing stands the trunk up at once, pushes from the side are lost (67.5 and 112.5), and if the swing leg follows 0.7 of
/// the trunk as it is, pushes from the front (135 and 157.5). A foot that hangs in the air must neither be drawn back to where
/// it stood, nor swing from there (157.5), nor go on hanging (112.5).
#[test]
fn quick_footsteps_catch_pushes_far_beyond_standing() {
    let bench = Bench::new("catch");
    let hard = [
        (20.0, [7.2, 7.6, 8.0]),
        (22.5, [10.0, 10.2, 10.4]),
        (30.0, [7.0, 7.2, 7.4]),
        (67.5, [8.2, 8.4, 8.8]),
        (67.5, [10.6, 11.0, 11.2]),
        (90.0, [7.8, 8.2, 8.6]),
        (112.5, [8.0, 8.4, 9.0]),
        (112.5, [9.2, 9.4, 9.6]),
        (135.0, [10.2, 10.6, 11.0]),
        (157.5, [10.2, 10.4, 10.6]),
        (180.0, [9.2, 9.4, 9.6]),
    ]
    .into_iter()
    .flat_map(|(heading, impulses)| impulses.map(|impulse| (impulse, heading)));
    let lost: Vec<(f64, f64)> = hard
        .par_bridge()
        .filter(|&(impulse, heading)| {
            bench.push(push(impulse, heading)).outcome != Outcome::Recovered
        })
        .collect();
    assert!(lost.is_empty(), "{lost:?} N s and degrees");
}

#[test]
fn where_standing_suffices_no_foot_is_lifted() {
    let bench = Bench::new("catch");
    [(2.0, 0.0), (2.0, 180.0), (3.0, 90.0), (0.0, 0.0)]
        .par_iter()
        .for_each(|&(impulse, heading)| {
            let record = bench.push(push(impulse, heading));
            assert_eq!(
                record.outcome,
                Outcome::Recovered,
                "{impulse} N s at {heading}: {record:?}"
            );
            assert!(
                record.footsteps.taken.is_empty(),
                "{impulse} N s at {heading}: {record:?}"
            );
        });
}

/// Left and right are alike. At 0 and 180 degrees either foot may go.
#[test]
fn a_mirrored_push_is_caught_by_the_mirrored_foot() {
    let bench = Bench::with(symmetric_robot(), "catch");
    [(4.2, 45.0), (4.2, 90.0), (4.2, 135.0)]
        .par_iter()
        .for_each(|&(impulse, heading)| {
            let [one, other] =
                [heading, -heading].map(|heading| bench.push(push(impulse, heading)));
            let (a, b) = (&one.footsteps.taken[0], &other.footsteps.taken[0]);
            let apart = |p: [f64; 3], q: [f64; 3]| (p[0] - q[0]).hypot(p[1] + q[1]);
            let from = apart(a.from_m, b.from_m);
            let to = apart(a.to_m, b.to_m);
            let land = (a.land_s - b.land_s).abs();
            println!(
                "{heading} degrees: {} foot, {from:.1e} m, {to:.1e} m, {land:.1e} s",
                a.foot.name()
            );
            assert_eq!(a.foot, b.foot.other(), "{heading} degrees");
            assert_eq!(a.lift_s, b.lift_s, "{heading} degrees");
            assert!(
                from < 1e-4 && to < 1e-3 && land < 0.005,
                "{heading} degrees: {a:?} {b:?}"
            );
            assert_eq!(one.outcome, other.outcome, "{heading} degrees");
        });
}

/// The landing place changes after the lift: after another push in the same direction with the foot in the air, the
/// foot lands farther along.
#[test]
fn a_second_push_while_the_foot_is_in_the_air_moves_its_landing_place_along() {
    let bench = Bench::new("catch");
    let first_footstep = |pushes: Vec<Push>| -> Footstep {
        bench
            .run(pushes, None, 1.2, Until::Fallen, |_| {})
            .footsteps
            .taken[0]
    };
    let first = push(3.4, 0.0);
    let alone = first_footstep(vec![first]);
    // The time is from the lift until shortly before the landing place is fixed.
    let again = |heading_deg| Push {
        impulse_n_s: 0.5,
        heading_deg,
        duration_s: 0.02,
        start_s: alone.lift_s,
        ..first
    };
    [0.0, 90.0, 180.0, -90.0].par_iter().for_each(|&heading| {
        let second = again(heading);
        let moved = first_footstep(vec![first, second]);
        assert_eq!(
            (moved.foot, moved.lift_s),
            (alone.foot, alone.lift_s),
            "the push comes after the lift"
        );
        let [a, b] = [alone.to_m, moved.to_m].map(|[x, y, _]| Point2::new(x, y));
        let along = (b - a).dot(&second.direction().xy());
        println!(
            "{} foot to {a:.4}, pushed at {heading} again to {b:.4}: {along:.4} m",
            alone.foot.name()
        );
        assert!(along > 0.005, "pushed at {heading} again: {a} {b}");
    });
}
