//! Learned policies: a network gives the same actions as its law in Python, mistakes are reported in a sentence, and
//! real policies stand and are pushed if they are available.

use crate::common::network::*;
use crate::common::parts::rows;
use crate::common::program::{folder, standfast, stderr, stdout};
use ndarray::array;
use ndarray_npy::{NpzWriter, WriteNpyExt};
use serde_json::Value;
use std::fmt::Write as _;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// The ankles of UT-mu2 that bend forward, and their angles at home (rad).
const ANKLES: [&str; 2] = ["left_ankle_flexion", "right_ankle_flexion"];
const HOME_RAD: f64 = 0.442;

/// A policy of the two ankles in a folder: its network, its terms, and further lines of its file.
fn policy(folder: &Path, name: &str, network: &[u8], terms: &str, more: &str) -> String {
    fs::write(folder.join("policy.onnx"), network).unwrap();
    let text = format!(
        "kind = 'onnx'\nname = '{name}'\nmodel = 'policy.onnx'\nperiod_s = 0.02\njoints = {ANKLES:?}\n\
         default_rad = [{HOME_RAD}, {HOME_RAD}]\naction_scale = [1.0, 1.0]\nstiffness = [80.0, 80.0]\n\
         damping = [2.5, 2.5]\n{more}\n{terms}"
    );
    fs::write(folder.join(format!("{name}.toml")), text).unwrap();
    format!("{name}.toml")
}

/// Terms without settings of their own.
fn terms(names: &[&str]) -> String {
    names.iter().fold(String::new(), |mut text, name| {
        writeln!(text, "[[observation]]\nterm = '{name}'").unwrap();
        text
    })
}

#[test]
fn a_network_does_what_the_same_law_does_in_python() {
    let dir = folder();
    // The ankles follow the angular velocity of the trunk, as observed now and one action ago, and lean by 0.01 rad.
    let gains = [0.0, 0.02, 0.0, 0.0, 0.05, 0.0].map(|gain: f32| vec![gain, gain]);
    let seen = "[[observation]]\nterm = 'base_angular_velocity'\nhistory = 2\nscale = 2.0\n";
    let ours = policy(dir.path(), "ours", &linear(&gains, &[0.01, 0.01]), seen, "");
    let python = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/assets/controllers/python/standfast.py"
    );
    fs::copy(python, dir.path().join("standfast.py")).unwrap();
    let script = "import standfast\n\
        class Same(standfast.Controller):\n    def reset(self, seed):\n        self.ticks, self.past = 0, None\n\
        \x20   def tick(self, sensed):\n        if self.ticks % 10 == 0:\n            rate = sensed['gyro'][1]\n\
        \x20           past = rate if self.past is None else self.past\n            self.past = rate\n\
        \x20           action = 2 * (0.02 * past + 0.05 * rate) + 0.01\n            self.q = list(self.home)\n\
        \x20           self.torques = list(self.robot['home']['tau_ff'])\n\
        \x20           for i, name in enumerate(self.joints):\n\
        \x20               if name in ('left_ankle_flexion', 'right_ankle_flexion'):\n\
        \x20                   self.q[i], self.torques[i] = 0.442 + action, 0.0\n        self.ticks += 1\n\
        \x20       return {'q_ref': self.q, 'tau_ff': self.torques}\nstandfast.serve(Same)\n";
    fs::write(dir.path().join("same.py"), script).unwrap();
    let file = "kind = 'process'\nname = 'same'\ncommand = ['python3', 'same.py']\nfiles = ['standfast.py']\n";
    fs::write(dir.path().join("same.toml"), file).unwrap();
    let told = |controller: &str| -> Value {
        let args = [
            "push",
            "--impulse=1.5",
            "--json",
            "--controller",
            controller,
        ];
        serde_json::from_str(&stdout(&standfast(dir.path(), &args).success())).unwrap()
    };
    let (network, law, stiff) = (told(&ours), told("same.toml"), told("hold"));
    assert_eq!(network["outcome"], law["outcome"]);
    let peak = |told: &Value| told["peak_tilt_deg"].as_f64().unwrap();
    // The numbers of the network have 24 bits.
    assert!(
        (peak(&network) - peak(&law)).abs() < 1e-3 * peak(&law),
        "{network}\n{law}"
    );
    assert!(
        (peak(&network) - peak(&stiff)).abs() > 0.01 * peak(&stiff),
        "the policy does something: {network} {stiff}"
    );
}

#[test]
fn a_policy_is_an_input_of_its_result_and_gives_the_same_bytes_on_any_number_of_threads() {
    let dir = folder();
    let all = [
        "base_linear_velocity",
        "base_angular_velocity",
        "projected_gravity",
        "command",
        "command_walk",
        "command_turn",
        "joint_positions",
        "joint_velocities",
        "last_action",
        "phase_sin",
        "phase_cos",
    ];
    let weights = vec![vec![1e-3, 2e-3]; 12 + 3 + 6 + 4];
    let ours = policy(
        dir.path(),
        "ours",
        &linear(&weights, &[0.0; 2]),
        &terms(&all),
        "action_clip = 1.0\n[gait]\nhz = 1.5",
    );
    let run = |out: &str, threads: &str| {
        let args = [
            "run",
            "smoke",
            "--trials=4",
            "--replays=0",
            "--controller=hold",
            "--controller",
            &ours,
            out,
            threads,
        ];
        standfast(dir.path(), &args).success();
        fs::read(dir.path().join(&out[6..]).join("parts/part-000000.parquet")).unwrap()
    };
    assert_eq!(run("--out=a", "--threads=1"), run("--out=b", "--threads=2"));
    assert!(
        dir.path()
            .join("a/inputs/controllers/policy.onnx")
            .is_file()
    );
    let args = [
        "replay",
        "a",
        "--trial=1",
        "--controller=ours",
        "--replay=page.html",
    ];
    let replayed = standfast(dir.path(), &args).success();
    assert!(
        !stderr(&replayed).contains("is not as it was"),
        "{}",
        stderr(&replayed)
    );
    standfast(dir.path(), &["check", &ours, "--set=episode.horizon_s=1"]).success();
}

