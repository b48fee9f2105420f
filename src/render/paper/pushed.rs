//! Fig. 12 and 13: the pushed robot in snapshots, and what the paper says of it.

use super::super::html::svg::short;
use super::decision::{Home, by_plain_distance};
use super::figure::Said::{Quote, Remark};
use super::figure::{Claim, Figure, Table, walked};
use super::pictures::{camera, fine, snapshot};
use super::study::{Pushed, Study, Tried};
use crate::campaign::ask::no_step::NoStep;
use crate::control::estimate;
use crate::episode::{Outcome, Record, Snapshot};
use crate::lipm::capture;
use crate::render::picture::draw;
use crate::render::scene::palette::Overlay;
use crate::robot::Foot;
use crate::sim::{Profile, Push};
use nalgebra::Vector2;
use serde_json::{Value, json};
use std::ops::RangeInclusive;

/// Of a snapshot (px): marks are small.
const SIZE: [f64; 2] = [340.0, 440.0];
/// Of the camera (degrees), and by how much it looks to the side of the push (m): the arrow is to be in the picture.
const VIEW_DEG: f64 = 27.0;
const ARROW_M: f64 = 0.07;
/// What "slightly" is taken for (degrees): less is no turn.
const SLIGHT_DEG: RangeInclusive<f64> = 1.0..=15.0;
/// A footstep whose direction is off that of the push by more is not appropriate (degrees).
const APPROPRIATE_DEG: f64 = 45.0;
/// A foot that lands farther from where it was sent is elsewhere (m).
const ELSEWHERE_M: f64 = 0.01;

/// Fig. 12.
pub fn from_behind(study: &Study) -> Figure {
    let pushed = &study.pushes[0];
    let gone = pushed.way().unwrap_or_default();
    let mut numbers = json!({});
    let claims = vec![
        Claim::judged(
            Quote("a disturbance was imposed from backward and the robot steps forward.", "Sect. VI.B"),
            gone[0] > 0.0,
            format!("The foot goes {}.", walked(gone)),
            format!("The foot goes {}.", walked(gone)),
        ),
        swinging(study, pushed),
        directions(study, &mut numbers),
        stride(study, pushed, &mut numbers),
        necessity(study, pushed, &mut numbers),
        magnitude(pushed),
    ];
    strip("12", "fig12-push-behind.svg", "Pushed from behind", study, pushed, claims, numbers)
}

/// Which foot goes when the robot is pushed from behind.
fn swinging(study: &Study, pushed: &Pushed) -> Claim {
    let quoted = Quote("The right foot is chosen as swinging foot.", "Sect. VI.B");
    let Some(footstep) = pushed.film.record.footsteps.first() else {
        return Claim::judged(quoted, false, String::new(), "There is no footstep.".into());
    };
    let reach = Home::new(study).reaches(footstep.zmp_error_m.into());
    let ways = format!("could go {} mm, the right one {} mm", short(1e3 * reach[0], 1), short(1e3 * reach[1], 1));
    let is_right = footstep.foot == Foot::Right;
    if is_right && Home::is_tie(reach) {
        return Claim::open(
            quoted,
            format!(
                "The right foot. The left foot {ways}: a tie, which step 4 of Sect. V.B gives to the left foot. A tie goes \
                 to the less loaded foot here, else to the right one, to be like this experiment: so this is no finding."
            ),
        );
    }
    let told = format!("The {} foot. The left foot {ways}.", footstep.foot.name());
    Claim::judged(quoted, is_right, told.clone(), told)
}

