//! What lets a robot do more than a pendulum, from its links and servos: see [`crate::lipm::capture`].

use crate::lipm::capture::{Agility, PushOff, ZMP_SHARES};
use crate::robot::dynamics::load_torques;
use crate::robot::swing_time::leg_stroke;
use crate::robot::{Foot, GRAVITY, Kinematics, PerFoot, Robot};
use nalgebra::{Matrix3, Point3, Vector2, Vector3};

/// Angle by which the hips turn trunk and arms at most (rad): about what a trunk can lean and still come back.
const LEAN_RAD: f64 = 1.0;
/// Joints whose axes are turned by less than 45 degrees from a direction turn about it.
const ABOUT: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// A robot at home.
pub struct AtHome<'a> {
    robot: &'a Robot,
    kinematics: Kinematics,
    /// The joints of the legs, from the foot upward.
    legs: PerFoot<Vec<usize>>,
}

impl<'a> AtHome<'a> {
    pub fn new(robot: &'a Robot) -> Self {
        let mut kinematics = Kinematics::new(robot);
        kinematics.update(robot, &robot.home_posture());
        Self { robot, kinematics, legs: PerFoot::from_fn(|foot| robot.chain(robot.soles[foot].link).collect()) }
    }

    pub fn agility(&self) -> Agility {
        let (robot, omega) = (self.robot, self.robot.omega());
        let (mass_kg, com_height_m) = (robot.mass(), robot.home_com_height());
        let in_leg = |link: usize| Foot::BOTH.iter().any(|&foot| self.legs[foot].iter().any(|j| j + 1 == link));
        let upper = self.inertia((0..robot.links.len()).filter(|&link| !in_leg(link)));
        let whole = self.inertia(0..robot.links.len());
        // To move the DCM fore and aft, the trunk turns about y, and to move it sideways about x.
        let flywheel_m = [Vector3::y(), Vector3::x()].map(|axis| {
            let (inertia, torque) = (axis.dot(&(upper * axis)), self.hip_torque(&axis));
            let time_s = (inertia * LEAN_RAD / torque).sqrt();
            if torque > 0.0 { torque / (mass_kg * GRAVITY) * (1.0 - (-omega * time_s).exp()).powi(2) } else { 0.0 }
        });
        let inertia = whole[(0, 0)].max(whole[(1, 1)]);
        let inertia_ratio = inertia / (mass_kg * com_height_m * com_height_m);
        let (leg_stroke_m, leg_speed_m_s) = leg_stroke(robot);
        Agility { com_height_m, leg_stroke_m, leg_speed_m_s, flywheel_m, inertia_ratio }
    }

    /// Inertia of some links about their common COM (kg m^2).
    fn inertia(&self, links: impl Iterator<Item = usize> + Clone) -> Matrix3<f64> {
        let mass = |link: usize| self.robot.links[link].mass_kg;
        let place = |link: usize| self.kinematics.link_com(link).coords;
        let all: f64 = links.clone().map(mass).sum();
        let com = links.clone().map(|link| place(link) * mass(link)).sum::<Vector3<f64>>() / all;
        links
            .map(|link| {
                let turn = self.kinematics.link_pose(link).rotation.to_rotation_matrix();
                let lever = place(link) - com;
                let spread = Matrix3::from_diagonal_element(lever.norm_squared()) - lever * lever.transpose();
                turn.matrix() * self.robot.links[link].inertia_kg_m2 * turn.matrix().transpose() + spread * mass(link)
            })
            .sum()
    }

    /// Torque of both hips together about a horizontal axis (N m): of each leg, the uppermost joint about this axis.
    fn hip_torque(&self, axis: &Vector3<f64>) -> f64 {
        let about = |joint: &&usize| self.kinematics.joint_axis(**joint).dot(axis).abs() > ABOUT;
        let hip = |foot: Foot| self.legs[foot].iter().rfind(about).map_or(0.0, |&j| self.robot.servos[j].torque_n_m);
        hip(Foot::Left) + hip(Foot::Right)
    }

