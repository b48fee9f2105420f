//! Snapshots: Fig. 8 (imposed errors), Fig. 12 and 13 (pushes in physics).

use super::super::html::svg::short;
use super::decision::Home;
use super::figure::Said::{Quote, Remark};
use super::figure::{Claim, Figure, walked};
use super::panel::Panel;
use super::study::{ImposedRun, Pushed, Study};
use crate::episode::{Outcome, Snapshot};
use crate::report::picture::{Camera, Marks, draw, draw_posture, png};
use crate::robot::{Foot, Posture};
use image::RgbImage;
use nalgebra::{Point3, Vector2, Vector3};
use serde_json::{Value, json};
use std::ops::RangeInclusive;

/// Of a snapshot (px),
const SIZE: [f64; 2] = [200.0, 270.0];
/// and of one with marks, which are small.
const MARKED: [f64; 2] = [340.0, 440.0];
/// For the words below it.
const BELOW: f64 = 40.0;
/// Dots of a picture to a px of the page.
const FINE: f64 = 2.0;
/// Snapshots in a row; those with marks.
const COLUMNS: usize = 6;
const MARKED_COLUMNS: usize = 3;

/// Size of a picture that is shown `width` by `height` px.
pub fn fine(width: f64, height: f64) -> [u32; 2] {
    [width, height].map(|side| (FINE * side) as u32)
}

/// From the robot's front right; it does not follow the robot, so that a step is seen as one.
fn camera(x_m: f64, y_m: f64) -> Camera {
    Camera {
        target: Point3::new(x_m, y_m, 0.255),
        azimuth_deg: -48.0,
        elevation_deg: 12.0,
        distance_m: 1.7,
        fov_deg: 22.5,
    }
}

fn snapshot(image: &RgbImage, [width, height]: [f64; 2], time: &str, what: &str) -> Panel {
    let mut panel = Panel::new(width, height + BELOW);
    panel.image([0.0, 0.0], [width, height], &png(image), &format!("{time}: {what}"));
    panel.text("title", [0.5 * width, height + 17.0], time);
    panel.text("small", [0.5 * width, height + 33.0], what);
    panel
}

