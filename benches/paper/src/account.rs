//! What the controller says of a tick. Everything here that looks into the controller during a run asks this one place.

use standfast::control::Account;
use standfast::episode::Tick;

/// What the controller did at a tick, and why.
pub fn account<'t, 'a>(tick: &'t Tick<'a>) -> &'t Account<'a> {
    &tick.account
}
