//! Pictures of the robot as lines: its joints (Fig. 7), and snapshots of its runs (Fig. 8, 12 and 13).

use super::feet;
use super::study::{ImposedRun, Pushed, Study};
use nalgebra::{Point3, Vector2};
use standfast::core::robot::{Foot, Joint, Kinematics, Robot};
use standfast::report::figure::panel::{LegendSample, Panel};
use standfast::report::figure::skeleton::{View, draw, draw_moment};
use standfast::scene::Stage;
use standfast::scene::palette::Overlay;
use standfast::sim::Ground;
use standfast::sim::episode::{Footstep, Snapshot};

/// Size of the picture of the joints (px), and its view of the robot at home: directions to the eye (degrees), and scale
/// (px for each m).
const SIZE: [f64; 2] = [400.0, 560.0];
const AT_HOME: ([f64; 2], f64) = ([32.0, 14.0], 840.0);
/// Height of the middle of a picture over the ground (m).
const MIDDLE_M: f64 = 0.262;
/// Half the length of a joint's axis in the picture (m).
const AXIS_M: f64 = 0.022;
/// Smallest component of an axis along x, y or z for which the axis counts as parallel to x, y or z.
const ALONG: f64 = 0.99;

/// Direction from the robot's runs to the eye (degrees): its front right.
const OF_RUNS_DEG: [f64; 2] = [-48.0, 12.0];
/// Size of a snapshot (px) and scale (px for each m), without and with marks.
const PLAIN: ([f64; 2], f64) = ([200.0, 270.0], 400.0);
const MARKED: ([f64; 2], f64) = ([340.0, 440.0], 540.0);
/// Offset of the view to the side from which the push comes (m), so that the arrow of the push is in the picture.
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
    vec![joints(&study.robot), feet::placement(study, SIZE[0])]
}

/// The robot at home, with the axes of its joints.
fn joints(robot: &Robot) -> Panel {
    let kinematics = Kinematics::at_home(robot);
    let mut panel = Panel::new(SIZE[0], SIZE[1]);
    let ((way_deg, px_per_m), target) = (AT_HOME, Point3::new(0.0, 0.0, MIDDLE_M));
    let view = View::new(way_deg, px_per_m, target, SIZE.map(|side| side / 2.0));
    draw(&mut panel, robot, &robot.home_posture(), &view);
    for foot in Foot::BOTH {
        let toe = kinematics.sole_pose(robot, foot) * Point3::new(0.075, 0.0, 0.0);
        panel.text("small", view.at(&toe), [0.0, 6.0], foot.name());
    }
    for (i, joint) in robot.joints.iter().enumerate() {
        let (at, axis) = (
            kinematics.joint_position(i),
            AXIS_M * kinematics.joint_axis(i),
        );
        panel.line(
            &format!("joint {}", axis_name(joint)),
            view.at(&(at - axis)),
            view.at(&(at + axis)),
        );
        panel.circle(axis_name(joint), view.at(&at), 3.0);
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
    let (size, px_per_m) = PLAIN;
    let Footstep {
        lift_s: lift,
        land_s: land,
        ..
    } = run.footstep;
    let end_s = run.record.home_at_s.unwrap_or(land + 0.6);
    let view = view(middle(&run.footstep), size, px_per_m);
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
        let mut panel = snapshot(size, &format!("{name}  {time_s:.3} s"), what);
        // The outlines of the soles where they stood at first.
        for foot in Foot::BOTH {
            let corners = study
                .sole()
                .map(|corner| study.sole_at_home(foot) + corner.coords);
            let on_floor = corners.map(|corner| Point3::new(corner.x, corner.y, 0.0));
            panel.polygon("stood", on_floor.map(|at| view.at(&at)));
        }
        draw(&mut panel, &study.robot, posture, &view);
        panel
    })
}

/// The panels of Fig. 12 or 13.
pub fn pushed(study: &Study, pushed: &Pushed) -> Vec<Panel> {
    let (size, px_per_m) = MARKED;
    let over = middle(&pushed.footstep) - ARROW_M * pushed.push.direction().xy();
    let view = view(over, size, px_per_m);
    let stage = Stage::new(&study.robot, Ground::default());
    let mut panels = Vec::new();
    for (i, what) in pushed.moments() {
        let moment = &pushed.film.snapshots[i];
        let mut panel = snapshot(size, &format!("{:.3} s", moment.time_s), what);
        draw_moment(&mut panel, &stage, moment, &view, &Overlay::ALL);
        panels.push(panel);
    }
    panels
}

/// Point of the ground over which a view shows the whole of a footstep (m).
fn middle(footstep: &Footstep) -> Vector2<f64> {
    0.5 * Vector2::new(footstep.to_m[0], footstep.to_m[1] - footstep.from_m[1])
}

/// A view of a point over the ground (m). It does not follow the robot, so that the pictures show how far it moves.
fn view(over: Vector2<f64>, size: [f64; 2], px_per_m: f64) -> View {
    let target = Point3::new(over.x, over.y, MIDDLE_M);
    View::new(OF_RUNS_DEG, px_per_m, target, size.map(|side| side / 2.0))
}

/// An empty picture with its time and words below.
fn snapshot([width, height]: [f64; 2], time: &str, what: &str) -> Panel {
    let mut panel = Panel::new(width, height + 40.0);
    panel.text("title", [0.5 * width, height + 17.0], [0.0, 0.0], time);
    panel.text("small", [0.5 * width, height + 33.0], [0.0, 0.0], what);
    panel
}
