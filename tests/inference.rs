//! The settings of a robot that are inferred from its URDF alone.

use crate::common::program::{PROGRAM, Run, files, folder, short, standfast, stderr, stdout};
use serde_json::Value;
use standfast::core::robot::swing_time::least_swing_time_s;
use standfast::core::robot::{Foot, Kinematics, LandingRegion, Robot};
use standfast::files::assets::{self, InputKind, Source};
use standfast::robots::urdf::{Files, inferred};
use std::fs;
use std::path::Path;
use std::process::Command;

const CHILD: &str = include_str!("../assets/robots/child.urdf");

fn robot_of(urdf: &Source) -> Robot {
    standfast::robots::parse(urdf, &inferred(urdf, None).unwrap()).unwrap()
}

fn child() -> Source {
    Source {
        file: "builtin:child".into(),
        text: CHILD.into(),
    }
}

#[track_caller]
fn near(what: &str, value: f64, expected: f64, share: f64) {
    assert!(
        (value - expected).abs() <= share * expected.abs() + 1e-12,
        "{what}: {value}, not about {expected}"
    );
}

/// The rules of the inference are the rules by which the settings of UT-mu2 were chosen.
#[test]
fn the_settings_of_ut_mu2_are_inferred() {
    let stated = standfast::robots::load("ut-mu2").unwrap();
    let found = robot_of(&assets::open(InputKind::Robot, "ut-mu2").unwrap());
    assert_eq!(
        (found.trunk, found.friction, found.noise),
        (stated.trunk, stated.friction, stated.noise)
    );
    near("delay", found.delay_s, stated.delay_s, 0.0);
    near(
        "COM height",
        found.home_com_height(),
        stated.home_com_height(),
        0.03,
    );
    for foot in Foot::BOTH {
        let (a, b) = (found.soles[foot], stated.soles[foot]);
        assert!(
            a.frame == b.frame && a.half_m == b.half_m && a.center == b.center,
            "{a:?} {b:?}"
        );
    }
    for (joint, (a, b)) in stated
        .joints
        .iter()
        .zip(found.servos.iter().zip(&stated.servos))
    {
        near(&joint.name, a.kp, b.kp, 0.02);
        near(&joint.name, a.kd, b.kd, 0.02);
        near(&joint.name, a.torque_n_m, b.torque_n_m, 0.0);
        near(
            &joint.name,
            a.full_torque_speed_rad_s,
            b.full_torque_speed_rad_s,
            0.0,
        );
        near(
            &joint.name,
            a.no_torque_speed_rad_s,
            b.no_torque_speed_rad_s,
            0.0,
        );
        near(
            &joint.name,
            a.rotor_inertia_kg_m2,
            b.rotor_inertia_kg_m2,
            0.0,
        );
    }
    for ((joint, found), stated) in stated
        .joints
        .iter()
        .zip(&found.home_rad)
        .zip(&stated.home_rad)
    {
        if ["hip", "knee", "ankle"]
            .iter()
            .any(|part| joint.name.contains(part))
        {
            assert!(
                (found - stated).abs() < 0.01,
                "{}: {found}, not {stated}",
                joint.name
            );
        }
    }
    let names: Vec<&str> = found
        .reach
        .iter()
        .map(|region| region.name.as_str())
        .collect();
    assert_eq!(names, ["beside", "in front", "behind"]);
    for (found, stated) in found.reach.iter().zip(&stated.reach) {
        for (a, b) in found
            .x_m
            .iter()
            .chain(&found.y_m)
            .zip(stated.x_m.iter().chain(&stated.y_m))
        {
            assert!((a - b).abs() < 0.02, "{}: {a} m, not {b} m", found.name);
        }
        near(&found.name, found.swing_time_s, stated.swing_time_s, 0.1);
    }
}

/// The motors in UT-mu2's URDF equal the motors that are assumed for a robot of this size. So placeholders in the URDF
/// make no difference.
#[test]
fn placeholders_in_the_place_of_torques_and_speeds_are_not_believed() {
    let urdf = assets::open(InputKind::Robot, "ut-mu2").unwrap();
    let stated = standfast::robots::load("ut-mu2").unwrap();
    for (from, to) in [
        (
            "effort=\"8\" velocity=\"20\"",
            "effort=\"1000\" velocity=\"20\"",
        ),
        ("effort=\"8\"", "effort=\"0\""),
    ] {
        let text = urdf.text.replace(from, to);
        assert_ne!(text, urdf.text);
        let found = robot_of(&Source {
            text,
            ..urdf.clone()
        });
        let knee = found
            .joints
            .iter()
            .position(|joint| joint.name == "left_knee_flexion")
            .unwrap();
        near(
            "torque",
            found.servos[knee].torque_n_m,
            stated.servos[knee].torque_n_m,
            0.02,
        );
        near(
            "speed",
            found.servos[knee].no_torque_speed_rad_s,
            stated.servos[knee].no_torque_speed_rad_s,
            0.02,
        );
        let told = found
            .assumptions
            .iter()
            .any(|assumption| assumption.contains("1000 N m"));
        assert_eq!(told, to.contains("1000"), "{:?}", found.assumptions);
    }
}

/// Joints that turn at a fifth of their speed need 0.4 s to the farthest corner in front of the other foot.
#[test]
fn a_corner_that_costs_more_time_than_it_is_worth_is_no_landing_place() {
    let urdf = assets::open(InputKind::Robot, "ut-mu2").unwrap();
    let text = urdf.text.replace("velocity=\"20\"", "velocity=\"4\"");
    let robot = robot_of(&Source { text, ..urdf });
    let found = &robot.reach[1];
    let worth = |region: &LandingRegion| {
        let time_s = least_swing_time_s(&robot, region).unwrap();
        (0.097 - region.y_m[0]) * (-robot.omega() * time_s).exp()
    };
    let wider = LandingRegion {
        y_m: [found.y_m[0] - 0.008, found.y_m[1]],
        ..found.clone()
    };
    assert!(found.y_m[0] > -0.03, "the legs reach farther: {found:?}");
    assert!(worth(&wider) < worth(found), "{found:?}");
}

#[test]
fn a_child_stands_on_its_soles_with_its_com_above_their_middle() {
    let robot = robot_of(&child());
    assert_eq!(
        robot.links[robot.trunk].name, "pelvis",
        "chest and pelvis are one link"
    );
    let kinematics = Kinematics::at_home(&robot);
    let middle = Foot::BOTH
        .map(|foot| kinematics.sole_pose(&robot, foot).translation.x)
        .iter()
        .sum::<f64>()
        / 2.0;
    assert!(
        (kinematics.com().x - middle).abs() < 1e-4,
        "{}",
        kinematics.com().x - middle
    );
    let knee = robot
        .joints
        .iter()
        .position(|joint| joint.name == "left_knee")
        .unwrap();
    assert!(
        (robot.home_rad[knee].abs() - 0.7).abs() < 1e-9,
        "{}",
        robot.home_rad[knee]
    );
    assert_eq!(robot.reach[0].name, "beside");
}

