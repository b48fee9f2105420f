//! The robot in a window, live in the closed loop.

#![forbid(unsafe_code)]

mod app;
mod options;

pub use app::{LiveSetup, run};
pub use options::Options;
