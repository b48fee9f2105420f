//! Tests and intervals that do not depend on campaigns: rates ([`rate`]), paired outcomes ([`mcnemar`]) and how far
//! they agree ([`kappa`]), the decision between two of several controllers ([`decision`]),
//! success against impulse ([`curve`]), intervals that hold at any time ([`sequential`]), the search for the impulse
//! of 50 % recovery with few pushes ([`psychometric`]), and whether a few pushes agree with what was predicted of them
//! ([`sheet`]).

#![forbid(unsafe_code)]

pub mod curve;
pub mod decision;
pub mod kappa;
pub mod mcnemar;
pub mod psychometric;
pub mod rate;
pub mod sequential;
pub mod sheet;