/// Weights beside the network, as torch writes them, are inputs of a result like the network itself.
#[test]
fn weights_in_another_file_are_those_of_the_network() {
    use protobuf::{bytes, number};
    let dir = folder();
    let weights: Vec<f32> = (0..6).map(|i| 0.01 * i as f32).collect();
    let whole = linear(
        &weights.chunks(2).map(<[f32]>::to_vec).collect::<Vec<_>>(),
        &[0.01, -0.01],
    );
    let entry = |key: &str, value: &str| {
        bytes(
            13,
            &[bytes(1, key.as_bytes()), bytes(2, value.as_bytes())].concat(),
        )
    };
    let outside = |offset: &str| {
        [
            number(1, 3),
            number(1, 2),
            number(2, 1),
            bytes(8, b"weights"),
            entry("location", "policy.onnx.data"),
            entry("offset", offset),
            entry("length", "24"),
            number(14, 1),
        ]
        .concat()
    };
    let bias = [
        number(1, 2),
        number(2, 1),
        bytes(8, b"bias"),
        entry("location", "./bias.bin"),
        number(14, 1),
    ];
    let apart = |offset: &str| {
        let gemm = operation("Gemm", &["obs", "weights", "bias"], &["action"]);
        let tensors = [outside(offset), bias.concat()];
        network(&[gemm], &tensors, &[("obs", 3)], &[("action", 2)])
    };
    let seen = terms(&["base_angular_velocity"]);
    let raw: Vec<u8> = [7.0]
        .iter()
        .chain(&weights)
        .flat_map(|weight| weight.to_le_bytes())
        .collect();
    fs::write(dir.path().join("policy.onnx.data"), raw).unwrap();
    let raw = [0.01_f32, -0.01].map(f32::to_le_bytes).concat();
    fs::write(dir.path().join("bias.bin"), raw).unwrap();
    let run = |network: &[u8], out: &str| {
        let file = policy(dir.path(), "ours", network, &seen, "");
        let out_is = format!("--out={out}");
        let args = [
            "run",
            "smoke",
            "--trials=2",
            "--replays=0",
            "--controller",
            &file,
            &out_is,
        ];
        standfast(dir.path(), &args)
    };
    run(&whole, "whole").success();
    run(&apart("4"), "apart").success();
    let trials = |out: &str| {
        format!(
            "{:?}",
            rows(&dir.path().join(out).join("parts/part-000000.parquet"))
        )
    };
    assert!(trials("whole") == trials("apart"), "the same trials");
    let kept = dir.path().join("apart/inputs/controllers/policy.onnx.data");
    assert!(kept.is_file());
    // A replay reads the network and its weights from the result.
    fs::remove_file(dir.path().join("policy.onnx.data")).unwrap();
    let args = ["replay", "apart", "--trial=1", "--controller=ours"];
    standfast(dir.path(), &args).success();
    fs::copy(kept, dir.path().join("policy.onnx.data")).unwrap();
    let told = stderr(&run(&apart("8"), "bad").code(2));
    assert!(
        told.contains("is kept in \"policy.onnx.data\" at [Some(\"8\"), Some(\"24\")] (offset, length), but that file has 28"),
        "{told}"
    );
}

#[test]
fn what_does_not_fit_is_told_in_a_sentence() {
    let zero = |observed: usize, actions: usize| {
        linear(&vec![vec![0.0; actions]; observed], &vec![0.0; actions])
    };
    let (gyro, two) = (
        terms(&["base_angular_velocity"]),
        terms(&["base_angular_velocity", "last_action"]),
    );
    let phase = terms(&["phase_sin"]);
    let fine = |text: &str| text.to_string();
    type Change = Box<dyn Fn(&str) -> String>;
    let replaced = |from: &'static str, to: &'static str| -> Change {
        Box::new(move |text| text.replace(from, to))
    };
    let recurrent = |kept: usize, next: usize| {
        let operations = [
            operation("Gemm", &["obs", "weights", "bias"], &["action"]),
            operation("Gemm", &["h_in", "of_memory", "zeros"], &["h_out"]),
        ];
        let tensors = [
            tensor("weights", &[3, 2], &[0.0; 6]),
            tensor("bias", &[2], &[0.0; 2]),
            tensor("of_memory", &[kept, next], &vec![0.0; kept * next]),
            tensor("zeros", &[next], &vec![0.0; next]),
        ];
        let (inputs, outputs) = (
            [("obs", 3), ("h_in", kept)],
            [("action", 2), ("h_out", next)],
        );
        network(&operations, &tensors, &inputs, &outputs)
    };
    let cases: [(Vec<u8>, &str, Change, &str); 18] = [
        (
            recurrent(4, 3),
            &gyro,
            Box::new(fine),
            "feeds 3 numbers back to its input \"h_in\", which takes 4",
        ),
        (
            recurrent(4, 4),
            &gyro,
            replaced("[[obs", "[network]\nmemory = { h_in = 'c_out' }\n[[obs"),
            "there is no memory from \"c_out\" to \"h_in\"",
        ),
        (
            recurrent(4, 4),
            &gyro,
            replaced(
                "term = 'base_angular_velocity'",
                "term = 'base_angular_velocity'\ninput = 'state'",
            ),
            "no term observes \"obs\" (`input`)",
        ),
        (
            recurrent(4, 4),
            &gyro,
            replaced("[[obs", "[network]\nstiffness = 'h_out'\n[[obs"),
            "stiffness = (a list): is stated twice or not at all",
        ),
        (
            zero(3, 2),
            &gyro,
            replaced(
                "[[obs",
                "[observed]\njoints = ['no_joint']\ndefault_rad = [0.0]\n[[obs",
            ),
            "observed.joints = no_joint: ut-mu2 has no such joint",
        ),
        (
            zero(3, 2),
            &gyro,
            replaced("'base_angular_velocity'", "'constant'"),
            "observation.0.values = []: does not fit the term; accepted: numbers for a `constant`",
        ),
        (
            zero(3, 2),
            &gyro,
            replaced(
                "'base_angular_velocity'",
                "'base_angular_velocity'\nhistory = { count = 0 }",
            ),
            "observation.0.history = 0: out of range; accepted: 1 to 1000",
        ),
        (
            zero(3, 2),
            &two,
            Box::new(fine),
            "takes 3 numbers, but the terms of its observation are 5",
        ),
        (
            zero(3, 3),
            &gyro,
            Box::new(fine),
            "gives 3 numbers, but it drives 2 joints",
        ),
        (
            b"no network".to_vec(),
            &gyro,
            Box::new(fine),
            "policy.onnx: cannot be read",
        ),
        (
            zero(3, 2),
            &gyro,
            replaced("right_ankle_flexion", "right_wheel"),
            "right_wheel: ut-mu2 has no such joint",
        ),
        (
            zero(3, 2),
            &gyro,
            replaced("period_s = 0.02", "period_s = 0.005"),
            "accepted: a multiple of the control period",
        ),
        (
            zero(3, 2),
            &gyro,
            replaced("80.0, 80.0", "80.0"),
            "stiffness = 1 numbers: has another length than joints",
        ),
        (
            zero(3, 2),
            &gyro,
            replaced("2.5, 2.5", "2.5, -1.0"),
            "damping = -1: out of range; accepted: 0 to 1e12",
        ),
        (
            zero(3, 2),
            &gyro,
            replaced("base_angular_velocity", "base_height"),
            "unknown variant `base_height`",
        ),
        (
            zero(2, 2),
            &phase,
            Box::new(fine),
            "needs the clock of a gait; accepted: a table `[gait]`",
        ),
        (
            zero(3, 2),
            &gyro,
            replaced("model = 'policy.onnx'", "model = '../policy.onnx'"),
            "is not in the folder of this file",
        ),
        (
            zero(3, 2),
            &gyro,
            replaced("model = 'policy.onnx'", "model = 'other.onnx'"),
            "other.onnx: cannot read",
        ),
    ];
    for (network, seen, change, words) in cases {
        let dir = folder();
        let file = policy(dir.path(), "ours", &network, seen, "");
        let text = fs::read_to_string(dir.path().join(&file)).unwrap();
        fs::write(dir.path().join(&file), change(&text)).unwrap();
        let told = stderr(&standfast(dir.path(), &["push", "--controller", &file]).code(2));
        assert!(told.contains(words), "wanted: {words}\n{told}");
        assert!(
            told.contains("ours.toml") || told.contains("other.onnx"),
            "{told}"
        );
    }
    // A network that gives invalid numbers ends the episode, and nothing else.
    let dir = folder();
    let file = policy(
        dir.path(),
        "ours",
        &linear(&[vec![f32::NAN; 2], vec![0.0; 2], vec![0.0; 2]], &[0.0; 2]),
        &gyro,
        "",
    );
    let push = standfast(dir.path(), &["push", "--json", "--controller", &file]).code(1);
    let told: Value = serde_json::from_str(&stdout(&push)).unwrap();
    assert_eq!(told["outcome"], "Failed");
    assert!(
        told["fall_cause"]
            .as_str()
            .unwrap()
            .contains("ours: action 0 of policy.onnx is not finite"),
        "{told}"
    );
}

