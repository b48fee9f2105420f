//! The network, read from an ONNX file and run by `tract`, on one thread and to the same bits everywhere.

use super::limited::MOST_NUMBERS;
use super::limited::limited;
use super::proto;
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, HashMap};
use std::iter;
use std::sync::Arc;
use tract_onnx::pb::GraphProto;
use tract_onnx::prelude::*;
use tract_onnx::tract_hir::infer::Factoid;

/// Largest number of values in all tensors of a network together.
const MOST_OF_ALL: u64 = 4 * MOST_NUMBERS;

/// A network that turns an observation into an action.
pub struct Net {
    model: Arc<TypedRunnableModel>,
    /// The inputs of the network, in its order.
    inputs: Vec<Input>,
    /// The outputs with the action, and with the stiffness and the damping of servos.
    action: usize,
    gains: Option<[usize; 2]>,
    /// The output that each part of the memory takes its next value from.
    kept: Vec<usize>,
}

struct Input {
    shape: Vec<usize>,
    takes: Takes,
}

/// What an input takes: an observed input or a part of the memory, by its index.
#[derive(Clone, Copy)]
enum Takes {
    Observed(usize),
    Kept(usize),
}

/// The outputs of a network by their meaning, and its memory: which output each input is fed from at the next action. All
/// of it may be left out: other inputs `x_in`, or `x`, are fed from outputs `x_out`, and the action is the only other
/// output.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Outputs {
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub action: Option<String>,
    /// Stiffness and damping of the servos, at each action.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<String>,
    /// From input to output.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub memory: BTreeMap<String, String>,
}

/// What a file says of a network: its observed inputs with their number of numbers, its outputs, and its number of actions.
#[derive(Debug, Clone)]
pub struct Ends {
    /// The name is None for the only input that is not fed from an output.
    pub observed: Vec<(Option<String>, usize)>,
    pub outputs: Outputs,
    pub actions: usize,
}

/// What a network keeps from one action to the next: the values of its memory.
pub type Kept = Vec<Vec<f32>>;

/// The action of a network, and the stiffness and damping of servos if it gives them.
pub struct Answer {
    pub action: Vec<f32>,
    pub gains: Option<[Vec<f32>; 2]>,
}

/// A network's file, and the files beside it with its weights.
#[derive(Clone)]
pub struct Parts {
    pub model: Vec<u8>,
    pub weights: Vec<(String, Vec<u8>)>,
}

/// The metadata of a network's file: names and texts. Errors are in words.
pub fn metadata(bytes: &[u8]) -> Result<HashMap<String, String>, String> {
    let bytes = bytes.to_vec();
    limited(move || {
        let model = proto::read(&bytes)?;
        Ok(model
            .metadata_props
            .into_iter()
            .map(|prop| (prop.key, prop.value))
            .collect())
    })
}

/// The names of the files with a network's weights, in the folder of its file. Errors are in words.
pub fn weight_files(bytes: &[u8]) -> Result<Vec<String>, String> {
    let bytes = bytes.to_vec();
    limited(move || Ok(proto::weight_files(&mut proto::read(&bytes)?)))
}

impl Net {
    /// Reads a network that has these `ends`. Errors are in words: the network does not fit, or would take too much time
    /// or memory.
    pub fn of(parts: Parts, ends: Ends) -> Result<Self, String> {
        limited(move || Self::prepared(&parts, &ends))
    }