/// A robot without settings runs with the settings that `init` writes.
#[test]
fn what_init_writes_is_what_a_robot_without_settings_has() {
    let folder = folder();
    let path = folder.path().join("mine.urdf");
    fs::write(&path, CHILD).unwrap();
    let name = path.to_str().unwrap();
    let without = standfast::robots::load(name).unwrap();
    assert!(Files::open(name).unwrap().are_inferred);
    let init = stderr(&standfast(folder.path(), &["init", "mine.urdf"]).success());
    let carried: Vec<f64> = init
        .split_whitespace()
        .filter_map(|word| word.parse().ok())
        .collect();
    assert!(
        init.contains("It stands: with stiff joints")
            && carried[..2].iter().all(|share| (share - 50.0).abs() < 3.0),
        "{init}"
    );
    assert!(!Files::open(name).unwrap().are_inferred);
    assert_eq!(
        format!("{:?}", standfast::robots::load(name).unwrap()),
        format!("{without:?}")
    );

    let again = standfast(folder.path(), &["init", "mine.urdf"]).code(2);
    assert!(
        stderr(&again).contains("mine.toml: this file is there already"),
        "{}",
        stderr(&again)
    );
    fs::write(folder.path().join("mine.toml"), "edited").unwrap();
    standfast(folder.path(), &["init", "mine.urdf", "--force"]).success();
    let printed = standfast(folder.path(), &["init", "mine.urdf", "--dry-run"]).success();
    assert_eq!(
        printed.get_output().stdout,
        fs::read(folder.path().join("mine.toml")).unwrap()
    );
}

/// With knees of 9.5 instead of 22 N m, a child needs three quarters of their torque on one leg.
#[test]
fn a_knee_that_hardly_carries_the_robot_on_one_leg_is_told() {
    let folder = folder();
    let weak = CHILD.replace(
        "lower=\"0\" upper=\"2.3\" effort=\"22\"",
        "lower=\"0\" upper=\"2.3\" effort=\"9.5\"",
    );
    assert_ne!(weak, CHILD);
    for (name, text, share) in [("weak.urdf", weak.as_str(), 76), ("mine.urdf", CHILD, 33)] {
        fs::write(folder.path().join(name), text).unwrap();
        let init = standfast(folder.path(), &["init", name]).success();
        let described = stdout(&init);
        assert!(
            described.contains(&format!(
                "one leg  carries the robot with {share} % of the torque of "
            )),
            "{described}"
        );
        let told = stderr(&init)
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        let warning = format!("_knee needs {share} % of its torque to carry the robot");
        assert_eq!(told.contains(&warning), name == "weak.urdf", "{told}");
    }
}

/// If a robot cannot stand on the soles that were found, the message says so, and what touches the ground.
#[test]
fn what_init_writes_is_tried() {
    let folder = folder();
    let rod = "<link name=\"left_shank\">\n<collision><origin xyz=\"-0.1 0 -0.2\"/><geometry><box size=\"0.02 0.02 0.3\"/></geometry></collision>";
    let urdf = CHILD.replace("<link name=\"left_shank\">", rod);
    assert_ne!(urdf, CHILD);
    fs::write(folder.path().join("rod.urdf"), urdf).unwrap();
    let told = stderr(&standfast(folder.path(), &["init", "rod.urdf"]).code(2));
    let told = told.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        told.contains("with stiff joints it falls without a push, at 0.00"),
        "{told}"
    );
    assert!(
        told.contains("left_shank touched the ground") && told.contains("reaches below the soles"),
        "{told}"
    );
    assert!(
        told.contains("--dry-run prints the settings") && !told.contains("It stands"),
        "{told}"
    );
    assert!(!folder.path().join("rod.toml").exists());
}

/// The collision of a foot.
fn solid(at: [f64; 3], rpy: &str, geometry: &str) -> String {
    let [x, y, z] = at;
    format!(
        "<collision><origin xyz=\"{x} {y} {z}\" rpy=\"{rpy}\"/><geometry>{geometry}</geometry></collision>"
    )
}

/// The child with other collisions of its feet, given by the y of the foot's middle (m).
fn with_feet(of_foot: impl Fn(f64) -> String) -> String {
    [("left", 0.005), ("right", -0.005)]
        .into_iter()
        .fold(CHILD.to_string(), |urdf, (_, y)| {
            let foot = solid(
                [0.015, y, -0.035],
                "0 0 0",
                "<box size=\"0.15 0.085 0.03\"/>",
            )
            .replace(" rpy=\"0 0 0\"", "");
            assert!(urdf.contains(&foot), "{foot}");
            urdf.replace(&foot, &of_foot(y))
        })
}

