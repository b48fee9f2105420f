//! Simulates every robot in the same size. An engine sees a similar robot of [`COM_HEIGHT_M`] and [`MASS_KG`], and
//! times, forces and speeds are converted on the way in and out. Engines have tolerances in metres and seconds, and
//! only some of these can be set. In this way all tolerances, and the settings of contacts, are in units of the robot.

use super::contact::{ContactPart, WorldWrench};
use super::physics::Physics;
use super::servo::Drive;
use super::{Engine, Ground, Pairs};
use nalgebra::{DVector, Isometry3, Point3, UnitQuaternion, Vector3};
use standfast_core::robot::{Posture, Robot, SizeRatio, Units};

/// Height of the COM at home (m), and mass (kg), of the robot that an engine sees. Other values would serve as well.
const COM_HEIGHT_M: f64 = 1.0;
const MASS_KG: f64 = 1.0;

/// The ratios of the robot that an engine sees to the robot itself.
pub fn scale(robot: &Robot) -> SizeRatio {
    let Units {
        mass_kg, length_m, ..
    } = Units::of(robot);
    SizeRatio {
        length: COM_HEIGHT_M / length_m,
        mass: MASS_KG / mass_kg,
    }
}

/// The robot at rest in `posture`, on ground that is still level. `pairs` states which of its links collide with each
/// other.
pub fn start(
    engine: Engine,
    robot: &Robot,
    ground: &Ground,
    pairs: &Pairs,
    posture: &Posture,
    step_s: f64,
) -> Box<dyn Physics> {
    let scale = scale(robot);
    let (robot, ground, posture) = (
        robot.scaled(scale),
        ground.scaled(scale),
        scale.posture(posture),
    );
    Box::new(Similar {
        physics: engine.start(&robot, &ground, pairs, &posture, step_s * scale.time()),
        scale,
    })
}

/// A robot in an engine that simulates a similar one.
#[derive(Clone)]
struct Similar {
    physics: Box<dyn Physics>,
    scale: SizeRatio,
}

impl Physics for Similar {
    fn copy(&self) -> Box<dyn Physics> {
        Box::new(self.clone())
    }

    fn read(&self, posture: &mut Posture, velocity: &mut DVector<f64>) {
        self.physics.read(posture, velocity);
        posture.base.translation.vector /= self.scale.length;
        let time = self.scale.time();
        velocity.rows_mut(0, 3).scale_mut(1.0 / time);
        velocity.rows_range_mut(3..).scale_mut(time);
    }

    fn body(&self, link: usize) -> Isometry3<f64> {
        let mut pose = self.physics.body(link);
        pose.translation.vector /= self.scale.length;
        pose
    }

    fn clear_forces(&mut self) {
        self.physics.clear_forces();
    }

    fn add_force(&mut self, link: usize, force: Vector3<f64>, point: Point3<f64>) {
        self.physics
            .add_force(link, force * self.scale.force(), point * self.scale.length);
    }

    fn set_drives(&mut self, drive: &mut dyn FnMut(usize, f64, f64) -> Drive) {
        let (moment, time) = (self.scale.moment(), self.scale.time());
        self.physics.set_drives(&mut |i, q, dq| {
            let Drive { constant, damping } = drive(i, q, dq * time);
            Drive {
                constant: constant * moment,
                damping: damping * moment * time,
            }
        });
    }

    fn tilt(&mut self, slope: &UnitQuaternion<f64>) {
        self.physics.tilt(slope);
    }

    fn step(&mut self) {
        self.physics.step();
    }

    fn speeds(&self, see: &mut dyn FnMut(usize, f64)) {
        self.physics
            .speeds(&mut |i, dq| see(i, dq * self.scale.time()));
    }

    fn touches(&self, slope: &UnitQuaternion<f64>, see: &mut dyn FnMut(ContactPart, WorldWrench)) {
        let (force, moment) = (self.scale.force(), self.scale.moment());
        self.physics.touches(slope, &mut |part, wrench| {
            see(
                part,
                WorldWrench {
                    force: wrench.force / force,
                    moment: wrench.moment / moment,
                },
            );
        });
    }

    fn meets(&self, see: &mut dyn FnMut([usize; 2], f64)) {
        self.physics
            .meets(&mut |links, force_n| see(links, force_n / self.scale.force()));
    }
}
