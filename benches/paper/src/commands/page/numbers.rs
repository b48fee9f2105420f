//! The numbers of each figure as JSON. All captions, claims and verdicts of the page are made from them.

use super::study::HEADINGS_DEG;
use crate::render::page::footwork::{EXAMPLES_DEG, is_tie};
use crate::render::page::robot::axis_name;
use crate::render::page::study::{ImposedRun, Pushed, Struck, Study};
use nalgebra::{Point2, Vector2, Vector3};
use serde_json::{Map, Value, json};
use standfast::core::control::{Phase, estimate};
use standfast::core::error::Result;
use standfast::core::lipm::OnlineSets;
use standfast::core::lipm::capture;
use standfast::core::lipm::cpi_set::{CpiSet, Inclusion};
use standfast::core::lipm::gains::{Gain, GainPoles};
use standfast::core::lipm::pendulum::State;
use standfast::core::robot::{Foot, Kinematics, Robot};
use standfast::sim::Profile;
use standfast::sim::episode::{Footstep, Outcome, Record};
use standfast::study::ask::standing_bound::StandingBound;

/// Poles over -omega of two gains, slow to fast, whose CPI sets do not nest.
const NOT_NESTED: [[f64; 3]; 2] = [[0.5, 1.0, 1.0], [1.0, 1.0, 1.0]];
/// Share of the largest push from rest that a CPI set holds, a little below 1 so that the state is surely inside.
const SHARE: f64 = 0.98;
/// Length of a simulation of the pendulum (s), after which a COM that is not home counts as not coming home.
const LONGEST_S: f64 = 30.0;
/// The range that the name of the paper's gauge, Z2-500N, states (N).
const GAUGE_RANGE_N: f64 = 500.0;
/// Shortest time without load that counts for a sole (s).
const LIFTED_S: f64 = 0.01;

/// The numbers of all figures, by figure. Fails if the solver gives up.
pub fn all(study: &Study) -> Result<Map<String, Value>> {
    let [behind, diagonal] = &study.pushes;
    let found = [
        ("3", inclusion(study)?),
        ("4", regions(study)?),
        ("5", sequence(study)),
        ("6", decision(study)),
        ("7", machine(study)),
        ("8", imposed(study)),
        ("9", imposed_responses(study)),
        ("10", strikes(study)),
        ("12", with_directions(study, pushed(study, behind))),
        ("13", with_turns(study, pushed(study, diagonal))),
        ("14", pushed_responses(study)),
    ];
    Ok(found
        .map(|(figure, numbers)| (figure.into(), numbers))
        .into_iter()
        .collect())
}

/// Fig. 3: inclusion of the CPI sets.
fn inclusion(study: &Study) -> Result<Value> {
    let (sets, family) = (&study.sets, &study.design.family);
    let impulses: Vec<[f64; 2]> = sets.iter().map(|set| impulses_of(study, set)).collect();
    let start = held(&sets[sets.len() - 1]);
    let settles: Vec<Option<f64>> = (0..sets.len())
        .map(|gain| home_s(study, start, |_| gain))
        .collect();
    let mut online = OnlineSets::new(family);
    online.update(&study.allowed);
    let start = held(&sets[0]);
    let alone = home_s(study, start, |_| 0);
    let switching = home_s(study, start, |state| {
        online.fastest_holding(state).unwrap_or(0)
    });
    let [slow, fast] = NOT_NESTED.map(|poles| {
        let gain = Gain::design(
            &family.pendulum,
            &GainPoles {
                name: "other".into(),
                x: poles,
                y: poles,
            },
        );
        CpiSet::search(&gain, family.pendulum, &study.allowed)
    });
    let others = [slow?, fast?];
    let inside = Inclusion::of(&others)?.inside;
    let shrinks = impulses
        .windows(2)
        .all(|pair| (0..2).all(|axis| pair[1][axis] < pair[0][axis]));
    let quickens = settles
        .windows(2)
        .all(|pair| matches!(pair, [Some(slow), Some(fast)] if fast < slow));
    let mut of_sets = Vec::new();
    for (i, set) in sets.iter().enumerate() {
        let [forward, left] = impulses[i];
        of_sets.push(json!({
            "gain": set.gain, "poles": family.gains[i].x.poles, "k": set.horizon, "rows": set.set.rows.nrows(),
            "impulse_n_s": { "forward": forward, "left": left }, "home_after_s": settles[i],
        }));
    }
    Ok(json!({
        "sets": of_sets,
        "nested": study.inclusion.failures().is_empty(),
        "ordered": shrinks && quickens,
        "home_after_s_slowest_and_switching": [alone, switching],
        "other_poles_over_minus_omega": NOT_NESTED,
        "other_poles_nest": inside[1][0],
        "other_poles_forward_n_s": others.each_ref().map(|set| impulses_of(study, set)[0]),
    }))
}

