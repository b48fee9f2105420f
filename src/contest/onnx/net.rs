//! The network, read from an ONNX file and run by `tract`, on one thread and to the same bits everywhere.

use std::collections::HashMap;
use std::sync::Arc;
use tract_onnx::prelude::*;
use tract_onnx::tract_hir::infer::Factoid;

/// A network that makes an action of an observation.
pub struct Net {
    model: Arc<TypedRunnableModel>,
    /// The shape of its input.
    shape: Vec<usize>,
}

/// What a file says of its network beside the network: names and texts. Errors are in words.
pub fn metadata(bytes: &[u8]) -> Result<HashMap<String, String>, String> {
    let model = tract_onnx::onnx().proto_model_for_read(&mut &*bytes).map_err(|e| format!("cannot be read: {e}"))?;
    Ok(model.metadata_props.into_iter().map(|prop| (prop.key, prop.value)).collect())
}

impl Net {
    /// Reads a network with these numbers of values to observe and to do. Errors are in words.
    pub fn of(bytes: &[u8], [observed, actions]: [usize; 2]) -> Result<Self, String> {
        let in_words = |error: TractError| format!("cannot be read: {error}");
        let mut model = tract_onnx::onnx().model_for_read(&mut &*bytes).map_err(in_words)?;
        let count = (model.inputs.len(), model.outputs.len());
        if count != (1, 1) {
            return Err(format!(
                "has {} inputs and {} outputs; recurrent networks, which hand on a memory, are not taken",
                count.0, count.1
            ));
        }
        let input = model.input_fact(0).map_err(in_words)?;
        // What a file leaves open is the number of observations at a time, which is 1 here.
        let known = |dim: TDim| usize::try_from(dim.to_i64().ok()?).ok();
        let sizes = input.shape.dims().map(|dim| dim.concretize().and_then(known).unwrap_or(1));
        let shape: Vec<usize> = sizes.collect();
        let takes: usize = shape.iter().product();
        if takes != observed {
            return Err(format!("takes {takes} numbers, but the terms of its observation are {observed}"));
        }
        model.set_input_fact(0, f32::fact(&shape).into()).map_err(in_words)?;
        let model = model.into_optimized().and_then(|model| model.into_runnable()).map_err(in_words)?;
        let net = Self { model, shape };
        let gives = net.run(vec![0.0; observed])?.len();
        if gives != actions {
            return Err(format!("gives {gives} numbers, but it drives {actions} joints"));
        }
        Ok(net)
    }

    /// The action for an observation. Errors are in words.
    pub fn run(&self, observation: Vec<f32>) -> Result<Vec<f32>, String> {
        let run = || {
            let input = Tensor::from_shape(&self.shape, &observation)?;
            let output = self.model.run(tvec!(input.into()))?;
            TractResult::Ok(output[0].to_plain_array_view::<f32>()?.iter().copied().collect())
        };
        run().map_err(|error| format!("the network fails: {error}"))
    }
}
