//! Shared by the tests of replays.

#[allow(dead_code, reason = "the tests of the program use the rest")]
pub mod browser;
#[path = "../../../sim/tests/common/mod.rs"]
mod closed_loop;
pub mod films;

pub use closed_loop::*;
