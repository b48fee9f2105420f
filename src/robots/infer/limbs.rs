//! Finds the links of feet, legs, trunk and arms, and the direction in which the robot looks.

use super::soles;
use crate::facing::Forward;
use nalgebra::{Point3, Vector3};
use standfast_core::robot::model::Frame;
use standfast_core::robot::{Foot, Kinematics, PerFoot, Robot};

/// Least number of joints of a leg that are not shared with the other leg.
const LEAST_JOINTS: usize = 4;
/// Least distance of an arm's COM from the middle of the body, as a share of the distance of the feet from there.
const ASIDE: f64 = 0.5;

/// How far the first joints of legs may lie above the COM of the base, in lengths of the legs.
const ABOVE: f64 = 0.5;
/// How far the middle of a sole lies before the ankle, in halves of its length, for the toes to tell forward.
const AHEAD: f64 = 0.1;

/// Share of the heaviest link's mass from which on a link counts as nearly as heavy.
const NEARLY: f64 = 0.6;

/// The limbs of a robot by the indices of their joints. Joint `j` carries link `j + 1`.
#[derive(Debug, Clone)]
pub struct Limbs {
    /// From hip to foot, without the joints that both legs share.
    pub legs: PerFoot<Vec<usize>>,
    /// From the base to the trunk.
    pub waist: Vec<usize>,
    /// The arms, each a group of connected joints, its first joint nearest to the trunk. A neck is no arm, and neither
    /// is a group that both arms share: their COMs are in the middle of the body.
    pub arms: Vec<Vec<usize>>,
    /// Index of the heaviest link that belongs to no leg. Among links that are nearly as heavy, it is the one with an
    /// IMU or, if that does not decide, the one that carries the arms.
    pub trunk: usize,
}

impl Limbs {
    /// Finds the limbs of a robot with these [`legs`], at zero joint angles.
    pub fn of(robot: &Robot, legs: PerFoot<Vec<usize>>) -> Self {
        let of_leg = |link: usize| {
            link > 0
                && Foot::BOTH
                    .iter()
                    .any(|&foot| legs[foot].contains(&(link - 1)))
        };
        let kinematics = Kinematics::new(robot);
        let feet_m = Foot::BOTH.map(|foot| {
            legs[foot]
                .last()
                .map_or(0.0, |&j| kinematics.joint_position(j).y)
        });
        let (middle_m, apart_m) = (
            (feet_m[0] + feet_m[1]) / 2.0,
            (feet_m[0] - feet_m[1]).abs() / 2.0,
        );
        let is_aside =
            |j: usize| (kinematics.subtree(j + 1).1.y - middle_m).abs() > ASIDE * apart_m;
        let trunk = trunk(robot, &of_leg, &|j| !of_leg(j + 1) && is_aside(j));
        let mut waist: Vec<usize> = robot.chain(trunk).collect();
        waist.reverse();
        let mut arms: Vec<Vec<usize>> = Vec::new();
        for (j, joint) in robot.joints.iter().enumerate() {
            if of_leg(j + 1) || waist.contains(&j) {
                continue;
            }
            let carried_by = joint.parent.checked_sub(1);
            match carried_by.and_then(|carrier| arms.iter_mut().find(|arm| arm.contains(&carrier)))
            {
                Some(arm) => arm.push(j),
                None if is_aside(j) => arms.push(vec![j]),
                None => {}
            }
        }
        Self {
            legs,
            waist,
            arms,
            trunk,
        }
    }

    /// The links that the joints of a limb carry.
    pub fn links(joints: &[usize]) -> impl Iterator<Item = usize> + '_ {
        joints.iter().map(|j| j + 1)
    }
}

/// Finds [`Limbs::trunk`]. `of_leg` tells which links belong to a leg, and `of_arm` which joints may belong to an arm.
fn trunk(robot: &Robot, of_leg: &dyn Fn(usize) -> bool, of_arm: &dyn Fn(usize) -> bool) -> usize {
    let mass_kg = |link: usize| robot.links[link].mass_kg;
    let others = (0..robot.links.len()).filter(|&link| !of_leg(link));
    let heaviest_kg = others.clone().map(mass_kg).fold(0.0, f64::max);
    let rank = |link: usize| {
        let has_imu = robot
            .frames
            .iter()
            .any(|frame| frame.link == link && Frame::names_imu(&frame.name));
        let arms = (0..robot.joints.len())
            .filter(|&j| robot.joints[j].parent == link && of_arm(j))
            .count();
        (has_imu, arms > 1)
    };
    // Of equal links, the first one is taken.
    others
        .filter(|&link| mass_kg(link) >= NEARLY * heaviest_kg)
        .rev()
        .max_by(|&a, &b| {
            rank(a)
                .cmp(&rank(b))
                .then(mass_kg(a).total_cmp(&mass_kg(b)))
        })
        // The base belongs to no leg.
        .unwrap_or(0)
}

