//! The claims in the captions of `standfast-paper page` about its runs, measured again from their ticks.

use super::{in_words, numbers, tells};
use crate::common::{Bench, config};
use nalgebra::{Point2, Vector2, Vector3};
use serde_json::{Value, json};
use standfast::core::control::home_polygon;
use standfast::core::geometry::SupportPolygon;
use standfast::core::lipm::cpi_set::CpiSet;
use standfast::core::lipm::pendulum::State;
use standfast::core::robot::{Foot, PerFoot};
use standfast::sim::Push;
use standfast::sim::episode::snapshot::to_world;
use standfast::sim::episode::{Record, Until};
use standfast::study::limit::PendulumBounds;
use standfast::study::{Campaign, Overrides};
use standfast_paper::account::account;
use standfast_paper::imposed::{self, ImposedRecord};
use standfast_paper::scenario::{Cause, Scenario};
use std::sync::OnceLock;

/// Load below which a sole counts as unloaded (N).
const LEAST_N: f64 = 0.5;
/// The pushed runs: scenario, its figure, and its key in other figures.
const PUSHED: [(&str, &str, &str); 2] = [
    ("push-behind", "12", "push_behind"),
    ("push-diagonal", "13", "push_diagonal"),
];

pub fn scenario_push(name: &str) -> Push {
    let Cause::Push(push) = Scenario::load(name).unwrap().cause().unwrap() else {
        panic!("{name} is a push")
    };
    push
}

pub fn impose(bench: &Bench, name: &str) -> ImposedRecord {
    let Cause::Imposed(asked) = Scenario::load(name).unwrap().cause().unwrap() else {
        panic!("{name} is imposed")
    };
    imposed::run(
        &bench.robot,
        bench.design(),
        &config(2.0),
        asked.zmp_error_m.into(),
        asked.start,
        &mut |_| {},
    )
    .unwrap()
}

/// What is measured here in the run of a push.
struct Seen {
    record: Record,
    /// Root mean square of ZMP less desired ZMP while the sole in the air is unloaded (m; x, y).
    rms_m: [f64; 2],
    /// The largest rotation of the trunk about the vertical, until half a second after the end (degrees).
    most_yaw_deg: f64,
    /// Regions on both feet before the lift and right after the landing, control frame.
    regions: [SupportPolygon; 2],
    /// In the swing: how far the stance sole tips and turns (degrees).
    tip_turn_deg: [f64; 2],
    /// Ticks at which each sole is unloaded, between the landing and when the robot stands still (s).
    unloaded_s: PerFoot<Vec<f64>>,
    /// Ticks at which each joint's torque is at its limit.
    at_limit: Vec<usize>,
}

/// The runs of `PUSHED`.
fn seen() -> &'static [Seen; 2] {
    static SEEN: OnceLock<[Seen; 2]> = OnceLock::new();
    SEEN.get_or_init(|| PUSHED.map(|(name, ..)| see(&Bench::new("paper"), name)))
}

