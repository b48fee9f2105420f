//! Descriptions of policies, each with an observation that was computed apart (in NumPy) as the deployment of its trainer
//! does it.

use super::known::Training;
use super::{described, yaml};
use crate::ActionClip;
use crate::observation::{Base, Memory, Observation};
use nalgebra::{UnitQuaternion, Vector3};
use standfast_core::robot::{PerFoot, Robot};
use standfast_core::socket::{Imu, Sensed, Wrench};
use std::path::{Path, PathBuf};

/// The state of the robot at an action: roll, pitch and yaw (rad), gyro (rad/s), angles (rad) and speeds (rad/s) of the
/// first two joints, and the action.
struct State {
    rpy_rad: [f64; 3],
    gyro_rad_s: [f64; 3],
    q: [f64; 2],
    dq: [f64; 2],
    action: [f32; 2],
}

const STATES: [State; 3] = [
    State {
        rpy_rad: [0.1, -0.2, 0.3],
        gyro_rad_s: [1.0, -2.0, 3.0],
        q: [0.5, -0.25],
        dq: [4.0, -6.0],
        action: [0.3, -0.7],
    },
    State {
        rpy_rad: [-0.3, 0.2, 0.1],
        gyro_rad_s: [-0.5, 0.25, 2.0],
        q: [0.1, 0.75],
        dq: [-1.0, 2.0],
        action: [1.25, 0.4],
    },
    State {
        rpy_rad: [0.2, 0.05, -0.6],
        gyro_rad_s: [0.1, 0.2, -0.3],
        q: [-0.4, 0.6],
        dq: [0.5, -3.0],
        action: [0.0, 0.0],
    },
];
const COMMAND: [f64; 3] = [0.5, -0.2, 0.1];

/// A robot whose IMU is in its base, and the names of its first two joints. It holds the second of them at 0.55 rad.
fn robot() -> (Robot, [String; 2]) {
    let mut robot = standfast_robots::load("ut-mu2").unwrap();
    robot.trunk = 0;
    robot.home_rad[1] = 0.55;
    let names = [0, 1].map(|joint| robot.joints[joint].name.clone());
    (robot, names)
}

/// The observation of the last state.
fn observed(training: &Training, robot: &Robot) -> Vec<f32> {
    let joints = &training.joints.value;
    let (seen, from_rad) = match &training.observed {
        Some(observed) => (&observed.value.joints, &observed.value.default_rad),
        None => (joints, &training.default_rad.value),
    };
    let place = |name: &String| robot.joints.iter().position(|joint| joint.name == *name);
    let seen: Vec<usize> = seen.iter().map(|name| place(name).unwrap()).collect();
    let (terms, gait) = (
        &training.observation.value,
        training.gait.as_ref().map(|gait| &gait.value),
    );
    let mut memory = Memory::new(terms, gait, COMMAND, joints.len());
    let mut base = Base::new(robot);
    let mut last = Vec::new();
    for state in &STATES {
        let [roll, pitch, yaw] = state.rpy_rad;
        let (mut q, mut dq) = (robot.home_rad.clone(), vec![0.0; robot.joints.len()]);
        q[..2].copy_from_slice(&state.q);
        dq[..2].copy_from_slice(&state.dq);
        let sensed = Sensed {
            time_s: 0.0,
            q,
            dq,
            imu: Imu {
                orientation: UnitQuaternion::from_euler_angles(roll, pitch, yaw),
                gyro: Vector3::from(state.gyro_rad_s),
                accelerometer: Vector3::zeros(),
            },
            soles: PerFoot::from_fn(|_| Wrench::default()),
        };
        base.update(robot, &sensed);
        let now = Observation {
            base: &base,
            command: COMMAND,
            joint_positions: seen
                .iter()
                .zip(from_rad)
                .map(|(&joint, from)| sensed.q[joint] - from)
                .collect(),
            joint_velocities: seen.iter().map(|&joint| sensed.dq[joint]).collect(),
        };
        last = memory.observe(terms, training.frames, &now).concat();
        let action = state.action[..joints.len()].to_vec();
        memory.remember(action, gait, COMMAND, training.period_s.value);
    }
    last
}

