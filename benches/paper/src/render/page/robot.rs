//! Pictures of the robot: its solids and joints (Fig. 7), and snapshots of its runs (Fig. 8, 12 and 13).

use super::feet;
use super::study::{ImposedRun, Pushed, Study};
use image::RgbImage;
use nalgebra::{Point3, Vector2};
use standfast::core::robot::{Foot, Joint, Kinematics, Robot};
use standfast::pictures::scene::palette::Overlay;
use standfast::pictures::{Camera, draw, draw_posture, png};
use standfast::report::figure::panel::{LegendSample, Panel};
use standfast::sim::episode::{Footstep, Snapshot};

/// Dots of a picture for each px of the page.
const FINE: f64 = 2.0;
/// Size of the panels of Fig. 7 (px).
const SIZE: [f64; 2] = [400.0, 560.0];
/// Camera of Fig. 7, which shows the robot at home.
const AT_HOME: Camera = Camera {
    target: Point3::new(0.0, 0.0, 0.262),
    azimuth_deg: 32.0,
    elevation_deg: 14.0,
    distance_m: 1.5,
    fov_deg: 25.0,
};
/// Half the length of a joint's axis in the picture (m).
const AXIS_M: f64 = 0.022;
/// Smallest component of an axis along x, y or z for which the axis counts as parallel to x, y or z.
const ALONG: f64 = 0.99;

/// Size of a snapshot (px) and field of view of its camera (degrees), without and with marks.
const PLAIN: ([f64; 2], f64) = ([200.0, 270.0], 22.5);
const MARKED: ([f64; 2], f64) = ([340.0, 440.0], 27.0);
/// Offset of the camera to the side from which the push comes (m), so that the arrow of the push is in the picture.
const ARROW_M: f64 = 0.07;

/// Name of the axis of a joint with all joints at zero: roll, pitch or yaw, or oblique if the axis is parallel to none
/// of x, y and z.
pub fn axis_name(joint: &Joint) -> &'static str {
    if joint.axis.amax() > ALONG {
        ["roll", "pitch", "yaw"][joint.axis.iamax()]
    } else {
        "oblique"
    }
}

/// The panels of Fig. 7.
pub fn machine(study: &Study) -> Vec<Panel> {
    let mut view = Panel::new(SIZE[0], SIZE[1]);
    let image = draw_posture(
        &study.robot,
        &study.robot.home_posture(),
        &AT_HOME,
        fine(SIZE),
    );
    view.image(SIZE, &png(&image), "the robot at home");
    vec![
        view,
        skeleton(&study.robot),
        feet::placement(study, SIZE[0]),
    ]
}

/// Size of a picture in dots, from its size on the page (px).
fn fine(size: [f64; 2]) -> [u32; 2] {
    size.map(|side| (FINE * side) as u32)
}

/// The axes of the joints, seen by the same camera as the picture.
fn skeleton(robot: &Robot) -> Panel {
    let kinematics = Kinematics::at_home(robot);
    let mut panel = Panel::new(SIZE[0], SIZE[1]);
    let seen = |point: Point3<f64>| {
        AT_HOME
            .project(point, SIZE.map(|side| side as u32))
            .unwrap_or_default()
    };
    for foot in Foot::BOTH {
        let (pose, sole) = (kinematics.sole_pose(robot, foot), &robot.soles[foot]);
        panel.polygon("sole", sole.corners().map(|corner| seen(pose * corner)));
        panel.line(
            "bone",
            seen(kinematics.joint_position(sole.link - 1)),
            seen(pose.translation.vector.into()),
        );
    }
    for (i, joint) in robot.joints.iter().enumerate() {
        let from = match joint.parent {
            0 => kinematics.link_com(0),
            parent => kinematics.joint_position(parent - 1),
        };
        panel.line("bone", seen(from), seen(kinematics.joint_position(i)));
    }
    for foot in Foot::BOTH {
        let toe = kinematics.sole_pose(robot, foot) * Point3::new(0.075, 0.0, 0.0);
        panel.text("small", seen(toe), [0.0, 6.0], foot.name());
    }
    for (i, joint) in robot.joints.iter().enumerate() {
        let (at, axis) = (
            kinematics.joint_position(i),
            AXIS_M * kinematics.joint_axis(i),
        );
        panel.line(
            &format!("joint {}", axis_name(joint)),
            seen(at - axis),
            seen(at + axis),
        );
        panel.circle(axis_name(joint), seen(at), 3.0);
    }
    let key =
        |class: &str, words: &str| (format!("joint {class}"), LegendSample::Line, words.into());
    let axes = [
        ("roll", "along x: roll"),
        ("pitch", "along y: pitch"),
        ("yaw", "along z: yaw"),
        ("oblique", "oblique"),
    ];
    panel.legend([16.0, 12.0], &axes.map(|(class, words)| key(class, words)));
    panel
}

