//! Finds the links of feet, legs, trunk and arms.

use standfast_core::robot::{Foot, Kinematics, PerFoot, Robot};

/// Least number of joints of a leg that are not shared with the other leg.
const LEAST_JOINTS: usize = 4;
/// Least distance of an arm's COM from the middle of the body, as a share of the distance of the feet from there.
const ASIDE: f64 = 0.5;

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
    /// Finds the limbs at zero joint angles. It is None unless there are two end links that are carried by chains of at
    /// least four joints of their own.
    pub fn of(robot: &Robot) -> Option<Self> {
        let legs = legs(robot)?;
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
        let trunk = trunk(robot, &of_leg, &|j| !of_leg(j + 1) && is_aside(j))?;
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
        Some(Self {
            legs,
            waist,
            arms,
            trunk,
        })
    }

    /// The links that the joints of a limb carry.
    pub fn links(joints: &[usize]) -> impl Iterator<Item = usize> + '_ {
        joints.iter().map(|j| j + 1)
    }
}

/// Finds [`Limbs::trunk`]. `of_leg` tells which links belong to a leg, and `of_arm` which joints may belong to an arm.
fn trunk(
    robot: &Robot,
    of_leg: &dyn Fn(usize) -> bool,
    of_arm: &dyn Fn(usize) -> bool,
) -> Option<usize> {
    let mass_kg = |link: usize| robot.links[link].mass_kg;
    let others = (0..robot.links.len()).filter(|&link| !of_leg(link));
    let heaviest_kg = others.clone().map(mass_kg).fold(0.0, f64::max);
    let rank = |link: usize| {
        let has_imu = robot
            .frames
            .iter()
            .any(|frame| frame.link == link && frame.name.to_lowercase().contains("imu"));
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
}

/// The two chains with the lowest ends at zero joint angles.
fn legs(robot: &Robot) -> Option<PerFoot<Vec<usize>>> {
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
    for (i, (a_height, a)) in ends.iter().enumerate() {
        for (b_height, b) in &ends[..i] {
            let (a_own, b_own) = (own(a, b), own(b, a));
            let height = a_height + b_height;
            if a_own.len().min(b_own.len()) >= LEAST_JOINTS
                && best.as_ref().is_none_or(|best| height < best.0)
            {
                best = Some((height, [a_own, b_own]));
            }
        }
    }
    let (_, [a, b]) = best?;
    let y = |leg: &[usize]| leg.last().map_or(0.0, |&j| kinematics.link_com(j + 1).y);
    Some(if y(&a) > y(&b) {
        PerFoot { left: a, right: b }
    } else {
        PerFoot { left: b, right: a }
    })
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
