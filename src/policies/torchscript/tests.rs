//! Archives that the tests write, the public ones if they are available, and archives that are damaged.

use super::network;
use crate::net::{self, Ends, Net, Outputs};
use crate::proto;
use std::io::{Cursor, Write};
use std::path::Path;
use tract_onnx::pb::{ModelProto, ValueInfoProto};
use tract_onnx::prelude::*;
use zip::write::{SimpleFileOptions, ZipWriter};

/// The actions for rows of observations, with each memory handed on.
fn run(mut model: ModelProto, rows: &[Vec<f32>]) -> Vec<Vec<f32>> {
    let graph = proto::check(&mut model).unwrap();
    let names = |ends: &[ValueInfoProto]| -> Vec<String> {
        ends.iter().map(|end| end.name.clone()).collect()
    };
    let (inputs, outputs) = (names(&graph.input), names(&graph.output));
    let model = tract_onnx::onnx().model_for_proto_model(&model).unwrap();
    let zero = |i: usize| {
        let sizes = model.input_fact(i).unwrap().shape.as_concrete_finite();
        Tensor::zero::<f32>(&sizes.unwrap().unwrap()).unwrap()
    };
    let mut values: Vec<Tensor> = (0..inputs.len()).map(zero).collect();
    let model = model.into_optimized().unwrap().into_runnable().unwrap();
    let mut actions = Vec::new();
    for row in rows {
        values[0] = Tensor::from_shape(&[1, row.len()], row).unwrap();
        let given = values.iter().map(|value| value.clone().into_tvalue());
        let made = model.run(given.collect()).unwrap();
        let action = made[0].to_plain_array_view::<f32>().unwrap();
        actions.push(action.iter().copied().collect());
        for (name, value) in outputs.iter().zip(made).skip(1) {
            let start = name.strip_suffix("_out").unwrap().to_string() + "_in";
            let at = inputs.iter().position(|input| *input == start).unwrap();
            values[at] = value.into_tensor();
        }
    }
    actions
}

fn assert_close(got: &[Vec<f32>], wanted: &[Vec<f32>]) {
    assert_eq!(got.len(), wanted.len());
    for (got, wanted) in got.iter().zip(wanted) {
        assert_eq!(got.len(), wanted.len());
        for (a, b) in got.iter().zip(wanted) {
            assert!((a - b).abs() < 1e-5, "{got:?}\n{wanted:?}");
        }
    }
}

/// Numbers between -0.5 and 0.5.
fn some(count: usize, seed: usize) -> Vec<f32> {
    let one = |i: usize| ((37 * i + 11 * seed) % 101) as f32 / 100.0 - 0.5;
    (0..count).map(one).collect()
}

fn rows(count: usize, observed: usize) -> Vec<Vec<f32>> {
    let row = |tick: usize| some(observed, 5 + tick).iter().map(|x| 4.0 * x).collect();
    (0..count).map(row).collect()
}

/// Rows of `matrix` times `x`, plus `bias`.
fn linear(matrix: &[f32], bias: &[f32], x: &[f32]) -> Vec<f32> {
    let rows = matrix.chunks_exact(x.len()).zip(bias);
    let row =
        |(row, bias): (&[f32], &f32)| bias + row.iter().zip(x).map(|(a, b)| a * b).sum::<f32>();
    rows.map(row).collect()
}

/// The pickles that torch writes.
mod pickle {
    pub fn text(text: &str) -> Vec<u8> {
        [
            b"X",
            &(text.len() as u32).to_le_bytes()[..],
            text.as_bytes(),
        ]
        .concat()
    }

    fn tuple(parts: &[Vec<u8>]) -> Vec<u8> {
        [&b"("[..], &parts.concat(), b"t"].concat()
    }

    fn sizes(values: &[usize]) -> Vec<u8> {
        let one = |value: &usize| [b"J", &(*value as i32).to_le_bytes()[..]].concat();
        tuple(&values.iter().map(one).collect::<Vec<_>>())
    }