/// Largest impulse from rest that a CPI set holds: forward, and to the left (N s).
fn impulses_of(study: &Study, set: &CpiSet) -> [f64; 2] {
    [Vector2::x(), Vector2::y()]
        .map(|direction| study.robot.mass() * set.largest_com_vel_from_rest(direction))
}

/// Horizon of each CPI set (control ticks).
fn horizons(sets: &[CpiSet]) -> Vec<usize> {
    sets.iter().map(|set| set.horizon).collect()
}

/// State after an instantaneous push forward from rest at home, just inside of the boundary of a CPI set.
fn held(set: &CpiSet) -> State {
    let com_vel = SHARE * set.largest_com_vel_from_rest(Vector2::x());
    State::new(
        Point2::origin(),
        Vector2::new(com_vel, 0.0),
        Point2::origin(),
    )
}

/// Time (s) from which on the COM of the pendulum stays within the judge's radius of home. `choose` gives the index of
/// the gain that acts at a tick. None if the COM is still away at the end ([`LONGEST_S`]).
fn home_s(study: &Study, start: State, choose: impl Fn(&State) -> usize) -> Option<f64> {
    let family = &study.design.family;
    let (mut state, mut since) = (start, None);
    for k in 0..(LONGEST_S / family.pendulum.dt) as u64 {
        let away = state.com().coords.norm() > study.judge.home_radius_m;
        since = if away { None } else { since.or(Some(k)) };
        state = family.gains[choose(&state)].successor(&state);
    }
    since.map(|k| k as f64 * family.pendulum.dt)
}

/// Fig. 4: the regions for the ZMP before and after a footstep.
fn regions(study: &Study) -> Result<Value> {
    let Pushed {
        lift,
        landing,
        footstep,
        ..
    } = &study.pushes[0];
    // `excess` is the largest share by which the CPI set of eq. 25 is larger than the true set, if the horizon k is
    // taken from the region before the footstep.
    let mut excess = 0.0_f64;
    for ((gain, old), new) in study
        .design
        .family
        .gains
        .iter()
        .zip(&study.sets)
        .zip(&study.landed_sets)
    {
        if new.horizon > old.horizon {
            let mut programs =
                CpiSet::stacked(gain, &study.landed_allowed, old.horizon)?.programs()?;
            let missing = study.landed_allowed.vertices().len() * (old.horizon + 1);
            for row in new.set.rows.row_iter().skip(missing) {
                excess = excess.max(programs.maximise(&row.into_owned())?.value - 1.0);
            }
        }
    }
    let [left, right] = [landing.soles.left, landing.soles.right];
    let moved = landing.frame.translation.vector - lift.frame.translation.vector;
    Ok(json!({
        "foot": footstep.foot,
        "way_m": way(footstep),
        "origin_moved_m": [moved.x, moved.y],
        "area_m2": [lift.polygon.area(), landing.polygon.area()],
        "horizon_k_before": horizons(&study.sets),
        "horizon_k_after": horizons(&study.landed_sets),
        "stored_k_excess": excess,
        "soles_turned_deg": (left.rotation.angle() - right.rotation.angle()).to_degrees().abs(),
        "slowest_impulse_from_rest_n_s": {
            "before": impulses_of(study, &study.sets[0]), "after": impulses_of(study, &study.landed_sets[0]),
        },
    }))
}