    fn prepared(parts: &Parts, ends: &Ends) -> Result<Self, String> {
        let mut proto = proto::read(&parts.model)?;
        proto::join(&mut proto, &parts.weights)?;
        let wires = Wires::of(proto::check(&mut proto)?, ends)?;
        let mut model = tract_onnx::onnx()
            .model_for_proto_model(&proto)
            .map_err(in_words)?;
        let mut inputs = Vec::new();
        for (i, (name, takes)) in wires.inputs.iter().enumerate() {
            let input = model.input_fact(i).map_err(in_words)?;
            if let Some(kind) = input.datum_type.concretize()
                && kind != f32::datum_type()
            {
                return Err(format!(
                    "its input {name:?} takes numbers of the kind {kind:?}; only float32 is taken"
                ));
            }
            // A size that the file leaves open is the batch size, which is 1 here.
            let sizes = input.shape.dims().map(|dim| {
                let size = dim.concretize().and_then(|size| size.to_i64().ok());
                size.and_then(|size| usize::try_from(size).ok())
                    .unwrap_or(1)
            });
            let shape: Vec<usize> = sizes.collect();
            let numbers = shape
                .iter()
                .try_fold(1_usize, |product, size| product.checked_mul(*size))
                .filter(|numbers| *numbers as u64 <= MOST_NUMBERS);
            let Some(numbers) = numbers else {
                let problem = format!("its input {name:?} takes {shape:?} numbers");
                return Err(format!("{problem}; up to {MOST_NUMBERS} are taken"));
            };
            if let Takes::Observed(index) = *takes
                && numbers != ends.observed[index].1
            {
                let observed = ends.observed[index].1;
                let its = match wires.inputs.len() {
                    1 => String::new(),
                    _ => format!(" at its input {name:?}"),
                };
                return Err(format!(
                    "takes {numbers} numbers{its}, but the terms of its observation are {observed}"
                ));
            }
            model
                .set_input_fact(i, f32::fact(&shape).into())
                .map_err(in_words)?;
            inputs.push(Input {
                shape,
                takes: *takes,
            });
        }
        let mut numbers = Numbers::default();
        numbers.bound(&mut model)?;
        let model = model.into_typed().map_err(in_words)?;
        numbers.check(&model)?;
        let model = model
            .into_optimized()
            .and_then(|model| model.into_runnable())
            .map_err(in_words)?;
        let Wires {
            action,
            gains,
            kept,
            ..
        } = wires;
        let net = Self {
            model,
            inputs,
            action,
            gains,
            kept,
        };
        let observed: Vec<Vec<f32>> = ends
            .observed
            .iter()
            .map(|(_, numbers)| vec![0.0; *numbers])
            .collect();
        let fresh = net.fresh();
        let mut kept = fresh.clone();
        let answer = net.run(&observed, &mut kept)?;
        for (part, (before, after)) in fresh.iter().zip(&kept).enumerate() {
            if before.len() != after.len() {
                let (takes, gives) = (before.len(), after.len());
                let name = &wires.kept_names[part];
                return Err(format!(
                    "feeds {gives} numbers back to its input {name:?}, which takes {takes}"
                ));
            }
        }
        for list in iter::once(&answer.action).chain(answer.gains.iter().flatten()) {
            if list.len() != ends.actions {
                return Err(format!(
                    "gives {} numbers, but it drives {} joints",
                    list.len(),
                    ends.actions
                ));
            }
        }
        Ok(net)
    }

    /// The memory at the start of an episode: zeros.
    pub fn fresh(&self) -> Kept {
        let mut kept = vec![Vec::new(); self.kept.len()];
        for input in &self.inputs {
            if let Takes::Kept(part) = input.takes {
                kept[part] = vec![0.0; input.shape.iter().product()];
            }
        }
        kept
    }

    /// The action for an observation, a list for each observed input. The memory `kept` goes on. Errors are in words.
    pub fn run(&self, observed: &[Vec<f32>], kept: &mut Kept) -> Result<Answer, String> {
        let mut run = || {
            let mut inputs = TVec::new();
            for input in &self.inputs {
                let numbers = match input.takes {
                    Takes::Observed(index) => &observed[index],
                    Takes::Kept(part) => &kept[part],
                };
                inputs.push(Tensor::from_shape(&input.shape, numbers)?.into());
            }
            let outputs = self.model.run(inputs)?;
            let list = |output: usize| {
                let output = outputs[output].to_plain_array_view::<f32>()?;
                TractResult::Ok(output.iter().copied().collect::<Vec<f32>>())
            };
            for (part, output) in self.kept.iter().enumerate() {
                kept[part] = list(*output)?;
            }
            let gains = match self.gains {
                Some([stiffness, damping]) => Some([list(stiffness)?, list(damping)?]),
                None => None,
            };
            let action = list(self.action)?;
            TractResult::Ok(Answer { action, gains })
        };
        run().map_err(|error| format!("the network fails: {error}"))
    }
}

/// The inputs and outputs of a network by their meaning.
struct Wires {
    inputs: Vec<(String, Takes)>,
    action: usize,
    gains: Option<[usize; 2]>,
    kept: Vec<usize>,
    kept_names: Vec<String>,
}

