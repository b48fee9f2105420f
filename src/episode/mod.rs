//! One closed loop of plant and controller ([`ClosedLoop`]), driven tick by tick ([`drive`]) and judged ([`run()`]).
//! The episodes of one trial with several gain sets run together ([`Episodes`]). Two episodes of one
//! trial in different engines are set side by side ([`parting`]).

mod closed_loop;
mod config;
pub mod film;
pub mod footsteps;
pub mod parting;
mod record;
mod referee;
mod run;
mod slip;
pub mod snapshot;
mod tick;
mod together;

pub use closed_loop::ClosedLoop;
pub(crate) use closed_loop::caught;
pub use config::{CONTROL_PERIOD_S, Disturbance, EpisodeConfig, Judge, Until};
pub use film::Film;
pub use footsteps::{Footstep, Lifted};
pub use record::{Membership, Outcome, Record};
pub use referee::{AT_LIMIT, Referee};
pub use run::run;
pub use snapshot::Snapshot;
pub use tick::{Controlled, Tick, drive};
pub use together::Episodes;
