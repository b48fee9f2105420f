//! Where a campaign is kept: a [`row`] for each trial under each gain set, in a [`part`] for each block of trials, in a
//! [`folder`]; a [`shard`] is one machine's share of them, and a [`stored_trial`] can be run again.

pub mod folder;
pub mod part;
pub mod row;
pub mod shard;
pub mod stored_trial;
