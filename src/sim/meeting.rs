//! Which links of a robot collide with each other: links of one leg with links of the other, and links of an arm with
//! the trunk, the legs and the other arms.
//!
//! All other pairs of links pass through each other. Links of one limb, and a leg and the trunk, are kept apart by the
//! limits of the joints. A link does not collide with the link that carries it. A pair that touches in the home posture
//! does not collide either, so that home remains a posture without inner forces. The force sensors of the soles do not
//! feel contacts between links.

use super::rapier::shape::{gap_m, placed};
use super::similar;
use standfast_core::robot::{Foot, Kinematics, PerFoot, Robot};

/// Friction coefficient between links, plastic on plastic; assumed. (It is a power of two, so that the friction with
/// the ground, which an engine may multiply by it, can be divided by it exactly.)
pub const FRICTION: f64 = 0.25;
/// Gap at home below which a pair touches there (in COM heights).
const TOUCHING: f64 = 0.003;

/// Two links that pressed on each other in the past tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Meeting {
    /// Indices into `Robot::links`.
    pub links: [usize; 2],
    /// Whether they belong to different legs.
    pub of_legs: bool,
    /// Norm of the mean force between them over one physics step (N).
    pub force_n: f64,
}

/// The pairs of links that collide.
#[derive(Debug, Clone)]
pub struct Pairs {
    /// The limb of each link: `TRUNK`, one of `LEGS`, or a larger number for each arm.
    pub limbs: Vec<usize>,
    /// Whether two links collide, by their indices into `Robot::links`. It is symmetric.
    collide: Vec<Vec<bool>>,
    /// Pairs that do not collide only because they touch in the home posture.
    pub touching_at_home: Vec<[usize; 2]>,
}

/// The limb of the trunk and of all links that carry the trunk or both legs.
const TRUNK: usize = 0;
const LEGS: PerFoot<usize> = PerFoot { left: 1, right: 2 };

impl Pairs {
    pub fn new(robot: &Robot) -> Self {
        let in_heights = &robot.scaled(similar::scale(robot));
        let kinematics = Kinematics::at_home(in_heights);
        let limbs = limbs(robot);
        let count = robot.links.len();
        // The solids of each link at home.
        let at_home: Vec<Vec<_>> = (0..count)
            .map(|link| {
                let pose = kinematics.link_pose(link);
                in_heights.links[link]
                    .collisions
                    .iter()
                    .map(|solid| placed(&solid.shape, pose * solid.pose))
                    .collect()
            })
            .collect();
        let mut collide = vec![vec![false; count]; count];
        let mut touching_at_home = Vec::new();
        for b in 0..count {
            for a in
                (0..b).filter(|&a| carrier(robot, b) != Some(a) && can_meet(limbs[a], limbs[b]))
            {
                if at_home[a].iter().any(|solid| {
                    at_home[b]
                        .iter()
                        .any(|other| gap_m(solid, other) < TOUCHING)
                }) {
                    touching_at_home.push([a, b]);
                } else {
                    collide[a][b] = true;
                    collide[b][a] = true;
                }
            }
        }
        Self {
            limbs,
            collide,
            touching_at_home,
        }
    }

    /// Whether two links collide with each other.
    pub fn collide(&self, a: usize, b: usize) -> bool {
        self.collide[a][b]
    }

    pub fn of(&self, link: usize) -> impl Iterator<Item = usize> + '_ {
        (0..self.limbs.len()).filter(move |&other| self.collide(link, other))
    }

    /// Whether two links are of different legs.
    pub fn are_legs(&self, links: [usize; 2]) -> bool {
        let [a, b] = links.map(|link| self.limbs[link]);
        [a.min(b), a.max(b)] == [LEGS.left, LEGS.right]
    }

    /// The number of pairs that collide.
    pub fn count(&self) -> usize {
        self.collide
            .iter()
            .flatten()
            .filter(|collides| **collides)
            .count()
            / 2
    }
}

