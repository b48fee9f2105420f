//! Measures how far the soles slide on the ground.
//!
//! A sole that rolls over its edge or pivots about it moves without sliding. So the measured point is not the centre of
//! the sole, but the point of the sole at the centre of pressure: if this point moves along the ground, the sole
//! slides. Its displacements are summed as vectors for as long as the sole carries load, so sliding out and back sums
//! to zero. The sum starts anew when the foot is set down again.

use crate::Truth;
use nalgebra::{Point3, Vector2};
use standfast_core::robot::{Foot, GRAVITY, PerFoot, Pose, Robot};
use std::sync::Arc;

/// Least load at which a sole counts, as a share of the robot's weight. With less the foot is being lifted or set down.
const LOADED_SHARE: f64 = 0.1;

/// Watches both soles.
#[derive(Clone)]
pub(super) struct Slip {
    robot: Arc<Robot>,
    least_load_n: f64,
    soles: PerFoot<Option<LoadedSole>>,
}

/// A loaded sole, in the frame of the ground's plane.
#[derive(Clone, Copy)]
struct LoadedSole {
    /// Pose of the sole one tick ago.
    before: Pose,
    /// Displacement by sliding since the sole took up load (m).
    slid: Vector2<f64>,
}

impl Slip {
    pub(super) fn new(robot: Arc<Robot>) -> Self {
        Self {
            least_load_n: LOADED_SHARE * robot.mass() * GRAVITY,
            robot,
            soles: PerFoot::default(),
        }
    }

    /// Takes note of a tick, and returns how far a loaded sole has slid (m), the larger of both.
    pub(super) fn watch(&mut self, truth: &Truth) -> f64 {
        let to_plane = truth.ground.slope.inverse();
        let mut far = 0.0_f64;
        for foot in Foot::BOTH {
            let (wrench, now) = (truth.sole_wrenches[foot], to_plane * truth.soles[foot]);
            let to_sole = truth.soles[foot].rotation.inverse();
            let (force, moment) = (to_sole * wrench.force, to_sole * wrench.moment);
            if (to_plane * wrench.force).z < self.least_load_n || force.z <= 0.0 {
                self.soles[foot] = None;
                continue;
            }
            let [half_x, half_y] = self.robot.soles[foot].half_m;
            let (x, y) = (-moment.y / force.z, moment.x / force.z);
            let pressed = Point3::new(x.clamp(-half_x, half_x), y.clamp(-half_y, half_y), 0.0);
            let slid = self.soles[foot].map_or(Vector2::zeros(), |LoadedSole { before, slid }| {
                slid + (now * pressed - before * pressed).xy()
            });
            far = far.max(slid.norm());
            self.soles[foot] = Some(LoadedSole { before: now, slid });
        }
        far
    }
}
