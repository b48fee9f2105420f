//! What is concluded from the trials of a campaign: a [`summary`] says who is better ([`paired`]), where ([`strata`]), how
//! trials were lost ([`failures`], [`telling`]), what the theory foretold ([`foretold`]), what footsteps were worth
//! ([`stepped`]), and what it cannot support ([`warnings`]). Whether that is enough: [`gates`], each of them a [`gate`] of
//! the [`gate_spec`]; [`compare`] sets two results beside each other.

pub mod compare;
pub mod failures;
pub mod footsteps;
pub mod gate;
pub mod gate_spec;
pub mod gates;
pub mod pairs;
pub mod prediction;
pub mod strata;
pub mod summary;
pub mod telling_trials;
pub mod warnings;
