//! What a campaign asks. A [`spec`] states which quantities are drawn ([`mod@push`], [`pendulum`], [`variations`]), from which
//! [`distribution`] and within which [`bounds`], and what the result must show ([`gate`]). A [`trial`] is a function of
//! seed and index alone. [`standing_bound`] gives the measure of a push.

pub mod bounds;
pub mod distribution;
pub mod entrant;
pub mod gate;
pub mod measures;
pub mod pendulum;
pub mod push;
pub mod spec;
pub mod standing_bound;
pub mod trial;
pub mod variations;
