//! MuJoCo as a physics engine: the one crate that names it. A program that has it calls [`standfast_sim::engine::add_mujoco`]
//! with [`PARTS`].

mod model;

use model::{GROUND, body_name, mjcf, quaternion};
use mujoco_rs::prelude::{MjData, MjModel, MjtObjBase};
use nalgebra::{
    DVector, Isometry3, Matrix3, Point3, Quaternion, Translation3, UnitQuaternion, Vector3,
};
use standfast_core::error::{Error, Result};
use standfast_core::robot::{Foot, Posture, Robot};
use standfast_sim::Ground;
use standfast_sim::contact::{ContactPart, WorldWrench};
use standfast_sim::engine::EngineParts;
use standfast_sim::meeting::Pairs;
use standfast_sim::physics::Physics;
use standfast_sim::servo::Drive;

/// What the simulation takes of this crate.
pub const PARTS: EngineParts = EngineParts {
    version,
    check,
    start,
};

/// Version of the library that is loaded.
pub fn version() -> &'static str {
    mujoco_rs::mujoco_version()
}

/// Checks that MuJoCo can simulate the robot.
pub fn check(robot: &Robot) -> Result<()> {
    let said =
        match MjModel::from_xml_string(&mjcf(robot, &Ground::default(), &Pairs::new(robot), 0.001))
        {
            Ok(_) => return Ok(()),
            Err(error) => error.to_string(),
        };
    let problem = format!(
        "MuJoCo does not take the robot {}: {}",
        robot.name,
        said.trim().replace('\n', ", ")
    );
    Err(Error::value(
        "engine",
        "--engine",
        "mujoco",
        problem,
        "a robot that MuJoCo takes, or --engine rapier",
    ))
}

/// The robot at rest in `posture`, on ground that is still level. `pairs` states which of its links collide with each
/// other.
pub fn start(
    robot: &Robot,
    ground: &Ground,
    pairs: &Pairs,
    posture: &Posture,
    step_s: f64,
) -> Box<dyn Physics> {
    let model = MjModel::from_xml_string(&mjcf(robot, ground, pairs, step_s))
        .expect("the robot was checked");
    let id = |kind, name: &str| model.name_to_id(kind, name).expect("it is in the model");
    let bodies: Vec<usize> = robot
        .links
        .iter()
        .map(|link| id(MjtObjBase::mjOBJ_BODY, &body_name(link)))
        .collect();
    let joints: Vec<Addresses> = robot
        .joints
        .iter()
        .map(|joint| id(MjtObjBase::mjOBJ_JOINT, &joint.name))
        .map(|joint| Addresses {
            q: model.jnt_qposadr()[joint] as usize,
            dq: model.jnt_dofadr()[joint] as usize,
        })
        .collect();
    let ground_body = id(MjtObjBase::mjOBJ_BODY, GROUND);
    // The solids of a body are in the model in the order in which they were written.
    let mut solids = vec![None; model.ngeom() as usize];
    for (link, &body) in bodies.iter().enumerate() {
        let first = model
            .geom_bodyid()
            .iter()
            .position(|owner| *owner as usize == body);
        let sole = Foot::BOTH
            .into_iter()
            .find(|&foot| robot.soles[foot].link == link);
        for (_, geom) in robot.links[link]
            .collisions
            .iter()
            .zip(first.into_iter().flat_map(|first| first..))
        {
            solids[geom] = Some((
                link,
                sole.map_or(ContactPart::Link(link), ContactPart::Sole),
            ));
        }
    }
    // A clone shares the layout that is known by then. Otherwise each exchange of the models compares their layouts.
    model.layout();
    let spare = Some(Box::new(model.clone()));
    let mut data = MjData::new(Box::new(model));
    let base = posture.base;
    let position = base.translation.vector;
    data.qpos_mut()[..3].copy_from_slice(position.as_slice());
    data.qpos_mut()[3..7].copy_from_slice(&quaternion(&base.rotation));
    for (joint, q) in joints.iter().zip(&posture.q) {
        data.qpos_mut()[joint.q] = *q;
    }
    data.kinematics();
    let rotors = robot
        .servos
        .iter()
        .map(|servo| servo.rotor_inertia_kg_m2)
        .collect();
    Box::new(Mujoco {
        data,
        spare,
        step_s,
        rotors,
        bodies,
        joints,
        solids,
        ground_body,
    })
}

/// The rotation that MuJoCo writes as w, x, y, z.
fn rotation(q: &[f64]) -> UnitQuaternion<f64> {
    UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]))
}

/// Index of a joint in MuJoCo's positions and velocities.
#[derive(Clone, Copy)]
struct Addresses {
    q: usize,
    dq: usize,
}

/// A robot in MuJoCo.
#[derive(Clone)]
struct Mujoco {
    data: MjData<Box<MjModel>>,
    /// A second model, in which the inertia of joints is changed; it then replaces the first.
    spare: Option<Box<MjModel>>,
    step_s: f64,
    /// Rotor inertia of each joint (kg m^2).
    rotors: Vec<f64>,
    bodies: Vec<usize>,
    joints: Vec<Addresses>,
    /// The part of a link to which each solid belongs. It is None for solids of the ground.
    solids: Vec<Option<(usize, ContactPart)>>,
    ground_body: usize,
}