/// A network that states impossible sizes, or fills the memory, is refused with the cause.
#[test]
fn a_network_that_cannot_be_is_refused_for_its_cause() {
    use protobuf::{bytes, number};
    const SEEN: (&str, usize) = ("obs", 3);
    const DONE: (&str, usize) = ("action", 2);
    let gemm = || operation("Gemm", &["obs", "weights", "bias"], &["action"]);
    let weights = || tensor("weights", &[3, 2], &[0.0; 6]);
    let bias = || tensor("bias", &[2], &[0.0; 2]);
    let plain = |operations: &[Vec<u8>], tensors: &[Vec<u8>]| {
        network(operations, tensors, &[SEEN], &[DONE])
    };
    let with = |operations: &[Vec<u8>], tensors: &[Vec<u8>]| {
        plain(
            &[operations, &[gemm()]].concat(),
            &[tensors, &[weights(), bias()]].concat(),
        )
    };
    let external = [
        number(1, 2),
        number(2, 1),
        bytes(8, b"bias"),
        bytes(
            13,
            &[bytes(1, b"location"), bytes(2, b"policy.onnx.data")].concat(),
        ),
        number(14, 1),
    ];
    let tile = |i: usize| {
        operation(
            "Tile",
            &[&format!("x{i}"), "times"],
            &[&format!("x{}", i + 1)],
        )
    };
    let tiles: Vec<Vec<u8>> = std::iter::once(operation("Identity", &["obs"], &["x0"]))
        .chain((0..20).map(tile))
        .collect();
    let copies: Vec<Vec<u8>> = (0..5)
        .map(|i| operation("Expand", &["obs", "wide"], &[&format!("e{i}")]))
        .collect();
    let relu = |i: usize| operation("Relu", &[&format!("x{i}")], &[&format!("x{}", i + 1)]);
    let deep: Vec<Vec<u8>> = std::iter::once(operation("Identity", &["obs"], &["x0"]))
        .chain((0..6000).map(relu))
        .collect();
    let huge = sizes("huge", &[1 << 40, 1 << 20]);
    let large = sizes("large", &[1_000_000, 1_000_000]);
    let range = |names: [&str; 3]| operation("Range", &names, &["steps"]);
    let scalar = |name: &str, value: i64| sizes(name, &[value]).split_off(2);
    let cases: Vec<(Vec<u8>, &str)> = vec![
        (
            network(&[gemm()], &[weights(), bias()], &[SEEN], &[("none", 2)]),
            "its output \"none\" is made by no operation",
        ),
        (
            plain(&[gemm()], &[weights()]),
            "(\"Gemm\") reads \"bias\", which nothing before it makes",
        ),
        (
            with(
                &[
                    operation("Relu", &["b"], &["a"]),
                    operation("Relu", &["a"], &["b"]),
                ],
                &[],
            ),
            "operation \"a\" (\"Relu\") reads \"b\", which nothing before it makes",
        ),
        (
            with(&[operation("Relu", &["obs"], &["obs"])], &[]),
            "makes \"obs\", which is there already",
        ),
        (
            with(&[operation("Magic", &["obs"], &["a"])], &[]),
            "its operation \"a\" (\"Magic\") is none that this",
        ),
        (
            plain(&[gemm()], &[weights(), external.concat()]),
            "keeps its weights in another file: ./policy.onnx.data: cannot read",
        ),
        (
            plain(&[gemm()], &[weights(), tensor("bias", &[2], &[0.0; 3])]),
            "its tensor \"bias\" has the sizes [2], but 12 bytes of numbers instead of 8",
        ),
        (
            plain(
                &[gemm()],
                &[weights(), tensor("bias", &[1 << 40, 1 << 30], &[])],
            ),
            "has the sizes [1099511627776, 1073741824]; up to 16777216 numbers are taken",
        ),
        (
            plain(&[gemm()], &[weights(), tensor("bias", &[usize::MAX], &[])]),
            "has the sizes [-1]; up to",
        ),
        // Tensors that ConstantOfShape and Expand make count, too.
        (
            with(&[operation("ConstantOfShape", &["huge"], &["a"])], &[huge]),
            "its \"huge\" has the number 1099511627776; up to 2147483647",
        ),
        (
            with(
                &[operation("ConstantOfShape", &["large"], &["a"])],
                &[large],
            ),
            "1000000 x 1000000 numbers; up to 16777216",
        ),
        (
            with(
                &[operation("Expand", &["obs", "wide"], &["a"])],
                &[sizes("wide", &[100_000_000, 3])],
            ),
            "100000000 x 3 numbers",
        ),
        (
            with(&copies, &[sizes("wide", &[5_000_000, 3])]),
            "is too large: up to its operation \"e4\", more than 67108864",
        ),
        (
            with(&tiles, &[sizes("times", &[1, 4])]),
            " numbers; up to 16777216 are taken",
        ),
        (
            with(
                &[range(["from", "to", "by"])],
                &[
                    scalar("from", 0),
                    scalar("to", 2_000_000_000),
                    scalar("by", 1),
                ],
            ),
            "makes 2000000000 numbers; up to",
        ),
        (with(&deep, &[]), "has 6002 operations, more than 5000"),
        (
            network(
                &[gemm()],
                &[weights(), bias()],
                &[("obs", 1 << 63), ("weights", 3), ("bias", 1)],
                &[DONE],
            ),
            "takes ",
        ),
        (
            network(
                &[
                    gemm(),
                    operation("Identity", &["time_step"], &["joint_pos"]),
                ],
                &[weights(), bias()],
                &[SEEN, ("time_step", 1)],
                &[DONE, ("joint_pos", 1)],
            ),
            "has 2 inputs [\"obs\", \"time_step\"] and 2 outputs [\"action\", \"joint_pos\"]; by time_step it follows a recorded",
        ),
        (
            network(
                &[gemm()],
                &[weights(), bias()],
                &[SEEN, ("h_in", 2)],
                &[DONE],
            ),
            "has 2 inputs [\"obs\", \"h_in\"] and the output \"action\"; terms without `input`",
        ),
        (
            network(
                &[gemm()],
                &[weights(), bias()],
                &[SEEN, ("map", 2)],
                &[DONE],
            ),
            "[\"obs\", \"map\"] and the output \"action\"; terms",
        ),
        (
            b"PK\x03\x04 and so on".to_vec(),
            "cannot be read: it is no ZIP archive, or not all of one: ",
        ),
        (
            b"version https://git-lfs.github.com/spec/v1\n".to_vec(),
            "a pointer of Git LFS",
        ),
        (with(&[], &[]).split_off(9), "cannot be read: "),
    ];
    let dir = folder();
    for (network, words) in cases {
        let file = policy(
            dir.path(),
            "ours",
            &network,
            &terms(&["base_angular_velocity"]),
            "",
        );
        let told = stderr(&standfast(dir.path(), &["push", "--controller", &file]).code(2));
        assert!(told.contains(words), "wanted: {words}\n{told}");
        assert!(
            told.contains("ours.toml: model = policy.onnx: ") && !told.contains("panic"),
            "{told}"
        );
    }
    // A slice may go to the end. Old exporters list stored tensors as inputs, and these do not count as inputs.
    let ends = [sizes("from", &[0]), sizes("to", &[i64::MAX])];
    let sliced = with(&[operation("Slice", &["obs", "from", "to"], &["a"])], &ends);
    let file = policy(
        dir.path(),
        "ours",
        &sliced,
        &terms(&["base_angular_velocity"]),
        "",
    );
    standfast(dir.path(), &["push", "--controller", &file]).success();
    let old = network(
        &[gemm()],
        &[weights(), bias()],
        &[SEEN, ("weights", 2), ("bias", 2)],
        &[DONE],
    );
    let file = policy(
        dir.path(),
        "ours",
        &old,
        &terms(&["base_angular_velocity"]),
        "",
    );
    standfast(dir.path(), &["push", "--controller", &file]).success();
}

