//! The home posture: arms clear of the body, knees bent, soles flat and level, and the COM above their middle in x.

use super::clearance::Hulls;
use super::figures::to_decimals;
use super::limbs::Limbs;
use nalgebra::{DMatrix, DVector, Vector3};
use standfast_core::robot::kinematics::heading;
use standfast_core::robot::{Foot, Kinematics, PerFoot, Posture, Robot};

/// Angle by which the knees are bent (rad), from a straight leg.
const KNEE_RAD: f64 = 0.7;
/// Bend of a knee with all joints at zero (rad) below which the leg is taken to be straight there.
const STRAIGHT_RAD: f64 = 0.35;
/// Distance of the joints from their limits at home (rad), if their ranges are large enough.
const MARGIN_RAD: f64 = 0.02;
/// Largest number of Newton steps, and the largest change of an angle in one step (rad).
const STEPS: usize = 200;
const LARGEST_RAD: f64 = 0.2;
/// Weight of the goals that give way to flat, level soles under the COM, and their weight where they would tilt the soles.
const SOFT: f64 = 0.03;
const SOFTER: f64 = 1e-3;
/// How far the soles may stand apart, as a multiple of the distance of the legs' first joints, before they stand that far apart.
const STRADDLES: f64 = 3.0;
/// Least gap between the soles, and between an arm and the rest of the body, in lengths of the legs.
const GAP: f64 = 0.02;
/// Step of the search for the arms (rad), and number of times that it goes over all joints.
const ARM_STEP_RAD: f64 = 0.1;
const ARM_ROUNDS: usize = 3;
/// Largest tilt of a sole (rad), and the largest angle by which a foot may point inward or outward.
const FLAT_RAD: f64 = 5e-4;
const TURNED_RAD: f64 = 0.5;
/// Largest difference in height of level soles (m), and largest difference of the legs' lengths, as a share of the
/// length.
const LEVEL_M: f64 = 5e-5;
const LEGS_DIFFER: f64 = 0.02;
/// Largest difference of two arms that are mirror images, as a share of their size.
const ALIKE: f64 = 0.02;

/// A home posture, and how it was found.
pub struct FoundHome {
    pub home_rad: Vec<f64>,
    /// Joints whose angles the solver found.
    pub solved: Vec<usize>,
    pub warnings: Vec<String>,
    /// Height of the left sole above the right one (m), in a robot whose legs differ a little; 0 in others.
    pub apart_m: f64,
}

/// The joint of a leg that bends its knee: its index, the angle at which the leg is straight, and the sign of bending.
struct Knee {
    joint: usize,
    straight_rad: f64,
    sign: f64,
}

/// Finds the home posture of `robot`, whose trunk and soles are known. It starts from the posture `reference`, if there
/// is one; then the knees remain as they are there. Errors are in words.
pub fn find(robot: &Robot, limbs: &Limbs, reference: Option<&[f64]>) -> Result<FoundHome, String> {
    let mut warnings = Vec::new();
    let length_m = leg_length_m(robot, limbs);
    let mut q: Vec<f64> = match reference {
        Some(angles) => angles.to_vec(),
        None => vec![0.0; robot.joints.len()],
    };
    for (angle, joint) in q.iter_mut().zip(&robot.joints) {
        *angle = within(*angle, joint.lower_rad, joint.upper_rad);
    }
    if reference.is_none() {
        bring_arms_down(robot, limbs, GAP * length_m, &mut q);
    }
    let knees = Foot::BOTH.map(|foot| knee(robot, &limbs.legs[foot]));
    let mut bent = Vec::new();
    for (foot, knee) in Foot::BOTH.into_iter().zip(&knees) {
        let Some(Knee {
            joint,
            straight_rad,
            sign,
        }) = knee
        else {
            warnings.push(format!(
                "the {} leg has no knee: fewer than three of its joints pitch",
                foot.name()
            ));
            continue;
        };
        let limits = &robot.joints[*joint];
        let wanted = match reference {
            Some(angles) => angles[*joint],
            None => straight_rad + sign * KNEE_RAD,
        };
        let angle = within(wanted, limits.lower_rad, limits.upper_rad);
        bent.push((*joint, angle));
        q[*joint] = angle;
        if reference.is_none() {
            // The first and the last pitch joint, hip and ankle, each turn back by half of the knee's bend.
            let pitch = pitch_joints(robot, &limbs.legs[foot]);
            for (j, axis) in [pitch.first(), pitch.last()].into_iter().flatten() {
                let limits = &robot.joints[*j];
                q[*j] = within(
                    -axis.signum() * 0.5 * KNEE_RAD,
                    limits.lower_rad,
                    limits.upper_rad,
                );
            }
        }
    }
    let half_width = Foot::BOTH
        .map(|foot| robot.soles[foot].half_m[1])
        .into_iter()
        .fold(0.0, f64::max);
    let aside_m = PerFoot::from_fn(|foot| {
        let mut kinematics = Kinematics::new(robot);
        kinematics.update(
            robot,
            &Posture {
                q: vec![0.0; q.len()],
                ..robot.zero_posture()
            },
        );
        let y = foot.side() * kinematics.sole_pose(robot, foot).translation.y;
        let hip = foot.side() * kinematics.joint_position(limbs.legs[foot][0]).y;
        let least = half_width + 0.5 * GAP * length_m;
        // The legs of some robots are spread at zero.
        let most = if hip > 0.5 * least {
            STRADDLES * hip
        } else {
            f64::INFINITY
        };
        foot.side() * y.min(most).max(least)
    });
    let mut solver = Solver {
        robot,
        legs: limbs
            .legs
            .left
            .iter()
            .chain(&limbs.legs.right)
            .copied()
            .collect(),
        kinematics: Kinematics::new(robot),
        bent,
        aside_m,
        length_m,
        soft: SOFT,
    };
    solver.solve(&mut q);
    if solver.tilts_rad(&q).iter().any(|tilt| *tilt > FLAT_RAD) {
        solver.soft = SOFTER;
        solver.solve(&mut q);
    }
    for angle in &mut q {
        *angle = to_decimals(*angle, 6);
    }
    let apart_m = solver.check(&q)?;
    let solved = solver
        .legs
        .clone()
        .into_iter()
        .filter(|j| solver.bent.iter().all(|(knee, _)| knee != j))
        .collect();
    Ok(FoundHome {
        home_rad: q,
        solved,
        warnings,
        apart_m,
    })
}

