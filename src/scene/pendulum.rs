//! The bob of a push by a pendulum with its rope, as one body: its origin is the centre of the bob, and its z axis points
//! along the rope to the pivot.

use super::palette::Color;
use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use standfast_core::robot::{Shape, Solid};
use standfast_sim::Bob;

/// Colours of bob and rope.
pub const COLORS: [Color; 2] = [Color::hex(0xeda826), Color::hex(0x948061)];
/// Radius of the rope as a share of that of the bob.
const ROPE: f64 = 0.04;

/// The solids of bob and rope.
pub fn solids(bob: &Bob) -> [Solid; 2] {
    let rope = Shape::Cylinder {
        radius: ROPE * bob.radius_m,
        length: bob.rope_m,
    };
    let ball = Shape::Sphere {
        radius: bob.radius_m,
    };
    let middle = Isometry3::translation(0.0, 0.0, 0.5 * bob.rope_m);
    let solid = |pose, shape, color: Color| {
        let [r, g, b] = color.parts();
        Solid {
            frame: 0,
            pose,
            shape,
            color: [r, g, b, 1.0],
        }
    };
    [
        solid(Isometry3::identity(), ball, COLORS[0]),
        solid(middle, rope, COLORS[1]),
    ]
}

/// The pose of the body, from its pivot and the centre of its bob (m).
pub fn pose([pivot, bob]: [Point3<f64>; 2]) -> Isometry3<f64> {
    let up = UnitQuaternion::rotation_between(&Vector3::z(), &(pivot - bob));
    Isometry3::from_parts(bob.into(), up.unwrap_or_default())
}
