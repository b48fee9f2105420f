//! Replaces the reading of a policy's training if the program was built without ONNX.

use super::written::Written;
use crate::error::{Error, Result};
use crate::robot::Robot;
use std::path::Path;

/// Fails, with the reason.
pub fn written(model: &Path, _from: Option<&Path>, _robot: &Robot) -> Result<Written> {
    let accepted = "one that was built by `cargo build --release --features onnx`";
    Err(Error::value("init", "the policy", model.display(), "needs a program with ONNX", accepted))
}
