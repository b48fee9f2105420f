//! Results as text for the terminal, and as JSON.

mod agreement;
mod campaign;
mod comparison;
pub mod cpi;
pub mod ghost;
pub mod layout;
mod limit;
pub mod model;
pub mod so_far;
pub mod story;

pub use agreement::{ABOUT_AGREEMENT, about_traces, agreement_cells, where_it_parts, with_warnings as agreement};
pub use campaign::{campaign, impulse_at, thresholds};
pub use comparison::{
    about_pairs, adjusted_p, baseline, failed_gates, gate_cells, gate_seen, gate_words, p_cell, pair_cells, status,
    unit,
};
pub use limit::text as limits;
