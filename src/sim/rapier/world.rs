//! Builds the Rapier world: the robot as one multibody, on its ground.

use super::convert::{pose_to_rapier, rotation_to_rapier, vec_to_rapier};
use super::shape::{placed, standing};
use crate::Ground;
use crate::meeting::{self, Pairs};
use nalgebra::{Isometry3, Rotation3, Unit, UnitQuaternion, Vector3};
use rapier3d::dynamics::MultibodyIndex;
use rapier3d::parry::mass_properties::MassProperties;
use rapier3d::prelude::*;
use standfast_core::robot::{Foot, Joint, PerFoot, Posture, Robot};

/// A Rapier world that can be copied. A copy continues to the same bits, because everything that lasts from step to
/// step is copied. The pipeline is only working memory.
pub struct RapierWorld {
    pub physics: PhysicsWorld,
    filter: Filter,
}

/// Decides which colliders collide. The `user_data` of a collider is the index of its link, or [`GROUND`].
#[derive(Clone)]
struct Filter(Pairs);

/// `user_data` of the ground's colliders.
pub const GROUND: u128 = u128::MAX;

/// The collision group of a limb. By the groups, Rapier discards early most pairs that do not collide. Limbs beyond the
/// 30th share a group.
fn group(limb: usize) -> Group {
    Group::from_bits_truncate(1 << limb.min(30))
}

fn groups(pairs: &Pairs, link: usize) -> InteractionGroups {
    let meets = pairs.of(link).fold(GROUND_GROUP, |meets, other| {
        meets | group(pairs.limbs[other])
    });
    InteractionGroups::new(group(pairs.limbs[link]), meets, InteractionTestMode::And)
}

const GROUND_GROUP: Group = Group::GROUP_32;

impl PhysicsHooks for Filter {
    fn filter_contact_pair(&self, pair: &PairFilterContext) -> Option<SolverFlags> {
        let collides = match [pair.collider1, pair.collider2]
            .map(|collider| pair.colliders[collider].user_data)
        {
            [GROUND, _] | [_, GROUND] => true,
            [a, b] => self.0.collide(a as usize, b as usize),
        };
        collides.then(SolverFlags::default)
    }
}

impl RapierWorld {
    /// Does one physics step.
    pub fn step(&mut self) {
        self.physics.step_with_events(&self.filter, &());
    }
}

impl Clone for RapierWorld {
    fn clone(&self) -> Self {
        let physics = PhysicsWorld {
            gravity: self.physics.gravity,
            integration_parameters: self.physics.integration_parameters,
            islands: self.physics.islands.clone(),
            broad_phase: self.physics.broad_phase.clone(),
            narrow_phase: self.physics.narrow_phase.clone(),
            bodies: self.physics.bodies.clone(),
            colliders: self.physics.colliders.clone(),
            impulse_joints: self.physics.impulse_joints.clone(),
            multibody_joints: self.physics.multibody_joints.clone(),
            ..PhysicsWorld::default()
        };
        Self {
            physics,
            filter: self.filter.clone(),
        }
    }
}

/// Handles into a Rapier world with one robot.
#[derive(Clone)]
pub struct Handles {
    pub multibody: MultibodyIndex,
    /// One rigid body for each link of the robot.
    pub bodies: Vec<RigidBodyHandle>,
    /// The body that carries the ground. Its frame is the frame of the ground's plane.
    pub floor: RigidBodyHandle,
    /// The colliders of the ground, with their poses in the frame of the ground's plane.
    pub ground: Vec<(ColliderHandle, Isometry3<f64>)>,
    pub soles: PerFoot<Vec<ColliderHandle>>,
    /// Transform from the root's URDF frame to the frame of its Rapier body. The frame of the body is at the root's
    /// centre of mass, because a floating multibody with an offset there drifts.
    pub root_com: Isometry3<f64>,
}

