//! Contact wrenches, read from the impulses of Rapier's contact solver.

use super::convert::vec_from_rapier;
use crate::sim::contact::WorldWrench;
use nalgebra::{Isometry3, Point3};
use rapier3d::prelude::{ColliderHandle, ContactPair};

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
