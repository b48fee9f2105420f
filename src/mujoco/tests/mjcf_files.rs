//! MJCF files as this program reads them are those that MuJoCo compiles.

use mujoco_rs::prelude::{MjData, MjModel, MjtObjBase};
use nalgebra::{Isometry3, Vector3};
use standfast_core::robot::{Kinematics, Posture};
use std::path::Path;

/// The G1's files: masses, places and axes of joints, limits, armature, friction and damping.
#[test]
fn a_robot_is_as_mujoco_compiles_it() {
    let folder = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../../shared/data/robots/g1/"
    );
    if !Path::new(folder).is_dir() {
        return eprintln!("not compared: there is no {folder}");
    }
    for name in ["g1_29dof_rev_1_0.xml", "g1_29dof_holosoma.xml"] {
        let file = format!("{folder}{name}");
        let robot = standfast_robots::load(&file).unwrap();
        // The second file names the floor of a scene that includes it.
        let floor = match name {
            "g1_29dof_holosoma.xml" => "<geom name='floor' type='plane' size='1 1 1'/>",
            _ => "",
        };
        let scene = format!(
            "<mujoco><worldbody>{floor}</worldbody>\
             <include file='{file}'/><compiler meshdir='{folder}meshes'/></mujoco>"
        );
        let model = MjModel::from_xml_string(&scene).unwrap();
        let mut data = MjData::new(&model);
        // The file may place its base above the ground. Here it is at the origin.
        let qpos = data.qpos_mut();
        qpos.fill(0.0);
        qpos[3] = 1.0;
        data.forward();
        let kinematics = Kinematics::at(
            &robot,
            &Posture {
                base: Isometry3::identity(),
                q: vec![0.0; robot.joints.len()],
            },
        );
        let mass_kg = model.body_subtreemass()[1];
        assert!((robot.mass() / mass_kg - 1.0).abs() < 1e-9, "{name}");
        let com = Vector3::from(data.subtree_com()[1]);
        assert!((kinematics.com().coords - com).norm() < 1e-9, "{name}");
        assert_eq!(model.ffi().njnt as usize, robot.joints.len() + 1);
        for (j, joint) in robot.joints.iter().enumerate() {
            let id = model
                .name_to_id(MjtObjBase::mjOBJ_JOINT, &joint.name)
                .unwrap();
            let dof = model.jnt_dofadr()[id] as usize;
            let at = Vector3::from(data.xanchor()[id]) - kinematics.joint_position(j).coords;
            let axis = Vector3::from(data.xaxis()[id]) - kinematics.joint_axis(j);
            let servo = &robot.servos[j];
            let stated = [
                (model.jnt_range()[id][0], joint.lower_rad),
                (model.jnt_range()[id][1], joint.upper_rad),
                (model.dof_frictionloss()[dof], servo.friction_n_m),
                (model.dof_damping()[dof], servo.damping_n_m_s_rad),
                // Where a file states no armature, one is assumed.
                (
                    model.dof_armature()[dof],
                    match robot.motor_origins[j].rotor_inertia.as_str() {
                        "read" => servo.rotor_inertia_kg_m2,
                        _ => 0.0,
                    },
                ),
            ];
            assert!(
                at.norm() < 1e-9 && axis.norm() < 1e-9,
                "{name} {}",
                joint.name
            );
            for (of_mujoco, own) in stated {
                assert!(
                    (of_mujoco - own).abs() < 1e-9,
                    "{name} {}: {own}, not {of_mujoco}",
                    joint.name
                );
            }
        }
    }
}