/// Feet that have no flat face of their own still have a sole, and the robot stands on it.
#[test]
fn soles_are_found_on_feet_of_any_kind() {
    let corners = |y: f64| {
        [-0.06, 0.09]
            .into_iter()
            .flat_map(move |x| [-0.0425, 0.0425].map(|dy| [x, y + dy]))
    };
    let balls = |y: f64, z: f64, radius: f64| -> String {
        let sphere = format!("<sphere radius=\"{radius}\"/>");
        corners(y)
            .map(|[x, y]| solid([x, y, z], "0 0 0", &sphere))
            .collect()
    };
    let whole = "<box size=\"0.15 0.085 0.03\"/>";
    let half = "<box size=\"0.075 0.085 0.03\"/>";
    let mut plates = with_feet(|y| solid([0.0525, y, -0.035], "0 0 0", half));
    for (side, y) in [("left", 0.005), ("right", -0.005)] {
        let heel = solid([-0.0225, y, -0.035], "0 0 0", half);
        let fixed = format!(
            "<link name=\"{side}_heel\">{heel}</link><joint name=\"{side}_heel_to_foot\" type=\"fixed\">\
             <parent link=\"{side}_foot\"/><child link=\"{side}_heel\"/></joint></robot>"
        );
        plates = plates.replace("</robot>", &fixed);
    }
    let wedge = with_feet(|y| {
        let edges = [-0.06, 0.09]
            .map(|x| solid([x, y, -0.049], "0 0 0", "<box size=\"0.002 0.004 0.002\"/>"));
        let sides = [-0.0425, 0.0425].map(|dy| {
            solid(
                [0.015, y + dy, -0.046],
                "0 0 0",
                "<box size=\"0.002 0.002 0.002\"/>",
            )
        });
        edges.concat() + &sides.concat()
    });
    let cases = [
        ("two plates", plates, [150.0, 85.0], ""),
        (
            "balls",
            with_feet(|y| balls(y, -0.045, 0.005)),
            [150.0, 85.0],
            "",
        ),
        (
            "points",
            with_feet(|y| balls(y, -0.05, 0.0)),
            [150.0, 85.0],
            "8 spheres of radius 0 are taken for contact points",
        ),
        (
            "off level",
            with_feet(|y| solid([0.015, y, -0.035], "0 0.17 0", whole)),
            [150.0, 85.0],
            "",
        ),
        (
            "wedge",
            wedge,
            [152.0, 87.0],
            "the foot left_foot has no flat lowest face",
        ),
    ];
    for (name, urdf, size_mm, words) in cases {
        let folder = folder();
        fs::write(folder.path().join("robot.urdf"), urdf).unwrap();
        let init = standfast(folder.path(), &["init", "robot.urdf"]).success();
        assert!(
            stderr(&init).contains("It stands"),
            "{name}: {}",
            stderr(&init)
        );
        let told = stdout(&init)
            .split_whitespace()
            .collect::<Vec<_>>()
            .join(" ");
        assert!(told.contains(words), "{name}: {told}");
        let robot =
            standfast::robots::load(folder.path().join("robot.urdf").to_str().unwrap()).unwrap();
        for foot in Foot::BOTH {
            let found = robot.soles[foot].half_m.map(|half| 2e3 * half);
            let apart = (0..2)
                .map(|k| (found[k] - size_mm[k]).abs())
                .fold(0.0, f64::max);
            assert!(apart < 0.01, "{name}: {found:?} mm");
        }
    }
}

/// Legs that differ a little are taken to be alike, and a warning says so. Here the knees have no room to compensate.
#[test]
fn legs_that_differ_a_little_are_levelled() {
    let lower = |urdf: &str, by_m: f64| {
        let foot = "0.015 -0.005 -0.035\"/><geometry><box size=\"0.15 0.085 0.03\"/></geometry></collision>";
        let lowered = urdf.replace(foot, &foot.replace("-0.035", &format!("{}", -0.035 - by_m)));
        lowered.replace("lower=\"0\" upper=\"2.3\"", "lower=\"0.69\" upper=\"0.71\"")
    };
    let told = |by_m: f64| {
        let urdf = Source {
            file: "uneven.urdf".into(),
            text: lower(CHILD, by_m),
        };
        inferred(&urdf, None)
            .and_then(|settings| standfast::robots::parse(&urdf, &settings).map(|_| settings.text))
    };
    let levelled = told(0.002).unwrap();
    assert!(
        levelled.contains("WARNING: the left leg reaches") && levelled.contains("halfway"),
        "{levelled}"
    );
    let refused = told(0.15).unwrap_err().to_string();
    assert!(
        refused.contains("no home posture with flat, level soles was found"),
        "{refused}"
    );
}

#[test]
fn joints_without_a_range_are_told_and_can_be_given_one() {
    let folder = folder();
    let limit = |line: &str| match line.split_once("<limit lower=") {
        Some((before, after)) => {
            format!("{before}<limit{}", &after[after.find(" effort").unwrap()..])
        }
        None => line.to_string(),
    };
    fs::write(
        folder.path().join("robot.urdf"),
        CHILD.lines().map(limit).collect::<Vec<_>>().join("\n"),
    )
    .unwrap();
    let refused = stderr(&standfast(folder.path(), &["init", "robot.urdf"]).code(2));
    assert!(
        refused
            .contains("17 joints are locked, since their limits in the file leave them no range"),
        "{refused}"
    );
    assert!(refused.contains("standfast init --range 1.5"), "{refused}");
    standfast(folder.path(), &["init", "robot.urdf", "--range", "1.4"]).success();
    let robot =
        standfast::robots::load(folder.path().join("robot.urdf").to_str().unwrap()).unwrap();
    assert_eq!(robot.joints.len(), 17);
    assert!(
        robot
            .joints
            .iter()
            .all(|joint| (joint.lower_rad, joint.upper_rad) == (-1.4, 1.4))
    );
    let refused = stderr(
        &standfast(
            folder.path(),
            &["init", "robot.urdf", "--dry-run", "--range", "9"],
        )
        .code(2),
    );
    assert!(refused.contains("range_rad = 9: out of range"), "{refused}");
}

/// Of a pelvis and a chest of about the same weight, the trunk is the one with an IMU, or else the one with the arms.
#[test]
fn the_trunk_is_not_the_heaviest_link_alone() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/robots/adult.urdf");
    let adult = fs::read_to_string(file).unwrap();
    let trunk = |changes: &[(&str, &str)]| {
        let text = changes.iter().fold(adult.clone(), |text, (old, new)| {
            assert!(text.contains(old), "{old}");
            text.replace(old, new)
        });
        let robot = robot_of(&Source {
            file: file.into(),
            text,
        });
        robot.links[robot.trunk].name.clone()
    };
    let heavy = ("<mass value=\"9\"/>", "<mass value=\"20\"/>");
    let no_imu = ("\"imu\"", "\"box\"");
    let imu_below = (
        "<parent link=\"torso\"/><child link=\"imu\"/>",
        "<parent link=\"pelvis\"/><child link=\"imu\"/>",
    );
    assert_eq!(trunk(&[]), "torso");
    assert_eq!(trunk(&[heavy]), "torso");
    assert_eq!(trunk(&[heavy, no_imu]), "torso");
    assert_ne!(trunk(&[heavy, imu_below]), "torso");
    assert_ne!(
        trunk(&[("<mass value=\"9\"/>", "<mass value=\"60\"/>")]),
        "torso"
    );
}

/// The smoke campaign with our own robots, from their URDF alone: one with weak ankles, and one of adult size with
/// arms, a waist and meshes. A footstep recovers from a push that stiff joints lose.
#[test]
#[ignore = "pushes robots of all makes, ten seconds"]
fn a_robot_without_settings_catches_itself() {
    for (robot, least) in [("child", 3), ("adult", 14)] {
        let folder = folder();
        let urdf = format!(
            "--robot={}/assets/robots/{robot}.urdf",
            env!("CARGO_MANIFEST_DIR")
        );
        let run = standfast(
            folder.path(),
            &[
                "run",
                "smoke",
                "--controller=hold",
                "--controller=catch",
                "--json",
                &urdf,
            ],
        );
        let summary: Value = serde_json::from_slice(&run.success().get_output().stdout).unwrap();
        let count = |set: usize, key: &str| summary["controllers"][set][key].as_u64().unwrap();
        for set in 0..2 {
            let verdicts = ["recovered", "fell", "timed_out"].map(|key| count(set, key));
            assert_eq!(verdicts.iter().sum::<u64>(), 15, "{robot}: {summary}");
        }
        assert!(
            count(1, "recovered") >= least.max(count(0, "recovered")),
            "{robot}: {summary}"
        );
    }
}

