//! The plant: a robot in a physics engine, with its servos, contacts, sensors and ground, and the pushes on it; and the one
//! closed loop of plant and controller ([`episode`]).

#![forbid(unsafe_code)]

pub mod bob;
pub mod contact;
pub mod engine;
pub mod episode;
pub mod ground;
pub mod loads;
pub mod meeting;
pub mod noise;
pub mod pendulum;
pub mod physics;
pub mod plant;
pub mod push;
mod rapier;
pub mod sensors;
pub mod servo;
mod similar;
pub mod variation;

pub use bob::Bob;
pub use engine::{Engine, MUJOCO_VERSION};
pub use ground::Ground;
pub use meeting::{Meeting, Pairs};
pub use plant::{Plant, Pull, Truth};
pub use push::{Profile, Push};
pub use sensors::{NoiseDraw, Normal, Sensor, SensorErrors};
pub use variation::Variation;
