//! Results as text for the terminal, and as JSON.

mod campaign;
pub mod card;
pub mod ceiling;
pub mod comparison;
pub mod cpi;
pub mod ghost;
pub mod layout;
pub mod limit;
pub mod model;
pub mod next_command;
pub mod so_far;
pub mod story;
pub mod tune;
pub mod unpushed;

pub use campaign::{campaign, endings, settings, thresholds};
pub use comparison::{about_pairs, baseline, failed_gates, gate_seen, gate_words};
pub use limit::text as limits;
