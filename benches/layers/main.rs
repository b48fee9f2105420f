//! What each layer of the program costs, from the bottom up: `cargo bench`, or `cargo bench -- tick` for the benchmarks
//! with that word in their name. The output reads from top to bottom as the program is built: CPI sets, whole body,
//! control tick, control period of the plant, episode, campaign. The times hold for one machine; their ratios tell
//! more.

mod campaign;
mod control;
mod played;
mod sets;
mod sim;
mod whole_body;

use criterion::{Criterion, criterion_group, criterion_main};
use std::time::Duration;

/// The settings are short enough for all layers to take some two minutes.
fn settings() -> Criterion {
    Criterion::default()
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(1))
        .sample_size(20)
        .without_plots()
}

criterion_group!(
    name = layers;
    config = settings();
    targets = sets::search, sets::update, sets::membership, sets::footstep, whole_body::whole_body, control::ticks,
        sim::control_period, sim::joints, campaign::episode, campaign::threads
);
criterion_main!(layers);
