//! A campaign: many pushes drawn at random, on robots and grounds that vary, the same for every gain set, and the count
//! of who stays up: what is asked ([`ask`]), where it is kept ([`store`]), what is concluded ([`verdict`]) and how it is
//! run ([`run`]). [`limit`] asks how hard a push may be, heading by heading.
//!
//! The rooms are floors, in this order: who asks knows nothing of what is kept, and neither of what is concluded.

pub mod ask;
pub mod limit;
pub mod run;
pub mod store;
pub mod verdict;

pub use ask::bounds::{PushBounds, check_episode};
pub use ask::spec::{Campaign, Overrides};
pub use run::Plan;
pub use store::folder::Folder;
pub use store::row::TrialRow;
pub use store::shard::Shard;
pub use store::stored_trial::StoredTrial;
pub use verdict::summary::Summary;
