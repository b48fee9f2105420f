//! Shared by the tests of the program.
#![allow(dead_code, reason = "each build has its part of the tests")]

#[path = "../../src/report/tests/common/browser.rs"]
pub mod browser;
#[path = "../../src/sim/tests/common/mod.rs"]
mod closed_loop;
#[cfg(feature = "view")]
pub mod display;
#[cfg(feature = "onnx")]
pub mod network;
pub mod parts;
pub mod program;
#[cfg(feature = "view")]
pub mod window;

pub use closed_loop::*;

/// The program under test.
pub const PROGRAM: &str = env!("CARGO_BIN_EXE_standfast");
