//! Contact wrenches, read from the impulses of Rapier's contact solver. With one solver iteration per step, these are
//! the impulses of the whole step.

use super::convert::vec_from_rapier;
use crate::contact::WorldWrench;
use nalgebra::{Isometry3, Point3, Vector3};
use rapier3d::prelude::{ColliderHandle, Contact, ContactPair};

/// The points of a pair of colliders, each with the impulse on the second collider (N s).
fn impulses(pair: &ContactPair) -> impl Iterator<Item = (Vector3<f64>, &Contact)> {
    pair.manifolds().iter().flat_map(|manifold| {
        let normal = vec_from_rapier(manifold.data.normal);
        manifold.points.iter().map(move |contact| {
            // Rapier stores the friction impulse on the first body, and a normal from the first to the second.
            let friction = vec_from_rapier(contact.data.warmstart_tangent_world);
            (normal * f64::from(contact.data.impulse) - friction, contact)
        })
    })
}

/// Mean wrench of the ground on the other collider of `pair` over the last physics step of `dt` (s).
///
/// `pose` is the pose of `ground` in the world.
pub fn ground_wrench(
    pair: &ContactPair,
    ground: ColliderHandle,
    pose: &Isometry3<f64>,
    dt: f64,
) -> WorldWrench {
    let mut sum = WorldWrench::default();
    let ground_first = pair.collider1 == ground;
    for (on_second, contact) in impulses(pair) {
        let (force, point) = if ground_first {
            (on_second, contact.local_p1)
        } else {
            (-on_second, contact.local_p2)
        };
        let (force, point) = (force / dt, pose * Point3::from(vec_from_rapier(point)));
        sum += WorldWrench {
            force,
            moment: point.coords.cross(&force),
        };
    }
    sum
}

/// Norm of the mean force between the colliders of `pair` over the last physics step of `dt` (N).
pub fn force_n(pair: &ContactPair, dt: f64) -> f64 {
    impulses(pair)
        .map(|(impulse, _)| impulse)
        .sum::<Vector3<f64>>()
        .norm()
        / dt
}
