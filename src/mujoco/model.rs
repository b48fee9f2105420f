//! The robot and its ground as a MuJoCo model, written as MJCF. Links, rotors, joint stops, friction of ground and joints,
//! and colliding shapes are those of [`Robot`]. [`Pairs`] states which links collide with each other. The model has no servos; the
//! plant drives the joints.

use nalgebra::{Isometry3, UnitQuaternion};
use quick_xml::escape::escape;
use standfast_core::robot::shape::Meshes;
use standfast_core::robot::{Joint, Link, Robot, Shape, Solid};
use standfast_sim::Ground;
use standfast_sim::meeting::{self, Pairs};
use std::fmt::Write;

/// Name of the body that carries the ground.
pub const GROUND: &str = "ground";

/// Time constant (s) and damping ratio of contacts and joint stops. (With five times this time constant, `switching` loses
/// ten more pushes in a hundred.) A step of up to half the time constant is stable.
const SOLREF: &str = "0.0072 1";

/// Impedance of a contact at no penetration, its impedance from some penetration on, and that penetration (m). Half the
/// weight presses a sole 0.1 mm into the ground, and 0.07 mm in Rapier. With 0.9 at no penetration, MuJoCo's own setting,
/// it is 0.02 mm; but then a sole that slides chatters, and hardly slides at all with steps of 2 ms.
const SOLIMP: &str = "0.3 0.95 0.0006";

/// Impedance of dry friction. A joint at rest under nine tenths of its friction creeps by 0.02 mrad/s in UT-mu2's elbow; with
/// MuJoCo's own settings it is 48 mrad/s.
const FRICTION_SOLIMP: &str = "0.9999 0.9999 0.001";

/// Gap (m) below which two shapes touch. With a gap of 0, soles that are set down on the ground touch it from the second
/// step on.
const MARGIN_M: f64 = 1e-9;

/// Name of the body of a link. Its prefix distinguishes it from `world` and `ground`, which may also be names of links.
pub fn body_name(link: &Link) -> String {
    format!("link {}", link.name)
}

