//! What a tick of the controller may refuse.

use crate::robot::SensedError;

/// Why there is no new command. The last good one holds, and the controller goes on with the next good sample.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TickError {
    /// What was sensed cannot be: nothing has changed.
    #[error(transparent)]
    Sensed(#[from] SensedError),
    /// The body's equations have no solution, or one that is no number; the controller starts anew with the next sample.
    #[error(
        "the equations of the body have no solution for what was sensed; the controller starts anew with the next sample"
    )]
    Unsolvable,
}
