//! The robot's files contain the published figures, and invalid files are refused with a clear error.

use standfast_core::robot::{Foot, Kinematics, Robot, Shape};
use standfast_files::assets::{self, InputKind, Source};
use standfast_robots::{Files, urdf};

/// Joint, limits (degrees), and mass of the link that it carries (kg), as published. The right side has the same
/// values.
const PUBLISHED: [(&str, [f64; 2], f64); 10] = [
    ("shoulder_flexion", [-60.0, 180.0], 0.147856),
    ("shoulder_abduction", [-30.0, 90.0], 0.146784),
    ("elbow_rotation", [-90.0, 90.0], 0.077469),
    ("elbow_flexion", [0.0, 90.0], 0.171038),
    ("hip_flexion", [-90.0, 100.0], 0.106071),
    ("hip_abduction", [-30.0, 90.0], 0.374062),
    ("knee_rotation", [-90.0, 90.0], 0.077328),
    ("knee_flexion", [0.0, 110.0], 0.341003),
    ("ankle_flexion", [-180.0, 180.0], 0.09306),
    ("ankle_abduction", [-90.0, 90.0], 0.329776),
];

fn builtin() -> (Source, Source) {
    (
        assets::open(InputKind::Robot, "ut-mu2").unwrap(),
        assets::open(InputKind::RobotSettings, "ut-mu2").unwrap(),
    )
}

#[test]
fn published_figures_of_ut_mu2() {
    let robot = standfast_robots::load("ut-mu2").unwrap();
    assert_eq!(
        (robot.name.as_str(), robot.joints.len(), robot.links.len()),
        ("ut-mu2", 20, 21)
    );
    for (side, first) in [("left", 0), ("right", 10)] {
        for (i, (name, limits, mass)) in PUBLISHED.iter().enumerate() {
            let joint = &robot.joints[first + i];
            assert_eq!(joint.name, format!("{side}_{name}"));
            assert!(
                (joint.lower_rad - limits[0].to_radians()).abs() < 1e-15,
                "{}",
                joint.name
            );
            assert!(
                (joint.upper_rad - limits[1].to_radians()).abs() < 1e-15,
                "{}",
                joint.name
            );
            assert_eq!(robot.links[first + i + 1].mass_kg, *mass, "{}", joint.name);
        }
    }
    // The body has the assumed battery and boards at its COM: its mass grows, and its COM stays.
    let body = &robot.links[0];
    assert!((body.mass_kg - (2.983032 + 1.288)).abs() < 1e-12);
    assert!((body.com_m - nalgebra::point![-0.069189, 0.000422, 0.008568]).norm() < 1e-12);
    assert!((robot.mass() - 8.0).abs() < 1e-4);
    assert!(!robot.assumptions.is_empty());
}

#[test]
fn soles_are_as_published() {
    let robot = standfast_robots::load("ut-mu2").unwrap();
    for foot in Foot::BOTH {
        let sole = &robot.soles[foot];
        let x = [-0.041586, 0.054586];
        assert!((2.0 * sole.half_m[0] - (x[1] - x[0])).abs() < 1e-12);
        assert!((sole.half_m[1] - 0.034586).abs() < 1e-12);
        assert!((sole.thickness_m - 0.007288).abs() < 1e-12);
        let in_frame = robot.frames[sole.frame]
            .pose
            .inv_mul(&sole.center)
            .translation
            .vector;
        assert!((in_frame - nalgebra::vector![(x[0] + x[1]) / 2.0, 0.0, 0.0]).norm() < 1e-12);
    }
}

/// Any link on the ground other than the soles counts as a fall, so no such link may be there while the robot stands.
#[test]
fn only_soles_are_near_the_ground_at_home() {
    let robot = standfast_robots::load("ut-mu2").unwrap();
    let kinematics = Kinematics::at_home(&robot);
    for (i, link) in robot.links.iter().enumerate() {
        for solid in &link.collisions {
            let pose = kinematics.link_pose(i) * solid.pose;
            let Shape::Box { half } = solid.shape else {
                panic!("{}: not a box", link.name)
            };
            let reach = pose.rotation.to_rotation_matrix().matrix().abs() * half;
            let lowest = pose.translation.z - reach.z;
            let is_sole = Foot::BOTH
                .iter()
                .any(|&f| robot.soles[f].frame == solid.frame);
            assert!(
                if is_sole {
                    lowest.abs() < 1e-9
                } else {
                    lowest > 0.005
                },
                "{}: {lowest}",
                link.name
            );
        }
    }
}

