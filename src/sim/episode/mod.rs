//! The one closed loop of plant and controllers ([`ClosedLoop`]), run to its record ([`run`]) by a judge ([`Referee`]).
//! Observers see its ticks ([`Tick`]); a [`Film`] keeps them. The films of two entrants in one
//! trial are compared tick by tick ([`parting`]).

mod closed_loop;
mod config;
mod episode_run;
pub mod film;
pub mod footsteps;
pub mod parting;
mod record;
mod referee;
mod slip;
pub mod snapshot;
mod tick;
pub mod unpushed;

pub use closed_loop::{ClosedLoop, caught, run};
pub use config::{CONTROL_PERIOD_S, Counts, Disturbance, EpisodeConfig, Judge, Until};
pub use episode_run::EpisodeRun;
pub use film::Film;
pub use footsteps::{Footstep, FootstepLog, Lifted};
pub use record::{Membership, Outcome, Record, Totals};
pub use referee::{AT_LIMIT, Referee};
pub use snapshot::Snapshot;
pub use tick::{Failure, Tick, home_distance};

/// Helpers for unit tests.
#[cfg(test)]
mod testing {
    use standfast_core::socket::{
        Command, Controller, PreparedController, Report, Sensed, TickError,
    };

    #[derive(Clone)]
    struct Stiff;

    impl Controller for Stiff {
        fn tick(&mut self, _: &Sensed, _: &mut Command) -> Result<(), TickError> {
            Ok(())
        }

        fn report(&self) -> Report<'_> {
            Report::of_phase("stiff")
        }

        fn fork(&self) -> Option<Box<dyn Controller>> {
            Some(Box::new(self.clone()))
        }
    }

    /// A controller that never changes its first command, which holds the posture of the start.
    pub fn stiff() -> PreparedController {
        PreparedController::new("stiff", "which does nothing", |_seed| Stiff)
    }
}