/// The two chains with the lowest ends at zero joint angles, each with at least [`LEAST_JOINTS`] joints of its own; the one at
/// the side of y is the left one. If there are none, or if they hang from shoulders, the problem is told in words.
pub fn legs(robot: &Robot) -> Result<PerFoot<Vec<usize>>, String> {
    let kinematics = Kinematics::new(robot);
    let mut ends: Vec<(f64, Vec<usize>)> = Vec::new();
    for link in 1..robot.links.len() {
        if robot.joints.iter().all(|joint| joint.parent != link) {
            let mut chain: Vec<usize> = robot.chain(link).collect();
            chain.reverse();
            ends.push((lowest_m(robot, &kinematics, link), chain));
        }
    }
    let own = |a: &[usize], b: &[usize]| -> Vec<usize> {
        a.iter().copied().filter(|j| !b.contains(j)).collect()
    };
    let mut best: Option<(f64, [Vec<usize>; 2])> = None;
    let mut longest = 0;
    for (i, (a_height, a)) in ends.iter().enumerate() {
        for (b_height, b) in &ends[..i] {
            let (a_own, b_own) = (own(a, b), own(b, a));
            let (height, joints) = (a_height + b_height, a_own.len().min(b_own.len()));
            longest = longest.max(joints);
            if joints >= LEAST_JOINTS && best.as_ref().is_none_or(|best| height < best.0) {
                best = Some((height, [a_own, b_own]));
            }
        }
    }
    let Some((_, [a, b])) = best else {
        return Err(format!(
            "there are no two legs, chains of at least {LEAST_JOINTS} joints that end in a foot each; the longest two chains have \
             {longest} joints of their own"
        ));
    };
    // Hips are at the base or below it, shoulders far above it.
    let middle_m = |of: &dyn Fn(&[usize]) -> f64| 0.5 * (of(&a) + of(&b));
    let first_m = middle_m(&|leg| kinematics.joint_position(leg[0]).z);
    let last_m = middle_m(&|leg| kinematics.link_com(leg[leg.len() - 1] + 1).z);
    if first_m - kinematics.link_com(0).z > ABOVE * (first_m - last_m) {
        let end = |leg: &[usize]| &*robot.links[leg[leg.len() - 1] + 1].name;
        return Err(format!(
            "there are no legs: the two chains of at least {LEAST_JOINTS} joints with the lowest ends, which end in {} and {}, hang \
             from above the base, as arms do",
            end(&a),
            end(&b)
        ));
    }
    let y = |leg: &[usize]| leg.last().map_or(0.0, |&j| kinematics.link_com(j + 1).y);
    Ok(if y(&a) > y(&b) {
        PerFoot { left: a, right: b }
    } else {
        PerFoot { left: b, right: a }
    })
}

/// The direction in which a robot looks, and a warning.
pub struct Facing {
    pub forward: Forward,
    /// Why it is not x, in words.
    pub why: &'static str,
    pub warning: Option<String>,
}

/// The direction from the ankles to the toes at zero joint angles or, if the feet are as long behind their ankles, the one that
/// has the legs at the sides that their names say.
pub fn facing(robot: &Robot, legs: &PerFoot<Vec<usize>>) -> Facing {
    let kinematics = Kinematics::new(robot);
    let ankles =
        PerFoot::from_fn(|foot| kinematics.joint_position(legs[foot][legs[foot].len() - 1]));
    let apart = ankles.left - ankles.right;
    let along = match apart.x.abs() > apart.y.abs() {
        true => Forward::Y,
        false => Forward::X,
    };
    let axis = along.axis();
    // How far the middles of the soles lie before the ankles, in halves of their lengths.
    let at_zero = vec![0.0; robot.joints.len()];
    let toes: f64 = Foot::BOTH
        .into_iter()
        .filter_map(|foot| {
            let link = legs[foot].last().map_or(0, |j| j + 1);
            let sole = soles::find(robot, link, &at_zero, &axis).ok()?.sole;
            let ankle = sole.center.inverse() * Point3::origin();
            Some(-ankle.x / sole.half_m[0])
        })
        .sum();
    // Positive if the leg that is named left is at the left of a robot that looks along the axis.
    let left = Vector3::z().cross(&axis);
    let named: f64 = Foot::BOTH
        .into_iter()
        .filter_map(|foot| {
            let at = (ankles[foot] - ankles[foot.other()]).dot(&left).signum();
            Some(at * side_of(robot, &legs[foot])?)
        })
        .sum();
    let signed = |sign: f64| if sign < 0.0 { along.back() } else { along };
    let (forward, why) = match (toes.abs() > 2.0 * AHEAD, named != 0.0) {
        (true, _) => (signed(toes), "from the ankles to the toes"),
        (false, true) => (signed(named), "by the sides of the legs' names"),
        (false, false) => (along, "the feet are apart across it"),
    };
    let warning = (named != 0.0 && signed(named) != forward).then(|| {
        format!(
            "the toes point along {} of the base, but the names of the legs (left, right) would have it look the other way",
            forward.name()
        )
    });
    Facing {
        forward,
        why,
        warning,
    }
}

/// 1 if most names of a leg's joints and links say left, -1 if they say right; None if they say neither.
fn side_of(robot: &Robot, leg: &[usize]) -> Option<f64> {
    let names = leg
        .iter()
        .flat_map(|&j| [&robot.joints[j].name, &robot.links[j + 1].name]);
    let votes: i32 = names
        .map(|name| {
            let name = name.to_lowercase();
            let is = |word: &str, letter: &str| {
                let mut parts = name.split(|c: char| !c.is_alphanumeric());
                name.contains(word) || parts.any(|part| part == letter)
            };
            i32::from(is("left", "l")) - i32::from(is("right", "r"))
        })
        .sum();
    (votes != 0).then(|| f64::from(votes.signum()))
}

/// Height of the lowest point of a link's collision geometry or, if it has none, of its frame.
fn lowest_m(robot: &Robot, kinematics: &Kinematics, link: usize) -> f64 {
    let pose = kinematics.link_pose(link);
    let down = -pose
        .rotation
        .inverse_transform_vector(&nalgebra::Vector3::z());
    let reach = robot.links[link]
        .collisions
        .iter()
        .map(|solid| solid.reach_m(&down))
        .fold(0.0, f64::max);
    pose.translation.z - reach
}