/// Text to replace in the URDF (everywhere), its replacement, and words of the error.
const BAD_URDF: [(&str, &str, &str); 31] = [
    ("</robot>", "", "the XML is malformed"),
    ("</visual>", "</visua>", "the XML is malformed"),
    (
        "<robot name=\"ut-mu2\">",
        "<robot name=\"ut-mu2\" <",
        "builtin:ut-mu2: the XML is malformed",
    ),
    (
        "type=\"revolute\"",
        "type=\"hinge\"",
        "left_shoulder_flexion: type = hinge: this joint type is not supported; accepted: revolute, continuous, fixed",
    ),
    (
        "<axis xyz=\"0 0 1\"/>",
        "<axis xyz=\"0 0 0\"/>",
        "left_elbow_rotation: axis = 0 0 0: has no direction",
    ),
    (
        "<axis xyz=\"0 0 1\"/>",
        "<axis xyz=\"0 1\"/>",
        "left_elbow_rotation: axis xyz = 0 1: cannot be read; accepted: 3",
    ),
    (
        "value=\"0.147856\"",
        "value=\"0\"",
        "left_shoulder_flexion: mass = 0: a link that moves must have mass",
    ),
    (
        "value=\"0.147856\"",
        "value=\"-0.1\"",
        "left_shoulder_flexion: mass = -0.1: must not be negative",
    ),
    (
        "value=\"0.147856\"",
        "value=\"nan\"",
        "left_shoulder_flexion: mass value = nan: cannot be read",
    ),
    (
        "value=\"0.147856\"",
        "value=\"0.1kg\"",
        "left_shoulder_flexion: mass value = 0.1kg: cannot be read",
    ),
    (
        "value=\"0.147856\"",
        "value=\"1e300\"",
        "mass value = 1e300: is too large; accepted: a number, up to 1e7 in size",
    ),
    (
        "value=\"0.147856\"",
        "value=\"1e-300\"",
        "left_shoulder_flexion: mass = 1e-300: out of range; accepted: 1e-12 to 1e7 kg",
    ),
    (
        "ixx=\"0.000042\" ixy=\"0\" ixz=\"0.000001\" iyy=\"0.000043\" iyz=\"0\" izz=\"0.00001\"",
        "ixx=\"1e-20\" ixy=\"0\" ixz=\"0\" iyy=\"1e-20\" iyz=\"0\" izz=\"1e-20\"",
        "left_elbow_rotation: least moment of inertia = 1.0e-20: too small to be simulated; accepted: at least 7.7e-17",
    ),
    (
        "ixx=\"0.012246\"",
        "ixx=\"1e12\"",
        "body: inertia ixx = 1e12: is too large; accepted: a number, up to 1e11",
    ),
    (
        "<box size=\"0.08 0.023 0.034\"/>",
        "<box size=\"0.08 0.023 1e5\"/>",
        "box size = 0.08 0.023 1e5: is too large",
    ),
    (
        "<origin xyz=\"-0.069189 0.000422 0.008568\"/>",
        "<origin xyz=\"-0.069189 0.000422 -3\"/>",
        "the robot does not stand on its feet; accepted: more than 0.0001 m",
    ),
    (
        "<limit lower=\"-1.0471975511965976\"",
        "<dynamics damping=\"0\"",
        "left_shoulder_flexion: limit = (none): is missing",
    ),
    (
        "lower=\"-1.0471975511965976\"",
        "lower=\"4\"",
        "limit = 4 to 3.141592653589793: is not a range",
    ),
    (
        "<child link=\"left_shoulder_flexion\"/>",
        "<child link=\"arm\"/>",
        "child = arm: no such link; accepted: body,",
    ),
    (
        "<parent link=\"body\"/>",
        "<parent link=\"b\"/>",
        "parent = b: no such link",
    ),
    (
        "<child link=\"left_shoulder_flexion\"/>",
        "<child link=\"left_hip_flexion\"/>",
        "child of several joints",
    ),
    (
        "</robot>",
        "<link name=\"stray\"/></robot>",
        "body, stray: there are several root links",
    ),
    (
        "</robot>",
        "<link name=\"body\"/></robot>",
        "body: is used twice",
    ),
    (
        "<parent link=\"body\"/><child link=\"left_shoulder_flexion\"/>",
        "<parent link=\"left_hand\"/><child link=\"left_shoulder_flexion\"/>",
        "not connected to the root link body (a cycle)",
    ),
    (
        "<box size=\"0.08 0.023 0.034\"/>",
        "<cone size=\"1\"/>",
        "geometry = cone: is none of the known shapes; accepted: box",
    ),
    (
        "<box size=\"0.096172 0.069172 0.007288\"/>",
        "<mesh filename=\"a.stl\"/>",
        "soles.left = left_foot: the mesh of its collision is left out: a.stl (no such file)",
    ),
    (
        "<box size=\"0.096172 0.069172 0.007288\"/>",
        "<box size=\"0.096172 1.0 0.007288\"/>",
        "sole of left_foot: width = 1.0000 m: does not fit a robot whose COM is 0.310 m high; accepted: 0.0031 to 0.620 m",
    ),
    (
        "<box size=\"0.096172 0.069172 0.007288\"/>",
        "<box size=\"0.0005 0.069172 0.007288\"/>",
        "sole of left_foot: length = 0.0005 m: does not fit a robot whose COM is 0.310 m high",
    ),
    (
        "<box size=\"0.096172 0.069172 0.007288\"/>",
        "<box size=\"0.096172 0.3 0.007288\"/>",
        "soles = left, right: the soles overlap at home; accepted: soles beside each other",
    ),
    (
        "<box size=\"0.08 0.023 0.034\"/>",
        "<box size=\"0.08 -0.023 0.034\"/>",
        "collision: box = [0.08, -0.023, 0.034]",
    ),
    (
        "<box size=\"0.096172 0.069172 0.007288\"/>",
        "<sphere radius=\"0.01\"/>",
        "its collision is not a box",
    ),
];