/// With any change of a byte, a network is taken or refused.
#[test]
fn any_byte_of_a_network_may_be_wrong() {
    standfast::leaves::add();
    let dir = folder();
    let robot = standfast::robots::load("ut-mu2").unwrap();
    let whole = with_metadata(linear(&vec![vec![0.1; 2]; 3], &[0.0; 2]), &[("a", "b")]);
    let file = policy(
        dir.path(),
        "ours",
        &whole,
        &terms(&["base_angular_velocity"]),
        "",
    );
    let settings = standfast::controllers::load(&dir.path().join(file).to_string_lossy()).unwrap();
    let (mut taken, mut refused) = (0, 0);
    for at in 0..whole.len() {
        for value in [whole[at] ^ 1, whole[at] ^ 0x80, 0xff] {
            let mut network = whole.clone();
            network[at] = value;
            fs::write(dir.path().join("policy.onnx"), network).unwrap();
            match settings.prepare(&robot, 0.002) {
                Ok(_) => taken += 1,
                Err(error) => {
                    assert!(
                        error.to_string().contains("model = policy.onnx: "),
                        "byte {at} = {value}: {error}"
                    );
                    refused += 1;
                }
            }
        }
    }
    assert!(taken > 50 && refused > 50, "{taken} {refused}");
}

