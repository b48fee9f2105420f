//! Small versions of URDFs as they are published.

use super::*;
use nalgebra::Vector3;
use standfast_core::error::Error;
use standfast_core::robot::Shape;
use std::path::Path;

/// A body of 2 kg, without the elements that follow it.
const BODY: &str = r#"<link name="body"><inertial><mass value="2"/>
<inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>"#;

/// A link of 1 kg that contains `more`.
fn link(name: &str, more: &str) -> String {
    format!(
        r#"<link name="{name}"><inertial><mass value="1"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial>{more}</link>"#
    )
}

/// A joint from the body to a link, 0.1 m above it, about or along x.
fn joint(kind: &str, child: &str, more: &str) -> String {
    format!(
        r#"<joint name="to_{child}" type="{kind}"><origin xyz="0 0 0.1"/><parent link="body"/><child link="{child}"/>
<axis xyz="1 0 0"/>{more}</joint>"#
    )
}

const LIMIT: &str = r#"<limit lower="-1" upper="2" effort="30" velocity="4"/>"#;

fn parse_in(folder: &Path, parts: &[String]) -> Result<Tree> {
    let file = folder.join("mine.urdf").to_string_lossy().into_owned();
    let text = format!(
        "<robot name=\"mine\">\n{BODY}\n{}\n</robot>",
        parts.join("\n")
    );
    Tree::parse(&Source { file, text }, None)
}

fn parse(parts: &[String]) -> Result<Tree> {
    parse_in(Path::new("nowhere"), parts)
}

/// The tree with this link, called "arm", on a joint that moves.
fn with_arm(arm: String) -> Result<Tree> {
    parse(&[arm, joint("revolute", "arm", LIMIT)])
}

/// The sentence of the notes that has these words.
fn noted<'a>(tree: &'a Tree, words: &str) -> &'a str {
    let note = tree.notes.iter().find(|note| note.contains(words));
    note.unwrap_or_else(|| panic!("{words:?} is not in {:?}", tree.notes))
}