    /// A tensor of the numbers in `data/FILE`, in the order of its rows.
    pub fn tensor(kind: &str, file: usize, dims: &[usize]) -> Vec<u8> {
        let strides: Vec<usize> = (1..=dims.len())
            .map(|i| dims[i..].iter().product())
            .collect();
        let kind = format!("ctorch\n{kind}\n").into_bytes();
        let storage = [
            text("storage"),
            kind,
            text(&file.to_string()),
            text("cpu"),
            b"K\x01".into(),
        ];
        let parts = [
            [tuple(&storage), b"Q".into()].concat(),
            b"K\0".into(),
            sizes(dims),
            sizes(&strides),
            b"\x89".into(),
            b"ccollections\nOrderedDict\n)R".into(),
        ];
        [
            &b"ctorch._utils\n_rebuild_tensor_v2\n"[..],
            &tuple(&parts),
            b"R",
        ]
        .concat()
    }

    pub fn module(class: &str, state: &[(&str, Vec<u8>)]) -> Vec<u8> {
        let (file, name) = class.rsplit_once('.').unwrap();
        let entries = state
            .iter()
            .map(|(name, value)| [text(name), value.clone()].concat());
        let entries: Vec<u8> = entries.flatten().collect();
        let class = format!("c{file}\n{name}\n)");
        [class.as_bytes(), b"\x81}(", &entries, b"ub"].concat()
    }
}

/// The content of an archive.
#[derive(Clone, Default)]
struct Parts {
    root: Vec<u8>,
    /// Paths within `code/__torch__` and texts.
    code: Vec<(&'static str, String)>,
    numbers: Vec<Vec<f32>>,
}

impl Parts {
    /// Adds numbers, and returns the pickle of their tensor.
    fn tensor(&mut self, sizes: &[usize]) -> Vec<u8> {
        let file = self.numbers.len();
        self.numbers.push(some(sizes.iter().product(), file));
        pickle::tensor("FloatStorage", file, sizes)
    }

    fn archive(&self) -> Vec<u8> {
        let mut files = vec![
            (
                "data.pkl".to_string(),
                [b"\x80\x02", &self.root[..], b"."].concat(),
            ),
            ("constants.pkl".to_string(), b"\x80\x02).".to_vec()),
        ];
        for (path, text) in &self.code {
            files.push((
                format!("code/__torch__{path}.py"),
                text.clone().into_bytes(),
            ));
        }
        for (file, numbers) in self.numbers.iter().enumerate() {
            let bytes = numbers
                .iter()
                .flat_map(|number| number.to_le_bytes())
                .collect();
            files.push((format!("data/{file}"), bytes));
        }
        zipped(&files)
    }

