//! Laws of the closed loop: robot, controller and ground in Rapier, or in the engine that STANDFAST_ENGINE names.

mod common;
mod controller;
mod feedback;
mod home;
mod live;
mod momentum;
mod no_allocation;
mod robot_dynamics;
mod sensors;
mod standing;
mod stepping;
mod symmetry;
mod toppling;
mod variations;
