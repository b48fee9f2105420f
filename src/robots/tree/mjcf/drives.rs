//! What an MJCF says beside its tree of bodies: actuators, constraints between joints and bodies, and keyframes.

use super::elements::{Body, Mjcf, joint_kind};
use crate::tree::xml::Posture;
use std::collections::HashMap;

/// Number of names that a note lists.
const MOST_NAMED: usize = 12;

/// A list of names that is not too long.
pub fn listed(names: &[String]) -> String {
    let more = if names.len() > MOST_NAMED {
        ", ..."
    } else {
        ""
    };
    names[..names.len().min(MOST_NAMED)].join(", ") + more
}

/// The largest torque of each joint that an actuator drives (N m), by the name of the joint. Actuators of other things
/// are noted.
pub fn torques_n_m<'a>(mjcf: &Mjcf<'a, '_>) -> HashMap<&'a str, f64> {
    let (mut torques, mut others) = (HashMap::new(), Vec::new());
    for element in mjcf.section("actuator") {
        mjcf.check_class(element);
        let joint = ["joint", "jointinparent"].map(|name| mjcf.text(element, name));
        let Some(joint) = joint.into_iter().flatten().next() else {
            others.push(mjcf.named(element.node));
            continue;
        };
        let gear = mjcf.number(element, "gear").unwrap_or(1.0).abs();
        let is = |name, usual| mjcf.text(element, name).is_none_or(|value| value == usual);
        // Where the control is a force, its range limits the force.
        let gain = match element.node.tag_name().name() {
            "motor" => Some(1.0),
            "general"
                if is("gaintype", "fixed") && is("biastype", "none") && is("dyntype", "none") =>
            {
                Some(mjcf.number(element, "gainprm").unwrap_or(1.0))
            }
            _ => None,
        };
        let most = |range: [f64; 2]| range[0].abs().max(range[1].abs());
        let of_force = mjcf.range(element, "forcelimited", "forcerange").map(most);
        let of_control = gain.and_then(|gain| {
            let range = mjcf.range(element, "ctrllimited", "ctrlrange")?;
            Some(gain.abs() * most(range))
        });
        let force = of_force.into_iter().chain(of_control).reduce(f64::min);
        if let Some(force) = force {
            let torque = torques.entry(joint).or_insert(0.0);
            *torque = f64::max(*torque, gear * force);
        }
    }
    if !others.is_empty() {
        mjcf.note(format!(
            "Actuators that drive no single joint are left out: {}.",
            listed(&others)
        ));
    }
    torques
}

/// A joint that follows another one, and where it is if that one is at zero (rad).
pub struct Coupled<'a> {
    pub follows: &'a str,
    pub offset_rad: f64,
}

