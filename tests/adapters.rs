//! What a policy observes is what its trainer's own deployment computes: each family of policies, as `init` reads it,
//! moves the robot as the same law whose observation `tests/data/adapters.py` builds apart.

use crate::common::network::*;
use crate::common::program::{folder, standfast, stdout};
use std::fs;
use std::path::Path;

/// The law of `adapters.py`: `action = observation * W`.
fn weights(observed: std::ops::Range<usize>, actions: usize) -> Vec<Vec<f32>> {
    let weight = |i: usize, j: usize| (0.02 * (1.0 + 0.7 * i as f64 + 1.3 * j as f64).sin()) as f32;
    observed
        .map(|i| (0..actions).map(|j| weight(i, j)).collect())
        .collect()
}

fn law(observed: usize, actions: usize) -> Vec<u8> {
    linear(&weights(0..observed, actions), &vec![0.0; actions])
}

/// UT-mu2's joints and their angles at home.
fn joints() -> (Vec<String>, Vec<f64>) {
    let robot = standfast::robots::load("ut-mu2").unwrap();
    let names = robot
        .joints
        .iter()
        .map(|joint| joint.name.clone())
        .collect();
    (names, robot.home_rad.clone())
}

/// Angles that the servos are asked for, in each tick of a push.
fn targets(folder: &Path, controller: &str) -> Vec<Vec<f64>> {
    let args = [
        "push",
        "--impulse=1",
        "--seed=3",
        "--trace=trace.csv",
        "--controller",
        controller,
    ];
    standfast(folder, &args).success();
    let text = fs::read_to_string(folder.join("trace.csv")).unwrap();
    let mut lines = text.lines().map(|line| line.split(',').collect::<Vec<_>>());
    let columns: Vec<usize> = {
        let head = lines.next().unwrap();
        (0..head.len())
            .filter(|&i| head[i].starts_with("q_ref_"))
            .collect()
    };
    lines
        .map(|line| columns.iter().map(|&i| line[i].parse().unwrap()).collect())
        .collect()
}

/// Compares a policy with the law of a family in Python, over a push.
fn compare(
    folder: &Path,
    policy: &str,
    family: &str,
    driven: usize,
    scale: f64,
    clip: Option<f64>,
) {
    let file = folder.join(policy);
    let text = fs::read_to_string(&file).unwrap();
    let walking = text.replace("command = [0.0, 0.0, 0.0]", "command = [0.3, -0.1, 0.2]");
    assert_ne!(text, walking);
    fs::write(&file, walking).unwrap();
    let assets = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/assets/controllers/python/standfast.py"
    );
    fs::copy(assets, folder.join("standfast.py")).unwrap();
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/adapters.py");
    fs::copy(script, folder.join("adapters.py")).unwrap();
    let clip = clip.map_or(String::new(), |clip| format!("clip = {clip:?}\n"));
    let process = format!(
        "kind = 'process'\nname = 'apart'\ncommand = ['python3', 'adapters.py']\nfiles = ['standfast.py']\ntimeout_s = 60.0\n\
         [parameters]\nfamily = '{family}'\ndriven = {driven}\nscale = {scale:?}\n{clip}"
    );
    fs::write(folder.join("apart.toml"), process).unwrap();
    let (network, apart) = (targets(folder, policy), targets(folder, "apart.toml"));
    let ticks = network.len().min(apart.len()).min(1500);
    let (mut largest, mut range) = (0.0_f64, 0.0_f64);
    for tick in 0..ticks {
        for (joint, (own, other)) in network[tick].iter().zip(&apart[tick]).enumerate() {
            largest = largest.max((own - other).abs());
            range = range.max((own - network[0][joint]).abs());
            assert!(
                (own - other).abs() < 2e-4,
                "{family}, tick {tick}, joint {joint}: {own} rad, apart {other}"
            );
        }
    }
    println!("{family}: {largest:.1e} rad of {range:.2} in {ticks} ticks");
    assert!(
        ticks > 1000 && range > 0.01,
        "{family} does something: {range} rad"
    );
}

/// A list in a description.
fn list<T: std::fmt::Debug>(items: impl IntoIterator<Item = T>) -> String {
    format!("{:?}", items.into_iter().collect::<Vec<_>>())
}

fn init(folder: &Path, args: &[&str]) {
    standfast(folder, &[&["init", "--robot=ut-mu2"], args].concat()).success();
}