/// A result has all files that are needed to run it again, even if a later version infers other settings.
#[test]
fn inferred_settings_are_kept_with_a_result() {
    let folder = folder();
    fs::write(folder.path().join("mine.urdf"), CHILD).unwrap();
    let run = standfast(folder.path(), &short(&["--trials=2", "--robot=mine.urdf"])).success();
    assert_eq!(
        stderr(&run)
            .matches("its settings are inferred, as there is no mine.toml")
            .count(),
        1,
        "{}",
        stderr(&run)
    );
    let printed = standfast(folder.path(), &["init", "mine.urdf", "--dry-run"]).success();
    assert_eq!(
        printed.get_output().stdout,
        fs::read(folder.path().join("out/inputs/robot.toml")).unwrap()
    );
    let again = standfast(folder.path(), &["run", "out/campaign.toml", "--out=again"]).success();
    assert!(!stderr(&again).contains("inferred"), "{}", stderr(&again));
    let rows = |out: &str| fs::read(folder.path().join(out).join("trials.parquet")).unwrap();
    assert_eq!(rows("out"), rows("again"));
}

#[test]
fn the_home_posture_is_that_of_an_srdf() {
    let folder = folder();
    let path = folder.path().join("mine_v2.urdf");
    fs::write(&path, CHILD).unwrap();
    let srdf = r#"<robot name="mine">
        <group_state name="arms_up" group="all"><joint name="left_knee" value="0.1"/></group_state>
        <group_state name="half_sitting" group="all">
          <joint name="root_joint" value="0 0 1 0 0 0 1"/>
          <joint name="neck_yaw" value="0.25"/><joint name="left_knee" value="0.5"/><joint name="right_knee" value="0.5"/>
        </group_state></robot>"#;
    fs::write(folder.path().join("mine.srdf"), srdf).unwrap();
    let robot = standfast::robots::load(path.to_str().unwrap()).unwrap();
    for (name, expected) in [("neck_yaw", 0.25), ("left_knee", 0.5), ("right_knee", 0.5)] {
        let joint = robot
            .joints
            .iter()
            .position(|joint| joint.name == name)
            .unwrap();
        assert!(
            (robot.home_rad[joint] - expected).abs() < 1e-9,
            "{name}: {}",
            robot.home_rad[joint]
        );
    }
}

#[test]
fn what_cannot_be_inferred_is_told_with_what_to_do() {
    let stool = Source {
        file: "stool.urdf".into(),
        text: include_str!("data/stool.urdf").into(),
    };
    let error = inferred(&stool, None).unwrap_err();
    for part in [
        "stool.urdf: settings",
        "there are no two legs",
        "[soles], [home_rad], [[servos]]",
        "assets/robots/ut-mu2.toml",
    ] {
        assert!(error.to_string().contains(part), "{part} is not in {error}");
    }
    assert_eq!(error.exit_code(), 2);
}

#[test]
fn macros_need_the_program_that_expands_them() {
    let folder = folder();
    fs::write(
        folder.path().join("mine.urdf.xacro"),
        "<robot xmlns:xacro=\"http://ros.org/wiki/xacro\"/>",
    )
    .unwrap();
    let run = |path: &Path| {
        let mut command = Command::new(PROGRAM);
        Run::of(
            command
                .current_dir(folder.path())
                .env("PATH", path)
                .args(["init", "mine.urdf.xacro"]),
        )
    };
    let alone = run(Path::new("")).code(2);
    assert!(
        stderr(&alone).contains("`xacro mine.urdf.xacro > mine.urdf`, then use that file"),
        "{}",
        stderr(&alone)
    );
    if cfg!(unix) {
        let bin = folder.path().join("bin");
        fs::create_dir(&bin).unwrap();
        fs::write(folder.path().join("child.urdf"), CHILD).unwrap();
        let script = format!(
            "#!/bin/sh\nexec /bin/cat '{}'\n",
            folder.path().join("child.urdf").display()
        );
        fs::write(bin.join("xacro"), script).unwrap();
        make_executable(&bin.join("xacro"));
        run(&bin).success();
        assert!(
            fs::read_to_string(folder.path().join("mine.toml"))
                .unwrap()
                .contains("\"left_knee\"")
        );
    }
}

/// Macros in a comment are not expanded, and the advice in a message does not overwrite the file.
#[test]
fn macros_in_comments_are_none_and_no_advice_overwrites_the_robot() {
    let folder = folder();
    let robot = |inside: &str| {
        CHILD
            .replacen(
                "<robot ",
                "<robot xmlns:xacro=\"http://ros.org/wiki/xacro\" ",
                1,
            )
            .replacen("<link ", &format!("{inside}\n<link "), 1)
    };
    let init = |name: &str| {
        Run::of(
            Command::new(PROGRAM)
                .current_dir(folder.path())
                .env("PATH", "")
                .args(["init", name]),
        )
    };
    fs::write(
        folder.path().join("bolt.urdf"),
        robot("<!-- <xacro:leg side=\"left\"/> -->"),
    )
    .unwrap();
    init("bolt.urdf").success();
    for (name, advice) in [
        (
            "my robot.urdf",
            "`xacro 'my robot.urdf' > 'my robot-expanded.urdf'`",
        ),
        ("mine.xacro", "`xacro mine.xacro > mine.urdf`"),
    ] {
        fs::write(
            folder.path().join(name),
            robot("<!-- a --><xacro:leg side=\"left\"/>"),
        )
        .unwrap();
        let told = stderr(&init(name).code(2));
        assert!(told.contains(advice), "wanted: {advice}\n{told}");
    }
}