pub fn mjcf(robot: &Robot, ground: &Ground, pairs: &Pairs, step_s: f64) -> String {
    let mut xml = format!(
        r#"<mujoco><compiler angle="radian" autolimits="false" inertiafromgeom="false"/>
<option timestep="{step_s}" gravity="0 0 {}" integrator="Euler" cone="elliptic" impratio="10"/>
<default><geom condim="3" friction="{} 0 0" solref="{SOLREF}" solimp="{SOLIMP}" margin="{MARGIN_M}"/><joint solreflimit="{SOLREF}" solreffriction="{} 1" solimpfriction="{FRICTION_SOLIMP}"/></default>
<worldbody><body name="{GROUND}" mocap="{}">"#,
        -standfast_core::robot::GRAVITY,
        meeting::FRICTION,
        2.0 * step_s,
        !ground.is_level(),
    );
    // The friction of the solid with the higher priority counts.
    let friction = format!(r#"friction="{} 0 0" priority="1""#, robot.friction);
    _ = write!(
        xml,
        r#"<geom type="plane" size="0 0 1" {friction} {}/>"#,
        pose(&ground.half_space())
    );
    for (center, half) in ground.boxes() {
        let size = format!("{} {} {}", half.x, half.y, half.z);
        _ = write!(
            xml,
            r#"<geom type="box" size="{size}" {friction} {}/>"#,
            pose(&center)
        );
    }
    xml.push_str("</body>");
    let meshes = Meshes::of(
        robot
            .links
            .iter()
            .flat_map(|link| &link.collisions)
            .map(|solid| &solid.shape),
    );
    body(&mut xml, robot, &meshes, 0);
    xml.push_str("</worldbody>");
    assets(&mut xml, &meshes);
    xml.push_str("<contact>");
    let names: Vec<String> = robot
        .links
        .iter()
        .map(|link| escape(body_name(link)).into_owned())
        .collect();
    for (b, second) in names.iter().enumerate() {
        for (_, first) in names[..b]
            .iter()
            .enumerate()
            .filter(|(a, _)| !pairs.collide(*a, b))
        {
            _ = write!(xml, r#"<exclude body1="{first}" body2="{second}"/>"#);
        }
    }
    xml.push_str("</contact></mujoco>");
    xml
}

/// Adds the hulls of the colliding meshes.
fn assets(xml: &mut String, meshes: &Meshes) {
    xml.push_str("<asset>");
    for (number, mesh) in meshes.0.iter().enumerate() {
        _ = write!(xml, r#"<mesh name="{number}" inertia="convex" vertex=""#);
        for p in &mesh.hull {
            _ = write!(xml, "{} {} {} ", p.x, p.y, p.z);
        }
        xml.push_str("\"/>");
    }
    xml.push_str("</asset>");
}

/// Adds a link with all links that it carries.
fn body(xml: &mut String, robot: &Robot, meshes: &Meshes, index: usize) {
    let link = &robot.links[index];
    let origin = if index == 0 {
        Isometry3::identity()
    } else {
        robot.joints[index - 1].origin
    };
    _ = write!(
        xml,
        r#"<body name="{}" {}>"#,
        escape(body_name(link)),
        pose(&origin)
    );
    match index
        .checked_sub(1)
        .map(|joint| (&robot.joints[joint], &robot.servos[joint]))
    {
        None => xml.push_str("<freejoint/>"),
        Some((joint, servo)) => {
            let axis = joint.axis;
            _ = write!(
                xml,
                r#"<joint name="{}" axis="{} {} {}" {} armature="{}" frictionloss="{}"/>"#,
                escape(&joint.name),
                axis.x,
                axis.y,
                axis.z,
                range(joint),
                servo.rotor_inertia_kg_m2,
                servo.friction_n_m,
            );
        }
    }
    inertial(xml, link);
    for solid in &link.collisions {
        geom(xml, solid, meshes);
    }
    for (joint, Joint { parent, .. }) in robot.joints.iter().enumerate() {
        if *parent == index {
            body(xml, robot, meshes, joint + 1);
        }
    }
    xml.push_str("</body>");
}

fn range(joint: &Joint) -> String {
    let Joint {
        lower_rad,
        upper_rad,
        ..
    } = joint;
    match lower_rad.is_finite() && upper_rad.is_finite() {
        true => format!(r#"limited="true" range="{lower_rad} {upper_rad}""#),
        false => r#"limited="false""#.into(),
    }
}

fn inertial(xml: &mut String, link: &Link) {
    let (com, i) = (link.com_m, link.inertia_kg_m2);
    _ = write!(
        xml,
        r#"<inertial pos="{} {} {}" mass="{}" fullinertia="{} {} {} {} {} {}"/>"#,
        com.x, com.y, com.z, link.mass_kg, i.m11, i.m22, i.m33, i.m12, i.m13, i.m23,
    );
}

fn geom(xml: &mut String, solid: &Solid, meshes: &Meshes) {
    let place = pose(&solid.pose);
    let (kind, size) = match &solid.shape {
        Shape::Box { half } => ("box", format!("{} {} {}", half.x, half.y, half.z)),
        Shape::Sphere { radius } => ("sphere", radius.to_string()),
        Shape::Cylinder { radius, length } => ("cylinder", format!("{radius} {}", 0.5 * length)),
        Shape::Capsule { radius, length } => ("capsule", format!("{radius} {}", 0.5 * length)),
        Shape::Mesh(mesh) => {
            let number = meshes
                .number(mesh)
                .expect("all meshes that collide are listed");
            _ = write!(xml, r#"<geom type="mesh" mesh="{number}" {place}/>"#);
            return;
        }
    };
    _ = write!(xml, r#"<geom type="{kind}" size="{size}" {place}/>"#);
}

fn pose(pose: &Isometry3<f64>) -> String {
    let (p, [w, x, y, z]) = (pose.translation.vector, quaternion(&pose.rotation));
    format!(r#"pos="{} {} {}" quat="{w} {x} {y} {z}""#, p.x, p.y, p.z)
}

/// A rotation in MuJoCo's order: w, x, y, z.
pub fn quaternion(rotation: &UnitQuaternion<f64>) -> [f64; 4] {
    [rotation.w, rotation.i, rotation.j, rotation.k]
}