#[test]
fn frames_of_unitree_rl_mjlab() {
    let dir = folder();
    let (names, home) = joints();
    let n = names.len();
    let of = |value: f64| list(vec![value; n]);
    let yaml = format!(
        "joint_ids_map: {}\nstep_dt: 0.02\nstiffness: {}\ndamping: {}\ndefault_joint_pos: {}\n\
         actions:\n  JointPositionAction:\n    clip: null\n    scale: {}\n    offset: {}\n\
         observations:\n  use_gym_history: true\n  scale_first: true\n\
         \x20 base_ang_vel: {{params: {{}}, clip: [-0.3, 0.3], scale: [0.5, 0.5, 0.5], history_length: 3}}\n\
         \x20 projected_gravity: {{params: {{}}, clip: null, scale: [1.0, 1.0, 1.0], history_length: 3}}\n\
         \x20 velocity_commands: {{params: {{command_name: base}}, clip: null, scale: null, history_length: 3}}\n\
         \x20 joint_pos_rel: {{params: {{}}, clip: null, scale: null, history_length: 3}}\n\
         \x20 joint_vel_rel: {{params: {{}}, clip: null, scale: {}, history_length: 3}}\n\
         \x20 last_action: {{params: {{}}, clip: null, scale: null, history_length: 3}}\n\
         \x20 gait_phase: {{params: {{period: 0.8}}, clip: null, scale: [1.0, 1.0], history_length: 3}}\n",
        list(0..n),
        of(80.0),
        of(2.5),
        list(&home),
        of(0.4),
        list(&home),
        of(0.05),
    );
    fs::write(dir.path().join("mine.deploy.yaml"), yaml).unwrap();
    fs::write(dir.path().join("mine.onnx"), law(3 * (11 + 3 * n), n)).unwrap();
    init(dir.path(), &["mine.onnx"]);
    compare(dir.path(), "mine.toml", "unitree_rl_mjlab", n, 0.4, None);
}

#[test]
fn terms_of_mjlab() {
    let dir = folder();
    let (names, home) = joints();
    let n = names.len();
    let numbers = |list: &[f64]| {
        list.iter()
            .map(f64::to_string)
            .collect::<Vec<_>>()
            .join(",")
    };
    let metadata = [
        ("joint_names", names.join(",")),
        ("joint_stiffness", numbers(&vec![80.0; n])),
        ("joint_damping", numbers(&vec![2.5; n])),
        ("default_joint_pos", numbers(&home)),
        ("action_scale", "3.0".into()),
        (
            "observation_names",
            "base_ang_vel,projected_gravity,joint_vel,joint_pos,actions,command".into(),
        ),
        ("observation_terms_scale", "0.25,1.0,0.1,1.0,1.0,1.0".into()),
        (
            "observation_terms_clip",
            "-0.4;0.4,-inf;inf,-inf;inf,-inf;inf,-inf;inf,-inf;inf".into(),
        ),
        ("observation_terms_history_length", "4,0,2,0,0,0".into()),
    ];
    let metadata: Vec<(&str, &str)> = metadata
        .iter()
        .map(|(key, text)| (*key, &text[..]))
        .collect();
    let network = with_metadata(law(4 * 3 + 6 + 4 * n, n), &metadata);
    fs::write(dir.path().join("mine.onnx"), network).unwrap();
    init(dir.path(), &["mine.onnx"]);
    compare(dir.path(), "mine.toml", "mjlab", n, 3.0, None);
}

#[test]
fn legs_of_booster_gym() {
    let dir = folder();
    let (names, home) = joints();
    let (n, driven) = (names.len(), 7);
    let of = |value: f64| list(vec![value; n]);
    let yaml = format!(
        "common:\n  dt: 0.002\n  stiffness: {}\n  damping: {}\n  default_qpos: {}\n  torque_limit: {}\n\
         policy:\n  num_actions: {driven}\n  num_observations: 32\n  gait_frequency: 1.5\n\
         \x20 normalization: {{gravity: 1.0, lin_vel: 2.0, ang_vel: 1.0, dof_pos: 1.0, dof_vel: 0.1, clip_actions: 0.05}}\n\
         \x20 control: {{action_scale: 0.5, decimation: 10}}\n",
        of(80.0),
        of(2.5),
        list(&home),
        of(10.0),
    );
    fs::write(dir.path().join("mine.yaml"), yaml).unwrap();
    fs::write(dir.path().join("mine.onnx"), law(11 + 3 * driven, driven)).unwrap();
    init(dir.path(), &["mine.onnx"]);
    compare(
        dir.path(),
        "mine.toml",
        "booster_gym",
        driven,
        0.5,
        Some(0.05),
    );
}

/// humanoid-gym leaves no description: the file is written by hand, as the guide has it.
#[test]
fn frames_of_humanoid_gym() {
    let dir = folder();
    let (names, home) = joints();
    let n = names.len();
    let of = |value: f64| list(vec![value; n]);
    let term = |text: &str| format!("[[observation]]\nclip = 0.5\nterm = {text}\n");
    let terms = [
        "'phase_left_sin'",
        "'phase_left_cos'",
        "'command'\nscale = [2.0, 2.0, 1.0]",
        "'joint_positions'",
        "'joint_velocities'\nscale = 0.05",
        "'last_action'",
        "'base_angular_velocity'",
        "'euler_angles'",
    ];
    let file = format!(
        "kind = 'onnx'\nname = 'mine'\nmodel = 'mine.onnx'\nperiod_s = 0.02\njoints = {names:?}\ndefault_rad = {home:?}\n\
         action_scale = {}\nstiffness = {}\ndamping = {}\ncommand = [0.0, 0.0, 0.0]\n\
         frames = {{ count = 15, zero_before = true }}\n[gait]\nhz = 1.5625\n{}",
        of(0.25),
        of(80.0),
        of(2.5),
        terms.map(term).concat(),
    );
    fs::write(dir.path().join("mine.toml"), file).unwrap();
    fs::write(dir.path().join("mine.onnx"), law(15 * (11 + 3 * n), n)).unwrap();
    compare(dir.path(), "mine.toml", "humanoid_gym", n, 0.25, None);
}