/// Offset from where a footstep lifts off to where it lands (m; x forward, y left).
fn way(footstep: &Footstep) -> [f64; 2] {
    [0, 1].map(|axis| footstep.to_m[axis] - footstep.from_m[axis])
}

/// Fig. 5: the order of events.
fn sequence(study: &Study) -> Value {
    json!({ "push_behind": events(&study.pushes[0]), "push_diagonal": events(&study.pushes[1]) })
}

/// Times of the events of a run (s), and its phases from the push on.
fn events(pushed: &Pushed) -> Value {
    let Pushed { film, footstep, .. } = pushed;
    let since = film
        .snapshots
        .iter()
        .filter(|s| s.time_s >= pushed.push.start_s);
    let mut phases: Vec<_> = since.map(|s| &*s.phase).collect();
    phases.dedup();
    let swings = phases
        .iter()
        .filter(|name| name.starts_with("swing"))
        .count();
    let in_order = matches!(phases[..], ["switching", "out-of-sets", swing, .., "switching"] if swing.starts_with("swing"));
    let after = || {
        film.snapshots
            .iter()
            .filter(|s| s.time_s >= footstep.land_s)
    };
    let fastest = film.regions.last();
    let left_sets_at_s = film.record.totals.get("left_sets_at_s");
    let last_other = after().rfind(|s| s.gain.as_ref() != fastest);
    let fastest_from = after().find(|s| last_other.is_none_or(|other| s.time_s > other.time_s));
    json!({
        "push_s": pushed.push.start_s,
        "left_sets_s": left_sets_at_s,
        "lift_s": footstep.lift_s,
        "waited_s": left_sets_at_s.map(|left_s| footstep.lift_s - left_s),
        "landing_s": footstep.land_s,
        "held_after_landing_s": after().find(|s| s.phase == Phase::Switching.name()).map(|s| s.time_s),
        "fastest_gain_from_s": fastest_from.map(|s| s.time_s),
        "still_from_s": pushed.end_s(),
        "landed_inside": footstep.in_set_at_landing,
        "phases": phases,
        "in_order": in_order && swings == 1,
    })
}

/// Soles that lose their load between the landing and the end, when the robot stands still, each with start and end of
/// the time without load (s).
fn unloaded(pushed: &Pushed) -> Vec<(Foot, [f64; 2])> {
    let span_s = pushed.footstep.land_s..=pushed.end_s();
    let ticks = pushed.motion.moments.iter().zip(&pushed.seen.loaded);
    let after: Vec<_> = ticks
        .filter(|(moment, _)| span_s.contains(&moment.time_s))
        .collect();
    let mut spans = Vec::new();
    for foot in Foot::BOTH {
        for run in after.chunk_by(|(_, a), (_, b)| a[foot] == b[foot]) {
            let [from, to] = [run[0], run[run.len() - 1]].map(|(moment, _)| moment.time_s);
            if !run[0].1[foot] && to - from >= LIFTED_S {
                spans.push((foot, [from, to]));
            }
        }
    }
    spans
}

/// The ZMP error for which a footstep was taken (m), which our own controller always states.
fn zmp_error(footstep: &Footstep) -> Vector2<f64> {
    footstep.zmp_error_m.unwrap_or_default().into()
}

/// Fig. 6: the choice of foot and landing place.
fn decision(study: &Study) -> Value {
    let examples = EXAMPLES_DEG.map(|deg| {
        let choice = study.choice(deg);
        let foot = choice.chosen.map(|(foot, _)| foot);
        json!({ "direction_deg": deg, "foot": foot, "reach_left_right_m": [choice.reach.left, choice.reach.right] })
    });
    let imposed = study
        .errors
        .iter()
        .map(|run| &run.record)
        .chain(&study.moving)
        .flat_map(|record| &record.footsteps);
    let footsteps: Vec<_> = study
        .records()
        .map(|(_, record)| record)
        .chain(study.struck.iter().flatten().map(|struck| &struck.record))
        .flat_map(|record| &record.footsteps.taken)
        .chain(imposed)
        .collect();
    let at_most = footsteps
        .iter()
        .filter(|footstep| study.is_at_most(footstep.foot, zmp_error(footstep)));
    json!({
        "alpha": study.rules.alpha,
        "examples": examples,
        "tie_foot": study.choose(Vector2::x()).map(|(foot, _)| foot),
        "footsteps_at_most": at_most.count(),
        "footsteps": footsteps.len(),
    })
}