/// Text to replace in the settings (once), its replacement, and words of the error.
const BAD_SETTINGS: [(&str, &str, &str); 40] = [
    (
        "friction = 0.8",
        "friction = ",
        "builtin:ut-mu2: TOML parse error",
    ),
    (
        "friction = 0.8",
        "friction = 0.8\ngrip = 1\n",
        "unknown field `grip`",
    ),
    ("friction = 0.8", "", "missing field `friction`"),
    (
        "friction = 0.8",
        "friction = -0.8",
        "friction = -0.8: out of range; accepted: 0 to 100",
    ),
    (
        "friction = 0.8",
        "friction = nan",
        "friction = NaN: out of range",
    ),
    ("delay_s = 0.004", "delay_s = -1.0", "delay_s = -1"),
    (
        "gyro_rad_s = 0.01",
        "gyro_rad_s = -0.01",
        "noise.gyro_rad_s = -0.01: out of range; accepted: 0 to 10000",
    ),
    (
        "delay_s = 0.004",
        "delay_s = 1e9",
        "delay_s = 1000000000: out of range; accepted: 0 to 1",
    ),
    (
        "friction = 0.8",
        "friction = 1e300",
        "out of range; accepted: 0 to 100",
    ),
    (
        "gyro_rad_s = 0.01",
        "gyro_rad_s = 1e5",
        "noise.gyro_rad_s = 100000: out of range; accepted: 0 to 10000",
    ),
    (
        "torque_n_m = 8.0",
        "torque_n_m = 1e13",
        "servos[0].torque_n_m = 10000000000000: out of range",
    ),
    (
        "x_m = [-0.15, 0.15]",
        "x_m = [-0.15, 0.15, 1]",
        "invalid length 3, expected an array of length 2",
    ),
    ("gyro_rad_s", "gyro_deg_s", "unknown field `gyro_deg_s`"),
    (
        "y_m = [0.075, 0.18]",
        "y_m = [0.075, 0.07]",
        "reach[0].y_m[1] = 0.07: out of range; accepted: 0.075 to 100",
    ),
    (
        "x_m = [-0.15, 0.15]",
        "x_m = [-101, 0.15]",
        "reach[0].x_m[0] = -101: out of range; accepted: -100",
    ),
    (
        "x_m = [-0.15, 0.15]",
        "x_m = [-0.15, nan]",
        "reach[0].x_m[1] = NaN: out of range",
    ),
    (
        "swing_time_s = 0.2",
        "swing_time_s = 0",
        "reach[1].swing_time_s = 0: out of range; accepted: 0.001 to 100",
    ),
    (
        "sideways_from = 0.25",
        "sideways_from = 1",
        "reach[1].sideways_from = 1: out of range; accepted: 0 to 0.8",
    ),
    (
        "\"in front\"",
        "\"beside\"",
        "reach[1].name = beside: is empty or taken; accepted: a name of its own",
    ),
    (
        "x_m = [0.105, 0.13]",
        "x_m = 0.105",
        "invalid type: floating point `0.105`",
    ),
    (
        "y_m = [-0.03, 0.075]",
        "z_m = [-0.03, 0.075]",
        "unknown field `z_m`",
    ),
    ("[[reach]]", "[reach]", "TOML parse error at line 40"),
    (
        "kp_n_m_rad = 80.0",
        "kp_n_m_rad = -80.0",
        "servos[0].kp_n_m_rad = -80: out of range; accepted: 0 to",
    ),
    (
        "kd_n_m_s_rad = 0.4",
        "kd_n_m_s_rad = -0.4",
        "servos[1].kd_n_m_s_rad = -0.4",
    ),
    (
        "torque_n_m = 8.0",
        "torque_n_m = inf",
        "servos[0].torque_n_m = inf",
    ),
    (
        "kd_n_m_s_rad = 0.4",
        "friction_n_m = -0.1\nkd_n_m_s_rad = 0.4",
        "servos[1].friction_n_m = -0.1: out of range; accepted: 0 to",
    ),
    (
        "kd_n_m_s_rad = 0.4",
        "damping_n_m_s_rad = nan\nkd_n_m_s_rad = 0.4",
        "servos[1].damping_n_m_s_rad = NaN",
    ),
    (
        "no_torque_speed_rad_s = 20.0",
        "no_torque_speed_rad_s = 9.0",
        "servos[0].no_torque_speed_rad_s = 9: out of range; accepted: 10.000001 to",
    ),
    (
        "\"left_elbow_rotation\", ",
        "",
        "servos = left_elbow_rotation: this joint has no servo",
    ),
    (
        "\"left_elbow_rotation\", ",
        "\"left_elbow\", ",
        "servos[1].joints = left_elbow: no such joint; accepted: left_sho",
    ),
    (
        "\"left_elbow_rotation\", ",
        "\"left_knee_flexion\", ",
        "left_knee_flexion: this joint already has a servo",
    ),
    (
        "trunk = \"body\"",
        "trunk = \"torso\"",
        "trunk = torso: no such link; accepted: body, battery_and_boards",
    ),
    (
        "left = \"left_foot\"",
        "left = \"left_sole\"",
        "soles.left = left_sole: no such link",
    ),
    (
        "left = \"left_foot\"",
        "left = \"left_hip_abduction\"",
        "does not have exactly one collision",
    ),
    (
        "left = \"left_foot\"",
        "left = \"left_knee_rotation\"",
        "does not have exactly one collision",
    ),
    (
        "right = \"right_foot\"",
        "right = \"left_foot\"",
        "same body as the left sole",
    ),
    (
        "left_knee_flexion = 0.7",
        "left_knee_flexion = -0.7",
        "home_rad.left_knee_flexion = -0.7: is outside of the joint's limits",
    ),
    (
        "left_knee_flexion = 0.7",
        "left_knee = 0.7",
        "home_rad = left_knee: no such joint",
    ),
    (
        "left_ankle_flexion = 0.442035",
        "left_ankle_flexion = 0.4",
        "left_foot tilted by 0.0420 rad: soles must be flat",
    ),
    (
        "left_hip_flexion = 0.257965",
        "left_hip_flexion = 0.257964",
        "soles must be level",
    ),
];