/// Feet without a shape have no sole to be found. The user states the soles alone, and `init` adds the rest.
#[test]
fn stated_soles_are_completed() {
    let folder = folder();
    let path = |name: &str| folder.path().join(name);
    let init = || standfast(folder.path(), &["init", "mine.urdf"]);
    let gone = "<collision><geometry><mesh filename=\"gone.stl\"/></geometry></collision>";
    for (foot, words) in [
        (
            gone,
            "the mesh of the foot left_foot is left out: gone.stl (no such file)",
        ),
        (
            "",
            "the foot left_foot has no collision geometry and is not drawn",
        ),
    ] {
        // The file has a byte order mark, with which some editors begin a file.
        let urdf = ["0.005", "-0.005"].into_iter().fold(
            with_feet(|_| foot.into()),
            |urdf, y| {
                let drawn = format!(
                    "<visual><origin xyz=\"0.015 {y} -0.035\"/><geometry><box size=\"0.15 0.085 0.03\"/></geometry>\
                     <material name=\"dark\"/></visual>"
                );
                assert!(urdf.contains(&drawn));
                urdf.replace(&drawn, "")
            },
        );
        fs::write(path("mine.urdf"), format!("\u{feff}{urdf}")).unwrap();
        let told = stderr(&init().code(2));
        assert!(told.contains(words), "{told}");
        assert!(
            told.contains("accepted: [soles.left] and [soles.right] in mine.toml"),
            "{told}"
        );
    }
    let soles = |links: [&str; 2]| -> String {
        let sole = |(side, link): (&str, &str)| {
            let y = if side == "left" { 0.005 } else { -0.005 };
            format!(
                "[soles.{side}]\nlink = '{link}'\ncenter_m = [0.015, {y}, -0.05]\nsize_m = [0.15, 0.085]\n"
            )
        };
        ["left", "right"].into_iter().zip(links).map(sole).collect()
    };
    let swapped = soles(["right_foot", "left_foot"]);
    fs::write(path("mine.toml"), swapped).unwrap();
    let told = stderr(&init().code(2));
    assert!(
        told.contains("mine.toml: soles.left = right_foot: is not at the end of that leg"),
        "{told}"
    );
    fs::write(
        path("mine.toml"),
        format!("\u{feff}{}", soles(["left_foot", "right_foot"])),
    )
    .unwrap();
    let told = stderr(&standfast(folder.path(), &["model", "mine.urdf"]).code(2));
    assert!(
        told.contains("mine.toml: keys = soles: are all that it states")
            && told.contains("`standfast init`"),
        "{told}"
    );
    let told = stderr(&init().success());
    let told = told.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        told.contains("It stands") && told.contains("Its soles are those that were stated there"),
        "{told}"
    );
    let model = stderr(&standfast(folder.path(), &["model", "mine.urdf"]).success());
    assert!(
        model.contains(
            "link \"left_foot\" has no shape with which it collides: it stands on a plate"
        ),
        "{model}"
    );
    let [robot, found] = [path("mine.urdf"), path("child.urdf")].map(|file| {
        if !file.exists() {
            fs::write(&file, CHILD).unwrap();
        }
        standfast::robots::load(file.to_str().unwrap()).unwrap()
    });
    for foot in Foot::BOTH {
        let (stated, read) = (robot.soles[foot], found.soles[foot]);
        assert!(
            (stated.center.translation.vector - read.center.translation.vector).norm() < 1e-6,
            "{stated:?}"
        );
        assert_eq!(stated.half_m, read.half_m);
    }
    assert!((robot.home_com_height() - found.home_com_height()).abs() < 1e-3);
    fs::write(path("mine.urdf"), with_feet(|_| gone.into())).unwrap();
    assert!(
        stderr(&standfast(folder.path(), &["model", "mine.urdf"]).success())
            .contains("it stands on a plate")
    );
    // A whole file is not replaced.
    assert!(stderr(&init().code(2)).contains("this file is there already"));
}

/// All warnings have one form, independent of their origin.
#[test]
fn warnings_begin_alike() {
    let folder = folder();
    fs::write(folder.path().join("mine.urdf"), CHILD).unwrap();
    let told = stderr(&standfast(folder.path(), &["model", "mine.urdf"]).success());
    assert!(
        told.starts_with("warning: mine.urdf: its settings are inferred") && !told.contains("WARN"),
        "{told}"
    );
}

#[cfg(unix)]
fn make_executable(path: &Path) {
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).unwrap();
}

#[cfg(not(unix))]
fn make_executable(_: &Path) {}

/// A result of a robot with meshes is moved to a place without the meshes. It continues and is replayed to the same
/// bytes.
#[test]
fn a_result_keeps_the_meshes_of_its_robot() {
    let (home, away) = (folder(), folder());
    let (robots, meshes) = (
        home.path().join("robots"),
        home.path().join("robots/adult/meshes"),
    );
    fs::create_dir_all(&meshes).unwrap();
    let assets = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/robots"));
    for (name, bytes) in files(assets)
        .iter()
        .filter(|(name, _)| name.starts_with("adult"))
    {
        fs::write(robots.join(name), bytes).unwrap();
    }
    let run = |more: &str| {
        standfast(
            home.path(),
            &short(&["--trials=6", "--robot=robots/adult.urdf", more]),
        )
    };
    run("--replays=0").success();
    fs::rename(home.path().join("out"), home.path().join("whole")).unwrap();
    run("--shard=1/2").success();
    let replay = |at: &Path, out: &str| {
        standfast(at, &["replay", out, "--trial=5", "--replay=page.html"]).success();
        fs::read_to_string(at.join("page.html")).unwrap()
    };
    let page = replay(home.path(), "whole");
    // With another mesh it is another campaign.
    fs::copy(meshes.join("head.obj"), meshes.join("torso.obj")).unwrap();
    let other = run("--shard=2/2").code(3);
    assert!(
        stderr(&other).contains("holds the result of another campaign"),
        "{}",
        stderr(&other)
    );

    for (name, bytes) in files(&home.path().join("out")) {
        let path = away.path().join("whole").join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }
    let again = |args: &[&str]| {
        let run = standfast(away.path(), args).success();
        assert!(!stderr(&run).contains("mesh"), "{}", stderr(&run));
    };
    again(&["run", "whole/campaign.toml", "--shard=2/2", "--out=whole"]);
    again(&["merge", "whole", "--replays=0"]);
    again(&["run", "whole/campaign.toml", "--replays=0", "--out=again"]);
    let trials =
        |folder: &Path, out: &str| fs::read(folder.join(out).join("trials.parquet")).unwrap();
    let expected = trials(home.path(), "whole");
    assert!(trials(away.path(), "whole") == expected && trials(away.path(), "again") == expected);
    assert!(
        replay(away.path(), "whole") == page,
        "the page of a trial differs"
    );
}