impl Wires {
    /// Finds the meaning of each input and output. Fails, with their names in words, if one has none.
    fn of(graph: &GraphProto, ends: &Ends) -> Result<Self, String> {
        let inputs: Vec<&str> = proto::inputs(graph)
            .iter()
            .map(|input| input.name.as_str())
            .collect();
        let outputs: Vec<&str> = graph
            .output
            .iter()
            .map(|output| output.name.as_str())
            .collect();
        let words = |what: &str| {
            let [inputs, outputs] = [named("input", &inputs), named("output", &outputs)];
            format!("has {inputs} and {outputs}{what}")
        };
        if inputs.len() > 1 && inputs.contains(&"time_step") {
            return Err(words(
                "; by time_step it follows a recorded motion, and such trackers are not taken",
            ));
        }
        let output = |name: &str| outputs.iter().position(|known| *known == name);
        let is_observed = |input: &str| {
            ends.observed
                .iter()
                .any(|(name, _)| name.as_deref() == Some(input))
        };
        let mut memory = ends.outputs.memory.clone();
        if inputs.len() > 1 {
            for input in inputs.iter().filter(|input| !is_observed(input)) {
                let fed = format!("{}_out", input.strip_suffix("_in").unwrap_or(input));
                if output(&fed).is_some() {
                    memory.entry(input.to_string()).or_insert(fed);
                }
            }
        }
        let (mut kept, mut kept_names) = (Vec::new(), Vec::new());
        for (input, from) in &memory {
            if is_observed(input) {
                return Err(words(&format!("; {input:?} is both observed and fed back")));
            }
            let (true, Some(from)) = (inputs.contains(&input.as_str()), output(from)) else {
                return Err(words(&format!(
                    "; there is no memory from {from:?} to {input:?}"
                )));
            };
            kept.push(from);
            kept_names.push(input.clone());
        }
        let mut takes = Vec::new();
        for input in &inputs {
            let part = kept_names.iter().position(|name| name == input);
            let observed = ends
                .observed
                .iter()
                .position(|(name, _)| name.as_deref().is_none_or(|name| name == *input));
            let Some(end) = part.map(Takes::Kept).or(observed.map(Takes::Observed)) else {
                return Err(words(&format!(
                    "; no term observes {input:?} (`input`), and no output is fed back to it (`network.memory`)"
                )));
            };
            takes.push((input.to_string(), end));
        }
        for (index, (name, _)) in ends.observed.iter().enumerate() {
            let taken = takes
                .iter()
                .filter(|(_, end)| matches!(end, Takes::Observed(other) if *other == index));
            match (taken.count(), name) {
                (1, _) => {}
                (0, Some(name)) => {
                    return Err(words(&format!("; terms observe {name:?}, which it lacks")));
                }
                _ => {
                    return Err(words(
                        "; terms without `input` are for one input only: say which terms each input observes (`input`), or \
                         which output is fed back to it (`network.memory`)",
                    ));
                }
            }
        }
        let stated = |name: &Option<String>| match name {
            None => Ok(None),
            Some(name) => match output(name) {
                Some(index) => Ok(Some(index)),
                None => Err(words(&format!("; {name:?} is no output"))),
            },
        };
        let [stiffness, damping] = [
            stated(&ends.outputs.stiffness)?,
            stated(&ends.outputs.damping)?,
        ];
        let gains = match (stiffness, damping) {
            (Some(stiffness), Some(damping)) => Some([stiffness, damping]),
            (None, None) => None,
            _ => {
                return Err(words(
                    "; `network` states one of stiffness and damping without the other",
                ));
            }
        };
        let mut free = (0..outputs.len()).filter(|index| {
            !kept.contains(index) && !gains.iter().flatten().any(|gain| gain == index)
        });
        let action = match (stated(&ends.outputs.action)?, free.next(), free.next()) {
            (Some(action), ..) | (None, Some(action), None) => action,
            _ => return Err(words("; `network.action` says which output is the action")),
        };
        if let Some([stiffness, damping]) = gains
            && (stiffness == damping || [stiffness, damping].contains(&action))
        {
            return Err(words("; `network` names one output twice"));
        }
        Ok(Self {
            inputs: takes,
            action,
            gains,
            kept,
            kept_names,
        })
    }
}

/// The names of inputs or outputs in words.
fn named(what: &str, names: &[&str]) -> String {
    /// Largest number of inputs or outputs that an error names.
    const MOST_NAMED: usize = 4;
    match names {
        [one] => format!("the {what} {one:?}"),
        several if several.len() <= MOST_NAMED => format!("{} {what}s {several:?}", several.len()),
        many => format!(
            "{} {what}s, the first of them {:?}",
            many.len(),
            &many[..MOST_NAMED]
        ),
    }
}

/// Counts the values that a network will make, before it makes them.
#[derive(Default)]
struct Numbers {
    all: u64,
}