fn refused(urdf: &Source, settings: &Source, expected: &str) {
    let error = standfast_robots::parse(urdf, settings).expect_err(expected);
    let text = error.to_string();
    assert!(
        text.contains(expected),
        "expected: {expected}\n     got: {text}"
    );
    assert!(text.contains("builtin:ut-mu2"), "no file named: {text}");
    assert_eq!(error.exit_code(), 2);
}

fn with(source: &Source, text: String) -> Source {
    assert_ne!(source.text, text, "nothing replaced");
    Source {
        file: source.file.clone(),
        text,
    }
}

#[test]
fn bad_urdf_is_refused() {
    let (urdf, settings) = builtin();
    for (from, to, expected) in BAD_URDF {
        refused(
            &with(&urdf, urdf.text.replace(from, to)),
            &settings,
            expected,
        );
    }
    for text in ["", "not XML", "<a/>", "<robot name=\"r\"/>"] {
        refused(&with(&urdf, text.into()), &settings, "");
    }
}

#[test]
fn bad_settings_are_refused() {
    let (urdf, settings) = builtin();
    for (from, to, expected) in BAD_SETTINGS {
        let mut text = settings.text.replacen(from, to, 1);
        if expected == "soles must be level" {
            // With one knee bent less, its sole stays flat but is higher.
            text = text.replacen("left_knee_flexion = 0.7", "left_knee_flexion = 0.6", 1);
            text = text.replacen(
                "left_ankle_flexion = 0.442035",
                "left_ankle_flexion = 0.342036",
                1,
            );
        }
        refused(&urdf, &with(&settings, text), expected);
    }
}