/// Whether links of these limbs may collide: an arm with any other limb, or one leg with the other.
fn can_meet(a: usize, b: usize) -> bool {
    a != b && (a.min(b) != TRUNK || a.max(b) > LEGS.right)
}

/// The link that carries a link.
fn carrier(robot: &Robot, link: usize) -> Option<usize> {
    link.checked_sub(1).map(|joint| robot.joints[joint].parent)
}

fn limbs(robot: &Robot) -> Vec<usize> {
    let carriers = |link: usize| {
        std::iter::successors(Some(link), |&link| carrier(robot, link)).collect::<Vec<_>>()
    };
    let [left, right] = Foot::BOTH.map(|foot| carriers(robot.soles[foot].link));
    let trunk = carriers(robot.trunk);
    let mut limbs = Vec::with_capacity(robot.links.len());
    let mut arms = LEGS.right;
    for link in 0..robot.links.len() {
        let [in_left, in_right] = [&left, &right].map(|leg| leg.contains(&link));
        let carried_by = carrier(robot, link).map_or(TRUNK, |carrier| limbs[carrier]);
        limbs.push(if trunk.contains(&link) || in_left && in_right {
            TRUNK
        } else if carried_by != TRUNK {
            carried_by
        } else if in_left {
            LEGS.left
        } else if in_right {
            LEGS.right
        } else {
            arms += 1;
            arms
        });
    }
    limbs
}

#[cfg(test)]
mod tests {
    use super::*;
    use standfast_core::robot::Shape;

    #[test]
    fn legs_meet_each_other_and_arms_meet_all_but_their_own_links() {
        let mut robot = standfast_robots::load("ut-mu2").unwrap();
        let link = |name: &str| {
            let robot = standfast_robots::load("ut-mu2").unwrap();
            robot
                .links
                .iter()
                .position(|link| link.name == name)
                .unwrap()
        };
        let [left_foot, right_foot] = ["left_ankle_abduction", "right_ankle_abduction"].map(link);
        let [hip, knee, trunk] = ["left_hip_abduction", "left_knee_flexion", "body"].map(link);
        let [shoulder, hand, other_hand] = [
            "left_shoulder_flexion",
            "left_elbow_flexion",
            "right_elbow_flexion",
        ]
        .map(link);
        let pairs = Pairs::new(&robot);
        for (a, b) in [
            (left_foot, right_foot),
            (hip, right_foot),
            (hand, trunk),
            (hand, hip),
            (hand, other_hand),
        ] {
            assert!(pairs.collide(a, b) && pairs.collide(b, a), "{a} {b}");
        }
        for (a, b) in [
            (left_foot, knee),
            (knee, trunk),
            (shoulder, trunk),
            (shoulder, hand),
            (hip, hip),
        ] {
            assert!(!pairs.collide(a, b) && !pairs.collide(b, a), "{a} {b}");
        }
        assert!(
            pairs.are_legs([right_foot, hip])
                && !pairs.are_legs([hand, hip])
                && !pairs.are_legs([hip, knee])
        );
        // 36 pairs are links of the two legs, 16 of the two arms, 96 of an arm and a leg, and 6 of an arm and the
        // trunk, whose shoulders do not count since the trunk carries them.
        assert_eq!(
            (pairs.count(), pairs.touching_at_home.len()),
            (36 + 16 + 96 + 6, 0)
        );
        // A hand of this size overlaps all links, so it collides with none.
        robot.links[hand].collisions[0].shape = Shape::Sphere { radius: 2.0 };
        let pairs = Pairs::new(&robot);
        assert!(!pairs.collide(hand, trunk) && pairs.collide(other_hand, trunk));
        assert!(
            pairs.touching_at_home.contains(&[trunk, hand]),
            "{:?}",
            pairs.touching_at_home
        );
        assert_eq!(
            pairs.count() + pairs.touching_at_home.len(),
            36 + 16 + 96 + 6
        );
    }
}