impl Numbers {
    /// Finds the sizes of each operation's outputs, and the outputs themselves if the inputs are known, one operation
    /// after the other. The library alone would make a tensor of any stated size, even as large as the memory.
    fn bound(&mut self, model: &mut InferenceModel) -> Result<(), String> {
        // Each operation has a larger number than those that make its inputs.
        for id in 0..model.nodes().len() {
            let made = self.made(model, id)?;
            for (slot, fact) in made.into_iter().enumerate() {
                model
                    .set_outlet_fact(OutletId::new(id, slot), fact)
                    .map_err(in_words)?;
            }
        }
        Ok(())
    }

    /// The outputs of an operation whose inputs have been found.
    fn made(&mut self, model: &InferenceModel, id: usize) -> Result<Vec<InferenceFact>, String> {
        let node = model.node(id);
        let at = |error: TractError| format!("its operation {:?}: {}", node.name, in_words(error));
        let mut op = node.op.clone();
        let (inputs, outputs) = model.node_facts(id).map_err(at)?;
        let observed = op.observe_outlets(model, node).map_err(at)?;
        let observed = observed.iter().map(|outlet| model.outlet_fact(*outlet));
        let observed: TVec<&InferenceFact> = observed.collect::<TractResult<_>>().map_err(at)?;
        let sized = op
            .infer_facts(inputs.clone(), outputs.clone(), observed.clone())
            .map_err(at)?
            .1;
        let is_known = !inputs.is_empty() && inputs.iter().all(|input| input.value.is_concrete());
        for fact in &sized {
            let shape = fact.shape.concretize();
            if shape.is_none() && is_known {
                return Err(format!(
                    "its operation {:?} makes a tensor of unknown size",
                    node.name
                ));
            }
            self.add(&node.name, shape.iter().flatten())?;
        }
        let made = op.infer(inputs, outputs.clone(), observed).map_err(at)?.1;
        let made: Vec<InferenceFact> = outputs
            .iter()
            .zip(&made)
            .map(|(old, new)| old.unify(new))
            .collect::<TractResult<_>>()
            .map_err(at)?;
        for fact in &made {
            check_whole_numbers(&node.name, fact)?;
        }
        Ok(made)
    }

    /// Checks the sizes of each operation's outputs when all sizes have to be known.
    fn check(&mut self, model: &TypedModel) -> Result<(), String> {
        self.all = 0;
        for node in model.nodes() {
            for output in &node.outputs {
                if output.fact.shape.iter().any(|dim| dim.to_i64().is_err()) {
                    let problem = "makes as many numbers as its input says, which is not taken";
                    return Err(format!("its operation {:?} {problem}", node.name));
                }
                self.add(&node.name, output.fact.shape.iter())?;
            }
        }
        Ok(())
    }

    fn add<'a>(
        &mut self,
        name: &str,
        shape: impl Iterator<Item = &'a TDim> + Clone,
    ) -> Result<(), String> {
        let size = |dim: &TDim| {
            dim.to_i64()
                .map_or(Some(1), |size| u64::try_from(size).ok())
        };
        let numbers = shape
            .clone()
            .try_fold(1_u64, |product, dim| product.checked_mul(size(dim)?));
        let Some(numbers) = numbers.filter(|numbers| *numbers <= MOST_NUMBERS) else {
            let sizes: Vec<String> = shape.map(TDim::to_string).collect();
            let made = sizes.join(" x ");
            return Err(format!(
                "its operation {name:?} makes {made} numbers; up to {MOST_NUMBERS} are taken"
            ));
        };
        self.all += numbers;
        if self.all > MOST_OF_ALL {
            let problem = format!(
                "up to its operation {name:?}, more than {MOST_OF_ALL} numbers are made in all"
            );
            return Err(format!("is too large: {problem}"));
        }
        Ok(())
    }
}

/// Fails if a known whole number is too large for a size.
fn check_whole_numbers(name: &str, fact: &InferenceFact) -> Result<(), String> {
    let Some(value) = fact.value.concretize() else {
        return Ok(());
    };
    let Ok(numbers) = value.to_plain_array_view::<i64>() else {
        return Ok(());
    };
    for number in numbers {
        proto::check_whole(*number, &format!("{name:?}"))?;
    }
    Ok(())
}

/// The library's error with its causes, on one line.
fn in_words(error: TractError) -> String {
    let text = format!("{error:#}")
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ");
    format!("cannot be prepared: {text:.300}")
}
