//! The plant: a robot in a physics engine, with its servos, contacts, sensors and ground, and the pushes on it.

pub mod contact;
pub mod engine;
pub mod ground;
pub mod meeting;
#[cfg_attr(not(feature = "mujoco"), path = "mujoco/absent.rs")]
mod mujoco;
mod physics;
pub mod plant;
pub mod push;
mod rapier;
pub mod sensors;
pub mod servo;
mod similar;
pub mod variation;

pub use engine::{Engine, MUJOCO_VERSION, PhysicsStep};
pub use ground::Ground;
pub use meeting::{Meeting, Pairs};
pub use plant::{Plant, Pull, Truth};
pub use push::{Profile, Push};
pub use sensors::{Normal, Sensor, SensorErrors, When};
pub use variation::Variation;
