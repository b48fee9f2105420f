//! Standing: what the robot stands on ([`Support`]), and which gain acts ([`Supervisor`], switching control).

pub mod supervisor;
pub mod support;

pub use supervisor::{StandDecision, Supervisor};
pub use support::Support;