/// Fig. 8.
pub fn imposed(study: &Study) -> Figure {
    let mut panels = Vec::new();
    for (run, name) in study.errors.iter().zip(["(a)", "(b)"]) {
        let Some(footstep) = run.record.footsteps.first() else { continue };
        let end_s = run.record.home_at_s.unwrap_or(footstep.land_s + 0.6);
        let (lift, land) = (footstep.lift_s, footstep.land_s);
        let camera = camera(0.5 * footstep.to_m[0], 0.5 * (footstep.to_m[1] - footstep.from_m[1]));
        for (at, what) in [
            (lift, "error imposed"),
            (lift + 0.3 * (land - lift), "foot in the air"),
            (lift + 0.65 * (land - lift), "foot in the air"),
            (land, "landed"),
            (0.5 * (land + end_s), "switching control"),
            (end_s, "COM home"),
        ] {
            let (time_s, posture) = posture_at(run, at);
            let image = draw_posture(&study.robot, posture, &camera, fine(SIZE[0], SIZE[1]));
            panels.push(snapshot(&image, SIZE, &format!("{name}  {time_s:.3} s"), what));
        }
    }
    let [a, b] = study.errors.each_ref().map(|run| (run.record.footsteps.first(), way_of(run)));
    let foot = |footstep: Option<&crate::episode::Footstep>| footstep.map_or("no", |f| f.foot.name());
    let home = Home::new(study);
    let printed = home.choose(Vector2::new(0.03, 0.0685)).map(|footstep| footstep.foot);
    let [moving_a, moving_b] = study.moving.each_ref().map(|record| match (record.lost_at_s, record.home_at_s) {
        (None, Some(at)) => format!("home from {} s", short(at, 2)),
        _ => "lost: more than one footstep can make good".into(),
    });
    let there = format!("With the error read as told below: The {} foot goes {}.", foot(b.0), walked(b.1));
    let claims = vec![
        Claim::judged(
            Quote(
                "we set ZMP error to be \u{394}p_Z = [\u{2212}0.03 0 0] assuming that a disturbance imposed backward \u{2026} \
                 a backward stepping motion was generated automatically.",
                "Sect. V.C",
            ),
            a.1[0] < 0.0,
            format!("The {} foot goes {}.", foot(a.0), walked(a.1)),
            format!("The {} foot goes {}.", foot(a.0), walked(a.1)),
        ),
        Claim::judged(
            Quote(
                "The right foot was chosen as swinging foot based on proposed determination algorithm.",
                "Sect. V.C, of (b)",
            ),
            b.0.is_some_and(|f| f.foot == Foot::Right),
            there.clone(),
            there,
        ),
        Claim::open(
            Quote(
                "we set ZMP error to be \u{394}p_Z = [0.03 0.685 0] assuming that a disturbance imposed from diagonally \
                 forward left.",
                "Sect. V.C",
            ),
            format!(
                "As printed its signs lead to the {} foot by eq. 27 to 29, and 0.685 m is more than the robot is high. \
                 Read as [\u{2212}30 \u{2212}68.5] mm: where the robot is driven, as in (a).",
                printed.map_or("no", Foot::name)
            ),
        ),
        Claim::open(
            Quote("disturbances were imposed from backward (a)", "Fig. 8, and alike Fig. 9"),
            "In Fig. 12 the same words go with a step forward; the text of Sect. V.C has (a) imposed backward, with a \
             backward step. Read by the text: (a) drives the robot backward."
                .into(),
        ),
        Claim::open(
            Remark("The paper does not say how the COM moves as the error is imposed."),
            format!(
                "Here it rests, and the error is told to the footstep alone. With the velocity of the COM that \
                 makes the error, (a) is {moving_a}; (b) is {moving_b}."
            ),
        ),
    ];
    Figure {
        number: "8",
        file: "fig08-imposed.svg",
        title: "Snapshots of the imposed errors",
        reading: format!(
            "Whole body motion by inverse kinematics on the ideal pendulum, without physics, seen from the \
             robot's front right: (a) error that drives backward, (b) error from diagonally forward left. Its \
             COM is at most {} mm from the pendulum's.",
            short(1e3 * study.errors.iter().map(|run| run.record.worst_com_error_m).fold(0.0, f64::max), 1)
        ),
        panels,
        columns: COLUMNS,
        table: None,
        claims,
        numbers: json!({
            "a": study.errors[0].record, "b": study.errors[1].record,
            "moving_a": study.moving[0], "moving_b": study.moving[1],
            "foot_of_the_printed_signs": printed,
        }),
    }
}

fn posture_at(run: &ImposedRun, at_s: f64) -> (f64, &Posture) {
    let i = run.ticks.partition_point(|(time_s, ..)| *time_s < at_s - 1e-9).min(run.ticks.len() - 1);
    (run.ticks[i].0, &run.ticks[i].1)
}

fn way_of(run: &ImposedRun) -> [f64; 2] {
    run.record.footsteps.first().map_or([0.0; 2], |f| [0, 1].map(|axis| f.to_m[axis] - f.from_m[axis]))
}

/// Fig. 12.
pub fn from_behind(study: &Study) -> Figure {
    let pushed = &study.pushes[0];
    let (gone, footstep) = (pushed.way().unwrap_or_default(), pushed.film.record.footsteps.first());
    let foot = footstep.map_or("no", |f| f.foot.name());
    let home = Home::new(study);
    let reach = footstep.map_or([0.0; 2], |f| home.reaches(f.zmp_error_m.into()));
    let ways = format!("could go {} mm, the right one {} mm", short(1e3 * reach[0], 1), short(1e3 * reach[1], 1));
    let is_tie = (reach[0] - reach[1]).abs() < 1e-4;
    let quoted = Quote("The right foot is chosen as swinging foot.", "Sect. VI.B");
    let is_right = footstep.is_some_and(|f| f.foot == Foot::Right);
    let swinging = if is_tie && is_right {
        Claim::open(
            quoted,
            format!(
                "The right foot. The left foot {ways}: a tie, which step 4 of Sect. V.B gives to the left foot. A tie goes \
                 to the less loaded foot here, else to the right one, to be like this experiment: so this is no finding."
            ),
        )
    } else {
        let told = format!("The {foot} foot. The left foot {ways}.");
        Claim::judged(quoted, is_right, told.clone(), told)
    };
    let claims = vec![
        Claim::judged(
            Quote("a disturbance was imposed from backward and the robot steps forward.", "Sect. VI.B"),
            gone[0] > 0.0,
            format!("The foot goes {}.", walked(gone)),
            format!("The foot goes {}.", walked(gone)),
        ),
        swinging,
        outcome(pushed),
        magnitude(pushed),
    ];
    strip("12", "fig12-push-behind.svg", "Pushed from behind", study, pushed, claims, json!({}))
}

