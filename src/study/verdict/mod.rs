//! Draws conclusions from the trials of a campaign.
//!
//! A [`trial_columns`] keeps what is needed of the trials, and a [`summary`] states all conclusions. For each controller
//! ([`controller_summary`]) it says how many trials it recovered from, in which kinds of trials ([`strata`]) and how fast, and
//! how trials were lost ([`failures`], [`telling_trials`]); strikes by a pendulum have numbers of their own ([`strikes`]). It decides which of two controllers is better ([`standing`],
//! [`pairs`]) and which recovers most often ([`headline`]), and it warns of what the result cannot support
//! ([`warnings`]). The lines of a running campaign are [`so_far`].
//!
//! The requirements of a campaign are its [`gates`]. They are decided by [`evidence`], and some compare with an earlier
//! result ([`baseline`]). Two results can be compared ([`compare`]), and a controller
//! has a place among those of a packed one.

pub mod baseline;
pub mod compare;
pub mod controller_summary;
pub mod evidence;
pub mod failures;
pub mod gates;
pub mod headline;
mod listed;
pub mod pairs;
mod placement;
pub mod so_far;
pub mod standing;
pub mod strata;
pub mod strikes;
pub mod summary;
pub mod telling_trials;
pub mod trial_columns;
pub mod warnings;