/// Solver settings for contact forces that are accurate enough to measure a ZMP, for a robot whose COM is 1 m high.
fn integration_parameters(step_s: f64) -> IntegrationParameters {
    const LENGTH_UNIT_M: Real = 0.4;
    let contact = SpringCoefficients {
        natural_frequency: 33.5,
        damping_ratio: 10.0,
    };
    let usual = IntegrationParameters::default();
    IntegrationParameters {
        dt: step_s as Real,
        // With one substep the contact impulses are the impulses of the whole step.
        num_solver_iterations: 1,
        num_internal_pgs_iterations: 4,
        num_internal_stabilization_iterations: 1,
        max_ccd_substeps: 0,
        // With up to seven times this frequency (Hz), campaigns have the same results, which are also those in MuJoCo.
        // With half of this frequency, controllers that press on the edges of the soles lose five more pushes in a
        // hundred.
        contact_softness: contact,
        static_contact_softness: contact,
        // Rapier looks for contacts of all colliders within 0.08 of this unit. With 3 m, each link of a robot is near
        // all others, and an episode costs 5 % more. The lengths (m) and speeds (m/s) below do not depend on this unit.
        length_unit: LENGTH_UNIT_M,
        normalized_allowed_linear_error: 0.016 / LENGTH_UNIT_M,
        normalized_max_corrective_velocity: 5.0 / LENGTH_UNIT_M,
        normalized_max_linear_velocity: 700.0 / LENGTH_UNIT_M,
        normalized_prediction_distance: 0.0065 / LENGTH_UNIT_M,
        friction_in_bias_pass: false,
        // The contact points must belong to this step, and not to a pose up to 5 cm away.
        contact_recycling: false,
        contact_clustering: false,
        ..usual
    }
}

/// A world with gravity along -z, with `robot` in `posture` and with `ground`, which is still level. `pairs` states
/// which links of the robot collide with each other.
pub fn build(
    robot: &Robot,
    ground: &Ground,
    pairs: &Pairs,
    posture: &Posture,
    step_s: f64,
) -> (RapierWorld, Handles) {
    let mut world = PhysicsWorld {
        gravity: Vector::new(0.0, 0.0, -standfast_core::robot::GRAVITY as Real),
        integration_parameters: integration_parameters(step_s),
        ..PhysicsWorld::default()
    };
    let floor = if ground.is_level() {
        RigidBodyBuilder::fixed()
    } else {
        RigidBodyBuilder::kinematic_position_based()
    };
    let floor = world.insert_body(floor);
    let half_space = (
        ColliderBuilder::halfspace(Unit::new_unchecked(Vector::Z)),
        ground.half_space(),
    );
    let boxes = ground.boxes().into_iter().map(|(pose, half)| {
        (
            ColliderBuilder::cuboid(half.x as Real, half.y as Real, half.z as Real),
            pose,
        )
    });
    let ground = std::iter::once(half_space)
        .chain(boxes)
        .map(|(builder, pose)| {
            let collider = builder
                .position(pose_to_rapier(&pose))
                // This number times the friction of a link is the friction between sole and ground.
                .friction((robot.friction / meeting::FRICTION) as Real)
                .friction_combine_rule(CoefficientCombineRule::Multiply)
                .collision_groups(InteractionGroups::new(
                    GROUND_GROUP,
                    Group::ALL,
                    InteractionTestMode::And,
                ))
                .user_data(GROUND);
            (world.insert_collider(collider, Some(floor)), pose)
        })
        .collect();

    let root_com = Isometry3::from_parts(
        robot.links[0].com_m.coords.into(),
        UnitQuaternion::identity(),
    );
    let mut bodies = Vec::with_capacity(robot.links.len());
    let mut soles = PerFoot::from_fn(|_| Vec::new());
    for (i, link) in robot.links.iter().enumerate() {
        let offset = if i == 0 {
            root_com
        } else {
            Isometry3::identity()
        };
        let com = offset.inverse_transform_point(&link.com_m);
        let principal = link.inertia_kg_m2.symmetric_eigen();
        let mut axes = principal.eigenvectors;
        if axes.determinant() < 0.0 {
            axes.column_mut(2).neg_mut();
        }
        let frame = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
        let mass = MassProperties::with_principal_inertia_frame(
            vec_to_rapier(&com.coords),
            link.mass_kg as Real,
            vec_to_rapier(&principal.eigenvalues),
            rotation_to_rapier(&frame),
        );
        let pose = if i == 0 {
            posture.base * root_com
        } else {
            Isometry3::identity()
        };
        let body = world.insert_body(
            RigidBodyBuilder::dynamic()
                .pose(pose_to_rapier(&pose))
                .additional_mass_properties(mass)
                // A sleeping robot would ignore its servos.
                .can_sleep(false),
        );
        let foot = Foot::BOTH
            .into_iter()
            .find(|&foot| robot.soles[foot].link == i);
        for solid in &link.collisions {
            let pose = offset.inverse() * solid.pose;
            let shapes = match foot {
                Some(foot) => standing(
                    &solid.shape,
                    pose,
                    &(robot.soles[foot].center.rotation * -Vector3::z()),
                ),
                None => vec![placed(&solid.shape, pose)],
            };
            for shape in shapes {
                let collider = collider(shape)
                    .user_data(i as u128)
                    .collision_groups(groups(pairs, i));
                let handle = world.insert_collider(collider, Some(body));
                if let Some(foot) = foot {
                    soles[foot].push(handle);
                }
            }
        }
        let colliders = &world.colliders;
        world.bodies[body].recompute_mass_properties_from_colliders(colliders);
        bodies.push(body);
    }
    for (i, joint) in robot.joints.iter().enumerate() {
        let parent_offset = if joint.parent == 0 {
            root_com
        } else {
            Isometry3::identity()
        };
        world
            .insert_multibody_joint(
                bodies[joint.parent],
                bodies[i + 1],
                revolute(joint, &parent_offset),
            )
            .expect("a tree of links makes a tree of joints");
    }
    let multibody = world
        .multibody_joints
        .rigid_body_link(bodies[0])
        .expect("the root has joints")
        .multibody;
    place(&mut world, multibody, robot, posture);
    let world = RapierWorld {
        physics: world,
        filter: Filter(pairs.clone()),
    };
    (
        world,
        Handles {
            multibody,
            bodies,
            floor,
            ground,
            soles,
            root_com,
        },
    )
}

