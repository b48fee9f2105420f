//! What only some builds have: learned policies (feature `onnx`), MuJoCo (`mujoco`) and the window (`view`, in
//! [`commands::view`](crate::commands)). No library names these crates; the program adds what they bring.

use standfast_controllers::PolicyFile;
use standfast_core::error::Result;
use standfast_core::robot::Robot;
use std::path::Path;

/// Adds the kinds of controllers and the engines of this build. To be called before anything is read.
pub fn add() {
    #[cfg(feature = "mujoco")]
    standfast_sim::engine::add_mujoco(standfast_mujoco::PARTS);
    #[cfg(feature = "onnx")]
    {
        standfast_controllers::kinds::add(standfast_policies::KIND);
        standfast_robots::motors::add(standfast_policies::motors_of_training);
    }
}

/// The file of the policy in `model` for a robot, from what its training left there or in the file `from`.
///
/// # Errors
/// Nothing says what the policy observes, it does not fit the robot, or this build has no ONNX.
pub fn policy_file(model: &Path, from: Option<&Path>, robot: &Robot) -> Result<PolicyFile> {
    #[cfg(feature = "onnx")]
    return standfast_policies::written(model, from, robot);
    #[cfg(not(feature = "onnx"))]
    {
        let (_, _) = (from, robot);
        let accepted = "one that was built by `cargo build --release --features onnx`";
        let (value, problem) = (model.display(), "needs a program with ONNX");
        Err(standfast_core::error::Error::value(
            "init",
            "the policy",
            value,
            problem,
            accepted,
        ))
    }
}