/// Waist and head stay at zero, whichever link is the heaviest, and both arms hang alike.
#[test]
fn only_arms_hang_and_both_alike() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/assets/robots/adult.urdf");
    // The arms point aside at zero.
    let adult = fs::read_to_string(file).unwrap();
    let adult = adult
        .replace(
            "<origin xyz=\"0 0.05 0\"/><axis",
            "<origin xyz=\"0 0.05 0\" rpy=\"1 0 0\"/><axis",
        )
        .replace(
            "<origin xyz=\"0 -0.05 0\"/><axis",
            "<origin xyz=\"0 -0.05 0\" rpy=\"-1 0 0\"/><axis",
        )
        .replace(
            "lower=\"-0.2\" upper=\"2.4\"",
            "lower=\"-1.6\" upper=\"2.4\"",
        )
        .replace(
            "lower=\"-2.4\" upper=\"0.2\"",
            "lower=\"-2.4\" upper=\"1.6\"",
        );
    assert_eq!(
        adult.matches("rpy=\"1 0 0\"").count() + adult.matches("rpy=\"-1 0 0\"").count(),
        2
    );
    let light = adult.replace("<mass value=\"19\"/>", "<mass value=\"4\"/>");
    assert_ne!(light, adult);
    for (text, trunk) in [(adult, "torso"), (light, "base_link")] {
        let robot = robot_of(&Source {
            file: file.into(),
            text,
        });
        assert_eq!(robot.links[robot.trunk].name, trunk);
        let angle = |name: &str| {
            robot.home_rad[robot
                .joints
                .iter()
                .position(|joint| joint.name == name)
                .unwrap()]
        };
        for name in ["waist_yaw", "waist_pitch", "neck_yaw", "neck_pitch"] {
            assert_eq!(angle(name), 0.0, "{trunk}: {name}");
        }
        let roll = ["left_shoulder_roll", "right_shoulder_roll"].map(angle);
        assert!(roll[0] < -0.5 && roll[0] == -roll[1], "{trunk}: {roll:?}");
        for name in ["shoulder_pitch", "elbow"] {
            assert_eq!(
                angle(&format!("left_{name}")),
                angle(&format!("right_{name}")),
                "{trunk}: {name}"
            );
        }
    }
}

/// Motors of other settings take the place of the robot's, for all controllers, and are told with their origin.
#[test]
fn motors_of_other_settings_are_those_of_the_robot() {
    let dir = folder();
    let own = fs::read_to_string("assets/robots/ut-mu2.toml").unwrap();
    let strong = own.replace("torque_n_m = 8.0", "torque_n_m = 16.0");
    fs::write(dir.path().join("strong.toml"), strong).unwrap();
    let torque = |args: &[&str]| {
        let told = stdout(&standfast(dir.path(), args).success());
        let model: Value = serde_json::from_str(&told).unwrap();
        let of = |key: &str| model[key]["left_knee_flexion"].clone();
        (
            of("servos")["torque_n_m"].as_f64().unwrap(),
            of("motor_origins")["torque"].as_str().unwrap().to_string(),
        )
    };
    assert_eq!(torque(&["model", "--json"]), (8.0, "settings".into()));
    let strong = (16.0, "of strong.toml".to_string());
    assert_eq!(
        torque(&["model", "--json", "--motors", "strong.toml"]),
        strong
    );
    let told = stdout(&standfast(dir.path(), &["model", "--motors", "strong.toml"]).success());
    assert!(
        told.contains("motors: torque limits, speeds, rotor inertias of 20 joints are those of"),
        "{told}"
    );

    // A campaign names them as it names its robot, and its result keeps them.
    let campaign = "name = 'c'\nmotors = 'strong.toml'\ncontrollers = ['hold']\ntrials = 1\nseed = 1\n[push]\nimpulse = 0.1\n";
    fs::write(dir.path().join("c.toml"), campaign).unwrap();
    standfast(
        dir.path(),
        &["run", "c.toml", "--replays=0", "--out=of-file"],
    )
    .success();
    let args = [
        "run",
        "c.toml",
        "--replays=0",
        "--out=of-option",
        "--motors=strong.toml",
    ];
    standfast(dir.path(), &args).success();
    let kept = |folder: &str| fs::read(dir.path().join(folder).join("inputs/robot.toml")).unwrap();
    assert_eq!(kept("of-file"), kept("of-option"));
    assert_eq!(
        torque(&["model", "--json", "of-file/inputs/robot.urdf"]),
        strong
    );
    standfast(dir.path(), &["replay", "of-file", "--trial=0"]).success();

    // `init` writes them.
    fs::write(dir.path().join("child.urdf"), CHILD).unwrap();
    let robot = robot_of(&child());
    let knee = robot
        .joints
        .iter()
        .find(|joint| joint.name.contains("knee"));
    let knee = &knee.unwrap().name;
    let motors = inferred(&child(), None).unwrap().text;
    let stronger = motors
        .lines()
        .map(|line| match line.starts_with("torque_n_m") {
            true => "torque_n_m = 77.5\n".into(),
            false => format!("{line}\n"),
        });
    let motors: String = stronger.collect();
    let motors = motors.replacen("joints = [", "joints = [\"tail\", ", 1);
    fs::write(dir.path().join("strong.toml"), motors).unwrap();
    let told =
        stdout(&standfast(dir.path(), &["model", "child.urdf", "--motors=strong.toml"]).success());
    let told = told.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        told.contains("of strong.toml; joints of that file that this robot lacks: 1"),
        "{told}"
    );
    standfast(dir.path(), &["init", "child.urdf", "--motors=strong.toml"]).success();
    let told = stdout(&standfast(dir.path(), &["model", "child.urdf", "--json"]).success());
    let model: Value = serde_json::from_str(&told).unwrap();
    assert_eq!(model["servos"][knee]["torque_n_m"], 77.5);
    assert_eq!(model["motor_origins"][knee]["torque"], "of strong.toml");
    assert_eq!(model["motor_origins"][knee]["speed"], "of strong.toml");

    for (file, text, words) in [
        ("no.txt", "", "is no TOML file"),
        ("no.toml", "a = 1\n", "states no motors"),
        (
            "other.toml",
            "joints = ['a']\n[training]\ntorque_n_m = [1.0]\n",
            "states no motor of a joint of ut-mu2",
        ),
        (
            "short.toml",
            "joints = ['a']\n[training]\ntorque_n_m = [1.0, 2.0]\n",
            "training = 2 numbers: has another length than joints",
        ),
        (
            "much.toml",
            "joints = ['left_knee_flexion']\n[training]\ntorque_n_m = [1e13]\n",
            "ut-mu2 with the motors of much.toml: servos",
        ),
    ] {
        fs::write(dir.path().join(file), text).unwrap();
        let told = stderr(&standfast(dir.path(), &["push", "--motors", file]).code(2));
        assert!(told.contains(words), "{file}: {told}");
    }
}

