//! Stores a campaign on disk. A [`row`] holds one trial with one controller, a [`part`] holds the rows of one block of
//! trials, and a [`folder`] holds all parts. Its [`manifest`] states to which campaign the parts belong, and a
//! [`claim`] keeps other programs away from it. A [`shard`] is the share of one machine, and a [`stored_trial`] can be
//! run again. A result can be [`packed`], to be given away with the [values of its robot](robot_values); some are [`compiled_in`].

pub mod claim;
pub mod compiled_in;
pub mod folder;
pub mod manifest;
pub mod packed;
pub mod part;
pub mod robot_values;
pub mod row;
pub mod shard;
pub mod stored_trial;
