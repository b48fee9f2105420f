//! Tests and intervals that do not depend on campaigns: rates ([`rate`]), paired outcomes ([`mcnemar`]) and paired
//! numbers ([`ranks`]), what is decided between two of several sets ([`decision`]), success against impulse ([`curve`]),
//! intervals that hold at every look ([`sequential`]), and the search for the impulse of 50 % recovery with few pushes
//! ([`psychometric`]).

pub mod curve;
pub mod decision;
pub mod mcnemar;
pub mod psychometric;
pub mod ranks;
pub mod rate;
pub mod sequential;