#[test]
fn errors_of_a_urdf_tell_the_line() {
    let (urdf, settings) = builtin();
    let line = 1 + urdf
        .text
        .lines()
        .position(|l| l.contains("value=\"0.147856\""))
        .unwrap();
    let bad = with(
        &urdf,
        urdf.text.replacen("value=\"0.147856\"", "value=\"x\"", 1),
    );
    refused(
        &bad,
        &settings,
        &format!("builtin:ut-mu2:{line}: link left_shoulder_flexion: mass value = x"),
    );
}

#[test]
fn missing_files_are_told() {
    for (name, expected) in [
        (
            "atlas",
            "robot \"atlas\" not found; accepted: ut-mu2 or the path of a file",
        ),
        ("no/such.urdf", "no/such.urdf: cannot read"),
    ] {
        let error = standfast_robots::load(name).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
        assert_eq!(error.exit_code(), 2);
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("mine.urdf");
    std::fs::write(&path, builtin().0.text).unwrap();
    std::fs::write(path.with_extension("toml"), builtin().1.text).unwrap();
    assert_eq!(
        standfast_robots::load(path.to_str().unwrap())
            .unwrap()
            .joints
            .len(),
        20
    );
}

/// Fixed joints are merged; joints need not be in the order of the tree, and frames need not be parallel.
#[test]
fn a_stool_with_fixed_joints_in_between() {
    let source = |text: &str| Source {
        file: "stool".into(),
        text: text.into(),
    };
    let robot = standfast_robots::parse(
        &source(include_str!("../../../tests/data/stool.urdf")),
        &source(include_str!("../../../tests/data/stool.toml")),
    )
    .unwrap();
    let names: Vec<_> = robot.joints.iter().map(|j| j.name.as_str()).collect();
    assert_eq!(names, ["hip_left", "hip_right"]);
    // A seat of 2 kg at the origin, and 1 kg 0.3 m to the left, turned by 90 degrees about z: x and y of its inertia
    // swap.
    let base = &robot.links[0];
    assert!((base.mass_kg - 3.0).abs() < 1e-15);
    assert!((base.com_m - nalgebra::point![0.0, 0.1, 0.0]).norm() < 1e-12);
    let lever = 2.0 * 0.1 * 0.1 + 1.0 * 0.2 * 0.2;
    let moments = nalgebra::vector![0.02 + 0.003 + lever, 0.02 + 0.001, 0.02 + 0.003 + lever];
    let expected = nalgebra::Matrix3::from_diagonal(&moments);
    assert!(
        (base.inertia_kg_m2 - expected).norm() < 1e-12,
        "{}",
        base.inertia_kg_m2
    );
    assert_eq!(robot.frames[1].link, 0);
    assert!((robot.home_com_height() - (3.0 * 0.55 + 2.0 * 0.25) / 5.0).abs() < 1e-12);
}

/// Settings may state friction and damping of joints. Motors from elsewhere have them if their file states them.
#[test]
fn joints_have_the_friction_and_damping_that_are_stated() {
    let (urdf, settings) = builtin();
    let losses = |robot: &Robot, joint: &str| {
        let named = robot.joints.iter().position(|known| known.name == joint);
        let (servo, origin) = (
            robot.servos[named.unwrap()],
            &robot.motor_origins[named.unwrap()],
        );
        (
            [servo.friction_n_m, servo.damping_n_m_s_rad],
            [origin.friction.clone(), origin.damping.clone()],
        )
    };
    let (knee, elbow) = ("left_knee_flexion", "left_elbow_flexion");
    let from = |words: [&str; 2]| words.map(String::from);
    let none = standfast_robots::parse(&urdf, &settings).unwrap();
    let neither = ([0.0, 0.0], from(["settings", "settings"]));
    assert_eq!(losses(&none, knee), neither);

    // The second group is that of the arms.
    let (legs, arms) = settings.text.split_once("# Arms").unwrap();
    let stated = arms.replacen(
        "kp_n_m_rad",
        "friction_n_m = 0.2\ndamping_n_m_s_rad = 0.03\norigin.torque = \"a\"\norigin.speed = \"b\"\n\
         origin.rotor_inertia = \"c\"\norigin.friction = \"measured\"\nkp_n_m_rad",
        1,
    );
    let stated = with(&settings, format!("{legs}# Arms{stated}"));
    let robot = standfast_robots::parse(&urdf, &stated).unwrap();
    let of_elbow = ([0.2, 0.03], from(["measured", "settings"]));
    assert_eq!(losses(&robot, elbow), of_elbow);
    assert_eq!(losses(&robot, knee), neither);

    let dir = tempfile::tempdir().unwrap();
    let path = |name: &str| dir.path().join(name).to_str().unwrap().to_string();
    let (motors, plain) = (path("motors.toml"), path("plain.toml"));
    std::fs::write(&motors, &stated.text).unwrap();
    std::fs::write(&plain, &settings.text).unwrap();
    let files = Files::open("ut-mu2").unwrap();
    let robot = files.with_motors(Some(&motors)).unwrap().load().unwrap();
    let of_motors = "of motors.toml";
    assert_eq!(losses(&robot, elbow), ([0.2, 0.03], from([of_motors; 2])));
    assert_eq!(losses(&robot, knee), neither);
    let told = "torque limits, speeds, rotor inertias, friction, damping of 20 joints";
    assert!(robot.assumptions.iter().any(|line| line.contains(told)));

    // Motors of a file that does not state them leave those of the robot.
    std::fs::write(path("robot.urdf"), &urdf.text).unwrap();
    std::fs::write(path("robot.toml"), &stated.text).unwrap();
    let files = Files::open(&path("robot.urdf")).unwrap();
    let robot = files.with_motors(Some(&plain)).unwrap().load().unwrap();
    assert_eq!(losses(&robot, elbow), of_elbow);

    // What is inferred has them only where they are not 0.
    let inferred = |motors| urdf::completed(&urdf, None, None, motors).unwrap();
    assert!(!inferred(None).text.contains("friction_n_m"));
    let settings = inferred(Some(&motors));
    for line in [
        "friction_n_m = 0.2              # dry friction [N m]; of motors.toml",
        "damping_n_m_s_rad = 0.03        # damping in the joint [N m s/rad]; of motors.toml",
    ] {
        let lines = settings.text.lines().filter(|known| *known == line);
        assert!(lines.count() >= 1, "{line}: {}", settings.text);
    }
    let robot = standfast_robots::parse(&urdf, &settings).unwrap();
    assert_eq!(losses(&robot, elbow), ([0.2, 0.03], from([of_motors; 2])));
    assert_eq!(losses(&robot, knee), neither);
}
