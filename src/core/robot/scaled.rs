//! Robots of the same build and another size ("dynamic similarity").
//!
//! Let all lengths be `length` times as large and all masses `mass` times, while gravity stays as it is. If all times
//! are then `sqrt(length)` times as long and the other quantities follow by their units, the equations of motion are
//! the same: both robots move alike.

use super::kinematics::{Pose, Posture};
use super::model::{Ankle, Foot, Robot};
use super::shape::Shape;
use std::sync::Arc;

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
        for servo in &mut robot.servos {
            servo.kp *= moment;
            servo.kd *= moment * time;
            servo.torque_n_m *= moment;
            servo.full_torque_speed_rad_s /= time;
            servo.no_torque_speed_rad_s /= time;
            servo.rotor_inertia_kg_m2 *= moment * length;
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