/// The joints that an equality couples to another one. Where a motor's joint drives another one by gears, that which carries
/// more bodies moves, with the torque that the gears give it; the other one is coupled. Equalities that close a loop of the robot are problems, and what is left out is noted. `carried` tells how many bodies a joint of the
/// robot carries, by its name, and `is_body` whether a name is one of its bodies.
pub fn coupled<'a>(
    mjcf: &Mjcf<'a, '_>,
    carried: &HashMap<&'a str, usize>,
    is_body: impl Fn(&str) -> bool,
    torques_n_m: &mut HashMap<&'a str, f64>,
) -> HashMap<&'a str, Coupled<'a>> {
    let (mut coupled, mut left_out) = (HashMap::new(), Vec::new());
    for element in mjcf.section("equality") {
        mjcf.check_class(element);
        if mjcf.text(element, "active") == Some("false") {
            continue;
        }
        let value = |name| element.node.attribute(name);
        let tag = element.node.tag_name().name();
        let [first, second] = match tag {
            "joint" => ["joint1", "joint2"],
            "tendon" => ["tendon1", "tendon2"],
            _ if value("site1").is_some() => ["site1", "site2"],
            _ => ["body1", "body2"],
        }
        .map(value);
        let shown = format!(
            "{} and {}",
            first.unwrap_or("?"),
            second.unwrap_or("the world")
        );
        let named = || format!("{} ({shown})", mjcf.named(element.node));
        match (tag, first.unwrap_or_default()) {
            ("joint", joint) if carried.contains_key(joint) => {
                let coefficients = mjcf.list(element, "polycoef", 1).unwrap_or(vec![0.0, 1.0]);
                let other = second.filter(|other| carried.contains_key(other));
                let (joint, follows, offset_rad) = match other {
                    Some(drive) if carried[drive] < carried[joint] => {
                        // Gears with this ratio.
                        let ratio = coefficients.get(1).map_or(0.0, |ratio| ratio.abs());
                        let torque = torques_n_m.get(drive).copied();
                        if let Some(torque) = torque.filter(|_| ratio > 0.0) {
                            torques_n_m.entry(joint).or_insert(torque / ratio);
                        }
                        (drive, joint, 0.0)
                    }
                    other => (joint, other.unwrap_or("nothing"), coefficients[0]),
                };
                coupled.insert(
                    joint,
                    Coupled {
                        follows,
                        offset_rad,
                    },
                );
            }
            ("connect" | "weld", one) if second.is_some() => {
                let both = [Some(one), second].map(|name| name.is_some_and(&is_body));
                if both == [true, true] || value("site1").is_some() {
                    let (problem, accepted) = (
                        "closes a loop of bodies, which are simulated as a tree",
                        "a model with serial joints, or active=\"false\"",
                    );
                    mjcf.bad(
                        element.node,
                        mjcf.named(element.node),
                        shown,
                        problem,
                        accepted,
                    );
                } else if both != [false, false] {
                    left_out.push(named());
                }
            }
            ("joint", _) => {}
            _ => left_out.push(named()),
        }
    }
    let tendons = mjcf.section("tendon").map(|tendon| {
        let along = tendon
            .node
            .children()
            .filter_map(|node| node.attribute("joint"));
        match tendon.node.attribute("name") {
            Some(_) => mjcf.named(tendon.node),
            None => format!("that of {}", along.collect::<Vec<_>>().join(" and ")),
        }
    });
    for (what, names) in [("Equalities", left_out), ("Tendons", tendons.collect())] {
        if !names.is_empty() {
            mjcf.note(format!("{what} are left out: {}.", listed(&names)));
        }
    }
    coupled
}

/// The postures of the keyframes, by the names of the hinges. Keyframes of another length than the joints of all
/// bodies have together are noted.
pub fn postures<'a>(mjcf: &Mjcf<'a, '_>, bodies: &[Body<'a>]) -> Vec<Posture> {
    // Where each hinge is among the numbers of a keyframe, which has the joints in the order of the file.
    let (mut places, mut length) = (Vec::new(), 0);
    for body in bodies {
        for (k, (joint, _)) in body.joints().enumerate() {
            length += match joint_kind(mjcf, joint) {
                "free" => 7,
                "ball" => 4,
                kind => {
                    if kind == "hinge" {
                        places.push((body.joint_name(k), length));
                    }
                    1
                }
            };
        }
    }
    let (mut postures, mut others) = (Vec::new(), Vec::new());
    for element in mjcf.section("keyframe") {
        let name = element
            .node
            .attribute("name")
            .unwrap_or_default()
            .to_string();
        let angles = mjcf.list(element, "qpos", 1).unwrap_or_default();
        if angles.len() == length {
            let by_joint = places
                .iter()
                .map(|(joint, at)| (joint.clone(), angles[*at]));
            postures.push(Posture {
                name,
                by_joint: by_joint.collect(),
            });
        } else if !angles.is_empty() {
            others.push(format!("{name} ({} numbers)", angles.len()));
        }
    }
    if !others.is_empty() {
        mjcf.note(format!(
            "Keyframes are left out, since their qpos does not have {length} numbers, as the joints do: {}.",
            listed(&others)
        ));
    }
    postures
}