/// Fig. 7: the robot.
fn machine(study: &Study) -> Value {
    let robot = &study.robot;
    let limb = |words: [&str; 3]| {
        let joints = robot
            .joints
            .iter()
            .filter_map(|joint| joint.name.strip_prefix("left_"));
        joints
            .filter(|name| words.iter().any(|word| name.starts_with(word)))
            .count()
    };
    let left = robot.joints.iter().enumerate().filter_map(|(i, joint)| {
        Some(json!({
            "name": joint.name.strip_prefix("left_")?.replace('_', " "),
            "axis": axis_name(joint),
            "lower_deg": joint.lower_rad.to_degrees(),
            "upper_deg": joint.upper_rad.to_degrees(),
            "home_deg": robot.home_rad[i].to_degrees(),
            "torque_n_m": robot.servos[i].torque_n_m,
        }))
    });
    let knee = robot
        .joints
        .iter()
        .position(|joint| joint.name == "left_knee_flexion");
    json!({
        "joints": robot.joints.len(),
        "joints_arm": limb(["shoulder", "elbow", "wrist"]),
        "joints_leg": limb(["hip", "knee", "ankle"]),
        "mass_kg": robot.mass(),
        "height_m": height(robot),
        "sole_m": robot.soles.left.half_m.map(|half| 2.0 * half),
        "feet_apart_m": study.stance.y,
        "com_height_m": robot.home_com_height(),
        "left_joints": left.collect::<Vec<_>>(),
        "knee_deg": knee.map_or(0.0, |i| robot.home_rad[i].to_degrees()),
        "assumption": robot.assumptions.first(),
    })
}

/// Height of the highest point above the soles with all joints at zero (m).
fn height(robot: &Robot) -> f64 {
    let kinematics = Kinematics::new(robot);
    let tops = robot.links.iter().enumerate().flat_map(|(i, link)| {
        let pose = *kinematics.link_pose(i);
        let up = pose.rotation.inverse() * Vector3::z();
        link.visuals
            .iter()
            .map(move |solid| pose.translation.z + solid.reach_m(&up))
    });
    tops.fold(f64::NEG_INFINITY, f64::max) - kinematics.sole_pose(robot, Foot::Left).translation.z
}

/// Fig. 8: footsteps after imposed errors.
fn imposed(study: &Study) -> Value {
    json!({
        "a": study.errors[0].record, "b": study.errors[1].record,
        "moving_a": study.moving[0], "moving_b": study.moving[1],
        "foot_of_the_printed_signs": study.choose(Vector2::new(0.03, 0.0685)).map(|(foot, _)| foot),
    })
}

/// Fig. 9: responses to imposed errors over time.
fn imposed_responses(study: &Study) -> Value {
    let of_run = |run: &ImposedRun| {
        let after = run
            .motion
            .moments
            .iter()
            .filter(|moment| moment.time_s >= run.footstep.land_s);
        let mut gains: Vec<&str> = after.filter_map(|moment| moment.gain.as_deref()).collect();
        gains.dedup();
        json!({
            "home_at_s": run.record.home_at_s, "footsteps": run.record.footsteps, "gains_after_landing": gains,
        })
    };
    let [a, b] = &study.errors;
    json!({ "moving": study.moving, "a": of_run(a), "b": of_run(b) })
}

/// How a run ends, in words.
fn end(record: &Record) -> &'static str {
    match (record.outcome, record.footsteps.has_begun()) {
        (Outcome::Recovered, false) => "recovers without a footstep",
        (Outcome::Recovered, true) => "steps and recovers",
        (_, false) => "does not step and does not recover",
        (_, true) => "steps and falls",
    }
}

