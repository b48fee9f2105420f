//! Contact wrenches between soles and ground, read from the impulses of Rapier's contact solver.

use super::convert::vec_from_rapier;
use crate::robot::Wrench;
use nalgebra::{Isometry3, Point3, Vector3};
use rapier3d::prelude::{ColliderHandle, ContactPair};

/// A force (N) and a moment about the world's origin (N m), in world axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct WorldWrench {
    pub force: Vector3<f64>,
    pub moment: Vector3<f64>,
}

impl WorldWrench {
    /// The same wrench, with its moment taken about `point`.
    pub fn about(&self, point: &Point3<f64>) -> Wrench {
        Wrench { force: self.force, moment: self.moment - point.coords.cross(&self.force) }
    }

    /// Zero moment point (m) on the plane z = 0; None without an upward force.
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
        Self { force: self.force * factor, moment: self.moment * factor }
    }
}

/// Mean wrench of the ground on the other collider of `pair` over the last physics step of `dt` (s).
///
/// `pose` is that of `ground`, world. With one solver iteration per step, the impulses are those of the whole step.
pub fn ground_wrench(pair: &ContactPair, ground: ColliderHandle, pose: &Isometry3<f64>, dt: f64) -> WorldWrench {
    let mut sum = WorldWrench::default();
    let ground_first = pair.collider1 == ground;
    for manifold in pair.manifolds() {
        let normal = vec_from_rapier(manifold.data.normal);
        for contact in &manifold.points {
            // Rapier stores the friction impulse on the first body, and a normal from the first to the second.
            let on_second =
                normal * f64::from(contact.data.impulse) - vec_from_rapier(contact.data.warmstart_tangent_world);
            let (force, point) =
                if ground_first { (on_second, contact.local_p1) } else { (-on_second, contact.local_p2) };
            let (force, point) = (force / dt, pose * Point3::from(vec_from_rapier(point)));
            sum += WorldWrench { force, moment: point.coords.cross(&force) };
        }
    }
    sum
}