fn see(bench: &Bench, name: &str) -> Seen {
    let push = scenario_push(name);
    let record = bench.push(push);
    let (swing, land_s) = (
        record.footsteps.taken[0].foot,
        record.footsteps.taken[0].land_s,
    );
    let (mut squares, mut count, mut most_yaw_deg) = ([0.0; 2], 0, 0.0_f64);
    let (mut regions, mut at_lift_rad) = ([None; 2], None);
    let (mut tip_turn_deg, mut unloaded_s) = ([0.0_f64; 2], PerFoot::<Vec<f64>>::default());
    let mut at_limit = vec![0; bench.robot.joints.len()];
    let take_larger =
        |most: &mut f64, now: f64| *most = if now.abs() > most.abs() { now } else { *most };
    bench.run(push, record.end_s + 0.5, Until::Fallen, |tick| {
        let (truth, account) = (tick.truth, account(tick).unwrap());
        let loaded = PerFoot::from_fn(|foot| truth.sole_wrenches[foot].force.z >= LEAST_N);
        let swings = !account.stands() && truth.time_s < land_s;
        if let (true, false, Some(zmp)) = (swings, loaded[swing], truth.zmp) {
            let wanted = to_world(tick) * account.zmp_ref;
            squares = [
                squares[0] + (zmp[0] - wanted.x).powi(2),
                squares[1] + (zmp[1] - wanted.y).powi(2),
            ];
            count += 1;
        }
        if swings {
            let rotation = truth.soles[swing.other()].rotation;
            let [ahead, up] = [rotation * Vector3::x(), rotation * Vector3::z()];
            let heading_rad = ahead.y.atan2(ahead.x);
            let turn_deg = (heading_rad - *at_lift_rad.get_or_insert(heading_rad)).to_degrees();
            take_larger(&mut tip_turn_deg[0], up.angle(&Vector3::z()).to_degrees());
            take_larger(&mut tip_turn_deg[1], turn_deg);
        }
        for foot in Foot::BOTH {
            if !loaded[foot] && (land_s..=record.settled_at_s.unwrap()).contains(&truth.time_s) {
                unloaded_s[foot].push(truth.time_s);
            }
        }
        if truth.time_s <= record.end_s {
            for ((count, tau), servo) in
                at_limit.iter_mut().zip(&truth.tau).zip(&bench.robot.servos)
            {
                *count += usize::from(tau.abs() >= 0.999 * servo.torque_n_m);
            }
        }
        take_larger(
            &mut most_yaw_deg,
            truth.posture.base.rotation.euler_angles().2.to_degrees(),
        );
        let estimate = account.estimate;
        if account.stands() && estimate.in_contact.left && estimate.in_contact.right {
            if truth.time_s < record.footsteps.taken[0].lift_s {
                regions[0] = account.support().polygon;
            } else if regions[1].is_none() {
                regions[1] = account.support().polygon;
            }
        }
    });
    let rms_m = squares.map(|sum| (sum / f64::from(count)).sqrt());
    let regions = regions.map(Option::unwrap);
    Seen {
        record,
        rms_m,
        most_yaw_deg,
        regions,
        tip_turn_deg,
        unloaded_s,
        at_limit,
    }
}

fn near(told: &Value, here: f64, tolerance: f64) {
    let told = told.as_f64().unwrap();
    assert!((told - here).abs() <= tolerance, "told {told}, here {here}");
}

fn list(value: &Value) -> &Vec<Value> {
    value.as_array().unwrap()
}

fn vector(value: &Value) -> Vector2<f64> {
    Vector2::new(value[0].as_f64().unwrap(), value[1].as_f64().unwrap())
}

/// Fig. 9, 12, 13 and 14.
#[test]
fn captions_tell_the_responses_of_the_runs() {
    for (i, (run, (_, number, key))) in seen().iter().zip(PUSHED).enumerate() {
        for axis in 0..2 {
            near(
                &numbers("14")["zmp_error_rms_m"][key][axis],
                run.rms_m[axis],
                1e-4,
            );
        }
        near(
            &numbers("14")["home_at_s"][i],
            run.record.home_at_s.unwrap(),
            1e-9,
        );
        let ([tip_deg, turn_deg], told) = (run.tip_turn_deg, &numbers(number)["stride"]);
        near(&told["stance_tip_deg"], tip_deg, 1e-3);
        near(&told["stance_turn_deg"], turn_deg, 1e-3);
        assert!(tip_deg > 1.0, "{tip_deg}");
        let side = if turn_deg > 0.0 { "left" } else { "right" };
        // A round number is told without decimals.
        let told = |key: &str| {
            format!("{:.1}", told[key].as_f64().unwrap().abs())
                .trim_end_matches(".0")
                .to_owned()
        };
        let [tip, turn] = ["stance_tip_deg", "stance_turn_deg"].map(told);
        tells(&format!(
            "tips by up to {tip} degrees and turns to the {side} by {turn} degrees."
        ));
    }
    let Seen {
        rms_m: [x, y],
        most_yaw_deg: most,
        ..
    } = seen()[1];
    assert!(y > x && y >= 0.005);
    tells(&format!(
        "{:.0} mm in x and {:.0} mm in y",
        1e3 * x,
        1e3 * y
    ));
    near(&numbers("13")["most_yaw_deg"], most, 0.01);
    tells(&format!("The trunk turns by at most {most:.1} degrees"));
    let bench = Bench::new("paper");
    for (name, key) in [("error-backward", "a"), ("error-diagonal", "b")] {
        near(
            &numbers("9")[key]["home_at_s"],
            impose(&bench, name).home_at_s.unwrap(),
            1e-9,
        );
    }
    let moving = ["moving-backward", "moving-diagonal"].map(|name| impose(&bench, name));
    assert_eq!(numbers("9")["moving"], json!(moving));
    tells(&format!(
        "the COM is home from {:.2} s on.",
        moving[0].home_at_s.unwrap()
    ));
    tells(&format!(
        "it runs away at {:.2} s",
        moving[1].lost_at_s.unwrap()
    ));
    near(&numbers("7")["mass_kg"], bench.robot.mass(), 1e-9);
}

