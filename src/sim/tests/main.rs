//! Laws of the closed loop: robot, controller and ground in Rapier. `src/mujoco/tests` checks some of them in MuJoCo.

mod common;
mod controller;
mod feedback;
mod home;
mod joint_losses;
mod live;
mod momentum;
mod no_allocation;
mod pendulum;
mod robot_dynamics;
mod sensors;
mod standing;
mod stepping;
mod symmetry;
mod toppling;
mod variations;

/// The physics engine under test.
fn engine() -> standfast_sim::Engine {
    standfast_sim::Engine::Rapier
}