/// Fig. 10: the strikes of the gauge, those from behind first.
fn strikes(study: &Study) -> Value {
    let mut told = Vec::new();
    for (strikes, from) in study.struck.iter().zip(["(a)", "(b)"]) {
        for struck in strikes {
            let (push, record, impulse) = (&struck.push, &struck.record, &struck.impulse);
            let trace = trace(struck);
            let peak_n = trace.iter().fold(0.0, |most: f64, [_, n]| most.max(*n));
            let direction = push.direction();
            let high = struck.forces.iter();
            let high = high.filter(|foam| foam.force.dot(&direction) >= 0.5 * peak_n);
            let links = struck.forces.chunk_by(|a, b| a.link == b.link);
            let met = links.map(|foam| &study.robot.links[foam[0].link].name);
            told.push(json!({
                "met": met.map(|name| name.replace('_', " ")).collect::<Vec<_>>(),
                "from": from, "draw_m": record.totals.get("bob_draw_m"), "momentum_n_s": push.impulse_n_s,
                "impulse_n_s": impulse.dot(&direction), "peak_n": peak_n,
                "width_s": high.map(|foam| foam.for_s).sum::<f64>(), "trace_ms_n": trace,
                "up_deg": (impulse.z / impulse.norm()).asin().to_degrees(),
                "aside_deg": impulse.xy().angle(&direction.xy()).to_degrees(),
                "end": end(record), "footsteps": record.footsteps.taken,
            }));
        }
    }
    let bob = study.struck[0][0].push.bob;
    json!({ "range_n": GAUGE_RANGE_N, "bob": bob, "strikes": told })
}

/// What a gauge measures: time since it came to touch the robot (ms), and force along the direction of its swing (N).
fn trace(struck: &Struck) -> Vec<[f64; 2]> {
    let (mut points, direction) = (Vec::new(), struck.push.direction());
    let start_s = struck.forces.first().map_or(0.0, |foam| foam.from_s);
    let mut end_s = start_s;
    let ms = |time_s: f64| 1e3 * (time_s - start_s);
    for foam in &struck.forces {
        // It may leave the robot and touch it again.
        if points.is_empty() || foam.from_s - end_s > 0.5 * foam.for_s {
            points.extend([[ms(end_s), 0.0], [ms(foam.from_s), 0.0]]);
        }
        let middle_s = foam.from_s + 0.5 * foam.for_s;
        points.push([ms(middle_s), foam.force.dot(&direction)]);
        end_s = foam.from_s + foam.for_s;
    }
    points.push([ms(end_s), 0.0]);
    points
}

/// Fig. 12 and 13: the numbers about its push that each figure has.
fn pushed(study: &Study, pushed: &Pushed) -> Value {
    let Pushed {
        push,
        film,
        footstep,
        ..
    } = pushed;
    let error = zmp_error(footstep);
    let reach = study.reach(error.normalize());
    let (gone, asked) = (
        Vector2::from(way(footstep)),
        study.choose(error).map_or(Vector2::zeros(), |(_, way)| way),
    );
    // The largest impulse of this duration that the pendulum can take without a footstep.
    let factor = match push.profile {
        Profile::Rectangular => capture::rectangular_push_factor,
        Profile::HalfSine => capture::half_sine_push_factor,
    };
    let bound = StandingBound::new(&study.robot).impulse_n_s(push.heading_deg);
    json!({
        "push": push,
        "outcome": film.record.outcome,
        "footsteps": film.record.footsteps.taken,
        "settled_at_s": film.record.settled_at_s,
        "snapshots_s": pushed.moments().map(|(i, _)| film.snapshots[i].time_s),
        "stride": {
            "asked_m": [asked.x, asked.y], "landed_m": [gone.x, gone.y], "off_m": (gone - asked).norm(),
            "stance_tip_deg": pushed.seen.stance_tip_deg, "stance_turn_deg": pushed.seen.stance_turn_deg,
        },
        "without_footstep_fell_at_s": pushed.without_footstep.fell_at_s,
        "stiff_fell_at_s": pushed.stiff.fell_at_s,
        "bound_no_step_n_s": bound.map(|n_s| n_s * factor(study.robot.omega(), push.duration_s)),
        "reach_left_right_m": [reach.left, reach.right],
        "tie": is_tie(&reach),
    })
}