/// For Fig. 4: searched again.
#[test]
fn captions_tell_the_regions_of_the_runs() {
    let (bench, regions) = (Bench::new("paper"), seen()[0].regions);
    for (told, region) in list(&numbers("4")["area_m2"]).iter().zip(regions) {
        near(told, region.area(), 1e-9);
    }
    let allowed = regions[1].inset(bench.design().family.zmp_margin).unwrap();
    let (mut excess, mut horizons) = (0.0_f64, Vec::new());
    for (gain, old) in bench
        .design()
        .family
        .gains
        .iter()
        .zip(list(&numbers("4")["horizon_k_before"]))
    {
        let set = CpiSet::search(gain, bench.design().family.pendulum, &allowed).unwrap();
        horizons.push(set.horizon);
        let stored = CpiSet::stacked(gain, &allowed, old.as_u64().unwrap() as usize).unwrap();
        let mut programs = stored.programs().unwrap();
        for row in set.set.rows.row_iter() {
            excess = excess.max(programs.maximise(&row.into_owned()).unwrap().value - 1.0);
        }
    }
    assert_eq!(numbers("4")["horizon_k_after"], json!(horizons));
    near(&numbers("4")["stored_k_excess"], excess, 1e-6);
    assert!(excess > 1e-5, "{excess}");
}

/// For Fig. 14: the times without load and the joints at their limits agree with the ticks.
#[test]
fn captions_tell_the_soles_without_load_and_the_joints_at_their_limits() {
    for (i, (seen, (name, ..))) in seen().iter().zip(PUSHED).enumerate() {
        let spans = list(&numbers("14")["soles_without_load_s"][i]);
        assert!(!spans.is_empty(), "{name}");
        for foot in Foot::BOTH {
            let own = spans.iter().filter(|span| span[0] == json!(foot));
            let own: Vec<[f64; 2]> = own.map(|span| vector(&span[1]).into()).collect();
            for [from, to] in &own {
                tells(&format!(
                    "the {} sole carries none from {from:.3} to {to:.3} s",
                    foot.name()
                ));
                let ticks = seen.unloaded_s[foot]
                    .iter()
                    .filter(|t| (*from..=*to).contains(t))
                    .count();
                assert_eq!(
                    ticks,
                    ((to - from) / 0.002).round() as usize + 1,
                    "{name}: {from} to {to}"
                );
            }
            // Outside of all spans there are only short runs of ticks.
            let in_none = |t: &&f64| !own.iter().any(|[from, to]| (*from..=*to).contains(*t));
            let rest: Vec<f64> = seen.unloaded_s[foot]
                .iter()
                .filter(in_none)
                .copied()
                .collect();
            assert!(
                rest.chunk_by(|a, b| b - a < 0.003)
                    .all(|run| run.len() <= 5),
                "{name}: {rest:?}"
            );
        }
        let told = &numbers("14")["joints_at_torque_limit_s"][i];
        for (ticks, joint) in seen.at_limit.iter().zip(&Bench::new("paper").robot.joints) {
            if *ticks == 0 {
                assert!(told[&joint.name].is_null(), "{}", joint.name);
                continue;
            }
            near(&told[&joint.name], 0.002 * *ticks as f64, 1e-9);
            tells(&format!(
                "{} for {} ms",
                joint.name.replace('_', " "),
                2 * ticks
            ));
        }
        assert!(seen.at_limit.iter().any(|ticks| *ticks > 0), "{name}");
    }
}

