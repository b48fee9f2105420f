//! What a campaign asks: a [`spec`] says what is drawn, each number within its [`bounds`]; a [`trial`] is a function of
//! (seed, index) alone; a [`scenario`] is one disturbance with a name.

pub mod bounds;
pub mod distribution;
pub mod no_step;
pub mod scenario;
pub mod spec;
pub mod trial;
pub mod variations;