/// Clamps an angle to limits, with a margin if there is room for it.
fn within(angle: f64, lower: f64, upper: f64) -> f64 {
    let margin = MARGIN_RAD.min(0.25 * (upper - lower));
    angle.clamp(lower + margin, upper - margin)
}

/// Height of the first joint of the legs above the soles, with all joints at zero (m).
pub fn leg_length_m(robot: &Robot, limbs: &Limbs) -> f64 {
    let kinematics = Kinematics::new(robot);
    let height = |foot: Foot| {
        let hip = limbs.legs[foot]
            .first()
            .map_or(0.0, |&j| kinematics.joint_position(j).z);
        hip - kinematics.sole_pose(robot, foot).translation.z
    };
    height(Foot::Left).max(height(Foot::Right)).max(1e-3)
}

/// The joints of a leg that pitch with all joints at zero, with the y component of their axes.
fn pitch_joints(robot: &Robot, leg: &[usize]) -> Vec<(usize, f64)> {
    let kinematics = Kinematics::new(robot);
    leg.iter()
        .filter(|&&j| kinematics.pitches(j))
        .map(|&j| (j, kinematics.joint_axis(j).y))
        .collect()
}

fn knee(robot: &Robot, leg: &[usize]) -> Option<Knee> {
    let pitch = pitch_joints(robot, leg);
    if pitch.len() < 3 {
        return None;
    }
    let kinematics = Kinematics::new(robot);
    let place = |k: usize| kinematics.joint_position(pitch[k].0);
    let last = pitch.len() - 1;
    let (hip, ankle) = (place(0), place(last));
    // Of more than three joints, the one that is far from both the first and the last one: toes bend, too.
    let away = |k: &usize| (place(*k) - hip).norm().min((place(*k) - ankle).norm());
    let middle = (1..last).max_by(|a, b| away(a).total_cmp(&away(b)))?;
    let at = place(middle);
    let (joint, axis) = pitch[middle];
    // Positive if the ankle is behind the line from hip to knee.
    let pitch_of = |v: Vector3<f64>| (-v.x).atan2(-v.z);
    let bend = pitch_of(ankle - at) - pitch_of(at - hip);
    let straight_rad = if bend.abs() < STRAIGHT_RAD {
        0.0
    } else {
        -axis.signum() * bend
    };
    Some(Knee {
        joint,
        straight_rad,
        sign: axis.signum(),
    })
}

/// Newton's method for the joints of both legs.
struct Solver<'a> {
    robot: &'a Robot,
    legs: Vec<usize>,
    kinematics: Kinematics,
    /// The knees with their angles.
    bent: Vec<(usize, f64)>,
    /// Positions of the soles in y (m).
    aside_m: PerFoot<f64>,
    length_m: f64,
    /// Weight of the goals that give way.
    soft: f64,
}