fn assert_near(found: &[f32], wanted: &[f64]) {
    let near = |(found, wanted): (&f32, &f64)| (f64::from(*found) - wanted).abs() < 1e-5;
    assert!(
        found.len() == wanted.len() && found.iter().zip(wanted).all(near),
        "{found:?}\nwanted {wanted:?}"
    );
}

fn read(text: &str, robot: &Robot) -> Training {
    let training = yaml::training("f.yaml", text, robot).unwrap();
    training.check().unwrap();
    training
}

/// The folder with the public policies. It is None if the folder does not exist.
fn public() -> Option<PathBuf> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/policies");
    if !data.is_dir() {
        eprintln!("left out: there are no public policies");
    }
    data.is_dir().then_some(data)
}

/// A configuration of HumanoidVerse of two joints, the second one of the upper body.
fn humanoidverse(more: &str) -> String {
    format!(
        "JOINT_KP: [100, 20]\nJOINT_KD: [2.5, 0.5]\nDEFAULT_DOF_ANGLES: [-0.1, 0.3]\nNUM_UPPER_BODY_JOINTS: 1\nGAIT_PERIOD: 0.9\n\
         motor_effort_limit_list: [88, 25]\nobs_scales: {{base_ang_vel: 0.25, command_base_height: 2, dof_vel: 0.05, \
         actions: 1, command_stand: 1, cos_phase: 1, dof_pos: 1, projected_gravity: 1, ref_upper_dof_pos: 1, sin_phase: 1, \
         command_lin_vel: 1, command_ang_vel: 1, command_waist_dofs: 1}}\n{more}"
    )
}

const ASAP: &str = "obs_dims: {actions: 2, dof_pos: 2}\nobs_loco_dims: {actions: 1, dof_pos: 2, ref_upper_dof_pos: 1}\n\
    history_loco_height_config: {base_ang_vel: 2, projected_gravity: 2, command_base_height: 2, command_stand: 2,\n\
    \x20 ref_upper_dof_pos: 2, dof_pos: 2, actions: 2, sin_phase: 2, cos_phase: 2, # phase_time: 4\n}\n";
const FALCON: &str = "obs_dims: {actions: 2, dof_pos: 2}\nresidual_upper_body_action: True\nDESIRED_BASE_HEIGHT: 0.75\n\
    history_length_dict: {actor_obs: 2}\nobs_dict: {actor_obs: [base_ang_vel, projected_gravity, command_lin_vel,\n\
    \x20 command_ang_vel, command_stand, command_base_height, command_waist_dofs, ref_upper_dof_pos, dof_pos, dof_vel, actions]}\n";

#[test]
fn a_policy_of_the_lower_body_sees_its_past_behind_the_present_as_in_asap() {
    let (robot, names) = robot();
    let training = read(&humanoidverse(ASAP), &robot);
    assert_eq!(training.joints.value, names[..1]);
    assert_eq!(training.torque_n_m.as_ref().unwrap().value, [88.0]);
    let wanted = [
        1.25, 0.025, 0.05, -0.075, 1.56, 0.0, 0.961262, -0.3, 0.3, 0.3, 0.0, -0.125, 0.0625, 0.5,
        0.25, -0.5, 0.75, 1.56, 1.56, 0.0, 0.0, 0.990268, 1.0, 0.2, 0.45, 0.6, -0.55, 0.198669,
        0.289629, -0.936293, -0.198669, -0.0978434, -0.97517, 0.25, 0.25, 0.139173, 0.0, 0.0499792,
        -0.198421, -0.978842, 0.25, 0.275637,
    ];
    assert_near(&observed(&training, &robot), &wanted);
    let gait = training.gait.unwrap().value;
    assert_eq!(gait.seen([1.0; 2], [0.0; 3])[0], [1.0, 0.0]);
}

