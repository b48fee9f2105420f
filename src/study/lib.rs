//! A campaign: many trials with random pushes on varied robots and grounds, the same for every controller, and for each
//! controller the number of trials from which it recovers. [`ask`] is what a campaign asks, [`plan`] reads the inputs,
//! [`run`] runs the trials, [`store`] keeps the results, and [`verdict`] draws the conclusions. [`limit`] searches the
//! largest recoverable impulse, heading by heading, [`tune`] searches a better controller, and [`ceiling`] searches
//! recoveries from the pushes that a controller loses. [`card`] tells a lab what to expect, and compares it with what was
//! seen there. [`batch`] runs the jobs of these four.
//!
//! Imports between these rooms go one way: [`ask`] does not know [`store`], and neither knows [`verdict`].

#![forbid(unsafe_code)]

// The fixtures name this crate as other crates do.
#[cfg(test)]
extern crate self as standfast_study;

pub mod ask;
pub mod batch;
pub mod card;
pub mod ceiling;
pub mod cma_es;
#[cfg(test)]
mod fixtures;
pub mod limit;
pub mod plan;
pub mod run;
pub mod store;
pub mod tune;
pub mod until_resolved;
pub mod verdict;

pub use ask::bounds::{PushBounds, check_episode, check_steps};
pub use ask::spec::{Campaign, Overrides};
pub use plan::PreparedCampaign;
pub use store::folder::Folder;
pub use store::row::TrialRow;
pub use store::shard::Shard;
pub use store::stored_trial::StoredTrial;
pub use verdict::summary::Summary;
