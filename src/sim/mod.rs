//! The plant: a robot as a Rapier multibody, its servos, contacts, sensors, and the pushes that disturb it.
//! This is the only module that names Rapier.

pub mod push;
pub mod sensors;

pub use push::{Profile, Push};
