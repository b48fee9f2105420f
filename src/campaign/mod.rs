//! A campaign: many pushes drawn at random, on robots and grounds that vary, the same for every gain set, and the count
//! of who stays up.
//!
//! - What is asked: a [`spec`] says what is drawn, each number within its [`bounds`]; a [`trial`] is a function of (seed,
//!   index) alone.
//! - How it is run: [`run`] spreads trials over cores, or a [`shard`] of them; [`parts`] keeps what is finished on disk
//!   and joins it.
//! - What came out: a [`summary`] counts ([`stats`]) and says who is better ([`paired`]), where ([`strata`]), how hard a
//!   push may be ([`curve`], over [`no_step`]), how trials were lost ([`failures`], [`telling`]), what the theory foretold
//!   ([`foretold`]), what footsteps were worth ([`stepped`]), and what it cannot support ([`warnings`]).
//! - Whether that is enough: [`gates`], each of them a [`gate`] of the [`gate_spec`]; [`compare`] sets two results beside each other.
//! - The statistics stand alone: [`mcnemar`] of paired outcomes, [`ranks`] of paired numbers, [`curve`] of success against
//!   impulse, [`sequential`] intervals that hold at every look.
//!
//! [`limit`] asks how hard a push may be, heading by heading, by a [`psychometric`] search beside the pendulum's bounds.
//! [`response`] measures how the ZMP follows the one wanted, and a [`scenario`] is one disturbance with a name.

pub mod bounds;
pub mod compare;
pub mod curve;
pub mod distribution;
pub mod failures;
pub mod foretold;
pub mod gate;
pub mod gate_spec;
pub mod gates;
pub mod limit;
pub mod mcnemar;
pub mod no_step;
pub mod paired;
pub mod parts;
pub mod psychometric;
pub mod ranks;
pub mod replayed;
pub mod response;
pub mod row;
pub mod run;
pub mod scenario;
pub mod sequential;
pub mod shard;
pub mod spec;
pub mod stats;
pub mod stepped;
pub mod strata;
pub mod summary;
pub mod telling;
pub mod trial;
pub mod vary;
pub mod warnings;

pub use bounds::{PushBounds, check_episode};
pub use distribution::Distribution;
pub use parts::Folder;
pub use replayed::Replayed;
pub use row::Row;
pub use run::Plan;
pub use shard::Shard;
pub use spec::{Campaign, Overrides, Stopping};
pub use summary::Summary;
pub use vary::{SecondPushSpec, VariationSpec};
