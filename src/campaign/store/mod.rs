//! Storage of a campaign: a [`row`] for each trial and gain set, a [`part`] for each block of trials, a [`folder`] for
//! all parts, and a [`manifest`] of what they are. A
//! [`claim`] keeps others away. A [`shard`] is the share of one machine, and a [`stored_trial`] can be run again.

pub mod claim;
pub mod folder;
pub mod manifest;
pub mod part;
pub mod row;
pub mod shard;
pub mod stored_trial;