    /// The largest forces with which the legs can push off for a heading (degrees), with the ZMP between the
    /// middle of the feet, or of the sole, and the edge along the heading.
    pub fn push_off(&self, heading_deg: f64) -> PushOff {
        let (sin, cos) = heading_deg.to_radians().sin_cos();
        let soles = PerFoot::from_fn(|foot| self.kinematics.sole_pose(self.robot, foot).translation.vector.xy());
        let edge = |half_m: [f64; 2]| Vector2::new(cos, sin) * (half_m[0] / cos.abs()).min(half_m[1] / sin.abs());
        let with = |from: Vector2<f64>, way: Vector2<f64>| {
            ZMP_SHARES.map(|share| self.weights(from + way * share, &soles).max(1.0))
        };
        let one = |foot: Foot| with(soles[foot], edge(self.robot.soles[foot].half_m));
        let [half_x, half_y] = self.robot.soles.left.half_m;
        let apart_m = 0.5 * (soles.left.y - soles.right.y).abs();
        let both = with((soles.left + soles.right) / 2.0, edge([half_x, half_y + apart_m]));
        PushOff { both, left: one(Foot::Left), right: one(Foot::Right) }
    }

    /// The largest force, in weights, from a place of the ZMP (m) through the COM. It is shared by the feet as their
    /// distances from it ask for.
    fn weights(&self, zmp: Vector2<f64>, soles: &PerFoot<Vector2<f64>>) -> f64 {
        let robot = self.robot;
        let com: Point3<f64> = self.kinematics.com();
        let force = (com.coords - zmp.push(0.0)) * (robot.mass() * GRAVITY / com.z);
        let on_left = ((zmp.y - soles.right.y) / (soles.left.y - soles.right.y)).clamp(0.0, 1.0);
        let wrenches = PerFoot::from_fn(|foot| {
            let share = if foot == Foot::Left { on_left } else { 1.0 - on_left };
            // With both feet, the force acts level with the middle of each sole; with one, wherever it is.
            let y = if share < 1.0 { 0.0 } else { zmp.y - soles[foot].y };
            let lever = Vector3::new(zmp.x - soles[foot].x, y, 0.0);
            [force * share, lever.cross(&(force * share))]
        });
        let mut torques = vec![0.0; robot.joints.len()];
        load_torques(&self.kinematics, robot, -force / robot.mass(), &wrenches, &mut torques);
        let joints = Foot::BOTH.into_iter().flat_map(|foot| self.legs[foot].iter().copied());
        joints.map(|j| robot.servos[j].torque_n_m / torques[j].abs()).fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ut_mu2_has_the_agility_that_its_figures_give() {
        let robot = Robot::load("ut-mu2").unwrap();
        let home = AtHome::new(&robot);
        let agility = home.agility();
        // A straight leg is 22 mm longer than at home.
        assert!((0.015..0.025).contains(&agility.leg_stroke_m), "{agility:?}");
        assert!(agility.flywheel_m.iter().all(|way| (0.005..0.02).contains(way)), "{agility:?}");
        assert!((0.05..0.5).contains(&agility.inertia_ratio), "{agility:?}");
        let (left, right) = (home.push_off(90.0), home.push_off(-90.0));
        // Its COM is 0.2 mm to the left.
        assert!((left.left[2] / right.right[2] - 1.0).abs() < 0.05, "{left:?} {right:?}");
        assert!((0.4..1.5).contains(&agility.leg_speed_m_s), "{agility:?}");
        for heading_deg in [0.0, 45.0, 90.0, 180.0] {
            let PushOff { both, left, right } = home.push_off(heading_deg);
            let all = [both, left, right];
            assert!(all.as_flattened().iter().all(|weights| (1.0..20.0).contains(weights)), "{heading_deg}: {all:?}");
        }
        // Pushed to the left with the ZMP at the edge, the left leg alone carries, with its hip.
        assert!((left.both[2] / left.left[2] - 1.0).abs() < 0.01, "{left:?}");
        // Motors with twice the torque carry twice the weight.
        let mut strong = robot.clone();
        strong.servos.iter_mut().for_each(|servo| servo.torque_n_m *= 2.0);
        let twice = AtHome::new(&strong).push_off(0.0);
        assert!((twice.both[2] / home.push_off(0.0).both[2] - 2.0).abs() < 1e-9, "{twice:?}");
    }
}