#[test]
fn a_policy_of_all_joints_sees_whole_frames_as_in_falcon() {
    let (robot, names) = robot();
    let training = read(&humanoidverse(FALCON), &robot);
    assert_eq!(training.joints.value, names);
    assert_eq!(training.action_scale.value, [0.25; 2]);
    let wanted = [
        0.3, -0.7, -0.125, 0.0625, 0.5, 0.1, 1.5, 0.5, -0.2, 0.0, 0.0, 0.0, 0.0, 0.2, 0.45, -0.05,
        0.1, 0.198669, 0.289629, -0.936293, 0.3, 1.25, 0.4, 0.025, 0.05, -0.075, 0.1, 1.5, 0.5,
        -0.2, 0.0, 0.0, 0.0, 0.0, -0.3, 0.3, 0.025, -0.15, 0.0499792, -0.198421, -0.978842, 0.3,
    ];
    assert_near(&observed(&training, &robot), &wanted);
    // Before the start there are zeros.
    assert!(training.frames.zero_before && !training.frames.newest_first);
}

#[test]
fn the_limits_of_the_motors_decide_on_the_order_of_joints() {
    let (robot, [one, other]) = robot();
    let limits = |joint: usize| [robot.joints[joint].lower_rad, robot.joints[joint].upper_rad];
    let ([low, high], [other_low, other_high]) = (limits(0), limits(1));
    let more = format!(
        "{FALCON}dof_names: [{other}, {one}]\ndof_names_upper_body: [{one}]\n\
         motor_pos_lower_limit_list: [{low}, {other_low}]\nmotor_pos_upper_limit_list: [{high}, {other_high}]\n"
    );
    let joints = read(&humanoidverse(&more), &robot).joints;
    assert_eq!(joints.value, [one.clone(), other.clone()]);
    assert!(joints.origin.contains("in that of dof_names they do not"));
    let swapped = more
        .replace(
            &format!("[{low}, {other_low}]"),
            &format!("[{other_low}, {low}]"),
        )
        .replace(
            &format!("[{high}, {other_high}]"),
            &format!("[{other_high}, {high}]"),
        );
    assert_ne!(swapped, more, "the two joints have the same limits");
    let joints = read(&humanoidverse(&swapped), &robot).joints;
    assert_eq!(
        (joints.value, &joints.origin[..]),
        (vec![other, one], "read")
    );
}

/// A configuration of rl_sar of two joints, in the other order than its robot's.
fn rl_sar(priority: &str, more: &str) -> String {
    format!(
        "mu2/legged_gym:\n  num_observations: 15\n  observations: [\"ang_vel\", \"gravity_vec\", \"commands\", \"dof_pos\", \
         \"dof_vel\", \"actions\"]\n  observations_history: [0, 1]\n  observations_history_priority: \"{priority}\"\n\
         \x20 clip_obs: 1.5\n  clip_actions_lower: [-1, -2]\n  clip_actions_upper: [3, 4]\n  rl_kp: [57, 43]\n\
         \x20 rl_kd: [5.7, 4.3]\n  action_scale: [1.0, 0.5]\n  wheel_indices: []\n  ang_vel_scale: 0.25\n\
         \x20 dof_pos_scale: 1.0\n  dof_vel_scale: 0.5\n  commands_scale: [2.0, 2.0, 0.25]\n  torque_limits: [60, 45]\n\
         \x20 default_dof_pos: [0.3, -0.1]\n  joint_mapping: [1, 0]\n{more}"
    )
}

