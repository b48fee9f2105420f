//! Storage of a campaign: a [`row`] for each trial and gain set, a [`part`] for each block of trials, and a [`folder`]
//! for all parts. A [`shard`] is the share of one machine, and a [`stored_trial`] can be run again.

pub mod folder;
pub mod part;
pub mod row;
pub mod shard;
pub mod stored_trial;
