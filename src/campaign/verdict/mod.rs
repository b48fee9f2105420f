//! What is concluded from the trials of a campaign, of which a [`digest`] is kept: a [`summary`] says of each gain set
//! ([`set_summary`]) how many trials it recovered from, where ([`strata`]) and how fast ([`times`]), how trials were
//! lost ([`failures`], [`telling_trials`]), what the theory foretold ([`prediction`]), what footsteps were worth
//! ([`footsteps`]); which of two sets is better ([`standing`], [`pairs`]), which recovers most of all ([`headline`]),
//! and what the result cannot support ([`warnings`]). Whether that is enough, its [`gates`] say by their [`evidence`],
//! some of them beside an earlier result ([`baseline`]); [`compare`] sets two results beside each other, and of two that
//! differ in the physics engine alone says how far they agree ([`agreement`]).

pub mod agreement;
pub mod baseline;
pub mod compare;
pub mod digest;
pub mod evidence;
pub mod failures;
pub mod footsteps;
pub mod gates;
pub mod headline;
pub mod pairs;
pub mod prediction;
pub mod set_summary;
pub mod so_far;
pub mod standing;
pub mod strata;
pub mod summary;
pub mod telling_trials;
pub mod times;
pub mod warnings;