#[test]
fn joints_that_no_servo_drives_are_locked_and_told_in_one_note() {
    let finger =
        |name: &str, kind: &str, more: &str| [link(name, ""), joint(kind, name, more)].concat();
    let tree = parse(&[
        finger("lift", "prismatic", r#"<limit lower="0.2" upper="0.5"/>"#),
        finger("slide", "prismatic", ""),
        finger("free", "floating", ""),
        finger("flat", "planar", ""),
        finger(
            "thumb",
            "revolute",
            &format!("{LIMIT}<mimic joint=\"to_arm\" multiplier=\"2\" offset=\"0.5\"/>"),
        ),
        finger("stiff", "revolute", r#"<limit lower="0" upper="0"/>"#),
        finger("arm", "revolute", LIMIT),
        finger("wheel", "continuous", ""),
    ])
    .unwrap();
    assert_eq!(
        (tree.joints.len(), tree.links.len(), tree.links[0].mass_kg),
        (2, 3, 8.0)
    );
    // The others move, and keep what the URDF says of their motors.
    let ranges: Vec<_> = tree
        .joints
        .iter()
        .map(|joint| (joint.lower_rad, joint.upper_rad))
        .collect();
    assert_eq!(ranges, [(-1.0, 2.0), (f64::NEG_INFINITY, f64::INFINITY)]);
    let stated = Motor {
        effort_n_m: Some(30.0),
        velocity_rad_s: Some(4.0),
        ..Motor::default()
    };
    assert_eq!(tree.motors, [stated, Motor::default()]);
    let pose = |name: &str| {
        tree.frames
            .iter()
            .find(|frame| frame.name == name)
            .unwrap()
            .pose
    };
    assert!((pose("lift").translation.vector - Vector3::new(0.2, 0.0, 0.1)).norm() < 1e-12);
    for name in ["slide", "free", "flat", "stiff"] {
        assert!(
            (pose(name).translation.vector - Vector3::new(0.0, 0.0, 0.1)).norm() < 1e-12,
            "{name}"
        );
    }
    assert!((pose("thumb").rotation.scaled_axis() - Vector3::new(0.5, 0.0, 0.0)).norm() < 1e-12);
    assert_eq!(
        noted(&tree, "locked"),
        "Joints that no servo drives are locked at zero, their nearest limit or their offset: to_lift, to_slide \
         (prismatic); to_free (floating); to_flat (planar); to_thumb (mimic of another joint, which it does not follow); to_stiff (without a range)."
    );
    assert_eq!(tree.notes.len(), 1);
}

#[test]
fn joints_that_carry_nothing_with_mass_are_locked() {
    let tree = parse(&[
        r#"<link name="camera"/><link name="lens"/>"#.into(),
        joint("revolute", "camera", LIMIT),
        joint("continuous", "lens", "")
            .replace("<parent link=\"body\"/>", "<parent link=\"camera\"/>"),
        link("arm", ""),
        joint("revolute", "arm", LIMIT),
    ])
    .unwrap();
    assert_eq!((tree.links.len(), tree.frames[2].link), (2, 0));
    assert!(
        noted(&tree, "locked").contains("to_camera, to_lens (without mass)"),
        "{:?}",
        tree.notes
    );
    // A link without mass between others cannot be simulated.
    let between = [
        r#"<link name="cross"/>"#.into(),
        joint("revolute", "cross", LIMIT),
        link("arm", ""),
        joint("revolute", "arm", LIMIT)
            .replace("<parent link=\"body\"/>", "<parent link=\"cross\"/>"),
    ];
    let error = parse(&between).err().unwrap().to_string();
    assert!(
        error.contains("mine.urdf:4: link cross: mass = 0: a link that moves must have mass"),
        "{error}"
    );
}

#[test]
fn inertias_that_no_body_has_are_mended_with_a_note() {
    let tree = with_arm(link("arm", "").replace("ixx=\"0.01\"", "ixx=\"0.05\"")).unwrap();
    let moments = tree.links[1].inertia_kg_m2.diagonal();
    assert!(
        (moments - Vector3::new(0.05, 0.025, 0.025)).norm() < 1e-7
            && moments.y + moments.z > moments.x,
        "{moments}"
    );
    let expected = "were mended by raising their small principal moments [kg m^2]: arm (from 1.000e-2, 1.000e-2, \
                    5.000e-2 to 2.500e-2, 2.500e-2, 5.000e-2).";
    assert!(
        noted(&tree, "nertia").contains(expected),
        "{:?}",
        tree.notes
    );
    // Mass alone is enough.
    let tree = with_arm(r#"<link name="arm"><inertial><mass value="1"/></inertial></link>"#.into())
        .unwrap();
    assert!(
        tree.links[1].inertia_kg_m2.diagonal().min() > 1e-4
            && noted(&tree, "mended").contains("arm (from 0")
    );
    // A point mass on a link is as it should be.
    let without = r#"<link name="bolt"><inertial><mass value="1"/></inertial></link>"#.to_string();
    assert!(
        parse(&[without, joint("fixed", "bolt", "")])
            .unwrap()
            .notes
            .is_empty()
    );
}

#[test]
fn what_is_not_used_is_ignored() {
    let visual = |material: &str| {
        format!(
            r#"<visual><geometry><capsule radius="0.1" length="0.3"/></geometry>{material}</visual><visual/>"#
        )
    };
    let more = [
        visual(r#"<material name="skin"><texture/></material>"#),
        visual(
            r#"<material name="skin"><color rgba="0.1 0.2 0.3 1"/><texture filename="a.png"/></material>"#,
        ),
        visual(r#"<material name="skin"><color/></material>"#),
        visual(r#"<material><color rgba="1 0 0 1"/></material>"#),
        visual(""),
        "<contact><lateral_friction value=\"1\"/></contact>".into(),
    ];
    let extras = r#"<safety_controller k_velocity="10"/><calibration rising="x"/><dynamics/><hardwareInterface/>"#;
    let tree = parse(&[
        link("arm", &more.concat()),
        joint("revolute", "arm", &format!("{LIMIT}{extras}")),
        r#"<material name="blue"><color rgba="0 0 1 1"/></material><material name="blue"/>
           <transmission name="t"><type>x</type><joint name="to_arm"/></transmission>
           <gazebo reference="arm"><material>Gazebo/Grey</material><link/><joint/></gazebo><mujoco/><x:y xmlns:x="z"/>"#
            .into(),
    ])
    .unwrap();
    let colors: Vec<_> = tree.links[1]
        .visuals
        .iter()
        .map(|solid| solid.color[..3].to_vec())
        .collect();
    let (skin, grey) = (vec![0.1, 0.2, 0.3], vec![0.7; 3]);
    assert_eq!(
        colors,
        [skin.clone(), skin.clone(), skin, vec![1.0, 0.0, 0.0], grey]
    );
    assert_eq!(
        tree.links[1].visuals[0].shape,
        Shape::Capsule {
            radius: 0.1,
            length: 0.3
        }
    );
    assert!(tree.notes.is_empty(), "{:?}", tree.notes);
}

/// A box from (0, 0, 0) to (2, 1, 0.5) with a point on its upper face, as OBJ.
const BOX: &str = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 0 1 0\nv 0 0 .5\nv 2 0 .5\nv 2 1 .5\nv 0 1 .5\nv 1 .5 .5\n\
                   f 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\nf 5 6 9\nf 6 7 9\nf 7 8 9\nf 8 5 9\n";

#[test]
fn meshes_are_read_once_scaled_and_collide_as_their_hull() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("box.obj"), BOX).unwrap();
    let solid = |tag: &str, scale: &str| {
        format!(
            r#"<{tag}><origin xyz="0 0 1"/><geometry><mesh filename="box.obj"{scale}/></geometry></{tag}>"#
        )
    };
    let millimetres = r#" scale="0.001 -0.001 0.001""#;
    let more = [
        solid("visual", ""),
        solid("collision", ""),
        solid("collision", millimetres),
    ]
    .concat();
    let tree = parse_in(
        folder.path(),
        &[link("arm", &more), joint("revolute", "arm", LIMIT)],
    )
    .unwrap();
    assert!(tree.notes.is_empty(), "{:?}", tree.notes);
    let Link {
        visuals,
        collisions,
        ..
    } = &tree.links[1];
    let mesh = |solid: &Solid| match &solid.shape {
        Shape::Mesh(mesh) => mesh.clone(),
        other => panic!("{other:?}"),
    };
    assert!(std::sync::Arc::ptr_eq(
        &mesh(&visuals[0]),
        &mesh(&collisions[0])
    ));
    assert_eq!(
        (
            mesh(&visuals[0]).triangles.len(),
            mesh(&visuals[0]).points.len()
        ),
        (14, 9)
    );
    assert_eq!(mesh(&collisions[0]).hull.len(), 8, "the corners alone");
    let reach = |solid: &Solid, direction: Vector3<f64>| solid.reach_m(&direction);
    for (x, reached) in [
        (Vector3::x(), 2.0),
        (-Vector3::x(), 0.0),
        (-Vector3::z(), -1.0),
        (Vector3::z(), 1.5),
    ] {
        assert!((reach(&collisions[0], x) - reached).abs() < 1e-12, "{x}");
    }
    assert!((reach(&collisions[1], -Vector3::y()) - 0.001).abs() < 1e-12);
    assert!(collisions[0].points().all(|point| point.z >= 1.0));
}

/// A URDF in kg mm^2 or kg cm^2.
#[test]
fn an_inertia_larger_than_its_link_is_noted_and_one_larger_than_the_robot_refused() {
    let solid = r#"<collision><geometry><sphere radius="0.1"/></geometry></collision>"#;
    let tree =
        |moment: &str| with_arm(link("arm", solid).replace("=\"0.01\"", &format!("=\"{moment}\"")));
    assert!(tree("0.01").unwrap().notes.is_empty());
    let noted_as = noted(&tree("0.05").unwrap(), "radius of gyration").to_string();
    assert!(
        noted_as.contains("of arm (0.224 m, it reaches 0.100 m). Are they in kg m^2?"),
        "{noted_as}"
    );
    let error = tree("10000").err().unwrap().to_string();
    let expected = "link arm: inertia = 1.000e4: with 1.000 kg, its radius of gyration is 100.000 m, and the whole robot spans";
    assert!(
        error.contains(expected) && error.contains("accepted: up to"),
        "{error}"
    );
}

#[test]
fn meshes_that_are_not_there_are_told_in_one_note() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("pointer.stl"),
        "version https://git-lfs.github.com/spec/v1\n",
    )
    .unwrap();
    std::fs::write(folder.path().join("bad.stl"), "not a mesh").unwrap();
    let solid = |tag: &str, name: &str| {
        format!(r#"<{tag}><geometry><mesh filename="{name}"/></geometry></{tag}>"#)
    };
    let more = [
        solid("visual", "package://mine/a.stl"),
        solid("visual", "b.stl"),
        solid("collision", "b.stl"),
        solid("visual", "pointer.stl"),
        solid("visual", "bad.stl"),
    ];
    let tree = parse_in(
        folder.path(),
        &[link("arm", &more.concat()), joint("revolute", "arm", LIMIT)],
    )
    .unwrap();
    let absent = noted(&tree, "no such file");
    assert!(
        absent.starts_with("2 meshes (package://mine/a.stl, b.stl) are left out: no such file."),
        "{absent}"
    );
    assert!(
        absent.contains(&format!("searched in {}", folder.path().display())),
        "{absent}"
    );
    assert!(
        noted(&tree, "LFS")
            .starts_with("The mesh pointer.stl is left out: only a Git LFS pointer is there")
    );
    assert!(
        noted(&tree, "bad.stl").contains(
            "The mesh bad.stl is left out: it is not an STL file, or one that is cut off."
        )
    );
    assert_eq!((tree.notes.len(), tree.links[1].visuals.len()), (3, 0));
    assert_eq!(tree.missing, [(1, "b.stl (no such file)".to_string())]);
}

/// A list of problems ends after twenty.
#[test]
fn all_problems_of_a_file_are_told_at_once_in_the_order_of_its_lines() {
    let parts = [
        link("arm", "").replace("value=\"1\"", "value=\"heavy\""),
        joint("revolute", "arm", LIMIT).replace("1 0 0", "0 0 0"),
        link(
            "leg",
            "<collision><geometry><box size=\"1 -1 1\"/></geometry></collision>",
        ),
        joint("spherical", "leg", "").replace("to_leg", "hip"),
        joint("revolute", "toe", LIMIT),
        link("arm", ""),
    ];
    let error = parse(&parts).err().unwrap();
    let Error::Several(problems) = &error else {
        panic!("{error}")
    };
    let expected = [
        "link arm: mass value",
        "joint to_arm: axis",
        "link leg: collision",
        "joint hip: type",
        "joint to_toe: child",
        "link = arm",
    ];
    assert_eq!(problems.len(), expected.len(), "{error}");
    for (problem, expected) in problems.iter().zip(expected) {
        assert!(
            problem.to_string().contains(expected),
            "{expected}: {problem}"
        );
    }
    assert!(error.to_string().starts_with("6 problems\n  "), "{error}");
    assert_eq!(error.exit_code(), 2);
    let link = |i: u32| link(&format!("l{i}"), "").replace("value=\"1\"", "value=\"x\"");
    let error = parse(&(0..23).map(link).collect::<Vec<_>>())
        .err()
        .unwrap()
        .to_string();
    assert_eq!(
        (error.lines().count(), error.lines().last()),
        (22, Some("  and 4 more")),
        "{error}"
    );
}

#[test]
fn sizes_are_limited_before_parsing() {
    let many: Vec<String> = (0..500).map(|i| format!("<link name=\"l{i}\"/>")).collect();
    let error = parse(&many).err().unwrap().to_string();
    assert!(
        error.contains("link = 501: there are too many links; accepted: up to 500 links"),
        "{error}"
    );
    let deep = "<a>".repeat(100_000);
    let error = parse(&[deep]).err().unwrap().to_string();
    assert!(
        error.contains("elements are nested more than 64 deep"),
        "{error}"
    );
}
