//! The network, read from an ONNX file and run by `tract`, on one thread and to the same bits everywhere.

use super::limited::limited;
use super::proto::{self, MOST_NUMBERS};
use std::collections::HashMap;
use std::sync::Arc;
use tract_onnx::pb::GraphProto;
use tract_onnx::prelude::*;
use tract_onnx::tract_hir::infer::Factoid;

/// Largest number of values in all tensors of a network together.
const MOST_OF_ALL: u64 = 4 * MOST_NUMBERS;

/// A network that turns an observation into an action.
pub struct Net {
    model: Arc<TypedRunnableModel>,
    /// The shape of its input.
    shape: Vec<usize>,
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

impl Net {
    /// Reads a network whose observation and action have these `sizes`. Errors are in words: the network does not fit,
    /// or would take too much time or memory.
    pub fn of(bytes: &[u8], sizes: [usize; 2]) -> Result<Self, String> {
        let bytes = bytes.to_vec();
        limited(move || Self::prepared(&bytes, sizes))
    }

    fn prepared(bytes: &[u8], [observed, actions]: [usize; 2]) -> Result<Self, String> {
        let mut proto = proto::read(bytes)?;
        check_ends(proto::check(&mut proto)?)?;
        let mut model = tract_onnx::onnx()
            .model_for_proto_model(&proto)
            .map_err(in_words)?;
        let input = model.input_fact(0).map_err(in_words)?;
        // A size that the file leaves open is the batch size, which is 1 here.
        let sizes = input.shape.dims().map(|dim| {
            let size = dim.concretize().and_then(|size| size.to_i64().ok());
            size.and_then(|size| usize::try_from(size).ok())
                .unwrap_or(1)
        });
        let shape: Vec<usize> = sizes.collect();
        let takes = shape
            .iter()
            .try_fold(1_usize, |product, size| product.checked_mul(*size));
        if takes != Some(observed) {
            let takes = takes.map_or_else(|| format!("{shape:?}"), |takes| takes.to_string());
            return Err(format!(
                "takes {takes} numbers, but the terms of its observation are {observed}"
            ));
        }
        model
            .set_input_fact(0, f32::fact(&shape).into())
            .map_err(in_words)?;
        let mut numbers = Numbers::default();
        numbers.bound(&mut model)?;
        let model = model.into_typed().map_err(in_words)?;
        numbers.check(&model)?;
        let model = model
            .into_optimized()
            .and_then(|model| model.into_runnable())
            .map_err(in_words)?;
        let net = Self { model, shape };
        let gives = net.run(vec![0.0; observed])?.len();
        if gives != actions {
            return Err(format!(
                "gives {gives} numbers, but it drives {actions} joints"
            ));
        }
        Ok(net)
    }

    /// The action for an observation. Errors are in words.
    pub fn run(&self, observation: Vec<f32>) -> Result<Vec<f32>, String> {
        let run = || {
            let input = Tensor::from_shape(&self.shape, &observation)?;
            let output = self.model.run(tvec!(input.into()))?;
            TractResult::Ok(
                output[0]
                    .to_plain_array_view::<f32>()?
                    .iter()
                    .copied()
                    .collect(),
            )
        };
        run().map_err(|error| format!("the network fails: {error}"))
    }
}

/// Fails, with the inputs and outputs in words, if a network does not have one input and one output.
fn check_ends(graph: &GraphProto) -> Result<(), String> {
    /// Largest number of inputs or outputs that an error names.
    const MOST_NAMED: usize = 4;
    /// Parts of the names that exporters give to the inputs of a recurrent memory.
    const MEMORY: [&str; 6] = ["h_in", "c_in", "hidden", "cell", "state_in", "memory"];
    let inputs: Vec<&str> = proto::inputs(graph)
        .iter()
        .map(|input| input.name.as_str())
        .collect();
    let outputs: Vec<&str> = graph
        .output
        .iter()
        .map(|output| output.name.as_str())
        .collect();
    if let ([_], [_]) = (&inputs[..], &outputs[..]) {
        return Ok(());
    }
    let what = if inputs.len() > 1 && inputs.contains(&"time_step") {
        "; by time_step it follows a recorded motion, and such trackers are not taken"
    } else if inputs.len() > 1
        && inputs
            .iter()
            .any(|input| MEMORY.iter().any(|part| input.contains(part)))
    {
        "; recurrent networks, which hand on a memory, are not taken"
    } else {
        ""
    };
    let named = |what: &str, names: &[&str]| match names {
        [one] => format!("the {what} {one:?}"),
        several if several.len() <= MOST_NAMED => format!("{} {what}s {several:?}", several.len()),
        many => format!(
            "{} {what}s, the first of them {:?}",
            many.len(),
            &many[..MOST_NAMED]
        ),
    };
    Err(format!(
        "has {} and {}{what}",
        named("input", &inputs),
        named("output", &outputs)
    ))
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
