//! What a campaign asks: a [`spec`] says what is drawn ([`mod@push`], [`variations`]), how ([`distribution`]) and within
//! which [`bounds`], and what has to be shown ([`gate`]); a [`trial`] is a function of (seed, index) alone; a
//! [`scenario`] is one disturbance with a name; [`no_step`] measures a push.

pub mod bounds;
pub mod distribution;
pub mod gate;
pub mod no_step;
pub mod push;
pub mod scenario;
pub mod spec;
pub mod trial;
pub mod variations;