/// Motors belong to the robot: those of a training are told, and `--motors` gives them to every controller.
#[test]
fn every_controller_has_the_motors_of_the_robot() {
    standfast::leaves::add();
    let robot = standfast::robots::load("ut-mu2").unwrap();
    let joints = robot.joints.iter();
    let ankle = joints.clone().position(|joint| joint.name == ANKLES[0]);
    let (torque, rotor) = {
        let servo = &robot.servos[ankle.unwrap()];
        (servo.torque_n_m, servo.rotor_inertia_kg_m2)
    };
    let dir = folder();
    let motors = |torque: f64, rotor: f64| {
        format!(
            "torque_n_m = [{torque:?}, {torque:?}]\nrotor_inertia_kg_m2 = [{rotor:?}, {rotor:?}]\n"
        )
    };
    let network = linear(&[vec![0.0; 2], vec![0.02; 2], vec![0.0; 2]], &[0.0, 0.0]);
    let make = |name: &str, training: &str| {
        let observed = terms(&["base_angular_velocity"]);
        let file = policy(dir.path(), name, &network, &observed, "");
        let text = fs::read_to_string(dir.path().join(&file)).unwrap() + training;
        fs::write(dir.path().join(&file), text).unwrap();
        file
    };
    let training = |torque, rotor| format!("[training]\n{}", motors(torque, rotor));
    let plain = make("plain", "");
    let alike = make("alike", &training(torque, rotor));
    let weak = make("weak", &training(0.1 * torque, 2.0 * rotor));
    let run = |names: &[&str], more: &[&str], out: &str| {
        let controllers: Vec<String> = names
            .iter()
            .map(|name| format!("--controller={name}"))
            .collect();
        let mut args = vec![
            "run",
            "smoke",
            "--trials=3",
            "--replays=0",
            "--untried",
            "--out",
            out,
        ];
        args.extend(
            controllers
                .iter()
                .map(String::as_str)
                .chain(more.iter().copied()),
        );
        let told = stderr(&standfast(dir.path(), &args).success());
        let told = told.split_whitespace().collect::<Vec<_>>().join(" ");
        let rows = rows(&dir.path().join(out).join("parts/part-000000.parquet"));
        // The rows of each controller, without its name.
        let of = move |name: &str| {
            let mut of_it = rows.clone();
            of_it.retain(|row| row["controller"] == name);
            for row in &mut of_it {
                row.remove("controller");
            }
            of_it
        };
        (of, told)
    };
    let (own, told) = run(&["hold", &plain, &alike, &weak], &[], "own");
    assert!(own("plain").len() == 3 && own("plain") == own("weak") && own("plain") == own("alike"));
    let [word, own_word] = [0.1 * torque, torque].map(|torque| torque.to_string());
    assert!(
        told.contains("weak was trained on other motors: torque limits of 2 joints")
            && told.contains(&format!("({word} N m, the robot {own_word}: ")),
        "{told}"
    );
    assert!(
        !told.contains("alike was trained") && !told.contains("plain was trained"),
        "{told}"
    );
    let report = fs::read_to_string(dir.path().join("own/summary.md")).unwrap();
    assert!(
        report.contains("weak was trained on other motors"),
        "{report}"
    );

    let (given, told) = run(&["hold", &plain, &weak], &["--motors", &weak], "given");
    assert!(!told.contains("weak was trained"), "{told}");
    assert_eq!(given("plain"), given("weak"));
    assert!(
        given("weak").iter().all(|row| row["outcome"] == "Fell"),
        "{:?}",
        given("weak")
    );
    assert_ne!(given("hold"), own("hold"));
    // The result keeps the motors, so that its trials can be seen again.
    let kept = fs::read_to_string(dir.path().join("given/inputs/robot.toml")).unwrap();
    assert!(kept.contains("of weak.toml"), "{kept}");
    let again = stdout(
        &standfast(
            dir.path(),
            &[
                "replay",
                "given",
                "--trial",
                "0",
                "--controller",
                "plain",
                "--replay",
                "a.html",
            ],
        )
        .success(),
    );
    assert!(!again.contains("differs"), "{again}");

    // The keys of former versions, which were simulated with the policy alone.
    let former = policy(
        dir.path(),
        "former",
        &network,
        &terms(&["base_angular_velocity"]),
        &motors(torque, rotor),
    );
    let told = stderr(&standfast(dir.path(), &["push", "--controller", &former]).code(2));
    assert!(
        told.contains("torque_n_m = (a list): motors belong to the robot")
            && told.contains("--motors"),
        "{told}"
    );
}