/// A stated sole is the sole on which the robot stands: bounds, controllers and contacts have the same.
#[test]
fn a_robot_stands_on_the_soles_that_are_stated() {
    let dir = folder();
    let own = fs::read_to_string("assets/robots/ut-mu2.toml").unwrap();
    let (before, rest) = own.split_once("[soles]").unwrap();
    let (_, after) = rest.split_once("\n\n").unwrap();
    let state = |name: &str, share: f64| {
        let faces = ["left", "right"].map(|side| {
            format!(
                "[soles.{side}]\nlink = '{side}_foot'\ncenter_m = [0.0065, 0.0, 0.0]\nsize_m = [{:?}, 0.069172]\n",
                share * 0.096172
            )
        });
        // The tables of the soles come last among the tables of the file, as any.
        let text = format!("{before}\n{}\n{after}", faces.concat());
        fs::write(dir.path().join(format!("{name}.toml")), text).unwrap();
        fs::copy(
            "assets/robots/ut-mu2.urdf",
            dir.path().join(format!("{name}.urdf")),
        )
        .unwrap();
    };
    state("whole", 1.0);
    state("half", 0.5);
    let push = |robot: &str| {
        let args = [
            "push",
            "--controller=hold",
            "--impulse=2",
            "--robot",
            robot,
            "--json",
        ];
        let run = standfast(dir.path(), &args).success();
        let told: Value = serde_json::from_str(&stdout(&run)).unwrap();
        (told["outcome"].as_str().unwrap().to_string(), stderr(&run))
    };
    let (whole, told) = push("whole.urdf");
    assert!(
        whole == "Recovered" && !told.contains("collides as a box"),
        "{whole} {told}"
    );
    let (half, told) = push("half.urdf");
    assert_eq!(half, "Fell");
    assert!(
        told.contains("collides as a box of 48.1 x 69.2 x 30.2 mm")
            && told.contains("has 96.2 x 69.2 mm"),
        "{told}"
    );
}

/// A robot whose base looks another way is the same robot, with its left leg at its left.
#[test]
fn forward_is_from_the_ankles_to_the_toes() {
    let straight = robot_of(&child());
    for (yaw_rad, forward) in [
        ("3.14159265358979", "-x"),
        ("1.5707963267949", "y"),
        ("-1.5707963267949", "-y"),
    ] {
        let base = format!(
            "<link name=\"base\"/><joint name=\"base_joint\" type=\"fixed\"><parent link=\"base\"/><child link=\"pelvis\"/>\
             <origin xyz=\"0 0 0\" rpy=\"0 0 {yaw_rad}\"/></joint><link name=\"pelvis\">"
        );
        let urdf = Source {
            text: CHILD.replace("<link name=\"pelvis\">", &base),
            ..child()
        };
        let settings = inferred(&urdf, None).unwrap();
        assert!(
            settings.text.contains(&format!("forward = \"{forward}\"")),
            "{}",
            settings.text
        );
        let turned = standfast::robots::parse(&urdf, &settings).unwrap();
        let soles = [&straight, &turned].map(|robot| {
            Foot::BOTH.map(|foot| {
                let name = robot.frames[robot.soles[foot].frame].name.clone();
                let at = Kinematics::at_home(robot).sole_pose(robot, foot);
                (name, at.translation.vector)
            })
        });
        for ((name, at), (turned_name, turned_at)) in soles[0].iter().zip(&soles[1]) {
            assert_eq!(name, turned_name);
            assert!((at - turned_at).norm() < 1e-4, "{at} {turned_at}");
        }
        for (a, b) in straight.home_rad.iter().zip(&turned.home_rad) {
            assert!((a - b).abs() < 1e-3, "{a} {b}");
        }
        assert_eq!(straight.reach.len(), turned.reach.len());
    }
    let swapped = Source {
        text: CHILD
            .replace("left_", "LEFT_")
            .replace("right_", "left_")
            .replace("LEFT_", "right_"),
        ..child()
    };
    let text = inferred(&swapped, None).unwrap().text;
    assert!(
        text.contains("the names of the legs (left, right) would have it look the other way")
            && !text.contains("forward = "),
        "{text}"
    );
}

/// The foot of a leg whose joints are at zero may point down. Its sole is the face on which it can stand.
#[test]
fn soles_of_feet_that_are_pitched_at_zero_are_found() {
    let straight = robot_of(&child());
    for pitch_rad in [0.6, -0.5] {
        let mut text = CHILD.to_string();
        for side in ["left", "right"] {
            let joint = format!("<child link=\"{side}_ankle\"/><origin xyz=\"0 0 -0.21\"");
            assert!(text.contains(&joint));
            text = text.replace(&joint, &format!("{joint} rpy=\"0 {pitch_rad} 0\""));
        }
        let pitched = robot_of(&Source { text, ..child() });
        for foot in Foot::BOTH {
            let (a, b) = (straight.soles[foot], pitched.soles[foot]);
            for (a, b) in a.half_m.iter().zip(&b.half_m) {
                assert!((a - b).abs() < 1e-3, "{pitch_rad}: {a} m, not {b} m");
            }
        }
        near(
            "COM height",
            pitched.home_com_height(),
            straight.home_com_height(),
            0.003,
        );
    }
}

/// Feet that are drawn and do not collide stand on what is drawn. A robot without legs is told so.
#[test]
fn feet_are_drawn_and_arms_are_no_legs() {
    let bare = Source {
        text: with_feet(|_| String::new()),
        ..child()
    };
    let (straight, drawn) = (robot_of(&child()), robot_of(&bare));
    for foot in Foot::BOTH {
        assert_eq!(straight.soles[foot].half_m, drawn.soles[foot].half_m);
        assert_eq!(drawn.links[drawn.soles[foot].link].collisions.len(), 1);
    }
    assert!(
        drawn
            .assumptions
            .iter()
            .any(|words| words.contains("its sole is the lowest face of what is drawn")),
        "{:?}",
        drawn.assumptions
    );
    let arm = |side: &str, y: f64| -> String {
        let link = |k: usize| {
            let (joint, carrier) = match k {
                0 => (format!("0 {y} 1"), "base".into()),
                _ => ("0 0 -0.15".into(), format!("{side}_{}", k - 1)),
            };
            format!(
                "<link name=\"{side}_{k}\"><inertial><mass value=\"1\"/><inertia ixx=\"0.01\" ixy=\"0\" ixz=\"0\" iyy=\"0.01\" iyz=\"0\" \
                 izz=\"0.01\"/></inertial></link><joint name=\"{side}_joint_{k}\" type=\"revolute\"><parent link=\"{carrier}\"/>\
                 <child link=\"{side}_{k}\"/><origin xyz=\"{joint}\"/><axis xyz=\"0 1 0\"/><limit lower=\"-1\" upper=\"1\" effort=\"20\" \
                 velocity=\"5\"/></joint>"
            )
        };
        (0..4).map(link).collect()
    };
    let wheeled = Source {
        file: "wheeled.urdf".into(),
        text: format!(
            "<robot name=\"wheeled\"><link name=\"base\"><inertial><mass value=\"20\"/><inertia ixx=\"1\" ixy=\"0\" ixz=\"0\" iyy=\"1\" \
             iyz=\"0\" izz=\"1\"/></inertial></link>{}{}</robot>",
            arm("left", 0.2),
            arm("right", -0.2)
        ),
    };
    let told = inferred(&wheeled, None).unwrap_err().to_string();
    assert!(
        told.contains("there are no legs: the two chains")
            && told.contains("hang from above the base, as arms do"),
        "{told}"
    );
}