/// For Fig. 13: the table, push by push.
#[test]
fn the_table_tells_what_other_pushes_lead_to() {
    let (bench, tried, diagonal) = (
        Bench::new("paper"),
        list(&numbers("13")["tried"]),
        scenario_push("push-diagonal"),
    );
    let turned = [-120.0, -130.0, -140.0, -150.0, -160.0, -170.0].map(|heading_deg| Push {
        heading_deg,
        ..diagonal
    });
    let like = ["push-error-backward", "push-error-diagonal"].map(scenario_push);
    assert_eq!(tried.len(), turned.len() + like.len());
    let mut off_deg = Vec::new();
    for (told, push) in tried.iter().zip(turned.into_iter().chain(like)) {
        let record = bench.push(push);
        assert_eq!(
            (&told["push"], &told["outcome"]),
            (&json!(push), &json!(record.outcome))
        );
        assert_eq!(told["footsteps"], json!(record.footsteps.taken));
        tells(&match record.fell_at_s {
            Some(at) => format!("<td>falls at {at:.2} s</td>"),
            None => format!(
                "<td>stands still from {:.2} s</td>",
                record.settled_at_s.unwrap()
            ),
        });
        off_deg.push(record.footsteps.taken.first().map(|footstep| {
            tells(&format!(
                "<td>{}: {}</td>",
                footstep.foot.name(),
                in_words(footstep)
            ));
            let (sin, cos) = push.heading_deg.to_radians().sin_cos();
            let way = [0, 1].map(|axis| footstep.to_m[axis] - footstep.from_m[axis]);
            ((way[0] * cos + way[1] * sin) / way[0].hypot(way[1]))
                .acos()
                .to_degrees()
        }));
    }
    // Fig. 12 states the angles between push and footstep: for its own run, for Fig. 13, and for these headings.
    let told = list(&numbers("12")["footstep_off_push_deg"]);
    for (told, off_deg) in told[2..].iter().zip(&off_deg) {
        assert_eq!(told.is_null(), off_deg.is_none());
        if let Some(off_deg) = off_deg {
            near(told, *off_deg, 1e-6);
        }
    }
    assert_eq!((told.len(), &told[1]), (8, &told[5]));
    let worst = off_deg[..6]
        .iter()
        .flatten()
        .fold(0.0_f64, |most, deg| most.max(*deg));
    tells(&format!(
        "at most {worst:.0} degrees in the table of Fig. 13, where 5 of 6 headings lead to"
    ));
    tells("towards \u{2212}120 degrees the robot recovers without a footstep");
    tells("towards \u{2212}130 degrees the robot steps and falls");
}

