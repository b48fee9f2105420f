//! A campaign: many pushes drawn at random, on robots and grounds that vary, the same for every gain set, and the count
//! of who stays up.
//!
//! A [`spec`] says what is drawn; a [`trial`] is a function of (seed, index) alone; [`run`] spreads trials over cores;
//! [`parts`] keeps what is finished on disk and joins it; [`stats`] counts, [`paired`] compares the sets on the same
//! pushes, [`foretold`] the theory with what happened, and [`stepped`] says what footsteps were worth.
//! Their statistics stand alone: [`mcnemar`] of paired outcomes, [`ranks`] of paired numbers, [`curve`] of success against
//! impulse.
//! [`limit`] asks how hard a push may be, heading by heading, by a [`psychometric`] search beside the pendulum's bounds.
//! Beside it, [`response`] measures how the ZMP follows the one wanted, and a [`scenario`] is one disturbance with a name.

pub mod curve;
pub mod distribution;
pub mod foretold;
pub mod gate;
pub mod limit;
pub mod mcnemar;
pub mod paired;
pub mod parts;
pub mod psychometric;
pub mod ranks;
pub mod response;
pub mod row;
pub mod run;
pub mod scenario;
pub mod sequential;
pub mod spec;
pub mod stats;
pub mod stepped;
pub mod trial;
pub mod vary;

pub use distribution::Distribution;
pub use parts::{Folder, Shard};
pub use row::Row;
pub use run::Plan;
pub use spec::{Campaign, Overrides, PushBounds, check_episode};
pub use stats::Summary;
pub use vary::{SecondPushSpec, VariationSpec};