/// A URDF of boxes as an MJCF.
fn as_mjcf(urdf: &str) -> String {
    fn pose(of: roxmltree::Node) -> String {
        let origin = of.children().find(|node| node.has_tag_name("origin"));
        let part = |name| {
            origin
                .and_then(|origin| origin.attribute(name))
                .unwrap_or("0 0 0")
        };
        // Roll, pitch and yaw are about fixed axes.
        format!(r#"pos="{}" euler="{}""#, part("xyz"), part("rpy"))
    }
    fn body(robot: roxmltree::Node, link: roxmltree::Node, joint: &str, at: &str) -> String {
        let name = link.attribute("name").unwrap();
        let mut text = format!(r#"<body name="{name}" {at}>{joint}"#);
        for part in link.children().filter(roxmltree::Node::is_element) {
            let value = |tag: &str, name: &str| {
                let node = part.descendants().find(|node| node.has_tag_name(tag));
                node.and_then(|node| node.attribute(name)).unwrap_or("0")
            };
            if part.has_tag_name("inertial") {
                let moments = ["ixx", "iyy", "izz", "ixy", "ixz", "iyz"];
                let moments = moments.map(|name| value("inertia", name)).join(" ");
                let mass = value("mass", "value");
                text += &format!(
                    r#"<inertial {} mass="{mass}" fullinertia="{moments}"/>"#,
                    pose(part)
                );
            } else if part.has_tag_name("collision") {
                let size = value("box", "size").split(' ');
                let half: Vec<String> = size
                    .map(|side| (0.5 * side.parse::<f64>().unwrap()).to_string())
                    .collect();
                let half = half.join(" ");
                text += &format!(r#"<geom type="box" {} size="{half}"/>"#, pose(part));
            }
        }
        let ends = |joint: &roxmltree::Node, end: &str, link: &str| {
            let mut ends = joint.children().filter(|node| node.has_tag_name(end));
            ends.any(|node| node.attribute("link") == Some(link))
        };
        let joints = robot.children().filter(|node| node.has_tag_name("joint"));
        for joint in joints.filter(|joint| ends(joint, "parent", name)) {
            let mut links = robot.children().filter(|node| node.has_tag_name("link"));
            let is_child =
                |link: &roxmltree::Node| ends(&joint, "child", link.attribute("name").unwrap());
            let child = links.find(is_child).unwrap();
            let value = |tag: &str, name: &str| {
                let node = joint.children().find(|node| node.has_tag_name(tag));
                node.and_then(|node| node.attribute(name)).unwrap_or("0")
            };
            let hinge = match joint.attribute("type") {
                Some("fixed") => String::new(),
                _ => format!(
                    r#"<joint name="{}" axis="{}" range="{} {}"/>"#,
                    joint.attribute("name").unwrap(),
                    value("axis", "xyz"),
                    value("limit", "lower"),
                    value("limit", "upper")
                ),
            };
            text += &body(robot, child, &hinge, &pose(joint));
        }
        text + "</body>"
    }
    let document = roxmltree::Document::parse(urdf).unwrap();
    let robot = document.root_element();
    let base = robot.children().find(|node| node.has_tag_name("link"));
    format!(
        "<mujoco><worldbody>{}</worldbody></mujoco>",
        body(robot, base.unwrap(), "<freejoint/>", "")
    )
}

/// A scene of MuJoCo is a robot as its URDF is, and a result keeps all of it.
#[test]
fn an_mjcf_is_taken_as_a_urdf_is() {
    let dir = folder();
    let urdf = assets::open(InputKind::Robot, "ut-mu2").unwrap();
    fs::write(dir.path().join("robot.xml"), as_mjcf(&urdf.text)).unwrap();
    let scene = "<mujoco model=\"mine\"><compiler angle=\"radian\" eulerseq=\"XYZ\"/><default><joint armature=\"0.002\"/></default>\n\
                 <include file=\"robot.xml\"/><worldbody><geom type=\"plane\" size=\"1 1 1\"/></worldbody></mujoco>";
    fs::write(dir.path().join("scene.xml"), scene).unwrap();
    let init = standfast(dir.path(), &["init", "scene.xml"]).success();
    assert!(stderr(&init).contains("It stands"), "{}", stderr(&init));
    let robot =
        |file: &str| standfast::robots::load(dir.path().join(file).to_str().unwrap()).unwrap();
    let (mjcf, urdf) = (robot("scene.xml"), robot_of(&urdf));
    near("mass", mjcf.mass(), urdf.mass(), 1e-12);
    for (j, joint) in mjcf.joints.iter().enumerate() {
        let known = urdf
            .joints
            .iter()
            .position(|other| other.name == joint.name);
        let (home, known) = (mjcf.home_rad[j], urdf.home_rad[known.unwrap()]);
        assert!(
            (home - known).abs() < 1e-4,
            "{}: {home} {known}",
            joint.name
        );
        assert_eq!(mjcf.servos[j].rotor_inertia_kg_m2, 0.002);
    }
    let campaign = "name = 'c'\nrobot = 'scene.xml'\ncontrollers = ['hold']\ntrials = 1\nseed = 1\n[push]\nimpulse = 0.1\n";
    fs::write(dir.path().join("c.toml"), campaign).unwrap();
    standfast(dir.path(), &["run", "c.toml", "--replays=0", "--out=kept"]).success();
    for file in ["robot.xml", "scene.xml", "scene.toml"] {
        fs::remove_file(dir.path().join(file)).unwrap();
    }
    standfast(dir.path(), &["replay", "kept", "--trial=0"]).success();
    let kept = robot("kept/inputs/robot.xml");
    assert_eq!(format!("{:?}", kept.links), format!("{:?}", mjcf.links));
    assert_eq!(format!("{:?}", kept.joints), format!("{:?}", mjcf.joints));
}
