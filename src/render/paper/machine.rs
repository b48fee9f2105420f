//! Fig. 7: the robot, its joints, and how its feet stand at first.

use super::super::html::svg::short;
use super::figure::Said::{Quote, Remark};
use super::figure::{Claim, Figure, Table};
use super::panel::{Ground, Panel};
use super::pictures;
use super::study::Study;
use crate::render::picture::{Camera, draw_posture, png};
use crate::robot::{Foot, Joint, Kinematics, Posture, Robot, Shape};
use nalgebra::{Point3, Vector3};
use serde_json::json;

/// What the paper prints.
const PAPER_HEIGHT_M: f64 = 0.54;
const PAPER_JOINTS: [usize; 3] = [20, 4, 6];

const WIDTH: f64 = 400.0;
const HEIGHT: f64 = 560.0;
/// Half of a joint's axis as it is drawn (m).
const AXIS_M: f64 = 0.022;

/// An axis whose largest part is more is along that one.
const ALONG: f64 = 0.99;

/// Fig. 7.
pub fn figure(study: &Study) -> Figure {
    let robot = &study.robot;
    let limb = |words: [&str; 3]| {
        let of_limb = |joint: &&Joint| words.iter().any(|word| joint.name.starts_with(&format!("left_{word}")));
        robot.joints.iter().filter(of_limb).count()
    };
    let [arm, leg] = [limb(["shoulder", "elbow", "wrist"]), limb(["hip", "knee", "ankle"])];
    let joints = [robot.joints.len(), arm, leg];
    let (height_m, mass_kg) = (height(robot), robot.mass());
    let stance = study.stance();
    let sole = robot.soles.left.half_m.map(|half| 2.0 * half);
    let claims = vec![
        Claim::judged(
            Quote("Number of joints : 20 (4 at each arms, 6 at each legs)", "Fig. 7"),
            joints == PAPER_JOINTS,
            format!("{} joints, {} at each arm, {} at each leg.", joints[0], joints[1], joints[2]),
            format!("{} joints, {} at each arm, {} at each leg.", joints[0], joints[1], joints[2]),
        ),
        Claim::open(
            Quote("Weight : 8.0[kg]", "Fig. 7"),
            format!(
                "{mass_kg:.1} kg, because the published links were filled up to what is printed: {}.",
                robot.assumptions.first().map_or("", String::as_str)
            ),
        ),
        Claim::open(
            Quote("Height : 54[mm]", "Fig. 7"),
            format!(
                "Read as 0.54 m. The model is {} m high with straight legs, by its solids, which are those that its \
                 designer published: {} % from that reading.",
                short(height_m, 3),
                short(100.0 * (height_m / PAPER_HEIGHT_M - 1.0).abs(), 1)
            ),
        ),
        Claim::open(
            Remark("The initial foot placement is in the picture only."),
            format!(
                "Here the soles are {} by {} mm, their centres {} mm apart, side by side; the knees are bent by \
                 {} degrees and the COM is {} mm high.",
                short(1e3 * sole[0], 0),
                short(1e3 * sole[1], 0),
                short(1e3 * stance.y, 0),
                short(bend_deg(robot), 0),
                short(1e3 * robot.home_com_height(), 0)
            ),
        ),
    ];
    let rows =
        robot.joints.iter().enumerate().filter(|(_, joint)| joint.name.starts_with("left_")).map(|(i, joint)| {
            let deg = |rad: f64| short(rad.to_degrees(), 0);
            vec![
                joint.name.trim_start_matches("left_").replace('_', " "),
                axis_name(joint).into(),
                format!("{} to {}", deg(joint.lower_rad), deg(joint.upper_rad)),
                deg(robot.home_rad[i]),
                short(robot.servos[i].torque_n_m, 1),
            ]
        });
    Figure {
        number: "7",
        file: "fig07-robot.svg",
        title: "The robot, its joints, and the initial foot placement",
        reading: "UT-\u{3bc}2 at home, from the solids of its model; the axes of its joints in the same view, \
        coloured by what they are along with all joints at zero; the soles from above. The table has the left half; the right one mirrors it."
            .into(),
        panels: vec![view(robot), skeleton(robot), placement(study)],
        columns: 3,
        table: Some(Table {
            head: ["joint", "axis, joints at zero", "range [deg]", "at home [deg]", "torque [N m]"].map(String::from).into(),
            rows: rows.collect(),
        }),
        claims,
        numbers: json!({
            "joints": joints[0],
            "joints_arm": arm,
            "joints_leg": leg,
            "mass_kg": mass_kg,
            "height_m": height_m,
            "sole_m": sole,
            "feet_apart_m": stance.y,
            "com_height_m": robot.home_com_height(),
        }),
    }
}

/// From the soles to the highest point of a solid, joints at zero (m).
fn height(robot: &Robot) -> f64 {
    let posture = robot.zero_posture();
    let mut kinematics = Kinematics::new(robot);
    kinematics.update(robot, &posture);
    let tops = robot.links.iter().enumerate().flat_map(|(i, link)| {
        let pose = *kinematics.link_pose(i);
        link.visuals.iter().map(move |solid| {
            let pose = pose * solid.pose;
            let up = pose.rotation.inverse() * Vector3::z();
            pose.translation.z
                + match solid.shape {
                    Shape::Box { half } => half.component_mul(&up.abs()).sum(),
                    Shape::Cylinder { radius, length } => radius * up.xy().norm() + 0.5 * length * up.z.abs(),
                    Shape::Sphere { radius } => radius,
                }
        })
    });
    tops.fold(f64::NEG_INFINITY, f64::max) - kinematics.sole_pose(robot, Foot::Left).translation.z
}

