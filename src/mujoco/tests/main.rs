//! Laws of the closed loop in MuJoCo: the tests of the simulation that hold in every engine.

#[path = "../../sim/tests/common/mod.rs"]
mod common;
#[path = "../../sim/tests/joint_losses.rs"]
mod joint_losses;
mod mjcf_files;
#[path = "../../sim/tests/momentum.rs"]
mod momentum;
#[path = "../../sim/tests/pendulum.rs"]
mod pendulum;
#[path = "../../sim/tests/robot_dynamics.rs"]
mod robot_dynamics;
#[path = "../../sim/tests/standing.rs"]
mod standing;
#[path = "../../sim/tests/variations.rs"]
mod variations;

/// The physics engine under test.
fn engine() -> standfast_sim::Engine {
    standfast_sim::engine::add_mujoco(standfast_mujoco::PARTS);
    standfast_sim::Engine::Mujoco
}
