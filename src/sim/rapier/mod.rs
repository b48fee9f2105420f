//! The robot as a Rapier multibody. This is the only module that names Rapier.

mod contact;
mod convert;
mod joint;
pub mod shape;
mod world;

use super::Ground;
use super::contact::{ContactPart, WorldWrench};
use super::meeting::Pairs;
use super::physics::Physics;
use super::servo::Drive;
use contact::{force_n, ground_wrench};
use convert::{pose_from_rapier, rotation_to_rapier, vec_to_rapier};
use nalgebra::{DVector, Isometry3, Point3, UnitQuaternion, Vector3};
use rapier3d::dynamics::Multibody;
use standfast_core::robot::{Foot, Posture, Robot};
use world::{GROUND, Handles, RapierWorld, build};

pub const VERSION: &str = rapier3d::VERSION;

/// The robot at rest in `posture`, on ground that is still level. `pairs` states which of its links collide with each
/// other.
pub fn start(
    robot: &Robot,
    ground: &Ground,
    pairs: &Pairs,
    posture: &Posture,
    step_s: f64,
) -> Box<dyn Physics> {
    let (world, handles) = build(robot, ground, pairs, posture, step_s);
    let joints = robot
        .joints
        .iter()
        .map(|joint| (joint.lower_rad, joint.upper_rad))
        .collect();
    Box::new(Rapier {
        world,
        handles,
        joints,
        step_s,
    })
}

/// A robot in a Rapier world.
#[derive(Clone)]
struct Rapier {
    world: RapierWorld,
    handles: Handles,
    /// Lower and upper limit of each joint (rad).
    joints: Vec<(f64, f64)>,
    step_s: f64,
}

impl Rapier {
    fn multibody(&self) -> &Multibody {
        self.world
            .physics
            .multibody_joints
            .get_multibody(self.handles.multibody)
            .expect("never removed")
    }
}

impl Physics for Rapier {
    fn copy(&self) -> Box<dyn Physics> {
        Box::new(self.clone())
    }

    fn read(&self, posture: &mut Posture, velocity: &mut DVector<f64>) {
        let multibody = self.multibody();
        let root = pose_from_rapier(multibody.root().local_to_world());
        posture.base = root * self.handles.root_com.inverse();
        let v = multibody.generalized_velocity();
        let component = |i: usize| f64::from(v[i]);
        let angular = Vector3::new(component(3), component(4), component(5));
        let lever = posture.base.translation.vector - root.translation.vector;
        let linear = Vector3::new(component(0), component(1), component(2)) + angular.cross(&lever);
        velocity.fixed_rows_mut::<3>(0).copy_from(&linear);
        velocity.fixed_rows_mut::<3>(3).copy_from(&angular);
        for i in 0..self.joints.len() {
            let link = multibody.link(i + 1).expect("one link per joint");
            posture.q[i] = joint::angle(link);
            velocity[6 + i] = component(link.assembly_id());
        }
    }

    fn body(&self, link: usize) -> Isometry3<f64> {
        pose_from_rapier(self.world.physics.bodies[self.handles.bodies[link]].position())
    }

    fn clear_forces(&mut self) {
        for body in &self.handles.bodies {
            self.world.physics.bodies[*body].reset_forces(true);
            self.world.physics.bodies[*body].reset_torques(true);
        }
    }

    fn add_force(&mut self, link: usize, force: Vector3<f64>, point: Point3<f64>) {
        let body = &mut self.world.physics.bodies[self.handles.bodies[link]];
        body.add_force_at_point(vec_to_rapier(&force), vec_to_rapier(&point.coords), true);
    }

    fn set_drives(&mut self, drive: &mut dyn FnMut(usize, f64, f64) -> Drive) {
        let multibody = self
            .world
            .physics
            .multibody_joints
            .get_multibody_mut(self.handles.multibody)
            .expect("never removed");
        for (i, &(lower_rad, upper_rad)) in self.joints.iter().enumerate() {
            let dof = multibody
                .link(i + 1)
                .expect("one link per joint")
                .assembly_id();
            let dq = f64::from(multibody.generalized_velocity()[dof]);
            let link = multibody.link_mut(i + 1).expect("one link per joint");
            let drive = drive(i, joint::angle(link), dq);
            joint::guard_limits(link, lower_rad, upper_rad);
            joint::install(link, drive);
            multibody.damping_mut()[dof] = drive.damping as f32;
        }
    }

    fn tilt(&mut self, slope: &UnitQuaternion<f64>) {
        self.world.physics.bodies[self.handles.floor]
            .set_next_kinematic_rotation(rotation_to_rapier(slope));
    }

    fn step(&mut self) {
        self.world.step();
    }

    fn speeds(&self, see: &mut dyn FnMut(usize, f64)) {
        let multibody = self.multibody();
        for i in 0..self.joints.len() {
            let dof = multibody
                .link(i + 1)
                .expect("one link per joint")
                .assembly_id();
            see(i, f64::from(multibody.generalized_velocity()[dof]));
        }
    }

    fn touches(&self, slope: &UnitQuaternion<f64>, see: &mut dyn FnMut(ContactPart, WorldWrench)) {
        let Handles { ground, soles, .. } = &self.handles;
        let narrow_phase = &self.world.physics.narrow_phase;
        let pairs = ground.iter().flat_map(|part| {
            narrow_phase
                .contact_pairs_with(part.0)
                .map(move |pair| (part, pair))
        });
        for ((part, pose), pair) in pairs {
            let other = if pair.collider1 == *part {
                pair.collider2
            } else {
                pair.collider1
            };
            let wrench = ground_wrench(pair, *part, &(slope * pose), self.step_s);
            let link = ContactPart::Link(self.world.physics.colliders[other].user_data as usize);
            let sole = Foot::BOTH
                .into_iter()
                .find(|&foot| soles[foot].contains(&other));
            see(sole.map_or(link, ContactPart::Sole), wrench);
        }
    }
    fn meets(&self, see: &mut dyn FnMut([usize; 2], f64)) {
        for pair in self
            .world
            .physics
            .narrow_phase
            .contact_pairs()
            .filter(|pair| pair.has_any_active_contact())
        {
            let parts = [pair.collider1, pair.collider2]
                .map(|collider| self.world.physics.colliders[collider].user_data);
            let force_n = force_n(pair, self.step_s);
            if force_n > 0.0 && !parts.contains(&GROUND) {
                see(parts.map(|link| link as usize), force_n);
            }
        }
    }
}