#[test]
fn frames_or_terms_are_stacked_as_in_rl_sar_and_the_robot_is_read_from_base_yaml() {
    let (robot, [one, other]) = robot();
    let folder = tempfile::tempdir().unwrap();
    let base = format!("mu2:\n  dt: 0.005\n  decimation: 4\n  joint_names: [{one}, {other}]\n");
    std::fs::write(folder.path().join("base.yaml"), base).unwrap();
    let config = folder.path().join("legged_gym/config.yaml");
    std::fs::create_dir(config.parent().unwrap()).unwrap();
    let by_time = [
        0.025, 0.05, -0.075, 0.0499792, -0.198421, -0.978842, 1.0, -0.4, 0.025, 0.3, -0.3, -1.5,
        0.25, 1.25, 0.4, -0.125, 0.0625, 0.5, 0.198669, 0.289629, -0.936293, 1.0, -0.4, 0.025,
        0.45, 0.2, 1.0, -0.5, 0.3, -0.7,
    ];
    let by_term = [
        0.025, 0.05, -0.075, -0.125, 0.0625, 0.5, 0.0499792, -0.198421, -0.978842, 0.198669,
        0.289629, -0.936293, 1.0, -0.4, 0.025, 1.0, -0.4, 0.025, 0.3, -0.3, 0.45, 0.2, -1.5, 0.25,
        1.0, -0.5, 1.25, 0.4, 0.3, -0.7,
    ];
    for (priority, wanted) in [("time", by_time), ("term", by_term)] {
        std::fs::write(&config, rl_sar(priority, "")).unwrap();
        let training = described(&config, &robot).unwrap();
        training.check().unwrap();
        assert_eq!(training.joints.value, [other.clone(), one.clone()]);
        assert!((training.period_s.value - 0.02).abs() < 1e-12);
        let clip = training.action_clip.as_ref().unwrap();
        assert!(
            matches!(&clip.value, ActionClip::Each { lower, upper } if *lower == [-1.0, -2.0] && *upper == [3.0, 4.0])
        );
        assert_near(&observed(&training, &robot), &wanted);
    }
}

/// The descriptors of a policy that drives the first joint and sees two.
fn descriptors_of([one, other]: &[String; 2]) -> String {
    format!(
        "actions:\n- full_path: isaaclab.envs.mdp.actions.joint_actions.JointPositionAction\n  joint_names: [{one}]\n\
         \x20 scale: 0.5\n  offset: [-0.10000000149011612]\n  clip: null\narticulations:\n  robot:\n    joint_names: [{other}, {one}]\n\
         \x20   default_joint_pos: [0.3, -0.1]\n    default_joint_stiffness: [20, 100]\n    default_joint_damping: [0.5, 2.5]\n\
         \x20   default_joint_armature: [0.02, 0.03]\nobservations:\n  policy:\n\
         \x20 - {{name: base_ang_vel, shape: [3], overloads: {{clip: [-1.5, 1.5], scale: 0.2, history_length: 2}}}}\n\
         \x20 - {{name: joint_pos_rel, shape: [2], joint_names: [{other}, {one}], joint_pos_offsets: [0.3, -0.1], overloads: {{}}}}\n\
         \x20 - {{name: last_action, shape: [1], overloads: {{clip: null, scale: null, history_length: 3}}}}\n\
         scene: {{decimation: 4, dt: 0.02, physics_dt: 0.005}}\n"
    )
}

#[test]
fn terms_are_clipped_scaled_and_stacked_as_in_isaac_lab() {
    let (robot, names) = robot();
    let text = descriptors_of(&names);
    let training = read(&text, &robot);
    let [stiffness, damping] = [&training.stiffness.value, &training.damping.value];
    assert_eq!((&stiffness[..], &damping[..]), (&[100.0][..], &[2.5][..]));
    assert_eq!(training.rotor_inertia_kg_m2.as_ref().unwrap().value, [0.03]);
    assert!(training.action_clip.is_none());
    assert_eq!(training.default_rad.value, [-0.1]);
    let wanted = [
        -0.1, 0.05, 0.3, 0.02, 0.04, -0.06, 0.3, -0.3, 0.0, 0.3, 1.25,
    ];
    assert_near(&observed(&training, &robot), &wanted);
    // Limits of the targets are those of the actions from which these follow.
    let narrow = text.replace(
        "clip: null\narticulations",
        "clip: [[-0.6, 0.9]]\narticulations",
    );
    let clip = read(&narrow, &robot).action_clip.unwrap().value;
    assert!(matches!(clip, ActionClip::Each { lower, upper } if lower == [-1.0] && upper == [2.0]));
}

