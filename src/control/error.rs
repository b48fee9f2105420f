//! The errors of a control tick.

use crate::robot::SensedError;

/// Why a tick gave no new command. The last valid command holds, and the controller goes on with the next valid sample.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TickError {
    /// The readings are invalid. The state of the controller has not changed.
    #[error(transparent)]
    Sensed(#[from] SensedError),
    /// The equations of motion have no solution, or no finite one. The controller restarts from the next sample.
    #[error(
        "the equations of motion have no solution for these readings; the controller restarts from the next sample"
    )]
    Unsolvable,
}