/// Fig. 13.
pub fn from_diagonal(study: &Study) -> Figure {
    let pushed = &study.pushes[1];
    let (gone, footstep) = (pushed.way().unwrap_or_default(), pushed.film.record.footsteps.first());
    let foot = footstep.map_or("no", |f| f.foot.name());
    let yaw_deg = |s: &Snapshot| {
        let ahead = s.posture.base.rotation * Vector3::x();
        ahead.y.atan2(ahead.x).to_degrees()
    };
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
    let claims = vec![
        Claim::judged(
            Quote(
                "disturbance was imposed from diagonally forward left and the right foot is chosen as swinging foot",
                "Sect. VI.B",
            ),
            footstep.is_some_and(|f| f.foot == Foot::Right),
            "The right foot.".into(),
            format!("The {foot} foot."),
        ),
        Claim::judged(
            Quote("the robot stepped diagonally backward right.", "Fig. 13"),
            gone[0] < 0.0 && gone[1] < 0.0,
            format!("The foot goes {}.", walked(gone)),
            format!("The foot goes {}.", walked(gone)),
        ),
        Claim::judged(
            Quote("it was seen that the robot rotated around the yaw axis, slightly.", "Sect. VI.B"),
            SLIGHT_DEG.contains(&most.abs()),
            yaw.clone(),
            yaw,
        ),
        outcome(pushed),
        magnitude(pushed),
    ];
    let numbers = json!({ "most_yaw_deg": most, "last_yaw_deg": last });
    strip("13", "fig13-push-diagonal.svg", "Pushed from diagonally forward left", study, pushed, claims, numbers)
}

/// What "slightly" is taken for (degrees): less is no turn.
const SLIGHT_DEG: RangeInclusive<f64> = 1.0..=15.0;

fn outcome(pushed: &Pushed) -> Claim {
    let record = &pushed.film.record;
    let alone = match pushed.without_footstep.fell_at_s {
        Some(at) => format!("Without the footstep the same gains fall at {} s.", short(at, 2)),
        None => "Without the footstep the same gains stay up, too.".into(),
    };
    let landed = record.footsteps.first().is_some_and(|f| f.in_set_at_landing);
    let sets = if landed { "inside" } else { "outside" };
    let still =
        record.settled_at_s.map_or_else(String::new, |at| format!(", and stands still from {} s", short(at, 2)));
    let is_up = record.outcome == Outcome::Recovered;
    let with =
        if is_up { format!("It lands {sets} the new sets{still}.") } else { "The robot does not recover.".into() };
    let told = format!("{with} {alone}");
    Claim::judged(
        Quote("In order to avoid falling, it is necessary for the robot to step", "Sect. V.A"),
        is_up && pushed.without_footstep.fell_at_s.is_some(),
        told.clone(),
        told,
    )
}

fn magnitude(pushed: &Pushed) -> Claim {
    Claim::open(
        Remark("The paper does not print how hard it pushed."),
        format!(
            "Here {} N s within {} ms at the height of the COM, towards {} degrees (0 is forward, 90 to the \
             left). The paper's robot was real; this one is simulated, its batteries, servos and friction assumed.",
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
        let camera = camera(0.5 * footstep.to_m[0], 0.5 * (footstep.to_m[1] - footstep.from_m[1]));
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
            let image = draw(&study.robot, &snapshots[i], &camera, fine(MARKED[0], MARKED[1]), &Marks::ALL);
            times.push(snapshots[i].time_s);
            panels.push(snapshot(&image, MARKED, &format!("{:.3} s", snapshots[i].time_s), what));
        }
    }
    let mut numbers = json!({
        "push": pushed.push, "outcome": record.outcome, "footsteps": record.footsteps,
        "settled_at_s": record.settled_at_s, "snapshots_s": times,
        "without_footstep_fell_at_s": pushed.without_footstep.fell_at_s,
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
        columns: MARKED_COLUMNS,
        table: None,
        claims,
        numbers,
    }
}