/// Adds to the numbers of Fig. 12 the angle between each push and its footstep.
fn with_directions(study: &Study, mut numbers: Value) -> Value {
    let runs = study
        .records()
        .take(study.pushes.len() + HEADINGS_DEG.len());
    numbers["footstep_off_push_deg"] = runs
        .map(|(push, record)| {
            let way = Vector2::from(way(record.footsteps.taken.first()?));
            Some(push.direction().xy().angle(&way).to_degrees())
        })
        .collect();
    numbers
}

/// Adds to the numbers of Fig. 13 how the trunk turns, and the other pushes that were tried.
fn with_turns(study: &Study, mut numbers: Value) -> Value {
    let pushed = &study.pushes[1];
    let yaws: Vec<f64> = pushed
        .film
        .snapshots
        .iter()
        .map(|s| estimate::heading(&s.posture.base).to_degrees())
        .collect();
    let most = yaws.iter().fold(
        0.0,
        |most: f64, yaw| if yaw.abs() > most.abs() { *yaw } else { most },
    );
    let plain = study.by_plain_distance(&pushed.lift);
    let plain =
        plain.map(|(error, foot)| json!({ "zmp_error_m": [error.x, error.y], "foot": foot }));
    let mut tried = Vec::new();
    for (push, record) in study.records().skip(study.pushes.len()) {
        let asked = record.footsteps.taken.first().map(|f| f.zmp_error_m);
        let asked = asked.or(record.footsteps.lifted.map(|f| f.zmp_error_m));
        tried.push(json!({
            "push": push, "outcome": record.outcome, "fell_at_s": record.fell_at_s, "settled_at_s": record.settled_at_s,
            "asked_m": asked, "footsteps": record.footsteps.taken, "end": end(record),
        }));
    }
    numbers["most_yaw_deg"] = json!(most);
    numbers["last_yaw_deg"] = json!(yaws.last());
    numbers["by_plain_distance"] = json!(plain);
    numbers["tried"] = tried.into();
    numbers
}

/// Fig. 14: responses to pushes over time.
fn pushed_responses(study: &Study) -> Value {
    let [a, b] = study.pushes.each_ref().map(zmp_errors);
    let at_limit = study.pushes.each_ref().map(|pushed| {
        let mut joints = Map::new();
        for (joint, time_s) in study.robot.joints.iter().zip(&pushed.seen.at_limit_s) {
            if *time_s > 0.0 {
                joints.insert(joint.name.clone(), json!(time_s));
            }
        }
        joints
    });
    json!({
        "zmp_error_rms_m": { "push_behind": a, "push_diagonal": b },
        "home_at_s": study.pushes.each_ref().map(|pushed| pushed.film.record.home_at_s),
        "soles_without_load_s": study.pushes.each_ref().map(unloaded),
        "joints_at_torque_limit_s": at_limit,
    })
}

/// Root mean square of the difference between ZMP and commanded ZMP in the first swing, while the swing sole carries no
/// load (m; x, y).
fn zmp_errors(pushed: &Pushed) -> [f64; 2] {
    let Footstep { foot, land_s, .. } = pushed.footstep;
    let moments = pushed.motion.moments.iter().zip(&pushed.seen.loaded);
    let in_air =
        moments.filter(|(s, loaded)| s.in_air.is_some() && s.time_s < land_s && !loaded[foot]);
    let errors: Vec<[f64; 2]> = in_air
        .filter_map(|(s, _)| {
            s.zmp
                .zip(s.zmp_ref)
                .map(|(zmp, zmp_ref)| [0, 1].map(|axis| zmp[axis] - zmp_ref[axis]))
        })
        .collect();
    [0, 1].map(|axis| {
        (errors.iter().map(|e| e[axis] * e[axis]).sum::<f64>() / errors.len().max(1) as f64).sqrt()
    })
}
