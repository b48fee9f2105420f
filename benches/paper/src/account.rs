//! The controller's own account of a tick, beyond its report. All code of this crate that looks into the controller
//! during a run asks this function.

use standfast::core::control::{Account, CpiController};
use standfast::sim::episode::Tick;
use std::any::Any;

/// What the controller did at a tick, and why; None if the controller is not of the kind `cpi`.
pub fn account<'a>(tick: &Tick<'a>) -> Option<Account<'a>> {
    let controller = tick.controller? as &dyn Any;
    controller
        .downcast_ref::<CpiController>()
        .map(CpiController::account)
}