/// The recorded actions of the training have to come out again: this tests the network, and the order of its terms and
/// joints.
#[test]
fn recorded_actions_are_repeated_or_the_first_other_one_is_told() {
    let dir = folder();
    let weights = [vec![1.0, -1.0], vec![0.5, 2.0], vec![0.0, 4.0]];
    let file = policy(
        dir.path(),
        "ours",
        &linear(&weights, &[0.1, 0.2]),
        &terms(&["projected_gravity"]),
        "",
    );
    let check = |pairs: &str, more: &[&str]| {
        fs::write(dir.path().join("pairs.csv"), pairs).unwrap();
        let args = [
            "check",
            &file,
            "--set=episode.horizon_s=0.6",
            "--contract=pairs.csv",
        ];
        standfast(dir.path(), &[&args[..], more].concat())
    };
    let good = "x,y,z,a,b\n1,0,0,1.1,-0.8\n0.5,1,-1,1.1,-2.3\n";
    let told = stdout(&check(good, &["--json"]));
    let contract = &serde_json::from_str::<Value>(&told).unwrap()["contract"];
    assert_eq!(
        (&contract["pairs"], &contract["is_kept"]),
        (&2.into(), &true.into()),
        "{told}"
    );
    let marked = format!("\u{feff}{}", good.strip_prefix("x,y,z,a,b\n").unwrap());
    assert!(stdout(&check(&marked, &["--json"])).contains("\"pairs\": 2"));
    let told = stdout(&check(&good.replace("-2.3", "-2.2"), &[]).code(100));
    let told = told.split_whitespace().collect::<Vec<_>>().join(" ");
    assert!(
        told.contains("in line 3, action 1 is -2.3000, and -2.2000 was recorded"),
        "{told}"
    );
    for (pairs, words) in [
        (
            "1,0,0\n",
            "line 1 = 3 numbers: is too short; accepted: the 3 numbers of an observation",
        ),
        (
            "1,0,0,1\n",
            "line 1 = 1 numbers: is no action of this policy; accepted: 2 numbers",
        ),
        ("1,0,0,1,2\n1,0,x,1,2\n", "line 2 = 1,0,x,1,2: "),
        ("1,0,x,1,2\n", "line 1 = 1,0,x,1,2: "),
        ("x,y\n", "has no pairs"),
    ] {
        let told = stderr(&check(pairs, &[]).code(2));
        assert!(told.contains(words), "wanted: {words}\n{told}");
    }
    // The same two pairs are given as arrays of NumPy, of both widths, in any order.
    let observed = array![[1.0, 0.0, 0.0], [0.5, 1.0, -1.0]];
    let npz = |write: &dyn Fn(&mut NpzWriter<fs::File>)| {
        let mut npz =
            NpzWriter::new_compressed(fs::File::create(dir.path().join("pairs.npz")).unwrap());
        write(&mut npz);
        npz.finish().unwrap();
        standfast(
            dir.path(),
            &[
                "check",
                &file,
                "--set=episode.horizon_s=0.6",
                "--contract=pairs.npz",
            ],
        )
    };
    let in_a_line = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
    let told = stdout(&npz(&|npz| {
        npz.add_array("actions", &array![[1.1_f32, -0.8], [1.1, -2.3]])
            .unwrap();
        npz.add_array("observations", &observed).unwrap();
    }));
    assert!(
        in_a_line(&told).contains("2 recorded actions of 2 numbers are repeated"),
        "{told}"
    );
    let told = stdout(&npz(&|npz| {
        npz.add_array("a", &array![[1.1, -0.8], [1.1, -2.2]])
            .unwrap();
        npz.add_array("b", &observed).unwrap();
    }));
    assert!(
        in_a_line(&told).contains("in line 2, action 1 is -2.3000, and -2.2000 was recorded"),
        "{told}"
    );
    let told = stderr(&npz(&|npz| npz.add_array("seen", &array![[1.0, 2.0]]).unwrap()).code(2));
    assert!(
        told.contains("pairs.npz: arrays = seen (1 x 2): are no observations and actions"),
        "{told}"
    );
    // One head states 208 GB, and another one is itself too long.
    let mut array = Vec::new();
    observed.write_npy(&mut array).unwrap();
    let at = array.windows(6).position(|part| part == b"(2, 3)").unwrap();
    array.splice(at..at + 6, *b"(26000000000, 1)");
    // Ten fewer spaces stand before the end of the head.
    let end = array.iter().position(|byte| *byte == b'\n').unwrap();
    assert!(array.drain(end - 10..end).all(|byte| byte == b' '));
    let mut long = array.clone();
    long[8..10].copy_from_slice(&[0xff, 0xff]);
    for (content, words) in [
        (
            &array,
            "pairs.npz: array \"obs\" states a shape of [26000000000, 1], but has 48 bytes",
        ),
        (
            &long,
            "pairs.npz: array \"obs\" has a head of 65535 bytes; accepted: up to 1000",
        ),
    ] {
        let mut npz = zip::ZipWriter::new(fs::File::create(dir.path().join("pairs.npz")).unwrap());
        npz.start_file("obs.npy", zip::write::SimpleFileOptions::default())
            .unwrap();
        npz.write_all(content).unwrap();
        npz.finish().unwrap();
        let told =
            stderr(&standfast(dir.path(), &["check", &file, "--contract=pairs.npz"]).code(2));
        assert!(told.contains(words), "wanted: {words}\n{told}");
    }
    fs::write(dir.path().join("pairs.npz"), "nothing").unwrap();
    let told = stderr(&standfast(dir.path(), &["check", &file, "--contract=pairs.npz"]).code(2));
    assert!(told.contains("pairs.npz"), "{told}");

    let hold = [
        "check",
        "hold",
        "--set=episode.horizon_s=0.6",
        "--contract=pairs.csv",
    ];
    fs::write(dir.path().join("pairs.csv"), "1,2\n").unwrap();
    let told = stderr(&standfast(dir.path(), &hold).code(2));
    assert!(
        told.contains("this controller takes no observations"),
        "{told}"
    );
}

/// The folder with the public policies and robots. It is None if the folder does not exist.
fn public() -> Option<PathBuf> {
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    let is_there = data.join("policies/holosoma-g1-ppo.onnx").is_file();
    if !is_there {
        eprintln!("left out: there are no public policies");
    }
    is_there.then_some(data)
}

