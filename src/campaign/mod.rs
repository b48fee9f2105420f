//! A campaign: many pushes drawn at random, on robots and grounds that vary, the same for every gain set, and the count
//! of who stays up: what is asked ([`ask`]), how it is run ([`run`]), where it is kept ([`store`]) and what is concluded
//! ([`verdict`]). [`limit`] asks how hard a push may be, heading by heading.

pub mod ask;
pub mod limit;
pub mod run;
pub mod store;
pub mod verdict;

pub use ask::bounds::{PushBounds, check_episode};
pub use ask::distribution::Distribution;
pub use ask::spec::{Campaign, Overrides, Stopping};
pub use ask::variations::{SecondPushSpec, VariationSpec};
pub use run::Plan;
pub use store::parts::Folder;
pub use store::row::TrialRow;
pub use store::shard::Shard;
pub use store::stored_trial::StoredTrial;
pub use verdict::summary::Summary;