/// Fig. 13.
pub fn from_diagonal(study: &Study) -> Figure {
    let pushed = &study.pushes[1];
    let (gone, footstep) = (pushed.way().unwrap_or_default(), pushed.film.record.footsteps.first());
    let foot = footstep.map_or("no", |f| f.foot.name());
    let plain = by_plain_distance(study, pushed);
    let [plain_foot, plain_way] = plain.map_or([String::new(), String::new()], |(error, footstep)| {
        [
            format!(
                " So it is by the ZMP error of Fig. 6; by plain distance the {} foot would go.",
                footstep.foot.name()
            ),
            format!(
                " By plain distance (Fig. 6) the ZMP error, and the footstep with it, would point towards {} degrees.",
                short(towards_deg(error), 0)
            ),
        ]
    });
    let yaw_deg = |s: &Snapshot| estimate::heading(&s.posture.base).to_degrees();
    let snapshots = &pushed.film.snapshots;
    let most =
        snapshots.iter().map(yaw_deg).fold(0.0, |most: f64, yaw| if yaw.abs() > most.abs() { yaw } else { most });
    let last = snapshots.last().map_or(0.0, yaw_deg);
    let yaw = format!(
        "The trunk turns by at most {} degrees and ends at {}. (\u{201c}Slightly\u{201d} is taken as {} to {}.)",
        short(most, 1),
        short(last, 1),
        short(*SLIGHT_DEG.start(), 0),
        short(*SLIGHT_DEG.end(), 0)
    );
    let mut numbers = json!({
        "most_yaw_deg": most,
        "last_yaw_deg": last,
        "by_plain_distance": plain.map(|(error, footstep)| json!({
            "zmp_error_m": [error.x, error.y], "foot": footstep.foot,
        })),
        "tried": study.headings.iter().chain(&study.like_imposed).map(|tried| json!({
            "push": tried.push, "outcome": tried.record.outcome, "fell_at_s": tried.record.fell_at_s,
            "left_sets_at_s": tried.record.left_sets_at_s, "footsteps": tried.record.footsteps,
        })).collect::<Vec<_>>(),
    });
    let claims = vec![
        Claim::judged(
            Quote(
                "disturbance was imposed from diagonally forward left and the right foot is chosen as swinging foot",
                "Sect. VI.B",
            ),
            footstep.is_some_and(|f| f.foot == Foot::Right),
            format!("The right foot.{plain_foot}"),
            format!("The {foot} foot.{plain_foot}"),
        ),
        Claim::judged(
            Quote("the robot stepped diagonally backward right.", "Fig. 13"),
            gone[0] < 0.0 && gone[1] < 0.0,
            format!("The foot goes {}.{plain_way}", walked(gone)),
            format!("The foot goes {}.{plain_way}", walked(gone)),
        ),
        Claim::judged(
            Quote("it was seen that the robot rotated around the yaw axis, slightly.", "Sect. VI.B"),
            SLIGHT_DEG.contains(&most.abs()),
            yaw.clone(),
            yaw,
        ),
        stride(study, pushed, &mut numbers),
        necessity(study, pushed, &mut numbers),
        heading(study),
        magnitude(pushed),
    ];
    let figure =
        strip("13", "fig13-push-diagonal.svg", "Pushed from diagonally forward left", study, pushed, claims, numbers);
    Figure { table: Some(tried(study)), ..figure }
}

/// Whether the footsteps go where the robot is pushed to.
fn directions(study: &Study, numbers: &mut Value) -> Claim {
    let pushed = study.pushes.iter().map(|pushed| (&pushed.push, &pushed.film.record));
    let tried = study.headings.iter().map(|tried| (&tried.push, &tried.record));
    let off_deg: Vec<Option<f64>> =
        pushed.chain(tried).map(|(push, record)| Some(off_push(push, first_way(record)?))).collect();
    let told = |off: Option<f64>| off.map_or("no footstep".into(), |deg| format!("{} degrees", short(deg, 0)));
    let stepped: Vec<f64> = off_deg[2..].iter().flatten().copied().collect();
    let worst = stepped.iter().copied().fold(0.0, f64::max);
    let told = format!(
        "Between the directions of push and footstep: {} here, {} in Fig. 13, at most {} degrees over the {} of the {} \
         headings of its table that lead to a footstep. (\u{201c}Appropriate\u{201d} is taken as within {}.)",
        told(off_deg[0]),
        told(off_deg[1]),
        short(worst, 0),
        stepped.len(),
        study.headings.len(),
        short(APPROPRIATE_DEG, 0)
    );
    numbers["footstep_off_push_deg"] = json!(off_deg);
    Claim::judged(
        Quote(
            "It is verified that the robot steps in the appropriate direction depending on the disturbance direction.",
            "Sect. VI.B",
        ),
        off_deg[..2].iter().all(|off| off.is_some_and(|deg| deg <= APPROPRIATE_DEG)) && worst <= APPROPRIATE_DEG,
        told.clone(),
        told,
    )
}

fn first_way(record: &Record) -> Option<Vector2<f64>> {
    let footstep = record.footsteps.first()?;
    Some(Vector2::new(footstep.to_m[0] - footstep.from_m[0], footstep.to_m[1] - footstep.from_m[1]))
}

/// Between the directions of a push and of a way (degrees).
fn off_push(push: &Push, way: Vector2<f64>) -> f64 {
    push.direction().xy().angle(&way).to_degrees()
}

fn towards_deg(way: Vector2<f64>) -> f64 {
    way.y.atan2(way.x).to_degrees()
}

