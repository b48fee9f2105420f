//! Standing: what the robot stands on ([`Support`]), and which gain acts ([`Supervisor`], switching control).

pub mod supervisor;
pub mod support;

pub use supervisor::{Decision, Supervisor};
pub use support::Support;
