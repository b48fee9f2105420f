//! The interface between the plant and a physics engine. An engine holds one robot on its ground. All values are in SI
//! units and in f64.

use super::contact::{ContactPart, WorldWrench};
use super::servo::Drive;
use nalgebra::{DVector, Isometry3, Point3, UnitQuaternion, Vector3};
use standfast_core::robot::Posture;

/// A robot on its ground in a physics engine. Links and joints are those of [`Robot`](standfast_core::robot::Robot), by index.
pub trait Physics: Send + Sync {
    /// A copy that continues from the present state to the same bits.
    fn copy(&self) -> Box<dyn Physics>;

    /// Reads posture and generalised velocity (as in [`Truth`](super::Truth)).
    fn read(&self, posture: &mut Posture, velocity: &mut DVector<f64>);

    /// Pose in the world of a frame that is fixed to a link. Each engine chooses this frame.
    fn body(&self, link: usize) -> Isometry3<f64>;

    /// Removes the forces of the last physics step.
    fn clear_forces(&mut self);

    /// Adds a force (N) on a link at a point (m) for the next physics step, in the world frame.
    fn add_force(&mut self, link: usize, force: Vector3<f64>, point: Point3<f64>);

    /// Sets the drive of each servo for the next physics step, given by number, angle (rad) and speed (rad/s) of its
    /// joint.
    fn set_drives(&mut self, drive: &mut dyn FnMut(usize, f64, f64) -> Drive);

    /// Tilts the ground for the next physics step. `slope` rotates the frame of the ground's plane to the world.
    fn tilt(&mut self, slope: &UnitQuaternion<f64>);

    fn step(&mut self);

    /// Calls `see` with the speed (rad/s) of every joint in order.
    fn speeds(&self, see: &mut dyn FnMut(usize, f64));

    /// Calls `see` with each part that touched the ground in the last physics step, and with the mean wrench of the
    /// ground on the part. `slope` is the slope of the ground in that step.
    fn touches(&self, slope: &UnitQuaternion<f64>, see: &mut dyn FnMut(ContactPart, WorldWrench));

    /// Calls `see` with each pair of links that pressed on each other in the last physics step, and with the norm of
    /// the mean force between the two (N).
    fn meets(&self, see: &mut dyn FnMut([usize; 2], f64));
}

impl Clone for Box<dyn Physics> {
    fn clone(&self) -> Self {
        (**self).copy()
    }
}