/// The same policy as described by three trainers, each with the network that it needs.
#[test]
fn a_policy_is_written_from_what_its_training_left() {
    let dir = folder();
    let zero = |observed: usize, actions: usize| {
        linear(&vec![vec![0.0; actions]; observed], &vec![0.0; actions])
    };
    let write = |name: &str, network: Vec<u8>| fs::write(dir.path().join(name), network).unwrap();
    let init = |more: &[&str]| standfast(dir.path(), &[&["init", "--robot=ut-mu2"], more].concat());
    let written = |name: &str| -> toml::Table {
        fs::read_to_string(dir.path().join(name))
            .unwrap()
            .parse()
            .unwrap()
    };
    let numbers = |table: &toml::Table, key: &str| -> Vec<f64> {
        table[key]
            .as_array()
            .unwrap()
            .iter()
            .map(|number| number.as_float().unwrap())
            .collect()
    };
    let terms = |table: &toml::Table| -> Vec<String> {
        let terms = table["observation"].as_array().unwrap().iter();
        terms
            .map(|term| term["term"].as_str().unwrap().to_string())
            .collect()
    };

    let metadata = [
        ("joint_names", "left_ankle_flexion,right_ankle_flexion"),
        ("joint_stiffness", "80.000,81.000"),
        ("joint_damping", "2.500,2.600"),
        ("default_joint_pos", "0.442,0.442"),
        (
            "observation_names",
            "base_ang_vel,projected_gravity,joint_pos,actions,command",
        ),
        ("action_scale", "0.500"),
    ];
    write("lab.onnx", with_metadata(zero(13, 2), &metadata));
    let told = stdout(&init(&["lab.onnx"]).success());
    assert!(
        told.contains("drives 2 of the 20 joints of ut-mu2")
            && told.contains("period_s: mjlab's usual"),
        "{told}"
    );
    let lab = written("lab.toml");
    assert_eq!(
        (numbers(&lab, "stiffness"), numbers(&lab, "action_scale")),
        (vec![80.0, 81.0], vec![0.5; 2])
    );
    let seen = [
        "base_angular_velocity",
        "projected_gravity",
        "joint_positions",
        "last_action",
        "command",
    ];
    assert_eq!(terms(&lab), seen);
    let check = stdout(
        &standfast(
            dir.path(),
            &["check", "lab.toml", "--set=episode.horizon_s=1"],
        )
        .success(),
    );
    assert!(
        check.contains("projected_gravity") && check.contains("The first observation"),
        "{check}"
    );
    // An existing file is kept.
    assert!(stderr(&init(&["lab.onnx"]).code(2)).contains("this file is there already"));
    init(&["lab.onnx", "--force"]).success();

    // Only stiffness and damping are in the order of the motors.
    let robot = standfast::robots::load("ut-mu2").unwrap();
    let motor = |name: &str| {
        robot
            .joints
            .iter()
            .position(|joint| joint.name == name)
            .unwrap()
    };
    let [left, right] = ANKLES.map(motor);
    let each: Vec<String> = (0..20).map(|i| format!("{}.0", 50 + i)).collect();
    let each = each.join(", ");
    let deploy = format!(
        "joint_ids_map: [{right}, {left}]\nstep_dt: 0.02\nstiffness: [{each}]\ndamping: [{each}]\n\
         default_joint_pos: [0.4, 0.5]\nactions:\n  JointPositionAction:\n    clip: null\n    joint_names: [.*]\n    \
         scale: [0.25, 0.3]\n    offset: [0.4, 0.5]\n    \
         joint_ids: !!python/object/apply:builtins.slice [null, null, null]\n\
         observations:\n  base_ang_vel: {{params: {{}}, clip: [-2.0, 2.0], scale: [0.5, 0.5, 0.5], history_length: 3}}\n  \
         velocity_commands: {{params: {{command_name: x}}, clip: null, scale: [2.0, 2.0, 0.25], history_length: 1}}\n  \
         gait_phase: {{params: {{period: 0.8}}, clip: null, scale: [1.0, 1.0], history_length: 1}}\n"
    );
    fs::write(dir.path().join("deploy.yaml"), &deploy).unwrap();
    write("policy.onnx", zero(9 + 3 + 2, 2));
    let told = stdout(&init(&["policy.onnx"]).success());
    assert!(told.contains("by unitree_rl_lab, deploy.yaml"), "{told}");
    let lab = written("policy.toml");
    let joints: Vec<&str> = lab["joints"]
        .as_array()
        .unwrap()
        .iter()
        .map(|joint| joint.as_str().unwrap())
        .collect();
    assert_eq!(joints, [ANKLES[1], ANKLES[0]]);
    assert_eq!(
        numbers(&lab, "damping"),
        [50.0 + right as f64, 50.0 + left as f64]
    );
    assert_eq!(
        (numbers(&lab, "default_rad"), numbers(&lab, "action_scale")),
        (vec![0.4, 0.5], vec![0.25, 0.3])
    );
    let first = lab["observation"][0].as_table().unwrap();
    assert_eq!(
        (first["history"].as_integer(), first["clip"].as_float()),
        (Some(3), Some(1.0)),
        "clipped, then scaled"
    );
    assert_eq!(lab["observation"][1]["scale"].as_array().unwrap().len(), 3);
    assert_eq!(
        (terms(&lab)[2].as_str(), lab["gait"]["hz"].as_float()),
        ("phase", Some(1.25))
    );

    let gym = "simulation_dt: 0.002\ncontrol_decimation: 10\nkps: [100, 90]\nkds: [2, 1]\ndefault_angles: [0.0, 0.1]\n\
        ang_vel_scale: 0.25\ndof_pos_scale: 1.0\ndof_vel_scale: 0.05\naction_scale: 0.25\ncmd_scale: [2.0, 2.0, 0.25]\n\
        num_actions: 2\nnum_obs: 17\ncmd_init: [0.5, 0, 0]\n";
    // The file has a byte order mark, with which some editors begin a file.
    fs::write(dir.path().join("g.yaml"), format!("\u{feff}{gym}")).unwrap();
    let gym_text = gym;
    write("gym.onnx", zero(17, 2));
    let printed = stdout(&init(&["gym.onnx", "g.yaml", "--dry-run"]).success());
    let gym: toml::Table = printed.parse().unwrap();
    assert_eq!(
        (gym["period_s"].as_float(), gym["joints"][0].as_str()),
        (Some(0.02), Some(&*robot.joints[0].name))
    );
    assert!(
        printed.contains("assumed: the first 2 joints of ut-mu2") && terms(&gym).len() == 7,
        "{printed}"
    );

    for (network, more, words) in [
        (
            zero(3, 2),
            &["bad.onnx"][..],
            "says nothing of its joints and of what it observes",
        ),
        (
            zero(3, 2),
            &["bad.onnx", "deploy.yaml"],
            "takes 3 numbers, but the terms of its observation are 14",
        ),
        (
            zero(3, 2),
            &["bad.onnx", "odd.yaml"],
            "describes no policy that is known here",
        ),
        (
            zero(3, 2),
            &["bad.onnx", "gone.yaml"],
            "gone.yaml: cannot read",
        ),
        (
            zero(3, 2),
            &["bad.onnx", "term.yaml"],
            "observations.joint_effort = joint_effort: is no term",
        ),
        (
            zero(3, 2),
            &["bad.onnx", "map.yaml"],
            "joint_ids_map = 33: is no joint of the robot",
        ),
        (
            zero(3, 2),
            &["bad.onnx", "clip.yaml"],
            "is not the same on both sides",
        ),
        (
            zero(14, 2),
            &["bad.onnx", "offset.yaml", "--dry-run"],
            "actions.offset = Some([0.4, 0.6]): is another",
        ),
        (
            zero(14, 2),
            &["bad.onnx", "nan.yaml", "--dry-run"],
            "stiffness = [NaN, ",
        ),
        (
            zero(14, 2),
            &["bad.onnx", "gait.yaml"],
            "gait (1/s) = inf: is not positive",
        ),
        (
            with_metadata(zero(3, 2), &metadata[4..]),
            &["bad.onnx"],
            "metadata.joint_names = (none): is missing",
        ),
        (b"no network".to_vec(), &["bad.onnx"], "cannot be read"),
        (
            zero(17, 2),
            &["bad.onnx", "real.yaml"],
            "for the robot itself (deploy_real): does not state simulation_dt",
        ),
        (
            zero(17, 2),
            &["bad.onnx", "sar.yaml"],
            "missing field `rl_kd`",
        ),
        (
            zero(17, 2),
            &["motion.pt"],
            "motion.pt: cannot be read: it is no ZIP archive, or not all of one",
        ),
    ] {
        write("bad.onnx", network);
        // A description where a trainer puts it would be read.
        let _ = fs::remove_file(dir.path().join("deploy.yaml"));
        if more.iter().any(|option| option.contains("deploy")) {
            fs::write(dir.path().join("deploy.yaml"), &deploy).unwrap();
        }
        for (name, text) in [
            ("odd.yaml", "a: 1\n".to_string()),
            (
                "term.yaml",
                deploy.replace("velocity_commands", "joint_effort"),
            ),
            ("map.yaml", deploy.replace(&format!("[{right}, "), "[33, ")),
            (
                "offset.yaml",
                deploy.replace("offset: [0.4, 0.5]", "offset: [0.4, 0.6]"),
            ),
            (
                "nan.yaml",
                deploy.replace(&format!(" {}.0,", 50 + right), " .nan,"),
            ),
            ("gait.yaml", deploy.replace("period: 0.8", "period: 0.0")),
            (
                "real.yaml",
                gym_text.replace(
                    "simulation_dt: 0.002\ncontrol_decimation: 10",
                    "control_dt: 0.02",
                ),
            ),
            (
                "sar.yaml",
                "gr1t1/legged_gym:\n  rl_kp: [57.0]\n".to_string(),
            ),
            ("motion.pt", "PK\x03\x04".to_string()),
            ("clip.yaml", deploy.replace("[-2.0, 2.0]", "[-1.0, 2.0]")),
        ] {
            fs::write(dir.path().join(name), text).unwrap();
        }
        let told = stderr(&init(more).code(2));
        assert!(
            told.contains(words) && !dir.path().join("bad.toml").exists(),
            "wanted: {words}\n{told}"
        );
    }
    let told = stderr(&standfast(dir.path(), &["init", "bad.onnx"]).code(2));
    assert!(
        told.contains("--robot = (none): is needed with a policy"),
        "{told}"
    );
    let told = stderr(&standfast(dir.path(), &["init", "x.urdf", "--robot=ut-mu2"]).code(2));
    assert!(told.contains("is for the robot of a policy"), "{told}");
}