/// For Fig. 12 and 13: eq. 29 compared with the landing. For Fig. 6: how often the stride is at its limit.
#[test]
fn captions_tell_the_stride_that_was_asked_for_and_where_the_foot_landed() {
    let rules = *Bench::new("paper").design().stepping().unwrap();
    assert_eq!(rules.alpha, 60.0);
    // The ZMP error, and how far the foot can go along the error from its place beside the other foot.
    let reach = |footstep: &Value| {
        let error = vector(&footstep["zmp_error_m"]);
        let side = if footstep["foot"] == json!(Foot::Left) {
            1.0
        } else {
            -1.0
        };
        (
            error,
            rules.range.reach(
                Vector2::new(0.0, 0.097),
                Vector2::new(error.x, side * error.y).normalize(),
            ),
        )
    };
    for number in ["12", "13"] {
        let (footstep, told) = (&numbers(number)["footsteps"][0], &numbers(number)["stride"]);
        let (error, reach) = reach(footstep);
        let asked = error.normalize() * reach.min(60.0 * error.norm());
        let landed = vector(&footstep["to_m"]) - vector(&footstep["from_m"]);
        for axis in 0..2 {
            near(&told["asked_m"][axis], asked[axis], 1e-4);
            near(&told["landed_m"][axis], landed[axis], 1e-9);
        }
        assert!((landed - asked).norm() > 0.01);
        tells(&format!("{:.0} mm off", 1e3 * (landed - asked).norm()));
    }
    let imposed = ["a", "b", "moving_a", "moving_b"]
        .iter()
        .map(|run| &numbers("8")[run]);
    let runs = [numbers("12"), numbers("13")]
        .into_iter()
        .chain(imposed)
        .chain(list(&numbers("13")["tried"]));
    let runs = runs.chain(list(&numbers("10")["strikes"]));
    let all: Vec<&Value> = runs.flat_map(|run| list(&run["footsteps"])).collect();
    let most = all
        .iter()
        .map(|footstep| reach(footstep))
        .filter(|(error, reach)| 60.0 * error.norm() >= *reach);
    tells(&format!(
        "{} of the {} footsteps of the runs on this page have the longest stride",
        most.count(),
        all.len()
    ));
}

/// Fig. 10: the gauge gives the robot what its trace says, which is what the bob loses. One step of the search harder or softer,
/// the robot responds in the other way.
#[test]
fn the_traces_of_the_gauge_tell_what_the_robot_gets() {
    let bench = Bench::new("paper");
    let strikes = list(&numbers("10")["strikes"]);
    assert!(strikes.len() >= 6);
    for (name, from) in [("gauge-behind", "(a)"), ("gauge-diagonal", "(b)")] {
        let of: Vec<&Value> = strikes.iter().filter(|s| s["from"] == from).collect();
        let (asked, last) = (scenario_push(name), of[of.len() - 1]);
        near(&last["momentum_n_s"], asked.impulse_n_s, 1e-9);
        let mut left_n_s = 0.0;
        let record = bench.run(asked, 0.6, Until::Decided, |tick| {
            let strike = tick.truth.strike.as_ref();
            if tick.truth.push_force != Vector3::zeros() {
                left_n_s = strike.and_then(|strike| strike.momentum_n_s()).unwrap();
            }
        });
        near(&last["impulse_n_s"], asked.impulse_n_s - left_n_s, 0.03);
        assert!(record.footsteps.has_begun());
        for strike in &of {
            let points = list(&strike["trace_ms_n"]);
            let at = |i: usize, axis: usize| points[i][axis].as_f64().unwrap();
            let area = |i| (at(i, 0) - at(i - 1, 0)) * (at(i, 1) + at(i - 1, 1));
            let n_s = (1..points.len()).map(area).sum::<f64>() / 2e3;
            near(&strike["impulse_n_s"], n_s, 1e-3 * n_s);
            let peak_n = (0..points.len()).map(|i| at(i, 1)).fold(0.0, f64::max);
            near(&strike["peak_n"], peak_n, 1e-9);
            tells(&format!("<td>{:.0}</td>", peak_n));
        }
        let [held_m, stepped_m] = [0, 1].map(|i| of[i]["draw_m"].as_f64().unwrap());
        assert!((1e-9..0.0101).contains(&(stepped_m - held_m)), "{from}");
        assert!(list(&of[0]["footsteps"]).is_empty() && !list(&of[1]["footsteps"]).is_empty());
    }
}

