//! What campaigns ask and conclude.

mod catching;
#[path = "../../sim/tests/common/mod.rs"]
mod common;
mod gates;
mod similarity;

/// The physics engine under test.
fn engine() -> standfast_sim::Engine {
    standfast_sim::Engine::Rapier
}