/// The locomotion policies of holosoma and unitree_rl_lab (Apache-2.0), of ASAP and of FALCON (MIT) stand on the G1 of
/// Unitree with the files that `init` writes, and recover from pushes that stiff joints lose.
#[test]
fn real_policies_stand_and_recover() {
    let Some(data) = public() else { return };
    let dir = folder();
    let urdf = fs::read_to_string(data.join("robots/g1/g1_29dof_rev_1_0.urdf")).unwrap();
    fs::write(dir.path().join("g1.urdf"), urdf).unwrap();
    fs::create_dir(dir.path().join("meshes")).unwrap();
    for mesh in fs::read_dir(data.join("robots/g1/meshes"))
        .unwrap()
        .map(|mesh| mesh.unwrap())
    {
        fs::copy(
            mesh.path(),
            dir.path().join("meshes").join(mesh.file_name()),
        )
        .unwrap();
    }
    standfast(dir.path(), &["init", "g1.urdf"]).success();
    for file in [
        "holosoma-g1-ppo.onnx",
        "unitree-g1-velocity.onnx",
        "unitree-g1-velocity.deploy.yaml",
    ] {
        fs::copy(data.join("policies").join(file), dir.path().join(file)).unwrap();
    }
    for (file, as_file) in [
        ("g1-asap-loco/model_6600.onnx", "asap.onnx"),
        ("g1-asap-loco/g1_29dof_hist.yaml", "asap.yaml"),
        ("g1-falcon/g1_29dof.onnx", "falcon.onnx"),
        ("g1-falcon/g1_29dof_falcon.yaml", "falcon.yaml"),
    ] {
        fs::copy(data.join("policies").join(file), dir.path().join(as_file)).unwrap();
    }
    let outcome = |controller: &str, heading: &str| {
        let push = [
            "push",
            "--robot=g1.urdf",
            "--impulse=30",
            "--set=push.start_s=2",
            "--json",
            "--heading",
            heading,
        ];
        let told = stdout(
            &standfast(
                dir.path(),
                &[&push[..], &["--controller", controller]].concat(),
            )
            .success(),
        );
        serde_json::from_str::<Value>(&told).unwrap()["outcome"]
            .as_str()
            .unwrap()
            .to_string()
    };
    for (policy, recovers) in [
        ("holosoma-g1-ppo", &["0", "90"][..]),
        ("unitree-g1-velocity", &["90"]),
        ("asap", &["0"]),
        ("falcon", &["90"]),
    ] {
        standfast(
            dir.path(),
            &["init", &format!("{policy}.onnx"), "--robot=g1.urdf"],
        )
        .success();
        let policy = format!("{policy}.toml");
        let check = standfast(dir.path(), &["check", &policy, "--robot=g1.urdf"]).success();
        assert!(
            stdout(&check).contains("it stands still at the end of the episode"),
            "{}",
            stdout(&check)
        );
        for heading in recovers {
            let outcomes = [outcome("hold", heading), outcome(&policy, heading)];
            assert_eq!(
                outcomes,
                ["Fell", "Recovered"],
                "{policy}: 30 N s towards {heading} degrees"
            );
        }
    }
}