    fn network(&self) -> Result<ModelProto, String> {
        network(&self.archive())
    }
}

fn zipped(files: &[(String, Vec<u8>)]) -> Vec<u8> {
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in files {
        zip.start_file(format!("policy/{name}"), SimpleFileOptions::default())
            .unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap().into_inner()
}

/// The class of a linear layer.
const LINEAR: &str = "class Linear(Module):
  weight : Tensor
  bias : Tensor
  def forward(self: __torch__.nn.Linear,
    input: Tensor) -> Tensor:
    weight = self.weight
    bias = self.bias
    return torch.linear(input, weight, bias)
";

/// A module at the root, with `forward` of one row, and the classes of layers beside it.
fn policy(state: &[(&str, Vec<u8>)], body: &str, parts: Parts) -> Parts {
    let lines: String = body.lines().map(|line| format!("    {line}\n")).collect();
    let forward = format!(
        "class Policy(Module):\n  def forward(self: __torch__.Policy,\n    x: Tensor) -> Tensor:\n{lines}"
    );
    Parts {
        root: pickle::module("__torch__.Policy", state),
        code: vec![("", forward), ("/nn", LINEAR.into())],
        ..parts
    }
}

fn layer(parts: &mut Parts, [outputs, inputs]: [usize; 2]) -> Vec<u8> {
    let (weight, bias) = (parts.tensor(&[outputs, inputs]), parts.tensor(&[outputs]));
    pickle::module("__torch__.nn.Linear", &[("weight", weight), ("bias", bias)])
}

/// A normaliser, an estimator of the last 4 of 6 numbers, and an actor of the first 2 and of what is estimated.
fn estimating() -> Parts {
    let mut parts = Parts::default();
    let state = [
        ("training", b"\x89".to_vec()),
        ("eps", [b"G", &0.75_f64.to_be_bytes()[..]].concat()),
        ("mean", parts.tensor(&[1, 6])),
        ("std", parts.tensor(&[1, 6])),
        ("estimator", layer(&mut parts, [3, 4])),
        ("actor", layer(&mut parts, [2, 5])),
    ];
    let body = "if self.training:
  ops.prim.RaiseException(\"in training\")
else:
  pass
n = torch.div(torch.sub(x, self.mean), torch.add(self.std, self.eps))
estimator = self.estimator
_0 = (estimator).forward(torch.slice(torch.slice(n), 1, -4), )
z = torch.elu(_0, 0.5)
seen = torch.cat([torch.slice(n, -1, 0, 2), z], -1)
return torch.clamp((self.actor).forward(seen, ), -0.3, 0.3)";
    policy(&state, body, parts)
}

#[test]
fn layers_are_built_as_the_code_says() {
    let parts = estimating();
    let [mean, std, weight, bias, actor, offset] = &parts.numbers[..] else {
        panic!("so many tensors were written");
    };
    let rows: Vec<Vec<f32>> = (0..5).map(|tick| some(6, tick)).collect();
    let wanted: Vec<Vec<f32>> = rows
        .iter()
        .map(|row| {
            let n: Vec<f32> = (0..6)
                .map(|i| (row[i] - mean[i]) / (std[i] + 0.75))
                .collect();
            let estimated = linear(weight, bias, &n[2..]).into_iter();
            let z = estimated.map(|z| if z > 0.0 { z } else { 0.5 * (z.exp() - 1.0) });
            let seen: Vec<f32> = n[..2].iter().copied().chain(z).collect();
            let action = linear(actor, offset, &seen).into_iter();
            action.map(|a| a.clamp(-0.3, 0.3)).collect()
        })
        .collect();
    let clamped = wanted.iter().flatten().filter(|a| a.abs() == 0.3).count();
    assert!(clamped > 0 && clamped < 10, "{wanted:?}");
    assert_close(&run(parts.network().unwrap(), &rows), &wanted);
    // The file of a policy may name such an archive.
    let read = |observed: usize| {
        let ends = Ends {
            observed: vec![(None, observed)],
            outputs: Outputs::default(),
            actions: 2,
        };
        let parts = net::Parts {
            model: parts.archive(),
            weights: Vec::new(),
        };
        Net::of(parts, ends)
    };
    let net = read(6).unwrap();
    let answer = net.run(&rows[..1], &mut net.fresh()).unwrap();
    assert_close(&[answer.action], &wanted[..1]);
    let problem = read(7).err().unwrap();
    assert!(problem.contains("takes 6 numbers"), "{problem}");
}

fn sigmoid(x: f32) -> f32 {
    1.0 / (1.0 + (-x).exp())
}

/// The weights of recurrent layers with `gates` gates, and the pickle of their list.
fn recurrent(
    parts: &mut Parts,
    gates: usize,
    layers: usize,
    [observed, size]: [usize; 2],
) -> Vec<u8> {
    let mut list = b"](".to_vec();
    for layer in 0..layers {
        let inputs = if layer == 0 { observed } else { size };
        list.extend(parts.tensor(&[gates * size, inputs]));
        list.extend(parts.tensor(&[gates * size, size]));
        list.extend(parts.tensor(&[gates * size]));
        list.extend(parts.tensor(&[gates * size]));
    }
    [&list[..], b"e"].concat()
}

fn zeros(parts: &mut Parts, sizes: &[usize]) -> Vec<u8> {
    let tensor = parts.tensor(sizes);
    parts.numbers.last_mut().unwrap().fill(0.0);
    tensor
}

#[test]
fn the_memory_of_an_lstm_becomes_inputs_and_outputs() {
    let mut parts = Parts::default();
    let state = [
        ("weights", recurrent(&mut parts, 4, 2, [3, 2])),
        ("hidden", zeros(&mut parts, &[2, 1, 2])),
        ("cell", zeros(&mut parts, &[2, 1, 2])),
    ];
    let body = "_0 = [self.hidden, self.cell]
out, h, c = torch.lstm(torch.unsqueeze(x, 0), _0, self.weights, True, 2, 0., False, False, False)
_1 = torch.copy_(torch.slice(self.hidden), h)
_2 = torch.copy_(torch.slice(self.cell), c)
return torch.squeeze(out, 0)";
    let parts = policy(&state, body, parts);
    let rows = rows(4, 3);
    let (mut hidden, mut cell) = ([[0.0; 2]; 2], [[0.0; 2]; 2]);
    let mut wanted = Vec::new();
    for row in &rows {
        let mut x = row.clone();
        for layer in 0..2 {
            let [input, own, bias, own_bias] = &parts.numbers[4 * layer..4 * layer + 4] else {
                panic!("a layer has four tensors");
            };
            let (a, b) = (
                linear(input, bias, &x),
                linear(own, own_bias, &hidden[layer]),
            );
            let gate = |i: usize| a[i] + b[i];
            for i in 0..2 {
                let kept = sigmoid(gate(2 + i)) * cell[layer][i];
                cell[layer][i] = kept + sigmoid(gate(i)) * gate(4 + i).tanh();
                hidden[layer][i] = sigmoid(gate(6 + i)) * cell[layer][i].tanh();
            }
            x = hidden[layer].into();
        }
        wanted.push(x);
    }
    let made = parts.network().unwrap();
    let graph = made.graph.as_ref().unwrap();
    let names = |ends: &[ValueInfoProto]| -> Vec<String> {
        ends.iter().map(|end| end.name.clone()).collect()
    };
    assert_eq!(names(&graph.input), ["obs", "h_in", "c_in"]);
    assert_eq!(names(&graph.output), ["actions", "h_out", "c_out"]);
    assert_close(&run(made, &rows), &wanted);
    // A memory that the file leaves at other numbers would start at those.
    let mut dirty = parts;
    dirty.numbers[8][3] = 0.25;
    let problem = dirty.network().unwrap_err();
    assert!(
        problem.contains("memory \"hidden\" does not start at 0"),
        "{problem}"
    );
}

#[test]
fn the_memory_of_a_gru_and_a_history_become_inputs_and_outputs() {
    let mut parts = Parts::default();
    let state = [
        ("weights", recurrent(&mut parts, 3, 1, [4, 2])),
        ("hidden", zeros(&mut parts, &[1, 1, 2])),
        ("older", zeros(&mut parts, &[1, 2])),
        ("past", zeros(&mut parts, &[1, 2])),
    ];
    let body = "seen = torch.cat([self.older, x], 1)
self.older = self.past
self.past = x
out, h = torch.gru(torch.unsqueeze(seen, 0), self.hidden, self.weights, True, 1, 0., True, False, False)
self.hidden = h
return torch.squeeze(out, 0)";
    let parts = policy(&state, body, parts);
    let [input, own, bias, own_bias, ..] = &parts.numbers[..] else {
        panic!("a layer has four tensors");
    };
    let rows = rows(4, 2);
    let (mut hidden, mut past) = (vec![0.0; 2], [vec![0.0; 2], vec![0.0; 2]]);
    let mut wanted = Vec::new();
    for row in &rows {
        let (a, b) = (
            linear(input, bias, &[&past[0][..], row].concat()),
            linear(own, own_bias, &hidden),
        );
        let next = |i: usize| {
            let (reset, update) = (sigmoid(a[i] + b[i]), sigmoid(a[2 + i] + b[2 + i]));
            (1.0 - update) * (a[4 + i] + reset * b[4 + i]).tanh() + update * hidden[i]
        };
        hidden = vec![next(0), next(1)];
        past = [past[1].clone(), row.clone()];
        wanted.push(hidden.clone());
    }
    let made = parts.network().unwrap();
    let inputs = made.graph.as_ref().unwrap().input.iter();
    assert_eq!(
        inputs.map(|end| &end.name).collect::<Vec<_>>(),
        ["obs", "h_in", "older_in", "past_in"]
    );
    assert_close(&run(made, &rows), &wanted);
}

#[test]
fn public_policies_do_what_others_made_of_them() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data/policies");
    if !folder.join("t1-booster-gym/T1.pt").is_file() {
        eprintln!("left out: there are no public policies");
        return;
    }
    let read = |name: &str| std::fs::read(folder.join(name)).unwrap();
    let cases = [
        ("g1-unitree-rl-gym/motion", 47),
        ("h1-unitree-rl-gym/motion", 41),
        ("t1-booster-deploy/t1_walk", 720),
        ("t1-booster-gym/T1", 47),
        ("xbot-humanoid-gym/policy_example", 705),
    ];
    for (name, observed) in cases {
        let ours = network(&read(&format!("{name}.pt"))).unwrap();
        let theirs = proto::read(&read(&format!("{name}.converted.onnx"))).unwrap();
        let rows = rows(6, observed);
        assert_close(&run(ours, &rows), &run(theirs, &rows));
    }
    // What torch 2.9 gives for the one that nobody converted.
    let row = (0..39).map(|i| 0.1 * ((7 * i) % 11 - 5) as f32).collect();
    let wanted = [
        -0.373_505_86,
        -0.620_929_24,
        0.442_375_12,
        -3.118_694,
        0.301_304_73,
        -0.200_428_16,
        0.144_588_89,
        -0.372_542_83,
        -0.170_072_47,
        -0.159_918_74,
    ];
    let ours = network(&read("gr1t1-rl-sar/model_4000_jit.pt")).unwrap();
    assert_close(&run(ours, &[row]), &[wanted.into()]);
}

/// The estimating policy with one change.
fn changed(change: impl FnOnce(&mut Parts)) -> Vec<u8> {
    let mut parts = estimating();
    change(&mut parts);
    parts.archive()
}

/// The estimating policy with other code in the place of a part of its code.
fn coded(from: &str, to: &str) -> Vec<u8> {
    changed(|parts| {
        assert!(parts.code[0].1.contains(from));
        parts.code[0].1 = parts.code[0].1.replace(from, to);
    })
}

#[test]
fn what_is_not_taken_is_told_in_words() {
    let named = |name: &str| {
        let root = format!("c{}\n(X\x06\0\0\0reboottR", name.replacen('.', "\n", 1));
        changed(|parts| parts.root = root.into_bytes())
    };
    let whole = estimating().archive();
    let last = "return torch.clamp((self.actor).forward(seen, ), -0.3, 0.3)";
    let gates = |sizes: [usize; 2]| {
        let mut parts = Parts::default();
        let weights = recurrent(&mut parts, 3, 1, sizes);
        let hidden = zeros(&mut parts, &[1, 1, 2]);
        let body = "_0, _1 = torch.gru(torch.unsqueeze(x, 0), self.h, self.w, True, 1, 0., False, False, False)\nreturn _0";
        policy(&[("w", weights), ("h", hidden)], body, parts).archive()
    };
    let cases: Vec<(Vec<u8>, &str)> = vec![
        (
            b"PK and so on".to_vec(),
            "it is no ZIP archive, or not all of one",
        ),
        (
            whole[..whole.len() - 30].to_vec(),
            "it is no ZIP archive, or not all of one",
        ),
        (
            zipped(&[("weights.npy".into(), vec![7])]),
            "a ZIP archive without data.pkl",
        ),
        (
            zipped(&[("data.pkl".into(), b"\x80\x02N.".to_vec())]),
            "it is a checkpoint, which has numbers and no code",
        ),
        (
            named("os.system"),
            "its data.pkl names os.system, which no policy needs",
        ),
        (named("builtins.eval"), "names builtins.eval"),
        (
            named("torch.storage._load_from_bytes"),
            "names torch.storage._load_from_bytes",
        ),
        (
            changed(|parts| parts.root.truncate(100)),
            "its data.pkl ends too early",
        ),
        (
            changed(|parts| parts.root = b"cposix\nsystem\n".into()),
            "names posix.system",
        ),
        (
            changed(|parts| parts.root = b"\x93".into()),
            "has the instruction 0x93",
        ),
        (
            changed(|parts| parts.root = vec![b'('; 2 << 20]),
            "unpacks to more than 1048576 bytes",
        ),
        (
            changed(|parts| parts.root = b"]q\0h\0a".into()),
            "forward is called on what is no module",
        ),
        (
            changed(|parts| parts.numbers[2].truncate(11)),
            "[3, 4] numbers needs more than the 44 bytes",
        ),
        (
            changed(|parts| {
                let huge = pickle::tensor("FloatStorage", 0, &[1 << 20, 1 << 20, 6]);
                parts.root = pickle::module("__torch__.Policy", &[("mean", huge)]);
                parts.code[0].1 = parts.code[0]
                    .1
                    .replace("if self.training:", "if torch.eq(1, torch.dim(self.mean)):");
            }),
            "makes a tensor of [1048576, 1048576, 6] numbers; up to",
        ),
        (
            changed(|parts| {
                let half = pickle::tensor("HalfStorage", 0, &[1, 6]);
                parts.root = pickle::module("__torch__.Policy", &[("mean", half)]);
                parts.code[0].1 = parts.code[0].1.replace(
                    "if self.training:",
                    "return torch.add(x, self.mean)\n    if x:",
                );
            }),
            "numbers of the kind HalfStorage; accepted: float32",
        ),
        (
            coded(last, "return torch.conv1d(seen, self.mean)"),
            "its torch.conv1d: this operation is not taken",
        ),
        (
            coded(last, "return torch.elu(seen, 1., 2.)"),
            "its torch.elu: a factor or step of 2 is not taken",
        ),
        (
            coded(last, "return torch.elu(seen, 1., gain=1.)"),
            "its torch.elu: the argument \"gain\" is not taken",
        ),
        (
            coded(last, "return torch.dropout(seen, 0.1, True)"),
            "drops numbers at random",
        ),
        (
            coded(last, "return (seen, n)"),
            "does not return one tensor",
        ),
        (
            coded(last, "return torch.add(seen, self.mean)"),
            "sizes do not fit: [5] and [6]",
        ),
        (
            coded(last, "for i in range(3):\n      return n"),
            "a statement `for`",
        ),
        (
            coded(last, "return os.system(\"reboot\")"),
            "its code calls os.system, which is not taken",
        ),
        (
            coded(last, "return (self.critic).forward(seen, )"),
            "a module has no \"critic\"",
        ),
        (
            coded(last, "self.eps = 1.\n    return seen"),
            "\"eps\" of a module changes from row to row",
        ),
        (
            coded(last, "if torch.gt(seen, 0):\n      pass\n    return seen"),
            "its torch.gt: it is called with something else",
        ),
        (
            coded(last, "return (self).forward(x, )"),
            "more than 40 calls within each other",
        ),
        (
            coded(
                last,
                "_9 = torch.slice(n, 1, 0, 3)\n    _8 = torch.relu_(n)\n    return _9",
            ),
            "a part of a tensor that was changed meanwhile",
        ),
        (
            coded(
                last,
                &format!("return {}x{}", "(".repeat(5000), ")".repeat(5000)),
            ),
            "brackets and dots in each other",
        ),
        (
            coded(last, &format!("return x{}", ".y".repeat(5000))),
            "brackets and dots in each other",
        ),
        (
            coded(last, &format!("return {}1", "-".repeat(5000))),
            "is not expected here",
        ),
        (coded(last, "return \"seen"), "a text without an end"),
        (
            coded("x: Tensor) ->", "x: Tensor, h: Tensor) ->"),
            "its forward takes [\"x\", \"h\"]",
        ),
        (
            coded("def forward(", "def forwards("),
            "no method __torch__.Policy.forward",
        ),
        (gates([4, 3]), "sizes do not fit"),
    ];
    for (bytes, words) in cases {
        let problem = network(&bytes).expect_err(words);
        assert!(problem.contains(words), "wanted: {words}\n{problem}");
        let (read, taken) = (
            problem.starts_with("cannot be read: "),
            problem.contains("torch.onnx.export(torch.jit"),
        );
        assert!(read != taken, "{problem}");
    }
    let in_training = changed(|parts| {
        let at = parts.root.iter().position(|byte| *byte == 0x89).unwrap();
        parts.root[at] = 0x88;
    });
    let problem = network(&in_training).unwrap_err();
    assert!(
        problem.contains("ends with an error for a row of numbers: in training"),
        "{problem}"
    );
}

/// Each byte of the pickle and of the code is replaced once by several others, and left out once.
#[test]
fn any_damage_is_told_in_words() {
    let parts = estimating();
    let code = parts.code[0].1.clone().into_bytes();
    let mut refused = 0;
    let mut try_one = |damaged: Parts| match damaged.network() {
        Ok(made) => {
            let mut made = made;
            proto::check(&mut made).unwrap();
        }
        Err(problem) => {
            refused += 1;
            assert!(problem.len() > 20, "{problem}");
        }
    };
    for at in 0..parts.root.len().max(code.len()) {
        for new in [
            None,
            Some(0),
            Some(b'('),
            Some(b'R'),
            Some(b'.'),
            Some(0xff),
        ] {
            let damage = |bytes: &[u8]| {
                let (before, after) = bytes.split_at(at.min(bytes.len() - 1));
                [before, new.as_slice(), &after[1..]].concat()
            };
            try_one(Parts {
                root: damage(&parts.root),
                ..parts.clone()
            });
            let mut damaged = parts.clone();
            damaged.code[0].1 = String::from_utf8_lossy(&damage(&code)).into();
            try_one(damaged);
        }
    }
    assert!(refused > 1000, "{refused}");
    let whole = parts.archive();
    for end in (0..whole.len()).step_by(7) {
        network(&whole[..end]).unwrap_err();
    }
}
