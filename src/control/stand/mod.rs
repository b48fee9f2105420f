//! Standing: on what ([`Support`]), and by which gain (the [`Supervisor`] of switching control).

pub mod supervisor;
pub mod support;

pub use supervisor::{Decision, Supervisor};
pub use support::Support;
