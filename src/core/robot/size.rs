//! Scaling by the robot's size: the units in which a figure fits robots of every size, and similar robots.
//!
//! A pendulum of the COM height h swings with `omega = sqrt(g / h)` (eq. 1), and falls in a time of about `1 / omega`.
//! Let one of two robots of the same build have all lengths L times as large and all masses M times. Both move alike,
//! since the equations of motion are the same, if lengths are measured in h, times in `1 / omega` and forces in weights
//! m g ("dynamic similarity"). In SI units times are then sqrt(L) times as long, forces M times as large, and so on.

use super::kinematics::{Kinematics, Pose, Posture};
use super::model::{Ankle, Foot, GRAVITY, Robot};
use super::shape::Shape;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// The units of a robot at home.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Units {
    /// Mass m of the robot (kg).
    pub mass_kg: f64,
    /// Height h of the robot's COM (m).
    pub length_m: f64,
    /// Half the length of the shorter sole (m).
    pub half_sole_m: f64,
}

impl Units {
    pub fn of(robot: &Robot) -> Self {
        Self {
            mass_kg: robot.mass(),
            length_m: robot.home_com_height(),
            half_sole_m: Foot::BOTH
                .map(|foot| robot.soles[foot].half_m[0])
                .into_iter()
                .fold(f64::INFINITY, f64::min),
        }
    }

    /// Natural frequency of the pendulum (rad/s).
    pub fn omega(&self) -> f64 {
        (GRAVITY / self.length_m).sqrt()
    }

    /// Unit of time, `1 / omega` (s).
    pub fn time_s(&self) -> f64 {
        1.0 / self.omega()
    }

    /// Unit of speed, `omega h` (m/s).
    pub fn speed_m_s(&self) -> f64 {
        self.omega() * self.length_m
    }

    /// The change of the velocity of the COM by an impulse (N s), in m/s and in the unit of speed, which is sqrt(g h).
    pub fn velocity_of(&self, impulse_n_s: f64) -> [f64; 2] {
        let dv_m_s = impulse_n_s / self.mass_kg;
        [dv_m_s, dv_m_s / self.speed_m_s()]
    }

    /// Unit of force: the weight (N).
    pub fn weight_n(&self) -> f64 {
        self.mass_kg * GRAVITY
    }

    /// Unit of impulses, the sole impulse (N s): mass times omega times half the length of the shorter sole. A short
    /// push of this size forward brings the DCM from above the middle of the feet to their front edge. (m omega d, by
    /// which a result compares pushes, has instead of half a sole the distance to the edge in the direction of the
    /// push.)
    pub fn impulse_n_s(&self) -> f64 {
        self.mass_kg * self.omega() * self.half_sole_m
    }
}

/// Ratios of a similar robot's quantities to the robot's own.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SizeRatio {
    pub length: f64,
    pub mass: f64,
}

impl SizeRatio {
    /// Ratio of times, and of speeds.
    pub fn time(self) -> f64 {
        self.length.sqrt()
    }

    /// Ratio of forces: weights are in proportion to masses, and so are all other forces.
    pub fn force(self) -> f64 {
        self.mass
    }

    /// Ratio of moments, stiffnesses of joints and energies.
    pub fn moment(self) -> f64 {
        self.mass * self.length
    }

    pub fn impulse(self) -> f64 {
        self.mass * self.time()
    }

    /// Ratio of forces per length.
    pub fn force_per_length(self) -> f64 {
        self.mass / self.length
    }

    /// A pose in the world or in a link's frame.
    pub fn pose(self, pose: &Pose) -> Pose {
        Pose::from_parts(
            (pose.translation.vector * self.length).into(),
            pose.rotation,
        )
    }

    pub fn posture(self, posture: &Posture) -> Posture {
        Posture {
            base: self.pose(&posture.base),
            q: posture.q.clone(),
        }
    }

    fn shape(self, shape: &Shape) -> Shape {
        let l = self.length;
        match shape {
            Shape::Box { half } => Shape::Box { half: half * l },
            Shape::Cylinder { radius, length } => Shape::Cylinder {
                radius: radius * l,
                length: length * l,
            },
            Shape::Capsule { radius, length } => Shape::Capsule {
                radius: radius * l,
                length: length * l,
            },
            Shape::Sphere { radius } => Shape::Sphere { radius: radius * l },
            Shape::Mesh(mesh) => Shape::Mesh(Arc::new(mesh.scaled(l))),
        }
    }
}

impl Robot {
    /// Height of the centre of mass above the ground at home (m).
    pub fn home_com_height(&self) -> f64 {
        Kinematics::at_home(self).com().z
    }

    /// Natural frequency of the pendulum at home (rad/s), the paper's omega.
    pub fn omega(&self) -> f64 {
        Units::of(self).omega()
    }

    pub fn weight_n(&self) -> f64 {
        self.mass() * GRAVITY
    }

    /// A similar robot.
    pub fn scaled(&self, by: SizeRatio) -> Robot {
        let (length, moment, time) = (by.length, by.moment(), by.time());
        let mut robot = self.clone();
        for link in &mut robot.links {
            link.mass_kg *= by.mass;
            link.com_m *= length;
            link.inertia_kg_m2 *= moment * length;
            for solid in link.collisions.iter_mut().chain(&mut link.visuals) {
                solid.pose = by.pose(&solid.pose);
                solid.shape = by.shape(&solid.shape);
            }
        }
        for joint in &mut robot.joints {
            joint.origin = by.pose(&joint.origin);
        }
        for frame in &mut robot.frames {
            frame.pose = by.pose(&frame.pose);
        }
        for foot in Foot::BOTH {
            let sole = &mut robot.soles[foot];
            sole.center = by.pose(&sole.center);
            sole.half_m = sole.half_m.map(|half| half * length);
            sole.thickness_m *= length;
            let Ankle {
                above_m,
                torque_n_m,
            } = sole.ankle;
            sole.ankle = Ankle {
                above_m: above_m.map(|x| x * length),
                torque_n_m: torque_n_m.map(|t| t * moment),
            };
        }
        if let Some(point_m) = &mut robot.pushed.point_m {
            *point_m *= length;
        }
        for servo in &mut robot.servos {
            servo.kp *= moment;
            servo.kd *= moment * time;
            servo.torque_n_m *= moment;
            servo.full_torque_speed_rad_s /= time;
            servo.no_torque_speed_rad_s /= time;
            servo.rotor_inertia_kg_m2 *= moment * length;
            servo.friction_n_m *= moment;
            servo.damping_n_m_s_rad *= moment * time;
        }
        // The noise of angles and accelerations is the same.
        robot.noise.joint_speed_rad_s /= time;
        robot.noise.gyro_rad_s /= time;
        robot.noise.sole_force_n *= by.force();
        robot.noise.sole_moment_n_m *= moment;
        robot.delay_s *= time;
        for region in &mut robot.reach {
            region.x_m = region.x_m.map(|x| x * length);
            region.y_m = region.y_m.map(|y| y * length);
            region.arc_m *= length;
            region.swing_time_s *= time;
        }
        robot
    }
}