#[test]
fn what_does_not_fit_is_told_with_its_file_and_field() {
    let (robot, names) = robot();
    let descriptors = descriptors_of(&names);
    let [asap, falcon] = [ASAP, FALCON].map(humanoidverse);
    let sar = rl_sar(
        "time",
        "  dt: 0.005\n  decimation: 4\n  joint_names: [a, b]\n",
    );
    let cases: [(&str, &str, &str, &str); 16] = [
        (
            &asap,
            "JOINT_KD: [2.5, 0.5]",
            "JOINT_KD: [2.5]",
            "JOINT_KD = 1 numbers: has another length; accepted: 2",
        ),
        (
            &asap,
            "{actions: 1, dof_pos: 2",
            "{actions: 1, dof_pos: 23",
            "obs_dims.dof_pos = 23: does not fit its joints; accepted: 2",
        ),
        (
            &asap,
            "{actions: 1",
            "{actions: 5",
            "obs_dims.actions = 5: is no number of joints; accepted: 2, or 1",
        ),
        (
            &asap,
            "GAIT_PERIOD: 0.9\n",
            "",
            "GAIT_PERIOD = (none): is missing",
        ),
        (
            &asap,
            "sin_phase: 1",
            "other: 1",
            "obs_scales.sin_phase = (none): is missing",
        ),
        (
            &asap,
            "sin_phase: 2",
            "ref_motion_phase: 2",
            "ref_motion_phase: is no term that is known here; accepted: base_lin_vel",
        ),
        (
            &asap,
            "NUM_UPPER_BODY_JOINTS: 1",
            "NUM_UPPER_BODY_JOINTS: 7",
            "NUM_UPPER_BODY_JOINTS = 7: is another number",
        ),
        (
            &falcon,
            "{actor_obs: [",
            "{critic_obs: [",
            "obs_dict = critic_obs: is not known here; accepted: actor_obs",
        ),
        (
            &sar,
            "num_observations: 15",
            "num_observations: 39",
            "num_observations = 39: does not fit observations; accepted: 15",
        ),
        (
            &sar,
            "[1, 0]",
            "[1, 2]",
            "joint_mapping = 2: is out of range",
        ),
        (
            &sar,
            "  dt: 0.005\n",
            "",
            "dt = (none): is missing; accepted: in this file, or in base.yaml",
        ),
        (
            &sar,
            "wheel_indices: []",
            "wheel_indices: [1]",
            "wheel_indices = [1]: are driven by velocity",
        ),
        (
            &sar,
            "history: [0, 1]",
            "history: [0, 2]",
            "observations_history = [0, 2]: leaves some out",
        ),
        (
            &descriptors,
            "JointPositionAction",
            "JointVelocityAction",
            "actions = JointVelocityAction: is not known here",
        ),
        (
            &descriptors,
            "shape: [3]",
            "shape: [4]",
            "observations.policy.base_ang_vel.shape = [4]: is not that of this term; accepted: [3]",
        ),
        (
            &descriptors,
            "policy:",
            "critic:",
            "observations = critic: has no group of the policy; accepted: policy",
        ),
    ];
    for (text, from, to, words) in cases {
        assert!(text.contains(from), "{from}\n{text}");
        let told = match yaml::training("f.yaml", &text.replacen(from, to, 1), &robot) {
            Ok(_) => "(nothing)".into(),
            Err(error) => error.to_string(),
        };
        assert!(
            told.contains(words) && told.contains("f.yaml"),
            "wanted: {words}\n{told}"
        );
    }
}

/// The descriptors of NVIDIA's WBC-AGILE, which has no weights for them here, and the configuration of GR1T1 of rl_sar.
#[test]
fn public_descriptions_are_read() {
    let Some(data) = public() else { return };
    let (robot, _) = robot();
    let t1 = described(
        &data.join("t1-agile-iodesc-only/booster_t1_velocity_v0.yaml"),
        &robot,
    )
    .unwrap();
    t1.check().unwrap();
    assert_eq!(t1.joints.value[6], "Left_Knee_Pitch");
    assert_eq!(
        (t1.stiffness.value[6], t1.stiffness.value[8]),
        (100.0, 20.0)
    );
    let lengths = t1.observation.value.iter().map(|term| {
        let sizes = crate::terms::Sizes {
            driven: 12,
            observed: 12,
        };
        term.length(sizes)
    });
    assert_eq!(lengths.sum::<usize>(), 225);
    let gr1 = described(&data.join("gr1t1-rl-sar/config.yaml"), &robot).unwrap();
    gr1.check().unwrap();
    assert_eq!(
        (&gr1.joints.value[3][..], gr1.stiffness.value[3]),
        ("l_knee_pitch", 114.0)
    );
}
