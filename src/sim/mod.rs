//! The plant: a robot as a Rapier multibody, its servos, contacts, sensors, and the pushes that disturb it.
//! This is the only module that names Rapier.

pub mod contact;
mod convert;
pub mod plant;
pub mod push;
pub mod sensors;
pub mod servo;
mod world;

pub use plant::{Plant, Truth};
pub use push::{Profile, Push};
pub use sensors::SensorErrors;