/// Eq. 29 against where the foot lands.
fn stride(study: &Study, pushed: &Pushed, numbers: &mut Value) -> Claim {
    let quoted = Quote("Then, we calculate the stride of step as follows", "Sect. V.B, eq. 29");
    let record = &pushed.film.record;
    let asked = record.footsteps.first().and_then(|f| Home::new(study).stride(f.zmp_error_m.into()));
    let (Some(asked), Some(gone)) = (asked, first_way(record)) else {
        return Claim::judged(quoted, false, String::new(), "There is no footstep.".into());
    };
    let off_m = (gone - asked).norm();
    let way =
        |way: Vector2<f64>| format!("{} mm towards {} degrees", short(1e3 * way.norm(), 0), short(towards_deg(way), 1));
    let told = format!(
        "Asked: {}; landed: {}, {} mm off (more than {} is taken for elsewhere). While the foot is in the air nothing is \
         stabilised, and the sole that stands tips by up to {} degrees and turns by {}.",
        way(asked),
        way(gone),
        short(1e3 * off_m, 0),
        short(1e3 * ELSEWHERE_M, 0),
        short(pushed.watch.stance_tip_deg, 1),
        short(pushed.watch.stance_turn_deg, 1)
    );
    numbers["stride"] = json!({
        "asked_m": [asked.x, asked.y], "landed_m": [gone.x, gone.y], "off_m": off_m,
        "stance_tip_deg": pushed.watch.stance_tip_deg, "stance_turn_deg": pushed.watch.stance_turn_deg,
    });
    Claim::judged(quoted, off_m <= ELSEWHERE_M, told.clone(), told)
}

/// Whether it takes a footstep to stay up.
fn necessity(study: &Study, pushed: &Pushed, numbers: &mut Value) -> Claim {
    let record = &pushed.film.record;
    let falls = |record: &Record| record.fell_at_s.map_or("stay up".into(), |at| format!("fall at {at:.2} s"));
    let still = record.settled_at_s.map_or_else(String::new, |at| format!(", and stands still from {at:.2} s"));
    let landed = record.footsteps.first().is_some_and(|f| f.in_set_at_landing);
    let sets = if landed { "inside" } else { "outside" };
    let is_up = record.outcome == Outcome::Recovered;
    let with =
        if is_up { format!("It lands {sets} the new sets{still}.") } else { "The robot does not recover.".into() };
    let bound = no_step_n_s(study, &pushed.push);
    let told = format!(
        "{with} Without the footstep the same gains {}, and stiff joints that keep the posture (gain set hold) {}. The pendulum can take {} \
         N s of such a push without a footstep; this one has {} N s.",
        falls(&pushed.without_footstep),
        falls(&pushed.stiff),
        bound.map_or("nothing".into(), |n_s| short(n_s, 2)),
        short(pushed.push.impulse_n_s, 2)
    );
    numbers["without_footstep_fell_at_s"] = json!(pushed.without_footstep.fell_at_s);
    numbers["stiff_fell_at_s"] = json!(pushed.stiff.fell_at_s);
    numbers["bound_no_step_n_s"] = json!(bound);
    let fell = [&pushed.without_footstep, &pushed.stiff].iter().all(|record| record.fell_at_s.is_some());
    Claim::judged(
        Quote("In order to avoid falling, it is necessary for the robot to step", "Sect. V.A"),
        is_up && fell && bound.is_none_or(|n_s| n_s < pushed.push.impulse_n_s),
        told.clone(),
        told,
    )
}

/// What the pendulum can take of a push like this without a footstep (N s).
fn no_step_n_s(study: &Study, push: &Push) -> Option<f64> {
    let factor = match push.profile {
        Profile::Rectangular => capture::rectangular_push_factor,
        Profile::HalfSine => capture::half_sine_push_factor,
    };
    let instantaneous = NoStep::new(&study.robot).impulse_n_s(push.heading_deg)?;
    Some(instantaneous * factor(study.robot.omega(), push.duration_s))
}

/// The direction of Fig. 13 is ours: what others lead to.
fn heading(study: &Study) -> Claim {
    let mut ends: Vec<(&str, Vec<String>)> = Vec::new();
    for tried in &study.headings {
        let (end, deg) = (end(&tried.record), short(tried.push.heading_deg, 0));
        match ends.iter_mut().find(|(of, _)| *of == end) {
            Some((_, list)) => list.push(deg),
            None => ends.push((end, vec![deg])),
        }
    }
    let told: Vec<String> = ends.iter().map(|(end, list)| format!("{end} towards {}", list.join(", "))).collect();
    let like = study.like_imposed.iter().zip(["that of (a)", "that of (b)"]);
    let like: Vec<String> = like.map(|(tried, which)| format!("{} after {which}", end(&tried.record))).collect();
    Claim::open(
        Remark("The paper does not print towards where it pushed in Fig. 13."),
        format!(
            "{} degrees were chosen here, and so for Fig. 5 (b) and 14 (b). The outcome depends on it: the robot {}. The last \
             rows of the table are pushes whose ZMP errors come close to those of Sect. V.C: the robot {}.",
            short(study.pushes[1].push.heading_deg, 0),
            told.join("; "),
            like.join(", ")
        ),
    )
}

