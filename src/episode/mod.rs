//! The one closed loop of plant and controllers ([`ClosedLoop`]), run to its record ([`run`]) by a judge ([`Referee`]).
//! Observers see its ticks ([`Tick`]); a [`Film`] keeps them. Two episodes of one trial in different engines are
//! compared tick by tick ([`parting`]).

pub mod alone;
mod closed_loop;
mod config;
pub mod film;
pub mod footsteps;
pub mod parting;
mod record;
mod referee;
mod slip;
pub mod snapshot;
mod tick;

pub(crate) use closed_loop::caught;
pub use closed_loop::{ClosedLoop, run};
pub use config::{CONTROL_PERIOD_S, Counts, Disturbance, EpisodeConfig, Judge, Until};
pub use film::Film;
pub use footsteps::{Footstep, FootstepLog, Lifted};
pub use record::{Membership, Outcome, Record, Totals};
pub use referee::{AT_LIMIT, Referee};
pub use snapshot::Snapshot;
pub use tick::{Failure, Tick, home_distance};