/// A network with five inputs, a memory, and the gains of the servos as outputs.
#[test]
fn inputs_and_memory_of_leapp() {
    let dir = folder();
    let (names, home) = joints();
    let n = names.len();
    let inputs = [
        ("quat", 4),
        ("gyro", 3),
        ("command", 3),
        ("q", n),
        ("dq", n),
        ("kept", 3),
    ];
    // The whole law would not stand.
    let half = |weights: &[Vec<f32>]| -> Vec<f32> {
        weights.concat().iter().map(|weight| 0.5 * weight).collect()
    };
    let mut operations = Vec::new();
    let mut tensors = Vec::new();
    let mut from = 0;
    let mut sum = String::from("home");
    tensors.push(tensor(
        "home",
        &[n],
        &home.iter().map(|&rad| rad as f32).collect::<Vec<_>>(),
    ));
    for (name, size) in inputs {
        let (matrix, next) = (format!("w_{name}"), format!("sum_{name}"));
        tensors.push(tensor(
            &matrix,
            &[size, n],
            &half(&weights(from..from + size, n)),
        ));
        operations.push(operation("Gemm", &[name, &matrix, &sum], &[&next]));
        (from, sum) = (from + size, next);
    }
    let diagonal = |value: f32| {
        let mut matrix = vec![0.0; 9];
        for i in 0..3 {
            matrix[4 * i] = value;
        }
        matrix
    };
    for (name, values) in [("half", diagonal(0.5)), ("one", diagonal(1.0))] {
        tensors.push(tensor(name, &[3, 3], &values));
    }
    tensors.push(tensor("zeros", &[3, n], &vec![0.0; 3 * n]));
    tensors.push(tensor("of_kp", &[n], &vec![80.0; n]));
    tensors.push(tensor("of_kd", &[n], &vec![2.5; n]));
    operations.push(operation("MatMul", &["kept", "half"], &["half_kept"]));
    operations.push(operation(
        "Gemm",
        &["gyro", "one", "half_kept"],
        &["kept_next"],
    ));
    operations.push(operation("Gemm", &["gyro", "zeros", "of_kp"], &["kp"]));
    operations.push(operation("Gemm", &["gyro", "zeros", "of_kd"], &["kd"]));
    let outputs = [("kp", n), ("kept_next", 3), (&sum[..], n), ("kd", n)];
    fs::write(
        dir.path().join("mine.onnx"),
        network(&operations, &tensors, &inputs, &outputs),
    )
    .unwrap();
    let joints = names.join(", ");
    let raw = [
        ("quat", "state/body/rotation", "w, x, y, z"),
        ("gyro", "state/body/angular_velocity", "x, y, z"),
        ("command", "velocity_command", "lin_x, lin_y, ang_z"),
        ("q", "state/joint/position", &joints),
        ("dq", "state/joint/velocity", &joints),
    ];
    let raw = raw.map(|(name, kind, elements)| {
        format!("      - {{name: {name}, kind: {kind}, element_names: [[{elements}]]}}\n")
    });
    let gives = [
        (&sum[..], "target/joint/position"),
        ("kp", "kp"),
        ("kd", "kd"),
    ]
    .map(|(name, kind)| {
        format!("      - {{name: {name}, kind: {kind}, element_names: [[{joints}]]}}\n")
    });
    let yaml = format!(
        "models:\n  mine:\n    inputs:\n{}      - {{name: kept, is_state: true}}\n    outputs:\n{}      - {{name: kept_next, is_state: true}}\n\
         pipeline:\n  feedback_connections:\n    mine/kept_next: [mine/kept]\nsemantic:\n  scene: {{dt: 0.02}}\n",
        raw.concat(),
        gives.concat(),
    );
    fs::write(dir.path().join("mine.yaml"), yaml).unwrap();
    init(dir.path(), &["mine.onnx"]);
    compare(dir.path(), "mine.toml", "leapp", n, 0.5, None);
    // The memory begins anew with each episode, whoever runs it.
    let check = standfast(dir.path(), &["check", "mine.toml"]).success();
    assert!(
        stdout(&check).contains("the same to the bit"),
        "{}",
        stdout(&check)
    );
    let run = |out: &str, threads: &str| {
        let args = [
            "run",
            "smoke",
            "--trials=4",
            "--replays=0",
            "--controller=mine.toml",
            out,
            threads,
        ];
        standfast(dir.path(), &args).success();
        fs::read(dir.path().join(&out[6..]).join("parts/part-000000.parquet")).unwrap()
    };
    assert_eq!(run("--out=a", "--threads=1"), run("--out=b", "--threads=2"));
}