/// How a run ends, in a few words.
fn end(record: &Record) -> &'static str {
    match (record.outcome, record.footsteps.is_empty() && record.unfinished_footstep.is_none()) {
        (Outcome::Recovered, true) => "recovers without a footstep",
        (Outcome::Recovered, false) => "steps and recovers",
        (_, true) => "does not step and does not recover",
        (_, false) => "steps and falls",
    }
}

/// What was tried beside the push of Fig. 13.
fn tried(study: &Study) -> Table {
    let row = |tried: &Tried| {
        let Tried { push, record } = tried;
        let footstep = record.footsteps.first();
        let asked = footstep.map(|f| f.zmp_error_m).or(record.unfinished_footstep.map(|f| f.zmp_error_m));
        let error = asked.map(|e| format!("({}, {})", short(1e3 * e[0], 0), short(1e3 * e[1], 0)));
        let step = first_way(record).zip(footstep);
        vec![
            short(push.heading_deg, 0),
            short(push.impulse_n_s, 2),
            error.unwrap_or("\u{2013}".into()),
            step.map_or("\u{2013}".into(), |(way, f)| format!("{}: {}", f.foot.name(), walked(way.into()))),
            match (record.fell_at_s, record.settled_at_s) {
                (Some(at), _) => format!("falls at {at:.2} s"),
                (None, Some(at)) => format!("still from {at:.2} s"),
                _ => "neither falls nor stands".into(),
            },
        ]
    };
    let head = ["towards [deg]", "push [N s]", "ZMP error [mm]", "first footstep", "outcome"];
    Table {
        head: head.map(String::from).into(),
        rows: study.headings.iter().chain(&study.like_imposed).map(row).collect(),
    }
}

fn magnitude(pushed: &Pushed) -> Claim {
    Claim::open(
        Remark("The paper does not print how hard it pushed."),
        format!(
            "Here {} N s within {} ms at the height of the COM, towards {} degrees (0 is forward, 90 to the \
             left). The paper's robot was real; this one is simulated, its sensors ideal, its batteries, servos and friction \
             assumed.",
            short(pushed.push.impulse_n_s, 2),
            short(1e3 * pushed.push.duration_s, 0),
            short(pushed.push.heading_deg, 0)
        ),
    )
}

fn strip(
    number: &'static str,
    file: &'static str,
    title: &'static str,
    study: &Study,
    pushed: &Pushed,
    claims: Vec<Claim>,
    more: Value,
) -> Figure {
    let record = &pushed.film.record;
    let mut panels = Vec::new();
    let mut times = Vec::new();
    if let Some(footstep) = record.footsteps.first() {
        let (lift, land) = (footstep.lift_s, footstep.land_s);
        let end_s = record.settled_at_s.unwrap_or(record.end_s);
        let middle = Vector2::new(0.5 * footstep.to_m[0], 0.5 * (footstep.to_m[1] - footstep.from_m[1]));
        // With room for the arrow, on the side that the push comes from.
        let camera = camera((middle - ARROW_M * pushed.push.direction().xy()).into(), VIEW_DEG);
        for (at, what) in [
            (pushed.push.start_s + 0.5 * pushed.push.duration_s, "pushed"),
            (lift, "foot lifted"),
            (lift + 0.5 * (land - lift), "foot in the air"),
            (land, "landed"),
            (land + 0.2 * (end_s - land), "switching control"),
            (end_s, "stands still"),
        ] {
            let snapshots = &pushed.film.snapshots;
            let i = snapshots.partition_point(|s| s.time_s < at - 1e-9).min(snapshots.len() - 1);
            let image = draw(&study.robot, &snapshots[i], &camera, fine(SIZE[0], SIZE[1]), &Overlay::ALL);
            times.push(snapshots[i].time_s);
            panels.push(snapshot(&image, SIZE, &format!("{:.3} s", snapshots[i].time_s), what));
        }
    }
    let mut numbers = json!({
        "push": pushed.push, "outcome": record.outcome, "footsteps": record.footsteps,
        "settled_at_s": record.settled_at_s, "snapshots_s": times,
    });
    if let (Value::Object(all), Value::Object(more)) = (&mut numbers, more) {
        all.extend(more);
    }
    Figure {
        number,
        file,
        title,
        reading: "Simulated physics, seen from the robot's front right. Marks: the push (red arrow), forces \
        under the soles (light green), COM (purple), ZMP (red; wanted: orange), DCM (green), the contact region \
         (slate), the sets (blue) and the planned footstep (teal)."
            .into(),
        panels,
        columns: 3,
        table: None,
        claims,
        numbers,
    }
}
