//! Small MJCFs as they are published, and the built-in robot as an MJCF.

use super::*;
use crate::tree::{Motor, Tree};
use nalgebra::{Point3, UnitQuaternion, vector};
use standfast_core::robot::Shape;
use standfast_core::robot::model::{Joint, Solid};
use standfast_files::assets::{self, InputKind};
use std::fmt::Write;

fn source(text: &str) -> Source {
    Source {
        file: "nowhere/mine.xml".into(),
        text: text.into(),
    }
}

fn parse(text: &str) -> Result<Tree> {
    Tree::parse(&source(text), None)
}

/// A free body of 2 kg that holds `within`, with other sections before the world.
fn on_body(sections: &str, within: &str) -> String {
    format!(
        r#"<mujoco model="mine">{sections}<worldbody><geom type="plane" size="1 1 1"/>
<body name="body" pos="0 0 1"><freejoint/><inertial mass="2" pos="0 0 0" diaginertia="2e-4 2e-4 2e-4"/>{within}</body>
</worldbody></mujoco>"#
    )
}

/// A link of 1 kg on the body that holds `within`.
fn arm(within: &str) -> String {
    format!(
        r#"<body name="arm" pos="0 0 0.1"><inertial mass="1" pos="0 0 0" diaginertia="1e-4 1e-4 1e-4"/>{within}</body>"#
    )
}

fn refused(text: &str, expected: &str) {
    let error = parse(text)
        .err()
        .unwrap_or_else(|| panic!("not refused: {expected}"));
    assert!(error.to_string().contains(expected), "{expected}: {error}");
}

fn noted(tree: &Tree, expected: &str) {
    assert!(
        tree.notes.iter().any(|note| note.contains(expected)),
        "{expected}: {:?}",
        tree.notes
    );
}

fn text_of(pose: &Isometry3<f64>) -> String {
    let (at, turn) = (pose.translation.vector, pose.rotation);
    format!(
        r#"pos="{} {} {}" quat="{} {} {} {}""#,
        at.x, at.y, at.z, turn.w, turn.i, turn.j, turn.k
    )
}

