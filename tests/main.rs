//! The program from outside: its commands, files, pages and messages. One test program of modules.

#[cfg(feature = "onnx")]
mod adapters;
mod baselines;
mod card;
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
mod python;
mod readme;
mod replay;
mod report_html;
mod tokens;
mod tune;
mod view;

/// The physics engine under test: Rapier, or the one that the environment variable STANDFAST_ENGINE names.
fn engine() -> standfast::sim::Engine {
    use standfast::sim::Engine;
    standfast::leaves::add();
    let name = std::env::var("STANDFAST_ENGINE").unwrap_or("rapier".into());
    Engine::ALL
        .into_iter()
        .find(|engine| engine.name() == name)
        .expect("an engine")
}
