//! Snapshots, and those of the imposed errors: Fig. 8.

use super::super::html::svg::short;
use super::decision::Home;
use super::figure::Said::{Quote, Remark};
use super::figure::{Claim, Figure, walked};
use super::panel::Panel;
use super::study::{ImposedRun, Study};
use crate::render::picture::{Camera, draw_posture, png};
use crate::robot::{Foot, Posture};
use image::RgbImage;
use nalgebra::{Point3, Vector2};
use serde_json::json;

/// Of a snapshot (px).
const SIZE: [f64; 2] = [200.0, 270.0];
/// Of the camera (degrees).
const VIEW_DEG: f64 = 22.5;
/// For the words below it.
const BELOW: f64 = 40.0;
/// Dots of a picture to a px of the page.
const FINE: f64 = 2.0;
/// Snapshots in a row.
const COLUMNS: usize = 6;

/// Size of a picture that is shown `width` by `height` px.
pub fn fine(width: f64, height: f64) -> [u32; 2] {
    [width, height].map(|side| (FINE * side) as u32)
}

/// From the robot's front right, at a point over the ground (m); it does not follow the robot, so that a footstep is seen
/// as one.
pub fn camera([x_m, y_m]: [f64; 2], fov_deg: f64) -> Camera {
    Camera { target: Point3::new(x_m, y_m, 0.255), azimuth_deg: -48.0, elevation_deg: 12.0, distance_m: 1.7, fov_deg }
}

pub fn snapshot(image: &RgbImage, [width, height]: [f64; 2], time: &str, what: &str) -> Panel {
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
        let camera = camera([0.5 * footstep.to_m[0], 0.5 * (footstep.to_m[1] - footstep.from_m[1])], VIEW_DEG);
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
            let mut panel = snapshot(&image, SIZE, &format!("{name}  {time_s:.3} s"), what);
            start_marks(study, &camera, &mut panel);
            panels.push(panel);
        }
    }
    let [a, b] = study.errors.each_ref().map(|run| {
        let foot = run.record.footsteps.first().map_or("no", |footstep| footstep.foot.name());
        (foot, way_of(run), format!("The {foot} foot goes {}.", walked(way_of(run))))
    });
    let printed = Home::new(study).choose(Vector2::new(0.03, 0.0685)).map(|footstep| footstep.foot);
    let detected = study.moving.each_ref().map(|record| {
        let first = record.footsteps.first().map(|f| f.lift_s).or(record.unfinished_footstep.map(|f| f.lift_s));
        first.map_or("no foot is lifted".into(), |at| format!("a foot is lifted at {} s", short(at, 3)))
    });
    let claims = vec![
        Claim::judged(
            Quote(
                "The stepping necessity was detected and a backward stepping motion was generated automatically.",
                "Sect. V.C, of (a)",
            ),
            a.1[0] < 0.0,
            format!("Judged by the direction alone. {}", a.2),
            format!("Judged by the direction alone. {}", a.2),
        ),
        Claim::open(
            Quote("The stepping necessity was detected", "Sect. V.C, of (a)"),
            format!(
                "Not here: the COM rests, inside of all sets, and the footstep is told of the error. With a COM that moves such \
                 that the error arises (Fig. 9) the sets themselves detect it: (a) {}, (b) {}.",
                detected[0], detected[1]
            ),
        ),
        Claim::open(
            Quote(
                "The right foot was chosen as swinging foot based on proposed determination algorithm.",
                "Sect. V.C, of (b)",
            ),
            format!("{} But the signs of the error were read such that it is the {} foot: no finding.", b.2, b.0),
        ),
        Claim::open(
            Quote(
                "we set ZMP error to be \u{394}p_Z = [0.03 0.685 0]\u{1d40} assuming that a disturbance imposed from \
                 diagonally forward left.",
                "Sect. V.C",
            ),
            format!(
                "As printed its signs lead to the {} foot by eq. 27 to 29, and 0.685 m is more than the robot is high. \
                 Read as [\u{2212}30 \u{2212}68.5] mm: where the robot is driven, as in (a).",
                printed.map_or("no", Foot::name)
            ),
        ),
        Claim::open(
            Quote(
                "we set ZMP error to be \u{394}p_Z = [\u{2212}0.03 0 0]\u{1d40} assuming that a disturbance imposed \
                 backward.",
                "Sect. V.C",
            ),
            "The captions of Fig. 8 and 9 have (a) imposed \u{201c}from backward\u{201d}, words that go with a step forward in \
             Fig. 12. Read by the text: (a) drives the robot backward."
                .into(),
        ),
        Claim::open(
            Remark("The paper does not say how the COM moves as the error is imposed."),
            "Here it rests, and the error is told to the footstep alone; Fig. 9 has what comes of it if the COM moves.".into(),
        ),
    ];
    Figure {
        number: "8",
        file: "fig08-imposed.svg",
        title: "Snapshots of the imposed errors",
        reading: format!(
            "Whole body motion by inverse kinematics on the ideal pendulum, without physics, seen from the \
             robot's front right: (a) error that drives backward, (b) error from diagonally forward left. The COM rests as \
             the error is imposed; the body's is at most {} mm from the pendulum's. Dashed: where the soles stood.",
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

/// Where the soles stood at first, on the floor of a snapshot.
fn start_marks(study: &Study, camera: &Camera, panel: &mut Panel) {
    for foot in Foot::BOTH {
        let y = 0.5 * foot.side() * study.stance().y;
        let corners = study.sole().map(|[x, across]| Point3::new(x, y + across, 0.0));
        let seen = corners.map(|corner| camera.project(corner, SIZE.map(|side| side as u32)).unwrap_or_default());
        panel.polygon("stood", &seen);
    }
}

fn posture_at(run: &ImposedRun, at_s: f64) -> (f64, &Posture) {
    let i = run.ticks.partition_point(|(time_s, ..)| *time_s < at_s - 1e-9).min(run.ticks.len() - 1);
    (run.ticks[i].0, &run.ticks[i].1)
}

fn way_of(run: &ImposedRun) -> [f64; 2] {
    run.record.footsteps.first().map_or([0.0; 2], |f| [0, 1].map(|axis| f.to_m[axis] - f.from_m[axis]))
}
