//! Where a campaign is kept: a [`row`] for each trial under each gain set, in [`parts`] on disk; a [`shard`] is one
//! machine's share of them, and [`stored_trial`] brings a trial back.

pub mod parts;
pub mod row;
pub mod shard;
pub mod stored_trial;
