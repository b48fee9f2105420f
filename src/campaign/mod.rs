//! A campaign: many trials with random pushes on varied robots and grounds, the same for every controller, and a count of
//! how many each set recovers from. [`ask`] is what a campaign asks, [`plan`] reads what that needs, [`run`] runs it,
//! [`store`] keeps the results, and [`verdict`] draws the conclusions. [`limit`] searches the largest recoverable
//! impulse, heading by heading, [`tune`] searches a better controller, [`ceiling`] tries again what one loses, with
//! knowledge of the push, and [`partings`] shows where two physics engines part company.
//!
//! Imports between these rooms go one way: [`ask`] does not know [`store`], and neither knows [`verdict`].

pub mod ask;
pub mod ceiling;
pub mod cma_es;
pub mod interim;
pub mod limit;
pub mod partings;
pub mod plan;
pub mod run;
pub mod store;
pub mod tune;
pub mod verdict;

pub use ask::bounds::{PushBounds, check_episode, check_steps};
pub use ask::spec::{Campaign, Overrides};
pub use plan::Plan;
pub use store::folder::Folder;
pub use store::row::TrialRow;
pub use store::shard::Shard;
pub use store::stored_trial::StoredTrial;
pub use verdict::summary::Summary;
