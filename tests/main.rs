//! The program from outside: its commands, files, pages and messages. One test program of modules.

mod ceiling;
mod cli;
mod common;
mod comparison;
mod data_files;
mod determinism;
#[cfg(feature = "mujoco")]
mod engines;
mod faults;
mod figures;
mod fuzz;
mod inference;
mod limit;
mod mujoco_beside;
#[cfg(feature = "onnx")]
mod onnx;
mod process;
mod readme;
mod replay;
mod report_html;
mod tune;
mod view;