/// The panels of Fig. 8.
pub fn imposed(study: &Study) -> Vec<Panel> {
    let runs = study.errors.iter().zip(["(a)", "(b)"]);
    runs.flat_map(|(run, name)| imposed_strip(study, run, name))
        .collect()
}

fn imposed_strip(study: &Study, run: &ImposedRun, name: &str) -> [Panel; 6] {
    let (size, fov_deg) = PLAIN;
    let Footstep {
        lift_s: lift,
        land_s: land,
        ..
    } = run.footstep;
    let end_s = run.record.home_at_s.unwrap_or(land + 0.6);
    let camera = camera(middle(&run.footstep), fov_deg);
    [
        (lift, "error imposed"),
        (lift + 0.3 * (land - lift), "foot in the air"),
        (lift + 0.65 * (land - lift), "foot in the air"),
        (land, "landed"),
        (0.5 * (land + end_s), "switching control"),
        (end_s, "COM home"),
    ]
    .map(|(at, what)| {
        let moments = &run.motion.moments;
        let i = moments
            .partition_point(|moment| moment.time_s < at - 1e-9)
            .min(moments.len() - 1);
        let Snapshot {
            time_s, posture, ..
        } = &moments[i];
        let image = draw_posture(&study.robot, posture, &camera, fine(size));
        let mut panel = snapshot(&image, size, &format!("{name}  {time_s:.3} s"), what);
        // The outlines of the soles where they stood at first.
        for foot in Foot::BOTH {
            let corners = study
                .sole()
                .map(|corner| study.sole_at_home(foot) + corner.coords);
            let on_floor = corners.map(|corner| Point3::new(corner.x, corner.y, 0.0));
            let seen = on_floor.map(|at| {
                camera
                    .project(at, size.map(|side| side as u32))
                    .unwrap_or_default()
            });
            panel.polygon("stood", seen);
        }
        panel
    })
}

/// The panels of Fig. 12 or 13.
pub fn pushed(study: &Study, pushed: &Pushed) -> Vec<Panel> {
    let (size, fov_deg) = MARKED;
    let camera = camera(
        middle(&pushed.footstep) - ARROW_M * pushed.push.direction().xy(),
        fov_deg,
    );
    let mut panels = Vec::new();
    for (i, what) in pushed.moments() {
        let moment = &pushed.film.snapshots[i];
        let image = draw(&study.robot, moment, &camera, fine(size), &Overlay::ALL);
        let time = format!("{:.3} s", moment.time_s);
        panels.push(snapshot(&image, size, &time, what));
    }
    panels
}

/// Point of the ground over which a camera sees the whole of a footstep (m).
fn middle(footstep: &Footstep) -> Vector2<f64> {
    0.5 * Vector2::new(footstep.to_m[0], footstep.to_m[1] - footstep.from_m[1])
}

/// A camera at the robot's front right that looks at a point over the ground (m). It does not follow the robot, so that
/// the pictures show how far it moves.
fn camera(over: Vector2<f64>, fov_deg: f64) -> Camera {
    let target = Point3::new(over.x, over.y, 0.255);
    Camera {
        target,
        azimuth_deg: -48.0,
        elevation_deg: 12.0,
        distance_m: 1.7,
        fov_deg,
    }
}

fn snapshot(image: &RgbImage, [width, height]: [f64; 2], time: &str, what: &str) -> Panel {
    let mut panel = Panel::new(width, height + 40.0);
    panel.image([width, height], &png(image), &format!("{time}: {what}"));
    panel.text("title", [0.5 * width, height + 17.0], [0.0, 0.0], time);
    panel.text("small", [0.5 * width, height + 33.0], [0.0, 0.0], what);
    panel
}