fn bend_deg(robot: &Robot) -> f64 {
    let knee = robot.joints.iter().position(|joint| joint.name == "left_knee_flexion");
    knee.map_or(0.0, |i| robot.home_rad[i].to_degrees())
}

/// By what a joint turns its limb with all joints at zero: one axis of the robot, or none of them.
fn axis_name(joint: &Joint) -> &'static str {
    let names = ["roll", "pitch", "yaw"];
    if joint.axis.amax() > ALONG { names[joint.axis.iamax()] } else { "oblique" }
}

fn camera() -> Camera {
    Camera {
        target: Point3::new(0.0, 0.0, 0.262),
        azimuth_deg: 32.0,
        elevation_deg: 14.0,
        distance_m: 1.5,
        fov_deg: 25.0,
    }
}

fn view(robot: &Robot) -> Panel {
    let image = draw_posture(robot, &robot.home_posture(), &camera(), pictures::fine(WIDTH, HEIGHT));
    let mut panel = Panel::new(WIDTH, HEIGHT);
    panel.image([0.0, 0.0], [WIDTH, HEIGHT], &png(&image), "the robot at home");
    panel
}

/// The joints' axes in the view of the picture.
fn skeleton(robot: &Robot) -> Panel {
    let posture: Posture = robot.home_posture();
    let mut kinematics = Kinematics::new(robot);
    kinematics.update(robot, &posture);
    let mut panel = Panel::new(WIDTH, HEIGHT);
    let size = [WIDTH as u32, HEIGHT as u32];
    let seen = |point: Point3<f64>| camera().project(point, size).unwrap_or_default();
    for foot in Foot::BOTH {
        let pose = kinematics.sole_pose(robot, foot);
        let corners = robot.soles[foot].corners().map(|corner| seen(pose * corner));
        panel.polygon("sole", &corners);
        let link = robot.soles[foot].link;
        panel.line("bone", seen(kinematics.joint_position(link - 1)), seen(pose.translation.vector.into()));
    }
    for (i, joint) in robot.joints.iter().enumerate() {
        let from = match joint.parent {
            0 => kinematics.link_com(0),
            parent => kinematics.joint_position(parent - 1),
        };
        panel.line("bone", seen(from), seen(kinematics.joint_position(i)));
    }
    for foot in Foot::BOTH {
        let [x, y] = seen(kinematics.sole_pose(robot, foot) * Point3::new(0.075, 0.0, 0.0));
        panel.text("small", [x, y + 6.0], foot.name());
    }
    for (i, joint) in robot.joints.iter().enumerate() {
        let (at, axis) = (kinematics.joint_position(i), kinematics.joint_axis(i));
        panel.line(&format!("joint {}", axis_name(joint)), seen(at - AXIS_M * axis), seen(at + AXIS_M * axis));
        panel.circle(axis_name(joint), seen(at), 3.0);
    }
    for ((class, words), y) in
        [("roll", "along x: roll"), ("pitch", "along y: pitch"), ("yaw", "along z: yaw"), ("oblique", "oblique")]
            .into_iter()
            .zip([24.0, 44.0, 64.0, 84.0])
    {
        panel.line(&format!("joint {class}"), [16.0, y - 4.0], [42.0, y - 4.0]);
        panel.text("start", [50.0, y], words);
    }
    panel
}

fn placement(study: &Study) -> Panel {
    let (mut panel, ground) = Ground::panel(WIDTH, [-0.115, 0.115], [-0.11, 0.11]);
    ground.draw(&mut panel, "Initial foot placement");
    let half = study.robot.soles.left.half_m;
    for foot in Foot::BOTH {
        let y = 0.5 * foot.side() * study.stance().y;
        panel.polygon("sole", &ground.all(study.sole().map(|[x, across]| [x, y + across])));
        panel.circle("frame", ground.at([0.0, y]), 3.0);
        let [x, y] = ground.at([0.018, y]);
        panel.text("", [x, y], foot.name());
    }
    panel.polygon("support", &ground.all(study.home.vertices().iter().map(|v| [v.x, v.y])));
    let mm = |m: f64| format!("{} mm", short(1e3 * m, 1));
    let side = 0.5 * study.stance().y;
    let across = [ground.at([-0.022, side]), ground.at([-0.022, -side])];
    panel.arrow("axis", across[0], across[1]);
    panel.arrow("axis", across[1], across[0]);
    let [x, y] = ground.at([-0.031, 0.0]);
    panel.text("small halo", [x, y], &mm(2.0 * side));
    let [x, y] = ground.at([half[0] + 0.006, side]);
    panel.text("small", [x, y], &mm(2.0 * half[1]));
    let [x, y] = ground.at([0.0, side + half[1] + 0.006]);
    panel.text_up("small", [x, y], &mm(2.0 * half[0]));
    let com = {
        let mut kinematics = Kinematics::new(&study.robot);
        kinematics.update(&study.robot, &study.robot.home_posture());
        kinematics.com()
    };
    panel.circle("com", ground.at([com.x, com.y]), 4.0);
    let [x, y] = ground.at([com.x + 0.008, com.y]);
    panel.text("com small halo", [x, y], "COM");
    panel
}
