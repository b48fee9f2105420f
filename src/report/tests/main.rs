//! Replays: what their pages contain, and what a browser makes of it.

mod common;
mod replay_data;
mod replay_html;

/// The physics engine under test.
fn engine() -> standfast_sim::Engine {
    standfast_sim::Engine::Rapier
}
