//! What our own controller says of a tick beyond its report. Everything here that looks into the controller during a run
//! asks this one place.

use standfast::core::control::{Account, CpiController};
use standfast::sim::episode::Tick;
use std::any::Any;

/// What the controller did at a tick, and why; None if it is of another kind.
pub fn account<'a>(tick: &Tick<'a>) -> Option<Account<'a>> {
    let controller = tick.controller? as &dyn Any;
    controller.downcast_ref::<CpiController>().map(CpiController::account)
}
