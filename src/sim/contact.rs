//! Wrenches of the ground on the robot.

use nalgebra::{Point3, Vector3};
use standfast_core::robot::Foot;
use standfast_core::socket::Wrench;

/// A part of the robot that the ground may touch.
#[derive(Debug, Clone, Copy)]
pub enum ContactPart {
    Sole(Foot),
    /// Another solid of a link, which is an index into `Robot::links`.
    Link(usize),
}

/// A force (N) and a moment about the world's origin (N m), in world axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WorldWrench {
    pub force: Vector3<f64>,
    pub moment: Vector3<f64>,
}

impl WorldWrench {
    /// The same wrench, with its moment taken about `point`.
    pub fn about(&self, point: &Point3<f64>) -> Wrench {
        Wrench {
            force: self.force,
            moment: self.moment - point.coords.cross(&self.force),
        }
    }

    /// Zero moment point (m) on the plane z = 0. It is None if no force acts upward.
    pub fn zmp(&self) -> Option<[f64; 2]> {
        (self.force.z > 1e-6).then(|| [-self.moment.y / self.force.z, self.moment.x / self.force.z])
    }
}

impl std::ops::AddAssign for WorldWrench {
    fn add_assign(&mut self, other: Self) {
        self.force += other.force;
        self.moment += other.moment;
    }
}

impl std::ops::Mul<f64> for WorldWrench {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        Self {
            force: self.force * factor,
            moment: self.moment * factor,
        }
    }
}