impl Solver<'_> {
    fn update(&mut self, q: &[f64]) {
        let posture = Posture {
            q: q.to_vec(),
            ..self.robot.zero_posture()
        };
        self.kinematics.update(self.robot, &posture);
    }

    /// The errors that are left, in rad and in lengths of the legs.
    fn errors(&mut self, q: &[f64]) -> DVector<f64> {
        self.update(q);
        let com = self.kinematics.com();
        let mut errors = Vec::new();
        let mut heights = Vec::new();
        for foot in Foot::BOTH {
            let sole = self.kinematics.sole_pose(self.robot, foot);
            let (up, forward, place) = (
                sole.rotation * Vector3::z(),
                sole.rotation * Vector3::x(),
                sole.translation,
            );
            let aside = (place.y - self.aside_m[foot]) / self.length_m;
            errors.extend([
                up.x,
                up.y,
                (com.x - place.x) / self.length_m,
                self.soft * forward.y,
                self.soft * aside,
            ]);
            heights.push(place.z);
        }
        errors.push((heights[0] - heights[1]) / self.length_m);
        errors.extend(
            self.bent
                .iter()
                .map(|(knee, angle)| self.soft * (q[*knee] - angle)),
        );
        DVector::from_vec(errors)
    }

    fn solve(&mut self, q: &mut [f64]) {
        const DIFFERENCE_RAD: f64 = 1e-6;
        for _ in 0..STEPS {
            let errors = self.errors(q);
            let mut free = self.legs.clone();
            let step = loop {
                let mut jacobian = DMatrix::zeros(errors.len(), free.len());
                for (column, &j) in free.iter().enumerate() {
                    let angle = q[j];
                    q[j] = angle + DIFFERENCE_RAD;
                    jacobian.set_column(column, &((self.errors(q) - &errors) / DIFFERENCE_RAD));
                    q[j] = angle;
                }
                let normal = jacobian.transpose() * &jacobian
                    + DMatrix::identity(free.len(), free.len()) * 1e-9;
                let Some(solvable) = normal.cholesky() else {
                    return;
                };
                let step = -solvable.solve(&(jacobian.transpose() * &errors));
                // A joint that would leave its limits stays, and the other joints compensate.
                let leaving = free.iter().enumerate().position(|(k, &j)| {
                    let joint = &self.robot.joints[j];
                    step[k].abs() > 1e-12
                        && within(q[j] + step[k], joint.lower_rad, joint.upper_rad) == q[j]
                });
                match leaving {
                    Some(k) => _ = free.remove(k),
                    None => break step,
                }
            };
            let short = (LARGEST_RAD / step.amax()).min(1.0);
            for (&j, step) in free.iter().zip(step.iter()) {
                let joint = &self.robot.joints[j];
                q[j] = within(q[j] + short * step, joint.lower_rad, joint.upper_rad);
            }
            if step.amax() < 1e-10 {
                return;
            }
        }
    }

    /// The tilts of the left and the right sole (rad).
    fn tilts_rad(&mut self, q: &[f64]) -> [f64; 2] {
        self.update(q);
        Foot::BOTH.map(|foot| {
            let sole = self.kinematics.sole_pose(self.robot, foot);
            (sole.rotation * Vector3::z()).angle(&Vector3::z())
        })
    }

    /// Fails unless the soles are flat, and level up to the accepted difference of the legs. Returns the height of the
    /// left sole above the right one (m), or 0 if both are level.
    fn check(&mut self, q: &[f64]) -> Result<f64, String> {
        let tilt_rad = self.tilts_rad(q);
        let soles = Foot::BOTH.map(|foot| self.kinematics.sole_pose(self.robot, foot));
        let apart_m = soles[0].translation.z - soles[1].translation.z;
        let step_m = apart_m.abs();
        let problem = if tilt_rad.iter().any(|tilt| *tilt > FLAT_RAD)
            || step_m > LEGS_DIFFER * self.length_m
        {
            format!(
                "tilts them by {:.4} and {:.4} rad, and one is {:.2} mm higher",
                tilt_rad[0],
                tilt_rad[1],
                1e3 * step_m
            )
        } else if soles[0].translation.y <= soles[1].translation.y {
            "crosses the legs".into()
        } else if soles.iter().any(|sole| heading(sole).abs() > TURNED_RAD) {
            let [left, right] = soles.map(|sole| heading(&sole).to_degrees());
            format!("turns the feet by {left:.0} and {right:.0} degrees")
        } else {
            return Ok(if step_m > LEVEL_M { apart_m } else { 0.0 });
        };
        let at_limits = self.legs.iter().filter(|&&j| {
            let joint = &self.robot.joints[j];
            within(q[j] - 1e-3, joint.lower_rad, joint.upper_rad) > q[j] - 1e-3
                || within(q[j] + 1e-3, joint.lower_rad, joint.upper_rad) < q[j] + 1e-3
        });
        let names: Vec<&str> = at_limits.map(|&j| &*self.robot.joints[j].name).collect();
        let at_limits = match names.is_empty() {
            true => String::new(),
            false => format!("; at their limits are {}", names.join(", ")),
        };
        Err(format!(
            "no home posture with flat, level soles was found: the best one {problem}{at_limits}"
        ))
    }
}