/// For Fig. 12 and 13: what shows that a footstep is necessary.
#[test]
fn captions_tell_who_falls_without_a_footstep_and_the_pendulums_bound() {
    let (switching, stiff) = (Bench::new("switching"), Bench::new("hold"));
    let yardstick = PendulumBounds::new(
        &stiff.robot,
        &Campaign::load("nominal", &Overrides::default()).unwrap(),
    );
    for (name, number, _) in PUSHED {
        let (push, told) = (scenario_push(name), numbers(number));
        for (bench, key) in [
            (&switching, "without_footstep_fell_at_s"),
            (&stiff, "stiff_fell_at_s"),
        ] {
            near(&told[key], bench.push(push).fell_at_s.unwrap(), 1e-9);
        }
        assert!((yardstick.push_duration_s - push.duration_s).abs() < 1e-5);
        let bound = yardstick.heading(push.heading_deg).bound_no_step_n_s;
        near(&told["bound_no_step_n_s"], bound, 1e-5);
        assert!(bound < push.impulse_n_s);
        tells(&format!("recovers from {bound:.2} N s at most"));
    }
}

/// For Fig. 6 and 13: by plain distance the footstep goes straight back, with the less loaded foot.
#[test]
fn by_plain_distance_the_diagonal_push_would_move_the_other_foot_straight_back() {
    let told = &numbers("13")["by_plain_distance"];
    let [x, y] = vector(&told["zmp_error_m"]).into();
    assert!(y.abs() < 1e-6 && x < -0.01, "{told}");
    assert_eq!(told["foot"], json!(Foot::Left));
    let by_gauge = vector(&numbers("13")["footsteps"][0]["zmp_error_m"]).x;
    assert!((x / by_gauge - 1.0).abs() < 0.1, "{x} {by_gauge}");
    tells("by plain distance the left foot would go.");
    tells(&format!(
        "by plain distance it would be (\u{2212}{:.1}, 0) mm.",
        -1e3 * x
    ));
}

/// For Fig. 3: simulated here, with the membership from the matrices.
#[test]
fn captions_tell_how_fast_the_gains_bring_the_com_home() {
    let bench = Bench::new("paper");
    let family = &bench.design().family;
    let allowed = home_polygon(&bench.robot).inset(family.zmp_margin).unwrap();
    let sets = CpiSet::search_family(family, &allowed).unwrap();
    let home_radius_m = config(1.0).judge.home_radius_m;
    let home_s = |of: usize, choose: &dyn Fn(&State) -> usize| {
        let com_vel = 0.98 * sets[of].largest_com_vel_from_rest(Vector2::x());
        let mut state = State::new(
            Point2::origin(),
            Vector2::new(com_vel, 0.0),
            Point2::origin(),
        );
        let mut last_away = 0;
        for k in 0..5000 {
            if state.x[0].abs() > home_radius_m {
                last_away = k;
            }
            state = family.gains[choose(&state)].successor(&state);
        }
        0.002 * f64::from(last_away + 1)
    };
    let own: Vec<f64> = (0..sets.len())
        .map(|gain| home_s(sets.len() - 1, &|_| gain))
        .collect();
    assert!(own.windows(2).all(|pair| pair[1] < pair[0]), "{own:?}");
    for (told, own) in list(&numbers("3")["sets"]).iter().zip(&own) {
        near(&told["home_after_s"], *own, 1e-9);
        tells(&format!("<td>{own:.2} s</td>"));
    }
    let holding = |state: &State| {
        (0..sets.len())
            .rev()
            .find(|i| sets[*i].set.contains(state.stacked().as_slice()))
    };
    let [alone, switched] = [
        home_s(0, &|_| 0),
        home_s(0, &|state| holding(state).unwrap_or(0)),
    ];
    let told = &numbers("3")["home_after_s_slowest_and_switching"];
    near(&told[0], alone, 1e-9);
    near(&told[1], switched, 0.01);
    assert!(switched < alone);
}
