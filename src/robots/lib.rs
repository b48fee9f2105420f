//! Humanoids from files: a URDF or an MJCF with its meshes, and a settings file (TOML) with what that cannot state, which is
//! inferred where there is none.

#![forbid(unsafe_code)]

mod facing;
mod infer;
mod mesh;
pub mod motors;
mod settings;
mod skeleton;
mod tree;
pub mod urdf;
mod xacro;
mod xml_limits;

pub use urdf::{Files, load, parse};