/// The angles of `arm` that make it the mirror image of `other` in the posture `q` (rad). It is None if the arms are
/// built differently, or if the limits of `arm` are too narrow.
fn mirrored(robot: &Robot, other: &[usize], arm: &[usize], q: &[f64]) -> Option<Vec<f64>> {
    let kinematics = Kinematics::new(robot);
    let size_m = kinematics
        .com()
        .z
        .abs()
        .max((kinematics.joint_position(arm[0]) - kinematics.joint_position(other[0])).norm());
    let angle = |(&there, &here): (&usize, &usize)| {
        let [at, place] = [there, here].map(|j| kinematics.joint_position(j));
        let [axis, turns] = [there, here].map(|j| kinematics.joint_axis(j));
        // The image of a rotation about an axis.
        let alike = turns.dot(&Vector3::new(-axis.x, axis.y, -axis.z));
        let is_image = (place - nalgebra::Point3::new(at.x, -at.y, at.z)).norm() < ALIKE * size_m
            && alike.abs() > 1.0 - ALIKE;
        let (joint, angle) = (&robot.joints[here], alike.signum() * q[there]);
        (is_image && within(angle, joint.lower_rad, joint.upper_rad) == angle).then_some(angle)
    };
    (other.len() == arm.len())
        .then(|| other.iter().zip(arm).map(angle).collect())
        .flatten()
}

/// Lowers the arms, clear of trunk, legs and each other.
fn bring_arms_down(robot: &Robot, limbs: &Limbs, gap_m: f64, q: &mut [f64]) {
    let hulls = Hulls::of(robot);
    let mut kinematics = Kinematics::new(robot);
    for (i, arm) in limbs.arms.iter().enumerate() {
        // If a mirror image of this arm was lowered before, this arm hangs in the same way.
        let other = limbs.arms[..i]
            .iter()
            .find_map(|other| mirrored(robot, other, arm, q));
        if let Some(angles) = other {
            for (&j, angle) in arm.iter().zip(angles) {
                q[j] = angle;
            }
            continue;
        }
        let of_arm: Vec<usize> = Limbs::links(arm).collect();
        let carrier = robot.joints[arm[0]].parent;
        let others: Vec<usize> = (0..robot.links.len())
            .filter(|link| !of_arm.contains(link))
            .collect();
        let pairs: Vec<[usize; 2]> = of_arm
            .iter()
            .flat_map(|&link| others.iter().map(move |&other| [link, other]))
            .filter(|pair| *pair != [of_arm[0], carrier])
            .collect();
        let mut cost = |q: &[f64]| {
            kinematics.update(
                robot,
                &Posture {
                    q: q.to_vec(),
                    ..robot.zero_posture()
                },
            );
            let (_, com) = kinematics.subtree(of_arm[0]);
            let shoulder = kinematics.joint_position(arm[0]);
            let reach = (com - shoulder).norm().max(1e-6);
            let bent: f64 = arm.iter().map(|&j| q[j] * q[j]).sum();
            let near: f64 = pairs
                .iter()
                .map(|pair| 1.0 - hulls.gap_m(&kinematics, *pair, gap_m) / gap_m)
                .sum();
            (com.z - shoulder.z) / reach + 0.3 * bent + 10.0 * near
        };
        let mut least = cost(q);
        for _ in 0..ARM_ROUNDS {
            for &j in arm {
                let (joint, was) = (&robot.joints[j], q[j]);
                let mut best = was;
                let most = (1.6 / ARM_STEP_RAD) as i32;
                for angle in (-most..=most).map(|k| f64::from(k) * ARM_STEP_RAD) {
                    q[j] = within(angle, joint.lower_rad, joint.upper_rad);
                    let cost = cost(q);
                    // Of equal angles, the first one stays.
                    if cost < least - 1e-9 {
                        (least, best) = (cost, q[j]);
                    }
                }
                q[j] = best;
            }
        }
    }
}
