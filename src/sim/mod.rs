//! The plant: a robot as a Rapier multibody with its servos, contacts, sensors and ground, and the pushes on it. This
//! is the only module that names Rapier.

pub mod contact;
mod convert;
pub mod engine;
pub mod ground;
pub mod plant;
pub mod push;
pub mod sensors;
pub mod servo;
pub mod variation;
mod world;

pub use engine::{Engine, PhysicsStep};
pub use ground::Ground;
pub use plant::{Plant, Pull, Truth};
pub use push::{Profile, Push};
pub use sensors::SensorErrors;
pub use variation::Variation;