impl Physics for Mujoco {
    fn copy(&self) -> Box<dyn Physics> {
        Box::new(self.clone())
    }

    fn read(&self, posture: &mut Posture, velocity: &mut DVector<f64>) {
        let (q, v) = (self.data.qpos(), self.data.qvel());
        let rotation = rotation(&q[3..]);
        posture.base = Isometry3::from_parts(Translation3::new(q[0], q[1], q[2]), rotation);
        // MuJoCo gives the angular velocity of a free body in the body's axes.
        velocity.fixed_rows_mut::<3>(0).copy_from_slice(&v[..3]);
        velocity
            .fixed_rows_mut::<3>(3)
            .copy_from(&(rotation * Vector3::new(v[3], v[4], v[5])));
        for (i, joint) in self.joints.iter().enumerate() {
            posture.q[i] = q[joint.q];
            velocity[6 + i] = v[joint.dq];
        }
    }

    fn body(&self, link: usize) -> Isometry3<f64> {
        let body = self.bodies[link];
        let rotation = rotation(&self.data.xquat()[body]);
        Isometry3::from_parts(self.data.xpos()[body].into(), rotation)
    }

    fn clear_forces(&mut self) {
        self.data.xfrc_applied_mut().fill([0.0; 6]);
    }

    fn add_force(&mut self, link: usize, force: Vector3<f64>, point: Point3<f64>) {
        let body = self.bodies[link];
        let lever = point - Point3::from(self.data.xipos()[body]);
        let moment = lever.cross(&force);
        for (sum, part) in self.data.xfrc_applied_mut()[body]
            .iter_mut()
            .zip(force.iter().chain(moment.iter()))
        {
            *sum += part;
        }
    }

    fn set_drives(&mut self, drive: &mut dyn FnMut(usize, f64, f64) -> Drive) {
        let mut spare = self.spare.take().expect("always put back");
        for (i, &Addresses { q, dq }) in self.joints.iter().enumerate() {
            let Drive { constant, damping } = drive(i, self.data.qpos()[q], self.data.qvel()[dq]);
            // With the speed at the end of the step, M (v' - v) = h (tau - damping v') is
            // (M + h damping) (v' - v) = h (tau - damping v). MuJoCo's own damping enters after contact forces are
            // found, which then chatter.
            self.data.qfrc_applied_mut()[dq] = constant - damping * self.data.qvel()[dq];
            spare.dof_armature_mut()[dq] = self.rotors[i] + self.step_s * damping;
        }
        // Dampings change only when a motor reaches its limit or leaves it.
        let is_same = spare.dof_armature() == self.data.model().dof_armature();
        self.spare = Some(if is_same {
            spare
        } else {
            self.data.swap_model(spare)
        });
    }

    fn tilt(&mut self, slope: &UnitQuaternion<f64>) {
        let mocap = self.data.model().body_mocapid()[self.ground_body] as usize;
        self.data.mocap_quat_mut()[mocap] = quaternion(slope);
    }

    fn step(&mut self) {
        // MuJoCo writes a file if it meets such numbers. The referee ends the episode.
        let forces = self.data.xfrc_applied().as_flattened();
        let is_sane =
            self.data.qvel().iter().all(|v| v.abs() < 1e6) && forces.iter().all(|f| f.abs() < 1e8);
        if !is_sane {
            self.data.qvel_mut().fill(f64::NAN);
            return;
        }
        // These are the parts of a step without its checks, which would also write that file.
        self.data.forward();
        self.data.euler();
        // Pushes act on the robot where it is now. The contacts remain those of the step.
        self.data.kinematics();
    }

    fn speeds(&self, see: &mut dyn FnMut(usize, f64)) {
        for (i, joint) in self.joints.iter().enumerate() {
            see(i, self.data.qvel()[joint.dq]);
        }
    }

    fn touches(&self, _: &UnitQuaternion<f64>, see: &mut dyn FnMut(ContactPart, WorldWrench)) {
        for (i, contact) in self.data.contact().iter().enumerate() {
            let [first, second] = contact.geom.map(|geom| self.solids[geom as usize]);
            // The normal points from the first solid to the second, and the force acts on the second.
            let (part, sign) = match (first, second) {
                (None, Some((_, part))) => (part, 1.0),
                (Some((_, part)), None) => (part, -1.0),
                _ => continue,
            };
            let axes = Matrix3::from_row_slice(&contact.frame).transpose();
            let wrench = self.data.contact_force(i);
            let force = axes * Vector3::new(wrench[0], wrench[1], wrench[2]) * sign;
            let moment = Vector3::from(contact.pos).cross(&force);
            see(part, WorldWrench { force, moment });
        }
    }

    fn meets(&self, see: &mut dyn FnMut([usize; 2], f64)) {
        for (i, contact) in self.data.contact().iter().enumerate() {
            if let [Some((first, _)), Some((second, _))] =
                contact.geom.map(|geom| self.solids[geom as usize])
            {
                let [x, y, z, ..] = self.data.contact_force(i);
                let force_n = Vector3::new(x, y, z).norm();
                if force_n > 0.0 {
                    see([first, second], force_n);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_library_is_of_the_version_that_is_asked_for() {
        assert_eq!(version(), standfast_sim::MUJOCO_VERSION);
    }
}