/// A tree without meshes as an MJCF, each joint off the origin of its body, whose axes are turned, with angles in degrees.
fn written(tree: &Tree) -> String {
    fn body(tree: &Tree, link: usize, moved: &[Isometry3<f64>], text: &mut String) {
        let of = &tree.links[link];
        // The frame of the body in that of the link.
        let own = moved[link];
        let pose = match link.checked_sub(1) {
            Some(j) => moved[tree.joints[j].parent].inverse() * tree.joints[j].origin * own,
            None => Isometry3::translation(0.0, 0.0, 1.0),
        };
        _ = write!(text, r#"<body name="{}" {}>"#, of.name, text_of(&pose));
        let i = own.rotation.inverse().to_rotation_matrix()
            * of.inertia_kg_m2
            * own.rotation.to_rotation_matrix();
        let com = own.inverse() * of.com_m;
        _ = write!(
            text,
            r#"<inertial pos="{} {} {}" mass="{}" fullinertia="{} {} {} {} {} {}"/>"#,
            com.x, com.y, com.z, of.mass_kg, i.m11, i.m22, i.m33, i.m12, i.m13, i.m23
        );
        match link
            .checked_sub(1)
            .map(|j| (&tree.joints[j], &tree.motors[j]))
        {
            Some((joint, motor)) => {
                let (at, axis) = (own.inverse() * Point3::origin(), own.inverse() * joint.axis);
                _ = write!(
                    text,
                    r#"<joint name="{}" pos="{} {} {}" axis="{} {} {}" range="{} {}" actuatorfrcrange="-{} {1}"/>"#,
                    joint.name,
                    at.x,
                    at.y,
                    at.z,
                    axis.x,
                    axis.y,
                    axis.z,
                    joint.lower_rad.to_degrees(),
                    joint.upper_rad.to_degrees(),
                    motor.effort_n_m.unwrap_or(1.0),
                );
            }
            None => text.push_str("<freejoint/>"),
        }
        for (solid, bits) in of
            .collisions
            .iter()
            .map(|s| (s, 1))
            .chain(of.visuals.iter().map(|s| (s, 0)))
        {
            let shape = match &solid.shape {
                Shape::Box { half } => {
                    format!(r#"type="box" size="{} {} {}""#, half.x, half.y, half.z)
                }
                Shape::Cylinder { radius, length } => {
                    format!(r#"type="cylinder" size="{radius} {}""#, 0.5 * length)
                }
                Shape::Capsule { radius, length } => {
                    format!(r#"type="capsule" size="{radius} {}""#, 0.5 * length)
                }
                Shape::Sphere { radius } => format!(r#"size="{radius}""#),
                Shape::Mesh(_) => panic!("a mesh"),
            };
            let pose = own.inverse() * solid.pose;
            _ = write!(
                text,
                r#"<geom {shape} contype="{bits}" conaffinity="0" {}/>"#,
                text_of(&pose)
            );
        }
        for (j, _) in tree
            .joints
            .iter()
            .enumerate()
            .filter(|(_, joint)| joint.parent == link)
        {
            body(tree, j + 1, moved, text);
        }
        text.push_str("</body>");
    }
    let moved: Vec<_> = (0..tree.links.len())
        .map(|i| match i {
            0 => Isometry3::identity(),
            _ => Isometry3::new(
                vector![0.01 * i as f64, -0.02, 0.03],
                vector![0.1 * i as f64, 1.0, -0.3],
            ),
        })
        .collect();
    let mut text = String::from(r#"<mujoco model="ut-mu2"><worldbody>"#);
    body(tree, 0, &moved, &mut text);
    text + "</worldbody></mujoco>"
}

/// Largest differences of two trees in the world at zero angles: of masses (kg), COMs (m), inertias (kg m^2), places (m),
/// axes and limits of the joints (rad). The joints are matched by their names.
pub fn differences(a: &Tree, b: &Tree) -> [f64; 6] {
    let poses = |tree: &Tree| {
        let mut poses = vec![Isometry3::<f64>::identity()];
        for Joint { parent, origin, .. } in &tree.joints {
            poses.push(poses[*parent] * origin);
        }
        poses
    };
    let (at, bt) = (poses(a), poses(b));
    let mut most = [0.0_f64; 6];
    let mut see = |k: usize, difference: f64| most[k] = most[k].max(difference);
    let mut compare = |i: usize, j: usize| {
        let (x, y) = (&a.links[i], &b.links[j]);
        see(0, (x.mass_kg - y.mass_kg).abs());
        see(1, (at[i] * x.com_m - bt[j] * y.com_m).norm());
        let about = |pose: &Isometry3<f64>, inertia: &Matrix3<f64>| {
            let turn = pose.rotation.to_rotation_matrix();
            turn * inertia * turn.transpose()
        };
        see(
            2,
            (about(&at[i], &x.inertia_kg_m2) - about(&bt[j], &y.inertia_kg_m2)).amax(),
        );
        if let (Some(i), Some(j)) = (i.checked_sub(1), j.checked_sub(1)) {
            let (x, y) = (&a.joints[i], &b.joints[j]);
            see(
                3,
                (at[i + 1].translation.vector - bt[j + 1].translation.vector).norm(),
            );
            see(
                4,
                (at[i + 1] * x.axis.into_inner() - bt[j + 1] * y.axis.into_inner()).norm(),
            );
            see(
                5,
                (x.lower_rad - y.lower_rad)
                    .abs()
                    .max((x.upper_rad - y.upper_rad).abs()),
            );
        }
    };
    assert_eq!(a.joints.len(), b.joints.len());
    compare(0, 0);
    for (i, joint) in a.joints.iter().enumerate() {
        let j = b
            .joints
            .iter()
            .position(|other| other.name == joint.name)
            .expect(&joint.name);
        compare(i + 1, j + 1);
    }
    most
}

#[test]
fn the_built_in_robot_as_an_mjcf_is_the_same_robot() {
    let urdf = Tree::parse(&assets::open(InputKind::Robot, "ut-mu2").unwrap(), None).unwrap();
    let mjcf = parse(&written(&urdf)).unwrap();
    for difference in differences(&urdf, &mjcf) {
        assert!(difference < 1e-9, "{:?}", differences(&urdf, &mjcf));
    }
    // The shapes are where they were.
    let corners = |tree: &Tree, pick: fn(&standfast_core::robot::Link) -> &Vec<Solid>| {
        let mut poses = vec![Isometry3::<f64>::identity()];
        let mut corners = Vec::new();
        for (i, link) in tree.links.iter().enumerate() {
            if let Some(joint) = i.checked_sub(1).map(|j| &tree.joints[j]) {
                poses.push(poses[joint.parent] * joint.origin);
            }
            corners.extend(
                pick(link)
                    .iter()
                    .flat_map(Solid::points)
                    .map(|point| poses[i] * point),
            );
        }
        corners.sort_by(|a: &Point3<f64>, b| a.x.total_cmp(&b.x));
        corners
            .iter()
            .map(|point| point.coords)
            .sum::<Vector3<f64>>()
    };
    for pick in [
        (|link| &link.collisions) as fn(&standfast_core::robot::Link) -> &Vec<Solid>,
        |link| &link.visuals,
    ] {
        assert!((corners(&urdf, pick) - corners(&mjcf, pick)).norm() < 1e-6);
    }
    let torques = |tree: &Tree| {
        tree.motors
            .iter()
            .map(|motor| motor.effort_n_m.unwrap_or(1.0))
            .sum::<f64>()
    };
    assert_eq!(torques(&urdf), torques(&mjcf));
    assert_eq!(mjcf.name, "ut-mu2");
}

#[test]
fn defaults_hold_from_the_outer_class_to_the_inner_one_and_own_attributes_before_them() {
    let sections = r#"<compiler eulerseq="zyx"/><default><joint axis="1 0 0" armature="0.1" range="-90 90"/>
<geom quat="0 1 0 0" type="box" size="1 2 3"/><default class="outer"><joint damping="2"/>
<default class="inner"><joint armature="0.3" frictionloss="0.4"/></default></default></default>"#;
    let joint = |more: &str| {
        let within = arm(&format!(
            "<joint name=\"j\" {more}/><geom pos=\"0 0 1\" mass=\"0\"/>"
        ));
        let text = on_body(
            sections,
            &within.replace(
                "<body name=\"arm\"",
                "<body name=\"arm\" childclass=\"outer\"",
            ),
        );
        parse(&text).unwrap()
    };
    let of = |tree: &Tree| {
        let Motor {
            rotor_inertia_kg_m2,
            friction_n_m,
            damping_n_m_s_rad,
            ..
        } = tree.motors[0];
        [rotor_inertia_kg_m2, friction_n_m, damping_n_m_s_rad]
    };
    let plain = joint("");
    assert_eq!(of(&plain), [Some(0.1), None, Some(2.0)]);
    assert_eq!(
        of(&joint(r#"class="inner""#)),
        [Some(0.3), Some(0.4), Some(2.0)]
    );
    assert_eq!(
        of(&joint(r#"class="main" armature="0.7""#)),
        [Some(0.7), None, None]
    );
    // Degrees unless radians are stated, and the place of the geom leaves its turn.
    let limits = |tree: &Tree| [tree.joints[0].lower_rad, tree.joints[0].upper_rad];
    let right = std::f64::consts::FRAC_PI_2;
    assert_eq!(limits(&plain), [-right, right]);
    let turn = plain.links[1].collisions[0].pose;
    assert!(
        (turn.rotation.angle() - std::f64::consts::PI).abs() < 1e-12 && turn.translation.z == 1.0
    );
    assert_eq!(
        limits(&joint(r#"limited="false""#)),
        [f64::NEG_INFINITY, f64::INFINITY]
    );
    refused(
        &on_body(sections, &arm("<joint class=\"none\"/>")),
        "joint of arm: class = none: no such class",
    );
}

#[test]
fn all_ways_to_state_a_pose_agree() {
    let pose = |settings: &str, turn: &str| {
        let within = arm(&format!(
            r#"<joint name="j"/><geom type="box" size="1 2 3" pos="1 2 3" {turn}/>"#
        ));
        parse(&on_body(settings, &within)).unwrap().links[1].collisions[0]
            .pose
            .rotation
    };
    let near =
        |a: UnitQuaternion<f64>, b: UnitQuaternion<f64>| assert!(a.angle_to(&b) < 1e-9, "{a} {b}");
    let about = |axis: Vector3<f64>, degrees: f64| {
        UnitQuaternion::from_scaled_axis(axis * degrees.to_radians())
    };
    let (x, y, z) = (Vector3::x(), Vector3::y(), Vector3::z());
    let expected = about(x, 10.0) * about(y, 20.0) * about(z, 30.0);
    near(pose("", r#"euler="10 20 30""#), expected);
    near(
        pose(r#"<compiler eulerseq="zyx"/>"#, r#"euler="30 20 10""#),
        about(z, 30.0) * about(y, 20.0) * about(x, 10.0),
    );
    near(
        pose(r#"<compiler eulerseq="XYZ"/>"#, r#"euler="10 20 30""#),
        about(z, 30.0) * about(y, 20.0) * about(x, 10.0),
    );
    near(
        pose(r#"<compiler angle="radian"/>"#, r#"axisangle="0 2 0 0.5""#),
        UnitQuaternion::from_scaled_axis(y * 0.5),
    );
    let [ex, ey, ez] = [x, y, z].map(|axis| expected * axis);
    near(
        pose(
            "",
            &format!(
                r#"xyaxes="{} {} {} {} {} {}""#,
                ex.x, ex.y, ex.z, ey.x, ey.y, ey.z
            ),
        ),
        expected,
    );
    let turned = pose("", &format!(r#"zaxis="{} {} {}""#, ez.x, ez.y, ez.z));
    assert!((turned * z - ez).norm() < 1e-9);
    // The rotation by a right angle at which roll and yaw cannot be told apart.
    for pitch in [90.0, 89.9999999, -90.0] {
        near(
            pose("", &format!(r#"euler="40 {pitch} 30""#)),
            about(x, 40.0) * about(y, pitch) * about(z, 30.0),
        );
    }
    refused(
        &on_body(r#"<compiler eulerseq="xy"/>"#, &arm("<joint/>")),
        "compiler eulerseq = xy",
    );
    refused(
        &on_body("", &arm("<joint axis=\"1 0\"/>")),
        "mine.xml:2: joint of arm: axis = 1 0: cannot be read",
    );
}

#[test]
fn a_joint_turns_about_its_anchor_from_its_reference() {
    let within = arm(
        r#"<joint name="j" pos="0 0.5 0" axis="1 0 0" ref="90" range="0 180"/><geom size="0.1" pos="0 1 0"/>"#,
    );
    let tree = parse(&on_body("", &within)).unwrap();
    assert!((tree.joints[0].origin.translation.vector - vector![0.0, 0.5, 0.1]).norm() < 1e-12);
    // At the angle 90 degrees, the ball is where the file has it.
    let turn = Isometry3::rotation(Vector3::x() * std::f64::consts::FRAC_PI_2);
    let at = tree.joints[0].origin * turn * tree.links[1].collisions[0].pose;
    assert!(
        (at.translation.vector - vector![0.0, 1.0, 0.1]).norm() < 1e-12,
        "{at}"
    );
}

#[test]
fn a_body_with_several_joints_is_a_chain_with_its_mass() {
    let joints = r#"<joint name="yaw" axis="0 0 1"/><joint name="roll" axis="1 0 0"/><joint name="pitch" axis="0 1 0" pos="0 0 0.2"/>"#;
    let tree = parse(&on_body("", &arm(joints))).unwrap();
    let names: Vec<_> = tree
        .joints
        .iter()
        .map(|joint| joint.name.as_str())
        .collect();
    assert_eq!(names, ["yaw", "roll", "pitch"]);
    let masses: Vec<_> = tree.links.iter().map(|link| link.mass_kg).collect();
    assert_eq!(masses, [2.0, 0.02, 0.02, 0.96]);
    assert!((tree.links[3].com_m - Point3::new(0.0, 0.0, -0.2)).norm() < 1e-12);
    noted(&tree, "2 % of the body's mass and inertia: arm.");
}

#[test]
fn the_mass_of_a_body_is_that_of_its_geoms() {
    let of = |geoms: &str| {
        let body = format!(r#"<body name="arm" pos="0 0 1"><joint name="j"/>{geoms}</body>"#);
        parse(&on_body("", &body)).unwrap().links[1].clone()
    };
    // Sums over small cubes.
    for (geom, size, inside) in [
        (
            r#"type="capsule" size="0.1 0.2""#,
            0.3,
            (|x, y, z| x * x + y * y + f64::powi((f64::abs(z) - 0.2).max(0.0), 2) < 0.01)
                as fn(f64, f64, f64) -> bool,
        ),
        (
            r#"type="cylinder" fromto="0 0 -0.2 0 0 0.2" size="0.1""#,
            0.2,
            |x, y, z| x * x + y * y < 0.01 && z.abs() < 0.2,
        ),
        (r#"type="ellipsoid" size="0.1 0.2 0.3""#, 0.3, |x, y, z| {
            (x / 0.1).powi(2) + (y / 0.2).powi(2) + (z / 0.3).powi(2) < 1.0
        }),
        (r#"type="box" size="0.1 0.2 0.3""#, 0.3, |x, y, z| {
            x.abs() < 0.1 && y.abs() < 0.2 && z.abs() < 0.3
        }),
        (r#"size="0.2""#, 0.2, |x, y, z| x * x + y * y + z * z < 0.04),
    ] {
        let (n, mut volume, mut moments) = (60, 0.0, Vector3::<f64>::zeros());
        let step = 2.0 * size / f64::from(n);
        let at = |i: i32| -size + (f64::from(i) + 0.5) * step;
        for (i, j, k) in
            (0..n).flat_map(|i| (0..n).flat_map(move |j| (0..n).map(move |k| (i, j, k))))
        {
            let (x, y, z) = (at(i), at(j), at(k));
            if inside(x, y, z) {
                volume += step.powi(3);
                moments += vector![y * y + z * z, x * x + z * z, x * x + y * y] * step.powi(3);
            }
        }
        let link = of(&format!(
            r#"<geom {geom} contype="0" conaffinity="0" density="500"/>"#
        ));
        assert!(
            (link.mass_kg / (500.0 * volume) - 1.0).abs() < 0.02,
            "{geom}: {} {}",
            link.mass_kg,
            500.0 * volume
        );
        let found = link.inertia_kg_m2.diagonal();
        assert!(
            (found - moments * 500.0).amax() < 0.03 * found.amax(),
            "{geom}: {found} {moments}"
        );
    }
    let two = of(
        r#"<geom size="0.1" mass="1"/><geom size="0.1" mass="3" pos="0 0 0.4" group="5"/><geom size="9" group="6"/>"#,
    );
    assert!((two.mass_kg - 4.0).abs() < 1e-12 && (two.com_m.z - 0.3).abs() < 1e-12);
    assert!((two.inertia_kg_m2.m11 - (4.0 * 0.4 * 0.01 + 0.75 * 0.16)).abs() < 1e-12);
    let mesh = r#"<body name="arm"><joint/><geom type="mesh" mesh="a"/></body>"#;
    let asset = r#"<asset><mesh file="a.stl"/></asset>"#;
    refused(
        &on_body(asset, mesh),
        "body arm: mass = geom of arm: is a mesh or shell",
    );
    let scaled = parse(&on_body(
        r#"<compiler settotalmass="30"/>"#,
        &arm("<joint/>"),
    ))
    .unwrap();
    assert_eq!(
        scaled
            .links
            .iter()
            .map(|link| link.mass_kg)
            .collect::<Vec<_>>(),
        [20.0, 10.0]
    );
}

#[test]
fn the_torque_of_a_joint_is_the_least_that_is_stated() {
    let torque = |joint: &str, actuator: &str| {
        let sections = format!(
            r#"<default><motor ctrlrange="-5 5"/></default><actuator>{actuator}</actuator>"#
        );
        parse(&on_body(
            &sections,
            &arm(&format!(r#"<joint name="j" {joint}/>"#)),
        ))
        .unwrap()
        .motors[0]
            .effort_n_m
    };
    for (joint, actuator, expected) in [
        ("", "", None),
        ("", r#"<motor joint="j" gear="3"/>"#, Some(15.0)),
        ("", r#"<motor joint="j" ctrllimited="false"/>"#, None),
        ("", r#"<position joint="j" ctrlrange="-1 1"/>"#, None),
        (
            "",
            r#"<position joint="j" forcerange="-7 7" gear="2"/>"#,
            Some(14.0),
        ),
        (
            "",
            r#"<motor joint="j" forcerange="-2 3" gear="3"/>"#,
            Some(9.0),
        ),
        (
            "",
            r#"<general joint="j" gainprm="4" ctrlrange="-1 2"/>"#,
            Some(8.0),
        ),
        (
            r#"actuatorfrcrange="-9 9""#,
            r#"<motor joint="j" gear="3"/>"#,
            Some(9.0),
        ),
        (
            r#"actuatorfrcrange="-20 20""#,
            r#"<motor joint="j" gear="3"/>"#,
            Some(15.0),
        ),
    ] {
        assert_eq!(torque(joint, actuator), expected, "{joint} {actuator}");
    }
}

#[test]
fn what_is_no_tree_of_hinges_is_refused_or_noted_by_its_name() {
    let refuse = |sections: &str, within: &str, expected: &str| {
        refused(&on_body(sections, &arm(within)), expected)
    };
    refuse(
        "",
        r#"<joint type="ball" name="b"/>"#,
        "joint b: type = ball: this type of joint is not supported",
    );
    refuse(
        "",
        r#"<joint/><replicate count="2"/>"#,
        "body arm = replicate of arm: is not supported within a robot",
    );
    refuse(
        "",
        r#"<joint/><geom type="cone"/>"#,
        "geom of arm: type = cone: is no type of a geom",
    );
    refuse(
        "",
        "<freejoint/><joint name=\"a\" range=\"1 -1\"/>",
        "joint a: limit",
    );
    let equality = |inner: &str| format!("<equality>{inner}</equality>");
    let connect = r#"<connect name="rod" body1="body" body2="arm" anchor="0 0 0"/>"#;
    refuse(
        &equality(connect),
        "<joint/>",
        "connect rod = body and arm: closes a loop of bodies",
    );
    refuse(
        &equality(r#"<weld body1="body" body2="arm"/>"#),
        "<joint/>",
        "body and arm: closes a loop",
    );
    let inactive = connect.replace("name=", "active=\"false\" name=");
    assert!(
        parse(&on_body(&equality(&inactive), &arm("<joint/>")))
            .unwrap()
            .notes
            .is_empty()
    );
    let to_world = parse(&on_body(
        &equality(r#"<weld name="rope" body1="body" body2="crane"/>"#),
        &arm("<joint/>"),
    ));
    noted(
        &to_world.unwrap(),
        "Equalities are left out: weld rope (body and crane).",
    );
    let within = arm(r#"<joint name="j"/>"#) + &arm(r#"<joint name="k"/>"#).replace("arm", "leg");
    let sections = equality(r#"<joint joint1="k" joint2="j" polycoef="0.5 -0.5"/>"#)
        + r#"<tendon><fixed name="rope"><joint joint="j" coef="1"/></fixed></tendon><actuator><motor name="pull" tendon="rope"/><motor joint="j" ctrlrange="-4 4"/></actuator>"#;
    let tree = parse(&on_body(&sections, &within)).unwrap();
    assert_eq!(tree.joints.len(), 1);
    noted(&tree, "k (mimic of another joint");
    noted(&tree, "Tendons are left out: fixed rope.");
    noted(
        &tree,
        "Actuators that drive no single joint are left out: motor pull.",
    );
    let leg = tree
        .frames
        .iter()
        .find(|frame| frame.name == "leg")
        .unwrap();
    assert!((leg.pose.rotation.angle() - 0.5).abs() < 1e-12);
    // Of a motor's joint and the one that it drives, the one that carries more moves.
    let foot = arm("<joint name=\"f\"/>").replace("arm", "foot");
    let within = within.replace("name=\"k\"/>", &format!("name=\"k\"/>{foot}"));
    let tree = parse(&on_body(&sections, &within)).unwrap();
    let names: Vec<_> = tree
        .joints
        .iter()
        .map(|joint| joint.name.as_str())
        .collect();
    assert_eq!(names, ["k", "f"]);
    assert_eq!(tree.motors[0].effort_n_m, Some(8.0));
    noted(
        &parse(&on_body("", &arm("<joint type=\"slide\" name=\"s\"/>"))).unwrap(),
        "s (prismatic)",
    );
    noted(
        &parse(&on_body("", &arm("<joint name=\"s\" stiffness=\"3\"/>"))).unwrap(),
        "Springs at joints are left out: s.",
    );
    let fixed = on_body("", &arm("<joint/>")).replace("<freejoint/>", "");
    noted(&parse(&fixed).unwrap(), "The base body has no free joint");
    refused(
        &fixed.replace(
            "<inertial mass=\"2\"",
            "<joint name=\"x\"/><inertial mass=\"2\"",
        ),
        "joint x = body: ties the base to the world",
    );
    refuse(
        "<compiler coordinate=\"global\"/>",
        "<joint/>",
        "compiler coordinate = global: is not supported",
    );
    noted(
        &parse(&on_body("<compiler boundmass=\"0.1\"/>", &arm("<joint/>"))).unwrap(),
        "boundmass = 0.1 of <compiler>",
    );
    refused("<mujoco/>", "worldbody = (none): there is no robot");
}

#[test]
fn keyframes_and_imus_of_a_scene_are_those_of_its_robot() {
    let sections = r#"<keyframe><key name="home" qpos="0 0 1 1 0 0 0 9 0.25"/><key name="short" qpos="1"/></keyframe>
<sensor><gyro site="middle"/></sensor>"#;
    let text = on_body(
        sections,
        &arm(r#"<joint name="j"/><site name="imu_site"/><site name="tip"/>"#),
    )
    .replace(
        "<freejoint/>",
        "<freejoint/><site name=\"middle\" pos=\"0 0 0.3\"/>",
    )
    .replace(
        "<body name=\"body\"",
        "<body name=\"door\"><joint name=\"hinge\"/></body><body name=\"body\"",
    );
    let tree = parse(&text).unwrap();
    assert_eq!(tree.postures.len(), 1);
    assert!(
        tree.postures[0].by_joint.contains(&("j".into(), 0.25)),
        "{:?}",
        tree.postures
    );
    noted(
        &tree,
        "Bodies beside the robot are left out, with what they carry: door.",
    );
    noted(
        &tree,
        "does not have 9 numbers, as the joints do: short (1 numbers)",
    );
    let frames: Vec<_> = tree
        .frames
        .iter()
        .map(|frame| (frame.name.as_str(), frame.link))
        .collect();
    assert_eq!(
        frames,
        [
            ("body", 0),
            ("arm", 1),
            ("middle (IMU)", 0),
            ("imu_site", 1)
        ]
    );
}

#[test]
fn files_are_included_from_the_folder_of_the_main_file() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    std::fs::create_dir(folder.path().join("deep")).unwrap();
    let whole = on_body(
        "<compiler angle=\"radian\"/>",
        &arm("<joint name=\"j\" range=\"-1 1\"/><include file=\"tip.xml\"/>"),
    );
    write(
        "robot.xml",
        &whole.replace(
            "<mujoco model=\"mine\">",
            "<mujoco><include file=\"deep/more.xml\"/>",
        ),
    );
    write(
        "tip.xml",
        "<mujocoinclude><geom size=\"0.1\"/></mujocoinclude>",
    );
    write(
        "deep/more.xml",
        "<mujoco><default><joint armature=\"0.5\"/></default></mujoco>",
    );
    write(
        "scene.xml",
        "<?xml version=\"1.0\"?>\n<mujoco model=\"scene\"><include file=\"robot.xml\"/></mujoco>",
    );
    let open = |name: &str| crate::urdf::opened(folder.path().join(name).to_str().unwrap());
    let source = open("scene.xml").unwrap();
    assert!(
        source
            .text
            .ends_with("<!-- With the files that it includes: robot.xml, more.xml, tip.xml. -->\n")
    );
    let tree = Tree::parse(&source, None).unwrap();
    assert_eq!(
        (
            tree.links[1].collisions.len(),
            tree.joints[0].upper_rad,
            tree.name.as_str()
        ),
        (1, 1.0, "scene")
    );
    assert_eq!(tree.motors[0].rotor_inertia_kg_m2, Some(0.5));
    // Its lines are no longer those of the file.
    let bad = Source {
        text: source.text.replace("-1 1", "-1 x"),
        ..source
    };
    let error = Tree::parse(&bad, None).err().unwrap().to_string();
    assert!(
        error.contains("scene.xml: joint j: range = -1 x"),
        "{error}"
    );
    write(
        "twice.xml",
        "<mujoco><include file=\"tip.xml\"/><include file=\"deep/../tip.xml\"/></mujoco>",
    );
    write("lost.xml", "<mujoco><include file=\"none.xml\"/></mujoco>");
    write(
        "round.xml",
        "<mujoco><include file=\"round.xml\"/></mujoco>",
    );
    for (name, expected) in [
        (
            "twice.xml",
            "include file = deep/../tip.xml: is included twice",
        ),
        ("round.xml", "include file = round.xml: is included twice"),
        ("lost.xml", "include file = none.xml: no such file"),
    ] {
        let error = open(name).unwrap_err().to_string();
        assert!(error.contains(expected), "{expected}: {error}");
    }
}

/// Rotor inertias and a keyframe come into the settings, and the file serves as a file of motors.
#[test]
fn settings_have_what_an_mjcf_states() {
    let folder = tempfile::tempdir().unwrap();
    let urdf = Tree::parse(&assets::open(InputKind::Robot, "ut-mu2").unwrap(), None).unwrap();
    let text = written(&urdf);
    let names = text
        .split("<joint name=\"")
        .skip(1)
        .filter_map(|rest| rest.split('"').next());
    let angle = |name: &str| match name {
        name if name.ends_with("hip_flexion") => "0.2",
        name if name.ends_with("knee_flexion") => "0.5",
        name if name.ends_with("ankle_flexion") => "0.3",
        _ => "0",
    };
    let angles: Vec<_> = names.map(angle).collect();
    let sections = format!(
        r#"<default><joint armature="0.002"/></default><keyframe><key name="squat" qpos="0"/>
<key name="Home" qpos="0 0 1 1 0 0 0 {}"/></keyframe><worldbody>"#,
        angles.join(" ")
    );
    let path = folder.path().join("mine.xml");
    std::fs::write(&path, text.replace("<worldbody>", &sections)).unwrap();
    let files = crate::Files::open(path.to_str().unwrap()).unwrap();
    assert!(files.are_inferred && files.extension() == "xml");
    let robot = files.robot().unwrap();
    assert!(
        robot
            .servos
            .iter()
            .all(|servo| servo.rotor_inertia_kg_m2 == 0.002)
    );
    assert!(
        robot
            .motor_origins
            .iter()
            .all(|origin| origin.rotor_inertia == "read")
    );
    for (joint, home) in robot.joints.iter().zip(&robot.home_rad) {
        assert_eq!(
            joint.name.ends_with("knee_flexion"),
            (home - 0.5).abs() < 1e-6,
            "{}: {home}",
            joint.name
        );
    }
    for expected in [
        "It is the reference posture Home of ",
        "\"read\" is from the MJCF",
        "cannot state",
    ] {
        assert!(
            files.settings.text.contains(expected),
            "{expected}: {}",
            files.settings.text
        );
    }
    let motors = crate::motors::Motors::open(path.to_str().unwrap(), &robot).unwrap();
    assert_eq!(
        (motors.file.as_str(), motors.by_joint.len()),
        ("mine.xml", robot.joints.len())
    );
    assert!(
        motors
            .by_joint
            .values()
            .all(|motor| motor.rotor_inertia_kg_m2 == Some(0.002))
    );
}

/// What MuJoCo reads in another way than it looks, and files that could be taken for good ones.
#[test]
fn a_tilted_base_a_range_that_is_taken_back_and_includes_within_includes() {
    let robot = |base: &str, joint: &str| {
        format!(
            r#"<mujoco><default><default class="c"><joint range="-1 1"/></default></default><compiler angle="radian"/><worldbody>
            <body name="base" {base}><freejoint/><geom size="0.1" mass="1"/>
            <body name="arm"><joint name="j" class="c" axis="0 1 0" {joint}/><geom size="0.1" mass="1"/></body></body>
            </worldbody></mujoco>"#
        )
    };
    let parse = |text: String| {
        let file = "robot.xml".into();
        Tree::parse(&Source { file, text }, None)
    };
    let told = parse(robot(r#"euler="0 0.5 0""#, ""))
        .unwrap_err()
        .to_string();
    assert!(
        told.contains("the base is turned out of the vertical"),
        "{told}"
    );
    let limits = |joint: &str| {
        let tree = parse(robot(r#"euler="0 0 0.5""#, joint)).unwrap();
        [tree.joints[0].lower_rad, tree.joints[0].upper_rad]
    };
    assert_eq!(limits(""), [-1.0, 1.0]);
    assert_eq!(limits(r#"range="0 0""#), [f64::NEG_INFINITY, f64::INFINITY]);
    for mass in ["inf", "30 kg"] {
        let text =
            robot("", "").replace("<compiler ", &format!("<compiler settotalmass=\"{mass}\" "));
        let told = parse(text).unwrap_err().to_string();
        assert!(
            told.contains(&format!("settotalmass = {mass}: is no mass")),
            "{told}"
        );
    }
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("a---.xml", &robot("", ""));
    write("b.xml", "<mujoco/>");
    write(
        "main.xml",
        r#"<mujoco><include file="a---.xml"><include file="b.xml"/></include></mujoco>"#,
    );
    let main = folder.path().join("main.xml");
    let source = crate::urdf::opened(&main.to_string_lossy()).unwrap();
    assert_eq!(Tree::parse(&source, None).unwrap().joints.len(), 1);
}

/// The G1 as its maker gives it, as a URDF and as two MJCFs.
#[test]
fn the_g1_is_the_same_robot_in_both_formats() {
    let folder = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../../shared/data/robots/g1/"
    );
    let open = |name: &str| Tree::parse(&crate::urdf::opened(&format!("{folder}{name}"))?, None);
    if !Path::new(folder).is_dir() {
        return eprintln!("not compared: there is no {folder}");
    }
    let urdf = open("g1_29dof_rev_1_0.urdf").unwrap();
    for name in ["g1_29dof_rev_1_0.xml", "g1_29dof_holosoma.xml"] {
        let mjcf = open(name).unwrap();
        println!("{name}: {:?} {:?}", differences(&urdf, &mjcf), mjcf.notes);
        // As far as the files round their figures: one base has 1 g more.
        let most = [1.001e-3, 1e-4, 1e-4, 1e-6, 2e-6, 1e-5];
        let found = differences(&urdf, &mjcf);
        assert!(
            found.iter().zip(most).all(|(found, most)| *found <= most),
            "{name}: {found:?}"
        );
    }
}
