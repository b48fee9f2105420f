//! Which links of a robot collide with each other: those of one leg with those of the other, and those of an arm with the
//! trunk, the legs and the other arms.
//!
//! Every other pair passes through each other: links of one limb, and a leg and the trunk, which the limits of the joints
//! keep apart; a link and the one that carries it; and a pair that touches in the home posture already, so that home
//! remains a posture without inner forces. The force sensors of the soles do not feel contacts of links.

use super::rapier::shape::gap_m;
use crate::robot::{Foot, Kinematics, PerFoot, Robot};
use nalgebra::Isometry3;

/// Friction coefficient between links, plastic on plastic; assumed. (It is a power of two, so that a factor for the
/// friction with the ground can undo it exactly.)
pub const FRICTION: f64 = 0.25;
/// A pair whose gap at home is smaller touches at home (m).
const TOUCHING_M: f64 = 0.001;

/// Two links that met in the past tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meeting {
    /// Indices into `Robot::links`.
    pub links: [usize; 2],
    /// Whether they are of the two legs.
    pub of_legs: bool,
    /// Norm of the mean force between them over one physics step (N).
    pub force_n: f64,
}

/// The pairs of links that collide.
#[derive(Debug, Clone)]
pub struct Pairs {
    /// Whether two links collide, by their indices into `Robot::links`. It is symmetric.
    collide: Vec<Vec<bool>>,
    limbs: Vec<Limb>,
    /// Pairs that do not collide only because they touch in the home posture.
    pub touching_at_home: Vec<[usize; 2]>,
}

impl Pairs {
    pub fn new(robot: &Robot) -> Self {
        let mut kinematics = Kinematics::new(robot);
        kinematics.update(robot, &robot.home_posture());
        let limbs = limbs(robot);
        let count = robot.links.len();
        let mut collide = vec![vec![false; count]; count];
        let mut touching_at_home = Vec::new();
        for b in 0..count {
            let carrier = b.checked_sub(1).map(|joint| robot.joints[joint].parent);
            for a in (0..b).filter(|&a| carrier != Some(a) && can_meet(limbs[a], limbs[b])) {
                if touch(robot, &kinematics, [a, b]) {
                    touching_at_home.push([a, b]);
                } else {
                    collide[a][b] = true;
                    collide[b][a] = true;
                }
            }
        }
        Self { collide, limbs, touching_at_home }
    }

    /// Whether two links collide with each other.
    pub fn collide(&self, a: usize, b: usize) -> bool {
        self.collide[a][b]
    }

    /// Whether two links are of different legs.
    pub fn are_legs(&self, links: [usize; 2]) -> bool {
        matches!(links.map(|link| self.limbs[link]), [Limb::Leg(a), Limb::Leg(b)] if a != b)
    }

    /// The number of pairs that collide.
    pub fn count(&self) -> usize {
        self.collide.iter().flatten().filter(|collides| **collides).count() / 2
    }
}

/// A part of the robot between which collisions are looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Limb {
    /// The links that carry both legs, or the trunk.
    Trunk,
    Leg(Foot),
    /// Whatever else branches off the trunk, by its first link.
    Arm(usize),
}

fn can_meet(a: Limb, b: Limb) -> bool {
    a != b && !matches!((a, b), (Limb::Trunk, Limb::Leg(_)) | (Limb::Leg(_), Limb::Trunk))
}

/// The limb of each link.
fn limbs(robot: &Robot) -> Vec<Limb> {
    let carriers = |link: usize| {
        let carried = robot.chain(link).map(|joint| robot.joints[joint].parent);
        std::iter::once(link).chain(carried).collect::<Vec<_>>()
    };
    let legs = PerFoot::from_fn(|foot| carriers(robot.soles[foot].link));
    let trunk = carriers(robot.trunk);
    let mut limbs = Vec::with_capacity(robot.links.len());
    for link in 0..robot.links.len() {
        let [left, right] = Foot::BOTH.map(|foot| legs[foot].contains(&link));
        let limb = match link.checked_sub(1).map(|joint| limbs[robot.joints[joint].parent]) {
            _ if (left && right) || trunk.contains(&link) => Limb::Trunk,
            Some(Limb::Trunk) | None if left => Limb::Leg(Foot::Left),
            Some(Limb::Trunk) | None if right => Limb::Leg(Foot::Right),
            Some(Limb::Trunk) | None => Limb::Arm(link),
            Some(limb) => limb,
        };
        limbs.push(limb);
    }
    limbs
}

/// Whether two links touch where `kinematics` has them.
fn touch(robot: &Robot, kinematics: &Kinematics, links: [usize; 2]) -> bool {
    let solids = links.map(|link| {
        let place = move |pose: &Isometry3<f64>| *kinematics.link_pose(link) * pose;
        robot.links[link].collisions.iter().map(move |solid| (solid.shape, place(&solid.pose)))
    });
    let [first, second] = solids;
    first.clone().any(|a| second.clone().any(|b| gap_m(a, b) < TOUCHING_M))
}