fn collider((shape, pose): (SharedShape, Isometry3<f64>)) -> ColliderBuilder {
    ColliderBuilder::new(shape)
        .position(pose_to_rapier(&pose))
        .density(0.0)
        .friction(meeting::FRICTION as Real)
        .friction_combine_rule(CoefficientCombineRule::Min)
        .active_hooks(ActiveHooks::FILTER_CONTACT_PAIRS)
}

/// A revolute joint. Rapier's free axis is x, so both frames contain the rotation from x to the joint's axis.
fn revolute(joint: &Joint, parent_offset: &Isometry3<f64>) -> GenericJoint {
    let to_axis =
        UnitQuaternion::rotation_between(&Vector3::x(), &joint.axis).unwrap_or_else(|| {
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), std::f64::consts::PI)
        });
    let frame1 = parent_offset.inverse() * joint.origin * to_axis;
    let frame2 = Isometry3::from_parts(Vector3::zeros().into(), to_axis);
    let mut data = GenericJointBuilder::new(JointAxesMask::LOCKED_REVOLUTE_AXES)
        .local_frame1(pose_to_rapier(&frame1))
        .local_frame2(pose_to_rapier(&frame2))
        .limits(
            JointAxis::AngX,
            [joint.lower_rad as Real, joint.upper_rad as Real],
        )
        .build();
    // Limits cost a solver row even while they do not act, so the servos switch them on near a limit.
    data.limit_axes = JointAxesMask::empty();
    data
}

/// Sets joint angles, rotor inertias and dry friction, and removes Rapier's damping.
fn place(world: &mut PhysicsWorld, index: MultibodyIndex, robot: &Robot, posture: &Posture) {
    let multibody = world
        .multibody_joints
        .get_multibody_mut(index)
        .expect("just inserted");
    // Rapier's default damping would also act on the floating base.
    multibody.damping_mut().fill(0.0);
    let mut displacement = vec![0.0; multibody.ndofs()];
    for (i, &q) in posture.q.iter().enumerate() {
        let dof = multibody
            .link(i + 1)
            .expect("one link per joint")
            .assembly_id();
        displacement[dof] = q as Real;
        multibody.armature_mut()[dof] = robot.servos[i].rotor_inertia_kg_m2 as Real;
        multibody.frictions_mut()[dof] = robot.servos[i].friction_n_m as Real;
    }
    multibody.forward_kinematics(&world.bodies, true);
    multibody.apply_displacements(&displacement);
    multibody.forward_kinematics(&world.bodies, false);
    multibody.update_rigid_bodies(&mut world.bodies, true);
}
